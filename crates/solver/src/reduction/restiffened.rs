//! Change of the stuck frequencies by another stiffness of the bodies, such as that of another
//! prestress.
//!
//! With the stuck modes Phi of K (unit modal mass), the frequencies for K + D are those of
//! `w^2 + Phi^T D Phi` (Rayleigh-Ritz). The error by the modes left out is of second order in D.

use faer::Mat;

use super::{LISTED_MODES, Reduction};
use crate::structure::Structure;
use dovetail_numerics::dense::parallel::product;
use dovetail_numerics::dense::{self_adjoint_eigenvalues, symmetrised};
use dovetail_numerics::sparse::{sum, symmetric_product};

/// Largest relative change of the first stuck frequencies where the bodies have the stiffness of
/// `other` in place of that of `structure`, from which `reduction` was made. A motion that `other`
/// does not resist has frequency 0, which is a change of 1. `None` without modes.
pub fn frequency_change(
    reduction: &Reduction,
    structure: &Structure,
    other: &Structure,
) -> Option<f64> {
    let model = &reduction.model;
    let count = model.stuck_modes;
    let motion = reduction.recovery.modes(count);
    let omega2 = model.stuck_omega2();
    let mut projected = Mat::from_fn(count, count, |i, j| if i == j { omega2[i] } else { 0.0 });
    let bodies = structure.bodies.iter().zip(&other.bodies);
    for ((before, after), shapes) in bodies.zip(&motion) {
        let difference = sum(&after.stiffness, -1.0, &before.stiffness);
        let forces = symmetric_product(&difference, shapes.as_ref());
        projected += product(shapes.transpose(), forces.as_ref());
    }
    let changed = self_adjoint_eigenvalues(symmetrised(projected.as_ref()).as_ref())?;
    let changes = omega2.iter().zip(&changed).take(LISTED_MODES);
    let changes = changes.map(|(w2, changed)| ((changed.max(0.0) / w2).sqrt() - 1.0).abs());
    changes.reduce(f64::max)
}
