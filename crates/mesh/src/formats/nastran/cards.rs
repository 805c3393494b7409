//! Cards of bulk data: lines in small, large and free field, joined with their continuations.

use std::borrow::Cow;
use std::ops::Range;

use super::super::source::{LinePosition, label, number};
use crate::MeshError;

/// Width of a field in small field format, and of the name and the mark of every format.
const SMALL: usize = 8;
/// Width of a field in large field format.
const LARGE: usize = 16;
/// Fields of a line in small field format.
const FIELDS: usize = 8;

/// Card with the fields of all of its lines. The fields behind the name are numbered from 0.
#[derive(Debug, Default)]
pub(super) struct Card {
    /// Name in capital letters, without the star of large fields.
    pub name: String,
    pub place: LinePosition,
    text: String,
    fields: Vec<Range<usize>>,
    /// Mark behind the fields of the last line, which its continuation begins with.
    mark: String,
}

/// Line without comment and tabs. `None` for one that is empty then.
pub(super) fn clean(line: &str) -> Option<Cow<'_, str>> {
    let end = line.find('$').unwrap_or(line.len());
    let line = line[..end].trim_end();
    if line.is_empty() {
        return None;
    }
    if line.is_ascii() && (!line.contains('\t') || line.contains(',')) {
        return Some(line.into());
    }
    let mut wide = String::with_capacity(2 * line.len());
    for c in line.chars() {
        match c {
            '\t' => wide.extend(std::iter::repeat_n(' ', SMALL - wide.len() % SMALL)),
            // One byte for each character keeps the columns.
            c => wide.push(if c.is_ascii() { c } else { '?' }),
        }
    }
    Some(wide.into())
}

/// True for a line that continues a card: it begins with a blank field, a comma, `+` or `*`.
pub(super) fn continues(line: &str) -> bool {
    let first = first_field(line);
    first.is_empty() || first.starts_with(['+', '*'])
}

/// First field of a line, without blanks around it.
fn first_field(line: &str) -> &str {
    match line.split_once(',') {
        Some((first, _)) => first.trim(),
        None => cut(line, 0..SMALL).trim(),
    }
}

/// Mark without its first character, which `+` or `*` replace in a continuation.
fn behind_first(mark: &str) -> &str {
    mark.get(1..).unwrap_or("")
}

/// Part of a line, as far as it goes.
fn cut(line: &str, range: Range<usize>) -> &str {
    let end = range.end.min(line.len());
    line.get(range.start.min(end)..end).unwrap_or("")
}

impl Card {
    /// Begins a card with its first line.
    pub fn begin(&mut self, line: &str, place: LinePosition) {
        let name = first_field(line).trim_end_matches('*').trim_end();
        self.name.clear();
        self.name.push_str(name);
        self.name.make_ascii_uppercase();
        self.place = place;
        self.text.clear();
        self.fields.clear();
        self.mark.clear();
        self.add_fields(line);
    }

    /// Adds a line that continues the card.
    ///
    /// # Errors
    /// Its mark differs from the mark of the previous line.
    pub fn add(&mut self, line: &str) -> Result<(), MeshError> {
        let found = first_field(line);
        let begins = behind_first(found);
        let marks = [self.mark.as_str(), behind_first(&self.mark)];
        let fits = |mark: &str| mark.is_empty() || mark.eq_ignore_ascii_case(begins);
        if !begins.is_empty() && !marks.into_iter().any(fits) {
            return Err(MeshError::Continuation {
                found: found.to_owned(),
                expected: self.mark.clone(),
            });
        }
        self.add_fields(line);
        Ok(())
    }

    fn add_fields(&mut self, line: &str) {
        let first = first_field(line);
        let is_large = match first.starts_with('*') {
            true => true,
            false => !first.starts_with('+') && first.ends_with('*'),
        };
        let count = if is_large { FIELDS / 2 } else { FIELDS };
        while !is_large && !self.fields.len().is_multiple_of(FIELDS) {
            self.push("");
        }
        let mark = if line.contains(',') {
            let mut words = line.split(',').map(str::trim).skip(1);
            for _ in 0..count {
                self.push(words.next().unwrap_or_default());
            }
            words.next().unwrap_or_default()
        } else {
            let width = if is_large { LARGE } else { SMALL };
            for i in 0..count {
                let start = SMALL + i * width;
                self.push(cut(line, start..start + width).trim());
            }
            let start = SMALL + count * width;
            cut(line, start..start + SMALL).trim()
        };
        self.mark.clear();
        self.mark.push_str(mark);
    }

    fn push(&mut self, field: &str) {
        let start = self.text.len();
        self.text.push_str(field);
        self.fields.push(start..self.text.len());
    }

    /// Number of fields, with empty ones at the end of the last line.
    pub fn len(&self) -> usize {
        self.fields.len()
    }

    /// Field number `i`, empty if it is missing.
    pub fn field(&self, i: usize) -> &str {
        let range = self.fields.get(i).cloned().unwrap_or_default();
        &self.text[range]
    }

    /// Whole number of a field, `None` for an empty one.
    ///
    /// # Errors
    /// Something else.
    pub fn natural(&self, i: usize) -> Result<Option<u64>, MeshError> {
        match self.field(i) {
            "" => Ok(None),
            text => label(text).map(Some),
        }
    }

    /// Whole number of a field that must not be empty.
    ///
    /// # Errors
    /// It is empty, or something else.
    pub fn required(&self, i: usize) -> Result<u64, MeshError> {
        label(self.field(i))
    }

    /// Number of a field, `None` for an empty one.
    ///
    /// # Errors
    /// Something else.
    pub fn float(&self, i: usize) -> Result<Option<f64>, MeshError> {
        match self.field(i) {
            "" => Ok(None),
            text => number(text).map(Some),
        }
    }

    /// Three numbers from field `i` on; empty ones are 0.
    ///
    /// # Errors
    /// Something else.
    pub fn point(&self, i: usize) -> Result<[f64; 3], MeshError> {
        let mut point = [0.0; 3];
        for (value, i) in point.iter_mut().zip(i..) {
            *value = self.float(i)?.unwrap_or(0.0);
        }
        Ok(point)
    }

    /// Numbers of nodes of at most `most` fields from `first` on; 0 for empty ones before the last
    /// that is given.
    ///
    /// # Errors
    /// Something else.
    pub fn nodes(&self, first: usize, most: usize) -> Result<Vec<u64>, MeshError> {
        let mut nodes = Vec::with_capacity(most);
        for i in first..self.len().min(first + most) {
            nodes.push(self.natural(i)?.unwrap_or(0));
        }
        let last = nodes.iter().rposition(|node| *node != 0);
        nodes.truncate(last.map_or(0, |last| last + 1));
        Ok(nodes)
    }

    /// Ranges of whole numbers of all fields from `first` on: single ones, and `a THRU b`, perhaps
    /// with a step `BY c`, which is not regarded. Words are left out.
    ///
    /// # Errors
    /// A THRU without an end.
    pub fn ranges(&self, first: usize) -> Result<Vec<(u64, u64)>, MeshError> {
        let mut ranges: Vec<(u64, u64)> = Vec::new();
        let mut i = first;
        while i < self.len() {
            let field = self.field(i);
            if field.eq_ignore_ascii_case("THRU") {
                let end = self.required(i + 1)?;
                if let Some(last) = ranges.last_mut() {
                    last.1 = end;
                }
                i += 1;
            } else if field.eq_ignore_ascii_case("BY") {
                i += 1;
            } else if field.starts_with(|c: char| c.is_ascii_digit()) {
                let number = label(field)?;
                ranges.push((number, number));
            }
            i += 1;
        }
        Ok(ranges)
    }
}
