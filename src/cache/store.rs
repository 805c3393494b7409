//! Store of results of earlier runs: reductions from the cache, solved frequencies from the journal
//! of the folder.

use std::ops::ControlFlow;
use std::sync::Arc;

use super::{Cache, Kind, Turn};
use crate::files::SharedFiles;
use crate::fingerprint;
use crate::reporter::Reporter;
use dovetail_export::journal::Inputs;
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::{Orbit, SolvedFrequency};
use dovetail_solver::reduction::Recovery;
use dovetail_solver::results::modes::Modes;
use dovetail_solver::run::{
    CurveInputs, KeptReduction, Key, PeakInputs, ReductionInputs, ResponseInputs, RunUpInputs,
    Store,
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

    fn entry(&self, kind: Kind, key: &Key) -> Option<super::Key> {
        self.cache.key(kind, key)
    }

    /// Frequencies of a response with these inputs that were solved before it was interrupted.
    fn solved_with(
        &self,
        inputs: impl FnOnce() -> Inputs,
    ) -> ControlFlow<(), Vec<SolvedFrequency>> {
        let Some(files) = &self.files else {
            return ControlFlow::Continue(Vec::new());
        };
        let earlier = files.locked().solved(inputs());
        self.reporter.unless_failed(earlier)
    }
}

impl Store for RunStore<'_, '_> {
    fn key(&mut self, inputs: &ReductionInputs) -> Option<Key> {
        self.cache
            .key(Kind::ReducedModel, inputs)
            .map(|key| key.hash)
    }

    fn reduction(&mut self, key: &Key) -> Option<KeptReduction> {
        let key = self.entry(Kind::ReducedModel, key);
        match self.cache.get_or_turn(key.as_ref(), Ok, self.reporter) {
            Ok(found) => Some(found),
            Err(turn) => {
                self.turn = turn;
                None
            }
        }
    }

    fn keep_reduction(&mut self, key: &Key, reduction: &KeptReduction, recovery: &Recovery) {
        let of_reduction = self.entry(Kind::ReducedModel, key);
        self.cache
            .put(of_reduction.as_ref(), reduction, self.reporter);
        self.keep_recovery(key, recovery);
        self.turn = None;
    }

    fn recovery(&mut self, key: &Key) -> Option<Recovery> {
        let key = self.entry(Kind::Recovery, key);
        self.cache.get(key.as_ref(), Ok, self.reporter)
    }

    fn keep_recovery(&mut self, key: &Key, recovery: &Recovery) {
        let key = self.entry(Kind::Recovery, key);
        self.cache.put(key.as_ref(), recovery, self.reporter);
    }

    fn held_modes(&mut self, key: &Key) -> Option<Vec<Modes>> {
        let key = self.entry(Kind::HeldModes, key);
        self.cache.get(key.as_ref(), Ok, self.reporter)
    }

    fn keep_held_modes(&mut self, key: &Key, modes: &[Modes]) {
        let key = self.entry(Kind::HeldModes, key);
        self.cache.put(key.as_ref(), &modes, self.reporter);
    }

    fn solved(&mut self, inputs: &ResponseInputs<'_>) -> ControlFlow<(), Vec<SolvedFrequency>> {
        let earlier = self.solved_with(|| hash_of(inputs))?;
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
        let earlier = self.solved_with(|| hash_along(inputs))?;
        if !earlier.is_empty() {
            let note = format!("{} speeds were solved before", earlier.len());
            self.reporter.note(&note);
        }
        ControlFlow::Continue(earlier)
    }

    fn peak_key(&mut self, inputs: &PeakInputs<'_>) -> Option<Key> {
        self.files.as_ref()?;
        let mut hasher = blake3::Hasher::new();
        hasher.update(&hash_of(&inputs.response));
        let (near, observation) = (inputs.near, inputs.observation);
        hasher.update(format!("{near:?}{observation}").as_bytes());
        Some(*hasher.finalize().as_bytes())
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
        let CurveInputs {
            last, key, range, ..
        } = inputs;
        let mut hasher = blake3::Hasher::new();
        hasher.update(&hash_of(&inputs.response));
        let of_last = (&last.laws, &last.excitations, &last.reduced.omega2);
        hasher.update(format!("{of_last:?}{key}{range:?}").as_bytes());
        Some(*hasher.finalize().as_bytes())
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

/// Hash of all inputs of a response, including the program.
fn hash_of(inputs: &ResponseInputs<'_>) -> Inputs {
    let ResponseInputs {
        problem,
        damping,
        state,
        settings,
        points,
        ..
    } = inputs;
    let mut hasher = blake3::Hasher::new();
    hasher.update(&fingerprint::key());
    // Numbers are written so that they read back to the bit.
    let (loads, laws) = (&problem.excitations, &problem.laws);
    let ratios = &problem.modal_ratios;
    let rest = (&state.x, &state.lambda, &state.status, state.retention_n);
    hasher.update(
        format!("{loads:?}{laws:?}{damping:?}{ratios:?}{rest:?}{settings:?}{points:?}").as_bytes(),
    );
    if postcard::to_io(&problem.reduced, &mut hasher).is_err() {
        unreachable!("a hasher takes all bytes");
    }
    *hasher.finalize().as_bytes()
}

/// Hash of all inputs of a response along an engine order, including the program. What belongs to a
/// speed follows from them.
fn hash_along(inputs: &RunUpInputs<'_>) -> Inputs {
    let RunUpInputs { model, scene, .. } = inputs;
    let mut hasher = blake3::Hasher::new();
    hasher.update(&fingerprint::key());
    let Scene {
        damping,
        modal_ratios,
        static_state,
        response,
        ..
    } = scene;
    hasher.update(format!("{damping:?}{modal_ratios:?}{static_state:?}{response:?}").as_bytes());
    if postcard::to_io(model, &mut hasher).is_err() {
        unreachable!("a hasher takes all bytes");
    }
    *hasher.finalize().as_bytes()
}
