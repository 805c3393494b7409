//! `--set KEY=VALUE` puts one value into the table of a scene before it is checked.
//!
//! KEY is a dotted path. An element of a list is named by its number or by its name; `*` means all
//! elements. VALUE is TOML, or else is taken as a text; without VALUE the key is removed. If keys
//! exclude each other, the key that is set displaces those of the file.

use std::ops::Range;

use serde_spanned::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{SceneFault, SceneProblem};
use super::keys;
use super::place::element_name;
use super::source::SourceTexts;

/// Groups of keys of a section, of which only one group may be given.
const ALTERNATIVES: [(&str, &[&[&str]]); 5] = [
    ("mesh", &[&["metres_per_unit"], &["units"]]),
    (
        "mesh",
        &[
            &["file"],
            &[
                "geometry",
                "parameters",
                "time_limit_s",
                "fallback",
                "fallback_parameters",
            ],
        ],
    ),
    (
        "damping",
        &[&["ratio", "linear_mode"], &["stiffness_s", "mass_per_s"]],
    ),
    (
        "response",
        &[
            &["frequency_hz"],
            &["times_first_linear_mode"],
            &["speed_rpm"],
        ],
    ),
    (
        "response",
        &[&["accuracy"], &["harmonics", "samples", "tolerance"]],
    ),
];

/// Largest number of steps of a path. A scene has no more than four (`body.jaw.fixed.0`), and
/// tables nested without limit would exceed the stack.
const MOST_STEPS: usize = 8;

/// Word of the path and its place.
#[derive(Debug, Clone)]
struct Segment<'i> {
    word: &'i str,
    span: Range<usize>,
}

/// Applies the `--set` argument number `index` to the table.
pub fn apply<'i>(
    source: &SourceTexts<'i>,
    index: usize,
    root: &mut DeTable<'i>,
) -> Result<(), Box<SceneProblem>> {
    let argument = source.overrides[index].as_str();
    let start = source.override_start(index);
    let syntax = || {
        let fault = SceneFault::OverrideSyntax {
            argument: argument.to_owned(),
        };
        Box::new(source.problem(start..start + argument.len(), fault))
    };
    let (key, value_text) = argument.split_once('=').ok_or_else(syntax)?;
    let path = segments(key, start);
    if path.iter().any(|s| s.word.is_empty()) {
        return Err(syntax());
    }
    if path.len() > MOST_STEPS {
        let fault = SceneFault::OverrideTooDeep { steps: path.len() };
        return Err(Box::new(source.problem(start..start + key.len(), fault)));
    }
    let value_text_start = key.len() + 1;
    let value = (!value_text.trim().is_empty()).then(|| {
        let lead = value_text.len() - value_text.trim_start().len();
        let from = start + value_text_start + lead;
        value_of(value_text.trim(), from..from + value_text.trim().len())
    });
    let Some((first, rest)) = path.split_first() else {
        return Err(syntax());
    };
    put_in_table(source, root, &mut Vec::new(), first, rest, value.as_ref())?;
    if value.is_some()
        && let [section, key] = path.as_slice()
    {
        displace_alternatives(source, root, section.word, key.word);
    }
    Ok(())
}

fn segments(key: &str, start: usize) -> Vec<Segment<'_>> {
    let mut position = start;
    let mut path = Vec::new();
    for part in key.split('.') {
        let word = part.trim();
        let from = position + (part.len() - part.trim_start().len());
        path.push(Segment {
            word,
            span: from..from + word.len(),
        });
        position += part.len() + 1;
    }
    path
}

/// Reads the text as TOML, or takes it as a string if it is not TOML. Everything in it gets the
/// span of the whole.
fn value_of<'i>(text: &'i str, span: Range<usize>) -> Spanned<DeValue<'i>> {
    match DeValue::parse(text) {
        Ok(value) => relocated(value.into_inner(), &span),
        Err(_) => Spanned::new(span, DeValue::String(text.into())),
    }
}

fn relocated<'i>(value: DeValue<'i>, span: &Range<usize>) -> Spanned<DeValue<'i>> {
    let value = match value {
        DeValue::Array(items) => {
            let items = items.into_iter();
            DeValue::Array(items.map(|i| relocated(i.into_inner(), span)).collect())
        }
        DeValue::Table(table) => {
            let moved = |(key, value): (Spanned<_>, Spanned<_>)| {
                let key = Spanned::new(span.clone(), key.into_inner());
                (key, relocated(value.into_inner(), span))
            };
            DeValue::Table(table.into_iter().map(moved).collect())
        }
        single => single,
    };
    Spanned::new(span.clone(), value)
}

fn put_in_table<'i>(
    source: &SourceTexts<'i>,
    table: &mut DeTable<'i>,
    above: &mut Vec<String>,
    segment: &Segment<'i>,
    rest: &[Segment<'i>],
    value: Option<&Spanned<DeValue<'i>>>,
) -> Result<(), Box<SceneProblem>> {
    let word = segment.word;
    above.push(word.to_owned());
    if let Some((next, rest)) = rest.split_first() {
        if !table.contains_key(word) && value.is_some() {
            let mut empty = Spanned::new(segment.span.clone(), DeValue::Table(DeTable::new()));
            if next.word == "0" {
                // The first element of a list.
                let list = DeValue::Array(std::iter::once(empty).collect());
                empty = Spanned::new(segment.span.clone(), list);
            }
            table.insert(Spanned::new(segment.span.clone(), word.into()), empty);
        }
        return match table.get_mut(word) {
            Some(inner) => set_value(source, inner, above, next, rest, value),
            None => Err(nothing_to_remove(source, above, segment)),
        };
    }
    match value {
        Some(value) => {
            // A new key object, so that errors about the key point at the argument.
            table.remove(word);
            let key = Spanned::new(segment.span.clone(), word.into());
            table.insert(key, value.clone());
            Ok(())
        }
        None => match table.remove(word) {
            Some(_) => Ok(()),
            None => Err(nothing_to_remove(source, above, segment)),
        },
    }
}

/// Takes one step into a value at the path `above`.
fn set_value<'i>(
    source: &SourceTexts<'i>,
    target: &mut Spanned<DeValue<'i>>,
    above: &mut Vec<String>,
    segment: &Segment<'i>,
    rest: &[Segment<'i>],
    value: Option<&Spanned<DeValue<'i>>>,
) -> Result<(), Box<SceneProblem>> {
    match target.get_mut() {
        DeValue::Table(table) => put_in_table(source, table, above, segment, rest, value),
        DeValue::Array(items) => {
            let chosen = elements(items, segment.word);
            if chosen.is_empty() {
                let fault = missing_element_fault(above.join("."), segment.word, items);
                return Err(Box::new(source.problem(segment.span.clone(), fault)));
            }
            let all = items.iter_mut().enumerate();
            let meant = all.filter(|(i, _)| chosen.contains(i));
            if let Some((next, rest)) = rest.split_first() {
                for (index, item) in meant {
                    let mut above = above.clone();
                    above.push(element_name(item).unwrap_or_else(|| index.to_string()));
                    set_value(source, item, &mut above, next, rest, value)?;
                }
            } else if let Some(value) = value {
                meant.for_each(|(_, item)| *item = value.clone());
            } else {
                let numbered = items.iter().enumerate();
                let kept = numbered.filter(|(i, _)| !chosen.contains(i));
                *items = kept.map(|(_, item)| item.clone()).collect();
            }
            Ok(())
        }
        _ => {
            let fault = SceneFault::OverrideNotATable {
                path: above.join("."),
                segment: segment.word.to_owned(),
            };
            Err(Box::new(source.problem(segment.span.clone(), fault)))
        }
    }
}

/// Values at a dotted path, which is written as for `--set`: none where nothing is set there, and
/// several where it has a `*`.
///
/// # Errors
/// A list without the element that is named, a single value that is taken for a table.
pub fn values_at<'t>(
    source: &SourceTexts<'_>,
    root: &'t DeTable<'t>,
    key: &str,
) -> Result<Vec<&'t DeValue<'t>>, Box<SceneProblem>> {
    let problem = |fault| Box::new(source.problem(source.text.len()..source.text.len(), fault));
    let path = segments(key, 0);
    let Some((first, rest)) = path.split_first() else {
        return Ok(Vec::new());
    };
    let mut above = vec![first.word.to_owned()];
    let mut values: Vec<&DeValue<'_>> = root
        .get(first.word)
        .into_iter()
        .map(Spanned::get_ref)
        .collect();
    for Segment { word, .. } in rest {
        let mut inner = Vec::new();
        for value in values {
            match value {
                DeValue::Table(table) => inner.extend(table.get(*word).map(Spanned::get_ref)),
                DeValue::Array(items) => {
                    let chosen = elements(items, word);
                    if chosen.is_empty() {
                        return Err(problem(missing_element_fault(above.join("."), word, items)));
                    }
                    inner.extend(chosen.into_iter().map(|index| items[index].get_ref()));
                }
                _ => {
                    return Err(problem(SceneFault::OverrideNotATable {
                        path: above.join("."),
                        segment: (*word).to_owned(),
                    }));
                }
            }
        }
        above.push((*word).to_owned());
        values = inner;
    }
    Ok(values)
}

/// Fault of a list that has no such element.
fn missing_element_fault(path: String, word: &str, items: &[Spanned<DeValue<'_>>]) -> SceneFault {
    let names = element_names(items);
    SceneFault::OverrideNoElement {
        path,
        segment: word.to_owned(),
        nearest: keys::nearest(word, &names),
        elements: names,
    }
}

/// Indices of the elements meant by `*`, a name or a number.
fn elements(items: &[Spanned<DeValue>], word: &str) -> Vec<usize> {
    if word == "*" {
        return (0..items.len()).collect();
    }
    let named: Vec<usize> = (0..items.len())
        .filter(|&i| element_name(&items[i]).as_deref() == Some(word))
        .collect();
    if !named.is_empty() {
        return named;
    }
    let number = word.parse().ok();
    number.into_iter().filter(|i| *i < items.len()).collect()
}

fn element_names(items: &[Spanned<DeValue>]) -> Vec<String> {
    let named = items.iter().enumerate();
    named
        .map(|(i, item)| element_name(item).unwrap_or_else(|| i.to_string()))
        .collect()
}

fn nothing_to_remove(
    source: &SourceTexts,
    above: &[String],
    segment: &Segment,
) -> Box<SceneProblem> {
    let fault = SceneFault::OverrideNothingToRemove {
        path: above.join("."),
    };
    Box::new(source.problem(segment.span.clone(), fault))
}

/// Removes the keys that `section.key` excludes, if the file (not another argument) has set them.
fn displace_alternatives(source: &SourceTexts, root: &mut DeTable, section: &str, key: &str) {
    let Some(DeValue::Table(table)) = root.get_mut(section).map(|v| v.get_mut()) else {
        return;
    };
    // A key that belongs to no group excludes nothing.
    let choices = ALTERNATIVES
        .iter()
        .filter(|(s, groups)| *s == section && groups.iter().any(|g| g.contains(&key)));
    let others = choices.flat_map(|(_, groups)| groups.iter().filter(|g| !g.contains(&key)));
    for other in others.copied().flatten() {
        let given = table.get(*other);
        if given.is_some_and(|v| source.is_in_file(&v.span())) {
            table.remove(*other);
        }
    }
}
