//! MatrixMarket files: entries with their places (coordinate) or column by column (array).

use std::fmt::Write as _;

use nalgebra_sparse::CscMatrix;

use crate::NamedMatrix;
use crate::entries::{Entries, check_size};
use crate::error::{Fault, Read, WRITE_AGAIN};
use crate::text::{self, Lines};

const HEADER: &str = "`%%MatrixMarket matrix coordinate real general` or one with array, integer \
                      or symmetric in it";

/// Parts of a matrix that a file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Symmetry {
    General,
    /// One triangle.
    Symmetric,
}

/// Returns `true` for the text of a MatrixMarket file.
pub(crate) fn is_one(bytes: &[u8]) -> bool {
    let text = bytes.trim_ascii_start();
    let word = b"matrixmarket";
    let start = text
        .strip_prefix(b"%")
        .map(|t| t.strip_prefix(b"%").unwrap_or(t));
    start.is_some_and(|t| t.len() >= word.len() && t[..word.len()].eq_ignore_ascii_case(word))
}

/// Reads a file.
pub(crate) fn parse(bytes: &[u8]) -> Read<NamedMatrix> {
    let mut lines = Lines::new(bytes);
    let (is_placed, symmetry) = header(&mut lines)?;
    let (number, size) = match content(&mut lines) {
        Some(line) => line,
        None => return Err(text::cut_off("the line with the size")),
    };
    let mut matrix = if is_placed {
        placed(&mut lines, number, size, symmetry)?
    } else {
        array(&mut lines, number, size, symmetry)?
    };
    if symmetry == Symmetry::Symmetric {
        matrix.mirror();
    }
    Ok(NamedMatrix {
        name: None,
        matrix: matrix.into_matrix()?,
        rows: None,
    })
}

fn header(lines: &mut Lines) -> Read<(bool, Symmetry)> {
    let blank = |line: &(usize, &[u8])| line.1.trim_ascii().is_empty();
    let Some((number, line)) = lines.by_ref().find(|line| !blank(line)) else {
        return Err(text::cut_off("its header"));
    };
    let lower = line.to_ascii_lowercase();
    let mut words = text::fields(&lower).skip(1);
    let mut word = || words.next().unwrap_or_default();
    let (object, form, field, symmetry) = (word(), word(), word(), word());
    let not_read = |what: &[u8], remedy: &'static str| {
        let what = format!("a MatrixMarket file of the kind `{}`", text::shown(what));
        Err(Fault::NotRead { what, remedy }.at_line(number))
    };
    let wrong = |found: &[u8]| {
        let remedy = "write it by `scipy.io.mmwrite`";
        Err(Fault::malformed(text::quoted(found), HEADER, remedy).at_line(number))
    };
    let is_placed = match (object, form) {
        (b"matrix", b"coordinate") => true,
        (b"matrix", b"array") => false,
        _ => return wrong(line),
    };
    match field {
        b"real" | b"integer" | b"double" => {}
        b"complex" => return not_read(field, "write the real part and the damping by themselves"),
        b"pattern" => return not_read(field, "write the matrix with its values"),
        _ => return wrong(line),
    }
    let symmetry = match symmetry {
        b"general" => Symmetry::General,
        b"symmetric" => Symmetry::Symmetric,
        b"skew-symmetric" | b"hermitian" => {
            let remedy = "stiffness and mass are symmetric: write them as general or symmetric";
            return not_read(symmetry, remedy);
        }
        _ => return wrong(line),
    };
    Ok((is_placed, symmetry))
}

/// Next line that is neither blank nor a comment.
fn content<'a>(lines: &mut Lines<'a>) -> Option<(usize, &'a [u8])> {
    lines
        .by_ref()
        .map(|(number, line)| (number, line.trim_ascii()))
        .find(|(_, line)| !line.is_empty() && line[0] != b'%')
}

/// Numbers of the line with the size.
fn size<const N: usize>(number: usize, line: &[u8], expected: &str) -> Read<[u64; N]> {
    let numbers = text::exactly::<N>(line).and_then(|fields| {
        let mut numbers = [0; N];
        for (number, field) in numbers.iter_mut().zip(fields) {
            *number = text::whole(field)?;
        }
        Some(numbers)
    });
    let wrong = || Fault::malformed(text::quoted(line), expected, WRITE_AGAIN).at_line(number);
    numbers.ok_or_else(wrong)
}

fn square(number: usize, rows: u64, columns: u64, symmetry: Symmetry) -> Read<()> {
    if symmetry == Symmetry::Symmetric && rows != columns {
        let found = format!("a symmetric matrix of {rows} x {columns}");
        let fault = Fault::malformed(found, "as many rows as columns", WRITE_AGAIN);
        return Err(fault.at_line(number));
    }
    Ok(())
}

/// Checks that as many bytes as are left hold this number of entries.
fn enough(number: usize, entries: u64, shortest: u64, left: usize) -> Read<usize> {
    // The last entry may lack the end of its line.
    match usize::try_from(entries) {
        Ok(count) if entries.saturating_mul(shortest) <= left as u64 + 1 => Ok(count),
        _ => {
            let announced = format!("a number of {entries} entries");
            Err(Fault::TooLarge {
                announced,
                bytes: left,
            }
            .at_line(number))
        }
    }
}

/// Reads entries with their places.
fn placed(lines: &mut Lines, number: usize, line: &[u8], symmetry: Symmetry) -> Read<Entries> {
    let expected = "the numbers of rows, columns and entries";
    let [rows, columns, announced] = size(number, line, expected)?;
    square(number, rows, columns, symmetry)?;
    let left = lines.bytes_left();
    let count = enough(number, announced, 6, left)?;
    let size = check_size(rows, columns, left).map_err(|fault| fault.at_line(number))?;
    let mut entries = Entries::new(size.0, size.1);
    entries.reserve(count);
    let (mut has_lower, mut has_upper) = (false, false);
    let mut found = 0;
    while let Some((number, line)) = content(lines) {
        let Some([row, column, value]) = text::exactly::<3>(line) else {
            let expected = "an entry (`row column value`)";
            return Err(Fault::malformed(text::quoted(line), expected, WRITE_AGAIN).at_line(number));
        };
        let row = place("row", row, size.0, number)?;
        let column = place("column", column, size.1, number)?;
        let value = text::value(value, number)?;
        if symmetry == Symmetry::Symmetric {
            has_lower |= row > column;
            has_upper |= row < column;
            if has_lower && has_upper {
                let found = format!("entry ({}, {}) on the other side", row + 1, column + 1);
                let expected = "entries on one side of the diagonal in a symmetric file";
                let remedy = "write the lower triangle alone, or call the file general";
                return Err(Fault::malformed(found, expected, remedy).at_line(number));
            }
        }
        found += 1;
        if found > count {
            break;
        }
        entries.push(row, column, value);
    }
    counted(count, found, lines)?;
    Ok(entries)
}

/// Index of a row or column, counted from 0.
fn place(what: &'static str, field: &[u8], most: usize, line: usize) -> Read<usize> {
    match text::whole(field) {
        Some(found) if found >= 1 && found <= most as u64 => Ok(found as usize - 1),
        _ => {
            let found = text::quoted(field);
            Err(Fault::OutOfRange { what, found, most }.at_line(line))
        }
    }
}

fn counted(announced: usize, found: usize, lines: &Lines) -> Read<()> {
    let fault = |found: String| Fault::malformed(found, format!("{announced}"), WRITE_AGAIN);
    if found > announced {
        return Err(fault("more entries than announced".to_owned()).at_line(lines.number()));
    }
    if found < announced {
        return Err(fault(format!("{found} entries")).in_file());
    }
    Ok(())
}

/// Reads entries column by column, of a symmetric matrix from the diagonal down.
fn array(lines: &mut Lines, number: usize, line: &[u8], symmetry: Symmetry) -> Read<Entries> {
    let [rows, columns] = size(number, line, "the numbers of rows and columns")?;
    square(number, rows, columns, symmetry)?;
    let left = lines.bytes_left();
    let size = check_size(rows, columns, left).map_err(|fault| fault.at_line(number))?;
    let in_all = rows * columns; // both are at most u32::MAX
    let announced = match symmetry {
        Symmetry::General => in_all,
        Symmetry::Symmetric => (in_all + rows) / 2,
    };
    let count = enough(number, announced, 2, left)?;
    let mut entries = Entries::new(size.0, size.1);
    let (mut row, mut column, mut found) = (0, 0, 0);
    while let Some((number, line)) = content(lines) {
        let value = text::value(line, number)?;
        found += 1;
        if found > count {
            break;
        }
        if value != 0.0 {
            entries.push(row, column, value);
        }
        row += 1;
        if row == size.0 {
            column += 1;
            row = if symmetry == Symmetry::Symmetric {
                column
            } else {
                0
            };
        }
    }
    counted(count, found, lines)?;
    Ok(entries)
}

/// MatrixMarket file of a matrix, with digits that read back to the same numbers.
pub fn write(matrix: &CscMatrix<f64>) -> String {
    let mut file = String::from("%%MatrixMarket matrix coordinate real general\n");
    let (rows, columns, entries) = (matrix.nrows(), matrix.ncols(), matrix.nnz());
    writeln!(file, "{rows} {columns} {entries}").expect("a text takes all");
    for (row, column, value) in matrix.triplet_iter() {
        writeln!(file, "{} {} {value:e}", row + 1, column + 1).expect("a text takes all");
    }
    file
}
