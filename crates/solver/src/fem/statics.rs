//! Linear static displacements with the contact nodes held, and free dofs -> all nodes of a body.

use std::ops::Range;

use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;

use super::FemError;
use crate::model::{Body, DofMap};

/// Why a symmetric positive definite system could not be solved.
#[derive(Debug, thiserror::Error)]
pub enum SolveFailure {
    #[error("the matrix is not positive definite at unknown {dof}")]
    NotPositiveDefinite { dof: usize },
    #[error("the sparse factorisation failed")]
    Factorisation(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// Solves A x = b for a symmetric positive definite A given whole.
pub type SolveSpd<'a> =
    dyn Fn(&CscMatrix<f64>, &[f64]) -> Result<Vec<f64>, SolveFailure> + Sync + 'a;

/// Static displacement (m) of every node of the body under `load_n` (free dofs), with the flank nodes
/// held besides the fixed ones.
///
/// # Errors
/// [`FemError::LooselyHeld`] when a part of the body is held by nothing; [`FemError::TooFar`] when it
/// moves farther than it is large.
pub fn held_displacement(
    body: &Body,
    stiffness: &CscMatrix<f64>,
    load_n: &[f64],
    solve: &SolveSpd,
) -> Result<Vec<[f64; 3]>, FemError> {
    let held = held_dofs(&body.dofs);
    let mut load = load_n.to_vec();
    load.drain(held.clone());
    let solution = if load.is_empty() {
        Vec::new()
    } else {
        solve(&without(stiffness, &held), &load).map_err(|failure| match failure {
            SolveFailure::NotPositiveDefinite { dof } => {
                let dof = if dof < held.start {
                    dof
                } else {
                    dof + held.len()
                };
                FemError::loosely_held(body, dof / 3)
            }
            failure => FemError::Statics {
                body: body.name.clone(),
                source: failure,
            },
        })?
    };
    let mut free = solution;
    let after = free.split_off(held.start);
    free.resize(held.end, 0.0);
    free.extend(after);
    let size = extent_m(body);
    let largest = free.iter().map(|u| u.abs()).enumerate();
    match largest.max_by(|a, b| a.1.total_cmp(&b.1)) {
        // A singular matrix may pass a factorisation by rounding; its solution is then absurd.
        Some((dof, u)) if u.is_nan() || u > ABSURD * size => {
            Err(FemError::loosely_held(body, dof / 3))
        }
        Some((dof, u)) if u > size => Err(FemError::too_far(body, dof / 3, u)),
        _ => Ok(expand_to_nodes(&body.dofs, &free)),
    }
}

/// Displacements of this many body sizes are rounding, not elasticity.
const ABSURD: f64 = 1e6;

/// Diagonal of the box around the body.
fn extent_m(body: &Body) -> f64 {
    let range = |k: usize| {
        let values = body.nodes_m.iter().map(|x| x[k]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    (0..3).map(|k| range(k).powi(2)).sum::<f64>().sqrt()
}

/// Displacement (or any vector field) of every node of a body from its free dofs: fixed nodes get
/// zero, tied ones the mean of their two nodes.
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

/// Dofs of the flank nodes.
fn held_dofs(dofs: &DofMap) -> Range<usize> {
    3 * dofs.interior_nodes..3 * (dofs.interior_nodes + dofs.flank_nodes)
}

/// The matrix without a range of its rows and columns.
fn without(matrix: &CscMatrix<f64>, dropped: &Range<usize>) -> CscMatrix<f64> {
    let kept = matrix.ncols() - dropped.len();
    let (mut offsets, mut rows, mut values) = (
        Vec::with_capacity(kept + 1),
        Vec::with_capacity(matrix.nnz()),
        Vec::new(),
    );
    values.reserve(matrix.nnz());
    offsets.push(0);
    for (j, column) in matrix.col_iter().enumerate() {
        if dropped.contains(&j) {
            continue;
        }
        for (&i, &v) in column.row_indices().iter().zip(column.values()) {
            if !dropped.contains(&i) {
                rows.push(if i < dropped.start {
                    i
                } else {
                    i - dropped.len()
                });
                values.push(v);
            }
        }
        offsets.push(rows.len());
    }
    let pattern = SparsityPattern::try_from_offsets_and_indices(kept, kept, offsets, rows)
        .expect("a part of a valid pattern, in the same order");
    CscMatrix::try_from_pattern_and_values(pattern, values).expect("one value per row index")
}
