//! gmsh as a separate program: it ends with this program. Messages about scripts and their
//! parameters.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::shared_folder::Folder;
use crate::shared_program::{READY_PATCH, cases, ended, has, said, scene_command, told, unwrapped};

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
        let scene = "scenes/verification/patch.toml";
        let mut program = scene_command(command, scene, &self.0.join("out"), set);
        program.env("PATH", format!("{}:{path}", self.0.display()));
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
    has(&told, "Error   : at the end");
    has(&unwrapped(&told), "lines are left out here");
    assert!(told.len() < 50_000, "{} bytes", told.len());
}

#[test]
fn a_parameter_without_effect_is_told_with_those_there_are() {
    let bench = Bench::new("parameters", "echo not run >&2; exit 1");
    let table = r#"
        nz => patch.geo has no parameter `nz`: it has nx, ny, ratio, lc, shape, order (
        "mesh/nx" => no parameter `mesh/nx`
        "a.nx" => no parameter `a.nx`
        "#;
    for [name, expected] in cases(table) {
        let set = format!("mesh.parameters={{ {name} = 5 }}");
        has(&told(bench.command("mesh", &[&set]), 2), &expected);
    }
}

/// Messages of the installed gmsh; it ends with status 0 after an error in the script dovetail.geo.
#[test]
fn the_dovetail_needs_whole_numbers_of_nodes() {
    let folder = Folder::new("whole");
    for set in ["nu=4.5", "nv=9.000001", "nsec=6.5", "npts=8.25", "nsec=1"] {
        let parameter = format!("mesh.parameters.{set}");
        let mesh = scene_command("mesh", "scenes/paper.toml", &folder, &[&parameter]);
        let words = format!("Error : dovetail.geo: & {}", set.replace('=', " = "));
        has(&told(mesh, 1), &words);
    }
}

#[test]
fn a_script_is_said_to_be_code_that_runs() {
    let bench = Bench::new("check", "");
    let expected = "patch.geo is a program that gmsh runs, and it can start any command: \
                    run it only where you trust it";
    has(&told(bench.command("check", &[]), 0), expected);
    let told = told(bench.command("check", &[READY_PATCH]), 0);
    assert!(!told.contains("trust"), "{told}");
}
