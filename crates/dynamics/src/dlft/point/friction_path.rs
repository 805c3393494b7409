//! Solution of one frequency along coefficients of friction that grow; each solution is a start of
//! the next.

use super::{FrequencySolver, GrowingFriction, Solution, SolverWork};
use crate::dlft::retention::Mean;

/// Newton iterations allowed at each coefficient of friction on the way to a higher one. Where they
/// are not enough, the coefficient grows by the root of the factor before, down to the least one.
const FRICTION_ITERATIONS: usize = 30;
const LEAST_GROWTH: f64 = 1.2;

impl FrequencySolver<'_> {
    /// Follows growing coefficients of friction, which grow by less where no solution is found. `None`
    /// where that does not help, or no coefficient is above the first.
    pub(super) fn grow_friction(
        &self,
        friction: GrowingFriction,
        frequency_hz: f64,
        mean: Mean,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let GrowingFriction { from, mut growth } = friction;
        let pairs = self.setting.system.problem.laws.iter();
        let highest = pairs.fold(0.0_f64, |m, p| m.max(p.computed_friction()));
        if highest <= from {
            return None;
        }
        let mut newton = self.newton;
        newton.max_iterations = newton.max_iterations.min(FRICTION_ITERATIONS);
        let (mut earlier, mut last) = (None::<(f64, Vec<f64>)>, None::<(f64, Vec<f64>)>);
        loop {
            if self.budget_exhausted(work) {
                return None;
            }
            let (most, start) = match &last {
                None => (from, self.static_start()),
                Some((last, u)) => {
                    let most = (last * growth).min(highest);
                    let along =
                        |before: f64| (1.0 / most - 1.0 / last) / (1.0 / last - 1.0 / before);
                    let start = earlier.as_ref().map(|(before, v)| {
                        let t = along(*before);
                        u.iter().zip(v).map(|(u, v)| u + t * (u - v)).collect()
                    });
                    (most, start.unwrap_or_else(|| u.clone()))
                }
            };
            let mut balance = self.balance(frequency_hz, mean)?;
            balance.most_friction = most;
            let solved = self.iterate(balance, start, self.stepping(), newton, work);
            if !solved.is_converged() {
                growth = growth.sqrt();
                if last.is_none() || growth < LEAST_GROWTH {
                    return None;
                }
            } else if most >= highest {
                return Some(solved);
            } else {
                earlier = last.replace((most, solved.u));
            }
        }
    }
}
