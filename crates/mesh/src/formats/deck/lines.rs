//! Lines of a deck: comments left out, keyword lines joined, included files in their place.

use std::borrow::Cow;

use crate::MeshError;

/// Most files inside one another, so that a file that includes itself comes to an end.
const DEEPEST: usize = 20;
/// Most files included.
const MOST_FILES: usize = 2000;

/// Position of a line: number of the file in [`DeckFiles`] (the deck is 0), and of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct LinePosition {
    pub file: usize,
    pub line: usize,
}

/// Keyword line.
#[derive(Debug, Clone, Default)]
pub(super) struct Keyword {
    /// Name in capital letters, without the star and without blanks.
    pub name: String,
    /// Name as a message shows it, with the star.
    pub shown: String,
    /// Names, in capital letters without blanks, and values of the parameters.
    pub parameters: Vec<(String, String)>,
    pub place: LinePosition,
}

impl Keyword {
    /// Value of a parameter, empty where it has none.
    pub fn get(&self, name: &str) -> Option<&str> {
        let parameter = self.parameters.iter().find(|(key, _)| key == name);
        parameter.map(|(_, value)| value.as_str())
    }

    pub fn has(&self, name: &str) -> bool {
        self.get(name).is_some()
    }

    /// Value of a parameter that is required.
    ///
    /// # Errors
    /// It is missing or empty.
    pub fn required(&self, name: &'static str) -> Result<&str, MeshError> {
        let value = self.get(name).filter(|value| !value.is_empty());
        value.ok_or(MeshError::ParameterMissing { parameter: name })
    }
}

pub(super) enum DeckLine {
    Keyword(Keyword),
    Data(String),
}

struct LineSource<'a> {
    bytes: Cow<'a, [u8]>,
    at: usize,
    place: LinePosition,
}

impl<'a> LineSource<'a> {
    /// Beginning of file number `file`.
    fn new(bytes: impl Into<Cow<'a, [u8]>>, file: usize) -> Self {
        Self {
            bytes: bytes.into(),
            at: 0,
            place: LinePosition { file, line: 0 },
        }
    }

    /// Next line without its end.
    fn next(&mut self) -> Option<&[u8]> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|b| *b == b'\n');
        let from = self.at;
        self.at += length.map_or(rest.len(), |length| length + 1);
        self.place.line += 1;
        Some(&self.bytes[from..from + length.unwrap_or(self.bytes.len() - from)])
    }
}

/// Names of the files that were read; the deck has none.
pub(super) struct DeckFiles(Vec<String>);

impl DeckFiles {
    /// Adds the place and the keyword to an error.
    pub fn locate_error(&self, place: LinePosition, keyword: &str, error: MeshError) -> MeshError {
        if matches!(error, MeshError::Deck { .. }) {
            return error;
        }
        let mut place = self.message_position(place);
        if !keyword.is_empty() {
            place += ", ";
            place += keyword;
        }
        MeshError::Deck {
            place,
            error: Box::new(error),
        }
    }

    /// Place in the form of a message.
    pub fn message_position(&self, place: LinePosition) -> String {
        let line = place.line;
        match self.0.get(place.file).map_or("", String::as_str) {
            "" => format!("line {line}"),
            file => format!("line {line} of {file}"),
        }
    }
}

/// All lines of a deck.
pub(super) struct DeckLines<'a> {
    sources: Vec<LineSource<'a>>,
    /// Files that were opened.
    pub files: DeckFiles,
    /// Line that was read and not yet used.
    kept: Option<(LinePosition, String)>,
    include: &'a mut dyn FnMut(&str) -> Result<Vec<u8>, MeshError>,
    /// Returns `true` if a line continues a keyword line.
    continues: fn(&str, &str) -> bool,
}

impl<'a> DeckLines<'a> {
    pub fn new(
        bytes: &'a [u8],
        include: &'a mut dyn FnMut(&str) -> Result<Vec<u8>, MeshError>,
        continues: fn(&str, &str) -> bool,
    ) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self {
            sources: vec![LineSource::new(bytes, 0)],
            files: DeckFiles(vec![String::new()]),
            kept: None,
            include,
            continues,
        }
    }

    /// Continues reading in another file, and after it here.
    ///
    /// # Errors
    /// The file cannot be read, or files include one another without end.
    pub fn include(&mut self, name: &str) -> Result<(), MeshError> {
        if self.sources.len() >= DEEPEST || self.files.0.len() > MOST_FILES {
            let file = name.to_owned();
            return Err(MeshError::IncludeCircle { file });
        }
        let bytes = (self.include)(name)?;
        self.sources
            .push(LineSource::new(bytes, self.files.0.len()));
        self.files.0.push(name.to_owned());
        Ok(())
    }

    /// Next line that is neither empty nor a comment, without blanks around it.
    fn raw(&mut self) -> Option<(LinePosition, String)> {
        if let Some(kept) = self.kept.take() {
            return Some(kept);
        }
        loop {
            let source = self.sources.last_mut()?;
            let Some(line) = source.next() else {
                self.sources.pop();
                continue;
            };
            let line = line.trim_ascii();
            if !line.is_empty() && !line.starts_with(b"**") {
                let text = match std::str::from_utf8(line) {
                    Ok(text) => text.to_owned(),
                    Err(_) => line.iter().map(|byte| char::from(*byte)).collect(), // Latin-1
                };
                return Some((source.place, text));
            }
        }
    }

    /// Next line, and its place. A keyword line that ends with a comma goes on in the next line if
    /// that line has nothing but parameters, as in Abaqus; CalculiX has no such lines.
    pub fn next(&mut self) -> Option<(LinePosition, DeckLine)> {
        let (place, mut text) = self.raw()?;
        if !text.starts_with('*') {
            return Some((place, DeckLine::Data(text)));
        }
        while text.ends_with(',') {
            match self.raw() {
                Some((_, more)) if (self.continues)(&text, &more) => text += &more,
                other => {
                    self.kept = other;
                    break;
                }
            }
        }
        Some((place, DeckLine::Keyword(keyword(&text, place))))
    }
}

/// Text in capital letters without blanks, by which names of keywords and parameters are compared.
pub(super) fn normalised_name(text: &str) -> String {
    let letters = text.chars().filter(|c| !c.is_whitespace());
    letters.collect::<String>().to_ascii_uppercase()
}

fn keyword(text: &str, place: LinePosition) -> Keyword {
    let mut fields = fields(text);
    let name = fields.next().unwrap_or_default();
    let words: Vec<&str> = name.split_whitespace().collect();
    let parameters = fields.filter(|field| !field.is_empty()).map(|field| {
        let (key, value) = field.split_once('=').unwrap_or((field, ""));
        (normalised_name(key), unquoted(value).to_owned())
    });
    Keyword {
        name: normalised_name(name.trim_start_matches('*')),
        shown: words.join(" ").to_uppercase(),
        parameters: parameters.collect(),
        place,
    }
}

/// Fields between the commas, without blanks around them. Commas between quotation marks belong to
/// their field.
pub(super) fn fields(line: &str) -> impl Iterator<Item = &str> {
    let mut quoted = false;
    let parts = line.split(move |c: char| {
        quoted ^= c == '"';
        c == ',' && !quoted
    });
    parts.map(str::trim)
}

/// Text without blanks and quotation marks around it.
pub(super) fn unquoted(text: &str) -> &str {
    let text = text.trim();
    let inner = text.strip_prefix('"').and_then(|t| t.strip_suffix('"'));
    inner.unwrap_or(text)
}

/// Number, also as Fortran writes and reads it: `1.5D+3`, `1.5+3`.
///
/// # Errors
/// The text is not a number.
pub(super) fn number(field: &str) -> Result<f64, MeshError> {
    let wrong = || MeshError::NotANumber {
        found: field.to_owned(),
    };
    let text = field.replace(['d', 'D'], "e");
    let starts = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.');
    if !text.starts_with(starts) {
        return Err(wrong()); // not `inf` or `nan`
    }
    // A sign behind a digit begins an exponent.
    let sign = text.rfind(['+', '-']).filter(|at| *at > 0);
    let with_letter = || {
        let (mantissa, exponent) = text.split_at(sign?);
        format!("{mantissa}e{exponent}").parse().ok()
    };
    text.parse().ok().or_else(with_letter).ok_or_else(wrong)
}

/// Number of a node or an element.
///
/// # Errors
/// The text is not such a number.
pub(super) fn label(field: &str) -> Result<u64, MeshError> {
    field.parse().map_err(|_| MeshError::NotALabel {
        found: field.to_owned(),
    })
}
