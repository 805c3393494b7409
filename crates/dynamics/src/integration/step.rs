//! One time step: Moreau's scheme with the trapezoidal rule.
//!
//! With X+ = X + h (V + V+)/2 and the equations of motion at the mean of both ends of the step, the
//! mean velocity Vm = (V + V+)/2 follows from (q eliminated; s = 2/h, c = s + b, all diagonal in
//! the modes)
//!
//! ```text
//! d = c + (a + h/2) w^2
//! S Vm = F + s (M V + p q') - K X - c p (fm + s (q' + p^T V) - w^2 q) / d - lambda
//! S = c M + (a + h/2) K - c^2 p p^T / d
//! q'm = (fm + s (q' + p^T V) - w^2 q - c p^T Vm) / d
//! ```
//!
//! A stuck mode with a damping ratio zeta of its own has c = s + 2 zeta w and a = 0 in its terms, and
//! S has (2 zeta w - b) p p^T besides. Dashpots of the coefficients k on the displacements
//! x . X + y . q have the forces, with G = x - p (c / d) y,
//!
//! ```text
//! T = (1 + k y^T y / d)^-1 k
//! r = T (G^T Vm + y^T (fm + s (q' + p^T V) - w^2 q) / d)
//! ```
//!
//! which act on the pairs and the modes: S has G T G^T besides.
//!
//! S is constant. lambda is the mean contact force of the step. It follows the contact law together
//! with velocities near the end of the step:
//!
//! * N: V+ >= -gap / h, or V+ >= 0 where there is no gap: a gap closes within a step and not
//!   faster, and no impact rebounds. The penetration of a landing pair within its step is corrected
//!   at once.
//! * T: (V+ + k V) / (1 + k), k = 2/3. With k = 0 friction would lag by half a step, which turns
//!   its phase; with k = 1 a pair that stops would go on to and fro for ever. With 2/3 the lag is a
//!   tenth of a step, and the remaining velocity of a pair that stops falls by k at every step.
//!
//! A pair with springs of stiffness kappa touches at a point at w while the mean displacement of
//! the step is Xm = X + h (V + V+)/4. Its law is that of the motion of that point in the step,
//! Xm - lambda / kappa - w (N: w = -gap), here as a velocity, times 4/h:
//! `V+ + V + 4 (X - w) / h - 4 lambda / (kappa h)`. The springs return the energy that they store.
//!
//! The trapezoidal rule itself dissipates nothing: except for the penetration of landing pairs,
//! input = damping + contact work, step by step.
//!
//! **Fitted step.** With h = (2/w) tan(w t_step / 2) in the place of t_step, differing by
//! (w t_step)^2/12, the rule is exact for motion at the frequency w of the excitation: a resonance
//! is not shifted by the step, however light its damping.

use super::IntegrationError;
use super::contact_forces::{ContactEnd, ContactProblem};
use crate::contact::PairLaw;
use crate::damping::Rayleigh;
use crate::problem::Problem;
use crate::reduced::{Dashpots, Load, ReducedModel};
use dovetail_numerics::dense::{Lu, add_product, product, symmetrised};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use std::f64::consts::TAU;

/// Weight k of the tangential velocity at the start of a step, relative to that at its end.
const START_SHARE: f64 = 2.0 / 3.0;
/// Fewest steps of a period.
pub const LEAST_STEPS: usize = 16;
/// Most steps of a period: with more, a step is lost in the rounding of the motion.
pub const MOST_STEPS: usize = 1_000_000;

/// Displacements and velocities of pairs (3 each) and stuck modes, and the contact forces of the
/// last step.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionState {
    /// Relative displacements X, m.
    pub x: Vec<f64>,
    /// Relative velocities X', m/s.
    pub v: Vec<f64>,
    /// Amplitudes of the stuck modes.
    pub q: Vec<f64>,
    /// Rates of the modal amplitudes.
    pub q_rate: Vec<f64>,
    /// Mean contact force of the step that led here, N.
    pub lambda: Vec<f64>,
    /// Positions of the points that touch, for pairs with springs, m.
    pub touching: Vec<f64>,
}

impl MotionState {
    /// State at rest at `x` under `lambda`, with the stuck modes deflected by the static load.
    pub fn resting(problem: &Problem, x: &[f64], lambda: &[f64]) -> Self {
        let on_modes = problem.reduced.static_load.on_modes.iter();
        Self {
            x: x.to_vec(),
            v: vec![0.0; x.len()],
            q: on_modes
                .zip(&problem.reduced.omega2)
                .map(|(f, w2)| f / w2)
                .collect(),
            q_rate: vec![0.0; problem.reduced.omega2.len()],
            lambda: lambda.to_vec(),
            touching: touching(problem, x, lambda),
        }
    }

    /// Returns `true` if all numbers are finite.
    pub(crate) fn is_finite(&self) -> bool {
        [&self.x, &self.v, &self.q, &self.q_rate]
            .iter()
            .all(|part| part.iter().all(|v| v.is_finite()))
    }
}

/// Work done in one step, J.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepWork {
    /// Work of the excitation.
    pub input_j: f64,
    /// Work spent by tangential contact forces.
    pub friction_j: f64,
    /// Work spent by normal contact forces: impacts.
    pub impact_j: f64,
    /// Work spent by viscous damping.
    pub viscous_j: f64,
}

/// Constants of all steps, and working space.
pub struct Stepper<'a> {
    problem: &'a Problem,
    damping: Rayleigh,
    steps: usize,
    omega_rad_s: f64,
    /// Fitted step, s.
    h: f64,
    /// Inverse S^-1.
    inverse: Mat<f64>,
    /// Transposed coupling p^T.
    coupling_t: Mat<f64>,
    /// Factor d of each mode.
    modal: Vec<f64>,
    /// Factor c of each mode.
    inertial: Vec<f64>,
    dashpots: Option<DashpotForces<'a>>,
    contact: ContactProblem,
    /// Products K X, M V and p^T V of the present state.
    kx: Vec<f64>,
    mv: Vec<f64>,
    pv: Vec<f64>,
}

/// Forces of the dashpots in a step.
struct DashpotForces<'a> {
    dashpots: &'a Dashpots,
    /// Directions G, n x dashpots.
    directions: Mat<f64>,
    /// Matrix y^T / d, dashpots x modes.
    divided: Mat<f64>,
    /// Matrix T.
    stiffness: Mat<f64>,
}

impl<'a> DashpotForces<'a> {
    /// Forces of dashpots between pairs with this coupling to modes of the factors c and d.
    fn new(dashpots: &'a Dashpots, coupling: &Mat<f64>, [c, d]: [&[f64]; 2]) -> Self {
        let (y, count) = (&dashpots.on_modes, dashpots.count());
        let divided = Mat::from_fn(count, d.len(), |j, m| y[(m, j)] / d[m]);
        let scaled = Mat::from_fn(d.len(), count, |m, j| c[m] * divided[(j, m)]);
        let (softness, k) = (
            product(divided.as_ref(), y.as_ref()),
            &dashpots.damping_n_s_m,
        );
        let diagonal = |i: usize, j: usize, value: f64| if i == j { value } else { 0.0 };
        let matrix = Mat::from_fn(count, count, |i, j| {
            diagonal(i, j, 1.0) + k[i] * softness[(i, j)]
        });
        let mut stiffness = Mat::from_fn(count, count, |i, j| diagonal(i, j, k[i]));
        Lu::new(matrix).solve_in_place(stiffness.as_mut());
        Self {
            directions: &dashpots.on_x - product(coupling.as_ref(), scaled.as_ref()),
            divided,
            stiffness: symmetrised(stiffness.as_ref()),
            dashpots,
        }
    }

    /// Forces at the mean velocities of a step, N; `known` are fm + s (q' + p^T V) - w^2 q.
    fn evaluate(&self, v: &[f64], known: &[f64]) -> Vec<f64> {
        let mut rates = vec![0.0; self.stiffness.nrows()];
        add_product(self.directions.transpose(), 1.0, v, &mut rates);
        add_product(self.divided.as_ref(), 1.0, known, &mut rates);
        let mut forces = vec![0.0; rates.len()];
        apply(&self.stiffness, &rates, &mut forces);
        forces
    }
}

/// Compliances 1 / kappa of the pairs, N, t1 and t2 of each, m/N; 0 for rigid contact.
fn compliances(problem: &Problem) -> Vec<f64> {
    let of = |law: &PairLaw| {
        law.stiffness.map_or([0.0; 3], |springs| {
            let along = 1.0 / springs.tangential_n_m;
            [1.0 / springs.normal_n_m, along, along]
        })
    };
    problem.laws.iter().flat_map(of).collect()
}

/// Positions of the points that touch while the pairs are displaced by `x` under `lambda`; in N
/// they are at the clearance.
pub(crate) fn touching(problem: &Problem, x: &[f64], lambda: &[f64]) -> Vec<f64> {
    let springs = compliances(problem).into_iter().zip(lambda);
    let moved = x.iter().zip(springs);
    let mut touching: Vec<f64> = moved.map(|(x, (c, lambda))| x - c * lambda).collect();
    for (normal, law) in touching.iter_mut().step_by(3).zip(&problem.laws) {
        *normal = -law.gap_m;
    }
    touching
}

impl<'a> Stepper<'a> {
    /// Stepper with `steps` steps per period of `frequency_hz`.
    ///
    /// # Errors
    /// A frequency that is not above 0, too few steps, or a singular step matrix.
    pub fn new(
        problem: &'a Problem,
        damping: Rayleigh,
        frequency_hz: f64,
        steps: usize,
    ) -> Result<Self, IntegrationError> {
        if !(frequency_hz > 0.0 && frequency_hz.is_finite()) {
            return Err(IntegrationError::Frequency { frequency_hz });
        }
        if steps < LEAST_STEPS {
            return Err(IntegrationError::Steps {
                steps,
                least: LEAST_STEPS,
            });
        }
        let omega_rad_s = TAU * frequency_hz;
        let h = 2.0 / omega_rad_s * (std::f64::consts::PI / steps as f64).tan();
        let c = 2.0 / h + damping.mass_per_s;
        let half = damping.stiffness_s + 0.5 * h;
        let ReducedModel {
            stiffness,
            mass,
            coupling,
            omega2,
            ..
        } = &*problem.reduced;
        let mut modal: Vec<f64> = omega2.iter().map(|w2| c + half * w2).collect();
        let mut inertial = vec![c; modal.len()];
        for (m, ratio) in problem.modal_ratios.iter().enumerate() {
            inertial[m] = 2.0 / h + 2.0 * ratio * omega2[m].sqrt();
            modal[m] = inertial[m] + 0.5 * h * omega2[m];
        }
        let n = stiffness.nrows();
        let mut matrix = Mat::from_fn(n, n, |i, j| c * mass[(i, j)] + half * stiffness[(i, j)]);
        let scaled = Mat::from_fn(n, modal.len(), |i, m| {
            let rate = inertial[m];
            rate * rate * coupling[(i, m)] / modal[m]
        });
        let coupling_t = coupling.transpose();
        matmul(&mut matrix, Accum::Add, &scaled, coupling_t, -1.0, Par::Seq);
        let of_ratios = coupling.col_iter().zip(&inertial);
        for (p, own) in of_ratios.take(problem.modal_ratios.len()) {
            matrix += Mat::from_fn(n, n, |i, j| (own - c) * p[i] * p[j]);
        }
        let dashpots = (problem.reduced.dashpots.count() > 0)
            .then(|| DashpotForces::new(&problem.reduced.dashpots, coupling, [&inertial, &modal]));
        if let Some(forces) = &dashpots {
            let held = product(forces.directions.as_ref(), forces.stiffness.as_ref());
            let onto = forces.directions.transpose();
            matmul(&mut matrix, Accum::Add, &held, onto, 1.0, Par::Seq);
        }
        let mut inverse = Mat::<f64>::identity(n, n);
        Lu::new(matrix).solve_in_place(inverse.as_mut());
        let inverse = symmetrised(inverse.as_ref());
        let positive = (0..n).all(|i| inverse[(i, i)] > 0.0 && inverse[(i, i)].is_finite());
        if !positive {
            return Err(IntegrationError::Singular { frequency_hz });
        }
        let friction = problem.laws.iter().map(PairLaw::computed_friction);
        // V+ = 2 Vm - V.
        let mut delassus = Mat::from_fn(n, n, |i, j| 2.0 * inverse[(i, j)]);
        for (i, compliance) in compliances(problem).into_iter().enumerate() {
            delassus[(i, i)] += 4.0 / h * compliance;
        }
        Ok(Self {
            problem,
            damping,
            steps,
            omega_rad_s,
            h,
            inverse,
            coupling_t: coupling_t.to_owned(),
            contact: ContactProblem::new(delassus, friction.collect()),
            kx: vec![0.0; n],
            mv: vec![0.0; n],
            pv: vec![0.0; modal.len()],
            modal,
            inertial,
            dashpots,
        })
    }

    /// Problem that is integrated.
    pub(crate) fn problem(&self) -> &'a Problem {
        self.problem
    }

    /// Number of steps in a period.
    pub(crate) fn steps(&self) -> usize {
        self.steps
    }

    /// Frequency of the excitation's harmonic 1.
    pub(crate) fn frequency_hz(&self) -> f64 {
        self.omega_rad_s / TAU
    }

    /// Prepares for a state that does not come from [`Stepper::advance`].
    pub(crate) fn prepare(&mut self, state: &MotionState) {
        apply(&self.problem.reduced.stiffness, &state.x, &mut self.kx);
        apply(&self.problem.reduced.mass, &state.v, &mut self.mv);
        apply(&self.coupling_t, &state.v, &mut self.pv);
    }

    /// Load at the phase of step `step`, without the static part.
    fn vibrating_load(&self, step: usize) -> Load {
        let mut load = Load::zeros(self.kx.len(), self.modal.len());
        for excitation in &self.problem.excitations {
            let phase = (excitation.harmonic * step) % self.steps;
            let strength = excitation.factor(self.omega_rad_s);
            let (s, c) = (TAU * phase as f64 / self.steps as f64).sin_cos();
            load.add(strength * c, &excitation.cosine);
            load.add(strength * s, &excitation.sine);
        }
        load
    }

    /// Advances `state` from step `step` of a period to the next.
    ///
    /// # Errors
    /// The residual of the contact forces, where they were not found.
    pub(crate) fn advance(
        &mut self,
        state: &mut MotionState,
        step: usize,
    ) -> Result<StepWork, f64> {
        let (problem, h) = (self.problem, self.h);
        let load = self.mean_load(step);
        let known = self.modal_right_side(state, &load.on_modes);
        let free = self.velocity_without_contact(state, &load.on_x, &known);
        let mut offset: Vec<f64> = state.v.iter().map(|v| START_SHARE * v).collect();
        for (pair, law) in problem.laws.iter().enumerate() {
            if law.stiffness.is_none() {
                offset[3 * pair] = (state.x[3 * pair] + law.gap_m).max(0.0) / h;
                continue;
            }
            let rows = 3 * pair..3 * pair + 3;
            for (i, offset) in rows.clone().zip(&mut offset[rows]) {
                *offset = state.v[i] + 4.0 / h * (state.x[i] - state.touching[i]);
            }
        }
        let mut middle: Vec<f64> = state.x.iter().map(|x| 0.5 * x).collect();
        let mut v = vec![0.0; state.v.len()];
        match self
            .contact
            .solve(&free, &offset, &mut state.lambda, &mut v)
        {
            ContactEnd::Solved => {}
            ContactEnd::NotSolved { residual } => return Err(residual),
        }
        // The springs do not belong to the motion.
        for (i, compliance) in compliances(problem).into_iter().enumerate() {
            v[i] += 4.0 / h * compliance * state.lambda[i];
        }
        let mut pv = vec![0.0; self.modal.len()];
        apply(&self.coupling_t, &v, &mut pv);
        let rates = self.mean_rates(&state.v, &v, &pv, &known);
        for (x, v) in state.x.iter_mut().zip(&rates.v) {
            *x += h * v;
        }
        for (pair, law) in problem.laws.iter().enumerate() {
            if law.stiffness.is_none() {
                state.x[3 * pair] = state.x[3 * pair].max(-law.gap_m);
            }
        }
        middle
            .iter_mut()
            .zip(&state.x)
            .for_each(|(m, x)| *m += 0.5 * x);
        state.touching = touching(problem, &middle, &state.lambda);
        state.v = v;
        for ((q, rate), mean) in state.q.iter_mut().zip(&mut state.q_rate).zip(&rates.q) {
            *q += h * mean;
            *rate = 2.0 * mean - *rate;
        }
        self.pv = pv;
        let before = [self.kx.clone(), self.mv.clone()];
        apply(&problem.reduced.stiffness, &state.x, &mut self.kx);
        apply(&problem.reduced.mass, &state.v, &mut self.mv);
        Ok(self.work(&load, &state.lambda, &rates, &before))
    }

    /// Mean of the vibrating load over a step.
    fn mean_load(&self, step: usize) -> Load {
        let (before, after) = (self.vibrating_load(step), self.vibrating_load(step + 1));
        Load::new(
            mean(&before.on_x, &after.on_x),
            mean(&before.on_modes, &after.on_modes),
        )
    }

    /// Computes fm + s (q' + p^T V) - w^2 q.
    fn modal_right_side(&self, state: &MotionState, modal_force: &[f64]) -> Vec<f64> {
        let (problem, s) = (self.problem, 2.0 / self.h);
        (0..self.modal.len())
            .map(|m| {
                problem.reduced.static_load.on_modes[m]
                    + modal_force[m]
                    + s * (state.q_rate[m] + self.pv[m])
                    - problem.reduced.omega2[m] * state.q[m]
            })
            .collect()
    }

    /// Velocity V+ with lambda = 0.
    fn velocity_without_contact(
        &self,
        state: &MotionState,
        force: &[f64],
        known: &[f64],
    ) -> Vec<f64> {
        let problem = self.problem;
        let s = 2.0 / self.h;
        let n = state.x.len();
        let on_modes: Vec<f64> = (0..self.modal.len())
            .map(|m| s * state.q_rate[m] - self.inertial[m] * known[m] / self.modal[m])
            .collect();
        let mut right: Vec<f64> = (0..n)
            .map(|i| problem.reduced.static_load.on_x[i] + force[i] + s * self.mv[i] - self.kx[i])
            .collect();
        add_product(
            problem.reduced.coupling.as_ref(),
            1.0,
            &on_modes,
            &mut right,
        );
        if let Some(forces) = &self.dashpots {
            let still = forces.evaluate(&vec![0.0; n], known);
            add_product(forces.directions.as_ref(), -1.0, &still, &mut right);
        }
        let mut free = vec![0.0; n];
        apply(&self.inverse, &right, &mut free);
        for (f, v) in free.iter_mut().zip(&state.v) {
            *f = 2.0 * *f - v;
        }
        free
    }

    /// Mean rates Vm and q'm, from the velocities at both ends of the step.
    fn mean_rates(&self, v_start: &[f64], v_end: &[f64], pv_end: &[f64], known: &[f64]) -> Rates {
        let pv = mean(&self.pv, pv_end);
        let v = mean(v_start, v_end);
        let mut q: Vec<f64> = (0..self.modal.len())
            .map(|m| (known[m] - self.inertial[m] * pv[m]) / self.modal[m])
            .collect();
        if let Some(forces) = &self.dashpots {
            let held = forces.evaluate(&v, known);
            add_product(forces.divided.transpose(), -1.0, &held, &mut q);
        }
        Rates { v, q, pv }
    }

    /// Work of a step that has been taken; `before` are K X and M V at its start.
    fn work(&self, load: &Load, lambda: &[f64], rates: &Rates, before: &[Vec<f64>; 2]) -> StepWork {
        let h = self.h;
        let (a, b) = (self.damping.stiffness_s, self.damping.mass_per_s);
        let [old_kx, old_mv] = before;
        let mut work = StepWork::default();
        for i in 0..lambda.len() {
            let moved = h * rates.v[i];
            work.input_j += load.on_x[i] * moved;
            let spent = lambda[i] * moved;
            if i % 3 == 0 {
                work.impact_j += spent;
            } else {
                work.friction_j += spent;
            }
            work.viscous_j += a * (self.kx[i] - old_kx[i]) * rates.v[i]
                + b * 0.5 * (self.mv[i] + old_mv[i]) * moved;
        }
        for m in 0..self.modal.len() {
            let moved = h * rates.q[m];
            work.input_j += load.on_modes[m] * moved;
            work.viscous_j += (a * self.problem.reduced.omega2[m] * rates.q[m]
                + b * (rates.q[m] + 2.0 * rates.pv[m]))
                * moved;
        }
        for m in 0..self.problem.modal_ratios.len() {
            // In place of the Rayleigh damping of the mode.
            let of_mass = self.inertial[m] - 2.0 / h - b;
            let of_stiffness = a * self.problem.reduced.omega2[m];
            work.viscous_j += h * of_mass * (rates.q[m] + rates.pv[m]).powi(2);
            work.viscous_j -= h * of_stiffness * rates.q[m].powi(2);
        }
        if let Some(DashpotForces { dashpots, .. }) = &self.dashpots {
            let mut moving = vec![0.0; dashpots.count()];
            add_product(dashpots.on_x.transpose(), 1.0, &rates.v, &mut moving);
            add_product(dashpots.on_modes.transpose(), 1.0, &rates.q, &mut moving);
            for (rate, damping) in moving.iter().zip(&dashpots.damping_n_s_m) {
                work.viscous_j += h * damping * rate * rate;
            }
        }
        work
    }
}

/// Means over a step.
struct Rates {
    /// Vm, m/s.
    v: Vec<f64>,
    /// q'm, in modal units per second.
    q: Vec<f64>,
    /// p^T Vm.
    pv: Vec<f64>,
}

fn mean(x: &[f64], y: &[f64]) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| 0.5 * (x + y)).collect()
}

/// Computes y = A x.
fn apply(a: &Mat<f64>, x: &[f64], y: &mut [f64]) {
    y.fill(0.0);
    add_product(a.as_ref(), 1.0, x, y);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians;

    #[test]
    fn a_coefficient_of_friction_above_the_most_counts_as_the_most() {
        let [at_most, above] = [1.0, 1e3].map(|times| {
            let mut problem = jacobians::problem(1);
            problem.laws = vec![PairLaw::rigid(times * PairLaw::MOST_FRICTION, 0.0)];
            problem.excitations.clear();
            let reduced = problem.reduced_mut();
            reduced.mass = Mat::identity(3, 3);
            reduced.coupling = Mat::zeros(3, reduced.omega2.len());
            // Sticks with a coefficient above 1e5.
            reduced.static_load.on_x = vec![-1e-5, 0.0, 1.0];
            reduced.static_load.on_modes.fill(0.0);
            let damping = Rayleigh::NONE;
            let mut stepper = Stepper::new(&problem, damping, 0.1, 100).unwrap();
            let mut state = MotionState::resting(&problem, &[0.0; 3], &[0.0; 3]);
            stepper.prepare(&state);
            stepper.advance(&mut state, 0).unwrap();
            state
        });
        assert!(at_most.lambda[0] < 0.0 && at_most.v[2] > 0.0);
        assert_eq!(at_most.lambda, above.lambda);
        assert_eq!(at_most.v, above.v);
    }
}
