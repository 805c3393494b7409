//! Values of a TOML table with their places; what is wrong is noted, not thrown.

use std::ops::Range;
use std::sync::Arc;

use miette::NamedSource;
use serde_spanned::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{StudyFault, StudyProblem};
use crate::scene::nearest;

/// The text of a study and the problems found in it so far.
pub struct Reader<'a> {
    pub name: &'a str,
    pub text: &'a Arc<str>,
    pub problems: Vec<StudyProblem>,
}

/// A table of the file: its path for messages, its keys and its place.
pub struct Section<'t, 'a> {
    pub path: String,
    pub table: &'t DeTable<'a>,
    pub span: Range<usize>,
}

impl<'t, 'a> Section<'t, 'a> {
    pub fn key(&self, key: &str) -> String {
        if self.path.is_empty() {
            key.to_owned()
        } else {
            format!("{}.{key}", self.path)
        }
    }

    pub fn get(&self, key: &str) -> Option<&'t Spanned<DeValue<'a>>> {
        self.table.get(key)
    }
}

impl Reader<'_> {
    pub fn fault(&mut self, span: Range<usize>, fault: StudyFault) {
        let end = span.end.min(self.text.len());
        self.problems.push(StudyProblem {
            fault,
            source_text: NamedSource::new(self.name, Arc::clone(self.text)).with_language("TOML"),
            span: span.start.min(end)..end,
        });
    }

    /// Reports every key of the table that is not `valid`.
    pub fn only(
        &mut self,
        section: &Section,
        called: &'static str,
        valid: &'static [&'static str],
    ) {
        for (key, _) in section.table {
            let word = key.get_ref().as_ref();
            if !valid.contains(&word) {
                let fault = StudyFault::UnknownKey {
                    path: section.key(word),
                    table: called,
                    valid,
                    nearest: nearest(word, valid),
                };
                self.fault(key.span(), fault);
            }
        }
    }

    pub fn missing(&mut self, section: &Section, key: &'static str, example: &'static str) {
        let path = section.key(key);
        // A long table is shown by its first line.
        let start = section.span.start.min(self.text.len());
        let line = self.text[start..].find('\n').unwrap_or(0);
        self.fault(
            start..start + line,
            StudyFault::MissingKey { path, example },
        );
    }

    pub fn wrong_type(
        &mut self,
        path: String,
        span: Range<usize>,
        expected: &'static str,
        example: &'static str,
    ) {
        let fault = StudyFault::WrongType {
            path,
            expected,
            example,
        };
        self.fault(span, fault);
    }

    /// A text, where the key is there.
    pub fn text(
        &mut self,
        section: &Section,
        key: &'static str,
        example: &'static str,
    ) -> Option<Spanned<String>> {
        let value = section.get(key)?;
        match value.get_ref().as_str() {
            Some(text) => Some(Spanned::new(value.span(), text.to_owned())),
            None => {
                self.wrong_type(section.key(key), value.span(), "a text", example);
                None
            }
        }
    }

    /// A list, where the key is there.
    pub fn list<'t, 'a>(
        &mut self,
        section: &Section<'t, 'a>,
        key: &'static str,
        example: &'static str,
    ) -> Option<&'t [Spanned<DeValue<'a>>]> {
        let value = section.get(key)?;
        match value.get_ref() {
            DeValue::Array(items) => Some(items),
            _ => {
                self.wrong_type(section.key(key), value.span(), "a list", example);
                None
            }
        }
    }

    /// Tables written `[[key]]`.
    pub fn tables<'t, 'a>(
        &mut self,
        section: &Section<'t, 'a>,
        key: &'static str,
        example: &'static str,
    ) -> Vec<Section<'t, 'a>> {
        let items = self.list(section, key, example).unwrap_or(&[]);
        let mut tables = Vec::new();
        for (index, item) in items.iter().enumerate() {
            let path = section.key(&format!("{key}.{index}"));
            match item.get_ref() {
                DeValue::Table(table) => tables.push(Section {
                    path,
                    table,
                    span: item.span(),
                }),
                _ => self.wrong_type(path, item.span(), "a table", example),
            }
        }
        tables
    }

    /// A name fit for file names and column headings.
    pub fn name(&mut self, path: String, name: &Spanned<String>) -> Option<String> {
        let text = name.get_ref();
        let fit = text.starts_with(|c: char| c.is_ascii_alphabetic())
            && text
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
            && text.len() <= 100;
        if !fit {
            let fault = StudyFault::BadName {
                path,
                name: text.clone(),
            };
            self.fault(name.span(), fault);
        }
        fit.then(|| text.clone())
    }

    /// A number above 0.
    pub fn positive(
        &mut self,
        path: String,
        value: &Spanned<DeValue>,
        example: &'static str,
    ) -> Option<f64> {
        match number(value.get_ref()) {
            Some(v) if v > 0.0 && v.is_finite() => Some(v),
            Some(v) => {
                let fault = StudyFault::OutOfRange {
                    path,
                    value: v.to_string(),
                    limits: "above 0",
                };
                self.fault(value.span(), fault);
                None
            }
            None => {
                self.wrong_type(path, value.span(), "a number", example);
                None
            }
        }
    }
}

/// A TOML number as f64.
pub fn number(value: &DeValue) -> Option<f64> {
    match value {
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
            .ok()
            .map(|v| v as f64),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}
