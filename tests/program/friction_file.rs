//! Coefficients of friction from a file: the small joint of the paper, whose two contacts have one
//! file in the place of a coefficient each.

use crate::shared_program::{SMALL, said, scene_command, unwrapped};
use crate::shared_runs::{Run, numbers};
use dovetail_testkit::folder::Folder;
use std::fmt::Write as _;
use std::path::Path;

const RESPONSE: [&str; 7] = [
    SMALL,
    "response.times_first_linear_mode=[0.99, 1.0]",
    "response.points=2",
    "response.harmonics=1",
    "response.samples=64",
    "response.tolerance=1e-8",
    "excitation.0.force_n=4",
];

/// Run of the paper's scene with further keys.
fn run(name: &str, set: &[String]) -> Run {
    let set: Vec<&str> = set.iter().map(String::as_str).collect();
    Run::new("run", "paper", name, &[&RESPONSE[..], &set].concat())
}

/// Keys that give both contacts a file of friction.
fn from_file(file: &Path) -> Vec<String> {
    vec![
        "contact.*.friction=".to_owned(),
        format!("contact.*.friction_file={}", file.display()),
    ]
}

/// File of points at the pairs of a run, with a coefficient for each contact.
fn points(folder: &Folder, run: &Run, friction: impl Fn(&str) -> f64) -> std::path::PathBuf {
    let mut text = String::from("# measured\nx_m,y_m,z_m,friction\n");
    for row in run.table("static.csv") {
        let at = ["x_m", "y_m", "z_m"].map(|column| row[column].as_str());
        writeln!(text, "{},{}", at.join(","), friction(&row["contact"])).unwrap();
    }
    folder.write("friction.csv", text)
}

fn same_response(a: &Run, b: &Run) {
    let text = |run: &Run| std::fs::read_to_string(run.0.join("response.csv")).unwrap();
    assert_eq!(text(a), text(b));
}

#[test]
fn the_coefficients_of_a_file_are_those_of_contacts_that_have_them() {
    let folder = Folder::new("friction-file");
    let plain = run("friction-plain", &["contact.*.friction=0.3".to_owned()]);
    let uniform = points(&folder, &plain, |_| 0.3);
    same_response(&plain, &run("friction-uniform", &from_file(&uniform)));

    let of = |contact: &str| if contact == "left" { 0.2 } else { 0.5 };
    let two = ["left", "right"].map(|name| format!("contact.{name}.friction={}", of(name)));
    let two = run("friction-two", &two);
    let file = points(&folder, &plain, of);
    let of_file = run("friction-two-of-file", &from_file(&file));
    same_response(&two, &of_file);
    let columns = [&two, &of_file].map(|run| numbers(&run.0.join("static.csv"), "friction"));
    assert_eq!(columns[0], columns[1]);
    assert!(columns[0].contains(&0.2) && columns[0].contains(&0.5));
    let flank = std::fs::read(of_file.0.join("flank_static.vtu")).unwrap();
    let flank = String::from_utf8_lossy(&flank);
    assert!(flank.contains("Name=\"friction\""));
    let report = std::fs::read_to_string(of_file.0.join("report.html")).unwrap();
    for words in ["friction of a file", "from <code>friction.csv</code>"] {
        assert!(report.contains(words), "{words}");
    }
}

#[test]
fn files_that_cannot_be_used_are_refused() {
    let folder = Folder::new("friction-file");
    let refused = |text: &str, set: &[&str], words: &[&str]| {
        let file = folder.write("friction.csv", text);
        let own = from_file(&file);
        let own: Vec<&str> = own.iter().map(String::as_str).collect();
        let set = [&RESPONSE[..], &own, set].concat();
        let output = scene_command("run", "scenes/paper.toml", &folder.join("out"), &set);
        let output = { output }.output().unwrap();
        let said = unwrapped(&said(&output));
        assert!(!output.status.success());
        for word in words {
            assert!(said.contains(word), "{word}: {said}");
        }
    };
    let head = "x_m,y_m,z_m,friction\n";
    refused(
        &format!("{head}0,0,0,-0.1\n"),
        &[],
        &["line 2", "-0.1", "0 or more"],
    );
    refused(&format!("{head}0,0,0,nan\n"), &[], &["line 2", "nan"]);
    refused(
        &format!("{head}0,0,450,0.3\n"),
        &[],
        &["nearest point", "metres"],
    );
    refused(
        "x_m,y_m,z_m,pressure_re_pa\n0,0,0,1\n",
        &[],
        &["friction are expected"],
    );
    let both = ["contact.left.friction=0.3"];
    refused(
        &format!("{head}0,0,0,0.3\n"),
        &both,
        &["exclude each other", "keep"],
    );
}
