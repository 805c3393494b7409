//! Application of the static load in steps along its path.

use super::PairsAtRest;
use super::load_path::LoadPath;
use super::system::StaticSystem;
use crate::contact::coulomb::Contact;
use crate::dlft::homotopy::{friction_steps, most_friction};
use crate::dlft::retention::Holding;
use crate::dlft::{Outcome, StaticState};
use crate::problem::{Problem, tangential};
use dovetail_numerics::dense::Lu;
use dovetail_numerics::nonlinear::{
    NewtonEnd, NewtonOptions, NewtonStatus, NonlinearSystem, newton,
};
use dovetail_numerics::vector::norm;
use faer::Mat;

/// State from which the load is applied.
#[derive(Debug, Clone, Copy)]
pub(super) enum LoadStart<'a> {
    /// All relative displacements are zero.
    Unloaded,
    ClearancesClosed,
    /// State in which the pairs were at rest before.
    After(PairsAtRest<'a>),
}

impl StaticSystem {
    /// Applies the load along the path. The way ends at a point at which nothing holds the bodies.
    pub(super) fn load_up(
        mut self,
        start: LoadStart<'_>,
        path: &LoadPath,
        holding: &Holding,
        options: NewtonOptions,
    ) -> StaticState {
        let n = self.eps.len();
        let mut forces = vec![[0.0; 3]; n / 3];
        let mut x = match start {
            LoadStart::Unloaded => vec![0.0; n],
            LoadStart::ClearancesClosed => close_clearances(&self.problem, &self.eps),
            LoadStart::After(PairsAtRest { x, lambda }) => {
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
        let scale = force_scale_n(&self.problem, &self.eps, &stations);
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
                if is_open && norm(&self.load) > 0.0 && !holding.is_held_without_contact() {
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
fn close_clearances(problem: &Problem, eps: &[f64]) -> Vec<f64> {
    /// Part of eps that holds the flanks along the contact, which nothing else may do.
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
    system: &mut StaticSystem,
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
    if end.status != NewtonStatus::Converged {
        let mut y = start;
        if let Some(last) = grow_friction(system, &mut y, options) {
            x.copy_from_slice(&y);
            end = NewtonEnd {
                iterations: end.iterations + last.iterations,
                ..last
            };
        }
    }
    end
}

/// Solves with coefficients of friction that grow up to the full ones; `None` where these are not
/// reached.
fn grow_friction(
    system: &mut StaticSystem,
    x: &mut Vec<f64>,
    options: NewtonOptions,
) -> Option<NewtonEnd> {
    let full = system.friction();
    let highest = full.iter().copied().fold(0.0, f64::max);
    let mut steps = friction_steps(highest)?;
    let (mut iterations, mut solved_most) = (0, None);
    while let Some(next) = steps.next() {
        let most = most_friction(next, highest);
        let mut y = x.clone();
        if let Some(solved) = solved_most {
            system.most_friction = solved;
            let coefficients: Vec<f64> = full.iter().map(|f| f.min(most)).collect();
            system.predict(&mut y, &coefficients);
        }
        system.most_friction = most;
        let end = newton(system, &mut y, options);
        iterations += end.iterations;
        let is_solved = end.status == NewtonStatus::Converged;
        steps.record(is_solved);
        if is_solved {
            (*x, solved_most) = (y, Some(most));
        }
        if steps.has_arrived() {
            return Some(NewtonEnd { iterations, ..end });
        }
    }
    system.most_friction = f64::INFINITY;
    None
}
