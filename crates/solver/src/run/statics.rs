//! Static state of a reduced model.

use super::kept::StaticOptions;
use super::session::{Session, Stage};
use crate::description::Scene;
use crate::dlft::static_state::{LoadPath, static_state as solve_static};
use crate::dlft::{Outcome, StaticState};
use crate::problem::{LinearReference, Problem};
use dovetail_numerics::nonlinear::NewtonOptions;

/// Newton iterations allowed for one step of the static load.
const STATIC_ITERATIONS: usize = 100;

/// Way in which the static load of a scene is applied.
pub fn load_path(scene: &Scene) -> LoadPath {
    LoadPath {
        steps: scene.static_state.load_steps,
        overload: scene.static_state.overload,
    }
}

/// Settings of the static state of a scene.
pub fn static_options(scene: &Scene) -> StaticOptions {
    StaticOptions {
        path: load_path(scene),
        tolerance: scene.response.tolerance.min(1e-10),
        max_iterations: STATIC_ITERATIONS,
    }
}

/// Static state with friction; where no pair can open or slip there is nothing to solve.
pub(super) fn static_state(scene: &Scene, problem: &Problem, session: &Session<'_>) -> StaticState {
    if problem.laws.is_empty() {
        return StaticState {
            outcome: Outcome::Converged,
            x: Vec::new(),
            lambda: Vec::new(),
            status: Vec::new(),
            newton_iterations: 0,
            residual: 0.0,
            retention_n: None,
            linear: LinearReference::stuck(&problem.reduced),
        };
    }
    let stage = session.stage(Stage::StaticState);
    stage.solves(problem.reduced.stiffness.nrows());
    solve_static(problem, load_path(scene), newton(scene))
}

/// Criteria that end the iterations of a static state of a scene.
pub(super) fn newton(scene: &Scene) -> NewtonOptions {
    let options = static_options(scene);
    NewtonOptions::new(options.tolerance, options.max_iterations)
}
