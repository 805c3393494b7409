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
use dovetail_solver::dlft::Response;
use dovetail_solver::results::quantities::{local_peaks, pair_counts, peak};
use dovetail_solver::text;

/// Between two lines of a loop where there is no terminal.
pub const LINE_INTERVAL: Duration = Duration::from_secs(15);

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
    /// The figures of a response that a reader asks for first.
    pub fn figures(&mut self, reduced: &Reduced, response: &Response) {
        for (i, name) in reduced.observations().into_iter().enumerate() {
            self.peaks(name, i, response);
        }
    }

    /// Where an observation is largest.
    fn peaks(&mut self, name: &str, i: usize, response: &Response) {
        let Some(peak) = peak(response, i) else {
            return;
        };
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
