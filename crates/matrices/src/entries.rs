//! Entries of a matrix in the order of a file, and the sparse matrix that they make.

use nalgebra_sparse::CscMatrix;

use crate::error::{MatrixFault, Read};

/// Rows and columns that a matrix may have whatever the length of its file.
const FREE_ROWS: usize = 10_000;

/// One entry.
#[derive(Debug, Clone, Copy)]
struct Entry {
    row: u32,
    column: u32,
    value: f64,
}

/// Entries of a matrix, in any order.
#[derive(Debug)]
pub(crate) struct Entries {
    rows: usize,
    columns: usize,
    list: Vec<Entry>,
}

/// Checks that a file of so many bytes can be that of a matrix of this size: a matrix of finite
/// elements has entries in nearly every row.
///
/// # Errors
/// The size is beyond that.
pub(crate) fn check_size(
    rows: u64,
    columns: u64,
    bytes: usize,
) -> Result<(usize, usize), MatrixFault> {
    MatrixSizes::new(bytes).add(rows, columns)
}

/// Sizes of the matrices of one file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MatrixSizes {
    bytes: usize,
    /// Columns of all matrices.
    columns: usize,
}

impl MatrixSizes {
    /// No matrices in a file of so many bytes.
    pub fn new(bytes: usize) -> Self {
        Self { bytes, columns: 0 }
    }

    /// Adds a matrix. [`check_size`] does it for a file of one.
    ///
    /// # Errors
    /// The size is beyond what the file can have.
    pub fn add(&mut self, rows: u64, columns: u64) -> Result<(usize, usize), MatrixFault> {
        let most = self.bytes.saturating_add(FREE_ROWS).min(u32::MAX as usize);
        let size = |n: u64, used: usize| {
            let n = usize::try_from(n).ok();
            n.filter(|n| n.checked_add(used).is_some_and(|sum| sum <= most))
        };
        match (size(rows, 0), size(columns, self.columns)) {
            (Some(rows), Some(columns)) => {
                self.columns += columns;
                Ok((rows, columns))
            }
            _ => Err(MatrixFault::TooLarge {
                announced: format!("a matrix of {rows} x {columns}"),
                bytes: self.bytes,
            }),
        }
    }
}

/// Most bytes of memory for an entry or a column until the matrix is made.
pub(crate) const OF_AN_ENTRY: usize = 48;
/// Most bytes of memory for a whole number of a growing list.
pub(crate) const OF_A_NUMBER: usize = 8;
/// Bytes of memory that a compressed file may become: free ones, and a number for each of its own.
const FREE_BYTES: usize = 100_000_000;
const BYTES_OF_A_BYTE: usize = 100;

/// Memory for the matrices of a compressed file. A file of which one byte becomes many
/// entries does not come from finite elements: their rows differ.
#[derive(Debug)]
pub(crate) struct Budget {
    file: usize,
    left: usize,
}

impl Budget {
    /// Budget for a file of this length.
    pub fn new(bytes: usize) -> Self {
        let more = bytes.saturating_mul(BYTES_OF_A_BYTE);
        Self {
            file: bytes,
            left: FREE_BYTES.saturating_add(more),
        }
    }

    /// Takes bytes for a matrix of a name.
    ///
    /// # Errors
    /// Too few bytes are left.
    pub fn charge(&mut self, bytes: usize, name: &str) -> Result<(), MatrixFault> {
        let left = self.left.checked_sub(bytes);
        self.left = left.ok_or_else(|| MatrixFault::Inflated {
            name: name.to_owned(),
            bytes: self.file,
        })?;
        Ok(())
    }

    /// Takes bytes for the rows and columns of a matrix.
    ///
    /// # Errors
    /// Too few bytes are left.
    pub fn size(&mut self, rows: u64, columns: u64, name: &str) -> Result<[usize; 2], MatrixFault> {
        let size = [rows, columns].map(|n| u32::try_from(n).ok());
        let [Some(rows), Some(columns)] = size else {
            return Err(MatrixFault::TooLarge {
                announced: format!("a matrix of {rows} x {columns}"),
                bytes: self.file,
            });
        };
        let [rows, columns] = [rows as usize, columns as usize];
        let bytes = rows * OF_A_NUMBER + columns * OF_AN_ENTRY;
        self.charge(bytes, name)?;
        Ok([rows, columns])
    }
}

impl Entries {
    /// No entries of a matrix whose size [`check_size`] passed.
    pub fn new(rows: usize, columns: usize) -> Self {
        Self {
            rows,
            columns,
            list: Vec::new(),
        }
    }

    /// Asks for memory for so many entries.
    pub fn reserve(&mut self, entries: usize) {
        self.list.reserve(entries);
    }

    /// Sets the size of a matrix whose file does not announce it.
    pub fn resize(&mut self, rows: usize, columns: usize) {
        (self.rows, self.columns) = (rows, columns);
    }

    /// Adds an entry, counted from 0.
    pub fn push(&mut self, row: usize, column: usize, value: f64) {
        let [row, column] = [row, column].map(|n| n as u32);
        self.list.push(Entry { row, column, value });
    }

    /// Replaces the row and the column of every entry.
    pub fn renumber(&mut self, new: &[u32]) {
        for entry in &mut self.list {
            entry.row = new[entry.row as usize];
            entry.column = new[entry.column as usize];
        }
    }

    /// Returns `true` if no entry stands opposite another across the diagonal: the file has one of
    /// each pair.
    pub fn is_one_sided(&self) -> bool {
        let key = |a: u32, b: u32| (u64::from(a) << 32) | u64::from(b);
        let is_lower = |e: &&Entry| e.row > e.column;
        let lower = self.list.iter().filter(is_lower);
        let mut lower: Vec<u64> = lower.map(|e| key(e.row, e.column)).collect();
        let upper = || self.list.iter().filter(|e| e.row < e.column);
        if lower.is_empty() || upper().next().is_none() {
            return true;
        }
        lower.sort_unstable();
        let is_opposite = |e: &Entry| lower.binary_search(&key(e.column, e.row)).is_ok();
        !upper().any(is_opposite)
    }

    /// Adds the opposite of every entry off the diagonal.
    pub fn mirror(&mut self) {
        let count = self.list.len();
        self.list.reserve(count);
        for i in 0..count {
            let Entry { row, column, value } = self.list[i];
            if row != column {
                self.list.push(Entry {
                    row: column,
                    column: row,
                    value,
                });
            }
        }
    }

    /// Sparse matrix without zeros. Entries at one place are added.
    ///
    /// # Errors
    /// A sum that is not finite.
    pub fn into_matrix(self) -> Read<CscMatrix<f64>> {
        let Self {
            rows,
            columns,
            list,
        } = self;
        let mut ends = vec![0usize; columns + 1];
        for entry in &list {
            ends[entry.column as usize + 1] += 1;
        }
        for j in 0..columns {
            ends[j + 1] += ends[j];
        }
        let mut next = ends.clone();
        let mut sorted = vec![(0u32, 0.0); list.len()];
        for entry in &list {
            let at = &mut next[entry.column as usize];
            sorted[*at] = (entry.row, entry.value);
            *at += 1;
        }
        drop((list, next));
        let mut offsets = Vec::with_capacity(columns + 1);
        offsets.push(0);
        let (mut indices, mut values) = (Vec::new(), Vec::new());
        indices.reserve_exact(sorted.len());
        values.reserve_exact(sorted.len());
        for j in 0..columns {
            let column = &mut sorted[ends[j]..ends[j + 1]];
            if !column.is_sorted_by_key(|(row, _)| *row) {
                column.sort_by_key(|(row, _)| *row);
            }
            for same in column.chunk_by(|(a, _), (b, _)| a == b) {
                let (row, sum) = (same[0].0, same.iter().map(|(_, value)| value).sum::<f64>());
                if !sum.is_finite() {
                    let found = format!("{sum} at row {}, column {}", row + 1, j + 1);
                    let what = "the sum of entries at one place";
                    return Err(MatrixFault::NotFinite { what, found }.locate_file());
                }
                if sum != 0.0 {
                    indices.push(row as usize);
                    values.push(sum);
                }
            }
            offsets.push(indices.len());
        }
        let matrix = CscMatrix::try_from_csc_data(rows, columns, offsets, indices, values);
        Ok(matrix.expect("rows ascend and stand within the matrix"))
    }

    /// [`Self::into_matrix`] of a file that may have one of each pair of opposite entries.
    ///
    /// # Errors
    /// Those of [`Self::into_matrix`].
    pub fn into_whole_matrix(mut self) -> Read<CscMatrix<f64>> {
        if self.rows == self.columns && self.is_one_sided() {
            self.mirror();
        }
        self.into_matrix()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn one_of_each_pair_is_mirrored_and_both_stay() {
        let of = |list: &[(usize, usize, f64)]| {
            let mut entries = Entries::new(3, 3);
            for (row, column, value) in list {
                entries.push(*row, *column, *value);
            }
            entries.into_whole_matrix().unwrap()
        };
        let dense = |a: &CscMatrix<f64>| {
            let mut rows = [[0.0; 3]; 3];
            for (i, j, value) in a.triplet_iter() {
                rows[i][j] = *value;
            }
            rows
        };
        // One of each pair, on either side of the diagonal.
        let mixed = of(&[(0, 0, 1.0), (1, 0, 2.0), (1, 2, 3.0)]);
        let expected = [[1.0, 2.0, 0.0], [2.0, 0.0, 3.0], [0.0, 3.0, 0.0]];
        assert_eq!(dense(&mixed), expected);
        // Both, and different.
        let both = of(&[(0, 1, 1.0), (1, 0, 2.0), (1, 2, 3.0)]);
        let expected = [[0.0, 1.0, 0.0], [2.0, 0.0, 3.0], [0.0; 3]];
        assert_eq!(dense(&both), expected);
        // A zero stands opposite, too, and is left out of the matrix.
        let with_zero = of(&[(0, 1, 1.0), (1, 0, 0.0)]);
        assert_eq!(dense(&with_zero), [[0.0, 1.0, 0.0], [0.0; 3], [0.0; 3]]);
        assert_eq!(with_zero.nnz(), 1);
    }

    #[test]
    fn a_sum_that_overflows_is_refused() {
        let mut entries = Entries::new(1, 1);
        entries.push(0, 0, f64::MAX);
        entries.push(0, 0, f64::MAX);
        assert!(entries.into_matrix().is_err());
    }

    proptest! {
        #[test]
        fn the_matrix_has_the_sum_of_what_is_pushed(
            list in prop::collection::vec((0usize..6, 0usize..4, -3i8..4), 0..40)
        ) {
            let (mut entries, mut expected) = (Entries::new(6, 4), [[0.0; 4]; 6]);
            for (row, column, value) in &list {
                entries.push(*row, *column, f64::from(*value));
                expected[*row][*column] += f64::from(*value);
            }
            let matrix = entries.into_matrix().unwrap();
            let mut found = [[0.0; 4]; 6];
            for (i, j, value) in matrix.triplet_iter() {
                prop_assert!(*value != 0.0);
                found[i][j] = *value;
            }
            prop_assert_eq!(found, expected);
        }
    }
}
