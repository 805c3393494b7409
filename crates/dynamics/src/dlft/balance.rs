//! Harmonic balance of one frequency: f(U) = Lambda U + lambda(U) - F and its exact Jacobian
//! J = (I - D) Lambda + D eps, D = d lambda / d lambda_u, block diagonal by pair.
//!
//! A rigid pair that sticks at every sample has D = I: its rows of J are eps I, its correction is
//! known at once, and only the other ("active") pairs enter the linear solve.

use super::aft::{
    PLAIN_PERIODS, PairEnd, contact_force_derivative, contact_forces, contact_forces_near,
    last_period,
};
use super::frozen::FrozenContacts;
use super::pair_signals::{PairInput, Periods, Rounding, Signals};
use super::retention::{Mean, Retention};
use super::{PairStatus, StaticState};
use crate::contact::{PairState, PredictedLaw};
use crate::problem::dynamic_stiffness::{ContactSystem, HarmonicStiffness};
use crate::problem::inexact::InexactModel;
use crate::problem::unforced::Unforced;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::spectrum::{blocks, cosine, sine};
use dovetail_numerics::vector::dot;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, c64};
use rayon::prelude::*;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Settings and data that are the same at all frequencies of a sweep. Clones share the data.
#[derive(Clone)]
pub struct Setting {
    /// Reduced model with its damping.
    pub system: Arc<ContactSystem>,
    /// Reduced model in the form that the inner linear solves use.
    pub inexact: Arc<InexactModel>,
    /// Harmonics and samples.
    pub fourier: Arc<Fourier>,
    /// eps per unknown of a block, N/m, n: one value for N, one for both T of a pair.
    pub eps: Arc<[f64]>,
    /// Static relative displacement, m, n, where the time evaluation of a pair starts.
    pub x_static: Arc<[f64]>,
    /// Contact forces in the static state, N, n.
    pub lambda_static: Arc<[f64]>,
    /// Status of each pair in the static state.
    pub at_rest: Arc<[PairStatus]>,
    /// Treatment of the mean of the static state along the motions that only friction holds. Where
    /// it is retained, so is the mean of every motion about that state.
    pub static_mean: Mean,
    /// Sum of the pairs' compression in the static state, N.
    pub pressing_n: f64,
    /// Periods that a pair is marched through.
    pub periods: Periods,
    /// A pair that slides less than this in a period sticks, m.
    pub slip_threshold_m: f64,
    /// Distance that each pair slides at the middle of the curve where nothing rubs, m; empty where
    /// it is not known.
    pub free_slips_m: Arc<[f64]>,
    /// Vibration in which the pairs do what they do in the static state.
    pub(crate) frozen: Arc<FrozenContacts>,
}

impl Setting {
    /// Setting about a static state, of these harmonics, samples and eps, with pairs that are
    /// marched until they are periodic, and the default slip threshold.
    pub fn new(
        state: &StaticState,
        system: Arc<ContactSystem>,
        inexact: Arc<InexactModel>,
        fourier: Arc<Fourier>,
        eps: Arc<[f64]>,
    ) -> Self {
        Self {
            x_static: state.x.as_slice().into(),
            lambda_static: state.lambda.as_slice().into(),
            at_rest: state.status.as_slice().into(),
            static_mean: match state.retention_n {
                None => Mean::Free,
                Some(_) => Mean::Retained,
            },
            pressing_n: state.lambda.iter().step_by(3).map(|n| -n).sum(),
            periods: Periods::UntilPeriodic,
            slip_threshold_m: state.slip_threshold_m(&eps),
            free_slips_m: [].into(),
            frozen: FrozenContacts::new(&state.linear, &system).into(),
            system,
            inexact,
            fourier,
            eps,
        }
    }
}

/// Balance of one frequency.
pub struct Balance {
    /// Settings and data that all frequencies share.
    pub setting: Setting,
    /// Dynamic stiffness of the mean and the harmonics 1..H.
    pub stiffness: HarmonicStiffness,
    /// Load F, N, (2H+1) n.
    pub force: Vec<f64>,
    /// Size of the forces of a vibration that no force excites, N; 0 for others.
    pub vibration_n: f64,
    /// Spring that retains the mean at the static state along the motions that only friction holds.
    retention: Option<Arc<Retention>>,
    /// Upper limit of the coefficients of friction.
    pub most_friction: f64,
    /// Rounding of the law; `None` for the law itself.
    pub rounding: Option<Rounding>,
    /// Factor on the eps of the setting.
    pub eps_scale: f64,
    /// Time at which the solution is given up.
    pub(crate) deadline: Deadline,
}

/// Time at which something is given up, if ever.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Deadline(Option<Instant>);

impl Deadline {
    /// Deadline so many seconds from now. `None`, or more than a clock can count, means never.
    pub(crate) fn new(seconds: Option<f64>) -> Self {
        let time = seconds.and_then(|s| Duration::try_from_secs_f64(s).ok());
        Self(time.and_then(|time| Instant::now().checked_add(time)))
    }

    /// Returns `true` if the deadline has passed.
    pub(crate) fn is_over(self) -> bool {
        self.0.is_some_and(|end| Instant::now() >= end)
    }
}

/// Residual and contact forces at one U.
pub struct Evaluation {
    /// Residual f(U), N, (2H+1) n.
    pub residual: Vec<f64>,
    /// Predicted force lambda_u = F - Lambda U + eps U, N, (2H+1) n.
    pub lambda_u: Vec<f64>,
    /// Contact force lambda(U), N, (2H+1) n.
    pub lambda: Vec<f64>,
    /// Result of the time evaluation of each pair.
    pub ends: Vec<PairEnd>,
}

impl Evaluation {
    /// What a balance with more harmonics, and the same samples and eps, has to be linearised from at a
    /// U with zeros for these, `entries` in all, where nothing excites them.
    pub(crate) fn widened(&self, entries: usize) -> Self {
        let widened = |v: &Vec<f64>| {
            let mut v = v.clone();
            v.resize(entries, 0.0);
            v
        };
        Self {
            residual: widened(&self.residual),
            lambda_u: widened(&self.lambda_u),
            lambda: widened(&self.lambda),
            ends: self.ends.clone(),
        }
    }
}

/// Balance that keeps its last evaluation, and does not evaluate the same U twice in a row.
pub(crate) struct Evaluator<'a> {
    /// Balance that is evaluated.
    pub balance: &'a Balance,
    last: Option<(Vec<f64>, Evaluation)>,
}

impl<'a> Evaluator<'a> {
    /// Evaluator that holds no evaluation yet.
    pub(crate) fn new(balance: &'a Balance) -> Self {
        Self {
            balance,
            last: None,
        }
    }

    /// Keeps the evaluation at U, where it is known.
    pub(crate) fn keep(&mut self, u: &[f64], known: Option<Evaluation>) {
        self.last = known.map(|evaluation| (u.to_vec(), evaluation));
    }

    /// Evaluation at U, computed unless U was the last.
    pub(crate) fn evaluate(&mut self, u: &[f64]) -> &Evaluation {
        let evaluation = self.take_evaluation(u);
        &self.last.insert((u.to_vec(), evaluation)).1
    }

    /// Like [`Evaluator::evaluate`], but moves the evaluation out.
    pub(crate) fn take_evaluation(&mut self, u: &[f64]) -> Evaluation {
        match self.last.take() {
            Some((last, evaluation)) if last == u => evaluation,
            _ => self.balance.evaluate(u),
        }
    }
}

/// Jacobian J at one U.
#[derive(Clone)]
pub struct Jacobian {
    /// Pairs that do not stick throughout, and those with springs, ascending.
    pub active: Vec<usize>,
    /// D of each active pair, 3(2H+1) square, row-major, component-major indices.
    pub derivatives: Vec<Vec<f64>>,
}

impl Balance {
    /// Balance at `omega` rad/s, with its dynamic stiffness and condensed loads.
    pub fn new(setting: &Setting, omega: f64) -> Self {
        let harmonics = setting.fourier.harmonics();
        let system = &setting.system;
        let n = system.unknowns();
        let stiffness = system.stiffness(omega, harmonics);
        let mut force = vec![0.0; blocks(harmonics) * n];
        force[..n].copy_from_slice(&system.problem.reduced.static_load.on_x);
        for load in &system.problem.excitations {
            let k = load.harmonic;
            if k == 0 || k > harmonics {
                continue;
            }
            let factor = load.factor(omega);
            let condensed = system.condensed_load(
                k,
                omega,
                &complex(&load.cosine.on_x, &load.sine.on_x, factor),
                &complex(&load.cosine.on_modes, &load.sine.on_modes, factor),
            );
            add_harmonic(&mut force, k, &condensed);
        }
        Self::forced(setting, stiffness, force)
    }

    /// Balance under a force, N, in harmonics, with a free mean and the law and eps of its setting.
    fn forced(setting: &Setting, stiffness: HarmonicStiffness, force: Vec<f64>) -> Self {
        Self {
            setting: setting.clone(),
            stiffness,
            force,
            vibration_n: 0.0,
            retention: None,
            most_friction: f64::INFINITY,
            rounding: None,
            eps_scale: 1.0,
            deadline: Deadline::default(),
        }
    }

    /// Balance of a vibration without a force, in which the tracked mode has the amplitude `q` at
    /// harmonic 1. Its load is that of the tracked mode on the pairs, besides the static one.
    pub(crate) fn unforced(setting: &Setting, motion: &Unforced<'_>, q: f64) -> Self {
        let harmonics = setting.fourier.harmonics();
        let n = setting.system.unknowns();
        let mut force = vec![0.0; blocks(harmonics) * n];
        force[..n].copy_from_slice(&setting.system.problem.reduced.static_load.on_x);
        add_harmonic(&mut force, 1, &motion.drive(q));
        Self::forced(setting, motion.stiffness(harmonics), force)
    }

    /// Retains the mean of this balance by `retention`, anchored at the static state, or at rest
    /// where the static state is itself retained.
    pub(crate) fn retained_by(mut self, retention: Arc<Retention>) -> Self {
        let n = self.unknowns_per_block();
        if self.setting.static_mean == Mean::Free {
            retention.add_to(&self.setting.x_static, &mut self.force[..n]);
        }
        self.retention = Some(retention);
        self
    }

    /// Derivative of Lambda U - F with respect to the frequency, at constant U, N s/rad; `omega` is
    /// that of the balance.
    pub(crate) fn frequency_slope(&self, u: &[f64], omega: f64) -> Vec<f64> {
        let (system, harmonics) = (&self.setting.system, self.stiffness.harmonics());
        let mut out = vec![0.0; u.len()];
        system.stiffness_slope(omega, harmonics).apply(u, &mut out);
        out[..self.unknowns_per_block()].fill(0.0);
        for load in &system.problem.excitations {
            let k = load.harmonic;
            if k == 0 || k > harmonics {
                continue;
            }
            let parts = |factor: f64| {
                let (cosine, sine) = (&load.cosine, &load.sine);
                [
                    complex(&cosine.on_x, &sine.on_x, factor),
                    complex(&cosine.on_modes, &sine.on_modes, factor),
                ]
            };
            // With respect to the frequency of harmonic k, k times that of the first one.
            let [_, on_modes] = parts(load.factor(omega));
            let [on_x_slope, on_modes_slope] = parts(load.factor_slope(omega) / k as f64);
            let slopes = [&on_x_slope[..], &on_modes_slope[..]];
            let slope = system.condensed_load_slope(k, omega, &on_modes, slopes);
            let less: Vec<c64> = slope.iter().map(|f| -(k as f64) * f).collect();
            add_harmonic(&mut out, k, &less);
        }
        out
    }

    /// Spring that retains the mean, if any.
    pub(crate) fn retention(&self) -> Option<&Retention> {
        self.retention.as_deref()
    }

    /// Treatment of the mean along the motions that only friction holds.
    pub(crate) fn mean(&self) -> Mean {
        match self.retention {
            None => Mean::Free,
            Some(_) => Mean::Retained,
        }
    }

    /// Forces of the retention at U, N, as [`Retention::force_n`] adds them up; zero without one.
    pub(crate) fn retention_n(&self, u: &[f64]) -> f64 {
        let n = self.unknowns_per_block();
        let at_rest = vec![0.0; n];
        let anchor = match self.setting.static_mean {
            Mean::Free => &*self.setting.x_static,
            Mean::Retained => &at_rest,
        };
        self.retention
            .as_ref()
            .map_or(0.0, |r| r.force_n(&u[..n], anchor))
    }

    /// Number of unknowns of one block, 3 per pair.
    pub(crate) fn unknowns_per_block(&self) -> usize {
        self.setting.system.unknowns()
    }

    /// Number of unknowns of U, (2H+1) n.
    pub fn unknowns(&self) -> usize {
        self.force.len()
    }

    pub(crate) fn law(&self, pair: usize) -> PredictedLaw {
        let eps = [0, 1].map(|c| self.eps_at(3 * pair + c));
        self.setting.system.problem.laws[pair].predicted(eps, self.most_friction)
    }

    /// Share of the predicted force that the law of a pair uses: component-major coefficients, N.
    fn prediction(&self, lambda_u: &[f64], pair: usize) -> Vec<f64> {
        let width = self.setting.fourier.width();
        let mut force = gather(lambda_u, self.unknowns_per_block(), pair, width);
        let shares = self.law(pair).shares;
        for (component, share) in force.chunks_exact_mut(width).zip(shares) {
            component.iter_mut().for_each(|f| *f *= share);
        }
        force
    }

    fn input<'b>(&self, pair: usize, force: &'b [f64]) -> PairInput<'b> {
        PairInput {
            periods: self.setting.periods,
            force,
            law: self.law(pair),
            start: self.state_at_rest(pair),
            rounding: self.rounding,
            plain_periods: PLAIN_PERIODS,
        }
    }

    /// State of a pair in the static state.
    fn state_at_rest(&self, pair: usize) -> PairState {
        let tangential = |v: &[f64]| [v[3 * pair + 1], v[3 * pair + 2]];
        let [x, lambda] =
            [&self.setting.x_static, &self.setting.lambda_static].map(|v| tangential(v));
        self.law(pair).state_at_rest(x, lambda)
    }

    /// Computes y = Lambda v, all harmonics.
    pub fn apply_stiffness(&self, v: &[f64], y: &mut [f64]) {
        self.stiffness.apply(v, y);
        if let Some(retention) = &self.retention {
            let n = self.unknowns_per_block();
            retention.add_to(&v[..n], &mut y[..n]);
        }
    }

    /// Computes lambda_u = F - Lambda U + eps U.
    pub(crate) fn lambda_u(&self, u: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; u.len()];
        self.apply_stiffness(u, &mut out);
        for (i, o) in out.iter_mut().enumerate() {
            *o = self.force[i] - *o + self.eps_at(i) * u[i];
        }
        out
    }

    /// Time evaluation of one pair.
    pub(crate) fn evaluate_pair(&self, u: &[f64], pair: usize) -> PairEnd {
        let (n, fourier) = (self.unknowns_per_block(), &*self.setting.fourier);
        let mut forces = self.stiffness.apply_rows(3 * pair..3 * pair + 3, u);
        if let Some(retention) = &self.retention {
            let mut pull = vec![0.0; n];
            retention.add_to(&u[..n], &mut pull);
            (0..3).for_each(|c| forces[c] += pull[3 * pair + c]);
        }
        let (width, shares) = (fourier.width(), self.law(pair).shares);
        let mut prediction = vec![0.0; 3 * width];
        for h in 0..width {
            for c in 0..3 {
                let i = h * n + 3 * pair + c;
                let lambda_u = self.force[i] - forces[3 * h + c] + self.eps_at(i) * u[i];
                prediction[c * width + h] = shares[c] * lambda_u;
            }
        }
        let mut signals = Signals::new(fourier.samples());
        let mut lambda = vec![0.0; 3 * width];
        let input = self.input(pair, &prediction);
        contact_forces(fourier, input, &mut signals, &mut lambda)
    }

    /// Computes f(U), lambda(U) and the time evaluation of each pair.
    pub fn evaluate(&self, u: &[f64]) -> Evaluation {
        self.evaluate_from(u, |_| None)
    }

    /// [`Balance::evaluate`] at a U near that of an evaluation with other samples or fewer harmonics,
    /// and the same eps. Pairs that slide begin in the state where they were found there.
    pub(crate) fn evaluate_near(&self, u: &[f64], near: &Evaluation) -> Evaluation {
        self.evaluate_from(u, |pair| near.ends[pair].slides_from())
    }

    fn evaluate_from(
        &self,
        u: &[f64],
        near: impl Fn(usize) -> Option<PairState> + Sync,
    ) -> Evaluation {
        let (n, fourier) = (self.unknowns_per_block(), &*self.setting.fourier);
        let width = fourier.width();
        let lambda_u = self.lambda_u(u);
        let evaluated: Vec<(PairEnd, Vec<f64>)> = (0..n / 3)
            .into_par_iter()
            .with_min_len(16)
            .map_init(
                || Signals::new(fourier.samples()),
                |signals, pair| {
                    let force = self.prediction(&lambda_u, pair);
                    let mut lambda = vec![0.0; 3 * width];
                    let input = self.input(pair, &force);
                    let end = match near(pair) {
                        Some(near) => {
                            contact_forces_near(fourier, input, near, signals, &mut lambda)
                        }
                        None => contact_forces(fourier, input, signals, &mut lambda),
                    };
                    (end, lambda)
                },
            )
            .collect();
        let mut lambda = vec![0.0; u.len()];
        for (pair, (_, local)) in evaluated.iter().enumerate() {
            scatter(local, n, pair, width, &mut lambda);
        }
        let residual = (0..u.len())
            .map(|i| {
                // Lambda U - F = eps U - lambda_u.
                self.eps_at(i) * u[i] - lambda_u[i] + lambda[i]
            })
            .collect();
        let ends = evaluated.into_iter().map(|(end, _)| end).collect();
        Evaluation {
            residual,
            lambda_u,
            lambda,
            ends,
        }
    }

    /// Compression -lambda_N of a pair at the samples of a period under the law itself, N, from the
    /// `lambda_u` of an evaluation. Below zero the pair is open.
    pub(crate) fn compressions_n(&self, pair: usize, lambda_u: &[f64]) -> Vec<f64> {
        let fourier = &self.setting.fourier;
        let shift_n = self.law(pair).shift_n;
        let mut compressions = vec![0.0; fourier.samples()];
        let force = self.prediction(lambda_u, pair);
        fourier.to_time(&force[..fourier.width()], &mut compressions);
        for normal in &mut compressions {
            // 0 - x rather than -x: a pair without force carries 0, not -0.
            *normal = 0.0 - (*normal + shift_n);
        }
        compressions
    }

    /// Jacobian J at the U of an evaluation.
    pub fn linearise(&self, evaluation: &Evaluation) -> Jacobian {
        let fourier = &self.setting.fourier;
        let width = fourier.width();
        let found: Vec<Option<Vec<f64>>> = (evaluation.ends.par_iter().enumerate())
            .with_min_len(8)
            .map_init(
                || Signals::new(fourier.samples()),
                |signals, (pair, end)| {
                    let law = self.law(pair);
                    if end.always_stuck && law.is_rigid {
                        return None;
                    }
                    let force = self.prediction(&evaluation.lambda_u, pair);
                    let input = self.input(pair, &force);
                    last_period(fourier, input, end, signals);
                    let mut derivative = vec![0.0; 9 * width * width];
                    contact_force_derivative(fourier, input, signals, end, &mut derivative);
                    if !law.is_rigid {
                        let parts = derivative.chunks_exact_mut(width);
                        for (part, share) in parts.zip(law.shares.into_iter().cycle()) {
                            part.iter_mut().for_each(|d| *d *= share);
                        }
                    }
                    Some(derivative)
                },
            )
            .collect();
        let of_pairs = found.into_iter().enumerate();
        let moving = of_pairs.filter_map(|(pair, derivative)| Some((pair, derivative?)));
        let (active, derivatives) = moving.unzip();
        Jacobian {
            active,
            derivatives,
        }
    }

    /// Product J v of the Jacobian, at the U where it was [linearised](Balance::linearise), and a
    /// vector of (2H+1) n, N.
    pub fn jacobian_times(&self, jacobian: &Jacobian, v: &[f64]) -> Vec<f64> {
        let mut forces = vec![0.0; v.len()];
        self.apply_stiffness(v, &mut forces);
        // (I - D) Lambda v + D eps v = (I - D) (Lambda v - eps v) + eps v.
        for (i, force) in forces.iter_mut().enumerate() {
            *force -= self.eps_at(i) * v[i];
        }
        let mut out = jacobian.unbalanced_part(&forces, self.unknowns_per_block());
        for (i, out) in out.iter_mut().enumerate() {
            *out += self.eps_at(i) * v[i];
        }
        out
    }

    /// Way from the static state to where the last period of a pair begins, as a force, N.
    pub(crate) fn slid_from_rest_n(&self, pair: usize, end: &PairEnd) -> [f64; 2] {
        let rest = self.state_at_rest(pair);
        [0, 1].map(|c| end.period_start().slid_n[c] - rest.slid_n[c])
    }

    /// Distance that a pair slides in a period, m.
    pub(crate) fn slid_m(&self, pair: usize, end: &PairEnd) -> f64 {
        self.law(pair).slid_m(end.slid_n)
    }

    /// Compression of a pair times the distance that it slides, integral over a period, N m.
    pub(crate) fn rubbed_nm(&self, pair: usize, end: &PairEnd) -> f64 {
        self.law(pair).slid_m(end.rubbed_n2)
    }

    /// Returns `true` if a pair slides farther than the threshold in a period.
    pub(crate) fn slips(&self, pair: usize, end: &PairEnd) -> bool {
        self.slid_m(pair, end) > self.setting.slip_threshold_m
    }

    /// Returns `true` if a pair neither slips nor opens in a period.
    pub(crate) fn sticks(&self, pair: usize, end: &PairEnd) -> bool {
        end.open_samples == 0 && !self.slips(pair, end)
    }

    /// eps of entry `i` of a full vector.
    pub(crate) fn eps_at(&self, i: usize) -> f64 {
        self.eps_scale * self.setting.eps[i % self.unknowns_per_block()]
    }
}

impl Jacobian {
    /// Computes (I - D) v for forces v on all pairs, (2H+1) n: the part of them that the contact
    /// forces do not balance. It is 0 on pairs that stick throughout.
    pub(crate) fn unbalanced_part(&self, v: &[f64], n: usize) -> Vec<f64> {
        let width = v.len() / n;
        let mut out = vec![0.0; v.len()];
        for (pair, derivative) in self.active.iter().zip(&self.derivatives) {
            let pair_force = gather(v, n, *pair, width);
            let mut left = pair_force.clone();
            for (left, row) in left.iter_mut().zip(derivative.chunks_exact(3 * width)) {
                *left -= dot(row, &pair_force);
            }
            scatter(&left, n, *pair, width, &mut out);
        }
        out
    }
}

/// Complex amplitudes of `cosine cos + sine sin`, times a factor.
fn complex(cosine: &[f64], sine: &[f64], factor: f64) -> Vec<c64> {
    let both = cosine.iter().zip(sine);
    both.map(|(&c, &s)| factor * c64::new(c, -s)).collect()
}

/// Adds complex amplitudes to the blocks of harmonic k.
pub(super) fn add_harmonic(v: &mut [f64], k: usize, amplitudes: &[c64]) {
    let n = amplitudes.len();
    for (i, f) in amplitudes.iter().enumerate() {
        v[cosine(k) * n + i] += f.re;
        v[sine(k) * n + i] -= f.im;
    }
}

/// Computes y = A x for a dense A.
pub(crate) fn apply_real(matrix: &Mat<f64>, x: &[f64], y: &mut [f64]) {
    let (rows, columns) = (y.len(), x.len());
    matmul(
        MatMut::from_column_major_slice_mut(y, rows, 1),
        Accum::Replace,
        matrix,
        MatRef::from_column_major_slice(x, columns, 1),
        1.0,
        Par::Seq,
    );
}

/// Coefficients of one pair from a harmonic-major vector of block length `n`, component-major.
pub(crate) fn gather(v: &[f64], n: usize, pair: usize, width: usize) -> Vec<f64> {
    let mut out = vec![0.0; 3 * width];
    for c in 0..3 {
        for h in 0..width {
            out[c * width + h] = v[h * n + 3 * pair + c];
        }
    }
    out
}

/// Inverse of [`gather`].
pub(crate) fn scatter(local: &[f64], n: usize, pair: usize, width: usize, v: &mut [f64]) {
    for c in 0..3 {
        for h in 0..width {
            v[h * n + 3 * pair + c] = local[c * width + h];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{
        OMEGA_RAD_S, changed, linear_residual, sample_points, sample_points_of_waves_too,
    };
    use crate::problem::Problem;

    #[test]
    fn a_retained_mean_is_pulled_to_its_anchor_with_the_force_reported_and_nothing_else_is() {
        for (_, sample, u) in &sample_points() {
            for static_mean in [Mean::Free, Mean::Retained] {
                let setting = Setting {
                    static_mean,
                    ..sample.setting.clone()
                };
                let n = setting.system.unknowns();
                let anchor = match static_mean {
                    Mean::Free => setting.x_static.to_vec(),
                    Mean::Retained => vec![0.0; n],
                };
                let stiffness = &setting.system.problem.reduced.stiffness;
                let retention = Arc::new(Retention::new(stiffness, &setting.eps));
                let free = Balance::new(&setting, OMEGA_RAD_S);
                let retained = Balance::new(&setting, OMEGA_RAD_S).retained_by(retention);
                assert_eq!([free.mean(), retained.mean()], [Mean::Free, Mean::Retained]);
                assert_eq!(free.retention_n(u), 0.0);

                let [with, without] = [&retained, &free].map(|b| linear_residual(b, u));
                let pull: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
                let (on_mean, on_rest) = pull.split_at(n);
                assert!(on_rest.iter().all(|f| *f == 0.0));
                let size_n: f64 = on_mean.chunks_exact(3).map(|f| f[1].hypot(f[2])).sum();
                assert!(size_n > 0.01 && (retained.retention_n(u) / size_n - 1.0).abs() < 1e-10);
                let difference: Vec<f64> = u[..n].iter().zip(&anchor).map(|(u, a)| u - a).collect();
                assert!(dot(on_mean, &difference) > 0.0);

                let mut at_anchor = u.to_vec();
                at_anchor[..n].copy_from_slice(&anchor);
                assert_eq!(retained.retention_n(&at_anchor), 0.0);
            }
        }
    }

    #[test]
    fn friction_starts_at_the_static_state_with_the_eps_of_its_own_directions() {
        for (_, sample, _) in &sample_points() {
            let n = sample.unknowns_per_block();
            let eps: Vec<f64> = (0..n)
                .map(|i| (1 + i / 3) as f64 * if i % 3 == 0 { 5.0 } else { 2.0 })
                .collect();
            let x_static: Vec<f64> = (0..n).map(|i| 0.1 * (i + 1) as f64).collect();
            let mut problem = sample.setting.system.problem.clone();
            problem.laws.iter_mut().for_each(|law| law.stiffness = None);
            let system = ContactSystem::new(&problem, sample.setting.system.damping);
            let setting = Setting {
                system: system.into(),
                eps: eps.into(),
                x_static: x_static.as_slice().into(),
                at_rest: [].into(),
                ..sample.setting.clone()
            };
            let balance = Balance::new(&setting, OMEGA_RAD_S);
            for pair in 0..n / 3 {
                let input = balance.input(pair, &[]);
                let [along, across] =
                    [1, 2].map(|c| (1 + pair) as f64 * 2.0 * x_static[3 * pair + c]);
                assert_eq!(input.start.slid_n, [along, across]);
                let gap_m = setting.system.problem.laws[pair].gap_m;
                assert_eq!(input.law.shift_n, (1 + pair) as f64 * 5.0 * gap_m);
            }
        }
    }

    #[test]
    fn the_slope_over_the_frequency_is_that_by_differences() {
        use crate::excitation::Growth;
        for (what, sample, u) in &sample_points() {
            let growing = |problem: &mut Problem| problem.excitations[1].growth = Growth::Squared;
            let setting = changed(&sample.setting, growing);
            let at = |omega: f64| linear_residual(&Balance::new(&setting, omega), u);
            let step = 1e-6;
            let [above, below] = [OMEGA_RAD_S + step, OMEGA_RAD_S - step].map(at);
            let balance = Balance::new(&setting, OMEGA_RAD_S);
            let slope = balance.frequency_slope(u, OMEGA_RAD_S);
            let largest = slope.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for ((a, b), slope) in above.iter().zip(&below).zip(&slope) {
                let by_differences = (a - b) / (2.0 * step);
                let off = (by_differences - slope).abs();
                assert!(off < 1e-6 * largest, "{what}: {by_differences} {slope}");
            }
        }
    }

    #[test]
    fn the_evaluation_of_a_coarser_balance_gives_the_jacobian_of_a_finer_one() {
        for (what, sample, u) in &sample_points_of_waves_too() {
            let fourier = &sample.setting.fourier;
            let finer = Fourier::new(fourier.harmonics() + 3, fourier.samples());
            let setting = Setting {
                fourier: finer.into(),
                ..sample.setting.clone()
            };
            let with_force = |setting| {
                let mut balance = Balance::new(setting, OMEGA_RAD_S);
                let (own, further) = balance.force.split_at_mut(sample.force.len());
                own.copy_from_slice(&sample.force);
                // One of the excitations has a harmonic that the coarser balance leaves out.
                further.fill(0.0);
                balance
            };
            let (fine, coarse) = (with_force(&setting), with_force(&sample.setting));
            let mut longer = u.to_vec();
            longer.resize(fine.force.len(), 0.0);
            let anew = fine.evaluate(&longer);
            let widened = coarse.evaluate(u).widened(longer.len());
            let compare = |a: &[f64], b: &[f64]| {
                let largest = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                assert_eq!(a.len(), b.len(), "{what}");
                for (a, b) in a.iter().zip(b) {
                    assert!((a - b).abs() <= 1e-9 * largest, "{what}: {a} {b}");
                }
            };
            compare(&widened.lambda_u, &anew.lambda_u);
            let [found, exact] = [&widened, &anew].map(|evaluation| fine.linearise(evaluation));
            assert_eq!(found.active, exact.active, "{what}");
            for (a, b) in found.derivatives.iter().zip(&exact.derivatives) {
                compare(a, b);
            }
        }
    }

    #[test]
    fn what_was_evaluated_last_is_not_evaluated_again() {
        for (_, balance, u) in &sample_points() {
            let elsewhere: Vec<f64> = u.iter().map(|u| 1.1 * u).collect();
            let mut evaluator = Evaluator::new(balance);
            let kept = evaluator.evaluate(u).residual.as_ptr();
            assert_eq!(evaluator.evaluate(u).residual.as_ptr(), kept);
            let there = balance.evaluate(&elsewhere).residual;
            assert_eq!(evaluator.evaluate(&elsewhere).residual, there);
            let kept = evaluator.evaluate(&elsewhere).residual.as_ptr();
            assert_eq!(
                evaluator.take_evaluation(&elsewhere).residual.as_ptr(),
                kept
            );
            assert_eq!(
                evaluator.take_evaluation(u).residual,
                balance.evaluate(u).residual
            );
        }
    }

    #[test]
    fn a_coefficient_of_friction_above_what_is_computed_counts_as_that() {
        for (_, sample, _) in &sample_points() {
            let too_rough = |problem: &mut Problem| problem.laws[0].friction = 1e6;
            let setting = changed(&sample.setting, too_rough);
            let balance = Balance::new(&setting, OMEGA_RAD_S);
            let friction = |pair: usize| balance.input(pair, &sample.force).law.friction;
            assert_eq!(friction(0), crate::contact::PairLaw::MOST_FRICTION);
            assert_eq!(friction(1), setting.system.problem.laws[1].friction);
        }
    }

    #[test]
    fn no_coefficient_of_friction_counts_as_more_than_the_most() {
        for (_, sample, u) in &sample_points() {
            let (setting, most) = (&sample.setting, 0.35);
            let mut capped = Balance::new(setting, OMEGA_RAD_S);
            capped.force.copy_from_slice(&sample.force);
            capped.most_friction = most;
            let less_rough = |problem: &mut Problem| {
                assert!(problem.laws.iter().any(|pair| pair.friction < most));
                for pair in &mut problem.laws {
                    pair.friction = pair.friction.min(most);
                }
            };
            let setting = changed(setting, less_rough);
            let mut less_rough = Balance::new(&setting, OMEGA_RAD_S);
            less_rough.force.copy_from_slice(&sample.force);
            let [capped, less_rough, as_it_is] =
                [&capped, &less_rough, sample].map(|b| b.evaluate(u).lambda);
            assert_eq!(capped, less_rough);
            assert_ne!(capped, as_it_is);
        }
    }
}
