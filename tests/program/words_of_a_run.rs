//! Messages of a run while it works and at its end.

use std::process::Output;

use serde_json::Value;

use crate::shared_folder::Folder;
use crate::shared_program::{SMALL, ended, has, printed, program, said, scene_command};
use crate::shared_runs::{number, rows, summary};
use dovetail_export::words::{
    cycle_counts, error_words, figure, quantity_in_prefix, supported_digits,
};
use dovetail_solver::dlft::CycleCounts;
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
    let output = ended(scene_command("run", scene, &folder, &[]).args(arguments), 0);
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

/// Observations behind that of the paper's scene, the second a strain.
const MORE: &str = r#"
[[observe]]
name = "lead"
points = "excitation"
direction = [1, 0, 0]
[[observe]]
name = "gauge"
points = "blade_leading_edge"
direction = [0, 0, 1]
quantity = "strain"
"#;

/// Each observation has its own peak, which console, report and summary.json tell in the same
/// figures. The table of the response has them from elsewhere.
#[test]
fn console_report_and_summary_have_the_same_peak_of_each_observation() {
    let folder = Folder::new("words-observations");
    let paper = std::fs::read_to_string(root().join("scenes/paper.toml")).unwrap();
    let scene = folder.write("scene.toml", paper + MORE);
    let mesh = root()
        .join("scenes")
        .join(SMALL.rsplit('=').next().unwrap());
    let mesh = format!("mesh.file={}", mesh.display());
    let set = [&mesh, "response.compare_harmonics=", "response.samples=64"];
    let mut run = scene_command("run", scene, &folder, &set);
    let told = printed(&ended(run.arg("--no-fields"), 0));
    let (summary, report) = (summary(&folder), folder.text("report.html"));
    let (response, table) = (&summary["response"], rows(&folder.join("response.csv")));
    let others = response["other_observations"].as_array().unwrap();
    let peaks: Vec<&Value> = std::iter::once(response).chain(others).collect();
    assert_eq!(peaks.len(), 3);
    let named = [
        ("tip", "m", "m"),
        ("lead", "m", "m"),
        ("gauge", "strain", "m/m"),
    ];
    let mut card = None;
    for (peak, (name, suffix, unit)) in peaks.iter().zip(named) {
        let of = |key: &str| peak[key].as_f64().unwrap();
        let count = |state: &str| peak[format!("peak_{state}_pairs")].as_u64().unwrap() as usize;
        let row = &table[peak["peak_row"].as_u64().unwrap() as usize];
        let column = format!("{name}_amplitude_{suffix}");
        let amplitudes = table.iter().map(|row| number(row, &column));
        let (amplitude, error) = (of("peak_amplitude_m"), of("peak_estimated_error"));
        assert_eq!(amplitude, amplitudes.fold(0.0, f64::max), "{name}");
        assert_eq!(number(row, &format!("{name}_estimated_error")), error);
        assert_eq!(number(row, "frequency_hz"), of("peak_frequency_hz"));
        assert_eq!(number(row, "slipping_pairs"), count("slipping") as f64);
        let loss = of("peak_loss_factor");
        let digits = supported_digits(amplitude, Some(error));
        let linear = of("linear_peak_amplitude_m");
        let words = [
            quantity_in_prefix(amplitude, linear, unit, digits),
            error_words(error),
            format!("{} Hz", figure(of("peak_frequency_hz"), 6)),
            quantity_in_prefix(linear, linear, unit, 4),
            format!("{} Hz", figure(of("linear_peak_frequency_hz"), 6)),
            figure(of("peak_ratio"), digits.min(3)),
            format!(
                "loss factor {} (Q = {})",
                figure(loss, 3),
                figure(loss.recip(), 3)
            ),
        ];
        let counts = cycle_counts(CycleCounts {
            stuck: count("stuck"),
            slipping: count("slipping"),
            opening: count("opening"),
            closing: count("closing"),
            open: count("open"),
        });
        let (_, block) = told.split_once(&format!("peak of {name} ")).expect(name);
        let block = block.split("peak of ").next().unwrap();
        let (_, cells) = report.split_once(&format!("<td>{name}</td>")).expect(name);
        let cells = cells.split("</tr>").next().unwrap();
        card.get_or_insert(words[0].clone());
        for words in &words {
            assert!(block.contains(words), "{name}: {words}: {told}");
            assert!(cells.contains(words), "{name}: {words}: {cells}");
        }
        assert!(block.contains(&counts), "{name}: {counts}: {told}");
    }
    has(
        &report,
        &format!("<div class=\"figure\">{}</div>", card.unwrap()),
    );
}
