//! Writes results to files: VTU and PVD for ParaView, CSV, SVG, JSON, HTML.
//!
//! Each format has a file here. All bytes that are written here pass `file.rs`, which writes a file
//! whole or not at all; only the records of [`journal`] are added one by one. A function that
//! writes gets a path, which the program asks for by name from [`folder::OutputFolder`]:
//! summary.json then lists the file before it exists. One process at a time
//! writes into a folder ([`lock`]). What is drawn is made once ([`curves`],
//! [`fields`], `unrolled`, `colours`) and drawn twice, by [`plots`] and by [`report`]. [`words`] says
//! how numbers are written, [`warning`] has what a run tells its user to mind.
//!
//! One rule holds for all of them. A point that did not converge is named as such and has no
//! number. A number that is not finite is never written: an error names it, or JSON holds `null`.

#![forbid(unsafe_code)]
#![warn(missing_docs, clippy::missing_errors_doc)]

mod colours;
pub mod csv;
pub mod curves;
mod error;
pub mod fields;
mod file;
pub mod flank;
pub mod folder;
pub mod journal;
pub mod lock;
pub mod manifest;
pub mod plots;
pub mod report;
pub mod table;
mod unrolled;
pub mod vtu;
pub mod warning;
pub mod words;

pub use error::ExportError;
pub use file::{create_folder, name_of_part, read_json, write_file, write_json, write_whole};
