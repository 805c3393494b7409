//! The program itself, from a scene and a mesh file to exit codes and files.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shared_folder::Folder;
use crate::shared_program::{
    SMALL, cases, ended, has, needs_gmsh, printed, said, scene_command, unwrapped,
};
use crate::shared_runs::{Row, number, rows, summary};
use dovetail_testkit::folder::root;

/// Setting for linear elements (the airfoil is too stiff, but every stage runs).
const LINEAR: &str = "mesh.file=../meshes/dovetail_order1.msh";

/// Files of a run besides the flanks at each frequency.
const FILES: [&str; 18] = [
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
    "static_forces.csv",
    "static_observed.csv",
    "static.vtu",
    "summary.json",
];

/// `dovetail COMMAND scenes/paper.toml --out FOLDER --set ...`.
fn dovetail(command: &str, out: &Folder, set: &[&str]) -> Command {
    scene_command(command, "scenes/paper.toml", out, set)
}

fn table(out: &Folder, file: &str) -> Vec<Row> {
    rows(&out.join(file))
}

#[test]
fn run_writes_every_file_and_the_same_response_for_any_number_of_threads() {
    let set = [LINEAR, "response.points=3"];
    let folders = [1, 2].map(|threads| {
        let folder = Folder::new(&format!("run-{threads}"));
        let mut command = dovetail("run", &folder, &set);
        command.args(["--threads", &threads.to_string()]);
        if threads == 2 {
            command.args(["--frames", "5"]);
        }
        has(&said(&ended(command, 0)), "72 contact pairs");
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
        let length = std::fs::metadata(one.join(file)).map(|m| m.len());
        assert!(length.is_ok_and(|l| l > 0), "{file}");
    }
    let flanks = std::fs::read_dir(one.join("flank")).unwrap();
    assert_eq!(flanks.count(), 3);
    // The motion stands there once, unless frames are asked for.
    assert!(!one.join("peak.pvd").exists() && !one.join("peak").exists());
    let files = summary(two)["files"].to_string();
    for frame in 0..5 {
        let file = format!("peak/peak_{frame:03}.vtu");
        assert!(two.text("peak.pvd").contains(&file) && two.join(&file).exists());
        assert!(files.contains(&file) && files.contains("peak.pvd"));
    }
    assert!(!two.join("peak/peak_005.vtu").exists());

    let rows = table(one, "response.csv");
    assert_eq!(rows.len(), 3);
    for row in &rows {
        assert_eq!(row["outcome"], "converged");
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
            let _: usize = row[column].parse().unwrap();
        }
        let states = ["stuck", "slipping", "opening", "closing", "open"];
        let counts = states.map(|state| number(row, &format!("{state}_pairs")));
        assert_eq!(counts.iter().sum::<f64>(), 72.0);
    }
    assert_eq!(table(one, "static.csv").len(), 72);
    assert_eq!(table(one, "contact.csv").len(), 72);
    let summary = summary(one);
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
        LINEAR,
        "response.points=3",
        "response.max_newton_iterations=1",
    ];
    let output = ended(dovetail("run", &folder, &set), 3);
    has(&said(&output), "did not converge");
    let rows = table(&folder, "response.csv");
    let (good, bad): (Vec<_>, Vec<_>) = rows.iter().partition(|row| row["outcome"] == "converged");
    assert!(!bad.is_empty());
    for row in bad {
        let outcome = row["outcome"].as_str();
        assert!(
            ["iteration_limit", "stagnated"].contains(&outcome),
            "{outcome}"
        );
        for column in ["tip_amplitude_m", "friction_power_w", "slipping_pairs"] {
            assert_eq!(row[column], "", "{column}");
        }
        assert!(number(row, "tip_linear_amplitude_m") > 0.0);
    }
    let converged = &summary(&folder)["response"]["converged_points"];
    assert_eq!(converged.as_u64().map(|n| n as usize), Some(good.len()));
}

#[test]
fn no_force_is_no_vibration() {
    let folder = Folder::new("still");
    let set = [LINEAR, "response.points=2", "excitation.0.force_n=0"];
    ended(dovetail("run", &folder, &set), 0);
    // With linear elements some pairs are open in the static state already.
    let statics = table(&folder, "static.csv");
    let open = statics.iter().filter(|row| row["status"] == "open").count();
    for row in table(&folder, "response.csv") {
        assert_eq!(number(&row, "tip_amplitude_m"), 0.0);
        assert_eq!(number(&row, "tip_linear_amplitude_m"), 0.0);
        assert_eq!(row["slipping_pairs"], "0");
        assert!(open > 0);
        assert_eq!(number(&row, "open_pairs"), open as f64);
        assert_eq!(row["closing_pairs"], "0");
        assert_eq!(row["opening_pairs"], "0");
    }
}

#[test]
fn a_wrong_scene_or_mesh_has_exit_code_2_and_a_remedy() {
    let folder = Folder::new("wrong");
    let table = "
        run => response.pionts=3 => points
        check => contact.left.friction=-1 => friction
        mesh => mesh.file=../meshes/none.msh => none.msh
        static => body.0.volume=bald => blade, jaw
        ";
    for [command, set, says] in cases(table) {
        let wrong = dovetail(&command, &folder, &[LINEAR, &set]);
        has(&said(&ended(wrong, 2)), &says);
    }
}

#[test]
fn check_computes_and_writes_nothing() {
    let folder = Folder::new("check");
    let output = ended(dovetail("check", &folder, &[]), 0);
    has(&said(&output), "sound");
    assert_eq!(std::fs::read_dir(&*folder).unwrap().count(), 0);
}

#[test]
fn modes_lists_flanks_held_fixed_interface_and_stuck_modes() {
    let folder = Folder::new("modes");
    let reduced = "body.*.fixed_interface_modes=6";
    let output = ended(dovetail("modes", &folder, &[LINEAR, reduced]), 0);
    let words = "12 stuck modes: amplitudes of the linear curve err by about \
                 & fixed_interface_modes raise the first 6";
    has(&said(&output), words);
    let truncation = &summary(&folder)["truncation"];
    assert_eq!(truncation["frequencies"].as_array().unwrap().len(), 6);
    assert!(truncation["amplitude"].as_f64().unwrap() < 1e-4);
    let listed = printed(&output);
    let rows = table(&folder, "modes.csv");
    let stuck = rows.iter().filter(|row| row["kind"] == "stuck");
    assert_eq!(stuck.count(), 12);
    for (kind, body) in [
        ("flanks_held", "blade"),
        ("flanks_held", "jaw"),
        ("fixed_interface", "blade"),
        ("fixed_interface", "jaw"),
        ("stuck", "assembly"),
    ] {
        let of_kind = |row: &&Row| row["kind"] == kind && row["body"] == body;
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
    assert!(!folder.join("response.csv").exists());
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
    let mut command = dovetail("modes", &folder, &[SMALL]);
    ended(command.args(["--rpm", "0:7000:2", "--orders", "4,7"]), 0);
    let drawn = engine_orders(&folder.text("plots/campbell.svg"));
    assert_eq!(drawn, BTreeSet::from([4, 7]));
}

#[test]
fn frequencies_over_the_speed_are_those_of_each_speed() {
    let folder = Folder::new("campbell");
    let mut command = dovetail("modes", &folder, &[SMALL]);
    let listed = printed(&ended(command.args(["--rpm", "0:7000:3"]), 0));
    let rows = table(&folder, "modes_campbell.csv");
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
    for (speed, hz) in frequencies_by_speed(&rows, &[0.0, 3500.0, 7000.0], &[SMALL]) {
        assert!(listed.contains(&format!("{hz:.4}")), "{speed} rpm: {hz}");
    }
}

/// Steady loads stress the bodies at all speeds alike.
#[test]
fn steady_loads_stiffen_at_each_speed_as_at_that_speed_alone() {
    let pull = "load=[{ on = \"blade_tip\", direction = [0, 0, 1], force_n = 40000 }]";
    let folder = Folder::new("campbell-loaded");
    let mut command = dovetail("modes", &folder, &[SMALL, pull]);
    ended(command.args(["--rpm", "0:7000:3"]), 0);
    let rows = table(&folder, "modes_campbell.csv");
    let loaded = frequencies_by_speed(&rows, &[3500.0, 7000.0], &[SMALL, pull]);
    let alone = Folder::new("campbell-unloaded");
    ended(
        dovetail("modes", &alone, &[SMALL, "rotation.speed_rpm=3500"]),
        0,
    );
    let without = number(&table(&alone, "modes.csv")[0], "frequency_hz");
    let share = loaded[0].1 / without - 1.0;
    assert!(share > 0.01, "the load changes nothing: {share}");
}

/// Speeds and frequencies of a Campbell diagram, which have to be those of runs at each speed alone.
fn frequencies_by_speed(rows: &[Row], speeds_rpm: &[f64], set: &[&str]) -> Vec<(f64, f64)> {
    let mut all = Vec::new();
    for &speed in speeds_rpm {
        let alone = Folder::new("campbell-alone");
        let at = format!("rotation.speed_rpm={speed}");
        ended(dovetail("modes", &alone, &[set, &[&at]].concat()), 0);
        for one in table(&alone, "modes.csv") {
            let key = ["kind", "body", "mode"];
            let found = rows.iter().find(|row| {
                number(row, "speed_rpm") == speed && key.iter().all(|k| row[*k] == one[*k])
            });
            let kept = (one["kind"] == "flanks_held" && one["body"] == "blade"
                || one["kind"] == "stuck")
                && number(&one, "mode") <= 6.0;
            assert_eq!(found.is_some(), kept);
            if let Some(found) = found {
                let (a, b) = (number(found, "frequency_hz"), number(&one, "frequency_hz"));
                assert!((a / b - 1.0).abs() < 1e-9, "{speed} rpm: {a} {b}");
                all.push((speed, a));
            }
        }
    }
    all
}

#[test]
fn speeds_the_blade_does_not_stand_have_no_frequencies() {
    // Prestress softens the blade where it is compressed: turned upside down, about an axis beyond
    // its tip.
    let folder = Folder::new("campbell-fast");
    let set = [SMALL, "rotation.point_m=[0,0,1]"];
    let mut command = dovetail("modes", &folder, &set);
    let output = ended(command.args(["--rpm", "0:20000:2"]), 0);
    has(&said(&output), "no modes at 20000 rpm");
    for row in table(&folder, "modes_campbell.csv") {
        let fast = number(&row, "speed_rpm") > 0.0;
        assert_eq!(row["frequency_hz"].is_empty(), fast);
    }
    let mut still = dovetail("modes", &folder, &[LINEAR, "rotation="]);
    let told = said(&ended(still.args(["--rpm", "0:5000:3"]), 2));
    has(&told, "[rotation]");
}

#[test]
fn static_writes_the_state_and_no_response() {
    let folder = Folder::new("static");
    let mut command = dovetail("static", &folder, &[LINEAR]);
    // The mesh is of linear tetrahedra.
    let quiet = said(&ended(command.arg("--quiet"), 0));
    let mut lines = quiet.lines();
    has(lines.next().unwrap(), "warning: linear elements");
    assert_eq!(lines.next(), None);
    assert_eq!(table(&folder, "static.csv").len(), 72);
    for file in [
        "flank_static.vtu",
        "static.vtu",
        "plots/static_pressure.svg",
    ] {
        assert!(folder.join(file).exists(), "{file}");
    }
    assert!(!folder.join("response.csv").exists());
    let summary = summary(&folder);
    assert_eq!(summary["static"]["outcome"], "converged");
    assert!(summary["response"].is_null());
}

/// Sets PATH to a single folder, which has no gmsh.
fn hide_gmsh(mut command: Command) -> Command {
    command.env("PATH", root().join("meshes"));
    command
}

#[test]
fn without_gmsh_the_ready_mesh_is_used_and_that_is_said() {
    let folder = Folder::new("fallback");
    let mut command = hide_gmsh(dovetail("mesh", &folder, &[]));
    let output = ended(command.arg("--quiet"), 0);
    has(&said(&output), "gmsh is not installed & dovetail.msh");
    let mesh = &summary(&folder)["mesh"];
    assert_eq!(mesh["fallback"], true);
    assert!(mesh["gmsh"].is_null());
    assert!(
        mesh["source"]
            .as_str()
            .is_some_and(|s| s.ends_with("meshes/dovetail.msh"))
    );
}

#[test]
fn the_environment_names_another_gmsh() {
    let folder = Folder::new("named-gmsh");
    let mut command = dovetail("mesh", &folder, &["mesh.parameters.nu=5"]);
    command.env("DOVETAIL_GMSH", "/nowhere/mesher");
    let said = said(&ended(command, 1));
    has(&unwrapped(&said), "`/nowhere/mesher` is not installed");
}

#[test]
fn without_gmsh_other_parameters_are_an_error() {
    let folder = Folder::new("no-fallback");
    let command = hide_gmsh(dovetail("mesh", &folder, &["mesh.parameters.nu=5"]));
    has(&said(&ended(command, 1)), "gmsh");
    let summary = summary(&folder);
    assert_eq!(summary["state"], "failed");
    has(summary["why"].as_str().unwrap(), "gmsh");
}

/// Scene files of a folder, in alphabetical order.
fn scenes(folder: &str) -> Vec<PathBuf> {
    let files = std::fs::read_dir(root().join(folder)).unwrap();
    let files = files.map(|entry| entry.unwrap().path());
    let mut scenes: Vec<PathBuf> = files
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    scenes.sort();
    scenes
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
            ended(scene_command("check", scene, &folder, &[]), 0);
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
        let set = [&[LINEAR], &few[..], set].concat();
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
    needs_gmsh();
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
        ended(scene_command("run", &scene, &folder, &coarse), 0);
        let types = summary(&folder)["mesh"]["element_types"].clone();
        let linear = ["tet4", "pyramid5", "wedge6", "hex8"];
        let mut types = types.as_object().unwrap().keys();
        assert!(
            types.all(|name| linear.contains(&name.as_str())),
            "{scene:?}"
        );
        assert_eq!(table(&folder, "response.csv").len(), 2);
    }
}

/// `cargo run` becomes the program in the same process, which then has the time of the compilers it
/// waited for.
#[cfg(target_os = "linux")]
#[test]
fn processor_seconds_are_those_of_the_program_alone() {
    let out = Folder::new("processor");
    let burn = "i=0; while [ $i -lt 1000000 ]; do i=$((i+1)); done";
    let script = format!("sh -c '{burn}'; {burn}; cat /proc/$$/stat > \"$0\"; exec \"$@\"");
    let run = scene_command("static", "scenes/verification/jenkins.toml", &out, &[]);
    let mut command = Command::new("sh");
    command.current_dir(root()).args(["-c", &script]);
    command.arg(out.join("stat")).arg(run.get_program());
    command.args(run.get_args()).args(["--threads", "1"]);
    ended(command, 0);
    let stat = out.text("stat");
    let (_, fields) = stat.rsplit_once(')').unwrap();
    let ticks = fields.split_whitespace().skip(11).take(4);
    let burnt_s: f64 = ticks.map(|t| t.parse::<f64>().unwrap() / 100.0).sum();
    let own_s = summary(&out)["processor_seconds"].as_f64().unwrap();
    assert!(
        (0.0..0.5 * burnt_s).contains(&own_s),
        "{own_s} s after {burnt_s} s of others"
    );
}
