//! Newton's method, damped by natural monotonicity (Deuflhard, Newton Methods for Nonlinear
//! Problems, 2011, NLEQ-ERR). A step is judged by the simplified correction under the old Jacobian,
//! which does not depend on how the equations are scaled. A step that clearly decreases the
//! residual is accepted without that second solve.
//!
//! Systems that solve for their corrections by iteration are told how closely. Far from the solution
//! a rough correction suffices; near it, one that just reaches the tolerance. Their Jacobian serves
//! for a second step where the first one left hardly more than its linear solve did.

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

/// Relative residuals to which corrections are solved for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearTolerances {
    /// That of the first correction, and of those behind a step that left little.
    pub usual: f64,
    /// That of a correction behind a step that left much, and of one that is only measured.
    pub loosest: f64,
}

/// A correction that can end the iteration aims at this fraction of the tolerance.
const AIM: f64 = 0.2;
/// Such a correction may be solved for to this fraction of the usual tolerance.
const TIGHTENED: f64 = 0.05;
/// The Jacobian serves again where a full step leaves no more than this fraction of the residual
/// beyond what its linear solve left: so much has the Jacobian changed.
const CHANGED: f64 = 0.03;

impl LinearTolerances {
    /// Tolerance of the correction behind these measures of the residual, the last of which is above
    /// `end`, the tolerance of the iteration.
    ///
    /// S. C. Eisenstat and H. F. Walker, Choosing the forcing terms in an inexact Newton method,
    /// SIAM J. Sci. Comput. 17, 1996, choice 2 with the square of the last two measures' ratio.
    fn next(self, measures: &[f64], end: f64) -> f64 {
        let [before @ .., measure] = measures else {
            return self.usual;
        };
        let last = AIM * end / measure;
        if last > TIGHTENED * self.usual {
            return last.min(self.loosest);
        }
        let left = before.last().map_or(0.0, |before| measure / before);
        (left * left).max(self.usual).min(self.loosest)
    }
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
    /// Relative residuals to which corrections are solved for; `None` where they are exact, or as
    /// good as exact.
    fn linear_tolerances(&self) -> Option<LinearTolerances> {
        None
    }
    /// Solves J dx = -f with the prepared Jacobian, to the relative residual `tolerance` where
    /// corrections are not exact. Returns the relative residual of the solution, `None` where there
    /// is no usable answer.
    fn correction(&mut self, f: &[f64], tolerance: f64, dx: &mut [f64]) -> Option<f64>;
    /// Length of a step, in the units in which steps are compared.
    fn length(&self, dx: &[f64]) -> f64;
    /// Smallest damping factor that is tried.
    fn smallest_step(&self) -> f64 {
        SMALLEST_STEP
    }
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
#[derive(Debug, Clone, Copy, serde::Serialize)]
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
/// Smallest damping factor tried, unless a system has its own.
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
    let usual = system.linear_tolerances().map_or(0.0, |t| t.usual);
    system.correction(&f, usual, &mut dx)?;
    Some(dx)
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
    let tolerances = system.linear_tolerances();
    let smallest_step = system.smallest_step();
    let mut serves_again = false;
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
        if !serves_again {
            system.linearise(x);
        }
        let solve_to = tolerances.map_or(0.0, |t| t.next(&residuals, options.tolerance));
        let Some(unsolved) = system.correction(&f, solve_to, &mut dx) else {
            break NewtonStatus::Stagnated;
        };
        let roughly = tolerances.map_or(0.0, |t| t.loosest);
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
            let is_shortest = step <= smallest_step;
            let accepted = match S::DAMPING {
                Damping::Natural => {
                    new <= (1.0 - 0.5 * step) * measure
                        || new.is_finite()
                            && (system.correction(&f_trial, roughly, &mut simplified)).is_some()
                            && system.length(&simplified) <= (1.0 - 0.25 * step) * length
                }
                Damping::Persistent => new < measure || is_shortest && new.is_finite(),
            };
            if accepted || is_shortest {
                serves_again =
                    tolerances.is_some() && step == 1.0 && new <= (unsolved + CHANGED) * measure;
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
        fn correction(&mut self, f: &[f64], _: f64, dx: &mut [f64]) -> Option<f64> {
            let [[a, b], [c, d]] = self.jacobian;
            let det = a * d - b * c;
            dx[0] = -(d * f[0] - b * f[1]) / det;
            dx[1] = -(a * f[1] - c * f[0]) / det;
            (det != 0.0).then_some(0.0)
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
        fn correction(&mut self, f: &[f64], _: f64, dx: &mut [f64]) -> Option<f64> {
            dx[0] = if self.linearisations == 1 {
                f[0]
            } else {
                -f[0]
            };
            Some(0.0)
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

    /// The system f = x, whose corrections all point the wrong way.
    struct Uphill {
        smallest_step: f64,
        evaluations: usize,
    }

    impl NonlinearSystem for Uphill {
        fn residual(&mut self, x: &[f64], f: &mut [f64]) {
            self.evaluations += 1;
            f[0] = x[0];
        }
        fn measure(&self, f: &[f64]) -> f64 {
            f[0].abs()
        }
        fn linearise(&mut self, _: &[f64]) {}
        fn correction(&mut self, f: &[f64], _: f64, dx: &mut [f64]) -> Option<f64> {
            dx[0] = f[0];
            Some(0.0)
        }
        fn length(&self, dx: &[f64]) -> f64 {
            dx[0].abs()
        }
        fn smallest_step(&self) -> f64 {
            self.smallest_step
        }
    }

    #[test]
    fn no_step_is_tried_that_is_shorter_than_the_smallest() {
        for (smallest_step, trials) in [(1.0, 1), (0.25, 3), (1.0 / 64.0, 7)] {
            let evaluations = 0;
            let mut system = Uphill {
                smallest_step,
                evaluations,
            };
            let end = newton(&mut system, &mut [1.0], NewtonOptions::new(1e-10, 5));
            assert_eq!((end.status, end.measure), (NewtonStatus::Stagnated, 1.0));
            assert_eq!(system.evaluations, 1 + trials);
        }
    }

    /// The equation x + curvature x^2 = 0, whose corrections are as rough as allowed.
    struct Rough {
        curvature: f64,
        slope: f64,
        linearisations: usize,
        solved_to: Vec<f64>,
    }

    impl NonlinearSystem for Rough {
        fn residual(&mut self, x: &[f64], f: &mut [f64]) {
            f[0] = x[0] + self.curvature * x[0] * x[0];
        }
        fn measure(&self, f: &[f64]) -> f64 {
            f[0].abs()
        }
        fn linearise(&mut self, x: &[f64]) {
            self.linearisations += 1;
            self.slope = 1.0 + 2.0 * self.curvature * x[0];
        }
        fn linear_tolerances(&self) -> Option<LinearTolerances> {
            let (usual, loosest) = (1e-2, 0.1);
            Some(LinearTolerances { usual, loosest })
        }
        fn correction(&mut self, f: &[f64], tolerance: f64, dx: &mut [f64]) -> Option<f64> {
            self.solved_to.push(tolerance);
            dx[0] = -f[0] / self.slope * (1.0 - tolerance);
            Some(tolerance)
        }
        fn length(&self, dx: &[f64]) -> f64 {
            dx[0].abs()
        }
    }

    #[test]
    fn rough_corrections_are_solved_for_as_closely_as_they_help() {
        let solved = |curvature: f64| {
            let (slope, linearisations, solved_to) = (1.0, 0, vec![]);
            let mut system = Rough {
                curvature,
                slope,
                linearisations,
                solved_to,
            };
            let end = newton(&mut system, &mut [1.0], NewtonOptions::new(1e-8, 50));
            assert_eq!(end.status, NewtonStatus::Converged, "{end:?}");
            (system, end)
        };
        // Almost linear: 1e-2 again and again, with one Jacobian, until 2e-9 is near.
        let (linear, end) = solved(1e-3);
        assert_eq!(linear.solved_to[..2], [1e-2; 2]);
        assert_eq!((linear.linearisations, end.iterations), (1, 4), "{end:?}");
        let last = AIM * 1e-8 / end.residuals[3];
        assert_eq!(linear.solved_to[3], last.min(0.1));
        assert!(end.measure > 1e-9, "{end:?}");
        // Far from linear: as roughly as allowed, and with a new Jacobian, as long as much is left.
        let (curved, end) = solved(30.0);
        let much = end.residuals.windows(2).filter(|r| r[1] > 0.2 * r[0]);
        let much = much.count();
        assert!(much > 3, "{end:?}");
        let ratio = end.residuals[1] / end.residuals[0];
        assert_eq!(curved.solved_to[1], (ratio * ratio).min(0.1));
        assert!(curved.linearisations > much, "{end:?}");
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
