//! Linear static displacements with the contact nodes held, and expansion of free degrees of
//! freedom to all nodes of a body.

use nalgebra_sparse::CscMatrix;

use super::FemError;
use crate::model::{Body, DofMap};
use dovetail_numerics::space::diagonal;
use dovetail_numerics::sparse::{Cholesky, FactorError, submatrix};

/// Error of a symmetric positive definite system that was not solved.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum SolveFailure {
    #[error("the matrix is not positive definite at unknown {dof}")]
    NotPositiveDefinite { dof: usize },
    #[error("the sparse factorisation failed")]
    Factorisation(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// Solves A x = b for a symmetric positive definite A given whole.
pub(crate) type SolveSpd<'a> =
    dyn Fn(&CscMatrix<f64>, &[f64]) -> Result<Vec<f64>, SolveFailure> + Sync + 'a;

/// Solves by the Cholesky factorisation of [`dovetail_numerics`].
///
/// # Errors
/// [`SolveFailure::NotPositiveDefinite`], also where a pivot is only rounding.
pub fn solve_by_cholesky(matrix: &CscMatrix<f64>, rhs: &[f64]) -> Result<Vec<f64>, SolveFailure> {
    let factor = Cholesky::factor(matrix).map_err(|error| match error {
        FactorError::NotPositiveDefinite { dof } | FactorError::Singular { dof, .. } => {
            SolveFailure::NotPositiveDefinite { dof }
        }
        other => SolveFailure::Factorisation(Box::new(other)),
    })?;
    let mut x = rhs.to_vec();
    factor.solve_vector(&mut x);
    Ok(x)
}

/// Static displacement (m) of every node of the body under `load_n` (free degrees of freedom), with
/// its contact nodes held in addition to the fixed ones.
///
/// # Errors
/// [`FemError::LooselyHeld`] where a part of the body is held by nothing; [`FemError::TooFar`]
/// where it moves farther than it is large.
pub fn held_displacement(
    body: &Body,
    stiffness: &CscMatrix<f64>,
    load_n: &[f64],
    solve: &SolveSpd,
) -> Result<Vec<[f64; 3]>, FemError> {
    // Contact nodes come last.
    let moving: Vec<usize> = (0..3 * body.dofs.interior_nodes).collect();
    let mut free = if moving.is_empty() {
        Vec::new()
    } else {
        let inner = submatrix(stiffness, &moving, &moving);
        solve(&inner, &load_n[..moving.len()]).map_err(|failure| match failure {
            SolveFailure::NotPositiveDefinite { dof } => FemError::loosely_held(body, dof / 3),
            failure @ SolveFailure::Factorisation(_) => FemError::Statics {
                body: body.name.clone(),
                source: failure,
            },
        })?
    };
    free.resize(3 * body.dofs.free_nodes(), 0.0);
    prestressing(body, &free)
}

/// Displacement (m) of every node of a body, from its free degrees of freedom, if a prestress may
/// be based on it.
///
/// # Errors
/// The errors of [`held_displacement`].
pub fn prestressing(body: &Body, free: &[f64]) -> Result<Vec<[f64; 3]>, FemError> {
    let size = diagonal(&body.nodes_m);
    let largest = free.iter().map(|u| u.abs()).enumerate();
    match largest.max_by(|a, b| a.1.total_cmp(&b.1)) {
        // A singular matrix may pass a factorisation by rounding; its solution is then absurd.
        Some((dof, u)) if u.is_nan() || u > ABSURD * size => {
            Err(FemError::loosely_held(body, dof / 3))
        }
        Some((dof, u)) if u > size => Err(FemError::too_far(body, dof / 3, u)),
        _ => Ok(expand_to_nodes(&body.dofs, free)),
    }
}

/// Displacements of this many body sizes are rounding, not elasticity.
const ABSURD: f64 = 1e6;

/// Displacement (or any vector field) of every node of a body from its free degrees of freedom.
/// Fixed nodes get zero, tied ones the mean of their two nodes.
///
/// # Panics
/// If `free` is not 3 numbers per free node.
pub fn expand_to_nodes(dofs: &DofMap, free: &[f64]) -> Vec<[f64; 3]> {
    assert_eq!(
        free.len(),
        3 * dofs.free_nodes(),
        "three numbers per free node"
    );
    (0..dofs.nodes.len())
        .map(|node| {
            let mut value = [0.0; 3];
            for (n, weight) in dofs.weights(node) {
                for k in 0..3 {
                    value[k] += weight * free[3 * n + k];
                }
            }
            value
        })
        .collect()
}
