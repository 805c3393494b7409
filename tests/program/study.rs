//! `dovetail study`: cases in folders of their own, resumed after a kill, collected, exported;
//! studies that it refuses.

use crate::shared_browser::{drawn, is_self_contained, opened};
use crate::shared_folder;
use crate::shared_program::{self, cases, ended, has, program, said_in_one_line};
use crate::shared_runs::{Row, json, number, numbers, rows};
use dovetail_testkit::folder::root;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

/// Folder for one test with a scene and a study, removed at its end.
struct Folder(shared_folder::Folder);

/// Texts that a study printed.
struct Said {
    stdout: String,
    /// Standard error on one line.
    stderr: String,
}

const SCENE: &str = r#"
name = "dovetail72"
[reduced_model]
folder = "ROOT/tests/data/dovetail72"
friction = 0.3
force_n = 1.0
[damping]
ratio = 0.001
[response]
times_first_linear_mode = [0.99, 1.01]
points = 3
harmonics = 1
stuck_modes = 40
"#;

const HARMONICS: &str = r#"
name = "small"
scene = "scene.toml"
set = ["response.samples=32"]

[[parameter]]
key = "response.harmonics"
values = [1, 2, 3]
base = 2
size = "1/(value+1)"

[[parameter]]
name = "grid"
values = [
    { label = "3 points", set = { "response.points" = 3, "response.times_first_linear_mode" = [0.99, 1.01] } },
    { label = "5 points", set = { "response.points" = 5, "response.times_first_linear_mode" = [0.99, 1.01] } },
]
base = "3 points"
"#;

impl Folder {
    fn new(name: &str, study: &str) -> Self {
        let path = shared_folder::Folder::new(name);
        let root = root().to_str().unwrap();
        path.write("scene.toml", SCENE.replace("ROOT", root));
        path.write("study.toml", study.replace("ROOT", root));
        Self(path)
    }
    fn command(&self, arguments: &[&str]) -> Command {
        let mut program = program(root(), &["study"]);
        program.arg(self.0.join("study.toml"));
        program.arg("--out").arg(self.0.join("out")).args(arguments);
        program
    }
    /// Runs the study, which has to end with `code`.
    fn study(&self, code: i32, arguments: &[&str]) -> Said {
        let output = ended(self.command(arguments), code);
        Said {
            stdout: shared_program::printed(&output),
            stderr: said_in_one_line(&output),
        }
    }
    /// Begins the study in the background.
    fn begin(&self, arguments: &[&str]) -> Child {
        let mut program = self.command(arguments);
        program.stderr(Stdio::null()).spawn().unwrap()
    }
    /// Kills a study. The case under way ends with it: nobody works on it any more.
    fn kill(&self, mut study: Child) {
        study.kill().unwrap();
        study.wait().unwrap();
        wait_until("its cases have ended", || {
            running_commands(&self.0).is_empty()
        });
    }
    fn text(&self, file: &str) -> String {
        self.0.text(file)
    }
    fn replace(&self, file: &str, from: &str, to: &str) {
        let text = self.text(file);
        has(&text, from);
        self.0.write(file, text.replacen(from, to, 1));
    }
    fn table(&self) -> Vec<Row> {
        rows(&self.0.join("out/table.csv"))
    }
    fn outcomes(&self) -> Vec<String> {
        self.table().iter().map(|r| r["outcome"].clone()).collect()
    }
    fn case(&self, slug: &str, file: &str) -> PathBuf {
        self.0.join("out/cases").join(slug).join(file)
    }
    /// Times at which these cases ended.
    fn ends(&self, slugs: &[&str]) -> Vec<SystemTime> {
        let end = |slug: &&str| std::fs::metadata(self.case(slug, "outcome.json"))?.modified();
        slugs.iter().map(|slug| end(slug).unwrap()).collect()
    }
    fn json(&self, file: &str) -> serde_json::Value {
        json(&self.0.join(file))
    }
    fn plots(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.join("out/plots")).unwrap();
        let names = entries.map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }
}

fn has_lines(text: &str, lines: &[&str]) {
    for line in lines {
        assert!(text.lines().any(|l| l == *line), "{line}: {text}");
    }
}

/// Waits for at most two minutes.
fn wait_until(what: &str, condition: impl Fn() -> bool) {
    let begin = Instant::now();
    while !condition() {
        assert!(begin.elapsed() < Duration::from_secs(120), "{what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_study_runs_its_cases_and_answers() {
    let folder = Folder::new("runs", HARMONICS);
    let said = folder.study(0, &["--jobs", "2"]);
    let rows = folder.table();
    let slugs: Vec<&str> = rows.iter().map(|r| r["case"].as_str()).collect();
    let own = ["base", "harmonics_1", "harmonics_3", "grid_5-points"];
    assert_eq!(slugs, own);
    for row in &rows {
        assert_eq!(row["outcome"], "converged", "{row:?}");
        assert!(number(row, "seconds") > 0.0);
    }
    assert_eq!(rows[1]["harmonics"], "1");
    let points = [0, 3].map(|row| number(&rows[row], "points"));
    assert_eq!(points, [3.0, 5.0]);
    // The numbers are those of the run itself.
    let summary = folder.json("out/cases/harmonics_3/summary.json");
    let peak = summary["response"]["peak_amplitude_m"].as_f64().unwrap();
    assert_eq!(number(&rows[2], "peak_amplitude_m"), peak);
    // A case is the run that its case.json says.
    let record = folder.json("out/cases/harmonics_3/case.json");
    let words: Vec<String> = serde_json::from_value(record["command"].clone()).unwrap();
    let by_hand = folder.0.join("by_hand");
    let at = words.iter().position(|w| w == "--out").unwrap();
    let mut again = program(root(), &[]);
    again.args(&words[1..at]).args(&words[at + 2..]);
    ended(again.arg("--quiet").arg("--out").arg(&by_hand), 0);
    let table = |path: PathBuf| std::fs::read_to_string(path).unwrap();
    assert_eq!(
        table(by_hand.join("response.csv")),
        table(folder.case("harmonics_3", "response.csv"))
    );
    let report = folder.text("out/report.html");
    let words = "<h3>harmonics</h3> & <h3>grid</h3> & <td>– estimated error</td> \
                 & <a href=\"cases/harmonics_3/report.html\"> & <th>peak amplitude of tip ( \
                 & In brackets stands the difference from the finest case. \
                 & <figcaption>Errors by harmonics.</figcaption>";
    has(&report, words);
    // The page draws the responses of all cases and shows every picture.
    let page = folder.0.join("out/report.html");
    is_self_contained(&page);
    for width in [1400, 400] {
        let (dom, complaints) = opened(&page, width);
        assert_eq!(complaints, [""; 0]);
        let expected = [vec!["responses"], vec!["picture"; folder.plots().len()]].concat();
        assert_eq!(drawn(&dom), expected);
        has(&dom, ">4 of 4</div>");
    }
    assert_eq!(said.stdout, "");
    let svg = folder.text("out/plots/harmonics.svg");
    let words = [
        "1/(harmonics+1)",
        "peak amplitude of tip",
        "estimated error (%)",
    ];
    has_lines(&svg, &words);
    let answers = folder.json("out/summary.json");
    let day = answers["day"].as_str().unwrap();
    assert_eq!(day.len(), 10);
    has(&report, &format!("<time>{day}</time>"));
    // Differences are those from the finest value of the parameter that is varied.
    let peak = |row: usize| number(&rows[row], "peak_amplitude_m");
    let difference = |row: usize| number(&rows[row], "difference_peak_amplitude_m");
    let from = |row: usize, finest: usize| (peak(row) - peak(finest)).abs() / peak(finest);
    assert_eq!([difference(2), difference(3)], [0.0; 2]);
    assert!((difference(1) - from(1, 2)).abs() < 1e-12 && difference(1) > 0.0);
    let of_base = from(0, 2).max(from(0, 3));
    assert!((difference(0) - of_base).abs() < 1e-12 && of_base > 0.0);
    let refinement = &answers["refinements"][0];
    assert_eq!(refinement["parameter"], "harmonics");
    let cases = ["harmonics_1", "base", "harmonics_3"];
    assert_eq!(refinement["cases"], serde_json::json!(cases));
    let figures = refinement["figures"].as_array().unwrap();
    let of_peak = figures.iter().find(|f| f["figure"] == "peak_amplitude_m");
    let expected = serde_json::json!([difference(1), from(0, 2), 0.0]);
    assert_eq!(of_peak.unwrap()["differences"], expected);
    // Again: nothing is left to do.
    let before = folder.ends(&slugs);
    let said = folder.study(0, &[]);
    has(&said.stderr, "4 of 4 cases are complete already");
    assert_eq!(before, folder.ends(&slugs));
    // A scene that was edited makes them all stale.
    folder.replace("scene.toml", "friction = 0.3", "friction = 0.2");
    let said = folder.study(3, &["--collect"]);
    has(&said.stderr, "of 4 cases 4 have no result");
}

const FRICTION_AND_FORCE: &str = r#"
name = "physical"
scene = "scene.toml"
mode = "grid"
quantities = ["stuck_frequency_hz", "peak_amplitude_m", "peak_ratio"]

[[parameter]]
key = "reduced_model.friction"
values = [0.3, 0.05]

[[parameter]]
key = "reduced_model.force_n"
values = [1.0, 2.0, 4.0]
"#;

/// Physical parameters have no error: such a study reports values and pictures of them.
#[test]
fn a_study_of_physical_parameters_answers_without_errors() {
    let folder = Folder::new("physical", FRICTION_AND_FORCE);
    folder.study(0, &["--jobs", "2"]);
    let rows = folder.table();
    assert_eq!(rows.len(), 6);
    let table = folder.text("out/table.csv");
    let headings =
        "case,friction,force_n,stuck_frequency_hz,peak_amplitude_m,peak_ratio,processor_";
    assert!(table.starts_with(headings), "{table}");
    let answers = folder.json("out/summary.json");
    let report = folder.text("out/report.html");
    let picture = "<figcaption>Ratio of the peak to the linear peak over force (N), by friction.\
                   </figcaption><img src=\"data:image/svg+xml;base64,";
    has(&report, picture);
    // Nothing is told as an error.
    let (words, _scripts) = report.split_once("<script").unwrap();
    for text in [words, &table, &answers.to_string()] {
        let text = text.to_lowercase();
        let is_told = text.contains("error") || text.contains("difference");
        assert!(!is_told, "{text}");
    }
    // Low values come first, whatever the order in the file.
    let expected = serde_json::json!([
        { "name": "friction", "is": "physical", "keys": ["reduced_model.friction"], "values": ["0.05", "0.3"] },
        { "name": "force_n", "is": "physical", "keys": ["reduced_model.force_n"], "values": ["1.0", "2.0", "4.0"] },
    ]);
    assert_eq!(answers["parameters"], expected);
    let expected = ["peak_amplitude_m", "peak_ratio"].map(|figure| {
        [
            format!("{figure}_over_force_n_by_friction.svg"),
            format!("{figure}_over_friction_and_force_n.svg"),
            format!("{figure}_over_friction_by_force_n.svg"),
        ]
    });
    assert_eq!(folder.plots(), expected.concat());
    // A line of the curves for each value of the other parameter, and a cell for each case.
    let curves = folder.text("out/plots/peak_amplitude_m_over_friction_by_force_n.svg");
    let lines = curves.lines().filter(|l| l.contains("<polyline"));
    let lines = lines.filter(|l| l.contains("stroke-width=\"3\""));
    assert_eq!(lines.count(), 3);
    has_lines(
        &curves,
        &["force 4.0 N", "peak amplitude of tip (mm)", "0.05"],
    );
    let map = folder.text("out/plots/peak_amplitude_m_over_friction_and_force_n.svg");
    for row in &rows {
        let shown = format!("{:.2}", 1e3 * number(row, "peak_amplitude_m"));
        has_lines(&map, &[&shown]);
    }
    // Where the largest amplitude is no peak is said.
    let at_end = |row: &Row| {
        let slug = &row["case"];
        let summary = folder.json(&format!("out/cases/{slug}/summary.json"));
        let told = report.contains(&format!("case {slug}: the peak is at an end of its"));
        assert_eq!(summary["response"]["peak_at_end_of_range"], told, "{slug}");
        told
    };
    let at_end: Vec<bool> = rows.iter().map(at_end).collect();
    assert!(
        at_end.contains(&true) && at_end.contains(&false),
        "{at_end:?}"
    );
}

/// The errors of numerical parameters are those at one design: a different friction is not an
/// error.
#[test]
fn errors_of_a_mixed_study_are_taken_at_each_design() {
    let study = r#"
name = "mixed"
scene = "scene.toml"
mode = "grid"
quantities = ["peak_amplitude_m"]
[[parameter]]
key = "reduced_model.friction"
values = [0.05, 0.3]
[[parameter]]
key = "response.harmonics"
values = [1, 3]
"#;
    let folder = Folder::new("mixed", study);
    folder.study(0, &["--jobs", "2"]);
    let rows = folder.table();
    let answers = folder.json("out/summary.json");
    let report = folder.text("out/report.html");
    let (mut errors, mut of_fine) = (Vec::new(), Vec::new());
    // The last parameter varies fastest.
    for (at, friction) in ["0.05", "0.3"].into_iter().enumerate() {
        let own = &rows[2 * at..2 * at + 2];
        let [coarse, fine] = [0, 1].map(|i| number(&own[i], "peak_amplitude_m"));
        let expected = [(coarse - fine).abs() / fine, 0.0];
        for (row, expected) in own.iter().zip(expected) {
            assert_eq!(row["friction"], friction);
            let found = number(row, "difference_peak_amplitude_m");
            assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
        }
        errors.push(expected[0]);
        of_fine.push(fine);
        let at = &answers["refinements"][at]["at"];
        assert_eq!(*at, serde_json::json!({ "friction": friction }));
        has(
            &report,
            &format!("<h3>harmonics at friction {friction}</h3>"),
        );
        // A parameter without sizes is drawn over its values.
        let svg = folder.text(&format!("out/plots/harmonics__friction_{friction}.svg"));
        has_lines(&svg, &["harmonics", "1", "3", "estimated error (%)"]);
    }
    assert!(!report.contains("<h3>friction"), "{report}");
    // The friction changes the figure by far more.
    let by_friction = (of_fine[0] - of_fine[1]).abs() / of_fine[1];
    let is_small = errors.iter().all(|e| *e < 0.5 * by_friction);
    assert!(is_small, "{errors:?} {by_friction}");
    folder.text("out/plots/peak_amplitude_m_over_friction.svg");
}

/// The committed study of friction and force, with two values of each, on four frequencies.
#[test]
fn the_study_of_friction_and_force_answers() {
    let mut study = std::fs::read_to_string(root().join("studies/friction_force.toml")).unwrap();
    let scene = root().join("benches/peers/scene.toml");
    for (committed, own) in [
        ("../benches/peers/scene.toml", scene.to_str().unwrap()),
        ("[0.02, 0.05, 0.1, 0.2, 0.4, 0.8]", "[0.05, 0.4]"),
        ("[0.5, 1.0, 2.0, 4.0]", "[0.5, 4.0]"),
    ] {
        assert!(study.contains(committed), "{committed}: {study}");
        study = study.replace(committed, own);
    }
    let folder = Folder::new("friction-force", &study);
    let few = [
        "--set",
        "response.points=4",
        "--set",
        "response.harmonics=1",
    ];
    folder.study(0, &few);
    assert_eq!(folder.table().len(), 4);
    for quantity in ["peak_ratio", "peak_amplitude_m"] {
        folder.text(&format!(
            "out/plots/{quantity}_over_friction_and_force_n.svg"
        ));
    }
}

#[test]
fn a_killed_study_is_taken_up_where_it_was() {
    let folder = Folder::new("killed", HARMONICS);
    let child = folder.begin(&["--jobs", "1", "--quiet"]);
    let all = ["base", "harmonics_1", "harmonics_3", "grid_5-points"];
    let complete = || {
        let ended = all
            .iter()
            .filter(|s| folder.case(s, "outcome.json").exists());
        ended.count()
    };
    wait_until("two cases have ended and a third one has begun", || {
        complete() >= 2 && folder.case(all[complete()], "case.json").exists()
    });
    folder.kill(child);
    let done = complete();
    assert!((2..all.len()).contains(&done));
    let before = folder.ends(&all[..done]);
    let said = folder.study(0, &[]);
    has(
        &said.stderr,
        &format!("{done} of 4 cases are complete already"),
    );
    let left = all.len() - done;
    let rerun = said.stderr.matches(&format!("/{left}] ")).count();
    assert_eq!(rerun, left, "{}", said.stderr);
    assert_eq!(before, folder.ends(&all[..done]));
    assert_eq!(folder.outcomes(), ["converged"; 4]);
}

/// A case stays complete only if it was run by this program and has its figures.
#[test]
fn a_case_of_another_program_or_without_figures_is_run_again() {
    let study = HARMONICS.replace("values = [1, 2, 3]", "values = [1, 2]");
    let folder = Folder::new("current", &study);
    folder.study(0, &["--quiet"]);
    folder.study(0, &["--collect"]);
    let mut record = folder.json("out/cases/base/case.json");
    let hash = record["program_hash"].as_str().unwrap_or_default();
    assert_eq!(hash.len(), 64, "{record}");
    // A program of the same version that is another, one that did not say which it is, none.
    record["program_hash"] = "0".repeat(64).into();
    let other = record.to_string();
    record.as_object_mut().unwrap().remove("program_hash");
    let nameless = record.to_string();
    for (case, file, spoilt) in [
        (
            "harmonics_1",
            "summary.json",
            &["{", "{}", "null", r#"{ "response": null }"#][..],
        ),
        ("base", "case.json", &["{", &nameless, &other][..]),
    ] {
        for text in spoilt {
            std::fs::write(folder.case(case, file), text).unwrap();
            let said = folder.study(3, &["--collect"]);
            has(&said.stderr, "of 3 cases 1 have no result");
        }
        // Whether a case is run again is asked in the same way: once is enough.
        let said = folder.study(0, &[]);
        has(&said.stderr, "2 of 3 cases are complete already");
        folder.study(0, &["--collect"]);
    }
}

#[test]
fn a_case_that_was_broken_off_goes_on_with_its_frequencies() {
    let study = r#"
name = "long"
scene = "scene.toml"
set = ["response.points=400", "response.samples=32"]
[[parameter]]
key = "response.harmonics"
values = [1]
base = 1
"#;
    let folder = Folder::new("broken-off", study);
    let child = folder.begin(&["--quiet"]);
    let journal = folder.case("base", "response.journal");
    // Six of the 400: the rest takes longer than what follows until the case is killed.
    wait_until("frequencies are solved", || {
        std::fs::metadata(&journal).is_ok_and(|m| m.len() >= 100_000)
    });
    // Another copy of the case, such as a cluster starts that has lost sight of this one, leaves it
    // alone.
    let log = folder.text("out/cases/base/log.txt");
    let other = folder.study(1, &["--case", "base"]);
    has(&other.stderr, "a run is going on");
    let undisturbed = folder.text("out/cases/base/log.txt");
    assert!(undisturbed.starts_with(&log) && !folder.case("base", "outcome.json").exists());
    folder.kill(child);
    // Some frequencies may not converge.
    assert!(
        folder
            .command(&[])
            .status()
            .unwrap()
            .code()
            .is_some_and(|c| [0, 3].contains(&c))
    );
    let log = folder.text("out/cases/base/log.txt");
    has(&log, "of 400 frequencies were solved before");
    assert!(!journal.exists());
}

/// Command lines of the running processes that name the folder (Linux).
fn running_commands(folder: &Path) -> Vec<String> {
    let folder = folder.to_str().unwrap();
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    entries
        .filter_map(|e| std::fs::read(e.path().join("cmdline")).ok())
        .map(|bytes| String::from_utf8_lossy(&bytes).replace('\0', " "))
        .filter(|line| line.contains(folder))
        .collect()
}

#[test]
fn a_case_ends_when_its_study_does() {
    let folder = Folder::new("orphan", HARMONICS);
    let mut program = program(root(), &["run"]);
    program.arg(folder.0.join("scene.toml"));
    program.arg("--out").arg(folder.0.join("out"));
    // Far longer than the test waits.
    program.args(["--set", "response.points=100000", "--until-stdin-ends"]);
    program.stdin(Stdio::piped()).stderr(Stdio::null());
    let mut child = program.spawn().unwrap();
    // It works, and its input is open.
    wait_until("the case has begun", || folder.0.join("out").exists());
    assert!(child.try_wait().unwrap().is_none(), "ended too early");
    drop(child.stdin.take());
    let begin = Instant::now();
    while child.try_wait().unwrap().is_none() && begin.elapsed() < Duration::from_secs(90) {
        std::thread::sleep(Duration::from_millis(2));
    }
    // Without effect on a process that has ended.
    child.kill().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[test]
fn a_case_that_fails_is_told_and_stops_nothing() {
    let study = r#"
name = "gap"
scene = "scene.toml"
mode = "grid"
quantities = ["peak_amplitude_m"]
[[parameter]]
key = "reduced_model.gap_m"
values = [1.0, 0.0]
[[parameter]]
key = "response.points"
values = [3]
"#;
    let folder = Folder::new("fails", study);
    let said = folder.study(3, &["--jobs", "1"]);
    let words = "gap_m_1.0__points_3 failed: the static state under the steady load was not found";
    has(&said.stderr, "of 2 cases 1 have no result");
    has(&said.stderr, words);
    has(&folder.text("out/report.html"), words);
    let rows = folder.table();
    assert_eq!(folder.outcomes(), ["converged", "failed"]);
    assert_eq!(rows[1]["peak_amplitude_m"], "");
    // It is tried again, the other is not.
    let said = folder.study(3, &["--jobs", "1"]);
    has(&said.stderr, "1 of 2 cases are complete already");
}

#[test]
fn frequencies_that_do_not_converge_are_marked() {
    let study = r#"
name = "hard"
scene = "scene.toml"
[[parameter]]
key = "response.max_newton_iterations"
values = [1, 60]
"#;
    let folder = Folder::new("unconverged", study);
    folder.study(3, &[]);
    assert_eq!(folder.outcomes(), ["some_unconverged", "converged"]);
    assert_ne!(folder.table()[0]["unconverged_points"], "0");
}

#[test]
fn cases_run_one_by_one_are_gathered() {
    let folder = Folder::new("gathered", HARMONICS);
    let said = folder.study(3, &["--collect"]);
    has(&said.stderr, "of 4 cases 4 have no result");
    for case in ["base", "harmonics_3"] {
        folder.study(0, &["--case", case]);
    }
    let said = folder.study(3, &["--collect"]);
    has(&said.stderr, "of 4 cases 2 have no result");
    let expected = ["converged", "not_run", "converged", "not_run"];
    assert_eq!(folder.outcomes(), expected);
    let said = folder.study(2, &["--case", "harmonics_9"]);
    has(
        &said.stderr,
        "base, harmonics_1, harmonics_3, grid_5-points",
    );
}

#[test]
fn the_workflow_has_each_case() {
    let folder = Folder::new("workflow", HARMONICS);
    let workflow = folder.0.join("flow");
    let export = [
        "--export-workflow",
        workflow.to_str().unwrap(),
        "--threads",
        "2",
    ];
    let set = ["--set", "damping.ratio=2e-3"];
    folder.study(0, &[&export[..], &set].concat());
    let own = std::fs::read_to_string(root().join("workflow/Snakefile")).unwrap();
    assert_eq!(folder.text("flow/Snakefile"), own);
    let names = ["base", "harmonics_1", "harmonics_3", "grid_5-points"];
    let cases = names.map(|name| serde_json::json!({ "name": name, "needs": [] }));
    let expected = serde_json::json!({
        "study": folder.0.join("study.toml"),
        "out": folder.0.join("out"),
        "arguments": ["--set", "damping.ratio=2e-3", "--no-cache"],
        "threads": 2,
        // The study compares what its cases cost: each makes all that it needs.
        "pieces": [],
        "cases": cases,
    });
    assert_eq!(folder.json("flow/cases.json"), expected);
    // Where there is a Snakemake, it runs the cases and gathers them.
    let snakemake = std::env::var("SNAKEMAKE").unwrap_or("snakemake".to_owned());
    let known = Command::new(&snakemake).arg("--version").output();
    if known.is_ok_and(|o| o.status.success()) {
        let program = format!("dovetail={}", env!("CARGO_BIN_EXE_dovetail"));
        let mut run = Command::new(&snakemake);
        run.args(["--cores", "2", "--config", &program]);
        run.current_dir(&workflow);
        ended(run, 0);
        assert_eq!(folder.outcomes(), ["converged"; 4]);
    }
}

/// The figures of a case agree with the tables of the run, which are written separately.
#[test]
fn figures_are_those_of_the_tables() {
    let study = r#"
name = "meshed"
scene = "ROOT/scenes/paper.toml"
set = [
    "mesh.file=ROOT/meshes/dovetail_small.msh", "response.points=3", "response.harmonics=1", "response.samples=32",
    "response.compare_harmonics=",
]
[[parameter]]
key = "response.harmonics"
values = [1, 2]
"#;
    let folder = Folder::new("meshed", study);
    folder.study(0, &["--jobs", "1"]);
    let rows = folder.table();
    // Each case computes all of its stages, unless they share a folder; what it cost is what it
    // says, but for the modes that the study alone asks for.
    for row in &rows {
        let summary = folder.json(&format!("out/cases/{}/summary.json", row["case"]));
        let stages = summary["stages"].as_array().unwrap();
        let held = stages.iter().find(|s| s["id"] == "held_modes").unwrap();
        for key in ["processor_seconds", "seconds"] {
            let expected = summary[key].as_f64().unwrap() - held[key].as_f64().unwrap();
            let found = number(row, key);
            assert!(
                (found - expected).abs() <= 1e-9 * expected,
                "{key}: {found}"
            );
        }
        assert_eq!(row["from_cache"], "");
    }
    let column = |file: &str, heading: &str| -> Vec<String> {
        let rows = crate::shared_runs::rows(&folder.case("base", file));
        rows.iter().map(|row| row[heading].clone()).collect()
    };
    let numbers = |file: &str, heading: &str| numbers(&folder.case("base", file), heading);
    let near = |heading: &str, wanted: f64| {
        let found = number(&rows[0], heading);
        let is_near = (found - wanted).abs() <= 1e-12 * wanted.abs();
        assert!(is_near, "{heading}: {found}, not {wanted}");
    };
    let largest = |v: Vec<f64>| v.into_iter().fold(0.0, f64::max);
    let pressures = numbers("static.csv", "pressure_pa");
    near("static_pressure_pa", largest(pressures));
    near("static_slip_m", largest(numbers("static.csv", "slip_m")));
    for contact in ["left", "right"] {
        let forces = numbers("static.csv", "normal_force_n").into_iter();
        let forces = forces.zip(column("static.csv", "contact"));
        let sum: f64 = forces.filter(|(_, c)| c == contact).map(|(f, _)| f).sum();
        near(&format!("{contact}_normal_force_n"), sum);
    }
    let amplitudes = numbers("response.csv", "tip_amplitude_m");
    near("peak_amplitude_m", largest(amplitudes.clone()));
    let peak = number(&rows[0], "peak_amplitude_m");
    let row = amplitudes.iter().position(|a| *a == peak).unwrap();
    for (figure, heading) in [
        ("peak_frequency_hz", "frequency_hz"),
        ("peak_friction_power_w", "friction_power_w"),
        ("peak_damping_power_w", "viscous_power_w"),
        ("peak_slipping_pairs", "slipping_pairs"),
        ("peak_opening_pairs", "opening_pairs"),
    ] {
        near(figure, numbers("response.csv", heading)[row]);
    }
    let summary = folder.json("out/cases/base/summary.json");
    let peaks = summary["response"]["peaks"].as_array().unwrap();
    let at_peak = peaks.iter().find(|peak| peak["row"] == row).unwrap();
    near("loss_factor", at_peak["loss_factor"].as_f64().unwrap());
    let areas = numbers("contact.csv", "area_m2");
    let opens = column("contact.csv", "opens_at_any_frequency");
    let open = areas.iter().zip(&opens).filter(|(_, o)| *o == "true");
    let open: Vec<f64> = open.map(|(a, _)| *a).collect();
    near("opening_pairs", open.len() as f64);
    let share = open.iter().sum::<f64>() / areas.iter().sum::<f64>();
    near("opening_area_share", share);
    let kinds = column("modes.csv", "kind").into_iter();
    let modes = kinds.zip(numbers("modes.csv", "frequency_hz"));
    let first = |kind: &str| modes.clone().find(|(k, _)| k == kind).unwrap().1;
    near("stuck_frequency_hz", first("stuck"));
    near("blade_frequency_hz", first("flanks_held"));
    let (cache, shared) = (folder.0.join("cache"), folder.0.join("shared"));
    let words = ["--jobs", "1", "--cache", cache.to_str().unwrap(), "--out"];
    let mut program = program(root(), &["study"]);
    program.arg(folder.0.join("study.toml"));
    ended(program.args(words).arg(&shared).arg("--quiet"), 0);
    let rows = crate::shared_runs::rows(&shared.join("table.csv"));
    let took = |row: &Row| row["from_cache"].contains("reduction");
    assert!(!took(&rows[0]) && took(&rows[1]), "{rows:?}");
    // Fields were not asked for.
    let files = ["static.vtu", "flank.pvd", "plots/static_pressure.svg"];
    let there = files.map(|file| folder.case("base", file).exists());
    assert_eq!(there, [false, false, true]);
}

#[test]
fn every_study_of_the_repository_is_possible() {
    let folder = Folder::new("ours", HARMONICS);
    let studies: Vec<_> = std::fs::read_dir(root().join("studies")).unwrap().collect();
    assert_eq!(studies.len(), 6);
    for study in studies {
        let mut program = program(root(), &["study"]);
        program.arg(study.unwrap().path());
        ended(program.arg("--export-workflow").arg(&folder.0), 0);
        let cases = &folder.json("cases.json")["cases"];
        assert!(cases.as_array().unwrap().len() > 6);
    }
}

/// A scene that is possible only with the values of the parameters: each case counts, not the scene
/// alone.
#[test]
fn a_scene_may_leave_out_what_a_parameter_sets() {
    let study = "name = \"x\"\nscene = \"scene.toml\"\n[[parameter]]\nkey = \"reduced_model.friction\"\nvalues = [0.2, 0.3]\n";
    let folder = Folder::new("leaves-out", study);
    folder.replace("scene.toml", "friction = 0.3\n", "");
    folder.study(0, &["--export-workflow", folder.0.to_str().unwrap()]);
}

/// A study that is refused, with these words, before anything runs.
fn refused(folder: &Folder, words: &str) {
    let said = folder.study(2, &[]);
    has(&said.stderr, words);
    assert!(!folder.0.join("out").exists());
}

/// The study of harmonics, with a text in place of another.
#[test]
fn what_is_wrong_is_told_with_its_remedy_before_anything_runs() {
    let table = r#"
        base = 2 => bse = 2 => unknown key `parameter.0.bse` & did you mean `base`?
        & the keys of `parameter` are: name, key, is, values, base, size, order
        base = 2 =>  => `parameter.0.base` is missing & base = 1
        base = 2 => base = 9 => `parameter.0.base` is not one of the values
        & the values are: 1, 2, 3
        base = 2 => base = 2\nis = "numeric" => `parameter.0.is`: there is no choice "numeric"
        & did you mean `numerical`? & "numerical", "physical"
        base = 2 => base = 2\nis = "physical" => leave `size` out
        & `parameter.0.size` belongs to errors, which numerical parameters alone have
        "1/(value+1)" => "1/value2" => there is no choice "1/value2" & "1/(value+1)"
        "1/(value+1)" => "1/(value-1)" => 1 has the size inf, which is not above 0
        & size = [1.0, 0.5]
        "1/(value+1)" => [3, 2, 2]
        => 3 has the size 2, which is not above 0, or that of another value
        "1/(value+1)" => [1, 2]
        => `parameter.0.size` has the wrong type: a rule, or 3 numbers, one a value
        [1, 2, 3] => [1, 2, ""] => as in the scene has the size NaN
        [1, 2, 3] => [1, 2, 2] => "2" is taken already
        [1, 2, 3] => [] => at least one value is expected
        label = "3 points", => label = "3 points", szie = 1, => unknown field `szie`
        & `label` or `set`
        label = "3 points", =>  => missing field `label` & { label = "4 x 9"
        name = "small" => name = 3 => `name` has the wrong type & name = "harmonics"
        "response.points" = 5 => "response.harmonics" = 5
        => both harmonics and grid set `response.harmonics` & one parameter set both together
        response.samples=32 => samples => "samples" is not KEY=VALUE
        [[parameter]] => mode = "gird"\n[[parameter]] => there is no choice "gird"
        & did you mean `grid`? & "one_at_a_time", "grid"
        "response.harmonics" => "response.harmonic" => unknown key `response.harmonic`
        & the keys of `response` are
        scene.toml => nowhere.toml => nowhere.toml cannot be read
        response.samples=32 => response.samples=1 => 1 samples of a period cannot carry
        "#;
    // The parameter's name becomes part of the names of folders.
    let of_names = r#"
        response.harmonics => mesh.parameters./tmp/nu => give the parameter a `name` of its own
        & `parameter.0.key`: "/tmp/nu", the last word of the key, is no name for the parameter
        "#;
    // The scene of one case: the place is the value in the study, the remedy the scene's.
    let of_scenes = r#"
        [1, 2, 3] => [1, 2, 0] => case "harmonics_0 & study.toml:8:
        & is no possible run: `response.harmonics` is 0 & set response.harmonics to 1 or more
        "#;
    let tables = [table, of_names, of_scenes].map(cases);
    for [from, to, words] in tables.into_iter().flatten() {
        let folder = Folder::new("wrong", HARMONICS);
        folder.replace("study.toml", &from, &to);
        refused(&folder, &words);
    }
}

#[test]
fn a_wrong_quantity_or_an_empty_study_is_told_with_its_remedy() {
    let wrong = |study: &str, words: &str| refused(&Folder::new("wrong-quantity", study), words);
    wrong("name = ", "this is not TOML");
    wrong(
        "",
        "`name` is missing & `scene` is missing & `parameter` is missing & [[parameter]] key = ",
    );
    wrong(
        &FRICTION_AND_FORCE.replace("\"peak_amplitude_m\",", "\"peak_amplitude\","),
        "did you mean `peak_amplitude_m`? & \"normal_force_n\"",
    );
    let parameter = |k: usize| {
        let values: Vec<usize> = (0..30).collect();
        format!("[[parameter]]\nname = \"k{k}\"\nkey = \"a{k}\"\nvalues = {values:?}\n")
    };
    let many: String = (0..3).map(parameter).collect();
    wrong(
        &format!("name = \"x\"\nscene = \"scene.toml\"\nmode = \"grid\"\n{many}"),
        "a grid of 27000 cases is more than 10000",
    );
    let folder = Folder::new("folder", HARMONICS);
    folder.replace(
        "scene.toml",
        "dovetail72\"\nfriction",
        "nowhere\"\nfriction",
    );
    refused(&folder, "nowhere/");
}
