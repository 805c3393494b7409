//! Coarse space of a two-level solver: the softest motions of a dense symmetric matrix relative to
//! its own diagonal, to the accuracy of a few rounds of inverse iteration.

use faer::diag::DiagRef;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, MatRef, Par};

use crate::dense;
use crate::dense::parallel::{self, product};

/// Relative diagonal shifts, tried in turn until the matrix is positive definite: it may be
/// singular or slightly indefinite (rigid motion, spin softening).
const SHIFTS: [f64; 3] = [1e-5, 1e-3, 1e-1];
const ROUNDS: usize = 4;

/// Motions w (n x `count`, fewer where n is less) that approximately span the eigenvectors
/// `A w = theta diag(weights) w` of the smallest theta, ascending in theta, with
/// `w^T diag(weights) w = 1`. Empty where A (both triangles stored) is far from positive
/// semi-definite, or a weight is not positive.
pub fn coarse_space(matrix: MatRef<'_, f64>, weights: &[f64], count: usize) -> Mat<f64> {
    let n = matrix.nrows();
    let count = count.min(n);
    let nothing = || Mat::zeros(n, 0);
    if count == 0 || !weights.iter().all(|w| *w > 0.0 && w.is_finite()) {
        return nothing();
    }
    let shifted = SHIFTS.iter().find_map(|shift| {
        let mut factor = matrix.to_owned();
        for (i, w) in weights.iter().enumerate() {
            factor[(i, i)] += shift * w;
        }
        parallel::cholesky(factor)
    });
    let Some(factor) = shifted else {
        return nothing();
    };
    let weights = DiagRef::from_slice(weights);
    // Vectors that are the same on every machine.
    let mut motions = Mat::from_fn(n, count, |i, j| {
        ((i * (j + 1)) as f64 * 0.618_033_988_75 + (j * j) as f64).sin()
    });
    for _ in 0..ROUNDS {
        if !orthonormalise(&mut motions, weights) {
            return nothing();
        }
        motions = weights * &motions;
        parallel::solve_in_place(factor.as_ref(), motions.as_mut());
    }
    drop(factor);
    if !orthonormalise(&mut motions, weights) {
        return nothing();
    }
    let moved = product(matrix, motions.as_ref());
    let projected = dense::product(motions.transpose(), moved.as_ref());
    match dense::self_adjoint_eigen(projected.as_ref()) {
        Some((_, ritz)) => product(motions.as_ref(), ritz.as_ref()),
        None => nothing(),
    }
}

/// Makes the columns orthonormal in the inner product of `weights`. Returns `false` where they are
/// dependent.
fn orthonormalise(motions: &mut Mat<f64>, weights: DiagRef<'_, f64>) -> bool {
    // Twice: one pass loses accuracy in proportion to the condition of the columns.
    for _ in 0..2 {
        let weighted = weights * &*motions;
        let gram = dense::product(motions.transpose(), weighted.as_ref());
        let Ok(factor) = dense::cholesky(gram) else {
            return false;
        };
        let mut rows = motions.transpose().to_owned();
        solve_lower_triangular_in_place(factor.as_ref(), rows.as_mut(), Par::Seq);
        *motions = rows.transpose().to_owned();
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::dense;
    use dovetail_testkit::lattice::Lattice;

    #[test]
    fn they_are_those_of_the_dense_eigenproblem() {
        let lattice = Lattice::new([9, 7, 6], 3e7, 1.0, 0.4);
        let (k, _) = lattice.cantilever();
        let k = dense(&k);
        let weights: Vec<f64> = (0..k.nrows()).map(|i| k[(i, i)]).collect();
        let motions = coarse_space(k.as_ref(), &weights, 40);
        let diagonal = |i, j| if i == j { weights[i] } else { 0.0 };
        let mass = Mat::from_fn(k.nrows(), k.nrows(), diagonal);
        let modes = crate::eigen::dense::modes(k.as_ref(), mass.as_ref()).unwrap();
        for (j, exact) in modes.omega2[..20].iter().enumerate() {
            let w = motions.col(j);
            let theta = w.transpose() * (&k * w);
            let off = if j < 5 { 1e-3 } else { 0.2 };
            assert!((theta / exact - 1.0).abs() < off, "{j}: {theta} {exact}");
            let one = w.transpose() * (&mass * w);
            assert!((one - 1.0).abs() < 1e-10);
        }
    }

    #[test]
    fn a_matrix_with_motions_that_cost_nothing_has_them_first() {
        // A chain that nothing holds.
        let n = 300;
        let k = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 if i == 0 || i == n - 1 => 1.0,
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        });
        let motions = coarse_space(k.as_ref(), &vec![2.0; n], 10);
        let even = 1.0 / (2.0 * n as f64).sqrt();
        assert!((0..n).all(|i| (motions[(i, 0)].abs() - even).abs() < 1e-6 * even));
        assert_eq!(
            coarse_space(Mat::zeros(3, 3).as_ref(), &[0.0; 3], 2).ncols(),
            0
        );
        assert_eq!(coarse_space((-k).as_ref(), &vec![2.0; n], 2).ncols(), 0);
    }
}
