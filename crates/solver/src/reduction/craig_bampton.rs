//! Craig-Bampton reduction of one body (Craig, Bampton, AIAA J. 6 (1968) 1313-1319).
//!
//! Interior dofs i, dofs of contact nodes b, fixed-interface modes Phi of (K_ii, M_ii), and the static
//! answers of the interior to its loads that the modes do not give, the residual vectors of `residual.rs`, together V:
//!
//! ```text
//! u_i = Psi u_b + V q,   Psi = -K_ii^-1 K_ib
//! K = [ K_bb + K_bi Psi   0    ]   M = [ M_bb + M_bi Psi + Psi^T W   W^T V ]   W = M_ib + M_ii Psi
//!     [ 0                 w_q^2 ]       [ V^T W                       1     ]
//! ```
//!
//! Psi is never formed: the two condensed blocks come out of the factorisation of K_ii
//! ([`dovetail_numerics::condense`]). Fields are recovered by one solve each.

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;
use serde::{Deserialize, Serialize};

use super::ReductionError;
use super::residual::residual_vectors;
use crate::fem::BodyMatrices;
use crate::model::Body;
use dovetail_numerics::condense;
use dovetail_numerics::eigen::{Modes, lowest_modes};
use dovetail_numerics::factor::{Cholesky, FactorError, Symbolic};
use dovetail_numerics::sparse::{product, submatrix, times};
use dovetail_numerics::stored;

/// One body on the dofs of its contact nodes and the amplitudes of its fixed-interface modes and residual
/// vectors: n coordinates, in this order.
#[derive(Debug, Clone)]
pub struct ReducedBody {
    /// N/m, n x n, every entry stored.
    pub stiffness: CscMatrix<f64>,
    /// kg, n x n (modes mass-normalised), every entry stored.
    pub mass: CscMatrix<f64>,
    /// Fixed-interface modes, squared angular frequencies.
    pub omega2: Vec<f64>,
    /// The way back to the body.
    pub interior: Interior,
}

/// What gives the interior of a reduced body back.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Interior {
    factor: Cholesky,
    /// K_ib
    #[serde(with = "stored::sparse_matrix")]
    coupling: CscMatrix<f64>,
    /// V
    #[serde(with = "stored::matrix")]
    modes: Mat<f64>,
}

impl Interior {
    /// Motion of all free dofs, one column per column of `coordinates`: `u_i = Psi u_b + V q`.
    pub fn motion(&self, coordinates: MatRef<'_, f64>) -> Mat<f64> {
        let (contact, modal) = coordinates.split_at_row(self.coupling.ncols());
        let mut carried = times(&self.coupling, contact);
        self.factor.solve_in_place(carried.as_mut());
        let interior = product(self.modes.as_ref(), modal) - carried;
        stacked(interior.as_ref(), contact)
    }

    /// A load on the free dofs, on the coordinates: `f_b + Psi^T f_i`, `V^T f_i`.
    pub fn gather(&self, load: &[f64]) -> Vec<f64> {
        let (interior, contact) = load.split_at(self.coupling.nrows());
        let column = MatRef::from_column_major_slice(interior, interior.len(), 1);
        let on_modes = product(self.modes.transpose(), column);
        let mut followed = interior.to_vec();
        if followed.iter().any(|f| *f != 0.0) {
            self.factor.solve_vector(&mut followed);
        }
        let carried = self.coupling.col_iter().map(|column| -> f64 {
            let entries = column.row_indices().iter().zip(column.values());
            entries.map(|(&i, v)| v * followed[i]).sum()
        });
        let on_contact = contact.iter().zip(carried).map(|(f, c)| f - c);
        on_contact
            .chain(on_modes.col_as_slice(0).iter().copied())
            .collect()
    }

    /// K_ii^-1 on each column.
    pub(super) fn solve(&self, mut columns: Mat<f64>) -> Mat<f64> {
        self.factor.solve_in_place(columns.as_mut());
        columns
    }
}

/// Reduces a body to its contact nodes and its `count` lowest fixed-interface modes. It answers the static
/// `loads` (free dofs x loads) exactly.
///
/// # Errors
/// [`ReductionError::InteriorNotHeld`] and [`ReductionError::InteriorUnstable`] where the interior
/// is not held or unstable, [`ReductionError::Factor`], [`ReductionError::Eigen`],
/// [`ReductionError::Residual`], [`ReductionError::Size`].
pub fn condense(
    body: &Body,
    matrices: &BodyMatrices,
    count: usize,
    loads: MatRef<'_, f64>,
) -> Result<ReducedBody, ReductionError> {
    let n = check_size(body, matrices)?;
    let split = 3 * body.dofs.interior_nodes;
    let (inner, outer): (Vec<usize>, Vec<usize>) = ((0..split).collect(), (split..n).collect());
    let (stiffness, mass) = (&matrices.stiffness, &matrices.mass);
    let k_ii = submatrix(stiffness, &inner, &inner);
    let condensed = Symbolic::analyse(&k_ii)
        .and_then(|symbolic| condense::condense(stiffness, mass, &k_ii, &symbolic))
        .map_err(|e| interior_error(body, e))?;
    let factor = condensed.factor;
    let m_ii = submatrix(mass, &inner, &inner);
    let eigen = |source| ReductionError::Eigen {
        body: body.name.clone(),
        source,
    };
    let fixed = lowest_modes(&k_ii, &m_ii, count, &factor).map_err(eigen)?;
    drop(k_ii);
    let loads = loads.subrows(0, split);
    let mut answers = loads.to_owned();
    factor.solve_in_place(answers.as_mut());
    let residual = residual_vectors(loads, answers.as_ref(), &fixed, &m_ii).map_err(|source| {
        ReductionError::Residual {
            part: format!("body `{}`", body.name),
            source,
        }
    })?;
    let modes = side_by_side(&fixed, &residual.vectors);
    // (M_bi + Psi^T M_ii) V with Psi^T = -K_bi K_ii^-1.
    let mut followed = times(&m_ii, modes.vectors.as_ref());
    factor.solve_in_place(followed.as_mut());
    let coupled = times(&submatrix(mass, &outer, &inner), modes.vectors.as_ref())
        - times(&submatrix(stiffness, &outer, &inner), followed.as_ref());
    let contact = n - split;
    let whole =
        |corner: &Mat<f64>, coupled: &dyn Fn(usize, usize) -> f64, own: &dyn Fn(usize) -> f64| {
            let entry = |i: usize, j: usize| match (i < contact, j < contact) {
                (true, true) => corner[(i, j)],
                (true, false) => coupled(i, j - contact),
                (false, true) => coupled(j, i - contact),
                (false, false) if i == j => own(i - contact),
                (false, false) => 0.0,
            };
            stored_whole(contact + modes.count(), entry)
        };
    Ok(ReducedBody {
        stiffness: whole(&condensed.stiffness, &|_, _| 0.0, &|i| modes.omega2[i]),
        mass: whole(&condensed.mass, &|i, j| coupled[(i, j)], &|_| 1.0),
        omega2: fixed.omega2,
        interior: Interior {
            factor,
            coupling: submatrix(stiffness, &inner, &outer),
            modes: modes.vectors,
        },
    })
}

/// The modes of both, in this order.
pub(super) fn side_by_side(first: &Modes, second: &Modes) -> Modes {
    let (m, n) = (first.vectors.nrows(), first.count());
    let mut vectors = Mat::zeros(m, n + second.count());
    vectors.subcols_mut(0, n).copy_from(&first.vectors);
    vectors
        .subcols_mut(n, second.count())
        .copy_from(&second.vectors);
    Modes {
        omega2: [&first.omega2[..], &second.omega2].concat(),
        vectors,
    }
}

/// A dense matrix in the form of a sparse one.
fn stored_whole(n: usize, entry: impl Fn(usize, usize) -> f64) -> CscMatrix<f64> {
    let offsets = (0..=n).map(|j| j * n).collect();
    let rows = (0..n * n).map(|at| at % n).collect();
    let values = (0..n * n).map(|at| entry(at % n, at / n)).collect();
    CscMatrix::try_from_csc_data(n, n, offsets, rows, values)
        .expect("every row of every column, in order")
}

/// The `count` lowest fixed-interface modes of a body: its contact nodes do not move, and nothing
/// is reduced. Vectors are on the free dofs of its interior.
///
/// # Errors
/// As [`condense()`].
pub fn fixed_interface_modes(
    body: &Body,
    matrices: &BodyMatrices,
    count: usize,
) -> Result<Modes, ReductionError> {
    check_size(body, matrices)?;
    let inner: Vec<usize> = (0..3 * body.dofs.interior_nodes).collect();
    let stiffness = submatrix(&matrices.stiffness, &inner, &inner);
    let mass = submatrix(&matrices.mass, &inner, &inner);
    let factor = Cholesky::factor(&stiffness).map_err(|e| interior_error(body, e))?;
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
fn interior_error(body: &Body, source: FactorError) -> ReductionError {
    let name = body.name.clone();
    let tag = |dof: usize| node_tag(body, dof / 3);
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

/// The mesh's tag of a free node; of an auxiliary one that of a node near it.
pub(super) fn node_tag(body: &Body, free: usize) -> u64 {
    body.node_tags
        .get(body.mesh_node_of(free))
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

    const NO_LOADS: usize = 0;

    #[test]
    fn all_modes_give_the_exact_dynamic_stiffness_and_fields() {
        let (model, structure) = assembly([None, None]);
        for b in 0..2 {
            let (body, matrices) = (&model.bodies[b], &structure.bodies[b]);
            let loads = Mat::zeros(matrices.load_n.len(), NO_LOADS);
            let reduced = condense(body, matrices, 1000, loads.as_ref()).unwrap();
            let split = 3 * body.dofs.interior_nodes;
            assert_eq!(reduced.omega2.len(), split);
            let (k, m) = (dense(&matrices.stiffness), dense(&matrices.mass));
            let (small_k, small_m) = (dense(&reduced.stiffness), dense(&reduced.mass));
            let (nk, n) = (3 * body.dofs.contact_nodes, small_k.nrows());
            for omega in [0.0, 3.1e3, 1.7e4, 6.3e4] {
                let full = condensed(&dynamic_stiffness(&k, &m, omega), 0..split);
                let small = condensed(&dynamic_stiffness(&small_k, &small_m, omega), nk..n);
                let error = (&full - &small).norm_max() / full.norm_max();
                assert!(error < 1e-9, "{omega}: {error}");
            }
            // Fields: a forced motion of the contact nodes, solved on both.
            let omega = 1.7e4;
            let kept = Mat::from_fn(nk, 2, |i, j| ((i + 3 * j) as f64).sin());
            let z = dynamic_stiffness(&k, &m, omega);
            let interior = z
                .get(..split, ..split)
                .partial_piv_lu()
                .solve(-(z.get(..split, split..) * &kept));
            let w = dynamic_stiffness(&small_k, &small_m, omega);
            let modal = w
                .get(nk..n, nk..n)
                .partial_piv_lu()
                .solve(-(w.get(nk..n, ..nk) * &kept));
            let coordinates = stacked(kept.as_ref(), modal.as_ref());
            let motion = reduced.interior.motion(coordinates.as_ref());
            let expected = stacked(interior.as_ref(), kept.as_ref());
            assert!((&motion - &expected).norm_max() < 1e-9 * expected.norm_max());
        }
    }

    #[test]
    fn statics_are_exact_without_any_mode() {
        let (model, structure) = assembly([None, None]);
        let (body, matrices) = (&model.bodies[1], &structure.bodies[1]);
        let f = |v: &[f64]| Mat::from_fn(v.len(), 1, |i, _| v[i]);
        let load = f(&matrices.load_n);
        let reduced = condense(body, matrices, 0, load.as_ref()).unwrap();
        assert_eq!(reduced.stiffness.ncols(), 3 * body.dofs.contact_nodes + 1);
        let exact = dense(&matrices.stiffness).partial_piv_lu().solve(&load);
        let on_coordinates = f(&reduced.interior.gather(&matrices.load_n));
        let found = dense(&reduced.stiffness)
            .partial_piv_lu()
            .solve(on_coordinates);
        let all = reduced.interior.motion(found.as_ref());
        let error = (all - &exact).norm_max() / exact.norm_max();
        assert!(error < 1e-11, "{error}");
    }

    #[test]
    fn rigid_motion_keeps_its_mass() {
        // Translation of the free bar: u^T M u is the whole mass, whatever the modes kept.
        let (model, structure) = assembly([None, None]);
        let (body, matrices) = (&model.bodies[0], &structure.bodies[0]);
        let loads = Mat::zeros(matrices.load_n.len(), NO_LOADS);
        let reduced = condense(body, matrices, 4, loads.as_ref()).unwrap();
        let all = dense(&matrices.mass);
        let n = all.nrows();
        let total: f64 = (0..n / 3)
            .flat_map(|i| (0..n / 3).map(move |j| (i, j)))
            .map(|(i, j)| all[(3 * i, 3 * j)])
            .sum();
        let kept = 3 * body.dofs.contact_nodes;
        let u = Mat::from_fn(kept, 1, |i, _| if i % 3 == 0 { 1.0 } else { 0.0 });
        let (k, m) = (dense(&reduced.stiffness), dense(&reduced.mass));
        let small = u.transpose() * (m.get(..kept, ..kept) * &u);
        assert!((small[(0, 0)] / total - 1.0).abs() < 1e-12);
        assert!((k.get(..kept, ..kept) * &u).norm_max() < 1e-12 * 3e7 * 50.0);
    }

    #[test]
    fn fixed_interface_modes_are_those_of_the_body_with_its_contacts_held() {
        let (model, structure) = assembly([None, None]);
        let body = &model.bodies[0];
        let modes = fixed_interface_modes(body, &structure.bodies[0], 5).unwrap();
        let flank = 3 * body.dofs.interior_nodes;
        let stiffen = |a: &CscMatrix<f64>, large: f64| {
            let mut a = dense(a);
            (flank..a.nrows()).for_each(|i| a[(i, i)] += large);
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
        let (model, mut structure) = assembly([None, None]);
        let dof = 3 * 4;
        for (i, j, v) in structure.bodies[0].stiffness.triplet_iter_mut() {
            if i == dof && j == dof {
                *v = -1e10;
            }
        }
        let loads = |b: usize| Mat::<f64>::zeros(structure.bodies[b].load_n.len(), NO_LOADS);
        let message = condense(&model.bodies[0], &structure.bodies[0], 2, loads(0).as_ref())
            .unwrap_err()
            .to_string();
        let local = model.bodies[0]
            .dofs
            .nodes
            .iter()
            .position(|m| *m == crate::model::NodeMotion::Free(4));
        let tag = model.bodies[0].node_tags[local.unwrap()].to_string();
        assert!(
            message.contains("`bar`") && message.contains(&tag),
            "{message}"
        );
        let loads = loads(1);
        structure.bodies[1].load_n.pop();
        assert!(matches!(
            condense(&model.bodies[1], &structure.bodies[1], 2, loads.as_ref()),
            Err(ReductionError::Size { .. })
        ));
    }
}
