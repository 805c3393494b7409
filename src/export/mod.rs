//! Writes results to files: VTU and PVD for ParaView, CSV, SVG, JSON.
//!
//! One rule holds for all of them. A point that did not converge is named as such and has no
//! number. A number that is not finite is never written: an error names it, or JSON holds `null`.

mod colours;
pub mod csv;
pub mod curves;
mod error;
pub mod fields;
mod file;
pub mod flank;
pub mod folder;
pub mod journal;
pub mod manifest;
pub mod plots;
pub mod report;
pub mod table;
mod unrolled;
pub mod vtu;

pub use error::ExportError;
pub use file::{create_folder, name_of_part, read_json, write_file, write_json, write_whole};
