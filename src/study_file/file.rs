//! Reads a [`Study`] from its text: its scene, its parameters and its quantities.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_spanned::Spanned;

use super::error::StudyError;
use super::keys::CombinationMode;
use super::keys::{RawStudy, STUDY};
use super::parameter::{self, Parameter, collect_all};
use super::quantity::{self, StudyQuantity};
use crate::scene::check::fields::{Checker, SceneTable};
use crate::scene::source::SourceTexts;
use crate::scene::{SceneError, SceneFault, document};
use dovetail_superelement::input;

/// A study as its file describes it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Study {
    pub name: String,
    /// Path of the scene, joined to the folder of the study file.
    pub scene: PathBuf,
    /// `KEY=VALUE` texts for all cases.
    pub set: Vec<String>,
    pub mode: CombinationMode,
    pub quantities: Vec<StudyQuantity>,
    /// True if cases write their fields for ParaView.
    pub fields: bool,
    pub parameters: Vec<Parameter>,
    /// Name and text of the file, for messages about cases.
    pub(crate) file: (String, Arc<str>),
}

impl Study {
    /// Reads and checks a study file; `set` are overrides of the command line, applied after those
    /// of the file.
    ///
    /// # Errors
    /// [`StudyError::Read`] if the file cannot be read, else as for [`Study::parse`].
    pub fn read(file: &Path, set: &[String]) -> Result<Self, StudyError> {
        let text = input::text(file).map_err(|source| StudyError::Read {
            path: file.to_owned(),
            source,
        })?;
        Self::parse(&text, file, set)
    }

    /// Parses and checks a text as if read from `file`, which is not read.
    ///
    /// # Errors
    /// [`StudyError::Invalid`] with every problem found.
    pub fn parse(text: &str, file: &Path, set: &[String]) -> Result<Self, StudyError> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let file = (file.display().to_string(), text.into());
        let source = source(&file);
        let raw: RawStudy = document::read(&source).map_err(invalid)?;
        let study = Checker::run(&source, |checker| check(checker, folder, raw, set));
        let study = study.map_err(invalid)?;
        Ok(Self { file, ..study })
    }

    /// Fault of a case as an error of the study.
    pub fn invalid(&self, span: Range<usize>, fault: SceneFault) -> StudyError {
        invalid(vec![source(&self.file).problem(span, fault)])
    }
}

fn source((name, text): &(String, Arc<str>)) -> SourceTexts<'_> {
    SourceTexts {
        name,
        text: Arc::clone(text),
        overrides: &[],
        vocabulary: &STUDY,
    }
}

fn invalid(problems: Vec<crate::scene::SceneProblem>) -> StudyError {
    StudyError::Invalid(SceneError::Invalid { problems })
}

fn check(checker: &mut Checker, folder: &Path, raw: RawStudy, set: &[String]) -> Option<Study> {
    let top = SceneTable {
        section: "",
        path: String::new(),
        span: 0..0,
    };
    let name = checker.required_name(&top, &raw.name);
    let scene = checker.text(&top, "scene", &raw.scene);
    for item in raw.set.iter().flat_map(Spanned::get_ref) {
        let argument = item.get_ref();
        let key = argument.split_once('=').map(|(key, _)| key.trim());
        if key.is_none_or(str::is_empty) {
            let message = format!("`set`: \"{argument}\" is not KEY=VALUE");
            let remedy = format!("write for example {}", STUDY.example("", "set"));
            let fault = SceneFault::particular(message, "no `=` with a key before it", remedy);
            checker.fault(item.span(), fault);
        }
    }
    let of_file = raw.set.into_iter().flat_map(Spanned::into_inner);
    let of_file = of_file.map(Spanned::into_inner);
    let mode = checker.choice(&top, "mode", &raw.mode);
    let quantities = match &raw.quantities {
        None => Some(quantity::ALL.to_vec()),
        Some(list) => {
            let words = checker.non_empty(&top, "quantities", list);
            let words = words.into_iter().flatten();
            collect_all(words.map(|w| checker.word(&top, "quantities", w, quantity::WORDS)))
        }
    };
    if raw.parameter.is_empty() {
        checker.missing(&top, "parameter");
    }
    let needs_base = mode == Some(CombinationMode::OneAtATime) && raw.parameter.len() > 1;
    let parameters = raw.parameter.iter().enumerate();
    let parameters =
        collect_all(parameters.map(|(i, p)| parameter::check(checker, i, p, needs_base)));
    if let Some(parameters) = &parameters {
        parameter::check_together(checker, parameters, mode == Some(CombinationMode::Grid));
    }
    Some(Study {
        name: name?,
        scene: folder.join(scene?),
        set: of_file.chain(set.iter().cloned()).collect(),
        mode: mode?,
        quantities: quantities?,
        fields: raw.fields.is_some_and(Spanned::into_inner),
        parameters: parameters?,
        file: Default::default(),
    })
}
