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

/// The bytes of a file of a run, of a report without the time that it began at and the sections of
/// these names.
///
/// What a run took (`effort`) is never the same twice; what it was told on the way (`warnings`)
/// need not be.
pub fn without_sections(bytes: Vec<u8>, names: &[&str]) -> Vec<u8> {
    if !bytes.starts_with(b"<!DOCTYPE html>") {
        return bytes;
    }
    let mut text = String::from_utf8(bytes).unwrap();
    let sections = names
        .iter()
        .map(|name| (format!("<section id=\"{name}\">"), "</section>"));
    for (begin, end) in sections.chain([("<time>".to_owned(), "</time>")]) {
        if let Some(start) = text.find(&begin) {
            let length = text[start..].find(end).unwrap() + end.len();
            text.replace_range(start..start + length, "");
        }
    }
    text.into_bytes()
}
