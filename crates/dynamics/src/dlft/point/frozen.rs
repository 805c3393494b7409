//! Solution of one frequency with frozen contacts ([`crate::dlft::frozen`]): the vibration is known, and
//! is the answer where no pair slides, opens or closes in it.
//!
//! Pairs at their limit of friction at rest cannot bear a vibration there. They shake down: each
//! slides until it touches its cone without sliding, which changes the mean and nothing else
//! (`mean_step.rs` has the steps that lead there).

use super::mean_step::mean_step;
use super::solution::MethodStart;
use super::strategy::{Method, Strategy};
use super::{FrequencySolver, Neighbour, Solution, SolverWork, resized};
use crate::dlft::PairStatus;
use crate::dlft::aft::PairEnd;
use crate::dlft::balance::{Balance, Evaluation};
use crate::dlft::dense::MOST_DENSE_UNKNOWNS;
use crate::dlft::measure::{load_scale, relative_residual};
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::vector::norm;
use std::f64::consts::TAU;

/// Most steps of the mean, and most iterations of the whole balance from there.
const MOST_ITERATIONS: usize = 10;

/// A motion has frozen contacts if its vibration differs by less than this fraction.
const SAME: f64 = 1e-3;

/// Motion in which the pairs are as they are at rest.
struct FrozenMotion {
    u: Vec<f64>,
    evaluation: Evaluation,
    /// Relative residuals at the start and after each step of the mean.
    residuals: Vec<f64>,
}

impl FrequencySolver<'_> {
    /// Motion with frozen contacts; `None` where it violates a condition of contact.
    pub(super) fn solve_frozen(
        &self,
        frequency_hz: f64,
        balance: Balance,
        method: Method,
        last: Option<&Neighbour>,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let violating = &mut work.violating_pair;
        let frozen = self.frozen_motion(frequency_hz, &balance, last, violating)?;
        self.tell_of(frequency_hz, Strategy::Frozen(method));
        let mut residuals = frozen.residuals;
        let options = NewtonOptions {
            max_iterations: MOST_ITERATIONS.min(self.newton.max_iterations),
            ..self.newton
        };
        let start = MethodStart {
            u: frozen.u,
            known: Some(frozen.evaluation),
        };
        let solved = self.iterate_from(balance, start, method, options, work);
        residuals.pop();
        work.count_iterations(residuals.len());
        if let Some(last) = work.residuals.last_mut() {
            residuals.append(last);
            *last = residuals;
        }
        Some(solved)
    }

    /// Vibration with frozen contacts about the mean that the pairs shake down to, from that of the
    /// neighbour or from the static state. `violating` is the pair that is looked at first.
    fn frozen_motion(
        &self,
        frequency_hz: f64,
        balance: &Balance,
        last: Option<&Neighbour>,
        violating: &mut Option<usize>,
    ) -> Option<FrozenMotion> {
        let setting = &self.setting;
        let n = balance.unknowns_per_block();
        let harmonics = setting.fourier.harmonics();
        if last.is_some_and(|last| !self.has_frozen_contacts(last)) {
            return None;
        }
        let vibration = setting.frozen.vibration(TAU * frequency_hz, harmonics);
        let about = |mean: &[f64]| [mean, &vibration[n..]].concat();
        let at_rest = about(&setting.x_static);
        if let Some(pair) = violating.filter(|pair| 3 * pair < n)
            && !is_as_at_rest(balance, pair, &balance.evaluate_pair(&at_rest, pair))
        {
            return None;
        }
        let of_last = last.map(|last| about(&last.u[..n]));
        let mut found = None;
        for start in of_last.into_iter().chain([at_rest]) {
            match self.shaken_down(balance, start) {
                Ok(motion) => {
                    found = Some(motion);
                    break;
                }
                Err(pair) => *violating = pair,
            }
        }
        found
    }

    /// Returns `true` if a motion has the vibration with frozen contacts. Beside another motion the one
    /// that continues it comes first: both may exist.
    fn has_frozen_contacts(&self, motion: &Neighbour) -> bool {
        let n = self.setting.system.unknowns();
        let u = resized(&motion.u, self.unknowns());
        let harmonics = self.setting.fourier.harmonics();
        let omega = TAU * motion.frequency_hz;
        let frozen = self.setting.frozen.vibration(omega, harmonics);
        let moved: Vec<f64> = u[n..]
            .iter()
            .zip(&frozen[n..])
            .map(|(u, v)| u - v)
            .collect();
        norm(&moved) <= SAME * norm(&frozen[n..])
    }

    /// Vibration of U about the mean that the pairs shake down to from there. The error is a pair that
    /// cannot bear it, `None` where no mean is found.
    fn shaken_down(
        &self,
        balance: &Balance,
        mut u: Vec<f64>,
    ) -> Result<FrozenMotion, Option<usize>> {
        let n = balance.unknowns_per_block();
        let tolerance = self.newton.tolerance;
        let scale = load_scale(balance, tolerance);
        let mut residuals = Vec::new();
        loop {
            let evaluation = balance.evaluate(&u);
            let residual = relative_residual(&evaluation.residual, n, scale);
            residuals.push(residual);
            if residual > tolerance {
                let mut ends = evaluation.ends.iter().enumerate();
                let violating = ends.position(|(pair, end)| !is_as_at_rest(balance, pair, end));
                if violating.is_some() {
                    return Err(violating);
                }
            }
            let is_settled = norm(&evaluation.residual[..n]) <= tolerance * scale[0];
            if is_settled || n > MOST_DENSE_UNKNOWNS {
                return Ok(FrozenMotion {
                    u,
                    evaluation,
                    residuals,
                });
            }
            if residuals.len() > MOST_ITERATIONS {
                return Err(None);
            }
            let step = mean_step(balance, &evaluation).ok_or(None)?;
            u.iter_mut().zip(&step).for_each(|(u, d)| *u += d);
        }
    }
}

/// Returns `true` if a pair that is open at rest stays open, and one that is closed sticks.
fn is_as_at_rest(balance: &Balance, pair: usize, end: &PairEnd) -> bool {
    match balance.setting.at_rest[pair] {
        PairStatus::Open => end.open_samples == balance.setting.fourier.samples(),
        PairStatus::Stuck | PairStatus::Slipping => balance.sticks(pair, end),
    }
}

#[cfg(test)]
mod tests;
