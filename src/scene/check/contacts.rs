//! Checks `[[contact]]` and `[damping]`, where energy is dissipated.

use serde_spanned::Spanned;

use super::fields::{Checker, Table};
use crate::scene::entries;
use crate::scene::error::Fault;
use crate::scene::kinds::Limits;
use crate::scene::raw::{RawContact, RawDamping};
use dovetail_solver::description::ResponseSpec;
use dovetail_solver::model::{ContactLaw, ContactSpec, CrownSpec};
use dovetail_solver::reduction::damping::DampingSpec;

/// `bodies`: how many the scene has.
pub fn contacts(
    checker: &mut Checker,
    raw: &[Spanned<RawContact>],
    bodies: usize,
) -> Option<Vec<ContactSpec>> {
    let (mut specs, mut names, mut groups) = (Vec::new(), Vec::new(), Vec::new());
    for (index, table) in raw.iter().enumerate() {
        let at = Table::of(
            "contact",
            table.span(),
            Some((index, &table.get_ref().name)),
        );
        let raw = table.get_ref();
        for (key, value) in [("first", &raw.first), ("second", &raw.second)] {
            groups.extend(
                value
                    .iter()
                    .map(|v| (at.key(key), v.get_ref().clone(), v.span())),
            );
        }
        names.extend(
            raw.name
                .iter()
                .map(|n| (at.key("name"), n.get_ref().clone(), n.span())),
        );
        let name = checker.required_name(&at, &raw.name);
        let first = checker.text(&at, "first", &raw.first);
        let second = second(checker, &at, raw, bodies);
        let law = checker.choice(
            &at,
            "law",
            &raw.law,
            &["unilateral_coulomb", "bonded"],
            &[ContactLaw::UnilateralCoulomb, ContactLaw::Bonded],
        );
        let unused = (law == Some(ContactLaw::Bonded)).then_some(0.0);
        let friction = checker.number(&at, "friction", &raw.friction, Limits::NOT_NEGATIVE, unused);
        let gap_m = checker.number(&at, "gap_m", &raw.gap_m, Limits::NOT_NEGATIVE, Some(0.0));
        let crown = crown(checker, &at, raw);
        specs.push((|| {
            Some(ContactSpec {
                name: name?,
                first: first?,
                second: second?,
                law: law?,
                friction: friction?,
                gap_m: gap_m?,
                crown: crown?,
            })
        })());
    }
    checker.distinct(&names);
    checker.distinct(&groups);
    specs.into_iter().collect()
}

/// The second body's flank, `Some(None)` where there is no second body.
fn second(
    checker: &mut Checker,
    at: &Table,
    raw: &RawContact,
    bodies: usize,
) -> Option<Option<String>> {
    match (&raw.second, bodies) {
        (None, 1) => Some(None),
        (Some(given), 1) => {
            let path = at.key("second");
            checker.fault(given.span(), Fault::NoSecondBody { path });
            None
        }
        (given, _) => checker.text(at, "second", given).map(Some),
    }
}

/// The crown of a flank, `Some(None)` where it has none.
fn crown(checker: &mut Checker, at: &Table, raw: &RawContact) -> Option<Option<CrownSpec>> {
    if raw.crown_radius_m.is_none() {
        let others = [
            ("crown_axis", raw.crown_axis.as_ref().map(Spanned::span)),
            (
                "crown_centre_m",
                raw.crown_centre_m.as_ref().map(Spanned::span),
            ),
        ];
        for (key, span) in others {
            if let Some(span) = span {
                let remedy = "say how strongly the flank is crowned, or leave both out";
                checker.lacks(at, key, "crown_radius_m", span, remedy);
                return None;
            }
        }
        return Some(None);
    }
    let radius = checker.number(
        at,
        "crown_radius_m",
        &raw.crown_radius_m,
        Limits::POSITIVE,
        None,
    );
    let axis = match &raw.crown_axis {
        None => Some(None),
        given => checker.direction(at, "crown_axis", given).map(Some),
    };
    Some(Some(CrownSpec {
        radius_m: radius?,
        axis: axis?,
        centre_m: raw.crown_centre_m.as_ref().map(|c| c.get_ref().0),
    }))
}

pub fn damping(
    checker: &mut Checker,
    raw: &Spanned<RawDamping>,
    response: Option<&ResponseSpec>,
) -> Option<DampingSpec> {
    let at = Table::of("damping", raw.span(), None);
    let raw = raw.get_ref();
    let rayleigh = [
        ("stiffness_s", raw.stiffness_s.as_ref().map(Spanned::span)),
        ("mass_per_s", raw.mass_per_s.as_ref().map(Spanned::span)),
    ];
    let remedy = "keep `ratio` (with `linear_mode`), or `stiffness_s` and `mass_per_s`, not both";
    if let Some(given) = &raw.ratio {
        checker.exclude(&at, ("ratio", given.span()), &rayleigh, remedy)?;
        let ratio = checker.number(&at, "ratio", &raw.ratio, Limits::from_zero_to(1.0), None);
        let linear_mode = checker.count(&at, "linear_mode", &raw.linear_mode, 1..=10_000, 1)?;
        if let Some(kept) = response
            .and_then(|r| r.stuck_modes)
            .filter(|&kept| linear_mode > kept)
        {
            let span = raw.linear_mode.as_ref().map_or(at.span, Spanned::span);
            checker.fault(span, Fault::LinearModeNotKept { linear_mode, kept });
        }
        return Some(DampingSpec::Ratio {
            ratio: ratio?,
            linear_mode,
        });
    }
    if let Some(mode) = &raw.linear_mode {
        checker.exclude(&at, ("linear_mode", mode.span()), &rayleigh, remedy)?;
        checker.lacks(
            &at,
            "linear_mode",
            "ratio",
            mode.span(),
            "say which ratio of critical damping that mode has",
        );
        return None;
    }
    if rayleigh.iter().all(|(_, span)| span.is_none()) {
        let paths = vec![at.key("ratio"), at.key("stiffness_s"), at.key("mass_per_s")];
        checker.fault(
            at.span,
            Fault::NoneOf {
                paths,
                example: entries::example("damping", "ratio"),
            },
        );
        return None;
    }
    let stiffness_s = checker.number(
        &at,
        "stiffness_s",
        &raw.stiffness_s,
        Limits::NOT_NEGATIVE,
        Some(0.0),
    );
    let mass_per_s = checker.number(
        &at,
        "mass_per_s",
        &raw.mass_per_s,
        Limits::NOT_NEGATIVE,
        Some(0.0),
    );
    Some(DampingSpec::Rayleigh {
        stiffness_s: stiffness_s?,
        mass_per_s: mass_per_s?,
    })
}
