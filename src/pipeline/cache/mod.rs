//! Results of stages kept for later runs, each under a hash of all that it depends on: an entry cannot be stale,
//! it can only be missing.
//!
//! Nothing here ends a run. An entry that cannot be read, or written, is a warning, and the stage is computed.

mod entry;
mod program;
mod turn;

use std::fs::File;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use serde::Serialize;
use serde::de::DeserializeOwned;

pub(super) use self::turn::Turn;
use crate::model::Model;
use crate::progress::Progress;

/// Of the entries. The program is part of every key, so this matters to those who share a folder only.
const FORMAT: u32 = 1;
/// A part of an entry that nobody has written to for so long was left by a run that ended.
const ABANDONED: Duration = Duration::from_secs(3600);

/// Where entries are kept, and how many.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CacheSettings {
    pub folder: PathBuf,
    /// Entries used longest ago leave first when all together exceed this.
    pub limit_bytes: u64,
}

/// The folder of entries; `None`: nothing is kept, nothing is found.
#[derive(Debug, Clone)]
pub(super) struct Cache {
    settings: Option<CacheSettings>,
}

/// What an entry holds, and the hash of what it depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Key {
    kind: &'static str,
    hash: [u8; 32],
}

impl Cache {
    pub(super) fn new(settings: Option<&CacheSettings>) -> Self {
        Self {
            settings: settings.filter(|s| s.limit_bytes > 0).cloned(),
        }
    }

    pub(super) fn is_on(&self) -> bool {
        self.settings.is_some()
    }

    /// The key of an entry of this kind that depends on `inputs` and on this program; `None` where nothing is kept.
    pub(super) fn key(&self, kind: &'static str, inputs: &impl Serialize) -> Option<Key> {
        self.settings.as_ref()?;
        let mut hasher = blake3::Hasher::new();
        let whole = (FORMAT, kind, program::fingerprint()?, inputs);
        postcard::to_io(&whole, &mut hasher).ok()?;
        Some(Key {
            kind,
            hash: *hasher.finalize().as_bytes(),
        })
    }

    /// The entry, where there is a sound one. It counts as used now.
    pub(super) fn get<T: DeserializeOwned>(
        &self,
        key: Option<&Key>,
        progress: &Progress,
    ) -> Option<T> {
        let (key, path) = (key?, self.path(key?)?);
        let found = match entry::read(&path, &key.hash) {
            Ok(found) => found,
            Err(damage) => {
                progress.warning(&format!(
                    "the cache entry {} is of no use ({damage}): computing anew",
                    path.display()
                ));
                let _ = std::fs::remove_file(&path); // or it is replaced later
                None
            }
        }?;
        if let Ok(file) = File::options().append(true).open(&path) {
            // Only the order in which entries leave depends on it.
            let _ = file.set_modified(SystemTime::now());
        }
        Some(found)
    }

    /// The entry, where another run has just made it; else the right to make it, until the [`Turn`] is dropped: others
    /// that want it wait.
    pub(super) fn get_or_turn<T: DeserializeOwned>(
        &self,
        key: Option<&Key>,
        progress: &Progress,
    ) -> Result<T, Option<Turn>> {
        if let Some(found) = self.get(key, progress) {
            return Ok(found);
        }
        let (Some(key), Some(path)) = (key, key.and_then(|key| self.path(key))) else {
            return Err(None);
        };
        let turn = Turn::wait(&path, || {
            progress.note(&format!(
                "another run makes the same entry ({}): waiting for it",
                key.kind
            ));
        });
        match self.get(Some(key), progress) {
            Some(found) => Ok(found),
            None => Err(turn),
        }
    }

    /// Keeps an entry and lets those go that were used longest ago.
    pub(super) fn put(&self, key: Option<&Key>, value: &impl Serialize, progress: &Progress) {
        let (Some(settings), Some(key)) = (&self.settings, key) else {
            return;
        };
        let Some(path) = self.path(key) else {
            return;
        };
        let size = entry::size(value);
        if size > settings.limit_bytes {
            progress.note(&format!(
                "not kept for later runs: {} MiB are more than the limit of the cache, {} MiB",
                size >> 20,
                settings.limit_bytes >> 20
            ));
            return;
        }
        if let Err(source) = entry::write(&path, &key.hash, value) {
            progress.warning(&format!(
                "nothing is kept for later runs: writing {} failed: {source} (another folder: --cache DIR; none: --no-cache)",
                path.display()
            ));
            return;
        }
        entry::make_room(&settings.folder, settings.limit_bytes, &path, ABANDONED);
    }

    fn path(&self, key: &Key) -> Option<PathBuf> {
        let hash = blake3::Hash::from_bytes(key.hash).to_hex();
        let folder = &self.settings.as_ref()?.folder;
        Some(folder.join(format!("{}-{hash}", key.kind)))
    }
}

/// What a reduction depends on: the model without what only the contact laws and the size of the excitation use.
pub(super) fn reduction_inputs(
    model: &Model,
    stuck_modes: Option<usize>,
) -> impl Serialize + use<> {
    let mut model = model.clone();
    for pair in &mut model.pairs {
        (pair.friction, pair.gap_m) = (0.0, 0.0);
    }
    for force in &mut model.excitations {
        (force.force_n, force.harmonic, force.phase_rad) = (0.0, 0, 0.0);
    }
    (model, stuck_modes)
}
