//! The clock of a run measures its stages, and tells an [`Observer`] of them as they come. Several
//! threads may use it at once.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::observer::Observer;
use crate::metrics::{peak_rss_mib, processor_seconds};
use crate::stage::{Stage, StageRecord};
use crate::warning::{Warning, Weight};

/// Where a run reports to.
pub struct Progress<'o> {
    begin: Instant,
    processor_begin: Option<f64>,
    observer: Mutex<&'o mut dyn Observer>,
    records: Mutex<Vec<StageRecord>>,
}

impl fmt::Debug for Progress<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Progress")
            .field("records", &self.records)
            .finish_non_exhaustive()
    }
}

impl<'o> Progress<'o> {
    pub fn new(observer: &'o mut dyn Observer) -> Self {
        Self {
            begin: Instant::now(),
            processor_begin: processor_seconds(),
            observer: Mutex::new(observer),
            records: Mutex::default(),
        }
    }

    /// Tells the observer, while no one else does.
    pub fn tell<T>(&self, tell: impl FnOnce(&mut dyn Observer) -> T) -> T {
        tell(&mut **lock(&self.observer))
    }

    /// Begins a stage, which ends when the guard is dropped.
    #[must_use = "the stage ends when the guard is dropped"]
    pub fn stage(&self, stage: Stage) -> StageGuard<'_, 'o> {
        self.titled_stage(stage, stage.title())
    }

    /// Begins a stage under a title of its own.
    #[must_use = "the stage ends when the guard is dropped"]
    pub fn titled_stage(&self, stage: Stage, title: &str) -> StageGuard<'_, 'o> {
        self.tell(|observer| observer.stage_begins(stage, title));
        StageGuard {
            progress: self,
            stage,
            name: title.to_owned(),
            begin: Instant::now(),
            processor_begin: processor_seconds(),
            from_cache: AtomicBool::new(false),
            unknowns: Mutex::default(),
        }
    }

    /// Records a stage that took `time`, its result kept from an earlier run.
    pub fn kept_stage(&self, stage: Stage, time: Duration) {
        let now = Instant::now();
        self.tell(|observer| observer.stage_begins(stage, stage.title()));
        drop(StageGuard {
            progress: self,
            stage,
            name: stage.title().to_owned(),
            begin: now.checked_sub(time).unwrap_or(now),
            processor_begin: None,
            from_cache: AtomicBool::new(true),
            unknowns: Mutex::default(),
        });
    }

    /// A loop of `steps` steps, which ends when the guard is dropped.
    #[must_use = "the loop ends when the guard is dropped"]
    pub fn steps(&self, steps: usize, label: &str) -> Steps<'_, 'o> {
        self.tell(|observer| observer.loop_begins(label, steps));
        Steps { progress: self }
    }

    /// Something to know.
    pub fn note(&self, message: &str) {
        self.tell(|observer| observer.note(message));
    }

    /// Something to mind.
    pub fn warning(&self, weight: Weight, text: impl Into<String>) {
        let text = text.into();
        self.tell(|observer| observer.warning(&Warning { weight, text }));
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
}

/// A stage under way. Its end is told and recorded when this is dropped.
#[derive(Debug)]
pub struct StageGuard<'p, 'o> {
    progress: &'p Progress<'o>,
    stage: Stage,
    name: String,
    begin: Instant,
    processor_begin: Option<f64>,
    from_cache: AtomicBool,
    unknowns: Mutex<Vec<usize>>,
}

impl StageGuard<'_, '_> {
    /// What the stage makes was kept from an earlier run.
    pub fn from_cache(&self) {
        self.from_cache.store(true, Ordering::Relaxed);
    }

    /// One more system that the stage solves, with so many unknowns.
    pub fn solves(&self, unknowns: usize) {
        lock(&self.unknowns).push(unknowns);
    }
}

impl Drop for StageGuard<'_, '_> {
    fn drop(&mut self) {
        let mut unknowns = std::mem::take(&mut *lock(&self.unknowns));
        unknowns.sort_unstable_by(|a, b| b.cmp(a));
        let record = StageRecord {
            stage: self.stage,
            name: std::mem::take(&mut self.name),
            seconds: self.begin.elapsed().as_secs_f64(),
            processor_seconds: processor_seconds()
                .zip(self.processor_begin)
                .map(|(to, from)| to - from),
            peak_rss_mib: peak_rss_mib(),
            from_cache: self.from_cache.load(Ordering::Relaxed),
            unknowns,
        };
        self.progress.tell(|observer| observer.stage_ends(&record));
        lock(&self.progress.records).push(record);
    }
}

/// The steps of a long loop, which may come from several threads.
#[derive(Debug)]
pub struct Steps<'p, 'o> {
    progress: &'p Progress<'o>,
}

impl Steps<'_, '_> {
    /// One more step is done.
    pub fn step(&self) {
        self.advance(1);
    }

    /// One more step is to be done.
    pub fn grow(&self) {
        self.progress.tell(|observer| observer.loop_grows());
    }

    /// What goes on within a step.
    pub fn detail(&self, detail: &str) {
        self.progress.tell(|observer| observer.loop_detail(detail));
    }

    /// `steps` more steps are done.
    pub fn advance(&self, steps: usize) {
        self.progress.tell(|observer| observer.loop_advances(steps));
    }
}

impl Drop for Steps<'_, '_> {
    fn drop(&mut self) {
        self.progress.tell(|observer| observer.loop_ends());
    }
}

/// A panic of another thread while it held the lock leaves what it guards whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    /// Writes down what it hears.
    #[derive(Default)]
    struct Listener {
        heard: Vec<String>,
        steps: usize,
    }

    impl Observer for Listener {
        fn stage_begins(&mut self, stage: Stage, title: &str) {
            self.heard.push(format!("{} begins: {title}", stage.id()));
        }
        fn stage_ends(&mut self, record: &StageRecord) {
            self.heard.push(format!("{} ends", record.stage.id()));
        }
        fn loop_advances(&mut self, steps: usize) {
            self.steps += steps;
        }
        fn note(&mut self, message: &str) {
            self.heard.push(message.to_owned());
        }
    }

    #[test]
    fn stages_are_told_and_recorded_in_the_order_of_their_ends() {
        let mut listener = Listener::default();
        let progress = Progress::new(&mut listener);
        {
            let _outer = progress.stage(Stage::Model);
            let inner = progress.titled_stage(Stage::Mesh, "inner");
            inner.solves(3);
            inner.solves(7);
            std::thread::sleep(Duration::from_millis(5));
        }
        progress.kept_stage(Stage::Reduction, Duration::from_secs(2));
        progress.note("heard");
        let records = progress.records();
        assert_eq!(
            records.iter().map(|r| r.name.as_str()).collect::<Vec<_>>(),
            ["inner", "model", "reduction"]
        );
        assert!(records.iter().all(|r| r.seconds >= 0.005));
        assert_eq!(records[0].unknowns, [7, 3]);
        assert!(records[2].from_cache && records[2].seconds >= 2.0);
        if cfg!(target_os = "linux") {
            assert!(records[0].peak_rss_mib.is_some_and(|m| m > 0.5));
        }
        assert_eq!(
            listener.heard,
            [
                "model begins: model",
                "mesh begins: inner",
                "mesh ends",
                "model ends",
                "reduction begins: reduction",
                "reduction ends",
                "heard"
            ]
        );
    }

    #[test]
    fn steps_of_all_threads_are_heard() {
        let mut listener = Listener::default();
        let progress = Progress::new(&mut listener);
        let steps = progress.steps(1000, "points");
        (0..1000).into_par_iter().for_each(|_| steps.step());
        drop(steps);
        assert_eq!(listener.steps, 1000);
    }
}
