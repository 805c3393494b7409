//! Right-preconditioned GMRES without restart (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7
//! (1986)).
//!
//! Right preconditioning ensures that the minimised residual is the true one.

use crate::vector::{axpy, dot, norm};

/// One pass of Gram-Schmidt suffices where more than this fraction of the length is left.
const KEPT_LENGTH: f64 = 0.7;
/// Fraction of the length below which the Krylov space is invariant: it contains the solution.
const INVARIANT: f64 = 1e-15;

/// End of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct GmresEnd {
    /// Number of products with the matrix, at most as many as were allowed.
    pub iterations: usize,
    /// Relative residual |b - A x| / |b|.
    pub relative_residual: f64,
    /// True if the residual fell below the tolerance.
    pub converged: bool,
}

impl GmresEnd {
    /// End of a solve that needs no iteration.
    pub const SOLVED: Self = Self {
        iterations: 0,
        relative_residual: 0.0,
        converged: true,
    };

    /// End of a solve that was made otherwise behind so many iterations.
    pub fn solved_after(iterations: usize) -> Self {
        Self {
            iterations,
            ..Self::SOLVED
        }
    }
}

/// Solves `A x = b` from x = 0. `precondition(v)` replaces v by an approximation P v of A^-1 v;
/// `apply(v, w)` writes A P v into w. Stops at `|b - A x| <= tolerance |b|` or after
/// `max_iterations`.
pub fn gmres(
    mut apply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&mut [f64]),
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    max_iterations: usize,
) -> GmresEnd {
    let n = b.len();
    x.fill(0.0);
    let beta = norm(b);
    if beta == 0.0 || !beta.is_finite() {
        return GmresEnd {
            iterations: 0,
            relative_residual: beta,
            converged: beta == 0.0,
        };
    }
    let mut basis: Vec<Vec<f64>> = vec![b.iter().map(|v| v / beta).collect()];
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut g = vec![beta];
    let mut relative = 1.0;
    for j in 0..max_iterations {
        let mut w = vec![0.0; n];
        apply(&basis[j], &mut w);
        let before = norm(&w);
        let mut h = orthogonalise(&mut w, &basis);
        for (i, &(c, s)) in rotations.iter().enumerate() {
            let (a, b) = (h[i], h[i + 1]);
            h[i] = c * a + s * b;
            h[i + 1] = -s * a + c * b;
        }
        let radius = h[j].hypot(h[j + 1]);
        if !radius.is_finite() || radius == 0.0 {
            break;
        }
        let (c, s) = (h[j] / radius, h[j + 1] / radius);
        let is_invariant = h[j + 1] <= INVARIANT * before;
        let next = h[j + 1];
        h[j] = radius;
        rotations.push((c, s));
        g.push(-s * g[j]);
        g[j] *= c;
        h.truncate(j + 1);
        triangle.push(h);
        relative = g[j + 1].abs() / beta;
        if relative <= tolerance || is_invariant {
            break;
        }
        w.iter_mut().for_each(|v| *v /= next);
        basis.push(w);
    }
    for (yi, v) in back_substituted(&triangle, &g).iter().zip(&basis) {
        axpy(*yi, v, x);
    }
    precondition(x);
    GmresEnd {
        iterations: triangle.len(),
        relative_residual: relative,
        converged: relative <= tolerance,
    }
}

/// Makes w orthogonal to the basis by modified Gram-Schmidt, twice where the first pass loses
/// digits. Returns its components in the basis, and the length of the rest.
fn orthogonalise(w: &mut [f64], basis: &[Vec<f64>]) -> Vec<f64> {
    let before = norm(w);
    let mut h = vec![0.0; basis.len() + 1];
    for pass in 0..2 {
        for (hi, v) in h.iter_mut().zip(basis) {
            let c = dot(w, v);
            *hi += c;
            axpy(-c, v, w);
        }
        if pass == 0 && norm(w) > KEPT_LENGTH * before {
            break;
        }
    }
    h[basis.len()] = norm(w);
    h
}

/// Solution y of R y = g, with R upper triangular by columns.
fn back_substituted(triangle: &[Vec<f64>], g: &[f64]) -> Vec<f64> {
    let m = triangle.len();
    let mut y = vec![0.0; m];
    for i in (0..m).rev() {
        let tail: f64 = (i + 1..m).map(|j| triangle[j][i] * y[j]).sum();
        y[i] = (g[i] - tail) / triangle[i][i];
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_nonsymmetric_system_and_reports_the_true_residual() {
        let n = 40;
        let entry = |i: usize, j: usize| {
            if i == j {
                4.0 + i as f64 * 0.1
            } else {
                ((i * 7 + j * 3) as f64).sin() / n as f64
            }
        };
        let apply = |v: &[f64], y: &mut [f64]| {
            for (i, y) in y.iter_mut().enumerate() {
                *y = (0..n).map(|j| entry(i, j) * v[j]).sum();
            }
        };
        let b: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
        let mut x = vec![0.0; n];
        let diagonal = |v: &mut [f64]| (0..n).for_each(|i| v[i] /= entry(i, i));
        let preconditioned = |v: &[f64], w: &mut [f64]| {
            let mut z = v.to_vec();
            diagonal(&mut z);
            apply(&z, w);
        };
        let end = gmres(preconditioned, diagonal, &b, &mut x, 1e-12, n);
        assert!(end.converged && end.iterations < 25, "{end:?}");
        let mut ax = vec![0.0; n];
        apply(&x, &mut ax);
        let r: Vec<f64> = b.iter().zip(&ax).map(|(b, a)| b - a).collect();
        assert!((norm(&r) / norm(&b) - end.relative_residual).abs() < 1e-12);
        let short = gmres(preconditioned, diagonal, &b, &mut x, 1e-12, 2);
        assert!(!short.converged && short.iterations == 2);
    }

    #[test]
    fn a_zero_right_hand_side_gives_zero() {
        let mut x = vec![1.0; 3];
        let end = gmres(|_, _| unreachable!(), |_| (), &[0.0; 3], &mut x, 1e-8, 5);
        assert!(end.converged && x == [0.0; 3]);
    }
}
