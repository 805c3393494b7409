//! Lack of memory is reported, if possible before the memory is used, and no run ends by a signal.

use std::process::Command;

use dovetail_export::manifest::RunState;
use dovetail_solver::run::Stage;

use crate::shared_folder::Folder;
use crate::shared_program::{SMALL, ended, has, said_in_one_line, scene_command, told};
use crate::shared_runs::manifest;

/// A command with a limit of the shell, such as `-v 1000` for an address space of 1000 KiB.
fn limited(limit: &str, command: &Command) -> Command {
    let mut shell = Command::new("bash");
    shell
        .current_dir(command.get_current_dir().unwrap())
        .args(["-c", &format!("ulimit {limit}; exec \"$@\""), "bash"])
        .arg(command.get_program())
        .args(command.get_args());
    shell
}

/// Command `dovetail reduce` for the paper's scene on one thread, with an address space of this
/// many KiB.
fn reduce(out: &Folder, limit_kib: Option<u64>) -> Command {
    let limit = limit_kib.map_or("unlimited".to_owned(), |kib| kib.to_string());
    let ready = [
        "mesh.file=../meshes/dovetail.msh",
        "rotation.prestress=contact",
    ];
    let mut reduce = scene_command("reduce", "scenes/paper.toml", out, &ready);
    limited(&format!("-v {limit}"), reduce.args(["--threads", "1"]))
}

#[test]
fn too_little_memory_is_told_before_factoring() {
    if !cfg!(target_os = "linux") {
        return;
    }
    let out = Folder::new("little-memory");
    // What the process maps beside its matrices is not known to a test: products of matrices have
    // buffers as large as the caches of the processor. The least of these limits in which the
    // matrices have room is too little for the factor of the assembly.
    let of_assembly = (300..2000).step_by(20).find_map(|mib| {
        let output = reduce(&out, Some(mib << 10)).output().unwrap();
        let words = said_in_one_line(&output);
        let (_, why) = words.split_once("the stiffness of the assembly cannot be factored")?;
        let (_, rest) = why.split_once("unknowns, about ")?;
        assert_eq!(output.status.code(), Some(1), "{words}");
        has(rest, "are available: refine the mesh less");
        Some(rest.split_once(" GiB").unwrap().0.parse::<f64>().unwrap())
    });
    let needed_mib = 1024.0 * of_assembly.expect("no limit was too small for the assembly alone");
    let failed = manifest(&out);
    assert_eq!(failed.state, RunState::Failed);
    assert!(failed.why.unwrap().contains("GiB are available"));
    ended(reduce(&out, None), 0);
    let stages = manifest(&out).stages;
    let peak_mib = |id: Stage| {
        let stage = stages.iter().find(|s| s.id == id).unwrap();
        stage.peak_memory_mib.unwrap()
    };
    // The matrices of the bodies and of the assembly come beside the elimination, which finds the
    // displacement that the first prestress comes from.
    let grown_mib = peak_mib(Stage::FiniteElements) - peak_mib(Stage::Model);
    assert!(
        (0.95 * needed_mib..4.0 * needed_mib).contains(&grown_mib),
        "{needed_mib} of {grown_mib}"
    );
}

/// Command `dovetail run` for the paper's scene on the small mesh.
fn small(out: &Folder, words: &[&str]) -> Command {
    let set = [SMALL, "response.points=3", "response.compare_harmonics="];
    let mut run = scene_command("run", "scenes/paper.toml", out, &set);
    run.arg("--quiet").args(words);
    run
}

/// Command [`small`] with an address space of this many MiB.
fn run(out: &Folder, limit_mib: u64, words: &[&str]) -> Command {
    limited(&format!("-v {}", limit_mib << 10), &small(out, words))
}

/// The memory that a process maps is unknown to a test, so that a limit may suffice for one thread
/// and not for many. Each run ends with its results or with a message, which is also in its folder.
#[test]
fn no_limit_of_memory_ends_a_run_by_a_signal() {
    if !cfg!(target_os = "linux") {
        return;
    }
    let mut refused = 0;
    for limit_mib in [60, 120, 200, 280, 400, 700] {
        for threads in ["1", "16"] {
            let out = Folder::new("memory-ladder");
            let mut run = run(&out, limit_mib, &["--threads", threads]);
            let output = run.output().unwrap();
            let words = said_in_one_line(&output);
            let at = format!("{limit_mib} MiB, {threads} threads: {words}");
            println!("{:?} {at}", output.status);
            let code = output
                .status
                .code()
                .unwrap_or_else(|| panic!("a signal at {at}"));
            if code == 0 {
                continue;
            }
            refused += 1;
            assert_eq!(code, 1, "{at}");
            assert!(
                words.contains("memory") && !words.contains("panicked"),
                "{at}"
            );
            if out.join("summary.json").exists() {
                let failed = manifest(&out);
                assert_eq!(failed.state, RunState::Failed, "{at}");
                assert!(failed.why.unwrap().contains("memory"), "{at}");
            }
        }
    }
    assert!(refused > 2, "all levels are enough");
}

/// Below some limit the system does not load the program: it ends it, or says which library has no
/// room. From there on each run ends with a message of the program.
#[test]
fn a_program_that_is_loaded_ends_with_a_message_in_the_least_memory() {
    if !cfg!(target_os = "linux") {
        return;
    }
    let mut loaded = 0;
    for limit_mib in 30..80 {
        let out = Folder::new("memory-start");
        let output = run(&out, limit_mib, &["--threads", "1"]).output().unwrap();
        let words = said_in_one_line(&output);
        let is_of_loader = words.is_empty() || words.contains("shared libraries");
        if loaded == 0 && is_of_loader {
            continue;
        }
        loaded += 1;
        let at = format!("{limit_mib} MiB: {:?} {words}", output.status);
        assert_eq!(output.status.code(), Some(1), "{at}");
        assert!(words.contains("memory") && words.contains("help: "), "{at}");
    }
    assert!(loaded > 5, "{loaded}");
}

/// The derivative of a pair has 6003 x 6003 entries.
#[test]
fn a_jacobian_that_does_not_fit_is_refused_before_the_first_frequency() {
    if !cfg!(target_os = "linux") {
        return;
    }
    let out = Folder::new("memory-jacobian");
    let many = [
        "--set",
        "response.harmonics=1000",
        "--set",
        "response.samples=4096",
    ];
    let words = "does not fit in memory & take fewer response.harmonics";
    has(&told(run(&out, 2500, &many), 1), words);
    let failed = manifest(&out);
    assert_eq!(failed.state, RunState::Failed);
    assert!(failed.why.unwrap().contains("GiB are available"));
}

/// A thousand threads would need twice the memory.
#[test]
fn no_more_threads_are_started_than_are_of_use() {
    if !cfg!(target_os = "linux") {
        return;
    }
    let out = Folder::new("memory-threads");
    ended(run(&out, 2000, &["--threads", "1000"]), 0);
}

/// The limit counts blocks of 1024 bytes; the report of a run is larger.
#[test]
fn a_file_that_may_not_grow_is_an_error_with_its_name() {
    if !cfg!(unix) {
        return;
    }
    let out = Folder::new("memory-file");
    let words = told(limited("-f 64", &small(&out, &[])), 1);
    has(&words, "File too large");
    assert!(
        words.contains(".vtu") || words.contains("report.html"),
        "{words}"
    );
    assert_eq!(manifest(&out).state, RunState::Failed);
}
