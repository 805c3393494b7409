//! The tables of keys in docs/scene.md and docs/study.md are those of the program. After a change
//! of a key, `UPDATE_DOCS=1 cargo test --test program reference::` updates the tables.
//! docs/summary.md has the keys of summary.json.

use std::collections::BTreeSet;

use dovetail::reference::{scene_tables, study_tables};

use crate::reduced_scenes::stop_scene;
use crate::shared_folder::Folder;
use crate::shared_program::{READY_PATCH, SMALL, ended, printed, program, scene_command};
use crate::shared_runs::{Run, summary};
use dovetail_testkit::folder::root;

const END: &str = "<!-- end -->";

/// Page with the text between `<!-- keys: NAME -->` and `<!-- end -->` replaced.
fn replace_tables(page: &str, tables: &[(&str, String)]) -> String {
    let mut text = page.to_owned();
    for (name, table) in tables {
        let mark = format!("<!-- keys: {name} -->\n");
        let begin = text.find(&mark).unwrap_or_else(|| panic!("no {mark}"));
        let begin = begin + mark.len();
        let end = text[begin..]
            .find(END)
            .unwrap_or_else(|| panic!("no {END} after {mark}"));
        // The empty line between a comment and a table is what Markdown needs to see the table.
        text.replace_range(begin..begin + end, &format!("\n{table}\n"));
    }
    text
}

fn holds_its_tables(page: &str, tables: &[(&str, String)]) {
    let path = root().join(page);
    let found = std::fs::read_to_string(&path).unwrap();
    assert_eq!(found.matches("<!-- keys: ").count(), tables.len(), "{page}");
    let expected = replace_tables(&found, tables);
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &expected).unwrap();
    } else if found != expected {
        let mut lines = found.lines().zip(expected.lines());
        let differing = lines.find(|(line, wanted)| line != wanted);
        panic!(
            "{page} and the keys of the program differ: (page, program) = {differing:#?}\n\
             UPDATE_DOCS=1 cargo test --test program reference:: writes the tables anew"
        );
    }
}

#[test]
fn the_page_of_scenes_has_the_tables_of_the_program() {
    holds_its_tables("docs/scene.md", &scene_tables());
}

#[test]
fn the_page_of_studies_has_the_tables_of_the_program() {
    holds_its_tables("docs/study.md", &study_tables());
}

/// Commands in the code of the README and of the book, without `\` at the end of a line.
fn commands() -> Vec<String> {
    let mut pages = vec![root().join("README.md")];
    for folder in ["docs", "docs/how-to"] {
        let entries = std::fs::read_dir(root().join(folder)).unwrap();
        let files = entries.map(|entry| entry.unwrap().path());
        pages.extend(files.filter(|f| f.extension().is_some_and(|e| e == "md")));
    }
    let mut found = Vec::new();
    for page in pages {
        let text = std::fs::read_to_string(page).unwrap().replace("\\\n", " ");
        for line in text.lines() {
            let line = line.trim_start().trim_start_matches("target/release/");
            let words = line.strip_prefix("dovetail ");
            let is_code = words.is_some_and(|w| w.contains("SCENE") || w.contains(".toml"));
            if is_code {
                found.push(line.split(" #").next().unwrap().to_owned());
            }
        }
    }
    found
}

#[test]
fn commands_of_the_book_have_options_that_exist() {
    let (mut checked, mut wrong) = (0, Vec::new());
    let mut help = std::collections::HashMap::new();
    for command in commands() {
        let mut words = command.split_whitespace().skip(1);
        let name = words.next().unwrap().to_owned();
        let help = help.entry(name.clone()).or_insert_with(|| {
            // Those of the command, and those of all commands.
            let pages = [&[&name, "--help"][..], &["--help"]]
                .map(|words| printed(&ended(program(root(), words), 0)));
            pages.concat()
        });
        for option in words.filter(|w| w.starts_with("--")) {
            checked += 1;
            let option = option.split('=').next().unwrap();
            if !help.contains(&format!("{option} ")) && !help.contains(&format!("{option}\n")) {
                wrong.push(format!("{option}: {command}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 40, "only {checked} options found");
}

#[test]
fn keys_that_commands_of_the_book_set_exist() {
    let tables = scene_tables();
    let keys = |section: &str| {
        tables
            .iter()
            .find(|(name, _)| *name == section)
            .map(|(_, t)| t)
    };
    let (mut checked, mut wrong) = (0, Vec::new());
    for command in commands() {
        for setting in command.split("--set ").skip(1) {
            let path = setting.trim_start_matches('\'').split('=').next().unwrap();
            let (section, rest) = path.split_once('.').unwrap_or((path, ""));
            checked += 1;
            let known = keys(section).is_some_and(|table| {
                let named = |word: &str| table.contains(&format!("| `{word}` |"));
                rest.is_empty() || rest.split('.').any(named)
            });
            // `KEY=VALUE` stands for any.
            if !known && path != "KEY" {
                wrong.push(format!("{path}: {command}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 30, "only {checked} keys found");
}

/// Paths of the keys of a summary, `[]` for the items of a list.
fn key_paths(value: &serde_json::Value, path: &str, found: &mut BTreeSet<String>) {
    match value {
        serde_json::Value::Object(entries) => {
            for (key, value) in entries {
                let inner = match path {
                    "" => key.clone(),
                    path => format!("{path}.{key}"),
                };
                key_paths(value, &inner, found);
            }
        }
        serde_json::Value::Array(items) if items.iter().any(serde_json::Value::is_object) => {
            for item in items {
                key_paths(item, &format!("{path}[]"), found);
            }
        }
        _ => {
            found.insert(path.to_owned());
        }
    }
}

/// `docs/output_files.md` has each column of a response with an observed point and harmonics.
#[test]
fn the_page_of_output_files_has_the_columns_of_a_response() {
    let run = Run::new("run", "verification/jenkins", "reference_columns", &[]);
    let table = std::fs::read_to_string(run.0.join("response.csv")).unwrap();
    let names = run.summary();
    let name = names["response"]["observation"].as_str().unwrap();
    let page = std::fs::read_to_string(root().join("docs/output_files.md")).unwrap();
    let columns: Vec<String> = table
        .lines()
        .next()
        .unwrap()
        .split(',')
        .map(str::to_owned)
        .collect();
    assert!(
        columns.iter().any(|column| column.contains("_h1_")),
        "{columns:?}"
    );
    for column in columns {
        let mut general = column.replace(&format!("{name}_"), "<name>_");
        if let Some((start, rest)) = general.split_once("<name>_h")
            && let Some((number, end)) = rest.split_once('_')
            && number.parse::<usize>().is_ok()
        {
            general = format!("{start}<name>_h<k>_{end}");
        }
        assert!(
            page.contains(&format!("`{general}`")),
            "{column}: {general}"
        );
    }
}

#[test]
fn the_page_of_the_summary_has_its_keys() {
    let summary_of = |command, scene: &str, set: &[&str]| {
        let run = Run::new(command, scene, "reference", set);
        run.summary()
    };
    let jenkins = "verification/jenkins";
    let wear = Folder::new("reference_wear");
    let set = [SMALL, "response.harmonics=1", "contact.*.wear_m2_n=1e-14"];
    let mut command = scene_command("wear", "scenes/paper.toml", &wear, &set);
    ended(command.args(["--cycles", "10"]), 0);
    let curve = Folder::new("reference_curve");
    let stop = stop_scene(&curve);
    let over = [
        "--over",
        "reduced_model.force_n=0.01:1:2",
        "--frequency",
        "0.19",
    ];
    ended(
        scene_command("curve", stop, &curve.join("out"), &[]).args(over),
        0,
    );
    let mut found = BTreeSet::new();
    for summary in [
        summary_of("run", "verification/patch", &[READY_PATCH]),
        summary_of("run", "pressure", &[SMALL, "response.points=2"]),
        summary_of("modes", "verification/column", &[]),
        summary_of("run", jenkins, &[]),
        summary_of("verify", jenkins, &[]),
        summary(&wear),
        summary(&curve.join("out")),
    ] {
        key_paths(&summary, "", &mut found);
    }
    // The two methods have the same figures.
    found.retain(|key| !key.contains(".integration."));
    let page = std::fs::read_to_string(root().join("docs/summary.md")).unwrap();
    let rows = page.lines().filter_map(|line| line.strip_prefix("| `"));
    let written: BTreeSet<String> = rows
        .flat_map(|row| row.split(" | ").next().unwrap().split(", "))
        .map(|key| key.trim_matches('`').to_owned())
        .collect();
    // An empty list and what is null have no keys of their own.
    let leads_to = |short: &str, long: &str| {
        long.strip_prefix(short)
            .is_some_and(|rest| rest.starts_with(['.', '[']))
    };
    let missing: Vec<&String> = found
        .difference(&written)
        .filter(|key| !written.iter().any(|w| leads_to(key, w)))
        .collect();
    assert!(missing.is_empty(), "not on the page: {missing:?}");
    let unknown: Vec<&String> = written
        .difference(&found)
        .filter(|key| !found.iter().any(|f| leads_to(key, f) || leads_to(f, key)))
        .filter(|key| !key.ends_with(".integration"))
        .collect();
    assert!(unknown.is_empty(), "on the page alone: {unknown:?}");
}
