//! Matrices that a file has, before one of them is asked for.
//!
//! A matrix that cannot be read does no harm to the others: its fault is reported when it is chosen.

use std::path::{Path, PathBuf};

use crate::choice::{self, Quantity};
use crate::entries::Budget;
use crate::error::{Failure, Fault, MatrixError, Read};
use crate::{NamedMatrix, text};

/// Matrices of a file. Those of Matlab's files are read when they are asked for.
#[derive(Debug)]
pub struct Matrices<'a> {
    path: PathBuf,
    /// Length of the file.
    bytes: usize,
    list: Vec<Listed<'a>>,
    others: Vec<Other>,
}

/// One matrix of a file.
#[derive(Debug)]
pub(crate) struct Listed<'a> {
    /// Name; `None` where the format has none, or where the fault hides it.
    pub name: Option<String>,
    /// Number of columns, where it is known.
    pub columns: Option<usize>,
    pub content: Content<'a>,
}

/// State of a matrix of a file.
#[derive(Debug)]
pub(crate) enum Content<'a> {
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
pub(crate) struct Other {
    pub name: String,
    pub what: &'static str,
}

/// Matrices and other variables of a file in the order in which they were found.
#[derive(Debug, Default)]
pub(crate) struct Found<'a> {
    pub list: Vec<Listed<'a>>,
    pub others: Vec<Other>,
}

impl<'a> Found<'a> {
    /// Adds a matrix that was read, or its fault.
    pub fn add(&mut self, name: Option<String>, columns: usize, matrix: Read<NamedMatrix>) {
        self.list.push(Listed {
            name,
            columns: Some(columns),
            content: match matrix {
                Ok(matrix) => Content::Read(matrix),
                Err(failure) => Content::Faulty(failure),
            },
        });
    }

    /// Contents of a file of this length.
    ///
    /// # Errors
    /// The file lacks matrices.
    pub fn of(self, path: &Path, bytes: usize) -> Result<Matrices<'a>, MatrixError> {
        let Self { list, others } = self;
        if list.is_empty() {
            let others: Vec<String> = others.iter().map(Other::to_string).collect();
            let left_out = match &others[..] {
                [] => "it has no variables".to_owned(),
                others => text::shown(others.join(", ").as_bytes()),
            };
            return Err(Fault::NoMatrix { left_out }.in_file().of(path));
        }
        let path = path.to_owned();
        Ok(Matrices {
            path,
            bytes,
            list,
            others,
        })
    }
}

impl std::fmt::Display for Other {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}` is {}", self.name, self.what)
    }
}

impl Matrices<'_> {
    /// Chooses a matrix: the one of a name; else the only one; else the one with a customary name of
    /// the quantity, such as `K`, `KAA` or `STIFFNESS`, and `M`, `MAA` or `MASS`.
    ///
    /// # Errors
    /// No matrix of the name, or none that the rule singles out; a fault of the chosen one. The only
    /// matrix is not taken where it has a customary name of the other quantity.
    pub fn choose(
        self,
        quantity: Quantity,
        name: Option<&str>,
    ) -> Result<NamedMatrix, MatrixError> {
        let names: Vec<Option<&str>> = self.list.iter().map(|m| m.name.as_deref()).collect();
        let other = |name: &str| {
            let called = self.others.iter().find(|o| o.name == name);
            called.map(Other::to_string)
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
        let found: Vec<usize> = called.map(|(i, _)| i).collect();
        let &[only] = &found[..] else {
            let count = found.len();
            let called = name.map_or(String::new(), |name| {
                format!(" called `{}`", text::shown(name.as_bytes()))
            });
            return self.nameless_or(Fault::NotOneColumn { count, called });
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
    pub fn all(self) -> Result<Vec<NamedMatrix>, MatrixError> {
        let mut budget = Budget::of(self.bytes);
        let read = self.list.into_iter();
        let read = read.map(|m| m.content.read(&mut budget));
        let read: Read<Vec<NamedMatrix>> = read.collect();
        read.map_err(|failure| failure.of(&self.path))
    }

    fn read(mut self, index: usize) -> Result<NamedMatrix, MatrixError> {
        let chosen = self.list.swap_remove(index);
        let read = chosen.content.read(&mut Budget::of(self.bytes));
        read.map_err(|failure| failure.of(&self.path))
    }

    /// Fault of a matrix whose name it hides, which may be the one that was meant; else this one.
    fn nameless_or<T>(self, fault: Fault) -> Result<T, MatrixError> {
        let nameless = self.list.into_iter().find_map(|m| match m.content {
            Content::Faulty(failure) if m.columns.is_none() => Some(failure),
            _ => None,
        });
        let failure = nameless.unwrap_or_else(|| fault.in_file());
        Err(failure.of(&self.path))
    }
}

impl Content<'_> {
    fn read(self, budget: &mut Budget) -> Read<NamedMatrix> {
        match self {
            Self::Read(matrix) => Ok(matrix),
            Self::Faulty(failure) => Err(failure),
            Self::Unread(matrix) => matrix.read(budget),
        }
    }
}
