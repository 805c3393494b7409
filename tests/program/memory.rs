//! Too little memory is told before a factorisation begins, with what it needs.

use std::process::Command;

use dovetail::export::manifest::{RunState, Summary};
use dovetail::stage::Stage;

use crate::shared_folder::Folder;
use crate::shared_program::{ended, in_one_line, said};

/// `dovetail modes` of the paper's scene on one thread, with an address space of so many KiB.
fn modes(out: &Folder, limit_kib: Option<u64>) -> Command {
    let limit = limit_kib.map_or("unlimited".to_owned(), |kib| kib.to_string());
    let mut shell = Command::new("sh");
    shell
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["-c", "ulimit -v $1; shift; exec \"$@\"", "sh", &limit])
        .arg(env!("CARGO_BIN_EXE_dovetail"))
        .args(["modes", "scenes/paper.toml", "--threads", "1", "--no-cache"])
        .args(["--set", "mesh.file=../meshes/dovetail.msh", "--out"])
        .arg(out);
    shell
}

fn summary(out: &Folder) -> Summary {
    serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap()
}

#[test]
fn too_little_memory_is_told_before_factoring() {
    if !cfg!(target_os = "linux") {
        return;
    }
    let out = Folder::new("little-memory");
    // What the process maps beside its matrices is not known to a test: products of matrices have buffers as large as the
    // caches of the processor. The least of these limits in which the bodies are factored is too little for the assembly.
    let of_assembly = (280..2000).step_by(40).find_map(|mib| {
        let output = modes(&out, Some(mib << 10)).output().unwrap();
        let words = in_one_line(&said(&output));
        let (_, why) = words.split_once("the stiffness of the assembly cannot be factored")?;
        let (_, rest) = why.split_once("unknowns, about ")?;
        assert_eq!(output.status.code(), Some(1), "{words}");
        assert!(
            rest.contains("are available: refine the mesh less"),
            "{words}"
        );
        Some(rest.split_once(" GiB").unwrap().0.parse::<f64>().unwrap())
    });
    let needed_mib = 1024.0 * of_assembly.expect("no limit was too small for the assembly alone");
    let failed = summary(&out);
    assert_eq!(failed.state, RunState::Failed);
    assert!(failed.why.unwrap().contains("GiB are available"));
    ended(modes(&out, None), 0);
    let stages = summary(&out).stages;
    let peak_mib = |id: Stage| {
        let stage = stages.iter().find(|s| s.id == id).unwrap();
        stage.peak_memory_mib.unwrap()
    };
    // The matrices of the assembly and its modes come beside the elimination.
    let grown_mib = peak_mib(Stage::Reduction) - peak_mib(Stage::FiniteElements);
    assert!(
        (0.95 * needed_mib..4.0 * needed_mib).contains(&grown_mib),
        "{needed_mib} of {grown_mib}"
    );
}
