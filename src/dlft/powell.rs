//! Powell's hybrid method (dogleg in a trust region), the paper's solver, with the exact Jacobian.
//!
//! M. J. D. Powell, A hybrid method for nonlinear equations, 1970; the region is scaled by eps, so that
//! steps are measured in forces.

use super::balance::Balance;
use super::newton_krylov::{load_scale, relative_residual};
use crate::numerics::dogleg::{DoglegSystem, dogleg};
use crate::numerics::newton::{NewtonEnd, NewtonOptions};
use faer::Mat;

/// Solves one frequency from `u`.
pub fn powell(balance: &Balance<'_>, u: &mut [f64], options: NewtonOptions) -> NewtonEnd {
    let system = DenseBalance {
        balance,
        scale: load_scale(balance, options.tolerance),
    };
    dogleg(&system, u, options)
}

struct DenseBalance<'a, 'b> {
    balance: &'b Balance<'a>,
    scale: [f64; 2],
}

impl DoglegSystem for DenseBalance<'_, '_> {
    fn residual(&self, x: &[f64]) -> Vec<f64> {
        self.balance.evaluate(x).residual
    }
    fn measure(&self, f: &[f64]) -> f64 {
        relative_residual(f, self.balance.unknowns_per_block(), self.scale)
    }
    fn scaling(&self, i: usize) -> f64 {
        self.balance.eps_at(i)
    }
    /// J = (I - D)(Lambda - eps) + eps, dense, all pairs.
    fn jacobian(&self, x: &[f64]) -> Mat<f64> {
        let balance = self.balance;
        let n = balance.unknowns_per_block();
        let width = x.len() / n;
        let jacobian = balance.linearise(&balance.lambda_u(x));
        let mut out = Mat::<f64>::zeros(x.len(), x.len());
        // Lambda - eps.
        let mut stiffness = balance.setting.system.model.stiffness.clone();
        if let Some(retention) = balance.retention() {
            retention.add_to_matrix(&mut stiffness);
        }
        for j in 0..n {
            out.col_as_slice_mut(j)[..n].copy_from_slice(stiffness.col_as_slice(j));
        }
        for k in 1..=balance.stiffness.harmonics() {
            let [re, im] = balance.stiffness.formed(k);
            let (c, s) = ((2 * k - 1) * n, 2 * k * n);
            for j in 0..n {
                for i in 0..n {
                    let (re, im) = (re[(i, j)], im[(i, j)]);
                    out[(c + i, c + j)] = re;
                    out[(c + i, s + j)] = im;
                    out[(s + i, c + j)] = -im;
                    out[(s + i, s + j)] = re;
                }
            }
        }
        for i in 0..x.len() {
            out[(i, i)] -= balance.eps_at(i);
        }
        let mut derivatives = vec![None; n / 3];
        for (pair, d) in jacobian.active.iter().zip(&jacobian.derivatives) {
            derivatives[*pair] = Some(d);
        }
        let full = 3 * width;
        let mut local = vec![0.0; full];
        for j in 0..x.len() {
            let column = out.col_as_slice_mut(j);
            for (pair, derivative) in derivatives.iter().enumerate() {
                let at = |i: usize| (i % width) * n + 3 * pair + i / width;
                match derivative {
                    None => (0..full).for_each(|i| column[at(i)] = 0.0),
                    Some(d) => {
                        (0..full).for_each(|i| local[i] = column[at(i)]);
                        for (i, row) in d.chunks_exact(full).enumerate() {
                            let moved: f64 = row.iter().zip(&local).map(|(d, l)| d * l).sum();
                            column[at(i)] -= moved;
                        }
                    }
                }
            }
        }
        for i in 0..x.len() {
            out[(i, i)] += balance.eps_at(i);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{at_sample_points, differences};
    use crate::numerics::differences::assert_close;

    #[test]
    fn the_dense_jacobian_is_that_by_differences() {
        at_sample_points(|what, balance, u| {
            let scale = [1.0; 2];
            let exact = DenseBalance { balance, scale }.jacobian(u);
            assert_close(&exact, &differences(balance, u), 1e-7, what);
        });
    }
}
