//! report.html in a browser: every picture is drawn, without errors.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::shared_browser::{drawn, is_self_contained, opened};
use crate::shared_folder::Folder;
use crate::shared_program::ended;

fn report(folder: &Folder, command: &str, scene: &str, set: &[&str]) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program
        .current_dir(root)
        .args([command, scene, "--quiet", "--no-cache"]);
    program.arg("--out").arg(folder);
    for set in set {
        program.args(["--set", set]);
    }
    ended(program, 0);
    folder.join("report.html")
}

const SMALL: [&str; 4] = [
    "mesh.file=../meshes/dovetail_small.msh",
    "response.points=9",
    "response.compare_harmonics=1",
    "excitation.0.force_n=1",
];

#[test]
fn every_picture_of_a_run_is_drawn() {
    let folder = Folder::new("report");
    let page = report(&folder, "run", "scenes/paper.toml", &SMALL);
    is_self_contained(&page);
    let summary: Value =
        serde_json::from_slice(&std::fs::read(folder.join("summary.json")).unwrap()).unwrap();
    let html = std::fs::read_to_string(&page).unwrap();
    let (day, time) = summary["begun"].as_str().unwrap().split_once('T').unwrap();
    let hash = summary["mesh"]["blake3"].as_str().unwrap();
    let mut origin = vec![format!("{day} {} UTC", &time[..5]), hash[..12].to_owned()];
    origin.extend(summary["commit"].as_str().map(str::to_owned));
    for words in origin {
        assert!(html.contains(&words), "{words}");
    }
    for width in [1400, 400] {
        let (dom, complaints) = opened(&page, width);
        assert_eq!(complaints, [""; 0]);
        assert_eq!(
            drawn(&dom),
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
    let folder = Folder::new("report-static");
    let page = report(&folder, "static", "scenes/paper.toml", &SMALL);
    let (dom, complaints) = opened(&page, 1000);
    assert_eq!(complaints, [""; 0]);
    assert_eq!(drawn(&dom), ["field", "viewer"]);
    assert!(dom.contains("The static state alone was computed"));
}

#[test]
fn a_reduced_model_has_curves_alone() {
    let folder = Folder::new("report-reduced");
    let scene = "scenes/verification/jenkins.toml";
    let page = report(
        &folder,
        "run",
        scene,
        &["response.frequency_hz=[0.8,1.2]", "response.points=5"],
    );
    let (dom, complaints) = opened(&page, 1000);
    assert_eq!(complaints, [""; 0]);
    assert_eq!(
        drawn(&dom),
        ["amplitude", "phase", "counts", "powers", "loops"]
    );
}
