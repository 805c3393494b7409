//! Results -> files: VTU and PVD for ParaView, CSV, SVG, JSON.
//!
//! One rule for all of them: a point that did not converge is named as such and has no number, and
//! a number that is not finite is never written (an error names it, or JSON holds `null`).

pub mod csv;
mod error;
mod file;
pub mod flank;
pub mod manifest;
pub mod plots;
pub mod vtu;

pub use error::ExportError;
pub use file::{create_folder, write_file, write_whole};
