//! Checks `[[observe]]`.

use serde_spanned::Spanned;

use super::fields::{Checker, Table};
use crate::scene::entries::RawObserve;
use dovetail_solver::model::ObservationSpec;

pub fn observations(
    checker: &mut Checker,
    raw: &[Spanned<RawObserve>],
) -> Option<Vec<ObservationSpec>> {
    checker.items("observe", raw, |raw| &raw.name, observation)
}

fn observation(checker: &mut Checker, at: &Table, raw: &RawObserve) -> Option<ObservationSpec> {
    let name = checker.required_name(at, &raw.name);
    let points = checker.text(at, "points", &raw.points);
    let direction = checker.direction(at, "direction", &raw.direction);
    Some(ObservationSpec {
        name: name?,
        points: points?,
        direction: direction?,
    })
}
