//! Runs of the program on scenes of the repository, and their tables.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::shared_folder::Folder;

/// Run of `dovetail COMMAND scenes/SCENE.toml --set ...`; its files are removed at the end.
pub struct Run(Folder);

pub type Row = HashMap<String, String>;

impl Run {
    pub fn new(command: &str, scene: &str, name: &str, set: &[String]) -> Self {
        Self::of_file(command, &file(scene), name, set)
    }

    /// Run of `dovetail run` without the fields for ParaView and what they need, for tests that
    /// read tables alone.
    pub fn without_fields(scene: &str, name: &str, set: &[String]) -> Self {
        Self::of_words(&["run", "--no-fields"], &file(scene), name, set)
    }

    pub fn of_file(command: &str, scene: &Path, name: &str, set: &[String]) -> Self {
        Self::of_words(&[command], scene, name, set)
    }

    fn of_words(words: &[&str], scene: &Path, name: &str, set: &[String]) -> Self {
        let run = Self(Folder::new(name));
        let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
        program
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .args(words)
            .arg(scene)
            .args(["--no-cache", "--quiet", "--out"])
            .arg(&run.0);
        for argument in set {
            program.args(["--set", argument]);
        }
        let output = program.output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{program:?}: {message}");
        run
    }

    pub fn table(&self, file: &str) -> Vec<Row> {
        rows(&self.0.join(file))
    }

    pub fn summary(&self) -> Value {
        let text = std::fs::read_to_string(self.0.join("summary.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    }
}

/// File of a scene of the repository.
fn file(scene: &str) -> PathBuf {
    Path::new("scenes").join(scene).with_extension("toml")
}

/// Rows of a table, by the names of the columns.
pub fn rows(file: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines().map(|line| line.split(','));
    let header: Vec<&str> = lines.next().unwrap().collect();
    lines
        .map(|fields| {
            let cells = header.iter().zip(fields);
            cells.map(|(h, f)| (h.to_string(), f.to_string())).collect()
        })
        .collect()
}

pub fn number(row: &Row, column: &str) -> f64 {
    row[column]
        .parse()
        .unwrap_or_else(|e| panic!("{column}: {e}"))
}

pub fn sum(rows: &[Row], value: impl Fn(&Row) -> f64) -> f64 {
    rows.iter().map(value).sum()
}
