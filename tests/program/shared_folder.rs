//! Folder for the files of one test, and the files of a run without the parts that differ from run
//! to run.

pub use dovetail_testkit::folder::Folder;

/// Bytes of a file of a run. The time at which the run began and the sections of these names are
/// removed from a report.
///
/// The effort of a run (`effort`) is never the same twice; its warnings (`warnings`) need not be.
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
