//! Equilibrium of one load step: its residual, its Jacobian, and the corrections of Newton's method.

use crate::contact::coulomb::Contact;
use crate::contact::{Instant, PairLaw, PairState, PredictedLaw};
use crate::dlft::coarse::Coarse;
use crate::dlft::linear_system::{LinearSystem, PairDerivatives};
use crate::dlft::retention::Retention;
use crate::dlft::two_level;
use crate::dlft::{Outcome, PairStatus, StaticState};
use crate::problem::inexact::Inexact;
use crate::problem::{LinearReference, Problem};
use dovetail_numerics::dense::{Lu, add_symmetric_product};
use dovetail_numerics::krylov::RefreshPolicy;
use dovetail_numerics::nonlinear::{NewtonEnd, NonlinearSystem};
use dovetail_numerics::vector::norm;
use faer::{Mat, MatMut, MatRef};
use std::sync::Arc;

/// Relative residual of the linear solves.
const KRYLOV_TOLERANCE: f64 = 1e-4;
const MOST_KRYLOV_ITERATIONS: usize = 300;
/// Largest size at which a Jacobian that GMRES does not solve is factored.
const MOST_DENSE_UNKNOWNS: usize = 6000;
/// A Jacobian is also factored where shear follows the normal force by more than this: what it then
/// asks of the normal forces is beyond single precision, and is not local.
const STEEPEST: f32 = 3.0;

/// Equilibrium of the pairs under the load of a step, which keeps where they were at rest before.
pub(super) struct StaticSystem {
    pub(super) problem: Problem,
    pub(super) eps: Vec<f64>,
    /// Load of this step, N.
    pub(super) load: Vec<f64>,
    /// Law of each pair in this step: interference grows on the first leg.
    laws: Vec<PairLaw>,
    /// Upper limit of the coefficients of friction.
    pub(super) most_friction: f64,
    /// State of each pair at the end of the last step ([`PredictedLaw::state_at_rest`]), from the
    /// first step on.
    at_rest: Vec<PairState>,
    /// Force that residuals of this step are relative to, N.
    pub(super) scale: f64,
    linear: LinearSystem,
    /// Displacements x of the last elastic forces, m, and these, N.
    elastic: [Vec<f64>; 2],
    /// Coarse problem of J at some earlier x.
    coarse: Option<Coarse>,
    refresh: RefreshPolicy,
}

impl StaticSystem {
    /// System without load and without slip; with a retention, the motions that nothing holds are
    /// retained.
    pub(super) fn new(
        problem: &Problem,
        inexact: &Arc<Inexact>,
        eps: &[f64],
        retention: Option<&Retention>,
    ) -> Self {
        let n = problem.reduced.stiffness.nrows();
        Self {
            problem: problem.clone(),
            eps: eps.to_vec(),
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

    /// Begins a load step at `x` with these forces of the pairs, and this share of the interference.
    pub(super) fn begin_step(&mut self, interference: f64, x: &[f64], forces: &[[f64; 3]]) {
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
    pub(super) fn friction(&self) -> Vec<f64> {
        let pairs = 0..self.laws.len();
        pairs.map(|pair| self.law(pair).friction).collect()
    }

    /// Each pair at `x`.
    pub(super) fn pairs(&mut self, x: &[f64]) -> Vec<Instant> {
        let lambda_u = self.lambda_u(x);
        self.instants(&lambda_u)
    }

    /// Each pair under the predicted force.
    fn instants(&self, lambda_u: &[f64]) -> Vec<Instant> {
        let pairs = self.at_rest.iter().enumerate();
        pairs
            .map(|(pair, state)| {
                let law = self.law(pair);
                let pair_lambda_u = [0, 1, 2].map(|c| lambda_u[3 * pair + c]);
                law.evaluate(law.prediction(pair_lambda_u), || None, *state)
            })
            .collect()
    }

    /// Contact forces and status of all pairs at `x`, where the last load step ended.
    pub(super) fn state(mut self, x: Vec<f64>, end: NewtonEnd) -> StaticState {
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
    pub(super) fn predict(&mut self, x: &mut [f64], next: &[f64]) {
        let mut change = vec![0.0; x.len()];
        for (pair, instant) in self.pairs(x).into_iter().enumerate() {
            let law = self.law(pair);
            let (now, next) = (law.friction, next[pair]);
            if instant.state.contact == Contact::Slip && next > 0.0 {
                let [e1, e2] = law.slip_tangent(instant.trial, None).direction;
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

impl NonlinearSystem for StaticSystem {
    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        // f = K x + lambda - F = eps x - lambda_u + lambda.
        let lambda_u = self.lambda_u(x);
        for (pair, instant) in self.instants(&lambda_u).into_iter().enumerate() {
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
    use crate::dlft::static_state::static_state;
    use crate::problem::inexact::InexactModel;
    use dovetail_numerics::nonlinear::NewtonOptions;
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
    fn system_at(mean: Mean) -> (StaticSystem, Vec<f64>) {
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
        let state = |pair: &usize| PairState {
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
        (system, x)
    }

    #[test]
    fn a_coefficient_of_friction_above_the_most_counts_as_the_most() {
        let options = NewtonOptions::new(1e-10, 50);
        let [at_most, above] = [1.0, 1e3].map(|times| {
            let mut problem = problem(1);
            problem.laws = vec![PairLaw::rigid(times * PairLaw::MOST_FRICTION, 0.0)];
            // Sticks with a coefficient above 1e5.
            problem.reduced_mut().static_load.on_x = vec![-1e-5, 0.0, 1.0];
            static_state(&problem, 1, options)
        });
        assert_eq!(at_most.outcome, Outcome::Converged);
        assert_eq!(at_most.status, [PairStatus::Slipping]);
        assert_eq!(at_most.lambda, above.lambda);
    }

    fn differences(system: &mut StaticSystem, x: &[f64]) -> Mat<f64> {
        central(x, 1e-6, |x| {
            let mut f = vec![0.0; x.len()];
            system.residual(x, &mut f);
            f
        })
    }

    #[test]
    fn the_dense_jacobian_is_that_by_differences() {
        for mean in [Mean::Free, Mean::Retained] {
            let (mut system, x) = system_at(mean);
            let found: Vec<Contact> = system.pairs(&x).iter().map(|p| p.state.contact).collect();
            let each = [Contact::Stick, Contact::Slip, Contact::Open];
            assert_eq!(found, [each, each, each].concat());
            let by_differences = differences(&mut system, &x);
            system.linearise(&x);
            // The derivatives of the law are in single precision.
            let what = format!("mean {mean:?}");
            assert_close(&system.jacobian(), &by_differences, 2e-6, &what);
        }
    }

    #[test]
    fn corrections_solve_with_the_jacobian_by_differences() {
        for mean in [Mean::Free, Mean::Retained] {
            let (mut system, x) = system_at(mean);
            let by_differences = differences(&mut system, &x);
            system.linearise(&x);
            let what = format!("mean {mean:?}");
            assert_solves(&mut system, by_differences, [0.0, 5e-4], &what);
        }
    }
}
