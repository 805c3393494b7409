//! Says what to mind about a response.

use super::reduced::Reduced;
use crate::warning::{Warning, Weight};
use dovetail_solver::dlft::peaks::LEAST_RISE;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::{Orbit, Outcome, Response};
use dovetail_solver::results::far_slip::TOO_FAR;
use dovetail_solver::results::quantities::{peak, peak_is_at_an_end, peak_rise};

/// Estimated errors above this are warned of.
const TRUNCATED: f64 = 0.02;

fn wrong(text: String) -> Warning {
    let weight = Weight::Wrong;
    Warning { weight, text }
}

fn doubt(text: String) -> Warning {
    let weight = Weight::Doubt;
    Warning { weight, text }
}

/// What failed first, then what is doubtful.
pub(super) fn warnings(reduced: &Reduced, response: &Response) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let all = response.orbits.len();
    let ended = |outcome: Outcome| {
        response
            .orbits
            .iter()
            .filter(|o| o.outcome == outcome)
            .count()
    };
    let leaving = ended(Outcome::LeavesSlot);
    if leaving > 0 {
        warnings.push(wrong(format!(
            "at {leaving} of {all} frequencies the blade would leave its slot: even applied slowly the excitation pulls harder at the \
             flanks than the steady load presses them together; excite it less (force_n), or press it harder \
             (rotation.speed_rpm, [[load]])"
        )));
    }
    let sliding = ended(Outcome::SlidesTooFar);
    if sliding > 0 {
        warnings.push(wrong(format!(
            "at {sliding} of {all} frequencies a pair slides farther than {} % of the shorter side of its flank, which contact between \
             pairs of nodes does not cover (outcome slides_too_far of response.csv)",
            100.0 * TOO_FAR,
        )));
    }
    let held = |o: &&Orbit| o.outcome.is_converged() && o.retention_n > 0.0;
    let held: Vec<&Orbit> = response.orbits.iter().filter(held).collect();
    if !held.is_empty() {
        let largest_n = held.iter().fold(0.0_f64, |m, o| m.max(o.retention_n));
        warnings.push(doubt(format!(
            "at {} of {all} frequencies friction does not hold the blade along its slot: its mean position was held there, \
             as a lock plate does, with up to {largest_n:.3} N (column retention_n of response.csv)",
            held.len(),
        )));
    }
    let inaccurate = ended(Outcome::AccuracyNotReached);
    if inaccurate > 0 {
        warnings.push(doubt(format!(
            "at {inaccurate} of {all} frequencies the error is estimated above the accuracy asked for: with more harmonics, at most {}, no \
             motion was found or the estimate did not fall (outcome accuracy_not_reached and column estimated_error of response.csv)",
            Resolution::MOST_ADAPTED,
        )));
    } else {
        warnings.extend(truncation(response));
    }
    for (i, name) in reduced.observations().into_iter().enumerate() {
        warnings.extend(hidden_peak(name, i, response));
    }
    warnings
}

/// Harmonics that were asked for may be too few.
fn truncation(response: &Response) -> Option<Warning> {
    let converged = response.orbits.iter().filter(|o| o.outcome.is_converged());
    let errors: Vec<f64> = converged.filter_map(|o| o.estimated_error).collect();
    let above = errors.iter().filter(|e| **e > TRUNCATED).count();
    (above > 0).then(|| {
        let finite = errors.iter().filter(|e| e.is_finite());
        doubt(format!(
            "at {above} of {} frequencies the harmonics left out are estimated to change the amplitude by more than {} %, at worst by {:.1} % \
             (column estimated_error of response.csv): take more response.harmonics, or response.accuracy = 0.01 in their place",
            response.orbits.len(),
            100.0 * TRUNCATED,
            100.0 * finite.fold(0.0, |m, e| e.max(m)),
        ))
    })
}

/// What may lie outside of the range, or between two frequencies.
fn hidden_peak(name: &str, observation: usize, response: &Response) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let at_end = peak(response, observation).filter(|_| peak_is_at_an_end(response, observation));
    if let Some(peak) = at_end {
        warnings.push(doubt(format!(
            "the largest amplitude of {name} is at an end of the range, {:.3} Hz: a peak may lie outside; widen response.frequency_hz \
             or response.times_first_linear_mode",
            peak.frequency_hz
        )));
    }
    if let Some(rise) = peak_rise(response, observation).filter(|rise| *rise > LEAST_RISE) {
        warnings.push(doubt(format!(
            "between two frequencies the peak of {name} may be {:.1} % higher: take more response.points, a narrower range, or more \
             response.most_added_points",
            100.0 * rise
        )));
    }
    warnings
}
