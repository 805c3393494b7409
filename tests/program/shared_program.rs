//! Runs the program to its end, for the tests of its exit codes and files.

use std::path::Path;
use std::process::{Command, Output};

/// Command of the program with these arguments, in a folder.
pub fn program(folder: &Path, words: &[&str]) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program.current_dir(folder).args(words);
    program
}

/// Runs a command, which has to end with `code`.
pub fn ended(mut command: Command, code: i32) -> Output {
    let output = command.output().expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{command:?}\n{stderr}");
    output
}

/// Output to stderr.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Output to stderr on one line, without the frames of a report.
pub fn said_in_one_line(output: &Output) -> String {
    in_one_line(&said(output))
}

/// Report without its frames and line breaks.
pub fn in_one_line(report: &str) -> String {
    let report = report.replace(['|', '>'], " ");
    report.split_whitespace().collect::<Vec<_>>().join(" ")
}
