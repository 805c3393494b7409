//! Checks `[[spring]]` and `[[dashpot]]`, which join groups.

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable};
use crate::scene::entries::{RawDashpot, RawSpring};
use crate::scene::raw::Located;
use dovetail_solver::model::{DashpotSpec, SpringSpec};

pub fn springs(checker: &mut Checker, raw: &[Spanned<RawSpring>]) -> Option<Vec<SpringSpec>> {
    checker.items("spring", raw, |raw| &raw.name, spring)
}

pub fn dashpots(checker: &mut Checker, raw: &[Spanned<RawDashpot>]) -> Option<Vec<DashpotSpec>> {
    checker.items("dashpot", raw, |raw| &raw.name, dashpot)
}

fn spring(checker: &mut Checker, at: &SceneTable, raw: &RawSpring) -> Option<SpringSpec> {
    let ends = ends(checker, at, (&raw.name, &raw.first, &raw.second));
    let stiffness_n_m = checker.number(at, "stiffness_n_m", &raw.stiffness_n_m);
    let direction = checker.optional_direction(at, "direction", &raw.direction);
    let (name, first, second) = ends?;
    Some(SpringSpec {
        name,
        first,
        second,
        stiffness_n_m: stiffness_n_m?,
        direction: direction?,
    })
}

fn dashpot(checker: &mut Checker, at: &SceneTable, raw: &RawDashpot) -> Option<DashpotSpec> {
    let ends = ends(checker, at, (&raw.name, &raw.first, &raw.second));
    let damping_n_s_m = checker.number(at, "damping_n_s_m", &raw.damping_n_s_m);
    let direction = checker.optional_direction(at, "direction", &raw.direction);
    let (name, first, second) = ends?;
    Some(DashpotSpec {
        name,
        first,
        second,
        damping_n_s_m: damping_n_s_m?,
        direction: direction?,
    })
}

/// Keys `name`, `first` and `second`.
type Ends<'a> = (
    &'a Located<String>,
    &'a Located<String>,
    &'a Located<String>,
);

/// Name, first group, and second group, which is ground if it is left out.
fn ends(
    checker: &mut Checker,
    at: &SceneTable,
    (name, first, second): Ends<'_>,
) -> Option<(String, String, Option<String>)> {
    let groups = [("first", first), ("second", second)];
    let groups = groups.into_iter().filter_map(|(key, value)| {
        let value = value.as_ref()?;
        Some((at.key(key), value.get_ref().clone(), value.span()))
    });
    checker.distinct(&groups.collect::<Vec<_>>());
    let name = checker.required_name(at, name);
    let first = checker.text(at, "first", first);
    let second = match second {
        None => Some(None),
        given => checker.text(at, "second", given).map(Some),
    };
    Some((name?, first?, second?))
}
