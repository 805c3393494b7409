//! Files of a run that the code that ends it early can reach, too.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::RunFiles;
use super::ending::error_with_causes;
use crate::error::RunError;
use dovetail_export::folder::mark_failed;

/// Longest time to wait for the files when the process ends for lack of memory.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// Files of a run that are also accessible to the code that ends the run early.
#[derive(Debug)]
pub struct SharedFiles {
    /// Folder of the run.
    folder: PathBuf,
    files: Mutex<RunFiles>,
    /// True if the run is being ended: any thread that is not yet writing waits for the end of the
    /// process.
    ending: AtomicBool,
}

impl SharedFiles {
    /// Shares the files of one run.
    pub fn new(files: RunFiles) -> Arc<Self> {
        Arc::new(Self {
            folder: files.folder().to_path_buf(),
            files: Mutex::new(files),
            ending: AtomicBool::new(false),
        })
    }

    /// Locks the files for the run. Does not return once the run is being ended.
    pub fn locked(&self) -> MutexGuard<'_, RunFiles> {
        while self.ending.load(Ordering::Acquire) {
            std::thread::park_timeout(Duration::from_secs(1));
        }
        self.lock()
    }

    /// Locks the files for ending the run: nothing is written after what is written with this lock.
    pub fn locked_to_end(&self) -> MutexGuard<'_, RunFiles> {
        self.ending.store(true, Ordering::Release);
        self.lock()
    }

    /// Records in the folder that the run failed, and prevents all further writing. The thread that
    /// has the files may itself wait for the end of the process: then the last summary.json is
    /// marked.
    pub fn failed_to_end(&self, error: &RunError) {
        self.ending.store(true, Ordering::Release);
        let begun = Instant::now();
        while begun.elapsed() < LONGEST_WAIT {
            if let Ok(files) = self.files.try_lock() {
                return files.failed(error);
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        mark_failed(&self.folder, error_with_causes(error));
    }

    /// Locks the files. A panic of another thread leaves them intact.
    fn lock(&self) -> MutexGuard<'_, RunFiles> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
