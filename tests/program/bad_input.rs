//! Unintended input: the program ends soon, with a short message, and never with a panic.

use crate::shared_folder::Folder;
use crate::shared_program::{cases, ended, has, program, scene_command, told, unwrapped};
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Writes a file into the folder, and returns its path as an argument.
fn written(folder: &Folder, file: &str, text: impl AsRef<[u8]>) -> String {
    folder.write(file, text).to_str().unwrap().to_owned()
}

fn named_pipe(path: &Path) {
    let mut mkfifo = Command::new("mkfifo");
    ended(mkfifo.arg(path), 0);
}

fn root(file: &str) -> String {
    let file = dovetail_testkit::folder::root().join(file);
    file.to_str().unwrap().to_owned()
}

/// Time limit above the duration of any of these runs.
const LIMIT: Duration = Duration::from_secs(20);

/// Runs the program in a folder; returns the exit code and standard error. The program must end by
/// itself, soon, without a panic, with a short message without control characters.
fn dovetail(folder: &Folder, arguments: &[&str]) -> (i32, String) {
    let stderr = folder.join("stderr");
    let mut child = program(folder, arguments)
        .args(["--no-cache", "--out", "out"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(&stderr).unwrap())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if begin.elapsed() > LIMIT {
            child.kill().unwrap();
            child.wait().unwrap();
            panic!("{arguments:?} did not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let said = String::from_utf8(std::fs::read(&stderr).unwrap()).unwrap();
    let shown: String = said.chars().take(3000).collect();
    assert!(!said.contains("panicked"), "{shown}");
    assert!(said.len() < 40_000, "{} bytes: {shown}", said.len());
    let obeyed = said.chars().find(|c| c.is_control() && *c != '\n');
    assert!(obeyed.is_none(), "{obeyed:?}: {shown}");
    (status.code().expect("ended by a signal"), said)
}

/// Message on one line of arguments that are refused.
#[track_caller]
fn refused(folder: &Folder, arguments: &[&str]) -> String {
    let (code, said) = dovetail(folder, arguments);
    assert_eq!(code, 2, "{said}");
    unwrapped(&said)
}

/// Checks that a scene with this text is refused with these words.
#[track_caller]
fn is_refused(folder: &Folder, file: &str, text: impl AsRef<[u8]>, words: &str) {
    let scene = written(folder, file, text);
    has(&refused(folder, &["check", &scene]), words);
}

#[test]
fn an_error_far_along_a_line_is_shown() {
    let folder = Folder::new("column");
    let blanks = " ".repeat(70_000);
    is_refused(
        &folder,
        "a.toml",
        format!("name = \"x\"\na = [{blanks}@ ]\n"),
        "a.toml:2:70006 & @ ]",
    );
    // The place of a value, and a line of much text around it.
    let keys: String = (0..20_000).map(|i| format!("k{i} = 1, ")).collect();
    is_refused(
        &folder,
        "b.toml",
        format!("name = 3\nx = {{ {keys} }}\n"),
        "b.toml:1:8",
    );
    let study = written(
        &folder,
        "c.toml",
        format!("name = \"s\"\nscene = [{blanks}@ ]\n"),
    );
    has(&refused(&folder, &["study", &study]), "c.toml:2:");
}

#[test]
fn a_reader_that_has_gone_is_no_error() {
    let folder = Folder::new("pipe");
    let jenkins = root("scenes/verification/jenkins.toml");
    for (command, arguments) in [
        ("modes", ""),
        ("verify", "--at 1 --periods 3 --steps 64 --tolerance 9"),
    ] {
        let mut child = scene_command(command, &jenkins, &folder.join("out"), &[])
            .args(arguments.split_whitespace())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(0), "{command}: {said}");
        has(&said, "results in");
    }
    if Path::new("/dev/full").exists() {
        let full = std::fs::File::options().write(true).open("/dev/full");
        let mut modes = scene_command("modes", &jenkins, &folder.join("out"), &[]);
        has(&told(modes.stdout(full.unwrap()), 1), "standard output");
    }
}

#[test]
fn a_time_integration_has_an_end() {
    let folder = Folder::new("steps");
    let jenkins = root("scenes/verification/jenkins.toml");
    let table = "
        --steps 1000000000000 => from 16 to 1000000
        --steps 1e12 => from 16 to 1000000
        --periods 1000000000000 => from 1 to 1000000
        --steps 1000000 --periods 1000000 => 1000000 periods of 1000000 steps & --steps
        --steps 1000000 --most-periods 3000 => 3000 periods
        ";
    for [more, words] in cases(table) {
        let mut arguments = vec!["verify", &jenkins, "--at", "1"];
        arguments.extend(more.split(' '));
        has(&refused(&folder, &arguments), &words);
    }
}

#[test]
fn twenty_thousand_faults_are_one_short_report() {
    let folder = Folder::new("contacts");
    let paper = std::fs::read_to_string(root("scenes/paper.toml")).unwrap();
    let contact = |i: usize| {
        format!(
            "[[contact]]\nname = \"c{i}\"\nfirst = \"blade_flank_left\"\nsecond = \"blade_flank_left\"\nfriction = 0.3\n"
        )
    };
    let contacts: String = (0..20_000).map(contact).collect();
    let scene = written(&folder, "a.toml", paper + &contacts);
    let words = "`contact.c0.second` is the same group as `first` & the first of 20000 errors \
                 & 19979 more errors are not shown";
    has(&refused(&folder, &["check", &scene]), words);
    // One argument that names all alike is a fault of each but the first.
    let two = format!("{}{}", contact(1), contact(2));
    let paper = std::fs::read_to_string(root("scenes/paper.toml")).unwrap();
    let scene = written(&folder, "b.toml", paper + &two);
    has(
        &refused(&folder, &["check", &scene, "--set", "contact.*.name=x"]),
        "is taken already",
    );
    // Lines of nonsense.
    let lines: String = (0..60_000).map(|i| format!("x{i}\n")).collect();
    is_refused(&folder, "c.toml", lines, "c.toml:1:");
}

#[test]
fn a_mesh_in_place_of_a_scene_is_one_error_that_says_where_meshes_go() {
    let folder = Folder::new("deck");
    let said = refused(&folder, &["run", &root("meshes/decks/joint.inp")]);
    assert_eq!(said.matches("this is not TOML").count(), 1, "{said}");
    has(&said, "`dovetail groups FILE`");
}

#[test]
fn a_cause_that_a_message_names_is_not_told_again() {
    let folder = Folder::new("cause");
    let (paper, missing) = (root("scenes/paper.toml"), "mesh.file=missing.msh");
    let (code, said) = dovetail(&folder, &["mesh", &paper, "--set", missing]);
    let said = unwrapped(&said);
    assert_ne!(code, 0, "{said}");
    assert!(said.contains("missing.msh"), "{said}");
    assert_eq!(said.matches("No such file").count(), 1, "{said}");
}

#[test]
fn many_faults_of_one_line_are_told() {
    let folder = Folder::new("one-line");
    is_refused(
        &folder,
        "a.toml",
        format!("name = \"{}\"\n", "\\q".repeat(500_000)),
        "missing escaped value",
    );
}

#[test]
fn blanks_in_a_mesh_cost_no_time() {
    let folder = Folder::new("blanks");
    let mesh = std::fs::read(root("meshes/dovetail_small.msh")).unwrap();
    let at = mesh.windows(7).position(|w| w == b"\n$Nodes").unwrap() + 1;
    let with = |section: &str, name: &str| {
        let bytes = [&mesh[..at], section.as_bytes(), &mesh[at..]].concat();
        let file = written(&folder, name, bytes);
        let set = format!("mesh.file={file}");
        dovetail(
            &folder,
            &["mesh", &root("scenes/paper.toml"), "--set", &set],
        )
    };
    let blanks = " ".repeat(1_000_000);
    for section in [
        format!("$Comments\n{blanks}\n$EndComments\n"),
        format!("$Comments\n{blanks}a comment\n$EndComments\n{blanks}\n"),
        format!("$\n{blanks}a section without a name\n$End\n"),
    ] {
        let (code, said) = with(&section, "blanks.msh");
        assert_eq!(code, 0, "{said}");
    }
    let (code, said) = with(&format!("$Comments\n{blanks}x\n"), "open.msh");
    assert_eq!(code, 2, "{said}");
    has(&unwrapped(&said), "it has no $EndComments");
}

#[test]
fn only_regular_files_are_read() {
    let folder = Folder::new("regular");
    let pipe = folder.join("pipe");
    named_pipe(&pipe);
    let paper = root("scenes/paper.toml");
    let model = folder.join("model");
    std::fs::create_dir(&model).unwrap();
    std::fs::copy(
        root("scenes/verification/jenkins/stiffness.mtx"),
        model.join("stiffness.mtx"),
    )
    .unwrap();
    named_pipe(&model.join("model.json"));
    let reduced = written(
        &folder,
        "reduced.toml",
        "name = \"r\"\n[reduced_model]\nfolder = \"model\"\nfriction = 0.3\nforce_n = 1\n[damping]\nmass_per_s = 0.1\n\
         [response]\nfrequency_hz = [1, 2]\n",
    );
    let there = folder.to_str().unwrap();
    for (other, called) in [
        (pipe.to_str().unwrap(), "a named pipe"),
        (there, "a folder"),
        ("/dev/zero", "a device"),
    ] {
        let file = format!("mesh.file={other}");
        let script = format!("mesh.geometry={other}");
        for arguments in [
            ["check", other].as_slice(),
            &["run", other],
            &["study", other],
            &["check", &paper, "--set", &file],
            &["mesh", &paper, "--set", &file],
            &["check", &paper, "--set", &script],
            &["mesh", &paper, "--set", &script],
        ] {
            println!("{arguments:?}");
            let words = format!("{called} & regular file");
            has(&refused(&folder, arguments), &words);
        }
    }
    has(
        &refused(&folder, &["check", &reduced]),
        "it is a named pipe",
    );
}

/// `dovetail` itself asserts that no control character is left.
#[test]
fn names_do_not_command_the_terminal() {
    let folder = Folder::new("escapes");
    let clear = "\x1b[2J\x1b]0;title\x07";
    // A group of the mesh, by a list of those there are.
    let mesh = std::fs::read_to_string(root("meshes/blocks_order1.msh")).unwrap();
    let mesh = written(
        &folder,
        "a.msh",
        mesh.replace("\"lower_top\"", &format!("\"{clear}\"")),
    );
    let set = format!("mesh.file={mesh}");
    has(
        &refused(
            &folder,
            &[
                "mesh",
                &root("scenes/paper.toml"),
                "--set",
                &set,
                "--set",
                "body.*.fixed=",
                "--set",
                "body.0.volume=upper",
                "--set",
                "body.1.volume=lower",
                "--set",
                "body.1.fixed=[\"base\"]",
                "--set",
                "contact.left.first=none",
            ],
        ),
        "\\u{1b}[2J",
    );
    // A key and a value of the scene, and its file.
    is_refused(
        &folder,
        "b.toml",
        "name = \"\\u001b[2J\"\n\"\\u001b[3J\" = 1\n",
        "\\u{1b}[3J",
    );
    let name = std::ffi::OsStr::from_bytes(b"\x1b[4m.toml");
    std::fs::write(folder.join(name), "name = 3\n").unwrap();
    let scene = folder.join(name);
    has(
        &refused(&folder, &["check", scene.to_str().unwrap()]),
        "\\u{1b}[4m.toml:1:8",
    );
    // Text of the scene beside the fault: TOML allows no control characters but tabs, and those
    // that turn writing.
    let scene = written(&folder, "c.toml", "name = \"\u{202e}x\" # \u{9b}31m\n");
    let said = refused(&folder, &["check", &scene]);
    assert!(!said.contains('\u{202e}'), "{said}");
    let scene = written(&folder, "d.toml", "name = \"a\0b\"\n\0\0\x1b[2J\n");
    refused(&folder, &["check", &scene]);
}

#[test]
fn whatever_is_long_is_cut() {
    let folder = Folder::new("long");
    let long = "x".repeat(1_000_000);
    let deep = "[".repeat(100_000);
    let keys = ["a"; 100_000].join(".");
    for text in [
        String::new(),
        format!("name = \"{long}\"\n"),
        format!("{long} = 1\n"),
        format!("[{long}]\n[[{long}]]\n"),
        format!("name = 1 # {long}\n"),
        format!("[[contact]]\nname = \"{long}\"\n[[contact]]\nname = \"{long}\"\n"),
        format!("[mesh]\nfile = \"{long}\"\n"),
        format!("x = {deep}\n"),
        format!("x = {deep}{}\n", "]".repeat(100_000)),
        format!("{keys} = 1\n"),
        format!("[{keys}]\n"),
        "\u{feff}name = 1".to_owned(),
        "\0".repeat(100_000),
        "é".repeat(100_000),
        "\r".repeat(100_000),
    ] {
        let scene = written(&folder, "a.toml", text);
        refused(&folder, &["check", &scene]);
        refused(&folder, &["study", &scene]);
    }
    let paper = root("scenes/paper.toml");
    let value = "[".repeat(50_000);
    for set in [
        format!("name={value}"),
        format!("{}=1", ["a"; 20_000].join(".")),
        "x".repeat(100_000),
    ] {
        refused(&folder, &["check", &paper, "--set", &set]);
    }
    // A name that is right but nowhere to be found.
    let set = format!("mesh.file={}", "y".repeat(5000));
    refused(&folder, &["run", &paper, "--set", &set]);
}
