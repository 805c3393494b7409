//! Dense matrices as MatrixMarket text, written as arrays and read from every form with real
//! entries. They are read line by line: a flank of some thousand pairs has a stiffness of gigabytes
//! of text.

use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::Path;

use faer::{Mat, MatRef};

use crate::input;

/// Number of bytes at the beginning of a file that are searched for comments.
const MOST_COMMENT: u64 = 1 << 16;

const DENSE: &str = "%%MatrixMarket matrix array real general";

/// Writes a dense array, column by column, below a comment line. Numbers have the shortest digits
/// that read back exactly.
///
/// # Errors
/// The errors of the file.
pub fn write(path: &Path, comment: &str, a: MatRef<'_, f64>) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "{DENSE}\n% {comment}\n{} {}", a.nrows(), a.ncols())?;
    for j in 0..a.ncols() {
        for i in 0..a.nrows() {
            writeln!(file, "{:e}", a[(i, j)])?;
        }
    }
    file.into_inner()?.sync_all()
}

/// Comment lines below the header of a matrix, without their sign.
///
/// # Errors
/// The errors of the file.
pub fn comments(path: &Path) -> io::Result<Vec<String>> {
    let mut lines = BufReader::new(input::open(path)?.take(MOST_COMMENT)).lines();
    lines.next().transpose()?;
    let mut comments = Vec::new();
    for line in lines {
        match line?.strip_prefix('%') {
            Some(comment) => comments.push(comment.trim().to_owned()),
            None => break,
        }
    }
    Ok(comments)
}

/// Reads a matrix. The size in the header is compared with the length of the file before memory is
/// allocated.
///
/// # Errors
/// A description of the error, with the line where there is one.
pub fn read(path: &Path) -> Result<Mat<f64>, String> {
    let said = |e: io::Error| e.to_string();
    let file = input::open(path).map_err(said)?;
    let bytes = file.metadata().map_err(said)?.len();
    let mut lines = Lines::of(file);
    let form = Form::of(lines.next()?.unwrap_or_default())?;
    let size = match lines.content()? {
        Some(text) => form.size(text, bytes),
        None => return Err("the line with the size is missing".to_owned()),
    };
    let size = size.map_err(|why| lines.here(&why))?;
    let mut a = Mat::zeros(size.rows, size.columns);
    let mut places = form.symmetry.places(&size);
    let mut found = 0;
    while let Some(text) = lines.content()? {
        found += 1;
        let entry = if form.is_placed {
            form.placed(text, &size).map(Some)
        } else {
            number(text).map(|value| places.next().map(|place| (place, value)))
        };
        // There may be more entries than places: all are counted.
        if let Some(((row, column), value)) = entry.map_err(|why| lines.here(&why))? {
            a[(row, column)] += value;
            if row != column {
                a[(column, row)] += match form.symmetry {
                    Symmetry::General => continue,
                    Symmetry::Symmetric => value,
                    Symmetry::Skew => -value,
                };
            }
        }
    }
    if found == size.entries {
        Ok(a)
    } else {
        Err(format!(
            "{} entries are announced, {found} found",
            size.entries
        ))
    }
}

/// Form of the entries in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Form {
    /// True if each entry has its row and column; otherwise entries follow column by column.
    is_placed: bool,
    /// True if values are given; otherwise the file has only positions, of ones.
    has_values: bool,
    symmetry: Symmetry,
}

/// Part of a matrix that is in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Symmetry {
    General,
    /// Lower triangle.
    Symmetric,
    /// Lower triangle without its diagonal.
    Skew,
}

impl Symmetry {
    /// Positions of the entries of an array, in the order of the file.
    fn places(self, size: &Size) -> impl Iterator<Item = (usize, usize)> + use<> {
        let rows = size.rows;
        (0..size.columns).flat_map(move |j| (self.first_row(j)..rows).map(move |i| (i, j)))
    }

    fn first_row(self, column: usize) -> usize {
        match self {
            Self::General => 0,
            Self::Symmetric => column,
            Self::Skew => column + 1,
        }
    }
}

/// Size that a file announces.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Size {
    rows: usize,
    columns: usize,
    /// Number of entries in the file.
    entries: usize,
}

impl Form {
    fn of(header: &str) -> Result<Self, String> {
        // Some writers put one percent sign where the format requires two.
        let header = header.trim_start_matches('%').to_lowercase();
        let words: Vec<&str> = header.split_whitespace().collect();
        let symmetry = match words.last() {
            Some(&"general") => Some(Symmetry::General),
            Some(&"symmetric") => Some(Symmetry::Symmetric),
            Some(&"skew-symmetric") => Some(Symmetry::Skew),
            _ => None,
        };
        let (is_placed, has_values) = match words[..] {
            ["matrixmarket", "matrix", "array", "real" | "integer", _] => (false, true),
            [
                "matrixmarket",
                "matrix",
                "coordinate",
                "real" | "integer",
                _,
            ] => (true, true),
            ["matrixmarket", "matrix", "coordinate", "pattern", _] => (true, false),
            _ => return Err(not_a_header()),
        };
        Ok(Self {
            is_placed,
            has_values,
            symmetry: symmetry.ok_or_else(not_a_header)?,
        })
    }

    /// Reads the line of the size, and checks that a file of so many bytes can hold it.
    fn size(self, text: &str, bytes: u64) -> Result<Size, String> {
        let numbers: Option<Vec<usize>> = text.split_whitespace().map(|s| s.parse().ok()).collect();
        let (rows, columns, announced) = match (self.is_placed, numbers.as_deref()) {
            (true, Some(&[rows, columns, entries])) => (rows, columns, Some(entries)),
            (false, Some(&[rows, columns])) => (rows, columns, None),
            (true, _) => {
                return Err(format!(
                    "\"{text}\" is not a number of rows, of columns and of entries"
                ));
            }
            (false, _) => {
                return Err(format!("\"{text}\" is not a number of rows and of columns"));
            }
        };
        if self.symmetry != Symmetry::General && rows != columns {
            return Err(format!(
                "a symmetric matrix is square, not {rows} x {columns}"
            ));
        }
        let most = usize::try_from(bytes).unwrap_or(usize::MAX);
        let fitting = rows.checked_mul(columns).and_then(|in_all| {
            let entries = announced.unwrap_or(match self.symmetry {
                Symmetry::General => in_all,
                Symmetry::Symmetric => (in_all - rows) / 2 + rows,
                Symmetry::Skew => (in_all - rows) / 2,
            });
            let fits = entries <= most / self.bytes_of_an_entry() + 1
                && (!self.is_placed || in_all <= most.saturating_mul(ENTRIES_TO_A_BYTE));
            // A matrix without rows may still announce more columns than could ever be gone
            // through.
            (fits && rows.max(columns) <= most).then_some(Size {
                rows,
                columns,
                entries,
            })
        });
        fitting.ok_or_else(|| {
            let entries = announced.map_or(String::new(), |n| format!(" with {n} entries"));
            format!(
                "a matrix of {rows} x {columns}{entries} does not stand in a file of {bytes} bytes"
            )
        })
    }

    /// Least number of bytes of an entry: a digit each for row, column and value, blanks between
    /// them and a line end.
    fn bytes_of_an_entry(self) -> usize {
        let numbers = 2 * usize::from(self.is_placed) + usize::from(self.has_values);
        2 * numbers
    }

    /// Reads an entry with its position.
    fn placed(self, text: &str, size: &Size) -> Result<((usize, usize), f64), String> {
        let mut words = text.split_whitespace();
        let mut index = |what: &str, most: usize| {
            let word = words.next().unwrap_or_default();
            let number = word.parse().ok().filter(|n| (1..=most).contains(n));
            let index = number.map(|n: usize| n - 1);
            index.ok_or_else(|| format!("\"{word}\" is not a {what} from 1 to {most}"))
        };
        let (row, column) = (index("row", size.rows)?, index("column", size.columns)?);
        let value = if self.has_values {
            number(words.next().unwrap_or_default())?
        } else {
            1.0
        };
        if let Some(word) = words.next() {
            return Err(format!("nothing may follow the entry, there is \"{word}\""));
        }
        if row < self.symmetry.first_row(column) {
            return Err(format!(
                "entry ({}, {}) is not in the lower triangle, which alone stands in the file of a \
                 symmetric matrix",
                row + 1,
                column + 1
            ));
        }
        Ok(((row, column), value))
    }
}

fn not_a_header() -> String {
    format!(
        "the first line is not \"{DENSE}\"; in the place of array, real and general coordinate, \
         integer or (with coordinate) pattern, symmetric or skew-symmetric may stand"
    )
}

fn number(text: &str) -> Result<f64, String> {
    let value = text.parse();
    value.map_err(|_| format!("\"{text}\" is not a number"))
}

/// Most entries, including zeros, that a matrix given entry by entry may have for each byte of its
/// file: the matrix read is dense, with 64 bytes of memory for one of the file.
const ENTRIES_TO_A_BYTE: usize = 8;

/// Most bytes of a line.
const MOST_OF_A_LINE: u64 = 4096;

/// Lines of a file, without the blanks around them.
struct Lines {
    file: BufReader<File>,
    line: String,
    /// Number of the last line read, counted from 1.
    number: usize,
}

impl Lines {
    fn of(file: File) -> Self {
        Self {
            file: BufReader::with_capacity(1 << 20, file),
            line: String::new(),
            number: 0,
        }
    }

    fn next(&mut self) -> Result<Option<&str>, String> {
        self.line.clear();
        self.number += 1;
        let mut line = io::Read::take(&mut self.file, MOST_OF_A_LINE);
        let read = line.read_line(&mut self.line);
        let read = read.map_err(|e| format!("line {}: {e}", self.number))?;
        if read as u64 == MOST_OF_A_LINE {
            return Err(format!(
                "line {} is longer than {MOST_OF_A_LINE} bytes",
                self.number
            ));
        }
        Ok((read > 0).then(|| self.line.trim()))
    }

    /// Next line that is neither empty nor a comment.
    fn content(&mut self) -> Result<Option<&str>, String> {
        while let Some(text) = self.next()? {
            if !text.is_empty() && !text.starts_with('%') {
                return Ok(Some(self.line.trim()));
            }
        }
        Ok(None)
    }

    /// Adds the number of the last line read to an error message.
    fn here(&self, why: &str) -> String {
        format!("line {}: {why}", self.number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::folder::Folder;
    use std::time::{Duration, Instant};

    fn read_text(text: &str) -> Result<Mat<f64>, String> {
        read(&Folder::new("matrix").write("a.mtx", text))
    }

    /// Checks that a text is not read, for a reason in these words.
    #[track_caller]
    fn assert_refused(text: &str, words: &[&str]) {
        let message = read_text(text).unwrap_err();
        for words in words {
            assert!(message.contains(words), "{words}: {text}: {message}");
        }
    }

    #[test]
    fn a_header_is_held_against_the_length_of_the_file() {
        let begin = Instant::now();
        let huge = usize::MAX;
        for (header, size) in [
            ("array real general", "90000 90000".to_owned()),
            ("array real general", format!("0 {huge}")),
            ("array real general", format!("{huge} 0")),
            ("array real general", format!("{huge} {huge}")),
            ("array real symmetric", "90000 90000".to_owned()),
            ("array integer general", "90000 90000".to_owned()),
            ("coordinate real general", "90000 90000 2".to_owned()),
            ("coordinate real general", format!("2 2 {huge}")),
            ("coordinate real general", format!("0 {huge} 0")),
            ("coordinate real general", format!("{huge} {huge} 1")),
            ("coordinate pattern general", "3 3 100".to_owned()),
        ] {
            let text = format!("%%MatrixMarket matrix {header}\n% a comment\n{size}\n1 1 1\n");
            assert_refused(&text, &["line 3", "bytes"]);
        }
        assert!(begin.elapsed() < Duration::from_secs(5));
    }

    #[test]
    fn matrices_of_every_form_are_read() {
        let (even, odd) = ([1.0, 2.0, 2.0, 5.0], [0.0, -3.0, 3.0, 0.0]);
        let ones = [1.0, 0.0, 1.0, 0.0];
        // Entries at the same position are added.
        let sums = [0.0, 7.0, 0.0, 5.0];
        let added = "2 2 3\n1 2 4\n1 2 3\n2 2 5";
        let lower = "2 2 3\n1 1 1\n2 1 2\n2 2 5\n";
        for (header, text, expected) in [
            ("array real general", "2 2\n1\n2\n2\n5", even),
            ("array real symmetric", "2 2\n1\n\n2\n% 3\n5\n", even),
            ("array integer skew-symmetric", "2 2\n3\n", odd),
            ("coordinate real symmetric", lower, even),
            ("coordinate integer general", added, sums),
            ("coordinate real skew-symmetric", "2 2 1\n2 1 3\n", odd),
            ("coordinate pattern general", "2 2 2\n1 1\n2 1\n", ones),
        ] {
            let text = format!("%%MatrixMarket matrix {header}\n{text}");
            let a = read_text(&text).unwrap();
            let found = [a[(0, 0)], a[(0, 1)], a[(1, 0)], a[(1, 1)]];
            assert_eq!(found, expected, "{text}");
        }
        // A digit and a line end an entry, the last without: as short as a file can be.
        let shortest = format!(
            "%MatrixMarket matrix array real general\n9 9\n{}7",
            "1\n".repeat(80)
        );
        assert_eq!(read_text(&shortest).unwrap()[(8, 8)], 7.0);
        let places = |i: usize| format!("{} {}\n", i / 9 + 1, i % 9 + 1);
        let places: String = (0..81).map(places).collect();
        let shortest = format!("%MatrixMarket matrix coordinate pattern general\n9 9 81\n{places}");
        assert_eq!(read_text(shortest.trim()).unwrap()[(8, 8)], 1.0);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let (placed, array) = ("coordinate real general", "array real general");
        let half = "coordinate real symmetric";
        let skew = "coordinate real skew-symmetric";
        let pattern = "coordinate pattern general";
        for (header, text, line, words) in [
            (
                placed,
                "1 3 1\n1 99999999999999999999 1",
                3,
                "is not a column from 1 to 3",
            ),
            (placed, "1 3 1\n0 1 1", 3, "\"0\" is not a row from 1 to 1"),
            (placed, "1 3 1\n2 1 1", 3, "\"2\" is not a row from 1 to 1"),
            (placed, "1 3 1\n1", 3, "\"\" is not a column"),
            (placed, "1 3 1\n1 1", 3, "\"\" is not a number"),
            (placed, "1 3 1\n1 1 1 1", 3, "nothing may follow"),
            (pattern, "1 3 1\n1 1 1", 3, "nothing may follow"),
            (
                half,
                "2 2 1\n1 2 1",
                3,
                "(1, 2) is not in the lower triangle",
            ),
            (
                skew,
                "2 2 1\n2 2 1",
                3,
                "(2, 2) is not in the lower triangle",
            ),
            (array, "1 3\nx", 3, "\"x\" is not a number"),
            (
                array,
                "3",
                2,
                "\"3\" is not a number of rows and of columns",
            ),
            (array, "3 3 3", 2, "is not a number of rows and of columns"),
            (
                placed,
                "3 3",
                2,
                "is not a number of rows, of columns and of entries",
            ),
            (placed, "3 -3 1", 2, "is not a number of rows"),
            (half, "2 3 1", 2, "is square, not 2 x 3"),
            (skew, "0 3 0", 2, "is square, not 0 x 3"),
        ] {
            let text = format!("%%MatrixMarket matrix {header}\n{text}\n");
            let message = read_text(&text).unwrap_err();
            let is_told = message.starts_with(&format!("line {line}: ")) && message.contains(words);
            assert!(is_told, "{text}: {message}");
        }
        let forms = "skew-symmetric may stand";
        for (header, text, words) in [
            ("array complex general", "1 1\n1", forms),
            ("array pattern general", "1 1\n1", forms),
            ("array real hermitian", "1 1\n1", forms),
            (array, "1 2\n1", "2 entries are announced, 1 found"),
            (array, "1 2\n1\n2\n3", "2 entries are announced, 3 found"),
        ] {
            let text = format!("%%MatrixMarket matrix {header}\n{text}\n");
            assert_refused(&text, &[words]);
        }
        let nothing = "%%MatrixMarket matrix array real skew-symmetric\n0 0\n";
        assert_eq!(read_text(nothing).unwrap().nrows(), 0);
    }

    #[test]
    fn a_line_has_an_end() {
        let text = format!(
            "%%MatrixMarket matrix array real general\n1 1\n{}\n",
            " ".repeat(100_000)
        );
        assert_refused(&text, &["line 3 is longer"]);
        for text in ["", "\n\n", "\0\0\0", "%%MatrixMarket", "1 1\n1\n"] {
            assert_refused(text, &["first line"]);
        }
    }
}
