//! Checks `[[body]]` and `[rotation]`.

use std::f64::consts::PI;

use serde_spanned::Spanned;

use super::fields::{Checker, Table};
use crate::scene::error::Fault;
use crate::scene::keys;
use crate::scene::kinds::Limits;
use crate::scene::raw::{Located, RawBody, RawRotation};
use dovetail_solver::model::{BodySpec, Material, Prestress, RotationSpec};

/// Largest speed taken for meant, rpm: far above it squares would leave the range of f64.
const MOST_RPM: f64 = 1e7;

pub fn bodies(checker: &mut Checker, raw: &[Spanned<RawBody>]) -> Option<Vec<BodySpec>> {
    let specs: Vec<Option<BodySpec>> = raw
        .iter()
        .enumerate()
        .map(|(i, b)| body(checker, i, b))
        .collect();
    if !(1..=2).contains(&raw.len()) {
        let end = checker.source.text.len();
        let span = raw.get(2).or(raw.last()).map_or(end..end, Spanned::span);
        checker.fault(span, Fault::BodyCount { found: raw.len() });
        return None;
    }
    let is_fixed = |b: &Spanned<RawBody>| {
        b.get_ref()
            .fixed
            .as_ref()
            .is_some_and(|f| !f.get_ref().is_empty())
    };
    // A body alone is held by rigid ground.
    if raw.len() == 2 && !raw.iter().any(is_fixed) {
        checker.fault(raw[1].span(), Fault::NothingFixed);
    }
    let located = |key: &str, i: usize, value: &Located<String>| {
        let value = value.as_ref()?;
        Some((
            format!("body.{i}.{key}"),
            value.get_ref().clone(),
            value.span(),
        ))
    };
    let names: Vec<_> = raw
        .iter()
        .enumerate()
        .filter_map(|(i, b)| located("name", i, &b.get_ref().name))
        .collect();
    let volumes: Vec<_> = raw
        .iter()
        .enumerate()
        .filter_map(|(i, b)| located("volume", i, &b.get_ref().volume))
        .collect();
    checker.distinct(&names);
    checker.distinct(&volumes);
    specs.into_iter().collect()
}

fn body(checker: &mut Checker, index: usize, raw: &Spanned<RawBody>) -> Option<BodySpec> {
    let at = Table::of("body", raw.span(), Some((index, &raw.get_ref().name)));
    let raw = raw.get_ref();
    let name = checker.required_name(&at, &raw.name);
    let volume = checker.text(&at, "volume", &raw.volume);
    let young_pa = checker.number(&at, "young_pa", &raw.young_pa, Limits::POSITIVE, None);
    let poisson = checker.number(
        &at,
        "poisson",
        &raw.poisson,
        Limits::between(-1.0, 0.5),
        None,
    );
    let density = checker.number(
        &at,
        "density_kg_m3",
        &raw.density_kg_m3,
        Limits::POSITIVE,
        None,
    );
    let key = "fixed_interface_modes";
    let modes = match &raw.fixed_interface_modes {
        None => Some(None),
        given => checker.count(&at, key, given, 0..=10_000, 0).map(Some),
    };
    let fixed = groups(checker, &at, "fixed", &raw.fixed);
    let fixed_along = [
        groups(checker, &at, "fixed_x", &raw.fixed_x),
        groups(checker, &at, "fixed_y", &raw.fixed_y),
        groups(checker, &at, "fixed_z", &raw.fixed_z),
    ];
    Some(BodySpec {
        name: name?,
        volume: volume?,
        material: Material {
            young_pa: young_pa?,
            poisson: poisson?,
            density_kg_m3: density?,
        },
        fixed,
        fixed_along,
        fixed_interface_modes: modes?,
    })
}

/// Names of groups, none of them empty.
fn groups(
    checker: &mut Checker,
    at: &Table,
    key: &str,
    list: &Located<Vec<Spanned<String>>>,
) -> Vec<String> {
    let groups = list.as_ref().map_or(&[][..], |f| f.get_ref().as_slice());
    for group in groups.iter().filter(|g| g.get_ref().trim().is_empty()) {
        let path = at.key(key);
        checker.fault(group.span(), Fault::EmptyText { path });
    }
    groups.iter().map(|g| g.get_ref().clone()).collect()
}

pub fn rotation(
    checker: &mut Checker,
    bodies: &[String],
    raw: &Spanned<RawRotation>,
) -> Option<RotationSpec> {
    let at = Table::of("rotation", raw.span(), None);
    let raw = raw.get_ref();
    let axis = checker.direction(&at, "axis", &raw.axis);
    let speed = checker.number(
        &at,
        "speed_rpm",
        &raw.speed_rpm,
        Limits::from_zero_to(MOST_RPM),
        None,
    );
    let prestress = checker.choice(
        &at,
        "prestress",
        &raw.prestress,
        &["held_flanks", "none"],
        &[Prestress::HeldFlanks, Prestress::None],
    );
    let carried = match &raw.bodies {
        None => bodies.to_vec(),
        Some(list) => {
            for name in list
                .get_ref()
                .iter()
                .filter(|n| !bodies.contains(n.get_ref()))
            {
                let fault = Fault::UnknownBody {
                    path: at.key("bodies"),
                    name: name.get_ref().clone(),
                    nearest: keys::nearest(name.get_ref(), bodies),
                    bodies: bodies.to_vec(),
                };
                checker.fault(name.span(), fault);
            }
            let named: Vec<_> = list
                .get_ref()
                .iter()
                .map(|n| (at.key("bodies"), n.get_ref().clone(), n.span()))
                .collect();
            checker.distinct(&named);
            named.into_iter().map(|(_, name, _)| name).collect()
        }
    };
    Some(RotationSpec {
        point_m: raw.point_m.as_ref().map_or([0.0; 3], |p| p.get_ref().0),
        axis: axis?,
        speed_rad_s: speed? * 2.0 * PI / 60.0,
        bodies: carried,
        prestress: prestress?,
    })
}
