//! Choice of the stiffness or the mass among the matrices of a file, and rows of one matrix brought
//! onto those of another.

use std::collections::HashMap;

use nalgebra_sparse::CscMatrix;

use crate::entries::Entries;
use crate::error::{FilePosition, MatrixError, MatrixFault};
use crate::{NamedMatrix, Row};

/// Most names in a message.
const MOST_NAMES: usize = 20;

/// Quantity that a matrix is of, by which one is chosen among several of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MatrixQuantity {
    /// Stiffness.
    Stiffness,
    /// Mass.
    Mass,
}

impl MatrixQuantity {
    fn word(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Mass => "mass",
        }
    }

    fn counterpart(self) -> Self {
        match self {
            Self::Stiffness => Self::Mass,
            Self::Mass => Self::Stiffness,
        }
    }

    /// Returns `true` for a customary name: a word, or a letter with one of Nastran's sets twice.
    fn is_called(self, name: &str) -> bool {
        let letters = name.chars().filter(|c| c.is_alphanumeric());
        let name: String = letters.map(|c| c.to_ascii_uppercase()).collect();
        let (letter, words): (_, &[&str]) = match self {
            Self::Stiffness => ('K', &["STIFFNESS", "STIFF", "STIF", "KMAT", "KRED"]),
            Self::Mass => ('M', &["MASS", "MMAT", "MRED"]),
        };
        let sets = name.strip_prefix(letter);
        let is_set = |set: &str| {
            let mut pair = set.chars();
            let (first, second) = (pair.next(), pair.next());
            set.len() == 2 && first == second && first.is_some_and(|c| "AFGHLNRTX".contains(c))
        };
        sets.is_some_and(|set| set.is_empty() || is_set(set)) || words.contains(&&name[..])
    }
}

/// Index of the matrix that is meant, see [`FileMatrices::choose`](crate::FileMatrices::choose).
/// `other` describes a variable of a name that has another type.
pub(crate) fn pick(
    matrices: &[Option<&str>],
    quantity: MatrixQuantity,
    name: Option<&str>,
    other: impl Fn(&str) -> Option<String>,
) -> Result<usize, MatrixFault> {
    let position = |is_it: &dyn Fn(&str) -> bool| {
        let is_it = |i: &usize| matrices[*i].is_some_and(is_it);
        let mut indices = (0..matrices.len()).filter(is_it);
        (indices.next(), indices.next().is_some())
    };
    if let Some(name) = name {
        let exact = position(&|other| other == name);
        let loose = position(&|other| other.eq_ignore_ascii_case(name));
        let names = || names(matrices);
        return match (exact.0, other(name), loose) {
            (Some(found), ..) | (None, None, (Some(found), false)) => Ok(found),
            (None, Some(variable), _) => Err(MatrixFault::NotAMatrix {
                variable,
                names: names(),
            }),
            _ => Err(MatrixFault::NoSuchName {
                name: crate::text::printable(name.as_bytes()),
                names: names(),
            }),
        };
    }
    if let [only] = matrices {
        let other = only.filter(|name| quantity.counterpart().is_called(name));
        return match other {
            Some(name) => Err(MatrixFault::OtherQuantity {
                quantity: quantity.word(),
                name: name.to_owned(),
            }),
            None => Ok(0),
        };
    }
    match position(&|name| quantity.is_called(name)) {
        (Some(found), false) => Ok(found),
        _ => Err(MatrixFault::Unclear {
            quantity: quantity.word(),
            names: names(matrices),
        }),
    }
}

/// Names in the form for messages.
fn names(matrices: &[Option<&str>]) -> String {
    let names = matrices.iter().flatten();
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    match names.len() {
        0 => "matrices without names".to_owned(),
        n if n > MOST_NAMES => {
            format!(
                "{} and {} more",
                names[..MOST_NAMES].join(", "),
                n - MOST_NAMES
            )
        }
        _ => names.join(", "),
    }
}

/// Brings a matrix with labels onto the rows of another one. What has no row there is zero, as the
/// mass of a massless direction. Generalised coordinates have no labels: they keep their order.
///
/// # Errors
/// A matrix without labels; a row that is not among `rows`; other numbers of generalised
/// coordinates.
pub fn expand_to_rows(matrix: NamedMatrix, rows: &[Row]) -> Result<CscMatrix<f64>, MatrixError> {
    placed(&matrix, rows).map_err(|fault| MatrixError {
        path: None,
        place: FilePosition::File,
        fault,
    })
}

fn placed(matrix: &NamedMatrix, rows: &[Row]) -> Result<CscMatrix<f64>, MatrixFault> {
    let called = || {
        let name = matrix.name.as_deref();
        name.map_or("a matrix".to_owned(), |name| format!("matrix `{name}`"))
    };
    let Some(labels) = &matrix.rows else {
        return Err(MatrixFault::Unlabelled { matrix: called() });
    };
    let matrix_rows = matrix.matrix.nrows();
    if labels.len() != matrix_rows || matrix.matrix.ncols() != matrix_rows {
        return Err(MatrixFault::RowCount {
            matrix: called(),
            rows: matrix_rows,
            labels: labels.len(),
        });
    }
    let mut places = HashMap::with_capacity(rows.len());
    let mut generalised = Vec::new();
    for (i, row) in rows.iter().enumerate() {
        if *row == Row::Generalised {
            generalised.push(i);
        } else if let Some(before) = places.insert(*row, i) {
            return Err(MatrixFault::RowTwice {
                what: row.to_string(),
                first: before + 1,
                second: i + 1,
            });
        }
    }
    let count = labels
        .iter()
        .filter(|row| **row == Row::Generalised)
        .count();
    if count != generalised.len() && count != 0 {
        return Err(MatrixFault::GeneralisedCount {
            matrix: called(),
            found: count,
            expected: generalised.len(),
        });
    }
    let mut next = generalised.into_iter();
    let mut place_of = Vec::with_capacity(labels.len());
    for row in labels {
        let place = match row {
            Row::Generalised => next.next(),
            Row::Node { .. } => places.remove(row),
        };
        place_of.push(place.ok_or_else(|| MatrixFault::RowNotThere {
            matrix: called(),
            what: row.to_string(),
        })?);
    }
    let mut entries = Entries::new(rows.len(), rows.len());
    entries.reserve(matrix.matrix.nnz());
    for (i, j, value) in matrix.matrix.triplet_iter() {
        entries.push(place_of[i], place_of[j], *value);
    }
    let placed = entries.into_matrix();
    Ok(placed.unwrap_or_else(|_| unreachable!("finite entries change their places alone")))
}
