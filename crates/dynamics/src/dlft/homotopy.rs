//! Steps of a parameter, from a problem whose solution is known to the one that is asked for. Each
//! solution is the start of the next.

/// Newton iterations of all steps of a way. Those that lead to no motion end only here.
pub(crate) const MOST_WAY_ITERATIONS: usize = 200;

/// First coefficient of friction of a way to a higher one, and the largest and the least factor from one
/// to the next. Where shear carries much of the load, pairs open at once under the full coefficient.
const FIRST_FRICTION: f64 = 0.5;
const FRICTION_FACTORS: [f64; 2] = [4.0, 1.2];

/// Steps of the logarithm of a coefficient of friction, from [`FIRST_FRICTION`], which is solved as well,
/// up to the highest of all pairs; `None` where that is not above the first.
pub(crate) fn friction_steps(highest: f64) -> Option<Homotopy> {
    let [largest, least] = FRICTION_FACTORS.map(f64::ln);
    let steps = Homotopy::new(FIRST_FRICTION.ln() - largest, highest.ln(), largest, least);
    (highest > FIRST_FRICTION).then_some(steps)
}

/// Upper limit of the coefficients of friction at a step; none at the last one.
pub(crate) fn most_friction(step: f64, highest: f64) -> f64 {
    if step < highest.ln() {
        step.exp()
    } else {
        f64::INFINITY
    }
}

/// Adaptive steps of a parameter. A step that leads to no solution is halved.
#[derive(Debug)]
pub(crate) struct Homotopy {
    reached: f64,
    end: f64,
    step: f64,
    largest: f64,
    least: f64,
}

impl Homotopy {
    /// Way from `start`, where the solution is known, up to `end`, with steps between the least and
    /// the largest one, which is tried first.
    pub(crate) fn new(start: f64, end: f64, largest: f64, least: f64) -> Self {
        Self {
            reached: start,
            end,
            step: largest,
            largest,
            least,
        }
    }

    /// Value to be solved for next; `None` at the end, and where the step would be too small.
    pub(crate) fn next(&self) -> Option<f64> {
        let goes_on = self.reached < self.end && self.step >= self.least;
        goes_on.then(|| (self.reached + self.step).min(self.end))
    }

    /// Takes note whether [`Homotopy::next`] has led to a solution.
    pub(crate) fn record(&mut self, is_solved: bool) {
        if is_solved {
            self.reached = self.next().unwrap_or(self.end);
            self.step = (2.0 * self.step).min(self.largest);
        } else {
            self.step *= 0.5;
        }
    }

    /// Returns `true` if the end has a solution.
    pub(crate) fn has_arrived(&self) -> bool {
        self.reached >= self.end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values tried, where those above `barrier` are only reached by steps of at most `passing`.
    fn tried(barrier: f64, passing: f64) -> (Vec<f64>, Homotopy) {
        let mut steps = Homotopy::new(0.0, 1.0, 0.5, 0.1);
        let mut tried = vec![];
        while let Some(next) = steps.next() {
            tried.push(next);
            let is_far = next - steps.reached > passing + 1e-12;
            steps.record(!(next > barrier && is_far));
        }
        (tried, steps)
    }

    #[test]
    fn a_step_that_fails_is_halved_and_one_that_does_not_is_doubled() {
        let (values, steps) = tried(2.0, 0.0);
        assert_eq!((values, steps.has_arrived()), (vec![0.5, 1.0], true));
        let (values, steps) = tried(0.6, 0.25);
        assert_eq!(values, [0.5, 1.0, 0.75, 1.0]);
        assert!(steps.has_arrived());
        let (values, steps) = tried(0.6, 0.0);
        assert_eq!(values, [0.5, 1.0, 0.75, 0.625]);
        assert_eq!((steps.reached, steps.has_arrived()), (0.5, false));
    }
}
