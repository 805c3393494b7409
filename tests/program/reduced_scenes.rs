//! Scenes about a reduced model: the program on them, scenes that it refuses, and reduction from a
//! mesh to a folder.

use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, printed, said, scene_command, told};
use crate::shared_runs::{manifest, number, numbers, rows, summary};
use dovetail_export::manifest::RunState;
use dovetail_testkit::folder::root;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

const JENKINS: &str = "scenes/verification/jenkins.toml";
const DEN_HARTOG: &str = "scenes/verification/den_hartog.toml";
const PAPER: &str = "scenes/paper.toml";

const DOVETAIL72: &str = r#"
name = "dovetail72"
[reduced_model]
folder = "tests/data/dovetail72"
friction = 0.3
force_n = 1.0
[damping]
ratio = 0.001
[response]
times_first_linear_mode = [0.99, 1.01]
points = 3
harmonics = 1
"#;

/// DOVETAIL72 with the path of its folder filled in.
fn dovetail72() -> String {
    DOVETAIL72.replace("tests/data", root().join("tests/data").to_str().unwrap())
}

#[test]
fn the_program_runs_the_jenkins_scene() {
    let folder = Folder::new("jenkins");
    ended(scene_command("run", JENKINS, &folder, &[]), 0);
    let summary = summary(&folder);
    let peak = summary["response"]["peak_amplitude_m"].as_f64().unwrap();
    assert!((peak / 1.95379955 - 1.0).abs() < 1e-6, "{peak}");
    assert_eq!(summary["mesh"], serde_json::Value::Null);
    assert_eq!(summary["pairs"], 1);
    assert_eq!(summary["stuck_modes"], 1);
    assert_eq!(summary["observations"][0]["name"], "tip");
    for file in [
        "contact.csv",
        "modes.csv",
        "plots/response_tip.svg",
        "response.csv",
        "static.csv",
    ] {
        assert!(!folder.text(file).is_empty(), "{file}");
    }
    // No area, no pressure; no number in their place.
    let pair = &rows(&folder.join("static.csv"))[0];
    let cell = |name: &str| pair[name].as_str();
    assert_eq!((cell("area_m2"), cell("pressure_pa")), ("", ""));
    assert_eq!((cell("normal_force_n"), cell("status")), ("1", "stuck"));
    assert!(!folder.join("static.vtu").exists() && !folder.join("flank.pvd").exists());
}

#[test]
fn a_frequency_that_takes_longer_than_is_allowed_is_given_up() {
    let folder = Folder::new("late");
    let set = [
        "response.most_seconds_per_frequency=1e-9",
        "response.frequency_hz=[1.0, 1.1]",
        "response.points=5",
    ];
    let stderr = told(scene_command("run", JENKINS, &folder, &set), 3);
    let warning = "at 5 of 5 frequencies (1.00000 to 1.10000 Hz) the search for a motion was given up after response.most_seconds_per_frequency";
    has(&stderr, warning);
    let response = &summary(&folder)["response"];
    assert_eq!(response["converged_points"], 0);
    for missed in response["unconverged"].as_array().unwrap() {
        assert_eq!(missed["outcome"], "time_limit");
    }
    assert_eq!(folder.text("response.csv").matches("time_limit").count(), 5);
}

/// The free mass has its resonance at 1 Hz and the stuck one at 1.22 Hz. A force that slides the
/// slider far has its peak near the first, so that a range around it ends before the linear peak.
#[test]
fn a_range_without_the_linear_peak_is_warned_of() {
    let said = |range: &str| {
        let folder = Folder::new("range");
        let range = format!("response.frequency_hz={range}");
        let set = [
            "reduced_model.force_n=1",
            range.as_str(),
            "response.points=15",
        ];
        let stderr = told(scene_command("run", JENKINS, &folder, &set), 0);
        assert!(!stderr.contains("largest amplitude of tip"), "{stderr}");
        stderr
    };
    let warning = "the largest linear amplitude of tip is at an end of the range, 1.150 Hz & \
                   (the nearest linear mode lies at ";
    let narrow = said("[0.8, 1.15]");
    has(&narrow, warning);
    let wide = said("[0.8, 1.4]");
    assert!(!wide.contains("largest linear amplitude"), "{wide}");
}

/// Scene of a mass before a stop.
const STOP: &str = r#"
name = "stop"
[reduced_model]
folder = "stop"
friction = 0
gap_m = 1
force_n = 0.1
[damping]
mass_per_s = 0.03
[response]
frequency_hz = [0.12, 0.32]
harmonics = 7
"#;

/// Writes 1 kg on a spring of 1 N/m, with a stop on a spring of 5 N/m behind a clearance, as a
/// reduced model. X opens the pair of both; with X = 0 both springs carry the mass.
fn write_stop(folder: &Path) {
    let (of_x, both_n_m) = (-5.0 / 6.0, 6.0);
    let along = || vec![of_x, 0.0, 0.0];
    let diagonal = |first: f64| vec![first, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    write_model(
        folder,
        &[
            ("positions", 3, vec![0.0; 3]),
            ("stiffness", 3, diagonal(-of_x)),
            ("mass", 3, diagonal(of_x * of_x)),
            ("coupling", 1, along()),
            ("squared_frequencies", 1, vec![both_n_m]),
            ("static_load", 1, vec![0.0; 3]),
            ("excitations", 1, along()),
            ("excitations_on_modes", 1, vec![1.0]),
            ("observed_points", 1, along()),
            ("observed_points_on_modes", 1, vec![1.0]),
        ],
    );
}

/// Writes the arrays of a reduced model: the name of each, its columns and its entries.
pub fn write_model(folder: &Path, arrays: &[(&str, usize, Vec<f64>)]) {
    std::fs::create_dir(folder).unwrap();
    let rows = |of: &str| {
        let found = arrays.iter().find(|(file, ..)| *file == of);
        found.map_or(0, |(_, columns, entries)| entries.len() / columns)
    };
    let (pairs, modes) = (rows("positions"), rows("squared_frequencies"));
    let described = format!(
        r#"{{"format": "reduced model of dovetail",
            "units": {{"length": "m", "mass": "kg", "time": "s", "force": "N"}},
            "pairs": {pairs}, "modes": {modes}, "contacts": [{{"name": "pairs", "pairs": {pairs}}}],
            "excitations": [{{"name": "f", "harmonic": 1, "amplitude": 1.0, "phase_rad": 0.0}}],
            "observed_points": ["tip"]}}"#
    );
    std::fs::write(folder.join("model.json"), described).unwrap();
    for (file, columns, entries) in arrays {
        let rows = entries.len() / columns;
        let lines: String = entries.iter().map(|entry| format!("{entry:?}\n")).collect();
        let text = format!("%%MatrixMarket matrix array real general\n{rows} {columns}\n{lines}");
        std::fs::write(folder.join(file).with_extension("mtx"), text).unwrap();
    }
}

/// Scene of [`write_stop`] in a folder.
pub fn stop_scene(folder: &Folder) -> PathBuf {
    write_stop(&folder.join("stop"));
    folder.write("scene.toml", STOP)
}

/// Over the force and over the clearance the mass has the same three motions at 0.1 N and 1 m. The
/// largest of them is the one that its response over the frequency comes to first, and the least is
/// that without the stop.
#[test]
fn curves_over_force_and_clearance_have_the_motions_of_the_response_between_its_folds() {
    let folder = Folder::new("stop-curve");
    let scene = stop_scene(&folder);
    // The response is followed to the middle of its range from both ends.
    let run = folder.join("run");
    let set = ["response.frequency_hz=[0.12, 0.26]"];
    ended(scene_command("run", &scene, &run, &set), 0);
    let of_run = rows(&run.join("response.csv")).into_iter();
    let middle = of_run.filter(|row| (number(row, "frequency_hz") - 0.19).abs() < 1e-12);
    let followed: Vec<f64> = middle.map(|row| number(&row, "tip_amplitude_m")).collect();
    let w = std::f64::consts::TAU * 0.19;
    let linear_m = 0.1 / (1.0 - w * w).hypot(0.03 * w);
    let expected = [linear_m, followed[0]];
    for (key, range, word, at) in [
        ("reduced_model.force_n", "0.01:1:3", "force", 0.1),
        ("reduced_model.gap_m", "0.2:5:3", "gap", 1.0),
    ] {
        let out = folder.join(word);
        let mut command = scene_command("curve", &scene, &out, &[]);
        command.args(["--over", &format!("{key}={range}"), "--frequency", "0.19"]);
        let said = printed(&ended(command, 0));
        assert_eq!(
            said.matches(&format!("fold at {word}")).count(),
            2,
            "{said}"
        );
        has(&said, &format!("several motions from {word}"));
        let table = rows(&out.join("curve.csv")).into_iter();
        let mut three: Vec<(f64, String)> = table
            .filter(|row| (number(row, key) / at - 1.0).abs() < 1e-12)
            .map(|row| (number(&row, "amplitude_m"), row["stable"].clone()))
            .collect();
        three.sort_by(|a, b| a.0.total_cmp(&b.0));
        let stable: Vec<&str> = three.iter().map(|motion| &motion.1[..]).collect();
        // The motion with the least amplitude stays away from the stop, which is rigid: landings are
        // not judged.
        assert_eq!(stable, ["yes", "no", "not_judged"], "{key}");
        for (found, expected) in [three[0].0, three[2].0].iter().zip(&expected) {
            assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
        }
        let found = summary(&out);
        assert_eq!(found["curve"]["folds"].as_array().unwrap().len(), 2);
        let several = &found["curve"]["several"][0];
        assert!(several["from"].as_f64().unwrap() < at && several["to"].as_f64().unwrap() > at);
        let picture = std::fs::read_to_string(out.join("plots/curve_amplitude.svg")).unwrap();
        has(&picture, "unstable");
    }
}

/// From 5 % more than the motion between both folds, steps in time go over to one of the others,
/// and from 5 % more than those they come back. The stop has no mass, and is the spring of the
/// contact here.
#[test]
fn steps_in_time_leave_the_motion_that_is_unstable_and_return_to_the_others() {
    let folder = Folder::new("verified-fold");
    let stop = folder.join("stop");
    let diagonal = || vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    write_model(
        &stop,
        &[
            ("positions", 3, vec![0.0; 3]),
            ("stiffness", 3, diagonal()),
            ("mass", 3, diagonal()),
            ("static_load", 1, vec![0.0; 3]),
            ("excitations", 1, vec![1.0, 0.0, 0.0]),
            ("observed_points", 1, vec![1.0, 0.0, 0.0]),
        ],
    );
    let springs = "normal_stiffness_n_m = 5\ntangential_stiffness_n_m = 5\n";
    let text = STOP.replace("gap_m", &format!("{springs}gap_m"));
    let scene = folder.write("scene.toml", text);
    let out = folder.join("out");
    let mut command = scene_command("verify", &scene, &out, &["response.harmonics=21"]);
    command.args(["--at", "0.185", "--perturb", "0.05"]);
    let printed = printed(&ended(command, 0));
    has(
        &printed,
        ", an unstable motion, which the integration leaves",
    );
    let table = rows(&out.join("verify.csv"));
    let cells = |method: &str, column: &str| -> Vec<String> {
        let rows = table.iter().filter(|row| row["method"] == method);
        rows.map(|row| row[column].clone()).collect()
    };
    assert_eq!(cells("balance", "stable"), ["yes", "no", "yes"]);
    let amplitudes = |method: &str| -> Vec<f64> {
        let cells = cells(method, "amplitude_m");
        cells.iter().map(|cell| cell.parse().unwrap()).collect()
    };
    let (balance, by_time) = (amplitudes("balance"), amplitudes("integration"));
    let is_near = |a: f64, b: f64| (a / b - 1.0).abs() < 0.01;
    assert!(is_near(by_time[0], balance[0]) && is_near(by_time[2], balance[2]));
    assert!([0, 2].iter().any(|i| is_near(by_time[1], balance[*i])));
    let verified = &summary(&out)["verification"];
    assert_eq!(verified["points"][1]["stable"], false);
    assert!(verified["worst_difference"].as_f64().unwrap() < 0.01);
}

/// The stop has no mass of its own: the motion in time rings ever more.
#[test]
fn a_motion_in_time_that_grows_without_bound_is_an_error() {
    let folder = Folder::new("grows");
    let scene = stop_scene(&folder);
    let mut command = scene_command("verify", &scene, &folder.join("out"), &[]);
    command.args(["--at", "0.185"]);
    has(&told(command, 1), "the motion grew without bound in period");
}

/// Two motions from 0.17 to 0.2 Hz. A grid knows of the jump alone.
#[test]
fn a_fold_is_told_wherever_results_are_read() {
    let folder = Folder::new("fold");
    let scene = stop_scene(&folder);
    let stderr = told(
        scene_command("run", &scene, &folder.join("followed"), &[]),
        0,
    );
    let found = summary(&folder.join("followed"));
    let [two] = &found["response"]["second_motion"].as_array().unwrap()[..] else {
        panic!("{found}");
    };
    let figure = |key: &str| two[key].as_f64().unwrap();
    let [from_hz, to_hz] = ["from_hz", "to_hz"].map(figure);
    // The small motion ends where it reaches the stop: (1 - w^2)^2 + (0.03 w)^2 = 0.1^2.
    assert!((from_hz - 0.166_539).abs() < 5e-5, "{two}");
    assert!((to_hz - 0.2016).abs() < 5e-4, "{two}");
    assert!(figure("amplitude_m") > 1.5 * figure("other_amplitude_m"));
    let words = format!("from {from_hz:.4} to {to_hz:.4} Hz several motions were found");
    has(&stderr, &words);
    assert!(!stderr.contains("jumps between"), "{stderr}");
    assert!(!stderr.contains("all there is between them"), "{stderr}");
    has(
        &stderr,
        "those on the dashed part of the curve are unstable",
    );
    // Both folds end the range of several motions, and the rows between them are unstable.
    let folds = found["response"]["folds"].as_array().unwrap();
    let row = |fold: &serde_json::Value| fold["row"].as_u64().unwrap() as usize;
    let ends: Vec<f64> = folds
        .iter()
        .map(|f| f["frequency_hz"].as_f64().unwrap())
        .collect();
    assert_eq!(ends, [to_hz, from_hz]);
    let table = rows(&folder.join("followed/response.csv"));
    for (at, found) in table.iter().enumerate() {
        let is_between = at > row(&folds[0]) && at < row(&folds[1]);
        // The stop is rigid: motions that land on it are not judged, and only the folds tell.
        let lands = found["open_pairs"] == "0";
        let stable = match (is_between, lands) {
            (true, _) => "no",
            (false, true) => "not_judged",
            (false, false) => "yes",
        };
        assert_eq!(found["stable"], stable, "row {at}");
    }
    assert_eq!(found["response"]["bifurcations"], serde_json::json!([]));
    let peak = &found["response"]["peak_stability"];
    assert_eq!(
        peak["not_judged"], "rigid pairs open and land with much of the kinetic energy",
        "{peak}"
    );
    has(
        &stderr,
        "the stability of the peak of tip was not judged: rigid pairs open and land with much of the kinetic energy",
    );
    let amplitude: f64 = table[row(&folds[0])]["tip_amplitude_m"].parse().unwrap();
    assert_eq!(folds[0]["amplitude_m"], amplitude);
    has(
        &folder.text("followed/plots/response_tip.svg"),
        "with 7 harmonics, unstable",
    );
    let report = folder.text("followed/report.html");
    has(
        &report,
        "Where the curve is dashed, the motion is unstable: the structure leaves it.",
    );
    let line = report
        .split("<li")
        .find(|item| item.contains("there are several motions"));
    let line = line.expect("the report tells of several motions");
    assert!(line.contains("<b>look</b>"), "{line}");

    let grid = ["response.frequency_hz=[0.12, 0.26]", "response.points=57"];
    let stderr = told(scene_command("run", &scene, &folder.join("grid"), &grid), 0);
    has(&stderr, "the amplitude of tip jumps between 0.1");
    assert!(!stderr.contains("several motions"), "{stderr}");
    let found = summary(&folder.join("grid"));
    assert_eq!(found["response"]["second_motion"], serde_json::json!([]));
    assert_eq!(found["response"]["folds"], serde_json::json!([]));
    let table = rows(&folder.join("grid/response.csv"));
    assert!(table.iter().all(|row| match &row["open_pairs"][..] {
        "0" => row["stable"] == "not_judged",
        _ => row["stable"] == "yes",
    }));
}

/// The steady load closes 1 m of the clearance. The mass is then on its own spring.
#[test]
fn a_slider_that_is_open_at_rest_leaves_the_free_mass() {
    let folder = Folder::new("open");
    let set = ["reduced_model.gap_m=2", "reduced_model.force_n=1e-3"];
    let stderr = told(scene_command("run", JENKINS, &folder, &set), 0);
    let summary = summary(&folder);
    assert_eq!(summary["static"]["open_pairs"], 1);
    let hz = summary["linear_frequency_hz"].as_f64().unwrap();
    assert!((hz - 1.0).abs() < 1e-9, "{hz} Hz");
    has(&stderr, "open at rest");
}

/// Each way that is tried has a line, and no line has more than the whole.
#[test]
fn verbose_progress_says_what_is_tried_and_stays_below_the_whole() {
    let folder = Folder::new("verbose");
    let set = [
        "response.frequency_hz=[0.6, 1.35]",
        "response.points=9",
        "response.harmonics=3",
        "damping.mass_per_s=0.2",
    ];
    let mut program = scene_command("run", DEN_HARTOG, &folder, &set);
    let said = said(program.arg("--verbose").output().as_ref().unwrap());
    has(&said, "Hz: 3 harmonics, from the static state");
    has(&said, "Hz: 3 harmonics, from the neighbour");
    for line in said.lines().filter(|line| line.contains("frequencies: ")) {
        let share = line.split(" (").nth(1).and_then(|s| s.split(' ').next());
        assert!(share.unwrap().parse::<u32>().unwrap() <= 100, "{line}");
    }
}

/// Numbers of the attribute `name` of each element `tag` of an SVG, in order.
fn attributes(svg: &str, tag: &str, name: &str) -> Vec<Vec<f64>> {
    let lines = svg.lines().filter(|l| l.starts_with(&format!("<{tag} ")));
    let texts = lines.filter_map(|l| l.split(&format!(" {name}=\"")).nth(1)?.split('"').next());
    let numbers = |text: &str| -> Vec<f64> {
        let words = text.split([',', ' ']).filter(|w| !w.is_empty());
        words.map(|w| w.parse().unwrap()).collect()
    };
    texts.map(numbers).collect()
}

/// Rigid friction at 0.75 Hz needs more harmonics for this accuracy than are allowed, beside it
/// fewer.
#[test]
fn an_accuracy_that_is_not_reached_is_a_result_that_is_marked_wherever_it_is_seen() {
    let folder = Folder::new("accuracy");
    let set = [
        "response.harmonics=",
        "response.samples=",
        "response.accuracy=0.0155",
        "response.frequency_hz=[0.6, 0.9]",
        "response.points=3",
    ];
    let stderr = told(scene_command("run", DEN_HARTOG, &folder, &set), 3);
    let warning =
        "warning: at 1 of 3 frequencies (0.750000 Hz) the error is estimated above the accuracy";
    has(&stderr, warning);

    let rows = rows(&folder.join("response.csv"));
    let outcomes = rows.iter().map(|row| row["outcome"].as_str());
    let inaccurate = ["converged", "accuracy_not_reached", "converged"];
    assert_eq!(outcomes.collect::<Vec<_>>(), inaccurate);
    let number = |row: usize, name: &str| number(&rows[row], name);
    assert_eq!(number(1, "frequency_hz"), 0.75);
    assert_eq!(number(1, "harmonics"), 31.0);
    for (row, is_above) in [false, true, false].into_iter().enumerate() {
        let estimated = number(row, "estimated_error");
        assert_eq!(estimated, number(row, "tip_estimated_error"));
        assert_eq!(estimated > 0.0155, is_above, "{row}: {estimated}");
    }
    let [low, middle, high] = [0, 1, 2].map(|row| number(row, "tip_amplitude_m"));
    assert!(low < middle && middle < high, "{low} {middle} {high}");

    let response = &summary(&folder)["response"];
    assert_eq!(response["points"], 3);
    assert_eq!(response["converged_points"], 2);
    assert_eq!(response["accuracy_not_reached_points"], 1);
    let missed = &response["unconverged"];
    assert_eq!(missed.as_array().unwrap().len(), 1);
    assert_eq!(
        (&missed[0]["row"], &missed[0]["outcome"]),
        (&1.into(), &"accuracy_not_reached".into())
    );

    let svg = folder.text("plots/response_tip.svg");
    // Without the dashes of the linear curve.
    let solid = svg.lines().filter(|l| !l.contains("stroke-dasharray"));
    let solid: Vec<&str> = solid.collect();
    let lines = attributes(&solid.join("\n"), "polyline", "points");
    let rises = |l: &&Vec<f64>| l.len() == 6 && l[1] > l[3] && l[3] > l[5];
    let curve = lines.iter().find(rises).expect("the curve");
    let [x, y] = ["cx", "cy"].map(|name| attributes(&svg, "circle", name).concat());
    let is_marked = |point: &[f64]| {
        x.iter()
            .zip(&y)
            .any(|at| (*at.0, *at.1) == (point[0], point[1]))
    };
    let marked: Vec<bool> = curve.chunks(2).map(is_marked).collect();
    assert_eq!(marked, [false, true, false]);
    assert!(svg.contains(": accuracy not reached at 1 point\n"));
}

#[test]
fn every_command_does_what_it_can_on_a_reduced_model() {
    let folder = Folder::new("commands");
    let scene = folder.write("scene.toml", dovetail72());
    let out = folder.join("out");
    has(
        &told(scene_command("check", &scene, &out, &[]), 0),
        "is sound",
    );
    assert!(!out.exists());
    let listed = printed(&ended(scene_command("modes", &scene, &out, &[]), 0));
    assert!(listed.starts_with("stuck"), "{listed}");
    has(
        &told(scene_command("static", &scene, &out, &[]), 0),
        "72 contact pairs",
    );
    for command in ["mesh", "reduce"] {
        has(
            &told(scene_command(command, &scene, &out, &[]), 2),
            "has no mesh",
        );
    }
    let set = [
        "response.stuck_modes=5",
        "response.compare_harmonics=1",
        "response.harmonics=2",
    ];
    ended(scene_command("run", &scene, &out, &set), 0);
    let summary = summary(&out);
    assert_eq!(summary["stuck_modes"], 5);
    assert_eq!(summary["static"]["slipping_pairs"], 72);
    assert!(out.join("response_h1.csv").exists());
}

#[test]
fn a_mesh_and_a_reduced_model_exclude_each_other() {
    let folder = Folder::new("both");
    let paper = paper_at_any_place();
    let both = format!("{paper}\n[reduced_model]\nfolder = \"x\"\nfriction = 0.3\nforce_n = 1\n");
    let scene = folder.write("scene.toml", both);
    let stderr = told(scene_command("check", &scene, &folder, &[]), 2);
    for section in [
        "mesh",
        "body",
        "rotation",
        "contact",
        "excitation",
        "observe",
    ] {
        let words = format!("`reduced_model` and `{section}` exclude each other");
        has(&stderr, &words);
    }
    has(&stderr, "keep [reduced_model] alone");
    // Without it the scene is the paper's.
    ended(
        scene_command("check", &scene, &folder, &["reduced_model="]),
        0,
    );
}

#[test]
fn what_a_folder_lacks_is_said() {
    let folder = Folder::new("lacks");
    let den_hartog = |command: &str, set: &str, words: &str| {
        let wrong = scene_command(command, DEN_HARTOG, &folder.join("out"), &[set]);
        has(&told(wrong, 2), words);
    };
    let words = "damping.ratio & has none & damping.stiffness_s & damping.mass_per_s";
    den_hartog("run", "damping.ratio=0.001", words);
    let words = "response.times_first_linear_mode & no mode to count from & response.frequency_hz";
    let range = "response.times_first_linear_mode=[0.9, 1.1]";
    den_hartog("run", range, words);
    for command in ["check", "static"] {
        let words = "nowhere/model.json & No such file";
        den_hartog(command, "reduced_model.folder=nowhere", words);
    }
    let scene = "name = \"x\"\n[reduced_model]\nfriction = -1\n[damping]\nmass_per_s = 0\n";
    let scene = folder.write("scene.toml", scene);
    let told = told(scene_command("check", scene, &folder, &[]), 2);
    let words = "`reduced_model.friction` is -1 & 0 or more & `reduced_model.folder` is missing \
                 & `reduced_model.force_n` is missing & no [response]";
    has(&told, words);
    assert!(!told.contains("no [mesh]"), "{told}");
}

/// Text of scenes/paper.toml with absolute paths.
fn paper_at_any_place() -> String {
    let paper = std::fs::read_to_string(root().join(PAPER)).unwrap();
    paper.replace("../", &format!("{}/", root().display()))
}

/// Runs `dovetail reduce` into a folder; returns those lines of its output that can be used in a
/// scene.
fn reduce(scene: impl AsRef<OsStr>, out: &Path, set: &[&str]) -> String {
    let stderr = said(&ended(scene_command("reduce", scene, out, set), 0));
    let lines = stderr.lines().skip_while(|l| *l != "[reduced_model]");
    let is_key = |l: &&str| l.starts_with('[') || l.contains(" = ");
    let keys: Vec<&str> = lines.take_while(is_key).collect();
    assert_eq!(keys.len(), 5, "{stderr}");
    keys.join("\n")
}

/// Scene with the output of [`reduce`], on the two frequencies of `TWO_POINTS`.
fn scene_of(keys: &str) -> String {
    format!(
        "name = \"again\"\n{keys}\n[damping]\nratio = 0.001\n[response]\n\
         times_first_linear_mode = [0.98, 1.02]\npoints = 2\nharmonics = 1\n"
    )
}

const LINEAR_MESH: &str = "mesh.file=../meshes/dovetail_order1.msh";
const TWO_POINTS: [&str; 4] = [
    LINEAR_MESH,
    "response.points=2",
    "response.compare_harmonics=",
    "response.harmonics=1",
];

/// The reduced model written by `dovetail reduce` gives, number for number, the response of its
/// mesh.
#[test]
fn a_reduced_mesh_vibrates_like_the_mesh() {
    let (meshed, again) = (Folder::new("meshed"), Folder::new("again"));
    ended(scene_command("run", PAPER, &meshed, &TWO_POINTS), 0);
    let keys = reduce(PAPER, &again.join("model"), &[LINEAR_MESH]);
    has(&keys, "friction = 0.3\ngap_m = 0.0\nforce_n = 2.0");
    let scene = again.write("scene.toml", scene_of(&keys));
    ended(scene_command("run", &scene, &again, &[]), 0);
    assert_eq!(meshed.text("response.csv"), again.text("response.csv"));
    // The tables of the pairs as well, but for the nodes and the name of the contact.
    let from_place = |folder: &Folder, file: &str| -> Vec<String> {
        let text = folder.text(file);
        let (head, _) = text.split_once('\n').unwrap();
        let x = head.split(',').position(|h| h == "x_m").unwrap();
        let from_x = |line: &str| line.splitn(x + 1, ',').last().unwrap().to_owned();
        text.lines().map(from_x).collect()
    };
    for file in ["static.csv", "contact.csv"] {
        assert_eq!(
            from_place(&meshed, file),
            from_place(&again, file),
            "{file}"
        );
    }
}

/// `dovetail reduce` lists its files. It refuses the folder of another scene, and a folder beside
/// whose run the files do not belong.
#[test]
fn the_folder_of_a_reduced_model_is_whole_and_its_own() {
    let folder = Folder::new("own");
    reduce(PAPER, &folder, &[LINEAR_MESH]);
    let of_reduce = manifest(&folder);
    assert_eq!(of_reduce.state, RunState::Finished);
    let listed = of_reduce.files;
    let entries = std::fs::read_dir(&*folder).unwrap();
    let mut there: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    there.retain(|name| name != "summary.json" && name != ".lock");
    there.sort();
    assert_eq!(there, listed);
    for file in ["stiffness.mtx", "positions.mtx"] {
        assert!(listed.iter().any(|f| f == file), "{file}");
    }
    let stiffness = folder.text("stiffness.mtx");
    let other = scene_command("reduce", PAPER, &folder, &[LINEAR_MESH, "name=other"]);
    has(&told(other, 2), "holds a run of the scene \"paper\"");
    assert_eq!(folder.text("stiffness.mtx"), stiffness);
    // Beside a run its files belong where the settings are the same.
    let beside = Folder::new("beside");
    ended(scene_command("run", PAPER, &beside, &TWO_POINTS), 0);
    let differs = scene_command("reduce", PAPER, &beside, &[LINEAR_MESH]);
    has(&told(differs, 2), "with other settings");
    reduce(PAPER, &beside, &TWO_POINTS);
    let of_both = manifest(&beside);
    assert!(of_both.response.unwrap().first.peak_amplitude_m.is_some());
    assert!(of_both.files.iter().any(|file| file == "stiffness.mtx"));
}

/// The folder is for 1 N whatever the forces of the scene are, and the output gives the amplitudes
/// of `run`.
#[test]
fn reduce_and_then_run_gives_the_amplitudes_of_run() {
    let paper = paper_at_any_place();
    let second =
        "[[excitation]]\non = \"tip_trailing_edge\"\ndirection = [1, 0, 0]\nforce_n = 0.4\n";
    let mesh = root().join("meshes/dovetail_order1.msh");
    let mesh = format!("mesh.file={}", mesh.display());
    let mut forces_of_paper = Vec::new();
    for (name, text, force) in [
        ("2 N", paper.clone(), "excitation.0.force_n=2"),
        ("0.7 N", paper.clone(), "excitation.0.force_n=0.7"),
        ("none", paper.clone(), "excitation.0.force_n=0"),
        (
            "two",
            format!("{paper}\n{second}"),
            "excitation.0.force_n=1.1",
        ),
    ] {
        let folder = Folder::new(&format!("forces-{}", name.replace(' ', "-")));
        let scene = folder.write("scene.toml", text);
        let set = [&[&mesh[..], force], &TWO_POINTS[1..]].concat();
        ended(scene_command("run", &scene, &folder, &set), 0);
        let amplitudes_m = |file: &str| numbers(&folder.join(file), "tip_amplitude_m");
        let of_mesh = amplitudes_m("response.csv");
        let keys = reduce(&scene, &folder.join("model"), &[&mesh, force]);
        let again = folder.write("scene.toml", scene_of(&keys));
        ended(scene_command("run", &again, &folder.join("out"), &[]), 0);
        for (a, b) in of_mesh.iter().zip(amplitudes_m("out/response.csv")) {
            assert!((a - b).abs() <= 1e-9 * a.abs(), "{name}: {a} m, {b} m");
        }
        if name != "two" {
            forces_of_paper.push(folder.text("model/excitations.mtx"));
        }
    }
    assert!(forces_of_paper.iter().all(|f| *f == forces_of_paper[0]));
}

/// Two excitations of other harmonics and phases, and two observed points, go through the folder.
#[test]
fn a_folder_has_every_excitation_and_point() {
    let folder = Folder::new("several");
    let more = "[[excitation]]\non = \"tip_trailing_edge\"\ndirection = [1, 0, 0]\nforce_n = 0.4\n\
                harmonic = 3\nphase_deg = 40\n\
                [[observe]]\nname = \"edge\"\npoints = \"tip_trailing_edge\"\ndirection = [1, 0, 0]\n";
    let scene = format!("{}\n{more}", paper_at_any_place());
    let scene = folder.write("scene.toml", scene);
    let mesh = root().join("meshes/dovetail_order1.msh");
    let mesh = format!("mesh.file={}", mesh.display());
    let phase = "excitation.0.phase_deg=30";
    let three = "response.harmonics=3";
    let set = [&[&mesh[..], phase, three], &TWO_POINTS[1..3]].concat();
    ended(scene_command("run", &scene, &folder, &set), 0);
    let keys = reduce(&scene, &folder.join("model"), &[&mesh, phase]);
    let again = scene_of(&keys).replace("harmonics = 1", "harmonics = 3");
    let again = folder.write("scene.toml", again);
    ended(scene_command("run", &again, &folder.join("out"), &[]), 0);
    for column in ["tip_amplitude_m", "edge_amplitude_m", "edge_h3_phase_rad"] {
        let values = |file: &str| numbers(&folder.join(file), column);
        let of_mesh = values("response.csv");
        assert_eq!(of_mesh.len(), 2);
        for (a, b) in of_mesh.iter().zip(values("out/response.csv")) {
            assert!((a - b).abs() <= 1e-6 * a.abs(), "{column}: {a}, {b}");
        }
    }
    let described = folder.text("model/model.json");
    has(
        &described,
        "\"harmonic\": 3 & \"tip_trailing_edge\" & \"edge\" & \"length\": \"m\"",
    );
}

/// The lines of docs/how-to/reduced_model.md by which numpy reads a folder.
#[test]
fn numpy_reads_a_folder_by_the_lines_of_the_guide() {
    let guide = std::fs::read_to_string(root().join("docs/how-to/reduced_model.md")).unwrap();
    let code = guide.split("```python\n").nth(1).unwrap();
    let code = code.split("```").next().unwrap();
    let folder = root().join("tests/data/dovetail72");
    let code = code.replace("my_matrices", &folder.display().to_string());
    let check = "k = matrices['stiffness']\n\
                 assert k.shape == (216, 216) and abs(k - k.T).max() < 1e-6 * k.max()\n\
                 assert matrices['excitations'].shape == (216, 1) and model['pairs'] == 72\n\
                 assert k.trace() > 0 and matrices['positions'].shape == (72, 3)\n";
    let python = std::env::var_os("DOVETAIL_PYTHON");
    let python = python.map_or_else(|| root().join("target/venv/bin/python"), PathBuf::from);
    let ran = Command::new(&python)
        .args(["-c", &format!("{code}\n{check}")])
        .output();
    let ran = ran.unwrap_or_else(|e| {
        panic!(
            "{}: {e}; `tools/setup.sh python` makes it",
            python.display()
        )
    });
    assert!(
        ran.status.success(),
        "{}",
        String::from_utf8_lossy(&ran.stderr)
    );
}

/// Headers that announce more data than there is are refused at once, as are a stiffness and a mass
/// that no body has.
#[test]
fn a_folder_is_believed_only_as_far_as_it_goes() {
    let folder = Folder::new("believed");
    let reference = root().join("tests/data/dovetail72");
    let scene = folder.write(
        "scene.toml",
        DOVETAIL72.replace("tests/data/dovetail72", "model"),
    );
    std::fs::create_dir(folder.join("model")).unwrap();
    for file in std::fs::read_dir(&reference).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), folder.join("model").join(file.file_name())).unwrap();
    }
    let header = "%%MatrixMarket matrix array real general";
    let diagonal = |value: f64| {
        let entry = |k: usize| if k / 216 == k % 216 { value } else { 0.0 };
        let entries: String = (0..216 * 216).map(|k| format!("{}\n", entry(k))).collect();
        format!("{header}\n216 216\n{entries}")
    };
    for (file, text, words) in [
        (
            "stiffness.mtx",
            format!("{header}\n90000 90000\n1\n2\n"),
            "90000 x 90000",
        ),
        (
            "coupling.mtx",
            format!("{header}\n0 18446744073709551615\n"),
            "0 x 18446744073709551615",
        ),
        (
            "positions.mtx",
            format!("{header}\n30000000 3\n0\n"),
            "30000000 x 3",
        ),
        (
            "stiffness.mtx",
            diagonal(-1.0),
            "lowest eigenvalue of the stiffness is -1.000e0 N",
        ),
        ("mass.mtx", diagonal(0.0), "M - p p^T"),
    ] {
        let path = folder.join("model").join(file);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &text).unwrap();
        let told = told(scene_command("check", &scene, &folder.join("out"), &[]), 2);
        std::fs::write(&path, whole).unwrap();
        has(&told, &format!("{words} & {file}"));
    }
    ended(scene_command("check", &scene, &folder.join("out"), &[]), 0);
}
