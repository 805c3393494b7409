//! Matrices that a file has, before one of them is asked for.
//!
//! A matrix that cannot be read does no harm to the others: its fault is reported when it is chosen.

use std::path::{Path, PathBuf};

use crate::choice::{self, MatrixQuantity};
use crate::entries::Budget;
use crate::error::{Failure, MatrixError, MatrixFault, Read};
use crate::{NamedMatrix, text};

/// Matrices of a file. Those of Matlab's files are read when they are asked for.
#[derive(Debug)]
pub struct FileMatrices<'a> {
    path: PathBuf,
    /// Length of the file.
    bytes: usize,
    list: Vec<Listed<'a>>,
    others: Vec<OtherVariable>,
}

/// One matrix of a file.
#[derive(Debug)]
pub(crate) struct Listed<'a> {
    /// Name; `None` where the format has none, or where the fault hides it.
    pub name: Option<String>,
    /// Number of columns, where it is known.
    pub columns: Option<usize>,
    pub content: MatrixContent<'a>,
}

/// State of a matrix of a file.
#[derive(Debug)]
pub(crate) enum MatrixContent<'a> {
    Read(NamedMatrix),
    Faulty(Failure),
    Unread(Box<dyn Unread + 'a>),
}

/// Matrix that can be read from its file.
pub(crate) trait Unread: std::fmt::Debug {
    fn read(&self, budget: &mut Budget) -> Read<NamedMatrix>;
}

/// Variable of another type than a matrix of real numbers.
#[derive(Debug)]
pub(crate) struct OtherVariable {
    pub name: String,
    pub what: &'static str,
}

/// Matrices and other variables of a file in the order in which they were found.
#[derive(Debug, Default)]
pub(crate) struct FoundMatrices<'a> {
    pub list: Vec<Listed<'a>>,
    pub others: Vec<OtherVariable>,
}

impl<'a> FoundMatrices<'a> {
    /// Adds a matrix that was read, or its fault.
    pub fn add(&mut self, name: Option<String>, columns: usize, matrix: Read<NamedMatrix>) {
        self.list.push(Listed {
            name,
            columns: Some(columns),
            content: match matrix {
                Ok(matrix) => MatrixContent::Read(matrix),
                Err(failure) => MatrixContent::Faulty(failure),
            },
        });
    }

    /// Contents of a file of this length.
    ///
    /// # Errors
    /// The file lacks matrices.
    pub fn finish(self, path: &Path, bytes: usize) -> Result<FileMatrices<'a>, MatrixError> {
        let Self { list, others } = self;
        if list.is_empty() {
            let others: Vec<String> = others.iter().map(OtherVariable::to_string).collect();
            let left_out = match &others[..] {
                [] => "it has no variables".to_owned(),
                others => text::printable(others.join(", ").as_bytes()),
            };
            return Err(MatrixFault::NoMatrix { left_out }
                .locate_file()
                .error_in_file(path));
        }
        let path = path.to_owned();
        Ok(FileMatrices {
            path,
            bytes,
            list,
            others,
        })
    }
}

impl std::fmt::Display for OtherVariable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}` is {}", self.name, self.what)
    }
}

impl FileMatrices<'_> {
    /// Chooses a matrix: the one of a name; else the only one; else the one with a customary name of
    /// the quantity, such as `K`, `KAA` or `STIFFNESS`, and `M`, `MAA` or `MASS`.
    ///
    /// # Errors
    /// No matrix of the name, or none that the rule singles out; a fault of the chosen one. The only
    /// matrix is not taken where it has a customary name of the other quantity.
    pub fn choose(
        self,
        quantity: MatrixQuantity,
        name: Option<&str>,
    ) -> Result<NamedMatrix, MatrixError> {
        let names: Vec<Option<&str>> = self.list.iter().map(|m| m.name.as_deref()).collect();
        let other = |name: &str| {
            let called = self.others.iter().find(|o| o.name == name);
            called.map(OtherVariable::to_string)
        };
        match choice::pick(&names, quantity, name, other) {
            Ok(found) => self.read(found),
            Err(fault) => self.nameless_or(fault),
        }
    }

    /// Values of the matrix of one column that has this name, or of the only one.
    ///
    /// # Errors
    /// No such matrix, or several; a fault of it.
    pub fn column(self, name: Option<&str>) -> Result<Vec<f64>, MatrixError> {
        let list = self.list.iter().enumerate();
        let columns = list.filter(|(_, m)| m.columns == Some(1));
        let called = columns.filter(|(_, m)| name.is_none() || m.name.as_deref() == name);
        let indices: Vec<usize> = called.map(|(i, _)| i).collect();
        let &[only] = &indices[..] else {
            let count = indices.len();
            let called = name.map_or(String::new(), |name| {
                format!(" called `{}`", text::printable(name.as_bytes()))
            });
            return self.nameless_or(MatrixFault::NotOneColumn { count, called });
        };
        let matrix = self.read(only)?.matrix;
        let mut values = vec![0.0; matrix.nrows()];
        for (row, _, value) in matrix.triplet_iter() {
            values[row] = *value;
        }
        Ok(values)
    }

    /// Reads all matrices.
    ///
    /// # Errors
    /// The first fault of one of them.
    pub fn read_all(self) -> Result<Vec<NamedMatrix>, MatrixError> {
        let mut budget = Budget::new(self.bytes);
        let read = self.list.into_iter();
        let read = read.map(|m| m.content.read(&mut budget));
        let read: Read<Vec<NamedMatrix>> = read.collect();
        read.map_err(|failure| failure.error_in_file(&self.path))
    }

    fn read(mut self, index: usize) -> Result<NamedMatrix, MatrixError> {
        let chosen = self.list.swap_remove(index);
        let read = chosen.content.read(&mut Budget::new(self.bytes));
        read.map_err(|failure| failure.error_in_file(&self.path))
    }

    /// Fault of a matrix whose name it hides, which may be the one that was meant; else this one.
    fn nameless_or<T>(self, fault: MatrixFault) -> Result<T, MatrixError> {
        let nameless = self.list.into_iter().find_map(|m| match m.content {
            MatrixContent::Faulty(failure) if m.columns.is_none() => Some(failure),
            _ => None,
        });
        let failure = nameless.unwrap_or_else(|| fault.locate_file());
        Err(failure.error_in_file(&self.path))
    }
}

impl MatrixContent<'_> {
    fn read(self, budget: &mut Budget) -> Read<NamedMatrix> {
        match self {
            Self::Read(matrix) => Ok(matrix),
            Self::Faulty(failure) => Err(failure),
            Self::Unread(matrix) => matrix.read(budget),
        }
    }
}
