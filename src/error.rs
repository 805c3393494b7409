//! The error of a run: the stage's own error, passed through, and the exit code it stands for.

use std::path::PathBuf;

use miette::Diagnostic;
use thiserror::Error;

use crate::scene::SceneError;

/// Exit code of a run that did what it was asked.
pub const EXIT_OK: u8 = 0;
/// Exit code: a computation failed, or a file could not be read or written.
pub const EXIT_FAILED: u8 = 1;
/// Exit code: the command line or the scene is wrong.
pub const EXIT_BAD_INPUT: u8 = 2;
/// Exit code: everything was computed and written, but some frequencies did not converge.
pub const EXIT_NOT_CONVERGED: u8 = 3;

/// Why a run ended without its full result.
#[derive(Debug, Error, Diagnostic)]
pub enum Error {
    #[error(transparent)]
    #[diagnostic(transparent)]
    Scene(#[from] SceneError),

    /// Reading or writing a file.
    #[error("{action} {} failed", path.display())]
    #[diagnostic(help(
        "check that the path exists, that you may write there, and that the disk is not full"
    ))]
    Io {
        /// "writing", "creating the folder", ...
        action: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },

    /// The threads of `--threads` could not be started.
    #[error("{threads} threads could not be started")]
    #[diagnostic(help("give a smaller number with --threads, or leave it out to use all cores"))]
    Threads {
        threads: usize,
        source: rayon::ThreadPoolBuildError,
    },

    /// The run is complete, its files are written, but not every frequency has a solution.
    #[error("{unconverged} of {points} frequencies did not converge")]
    #[diagnostic(
        severity(Warning),
        help(
            "they are marked in the column `outcome` of response.csv and left out of the curves; more \
             response.max_newton_iterations, a smaller step in frequency (response.points) or another \
             response.eps may help"
        )
    )]
    NotConverged { unconverged: usize, points: usize },
}

impl Error {
    /// The exit code of the program: see the constants of this module.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Scene(_) => EXIT_BAD_INPUT,
            Self::Io { .. } | Self::Threads { .. } => EXIT_FAILED,
            Self::NotConverged { .. } => EXIT_NOT_CONVERGED,
        }
    }
}
