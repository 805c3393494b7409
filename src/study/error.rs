//! Why a study was not begun, or not brought to its end.

use std::path::PathBuf;

use miette::Diagnostic;
use thiserror::Error;

use crate::scene::SceneError;

/// A case that fails is no error: it is reported in the tables.
#[derive(Debug, Error, Diagnostic)]
pub enum StudyError {
    #[error("the study file {} cannot be read", path.display())]
    #[diagnostic(help("give the path of a TOML file that describes the study (docs/study.md)"))]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    /// Problems of the study file, in the order of the text.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Invalid(SceneError),
    #[error("the study has no case \"{name}\"")]
    #[diagnostic(help("its cases are: {}", dovetail_solver::text::list(cases)))]
    NoSuchCase { name: String, cases: Vec<String> },
    #[error("{} is not what a case writes: {message}", path.display())]
    #[diagnostic(help(
        "remove the folder of the case ({}) and run the study again: only that case is computed",
        path.parent().unwrap_or(path).display()
    ))]
    Malformed { path: PathBuf, message: String },
}
