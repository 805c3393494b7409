//! Last output of a run: its peaks beside the linear ones, the states of the joint there, the time
//! of the run, and the file to open.

use std::path::Path;

use crate::console::Verbosity;
use dovetail_export::manifest::{
    ContactCounts, ResponseSummary, StageSummary, StaticSummary, Summary, TractionRangeSummary,
    contact_counts,
};
use dovetail_export::report::REPORT;
use dovetail_export::words::{
    cycle_counts, error_words, figure, percent, quantity, quantity_beside, short, static_counts,
    supported_digits,
};
use dovetail_solver::description::EngineOrder;
use dovetail_solver::dlft::{CycleCounts, Response};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::{LocalPeak, Peak, linear_peak, local_peaks, peak};
use dovetail_solver::run::{Observed, Run};

/// Share of the time below which a stage is not named.
const LEAST_SHARE: f64 = 0.1;
/// Number of digits of amplitudes of the linear curve, which is exact.
const LINEAR_DIGITS: usize = 4;
/// Smallest width of the first column, and the width of a number in the second and third.
const WIDTHS: [usize; 2] = [14, 16];

/// Last lines of a run; one line if the verbosity is quiet.
pub(super) fn of(run: &Run, summary: &Summary, folder: &Path, verbosity: Verbosity) -> String {
    let observed = run.reduced.observations();
    let peaks: Vec<PeakLines> = match &run.response {
        Some(found) => {
            let response = &found.response;
            let own = observed.iter().enumerate();
            own.filter_map(|(i, one)| PeakLines::of(one, i, response, &run.reduced.pairs))
                .collect()
        }
        None => Vec::new(),
    };
    let report = folder.join(REPORT);
    match verbosity {
        Verbosity::Quiet => {
            let result = one_line(summary, &peaks);
            format!("{result}; {}\n", report.display())
        }
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

/// Peak of an observation.
struct PeakLines {
    name: String,
    /// Unit of its amplitude.
    unit: &'static str,
    peak: Peak,
    /// Estimated relative error of its amplitude; `None` if it is not known.
    error: Option<f64>,
    /// Number of digits of its amplitude.
    digits: usize,
    linear: Option<Peak>,
    /// Counts of the states of the pairs at the peak.
    pairs: Option<CycleCounts>,
    /// Counts of the states of the pairs of each contact at the peak.
    contacts: Vec<ContactCounts>,
    local: Option<LocalPeak>,
}

impl PeakLines {
    fn of(
        observed: &Observed,
        observation: usize,
        response: &Response,
        table: &PairTable,
    ) -> Option<Self> {
        let peak = peak(response, observation)?;
        let orbit = &response.orbits[peak.index];
        let local = local_peaks(response, observation);
        let error = orbit.amplitude_error(observation);
        Some(Self {
            name: observed.name.clone(),
            unit: observed.quantity.unit(),
            // Without pairs nothing is left out, and nothing is said of it.
            error: error.filter(|_| !orbit.cycles.is_empty()),
            digits: supported_digits(peak.amplitude_m, error),
            linear: linear_peak(response, observation),
            pairs: (!orbit.cycles.is_empty()).then(|| orbit.counts()),
            contacts: contact_counts(table, orbit),
            local: local.into_iter().find(|l| l.at.index == peak.index),
            peak,
        })
    }

    /// Ratio of the peak amplitude to the linear one.
    fn ratio(&self) -> Option<f64> {
        let linear_m = self.linear.as_ref()?.amplitude_m;
        (linear_m > 0.0).then(|| self.peak.amplitude_m / linear_m)
    }
}

fn one_line(summary: &Summary, peaks: &[PeakLines]) -> String {
    let Some(response) = &summary.response else {
        return match &summary.static_state {
            Some(state) => static_words(state),
            None => "nothing was computed".to_owned(),
        };
    };
    let one = |p: &PeakLines| {
        // A linear response is its own linear reference.
        let linear = p.linear.as_ref().filter(|_| p.pairs.is_some());
        let linear = linear.map_or(String::new(), |l| {
            format!(
                " (linear {} at {} Hz)",
                quantity(l.amplitude_m, p.unit, 4),
                figure(l.frequency_hz, 6)
            )
        });
        let error = p
            .error
            .map_or(String::new(), |e| format!(", {},", error_words(e)));
        format!(
            "{}: peak {}{error} at {} Hz{linear}; ",
            p.name,
            quantity(p.peak.amplitude_m, p.unit, p.digits),
            figure(p.peak.frequency_hz, 6)
        )
    };
    let run_up = run_up_words(response).map_or(String::new(), |words| format!(" {words}"));
    format!(
        "{}{} of {} frequencies{run_up} converged",
        peaks.iter().map(one).collect::<String>(),
        response.converged_points,
        response.points
    )
}

/// Lines of a run. `nonlinear` is the heading of the response next to the linear one; `None` if all
/// contacts are bonded, and the response is linear.
fn lines(summary: &Summary, peaks: &[PeakLines], nonlinear: Option<&str>, report: &Path) -> String {
    let mut text = String::from("\n");
    let title = |p: &PeakLines| format!("peak of {}", p.name);
    let titles = peaks.iter().map(|p| title(p).chars().count() + 1);
    let width = titles.fold(WIDTHS[0], usize::max);
    let heading = |text: &str| format!("  {text:<width$}");
    // One line for each, where there are several.
    let of_contacts = |contacts: &mut dyn Iterator<Item = (&str, String)>| {
        let contacts: Vec<(&str, String)> = contacts.collect();
        let several = contacts.len() > 1;
        let lines = contacts
            .into_iter()
            .filter(|_| several)
            .map(|(name, words)| format!("{}{name}: {words}\n", heading("")));
        lines.collect::<String>()
    };
    if let Some(state) = &summary.static_state {
        text += &format!("{}{}\n", heading("at rest"), static_words(state));
        let contacts = state.contacts.iter();
        let mut counts = contacts.filter_map(|c| Some((c.name.as_str(), static_counts(c.counts?))));
        text += &of_contacts(&mut counts);
    }
    let column = WIDTHS[1];
    let along = summary.response.as_ref().and_then(|r| r.engine_order);
    if !peaks.is_empty() {
        let headings = match nonlinear {
            Some(nonlinear) => format!("{nonlinear:<column$}{:<column$}ratio", "linear"),
            None => "linear, for all contacts are bonded".to_owned(),
        };
        text += &format!("{}{headings}\n", heading(""));
    }
    for p in peaks {
        let cells = |of: &dyn Fn(&Peak, usize) -> String| {
            let own = of(&p.peak, p.digits);
            if nonlinear.is_none() {
                return own;
            }
            let linear = p.linear.as_ref();
            let linear = linear.map_or("–".to_owned(), |linear| of(linear, LINEAR_DIGITS));
            format!("{own:<column$}{linear:<column$}")
        };
        let linear_m = p.linear.as_ref().map_or(0.0, |linear| linear.amplitude_m);
        let largest_m = p.peak.amplitude_m.max(linear_m);
        let amplitude =
            |of: &Peak, digits| quantity_beside(of.amplitude_m, largest_m, p.unit, digits);
        let amplitudes = cells(&amplitude);
        let frequencies = cells(&|p, _| format!("{} Hz", figure(p.frequency_hz, 6)));
        let digits = p.digits.min(3);
        let ratio = match (nonlinear, p.ratio()) {
            (None, _) => String::new(),
            (Some(_), None) => "–".to_owned(),
            (Some(_), Some(ratio)) => figure(ratio, digits),
        };
        text += &format!("{}{amplitudes}{ratio}\n", heading(&title(p)));
        if let Some(error) = p.error {
            text += &format!("{}{}\n", heading(""), error_words(error));
        }
        text += &format!("{}{}\n", heading(""), frequencies.trim_end());
        if let Some(order) = along {
            let rpm = |p: &Peak, _| format!("{} rpm", figure(order.speed_rpm(p.frequency_hz), 5));
            text += &format!("{}{}\n", heading(""), cells(&rpm).trim_end());
        }
        let loss = p.local.as_ref().and_then(|local| local.loss_factor);
        let loss = loss.map(|loss| {
            format!(
                "loss factor {} (Q = {})",
                figure(loss, 3),
                figure(loss.recip(), 3)
            )
        });
        for line in loss.into_iter().chain(p.pairs.map(cycle_counts)) {
            text += &format!("{}{line}\n", heading(""));
        }
        let contacts = p.contacts.iter();
        text += &of_contacts(&mut contacts.map(|c| (c.name.as_str(), cycle_counts(c.counts))));
    }
    if let Some(response) = &summary.response {
        if let Some(words) = run_up_words(response) {
            text += &format!("{}{words}\n", heading("run-up"));
        }
        if let Some(range) = &response.traction_range {
            text += &format!("{}{}\n", heading("preload"), traction_words(range));
        }
        let what = match response.engine_order {
            Some(_) => "speeds",
            None => "frequencies",
        };
        text += &format!(
            "{}{} of {} converged\n",
            heading(what),
            response.converged_points,
            response.points
        );
    }
    text += &format!(
        "{}{} s{}\n",
        heading("time"),
        figure(summary.seconds, 3),
        shares(&summary.stages, summary.seconds)
    );
    text + &format!("{}{}\n", heading("open first"), report.display())
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
    use dovetail_solver::run::Stage;

    #[test]
    fn columns_begin_behind_the_longest_name() {
        let peak = |name: &str| PeakLines {
            unit: "m",
            name: name.to_owned(),
            error: None,
            digits: 4,
            peak: Peak {
                index: 0,
                frequency_hz: 450.0,
                amplitude_m: 1.087e-3,
            },
            linear: None,
            pairs: None,
            contacts: Vec::new(),
            local: None,
        };
        let peaks = [peak("tip_le"), peak("tip_of_trailing_edge")];
        let told = lines(
            &Summary::default(),
            &peaks,
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
            &[peak("tip")],
            Some("with friction"),
            Path::new("r"),
        );
        assert!(short.contains("\n  peak of tip   1.087 mm"), "{short}");
        let linear = lines(&Summary::default(), &[peak("tip")], None, Path::new("r"));
        assert!(linear.contains("\n  peak of tip   1.087 mm\n"), "{linear}");
        assert!(
            !linear.contains("friction") && !linear.contains("ratio"),
            "{linear}"
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
