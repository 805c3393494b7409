//! First steps: new scenes run, schemas accept the files of this repository, shells complete, man
//! pages are written, and the version has the commit.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

use crate::shared_folder::Folder;
use crate::shared_program::{ended, program, said_in_one_line};
use crate::tutorial::same_line;

/// Build script, which passes the commit to the program; cargo calls its `main`.
#[allow(dead_code)]
#[path = "../../build.rs"]
mod build;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn printed(output: Output) -> String {
    String::from_utf8(output.stdout).unwrap()
}

// ------------------------------------------------------------------------------------ dovetail new

/// Makes the scene of a template, runs it by the printed command, and checks its result: every
/// frequency converges without a warning, friction slips at some pairs and sticks at others, and
/// lowers the peak.
fn template_runs(template: &str, pairs: u64) {
    let gmsh = Command::new("gmsh").arg("-version").output();
    assert!(
        gmsh.is_ok(),
        "gmsh is not installed, and this test runs it: `tools/setup.sh` installs it"
    );
    let folder = Folder::new("way-in");
    let name = format!("my_{}", template.replace('-', "_"));
    let told = printed(ended(
        program(&folder, &["new", &name, "--template", template]),
        0,
    ));
    let next = told.lines().find_map(|line| line.strip_prefix("next: "));
    let words: Vec<&str> = next.unwrap().split(' ').skip(1).collect();
    for file in told.lines().filter_map(|line| line.strip_prefix("wrote ")) {
        assert!(folder.join(file).is_file(), "{file}");
    }
    let mut run = program(&folder, &words);
    run.args(["--no-cache", "--no-fields"]);
    let said = said_in_one_line(&ended(run, 0));
    assert!(!said.contains("warning"), "{template}: {said}");
    let summary = folder.join("output").join(&name).join("summary.json");
    let summary: Value = serde_json::from_slice(&fs::read(summary).unwrap()).unwrap();
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
    let table = folder.join("output").join(&name).join("response.csv");
    let table = fs::read_to_string(table).unwrap();
    let mut rows = table
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let head = rows.next().unwrap();
    let column = |word: &str| head.iter().position(|h| *h == word).unwrap();
    let (slipping, stuck) = (column("slipping_pairs"), column("stuck_pairs"));
    let count = |row: &[&str], at: usize| row[at].parse::<usize>().unwrap();
    let rows: Vec<Vec<&str>> = rows.collect();
    assert!(
        rows.iter()
            .any(|row| count(row, slipping) > pairs as usize / 4)
    );
    assert!(
        rows.iter()
            .any(|row| count(row, stuck) > pairs as usize / 2)
    );
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
        let said = said_in_one_line(&ended(program(&folder, &["new", name]), code));
        assert!(said.contains(says), "{name}: {said}");
    }
    let kept = fs::read_to_string(folder.join("mine/scene.toml")).unwrap();
    assert_eq!(kept, "mine");
    assert_eq!(fs::read_dir(&*folder).unwrap().count(), 2);
    // A folder in another that is missing, and a name with a space before it.
    let told = printed(ended(program(&folder, &["new", "my work/blade"]), 0));
    assert!(
        told.contains("next: dovetail run 'my work/blade/scene.toml'"),
        "{told}"
    );
    ended(program(&folder, &["check", "my work/blade/scene.toml"]), 0);
}

// --------------------------------------------------------------------------------- dovetail schema

struct Schema(boon::Schemas, boon::SchemaIndex);

impl Schema {
    /// Schema printed by the program; panics if it is not a valid schema.
    fn of(kind: &str) -> Self {
        let text = printed(ended(program(root(), &["schema", kind]), 0));
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
        let schema = Schema::of(kind);
        for file in files {
            let text = fs::read_to_string(&file).unwrap();
            assert_eq!(schema.problem(&text), None, "{}", file.display());
        }
    }
}

#[test]
fn the_schemas_refuse_wrong_keys_types_and_values() {
    let (scene, study) = (Schema::of("scene"), Schema::of("study"));
    let paper = fs::read_to_string(root().join("scenes/paper.toml")).unwrap();
    let quick = fs::read_to_string(root().join("studies/quick.toml")).unwrap();
    for (schema, text, from, to, place) in [
        (
            &scene,
            &paper,
            "poisson = 0.34",
            "poisson = 0.5",
            "/body/0/poisson",
        ),
        (
            &scene,
            &paper,
            "poisson = 0.34",
            "poissson = 0.34",
            "/body/0",
        ),
        (
            &scene,
            &paper,
            "# points = 200",
            "points = 0",
            "/response/points",
        ),
        (
            &scene,
            &paper,
            "eps = \"dynamic\"",
            "eps = \"dynamics\"",
            "/response/eps",
        ),
        (
            &scene,
            &paper,
            "axis = [1, 0, 0]",
            "axis = [1, 0]",
            "/rotation/axis",
        ),
        (&scene, &paper, "[damping]", "[dampening]", "damp"),
        (
            &scene,
            &paper,
            "name = \"paper\"",
            "name = \"1 paper\"",
            "/name",
        ),
        (
            &study,
            &quick,
            "[[parameter]]\n",
            "[[parameter]]\nis = \"numeric\"\n",
            "/parameter/0/is",
        ),
        (
            &study,
            &quick,
            "[[parameter]]\n",
            "[[parameter]]\nvalue = [1]\n",
            "/parameter/0",
        ),
        (&study, &quick, "scene = ", "scenes = ", "scene"),
    ] {
        assert!(text.contains(from), "{from}");
        let problem = schema.problem(&text.replacen(from, to, 1));
        let problem = problem.unwrap_or_else(|| panic!("{to} passes"));
        assert!(problem.contains(place), "{to}: {problem}");
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
    ] {
        let mesh = dovetail::mesh_files::read(&root().join(file), 1.0).unwrap();
        let list = printed(ended(program(root(), &["groups", file]), 0));
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
    let ansys = folder.join("part.cdb");
    fs::write(&ansys, "/PREP7\nNBLOCK,6,SOLID\n").unwrap();
    let failed = ended(
        program(root(), &["groups", &ansys.display().to_string()]),
        2,
    );
    let said = said_in_one_line(&failed);
    assert!(said.contains("an archive of Ansys"), "{said}");
    assert_eq!(
        said.matches("an archive of Ansys").count(),
        1,
        "once is enough: {said}"
    );
}

#[test]
fn a_volume_that_is_held_in_place_of_a_face_is_warned_of() {
    let folder = Folder::new("way-in-held");
    let mesh = |fixed: &str| {
        let out = folder.display().to_string();
        let set = format!("body.jaw.fixed=[{fixed:?}]");
        let scene = "scenes/decks/joint.toml";
        let words = ["mesh", scene, "--no-cache", "--out", &out, "--set", &set];
        said_in_one_line(&ended(program(root(), &words), 0))
    };
    let held = mesh("Base");
    assert!(
        held.contains("`Base` that is fixed is a volume, and all 287 nodes")
            && held.contains("the set of nodes alone is `Base (nodes)`"),
        "{held}"
    );
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
    let output = Command::new("bash").args(["--norc", "-c", &ask]).output();
    let output = output.expect("bash runs");
    let offered = printed(output);
    offered.lines().map(str::to_owned).collect()
}

#[test]
fn shells_complete_commands_options_and_their_values() {
    let folder = Folder::new("way-in");
    let script = folder.join("dovetail.bash");
    fs::write(
        &script,
        printed(ended(program(root(), &["completions", "bash"]), 0)),
    )
    .unwrap();
    assert_eq!(offered(&script, &["dovetail", "che"]), ["check"]);
    assert_eq!(
        offered(&script, &["dovetail", "run", "--no-f"]),
        ["--no-fields"]
    );
    assert_eq!(
        offered(&script, &["dovetail", "run", "--thr"]),
        ["--threads"]
    );
    let templates = offered(&script, &["dovetail", "new", "--template", "fir"]);
    assert_eq!(templates, ["fir-tree"]);
    for shell in ["zsh", "fish", "elvish", "powershell"] {
        let script = printed(ended(program(root(), &["completions", shell]), 0));
        for word in ["held-modes", "template", "completions"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
}

#[test]
fn each_command_has_a_man_page() {
    let folder = Folder::new("way-in");
    ended(program(&folder, &["man", "share/man1"]), 0);
    let page = |name: &str| {
        let text = fs::read_to_string(folder.join("share/man1").join(name)).unwrap();
        text.replace("\\-", "-")
    };
    let whole = page("dovetail.1");
    assert!(whole.contains("--cache-limit-gib") && whole.contains("Exit codes"));
    let commands = whole
        .lines()
        .filter_map(|line| line.strip_prefix("dovetail-"));
    let commands: Vec<&str> = commands
        .map(|line| line.split('(').next().unwrap())
        .collect();
    assert!(commands.len() >= 12, "{commands:?}");
    for command in commands {
        let text = page(&format!("dovetail-{command}.1"));
        assert!(text.contains(&format!("dovetail {command}")), "{text}");
        assert!(text.contains("Example"), "{command}");
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
    fs::write(folder.join("my_part.toml"), block("toml")).unwrap();
    ended(program(&folder, &["check", "my_part.toml"]), 0);
    let run = program(&folder, &["run", "my_part.toml", "--no-cache"]);
    let told = printed(ended(run, 0));
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
    let text = printed(ended(program(root(), &["--version"]), 0));
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
