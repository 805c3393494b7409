//! Places inside the table of a file: they are found by the span of an error, removed, and named
//! for a reader.

use std::ops::Range;

use serde_spanned::Spanned;
use toml::de::{DeTable, DeValue};

/// Step from a table or list to an item in it.
#[derive(Debug, Clone, PartialEq)]
pub enum PathStep {
    Key(String),
    Index(usize),
}

/// Path to the innermost key or value meant by the span of an error; empty if there is none.
pub fn find(root: &DeTable, span: &Range<usize>) -> Vec<PathStep> {
    let mut best: (usize, Vec<PathStep>) = (usize::MAX, Vec::new());
    let mut way = Vec::new();
    search_table(root, span, &mut way, &mut best);
    best.1
}

fn search_table(
    table: &DeTable,
    span: &Range<usize>,
    way: &mut Vec<PathStep>,
    best: &mut (usize, Vec<PathStep>),
) {
    for (key, value) in table {
        way.push(PathStep::Key(key.get_ref().to_string()));
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
    way: &mut Vec<PathStep>,
    best: &mut (usize, Vec<PathStep>),
) {
    let value_span = value.span();
    if value_span.start <= span.start && span.end <= value_span.end {
        offer(way, value_span.len(), best);
    }
    match value.get_ref() {
        DeValue::Table(table) => search_table(table, span, way, best),
        DeValue::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                way.push(PathStep::Index(index));
                search_value(item, span, way, best);
                way.pop();
            }
        }
        _ => {}
    }
}

/// Keeps the smaller place; among equal places the deeper.
fn offer(way: &[PathStep], length: usize, best: &mut (usize, Vec<PathStep>)) {
    if length < best.0 || (length == best.0 && way.len() > best.1.len()) {
        *best = (length, way.to_vec());
    }
}

/// Removes the innermost table entry on the path `place`.
pub fn remove(root: &mut DeTable, place: &[PathStep]) -> bool {
    let Some(last_key) = place.iter().rposition(|s| matches!(s, PathStep::Key(_))) else {
        return false;
    };
    let PathStep::Key(key) = &place[last_key] else {
        return false;
    };
    let Some((first, rest)) = place[..last_key].split_first() else {
        return root.remove(key.as_str()).is_some();
    };
    let PathStep::Key(first) = first else {
        return false;
    };
    let Some(mut value) = root.get_mut(first.as_str()) else {
        return false;
    };
    for step in rest {
        let next = match (step, value.get_mut()) {
            (PathStep::Key(key), DeValue::Table(table)) => table.get_mut(key.as_str()),
            (PathStep::Index(index), DeValue::Array(items)) => items.get_mut(*index),
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

/// Path as a text, such as `contact.left.friction`: elements of a list are named by their name if
/// they have one.
pub fn path_text(root: &DeTable, place: &[PathStep]) -> String {
    let mut words = Vec::new();
    let mut value = None;
    for step in place {
        match step {
            PathStep::Key(key) => {
                words.push(key.clone());
                value = match value.map(|v: &Spanned<DeValue>| v.get_ref()) {
                    None => root.get(key.as_str()),
                    Some(DeValue::Table(table)) => table.get(key.as_str()),
                    Some(_) => None,
                };
            }
            PathStep::Index(index) => {
                value = match value.map(|v| v.get_ref()) {
                    Some(DeValue::Array(items)) => items.get(*index),
                    _ => None,
                };
                let name = value.and_then(element_name);
                words.push(name.unwrap_or_else(|| index.to_string()));
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
