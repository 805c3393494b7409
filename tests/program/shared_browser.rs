//! Opens a page in Chromium without a window. `tools/setup.sh checks` installs it; without it these
//! tests fail.

use std::path::Path;
use std::process::Command;

/// Document that Chromium makes of a page, and its messages.
pub fn opened(page: &Path, width: u32) -> (String, Vec<String>) {
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

/// Pictures that the scripts of the page drew.
pub fn drawn(dom: &str) -> Vec<&str> {
    let (_, after) = dom
        .split_once("data-drawn=\"")
        .expect("the scripts came to their end");
    let (list, _) = after.split_once('"').unwrap();
    list.split_whitespace().collect()
}

/// Checks that everything that the page needs is in it.
pub fn is_self_contained(page: &Path) {
    let html = std::fs::read_to_string(page).unwrap();
    for mark in [
        "src=\"http",
        "src=\"/",
        "src=\".",
        "<link",
        "@import",
        "url(http",
    ] {
        assert!(!html.contains(mark), "{mark}");
    }
}
