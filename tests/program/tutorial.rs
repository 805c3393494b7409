//! The tutorial is true: its commands are run in an empty folder one after the other, and what it
//! says they print and leave, and its listings of files, are compared with what they do.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Numbers of the page and of a run may differ by this: another version of gmsh makes another mesh.
const TOLERANCE: f64 = 0.02;

fn page() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/tutorial.md");
    fs::read_to_string(path).unwrap()
}

/// The fenced blocks of a page in order: the word after the fence and the text.
fn blocks(page: &str) -> Vec<(&str, &str)> {
    let parts: Vec<&str> = page.split("```").collect();
    assert!(parts.len() % 2 == 1, "a fence is not closed");
    let inner = parts.iter().skip(1).step_by(2);
    inner.map(|block| block.split_once('\n').unwrap()).collect()
}

fn same_word(found: &str, expected: &str) -> bool {
    let number = |word: &str| word.trim_end_matches([',', ';', ')']).parse::<f64>();
    match (number(found), number(expected)) {
        (Ok(found), Ok(expected)) => (found - expected).abs() <= TOLERANCE * expected.abs(),
        _ => found == expected,
    }
}

fn same_line(found: &str, expected: &str) -> bool {
    let words = |line: &str| {
        line.split_whitespace()
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    let (found, expected) = (words(found), words(expected));
    found.len() == expected.len() && found.iter().zip(&expected).all(|(f, e)| same_word(f, e))
}

/// Runs one line of the page with the program under test in the path; gives all that it printed.
fn run(line: &str, folder: &Path) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_dovetail")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let output = Command::new("sh")
        .args(["-c", &format!("{line} 2>&1")])
        .current_dir(folder)
        .env("PATH", path)
        .env_remove("DOVETAIL_CACHE")
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{line}\n{printed}");
    printed
}

fn empty_folder() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("tutorial_{}", std::process::id()));
    if folder.exists() {
        fs::remove_dir_all(&folder).unwrap();
    }
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// All files below `folder`, with their paths.
fn files_below(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files_below(&path, out);
        } else {
            out.push(path);
        }
    }
}

#[test]
fn what_the_tutorial_says_is_what_happens() {
    let page = page();
    let folder = empty_folder();
    let (mut printed, mut listings, mut commands, mut compared) = (String::new(), 0, 0, 0);
    for (kind, text) in blocks(&page) {
        match kind {
            "geo" | "toml" => {
                let entries = fs::read_dir(folder.join("blocks")).unwrap();
                let mut files = entries.map(|entry| entry.unwrap().path());
                let is_listed = |path: &PathBuf| fs::read_to_string(path).unwrap() == text;
                assert!(files.any(|path| is_listed(&path)), "no file is\n{text}");
                listings += 1;
            }
            "sh" => {
                printed = text.lines().map(|line| run(line, &folder)).collect();
                commands += text.lines().count();
            }
            "text" => {
                for line in text.lines() {
                    let found = printed.lines().any(|found| same_line(found, line));
                    assert!(
                        found,
                        "the page has\n{line}\nthe program printed\n{printed}"
                    );
                    compared += 1;
                }
                // A listing of files is complete.
                if text.lines().all(|line| !line.contains(' ')) {
                    assert_eq!(text.lines().count(), printed.lines().count(), "{printed}");
                }
            }
            other => panic!("a block of {other:?}"),
        }
    }
    assert!(
        listings == 2 && commands >= 4 && compared > 15,
        "{listings}, {commands}, {compared}"
    );

    // Arrays and files that the page names exist.
    let mut files = Vec::new();
    files_below(&folder.join("output/blocks"), &mut files);
    let fields: String = files
        .iter()
        .filter(|f| f.extension().is_some_and(|e| e == "vtu"))
        .map(|f| String::from_utf8_lossy(&fs::read(f).unwrap()).into_owned())
        .collect();
    let prose: String = page.split("```").step_by(2).collect();
    let quoted = prose.split('`').skip(1).step_by(2);
    let (mut arrays, mut named) = (0, 0);
    for word in quoted {
        let unit = ["_m", "_pa", "_w_m2"]
            .iter()
            .any(|unit| word.ends_with(unit));
        if (unit && !word.starts_with("top_") && !word.contains('.')) || word == "status" {
            arrays += 1;
            assert!(
                fields.contains(&format!("Name=\"{word}\"")),
                "no array {word}"
            );
        }
        let written = [".vtu", ".pvd", ".csv", ".svg"]
            .iter()
            .any(|end| word.ends_with(end));
        if written {
            named += 1;
            assert!(
                folder.join("output/blocks").join(word).exists(),
                "no file {word}"
            );
        }
    }
    assert!(arrays >= 5 && named >= 5, "{arrays} arrays, {named} files");

    // The figures in its sentences.
    let figure = |run: &str, place: &str| -> f64 {
        let file = folder.join("output").join(run).join("summary.json");
        let text = fs::read_to_string(file).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
        summary.pointer(place).unwrap().as_f64().unwrap()
    };
    let rough = figure("blocks", "/response/peak_amplitude_m") * 1e6;
    let slippery = figure("slippery", "/response/peak_amplitude_m") * 1e6;
    let ratio = figure("blocks", "/response/peak_ratio");
    let words: Vec<&str> = prose.split_whitespace().collect();
    let sentences = [
        format!("peak falls from {rough} to {slippery} um"),
        format!("With friction the peak is {ratio} of the linear one."),
    ];
    for sentence in sentences {
        let length = sentence.split_whitespace().count();
        let mut found = words.windows(length).map(|w| w.join(" "));
        assert!(found.any(|f| same_line(&sentence, &f)), "{sentence}");
    }
    fs::remove_dir_all(&folder).unwrap();
}
