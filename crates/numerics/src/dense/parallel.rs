//! Dense operations on all threads. The work is cut into fixed parts, so that the results do not
//! depend on the number of threads.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::iter::{IndexedParallelIterator, ParallelIterator};

/// Number of columns that one task takes.
const WIDTH: usize = 64;

/// Number of rows in a block of [`in_rows`].
const ROWS: usize = 256;

/// Product `a b` (transposes are views: `product(a.transpose(), b)`).
pub fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    if c.nrows() == 0 || c.ncols() == 0 || a.ncols() == 0 {
        return c;
    }
    c.par_col_chunks_mut(WIDTH)
        .zip(b.par_col_chunks(WIDTH))
        .for_each(|(c, b)| {
            matmul(c, Accum::Replace, a, b, 1.0, Par::Seq);
        });
    c
}

/// Computes `y = a x` for a symmetric `a`, n x n; x and y have n entries.
pub fn symmetric_times(a: MatRef<'_, f64>, x: &[f64], y: &mut [f64]) {
    let rows = y.len();
    let y = MatMut::from_column_major_slice_mut(y, rows, 1);
    let x = MatRef::from_column_major_slice(x, x.len(), 1);
    y.par_row_chunks_mut(WIDTH)
        .zip(a.par_col_chunks(WIDTH))
        .for_each(|(y, a)| matmul(y, Accum::Replace, a.transpose(), x, 1.0, Par::Seq));
}

/// Runs `each` on blocks of rows, with the first row of each, on all threads.
pub(crate) fn in_rows(a: MatMut<'_, f64>, each: impl Fn(usize, MatMut<'_, f64>) + Sync) {
    if a.nrows() == 0 || a.ncols() == 0 {
    } else if a.nrows() <= 2 * ROWS {
        each(0, a);
    } else {
        a.par_row_chunks_mut(ROWS)
            .enumerate()
            .for_each(|(chunk, rows)| each(chunk * ROWS, rows));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::lattice::scattered;

    #[test]
    fn products_are_those_of_one_thread() {
        let n = 150;
        let a = Mat::from_fn(n, n, |i, j| scattered(i.min(j) + n * i.max(j)));
        let x = Mat::from_fn(n, 200, |i, j| scattered(i + n * j));
        let expected = crate::dense::product(a.as_ref(), x.as_ref());
        assert!((product(a.as_ref(), x.as_ref()) - &expected).norm_max() < 1e-13);
        let mut y = vec![0.0; n];
        symmetric_times(a.as_ref(), x.col_as_slice(7), &mut y);
        assert!((0..n).all(|i| (y[i] - expected[(i, 7)]).abs() < 1e-13));
        let none = product(Mat::zeros(3, 0).as_ref(), Mat::zeros(0, 2).as_ref());
        assert_eq!(none, Mat::<f64>::zeros(3, 2));
    }
}
