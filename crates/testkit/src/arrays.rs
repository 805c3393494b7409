//! Dense MatrixMarket arrays of the test data.

use faer::Mat;

/// Array of a file whose entries follow column by column.
///
/// # Panics
/// If the file is not such an array.
pub fn dense(path: &str) -> Mat<f64> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let mut numbers = text
        .lines()
        .filter(|line| !line.starts_with('%'))
        .flat_map(str::split_ascii_whitespace);
    let mut size = || numbers.next().and_then(|n| n.parse().ok());
    let (rows, columns): (usize, usize) = size().zip(size()).expect("a line with the size");
    let values: Vec<f64> = numbers.map(|n| n.parse().expect("a number")).collect();
    assert_eq!(values.len(), rows * columns, "{path}");
    Mat::from_fn(rows, columns, |i, j| values[j * rows + i])
}
