//! Error of a command: that of the scene, the run or the study of the command, or of the command
//! line itself.

use std::fmt;
use std::path::{Path, PathBuf};

use miette::{Diagnostic, LabeledSpan, SourceCode};
use thiserror::Error;

use crate::error::RunError;
use crate::exit::ExitStatus;
use crate::scene::{SceneError, SceneProblem, located};
use crate::study_file::StudyError;
use dovetail_cache::EnvironmentError;
use dovetail_solver::memory::TooLittle;
use dovetail_superelement::input;

/// Reason why a command ended without its full result.
#[derive(Debug, Error, Diagnostic)]
pub enum Error {
    #[error(transparent)]
    #[diagnostic(transparent)]
    Scene(#[from] SceneError),

    #[error(transparent)]
    #[diagnostic(transparent)]
    Run(#[from] RunError),

    /// Error of a run about a place in the scene.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Located(Box<LocatedError>),

    #[error(transparent)]
    #[diagnostic(transparent)]
    Study(#[from] StudyError),

    /// More ranges of `dovetail peaks` than there are axes.
    #[error("{given} ranges were given with --over, and a map has two axes")]
    #[diagnostic(help("give one key or two; `dovetail study` varies any number of keys"))]
    KeyRanges { given: usize },

    /// Numbers of cycles of `dovetail wear` that do not ascend.
    #[error("the cycles must ascend, and {from} to {to} do not")]
    #[diagnostic(help("give --cycles the end alone, or the numbers on the way before it"))]
    CyclesDescend { from: f64, to: f64 },

    /// Invalid name of a new scene.
    #[error("`{name}` cannot be the name of a scene")]
    #[diagnostic(help(
        "give a folder whose name begins with an ASCII letter and has letters, digits, `_` and `-`, \
         at most 100 of them, such as `dovetail new my_blade`"
    ))]
    NewName { name: String },

    /// Folder of a new scene that already exists.
    #[error("{} exists and is left as it is", path.display())]
    #[diagnostic(help("give another name, or move it away first"))]
    NewExists { path: PathBuf },

    /// Environment variable with an invalid value.
    #[error(transparent)]
    #[diagnostic(help("correct it, or unset it"))]
    Environment(#[from] EnvironmentError),

    /// The threads of `--threads` could not be started.
    #[error("{threads} threads could not be started")]
    #[diagnostic(help(
        "give a smaller number with --threads, or raise the limits of memory and of processes (`ulimit -v`, `ulimit -u`, the container, \
         the batch system)"
    ))]
    Threads {
        threads: usize,
        source: rayon::ThreadPoolBuildError,
    },

    /// The threads do not fit in memory; reported before they are started.
    #[error("{threads} threads do not fit in memory")]
    #[diagnostic(help("give a smaller number with --threads"))]
    MemoryOfThreads { threads: usize, source: TooLittle },

    /// The threads that wait for signals and for the end of memory could not be started.
    #[error(
        "the system does not let the program start its threads, for want of memory or of processes"
    )]
    #[diagnostic(help(
        "raise the limits of memory and of processes (`ulimit -v`, `ulimit -u`, the container, the batch system)"
    ))]
    Start(#[source] std::io::Error),

    /// The handling of Ctrl-C could not be set up.
    #[error("the handling of Ctrl-C and SIGTERM could not be set up")]
    #[diagnostic(help("run it where a program may handle signals"))]
    Signals(#[source] std::io::Error),

    /// The results could not be printed.
    #[error("writing to the standard output failed")]
    #[diagnostic(help(
        "check where the output of the command goes; the files of the run hold the same results"
    ))]
    Print(#[source] std::io::Error),
}

/// Error of a run, with the place in the scene that it is about.
#[derive(Debug, Error)]
#[error("{error}")]
pub struct LocatedError {
    error: RunError,
    place: SceneProblem,
}

impl Diagnostic for LocatedError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.error.help()
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place.source_code()
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.place.labels()
    }
}

impl Error {
    /// The same error with its place in the scene `file`, if it is about one.
    pub fn located(self, file: &Path, overrides: &[String]) -> Self {
        let Self::Run(error) = self else {
            return self;
        };
        let place = match &error {
            RunError::Run(ended) => ended.subject().and_then(|subject| {
                let text = input::text(file).ok()?;
                located::place(&text, &file.display().to_string(), overrides, &subject)
            }),
            _ => None,
        };
        match place {
            Some(place) => Self::Located(Box::new(LocatedError { error, place })),
            None => Self::Run(error),
        }
    }

    /// Exit status of a command that ends with this error.
    pub fn exit_status(&self) -> ExitStatus {
        match self {
            Self::Scene(_)
            | Self::Environment(_)
            | Self::KeyRanges { .. }
            | Self::CyclesDescend { .. }
            | Self::NewName { .. }
            | Self::NewExists { .. } => ExitStatus::BadInput,
            Self::Run(error) => error.exit_status(),
            Self::Located(located) => located.error.exit_status(),
            Self::Study(error) => error.exit_status(),
            Self::Threads { .. }
            | Self::MemoryOfThreads { .. }
            | Self::Start(_)
            | Self::Signals(_)
            | Self::Print(_) => ExitStatus::Failed,
        }
    }
}
