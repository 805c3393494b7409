//! Observes a run, measures its time, and passes its events on: as news to a [`Listener`], which is
//! [`crate::console`] in the program, as files to [`crate::files`].
//!
//! A new [`Event`] gets an arm in `Inner::handle_event` where notes, warnings or files follow from
//! it. Its words stand in `model.rs` (what a mesh has become, with `maps.rs`, `units.rs` and
//! `mistakes.rs`) or `findings.rs` (what a user should mind, with `excited.rs` and `stress.rs`).
//! Its files are an arm in `RunFiles::handle_event`.
//!
//! Several threads use one reporter. Each call holds a lock until the event is written and printed,
//! so that nothing in `Inner` may call a method of [`Reporter`].

mod excited;
mod findings;
mod line;
mod maps;
mod mistakes;
mod model;
mod stability;
mod stress;
mod units;

use std::fmt;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use self::line::ReportLine;
use crate::error::RunError;
use crate::exhaustion;
use crate::files::{RunTimes, SharedFiles};
use crate::listener::{Listener, News};
use crate::metrics::{peak_rss_mib, processor_seconds};
use dovetail_cache::Log;
use dovetail_export::manifest::StageSummary;
use dovetail_export::warning::{Warning, Weight};
use dovetail_solver::run::{Error, Event, Observer, Run, Session, Stage, StageEnd, Store};

/// Observer of a run. Several threads may use it at once.
pub struct Reporter<'c> {
    begin: Instant,
    processor_begin: Option<f64>,
    inner: Mutex<Inner<'c>>,
}

struct Inner<'c> {
    listener: Option<&'c mut dyn Listener>,
    /// True once the listener has ended the run.
    is_ended: bool,
    /// Files of the run; `None` if nothing is written.
    files: Option<Arc<SharedFiles>>,
    /// Begin of the stages under way, the innermost last.
    under_way: Vec<Began>,
    ended: Vec<StageSummary>,
    /// Error by which the reporter ends the run.
    failure: Option<RunError>,
}

struct Began {
    at: Instant,
    processor_seconds: Option<f64>,
}

impl fmt::Debug for Reporter<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Reporter").finish_non_exhaustive()
    }
}

impl<'c> Reporter<'c> {
    /// Reporter that tells `listener`, and writes `files`, if any.
    pub fn new(listener: &'c mut dyn Listener, files: Option<Arc<SharedFiles>>) -> Self {
        Self::create(Some(listener), files)
    }

    /// Reporter that writes `files`, if any, and tells nobody.
    pub fn silent(files: Option<Arc<SharedFiles>>) -> Self {
        Self::create(None, files)
    }

    fn create(listener: Option<&'c mut dyn Listener>, files: Option<Arc<SharedFiles>>) -> Self {
        Self {
            begin: Instant::now(),
            processor_begin: processor_seconds(),
            inner: Mutex::new(Inner {
                listener,
                is_ended: false,
                files,
                under_way: Vec::new(),
                ended: Vec::new(),
                failure: None,
            }),
        }
    }

    /// Locks the inner state. A panic of another thread that held the lock leaves the state intact.
    fn inner(&self) -> MutexGuard<'_, Inner<'c>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Passes on a note.
    pub fn note(&self, message: &str) {
        self.inner().note(message);
    }

    /// Passes on a warning.
    pub fn warning(&self, weight: Weight, text: impl Into<String>) {
        let text = text.into();
        self.inner().warning(&Warning { weight, text });
    }

    /// Begins a stage outside of the library, which ends when the guard is dropped.
    #[must_use = "the stage ends when the guard is dropped"]
    pub fn stage(&self, stage: Stage) -> ProgramStage<'_, 'c> {
        let reads = matches!(stage, Stage::Mesh | Stage::Matrices | Stage::ReducedModel);
        exhaustion::reads_files(reads);
        self.inner().begin_stage(stage.title());
        ProgramStage {
            reporter: self,
            stage,
            from_cache: false,
        }
    }

    /// Passes on the warnings about the motions of a run whose events were not observed.
    pub fn judge(&self, run: &Run) {
        let mut inner = self.inner();
        inner.warnings(findings::static_warnings(&run.reduced, &run.statics));
        inner.warnings(findings::motion_warnings(run));
    }

    /// Time and stages of the run so far.
    pub fn run_times(&self) -> RunTimes {
        let used = processor_seconds().zip(self.processor_begin);
        RunTimes {
            stages: self.inner().ended.clone(),
            seconds: self.begin.elapsed().as_secs_f64(),
            // What the process used before is that of a program that it replaced: `cargo run` and
            // the compilers that it waited for, a shell.
            processor_seconds: used.map(|(now, begin)| now - begin),
        }
    }

    /// Does `work` with a session that reports to this reporter and asks `store`.
    ///
    /// # Errors
    /// The error of the work, or the error by which the reporter ended it.
    pub fn run_observed<T>(
        &self,
        store: &mut dyn Store,
        work: impl FnOnce(&Session<'_>) -> Result<T, Error>,
    ) -> Result<T, RunError> {
        let mut observer = self;
        let done = work(&Session::new(&mut observer, store));
        done.map_err(|error| match (error, self.inner().failure.take()) {
            (Error::Stopped, Some(failure)) => failure,
            (error, _) => error.into(),
        })
    }

    /// Result of what the run asks for; an error ends the run.
    pub fn stop_on_error<T>(&self, result: Result<T, RunError>) -> ControlFlow<(), T> {
        match result {
            Ok(answer) => ControlFlow::Continue(answer),
            Err(error) => {
                self.inner().failure = Some(error);
                ControlFlow::Break(())
            }
        }
    }
}

impl Log for Reporter<'_> {
    fn note(&self, text: &str) {
        self.inner().note(text);
    }

    fn warning(&self, warning: &Warning) {
        self.inner().warning(warning);
    }
}

/// Stage under way outside of the library.
#[derive(Debug)]
pub struct ProgramStage<'r, 'c> {
    reporter: &'r Reporter<'c>,
    stage: Stage,
    from_cache: bool,
}

impl ProgramStage<'_, '_> {
    /// Marks the result of the stage as kept from an earlier run.
    pub fn mark_cached(&mut self) {
        self.from_cache = true;
    }
}

impl Drop for ProgramStage<'_, '_> {
    fn drop(&mut self) {
        let end = StageEnd::caller_stage(self.stage, self.from_cache);
        self.reporter.inner().end(&end);
    }
}

impl Observer for &Reporter<'_> {
    fn on_event(&mut self, event: &Event<'_>) -> ControlFlow<()> {
        let mut inner = self.inner();
        match inner.handle_event(event) {
            Ok(()) if inner.is_ended => ControlFlow::Break(()),
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                inner.failure = Some(error);
                ControlFlow::Break(())
            }
        }
    }
}

impl Inner<'_> {
    fn notify(&mut self, news: News<'_>) {
        if let Some(listener) = &mut self.listener {
            self.is_ended |= listener.on_news(news).is_break();
        }
    }

    fn note(&mut self, message: &str) {
        self.notify(News::Note(message));
    }

    fn warning(&mut self, warning: &Warning) {
        if let Some(files) = &self.files {
            files.locked().warning(warning);
        }
        self.notify(News::Warning(warning));
    }

    fn warnings(&mut self, warnings: impl IntoIterator<Item = Warning>) {
        for warning in warnings {
            self.warning(&warning);
        }
    }

    fn lines(&mut self, lines: Vec<ReportLine>) {
        for line in lines {
            match line {
                ReportLine::Note(text) => self.note(&text),
                ReportLine::Warning(warning) => self.warning(&warning),
            }
        }
    }

    fn begin_stage(&mut self, title: &str) {
        self.under_way.push(Began {
            at: Instant::now(),
            processor_seconds: processor_seconds(),
        });
        self.notify(News::StageBegins(title));
    }

    fn end(&mut self, end: &StageEnd) {
        let Some(began) = self.under_way.pop() else {
            return;
        };
        let used = processor_seconds().zip(began.processor_seconds);
        let stage = StageSummary {
            id: end.stage,
            name: end.title.clone(),
            seconds: end.took.unwrap_or_else(|| began.at.elapsed()).as_secs_f64(),
            processor_seconds: used
                .filter(|_| end.took.is_none())
                .map(|(to, from)| to - from),
            peak_memory_mib: peak_rss_mib(),
            from_cache: end.from_store,
            unknowns: end.unknowns.clone(),
        };
        self.notify(News::StageEnds(&stage));
        self.ended.push(stage);
    }

    fn handle_event(&mut self, event: &Event<'_>) -> Result<(), RunError> {
        match event {
            Event::StageBegins { title, .. } => {
                exhaustion::reads_files(false);
                self.begin_stage(title);
                return Ok(());
            }
            Event::StageEnds(end) => {
                self.end(end);
                return Ok(());
            }
            Event::Model {
                assembly,
                mesh,
                bound,
            } => {
                self.write(event)?;
                self.lines(model::lines(assembly, mesh, bound));
                self.warnings(findings::gap_warnings(&bound.model));
            }
            Event::PrestressPass { number, pass } => self.note(&model::pass_note(*number, pass)),
            Event::Reduced(reduced) => {
                self.write(event)?;
                self.lines(findings::model_lines(reduced));
            }
            Event::StaticState { reduced, statics } => {
                if let Some(note) = findings::linear_note(reduced, statics) {
                    self.note(&note);
                }
                self.warnings(findings::static_warnings(reduced, statics));
                self.write_in_stage(Stage::StaticFiles, event)?;
            }
            Event::ResponseBegins { .. } | Event::Worn(_) | Event::Peak { .. } => {
                self.write(event)?;
            }
            Event::Response(run) => {
                if let Some(note) = excited::all_stuck_note(run) {
                    self.note(&note);
                }
                self.warnings(findings::response_warnings(run));
                self.write_in_stage(Stage::ResponseFiles, event)?;
                let files = self.files.as_ref();
                let warnings = files.map(|files| stress::warnings(files.locked().summary()));
                self.warnings(warnings.unwrap_or_default());
            }
            _ => {}
        }
        self.notify(News::Event(event));
        Ok(())
    }

    fn write(&self, event: &Event<'_>) -> Result<(), RunError> {
        match &self.files {
            Some(files) => files.locked().handle_event(event),
            None => Ok(()),
        }
    }

    fn write_in_stage(&mut self, stage: Stage, event: &Event<'_>) -> Result<(), RunError> {
        if self.files.is_none() {
            return Ok(());
        }
        self.begin_stage(stage.title());
        let written = self.write(event);
        self.end(&StageEnd::caller_stage(stage, false));
        written
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Listener that ends the run at its first warning.
    #[derive(Default)]
    struct Nervous(Vec<String>);

    impl Listener for Nervous {
        fn on_news(&mut self, news: News<'_>) -> ControlFlow<()> {
            match news {
                News::StageBegins(title) => self.0.push(title.to_owned()),
                News::Warning(warning) => {
                    self.0.push(warning.text.clone());
                    return ControlFlow::Break(());
                }
                _ => {}
            }
            ControlFlow::Continue(())
        }
    }

    #[test]
    fn a_listener_hears_of_stages_and_warnings_and_ends_the_run() {
        let mut nervous = Nervous::default();
        {
            let reporter = Reporter::new(&mut nervous, None);
            let goes_on = || (&mut &reporter).on_event(&Event::LoopEnds).is_continue();
            drop(reporter.stage(Stage::Mesh));
            assert!(goes_on());
            reporter.warning(Weight::Doubt, "flat elements");
            assert!(!goes_on() && !goes_on());
        }
        assert_eq!(nervous.0, ["mesh", "flat elements"]);
    }

    #[test]
    fn stages_are_recorded_in_the_order_of_their_ends_with_their_time() {
        let reporter = Reporter::silent(None);
        {
            let _outer = reporter.stage(Stage::Mesh);
            let mut inner = reporter.stage(Stage::ReducedModelFiles);
            inner.mark_cached();
            std::thread::sleep(Duration::from_millis(5));
        }
        let mut kept = StageEnd::caller_stage(Stage::Reduction, true);
        kept.took = Some(Duration::from_secs(2));
        kept.unknowns = vec![7, 3];
        reporter.inner().begin_stage("reduction");
        reporter.inner().end(&kept);
        let taken = reporter.run_times();
        let names: Vec<&str> = taken.stages.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["files of the reduced model", "mesh", "reduction"]);
        assert!(taken.stages[..2].iter().all(|s| s.seconds >= 0.005));
        assert_eq!(taken.stages[2].seconds, 2.0);
        assert_eq!(taken.stages[2].processor_seconds, None);
        assert_eq!(taken.stages[2].unknowns, [7, 3]);
        let kept: Vec<bool> = taken.stages.iter().map(|s| s.from_cache).collect();
        assert_eq!(kept, [true, false, true]);
        if cfg!(target_os = "linux") {
            assert!(taken.stages[0].peak_memory_mib.is_some_and(|m| m > 0.5));
        }
    }
}
