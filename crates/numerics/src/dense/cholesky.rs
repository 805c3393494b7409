//! Cholesky factor of a large dense matrix, on all threads.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, Par};
use rayon::iter::{IndexedParallelIterator, ParallelIterator};

use super::parallel::in_rows;
use super::sequential::{cholesky, product};

/// Number of columns eliminated together.
const BLOCK: usize = 256;
/// Number of right-hand sides that one task takes.
const WIDTH: usize = 64;

/// Lower Cholesky factor L by blocks, with the inverses of its diagonal blocks, so that all work is
/// products.
pub struct BlockedCholesky {
    /// L below its diagonal blocks; its other entries have no meaning.
    below: Mat<f64>,
    /// Inverses of the diagonal blocks of L.
    inverses: Vec<Mat<f64>>,
    pivots: Vec<f64>,
}

impl BlockedCholesky {
    /// Factors a symmetric matrix (lower triangle read) on all threads, to the same bits however many;
    /// `None` where it is not positive definite.
    pub fn new(mut a: Mat<f64>) -> Option<Self> {
        let n = a.nrows();
        let (mut inverses, mut found) = (vec![], vec![]);
        for start in (0..n).step_by(BLOCK) {
            let width = BLOCK.min(n - start);
            let (left, right) = a.as_mut().split_at_col_mut(start + width);
            let (pivots, mut below) = left.get_mut(start.., start..).split_at_row_mut(width);
            let factor = cholesky(pivots.to_owned()).ok()?;
            found.extend((0..width).map(|i| factor[(i, i)].powi(2)));
            let mut inverse = Mat::identity(width, width);
            solve_lower_triangular_in_place(factor.as_ref(), inverse.as_mut(), Par::Seq);
            in_rows(below.rb_mut(), |_, mut rows| {
                let eliminated = product(rows.rb(), inverse.transpose());
                rows.copy_from(&eliminated);
            });
            inverses.push(inverse);
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
        Some(Self {
            below: a,
            inverses,
            pivots: found,
        })
    }

    /// Squares of the diagonal of L.
    pub fn pivots(&self) -> &[f64] {
        &self.pivots
    }

    /// Replaces the columns of `rhs` by the solutions, on all threads.
    pub fn solve_in_place(&self, rhs: MatMut<'_, f64>) {
        rhs.par_col_chunks_mut(WIDTH).for_each(|mut rhs| {
            let blocks = || self.inverses.iter().enumerate();
            for (block, inverse) in blocks() {
                let (first, end) = (block * BLOCK, block * BLOCK + inverse.nrows());
                let (above, below) = rhs.rb_mut().split_at_row_mut(end);
                let mut own = above.get_mut(first.., ..);
                let solved = product(inverse.as_ref(), own.rb());
                own.copy_from(&solved);
                let factor = self.below.get(end.., first..end);
                let solved = solved.as_ref();
                matmul(below, Accum::Add, factor, solved, -1.0, Par::Seq);
            }
            for (block, inverse) in blocks().rev() {
                let (first, end) = (block * BLOCK, block * BLOCK + inverse.nrows());
                let (above, below) = rhs.rb_mut().split_at_row_mut(end);
                let mut own = above.get_mut(first.., ..);
                let factor = self.below.get(end.., first..end).transpose();
                let below = below.rb();
                matmul(own.rb_mut(), Accum::Add, factor, below, -1.0, Par::Seq);
                let solved = product(inverse.transpose(), own.rb());
                own.copy_from(&solved);
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::lattice::scattered;

    /// With several blocks and tasks.
    #[test]
    fn it_solves_and_has_the_pivots_of_one_thread() {
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
        let factor = BlockedCholesky::new(Mat::from_fn(n, n, lower)).unwrap();
        factor.solve_in_place(solved.as_mut());
        let off = (&solved - &x).norm_max();
        assert!(off < 1e-11, "{off}");
        let expected = cholesky(a).unwrap();
        for (i, pivot) in factor.pivots().iter().enumerate() {
            let ratio = pivot / expected[(i, i)].powi(2);
            assert!((ratio - 1.0).abs() < 1e-11, "{i}: {ratio}");
        }
    }

    #[test]
    fn what_is_not_definite_has_none() {
        let n = BLOCK + 3;
        for wrong in [0, BLOCK + 1] {
            let diagonal = |i: usize| if i == wrong { -1.0 } else { 2.0 };
            let a = Mat::from_fn(n, n, |i, j| if i == j { diagonal(i) } else { 0.0 });
            assert!(BlockedCholesky::new(a).is_none());
        }
        let none = BlockedCholesky::new(Mat::new()).unwrap();
        assert!(none.pivots().is_empty());
    }
}
