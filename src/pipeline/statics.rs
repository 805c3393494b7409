//! Takes a reduced model to its static state.

use super::progress::Progress;
use crate::stage::Stage;
use dovetail_numerics::newton::NewtonOptions;
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::static_state::static_state as solve_static;
use dovetail_solver::dlft::{Outcome, StaticState};
use dovetail_solver::problem::{LinearReference, Problem};

/// Newton iterations allowed for one step of the static load.
const STATIC_ITERATIONS: usize = 100;

/// What a static state is solved with besides the model.
pub(super) fn static_options(scene: &Scene) -> (usize, NewtonOptions) {
    let newton = NewtonOptions {
        tolerance: scene.response.tolerance.min(1e-10),
        max_iterations: STATIC_ITERATIONS,
    };
    (scene.static_state.load_steps, newton)
}

/// With friction; where no pair can open or slip there is nothing to solve.
pub(super) fn static_state(scene: &Scene, problem: &Problem, progress: &Progress) -> StaticState {
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
    let stage = progress.stage(Stage::StaticState);
    stage.solves(problem.reduced.stiffness.nrows());
    let (load_steps, newton) = static_options(scene);
    solve_static(problem, load_steps, newton)
}
