//! Last output of a run: its peaks beside the linear ones, the states of the joint there, the time
//! of the run, and the file to open.

use std::path::Path;

use crate::console::Verbosity;
use dovetail_export::manifest::{
    ObservedPeak, RankedBy, ResponseSummary, StageSummary, StaticSummary, StressSummary, Summary,
    TractionRangeSummary,
};
use dovetail_export::report::REPORT;
use dovetail_export::words::{cycle_counts, figure, percent, quantity, short, static_counts};
use dovetail_solver::description::EngineOrder;
use dovetail_solver::run::{Observed, Run};

/// Share of the time below which a stage is not named.
const LEAST_SHARE: f64 = 0.1;
/// Smallest width of the first column, and the width of a number in the second and third.
const WIDTHS: [usize; 2] = [14, 16];

/// Last lines of a run; one line if the verbosity is quiet.
pub(super) fn closing_lines(
    run: &Run,
    summary: &Summary,
    folder: &Path,
    verbosity: Verbosity,
) -> String {
    let observed = run.reduced.observations();
    let response = summary.response.as_ref();
    let peaks = response.map(|response| response.peaks_of(&observed).collect());
    let peaks: Vec<NamedPeak<'_>> = peaks.unwrap_or_default();
    let report = folder.join(REPORT);
    match verbosity {
        Verbosity::Quiet => format!("{}; {}\n", one_line(summary, &peaks), report.display()),
        Verbosity::Normal | Verbosity::Verbose => {
            let laws = &run.reduced.problem.laws;
            let column = match laws.iter().any(|law| law.friction > 0.0) {
                true => "with friction",
                false => "with contact",
            };
            let column = (!laws.is_empty()).then_some(column);
            lines(summary, &peaks, column, &report)
        }
    }
}

/// Peak of an observation, and what is observed.
type NamedPeak<'a> = (&'a Observed, &'a ObservedPeak);

fn one_line(summary: &Summary, peaks: &[NamedPeak<'_>]) -> String {
    let Some(response) = &summary.response else {
        return match &summary.static_state {
            Some(state) => static_words(state),
            None => "nothing was computed".to_owned(),
        };
    };
    let one = |(observed, peak): &NamedPeak<'_>| {
        let unit = observed.quantity.unit();
        if let Some(words) = peak.not_computed_words() {
            return Some(format!("{}: {words}; ", observed.name));
        }
        let (amplitude, [_, hz]) = peak.amplitude_words(unit).zip(peak.place())?;
        let linear = peak.linear_words(unit).zip(peak.linear());
        let linear = linear.map_or(String::new(), |(amplitude, [_, hz])| {
            format!(" (linear {amplitude} at {} Hz)", figure(hz, 6))
        });
        let error = peak.error_words();
        let error = error.map_or(String::new(), |words| format!(", {words},"));
        let unstable = match peak.is_unstable() {
            true => ", unstable",
            false => "",
        };
        let (name, hz) = (&observed.name, figure(hz, 6));
        Some(format!(
            "{name}: peak {amplitude}{error} at {hz} Hz{unstable}{linear}; "
        ))
    };
    let run_up = run_up_words(response).map_or(String::new(), |words| format!(" {words}"));
    format!(
        "{}{} of {} frequencies{run_up} converged",
        peaks.iter().filter_map(one).collect::<String>(),
        response.converged_points,
        response.points
    )
}

/// Lines of a run. `nonlinear` is the heading of the response next to the linear one; `None` if all
/// contacts are bonded, and the response is linear.
fn lines(
    summary: &Summary,
    peaks: &[NamedPeak<'_>],
    nonlinear: Option<&str>,
    report: &Path,
) -> String {
    let mut text = String::from("\n");
    let title = |(observed, _): &NamedPeak<'_>| format!("peak of {}", observed.name);
    let titles = peaks.iter().map(|p| title(p).chars().count() + 1);
    let width = titles.fold(WIDTHS[0], usize::max);
    let row = |heading: &str, words: &str| format!("  {heading:<width$}{words}\n");
    // One line for each, if there are several.
    let of_contacts = |contacts: Vec<(&str, String)>| -> String {
        let several = contacts.iter().filter(|_| contacts.len() > 1);
        let lines = several.map(|(name, words)| row("", &format!("{name}: {words}")));
        lines.collect()
    };
    if let Some(state) = &summary.static_state {
        text += &row("at rest", &static_words(state));
        let contacts = state.contacts.iter();
        let counts = contacts.filter_map(|c| Some((c.name.as_str(), static_counts(c.counts?))));
        text += &of_contacts(counts.collect());
    }
    let column = WIDTHS[1];
    let along = summary.response.as_ref().and_then(|r| r.engine_order);
    if !peaks.is_empty() {
        let headings = match nonlinear {
            Some(nonlinear) => format!("{nonlinear:<column$}{:<column$}ratio", "linear"),
            None => "linear, for all contacts are bonded".to_owned(),
        };
        text += &row("", &headings);
    }
    for named in peaks {
        let (observed, peak) = named;
        let not_computed = peak.not_computed_words();
        let (linear, unit) = (peak.linear(), observed.quantity.unit());
        let dash = || "–".to_owned();
        let cells = |own: String, linear: Option<String>| match nonlinear {
            None => own,
            Some(_) => format!("{own:<column$}{:<column$}", linear.unwrap_or_else(dash)),
        };
        let none = || "not computed".to_owned();
        let amplitude = peak.amplitude_words(unit).unwrap_or_else(none);
        let amplitudes = cells(amplitude, peak.linear_words(unit));
        let hz = |[_, hz]: [f64; 2]| format!("{} Hz", figure(hz, 6));
        let own_hz = |words: &dyn Fn([f64; 2]) -> String| peak.place().map_or_else(dash, words);
        let frequencies = cells(own_hz(&hz), linear.map(hz));
        let ratio = nonlinear.map(|_| peak.ratio_words().unwrap_or_else(dash));
        let ratio = ratio.unwrap_or_default();
        text += &row(&title(named), &format!("{amplitudes}{ratio}"));
        text += &peak
            .error_words()
            .map_or(String::new(), |words| row("", &words));
        text += &row("", frequencies.trim_end());
        if let Some(order) = along {
            let rpm = |[_, hz]: [f64; 2]| format!("{} rpm", figure(order.speed_rpm(hz), 5));
            text += &row("", cells(own_hz(&rpm), linear.map(rpm)).trim_end());
        }
        text += &not_computed.map_or(String::new(), |words| row("", &words));
        let states = peak.counts().map(cycle_counts);
        let stability = peak.stability_words();
        for words in (peak.loss_words().into_iter())
            .chain(states)
            .chain(stability)
        {
            text += &row("", &words);
        }
        let contacts = peak.peak_contacts.iter();
        let counts = contacts.map(|c| (c.name.as_str(), cycle_counts(c.counts)));
        text += &of_contacts(counts.collect());
    }
    if let Some(response) = &summary.response {
        text += &run_up_words(response).map_or(String::new(), |words| row("run-up", &words));
        if let Some(range) = &response.traction_range {
            text += &row("preload", &traction_words(range));
        }
        let what = along.map_or("frequencies", |_| "speeds");
        let (converged, points) = (response.converged_points, response.points);
        text += &row(what, &format!("{converged} of {points} converged"));
    }
    if let Some(words) = summary.stress.as_ref().and_then(stress_words) {
        text += &row("stress", &words);
    }
    let (seconds, shares) = (summary.seconds, shares(&summary.stages, summary.seconds));
    text += &row("time", &format!("{} s{shares}", figure(seconds, 3)));
    text + &row("open first", &report.display().to_string())
}

/// Engine order and speeds of a run-up; `None` for other responses.
fn run_up_words(response: &ResponseSummary) -> Option<String> {
    let EngineOrder(order) = response.engine_order?;
    let [from, to] = response.speed_rpm?.map(short);
    Some(format!(
        "along engine order {order} from {from} to {to} rpm"
    ))
}

/// Range of the peak over starting tractions.
fn traction_words(range: &TractionRangeSummary) -> String {
    let [least, most] = range.peak_amplitude_m.map(|a| quantity(a, "m", 4));
    format!(
        "peak from {least} to {most} over {} starting tractions",
        range.tractions
    )
}

/// Highest stress at the peak with its mesh error, and its place.
fn stress_words(stress: &StressSummary) -> Option<String> {
    let place = stress.places.first()?;
    let figure = place.ranked_words(stress.ranked_by);
    let figure = match stress.ranked_by {
        RankedBy::Utilisation => format!("{figure} of the strength"),
        RankedBy::Amplitude => format!("amplitude {figure}"),
    };
    Some(format!("{figure} at the peak, {}", place.at_words()))
}

/// Share of each stage in the whole time, the longest first. Repeated stages are added up.
fn shares(stages: &[StageSummary], seconds: f64) -> String {
    let mut taken: Vec<(&str, f64)> = Vec::new();
    for stage in stages {
        match taken.iter_mut().find(|(name, _)| *name == stage.name) {
            Some((_, seconds)) => *seconds += stage.seconds,
            None => taken.push((&stage.name, stage.seconds)),
        }
    }
    let share = |taken: f64| taken / seconds;
    taken.retain(|(_, taken)| share(*taken) >= LEAST_SHARE);
    taken.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let words = taken
        .iter()
        .map(|(name, taken)| format!("{name} {}", percent(share(*taken).min(1.0), 2)));
    match words.collect::<Vec<_>>().join("; ") {
        none if none.is_empty() => none,
        words => format!(": {words}"),
    }
}

fn static_words(state: &StaticSummary) -> String {
    let Some(counts) = state.counts else {
        return format!("the static state did not converge: {}", state.outcome);
    };
    let pressure = state.largest_pressure_pa;
    let pressure = pressure.map_or(String::new(), |pressure| {
        format!("; largest pressure {}", quantity(pressure, "Pa", 3))
    });
    format!("{}{pressure}", static_counts(counts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_solver::reduced::ObservedQuantity;
    use dovetail_solver::run::Stage;

    #[test]
    fn columns_begin_behind_the_longest_name() {
        let peak = ObservedPeak {
            peak_amplitude_m: Some(1.087e-3),
            peak_frequency_hz: Some(450.0),
            ..ObservedPeak::default()
        };
        let observed = ["tip_le", "tip_of_trailing_edge", "tip"].map(|name| Observed {
            name: name.to_owned(),
            quantity: ObservedQuantity::Displacement,
        });
        let peaks = observed.each_ref().map(|observed| (observed, &peak));
        let told = lines(
            &Summary::default(),
            &peaks[..2],
            Some("with friction"),
            Path::new("out/report.html"),
        );
        let of = |words: &str| told.lines().find(|line| line.contains(words)).unwrap();
        assert_eq!(
            of("tip_le"),
            "  peak of tip_le               1.087 mm        –               –"
        );
        let column = |line: &str| line.find("1.087").unwrap();
        assert_eq!(column(of("tip_le")), column(of("tip_of_trailing_edge")));
        assert_eq!(
            of("open first"),
            "  open first                   out/report.html"
        );
        let short = lines(
            &Summary::default(),
            &peaks[2..],
            Some("with friction"),
            Path::new("r"),
        );
        assert!(short.contains("\n  peak of tip   1.087 mm"), "{short}");
        let linear = lines(&Summary::default(), &peaks[2..], None, Path::new("r"));
        assert!(linear.contains("\n  peak of tip   1.087 mm\n"), "{linear}");
        assert!(
            !linear.contains("friction") && !linear.contains("ratio"),
            "{linear}"
        );
    }

    #[test]
    fn a_resonance_that_was_not_computed_has_its_linear_peak_and_no_other() {
        let peak = ObservedPeak {
            resonance_not_computed_hz: Some([450.0, 606.3291]),
            largest_amplitude_m: Some(9e-5),
            linear_peak_amplitude_m: Some(4.306e-3),
            linear_peak_frequency_hz: Some(515.331),
            ..ObservedPeak::default()
        };
        let tip = Observed {
            name: "tip".to_owned(),
            quantity: ObservedQuantity::Displacement,
        };
        let named = [(&tip, &peak)];
        let told = lines(
            &Summary::default(),
            &named,
            Some("with friction"),
            Path::new("r"),
        );
        let expected = "
                with friction   linear          ratio
  peak of tip   not computed    4.306 mm        –
                –               515.331 Hz
                the resonance was not computed: no motion is known from 450.000 to 606.329 Hz
";
        assert!(told.starts_with(expected), "{told}");
        let summary = Summary {
            response: Some(ResponseSummary::default()),
            ..Summary::default()
        };
        let line = one_line(&summary, &named);
        assert!(
            line.starts_with("tip: the resonance was not computed: no motion is known from"),
            "{line}"
        );
    }

    #[test]
    fn stages_that_took_long_are_named_with_their_share() {
        let stage = |id: Stage, seconds: f64| StageSummary {
            id,
            name: id.title().to_owned(),
            seconds,
            processor_seconds: None,
            peak_memory_mib: None,
            from_cache: false,
            unknowns: Vec::new(),
        };
        let stages = [
            stage(Stage::Mesh, 0.5),
            stage(Stage::Reduction, 1.0),
            stage(Stage::Response, 6.0),
            stage(Stage::Reduction, 2.0),
        ];
        assert_eq!(shares(&stages, 10.0), ": response 60 %; reduction 30 %");
        assert_eq!(shares(&stages, 1e3), "");
    }
}
