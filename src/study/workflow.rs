//! A study as a Snakemake workflow: the Snakefile is the same for all, cases.json says what to run.

use std::path::Path;

use serde_json::json;

use super::cases::Case;
use super::error::StudyError;
use super::folder::{Settings, write_json};
use crate::export::write_file;

const SNAKEFILE: &str = include_str!("../../workflow/Snakefile");

/// Writes `folder`/Snakefile and `folder`/cases.json. `overrides` are those of the command line.
///
/// # Errors
/// What writing a file brings.
pub fn write(
    folder: &Path,
    study_file: &Path,
    cases: &[Case],
    overrides: &[String],
    settings: &Settings,
) -> Result<(), StudyError> {
    // Absolute, so that the workflow runs from any folder.
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let set = overrides.iter().flat_map(|set| ["--set", set]);
    let cache = settings.cache.iter().map(String::as_str);
    let slugs = cases.iter().map(|case| case.slug.as_str());
    let study = json!({
        "study": absolute(study_file),
        "out": absolute(&settings.out),
        "arguments": set.chain(cache).collect::<Vec<_>>(),
        "threads": settings.threads,
        "cases": slugs.collect::<Vec<_>>(),
    });
    write_json(&folder.join("cases.json"), &study)?;
    Ok(write_file(&folder.join("Snakefile"), SNAKEFILE.as_bytes())?)
}
