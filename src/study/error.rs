//! What can be wrong with a study, where it stands in the text, and what to do about it.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode};
use thiserror::Error;

use crate::scene::error::{all_but_first, summary};
use dovetail_solver::text;

/// Why a study was not begun, or not brought to its end. A case that fails is no error: it is reported in the tables.
#[derive(Debug, Error)]
pub enum StudyError {
    #[error("the study file {} cannot be read", path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    /// In the order of the text; at least one.
    #[error("{}", summary("the study", problems))]
    Invalid { problems: Vec<StudyProblem> },
    #[error("the study has no case \"{name}\"")]
    NoSuchCase { name: String, cases: Vec<String> },
    #[error("{action} {} failed", path.display())]
    File {
        /// "reading", "writing", ...
        action: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{} is not what a case writes: {message}", path.display())]
    Malformed { path: PathBuf, message: String },
    #[error("the program {} could not be started for a case", program.display())]
    Start {
        program: PathBuf,
        source: std::io::Error,
    },
}

impl Diagnostic for StudyError {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        let text = match self {
            Self::Read { .. } => {
                "give the path of a TOML file that describes the study (docs/study.md)".to_owned()
            }
            Self::Invalid { problems } => return problems.first()?.help(),
            Self::NoSuchCase { cases, .. } => format!("its cases are: {}", text::list(cases)),
            Self::File { .. } => {
                "check that the folder exists and may be written, and that the disk is not full, or choose another \
                 with --out"
                    .to_owned()
            }
            Self::Malformed { path, .. } => format!(
                "remove the folder of the case ({}) and run the study again: only that case is computed",
                path.parent().unwrap_or(path).display()
            ),
            Self::Start { .. } => {
                "a study runs its cases with the program's own file: leave it where it is while the study runs"
                    .to_owned()
            }
        };
        Some(Box::new(text))
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        match self {
            Self::Invalid { problems } => problems.first()?.source_code(),
            _ => None,
        }
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        match self {
            Self::Invalid { problems } => problems.first()?.labels(),
            _ => None,
        }
    }
    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        match self {
            Self::Invalid { problems } => all_but_first(problems),
            _ => None,
        }
    }
}

/// One fault and its place in the study file.
#[derive(Debug, Clone, Error)]
#[error("{fault}")]
pub struct StudyProblem {
    pub fault: StudyFault,
    pub source_text: NamedSource<Arc<str>>,
    pub span: Range<usize>,
}

impl Diagnostic for StudyProblem {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.fault.remedy()))
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&self.source_text)
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let label = LabeledSpan::new_primary_with_span(Some(self.fault.label()), self.span.clone());
        Some(Box::new(std::iter::once(label)))
    }
}

/// What is wrong. A `path` is written `knob.flanks.values`.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StudyFault {
    #[error("this is not TOML: {message}")]
    Syntax { message: String },
    #[error("unknown key `{path}`")]
    UnknownKey {
        path: String,
        /// What the table is called in messages.
        table: &'static str,
        valid: &'static [&'static str],
        nearest: Option<String>,
    },
    #[error("`{path}` has the wrong type: {expected} is expected")]
    WrongType {
        path: String,
        expected: &'static str,
        example: &'static str,
    },
    #[error("`{path}` is missing")]
    MissingKey { path: String, example: &'static str },
    #[error("`{path}`: there is no choice \"{value}\"")]
    UnknownChoice {
        path: String,
        value: String,
        valid: Vec<String>,
        nearest: Option<String>,
    },
    #[error("`{path}`: \"{name}\" is not a name")]
    BadName { path: String, name: String },
    #[error("`{path}`: \"{name}\" is taken already")]
    Duplicate { path: String, name: String },
    #[error("`{path}` is {value}; it must be {limits}")]
    OutOfRange {
        path: String,
        value: String,
        limits: &'static str,
    },
    #[error("`{path}` has {found} sizes for {expected} values")]
    SizeCount {
        path: String,
        found: usize,
        expected: usize,
    },
    #[error("`{path}`: {value} has no size by \"{rule}\"")]
    NoSize {
        path: String,
        value: String,
        rule: String,
    },
    #[error("some values of `{path}` have a size, others have none")]
    SomeSizes { path: String },
    #[error("two values of `{path}` have the size {size}")]
    EqualSizes { path: String, size: f64 },
    #[error("`{path}` is not one of the values")]
    NotAValue { path: String, values: Vec<String> },
    #[error("`{path}` is missing: with several knobs one at a time, each needs a base")]
    NoBase { path: String, values: Vec<String> },
    #[error("both {first} and {second} set `{key}`")]
    SetTwice {
        first: String,
        second: String,
        key: String,
    },
    #[error("`{path}`: \"{argument}\" is not KEY=VALUE")]
    NotAnOverride { path: String, argument: String },
    #[error("a grid of {cases} cases is more than {most}")]
    TooManyCases { cases: String, most: usize },
    #[error("case \"{case}\" is no possible run: {message}")]
    ImpossibleCase {
        case: String,
        message: String,
        help: String,
    },
}

impl StudyFault {
    /// Short text for the place itself.
    fn label(&self) -> String {
        match self {
            Self::UnknownKey {
                nearest: Some(near),
                ..
            }
            | Self::UnknownChoice {
                nearest: Some(near),
                ..
            } => format!("did you mean `{near}`?"),
            Self::Syntax { .. } => "here".to_owned(),
            Self::UnknownKey { .. } => "not a key".to_owned(),
            Self::WrongType { .. } => "wrong type".to_owned(),
            Self::MissingKey { .. } | Self::NoBase { .. } => "missing in this table".to_owned(),
            Self::UnknownChoice { .. } => "not a choice".to_owned(),
            Self::BadName { .. } => "not a name".to_owned(),
            Self::Duplicate { .. } => "used again".to_owned(),
            Self::OutOfRange { limits, .. } => format!("must be {limits}"),
            Self::SizeCount { expected, .. } => format!("{expected} expected"),
            Self::NoSize { .. } => "no size above 0".to_owned(),
            Self::SomeSizes { .. } => "some without a size".to_owned(),
            Self::EqualSizes { .. } => "the same size".to_owned(),
            Self::NotAValue { .. } => "not a value".to_owned(),
            Self::SetTwice { .. } => "set again".to_owned(),
            Self::NotAnOverride { .. } => "no `=` with a key before it".to_owned(),
            Self::TooManyCases { .. } => "too many".to_owned(),
            Self::ImpossibleCase { .. } => "asks for it".to_owned(),
        }
    }

    /// What is valid, and what to write instead.
    fn remedy(&self) -> String {
        match self {
            Self::Syntax { .. } => {
                "a study is a TOML file (https://toml.io); docs/study.md shows one".to_owned()
            }
            Self::UnknownKey { table, valid, .. } => {
                format!("the keys of {table} are: {}", valid.join(", "))
            }
            Self::WrongType { example, .. } => format!("write it like this: {example}"),
            Self::MissingKey { example, .. } => format!("add a line like this: {example}"),
            Self::UnknownChoice { valid, .. } => {
                format!("the choices are: \"{}\"", valid.join("\", \""))
            }
            Self::BadName { .. } => "a name becomes part of file names and column headings: begin with a letter, go on \
                 with letters, digits, `_` or `-`"
                .to_owned(),
            Self::Duplicate { .. } => "give each one a name of its own".to_owned(),
            Self::OutOfRange { limits, .. } => format!("give a value that is {limits}"),
            Self::SizeCount { .. } => "give one size for each value, in the same order".to_owned(),
            Self::NoSize { .. } => "give the sizes as a list, one above 0 for each value: size = [1.0, 0.5]".to_owned(),
            Self::SomeSizes { .. } => "give each value a `size`, or none".to_owned(),
            Self::EqualSizes { .. } => "a size tells how fine a value is; leave out `size` where the values are not finer and \
                 coarser (they then count from coarse to fine as they are written)"
                .to_owned(),
            Self::NotAValue { values, .. } | Self::NoBase { values, .. } => {
                let first = values.first().map_or("1", String::as_str);
                format!("the values are: {}; for example: base = {first}", text::list(values))
            }
            Self::SetTwice { .. } => "let one knob set both together: values = [{ label = \"coarse\", set = { ... } }, ...]".to_owned(),
            Self::NotAnOverride { .. } => {
                "write for example set = [\"response.points=50\", \"response.compare_harmonics=\"]".to_owned()
            }
            Self::TooManyCases { .. } => "take fewer values, or mode = \"one_at_a_time\"".to_owned(),
            Self::ImpossibleCase { help, .. } => help.clone(),
        }
    }
}
