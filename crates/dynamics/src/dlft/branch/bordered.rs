//! Balance with further unknowns, and as many further equations.
//!
//! Along a curve the unknowns are U and the abscissa p, such as the frequency. With the residual R
//! and the plane `row . U + corner p = value` across the curve, Newton's correction solves
//!
//! `| J    R_p    | | dU |     | R                             |`
//! `| row  corner | | dp | = - | row . U + corner p - value    |`,
//!
//! `R_p = (I - D) (Lambda_p U - F_p)` where p is the frequency or a force. The matrix is regular at
//! a fold, where J is not. A [`BalanceFamily`] says which balances, further unknowns and further
//! equations there are.

use super::gauge::{BorderRow, Direction};
use super::over::{SolutionAt, Solvers, Use};
use crate::dlft::balance::{Balance, Evaluation, Jacobian};
use crate::dlft::border::{Border, Equations};
use crate::dlft::dense::exactly_corrected;
use crate::dlft::factored::FactoredJacobian;
use crate::dlft::measure::{load_scale, relative_residual, step_length};
use crate::dlft::newton_krylov::{KRYLOV_TOLERANCE, Linearised, Preconditioner, krylov_tolerances};
use crate::dlft::point::{FrequencySolver, Solution, SolverWork};
use crate::dlft::retention::Mean;
use dovetail_numerics::nonlinear::{
    Damping, LinearTolerances, NewtonOptions, NonlinearSystem, newton,
};
use dovetail_numerics::vector::dot;

/// Balances over further unknowns, with as many further equations.
pub(crate) trait BalanceFamily {
    /// Balance where the further unknowns have these values; `None` where there is none.
    fn balance(&self, further: &[f64], mean: Mean) -> Option<Balance>;

    /// Derivative of the residual with respect to each further unknown, at constant U. `None` where
    /// it is not known.
    fn columns(
        &self,
        balance: &Balance,
        jacobian: &Jacobian,
        u: &[f64],
        further: &[f64],
    ) -> Option<Vec<Vec<f64>>>;

    /// Further equations: their left sides, which are to vanish.
    fn equations(&self, u: &[f64], further: &[f64]) -> Vec<f64>;

    /// Derivatives of the further equations with respect to U, and to the further unknowns.
    fn derivatives(&self, u: &[f64], further: &[f64]) -> [Vec<Vec<f64>>; 2];

    /// Size of left sides of the further equations beside a relative residual.
    fn measure(&self, equations: &[f64]) -> f64;

    /// Size of a change of the further unknowns in forces, N, beside a load of `load_n`.
    fn length_n(&self, change: &[f64], load_n: f64) -> f64;
}

/// U and the abscissa near a point of a curve that is to be solved for.
#[derive(Debug, Clone)]
pub(crate) struct Prediction {
    /// Coefficients, m.
    pub u: Vec<f64>,
    /// Abscissa.
    pub abscissa: f64,
}

/// U, the further unknowns and the mean from which a solution starts.
#[derive(Debug, Clone)]
pub(crate) struct BorderedStart {
    /// Coefficients, m.
    pub u: Vec<f64>,
    /// Further unknowns.
    pub further: Vec<f64>,
    /// Treatment of the mean along the motions that only friction holds.
    pub mean: Mean,
}

/// Plane across a curve: `row . U + corner p = value`, in units of the step that it ends.
#[derive(Debug, Clone)]
pub(crate) struct Plane {
    /// Coefficients of U, 1/m, and of the abscissa.
    pub across: BorderRow,
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
    pub(crate) fn normal_to(direction: &BorderRow, h: f64, through: &Prediction) -> Self {
        let row: Vec<f64> = direction.row.iter().map(|v| v / h).collect();
        let corner = direction.corner / h;
        Self {
            value: dot(&row, &through.u) + corner * through.abscissa,
            across: BorderRow { row, corner },
        }
    }

    /// Distance of a point from the plane, in steps.
    fn distance(&self, u: &[f64], abscissa: f64) -> f64 {
        let BorderRow { row, corner } = &self.across;
        dot(row, u) + corner * abscissa - self.value
    }
}

/// Balances of a curve over its abscissa, the one further unknown, in a plane.
struct AcrossCurve<'a> {
    solvers: Solvers<'a>,
    plane: &'a Plane,
}

impl BalanceFamily for AcrossCurve<'_> {
    fn balance(&self, further: &[f64], mean: Mean) -> Option<Balance> {
        self.solvers.balance(further[0], mean)
    }

    fn columns(
        &self,
        balance: &Balance,
        jacobian: &Jacobian,
        u: &[f64],
        further: &[f64],
    ) -> Option<Vec<Vec<f64>>> {
        let place = self.solvers.place(balance, u, further[0]);
        let column = (self.solvers.over).column(place, jacobian, Use::Correction)?;
        Some(vec![column])
    }

    fn equations(&self, u: &[f64], further: &[f64]) -> Vec<f64> {
        vec![self.plane.distance(u, further[0])]
    }

    fn derivatives(&self, _: &[f64], _: &[f64]) -> [Vec<Vec<f64>>; 2] {
        let BorderRow { row, corner } = self.plane.across.clone();
        [vec![row], vec![vec![corner]]]
    }

    fn measure(&self, equations: &[f64]) -> f64 {
        PLANE_WEIGHT * equations[0].abs()
    }

    fn length_n(&self, change: &[f64], load_n: f64) -> f64 {
        // A step of the plane's size in the abscissa counts as much as the load.
        load_n * self.plane.across.corner * change[0]
    }
}

/// Solves for the point of the curve in a plane, near a prediction. Returns the solution and its
/// abscissa, `None` where there is no model, or no mean to retain.
pub(crate) fn correct(
    solvers: Solvers<'_>,
    plane: &Plane,
    near: &Prediction,
    mean: Mean,
    options: NewtonOptions,
    work: &mut SolverWork,
) -> Option<(Solution, f64)> {
    let family = AcrossCurve { solvers, plane };
    let solver = solvers.solver(near.abscissa)?;
    let start = BorderedStart {
        u: near.u.clone(),
        further: vec![near.abscissa],
        mean,
    };
    let (solution, further) = corrected(&solver, &family, start, options, work)?;
    Some((solution, further[0]))
}

/// Solves for U and the further unknowns of a family, with the mean of the start. `None` where there
/// is no balance at the start, or no mean to retain.
pub(crate) fn corrected(
    solver: &FrequencySolver<'_>,
    family: &impl BalanceFamily,
    start: BorderedStart,
    options: NewtonOptions,
    work: &mut SolverWork,
) -> Option<(Solution, Vec<f64>)> {
    let unknowns = start.u.len();
    let mut x = [&start.u[..], &start.further].concat();
    let state = State::new(solver, family, start, options, work)?;
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
    let further = x.split_off(unknowns);
    let (balance, evaluation) = state.take_evaluation(&x, &further);
    work.count_iterations(end.iterations);
    work.residuals.push(end.residuals.clone());
    let solution = Solution {
        balance,
        u: x,
        evaluation,
        end,
    };
    Some((solution, further))
}

/// Jacobian at a solution, with the border of the abscissa and of one further equation; `None` where
/// the derivative by the abscissa is not known.
fn bordered_jacobian(
    solvers: Solvers<'_>,
    at: SolutionAt<'_>,
    across: BorderRow,
) -> Option<(Jacobian, Border)> {
    let Solution {
        balance,
        evaluation,
        ..
    } = at.solution;
    let jacobian = balance.linearise(evaluation);
    let column = (solvers.over).column(solvers.place_of(at), &jacobian, Use::Direction)?;
    let border = Border {
        columns: vec![column],
        rows: vec![across.row],
        corner: vec![vec![across.corner]],
    };
    Some((jacobian, border))
}

/// Direction of the curve at a solution, with `row . dU + corner dp = 1`; `None` where it is not
/// found.
pub(crate) fn direction(
    solvers: Solvers<'_>,
    at: SolutionAt<'_>,
    across: BorderRow,
    work: &mut SolverWork,
) -> Option<Direction> {
    let Solution { balance, u, .. } = at.solution;
    let unknowns = u.len();
    let solver = solvers.solver(at.abscissa)?;
    let (jacobian, border) = bordered_jacobian(solvers, at, across)?;
    let mut x = vec![0.0; unknowns + 1];
    let mut is_negative = None;
    if solver.is_exact() {
        let mut right = vec![0.0; unknowns + 1];
        right[unknowns] = 1.0;
        let factor = FactoredJacobian::new(balance, jacobian, Some(&border));
        let equations = Equations {
            border: Some(&border),
            right: &right,
        };
        factor.solve(balance, equations, &mut x)?;
        is_negative = Some(factor.has_negative_determinant());
    } else {
        let linear = work.preconditioner.linear_system(balance, jacobian);
        let scale = load_scale(balance, solver.newton.tolerance);
        let border = scaled_to_forces(border, scale[0]);
        let mut right = vec![0.0; unknowns + 1];
        right[unknowns] = scale[0];
        let equations = Equations {
            border: Some(&border),
            right: &right,
        };
        let (kept, within) = (&mut work.preconditioner, (scale, TANGENT_TOLERANCE));
        let end = kept.solve(balance, &linear, equations, within, &mut x);
        work.krylov_iterations += end.iterations;
    }
    let abscissa = x.pop()?;
    let is_finite = abscissa.is_finite() && x.iter().all(|v| v.is_finite());
    is_finite.then_some(Direction {
        u: x,
        abscissa,
        is_negative,
    })
}

/// Most unknowns for which [`orientation`] forms the Jacobian.
const MOST_ORIENTED_UNKNOWNS: usize = 6500;

/// [`Direction::is_negative`] of a direction with these coefficients at a solution; `None` where it is
/// not known, or the unknowns are many.
pub(crate) fn orientation(
    solvers: Solvers<'_>,
    at: SolutionAt<'_>,
    across: BorderRow,
) -> Option<bool> {
    let Solution { balance, u, .. } = at.solution;
    if u.len() > MOST_ORIENTED_UNKNOWNS {
        return None;
    }
    let (jacobian, border) = bordered_jacobian(solvers, at, across)?;
    let factor = FactoredJacobian::new(balance, jacobian, Some(&border));
    Some(factor.has_negative_determinant())
}

/// Derivatives of the residual, from those of Lambda U - F at constant U, where nothing else depends
/// on the further unknowns.
pub(crate) fn columns(
    balance: &Balance,
    jacobian: &Jacobian,
    slopes: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let n = balance.unknowns_per_block();
    let slopes = slopes.iter();
    slopes
        .map(|slope| jacobian.unbalanced_part(slope, n))
        .collect()
}

/// Border whose further equations are in forces, as the others are.
fn scaled_to_forces(mut border: Border, load_n: f64) -> Border {
    let coefficients = border.rows.iter_mut().chain(&mut border.corner).flatten();
    coefficients.for_each(|v| *v *= load_n);
    border
}

/// Balance at the further unknowns that were asked for last, with its last evaluation.
struct State<'a, F> {
    solver: &'a FrequencySolver<'a>,
    family: &'a F,
    mean: Mean,
    options: NewtonOptions,
    balance: Balance,
    /// Number of unknowns of U.
    own: usize,
    further: Vec<f64>,
    last: Option<(Vec<f64>, Evaluation)>,
    /// Norms of the load of the balance, as in [`load_scale`].
    scale: [f64; 2],
}

impl<'a, F: BalanceFamily> State<'a, F> {
    fn new(
        solver: &'a FrequencySolver<'_>,
        family: &'a F,
        start: BorderedStart,
        options: NewtonOptions,
        work: &SolverWork,
    ) -> Option<Self> {
        let BorderedStart { u, further, mean } = start;
        let mut balance = family.balance(&further, mean)?;
        balance.deadline = work.deadline;
        Some(Self {
            scale: load_scale(&balance, options.tolerance),
            solver,
            family,
            mean,
            options,
            balance,
            own: u.len(),
            further,
            last: None,
        })
    }

    /// Goes to values of the further unknowns. `false` where there is no balance.
    fn go_to(&mut self, further: &[f64]) -> bool {
        if further == self.further {
            return true;
        }
        let Some(mut balance) = self.family.balance(further, self.mean) else {
            return false;
        };
        balance.deadline = self.balance.deadline;
        self.scale = load_scale(&balance, self.options.tolerance);
        (self.balance, self.further, self.last) = (balance, further.to_vec(), None);
        true
    }

    /// Evaluation at a point, computed unless the point was the last.
    fn evaluate(&mut self, u: &[f64]) -> &Evaluation {
        let evaluation = match self.last.take() {
            Some((last, evaluation)) if last == u => evaluation,
            _ => self.balance.evaluate(u),
        };
        &self.last.insert((u.to_vec(), evaluation)).1
    }

    fn take_evaluation(mut self, u: &[f64], further: &[f64]) -> (Balance, Evaluation) {
        self.go_to(further);
        self.evaluate(u);
        let (_, evaluation) = self.last.expect("just evaluated");
        (self.balance, evaluation)
    }

    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        let (u, further) = x.split_at(self.own);
        if !self.go_to(further) {
            f.fill(f64::NAN);
            return;
        }
        let (own, equations) = f.split_at_mut(self.own);
        own.copy_from_slice(&self.evaluate(u).residual);
        equations.copy_from_slice(&self.family.equations(u, further));
    }

    fn measure(&self, f: &[f64]) -> f64 {
        let (own, equations) = f.split_at(self.own);
        let of_balance = relative_residual(own, self.balance.unknowns_per_block(), self.scale);
        let of_equations = self.family.measure(equations);
        if of_equations.is_nan() {
            return f64::NAN;
        }
        of_balance.max(of_equations)
    }

    /// Jacobian with its border; `None` where a derivative is not known.
    fn linearised(&mut self, x: &[f64]) -> Option<(Jacobian, Border)> {
        let (u, further) = x.split_at(self.own);
        self.go_to(further);
        self.evaluate(u);
        let (_, evaluation) = self.last.as_ref().expect("just evaluated");
        let jacobian = self.balance.linearise(evaluation);
        let [rows, corner] = self.family.derivatives(u, further);
        let columns = (self.family).columns(&self.balance, &jacobian, u, further)?;
        let border = Border {
            columns,
            rows,
            corner,
        };
        Some((jacobian, border))
    }

    fn length(&self, dx: &[f64]) -> f64 {
        let (du, change) = dx.split_at(self.own);
        step_length(&self.balance, du).hypot(self.family.length_n(change, self.scale[0]))
    }

    fn has_diverged(&self, x: &[f64]) -> bool {
        self.mean == Mean::Free && self.solver.walked_off(&x[..self.own])
    }

    fn is_late(&self) -> bool {
        self.balance.deadline.is_over()
    }
}

/// The system solved with its matrix formed and factored, for few unknowns.
struct Exact<'a, F> {
    state: State<'a, F>,
    factor: Option<(FactoredJacobian, Border)>,
}

impl<F: BalanceFamily> NonlinearSystem for Exact<'_, F> {
    const DAMPING: Damping = Damping::Persistent;

    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        self.state.residual(x, f);
    }
    fn measure(&self, f: &[f64]) -> f64 {
        self.state.measure(f)
    }
    fn linearise(&mut self, x: &[f64]) {
        let linearised = self.state.linearised(x);
        self.factor = linearised.map(|(jacobian, border)| {
            let balance = &self.state.balance;
            let factor = FactoredJacobian::new(balance, jacobian, Some(&border));
            (factor, border)
        });
    }
    fn correction(&mut self, f: &[f64], _: f64, dx: &mut [f64]) -> Option<f64> {
        let (factor, border) = self.factor.as_ref()?;
        let balance = &self.state.balance;
        exactly_corrected(balance, Some(factor), Some(border), f, dx)
    }
    fn length(&self, dx: &[f64]) -> f64 {
        self.state.length(dx)
    }
    fn is_late(&self) -> bool {
        self.state.is_late()
    }
}

/// The system solved by GMRES on the pairs that take part.
struct Krylov<'a, F> {
    state: State<'a, F>,
    linear: Option<(Linearised, Border)>,
    krylov_iterations: usize,
    preconditioner: &'a mut Preconditioner,
}

impl<F: BalanceFamily> NonlinearSystem for Krylov<'_, F> {
    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        self.state.residual(x, f);
    }
    fn measure(&self, f: &[f64]) -> f64 {
        self.state.measure(f)
    }
    fn linearise(&mut self, x: &[f64]) {
        let linearised = self.state.linearised(x);
        let State { balance, scale, .. } = &self.state;
        self.linear = linearised.map(|(jacobian, border)| {
            let linear = self.preconditioner.linear_system(balance, jacobian);
            (linear, scaled_to_forces(border, scale[0]))
        });
    }
    fn linear_tolerances(&self) -> Option<LinearTolerances> {
        Some(krylov_tolerances(KRYLOV_TOLERANCE))
    }
    fn correction(&mut self, f: &[f64], tolerance: f64, dx: &mut [f64]) -> Option<f64> {
        let (linear, border) = self.linear.as_ref()?;
        let State {
            balance,
            scale,
            own,
            ..
        } = &self.state;
        let mut right: Vec<f64> = f.iter().map(|f| -f).collect();
        right[*own..]
            .iter_mut()
            .for_each(|right| *right *= scale[0]);
        let kept = &mut *self.preconditioner;
        let equations = Equations {
            border: Some(border),
            right: &right,
        };
        let end = kept.solve(balance, linear, equations, (*scale, tolerance), dx);
        self.krylov_iterations += end.iterations;
        dx.iter()
            .all(|d| d.is_finite())
            .then_some(end.relative_residual)
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
