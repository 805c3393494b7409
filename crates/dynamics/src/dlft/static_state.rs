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
//!
//! `load_path` has the loads on the way, `load_steps` goes along it, and `system` is the equilibrium
//! of a step.

use super::retention::{Holding, Retention};
use super::{Outcome, PairStatus, StaticState};
use crate::problem::inexact::InexactModel;
use crate::problem::{LinearReference, Problem};
use dovetail_numerics::nonlinear::NewtonOptions;

mod load_path;
mod load_steps;
mod system;

pub use load_path::LoadPath;

/// Default criteria that end the iteration of a load step: a relative residual, and iterations.
pub const CRITERIA: NewtonOptions = NewtonOptions::new(1e-10, 100);

use load_steps::LoadStart;
use system::StaticSystem;

/// Solves the static state under the static load.
///
/// The load is applied along the path from the stuck, unloaded state, the interference of pairs of
/// negative clearance on its first leg. Friction keeps what the path leaves. Motions that nothing
/// holds are retained. eps is the stiffness of each pair: it influences only the iterations, not the
/// state. If a step of the path does not converge, or nothing holds the bodies at one of its points
/// or in the end ([`Outcome::NothingHolds`]), all pairs of the linear reference stick.
///
/// ```
/// use dovetail_dynamics::dlft::PairStatus;
/// use dovetail_dynamics::dlft::static_state::{CRITERIA, static_state};
/// use dovetail_dynamics::prelude::*;
///
/// // 1 N presses the pair together, and 0.1 N pulls it along: friction holds up to 0.2 N.
/// let identity = Mat::identity(3, 3);
/// let model = ReducedModel::from_pair_matrices(identity.clone(), identity);
/// let model = model.static_load([-1.0, 0.1, 0.0]);
/// let problem = Problem::new(model, vec![PairLaw::rigid(0.2, 0.0)], &[]);
/// let state = static_state(&problem, 10, CRITERIA);
/// assert!(state.outcome.is_converged());
/// assert_eq!(state.status, [PairStatus::Stuck]);
/// ```
pub fn static_state(
    problem: &Problem,
    path: impl Into<LoadPath>,
    options: NewtonOptions,
) -> StaticState {
    add_linear_reference(
        problem,
        settle(problem, LoadStart::Unloaded, &path.into(), options),
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
    add_linear_reference(problem, settled_after(problem, before, options))
}

/// State of [`static_state_after`], with a linear reference whose pairs all stick.
pub(super) fn settled_after(
    problem: &Problem,
    before: PairsAtRest<'_>,
    options: NewtonOptions,
) -> StaticState {
    settle(problem, LoadStart::After(before), &1.into(), options)
}

/// State with its own linear reference, if it converged.
fn add_linear_reference(problem: &Problem, mut state: StaticState) -> StaticState {
    if state.outcome.is_converged() {
        state.linear = LinearReference::new(problem, &state.open_pairs());
    }
    state
}

/// Solves the state, with a linear reference whose pairs all stick.
fn settle(
    problem: &Problem,
    from: LoadStart<'_>,
    path: &LoadPath,
    options: NewtonOptions,
) -> StaticState {
    let eps = &problem.reduced.diagonal_stiffness();
    let pairs: Vec<usize> = (0..problem.laws.len()).collect();
    let inexact = InexactModel::mean_only(&problem.reduced).taking_part(&pairs, None);
    let holding = Holding::new(problem);
    let load_up = |retention: Option<&Retention>, start: LoadStart<'_>| {
        let system = StaticSystem::new(problem, &inexact, eps, retention);
        system.load_up(start, path, &holding, options)
    };
    let mut free = load_up(None, from);
    let mut start = from;
    let nothing_holds =
        |state: &StaticState| state.all_open() && !holding.is_held_without_contact();
    let is_lost = |state: &StaticState| !state.outcome.is_converged() || nothing_holds(state);
    let is_apart =
        matches!(from, LoadStart::Unloaded) && problem.laws.iter().any(|p| p.gap_m > 0.0);
    if is_lost(&free) && is_apart && problem.steady_force_n() > 0.0 {
        // A blade that touches nothing has an equilibrium of its own, far inwards, and one that few
        // pairs touch has hardly any stiffness: start with the flanks together.
        let other = load_up(None, LoadStart::ClearancesClosed);
        if !is_lost(&other) || free.all_open() && !other.all_open() {
            (free, start) = (other, LoadStart::ClearancesClosed);
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
