//! Dense operations on all threads. The work is cut into fixed parts, so that the results do not
//! depend on the number of threads.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::iter::{IndexedParallelIterator, ParallelIterator};

/// Number of columns that one task takes.
const WIDTH: usize = 64;

/// Number of columns that [`cholesky`] eliminates together.
const BLOCK: usize = 256;

/// Number of rows in a block of [`run_row_blocks`].
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
pub(crate) fn run_row_blocks(a: MatMut<'_, f64>, each: impl Fn(usize, MatMut<'_, f64>) + Sync) {
    if a.nrows() == 0 || a.ncols() == 0 {
    } else if a.nrows() <= 2 * ROWS {
        each(0, a);
    } else {
        a.par_row_chunks_mut(ROWS)
            .enumerate()
            .for_each(|(chunk, rows)| each(chunk * ROWS, rows));
    }
}

/// Runs `each` on blocks of columns, with the first column of each, on all threads.
pub(crate) fn run_column_blocks(a: MatMut<'_, f64>, each: impl Fn(usize, MatMut<'_, f64>) + Sync) {
    if a.nrows() == 0 || a.ncols() == 0 {
    } else if a.nrows() * a.ncols() <= 2 * ROWS * WIDTH {
        each(0, a);
    } else {
        a.par_col_chunks_mut(WIDTH)
            .enumerate()
            .for_each(|(chunk, columns)| each(chunk * WIDTH, columns));
    }
}

/// Lower Cholesky factor of a symmetric matrix (lower triangle read), to the same bits however many
/// threads there are; `None` where there is none. Above its diagonal the result has no meaning.
pub fn cholesky(mut a: Mat<f64>) -> Option<Mat<f64>> {
    let n = a.nrows();
    for start in (0..n).step_by(BLOCK) {
        let width = BLOCK.min(n - start);
        let (left, right) = a.as_mut().split_at_col_mut(start + width);
        let (mut pivots, mut below) = left.get_mut(start.., start..).split_at_row_mut(width);
        let factor = super::cholesky(pivots.to_owned()).ok()?;
        pivots.copy_from(&factor);
        run_row_blocks(below.rb_mut(), |_, rows| {
            solve_lower_triangular_in_place(factor.as_ref(), rows.transpose_mut(), Par::Seq);
        });
        let trailing = right.get_mut(start + width.., ..);
        trailing
            .par_col_chunks_mut(BLOCK)
            .enumerate()
            .for_each(|(chunk, columns)| {
                // On and below the diagonal block.
                let (first, count) = (chunk * BLOCK, columns.ncols());
                let rows = below.rb().get(first.., ..);
                matmul(
                    columns.get_mut(first.., ..),
                    Accum::Add,
                    rows,
                    rows.get(..count, ..).transpose(),
                    -1.0,
                    Par::Seq,
                );
            });
    }
    Some(a)
}

/// Replaces the columns of `rhs` by the solutions, given the [`cholesky`] factor.
pub fn solve_in_place(factor: MatRef<'_, f64>, rhs: MatMut<'_, f64>) {
    rhs.par_col_chunks_mut(WIDTH)
        .for_each(|rhs| super::solve_in_place(factor, rhs));
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

    /// With several blocks and tasks.
    #[test]
    fn a_factor_solves_and_has_the_pivots_of_one_thread() {
        let n = 2 * BLOCK + 90;
        let root = Mat::from_fn(n, n, |i, j| {
            scattered(i + n * j) + if i == j { 60.0 } else { 0.0 }
        });
        let a = product(root.as_ref(), root.transpose());
        let x = Mat::from_fn(n, WIDTH + 5, |i, j| scattered(7 * i + 3 * j));
        let mut solved = product(a.as_ref(), x.as_ref());
        // The upper triangle is not read.
        let is_read = |i: usize, j: usize| i / BLOCK >= j / BLOCK;
        let lower = |i, j| if is_read(i, j) { a[(i, j)] } else { f64::NAN };
        let factor = cholesky(Mat::from_fn(n, n, lower)).unwrap();
        solve_in_place(factor.as_ref(), solved.as_mut());
        let off = (&solved - &x).norm_max();
        assert!(off < 1e-11, "{off}");
        let expected = crate::dense::cholesky(a).unwrap();
        for i in 0..n {
            let ratio = factor[(i, i)] / expected[(i, i)];
            assert!((ratio - 1.0).abs() < 1e-11, "{i}: {ratio}");
        }
    }

    #[test]
    fn what_is_not_definite_has_none() {
        let n = BLOCK + 3;
        for wrong in [0, BLOCK + 1] {
            let diagonal = |i: usize| if i == wrong { -1.0 } else { 2.0 };
            let a = Mat::from_fn(n, n, |i, j| if i == j { diagonal(i) } else { 0.0 });
            assert!(cholesky(a).is_none());
        }
        assert_eq!(cholesky(Mat::new()), Some(Mat::new()));
    }
}
