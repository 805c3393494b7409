//! Checks `[cyclic]`.

use std::path::Path;

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable, places};
use crate::scene::entries::{RawCyclic, RawRotation, RawScene};
use crate::scene::error::SceneFault;
use crate::scene::raw::Located;
use dovetail_solver::description::EngineOrder;
use dovetail_solver::model::{CyclicSpec, InfluenceSource, InfluenceSpec};
use dovetail_solver::space::{cross, direction, norm, sub};

/// Sine of the largest angle between two axes that are one.
const ALONG: f64 = 1e-9;

pub fn cyclic(
    checker: &mut Checker,
    base_dir: &Path,
    raw: &Spanned<RawCyclic>,
    rotation: Option<&Spanned<RawRotation>>,
    run_up: Option<EngineOrder>,
) -> Option<CyclicSpec> {
    let at = SceneTable::new("cyclic", raw.span(), None);
    let raw = raw.get_ref();
    let rotation = rotation.map(Spanned::get_ref);
    let sectors = checker.count(&at, "sectors", &raw.sectors);
    let low = faces(checker, &at, "low", &raw.low);
    let high = faces(checker, &at, "high", &raw.high);
    let engine_order = match (&raw.engine_order, run_up) {
        (None, run_up) => Some(run_up.map_or(0, |order| order.0)),
        (given, None) => checker.count(&at, "engine_order", given),
        (Some(given), Some(_)) => {
            let fault = SceneFault::Exclusive {
                first: at.key("engine_order"),
                second: "response.along_engine_order".to_owned(),
                remedy: "a run-up makes the waves of its own engine order: leave out `engine_order` of [cyclic]",
            };
            checker.fault(given.span(), fault);
            None
        }
    };
    let influence = influence(checker, base_dir, &at, raw);
    let own_axis = checker.optional_direction(&at, "axis", &raw.axis)?;
    let turns_about = rotation.and_then(|r| direction(r.axis.as_ref()?.get_ref().0));
    let Some(axis) = own_axis.or(turns_about) else {
        // A rotation without an axis has a fault of its own.
        if rotation.is_none() {
            checker.missing(&at, "axis");
        }
        return None;
    };
    let of_rotation = rotation.and_then(|r| r.point_m.as_ref());
    let point = raw.point_m.as_ref().or(of_rotation);
    let point_m = point.map_or([0.0; 3], |p| p.get_ref().0);
    if let (Some(turns), Some(rotation)) = (turns_about, rotation) {
        let other_m = rotation
            .point_m
            .as_ref()
            .map_or([0.0; 3], |p| p.get_ref().0);
        let beside = cross(turns, sub(point_m, other_m));
        let is_beside = norm(beside) > ALONG * (norm(point_m) + norm(other_m));
        let differs = [norm(cross(axis, turns)) > ALONG, is_beside];
        let differing = places!(raw; axis, point_m).into_iter().zip(differs);
        if let Some(((key, span), _)) = differing.into_iter().find(|(_, differs)| *differs) {
            let fault = SceneFault::Exclusive {
                first: at.key(key),
                second: format!("rotation.{key}"),
                remedy: "a disc turns about its own axis: leave out `axis` and `point_m` of [cyclic], which \
                         are those of [rotation] then",
            };
            checker.fault(span.unwrap_or(at.span.clone()), fault);
            return None;
        }
    }
    if let Some(prestress) = rotation.and_then(|r| r.prestress.as_ref())
        && prestress.get_ref() == "held_flanks"
    {
        let fault = SceneFault::Exclusive {
            first: "rotation.prestress = \"held_flanks\"".to_owned(),
            second: "[cyclic]".to_owned(),
            remedy: "it holds the faces of the sector, too, where the stress of the disc is: take \
                     \"contact\", or \"none\"",
        };
        checker.fault(prestress.span(), fault);
        return None;
    }
    Some(CyclicSpec {
        sectors: sectors?,
        low: low?,
        high: high?,
        point_m,
        axis,
        engine_order: engine_order?,
        influence: influence?,
    })
}

/// Forces that the air returns to a body; `Some(None)` if there are none.
fn influence(
    checker: &mut Checker,
    base_dir: &Path,
    at: &SceneTable,
    raw: &RawCyclic,
) -> Option<Option<InfluenceSpec>> {
    if raw.influence.is_none() {
        let others = places!(raw; influence_on);
        let remedy = "give the file of the aerodynamic influence, or leave both out";
        checker.note_missing_partners(at, &others, "influence", remedy)?;
        return Some(None);
    }
    let file = checker.text(at, "influence", &raw.influence);
    let body = match &raw.influence_on {
        None => None,
        given => Some(checker.text(at, "influence_on", given)?),
    };
    Some(Some(InfluenceSpec {
        body,
        coefficients: InfluenceSource::File(base_dir.join(file?)),
    }))
}

/// Checks that there is a disc where a contact is with its next sector.
pub fn check_contacts(checker: &mut Checker, raw: &RawScene) {
    if raw.cyclic.is_some() {
        return;
    }
    for (index, contact) in raw.contact.iter().enumerate() {
        let of_contact = contact.get_ref();
        let next = of_contact.second_sector.as_ref();
        let Some(next) = next.filter(|sector| sector.get_ref() == "next") else {
            continue;
        };
        let at = SceneTable::new("contact", contact.span(), Some((index, &of_contact.name)));
        let fault = SceneFault::Lacks {
            path: at.key("second_sector"),
            needs: "[cyclic]".to_owned(),
            remedy: "give a section [cyclic] with the faces at which the sectors meet, or leave out \
                     `second_sector`",
        };
        checker.fault(next.span(), fault);
    }
}

/// Names of groups, at least one.
fn faces(
    checker: &mut Checker,
    at: &SceneTable,
    key: &'static str,
    list: &Located<Vec<Spanned<String>>>,
) -> Option<Vec<String>> {
    let Some(list) = list else {
        checker.missing(at, key);
        return None;
    };
    let groups = checker.non_empty(at, key, list)?;
    let mut names = Vec::with_capacity(groups.len());
    for name in groups {
        names.push(checker.text(at, key, &Some(name.clone()))?);
    }
    Some(names)
}
