//! The reference model of 72 pairs, matrices of models of one pair, and responses of both.

use std::sync::OnceLock;

use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::Response;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::problem::Problem;
use dovetail_solver::reduced::ReducedModel;
use dovetail_testkit::folder::root;
use faer::Mat;

/// Model of `tests/data/dovetail72` with one law for all pairs, excited with `force_n`.
pub fn dovetail72(law: PairLaw, force_n: f64) -> Problem {
    // Read once for all tests.
    static MODEL: OnceLock<ReducedModel> = OnceLock::new();
    let folder = root().join("tests/data/dovetail72");
    let model = MODEL.get_or_init(|| dovetail_superelement::read(&folder).unwrap().model);
    Problem::uniform(model.clone(), law, force_n)
}

/// Response about the static state under ten steps of the load, which has to be found.
#[track_caller]
pub fn respond(model: &Problem, damping: Rayleigh, settings: &SweepSettings) -> Response {
    let state = static_state(model, 10, settings.newton);
    assert!(state.outcome.is_converged(), "{:?}", state.outcome);
    sweep(model, damping, &state, settings, &[], &|_| ())
}

/// 0.1 % of critical damping on the first stuck mode.
pub fn damping_of(model: &Problem) -> Rayleigh {
    Rayleigh::from_damping_ratio(0.001, model.reduced.omega2[0].sqrt())
}

/// Matrix with these values on its diagonal.
pub fn diagonal(values: [f64; 3]) -> Mat<f64> {
    Mat::from_fn(3, 3, |i, j| if i == j { values[i] } else { 0.0 })
}
