//! Static state of the flanks under rotation: the contact laws with the mean alone, the load
//! applied in steps so that slip keeps its history (method of the dynamic solve with H = 0, one
//! sample a step). The load may come by way of others ([`LoadPath`]): friction keeps what they
//! leave. The stiffness is that of the steady load all the way.
//!
//! All pairs open is a valid state where supports and springs hold the bodies; elsewhere nothing
//! holds them then.
//!
//! A motion that nothing else holds is retained at rest, as in the dynamic solve
//! ([`super::retention`]), where friction does not hold it either (at a coefficient of 0 it never
//! does): there is no state to be found then, or one far away.

use super::coarse::Coarse;
use super::linear_system::{LinearSystem, PairDerivatives};
use super::retention::{Holding, Retention};
use super::two_level;
use super::{Outcome, PairStatus, StaticState};
use crate::contact::coulomb::Contact;
use crate::contact::{Instant, PairLaw, PredictedLaw, State};
use crate::problem::inexact::{Inexact, InexactModel};
use crate::problem::tangential;
use crate::problem::{LinearReference, Problem};
use crate::reduced::ReducedModel;
use dovetail_numerics::dense::{Lu, add_symmetric_product};
use dovetail_numerics::krylov::RefreshPolicy;
use dovetail_numerics::nonlinear::{
    NewtonEnd, NewtonOptions, NewtonStatus, NonlinearSystem, newton,
};
use dovetail_numerics::vector::norm;
use faer::{Mat, MatMut, MatRef};
use serde::Serialize;
use std::sync::Arc;

/// Way in which the static load is applied: from no load through the points in their order, and
/// from the last of them to the steady load. Each leg is a straight line.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoadPath {
    /// Number of equal steps of each leg.
    pub steps: usize,
    /// Multiples of the parts of the steady load at each point, in the order of
    /// [`ReducedModel::working_multiples`](crate::reduced::ReducedModel::working_multiples), which
    /// says what the parts are. A part without a multiple has that of the steady load. Empty: the
    /// load rises to the steady load itself.
    pub points: Vec<Vec<f64>>,
}

impl From<usize> for LoadPath {
    /// The load rises in so many equal steps.
    fn from(steps: usize) -> Self {
        let points = Vec::new();
        Self { steps, points }
    }
}

/// Share of the load before it that is left at a point without load. Where nothing presses the pairs
/// any more, all of them are about to open, and bodies that only they hold have no state of their
/// own; with so little left the state is that which the falling load leads to.
const LEFT: f64 = 1e-6;

impl LoadPath {
    /// Loads on X, N, between which the legs are: none, those of the points, and the steady load.
    fn stations(&self, reduced: &ReducedModel) -> Vec<Vec<f64>> {
        let mut stations = vec![vec![0.0; reduced.static_load.on_x.len()]];
        for multiples in &self.points {
            let mut load = reduced.steady_on_x(multiples);
            let before = stations.last().map_or(&[][..], Vec::as_slice);
            if norm(&load) < LEFT * norm(before) {
                load = before.iter().map(|f| LEFT * f).collect();
            }
            stations.push(load);
        }
        stations.push(reduced.static_load.on_x.clone());
        stations
    }
}

/// Solves the static state under the static load.
///
/// The load is applied along the path from the stuck, unloaded state, the interference of pairs of
/// negative clearance on its first leg. Friction keeps what the path leaves. Motions that nothing
/// holds are retained. eps is the stiffness of each pair: it influences only the iterations, not the
/// state. If a step of the path does not converge, or nothing holds the bodies at one of its points
/// or in the end ([`Outcome::NothingHolds`]), all pairs of the linear reference stick.
pub fn static_state(
    problem: &Problem,
    path: impl Into<LoadPath>,
    options: NewtonOptions,
) -> StaticState {
    with_linear(
        problem,
        settle(problem, Start::Unloaded, &path.into(), options),
    )
}

/// State of all pairs at rest, or the mean of a vibration as such a state.
#[derive(Debug, Clone, Copy)]
pub struct PairsAtRest<'a> {
    /// Relative displacements, m, n.
    pub x: &'a [f64],
    /// Contact forces, N, n.
    pub lambda: &'a [f64],
}

impl<'a> From<&'a StaticState> for PairsAtRest<'a> {
    fn from(state: &'a StaticState) -> Self {
        Self {
            x: &state.x,
            lambda: &state.lambda,
        }
    }
}

/// Solves the static state that pairs come to under the static load after they were at rest in
/// another state, such as the mean of a vibration. The laws may have changed since: where the
/// clearances have, the bodies follow in one step. Friction keeps what the state before had.
pub fn static_state_after(
    problem: &Problem,
    before: PairsAtRest<'_>,
    options: NewtonOptions,
) -> StaticState {
    with_linear(problem, settled_after(problem, before, options))
}

/// State of [`static_state_after`], with a linear reference whose pairs all stick.
pub(super) fn settled_after(
    problem: &Problem,
    before: PairsAtRest<'_>,
    options: NewtonOptions,
) -> StaticState {
    settle(problem, Start::After(before), &1.into(), options)
}

/// State with its own linear reference, if it converged.
fn with_linear(problem: &Problem, mut state: StaticState) -> StaticState {
    if state.outcome.is_converged() {
        state.linear = LinearReference::about(problem, &state.open_pairs());
    }
    state
}

/// Solves the state, with a linear reference whose pairs all stick.
fn settle(
    problem: &Problem,
    from: Start<'_>,
    path: &LoadPath,
    options: NewtonOptions,
) -> StaticState {
    let eps = &problem.reduced.diagonal_stiffness();
    let all: Vec<usize> = (0..problem.laws.len()).collect();
    let inexact = InexactModel::of_mean(&problem.reduced).taking_part(&all, None);
    let holding = Holding::of(problem);
    let load_up = |retention: Option<&Retention>, start: Start<'_>| {
        let system = StaticSystem::new(problem, &inexact, eps, retention);
        system.load_up(start, path, &holding, options)
    };
    let mut free = load_up(None, from);
    let mut start = from;
    let nothing_holds = |state: &StaticState| state.all_open() && !holding.without_contact();
    let is_lost = |state: &StaticState| !state.outcome.is_converged() || nothing_holds(state);
    let is_apart = matches!(from, Start::Unloaded) && problem.laws.iter().any(|p| p.gap_m > 0.0);
    if is_lost(&free) && is_apart && problem.steady_force_n() > 0.0 {
        // A blade that touches nothing has an equilibrium of its own, far inwards, and one that few
        // pairs touch has hardly any stiffness: start with the flanks together.
        let other = load_up(None, Start::ClearancesClosed);
        if !is_lost(&other) || free.all_open() && !other.all_open() {
            (free, start) = (other, Start::ClearancesClosed);
        }
    }
    if free.outcome == Outcome::NothingHolds {
        return free;
    }
    if nothing_holds(&free) {
        free.outcome = Outcome::NothingHolds;
        return free;
    }
    let converged = free.outcome.is_converged();
    let any = |status| free.status.contains(&status);
    if !any(PairStatus::Slipping) || (converged && any(PairStatus::Stuck)) {
        return free;
    }
    let Some(retention) = holding.retention() else {
        return free;
    };
    let mut slides = problem.laws.iter().zip(&free.status);
    let rubs = slides.any(|(law, status)| *status == PairStatus::Slipping && law.friction > 0.0);
    // One of a whole line of states is found by chance.
    let by_chance = !rubs && retention.is_indifferent(&problem.reduced);
    let at_rest = vec![0.0; free.x.len()];
    if converged && !by_chance && !retention.walked_off(&free.x, &at_rest, 0.0) {
        return free;
    }
    let mut retained = load_up(Some(retention), start);
    retained.newton_iterations += free.newton_iterations;
    if retained.outcome.is_converged() || (converged && !by_chance) {
        retained
    } else {
        free
    }
}

/// Relative residual of the linear solves.
const KRYLOV_TOLERANCE: f64 = 1e-4;
const MOST_KRYLOV_ITERATIONS: usize = 300;
/// Largest size at which a Jacobian that GMRES does not solve is factored.
const MOST_DENSE_UNKNOWNS: usize = 6000;
/// A Jacobian is also factored where shear follows the normal force by more than this: what it then
/// asks of the normal forces is beyond single precision, and is not local.
const STEEPEST: f32 = 3.0;

/// A load step that fails is tried with coefficients of friction that grow from this ...
const FIRST_FRICTION: f64 = 0.5;
/// ... by the first of these factors; where that fails, by the next.
const FRICTION_GROWTHS: [f64; 3] = [4.0, 10.0, 2.0];

/// State from which the load is applied.
#[derive(Debug, Clone, Copy)]
enum Start<'a> {
    /// All relative displacements are zero.
    Unloaded,
    ClearancesClosed,
    /// State in which the pairs were at rest before.
    After(PairsAtRest<'a>),
}

/// Force that residuals are relative to, N: the norm of the steady load or, where nothing presses
/// the pairs in the end, of the largest one on the path; without any, of their own stiffness times
/// their clearances. Where there are none either, the pairs are at rest as they are, and the
/// residual is 0.
fn force_scale_n(problem: &Problem, eps: &[f64], stations: &[Vec<f64>]) -> f64 {
    let steady_n = problem.steady_force_n();
    let on_path_n = stations.iter().map(|load| norm(load)).fold(0.0, f64::max);
    let pairs = problem.laws.iter().zip(eps.iter().step_by(3));
    let clearances: Vec<f64> = pairs.map(|(pair, eps)| eps * pair.gap_m).collect();
    let scales = [steady_n, on_path_n, norm(&clearances)];
    scales.into_iter().find(|n| *n > 0.0).unwrap_or(1.0)
}

/// State with all clearances closed without any load along the flanks: X_T = -(K_TT + a little
/// eps_T)^-1 K_TN X_N.
fn with_clearances_closed(problem: &Problem, eps: &[f64]) -> Vec<f64> {
    const GROUND: f64 = 1e-3;
    let k = &problem.reduced.stiffness;
    let n = k.nrows();
    let mut x = vec![0.0; n];
    for (x, pair) in x.iter_mut().step_by(3).zip(&problem.laws) {
        *x = -pair.gap_m;
    }
    let along = tangential(n);
    let size = along.len();
    let matrix = Mat::from_fn(size, size, |i, j| {
        let ground = if i == j { GROUND * eps[along[i]] } else { 0.0 };
        k[(along[i], along[j])] + ground
    });
    let force = |i: &usize| -(0..n).step_by(3).map(|j| k[(*i, j)] * x[j]).sum::<f64>();
    let mut slide: Vec<f64> = along.iter().map(force).collect();
    Lu::new(matrix).solve_column_in_place(&mut slide);
    along.iter().zip(&slide).for_each(|(i, s)| x[*i] = *s);
    x
}

/// Solves one load step from `x`, or from where it is `predicted` if less of the load is left out of
/// balance there. Where shear carries much of the load (a coefficient above 1) pairs open, and
/// Newton's method may end between two of them: the coefficient is then raised in steps, each
/// solution the start of the next.
fn load_step(
    system: &mut StaticSystem<'_>,
    x: &mut [f64],
    predicted: Option<Vec<f64>>,
    options: NewtonOptions,
) -> NewtonEnd {
    let start = x.to_vec();
    let mut unbalanced = |x: &[f64]| {
        let mut f = vec![0.0; x.len()];
        system.residual(x, &mut f);
        system.measure(&f)
    };
    let predicted = predicted.filter(|predicted| {
        // The elastic forces at the start are known.
        let at_start = unbalanced(&start);
        unbalanced(predicted) < at_start
    });
    let mut iterations = 0;
    let mut solved_from = |from: &[f64], x: &mut [f64]| {
        x.copy_from_slice(from);
        let end = newton(system, x, options);
        iterations += end.iterations;
        NewtonEnd { iterations, ..end }
    };
    let by_prediction = predicted.map(|predicted| solved_from(&predicted, x));
    let mut end = match by_prediction {
        Some(end) if end.status == NewtonStatus::Converged => end,
        _ => solved_from(&start, x),
    };
    let full = system.friction();
    if full.iter().all(|f| *f <= FIRST_FRICTION) {
        return end;
    }
    for growth in FRICTION_GROWTHS {
        if end.status == NewtonStatus::Converged {
            break;
        }
        let mut y = start.clone();
        let last = with_growing_friction(system, &mut y, &full, growth, options);
        system.most_friction = f64::INFINITY;
        end.iterations += last.iterations;
        if last.status == NewtonStatus::Converged {
            x.copy_from_slice(&y);
            end = NewtonEnd {
                iterations: end.iterations,
                ..last
            };
        }
    }
    end
}

/// Solves with the coefficients at most `FIRST_FRICTION`, then `growth` times that, and so on up to
/// `full`. Ends at the first that does not converge.
fn with_growing_friction(
    system: &mut StaticSystem<'_>,
    x: &mut [f64],
    full: &[f64],
    growth: f64,
    options: NewtonOptions,
) -> NewtonEnd {
    let mut most = FIRST_FRICTION;
    let mut iterations = 0;
    system.most_friction = most;
    loop {
        let end = newton(system, x, options);
        iterations += end.iterations;
        if end.status != NewtonStatus::Converged || full.iter().all(|f| *f <= most) {
            return NewtonEnd { iterations, ..end };
        }
        most *= growth;
        let next: Vec<f64> = full.iter().map(|f| f.min(most)).collect();
        system.predict(x, &next);
        system.most_friction = most;
    }
}

struct StaticSystem<'a> {
    problem: &'a Problem,
    eps: &'a [f64],
    /// Load of this step, N.
    load: Vec<f64>,
    /// Law of each pair in this step: interference grows on the first leg.
    laws: Vec<PairLaw>,
    /// Upper limit of the coefficients of friction.
    most_friction: f64,
    /// State of each pair at the end of the last step ([`PredictedLaw::state_at_rest`]), from the
    /// first step on.
    at_rest: Vec<State>,
    /// Force that residuals of this step are relative to, N.
    scale: f64,
    linear: LinearSystem,
    /// Displacements x of the last elastic forces, m, and these, N.
    elastic: [Vec<f64>; 2],
    /// Coarse problem of J at some earlier x.
    coarse: Option<Coarse>,
    refresh: RefreshPolicy,
}

impl<'a> StaticSystem<'a> {
    /// System without load and without slip; with a retention, the motions that nothing holds are
    /// retained.
    fn new(
        problem: &'a Problem,
        inexact: &Arc<Inexact>,
        eps: &'a [f64],
        retention: Option<&Retention>,
    ) -> Self {
        let n = problem.reduced.stiffness.nrows();
        Self {
            problem,
            eps,
            load: vec![0.0; n],
            laws: problem.laws.clone(),
            most_friction: f64::INFINITY,
            at_rest: Vec::new(),
            scale: 1.0,
            linear: LinearSystem {
                inexact: Arc::clone(inexact),
                harmonics: vec![],
                derivatives: PairDerivatives::new(1, 0),
                retention: retention.cloned(),
                eps: eps.iter().map(|v| *v as f32).collect(),
            },
            elastic: [vec![], vec![]],
            coarse: None,
            refresh: RefreshPolicy::default(),
        }
    }

    /// Applies the load along the path. The way ends at a point at which nothing holds the bodies.
    fn load_up(
        mut self,
        start: Start<'_>,
        path: &LoadPath,
        holding: &Holding<'_>,
        options: NewtonOptions,
    ) -> StaticState {
        let n = self.eps.len();
        let mut forces = vec![[0.0; 3]; n / 3];
        let mut x = match start {
            Start::Unloaded => vec![0.0; n],
            Start::ClearancesClosed => with_clearances_closed(self.problem, self.eps),
            Start::After(PairsAtRest { x, lambda }) => {
                let carried = forces.iter_mut().zip(lambda.chunks_exact(3));
                carried.for_each(|(force, lambda)| force.copy_from_slice(lambda));
                x.to_vec()
            }
        };
        let mut end = NewtonEnd {
            status: NewtonStatus::Converged,
            iterations: 0,
            measure: 0.0,
            residuals: Vec::new(),
        };
        let stations = path.stations(&self.problem.reduced);
        let scale = force_scale_n(self.problem, self.eps, &stations);
        let (mut on_path, mut outcome) = (Vec::new(), None);
        'path: for (leg, ends) in stations.windows(2).enumerate() {
            // Between two steps the state mostly moves as it did in the step before: in proportion to
            // the load where pairs without clearance slide.
            let mut before: Option<Vec<f64>> = None;
            for step in 1..=path.steps {
                let share = step as f64 / path.steps as f64;
                let interference = if leg == 0 { share } else { 1.0 };
                let both = ends[0].iter().zip(&ends[1]);
                self.load = both.map(|(a, b)| (1.0 - share) * a + share * b).collect();
                self.scale = scale.max(norm(&self.load));
                self.begin_step(interference, &x, &forces);
                let moved_on = |before: Vec<f64>| {
                    let both = x.iter().zip(before);
                    both.map(|(x, before)| 2.0 * x - before).collect()
                };
                let predicted = before.map(moved_on);
                before = Some(x.clone());
                let last = load_step(&mut self, &mut x, predicted, options);
                end = NewtonEnd {
                    iterations: end.iterations + last.iterations,
                    ..last
                };
                if end.status != NewtonStatus::Converged {
                    break 'path;
                }
                let reached = self.pairs(&x).into_iter();
                forces = reached.map(|pair| pair.force).collect();
            }
            if leg < path.points.len() {
                on_path.push(x.clone());
                let mut pairs = self.pairs(&x).into_iter();
                let is_open = pairs.all(|pair| pair.state.contact == Contact::Open);
                if is_open && norm(&self.load) > 0.0 && !holding.without_contact() {
                    outcome = Some(Outcome::NothingHolds);
                    break;
                }
            }
        }
        let mut state = self.state(x, end);
        let is_at_end = outcome.is_none() && state.outcome.is_converged();
        state.ended_at = match is_at_end {
            true => None,
            false if outcome.is_some() => on_path.len().checked_sub(1),
            // The next point was not reached.
            false => Some(on_path.len()).filter(|point| *point < path.points.len()),
        };
        state.outcome = outcome.unwrap_or(state.outcome);
        state.on_path = on_path;
        state
    }

    /// Begins a load step at `x` with these forces of the pairs, and this share of the interference.
    fn begin_step(&mut self, interference: f64, x: &[f64], forces: &[[f64; 3]]) {
        for (law, pair) in self.laws.iter_mut().zip(&self.problem.laws) {
            law.gap_m = pair.gap_m.max(interference * pair.gap_m);
        }
        let state = |(pair, force): (usize, &[f64; 3])| {
            let t = 3 * pair + 1;
            let law = self.law(pair);
            law.state_at_rest([x[t], x[t + 1]], [force[1], force[2]])
        };
        self.at_rest = forces.iter().enumerate().map(state).collect();
    }

    /// Law of a pair in this step.
    fn law(&self, pair: usize) -> PredictedLaw {
        let eps = [self.eps[3 * pair], self.eps[3 * pair + 1]];
        self.laws[pair].predicted(eps, self.most_friction)
    }

    /// Coefficient of friction of each pair.
    fn friction(&self) -> Vec<f64> {
        let pairs = 0..self.laws.len();
        pairs.map(|pair| self.law(pair).friction).collect()
    }

    /// Each pair at `x`.
    fn pairs(&mut self, x: &[f64]) -> Vec<Instant> {
        let lambda_u = self.lambda_u(x);
        self.at(&lambda_u)
    }

    /// Each pair under the predicted force.
    fn at(&self, lambda_u: &[f64]) -> Vec<Instant> {
        let pairs = self.at_rest.iter().enumerate();
        pairs
            .map(|(pair, state)| {
                let law = self.law(pair);
                let own = [0, 1, 2].map(|c| lambda_u[3 * pair + c]);
                law.evaluate(law.prediction(own), *state)
            })
            .collect()
    }

    /// Contact forces and status of all pairs at `x`, where the last load step ended.
    fn state(mut self, x: Vec<f64>, end: NewtonEnd) -> StaticState {
        let (mut lambda, mut status) = (vec![], vec![]);
        for pair in self.pairs(&x) {
            lambda.extend(pair.force);
            status.push(match pair.state.contact {
                Contact::Stick => PairStatus::Stuck,
                Contact::Slip => PairStatus::Slipping,
                Contact::Open => PairStatus::Open,
            });
        }
        let retention = self.linear.retention.as_ref();
        StaticState {
            outcome: Outcome::from(end.status),
            retention_n: retention.map(|r| r.force_n(&x, &vec![0.0; x.len()])),
            x,
            lambda,
            status,
            newton_iterations: end.iterations,
            residual: end.measure,
            linear: LinearReference::stuck(&self.problem.reduced),
            on_path: Vec::new(),
            ended_at: None,
        }
    }

    /// Moves a solution to where it is expected once the coefficients are `next`: along a straight
    /// line in 1 / mu, which the normal force of a pair that slides under a given shear follows.
    fn predict(&mut self, x: &mut [f64], next: &[f64]) {
        let mut change = vec![0.0; x.len()];
        for (pair, instant) in self.pairs(x).into_iter().enumerate() {
            let law = self.law(pair);
            let (now, next) = (law.friction, next[pair]);
            if instant.state.contact == Contact::Slip && next > 0.0 {
                let [e1, e2] = law.slip_tangent(instant.trial).direction;
                let force = -instant.trial[0] * now * (next - now) / next;
                change[3 * pair + 1] = force * e1;
                change[3 * pair + 2] = force * e2;
            }
        }
        let mut dx = vec![0.0; x.len()];
        self.linearise(x);
        if self.correction(&change, 0.0, &mut dx).is_some() {
            x.iter_mut().zip(&dx).for_each(|(x, d)| *x += d);
        }
    }

    /// Predicted force F - K x + eps x. The stiffness K is read once for an x.
    fn lambda_u(&mut self, x: &[f64]) -> Vec<f64> {
        let n = x.len();
        let [at, forces] = &mut self.elastic;
        if at != x {
            x.clone_into(at);
            *forces = vec![0.0; n];
            add_symmetric_product(
                self.problem.reduced.stiffness.as_ref(),
                MatRef::from_column_major_slice(x, n, 1),
                MatMut::from_column_major_slice_mut(forces, n, 1),
            );
            if let Some(retention) = &self.linear.retention {
                retention.add_to(x, forces);
            }
        }
        let forces = forces.iter().enumerate();
        forces
            .map(|(i, force)| self.load[i] - force + self.eps[i] * x[i])
            .collect()
    }

    /// Dense Jacobian J = K - D (K - eps).
    fn jacobian(&self) -> Mat<f64> {
        let mut jacobian = self.problem.reduced.stiffness.clone();
        if let Some(retention) = &self.linear.retention {
            retention.add_to_matrix(&mut jacobian);
        }
        for (j, eps) in self.eps.iter().enumerate() {
            let column = jacobian.col_as_slice_mut(j);
            for (pair, column) in column.chunks_exact_mut(3).enumerate() {
                let d = |r: usize, c: usize| f64::from(self.linear.derivatives.entry(pair, [r, c]));
                let mut difference = [column[0], column[1], column[2]];
                if j / 3 == pair {
                    difference[j % 3] -= eps;
                }
                for (r, c) in column.iter_mut().enumerate() {
                    let moved = (0..3).map(|c| d(r, c) * difference[c]);
                    *c -= moved.sum::<f64>();
                }
            }
        }
        jacobian
    }
}

impl NonlinearSystem for StaticSystem<'_> {
    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        // f = K x + lambda - F = eps x - lambda_u + lambda.
        let lambda_u = self.lambda_u(x);
        for (pair, instant) in self.at(&lambda_u).into_iter().enumerate() {
            for (c, force) in instant.force.iter().enumerate() {
                let i = 3 * pair + c;
                f[i] = self.eps[i] * x[i] - lambda_u[i] + force;
            }
        }
    }

    fn measure(&self, f: &[f64]) -> f64 {
        norm(f) / self.scale
    }

    fn linearise(&mut self, x: &[f64]) {
        self.linear.derivatives.clear();
        for (pair, instant) in self.pairs(x).into_iter().enumerate() {
            let law = self.law(pair);
            if law.is_rigid && instant.state.contact == Contact::Stick {
                self.linear.derivatives.push_identity();
                continue;
            }
            let derivative = law.derivative(&instant);
            let entry = |i: usize, j: usize| derivative[i][j] as f32;
            self.linear.derivatives.push(entry);
        }
        if self.coarse.is_none() || self.refresh.is_due() {
            self.coarse = Coarse::new(&self.linear, 0);
            self.refresh = RefreshPolicy::default();
        }
    }

    fn correction(&mut self, f: &[f64], _: f64, dx: &mut [f64]) -> Option<f64> {
        let right: Vec<f64> = f.iter().map(|f| -f).collect();
        let is_small = f.len() <= MOST_DENSE_UNKNOWNS;
        let mut solved = !is_small || self.linear.derivatives.largest() <= STEEPEST;
        let mut unsolved = 0.0;
        if solved {
            let (solution, end) = two_level::solve(
                &self.linear,
                self.coarse.as_ref(),
                None,
                &right,
                1.0,
                KRYLOV_TOLERANCE,
                MOST_KRYLOV_ITERATIONS,
            );
            dx.copy_from_slice(&solution);
            self.refresh.record(end.iterations);
            solved = end.converged || !is_small;
            unsolved = end.relative_residual;
        }
        if !solved {
            unsolved = 0.0;
            dx.copy_from_slice(&right);
            Lu::new(self.jacobian()).solve_column_in_place(dx);
        }
        // A direction that is not exact still serves: the step is judged afterwards.
        dx.iter().all(|d| d.is_finite()).then_some(unsolved)
    }

    fn length(&self, dx: &[f64]) -> f64 {
        norm(dx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{assert_solves, mixed, problem};
    use crate::dlft::retention::Mean;
    use dovetail_testkit::differences::{assert_close, central};

    /// Predicted forces of three pairs that stick, three that slip and three that are open, all far
    /// from a change of status; the coefficients are between 0.3 and 0.7.
    const TRIALS: [[f64; 3]; 9] = [
        [-10.0, 0.3, -0.2],
        [-1.0, 0.9, -1.4],
        [2.0, 1.0, 1.0],
        [-10.0, -0.5, 0.0],
        [-2.0, -1.9, 0.4],
        [3.0, 0.0, -1.0],
        [-8.0, 0.1, 0.6],
        [-0.5, 0.2, 3.0],
        [1.0, -2.0, 0.0],
    ];

    /// A system and a point x at which its pairs have those predicted forces.
    fn with_system(mean: Mean, check: impl Fn(&mut StaticSystem<'_>, &[f64])) {
        let problem = problem(TRIALS.len());
        let n = problem.reduced.stiffness.nrows();
        let eps: Vec<f64> = problem
            .reduced
            .diagonal_stiffness()
            .iter()
            .map(|v| 1.3 * v)
            .collect();
        let all: Vec<usize> = (0..TRIALS.len()).collect();
        let inexact = InexactModel::new(&problem.reduced).taking_part(&all, None);
        let retention =
            (mean == Mean::Retained).then(|| Retention::new(&problem.reduced.stiffness, &eps));
        assert!(retention.as_ref().is_none_or(Retention::is_needed));
        let mut system = StaticSystem::new(&problem, &inexact, &eps, retention.as_ref());
        let state = |pair: &usize| State {
            contact: Contact::Stick,
            slid_n: [mixed(*pair, 7), mixed(*pair, 8)],
        };
        system.at_rest = all.iter().map(state).collect();
        system.scale = 1.0;
        let x: Vec<f64> = (0..n).map(|i| 0.1 * mixed(i, 9)).collect();
        let without_load = system.pairs(&x).into_iter().flat_map(|pair| pair.trial);
        system.load = without_load
            .zip(TRIALS.iter().flatten())
            .enumerate()
            .map(|(i, (without, wanted))| (wanted - without) / system.law(i / 3).shares[i % 3])
            .collect();
        check(&mut system, &x);
    }

    #[test]
    fn a_coefficient_of_friction_above_the_most_counts_as_the_most() {
        let options = NewtonOptions::new(1e-10, 50);
        let [at_most, above] = [1.0, 1e3].map(|times| {
            let mut problem = problem(1);
            problem.laws = vec![PairLaw::rigid(times * PairLaw::MOST_FRICTION, 0.0)];
            // Sticks with a coefficient above 1e5.
            problem.reduced.static_load.on_x = vec![-1e-5, 0.0, 1.0];
            static_state(&problem, 1, options)
        });
        assert_eq!(at_most.outcome, Outcome::Converged);
        assert_eq!(at_most.status, [PairStatus::Slipping]);
        assert_eq!(at_most.lambda, above.lambda);
    }

    fn differences(system: &mut StaticSystem<'_>, x: &[f64]) -> Mat<f64> {
        central(x, 1e-6, |x| {
            let mut f = vec![0.0; x.len()];
            system.residual(x, &mut f);
            f
        })
    }

    #[test]
    fn the_dense_jacobian_is_that_by_differences() {
        for mean in [Mean::Free, Mean::Retained] {
            with_system(mean, |system, x| {
                let found: Vec<Contact> = system.pairs(x).iter().map(|p| p.state.contact).collect();
                let each = [Contact::Stick, Contact::Slip, Contact::Open];
                assert_eq!(found, [each, each, each].concat());
                let by_differences = differences(system, x);
                system.linearise(x);
                // The derivatives of the law are in single precision.
                let what = format!("mean {mean:?}");
                assert_close(&system.jacobian(), &by_differences, 2e-6, &what);
            });
        }
    }

    #[test]
    fn corrections_solve_with_the_jacobian_by_differences() {
        for mean in [Mean::Free, Mean::Retained] {
            with_system(mean, |system, x| {
                let by_differences = differences(system, x);
                system.linearise(x);
                assert_solves(
                    system,
                    by_differences,
                    [0.0, 5e-4],
                    &format!("mean {mean:?}"),
                );
            });
        }
    }
}
