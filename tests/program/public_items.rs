//! Snapshot of the public interface of the three library packages. A commit that changes the
//! interface also changes the snapshot, `public_items.txt` of each package:
//!
//!     UPDATE_DOCS=1 cargo test --test program public_items::
//!
//! The list is read from the source. The packages switch on rustc's lint `unreachable_pub`, which
//! warns of a `pub` that cannot be reached from outside.

use std::fmt::Write;
use std::path::Path;

use crate::shared_folder::files_below;
use dovetail_testkit::folder::root;

/// Largest number of public items of a package: functions, types, traits, constants and modules,
/// without fields, variants and re-exports.
const MOST: [(&str, usize); 3] = [("dynamics", 350), ("structure", 222), ("solver", 266)];

/// Words that begin a public item.
const ITEMS: [&str; 10] = [
    "fn",
    "const fn",
    "unsafe fn",
    "struct",
    "enum",
    "trait",
    "type",
    "const",
    "static",
    "mod",
];

/// Public items of a file, each on one line, with the fields of public structs and the variants of
/// public enums.
fn items_of(text: &str) -> Vec<String> {
    let mut items = Vec::new();
    let mut lines = text.lines().peekable();
    let mut inside_public = false;
    while let Some(line) = lines.next() {
        let (start, indent) = (line.trim_start(), line.len() - line.trim_start().len());
        if start == "#[cfg(test)]" && lines.peek().is_some_and(|next| next.ends_with('{')) {
            // Tests and their helpers.
            let end = format!("{}}}", " ".repeat(indent));
            lines.by_ref().find(|line| *line == end);
            continue;
        }
        if line.starts_with("impl") || line.starts_with('}') {
            inside_public = false;
        }
        let is_variant = inside_public
            && indent == 4
            && start.starts_with(|c: char| c.is_ascii_uppercase())
            && !start.starts_with("Self");
        let Some(rest) = start.strip_prefix("pub ") else {
            if line.starts_with("impl") {
                items.push(line.trim_end_matches(['{', ' ', '}']).to_owned());
            } else if is_variant {
                items.push(format!("    {}", start.trim_end_matches([',', '{', ' '])));
            }
            continue;
        };
        let begins = indent == 0 && (rest.starts_with("struct") || rest.starts_with("enum"));
        if begins {
            inside_public = line.ends_with('{');
        }
        if !is_item(rest) && !rest.starts_with("use ") && !inside_public {
            // A field of a struct that is not public.
            continue;
        }
        // A head may have several lines.
        let mut head = start.to_owned();
        while !head.ends_with(['{', ';', ',', '}']) || is_open(&head) {
            let Some(next) = lines.next() else { break };
            let _ = write!(head, " {}", next.trim());
        }
        let head = head.trim_end_matches([';', ',', '{', ' ']);
        items.push(format!("{}{head}", if indent > 0 { "    " } else { "" }));
    }
    // Implementations without a public item say nothing.
    let is_empty = |i: usize| {
        items[i].starts_with("impl") && items.get(i + 1).is_none_or(|next| !next.starts_with(' '))
    };
    let kept = (0..items.len()).filter(|i| !is_empty(*i));
    kept.map(|i| items[i].clone()).collect()
}

/// Returns `true` if the words after `pub` begin an item and no re-export or field.
fn is_item(rest: &str) -> bool {
    let words = ITEMS.iter();
    let mut after = words.filter_map(|word| rest.strip_prefix(word));
    after.any(|after| after.starts_with(' '))
}

/// Returns `true` if a bracket of a head is still open, apart from the brace that begins its body.
fn is_open(head: &str) -> bool {
    let count = |c: char| head.matches(c).count();
    let is_use = head.starts_with("pub use");
    count('(') > count(')') || is_use && count('{') > count('}')
}

/// The list of a package, and the number of its items.
fn list(package: &str) -> (String, usize) {
    let source = root().join("crates").join(package).join("src");
    let mut files = files_below(&source);
    files.sort();
    let (mut list, mut count) = (String::new(), 0);
    for file in files.iter().filter(|file| is_library(file)) {
        let items = items_of(&std::fs::read_to_string(file).unwrap());
        if items.is_empty() {
            continue;
        }
        let name = file.strip_prefix(&source).unwrap().display();
        let _ = writeln!(list, "# {name}");
        for item in items {
            let word = item.trim_start().strip_prefix("pub ").unwrap_or_default();
            count += usize::from(is_item(word));
            let _ = writeln!(list, "{item}");
        }
    }
    (list, count)
}

fn is_library(file: &Path) -> bool {
    let is_rust = file.extension().is_some_and(|extension| extension == "rs");
    is_rust && !file.components().any(|part| part.as_os_str() == "tests")
}

#[test]
fn the_public_interface_is_the_listed_one_and_no_larger() {
    let mut wrong = Vec::new();
    for (package, most) in MOST {
        let (list, count) = list(package);
        let path = root().join("crates").join(package).join("public_items.txt");
        if std::env::var_os("UPDATE_DOCS").is_some() {
            std::fs::write(&path, &list).unwrap();
        }
        let listed = std::fs::read_to_string(&path).unwrap_or_default();
        if count > most {
            wrong.push(format!(
                "{package} has {count} public items, at most {most} are wanted"
            ));
        }
        for line in list
            .lines()
            .filter(|line| !listed.lines().any(|l| l == *line))
        {
            wrong.push(format!("{package}: new, or changed: {line}"));
        }
        for line in listed
            .lines()
            .filter(|line| !list.lines().any(|l| l == *line))
        {
            wrong.push(format!("{package}: no longer there: {line}"));
        }
        if list != listed && wrong.is_empty() {
            wrong.push(format!("{package}: items have another order"));
        }
    }
    assert!(
        wrong.is_empty(),
        "{}\nUPDATE_DOCS=1 cargo test --test program public_items:: writes the lists",
        wrong.join("\n")
    );
}

#[test]
fn an_item_is_listed_with_its_whole_head() {
    let text = "/// Doc.\npub struct Open {\n    /// Field.\n    pub field_m: f64,\n}\n\
                struct Closed {\n    pub field: f64,\n}\nimpl Open {\n    pub fn long(\n        a: f64,\n    ) -> f64 {\n\
                \x20       a\n    }\n    fn own() {}\n}\nimpl Closed {\n    fn own() {}\n}\npub enum Kind {\n    One,\n    Two {\n        a: f64,\n    },\n}\n\
                pub use other::{\n    A,\n};\n#[cfg(test)]\nmod tests {\n    pub fn f() {}\n}\n";
    assert_eq!(
        items_of(text),
        [
            "pub struct Open",
            "    pub field_m: f64",
            "impl Open",
            "    pub fn long( a: f64, ) -> f64",
            "pub enum Kind",
            "    One",
            "    Two",
            "pub use other::{ A, }",
        ]
    );
}
