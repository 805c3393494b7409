//! Equations of a backbone at one amplitude of the tracked coordinate: the balance of the pairs, and the
//! equation of the tracked mode, or the amplitude and the phase of a tracked displacement, for the
//! frequency and the damping ratio.

use crate::dlft::balance::{Balance, Jacobian, add_harmonic};
use crate::dlft::branch::bordered::{BalanceFamily, columns};
use crate::dlft::orbit::complex_block;
use crate::dlft::point::FrequencySolver;
use crate::dlft::retention::Mean;
use crate::problem::unforced::Unforced;
use dovetail_numerics::spectrum::{blocks, cosine, sine};
use dovetail_numerics::vector::norm;
use faer::c64;
use std::sync::Arc;

/// The equation of the tracked mode is met to this fraction of the relative residual: the damping
/// ratio is a small part of it.
const EQUATION_WEIGHT: f64 = 100.0;

/// Left sides below this are rounding.
const ROUNDING: f64 = 1e-14;

/// Part of the vibration whose amplitude at harmonic 1 is given, real and positive.
pub(crate) enum Tracked {
    /// Stuck mode, and the motion that goes with it ([`Unforced::tracked`]).
    Mode(Vec<(usize, c64)>),
    /// Relative displacement, in a motion without a stuck mode.
    Displacement {
        /// Number of the unknown of the sector.
        row: usize,
        /// Inertia forces of the linear mode for a unit of the displacement, N/m.
        inertia_n_m: f64,
    },
}

/// Balances at an amplitude of the tracked coordinate. The further unknowns are the frequency, as a
/// multiple of that of the linear mode, and the damping ratio.
pub(crate) struct AmplitudeFamily<'b> {
    pub solver: &'b FrequencySolver<'b>,
    pub tracked: &'b Tracked,
    /// Amplitude q of the tracked coordinate at harmonic 1.
    pub q: f64,
    /// Angular frequency of the linear mode, rad/s.
    pub linear_omega: f64,
}

impl AmplitudeFamily<'_> {
    /// Vibration at values of the further unknowns.
    pub(crate) fn motion(&self, further: &[f64]) -> Unforced<'_> {
        Unforced {
            system: &self.solver.setting.system,
            tracked: match self.tracked {
                Tracked::Mode(modes) => modes,
                Tracked::Displacement { .. } => &[],
            },
            omega_rad_s: self.linear_omega * further[0],
            damping_ratio: further[1],
        }
    }

    /// Derivative of Lambda U - F with respect to each further unknown, at constant U.
    fn slopes(&self, balance: &Balance, u: &[f64], further: &[f64]) -> Vec<Vec<f64>> {
        let motion = self.motion(further);
        let (n, harmonics) = (balance.unknowns_per_block(), balance.stiffness.harmonics());
        let both = motion.stiffness_slopes(harmonics).into_iter();
        let slopes = both
            .zip(motion.drive_slopes(self.q))
            .map(|(stiffness, drive)| {
                let mut slope = vec![0.0; blocks(harmonics) * n];
                stiffness.apply(u, &mut slope);
                slope[..n].fill(0.0);
                let less: Vec<c64> = drive.iter().map(|f| -f).collect();
                add_harmonic(&mut slope, 1, &less);
                slope
            });
        let mut slopes: Vec<Vec<f64>> = slopes.collect();
        slopes[0].iter_mut().for_each(|v| *v *= self.linear_omega);
        slopes
    }

    fn first_harmonic(&self, u: &[f64]) -> Vec<c64> {
        complex_block(u, self.solver.setting.system.unknowns(), 1)
    }
}

impl BalanceFamily for AmplitudeFamily<'_> {
    fn balance(&self, further: &[f64], mean: Mean) -> Option<Balance> {
        let is_possible = further[0] > 0.0 && further.iter().all(|v| v.is_finite());
        if !is_possible {
            return None;
        }
        let mut balance = Balance::unforced(&self.solver.setting, &self.motion(further), self.q);
        if let Tracked::Displacement { inertia_n_m, .. } = self.tracked {
            balance.vibration_n = inertia_n_m * self.q;
        }
        Some(match mean {
            Mean::Free => balance,
            Mean::Retained => balance.retained_by(Arc::clone(self.solver.retention()?)),
        })
    }

    fn columns(
        &self,
        balance: &Balance,
        jacobian: &Jacobian,
        u: &[f64],
        further: &[f64],
    ) -> Option<Vec<Vec<f64>>> {
        let slopes = self.slopes(balance, u, further);
        Some(columns(balance, jacobian, &slopes))
    }

    fn equations(&self, u: &[f64], further: &[f64]) -> Vec<f64> {
        let x = self.first_harmonic(u);
        let left = match self.tracked {
            Tracked::Mode(_) => self.motion(further).equation(&x, self.q),
            Tracked::Displacement { row, .. } => x[*row] / self.q - 1.0,
        };
        vec![left.re, left.im]
    }

    fn derivatives(&self, u: &[f64], further: &[f64]) -> [Vec<Vec<f64>>; 2] {
        let motion = self.motion(further);
        let mut rows = vec![vec![0.0; u.len()]; 2];
        let n = self.solver.setting.system.unknowns();
        let row = match self.tracked {
            Tracked::Mode(_) => motion.equation_row(self.q),
            Tracked::Displacement { row, .. } => {
                rows[0][cosine(1) * n + row] = self.q.recip();
                rows[1][sine(1) * n + row] = -self.q.recip();
                return [rows, vec![vec![0.0; 2]; 2]];
            }
        };
        // X = C - i S.
        for (i, of_x) in row.iter().enumerate() {
            let [c, s] = [cosine(1), sine(1)].map(|block| block * n + i);
            (rows[0][c], rows[0][s]) = (of_x.re, of_x.im);
            (rows[1][c], rows[1][s]) = (of_x.im, -of_x.re);
        }
        let mut slopes = motion.equation_slopes(&self.first_harmonic(u), self.q);
        slopes[0] *= self.linear_omega;
        let corner = [|v: &c64| v.re, |v: &c64| v.im].map(|part| slopes.iter().map(part).collect());
        [rows, corner.into()]
    }

    fn measure(&self, equations: &[f64]) -> f64 {
        let off = norm(equations);
        if off < ROUNDING {
            0.0
        } else {
            EQUATION_WEIGHT * off
        }
    }

    fn length_n(&self, change: &[f64], _: f64) -> f64 {
        let driven_n_m = match self.tracked {
            Tracked::Mode(modes) => {
                let of = self.solver.setting.system.problem.reduced.harmonic_model(1);
                let coupling = norm(of.model.coupling.col_as_slice(modes[0].0));
                coupling * self.linear_omega.powi(2)
            }
            Tracked::Displacement { inertia_n_m, .. } => *inertia_n_m,
        };
        driven_n_m * self.q * norm(change)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{OMEGA_RAD_S, sample_points_of_waves_too};
    use crate::dlft::retention::Holding;
    use crate::dlft::settings::Solver;
    use dovetail_numerics::nonlinear::NewtonOptions;

    /// Balance without contact forces and equations, at changed further unknowns and U.
    fn left_sides(family: &AmplitudeFamily<'_>, u: &[f64], further: &[f64]) -> Vec<f64> {
        let balance = family.balance(further, Mean::Free).unwrap();
        let mut left = vec![0.0; u.len()];
        balance.apply_stiffness(u, &mut left);
        left.iter_mut()
            .zip(&balance.force)
            .for_each(|(l, f)| *l -= f);
        left.extend(family.equations(u, further));
        left
    }

    #[test]
    fn slopes_and_derivatives_are_those_by_differences() {
        for (what, sample, u) in &sample_points_of_waves_too() {
            let holding = Holding::new(&sample.setting.system.problem).into();
            let newton = NewtonOptions::new(1e-9, 60);
            let (setting, solver) = (sample.setting.clone(), Solver::NewtonKrylov);
            let solver = FrequencySolver::new(setting, newton, solver, holding, &|_| ());
            let reduced = &sample.setting.system.problem.reduced;
            let tracked = reduced.harmonic_model(1).moving_together(0);
            let family = AmplitudeFamily {
                solver: &solver,
                tracked: &Tracked::Mode(tracked),
                q: 0.7,
                linear_omega: OMEGA_RAD_S,
            };
            let further = [1.1, 0.05];
            let balance = family.balance(&further, Mean::Free).unwrap();
            let slopes = family.slopes(&balance, u, &further);
            let [rows, corner] = family.derivatives(u, &further);
            let assert_close = |found: f64, by_differences: f64, size: f64| {
                let off = (found - by_differences).abs();
                assert!(off < 1e-6 * size, "{what}: {found} {by_differences}");
            };
            let step = 1e-6;
            for unknown in 0..2 {
                let [above, below] = [step, -step].map(|by| {
                    let mut moved = further;
                    moved[unknown] += by;
                    left_sides(&family, u, &moved)
                });
                let differences: Vec<f64> = above
                    .iter()
                    .zip(&below)
                    .map(|(a, b)| (a - b) / (2.0 * step))
                    .collect();
                let size = norm(&differences);
                for (found, expected) in slopes[unknown].iter().zip(&differences) {
                    assert_close(*found, *expected, size);
                }
                for equation in 0..2 {
                    assert_close(
                        corner[equation][unknown],
                        differences[u.len() + equation],
                        size,
                    );
                }
            }
            for i in 0..u.len() {
                let [above, below] = [step, -step].map(|by| {
                    let mut moved = u.to_vec();
                    moved[i] += by;
                    family.equations(&moved, &further)
                });
                for equation in 0..2 {
                    let by_differences = (above[equation] - below[equation]) / (2.0 * step);
                    assert_close(rows[equation][i], by_differences, 1.0);
                }
            }
        }
    }
}
