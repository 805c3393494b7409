//! The program itself, from a scene and a mesh file to exit codes and files.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shared_folder;
use crate::shared_program::{ended, said};

/// Small mesh for fast runs: linear elements (the airfoil is too stiff, but every stage runs).
const SMALL: &str = "mesh.file=../meshes/dovetail_order1.msh";

/// Files of a run besides the flanks at each frequency.
const FILES: [&str; 17] = [
    "contact.csv",
    "flank.pvd",
    "flank_peak.vtu",
    "flank_static.vtu",
    "modes.csv",
    "peak.vtu",
    "plots/response_tip.svg",
    "plots/separation.svg",
    "plots/peak_friction_energy.svg",
    "plots/peak_slip.svg",
    "plots/static_pressure.svg",
    "response.csv",
    "response_h1.csv",
    "static.csv",
    "static_observed.csv",
    "static.vtu",
    "summary.json",
];

/// Folder for the results of one test, removed at its end.
struct Folder(shared_folder::Folder);

impl Folder {
    fn new(name: &str) -> Self {
        Self(shared_folder::Folder::new(name))
    }
    fn text(&self, file: &str) -> String {
        let path = self.0.join(file);
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }
    fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.text("summary.json")).unwrap()
    }
    /// Rows of a table as (column, field) lists.
    fn table(&self, file: &str) -> Vec<Vec<(String, String)>> {
        let text = self.text(file);
        let mut lines = text.lines().map(|line| line.split(','));
        let header: Vec<&str> = lines.next().unwrap().collect();
        lines
            .map(|fields| {
                let pairs = header.iter().zip(fields);
                pairs.map(|(h, f)| (h.to_string(), f.to_string())).collect()
            })
            .collect()
    }
}

fn field<'a>(row: &'a [(String, String)], column: &str) -> &'a str {
    let found = row.iter().find(|(name, _)| name == column);
    &found.unwrap_or_else(|| panic!("no column {column}")).1
}

fn number(row: &[(String, String)], column: &str) -> f64 {
    field(row, column).parse().unwrap()
}

/// `dovetail COMMAND scenes/paper.toml --out FOLDER --set ...`.
fn dovetail(command: &str, out: &Folder, set: &[&str]) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args([command, "scenes/paper.toml", "--no-cache", "--out"])
        .arg(&out.0);
    for set in set {
        program.args(["--set", set]);
    }
    program
}

#[test]
fn run_writes_every_file_and_the_same_response_for_any_number_of_threads() {
    let set = [SMALL, "response.points=3"];
    let folders = [1, 2].map(|threads| {
        let folder = Folder::new(&format!("run-{threads}"));
        let mut command = dovetail("run", &folder, &set);
        command.args(["--threads", &threads.to_string()]);
        if threads == 2 {
            command.args(["--frames", "5"]);
        }
        let output = ended(command, 0);
        assert!(
            said(&output).contains("72 contact pairs"),
            "{}",
            said(&output)
        );
        folder
    });
    let [one, two] = &folders;
    for file in [
        "response.csv",
        "response_h1.csv",
        "contact.csv",
        "static.csv",
        "modes.csv",
    ] {
        assert_eq!(one.text(file), two.text(file), "{file}");
    }
    for file in FILES {
        let length = std::fs::metadata(one.0.join(file)).map(|m| m.len());
        assert!(length.is_ok_and(|l| l > 0), "{file}");
    }
    let flanks = std::fs::read_dir(one.0.join("flank")).unwrap();
    assert_eq!(flanks.count(), 3);
    // The motion stands there once, unless frames are asked for.
    assert!(!one.0.join("peak.pvd").exists() && !one.0.join("peak").exists());
    let files = two.json()["files"].to_string();
    for frame in 0..5 {
        let file = format!("peak/peak_{frame:03}.vtu");
        assert!(two.text("peak.pvd").contains(&file) && two.0.join(&file).exists());
        assert!(files.contains(&file) && files.contains("peak.pvd"));
    }
    assert!(!two.0.join("peak/peak_005.vtu").exists());

    let rows = one.table("response.csv");
    assert_eq!(rows.len(), 3);
    for row in &rows {
        assert_eq!(field(row, "outcome"), "converged");
        for column in [
            "frequency_hz",
            "tip_amplitude_m",
            "tip_linear_amplitude_m",
            "tip_h1_amplitude_m",
            "tip_h3_phase_rad",
            "friction_power_w",
            "viscous_power_w",
            "input_power_w",
            "residual",
        ] {
            assert!(number(row, column).is_finite(), "{column}");
        }
        for column in ["newton_iterations", "krylov_iterations"] {
            let _: usize = field(row, column).parse().unwrap();
        }
        let states = ["stuck", "slipping", "opening", "closing", "open"];
        let counts = states.map(|state| number(row, &format!("{state}_pairs")));
        assert_eq!(counts.iter().sum::<f64>(), 72.0);
    }
    assert_eq!(one.table("static.csv").len(), 72);
    assert_eq!(one.table("contact.csv").len(), 72);
    let summary = one.json();
    assert_eq!(summary["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(summary["scene"]["name"], "paper");
    assert_eq!(summary["pairs"], 72);
    assert_eq!(summary["response"]["converged_points"], 3);
    assert!(summary["stages"].as_array().is_some_and(|s| s.len() >= 6));
}

#[test]
fn unconverged_frequencies_are_marked_and_have_exit_code_3() {
    let folder = Folder::new("unconverged");
    let set = [
        SMALL,
        "response.points=3",
        "response.max_newton_iterations=1",
    ];
    let output = ended(dovetail("run", &folder, &set), 3);
    assert!(said(&output).contains("did not converge"));
    let rows = folder.table("response.csv");
    let (good, bad): (Vec<_>, Vec<_>) = rows
        .iter()
        .partition(|row| field(row, "outcome") == "converged");
    assert!(!bad.is_empty());
    for row in bad {
        let outcome = field(row, "outcome");
        assert!(
            ["iteration_limit", "stagnated"].contains(&outcome),
            "{outcome}"
        );
        for column in ["tip_amplitude_m", "friction_power_w", "slipping_pairs"] {
            assert_eq!(field(row, column), "", "{column}");
        }
        assert!(number(row, "tip_linear_amplitude_m") > 0.0);
    }
    let converged = &folder.json()["response"]["converged_points"];
    assert_eq!(converged.as_u64().map(|n| n as usize), Some(good.len()));
}

#[test]
fn no_force_is_no_vibration() {
    let folder = Folder::new("still");
    let set = [SMALL, "response.points=2", "excitation.0.force_n=0"];
    ended(dovetail("run", &folder, &set), 0);
    // With linear elements some pairs are open in the static state already.
    let statics = folder.table("static.csv");
    let open = statics
        .iter()
        .filter(|row| field(row, "status") == "open")
        .count();
    for row in folder.table("response.csv") {
        assert_eq!(number(&row, "tip_amplitude_m"), 0.0);
        assert_eq!(number(&row, "tip_linear_amplitude_m"), 0.0);
        assert_eq!(field(&row, "slipping_pairs"), "0");
        assert!(open > 0);
        assert_eq!(number(&row, "open_pairs"), open as f64);
        assert_eq!(field(&row, "closing_pairs"), "0");
        assert_eq!(field(&row, "opening_pairs"), "0");
    }
}

#[test]
fn a_wrong_scene_or_mesh_has_exit_code_2_and_a_remedy() {
    let folder = Folder::new("wrong");
    for (command, set, says) in [
        ("run", "response.pionts=3", "points"),
        ("check", "contact.left.friction=-1", "friction"),
        ("mesh", "mesh.file=../meshes/none.msh", "none.msh"),
        ("static", "body.0.volume=bald", "blade, jaw"),
    ] {
        let output = ended(dovetail(command, &folder, &[SMALL, set]), 2);
        assert!(said(&output).contains(says), "{set}: {}", said(&output));
    }
}

#[test]
fn check_computes_and_writes_nothing() {
    let folder = Folder::new("check");
    let output = ended(dovetail("check", &folder, &[]), 0);
    assert!(said(&output).contains("sound"));
    assert_eq!(std::fs::read_dir(&*folder.0).unwrap().count(), 0);
}

#[test]
fn modes_lists_flanks_held_fixed_interface_and_stuck_modes() {
    let folder = Folder::new("modes");
    let reduced = "body.*.fixed_interface_modes=6";
    let output = ended(dovetail("modes", &folder, &[SMALL, reduced]), 0);
    let told = said(&output);
    assert!(
        told.contains("12 stuck modes: amplitudes of the linear curve err by about"),
        "{told}"
    );
    assert!(
        told.contains("fixed_interface_modes raise the first 6"),
        "{told}"
    );
    let truncation = &folder.json()["truncation"];
    assert_eq!(truncation["frequencies"].as_array().unwrap().len(), 6);
    assert!(truncation["amplitude"].as_f64().unwrap() < 1e-4);
    let listed = String::from_utf8(output.stdout).unwrap();
    let rows = folder.table("modes.csv");
    assert_eq!(
        rows.iter()
            .filter(|row| field(row, "kind") == "stuck")
            .count(),
        12
    );
    for (kind, body) in [
        ("flanks_held", "blade"),
        ("flanks_held", "jaw"),
        ("fixed_interface", "blade"),
        ("fixed_interface", "jaw"),
        ("stuck", "assembly"),
    ] {
        let of_kind = |row: &&Vec<_>| field(row, "kind") == kind && field(row, "body") == body;
        let frequencies: Vec<f64> = rows
            .iter()
            .filter(of_kind)
            .map(|row| number(row, "frequency_hz"))
            .collect();
        assert!(frequencies.len() >= 6, "{kind} {body}");
        assert!(
            frequencies[0] > 0.0 && frequencies.is_sorted(),
            "{kind} {body}"
        );
        assert!(listed.contains(&format!("{:.4} Hz", frequencies[0])));
    }
    assert!(!folder.0.join("response.csv").exists());
}

/// Engine orders whose lines a Campbell diagram names.
fn engine_orders(svg: &str) -> BTreeSet<usize> {
    let names = svg
        .lines()
        .filter_map(|line| line.trim().strip_prefix("EO "));
    names.filter_map(|name| name.parse().ok()).collect()
}

#[test]
fn engine_orders_that_are_asked_for_are_those_of_the_diagram() {
    let folder = Folder::new("campbell-orders");
    let mut command = dovetail(
        "modes",
        &folder,
        &["mesh.file=../meshes/dovetail_small.msh"],
    );
    command.args(["--rpm", "0:7000:2", "--orders", "4,7"]);
    ended(command, 0);
    let drawn = engine_orders(&folder.text("plots/campbell.svg"));
    assert_eq!(drawn, BTreeSet::from([4, 7]));
}

#[test]
fn frequencies_over_the_speed_are_those_of_each_speed() {
    let folder = Folder::new("campbell");
    let small = "mesh.file=../meshes/dovetail_small.msh";
    let mut command = dovetail("modes", &folder, &[small]);
    command.args(["--rpm", "0:7000:3"]);
    let output = ended(command, 0);
    let listed = String::from_utf8(output.stdout).unwrap();
    let rows = folder.table("modes_campbell.csv");
    assert_eq!(rows.len(), 3 * 2 * 6);
    let svg = folder.text("plots/campbell.svg");
    assert!(svg.contains("EO 1") && svg.contains("blade, flanks held"));
    let named = listed
        .lines()
        .filter_map(|line| line.split("  EO ").nth(1)?.split_whitespace().next());
    let named: BTreeSet<usize> = named.map(|order| order.parse().unwrap()).collect();
    assert!(!named.is_empty(), "{listed}");
    let drawn = engine_orders(&svg);
    assert!(named.is_subset(&drawn), "{named:?} {drawn:?}");
    // The middle speed is assembled from the other two.
    for speed in [0.0, 3500.0, 7000.0] {
        let alone = Folder::new("campbell-alone");
        let at = format!("rotation.speed_rpm={speed}");
        ended(dovetail("modes", &alone, &[small, &at]), 0);
        for one in alone.table("modes.csv") {
            let key = ["kind", "body", "mode"];
            let found = rows.iter().find(|row| {
                number(row, "speed_rpm") == speed
                    && key.iter().all(|k| field(row, k) == field(&one, k))
            });
            let kept = (field(&one, "kind") == "flanks_held" && field(&one, "body") == "blade"
                || field(&one, "kind") == "stuck")
                && number(&one, "mode") <= 6.0;
            assert_eq!(found.is_some(), kept);
            if let Some(found) = found {
                let (a, b) = (number(found, "frequency_hz"), number(&one, "frequency_hz"));
                assert!((a / b - 1.0).abs() < 1e-9, "{speed} rpm: {a} {b}");
                assert!(listed.contains(&format!("{a:.4}")));
            }
        }
    }
}

#[test]
fn speeds_the_blade_does_not_stand_have_no_frequencies() {
    // Prestress softens the blade where it is compressed: turned upside down, about an axis beyond
    // its tip.
    let folder = Folder::new("campbell-fast");
    let set = [
        "mesh.file=../meshes/dovetail_small.msh",
        "rotation.point_m=[0,0,1]",
    ];
    let mut command = dovetail("modes", &folder, &set);
    command.args(["--rpm", "0:20000:2"]);
    let output = ended(command, 0);
    assert!(
        said(&output).contains("no modes at 20000 rpm"),
        "{}",
        said(&output)
    );
    for row in folder.table("modes_campbell.csv") {
        let fast = number(&row, "speed_rpm") > 0.0;
        assert_eq!(field(&row, "frequency_hz").is_empty(), fast);
    }
    let mut still = dovetail("modes", &folder, &[SMALL, "rotation="]);
    still.args(["--rpm", "0:5000:3"]);
    assert!(said(&ended(still, 2)).contains("[rotation]"));
}

#[test]
fn static_writes_the_state_and_no_response() {
    let folder = Folder::new("static");
    let mut command = dovetail("static", &folder, &[SMALL]);
    command.arg("--quiet");
    assert_eq!(said(&ended(command, 0)), "");
    assert_eq!(folder.table("static.csv").len(), 72);
    for file in [
        "flank_static.vtu",
        "static.vtu",
        "plots/static_pressure.svg",
    ] {
        assert!(folder.0.join(file).exists(), "{file}");
    }
    assert!(!folder.0.join("response.csv").exists());
    let summary = folder.json();
    assert_eq!(summary["static"]["outcome"], "converged");
    assert!(summary["response"].is_null());
}

/// Sets PATH to a single folder, which has no gmsh.
fn without_gmsh(mut command: Command) -> Command {
    command.env("PATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes"));
    command
}

#[test]
fn without_gmsh_the_ready_mesh_is_used_and_that_is_said() {
    let folder = Folder::new("fallback");
    let mut command = without_gmsh(dovetail("mesh", &folder, &[]));
    command.arg("--quiet");
    let output = ended(command, 0);
    let said = said(&output);
    assert!(
        said.contains("gmsh is not installed") && said.contains("dovetail.msh"),
        "{said}"
    );
    let mesh = &folder.json()["mesh"];
    assert_eq!(mesh["fallback"], true);
    assert!(mesh["gmsh"].is_null());
    assert!(
        mesh["source"]
            .as_str()
            .is_some_and(|s| s.ends_with("meshes/dovetail.msh"))
    );
}

#[test]
fn without_gmsh_other_parameters_are_an_error() {
    let folder = Folder::new("no-fallback");
    let command = without_gmsh(dovetail("mesh", &folder, &["mesh.parameters.nu=5"]));
    let said = said(&ended(command, 1));
    assert!(said.contains("gmsh"), "{said}");
    let summary = folder.json();
    assert_eq!(summary["state"], "failed");
    assert!(
        summary["why"].as_str().unwrap().contains("gmsh"),
        "{summary}"
    );
}

/// Scene files of a folder, in alphabetical order.
fn scenes(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let files = std::fs::read_dir(folder).unwrap();
    let files = files.map(|entry| entry.unwrap().path());
    let mut scenes: Vec<PathBuf> = files
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    scenes.sort();
    scenes
}

/// `dovetail COMMAND SCENE --out FOLDER --set ...`, which has to succeed.
fn succeed(command: &str, scene: &Path, out: &Folder, set: &[&str]) {
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program
        .args([command, "--no-cache", "--out"])
        .arg(&out.0)
        .arg(scene);
    for set in set {
        program.args(["--set", set]);
    }
    ended(program, 0);
}

#[test]
fn every_scene_is_sound() {
    let folder = Folder::new("sound");
    for (folder_of_scenes, least) in [
        ("scenes", 2),
        ("scenes/verification", 8),
        ("scenes/decks", 2),
    ] {
        let scenes = scenes(folder_of_scenes);
        assert!(scenes.len() >= least, "{scenes:?}");
        for scene in scenes {
            succeed("check", &scene, &folder, &[]);
        }
    }
}

#[test]
fn what_acts_stands_under_the_title_of_a_picture() {
    let folder = Folder::new("conditions");
    for (set, at_rest, in_motion) in [
        (
            &[][..],
            "5000 rpm, friction 0.3",
            "2 N at 5000 rpm, friction 0.3",
        ),
        (
            &[
                "contact.0.friction=0.25",
                "excitation.0.force_n=0.02",
                "rotation.speed_rpm=4000",
            ][..],
            "4000 rpm, friction 0.25 to 0.3",
            "20 mN at 4000 rpm, friction 0.25 to 0.3",
        ),
    ] {
        let few = ["response.points=2", "response.harmonics=1"];
        let set = [&[SMALL], &few[..], set].concat();
        ended(dovetail("run", &folder, &set), 0);
        // The excitation does not act in the static state.
        for (picture, words) in [
            ("plots/static_pressure.svg", at_rest),
            ("plots/peak_friction_energy.svg", in_motion),
            ("plots/response_tip.svg", in_motion),
        ] {
            let text = folder.text(picture);
            assert!(text.lines().any(|line| line == words), "{picture}: {text}");
        }
    }
}

/// With linear elements, one harmonic and two frequencies. (Those of scenes/verification have tests
/// of their own, and so have the scenes that `several_bodies` takes through a run with its fields.)
#[test]
fn every_scene_runs() {
    let gmsh = Command::new("gmsh").arg("-version").output();
    assert!(
        gmsh.is_ok(),
        "gmsh is not installed, and this test runs it: `tools/setup.sh` installs it"
    );
    let elsewhere = include_str!("several_bodies.rs");
    let is_run_elsewhere = |scene: &Path| {
        let name = scene.file_stem().unwrap().display();
        elsewhere.contains(&format!("Run::new(\"run\", \"{name}\""))
    };
    let mut own = scenes("scenes");
    own.retain(|scene| !is_run_elsewhere(scene));
    assert!(own.len() >= 5, "{own:?}");
    for scene in own {
        let folder = Folder::new("scenes");
        let mut coarse = vec![
            "mesh.parameters.order=1",
            "response.harmonics=1",
            "response.points=2",
        ];
        let text = std::fs::read_to_string(&scene).unwrap();
        let of_the_paper = ["/dovetail.geo", "/lock_plate.geo"];
        if of_the_paper.iter().any(|script| text.contains(script)) {
            // The sizes of the airfoil: the joint stays as it is.
            coarse.extend(["mesh.parameters.lc_air=6", "mesh.parameters.lc_edge=4"]);
        }
        succeed("run", &scene, &folder, &coarse);
        let types = folder.json()["mesh"]["element_types"].clone();
        let linear = ["tet4", "pyramid5", "wedge6", "hex8"];
        let mut types = types.as_object().unwrap().keys();
        assert!(
            types.all(|name| linear.contains(&name.as_str())),
            "{scene:?}"
        );
        assert_eq!(folder.table("response.csv").len(), 2);
    }
}

/// `cargo run` becomes the program in the same process, which then has the time of the compilers it
/// waited for.
#[cfg(target_os = "linux")]
#[test]
fn processor_seconds_are_those_of_the_program_alone() {
    let folder = Folder::new("processor");
    let burn = "i=0; while [ $i -lt 1000000 ]; do i=$((i+1)); done";
    let script = format!("sh -c '{burn}'; {burn}; cat /proc/$$/stat > \"$0\"; exec \"$@\"");
    let stat = folder.0.join("stat");
    let out = folder.0.join("out");
    let mut command = Command::new("sh");
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command.args(["-c", &script]).arg(&stat);
    command.arg(env!("CARGO_BIN_EXE_dovetail"));
    command.args([
        "static",
        "scenes/verification/jenkins.toml",
        "--threads",
        "1",
        "--out",
    ]);
    command.arg(&out);
    ended(command, 0);
    let stat = std::fs::read_to_string(stat).unwrap();
    let (_, fields) = stat.rsplit_once(')').unwrap();
    let ticks = fields.split_whitespace().skip(11).take(4);
    let burnt_s: f64 = ticks.map(|t| t.parse::<f64>().unwrap() / 100.0).sum();
    let summary: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    let own_s = summary["processor_seconds"].as_f64().unwrap();
    assert!(
        (0.0..0.5 * burnt_s).contains(&own_s),
        "{own_s} s after {burnt_s} s of others"
    );
}
