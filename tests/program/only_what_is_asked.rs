//! Omitted parts of a scene cost nothing: stages and unknowns of runs of one joint, from
//! summary.json. The other parts give the expected results.

use crate::shared_folder::Folder;
use crate::shared_runs;
use dovetail_testkit::folder::root;

const PAPER: &str = include_str!("../../scenes/paper.toml");
const PATCH: &str = include_str!("../../scenes/verification/patch.toml");
const ROTATION: &str = "rotation={ axis = [0, 0, 1], speed_rpm = 50, prestress = \"held_flanks\" }";
const HARMONICS: &str = "response.harmonics=3";

/// Run of a scene that is given as a text; its files are removed at the end.
struct Run(shared_runs::Run);

impl Run {
    /// Run of `dovetail run` of the patch scene on its ready mesh.
    fn new(name: &str, scene: &str, set: &[&str]) -> Self {
        let set = [&["mesh.file=meshes/verification/patch.msh"], set].concat();
        Self::run_command("run", name, scene, &set)
    }

    fn run_command(command: &str, name: &str, scene: &str, set: &[&str]) -> Self {
        let folder = Folder::new(name);
        let file = folder.write("scene.toml", scene);
        // Paths count from the folder of the scene.
        let meshes = format!("={}/meshes/", root().display());
        let set: Vec<String> = set.iter().map(|s| s.replace("=meshes/", &meshes)).collect();
        let set: Vec<&str> = set.iter().map(String::as_str).collect();
        Self(shared_runs::Run::run_file(command, &file, name, &set))
    }

    fn summary(&self) -> serde_json::Value {
        self.0.summary()
    }

    /// Stages that solve something, with the unknowns of each system.
    fn solved(&self) -> Vec<(String, Vec<u64>)> {
        let summary = self.summary();
        let stages = summary["stages"].as_array().unwrap().iter();
        let of = |s: &serde_json::Value| {
            let unknowns = s["unknowns"].as_array().unwrap().iter();
            let name = s["name"].as_str().unwrap().to_owned();
            (name, unknowns.map(|n| n.as_u64().unwrap()).collect())
        };
        stages
            .map(of)
            .filter(|s: &(_, Vec<_>)| !s.1.is_empty())
            .collect()
    }

    fn column(&self, file: &str, column: &str) -> Vec<f64> {
        self.0.column(file, column)
    }
}

/// Scene of the upper block alone, on rigid ground.
fn alone() -> String {
    drop_second_body(PATCH, "[[contact]]")
}

/// Scene without its second body, whose table ends before `next`.
fn drop_second_body(scene: &str, next: &str) -> String {
    let at = scene.rfind("[[body]]").unwrap();
    let end = at + scene[at..].find(next).unwrap();
    let all = format!("{}{}", &scene[..at], &scene[end..]);
    let kept = all.lines().filter(|l| !l.starts_with("second = "));
    kept.collect::<Vec<_>>().join("\n")
}

fn stages(of: &[(&str, &[u64])]) -> Vec<(String, Vec<u64>)> {
    of.iter()
        .map(|(name, n)| ((*name).to_owned(), n.to_vec()))
        .collect()
}

#[track_caller]
fn close(a: &[f64], b: &[f64], tolerance: f64) {
    assert!(a.len() == b.len() && !a.is_empty());
    let scale = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (a, b) in a.iter().zip(b) {
        assert!((a - b).abs() <= tolerance * scale, "{a} {b}");
    }
}

#[test]
fn every_stage_and_unknown_is_one_that_the_scene_asks_for() {
    // Free dofs of the upper and the lower block less the 90 of the 30 flank nodes; the assembly
    // has one flank.
    let held: [u64; 2] = [2625, 2097];
    let assembly: [u64; 1] = [2625 + 2097 + 90];
    let all = Run::new("all", PATCH, &[ROTATION, HARMONICS]);
    let expected = stages(&[
        ("finite elements", &held),
        ("reduction", &assembly),
        ("static state", &[90]),
        ("response, 3 harmonics", &[7 * 90]),
    ]);
    assert_eq!(all.solved(), expected);

    let still = Run::new("still", PATCH, &[HARMONICS]);
    assert_eq!(still.solved(), expected[1..]);

    // The stress of the static state takes one system of the stuck assembly to begin with, and all
    // again until it is settled.
    let of_contact = Run::new(
        "contact",
        PATCH,
        &[HARMONICS, &ROTATION.replace("held_flanks", "contact")],
    );
    let pass = stages(&[
        ("finite elements", &assembly),
        ("reduction", &assembly),
        ("static state", &[90]),
    ]);
    let solved = of_contact.solved();
    assert_eq!(solved[..3], pass);
    let settled = [&pass[1..], &pass[2..], &expected[3..]].concat();
    assert_eq!(solved[3..], settled);

    let one = Run::new("one", PATCH, &[ROTATION]);
    let response = stages(&[("response, 1 harmonic", &[3 * 90])]);
    assert_eq!(one.solved(), [&expected[..3], &response].concat());

    let set = [ROTATION, HARMONICS, "contact.0.law=bonded"];
    let tied = Run::new("tied", PATCH, &set);
    // The 69 mid-edge nodes of the joint have unknowns of their own, once for both blocks.
    let joined = stages(&[
        ("finite elements", &held),
        ("reduction", &[assembly[0] + 3 * 69]),
    ]);
    assert_eq!(tied.solved(), joined);
    let summary = tied.summary();
    let count = |key: &str| summary[key].as_u64().unwrap();
    assert_eq!(
        (count("pairs"), count("bonded_pairs"), count("stuck_modes")),
        (0, 30 + 69, 12)
    );
    assert!(summary["static"].is_null());
    let files = ["flank.pvd", "static.vtu", "peak.vtu"].map(|f| tied.0.0.join(f).exists());
    assert_eq!(files, [false, true, true]);
    let names = summary["stages"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s["name"].as_str().unwrap());
    assert!(names.clone().any(|n| n == "linear response"));
    // It is a response all the same, for those who add up what responses took.
    let all = summary["stages"].as_array().unwrap().iter();
    let mut ids = all.map(|s| (s["name"].as_str().unwrap(), s["id"].as_str().unwrap()));
    assert!(ids.any(|stage| stage == ("linear response", "response")));
    assert!(
        !names
            .clone()
            .any(|n| n == "static state" || n.starts_with("response,"))
    );

    let rigid = Run::new("rigid", &alone(), &[ROTATION, HARMONICS]);
    let expected = stages(&[
        ("finite elements", &held[..1]),
        ("reduction", &held[..1]),
        ("static state", &[90]),
        ("response, 3 harmonics", &[7 * 90]),
    ]);
    assert_eq!(rigid.solved(), expected);
    let summary = rigid.summary();
    assert_eq!(summary["mesh"]["bodies"].as_array().unwrap().len(), 1);
    assert_eq!(summary["stuck_modes"].as_u64(), Some(48));

    let least = Run::new("least", &alone(), &["contact.0.law=bonded"]);
    assert_eq!(least.solved(), expected[1..2]);
    assert_eq!(least.summary()["mesh"]["free_dofs"].as_u64(), Some(held[0]));
}

/// Loads are vectors: what acts on all nodes of a surface, or on all of both bodies, adds no
/// unknown.
#[test]
fn a_cause_that_acts_on_many_nodes_keeps_no_unknown() {
    let at_a_point = Run::new("point", PATCH, &[HARMONICS]);
    let (none, top) = ("excitation.0.force_n=", "excitation.0.on=upper_top");
    let no_direction = "excitation.0.direction=";
    for (name, set) in [
        (
            "pressed",
            &[none, no_direction, top, "excitation.0.pressure_pa=1e3"][..],
        ),
        ("pulled", &[none, top, "excitation.0.traction_pa=1e3"]),
        (
            "shaken",
            &[
                none,
                "excitation.0.on=",
                "excitation.0.base_acceleration_m_s2=1",
            ],
        ),
    ] {
        let run = Run::new(name, PATCH, &[&[HARMONICS][..], set].concat());
        assert_eq!(run.solved(), at_a_point.solved(), "{name}");
        let amplitudes = run.column("response.csv", "corner_amplitude_m");
        assert!(
            amplitudes.iter().all(|a| *a > 0.0),
            "{name}: {amplitudes:?}"
        );
        assert_eq!(
            run.summary()["stuck_modes"],
            at_a_point.summary()["stuck_modes"]
        );
    }
}

#[test]
fn bonded_flanks_answer_like_stuck_ones() {
    // Between two bodies of quadratic elements the mid-edge nodes of stuck flanks follow their corners,
    // and the unknowns of bonded flanks move by themselves.
    for (scene, tolerance) in [(PATCH.to_owned(), 1e-3), (alone(), 1e-12)] {
        let stuck = Run::new("stuck", &scene, &["response.points=9", HARMONICS]);
        let set = ["response.points=9", HARMONICS, "contact.0.law=bonded"];
        let tied = Run::new("bonded", &scene, &set);
        let linear = stuck.column("response.csv", "corner_linear_amplitude_m");
        close(
            &tied.column("response.csv", "corner_amplitude_m"),
            &linear,
            tolerance,
        );
        let [input, viscous] =
            ["input_power_w", "viscous_power_w"].map(|c| tied.column("response.csv", c));
        close(&input, &viscous, 1e-12);
        assert!(input.iter().all(|p| *p > 0.0));
        // The steady load presses the stuck flanks as it presses the bonded ones.
        let observed = |run: &Run| run.column("static_observed.csv", "displacement_m");
        close(&observed(&tied), &observed(&stuck), 1e-3);
    }
}

#[test]
fn rigid_ground_is_the_limit_of_a_stiff_second_body() {
    let set = [
        "excitation.0.force_n=180",
        "contact.0.friction=0.1",
        HARMONICS,
        "response.points=3",
    ];
    let rigid = Run::new("ground", &alone(), &set);
    let against = |times: f64| {
        let young = format!("body.1.young_pa={}", 200e9 * times);
        let held = "body.1.fixed=[\"lower_base\"]";
        let light = "body.1.density_kg_m3=1";
        let stiff = Run::new(
            &format!("stiff{times:e}"),
            PATCH,
            &[&set[..], &[&young, held, light]].concat(),
        );
        let error = |file: &str, column: &str| {
            let (a, b) = (stiff.column(file, column), rigid.column(file, column));
            let scale = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let worst = a
                .iter()
                .zip(&b)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(a.len() == b.len() && scale > 0.0);
            worst / scale
        };
        [
            error("static.csv", "normal_force_n"),
            error("static.csv", "slip_m"),
            error("response.csv", "corner_amplitude_m"),
            error("response.csv", "friction_power_w"),
        ]
    };
    let (stiff, stiffer) = (against(1e3), against(1e5));
    for (coarse, fine) in stiff.into_iter().zip(stiffer) {
        assert!(fine < 2e-4 && fine < 0.05 * coarse, "{coarse:e} {fine:e}");
    }
}

/// The flanks stand at 45 degrees and carry the blade's centrifugal force by their normals: statics
/// alone gives their sum, whatever the bodies are made of.
#[test]
fn frictionless_flanks_carry_the_load_by_their_normals() {
    let mesh = crate::shared_bodies::ready("dovetail_order1.msh");
    let omega = 5000.0 * std::f64::consts::PI / 30.0;
    let of_tet = |&e: &u32| {
        let [a, b, c, d] =
            [0, 1, 2, 3].map(|i| mesh.nodes_m[mesh.elements.element_nodes(e as usize)[i] as usize]);
        let edge = |to: [f64; 3]| [0, 1, 2].map(|k| to[k] - a[k]);
        let [u, v, w] = [b, c, d].map(edge);
        let volume = (u[0] * (v[1] * w[2] - v[2] * w[1])
            + u[1] * (v[2] * w[0] - v[0] * w[2])
            + u[2] * (v[0] * w[1] - v[1] * w[0]))
            .abs()
            / 6.0;
        4430.0 * omega * omega * volume * (a[2] + b[2] + c[2] + d[2]) / 4.0
    };
    let upwards_n: f64 = mesh.groups["blade"].elements.iter().map(of_tet).sum();
    assert!(upwards_n > 7e3);
    let rigid = drop_second_body(PAPER, "[rotation]").replace("\"blade\", \"jaw\"", "\"blade\"");
    for (name, scene) in [("frictionless", PAPER), ("frictionless_rigid", &rigid)] {
        let set = [
            "mesh.file=meshes/dovetail_order1.msh",
            "contact.*.friction=0",
            "rotation.prestress=none",
        ];
        let run = Run::run_command("static", name, scene, &set);
        let sum = |column: &str| -> f64 { run.column("static.csv", column).iter().sum() };
        let carried_n = sum("normal_force_n") * 0.5f64.sqrt();
        let error = carried_n / upwards_n - 1.0;
        assert!(
            error.abs() < 1e-9,
            "{name}: {carried_n} {upwards_n} {error:e}"
        );
        for column in ["friction_t1_n", "friction_t2_n"] {
            assert!(run.column("static.csv", column).iter().all(|f| *f == 0.0));
        }
    }
}
