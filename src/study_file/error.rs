//! Reasons why a study did not begin or did not complete.

use std::path::{Path, PathBuf};

use miette::Diagnostic;
use thiserror::Error;

use crate::error::RunError;
use crate::exit::ExitStatus;
use crate::scene::SceneError;
use dovetail_export::ExportError;

/// Error of a study. A failed case is not an error: it is reported in the tables.
#[derive(Debug, Error, Diagnostic)]
pub enum StudyError {
    #[error("the study file {} cannot be read", path.display())]
    #[diagnostic(help("give the path of a TOML file that describes the study (docs/study.md)"))]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    /// Problems of the study file or of its scene, in the order of the text.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Invalid(#[from] SceneError),
    #[error("the study has no case \"{name}\"")]
    #[diagnostic(help("its cases are: {}", dovetail_mesh::text::list(known)))]
    UnknownCase { name: String, known: Vec<String> },
    /// An input named by the scene, such as a mesh, without which no case can run.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Run(#[from] RunError),
    #[error("{action} {} failed", path.display())]
    #[diagnostic(help(
        "check that the path exists, that you may write there, and that the disk is not full"
    ))]
    Io {
        action: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(transparent)]
    Export(#[from] ExportError),
    /// The study is complete and its answers are written, but not every case has all its figures.
    #[error(
        "of {cases} cases {without} have no result, and {unconverged} have frequencies that did not converge"
    )]
    #[diagnostic(
        severity(Warning),
        help(
            "report.html says which; the log.txt in the folder of a case says why. Run the study again to retry the cases \
             that have no result"
        )
    )]
    CasesFailed {
        without: usize,
        unconverged: usize,
        cases: usize,
    },
}

impl StudyError {
    /// Error of a file operation; `action` is "reading", "starting", ...
    pub fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        move |source| Self::Io {
            action,
            path: path.to_owned(),
            source,
        }
    }

    /// Exit status of a command that ends with this error.
    pub fn exit_status(&self) -> ExitStatus {
        match self {
            Self::Read { .. } | Self::Invalid(_) | Self::UnknownCase { .. } => ExitStatus::BadInput,
            Self::Run(error) => error.exit_status(),
            Self::Io { .. } | Self::Export(_) => ExitStatus::Failed,
            Self::CasesFailed { .. } => ExitStatus::NotConverged,
        }
    }
}
