//! Solution of one frequency by rounded laws ([`crate::dlft::rounded`]), from the neighbour or from the
//! static state; each solution is the start of the next sharper one.

use super::{
    FrequencySolver, MOST_EXACT_UNKNOWNS, Method, Neighbour, Solution, SolverWork, resized,
};
use crate::dlft::dense::MOST_DENSE_UNKNOWNS;
use crate::dlft::gross_slip::{GROSS_SLIP, free_slips_m, slides_past};
use crate::dlft::homotopy::{Homotopy, MOST_WAY_ITERATIONS};
use crate::dlft::pair_signals::Rounding;
use crate::dlft::retention::Mean;
use crate::dlft::settings::Solver;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::spectrum::blocks;
use std::f64::consts::TAU;

/// Sharpness of the friction cones of the first law from the static state, and from a neighbour.
const BLUNTEST: f64 = 2.0;
const FIRST_BESIDE_A_NEIGHBOUR: f64 = 4.0;
/// Largest and least factor from the sharpness of a law to that of the next, and from one eps_scale to
/// the next.
const MOST_GROWTH: f64 = 2.0;
const LEAST_GROWTH: f64 = 1.1;
/// Sharpness from which on the law itself is tried after each solution, and the largest sharpness.
const SHARP: f64 = 32.0;
const SHARPEST: f64 = 1024.0;
/// Newton iterations allowed to the first law and to the law itself, and to the laws between. A law
/// that needs more is too far.
const END_ITERATIONS: usize = 45;
const STEP_ITERATIONS: usize = 25;
/// Newton iterations of a whole path from a neighbour: one that needs more begins too far away.
const MOST_ITERATIONS_BESIDE_A_NEIGHBOUR: usize = 60;
/// Tolerances of the balances: below [`SHARP`], from there on, and with the law itself.
const BLUNT_TOLERANCE: f64 = 1e-2;
const SHARP_TOLERANCE: f64 = 1e-3;
const LAW_TOLERANCE: f64 = 1e-4;
/// Least eps_scale. eps is lowered on the way as long as bodies slide as a whole
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
    /// Motion at the end of the path from the neighbour, or of that from the static state. `None` where
    /// the mean is to be retained and there is nothing to retain, or where the budget of the path or of
    /// the frequency is used up on the way.
    pub(super) fn follow_rounded_laws(
        &self,
        frequency_hz: f64,
        mean: Mean,
        last: Option<&Neighbour>,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let law = |path: Path<'_>, work: &mut SolverWork| {
            let balance = self.balance(frequency_hz, mean)?;
            let is_over = path.is_over(work);
            (!is_over).then(|| self.iterate(balance, path.u, self.stepping(), self.newton, work))
        };
        if let Some(last) = last {
            let near = self.path_from_neighbour(frequency_hz, mean, last, work);
            let solved = near.and_then(|path| law(path, work));
            if let Some(solved) = solved.filter(Solution::is_converged) {
                return Some(solved);
            }
        }
        let path = self.path_from_static_state(frequency_hz, mean, work);
        law(path, work)
    }

    /// Path with all harmonics from the neighbour to the law itself; `None` where the first law is not
    /// found.
    fn path_from_neighbour(
        &self,
        frequency_hz: f64,
        mean: Mean,
        last: &Neighbour,
        work: &mut SolverWork,
    ) -> Option<Path<'_>> {
        let mut path = Path {
            solver: self,
            frequency_hz,
            mean,
            harmonics: self.setting.fourier.harmonics(),
            sharpness: Some(FIRST_BESIDE_A_NEIGHBOUR),
            eps_scale: 1.0,
            softest: 1.0,
            method: self.stepping(),
            u: last.starts(frequency_hz, self.unknowns()).pop()?,
            last_iteration: work.newton_iterations + MOST_ITERATIONS_BESIDE_A_NEIGHBOUR,
        };
        path.solve(work).then(|| {
            path.sharpen(FIRST_BESIDE_A_NEIGHBOUR, work);
            path
        })
    }

    /// Path from the static state. The rounded laws have as many harmonics as exact corrections are
    /// cheap for; the law itself is then solved with more and more.
    fn path_from_static_state(
        &self,
        frequency_hz: f64,
        mean: Mean,
        work: &mut SolverWork,
    ) -> Path<'_> {
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
            last_iteration: work.newton_iterations + MOST_WAY_ITERATIONS,
        };
        if !path.solve(work) && path.softest < path.eps_scale {
            path.eps_scale = path.softest;
            path.solve(work);
        }
        path.sharpen(BLUNTEST, work);
        path.stiffen(work);
        path.refine(work);
        path
    }
}

impl Path<'_> {
    /// Solves laws sharper and sharper than the first, and the law itself.
    fn sharpen(&mut self, first: f64, work: &mut SolverWork) {
        let [from, to, largest, least] =
            [first, SHARPEST, MOST_GROWTH, LEAST_GROWTH].map(f64::log2);
        let mut steps = Homotopy::new(from, to, largest, least);
        while let Some(next) = steps.next() {
            let sharpness = next.exp2();
            self.sharpness = Some(sharpness);
            let is_solved = self.solve(work);
            steps.record(is_solved);
            self.sharpness = None;
            if is_solved && sharpness >= SHARP && self.solve(work) {
                break;
            }
        }
        self.sharpness = None;
    }

    /// Solves the law with eps raised to its full value, at once or in steps.
    fn stiffen(&mut self, work: &mut SolverWork) {
        self.method = self.solver.stepping();
        let from = self.eps_scale.ln();
        let mut steps = Homotopy::new(from, 0.0, -from, LEAST_GROWTH.ln());
        while let Some(next) = steps.next() {
            self.eps_scale = next.exp();
            steps.record(self.solve(work));
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
