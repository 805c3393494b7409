//! Balance of a frequency that is itself unknown: one equation more, a plane across the curve.
//!
//! The unknowns are U and the frequency f. With the residual R and the plane `row . U + corner f =
//! value`, Newton's correction solves
//!
//! `| J    R_f    | | dU |     | R                             |`
//! `| row  corner | | df | = - | row . U + corner f - value    |`,
//!
//! `R_f = (I - D) (Lambda_f U - F_f)`. The matrix is regular at a fold, where J is not.

use crate::dlft::balance::{Balance, Evaluation, Jacobian};
use crate::dlft::dense::{exactly_corrected, formed};
use crate::dlft::linear_system::LinearSystem;
use crate::dlft::newton_krylov::{
    KRYLOV_TOLERANCE, LOOSE_KRYLOV_TOLERANCE, Preconditioner, load_scale, relative_residual,
    step_length,
};
use crate::dlft::point::{FrequencySolver, Solution, Work};
use crate::dlft::retention::Mean;
use crate::dlft::two_level::Border;
use dovetail_numerics::dense::Lu;
use dovetail_numerics::nonlinear::{Damping, NewtonOptions, NonlinearSystem, newton};
use dovetail_numerics::vector::dot;
use faer::Mat;
use std::f64::consts::TAU;

/// Plane across a curve: `row . U + corner f = value`, in units of the step that it ends.
#[derive(Debug, Clone)]
pub struct Plane {
    /// Coefficients of U, 1/m.
    pub row: Vec<f64>,
    /// Coefficient of the frequency, 1/Hz.
    pub corner: f64,
    /// Value of the plane.
    pub value: f64,
}

/// A plane is met where its equation holds to this fraction of the step for each unit of the
/// relative residual.
const PLANE_WEIGHT: f64 = 1e-4;
/// Relative residual of the linear solve for a tangent.
const TANGENT_TOLERANCE: f64 = 1e-5;

impl Plane {
    /// Plane through a point across a direction that has these coefficients, in units of the step h.
    pub fn across((row, corner): (&[f64], f64), h: f64, (u, frequency_hz): (&[f64], f64)) -> Self {
        let row: Vec<f64> = row.iter().map(|v| v / h).collect();
        let corner = corner / h;
        Self {
            value: dot(&row, u) + corner * frequency_hz,
            row,
            corner,
        }
    }

    /// Distance of a point from the plane, in steps.
    fn off(&self, u: &[f64], frequency_hz: f64) -> f64 {
        dot(&self.row, u) + self.corner * frequency_hz - self.value
    }
}

/// Direction of a curve: derivatives by the length of the curve.
#[derive(Debug, Clone)]
pub struct Direction {
    /// Derivative of U, m.
    pub u: Vec<f64>,
    /// Derivative of the frequency, Hz.
    pub frequency_hz: f64,
}

/// Solves for the point of the curve in a plane, from `u` and `frequency_hz`. Returns the solution
/// and its frequency, `None` where there is no mean to retain.
pub fn correct<'b>(
    solver: &'b FrequencySolver<'_>,
    plane: &Plane,
    (u, frequency_hz): (&[f64], f64),
    mean: Mean,
    options: NewtonOptions,
    work: &mut Work,
) -> Option<(Solution<'b>, f64)> {
    let mut x = u.to_vec();
    x.push(frequency_hz);
    let state = State::new(solver, plane, mean, frequency_hz, options, work)?;
    let (end, state) = if solver.is_exact() {
        let mut system = Exact {
            state,
            factor: None,
        };
        (newton(&mut system, &mut x, options), system.state)
    } else {
        let mut system = Krylov {
            state,
            linear: None,
            krylov_iterations: 0,
            preconditioner: &mut work.preconditioner,
        };
        let end = newton(&mut system, &mut x, options);
        work.krylov_iterations += system.krylov_iterations;
        (end, system.state)
    };
    work.newton_iterations += end.iterations;
    work.residuals.push(end.residuals.clone());
    let frequency_hz = x.pop()?;
    let (balance, evaluation) = state.take(&x, frequency_hz);
    let solution = Solution {
        balance,
        u: x,
        evaluation,
        end,
    };
    Some((solution, frequency_hz))
}

/// Direction of the curve at a solution, with `row . dU + corner df = 1`; `None` where it is not
/// found.
pub fn direction(
    solver: &FrequencySolver<'_>,
    (solution, frequency_hz): (&Solution<'_>, f64),
    (row, corner): (&[f64], f64),
    work: &mut Work,
) -> Option<Direction> {
    let Solution {
        balance,
        u,
        evaluation,
        ..
    } = solution;
    let own = u.len();
    let jacobian = balance.linearise(&evaluation.lambda_u);
    let column = column(balance, &jacobian, u, frequency_hz);
    let mut x = vec![0.0; own + 1];
    if solver.is_exact() {
        x[own] = 1.0;
        let matrix = bordered(&formed(balance, &jacobian), &column, row, corner);
        Lu::new(matrix).solve_column_in_place(&mut x);
    } else {
        let linear = work.preconditioner.linear_system(balance, &jacobian);
        let scale = load_scale(balance, solver.newton.tolerance);
        let border = border(column, (row, corner), scale);
        let mut right = vec![0.0; own + 1];
        right[own] = scale[0];
        let tolerance = TANGENT_TOLERANCE;
        work.krylov_iterations += work.preconditioner.solve(
            balance,
            &linear,
            Some(&border),
            &right,
            scale,
            tolerance,
            &mut x,
        );
    }
    let frequency_hz = x.pop()?;
    let is_finite = frequency_hz.is_finite() && x.iter().all(|v| v.is_finite());
    is_finite.then_some(Direction { u: x, frequency_hz })
}

/// Derivative of the residual with respect to the frequency, N/Hz.
fn column(balance: &Balance<'_>, jacobian: &Jacobian, u: &[f64], frequency_hz: f64) -> Vec<f64> {
    let mut slope = balance.frequency_slope(u, TAU * frequency_hz);
    slope.iter_mut().for_each(|s| *s *= TAU);
    jacobian.less_contact_response(&slope, balance.unknowns_per_block())
}

/// Border of the linear solves: the further equation is in forces, as the others are.
fn border(column: Vec<f64>, (row, corner): (&[f64], f64), scale: [f64; 2]) -> Border {
    Border {
        column,
        row: row.iter().map(|v| v * scale[0]).collect(),
        corner: corner * scale[0],
    }
}

/// Matrix with a column and a row more.
fn bordered(inner: &Mat<f64>, column: &[f64], row: &[f64], corner: f64) -> Mat<f64> {
    let own = column.len();
    let mut out = Mat::zeros(own + 1, own + 1);
    for (j, last) in row.iter().enumerate() {
        let into = out.col_as_slice_mut(j);
        into[..own].copy_from_slice(inner.col_as_slice(j));
        into[own] = *last;
    }
    let last = out.col_as_slice_mut(own);
    last[..own].copy_from_slice(column);
    last[own] = corner;
    out
}

/// Balance at the frequency that was asked for last, with its last evaluation.
struct State<'p, 'b> {
    solver: &'b FrequencySolver<'b>,
    plane: &'p Plane,
    mean: Mean,
    options: NewtonOptions,
    balance: Balance<'b>,
    frequency_hz: f64,
    last: Option<(Vec<f64>, Evaluation)>,
    /// Norms of the load at that frequency, as in [`load_scale`].
    scale: [f64; 2],
}

impl<'p, 'b> State<'p, 'b> {
    fn new(
        solver: &'b FrequencySolver<'_>,
        plane: &'p Plane,
        mean: Mean,
        frequency_hz: f64,
        options: NewtonOptions,
        work: &Work,
    ) -> Option<Self> {
        let mut balance = solver.balance(frequency_hz, mean)?;
        balance.deadline = work.deadline;
        Some(Self {
            scale: load_scale(&balance, options.tolerance),
            solver,
            plane,
            mean,
            options,
            balance,
            frequency_hz,
            last: None,
        })
    }

    /// Goes to a frequency. `false` where there is no balance.
    fn go_to(&mut self, frequency_hz: f64) -> bool {
        if frequency_hz == self.frequency_hz {
            return true;
        }
        let found = (frequency_hz > 0.0 && frequency_hz.is_finite())
            .then(|| self.solver.balance(frequency_hz, self.mean))
            .flatten();
        let Some(mut balance) = found else {
            return false;
        };
        balance.deadline = self.balance.deadline;
        self.scale = load_scale(&balance, self.options.tolerance);
        (self.balance, self.frequency_hz, self.last) = (balance, frequency_hz, None);
        true
    }

    /// Evaluation at a point, computed unless the point was the last.
    fn at(&mut self, u: &[f64]) -> &Evaluation {
        let evaluation = match self.last.take() {
            Some((last, evaluation)) if last == u => evaluation,
            _ => self.balance.evaluate(u),
        };
        &self.last.insert((u.to_vec(), evaluation)).1
    }

    fn take(mut self, u: &[f64], frequency_hz: f64) -> (Balance<'b>, Evaluation) {
        self.go_to(frequency_hz);
        self.at(u);
        let (_, evaluation) = self.last.expect("just evaluated");
        (self.balance, evaluation)
    }

    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        let (u, frequency_hz) = split(x);
        if !self.go_to(frequency_hz) {
            f.fill(f64::NAN);
            return;
        }
        let own = u.len();
        f[..own].copy_from_slice(&self.at(u).residual);
        f[own] = self.plane.off(u, frequency_hz);
    }

    fn measure(&self, f: &[f64]) -> f64 {
        let (own, off) = split(f);
        let of_balance = relative_residual(own, self.balance.unknowns_per_block(), self.scale);
        if off.is_nan() {
            return f64::NAN;
        }
        of_balance.max(PLANE_WEIGHT * off.abs())
    }

    fn linearised(&mut self, x: &[f64]) -> (Jacobian, Vec<f64>) {
        let (u, frequency_hz) = split(x);
        self.go_to(frequency_hz);
        self.at(u);
        let (_, evaluation) = self.last.as_ref().expect("just evaluated");
        let jacobian = self.balance.linearise(&evaluation.lambda_u);
        let column = column(&self.balance, &jacobian, u, frequency_hz);
        (jacobian, column)
    }

    fn length(&self, dx: &[f64]) -> f64 {
        let (du, df) = split(dx);
        // A step of the plane's size in the frequency counts as much as the load.
        step_length(&self.balance, du).hypot(self.scale[0] * self.plane.corner * df)
    }

    fn has_diverged(&self, x: &[f64]) -> bool {
        self.mean == Mean::Free && self.solver.walked_off(split(x).0)
    }

    fn is_late(&self) -> bool {
        self.balance.deadline.is_over()
    }
}

/// U and the frequency, or the two parts of a residual.
fn split(x: &[f64]) -> (&[f64], f64) {
    let (last, rest) = x.split_last().expect("a frequency besides U");
    (rest, *last)
}

/// The system solved with its matrix formed and factored, for few unknowns.
struct Exact<'p, 'b> {
    state: State<'p, 'b>,
    factor: Option<Lu>,
}

impl NonlinearSystem for Exact<'_, '_> {
    const DAMPING: Damping = Damping::Persistent;

    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        self.state.residual(x, f);
    }
    fn measure(&self, f: &[f64]) -> f64 {
        self.state.measure(f)
    }
    fn linearise(&mut self, x: &[f64]) {
        let (jacobian, column) = self.state.linearised(x);
        let Plane { row, corner, .. } = self.state.plane;
        let matrix = bordered(
            &formed(&self.state.balance, &jacobian),
            &column,
            row,
            *corner,
        );
        self.factor = Some(Lu::new(matrix));
    }
    fn correction(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
        exactly_corrected(self.factor.as_ref(), f, dx)
    }
    fn length(&self, dx: &[f64]) -> f64 {
        self.state.length(dx)
    }
    fn is_late(&self) -> bool {
        self.state.is_late()
    }
}

/// The system solved by GMRES on the pairs that take part.
struct Krylov<'p, 'b, 'w> {
    state: State<'p, 'b>,
    linear: Option<(LinearSystem, Border)>,
    krylov_iterations: usize,
    preconditioner: &'w mut Preconditioner,
}

impl Krylov<'_, '_, '_> {
    fn solve(&mut self, f: &[f64], tolerance: f64, dx: &mut [f64]) -> bool {
        let Some((linear, border)) = &self.linear else {
            return false;
        };
        let State { balance, scale, .. } = &self.state;
        let mut right: Vec<f64> = f.iter().map(|f| -f).collect();
        if let Some(last) = right.last_mut() {
            *last *= scale[0];
        }
        self.krylov_iterations +=
            self.preconditioner
                .solve(balance, linear, Some(border), &right, *scale, tolerance, dx);
        dx.iter().all(|d| d.is_finite())
    }
}

impl NonlinearSystem for Krylov<'_, '_, '_> {
    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        self.state.residual(x, f);
    }
    fn measure(&self, f: &[f64]) -> f64 {
        self.state.measure(f)
    }
    fn linearise(&mut self, x: &[f64]) {
        let (jacobian, column) = self.state.linearised(x);
        let State {
            balance,
            plane,
            scale,
            ..
        } = &self.state;
        let linear = self.preconditioner.linear_system(balance, &jacobian);
        let border = border(column, (&plane.row, plane.corner), *scale);
        self.linear = Some((linear, border));
    }
    fn correction(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
        self.solve(f, KRYLOV_TOLERANCE, dx)
    }
    fn simplified(&mut self, f: &[f64], dx: &mut [f64]) -> bool {
        self.solve(f, LOOSE_KRYLOV_TOLERANCE, dx)
    }
    fn length(&self, dx: &[f64]) -> f64 {
        self.state.length(dx)
    }
    fn has_diverged(&self, x: &[f64]) -> bool {
        self.state.has_diverged(x)
    }
    fn is_late(&self) -> bool {
        self.state.is_late()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{OMEGA_RAD_S, at_sample_points};

    #[test]
    fn the_column_of_the_frequency_is_that_by_differences() {
        at_sample_points(|what, balance, u| {
            let at = |omega: f64| {
                let mut moved = Balance::new(balance.setting, omega);
                let given = Balance::new(balance.setting, OMEGA_RAD_S);
                // The samples have loads of their own.
                for (i, f) in moved.force.iter_mut().enumerate() {
                    *f += balance.force[i] - given.force[i];
                }
                moved.evaluate(u).residual
            };
            let step = 1e-7;
            let [above, below] = [OMEGA_RAD_S + step, OMEGA_RAD_S - step].map(at);
            let jacobian = balance.linearise(&balance.evaluate(u).lambda_u);
            let column = column(balance, &jacobian, u, OMEGA_RAD_S / TAU);
            let largest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for ((a, b), column) in above.iter().zip(&below).zip(&column) {
                let by_differences = TAU * (a - b) / (2.0 * step);
                let off = (by_differences - column).abs();
                assert!(off < 1e-5 * largest, "{what}: {by_differences} {column}");
            }
        });
    }
}
