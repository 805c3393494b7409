//! Static condensation during a Cholesky factorisation.
//!
//! The unknowns have two parts, interior i and boundary b. With the constraint modes Psi = -K_ii^-1
//! K_ib,
//!
//! ```text
//! K = K_bb + K_bi Psi                                             (the Schur complement of K_ii)
//! M = M_bb + M_bi Psi + Psi^T M_ib + Psi^T M_ii Psi               (Guyan's mass)
//! ```
//!
//! M is the derivative of the Schur complement of K + s M by s at s = 0. Both therefore come out of
//! one multifrontal elimination (Duff, Reid, ACM Trans. Math. Softw. 9 (1983) 302-325) that carries
//! the derivative of each frontal matrix with it. The elimination of the unknowns 1 of
//! the front `[F_11 F_21^T; F_21 F_22]` with derivative D computes
//!
//! ```text
//! F_22 := F_22 - F_21 F_11^-1 F_21^T
//! D_22 := D_22 - G P - (G P)^T      P = F_11^-1 F_21^T    G = D_21 - P^T T    T + T^T = D_11
//! ```
//!
//! with T lower triangular. No constraint mode is ever formed. The boundary takes part as rows
//! below the interior ones of each front (`fronts.rs`), so that the factor of K_ii is the one of an
//! ordinary factorisation.

use faer::Mat;
use nalgebra_sparse::CscMatrix;

use super::factor::Cholesky;
use super::symbolic::{FactorError, Symbolic};

/// Factor of K_ii = L L^T, and the matrices condensed on the boundary.
#[derive(Debug)]
#[non_exhaustive]
pub struct Condensed {
    /// Factor of the block that was eliminated.
    pub factor: Cholesky,
    /// Condensed stiffness, boundary x boundary, symmetric to the last bit.
    pub stiffness: Mat<f64>,
    /// Condensed mass, boundary x boundary, symmetric to the last bit.
    pub mass: Mat<f64>,
}

/// Condenses symmetric matrices (both triangles stored) whose first unknowns, those of the analysis of
/// K_ii, are eliminated. M has no entry where K has none
/// ([`extend_pattern`](super::extend_pattern)).
///
/// # Errors
/// The errors of [`Symbolic::cholesky`] for K_ii; [`FactorError::PatternDiffers`] where a matrix
/// couples unknowns that the analysis does not.
pub fn condense(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    symbolic: &Symbolic,
) -> Result<Condensed, FactorError> {
    let (factor, left) = symbolic.eliminated(&[stiffness, mass])?;
    let [stiffness, mass] = left.try_into().unwrap_or_else(|_| [Mat::new(), Mat::new()]);
    Ok(Condensed {
        factor,
        stiffness,
        mass,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::{dense, leading, sum};
    use dovetail_testkit::lattice::Lattice;
    use dovetail_testkit::threads::run_on_threads;
    use faer::linalg::solvers::Solve;

    /// A cantilever whose last unknowns will be the boundary.
    fn matrices(shape: [usize; 3]) -> (CscMatrix<f64>, CscMatrix<f64>) {
        Lattice::new(shape, 3e7, 0.2, 0.4).cantilever()
    }

    fn condensed(
        k: &CscMatrix<f64>,
        m: &CscMatrix<f64>,
        interior: usize,
    ) -> Result<Condensed, FactorError> {
        condense(k, m, &Symbolic::analyse(&leading(k.clone(), interior))?)
    }

    /// Condensed matrices by constraint modes, dense.
    fn exact(k: &CscMatrix<f64>, m: &CscMatrix<f64>, interior: usize) -> [Mat<f64>; 2] {
        let (k, m) = (dense(k), dense(m));
        let (i, b) = (0..interior, interior..k.nrows());
        let llt = k.get(i.clone(), i.clone()).llt(faer::Side::Lower);
        let psi = -llt.unwrap().solve(k.get(i.clone(), b.clone()));
        let stiffness = k.get(b.clone(), b.clone()) + k.get(b.clone(), i.clone()) * &psi;
        let half = m.get(b.clone(), i.clone()) * &psi;
        let mass = m.get(b.clone(), b)
            + &half
            + half.transpose()
            + psi.transpose() * (m.get(i.clone(), i) * &psi);
        [stiffness, mass]
    }

    #[test]
    fn it_is_the_condensation_by_constraint_modes() {
        // The last two have fronts of several blocks, and the very last one a root that hands on more
        // columns than are filled at once.
        let small = [([6, 4, 3], 30), ([9, 5, 4], 99)];
        let large = [([9, 14, 14], 1176), ([3, 19, 19], 1083)];
        for (shape, boundary) in small.into_iter().chain(large) {
            let (k, m) = matrices(shape);
            // A mass that couples the axes too, on the pattern of K.
            let m = sum(&m, 1e-9, &k);
            let interior = k.nrows() - boundary;
            let found = condensed(&k, &m, interior).unwrap();
            let [stiffness, mass] = exact(&k, &m, interior);
            let error = |a: &Mat<f64>, b: &Mat<f64>| (a - b).norm_max() / b.norm_max();
            assert!(error(&found.stiffness, &stiffness) < 1e-13);
            assert!(error(&found.mass, &mass) < 1e-13);
            assert_eq!(found.mass, found.mass.transpose().to_owned());
            let rhs = Mat::from_fn(interior, 3, |i, j| ((3 * i + j) as f64).sin());
            let mut x = rhs.clone();
            found.factor.solve_in_place(x.as_mut());
            let back = dense(&leading(k, interior)) * &x;
            assert!((back - &rhs).norm_max() < 1e-10);
        }
    }

    #[test]
    fn threads_change_no_bit() {
        let (k, m) = matrices([9, 14, 14]);
        let run = |threads: usize| {
            run_on_threads(threads, || condensed(&k, &m, k.nrows() - 1176).unwrap())
        };
        let (one, three) = (run(1), run(3));
        assert_eq!(one.stiffness, three.stiffness);
        assert_eq!(one.mass, three.mass);
        let solved = |found: &Condensed| {
            let mut x = Mat::from_fn(k.nrows() - 1176, 1, |i, _| (i as f64).cos());
            found.factor.solve_in_place(x.as_mut());
            x
        };
        assert_eq!(solved(&one), solved(&three));
    }

    #[test]
    fn a_mass_the_stiffness_has_no_place_for_is_refused() {
        let (k, _) = matrices([6, 4, 3]);
        let n = k.nrows();
        let mut far = nalgebra_sparse::CooMatrix::new(n, n);
        far.push(0, n - 1, 1.0);
        far.push(n - 1, 0, 1.0);
        let found = condensed(&k, &CscMatrix::from(&far), n - 3);
        assert!(matches!(found, Err(FactorError::PatternDiffers)));
    }
}
