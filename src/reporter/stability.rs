//! Warnings about unstable motions.

use dovetail_export::manifest::response_summary;
use dovetail_export::warning::{Warning, accuracy_warning, remark, wrong};
use dovetail_export::words::{counted, figure, quantity};
use dovetail_solver::dlft::branch::folds;
use dovetail_solver::dlft::{Orbit, Response};
use dovetail_solver::results::peak::largest_amplitude;
use dovetail_solver::run::{Observed, ReducedScene, ResponseResult};
use dovetail_solver::stability::Kind;

/// Warnings about peaks that are unstable and about branches of responses of twice the period, and a
/// remark on a peak that was not judged.
pub(super) fn unstable_peaks(reduced: &ReducedScene, found: &ResponseResult) -> Vec<Warning> {
    let summary = response_summary(
        &reduced.pairs,
        None,
        &found.response,
        None,
        &found.departures,
    );
    let peaks = std::iter::once(&summary.first).chain(&summary.other_observations);
    let observed = reduced.observations();
    let mut warnings = Vec::new();
    for (one, peak) in observed.iter().zip(peaks) {
        let (Some(stability), Some(hz)) = (&peak.peak_stability, peak.peak_frequency_hz) else {
            continue;
        };
        let (name, unit) = (&one.name, one.quantity.unit());
        if let Some(reason) = &stability.not_judged {
            warnings.push(remark(format!(
                "the stability of the peak of {name} was not judged: {reason}"
            )));
        }
        let Some(instability) = stability.instability_words() else {
            continue;
        };
        let stable = stability
            .largest_stable_amplitude_m
            .zip(stability.largest_stable_frequency_hz);
        let stable = match stable {
            Some((amplitude, at_hz)) => format!(
                "the largest stable amplitude that was found is {} at {} Hz",
                quantity(amplitude, unit, 4),
                figure(at_hz, 6)
            ),
            None => "no stable motion was found".to_owned(),
        };
        let departure = stability.departure.as_ref().map_or(String::new(), |departure| {
            let [least, most] = departure.amplitude_range_m.map(|a| quantity(a, unit, 4));
            format!(
                "; an integration in time from the peak had amplitudes of single periods from {least} to {most} \
                 after {} periods",
                departure.periods / 2
            )
        });
        warnings.push(wrong(format!(
            "the peak of {name} at {} Hz is unstable ({instability}), and the structure does not stay in this motion: \
             {stable}{departure}",
            figure(hz, 6),
        )));
    }
    let unit = observed.first().map_or("m", |first| first.quantity.unit());
    let branches = summary.two_periods_words(unit).into_iter();
    let warning = |words| {
        accuracy_warning(format!(
            "{words} (rows of response.csv with 2 in the column periods)"
        ))
    };
    warnings.extend(branches.map(warning));
    warnings
}

/// Warning about motions that were judged unstable, but for peaks and for those between two folds,
/// which have warnings of their own.
pub(super) fn unstable_motions(response: &Response, observed: &[Observed]) -> Option<Warning> {
    let peaks = (0..observed.len()).filter_map(|i| largest_amplitude(response, i));
    let peaks: Vec<usize> = peaks.map(|peak| peak.index).collect();
    let has_folds = !folds(response).is_empty();
    let is_told = |(at, orbit): &(usize, &Orbit)| match orbit.stability.kind() {
        Some(Kind::Real) => !has_folds && !peaks.contains(at),
        Some(_) => !peaks.contains(at),
        None => false,
    };
    let orbits = response.orbits.iter().enumerate();
    let unstable: Vec<f64> = orbits
        .filter(is_told)
        .map(|(_, o)| o.frequency_hz)
        .collect();
    let from = unstable.iter().copied().reduce(f64::min)?;
    let to = unstable.iter().copied().reduce(f64::max)?;
    let are = if unstable.len() == 1 { "is" } else { "are" };
    Some(accuracy_warning(format!(
        "{} {are} unstable, between {} and {} Hz: the structure does not stay in them (columns stable and instability \
         of response.csv, dashed in the plots)",
        counted(unstable.len(), "motion", "motions"),
        figure(from, 6),
        figure(to, 6),
    )))
}
