//! Runs side by side may miss the same entry. One of them makes it, and the others wait for it.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::folder::lock_of;

/// Held by the run that makes an entry; the system takes it back when a run ends in whatever way.
#[derive(Debug)]
pub(crate) struct Turn {
    path: PathBuf,
    _locked: File,
}

impl Turn {
    /// Waits for the runs before. `waiting` is called where there is one. `None` where files cannot be locked: then two runs
    /// may make the same entry, which costs time and nothing else.
    pub(super) fn wait(entry: &Path, waiting: impl FnOnce()) -> Option<Self> {
        let path = lock_of(entry);
        let file = File::options().create(true).append(true).open(&path).ok()?;
        if file.try_lock().is_err() {
            waiting();
            file.lock().ok()?;
        }
        Some(Self {
            path,
            _locked: file,
        })
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        // Who waits has the file open and gets its turn all the same.
        let _ = std::fs::remove_file(&self.path);
    }
}
