//! Lines of a deck: comments left out, keyword lines joined, included files in their place.

use super::super::source::{LinePosition, SourceLines, decoded};
use crate::MeshError;

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

/// All lines of a deck.
pub(super) struct DeckLines<'a> {
    pub source: SourceLines<'a>,
    /// Line that was read and not yet used.
    kept: Option<(LinePosition, String)>,
    /// Returns `true` if a line continues a keyword line.
    continues: fn(&str, &str) -> bool,
}

impl<'a> DeckLines<'a> {
    pub fn new(
        bytes: &'a [u8],
        include: &'a mut dyn FnMut(&str) -> Result<Vec<u8>, MeshError>,
        continues: fn(&str, &str) -> bool,
    ) -> Self {
        Self {
            source: SourceLines::new(bytes, include),
            kept: None,
            continues,
        }
    }

    /// Next line that is neither empty nor a comment, without blanks around it.
    fn raw(&mut self) -> Option<(LinePosition, String)> {
        if let Some(kept) = self.kept.take() {
            return Some(kept);
        }
        loop {
            let (place, line) = self.source.next()?;
            let line = line.trim_ascii();
            if !line.is_empty() && !line.starts_with(b"**") {
                return Some((place, decoded(line).into_owned()));
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
