//! Blocks of an archive, whose lines have fields of fixed widths as a Fortran format says.

use super::super::source::{label, number};
use crate::MeshError;

/// Widest line that a format may describe, characters. It keeps sums of widths small.
const WIDEST: usize = 10_000;

/// Fields of the lines of a block: `(3i9,6e21.13e3)`.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct BlockFormat {
    /// Beginning and end of each field of whole numbers or words.
    pub integers: Vec<[usize; 2]>,
    /// Beginning and end of each field of decimal numbers.
    pub floats: Vec<[usize; 2]>,
}

impl BlockFormat {
    /// Reads a format.
    ///
    /// # Errors
    /// The text is not a format.
    pub fn parse(line: &str) -> Result<Self, MeshError> {
        let wrong = || MeshError::BlockFormat {
            found: line.trim().to_owned(),
        };
        let inner = line
            .trim()
            .strip_prefix('(')
            .and_then(|l| l.split_once(')'));
        let (inner, _) = inner.ok_or_else(wrong)?;
        let mut format = Self::default();
        let mut at = 0;
        for item in inner.split(',') {
            let item = item.trim().to_ascii_lowercase();
            let letter = item.find(|c: char| !c.is_ascii_digit()).ok_or_else(wrong)?;
            let (count, rest) = item.split_at(letter);
            let count = match count {
                "" => 1,
                digits => digits.parse().map_err(|_| wrong())?,
            };
            let kind = rest.chars().next().ok_or_else(wrong)?;
            let width = rest[kind.len_utf8()..].split(['.', 'e', 'd']).next();
            let width: usize = width.unwrap_or("").parse().map_err(|_| wrong())?;
            let list = match kind {
                'i' | 'a' => &mut format.integers,
                'e' | 'f' | 'g' | 'd' => &mut format.floats,
                _ => return Err(wrong()),
            };
            if width == 0 || count == 0 || count > WIDEST || width * count > WIDEST {
                return Err(wrong());
            }
            for _ in 0..count {
                list.push([at, at + width]);
                at += width;
            }
        }
        match at > WIDEST || format.integers.is_empty() {
            true => Err(wrong()),
            false => Ok(format),
        }
    }
}

/// Text of a field without blanks; `None` behind the end of the line.
pub(super) fn field(line: &[u8], [start, end]: [usize; 2]) -> Option<&str> {
    if start >= line.len() {
        return None;
    }
    let bytes = line.get(start..end.min(line.len()))?.trim_ascii();
    // Bytes that are not text are not a number either.
    Some(std::str::from_utf8(bytes).unwrap_or("\u{fffd}"))
}

/// Whole number in a field, 0 in an empty one.
///
/// # Errors
/// Something else, or a negative number.
pub(super) fn natural(field: &str) -> Result<u64, MeshError> {
    match field {
        "" => Ok(0),
        text => label(text),
    }
}

/// Whole number in a field that may be negative, 0 in an empty one.
///
/// # Errors
/// Something else.
pub(super) fn integer(field: &str) -> Result<i64, MeshError> {
    let wrong = |_| MeshError::NotALabel {
        found: field.to_owned(),
    };
    match field {
        "" => Ok(0),
        text => text.parse().map_err(wrong),
    }
}

/// Number in a field, 0 in an empty one.
///
/// # Errors
/// Something else.
pub(super) fn float(field: &str) -> Result<f64, MeshError> {
    match field {
        "" => Ok(0.0),
        text => number(text),
    }
}

/// Returns `true` for a line that ends a block: `-1`, or a command.
pub(super) fn is_end(line: &[u8]) -> bool {
    let line = line.trim_ascii();
    let minus_one = line.strip_prefix(b"-1").is_some_and(|rest| {
        let is_rest = |b: &u8| matches!(b, b',' | b' ' | b'!');
        rest.first().is_none_or(is_rest)
    });
    minus_one && !line.contains(&b'.') && line.len() < 8 || is_command(line)
}

/// Returns `true` for a line of words instead of numbers.
pub(super) fn is_command(line: &[u8]) -> bool {
    let first = line.trim_ascii().first();
    first.is_some_and(|b| b.is_ascii_alphabetic() || matches!(b, b'/' | b'*' | b'!' | b'~' | b'_'))
}

/// Adds the members that the numbers of a component mean: a negative one ends a range that the one
/// before it begins.
///
/// # Errors
/// A range without a beginning, or backwards.
pub(super) fn add_members(members: &mut Vec<(u64, u64)>, number: i64) -> Result<(), MeshError> {
    if number > 0 {
        members.push((number.unsigned_abs(), number.unsigned_abs()));
        return Ok(());
    }
    let wrong = MeshError::ComponentRange { number };
    let last = members.last_mut().ok_or(wrong)?;
    if number == 0 || number.unsigned_abs() < last.1 {
        return Err(MeshError::ComponentRange { number });
    }
    last.1 = number.unsigned_abs();
    Ok(())
}
