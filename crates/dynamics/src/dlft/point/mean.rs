//! Decision between a free and a retained mean ([`crate::dlft::retention`]) for the motion of a
//! frequency, and the way from one to the other.

use super::{FrequencySolver, Solution, SolverWork};
use crate::dlft::balance::Balance;
use crate::dlft::pair_signals::Periods;
use crate::dlft::retention::{Mean, Retention, may_have_walked_off};
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::vector::norm;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Fractions of the retention's stiffness on the way from a retained motion to the free one.
const RELEASE: [f64; 4] = [0.1, 0.01, 1e-3, 1e-4];
/// Relative residual of the motions at those fractions, which are starts alone.
const RELEASE_TOLERANCE: f64 = 1e-5;
/// Newton iterations allowed at each fraction; a step that needs more leads nowhere.
const RELEASE_ITERATIONS: usize = 15;

/// A solution with the mean that it is to have.
pub(super) enum SettledMean {
    /// The motion.
    Answer(Solution),
    /// Friction holds the bodies, but far from where they are at rest.
    Far(Solution),
    /// The mean has walked off, and friction does not hold it.
    Walks(Solution),
}

impl FrequencySolver<'_> {
    /// Decides between the free and the retained balance for a solution of either.
    pub(super) fn decide_mean(
        &self,
        frequency_hz: f64,
        solved: Solution,
        work: &mut SolverWork,
    ) -> SettledMean {
        if solved.balance.mean() == Mean::Retained {
            let released = (!self.must_be_retained())
                .then(|| self.release_mean(frequency_hz, &solved, work))
                .flatten();
            return SettledMean::Answer(released.unwrap_or(solved));
        }
        let is_held = self.is_blocked_by_friction(&solved);
        match (self.walked_off(&solved.u), is_held) {
            (false, true) => SettledMean::Answer(solved),
            (false, false) => {
                let retained = self.retain_mean(frequency_hz, &solved, work);
                SettledMean::Answer(retained.unwrap_or(solved))
            }
            // Friction holds bodies anywhere along a slot: one nearer to where they are at rest
            // comes first.
            (true, true) => SettledMean::Far(solved),
            (true, false) => SettledMean::Walks(solved),
        }
    }

    /// Solution of a step along a curve with the mean that holds there; `None` where it has walked
    /// off.
    pub(crate) fn curve_solution(
        &self,
        frequency_hz: f64,
        solved: Solution,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        match self.decide_mean(frequency_hz, solved, work) {
            SettledMean::Answer(solved) => Some(solved),
            SettledMean::Far(_) | SettledMean::Walks(_) => None,
        }
    }

    /// Free motion beside a retained one in which the pairs that stick hold the bodies; `None` where
    /// none is found. It is not looked for where they do not even hold them beside the spring: they
    /// would have to carry its force as well. The spring is removed at once. If that fails, it is
    /// softened in steps as long as the pairs hold the bodies.
    fn release_mean(
        &self,
        frequency_hz: f64,
        retained: &Solution,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        if !self.is_blocked_by_friction(retained) {
            return None;
        }
        let mut u = retained.u.clone();
        let first_step = NewtonOptions {
            max_iterations: 1,
            ..self.newton
        };
        for options in [first_step, self.newton] {
            let balance = self.balance(frequency_hz, Mean::Free)?;
            let free = self.iterate(balance, u, self.stepping(), options, work);
            if self.walked_off(&free.u) {
                break;
            }
            if free.is_converged() {
                return self.is_blocked_by_friction(&free).then_some(free);
            }
            u = free.u;
        }
        let mut u = retained.u.clone();
        let max_iterations = RELEASE_ITERATIONS.min(self.newton.max_iterations);
        for fraction in RELEASE.into_iter().chain([0.0]) {
            let mut balance = Balance::new(&self.setting, TAU * frequency_hz);
            let mut options = NewtonOptions {
                max_iterations,
                ..self.newton
            };
            if fraction > 0.0 {
                balance = balance.retained_by(self.retention()?.softened(fraction).into());
                options.tolerance = options.tolerance.max(RELEASE_TOLERANCE);
            }
            let solved = self.iterate(balance, u, self.stepping(), options, work);
            if !solved.is_converged() || !self.is_blocked_by_friction(&solved) {
                return None;
            }
            if fraction == 0.0 {
                return Some(solved);
            }
            u = solved.u;
        }
        None
    }

    /// Retained motion beside a free one that friction does not hold; `None` where none is found.
    fn retain_mean(
        &self,
        frequency_hz: f64,
        free: &Solution,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let balance = self.balance(frequency_hz, Mean::Retained)?;
        let u = free.u.clone();
        let retained = self.iterate(balance, u, self.stepping(), self.newton, work);
        if !retained.is_converged() {
            return None;
        }
        Some(
            self.release_mean(frequency_hz, &retained, work)
                .unwrap_or(retained),
        )
    }

    /// Returns `true` if the pairs that stick throughout hold the motions that nothing else holds.
    pub(crate) fn is_blocked_by_friction(&self, solved: &Solution) -> bool {
        let Some(retention) = self.retention() else {
            return true;
        };
        let ends = &solved.evaluation.ends;
        let stuck = (0..ends.len()).filter(|pair| solved.balance.sticks(*pair, &ends[*pair]));
        retention.is_blocked_by(stuck)
    }

    /// Returns `true` if friction does not even hold the static state.
    pub(crate) fn must_be_retained(&self) -> bool {
        self.setting.static_mean == Mean::Retained && self.retention().is_some()
    }

    /// Motions that only friction holds. `None` where there are none, or where fixed periods are
    /// asked for, which is how programs without a retention evaluate the law.
    pub(crate) fn retention(&self) -> Option<&Arc<Retention>> {
        if self.setting.periods != Periods::UntilPeriodic {
            return None;
        }
        self.holding.retention()
    }

    /// Returns `true` if the mean of U has walked off the static state along a motion that only
    /// friction holds.
    pub(crate) fn walked_off(&self, u: &[f64]) -> bool {
        let (mean, rest) = u.split_at(self.setting.system.unknowns());
        let (anchor, vibration) = (&self.setting.x_static, norm(rest));
        may_have_walked_off(mean, anchor, vibration)
            && self
                .retention()
                .is_some_and(|r| r.walked_off(mean, anchor, vibration))
    }
}
