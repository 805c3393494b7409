//! Checks `[[observe]]`.

use serde_spanned::Spanned;

use super::fields::{Checker, Table};
use crate::scene::raw::RawObserve;
use dovetail_solver::model::ObservationSpec;

pub fn observations(
    checker: &mut Checker,
    raw: &[Spanned<RawObserve>],
) -> Option<Vec<ObservationSpec>> {
    let (mut specs, mut names) = (Vec::new(), Vec::new());
    for (index, table) in raw.iter().enumerate() {
        let at = Table::of(
            "observe",
            table.span(),
            Some((index, &table.get_ref().name)),
        );
        let raw = table.get_ref();
        names.extend(
            raw.name
                .iter()
                .map(|n| (at.key("name"), n.get_ref().clone(), n.span())),
        );
        let name = checker.required_name(&at, &raw.name);
        let points = checker.text(&at, "points", &raw.points);
        let direction = checker.direction(&at, "direction", &raw.direction);
        specs.push((|| {
            Some(ObservationSpec {
                name: name?,
                points: points?,
                direction: direction?,
            })
        })());
    }
    checker.distinct(&names);
    specs.into_iter().collect()
}
