//! Results -> files: VTU and PVD for ParaView, CSV, SVG, JSON.
