//! A folder for the files of one test, gone at its end.

use std::ffi::OsStr;
use std::ops::Deref;
use std::path::Path;

use tempfile::TempDir;

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

/// The bytes of a file of a run; of a report without the section that says what the run took.
pub fn without_effort(bytes: Vec<u8>) -> Vec<u8> {
    const SECTION: &str = "<section id=\"effort\">";
    let text = String::from_utf8_lossy(&bytes);
    let Some((before, after)) = text.split_once(SECTION) else {
        return bytes;
    };
    let (_, after) = after.split_once("</section>").unwrap();
    format!("{before}{after}").into_bytes()
}
