//! Errors of a file of matrices.

use std::fmt;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// Error of a file of matrices that cannot be used.
#[derive(Debug, Error)]
#[error("{}{place}{fault}", file(path.as_deref()))]
#[non_exhaustive]
pub struct MatrixError {
    /// File; `None` for matrices that were read before.
    pub path: Option<PathBuf>,
    /// Place in the file.
    pub place: FilePosition,
    /// Fault at that place.
    pub fault: MatrixFault,
}

/// Beginning of a message about a file.
fn file(path: Option<&Path>) -> String {
    path.map_or(String::new(), |path| format!("{}: ", path.display()))
}

/// Place of an error in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FilePosition {
    /// File as a whole.
    File,
    /// Line of a text, counted from 1.
    Line(usize),
    /// Byte of a binary file, counted from 0. In a compressed variable of Matlab it is counted in
    /// what is decompressed.
    Byte(usize),
}

impl fmt::Display for FilePosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, "line {line}: "),
            Self::Byte(byte) => write!(f, "byte {byte}: "),
        }
    }
}

/// Fault of a file of matrices.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum MatrixFault {
    #[error("{why}")]
    File { why: String },
    #[error("the file is empty: write it again")]
    Empty,
    #[error(
        "the format is not known; read are MatrixMarket (.mtx), CalculiX' .sti and .mas, Abaqus' \
         matrices and substructures (.mtx), Nastran's OUTPUT4 (.op4), Matlab's .mat up to version \
         7 and Ansys' Harwell-Boeing files (HBMAT): write one of them, for example by \
         `scipy.io.mmwrite`"
    )]
    UnknownFormat,
    #[error("this is {what}, which is not read; {remedy}")]
    NotRead { what: String, remedy: &'static str },
    #[error("found {found}, expected {expected}; {remedy}")]
    Malformed {
        found: String,
        expected: String,
        remedy: &'static str,
    },
    #[error(
        "{what} is `{found}`, expected a finite number: the program that wrote it had no result; \
         look at its messages and write the matrix again"
    )]
    NotFinite { what: &'static str, found: String },
    #[error(
        "{announced} is announced, which does not stand in {bytes} bytes: the file is damaged or \
         cut off; write it again"
    )]
    TooLarge { announced: String, bytes: usize },
    #[error(
        "the file ends before {missing}: it is cut off; write it again, and wait for the program \
         that writes it to end"
    )]
    CutOff { missing: String },
    #[error(
        "the {what} {found} is outside the {most} of the matrix: the file is damaged, or its size \
         is that of another matrix; write it again"
    )]
    OutOfRange {
        what: &'static str,
        found: String,
        most: usize,
    },
    #[error(
        "the file has no matrix of real numbers ({left_out}): write the stiffness and the mass as \
         real matrices"
    )]
    NoMatrix { left_out: String },
    #[error(
        "no matrix is called `{name}`, the file has {names}: give one of these names (only \
         matrices of real numbers are read)"
    )]
    NoSuchName { name: String, names: String },
    #[error("{variable}, and no matrix of real numbers: give another name, the file has {names}")]
    NotAMatrix { variable: String, names: String },
    #[error(
        "it has {count} matrices of one column{called}; a load is a matrix of one column with a \
         value for each row: give the file with it, and its name if the file has several"
    )]
    NotOneColumn { count: usize, called: String },
    #[error(
        "`{name}` becomes too large for a compressed file of {bytes} bytes: the file is damaged; \
         write it again, without compression (`save -v6`) if the matrix is meant to be so large"
    )]
    Inflated { name: String, bytes: usize },
    #[error("which matrix is the {quantity} is not clear, the file has {names}: give its name")]
    Unclear {
        quantity: &'static str,
        names: String,
    },
    #[error(
        "the {quantity} is expected, and the only matrix is called `{name}`: give the file with \
         the {quantity}, or give the name `{name}` if it is meant"
    )]
    OtherQuantity {
        quantity: &'static str,
        name: String,
    },
    #[error(
        "direction {direction} of node {node} is not read, only 1, 2, 3 (displacements) and 4, 5, \
         6 (rotations): write the matrices of a model without temperatures, pressures and warping"
    )]
    Direction { node: u64, direction: u64 },
    #[error("{what} stands in rows {first} and {second}: each may have one row; correct the table")]
    RowTwice {
        what: String,
        first: usize,
        second: usize,
    },
    #[error(
        "{matrix} has {rows} rows, and the table of rows {labels}: give the table that was \
         written with the matrix"
    )]
    RowCount {
        matrix: String,
        rows: usize,
        labels: usize,
    },
    #[error(
        "{matrix} has no labels of rows: give a table of rows (CalculiX' .dof, or a table with \
         the columns node and direction)"
    )]
    Unlabelled { matrix: String },
    #[error(
        "{matrix} has a row of {what}, which the other matrix lacks: write both matrices from one \
         model"
    )]
    RowNotThere { matrix: String, what: String },
    #[error(
        "{matrix} has {found} generalised coordinates and the other matrix {expected}, and they \
         have no labels: write both matrices with the same ones"
    )]
    GeneralisedCount {
        matrix: String,
        found: usize,
        expected: usize,
    },
}

/// Fault with its place, before the file is known.
#[derive(Debug)]
pub(crate) struct Failure {
    place: FilePosition,
    fault: MatrixFault,
}

pub(crate) type Read<T> = Result<T, Failure>;

impl Failure {
    pub fn fileless_error(self) -> MatrixError {
        MatrixError {
            path: None,
            place: self.place,
            fault: self.fault,
        }
    }

    pub fn error_in_file(self, path: &Path) -> MatrixError {
        MatrixError {
            path: Some(path.to_owned()),
            ..self.fileless_error()
        }
    }
}

impl MatrixFault {
    /// Fault of a line, counted from 1.
    pub(crate) fn locate_line(self, line: usize) -> Failure {
        let place = FilePosition::Line(line);
        Failure { place, fault: self }
    }

    /// Fault of a byte, counted from 0.
    pub(crate) fn locate_byte(self, byte: usize) -> Failure {
        let place = FilePosition::Byte(byte);
        Failure { place, fault: self }
    }

    /// Fault of the file as a whole.
    pub(crate) fn locate_file(self) -> Failure {
        let place = FilePosition::File;
        Failure { place, fault: self }
    }

    pub(crate) fn malformed(
        found: impl Into<String>,
        expected: impl Into<String>,
        remedy: &'static str,
    ) -> Self {
        Self::Malformed {
            found: found.into(),
            expected: expected.into(),
            remedy,
        }
    }
}

/// Remedy for a file whose content contradicts itself.
pub(crate) const WRITE_AGAIN: &str = "the file is damaged or cut off; write it again";
