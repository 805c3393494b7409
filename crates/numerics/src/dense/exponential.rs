//! Exponential of a matrix: Padé approximants with scaling and squaring (N. J. Higham, SIAM J. Matrix
//! Anal. Appl. 26 (2005) 1179-1193).

use super::sequential::{Lu, product};
use faer::{Mat, MatRef};

/// Largest 1-norms at which the approximants of the degrees 3, 5, 7 and 9 are exact to rounding.
const REACH: [(usize, f64); 4] = [
    (3, 1.495_585_217_958_292e-2),
    (5, 2.539_398_330_063_23e-1),
    (7, 9.504_178_996_162_932e-1),
    (9, 2.097_847_961_257_068),
];
/// Largest 1-norm for the degree 13; larger matrices are halved first.
const LARGEST: f64 = 5.371_920_351_148_152;

/// Exponential of a square matrix. It is not finite where the matrix is not.
pub fn exponential(a: MatRef<'_, f64>) -> Mat<f64> {
    let norm = one_norm(a);
    if !norm.is_finite() {
        return Mat::from_fn(a.nrows(), a.ncols(), |_, _| f64::NAN);
    }
    if let Some((degree, _)) = REACH.into_iter().find(|(_, reach)| norm <= *reach) {
        return approximant(a, degree);
    }
    let halvings = (norm / LARGEST).log2().ceil().max(0.0) as i32;
    let factor = 0.5_f64.powi(halvings);
    let scaled = Mat::from_fn(a.nrows(), a.ncols(), |i, j| factor * a[(i, j)]);
    let mut of = approximant(scaled.as_ref(), 13);
    for _ in 0..halvings {
        of = product(of.as_ref(), of.as_ref());
    }
    of
}

/// Largest sum of the sizes of a column.
fn one_norm(a: MatRef<'_, f64>) -> f64 {
    let columns = a.col_iter().map(|c| c.iter().map(|v| v.abs()).sum::<f64>());
    columns.fold(0.0, |m, s| if s.is_nan() { s } else { m.max(s) })
}

/// Approximant q(a)^-1 p(a) of an odd degree of at most 13, with p(a) = V + U and q(a) = V - U, where V
/// has the even powers and U the odd ones.
fn approximant(a: MatRef<'_, f64>, degree: usize) -> Mat<f64> {
    let coefficients = coefficients(degree);
    let powers = even_powers(a, degree / 2);
    // Coefficients of the powers 0, 2, 4 ... of V and of U / a.
    let series = |first: usize| {
        let of: Vec<f64> = coefficients
            .iter()
            .skip(first)
            .step_by(2)
            .copied()
            .collect();
        let (low, high) = of.split_at(of.len().min(4));
        let mut sum = combined(&powers, low[0], &low[1..]);
        if !high.is_empty() {
            let rest = combined(&powers, 0.0, high);
            sum += product(powers[2].as_ref(), rest.as_ref());
        }
        sum
    };
    let even = series(0);
    let odd = product(a, series(1).as_ref());
    let mut numerator = &even + &odd;
    Lu::new(&even - &odd).solve_in_place(numerator.as_mut());
    numerator
}

/// Powers a^2, a^4, a^6, at least one and no more than `most` of them.
fn even_powers(a: MatRef<'_, f64>, most: usize) -> Vec<Mat<f64>> {
    let mut powers = vec![product(a, a)];
    while powers.len() < most.min(3) {
        let next = product(powers[0].as_ref(), powers[powers.len() - 1].as_ref());
        powers.push(next);
    }
    powers
}

/// Sum of `constant` times the identity and of the first powers times their coefficients.
fn combined(powers: &[Mat<f64>], constant: f64, coefficients: &[f64]) -> Mat<f64> {
    let n = powers[0].nrows();
    Mat::from_fn(n, n, |i, j| {
        let diagonal = if i == j { constant } else { 0.0 };
        let terms = powers.iter().zip(coefficients);
        terms.fold(diagonal, |sum, (power, c)| sum + c * power[(i, j)])
    })
}

/// Coefficients of p in ascending order: (2d - i)! d! / ((2d)! i! (d - i)!).
fn coefficients(degree: usize) -> Vec<f64> {
    let mut all = vec![1.0];
    for i in 0..degree {
        let ratio = (degree - i) as f64 / ((2 * degree - i) as f64 * (i + 1) as f64);
        all.push(all[i] * ratio);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_of_a_rotation_is_a_turn_at_every_size() {
        for angle in [1e-3, 0.1, 0.7, 1.9, 4.0, 300.0] {
            let turn: Mat<f64> = Mat::from_fn(2, 2, |i, j| angle * (i as f64 - j as f64));
            let found = exponential(turn.as_ref());
            let (s, c) = f64::sin_cos(angle);
            for (i, j, value) in [(0, 0, c), (0, 1, -s), (1, 0, s), (1, 1, c)] {
                let off = (found[(i, j)] - value).abs();
                assert!(off < 1e-15 * (10.0 + 20.0 * angle), "{angle}: {off:e}");
            }
        }
    }

    #[test]
    fn a_nilpotent_matrix_has_a_finite_series() {
        let mut a = Mat::<f64>::zeros(3, 3);
        (a[(0, 1)], a[(1, 2)], a[(0, 2)]) = (3.0, 5.0, 7.0);
        let found = exponential(a.as_ref());
        assert!((found[(0, 1)] - 3.0).abs() < 1e-14 && (found[(1, 2)] - 5.0).abs() < 1e-14);
        assert!((found[(0, 2)] - 14.5).abs() < 1e-13 && (found[(2, 2)] - 1.0).abs() < 1e-15);
    }
}
