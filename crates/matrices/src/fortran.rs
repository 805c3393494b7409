//! Fortran formats of numbers in columns of lines: `(3D24.16)`, `(1X,8I9)`,
//! `(1P,2(2X,E22.15))`.
//!
//! The parts of a format that concern input are read here: repeat counts, groups, positions (X, T,
//! TL, TR), ends of lines (/), scale factors (P), decimals of numbers without a point, blanks in
//! numbers (BN, BZ) and decimal commas (DC, DP). A format goes on in the next line with its last
//! group.

use std::borrow::Cow;

use crate::error::{MatrixFault, Read, WRITE_AGAIN};
use crate::text::{self, TextLines};

/// Most steps of a format, and its largest number.
const MOST: usize = 10_000;
/// Most groups within one another.
const MOST_DEPTH: usize = 50;

/// One step through a line.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    Field {
        width: usize,
        decimals: i64,
    },
    Right(usize),
    Left(usize),
    /// Column, counted from 0.
    Column(usize),
    NextLine,
    /// Colon: nothing behind it is done without a further number.
    Stop,
    Scale(i64),
    Blanks {
        are_zeros: bool,
    },
    Decimal {
        is_comma: bool,
    },
}

/// Format of numbers.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FortranFormat {
    steps: Vec<Step>,
    /// Step with which it goes on at its end.
    again: usize,
}

impl FortranFormat {
    /// Format of a text such as `(3D24.16)`; `None` for a text of another kind.
    pub fn new(text: &[u8]) -> Option<Self> {
        let letters = text.iter().filter(|b| !b.is_ascii_whitespace());
        let text: Vec<u8> = letters.map(u8::to_ascii_uppercase).collect();
        let mut parser = Parser {
            rest: text.strip_prefix(b"(")?,
            steps: Vec::new(),
            again: 0,
        };
        parser.group(0)?;
        let Parser { rest, steps, again } = parser;
        let has_field = |steps: &[Step]| steps.iter().any(|s| matches!(s, Step::Field { .. }));
        (rest.is_empty() && has_field(&steps[again..])).then_some(Self { steps, again })
    }

    /// Formats one behind the other, each in parentheses. `None` if other text is between them.
    pub fn several(line: &[u8]) -> Option<Vec<&[u8]>> {
        let mut formats = Vec::new();
        let (mut depth, mut from) = (0usize, 0);
        for (at, byte) in line.iter().enumerate() {
            match byte {
                b'(' => {
                    if depth == 0 {
                        from = at;
                    }
                    depth += 1;
                }
                b')' => {
                    depth = depth.checked_sub(1)?;
                    if depth == 0 {
                        formats.push(&line[from..=at]);
                    }
                }
                other if depth == 0 && !other.is_ascii_whitespace() => return None,
                _ => {}
            }
        }
        (depth == 0).then_some(formats)
    }
}

struct Parser<'a> {
    /// Capital letters without blanks.
    rest: &'a [u8],
    steps: Vec<Step>,
    again: usize,
}

impl Parser<'_> {
    /// Reads items up to the end of a group. `depth` is 0 for the whole format.
    fn group(&mut self, depth: usize) -> Option<()> {
        loop {
            match *self.rest {
                [b')', ref rest @ ..] => {
                    self.rest = rest;
                    return Some(());
                }
                [b',', ref rest @ ..] => self.rest = rest,
                [b':', ref rest @ ..] => {
                    self.steps.push(Step::Stop);
                    self.rest = rest;
                }
                _ => self.item(depth)?,
            }
        }
    }

    fn item(&mut self, depth: usize) -> Option<()> {
        let number = self.number()?;
        let count = match number {
            None => Some(1),
            Some(n) => usize::try_from(n).ok().filter(|n| (1..=MOST).contains(n)),
        };
        let (letter, rest) = self.rest.split_first()?;
        self.rest = rest;
        let from = self.steps.len();
        match letter {
            b'(' if depth < MOST_DEPTH => {
                self.group(depth + 1)?;
                if depth == 0 {
                    self.again = from;
                }
                return self.repeat(from, count?);
            }
            b'/' => self.steps.push(Step::NextLine),
            b'P' => {
                let scale = number.filter(|n| n.unsigned_abs() <= MOST as u64)?;
                self.steps.push(Step::Scale(scale));
                return Some(());
            }
            b'X' => {
                self.steps.push(Step::Right(count?));
                return Some(());
            }
            b'D' if matches!(self.rest.first(), Some(b'C' | b'P')) && number.is_none() => {
                let is_comma = self.rest[0] == b'C';
                self.rest = &self.rest[1..];
                self.steps.push(Step::Decimal { is_comma });
            }
            b'I' | b'F' | b'D' | b'G' => self.field(*letter)?,
            b'E' => {
                // EN and ES read as E does.
                self.rest = match *self.rest {
                    [b'N' | b'S', ref rest @ ..] => rest,
                    _ => self.rest,
                };
                self.field(b'E')?;
            }
            _ if number.is_some() => return None,
            letter => self.mode(*letter)?,
        }
        self.repeat(from, count?)
    }

    /// Reads the width, the decimals and the digits of the exponent behind the letter of a number.
    fn field(&mut self, letter: u8) -> Option<()> {
        let width = self.whole_number().filter(|n| *n > 0)?;
        let mut decimals = 0;
        if let [b'.', rest @ ..] = self.rest {
            self.rest = rest;
            decimals = self.whole_number()?;
        }
        if let ([b'E' | b'D', rest @ ..], b'E' | b'D' | b'G') = (self.rest, letter)
            && rest.first().is_some_and(u8::is_ascii_digit)
        {
            self.rest = rest;
            self.whole_number()?;
        }
        // The second number of I is the least number of digits.
        let decimals = if letter == b'I' { 0 } else { decimals as i64 };
        self.steps.push(Step::Field { width, decimals });
        Some(())
    }

    /// Reads an item that is not repeated.
    fn mode(&mut self, letter: u8) -> Option<()> {
        let second = self.rest.first().copied();
        let step = match (letter, second) {
            (b'T', Some(b'L' | b'R')) => {
                self.rest = &self.rest[1..];
                let by = self.whole_number()?;
                match second {
                    Some(b'L') => Step::Left(by),
                    _ => Step::Right(by),
                }
            }
            (b'T', _) => Step::Column(self.whole_number()?.checked_sub(1)?),
            (b'B', Some(b'N' | b'Z')) => {
                self.rest = &self.rest[1..];
                let are_zeros = second == Some(b'Z');
                Step::Blanks { are_zeros }
            }
            // Signs and rounding say nothing about input.
            (b'S', Some(b'P' | b'S')) | (b'R', Some(b'U' | b'D' | b'Z' | b'N' | b'C' | b'P')) => {
                self.rest = &self.rest[1..];
                return Some(());
            }
            (b'S', _) => return Some(()),
            _ => return None,
        };
        self.steps.push(step);
        Some(())
    }

    fn repeat(&mut self, from: usize, count: usize) -> Option<()> {
        let to = self.steps.len();
        if (to - from).checked_mul(count)? + from > MOST {
            return None;
        }
        for _ in 1..count {
            self.steps.extend_from_within(from..to);
        }
        Some(())
    }

    /// Number before an item, if there is one.
    fn number(&mut self) -> Option<Option<i64>> {
        let (sign, digits) = match *self.rest {
            [b'-', ref rest @ ..] => (-1, rest),
            [b'+', ref rest @ ..] => (1, rest),
            _ if self.rest.first().is_some_and(u8::is_ascii_digit) => (1, self.rest),
            _ => return Some(None),
        };
        self.rest = digits;
        self.whole_number().map(|n| Some(sign * n as i64))
    }

    fn whole_number(&mut self) -> Option<usize> {
        let is_digit = |b: &&u8| b.is_ascii_digit();
        let digits = self.rest.iter().take_while(is_digit).count();
        let (number, rest) = self.rest.split_at(digits);
        self.rest = rest;
        let number = usize::try_from(text::parse_whole_number(number)?).ok();
        number.filter(|n| *n <= MOST)
    }
}

/// Numbers in a format, one behind the other, from the next line on.
pub(crate) struct FortranNumbers<'a, 'b> {
    lines: &'a mut TextLines<'b>,
    format: &'a FortranFormat,
    /// Rest of the steps in the line.
    next: usize,
    /// Line and column, once the first line is read.
    line: Option<(&'b [u8], usize)>,
    reading: Reading,
}

/// Settings of the steps before a field for its number.
#[derive(Debug, Clone, Copy, Default)]
struct Reading {
    scale: i64,
    blanks_are_zeros: bool,
    has_comma: bool,
}

impl<'a, 'b> FortranNumbers<'a, 'b> {
    pub fn new(lines: &'a mut TextLines<'b>, format: &'a FortranFormat) -> Self {
        Self {
            lines,
            format,
            next: 0,
            line: None,
            reading: Reading::default(),
        }
    }

    /// Number of the line of the last field.
    pub fn line_number(&self) -> usize {
        self.lines.number()
    }

    /// Next field.
    ///
    /// # Errors
    /// The text ends before `missing`.
    pub fn next(&mut self, missing: &str) -> Read<FortranField<'b>> {
        let (mut line, mut column) = match self.line {
            Some(place) => place,
            None => (self.lines.required(missing)?, 0),
        };
        loop {
            let Some(step) = self.format.steps.get(self.next) else {
                self.next = self.format.again;
                (line, column) = (self.lines.required(missing)?, 0);
                continue;
            };
            self.next += 1;
            match *step {
                Step::Right(by) => column += by,
                Step::Left(by) => column = column.saturating_sub(by),
                Step::Column(to) => column = to,
                Step::NextLine => (line, column) = (self.lines.required(missing)?, 0),
                Step::Stop => {}
                Step::Scale(scale) => self.reading.scale = scale,
                Step::Blanks { are_zeros } => self.reading.blanks_are_zeros = are_zeros,
                Step::Decimal { is_comma } => self.reading.has_comma = is_comma,
                Step::Field { width, decimals } => {
                    let from = column.min(line.len());
                    let to = (column + width).min(line.len());
                    self.line = Some((line, column + width));
                    return Ok(FortranField {
                        text: self.reading.strip_blanks(&line[from..to]),
                        decimals,
                        scale: self.reading.scale,
                    });
                }
            }
        }
    }
}

/// Behind the last number the format goes on up to the next one: lines that it ends are left.
impl Drop for FortranNumbers<'_, '_> {
    fn drop(&mut self) {
        let rest = self.format.steps[self.next..].iter();
        let rest = rest.take_while(|s| !matches!(s, Step::Field { .. } | Step::Stop));
        let ends = rest.filter(|s| matches!(s, Step::NextLine)).count();
        if self.line.is_some() && ends > 0 {
            self.lines.nth(ends - 1);
        }
    }
}

impl Reading {
    /// Text of a number without the blanks that Fortran overlooks in it.
    fn strip_blanks(self, field: &[u8]) -> Cow<'_, [u8]> {
        let trimmed = field.trim_ascii();
        let is_plain = !trimmed.iter().any(u8::is_ascii_whitespace) && !self.has_comma;
        if is_plain && !(self.blanks_are_zeros && field.trim_ascii_end().len() < field.len()) {
            return Cow::Borrowed(trimmed);
        }
        let field = if self.blanks_are_zeros && !trimmed.is_empty() {
            field.trim_ascii_start()
        } else {
            trimmed
        };
        let read = field.iter().filter_map(|b| match b {
            b' ' | b'\t' => self.blanks_are_zeros.then_some(b'0'),
            b',' if self.has_comma => Some(b'.'),
            other => Some(*other),
        });
        Cow::Owned(read.collect())
    }
}

/// Field with a number.
pub(crate) struct FortranField<'b> {
    text: Cow<'b, [u8]>,
    /// Digits behind the point where the number has none.
    decimals: i64,
    /// Power of ten by which a number without an exponent is divided.
    scale: i64,
}

impl FortranField<'_> {
    pub fn text(&self) -> &[u8] {
        &self.text
    }

    /// Value of an entry of a matrix.
    ///
    /// # Errors
    /// The field is not a finite number.
    pub fn value(&self, line: usize) -> Read<f64> {
        let text = &self.text[..];
        let is_mark = |(i, b): (usize, &u8)| match b {
            b'E' | b'D' | b'e' | b'd' => true,
            b'+' | b'-' => i > 0,
            _ => false,
        };
        let mark = text.iter().enumerate().position(is_mark);
        let mut by = 0;
        if self.decimals != 0 && !text.contains(&b'.') {
            by -= self.decimals;
        }
        if self.scale != 0 && mark.is_none() {
            by -= self.scale;
        }
        let is_number = text.iter().any(u8::is_ascii_digit);
        if by == 0 || !is_number {
            return text::value(text, line);
        }
        let wrong = || {
            let expected = "the value of an entry";
            MatrixFault::malformed(text::quoted(text), expected, WRITE_AGAIN).locate_line(line)
        };
        let (digits, exponent) = text.split_at(mark.unwrap_or(text.len()));
        let is_letter = exponent.first().is_some_and(u8::is_ascii_alphabetic);
        let exponent = match &exponent[usize::from(is_letter)..] {
            [] if !is_letter => 0,
            digits => text::signed(digits).ok_or_else(wrong)?,
        };
        let mut shifted = digits.to_vec();
        let exponent = exponent.saturating_add(by);
        shifted.extend_from_slice(format!("e{exponent}").as_bytes());
        text::value(&shifted, line).map_err(|_| wrong())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of the first fields of a text in a format.
    #[track_caller]
    fn read(format: &str, text: &str, count: usize) -> Vec<f64> {
        let format = FortranFormat::new(format.as_bytes()).expect(format);
        let mut lines = TextLines::new(text.as_bytes());
        let mut numbers = FortranNumbers::new(&mut lines, &format);
        let mut value = |_| {
            let field = numbers.next("a number").unwrap();
            field.value(numbers.line_number()).unwrap()
        };
        (0..count).map(&mut value).collect()
    }

    #[test]
    fn numbers_stand_in_columns() {
        for (format, text, expected) in [
            ("(3I2)", " 1 2 3\n 4\n", &[1.0, 2.0, 3.0, 4.0][..]),
            ("(1X,2I2)", "x 1 2\nx 3\n", &[1.0, 2.0, 3.0]),
            ("(2(I2,1X))", " 1x 2x\n 3x", &[1.0, 2.0, 3.0]),
            ("( 2 ( x, 1 i 2 ) )", "x 1x 2\nx 3", &[1.0, 2.0, 3.0]),
            ("(3(1X,(I1)))", " 1 2 3\n 4", &[1.0, 2.0, 3.0, 4.0]),
            // It goes on with the last group, which has a line of another form.
            (
                "(I1,2(1X,I2))",
                "1  2  3\n  4  5",
                &[1.0, 2.0, 3.0, 4.0, 5.0],
            ),
            ("(I1/2I1)", "1\n23\n4\n56", &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
            ("(T3,I1,TL3,I1,TR1,I1)", "1 234", &[2.0, 1.0, 2.0]),
            ("(SP,I2,2X,SS,I2:)", "+1ab 2", &[1.0, 2.0]),
        ] {
            assert_eq!(read(format, text, expected.len()), expected, "{format}");
        }
    }

    #[test]
    fn real_numbers_are_read_as_fortran_reads_them() {
        for (format, text, expected) in [
            ("(2E8.2)", " 1.5E+01-2.5E+00", &[15.0, -2.5][..]),
            ("(1P,2D8.1)", " 1.5D+01-2.5D-01", &[15.0, -0.25]),
            ("(1P2(E8.1))", " 1.5E+01-2.5E-01", &[15.0, -0.25]),
            // The scale divides numbers without an exponent, also in the next line.
            ("(2PF6.1)", "1234.5\n 150.0", &[12.345, 1.5]),
            ("(-1PF6.1,0PF6.1)", "   1.5   1.5", &[15.0, 1.5]),
            // No point: the last digits are the decimals.
            ("(F6.2,E6.3,I4)", "   125 125E1 125", &[1.25, 1.25, 125.0]),
            ("(1PE6.2)", "   125", &[0.125]),
            (
                "(G10.3,ES8.1E2,EN9.2E3)",
                "   1.25    1.5E+2 12.5E+03",
                &[1.25, 150.0, 12.5e3],
            ),
            // Exponents of three digits without a letter.
            ("(E9.2)", " 1.25-103", &[1.25e-103]),
            // Blanks in a number.
            ("(E8.1)", " 1.5D 02", &[150.0]),
            ("(BZ,I4,BN,I4)", " 1 2 1 2", &[102.0, 12.0]),
            ("(DC,F5.1,DP,F5.1)", "  1,5  1.5", &[1.5, 1.5]),
        ] {
            assert_eq!(read(format, text, expected.len()), expected, "{format}");
        }
    }

    #[test]
    fn what_is_no_format_of_numbers_is_none() {
        for text in [
            "",
            "8I10",
            "(8I10",
            "(8I10))",
            "(8A10)",
            "(I)",
            "(I0)",
            "(0I8)",
            "(-2I8)",
            "(P8E3.1)",
            "(1X)",
            "(I8,(1X))",
            "('a',I8)",
            "(3Habc,I8)",
            "(10000(10000I8))",
            "(99999I8)",
            "(T0,I8)",
            "(E8.)",
            "()",
            "(2)",
            "(L8)",
            "(1E99999999999999999999.1)",
        ] {
            assert_eq!(FortranFormat::new(text.as_bytes()), None, "{text}");
        }
        let deep = format!("{}I8{}", "(".repeat(1000), ")".repeat(1000));
        assert_eq!(FortranFormat::new(deep.as_bytes()), None);
    }

    #[test]
    fn formats_stand_one_behind_the_other() {
        let line = b"(1X,2(I8,1X))   (8I10)(1P,(3D24.16))  ";
        let found = FortranFormat::several(line).unwrap();
        assert_eq!(found, [&b"(1X,2(I8,1X))"[..], b"(8I10)", b"(1P,(3D24.16))"]);
        for line in [&b"(8I10) odd (8I10)"[..], b"(8I10", b"8I10)"] {
            assert_eq!(FortranFormat::several(line), None);
        }
    }
}
