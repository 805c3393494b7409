//! The reduced model of 72 pairs in `tests/data/dovetail72`, for unit tests.

use std::sync::OnceLock;

use super::Problem;
use crate::contact::PairLaw;
use crate::reduction::ReducedModel;
use crate::reduction::damping::Rayleigh;
use crate::reduction::superelement::read;

/// Problem with a friction of 0.3 and no clearance, excited by `force_n`.
pub fn dovetail72(force_n: f64) -> Problem {
    // Read once for all tests of a process.
    static MODEL: OnceLock<ReducedModel> = OnceLock::new();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/dovetail72");
    let reduced = MODEL.get_or_init(|| read(folder.as_ref()).unwrap().model);
    Problem::of_one_law(reduced.clone(), PairLaw::rigid(0.3, 0.0), force_n)
}

/// 0.1 % of critical damping on the first stuck mode.
pub fn damping(problem: &Problem) -> Rayleigh {
    Rayleigh::of_ratio(0.001, problem.reduced.omega2[0].sqrt())
}
