//! The largest amplitude that is left where the resonance failed is not reported as the peak.
//!
//! With three iterations for each attempt the reference model of 72 pairs converges beside its
//! resonance, and not in it.

use serde_json::Value;

use crate::shared_folder::Folder;
use crate::shared_program::{ended, has, printed, program, said_in_one_line, scene_command};
use crate::shared_runs::{json, number, rows, summary};
use dovetail_testkit::folder::root;

const GRID: [&str; 4] = [
    "response.points=21",
    "response.harmonics=1",
    "response.samples=64",
    "response.times_first_linear_mode=[0.96, 1.01]",
];
const FEW: &str = "response.max_newton_iterations=3";
/// With a smaller force so many are enough everywhere.
const FEW_OF_A_STUDY: &str = "response.max_newton_iterations=4";
/// Force at which the joint slips in its resonance, and one at which it hardly does.
const FORCES: [&str; 2] = ["0.3", "0.05"];

/// Response in summary.json, what was printed, and what was said.
fn run(name: &str, force: &str, more: &[&str], code: i32) -> (Folder, Value, String, String) {
    let out = Folder::new(name);
    let force = format!("reduced_model.force_n={force}");
    let set = [&GRID[..], &[&force], more].concat();
    let output = ended(
        scene_command("run", "benches/peers/scene.toml", &out, &set),
        code,
    );
    let response = summary(&out)["response"].clone();
    let (printed, said) = (printed(&output), said_in_one_line(&output));
    (out, response, printed, said)
}

#[test]
fn a_resonance_that_failed_has_no_peak_in_any_output() {
    let (_whole, truth, _, _) = run("uncomputed_whole", FORCES[0], &[], 0);
    let peak = |response: &Value| response["peak_amplitude_m"].as_f64();
    let hz = truth["peak_frequency_hz"].as_f64().unwrap();
    assert!(truth["resonance_not_computed_hz"].is_null());
    assert_eq!(truth["largest_amplitude_m"].as_f64(), peak(&truth));
    let (out, response, printed, said) = run("uncomputed", FORCES[0], &[FEW], 3);
    // What is left is less than half of the peak.
    let left = response["largest_amplitude_m"].as_f64().unwrap();
    assert!(left < 0.6 * peak(&truth).unwrap(), "{left}");
    assert_eq!(peak(&response), None);
    let range = response["resonance_not_computed_hz"].as_array().unwrap();
    let range: Vec<f64> = range.iter().map(|hz| hz.as_f64().unwrap()).collect();
    assert!(range[0] < hz && hz < range[1], "{range:?} {hz}");
    for figure in [
        "peak_ratio",
        "peak_row",
        "peak_loss_factor",
        "peak_friction_power_w",
    ] {
        assert!(response[figure].is_null(), "{figure}");
    }
    assert!(response["linear_peak_amplitude_m"].as_f64() > Some(0.0));
    let words = "the resonance was not computed: no motion is known from 693.585 to 704.067 Hz";
    has(&printed, words);
    has(
        &said,
        "the resonance of tip was not computed & at 5 of 21 frequencies (695.332 to 702.320 Hz) no motion was found",
    );
    let report = out.text("report.html");
    assert!(report.contains(&words.replacen('t', "T", 1)), "{report}");
    let picture = out.text("plots/response_tip.svg");
    for words in [
        "resonance not computed, 693.585 to 704.067 Hz",
        "5 points did not converge",
    ] {
        assert!(picture.contains(words), "{words}");
    }
    for row in rows(&out.join("contact.csv")) {
        assert_eq!(row["peak_frequency_hz"], "");
    }
}

/// A case of a study whose resonance failed has no peak, and a cross in the pictures.
#[test]
fn a_study_says_which_resonance_was_not_computed() {
    let folder = Folder::new("uncomputed_study");
    let scene = root().join("benches/peers/scene.toml");
    let set: Vec<&str> = GRID.into_iter().chain([FEW_OF_A_STUDY]).collect();
    let study = format!(
        r#"
name = "forces"
scene = {scene:?}
set = {set:?}
quantities = ["peak_amplitude_m", "peak_ratio"]
[[parameter]]
key = "reduced_model.force_n"
values = [0.04, {}, {}]
"#,
        FORCES[1], FORCES[0]
    );
    folder.write("study.toml", study);
    let mut command = program(root(), &["study"]);
    command.arg(folder.join("study.toml"));
    command
        .args(["--jobs", "1", "--out"])
        .arg(folder.join("out"));
    let said = said_in_one_line(&ended(command, 3));
    let words = "the resonance was not computed: no motion is known from 693.585 to 702.320 Hz";
    has(&said, words);
    let out = folder.join("out");
    let table = rows(&out.join("table.csv"));
    assert!(number(&table[1], "peak_amplitude_m") > 0.0);
    for figure in ["peak_amplitude_m", "peak_ratio"] {
        assert_eq!(table[2][figure], "", "{figure}");
    }
    let told = &json(&out.join("summary.json"))["resonance_not_computed"];
    assert_eq!(told.as_array().map(Vec::len), Some(1), "{told}");
    assert!(folder.text("out/report.html").contains(words));
    let svg = folder.text("out/plots/peak_amplitude_m_over_force_n.svg");
    assert!(svg.contains("nothing found"), "{svg}");
}
