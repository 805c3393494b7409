//! Checks of the source that the compiler does not make: imports between the modules of a package
//! are in one direction, the paths and links of ARCHITECTURE.md, the README and the book exist, the
//! identifiers of the glossary exist, and lines of prose fit a screen.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::shared_folder::files_below;
use dovetail_testkit::folder::root;

/// Modules of the libraries. Each may import itself and the modules before it.
const LIBRARIES: [(&str, &str); 5] = [
    (
        "crates/dynamics/src",
        "contact damping reduced excitation superelement problem dlft integration \
         forced_response stability prelude",
    ),
    ("crates/structure/src", "structure reduction model fem"),
    ("crates/solver/src", "results description run prelude"),
    (
        "crates/export/src",
        "words warning error file lock journal table colours curves fields unrolled manifest vtu flank \
         csv folder plots report",
    ),
    (
        "crates/cache/src",
        "fingerprint inputs settings folder turn entry kept",
    ),
];
/// Modules of the program, and the modules that each may import.
const PROGRAM: &str = "
    exit:
    metrics:
    version:
    terminal:
    exhaustion: exit terminal
    motions:
    scene:
    gmsh:
    mesh_files:
    influence_file:
    matrix_files:
    listener:
    scene_files: mesh_files
    console: listener
    error: exit exhaustion motions scene gmsh influence_file matrix_files
    study_file: exit scene error
    mesh_study: scene_files study_file
    files: exit metrics version scene_files mesh_study error
    reporter: metrics exhaustion motions error files listener
    store: files reporter
    commands: scene gmsh mesh_files influence_file matrix_files scene_files error files reporter store
    study: exit metrics version scene scene_files error reporter commands study_file
    reference: scene study_file
    schema: scene study_file
    cli: exit version terminal exhaustion scene mesh_files error files console reporter commands \
        study study_file schema
    lib:
    allocator: exhaustion
    main:
    ";

/// Files of Rust below a folder, in the order of their names.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = files_below(folder);
    files.retain(|file| file.extension().is_some_and(|e| e == "rs"));
    files.sort();
    files
}

/// Text of a file without comments.
fn code_of(file: &Path) -> String {
    let text = std::fs::read_to_string(file).unwrap();
    let lines = text.lines().map(|line| line.split("//").next().unwrap());
    lines.collect::<Vec<_>>().join("\n")
}

/// Path relative to `folder` and text without comments of each file below it.
fn sources(folder: &Path) -> Vec<(String, String)> {
    rust_files(folder)
        .iter()
        .map(|file| {
            let name = file.strip_prefix(folder).unwrap().to_string_lossy();
            (name.replace('\\', "/"), code_of(file))
        })
        .collect()
}

fn first_word(text: &str) -> String {
    text.chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

/// Imports that `may(module, import)` does not allow.
fn wrong_imports(folder: &str, may: impl Fn(&str, &str) -> bool) -> Vec<String> {
    let mut wrong = Vec::new();
    for (file, code) in sources(&root().join(folder)) {
        let module = first_word(&file);
        for import in names_after(&code, "crate::") {
            if import != module && !may(&module, &import) {
                wrong.push(format!("{folder}/{file} imports {import}"));
            }
        }
    }
    wrong
}

#[test]
fn imports_point_one_way() {
    let mut wrong = Vec::new();
    for (folder, modules) in LIBRARIES {
        let place = |module: &str| modules.split(' ').position(|m| m == module);
        wrong.extend(wrong_imports(folder, |module, import| {
            let own = place(module);
            assert!(
                own.is_some(),
                "give {module} of {folder} a place in LIBRARIES"
            );
            // A module that the façade hands on from a package below it has no place.
            place(import) < own
        }));
    }
    wrong.extend(wrong_imports("src", |module, import| {
        let mut rows = PROGRAM.lines().filter_map(|row| row.trim().split_once(':'));
        let seen = rows.find(|(name, _)| *name == module);
        let (_, seen) = seen.unwrap_or_else(|| panic!("give {module} a place in PROGRAM"));
        seen.split_whitespace().any(|word| word == import)
    }));
    assert!(
        wrong.is_empty(),
        "imports against the flow:\n{}",
        wrong.join("\n")
    );
}

/// The packages of the libraries, each with the packages of this workspace that it needs.
const NEEDED: [(&str, &str); 8] = [
    ("numerics", ""),
    ("dynamics", "numerics"),
    ("mesh", "numerics"),
    ("structure", "dynamics mesh numerics"),
    ("superelement", "dynamics matrices numerics"),
    ("solver", "dynamics mesh numerics structure superelement"),
    ("export", "mesh solver superelement"),
    ("cache", "export solver superelement"),
];

/// The libraries that compute need no package for files, processes and their formats, which the
/// package of results writes. The package of meshes has the readers behind a feature that they do not
/// use.
#[test]
fn packages_need_only_those_below_them() {
    for (package, expected) in NEEDED {
        let text = text_of(&format!("crates/{package}/Cargo.toml"));
        let manifest: toml::Table = text.parse().unwrap();
        let needed = manifest["dependencies"].as_table().unwrap();
        let ours: Vec<&str> = needed
            .keys()
            .filter_map(|name| name.strip_prefix("dovetail-"))
            .collect();
        assert_eq!(ours.join(" "), expected, "{package}");
        if let Some(mesh) = needed.get("dovetail-mesh") {
            assert!(mesh.get("features").is_none(), "{package}");
        }
        if package == "export" {
            continue;
        }
        let mut readers = vec!["base64", "csv", "flate2", "mshio", "quick-xml", "rustix"];
        if package != "superelement" {
            readers.push("serde_json");
        }
        for reader in readers {
            let is_optional = |entry: &toml::Value| entry.get("optional").is_some();
            assert!(
                needed.get(reader).is_none_or(is_optional),
                "{package} needs {reader}"
            );
        }
    }
}

/// A package with other features is compiled once more for the wheel, and so is everything that
/// needs it. Cargo.toml at the root switches on the features that only the Python package needs.
#[test]
fn the_wheel_has_the_features_of_the_program() {
    let features = |package: &str| {
        let words = "tree --locked --offline --edges normal,build --prefix none --format";
        let tree = Command::new(env!("CARGO"))
            .args(words.split(' '))
            .args(["{p} {f}", "--package", package])
            .current_dir(root())
            .output()
            .unwrap();
        assert!(tree.status.success(), "{tree:?}");
        let tree = String::from_utf8(tree.stdout).unwrap();
        let lines = tree.lines().map(|line| line.replace(" (*)", ""));
        lines.collect::<BTreeSet<String>>()
    };
    let (program, wheel) = (features("dovetail"), features("dovetail-python"));
    let others: Vec<&String> = program.difference(&wheel).collect();
    assert!(
        others.is_empty(),
        "other features in the wheel: {others:#?}"
    );
}

/// Names after every `prefix` in the code, including those of a list in braces.
fn names_after(code: &str, prefix: &str) -> Vec<String> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let mut found = Vec::new();
    for (at, _) in code.match_indices(prefix) {
        if code[..at].chars().next_back().is_some_and(is_part) {
            continue;
        }
        let rest = &code[at + prefix.len()..];
        let list = rest.strip_prefix('{').and_then(|r| r.split('}').next());
        match list {
            Some(list) => found.extend(list.split(',').map(|item| first_word(item.trim()))),
            None => found.push(first_word(rest)),
        }
    }
    found
}

/// Modules of one folder, each with the modules beside it that its code names, without tests.
fn neighbours(root: &Path, folder: &Path) -> Vec<(String, Vec<String>)> {
    let path = folder.strip_prefix(root).unwrap();
    let inside = path.iter().map(|part| part.to_string_lossy() + "::");
    let absolute = format!("crate::{}", inside.collect::<String>());
    let entries = std::fs::read_dir(folder).unwrap().flatten();
    let mut modules = Vec::new();
    for entry in entries {
        let path = entry.path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let files = if path.is_dir() {
            rust_files(&path)
        } else if ["mod", "lib", "main", "tests"].contains(&name.as_str()) {
            continue;
        } else {
            vec![path.clone()]
        };
        let mut named = Vec::new();
        for file in files.iter().filter(|file| !file.ends_with("tests.rs")) {
            let code = code_of(file);
            let code = code.split("#[cfg(test)]").next().unwrap();
            let depth = file.strip_prefix(folder).unwrap().iter().count();
            let up = if file.ends_with("mod.rs") {
                depth - 1
            } else {
                depth
            };
            named.extend(names_after(code, &"super::".repeat(up)));
            named.extend(names_after(code, &absolute));
        }
        modules.push((name, named));
    }
    modules
}

/// Returns `true` if a path along the names leads from `from` to `to`.
fn leads(modules: &[(String, Vec<String>)], from: &str, to: &str, seen: &mut Vec<String>) -> bool {
    let Some((_, named)) = modules.iter().find(|(name, _)| name == from) else {
        return false;
    };
    named.iter().any(|next| {
        if next == to {
            return true;
        }
        let is_new = !seen.contains(next);
        seen.push(next.clone());
        is_new && leads(modules, next, to, seen)
    })
}

#[test]
fn modules_of_a_folder_import_in_no_circle() {
    let (mut wrong, mut edges) = (Vec::new(), 0);
    let packages = [
        "crates/numerics/src",
        "crates/mesh/src",
        "crates/matrices/src",
        "crates/dynamics/src",
        "crates/structure/src",
        "crates/superelement/src",
        "crates/solver/src",
        "crates/export/src",
        "crates/cache/src",
        "crates/python/src",
        "src",
    ];
    for package in packages {
        let package = root().join(package);
        let mut folders = vec![package.clone()];
        while let Some(folder) = folders.pop() {
            let modules = neighbours(&package, &folder);
            for (name, named) in &modules {
                edges += named.len();
                let others = named.iter().filter(|other| *other != name);
                for other in others {
                    if leads(&modules, other, name, &mut Vec::new()) {
                        wrong.push(format!("{}: {name} and {other}", folder.display()));
                    }
                }
            }
            let inner = std::fs::read_dir(&folder).unwrap().flatten();
            folders.extend(inner.map(|e| e.path()).filter(|p| p.is_dir()));
        }
    }
    wrong.sort();
    wrong.dedup();
    assert!(
        wrong.is_empty(),
        "circles of imports:\n{}",
        wrong.join("\n")
    );
    assert!(edges > 300, "only {edges} imports were seen");
}

/// Methods of faer's matrices that take the number of threads from a setting of the process, and
/// its names for all threads. The libraries use `dovetail_numerics::dense` instead.
#[test]
fn libraries_do_not_ask_the_process_for_threads() {
    let asking = [
        ".partial_piv_lu()",
        ".full_piv_lu()",
        ".llt(",
        ".lblt(",
        ".qr()",
        ".svd()",
        ".self_adjoint_eigen(",
        ".self_adjoint_eigenvalues(",
        "get_global_parallelism",
        "Par::rayon",
        "Par::Rayon",
    ];
    let mut wrong = Vec::new();
    for folder in [
        "crates/numerics/src",
        "crates/mesh/src",
        "crates/matrices/src",
        "crates/dynamics/src",
        "crates/structure/src",
        "crates/superelement/src",
        "crates/solver/src",
        "crates/export/src",
        "crates/cache/src",
    ] {
        let library = sources(&root().join(folder)).into_iter();
        for (file, code) in library.filter(|(file, _)| !file.ends_with("tests.rs")) {
            let code = code.split("#[cfg(test)]\nmod tests").next().unwrap();
            let found = asking.iter().filter(|method| code.contains(**method));
            wrong.extend(found.map(|method| format!("{folder}/{file}: {method}")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_path_in_the_architecture_exists() {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let mut checked = 0;
    for quoted in text.split('`').skip(1).step_by(2) {
        let is_path = quoted.contains('/') && !quoted.contains([' ', '<', '*', ':']);
        if is_path && !quoted.starts_with("output/") {
            checked += 1;
            let libraries = LIBRARIES.map(|(folder, _)| root().join(folder));
            assert!(
                root().join(quoted).exists() || libraries.iter().any(|at| at.join(quoted).exists()),
                "ARCHITECTURE.md names `{quoted}`"
            );
        }
    }
    assert!(checked > 20, "only {checked} paths found");
}

/// The identifiers in the second column of the glossary are in the code of the file in the fourth.
#[test]
fn every_identifier_of_the_glossary_stands_in_its_file() {
    let text = std::fs::read_to_string(root().join("docs/glossary.md")).unwrap();
    let code: Vec<(String, String)> = ["crates", "src"]
        .iter()
        .flat_map(|folder| {
            let files = sources(&root().join(folder)).into_iter();
            files.map(move |(file, code)| (format!("{folder}/{file}"), code))
        })
        .collect();
    let quoted = |cell: &str| -> Vec<String> {
        let parts = cell.split('`').skip(1).step_by(2);
        parts.map(str::to_owned).collect()
    };
    let rows = text.lines().filter(|line| line.contains('`'));
    let (mut checked, mut wrong) = (0, vec![]);
    for row in rows {
        let cells: Vec<&str> = row.split('|').collect();
        let [_, word, identifiers, _, file, _] = cells[..] else {
            panic!("not four columns: {row}");
        };
        let [file] = &quoted(file)[..] else {
            panic!("not one file: {row}");
        };
        let found = code.iter().find(|(name, _)| name == file);
        let words: Vec<&str> = found.map_or(vec![], |(_, code)| {
            code.split(|c: char| !c.is_alphanumeric() && c != '_')
                .collect()
        });
        for identifier in quoted(identifiers) {
            checked += 1;
            if !words.contains(&identifier.as_str()) {
                wrong.push(format!("{}: `{identifier}` in {file}", word.trim()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 60, "only {checked} identifiers found");
}

/// Pages of the book, relative to the root.
fn pages() -> Vec<String> {
    let mut files = files_below(&root().join("docs"));
    files.retain(|file| file.extension().is_some_and(|e| e == "md"));
    let page = |file: PathBuf| {
        let page = file.strip_prefix(root()).unwrap();
        page.to_string_lossy().replace('\\', "/")
    };
    let mut found: Vec<String> = files.into_iter().map(page).collect();
    found.sort();
    found
}

/// Pages of the book, and the pages at the root for readers.
fn prose() -> Vec<String> {
    let own = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md"].map(str::to_owned);
    own.into_iter().chain(pages()).collect()
}

fn text_of(page: &str) -> String {
    std::fs::read_to_string(root().join(page)).unwrap()
}

/// Lines that are not code, by fences or by an indent of four after an empty line.
fn prose_lines(text: &str) -> String {
    let (mut fenced, mut code, mut empty) = (false, false, true);
    let mut out = String::new();
    for line in text.lines() {
        fenced ^= line.trim_start().starts_with("```");
        let indented = line.starts_with("    ");
        code = indented && (code || empty) && !line.trim_start().starts_with(['-', '|']);
        empty = line.trim().is_empty() || (empty && indented && code);
        if !fenced && !code {
            out.push_str(line);
            out.push('\n');
        }
    }
    out
}

/// Targets of `[text](target)`, without code spans.
fn links(text: &str) -> Vec<String> {
    let plain: String = prose_lines(text).split('`').step_by(2).collect();
    let after = plain.split("](").skip(1);
    after
        .filter_map(|rest| Some(rest.split_once(')')?.0.to_owned()))
        .collect()
}

/// Names of the headings in links: small letters, digits, `-` and `_`, blanks as `-`.
fn anchors(text: &str) -> Vec<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    let letters = headings.map(|line| {
        let kept = line.trim_start_matches('#').trim().chars();
        let kept = kept.filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        kept.collect::<String>().to_lowercase().replace(' ', "-")
    });
    letters.collect()
}

#[test]
fn every_link_of_the_prose_leads_somewhere() {
    let (mut checked, mut wrong) = (0, Vec::new());
    for page in prose().into_iter().chain(["CHANGELOG.md".to_owned()]) {
        let text = text_of(&page);
        for link in links(&text).iter().filter(|l| !l.starts_with("http")) {
            checked += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let folder = root().join(&page).parent().unwrap().to_owned();
            let target = match file {
                "" => root().join(&page),
                file => folder.join(file),
            };
            let Ok(target) = target.canonicalize() else {
                wrong.push(format!("{page}: no file {link}"));
                continue;
            };
            // The book holds what is below docs.
            let docs = root().join("docs").canonicalize().unwrap();
            if page.starts_with("docs/") && !target.starts_with(&docs) {
                wrong.push(format!(
                    "{page}: {link} leaves the book, name the file by its path"
                ));
            }
            if !anchor.is_empty() {
                let there = std::fs::read_to_string(&target).unwrap();
                if !anchors(&there).iter().any(|a| a == anchor) {
                    wrong.push(format!("{page}: no heading {link}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 60, "only {checked} links found");
}

#[test]
fn every_page_is_in_the_summary_of_the_book() {
    let summary = links(&text_of("docs/SUMMARY.md"));
    let mut listed: Vec<String> = summary.iter().map(|l| format!("docs/{l}")).collect();
    listed.push("docs/SUMMARY.md".to_owned());
    listed.sort();
    assert_eq!(listed, pages());
}

#[test]
fn paths_that_the_book_names_exist() {
    let folders = [
        "benches/",
        "crates/",
        "docs/",
        "fuzz/",
        "geometry/",
        "meshes/",
        "scenes/",
        "scripts/",
        "src/",
        "studies/",
        "templates/",
        "tests/",
        "tools/",
        "workflow/",
    ];
    let (mut checked, mut wrong) = (0, Vec::new());
    for page in prose() {
        let text = prose_lines(&text_of(&page));
        for quoted in text.split('`').skip(1).step_by(2) {
            // Files that a guide lets the reader write, and commands, are none of these.
            let is_path = folders.iter().any(|f| quoted.starts_with(f))
                && !quoted.contains([' ', '\n', '<', '*', '{'])
                && quoted != "studies/mesh.toml";
            if is_path {
                checked += 1;
                if !root().join(quoted).exists() {
                    wrong.push(format!("{page} names `{quoted}`"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 80, "only {checked} paths found");
}

/// Test binaries that commands of the prose name, and the folders of their modules.
const TESTS: [(&str, &str); 2] = [
    ("program", "tests/program"),
    ("library", "crates/solver/tests/library"),
];

#[test]
fn commands_of_the_prose_name_tests_that_exist() {
    let (mut checked, mut wrong) = (0, Vec::new());
    for page in prose() {
        let text = text_of(&page).replace('`', " ");
        let words: Vec<&str> = text.split_whitespace().collect();
        for words in words.windows(3).filter(|words| words[0] == "--test") {
            let [_, binary, filter] = words else { continue };
            let tests = TESTS.iter().find(|(name, _)| name == binary);
            let (module, name) = filter.split_once("::").unwrap_or((filter, ""));
            let exists = tests.is_some_and(|(_, folder)| {
                let (_, code): (Vec<String>, Vec<String>) = sources(&root().join(folder))
                    .into_iter()
                    .filter(|(file, _)| first_word(file) == module)
                    .unzip();
                let begins = |code: &String| {
                    let definitions = [format!("fn {name}"), format!("mod {name}")];
                    definitions.iter().any(|begin| code.contains(begin))
                };
                code.iter().any(begins)
            });
            checked += 1;
            if !exists {
                wrong.push(format!("{page}: --test {binary} {filter}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 20, "only {checked} commands found");
}

#[test]
fn comments_name_files_of_tests_that_exist() {
    let (mut checked, mut wrong) = (0, Vec::new());
    let folders = ["benches", "crates", "src", "tests"].into_iter();
    for file in folders.flat_map(|folder| rust_files(&root().join(folder))) {
        let text = std::fs::read_to_string(&file).unwrap();
        for (at, _) in TESTS.iter().flat_map(|(_, f)| text.match_indices(f)) {
            let is_part = |c: &char| c.is_alphanumeric() || matches!(c, '_' | '/' | '.');
            let path: String = text[at..].chars().take_while(is_part).collect();
            checked += 1;
            if !root().join(path.trim_end_matches('.')).exists() {
                wrong.push(format!("{} names {path}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 5, "only {checked} files found");
}

/// Rows of tables and lines that are one link may be longer.
#[test]
fn lines_of_prose_have_at_most_100_letters() {
    let mut wrong = Vec::new();
    for page in prose() {
        for (number, line) in text_of(&page).lines().enumerate() {
            let start = line.trim_start();
            let one_link = start.trim_start_matches(['-', ' ', '!']).starts_with('[');
            let exempt = start.starts_with('|') || (one_link && line.ends_with(')'));
            if line.chars().count() > 100 && !exempt {
                wrong.push(format!("{page}:{}", number + 1));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The load of a machine is not a unit: a figure states on how many cores it was measured. Past
/// behaviour of the program is in CHANGELOG.md.
#[test]
fn prose_has_no_load_of_a_machine_and_no_history() {
    let never = [
        "busy machine",
        "loaded machine",
        "no longer",
        "any more",
        "used to be",
        "formerly",
    ];
    let mut wrong = Vec::new();
    for page in prose() {
        let text = text_of(&page);
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let is_load = |rest: &str| rest.starts_with(|c: char| c.is_ascii_digit());
        let loads = text.match_indices("load ");
        let loads = loads.filter(|(at, word)| is_load(&text[at + word.len()..]));
        let words = never.iter().flat_map(|word| text.match_indices(word));
        for (at, _) in loads.chain(words) {
            let rest: String = text[at..].chars().take(40).collect();
            wrong.push(format!("{page}: {rest}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The rules of the changelog are in CONTRIBUTING.md.
#[test]
fn the_changelog_of_the_next_release_is_short_and_marks_results_at_the_end() {
    let text = text_of("CHANGELOG.md");
    let (_, unreleased) = text.split_once("## [Unreleased]").unwrap();
    let (unreleased, _) = unreleased.split_once("\n## [").unwrap();
    let lines: Vec<&str> = unreleased.lines().filter(|l| !l.is_empty()).collect();
    assert!(lines.len() <= 40, "{} lines", lines.len());
    let headings = ["### Added", "### Changed", "### Fixed", "### Removed"];
    for line in lines {
        assert!(!line.starts_with('#') || headings.contains(&line), "{line}");
        let marked = line.contains("[results]");
        assert!(!marked || line.ends_with(" **[results]**"), "{line}");
    }
}
