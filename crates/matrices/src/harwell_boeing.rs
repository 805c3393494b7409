//! Harwell-Boeing files of assembled real matrices, symmetric (RSA) or not (RUA), as Ansys writes
//! them by HBMAT: where the columns begin, the rows of the entries, and their values, in the Fortran
//! formats that the head names.

use crate::NamedMatrix;
use crate::entries::{Entries, check_size};
use crate::error::{Fault, Read, WRITE_AGAIN};
use crate::text::{self, Lines};

/// Type in the third line, if a text is such a file.
fn kind(bytes: &[u8]) -> Option<[u8; 3]> {
    let (_, line) = Lines::new(bytes).nth(2)?;
    let word = line.trim_ascii_start().get(..3)?;
    let kind = [0, 1, 2].map(|i| word[i].to_ascii_uppercase());
    let is_one =
        b"RCP".contains(&kind[0]) && b"SUHZR".contains(&kind[1]) && b"AE".contains(&kind[2]);
    let mut numbers = text::fields(&line.trim_ascii_start()[3..]);
    let is_number = numbers
        .next()
        .is_some_and(|field| text::whole(field).is_some());
    (is_one && is_number).then_some(kind)
}

/// Returns `true` for a Harwell-Boeing file.
pub(crate) fn is_one(bytes: &[u8]) -> bool {
    kind(bytes).is_some()
}

/// Width of a number and count of numbers of a line in a Fortran format such as `(3D24.16)`.
fn format(text: &[u8]) -> Option<(usize, usize)> {
    let upper = text.to_ascii_uppercase();
    let upper = upper.strip_prefix(b"(").unwrap_or(&upper);
    // A scale such as `1P,` or `1P`.
    let from = upper.iter().position(|b| *b == b'P').map_or(0, |at| at + 1);
    let upper = upper[from..].strip_prefix(b",").unwrap_or(&upper[from..]);
    let at = upper.iter().position(u8::is_ascii_alphabetic)?;
    let count = if at == 0 {
        Some(1)
    } else {
        text::whole(&upper[..at])
    }?;
    let digits = upper[at + 1..]
        .iter()
        .take_while(|b| b.is_ascii_digit())
        .count();
    let width = text::whole(&upper[at + 1..at + 1 + digits])?;
    let is_fine = (1..=1000).contains(&count) && (1..=60).contains(&width);
    is_fine.then_some((width as usize, count as usize))
}

/// Numbers in a Fortran format, one behind the other.
struct Numbers<'a, 'b> {
    lines: &'a mut Lines<'b>,
    width: usize,
    /// Numbers of a full line.
    count: usize,
    line: &'b [u8],
    left: usize,
}

impl<'a, 'b> Numbers<'a, 'b> {
    /// Numbers of a width, so many of them on a line, from the next line on.
    fn new(lines: &'a mut Lines<'b>, (width, count): (usize, usize)) -> Self {
        Self {
            lines,
            width,
            count,
            line: &[],
            left: 0,
        }
    }

    fn next(&mut self, what: &str) -> Read<&'b [u8]> {
        if self.left == 0 || self.line.is_empty() {
            self.line = self.lines.required(what)?;
            self.left = self.count;
        }
        self.left -= 1;
        let field;
        (field, self.line) = self.line.split_at(self.width.min(self.line.len()));
        Ok(field.trim_ascii())
    }
}

/// Reads a file.
pub(crate) fn parse(bytes: &[u8]) -> Read<NamedMatrix> {
    let mut lines = Lines::new(bytes);
    let Some(kind) = kind(bytes) else {
        return Err(Fault::UnknownFormat.in_file());
    };
    if kind[0] != b'R' || kind[2] != b'A' || !b"SU".contains(&kind[1]) {
        let what = format!("a Harwell-Boeing file of the type {}", text::shown(&kind));
        let remedy = "write an assembled real matrix (RSA or RUA)";
        return Err(Fault::NotRead { what, remedy }.at_line(3));
    }
    lines.next();
    let counts = lines.required("the counts of lines")?;
    let third = lines.required("its type")?.trim_ascii_start();
    let formats = lines.required("the formats of its numbers")?;
    let wrong = |line: &[u8], expected: &str, number: usize| {
        Fault::malformed(text::quoted(line), expected, WRITE_AGAIN).at_line(number)
    };
    let mut sizes = text::fields(&third[3..]).map(text::whole);
    let mut size = || sizes.next().flatten();
    let (Some(rows), Some(columns), Some(count)) = (size(), size(), size()) else {
        return Err(wrong(third, "the numbers of rows, columns and entries", 3));
    };
    // The fifth count is that of lines of right-hand sides, which have a line of the head.
    let sides = text::fields(counts).nth(4).and_then(text::whole);
    if sides.is_some_and(|sides| sides > 0) {
        lines.required("the type of its right-hand sides")?;
    }
    let mut formats = formats
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
        .map(format);
    let mut form = || formats.next().flatten();
    let (Some(of_columns), Some(of_rows), Some(of_values)) = (form(), form(), form()) else {
        let expected = "formats of numbers, such as (8I10) (8I10) (3D24.16)";
        return Err(wrong(lines_shown(bytes, 4), expected, 4));
    };
    let left = lines.bytes_left();
    let (rows, columns) = check_size(rows, columns, left).map_err(|fault| fault.at_line(3))?;
    let count = match usize::try_from(count) {
        Ok(count) if count <= left / 2 + 1 && columns <= left / 2 + 1 => count,
        _ => {
            let announced = format!("a matrix of {columns} columns with {count} entries");
            return Err(Fault::TooLarge {
                announced,
                bytes: left,
            }
            .at_line(3));
        }
    };
    if kind[1] == b'S' && rows != columns {
        let found = format!("a symmetric matrix of {rows} x {columns}");
        return Err(Fault::malformed(found, "as many rows as columns", WRITE_AGAIN).at_line(3));
    }
    let mut list = |form: (usize, usize), n: usize, what: &'static str, most: usize| {
        let mut numbers = Numbers::new(&mut lines, form);
        let mut list = Vec::with_capacity(n);
        for _ in 0..n {
            let field = numbers.next(what)?;
            let found = text::whole(field).filter(|n| (1..=most as u64).contains(n));
            let number = numbers.lines.number();
            let found = found.ok_or_else(|| {
                let found = text::quoted(field);
                Fault::OutOfRange { what, found, most }.at_line(number)
            })?;
            list.push(found as usize - 1);
        }
        Ok(list)
    };
    let begin = list(of_columns, columns + 1, "beginning of a column", count + 1)?;
    let of = list(of_rows, count, "row", rows)?;
    if !begin.is_sorted() || begin.first() != Some(&0) || begin.last() != Some(&count) {
        let found = "columns that do not begin one behind the other".to_owned();
        let expected = format!("beginnings from 1 up to {}", count + 1);
        return Err(Fault::malformed(found, expected, WRITE_AGAIN).in_file());
    }
    let mut numbers = Numbers::new(&mut lines, of_values);
    let mut entries = Entries::new(rows, columns);
    entries.reserve(count);
    for j in 0..columns {
        for row in &of[begin[j]..begin[j + 1]] {
            let field = numbers.next("the values of its entries")?;
            let value = text::value(field, numbers.lines.number())?;
            entries.push(*row, j, value);
        }
    }
    let matrix = if kind[1] == b'S' {
        entries.into_whole_matrix()?
    } else {
        entries.into_matrix()?
    };
    Ok(NamedMatrix {
        name: None,
        matrix,
        rows: None,
    })
}

/// Line of a text, counted from 1.
fn lines_shown(bytes: &[u8], number: usize) -> &[u8] {
    Lines::new(bytes)
        .nth(number - 1)
        .map_or(&[], |(_, line)| line)
}
