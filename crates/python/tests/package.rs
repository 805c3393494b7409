//! Runs the tests of the Python package, which are those of pytest in this folder, on the module
//! that was compiled beside this test.
//!
//! Python needs numpy, SciPy, matplotlib, nbclient, ipykernel and pytest: the environment of
//! `tools/setup.sh python`, or another one named by `DOVETAIL_PYTHON`. Some of the tests run the
//! program and examples of the library, which `cargo test --workspace` compiles before.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use dovetail_testkit::folder::root;

/// Package of the Python files and the module `library`, in `folder`.
fn package(folder: &Path, library: &Path) {
    let package = folder.join("dovetail");
    std::fs::create_dir_all(&package).unwrap();
    let sources = root().join("crates/python/python/dovetail");
    for entry in std::fs::read_dir(sources).unwrap() {
        let file = entry.unwrap().path();
        let name = file.file_name().unwrap().to_os_string();
        let is_source = ["py", "pyi", "typed"]
            .map(Some)
            .contains(&file.extension().and_then(|e| e.to_str()));
        if is_source {
            std::fs::copy(&file, package.join(name)).unwrap();
        }
    }
    std::fs::copy(library, package.join("_dovetail.abi3.so")).unwrap();
}

/// Folder of the build, target/debug, and the folder in which Python finds the package.
fn build_and_package() -> &'static (PathBuf, PathBuf) {
    static FOLDERS: OnceLock<(PathBuf, PathBuf)> = OnceLock::new();
    FOLDERS.get_or_init(|| {
        // target/debug/deps, and target/debug with the program and the examples.
        let own = std::env::current_exe().unwrap();
        let deps = own.parent().unwrap();
        let build = deps.parent().unwrap();
        let library = deps.join("lib_dovetail.so");
        assert!(library.exists(), "{} is not there", library.display());
        for needed in [
            "dovetail",
            "examples/own_newton",
            "examples/reduced_from_matrices",
        ] {
            let path = build.join(needed);
            assert!(
                path.exists(),
                "{} is not there: run `cargo test --workspace`",
                path.display()
            );
        }
        let folder = build.parent().unwrap().join("python");
        package(&folder, &library);
        (build.to_path_buf(), folder)
    })
}

/// Runs the tests of the folder that these arguments of pytest choose.
fn passes(arguments: &[&str]) {
    let (build, folder) = build_and_package();
    let python = std::env::var_os("DOVETAIL_PYTHON")
        .map_or_else(|| root().join("target/venv/bin/python"), PathBuf::from);
    let run = Command::new(&python)
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
        .args(arguments)
        .current_dir(root().join("crates/python/tests"))
        .env("PYTHONPATH", folder)
        .env("DOVETAIL_BUILD", build)
        .output();
    let run = run.unwrap_or_else(|error| {
        panic!(
            "{} cannot be started ({error}): run `tools/setup.sh python`, or name a Python with numpy, SciPy, \
             matplotlib, nbclient, ipykernel and pytest by DOVETAIL_PYTHON",
            python.display()
        )
    });
    let said = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    assert!(
        run.status.success(),
        "{said}{errors}\nwhere a module is missing: `tools/setup.sh python`"
    );
    println!("{}", said.lines().last().unwrap_or_default());
}

const EXAMPLES: &str = "test_examples.py";
const OF_THE_PAPER: &str = "twenty_lines";
const OF_THE_FIT: &str = "fit";

#[test]
fn the_notebook_of_the_paper_passes() {
    passes(&[EXAMPLES, "-k", OF_THE_PAPER]);
}

#[test]
fn the_notebook_of_the_fit_passes() {
    passes(&[EXAMPLES, "-k", OF_THE_FIT]);
}

#[test]
fn the_tests_of_the_other_notebooks_and_examples_pass() {
    let others = format!("not {OF_THE_PAPER} and not {OF_THE_FIT}");
    passes(&[EXAMPLES, "-k", &others]);
}

/// All the others, beside those of the examples.
#[test]
fn the_tests_of_the_python_package_pass() {
    passes(&["--ignore", EXAMPLES]);
}
