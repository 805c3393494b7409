//! Dense matrices as MatrixMarket text. The dense format is read line by line: a flank of some thousand pairs has a
//! stiffness of gigabytes of text. Every other format is left to nalgebra-sparse.

use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::Path;

use faer::{Mat, MatRef};
use nalgebra_sparse::io::load_coo_from_matrix_market_str;

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

/// Reads a matrix.
///
/// # Errors
/// What is wrong, with the line where there is one.
pub fn read(path: &Path) -> Result<Mat<f64>, String> {
    let said = |e: io::Error| e.to_string();
    let mut file = BufReader::with_capacity(1 << 20, File::open(path).map_err(said)?);
    let mut header = String::new();
    file.read_line(&mut header).map_err(said)?;
    // Some writers put one percent sign where the format wants two.
    let header = format!("%%{}", header.trim().trim_start_matches('%'));
    if header
        .to_lowercase()
        .split_whitespace()
        .eq(DENSE.to_lowercase().split_whitespace())
    {
        return dense(&mut file);
    }
    let mut text = header + "\n";
    io::Read::read_to_string(&mut file, &mut text).map_err(said)?;
    let entries = load_coo_from_matrix_market_str::<f64>(&text).map_err(|e| one_line(&e))?;
    let mut a = Mat::zeros(entries.nrows(), entries.ncols());
    for (i, j, value) in entries.triplet_iter() {
        a[(i, j)] += *value;
    }
    Ok(a)
}

/// What follows the header: comments, the size, the entries.
fn dense(file: &mut impl BufRead) -> Result<Mat<f64>, String> {
    let mut a: Option<Mat<f64>> = None;
    let (mut line, mut number, mut found) = (String::new(), 1, 0);
    loop {
        line.clear();
        number += 1;
        if file.read_line(&mut line).map_err(|e| e.to_string())? == 0 {
            break;
        }
        let text = line.trim();
        if text.is_empty() || text.starts_with('%') {
            continue;
        }
        let Some(a) = &mut a else {
            let sizes: Option<Vec<usize>> =
                text.split_whitespace().map(|s| s.parse().ok()).collect();
            let Some([rows, columns]) = sizes.as_deref() else {
                return Err(format!(
                    "line {number}: \"{text}\" is not a number of rows and of columns"
                ));
            };
            let fits = rows.checked_mul(*columns).is_some_and(|n| n < MOST_ENTRIES);
            if !fits {
                return Err(format!(
                    "line {number}: {rows} x {columns} entries are too many"
                ));
            }
            a = Some(Mat::zeros(*rows, *columns));
            continue;
        };
        let value: f64 = text
            .parse()
            .map_err(|_| format!("line {number}: \"{text}\" is not a number"))?;
        if found < a.nrows() * a.ncols() {
            let (i, j) = (found % a.nrows(), found / a.nrows());
            a[(i, j)] = value;
        }
        found += 1;
    }
    let a = a.ok_or("the line with the size is missing")?;
    let expected = a.nrows() * a.ncols();
    if found == expected {
        Ok(a)
    } else {
        Err(format!("{expected} entries are announced, {found} found"))
    }
}

/// 64 GB.
const MOST_ENTRIES: usize = 1 << 33;

/// A message of several lines on one.
fn one_line(message: &impl ToString) -> String {
    let message = message.to_string();
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}
