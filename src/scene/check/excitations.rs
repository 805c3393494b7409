//! Checks `[[excitation]]`.

use std::ops::Range;
use std::path::Path;

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable, places};
use super::loads::{self, LoadSizeKeys};
use crate::scene::entries::RawExcitation;
use crate::scene::error::SceneFault;
use dovetail_solver::description::ResponseSpec;
use dovetail_solver::model::{BaseMotion, ExcitationKind, ExcitationSpec, FieldSource, LoadSpec};

pub fn excitations(
    checker: &mut Checker,
    base_dir: &Path,
    raw: &[Spanned<RawExcitation>],
    response: Option<&ResponseSpec>,
) -> Option<Vec<ExcitationSpec>> {
    let excitation = |checker: &mut Checker, at: &SceneTable, raw: &RawExcitation| {
        let cause = kind(checker, at, base_dir, raw);
        let harmonic = harmonic(checker, at, raw, response);
        let phase_deg = checker.number(at, "phase_deg", &raw.phase_deg);
        let (kind, amplitude) = cause?;
        Some(ExcitationSpec {
            kind,
            amplitude,
            harmonic: harmonic?,
            phase_rad: phase_deg?.to_radians(),
        })
    };
    checker.items("excitation", raw, |_| &None, excitation)
}

fn harmonic(
    checker: &mut Checker,
    at: &SceneTable,
    raw: &RawExcitation,
    response: Option<&ResponseSpec>,
) -> Option<usize> {
    let harmonic = checker.count(at, "harmonic", &raw.harmonic)?;
    let kept = response.map(|r| r.resolution.most_harmonics());
    if let Some(harmonics) = kept.filter(|kept| harmonic > *kept) {
        let span = raw.harmonic.as_ref().map_or(at.span.clone(), Spanned::span);
        let fault = SceneFault::HarmonicNotKept {
            path: at.key("harmonic"),
            harmonic,
            harmonics,
        };
        checker.fault(span, fault);
    }
    Some(harmonic)
}

/// Kind and amplitude of an excitation.
fn kind(
    checker: &mut Checker,
    at: &SceneTable,
    base_dir: &Path,
    raw: &RawExcitation,
) -> Option<(ExcitationKind, f64)> {
    let size = LoadSizeKeys {
        force_n: &raw.force_n,
        traction_pa: &raw.traction_pa,
        pressure_pa: &raw.pressure_pa,
    };
    let bases = [
        (
            "base_acceleration_m_s2",
            &raw.base_acceleration_m_s2,
            BaseMotion::Acceleration,
        ),
        (
            "base_displacement_m",
            &raw.base_displacement_m,
            BaseMotion::Displacement,
        ),
    ];
    let mut causes = size.keys();
    causes.extend(places!(raw; file, base_acceleration_m_s2, base_displacement_m));
    let remedy = "keep one of `force_n`, `traction_pa`, `pressure_pa`, `file`, `base_acceleration_m_s2` and \
                  `base_displacement_m`, and write another [[excitation]] for what acts besides";
    let (key, span) = checker.pick_one(at, &causes, remedy)?;
    if let (Some(factor), true) = (&raw.factor, key != "file") {
        let remedy = "`factor` multiplies the values of a `file`; leave it out";
        checker.note_missing_partner(at, "factor", "file", factor.span(), remedy);
    }
    if let Some((_, base, motion)) = bases.into_iter().find(|base| base.0 == key) {
        let amplitude = checker.number(at, key, base);
        let direction = checker.direction(at, "direction", &raw.direction);
        let remedy = "leave `on` out: all supports and rigid ground move as one";
        checker.exclude(at, (key, span), &places!(raw; on), remedy)?;
        let direction = direction?;
        return Some((ExcitationKind::Base { direction, motion }, amplitude?));
    }
    if key == "file" {
        return field(checker, at, base_dir, raw, span);
    }
    let on = checker.text(at, "on", &raw.on);
    let (load, amplitude) = loads::load(checker, at, &size, &raw.direction)?;
    let load = LoadSpec { on: on?, load };
    Some((ExcitationKind::Load(load), amplitude))
}

fn field(
    checker: &mut Checker,
    at: &SceneTable,
    base_dir: &Path,
    raw: &RawExcitation,
    span: Range<usize>,
) -> Option<(ExcitationKind, f64)> {
    let on = checker.text(at, "on", &raw.on);
    let file = checker.text(at, "file", &raw.file);
    let factor = checker.number(at, "factor", &raw.factor);
    let remedy = "leave `direction` out: a file has forces with three components, or pressures along the inward normal";
    checker.exclude(at, ("file", span), &places!(raw; direction), remedy)?;
    let field = FieldSource::File(base_dir.join(file?));
    Some((ExcitationKind::Field { on: on?, field }, factor?))
}
