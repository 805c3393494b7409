//! The text of a scene, with the overrides of lines `#set KEY=VALUE`: read and checked, or its
//! faults reported. No file is opened, neither the mesh nor the script that it names.

#![no_main]

mod limits;

use std::path::Path;

use dovetail::{scene, terminal};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    let overrides = text.lines().filter_map(|line| line.strip_prefix("#set "));
    let overrides: Vec<String> = overrides.map(str::to_owned).collect();
    match scene::parse(text, "scene.toml", Path::new(""), &overrides) {
        Ok(scene) => {
            let said = format!("{scene:?}");
            let is_number = |word: &str| !["NaN", "inf", "-inf"].contains(&word);
            let without_texts = said
                .replace("\\\\", "")
                .replace("\\\"", "")
                .split('"')
                .step_by(2)
                .collect::<String>();
            let mut words = without_texts.split(|c: char| !c.is_alphanumeric() && c != '-');
            assert!(words.all(is_number), "a number is not finite: {said}");
        }
        Err(error) => {
            let report = terminal::rendered(&error, bytes.len().is_multiple_of(2));
            assert!(
                !report.contains("Failed to read contents"),
                "a span outside of its text"
            );
        }
    }
}
