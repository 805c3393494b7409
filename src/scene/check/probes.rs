//! Checks `[[observe]]`.

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable};
use crate::scene::entries::RawObserve;
use crate::scene::error::SceneFault;
use dovetail_solver::model::ObservationSpec;
use dovetail_solver::reduced::ObservedQuantity;

pub fn observations(
    checker: &mut Checker,
    raw: &[Spanned<RawObserve>],
) -> Option<Vec<ObservationSpec>> {
    let observations = checker.items("observe", raw, |raw| &raw.name, observation)?;
    if let (Some(spec), Some(item)) = (observations.first(), raw.first())
        && spec.quantity == ObservedQuantity::Strain
    {
        let given = &item.get_ref().quantity;
        let span = given.as_ref().map_or(item.span(), Spanned::span);
        let path = format!("observe.{}.quantity", spec.name);
        checker.fault(span, SceneFault::FirstIsStrain { path });
        return None;
    }
    Some(observations)
}

fn observation(
    checker: &mut Checker,
    at: &SceneTable,
    raw: &RawObserve,
) -> Option<ObservationSpec> {
    let name = checker.required_name(at, &raw.name);
    let points = checker.text(at, "points", &raw.points);
    let direction = checker.direction(at, "direction", &raw.direction);
    let quantity = checker.choice(at, "quantity", &raw.quantity);
    Some(ObservationSpec {
        name: name?,
        points: points?,
        direction: direction?,
        quantity: quantity?,
    })
}
