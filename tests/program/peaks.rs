//! `dovetail peaks`: the peak over values of a key, beside whole curves, and its files.

use std::path::Path;
use std::process::Command;

use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, printed, program, scene_command, told};
use crate::shared_runs::{number, numbers, rows};
use dovetail_testkit::folder::root;

/// Command about the reduced model of 72 pairs.
fn dovetail(command: &str, out: &Path, rest: &[&str]) -> Command {
    let set = [
        "response.points=",
        "response.harmonics=1",
        "response.times_first_linear_mode=[0.96, 1.01]",
        "response.samples=64",
    ];
    let mut command = scene_command(command, "benches/peers/scene.toml", out, &set);
    command.args(rest);
    command
}

/// Cells of peaks.csv by the heading of their column.
fn column(out: &Path, heading: &str) -> Vec<f64> {
    numbers(&out.join("peaks.csv"), heading)
}

#[test]
fn peaks_over_friction_are_those_of_runs_and_the_least_one_is_between_them() {
    let out = Folder::new("peaks");
    let over = ["--over", "reduced_model.friction=0.02:0.3:4"];
    let printed = printed(&ended(dovetail("peaks", &out, &over), 0));
    let values = column(&out, "reduced_model.friction");
    let amplitudes = column(&out, "amplitude_m");
    assert_eq!((values[0], values[values.len() - 1]), (0.02, 0.3));
    for (value, amplitude_m) in values.iter().zip(&amplitudes) {
        let run = Folder::new("peaks_run");
        let friction = format!("reduced_model.friction={value:?}");
        let words = ["--no-fields", "--set", &friction];
        ended(dovetail("run", &run, &words), 0);
        let whole = numbers(&run.join("response.csv"), "tip_amplitude_m");
        let whole = whole.into_iter().fold(0.0, f64::max);
        let off = amplitude_m / whole - 1.0;
        assert!(off.abs() < 1e-3, "{value}: {off:e}");
    }
    has(&printed, "peak of tip over reduced_model.friction");
    for picture in ["amplitude", "frequency", "loss_factor"] {
        let svg = out.text(&format!("plots/peaks_{picture}.svg"));
        assert!(svg.contains("friction"), "{picture}");
        // The force, which is the same for all peaks.
        assert!(
            svg.contains("\n1 N\n") && !svg.contains("friction 0."),
            "{picture}"
        );
    }
}

/// A case of a study is a run, whose curve has points added at its peaks.
#[test]
fn peaks_of_the_cases_of_a_study_are_those_of_the_command() {
    let folder = Folder::new("peaks_study");
    let forces = "[0.1, 0.24, 0.55, 0.72, 1.0]";
    let scene = root().join("benches/peers/scene.toml");
    let study = format!(
        r#"
name = "forces"
scene = {scene:?}
set = [
    "response.points=", "response.harmonics=1", "response.samples=64",
    "response.times_first_linear_mode=[0.96, 1.01]",
]
quantities = ["peak_amplitude_m", "peak_frequency_hz", "loss_factor"]
[[parameter]]
key = "reduced_model.force_n"
values = {forces}
"#
    );
    folder.write("study.toml", study);
    let mut command = program(root(), &["study"]);
    command.arg(folder.join("study.toml"));
    ended(command.arg("--out").arg(folder.join("study")), 0);
    let cases = rows(&folder.join("study/table.csv"));
    assert_eq!(cases.len(), 5);
    for case in cases {
        let out = folder.join("peaks");
        let force_n = number(&case, "force_n");
        // At the first value the whole curve is followed, and at the second one the peak alone.
        let over = format!("reduced_model.force_n={:?}:{force_n:?}:2", 0.99 * force_n);
        ended(dovetail("peaks", &out, &["--over", &over, "--force"]), 0);
        let peaks = rows(&out.join("peaks.csv"));
        let peak = peaks.last().unwrap();
        let off = [
            ("peak_amplitude_m", "amplitude_m"),
            ("peak_frequency_hz", "frequency_hz"),
            ("loss_factor", "loss_factor"),
        ]
        .map(|(of_case, of_peak)| number(&case, of_case) / number(peak, of_peak) - 1.0);
        println!("{force_n} N: amplitude, frequency, loss factor off by {off:?}");
        assert!(
            off.iter().all(|off| off.abs() < 1e-4),
            "{force_n} N: {off:?}"
        );
    }
}

#[test]
fn two_ranges_give_a_line_for_each_value_of_the_second_and_a_map() {
    let out = Folder::new("peaks_map");
    let over = [
        "--over",
        "reduced_model.friction=0.1:0.2:2",
        "--over",
        "reduced_model.force_n=0.5:1:2",
    ];
    let printed = printed(&ended(dovetail("peaks", &out, &over), 0));
    let [forces_n, frictions] =
        ["force_n", "friction"].map(|key| column(&out, &format!("reduced_model.{key}")));
    assert_eq!(forces_n, [0.5, 0.5, 1.0, 1.0]);
    assert_eq!(frictions, [0.1, 0.2, 0.1, 0.2]);
    has(&printed, "force 0.5 N");
    let map = out.text("plots/peaks_map.svg");
    has(&map, "Peak amplitude of tip over friction and force (N)");
}

#[test]
fn what_cannot_be_gone_through_is_refused_with_a_remedy() {
    let out = Folder::new("peaks_refused");
    for (rest, says) in [
        ("--over reduced_model.fiction=0.1:1:2", "friction"),
        ("--over reduced_model.friction=-1:1:3", "friction"),
        ("--over response.harmonics=1:3:2", "dovetail study"),
        ("--over reduced_model.force_n=1:2:2 --observe hub", "hub"),
        ("", "--over"),
    ] {
        let rest: Vec<&str> = rest.split_whitespace().collect();
        has(&told(dovetail("peaks", &out, &rest), 2), says);
    }
    // The resonance lies above the range.
    let below = ["--set", "response.times_first_linear_mode=[0.9, 0.95]"];
    let over = ["--over", "reduced_model.force_n=0.1:0.2:2"];
    let none = dovetail("peaks", &out, &[&below[..], &over].concat());
    let said = told(none, 3);
    has(
        &said,
        "no peak at force 0.1 N, nor at 1 more up to force 0.2 N",
    );
    assert_eq!(said.matches("no peak at").count(), 1, "{said}");
}

/// Wear does not change the vibration of a pair.
#[test]
fn a_key_that_no_motion_depends_on_is_refused() {
    let out = Folder::new("peaks_unread");
    let over = "reduced_model.wear_m2_n=1e-14:1e-13:2";
    for (command, rest) in [
        ("peaks", &["--over", over][..]),
        ("curve", &["--over", over, "--frequency", "450"]),
    ] {
        let said = told(dovetail(command, &out, rest), 2);
        has(&said, "does not depend on `reduced_model.wear_m2_n`");
    }
}
