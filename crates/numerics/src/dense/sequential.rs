//! Dense operations on one thread: products, factors, eigenvalues.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::evd::{
    ComputeEigenvectors, evd_real, evd_scratch, self_adjoint_evd, self_adjoint_evd_scratch,
};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::perm::PermRef;
use faer::prelude::ReborrowMut;
use faer::traits::{ComplexField, math_utils::one};
use faer::{Accum, Mat, MatMut, MatRef, Par, Spec, c64};

/// Product a b.
pub fn product<T: ComplexField>(a: MatRef<'_, T>, b: MatRef<'_, T>) -> Mat<T> {
    let mut c = Mat::zeros(a.nrows(), b.ncols());
    matmul(&mut c, Accum::Replace, a, b, one(), Par::Seq);
    c
}

/// Computes y += s a x.
pub fn add_product(a: MatRef<'_, f64>, s: f64, x: &[f64], y: &mut [f64]) {
    let (rows, columns) = (y.len(), x.len());
    let y = MatMut::from_column_major_slice_mut(y, rows, 1);
    let x = MatRef::from_column_major_slice(x, columns, 1);
    matmul(y, Accum::Add, a, x, s, Par::Seq);
}

/// Factors P A = L U with partial pivoting. The solutions for a singular matrix are not finite.
pub struct Lu<T = f64> {
    /// Factors L without its unit diagonal, and U.
    factors: Mat<T>,
    forward: Vec<usize>,
    backward: Vec<usize>,
    /// Number of rows that P exchanges.
    exchanges: usize,
}

impl Lu {
    /// Returns `true` if the determinant is negative.
    pub fn has_negative_determinant(&self) -> bool {
        let diagonal = (0..self.factors.nrows()).map(|i| self.factors[(i, i)]);
        let negative = diagonal.filter(|pivot| *pivot < 0.0).count();
        (negative + self.exchanges) % 2 == 1
    }

    /// Returns `true` if a pivot is exactly zero or not a number, and solutions are therefore not finite.
    pub fn is_singular(&self) -> bool {
        let mut pivots = (0..self.factors.nrows()).map(|i| self.factors[(i, i)]);
        pivots.any(|pivot| pivot == 0.0 || !pivot.is_finite())
    }
}

impl<T: ComplexField> Lu<T> {
    /// Factors a square matrix.
    pub fn new(mut a: Mat<T>) -> Self {
        let n = a.nrows();
        let (mut forward, mut backward) = (vec![0_usize; n], vec![0_usize; n]);
        let params = Spec::default();
        let scratch = factor::lu_in_place_scratch::<usize, T>(n, n, Par::Seq, params);
        let (info, _) = factor::lu_in_place(
            a.as_mut(),
            &mut forward,
            &mut backward,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            params,
        );
        Self {
            factors: a,
            forward,
            backward,
            exchanges: info.transposition_count,
        }
    }

    /// Replaces the columns of `rhs` by the solutions.
    pub fn solve_in_place(&self, rhs: MatMut<'_, T>) {
        let n = self.factors.nrows();
        let scratch = solve::solve_in_place_scratch::<usize, T>(n, rhs.ncols(), Par::Seq);
        solve::solve_in_place(
            self.factors.as_ref(),
            self.factors.as_ref(),
            PermRef::new_checked(&self.forward, &self.backward, n),
            rhs,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
    }

    /// Solves for one column, like [`Lu::solve_in_place`].
    pub fn solve_column_in_place(&self, rhs: &mut [T]) {
        let n = rhs.len();
        self.solve_in_place(MatMut::from_column_major_slice_mut(rhs, n, 1));
    }
}

/// Lower Cholesky factor of a symmetric matrix (lower triangle read). The strict upper triangle of
/// the result is not zero.
///
/// # Errors
/// The first pivot that is not positive.
pub fn cholesky(mut a: Mat<f64>) -> Result<Mat<f64>, usize> {
    let params = Spec::default();
    let scratch = llt::factor::cholesky_in_place_scratch::<f64>(a.nrows(), Par::Seq, params);
    llt::factor::cholesky_in_place(
        a.as_mut(),
        llt::factor::LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        params,
    )
    .map_err(|llt::factor::LltError::NonPositivePivot { index }| index)?;
    Ok(a)
}

/// Replaces the columns of `rhs` by the solutions, given the [`cholesky`] factor.
pub fn solve_in_place(factor: MatRef<'_, f64>, mut rhs: MatMut<'_, f64>) {
    solve_lower_triangular_in_place(factor, rhs.rb_mut(), Par::Seq);
    solve_upper_triangular_in_place(factor.transpose(), rhs, Par::Seq);
}

/// Eigenvalues of a symmetric matrix (lower triangle read), ascending, with one vector per column;
/// `None` where they are not found.
pub fn self_adjoint_eigen(a: MatRef<'_, f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    if a.nrows() == 0 {
        return Some((Vec::new(), Mat::new()));
    }
    let mut vectors = Mat::zeros(a.nrows(), a.nrows());
    let values = decomposed(a, Some(vectors.as_mut()))?;
    Some((values, vectors))
}

/// Eigenvalues of [`self_adjoint_eigen`] alone.
pub fn self_adjoint_eigenvalues(a: MatRef<'_, f64>) -> Option<Vec<f64>> {
    decomposed(a, None)
}

fn decomposed(a: MatRef<'_, f64>, vectors: Option<MatMut<'_, f64>>) -> Option<Vec<f64>> {
    let n = a.nrows();
    let mut values = Diag::zeros(n);
    let asked = match vectors {
        Some(_) => ComputeEigenvectors::Yes,
        None => ComputeEigenvectors::No,
    };
    let params = Spec::default();
    let scratch = self_adjoint_evd_scratch::<f64>(n, asked, Par::Seq, params);
    self_adjoint_evd(
        a,
        values.as_mut(),
        vectors,
        Par::Seq,
        MemStack::new(&mut MemBuffer::try_new(scratch).ok()?),
        params,
    )
    .ok()?;
    Some(values.column_vector().iter().copied().collect())
}

/// Eigenvalues of a square matrix in no order; `None` where they are not found.
pub fn eigenvalues(a: MatRef<'_, f64>) -> Option<Vec<c64>> {
    let n = a.nrows();
    if n == 0 {
        return Some(Vec::new());
    }
    if a.col_iter().any(|c| c.iter().any(|v| !v.is_finite())) {
        return None;
    }
    let (mut re, mut im) = (Diag::zeros(n), Diag::zeros(n));
    let no = ComputeEigenvectors::No;
    let params = Spec::default();
    let scratch = evd_scratch::<f64>(n, no, no, Par::Seq, params);
    let mut memory = MemBuffer::try_new(scratch).ok()?;
    let stack = MemStack::new(&mut memory);
    evd_real(
        a,
        re.as_mut(),
        im.as_mut(),
        None,
        None,
        Par::Seq,
        stack,
        params,
    )
    .ok()?;
    let parts = re.column_vector().iter().zip(im.column_vector().iter());
    Some(parts.map(|(re, im)| c64::new(*re, *im)).collect())
}

/// Mean of a matrix and its transpose: symmetric to the last bit.
pub fn symmetrised(a: MatRef<'_, f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| 0.5 * (a[(i, j)] + a[(j, i)]))
}

/// Returns `true` if a symmetric matrix (lower triangle read) with `shift` added to its diagonal is
/// positive definite, by one Cholesky factorisation.
pub fn is_definite(mut a: Mat<f64>, shift: f64) -> bool {
    for i in 0..a.nrows() {
        a[(i, i)] += shift;
    }
    cholesky(a).is_ok()
}

/// Lowest eigenvalue of a symmetric matrix (lower triangle read); minus infinity where it is not
/// found.
pub fn lowest_eigenvalue(a: MatRef<'_, f64>) -> f64 {
    let scale = a.norm_max();
    if scale == 0.0 {
        return 0.0;
    }
    let lowest = || {
        let scaled = Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] / scale);
        self_adjoint_eigenvalues(scaled.as_ref())?.first().copied()
    };
    let lowest = if scale.is_finite() { lowest() } else { None };
    lowest.map_or(f64::NEG_INFINITY, |value| scale * value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::lattice::scattered;
    use faer::Side;

    /// A matrix, and one that is positive definite.
    fn matrices(n: usize) -> [Mat<f64>; 2] {
        let a = Mat::from_fn(n, n, |i, j| scattered(n * i + j));
        let mut b = product(a.as_ref(), a.transpose());
        (0..n).for_each(|i| b[(i, i)] += 1.0);
        [a, b]
    }

    #[test]
    fn results_are_those_of_faer() {
        let [a, b] = matrices(40);
        let close = |x: &Mat<f64>, y: &Mat<f64>| {
            let scale = y.norm_max();
            assert!((x - y).norm_max() < 1e-10 * scale);
        };
        use faer::linalg::solvers::Solve;
        let mut by_lu = b.clone();
        Lu::new(a.clone()).solve_in_place(by_lu.as_mut());
        close(&by_lu, &a.partial_piv_lu().solve(&b));
        let mut column = vec![1.0; 40];
        Lu::new(a.clone()).solve_column_in_place(&mut column);
        let mut exchanged = a.clone();
        for negative in [a.determinant() < 0.0, a.determinant() > 0.0] {
            assert_eq!(
                Lu::new(exchanged.clone()).has_negative_determinant(),
                negative
            );
            (0..40).for_each(|j| exchanged.col_as_slice_mut(j).swap(3, 8));
        }
        let column = Mat::from_fn(40, 1, |i, _| column[i]);
        close(&(&a * &column), &Mat::from_fn(40, 1, |_, _| 1.0));
        let mut by_cholesky = a.clone();
        let factor = cholesky(b.clone()).unwrap();
        solve_in_place(factor.as_ref(), by_cholesky.as_mut());
        close(&(&b * &by_cholesky), &a);
        let (values, vectors) = self_adjoint_eigen(b.as_ref()).unwrap();
        let scaled = Mat::from_fn(40, 40, |i, j| vectors[(i, j)] * values[j]);
        close(&(&b * &vectors), &scaled);
        assert_eq!(
            self_adjoint_eigenvalues(b.as_ref()).unwrap(),
            b.self_adjoint_eigenvalues(Side::Lower).unwrap()
        );
        close(&product(a.as_ref(), b.as_ref()), &(&a * &b));
        let mut indefinite = b;
        indefinite[(3, 3)] = -1.0;
        assert_eq!(cholesky(indefinite).unwrap_err(), 3);
    }

    #[test]
    fn a_shift_decides_what_is_definite() {
        // Eigenvalues 3 and -1.
        let a = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 2.0 });
        assert!(is_definite(a.clone(), 1.001) && !is_definite(a.clone(), 0.999));
        for scale in [1e-300, 1.0, 1e300] {
            let lowest = lowest_eigenvalue((faer::Scale(scale) * &a).as_ref());
            assert!((lowest / scale + 1.0).abs() < 1e-14, "{lowest:e}");
        }
        assert_eq!(lowest_eigenvalue(Mat::zeros(3, 3).as_ref()), 0.0);
    }

    #[test]
    fn a_companion_matrix_has_the_roots_of_its_polynomial() {
        // (x - 2) (x^2 + 2 x + 5) = x^3 + x - 10.
        let mut companion = Mat::<f64>::zeros(3, 3);
        (companion[(1, 0)], companion[(2, 1)]) = (1.0, 1.0);
        (companion[(0, 2)], companion[(1, 2)]) = (10.0, -1.0);
        let found = eigenvalues(companion.as_ref()).unwrap();
        for root in [
            c64::new(2.0, 0.0),
            c64::new(-1.0, 2.0),
            c64::new(-1.0, -2.0),
        ] {
            assert!(found.iter().any(|v| (v - root).norm() < 1e-13), "{found:?}");
        }
        companion[(0, 0)] = f64::NAN;
        assert_eq!(eigenvalues(companion.as_ref()), None);
    }
}
