//! Static state of a reduced model.

use super::kept::StaticOptions;
use super::session::{Session, Stage};
use crate::description::{PathPoint, Scene, StaticSpec};
use crate::dlft::static_state::{CRITERIA, LoadPath, static_state as solve_static};
use crate::dlft::{Outcome, StaticState};
use crate::problem::{LinearReference, Problem};
use crate::reduced::SteadyCause;
use crate::reduced::{ReducedModel, StaticPart};
use dovetail_numerics::nonlinear::NewtonOptions;

/// Way in which the static load of a scene is applied to its reduced model.
pub fn load_path(scene: &Scene, reduced: &ReducedModel) -> LoadPath {
    let StaticSpec {
        load_steps, path, ..
    } = &scene.static_state;
    LoadPath {
        steps: *load_steps,
        points: path.iter().map(|point| multiples(point, reduced)).collect(),
    }
}

/// Multiples of the parts of the steady load at a point. Loads that come with matrices of another
/// program stay as they are. Of a model whose parts are not known the whole load has a multiple.
fn multiples(point: &PathPoint, reduced: &ReducedModel) -> Vec<f64> {
    if reduced.static_parts.is_empty() {
        return vec![point.loads.multiple(0)];
    }
    let parts = reduced.static_parts.iter();
    let multiple = |part: &StaticPart| match part.cause {
        SteadyCause::Rotation => point
            .speed_rad_s
            .map_or(part.working, |speed| speed * speed),
        SteadyCause::Load(number) => point.loads.multiple(number) * part.working,
        SteadyCause::Matrices => part.working,
    };
    parts.map(multiple).collect()
}

/// Settings of the static state of a scene.
pub(super) fn static_options(scene: &Scene) -> StaticOptions {
    StaticOptions {
        load_steps: scene.static_state.load_steps,
        path: scene.static_state.path.clone(),
        tolerance: scene.response.tolerance.min(CRITERIA.tolerance),
        max_iterations: CRITERIA.max_iterations,
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
            on_path: Vec::new(),
            ended_at: None,
        };
    }
    let stage = session.stage(Stage::StaticState);
    stage.solves(problem.reduced.stiffness.nrows());
    let path = load_path(scene, &problem.reduced);
    solve_static(problem, path, newton(scene))
}

/// Criteria that end the iterations of a static state of a scene.
pub(super) fn newton(scene: &Scene) -> NewtonOptions {
    let options = static_options(scene);
    NewtonOptions::new(options.tolerance, options.max_iterations)
}
