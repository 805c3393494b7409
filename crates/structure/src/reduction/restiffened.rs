//! Change of the stuck frequencies by another stiffness of the bodies, such as that of another
//! prestress.
//!
//! With the stuck modes Phi of K (unit modal mass), the frequencies for K + D are those of
//! `w^2 + Phi^T D Phi` (Rayleigh-Ritz). The error by the modes left out is of second order in D.

use faer::Mat;

use nalgebra_sparse::CscMatrix;

use super::{LISTED_MODES, Reduction};
use dovetail_numerics::dense::parallel::product;
use dovetail_numerics::dense::{self_adjoint_eigenvalues, symmetrised};
use dovetail_numerics::sparse::symmetric_product;

/// Largest relative change of the first stuck frequencies where `added` is added to the stiffness of
/// each body from which `reduction` was made. A motion that the sum does not resist has frequency 0,
/// which is a change of 1. `None` without modes.
pub fn frequency_change(reduction: &Reduction, added: &[CscMatrix<f64>]) -> Option<f64> {
    let model = &reduction.model;
    let count = model.stuck_modes;
    let motion = reduction.recovery.modes(count);
    let omega2 = model.stuck_omega2();
    let mut projected = Mat::from_fn(count, count, |i, j| if i == j { omega2[i] } else { 0.0 });
    for (added, shapes) in added.iter().zip(&motion) {
        let forces = symmetric_product(added, shapes.as_ref());
        projected += product(shapes.transpose(), forces.as_ref());
    }
    let changed = self_adjoint_eigenvalues(symmetrised(projected.as_ref()).as_ref())?;
    let changes = omega2.iter().zip(&changed).take(LISTED_MODES);
    let changes = changes.map(|(w2, changed)| ((changed.max(0.0) / w2).sqrt() - 1.0).abs());
    changes.reduce(f64::max)
}
