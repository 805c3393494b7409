//! gmsh as a separate program: it ends with this program. Messages about scripts and their
//! parameters.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::shared_folder::Folder;
use crate::shared_program::{ended, in_one_line, said};

/// Folder with a program in place of gmsh.
struct Bench(Folder);

impl Bench {
    fn new(name: &str, gmsh: &str) -> Self {
        let bench = Self(Folder::new(name));
        // Written by a shell of its own: starting a file that this process has open for writing may
        // fail.
        let shell = "printf '#!/bin/sh\\n%s\\n' \"$1\" > \"$2\" && chmod +x \"$2\"";
        let mut write = Command::new("sh");
        write
            .args(["-c", shell, "sh", gmsh])
            .arg(bench.0.join("gmsh"));
        assert!(write.status().unwrap().success());
        bench
    }

    fn command(&self, command: &str, set: &[&str]) -> Command {
        let path = std::env::var("PATH").unwrap_or_default();
        let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
        program
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .env("PATH", format!("{}:{path}", self.0.display()))
            .args([command, "scenes/verification/patch.toml", "--no-cache"])
            .arg("--out")
            .arg(self.0.join("out"));
        for set in set {
            program.args(["--set", set]);
        }
        program
    }
}

/// A killed program cannot end its children: the system has to.
#[cfg(target_os = "linux")]
#[test]
fn gmsh_ends_with_the_program_however_that_ends() {
    // Not for ever, should it stay.
    let beats = "i=0; while [ $i -lt 3000 ]; do echo >> \"$0.beats\"; sleep 0.02; i=$((i+1)); done";
    let bench = Bench::new("killed", beats);
    let beats = || std::fs::metadata(bench.0.join("gmsh.beats")).map_or(0, |beats| beats.len());
    let mut program = bench.command("mesh", &[]);
    let mut program = program.stderr(Stdio::null()).spawn().unwrap();
    let begin = Instant::now();
    while beats() < 3 {
        assert!(begin.elapsed() < Duration::from_secs(60), "gmsh is not run");
        std::thread::sleep(Duration::from_millis(10));
    }
    program.kill().unwrap(); // KILL
    program.wait().unwrap();
    std::thread::sleep(Duration::from_millis(300));
    let then = beats();
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(beats(), then, "gmsh runs on");
}

#[test]
fn a_flood_of_messages_is_told_in_part() {
    let flood = "yes 'Info    : the same again and again' | head -n 300000; head -c 50000000 /dev/zero | tr '\\0' x; echo; \
                 echo 'Error   : at the end' >&2; exit 1";
    let bench = Bench::new("flood", flood);
    let told = said(&ended(bench.command("mesh", &[]), 1));
    assert!(told.contains("Error   : at the end"), "{told}");
    assert!(
        in_one_line(&told).contains("lines are left out here"),
        "{told}"
    );
    assert!(told.len() < 50_000, "{} bytes", told.len());
}

#[test]
fn a_parameter_without_effect_is_told_with_those_there_are() {
    let bench = Bench::new("parameters", "echo not run >&2; exit 1");
    for (name, expected) in [
        (
            "nz",
            "patch.geo has no parameter `nz`: it has nx, ny, ratio, lc, shape, order (",
        ),
        ("\"mesh/nx\"", "no parameter `mesh/nx`"),
        ("\"a.nx\"", "no parameter `a.nx`"),
    ] {
        let set = format!("mesh.parameters={{ {name} = 5 }}");
        let told = in_one_line(&said(&ended(bench.command("mesh", &[&set]), 2)));
        assert!(told.contains(expected), "{told}");
    }
}

/// Messages of the installed gmsh; it ends with status 0 after an error in the script dovetail.geo.
#[test]
fn the_dovetail_needs_whole_numbers_of_nodes() {
    let folder = Bench::new("whole", "");
    for (set, expected) in [
        ("nu=4.5", "nu = 4.5"),
        ("nv=9.000001", "nv = 9.000001"),
        ("nsec=6.5", "nsec = 6.5"),
        ("npts=8.25", "npts = 8.25"),
        ("nsec=1", "nsec = 1"),
    ] {
        let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
        program.current_dir(env!("CARGO_MANIFEST_DIR"));
        program.args(["mesh", "scenes/paper.toml", "--no-cache", "--set"]);
        program.arg(format!("mesh.parameters.{set}"));
        program.arg("--out").arg(folder.0.join("out"));
        let told = in_one_line(&said(&ended(program, 1)));
        assert!(
            told.contains("Error : dovetail.geo:") && told.contains(expected),
            "{set}: {told}"
        );
    }
}

#[test]
fn a_script_is_said_to_be_code_that_runs() {
    let bench = Bench::new("check", "");
    let of = |set: &[&str]| in_one_line(&said(&ended(bench.command("check", set), 0)));
    let told = of(&[]);
    let expected = "patch.geo is a program that gmsh runs, and it can start any command: run it only where you trust it";
    assert!(told.contains(expected), "{told}");
    let mesh = Path::new("../../meshes/verification/patch.msh");
    let told = of(&[&format!("mesh.file={}", mesh.display())]);
    assert!(!told.contains("trust"), "{told}");
}
