//! Sparse factorisations of symmetric matrices: Cholesky for definite ones, LDL^T with inertia for
//! indefinite ones. They are analysed by faer and ordered by [`super::order`].
//!
//! The Cholesky factor is computed by `elimination.rs` and used by `solve.rs`, both on all threads.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::ldlt::factor::{LdltError, LdltRegularization};
use faer::sparse::linalg::cholesky::{LltRef, supernodal::SupernodalLltRef};
use faer::{Conj, Mat, MatMut, Par, Side};
use nalgebra_sparse::CscMatrix;

use super::elimination::{EliminationError, EliminationPlan};
use super::operations::{leading, view};
use super::solve::Factor;
use super::symbolic::{FactorError, Symbolic, check_finite};
use crate::memory;

/// A pivot below this fraction of its diagonal entry is rounding, not stiffness: a structure that
/// nothing holds leaves about 1e-15, the softest blade far more than 1e-8.
const SINGULAR_PIVOT: f64 = 1e-12;

impl Symbolic {
    /// Factors a positive definite matrix of this pattern.
    ///
    /// # Errors
    /// [`FactorError::NotPositiveDefinite`], [`FactorError::Singular`], a pattern other than the
    /// one analysed, entries that are not finite, too little memory.
    pub fn cholesky(&self, matrix: &CscMatrix<f64>) -> Result<Cholesky, FactorError> {
        self.check_pattern(matrix)?;
        Ok(self.eliminated(&[matrix])?.0)
    }

    /// Eliminates the unknowns that were analysed, which come first in the matrices
    /// ([`EliminationPlan`]). Returns the factor, and the rest of each matrix on the other
    /// unknowns.
    pub(super) fn eliminated(
        &self,
        matrices: &[&CscMatrix<f64>],
    ) -> Result<(Cholesky, Vec<Mat<f64>>), FactorError> {
        matrices
            .iter()
            .try_for_each(|matrix| check_finite(matrix))?;
        let stiffness = matrices[0];
        let plan = EliminationPlan::new(self, matrices);
        let unknowns = self.unknowns();
        memory::check_available(plan.needed_bytes())
            .map_err(|source| FactorError::TooLittleMemory { unknowns, source })?;
        let mut values = zeros(self.factor_entries(), unknowns)?;
        match plan.eliminate(&mut values) {
            Ok(left) => {
                let symbolic = self.clone();
                let factor = Cholesky { symbolic, values };
                factor.check_pivots(stiffness)?;
                Ok((factor, left))
            }
            Err(EliminationError::PatternDiffers) => Err(FactorError::PatternDiffers),
            Err(EliminationError::NotPositiveDefinite) => {
                drop(values);
                Err(self.refused(stiffness))
            }
        }
    }

    /// Factors an indefinite matrix of this pattern, without pivoting.
    ///
    /// # Errors
    /// [`FactorError::Singular`] on a zero pivot, a pattern other than the one analysed, entries
    /// that are not finite, too little memory.
    pub fn ldlt(&self, matrix: &CscMatrix<f64>) -> Result<Ldlt, FactorError> {
        self.check_pattern(matrix)?;
        check_finite(matrix)?;
        let symbolic = self.analysis();
        let unknowns = symbolic.nrows();
        let mut values = zeros(symbolic.len_val(), unknowns)?;
        let params = faer::Spec::default();
        let scratch = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, params);
        let mut memory =
            MemBuffer::try_new(scratch).map_err(|_| FactorError::OutOfMemory { unknowns })?;
        let outcome = symbolic.factorize_numeric_ldlt(
            &mut values,
            view(matrix),
            Side::Upper,
            LdltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            params,
        );
        match outcome {
            Ok(_) => Ok(Ldlt {
                symbolic: self.clone(),
                values,
            }),
            Err(LdltError::ZeroPivot { index }) => Err(FactorError::Singular {
                dof: self.unpermuted(index),
                share: 0.0,
            }),
        }
    }

    /// Reason why there is no Cholesky factor of the first unknowns of a matrix: the first pivot that
    /// is not clearly positive is rounding of zero, or negative.
    fn refused(&self, matrix: &CscMatrix<f64>) -> FactorError {
        let mut first = None;
        match self.ldlt(&leading(matrix.clone(), self.unknowns())) {
            Ok(ldlt) => self.pivots(&ldlt.values, |position, pivot| {
                let dof = self.unpermuted(position);
                let share = pivot / diagonal(matrix, dof);
                let positive = pivot > 0.0 && share > SINGULAR_PIVOT;
                if !positive && first.is_none() {
                    first = Some((dof, share));
                }
            }),
            Err(error) => return error,
        }
        match first {
            Some((dof, share)) if share.abs() >= SINGULAR_PIVOT => {
                FactorError::NotPositiveDefinite { dof }
            }
            Some((dof, share)) => FactorError::Singular { dof, share },
            None => FactorError::Singular { dof: 0, share: 0.0 },
        }
    }
}

/// Cholesky factor L L^T of a positive definite matrix.
#[derive(Debug, Clone)]
pub struct Cholesky {
    symbolic: Symbolic,
    values: Vec<f64>,
}

impl Cholesky {
    /// Analyses and factors in one step; see [`Symbolic::analyse`] and [`Symbolic::cholesky`].
    ///
    /// # Errors
    /// The errors of both.
    pub fn factor(matrix: &CscMatrix<f64>) -> Result<Self, FactorError> {
        Symbolic::analyse(matrix)?.cholesky(matrix)
    }

    /// Analysis that the factor was made with.
    pub fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    /// Entries of the factor, laid out by supernodes.
    pub(super) fn values(&self) -> &[f64] {
        &self.values
    }

    /// Factor of these [`values`](Self::values); `None` where their number is wrong.
    pub(super) fn from_values(symbolic: Symbolic, values: Vec<f64>) -> Option<Self> {
        (values.len() == symbolic.factor_entries()).then_some(Self { symbolic, values })
    }

    /// Replaces each column of `rhs` (unknowns x columns) by the solution. Panics if the number of
    /// rows is not the number of unknowns.
    pub fn solve_in_place(&self, rhs: MatMut<'_, f64>) {
        assert_eq!(
            rhs.nrows(),
            self.symbolic.unknowns(),
            "rows of the right-hand side"
        );
        if let Some(supernodes) = self.symbolic.supernodal() {
            let factor = Factor {
                supernodes: SupernodalLltRef::new(supernodes, &self.values),
                new_to_old: self.symbolic.permutation().0,
            };
            factor.solve(rhs);
        }
    }

    /// Solves for one right-hand side like [`Cholesky::solve_in_place`], on the calling thread: it
    /// does not use the thread pool.
    pub fn solve_vector(&self, rhs: &mut [f64]) {
        let symbolic = self.symbolic.analysis();
        let mut memory = MemBuffer::new(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        LltRef::new(symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, rhs.len(), 1),
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }

    fn check_pivots(&self, matrix: &CscMatrix<f64>) -> Result<(), FactorError> {
        let mut smallest = (1.0, 0);
        self.symbolic.pivots(&self.values, |position, pivot| {
            let dof = self.symbolic.unpermuted(position);
            let share = pivot * pivot / diagonal(matrix, dof);
            if share < smallest.0 || share.is_nan() {
                smallest = (share, dof);
            }
        });
        if smallest.0 > SINGULAR_PIVOT {
            Ok(())
        } else {
            Err(FactorError::Singular {
                dof: smallest.1,
                share: smallest.0,
            })
        }
    }
}

/// Factors L D L^T of an indefinite matrix, without pivoting: the inertia is right even near an
/// eigenvalue of the pencil.
#[derive(Debug, Clone)]
pub struct Ldlt {
    symbolic: Symbolic,
    values: Vec<f64>,
}

impl Ldlt {
    /// Analyses and factors in one step; see [`Symbolic::analyse`] and [`Symbolic::ldlt`].
    ///
    /// # Errors
    /// The errors of both.
    pub fn factor(matrix: &CscMatrix<f64>) -> Result<Self, FactorError> {
        Symbolic::analyse(matrix)?.ldlt(matrix)
    }

    /// Number of negative eigenvalues of the matrix (Sylvester's law of inertia). For K - sigma M
    /// with M positive definite: the number of eigenvalues of the pencil below sigma.
    pub fn negative_pivots(&self) -> usize {
        let mut negative = 0;
        self.symbolic
            .pivots(&self.values, |_, d| negative += usize::from(d < 0.0));
        negative
    }
}

fn diagonal(matrix: &CscMatrix<f64>, dof: usize) -> f64 {
    matrix
        .get_entry(dof, dof)
        .map_or(0.0, |entry| entry.into_value())
}

/// Zeros in pages that the system maps as they are written, by the thread that does so.
fn zeros(len: usize, unknowns: usize) -> Result<Vec<f64>, FactorError> {
    bytemuck::try_zeroed_vec(len).map_err(|()| FactorError::OutOfMemory { unknowns })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sparse::dense;
    use dovetail_testkit::lattice::{Lattice, scattered};
    use faer::Mat;

    fn block() -> Lattice {
        Lattice::new([7, 5, 4], 3e7, 0.2, 0.4)
    }

    #[test]
    fn a_factor_solves() {
        let (k, _) = block().cantilever();
        let n = k.nrows();
        let symbolic = Symbolic::analyse(&k).unwrap();
        for columns in [1, 5, 33, 300] {
            let b = Mat::from_fn(n, columns, |i, j| scattered(i + n * j));
            let mut x = b.clone();
            symbolic.cholesky(&k).unwrap().solve_in_place(x.as_mut());
            let error = (dense(&k) * &x - &b).norm_l2() / b.norm_l2();
            assert!(error < 1e-11, "{columns}: {error}");
        }
    }

    #[test]
    fn inertia_counts_the_eigenvalues_below_the_shift() {
        let (k, m) = block().cantilever();
        let symbolic = Symbolic::analyse(&k).unwrap();
        assert_eq!(symbolic.ldlt(&k).unwrap().negative_pivots(), 0);
        let mut seen = Vec::new();
        for sigma in [1e7, 6e7, 4e8, 3e9, 1e11] {
            let mut shifted = k.clone();
            for (v, m) in shifted.values_mut().iter_mut().zip(m.values()) {
                *v -= sigma * m;
            }
            let values = dense(&shifted)
                .self_adjoint_eigenvalues(Side::Lower)
                .unwrap();
            let below = values.iter().filter(|v| **v < 0.0).count();
            assert_eq!(symbolic.ldlt(&shifted).unwrap().negative_pivots(), below);
            seen.push(below);
        }
        assert!(seen[0] < seen[2] && seen[2] < seen[4], "{seen:?}");
    }

    #[test]
    fn a_negative_pivot_is_reported_where_it_is() {
        let (mut k, _) = block().cantilever();
        let spoilt = 100;
        for (i, j, v) in k.triplet_iter_mut() {
            if i == spoilt && j == spoilt {
                *v = -1e9;
            }
        }
        // Eliminated first or later, the pivot of the spoilt unknown is the only negative one.
        match Cholesky::factor(&k) {
            Err(FactorError::NotPositiveDefinite { dof }) => assert_eq!(dof, spoilt),
            other => panic!("{other:?}"),
        }
        assert_eq!(Ldlt::factor(&k).unwrap().negative_pivots(), 1);
    }

    #[test]
    fn what_nothing_holds_is_singular() {
        let free = block();
        let number: Vec<_> = (0..free.nodes()).map(Some).collect();
        let (k, _) = free.matrices(&number, free.nodes());
        assert!(matches!(
            Cholesky::factor(&k),
            Err(FactorError::Singular { .. })
        ));
        // With its unknowns in other orders, as rounding makes the last pivot of either sign.
        for turn in 1..20 {
            let count = free.nodes();
            let number: Vec<_> = (0..count).map(|i| Some((i + 7 * turn) % count)).collect();
            let (k, _) = free.matrices(&number, count);
            assert!(
                matches!(Cholesky::factor(&k), Err(FactorError::Singular { .. })),
                "{turn}"
            );
        }
    }

    #[test]
    fn wrong_input_is_refused() {
        let (k, _) = block().cantilever();
        let symbolic = Symbolic::analyse(&k).unwrap();
        let other = CscMatrix::identity(k.nrows());
        assert!(matches!(
            symbolic.cholesky(&other),
            Err(FactorError::PatternDiffers)
        ));
        let mut spoilt = k.clone();
        spoilt.values_mut()[17] = f64::NAN;
        assert!(matches!(
            symbolic.ldlt(&spoilt),
            Err(FactorError::NotFinite { .. })
        ));
        let wide = CscMatrix::<f64>::zeros(2, 3);
        assert!(matches!(
            Symbolic::analyse(&wide),
            Err(FactorError::NotSquare { .. })
        ));
    }

    #[test]
    fn nothing_to_factor_is_no_error() {
        let factor = Cholesky::factor(&CscMatrix::zeros(0, 0)).unwrap();
        factor.solve_in_place(Mat::zeros(0, 4).as_mut());
    }
}
