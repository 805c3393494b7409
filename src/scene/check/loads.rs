//! Checks `[[load]]`, and the keys that `[[excitation]]` shares with it.

use std::ops::Range;

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable, places};
use crate::scene::entries::RawLoad;
use crate::scene::raw::{Located, Number, Numbers};
use dovetail_solver::model::{LoadKind, LoadSpec};

pub fn loads(checker: &mut Checker, raw: &[Spanned<RawLoad>]) -> Option<Vec<LoadSpec>> {
    checker.items("load", raw, |_| &None, steady_load)
}

fn steady_load(checker: &mut Checker, at: &SceneTable, raw: &RawLoad) -> Option<LoadSpec> {
    let on = checker.text(at, "on", &raw.on);
    let size = LoadSizeKeys {
        force_n: &raw.force_n,
        traction_pa: &raw.traction_pa,
        pressure_pa: &raw.pressure_pa,
    };
    let (load, amplitude) = load(checker, at, &size, &raw.direction)?;
    Some(LoadSpec {
        on: on?,
        load: scaled(load, amplitude),
    })
}

/// Keys for the size of a load.
pub struct LoadSizeKeys<'a> {
    pub force_n: &'a Located<Number>,
    pub traction_pa: &'a Located<Number>,
    pub pressure_pa: &'a Located<Number>,
}

impl LoadSizeKeys<'_> {
    /// Name of each key and its place; the place is `None` if the key is not given.
    pub fn keys(&self) -> Vec<(&'static str, Option<Range<usize>>)> {
        places!(self; force_n, traction_pa, pressure_pa).to_vec()
    }
}

/// Load of unit size, and its amplitude.
pub fn load(
    checker: &mut Checker,
    at: &SceneTable,
    size: &LoadSizeKeys,
    direction: &Located<Numbers<3>>,
) -> Option<(LoadKind, f64)> {
    let remedy = "keep one of `force_n` (the whole force), `traction_pa` (force over area), both with `direction`, and \
                  `pressure_pa` (along the inward normal)";
    let (key, span) = checker.pick_one(at, &size.keys(), remedy)?;
    if key == "pressure_pa" {
        let pressure = checker.number(at, key, size.pressure_pa);
        let direction = direction.as_ref().map(Spanned::span);
        let remedy = "leave `direction` out: a pressure acts along the inward normal; `traction_pa` has a direction";
        checker.exclude(at, (key, span), &[("direction", direction)], remedy)?;
        return Some((LoadKind::Pressure { pressure_pa: 1.0 }, pressure?));
    }
    let is_force = key == "force_n";
    let value = if is_force {
        size.force_n
    } else {
        size.traction_pa
    };
    let amplitude = checker.number(at, key, value);
    let unit = checker.direction(at, "direction", direction)?;
    let load = if is_force {
        LoadKind::Force { vector_n: unit }
    } else {
        LoadKind::Traction { vector_pa: unit }
    };
    Some((load, amplitude?))
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
