//! The tables of keys in docs/scene.md and docs/study.md are those of the program. After a change of
//! a key, `UPDATE_DOCS=1 cargo test --test program reference::` writes the tables anew.

use std::path::Path;

use dovetail::reference::{scene_tables, study_tables};

const END: &str = "<!-- end -->";

/// The page with what stands between `<!-- keys: NAME -->` and `<!-- end -->` replaced.
fn with_tables(page: &str, tables: &[(&str, String)]) -> String {
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
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(page);
    let found = std::fs::read_to_string(&path).unwrap();
    assert_eq!(found.matches("<!-- keys: ").count(), tables.len(), "{page}");
    let expected = with_tables(&found, tables);
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
