//! Lines of a text file and of the files that it includes, with their places.

use std::borrow::Cow;

use crate::MeshError;

/// Most files inside one another, which ends a file that includes itself.
const DEEPEST: usize = 20;
/// Most files included.
const MOST_FILES: usize = 2000;

/// Position of a line: number of the file in [`SourceFiles`] (the file that is read is 0), and of
/// the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct LinePosition {
    pub file: usize,
    pub line: usize,
}

struct Source<'a> {
    bytes: Cow<'a, [u8]>,
    /// Beginning of the last line and of the next.
    last: usize,
    next: usize,
    place: LinePosition,
}

/// Names of the files that were read; the first has none.
pub(super) struct SourceFiles(Vec<String>);

impl SourceFiles {
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

/// All lines of a file. The lines of an included file replace the line that names it.
pub(super) struct SourceLines<'a> {
    sources: Vec<Source<'a>>,
    /// Files that were opened.
    pub files: SourceFiles,
    include: &'a mut dyn FnMut(&str) -> Result<Vec<u8>, MeshError>,
}

impl<'a> SourceLines<'a> {
    pub fn new(
        bytes: &'a [u8],
        include: &'a mut dyn FnMut(&str) -> Result<Vec<u8>, MeshError>,
    ) -> Self {
        let mut lines = Self {
            sources: Vec::new(),
            files: SourceFiles(Vec::new()),
            include,
        };
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        lines.open(bytes.into(), String::new());
        lines
    }

    fn open(&mut self, bytes: Cow<'a, [u8]>, name: String) {
        let file = self.files.0.len();
        self.files.0.push(name);
        self.sources.push(Source {
            bytes,
            last: 0,
            next: 0,
            place: LinePosition { file, line: 0 },
        });
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
        self.open(bytes.into(), name.to_owned());
        Ok(())
    }

    /// Next line without its end, and its place.
    pub fn next(&mut self) -> Option<(LinePosition, &[u8])> {
        loop {
            let source = self.sources.last_mut()?;
            if source.next < source.bytes.len() {
                break;
            }
            self.sources.pop();
        }
        let source = self.sources.last_mut()?;
        let rest = &source.bytes[source.next..];
        let length = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        source.last = source.next;
        source.next += length + 1;
        source.place.line += 1;
        let line = &source.bytes[source.last..source.last + length];
        Some((source.place, line.strip_suffix(b"\r").unwrap_or(line)))
    }

    /// Goes back by the line that [`SourceLines::next`] gave last.
    pub fn back(&mut self) {
        if let Some(source) = self.sources.last_mut()
            && source.next > source.last
        {
            source.next = source.last;
            source.place.line -= 1;
        }
    }
}

/// Text of a line. One that is not UTF-8 is read as Latin-1.
pub(super) fn decoded(line: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(line) {
        Ok(text) => text.into(),
        Err(_) => line.iter().map(|byte| char::from(*byte)).collect(),
    }
}

/// Number, also as Fortran writes and reads it: `1.5D+3`, `1.5+3`.
///
/// # Errors
/// The text is not a number.
pub(super) fn number(field: &str) -> Result<f64, MeshError> {
    let wrong = || MeshError::NotANumber {
        found: field.to_owned(),
    };
    let starts = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.');
    if !field.starts_with(starts) {
        return Err(wrong()); // not `inf` or `nan`
    }
    if let Ok(number) = field.parse() {
        return Ok(number);
    }
    let text = field.replace(['d', 'D'], "e");
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
