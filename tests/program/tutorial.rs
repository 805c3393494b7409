//! The tutorials are correct: their commands are run one after the other, and the output, the
//! results and the listings of files on a page are compared with the actual ones.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::shared_folder::{Folder, files_below};
use crate::shared_program::ended;
use crate::shared_runs::summary;
use dovetail_testkit::folder::root;

/// Relative difference allowed between numbers of a page and of a run: another version of gmsh
/// makes another mesh.
const TOLERANCE: f64 = 0.02;

/// Reads a figure of summary.json, from the folder of the run in `output` and the path of the
/// figure.
type Figure<'a> = &'a dyn Fn(&str, &str) -> f64;

/// Page and the expectations about it.
struct Tutorial {
    page: &'static str,
    /// Folders of the repository that its commands need in their folder.
    beside: &'static [&'static str],
    /// Run in `output` whose files and arrays the page names.
    run: &'static str,
    /// Least numbers of listings, commands, lines of output, arrays and files.
    least: [usize; 5],
    /// Sentences with figures, as computed from its runs.
    sentences: fn(Figure<'_>) -> Vec<String>,
}

/// Fenced blocks of a page in order: the words after the fence, and the text.
fn blocks(page: &str) -> Vec<(&str, &str)> {
    let parts: Vec<&str> = page.split("```").collect();
    assert!(parts.len() % 2 == 1, "a fence is not closed");
    let inner = parts.iter().skip(1).step_by(2);
    inner.map(|block| block.split_once('\n').unwrap()).collect()
}

/// First words of lines whose numbers go with the points that a curve happens to have: where they
/// lie, and how many harmonics they need, hangs on the last digits of the processor.
const OF_POINTS: [&str; 2] = ["estimated", "frequencies"];

fn same_word(found: &str, expected: &str, tolerance: f64) -> bool {
    let number = |word: &str| word.trim_end_matches([',', ';', ')']).parse::<f64>();
    match (number(found), number(expected)) {
        (Ok(found), Ok(expected)) => (found - expected).abs() <= tolerance * expected.abs(),
        _ => found == expected,
    }
}

/// Returns `true` if a line of a page is one that the program printed, up to what hangs on the
/// mesh, the processor and the points of a curve.
pub fn same_line(found: &str, expected: &str) -> bool {
    let [found, expected] = [found, expected].map(|line| line.split_whitespace());
    let [found, expected]: [Vec<&str>; 2] = [found.collect(), expected.collect()];
    let of_points = expected.first().is_some_and(|w| OF_POINTS.contains(w));
    let tolerance = if of_points { f64::INFINITY } else { TOLERANCE };
    let mut words = found.iter().zip(&expected);
    found.len() == expected.len() && words.all(|(f, e)| same_word(f, e, tolerance))
}

/// Runs one line of the page with the tested program in the path; returns all that it printed.
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

/// Texts of the files below `folder` whose names have this ending.
fn texts(folder: &Path, ending: &str) -> Vec<String> {
    let files = files_below(folder);
    let own = files
        .iter()
        .filter(|f| f.extension().is_some_and(|e| e == ending));
    own.map(|f| String::from_utf8_lossy(&fs::read(f).unwrap()).into_owned())
        .collect()
}

impl Tutorial {
    fn follow(&self, folder: &Path) {
        for beside in self.beside {
            std::os::unix::fs::symlink(root().join(beside), folder.join(beside)).unwrap();
        }
        let page = fs::read_to_string(root().join("docs").join(self.page)).unwrap();
        let counts = self.blocks(&page, folder);
        let prose: String = page.split("```").step_by(2).collect();
        let named = self.names(&prose, folder);
        let found: Vec<usize> = counts.into_iter().chain(named).collect();
        let enough = found.iter().zip(self.least).all(|(f, least)| *f >= least);
        assert!(enough, "{}: {found:?}", self.page);
        self.figures(&prose, folder);
    }

    /// Runs the commands and compares their output, and the listings; returns their numbers.
    fn blocks(&self, page: &str, folder: &Path) -> [usize; 3] {
        let (mut printed, mut counts) = (String::new(), [0; 3]);
        for (kind, text) in blocks(page) {
            match kind.split(' ').collect::<Vec<_>>()[..] {
                ["sh"] => {
                    printed = text.lines().map(|line| run(line, folder)).collect();
                    counts[1] += text.lines().count();
                }
                ["text"] => {
                    for line in text.lines() {
                        let found = printed.lines().any(|found| same_line(found, line));
                        assert!(
                            found,
                            "the page has\n{line}\nthe program printed\n{printed}"
                        );
                        counts[2] += 1;
                    }
                    // A listing of files is complete.
                    if text.lines().all(|line| !line.contains(' ')) {
                        assert_eq!(text.lines().count(), printed.lines().count(), "{printed}");
                    }
                }
                ["geo" | "toml" | "inp", ref rest @ ..] if matches!(rest, [] | ["excerpt"]) => {
                    let ending = kind.split(' ').next().unwrap();
                    let is_listed = |file: &String| match rest {
                        [] => file == text,
                        _ => file.contains(text),
                    };
                    let is_there = texts(folder, ending).iter().any(is_listed);
                    assert!(is_there, "no file has\n{text}");
                    counts[0] += 1;
                }
                _ => panic!("a block of {kind:?}"),
            }
        }
        counts
    }

    /// Checks that arrays and files named by the page exist; returns their numbers.
    fn names(&self, prose: &str, folder: &Path) -> [usize; 2] {
        let results = folder.join("output").join(self.run);
        let fields = texts(&results, "vtu").concat();
        let columns = fs::read_to_string(results.join("response.csv")).unwrap();
        let columns: Vec<&str> = columns.lines().next().unwrap().split(',').collect();
        let keys = fs::read_to_string(root().join("docs/scene.md")).unwrap();
        let (mut arrays, mut files) = (0, 0);
        for word in prose.split('`').skip(1).step_by(2) {
            let unit = ["_m", "_pa", "_j_m2"]
                .iter()
                .any(|unit| word.ends_with(unit));
            let is_other = || {
                word.contains('.') || columns.contains(&word) || keys.contains(&format!("`{word}`"))
            };
            if (unit && !is_other()) || word == "status" {
                arrays += 1;
                let name = format!("Name=\"{word}\"");
                assert!(fields.contains(&name), "no array {word}");
            }
            let is_written = [".vtu", ".pvd", ".csv", ".svg"]
                .iter()
                .any(|end| word.ends_with(end));
            if is_written {
                files += 1;
                assert!(results.join(word).exists(), "no file {word}");
            }
        }
        [arrays, files]
    }

    /// Checks the figures in its sentences.
    fn figures(&self, prose: &str, folder: &Path) {
        let figure = |run: &str, place: &str| -> f64 {
            let summary = summary(&folder.join("output").join(run));
            summary.pointer(place).unwrap().as_f64().unwrap()
        };
        let words: Vec<&str> = prose.split_whitespace().collect();
        let sentences = (self.sentences)(&figure);
        assert!(!sentences.is_empty());
        for sentence in sentences {
            let length = sentence.split_whitespace().count();
            let mut found = words.windows(length).map(|w| w.join(" "));
            assert!(found.any(|f| same_line(&sentence, &f)), "{sentence}");
        }
    }
}

#[test]
fn what_the_tutorial_says_is_what_happens() {
    let blocks = Tutorial {
        page: "tutorial.md",
        beside: &[],
        run: "blocks",
        least: [2, 4, 16, 5, 5],
        sentences: |figure| {
            let rough = figure("blocks", "/response/peak_amplitude_m") * 1e6;
            let slippery = figure("slippery", "/response/peak_amplitude_m") * 1e6;
            let ratio = figure("blocks", "/response/peak_ratio");
            vec![
                format!("peak falls from {rough} to {slippery} µm"),
                format!(
                    "At this peak {} of the 49 pairs stick all the period, {} slip and stay closed, and {} open at times.",
                    figure("blocks", "/response/peak_stuck_pairs"),
                    figure("blocks", "/response/peak_slipping_pairs"),
                    figure("blocks", "/response/peak_opening_pairs")
                ),
                format!("With friction the peak is {ratio} of the linear one."),
            ]
        },
    };
    blocks.follow(&Folder::new("tutorial_blocks"));
}

#[test]
fn what_the_tutorial_of_decks_says_is_what_happens() {
    let joint = Tutorial {
        page: "tutorial_deck.md",
        beside: &["meshes", "scenes"],
        run: "joint",
        least: [4, 9, 60, 3, 5],
        sentences: |figure| {
            let place = "/response/peak_amplitude_m";
            let [one, two] = ["joint", "two_decks"].map(|run| figure(run, place));
            let error = (two / one - 1.0).abs();
            println!("one deck or two: peaks differ by {error:.1e}");
            // As closely as the peak of a curve is followed.
            assert!(error < 5e-4, "{one} m with one deck, {two} m with two");
            let watts = |place: &str| figure("joint", place);
            vec![
                format!("The largest amplitude of the tip is {} mm.", one * 1e3),
                format!(
                    "At the peak friction takes {} W and the damping of the material {} W.",
                    watts("/response/peak_friction_power_w"),
                    watts("/response/peak_damping_power_w")
                ),
                format!(
                    "The blade weighs {} g",
                    figure("joint", "/mesh/bodies/0/mass_kg") * 1e3
                ),
            ]
        },
    };
    joint.follow(&Folder::new("tutorial_joint"));
}

/// The decks are those that their script writes.
#[test]
fn the_decks_are_those_of_their_script() {
    let script = root().join("meshes/decks/two_parts.py");
    let mut python = Command::new("python3");
    ended(python.arg(script).arg("--check"), 0);
}
