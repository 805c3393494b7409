//! A run-up along an engine order: the response while the speed rises, beside single responses at
//! its speeds, and what it excludes.

use std::path::Path;
use std::process::Command;

use crate::shared_folder::Folder;
use crate::shared_program::{SMALL, cases, ended, has, printed, program, scene_command, told};
use crate::shared_runs::{Row, number, rows, summary};
use dovetail_testkit::folder::root;

/// Settings of the paper's scene, on its smallest mesh, for quick responses of one harmonic.
const QUICK: [&str; 5] = [
    SMALL,
    "response.compare_harmonics=",
    "response.harmonics=1",
    "response.samples=64",
    "excitation.*.force_n=4",
];

/// Settings of a run-up through the crossing of the first mode with engine order 6.
const UP: [&str; 3] = [
    "response.along_engine_order=6",
    "response.speed_rpm=[4340, 4420]",
    "response.points=5",
];

fn run(command: &str, out: &Path, set: &[&str]) -> Command {
    scene_command(
        command,
        "scenes/paper.toml",
        out,
        &[&QUICK[..], set].concat(),
    )
}

fn table(out: &Path) -> Vec<Row> {
    rows(&out.join("response.csv"))
}

/// Each speed is a run of its own, with the speed in [rotation] and its one frequency. Both iterate
/// to a residual of 1e-8 of the load, from different starts.
#[test]
fn a_run_up_equals_single_responses_at_its_speeds() {
    for (prestress, at) in [("held_flanks", 0..5), ("contact", 2..4)] {
        let prestress = format!("rotation.prestress={prestress}");
        let up = Folder::new("run_up");
        let mut command = run("run", &up, &[&UP[..], &[&prestress]].concat());
        let said = printed(&ended(command.arg("--no-fields"), 0));
        has(
            &said,
            "along engine order 6 from 4340 to 4420 rpm & 5 of 5 converged",
        );
        let up = table(&up);
        assert_eq!(up.len(), 5);
        let mut most_slipping: f64 = 0.0;
        for (i, row) in up.iter().enumerate() {
            let speed_rpm = number(row, "speed_rpm");
            assert_eq!(speed_rpm, 4340.0 + 20.0 * i as f64);
            let frequency_hz = number(row, "frequency_hz");
            assert!((frequency_hz / (speed_rpm / 10.0) - 1.0).abs() < 1e-12);
            most_slipping = most_slipping.max(number(row, "slipping_pairs"));
            if !at.contains(&i) {
                continue;
            }
            let single = Folder::new("run_up_single");
            let set = [
                &prestress,
                &format!("rotation.speed_rpm={speed_rpm}"),
                &format!("response.frequency_hz=[{frequency_hz:?}, {frequency_hz:?}]"),
            ];
            let mut command = run("run", &single, &set.map(String::as_str));
            ended(command.arg("--no-fields"), 0);
            let single = &table(&single)[0];
            for column in [
                "tip_amplitude_m",
                "tip_linear_amplitude_m",
                "tip_h1_phase_rad",
                "friction_power_w",
                "viscous_power_w",
                "estimated_error",
            ] {
                let off = number(row, column) / number(single, column) - 1.0;
                println!("{speed_rpm} rpm, {column}: off by {off:.1e}");
                assert!(off.abs() < 1e-5, "{speed_rpm} rpm, {column}: {off:e}");
            }
            for column in ["outcome", "slipping_pairs", "stuck_pairs", "opening_pairs"] {
                assert_eq!(row[column], single[column], "{speed_rpm} rpm, {column}");
            }
        }
        assert!(most_slipping > 0.0, "nothing slips");
    }
}

/// The range in hertz is the same one, and the second run takes every reduction from the cache.
#[test]
fn the_reductions_of_a_run_up_are_taken_from_the_cache() {
    let (folder, in_hertz) = (
        Folder::new("run_up_cache"),
        "response.frequency_hz=[434, 442]",
    );
    let up = |out: &str, range: &str| {
        let set = [&QUICK[..], &[UP[0], UP[2], range]].concat();
        let mut command = program(root(), &["run", "scenes/paper.toml", "--out"]);
        let mut command = command.arg(folder.join(out));
        command = command.args(set.iter().flat_map(|set| ["--set", set]));
        ended(command.env("DOVETAIL_CACHE", folder.join("cache")), 0);
        let summary = summary(&folder.join(out));
        let stages = summary["stages"].as_array().unwrap();
        let own = stages.iter().filter(|s| {
            let name = s["name"].as_str().unwrap();
            name.starts_with("reduction along the run-up")
        });
        let own: Vec<String> = own.map(|s| s["name"].to_string()).collect();
        own.join("; ")
    };
    // The fields at the peak take the reduction of their speed once more.
    let first = up("first", UP[1]);
    has(&first, "6 times, 1 from the cache");
    let second = up("second", in_hertz);
    has(&second, "6 times, from the cache");
    let [first, second] =
        ["first", "second"].map(|out| folder.text(&format!("{out}/response.csv")));
    assert_eq!(first, second);
    for file in [
        "peak.vtu",
        "plots/response_tip.svg",
        "static.csv",
        "report.html",
    ] {
        assert!(folder.join("first").join(file).exists(), "{file}");
    }
    let picture = folder.text("first/plots/response_tip.svg");
    has(&picture, "speed (rpm) & engine order 6");
    let found = &summary(&folder.join("first"))["response"];
    assert_eq!(found["engine_order"], 6);
    assert_eq!(found["speed_rpm"][1], 4420.0);
    let row = found["peak_row"].as_u64().unwrap() as usize;
    let at_peak = &table(&folder.join("first"))[row];
    let speed_rpm = found["peak_speed_rpm"].as_f64().unwrap();
    assert_eq!(speed_rpm, number(at_peak, "speed_rpm"));
}

#[test]
fn what_a_run_up_excludes_is_refused_with_a_remedy() {
    let out = Folder::new("run_up_refused");
    for [set, words] in cases(
        "
        response.speed_rpm=[1, 2] => `response.speed_rpm` & `response.along_engine_order` & frequency_hz
        response.along_engine_order=0 response.speed_rpm=[1, 2] => `response.along_engine_order` & 1 to 1000
        response.along_engine_order=6 => `response.times_first_linear_mode` exclude & speed_rpm
        response.along_engine_order=6 response.frequency_hz=[9, 8] => runs from 9 to 8
        response.along_engine_order=6 response.times_first_linear_mode= => `response.speed_rpm` & add one
        response.along_engine_order=6 response.speed_rpm=[1, 2] response.compare_harmonics=1 => compare_harmonics` exclude
        response.along_engine_order=6 response.speed_rpm=[1, 2] rotation= => [rotation] & axis
        engine_order=[{order=4},{order=4}] => `engine_order.order` & 4
        engine_order=[{times=4}] => engine_order.0.order
        response.along_engine_order=6 response.speed_rpm=[1, 2] rotation.speed_rpm=0 => rotation.speed_rpm & above 0
        ",
    ) {
        // A space stands inside of the brackets of a list, too.
        let set = set.replace(" response", "\nresponse").replace(" rotation", "\nrotation");
        let set: Vec<&str> = set.lines().collect();
        let message = told(run("run", &out, &set), 2);
        has(&message, &words);
    }
    let of_reduced = [
        "response.along_engine_order=6",
        "response.frequency_hz=[400, 500]",
    ];
    let reduced = scene_command("run", "benches/peers/scene.toml", &out, &of_reduced);
    has(&told(reduced, 2), "[rotation] & one speed");
    let up = |command: &str, rest: &[&str]| {
        let mut command = run(command, &out, &UP);
        told(command.args(rest), 2)
    };
    let peaks = ["--over", "contact.*.friction=0.1:0.3"];
    has(
        &up("peaks", &peaks),
        "along an engine order & response.along_engine_order=",
    );
    has(
        &up("verify", &[]),
        "along an engine order & response.frequency_hz",
    );
}

/// The peak at a crossing is that of a curve over the frequency at its speed, under the excitation
/// of its engine order.
#[test]
fn peaks_at_crossings_are_those_of_runs_at_their_speeds() {
    let out = Folder::new("crossing_peaks");
    let orders = "engine_order=[{ order = 6, times = 0.25 }, { order = 5 }]";
    let mut command = run("modes", &out, &[orders]);
    let told = printed(&ended(command.args(["--rpm", "4300:5800:3"]), 0));
    has(&told, "peak of tip at the crossings of the assembly & EO 6");
    let crossings = rows(&out.join("modes_crossings.csv"));
    let with_peak = |row: &&Row| !row["peak_amplitude_m"].is_empty();
    let found: Vec<&Row> = crossings.iter().filter(with_peak).collect();
    assert!(
        found
            .iter()
            .all(|row| row["engine_order"] == "6" && row["kind"] == "stuck")
    );
    assert!(crossings.iter().any(|row| row["engine_order"] == "5"));
    assert_eq!(found.len(), 1);
    let row = found[0];
    let [speed_rpm, hz] = ["speed_rpm", "frequency_hz"].map(|key| number(row, key));
    let single = Folder::new("crossing_peaks_run");
    let set = [
        format!("rotation.speed_rpm={speed_rpm:?}"),
        format!("response.frequency_hz=[{:?}, {:?}]", 0.93 * hz, 1.03 * hz),
        "excitation.*.force_n=1".to_owned(),
    ];
    let set: Vec<&str> = set.iter().map(String::as_str).collect();
    ended(run("run", &single, &set).arg("--no-fields"), 0);
    let found = &summary(&single)["response"];
    for (own, of_run) in [
        ("peak_amplitude_m", "peak_amplitude_m"),
        ("peak_frequency_hz", "peak_frequency_hz"),
        ("linear_peak_amplitude_m", "linear_peak_amplitude_m"),
    ] {
        let off = number(row, own) / found[of_run].as_f64().unwrap() - 1.0;
        println!("{own}: off by {off:.1e}");
        assert!(off.abs() < 1e-3, "{own}: {off:e}");
    }
    let slipping = number(row, "slipping_pairs");
    assert_eq!(slipping, found["peak_slipping_pairs"].as_f64().unwrap());
    has(&out.text("plots/campbell.svg"), "EO 6 & mm");
}
