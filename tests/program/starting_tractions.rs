//! The range of a response over the tractions from which it may start.

use crate::shared_program::{SMALL, said, scene_command, unwrapped};
use crate::shared_runs::{Run, number};
use dovetail_testkit::folder::Folder;

const WEAK: &str = "excitation.*.force_n=0.1";
const STARTS: &str = "static.starting_tractions=3";

fn run(name: &str, set: &[&str]) -> Run {
    let quick = [
        SMALL,
        "response.compare_harmonics=",
        "response.harmonics=1",
        "response.samples=64",
    ];
    Run::run_without_fields("paper", name, &[&quick[..], set].concat())
}

/// Under a small force the tractions make a difference: the range holds the peaks of all, and that of
/// an overload is the peak of a run that has this overload itself. Under a large one all pairs slide,
/// and forget what they started from.
#[test]
fn the_range_over_starting_tractions_is_that_of_runs_from_them() {
    let weak = run("tractions_weak", &[WEAK, STARTS]);
    let rows = weak.table("tractions.csv");
    let starts: Vec<&str> = rows.iter().map(|row| &row["start"][..]).collect();
    assert_eq!(
        starts,
        ["load_path", "normal_first", "overload_2", "scattered_1"]
    );
    let peaks: Vec<f64> = rows
        .iter()
        .map(|row| number(row, "peak_amplitude_m"))
        .collect();
    let summary = weak.summary();
    let range = &summary["response"]["traction_range"];
    let [least, most] = [0, 1].map(|end| range["peak_amplitude_m"][end].as_f64().unwrap());
    assert_eq!(least, peaks.iter().copied().fold(f64::INFINITY, f64::min));
    assert_eq!(most, peaks.iter().copied().fold(0.0, f64::max));
    assert!(most > 1.01 * least, "{peaks:?}");
    assert_eq!(range["tractions"], 4);
    let check = &summary["checks"]["residual_tractions"];
    let verdict = if 1.0 - least / most > 0.02 {
        "large"
    } else {
        "small"
    };
    assert_eq!(
        (&check["verdict"], &check["tractions"]),
        (&verdict.into(), &4.into())
    );
    let change = check["peak_change"].as_f64().unwrap();
    assert!((change - (1.0 - least / most)).abs() < 1e-12, "{check}");
    assert!(check["command"].is_null());
    assert_eq!(
        summary["response"]["peak_amplitude_m"].as_f64().unwrap(),
        peaks[0]
    );
    let picture = std::fs::read_to_string(weak.0.join("plots/response_tip.svg")).unwrap();
    assert!(picture.contains("least over 4 starting tractions"));

    // Twice the centrifugal load is that of sqrt(2) times the speed of 5000 rpm.
    let by_way_of = "static.path.0.speed_rpm=7071.0678118654755";
    let overloaded = run("tractions_overload", &[WEAK, by_way_of]);
    let peak = overloaded.summary()["response"]["peak_amplitude_m"]
        .as_f64()
        .unwrap();
    assert!((peaks[2] / peak - 1.0).abs() < 1e-9, "{} {peak}", peaks[2]);

    let strong = run("tractions_strong", &["excitation.*.force_n=3", STARTS]);
    let summary = strong.summary();
    let range = &summary["response"]["traction_range"]["peak_amplitude_m"];
    let [least, most] = [0, 1].map(|end| range[end].as_f64().unwrap());
    assert!(most / least - 1.0 < 2e-3, "{least} {most}");
    assert_eq!(summary["checks"]["residual_tractions"]["verdict"], "small");
}

/// In a run-up each speed has a static state of its own.
#[test]
fn starting_tractions_exclude_a_run_up() {
    let out = Folder::new("tractions_refused");
    let set = [
        STARTS,
        "response.along_engine_order=5",
        "response.compare_harmonics=",
        "response.times_first_linear_mode=",
        "response.speed_rpm=[4000, 6000]",
    ];
    let output = scene_command("run", "scenes/paper.toml", &out, &set)
        .output()
        .unwrap();
    assert!(!output.status.success());
    let said = unwrapped(&said(&output));
    for word in [
        "static.starting_tractions",
        "exclude each other",
        "at one speed",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
}
