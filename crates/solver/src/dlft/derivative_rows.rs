//! Derivatives of the contact force of a pair over a period, as rows, and those of its state where
//! the period is a fixed point.
//!
//! A row has three blocks of the padded width of the Fourier series: the derivatives by the
//! coefficients of lambda_u, N, t1 and t2. Where the pair is periodic, two entries between the blocks
//! ([`state_columns`]) have the derivatives by lambda_x at the start of the period, which the others
//! hold constant. One period then gives the derivative of the periodic state ([`fixed_point`]).

/// Determinant of I - memory, at least, of a pair whose periodic state is solved for.
const FORGETS: f64 = 1e-12;

/// Derivative of the contact force over a period.
pub struct DerivativeSignals {
    /// Derivative of the force at the samples, a block for its normal part, which the normal
    /// prediction alone determines, and two rows for each sample.
    pub signals: Vec<f64>,
    /// What tangential predictions do to the normal force at samples, a row each.
    pub normal_changes: Vec<(usize, Vec<f64>)>,
    /// Rows of lambda_x at the end of the period where it is also that at the start.
    pub end: Option<Vec<f64>>,
}

/// Entries of a row for lambda_x at the start of the period: behind the first and the second block.
pub fn state_columns(width: usize, block: usize) -> [usize; 2] {
    [width, block + width]
}

/// Two rows of lambda_x at the start of a period, as its derivative is at first: that by itself.
pub fn own_state(width: usize, block: usize) -> Vec<f64> {
    let mut rows = vec![0.0; 6 * block];
    for (i, column) in state_columns(width, block).into_iter().enumerate() {
        rows[i * 3 * block + column] = 1.0;
    }
    rows
}

/// Derivative of lambda_x at the start of a period by all coefficients, from that at the end, where
/// both are the same: (I - memory)^-1 times what the period adds. A pair that forgets nothing keeps
/// what the period adds.
pub fn fixed_point(end: &[f64], width: usize, block: usize) -> [Vec<f64>; 2] {
    let (first, second) = end.split_at(3 * block);
    let columns = state_columns(width, block);
    let [[a, b], [c, d]] = [first, second].map(|row| columns.map(|column| row[column]));
    let (a, d) = (1.0 - a, 1.0 - d);
    let determinant = a * d - b * c;
    let mut rows = [first.to_vec(), second.to_vec()];
    if determinant > FORGETS {
        let inverse = [[d, b], [c, a]].map(|row| row.map(|v| v / determinant));
        for (row, [by_first, by_second]) in rows.iter_mut().zip(inverse) {
            for (v, (a, b)) in row.iter_mut().zip(first.iter().zip(second)) {
                *v = by_first * a + by_second * b;
            }
        }
    }
    // The start does not depend on itself.
    for row in &mut rows {
        columns.into_iter().for_each(|column| row[column] = 0.0);
    }
    rows
}
