//! Length along a curve, by which steps are measured.
//!
//! `dl^2 = |dT|^2 / |T|^2 + (dp / range)^2`, with T the complex first harmonics of what is observed
//! and p the abscissa.
//! The mean and the pairs are left out: pairs that shake down move the mean at corners, where the
//! direction of the whole U turns and that of what is observed does not.

use crate::dlft::balance::Balance;
use crate::dlft::orbit::{first_harmonic_slopes, first_harmonics};
use dovetail_numerics::spectrum::{cosine, sine};
use dovetail_numerics::vector::{dot, norm};
use faer::c64;
use std::f64::consts::TAU;

/// Relative step in the frequency of the difference that takes the derivative of T at constant U.
const DIFFERENCE: f64 = 1e-6;

/// Motion T of a point: cosine and sine part of each observed displacement, m; without any, the
/// first harmonic of the pairs in forces, eps X, N.
pub(crate) fn motion(balance: &Balance, u: &[f64], frequency_hz: f64) -> Vec<f64> {
    let system = &balance.setting.system;
    if system.problem.reduced.observations.is_empty() {
        let n = balance.unknowns_per_block();
        let first = cosine(1) * n..(sine(1) + 1) * n;
        return first.map(|i| balance.eps_at(i) * u[i]).collect();
    }
    let observed = first_harmonics(system, u, TAU * frequency_hz);
    observed.iter().flat_map(|t| [t.re, -t.im]).collect()
}

/// Direction of a curve: derivatives by the length of the curve.
#[derive(Debug, Clone)]
pub(crate) struct Direction {
    /// Derivative of U, m.
    pub u: Vec<f64>,
    /// Derivative of the abscissa.
    pub abscissa: f64,
    /// Sign of the determinant of the derivatives of the residual by U and by the abscissa, with the
    /// direction as the last row: `true` if it is negative. Along a curve it does not change, round
    /// folds and through corners of the contact law either. `None` where it is not known.
    pub is_negative: Option<bool>,
}

/// Change of the motion T and of the abscissa, such as that from one point of a curve to another.
#[derive(Clone)]
pub(crate) struct Change {
    /// Change of T.
    pub motion: Vec<f64>,
    /// Change of the abscissa.
    pub abscissa: f64,
}

/// Coefficients of a linear equation for a change of U and of the abscissa: a row of the bordered
/// matrix.
#[derive(Debug, Clone)]
pub(crate) struct BorderRow {
    /// Coefficients of dU.
    pub row: Vec<f64>,
    /// Coefficient of the change of the abscissa, in the corner of the matrix.
    pub corner: f64,
}

/// Derivatives of the motion T of a point.
pub(crate) struct Gauge {
    /// Number of unknowns of U.
    unknowns: usize,
    /// Number of unknowns of a block.
    n: usize,
    /// Complex coefficients of each observed displacement; empty where nothing is observed.
    slopes: Vec<Vec<c64>>,
    /// eps of a block, N/m.
    eps: Vec<f64>,
    /// Derivative with respect to the abscissa at constant U.
    over_abscissa: Vec<f64>,
}

impl Gauge {
    /// Gauge at a point, where T has this derivative with respect to the abscissa at constant U.
    pub(crate) fn new(
        balance: &Balance,
        u: &[f64],
        frequency_hz: f64,
        over_abscissa: Vec<f64>,
    ) -> Self {
        let n = balance.unknowns_per_block();
        Self {
            unknowns: u.len(),
            n,
            slopes: first_harmonic_slopes(&balance.setting.system, TAU * frequency_hz),
            eps: (0..n).map(|i| balance.eps_at(i)).collect(),
            over_abscissa,
        }
    }

    /// Derivative of the motion T of a point with respect to the frequency at constant U, per Hz.
    pub(crate) fn motion_per_hz(balance: &Balance, u: &[f64], frequency_hz: f64) -> Vec<f64> {
        let step = DIFFERENCE * frequency_hz;
        let [above, below] = [step, -step].map(|by| motion(balance, u, frequency_hz + by));
        let differences = above.iter().zip(&below);
        differences.map(|(a, b)| (a - b) / (2.0 * step)).collect()
    }

    /// Change of T along a direction.
    pub(crate) fn directional_change(&self, direction: &Direction) -> Vec<f64> {
        let block = |of: usize| &direction.u[of * self.n..(of + 1) * self.n];
        let (c, s) = (block(cosine(1)), block(sine(1)));
        let mut out: Vec<f64> = if self.slopes.is_empty() {
            let both = c.iter().chain(s).zip(self.eps.iter().cycle());
            both.map(|(x, eps)| eps * x).collect()
        } else {
            let parts = |slope: &Vec<c64>| {
                let [re, im]: [Vec<f64>; 2] =
                    [|v: &c64| v.re, |v: &c64| v.im].map(|part| slope.iter().map(part).collect());
                [dot(&re, c) + dot(&im, s), dot(&re, s) - dot(&im, c)]
            };
            self.slopes.iter().flat_map(parts).collect()
        };
        for (out, slope) in out.iter_mut().zip(&self.over_abscissa) {
            *out += slope * direction.abscissa;
        }
        out
    }

    /// Coefficients of dU and dp in `weights . dT`.
    pub(crate) fn coefficients(&self, weights: &[f64]) -> BorderRow {
        let n = self.n;
        let mut row = vec![0.0; self.unknowns];
        let (c, s) = (cosine(1) * n, sine(1) * n);
        if self.slopes.is_empty() {
            for i in 0..n {
                row[c + i] = weights[i] * self.eps[i];
                row[s + i] = weights[n + i] * self.eps[i];
            }
        }
        for (slope, of) in self.slopes.iter().zip(weights.chunks_exact(2)) {
            for (i, v) in slope.iter().enumerate() {
                row[c + i] += of[0] * v.re - of[1] * v.im;
                row[s + i] += of[0] * v.im + of[1] * v.re;
            }
        }
        BorderRow {
            row,
            corner: dot(weights, &self.over_abscissa),
        }
    }
}

/// Scales of a length: that of T, and the range of the abscissa.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scales {
    /// |T| that a change is measured against.
    pub motion: f64,
    /// Range of the abscissa.
    pub range: f64,
}

impl Scales {
    /// Length of a change of T and of the abscissa.
    pub(crate) fn length(self, change: &Change) -> f64 {
        (norm(&change.motion) / self.motion).hypot(change.abscissa / self.range)
    }

    /// Coefficients of dU and dp in the product of a change with any other.
    pub(crate) fn border_row(self, gauge: &Gauge, change: &Change) -> BorderRow {
        let by = (self.motion * self.motion).recip();
        let weights: Vec<f64> = change.motion.iter().map(|t| t * by).collect();
        let mut across = gauge.coefficients(&weights);
        across.corner += change.abscissa / (self.range * self.range);
        across
    }

    /// Product of two changes.
    pub(crate) fn product(self, a: &Change, b: &Change) -> f64 {
        dot(&a.motion, &b.motion) / (self.motion * self.motion)
            + a.abscissa * b.abscissa / (self.range * self.range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::balance::Setting;
    use crate::dlft::jacobians::{OMEGA_RAD_S, sample_points_of_waves_too};
    use crate::problem::dynamic_stiffness::ContactSystem;
    use crate::reduced::ReducedModel;

    #[test]
    fn derivatives_of_the_motion_are_those_by_differences_with_and_without_observations() {
        for (what, sample, u) in &sample_points_of_waves_too() {
            let mut problem = sample.setting.system.problem.clone();
            for observed in [true, false] {
                if !observed {
                    let reduced = problem.reduced_mut();
                    reduced.observations.clear();
                    reduced.waves = reduced.waves.map_copies(|_, copies| ReducedModel {
                        observations: Vec::new(),
                        ..copies.clone()
                    });
                }
                let system = ContactSystem::new(&problem, sample.setting.system.damping);
                let setting = Setting {
                    system: system.into(),
                    ..sample.setting.clone()
                };
                let frequency_hz = OMEGA_RAD_S / TAU;
                let balance = Balance::new(&setting, OMEGA_RAD_S);
                let direction = Direction {
                    u: (0..u.len()).map(|i| (i as f64 * 0.37).sin()).collect(),
                    abscissa: 0.01,
                    is_negative: None,
                };
                let per_hz = Gauge::motion_per_hz(&balance, u, frequency_hz);
                let gauge = Gauge::new(&balance, u, frequency_hz, per_hz);
                let moved = |by: f64| {
                    let along = u.iter().zip(&direction.u);
                    let u: Vec<f64> = along.map(|(u, d)| u + by * d).collect();
                    motion(&balance, &u, frequency_hz + by * direction.abscissa)
                };
                let [above, below] = [1e-5, -1e-5].map(moved);
                let along = gauge.directional_change(&direction);
                let size = norm(&along);
                assert!(size > 0.0);
                for ((a, b), along) in above.iter().zip(&below).zip(&along) {
                    let by_differences = (a - b) / 2e-5;
                    let off = (by_differences - along).abs();
                    assert!(off < 1e-6 * size, "{what}: {by_differences} {along}");
                }
                let weights: Vec<f64> = (0..along.len()).map(|i| 1.0 - 0.3 * i as f64).collect();
                let BorderRow { row, corner } = gauge.coefficients(&weights);
                let by_row = dot(&row, &direction.u) + corner * direction.abscissa;
                let directly = dot(&weights, &along);
                assert!((by_row - directly).abs() < 1e-9 * size, "{what}");
            }
        }
    }
}
