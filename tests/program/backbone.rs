//! `dovetail backbone`: frequency and damping over the amplitude, beside the peak of a run, and its
//! files.

use std::path::Path;
use std::process::Command;

use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, printed, scene_command, told};
use crate::shared_runs::numbers;

/// Command about the reduced model of 72 pairs.
fn dovetail(command: &str, out: &Path, rest: &[&str]) -> Command {
    let set = [
        "response.points=",
        "response.harmonics=1",
        "response.times_first_linear_mode=[0.98, 1.01]",
        "response.samples=64",
    ];
    let mut command = scene_command(command, "benches/peers/scene.toml", out, &set);
    command.args(rest);
    command
}

#[test]
fn the_force_of_an_amplitude_is_that_whose_curve_has_its_peak_there() {
    let out = Folder::new("backbone");
    let asked = ["--mode", "1", "--amplitude", "1e-6:2e-3", "--points", "6"];
    let printed = printed(&ended(dovetail("backbone", &out, &asked), 0));
    has(&printed, "backbone of linear mode 1");
    let column = |heading: &str| numbers(&out.join("backbone.csv"), heading);
    let (amplitudes, forces) = (column("amplitude_m"), column("force_n"));
    assert_eq!(amplitudes.len(), 6);
    assert!((amplitudes[5] / 2e-3 - 1.0).abs() < 1e-4);
    let force = format!("reduced_model.force_n={:?}", forces[5]);
    let run = Folder::new("backbone_run");
    ended(dovetail("run", &run, &["--no-fields", "--set", &force]), 0);
    let whole = numbers(&run.join("response.csv"), "tip_amplitude_m");
    let peak_m = whole.into_iter().fold(0.0, f64::max);
    assert!((peak_m / amplitudes[5] - 1.0).abs() < 2e-3, "{peak_m}");
    // Nothing slips at first.
    assert_eq!(column("slipping_pairs")[0], 0.0);
    assert_eq!(column("friction_ratio")[0], 0.0);
    assert!((column("damping_ratio")[0] / 1e-3 - 1.0).abs() < 1e-6);
    assert!(column("friction_ratio")[5] > 1e-4);
    assert!(column("power_defect").iter().all(|off| off.abs() < 1e-6));
    for picture in ["frequency", "damping", "peak"] {
        let svg = out.text(&format!("plots/backbone_{picture}.svg"));
        assert!(
            svg.contains("amplitude") || svg.contains("Peak"),
            "{picture}"
        );
    }
}

/// The mode with the largest shape in the range takes the least modal amplitude of all for the same
/// displacement.
#[test]
fn a_mode_is_chosen_by_its_shape_in_the_range_of_frequencies() {
    let out = Folder::new("backbone_shape");
    let run = |mode: &str, range: &str| {
        let asked = ["--mode", mode, "--amplitude", "1e-7:2e-7", "--points", "2"];
        let wide = format!("response.times_first_linear_mode={range}");
        let mut command = dovetail("backbone", &out, &asked);
        command.args(["--set", &wide]).arg("--force");
        let printed = printed(&ended(command, 0));
        let number = printed.split("linear mode ").nth(1).unwrap();
        let number: usize = number.split(' ').next().unwrap().parse().unwrap();
        let modal = numbers(&out.join("backbone.csv"), "modal_amplitude_m_sqrt_kg");
        (number, modal[0])
    };
    // Modes 2 to 5 of this model lie from 3.7 to 10.9 times the first, mode 6 at 12.6.
    let range = "[1.5, 12]";
    let all: Vec<(usize, f64)> = (2..=5).map(|mode| run(&mode.to_string(), range)).collect();
    let least = all.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    assert_eq!(run("shape", range), *least, "{all:?}");
    let asked = ["--mode", "shape", "--amplitude", "1e-7:2e-7"];
    let mut nowhere = dovetail("backbone", &out, &asked);
    nowhere.args(["--set", "response.times_first_linear_mode=[0.2, 0.3]"]);
    let said = told(nowhere, 2);
    has(&said, "no linear mode lies from");
    has(&said, "--mode a number");
}

#[test]
fn an_amplitude_that_the_mode_does_not_reach_is_told_with_the_last_one_that_it_does() {
    let out = Folder::new("backbone_ends");
    let asked = ["--amplitude", "1e-3:1e-2", "--points", "4"];
    let said = told(dovetail("backbone", &out, &asked), 3);
    has(&said, "the backbone ends at 2.154 mm");
    has(&said, "2 of 4 amplitudes were not reached");
    assert_eq!(numbers(&out.join("backbone.csv"), "amplitude_m").len(), 2);
}

#[test]
fn what_is_no_backbone_is_refused_with_a_remedy() {
    let out = Folder::new("backbone_refused");
    for (rest, says) in [
        ("--amplitude 1e-3:1e-6", "ascend"),
        ("--amplitude 1e-3", "FROM:TO"),
        (
            "--amplitude 1e-6:1e-3 --mode 9999",
            "there is no linear mode 9999",
        ),
        ("--amplitude 1e-6:1e-3 --mode 0", "at least 1"),
        ("--amplitude 1e-6:1e-3 --observe hub", "hub"),
        ("--amplitude 1e-6:1e-3 --points 1", "points"),
        ("", "--amplitude"),
    ] {
        let rest: Vec<&str> = rest.split_whitespace().collect();
        has(&told(dovetail("backbone", &out, &rest), 2), says);
    }
}
