//! Faults of a scene: the fault, its place in the text, and the remedy.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use thiserror::Error;

use dovetail_mesh::text;

/// Reason why there is no [`Scene`](dovetail_solver::description::Scene). As a [`Diagnostic`] it
/// shows the first problem, and the others as related ones.
#[derive(Debug, Error)]
pub enum SceneError {
    #[error("the scene file {} cannot be read", path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    /// Problems in the order of the text; at least one.
    #[error("{}", summary("the scene", problems))]
    Invalid { problems: Vec<SceneProblem> },
}

/// First problem and the number of problems; `what` (the scene, ...) is not valid.
pub fn summary(what: &str, problems: &[impl fmt::Display]) -> String {
    match problems {
        [] => format!("{what} is not valid"),
        [one] => one.to_string(),
        [first, others @ ..] => format!("{first} (the first of {} errors)", 1 + others.len()),
    }
}

impl Diagnostic for SceneError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        match self {
            Self::Read { .. } => Some(Box::new(
                "give the path of a TOML file that describes the run",
            )),
            Self::Invalid { problems } => problems.first()?.help(),
        }
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        match self {
            Self::Read { .. } => None,
            Self::Invalid { problems } => problems.first()?.source_code(),
        }
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        match self {
            Self::Read { .. } => None,
            Self::Invalid { problems } => problems.first()?.labels(),
        }
    }
    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        match self {
            Self::Invalid { problems } => further_problems(problems),
            Self::Read { .. } => None,
        }
    }
}

/// All problems after the first, which is shown as the error itself.
pub fn further_problems<'a, P: Diagnostic>(
    problems: &'a [P],
) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
    let others = problems.get(1..).filter(|others| !others.is_empty())?;
    Some(Box::new(others.iter().map(|p| p as &dyn Diagnostic)))
}

/// Fault and its place: in the scene file or in a `--set` argument.
#[derive(Debug, Clone, Error)]
#[error("{fault}")]
pub struct SceneProblem {
    pub fault: SceneFault,
    /// The scene file, or `--set` and the argument.
    pub source_text: NamedSource<Arc<str>>,
    /// Place of the fault in `source_text`, bytes.
    pub span: Range<usize>,
    /// Another relevant place in the same text, with its label.
    pub other: Option<(Range<usize>, &'static str)>,
}

impl Diagnostic for SceneProblem {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.fault.remedy()))
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&self.source_text)
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let here = LabeledSpan::new_primary_with_span(Some(self.fault.label()), self.span.clone());
        let other = self
            .other
            .iter()
            .map(|(span, text)| LabeledSpan::new_with_span(Some((*text).to_owned()), span.clone()));
        Some(Box::new(std::iter::once(here).chain(other)))
    }
}

/// Fault of a scene. A `path` is written as for `--set`: `contact.left.friction`.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SceneFault {
    #[error("this is not TOML: {message}")]
    Syntax { message: String },
    #[error("unknown {} `{path}`", if section.is_empty() { "section or key" } else { "key" })]
    UnknownKey {
        path: String,
        /// Section of the key; empty for the top of the file.
        section: &'static str,
        valid: Vec<String>,
        nearest: Option<String>,
    },
    #[error("`{path}` has the wrong type: {message}")]
    WrongType {
        path: String,
        message: String,
        example: &'static str,
    },
    #[error("`{section}` has to be {}", if *list { "a list of tables" } else { "a table" })]
    WrongShape {
        section: &'static str,
        list: bool,
        example: &'static str,
    },
    #[error("the scene has no {}", bracketed(section, *list))]
    MissingSection {
        section: &'static str,
        list: bool,
        example: &'static str,
    },
    #[error("`{path}` is missing")]
    MissingKey { path: String, example: &'static str },
    #[error("`{path}` is {value}; it must be {limits}")]
    OutOfRange {
        path: String,
        value: String,
        limits: String,
        /// The share that is meant if the value is in per cent.
        share: Option<f64>,
    },
    #[error("`{path}`: there is no choice \"{value}\"")]
    UnknownChoice {
        path: String,
        value: String,
        valid: &'static [&'static str],
        nearest: Option<String>,
    },
    #[error("`{path}`: there is no body \"{name}\"")]
    UnknownBody {
        path: String,
        name: String,
        bodies: Vec<String>,
        nearest: Option<String>,
    },
    #[error("`{path}`: \"{name}\" is taken already")]
    Duplicate { path: String, name: String },
    #[error("`{path}`: \"{name}\" is not a name")]
    BadName { path: String, name: String },
    #[error("`{path}` is empty")]
    EmptyText { path: String },
    #[error("`{first}` and `{second}` exclude each other")]
    Exclusive {
        first: String,
        second: String,
        remedy: &'static str,
    },
    #[error("`{path}` is given without `{needs}`")]
    Lacks {
        path: String,
        needs: String,
        remedy: &'static str,
    },
    #[error("neither `{}` is given", paths.join("` nor `"))]
    NoneOf {
        paths: Vec<String>,
        example: &'static str,
    },
    #[error("`{path}` has no direction: its length is zero")]
    ZeroDirection { path: String },
    #[error("`{path}` runs from {from} to {to}")]
    EmptyRange { path: String, from: f64, to: f64 },
    #[error("`response.harmonics` is 0: nothing vibrates, the answer is the static state")]
    NoHarmonic,
    #[error("{samples} samples of a period cannot carry {harmonics} harmonics")]
    TooFewSamples {
        samples: usize,
        harmonics: usize,
        least: usize,
    },
    #[error("`{path}` is {harmonic}, but the response keeps only {harmonics} harmonics")]
    HarmonicNotKept {
        path: String,
        harmonic: usize,
        harmonics: usize,
    },
    #[error("`damping.linear_mode` is {linear_mode}, but only {kept} stuck modes are kept")]
    LinearModeNotKept { linear_mode: usize, kept: usize },
    #[error("`damping.modal_ratios` has {given} values, but only {kept} stuck modes are kept")]
    StuckModesNotKept { given: usize, kept: usize },
    #[error("the scene has no body")]
    NoBody,
    #[error("`{path}` is the same group as `first`")]
    SameFlank { path: String },
    #[error("the first [[observe]] is a strain")]
    FirstIsStrain { path: String },
    #[error("no body is fixed anywhere, and no [[spring]] holds one to ground")]
    NothingFixed,
    #[error("`--set` needs KEY=VALUE, not \"{argument}\"")]
    OverrideSyntax { argument: String },
    #[error("the key of this `--set` has {steps} steps")]
    OverrideTooDeep { steps: usize },
    #[error("`{path}` has no element \"{segment}\"")]
    OverrideNoElement {
        path: String,
        segment: String,
        /// Names of the elements; the number for an element without a name.
        elements: Vec<String>,
        nearest: Option<String>,
    },
    #[error("`{path}` is a single value, so there is nothing like `{path}.{segment}`")]
    OverrideNotATable { path: String, segment: String },
    #[error("there is no `{path}` to remove")]
    OverrideNothingToRemove { path: String },
    /// Fault of files other than scenes, or one that shows only with the mesh.
    #[error("{message}")]
    Particular {
        message: String,
        label: String,
        remedy: String,
    },
}

fn bracketed(section: &str, list: bool) -> String {
    if list {
        format!("[[{section}]]")
    } else {
        format!("[{section}]")
    }
}

impl SceneFault {
    /// Fault of files other than scenes, or one that shows only with the mesh.
    pub fn particular(
        message: String,
        label: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Particular {
            message,
            label: label.into(),
            remedy: remedy.into(),
        }
    }

    /// Short label at the place of the fault.
    fn label(&self) -> String {
        match self {
            Self::Syntax { .. } => "here".to_owned(),
            Self::UnknownKey {
                nearest: Some(near),
                ..
            }
            | Self::UnknownChoice {
                nearest: Some(near),
                ..
            }
            | Self::UnknownBody {
                nearest: Some(near),
                ..
            }
            | Self::OverrideNoElement {
                nearest: Some(near),
                ..
            } => format!("did you mean `{near}`?"),
            Self::UnknownKey { .. } => "not a key".to_owned(),
            Self::UnknownChoice { .. } => "not a choice".to_owned(),
            Self::UnknownBody { .. } => "not a body of this scene".to_owned(),
            Self::WrongType { .. } | Self::WrongShape { .. } => "wrong type".to_owned(),
            Self::MissingSection { .. } => "the scene ends without it".to_owned(),
            Self::MissingKey { .. } | Self::NoneOf { .. } => "missing in this table".to_owned(),
            Self::OutOfRange { limits, .. } => format!("must be {limits}"),
            Self::Duplicate { .. } => "used again".to_owned(),
            Self::BadName { .. } => "not a name".to_owned(),
            Self::EmptyText { .. } => "empty".to_owned(),
            Self::Exclusive { .. } => "excludes the other".to_owned(),
            Self::Lacks { needs, .. } => format!("needs `{needs}`"),
            Self::ZeroDirection { .. } => "length zero".to_owned(),
            Self::EmptyRange { .. } => "first below second, please".to_owned(),
            Self::NoHarmonic => "at least 1".to_owned(),
            Self::TooFewSamples { least, .. } => format!("at least {least}"),
            Self::HarmonicNotKept { harmonics, .. } => format!("at most {harmonics}"),
            Self::LinearModeNotKept { kept, .. } => format!("at most {kept}"),
            Self::StuckModesNotKept { kept, .. } => format!("at most {kept} values"),
            Self::NoBody => "a body is needed".to_owned(),
            Self::SameFlank { .. } => "a flank against itself".to_owned(),
            Self::FirstIsStrain { .. } => "the first one".to_owned(),
            Self::NothingFixed => "every body floats".to_owned(),
            Self::OverrideSyntax { .. } => "no `=` with a key before it".to_owned(),
            Self::OverrideTooDeep { .. } => "too deep".to_owned(),
            Self::OverrideNoElement { .. } => "not an element".to_owned(),
            Self::OverrideNotATable { .. } => "one step too deep".to_owned(),
            Self::OverrideNothingToRemove { .. } => "not in the scene".to_owned(),
            Self::Particular { label, .. } => label.clone(),
        }
    }

    /// Key at fault, as a dotted path; `None` where it is no single key.
    pub fn key(&self) -> Option<String> {
        let of = |path: &str| Some(path.to_owned());
        match self {
            Self::UnknownKey { path, .. }
            | Self::WrongType { path, .. }
            | Self::MissingKey { path, .. }
            | Self::OutOfRange { path, .. }
            | Self::UnknownChoice { path, .. }
            | Self::UnknownBody { path, .. }
            | Self::Duplicate { path, .. }
            | Self::BadName { path, .. }
            | Self::EmptyText { path }
            | Self::Lacks { path, .. }
            | Self::ZeroDirection { path }
            | Self::EmptyRange { path, .. }
            | Self::HarmonicNotKept { path, .. }
            | Self::SameFlank { path }
            | Self::FirstIsStrain { path }
            | Self::OverrideNotATable { path, .. }
            | Self::OverrideNothingToRemove { path } => of(path),
            Self::OverrideNoElement { path, segment, .. } => Some(format!("{path}.{segment}")),
            Self::WrongShape { section, .. } | Self::MissingSection { section, .. } => of(section),
            Self::Exclusive { first, .. } => of(first),
            Self::NoneOf { paths, .. } => paths.first().cloned(),
            Self::NoHarmonic => of("response.harmonics"),
            Self::TooFewSamples { .. } => of("response.samples"),
            Self::LinearModeNotKept { .. } => of("damping.linear_mode"),
            Self::StuckModesNotKept { .. } => of("damping.modal_ratios"),
            Self::NoBody | Self::NothingFixed => of("body"),
            Self::Syntax { .. }
            | Self::OverrideSyntax { .. }
            | Self::OverrideTooDeep { .. }
            | Self::Particular { .. } => None,
        }
    }

    /// Valid alternatives, and what to write instead.
    pub fn remedy(&self) -> String {
        match self {
            Self::Syntax { .. } => "the file has to be TOML (https://toml.io): lines `key = value` under \
                 [section] or [[section]] headings; texts stand in double quotes. A mesh is named in a scene, and \
                 `dovetail groups FILE` lists what it has"
                .to_owned(),
            Self::UnknownKey { section, valid, .. } => {
                let place = match *section {
                    "" => "the top of the file".to_owned(),
                    other => format!("`{other}`"),
                };
                format!("the keys of {place} are: {}", valid.join(", "))
            }
            Self::WrongType { example, .. } => format!("write it like this: {example}"),
            Self::WrongShape { example, .. } => format!("write it like this:\n{example}"),
            Self::MissingSection { example, .. } => {
                format!("add it, beginning for example like this:\n{example}")
            }
            Self::MissingKey { example, .. } => format!("add a line like this: {example}"),
            Self::NoneOf { example, .. } => format!("add one of them, for example: {example}"),
            Self::OutOfRange {
                limits,
                value,
                share: Some(share),
                ..
            } => format!("give a value that is {limits}; {value} % is {share}"),
            Self::OutOfRange { limits, .. } => format!("give a value that is {limits}"),
            Self::UnknownChoice { valid, .. } => {
                format!("the choices are: \"{}\"", valid.join("\", \""))
            }
            Self::UnknownBody { bodies, .. } => {
                format!("the bodies of this scene are: {}", text::list(bodies))
            }
            Self::Duplicate { .. } => "give each one a name of its own".to_owned(),
            Self::BadName { .. } => "a name becomes part of file names and column headings: begin with a \
                 letter, go on with letters, digits, `_` or `-`"
                .to_owned(),
            Self::EmptyText { .. } => "give a text of at least one letter".to_owned(),
            Self::Exclusive { remedy, .. } | Self::Lacks { remedy, .. } => (*remedy).to_owned(),
            Self::ZeroDirection { .. } => {
                "give a vector that is not zero, such as [0, 1, 0] for y; its length does not matter".to_owned()
            }
            Self::EmptyRange { .. } => "write the lower end first: [from, to] with 0 < from < to (from = to \
                 only with points = 1)"
                .to_owned(),
            Self::NoHarmonic => {
                "set response.harmonics to 1 or more; `dovetail static` computes the static state alone"
                    .to_owned()
            }
            Self::TooFewSamples { least, harmonics, .. } => format!(
                "set response.samples to {least} or more (4 (H + 1) with H = {harmonics}), or keep \
                 fewer response.harmonics"
            ),
            Self::HarmonicNotKept { harmonic, .. } => {
                format!("set response.harmonics to {harmonic} or more, or excite a lower harmonic")
            }
            Self::LinearModeNotKept { linear_mode, .. } => format!(
                "set response.stuck_modes to {linear_mode} or more, or leave it out to keep as many as are needed"
            ),
            Self::StuckModesNotKept { given, .. } => format!(
                "set response.stuck_modes to {given} or more, or leave it out to keep as many as are needed"
            ),
            Self::NoBody => "write a [[body]] table for each body, for example one for a blade and one for the disc \
                 that holds it"
                .to_owned(),
            Self::SameFlank { .. } => "name the surface that lies opposite, or leave it out: the flank `first` then \
                 touches rigid ground"
                .to_owned(),
            Self::FirstIsStrain { .. } => "put an [[observe]] of a displacement before it: the peak of a run is that of the first \
                 one"
                .to_owned(),
            Self::NothingFixed => "name a group of the mesh that does not move in at least one [[body]], for \
                 example: fixed = [\"jaw_base\"]; let a contact be with rigid ground (no `second`), \
                 or hold a body by a [[spring]] to ground"
                .to_owned(),
            Self::OverrideSyntax { .. } => "write for example --set response.points=20, --set \
                 contact.left.friction=0.1 or --set 'contact.*.friction=0.1'; KEY= with nothing after it \
                 removes the key"
                .to_owned(),
            Self::OverrideTooDeep { .. } => {
                "no key of a scene is deeper than section.element.key.element".to_owned()
            }
            Self::OverrideNoElement { path, elements, .. } if elements.is_empty() => {
                format!("`{path}` is empty; add its elements in the scene file")
            }
            Self::OverrideNoElement { path, elements, .. } => format!(
                "the elements of `{path}` are: {}; a number (0 is the first) or * for all of them will do as well",
                text::list(elements)
            ),
            Self::OverrideNotATable { path, .. } => format!("set it whole: --set {path}=VALUE"),
            Self::OverrideNothingToRemove { .. } => {
                "to set it, write a value after the `=`; otherwise leave this argument out".to_owned()
            }
            Self::Particular { remedy, .. } => remedy.clone(),
        }
    }
}
