//! Measures of residuals and steps of a balance.

use super::balance::Balance;
use dovetail_numerics::vector::norm;

/// A residual below this fraction of |F| is rounding of the static forces (it is 5e-15 at a static
/// state).
const ROUNDING: f64 = 1e-14;

/// Norms |F| and |F_1..H|, with the forces of a vibration that none of these excites. The second is at
/// least so large that `tolerance` of it is above rounding; where nothing vibrates, it is |F|.
pub(crate) fn load_scale(balance: &Balance, tolerance: f64) -> [f64; 2] {
    let harmonic = norm(&balance.force[balance.unknowns_per_block()..]).hypot(balance.vibration_n);
    let problem = &balance.setting.system.problem;
    let whole = problem.steady_force_n().hypot(harmonic);
    if harmonic == 0.0 {
        return [whole; 2];
    }
    [whole, harmonic.max(ROUNDING / tolerance * whole)]
}

/// Larger of |f_0| / |F| and |f_1..H| / |F_1..H|, so that the vibration converges on its own scale.
pub(crate) fn relative_residual(f: &[f64], n: usize, scale: [f64; 2]) -> f64 {
    let ratio = |f: f64, s: f64| if f == 0.0 { 0.0 } else { f / s };
    let [mean, rest] = [&f[..n], &f[n..]].map(norm);
    let (mean, rest) = (ratio(mean, scale[0]), ratio(rest, scale[1]));
    if mean.is_nan() || rest.is_nan() {
        f64::NAN
    } else {
        mean.max(rest)
    }
}

/// Length of a step in forces, eps dU, so that steps of pairs of different stiffness weigh alike.
pub(crate) fn step_length(balance: &Balance, dx: &[f64]) -> f64 {
    let forces = dx.iter().enumerate().map(|(i, d)| balance.eps_at(i) * d);
    forces.map(|f| f * f).sum::<f64>().sqrt()
}
