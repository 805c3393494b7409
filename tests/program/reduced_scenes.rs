//! Scenes about a reduced model: the program on them, scenes that it refuses, and reduction from a
//! mesh to a folder.

use crate::shared_folder;
use crate::shared_program::said_in_one_line;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder for one test, removed at its end.
struct Folder(shared_folder::Folder);

impl Folder {
    fn new(name: &str) -> Self {
        Self(shared_folder::Folder::new(name))
    }
    fn path(&self, file: &str) -> PathBuf {
        self.0.join(file)
    }
    fn text(&self, file: &str) -> String {
        let path = self.path(file);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }
    /// Writes a scene file into the folder.
    fn scene(&self, text: &str) -> PathBuf {
        let path = self.path("scene.toml");
        std::fs::write(&path, text).unwrap();
        path
    }
}

/// Runs the program from the root of the repository; returns the exit code, standard output, and
/// standard error on one line.
fn dovetail(command: &str, scene: &Path, out: &Path, set: &[&str]) -> (i32, String, String) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program.current_dir(env!("CARGO_MANIFEST_DIR"));
    program.arg(command).arg(scene).arg("--out").arg(out);
    for set in set {
        program.args(["--set", set]);
    }
    let output = program.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let stderr = said_in_one_line(&output);
    (output.status.code().unwrap(), text(&output.stdout), stderr)
}

fn json(folder: &Folder) -> serde_json::Value {
    serde_json::from_str(&folder.text("summary.json")).unwrap()
}

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
    let root = env!("CARGO_MANIFEST_DIR");
    DOVETAIL72.replace("tests/data", &format!("{root}/tests/data"))
}

#[test]
fn the_program_runs_the_jenkins_scene() {
    let folder = Folder::new("jenkins");
    let scene = Path::new("scenes/verification/jenkins.toml");
    let (code, _, stderr) = dovetail("run", scene, &folder.0, &[]);
    assert_eq!(code, 0, "{stderr}");
    let summary = json(&folder);
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
    let table = folder.text("static.csv");
    let mut lines = table.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let (header, row) = (lines.next().unwrap(), lines.next().unwrap());
    let cell = |name: &str| row[header.iter().position(|h| *h == name).unwrap()];
    assert_eq!((cell("area_m2"), cell("pressure_pa")), ("", ""));
    assert_eq!((cell("normal_force_n"), cell("status")), ("1", "stuck"));
    assert!(!folder.path("static.vtu").exists() && !folder.path("flank.pvd").exists());
}

#[test]
fn a_frequency_that_takes_longer_than_is_allowed_is_given_up() {
    let folder = Folder::new("late");
    let scene = Path::new("scenes/verification/jenkins.toml");
    let set = [
        "response.most_seconds_per_frequency=1e-9",
        "response.frequency_hz=[1.0, 1.1]",
        "response.points=5",
    ];
    let (code, _, stderr) = dovetail("run", scene, &folder.0, &set);
    assert_eq!(code, 3, "{stderr}");
    let warning = "5 of 5 frequencies were given up after response.most_seconds_per_frequency";
    assert!(stderr.contains(warning), "{stderr}");
    let response = &json(&folder)["response"];
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
    let scene = Path::new("scenes/verification/jenkins.toml");
    let said = |range: &str| {
        let folder = Folder::new("range");
        let range = format!("response.frequency_hz={range}");
        let set = [
            "reduced_model.force_n=1",
            range.as_str(),
            "response.points=15",
        ];
        let (code, _, stderr) = dovetail("run", scene, &folder.0, &set);
        assert_eq!(code, 0, "{stderr}");
        assert!(!stderr.contains("largest amplitude of tip"), "{stderr}");
        stderr
    };
    let warning = "the largest linear amplitude of tip is at an end of the range, 1.150 Hz";
    let narrow = said("[0.8, 1.15]");
    assert!(narrow.contains(warning), "{narrow}");
    let wide = said("[0.8, 1.4]");
    assert!(!wide.contains("largest linear amplitude"), "{wide}");
}

/// Writes 1 kg on a spring of 1 N/m, with a stop on a spring of 5 N/m behind a clearance, as a
/// reduced model. X opens the pair of both; with X = 0 both springs carry the mass.
fn write_stop(folder: &Path) {
    let (of_x, both_n_m) = (-5.0 / 6.0, 6.0);
    let along = || vec![of_x, 0.0, 0.0];
    let diagonal = |first: f64| vec![first, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    std::fs::create_dir(folder).unwrap();
    for (file, columns, entries) in [
        ("xyz", 3, vec![0.0; 3]),
        ("K", 3, diagonal(-of_x)),
        ("M", 3, diagonal(of_x * of_x)),
        ("p", 1, along()),
        ("w2", 1, vec![both_n_m]),
        ("f_static", 1, vec![0.0; 3]),
        ("f_excitation", 1, along()),
        ("fm_excitation", 1, vec![1.0]),
        ("tip_x", 1, along()),
        ("tip_modes", 1, vec![1.0]),
    ] {
        let rows = entries.len() / columns;
        let lines: String = entries.iter().map(|entry| format!("{entry:?}\n")).collect();
        let text = format!("%%MatrixMarket matrix array real general\n{rows} {columns}\n{lines}");
        std::fs::write(folder.join(file).with_extension("mtx"), text).unwrap();
    }
}

/// Two motions from 0.17 to 0.2 Hz. A grid knows of the jump alone.
#[test]
fn a_fold_is_told_wherever_results_are_read() {
    let folder = Folder::new("fold");
    write_stop(&folder.path("stop"));
    let scene = folder.scene(
        "name = \"stop\"\n[reduced_model]\nfolder = \"stop\"\n\
         friction = 0\ngap_m = 1\nforce_n = 0.1\n\
         [damping]\nmass_per_s = 0.03\n[response]\nfrequency_hz = [0.12, 0.32]\nharmonics = 7\n",
    );
    let (code, _, stderr) = dovetail("run", &scene, &folder.path("followed"), &[]);
    assert_eq!(code, 0, "{stderr}");
    let summary: serde_json::Value =
        serde_json::from_str(&folder.text("followed/summary.json")).unwrap();
    let [two] = &summary["response"]["second_motion"].as_array().unwrap()[..] else {
        panic!("{summary}");
    };
    let figure = |key: &str| two[key].as_f64().unwrap();
    let [from_hz, to_hz] = ["from_hz", "to_hz"].map(figure);
    assert!((from_hz - 0.170).abs() < 3e-3, "{two}");
    assert!((to_hz - 0.200).abs() < 3e-3, "{two}");
    assert!(figure("amplitude_m") > 1.5 * figure("other_amplitude_m"));
    let told = format!("from {from_hz:.4} to {to_hz:.4} Hz several motions were found");
    assert!(stderr.contains(&told), "{stderr}");
    assert!(!stderr.contains("jumps between"), "{stderr}");
    let report = folder.text("followed/report.html");
    let line = report
        .split("<li")
        .find(|item| item.contains("there are several motions"));
    let line = line.expect("the report tells of several motions");
    assert!(line.contains("<b>look</b>"), "{line}");

    let grid = ["response.frequency_hz=[0.12, 0.26]", "response.points=57"];
    let (code, _, stderr) = dovetail("run", &scene, &folder.path("grid"), &grid);
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stderr.contains("the amplitude of tip jumps between 0.1"),
        "{stderr}"
    );
    assert!(!stderr.contains("several motions"), "{stderr}");
    let summary: serde_json::Value =
        serde_json::from_str(&folder.text("grid/summary.json")).unwrap();
    assert_eq!(summary["response"]["second_motion"], serde_json::json!([]));
}

/// The steady load closes 1 m of the clearance. The mass is then on its own spring.
#[test]
fn a_slider_that_is_open_at_rest_leaves_the_free_mass() {
    let folder = Folder::new("open");
    let scene = Path::new("scenes/verification/jenkins.toml");
    let set = ["reduced_model.gap_m=2", "reduced_model.force_n=1e-3"];
    let (code, _, stderr) = dovetail("run", scene, &folder.0, &set);
    assert_eq!(code, 0, "{stderr}");
    let summary = json(&folder);
    assert_eq!(summary["static"]["open_pairs"], 1);
    let hz = summary["linear_frequency_hz"].as_f64().unwrap();
    assert!((hz - 1.0).abs() < 1e-9, "{hz} Hz");
    assert!(stderr.contains("open at rest"), "{stderr}");
}

/// Each way that is tried has a line, and no line has more than the whole.
#[test]
fn verbose_progress_says_what_is_tried_and_stays_below_the_whole() {
    let folder = Folder::new("verbose");
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program.current_dir(env!("CARGO_MANIFEST_DIR"));
    program.args(["run", "scenes/verification/den_hartog.toml", "--verbose"]);
    program.args(["--set", "response.frequency_hz=[0.6, 1.35]"]);
    program.args([
        "--set",
        "response.points=9",
        "--set",
        "response.harmonics=3",
    ]);
    program.args(["--set", "damping.mass_per_s=0.2"]);
    program.arg("--out").arg(&*folder.0);
    let output = program.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        said.contains("Hz: 3 harmonics, from the static state"),
        "{said}"
    );
    assert!(
        said.contains("Hz: 3 harmonics, from the neighbour"),
        "{said}"
    );
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
    let scene = Path::new("scenes/verification/den_hartog.toml");
    let set = [
        "response.harmonics=",
        "response.samples=",
        "response.accuracy=0.024",
        "response.frequency_hz=[0.6, 0.9]",
        "response.points=3",
    ];
    let (code, _, stderr) = dovetail("run", scene, &folder.0, &set);
    assert_eq!(code, 3, "{stderr}");
    let warning = "warning: at 1 of 3 frequencies the error is estimated above the accuracy";
    assert!(stderr.contains(warning), "{stderr}");

    let table = folder.text("response.csv");
    let mut lines = table.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let column = |name: &str| header.iter().position(|h| *h == name).unwrap();
    let rows: Vec<Vec<&str>> = lines.collect();
    let outcomes = rows.iter().map(|row| row[column("outcome")]);
    let inaccurate = ["converged", "accuracy_not_reached", "converged"];
    assert_eq!(outcomes.collect::<Vec<_>>(), inaccurate);
    let number = |row: usize, name: &str| rows[row][column(name)].parse::<f64>().unwrap();
    assert_eq!(number(1, "frequency_hz"), 0.75);
    assert_eq!(number(1, "harmonics"), 31.0);
    for (row, is_above) in [false, true, false].into_iter().enumerate() {
        let estimated = number(row, "estimated_error");
        assert_eq!(estimated, number(row, "tip_estimated_error"));
        assert_eq!(estimated > 0.024, is_above, "{row}: {estimated}");
    }
    let [low, middle, high] = [0, 1, 2].map(|row| number(row, "tip_amplitude_m"));
    assert!(low < middle && middle < high, "{low} {middle} {high}");

    let response = &json(&folder)["response"];
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
    let lines = attributes(&svg, "polyline", "points");
    // Through three points, of which the dashes of the stuck curve have some, too, at one height.
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
    let scene = folder.scene(&dovetail72());
    let out = folder.path("out");
    let (code, _, stderr) = dovetail("check", &scene, &out, &[]);
    assert!(code == 0 && stderr.contains("is sound"), "{stderr}");
    assert!(!out.exists());
    let (code, stdout, stderr) = dovetail("modes", &scene, &out, &[]);
    assert!(code == 0 && stdout.starts_with("stuck"), "{stdout}{stderr}");
    let (code, _, stderr) = dovetail("static", &scene, &out, &[]);
    assert!(code == 0 && stderr.contains("72 contact pairs"), "{stderr}");
    for command in ["mesh", "reduce"] {
        let (code, _, stderr) = dovetail(command, &scene, &out, &[]);
        assert!(code == 2 && stderr.contains("has no mesh"), "{stderr}");
    }
    let set = [
        "response.stuck_modes=5",
        "response.compare_harmonics=1",
        "response.harmonics=2",
    ];
    let (code, _, stderr) = dovetail("run", &scene, &out, &set);
    assert_eq!(code, 0, "{stderr}");
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["stuck_modes"], 5);
    assert_eq!(summary["static"]["slipping_pairs"], 72);
    assert!(out.join("response_h1.csv").exists());
}

#[test]
fn a_mesh_and_a_reduced_model_exclude_each_other() {
    let folder = Folder::new("both");
    let root = env!("CARGO_MANIFEST_DIR");
    let paper = std::fs::read_to_string("scenes/paper.toml").unwrap();
    let paper = paper.replace("../geometry", &format!("{root}/geometry"));
    let both = format!("{paper}\n[reduced_model]\nfolder = \"x\"\nfriction = 0.3\nforce_n = 1\n");
    let scene = folder.scene(&both);
    let (code, _, stderr) = dovetail("check", &scene, &folder.0, &[]);
    assert_eq!(code, 2);
    for section in [
        "mesh",
        "body",
        "rotation",
        "contact",
        "excitation",
        "observe",
    ] {
        let words = format!("`reduced_model` and `{section}` exclude each other");
        assert!(stderr.contains(&words), "{section}: {stderr}");
    }
    assert!(stderr.contains("keep [reduced_model] alone"), "{stderr}");
    let (code, _, _) = dovetail("check", &scene, &folder.0, &["reduced_model="]);
    assert_eq!(code, 0, "without it the scene is the paper's");
}

#[test]
fn what_a_folder_lacks_is_said() {
    let folder = Folder::new("lacks");
    let wrong = |scene: &Path, command: &str, set: &[&str], words: &[&str]| {
        let (code, _, stderr) = dovetail(command, scene, &folder.path("out"), set);
        assert_eq!(code, 2, "{stderr}");
        for word in words {
            assert!(stderr.contains(word), "{word}: {stderr}");
        }
    };
    let den_hartog = Path::new("scenes/verification/den_hartog.toml");
    let words = [
        "damping.ratio",
        "has none",
        "damping.stiffness_s",
        "damping.mass_per_s",
    ];
    wrong(den_hartog, "run", &["damping.ratio=0.001"], &words);
    let set = ["response.times_first_linear_mode=[0.9, 1.1]"];
    let words = [
        "response.times_first_linear_mode",
        "no mode to count from",
        "response.frequency_hz",
    ];
    wrong(den_hartog, "run", &set, &words);
    let set = ["reduced_model.folder=nowhere"];
    for command in ["check", "static"] {
        wrong(
            den_hartog,
            command,
            &set,
            &["nowhere/xyz.mtx", "No such file"],
        );
    }
    let scene =
        folder.scene("name = \"x\"\n[reduced_model]\nfriction = -1\n[damping]\nmass_per_s = 0\n");
    wrong(
        &scene,
        "check",
        &[],
        &["`reduced_model.friction` is -1", "0 or more"],
    );
    wrong(&scene, "check", &[], &["`reduced_model.folder` is missing"]);
    wrong(
        &scene,
        "check",
        &[],
        &["`reduced_model.force_n` is missing"],
    );
    let (_, _, stderr) = dovetail("check", &scene, &folder.0, &[]);
    assert!(
        stderr.contains("no [response]") && !stderr.contains("no [mesh]"),
        "{stderr}"
    );
}

/// Runs `dovetail reduce` into a folder; returns those lines of its output that can be used in a
/// scene.
fn reduce(scene: &Path, out: &Path, set: &[&str]) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program.current_dir(env!("CARGO_MANIFEST_DIR"));
    program.arg("reduce").arg(scene).arg("--out").arg(out);
    for set in set {
        program.args(["--set", set]);
    }
    let output = program.output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{stderr}");
    let lines = stderr.lines().skip_while(|l| *l != "[reduced_model]");
    let is_key = |l: &&str| l.starts_with('[') || l.contains(" = ");
    let told: Vec<&str> = lines.take_while(is_key).collect();
    assert_eq!(told.len(), 5, "{stderr}");
    told.join("\n")
}

/// Scene with the output of [`reduce`], on the two frequencies of `TWO_POINTS`.
fn scene_of(told: &str) -> String {
    format!(
        "name = \"again\"\n{told}\n[damping]\nratio = 0.001\n[response]\ntimes_first_linear_mode = [0.98, 1.02]\n\
         points = 2\nharmonics = 1\n"
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
    let paper = Path::new("scenes/paper.toml");
    let (code, _, stderr) = dovetail("run", paper, &meshed.0, &TWO_POINTS);
    assert_eq!(code, 0, "{stderr}");
    let told = reduce(paper, &again.path("model"), &[LINEAR_MESH]);
    assert!(
        told.contains("friction = 0.3\ngap_m = 0.0\nforce_n = 2.0"),
        "{told}"
    );
    let scene = again.scene(&scene_of(&told));
    let (code, _, stderr) = dovetail("run", &scene, &again.0, &[]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(meshed.text("response.csv"), again.text("response.csv"));
    // The tables of the pairs as well, but for the nodes and the name of the contact.
    let numbers = |folder: &Folder, file: &str| -> Vec<String> {
        let text = folder.text(file);
        let x = text
            .lines()
            .next()
            .unwrap()
            .split(',')
            .position(|h| h == "x_m");
        let from_x = |line: &str| {
            line.split(',')
                .skip(x.unwrap())
                .collect::<Vec<_>>()
                .join(",")
        };
        text.lines().map(from_x).collect()
    };
    for file in ["static.csv", "contact.csv"] {
        assert_eq!(numbers(&meshed, file), numbers(&again, file), "{file}");
    }
}

/// `dovetail reduce` lists its files. It refuses the folder of another scene, and a folder beside
/// whose run the files do not belong.
#[test]
fn the_folder_of_a_reduced_model_is_whole_and_its_own() {
    let folder = Folder::new("own");
    let paper = Path::new("scenes/paper.toml");
    reduce(paper, &folder.0, &[LINEAR_MESH]);
    let summary: serde_json::Value = serde_json::from_str(&folder.text("summary.json")).unwrap();
    assert_eq!(summary["state"], "finished");
    let listed: Vec<&str> = summary["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| f.as_str().unwrap())
        .collect();
    let entries = std::fs::read_dir(folder.path(".")).unwrap();
    let mut there: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    there.retain(|name| name != "summary.json");
    there.sort();
    assert_eq!(there, listed);
    assert!(listed.contains(&"K.mtx") && listed.contains(&"xyz.mtx"));
    let stiffness = folder.text("K.mtx");
    let (code, _, stderr) = dovetail("reduce", paper, &folder.0, &[LINEAR_MESH, "name=other"]);
    assert_eq!(code, 2, "{stderr}");
    assert!(
        stderr.contains("holds a run of the scene \"paper\""),
        "{stderr}"
    );
    assert_eq!(folder.text("K.mtx"), stiffness);
    // Beside a run its files belong where the settings are the same.
    let beside = Folder::new("beside");
    let (code, _, stderr) = dovetail("run", paper, &beside.0, &TWO_POINTS);
    assert_eq!(code, 0, "{stderr}");
    let (code, _, stderr) = dovetail("reduce", paper, &beside.0, &[LINEAR_MESH]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("with other settings"), "{stderr}");
    reduce(paper, &beside.0, &TWO_POINTS);
    let summary: serde_json::Value = serde_json::from_str(&beside.text("summary.json")).unwrap();
    assert!(summary["response"]["peak_amplitude_m"].is_f64());
    assert!(
        summary["files"]
            .as_array()
            .unwrap()
            .iter()
            .any(|file| file == "K.mtx")
    );
}

/// Amplitudes of response.csv.
fn amplitudes_m(text: &str) -> Vec<f64> {
    let mut lines = text.lines().map(|l| l.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let column = header.iter().position(|h| *h == "tip_amplitude_m").unwrap();
    lines.map(|row| row[column].parse().unwrap()).collect()
}

/// Whatever the forces of the scene, the folder is for 1 N, and the output gives the amplitudes of
/// `run`.
#[test]
fn reduce_and_then_run_gives_the_amplitudes_of_run() {
    let root = env!("CARGO_MANIFEST_DIR");
    let paper = std::fs::read_to_string("scenes/paper.toml").unwrap();
    let paper = paper.replace("../", &format!("{root}/"));
    let second =
        "[[excitation]]\non = \"tip_trailing_edge\"\ndirection = [1, 0, 0]\nforce_n = 0.4\n";
    let mesh = format!("mesh.file={root}/meshes/dovetail_order1.msh");
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
        let scene = folder.scene(&text);
        let set = [&mesh, TWO_POINTS[1], TWO_POINTS[2], TWO_POINTS[3], force];
        let (code, _, stderr) = dovetail("run", &scene, &folder.0, &set);
        assert_eq!(code, 0, "{name}: {stderr}");
        let of_mesh = amplitudes_m(&folder.text("response.csv"));
        let told = reduce(&scene, &folder.path("model"), &[&mesh, force]);
        let again = folder.scene(&scene_of(&told));
        let (code, _, stderr) = dovetail("run", &again, &folder.path("out"), &[]);
        assert_eq!(code, 0, "{name}: {stderr}");
        for (a, b) in of_mesh
            .iter()
            .zip(amplitudes_m(&folder.text("out/response.csv")))
        {
            assert!((a - b).abs() <= 1e-9 * a.abs(), "{name}: {a} m, {b} m");
        }
        if name != "two" {
            forces_of_paper.push(folder.text("model/f_excitation.mtx"));
        }
    }
    assert!(forces_of_paper.iter().all(|f| *f == forces_of_paper[0]));
}

#[test]
fn forces_that_a_folder_cannot_hold_are_refused() {
    let folder = Folder::new("phase");
    let paper = Path::new("scenes/paper.toml");
    for set in ["excitation.0.phase_deg=30", "excitation.0.harmonic=2"] {
        let (code, _, stderr) = dovetail("reduce", paper, &folder.0, &[LINEAR_MESH, set]);
        assert_eq!(code, 2, "{set}: {stderr}");
        assert!(
            stderr.contains("harmonic = 1 and phase_deg = 0"),
            "{set}: {stderr}"
        );
    }
}

/// Headers that announce more data than there is are refused at once, as are a stiffness and a mass
/// that no body has.
#[test]
fn a_folder_is_believed_only_as_far_as_it_goes() {
    let folder = Folder::new("believed");
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/dovetail72");
    let scene = folder.scene(&DOVETAIL72.replace("tests/data/dovetail72", "model"));
    std::fs::create_dir(folder.path("model")).unwrap();
    for file in std::fs::read_dir(&reference).unwrap() {
        let file = file.unwrap();
        std::fs::copy(file.path(), folder.path("model").join(file.file_name())).unwrap();
    }
    let header = "%%MatrixMarket matrix array real general";
    let diagonal = |value: f64| {
        let entry = |k: usize| if k / 216 == k % 216 { value } else { 0.0 };
        let entries: String = (0..216 * 216).map(|k| format!("{}\n", entry(k))).collect();
        format!("{header}\n216 216\n{entries}")
    };
    for (file, text, words) in [
        (
            "K.mtx",
            format!("{header}\n90000 90000\n1\n2\n"),
            "90000 x 90000",
        ),
        (
            "p.mtx",
            format!("{header}\n0 18446744073709551615\n"),
            "0 x 18446744073709551615",
        ),
        (
            "xyz.mtx",
            format!("{header}\n30000000 3\n0\n"),
            "30000000 x 3",
        ),
        (
            "K.mtx",
            diagonal(-1.0),
            "lowest eigenvalue of the stiffness is -1.000e0 N",
        ),
        ("M.mtx", diagonal(0.0), "M - p p^T"),
    ] {
        let path = folder.path("model").join(file);
        let whole = std::fs::read(&path).unwrap();
        std::fs::write(&path, &text).unwrap();
        let (code, _, stderr) = dovetail("check", &scene, &folder.path("out"), &[]);
        std::fs::write(&path, whole).unwrap();
        assert!(
            code == 2 && stderr.contains(words) && stderr.contains(file),
            "{stderr}"
        );
    }
    let (code, _, stderr) = dovetail("check", &scene, &folder.path("out"), &[]);
    assert_eq!(code, 0, "{stderr}");
}
