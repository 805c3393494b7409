//! `dovetail peaks`: the peak over values of a key, beside whole curves, and its files.

use std::path::Path;
use std::process::Command;

use crate::shared_program::{ended, program, said_in_one_line};
use dovetail_testkit::folder::{Folder, root};

/// Command about the reduced model of 72 pairs.
fn dovetail(command: &str, out: &Path, rest: &[&str]) -> Command {
    let words = [
        &[command, "benches/peers/scene.toml", "--no-cache"][..],
        &["--set", "response.points=", "--set", "response.harmonics=1"],
        &["--set", "response.times_first_linear_mode=[0.96, 1.01]"],
        &["--set", "response.samples=64", "--out"],
    ];
    let mut command = program(root(), &words.concat());
    command.arg(out).args(rest);
    command
}

/// What a command prints that has to end well.
fn printed(command: Command) -> String {
    String::from_utf8(ended(command, 0).stdout).unwrap()
}

/// Cells of a table by the heading of their column.
fn column(folder: &Path, file: &str, heading: &str) -> Vec<f64> {
    let text = std::fs::read_to_string(folder.join(file)).unwrap();
    let mut lines = text.lines().map(|line| line.split(','));
    let place = lines.next().unwrap().position(|h| h == heading);
    let place = place.unwrap_or_else(|| panic!("{file} has no {heading}"));
    lines
        .map(|mut cells| cells.nth(place).unwrap().parse().unwrap())
        .collect()
}

#[test]
fn peaks_over_friction_are_those_of_runs_and_the_least_one_is_between_them() {
    let out = Folder::new("peaks");
    let over = ["--over", "reduced_model.friction=0.02:0.3:4"];
    let printed = printed(dovetail("peaks", &out, &over));
    let values = column(&out, "peaks.csv", "reduced_model.friction");
    let amplitudes = column(&out, "peaks.csv", "amplitude_m");
    assert_eq!((values[0], values[values.len() - 1]), (0.02, 0.3));
    for (value, amplitude_m) in values.iter().zip(&amplitudes) {
        let run = Folder::new("peaks_run");
        let friction = format!("reduced_model.friction={value:?}");
        ended(
            dovetail("run", &run, &["--no-fields", "--set", &friction]),
            0,
        );
        let whole = column(&run, "response.csv", "tip_amplitude_m");
        let whole = whole.into_iter().fold(0.0, f64::max);
        let off = amplitude_m / whole - 1.0;
        assert!(off.abs() < 1e-3, "{value}: {off:e}");
    }
    assert!(
        printed.contains("peak of tip over reduced_model.friction"),
        "{printed}"
    );
    for picture in ["amplitude", "frequency", "loss_factor"] {
        let svg = std::fs::read_to_string(out.join(format!("plots/peaks_{picture}.svg")));
        assert!(svg.unwrap().contains("friction"), "{picture}");
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
    let printed = printed(dovetail("peaks", &out, &over));
    assert_eq!(
        column(&out, "peaks.csv", "reduced_model.force_n"),
        [0.5, 0.5, 1.0, 1.0]
    );
    assert_eq!(
        column(&out, "peaks.csv", "reduced_model.friction"),
        [0.1, 0.2, 0.1, 0.2]
    );
    assert!(printed.contains("force 0.5 N"), "{printed}");
    let map = std::fs::read_to_string(out.join("plots/peaks_map.svg")).unwrap();
    assert!(
        map.contains("Peak amplitude of tip over friction and force (N)"),
        "{map}"
    );
}

#[test]
fn what_cannot_be_gone_through_is_refused_with_a_remedy() {
    let out = Folder::new("peaks_refused");
    for (rest, code, says) in [
        (
            &["--over", "reduced_model.fiction=0.1:1:2"][..],
            2,
            "friction",
        ),
        (
            &["--over", "reduced_model.friction=-1:1:3"][..],
            2,
            "friction",
        ),
        (
            &["--over", "response.harmonics=1:3:2"][..],
            2,
            "dovetail study",
        ),
        (
            &["--over", "reduced_model.force_n=1:2:2", "--observe", "hub"][..],
            2,
            "hub",
        ),
        (&[][..], 2, "--over"),
    ] {
        let refused = said_in_one_line(&ended(dovetail("peaks", &out, rest), code));
        assert!(refused.contains(says), "{rest:?}: {refused}");
    }
    // The resonance lies above the range.
    let below = ["--set", "response.times_first_linear_mode=[0.9, 0.95]"];
    let over = ["--over", "reduced_model.force_n=0.1:0.2:2"];
    let none = dovetail("peaks", &out, &[&below[..], &over].concat());
    let told = said_in_one_line(&ended(none, 3));
    assert!(told.contains("no peak at force 0.1 N"), "{told}");
}
