//! Estimates of the errors by the modes that are left out.
//!
//! With the modes below w_c kept, rho = w^2 / (w_c^2 - w^2) at the frequency w, and R the residual
//! flexibility of the kept modes:
//!
//! - From a load f to an observed point c the modes left out add to the static answer, which the
//!   residual vectors make exact, at most rho^2 sqrt(f^T R f) sqrt(c^T R c). This is compared with
//!   sqrt(f^T K^-1 f) sqrt(c^T K^-1 c).
//! - Flanks that yield by X pull at g with w^2 y, y = (M_gx + M_gg Psi) X. The answer of the modes
//!   left out is at first w^2 (K_gg^-1 - Phi Omega^-2 Phi^T) y. It lowers the squared frequency of
//!   a motion of unit modal mass by w^4 (y^T K_gg^-1 y - sum_m (p_m . X)^2 / w_m^2). X is taken
//!   from the first stuck modes k, on pairs that are as soft as the bodies behind them:
//!   (K + diag K) X = w_k^2 p_k.

use faer::Mat;

use super::ReducedModel;
use dovetail_numerics::dense::parallel::symmetric_times;
use dovetail_numerics::krylov::gmres;
use serde::{Deserialize, Serialize};

/// Number of modes whose yielding flanks are considered.
const MODES: usize = 3;
const TOLERANCE: f64 = 1e-2;
const MOST_ITERATIONS: usize = 100;

/// Estimated errors by the modes left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ModalTruncation {
    /// Relative error of the amplitudes of observed points at the highest frequency asked for;
    /// `None` where the modes kept do not reach beyond it.
    pub amplitude: Option<f64>,
    /// Relative errors of the first stuck frequencies by the bodies that were reduced by
    /// themselves; empty where none was.
    pub frequencies: Vec<f64>,
}

/// Fractions of static energy that the modes leave to the residual vectors: the largest among loads
/// and among observed points.
#[derive(Debug, Clone, Copy)]
pub(super) struct EnergyShares {
    pub loads: f64,
    pub observed: f64,
}

/// Yielding X of the flanks under the first stuck modes, of unit modal mass: n x modes.
pub(super) fn modal_yielding(reduced: &ReducedModel) -> Mat<f64> {
    let diagonal = reduced.diagonal_stiffness();
    let n = diagonal.len();
    let stiffness = reduced.stiffness.as_ref();
    let apply = |v: &[f64], w: &mut [f64]| {
        let soft: Vec<f64> = v
            .iter()
            .zip(&diagonal)
            .map(|(v, d)| v / (2.0 * d))
            .collect();
        symmetric_times(stiffness, &soft, w);
        for ((w, v), d) in w.iter_mut().zip(&soft).zip(&diagonal) {
            *w += d * v;
        }
    };
    let precondition = |v: &mut [f64]| v.iter_mut().zip(&diagonal).for_each(|(v, d)| *v /= 2.0 * d);
    let mut x = Mat::zeros(n, MODES.min(reduced.omega2.len()));
    for (k, omega2) in reduced.omega2.iter().enumerate().take(x.ncols()) {
        let force: Vec<f64> = (0..n).map(|i| omega2 * reduced.coupling[(i, k)]).collect();
        let x = x.col_as_slice_mut(k);
        gmres(apply, precondition, &force, x, TOLERANCE, MOST_ITERATIONS);
    }
    x
}

/// Estimated relative error of amplitudes up to `highest_rad_s`. `answers` are y^T K_gg^-1 y of the
/// motions [`modal_yielding`]. `None` where the last stuck mode lies below `highest_rad_s`.
pub(super) fn amplitude(
    reduced: &ReducedModel,
    left: EnergyShares,
    yielding: &Mat<f64>,
    answers: &[f64],
    highest_rad_s: f64,
) -> Option<f64> {
    let cut = *reduced.stuck_omega2().last()?;
    let highest2 = highest_rad_s.powi(2);
    if highest2 >= cut {
        return None;
    }
    let rho = highest2 / (cut - highest2);
    let of_loads = rho * rho * (left.loads * left.observed).sqrt();
    let moving = answers.iter().enumerate().map(|(k, answer)| {
        let x = yielding.col_as_slice(k);
        let kept = (0..reduced.omega2.len()).map(|m| {
            let p = reduced.coupling.col_as_slice(m).iter();
            let share: f64 = p.zip(x).map(|(p, x)| p * x).sum();
            share * share / reduced.omega2[m]
        });
        let omega2 = reduced.omega2[k].min(highest2);
        omega2 * (answer - kept.sum::<f64>()).max(0.0) / (1.0 - omega2 / cut)
    });
    Some(moving.fold(of_loads, f64::max))
}
