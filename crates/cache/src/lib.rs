//! Keeps results of stages for later runs, each under a hash of all its inputs. Therefore an entry
//! cannot be stale, only missing.
//!
//! A key hashes the inputs, as they are serialised, together with the fingerprint of this
//! program. The inputs of a reduction are those of `run/kept.rs` of the library, the inputs of a
//! mesh its script and the parameters. A new field of an input is hashed without further work. If
//! the result does not depend on it, it costs a miss.
//!
//! `kept` has the kinds of entries, with their contents. `entry` is one file, `folder` the place of
//! all of them and the only one that removes entries. `turn` lets one of several runs make a missing
//! entry, and the others wait for it. [`inputs`] has the hashes under which the journal of an output
//! folder keeps motions, and the hash of a scene.
//!
//! Errors of the cache never end a run. If an entry cannot be read or written, the run warns and
//! computes the stage.
//!
//! Large matrices are read, written and hashed here, and not in generic functions that the program
//! would compile: it is not optimised.

#![forbid(unsafe_code)]
#![warn(missing_docs, clippy::missing_errors_doc)]

mod entry;
pub mod fingerprint;
mod folder;
pub mod inputs;
mod kept;
mod settings;
mod turn;

use std::fs::File;
use std::path::Path;
use std::time::{Duration, SystemTime};

use serde::Serialize;
use serde::de::DeserializeOwned;

use self::fingerprint::{fingerprint, hash_of};
use self::folder::{EntryKind, Folder};
pub use self::kept::KeptMesh;
pub use self::settings::{CacheSettings, EnvironmentError, gibibytes};
pub use self::turn::EntryClaim;
use dovetail_export::warning::{Warning, remark};

/// Version of the format of the entries. The program is part of every key, so this matters only to
/// programs that share a folder.
const FORMAT: u32 = 1;
/// Time without a write after which an incomplete entry counts as left behind by a run that ended.
const ABANDONED: Duration = Duration::from_secs(3600);

/// Log for what a user should know about the cache.
pub trait Log {
    /// Adds a note.
    fn note(&self, text: &str);
    /// Adds a warning.
    fn warning(&self, warning: &Warning);
}

/// Cache: the folder of entries and their limit in bytes; `None` if nothing is kept or found.
#[derive(Debug, Clone)]
pub struct Cache {
    place: Option<(Folder, u64)>,
}

/// Key of an entry: the kind of its content, and the hash of its inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EntryKey {
    kind: EntryKind,
    hash: [u8; 32],
}

impl Cache {
    /// Cache with these settings.
    pub fn new(settings: Option<&CacheSettings>) -> Self {
        let settings = settings.filter(|s| s.limit_bytes > 0);
        Self {
            place: settings.map(|s| (Folder::new(&s.folder), s.limit_bytes)),
        }
    }

    /// Folder named by the user; `None` if nothing is kept.
    pub fn folder(&self) -> Option<&Path> {
        let (folder, _) = self.place.as_ref()?;
        folder.parent()
    }

    /// Returns `true` if entries are kept.
    pub fn is_enabled(&self) -> bool {
        self.place.is_some()
    }

    /// Key of an entry of this kind that depends on `inputs` and on this program; `None` if nothing
    /// is kept.
    fn key(&self, kind: EntryKind, inputs: &impl Serialize) -> Option<EntryKey> {
        self.place.as_ref()?;
        let hash = hash_of(&(FORMAT, kind.word(), fingerprint()?, inputs))?;
        Some(EntryKey { kind, hash })
    }

    /// Reads an entry and passes it to `accept`. Returns the result if there is an intact entry
    /// that is accepted, and marks the entry as used. A damaged or rejected entry is removed.
    fn get<T: DeserializeOwned, U>(
        &self,
        key: Option<&EntryKey>,
        mut accept: impl FnMut(T) -> Result<U, String>,
        log: &dyn Log,
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
                log.warning(&remark(format!(
                    "the cache entry {} is of no use ({fault}): computing anew",
                    path.display()
                )));
                let _ = folder.remove(&path); // or it is replaced later
                None
            }
        }
    }

    /// Reads an entry like [`Cache::get`], also if another run has just made it. Otherwise returns
    /// the right to make it, until the [`EntryClaim`] is dropped: other runs that need it wait.
    fn get_or_turn<T: DeserializeOwned, U>(
        &self,
        key: Option<&EntryKey>,
        mut accept: impl FnMut(T) -> Result<U, String>,
        log: &dyn Log,
    ) -> Result<U, Option<EntryClaim>> {
        if let Some(found) = self.get(key, &mut accept, log) {
            return Ok(found);
        }
        let (Some(key), Some((folder, _))) = (key, &self.place) else {
            return Err(None);
        };
        if folder.prepare().is_err() {
            return Err(None); // told when the entry is to be kept
        }
        let turn = EntryClaim::wait(&folder.entry(key.kind, key.hash), || {
            log.note(&format!(
                "another run makes the same entry ({}): waiting for it",
                key.kind.word()
            ));
        });
        match self.get(Some(key), &mut accept, log) {
            Some(found) => Ok(found),
            None => Err(turn),
        }
    }

    /// Keeps an entry, and removes the least recently used ones above the limit.
    fn store_entry(&self, key: Option<&EntryKey>, value: &impl Serialize, log: &dyn Log) {
        let (Some((folder, limit_bytes)), Some(key)) = (&self.place, key) else {
            return;
        };
        let path = folder.entry(key.kind, key.hash);
        let size = entry::size(value);
        if size > *limit_bytes {
            log.note(&format!(
                "not kept for later runs: {} MiB are more than the limit of the cache, {} MiB",
                size >> 20,
                limit_bytes >> 20
            ));
            return;
        }
        let written = folder.prepare();
        if let Err(source) = written.and_then(|()| entry::write(&path, &key.hash, value)) {
            log.warning(&remark(format!(
                "nothing is kept for later runs: writing {} failed: {source} (another folder: --cache DIR; none: --no-cache)",
                path.display()
            )));
            return;
        }
        folder.make_room(*limit_bytes, &path, ABANDONED);
    }
}
