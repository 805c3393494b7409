//! Checks `[[spring]]`.

use serde_spanned::Spanned;

use super::fields::{Checker, Table};
use crate::scene::entries::RawSpring;
use dovetail_solver::model::SpringSpec;

pub fn springs(checker: &mut Checker, raw: &[Spanned<RawSpring>]) -> Option<Vec<SpringSpec>> {
    checker.items("spring", raw, |raw| &raw.name, spring)
}

fn spring(checker: &mut Checker, at: &Table, raw: &RawSpring) -> Option<SpringSpec> {
    let ends = [("first", &raw.first), ("second", &raw.second)];
    let groups = ends.into_iter().filter_map(|(key, value)| {
        let value = value.as_ref()?;
        Some((at.key(key), value.get_ref().clone(), value.span()))
    });
    checker.distinct(&groups.collect::<Vec<_>>());
    let name = checker.required_name(at, &raw.name);
    let first = checker.text(at, "first", &raw.first);
    let second = match &raw.second {
        None => Some(None),
        given => checker.text(at, "second", given).map(Some),
    };
    let stiffness_n_m = checker.number(at, "stiffness_n_m", &raw.stiffness_n_m);
    let direction = checker.optional_direction(at, "direction", &raw.direction);
    Some(SpringSpec {
        name: name?,
        first: first?,
        second: second?,
        stiffness_n_m: stiffness_n_m?,
        direction: direction?,
    })
}
