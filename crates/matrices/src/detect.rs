//! Detection of the format of a file of matrices by its content, and by its ending where that does
//! not suffice.

use std::path::Path;

use crate::error::MatrixFault;
use crate::text::TextLines;
use crate::{columns, harwell_boeing, mat, matrix_market, op4, substructure};

/// Format that is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MatrixFormat {
    MatrixMarket,
    /// Lines `row column value`.
    Numbered,
    /// Lines `node, direction, node, direction, value`.
    Labelled,
    Substructure,
    Op4Text,
    Op4Binary,
    Mat,
    HarwellBoeing,
}

/// Finds the format of a file.
pub(crate) fn detect(path: &Path, bytes: &[u8]) -> Result<MatrixFormat, MatrixFault> {
    if bytes.trim_ascii().is_empty() {
        return Err(MatrixFault::Empty);
    }
    let not_read = |what: &str, remedy: &'static str| {
        let what = what.to_owned();
        Err(MatrixFault::NotRead { what, remedy })
    };
    let is_hdf = bytes.starts_with(b"\x89HDF\r\n\x1a\n");
    if bytes.starts_with(b"MATLAB 7.3") || is_hdf {
        let what = "a file of Matlab's version 7.3 or another HDF5 file";
        return not_read(what, "save the matrices in Matlab by `save -v7`");
    }
    if mat::is_mat_5(bytes) {
        return Ok(MatrixFormat::Mat);
    }
    if op4::is_binary(bytes) {
        return Ok(MatrixFormat::Op4Binary);
    }
    if matrix_market::is_matrix_market(bytes) {
        return Ok(MatrixFormat::MatrixMarket);
    }
    if substructure::is_substructure(bytes) {
        return Ok(MatrixFormat::Substructure);
    }
    if op4::is_text(bytes) {
        return Ok(MatrixFormat::Op4Text);
    }
    if harwell_boeing::is_harwell_boeing(bytes) {
        return Ok(MatrixFormat::HarwellBoeing);
    }
    match columns::columns(bytes) {
        Some(3) => return Ok(MatrixFormat::Numbered),
        Some(5) => return Ok(MatrixFormat::Labelled),
        Some(1) => {
            let remedy = "give it as the table of rows, and the files .sti and .mas as matrices";
            return not_read("a column of numbers, as CalculiX' .dof has it", remedy);
        }
        _ => {}
    }
    let ending = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase());
    if ending.as_deref() == Some("mat") {
        let what = "a file .mat of another version than 5 and 7";
        return not_read(what, "save the matrices in Matlab by `save -v7`");
    }
    let first = TextLines::new(bytes)
        .next()
        .map(|(_, line)| line.to_ascii_lowercase());
    let has = |word: &str| {
        let first = first.as_deref().unwrap_or_default();
        first
            .windows(word.len())
            .any(|part| part == word.as_bytes())
    };
    if has("node") && (has("direction") || has("dof")) {
        return not_read(
            "a table of rows",
            "give it as such, and a file with the matrix beside it",
        );
    }
    Err(MatrixFault::UnknownFormat)
}
