//! Keeps in order what the compiler does not: imports inside the program's package point one way, and
//! the paths that ARCHITECTURE.md names exist.

use std::path::{Path, PathBuf};

/// Each stage may import itself and what stands before it.
const STAGES: [&str; 10] = [
    "model",
    "fem",
    "reduction",
    "contact",
    "dlft",
    "integration",
    "results",
    "description",
    "scene",
    "export",
];
/// Modules that every other may import, and that import nothing of the crate.
const BASE: [&str; 2] = ["input", "text"];
/// Modules that import nothing else of the crate but themselves.
const ISLANDS: [&str; 1] = ["mesh"];
/// Modules of the outermost layer, which may see everything.
const OUTER: [&str; 8] = [
    "pipeline", "study", "cli", "error", "progress", "terminal", "main", "lib",
];
fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn rust_files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

/// (path relative to the root, text without comments).
fn sources() -> Vec<(String, String)> {
    let mut files = Vec::new();
    rust_files(&root().join("src"), &mut files);
    files.sort();
    files
        .iter()
        .map(|file| {
            let text = std::fs::read_to_string(file).unwrap();
            let code: Vec<&str> = text
                .lines()
                .map(|line| line.split("//").next().unwrap())
                .collect();
            let name = file
                .strip_prefix(root())
                .unwrap()
                .to_string_lossy()
                .replace('\\', "/");
            (name, code.join("\n"))
        })
        .collect()
}

/// The first path segment of every `crate::...` in the code.
fn imports(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        if let Some(list) = rest.strip_prefix('{') {
            let list = list.split('}').next().unwrap();
            found.extend(list.split(',').map(|item| first_word(item.trim())));
        } else {
            found.push(first_word(rest));
        }
    }
    found
}

fn first_word(text: &str) -> String {
    text.chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

#[test]
fn imports_point_one_way() {
    let mut wrong = Vec::new();
    for (file, code) in sources() {
        let module = first_word(file.strip_prefix("src/").unwrap());
        if OUTER.contains(&module.as_str()) {
            continue;
        }
        for import in imports(&code) {
            let allowed = import == module
                || if BASE.contains(&module.as_str()) {
                    false
                } else if BASE.contains(&import.as_str()) {
                    true
                } else if ISLANDS.contains(&module.as_str()) {
                    false
                } else {
                    let place = |name: &str| STAGES.iter().position(|s| *s == name);
                    let own = place(&module)
                        .unwrap_or_else(|| panic!("{file}: give {module} a place in STAGES"));
                    ISLANDS.contains(&import.as_str()) || place(&import).is_some_and(|p| p < own)
                };
            if !allowed {
                wrong.push(format!("{file} imports {import}"));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "imports against the flow:\n{}",
        wrong.join("\n")
    );
}

#[test]
fn every_path_in_the_architecture_exists() {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let mut checked = 0;
    for quoted in text.split('`').skip(1).step_by(2) {
        let is_path = quoted.contains('/') && !quoted.contains([' ', '<', '*', ':']);
        if is_path && !quoted.starts_with("output/") {
            checked += 1;
            assert!(
                root().join(quoted).exists(),
                "ARCHITECTURE.md names `{quoted}`"
            );
        }
    }
    assert!(checked > 20, "only {checked} paths found");
}
