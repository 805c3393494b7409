//! Harwell-Boeing files of assembled real matrices, symmetric (RSA) or not (RUA), as Ansys writes
//! them by HBMAT: where the columns begin, the rows of the entries, and their values, in the
//! Fortran formats that the head names.

use crate::NamedMatrix;
use crate::entries::{Entries, check_size};
use crate::error::{MatrixFault, Read, WRITE_AGAIN};
use crate::fortran::{FortranFormat, FortranNumbers};
use crate::text::{self, TextLines};

/// Type in the third line, if a text is such a file.
fn kind(bytes: &[u8]) -> Option<[u8; 3]> {
    let (_, line) = TextLines::new(bytes).nth(2)?;
    let word = line.trim_ascii_start().get(..3)?;
    let kind = [0, 1, 2].map(|i| word[i].to_ascii_uppercase());
    let is_one =
        b"RCP".contains(&kind[0]) && b"SUHZR".contains(&kind[1]) && b"AE".contains(&kind[2]);
    let mut numbers = text::fields(&line.trim_ascii_start()[3..]);
    let is_number = numbers
        .next()
        .is_some_and(|field| text::parse_whole_number(field).is_some());
    (is_one && is_number).then_some(kind)
}

/// Returns `true` for a Harwell-Boeing file.
pub(crate) fn is_harwell_boeing(bytes: &[u8]) -> bool {
    kind(bytes).is_some()
}

/// Reads a file.
pub(crate) fn parse(bytes: &[u8]) -> Read<NamedMatrix> {
    let mut lines = TextLines::new(bytes);
    let Some(kind) = kind(bytes) else {
        return Err(MatrixFault::UnknownFormat.locate_file());
    };
    if kind[0] != b'R' || kind[2] != b'A' || !b"SU".contains(&kind[1]) {
        let what = format!(
            "a Harwell-Boeing file of the type {}",
            text::printable(&kind)
        );
        let remedy = "write an assembled real matrix (RSA or RUA)";
        return Err(MatrixFault::NotRead { what, remedy }.locate_line(3));
    }
    lines.next();
    let counts = lines.required("the counts of lines")?;
    let third = lines.required("its type")?.trim_ascii_start();
    let head = lines.required("the formats of its numbers")?;
    let wrong = |line: &[u8], expected: &str, number: usize| {
        MatrixFault::malformed(text::quoted(line), expected, WRITE_AGAIN).locate_line(number)
    };
    let mut sizes = text::fields(&third[3..]).map(text::parse_whole_number);
    let mut size = || sizes.next().flatten();
    let (Some(rows), Some(columns), Some(count)) = (size(), size(), size()) else {
        return Err(wrong(third, "the numbers of rows, columns and entries", 3));
    };
    // The fifth count is that of lines of right-hand sides, which have a line of the head.
    let sides = text::fields(counts)
        .nth(4)
        .and_then(text::parse_whole_number);
    if sides.is_some_and(|sides| sides > 0) {
        lines.required("the type of its right-hand sides")?;
    }
    let [of_columns, of_rows, of_values] = three(head)?;
    let left = lines.bytes_left();
    let (rows, columns) = check_size(rows, columns, left).map_err(|fault| fault.locate_line(3))?;
    let count = match usize::try_from(count) {
        Ok(count) if count <= left / 2 + 1 && columns <= left / 2 + 1 => count,
        _ => {
            let announced = format!("a matrix of {columns} columns with {count} entries");
            return Err(MatrixFault::TooLarge {
                announced,
                bytes: left,
            }
            .locate_line(3));
        }
    };
    if kind[1] == b'S' && rows != columns {
        let found = format!("a symmetric matrix of {rows} x {columns}");
        return Err(
            MatrixFault::malformed(found, "as many rows as columns", WRITE_AGAIN).locate_line(3),
        );
    }
    let mut list = |format: &FortranFormat, n: usize, what: &'static str, most: usize| {
        let mut numbers = FortranNumbers::new(&mut lines, format);
        let mut list = Vec::with_capacity(n);
        for _ in 0..n {
            let field = numbers.next(what)?;
            let found =
                text::parse_whole_number(field.text()).filter(|n| (1..=most as u64).contains(n));
            let found = found.ok_or_else(|| {
                let found = text::quoted(field.text());
                MatrixFault::OutOfRange { what, found, most }.locate_line(numbers.line_number())
            })?;
            list.push(found as usize - 1);
        }
        Ok(list)
    };
    let begin = list(&of_columns, columns + 1, "beginning of a column", count + 1)?;
    let of = list(&of_rows, count, "row", rows)?;
    if !begin.is_sorted() || begin.first() != Some(&0) || begin.last() != Some(&count) {
        let found = "columns that do not begin one behind the other".to_owned();
        let expected = format!("beginnings from 1 up to {}", count + 1);
        return Err(MatrixFault::malformed(found, expected, WRITE_AGAIN).locate_file());
    }
    let mut numbers = FortranNumbers::new(&mut lines, &of_values);
    let mut entries = Entries::new(rows, columns);
    entries.reserve(count);
    for j in 0..columns {
        for row in &of[begin[j]..begin[j + 1]] {
            let field = numbers.next("the values of its entries")?;
            entries.push(*row, j, field.value(numbers.line_number())?);
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

/// Formats of the beginnings of columns, the rows and the values, of which the fourth line has a
/// further one for right-hand sides.
fn three(line: &[u8]) -> Read<[FortranFormat; 3]> {
    let wrong = |found: &[u8]| {
        let expected = "formats of numbers, such as (8I10) (1X,8I9) (1P,3D24.16)";
        MatrixFault::malformed(text::quoted(found), expected, WRITE_AGAIN).locate_line(4)
    };
    let formats = FortranFormat::several(line);
    let Some([columns, rows, values, ..]) = formats.as_deref() else {
        return Err(wrong(line));
    };
    let of = |text: &[u8]| FortranFormat::new(text).ok_or_else(|| wrong(text));
    Ok([of(columns)?, of(rows)?, of(values)?])
}
