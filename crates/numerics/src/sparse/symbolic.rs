//! Order and symbolic analysis of a sparse symmetric matrix, by faer in the order of
//! [`super::order`].

use std::sync::Arc;

use faer::Side;
use faer::perm::PermRef;
use faer::sparse::FaerError;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
    supernodal::{SupernodalLltRef, SymbolicSupernodalCholesky},
};
use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;

use super::operations::symbolic_view;
use super::order::{Order, OrderError, nested_dissection};
use super::pattern::CompactPattern;
use crate::memory::TooLittle;

/// Error of a matrix that was not factored.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum FactorError {
    #[error("the matrix is {rows} x {columns}: only square matrices can be factored")]
    NotSquare { rows: usize, columns: usize },
    #[error("entry ({row}, {column}) of the matrix is {value}: all entries must be finite")]
    NotFinite {
        row: usize,
        column: usize,
        value: f64,
    },
    #[error("the matrix has another pattern of entries than the one that was analysed")]
    PatternDiffers,
    /// Negative pivot. `dof` is in the numbering of the matrix, not of the permuted one.
    #[error("the matrix is not positive definite: negative pivot at unknown {dof}")]
    NotPositiveDefinite { dof: usize },
    /// Pivot that is zero except for rounding, with `dof` in the numbering of the matrix.
    #[error(
        "the matrix is singular: the pivot of unknown {dof} is {share:.1e} of its diagonal entry"
    )]
    Singular { dof: usize, share: f64 },
    #[error(transparent)]
    Order(#[from] OrderError),
    #[error("not enough memory to factor {unknowns} unknowns")]
    OutOfMemory { unknowns: usize },
    #[error("to factor {unknowns} unknowns, {source}")]
    TooLittleMemory { unknowns: usize, source: TooLittle },
}

/// Order and symbolic analysis of one pattern of entries, shared by all matrices that have it
/// (the stiffness with and without rotation, K - sigma M). Cheap to clone.
#[derive(Debug, Clone)]
pub struct Symbolic {
    inner: Arc<SymbolicAnalysis>,
}

#[derive(Debug)]
struct SymbolicAnalysis {
    symbolic: SymbolicCholesky<usize>,
    pattern: CompactPattern,
}

impl Symbolic {
    /// Analyses a structurally symmetric matrix (both triangles stored) whose unknowns come in
    /// nodes of three.
    ///
    /// # Errors
    /// A matrix that is not square, too large, or does not fit in memory.
    pub fn analyse(matrix: &CscMatrix<f64>) -> Result<Self, FactorError> {
        let pattern = matrix.pattern();
        let (rows, columns) = (matrix.nrows(), matrix.ncols());
        if rows != columns {
            return Err(FactorError::NotSquare { rows, columns });
        }
        Self::ordered(pattern, &nested_dissection(pattern, 3)?)
    }

    /// Analysis of a pattern in an order found earlier, new to old.
    ///
    /// # Errors
    /// The errors of [`Symbolic::analyse`]; an order that is no permutation, or no postorder.
    pub(super) fn from_order(
        pattern: &SparsityPattern,
        new_to_old: Vec<usize>,
    ) -> Result<Self, FactorError> {
        let order = Order::new(new_to_old).filter(|order| {
            let unknowns = order.new_to_old.len();
            (pattern.minor_dim(), pattern.major_dim()) == (unknowns, unknowns)
                && order.is_postorder(pattern)
        });
        Self::ordered(pattern, &order.ok_or(FactorError::PatternDiffers)?)
    }

    fn ordered(pattern: &SparsityPattern, order: &Order) -> Result<Self, FactorError> {
        let rows = pattern.minor_dim();
        let permutation = PermRef::new_checked(&order.new_to_old, &order.old_to_new, rows);
        let symbolic = factorize_symbolic_cholesky(
            symbolic_view(pattern),
            Side::Upper,
            SymmetricOrdering::Custom(permutation),
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .map_err(|e| generic(e, rows))?;
        Ok(Self {
            inner: Arc::new(SymbolicAnalysis {
                symbolic,
                pattern: CompactPattern::new(pattern),
            }),
        })
    }

    /// Pattern that was analysed.
    pub(super) fn pattern(&self) -> &CompactPattern {
        &self.inner.pattern
    }

    /// Symbolic factorisation of faer.
    pub(super) fn analysis(&self) -> &SymbolicCholesky<usize> {
        &self.inner.symbolic
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.inner.symbolic.nrows()
    }

    /// Number of entries of the factor (including the zeros that supernodes store).
    pub fn factor_entries(&self) -> usize {
        self.inner.symbolic.len_val()
    }

    /// Supernodes; `None` for an empty matrix.
    pub(super) fn supernodal(&self) -> Option<&SymbolicSupernodalCholesky<usize>> {
        match self.inner.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(supernodal) if self.unknowns() > 0 => Some(supernodal),
            _ => None,
        }
    }

    /// Permutations new to old, and old to new.
    pub(super) fn permutation(&self) -> (&[usize], &[usize]) {
        self.inner
            .symbolic
            .perm()
            .map_or((&[], &[]), |permutation| permutation.arrays())
    }

    /// Checks that `matrix` has the pattern analysed.
    pub(super) fn check_pattern(&self, matrix: &CscMatrix<f64>) -> Result<(), FactorError> {
        match CompactPattern::new(matrix.pattern()) == self.inner.pattern {
            true => Ok(()),
            false => Err(FactorError::PatternDiffers),
        }
    }

    pub(super) fn unpermuted(&self, position: usize) -> usize {
        match self.inner.symbolic.perm() {
            Some(permutation) => permutation.arrays().0[position],
            None => position,
        }
    }

    /// Calls `each` with the diagonal of the factor, by permuted position.
    pub(super) fn pivots(&self, values: &[f64], mut each: impl FnMut(usize, f64)) {
        let SymbolicCholeskyRaw::Supernodal(supernodal) = self.inner.symbolic.raw() else {
            // Supernodes are forced; only an empty matrix has none.
            return;
        };
        let factor = SupernodalLltRef::<usize, f64>::new(supernodal, values);
        for s in 0..supernodal.n_supernodes() {
            let supernode = factor.supernode(s);
            for j in 0..supernode.val().ncols() {
                each(supernode.start() + j, supernode.val()[(j, j)]);
            }
        }
    }
}

/// Checks that all entries are finite.
pub(super) fn check_finite(matrix: &CscMatrix<f64>) -> Result<(), FactorError> {
    match matrix.triplet_iter().find(|(_, _, v)| !v.is_finite()) {
        Some((row, column, &value)) => Err(FactorError::NotFinite { row, column, value }),
        None => Ok(()),
    }
}

fn generic(error: FaerError, unknowns: usize) -> FactorError {
    match error {
        FaerError::IndexOverflow => FactorError::Order(OrderError::TooLarge {
            unknowns,
            entries: usize::MAX,
        }),
        _ => FactorError::OutOfMemory { unknowns },
    }
}
