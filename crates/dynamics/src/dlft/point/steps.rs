//! Solution of one frequency in steps: of the frequency from the neighbour, of the force or of the
//! coefficient of friction from the static state. Each solution is a start of the next.

use super::{FrequencySolver, Neighbour, Solution, SolverWork, resized};
use crate::dlft::balance::Balance;
use crate::dlft::homotopy::{Homotopy, MOST_WAY_ITERATIONS, friction_steps, most_friction};
use crate::dlft::retention::Mean;
use dovetail_numerics::nonlinear::NewtonOptions;

/// Newton iterations allowed at each step. Where they are not enough, the step is halved.
const STEP_ITERATIONS: usize = 30;
/// Largest and least step in frequency, as a part of the distance to the neighbour. The whole is tried
/// before.
const FREQUENCY_STEPS: [f64; 2] = [1.0 / 2.0, 1.0 / 16.0];
/// Largest and least step of the force, as a part of it.
const FORCE_STEPS: [f64; 2] = [1.0 / 4.0, 1.0 / 32.0];
impl FrequencySolver<'_> {
    /// Steps in frequency from the neighbour; `None` where they do not lead to a motion.
    pub(super) fn step_in_frequency(
        &self,
        frequency_hz: f64,
        mean: Mean,
        last: &Neighbour,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let from_hz = last.frequency_hz;
        let at = |part: f64| self.balance(from_hz + (frequency_hz - from_hz) * part, mean);
        let [largest, least] = FREQUENCY_STEPS;
        let steps = Homotopy::new(0.0, 1.0, largest, least);
        let start = resized(&last.u, self.unknowns());
        self.step_along(steps, &at, |_, before| last_of(before, &start), work)
    }

    /// Steps of the vibrating part of the load from the static state.
    pub(super) fn step_in_force(
        &self,
        frequency_hz: f64,
        mean: Mean,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let at = |part: f64| {
            let mut balance = self.balance(frequency_hz, mean)?;
            let n = balance.unknowns_per_block();
            balance.force[n..].iter_mut().for_each(|f| *f *= part);
            Some(balance)
        };
        let [largest, least] = FORCE_STEPS;
        let steps = Homotopy::new(0.0, 1.0, largest, least);
        let start = self.static_start();
        self.step_along(steps, &at, |_, before| last_of(before, &start), work)
    }

    /// Growing coefficients of friction from the static state; `None` as well where none is above the
    /// first.
    pub(super) fn step_in_friction(
        &self,
        frequency_hz: f64,
        mean: Mean,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let highest = self.highest_friction();
        let steps = friction_steps(highest)?;
        let at = |log: f64| {
            let mut balance = self.balance(frequency_hz, mean)?;
            balance.most_friction = most_friction(log, highest);
            Some(balance)
        };
        let start = self.static_start();
        let extrapolated = |log: f64, before: &[(f64, Vec<f64>)]| {
            let [.., (earlier, v), (last, u)] = before else {
                return last_of(before, &start);
            };
            let inverse = |log: f64| (-log).exp();
            let t = (inverse(log) - inverse(*last)) / (inverse(*last) - inverse(*earlier));
            u.iter().zip(v).map(|(u, v)| u + t * (u - v)).collect()
        };
        self.step_along(steps, &at, extrapolated, work)
    }

    /// Largest coefficient of friction of a pair.
    pub(super) fn highest_friction(&self) -> f64 {
        let pairs = self.setting.system.problem.laws.iter();
        pairs.fold(0.0_f64, |m, p| m.max(p.computed_friction()))
    }

    /// Solves `at` each step, from `start` of the value and the solutions before it. `None` where the
    /// end is not reached, or the budget is used up.
    fn step_along(
        &self,
        mut steps: Homotopy,
        at: &dyn Fn(f64) -> Option<Balance>,
        start: impl Fn(f64, &[(f64, Vec<f64>)]) -> Vec<f64>,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let last_iteration = work.newton_iterations + MOST_WAY_ITERATIONS;
        let step_options = NewtonOptions {
            max_iterations: STEP_ITERATIONS.min(self.newton.max_iterations),
            ..self.newton
        };
        let mut before = vec![];
        while let Some(next) = steps.next() {
            if self.budget_exhausted(work) || work.newton_iterations >= last_iteration {
                return None;
            }
            let u = start(next, &before);
            let solved = self.iterate(at(next)?, u, self.stepping(), step_options, work);
            steps.record(solved.is_converged());
            if steps.has_arrived() {
                return Some(solved);
            }
            if solved.is_converged() {
                before.push((next, solved.u));
            }
        }
        None
    }
}

fn last_of(before: &[(f64, Vec<f64>)], start: &[f64]) -> Vec<f64> {
    before.last().map_or(start, |(_, u)| u).to_vec()
}
