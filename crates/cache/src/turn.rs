//! Locks for entries under way. Simultaneous runs may need the same missing entry: one of them
//! makes it, and the others wait for it.

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::folder::lock_path;
use dovetail_export::lock::is_at;

/// Right of a run to make an entry; the system releases it when the run ends in any way.
#[derive(Debug)]
pub struct EntryClaim {
    path: PathBuf,
    _locked: File,
}

impl EntryClaim {
    /// Waits for the earlier runs; `waiting` is called if there is one. Returns `None` if files
    /// cannot be locked: two runs may then make the same entry, which only costs time.
    pub(crate) fn wait(entry: &Path, waiting: impl FnOnce()) -> Option<Self> {
        let path = lock_path(entry);
        let mut waiting = Some(waiting);
        loop {
            let file = File::options().create(true).append(true).open(&path).ok()?;
            if file.try_lock().is_err() {
                if let Some(waiting) = waiting.take() {
                    waiting();
                }
                file.lock().ok()?;
            }
            // Who had the turn removes the file: the next one is at the path.
            if is_at(&path, &file).ok()? {
                let _locked = file;
                return Some(Self { path, _locked });
            }
        }
    }
}

impl Drop for EntryClaim {
    fn drop(&mut self) {
        // Who waits for it sees that it is gone, and locks the next one.
        let _ = std::fs::remove_file(&self.path);
    }
}
