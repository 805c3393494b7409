//! Displacements, strains or clearances that are not small are reported. Two prisms whose exact
//! state is uniform (`scenes/verification/patch.toml`) are pressed together: the pressure on the
//! flank is the applied one, and if they are bonded every amplitude is proportional to the force.

use std::path::Path;
use std::process::{Command, Output};

use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, patch_command, said_in_one_line, told};
use crate::shared_runs::{Run, number, summary};

/// Young's modulus of the softer prism.
const YOUNG_PA: f64 = 100e9;
/// Longest side of the bounding box of the prism with the observed point.
const SIZE_M: f64 = 12e-3;
/// Smallest and largest extent of the flank, a quadrilateral, across the longer one of its sides.
const FLANK_M: [f64; 2] = [7e-3, 9e-3];

/// Settings that bond the flanks.
const BONDED: [&str; 2] = ["contact.flank.law=bonded", "contact.flank.friction="];

/// Command for the contact patch whose folder may hold a run of other settings.
fn command(word: &str, out: &Path, set: &[&str]) -> Command {
    let mut command = patch_command(word, out, set);
    command.arg("--force");
    command
}

/// Returns `true` if summary.json has a warning with these words; the output must agree.
#[track_caller]
fn is_warned(out: &Path, said: &Output, words: &str) -> bool {
    let summary = summary(out);
    let warnings = summary["warnings"].as_array().unwrap();
    let listed = warnings.iter().any(|warning| {
        let text = warning["text"].as_str().unwrap();
        text.contains(words) && warning["weight"] == "doubt"
    });
    assert_eq!(
        listed,
        said_in_one_line(said).contains(words),
        "{words}: {warnings:?}"
    );
    listed
}

#[test]
fn a_pressure_above_one_per_cent_of_youngs_modulus_is_warned_of() {
    let out = Folder::new("hard-pressed");
    for (share, expected) in [(0.0095, false), (0.0105, true)] {
        let pressure = format!("load.0.pressure_pa={}", share * YOUNG_PA);
        let said = ended(command("static", &out, &[&pressure]), 0);
        let found = &summary(&out)["static"]["largest_pressure_pa"];
        let off = found.as_f64().unwrap() / (share * YOUNG_PA) - 1.0;
        assert!(off.abs() < 1e-6, "the patch is uniform: {off}");
        assert_eq!(
            is_warned(&out, &said, "of Young's modulus"),
            expected,
            "{share}"
        );
        let report = out.text("report.html");
        assert_eq!(report.contains("of Young's modulus"), expected);
    }
}

/// Far below the first mode the flank is pressed as the load and the excitation are together.
#[test]
fn a_pressure_that_only_the_vibration_brings_is_warned_of_in_the_response() {
    let out = Folder::new("hard-shaken");
    for (share, expected) in [(0.0035, false), (0.005, true)] {
        let set = [
            "response.times_first_linear_mode=[0.01,0.02]",
            &format!("load.0.pressure_pa={}", 0.006 * YOUNG_PA),
            &format!(
                "excitation=[{{on=\"upper_top\",pressure_pa={}}}]",
                share * YOUNG_PA
            ),
        ];
        let said = ended(command("run", &out, &set), 0);
        let words = "in the response a pair of contact `flank` is pressed";
        assert_eq!(is_warned(&out, &said, words), expected, "{share}");
        let words = "in the static state a pair of contact";
        assert!(!is_warned(&out, &said, words));
    }
}

#[test]
fn wide_clearances_and_deep_interferences_are_warned_of() {
    let out = Folder::new("gaps");
    let (wide, deep) = ("has a clearance of", "has an interference of");
    let [least_m, largest_m] = FLANK_M;
    for (gap_m, clearance, interference) in [
        (0.0, false, false),
        (0.99 * least_m, false, false),
        (1.01 * largest_m, true, false),
        (-0.099 * least_m, false, false),
        (-0.101 * largest_m, false, true),
        (-1e6, false, true),
    ] {
        let gap = format!("contact.flank.gap_m={gap_m}");
        let said = ended(command("mesh", &out, &[&gap]), 0);
        assert_eq!(is_warned(&out, &said, wide), clearance, "{gap_m}");
        assert_eq!(is_warned(&out, &said, deep), interference, "{gap_m}");
    }
}

/// Bonded, the response is linear in the force.
#[test]
fn a_displacement_of_the_size_of_its_body_is_warned_of_and_then_refused() {
    let out = Folder::new("far-moved");
    let run = |force_n: f64| {
        let set = [
            BONDED[0],
            BONDED[1],
            "load.0.pressure_pa=1",
            &format!("excitation.0.force_n={force_n}"),
        ];
        command("run", &out, &set)
    };
    ended(run(1.0), 0);
    let peak = |out: &Path| summary(out)["response"]["peak_amplitude_m"].as_f64();
    let of_one_newton = peak(&out).unwrap();
    let words = "displacements are taken to be small";
    for (share, warned, code) in [
        (0.095, false, 0),
        (0.105, true, 0),
        (0.95, true, 0),
        (1.05, true, 1),
    ] {
        let said = ended(run(share * SIZE_M / of_one_newton), code);
        let found = peak(&out).unwrap();
        assert!((found / (share * SIZE_M) - 1.0).abs() < 1e-9, "{found}");
        assert_eq!(is_warned(&out, &said, words), warned, "{share}");
        let refused = said_in_one_line(&said).contains("more than the body is long");
        assert_eq!(refused, code == 1);
    }
    // What was found can be looked at.
    assert_eq!(summary(&out)["state"], "failed");
    let why = summary(&out)["why"].to_string();
    has(&why, "corner of body `upper`");
    assert!(out.join("response.csv").exists() && out.join("report.html").exists());
}

/// Bonded the prisms are still in a uniform state. Of all points the observed corner, 12 mm and
/// 9 mm from what holds the lower prism, moves farthest.
#[test]
fn a_static_displacement_of_the_size_of_its_body_is_warned_of() {
    let out = Folder::new("far-pressed");
    let widens = 1.5e-12;
    let per_pascal_m: [f64; 3] = [widens * 12e-3, widens * 9e-3, 8e-3 / 100e9 + 6e-3 / 200e9];
    let of_one_pascal_m = per_pascal_m.iter().map(|u| u * u).sum::<f64>().sqrt();
    for (share, expected) in [(0.095, false), (0.105, true)] {
        let set = [
            BONDED[0],
            BONDED[1],
            &format!("load.0.pressure_pa={}", share * SIZE_M / of_one_pascal_m),
        ];
        let said = ended(command("static", &out, &set), 0);
        let words = "in the static state a point of body `upper` moves by";
        assert_eq!(is_warned(&out, &said, words), expected, "{share}");
    }
}

/// The springs take the part of a force that friction does not take, and the upper prism slides.
#[test]
fn a_static_slide_that_is_far_is_told_once_in_a_run() {
    let out = Folder::new("far-slid");
    let set = [
        "contact.flank.friction=0.05",
        "spring=[{name=\"side\",first=\"upper_top\",stiffness_n_m=1e6}]",
        "load=[{on=\"upper_top\",pressure_pa=50e6},\
         {on=\"upper_top\",direction=[1,0,0],force_n=700}]",
    ];
    let said = ended(command("run", &out, &set), 0);
    assert!(is_warned(
        &out,
        &said,
        "in the static state a pair slides by"
    ));
    let summary = summary(&out);
    let warnings = summary["warnings"].as_array().unwrap().iter();
    let of_slide = warnings.filter(|w| w["text"].as_str().unwrap().contains("a pair slides by"));
    assert_eq!(of_slide.count(), 1, "{summary}");
}

/// The first of 15 harmonics alone lies below the single mode that is kept.
#[test]
fn harmonics_above_the_modes_that_are_kept_are_warned_of() {
    let out = Folder::new("few-modes");
    let set = ["response.stuck_modes=1", "response.harmonics=15"];
    let said = ended(command("run", &out, &set), 0);
    let reach = summary(&out)["truncation"]["modes_reach"].as_f64().unwrap();
    assert!(reach < 1.0, "{reach}");
    let words = format!("the last stuck mode kept lies at {reach:.2} times");
    assert!(is_warned(&out, &said, &words));
}

/// A load that the supports carry moves the bonded bodies by more than their length.
#[test]
fn a_static_state_that_moves_by_more_than_its_body_is_none() {
    let out = Folder::new("far-pulled");
    let set = [BONDED[0], BONDED[1], "load.0.pressure_pa=1e12"];
    let told = told(command("run", &out, &set), 1);
    has(&told, "more than the body is long");
    assert!(out.join("static.vtu").exists() && !out.join("response.csv").exists());
}

/// Friction holds the blade anywhere along its slot: a Newton step may move it by 94 mm, beyond the
/// end of such a short flank. If all pairs slip, only the static state determines where along the
/// slot it vibrates.
#[test]
fn a_blade_on_a_flank_of_2_x_2_nodes_vibrates_where_it_is_at_rest() {
    let set = [
        "mesh.parameters={nu=2,nv=2,order=1}",
        "response.points=11",
        "response.compare_harmonics=",
    ];
    let run = Run::new("run", "paper", "flank_2x2", &set);
    for row in run.table("response.csv") {
        assert_eq!(row["outcome"], "converged", "{} Hz", row["frequency_hz"]);
        let amplitude_m = number(&row, "tip_amplitude_m");
        assert!(amplitude_m > 1e-4 && amplitude_m < 3e-3, "{amplitude_m}");
    }
}
