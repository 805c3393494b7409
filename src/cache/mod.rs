//! Keeps results of stages for later runs, each under a hash of all its inputs. Therefore an entry
//! cannot be stale, only missing.
//!
//! `Cache::key` hashes the inputs, as they are serialised, together with the fingerprint of this
//! program. The inputs of a reduction are those of `run/kept.rs` of the library, the inputs of a
//! mesh those of [`crate::gmsh::inputs`] and the parameters. A new field of an input is hashed
//! without further work. Where the result does not depend on it, it costs a miss.
//!
//! `entry` is one file, `folder` the place of all of them and the only one that removes entries.
//! `turn` lets one of several runs make a missing entry, and the others wait for it. `store` is the
//! [`Store`](dovetail_solver::run::Store) that a run asks. It also gives the frequencies in the
//! journal of the output folder. Their hash (`hash_of`) lists the inputs of a response one by one:
//! a new input must be added there, because it is not hashed otherwise.
//!
//! Errors of the cache never end a run. If an entry cannot be read or written, the run warns and
//! computes the stage.

mod entry;
mod folder;
mod store;
mod turn;

use dovetail_export::warning::Weight;
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

/// Version of the format of the entries. The program is part of every key, so this matters only to
/// programs that share a folder.
const FORMAT: u32 = 1;
/// Time without a write after which an incomplete entry counts as left behind by a run that ended.
const ABANDONED: Duration = Duration::from_secs(3600);

/// Folder of the entries, and their size limit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CacheSettings {
    pub folder: PathBuf,
    /// Largest total size of the entries, bytes; above it the least recently used entries are
    /// removed.
    pub limit_bytes: u64,
}

/// Environment variable with the folder of the cache.
const FOLDER: &str = "DOVETAIL_CACHE";
/// Environment variable with the size limit of the cache, GiB.
const LIMIT: &str = "DOVETAIL_CACHE_LIMIT_GIB";
const DEFAULT_LIMIT_GIB: f64 = 4.0;

/// Environment variable whose value is invalid.
#[derive(Debug, thiserror::Error)]
#[error("the environment variable {variable}: {problem}")]
pub struct EnvironmentError {
    variable: &'static str,
    problem: String,
}

impl CacheSettings {
    /// Settings of a folder and a limit in GiB. Where one is not given it is that of the
    /// environment, or else the default: `output/.cache`, and 4 GiB.
    ///
    /// # Errors
    /// A limit of the environment that is no size.
    pub fn chosen(
        folder: Option<PathBuf>,
        limit_gib: Option<f64>,
    ) -> Result<Self, EnvironmentError> {
        let given = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
        let limit_gib = match (limit_gib, given(LIMIT)) {
            (Some(limit), _) => limit,
            (None, Some(text)) => {
                let variable = LIMIT;
                gibibytes(&text.to_string_lossy())
                    .map_err(|problem| EnvironmentError { variable, problem })?
            }
            (None, None) => DEFAULT_LIMIT_GIB,
        };
        let folder = folder.or(given(FOLDER).map(PathBuf::from));
        Ok(Self {
            folder: folder.unwrap_or_else(|| Path::new("output").join(".cache")),
            limit_bytes: (limit_gib * (1u64 << 30) as f64) as u64,
        })
    }
}

/// Size in GiB.
///
/// # Errors
/// A text that is no number of GiB from 0 to 1e6.
pub fn gibibytes(text: &str) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(gib) if (0.0..=1e6).contains(&gib) => Ok(gib),
        _ => Err(format!("`{text}` is not a number of GiB from 0 to 1e6")),
    }
}

/// Cache: the folder of entries and their limit in bytes; `None` if nothing is kept or found.
#[derive(Debug, Clone)]
pub struct Cache {
    place: Option<(Folder, u64)>,
}

/// Key of an entry: the kind of its content, and the hash of its inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Key {
    kind: Kind,
    hash: [u8; 32],
}

impl Cache {
    /// Cache with these settings.
    pub fn new(settings: Option<&CacheSettings>) -> Self {
        let settings = settings.filter(|s| s.limit_bytes > 0);
        Self {
            place: settings.map(|s| (Folder::under(&s.folder), s.limit_bytes)),
        }
    }

    /// Folder named by the user; `None` if nothing is kept.
    pub fn folder(&self) -> Option<&Path> {
        let (folder, _) = self.place.as_ref()?;
        folder.parent()
    }

    pub(crate) fn is_on(&self) -> bool {
        self.place.is_some()
    }

    /// Key of an entry of this kind that depends on `inputs` and on this program; `None` if nothing
    /// is kept.
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

    /// Reads an entry and passes it to `accept`. Returns the result if there is an intact entry
    /// that is accepted, and marks the entry as used. A damaged or rejected entry is removed.
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

    /// Reads an entry like [`Cache::get`], also if another run has just made it. Otherwise returns
    /// the right to make it, until the [`Turn`] is dropped: other runs that need it wait.
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

    /// Keeps an entry, and removes the least recently used ones above the limit.
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
