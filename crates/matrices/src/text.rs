//! Lines, fields and numbers of a text in bytes, without memory of their own. This file alone knows
//! fast-float2 and memchr.

use crate::error::{Failure, MatrixFault, Read, WRITE_AGAIN};

/// Most characters of a word in a message.
const MOST_OF_A_WORD: usize = 60;

/// Lines of a text without their ends, with their numbers from 1.
#[derive(Debug, Clone)]
pub(crate) struct TextLines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> TextLines<'a> {
    pub fn new(text: &'a [u8]) -> Self {
        let rest = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
        Self { rest, number: 0 }
    }

    /// Number of the last line.
    pub fn number(&self) -> usize {
        self.number
    }

    /// Number of bytes that follow the last line.
    pub fn bytes_left(&self) -> usize {
        self.rest.len()
    }

    /// Next line.
    ///
    /// # Errors
    /// The text has come to its end before `missing`.
    pub fn required(&mut self, missing: &str) -> Read<&'a [u8]> {
        let next = self.next().map(|(_, line)| line);
        next.ok_or_else(|| cut_off_failure(missing))
    }
}

impl<'a> Iterator for TextLines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let (line, rest) = match memchr::memchr(b'\n', self.rest) {
            Some(at) => (&self.rest[..at], &self.rest[at + 1..]),
            None => (self.rest, &[][..]),
        };
        self.rest = rest;
        Some((self.number, line.strip_suffix(b"\r").unwrap_or(line)))
    }
}

pub(crate) fn cut_off_failure(missing: &str) -> Failure {
    let missing = missing.to_owned();
    MatrixFault::CutOff { missing }.locate_file()
}

/// Fields between blanks or single commas. Commas follow one another only round an empty field.
pub(crate) fn fields(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    let is_between = |b: &u8| b.is_ascii_whitespace() || *b == b',';
    line.split(is_between).filter(|field| !field.is_empty())
}

/// The fields of a line, if there are exactly so many.
pub(crate) fn exactly<const N: usize>(line: &[u8]) -> Option<[&[u8]; N]> {
    let mut fields_in_order = [&[][..]; N];
    let mut fields = fields(line);
    for place in &mut fields_in_order {
        *place = fields.next()?;
    }
    fields.next().is_none().then_some(fields_in_order)
}

/// Whole number without a sign.
pub(crate) fn parse_whole_number(field: &[u8]) -> Option<u64> {
    if field.is_empty() {
        return None;
    }
    field.iter().try_fold(0u64, |number, digit| {
        let digit = digit.checked_sub(b'0').filter(|digit| *digit < 10)?;
        number.checked_mul(10)?.checked_add(u64::from(digit))
    })
}

/// Whole number, which may have a sign.
pub(crate) fn signed(field: &[u8]) -> Option<i64> {
    let (sign, digits) = match field {
        [b'-', digits @ ..] => (-1, digits),
        [b'+', digits @ ..] => (1, digits),
        digits => (1, digits),
    };
    i64::try_from(parse_whole_number(digits)?)
        .ok()
        .map(|number| sign * number)
}

/// Number, also as Fortran writes it: `1.5D+3`, and `1.5-103` where the exponent has three digits.
/// Infinite and undefined numbers are numbers here.
pub(crate) fn number(field: &[u8]) -> Option<f64> {
    if let Ok(value) = fast_float2::parse(field) {
        return Some(value);
    }
    let mut text = [0; 64];
    if field.len() >= text.len() {
        return None;
    }
    let mut length = 0;
    let mut has_exponent = false;
    for (i, byte) in field.iter().enumerate() {
        let byte = match byte {
            b'd' | b'D' | b'e' | b'E' => {
                has_exponent = true;
                b'e'
            }
            b'+' | b'-' if i > 0 && !has_exponent => {
                has_exponent = true;
                text[length] = b'e';
                length += 1;
                *byte
            }
            other => *other,
        };
        *text.get_mut(length)? = byte;
        length += 1;
    }
    fast_float2::parse(&text[..length]).ok()
}

/// Value of an entry of a matrix.
///
/// # Errors
/// The field is not a finite number.
pub(crate) fn value(field: &[u8], line: usize) -> Read<f64> {
    match number(field) {
        Some(value) if value.is_finite() => Ok(value),
        Some(_) => Err(MatrixFault::NotFinite {
            what: "an entry",
            found: printable(field),
        }
        .locate_line(line)),
        None => {
            let expected = "the value of an entry";
            Err(MatrixFault::malformed(quoted(field), expected, WRITE_AGAIN).locate_line(line))
        }
    }
}

/// Bytes in the form for messages: bounded, and without what a terminal would obey.
pub(crate) fn printable(bytes: &[u8]) -> String {
    let some = &bytes[..bytes.len().min(8 * MOST_OF_A_WORD)];
    let text = String::from_utf8_lossy(some.trim_ascii());
    let mut shown = String::new();
    for c in text.chars() {
        if shown.chars().count() >= MOST_OF_A_WORD {
            shown.push_str("...");
            break;
        }
        if c.is_ascii_graphic() || c == ' ' || c.is_alphanumeric() {
            shown.push(c);
        } else {
            shown.extend(c.escape_default());
        }
    }
    shown
}

/// Bytes between marks, or words for an empty field.
pub(crate) fn quoted(bytes: &[u8]) -> String {
    match bytes.trim_ascii() {
        [] => "nothing".to_owned(),
        bytes => format!("`{}`", printable(bytes)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_fortran_writes_them() {
        for (text, expected) in [
            ("1", 1.0),
            ("-.25", -0.25),
            ("+1.5E+03", 1500.0),
            ("1.5D+3", 1500.0),
            ("1.5d-3", 1.5e-3),
            ("1.25-103", 1.25e-103),
            ("-1.25+103", -1.25e103),
            ("0.0000000000000", 0.0),
        ] {
            assert_eq!(number(text.as_bytes()), Some(expected), "{text}");
        }
        for text in [
            "",
            "-",
            "1.0x",
            "1.5E+3-4",
            "1 2",
            "1,5",
            &"1-".repeat(50),
            "0x1",
        ] {
            assert_eq!(number(text.as_bytes()), None, "{text}");
        }
        assert_eq!(number(b"1e999"), Some(f64::INFINITY));
    }

    #[test]
    fn whole_numbers_are_bounded() {
        assert_eq!(parse_whole_number(b"0012"), Some(12));
        for text in ["", "-1", "1.0", "+1", "99999999999999999999"] {
            assert_eq!(parse_whole_number(text.as_bytes()), None, "{text}");
        }
        assert_eq!(signed(b"-12"), Some(-12));
        assert_eq!(signed(b"--12"), None);
    }

    #[test]
    fn lines_have_their_numbers_whatever_ends_them() {
        let lines: Vec<_> = TextLines::new(b"\xef\xbb\xbfa\r\n\nb").collect();
        assert_eq!(lines, [(1, &b"a"[..]), (2, b""), (3, b"b")]);
    }

    #[test]
    fn nothing_that_a_terminal_obeys_is_shown() {
        let text = printable(b" a\x1b[2J\xff\n ");
        assert!(text.starts_with("a\\u{1b}[2J"), "{text}");
        assert!(printable(&[b'x'; 5000]).len() < 100);
        assert!(printable(&[0x9b; 5000]).len() < 100);
    }
}
