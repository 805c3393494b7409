//! Reports of a running run, and access to results of earlier runs.
//!
//! A [`Session`] is passed to all stages of a run. It reports each [`Event`] to an [`Observer`],
//! and asks a [`Store`] for results of earlier runs. Several threads may use it at once.

use std::fmt;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::bodies::Bound;
use super::error::Error;
use super::kept::{PrestressPass, ReductionInputs, ReductionKey, StoreEntry, StoreSlot};
use super::outcome::{PeakAt, Run, StaticResult};
use super::records::{RecordInputs, RecordKey, Recorded};
use super::reduced::ReducedScene;
use super::worn::WearCourse;
use crate::dlft::{Attempt, SolvedFrequency, Stop};
use crate::model::Assembly;
use dovetail_mesh::Mesh;

/// Part of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Stage {
    /// The caller of the library generates or reads the mesh.
    Mesh,
    /// The caller of the library reads the matrices of bodies.
    Matrices,
    /// Names become indices, flanks become pairs.
    Model,
    /// Matrices of the bodies.
    FiniteElements,
    /// Bodies are reduced to pairs and modes.
    Reduction,
    /// The reduction is stored for later runs.
    Keeping,
    /// The recovery of the bodies' motion is taken from the store.
    Recovery,
    /// A reduced model is read.
    ReducedModel,
    /// The caller of the library writes the files of a reduced model.
    ReducedModelFiles,
    /// Modes of each body alone with its flanks held.
    HeldModes,
    /// Modes of a Campbell diagram.
    ModesAtSpeeds,
    /// Modes of a disc at each nodal diameter.
    NodalDiameters,
    /// Static state with friction.
    StaticState,
    /// The observer writes the files of the static state.
    StaticFiles,
    /// Harmonic balance over the frequencies.
    Response,
    /// Stability of the motions of the response.
    Stability,
    /// Harmonic balance from other starting tractions.
    StartingTractions,
    /// The observer writes the files of the response.
    ResponseFiles,
    /// The motion is integrated in time, to check harmonic balance or to leave an unstable one.
    TimeIntegration,
    /// Peaks over a value of the scene.
    Peaks,
    /// Frequency and damping of a mode over its amplitude.
    Backbone,
    /// Motions at one frequency over a value of the scene.
    Curve,
    /// Wear of the contacts over the cycles.
    Wear,
}

/// Name for programs, which stays when a title changes.
impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl Stage {
    /// Name for programs.
    pub fn id(self) -> String {
        self.to_string()
    }

    /// Title for readers, where a run has no better one.
    pub fn title(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Matrices => "matrices of other programs",
            Self::Model => "model",
            Self::FiniteElements => "finite elements",
            Self::Reduction => "reduction",
            Self::Keeping => "cache",
            Self::Recovery => "recovery",
            Self::ReducedModel => "reduced model",
            Self::ReducedModelFiles => "files of the reduced model",
            Self::HeldModes => "modes of each body, flanks held",
            Self::ModesAtSpeeds => "modes at each speed",
            Self::NodalDiameters => "modes at each nodal diameter",
            Self::StaticState => "static state",
            Self::StaticFiles => "static files",
            Self::Response => "response",
            Self::Stability => "stability",
            Self::StartingTractions => "starting tractions",
            Self::ResponseFiles => "response files",
            Self::TimeIntegration => "time integration",
            Self::Peaks => "peaks",
            Self::Backbone => "backbone",
            Self::Curve => "curve",
            Self::Wear => "wear",
        }
    }
}

/// Event of a run.
#[derive(Debug)]
#[non_exhaustive]
pub enum Event<'a> {
    /// A stage begins.
    StageBegins {
        /// Stage that begins.
        stage: Stage,
        /// Title of the stage for a reader.
        title: &'a str,
    },
    /// The stage that began last ends.
    StageEnds(&'a StageEnd),
    /// A loop begins.
    LoopBegins {
        /// Name of its steps, in one word.
        label: &'a str,
        /// Number of steps; 0 where it is not known ([`Event::LoopExpects`]).
        steps: usize,
    },
    /// The loop that began last is now expected to have so many steps in all, those that are done
    /// included.
    LoopExpects(usize),
    /// A number of further steps of the loop that began last are done.
    LoopAdvances(usize),
    /// The loop that began last ends.
    LoopEnds,
    /// Names have become indices, and flanks pairs.
    Model {
        /// Assembly that was bound.
        assembly: &'a Assembly,
        /// Mesh that it was bound to.
        mesh: &'a Mesh,
        /// Result of the binding.
        bound: &'a Bound,
    },
    /// One pass of the prestress by contact is done.
    PrestressPass {
        /// Number of the pass, counted from 1.
        number: usize,
        /// Change in this pass.
        pass: &'a PrestressPass,
    },
    /// The reduced model is available.
    Reduced(&'a ReducedScene),
    /// The static state is available, converged or not.
    StaticState {
        /// Reduced model of the state.
        reduced: &'a ReducedScene,
        /// State, with the quantities derived from it.
        statics: &'a StaticResult,
    },
    /// A response is about to be computed.
    ResponseBegins {
        /// Reduced model of the response.
        reduced: &'a ReducedScene,
        /// Frequencies that are asked for, Hz, ascending.
        frequencies_hz: &'a [f64],
        /// Harmonics of the response that the scene's own is compared with; `None` for its own.
        compared_harmonics: Option<usize>,
    },
    /// A strategy is tried at a frequency.
    Tries(Attempt<'a>),
    /// One frequency of the response that began last is solved, converged or not, or solved once
    /// more ([`SolvedFrequency::again`]).
    Frequency(&'a SolvedFrequency),
    /// The response is available, and the one that it is compared with.
    Response(&'a Run),
    /// One more block of cycles has worn the contacts.
    Worn(WearCourse<'a>),
    /// A peak over a value of the scene is found.
    Peak {
        /// Reduced model of the value.
        reduced: &'a ReducedScene,
        /// Number of the observed displacement.
        observation: usize,
        /// Peak, with its value.
        peak: &'a PeakAt,
    },
}

/// End of a stage.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct StageEnd {
    /// Stage that ended.
    pub stage: Stage,
    /// Title of the stage for a reader.
    pub title: String,
    /// True if the result of the stage was taken from the store.
    pub from_store: bool,
    /// Time that it took; `None` where the time between the events counts.
    pub took: Option<Duration>,
    /// Number of unknowns of each system that it solved, the largest first.
    pub unknowns: Vec<usize>,
}

impl StageEnd {
    /// End of a stage of the caller of the library, for which the time between the events counts.
    pub fn caller_stage(stage: Stage, from_store: bool) -> Self {
        Self {
            stage,
            title: stage.title().to_owned(),
            from_store,
            took: None,
            unknowns: Vec::new(),
        }
    }
}

/// Receiver of the events of a run. The calls come one after the other, from any thread that
/// reports an event.
pub trait Observer: Send {
    /// Receives an event. [`ControlFlow::Break`] ends the run with [`Error::Stopped`] as soon as
    /// the current stage allows.
    fn on_event(&mut self, event: &Event<'_>) -> ControlFlow<()>;
}

/// Observer that ignores all events.
impl Observer for () {
    fn on_event(&mut self, _: &Event<'_>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Store of results of runs. By default it keeps nothing and finds nothing.
pub trait Store: Send {
    /// Key of a reduction; `None` where nothing is kept.
    fn key(&mut self, _inputs: &ReductionInputs) -> Option<ReductionKey> {
        None
    }
    /// Fills a place with the entry under a key. The place stays empty without such an entry: the run
    /// then makes the content, and keeps it.
    fn load(&mut self, _key: &ReductionKey, _place: StoreSlot<'_>) {}
    /// Keeps an entry under a key.
    fn keep(&mut self, _key: &ReductionKey, _entry: StoreEntry<'_>) {}
    /// Motions with these inputs that an earlier run solved for before it was interrupted.
    /// [`ControlFlow::Break`] ends the run.
    fn records(&mut self, _inputs: &RecordInputs<'_>) -> ControlFlow<(), Recorded> {
        ControlFlow::Continue(Recorded::default())
    }
    /// Keeps a motion, unless it is kept. [`ControlFlow::Break`] ends the run.
    fn append(&mut self, _key: &RecordKey, _motion: &SolvedFrequency) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Store that keeps nothing.
impl Store for () {}

/// Observer and store of a run.
pub struct Session<'o> {
    observer: Mutex<&'o mut dyn Observer>,
    store: Mutex<&'o mut dyn Store>,
    stopped: AtomicBool,
}

impl fmt::Debug for Session<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Session").finish_non_exhaustive()
    }
}

impl<'o> Session<'o> {
    /// Session that reports to `observer` and asks `store`.
    pub fn new(observer: &'o mut dyn Observer, store: &'o mut dyn Store) -> Self {
        Self {
            observer: Mutex::new(observer),
            store: Mutex::new(store),
            stopped: AtomicBool::new(false),
        }
    }

    /// Reports an event to the observer, one at a time.
    ///
    /// # Errors
    /// [`Error::Stopped`] where the observer has ended the run.
    pub(crate) fn report(&self, event: &Event<'_>) -> Result<(), Error> {
        if lock(&self.observer).on_event(event).is_break() {
            self.stopped.store(true, Ordering::Relaxed);
        }
        self.check_running()
    }

    /// Checks that the run continues.
    ///
    /// # Errors
    /// [`Error::Stopped`] where the observer or the store has ended it.
    pub(super) fn check_running(&self) -> Result<(), Error> {
        if self.stopped.load(Ordering::Relaxed) {
            return Err(Error::Stopped);
        }
        Ok(())
    }

    /// Stops a sweep where the observer has ended the run.
    pub(super) fn stop_if_ended(&self, stop: &Stop) {
        if self.check_running().is_err() {
            stop.stop();
        }
    }

    /// Fills a place with the entry that the store has under a key, if there is a key.
    pub(super) fn load(&self, key: Option<ReductionKey>, place: StoreSlot<'_>) {
        if let Some(key) = key {
            self.store().load(&key, place);
        }
    }

    /// Has the store keep an entry under a key, if there is a key.
    pub(super) fn keep(&self, key: Option<ReductionKey>, entry: StoreEntry<'_>) {
        if let Some(key) = key {
            self.store().keep(&key, entry);
        }
    }

    /// Motions with these inputs that the store has.
    ///
    /// # Errors
    /// [`Error::Stopped`] where the store ends the run.
    pub(super) fn records(&self, inputs: &RecordInputs<'_>) -> Result<Recorded, Error> {
        match self.store().records(inputs) {
            ControlFlow::Continue(recorded) => Ok(recorded),
            ControlFlow::Break(()) => Err(Error::Stopped),
        }
    }

    /// Has the store keep a motion under a key, if there is a key. A store that ends the run does so as an
    /// observer does.
    ///
    /// # Errors
    /// [`Error::Stopped`] where the run is ended.
    pub(super) fn append(
        &self,
        key: Option<RecordKey>,
        motion: &SolvedFrequency,
    ) -> Result<(), Error> {
        if key.is_some_and(|key| self.store().append(&key, motion).is_break()) {
            self.stopped.store(true, Ordering::Relaxed);
        }
        self.check_running()
    }

    /// Store, locked for this thread.
    pub(super) fn store(&self) -> MutexGuard<'_, &'o mut dyn Store> {
        lock(&self.store)
    }

    /// Begins a stage, which ends when the guard is dropped.
    pub(super) fn stage(&self, stage: Stage) -> StageGuard<'_, 'o> {
        self.titled_stage(stage, stage.title())
    }

    /// Begins a stage under a title of its own.
    pub(super) fn titled_stage(&self, stage: Stage, title: &str) -> StageGuard<'_, 'o> {
        // An observer that ends the run takes effect at the next result.
        let _ = self.report(&Event::StageBegins { stage, title });
        StageGuard {
            session: self,
            stage,
            title: title.to_owned(),
            unknowns: Mutex::default(),
            took: Mutex::default(),
        }
    }

    /// Reports a stage that took `time` and whose result comes from the store.
    pub(super) fn report_stored_stage(&self, stage: Stage, time: Duration) {
        let title = stage.title();
        let _ = self.report(&Event::StageBegins { stage, title });
        let _ = self.report(&Event::StageEnds(&StageEnd {
            took: Some(time),
            ..StageEnd::caller_stage(stage, true)
        }));
    }

    /// Begins a loop of `steps` steps, which ends when the guard is dropped.
    pub(super) fn steps(&self, steps: usize, label: &str) -> Steps<'_, 'o> {
        let _ = self.report(&Event::LoopBegins { label, steps });
        Steps { session: self }
    }
}

/// Running stage. Its end is reported when this is dropped.
#[must_use = "the stage ends when the guard is dropped"]
pub(super) struct StageGuard<'s, 'o> {
    session: &'s Session<'o>,
    stage: Stage,
    title: String,
    unknowns: Mutex<Vec<usize>>,
    took: Mutex<Option<Duration>>,
}

impl StageGuard<'_, '_> {
    /// Records one more system that the stage solves, with so many unknowns.
    pub(super) fn solves(&self, unknowns: usize) {
        lock(&self.unknowns).push(unknowns);
    }

    /// Records the time that counts as that of the stage, where a part of it is told otherwise.
    pub(super) fn set_time(&self, time: Duration) {
        *lock(&self.took) = Some(time);
    }
}

impl Drop for StageGuard<'_, '_> {
    fn drop(&mut self) {
        let mut unknowns = std::mem::take(&mut *lock(&self.unknowns));
        unknowns.sort_unstable_by(|a, b| b.cmp(a));
        let _ = self.session.report(&Event::StageEnds(&StageEnd {
            stage: self.stage,
            title: std::mem::take(&mut self.title),
            from_store: false,
            took: *lock(&self.took),
            unknowns,
        }));
    }
}

/// Steps of a long loop, which may come from several threads.
#[must_use = "the loop ends when the guard is dropped"]
pub(super) struct Steps<'s, 'o> {
    session: &'s Session<'o>,
}

impl Steps<'_, '_> {
    /// Reports how many steps the loop is expected to have in all.
    pub(super) fn expect(&self, steps: usize) {
        let _ = self.session.report(&Event::LoopExpects(steps));
    }

    /// Reports that one more step is done.
    pub(super) fn step(&self) {
        let _ = self.session.report(&Event::LoopAdvances(1));
    }
}

impl Drop for Steps<'_, '_> {
    fn drop(&mut self) {
        let _ = self.session.report(&Event::LoopEnds);
    }
}

/// Locks a mutex. A panic of another thread that had the lock leaves the data intact.
pub(super) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    /// Records the events, and ends the run at a loop of no steps.
    #[derive(Default)]
    struct Listener {
        heard: Vec<String>,
        steps: usize,
    }

    impl Observer for Listener {
        fn on_event(&mut self, event: &Event<'_>) -> ControlFlow<()> {
            match event {
                Event::StageBegins { stage, title } => {
                    self.heard.push(format!("{} begins: {title}", stage.id()));
                }
                Event::StageEnds(end) => {
                    let (title, unknowns, took) = (&end.title, &end.unknowns, end.took);
                    self.heard
                        .push(format!("{title} ends: {unknowns:?}, {took:?}"));
                }
                Event::LoopAdvances(steps) => self.steps += steps,
                Event::LoopBegins { steps: 0, .. } => return ControlFlow::Break(()),
                _ => {}
            }
            ControlFlow::Continue(())
        }
    }

    /// Listener that has heard what `run` tells.
    fn record_events(run: impl FnOnce(&Session<'_>)) -> Listener {
        let mut listener = Listener::default();
        run(&Session::new(&mut listener, &mut ()));
        listener
    }

    #[test]
    fn stages_are_told_in_the_order_of_their_ends() {
        let listener = record_events(|session| {
            {
                let _outer = session.stage(Stage::Model);
                let inner = session.titled_stage(Stage::Response, "inner");
                inner.solves(3);
                inner.solves(7);
            }
            session.report_stored_stage(Stage::Reduction, Duration::from_secs(2));
        });
        assert_eq!(
            listener.heard,
            [
                "model begins: model",
                "response begins: inner",
                "inner ends: [7, 3], None",
                "model ends: [], None",
                "reduction begins: reduction",
                "reduction ends: [], Some(2s)",
            ]
        );
    }

    #[test]
    fn steps_of_all_threads_are_heard() {
        let listener = record_events(|session| {
            let steps = session.steps(1000, "points");
            (0..1000).into_par_iter().for_each(|_| steps.step());
        });
        assert_eq!(listener.steps, 1000);
    }

    #[test]
    fn an_observer_ends_a_run_for_good() {
        record_events(|session| {
            assert!(session.check_running().is_ok());
            drop(session.steps(0, "points"));
            assert!(matches!(session.check_running(), Err(Error::Stopped)));
            assert!(session.report(&Event::LoopEnds).is_err());
        });
    }

    #[test]
    fn the_id_of_a_stage_leads_back_to_it() {
        let stage = Stage::ReducedModelFiles;
        assert_eq!(stage.id(), "reduced_model_files");
        let read = serde_json::from_value::<Stage>(stage.id().into());
        assert_eq!(read.unwrap(), stage);
    }
}
