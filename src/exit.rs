//! Exit code of the program, which states how a command ended.

/// Status of a command at its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitStatus {
    /// The command did what it was asked.
    Done = 0,
    /// A computation failed, or a file could not be read or written.
    Failed = 1,
    /// The command line, the scene or the study is wrong.
    BadInput = 2,
    /// Everything was computed and written, but some frequencies, or cases of a study, did not
    /// converge, or a peak is unstable.
    NotConverged = 3,
    /// Ctrl-C or SIGTERM ended the command. The solved frequencies are written.
    Interrupted = 130,
}

impl ExitStatus {
    /// Exit code of the process.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// Returns `true` if a process with this exit code (`None`: ended by a signal) has written all
    /// its results.
    pub fn has_results(code: Option<i32>) -> bool {
        [Self::Done, Self::NotConverged]
            .map(|status| Some(i32::from(status.code())))
            .contains(&code)
    }
}
