//! Operations on sparse matrices beyond nalgebra-sparse: submatrices, products with dense blocks on
//! all threads, K + s M. Results do not depend on the number of threads.

use std::borrow::Cow;

use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Mat, MatMut, MatRef};
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

/// View of a nalgebra-sparse matrix for faer, without a copy.
pub fn view(a: &CscMatrix<f64>) -> SparseColMatRef<'_, usize, f64> {
    SparseColMatRef::new(symbolic_view(a.pattern()), a.values())
}

/// View of a pattern of columns for faer, without a copy.
pub fn symbolic_view(pattern: &SparsityPattern) -> SymbolicSparseColMatRef<'_, usize> {
    SymbolicSparseColMatRef::new_checked(
        pattern.minor_dim(),
        pattern.major_dim(),
        pattern.major_offsets(),
        None,
        pattern.minor_indices(),
    )
}

/// Rows and columns of `a` in the two lists, in their order; rows must ascend. Panics on an index
/// that `a` does not have.
pub fn submatrix(a: &CscMatrix<f64>, rows: &[usize], columns: &[usize]) -> CscMatrix<f64> {
    const ABSENT: usize = usize::MAX;
    debug_assert!(rows.is_sorted_by(|x, y| x < y), "rows must ascend");
    let mut position = vec![ABSENT; a.nrows()];
    for (new, &old) in rows.iter().enumerate() {
        position[old] = new;
    }
    let is_kept = |row: &&usize| position[**row] != ABSENT;
    let mut offsets = Vec::with_capacity(columns.len() + 1);
    offsets.push(0);
    let mut entries = 0;
    for &column in columns {
        entries += a.col(column).row_indices().iter().filter(is_kept).count();
        offsets.push(entries);
    }
    let mut indices = Vec::with_capacity(entries);
    let mut values = Vec::with_capacity(entries);
    for &column in columns {
        let column = a.col(column);
        for (&row, &value) in column.row_indices().iter().zip(column.values()) {
            if position[row] != ABSENT {
                indices.push(position[row]);
                values.push(value);
            }
        }
    }
    CscMatrix::try_from_csc_data(rows.len(), columns.len(), offsets, indices, values)
        .expect("ascending rows of a valid matrix stay a valid matrix")
}

/// First `count` rows and columns of `a`, in its own memory.
pub fn leading(a: CscMatrix<f64>, count: usize) -> CscMatrix<f64> {
    let (mut offsets, mut indices, mut values) = a.disassemble();
    let mut kept = 0;
    for column in 0..count {
        for at in offsets[column]..offsets[column + 1] {
            if indices[at] < count {
                (indices[kept], values[kept]) = (indices[at], values[at]);
                kept += 1;
            }
        }
        offsets[column] = kept;
    }
    offsets.truncate(count);
    offsets.insert(0, 0);
    indices.truncate(kept);
    values.truncate(kept);
    indices.shrink_to_fit();
    values.shrink_to_fit();
    CscMatrix::try_from_csc_data(count, count, offsets, indices, values)
        .expect("the first rows of a valid matrix stay a valid matrix")
}

/// Sum `k + s m`, on one pattern of entries where the two share it, otherwise on the union.
pub fn sum(k: &CscMatrix<f64>, s: f64, m: &CscMatrix<f64>) -> CscMatrix<f64> {
    if k.pattern() == m.pattern() {
        let mut sum = k.clone();
        for (k, m) in sum.values_mut().iter_mut().zip(m.values()) {
            *k += s * m;
        }
        sum
    } else if let Some(sum) = sum_within(k, s, m) {
        sum
    } else {
        k + &(m * s)
    }
}

/// Matrix `k` with a place for every entry of `m`: zeros are stored where it has none. It is not copied
/// if it has all places already.
pub fn extend_pattern<'a>(k: &'a CscMatrix<f64>, m: &CscMatrix<f64>) -> Cow<'a, CscMatrix<f64>> {
    let has_places = |j: usize| {
        let (of_k, of_m) = (k.col(j), m.col(j));
        let mut places = of_k.row_indices().iter();
        let mut rows = of_m.row_indices().iter();
        rows.all(|row| places.any(|place| place == row))
    };
    let same_size = (k.nrows(), k.ncols()) == (m.nrows(), m.ncols());
    if !same_size || k.pattern() == m.pattern() || (0..k.ncols()).into_par_iter().all(has_places) {
        return Cow::Borrowed(k);
    }
    let mut zeros = m.clone();
    zeros.values_mut().fill(0.0);
    Cow::Owned(k + &zeros)
}

/// Sum `k + s m` where `k` stores every entry of `m`.
fn sum_within(k: &CscMatrix<f64>, s: f64, m: &CscMatrix<f64>) -> Option<CscMatrix<f64>> {
    if (k.nrows(), k.ncols()) != (m.nrows(), m.ncols()) {
        return None;
    }
    let mut sum = k.clone();
    for (mut into, from) in sum.col_iter_mut().zip(m.col_iter()) {
        let (rows, values) = into.rows_and_values_mut();
        let mut at = 0;
        for (row, v) in from.row_indices().iter().zip(from.values()) {
            at += rows[at..].iter().position(|r| r == row)?;
            values[at] += s * v;
        }
    }
    Some(sum)
}

/// Product `a x` for a dense block of columns.
pub fn times(a: &CscMatrix<f64>, x: MatRef<'_, f64>) -> Mat<f64> {
    multiply_panels(a, x, |y, x| panel_times(a, x, y))
}

/// Product `a x`, with `compute` called for each panel of its columns and of those of `x`.
fn multiply_panels(
    a: &CscMatrix<f64>,
    x: MatRef<'_, f64>,
    compute: impl Fn(MatMut<'_, f64>, MatRef<'_, f64>) + Sync,
) -> Mat<f64> {
    let mut y = Mat::zeros(a.nrows(), x.ncols());
    if a.nrows() == 0 || a.ncols() == 0 || x.ncols() == 0 {
        return y;
    }
    y.par_col_chunks_mut(PANEL)
        .zip(x.par_col_chunks(PANEL))
        .for_each(|(y, x)| compute(y, x));
    y
}

/// Number of columns multiplied together: one row of the panel is a cache line.
const PANEL: usize = 8;
/// Least number of rows of a product that one task computes.
const ROWS: usize = 2048;

/// Computes `y = a x` for at most [`PANEL`] columns, gathered row by row so that each entry of `a`
/// multiplies consecutive numbers.
fn panel_times(a: &CscMatrix<f64>, x: MatRef<'_, f64>, mut y: MatMut<'_, f64>) {
    let width = x.ncols();
    let mut sums = vec![[0.0; PANEL]; a.nrows()];
    let mut row = [0.0; PANEL];
    for (j, column) in a.col_iter().enumerate() {
        for (c, r) in row.iter_mut().enumerate().take(width) {
            *r = x[(j, c)];
        }
        for (&i, v) in column.row_indices().iter().zip(column.values()) {
            for (s, r) in sums[i].iter_mut().zip(&row) {
                *s += v * r;
            }
        }
    }
    for c in 0..width {
        for (y, s) in y.as_mut().col_mut(c).iter_mut().zip(&sums) {
            *y = s[c];
        }
    }
}

/// Product `a x` for a symmetric `a` with both triangles stored and a dense block of columns. Each
/// row of the product is gathered in registers.
pub fn symmetric_product(a: &CscMatrix<f64>, x: MatRef<'_, f64>) -> Mat<f64> {
    multiply_panels(a, x, |mut y, x| {
        let mut rows = vec![[0.0; PANEL]; a.nrows()];
        for (c, column) in x.col_iter().enumerate() {
            for (row, v) in rows.iter_mut().zip(column.iter()) {
                row[c] = *v;
            }
        }
        let product: Vec<[f64; PANEL]> = (0..a.ncols())
            .into_par_iter()
            .with_min_len(ROWS)
            .map(|j| {
                let column = a.col(j);
                let mut sum = [0.0; PANEL];
                for (&i, v) in column.row_indices().iter().zip(column.values()) {
                    for (s, r) in sum.iter_mut().zip(&rows[i]) {
                        *s += v * r;
                    }
                }
                sum
            })
            .collect();
        for (c, column) in y.as_mut().col_iter_mut().enumerate() {
            for (into, row) in column.iter_mut().zip(&product) {
                *into = row[c];
            }
        }
    })
}

/// Computes `y = a x` for a symmetric `a` with both triangles stored, on the calling thread.
pub fn symmetric_times(a: &CscMatrix<f64>, x: &[f64], y: &mut [f64]) {
    for (y, column) in y.iter_mut().zip(a.col_iter()) {
        *y = column
            .row_indices()
            .iter()
            .zip(column.values())
            .map(|(&i, v)| v * x[i])
            .sum();
    }
}

/// Dense copy of a sparse matrix.
pub fn dense(a: &CscMatrix<f64>) -> Mat<f64> {
    let mut d = Mat::zeros(a.nrows(), a.ncols());
    for (i, j, v) in a.triplet_iter() {
        d[(i, j)] += v;
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::lattice::{Lattice, scattered};

    fn matrices() -> (CscMatrix<f64>, CscMatrix<f64>) {
        let lattice = Lattice::new([4, 3, 3], 2.0, 0.3, 0.5);
        lattice.cantilever()
    }

    #[test]
    fn submatrices_and_sums_are_the_dense_ones() {
        let (k, m) = matrices();
        let (rows, columns) = (vec![0, 2, 3, 40, 71], vec![70, 3, 2]);
        let (sub, whole) = (dense(&submatrix(&k, &rows, &columns)), dense(&k));
        for (i, &row) in rows.iter().enumerate() {
            for (j, &column) in columns.iter().enumerate() {
                assert_eq!(sub[(i, j)], whole[(row, column)]);
            }
        }
        assert_eq!(submatrix(&k, &[], &columns).ncols(), 3);
        let first: Vec<usize> = (0..50).collect();
        assert_eq!(leading(k.clone(), 50), submatrix(&k, &first, &first));
        let expected = dense(&k) - faer::Scale(7.0) * dense(&m);
        assert!((dense(&sum(&k, -7.0, &m)) - &expected).norm_max() < 1e-14);
        let other = CscMatrix::identity(k.nrows());
        let expected = dense(&k) + faer::Scale(3.0) * dense(&other);
        assert!((dense(&sum(&k, 3.0, &other)) - expected).norm_max() < 1e-14);
    }

    #[test]
    fn a_matrix_gets_the_places_of_another_one() {
        let k = CscMatrix::identity(9);
        assert!(matches!(extend_pattern(&k, &k), Cow::Borrowed(_)));
        let mut far = nalgebra_sparse::CooMatrix::from(&k);
        far.push(7, 1, 3.0);
        far.push(1, 7, 3.0);
        let far = CscMatrix::from(&far);
        let padded = extend_pattern(&k, &far);
        assert_eq!(padded.nnz(), k.nnz() + 2);
        assert_eq!(dense(&padded), dense(&k));
        assert!(sum_within(&padded, -2.0, &far).is_some());
        assert!(matches!(extend_pattern(&padded, &far), Cow::Borrowed(_)));
    }

    #[test]
    fn products_are_the_dense_ones() {
        let (k, _) = matrices();
        let n = k.nrows();
        let x = Mat::from_fn(n, 150, |i, j| scattered(i + n * j));
        let expected = dense(&k) * &x;
        assert!((times(&k, x.as_ref()) - &expected).norm_max() < 1e-13);
        assert!((symmetric_product(&k, x.as_ref()) - &expected).norm_max() < 1e-13);
        let mut y = vec![0.0; n];
        symmetric_times(&k, x.col_as_slice(7), &mut y);
        assert!((0..n).all(|i| (y[i] - expected[(i, 7)]).abs() < 1e-13));
        assert_eq!(times(&k, Mat::zeros(n, 0).as_ref()).ncols(), 0);
    }
}
