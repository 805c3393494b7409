//! Checks `[[contact]]` and `[damping]`, where energy is dissipated.

use std::path::Path;

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable, places};
use super::pair_law::law_keys;
use crate::scene::entries::{RawContact, RawDamping};
use crate::scene::error::SceneFault;
use dovetail_solver::damping::DampingSpec;
use dovetail_solver::description::ResponseSpec;
use dovetail_solver::model::{ContactLaw, ContactSpec, CrownSpec, FieldSource, Sector};

pub fn contacts(
    checker: &mut Checker,
    base_dir: &Path,
    raw: &[Spanned<RawContact>],
) -> Option<Vec<ContactSpec>> {
    let contact = |checker: &mut Checker, at: &SceneTable, raw: &RawContact| {
        contact(checker, base_dir, at, raw)
    };
    checker.items("contact", raw, |raw| &raw.name, contact)
}

fn contact(
    checker: &mut Checker,
    base_dir: &Path,
    at: &SceneTable,
    raw: &RawContact,
) -> Option<ContactSpec> {
    let name = checker.required_name(at, &raw.name);
    let first = checker.text(at, "first", &raw.first);
    let second = second(checker, at, raw);
    let second_sector = checker.choice(at, "second_sector", &raw.second_sector);
    if let (Some(Sector::Next), Some(given)) = (second_sector, &raw.slave) {
        let fault = SceneFault::Exclusive {
            first: at.key("slave"),
            second: "second_sector = \"next\"".to_owned(),
            remedy: "contact with the next sector is enforced at the nodes of `first`: leave out `slave`, \
                     and make the side of the smaller facets the first",
        };
        checker.fault(given.span(), fault);
        return None;
    }
    let slave = checker.optional_choice(at, "slave", &raw.slave);
    let law = checker.choice(at, "law", &raw.law);
    let keys = law_keys!(raw; normal_stiffness_n_m3, tangential_stiffness_n_m3);
    let friction_at = friction_at(checker, base_dir, at, raw);
    let has_none = law == Some(ContactLaw::Bonded) || raw.friction_file.is_some();
    let pair_law = keys.law(checker, at, has_none);
    let gap = checker.choice(at, "gap", &raw.gap);
    let reach = checker.optional_number(at, "search_distance_m", &raw.search_distance_m);
    let crown = crown(checker, at, raw);
    Some(ContactSpec {
        name: name?,
        first: first?,
        second: second?,
        second_sector: second_sector?,
        slave: slave?,
        law: law?,
        pair_law: pair_law?,
        friction_at: friction_at?,
        gap: gap?,
        search_distance_m: reach?,
        crown: crown?,
    })
}

/// File of coefficients of friction; `Some(None)` if the contact has one coefficient.
fn friction_at(
    checker: &mut Checker,
    base_dir: &Path,
    at: &SceneTable,
    raw: &RawContact,
) -> Option<Option<FieldSource>> {
    let Some(given) = &raw.friction_file else {
        return Some(None);
    };
    let remedy = "keep the coefficient of all pairs, or the file of their coefficients";
    let others = places!(raw; friction);
    checker.exclude(at, ("friction_file", given.span()), &others, remedy)?;
    let file = checker.text(at, "friction_file", &raw.friction_file)?;
    Some(Some(FieldSource::File(base_dir.join(file))))
}

/// Opposite flank; `Some(None)` if it is rigid ground.
fn second(checker: &mut Checker, at: &SceneTable, raw: &RawContact) -> Option<Option<String>> {
    let Some(given) = &raw.second else {
        let others = places!(raw; second_sector, slave, gap, search_distance_m);
        let remedy =
            "name the opposite flank, or leave both out: rigid ground lies where the flank is";
        checker.note_missing_partners(at, &others, "second", remedy)?;
        return Some(None);
    };
    let name = checker.text(at, "second", &raw.second)?;
    if raw.first.as_ref().is_some_and(|f| *f.get_ref() == name) {
        let path = at.key("second");
        checker.fault(given.span(), SceneFault::SameFlank { path });
        return None;
    }
    Some(Some(name))
}

/// Crown of a flank; `Some(None)` if it has none.
fn crown(checker: &mut Checker, at: &SceneTable, raw: &RawContact) -> Option<Option<CrownSpec>> {
    if raw.crown_radius_m.is_none() {
        let others = places!(raw; crown_axis, crown_centre_m);
        let remedy = "say how strongly the flank is crowned, or leave both out";
        checker.note_missing_partners(at, &others, "crown_radius_m", remedy)?;
        return Some(None);
    }
    let radius = checker.number(at, "crown_radius_m", &raw.crown_radius_m);
    let axis = checker.optional_direction(at, "crown_axis", &raw.crown_axis);
    Some(Some(CrownSpec {
        radius_m: radius?,
        axis: axis?,
        centre_m: raw.crown_centre_m.as_ref().map(|c| c.get_ref().0),
    }))
}

/// Damping of all modes, and the ratios of the first ones.
pub fn damping(
    checker: &mut Checker,
    raw: &Spanned<RawDamping>,
    response: Option<&ResponseSpec>,
) -> Option<(DampingSpec, Vec<f64>)> {
    let at = SceneTable::new("damping", raw.span(), None);
    let raw = raw.get_ref();
    let ratios = checker.numbers(&at, "modal_ratios", &raw.modal_ratios);
    let kept = response.and_then(|r| r.stuck_modes);
    if let (Some(ratios), Some(kept), Some(given)) = (&ratios, kept, &raw.modal_ratios)
        && ratios.len() > kept
    {
        let fault = SceneFault::StuckModesNotKept {
            given: ratios.len(),
            kept,
        };
        checker.fault(given.span(), fault);
    }
    let ordinary = ordinary(checker, &at, raw, response);
    Some((ordinary?, ratios?))
}

/// Damping of the modes that have no ratio of their own.
fn ordinary(
    checker: &mut Checker,
    at: &SceneTable,
    raw: &RawDamping,
    response: Option<&ResponseSpec>,
) -> Option<DampingSpec> {
    let rayleigh = places!(raw; stiffness_s, mass_per_s);
    let remedy = "keep `ratio` (with `linear_mode`), or `stiffness_s` and `mass_per_s`, not both";
    if let Some(given) = &raw.ratio {
        checker.exclude(at, ("ratio", given.span()), &rayleigh, remedy)?;
        let ratio = checker.number(at, "ratio", &raw.ratio);
        let linear_mode = checker.count(at, "linear_mode", &raw.linear_mode)?;
        let kept = response.and_then(|r| r.stuck_modes);
        if let Some(kept) = kept.filter(|&kept| linear_mode > kept) {
            let span = raw
                .linear_mode
                .as_ref()
                .map_or(at.span.clone(), Spanned::span);
            checker.fault(span, SceneFault::LinearModeNotKept { linear_mode, kept });
        }
        return Some(DampingSpec::Ratio {
            ratio: ratio?,
            linear_mode,
        });
    }
    if let Some(mode) = &raw.linear_mode {
        checker.exclude(at, ("linear_mode", mode.span()), &rayleigh, remedy)?;
        let remedy = "say which ratio of critical damping that mode has";
        checker.note_missing_partner(at, "linear_mode", "ratio", mode.span(), remedy);
        return None;
    }
    if rayleigh.iter().all(|(_, span)| span.is_none()) && raw.modal_ratios.is_none() {
        let keys = ["ratio", "stiffness_s", "mass_per_s", "modal_ratios"];
        checker.require_one_of(at, &keys, "ratio");
        return None;
    }
    let stiffness_s = checker.number(at, "stiffness_s", &raw.stiffness_s);
    let mass_per_s = checker.number(at, "mass_per_s", &raw.mass_per_s);
    Some(DampingSpec::Rayleigh {
        stiffness_s: stiffness_s?,
        mass_per_s: mass_per_s?,
    })
}
