//! Checks `[[excitation]]` and `[[observe]]`.

use serde_spanned::Spanned;

use super::fields::{Checker, Table};
use super::response::MOST_HARMONICS;
use crate::scene::error::Fault;
use crate::scene::kinds::Limits;
use crate::scene::raw::{RawExcitation, RawObserve};
use dovetail_solver::description::ResponseSpec;
use dovetail_solver::model::{ExcitationSpec, ObservationSpec};

pub fn excitations(
    checker: &mut Checker,
    raw: &[Spanned<RawExcitation>],
    response: Option<&ResponseSpec>,
) -> Option<Vec<ExcitationSpec>> {
    let mut specs = Vec::new();
    for (index, table) in raw.iter().enumerate() {
        let at = Table::of("excitation", table.span(), Some((index, &None)));
        let raw = table.get_ref();
        let points = checker.text(&at, "points", &raw.points);
        let direction = checker.direction(&at, "direction", &raw.direction);
        let force_n = checker.number(&at, "force_n", &raw.force_n, Limits::NOT_NEGATIVE, None);
        let harmonic = checker.count(&at, "harmonic", &raw.harmonic, 1..=MOST_HARMONICS, 1);
        let phase_deg = checker.number(&at, "phase_deg", &raw.phase_deg, Limits::ANY, Some(0.0));
        if let (Some(harmonic), Some(response)) = (harmonic, response)
            && harmonic > response.resolution.most_harmonics()
        {
            let (path, harmonics) = (at.key("harmonic"), response.resolution.most_harmonics());
            let span = raw.harmonic.as_ref().map_or(at.span.clone(), Spanned::span);
            checker.fault(
                span,
                Fault::HarmonicNotKept {
                    path,
                    harmonic,
                    harmonics,
                },
            );
        }
        specs.push((|| {
            Some(ExcitationSpec {
                points: points?,
                direction: direction?,
                force_n: force_n?,
                harmonic: harmonic?,
                phase_rad: phase_deg?.to_radians(),
            })
        })());
    }
    specs.into_iter().collect()
}

pub fn observations(
    checker: &mut Checker,
    raw: &[Spanned<RawObserve>],
) -> Option<Vec<ObservationSpec>> {
    let (mut specs, mut names) = (Vec::new(), Vec::new());
    for (index, table) in raw.iter().enumerate() {
        let at = Table::of(
            "observe",
            table.span(),
            Some((index, &table.get_ref().name)),
        );
        let raw = table.get_ref();
        names.extend(
            raw.name
                .iter()
                .map(|n| (at.key("name"), n.get_ref().clone(), n.span())),
        );
        let name = checker.required_name(&at, &raw.name);
        let points = checker.text(&at, "points", &raw.points);
        let direction = checker.direction(&at, "direction", &raw.direction);
        specs.push((|| {
            Some(ObservationSpec {
                name: name?,
                points: points?,
                direction: direction?,
            })
        })());
    }
    checker.distinct(&names);
    specs.into_iter().collect()
}
