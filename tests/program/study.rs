//! `dovetail study`: cases in folders of their own, resumed after a kill, collected, exported;
//! studies that it refuses.

use crate::shared_browser::{drawn, is_self_contained, opened};
use crate::shared_folder;
use crate::shared_program::said_in_one_line;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

/// Folder for one test with a scene and a study, removed at its end.
struct Folder(shared_folder::Folder);

struct Ended {
    code: i32,
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
        let scene = SCENE.replace("ROOT", env!("CARGO_MANIFEST_DIR"));
        std::fs::write(path.join("scene.toml"), scene).unwrap();
        std::fs::write(path.join("study.toml"), study).unwrap();
        Self(path)
    }
    fn command(&self, arguments: &[&str]) -> Command {
        let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
        program.arg("study").arg(self.0.join("study.toml"));
        program.arg("--out").arg(self.0.join("out")).args(arguments);
        program
    }
    fn study(&self, arguments: &[&str]) -> Ended {
        let output = self.command(arguments).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Ended {
            code: output.status.code().unwrap(),
            stdout: text(&output.stdout),
            stderr: said_in_one_line(&output),
        }
    }
    fn text(&self, file: &str) -> String {
        let path = self.0.join(file);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }
    /// Rows of table.csv, each a list of headings and cells.
    fn table(&self) -> Vec<Vec<(String, String)>> {
        let text = self.text("out/table.csv");
        let mut lines = text
            .lines()
            .map(|l| l.split(',').map(str::to_owned).collect::<Vec<_>>());
        let header = lines.next().unwrap();
        lines
            .map(|row| header.iter().cloned().zip(row).collect())
            .collect()
    }
    fn case(&self, slug: &str, file: &str) -> PathBuf {
        self.0.join("out/cases").join(slug).join(file)
    }
    fn changed(&self, slug: &str) -> SystemTime {
        let path = self.case(slug, "outcome.json");
        std::fs::metadata(path).unwrap().modified().unwrap()
    }
    fn json(&self, file: &str) -> serde_json::Value {
        serde_json::from_str(&self.text(file)).unwrap()
    }
}

fn cell<'r>(row: &'r [(String, String)], heading: &str) -> &'r str {
    let found = row.iter().find(|(h, _)| h == heading);
    &found.unwrap_or_else(|| panic!("no {heading} in {row:?}")).1
}

#[test]
fn a_study_runs_its_cases_and_answers() {
    let folder = Folder::new("runs", HARMONICS);
    let ended = folder.study(&["--jobs", "2"]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let rows = folder.table();
    let slugs: Vec<&str> = rows.iter().map(|r| cell(r, "case")).collect();
    let own = ["base", "harmonics_1", "harmonics_3", "grid_5-points"];
    assert_eq!(slugs[..4], own);
    for row in &rows {
        assert_eq!(cell(row, "outcome"), "converged", "{row:?}");
        assert!(cell(row, "seconds").parse::<f64>().unwrap() > 0.0);
    }
    assert_eq!(cell(&rows[1], "harmonics"), "1");
    // Five are asked for, and at most twelve are added at the peak.
    let points: usize = cell(&rows[3], "points").parse().unwrap();
    assert!((5..=17).contains(&points), "{points}");
    // The numbers are those of the run itself.
    let summary = folder.json("out/cases/harmonics_3/summary.json");
    let peak = summary["response"]["peak_amplitude_m"].as_f64().unwrap();
    assert_eq!(
        cell(&rows[2], "peak_amplitude_m").parse::<f64>().unwrap(),
        peak
    );
    // A case is the run that its case.json says.
    let record = folder.json("out/cases/harmonics_3/case.json");
    let words: Vec<String> = serde_json::from_value(record["command"].clone()).unwrap();
    let by_hand = folder.0.join("by_hand");
    let at = words.iter().position(|w| w == "--out").unwrap();
    let mut again = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    again
        .args(&words[1..at])
        .args(&words[at + 2..])
        .arg("--out")
        .arg(&by_hand);
    assert!(again.arg("--quiet").status().unwrap().success());
    let table = |path: PathBuf| std::fs::read_to_string(path).unwrap();
    assert_eq!(
        table(by_hand.join("response.csv")),
        table(folder.case("harmonics_3", "response.csv"))
    );
    let report = folder.text("out/report.html");
    for words in [
        "<h3>harmonics</h3>",
        "<h3>grid</h3>",
        "<td>– estimated error</td>",
        "<a href=\"cases/harmonics_3/report.html\">",
        "<th>peak amplitude of tip (",
        "In brackets stands the difference from the finest case.",
        "<figcaption>Errors by harmonics.</figcaption>",
    ] {
        assert!(report.contains(words), "{words}: {report}");
    }
    // The page draws the responses of all cases and shows every picture.
    let page = folder.0.join("out/report.html");
    is_self_contained(&page);
    for width in [1400, 400] {
        let (dom, complaints) = opened(&page, width);
        assert_eq!(complaints, [""; 0]);
        let plots = std::fs::read_dir(folder.0.join("out/plots"))
            .unwrap()
            .count();
        let expected = [vec!["responses"], vec!["picture"; plots]].concat();
        assert_eq!(drawn(&dom), expected);
        assert!(
            dom.contains(&format!(">{} of {0}</div>", rows.len())),
            "{dom}"
        );
    }
    // Nothing is chosen: the study asks for no least value.
    assert_eq!(ended.stdout, "");
    let svg = folder.text("out/plots/harmonics.svg");
    for words in [
        "1/(harmonics+1)",
        "peak amplitude of tip",
        "estimated error (%)",
    ] {
        assert!(svg.lines().any(|l| l == words), "{words}: {svg}");
    }
    let answers = folder.json("out/summary.json");
    let day = answers["day"].as_str().unwrap();
    assert!(day.len() == 10 && report.contains(&format!("<time>{day}</time>")));
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
    let of_peak = &of_peak.unwrap()["differences"];
    assert_eq!(
        *of_peak,
        serde_json::json!([difference(1), from(0, 2), 0.0])
    );
    // Again: nothing is left to do.
    let before: Vec<SystemTime> = slugs.iter().map(|s| folder.changed(s)).collect();
    let ended = folder.study(&[]);
    assert!(
        ended.code == 0 && ended.stderr.contains("4 of 4 cases are complete already"),
        "{}",
        ended.stderr
    );
    let after: Vec<SystemTime> = slugs.iter().map(|s| folder.changed(s)).collect();
    assert_eq!(before, after);
    // A scene that was edited makes them all stale.
    let scene = folder
        .text("scene.toml")
        .replace("friction = 0.3", "friction = 0.2");
    std::fs::write(folder.0.join("scene.toml"), scene).unwrap();
    let ended = folder.study(&["--collect"]);
    assert!(
        ended.code == 3 && ended.stderr.contains("of 4 cases 4 have no result"),
        "{}",
        ended.stderr
    );
}

/// Rows of a table with this value of a parameter.
fn rows_at<'t>(
    rows: &'t [Vec<(String, String)>],
    parameter: &str,
    label: &str,
) -> Vec<&'t Vec<(String, String)>> {
    rows.iter()
        .filter(|r| cell(r, parameter) == label)
        .collect()
}

fn number(row: &[(String, String)], heading: &str) -> f64 {
    cell(row, heading).parse().unwrap()
}

const FRICTION_AND_FORCE: &str = r#"
name = "designs"
scene = "scene.toml"
mode = "grid"
quantities = ["stuck_frequency_hz", "peak_amplitude_m", "peak_ratio"]

[[parameter]]
key = "reduced_model.friction"
values = [0.3, 0.05]

[[parameter]]
key = "reduced_model.force_n"
values = [1.0, 2.0, 4.0]

[[minimise]]
quantity = "peak_amplitude_m"
"#;

/// Design values have no error: such a study reports values, pictures of them and the smallest
/// value.
#[test]
fn a_study_of_designs_answers_without_errors() {
    let folder = Folder::new("designs", FRICTION_AND_FORCE);
    let ended = folder.study(&["--jobs", "2"]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let rows = folder.table();
    assert_eq!(rows.len(), 6);
    let headings: Vec<&str> = rows[0].iter().map(|(h, _)| h.as_str()).collect();
    let of_parameters_and_figures = [
        "case",
        "friction",
        "force_n",
        "stuck_frequency_hz",
        "peak_amplitude_m",
        "peak_ratio",
        "processor_seconds",
    ];
    assert_eq!(headings[..7], of_parameters_and_figures);
    // The least of the table at each force, and where its friction stands among the values.
    let answers = folder.json("out/summary.json");
    let minima = answers["minima"].as_array().unwrap();
    assert_eq!(minima.len(), 3);
    for (minimum, force) in minima.iter().zip(["1.0", "2.0", "4.0"]) {
        let own = rows_at(&rows, "force_n", force);
        let by_amplitude = |r: &&&Vec<(String, String)>| number(r, "peak_amplitude_m").to_bits();
        let least = own.iter().min_by_key(by_amplitude).unwrap();
        assert_eq!(minimum["figure"], "peak_amplitude_m");
        assert_eq!(minimum["loads"], serde_json::json!({ "force_n": force }));
        assert_eq!(minimum["value"], number(least, "peak_amplitude_m"));
        assert_eq!(minimum["case"], cell(least, "case"));
        let friction = cell(least, "friction");
        let end = if friction == "0.05" {
            "lowest"
        } else {
            "highest"
        };
        assert_eq!(
            minimum["design"],
            serde_json::json!({ "friction": friction })
        );
        assert_eq!(minimum["at_ends"], serde_json::json!({ "friction": end }));
        assert_eq!(minimum["other_cases"], 0);
    }
    let told = "least peak amplitude of tip at force 1.0 N: ";
    assert!(ended.stdout.starts_with(told), "{}", ended.stdout);
    let report = folder.text("out/report.html");
    for words in [
        &format!("<li>{}</li>", ended.stdout.lines().next().unwrap()),
        "µm with friction 0.05 (case friction_0.05__force_n_1.0, converged); this is the lowest value of friction",
        "The same for all designs, and in no picture of them: first stuck frequency.",
        "<figcaption>Ratio of the peak to the linear peak over force (N), by friction.</figcaption><img src=\"data:image/svg+xml;base64,",
    ] {
        assert!(report.contains(words), "{words}: {report}");
    }
    // Nothing is told as an error.
    let (words, _scripts) = report.split_once("<script").unwrap();
    for text in [
        words,
        &ended.stdout,
        &folder.text("out/table.csv"),
        &answers.to_string(),
    ] {
        let text = text.to_lowercase();
        assert!(
            !text.contains("error") && !text.contains("difference"),
            "{text}"
        );
    }
    assert_eq!(answers["parameters"][0]["is"], "design");
    assert_eq!(answers["parameters"][1]["is"], "load");
    // Low values come first, whatever the order in the file.
    assert_eq!(
        answers["parameters"][0]["values"],
        serde_json::json!(["0.05", "0.3"])
    );
    let mut plots: Vec<String> = std::fs::read_dir(folder.0.join("out/plots"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    plots.sort();
    let expected = ["peak_amplitude_m", "peak_ratio"].map(|figure| {
        [
            format!("{figure}_over_force_n_by_friction.svg"),
            format!("{figure}_over_friction_and_force_n.svg"),
            format!("{figure}_over_friction_by_force_n.svg"),
        ]
    });
    assert_eq!(plots, expected.concat());
    // A line of the curves for each value of the other parameter, and a cell for each case.
    let curves = folder.text("out/plots/peak_amplitude_m_over_friction_by_force_n.svg");
    let lines = curves
        .lines()
        .filter(|l| l.contains("<polyline") && l.contains("stroke-width=\"30\""));
    assert_eq!(lines.count(), 3);
    for words in ["force 4.0 N", "peak amplitude of tip (mm)", "0.05"] {
        assert!(curves.lines().any(|l| l == words), "{words}: {curves}");
    }
    let map = folder.text("out/plots/peak_amplitude_m_over_friction_and_force_n.svg");
    for row in &rows {
        let shown = format!("{:.2}", 1e3 * number(row, "peak_amplitude_m"));
        assert!(map.lines().any(|l| l == shown), "{shown}: {map}");
    }
    // Where the largest amplitude is no peak is said, and of the least one, too.
    let at_end = |slug: &str| {
        let summary = folder.json(&format!("out/cases/{slug}/summary.json"));
        let told = report.contains(&format!("case {slug}: the peak is at an end of its"));
        let is = summary["response"]["peak_at_end_of_range"]
            .as_bool()
            .unwrap();
        assert_eq!(is, told, "{slug}: {report}");
        is
    };
    let at_end: Vec<bool> = rows.iter().map(|r| at_end(cell(r, "case"))).collect();
    assert!(
        at_end.contains(&true) && at_end.contains(&false),
        "{at_end:?}"
    );
    let ended = folder.study(&["--set", "response.times_first_linear_mode=[0.7, 0.8]"]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let words = "; its peak is at an end of the frequencies and may be higher outside";
    assert!(ended.stdout.contains(words), "{}", ended.stdout);
    let minimum = &folder.json("out/summary.json")["minima"][0];
    assert_eq!(minimum["peak_at_end_of_range"], true);
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
[[minimise]]
quantity = "peak_amplitude_m"
"#;
    let folder = Folder::new("mixed", study);
    let ended = folder.study(&["--jobs", "2"]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let rows = folder.table();
    let (answers, report) = (
        folder.json("out/summary.json"),
        folder.text("out/report.html"),
    );
    let (mut errors, mut of_fine) = (Vec::new(), Vec::new());
    for (at, friction) in ["0.05", "0.3"].into_iter().enumerate() {
        let own = rows_at(&rows, "friction", friction);
        let [coarse, fine] = [0, 1].map(|i| number(own[i], "peak_amplitude_m"));
        let expected = [(coarse - fine).abs() / fine, 0.0];
        for (row, expected) in own.iter().zip(expected) {
            let found = number(row, "difference_peak_amplitude_m");
            assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
        }
        errors.push(expected[0]);
        of_fine.push(fine);
        let refinement = &answers["refinements"][at];
        assert_eq!(
            refinement["at"],
            serde_json::json!({ "friction": friction })
        );
        assert!(report.contains(&format!("<h3>harmonics at friction {friction}</h3>")));
        // A parameter without sizes is drawn over its values.
        let svg = folder.text(&format!("out/plots/harmonics__friction_{friction}.svg"));
        for words in ["harmonics", "1", "3", "estimated error (%)"] {
            assert!(svg.lines().any(|l| l == words), "{words}: {svg}");
        }
    }
    assert!(!report.contains("<h3>friction"), "{report}");
    // The friction changes the figure by far more.
    let by_friction = (of_fine[0] - of_fine[1]).abs() / of_fine[1];
    assert!(
        errors.iter().all(|e| *e < 0.5 * by_friction),
        "{errors:?} {by_friction}"
    );
    // Designs are compared at the finest numerical value.
    let finest = rows_at(&rows, "harmonics", "3");
    let amplitudes = finest.iter().map(|r| number(r, "peak_amplitude_m"));
    let least = amplitudes.reduce(f64::min).unwrap();
    assert_eq!(answers["minima"][0]["value"], least);
    folder.text("out/plots/peak_amplitude_m_over_friction.svg");
}

/// The committed study of friction and force, on four frequencies.
#[test]
fn the_study_of_friction_and_force_answers() {
    let folder = Folder::new("friction-force", "");
    let study = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/friction_force.toml");
    std::fs::copy(&study, folder.0.join("study.toml")).unwrap();
    let text = folder.text("study.toml");
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/scene.toml");
    let text = text.replace("../benches/peers/scene.toml", scene.to_str().unwrap());
    std::fs::write(folder.0.join("study.toml"), text).unwrap();
    let ended = folder.study(&[
        "--set",
        "response.points=4",
        "--set",
        "response.harmonics=1",
    ]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    assert_eq!(folder.table().len(), 24);
    for (quantity, name) in [
        ("peak_ratio", "ratio of the peak to the linear peak"),
        ("peak_amplitude_m", "peak amplitude of tip"),
    ] {
        for force in ["0.5", "1.0", "2.0", "4.0"] {
            let told = format!("least {name} at force {force} N: ");
            assert!(ended.stdout.contains(&told), "{}", ended.stdout);
        }
        folder.text(&format!(
            "out/plots/{quantity}_over_friction_and_force_n.svg"
        ));
    }
}

#[test]
fn a_killed_study_is_taken_up_where_it_was() {
    let study = HARMONICS.replace("[1, 2, 3]", "[1, 2, 3, 4, 5, 6, 7]");
    let folder = Folder::new("killed", &study);
    let mut child = folder
        .command(&["--jobs", "1", "--quiet", "--set", "response.samples=64"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let all = [
        "base",
        "harmonics_1",
        "harmonics_3",
        "harmonics_4",
        "harmonics_5",
        "harmonics_6",
        "harmonics_7",
        "grid_5-points",
    ];
    let complete = || {
        all.iter()
            .filter(|s| folder.case(s, "outcome.json").exists())
            .count()
    };
    let begin = Instant::now();
    while complete() < 2 || !folder.case(all[complete()], "case.json").exists() {
        assert!(
            begin.elapsed() < Duration::from_secs(100),
            "two cases take too long"
        );
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    // The case under way ends with the study: nobody works on it any more.
    while !at_work(&folder.0).is_empty() {
        assert!(
            begin.elapsed() < Duration::from_secs(120),
            "{:?}",
            at_work(&folder.0)
        );
        std::thread::sleep(Duration::from_millis(2));
    }
    let done = complete();
    assert!((2..all.len()).contains(&done));
    let before: Vec<SystemTime> = all[..done].iter().map(|s| folder.changed(s)).collect();
    let ended = folder.study(&["--set", "response.samples=64"]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    assert!(
        ended
            .stderr
            .contains(&format!("{done} of 8 cases are complete already")),
        "{}",
        ended.stderr
    );
    let rerun = format!("/{}] ", all.len() - done);
    assert_eq!(
        ended.stderr.matches(&rerun).count(),
        all.len() - done,
        "{}",
        ended.stderr
    );
    let after: Vec<SystemTime> = all[..done].iter().map(|s| folder.changed(s)).collect();
    assert_eq!(before, after);
    assert!(
        folder
            .table()
            .iter()
            .all(|r| cell(r, "outcome") == "converged")
    );
}

/// A case stays complete only if it was run by this program and has its figures.
#[test]
fn a_case_of_another_program_or_without_figures_is_run_again() {
    let study = HARMONICS.replace("values = [1, 2, 3]", "values = [1, 2]");
    let folder = Folder::new("current", &study);
    let ended = folder.study(&["--quiet"]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let complete = |cases: &str| {
        let ended = folder.study(&["--collect"]);
        let (code, lacking) = match cases {
            "3 of 3" => (0, String::new()),
            _ => (3, "of 3 cases 1 have no result".to_owned()),
        };
        assert_eq!(ended.code, code, "{}", ended.stderr);
        assert!(ended.stderr.contains(&lacking), "{}", ended.stderr);
        let ended = folder.study(&[]);
        let words = format!("{cases} cases are complete already");
        assert!(
            ended.code == 0 && ended.stderr.contains(&words),
            "{cases}: {}",
            ended.stderr
        );
    };
    complete("3 of 3");
    for nothing in ["{}", "null", r#"{ "response": null }"#] {
        std::fs::write(folder.case("harmonics_1", "summary.json"), nothing).unwrap();
        complete("2 of 3");
    }
    // A program of the same version that is another.
    let path = folder.case("base", "case.json");
    let mut record: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let hash = record["program_hash"].as_str().unwrap_or_default();
    assert_eq!(hash.len(), 64, "{record}");
    record["program_hash"] = "0".repeat(64).into();
    std::fs::write(&path, record.to_string()).unwrap();
    complete("2 of 3");
    complete("3 of 3");
    // Written by a program that did not say which it is.
    record.as_object_mut().unwrap().remove("program_hash");
    std::fs::write(&path, record.to_string()).unwrap();
    complete("2 of 3");
    complete("3 of 3");
}

#[test]
fn a_case_that_was_broken_off_goes_on_with_its_frequencies() {
    let study = r#"
name = "long"
scene = "scene.toml"
set = ["response.points=800"]
[[parameter]]
key = "response.harmonics"
values = [1]
base = 1
"#;
    let folder = Folder::new("broken-off", study);
    let mut child = folder
        .command(&["--quiet"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let journal = folder.case("base", "response.journal");
    while std::fs::metadata(&journal).map_or(0, |m| m.len()) < 200_000 {
        assert!(child.try_wait().unwrap().is_none(), "ended too early");
        assert!(begin.elapsed() < Duration::from_secs(100));
        std::thread::sleep(Duration::from_millis(2));
    }
    // Another copy of the case, such as a cluster starts that has lost sight of this one, leaves it
    // alone.
    let log = std::fs::read(folder.case("base", "log.txt")).unwrap();
    let other = folder.study(&["--case", "base"]);
    assert!(
        other.code == 1 && other.stderr.contains("a run is going on"),
        "{}",
        other.stderr
    );
    let undisturbed = std::fs::read(folder.case("base", "log.txt")).unwrap();
    assert!(undisturbed.starts_with(&log) && !folder.case("base", "outcome.json").exists());
    child.kill().unwrap();
    child.wait().unwrap();
    while !at_work(&folder.0).is_empty() {
        assert!(begin.elapsed() < Duration::from_secs(120));
        std::thread::sleep(Duration::from_millis(2));
    }
    let ended = folder.study(&[]);
    assert!([0, 3].contains(&ended.code), "{}", ended.stderr);
    let log = std::fs::read_to_string(folder.case("base", "log.txt")).unwrap();
    assert!(
        log.contains("of 800 frequencies were solved before"),
        "{log}"
    );
    assert!(!journal.exists());
}

/// Command lines of the running processes that name the folder (Linux).
fn at_work(folder: &Path) -> Vec<String> {
    let folder = folder.to_str().unwrap();
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    entries
        .filter_map(|e| std::fs::read(e.path().join("cmdline")).ok())
        .map(|bytes| String::from_utf8_lossy(&bytes).replace('\0', " "))
        .filter(|line| line.contains(folder))
        .collect()
}

#[test]
fn cases_of_an_earlier_definition_go_and_nothing_else() {
    let folder = Folder::new("redefined", HARMONICS);
    assert_eq!(folder.study(&[]).code, 0);
    let case = |name: &str| folder.0.join("out/cases").join(name);
    let [two, three] = ["harmonics_1", "harmonics_3"].map(case);
    assert!(two.join("summary.json").exists() && three.join("summary.json").exists());
    // What is not of the study stays, and so does its folder.
    std::fs::write(three.join("notes.txt"), "mine").unwrap();
    let other = case("of_another_study");
    std::fs::create_dir(&other).unwrap();
    let record = std::fs::read_to_string(two.join("case.json")).unwrap();
    std::fs::write(
        other.join("case.json"),
        record.replace("\"small\"", "\"large\""),
    )
    .unwrap();
    let redefined = HARMONICS.replace("values = [1, 2, 3]", "values = [2, 4]");
    std::fs::write(folder.0.join("study.toml"), redefined).unwrap();
    let ended = folder.study(&[]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    assert!(
        ended
            .stderr
            .contains("of an earlier definition of the study"),
        "{}",
        ended.stderr
    );
    assert!(!two.exists() && case("harmonics_4").join("summary.json").exists());
    let left = std::fs::read_dir(&three).unwrap();
    let left: Vec<_> = left.map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["notes.txt"]);
    assert!(other.join("case.json").exists());
    let table = folder.text("out/table.csv");
    assert!(!table.contains("harmonics_3,"), "{table}");
}

#[test]
fn a_case_ends_when_its_study_does() {
    let folder = Folder::new("orphan", HARMONICS);
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program.arg("run").arg(folder.0.join("scene.toml"));
    program.arg("--out").arg(folder.0.join("out"));
    // Far longer than the test waits.
    program.args(["--set", "response.points=100000", "--until-stdin-ends"]);
    let mut child = program
        .stdin(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // It works, and its input is open.
    let begin = Instant::now();
    while !folder.0.join("out").exists() {
        assert!(child.try_wait().unwrap().is_none(), "ended too early");
        assert!(begin.elapsed() < Duration::from_secs(60), "does not begin");
        std::thread::sleep(Duration::from_millis(2));
    }
    drop(child.stdin.take());
    let ended = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break Some(status);
        }
        if begin.elapsed() > Duration::from_secs(90) {
            child.kill().unwrap();
            child.wait().unwrap();
            break None;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    assert_eq!(ended.and_then(|s| s.code()), Some(130));
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
    let ended = folder.study(&["--jobs", "1"]);
    assert_eq!(ended.code, 3, "{}", ended.stderr);
    assert!(
        ended.stderr.contains("of 2 cases 1 have no result"),
        "{}",
        ended.stderr
    );
    let words = "gap_m_1.0__points_3 failed: the static state under the steady load was not found";
    assert!(ended.stderr.contains(words), "{}", ended.stderr);
    assert!(
        folder
            .text("out/report.html")
            .contains("the static state under the steady load was not found")
    );
    let rows = folder.table();
    assert_eq!(
        (
            cell(&rows[1], "outcome"),
            cell(&rows[1], "peak_amplitude_m")
        ),
        ("failed", "")
    );
    assert_eq!(cell(&rows[0], "outcome"), "converged");
    // It is tried again, the other is not.
    let ended = folder.study(&["--jobs", "1"]);
    assert!(
        ended.stderr.contains("1 of 2 cases are complete already"),
        "{}",
        ended.stderr
    );
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
    let ended = folder.study(&[]);
    assert_eq!(ended.code, 3, "{}", ended.stderr);
    let rows = folder.table();
    assert_eq!(cell(&rows[0], "outcome"), "some_unconverged");
    assert_ne!(cell(&rows[0], "unconverged_points"), "0");
    assert_eq!(cell(&rows[1], "outcome"), "converged");
}

#[test]
fn cases_run_one_by_one_are_gathered() {
    let folder = Folder::new("gathered", HARMONICS);
    let ended = folder.study(&["--collect"]);
    assert!(
        ended.code == 3 && ended.stderr.contains("of 4 cases 4 have no result"),
        "{}",
        ended.stderr
    );
    for case in ["base", "harmonics_3"] {
        let ended = folder.study(&["--case", case]);
        assert_eq!(ended.code, 0, "{}", ended.stderr);
    }
    let ended = folder.study(&["--collect"]);
    assert!(
        ended.code == 3 && ended.stderr.contains("of 4 cases 2 have no result"),
        "{}",
        ended.stderr
    );
    let outcomes: Vec<String> = folder
        .table()
        .iter()
        .map(|r| cell(r, "outcome").to_owned())
        .collect();
    assert_eq!(outcomes, ["converged", "not_run", "converged", "not_run"]);
    let ended = folder.study(&["--case", "harmonics_9"]);
    assert_eq!(ended.code, 2);
    assert!(
        ended
            .stderr
            .contains("base, harmonics_1, harmonics_3, grid_5-points"),
        "{}",
        ended.stderr
    );
}

#[test]
fn the_workflow_has_each_case() {
    let folder = Folder::new("workflow", HARMONICS);
    let workflow = folder.0.join("flow");
    let ended = folder.study(&[
        "--export-workflow",
        workflow.to_str().unwrap(),
        "--threads",
        "2",
        "--set",
        "damping.ratio=2e-3",
    ]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let snakefile = folder.text("flow/Snakefile");
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("workflow/Snakefile");
    assert_eq!(snakefile, std::fs::read_to_string(own).unwrap());
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
        let output = Command::new(&snakemake)
            .args(["--cores", "2", "--config", &program])
            .current_dir(&workflow)
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{text}");
        let outcomes = folder.table();
        assert_eq!(outcomes.len(), 4, "{text}");
        assert!(outcomes.iter().all(|r| cell(r, "outcome") == "converged"));
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
    let folder = Folder::new("meshed", &study.replace("ROOT", env!("CARGO_MANIFEST_DIR")));
    let ended = folder.study(&["--jobs", "1"]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let rows = folder.table();
    // Each case computes all of its stages, unless they share a folder; what it cost is what it
    // says, but for the modes that the study alone asks for.
    for row in &rows {
        let summary = folder.json(&format!("out/cases/{}/summary.json", cell(row, "case")));
        let stages = summary["stages"].as_array().unwrap();
        let held = stages.iter().find(|s| s["id"] == "held_modes").unwrap();
        for (heading, key) in [
            ("processor_seconds", "processor_seconds"),
            ("seconds", "seconds"),
        ] {
            let expected = summary[key].as_f64().unwrap() - held[key].as_f64().unwrap();
            let found: f64 = cell(row, heading).parse().unwrap();
            assert!(
                (found - expected).abs() <= 1e-9 * expected,
                "{heading}: {found}"
            );
        }
        assert_eq!(cell(row, "from_cache"), "");
    }
    let number = |heading: &str| cell(&rows[0], heading).parse::<f64>().unwrap();
    let column = |file: &str, heading: &str| -> Vec<String> {
        let text = folder.text(&format!("out/cases/base/{file}"));
        let mut lines = text.lines().map(|l| l.split(',').collect::<Vec<_>>());
        let at = lines
            .next()
            .unwrap()
            .iter()
            .position(|h| *h == heading)
            .unwrap();
        lines.map(|l| l[at].to_owned()).collect()
    };
    let numbers = |file: &str, heading: &str| -> Vec<f64> {
        column(file, heading)
            .iter()
            .map(|c| c.parse().unwrap())
            .collect()
    };
    let near = |heading: &str, wanted: f64| {
        let found = number(heading);
        assert!(
            (found - wanted).abs() <= 1e-12 * wanted.abs(),
            "{heading}: {found}, not {wanted}"
        );
    };
    let largest = |v: Vec<f64>| v.into_iter().fold(0.0, f64::max);
    near(
        "static_pressure_pa",
        largest(numbers("static.csv", "pressure_pa")),
    );
    near("static_slip_m", largest(numbers("static.csv", "slip_m")));
    for contact in ["left", "right"] {
        let forces = numbers("static.csv", "normal_force_n")
            .into_iter()
            .zip(column("static.csv", "contact"));
        let sum: f64 = forces.filter(|(_, c)| c == contact).map(|(f, _)| f).sum();
        near(&format!("{contact}_normal_force_n"), sum);
    }
    let amplitudes = numbers("response.csv", "tip_amplitude_m");
    near("peak_amplitude_m", largest(amplitudes.clone()));
    let row = amplitudes
        .iter()
        .position(|a| *a == number("peak_amplitude_m"))
        .unwrap();
    for (figure, heading) in [
        ("peak_frequency_hz", "frequency_hz"),
        ("peak_friction_power_w", "friction_power_w"),
        ("peak_damping_power_w", "viscous_power_w"),
        ("peak_slipping_pairs", "slipping_pairs"),
        ("peak_opening_pairs", "opening_pairs"),
    ] {
        near(figure, numbers("response.csv", heading)[row]);
    }
    let areas = numbers("contact.csv", "area_m2");
    let opens = column("contact.csv", "opens_at_any_frequency");
    let open: Vec<f64> = areas
        .iter()
        .zip(&opens)
        .filter(|(_, o)| *o == "true")
        .map(|(a, _)| *a)
        .collect();
    near("opening_pairs", open.len() as f64);
    near(
        "opening_area_share",
        open.iter().sum::<f64>() / areas.iter().sum::<f64>(),
    );
    let modes = column("modes.csv", "kind")
        .into_iter()
        .zip(numbers("modes.csv", "frequency_hz"));
    let first = |kind: &str| modes.clone().find(|(k, _)| k == kind).unwrap().1;
    near("stuck_frequency_hz", first("stuck"));
    near("blade_frequency_hz", first("flanks_held"));
    let cache = folder.0.join("cache");
    let shared = folder.0.join("shared");
    let words = ["--jobs", "1", "--cache", cache.to_str().unwrap(), "--out"];
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program.arg("study").arg(folder.0.join("study.toml"));
    let ended = program.args(words).arg(&shared).arg("--quiet").status();
    assert!(ended.unwrap().success());
    let table = folder.text("shared/table.csv");
    let rows: Vec<&str> = table.lines().collect();
    assert!(
        !rows[1].contains("reduction") && rows[2].contains("reduction"),
        "{table}"
    );
    // Fields were not asked for.
    assert!(
        !folder.case("base", "static.vtu").exists() && !folder.case("base", "flank.pvd").exists()
    );
    assert!(folder.case("base", "plots/static_pressure.svg").exists());
}

#[test]
fn every_study_of_the_repository_is_possible() {
    let folder = Folder::new("ours", HARMONICS);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut checked = 0;
    for entry in std::fs::read_dir(root.join("studies")).unwrap() {
        let study = entry.unwrap().path();
        let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
        program
            .arg("study")
            .arg(&study)
            .arg("--export-workflow")
            .arg(&folder.0);
        let output = program.output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{}: {stderr}", study.display());
        let cases = &folder.json("cases.json")["cases"];
        assert!(cases.as_array().unwrap().len() > 6);
        checked += 1;
    }
    assert_eq!(checked, 6);
}

/// A scene that is possible only with the values of the parameters: each case counts, not the scene
/// alone.
#[test]
fn a_scene_may_leave_out_what_a_parameter_sets() {
    let study = "name = \"x\"\nscene = \"scene.toml\"\n[[parameter]]\nkey = \"reduced_model.friction\"\nvalues = [0.2, 0.3]\n";
    let folder = Folder::new("leaves-out", study);
    let scene = folder.text("scene.toml").replace("friction = 0.3\n", "");
    std::fs::write(folder.0.join("scene.toml"), scene).unwrap();
    let ended = folder.study(&["--export-workflow", folder.0.to_str().unwrap()]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
}

#[test]
fn what_is_wrong_is_told_with_its_remedy_before_anything_runs() {
    let told = |name: &str, study: &str, words: &[&str]| {
        let folder = Folder::new(name, study);
        let ended = folder.study(&[]);
        assert_eq!(ended.code, 2, "{}", ended.stderr);
        for word in words {
            assert!(ended.stderr.contains(word), "{word}: {}", ended.stderr);
        }
        assert!(!folder.0.join("out").exists());
    };
    let changed = |from: &str, to: &str| {
        assert!(HARMONICS.contains(from), "{from}");
        HARMONICS.replacen(from, to, 1)
    };
    told("toml", "name = ", &["this is not TOML"]);
    told(
        "empty",
        "",
        &[
            "`name` is missing",
            "`scene` is missing",
            "`parameter` is missing",
            "[[parameter]] key = ",
        ],
    );
    told(
        "key",
        &changed("base = 2", "bse = 2"),
        &[
            "unknown key `parameter.0.bse`",
            "did you mean `base`?",
            "the keys of `parameter` are: name, key, is, values, base, size, order",
        ],
    );
    told(
        "no-base",
        &changed("base = 2", ""),
        &["`parameter.0.base` is missing", "base = 1"],
    );
    told(
        "base",
        &changed("base = 2", "base = 9"),
        &[
            "`parameter.0.base` is not one of the values",
            "the values are: 1, 2, 3",
        ],
    );
    // The parameter's name becomes part of the names of folders.
    told(
        "name-of-key",
        &changed("response.harmonics", "mesh.parameters./tmp/nu"),
        &[
            "`parameter.0.key`: \"/tmp/nu\", the last word of the key, is no name for the parameter",
            "give the parameter a `name` of its own",
        ],
    );
    told(
        "size",
        &changed("1/(value+1)", "1/value2"),
        &["there is no choice \"1/value2\"", "\"1/(value+1)\""],
    );
    told(
        "no-size",
        &changed("1/(value+1)", "1/(value-1)"),
        &[
            "1 has the size inf, which is not above 0",
            "size = [1.0, 0.5]",
        ],
    );
    told(
        "text-size",
        &changed("[1, 2, 3]", "[1, 2, \"\"]"),
        &["as in the scene has the size NaN"],
    );
    told(
        "equal-sizes",
        &changed("\"1/(value+1)\"", "[3, 2, 2]"),
        &["two values have the size 2"],
    );
    told(
        "some-sizes",
        &changed("label = \"3 points\", ", "label = \"3 points\", size = 1, "),
        &["some values have a size, 5 points has none"],
    );
    told(
        "joint-key",
        &changed("label = \"3 points\", ", "label = \"3 points\", szie = 1, "),
        &["unknown field `szie`", "`size`"],
    );
    told(
        "type",
        &changed("name = \"small\"", "name = 3"),
        &["`name` has the wrong type", "name = \"harmonics\""],
    );
    told(
        "sizes",
        &changed("\"1/(value+1)\"", "[1, 2]"),
        &["`parameter.0.size` has the wrong type: a rule, or 3 numbers, one a value"],
    );
    told(
        "values",
        &changed("[1, 2, 3]", "[1, 2, 2]"),
        &["\"2\" is taken already"],
    );
    told(
        "none",
        &changed("values = [1, 2, 3]", "values = []"),
        &["at least one value is expected"],
    );
    told(
        "twice",
        &changed("\"response.points\" = 5", "\"response.harmonics\" = 5"),
        &[
            "both harmonics and grid set `response.harmonics`",
            "one parameter set both together",
        ],
    );
    told(
        "set",
        &changed("response.samples=32", "samples"),
        &["\"samples\" is not KEY=VALUE"],
    );
    told(
        "mode",
        &changed("[[parameter]]", "mode = \"gird\"\n[[parameter]]"),
        &[
            "there is no choice \"gird\"",
            "did you mean `grid`?",
            "\"one_at_a_time\", \"grid\"",
        ],
    );
    told(
        "quantity",
        &FRICTION_AND_FORCE.replace("\"peak_amplitude_m\",", "\"peak_amplitude\","),
        &["did you mean `peak_amplitude_m`?", "\"normal_force_n\""],
    );
    told(
        "recommend",
        &format!("{HARMONICS}\n[[recommend]]\nquantity = \"peak_ratio\"\naccuracy = 0.1\n"),
        &[
            "unknown section or key `recommend`",
            "leave [[recommend]] out: the report has the error of every value",
        ],
    );
    told(
        "former",
        &changed("[[parameter]]", "[[knob]]"),
        &["unknown section or key `knob`", "did you mean `parameter`?"],
    );
    told(
        "joint",
        &changed("label = \"3 points\", ", ""),
        &["missing field `label`", "{ label = \"4 x 9\""],
    );
    told(
        "is",
        &changed("base = 2", "base = 2\nis = \"numeric\""),
        &[
            "`parameter.0.is`: there is no choice \"numeric\"",
            "did you mean `numerical`?",
            "\"numerical\", \"load\", \"design\"",
        ],
    );
    told(
        "design-size",
        &changed("base = 2", "base = 2\nis = \"design\""),
        &[
            "`parameter.0.size` belongs to errors, which numerical parameters alone have",
            "leave `size` out",
        ],
    );
    told(
        "no-design",
        &format!("{HARMONICS}\n[[minimise]]\nquantity = \"peak_ratio\"\n"),
        &[
            "`minimise.0` asks for the best design, and no parameter is a design value (harmonics, grid)",
            "is = \"design\"",
        ],
    );
    told(
        "least-of-nothing",
        &FRICTION_AND_FORCE.replace("quantity = \"peak_amplitude_m\"", "quantity = \"peak\""),
        &[
            "there is no choice \"peak\"",
            "\"peak_ratio\", \"static_pressure_pa\"",
        ],
    );
    told(
        "not-followed",
        &FRICTION_AND_FORCE.replace(
            "quantity = \"peak_amplitude_m\"",
            "quantity = \"opening_pairs\"",
        ),
        &[
            "`minimise.0.quantity`: opening_pairs is not among the `quantities` of the study",
            "add \"opening_pairs\" to `quantities`",
        ],
    );
    told(
        "no-quantity",
        &FRICTION_AND_FORCE.replace("quantity = \"peak_amplitude_m\"", ""),
        &["`minimise.0.quantity` is missing"],
    );
    // The scene of one case: the place is the value in the study, the remedy the scene's.
    told(
        "case",
        &changed("[1, 2, 3]", "[1, 2, 0]"),
        &[
            "case \"harmonics_0",
            "is no possible run: `response.harmonics` is 0",
            "set response.harmonics to 1 or more",
            "study.toml:8:",
        ],
    );
    told(
        "scene-key",
        &changed("\"response.harmonics\"", "\"response.harmonic\""),
        &[
            "unknown key `response.harmonic`",
            "the keys of `response` are",
        ],
    );
    told(
        "scene",
        &changed("scene.toml", "nowhere.toml"),
        &["nowhere.toml cannot be read"],
    );
    told(
        "base-scene",
        &changed("response.samples=32", "response.samples=1"),
        &["1 samples of a period cannot carry"],
    );
    let grid = "name = \"x\"\nscene = \"scene.toml\"\nmode = \"grid\"\n";
    let parameter = |k: usize| {
        format!(
            "[[parameter]]\nname = \"k{k}\"\nkey = \"a{k}\"\nvalues = {:?}\n",
            (0..30).collect::<Vec<_>>()
        )
    };
    told(
        "many",
        &format!("{grid}{}{}{}", parameter(0), parameter(1), parameter(2)),
        &["a grid of 27000 cases is more than 10000"],
    );
    let folder = Folder::new("folder", &changed("scene = ", "scene = "));
    let broken = folder
        .text("scene.toml")
        .replace("dovetail72\"\nfriction", "nowhere\"\nfriction");
    std::fs::write(folder.0.join("scene.toml"), broken).unwrap();
    let ended = folder.study(&[]);
    assert!(
        ended.code == 2 && ended.stderr.contains("nowhere/"),
        "{}",
        ended.stderr
    );
    assert!(!Path::new(&folder.0.join("out")).exists());
}
