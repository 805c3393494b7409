//! Runs of the program that end well, and their tables and summaries.

use std::collections::HashMap;
use std::path::Path;

use dovetail_export::manifest::Summary;
use serde_json::Value;

use crate::shared_folder::Folder;
use crate::shared_program::{ended, scene_command};

/// Run of `dovetail COMMAND SCENE --set ...` in a folder that is removed at the end.
pub struct Run(pub Folder);

pub type Row = HashMap<String, String>;

impl Run {
    /// Run of the scene scenes/SCENE.toml.
    pub fn new(command: &str, scene: &str, name: &str, set: &[&str]) -> Self {
        Self::run_file(command, file(scene), name, set)
    }

    /// Run of `dovetail run` without the fields for ParaView and what they need, for tests that
    /// read tables alone.
    pub fn run_without_fields(scene: &str, name: &str, set: &[&str]) -> Self {
        let run = Self(Folder::new(name));
        let mut program = scene_command("run", file(scene), &run.0, set);
        ended(program.arg("--no-fields"), 0);
        run
    }

    pub fn run_file(command: &str, scene: impl AsRef<Path>, name: &str, set: &[&str]) -> Self {
        let run = Self(Folder::new(name));
        ended(scene_command(command, scene.as_ref(), &run.0, set), 0);
        run
    }

    pub fn table(&self, file: &str) -> Vec<Row> {
        rows(&self.0.join(file))
    }

    pub fn column(&self, file: &str, column: &str) -> Vec<f64> {
        numbers(&self.0.join(file), column)
    }

    pub fn summary(&self) -> Value {
        summary(&self.0)
    }
}

/// File of a scene of the repository, from its root.
fn file(scene: &str) -> String {
    format!("scenes/{scene}.toml")
}

/// Value in a file of JSON.
#[track_caller]
pub fn json(file: &Path) -> Value {
    let text = std::fs::read(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    serde_json::from_slice(&text).unwrap()
}

/// summary.json in the folder of a run.
#[track_caller]
pub fn summary(out: &Path) -> Value {
    json(&out.join("summary.json"))
}

/// summary.json in the folder of a run, in the type of the program.
#[track_caller]
pub fn manifest(out: &Path) -> Summary {
    serde_json::from_value(summary(out)).unwrap()
}

/// Rows of a table, by the names of the columns.
#[track_caller]
pub fn rows(file: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(file);
    let text = text.unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let mut lines = text.lines().map(|line| line.split(','));
    let header: Vec<&str> = lines.next().unwrap().collect();
    lines
        .map(|fields| {
            let cells = header.iter().zip(fields);
            cells.map(|(h, f)| (h.to_string(), f.to_string())).collect()
        })
        .collect()
}

#[track_caller]
pub fn number(row: &Row, column: &str) -> f64 {
    row[column]
        .parse()
        .unwrap_or_else(|e| panic!("{column}: {e}"))
}

/// Numbers of a column of a table.
#[track_caller]
pub fn numbers(file: &Path, column: &str) -> Vec<f64> {
    let rows = rows(file);
    rows.iter().map(|row| number(row, column)).collect()
}

pub fn sum(rows: &[Row], value: impl Fn(&Row) -> f64) -> f64 {
    rows.iter().map(value).sum()
}
