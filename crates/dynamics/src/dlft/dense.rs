//! Solution of one frequency with its Jacobian formed and factored, for few unknowns: Newton's
//! method with exact corrections, and Powell's hybrid method, the paper's solver.
//!
//! M. J. D. Powell, A hybrid method for nonlinear equations, 1970; its region is scaled by eps, so
//! that steps are measured in forces.

use super::balance::{Balance, Evaluation, Evaluator, Jacobian};
use super::measure::{load_scale, relative_residual, step_length};
use dovetail_numerics::dense::Lu;
use dovetail_numerics::nonlinear::{
    Damping, DoglegSystem, NewtonEnd, NewtonOptions, NonlinearSystem, correction, dogleg, newton,
};
use dovetail_numerics::spectrum::{cosine, sine};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

/// Most unknowns for which the dense dogleg and rounded laws with exact corrections are tried.
pub(crate) const MOST_DENSE_UNKNOWNS: usize = 2000;

/// Solves one frequency from `u` by Newton's method, with exact corrections and
/// [`Damping::Persistent`]. `known` is the evaluation there, if there is one. Returns the evaluation
/// at its end, too.
pub(crate) fn exact_newton(
    balance: &Balance,
    u: &mut [f64],
    known: Option<Evaluation>,
    options: NewtonOptions,
) -> (NewtonEnd, Evaluation) {
    let mut system = ExactSystem::new(balance, options);
    system.dense.evaluator.keep(u, known);
    let end = newton(&mut system, u, options);
    (end, system.dense.evaluator.take_evaluation(u))
}

/// Newton's correction at `u`, which is not applied; `None` where the Jacobian is singular there.
pub(crate) fn exact_correction(
    balance: &Balance,
    u: &[f64],
    options: NewtonOptions,
) -> Option<Vec<f64>> {
    correction(
        &mut ExactSystem::new(balance, options),
        u,
        options.tolerance,
    )
}

/// Like `exact_newton`, by the dogleg.
pub fn powell(
    balance: &Balance,
    u: &mut [f64],
    known: Option<Evaluation>,
    options: NewtonOptions,
) -> (NewtonEnd, Evaluation) {
    let mut system = DenseBalance::new(balance, options);
    system.evaluator.keep(u, known);
    let end = dogleg(&mut system, u, options);
    (end, system.evaluator.take_evaluation(u))
}

/// Solves J dx = -f with the factor of J, as [`NonlinearSystem::correction`] does.
pub(crate) fn exactly_corrected(factor: Option<&Lu>, f: &[f64], dx: &mut [f64]) -> Option<f64> {
    let factor = factor?;
    dx.iter_mut().zip(f).for_each(|(d, f)| *d = -f);
    factor.solve_column_in_place(dx);
    dx.iter().all(|d| d.is_finite()).then_some(0.0)
}

struct ExactSystem<'a> {
    dense: DenseBalance<'a>,
    /// Factor of the Jacobian at the last linearisation.
    factor: Option<Lu>,
}

impl<'a> ExactSystem<'a> {
    fn new(balance: &'a Balance, options: NewtonOptions) -> Self {
        Self {
            dense: DenseBalance::new(balance, options),
            factor: None,
        }
    }
}

impl NonlinearSystem for ExactSystem<'_> {
    const DAMPING: Damping = Damping::Persistent;

    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        f.copy_from_slice(&self.dense.residual(x));
    }
    fn measure(&self, f: &[f64]) -> f64 {
        self.dense.measure(f)
    }
    fn linearise(&mut self, x: &[f64]) {
        self.factor = Some(Lu::new(self.dense.jacobian(x)));
    }
    fn correction(&mut self, f: &[f64], _: f64, dx: &mut [f64]) -> Option<f64> {
        exactly_corrected(self.factor.as_ref(), f, dx)
    }
    fn is_late(&self) -> bool {
        self.dense.is_late()
    }
    fn length(&self, dx: &[f64]) -> f64 {
        step_length(self.dense.evaluator.balance, dx)
    }
}

struct DenseBalance<'a> {
    evaluator: Evaluator<'a>,
    /// Norms of the load, as in [`load_scale`].
    scale: [f64; 2],
}

impl<'a> DenseBalance<'a> {
    fn new(balance: &'a Balance, options: NewtonOptions) -> Self {
        Self {
            evaluator: Evaluator::new(balance),
            scale: load_scale(balance, options.tolerance),
        }
    }
}

impl DoglegSystem for DenseBalance<'_> {
    fn residual(&mut self, x: &[f64]) -> Vec<f64> {
        self.evaluator.evaluate(x).residual.clone()
    }
    fn measure(&self, f: &[f64]) -> f64 {
        relative_residual(f, self.evaluator.balance.unknowns_per_block(), self.scale)
    }
    fn is_late(&self) -> bool {
        self.evaluator.balance.deadline.is_over()
    }
    fn scaling(&self, i: usize) -> f64 {
        self.evaluator.balance.eps_at(i)
    }
    fn jacobian(&mut self, x: &[f64]) -> Mat<f64> {
        let balance = self.evaluator.balance;
        let jacobian = balance.linearise(self.evaluator.evaluate(x));
        formed(balance, &jacobian)
    }
}

/// Dense Jacobian J = (I - D)(Lambda - eps) + eps of all pairs.
pub(crate) fn formed(balance: &Balance, jacobian: &Jacobian) -> Mat<f64> {
    let n = balance.unknowns_per_block();
    let width = balance.setting.fourier.width();
    let size = n * width;
    let mut out = Mat::<f64>::zeros(size, size);
    // Lambda - eps.
    let mut stiffness = balance.setting.system.problem.reduced.stiffness.clone();
    if let Some(retention) = balance.retention() {
        retention.add_to_matrix(&mut stiffness);
    }
    for j in 0..n {
        out.col_as_slice_mut(j)[..n].copy_from_slice(stiffness.col_as_slice(j));
    }
    for k in 1..=balance.stiffness.harmonics() {
        let [re, im] = balance.stiffness.formed(k);
        let (c, s) = (cosine(k) * n, sine(k) * n);
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
    for i in 0..size {
        out[(i, i)] -= balance.eps_at(i);
    }
    // (I - D) times that, pair after pair: the rows of a pair that sticks vanish.
    let full = 3 * width;
    let mut derivatives = jacobian.active.iter().zip(&jacobian.derivatives).peekable();
    let (mut rows, mut moved) = (Mat::zeros(full, size), Mat::zeros(full, size));
    for pair in 0..n / 3 {
        let at = |i: usize| (i % width) * n + 3 * pair + i / width;
        let derivative = derivatives.next_if(|(active, _)| **active == pair);
        let Some((_, derivative)) = derivative else {
            for j in 0..size {
                (0..full).for_each(|i| out[(at(i), j)] = 0.0);
            }
            continue;
        };
        for j in 0..size {
            (0..full).for_each(|i| rows[(i, j)] = out[(at(i), j)]);
        }
        matmul(
            moved.as_mut(),
            Accum::Replace,
            MatRef::from_row_major_slice(derivative, full, full),
            rows.as_ref(),
            1.0,
            Par::Seq,
        );
        for j in 0..size {
            (0..full).for_each(|i| out[(at(i), j)] -= moved[(i, j)]);
        }
    }
    for i in 0..size {
        out[(i, i)] += balance.eps_at(i);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{differences, sample_points_of_waves_too};
    use dovetail_testkit::differences::assert_close;

    #[test]
    fn the_dense_jacobian_is_that_by_differences() {
        for (what, balance, u) in &sample_points_of_waves_too() {
            let options = NewtonOptions::new(1e-8, 1);
            let exact = DenseBalance::new(balance, options).jacobian(u);
            assert_close(&exact, &differences(balance, u), 1e-7, what);
        }
    }
}
