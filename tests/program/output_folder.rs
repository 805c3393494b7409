//! Folder of a run: a second run replaces only the files of the first, and summary.json has the
//! progress of a run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use dovetail_export::manifest::{RunState, Summary};

use crate::shared_folder::{Folder, files_below};
use crate::shared_program::{
    ended, has, patch_command, said, said_in_one_line, scene_command, told,
};
use crate::shared_runs::manifest;

/// Names of all files in the folder, without the folders.
fn names(out: &Path) -> BTreeSet<String> {
    let files = files_below(out).into_iter();
    let name = |path: PathBuf| path.strip_prefix(out).unwrap().display().to_string();
    files.map(name).collect()
}

/// Names of the files that summary.json lists, and its own name.
fn listed(out: &Path) -> BTreeSet<String> {
    let files = manifest(out).files.into_iter();
    files.chain(["summary.json".to_owned()]).collect()
}

#[test]
fn a_folder_holds_one_run_and_lists_its_files() {
    let out = Folder::new("one-run");
    let more = [
        "response.points=4",
        "response.harmonics=2",
        "response.compare_harmonics=1",
    ];
    ended(patch_command("run", &out, &more), 0);
    let first = names(&out);
    assert_eq!(first, listed(&out));
    assert_eq!(manifest(&out).state, RunState::Finished);
    let mine = out.join("flank/flank_9999.vtu");
    std::fs::write(&mine, "mine").unwrap();
    // Fewer frequencies, no response to compare with: its files would be taken for those of this
    // run.
    ended(patch_command("run", &out, &[]), 0);
    let second = names(&out);
    assert!(mine.exists());
    let of_first = "flank/flank_0003.vtu";
    assert!(first.contains(of_first) && !second.contains(of_first));
    assert!(first.contains("response_h1.csv") && !second.contains("response_h1.csv"));
    let mut expected = listed(&out);
    expected.insert("flank/flank_9999.vtu".to_owned());
    assert_eq!(second, expected);
    // Other commands add their files, take none away, and leave the figures of the run.
    let of_run = manifest(&out);
    let linear = |out: &Path| {
        let text = std::fs::read_to_string(out.join("modes.csv")).unwrap();
        let lines = text.lines().filter(|line| line.starts_with("linear,"));
        lines.map(str::to_owned).collect::<Vec<_>>()
    };
    let linear_modes = linear(&out);
    assert!(!linear_modes.is_empty());
    ended(patch_command("modes", &out, &[]), 0);
    expected.insert("modes.vtu".to_owned());
    assert_eq!(names(&out), expected);
    assert_eq!(linear(&out), linear_modes);
    let found = manifest(&out);
    assert!(found.blade_frequency_hz.is_some());
    let without_modes = Summary {
        blade_frequency_hz: of_run.blade_frequency_hz,
        files: of_run.files.clone(),
        ..found
    };
    assert!(of_run.response.is_some());
    assert_eq!(without_modes, of_run);
    for word in ["mesh", "modes", "verify"] {
        let refused = told(
            patch_command(word, &out, &["contact.flank.friction=0.1"]),
            2,
        );
        has(&refused, "other settings & --out");
    }
    assert_eq!(manifest(&out).response, of_run.response);
    assert_eq!(names(&out), expected);
    assert_eq!(
        listed(&out),
        names(&out)
            .into_iter()
            .filter(|n| !n.ends_with("9999.vtu"))
            .collect()
    );
}

#[test]
fn a_run_that_fails_says_why_and_leaves_no_response_of_another() {
    let out = Folder::new("failed-run");
    ended(patch_command("run", &out, &[]), 0);
    // Pulled apart: the static state is written, and there is nothing to vibrate about.
    ended(patch_command("run", &out, &["load.0.pressure_pa=-50e6"]), 1);
    let failed = manifest(&out);
    assert_eq!(failed.state, RunState::Failed);
    has(&failed.why.unwrap(), "nothing holds");
    assert!(out.join("static.csv").exists() && !out.join("response.csv").exists());
    // Before there is a static state the files of the earlier run stay, and stay listed.
    let before = names(&out);
    ended(
        patch_command("run", &out, &["contact.flank.first=nowhere"]),
        2,
    );
    let failed = manifest(&out);
    assert_eq!((failed.state, names(&out)), (RunState::Failed, before));
    assert!(failed.why.unwrap().contains("nowhere"));
    assert_eq!(listed(&out), names(&out));
}

#[test]
fn the_folder_of_another_scene_is_not_taken_unasked() {
    let out = Folder::new("other-scene");
    ended(patch_command("run", &out, &[]), 0);
    let before = names(&out);
    let refused = told(patch_command("static", &out, &["name=other"]), 2);
    has(&refused, "--force");
    assert_eq!(
        (names(&out), manifest(&out).scene.name),
        (before, "patch".to_owned())
    );
    let mut forced = patch_command("static", &out, &["name=other"]);
    ended(forced.arg("--force"), 0);
    assert_eq!(manifest(&out).scene.name, "other");
    assert!(!out.join("response.csv").exists());
    assert_eq!(listed(&out), names(&out));
}

#[test]
fn a_folder_that_cannot_be_written_is_told_before_anything_is_computed() {
    let folder = Folder::new("unwritable");
    let out = folder.write("file", "").join("out");
    let set = ["mesh.file=nowhere.msh"];
    let said = said(&ended(patch_command("run", &out, &set), 1));
    assert!(
        said.contains("--out") && !said.contains("nowhere"),
        "{said}"
    );
}

/// Processes that begin at the same time in one folder: one after the other writes, and who waits too
/// long says so and writes nothing.
#[test]
fn of_processes_that_begin_at_once_each_finishes_or_says_that_the_folder_is_in_use() {
    let out = Folder::new("at-once");
    for round in 0..6 {
        let begin = |_| {
            let mut command =
                scene_command("static", "scenes/verification/den_hartog.toml", &out, &[]);
            command.stdout(Stdio::null()).stderr(Stdio::piped());
            command.spawn().unwrap()
        };
        let children: Vec<Child> = (0..2 + round % 2).map(begin).collect();
        let mut finished = 0;
        for child in children {
            let output = child.wait_with_output().unwrap();
            match output.status.code() {
                Some(0) => finished += 1,
                Some(1) => has(
                    &said_in_one_line(&output),
                    "a run is going on in the folder",
                ),
                code => panic!("{code:?}: {}", said_in_one_line(&output)),
            }
        }
        assert!(finished > 0);
        assert_eq!(manifest(&out).state, RunState::Finished, "round {round}");
        assert_eq!(names(&out), listed(&out), "round {round}");
    }
}
