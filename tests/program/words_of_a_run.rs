//! Messages of a run while it works and at its end.

use std::process::Output;

use serde_json::Value;

use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, on_scene, printed, program, said};
use crate::shared_runs::summary;
use dovetail_testkit::folder::root;

const SCENE: &str = r#"
name = "dovetail72"
[reduced_model]
folder = "ROOT/tests/data/dovetail72"
friction = 0.3
force_n = 2.0
[damping]
ratio = 0.001
[response]
times_first_linear_mode = [0.99, 1.01]
points = 5
harmonics = 1
stuck_modes = 40
"#;

/// Runs the model of 72 pairs through its peak with one harmonic, which is too few.
fn run(name: &str, arguments: &[&str]) -> (Folder, Output) {
    let folder = Folder::new(name);
    let scene = SCENE.replace("ROOT", root().to_str().unwrap());
    let scene = folder.write("scene.toml", scene);
    let output = ended(on_scene("run", scene, &folder, &[]).args(arguments), 0);
    (folder, output)
}

/// Linear peak in millimetres: `7.105 mm` for 7.10466e-3.
fn linear_millimetres(summary: &Value) -> String {
    let metres = summary["response"]["linear_peak_amplitude_m"].as_f64();
    format!("{:.3} mm", 1e3 * metres.unwrap())
}

/// Peak and error, such as `2.7 mm` and `estimated error 15 %` for 2.685e-3 and 0.146: with one
/// harmonic the error is some tenths of a millimetre.
fn peak_and_error(summary: &Value) -> [String; 2] {
    let of = |key: &str| summary["response"][key].as_f64().unwrap();
    let (metres, error) = (of("peak_amplitude_m"), of("peak_estimated_error"));
    assert!((1e-4..1e-3).contains(&(error * metres)) && (0.1..0.195).contains(&error));
    [
        format!("{:.1} mm", 1e3 * metres),
        format!("estimated error {:.0} %", 100.0 * error),
    ]
}

#[test]
fn the_end_has_the_peak_beside_the_linear_one_the_time_and_the_file_to_open() {
    let (folder, output) = run("words-end", &[]);
    let (told, summary) = (printed(&output), summary(&folder));
    let line = |start: &str| {
        let found = told.lines().find(|l| l.trim_start().starts_with(start));
        found.unwrap_or_else(|| panic!("no {start} in {told}"))
    };
    let peak = line("peak of tip");
    let [amplitude, error] = peak_and_error(&summary);
    for words in [format!(" {amplitude} "), linear_millimetres(&summary)] {
        assert!(peak.contains(&words), "{words}: {told}");
    }
    assert!(line("estimated error").ends_with(&error), "{error}: {told}");
    let points = summary["response"]["points"].as_u64().unwrap();
    has(
        line("frequencies"),
        &format!("{points} of {points} converged"),
    );
    has(line("time"), " s: response, 1 harmonic ");
    let (_, report) = line("open first").split_once("first").unwrap();
    assert!(std::path::Path::new(report.trim()).is_file(), "{told}");
    // The warnings of the response come when all else is told, the weightiest first.
    let stderr = said(&output);
    let (before, after) = stderr.split_once("results in ").expect("where they are");
    assert!(!before.contains("warning: "), "{stderr}");
    has(after, "warning: ");
    has(after, "take more response.harmonics");
}

#[test]
fn the_quiet_have_one_line_of_results_and_the_warnings() {
    let (folder, output) = run("words-quiet", &["--quiet"]);
    let told = printed(&output);
    let summary = summary(&folder);
    assert_eq!(told.lines().count(), 1, "{told}");
    let [amplitude, error] = peak_and_error(&summary);
    let start = format!("tip: peak {amplitude}, {error}, at ");
    assert!(told.starts_with(&start), "{start}: {told}");
    assert!(told.contains("frequencies converged; "), "{told}");
    assert!(told.trim().ends_with("report.html"), "{told}");
    let stderr = said(&output);
    assert!(
        !stderr.is_empty() && stderr.lines().all(|l| l.starts_with("warning: ")),
        "{stderr}"
    );
}

#[test]
fn the_verbose_see_each_frequency_with_its_residuals() {
    let (folder, output) = run("words-verbose", &["--verbose"]);
    let stderr = said(&output);
    let lines: Vec<&str> = stderr
        .lines()
        .filter(|l| l.contains("; residuals "))
        .collect();
    let points = summary(&folder)["response"]["points"].as_u64().unwrap();
    assert_eq!(lines.len() as u64, points, "{stderr}");
    for line in lines {
        let (news, residuals) = line.split_once("; residuals ").unwrap();
        for word in [
            " Hz: ",
            " stick, ",
            " slip, ",
            " open at times, ",
            "iteration",
        ] {
            has(news, word);
        }
        let attempts = residuals.split(" | ").map(|attempt| {
            let (residuals, iterations) = attempt.split_once(" in ").unwrap();
            let last: f64 = residuals.rsplit(" to ").next().unwrap().parse().unwrap();
            (last, iterations.parse::<usize>().unwrap())
        });
        let attempts: Vec<(f64, usize)> = attempts.collect();
        // The motion itself; attempts to release its mean may follow.
        assert!(attempts.iter().any(|(last, _)| *last <= 1e-8), "{line}");
        let (_, iterations) = news.rsplit_once(", ").unwrap();
        let iterations: usize = iterations.split(' ').next().unwrap().parse().unwrap();
        let all: usize = attempts.iter().map(|(_, iterations)| iterations).sum();
        assert!(0 < all && all <= iterations, "{line}");
    }
    let both = ["run", "scene.toml", "--verbose", "--quiet"];
    ended(program(root(), &both), 2);
}
