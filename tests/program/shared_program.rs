//! Runs the program to its end, for the tests of its exit codes and files, and checks what it says.

use std::borrow::BorrowMut;
use std::ffi::OsStr;
use std::path::Path;
use std::process::{Command, Output};

use dovetail_testkit::folder::root;
pub use dovetail_testkit::words::{cases, has};
use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme};

/// Setting of the paper's scene that takes its smallest ready mesh.
pub const SMALL: &str = "mesh.file=../meshes/dovetail_small.msh";

/// Setting of the scene of the contact patch that takes its ready mesh.
pub const READY_PATCH: &str = "mesh.file=../../meshes/verification/patch.msh";

/// Command of the program with these arguments, in a folder.
pub fn program(folder: &Path, words: &[&str]) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program.current_dir(folder).args(words);
    program
}

/// Command `dovetail COMMAND SCENE --no-cache --out OUT --set ...` at the root of the repository.
pub fn scene_command(command: &str, scene: impl AsRef<OsStr>, out: &Path, set: &[&str]) -> Command {
    let mut program = program(root(), &[command]);
    program.arg(scene.as_ref()).arg("--no-cache");
    program.arg("--out").arg(out);
    program.args(set.iter().flat_map(|set| ["--set", set]));
    program
}

/// Command [`scene_command`] for the contact patch on its ready mesh, which needs no gmsh.
pub fn patch_command(command: &str, out: &Path, set: &[&str]) -> Command {
    let set = [&[READY_PATCH], set].concat();
    scene_command(command, "scenes/verification/patch.toml", out, &set)
}

/// Runs a command, which has to end with `code`.
#[track_caller]
pub fn ended(mut command: impl BorrowMut<Command>, code: i32) -> Output {
    let command = command.borrow_mut();
    let output = command.output().expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{command:?}\n{stderr}");
    output
}

/// Checks that gmsh is installed.
#[track_caller]
pub fn needs_gmsh() {
    let gmsh = Command::new("gmsh").arg("-version").output();
    assert!(
        gmsh.is_ok(),
        "gmsh is not installed, and this test runs it: `tools/setup.sh` installs it"
    );
}

/// Output to stdout.
pub fn printed(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Output to stderr.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Output to stderr on one line, without the frames of a report.
pub fn said_in_one_line(output: &Output) -> String {
    unwrapped(&said(output))
}

/// Output to stderr, on one line, of a command that has to end with `code`.
#[track_caller]
pub fn told(command: impl BorrowMut<Command>, code: i32) -> String {
    said_in_one_line(&ended(command, code))
}

/// Report of an error as the program prints it without a terminal, on one line.
#[track_caller]
pub fn rendered(error: &dyn Diagnostic) -> String {
    let mut text = String::new();
    GraphicalReportHandler::new_themed(GraphicalTheme::none())
        .with_width(400)
        .render_report(&mut text, error)
        .expect("a report is rendered");
    assert!(
        !text.contains("Failed to read contents"),
        "a span outside its text:\n{text}"
    );
    unwrapped(&text)
}

/// Report without its frames and line breaks.
pub fn unwrapped(report: &str) -> String {
    let report = report.replace(['|', '>'], " ");
    report.split_whitespace().collect::<Vec<_>>().join(" ")
}
