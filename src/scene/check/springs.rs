//! Checks `[[spring]]`.

use serde_spanned::Spanned;

use super::fields::{Checker, Table};
use crate::scene::raw::RawSpring;
use dovetail_solver::model::SpringSpec;

pub fn springs(checker: &mut Checker, raw: &[Spanned<RawSpring>]) -> Option<Vec<SpringSpec>> {
    let (mut specs, mut names) = (Vec::new(), Vec::new());
    for (index, table) in raw.iter().enumerate() {
        let at = Table::of("spring", table.span(), Some((index, &table.get_ref().name)));
        let raw = table.get_ref();
        let located = |key: &str, value: &Spanned<String>| {
            (at.key(key), value.get_ref().clone(), value.span())
        };
        names.extend(raw.name.iter().map(|name| located("name", name)));
        let ends = [("first", &raw.first), ("second", &raw.second)];
        let ends = ends.into_iter();
        let groups: Vec<_> = ends
            .filter_map(|(key, value)| Some(located(key, value.as_ref()?)))
            .collect();
        checker.distinct(&groups);
        let name = checker.required_name(&at, &raw.name);
        let first = checker.text(&at, "first", &raw.first);
        let second = match &raw.second {
            None => Some(None),
            given => checker.text(&at, "second", given).map(Some),
        };
        let key = "stiffness_n_m";
        let stiffness_n_m = checker.number(&at, key, &raw.stiffness_n_m);
        let direction = match &raw.direction {
            None => Some(None),
            given => checker.direction(&at, "direction", given).map(Some),
        };
        specs.push((|| {
            Some(SpringSpec {
                name: name?,
                first: first?,
                second: second?,
                stiffness_n_m: stiffness_n_m?,
                direction: direction?,
            })
        })());
    }
    checker.distinct(&names);
    specs.into_iter().collect()
}
