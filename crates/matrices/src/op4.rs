//! Files of Nastran's OUTPUT4: named matrices, as text or in binary records of either byte order,
//! each dense or sparse, in single or double precision.
//!
//! A matrix begins with a header: columns, rows, form, type, name. One record a column follows: the
//! column, the first row, a number of words, and values. Where the first row is 0 the column is
//! sparse: each string of values has a head of one word (`row + 65536 (length + 1)`) or, where the
//! header has a negative number of rows (BIGMAT), of two (length + 1, row). Lengths count words, of
//! which a value in double precision has two. A record beyond the last column ends the matrix.

use crate::NamedMatrix;
use crate::contents::{FoundMatrices, OtherVariable};
use crate::entries::{Entries, MatrixSizes};
use crate::error::{Failure, MatrixFault, Read, WRITE_AGAIN};
use crate::fortran::{FortranFormat, FortranNumbers};
use crate::text::{self, TextLines};

/// Most rows of a matrix whose sparse columns have heads of one word.
const MOST_ROWS_IN_ONE_WORD: i64 = 65_535;

/// Header of a matrix.
#[derive(Debug, Clone)]
struct Header {
    columns: usize,
    rows: usize,
    /// True if sparse columns have heads of two words.
    is_big: bool,
    form: i64,
    kind: i64,
    name: String,
}

impl Header {
    fn new(
        [columns, rows, form, kind]: [i64; 4],
        name: &[u8],
        sizes: &mut MatrixSizes,
    ) -> Result<Self, MatrixFault> {
        let expected = "columns, rows, form (1 to 9), type (1 to 4) and name of a matrix";
        let found = format!(
            "{columns}, {rows}, {form}, {kind} and {}",
            text::quoted(name)
        );
        if columns < 0 || !(0..=20).contains(&form) || !(1..=4).contains(&kind) {
            return Err(MatrixFault::malformed(found, expected, WRITE_AGAIN));
        }
        let is_big = !(0..=MOST_ROWS_IN_ONE_WORD).contains(&rows);
        let (rows, columns) = sizes.add(rows.unsigned_abs(), columns.unsigned_abs())?;
        Ok(Self {
            columns,
            rows,
            is_big,
            form,
            kind,
            name: text::printable(name),
        })
    }

    fn is_complex(&self) -> bool {
        self.kind >= 3
    }

    fn is_double(&self) -> bool {
        self.kind % 2 == 0
    }
}

/// Adds a matrix or its first fault to the contents of a file.
fn add(found: &mut FoundMatrices, header: Header, read: Read<Entries>) {
    if header.is_complex() {
        return found.others.push(OtherVariable {
            name: header.name,
            what: "complex",
        });
    }
    let name = Some(header.name);
    let matrix = read.and_then(|entries| match header.form {
        6 => entries.into_whole_matrix(),
        _ => entries.into_matrix(),
    });
    let matrix = matrix.map(|matrix| NamedMatrix {
        name: name.clone(),
        matrix,
        rows: None,
    });
    found.add(name, header.columns, matrix);
}

/// Entries of a matrix up to the first infinite or undefined value, which spoils only this matrix.
struct Op4Columns {
    entries: Entries,
    failure: Option<Failure>,
}

impl Op4Columns {
    fn new(header: &Header) -> Self {
        Self {
            entries: Entries::new(header.rows, header.columns),
            failure: None,
        }
    }

    fn push(&mut self, row: usize, column: usize, value: impl FnOnce() -> Read<f64>) {
        if self.failure.is_some() {
            return;
        }
        match value() {
            Ok(0.0) => {}
            Ok(value) => self.entries.push(row, column, value),
            Err(failure) => self.failure = Some(failure),
        }
    }

    fn finish(self) -> Read<Entries> {
        self.failure.map_or(Ok(self.entries), Err)
    }
}

/// Head of a sparse string in one word: row, and length in words.
fn one_word(head: i64) -> (i64, i64) {
    (head & 0xffff, (head >> 16) - 1)
}

// Binary files.

/// Byte order and length of the whole numbers of a file.
#[derive(Debug, Clone, Copy)]
struct Words {
    is_big_endian: bool,
    is_long: bool,
}

/// Form of the words of a binary file, if it is one: its first record has 24 bytes, or 48 where the
/// words are long.
fn words(bytes: &[u8]) -> Option<Words> {
    for is_big_endian in [false, true] {
        for is_long in [false, true] {
            let words = Words {
                is_big_endian,
                is_long,
            };
            let length = if is_long { 48 } else { 24 };
            let is_at = |at: usize| words.marker(bytes, at) == Some(length);
            if is_at(0) && is_at(4 + length as usize) {
                return Some(words);
            }
        }
    }
    None
}

impl Words {
    /// Length of a record, which stands before and behind it.
    fn marker(self, bytes: &[u8], at: usize) -> Option<u32> {
        let word = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
        Some(if self.is_big_endian {
            u32::from_be_bytes(word)
        } else {
            u32::from_le_bytes(word)
        })
    }

    /// Number of bytes of a word.
    fn length(self) -> usize {
        if self.is_long { 8 } else { 4 }
    }

    fn whole(self, bytes: &[u8]) -> i64 {
        let mut number = 0u64;
        for i in 0..bytes.len() {
            let next = if self.is_big_endian {
                i
            } else {
                bytes.len() - 1 - i
            };
            number = (number << 8) | u64::from(bytes[next]);
        }
        if bytes.len() == 4 {
            i64::from(number as u32 as i32)
        } else {
            number as i64
        }
    }

    /// Number of bytes of a value.
    fn bytes_of_a_value(self, header: &Header) -> usize {
        if header.is_double() { 8 } else { self.length() }
    }

    fn value(self, bytes: &[u8]) -> f64 {
        let whole = self.whole(bytes);
        if bytes.len() == 4 {
            f64::from(f32::from_bits(whole as u32))
        } else {
            f64::from_bits(whole as u64)
        }
    }
}

/// Returns `true` for a file in binary records.
pub(crate) fn is_binary(bytes: &[u8]) -> bool {
    words(bytes).is_some()
}

/// Reads a file in binary records.
pub(crate) fn parse_binary(bytes: &[u8]) -> Read<FoundMatrices<'static>> {
    let Some(words) = words(bytes) else {
        return Err(MatrixFault::UnknownFormat.locate_file());
    };
    let mut records = Records {
        words,
        bytes,
        at: 0,
    };
    let mut matrices = FoundMatrices::default();
    let mut sizes = MatrixSizes::new(bytes.len());
    while records.at < bytes.len() {
        let (at, record) = records.next("the header of a matrix")?;
        let length = words.length();
        if record.len() != 6 * length {
            let matrices = format!("a record of {} bytes", record.len());
            let expected = format!("the header of a matrix, of {} bytes", 6 * length);
            return Err(MatrixFault::malformed(matrices, expected, WRITE_AGAIN).locate_byte(at));
        }
        let mut numbers = [0; 4];
        for (number, word) in numbers.iter_mut().zip(record.chunks_exact(length)) {
            *number = words.whole(word);
        }
        let header = Header::new(numbers, &record[4 * length..], &mut sizes);
        let header = header.map_err(|fault| fault.locate_byte(at))?;
        let mut columns = Op4Columns::new(&header);
        while records.column(&header, &mut columns)? {}
        add(&mut matrices, header, columns.finish());
    }
    Ok(matrices)
}

struct Records<'a> {
    words: Words,
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Records<'a> {
    /// Next record, and where its content begins.
    fn next(&mut self, what: &str) -> Read<(usize, &'a [u8])> {
        let missing = || text::cut_off_failure(what);
        let length = self.words.marker(self.bytes, self.at).ok_or_else(missing)?;
        let from = self.at + 4;
        let to = from.checked_add(length as usize).ok_or_else(missing)?;
        let record = self.bytes.get(from..to).ok_or_else(missing)?;
        let behind = self.words.marker(self.bytes, to).ok_or_else(missing)?;
        if behind != length {
            let found = format!("{behind} behind a record");
            let expected = format!("its length {length}, as before it");
            return Err(MatrixFault::malformed(found, expected, WRITE_AGAIN).locate_byte(to));
        }
        self.at = to + 4;
        Ok((from, record))
    }

    /// Reads a column. Returns `false` at the end of the matrix.
    fn column(&mut self, header: &Header, columns: &mut Op4Columns) -> Read<bool> {
        let words = self.words;
        let length = words.length();
        let (at, record) = self.next("the end of a matrix")?;
        let wrong = |found: String, expected: &str| {
            MatrixFault::malformed(found, expected, WRITE_AGAIN).locate_byte(at)
        };
        if record.len() < 3 * length {
            let found = format!("a record of {} bytes", record.len());
            return Err(wrong(found, "a column with its row and number of words"));
        }
        let (head, mut rest) = record.split_at(3 * length);
        let head = |i: usize| words.whole(&head[i * length..(i + 1) * length]);
        let column = column_of(head(0), header).map_err(|fault| fault.locate_byte(at))?;
        let Some(column) = column else {
            return Ok(false);
        };
        let mut place = |row: i64, values: &[u8], at: usize| {
            let size = words.bytes_of_a_value(header);
            let count = if header.is_complex() {
                0
            } else {
                values.len() / size
            };
            let row = string(row, count, header.rows).map_err(|fault| fault.locate_byte(at))?;
            if header.is_complex() {
                return Ok(());
            }
            for (i, value) in values.chunks_exact(size).enumerate() {
                let value = words.value(value);
                columns.push(row + i, column, || {
                    if value.is_finite() {
                        return Ok(value);
                    }
                    let what = "an entry";
                    let found = format!("{value} in `{}`", header.name);
                    Err(MatrixFault::NotFinite { what, found }.locate_byte(at + i * size))
                });
            }
            Ok(())
        };
        if head(1) != 0 {
            place(head(1), rest, at + 3 * length)?;
            return Ok(true);
        }
        while !rest.is_empty() {
            let begin = at + record.len() - rest.len();
            let cut = || {
                wrong(
                    format!("{} bytes", rest.len()),
                    "a string of a sparse column",
                )
            };
            let heads = if header.is_big { 2 } else { 1 };
            let (head, values) = rest.split_at_checked(heads * length).ok_or_else(cut)?;
            let first = words.whole(&head[..length]);
            let (row, count) = if header.is_big {
                (words.whole(&head[length..]), first - 1)
            } else {
                one_word(first)
            };
            let count = usize::try_from(count).ok().filter(|count| *count > 0);
            let bytes = count
                .and_then(|count| count.checked_mul(length))
                .ok_or_else(cut)?;
            let (values, after) = values.split_at_checked(bytes).ok_or_else(cut)?;
            place(row, values, begin + heads * length)?;
            rest = after;
        }
        Ok(true)
    }
}

/// Index of a column, `None` beyond the last.
fn column_of(number: i64, header: &Header) -> Result<Option<usize>, MatrixFault> {
    let most = header.columns;
    match usize::try_from(number) {
        Ok(number) if number > most => Ok(None),
        Ok(number) if number > 0 => Ok(Some(number - 1)),
        _ => Err(MatrixFault::OutOfRange {
            what: "column",
            found: number.to_string(),
            most,
        }),
    }
}

/// Index of the first row of a string of values.
fn string(row: i64, count: usize, most: usize) -> Result<usize, MatrixFault> {
    let first = usize::try_from(row).ok().filter(|row| *row > 0);
    match first {
        Some(row) if row - 1 <= most && count <= most - (row - 1) => Ok(row - 1),
        _ => Err(MatrixFault::OutOfRange {
            what: "row",
            found: format!("{row} with the {count} values from there on"),
            most,
        }),
    }
}

// Text files.

/// Widths of the numbers and the name in the first line of a matrix, whose long form ends with
/// `|I16`.
const WIDTHS: [[usize; 5]; 2] = [[8, 8, 8, 8, 8], [16, 16, 8, 8, 8]];

/// Numbers and name of the first line of a matrix, with what follows them.
fn first_line(line: &[u8]) -> Option<([i64; 4], &[u8], &[u8])> {
    let (line, widths) = match line.trim_ascii_end().strip_suffix(b"|I16") {
        Some(line) => (line, WIDTHS[1]),
        None => (line, WIDTHS[0]),
    };
    let mut rest = line;
    let mut numbers = [0; 4];
    for (number, width) in numbers.iter_mut().zip(widths) {
        let field;
        (field, rest) = rest.split_at_checked(width)?;
        *number = text::signed(field.trim_ascii())?;
    }
    let (name, format) = rest.split_at(widths[4].min(rest.len()));
    let is_name = name.first().is_some_and(u8::is_ascii_alphabetic);
    is_name.then_some((numbers, name, format))
}

/// Returns `true` for a file in text.
pub(crate) fn is_text(bytes: &[u8]) -> bool {
    let first = TextLines::new(bytes).next();
    first.is_some_and(|(_, line)| first_line(line).is_some())
}

/// Format of values such as `1P,5E16.9`, which may lack its parentheses.
fn format(text: &[u8]) -> Option<FortranFormat> {
    match text.trim_ascii() {
        [] => FortranFormat::new(b"(1P,5E16.9)"),
        text if text.starts_with(b"(") => FortranFormat::new(text),
        text => FortranFormat::new(&[b"(", text, b")"].concat()),
    }
}

/// Reads a file in text.
pub(crate) fn parse_text(bytes: &[u8]) -> Read<FoundMatrices<'static>> {
    let mut lines = TextLines::new(bytes);
    let mut matrices = FoundMatrices::default();
    let mut sizes = MatrixSizes::new(bytes.len());
    while let Some((number, line)) = lines.next() {
        if line.trim_ascii().is_empty() {
            continue;
        }
        let wrong = |expected: &str| {
            MatrixFault::malformed(text::quoted(line), expected, WRITE_AGAIN).locate_line(number)
        };
        let Some((numbers, name, after)) = first_line(line) else {
            return Err(wrong("columns, rows, form, type and name of a matrix"));
        };
        let Some(format) = format(after) else {
            return Err(wrong(
                "a format of values, such as 1P,5E16.9, behind the name",
            ));
        };
        let header = Header::new(numbers, name, &mut sizes);
        let header = header.map_err(|fault| fault.locate_line(number))?;
        let mut columns = Op4Columns::new(&header);
        let mut text = Text {
            lines: &mut lines,
            format: &format,
        };
        while text.column(&header, &mut columns)? {}
        add(&mut matrices, header, columns.finish());
    }
    Ok(matrices)
}

struct Text<'a, 'b> {
    lines: &'a mut TextLines<'b>,
    format: &'a FortranFormat,
}

impl Text<'_, '_> {
    /// Reads whole numbers, which may touch one another in columns of eight.
    fn whole<const N: usize>(&mut self, what: &str) -> Read<[i64; N]> {
        let line = self.lines.required(what)?;
        let numbers = || {
            let mut numbers = [0; N];
            if let Some(fields) = text::exactly::<N>(line) {
                for (number, field) in numbers.iter_mut().zip(fields) {
                    *number = text::signed(field)?;
                }
                return Some(numbers);
            }
            let (mut rest, widths) = (line.trim_ascii_end(), [8; N]);
            for (number, width) in numbers.iter_mut().zip(widths) {
                let field;
                (field, rest) = rest.split_at(width.min(rest.len()));
                *number = text::signed(field.trim_ascii())?;
            }
            rest.is_empty().then_some(numbers)
        };
        let wrong = || MatrixFault::malformed(text::quoted(line), what, WRITE_AGAIN);
        numbers().ok_or_else(|| wrong().locate_line(self.lines.number()))
    }

    /// Reads a column. Returns `false` at the end of the matrix.
    fn column(&mut self, header: &Header, columns: &mut Op4Columns) -> Read<bool> {
        let [column, row, length] = self.whole::<3>("a column with its row and number of words")?;
        let number = self.lines.number();
        let at_line = |fault: MatrixFault| fault.locate_line(number);
        let Some(column) = column_of(column, header).map_err(at_line)? else {
            // A line with a value that means nothing.
            self.lines.next();
            return Ok(false);
        };
        let wrong = || {
            let found = format!("{length} words");
            let expected = "as many as the strings of the column have";
            MatrixFault::malformed(found, expected, WRITE_AGAIN).locate_line(number)
        };
        let length = usize::try_from(length).map_err(|_| wrong())?;
        if row != 0 {
            self.string(header, row, length, column, columns)?;
            return Ok(true);
        }
        let words = if header.is_double() { 2 } else { 1 };
        let mut left = length;
        while left > 0 {
            let (row, count, heads) = if header.is_big {
                let [first, row] = self.whole::<2>("length and row of a string of values")?;
                (row, first.saturating_sub(1), 2)
            } else {
                let [head] =
                    self.whole::<1>("length and row of a string of values, in one number")?;
                let (row, count) = one_word(head);
                (row, count, 1)
            };
            let count = usize::try_from(count).map_err(|_| wrong())?;
            let used = count.checked_add(heads);
            left = used
                .and_then(|used| left.checked_sub(used))
                .ok_or_else(wrong)?;
            self.string(header, row, count / words, column, columns)?;
        }
        Ok(true)
    }

    /// Reads a string of values.
    fn string(
        &mut self,
        header: &Header,
        row: i64,
        count: usize,
        column: usize,
        columns: &mut Op4Columns,
    ) -> Read<()> {
        let at = self.lines.number();
        let real = if header.is_complex() { 0 } else { count };
        let row = string(row, real, header.rows).map_err(|fault| fault.locate_line(at))?;
        let mut numbers = FortranNumbers::new(self.lines, self.format);
        for i in 0..count {
            let field = numbers.next("the values of a column")?;
            if header.is_complex() {
                continue;
            }
            columns.push(row + i, column, || field.value(numbers.line_number()));
        }
        Ok(())
    }
}
