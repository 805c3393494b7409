//! Checks `[[load]]`.

use serde_spanned::Spanned;

use super::fields::{Checker, Table};
use crate::scene::entries;
use crate::scene::error::Fault;
use crate::scene::kinds::Limits;
use crate::scene::raw::RawLoad;
use dovetail_solver::model::{LoadKind, LoadSpec};

pub fn loads(checker: &mut Checker, raw: &[Spanned<RawLoad>]) -> Option<Vec<LoadSpec>> {
    let specs: Vec<Option<LoadSpec>> = raw
        .iter()
        .enumerate()
        .map(|(index, table)| {
            let at = Table::of("load", table.span(), Some((index, &None)));
            let on = checker.text(&at, "on", &table.get_ref().on);
            let load = kind(checker, &at, table.get_ref());
            Some(LoadSpec {
                on: on?,
                load: load?,
            })
        })
        .collect();
    specs.into_iter().collect()
}

fn kind(checker: &mut Checker, at: &Table, raw: &RawLoad) -> Option<LoadKind> {
    if let Some(pressure) = &raw.pressure_pa {
        let others = [
            ("force_n", raw.force_n.as_ref().map(Spanned::span)),
            ("direction", raw.direction.as_ref().map(Spanned::span)),
        ];
        let remedy =
            "keep `pressure_pa` (along the inward normal), or `force_n` with `direction`, not both";
        checker.exclude(at, ("pressure_pa", pressure.span()), &others, remedy)?;
        let limits = Limits::ANY;
        let pressure_pa = checker.number(at, "pressure_pa", &raw.pressure_pa, limits, None)?;
        return Some(LoadKind::Pressure { pressure_pa });
    }
    if raw.force_n.is_none() && raw.direction.is_none() {
        let paths = vec![at.key("force_n"), at.key("pressure_pa")];
        let example = entries::example("load", "pressure_pa");
        checker.fault(at.span.clone(), Fault::NoneOf { paths, example });
        return None;
    }
    let force = checker.number(at, "force_n", &raw.force_n, Limits::NOT_NEGATIVE, None);
    let direction = checker.direction(at, "direction", &raw.direction);
    let (force, direction) = (force?, direction?);
    Some(LoadKind::Force {
        vector_n: direction.map(|d| force * d),
    })
}
