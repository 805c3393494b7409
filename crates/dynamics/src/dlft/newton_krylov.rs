//! Newton-GMRES for the harmonic balance: linear solves on the pairs that take part
//! (`dlft/linear_system.rs`), and by a factor of the Jacobian where GMRES finds no solution and the
//! unknowns are few.

use std::cell::OnceCell;
use std::sync::Arc;

use super::balance::{Balance, Evaluator, Jacobian};
use super::border::{Equations, put_back, remaining_right_side, restrict};
use super::coarse::Coarse;
use super::factored::FactoredJacobian;
use super::linear_system::{LinearSystem, PairDerivatives};
use super::measure::{load_scale, relative_residual, step_length};
use super::two_level;
use crate::problem::inexact::Inexact;
use dovetail_numerics::krylov::{GmresEnd, RefreshPolicy};
use dovetail_numerics::nonlinear::{LinearTolerances, NonlinearSystem};

/// Usual relative residual of a linear solve.
pub(crate) const KRYLOV_TOLERANCE: f64 = 1e-2;
/// Largest relative residual of a linear solve, far from the solution.
const LOOSEST_KRYLOV_TOLERANCE: f64 = 0.1;
const MOST_KRYLOV_ITERATIONS: usize = 300;
/// Most unknowns for which the Jacobian is factored where GMRES finds no solution, and iterations after
/// which it is: the factor of so many takes as long as these.
const MOST_FACTORED_UNKNOWNS: usize = 1200;
const ITERATIONS_BESIDE_A_FACTOR: usize = 100;
/// Smallest damping factor of Newton's method at one frequency. Each one that is tried costs a linear
/// solve, and where only a shorter step helps, another start or strategy takes less.
const SMALLEST_STEP: f64 = 1.0 / 64.0;
/// Stuck modes below this multiple of the highest harmonic's frequency enter the linear solves.
const MODES_BELOW: f64 = 6.0;

/// Data of the linear solves that are kept over Newton steps and over neighbouring frequencies.
#[derive(Default)]
pub struct Preconditioner {
    inexact: Option<Arc<Inexact>>,
    /// Coarse problem of those pairs.
    coarse: Option<Coarse>,
    /// Stiffness of the retention where `coarse` was made, N/m; zero without one.
    retention_n_m: f64,
    width: usize,
    refresh: RefreshPolicy,
    /// True once GMRES found no solution with so many blocks.
    has_failed: bool,
}

/// Jacobian at one point, for linear solves.
pub(crate) struct Linearised {
    system: LinearSystem,
    /// The whole Jacobian, where its unknowns are few.
    jacobian: Option<Jacobian>,
    /// Its factor with the border of the first solve, once it was needed.
    factor: OnceCell<FactoredJacobian>,
}

impl Linearised {
    /// Solves the system, with its border, by the factor. `None` if the unknowns are many, or the
    /// Jacobian is singular.
    fn solve_exactly(
        &self,
        balance: &Balance,
        equations: Equations<'_>,
        x: &mut [f64],
    ) -> Option<()> {
        let jacobian = self.jacobian.as_ref()?;
        let factored = || FactoredJacobian::new(balance, jacobian.clone(), equations.border);
        (self.factor.get_or_init(factored)).solve(balance, equations, x)
    }
}

/// One frequency as a nonlinear system.
pub struct KrylovSystem<'a> {
    /// Residual and Jacobian.
    pub(crate) evaluator: Evaluator<'a>,
    preconditioner: &'a mut Preconditioner,
    /// |F|, and the norm of its harmonic part.
    scale: [f64; 2],
    linear: Option<Linearised>,
    krylov_tolerance: f64,
    /// Returns `true` if the mean of U lies where no solution is looked for.
    walked_off: &'a dyn Fn(&[f64]) -> bool,
    /// Number of iterations of all linear solves.
    pub krylov_iterations: usize,
}

impl<'a> KrylovSystem<'a> {
    /// System of one balance.
    pub fn new(
        balance: &'a Balance,
        preconditioner: &'a mut Preconditioner,
        krylov_tolerance: f64,
        tolerance: f64,
        walked_off: &'a dyn Fn(&[f64]) -> bool,
    ) -> Self {
        Self {
            scale: load_scale(balance, tolerance),
            evaluator: Evaluator::new(balance),
            preconditioner,
            linear: None,
            krylov_tolerance,
            walked_off,
            krylov_iterations: 0,
        }
    }
}

impl NonlinearSystem for KrylovSystem<'_> {
    fn residual(&mut self, x: &[f64], f: &mut [f64]) {
        f.copy_from_slice(&self.evaluator.evaluate(x).residual);
    }

    fn measure(&self, f: &[f64]) -> f64 {
        relative_residual(f, self.evaluator.balance.unknowns_per_block(), self.scale)
    }

    fn linearise(&mut self, x: &[f64]) {
        let balance = self.evaluator.balance;
        let jacobian = balance.linearise(self.evaluator.evaluate(x));
        self.linear = Some(self.preconditioner.linear_system(balance, jacobian));
    }

    fn linear_tolerances(&self) -> Option<LinearTolerances> {
        Some(krylov_tolerances(self.krylov_tolerance))
    }

    fn correction(&mut self, f: &[f64], tolerance: f64, dx: &mut [f64]) -> Option<f64> {
        let linear = self.linear.as_ref()?;
        let right: Vec<f64> = f.iter().map(|f| -f).collect();
        let balance = self.evaluator.balance;
        let kept = &mut *self.preconditioner;
        let equations = Equations {
            border: None,
            right: &right,
        };
        let end = kept.solve(balance, linear, equations, (self.scale, tolerance), dx);
        self.krylov_iterations += end.iterations;
        // A direction that is not exact is still useful: the step is judged afterwards.
        dx.iter()
            .all(|d| d.is_finite())
            .then_some(end.relative_residual)
    }

    fn has_diverged(&self, x: &[f64]) -> bool {
        (self.walked_off)(x)
    }

    fn is_late(&self) -> bool {
        self.evaluator.balance.deadline.is_over()
    }

    fn length(&self, dx: &[f64]) -> f64 {
        step_length(self.evaluator.balance, dx)
    }

    fn smallest_step(&self) -> f64 {
        SMALLEST_STEP
    }
}

/// Tolerances of the linear solves, of which this is the usual one.
pub(crate) fn krylov_tolerances(usual: f64) -> LinearTolerances {
    LinearTolerances {
        usual,
        loosest: LOOSEST_KRYLOV_TOLERANCE.max(usual),
    }
}

impl Preconditioner {
    /// Linear system on the pairs that take part, with a coarse problem that serves it.
    pub(crate) fn linear_system(&mut self, balance: &Balance, jacobian: Jacobian) -> Linearised {
        let problem = &balance.setting.inexact;
        let inexact = problem.taking_part(&jacobian.active, self.inexact.as_ref());
        let columns = inexact.columns();
        let linear = LinearSystem {
            harmonics: balance.stiffness.coefficients(MODES_BELOW),
            derivatives: single_precision_derivatives(
                &jacobian,
                &inexact.pairs,
                balance.setting.fourier.width(),
            ),
            retention: balance.retention().map(|r| r.restricted(&columns)),
            eps: columns.iter().map(|&c| balance.eps_at(c) as f32).collect(),
            inexact,
        };
        self.serve(&linear, balance.setting.system.problem.highest_excited());
        let unknowns = balance.unknowns_per_block() * linear.width();
        Linearised {
            system: linear,
            jacobian: (unknowns <= MOST_FACTORED_UNKNOWNS).then_some(jacobian),
            factor: OnceCell::new(),
        }
    }

    /// Solves equations, whose right side is relative to `scale`, to the relative residual
    /// `tolerance`. All equations of one linearisation have the same border.
    pub(crate) fn solve(
        &mut self,
        balance: &Balance,
        linear: &Linearised,
        equations: Equations<'_>,
        (scale, tolerance): ([f64; 2], f64),
        x: &mut [f64],
    ) -> GmresEnd {
        if self.has_failed && linear.solve_exactly(balance, equations, x).is_some() {
            return GmresEnd::SOLVED;
        }
        let most = match linear.jacobian {
            Some(_) => ITERATIONS_BESIDE_A_FACTOR,
            None => MOST_KRYLOV_ITERATIONS,
        };
        let system = &linear.system;
        let end = self.solve_by_gmres(balance, system, equations, (scale, tolerance), most, x);
        if end.converged || end.iterations < most {
            return end;
        }
        let mut exact = vec![0.0; x.len()];
        if (linear.solve_exactly(balance, equations, &mut exact)).is_none() {
            return end;
        }
        x.copy_from_slice(&exact);
        self.has_failed = true;
        GmresEnd::solved_after(end.iterations)
    }

    fn solve_by_gmres(
        &mut self,
        balance: &Balance,
        linear: &LinearSystem,
        equations: Equations<'_>,
        (scale, tolerance): ([f64; 2], f64),
        most_iterations: usize,
        x: &mut [f64],
    ) -> GmresEnd {
        let n = balance.unknowns_per_block();
        let unknowns = n * balance.setting.fourier.width();
        let columns = linear.inexact.columns();
        let unbalanced = |forces: &[f64]| linear.unbalanced_part(&restrict(forces, n, &columns));
        let rhs = remaining_right_side(balance, &columns, equations, x, unbalanced);
        let border = equations
            .border
            .map(|border| border.restricted(n, &columns));
        if columns.is_empty() {
            if let Some(border) = border {
                x[unknowns..].copy_from_slice(&border.further_unknowns(&rhs));
            }
            return GmresEnd::SOLVED;
        }
        let (solution, end) = two_level::solve(
            linear,
            self.coarse.as_ref(),
            border.as_ref(),
            &rhs,
            scale[0] / scale[1],
            tolerance,
            most_iterations,
        );
        self.refresh.record(end.iterations);
        let (own, further) = solution.split_at(unknowns / n * columns.len());
        put_back(own, n, &columns, x);
        x[unknowns..].copy_from_slice(further);
        end
    }

    /// Makes a new coarse problem where the old one belongs to other pairs, or is worn.
    fn serve(&mut self, linear: &LinearSystem, highest_excited: usize) {
        let same_pairs = self
            .inexact
            .as_ref()
            .is_some_and(|old| Arc::ptr_eq(old, &linear.inexact));
        let retention = linear.retention.as_ref();
        let retention_n_m = retention.map_or(0.0, |r| r.stiffness_n_m());
        let same =
            same_pairs && self.retention_n_m == retention_n_m && self.width == linear.width();
        if same && !self.refresh.is_due() {
            return;
        }
        let has_failed = self.has_failed && self.width == linear.width();
        *self = Self {
            inexact: Some(Arc::clone(&linear.inexact)),
            coarse: Coarse::new(linear, highest_excited),
            retention_n_m,
            width: linear.width(),
            refresh: RefreshPolicy::default(),
            has_failed,
        };
    }
}

/// D of `pairs` in single precision; the identity for those not active, which stick.
fn single_precision_derivatives(
    jacobian: &Jacobian,
    pairs: &[usize],
    width: usize,
) -> PairDerivatives {
    let full = 3 * width;
    let mut derivatives = PairDerivatives::new(width, jacobian.active.len());
    let mut active = jacobian.active.iter().zip(&jacobian.derivatives).peekable();
    for pair in pairs {
        match active.next_if(|(p, _)| *p == pair) {
            Some((_, derivative)) => derivatives.push(|i, j| derivative[i * full + j] as f32),
            None => derivatives.push_identity(),
        }
    }
    derivatives
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::border::Border;
    use crate::dlft::jacobians::sample_points_of_waves_too;

    /// The factor answers where GMRES is not asked any more, with a border and without one.
    #[test]
    fn the_factor_solves_the_system_that_gmres_solves() {
        for (what, balance, u) in &sample_points_of_waves_too() {
            let n = balance.unknowns_per_block();
            let scale = load_scale(balance, 1e-9);
            let wave = |factor: f64, count: usize| -> Vec<f64> {
                (0..count).map(|i| (factor * i as f64).cos()).collect()
            };
            // As for a curve: pairs that stick have no column, and rows are forces.
            let jacobian = balance.linearise(&balance.evaluate(u));
            let row = wave(0.7, u.len()).into_iter().enumerate();
            let border = Border {
                columns: vec![jacobian.unbalanced_part(&wave(1.3, u.len()), n)],
                rows: vec![row.map(|(i, r)| balance.eps_at(i) * r).collect()],
                corner: vec![vec![1.0]],
            };
            for border in [None, Some(&border)] {
                let right = wave(
                    0.4,
                    u.len() + border.map_or(0, |border| border.columns.len()),
                );
                let mut solved = |has_failed: bool| {
                    let mut kept = Preconditioner::default();
                    let jacobian = balance.linearise(&balance.evaluate(u));
                    let linear = kept.linear_system(balance, jacobian);
                    kept.has_failed = has_failed;
                    let mut x = vec![0.0; right.len()];
                    let equations = Equations {
                        border,
                        right: &right,
                    };
                    let end = kept.solve(balance, &linear, equations, (scale, 1e-5), &mut x);
                    assert!(
                        end.converged && (end.iterations == 0) == has_failed,
                        "{what}"
                    );
                    x
                };
                let [by_gmres, by_factor] = [false, true].map(&mut solved);
                let apart: Vec<f64> = by_gmres
                    .iter()
                    .zip(&by_factor)
                    .map(|(a, b)| a - b)
                    .collect();
                let off = step_length(balance, &apart[..n]) / step_length(balance, &by_factor[..n]);
                assert!(off < 1e-3, "{what}, {} unknowns: {off:e}", right.len());
            }
        }
    }
}
