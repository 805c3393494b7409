//! Responses of twice the period of the excitation, to which a period doubling leads: harmonic balance
//! with half the frequency. The excitation then has only even harmonics, and the odd harmonics of the
//! motion distinguish its two periods. Integration in time from an unstable response gives the first
//! motion of a branch.

use super::judge;
use crate::damping::Rayleigh;
use crate::dlft::branch::follow_through;
use crate::dlft::settings::Resolution;
use crate::dlft::sweep::SweepSettings;
use crate::dlft::{Branch, Orbit, Response, StaticState};
use crate::integration::departure::Departure;
use crate::problem::Problem;
use rayon::prelude::*;
use std::ops::Range;

/// Share of the odd harmonics in a motion below which both periods are the same.
const SAME: f64 = 1e-3;

/// Follows the response of twice the period to which an unstable motion has departed, from its frequency
/// towards the first and the last frequency of the settings, and judges its motions. The branch ends where
/// its two periods become the same. `None` if the departure did not reach such a response. Travelling
/// waves have none: an odd harmonic of half the frequency has no whole number of nodal diameters.
pub fn two_periods(
    problem: &Problem,
    damping: Rayleigh,
    state: &StaticState,
    settings: &SweepSettings,
    departure: &Departure,
) -> Option<Response> {
    let start = departure.doubled.as_ref()?;
    let problem = problem.over_two_periods();
    let settings = over_two_periods(settings);
    let followed = follow_through(&problem, damping, state, &settings, start);
    let mut response = with_different_periods(followed, start.frequency_hz)?;
    let verdict = |orbit: &Orbit| judge(&problem, damping, state, orbit);
    let verdicts: Vec<_> = response.orbits.par_iter().map(verdict).collect();
    for (orbit, verdict) in response.orbits.iter_mut().zip(verdicts) {
        orbit.stability = verdict;
    }
    Some(response)
}

/// Settings of half the frequency.
fn over_two_periods(settings: &SweepSettings) -> SweepSettings {
    let frequencies_hz = settings.frequencies_hz.iter().map(|hz| 0.5 * hz);
    let resolution = match settings.resolution {
        Resolution::Fixed { harmonics, samples } => Resolution::fixed(2 * harmonics, 2 * samples),
        accuracy @ Resolution::Accuracy(_) => accuracy,
    };
    SweepSettings {
        frequencies_hz: frequencies_hz.collect(),
        resolution,
        ..settings.clone()
    }
}

/// The part of a branch around its motion at `start_hz` on which both periods differ in the same sense:
/// where the odd harmonics vanish it goes on through the same motions, shifted by a period.
fn with_different_periods(response: Response, start_hz: f64) -> Option<Response> {
    let orbits = &response.orbits;
    let at_start = |at: &usize| orbits[*at].frequency_hz == start_hz && is_doubled(&orbits[*at]);
    let start = (0..orbits.len()).find(at_start)?;
    let goes_on = |from: usize, to: usize| {
        let [a, b] = [from, to].map(|at| &orbits[at]);
        let product: f64 = odd(a).zip(odd(b)).map(|(a, b)| a * b).sum();
        is_doubled(b) && product > 0.0
    };
    let mut kept = start..start + 1;
    while kept.start > 0 && goes_on(kept.start, kept.start - 1) {
        kept.start -= 1;
    }
    while kept.end < orbits.len() && goes_on(kept.end - 1, kept.end) {
        kept.end += 1;
    }
    Some(part_of(&response, kept))
}

/// Returns `true` if both periods of a motion differ.
fn is_doubled(orbit: &Orbit) -> bool {
    let square = |sum: f64, v: &f64| sum + v * v;
    let vibration = orbit.observed.iter().flat_map(|c| c.iter().skip(1));
    let whole = vibration.fold(0.0, square);
    orbit.outcome.has_motion() && odd(orbit).fold(0.0, square) > SAME * SAME * whole
}

/// Coefficients of the odd harmonics of the observed displacements.
fn odd(orbit: &Orbit) -> impl Iterator<Item = &f64> {
    fn of_one(coefficients: &[f64]) -> impl Iterator<Item = &f64> {
        let parts = coefficients.get(1..).unwrap_or_default();
        parts.chunks(2).step_by(2).flatten()
    }
    orbit.observed.iter().flat_map(|c| of_one(c))
}

/// A part of the only branch of a response.
fn part_of(response: &Response, kept: Range<usize>) -> Response {
    let branch = &response.branches[0];
    let part = |all: &[f64]| all.get(kept.clone()).unwrap_or_default().to_vec();
    let linear = response.linear[kept.clone()].to_vec();
    Response {
        branches: vec![Branch {
            points: 0..kept.len(),
            lengths: part(&branch.lengths),
            abscissae: part(&branch.abscissae),
            ..Branch::default()
        }],
        orbits: response.orbits[kept.clone()].to_vec(),
        linear_curve: linear.clone(),
        linear,
        slip_threshold_m: response.slip_threshold_m,
        ..Response::default()
    }
}
