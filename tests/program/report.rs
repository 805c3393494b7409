//! report.html opens in a browser: every picture is drawn, and nothing is complained of. That needs Chromium:
//! `tools/setup.sh checks` installs it; without it these tests fail.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shared_folder::Folder;
use crate::shared_program::ended;

/// What Chromium makes of a page, and what it says meanwhile.
fn opened(page: &Path, width: u32) -> (String, Vec<String>) {
    let home = tempfile::tempdir().unwrap();
    let output = Command::new("chromium")
        .args(["--headless=new", "--no-sandbox", "--use-angle=swiftshader"])
        .args([
            "--enable-unsafe-swiftshader",
            "--enable-logging=stderr",
            "--v=0",
        ])
        .args(["--virtual-time-budget=5000", "--dump-dom"])
        .arg(format!("--window-size={width},900"))
        .arg(format!("--user-data-dir={}", home.path().display()))
        .arg(format!("file://{}", page.display()))
        .output()
        .expect("Chromium is there: tools/setup.sh checks installs it");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let complaints = said.lines().filter(|line| line.contains(":CONSOLE"));
    let complaints = complaints.map(str::to_owned).collect();
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}");
    (dom, complaints)
}

/// The pictures that the scripts of the page drew.
fn drawn(dom: &str) -> Vec<&str> {
    let (_, after) = dom
        .split_once("data-drawn=\"")
        .expect("the scripts came to their end");
    let (list, _) = after.split_once('"').unwrap();
    list.split_whitespace().collect()
}

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

/// Whatever the page needs is in it.
fn is_self_contained(page: &Path) {
    let html = fs::read_to_string(page).unwrap();
    for mark in ["src=\"", "<link", "@import", "url(http"] {
        assert!(!html.contains(mark), "{mark}");
    }
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
    for width in [1400, 400] {
        let (dom, complaints) = opened(&page, width);
        assert_eq!(complaints, [""; 0]);
        assert_eq!(
            drawn(&dom),
            [
                "amplitude",
                "phase",
                "counts",
                "field",
                "statuses",
                "loops",
                "viewer"
            ]
        );
        for word in [
            "Can this be trusted?",
            "blade_flank_left",
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
    assert_eq!(drawn(&dom), ["amplitude", "phase", "counts", "loops"]);
}
