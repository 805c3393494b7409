//! `dovetail curve`: the motions at one frequency over values of a key, beside runs at these
//! values, and its files.

use std::path::Path;
use std::process::Command;

use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, printed, scene_command, told};
use crate::shared_runs::{number, numbers, rows, summary};

/// Frequency at which pairs stick, slip and open as the force grows, Hz.
const FREQUENCY_HZ: f64 = 693.2;

/// Command about the reduced model of 72 pairs.
fn dovetail(command: &str, out: &Path, rest: &[&str]) -> Command {
    let set = [
        "response.points=2",
        "response.harmonics=1",
        "response.times_first_linear_mode=",
        "response.frequency_hz=[693.2, 693.2001]",
        "response.samples=64",
    ];
    let mut command = scene_command(command, "benches/peers/scene.toml", out, &set);
    command.args(rest);
    command
}

/// Over a force, a coefficient of friction and a clearance, evenly and by ratio.
#[test]
fn the_motions_over_a_key_are_those_of_runs() {
    for (key, range, values) in [
        ("reduced_model.force_n", "0.2:2.4:3", [0.2, 2.4]),
        ("reduced_model.friction", "0.3:0.4:2", [0.3, 0.4]),
        ("reduced_model.gap_m", "0:2e-6:3", [0.0, 2e-6]),
    ] {
        let out = Folder::new("curve");
        let over = format!("{key}={range}");
        let words = ["--over", &over, "--frequency", "693.2"];
        let printed = printed(&ended(dovetail("curve", &out, &words), 0));
        has(&printed, &format!("motions of tip at 693.2 Hz over {key}"));
        let table = rows(&out.join("curve.csv"));
        assert!(
            table.len() > 5 && table.len() < 80,
            "{key}: {}",
            table.len()
        );
        let ends = [&table[0], &table[table.len() - 1]];
        assert_eq!(ends.map(|row| number(row, key)), values);
        for row in [&table[0], &table[table.len() / 2], &table[table.len() - 1]] {
            let run = Folder::new("curve_run");
            let set = format!("{key}={:?}", number(row, key));
            ended(dovetail("run", &run, &["--no-fields", "--set", &set]), 0);
            let of_run = &rows(&run.join("response.csv"))[0];
            for (of_curve, of_run_name) in [
                ("amplitude_m", "tip_amplitude_m"),
                ("linear_amplitude_m", "tip_linear_amplitude_m"),
                ("friction_power_w", "friction_power_w"),
            ] {
                let (found, expected) = (number(row, of_curve), number(of_run, of_run_name));
                let off = (found - expected).abs();
                assert!(
                    off <= 2e-4 * expected.abs().max(1e-12),
                    "{set}: {of_curve} {found} {expected}"
                );
            }
            assert_eq!(number(row, "frequency_hz"), FREQUENCY_HZ);
        }
        has(&out.text("plots/curve_amplitude.svg"), "at 693.2 Hz");
        let summary = summary(&out);
        assert_eq!(summary["curve"]["key"], key);
        assert_eq!(summary["curve"]["motions"], table.len());
    }
}

/// A key that changes the bodies: each value has a reduction and a static state of its own.
#[test]
fn over_the_speed_the_motions_are_those_of_runs() {
    let command = |command: &str, out: &Path, rest: &[&str]| {
        let set = [
            "mesh.file=../meshes/dovetail_small.msh",
            "response.harmonics=1",
            "response.samples=64",
            "response.times_first_linear_mode=",
            "response.frequency_hz=[430, 430.0001]",
            "response.points=2",
            "response.stuck_modes=12",
            "response.compare_harmonics=",
            "excitation.*.force_n=5",
        ];
        let mut command = scene_command(command, "scenes/paper.toml", out, &set);
        command.args(rest);
        command
    };
    let out = Folder::new("curve_speed");
    let words = [
        "--over",
        "rotation.speed_rpm=4990:5000:2",
        "--frequency",
        "430",
    ];
    ended(command("curve", &out, &words), 0);
    let table = rows(&out.join("curve.csv"));
    for row in [&table[0], &table[table.len() / 2]] {
        let run = Folder::new("curve_speed_run");
        let set = format!("rotation.speed_rpm={:?}", number(row, "rotation.speed_rpm"));
        ended(command("run", &run, &["--no-fields", "--set", &set]), 0);
        let expected = numbers(&run.join("response.csv"), "tip_amplitude_m")[0];
        let off = number(row, "amplitude_m") / expected - 1.0;
        assert!(off.abs() < 2e-4, "{set}: {off:e}");
    }
}

#[test]
fn a_scene_without_a_contact_that_slips_has_no_curve() {
    let out = Folder::new("curve_bonded");
    let set = [
        "mesh.file=../meshes/dovetail_small.msh",
        "contact.*.law=bonded",
    ];
    let mut command = scene_command("curve", "scenes/paper.toml", &out, &set);
    command.args(["--over", "excitation.*.force_n=1:2", "--frequency", "430"]);
    has(&told(command, 2), "all contacts are bonded");
}

#[test]
fn what_no_curve_can_be_followed_over_is_refused_with_a_remedy() {
    let out = Folder::new("curve_refused");
    for (rest, says) in [
        ("--over name=1:2 --frequency 450", "name"),
        (
            "--over reduced_model.fiction=0.1:1 --frequency 450",
            "friction",
        ),
        (
            "--over reduced_model.friction=-1:1 --frequency 450",
            "friction",
        ),
        ("--over reduced_model.folder=1:2 --frequency 450", "folder"),
        (
            "--over response.harmonics=1:3 --frequency 450",
            "dovetail study",
        ),
        ("--over mesh.file=1:3 --frequency 450", "dovetail study"),
        (
            "--over static.load_steps=1:3 --frequency 450",
            "dovetail study",
        ),
        ("--over reduced_model.force_n=1:2 --frequency 0", "above 0"),
        (
            "--over reduced_model.force_n=1:2 --frequency -3",
            "--frequency",
        ),
        ("--over reduced_model.force_n=1:2", "--frequency"),
        ("--frequency 450", "--over"),
        (
            "--over reduced_model.force_n=1:2 --frequency 450 --observe hub",
            "hub",
        ),
    ] {
        let rest: Vec<&str> = rest.split_whitespace().collect();
        has(&told(dovetail("curve", &out, &rest), 2), says);
    }
}
