//! Derivatives of the contact force of a pair over a period, as rows, and those of its state where
//! the period is a fixed point.
//!
//! A row has three blocks of the padded width of the Fourier series: the derivatives by the
//! coefficients of lambda_u, N, t1 and t2. Where the pair is periodic, two entries between the blocks
//! ([`state_columns`]) have the derivatives by lambda_x at the start of the period, which the others
//! hold constant. One period then gives the derivative of the periodic state ([`fixed_point`]).

/// Determinant of I - memory, at least, of a pair whose periodic state is solved for.
const FORGETS: f64 = 1e-12;

/// Matrix of two rows and two columns, row by row.
pub(crate) type Square = [[f64; 2]; 2];

/// Derivative of the contact force over a period.
pub(crate) struct DerivativeSignals {
    /// Derivative of the force at the samples, a block for its normal part, which the normal
    /// prediction alone determines, and two rows for each sample.
    pub signals: Vec<f64>,
    /// Derivatives of the normal force at samples by the tangential predictions, a row each.
    pub normal_changes: Vec<(usize, Vec<f64>)>,
    /// Rows of lambda_x at the end of the period where it is also that at the start.
    pub end: Option<Vec<f64>>,
}

/// Entries of a row for lambda_x at the start of the period: behind the first and the second block.
pub(crate) fn state_columns(width: usize, block: usize) -> [usize; 2] {
    [width, block + width]
}

/// Two rows of lambda_x at the start of a period, as its derivative is at first: that by itself.
pub(crate) fn identity_state(width: usize, block: usize) -> Vec<f64> {
    let mut rows = vec![0.0; 6 * block];
    for (i, column) in state_columns(width, block).into_iter().enumerate() {
        rows[i * 3 * block + column] = 1.0;
    }
    rows
}

/// Derivative of lambda_x at the start of a period by all coefficients, from that at the end, where
/// both are the same: (I - memory)^-1 times what the period adds. A pair that forgets nothing keeps
/// what the period adds.
pub(crate) fn fixed_point(end: &[f64], width: usize, block: usize) -> [Vec<f64>; 2] {
    let (first, second) = end.split_at(3 * block);
    let columns = state_columns(width, block);
    let memory = [first, second].map(|row| columns.map(|column| row[column]));
    let mut rows = [first.to_vec(), second.to_vec()];
    let [first, second] = &mut rows;
    for (a, b) in first.iter_mut().zip(second) {
        [*a, *b] = solve_memory(memory, [*a, *b]).unwrap_or([*a, *b]);
    }
    // The start does not depend on itself.
    for row in &mut rows {
        columns.into_iter().for_each(|column| row[column] = 0.0);
    }
    rows
}

/// Computes (I - memory)^-1 r; `None` where the pair forgets nothing.
pub(crate) fn solve_memory(memory: Square, r: [f64; 2]) -> Option<[f64; 2]> {
    let [[a, b], [c, d]] = memory;
    let (a, d) = (1.0 - a, 1.0 - d);
    let determinant = a * d - b * c;
    (determinant > FORGETS).then(|| {
        [
            (d * r[0] + b * r[1]) / determinant,
            (a * r[1] + c * r[0]) / determinant,
        ]
    })
}
