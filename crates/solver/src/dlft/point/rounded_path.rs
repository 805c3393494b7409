//! One frequency from the static state by rounded laws ([`crate::dlft::rounded`]), each solution the start of the next
//! sharper one.

use super::{
    FrequencySolver, MOST_DENSE_UNKNOWNS, MOST_EXACT_UNKNOWNS, Method, Solution, Work, resized,
};
use crate::contact::tangential;
use crate::dlft::balance::{Balance, Setting, gather};
use crate::dlft::pair_signals::Rounding;
use crate::dlft::retention::Mean;
use crate::dlft::settings::Solver;
use dovetail_numerics::dense::Lu;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::newton::NewtonOptions;
use dovetail_numerics::vector::norm;
use faer::Mat;
use std::f64::consts::TAU;

/// Sharpness of the friction cones of the first law.
const BLUNTEST: f64 = 2.0;
/// Each law is so many times as sharp as the one before; by the root of this where that is too far, down to the least.
const MOST_GROWTH: f64 = 2.0;
const LEAST_GROWTH: f64 = 1.1;
/// From the first sharpness on the law itself is tried after each, and no sharper one than the second.
const SHARP: f64 = 32.0;
const SHARPEST: f64 = 1024.0;
/// Newton iterations allowed to the first law and to the law itself, and to those between: one that needs more is too far.
const END_ITERATIONS: usize = 45;
const STEP_ITERATIONS: usize = 25;
/// What balances are solved to: below [`SHARP`], from there on, and with the law itself.
const BLUNT_TOLERANCE: f64 = 1e-2;
const SHARP_TOLERANCE: f64 = 1e-3;
const LAW_TOLERANCE: f64 = 1e-4;
/// Bodies slide as a whole where without friction the pairs move more times than this as far as friction deforms them by
/// eps. What is their elasticity makes of every reversal of friction a step that Newton's method does not find, and the
/// motion hardly depends on it: eps is lowered on the way until it is no more than so many times, ...
const GROSS_SLIP: f64 = 1e5;
/// ... but not further than to this fraction. Where the first law is not found, and the pairs move more than so many times
/// as far, eps is lowered to it at once.
const SOFTEST: f64 = 1e-2;
const SLIP: f64 = 1e2;

/// The way to a motion: the balance that is solved next, and the solution of the last that was.
struct Path<'a, 'b> {
    solver: &'b FrequencySolver<'a>,
    frequency_hz: f64,
    mean: Mean,
    harmonics: usize,
    /// Of the friction cones; `None`: the law itself.
    sharpness: Option<f64>,
    /// As in [`Balance`].
    eps_scale: f64,
    /// Where the first law is not found, eps_scale becomes this.
    softest: f64,
    method: Method,
    u: Vec<f64>,
}

impl FrequencySolver<'_> {
    /// The motion at the end of the path; `None` where there is nothing to retain and the mean is to be retained, or
    /// where the frequency has taken what it may on the way.
    ///
    /// The rounded laws have as many harmonics as exact corrections are cheap for, the law itself more and more.
    pub(super) fn with_rounded_laws(
        &self,
        frequency_hz: f64,
        mean: Mean,
        work: &mut Work,
    ) -> Option<Solution<'_>> {
        let balance = self.balance(frequency_hz, mean)?;
        let n = self.setting.system.unknowns();
        let cheap = (MOST_EXACT_UNKNOWNS / n).saturating_sub(1) / 2;
        let harmonics = cheap.max(1).min(self.setting.fourier.harmonics());
        let is_exact =
            self.solver == Solver::NewtonKrylov && (2 * harmonics + 1) * n <= MOST_DENSE_UNKNOWNS;
        let (method, slides_past) = match is_exact {
            true => (Method::Exact, self.slides_past(frequency_hz)),
            false => (self.stepping(), 0.0),
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
        };
        path.sharpen(work);
        path.stiffen(work);
        path.refine(work);
        let u = path.u;
        (!self.budget_exhausted(work))
            .then(|| self.iterate(balance, u, self.stepping(), self.newton, work))
    }

    /// Whether bodies slide as a whole, as far as is affordable to know.
    pub(super) fn is_in_gross_slip(&self, frequency_hz: f64) -> bool {
        let is_affordable = 3 * self.setting.system.unknowns() <= MOST_DENSE_UNKNOWNS;
        is_affordable && self.slides_past(frequency_hz) > GROSS_SLIP
    }

    /// The motion of the pairs along the contact, the largest of them, without friction and without lift-off, over their
    /// mean elastic displacement under friction, mu N / eps. 0 where there is no friction.
    fn slides_past(&self, frequency_hz: f64) -> f64 {
        let setting = &self.setting;
        let pairs = &setting.system.model.pairs;
        let count = pairs.len() as f64;
        let friction = pairs.iter().map(|p| p.computed_friction()).sum::<f64>() / count;
        let limit_n = friction * setting.pressing_n / count;
        if limit_n <= 0.0 {
            return 0.0;
        }
        let balance = Balance::new(setting, TAU * frequency_hz);
        let x = without_friction(&balance);
        let moved_n = (0..pairs.len()).map(|pair| {
            let width = setting.fourier.width();
            let own = gather(&x, balance.unknowns_per_block(), pair, width);
            balance.eps_at(3 * pair + 1) * norm(&own)
        });
        moved_n.fold(0.0, f64::max) / limit_n
    }
}

impl Path<'_, '_> {
    /// Rounded laws, sharper and sharper, and the law itself.
    fn sharpen(&mut self, work: &mut Work) {
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

    /// The law with eps as it is, at once or in steps.
    fn stiffen(&mut self, work: &mut Work) {
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

    /// The law with more and more harmonics, up to where the next are all.
    fn refine(&mut self, work: &mut Work) {
        while self.harmonics < self.solver.setting.fourier.harmonics() {
            self.solve(work);
            self.harmonics = 2 * self.harmonics + 1;
        }
    }

    /// Goes on to the solution of the balance, or stays where it is not found, or where the frequency has taken what it
    /// may.
    fn solve(&mut self, work: &mut Work) -> bool {
        if self.solver.budget_exhausted(work) {
            return false;
        }
        let setting = &self.solver.setting;
        let fourier = Fourier::new(self.harmonics, setting.fourier.samples());
        let fewer = FrequencySolver {
            setting: Setting {
                fourier: &fourier,
                ..*setting
            },
            ..*self.solver
        };
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
        let options = NewtonOptions {
            tolerance: tolerance.max(newton.tolerance),
            max_iterations: most_iterations.min(newton.max_iterations),
        };
        let start = resized(&self.u, fewer.unknowns());
        let solved = fewer.iterate(balance, start, self.method, options, work);
        if solved.is_converged() {
            self.u = resized(&solved.u, self.solver.unknowns());
        }
        solved.is_converged()
    }
}

/// The vibration where nothing rubs and nothing lifts off, as U: Lambda_TT X_T = F_T of the harmonics that are excited.
fn without_friction(balance: &Balance<'_>) -> Vec<f64> {
    let n = balance.unknowns_per_block();
    let along = tangential(n);
    let count = along.len();
    let mut out = vec![0.0; balance.force.len()];
    for k in 1..=balance.stiffness.harmonics() {
        let of = |i: usize| match i < count {
            true => (2 * k - 1) * n + along[i],
            false => 2 * k * n + along[i - count],
        };
        let mut x: Vec<f64> = (0..2 * count).map(|i| balance.force[of(i)]).collect();
        if norm(&x) == 0.0 {
            continue;
        }
        let [re, im] = balance.stiffness.formed(k);
        let matrix = Mat::from_fn(2 * count, 2 * count, |i, j| {
            let at = (along[i % count], along[j % count]);
            match (i < count, j < count) {
                (true, true) | (false, false) => re[at],
                (true, false) => im[at],
                (false, true) => -im[at],
            }
        });
        Lu::new(matrix).solve_column_in_place(&mut x);
        x.iter().enumerate().for_each(|(i, x)| out[of(i)] = *x);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::at_sample_points;

    #[test]
    fn without_friction_nothing_acts_along_the_contact_and_nothing_lifts_off() {
        at_sample_points(|_, balance, _| {
            let x = without_friction(balance);
            let n = balance.unknowns_per_block();
            let mut forces = vec![0.0; x.len()];
            balance.apply_stiffness(&x, &mut forces);
            let mut moves = false;
            for i in n..x.len() {
                if i % n % 3 == 0 {
                    assert_eq!(x[i], 0.0);
                } else {
                    let load = balance.force[i];
                    assert!(
                        (forces[i] - load).abs() < 1e-9 * norm(&balance.force),
                        "{i}"
                    );
                    moves |= x[i] != 0.0;
                }
            }
            assert!(moves);
        });
    }
}
