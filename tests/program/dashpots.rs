//! Dashpots and damping ratios of modes from the scene to the response: the small joint of the paper
//! with its contacts bonded, whose first peak is that of one mode.

use crate::shared_program::{said, scene_command, told, unwrapped};
use crate::shared_runs::Run;
use dovetail_testkit::folder::{Folder, root};
use std::f64::consts::TAU;

/// Ratio of critical damping of the paper's scene on mode 1.
const RATIO: f64 = 0.001;
const FORCE_N: f64 = 2.0;

/// Frequency and amplitude of the first peak of the tip, which is shaken where it is observed.
/// `added` stands at the end of the scene.
fn peak(added: &str, set: &[&str]) -> [f64; 2] {
    let folder = Folder::new("dashpots");
    let paper = std::fs::read_to_string(root().join("scenes/paper.toml")).unwrap();
    let scene = folder.write("scene.toml", format!("{paper}\n{added}"));
    let mesh = root().join("meshes/dovetail_small.msh");
    let mesh = format!("mesh.file={}", mesh.display());
    let all = [
        mesh.as_str(),
        "contact.*.law=\"bonded\"",
        "excitation.0.on=tip_trailing_edge",
        "excitation.0.force_n=2",
        "response.times_first_linear_mode=[0.99, 1.01]",
        "response.points=3",
    ];
    let run = Run::run_file("run", &scene, "dashpots", &[&all[..], set].concat());
    let response = &run.summary()["response"];
    ["linear_peak_frequency_hz", "linear_peak_amplitude_m"]
        .map(|key| response[key].as_f64().unwrap())
}

/// A mode of unit modal mass that moves by phi under the force and the dashpot has the amplitude
/// F phi^2 / (2 zeta w^2), and c phi^2 / (2 w) more damping.
#[test]
fn a_dashpot_and_a_ratio_lower_the_peak_of_a_mode_as_they_should() {
    let [hz, plain] = peak("", &[]);
    let omega = TAU * hz;
    let share = 2.0 * RATIO * omega.powi(2) * plain / FORCE_N;
    let of = |ratio: f64| FORCE_N * share / (2.0 * ratio * omega.powi(2));
    // As much as the material.
    let c = RATIO * 2.0 * omega / share;
    let dashpot = format!(
        "[[dashpot]]\nname = \"tip\"\nfirst = \"tip_trailing_edge\"\ndirection = [0, 1, 0]\ndamping_n_s_m = {c}\n"
    );
    let [_, damped] = peak(&dashpot, &[]);
    println!("{plain} {damped} {c}");
    assert!((damped / of(2.0 * RATIO) - 1.0).abs() < 1e-3);
    let [_, of_mode] = peak("", &["damping.modal_ratios=[0.003]"]);
    assert!((of_mode / of(3.0 * RATIO) - 1.0).abs() < 1e-3);
    // Mode 1 keeps what the other keys give it.
    let ratios = "damping.modal_ratios=[0.003, 0.5]";
    let [_, of_both] = peak(&dashpot, &[ratios]);
    assert!((of_both / of(4.0 * RATIO) - 1.0).abs() < 1e-3);
    let alone = [
        "damping.ratio=",
        "damping.linear_mode=",
        "damping.modal_ratios=[0.002]",
    ];
    let [_, of_mode] = peak("", &alone);
    assert!((of_mode / of(2.0 * RATIO) - 1.0).abs() < 1e-3);
}

#[test]
fn dashpots_and_ratios_that_cannot_be_are_refused() {
    let folder = Folder::new("dashpots");
    let paper = std::fs::read_to_string(root().join("scenes/paper.toml")).unwrap();
    let refused = |added: &str, set: &[&str], words: &[&str]| {
        let scene = folder.write("scene.toml", format!("{paper}\n{added}"));
        let mesh = root().join("meshes/dovetail_small.msh");
        let mesh = format!("mesh.file={}", mesh.display());
        let set = [&[mesh.as_str()], set].concat();
        let output = scene_command("run", &scene, &folder.join("out"), &set)
            .output()
            .unwrap();
        let said = unwrapped(&said(&output));
        assert!(!output.status.success());
        for word in words {
            assert!(said.contains(word), "{word}: {said}");
        }
    };
    let dashpot = "[[dashpot]]\nname = \"d\"\nfirst = \"tip_trailing_edge\"\n";
    refused(dashpot, &[], &["`dashpot.d.damping_n_s_m` is missing"]);
    let negative = format!("{dashpot}damping_n_s_m = -1\n");
    refused(
        &negative,
        &[],
        &["`dashpot.d.damping_n_s_m`", "greater than 0"],
    );
    let nowhere = "[[dashpot]]\nname = \"d\"\nfirst = \"nowhere\"\ndamping_n_s_m = 1\n";
    refused(nowhere, &[], &["dashpot `d`", "nowhere"]);
    let ratios = ["damping.modal_ratios=[0.1, 1.0]"];
    refused("", &ratios, &["`damping.modal_ratios`", "less than 1"]);
    let few = ["damping.modal_ratios=[0.1, 0.1]", "response.stuck_modes=1"];
    refused("", &few, &["`damping.modal_ratios` has 2 values", "only 1"]);
    let many = format!("damping.modal_ratios={:?}", [0.01; 200]);
    refused("", &[&many], &["has 200 values", "only 12 stuck modes"]);
    let set = ["damping.modal_ratios=[0.1]"];
    let scene = "scenes/verification/den_hartog.toml";
    let said = told(scene_command("run", scene, &folder.join("other"), &set), 2);
    assert!(said.contains("has 0 stuck modes"), "{said}");
}
