//! Folder for the files of one test, the files below it, and the files of a run without the parts
//! that differ from run to run.

use std::path::{Path, PathBuf};

use dovetail_export::lock::LOCK;

pub use dovetail_testkit::folder::Folder;

/// Files below a folder, in any order, without the locks of runs, which stay.
pub fn files_below(folder: &Path) -> Vec<PathBuf> {
    let (mut folders, mut files) = (vec![folder.to_path_buf()], Vec::new());
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let list = if path.is_dir() {
                &mut folders
            } else {
                &mut files
            };
            if !path.ends_with(LOCK) {
                list.push(path);
            }
        }
    }
    files
}

/// Bytes of a file of a run. The time at which the run began and the sections of these names are
/// removed from a report.
///
/// The effort of a run (`effort`) is never the same twice; its warnings (`warnings`) need not be.
pub fn drop_sections(bytes: Vec<u8>, names: &[&str]) -> Vec<u8> {
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
