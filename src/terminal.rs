//! Prints the report of an error, and results on standard output. All output passes through
//! [`text::plain`].

use std::fmt;
use std::io::{self, ErrorKind, IsTerminal, Write};

use miette::{
    Diagnostic, LabeledSpan, MietteError, MietteHandlerOpts, MietteSpanContents, ReportHandler,
    Severity, SourceCode, SourceSpan, SpanContents,
};

use dovetail_mesh::text;

/// Largest number of related errors in a report.
const MOST_RELATED: usize = 20;
/// Largest number of errors in a chain of causes.
const MOST_CAUSES: usize = 20;
/// Largest number of bytes of source text around a label that are shown unchanged.
const MOST_OF_A_SOURCE: usize = 8192;
/// Largest number of bytes of a line of source text that are shown unchanged.
const MOST_OF_A_LINE: usize = 1000;
/// Numbers of characters of a longer line that are shown before, at and after the label.
const WINDOW: [usize; 3] = [40, 60, 40];

/// Prints results, whole lines, to standard output. It is not an error if the reader has closed its
/// end (`| head`).
///
/// # Errors
/// The output cannot be written for another reason.
pub fn print(results: &str) -> io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    let printed = write!(stdout, "{}", text::visible(results)).and_then(|()| stdout.flush());
    match printed {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        printed => printed,
    }
}

/// Prints an error to stderr: with colour and lines on a terminal, plain text elsewhere.
pub fn report(error: &dyn Diagnostic) {
    // A stderr that is gone is no reason to panic.
    let _ = writeln!(
        std::io::stderr(),
        "{}",
        rendered(error, std::io::stderr().is_terminal())
    );
}

/// Report of an error, as [`report`] prints it on a terminal or elsewhere.
pub fn rendered(error: &dyn Diagnostic, on_terminal: bool) -> String {
    let options = MietteHandlerOpts::new();
    let handler = if on_terminal {
        options.build()
    } else {
        options.unicode(false).color(false).width(110).build()
    };
    Rendered(&handler, &Shown::new(error)).to_string()
}

struct Rendered<'a>(&'a dyn ReportHandler, &'a Shown<'a>);

impl fmt::Display for Rendered<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.debug(self.1, f)
    }
}

/// Diagnostic in a form that may be shown: without control characters for a terminal, and of
/// bounded size.
#[derive(Debug)]
struct Shown<'a> {
    message: String,
    cause: Option<Cause>,
    severity: Option<Severity>,
    help: Option<String>,
    source: Option<ShownSource<'a>>,
    labels: Vec<LabeledSpan>,
    related: Vec<Shown<'a>>,
}

/// Cause of an error, and its own cause.
#[derive(Debug)]
struct Cause {
    message: String,
    cause: Option<Box<Cause>>,
}

impl<'a> Shown<'a> {
    fn new(error: &'a dyn Diagnostic) -> Self {
        let labels: Vec<LabeledSpan> = error.labels().into_iter().flatten().collect();
        let (source, labels) = match error.source_code() {
            Some(source) => shown_source(source, labels),
            None => (None, Vec::new()),
        };
        let mut others = error.related().into_iter().flatten();
        let mut related: Vec<Self> = others.by_ref().take(MOST_RELATED).map(Self::new).collect();
        let more = others.count();
        if more > 0 {
            related.push(Self::message(format!("{more} more errors are not shown")));
        }
        Self {
            cause: Cause::find(error.source(), &error.to_string(), MOST_CAUSES),
            severity: error.severity(),
            help: error.help().map(|help| text::plain(&help.to_string())),
            source,
            labels,
            related,
            ..Self::message(text::plain(&error.to_string()))
        }
    }

    fn message(message: String) -> Self {
        Self {
            message,
            cause: None,
            severity: None,
            help: None,
            source: None,
            labels: Vec::new(),
            related: Vec::new(),
        }
    }
}

impl Cause {
    /// Cause of an error with the message `said`. A cause whose message is part of it is skipped.
    fn find(
        error: Option<&(dyn std::error::Error + 'static)>,
        said: &str,
        most: usize,
    ) -> Option<Self> {
        let error = error.filter(|_| most > 0)?;
        let message = error.to_string();
        if said.contains(&message) {
            return Self::find(error.source(), said, most - 1);
        }
        Some(Self {
            cause: Self::find(error.source(), &message, most - 1).map(Box::new),
            message: text::plain(&message),
        })
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Cause {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.cause.as_ref().map(|cause| cause.as_ref() as _)
    }
}

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Shown<'_> {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.cause.as_ref().map(|cause| cause as _)
    }
}

impl Diagnostic for Shown<'_> {
    fn severity(&self) -> Option<Severity> {
        self.severity
    }
    fn help<'b>(&'b self) -> Option<Box<dyn fmt::Display + 'b>> {
        self.help.as_ref().map(|help| Box::new(help) as _)
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        match self.source.as_ref()? {
            ShownSource::Whole(source) => Some(source.0),
            ShownSource::Line(line) => Some(line),
        }
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        (!self.labels.is_empty()).then(|| Box::new(self.labels.iter().cloned()) as _)
    }
    fn related<'b>(&'b self) -> Option<Box<dyn Iterator<Item = &'b dyn Diagnostic> + 'b>> {
        let related = self.related.iter().map(|r| r as &dyn Diagnostic);
        (!self.related.is_empty()).then(|| Box::new(related) as _)
    }
}

/// Source text that labels point at.
#[derive(Debug)]
enum ShownSource<'a> {
    /// The whole source text, unchanged.
    Whole(Borrowed<'a>),
    /// Part of the line of the first label.
    Line(Line),
}

struct Borrowed<'a>(&'a dyn SourceCode);

impl fmt::Debug for Borrowed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Borrowed")
    }
}

/// Source and labels to be shown: the source with its labels if it is short and plain around each
/// of them; else part of the line of the primary label, and that label alone.
fn shown_source(
    source: &dyn SourceCode,
    labels: Vec<LabeledSpan>,
) -> (Option<ShownSource<'_>>, Vec<LabeledSpan>) {
    let labels: Vec<LabeledSpan> = labels
        .into_iter()
        .map(|mut label| {
            label.set_label(label.label().map(text::plain));
            label
        })
        .collect();
    let is_plain = |label: &LabeledSpan| {
        let Ok(around) = source.read_span(label.inner(), 1, 1) else {
            return false;
        };
        let data = around.data();
        data.len() <= MOST_OF_A_SOURCE
            && data
                .split(|b| *b == b'\n')
                .all(|l| l.len() <= MOST_OF_A_LINE)
            && std::str::from_utf8(data)
                .is_ok_and(|text| text.replace("\r\n", "\n").chars().all(text::is_plain))
            && around
                .name()
                .is_none_or(|name| name.chars().all(text::is_plain))
    };
    if labels.iter().all(is_plain) {
        return (Some(ShownSource::Whole(Borrowed(source))), labels);
    }
    let primary = labels.iter().find(|l| l.primary()).or(labels.first());
    match primary.and_then(|label| Line::find(source, label)) {
        Some((line, label)) => (Some(ShownSource::Line(line)), vec![label]),
        None => (None, Vec::new()),
    }
}

/// Part of a line, made plain, with its original place.
#[derive(Debug)]
struct Line {
    name: String,
    text: String,
    /// Number of the line, counted from 0.
    line: usize,
    /// Number of the column, counted from 0.
    column: usize,
}

impl Line {
    /// Part of the line in which a label begins, around the label, and the label in it.
    fn find(source: &dyn SourceCode, label: &LabeledSpan) -> Option<(Self, LabeledSpan)> {
        let place = source.read_span(label.inner(), 0, 0).ok()?;
        let around = source.read_span(label.inner(), 1, 1).ok()?;
        let at = label.offset().checked_sub(around.span().offset())?;
        let (before, from) = around.data().split_at_checked(at)?;
        let before = before.rsplit(|b| *b == b'\n').next().unwrap_or_default();
        let line_end = |text: &[u8]| text.iter().position(|b| *b == b'\n').unwrap_or(text.len());
        let from = &from[..line_end(from)];
        let (here, behind) = from.split_at(label.len().min(from.len()));
        let [before, here, behind] = [before, here, behind].map(String::from_utf8_lossy);
        let [most_before, most_here, most_behind] = WINDOW;
        let head = match before.char_indices().rev().nth(most_before) {
            Some((cut, c)) => format!("...{}", &before[cut + c.len_utf8()..]),
            None => before.into_owned(),
        };
        let first_of = |text: &str, most: usize| match text.char_indices().nth(most) {
            Some((cut, _)) => format!("{}...", &text[..cut]),
            None => text.to_owned(),
        };
        let visible = |text: &str| text::visible(&text.replace('\t', " "));
        let (head, here) = (visible(&head), visible(&first_of(&here, most_here)));
        let span = head.len()..head.len() + here.len();
        let line = Self {
            name: place.name().map(text::plain).unwrap_or_default(),
            text: format!("{head}{here}{}", visible(&first_of(&behind, most_behind))),
            line: place.line(),
            column: place.column(),
        };
        let label = LabeledSpan::new_primary_with_span(label.label().map(str::to_owned), span);
        Some((line, label))
    }
}

impl SourceCode for Line {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        _: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        if span.offset() + span.len() > self.text.len() {
            return Err(MietteError::OutOfBounds);
        }
        // The whole line stands at column 0, the label alone where it was.
        let column = if lines_before == 0 { self.column } else { 0 };
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.clone(),
            self.text.as_bytes(),
            (0, self.text.len()).into(),
            self.line,
            column,
            1,
        )))
    }
}
