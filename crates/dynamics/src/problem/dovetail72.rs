//! The reduced model of 72 pairs in `tests/data/dovetail72`, for unit tests.

use std::sync::OnceLock;

use dovetail_numerics::dense::symmetrised;
use dovetail_testkit::arrays::dense;
use faer::Mat;

use super::Problem;
use crate::contact::PairLaw;
use crate::damping::Rayleigh;
use crate::reduced::{Load, ObservedPoint, ReducedModel};

/// Problem with a friction of 0.3 and no clearance, excited by `force_n`.
pub(crate) fn dovetail72(force_n: f64) -> Problem {
    // Read once for all tests of a process.
    static MODEL: OnceLock<ReducedModel> = OnceLock::new();
    let reduced = MODEL.get_or_init(read);
    Problem::uniform(reduced.clone(), PairLaw::rigid(0.3, 0.0), force_n)
}

/// 0.1 % of critical damping on the first stuck mode.
pub(crate) fn damping(problem: &Problem) -> Rayleigh {
    Rayleigh::from_damping_ratio(0.001, problem.reduced.omega2[0].sqrt())
}

fn read() -> ReducedModel {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/dovetail72");
    let array = |name: &str| -> Mat<f64> { dense(&format!("{folder}/{name}.mtx")) };
    let column = |name: &str| array(name).col_as_slice(0).to_vec();
    let mut model = ReducedModel::new(
        symmetrised(array("stiffness").as_ref()),
        symmetrised(array("mass").as_ref()),
        array("coupling"),
        column("squared_frequencies"),
    );
    model.static_load.on_x = column("static_load");
    model.unit_loads = vec![Load::new(
        column("excitations"),
        column("excitations_on_modes"),
    )];
    model.observations = vec![ObservedPoint::new(
        "tip",
        column("observed_points"),
        column("observed_points_on_modes"),
    )];
    model
}
