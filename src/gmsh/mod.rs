//! Runs gmsh on a script, and determines what the mesh of the script depends on.
//!
//! `process.rs` runs gmsh to its end, or kills it after the time limit that the scene gives. It
//! starts gmsh through `setpriv` where the system has that, so that gmsh ends when this program
//! does. No other foreign program is needed. The variable `DOVETAIL_GMSH` names a gmsh other than
//! that in PATH. `script.rs` reads which parameters the script has, because gmsh ignores those that
//! it does not know.
//!
//! The cache uses a mesh again where the parameters, the version of gmsh and what `inputs.rs`
//! returns are the same. Two things keep this right. gmsh runs on one thread. A script that reads
//! other data, or differs from run to run, has no inputs, and its mesh is not kept: a word of
//! Gmsh's language that does so must be on the list of `inputs.rs`.

pub mod inputs;
mod process;
mod script;

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::ExitStatus;

use thiserror::Error;

use dovetail_mesh::MeshError;
use dovetail_mesh::text;
use process::{Finished, ProcessError, run};
use script::{Definitions, is_option};

/// Environment variable with the name or the file of gmsh. The Python package sets it to the gmsh
/// that was installed with it.
const PROGRAM: &str = "DOVETAIL_GMSH";
/// Time limit for actions of gmsh that take no time apart from its start, on a machine with other
/// work.
const SHORT_LIMIT_S: f64 = 30.0;

/// Report of a successful run.
#[derive(Debug, Clone, PartialEq)]
pub struct GmshRun {
    /// Version, such as `4.8.4`; empty if gmsh did not print it.
    pub version: String,
    /// Messages that gmsh marks as warnings; only the first if there are many.
    pub warnings: Vec<String>,
    /// Wall time of gmsh, s.
    pub seconds: f64,
}

/// Reason why there is no mesh. Messages are those of gmsh, the first and the last ones of a long
/// run.
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
    #[error(
        "{} has no parameter `{name}`: {} (a script defines one with `DefineConstant[ {name} = 1 ];`)",
        script.display(), known_parameters(parameters)
    )]
    UnknownParameter {
        script: PathBuf,
        name: String,
        parameters: Vec<String>,
    },
    #[error(
        "{} sets the option `{name}` itself, so that the parameter has no effect: give the script a parameter for it",
        script.display()
    )]
    SetByScript { script: PathBuf, name: String },
    #[error(
        "the parameter `{name}` is no option of the installed gmsh that is a number: {messages}"
    )]
    UnknownOption { name: String, messages: String },
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
    #[error("gmsh failed ({status}){}\n{messages}", crash_remedy(*status))]
    Failed {
        status: ExitStatus,
        messages: String,
    },
    #[error(
        "gmsh ended without an error and without a mesh: does the script stop early (`Exit`), or name no physical volume?\n{messages}"
    )]
    NoMesh { messages: String },
    #[error(
        "gmsh ended without an error, and the mesh that it wrote is not whole: is the disk full that holds {}?",
        folder.display()
    )]
    NotWhole { folder: PathBuf, source: MeshError },
}

fn known_parameters(parameters: &[String]) -> String {
    match parameters {
        [] => "it has none".to_owned(),
        some => format!("it has {}", text::list(some)),
    }
}

fn crash_remedy(status: ExitStatus) -> &'static str {
    match status.code() {
        Some(_) => "",
        None => ": it crashed; try another Mesh.Algorithm3D (1 is the most robust)",
    }
}

/// Meshes `script` in three dimensions into the file `out` (MSH 4.1, binary).
///
/// Each of `parameters` is passed as `-setnumber name value`. gmsh silently ignores a parameter
/// that the script does not define, and an option that it does not have: both are errors here. gmsh
/// runs on one thread: the mesh then depends only on the script, the parameters and gmsh's version.
/// After `time_limit_s` it is killed; it also ends with this program. An existing file `out` is
/// removed in any case.
///
/// # Errors
/// A script or parameters that gmsh cannot mesh, a gmsh that is missing, fails or takes too long:
/// see [`GmshError`].
pub fn generate(
    script: &Path,
    parameters: &[(String, f64)],
    time_limit_s: f64,
    out: &Path,
) -> Result<GmshRun, GmshError> {
    generate_with(&program(), script, parameters, time_limit_s, out)
}

/// Name or file of gmsh: what the environment says, or the gmsh in PATH.
fn program() -> OsString {
    std::env::var_os(PROGRAM)
        .filter(|value| !value.is_empty())
        .unwrap_or_else(|| "gmsh".into())
}

/// Version of the installed gmsh, such as `4.8.4`.
///
/// # Errors
/// A gmsh that is missing or does not answer.
pub fn version() -> Result<String, GmshError> {
    version_of(&program(), SHORT_LIMIT_S)
}

fn version_of(program: &OsStr, time_limit_s: f64) -> Result<String, GmshError> {
    let run = started(program, &["--version".into()], time_limit_s)?;
    Ok(run.printed.last_line().unwrap_or_default().to_owned())
}

fn generate_with(
    program: &OsStr,
    script: &Path,
    parameters: &[(String, f64)],
    time_limit_s: f64,
    out: &Path,
) -> Result<GmshRun, GmshError> {
    // gmsh writes beside the target: a run that is cut off leaves nothing that looks like a mesh.
    let beside = |ending: &str| {
        let mut name = out.as_os_str().to_owned();
        name.push(ending);
        PathBuf::from(name)
    };
    let (partial, options) = (beside(".partial"), beside(".options.geo"));
    check_parameters(program, script, parameters, &options)?;
    for stale in [out, &partial] {
        match std::fs::remove_file(stale) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => return Err(output(stale, e)),
            _ => {}
        }
    }
    let mut arguments: Vec<OsString> = vec!["-3".into(), script.into(), "-nt".into(), "1".into()];
    for (name, value) in parameters {
        arguments.extend(["-setnumber".into(), name.into(), value.to_string().into()]);
    }
    arguments.extend(["-format", "msh41", "-bin", "-o"].map(OsString::from));
    arguments.push(partial.clone().into());

    let finished = started(program, &arguments, time_limit_s).and_then(|run| {
        let messages = || run.printed.messages();
        if !run.status.success() || run.printed.has_error {
            let (status, messages) = (run.status, messages());
            return Err(GmshError::Failed { status, messages });
        }
        match std::fs::rename(&partial, out) {
            Ok(()) => Ok(run),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Err(GmshError::NoMesh {
                messages: messages(),
            }),
            Err(e) => Err(output(out, e)),
        }
    });
    if finished.is_err() {
        let _ = std::fs::remove_file(&partial); // nothing to add to the error at hand
    }
    let run = finished?;
    Ok(GmshRun {
        version: run.printed.version.unwrap_or_default(),
        warnings: run.printed.warnings,
        seconds: run.seconds,
    })
}

fn output(path: &Path, source: std::io::Error) -> GmshError {
    let path = path.to_path_buf();
    GmshError::Output { path, source }
}

fn started(
    program: &OsStr,
    arguments: &[OsString],
    time_limit_s: f64,
) -> Result<Finished, GmshError> {
    let name = || program.to_string_lossy().into_owned();
    run(program, arguments, time_limit_s).map_err(|error| match error {
        ProcessError::Missing => GmshError::Missing { program: name() },
        ProcessError::Start(source) => GmshError::Start {
            program: name(),
            source,
        },
        ProcessError::TimeLimit(messages) => GmshError::TimeLimit {
            limit_s: time_limit_s,
            messages,
        },
    })
}

/// Checks that each parameter has an effect: the script lets others set it, or it is an option of
/// gmsh that the script does not set.
fn check_parameters(
    program: &OsStr,
    script: &Path,
    parameters: &[(String, f64)],
    scratch: &Path,
) -> Result<(), GmshError> {
    let defined = Definitions::open(script).map_err(|source| GmshError::Script {
        path: script.to_path_buf(),
        source,
    })?;
    for (name, value) in parameters {
        let (script, name) = (script.to_path_buf(), name.clone());
        if !value.is_finite() {
            let value = *value;
            return Err(GmshError::ParameterValue { name, value });
        }
        if is_option(&name) {
            if defined.sets_option(&name) {
                return Err(GmshError::SetByScript { script, name });
            }
            check_option(program, &name, *value, scratch)?;
        } else if !defined.has_parameter(&name) {
            let parameters = defined.parameters;
            return Err(GmshError::UnknownParameter {
                script,
                name,
                parameters,
            });
        }
    }
    Ok(())
}

/// Checks that gmsh has an option of this name, by a script in the file `scratch` that sets it.
/// Unlike `-setnumber`, this is an error if there is no such option.
fn check_option(program: &OsStr, name: &str, value: f64, scratch: &Path) -> Result<(), GmshError> {
    std::fs::write(scratch, format!("{name} = {value};\n")).map_err(|e| output(scratch, e))?;
    let arguments = [
        scratch.into(),
        "-nt".into(),
        "1".into(),
        "-parse_and_exit".into(),
    ];
    let run = started(program, &arguments, SHORT_LIMIT_S);
    let _ = std::fs::remove_file(scratch); // a file of one line stays behind
    let run = run?;
    if run.status.success() && !run.printed.has_error {
        Ok(())
    } else {
        Err(GmshError::UnknownOption {
            name: name.to_owned(),
            messages: run.printed.messages(),
        })
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::process::Command;
    use std::time::{Duration, Instant};

    /// Folder with a Gmsh script and a program in place of gmsh.
    struct Bench {
        dir: PathBuf,
    }

    impl Bench {
        fn new(name: &str, program: &str) -> Self {
            let dir = std::env::temp_dir().join(format!("dovetail-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&dir).unwrap();
            let bench = Self { dir };
            // By a shell of its own: starting a file that this process has open for writing may
            // fail, and another test thread that forks keeps it open.
            let text = format!("#!/bin/sh\nfor last; do :; done\n{program}\n");
            let shell = "printf %s \"$1\" > \"$2\" && chmod +x \"$2\"";
            let mut write = Command::new("sh");
            write.args(["-c", shell, "sh", &text]).arg(bench.program());
            assert!(write.status().unwrap().success());
            let script = "// ghost = 1\nDefineConstant[ nu = 4, /* old */ order = 2 ];\n\
                          length = 3; Point(1) = {0, 0, 0, length}; Mesh.Optimize = 1;\n";
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
            let program = self.program();
            generate_with(
                program.as_os_str(),
                &script,
                &parameters,
                limit,
                &self.out(),
            )
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

    /// Program in place of gmsh, which knows one option.
    const ONE_OPTION: &str = "case \"$last\" in
        -parse_and_exit) grep -q '^Mesh.Algorithm = ' \"$1\" || echo \"Error : Unknown number option\" ;;
        *) touch \"$last\" ;;
    esac";

    #[test]
    fn a_parameter_without_effect_is_an_error() {
        let bench = Bench::new("parameter", ONE_OPTION);
        let wrong = [
            "nuu",
            "ghost",
            "old",
            "Point",
            "length",
            "a/nu",
            "a.nu",
            "View[0].X",
            "A.B; C.D",
            "",
        ];
        for wrong in wrong {
            let error = bench.generate(&[(wrong, 8.0)], 20.0).unwrap_err();
            assert!(
                matches!(error, GmshError::UnknownParameter { .. }),
                "{error}"
            );
            let error = error.to_string();
            let words = format!("no parameter `{wrong}`: it has nu, order (");
            assert!(error.contains(&words), "{error}");
        }
        bench
            .generate(&[("nu", 8.0), ("Mesh.Algorithm", 5.0)], 20.0)
            .unwrap();
        let error = bench.generate(&[("Mesh.Algorithmm", 5.0)], 20.0);
        assert!(matches!(error, Err(GmshError::UnknownOption { .. })));
        let error = bench.generate(&[("Mesh.Optimize", 5.0)], 20.0);
        assert!(matches!(error, Err(GmshError::SetByScript { .. })));
        let error = bench.generate(&[("nu", f64::NAN)], 20.0).unwrap_err();
        assert!(matches!(error, GmshError::ParameterValue { .. }));
        let mut left: Vec<_> = std::fs::read_dir(&bench.dir)
            .unwrap()
            .map(|file| file.unwrap().file_name().into_string().unwrap())
            .collect();
        left.sort();
        assert_eq!(left, ["a.geo", "a.msh", "program"]);
    }

    /// The installed gmsh behaves as the program above.
    #[test]
    fn gmsh_tells_options_that_it_has_from_others() {
        let bench = Bench::new("options", "");
        let script = bench.dir.join("a.geo");
        let check = |name: &str| {
            let scratch = bench.dir.join("scratch.geo");
            let parameters = [(name.to_owned(), 1.0)];
            check_parameters(OsStr::new("gmsh"), &script, &parameters, &scratch)
        };
        check("Mesh.Algorithm").expect("gmsh is installed by `make test`");
        for name in ["Mesh.Algorithmm", "Mash.Algorithm", "General.FileName"] {
            let found = check(name);
            assert!(
                matches!(found, Err(GmshError::UnknownOption { .. })),
                "{name}: {found:?}"
            );
        }
    }

    #[test]
    fn the_version_is_not_waited_for_long() {
        let bench = Bench::new("version", "echo 4.99");
        assert_eq!(
            version_of(bench.program().as_os_str(), 20.0).unwrap(),
            "4.99"
        );
        let bench = Bench::new("no-version", "sleep 50");
        let start = Instant::now();
        let found = version_of(bench.program().as_os_str(), 0.5);
        assert!(matches!(found, Err(GmshError::TimeLimit { .. })));
        assert!(start.elapsed() < Duration::from_secs(10));
    }
}
