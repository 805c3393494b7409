//! Conversion of the bytes of a file to sparse matrices of other finite element programs, and of
//! tables that say which node and direction their rows belong to.
//!
//! [`parse`] reads every format: MatrixMarket, CalculiX' matrix storage, Abaqus' matrices and
//! substructures, Nastran's OUTPUT4, Matlab's .mat and Ansys' Harwell-Boeing files.
//! [`FileMatrices::choose`] finds the stiffness or the mass among the matrices of a file.
//! [`parse_rows`] reads tables of rows. [`expand_to_rows`] brings a matrix with labels onto the
//! rows of another one. [`write_matrix_market`] writes a matrix, [`read_matrix_market`] reads a
//! dense one.
//!
//! These rules hold for every format:
//! - A matrix is whole: of a file that has one of each pair of opposite entries both are made. A
//!   file that has both is taken as it is, whether they are equal or not.
//! - Entries are finite numbers and not zero; several at one place are added.
//! - A file needs memory for its contents, not for the numbers in its header. A compressed file needs
//!   at most 100 MB and 100 bytes for each of its own.
//! - A matrix that cannot be read does no harm to the others of its file.
//! - No file is opened here. The path is for messages.
//!
//! The stiffness of two masses that a spring joins, as CalculiX writes it, and its rows:
//!
//! ```
//! # fn main() -> Result<(), dovetail_matrices::MatrixError> {
//! use dovetail_matrices::{MatrixQuantity, Row, parse, parse_rows};
//! use std::path::Path;
//!
//! let path = Path::new("job.sti");
//! let matrices = parse(path, b"1 1 2.0e3\n1 2 -2.0e3\n2 2 2.0e3\n")?;
//! let stiffness = matrices.choose(MatrixQuantity::Stiffness, None)?.matrix;
//! assert_eq!(stiffness.get_entry(1, 0).unwrap().into_value(), -2e3);
//!
//! let rows = parse_rows(Path::new("job.dof"), b"7.1\n10.1\n")?;
//! assert_eq!(rows[1], Row::Node { node: 10, direction: 1 });
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs, clippy::missing_errors_doc)]

use std::path::Path;

use nalgebra_sparse::CscMatrix;

mod choice;
mod columns;
mod contents;
mod detect;
mod entries;
mod error;
mod fortran;
mod harwell_boeing;
mod mat;
mod matrix_market;
mod op4;
mod substructure;
mod table;
mod text;

pub use dovetail_mesh::Row;

pub use choice::{MatrixQuantity, expand_to_rows};
pub use contents::FileMatrices;
pub use error::{FilePosition, MatrixError, MatrixFault};
pub use matrix_market::{read_matrix_market, write as write_matrix_market};

use detect::MatrixFormat;

/// One matrix of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedMatrix {
    /// Name in the file; `None` where the format has none.
    pub name: Option<String>,
    /// Whole matrix: both triangles where the file stores one of a symmetric one; rows ascending in
    /// each column.
    pub matrix: CscMatrix<f64>,
    /// Rows, where the file names them.
    pub rows: Option<Vec<Row>>,
}

/// Finds the matrices of a file, whatever its format.
///
/// # Errors
/// Bytes in an unknown format, and a file without a matrix of real numbers. A fault of one of several
/// matrices is reported when the matrix is chosen.
pub fn parse<'a>(path: &Path, bytes: &'a [u8]) -> Result<FileMatrices<'a>, MatrixError> {
    let format =
        detect::detect(path, bytes).map_err(|fault| fault.locate_file().error_in_file(path))?;
    let one = |matrix: NamedMatrix| {
        let mut matrices = contents::FoundMatrices::default();
        matrices.add(matrix.name.clone(), matrix.matrix.ncols(), Ok(matrix));
        matrices
    };
    let result = match format {
        MatrixFormat::MatrixMarket => matrix_market::parse(bytes).map(one),
        MatrixFormat::Numbered => columns::numbered(bytes).map(one),
        MatrixFormat::Labelled => columns::labelled(bytes).map(one),
        MatrixFormat::Substructure => substructure::parse(bytes),
        MatrixFormat::Op4Text => op4::parse_text(bytes),
        MatrixFormat::Op4Binary => op4::parse_binary(bytes),
        MatrixFormat::Mat => mat::parse(bytes),
        MatrixFormat::HarwellBoeing => harwell_boeing::parse(bytes).map(one),
    };
    let matrices = result.map_err(|failure| failure.error_in_file(path))?;
    matrices.finish(path, bytes.len())
}

/// Reads a table of what the rows of a matrix are: CalculiX' .dof; a table with the columns `node`
/// and `direction`, and if need be `row`, between commas, semicolons, tabs or blanks; or Ansys'
/// mapping file. Directions are 1 to 6 or x, y, z, ux, uy, uz, rotx, roty, rotz. A row whose node
/// is empty or `-` is a generalised coordinate.
///
/// # Errors
/// Bytes that are not such a table.
pub fn parse_rows(path: &Path, bytes: &[u8]) -> Result<Vec<Row>, MatrixError> {
    table::parse(bytes).map_err(|failure| failure.error_in_file(path))
}
