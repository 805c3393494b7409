//! Places in the text of a scene that an error of the model is about, which shows only with the mesh.

use std::ops::Range;

use serde_spanned::Spanned;
use toml::de::{DeTable, DeValue};

use super::document;
use super::error::{SceneFault, SceneProblem};
use super::keys::nearest;
use super::place::element_name;
use super::source_of;
use dovetail_solver::model::ErrorSubject;

/// Section of a scene for each kind of item that an error of the model names.
const SECTIONS: [(&str, &str); 9] = [
    ("body", "body"),
    ("contact", "contact"),
    ("spring", "spring"),
    ("dashpot", "dashpot"),
    ("load", "load"),
    ("excitation", "excitation"),
    ("observation", "observe"),
    ("[cyclic]", "cyclic"),
    ("rotation", "rotation"),
];

/// Name of a group or body that was most likely meant by one that does not exist.
pub fn suggestion(subject: &ErrorSubject<'_>) -> Option<String> {
    let name = subject.name?;
    let of_body = format!(".{name}");
    let qualified = subject
        .available
        .iter()
        .find(|known| known.ends_with(&of_body));
    qualified
        .cloned()
        .or_else(|| nearest(name, subject.available))
}

/// Place of the subject of an error in the text of a scene or in its `overrides`, labelled; `None` if
/// it is not found there.
pub fn place(
    text: &str,
    file_name: &str,
    overrides: &[String],
    subject: &ErrorSubject<'_>,
) -> Option<SceneProblem> {
    let source = source_of(text, file_name, overrides);
    let (root, _) = document::table(&source).ok()?;
    let span = span_of(&root, subject)?;
    let label = match (suggestion(subject), subject.name) {
        (Some(meant), _) => format!("did you mean `{meant}`?"),
        (None, Some(_)) if !subject.available.is_empty() => "not in the mesh".to_owned(),
        _ => "here".to_owned(),
    };
    Some(source.problem(
        span,
        SceneFault::particular(String::new(), label, String::new()),
    ))
}

/// Place of the name in its item, or of the item.
fn span_of(root: &DeTable<'_>, subject: &ErrorSubject<'_>) -> Option<Range<usize>> {
    let item = subject.item.as_str();
    let (word, section) = SECTIONS.iter().find(|(word, _)| item.starts_with(word))?;
    let named = item.split('`').nth(1);
    let number = item[word.len()..].trim().parse::<usize>().ok();
    let value = root.get(*section)?;
    let item = match value.get_ref() {
        DeValue::Array(items) => {
            let is_it = |(i, item): &(usize, &Spanned<DeValue<'_>>)| match (named, number) {
                (Some(name), _) => element_name(item).as_deref() == Some(name),
                (None, Some(number)) => i + 1 == number,
                (None, None) => false,
            };
            items.iter().enumerate().find(is_it)?.1
        }
        _ => value,
    };
    let of_name = subject.name.and_then(|name| text_in(item, name));
    Some(of_name.unwrap_or_else(|| item.span()))
}

/// Place of a text inside of a value.
fn text_in(value: &Spanned<DeValue<'_>>, text: &str) -> Option<Range<usize>> {
    match value.get_ref() {
        DeValue::String(own) if own == text => Some(value.span()),
        DeValue::Array(items) => items.iter().find_map(|item| text_in(item, text)),
        DeValue::Table(table) => {
            let others = table.iter().filter(|(key, _)| key.get_ref() != "name");
            others
                .filter_map(|(_, item)| text_in(item, text))
                .min_by_key(|span| span.start)
        }
        _ => None,
    }
}
