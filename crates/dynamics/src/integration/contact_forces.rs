//! Complementarity problem of one time step, for its mean contact forces (forces, not impulses).
//!
//! u is the relative velocity of a pair at the end of the step. `offset` is added to it before the
//! law is applied (N: the speed at which the gap may still close; T: a share of the velocity at the
//! start of the step).
//!
//! ```text
//! u = free - D lambda,  y = u + offset
//! y_N >= 0,  lambda_N <= 0,  lambda_N y_N = 0
//! |lambda_T| <= -mu lambda_N;  sliding: lambda_T = -mu lambda_N y_T / |y_T|
//! ```
//!
//! They are the zero of `lambda - P(lambda + r y)`, with P the projection on lambda_N <= 0 and then
//! on the disc of radius -mu lambda_N (Alart and Curnier, Comput. Methods Appl. Mech. Engrg. 92
//! (1991) 353-375), by Newton's method with a Jacobian that is kept as long as it is useful. Where
//! no part of its correction helps (P has kinks, between which it can go to and fro), a few sweeps
//! of Gauss-Seidel from pair to pair find the states from which it does.

use dovetail_numerics::dense::{Lu, add_product};
use faer::Mat;

/// Residual at which a step is solved, relative to the largest force.
const TOLERANCE: f64 = 1e-10;
/// A residual that falls by less than this factor requires a new Jacobian. (A Jacobian costs as
/// much as some fifty iterations with an old one.)
const SLOW: f64 = 0.7;
/// Most corrections before a step is given up, and halvings of a correction with a new Jacobian.
const CORRECTIONS: usize = 300;
const HALVINGS: usize = 3;
/// Number of sweeps of Gauss-Seidel where no fraction of Newton's correction helps.
const SWEEPS: usize = 30;

/// Contact problem of every step (constant step size), with the Jacobian last used.
pub(crate) struct ContactProblem {
    /// Delassus matrix D, 1/kg, 3 pairs square: symmetric, positive definite.
    delassus: Mat<f64>,
    /// Friction coefficient of each pair.
    friction: Vec<f64>,
    /// Factor r, one value for N and one for both T of a pair: inverse diagonal of D.
    scale: Vec<f64>,
    jacobian: Option<Lu>,
}

/// End of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ContactEnd {
    /// The step is solved to the tolerance.
    Solved,
    /// The step is not solved to the tolerance.
    NotSolved {
        /// Residual that is left, relative to the largest force.
        residual: f64,
    },
}

impl ContactProblem {
    /// Problem with the Delassus matrix of the pairs (n x n, 1/kg) and their coefficients of
    /// friction.
    pub(crate) fn new(delassus: Mat<f64>, friction: Vec<f64>) -> Self {
        let d = |i: usize| delassus[(i, i)];
        let scale = (0..friction.len())
            .flat_map(|p| {
                let tangential = 2.0 / (d(3 * p + 1) + d(3 * p + 2));
                [1.0 / d(3 * p), tangential, tangential]
            })
            .collect();
        Self {
            delassus,
            friction,
            scale,
            jacobian: None,
        }
    }

    /// Finds lambda, N, starting from the value it has, and the velocities `u`, m/s, that go with
    /// it. `free`: u without contact forces; `offset`: see above; both m/s, 3 per pair.
    pub(crate) fn solve(
        &mut self,
        free: &[f64],
        offset: &[f64],
        lambda: &mut [f64],
        u: &mut [f64],
    ) -> ContactEnd {
        let n = lambda.len();
        let (mut argument, mut correction) = (vec![0.0; n], vec![0.0; n]);
        let (mut trial, mut rest) = (vec![0.0; n], vec![0.0; n]);
        self.velocity(free, lambda, u);
        let mut size = self.residual(offset, lambda, u, &mut argument, &mut correction);
        let mut fresh = false;
        for _ in 0..CORRECTIONS {
            if size <= TOLERANCE {
                return ContactEnd::Solved;
            }
            if self.jacobian.is_none() {
                self.jacobian = Some(Lu::new(self.derivative(&argument)));
                fresh = true;
            }
            if let Some(jacobian) = &self.jacobian {
                jacobian.solve_column_in_place(&mut correction);
            }
            let mut factor = 1.0;
            let mut better = false;
            for _ in 0..=if fresh { HALVINGS } else { 0 } {
                for ((t, l), c) in trial.iter_mut().zip(lambda.iter()).zip(&correction) {
                    *t = l - factor * c;
                }
                self.velocity(free, &trial, u);
                let tried = self.residual(offset, &trial, u, &mut argument, &mut rest);
                better = tried < if fresh { size } else { SLOW * size };
                if better {
                    size = tried;
                    break;
                }
                factor *= 0.5;
            }
            if better {
                lambda.copy_from_slice(&trial);
                correction.copy_from_slice(&rest);
                fresh = false;
                continue;
            }
            if fresh {
                self.velocity(free, lambda, u);
                self.sweep(offset, lambda, u);
            }
            self.velocity(free, lambda, u);
            size = self.residual(offset, lambda, u, &mut argument, &mut correction);
            self.jacobian = None;
            fresh = false;
        }
        ContactEnd::NotSolved { residual: size }
    }

    /// Computes u = free - D lambda.
    fn velocity(&self, free: &[f64], lambda: &[f64], u: &mut [f64]) {
        u.copy_from_slice(free);
        add_product(self.delassus.as_ref(), -1.0, lambda, u);
    }

    /// Computes lambda - P(lambda + r (u + offset)) and the point that is projected. Returns the
    /// largest entry over the largest force.
    fn residual(
        &self,
        offset: &[f64],
        lambda: &[f64],
        u: &[f64],
        argument: &mut [f64],
        residual: &mut [f64],
    ) -> f64 {
        let (mut worst, mut largest) = (0.0_f64, f64::MIN_POSITIVE);
        for (pair, &mu) in self.friction.iter().enumerate() {
            let at = 3 * pair;
            let speed = [0, 1, 2].map(|c| u[at + c] + offset[at + c]);
            for c in 0..3 {
                argument[at + c] = lambda[at + c] + self.scale[at + c] * speed[c];
            }
            let projected = project([argument[at], argument[at + 1], argument[at + 2]], mu);
            for c in 0..3 {
                let r = lambda[at + c] - projected[c];
                residual[at + c] = r;
                // A NaN must not hide behind max.
                worst = if r.is_nan() { r } else { worst.max(r.abs()) };
                largest = largest.max(lambda[at + c].abs()).max(projected[c].abs());
            }
            if worst.is_nan() {
                return f64::NAN;
            }
        }
        worst / largest
    }

    /// Jacobian I - P' (I - r D).
    fn derivative(&self, argument: &[f64]) -> Mat<f64> {
        let n = argument.len();
        let slopes: Vec<[[f64; 3]; 3]> = self
            .friction
            .iter()
            .zip(argument.chunks_exact(3))
            .map(|(mu, a)| slope([a[0], a[1], a[2]], *mu))
            .collect();
        let mut jacobian = Mat::<f64>::identity(n, n);
        for j in 0..n {
            let d = self.delassus.col_as_slice(j);
            let column = jacobian.col_as_slice_mut(j);
            for (pair, slope) in slopes.iter().enumerate() {
                let at = 3 * pair;
                for c in 0..3 {
                    let identity = if at + c == j { 1.0 } else { 0.0 };
                    let inner = identity - self.scale[at + c] * d[at + c];
                    for r in 0..3 {
                        column[at + r] -= slope[r][c] * inner;
                    }
                }
            }
        }
        jacobian
    }

    /// Runs sweeps of Gauss-Seidel; `u` belongs to `lambda` before and, except for rounding, after.
    fn sweep(&self, offset: &[f64], lambda: &mut [f64], u: &mut [f64]) {
        for _ in 0..SWEEPS {
            for (pair, &mu) in self.friction.iter().enumerate() {
                let at = 3 * pair;
                let speed = [0, 1, 2].map(|c| u[at + c] + offset[at + c]);
                // Half of r: the 3 x 3 blocks of D are not diagonal.
                let target =
                    [0, 1, 2].map(|c| lambda[at + c] + 0.5 * self.scale[at + c] * speed[c]);
                for (c, new) in project(target, mu).into_iter().enumerate() {
                    let change = new - lambda[at + c];
                    if change != 0.0 {
                        lambda[at + c] = new;
                        let column = self.delassus.col_as_slice(at + c);
                        for (u, d) in u.iter_mut().zip(column) {
                            *u -= change * d;
                        }
                    }
                }
            }
        }
    }
}

/// Projects on lambda_N <= 0, then on the disc of radius -mu lambda_N.
fn project([normal, t1, t2]: [f64; 3], mu: f64) -> [f64; 3] {
    if normal >= 0.0 {
        return [0.0; 3];
    }
    let (radius, length) = (-mu * normal, t1.hypot(t2));
    if length <= radius {
        [normal, t1, t2]
    } else {
        let scale = radius / length;
        [normal, scale * t1, scale * t2]
    }
}

/// Derivative of [`project`].
fn slope([normal, t1, t2]: [f64; 3], mu: f64) -> [[f64; 3]; 3] {
    if normal >= 0.0 {
        return [[0.0; 3]; 3];
    }
    let (radius, length) = (-mu * normal, t1.hypot(t2));
    if length <= radius {
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    }
    let (e1, e2, k) = (t1 / length, t2 / length, radius / length);
    [
        [1.0, 0.0, 0.0],
        [-mu * e1, k * (1.0 - e1 * e1), -k * e1 * e2],
        [-mu * e2, -k * e1 * e2, k * (1.0 - e2 * e2)],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::differences::{assert_close, central};

    fn problem(pairs: usize, seed: f64, mu: f64) -> ContactProblem {
        let n = 3 * pairs;
        let b = Mat::from_fn(n, n, |i, j| ((i * n + j) as f64 * 1.7 + seed).sin());
        let mut d = &b * b.transpose();
        for i in 0..n {
            d[(i, i)] += 0.5 * n as f64;
        }
        ContactProblem::new(d, vec![mu; pairs])
    }

    fn assert_law(problem: &ContactProblem, offset: &[f64], lambda: &[f64], u: &[f64]) {
        let largest = lambda.iter().fold(0.0_f64, |m, l| m.max(l.abs()));
        for (pair, (l, u)) in lambda.chunks(3).zip(u.chunks(3)).enumerate() {
            let u = [0, 1, 2].map(|c| u[c] + offset[3 * pair + c]);
            let gap = u[0];
            assert!(l[0] <= 0.0 && gap > -1e-7 && (l[0] * gap).abs() <= 1e-7 * largest);
            let (mu, sliding) = (problem.friction[pair], u[1].hypot(u[2]));
            assert!(l[1].hypot(l[2]) <= -mu * l[0] + 1e-7 * largest);
            if sliding > 1e-6 {
                for c in 1..3 {
                    let along = -mu * l[0] * u[c] / sliding;
                    assert!((l[c] - along).abs() <= 1e-5 * largest, "{l:?} {u:?}");
                }
            }
        }
    }

    #[test]
    fn both_solvers_satisfy_the_contact_law() {
        for case in 0..40 {
            let mut problem = problem(6, case as f64, 0.4);
            let n = 18;
            let free: Vec<f64> = (0..n)
                .map(|i| (i as f64 * 2.3 + case as f64).cos() * 3.0)
                .collect();
            let offset: Vec<f64> = (0..n).map(|i| 0.2 * (i % 4) as f64).collect();
            let (mut a, mut u) = (vec![0.0; n], vec![0.0; n]);
            assert_eq!(
                problem.solve(&free, &offset, &mut a, &mut u),
                ContactEnd::Solved
            );
            assert_law(&problem, &offset, &a, &u);
            let (mut b, mut u) = (vec![0.0; n], free.clone());
            for _ in 0..200 {
                problem.sweep(&offset, &mut b, &mut u);
            }
            assert_law(&problem, &offset, &b, &u);
            for (a, b) in a.iter().zip(&b) {
                assert!((a - b).abs() < 1e-6, "{a} {b}");
            }
        }
    }

    #[test]
    fn the_slope_is_the_derivative_of_the_projection() {
        for point in [[-2.0, 0.3, 0.1], [-1.0, 0.9, -1.4], [0.5, 1.0, 1.0]] {
            let exact = slope(point, 0.4);
            for c in 0..3 {
                let (mut up, mut down) = (point, point);
                up[c] += 1e-6;
                down[c] -= 1e-6;
                let (up, down) = (project(up, 0.4), project(down, 0.4));
                for r in 0..3 {
                    assert!(((up[r] - down[r]) / 2e-6 - exact[r][c]).abs() < 1e-8);
                }
            }
        }
    }

    #[test]
    fn the_jacobian_of_the_contact_forces_is_that_by_differences() {
        let problem = problem(4, 0.3, 0.4);
        // Points that are projected: a pair that sticks, two that slide, one that is open.
        let argument: Vec<f64> = [
            [-5.0, 0.3, 0.1],
            [-1.0, 0.9, -1.4],
            [-2.0, -1.1, 0.2],
            [0.5, 1.0, 1.0],
        ]
        .concat();
        let n = argument.len();
        let lambda: Vec<f64> = (0..n).map(|i| (i as f64 * 0.9).cos()).collect();
        let free: Vec<f64> = (0..n).map(|i| (i as f64 * 2.3).sin()).collect();
        let mut u = vec![0.0; n];
        problem.velocity(&free, &lambda, &mut u);
        let offset: Vec<f64> = (0..n)
            .map(|i| (argument[i] - lambda[i]) / problem.scale[i] - u[i])
            .collect();
        let differences = central(&lambda, 1e-6, |lambda| {
            let (mut u, mut a, mut f) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
            problem.velocity(&free, lambda, &mut u);
            problem.residual(&offset, lambda, &u, &mut a, &mut f);
            f
        });
        let exact = problem.derivative(&argument);
        assert_close(&exact, &differences, 1e-7, "contact forces");
    }
}
