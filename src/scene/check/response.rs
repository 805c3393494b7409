//! Checks `[response]`.

use serde_spanned::Spanned;

use super::fields::{Checker, Table, places};
use crate::scene::entries::RawResponse;
use crate::scene::error::Fault;
use crate::scene::raw::Number;
use dovetail_solver::description::{FrequencyRange, ResponseSpec};
use dovetail_solver::dlft::settings::{EpsChoice, Resolution, Solver};

pub fn response(checker: &mut Checker, raw: &Spanned<RawResponse>) -> Option<ResponseSpec> {
    let at = Table::of("response", raw.span(), None);
    let raw = raw.get_ref();
    let points = checker.optional_count(&at, "points", &raw.points, None);
    let range = frequency_range(checker, &at, raw, points.flatten());
    let (resolution, tolerance) = resolution(checker, &at, raw);
    let most = resolution.map(Resolution::most_harmonics);
    let compare = checker.optional_count(&at, "compare_harmonics", &raw.compare_harmonics, most);
    use EpsChoice::{Dynamic, Pair, SpectralRadius};
    let eps = checker.choice(&at, "eps", &raw.eps, &[Dynamic, Pair, SpectralRadius]);
    let eps_scale = checker.number(&at, "eps_scale", &raw.eps_scale);
    let iterations = checker.count(&at, "max_newton_iterations", &raw.max_newton_iterations);
    let key = "most_seconds_per_frequency";
    let most_seconds = checker.optional_number(&at, key, &raw.most_seconds_per_frequency);
    let solvers = [Solver::NewtonKrylov, Solver::Powell];
    let solver = checker.choice(&at, "solver", &raw.solver, &solvers);
    let stuck_modes = checker.optional_count(&at, "stuck_modes", &raw.stuck_modes, None);
    let threshold = checker.optional_number(&at, "slip_threshold_m", &raw.slip_threshold_m);
    Some(ResponseSpec {
        range: range?,
        points: points?,
        resolution: resolution?,
        compare_harmonics: compare?,
        eps: eps?,
        eps_scale: eps_scale?,
        tolerance: tolerance?,
        max_newton_iterations: iterations?,
        most_seconds_per_frequency: most_seconds?,
        solver: solver?,
        stuck_modes: stuck_modes?,
        slip_threshold_m: threshold?,
    })
}

/// Resolution (harmonics and samples, or an accuracy), and the given or resulting tolerance.
fn resolution(
    checker: &mut Checker,
    at: &Table,
    raw: &RawResponse,
) -> (Option<Resolution>, Option<f64>) {
    match (&raw.accuracy, &raw.harmonics) {
        (Some(accuracy), _) => (
            adapted(checker, at, raw, accuracy),
            Some(Resolution::Accuracy(accuracy.get_ref().0).tolerance()),
        ),
        (None, Some(_)) => (
            fixed(checker, at, raw),
            checker.number(at, "tolerance", &raw.tolerance),
        ),
        (None, None) => {
            let resolution = by_default(checker, at, raw);
            (resolution, resolution.map(Resolution::tolerance))
        }
    }
}

/// Harmonics and samples as given.
fn fixed(checker: &mut Checker, at: &Table, raw: &RawResponse) -> Option<Resolution> {
    let harmonics = match &raw.harmonics {
        Some(none) if none.get_ref().0 == 0 => {
            checker.fault(none.span(), Fault::NoHarmonic);
            None
        }
        _ => checker.count(at, "harmonics", &raw.harmonics),
    };
    let samples = checker.count(at, "samples", &raw.samples);
    let (harmonics, samples) = (harmonics?, samples?);
    let least = Resolution::least_samples(harmonics);
    if samples < least {
        let span = raw.samples.as_ref().or(raw.harmonics.as_ref());
        let span = span.map_or(at.span.clone(), Spanned::span);
        let fault = Fault::TooFewSamples {
            samples,
            harmonics,
            least,
        };
        checker.fault(span, fault);
    }
    Some(Resolution::fixed(harmonics, samples))
}

/// Default resolution, if neither harmonics nor an accuracy are given. Keys that need harmonics are
/// a fault.
fn by_default(checker: &mut Checker, at: &Table, raw: &RawResponse) -> Option<Resolution> {
    let of_harmonics = places!(raw; samples, tolerance);
    let remedy = "give response.harmonics, too (harmonics = 3), or leave this out: from response.accuracy, by \
                  default 0.01, harmonics, samples and tolerance follow";
    checker.all_lack(at, &of_harmonics, "harmonics", remedy)?;
    let accuracy = checker.number(at, "accuracy", &raw.accuracy)?;
    Some(Resolution::Accuracy(accuracy))
}

/// Resolution by an accuracy. Keys that the accuracy determines must not be given.
fn adapted(
    checker: &mut Checker,
    at: &Table,
    raw: &RawResponse,
    accuracy: &Spanned<Number>,
) -> Option<Resolution> {
    let others = places!(raw; harmonics, samples, tolerance);
    let remedy =
        "keep `accuracy`, from which harmonics, samples and tolerance follow, or those, not both";
    checker.exclude(at, ("accuracy", accuracy.span()), &others, remedy)?;
    let accuracy = checker.number(at, "accuracy", &raw.accuracy)?;
    Some(Resolution::Accuracy(accuracy))
}

fn frequency_range(
    checker: &mut Checker,
    at: &Table,
    raw: &RawResponse,
    points: Option<usize>,
) -> Option<FrequencyRange> {
    let (key, value) = match (&raw.frequency_hz, &raw.times_first_linear_mode) {
        (Some(hz), None) => ("frequency_hz", hz),
        (None, Some(times)) => ("times_first_linear_mode", times),
        (Some(hz), Some(_)) => {
            let times = places!(raw; times_first_linear_mode);
            let remedy =
                "keep `frequency_hz` (in Hz) or `times_first_linear_mode` (relative), not both";
            checker.exclude(at, ("frequency_hz", hz.span()), &times, remedy)?;
            return None;
        }
        (None, None) => {
            let [hz, times] = ["frequency_hz", "times_first_linear_mode"];
            checker.none_of(at, &[hz, times], times);
            return None;
        }
    };
    let [from, to] = value.get_ref().0;
    let one_point = from == to && points.is_none_or(|points| points == 1);
    if from <= 0.0 || (from >= to && !one_point) {
        let path = at.key(key);
        checker.fault(value.span(), Fault::EmptyRange { path, from, to });
        return None;
    }
    Some(if key == "frequency_hz" {
        FrequencyRange::Hz {
            from_hz: from,
            to_hz: to,
        }
    } else {
        FrequencyRange::OfFirstLinearMode { from, to }
    })
}
