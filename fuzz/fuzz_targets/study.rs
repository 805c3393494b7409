//! The text of a study: read, checked and turned into its cases, each of which is then read as a
//! scene; or its faults reported. The scene is the paper's, whatever the text names: no file is
//! opened.

#![no_main]

mod limits;

use std::collections::HashSet;
use std::path::Path;

use dovetail::study::{Study, cases};
use dovetail::{scene, terminal};

const SCENE: &str = include_str!("../../scenes/paper.toml");
/// Cases that are read as scenes.
const MOST_SCENES: usize = 8;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let study = match Study::parse(text, Path::new("study.toml"), &[]) {
        Ok(study) => study,
        Err(error) => {
            let report = terminal::rendered(&error, bytes.len().is_multiple_of(2));
            assert!(
                !report.contains("Failed to read contents"),
                "a span outside of its text"
            );
            return;
        }
    };
    let cases = cases(&study);
    let mut folders = HashSet::new();
    for case in &cases {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '+' | '_' | '-');
        let slug = &case.slug;
        assert!(slug.starts_with(|c: char| c.is_ascii_alphabetic()) && slug.chars().all(is_plain));
        assert!(
            folders.insert(slug.to_ascii_lowercase()),
            "two cases are called {slug}"
        );
    }
    for case in cases.iter().take(MOST_SCENES) {
        let set = case.set(&study);
        if let Err(error) = scene::parse(SCENE, "scene.toml", Path::new(""), &set) {
            terminal::rendered(&error, false);
        }
    }
}
