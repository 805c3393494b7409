//! Keeps results of stages for later runs, each under a hash of all that it depends on. So an entry
//! cannot be stale, it can only be missing.
//!
//! Nothing here ends a run. Where an entry cannot be read or written, the run warns and computes
//! the stage.

mod entry;
mod folder;
mod store;
mod turn;

use crate::warning::Weight;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use serde::Serialize;
use serde::de::DeserializeOwned;

use self::folder::Folder;
pub(crate) use self::folder::Kind;
pub use self::store::RunStore;
pub(crate) use self::turn::Turn;
use crate::fingerprint::fingerprint;
use crate::reporter::Reporter;

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

/// The folder of entries and their limit in bytes; `None`: nothing is kept, nothing is found.
#[derive(Debug, Clone)]
pub struct Cache {
    place: Option<(Folder, u64)>,
}

/// What an entry holds, and the hash of what it depends on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Key {
    kind: Kind,
    hash: [u8; 32],
}

impl Cache {
    /// The cache of these settings.
    pub fn new(settings: Option<&CacheSettings>) -> Self {
        let settings = settings.filter(|s| s.limit_bytes > 0);
        Self {
            place: settings.map(|s| (Folder::under(&s.folder), s.limit_bytes)),
        }
    }

    /// Where entries are kept; `None` where nothing is.
    pub fn folder(&self) -> Option<&Path> {
        let (folder, _) = self.place.as_ref()?;
        folder.parent()
    }

    pub(crate) fn is_on(&self) -> bool {
        self.place.is_some()
    }

    /// The key of an entry of this kind that depends on `inputs` and on this program; `None` where nothing is kept.
    pub(crate) fn key(&self, kind: Kind, inputs: &impl Serialize) -> Option<Key> {
        self.place.as_ref()?;
        let mut hasher = blake3::Hasher::new();
        let whole = (FORMAT, kind.word(), fingerprint()?, inputs);
        postcard::to_io(&whole, &mut hasher).ok()?;
        Some(Key {
            kind,
            hash: *hasher.finalize().as_bytes(),
        })
    }

    /// What `accept` makes of the entry, where there is a sound one that it accepts. It counts as
    /// used now. One that is damaged or not accepted is removed.
    pub(crate) fn get<T: DeserializeOwned, U>(
        &self,
        key: Option<&Key>,
        accept: impl Fn(T) -> Result<U, String>,
        reporter: &Reporter<'_>,
    ) -> Option<U> {
        let (key, (folder, _)) = (key?, self.place.as_ref()?);
        let path = folder.entry(key.kind, key.hash);
        let accepted = match entry::read(&path, &key.hash) {
            Ok(found) => accept(found?),
            Err(damage) => Err(damage.to_string()),
        };
        match accepted {
            Ok(found) => {
                if let Ok(file) = File::options().append(true).open(&path) {
                    // Only the order in which entries leave depends on it.
                    let _ = file.set_modified(SystemTime::now());
                }
                Some(found)
            }
            Err(fault) => {
                reporter.warning(
                    Weight::Remark,
                    format!(
                        "the cache entry {} is of no use ({fault}): computing anew",
                        path.display()
                    ),
                );
                let _ = folder.remove(&path); // or it is replaced later
                None
            }
        }
    }

    /// The entry as by [`Cache::get`], also where another run has just made it; else the right to
    /// make it, until the [`Turn`] is dropped: others that want it wait.
    pub(crate) fn get_or_turn<T: DeserializeOwned, U>(
        &self,
        key: Option<&Key>,
        accept: impl Fn(T) -> Result<U, String>,
        reporter: &Reporter<'_>,
    ) -> Result<U, Option<Turn>> {
        if let Some(found) = self.get(key, &accept, reporter) {
            return Ok(found);
        }
        let (Some(key), Some((folder, _))) = (key, &self.place) else {
            return Err(None);
        };
        if folder.prepare().is_err() {
            return Err(None); // told when the entry is to be kept
        }
        let turn = Turn::wait(&folder.entry(key.kind, key.hash), || {
            reporter.note(&format!(
                "another run makes the same entry ({}): waiting for it",
                key.kind.word()
            ));
        });
        match self.get(Some(key), &accept, reporter) {
            Some(found) => Ok(found),
            None => Err(turn),
        }
    }

    /// Keeps an entry and lets those go that were used longest ago.
    pub(crate) fn put(&self, key: Option<&Key>, value: &impl Serialize, reporter: &Reporter<'_>) {
        let (Some((folder, limit_bytes)), Some(key)) = (&self.place, key) else {
            return;
        };
        let path = folder.entry(key.kind, key.hash);
        let size = entry::size(value);
        if size > *limit_bytes {
            reporter.note(&format!(
                "not kept for later runs: {} MiB are more than the limit of the cache, {} MiB",
                size >> 20,
                limit_bytes >> 20
            ));
            return;
        }
        let written = folder.prepare();
        if let Err(source) = written.and_then(|()| entry::write(&path, &key.hash, value)) {
            reporter.warning(Weight::Remark, format!(
                "nothing is kept for later runs: writing {} failed: {source} (another folder: --cache DIR; none: --no-cache)",
                path.display()
            ));
            return;
        }
        folder.make_room(*limit_bytes, &path, ABANDONED);
    }
}
