//! Text -> [`Study`]: which scene, which knobs, which quantities, and how accurate they shall be.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_spanned::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{StudyError, StudyFault, StudyProblem};
use super::knob::{self, Knob};
use super::quantity::{self, Quantity};
use super::reader::{Reader, Section, number};
use crate::scene::nearest;
use dovetail_solver::input;

const TOP_KEYS: &[&str] = &[
    "name",
    "scene",
    "set",
    "mode",
    "quantities",
    "fields",
    "knob",
    "recommend",
];
const TARGET_KEYS: &[&str] = &["quantity", "accuracy"];
const MODES: [(&str, Mode); 2] = [("one_at_a_time", Mode::OneAtATime), ("grid", Mode::Grid)];
const KNOB_EXAMPLE: &str = "[[knob]]\nkey = \"response.harmonics\"\nvalues = [1, 3, 5, 7]";
const TARGET_EXAMPLE: &str = "[[recommend]]\nquantity = \"peak_amplitude_m\"\naccuracy = 0.01";

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

/// A study with the text it came from, for messages about its cases.
#[derive(Debug, Clone)]
pub struct StudyText {
    pub file: PathBuf,
    pub text: Arc<str>,
}

impl StudyText {
    pub fn read(file: &Path) -> Result<Self, StudyError> {
        let text = input::text(file).map_err(|source| StudyError::Read {
            path: file.to_owned(),
            source,
        })?;
        Ok(Self {
            file: file.to_owned(),
            text: text.into(),
        })
    }

    /// Parses and checks; `set` are overrides of the command line for all cases, after those of the file.
    ///
    /// # Errors
    /// [`StudyError::Invalid`] with every problem found.
    pub fn parse(&self, set: &[String]) -> Result<Study, StudyError> {
        let name = self.file.display().to_string();
        let folder = self.file.parent().unwrap_or(Path::new(""));
        let mut reader = Reader {
            name: &name,
            text: &self.text,
            problems: Vec::new(),
        };
        let study = read(&mut reader, folder, set);
        match study {
            Some(study) if reader.problems.is_empty() => Ok(study),
            _ => Err(invalid(reader.problems)),
        }
    }

    /// A reader that only collects problems of the cases.
    pub fn problems(&self, faults: Vec<(std::ops::Range<usize>, StudyFault)>) -> Vec<StudyProblem> {
        let name = self.file.display().to_string();
        let mut reader = Reader {
            name: &name,
            text: &self.text,
            problems: Vec::new(),
        };
        for (span, fault) in faults {
            reader.fault(span, fault);
        }
        reader.problems
    }
}

fn invalid(mut problems: Vec<StudyProblem>) -> StudyError {
    problems.sort_by_key(|p| p.span.start);
    StudyError::Invalid { problems }
}

fn read(reader: &mut Reader, folder: &Path, set: &[String]) -> Option<Study> {
    let text = reader.text;
    let document = match DeTable::parse(text) {
        Ok(document) => document,
        Err(error) => {
            let message = error.message().to_owned();
            reader.fault(error.span().unwrap_or(0..0), StudyFault::Syntax { message });
            return None;
        }
    };
    let top = Section {
        path: String::new(),
        table: document.get_ref(),
        span: 0..0,
    };
    reader.only(&top, "a study", TOP_KEYS);
    let name = required_text(reader, &top, "name", "name = \"harmonics\"");
    let name = name.and_then(|name| reader.name("name".to_owned(), &name));
    let scene = required_text(reader, &top, "scene", "scene = \"../scenes/paper.toml\"");
    let mut overrides = overrides(reader, &top);
    overrides.extend_from_slice(set);
    let mode = mode(reader, &top);
    let quantities = quantities(reader, &top);
    let fields = flag(reader, &top, "fields");
    let sections = reader.tables(&top, "knob", KNOB_EXAMPLE);
    if sections.is_empty() && top.get("knob").is_none() {
        reader.missing(&top, "knob", KNOB_EXAMPLE);
    }
    let needs_base = mode == Some(Mode::OneAtATime) && sections.len() > 1;
    let read_knobs: Vec<_> = sections
        .iter()
        .map(|section| knob::read(reader, section, needs_base))
        .collect();
    let knobs: Option<Vec<Knob>> = read_knobs.into_iter().collect();
    if let Some(knobs) = &knobs {
        knob::check_together(reader, knobs, mode == Some(Mode::Grid));
    }
    let targets = targets(reader, &top);
    Some(Study {
        name: name?,
        scene: folder.join(scene?.get_ref()),
        set: overrides,
        mode: mode?,
        quantities: quantities?,
        fields: fields?,
        knobs: knobs?,
        targets: targets?,
    })
}

fn required_text(
    reader: &mut Reader,
    section: &Section,
    key: &'static str,
    example: &'static str,
) -> Option<Spanned<String>> {
    if section.get(key).is_none() {
        reader.missing(section, key, example);
    }
    reader.text(section, key, example)
}

fn overrides(reader: &mut Reader, top: &Section) -> Vec<String> {
    const EXAMPLE: &str = "set = [\"response.points=50\"]";
    let mut found = Vec::new();
    for item in reader.list(top, "set", EXAMPLE).unwrap_or(&[]) {
        match item.get_ref().as_str() {
            Some(text)
                if text
                    .split_once('=')
                    .is_some_and(|(key, _)| !key.trim().is_empty()) =>
            {
                found.push(text.to_owned());
            }
            Some(text) => {
                let fault = StudyFault::NotAnOverride {
                    path: "set".to_owned(),
                    argument: text.to_owned(),
                };
                reader.fault(item.span(), fault);
            }
            None => reader.wrong_type("set".to_owned(), item.span(), "a list of texts", EXAMPLE),
        }
    }
    found
}

fn mode(reader: &mut Reader, top: &Section) -> Option<Mode> {
    if top.get("mode").is_none() {
        return Some(Mode::OneAtATime);
    }
    let text = reader.text(top, "mode", "mode = \"one_at_a_time\"")?;
    let words: Vec<String> = MODES.iter().map(|(w, _)| (*w).to_owned()).collect();
    let found = MODES.iter().find(|(word, _)| word == text.get_ref());
    if found.is_none() {
        choice(reader, "mode".to_owned(), &text, words);
    }
    found.map(|(_, mode)| *mode)
}

fn flag(reader: &mut Reader, top: &Section, key: &'static str) -> Option<bool> {
    let Some(value) = top.get(key) else {
        return Some(false);
    };
    match value.get_ref() {
        DeValue::Boolean(flag) => Some(*flag),
        _ => {
            reader.wrong_type(top.key(key), value.span(), "true or false", "fields = true");
            None
        }
    }
}

fn choice(reader: &mut Reader, path: String, text: &Spanned<String>, valid: Vec<String>) {
    let fault = StudyFault::UnknownChoice {
        path,
        value: text.get_ref().clone(),
        nearest: nearest(text.get_ref(), &valid),
        valid,
    };
    reader.fault(text.span(), fault);
}

fn quantity(reader: &mut Reader, path: String, text: &Spanned<String>) -> Option<Quantity> {
    let found = Quantity::of_word(text.get_ref());
    if found.is_none() {
        let words = quantity::ALL.iter().map(|q| q.word().to_owned()).collect();
        choice(reader, path, text, words);
    }
    found
}

fn quantities(reader: &mut Reader, top: &Section) -> Option<Vec<Quantity>> {
    const EXAMPLE: &str = "quantities = [\"peak_amplitude_m\", \"stuck_frequency_hz\"]";
    if top.get("quantities").is_none() {
        return Some(quantity::ALL.to_vec());
    }
    let items = reader.list(top, "quantities", EXAMPLE)?;
    let mut found = Vec::new();
    for item in items {
        let Some(text) = item.get_ref().as_str() else {
            reader.wrong_type(
                "quantities".to_owned(),
                item.span(),
                "a list of texts",
                EXAMPLE,
            );
            continue;
        };
        let text = Spanned::new(item.span(), text.to_owned());
        found.extend(quantity(reader, "quantities".to_owned(), &text));
    }
    if items.is_empty() {
        let span = top.get("quantities").map_or(0..0, Spanned::span);
        reader.wrong_type(
            "quantities".to_owned(),
            span,
            "at least one quantity",
            EXAMPLE,
        );
    }
    found.dedup();
    Some(found)
}

fn targets(reader: &mut Reader, top: &Section) -> Option<Vec<Target>> {
    let mut found = Some(Vec::new());
    for section in reader.tables(top, "recommend", TARGET_EXAMPLE) {
        reader.only(&section, "[[recommend]]", TARGET_KEYS);
        let word = required_text(
            reader,
            &section,
            "quantity",
            "quantity = \"peak_amplitude_m\"",
        );
        let quantity = word.and_then(|w| quantity(reader, section.key("quantity"), &w));
        const ACCURACY: &str = "accuracy = 0.01";
        let accuracy = match section.get("accuracy") {
            None => {
                reader.missing(&section, "accuracy", ACCURACY);
                None
            }
            Some(value) => match number(value.get_ref()) {
                Some(v) if v >= 1.0 => {
                    let fault = StudyFault::OutOfRange {
                        path: section.key("accuracy"),
                        value: v.to_string(),
                        limits: "above 0 and below 1 (0.01 is one per cent)",
                    };
                    reader.fault(value.span(), fault);
                    None
                }
                _ => reader.positive(section.key("accuracy"), value, ACCURACY),
            },
        };
        match (quantity, accuracy, &mut found) {
            (Some(quantity), Some(accuracy), Some(found)) => {
                found.push(Target { quantity, accuracy });
            }
            _ => found = None,
        }
    }
    found
}
