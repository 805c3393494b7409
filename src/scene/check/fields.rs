//! Checks of single values. A located raw value becomes a plain one, or a problem is noted.

use std::collections::HashMap;
use std::ops::Range;
use std::str::FromStr;

use serde_spanned::Spanned;

use crate::scene::error::{SceneFault, SceneProblem};
use crate::scene::keys;
use crate::scene::kinds::{Limits, ValueKind};
use crate::scene::raw::{Count, Located, Number, NumberOrList, Numbers};
use crate::scene::source::SourceTexts;
use dovetail_solver::space::direction;

/// Places of these keys of a table; `None` for those that are not given.
macro_rules! places {
    ($table:expr; $($key:ident),+) => {
        [$((stringify!($key), $table.$key.as_ref().map(serde_spanned::Spanned::span))),+]
    };
}
pub(super) use places;

/// Table of the scene, and its name in messages.
#[derive(Debug, Clone)]
pub struct SceneTable {
    pub section: &'static str,
    /// Path as in `--set`: `response`, `contact.left`; empty for the top of the file.
    pub path: String,
    /// Place of its heading, bytes.
    pub span: Range<usize>,
}

impl SceneTable {
    /// Table named `section` or, with a name or a number, `section.name`.
    pub fn new(
        section: &'static str,
        span: Range<usize>,
        item: Option<(usize, &Located<String>)>,
    ) -> SceneTable {
        let path = match item {
            None => section.to_owned(),
            Some((index, None)) => format!("{section}.{index}"),
            Some((_, Some(name))) => format!("{section}.{}", name.get_ref()),
        };
        SceneTable {
            section,
            path,
            span,
        }
    }
    pub fn key(&self, key: &str) -> String {
        match self.path.as_str() {
            "" => key.to_owned(),
            path => format!("{path}.{key}"),
        }
    }
}

/// Problems found so far.
pub struct Checker<'a> {
    pub source: &'a SourceTexts<'a>,
    pub problems: Vec<SceneProblem>,
}

impl<'a> Checker<'a> {
    /// Result of a check, or every problem that it notes, in the order of the text.
    pub fn run<T>(
        source: &'a SourceTexts<'a>,
        check: impl FnOnce(&mut Self) -> Option<T>,
    ) -> Result<T, Vec<SceneProblem>> {
        let mut checker = Self {
            source,
            problems: Vec::new(),
        };
        let checked = check(&mut checker);
        let mut problems = checker.problems;
        problems.sort_by_key(|p| p.span.start);
        match checked {
            Some(checked) if problems.is_empty() => Ok(checked),
            _ => Err(problems),
        }
    }
}

impl Checker<'_> {
    pub fn fault(&mut self, span: Range<usize>, fault: SceneFault) {
        self.problems.push(self.source.problem(span, fault));
    }

    pub fn missing(&mut self, table: &SceneTable, key: &'static str) {
        let example = self.source.vocabulary.example(table.section, key);
        let path = table.key(key);
        self.fault(table.span.clone(), SceneFault::MissingKey { path, example });
    }

    /// Notes a fault for a table that has none of these keys. The message shows how `shown` is
    /// written.
    pub fn require_one_of(&mut self, table: &SceneTable, keys: &[&str], shown: &str) {
        let paths = keys.iter().map(|key| table.key(key)).collect();
        let example = self.source.vocabulary.example(table.section, shown);
        self.fault(table.span.clone(), SceneFault::NoneOf { paths, example });
    }

    /// Checks each item of a list by `check`, and that no two have the same name. Items of a list
    /// without names are named by their numbers.
    pub fn items<R, S>(
        &mut self,
        section: &'static str,
        raw: &[Spanned<R>],
        name: impl Fn(&R) -> &Located<String>,
        mut check: impl FnMut(&mut Self, &SceneTable, &R) -> Option<S>,
    ) -> Option<Vec<S>> {
        let (mut specs, mut names) = (Vec::new(), Vec::new());
        for (index, item) in raw.iter().enumerate() {
            let name = name(item.get_ref());
            let at = SceneTable::new(section, item.span(), Some((index, name)));
            let named = |n: &Spanned<String>| (at.key("name"), n.get_ref().clone(), n.span());
            names.extend(name.iter().map(named));
            specs.push(check(self, &at, item.get_ref()));
        }
        self.distinct(&names);
        specs.into_iter().collect()
    }

    /// Notes that a key has the wrong type; `message` says what is expected.
    pub fn wrong_type(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        span: Range<usize>,
        message: String,
    ) {
        let example = self.source.vocabulary.example(table.section, key);
        let path = table.key(key);
        self.fault(
            span,
            SceneFault::WrongType {
                path,
                message,
                example,
            },
        );
    }

    /// Returns the items of a list that has at least one.
    pub fn non_empty<'l, T>(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        list: &'l Spanned<Vec<T>>,
    ) -> Option<&'l [T]> {
        if list.get_ref().is_empty() {
            let message = "at least one value is expected".to_owned();
            self.wrong_type(table, key, list.span(), message);
            return None;
        }
        Some(list.get_ref())
    }

    /// Returns the type of a key with its limits and choices, as the vocabulary declares them.
    fn kind(&self, table: &SceneTable, key: &str) -> Option<ValueKind> {
        let declared = self.source.vocabulary.key(table.section, key);
        let kind = declared.map(|k| k.kind);
        debug_assert!(kind.is_some(), "{} is not declared", table.key(key));
        kind
    }

    /// Returns the default of a key if the vocabulary declares a value.
    fn default_value(&self, table: &SceneTable, key: &str) -> Option<toml::Value> {
        let declared = self.source.vocabulary.key(table.section, key)?;
        declared.default_value()
    }

    /// Returns a number within the limits of its key. An absent key has its default; without a
    /// default it is a fault.
    pub fn number(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<Number>,
    ) -> Option<f64> {
        let Some(value) = value else {
            let default = match self.default_value(table, key) {
                Some(toml::Value::Integer(default)) => Some(default as f64),
                Some(toml::Value::Float(default)) => Some(default),
                _ => None,
            };
            if default.is_none() {
                self.missing(table, key);
            }
            return default;
        };
        let (unit, limits) = match self.kind(table, key) {
            Some(ValueKind::Number(unit, limits)) => (unit, limits),
            _ => ("", Limits::ANY),
        };
        let Number(number) = *value.get_ref();
        if limits.contain(number) {
            return Some(number);
        }
        let share = number / 100.0;
        let fault = SceneFault::OutOfRange {
            path: table.key(key),
            value: number.to_string(),
            limits: limits.to_string(),
            share: (unit.is_empty() && number >= 1.0 && limits.contain(share)).then_some(share),
        };
        self.fault(value.span(), fault);
        None
    }

    /// Returns the numbers of a list, at least one, each within the limits of its key; none if the
    /// key is absent.
    pub fn numbers(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        list: &Located<Vec<Spanned<Number>>>,
    ) -> Option<Vec<f64>> {
        let Some(list) = list else {
            return Some(Vec::new());
        };
        let limits = match self.kind(table, key) {
            Some(ValueKind::NumberList(_, limits)) => limits,
            _ => Limits::ANY,
        };
        let mut numbers = Vec::new();
        for item in self.non_empty(table, key, list)? {
            let Number(number) = *item.get_ref();
            if limits.contain(number) {
                numbers.push(number);
            } else {
                self.out_of_range(table, key, item.span(), number, limits.to_string());
            }
        }
        (numbers.len() == list.get_ref().len()).then_some(numbers)
    }

    /// Returns the numbers of a key that has one or a list of them, at least one, each within the
    /// limits of its key, and `true` if it is a list. An absent key has its default, one number.
    pub fn number_or_list(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<NumberOrList>,
    ) -> Option<(Vec<f64>, bool)> {
        let Some(value) = value else {
            return self.number(table, key, &None).map(|one| (vec![one], false));
        };
        let limits = match self.kind(table, key) {
            Some(ValueKind::NumberOrList(_, limits)) => limits,
            _ => Limits::ANY,
        };
        let (numbers, is_list) = match value.get_ref() {
            NumberOrList::One(number) => (vec![*number], false),
            NumberOrList::List(numbers) => (numbers.clone(), true),
        };
        if numbers.is_empty() {
            let message = "at least one value is expected".to_owned();
            self.wrong_type(table, key, value.span(), message);
            return None;
        }
        if let Some(wrong) = numbers.iter().find(|number| !limits.contain(**number)) {
            self.out_of_range(table, key, value.span(), wrong, limits.to_string());
            return None;
        }
        Some((numbers, is_list))
    }

    /// Returns a number within the limits of its key, `Some(None)` if the key is absent.
    pub fn optional_number(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<Number>,
    ) -> Option<Option<f64>> {
        match value {
            None => Some(None),
            value => self.number(table, key, value).map(Some),
        }
    }

    /// Returns a whole number within the limits of its key. An absent key has its default; without
    /// a default it is a fault.
    pub fn count(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<Count>,
    ) -> Option<usize> {
        if value.is_none() {
            let default = self.default_value(table, key);
            let default = default.and_then(|default| default.as_integer());
            let default = default.and_then(|default| usize::try_from(default).ok());
            if default.is_none() {
                self.missing(table, key);
            }
            return default;
        }
        self.optional_count(table, key, value, None)?
    }

    /// Returns a whole number within the limits of its key and at most `most`, `Some(None)` if the
    /// key is absent.
    pub fn optional_count(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<Count>,
        most: Option<usize>,
    ) -> Option<Option<usize>> {
        let Some(value) = value else {
            return Some(None);
        };
        let (least, declared) = match self.kind(table, key) {
            Some(ValueKind::Whole(least, most)) => (least.unwrap_or(1), most),
            _ => (0, None),
        };
        let Count(count) = *value.get_ref();
        let ends = [declared.map(|most| most as usize), most];
        let most = ends.into_iter().flatten().min().unwrap_or(usize::MAX);
        if (least as usize..=most).contains(&count) {
            return Some(Some(count));
        }
        let limits = if most == usize::MAX {
            format!("a whole number from {least} on")
        } else {
            format!("a whole number from {least} to {most}")
        };
        self.out_of_range(table, key, value.span(), count, limits);
        None
    }

    fn out_of_range(
        &mut self,
        table: &SceneTable,
        key: &str,
        span: Range<usize>,
        value: impl std::fmt::Display,
        limits: String,
    ) {
        let fault = SceneFault::OutOfRange {
            path: table.key(key),
            value: value.to_string(),
            limits,
            share: None,
        };
        self.fault(span, fault);
    }

    /// Returns a text that is not empty.
    pub fn text(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<String>,
    ) -> Option<String> {
        let Some(value) = value else {
            self.missing(table, key);
            return None;
        };
        if value.get_ref().trim().is_empty() {
            let path = table.key(key);
            self.fault(value.span(), SceneFault::EmptyText { path });
            return None;
        }
        Some(value.get_ref().clone())
    }

    /// Returns a name that is suitable for file names, column headings and the paths of `--set`.
    pub fn name(&mut self, path: String, value: &Spanned<String>) -> Option<String> {
        let name = value.get_ref().clone();
        if is_name(&name) {
            return Some(name);
        }
        self.fault(value.span(), SceneFault::BadName { path, name });
        None
    }

    /// Returns the choice whose word is given, or the default.
    pub fn choice<T: FromStr + Default>(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<String>,
    ) -> Option<T> {
        self.optional_choice(table, key, value)
            .map(Option::unwrap_or_default)
    }

    /// Returns the choice whose word is given, `Some(None)` if the key is absent.
    pub fn optional_choice<T: FromStr>(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<String>,
    ) -> Option<Option<T>> {
        let words = match self.kind(table, key) {
            Some(ValueKind::Choice(words) | ValueKind::Choices(words)) => words,
            _ => &[],
        };
        match value {
            None => Some(None),
            Some(word) => self.word(table, key, word, words).map(Some),
        }
    }

    /// Returns the choice with this word, which is one of `valid`.
    pub fn word<T: FromStr>(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        word: &Spanned<String>,
        valid: &'static [&'static str],
    ) -> Option<T> {
        let parsed = word.get_ref().parse().ok();
        if parsed.is_none() {
            let fault = SceneFault::UnknownChoice {
                path: table.key(key),
                value: word.get_ref().clone(),
                valid,
                nearest: keys::nearest(word.get_ref(), valid),
            };
            self.fault(word.span(), fault);
        }
        parsed
    }

    /// Returns a direction, scaled to unit length.
    pub fn direction(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<Numbers<3>>,
    ) -> Option<[f64; 3]> {
        let Some(value) = value else {
            self.missing(table, key);
            return None;
        };
        let unit = direction(value.get_ref().0);
        if unit.is_none() {
            let path = table.key(key);
            self.fault(value.span(), SceneFault::ZeroDirection { path });
        }
        unit
    }

    /// Returns a direction, scaled to unit length, `Some(None)` if the key is absent.
    pub fn optional_direction(
        &mut self,
        table: &SceneTable,
        key: &'static str,
        value: &Located<Numbers<3>>,
    ) -> Option<Option<[f64; 3]>> {
        match value {
            None => Some(None),
            value => self.direction(table, key, value).map(Some),
        }
    }

    /// Notes a fault for a key that has no meaning without another.
    pub fn note_missing_partner(
        &mut self,
        at: &SceneTable,
        key: &str,
        needs: &str,
        span: Range<usize>,
        remedy: &'static str,
    ) {
        let (path, needs) = (at.key(key), at.key(needs));
        let fault = SceneFault::Lacks {
            path,
            needs,
            remedy,
        };
        self.fault(span, fault);
    }

    /// Notes a fault for the first of these keys that is given: it has no meaning without another.
    pub fn note_missing_partners(
        &mut self,
        at: &SceneTable,
        keys: &[(&str, Option<Range<usize>>)],
        needs: &str,
        remedy: &'static str,
    ) -> Option<()> {
        for (key, span) in keys {
            if let Some(span) = span {
                self.note_missing_partner(at, key, needs, span.clone(), remedy);
                return None;
            }
        }
        Some(())
    }

    /// Notes a fault for the first of `others` that is given in addition to `given`.
    pub fn exclude(
        &mut self,
        at: &SceneTable,
        given: (&str, Range<usize>),
        others: &[(&str, Option<Range<usize>>)],
        remedy: &'static str,
    ) -> Option<()> {
        for (other, span) in others {
            if let Some(span) = span {
                let fault = SceneFault::Exclusive {
                    first: at.key(given.0),
                    second: at.key(other),
                    remedy,
                };
                let problem = self
                    .source
                    .problem_with(span.clone(), fault, given.1, "the other");
                self.problems.push(problem);
                return None;
            }
        }
        Some(())
    }

    /// Returns the one of these keys that is given, with its place.
    pub fn pick_one(
        &mut self,
        at: &SceneTable,
        keys: &[(&'static str, Option<Range<usize>>)],
        remedy: &'static str,
    ) -> Option<(&'static str, Range<usize>)> {
        let given = keys
            .iter()
            .position(|(_, span)| span.is_some())
            .and_then(|i| Some((i, keys[i].0, keys[i].1.clone()?)));
        let Some((first, key, span)) = given else {
            let names: Vec<&str> = keys.iter().map(|(key, _)| *key).collect();
            self.require_one_of(at, &names, names[0]);
            return None;
        };
        self.exclude(at, (key, span.clone()), &keys[first + 1..], remedy)?;
        Some((key, span))
    }

    /// Returns the `name` that every item of a list must have.
    pub fn required_name(&mut self, at: &SceneTable, name: &Located<String>) -> Option<String> {
        match name {
            Some(name) => self.name(at.key("name"), name),
            None => {
                self.missing(at, "name");
                None
            }
        }
    }

    /// Notes a fault for every name that also occurs earlier in the list.
    pub fn distinct(&mut self, named: &[(String, String, Range<usize>)]) {
        let mut firsts = HashMap::new();
        for (path, name, span) in named {
            let first: &Range<usize> = firsts.entry(name).or_insert(span);
            // One `--set` may name several elements alike: their spans are equal.
            if !std::ptr::eq(first, span) {
                let fault = SceneFault::Duplicate {
                    path: path.clone(),
                    name: name.clone(),
                };
                let problem =
                    self.source
                        .problem_with(span.clone(), fault, first.clone(), "first here");
                self.problems.push(problem);
            }
        }
    }
}

/// Returns `true` if a word is suitable for file names, column headings and the paths of `--set`.
pub fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_alphabetic())
        && word
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
        && word.len() <= 100
}
