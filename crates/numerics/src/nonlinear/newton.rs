//! Newton's method, damped by natural monotonicity (Deuflhard, Newton Methods for Nonlinear
//! Problems, 2011, NLEQ-ERR). A step is judged by the simplified correction under the old Jacobian,
//! which does not depend on how the equations are scaled. A step that clearly decreases the
//! residual is accepted without that second solve.

/// Shortening of a step that does not help, and the reaction where no length of it helps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Damping {
    /// Natural monotonicity; the iteration ends as stagnated where no step is accepted.
    Natural,
    /// A step is halved until the residual decreases, and accepted after `MOST_HALVINGS` in any
    /// case, for systems whose corrections are exact and cheap. Where many kinks are close together
    /// (rigid friction in many harmonics), no monotone path may lead to the solution. The iteration
    /// ends with the best point that it reached.
    Persistent,
}

/// System f(x) = 0 that can linearise itself.
pub trait NonlinearSystem {
    /// Damping of the steps.
    const DAMPING: Damping = Damping::Natural;

    /// Writes f(x).
    fn residual(&mut self, x: &[f64], f: &mut [f64]);
    /// Relative size of a residual; convergence is `measure(f) <= tolerance`.
    fn measure(&self, f: &[f64]) -> f64;
    /// Prepares the Jacobian at the x of the last accepted residual.
    fn linearise(&mut self, x: &[f64]);
    /// Solves J dx = -f with the prepared Jacobian. Returns `false` where there is no usable
    /// answer.
    fn correction(&mut self, f: &[f64], dx: &mut [f64]) -> bool;
    /// Like `correction`, for a correction that is only measured, not applied: it may be rough.
    fn simplified(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
        self.correction(f, dx)
    }
    /// Length of a step, in the units in which steps are compared.
    fn length(&self, dx: &[f64]) -> f64;
    /// Returns `true` if an accepted x is so far off that no solution is wanted there. The
    /// iteration then ends as stagnated.
    fn has_diverged(&self, _x: &[f64]) -> bool {
        false
    }
    /// Returns `true` if the time limit has passed.
    fn is_late(&self) -> bool {
        false
    }
}

/// Criteria that end an iteration.
#[derive(Debug, Clone, Copy)]
pub struct NewtonOptions {
    /// Measure of the residual below which the iteration has converged.
    pub tolerance: f64,
    /// Largest number of iterations.
    pub max_iterations: usize,
}

impl NewtonOptions {
    /// Criteria of so small a measure and so many iterations.
    pub const fn new(tolerance: f64, max_iterations: usize) -> Self {
        Self {
            tolerance,
            max_iterations,
        }
    }
}

/// Reason why an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NewtonStatus {
    /// The measure fell below the tolerance.
    Converged,
    /// No step, however small, made progress.
    Stagnated,
    /// The allowed iterations were used up.
    IterationLimit,
    /// A number that is not finite occurred.
    NotFinite,
    /// The time limit has passed.
    TimeLimit,
}

/// End of an iteration.
#[derive(Debug, Clone, PartialEq)]
pub struct NewtonEnd {
    /// Reason why it ended.
    pub status: NewtonStatus,
    /// Number of iterations.
    pub iterations: usize,
    /// Measure of the residual at the end.
    pub measure: f64,
    /// Measure of the residual at the start, and after each iteration.
    pub residuals: Vec<f64>,
}

/// Most halvings of a step.
const MOST_HALVINGS: i32 = 10;
/// Smallest damping factor tried.
const SMALLEST_STEP: f64 = 1.0 / (1 << MOST_HALVINGS) as f64;

/// Full correction at `x`, which is not applied: zero where the measure is within `tolerance`,
/// `None` where there is no usable answer.
pub fn correction<S: NonlinearSystem>(
    system: &mut S,
    x: &[f64],
    tolerance: f64,
) -> Option<Vec<f64>> {
    let (mut f, mut dx) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    system.residual(x, &mut f);
    if system.measure(&f) <= tolerance {
        return Some(dx);
    }
    system.linearise(x);
    system.correction(&f, &mut dx).then_some(dx)
}

/// Iterates from `x`, which ends as the best point reached.
pub fn newton<S: NonlinearSystem>(
    system: &mut S,
    x: &mut [f64],
    options: NewtonOptions,
) -> NewtonEnd {
    let n = x.len();
    let (mut f, mut trial, mut f_trial) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let (mut dx, mut simplified) = (vec![0.0; n], vec![0.0; n]);
    system.residual(x, &mut f);
    let mut measure = system.measure(&f);
    let mut residuals = vec![measure];
    let mut best = (measure, x.to_vec());
    let mut step: f64 = 1.0;
    let mut iterations = 0;
    let status = loop {
        if !measure.is_finite() {
            break NewtonStatus::NotFinite;
        }
        if measure <= options.tolerance {
            break NewtonStatus::Converged;
        }
        if iterations == options.max_iterations {
            break NewtonStatus::IterationLimit;
        }
        if system.is_late() {
            break NewtonStatus::TimeLimit;
        }
        system.linearise(x);
        if !system.correction(&f, &mut dx) {
            break NewtonStatus::Stagnated;
        }
        let length = system.length(&dx);
        step = match S::DAMPING {
            Damping::Natural => (4.0 * step).min(1.0),
            Damping::Persistent => 1.0,
        };
        let accepted = loop {
            for ((t, x), d) in trial.iter_mut().zip(x.iter()).zip(&dx) {
                *t = x + step * d;
            }
            system.residual(&trial, &mut f_trial);
            let new = system.measure(&f_trial);
            let is_shortest = step <= SMALLEST_STEP;
            let accepted = match S::DAMPING {
                Damping::Natural => {
                    new <= (1.0 - 0.5 * step) * measure
                        || new.is_finite()
                            && system.simplified(&f_trial, &mut simplified)
                            && system.length(&simplified) <= (1.0 - 0.25 * step) * length
                }
                Damping::Persistent => new < measure || is_shortest && new.is_finite(),
            };
            if accepted || is_shortest {
                measure = if accepted { new } else { measure };
                break accepted;
            }
            step *= 0.5;
        };
        if !accepted {
            break NewtonStatus::Stagnated;
        }
        iterations += 1;
        residuals.push(measure);
        x.copy_from_slice(&trial);
        std::mem::swap(&mut f, &mut f_trial);
        if S::DAMPING == Damping::Natural || measure < best.0 {
            best.0 = measure;
            best.1.copy_from_slice(x);
        }
        if system.has_diverged(x) {
            break NewtonStatus::Stagnated;
        }
    };
    if best.0 < measure {
        (measure, _) = (best.0, x.copy_from_slice(&best.1));
    }
    NewtonEnd {
        status,
        iterations,
        measure,
        residuals,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The system f = (a (x0^2 - x1 + 1), b (x0 - cos(pi x1 / 2))): Deuflhard's 2-D example, badly
    /// scaled.
    struct Scaled {
        jacobian: [[f64; 2]; 2],
        scale: f64,
    }

    impl NonlinearSystem for Scaled {
        fn residual(&mut self, x: &[f64], f: &mut [f64]) {
            f[0] = self.scale * (x[0] * x[0] - x[1] + 1.0);
            f[1] = x[0] - (std::f64::consts::FRAC_PI_2 * x[1]).cos();
        }
        fn measure(&self, f: &[f64]) -> f64 {
            f[0].hypot(f[1])
        }
        fn linearise(&mut self, x: &[f64]) {
            let half_pi = std::f64::consts::FRAC_PI_2;
            self.jacobian = [
                [2.0 * x[0] * self.scale, -self.scale],
                [1.0, half_pi * (half_pi * x[1]).sin()],
            ];
        }
        fn correction(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
            let [[a, b], [c, d]] = self.jacobian;
            let det = a * d - b * c;
            dx[0] = -(d * f[0] - b * f[1]) / det;
            dx[1] = -(a * f[1] - c * f[0]) / det;
            det != 0.0
        }
        fn length(&self, dx: &[f64]) -> f64 {
            dx[0].hypot(dx[1])
        }
    }

    #[test]
    fn converges_whatever_the_scaling_of_the_equations() {
        for scale in [1.0, 1e-6, 1e6] {
            let mut system = Scaled {
                jacobian: [[0.0; 2]; 2],
                scale,
            };
            let mut x = [-0.9, 1.9];
            let end = newton(&mut system, &mut x, NewtonOptions::new(1e-10, 50));
            assert_eq!(end.status, NewtonStatus::Converged, "{scale}: {end:?}");
            assert!((x[0] * x[0] - x[1] + 1.0).abs() < 1e-4);
        }
    }

    /// The system f = x, whose first correction points the wrong way.
    struct Misled {
        linearisations: usize,
    }

    impl NonlinearSystem for Misled {
        const DAMPING: Damping = Damping::Persistent;
        fn residual(&mut self, x: &[f64], f: &mut [f64]) {
            f[0] = x[0];
        }
        fn measure(&self, f: &[f64]) -> f64 {
            f[0].abs()
        }
        fn linearise(&mut self, _: &[f64]) {
            self.linearisations += 1;
        }
        fn correction(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
            dx[0] = if self.linearisations == 1 {
                f[0]
            } else {
                -f[0]
            };
            true
        }
        fn length(&self, dx: &[f64]) -> f64 {
            dx[0].abs()
        }
    }

    #[test]
    fn a_persistent_iteration_goes_on_where_no_step_helps_and_ends_with_its_best_point() {
        for (max_iterations, status, measure) in [
            (1, NewtonStatus::IterationLimit, 1.0),
            (2, NewtonStatus::Converged, 0.0),
        ] {
            let mut x = [1.0];
            let options = NewtonOptions::new(1e-10, max_iterations);
            let end = newton(&mut Misled { linearisations: 0 }, &mut x, options);
            assert_eq!((end.status, end.measure, x[0]), (status, measure, measure));
            // The shortest step the wrong way is accepted nevertheless.
            let way = [1.0, 1.0 + SMALLEST_STEP, 0.0];
            assert_eq!(end.residuals[..], way[..=max_iterations]);
        }
    }

    #[test]
    fn says_when_the_iterations_are_used_up() {
        let mut system = Scaled {
            jacobian: [[0.0; 2]; 2],
            scale: 1.0,
        };
        let end = newton(&mut system, &mut [-0.9, 1.9], NewtonOptions::new(1e-10, 1));
        assert_eq!(
            (end.status, end.iterations),
            (NewtonStatus::IterationLimit, 1)
        );
    }
}
