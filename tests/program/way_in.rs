//! First steps: new scenes run, schemas accept the files of this repository, shells complete, man
//! pages are written, and the version has the commit.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::shared_folder::Folder;
use crate::shared_program::{self, cases, ended, has, needs_gmsh, program, scene_command, told};
use crate::shared_runs::{numbers, summary};
use crate::tutorial::same_line;
use dovetail_testkit::folder::root;

/// Build script, which passes the commit to the program; cargo calls its `main`.
#[allow(dead_code)]
#[path = "../../build.rs"]
mod build;

/// Output to stdout of a command that has to end well.
fn printed(command: Command) -> String {
    shared_program::printed(&ended(command, 0))
}

// ------------------------------------------------------------------------------------ dovetail new

/// Makes the scene of a template, runs it by the printed command, and checks its result: every
/// frequency converges without a warning, friction slips at some pairs and sticks at others, and
/// lowers the peak.
fn template_runs(template: &str, pairs: u64) {
    needs_gmsh();
    let folder = Folder::new("way-in");
    let name = format!("my_{}", template.replace('-', "_"));
    let new = ["new", &name, "--template", template];
    let printed = printed(program(&folder, &new));
    let next = printed.lines().find_map(|line| line.strip_prefix("next: "));
    let words: Vec<&str> = next.unwrap().split(' ').skip(1).collect();
    let wrote = printed
        .lines()
        .filter_map(|line| line.strip_prefix("wrote "));
    for file in wrote {
        assert!(folder.join(file).is_file(), "{file}");
    }
    let mut run = program(&folder, &words);
    let told = told(run.args(["--no-cache", "--no-fields"]), 0);
    assert!(!told.contains("warning"), "{template}: {told}");
    let out = folder.join("output").join(&name);
    let summary = summary(&out);
    let figure = |place: &str| {
        let found = summary.pointer(place).and_then(Value::as_f64);
        found.unwrap_or_else(|| panic!("{template}: no {place}"))
    };
    assert_eq!(summary["scene"]["name"], name.as_str());
    assert_eq!(summary["pairs"], pairs);
    assert_eq!(
        figure("/response/converged_points"),
        figure("/response/points")
    );
    let ratio = figure("/response/peak_ratio");
    assert!((0.3..0.99).contains(&ratio), "{template}: ratio {ratio}");
    let [slipping, stuck] = ["slipping_pairs", "stuck_pairs"].map(|column| {
        let counts = numbers(&out.join("response.csv"), column);
        counts.into_iter().fold(0.0, f64::max)
    });
    assert!(slipping > (pairs / 4) as f64 && stuck > (pairs / 2) as f64);
}

#[test]
fn a_new_dovetail_runs() {
    template_runs("dovetail", 42);
}

#[test]
fn a_new_fir_tree_runs() {
    template_runs("fir-tree", 84);
}

#[test]
fn new_blocks_run() {
    template_runs("two-blocks", 49);
}

#[test]
fn a_new_blade_on_rigid_ground_runs() {
    template_runs("rigid-ground", 42);
}

#[test]
fn what_is_there_is_left_alone_and_bad_names_are_refused() {
    let folder = Folder::new("way-in");
    fs::create_dir(folder.join("mine")).unwrap();
    fs::write(folder.join("mine/scene.toml"), "mine").unwrap();
    fs::write(folder.join("file"), "").unwrap();
    for (name, code, says) in [
        ("mine", 2, "mine exists and is left as it is"),
        ("file", 2, "file exists and is left as it is"),
        ("1blade", 2, "begins with an ASCII letter"),
        ("my blade", 2, "`my blade` cannot be the name"),
        ("..", 2, "cannot be the name"),
        ("file/blade", 1, "file"),
    ] {
        has(&told(program(&folder, &["new", name]), code), says);
    }
    assert_eq!(folder.text("mine/scene.toml"), "mine");
    assert_eq!(fs::read_dir(&*folder).unwrap().count(), 2);
    // A folder in another that is missing, and a name with a space before it.
    let next = printed(program(&folder, &["new", "my work/blade"]));
    has(&next, "next: dovetail run 'my work/blade/scene.toml'");
    ended(program(&folder, &["check", "my work/blade/scene.toml"]), 0);
}

// --------------------------------------------------------------------------------- dovetail schema

struct Schema(boon::Schemas, boon::SchemaIndex);

impl Schema {
    /// Schema printed by the program; panics if it is not a valid schema.
    fn new(kind: &str) -> Self {
        let text = printed(program(root(), &["schema", kind]));
        let schema = serde_json::from_str(&text).unwrap();
        let (mut schemas, mut compiler) = (boon::Schemas::new(), boon::Compiler::new());
        compiler.add_resource("printed.json", schema).unwrap();
        let index = compiler.compile("printed.json", &mut schemas).unwrap();
        Self(schemas, index)
    }

    fn problem(&self, text: &str) -> Option<String> {
        let file: toml::Table = text.parse().unwrap();
        let file = serde_json::to_value(file).unwrap();
        let checked = self.0.validate(&file, self.1);
        checked.err().map(|error| error.to_string())
    }
}

fn files_in(folders: &[&str]) -> Vec<PathBuf> {
    let entries = folders
        .iter()
        .flat_map(|f| fs::read_dir(root().join(f)).unwrap());
    let paths = entries.map(|entry| entry.unwrap().path());
    paths
        .filter(|path| path.extension() == Some(OsStr::new("toml")))
        .collect()
}

#[test]
fn the_schemas_take_every_scene_and_every_study() {
    let scenes = files_in(&["scenes", "scenes/decks", "scenes/verification", "templates"]);
    let studies = files_in(&["studies"]);
    assert!(scenes.len() >= 12 && studies.len() >= 4);
    for (kind, files) in [("scene", scenes), ("study", studies)] {
        let schema = Schema::new(kind);
        for file in files {
            let text = fs::read_to_string(&file).unwrap();
            assert_eq!(schema.problem(&text), None, "{}", file.display());
        }
    }
}

#[test]
fn the_schemas_refuse_wrong_keys_types_and_values() {
    let of_scene = r#"
        poisson = 0.34 => poisson = 0.5 => /body/0/poisson
        poisson = 0.34 => poissson = 0.34 => /body/0
        # points = 200 => points = 0 => /response/points
        eps = "dynamic" => eps = "dynamics" => /response/eps
        axis = [1, 0, 0] => axis = [1, 0] => /rotation/axis
        [damping] => [dampening] => damp
        name = "paper" => name = "1 paper" => /name
        "#;
    let of_study = r#"
        [[parameter]] => [[parameter]]\nis = "numeric" => /parameter/0/is
        [[parameter]] => [[parameter]]\nvalue = [1] => /parameter/0
        scene = " => scenes = " => scene
        "#;
    for (kind, file, table) in [
        ("scene", "scenes/paper.toml", of_scene),
        ("study", "studies/quick.toml", of_study),
    ] {
        let schema = Schema::new(kind);
        let text = fs::read_to_string(root().join(file)).unwrap();
        for [from, to, place] in cases(table) {
            assert!(text.contains(&from), "{from}");
            let problem = schema.problem(&text.replacen(&from, &to, 1));
            let problem = problem.unwrap_or_else(|| panic!("{to} passes"));
            has(&problem, &place);
        }
    }
}

// ------------------------------------------------------------------------- groups of a mesh file

#[test]
fn groups_of_a_mesh_file_are_listed_as_a_scene_names_them() {
    let mut lines = 0;
    for file in [
        "meshes/dovetail_small.msh",
        "meshes/decks/joint.inp",
        "meshes/elements/order2_zlib.vtu",
        "fuzz/seeds/ansys/blocks.cdb",
        "fuzz/seeds/nastran/small.bdf",
    ] {
        let mesh = dovetail::mesh_files::read(&root().join(file), 1.0).unwrap();
        let list = printed(program(root(), &["groups", file]));
        for (name, group) in &mesh.groups {
            let kind = ["point", "curve", "surface", "volume"][usize::from(group.dimension)];
            let line = list.lines().find(|line| {
                let words = line.strip_prefix(kind).map(str::trim_start);
                words.is_some_and(|words| words.starts_with(&format!("{name:?} ")))
            });
            let line = line.unwrap_or_else(|| panic!("{name} is missing:\n{list}"));
            let mut nodes = line.split([',', ' ']).filter_map(|w| w.parse().ok());
            assert_eq!(nodes.next_back(), Some(group.nodes.len()), "{line}");
            lines += 1;
        }
        assert_eq!(
            list.lines().count(),
            2 + mesh.groups.len() + mesh.materials.len(),
            "{list}"
        );
    }
    assert!(lines > 40, "{lines}");
    let folder = Folder::new("way-in-groups");
    let foreign = folder.write("part.k", "*KEYWORD\n*NODE\n");
    let words = ["groups", foreign.to_str().unwrap()];
    let refused = told(program(root(), &words), 2);
    assert_eq!(
        refused.matches("a deck of LS-DYNA").count(),
        1,
        "once is enough: {refused}"
    );
    // Unread contents are named once, with their numbers.
    let words = ["groups", "fuzz/seeds/ansys/blocks.cdb"];
    let remarks = told(program(root(), &words), 0);
    assert_eq!(remarks.matches("not read: D (1).").count(), 1, "{remarks}");
}

#[test]
fn a_volume_that_is_held_in_place_of_a_face_is_warned_of() {
    let folder = Folder::new("way-in-held");
    let mesh = |fixed: &str| {
        let set = format!("body.jaw.fixed=[{fixed:?}]");
        told(
            scene_command("mesh", "scenes/decks/joint.toml", &folder, &[&set]),
            0,
        )
    };
    let words = "`Base` that is fixed is a volume, and all 287 nodes \
                 & the set of nodes alone is `Base (nodes)`";
    has(&mesh("Base"), words);
    let face = mesh("Base (nodes)");
    assert!(!face.contains("is fixed"), "{face}");
}

// ----------------------------------------------------------------------- completions and man pages

/// Completions that bash offers for the last of the words.
fn offered(script: &Path, words: &[&str]) -> Vec<String> {
    let line = words.join(" ");
    let last = words.len() - 1;
    let ask = format!(
        "source {script}\nCOMP_WORDS=({line})\nCOMP_CWORD={last}\n[ {last} -lt ${{#COMP_WORDS[@]}} ] \
         || COMP_WORDS+=('')\n_dovetail dovetail '{cur}' '{prev}'\nprintf '%s\\n' \"${{COMPREPLY[@]}}\"",
        script = script.display(),
        cur = words[last],
        prev = words[last - 1],
    );
    let mut bash = Command::new("bash");
    bash.args(["--norc", "-c", &ask]);
    let output = bash.output().expect("bash runs");
    shared_program::printed(&output)
        .lines()
        .map(str::to_owned)
        .collect()
}

#[test]
fn shells_complete_commands_options_and_their_values() {
    let folder = Folder::new("way-in");
    let completions = |shell| printed(program(root(), &["completions", shell]));
    let script = folder.write("dovetail.bash", completions("bash"));
    for [words, expected] in cases(
        "
        dovetail che => check
        dovetail run --no-f => --no-fields
        dovetail run --thr => --threads
        dovetail new --template fir => fir-tree
        ",
    ) {
        let words: Vec<&str> = words.split(' ').collect();
        assert_eq!(offered(&script, &words), [expected]);
    }
    for shell in ["zsh", "fish", "elvish", "powershell"] {
        let words = "held-modes & template & completions";
        has(&completions(shell), words);
    }
}

#[test]
fn each_command_has_a_man_page() {
    let folder = Folder::new("way-in");
    ended(program(&folder, &["man", "share/man1"]), 0);
    let page = |name: &str| {
        let text = folder.text(&format!("share/man1/{name}"));
        text.replace("\\-", "-")
    };
    let whole = page("dovetail.1");
    has(&whole, "--cache-limit-gib & Exit codes");
    let commands = whole
        .lines()
        .filter_map(|line| line.strip_prefix("dovetail-"));
    let commands: Vec<&str> = commands
        .map(|line| line.split('(').next().unwrap())
        .collect();
    assert!(commands.len() >= 12, "{commands:?}");
    for command in commands {
        let text = page(&format!("dovetail-{command}.1"));
        has(&text, &format!("dovetail {command} & Example"));
    }
    assert!(page("dovetail-run.1").contains("--resume"));
}

// -------------------------------------------------------------------------------------- the README

/// The quick start of the README with a deck of this repository: its scene runs, and gives the
/// results on the page.
#[test]
fn the_scene_of_the_readme_runs() {
    let page = fs::read_to_string(root().join("README.md")).unwrap();
    let block = |kind: &str| {
        let (_, rest) = page.split_once(&format!("```{kind}\n")).unwrap();
        rest.split_once("```").unwrap().0
    };
    let folder = Folder::new("readme");
    fs::copy(
        root().join("meshes/decks/joint.inp"),
        folder.join("my_part.inp"),
    )
    .unwrap();
    folder.write("my_part.toml", block("toml"));
    ended(program(&folder, &["check", "my_part.toml"]), 0);
    let told = printed(program(&folder, &["run", "my_part.toml", "--no-cache"]));
    for line in block("text").lines() {
        assert!(
            told.lines().any(|found| same_line(found, line)),
            "{line}: {told}"
        );
    }
}

// -------------------------------------------------------------------------------------- the commit

fn git(folder: &Path, words: &[&str]) {
    let mut git = Command::new("git");
    git.current_dir(folder);
    git.args(["-c", "user.name=a", "-c", "user.email=a@b.example"]);
    git.args(words);
    ended(git, 0);
}

/// A clone of two files, one of which the program is made from.
fn clone() -> Folder {
    let folder = Folder::new("way-in");
    fs::create_dir(folder.join("src")).unwrap();
    fs::write(folder.join("src/main.rs"), "").unwrap();
    fs::write(folder.join("README.md"), "").unwrap();
    git(&folder, &["init", "-q"]);
    git(&folder, &["add", "."]);
    git(&folder, &["commit", "-q", "-m", "first"]);
    folder
}

#[test]
fn the_version_names_the_commit() {
    let text = printed(program(root(), &["--version"]));
    let version = env!("CARGO_PKG_VERSION");
    let expected = match build::commit(root()) {
        Some(commit) => format!("dovetail {version} ({commit})\n"),
        None => format!("dovetail {version}\n"),
    };
    assert_eq!(text, expected);
}

#[test]
fn the_commit_is_dirty_where_a_source_is_changed() {
    let folder = clone();
    let commit = build::commit(&folder).unwrap();
    assert!(commit.len() >= 7 && commit.chars().all(|c| c.is_ascii_hexdigit()));
    fs::write(folder.join("README.md"), "other").unwrap();
    assert_eq!(build::commit(&folder).as_ref(), Some(&commit));
    fs::write(folder.join("src/main.rs"), "other").unwrap();
    assert_eq!(build::commit(&folder), Some(format!("{commit}-dirty")));
}

#[test]
fn sources_that_are_no_clone_have_no_commit() {
    let folder = Folder::new("way-in");
    assert_eq!(build::commit(&folder), None);
    // A package unpacked inside the clone of something else.
    let other = clone();
    assert_eq!(build::commit(&other.join("src")), None);
}

#[test]
fn what_tells_of_a_new_commit_is_watched_in_clones_and_worktrees() {
    let folder = clone();
    let tree = folder.join("tree");
    git(&folder, &["worktree", "add", "-q", "-b", "other", "tree"]);
    git(&folder, &["pack-refs", "--all"]);
    for root in [&*folder, &tree] {
        let mut watched = build::watched(root);
        assert!(watched.contains(&root.join("src")));
        let before = build::commit(root).unwrap();
        let times = |paths: &[PathBuf]| {
            let time = |path: &PathBuf| (fs::metadata(path).unwrap().len(), fs::read(path).ok());
            paths.iter().map(time).collect::<Vec<_>>()
        };
        watched.retain(|path| path.is_file());
        let old = times(&watched);
        git(root, &["commit", "-q", "--allow-empty", "-m", "next"]);
        assert_ne!(build::commit(root).unwrap(), before);
        assert_ne!(times(&watched), old, "{watched:?}");
    }
}
