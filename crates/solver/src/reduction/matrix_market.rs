//! Dense matrices as MatrixMarket text. The dense format is read line by line: a flank of some thousand pairs has a
//! stiffness of gigabytes of text. Every other format is left to nalgebra-sparse.

use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::Path;

use faer::{Mat, MatRef};
use nalgebra_sparse::io::load_coo_from_matrix_market_str;

use crate::input;

const DENSE: &str = "%%MatrixMarket matrix array real general";

/// Writes a dense array, column by column, with the shortest digits that read back exactly.
///
/// # Errors
/// Those of the file.
pub fn write(path: &Path, a: MatRef<'_, f64>) -> io::Result<()> {
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "{DENSE}\n{} {}", a.nrows(), a.ncols())?;
    for j in 0..a.ncols() {
        for i in 0..a.nrows() {
            writeln!(file, "{:e}", a[(i, j)])?;
        }
    }
    file.flush()
}

/// Reads a matrix. What the header announces is held against the length of the file before room is
/// made for it.
///
/// # Errors
/// What is wrong, with the line where there is one.
pub fn read(path: &Path) -> Result<Mat<f64>, String> {
    let said = |e: io::Error| e.to_string();
    let file = input::open(path).map_err(said)?;
    let bytes = file.metadata().map_err(said)?.len();
    let mut lines = Lines::of(file);
    let header = lines.next()?.unwrap_or_default();
    // Some writers put one percent sign where the format wants two.
    let header = format!("%%{}", header.trim_start_matches('%'));
    let form = Form::of(&header)?;
    let size = loop {
        match lines.next()? {
            Some(text) if !text.is_empty() && !text.starts_with('%') => break text.to_owned(),
            Some(_) => {}
            None => return Err("the line with the size is missing".to_owned()),
        }
    };
    let announced = form.announced(&size, bytes);
    let announced = announced.map_err(|why| format!("line {}: {why}", lines.number))?;
    if form == Form::Dense {
        return dense(&mut lines, announced);
    }
    let mut text = format!("{header}\n{size}\n");
    io::Read::read_to_string(&mut lines.file, &mut text).map_err(said)?;
    let entries = load_coo_from_matrix_market_str::<f64>(&text).map_err(|e| one_line(&e))?;
    let mut a = Mat::zeros(entries.nrows(), entries.ncols());
    for (i, j, value) in entries.triplet_iter() {
        a[(i, j)] += *value;
    }
    Ok(a)
}

/// How the entries stand in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// [`DENSE`].
    Dense,
    /// Dense, one half left out, or other numbers.
    OtherArray { half: bool },
    /// A line per entry, with its row and its column.
    Coordinate,
}

impl Form {
    fn of(header: &str) -> Result<Self, String> {
        let header = header.to_lowercase();
        let words: Vec<&str> = header.split_whitespace().collect();
        match words[..] {
            ["%%matrixmarket", "matrix", "array", "real", "general"] => Ok(Self::Dense),
            ["%%matrixmarket", "matrix", "array", _, symmetry] => Ok(Self::OtherArray {
                half: symmetry != "general",
            }),
            ["%%matrixmarket", "matrix", "coordinate", _, _] => Ok(Self::Coordinate),
            _ => Err(format!("the first line is not \"{DENSE}\"")),
        }
    }

    /// Rows and columns by the line of the size, where a file of so many bytes can hold the
    /// entries.
    fn announced(self, size: &str, bytes: u64) -> Result<[usize; 2], String> {
        let numbers: Option<Vec<usize>> = size.split_whitespace().map(|s| s.parse().ok()).collect();
        let (rows, columns, entries) = match (self, numbers.as_deref()) {
            (Self::Coordinate, Some(&[rows, columns, entries])) => (rows, columns, Some(entries)),
            (Self::Coordinate, _) => {
                return Err(format!(
                    "\"{size}\" is not a number of rows, of columns and of entries"
                ));
            }
            (Self::Dense | Self::OtherArray { .. }, Some(&[rows, columns])) => {
                (rows, columns, None)
            }
            _ => {
                return Err(format!("\"{size}\" is not a number of rows and of columns"));
            }
        };
        let most = usize::try_from(bytes).unwrap_or(usize::MAX);
        let in_all = rows.checked_mul(columns);
        let fits = match self {
            Self::Dense => in_all.is_some_and(|n| n <= most / BYTES_OF_AN_ENTRY + 1),
            Self::OtherArray { half: is_half } => in_all.is_some_and(|n| {
                // Skew matrices leave out the diagonal, too.
                let stand = if is_half {
                    n.saturating_sub(rows) / 2
                } else {
                    n
                };
                stand <= most / BYTES_OF_AN_ENTRY + 1
            }),
            Self::Coordinate => {
                entries.is_some_and(|n| n <= most / BYTES_OF_A_PLACED_ENTRY + 1)
                    && in_all.is_some_and(|n| n <= most.saturating_mul(ENTRIES_TO_A_BYTE))
            }
        };
        // A matrix without rows may still announce more columns than could ever be gone through.
        if fits && rows.max(columns) <= most {
            return Ok([rows, columns]);
        }
        let entries = entries.map_or(String::new(), |n| format!(" with {n} entries"));
        Err(format!(
            "a matrix of {rows} x {columns}{entries} does not stand in a file of {bytes} bytes"
        ))
    }
}

/// A digit and a line end.
const BYTES_OF_AN_ENTRY: usize = 2;
/// Row, column and value, a digit each, two blanks and a line end.
const BYTES_OF_A_PLACED_ENTRY: usize = 6;
/// Most entries, zeros with them, that a matrix given entry by entry may have for each byte of its
/// file: what is read is dense, 64 bytes of memory for one of the file.
const ENTRIES_TO_A_BYTE: usize = 8;

/// The entries of a dense array, what follows its size.
fn dense(lines: &mut Lines, [rows, columns]: [usize; 2]) -> Result<Mat<f64>, String> {
    let mut a = Mat::zeros(rows, columns);
    let expected = rows * columns;
    let mut found = 0;
    while let Some(text) = lines.next()? {
        if text.is_empty() || text.starts_with('%') {
            continue;
        }
        let value: Result<f64, _> = text.parse();
        let Ok(value) = value else {
            let message = format!("\"{text}\" is not a number");
            return Err(format!("line {}: {message}", lines.number));
        };
        if found < expected {
            a[(found % rows, found / rows)] = value;
        }
        found += 1;
    }
    match found == expected {
        true => Ok(a),
        false => Err(format!("{expected} entries are announced, {found} found")),
    }
}

/// Most bytes of a line.
const MOST_OF_A_LINE: u64 = 4096;

/// The lines of a file, without the blanks around them.
struct Lines {
    file: BufReader<File>,
    line: String,
    /// Of the line read last, counted from 1.
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
}

/// A message of several lines on one.
fn one_line(message: &impl ToString) -> String {
    let message = message.to_string();
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    fn read_text(name: &str, text: &str) -> Result<Mat<f64>, String> {
        let name = format!("dovetail-matrix-{name}-{}.mtx", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, text).unwrap();
        let read = read(&path);
        std::fs::remove_file(&path).unwrap();
        read
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
            let message = read_text("header", &text).unwrap_err();
            assert!(
                message.contains("line 3") && message.contains("bytes"),
                "{header}, {size}: {message}"
            );
        }
        assert!(begin.elapsed() < Duration::from_secs(5));
    }

    #[test]
    fn matrices_of_every_form_are_read() {
        let array = "%%MatrixMarket matrix array real general\n2 2\n1\n2\n2\n5";
        let half = "%%MatrixMarket matrix array real symmetric\n2 2\n1\n2\n5\n";
        let placed =
            "%%MatrixMarket matrix coordinate real symmetric\n2 2 3\n1 1 1\n2 1 2\n2 2 5\n";
        for text in [array, half, placed] {
            let a = read_text("forms", text).unwrap();
            let found = [a[(0, 0)], a[(0, 1)], a[(1, 0)], a[(1, 1)]];
            assert_eq!(found, [1.0, 2.0, 2.0, 5.0], "{text}");
        }
        // A digit and a line end an entry, the last without: as short as a file can be.
        let shortest = format!(
            "%MatrixMarket matrix array real general\n9 9\n{}7",
            "1\n".repeat(80)
        );
        assert_eq!(read_text("shortest", &shortest).unwrap()[(8, 8)], 7.0);
    }

    #[test]
    fn a_line_has_an_end() {
        let text = format!(
            "%%MatrixMarket matrix array real general\n1 1\n{}\n",
            " ".repeat(100_000)
        );
        let message = read_text("line", &text).unwrap_err();
        assert!(message.contains("line 3 is longer"), "{message}");
        for text in ["", "\n\n", "\0\0\0", "%%MatrixMarket", "1 1\n1\n"] {
            let message = read_text("first-line", text).unwrap_err();
            assert!(message.contains("first line"), "{text:?}: {message}");
        }
    }
}
