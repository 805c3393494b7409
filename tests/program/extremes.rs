//! Ends of the input that cannot be computed: the message says why not and what to do. Those that
//! can be: crates/solver/tests/library/extremes.rs.

use std::process::Command;

use crate::shared_folder::Folder;

/// Exit code and message of the program for the reference model with these keys set.
fn said(sets: &[&str]) -> (Option<i32>, String) {
    let root = env!("CARGO_MANIFEST_DIR");
    let folder = Folder::new("extremes");
    let scene = folder.join("extreme.toml");
    let text = format!(
        "name = \"extreme\"\n[reduced_model]\nfolder = \"{root}/tests/data/dovetail72\"\nfriction = 0.3\nforce_n = 1.0\n\
         [damping]\nratio = 0.001\n[response]\ntimes_first_linear_mode = [1.0, 1.0]\npoints = 1\nharmonics = 1\n"
    );
    std::fs::write(&scene, text).unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_dovetail"));
    program
        .arg("run")
        .arg(&scene)
        .arg("--out")
        .arg(folder.join("out"));
    for set in sets {
        program.args(["--set", set]);
    }
    let output = program.output().unwrap();
    let words: Vec<String> = String::from_utf8_lossy(&output.stderr)
        .replace('|', " ")
        .split_whitespace()
        .map(str::to_owned)
        .collect();
    (output.status.code(), words.join(" "))
}

#[test]
fn what_cannot_be_computed_says_why_and_what_to_do() {
    let cases: [(&[&str], i32, &[&str]); 2] = [
        (
            &["damping.ratio=0"],
            2,
            &["stuck mode 1", "no damping", "damping.ratio = 0.001"],
        ),
        (
            &["response.harmonics=0"],
            2,
            &["response.harmonics", "dovetail static"],
        ),
    ];
    for (sets, code, words) in cases {
        let (found, message) = said(sets);
        assert_eq!(found, Some(code), "{sets:?}: {message}");
        for word in words {
            assert!(message.contains(word), "{sets:?}: {message}");
        }
    }
}
