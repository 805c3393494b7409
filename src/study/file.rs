//! Text -> [`Study`]: which scene, which knobs, which quantities, and how accurate they shall be.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_spanned::Spanned;

use super::error::StudyError;
use super::keys::STUDY;
use super::knob::{self, Knob};
use super::quantity::{self, Quantity};
use super::raw::RawStudy;
use crate::scene::check::fields::{Checker, Limits, Table};
use crate::scene::raw::Located;
use crate::scene::source::Source;
use crate::scene::{Fault, SceneError, document};
use dovetail_solver::input;

/// A study as its file describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    pub name: String,
    /// Joined to the folder of the study file.
    pub scene: PathBuf,
    /// `KEY=VALUE` for all cases.
    pub set: Vec<String>,
    pub mode: Mode,
    pub quantities: Vec<Quantity>,
    /// Cases write their fields for ParaView, too.
    pub fields: bool,
    pub knobs: Vec<Knob>,
    pub targets: Vec<Target>,
}

/// How the values of several knobs are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Each knob through its values while the others stand at their base.
    OneAtATime,
    /// Every value of each knob with every value of the others.
    Grid,
}

/// What is asked of the recommendation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    pub quantity: Quantity,
    /// Largest relative error.
    pub accuracy: f64,
}

/// The text of a study file, for messages about its cases, too.
#[derive(Debug, Clone)]
pub struct StudyText {
    name: String,
    folder: PathBuf,
    text: Arc<str>,
}

impl StudyText {
    pub fn read(file: &Path) -> Result<Self, StudyError> {
        let text = input::text(file).map_err(|source| StudyError::Read {
            path: file.to_owned(),
            source,
        })?;
        Ok(Self {
            name: file.display().to_string(),
            folder: file.parent().unwrap_or(Path::new("")).to_owned(),
            text: text.into(),
        })
    }

    fn source(&self) -> Source<'_> {
        Source {
            name: &self.name,
            text: Arc::clone(&self.text),
            overrides: &[],
            vocabulary: &STUDY,
        }
    }

    /// Parses and checks; `set` are overrides of the command line, after those of the file.
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
    for item in &raw.set {
        let argument = item.get_ref();
        if argument
            .split_once('=')
            .is_none_or(|(key, _)| key.trim().is_empty())
        {
            let fault = Fault::Particular {
                message: format!("`set`: \"{argument}\" is not KEY=VALUE"),
                label: "no `=` with a key before it",
                remedy: format!("write for example {}", STUDY.example("", "set")),
            };
            checker.fault(item.span(), fault);
        }
    }
    let of_file = raw.set.into_iter().map(Spanned::into_inner);
    let words = &["one_at_a_time", "grid"];
    let modes = [Mode::OneAtATime, Mode::Grid];
    let mode = checker.choice(&top, "mode", &raw.mode, words, &modes);
    let quantities = match raw.quantities {
        None => Some(quantity::ALL.to_vec()),
        Some(list) if list.get_ref().is_empty() => {
            let fault = Fault::WrongType {
                path: "quantities".to_owned(),
                message: "at least one quantity is expected".to_owned(),
                example: STUDY.example("", "quantities"),
            };
            checker.fault(list.span(), fault);
            None
        }
        Some(list) => {
            let items = list.into_inner().into_iter();
            let read = |item| quantity(checker, &top, "quantities", &Some(item));
            items.map(read).collect()
        }
    };
    if raw.knob.is_empty() {
        checker.missing(&top, "knob");
    }
    let needs_base = mode == Some(Mode::OneAtATime) && raw.knob.len() > 1;
    let knobs = raw.knob.iter().enumerate();
    let knobs: Vec<Option<Knob>> = knobs
        .map(|(i, raw)| knob::check(checker, i, raw, needs_base))
        .collect();
    let knobs: Option<Vec<Knob>> = knobs.into_iter().collect();
    if let Some(knobs) = &knobs {
        knob::check_together(checker, knobs, mode == Some(Mode::Grid));
    }
    let targets = raw.recommend.iter().enumerate().map(|(i, raw)| {
        let at = Table::of("recommend", raw.span(), Some((i, &None)));
        let raw = raw.get_ref();
        let quantity = match raw.quantity {
            None => {
                checker.missing(&at, "quantity");
                None
            }
            Some(_) => quantity(checker, &at, "quantity", &raw.quantity),
        };
        let limits = Limits::between(0.0, 1.0);
        let accuracy = checker.number(&at, "accuracy", &raw.accuracy, limits, None);
        Some(Target {
            quantity: quantity?,
            accuracy: accuracy?,
        })
    });
    let targets: Vec<Option<Target>> = targets.collect();
    Some(Study {
        name: name?,
        scene: folder.join(scene?),
        set: of_file.chain(set.iter().cloned()).collect(),
        mode: mode?,
        quantities: quantities?,
        fields: raw.fields,
        knobs: knobs?,
        targets: targets.into_iter().collect::<Option<_>>()?,
    })
}

fn quantity(
    checker: &mut Checker,
    at: &Table,
    key: &'static str,
    word: &Located<String>,
) -> Option<Quantity> {
    checker.choice(at, key, word, &quantity::WORDS, &quantity::ALL)
}
