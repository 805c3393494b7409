//! Store of results of earlier runs: reductions from the cache, motions from the journals of the
//! folder.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::files::SharedFiles;
use crate::reporter::Reporter;
use dovetail_cache::{Cache, EntryClaim, inputs};
use dovetail_export::warning::Weight;
use dovetail_solver::dlft::SolvedFrequency;
use dovetail_solver::run::{
    RecordInputs, RecordKey, Recorded, ReductionInputs, ReductionKey, Store, StoreEntry, StoreSlot,
};

/// Store of a run: its cache and its files.
#[derive(Debug)]
pub struct RunStore<'r, 'c> {
    cache: Cache,
    files: Option<Arc<SharedFiles>>,
    reporter: &'r Reporter<'c>,
    /// Right to make the missing reduction, until it is kept.
    turn: Option<EntryClaim>,
    /// True if a frequency could not be kept, which is reported only once.
    not_kept: bool,
}

impl<'r, 'c> RunStore<'r, 'c> {
    /// Store that reads from `cache` and continues from `files`.
    pub fn new(cache: Cache, files: Option<Arc<SharedFiles>>, reporter: &'r Reporter<'c>) -> Self {
        Self {
            cache,
            files,
            reporter,
            turn: None,
            not_kept: false,
        }
    }
}

impl Store for RunStore<'_, '_> {
    fn key(&mut self, inputs: &ReductionInputs) -> Option<ReductionKey> {
        self.cache.reduction_key(inputs)
    }

    fn load(&mut self, key: &ReductionKey, place: StoreSlot<'_>) {
        if let Some(turn) = self.cache.load(key, place, self.reporter) {
            self.turn = Some(turn);
        }
    }

    fn keep(&mut self, key: &ReductionKey, entry: StoreEntry<'_>) {
        self.cache.keep(key, entry, self.reporter);
        if matches!(entry, StoreEntry::Reduction(..)) {
            self.turn = None;
        }
    }

    fn records(&mut self, inputs: &RecordInputs<'_>) -> ControlFlow<(), Recorded> {
        let files = self.files.as_ref();
        let Some((files, hash)) =
            files.and_then(|files| Some((files, inputs::records_hash(inputs)?)))
        else {
            return ControlFlow::Continue(Recorded::default());
        };
        let key = inputs.key(hash);
        let earlier = files.locked().records(&key);
        let earlier = self.reporter.stop_on_error(earlier)?;
        if let Some(note) = note(inputs, earlier.len()) {
            self.reporter.note(&note);
        }
        ControlFlow::Continue(Recorded {
            key: Some(key),
            earlier,
        })
    }

    fn append(&mut self, key: &RecordKey, motion: &SolvedFrequency) -> ControlFlow<()> {
        let Some(files) = &self.files else {
            return ControlFlow::Continue(());
        };
        let kept = files.locked().append(key, motion);
        match (key, kept) {
            // Its result does not depend on it.
            (RecordKey::Response(_), Err(error)) => {
                if !std::mem::replace(&mut self.not_kept, true) {
                    let text =
                        format!("what is solved is not kept if the run is broken off: {error}");
                    self.reporter.warning(Weight::Remark, text);
                }
                ControlFlow::Continue(())
            }
            (_, kept) => self.reporter.stop_on_error(kept),
        }
    }
}

/// Note of the motions of a response that were solved for before; `None` without such motions. The
/// beginning of a search has a note of its own.
fn note(inputs: &RecordInputs<'_>, before: usize) -> Option<String> {
    let of = match inputs {
        RecordInputs::Response(response) => match response.points {
            Some(points) => format!("of {points} frequencies"),
            None => "points of the curve".to_owned(),
        },
        RecordInputs::RunUp { .. } => "speeds".to_owned(),
        RecordInputs::Peak { .. } | RecordInputs::Curve { .. } => return None,
    };
    (before > 0).then(|| format!("{before} {of} were solved before"))
}
