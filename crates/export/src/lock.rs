//! Lock of a folder: one process at a time writes into it.
//!
//! The locked file stays when its process ends. If it were removed, a process that waits for the
//! removed file and one that makes a new file would both hold a lock. A file that somebody else
//! removes has another number: the locked file must be the file that the path names.

use std::fs::{File, TryLockError};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::time::{Duration, Instant};

use super::{ExportError, create_folder};
use dovetail_superelement::input;

/// Name of the locked file in the folder of a run.
pub const LOCK: &str = ".lock";

/// Longest time to wait for a lock. A child process shares the open files of its parent until it
/// executes another program: a folder that was left at this moment stays locked a little longer.
const LONGEST_WAIT: Duration = Duration::from_secs(1);

/// Right to write into a folder, until it is dropped or the process ends.
#[derive(Debug)]
pub struct FolderLock {
    /// `None` on a file system without locks.
    #[cfg_attr(not(test), expect(dead_code, reason = "it is held"))]
    locked: Option<File>,
}

impl FolderLock {
    /// Takes the right to write into a folder, which is created if it is missing. On a file system
    /// without locks everybody has it.
    ///
    /// # Errors
    /// [`ExportError::Busy`] if another process has it; a folder or a lock that cannot be created, or
    /// a lock that is not a regular file.
    pub fn acquire(folder: &Path) -> Result<Self, ExportError> {
        Self::acquire_named(folder, LOCK)
    }

    /// Like [`FolderLock::acquire`], by a lock of this name.
    ///
    /// # Errors
    /// Those of [`FolderLock::acquire`].
    pub fn acquire_named(folder: &Path, name: &str) -> Result<Self, ExportError> {
        create_folder(folder)?;
        let (taken, folder) = (Self::try_lock(&folder.join(name)), folder.to_path_buf());
        match taken {
            Ok(Some(lock)) => Ok(lock),
            Ok(None) => Err(ExportError::Busy { folder }),
            Err(source) => Err(ExportError::Lock { folder, source }),
        }
    }

    fn try_lock(path: &Path) -> io::Result<Option<Self>> {
        let begun = Instant::now();
        loop {
            match attempt(path, opened(path)?)? {
                LockAttempt::Taken(lock) => return Ok(Some(lock)),
                LockAttempt::Replaced => {}
                LockAttempt::Held if begun.elapsed() > LONGEST_WAIT => return Ok(None),
                LockAttempt::Held => std::thread::sleep(Duration::from_millis(10)),
            }
        }
    }
}

/// File that is locked, which is created if it is missing.
fn opened(path: &Path) -> io::Result<File> {
    // Opening a named pipe would wait for its other end.
    if path.exists() {
        input::check(path)?;
    }
    let mut options = File::options();
    let options = options.read(true).write(true).create(true).truncate(false);
    options.open(path)
}

/// End of an attempt to lock an open file.
#[derive(Debug)]
enum LockAttempt {
    Taken(FolderLock),
    /// Somebody else has it.
    Held,
    /// The path names another file by now, or none.
    Replaced,
}

/// Locks a file that was opened at this path.
fn attempt(path: &Path, file: File) -> io::Result<LockAttempt> {
    Ok(match file.try_lock() {
        Ok(()) if is_at(path, &file)? => LockAttempt::Taken(FolderLock { locked: Some(file) }),
        Ok(()) => LockAttempt::Replaced,
        Err(TryLockError::Error(_)) => LockAttempt::Taken(FolderLock { locked: None }),
        Err(TryLockError::WouldBlock) => LockAttempt::Held,
    })
}

/// Returns `true` if `path` names this open file.
///
/// # Errors
/// Errors of the file system, but for a path that names nothing.
pub fn is_at(path: &Path, file: &File) -> io::Result<bool> {
    let locked = file.metadata()?;
    match std::fs::metadata(path) {
        Ok(there) => Ok((locked.dev(), locked.ino()) == (there.dev(), there.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_have_it_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let first = FolderLock::acquire(path).unwrap();
        let error = FolderLock::acquire(path).unwrap_err();
        assert!(matches!(error, ExportError::Busy { .. }), "{error}");
        // Another name is another right.
        FolderLock::acquire_named(path, ".other").unwrap();
        drop(first);
        FolderLock::acquire(path).unwrap();
        assert!(folder.path().join(LOCK).exists());
    }

    #[test]
    fn one_that_is_held_for_a_moment_is_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let first = FolderLock::acquire(folder.path()).unwrap();
        let holder = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(100));
            drop(first);
        });
        FolderLock::acquire(folder.path()).unwrap();
        holder.join().unwrap();
    }

    #[test]
    fn a_lock_that_was_removed_is_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        // Locked, and removed: the next one locks the file that the path then names.
        let removed = FolderLock::acquire(path).unwrap();
        std::fs::remove_file(path.join(LOCK)).unwrap();
        let next = FolderLock::acquire(path).unwrap();
        drop(removed);
        assert!(FolderLock::acquire(path).is_err());
        drop(next);
        // Who waits for a file that is removed gets the new one, or none.
        let waited = FolderLock::acquire(path).unwrap();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let own = FolderLock::acquire(path).unwrap().locked.unwrap();
                assert!(is_at(&path.join(LOCK), &own).unwrap());
            });
            std::thread::sleep(Duration::from_millis(50));
            std::fs::remove_file(path.join(LOCK)).unwrap();
            drop(waited);
        });
    }

    /// Between opening and locking, somebody removes the file, and somebody else locks the next one.
    #[test]
    fn a_file_that_is_replaced_before_it_is_locked_is_no_lock() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(LOCK);
        let early = || opened(&path).unwrap();
        let [first, second, third] = [early(), early(), early()];
        let locked = attempt(&path, first).unwrap();
        assert!(matches!(locked, LockAttempt::Taken(_)), "{locked:?}");
        drop(locked);
        std::fs::remove_file(&path).unwrap();
        let removed = attempt(&path, second).unwrap();
        assert!(matches!(removed, LockAttempt::Replaced), "{removed:?}");
        let _next = FolderLock::acquire(folder.path()).unwrap();
        let replaced = attempt(&path, third).unwrap();
        assert!(matches!(replaced, LockAttempt::Replaced), "{replaced:?}");
    }

    #[test]
    fn a_pipe_in_its_place_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(LOCK);
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        let error = FolderLock::acquire(folder.path()).unwrap_err();
        assert!(error.to_string().contains("a named pipe"), "{error}");
    }
}
