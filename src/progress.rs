//! What a long run tells while it works: stages with time and memory, bars, notes and warnings, all on stderr.
//!
//! On a terminal the stage under way turns and bars move; elsewhere plain lines come, a bar's at most every
//! [`LINE_INTERVAL`]. All of it can be used from several threads at once.

use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

use dovetail_solver::text;

/// Between two lines of a bar where there is no terminal.
pub const LINE_INTERVAL: Duration = Duration::from_secs(15);

/// What a run does, part by part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    Mesh,
    Model,
    FiniteElements,
    Reduction,
    /// What the reduction made is kept for later runs.
    Keeping,
    /// The way back from the reduced model is taken from the cache.
    Recovery,
    /// A reduced model is read.
    ReducedModel,
    ReducedModelFiles,
    /// Modes of each body by itself, its flanks held.
    HeldModes,
    ModesAtSpeeds,
    StaticState,
    StaticFiles,
    Response,
    ResponseFiles,
    TimeIntegration,
}

impl Stage {
    pub const ALL: [Self; 15] = [
        Self::Mesh,
        Self::Model,
        Self::FiniteElements,
        Self::Reduction,
        Self::Keeping,
        Self::Recovery,
        Self::ReducedModel,
        Self::ReducedModelFiles,
        Self::HeldModes,
        Self::ModesAtSpeeds,
        Self::StaticState,
        Self::StaticFiles,
        Self::Response,
        Self::ResponseFiles,
        Self::TimeIntegration,
    ];

    /// For programs, in summary.json: it stays when a title changes.
    pub fn id(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Model => "model",
            Self::FiniteElements => "finite_elements",
            Self::Reduction => "reduction",
            Self::Keeping => "keeping",
            Self::Recovery => "recovery",
            Self::ReducedModel => "reduced_model",
            Self::ReducedModelFiles => "reduced_model_files",
            Self::HeldModes => "held_modes",
            Self::ModesAtSpeeds => "modes_at_speeds",
            Self::StaticState => "static_state",
            Self::StaticFiles => "static_files",
            Self::Response => "response",
            Self::ResponseFiles => "response_files",
            Self::TimeIntegration => "time_integration",
        }
    }

    pub fn of_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.id() == id)
    }

    /// For readers, where a run has no better one.
    pub fn title(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Model => "model",
            Self::FiniteElements => "finite elements",
            Self::Reduction => "reduction",
            Self::Keeping => "cache",
            Self::Recovery => "recovery",
            Self::ReducedModel => "reduced model",
            Self::ReducedModelFiles => "files of the reduced model",
            Self::HeldModes => "modes of each body, flanks held",
            Self::ModesAtSpeeds => "modes at each speed",
            Self::StaticState => "static state",
            Self::StaticFiles => "static files",
            Self::Response => "response",
            Self::ResponseFiles => "response files",
            Self::TimeIntegration => "time integration",
        }
    }
}

/// A finished stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageRecord {
    pub stage: Stage,
    /// Its title.
    pub name: String,
    /// Wall clock.
    pub seconds: f64,
    /// Of all threads, and of a program waited for (gmsh); `None` where the system does not tell.
    pub processor_seconds: Option<f64>,
    /// Largest resident memory of the process up to the end of the stage, MiB; `None` where the
    /// system does not tell.
    pub peak_rss_mib: Option<f64>,
    /// What it makes was kept from an earlier run.
    pub from_cache: bool,
    /// Unknowns of each system that it solves, the largest first.
    pub unknowns: Vec<usize>,
}

/// Where a run reports to.
#[derive(Debug)]
pub struct Progress {
    begin: Instant,
    processor_begin: Option<f64>,
    output: Output,
    lines: MultiProgress,
    records: Mutex<Vec<StageRecord>>,
    warnings: Mutex<Vec<String>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Output {
    /// Warnings only.
    Quiet,
    /// Lines, no control characters.
    Plain,
    Terminal,
}

impl Progress {
    /// Reports to stderr. `quiet`: nothing but warnings is printed; records are kept all the same.
    pub fn new(quiet: bool) -> Self {
        let output = match (quiet, std::io::stderr().is_terminal()) {
            (true, _) => Output::Quiet,
            (false, true) => Output::Terminal,
            (false, false) => Output::Plain,
        };
        let target = match output {
            Output::Terminal => ProgressDrawTarget::stderr(),
            _ => ProgressDrawTarget::hidden(),
        };
        Self {
            begin: Instant::now(),
            processor_begin: processor_seconds(),
            output,
            lines: MultiProgress::with_draw_target(target),
            records: Mutex::default(),
            warnings: Mutex::default(),
        }
    }

    /// Begins a stage, which ends when the guard is dropped.
    #[must_use = "the stage ends when the guard is dropped"]
    pub fn stage(&self, stage: Stage) -> StageGuard<'_> {
        self.titled_stage(stage, stage.title())
    }

    /// Begins a stage under a title of its own.
    #[must_use = "the stage ends when the guard is dropped"]
    pub fn titled_stage(&self, stage: Stage, name: &str) -> StageGuard<'_> {
        let spinner = (self.output == Output::Terminal).then(|| {
            let spinner = self
                .lines
                .add(ProgressBar::new_spinner().with_message(text::plain(name)));
            spinner.enable_steady_tick(Duration::from_millis(120));
            spinner
        });
        StageGuard {
            progress: self,
            stage,
            name: name.to_owned(),
            begin: Instant::now(),
            processor_begin: processor_seconds(),
            spinner,
            from_cache: AtomicBool::new(false),
            unknowns: Mutex::default(),
        }
    }

    /// Records a stage that took `time`, its result kept from an earlier run.
    pub fn kept_stage(&self, stage: Stage, time: Duration) {
        let now = Instant::now();
        drop(StageGuard {
            progress: self,
            stage,
            name: stage.title().to_owned(),
            begin: now.checked_sub(time).unwrap_or(now),
            processor_begin: None,
            spinner: None,
            from_cache: AtomicBool::new(true),
            unknowns: Mutex::default(),
        });
    }

    /// A bar for a loop of `len` steps, which goes away when it is dropped.
    #[must_use = "the bar goes away when it is dropped"]
    pub fn bar(&self, len: usize, label: &str) -> Bar<'_> {
        let len = len as u64;
        let bar = (self.output == Output::Terminal).then(|| {
            let template = "  {msg} {wide_bar} {pos}/{len} {eta}";
            let style = ProgressStyle::with_template(template);
            let bar = ProgressBar::new(len).with_message(text::plain(label));
            self.lines
                .add(bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())))
        });
        Bar {
            progress: self,
            label: label.to_owned(),
            len,
            done: AtomicU64::new(0),
            last_line: Mutex::new(Instant::now()),
            bar,
        }
    }

    /// A line for whoever watches; nothing when quiet.
    pub fn note(&self, message: &str) {
        if self.output != Output::Quiet {
            self.line(message);
        }
    }

    /// A line that is printed even when quiet, and kept.
    pub fn warning(&self, message: &str) {
        self.line(&format!("warning: {message}"));
        lock(&self.warnings).push(message.to_owned());
    }

    /// Wall clock since the beginning, s.
    pub fn seconds(&self) -> f64 {
        self.begin.elapsed().as_secs_f64()
    }

    /// Processor time since the beginning, all threads and the programs waited for (gmsh), s;
    /// `None` where the system does not tell. What the process used before is that of a program
    /// that it replaced: `cargo run` and the compilers that it waited for, a shell.
    pub fn processor_seconds(&self) -> Option<f64> {
        let (now, begin) = processor_seconds().zip(self.processor_begin)?;
        Some(now - begin)
    }

    /// The stages that have ended, in the order of their ends.
    pub fn records(&self) -> Vec<StageRecord> {
        lock(&self.records).clone()
    }

    /// The warnings so far.
    pub fn warnings(&self) -> Vec<String> {
        lock(&self.warnings).clone()
    }

    fn line(&self, message: &str) {
        // Bars are cleared, the line printed above them, and drawn again. A stderr that is gone is no
        // reason to end the run.
        self.lines.suspend(|| {
            let _ = writeln!(std::io::stderr(), "{}", text::plain(message));
        });
    }
}

/// A stage under way. Its end is printed and recorded when this is dropped.
#[derive(Debug)]
pub struct StageGuard<'a> {
    progress: &'a Progress,
    stage: Stage,
    name: String,
    begin: Instant,
    processor_begin: Option<f64>,
    spinner: Option<ProgressBar>,
    from_cache: AtomicBool,
    unknowns: Mutex<Vec<usize>>,
}

impl StageGuard<'_> {
    /// What the stage makes was kept from an earlier run.
    pub fn from_cache(&self) {
        self.from_cache.store(true, Ordering::Relaxed);
    }

    /// One more system that the stage solves, with so many unknowns.
    pub fn solves(&self, unknowns: usize) {
        lock(&self.unknowns).push(unknowns);
    }
}

impl Drop for StageGuard<'_> {
    fn drop(&mut self) {
        if let Some(spinner) = &self.spinner {
            spinner.finish_and_clear();
            self.progress.lines.remove(spinner);
        }
        let seconds = self.begin.elapsed().as_secs_f64();
        let mut unknowns = std::mem::take(&mut *lock(&self.unknowns));
        unknowns.sort_unstable_by(|a, b| b.cmp(a));
        let record = StageRecord {
            stage: self.stage,
            name: self.name.clone(),
            seconds,
            processor_seconds: processor_seconds()
                .zip(self.processor_begin)
                .map(|(to, from)| to - from),
            peak_rss_mib: peak_rss_mib(),
            from_cache: self.from_cache.load(Ordering::Relaxed),
            unknowns,
        };
        let memory = record
            .peak_rss_mib
            .map_or(String::new(), |m| format!("{m:8.0} MiB"));
        let kept = if record.from_cache { "  cache" } else { "" };
        self.progress.note(&format!(
            "  {:<28} {seconds:8.2} s {memory}{kept}",
            self.name
        ));
        lock(&self.progress.records).push(record);
    }
}

/// The steps of a long loop. Steps may come from several threads.
#[derive(Debug)]
pub struct Bar<'a> {
    progress: &'a Progress,
    label: String,
    len: u64,
    done: AtomicU64,
    last_line: Mutex<Instant>,
    bar: Option<ProgressBar>,
}

impl Bar<'_> {
    /// One more step is done.
    pub fn step(&self) {
        self.advance(1);
    }

    /// `steps` more steps are done.
    pub fn advance(&self, steps: usize) {
        let done = self.done.fetch_add(steps as u64, Ordering::Relaxed) + steps as u64;
        match (&self.bar, self.progress.output) {
            (Some(bar), _) => bar.inc(steps as u64),
            (None, Output::Plain) => self.line_if_due(done),
            (None, _) => {}
        }
    }

    fn line_if_due(&self, done: u64) {
        let due = {
            // Another thread in here is about to print.
            let Ok(mut last) = self.last_line.try_lock() else {
                return;
            };
            let due = last.elapsed() >= LINE_INTERVAL;
            if due {
                *last = Instant::now();
            }
            due
        };
        if due {
            self.progress
                .note(&format!("  {}: {done} of {}", self.label, self.len));
        }
    }
}

impl Drop for Bar<'_> {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
            self.progress.lines.remove(bar);
        }
    }
}

/// A panic of another thread while it held the lock leaves a list that is still whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Processor time of the process so far, all threads and the programs it waited for, s; `None`
/// where the system does not tell. It goes on counting where one program takes the place of another
/// in the same process.
fn processor_seconds() -> Option<f64> {
    processor_time_of_stat(&std::fs::read_to_string("/proc/self/stat").ok()?)
}

/// `utime`, `stime`, `cutime` and `cstime` of /proc/self/stat (Linux), which count hundredths of a second.
fn processor_time_of_stat(stat: &str) -> Option<f64> {
    // The name of the program stands in brackets and may hold blanks.
    let (_, rest) = stat.rsplit_once(')')?;
    let mut ticks = rest.split_whitespace().skip(11);
    let mut next = || ticks.next()?.parse::<f64>().ok();
    Some((next()? + next()? + next()? + next()?) / 100.0)
}

/// `VmHWM` of /proc/self/status (Linux), MiB.
fn peak_rss_mib() -> Option<f64> {
    peak_of_status(&std::fs::read_to_string("/proc/self/status").ok()?)
}

fn peak_of_status(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn stages_are_recorded_in_the_order_of_their_ends() {
        let progress = Progress::new(true);
        {
            let _outer = progress.stage(Stage::Model);
            let _inner = progress.titled_stage(Stage::Mesh, "inner");
            std::thread::sleep(Duration::from_millis(5));
        }
        let records = progress.records();
        assert_eq!(
            records.iter().map(|r| r.name.as_str()).collect::<Vec<_>>(),
            ["inner", "model"]
        );
        assert!(records.iter().all(|r| r.seconds >= 0.005));
        if cfg!(target_os = "linux") {
            assert!(records[0].peak_rss_mib.is_some_and(|m| m > 0.5));
        }
    }

    #[test]
    fn ids_lead_back_to_their_stage() {
        for stage in Stage::ALL {
            assert_eq!(Stage::of_id(stage.id()), Some(stage));
        }
        assert_eq!(Stage::of_id("response, 3 harmonics"), None);
    }

    #[test]
    fn a_bar_counts_the_steps_of_all_threads() {
        let progress = Progress::new(true);
        let bar = progress.bar(1000, "points");
        (0..1000).into_par_iter().for_each(|_| bar.step());
        assert_eq!(bar.done.load(Ordering::Relaxed), 1000);
    }

    #[test]
    fn warnings_are_kept_even_when_quiet() {
        let progress = Progress::new(true);
        progress.note("not kept");
        progress.warning("gmsh is missing");
        assert_eq!(progress.warnings(), ["gmsh is missing"]);
    }

    #[test]
    fn processor_time_is_read_from_the_status_of_the_process() {
        let stat = "7 (a b) c) R 1 2 3 4 5 6 7 8 9 10 150 30 15 5 20 0 4";
        assert_eq!(processor_time_of_stat(stat), Some(2.0));
        assert_eq!(processor_time_of_stat("7 (a) R 1"), None);
        if cfg!(target_os = "linux") {
            assert!(processor_seconds().is_some());
        }
    }

    #[test]
    fn peak_memory_is_read_from_the_status_of_the_process() {
        assert_eq!(
            peak_of_status("Name:\tx\nVmHWM:\t   2048 kB\nVmRSS:\t 1 kB\n"),
            Some(2.0)
        );
        assert_eq!(peak_of_status("VmRSS:\t 1 kB\n"), None);
        assert_eq!(peak_of_status("VmHWM:\t many kB\n"), None);
    }
}
