//! Dense matrices as files of MatrixMarket.

use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Read, Write};
use std::path::Path;

use dovetail_matrices::read_matrix_market;
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
    let lines = BufReader::new(input::open(path)?.take(MOST_COMMENT)).lines();
    let comment = |line: io::Result<String>| match line {
        Ok(line) => line
            .strip_prefix('%')
            .map(|words| Ok(words.trim().to_owned())),
        Err(error) => Some(Err(error)),
    };
    lines.skip(1).map_while(comment).collect()
}

/// Reads a matrix of any form with real entries.
///
/// # Errors
/// A description of the error, with the line if there is one.
pub fn read(path: &Path) -> Result<Mat<f64>, String> {
    let said = |e: io::Error| e.to_string();
    let file = input::open(path).map_err(said)?;
    let bytes = file.metadata().map_err(said)?.len();
    let bytes = usize::try_from(bytes).unwrap_or(usize::MAX);
    let file = BufReader::with_capacity(1 << 20, file);
    let add = |a: &mut Mat<f64>, [row, column]: [usize; 2], value| a[(row, column)] += value;
    read_matrix_market(file, bytes, Mat::zeros, add).map_err(|e| e.to_string())
}
