//! `[response]`.

use serde_spanned::Spanned;

use super::fields::{Checker, Limits, Table};
use crate::scene::error::Fault;
use crate::scene::keys;
use crate::scene::raw::RawResponse;
use crate::scene::{EpsChoice, FrequencyRange, ResponseSpec, Solver};

/// More harmonics, samples or frequencies than these are taken for a slip of the pen.
pub const MOST_HARMONICS: usize = 1_000;
const MOST_SAMPLES: usize = 1 << 20;
const MOST_POINTS: usize = 1_000_000;

pub fn response(checker: &mut Checker, raw: &Spanned<RawResponse>) -> Option<ResponseSpec> {
    let at = Table::of("response", raw.span(), None);
    let raw = raw.get_ref();
    let points = checker.count(&at, "points", &raw.points, 1..=MOST_POINTS, 200);
    let range = frequency_range(checker, &at, raw, points);
    let harmonics = match &raw.harmonics {
        Some(none) if none.get_ref().0 == 0 => {
            checker.fault(none.span(), Fault::NoHarmonic);
            None
        }
        _ => checker.count(&at, "harmonics", &raw.harmonics, 1..=MOST_HARMONICS, 3),
    };
    let compare = raw.compare_harmonics.as_ref().map(|_| {
        let most = harmonics.unwrap_or(MOST_HARMONICS);
        checker.count(
            &at,
            "compare_harmonics",
            &raw.compare_harmonics,
            1..=most,
            1,
        )
    });
    let samples = checker.count(&at, "samples", &raw.samples, 1..=MOST_SAMPLES, 128);
    if let (Some(harmonics), Some(samples)) = (harmonics, samples)
        && samples <= 2 * harmonics + 1
    {
        let span = raw
            .samples
            .as_ref()
            .map(Spanned::span)
            .or(raw.harmonics.as_ref().map(Spanned::span));
        let fault = Fault::TooFewSamples {
            samples,
            harmonics,
            least: 2 * harmonics + 2,
        };
        checker.fault(span.unwrap_or(at.span.clone()), fault);
    }
    let eps = checker.choice(
        &at,
        "eps",
        &raw.eps,
        &["pair", "spectral_radius"],
        &[EpsChoice::Pair, EpsChoice::SpectralRadius],
    );
    let eps_scale = checker.number(
        &at,
        "eps_scale",
        &raw.eps_scale,
        Limits::POSITIVE,
        Some(1.0),
    );
    let tolerance = checker.number(
        &at,
        "tolerance",
        &raw.tolerance,
        Limits::between(0.0, 1.0),
        Some(1e-8),
    );
    let iterations = checker.count(
        &at,
        "max_newton_iterations",
        &raw.max_newton_iterations,
        1..=100_000,
        60,
    );
    let solver = checker.choice(
        &at,
        "solver",
        &raw.solver,
        &["newton_krylov", "powell"],
        &[Solver::NewtonKrylov, Solver::Powell],
    );
    let stuck_modes = raw
        .stuck_modes
        .as_ref()
        .map(|_| checker.count(&at, "stuck_modes", &raw.stuck_modes, 1..=10_000, 1));
    let threshold = raw.slip_threshold_m.as_ref().map(|_| {
        checker.number(
            &at,
            "slip_threshold_m",
            &raw.slip_threshold_m,
            Limits::NOT_NEGATIVE,
            None,
        )
    });
    Some(ResponseSpec {
        range: range?,
        points: points?,
        harmonics: harmonics?,
        compare_harmonics: match compare {
            None => None,
            Some(compare) => Some(compare?),
        },
        samples: samples?,
        eps: eps?,
        eps_scale: eps_scale?,
        tolerance: tolerance?,
        max_newton_iterations: iterations?,
        solver: solver?,
        stuck_modes: match stuck_modes {
            None => None,
            Some(modes) => Some(modes?),
        },
        slip_threshold_m: match threshold {
            None => None,
            Some(threshold) => Some(threshold?),
        },
    })
}

fn frequency_range(
    checker: &mut Checker,
    at: &Table,
    raw: &RawResponse,
    points: Option<usize>,
) -> Option<FrequencyRange> {
    let (key, value) = match (&raw.frequency_hz, &raw.times_first_stuck_mode) {
        (Some(hz), None) => ("frequency_hz", hz),
        (None, Some(times)) => ("times_first_stuck_mode", times),
        (Some(hz), Some(times)) => {
            let times = [("times_first_stuck_mode", Some(times.span()))];
            let remedy =
                "keep `frequency_hz` (in Hz) or `times_first_stuck_mode` (relative), not both";
            checker.exclude(at, ("frequency_hz", hz.span()), &times, remedy)?;
            return None;
        }
        (None, None) => {
            let paths = vec![at.key("frequency_hz"), at.key("times_first_stuck_mode")];
            let example = keys::example("response", "times_first_stuck_mode");
            checker.fault(at.span.clone(), Fault::NoneOf { paths, example });
            return None;
        }
    };
    let [from, to] = value.get_ref().0;
    let one_point = from == to && points == Some(1);
    if from <= 0.0 || (from >= to && !one_point) {
        checker.fault(
            value.span(),
            Fault::EmptyRange {
                path: at.key(key),
                from,
                to,
            },
        );
        return None;
    }
    Some(match key {
        "frequency_hz" => FrequencyRange::Hz {
            from_hz: from,
            to_hz: to,
        },
        _ => FrequencyRange::OfFirstStuckMode { from, to },
    })
}
