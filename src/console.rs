//! Prints what a run tells while it works to stderr: stages with time and memory, bars, notes and
//! warnings.
//!
//! On a terminal the stage under way turns and bars move. Elsewhere plain lines are printed; a loop
//! prints one at most every [`LINE_INTERVAL`].

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::pipeline::Reduced;
use crate::pipeline::observer::Observer;
use crate::stage::{Stage, StageRecord};
use dovetail_solver::dlft::peaks::LEAST_RISE;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::{Orbit, Outcome, Response};
use dovetail_solver::results::far_slip::TOO_FAR;
use dovetail_solver::results::quantities::{
    local_peaks, pair_counts, peak, peak_is_at_an_end, peak_rise,
};
use dovetail_solver::text;

/// Between two lines of a loop where there is no terminal.
pub const LINE_INTERVAL: Duration = Duration::from_secs(15);

/// Estimated error of an amplitude that is worth a warning.
const TRUNCATED: f64 = 0.02;

/// Prints what it hears to stderr.
#[derive(Debug)]
pub struct Console {
    output: Output,
    lines: MultiProgress,
    /// Of the stages under way, the innermost last.
    spinners: Vec<ProgressBar>,
    /// The loops under way, the innermost last.
    loops: Vec<Loop>,
}

/// How much is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verbosity {
    /// Warnings only.
    Quiet,
    Normal,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Output {
    Quiet,
    /// Lines, no control characters.
    Plain,
    Terminal,
}

#[derive(Debug)]
struct Loop {
    label: String,
    steps: usize,
    done: usize,
    last_line: Instant,
    bar: Option<ProgressBar>,
}

impl Console {
    pub fn new(verbosity: Verbosity) -> Self {
        let output = match (verbosity, std::io::stderr().is_terminal()) {
            (Verbosity::Quiet, _) => Output::Quiet,
            (Verbosity::Normal, true) => Output::Terminal,
            (Verbosity::Normal, false) => Output::Plain,
        };
        let target = match output {
            Output::Terminal => ProgressDrawTarget::stderr(),
            _ => ProgressDrawTarget::hidden(),
        };
        Self {
            output,
            lines: MultiProgress::with_draw_target(target),
            spinners: Vec::new(),
            loops: Vec::new(),
        }
    }

    fn line(&self, message: &str) {
        self.lines().line(message);
    }

    /// Lines for another thread.
    pub fn lines(&self) -> Lines {
        Lines(self.lines.clone())
    }
}

/// What prints lines, whatever bars are drawn.
#[derive(Debug, Clone)]
pub struct Lines(MultiProgress);

impl Lines {
    /// Bars are cleared, the line is printed above them, and they are drawn again.
    fn line(&self, message: &str) {
        self.0.suspend(|| print(message));
    }

    /// The last line of a process: no bar is drawn after it.
    pub fn last(&self, message: &str) {
        let _ = self.0.clear();
        self.0.set_draw_target(ProgressDrawTarget::hidden());
        print(message);
    }
}

/// A stderr that is gone is no reason to end the run.
fn print(message: &str) {
    let _ = writeln!(std::io::stderr(), "{}", text::plain(message));
}

impl Console {
    /// The figures of a response that a reader asks for first, and what to mind about it.
    pub fn figures(&mut self, reduced: &Reduced, response: &Response) {
        let held = |o: &&Orbit| o.outcome.is_converged() && o.retention_n > 0.0;
        let held: Vec<&Orbit> = response.orbits.iter().filter(held).collect();
        if !held.is_empty() {
            let largest_n = held.iter().fold(0.0_f64, |m, o| m.max(o.retention_n));
            self.warning(&format!(
                "at {} of {} frequencies friction does not hold the blade along its slot: its mean position was held there, \
                 as a lock plate does, with up to {largest_n:.3} N (column retention_n of response.csv)",
                held.len(),
                response.orbits.len(),
            ));
        }
        let leaves = |o: &&Orbit| o.outcome == Outcome::LeavesSlot;
        let leaving = response.orbits.iter().filter(leaves).count();
        if leaving > 0 {
            self.warning(&format!(
                "at {leaving} of {} frequencies the blade would leave its slot: even applied slowly the excitation pulls harder at the \
                 flanks than the steady load presses them together; excite it less (force_n), or press it harder \
                 (rotation.speed_rpm, [[load]])",
                response.orbits.len(),
            ));
        }
        let sliding = |o: &&Orbit| o.outcome == Outcome::SlidesTooFar;
        let sliding = response.orbits.iter().filter(sliding).count();
        if sliding > 0 {
            self.warning(&format!(
                "at {sliding} of {} frequencies a pair slides farther than {} % of the shorter side of its flank, which contact between \
                 pairs of nodes does not cover (outcome slides_too_far of response.csv)",
                response.orbits.len(),
                100.0 * TOO_FAR,
            ));
        }
        let inaccurate = |o: &&Orbit| o.outcome == Outcome::AccuracyNotReached;
        let inaccurate = response.orbits.iter().filter(inaccurate).count();
        if inaccurate > 0 {
            self.warning(&format!(
                "at {inaccurate} of {} frequencies the error is estimated above the accuracy asked for: with more harmonics, at most {}, no \
                 motion was found or the estimate did not fall (outcome accuracy_not_reached and column estimated_error of response.csv)",
                response.orbits.len(),
                Resolution::MOST_ADAPTED,
            ));
        }
        if inaccurate == 0 {
            self.warn_of_truncation(response);
        }
        for (i, name) in reduced.observations().into_iter().enumerate() {
            self.peaks(name, i, response);
        }
    }

    /// Where an observation is largest, and what may be hidden there.
    fn peaks(&mut self, name: &str, i: usize, response: &Response) {
        let Some(peak) = peak(response, i) else {
            return;
        };
        if peak_is_at_an_end(response, i) {
            self.warning(&format!(
                "the largest amplitude of {name} is at an end of the range, {:.3} Hz: a peak may lie outside; widen response.frequency_hz \
                 or response.times_first_linear_mode",
                peak.frequency_hz
            ));
        }
        if let Some(rise) = peak_rise(response, i).filter(|rise| *rise > LEAST_RISE) {
            self.warning(&format!(
                "between two frequencies the peak of {name} may be {:.1} % higher: take more response.points, a narrower range, or more \
                 response.most_added_points",
                100.0 * rise
            ));
        }
        let counts = pair_counts(&response.orbits[peak.index]);
        let at_rest = match counts.open_at_rest {
            0 => String::new(),
            pairs => format!(", {pairs} are open at rest"),
        };
        self.note(&format!(
            "{name}: peak {:.4e} m at {:.3} Hz; {} pairs slip, {} open, {} stick{at_rest}",
            peak.amplitude_m, peak.frequency_hz, counts.slipping, counts.opening, counts.stuck
        ));
        for local in local_peaks(response, i) {
            let Some(loss_factor) = local.loss_factor else {
                continue;
            };
            self.note(&format!(
                "{name}: {:.4e} m at {:.3} Hz, loss factor {loss_factor:.3e} (Q = {:.0})",
                local.at.amplitude_m,
                local.at.frequency_hz,
                loss_factor.recip()
            ));
        }
    }

    /// Harmonics that were asked for may be too few.
    fn warn_of_truncation(&mut self, response: &Response) {
        let errors = || response.orbits.iter().filter(|o| o.outcome.is_converged());
        let errors = || errors().filter_map(|o| o.estimated_error);
        let above = errors().filter(|e| *e > TRUNCATED).count();
        if above > 0 {
            self.warning(&format!(
                "at {above} of {} frequencies the harmonics left out are estimated to change the amplitude by more than {} %, at worst by {:.1} % \
                 (column estimated_error of response.csv): take more response.harmonics, or response.accuracy = 0.01 in their place",
                response.orbits.len(),
                100.0 * TRUNCATED,
                100.0 * errors().filter(|e| e.is_finite()).fold(0.0, f64::max),
            ));
        }
    }
}

impl Observer for Console {
    fn stage_begins(&mut self, _: Stage, title: &str) {
        if self.output == Output::Terminal {
            let spinner = ProgressBar::new_spinner().with_message(text::plain(title));
            let spinner = self.lines.add(spinner);
            spinner.enable_steady_tick(Duration::from_millis(120));
            self.spinners.push(spinner);
        }
    }

    fn stage_ends(&mut self, record: &StageRecord) {
        if let Some(spinner) = self.spinners.pop() {
            spinner.finish_and_clear();
            self.lines.remove(&spinner);
        }
        let memory = record
            .peak_rss_mib
            .map_or(String::new(), |m| format!("{m:8.0} MiB"));
        let kept = if record.from_cache { "  cache" } else { "" };
        self.note(&format!(
            "  {:<28} {:8.2} s {memory}{kept}",
            record.name, record.seconds
        ));
    }

    fn loop_begins(&mut self, label: &str, steps: usize) {
        let bar = (self.output == Output::Terminal).then(|| {
            let template = "  {msg} {wide_bar} {pos}/{len} {eta}";
            let style = ProgressStyle::with_template(template);
            let bar = ProgressBar::new(steps as u64).with_message(text::plain(label));
            self.lines
                .add(bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())))
        });
        self.loops.push(Loop {
            label: label.to_owned(),
            steps,
            done: 0,
            last_line: Instant::now(),
            bar,
        });
    }

    fn loop_advances(&mut self, steps: usize) {
        let Some(turn) = self.loops.last_mut() else {
            return;
        };
        turn.done += steps;
        if let Some(bar) = &turn.bar {
            bar.inc(steps as u64);
        } else if self.output == Output::Plain && turn.last_line.elapsed() >= LINE_INTERVAL {
            turn.last_line = Instant::now();
            let line = format!("  {}: {} of {}", turn.label, turn.done, turn.steps);
            self.line(&line);
        }
    }

    fn loop_ends(&mut self) {
        if let Some(bar) = self.loops.pop().and_then(|turn| turn.bar) {
            bar.finish_and_clear();
            self.lines.remove(&bar);
        }
    }

    /// A line, but for the quiet.
    fn note(&mut self, message: &str) {
        if self.output != Output::Quiet {
            self.line(message);
        }
    }

    /// A line for the quiet, too.
    fn warning(&mut self, message: &str) {
        self.line(&format!("warning: {message}"));
    }
}
