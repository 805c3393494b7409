//! Scenes about a reduced model: the program on them, what it refuses, and the way from a mesh to a folder.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder for one test, gone at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let name = format!("dovetail-reduced-{name}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }
    fn path(&self, file: &str) -> PathBuf {
        self.0.join(file)
    }
    fn text(&self, file: &str) -> String {
        let path = self.path(file);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }
    /// A scene file in it.
    fn scene(&self, text: &str) -> PathBuf {
        let path = self.path("scene.toml");
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Runs the program from the root of the repository; exit code, standard output, standard error on one line.
fn dovetail(command: &str, scene: &Path, out: &Path, set: &[&str]) -> (i32, String, String) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program.current_dir(env!("CARGO_MANIFEST_DIR"));
    program.arg(command).arg(scene).arg("--out").arg(out);
    for set in set {
        program.args(["--set", set]);
    }
    let output = program.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    // Messages are broken to lines with a bar before each.
    let stderr = text(&output.stderr).replace('|', " ");
    let stderr = stderr.split_whitespace().collect::<Vec<_>>().join(" ");
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
times_first_stuck_mode = [0.99, 1.01]
points = 3
harmonics = 1
"#;

/// DOVETAIL72 with its folder where the program finds it.
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
        "plots/fig4_tip.svg",
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
    assert!(out.join("response_h1.csv").exists() && out.join("plots/fig3_tip.svg").exists());
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
    let set = ["response.times_first_stuck_mode=[0.9, 1.1]"];
    let words = [
        "response.times_first_stuck_mode",
        "no stuck mode",
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

/// What `dovetail reduce` writes gives, number for number, the response of the mesh it came from.
#[test]
fn a_reduced_mesh_vibrates_like_the_mesh() {
    let (meshed, again) = (Folder::new("meshed"), Folder::new("again"));
    let paper = Path::new("scenes/paper.toml");
    let mesh = "mesh.file=../meshes/dovetail_order1.msh";
    let set = [
        mesh,
        "response.points=2",
        "response.compare_harmonics=",
        "response.harmonics=1",
    ];
    let (code, _, stderr) = dovetail("run", paper, &meshed.0, &set);
    assert_eq!(code, 0, "{stderr}");
    let (code, _, stderr) = dovetail("reduce", paper, &again.path("model"), &[mesh]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stderr.contains("friction = 0.3 gap_m = 0.0"), "{stderr}");
    let text = "name = \"again\"\n[reduced_model]\nfolder = \"model\"\nfriction = 0.3\nforce_n = 1\n\
                [damping]\nratio = 0.001\n[response]\ntimes_first_stuck_mode = [0.98, 1.02]\npoints = 2\nharmonics = 1\n";
    let (code, _, stderr) = dovetail("run", &again.scene(text), &again.0, &[]);
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
