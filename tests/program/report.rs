//! report.html in a browser: every picture is drawn, without errors.

use crate::shared_browser::{drawn, is_self_contained, opened};
use crate::shared_program::SMALL;
use crate::shared_runs::Run;

/// The joint of the paper on a small mesh.
const PAPER: [&str; 4] = [
    SMALL,
    "response.points=9",
    "response.compare_harmonics=1",
    "excitation.0.force_n=1",
];

/// Document of the report of a run, and the pictures that are drawn in it.
fn report(run: &Run, width: u32) -> (String, Vec<String>) {
    let (dom, complaints) = opened(&run.0.join("report.html"), width);
    assert_eq!(complaints, [""; 0]);
    let pictures = drawn(&dom).into_iter().map(str::to_owned).collect();
    (dom, pictures)
}

#[test]
fn every_picture_of_a_run_is_drawn() {
    let run = Run::new("run", "paper", "report", &PAPER);
    is_self_contained(&run.0.join("report.html"));
    let (summary, html) = (run.summary(), run.0.text("report.html"));
    let (day, time) = summary["begun"].as_str().unwrap().split_once('T').unwrap();
    let hash = summary["mesh"]["blake3"].as_str().unwrap();
    let mut origin = vec![format!("{day} {} UTC", &time[..5]), hash[..12].to_owned()];
    origin.extend(summary["commit"].as_str().map(str::to_owned));
    for words in origin {
        assert!(html.contains(&words), "{words}");
    }
    for width in [1400, 400] {
        let (dom, pictures) = report(&run, width);
        assert_eq!(
            pictures,
            [
                "amplitude",
                "phase",
                "counts",
                "powers",
                "field",
                "statuses",
                "loops",
                "viewer"
            ]
        );
        for word in [
            "Can this be trusted?",
            "blade_flank_left",
            "flanks: what pairs do at the peak",
            "of critical on linear mode 1",
        ] {
            assert!(dom.contains(word), "{word}");
        }
    }
}

#[test]
fn a_static_state_has_its_flanks_and_bodies() {
    let run = Run::new("static", "paper", "report-static", &PAPER);
    let (dom, pictures) = report(&run, 1000);
    assert_eq!(pictures, ["field", "viewer"]);
    assert!(dom.contains("The static state alone was computed"));
}

#[test]
fn a_reduced_model_has_curves_alone() {
    let few = ["response.frequency_hz=[0.8,1.2]", "response.points=5"];
    let run = Run::new("run", "verification/jenkins", "report-reduced", &few);
    let (_, pictures) = report(&run, 1000);
    assert_eq!(
        pictures,
        ["amplitude", "phase", "counts", "powers", "loops"]
    );
}
