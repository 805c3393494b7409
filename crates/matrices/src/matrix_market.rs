//! MatrixMarket files: entries with their places (coordinate) or column by column (array). They are
//! read line by line: a dense one of some thousand rows has gigabytes of text.

#[cfg(test)]
mod tests;

use std::fmt::Write as _;
use std::io::{BufRead, Read as _};

use nalgebra_sparse::CscMatrix;

use crate::entries::{Entries, check_size};
use crate::error::{Failure, MatrixError, MatrixFault, Read, WRITE_AGAIN};
use crate::{NamedMatrix, text};

const HEADER: &str = "`%%MatrixMarket matrix coordinate real general` or one with array, integer \
                      or symmetric in it";

/// Most bytes of a line.
const MOST_OF_A_LINE: usize = 1 << 16;

/// Most entries, including zeros, that a dense matrix given entry by entry may have for each byte of
/// its file: 64 bytes of memory for one of the file.
const ENTRIES_TO_A_BYTE: u64 = 8;

/// Parts of a matrix that a file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Symmetry {
    General,
    /// One triangle, as arrays the lower one.
    Symmetric,
    /// One triangle without the diagonal.
    Skew,
}

impl Symmetry {
    /// First row of a column of an array.
    fn first_row(self, column: usize) -> usize {
        match self {
            Self::General => 0,
            Self::Symmetric => column,
            Self::Skew => column + 1,
        }
    }
}

/// Form of the entries of a file.
#[derive(Debug, Clone, Copy)]
struct Form {
    /// Line of the header.
    number: usize,
    /// True if each entry has its row and column; otherwise entries follow column by column.
    is_placed: bool,
    /// True if values are given; otherwise the file has only places, of ones.
    has_values: bool,
    symmetry: Symmetry,
}

/// Size that a file announces.
#[derive(Debug, Clone, Copy)]
struct Size {
    rows: u64,
    columns: u64,
    /// Number of entries in the file.
    entries: usize,
}

/// Returns `true` for the text of a MatrixMarket file.
pub(crate) fn is_matrix_market(bytes: &[u8]) -> bool {
    let text = bytes.trim_ascii_start();
    let word = b"matrixmarket";
    // Some writers put one percent sign where the format requires two.
    let start = text
        .strip_prefix(b"%")
        .map(|t| t.strip_prefix(b"%").unwrap_or(t));
    start.is_some_and(|t| t.len() >= word.len() && t[..word.len()].eq_ignore_ascii_case(word))
}

/// Reads a sparse matrix.
pub(crate) fn parse(bytes: &[u8]) -> Read<NamedMatrix> {
    let mut lines = Lines::new(bytes, bytes.len());
    let form = lines.form()?;
    if !form.has_values {
        return Err(not_read(
            b"pattern",
            "write the matrix with its values",
            form.number,
        ));
    }
    if form.symmetry == Symmetry::Skew {
        let remedy = "stiffness and mass are symmetric: write them as general or symmetric";
        return Err(not_read(b"skew-symmetric", remedy, form.number));
    }
    let make = |size: Size| {
        let (rows, columns) = check_size(size.rows, size.columns, bytes.len())?;
        let mut entries = Entries::new(rows, columns);
        if form.is_placed {
            entries.reserve(size.entries);
        }
        Ok(entries)
    };
    let matrix = lines.matrix(form, make, |entries, [row, column], value| {
        if value != 0.0 {
            entries.push(row, column, value);
        }
    })?;
    Ok(NamedMatrix {
        name: None,
        matrix: matrix.into_matrix()?,
        rows: None,
    })
}

/// Reads a dense MatrixMarket matrix of real numbers from a file of this length, line by line. It
/// may be an array or have places, be of integers or a pattern of ones, general, symmetric or
/// skew-symmetric. `zeros` makes a matrix of a number of rows and columns, and `add` adds a value to
/// the entry in a row and column, counted from 0; the other triangle of a symmetric file is added as
/// well. The size is compared with the length of the file before `zeros` is called.
///
/// # Errors
/// A file that cannot be read or is no such matrix; the path of the error is `None`.
pub fn read_matrix_market<M>(
    file: impl BufRead,
    bytes: usize,
    zeros: impl FnOnce(usize, usize) -> M,
    add: impl FnMut(&mut M, [usize; 2], f64),
) -> Result<M, MatrixError> {
    let mut lines = Lines::new(file, bytes);
    let whole = lines.form().and_then(|form| {
        let make = |Size { rows, columns, .. }: Size| {
            let most = bytes as u64;
            let dense = rows.saturating_mul(columns) / ENTRIES_TO_A_BYTE;
            // A matrix without rows may announce more columns than could ever be gone through.
            if rows.max(columns) > most || (form.is_placed && dense > most) {
                let announced = format!("a matrix of {rows} x {columns}");
                return Err(MatrixFault::TooLarge { announced, bytes });
            }
            Ok(zeros(rows as usize, columns as usize))
        };
        lines.matrix(form, make, add)
    });
    whole.map_err(Failure::fileless_error)
}

/// Lines of a file, without the blanks around them.
struct Lines<R> {
    file: R,
    line: Vec<u8>,
    /// Number of the last line, counted from 1.
    number: usize,
    /// Bytes that follow the last line.
    left: usize,
}

impl<R: BufRead> Lines<R> {
    fn new(file: R, bytes: usize) -> Self {
        Self {
            file,
            line: Vec::new(),
            number: 0,
            left: bytes,
        }
    }

    /// Next line that is not empty and begins with none of these bytes.
    fn next(&mut self, skipped: &[u8]) -> Read<Option<(usize, &[u8])>> {
        loop {
            self.line.clear();
            self.number += 1;
            let mut line = (&mut self.file).take(MOST_OF_A_LINE as u64);
            let read = line.read_until(b'\n', &mut self.line).map_err(|error| {
                let why = error.to_string();
                MatrixFault::File { why }.locate_line(self.number)
            })?;
            self.left = self.left.saturating_sub(read);
            if read == MOST_OF_A_LINE {
                let expected = format!("a line of fewer than {MOST_OF_A_LINE} bytes");
                let fault = MatrixFault::malformed("a longer one", expected, WRITE_AGAIN);
                return Err(fault.locate_line(self.number));
            }
            if read == 0 {
                return Ok(None);
            }
            let first = self.line.trim_ascii().first();
            if first.is_some_and(|first| !skipped.contains(first)) {
                return Ok(Some((self.number, self.line.trim_ascii())));
            }
        }
    }

    /// Next line that is neither empty nor a comment.
    fn content(&mut self) -> Read<Option<(usize, &[u8])>> {
        self.next(b"%")
    }

    fn form(&mut self) -> Read<Form> {
        let Some((number, line)) = self.next(b"")? else {
            return Err(text::cut_off_failure("its header"));
        };
        let lower = line.to_ascii_lowercase();
        let mut words = text::fields(&lower).skip(1);
        let words = [(); 4].map(|()| words.next().unwrap_or_default());
        let [object, form, field, symmetry] = words;
        let wrong = || {
            let remedy = "write it by `scipy.io.mmwrite`";
            MatrixFault::malformed(text::quoted(line), HEADER, remedy).locate_line(number)
        };
        if !is_matrix_market(line) || object != b"matrix" {
            return Err(wrong());
        }
        let is_placed = match form {
            b"coordinate" => true,
            b"array" => false,
            _ => return Err(wrong()),
        };
        let has_values = match field {
            b"real" | b"integer" | b"double" => true,
            b"pattern" if is_placed => false,
            b"complex" => {
                let remedy = "write the real part and the damping by themselves";
                return Err(not_read(field, remedy, number));
            }
            _ => return Err(wrong()),
        };
        let symmetry = match symmetry {
            b"general" => Symmetry::General,
            b"symmetric" => Symmetry::Symmetric,
            b"skew-symmetric" => Symmetry::Skew,
            b"hermitian" => {
                let remedy = "write the real matrix as general or symmetric";
                return Err(not_read(symmetry, remedy, number));
            }
            _ => return Err(wrong()),
        };
        Ok(Form {
            number,
            is_placed,
            has_values,
            symmetry,
        })
    }

    /// Matrix behind the header. `make` makes one of zeros if its size can be, and `add` adds an
    /// entry.
    fn matrix<M>(
        &mut self,
        form: Form,
        make: impl FnOnce(Size) -> Result<M, MatrixFault>,
        mut add: impl FnMut(&mut M, [usize; 2], f64),
    ) -> Read<M> {
        if self.content()?.is_none() {
            return Err(text::cut_off_failure("the line with the size"));
        }
        let (line, number) = (self.line.trim_ascii(), self.number);
        let size = form.size(line, self.left);
        let made = size.and_then(|size| Ok((size, make(size)?)));
        let (size, mut matrix) = made.map_err(|fault| fault.locate_line(number))?;
        let mut next = [form.symmetry.first_row(0), 0];
        let mut sides = [false; 2];
        let mut count = 0;
        while let Some((number, line)) = self.content()? {
            count += 1;
            if count > size.entries {
                let expected = size.entries.to_string();
                let fault =
                    MatrixFault::malformed("more entries than announced", expected, WRITE_AGAIN);
                return Err(fault.locate_line(number));
            }
            let (place, value) = if form.is_placed {
                form.placed(line, number, size, &mut sides)?
            } else {
                let place = next;
                next[0] += 1;
                if next[0] as u64 == size.rows {
                    next[1] += 1;
                    next[0] = form.symmetry.first_row(next[1]);
                }
                (place, text::value(line, number)?)
            };
            add(&mut matrix, place, value);
            let [row, column] = place;
            if row != column && form.symmetry != Symmetry::General {
                let is_skew = form.symmetry == Symmetry::Skew;
                add(
                    &mut matrix,
                    [column, row],
                    if is_skew { -value } else { value },
                );
            }
        }
        if count < size.entries {
            let (count, expected) = (format!("{count} entries"), size.entries.to_string());
            return Err(MatrixFault::malformed(count, expected, WRITE_AGAIN).locate_file());
        }
        Ok(matrix)
    }
}

fn not_read(what: &[u8], remedy: &'static str, line: usize) -> Failure {
    let what = format!(
        "a MatrixMarket file of the kind `{}`",
        text::printable(what)
    );
    MatrixFault::NotRead { what, remedy }.locate_line(line)
}

impl Form {
    /// Reads the line of the size, before so many bytes. The number of the entries of an array
    /// follows from its size. Of an entry there is at least a digit each for row, column and value,
    /// with a blank or a line end behind it, which the last entry may lack.
    fn size(self, line: &[u8], left: usize) -> Result<Size, MatrixFault> {
        let expected = match self.is_placed {
            true => "the numbers of rows, columns and entries",
            false => "the numbers of rows and columns",
        };
        let numbers = match self.is_placed {
            true => text::exactly::<3>(line).map(|fields| fields.map(text::parse_whole_number)),
            false => text::exactly::<2>(line).map(|fields| {
                let [rows, columns] = fields.map(text::parse_whole_number);
                let in_all = rows.zip(columns).map(|(m, n)| m.saturating_mul(n));
                let entries = in_all.zip(rows).map(|(all, rows)| match self.symmetry {
                    Symmetry::General => all,
                    Symmetry::Symmetric => all.saturating_sub(rows) / 2 + rows,
                    Symmetry::Skew => all.saturating_sub(rows) / 2,
                });
                [rows, columns, entries]
            }),
        };
        let Some([Some(rows), Some(columns), Some(announced)]) = numbers else {
            return Err(MatrixFault::malformed(
                text::quoted(line),
                expected,
                WRITE_AGAIN,
            ));
        };
        if self.symmetry != Symmetry::General && rows != columns {
            let found = format!("a symmetric matrix of {rows} x {columns}");
            return Err(MatrixFault::malformed(
                found,
                "as many rows as columns",
                WRITE_AGAIN,
            ));
        }
        let of_an_entry = 2 * (2 * u64::from(self.is_placed) + u64::from(self.has_values));
        match usize::try_from(announced) {
            Ok(entries) if announced.saturating_mul(of_an_entry) <= left as u64 + 1 => Ok(Size {
                rows,
                columns,
                entries,
            }),
            _ => Err(MatrixFault::TooLarge {
                announced: match self.is_placed {
                    true => format!("a number of {announced} entries"),
                    false => format!("a matrix of {rows} x {columns}"),
                },
                bytes: left,
            }),
        }
    }

    /// Reads an entry with its place. `sides` says whether there were entries below and above the
    /// diagonal.
    fn placed(
        self,
        line: &[u8],
        number: usize,
        size: Size,
        sides: &mut [bool; 2],
    ) -> Read<([usize; 2], f64)> {
        let one: &[u8] = b"1";
        let (fields, expected) = match self.has_values {
            true => (text::exactly::<3>(line), "an entry (`row column value`)"),
            false => {
                let fields = text::exactly::<2>(line);
                let fields = fields.map(|[row, column]| [row, column, one]);
                (fields, "an entry (`row column`)")
            }
        };
        let malformed = |found: String, expected: &str, remedy: &'static str| {
            MatrixFault::malformed(found, expected, remedy).locate_line(number)
        };
        let Some([row, column, value]) = fields else {
            return Err(malformed(text::quoted(line), expected, WRITE_AGAIN));
        };
        let row = place("row", row, size.rows, number)?;
        let column = place("column", column, size.columns, number)?;
        let value = text::value(value, number)?;
        let at = || format!("entry ({}, {})", row + 1, column + 1);
        if self.symmetry == Symmetry::Skew && row == column {
            let expected = "no entry on the diagonal of a skew-symmetric file";
            return Err(malformed(at(), expected, WRITE_AGAIN));
        }
        if self.symmetry != Symmetry::General {
            sides[0] |= row > column;
            sides[1] |= row < column;
            if *sides == [true; 2] {
                let expected = "entries on one side of the diagonal in a symmetric file";
                let remedy = "write the lower triangle alone, or call the file general";
                return Err(malformed(
                    format!("{} on the other side", at()),
                    expected,
                    remedy,
                ));
            }
        }
        Ok(([row, column], value))
    }
}

/// Index of a row or column, counted from 0.
fn place(what: &'static str, field: &[u8], most: u64, line: usize) -> Read<usize> {
    match text::parse_whole_number(field) {
        Some(found) if (1..=most).contains(&found) => Ok(found as usize - 1),
        _ => {
            let (found, most) = (text::quoted(field), most as usize);
            Err(MatrixFault::OutOfRange { what, found, most }.locate_line(line))
        }
    }
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
