//! Text -> [`Study`]: which scene, which parameters, which quantities, how accurate they shall be, and
//! which of them a design shall have little of.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_spanned::Spanned;

use super::error::StudyError;
use super::keys::STUDY;
use super::parameter::{self, Kind, Parameter};
use super::quantity::{self, Quantity};
use super::raw::{RawMinimum, RawStudy, RawTarget};
use crate::scene::check::fields::{Checker, Table};
use crate::scene::kinds::Limits;
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
    pub parameters: Vec<Parameter>,
    pub targets: Vec<Target>,
    /// Of these the case with the least value is asked for.
    pub minimise: Vec<Quantity>,
}

/// How the values of several parameters are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Each parameter through its values while the others stand at their base.
    OneAtATime,
    /// Every value of each parameter with every value of the others.
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
    /// # Errors
    /// [`StudyError::Read`] where the file cannot be read.
    pub fn read(file: &Path) -> Result<Self, StudyError> {
        let text = input::text(file).map_err(|source| StudyError::Read {
            path: file.to_owned(),
            source,
        })?;
        Ok(Self::of(&text, file))
    }

    /// A text that stands, or could stand, in `file`, which is not read.
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
    check_overrides(checker, &raw.set);
    let of_file = raw.set.into_iter().map(Spanned::into_inner);
    let words = &["one_at_a_time", "grid"];
    let modes = [Mode::OneAtATime, Mode::Grid];
    let mode = checker.choice(&top, "mode", &raw.mode, words, &modes);
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
    let asking = Asking {
        quantities: quantities.as_deref(),
        parameters: parameters.as_deref(),
    };
    let targets = asking.targets(checker, &raw.recommend);
    let minimise = asking.minimise(checker, &raw.minimise);
    Some(Study {
        name: name?,
        scene: folder.join(scene?),
        set: of_file.chain(set.iter().cloned()).collect(),
        mode: mode?,
        quantities: quantities?,
        fields: raw.fields,
        parameters: parameters?,
        targets: targets?,
        minimise: minimise?,
    })
}

fn check_overrides(checker: &mut Checker, set: &[Spanned<String>]) {
    for item in set {
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
}

fn quantities(
    checker: &mut Checker,
    top: &Table,
    list: Located<Vec<Spanned<String>>>,
) -> Option<Vec<Quantity>> {
    match list {
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
    checker.choice(at, key, word, &quantity::WORDS, &quantity::ALL)
}

/// What `[[recommend]]` and `[[minimise]]` may ask for; `None` where the study has faults there.
struct Asking<'s> {
    quantities: Option<&'s [Quantity]>,
    parameters: Option<&'s [Parameter]>,
}

impl Asking<'_> {
    fn targets(&self, checker: &mut Checker, raw: &[Spanned<RawTarget>]) -> Option<Vec<Target>> {
        let target = |(i, raw): (usize, &Spanned<RawTarget>)| {
            let at = Table::of("recommend", raw.span(), Some((i, &None)));
            self.needs_parameter(checker, &at, Kind::Numerical);
            let quantity = self.quantity(checker, &at, &raw.get_ref().quantity);
            let limits = Limits::between(0.0, 1.0);
            let accuracy = &raw.get_ref().accuracy;
            let accuracy = checker.number(&at, "accuracy", accuracy, limits, None);
            Some(Target {
                quantity: quantity?,
                accuracy: accuracy?,
            })
        };
        let targets: Vec<Option<Target>> = raw.iter().enumerate().map(target).collect();
        targets.into_iter().collect()
    }

    fn minimise(
        &self,
        checker: &mut Checker,
        raw: &[Spanned<RawMinimum>],
    ) -> Option<Vec<Quantity>> {
        let minimum = |(i, raw): (usize, &Spanned<RawMinimum>)| {
            let at = Table::of("minimise", raw.span(), Some((i, &None)));
            self.needs_parameter(checker, &at, Kind::Design);
            self.quantity(checker, &at, &raw.get_ref().quantity)
        };
        let minima: Vec<Option<Quantity>> = raw.iter().enumerate().map(minimum).collect();
        minima.into_iter().collect()
    }

    /// A quantity that the study follows.
    fn quantity(
        &self,
        checker: &mut Checker,
        at: &Table,
        word: &Located<String>,
    ) -> Option<Quantity> {
        let Some(located) = word else {
            checker.missing(at, "quantity");
            return None;
        };
        let found = quantity(checker, at, "quantity", word)?;
        if self.quantities.is_some_and(|q| !q.contains(&found)) {
            let fault = Fault::Particular {
                message: format!(
                    "`{}`: {} is not among the `quantities` of the study",
                    at.key("quantity"),
                    found.word
                ),
                label: "not followed",
                remedy: format!(
                    "add \"{}\" to `quantities`, or leave `quantities` out to follow all of them",
                    found.word
                ),
            };
            checker.fault(located.span(), fault);
        }
        Some(found)
    }

    /// Errors are those of numerical parameters; designs are compared where there is a design value.
    fn needs_parameter(&self, checker: &mut Checker, at: &Table, kind: Kind) {
        let Some(parameters) = self.parameters.filter(|k| k.iter().all(|k| k.kind != kind)) else {
            return;
        };
        let names: Vec<&str> = parameters.iter().map(|k| k.name.as_str()).collect();
        let names = names.join(", ");
        let path = &at.path;
        let (message, remedy) = match kind {
            Kind::Numerical => (
                format!("`{path}` asks for an accuracy, and no parameter is numerical ({names})"),
                "ask for the least value with [[minimise]] quantity = \"peak_amplitude_m\", or \
                 write is = \"numerical\" in a parameter that is a setting of the computation",
            ),
            Kind::Design => (
                format!(
                    "`{path}` asks for the best design, and no parameter is a design value ({names})"
                ),
                "ask for settings with [[recommend]] quantity = \"peak_amplitude_m\" and \
                 accuracy = 0.01, or write is = \"design\" in a parameter that says what is built",
            ),
        };
        let fault = Fault::Particular {
            message,
            label: match kind {
                Kind::Numerical => "no parameter has an error",
                Kind::Design => "nothing to choose from",
            },
            remedy: remedy.to_owned(),
        };
        checker.fault(at.span.clone(), fault);
    }
}
