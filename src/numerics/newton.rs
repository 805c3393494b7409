//! Newton's method, damped by natural monotonicity (Deuflhard, Newton Methods for Nonlinear Problems,
//! 2011, NLEQ-ERR): a step is judged by the simplified correction under the old Jacobian, which does
//! not depend on how the equations are scaled. A step that plainly decreases the residual is taken
//! without paying for that second solve.

/// A system f(x) = 0 that can linearise itself.
pub trait NonlinearSystem {
    /// Writes f(x).
    fn residual(&mut self, x: &[f64], f: &mut [f64]);
    /// Relative size of a residual; convergence is `measure(f) <= tolerance`.
    fn measure(&self, f: &[f64]) -> f64;
    /// Prepares the Jacobian at the x of the last accepted residual.
    fn linearise(&mut self, x: &[f64]);
    /// Solves J dx = -f with the prepared Jacobian; false when there is no usable answer.
    fn correction(&mut self, f: &[f64], dx: &mut [f64]) -> bool;
    /// The same for a residual whose correction is only measured, not taken: it may be rough.
    fn simplified(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
        self.correction(f, dx)
    }
    /// Length of a step, in the units in which steps are compared.
    fn length(&self, dx: &[f64]) -> f64;
    /// Whether an accepted x is a place no solution is wanted at: the iteration then ends as stagnated.
    fn is_astray(&self, _x: &[f64]) -> bool {
        false
    }
}

#[derive(Debug, Clone, Copy)]
pub struct NewtonOptions {
    pub tolerance: f64,
    pub max_iterations: usize,
}

/// Why an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NewtonStatus {
    Converged,
    Stagnated,
    IterationLimit,
    NotFinite,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonEnd {
    pub status: NewtonStatus,
    pub iterations: usize,
    pub measure: f64,
}

/// Smallest damping factor tried.
const SMALLEST_STEP: f64 = 1.0 / 1024.0;

/// Iterates from `x`, which ends as the best point reached.
pub fn newton(
    system: &mut impl NonlinearSystem,
    x: &mut [f64],
    options: NewtonOptions,
) -> NewtonEnd {
    let n = x.len();
    let (mut f, mut trial, mut f_trial) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let (mut dx, mut simplified) = (vec![0.0; n], vec![0.0; n]);
    system.residual(x, &mut f);
    let mut measure = system.measure(&f);
    let mut step: f64 = 1.0;
    for iterations in 0..=options.max_iterations {
        let end = |status| NewtonEnd {
            status,
            iterations,
            measure,
        };
        if !measure.is_finite() {
            return end(NewtonStatus::NotFinite);
        }
        if measure <= options.tolerance {
            return end(NewtonStatus::Converged);
        }
        if iterations == options.max_iterations {
            break;
        }
        system.linearise(x);
        if !system.correction(&f, &mut dx) {
            return end(NewtonStatus::Stagnated);
        }
        let length = system.length(&dx);
        step = (4.0 * step).min(1.0);
        loop {
            for ((t, x), d) in trial.iter_mut().zip(x.iter()).zip(&dx) {
                *t = x + step * d;
            }
            system.residual(&trial, &mut f_trial);
            let new = system.measure(&f_trial);
            let mut accepted = new <= (1.0 - 0.5 * step) * measure;
            if !accepted && new.is_finite() && system.simplified(&f_trial, &mut simplified) {
                accepted = system.length(&simplified) <= (1.0 - 0.25 * step) * length;
            }
            if accepted {
                x.copy_from_slice(&trial);
                std::mem::swap(&mut f, &mut f_trial);
                measure = new;
                if system.is_astray(x) {
                    return NewtonEnd {
                        status: NewtonStatus::Stagnated,
                        iterations: iterations + 1,
                        measure,
                    };
                }
                break;
            }
            step *= 0.5;
            if step < SMALLEST_STEP {
                return end(NewtonStatus::Stagnated);
            }
        }
    }
    NewtonEnd {
        status: NewtonStatus::IterationLimit,
        iterations: options.max_iterations,
        measure,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f = (a (x0^2 - x1 + 1), b (x0 - cos(pi x1 / 2))): Deuflhard's 2-D example, badly scaled.
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
            let end = newton(
                &mut system,
                &mut x,
                NewtonOptions {
                    tolerance: 1e-10,
                    max_iterations: 50,
                },
            );
            assert_eq!(end.status, NewtonStatus::Converged, "{scale}: {end:?}");
            assert!((x[0] * x[0] - x[1] + 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn says_when_the_iterations_are_used_up() {
        let mut system = Scaled {
            jacobian: [[0.0; 2]; 2],
            scale: 1.0,
        };
        let end = newton(
            &mut system,
            &mut [-0.9, 1.9],
            NewtonOptions {
                tolerance: 1e-10,
                max_iterations: 1,
            },
        );
        assert_eq!(
            (end.status, end.iterations),
            (NewtonStatus::IterationLimit, 1)
        );
    }
}
