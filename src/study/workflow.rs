//! A study as a Snakemake workflow: the Snakefile is the same for all studies, cases.json lists the
//! jobs.

use std::path::Path;

use serde_json::{Value, json};

use super::cases::Case;
use super::error::StudyError;
use super::folder::{Settings, write_json};
use super::pieces::Pieces;
use crate::export::write_file;

const SNAKEFILE: &str = include_str!("../../workflow/Snakefile");

/// Contents of a workflow.
pub struct Workflow<'a> {
    pub study_file: &'a Path,
    /// Overrides of the command line.
    pub overrides: &'a [String],
    pub settings: &'a Settings,
    pub cases: &'a [Case],
    pub pieces: &'a Pieces,
}

impl Workflow<'_> {
    /// Writes `folder`/Snakefile and `folder`/cases.json.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), StudyError> {
        // Absolute, so that the workflow runs from any folder.
        let absolute =
            |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let set = self.overrides.iter().flat_map(|set| ["--set", set]);
        let cache = self.settings.cache.iter().map(String::as_str);
        let pieces = self.pieces.all.iter().map(|p| self.job(&p.name, p.needs));
        let cases = self.cases.iter().zip(&self.pieces.of_case);
        let cases = cases.map(|(case, needs)| self.job(&case.slug, *needs));
        let study = json!({
            "study": absolute(self.study_file),
            "out": absolute(&self.settings.out),
            "arguments": set.chain(cache).collect::<Vec<_>>(),
            "threads": self.settings.threads,
            "pieces": pieces.collect::<Vec<_>>(),
            "cases": cases.collect::<Vec<_>>(),
        });
        write_json(&folder.join("cases.json"), &study)?;
        Ok(write_file(&folder.join("Snakefile"), SNAKEFILE.as_bytes())?)
    }

    /// Job, and the shared input at position `needs` that it waits for.
    fn job(&self, name: &str, needs: Option<usize>) -> Value {
        let needs = needs.map(|at| &self.pieces.all[at].name);
        json!({ "name": name, "needs": needs.iter().collect::<Vec<_>>() })
    }
}
