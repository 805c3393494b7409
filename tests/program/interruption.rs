//! Interrupted runs: the files that they leave, and that a resumed run gives the same bytes as an
//! uninterrupted one.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use dovetail_export::manifest::RunState;
use serde_json::Value;

use crate::shared_folder::{Folder, drop_sections, files_below};
use crate::shared_program::{SMALL, ended, has, said_in_one_line, scene_command, told};
use crate::shared_runs::{manifest, numbers};

/// A frequency takes about 10 kB of the journal, and 5 kB in the second response. Stretches of 20
/// frequencies in either half of the range are taken over by a resumed run.
const POINTS: usize = 100;

/// Command `dovetail run` for the paper's scene on its smallest mesh: mean positions that are
/// retained, frequencies that fail and are tried again, and a second response.
fn command(out: &Path, words: &[&str]) -> Command {
    let points = format!("response.points={POINTS}");
    let mut program = scene_command("run", "scenes/paper.toml", out, &[SMALL, &points]);
    program.args(words);
    program
}

/// Run under way, once its journal has this many bytes.
fn start_run(out: &Path, words: &[&str], bytes: u64) -> Child {
    started(command(out, words), &out.join("response.journal"), bytes)
}

fn started(mut command: Command, journal: &Path, bytes: u64) -> Child {
    let child = command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    let mut child = child.spawn().unwrap();
    let begin = Instant::now();
    let size = || std::fs::metadata(journal).map_or(0, |m| m.len());
    while size() < bytes {
        assert_eq!(child.try_wait().unwrap(), None, "it ended before");
        assert!(begin.elapsed() < Duration::from_secs(300));
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

fn send(signal: &str, child: &Child) {
    let mut kill = Command::new("kill");
    kill.args([signal, &child.id().to_string()]);
    ended(kill, 0);
}

/// A command by another program: a copy whose file has one byte more, in `folder`. Another process
/// writes it, since a file that is open for writing is not started.
fn other_program_command(command: &Command, folder: &Path) -> Command {
    let other = folder.join("dovetail");
    let mut copy = Command::new("sh");
    copy.args(["-c", "cp \"$0\" \"$1\" && printf x >> \"$1\""]);
    ended(copy.arg(command.get_program()).arg(&other), 0);
    let mut program = Command::new(other);
    let folder = command.get_current_dir().unwrap();
    program.current_dir(folder).args(command.get_args());
    program
}

/// Number before these words in a text.
#[track_caller]
fn number_before(text: &str, words: &str) -> usize {
    let before = text.split(words).next().unwrap();
    let number = before.split_whitespace().last().unwrap_or_default();
    let number = number.parse();
    number.unwrap_or_else(|_| panic!("no number before `{words}`: {text}"))
}

/// Contents of the files below the folder, by name; those of summary.json without times.
fn contents(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for path in files_below(out) {
        let name = path.strip_prefix(out).unwrap().display().to_string();
        let mut bytes = drop_sections(std::fs::read(&path).unwrap(), &["effort"]);
        if name == "summary.json" {
            let mut summary: Value = serde_json::from_slice(&bytes).unwrap();
            drop_times(&mut summary);
            bytes = serde_json::to_vec_pretty(&summary).unwrap();
        }
        found.insert(name, bytes);
    }
    found
}

fn drop_times(value: &mut Value) {
    match value {
        Value::Object(entries) => {
            for time in ["begun", "seconds", "processor_seconds", "peak_memory_mib"] {
                entries.remove(time);
            }
            entries.values_mut().for_each(drop_times);
        }
        Value::Array(entries) => entries.iter_mut().for_each(drop_times),
        _ => {}
    }
}

#[track_caller]
fn assert_same(found: &BTreeMap<String, Vec<u8>>, expected: &BTreeMap<String, Vec<u8>>) {
    let names = |of: &BTreeMap<String, Vec<u8>>| of.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(expected));
    for (name, bytes) in expected {
        assert!(found[name] == *bytes, "{name} differs");
    }
}

/// Number of rows of a table of the response, whose frequencies must rise.
fn rows(table: &Path) -> usize {
    let frequencies = numbers(table, "frequency_hz");
    assert!(frequencies.is_sorted_by(|a, b| a < b));
    frequencies.len()
}

#[test]
fn a_run_that_was_broken_off_goes_on_to_the_bytes_of_an_unbroken_one() {
    let whole = Folder::new("unbroken");
    ended(command(&whole, &[]), 0);
    let whole = contents(&whole);
    assert!(!whole.contains_key("response.journal"));
    let out = Folder::new("killed");
    let mut killed = start_run(&out, &[], 450_000);
    send("-KILL", &killed);
    killed.wait().unwrap();
    assert_eq!(manifest(&out).state, RunState::Running);
    // Killed once more, further on: in the response that the first is compared with.
    let mut interrupted = start_run(&out, &["--resume"], 1_250_000);
    send("-INT", &interrupted);
    assert_eq!(interrupted.wait().unwrap().code(), Some(130));
    let broken = manifest(&out);
    assert_eq!(broken.state, RunState::Interrupted);
    assert!(broken.why.unwrap().contains("response_h1.csv"));
    assert_eq!(rows(&out.join("response.csv")), POINTS);
    let second = rows(&out.join("response_h1.csv"));
    assert!((1..POINTS).contains(&second), "{second}");
    let resumed = told(command(&out, &["--resume"]), 0);
    let all = format!("{POINTS} of {POINTS} frequencies were solved before");
    has(&resumed, &all);
    assert_same(&contents(&out), &whole);
}

/// The prestress of the static state is computed again before a run is resumed, and is the same to
/// the bit. That of held flanks is another input.
#[test]
fn a_run_with_the_prestress_of_its_static_state_goes_on_to_the_same_bytes() {
    let column = |out: &Path, words: &[&str]| {
        let set = [
            "response.points=56",
            "response.samples=32",
            "response.harmonics=3",
        ];
        let mut program = scene_command("run", "scenes/verification/column.toml", out, &set);
        program.args(words);
        program
    };
    let whole = Folder::new("column-unbroken");
    ended(column(&whole, &[]), 0);
    let out = Folder::new("column-broken");
    // More than 40 of the 56: a stretch of one half at least is complete.
    let journal = out.join("response.journal");
    let mut broken = started(column(&out, &[]), &journal, 190_000);
    send("-INT", &broken);
    assert_eq!(broken.wait().unwrap().code(), Some(130));
    assert_eq!(manifest(&out).state, RunState::Interrupted);
    let held = ["--resume", "--set", "rotation.prestress=held_flanks"];
    let refused = told(column(&out, &held), 2);
    has(&refused, "computed from other inputs");
    let resumed = told(column(&out, &["--resume"]), 0);
    let words = "of 56 frequencies were solved before & prestress, pass 2";
    has(&resumed, words);
    assert_same(&contents(&out), &contents(&whole));
}

/// A peak of one harmonic takes some 30 kB of the journal.
#[test]
fn a_search_for_peaks_goes_on_to_the_table_of_an_unbroken_one() {
    let peaks = |out: &Path, words: &[&str]| {
        let set = [
            "response.points=",
            "response.harmonics=1",
            "response.times_first_linear_mode=[0.96, 1.01]",
        ];
        let mut program = scene_command("peaks", "benches/peers/scene.toml", out, &set);
        program.args(["--over", "reduced_model.force_n=0.3:1:12"]);
        program.args(words);
        program
    };
    let whole = Folder::new("peaks-unbroken");
    ended(peaks(&whole, &[]), 0);
    let out = Folder::new("peaks-broken");
    let journal = out.join("peaks.journal");
    let broken = started(peaks(&out, &[]), &journal, 100_000);
    send("-INT", &broken);
    let output = broken.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    has(&said_in_one_line(&output), "Ctrl-C after & with --resume");
    assert_eq!(manifest(&out).state, RunState::Interrupted);
    assert!(journal.exists());
    // The table has the peaks so far, as the whole one has them.
    let (found, all) = (out.text("peaks.csv"), whole.text("peaks.csv"));
    assert!(found.lines().count() > 1, "{found}");
    assert!(found.lines().all(|line| all.lines().any(|of| of == line)));
    let resumed = told(peaks(&out, &["--resume"]), 0);
    has(&resumed, "peaks were found before");
    assert_eq!(out.text("peaks.csv"), whole.text("peaks.csv"));
    assert!(!journal.exists());
}

/// A motion of one harmonic takes some 30 kB of the journal.
#[test]
fn a_curve_over_a_key_goes_on_to_the_table_of_an_unbroken_one() {
    let curve = |out: &Path, words: &[&str]| {
        let set = ["response.harmonics=1"];
        let mut program = scene_command("curve", "benches/peers/scene.toml", out, &set);
        program.args(["--over", "reduced_model.force_n=0.1:3:60"]);
        program.args(["--frequency", "450.2"]);
        program.args(words);
        program
    };
    let whole = Folder::new("curve-unbroken");
    ended(curve(&whole, &[]), 0);
    let out = Folder::new("curve-broken");
    let journal = out.join("curve.journal");
    // Early: a table that is interrupted near the end has motions that the finished one leaves out.
    let broken = started(curve(&out, &[]), &journal, 700_000);
    send("-INT", &broken);
    let output = broken.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let words = "Ctrl-C after & a table of those found, curve.csv. & with --resume";
    has(&said_in_one_line(&output), words);
    let summary = manifest(&out);
    assert_eq!(summary.state, RunState::Interrupted);
    assert!(summary.files.iter().any(|file| file == "curve.csv"));
    let solved = number_before(&summary.why.unwrap(), " motions");
    // The table has the motions so far, as the whole one has them.
    let motions = |of: &Folder| {
        let column = |name: &str| numbers(&of.join("curve.csv"), name);
        let values = column("reduced_model.force_n").into_iter();
        values.zip(column("amplitude_m")).collect::<Vec<_>>()
    };
    let (found, all) = (motions(&out), motions(&whole));
    assert_eq!(found.len(), solved);
    assert!(
        (20..all.len()).contains(&solved),
        "{solved} of {}",
        all.len()
    );
    assert!(found.iter().all(|motion| all.contains(motion)));
    assert!(journal.exists());
    let resumed = told(curve(&out, &["--resume"]), 0);
    assert_eq!(
        number_before(&resumed, " motions were solved before"),
        solved
    );
    assert_eq!(out.text("curve.csv"), whole.text("curve.csv"));
    assert!(!journal.exists());
}

/// A vibration of one harmonic takes some 5 kB of the journal.
#[test]
fn wear_goes_on_to_the_bytes_of_an_unbroken_one() {
    let wear = |out: &Path, words: &[&str]| {
        let set = [
            SMALL,
            "response.compare_harmonics=",
            "response.harmonics=1",
            "contact.*.wear_m2_n=1e-14",
        ];
        let mut program = scene_command("wear", "scenes/paper.toml", out, &set);
        program.args(["--cycles", "1e6", "--tolerance", "0.02"]);
        program.args(words);
        program
    };
    let whole = Folder::new("wear-unbroken");
    ended(wear(&whole, &[]), 0);
    let out = Folder::new("wear-broken");
    let journal = out.join("wear.journal");
    let broken = started(wear(&out, &[]), &journal, 20_000);
    send("-INT", &broken);
    let output = broken.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    has(&said_in_one_line(&output), "Ctrl-C after & with --resume");
    assert_eq!(manifest(&out).state, RunState::Interrupted);
    let before = numbers(&out.join("wear.csv"), "cycles").len();
    assert!(journal.exists() && !out.join("wear_pairs.csv").exists());
    let resumed = told(wear(&out, &["--resume"]), 0);
    has(&resumed, "vibrations were found before");
    assert!(before < numbers(&out.join("wear.csv"), "cycles").len());
    for file in [
        "wear.csv",
        "wear_pairs.csv",
        "wear.pvd",
        "wear/wear_0003.vtu",
    ] {
        assert_eq!(out.text(file), whole.text(file), "{file}");
    }
    assert!(!journal.exists());
}

/// The speeds that were solved are not reduced again.
#[test]
fn a_run_up_goes_on_to_the_bytes_of_an_unbroken_one() {
    let up = |out: &Path, words: &[&str]| {
        let set = [
            SMALL,
            "response.along_engine_order=6",
            "response.speed_rpm=[4300, 4500]",
            "response.compare_harmonics=",
            "response.points=10",
        ];
        let mut program = scene_command("run", "scenes/paper.toml", out, &set);
        program.args(words);
        program
    };
    let whole = Folder::new("run_up-unbroken");
    ended(up(&whole, &[]), 0);
    let out = Folder::new("run_up-broken");
    let journal = out.join("response.journal");
    let broken = started(up(&out, &[]), &journal, 40_000);
    send("-INT", &broken);
    let output = broken.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    has(&said_in_one_line(&output), "Ctrl-C after & with --resume");
    let solved = numbers(&out.join("response.csv"), "speed_rpm").len();
    assert!((1..10).contains(&solved), "{solved}");
    let other = ["--resume", "--set", "response.along_engine_order=5"];
    has(&told(up(&out, &other), 2), "computed from other inputs");
    let resumed = told(up(&out, &["--resume"]), 0);
    has(&resumed, &format!("{solved} speeds were solved before"));
    assert_eq!(out.text("response.csv"), whole.text("response.csv"));
    assert_eq!(out.text("peak.vtu"), whole.text("peak.vtu"));
    let stages = manifest(&out).stages;
    let reduction = stages
        .iter()
        .find(|s| s.name.starts_with("reduction along"));
    let times = format!("reduction along the run-up, {} times", 11 - solved);
    assert_eq!(reduction.unwrap().name, times);
}

#[test]
fn ctrl_c_leaves_what_is_solved_and_says_how_to_go_on() {
    let out = Folder::new("interrupted");
    let child = start_run(&out, &[], 300_000);
    send("-INT", &child);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let words = format!("--resume & of {POINTS}");
    has(&said_in_one_line(&output), &words);
    let summary = manifest(&out);
    assert_eq!(summary.state, RunState::Interrupted);
    assert!(summary.why.unwrap().starts_with("Ctrl-C after "));
    let solved = rows(&out.join("response.csv"));
    assert!((1..POINTS).contains(&solved), "{solved}");
    assert_eq!(summary.response.unwrap().points, solved);
    assert!(summary.static_state.is_some() && summary.mesh.is_some());
    let collection = std::fs::read_to_string(out.join("flank.pvd")).unwrap();
    let files = collection.matches("<DataSet ").count();
    assert_eq!(std::fs::read_dir(out.join("flank")).unwrap().count(), files);
    for file in ["contact.csv", "static.csv", "flank_static.vtu"] {
        assert!(summary.files.iter().any(|f| f == file), "{file}");
        assert!(out.join(file).exists(), "{file}");
    }
    // With other inputs there is nothing to go on with, and every file stays as it is.
    let before = contents(&out);
    let other = ["--resume", "--set", "contact.left.friction=0.2"];
    let refused = told(command(&out, &other), 2);
    has(&refused, "computed from other inputs");
    assert_same(&contents(&out), &before);
    let program = Folder::new("other-program");
    let refused = told(
        other_program_command(&command(&out, &["--resume"]), &program),
        2,
    );
    has(&refused, "computed from other inputs");
    assert_same(&contents(&out), &before);
    // The journal says by itself that its frequencies are those of another program.
    let copied = Folder::new("other-journal");
    let journal = out.join("response.journal");
    std::fs::copy(&journal, copied.join("response.journal")).unwrap();
    let resumed = command(&copied, &["--resume"]);
    let refused = told(other_program_command(&resumed, &program), 2);
    has(&refused, "computed from other inputs");
    let kept = std::fs::metadata(&journal).unwrap().len();
    assert!(kept >= 300_000);
    let child = start_run(&out, &["--resume"], kept + 100_000);
    send("-TERM", &child);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(said_in_one_line(&output).contains("SIGTERM"));
    assert!(rows(&out.join("response.csv")) > solved);
}

/// The number of points of a curve that is followed is not known before its end.
#[test]
fn ctrl_c_counts_the_points_of_a_curve_that_is_followed() {
    let out = Folder::new("interrupted-curve");
    let follow = |words: &[&str]| {
        let set = [SMALL, "response.harmonics=1"];
        let mut run = scene_command("run", "scenes/paper.toml", &out, &set);
        run.args(words);
        run
    };
    let journal = out.join("response.journal");
    let mut before = 0;
    for (words, bytes) in [(&[][..], 100_000), (&["--resume"], 200_000)] {
        let child = started(follow(words), &journal, bytes);
        send("-INT", &child);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130));
        let why = manifest(&out).why.unwrap();
        assert!(why.starts_with("Ctrl-C after "), "{why}");
        let points = number_before(&why, " points of the curve of response.csv");
        assert_eq!(
            points,
            numbers(&out.join("response.csv"), "frequency_hz").len()
        );
        assert!(points > before, "{points} after {before}");
        let told = said_in_one_line(&output);
        has(&told, &format!("{why} & --resume"));
        if before > 0 {
            let words = " points of the curve were solved before";
            assert_eq!(number_before(&told, words), before);
        }
        before = points;
    }
}

/// Nothing of a backbone is kept before its end.
#[test]
fn of_an_interrupted_backbone_nothing_is_said_to_be_kept() {
    let out = Folder::new("interrupted-backbone");
    let set = [SMALL, "response.harmonics=3"];
    let mut backbone = scene_command("backbone", "scenes/paper.toml", &out, &set);
    backbone.args(["--amplitude", "1e-7:1e-4"]);
    let child = started(backbone, &out.join("summary.json"), 1);
    send("-INT", &child);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let summary = manifest(&out);
    assert_eq!(summary.state, RunState::Interrupted);
    assert_eq!(summary.why.unwrap(), "Ctrl-C before the end");
    let told = said_in_one_line(&output);
    has(&told, "ended by Ctrl-C before the end");
    assert!(
        !told.contains("--resume") && !told.contains("frequency"),
        "{told}"
    );
}

#[test]
fn a_folder_in_which_a_run_is_going_on_is_not_taken() {
    let out = Folder::new("busy");
    // Each refusal waits a second for the lock: the run has to take longer than all of them.
    let mut child = start_run(&out, &["--set", "response.points=2000"], 100_000);
    let others =
        ["mesh", "modes", "reduce"].map(|word| scene_command(word, "scenes/paper.toml", &out, &[]));
    for other in [command(&out, &[])].into_iter().chain(others) {
        has(&told(other, 1), "a run is going on in the folder");
    }
    assert_eq!(manifest(&out).state, RunState::Running);
    assert!(!out.join("model.json").exists() && !out.join("modes.vtu").exists());
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Its summary.json was written before most of the files of its flanks.
#[test]
fn of_a_run_that_was_killed_the_next_one_leaves_nothing() {
    let out = Folder::new("killed-and-replaced");
    let mut killed = start_run(&out, &[], 800_000);
    send("-KILL", &killed);
    killed.wait().unwrap();
    let files_of_flanks = std::fs::read_dir(out.join("flank")).unwrap().count();
    assert!(files_of_flanks > 10, "{files_of_flanks}");
    let mine = out.join("flank/notes.txt");
    std::fs::write(&mine, "mine").unwrap();
    let few = [
        "--set",
        "response.points=3",
        "--set",
        "response.compare_harmonics=",
    ];
    ended(command(&out, &few), 0);
    let mut expected: Vec<String> = manifest(&out).files;
    expected.extend(["summary.json", "flank/notes.txt"].map(str::to_owned));
    expected.sort();
    let found: Vec<String> = contents(&out).into_keys().collect();
    assert_eq!(found, expected);
    assert_eq!(std::fs::read_dir(out.join("flank")).unwrap().count(), 3 + 1);
}

#[test]
fn a_run_that_is_broken_off_before_its_first_frequency_leaves_no_journal() {
    let out = Folder::new("early");
    let child = start_run(&out, &[], 1);
    send("-INT", &child);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert_eq!(manifest(&out).state, RunState::Interrupted);
    assert!(!out.join("response.journal").exists());
    // There is nothing to go on with: it begins with the first frequency.
    let mut again = start_run(&out, &["--resume"], 100_000);
    again.kill().unwrap();
    again.wait().unwrap();
}
