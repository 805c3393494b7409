//! The folder of the repository, and one for the files of one test, gone at its end.

use std::ffi::OsStr;
use std::ops::Deref;
use std::path::Path;

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
