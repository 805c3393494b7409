//! Solution of one frequency from the static state by rounded laws ([`crate::dlft::rounded`]); each
//! solution is the start of the next sharper one.

use super::{FrequencySolver, MOST_EXACT_UNKNOWNS, Method, Solution, SolverWork, resized};
use crate::dlft::dense::MOST_DENSE_UNKNOWNS;
use crate::dlft::gross_slip::{GROSS_SLIP, free_slips_m, slides_past};
use crate::dlft::pair_signals::Rounding;
use crate::dlft::retention::Mean;
use crate::dlft::settings::Solver;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::spectrum::blocks;
use std::f64::consts::TAU;

/// Sharpness of the friction cones of the first law.
const BLUNTEST: f64 = 2.0;
/// Each law is sharper than the one before by this factor, or by its roots, down to the least,
/// where that is too far.
const MOST_GROWTH: f64 = 2.0;
const LEAST_GROWTH: f64 = 1.1;
/// Sharpness from which on the law itself is tried after each solution, and the largest sharpness.
const SHARP: f64 = 32.0;
const SHARPEST: f64 = 1024.0;
/// Newton iterations allowed to the first law and to the law itself, and to the laws between. A law
/// that needs more is too far.
const END_ITERATIONS: usize = 45;
const STEP_ITERATIONS: usize = 25;
/// Newton iterations of a whole path. Most paths that lead to a motion take 60 to 180, and those that
/// do not end only here.
const MOST_PATH_ITERATIONS: usize = 200;
/// Tolerances of the balances: below [`SHARP`], from there on, and with the law itself.
const BLUNT_TOLERANCE: f64 = 1e-2;
const SHARP_TOLERANCE: f64 = 1e-3;
const LAW_TOLERANCE: f64 = 1e-4;
/// Least eps_scale. eps is lowered on the way until bodies no longer slide as a whole
/// ([`crate::dlft::gross_slip`]), but to no less than this fraction. It is lowered to this at once
/// where the first law is not found and pairs slide more than `SLIP` times as far as friction
/// deforms them.
const SOFTEST: f64 = 1e-2;
const SLIP: f64 = 1e2;

/// Path to a motion: the balance that is solved next, and the last solution.
struct Path<'a> {
    solver: &'a FrequencySolver<'a>,
    frequency_hz: f64,
    mean: Mean,
    harmonics: usize,
    /// Sharpness of the friction cones; `None` for the law itself.
    sharpness: Option<f64>,
    /// Scale of eps, as in [`Balance`].
    eps_scale: f64,
    /// Value that eps_scale takes where the first law is not found.
    softest: f64,
    method: Method,
    u: Vec<f64>,
    /// Newton iterations of the frequency at which the path ends.
    last_iteration: usize,
}

impl FrequencySolver<'_> {
    /// Motion at the end of the path. `None` where the mean is to be retained and there is nothing to
    /// retain, or where the budget of the path or of the frequency is used up on the way.
    ///
    /// The rounded laws have as many harmonics as exact corrections are cheap for; the law itself
    /// is then solved with more and more.
    pub(super) fn follow_rounded_laws(
        &self,
        frequency_hz: f64,
        mean: Mean,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let balance = self.balance(frequency_hz, mean)?;
        let n = self.setting.system.unknowns();
        let cheap = (MOST_EXACT_UNKNOWNS / n).saturating_sub(1) / 2;
        let harmonics = cheap.max(1).min(self.setting.fourier.harmonics());
        let is_exact =
            self.solver == Solver::NewtonKrylov && blocks(harmonics) * n <= MOST_DENSE_UNKNOWNS;
        let (method, slides_past) = if is_exact {
            let slips_m = free_slips_m(&self.setting, TAU * frequency_hz);
            (Method::Exact, slides_past(&self.setting, &slips_m))
        } else {
            (self.stepping(), 0.0)
        };
        let mut path = Path {
            solver: self,
            frequency_hz,
            mean,
            harmonics,
            sharpness: Some(BLUNTEST),
            eps_scale: (GROSS_SLIP / slides_past).clamp(SOFTEST, 1.0),
            softest: if slides_past > SLIP { SOFTEST } else { 1.0 },
            method,
            u: self.static_start(),
            last_iteration: work.newton_iterations + MOST_PATH_ITERATIONS,
        };
        path.sharpen(work);
        path.stiffen(work);
        path.refine(work);
        let is_over = path.is_over(work);
        let u = path.u;
        (!is_over).then(|| self.iterate(balance, u, self.stepping(), self.newton, work))
    }
}

impl Path<'_> {
    /// Solves rounded laws, sharper and sharper, and the law itself.
    fn sharpen(&mut self, work: &mut SolverWork) {
        if !self.solve(work) && self.softest < self.eps_scale {
            self.eps_scale = self.softest;
            self.solve(work);
        }
        let (mut reached, mut growth) = (BLUNTEST, MOST_GROWTH);
        while growth >= LEAST_GROWTH {
            self.sharpness = Some(reached * growth);
            if !self.solve(work) {
                growth = growth.sqrt();
                continue;
            }
            reached *= growth;
            growth = (growth * growth).min(MOST_GROWTH);
            if reached >= SHARP {
                self.sharpness = None;
                if self.solve(work) || reached >= SHARPEST {
                    break;
                }
            }
        }
        self.sharpness = None;
    }

    /// Solves the law with eps raised to its full value, at once or in steps.
    fn stiffen(&mut self, work: &mut SolverWork) {
        self.method = self.solver.stepping();
        let mut reached = self.eps_scale;
        let mut growth = 1.0 / reached;
        while reached < 1.0 && growth >= LEAST_GROWTH {
            self.eps_scale = (reached * growth).min(1.0);
            if self.solve(work) {
                reached = self.eps_scale;
                growth = 1.0 / reached;
            } else {
                growth = growth.sqrt();
            }
        }
        self.eps_scale = 1.0;
    }

    /// Solves the law with more and more harmonics, up to the last number below all.
    fn refine(&mut self, work: &mut SolverWork) {
        while self.harmonics < self.solver.setting.fourier.harmonics() {
            self.solve(work);
            self.harmonics = 2 * self.harmonics + 1;
        }
    }

    /// Returns `true` if the budget of the path or of the frequency is used up.
    fn is_over(&self, work: &SolverWork) -> bool {
        work.newton_iterations >= self.last_iteration || self.solver.budget_exhausted(work)
    }

    /// Solves the balance and moves to its solution; stays where none is found or the budget is used
    /// up. Returns `true` if it is found.
    fn solve(&mut self, work: &mut SolverWork) -> bool {
        if self.is_over(work) {
            return false;
        }
        let setting = &self.solver.setting;
        let fourier = Fourier::new(self.harmonics, setting.fourier.samples());
        let fewer = self.solver.with_resolution(&fourier.into(), &setting.eps);
        let Some(mut balance) = fewer.balance(self.frequency_hz, self.mean) else {
            return false;
        };
        let compression_n = setting.pressing_n / (setting.system.unknowns() / 3) as f64;
        balance.eps_scale = self.eps_scale;
        balance.rounding = self.sharpness.map(|sharpness| Rounding {
            sharpness,
            width_n: BLUNTEST / sharpness * compression_n,
        });
        let tolerance = match self.sharpness {
            Some(sharpness) if sharpness < SHARP => BLUNT_TOLERANCE,
            Some(_) => SHARP_TOLERANCE,
            None => LAW_TOLERANCE,
        };
        let most_iterations = match self.sharpness {
            Some(sharpness) if sharpness > BLUNTEST => STEP_ITERATIONS,
            _ => END_ITERATIONS,
        };
        let newton = self.solver.newton;
        let options = NewtonOptions::new(
            tolerance.max(newton.tolerance),
            most_iterations.min(newton.max_iterations),
        );
        let start = resized(&self.u, fewer.unknowns());
        let solved = fewer.iterate(balance, start, self.method, options, work);
        if solved.is_converged() {
            self.u = resized(&solved.u, self.solver.unknowns());
        }
        solved.is_converged()
    }
}
