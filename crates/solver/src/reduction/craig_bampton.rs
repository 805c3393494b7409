//! Craig-Bampton reduction of one body (Craig, Bampton, AIAA J. 6 (1968) 1313-1319).
//!
//! Interior dofs i, kept dofs b (flank and probe nodes), fixed-interface modes Phi of (K_ii, M_ii):
//!
//! ```text
//! u_i = Psi u_b + Phi q,   Psi = -K_ii^-1 K_ib
//! K = [ K_bb + K_bi Psi   0    ]   M = [ M_bb + M_bi Psi + Psi^T W   W^T Phi ]   W = M_ib + M_ii Psi
//!     [ 0                 w_q^2 ]       [ Phi^T W                     1       ]
//! ```
//!
//! Psi is never formed: the two condensed blocks come out of the factorisation of K_ii
//! ([`dovetail_numerics::condense`]). Fields are recovered by one solve each.

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;
use serde::{Deserialize, Serialize};

use super::ReductionError;
use crate::fem::BodyMatrices;
use crate::model::{Body, NodeMotion};
use dovetail_numerics::condense;
use dovetail_numerics::eigen::{Modes, lowest_modes};
use dovetail_numerics::factor::{Cholesky, FactorError, Symbolic};
use dovetail_numerics::sparse::{product, submatrix, times};
use dovetail_numerics::stored;

/// One body on its kept dofs (flank nodes in the order of the pairs, then probe nodes) and the
/// amplitudes of its fixed-interface modes: n = kept + modes coordinates, in this order.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ReducedBody {
    /// N/m, n x n.
    #[serde(with = "stored::matrix")]
    pub stiffness: Mat<f64>,
    /// kg, n x n (modes mass-normalised).
    #[serde(with = "stored::matrix")]
    pub mass: Mat<f64>,
    /// Centrifugal load, N, n.
    pub load_n: Vec<f64>,
    /// Fixed-interface modes, squared angular frequencies.
    pub omega2: Vec<f64>,
    pub flank_dofs: usize,
    pub probe_dofs: usize,
    interior: Interior,
}

/// What gives the interior back.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Interior {
    factor: Cholesky,
    /// K_ib
    #[serde(with = "stored::sparse_matrix")]
    coupling: CscMatrix<f64>,
    /// Phi
    #[serde(with = "stored::matrix")]
    modes: Mat<f64>,
    #[serde(with = "stored::numbers")]
    load_n: Vec<f64>,
}

impl ReducedBody {
    /// Number of coordinates: kept dofs and modes.
    pub fn coordinates(&self) -> usize {
        self.load_n.len()
    }

    /// Number of kept dofs.
    pub fn kept(&self) -> usize {
        self.flank_dofs + self.probe_dofs
    }

    /// Motion of all free dofs, one column per column of `coordinates` (kept, then modal), without
    /// the static load: `u_i = Psi u_b + Phi q`.
    pub fn motion(&self, coordinates: MatRef<'_, f64>) -> Mat<f64> {
        let (kept, modal) = coordinates.split_at_row(self.kept());
        let interior = self.constrained(kept, false) + product(self.interior.modes.as_ref(), modal);
        stacked(interior.as_ref(), kept)
    }

    /// Static displacement of all free dofs under the centrifugal load when the kept dofs move by
    /// `kept`; exact, whatever the number of modes: `u_i = K_ii^-1 (f_i - K_ib u_b)`.
    pub fn static_displacement(&self, kept: &[f64]) -> Vec<f64> {
        let kept = MatRef::from_column_major_slice(kept, kept.len(), 1);
        let all = stacked(self.constrained(kept, true).as_ref(), kept);
        all.col_as_slice(0).to_vec()
    }

    /// `K_ii^-1 (f_i - K_ib u_b)`, with or without the load.
    fn constrained(&self, kept: MatRef<'_, f64>, loaded: bool) -> Mat<f64> {
        let mut solution = times(&self.interior.coupling, kept);
        for j in 0..solution.ncols() {
            for (u, f) in solution
                .col_as_slice_mut(j)
                .iter_mut()
                .zip(&self.interior.load_n)
            {
                *u = if loaded { f - *u } else { -*u };
            }
        }
        self.interior.factor.solve_in_place(solution.as_mut());
        solution
    }
}

/// Reduces a body to its flank and probe dofs and `body.fixed_interface_modes` modes.
///
/// # Errors
/// [`ReductionError::InteriorNotHeld`] and [`ReductionError::InteriorUnstable`] where the interior is
/// not held or unstable, [`ReductionError::Factor`], [`ReductionError::Eigen`], [`ReductionError::Size`].
pub fn condense(body: &Body, matrices: &BodyMatrices) -> Result<ReducedBody, ReductionError> {
    let n = check_size(body, matrices)?;
    let split = 3 * body.dofs.interior_nodes;
    let (inner, outer): (Vec<usize>, Vec<usize>) = ((0..split).collect(), (split..n).collect());
    let stiffness = &matrices.stiffness;
    let mass = &matrices.mass;
    let k_ii = submatrix(stiffness, &inner, &inner);
    let condensed = Symbolic::analyse(&k_ii)
        .and_then(|symbolic| condense::condense(stiffness, mass, &k_ii, &symbolic))
        .map_err(|e| interior_error(body, e, |dof| dof))?;
    let factor = condensed.factor;
    let m_ii = submatrix(mass, &inner, &inner);
    let modes =
        lowest_modes(&k_ii, &m_ii, body.fixed_interface_modes, &factor).map_err(|source| {
            ReductionError::Eigen {
                body: body.name.clone(),
                source,
            }
        })?;
    drop(k_ii);
    let (kept, count) = (n - split, modes.count());
    // K_ii^-1 on M_ii Phi and on the load.
    let mut followed = Mat::zeros(split, count + 1);
    let inertia = times(&m_ii, modes.vectors.as_ref());
    followed.subcols_mut(0, count).copy_from(inertia);
    let load = &matrices.load_n;
    followed
        .col_as_slice_mut(count)
        .copy_from_slice(&load[..split]);
    factor.solve_in_place(followed.as_mut());
    let carried = times(&submatrix(stiffness, &outer, &inner), followed.as_ref());
    // (M_bi + Psi^T M_ii) Phi with Psi^T = -K_bi K_ii^-1.
    let coupled =
        times(&submatrix(mass, &outer, &inner), modes.vectors.as_ref()) - carried.subcols(0, count);
    let grown = |corner: Mat<f64>| {
        let mut whole = Mat::zeros(kept + count, kept + count);
        whole.submatrix_mut(0, 0, kept, kept).copy_from(corner);
        whole
    };
    let mut stiffness = grown(condensed.stiffness);
    let mut mass = grown(condensed.mass);
    mass.submatrix_mut(0, kept, kept, count).copy_from(&coupled);
    mass.submatrix_mut(kept, 0, count, kept)
        .copy_from(coupled.transpose());
    for (i, &w2) in modes.omega2.iter().enumerate() {
        stiffness[(kept + i, kept + i)] = w2;
        mass[(kept + i, kept + i)] = 1.0;
    }
    let interior_load = MatRef::from_column_major_slice(&load[..split], split, 1);
    let on_modes = product(modes.vectors.transpose(), interior_load);
    let load_n = (0..kept)
        .map(|i| load[split + i] - carried[(i, count)])
        .chain((0..count).map(|i| on_modes[(i, 0)]))
        .collect();
    Ok(ReducedBody {
        stiffness,
        mass,
        load_n,
        omega2: modes.omega2,
        flank_dofs: 3 * body.dofs.flank_nodes,
        probe_dofs: 3 * body.dofs.probe_nodes,
        interior: Interior {
            factor,
            coupling: submatrix(&matrices.stiffness, &inner, &outer),
            modes: modes.vectors,
            load_n: load[..split].to_vec(),
        },
    })
}

/// The `count` lowest modes of the whole body with its flank nodes held (no reduction). Vectors are
/// on the free dofs other than those of the flanks, interior first.
///
/// # Errors
/// As [`condense`].
pub fn held_modes(
    body: &Body,
    matrices: &BodyMatrices,
    count: usize,
) -> Result<Modes, ReductionError> {
    let n = check_size(body, matrices)?;
    let flank = 3 * body.dofs.interior_nodes;
    let probe = flank + 3 * body.dofs.flank_nodes;
    let moving: Vec<usize> = (0..flank).chain(probe..n).collect();
    let stiffness = submatrix(&matrices.stiffness, &moving, &moving);
    let mass = submatrix(&matrices.mass, &moving, &moving);
    let factor =
        Cholesky::factor(&stiffness).map_err(|e| interior_error(body, e, |dof| moving[dof]))?;
    lowest_modes(&stiffness, &mass, count, &factor).map_err(|source| ReductionError::Eigen {
        body: body.name.clone(),
        source,
    })
}

pub(super) fn check_size(body: &Body, matrices: &BodyMatrices) -> Result<usize, ReductionError> {
    let expected = 3 * body.dofs.free_nodes();
    for found in [
        matrices.stiffness.nrows(),
        matrices.mass.nrows(),
        matrices.load_n.len(),
    ] {
        if found != expected {
            return Err(ReductionError::Size {
                body: body.name.clone(),
                expected,
                found,
            });
        }
    }
    Ok(expected)
}

/// Names the node at which the factorisation of a body stopped.
fn interior_error(
    body: &Body,
    source: FactorError,
    free_dof: impl Fn(usize) -> usize,
) -> ReductionError {
    let name = body.name.clone();
    let tag = |dof: usize| node_tag(body, free_dof(dof) / 3);
    match source {
        FactorError::Singular { dof, .. } => ReductionError::InteriorNotHeld {
            body: name,
            node: tag(dof),
        },
        FactorError::NotPositiveDefinite { dof } => ReductionError::InteriorUnstable {
            body: name,
            node: tag(dof),
        },
        source => ReductionError::Factor { body: name, source },
    }
}

fn stacked(upper: MatRef<'_, f64>, lower: MatRef<'_, f64>) -> Mat<f64> {
    let mut all = Mat::zeros(upper.nrows() + lower.nrows(), lower.ncols());
    all.get_mut(..upper.nrows(), ..).copy_from(upper);
    all.get_mut(upper.nrows().., ..).copy_from(lower);
    all
}

/// The mesh's tag of a free node.
fn node_tag(body: &Body, free: usize) -> u64 {
    let is_it = |motion: &NodeMotion| *motion == NodeMotion::Free(free as u32);
    let local = body.dofs.nodes.iter().position(is_it);
    local
        .and_then(|local| body.node_tags.get(local))
        .copied()
        .unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reduction::lattice_model::assembly;
    use dovetail_numerics::sparse::dense;
    use faer::linalg::solvers::Solve;

    fn dynamic_stiffness(k: &Mat<f64>, m: &Mat<f64>, omega: f64) -> Mat<f64> {
        k - faer::Scale(omega * omega) * m
    }

    /// Z_bb - Z_bi Z_ii^-1 Z_ib, first `split` unknowns condensed if `first`, else the others.
    fn condensed(z: &Mat<f64>, inner: std::ops::Range<usize>) -> Mat<f64> {
        let outer = if inner.start == 0 {
            inner.end..z.nrows()
        } else {
            0..inner.start
        };
        let z_ii = z.get(inner.clone(), inner.clone());
        let z_ib = z.get(inner.clone(), outer.clone());
        let z_bi = z.get(outer.clone(), inner);
        z.get(outer.clone(), outer) - z_bi * z_ii.partial_piv_lu().solve(z_ib)
    }

    #[test]
    fn all_modes_give_the_exact_dynamic_stiffness_and_fields() {
        let (model, structure) = assembly([1000, 1000]);
        for b in 0..2 {
            let (body, matrices) = (&model.bodies[b], &structure.bodies[b]);
            let reduced = condense(body, matrices).unwrap();
            let split = 3 * body.dofs.interior_nodes;
            assert_eq!(reduced.omega2.len(), split);
            let (k, m) = (dense(&matrices.stiffness), dense(&matrices.mass));
            for omega in [0.0, 3.1e3, 1.7e4, 6.3e4] {
                let full = condensed(&dynamic_stiffness(&k, &m, omega), 0..split);
                let small = dynamic_stiffness(&reduced.stiffness, &reduced.mass, omega);
                let small = condensed(&small, reduced.kept()..reduced.coordinates());
                let error = (&full - &small).norm_max() / full.norm_max();
                assert!(error < 1e-9, "{omega}: {error}");
            }
            // Fields: a forced motion of the kept dofs, solved on both.
            let omega = 1.7e4;
            let kept = Mat::from_fn(reduced.kept(), 2, |i, j| ((i + 3 * j) as f64).sin());
            let z = dynamic_stiffness(&k, &m, omega);
            let interior = z
                .get(..split, ..split)
                .partial_piv_lu()
                .solve(-(z.get(..split, split..) * &kept));
            let w = dynamic_stiffness(&reduced.stiffness, &reduced.mass, omega);
            let (nk, n) = (reduced.kept(), reduced.coordinates());
            let modal = w
                .get(nk..n, nk..n)
                .partial_piv_lu()
                .solve(-(w.get(nk..n, ..nk) * &kept));
            let motion = reduced.motion(stacked(kept.as_ref(), modal.as_ref()).as_ref());
            let expected = stacked(interior.as_ref(), kept.as_ref());
            assert!((&motion - &expected).norm_max() < 1e-9 * expected.norm_max());
        }
    }

    #[test]
    fn statics_are_exact_without_any_mode() {
        let (model, structure) = assembly([0, 0]);
        let (body, matrices) = (&model.bodies[1], &structure.bodies[1]);
        let reduced = condense(body, matrices).unwrap();
        let f = |v: &[f64]| Mat::from_fn(v.len(), 1, |i, _| v[i]);
        let exact = dense(&matrices.stiffness)
            .partial_piv_lu()
            .solve(f(&matrices.load_n));
        let kept = reduced.stiffness.partial_piv_lu().solve(f(&reduced.load_n));
        let all = reduced.static_displacement(kept.col_as_slice(0));
        let error = (f(&all) - &exact).norm_max() / exact.norm_max();
        assert!(error < 1e-11, "{error}");
    }

    #[test]
    fn rigid_motion_keeps_its_mass() {
        // Translation of the free bar: u^T M u is the whole mass, whatever the modes kept.
        let (model, structure) = assembly([4, 0]);
        let reduced = condense(&model.bodies[0], &structure.bodies[0]).unwrap();
        let all = dense(&structure.bodies[0].mass);
        let n = all.nrows();
        let total: f64 = (0..n / 3)
            .flat_map(|i| (0..n / 3).map(move |j| (i, j)))
            .map(|(i, j)| all[(3 * i, 3 * j)])
            .sum();
        let kept = reduced.kept();
        let u = Mat::from_fn(kept, 1, |i, _| if i % 3 == 0 { 1.0 } else { 0.0 });
        let small = u.transpose() * (reduced.mass.get(..kept, ..kept) * &u);
        assert!((small[(0, 0)] / total - 1.0).abs() < 1e-12);
        assert!((reduced.stiffness.get(..kept, ..kept) * &u).norm_max() < 1e-12 * 3e7 * 50.0);
    }

    #[test]
    fn held_modes_are_those_of_the_body_with_its_flanks_held() {
        let (model, structure) = assembly([0, 0]);
        let body = &model.bodies[0];
        let modes = held_modes(body, &structure.bodies[0], 5).unwrap();
        let flank = 3 * body.dofs.interior_nodes;
        let stiffen = |a: &CscMatrix<f64>, large: f64| {
            let mut a = dense(a);
            (flank..flank + 3 * body.dofs.flank_nodes).for_each(|i| a[(i, i)] += large);
            a
        };
        let (k, m) = (&structure.bodies[0].stiffness, &structure.bodies[0].mass);
        let penalty = dovetail_numerics::eigen::dense::modes(
            stiffen(k, 1e18).as_ref(),
            stiffen(m, 0.0).as_ref(),
        )
        .unwrap();
        for (held, penalty) in modes.omega2.iter().zip(&penalty.omega2) {
            assert!((held / penalty - 1.0).abs() < 1e-7, "{held} {penalty}");
        }
        assert_eq!(modes.count(), 5);
    }

    #[test]
    fn errors_name_the_body_and_the_node() {
        let (model, mut structure) = assembly([2, 2]);
        let dof = 3 * 4;
        for (i, j, v) in structure.bodies[0].stiffness.triplet_iter_mut() {
            if i == dof && j == dof {
                *v = -1e10;
            }
        }
        let message = condense(&model.bodies[0], &structure.bodies[0])
            .unwrap_err()
            .to_string();
        let local = model.bodies[0]
            .dofs
            .nodes
            .iter()
            .position(|m| *m == NodeMotion::Free(4));
        let tag = model.bodies[0].node_tags[local.unwrap()].to_string();
        assert!(
            message.contains("`bar`") && message.contains(&tag),
            "{message}"
        );
        structure.bodies[1].load_n.pop();
        assert!(matches!(
            condense(&model.bodies[1], &structure.bodies[1]),
            Err(ReductionError::Size { .. })
        ));
    }
}
