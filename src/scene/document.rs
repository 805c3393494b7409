//! TOML text and `--set` arguments -> the mirror of the file (of a scene: `RawScene`), with every
//! unknown key and wrong type reported.

use std::ops::Range;

use serde::de::DeserializeOwned;
use serde_spanned::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::error::{Fault, Problem};
use super::keys::{self, Shape, Vocabulary};
use super::overrides;
use super::source::Source;

/// No more than this many problems of one kind are looked for.
const MOST_PROBLEMS: usize = 20;

/// Parses the text, applies the `--set` arguments in their order and reads the result into the mirror.
pub fn read<T: DeserializeOwned>(source: &Source) -> Result<T, Vec<Problem>> {
    let (document, errors) = DeTable::parse_recoverable(&source.text);
    if !errors.is_empty() {
        return Err(syntax_problems(source, errors));
    }
    let mut root = document.into_inner();
    let mut problems = Vec::new();
    for index in 0..source.overrides.len() {
        if let Err(problem) = overrides::apply(source, index, &mut root) {
            problems.push(*problem);
        }
    }
    check_shapes(source, &mut root, &mut problems);
    let raw = deserialize(source, root, &mut problems);
    problems.sort_by_key(|p| p.span.start);
    match raw {
        Some(raw) if problems.is_empty() => Ok(raw),
        _ => Err(problems),
    }
}

/// The first syntax error of each line: what follows on it is mostly a consequence.
fn syntax_problems(source: &Source, errors: Vec<toml::de::Error>) -> Vec<Problem> {
    let line = |at: usize| source.text.bytes().take(at).filter(|b| *b == b'\n').count();
    let mut lines = Vec::new();
    let mut problems = Vec::new();
    for error in errors {
        let span = error.span().unwrap_or(0..0);
        let line = line(span.start);
        if lines.contains(&line) {
            continue;
        }
        lines.push(line);
        let message = error.message().to_owned();
        problems.push(source.problem(span, Fault::Syntax { message }));
        if problems.len() == MOST_PROBLEMS {
            break;
        }
    }
    problems
}

/// Sections must be tables or lists of tables before serde sees them: it would take a list of the
/// right length for a table.
fn check_shapes(source: &Source, root: &mut DeTable, problems: &mut Vec<Problem>) {
    for &(section, shape) in source.vocabulary.sections {
        let Some(value) = root.get(section) else {
            continue;
        };
        let right = match (shape, value.get_ref()) {
            (Shape::Table, DeValue::Table(_)) => true,
            (Shape::List, DeValue::Array(items)) => items.iter().all(|i| i.get_ref().is_table()),
            _ => false,
        };
        if !right {
            let fault = Fault::WrongShape {
                section,
                list: shape == Shape::List,
                example: (source.vocabulary.example)("", section),
            };
            problems.push(source.problem(value.span(), fault));
            root.remove(section);
        }
    }
}

/// Reads the table into the mirror. serde stops at the first error: that key is reported, taken out,
/// and the rest is read again.
fn deserialize<T: DeserializeOwned>(
    source: &Source,
    mut root: DeTable,
    problems: &mut Vec<Problem>,
) -> Option<T> {
    let mut seen: Vec<Range<usize>> = Vec::new();
    for _ in 0..MOST_PROBLEMS {
        let error = match T::deserialize(Deserializer::from(Spanned::new(0..0, root.clone()))) {
            Ok(raw) => return Some(raw),
            Err(error) => error,
        };
        let span = error.span().unwrap_or(0..0);
        let place = find(&root, &span);
        // An argument for several elements (`contact.*.friction`) is reported once.
        if !seen.contains(&span) {
            let fault = fault_of(source.vocabulary, &root, &place, &error);
            problems.push(source.problem(span.clone(), fault));
            seen.push(span);
        }
        if place.is_empty() || !remove(&mut root, &place) {
            return None;
        }
    }
    None
}

fn fault_of(
    vocabulary: &Vocabulary,
    root: &DeTable,
    place: &[Step],
    error: &toml::de::Error,
) -> Fault {
    let words: Vec<&str> = place
        .iter()
        .filter_map(|step| match step {
            Step::Key(key) => Some(key.as_str()),
            Step::Index(_) => None,
        })
        .collect();
    let (section, key) = match words.as_slice() {
        [] => ("", ""),
        [key] => ("", *key),
        [section, key, ..] => (*section, *key),
    };
    let section = vocabulary
        .sections
        .iter()
        .map(|(s, _)| *s)
        .find(|s| *s == section)
        .unwrap_or("");
    let valid = (vocabulary.of_section)(section);
    if valid.contains(&key) {
        Fault::WrongType {
            path: path_text(root, place),
            message: error
                .message()
                .trim_start_matches("invalid type: ")
                .to_owned(),
            example: (vocabulary.example)(section, key),
        }
    } else {
        Fault::UnknownKey {
            path: path_text(root, place),
            section,
            nearest: keys::nearest(key, valid),
            valid: valid.iter().map(|k| (*k).to_owned()).collect(),
        }
    }
}

/// One step from a table or list to something in it.
#[derive(Debug, Clone, PartialEq)]
enum Step {
    Key(String),
    Index(usize),
}

/// The way to the innermost key or value an error span means; empty when there is none.
fn find(root: &DeTable, span: &Range<usize>) -> Vec<Step> {
    let mut best: (usize, Vec<Step>) = (usize::MAX, Vec::new());
    let mut way = Vec::new();
    search_table(root, span, &mut way, &mut best);
    best.1
}

fn search_table(
    table: &DeTable,
    span: &Range<usize>,
    way: &mut Vec<Step>,
    best: &mut (usize, Vec<Step>),
) {
    for (key, value) in table {
        way.push(Step::Key(key.get_ref().to_string()));
        // A key counts only when it is meant exactly: an error about a value never has its span.
        if key.span() == *span {
            offer(way, span.len(), best);
        }
        search_value(value, span, way, best);
        way.pop();
    }
}

fn search_value(
    value: &Spanned<DeValue>,
    span: &Range<usize>,
    way: &mut Vec<Step>,
    best: &mut (usize, Vec<Step>),
) {
    let own = value.span();
    if own.start <= span.start && span.end <= own.end {
        offer(way, own.len(), best);
    }
    match value.get_ref() {
        DeValue::Table(table) => search_table(table, span, way, best),
        DeValue::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                way.push(Step::Index(index));
                search_value(item, span, way, best);
                way.pop();
            }
        }
        _ => {}
    }
}

/// Keeps the smaller place; of equal ones the deeper.
fn offer(way: &[Step], length: usize, best: &mut (usize, Vec<Step>)) {
    if length < best.0 || (length == best.0 && way.len() > best.1.len()) {
        *best = (length, way.to_vec());
    }
}

/// Takes out the innermost table entry on the way to `place`.
fn remove(root: &mut DeTable, place: &[Step]) -> bool {
    let Some(last_key) = place.iter().rposition(|s| matches!(s, Step::Key(_))) else {
        return false;
    };
    let Step::Key(key) = &place[last_key] else {
        return false;
    };
    let Some((first, rest)) = place[..last_key].split_first() else {
        return root.remove(key.as_str()).is_some();
    };
    let Step::Key(first) = first else {
        return false;
    };
    let Some(mut value) = root.get_mut(first.as_str()) else {
        return false;
    };
    for step in rest {
        let next = match (step, value.get_mut()) {
            (Step::Key(key), DeValue::Table(table)) => table.get_mut(key.as_str()),
            (Step::Index(index), DeValue::Array(items)) => items.get_mut(*index),
            _ => None,
        };
        match next {
            Some(next) => value = next,
            None => return false,
        }
    }
    match value.get_mut() {
        DeValue::Table(table) => table.remove(key.as_str()).is_some(),
        _ => false,
    }
}

/// `contact.left.friction`: elements of a list by their name where they have one.
fn path_text(root: &DeTable, place: &[Step]) -> String {
    let mut words = Vec::new();
    let mut value = None;
    for step in place {
        match step {
            Step::Key(key) => {
                words.push(key.clone());
                value = match value.map(|v: &Spanned<DeValue>| v.get_ref()) {
                    None => root.get(key.as_str()),
                    Some(DeValue::Table(table)) => table.get(key.as_str()),
                    Some(_) => None,
                };
            }
            Step::Index(index) => {
                value = match value.map(|v| v.get_ref()) {
                    Some(DeValue::Array(items)) => items.get(*index),
                    _ => None,
                };
                words.push(
                    value
                        .and_then(element_name)
                        .unwrap_or_else(|| index.to_string()),
                );
            }
        }
    }
    words.join(".")
}

/// The `name` of a table in a list, if it has one.
pub fn element_name(element: &Spanned<DeValue>) -> Option<String> {
    let DeValue::Table(table) = element.get_ref() else {
        return None;
    };
    table.get("name")?.get_ref().as_str().map(str::to_owned)
}
