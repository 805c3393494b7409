//! Prints the progress of a run to stderr: stages with time and memory, bars, notes and warnings.
//!
//! On a terminal the stage under way has a spinner with the elapsed time, and bars show the
//! remaining time. Otherwise plain lines are printed; a loop prints at most one every
//! [`LINE_INTERVAL`].

use std::io::{IsTerminal, Write};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::listener::{Listener, News};
use dovetail_export::manifest::StageSummary;
use dovetail_export::warning::{Warning, Weight, sorted_by_weight};
use dovetail_export::words::{counted, cycle_counts, figure, quantity, rounded, short};
use dovetail_mesh::text;
use dovetail_solver::dlft::{Attempt, Orbit, SolvedFrequency};
use dovetail_solver::run::{Event, Stage, WearCourse};

/// Least time between two lines of a loop without a terminal.
pub const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// Prints the events of a run to stderr.
#[derive(Debug)]
pub struct Console {
    verbosity: Verbosity,
    on_terminal: bool,
    lines: MultiProgress,
    /// Spinners of the stages under way, the innermost last.
    spinners: Vec<ProgressBar>,
    /// Loops under way, the innermost last.
    loops: Vec<Loop>,
    /// Number of failed frequencies of the response under way.
    failed: usize,
    /// True once a response exists: warnings about it wait for the end.
    solved: bool,
    /// Warnings that wait for the end.
    waiting: Vec<Warning>,
    /// Warnings that were printed at once.
    printed: Vec<Warning>,
}

/// Amount of output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verbosity {
    /// Warnings only.
    Quiet,
    Normal,
    /// Also each frequency with its Newton iterations.
    Verbose,
}

#[derive(Debug)]
struct Loop {
    label: String,
    steps: usize,
    /// True if the number of steps is an estimate.
    is_estimated: bool,
    done: usize,
    /// Text of the result of the last step.
    news: String,
    begun: Instant,
    last_line: Instant,
    bar: Option<ProgressBar>,
}

impl Loop {
    /// Line with the completed share, the elapsed time, and the remaining time if the loop
    /// continues at the same rate.
    fn line(&self) -> String {
        let taken = self.begun.elapsed();
        // A loop may take more steps than it announced.
        let share = (self.done as f64 / self.steps.max(1) as f64).min(1.0);
        let left = taken.mul_f64((1.0 / share.max(1e-9) - 1.0).clamp(0.0, 1e6));
        let news = if self.news.is_empty() {
            String::new()
        } else {
            format!("; {}", self.news)
        };
        let about = if self.is_estimated { "about " } else { "" };
        format!(
            "  {}: {} of {about}{} ({:.0} %) in {}, {} left{news}",
            self.label,
            self.done,
            self.steps,
            100.0 * share,
            HumanDuration(taken),
            HumanDuration(left)
        )
    }
}

impl Console {
    pub fn new(verbosity: Verbosity) -> Self {
        let on_terminal = std::io::stderr().is_terminal() && verbosity != Verbosity::Quiet;
        let target = if on_terminal {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        Self {
            verbosity,
            on_terminal,
            lines: MultiProgress::with_draw_target(target),
            spinners: Vec::new(),
            loops: Vec::new(),
            failed: 0,
            solved: false,
            waiting: Vec::new(),
            printed: Vec::new(),
        }
    }

    pub fn verbosity(&self) -> Verbosity {
        self.verbosity
    }

    fn line(&self, message: &str) {
        self.lines().line(message);
    }

    /// Printer of lines for another thread.
    pub fn lines(&self) -> LinePrinter {
        LinePrinter(self.lines.clone())
    }

    /// Prints the warnings that waited for the end, the most important first, and the number of
    /// those that were printed at once.
    pub fn end(&mut self) {
        for Warning { text, .. } in sorted_by_weight(&std::mem::take(&mut self.waiting)) {
            self.line(&format!("warning: {text}"));
        }
        let printed = std::mem::take(&mut self.printed);
        let printed = printed.iter().filter(|w| w.weight < Weight::Remark).count();
        if printed > 0 && self.solved && self.verbosity != Verbosity::Quiet {
            let warnings = counted(printed, "warning", "warnings");
            self.line(&format!("{warnings} above, before the response"));
        }
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        self.end();
    }
}

/// Printer of lines that keeps the bars intact.
#[derive(Debug, Clone)]
pub struct LinePrinter(MultiProgress);

impl LinePrinter {
    /// Prints a line: the bars are cleared, the line is printed above them, and they are drawn
    /// again.
    fn line(&self, message: &str) {
        self.0.suspend(|| print(message));
    }

    /// Prints the last line of a process: no bar is drawn after it.
    pub fn last(&self, message: &str) {
        let _ = self.0.clear();
        self.0.set_draw_target(ProgressDrawTarget::hidden());
        print(message);
    }
}

/// Prints a line. A closed stderr does not end the run.
fn print(message: &str) {
    let _ = writeln!(std::io::stderr(), "{}", text::plain(message));
}

/// Short text of the result of a frequency.
fn news(orbit: &Orbit, failed: usize) -> String {
    let amplitude = match (orbit.outcome.has_motion(), orbit.observed_amplitude.first()) {
        (true, Some(amplitude_m)) => quantity(*amplitude_m, "m", 4),
        _ => orbit.outcome.to_string().replace('_', " "),
    };
    let failed = match failed {
        0 => String::new(),
        _ => format!(", {failed} failed"),
    };
    format!(
        "{:.3} Hz: {amplitude}, {}, {}{failed}",
        orbit.frequency_hz,
        cycle_counts(orbit.counts()),
        counted(orbit.newton_iterations, "iteration", "iterations"),
    )
}

/// First and last residual of each attempt of Newton's method, with its iterations.
fn residuals(orbit: &Orbit) -> String {
    let attempt = |residuals: &Vec<f64>| match residuals[..] {
        [only] => format!("{only:.1e} in 0"),
        [first, .., last] => format!("{first:.1e} to {last:.1e} in {}", residuals.len() - 1),
        [] => String::new(),
    };
    let attempts = orbit.newton_residuals.iter().map(attempt);
    attempts.collect::<Vec<_>>().join(" | ")
}

impl Console {
    /// Shows the begin of a stage.
    fn stage_begins(&mut self, title: &str) {
        if self.on_terminal {
            let template = "{spinner} {msg}  {elapsed}";
            let spinner = ProgressBar::new_spinner()
                .with_style(style(template, ProgressStyle::default_spinner))
                .with_message(text::plain(title));
            let spinner = self.lines.add(spinner);
            spinner.enable_steady_tick(Duration::from_millis(120));
            self.spinners.push(spinner);
        }
    }

    /// Shows the end of the stage that began last.
    fn stage_ends(&mut self, record: &StageSummary) {
        if let Some(spinner) = self.spinners.pop() {
            spinner.finish_and_clear();
            self.lines.remove(&spinner);
        }
        self.solved |= record.id == Stage::Response;
        let memory = record
            .peak_memory_mib
            .map_or(String::new(), |m| format!("{m:8.0} MiB"));
        let kept = if record.from_cache { "  cache" } else { "" };
        self.note(&format!(
            "  {:<28} {:8.2} s {memory}{kept}",
            record.name, record.seconds
        ));
    }

    /// Shows responses, their frequencies and loops; other events are ignored.
    fn event(&mut self, event: &Event<'_>) {
        match event {
            Event::ResponseBegins { .. } => self.failed = 0,
            Event::Frequency(solved) => self.frequency(solved),
            Event::Worn(course) => self.worn(course),
            Event::LoopBegins { label, steps } => self.loop_begins(label, *steps),
            Event::LoopExpects(steps) => self.loop_expects(*steps),
            Event::LoopAdvances(steps) => self.loop_advances(*steps),
            Event::LoopEnds => self.loop_ends(),
            Event::Tries(Attempt {
                frequency_hz,
                harmonics,
                strategy,
            }) => {
                let harmonics = counted(*harmonics, "harmonic", "harmonics");
                self.loop_detail(&format!("{frequency_hz:.3} Hz: {harmonics}, {strategy}"));
            }
            _ => {}
        }
    }

    fn loop_begins(&mut self, label: &str, steps: usize) {
        let bar = self.on_terminal.then(|| {
            let template = "  {prefix} {wide_bar} {pos}/{len}  {elapsed}, {eta} left\n  {msg}";
            let bar = ProgressBar::new(steps as u64)
                .with_style(style(template, ProgressStyle::default_bar))
                .with_prefix(text::plain(label));
            self.lines.add(bar)
        });
        let now = Instant::now();
        self.loops.push(Loop {
            label: label.to_owned(),
            steps,
            is_estimated: false,
            done: 0,
            news: String::new(),
            begun: now,
            last_line: now,
            bar,
        });
    }

    fn loop_expects(&mut self, steps: usize) {
        if let Some(turn) = self.loops.last_mut() {
            (turn.steps, turn.is_estimated) = (steps, true);
            if let Some(bar) = &turn.bar {
                bar.set_length(steps as u64);
            }
        }
    }

    fn loop_advances(&mut self, steps: usize) {
        let Some(turn) = self.loops.last_mut() else {
            return;
        };
        turn.done += steps;
        if let Some(bar) = &turn.bar {
            bar.inc(steps as u64);
        } else if turn.last_line.elapsed() >= LINE_INTERVAL {
            turn.last_line = Instant::now();
            let line = turn.line();
            self.note(&line);
        }
    }

    fn loop_detail(&mut self, detail: &str) {
        if self.verbosity == Verbosity::Verbose {
            self.line(&format!("    {detail}"));
        }
        if let Some(bar) = self.loops.last().and_then(|turn| turn.bar.as_ref()) {
            bar.set_message(detail.to_owned());
        }
    }

    fn loop_ends(&mut self) {
        if let Some(bar) = self.loops.pop().and_then(|turn| turn.bar) {
            bar.finish_and_clear();
            self.lines.remove(&bar);
        }
    }

    /// Shows a solved frequency of the response that began last, converged or not.
    fn frequency(&mut self, solved: &SolvedFrequency) {
        let orbit = &solved.orbit;
        // The first attempt at one that is solved again has failed.
        self.failed -= usize::from(solved.again && self.failed > 0);
        self.failed += usize::from(!orbit.outcome.is_converged());
        let news = news(orbit, self.failed);
        if self.verbosity == Verbosity::Verbose {
            self.line(&format!("  {news}; residuals {}", residuals(orbit)));
        }
        self.loop_news(news);
    }

    fn worn(&mut self, course: &WearCourse<'_>) {
        let Some(block) = course.blocks.last() else {
            return;
        };
        let largest_m = block.largest_depth_m();
        let hz = block
            .motions
            .iter()
            .map(|orbit| figure(orbit.frequency_hz, 6));
        let news = format!(
            "{} cycles: worn to {}, {} Hz",
            short(rounded(block.cycles, 4)),
            quantity(largest_m, "m", 3),
            hz.collect::<Vec<_>>().join(", ")
        );
        if self.verbosity == Verbosity::Verbose {
            self.line(&format!("  {news}"));
        }
        self.loop_news(news);
    }

    fn loop_news(&mut self, news: String) {
        if let Some(turn) = self.loops.last_mut() {
            if let Some(bar) = &turn.bar {
                bar.set_message(news.clone());
            }
            turn.news = news;
        }
    }

    /// Prints a line unless the verbosity is quiet.
    fn note(&mut self, message: &str) {
        if self.verbosity != Verbosity::Quiet {
            self.line(message);
        }
    }

    /// Prints a warning, also if the verbosity is quiet: at once, or at the end if it is about a
    /// finished response.
    pub fn warning(&mut self, warning: &Warning) {
        if self.solved && self.verbosity != Verbosity::Quiet {
            self.waiting.push(warning.clone());
            return;
        }
        if !self.printed.contains(warning) {
            self.line(&format!("warning: {}", warning.text));
            self.printed.push(warning.clone());
        }
    }
}

impl Listener for Console {
    fn on_news(&mut self, news: News<'_>) -> ControlFlow<()> {
        match news {
            News::StageBegins(title) => self.stage_begins(title),
            News::StageEnds(record) => self.stage_ends(record),
            News::Note(message) => self.note(message),
            News::Warning(warning) => self.warning(warning),
            News::Event(event) => self.event(event),
        }
        ControlFlow::Continue(())
    }
}

fn style(template: &str, or: fn() -> ProgressStyle) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| or())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_a_loop_has_its_share_and_the_time_that_is_left() {
        let begun = Instant::now().checked_sub(Duration::from_secs(30)).unwrap();
        let mut turn = Loop {
            label: "frequencies".to_owned(),
            steps: 200,
            is_estimated: false,
            done: 150,
            news: String::new(),
            begun,
            last_line: begun,
            bar: None,
        };
        assert_eq!(
            turn.line(),
            "  frequencies: 150 of 200 (75 %) in 30 seconds, 10 seconds left"
        );
        turn.news = "450.085 Hz: 6.491 mm".to_owned();
        assert!(turn.line().ends_with("left; 450.085 Hz: 6.491 mm"));
        turn.is_estimated = true;
        assert!(turn.line().contains("150 of about 200"), "{}", turn.line());
        turn.is_estimated = false;
        turn.done = 0;
        assert!(turn.line().contains("0 of 200 (0 %)"), "{}", turn.line());
        turn.done = 250;
        let line = turn.line();
        assert!(
            line.contains("(100 %)") && line.contains(", 0 seconds left"),
            "{line}"
        );
    }

    fn waiting(console: &Console) -> Vec<&str> {
        let waiting = sorted_by_weight(&console.waiting).into_iter();
        waiting.map(|warning| warning.text.as_str()).collect()
    }

    #[test]
    fn what_is_told_of_a_finished_response_waits_for_the_end() {
        let mut console = Console::new(Verbosity::Normal);
        let warning = |weight, text: &str| Warning {
            weight,
            text: text.to_owned(),
        };
        console.warning(&warning(Weight::Remark, "kept"));
        console.warning(&warning(Weight::Wrong, "early"));
        console.warning(&warning(Weight::Wrong, "early"));
        assert!(waiting(&console).is_empty());
        assert_eq!(console.printed.len(), 2);
        console.solved = true;
        console.warning(&warning(Weight::Remark, "held"));
        console.warning(&warning(Weight::Doubt, "rough"));
        assert_eq!(waiting(&console), ["rough", "held"]);
        assert_eq!(console.printed.len(), 2, "each is printed once");
        console.end();
        assert!(console.waiting.is_empty());
        let mut quiet = Console::new(Verbosity::Quiet);
        quiet.solved = true;
        quiet.warning(&warning(Weight::Doubt, "rough"));
        assert!(quiet.waiting.is_empty());
    }
}
