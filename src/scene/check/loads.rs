//! Checks `[[load]]`, and the keys that `[[excitation]]` shares with it.

use std::ops::Range;

use serde_spanned::Spanned;

use super::fields::{Checker, Table};
use crate::scene::raw::{Located, Number, Numbers, RawLoad};
use dovetail_solver::model::{LoadKind, LoadSpec};

pub fn loads(checker: &mut Checker, raw: &[Spanned<RawLoad>]) -> Option<Vec<LoadSpec>> {
    let specs: Vec<Option<LoadSpec>> = raw
        .iter()
        .enumerate()
        .map(|(index, table)| {
            let at = Table::of("load", table.span(), Some((index, &None)));
            let raw = table.get_ref();
            let on = checker.text(&at, "on", &raw.on);
            let size = Sizes {
                force_n: &raw.force_n,
                traction_pa: &raw.traction_pa,
                pressure_pa: &raw.pressure_pa,
            };
            let load = load(checker, &at, &size, &raw.direction);
            let (load, amplitude) = load?;
            Some(LoadSpec {
                on: on?,
                load: scaled(load, amplitude),
            })
        })
        .collect();
    specs.into_iter().collect()
}

/// Keys for the size of a load.
pub struct Sizes<'a> {
    pub force_n: &'a Located<Number>,
    pub traction_pa: &'a Located<Number>,
    pub pressure_pa: &'a Located<Number>,
}

impl Sizes<'_> {
    /// Name of each key and its place; the place is `None` if the key is not given.
    pub fn given(&self) -> Vec<(&'static str, Option<Range<usize>>)> {
        let keys = [
            ("force_n", self.force_n),
            ("traction_pa", self.traction_pa),
            ("pressure_pa", self.pressure_pa),
        ];
        let span = |value: &Located<Number>| value.as_ref().map(Spanned::span);
        keys.map(|(key, value)| (key, span(value))).to_vec()
    }
}

/// Load of unit size, and its amplitude.
pub fn load(
    checker: &mut Checker,
    at: &Table,
    size: &Sizes,
    direction: &Located<Numbers<3>>,
) -> Option<(LoadKind, f64)> {
    let remedy = "keep one of `force_n` (the whole force), `traction_pa` (force over area), both with `direction`, and \
                  `pressure_pa` (along the inward normal)";
    let (key, span) = checker.one_of(at, &size.given(), remedy)?;
    if key == "pressure_pa" {
        let pressure = checker.number(at, key, size.pressure_pa);
        let direction = direction.as_ref().map(Spanned::span);
        let remedy = "leave `direction` out: a pressure acts along the inward normal; `traction_pa` has a direction";
        checker.exclude(at, (key, span), &[("direction", direction)], remedy)?;
        return Some((LoadKind::Pressure { pressure_pa: 1.0 }, pressure?));
    }
    let (value, is_force) = match key {
        "force_n" => (size.force_n, true),
        _ => (size.traction_pa, false),
    };
    let amplitude = checker.number(at, key, value);
    let direction = checker.direction(at, "direction", direction)?;
    let unit = if is_force {
        LoadKind::Force {
            vector_n: direction,
        }
    } else {
        LoadKind::Traction {
            vector_pa: direction,
        }
    };
    Some((unit, amplitude?))
}

fn scaled(unit: LoadKind, amplitude: f64) -> LoadKind {
    match unit {
        LoadKind::Force { vector_n } => LoadKind::Force {
            vector_n: vector_n.map(|c| amplitude * c),
        },
        LoadKind::Traction { vector_pa } => LoadKind::Traction {
            vector_pa: vector_pa.map(|c| amplitude * c),
        },
        LoadKind::Pressure { pressure_pa } => LoadKind::Pressure {
            pressure_pa: amplitude * pressure_pa,
        },
    }
}
