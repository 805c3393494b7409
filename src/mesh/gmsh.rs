//! The `gmsh` program: the only one this crate starts.

use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::{input, text};

/// What a successful run has to tell.
#[derive(Debug, Clone, PartialEq)]
pub struct GmshRun {
    /// Such as `4.8.4`; empty where gmsh did not say.
    pub version: String,
    /// The messages gmsh marks as warnings.
    pub warnings: Vec<String>,
    pub seconds: f64,
}

/// Why there is no mesh. Messages are gmsh's own, the last ones of a long run.
#[derive(Debug, Error)]
pub enum GmshError {
    #[error(
        "the program `{program}` is not installed (Debian, Ubuntu: `apt install gmsh`; or `pip install gmsh`)"
    )]
    Missing { program: String },
    #[error("cannot start `{program}`: {source}")]
    Start {
        program: String,
        source: std::io::Error,
    },
    #[error("cannot read the Gmsh script {}: {source}", path.display())]
    Script {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{} has no parameter `{name}`{}", script.display(), known(parameters))]
    UnknownParameter {
        script: PathBuf,
        name: String,
        parameters: Vec<String>,
    },
    #[error("the parameter `{name}` is {value}: give a finite number")]
    ParameterValue { name: String, value: f64 },
    #[error("cannot write {}: {source}", path.display())]
    Output {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "gmsh was stopped after {limit_s} s: raise the time limit, or look for a mesh size field that refers to itself\n{messages}"
    )]
    TimeLimit { limit_s: f64, messages: String },
    #[error("gmsh failed ({status}){}\n{messages}", crash_remedy(status))]
    Failed {
        status: ExitStatus,
        messages: String,
    },
    #[error(
        "gmsh ended without an error and without a mesh: does the script stop early (`Exit`), or name no physical volume?\n{messages}"
    )]
    NoMesh { messages: String },
}

fn known(parameters: &[String]) -> String {
    match parameters {
        [] => String::new(),
        some => format!(": it has {}", text::list(some)),
    }
}

fn crash_remedy(status: &ExitStatus) -> &'static str {
    match status.code() {
        Some(_) => "",
        None => ": it crashed; try another Mesh.Algorithm3D (1 is the most robust)",
    }
}

/// Meshes `script` in three dimensions into the file `out` (MSH 4.1, binary).
///
/// Each of `parameters` is passed as `-setnumber name value`; one that the script never names is an
/// error, because gmsh would ignore it in silence. gmsh runs on one thread: the mesh then depends on
/// the script, the parameters and gmsh's version alone. After `time_limit_s` it is killed. A file
/// that stood at `out` is gone whatever happens.
pub fn generate(
    script: &Path,
    parameters: &[(String, f64)],
    time_limit_s: f64,
    out: &Path,
) -> Result<GmshRun, GmshError> {
    generate_with(OsStr::new("gmsh"), script, parameters, time_limit_s, out)
}

/// Version of the installed gmsh, such as `4.8.4`.
pub fn version() -> Result<String, GmshError> {
    let run = run(OsStr::new("gmsh"), &["--version".into()], 60.0)?;
    Ok(run.lines.last().cloned().unwrap_or_default())
}

fn generate_with(
    program: &OsStr,
    script: &Path,
    parameters: &[(String, f64)],
    time_limit_s: f64,
    out: &Path,
) -> Result<GmshRun, GmshError> {
    check_parameters(script, parameters)?;
    let output = |source| GmshError::Output {
        path: out.to_path_buf(),
        source,
    };
    // gmsh writes beside the target: a run that is cut off leaves nothing that looks like a mesh.
    let mut partial = out.as_os_str().to_owned();
    partial.push(".partial");
    let partial = PathBuf::from(partial);
    for stale in [out, &partial] {
        match std::fs::remove_file(stale) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(output(e)),
            _ => {}
        }
    }
    let mut arguments: Vec<OsString> = vec!["-3".into(), script.into(), "-nt".into(), "1".into()];
    for (name, value) in parameters {
        arguments.extend(["-setnumber".into(), name.into(), value.to_string().into()]);
    }
    arguments.extend(["-format", "msh41", "-bin", "-o"].map(OsString::from));
    arguments.push(partial.clone().into());

    let finished = run(program, &arguments, time_limit_s).and_then(|run| {
        let messages = || run.lines.join("\n");
        if !run.status.success() || run.lines.iter().any(|l| message(l, "Error").is_some()) {
            let (status, messages) = (run.status, messages());
            return Err(GmshError::Failed { status, messages });
        }
        match std::fs::rename(&partial, out) {
            Ok(()) => Ok(run),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Err(GmshError::NoMesh {
                messages: messages(),
            }),
            Err(e) => Err(output(e)),
        }
    });
    if finished.is_err() {
        let _ = std::fs::remove_file(&partial); // nothing to add to the error at hand
    }
    let run = finished?;
    let lines = run.lines.iter();
    Ok(GmshRun {
        version: lines
            .clone()
            .find_map(|l| version_in(l))
            .unwrap_or_default(),
        warnings: lines
            .filter_map(|l| message(l, "Warning"))
            .map(str::to_string)
            .collect(),
        seconds: run.seconds,
    })
}

/// Text of a line such as `Warning : text`.
fn message<'a>(line: &'a str, level: &str) -> Option<&'a str> {
    let text = line.strip_prefix(level)?.trim_start();
    text.strip_prefix(':').map(str::trim)
}

/// `4.8.4` of `... [Gmsh 4.8.4, 1 node, max. 1 thread]`.
fn version_in(line: &str) -> Option<String> {
    let (_, rest) = line.split_once("[Gmsh ")?;
    Some(rest.split([',', ']']).next()?.trim().to_string())
}

fn check_parameters(script: &Path, parameters: &[(String, f64)]) -> Result<(), GmshError> {
    let text = input::short_bytes(script).map_err(|source| GmshError::Script {
        path: script.to_path_buf(),
        source,
    })?;
    let text = without_comments(&String::from_utf8_lossy(&text));
    let in_word = |c: char| c.is_alphanumeric() || c == '_';
    let words = text.split(|c| !in_word(c));
    let included = words.clone().any(|w| w == "Include" || w == "Merge");
    for (name, value) in parameters {
        if !value.is_finite() {
            let (name, value) = (name.clone(), *value);
            return Err(GmshError::ParameterValue { name, value });
        }
        // An included file may name it; dots and slashes belong to options such as Mesh.Algorithm.
        if included || !name.chars().all(in_word) || words.clone().any(|w| w == name) {
            continue;
        }
        return Err(GmshError::UnknownParameter {
            script: script.to_path_buf(),
            name: name.clone(),
            parameters: defined_constants(&text),
        });
    }
    Ok(())
}

pub(super) fn without_comments(text: &str) -> String {
    let mut kept = String::new();
    let mut rest = text;
    while let Some(at) = rest.find('/') {
        let (before, from) = rest.split_at(at);
        kept.push_str(before);
        let end = match from.as_bytes().get(1) {
            Some(b'/') => from.find('\n'),
            Some(b'*') => from.find("*/").map(|i| i + 2),
            _ => {
                kept.push('/');
                Some(1)
            }
        };
        rest = &from[end.unwrap_or(from.len())..];
    }
    kept + rest
}

/// Names assigned in the `DefineConstant[ .. ]` blocks.
fn defined_constants(text: &str) -> Vec<String> {
    let blocks = text.split("DefineConstant").skip(1);
    let bodies = blocks.filter_map(|b| b.trim_start().strip_prefix('[')?.split(']').next());
    let names = bodies.flat_map(|b| b.split(',')).filter_map(|entry| {
        let name = entry.split('=').next()?.trim();
        let is_name = name.chars().all(|c| c.is_alphanumeric() || c == '_');
        (is_name && !name.is_empty()).then(|| name.to_string())
    });
    names.collect()
}

struct Finished {
    status: ExitStatus,
    lines: Vec<String>,
    seconds: f64,
}

/// Runs a program to its end or to the time limit, keeping what it prints.
fn run(program: &OsStr, arguments: &[OsString], time_limit_s: f64) -> Result<Finished, GmshError> {
    let name = || program.to_string_lossy().into_owned();
    let start = Instant::now();
    let mut command = Command::new(program);
    command
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0); // so that all of it can be killed
    let mut child = command.spawn().map_err(|source| match source.kind() {
        std::io::ErrorKind::NotFound => GmshError::Missing { program: name() },
        _ => GmshError::Start {
            program: name(),
            source,
        },
    })?;
    let printed = [
        child.stdout.take().map(drain),
        child.stderr.take().map(drain),
    ];
    let limit = Duration::try_from_secs_f64(time_limit_s).unwrap_or(Duration::MAX);
    let mut pause = Duration::from_millis(1);
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break Some(status),
            Ok(None) if start.elapsed() >= limit => break None,
            Ok(None) => std::thread::sleep(pause.min(limit.saturating_sub(start.elapsed()))),
            Err(source) => {
                kill(&mut child);
                let program = name();
                return Err(GmshError::Start { program, source });
            }
        }
        pause = (pause * 2).min(Duration::from_millis(20));
    };
    if status.is_none() {
        kill(&mut child);
    }
    let mut lines = Vec::new();
    for pipe in printed.into_iter().flatten() {
        // A grandchild that outlives the kill may hold the pipe: do not wait for it for ever.
        while let Ok(line) = pipe.recv_timeout(Duration::from_secs(2)) {
            lines.push(line);
        }
    }
    match status {
        Some(status) => Ok(Finished {
            status,
            lines,
            seconds: start.elapsed().as_secs_f64(),
        }),
        None => Err(GmshError::TimeLimit {
            limit_s: time_limit_s,
            messages: lines[lines.len().saturating_sub(20)..].join("\n"),
        }),
    }
}

/// Sends on the lines of a pipe, from a thread of its own, so that the pipe never fills up.
fn drain(pipe: impl Read + Send + 'static) -> Receiver<String> {
    let (send, receive) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(pipe).split(b'\n').map_while(Result::ok) {
            let line = String::from_utf8_lossy(&line).trim_end().to_string();
            if send.send(line).is_err() {
                break;
            }
        }
    });
    receive
}

fn kill(child: &mut Child) {
    #[cfg(unix)]
    {
        // The child leads a process group; the shell's own `kill` reaches all of it.
        let group = format!("kill -s KILL -- -{}", child.id());
        let _ = Command::new("sh")
            .args(["-c", &group])
            .stderr(Stdio::null())
            .status();
    }
    let _ = child.kill(); // it may have ended by itself meanwhile
    let _ = child.wait();
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    /// A folder with a Gmsh script and a program that stands in for gmsh.
    struct Bench {
        dir: PathBuf,
    }

    impl Bench {
        fn new(name: &str, program: &str) -> Self {
            let dir = std::env::temp_dir().join(format!("dovetail-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&dir).unwrap();
            let bench = Self { dir };
            let text = format!("#!/bin/sh\nfor last; do :; done\n{program}\n");
            std::fs::write(bench.program(), text).unwrap();
            let mode = std::fs::Permissions::from_mode(0o755);
            std::fs::set_permissions(bench.program(), mode).unwrap();
            let script = "// ghost = 1\nDefineConstant[ nu = 4, /* old */ order = 2 ];\n";
            std::fs::write(bench.dir.join("a.geo"), script).unwrap();
            bench
        }
        fn program(&self) -> PathBuf {
            self.dir.join("program")
        }
        fn out(&self) -> PathBuf {
            self.dir.join("a.msh")
        }
        fn generate(&self, parameters: &[(&str, f64)], limit: f64) -> Result<GmshRun, GmshError> {
            let parameters: Vec<_> = parameters
                .iter()
                .map(|(n, v)| (n.to_string(), *v))
                .collect();
            let script = self.dir.join("a.geo");
            // Starting a file just written fails now and then with "text file busy", when another
            // test thread forks between its writing and its closing.
            for _ in 0..50 {
                let program = self.program();
                let found = generate_with(
                    program.as_os_str(),
                    &script,
                    &parameters,
                    limit,
                    &self.out(),
                );
                match found {
                    Err(GmshError::Start { source, .. })
                        if source.kind() == std::io::ErrorKind::ExecutableFileBusy =>
                    {
                        std::thread::sleep(Duration::from_millis(20));
                    }
                    found => return found,
                }
            }
            panic!("the program cannot be started");
        }
    }

    impl Drop for Bench {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.dir);
        }
    }

    #[test]
    fn arguments_warnings_and_version_pass_through() {
        let bench = Bench::new(
            "pass",
            "echo \"$@\" > \"$last\"; echo \"Info    : Running 'x' [Gmsh 4.8.4, 1 node]\"; echo 'Warning : thin' >&2",
        );
        std::fs::write(bench.out(), "stale").unwrap();
        let run = bench
            .generate(&[("nu", 8.0), ("order", 0.25)], 20.0)
            .unwrap();
        assert_eq!(run.version, "4.8.4");
        assert_eq!(run.warnings, ["thin"]);
        let told = std::fs::read_to_string(bench.out()).unwrap();
        assert!(told.contains("-nt 1 -setnumber nu 8 -setnumber order 0.25 -format msh41 -bin -o"));
    }

    #[test]
    fn a_stale_mesh_is_not_taken_for_a_new_one() {
        let bench = Bench::new("stale", "echo 'Info : leaving'; exit 0");
        std::fs::write(bench.out(), "stale").unwrap();
        let Err(GmshError::NoMesh { messages }) = bench.generate(&[], 20.0) else {
            panic!("expected NoMesh");
        };
        assert!(messages.contains("leaving"));
        assert!(!bench.out().exists());
    }

    #[test]
    fn errors_of_gmsh_are_shown_even_with_status_0_and_a_file() {
        let bench = Bench::new("error", "touch \"$last\"; echo 'Error   : no volume' >&2");
        let error = bench.generate(&[], 20.0).unwrap_err().to_string();
        assert!(error.contains("no volume"), "{error}");
        assert!(!bench.out().exists());
        let bench = Bench::new("status", "touch \"$last\"; exit 3");
        let error = bench.generate(&[], 20.0).unwrap_err().to_string();
        assert!(error.contains("exit status: 3"), "{error}");
        let bench = Bench::new("crash", "kill -11 $$");
        let error = bench.generate(&[], 20.0).unwrap_err().to_string();
        assert!(error.contains("Algorithm3D"), "{error}");
    }

    #[test]
    fn the_time_limit_kills_the_program_and_its_children() {
        let bench = Bench::new(
            "hang",
            "echo 'Info : begun'; (while :; do echo >> \"$last.beat\"; sleep 0.02; done) & wait",
        );
        let start = Instant::now();
        let Err(GmshError::TimeLimit { messages, .. }) = bench.generate(&[], 0.5) else {
            panic!("expected TimeLimit");
        };
        assert!(messages.contains("begun"));
        assert!(start.elapsed() < Duration::from_secs(10));
        let beats = || {
            std::fs::metadata(bench.dir.join("a.msh.partial.beat"))
                .unwrap()
                .len()
        };
        let then = beats();
        std::thread::sleep(Duration::from_millis(300));
        assert!(
            then > 0 && beats() == then,
            "a child of the program still runs"
        );
    }

    #[test]
    fn a_full_pipe_does_not_stop_the_program() {
        let bench = Bench::new(
            "chatty",
            "i=0; while [ $i -lt 3000 ]; do echo \"Info : $i 0123456789012345678901234567890123456789\" >&2; i=$((i+1)); done; touch \"$last\"",
        );
        bench.generate(&[], 60.0).unwrap();
    }

    #[test]
    fn a_missing_program_is_told_apart() {
        let bench = Bench::new("missing", "");
        let script = bench.dir.join("a.geo");
        let nowhere = bench.dir.join("nowhere");
        let found = generate_with(nowhere.as_os_str(), &script, &[], 1.0, &bench.out());
        assert!(matches!(found, Err(GmshError::Missing { .. })));
        let script = bench.dir.join("b.geo");
        let found = generate_with(nowhere.as_os_str(), &script, &[], 1.0, &bench.out());
        assert!(matches!(found, Err(GmshError::Script { .. })));
    }

    #[test]
    fn a_parameter_the_script_does_not_name_is_an_error() {
        let bench = Bench::new("parameter", "touch \"$last\"");
        for wrong in ["nuu", "ghost", "old"] {
            let error = bench
                .generate(&[(wrong, 8.0)], 20.0)
                .unwrap_err()
                .to_string();
            assert!(
                error.contains(wrong) && error.ends_with("it has nu, order"),
                "{error}"
            );
        }
        bench
            .generate(&[("nu", 8.0), ("Mesh.Algorithm", 5.0)], 20.0)
            .unwrap();
        let error = bench.generate(&[("nu", f64::NAN)], 20.0).unwrap_err();
        assert!(matches!(error, GmshError::ParameterValue { .. }));
    }
}
