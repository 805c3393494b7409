//! The folder of the repository, and one for the files of one test, gone at its end.

use std::ffi::OsStr;
use std::ops::Deref;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// The root of the repository, whichever package the test belongs to.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("this package stands two folders below the root")
}

/// A folder of temporary files.
pub struct Folder(TempDir);

impl Folder {
    /// A new one, whatever the tests beside do; the name helps to find it while the test runs.
    pub fn new(name: &str) -> Self {
        let prefix = format!("dovetail-{name}-");
        Self(TempDir::with_prefix(prefix).unwrap())
    }

    /// Text of a file in it.
    #[track_caller]
    pub fn text(&self, file: &str) -> String {
        let path = self.join(file);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }

    /// Writes a file in it, and returns its path.
    #[track_caller]
    pub fn write(&self, file: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.join(file);
        std::fs::write(&path, content).unwrap();
        path
    }
}

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        self.0.path()
    }
}

impl AsRef<OsStr> for Folder {
    fn as_ref(&self) -> &OsStr {
        self.0.path().as_os_str()
    }
}
