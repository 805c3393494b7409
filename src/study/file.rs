//! Reads a [`Study`] from its text: its scene, its parameters, its quantities, and the quantities
//! that a design is to minimise.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_spanned::Spanned;

use super::error::StudyError;
use super::keys::STUDY;
use super::parameter::{self, Kind, Parameter, fault, nothing};
use super::quantity::{self, Quantity};
use super::raw::{RawMinimum, RawStudy};
use crate::scene::check::fields::{Checker, Table};
use crate::scene::raw::Located;
use crate::scene::source::Source;
use crate::scene::{Fault, SceneError, document};
use dovetail_solver::input;

/// A study as its file describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    pub name: String,
    /// Path of the scene, joined to the folder of the study file.
    pub scene: PathBuf,
    /// `KEY=VALUE` texts for all cases.
    pub set: Vec<String>,
    pub mode: Mode,
    pub quantities: Vec<Quantity>,
    /// True if cases write their fields for ParaView.
    pub fields: bool,
    pub parameters: Vec<Parameter>,
    /// Quantities of which the case with the smallest value is reported.
    pub minimise: Vec<Quantity>,
}

/// Combination of the values of several parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Each parameter through its values while the others are at their base.
    OneAtATime,
    /// Every value of each parameter with every value of the others.
    Grid,
}

/// Text of a study file, also for messages about its cases.
#[derive(Debug, Clone)]
pub struct StudyText {
    name: String,
    folder: PathBuf,
    text: Arc<str>,
}

impl StudyText {
    /// Reads the text of a study file.
    ///
    /// # Errors
    /// [`StudyError::Read`] if the file cannot be read.
    pub fn read(file: &Path) -> Result<Self, StudyError> {
        let text = input::text(file).map_err(|source| StudyError::Read {
            path: file.to_owned(),
            source,
        })?;
        Ok(Self::of(&text, file))
    }

    /// Text as if read from `file`, which is not read.
    pub fn of(text: &str, file: &Path) -> Self {
        Self {
            name: file.display().to_string(),
            folder: file.parent().unwrap_or(Path::new("")).to_owned(),
            text: text.into(),
        }
    }

    fn source(&self) -> Source<'_> {
        Source {
            name: &self.name,
            text: Arc::clone(&self.text),
            overrides: &[],
            vocabulary: &STUDY,
        }
    }

    /// Parses and checks the text; `set` are overrides of the command line, applied after those of
    /// the file.
    ///
    /// # Errors
    /// [`StudyError::Invalid`] with every problem found.
    pub fn parse(&self, set: &[String]) -> Result<Study, StudyError> {
        let source = self.source();
        let invalid = |problems| StudyError::Invalid(SceneError::Invalid { problems });
        let raw: RawStudy = document::read(&source).map_err(invalid)?;
        let mut checker = Checker {
            source: &source,
            problems: Vec::new(),
        };
        let study = check(&mut checker, &self.folder, raw, set);
        let mut problems = checker.problems;
        problems.sort_by_key(|p| p.span.start);
        study
            .filter(|_| problems.is_empty())
            .ok_or_else(|| invalid(problems))
    }

    /// Faults of the cases as an error of the study.
    pub fn invalid(&self, faults: Vec<(Range<usize>, Fault)>) -> StudyError {
        let source = self.source();
        let problems = faults.into_iter().map(|(span, f)| source.problem(span, f));
        StudyError::Invalid(SceneError::Invalid {
            problems: problems.collect(),
        })
    }
}

fn check(checker: &mut Checker, folder: &Path, raw: RawStudy, set: &[String]) -> Option<Study> {
    let top = Table {
        section: "",
        path: String::new(),
        span: 0..0,
    };
    let name = checker.required_name(&top, &raw.name);
    let scene = checker.text(&top, "scene", &raw.scene);
    check_overrides(checker, &raw.set);
    let of_file = raw.set.into_iter().map(Spanned::into_inner);
    let modes = [Mode::OneAtATime, Mode::Grid];
    let mode = checker.choice(&top, "mode", &raw.mode, &modes);
    let quantities = quantities(checker, &top, raw.quantities);
    if raw.parameter.is_empty() {
        checker.missing(&top, "parameter");
    }
    let needs_base = mode == Some(Mode::OneAtATime) && raw.parameter.len() > 1;
    let parameters = raw.parameter.iter().enumerate();
    let parameters: Vec<Option<Parameter>> = parameters
        .map(|(i, raw)| parameter::check(checker, i, raw, needs_base))
        .collect();
    let parameters: Option<Vec<Parameter>> = parameters.into_iter().collect();
    if let Some(parameters) = &parameters {
        parameter::check_together(checker, parameters, mode == Some(Mode::Grid));
    }
    let followed = quantities.as_deref();
    let minimise = raw.minimise.iter().enumerate();
    let minimise: Vec<Option<Quantity>> = minimise
        .map(|(i, raw)| minimum(checker, i, raw, followed, parameters.as_deref()))
        .collect();
    let minimise: Option<Vec<Quantity>> = minimise.into_iter().collect();
    Some(Study {
        name: name?,
        scene: folder.join(scene?),
        set: of_file.chain(set.iter().cloned()).collect(),
        mode: mode?,
        quantities: quantities?,
        fields: raw.fields,
        parameters: parameters?,
        minimise: minimise?,
    })
}

fn check_overrides(checker: &mut Checker, set: &[Spanned<String>]) {
    for item in set {
        let argument = item.get_ref();
        let key = argument.split_once('=').map(|(key, _)| key.trim());
        if key.is_none_or(str::is_empty) {
            let message = format!("`set`: \"{argument}\" is not KEY=VALUE");
            let remedy = format!("write for example {}", STUDY.example("", "set"));
            checker.fault(
                item.span(),
                fault(message, "no `=` with a key before it", remedy),
            );
        }
    }
}

fn quantities(
    checker: &mut Checker,
    top: &Table,
    list: Located<Vec<Spanned<String>>>,
) -> Option<Vec<Quantity>> {
    match list {
        None => Some(quantity::ALL.to_vec()),
        Some(list) if list.get_ref().is_empty() => {
            let example = STUDY.example("", "quantities");
            checker.fault(
                list.span(),
                nothing("quantities".into(), "quantity", example),
            );
            None
        }
        Some(list) => {
            let items = list.into_inner().into_iter();
            let read = |item| quantity(checker, top, "quantities", &Some(item));
            items.map(read).collect()
        }
    }
}

fn quantity(
    checker: &mut Checker,
    at: &Table,
    key: &'static str,
    word: &Located<String>,
) -> Option<Quantity> {
    checker.choice(at, key, word, quantity::ALL)
}

/// Checks one `[[minimise]]`: a quantity that the study follows, and that there are designs to
/// compare. `followed` and `parameters` are `None` if they have faults of their own.
fn minimum(
    checker: &mut Checker,
    index: usize,
    raw: &Spanned<RawMinimum>,
    followed: Option<&[Quantity]>,
    parameters: Option<&[Parameter]>,
) -> Option<Quantity> {
    let at = Table::of("minimise", raw.span(), Some((index, &None)));
    if let Some(all) = parameters.filter(|p| !p.iter().any(|p| p.is(Kind::Design))) {
        let names: Vec<&str> = all.iter().map(|p| p.name.as_str()).collect();
        let message = format!(
            "`{}` asks for the best design, and no parameter is a design value ({})",
            at.path,
            names.join(", ")
        );
        let remedy = "write is = \"design\" in a parameter that says what is built, or leave \
                      [[minimise]] out: the report has the values of every case";
        checker.fault(
            at.span.clone(),
            fault(message, "nothing to choose from", remedy),
        );
    }
    let word = &raw.get_ref().quantity;
    let Some(located) = word else {
        checker.missing(&at, "quantity");
        return None;
    };
    let found = quantity(checker, &at, "quantity", word)?;
    if followed.is_some_and(|all| !all.contains(&found)) {
        let (key, word) = (at.key("quantity"), found.word);
        let message = format!("`{key}`: {word} is not among the `quantities` of the study");
        let remedy = format!(
            "add \"{word}\" to `quantities`, or leave `quantities` out to follow all of them"
        );
        checker.fault(located.span(), fault(message, "not followed", remedy));
    }
    Some(found)
}
