//! Reads TOML text and `--set` arguments into the mirror of the file (for a scene: `RawScene`), and
//! reports every unknown key and wrong type.

use std::ops::Range;

use serde::de::DeserializeOwned;
use serde_spanned::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::error::{SceneFault, SceneProblem};
use super::keys::{SectionShape, Vocabulary};
use super::overrides;
use super::place::{PathStep, find, path_text, remove};
use super::source::SourceTexts;

/// Largest number of problems of one kind that are reported.
const MOST_PROBLEMS: usize = 20;

/// Parses the text, applies the `--set` arguments in their order and reads the result into the
/// mirror.
pub fn read<T: DeserializeOwned>(source: &SourceTexts) -> Result<T, Vec<SceneProblem>> {
    let (mut root, mut problems) = table(source)?;
    check_shapes(source, &mut root, &mut problems);
    let raw = deserialize(source, root, &mut problems);
    problems.sort_by_key(|p| p.span.start);
    match raw {
        Some(raw) if problems.is_empty() => Ok(raw),
        _ => Err(problems),
    }
}

/// Table of the text with the `--set` arguments applied in their order, and the problems of these.
///
/// # Errors
/// A text that is not TOML.
pub fn table<'s>(
    source: &'s SourceTexts,
) -> Result<(DeTable<'s>, Vec<SceneProblem>), Vec<SceneProblem>> {
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
    Ok((root, problems))
}

/// Finds the first syntax error of each line. Further errors on the same line are mostly
/// consequences. If [`MOST_PROBLEMS`] lines are not TOML, the file is of another kind, such as a
/// mesh, and the error of its first line suffices.
fn syntax_problems(source: &SourceTexts, errors: Vec<toml::de::Error>) -> Vec<SceneProblem> {
    let ends: Vec<usize> = source.text.match_indices('\n').map(|(at, _)| at).collect();
    let line = |at: usize| ends.partition_point(|end| *end < at);
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
        problems.push(source.problem(span, SceneFault::Syntax { message }));
        if problems.len() == MOST_PROBLEMS {
            problems.truncate(1);
            break;
        }
    }
    problems
}

/// Checks that sections are tables or lists of tables before serde reads them: serde would take a
/// list of the right length for a table.
fn check_shapes(source: &SourceTexts, root: &mut DeTable, problems: &mut Vec<SceneProblem>) {
    for section in source.vocabulary.sections {
        let (above, name) = section.place();
        let table = match (above, root.get_mut(above).map(Spanned::get_mut)) {
            ("", _) => &mut *root,
            (_, Some(DeValue::Table(table))) => table,
            _ => continue,
        };
        let Some(value) = table.get(name) else {
            continue;
        };
        let right = match (section.shape, value.get_ref()) {
            (SectionShape::Table, DeValue::Table(_)) => true,
            (SectionShape::List, DeValue::Array(items)) => {
                items.iter().all(|i| i.get_ref().is_table())
            }
            _ => false,
        };
        if !right {
            let fault = SceneFault::WrongShape {
                section: section.name,
                list: section.shape == SectionShape::List,
                example: section.example,
            };
            problems.push(source.problem(value.span(), fault));
            table.remove(name);
        }
    }
}

/// Reads the table into the mirror. serde stops at the first error: that key is reported and
/// removed, and the rest is read again.
fn deserialize<T: DeserializeOwned>(
    source: &SourceTexts,
    mut root: DeTable,
    problems: &mut Vec<SceneProblem>,
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
    place: &[PathStep],
    error: &toml::de::Error,
) -> SceneFault {
    let words: Vec<&str> = place
        .iter()
        .filter_map(|step| match step {
            PathStep::Key(key) => Some(key.as_str()),
            PathStep::Index(_) => None,
        })
        .collect();
    // The innermost section that the words lead into, and the word behind it.
    let named = |words: &[&str]| {
        let name = words.join(".");
        let mut names = vocabulary.sections.iter().map(|s| s.name);
        names.find(|s| *s == name)
    };
    let within = (0..words.len()).rev();
    let mut inner = within.filter_map(|many| Some((named(&words[..many])?, words[many])));
    let (section, key) = inner.next().unwrap_or(("", words.first().unwrap_or(&"")));
    let valid = vocabulary.keys_of(section);
    if valid.contains(&key) {
        SceneFault::WrongType {
            path: path_text(root, place),
            message: error
                .message()
                .trim_start_matches("invalid type: ")
                .to_owned(),
            example: vocabulary.example(section, key),
        }
    } else {
        SceneFault::UnknownKey {
            path: path_text(root, place),
            section,
            nearest: vocabulary.suggestion(section, key),
            valid: valid.iter().map(|k| (*k).to_owned()).collect(),
        }
    }
}
