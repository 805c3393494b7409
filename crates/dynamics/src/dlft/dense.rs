//! Solution of one frequency with its Jacobian formed and factored, for few unknowns: Newton's
//! method with exact corrections, and Powell's hybrid method, the paper's solver.
//!
//! M. J. D. Powell, A hybrid method for nonlinear equations, 1970; its region is scaled by eps, so
//! that steps are measured in forces.

use super::balance::{Balance, Evaluation, Evaluator};
use super::border::{Border, Equations};
use super::factored::{FactoredJacobian, formed};
use super::measure::{load_scale, relative_residual, step_length};
use dovetail_numerics::nonlinear::{
    Damping, DoglegSystem, NewtonEnd, NewtonOptions, NonlinearSystem, correction, dogleg, newton,
};
use faer::Mat;

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
pub(crate) fn exactly_corrected(
    balance: &Balance,
    factor: Option<&FactoredJacobian>,
    border: Option<&Border>,
    f: &[f64],
    dx: &mut [f64],
) -> Option<f64> {
    let right: Vec<f64> = f.iter().map(|f| -f).collect();
    let equations = Equations {
        border,
        right: &right,
    };
    factor?.solve(balance, equations, dx).map(|()| 0.0)
}

struct ExactSystem<'a> {
    dense: DenseBalance<'a>,
    /// Factor of the Jacobian at the last linearisation.
    factor: Option<FactoredJacobian>,
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
        let balance = self.dense.evaluator.balance;
        let jacobian = balance.linearise(self.dense.evaluator.evaluate(x));
        self.factor = Some(FactoredJacobian::new(balance, jacobian, None));
    }
    fn correction(&mut self, f: &[f64], _: f64, dx: &mut [f64]) -> Option<f64> {
        let balance = self.dense.evaluator.balance;
        exactly_corrected(balance, self.factor.as_ref(), None, f, dx)
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
        let pairs: Vec<usize> = (0..balance.unknowns_per_block() / 3).collect();
        formed(balance, &jacobian, &pairs)
    }
}
