//! Craig-Bampton reduction of one body (Craig, Bampton, AIAA J. 6 (1968) 1313-1319).
//!
//! Interior dofs i, dofs of contact nodes b, fixed-interface modes Phi of (K_ii, M_ii), and the
//! static answers of the interior to its loads that the modes do not give, the residual vectors of
//! `residual.rs`, together V:
//!
//! ```text
//! u_i = Psi u_b + V q,   Psi = -K_ii^-1 K_ib
//! K = [ K_bb + K_bi Psi   0    ]   M = [ M_bb + M_bi Psi + Psi^T W   W^T V ]   W = M_ib + M_ii Psi
//!     [ 0                 w_q^2 ]       [ V^T W                       1     ]
//! ```
//!
//! Psi is never formed: the two condensed blocks come out of the factorisation of K_ii
//! ([`dovetail_numerics::sparse::condense()`]). Fields are recovered by one solve each.

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;
use serde::{Deserialize, Serialize};

use super::ReductionError;
use super::residual::residual_vectors;
use crate::structure::BodyMatrices;
use dovetail_numerics::dense::parallel::product;
use dovetail_numerics::eigen::{Modes, lowest_modes};
use dovetail_numerics::sparse::{self, Cholesky, FactorError, Symbolic, stored, submatrix, times};

/// Body on the degrees of freedom of its contact nodes and the amplitudes of its fixed-interface
/// modes and residual vectors: n coordinates, in this order.
#[derive(Debug, Clone)]
pub struct CraigBamptonBody {
    /// Stiffness, N/m, n x n, every entry stored.
    pub stiffness: CscMatrix<f64>,
    /// Mass, kg, n x n (modes mass-normalised), every entry stored.
    pub mass: CscMatrix<f64>,
    /// Squared angular frequencies of the fixed-interface modes, rad2/s2.
    pub omega2: Vec<f64>,
    /// Recovery of the body's interior.
    pub interior: Interior,
}

/// Recovery of the interior of a reduced body.
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
    /// Motion of all free degrees of freedom, one column per column of `coordinates`:
    /// `u_i = Psi u_b + V q`.
    pub fn motion(&self, coordinates: MatRef<'_, f64>) -> Mat<f64> {
        let (contact, modal) = coordinates.split_at_row(self.coupling.ncols());
        let mut carried = times(&self.coupling, contact);
        self.factor.solve_in_place(carried.as_mut());
        let interior = product(self.modes.as_ref(), modal) - carried;
        stacked(interior.as_ref(), contact)
    }

    /// Transforms a load on the free degrees of freedom to the coordinates: `f_b + Psi^T f_i`,
    /// `V^T f_i`.
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

    /// Applies K_ii^-1 to each column.
    pub(super) fn solve(&self, mut columns: Mat<f64>) -> Mat<f64> {
        self.factor.solve_in_place(columns.as_mut());
        columns
    }
}

/// Reduces a body to its contact nodes and its `count` lowest fixed-interface modes. The reduced
/// body answers the static `loads` (free degrees of freedom x loads) exactly.
///
/// # Errors
/// [`ReductionError::InteriorNotHeld`] and [`ReductionError::InteriorUnstable`] where the interior
/// is not held or unstable, [`ReductionError::Factor`], [`ReductionError::Eigen`],
/// [`ReductionError::Residual`], [`ReductionError::Size`].
pub fn condense(
    body: &BodyMatrices,
    count: usize,
    loads: MatRef<'_, f64>,
) -> Result<CraigBamptonBody, ReductionError> {
    check_size(body)?;
    let (split, n) = (body.interior_dofs(), body.dofs());
    let (inner, outer): (Vec<usize>, Vec<usize>) = ((0..split).collect(), (split..n).collect());
    let (stiffness, mass) = (&*body.stiffness_with_places(), &body.mass);
    let condensed = Symbolic::analyse(&submatrix(stiffness, &inner, &inner))
        .and_then(|symbolic| sparse::condense(stiffness, mass, &symbolic))
        .map_err(|e| interior_error(body, e))?;
    let factor = condensed.factor;
    let k_ii = submatrix(stiffness, &inner, &inner);
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
    let with_mass = modes.count() - residual.massless;
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
    Ok(CraigBamptonBody {
        stiffness: whole(&condensed.stiffness, &|_, _| 0.0, &|i| modes.omega2[i]),
        mass: whole(
            &condensed.mass,
            &|i, j| if j < with_mass { coupled[(i, j)] } else { 0.0 },
            &|_| 1.0,
        ),
        omega2: fixed.omega2,
        interior: Interior {
            factor,
            coupling: submatrix(stiffness, &inner, &outer),
            modes: modes.vectors,
        },
    })
}

/// Modes of both, in this order.
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

/// Dense matrix in the form of a sparse one.
fn stored_whole(n: usize, entry: impl Fn(usize, usize) -> f64) -> CscMatrix<f64> {
    let offsets = (0..=n).map(|j| j * n).collect();
    let rows = (0..n * n).map(|at| at % n).collect();
    let values = (0..n * n).map(|at| entry(at % n, at / n)).collect();
    CscMatrix::try_from_csc_data(n, n, offsets, rows, values)
        .expect("every row of every column, in order")
}

/// The `count` lowest fixed-interface modes of a body, which is not reduced: its contact nodes do
/// not move. Vectors are on the free degrees of freedom of its interior.
///
/// # Errors
/// The errors of [`condense()`].
pub fn fixed_interface_modes(body: &BodyMatrices, count: usize) -> Result<Modes, ReductionError> {
    check_size(body)?;
    let inner: Vec<usize> = (0..body.interior_dofs()).collect();
    let stiffness = submatrix(&body.stiffness, &inner, &inner);
    let mass = submatrix(&body.mass, &inner, &inner);
    let factor = Cholesky::factor(&stiffness).map_err(|e| interior_error(body, e))?;
    lowest_modes(&stiffness, &mass, count, &factor).map_err(|source| ReductionError::Eigen {
        body: body.name.clone(),
        source,
    })
}

pub(super) fn check_size(body: &BodyMatrices) -> Result<(), ReductionError> {
    let expected = body.dofs();
    let sizes = [
        ("its mass", body.mass.ncols()),
        ("its steady load", body.load_n.len()),
        (
            "the list of its nodes, three rows a node,",
            3 * body.node_tags.len(),
        ),
    ];
    match sizes.into_iter().find(|(_, found)| *found != expected) {
        Some((what, found)) => Err(ReductionError::Size {
            body: body.name.clone(),
            what,
            expected,
            found,
        }),
        None => Ok(()),
    }
}

/// Names the node at which the factorisation of a body stopped.
fn interior_error(body: &BodyMatrices, source: FactorError) -> ReductionError {
    let name = body.name.clone();
    let tag = |dof: usize| body.node_tag(dof / 3);
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
    let mut rows = Mat::zeros(upper.nrows() + lower.nrows(), lower.ncols());
    rows.get_mut(..upper.nrows(), ..).copy_from(upper);
    rows.get_mut(upper.nrows().., ..).copy_from(lower);
    rows
}
