//! Store of results of earlier runs: reductions from the cache, solved frequencies from the journal
//! of the folder.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::files::SharedFiles;
use crate::reporter::Reporter;
use dovetail_cache::{Cache, Turn, inputs};
use dovetail_solver::dlft::{Orbit, SolvedFrequency};
use dovetail_solver::reduction::Recovery;
use dovetail_solver::results::modes::Modes;
use dovetail_solver::run::{
    CurveInputs, KeptReduction, Key, PeakInputs, RecordInputs, ReductionInputs, ResponseInputs,
    RunUpInputs, Store,
};

/// Store of a run: its cache and its files.
#[derive(Debug)]
pub struct RunStore<'r, 'c> {
    cache: Cache,
    files: Option<Arc<SharedFiles>>,
    reporter: &'r Reporter<'c>,
    /// Right to make the missing reduction, until it is kept.
    turn: Option<Turn>,
}

impl<'r, 'c> RunStore<'r, 'c> {
    /// Store that reads from `cache` and continues from `files`.
    pub fn new(cache: Cache, files: Option<Arc<SharedFiles>>, reporter: &'r Reporter<'c>) -> Self {
        Self {
            cache,
            files,
            reporter,
            turn: None,
        }
    }

    /// Frequencies of a response with these inputs that were solved before it was interrupted.
    fn solved_with(&self, inputs: &RecordInputs<'_>) -> ControlFlow<(), Vec<SolvedFrequency>> {
        let Some((files, key)) = self.files.as_ref().zip(inputs::of_records(inputs)) else {
            return ControlFlow::Continue(Vec::new());
        };
        let earlier = files.locked().solved(key);
        self.reporter.unless_failed(earlier)
    }
}

impl Store for RunStore<'_, '_> {
    fn key(&mut self, inputs: &ReductionInputs) -> Option<Key> {
        self.cache.reduction_key(inputs)
    }

    fn reduction(&mut self, key: &Key) -> Option<KeptReduction> {
        match self.cache.reduction(key, self.reporter) {
            Ok(found) => Some(found),
            Err(turn) => {
                self.turn = turn;
                None
            }
        }
    }

    fn keep_reduction(&mut self, key: &Key, reduction: &KeptReduction, recovery: &Recovery) {
        self.cache.keep_reduction(key, reduction, self.reporter);
        self.keep_recovery(key, recovery);
        self.turn = None;
    }

    fn recovery(&mut self, key: &Key) -> Option<Recovery> {
        self.cache.recovery(key, self.reporter)
    }

    fn keep_recovery(&mut self, key: &Key, recovery: &Recovery) {
        self.cache.keep_recovery(key, recovery, self.reporter);
    }

    fn held_modes(&mut self, key: &Key) -> Option<Vec<Modes>> {
        self.cache.held_modes(key, self.reporter)
    }

    fn keep_held_modes(&mut self, key: &Key, modes: &[Modes]) {
        self.cache.keep_held_modes(key, modes, self.reporter);
    }

    fn solved(&mut self, inputs: &ResponseInputs<'_>) -> ControlFlow<(), Vec<SolvedFrequency>> {
        let earlier = self.solved_with(&RecordInputs::Response(*inputs))?;
        if !earlier.is_empty() {
            let before = earlier.len();
            self.reporter.note(&match inputs.points {
                Some(points) => format!("{before} of {points} frequencies were solved before"),
                None => format!("{before} points of the curve were solved before"),
            });
        }
        ControlFlow::Continue(earlier)
    }

    fn solved_along(&mut self, inputs: &RunUpInputs<'_>) -> ControlFlow<(), Vec<SolvedFrequency>> {
        let earlier = self.solved_with(&RecordInputs::RunUp(*inputs))?;
        if !earlier.is_empty() {
            let note = format!("{} speeds were solved before", earlier.len());
            self.reporter.note(&note);
        }
        ControlFlow::Continue(earlier)
    }

    fn peak_key(&mut self, inputs: &PeakInputs<'_>) -> Option<Key> {
        self.files.as_ref()?;
        inputs::of_records(&RecordInputs::Peak(*inputs))
    }

    fn peak(&mut self, key: &Key) -> ControlFlow<(), Option<Orbit>> {
        let Some(files) = &self.files else {
            return ControlFlow::Continue(None);
        };
        self.reporter.unless_failed(files.locked().kept_peak(key))
    }

    fn keep_peak(&mut self, key: &Key, peak: &Orbit) -> ControlFlow<()> {
        let Some(files) = &self.files else {
            return ControlFlow::Continue(());
        };
        self.reporter
            .unless_failed(files.locked().keep_peak(key, peak))
    }

    fn curve_key(&mut self, inputs: &CurveInputs<'_>) -> Option<Key> {
        self.files.as_ref()?;
        inputs::of_records(&RecordInputs::Curve(*inputs))
    }

    fn curve_points(&mut self, key: &Key) -> ControlFlow<(), Vec<SolvedFrequency>> {
        let Some(files) = &self.files else {
            return ControlFlow::Continue(Vec::new());
        };
        self.reporter.unless_failed(files.locked().kept_points(key))
    }

    fn keep_curve_point(&mut self, key: &Key, point: &SolvedFrequency) -> ControlFlow<()> {
        let Some(files) = &self.files else {
            return ControlFlow::Continue(());
        };
        let kept = files.locked().keep_point(key, point);
        self.reporter.unless_failed(kept)
    }
}
