//! Runs gmsh to its end or to a time limit. It ends with this program, however this program ends,
//! and the amount of its messages that is kept is bounded.

use std::collections::VecDeque;
use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Largest number of bytes kept of a line.
const LINE_BYTES: usize = 500;
/// Largest number of lines kept from the beginning.
const FIRST_LINES: usize = 20;
/// Largest number of lines kept from the end.
const LAST_LINES: usize = 60;
/// Largest number of errors, and of warnings, kept in addition.
const MARKED_LINES: usize = 20;

/// Result of a program that ended: its status and its output.
#[derive(Debug)]
pub(super) struct Finished {
    pub status: ExitStatus,
    pub printed: Printed,
    pub seconds: f64,
}

/// Reason why a program did not come to its end.
#[derive(Debug)]
pub(super) enum ProcessError {
    /// There is no such program.
    Missing,
    Start(std::io::Error),
    /// The time limit, with the output of the program.
    TimeLimit(String),
}

/// Output of a program on both streams.
#[derive(Debug, Default)]
pub(super) struct Printed {
    first: Vec<String>,
    last: VecDeque<String>,
    /// Number of lines left out between the two.
    left_out: usize,
    /// Errors, up to a limit.
    errors: Vec<String>,
    pub has_error: bool,
    /// Warnings, up to a limit.
    pub warnings: Vec<String>,
    /// Version, such as `4.8.4`.
    pub version: Option<String>,
}

impl Printed {
    fn add(&mut self, line: String) {
        if message(&line, "Error").is_some() {
            self.has_error = true;
            if self.errors.len() < MARKED_LINES {
                self.errors.push(line.clone());
            }
        }
        if let Some(warning) = message(&line, "Warning")
            && self.warnings.len() < MARKED_LINES
        {
            self.warnings.push(warning.to_owned());
        }
        if self.version.is_none() {
            self.version = version_in(&line);
        }
        if self.first.len() < FIRST_LINES {
            self.first.push(line);
            return;
        }
        self.last.push_back(line);
        if self.last.len() > LAST_LINES {
            self.last.pop_front();
            self.left_out += 1;
        }
    }

    /// Errors, and below them all lines kept, with a note on those left out.
    pub(super) fn messages(&self) -> String {
        let mut lines: Vec<&str> = self.errors.iter().map(String::as_str).collect();
        if !lines.is_empty() {
            lines.push("[all that gmsh said]");
        }
        lines.extend(self.first.iter().map(String::as_str));
        let gap = format!("[{} lines are left out here]", self.left_out);
        if self.left_out > 0 {
            lines.push(&gap);
        }
        lines.extend(self.last.iter().map(String::as_str));
        lines.join("\n")
    }

    pub(super) fn last_line(&self) -> Option<&str> {
        let last = self.last.back().or(self.first.last());
        last.map(String::as_str)
    }
}

/// Text of a line such as `Warning : text`.
fn message<'a>(line: &'a str, level: &str) -> Option<&'a str> {
    let text = line.strip_prefix(level)?.trim_start();
    text.strip_prefix(':').map(str::trim)
}

/// Version in a line: `4.8.4` of `... [Gmsh 4.8.4, 1 node, max. 1 thread]`.
fn version_in(line: &str) -> Option<String> {
    let (_, rest) = line.split_once("[Gmsh ")?;
    Some(rest.split([',', ']']).next()?.trim().to_string())
}

/// Runs a program, given by a path or by a name that is looked for in PATH, to its end or to the
/// time limit.
pub(super) fn run(
    program: &OsStr,
    arguments: &[OsString],
    time_limit_s: f64,
) -> Result<Finished, ProcessError> {
    let program = find(program).ok_or(ProcessError::Missing)?;
    let start = Instant::now();
    let mut command = match ending_with_parent() {
        // The signal comes when the thread that starts the program ends: this one, which waits
        // below.
        Some(setpriv) => {
            let mut command = Command::new(setpriv);
            command.args(DIES_WITH_PARENT).arg(&program);
            command
        }
        None => Command::new(&program),
    };
    command
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0); // so that all of it can be killed
    let mut child = command.spawn().map_err(ProcessError::Start)?;
    let printed = Arc::new(Mutex::new(Printed::default()));
    let pipes = [
        child.stdout.take().map(|pipe| drain(pipe, &printed)),
        child.stderr.take().map(|pipe| drain(pipe, &printed)),
    ];
    let pipes = pipes
        .into_iter()
        .flatten()
        .collect::<std::io::Result<Vec<_>>>();
    let pipes = pipes.map_err(|source| {
        kill(&mut child);
        ProcessError::Start(source)
    })?;
    let limit = Duration::try_from_secs_f64(time_limit_s).unwrap_or(Duration::MAX);
    let mut pause = Duration::from_millis(1);
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break Some(status),
            Ok(None) if start.elapsed() >= limit => break None,
            Ok(None) => std::thread::sleep(pause.min(limit.saturating_sub(start.elapsed()))),
            Err(source) => {
                kill(&mut child);
                return Err(ProcessError::Start(source));
            }
        }
        pause = (pause * 2).min(Duration::from_millis(20));
    };
    if status.is_none() {
        kill(&mut child);
    }
    for end in pipes {
        // A grandchild that outlives the kill may hold the pipe: do not wait for it for ever.
        let _ = end.recv_timeout(Duration::from_secs(2));
    }
    let printed = std::mem::take(&mut *printed.lock().unwrap_or_else(PoisonError::into_inner));
    match status {
        Some(status) => Ok(Finished {
            status,
            printed,
            seconds: start.elapsed().as_secs_f64(),
        }),
        None => Err(ProcessError::TimeLimit(printed.messages())),
    }
}

/// Path of the file of a program. The search of the system would be that of `setpriv`, which
/// reports a missing program only in words.
fn find(program: &OsStr) -> Option<PathBuf> {
    let is_program = |path: &PathBuf| {
        path.metadata().is_ok_and(|about| {
            #[cfg(unix)]
            let may_run =
                std::os::unix::fs::PermissionsExt::mode(&about.permissions()) & 0o111 != 0;
            #[cfg(not(unix))]
            let may_run = true;
            about.is_file() && may_run
        })
    };
    let path = PathBuf::from(program);
    if path.components().count() > 1 {
        return Some(path).filter(is_program);
    }
    let folders = std::env::var_os("PATH").unwrap_or_else(|| "/usr/bin:/bin".into());
    std::env::split_paths(&folders)
        .map(|folder| folder.join(program))
        .find(is_program)
}

/// Arguments with which `setpriv` (util-linux) starts a program that the system kills when its
/// parent ends.
const DIES_WITH_PARENT: [&str; 3] = ["--pdeathsig", "KILL", "--"];

/// Path of `setpriv`, if it exists and accepts the arguments.
fn ending_with_parent() -> Option<&'static Path> {
    static FOUND: OnceLock<Option<PathBuf>> = OnceLock::new();
    let setpriv = FOUND.get_or_init(|| {
        let setpriv = find(OsStr::new("setpriv"))?;
        let mut command = Command::new(&setpriv);
        command.args(DIES_WITH_PARENT).arg("true");
        command.stdin(Stdio::null()).stdout(Stdio::null());
        let works = command.stderr(Stdio::null()).status();
        works
            .is_ok_and(|status| status.success())
            .then_some(setpriv)
    });
    setpriv.as_deref()
}

/// Reads the lines of a pipe in a separate thread, so that the pipe never fills up. The receiver is
/// notified of its end.
fn drain(
    pipe: impl Read + Send + 'static,
    printed: &Arc<Mutex<Printed>>,
) -> std::io::Result<Receiver<()>> {
    let (send, receive) = channel();
    let printed = Arc::clone(printed);
    std::thread::Builder::new().spawn(move || {
        let mut pipe = BufReader::new(pipe);
        while let Some(line) = next_line(&mut pipe) {
            let mut printed = printed.lock().unwrap_or_else(PoisonError::into_inner);
            printed.add(line);
        }
        let _ = send.send(()); // nobody waits where the program was left alone
    })?;
    Ok(receive)
}

/// Beginning of the next line, without control characters of a terminal; `None` at the end.
fn next_line(pipe: &mut impl BufRead) -> Option<String> {
    let (mut kept, mut cut) = (Vec::new(), false);
    loop {
        let read = match pipe.fill_buf() {
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => continue,
            read => read.ok()?,
        };
        if read.is_empty() && kept.is_empty() {
            return None;
        }
        let end = read.iter().position(|byte| *byte == b'\n');
        let line = &read[..end.unwrap_or(read.len())];
        let room = LINE_BYTES - kept.len();
        cut |= line.len() > room;
        kept.extend_from_slice(&line[..line.len().min(room)]);
        let (is_last, used) = (read.is_empty() || end.is_some(), line.len());
        pipe.consume(used + usize::from(end.is_some()));
        if is_last {
            break;
        }
    }
    let line = String::from_utf8_lossy(&kept);
    let line = line.trim_end().replace(char::is_control, " ");
    Some(if cut { line + " ..." } else { line })
}

fn kill(child: &mut Child) {
    #[cfg(unix)]
    {
        // The child leads a process group.
        use rustix::process::{Pid, Signal, kill_process_group};
        let _ = kill_process_group(Pid::from_child(child), Signal::KILL);
    }
    let _ = child.kill(); // it may have ended by itself meanwhile
    let _ = child.wait();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_long_lines_the_first_and_the_last_are_kept() {
        let mut text = String::from("\x1b[31mbegin\n\n");
        for i in 0..100_000 {
            match i {
                50_000 => text.push_str("Error   : no volume\n"),
                50_001 => text.push_str("Warning : thin\n"),
                _ => text.push_str(&format!("Info    : {i}\n")),
            }
        }
        text.push_str(&"long ".repeat(100_000));
        text.push_str("\nInfo : [Gmsh 4.8.4, 1 node]\nthe end without a line feed");
        let mut printed = Printed::default();
        let mut pipe = BufReader::with_capacity(7, text.as_bytes());
        while let Some(line) = next_line(&mut pipe) {
            assert!(line.len() <= LINE_BYTES + 4);
            printed.add(line);
        }
        assert!(printed.has_error);
        assert_eq!(printed.warnings, ["thin"]);
        assert_eq!(printed.version.as_deref(), Some("4.8.4"));
        assert_eq!(printed.last_line(), Some("the end without a line feed"));
        let messages = printed.messages();
        let lines: Vec<&str> = messages.lines().collect();
        assert_eq!(lines.len(), FIRST_LINES + 3 + LAST_LINES);
        assert_eq!(lines[..2], ["Error   : no volume", "[all that gmsh said]"]);
        assert_eq!(lines[2..5], [" [31mbegin", "", "Info    : 0"]);
        let left_out = 100_005 - FIRST_LINES - LAST_LINES;
        assert_eq!(
            lines[FIRST_LINES + 2],
            format!("[{left_out} lines are left out here]")
        );
        assert!(lines[lines.len() - 3].ends_with("long ..."), "{messages}");
    }

    #[test]
    fn warnings_are_counted_up_to_a_limit() {
        let mut printed = Printed::default();
        for i in 0..1000 {
            printed.add(format!("Warning : {i}"));
        }
        assert_eq!(printed.warnings.len(), MARKED_LINES);
    }
}
