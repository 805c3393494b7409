//! Tells the program which commit it is built from, in the variable `DOVETAIL_COMMIT` of the
//! compiler: ` (hash)`, with `-dirty` after the hash where what the program is made from is changed;
//! empty where the sources are no clone of the repository, as those of a package.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Files and folders that the program is made from.
const SOURCES: [&str; 7] = [
    "Cargo.lock",
    "Cargo.toml",
    "build.rs",
    "crates",
    "geometry",
    "src",
    "templates",
];

fn main() {
    let root = std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(PathBuf::new, PathBuf::from);
    let commit = commit(&root).map(|commit| format!(" ({commit})"));
    println!(
        "cargo::rustc-env=DOVETAIL_COMMIT={}",
        commit.unwrap_or_default()
    );
    for path in watched(&root) {
        println!("cargo::rerun-if-changed={}", path.display());
    }
}

/// The commit whose clone has its top at `root`.
pub fn commit(root: &Path) -> Option<String> {
    let top = PathBuf::from(git(root, &["rev-parse", "--show-toplevel"])?);
    // A package may be unpacked inside the clone of something else.
    if top.canonicalize().ok()? != root.canonicalize().ok()? {
        return None;
    }
    let hash = git(root, &["rev-parse", "--short", "HEAD"])?;
    let status = [
        &["--no-optional-locks", "status", "--porcelain", "--"],
        &SOURCES[..],
    ]
    .concat();
    match git(root, &status)?.as_str() {
        "" => Some(hash),
        _ => Some(format!("{hash}-dirty")),
    }
}

/// The files after whose change the commit is another, and the sources, whose change makes it dirty.
pub fn watched(root: &Path) -> Vec<PathBuf> {
    let sources = SOURCES.iter().map(|source| root.join(source));
    let branch = git(root, &["symbolic-ref", "--quiet", "HEAD"]);
    // A clone or a worktree of it: git knows where each file is. The log tells of a new commit on
    // a branch whose own file is packed.
    let of_git = ["HEAD", "logs/HEAD", "packed-refs"];
    let of_git = of_git.into_iter().chain(branch.as_deref());
    let of_git = of_git.filter_map(|name| git(root, &["rev-parse", "--git-path", name]));
    let of_git = of_git.map(|path| root.join(path));
    // cargo takes a file that is missing for one that changes each time.
    sources.chain(of_git).filter(|path| path.exists()).collect()
}

/// Answer of git, without the last line break; `None` where it fails or is not there.
fn git(root: &Path, words: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .arg("-C")
        .arg(root)
        .args(words)
        .output()
        .ok()?;
    let said = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| said.trim_end().to_owned())
}
