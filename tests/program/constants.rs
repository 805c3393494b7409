//! The page docs/constants.md has the numbers that tune the harmonic balance, each with its reason,
//! from the comments beside them. After a change of one,
//!
//!     UPDATE_DOCS=1 cargo test --test program constants::
//!
//! writes the page anew.

use std::fmt::Write;
use std::path::Path;

use crate::shared_folder::files_below;
use dovetail_testkit::folder::root;

/// Folder of the harmonic balance.
const FOLDER: &str = "crates/dynamics/src/dlft";
/// Most constants. Remove one for each that you add.
const MOST: usize = 170;

const HEAD: &str = "# Constants of the harmonic balance

The harmonic balance has these numbers, which no key of a scene changes. The reason is the comment
in the source. `UPDATE_DOCS=1 cargo test --test program constants::` writes this page.

| file | constant | value | reason |
| --- | --- | --- | --- |
";

struct Constant {
    file: String,
    name: String,
    value: String,
    reason: String,
}

/// Constants of a file outside its tests. One without a comment shares that of the constant on the
/// line before it.
fn constants_of(file: &Path) -> Vec<Constant> {
    let text = std::fs::read_to_string(file).unwrap();
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    let name_of_file = file.strip_prefix(root().join(FOLDER)).unwrap();
    let (mut found, mut reason, mut is_beside) = (Vec::<Constant>::new(), String::new(), false);
    let mut lines = code.lines().map(str::trim);
    while let Some(line) = lines.next() {
        if let Some(comment) = line.strip_prefix("///") {
            if is_beside {
                (reason, is_beside) = (String::new(), false);
            }
            let _ = write!(reason, "{comment}");
            continue;
        }
        let item = line
            .strip_prefix("pub(crate) ")
            .or(line.strip_prefix("pub(super) "));
        let item = item.or(line.strip_prefix("pub ")).unwrap_or(line);
        let declared = item
            .strip_prefix("const ")
            .and_then(|rest| rest.split_once(": "));
        let Some((name, rest)) = declared.filter(|(name, _)| name.chars().all(is_of_constant))
        else {
            (reason, is_beside) = (String::new(), false);
            continue;
        };
        let mut rest = rest.to_owned();
        while !rest.ends_with(';') {
            rest += lines.next().unwrap();
        }
        let Some((kind, value)) = rest.trim_end_matches(';').split_once(" = ") else {
            continue;
        };
        if is_number(kind) {
            found.push(Constant {
                file: name_of_file.to_string_lossy().replace('\\', "/"),
                name: name.to_owned(),
                value: value.to_owned(),
                reason: reason.trim().to_owned(),
            });
        }
        is_beside = true;
    }
    found
}

fn is_of_constant(c: char) -> bool {
    c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_'
}

fn is_number(kind: &str) -> bool {
    let number = kind.trim_start_matches('[').split(';').next().unwrap();
    ["f64", "f32", "usize", "u32", "u64", "i32"].contains(&number)
}

/// Comment without links, on one line.
fn plain(comment: &str) -> String {
    let words = comment.split_whitespace().collect::<Vec<_>>().join(" ");
    words
        .replace("[`", "`")
        .replace("`]", "`")
        .replace('|', "\\|")
}

#[test]
fn the_page_of_constants_has_each_with_its_reason() {
    let mut files = files_below(&root().join(FOLDER));
    files.retain(|file| {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let is_test = ["tests.rs", "jacobians.rs", "made_up.rs", "of_a_mass.rs"];
        name.ends_with(".rs") && !is_test.contains(&name.as_str())
    });
    files.sort();
    let constants: Vec<Constant> = files.iter().flat_map(|file| constants_of(file)).collect();
    let bare: Vec<&str> = (constants.iter())
        .filter(|constant| constant.reason.len() < 10)
        .map(|constant| constant.name.as_str())
        .collect();
    assert!(bare.is_empty(), "without a reason: {bare:?}");
    assert_eq!(constants.len(), MOST, "MOST of tests/program/constants.rs");
    let mut page = HEAD.to_owned();
    for Constant {
        file,
        name,
        value,
        reason,
    } in &constants
    {
        let _ = writeln!(page, "| {file} | `{name}` | {value} | {} |", plain(reason));
    }
    let path = root().join("docs/constants.md");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        written == page,
        "docs/constants.md is out of date: UPDATE_DOCS=1 cargo test --test program constants:: writes it"
    );
}
