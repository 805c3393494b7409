//! Derivatives by differences, against which the tests hold derivatives written by hand.

use faer::Mat;

/// df/dx at `x` by central differences of step `step` in every entry, one column per entry of x.
pub fn central(x: &[f64], step: f64, mut f: impl FnMut(&[f64]) -> Vec<f64>) -> Mat<f64> {
    let columns: Vec<Vec<f64>> = (0..x.len())
        .map(|j| {
            let mut at = |place: f64| {
                let mut moved = x.to_vec();
                moved[j] = place;
                f(&moved)
            };
            let (up, down) = (at(x[j] + step), at(x[j] - step));
            let ends = up.iter().zip(&down);
            ends.map(|(up, down)| (up - down) / (2.0 * step)).collect()
        })
        .collect();
    Mat::from_fn(columns[0].len(), x.len(), |i, j| columns[j][i])
}

/// Panics unless both matrices agree within `tolerance`, entry by entry; names the worst entry.
pub fn assert_close(exact: &Mat<f64>, differences: &Mat<f64>, tolerance: f64, what: &str) {
    assert_eq!(exact.nrows(), differences.nrows());
    assert_eq!(exact.ncols(), differences.ncols());
    for j in 0..exact.ncols() {
        for i in 0..exact.nrows() {
            let (a, b) = (exact[(i, j)], differences[(i, j)]);
            let is_close = (a - b).abs() <= tolerance;
            assert!(
                is_close,
                "{what}: entry ({i}, {j}) is {a}, differences say {b}"
            );
        }
    }
}
