//! Checks `[response]`, `[[engine_order]]` and `[[mission]]`.

use serde_spanned::Spanned;

use super::fields::{Checker, SceneTable, places};
use crate::scene::entries::{RawEngineOrder, RawMission, RawResponse, RawScene};
use crate::scene::error::SceneFault;
use crate::scene::raw::Number;
use dovetail_solver::description::{
    EngineOrder, ExcitedOrder, FrequencyRange, MissionPart, ResponseSpec,
};
use dovetail_solver::dlft::settings::Resolution;

/// Number of speeds of a run-up where none is given: each takes a reduction of its own.
const RUN_UP_POINTS: usize = 40;

pub fn response(checker: &mut Checker, raw: &Spanned<RawResponse>) -> Option<ResponseSpec> {
    let at = SceneTable::new("response", raw.span(), None);
    let raw = raw.get_ref();
    let points = checker.optional_count(&at, "points", &raw.points, None);
    let along = run_up_order(checker, &at, raw);
    let range = frequency_range(checker, &at, raw, points.flatten(), along.flatten());
    let (resolution, tolerance) = resolution(checker, &at, raw);
    let most = resolution.map(Resolution::most_harmonics);
    let compare = checker.optional_count(&at, "compare_harmonics", &raw.compare_harmonics, most);
    let eps = checker.choice(&at, "eps", &raw.eps);
    let eps_scale = checker.number(&at, "eps_scale", &raw.eps_scale);
    let iterations = checker.count(&at, "max_newton_iterations", &raw.max_newton_iterations);
    let key = "most_seconds_per_frequency";
    let most_seconds = checker.optional_number(&at, key, &raw.most_seconds_per_frequency);
    let solver = checker.choice(&at, "solver", &raw.solver);
    let stuck_modes = checker.optional_count(&at, "stuck_modes", &raw.stuck_modes, None);
    let stability = checker.choice(&at, "stability", &raw.stability);
    let threshold = checker.optional_number(&at, "slip_threshold_m", &raw.slip_threshold_m);
    Some(ResponseSpec {
        range: range?,
        points: match (points?, along?) {
            (None, Some(_)) if !matches!(range, Some(one) if is_single_frequency(one)) => {
                Some(RUN_UP_POINTS)
            }
            (None, Some(_)) => Some(1),
            (points, _) => points,
        },
        along_engine_order: along?,
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
        stability: stability?,
    })
}

/// Resolution (harmonics and samples, or an accuracy), and the given or resulting tolerance.
fn resolution(
    checker: &mut Checker,
    at: &SceneTable,
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
            let resolution = default_resolution(checker, at, raw);
            (resolution, resolution.map(Resolution::tolerance))
        }
    }
}

/// Harmonics and samples as given.
fn fixed(checker: &mut Checker, at: &SceneTable, raw: &RawResponse) -> Option<Resolution> {
    let harmonics = match &raw.harmonics {
        Some(none) if none.get_ref().0 == 0 => {
            checker.fault(none.span(), SceneFault::NoHarmonic);
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
        let fault = SceneFault::TooFewSamples {
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
fn default_resolution(
    checker: &mut Checker,
    at: &SceneTable,
    raw: &RawResponse,
) -> Option<Resolution> {
    let of_harmonics = places!(raw; samples, tolerance);
    let remedy = "give response.harmonics, too (harmonics = 3), or leave this out: from response.accuracy, by \
                  default 0.01, harmonics, samples and tolerance follow";
    checker.note_missing_partners(at, &of_harmonics, "harmonics", remedy)?;
    let accuracy = checker.number(at, "accuracy", &raw.accuracy)?;
    Some(Resolution::Accuracy(accuracy))
}

/// Resolution by an accuracy. Keys that the accuracy determines must not be given.
fn adapted(
    checker: &mut Checker,
    at: &SceneTable,
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

/// Engine order of a run-up, which excludes keys that make sense at one speed alone.
fn run_up_order(
    checker: &mut Checker,
    at: &SceneTable,
    raw: &RawResponse,
) -> Option<Option<EngineOrder>> {
    let key = "along_engine_order";
    let Some(order) = &raw.along_engine_order else {
        let remedy = "a range of speeds is that of a run-up: give the engine order of the excitation, \
                      or the range as `frequency_hz`";
        checker.note_missing_partners(at, &places!(raw; speed_rpm), key, remedy)?;
        return Some(None);
    };
    let given = (key, order.span());
    let remedy = "a run-up has one response: leave out `compare_harmonics`, and look at the estimated \
                  errors of `response.csv`";
    checker.exclude(at, given.clone(), &places!(raw; compare_harmonics), remedy)?;
    let remedy = "the first linear mode is another one at each speed: give the range of a run-up as \
                  `speed_rpm`, or in hertz as `frequency_hz`";
    let relative = places!(raw; times_first_linear_mode);
    checker.exclude(at, given, &relative, remedy)?;
    let order = checker.optional_count(at, key, &raw.along_engine_order, None)?;
    Some(order.map(EngineOrder))
}

/// Checks that something turns, and not only at rest, where the response is along an engine order.
pub fn turns(checker: &mut Checker, raw: &RawScene) {
    let response = raw.response.as_ref().map(Spanned::get_ref);
    let Some(order) = response.and_then(|r| r.along_engine_order.as_ref()) else {
        return;
    };
    let at = SceneTable::new("response", order.span(), None);
    let statics = raw.static_state.as_ref().map(Spanned::get_ref);
    if let Some(tractions) = statics.and_then(|s| s.starting_tractions.as_ref())
        && tractions.get_ref().0 > 0
    {
        let fault = SceneFault::Exclusive {
            first: "static.starting_tractions".to_owned(),
            second: at.key("along_engine_order"),
            remedy: "in a run-up each speed has its own static state: ask for starting tractions in a \
                     response at one speed",
        };
        checker.fault(tractions.span(), fault);
    }
    let Some(rotation) = &raw.rotation else {
        let fault = SceneFault::Lacks {
            path: at.key("along_engine_order"),
            needs: "[rotation]".to_owned(),
            remedy: if raw.reduced_model.is_some() {
                "a reduced model is that of one speed: give the bodies and their meshes in its place, or \
                 leave out `along_engine_order`"
            } else {
                "give a section [rotation] with the axis and the speed of the static state"
            },
        };
        checker.fault(order.span(), fault);
        return;
    };
    if let Some(speed) = &rotation.get_ref().speed_rpm
        && speed.get_ref().0 == 0.0
    {
        let fault = SceneFault::OutOfRange {
            path: "rotation.speed_rpm".to_owned(),
            value: "0".to_owned(),
            limits: "above 0 with response.along_engine_order: the static state and the modes are \
                     those at this speed"
                .to_owned(),
            share: None,
        };
        checker.fault(speed.span(), fault);
    }
}

/// Engine orders of the Campbell diagram, of which no two are the same.
pub fn engine_orders(
    checker: &mut Checker,
    raw: &[Spanned<RawEngineOrder>],
) -> Option<Vec<ExcitedOrder>> {
    let order = |checker: &mut Checker, at: &SceneTable, raw: &RawEngineOrder| {
        let order = checker.count(at, "order", &raw.order);
        let times = checker.optional_number(at, "times", &raw.times);
        Some(ExcitedOrder {
            order: EngineOrder(order?),
            times: times?,
        })
    };
    let found = checker.items("engine_order", raw, |_| &None, order);
    let orders = raw.iter().filter_map(|item| item.get_ref().order.as_ref());
    let named = orders.map(|order| {
        let path = "engine_order.order".to_owned();
        (path, order.get_ref().0.to_string(), order.span())
    });
    checker.distinct(&named.collect::<Vec<_>>());
    found
}

/// Vibrations that wear the contacts.
pub fn mission(checker: &mut Checker, raw: &[Spanned<RawMission>]) -> Option<Vec<MissionPart>> {
    let part = |checker: &mut Checker, at: &SceneTable, raw: &RawMission| {
        let share = checker.number(at, "share", &raw.share);
        let frequency_hz = checker.optional_number(at, "frequency_hz", &raw.frequency_hz);
        let force_scale = checker.number(at, "force_scale", &raw.force_scale);
        Some(MissionPart {
            share: share?,
            frequency_hz: frequency_hz?,
            force_scale: force_scale?,
        })
    };
    checker.items("mission", raw, |_| &None, part)
}

/// Returns `true` if a range is one frequency.
fn is_single_frequency(range: FrequencyRange) -> bool {
    match range {
        FrequencyRange::Hz { from_hz, to_hz } => from_hz == to_hz,
        FrequencyRange::OfFirstLinearMode { from, to } => from == to,
    }
}

fn frequency_range(
    checker: &mut Checker,
    at: &SceneTable,
    raw: &RawResponse,
    points: Option<usize>,
    along: Option<EngineOrder>,
) -> Option<FrequencyRange> {
    let ranges = [
        ("frequency_hz", &raw.frequency_hz),
        ("times_first_linear_mode", &raw.times_first_linear_mode),
        ("speed_rpm", &raw.speed_rpm),
    ];
    let mut given = ranges
        .into_iter()
        .filter_map(|(k, v)| Some((k, v.as_ref()?)));
    let Some((key, value)) = given.next() else {
        let other = match raw.along_engine_order {
            Some(_) => "speed_rpm",
            None => "times_first_linear_mode",
        };
        checker.require_one_of(at, &["frequency_hz", other], other);
        return None;
    };
    let others: Vec<_> = given.map(|(k, v)| (k, Some(v.span()))).collect();
    let remedy = "keep one of `frequency_hz` (in Hz), `times_first_linear_mode` (relative) and, with \
                  `along_engine_order`, `speed_rpm`";
    checker.exclude(at, (key, value.span()), &others, remedy)?;
    let [from, to] = value.get_ref().0;
    let one_point = from == to && points.is_none_or(|points| points == 1);
    if from <= 0.0 || (from >= to && !one_point) {
        let path = at.key(key);
        checker.fault(value.span(), SceneFault::EmptyRange { path, from, to });
        return None;
    }
    Some(match (key, along) {
        ("frequency_hz", _) => FrequencyRange::Hz {
            from_hz: from,
            to_hz: to,
        },
        ("speed_rpm", along) => {
            let [from_hz, to_hz] = [from, to].map(|rpm| Some(along?.frequency_hz(rpm)));
            FrequencyRange::Hz {
                from_hz: from_hz?,
                to_hz: to_hz?,
            }
        }
        _ => FrequencyRange::OfFirstLinearMode { from, to },
    })
}
