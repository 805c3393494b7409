//! Input of the time evaluation of a pair, and its signals over a period.

use super::between_samples::{self, Window};
use crate::contact::coulomb::{Contact, length};
use crate::contact::{PairState, PredictedLaw};
use dovetail_numerics::fourier::Fourier;

/// The force is periodic when the state moves by less than this fraction of the largest predicted
/// force.
pub(crate) const PERIODICITY: f64 = 1e-12;

/// Number of periods of a pair that are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub enum Periods {
    /// Until the end of a period equals its start.
    UntilPeriodic,
    /// A fixed number (at most `super::aft::PLAIN_PERIODS`), periodic or not. Pairs change their
    /// state at whole samples only, as in older programs.
    Exactly(usize),
}

/// Deviation of a law without corners from the law itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounding {
    /// Sharpness q of the friction cone; it is infinite for the law itself.
    pub sharpness: f64,
    /// Width w of the normal predictions between contact and lift-off, N; it is 0 for the law
    /// itself.
    pub width_n: f64,
}

/// Input of the time evaluation of one pair.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PairInput<'a> {
    /// Periods that the pair is marched through.
    pub periods: Periods,
    /// Fourier coefficients of the law's shares of lambda_u, N: component-major, 3 x (2H+1).
    pub force: &'a [f64],
    /// Law of the pair.
    pub law: PredictedLaw,
    /// State at the start of the first period.
    pub start: PairState,
    /// Rounding of the law; `None` for the law itself.
    pub rounding: Option<Rounding>,
    /// Number of periods that the pair goes through before its periodic state is solved for.
    pub plain_periods: usize,
}

/// Signals of the last period, component-major, 3 x N; reused from pair to pair.
pub(crate) struct Signals {
    /// Predicted forces, N.
    pub lambda_u: Vec<f64>,
    /// Contact forces, N.
    pub lambda: Vec<f64>,
    /// Status of the pair at each sample.
    pub contact: Vec<Contact>,
    /// True for each sample if the tangential prediction reverses between the sample before and
    /// this one.
    pub reverses: Vec<bool>,
    /// Passage of the pair from the sample before to each sample.
    pub passages: Vec<Passage>,
}

/// Passage of a pair from one sample to the next.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Passage {
    /// Position along the contact at the end, N ([`PairState::slid_n`]).
    pub position_n: [f64; 2],
    /// True if the pair slips or is open at some instant that is looked at.
    pub slips: bool,
    /// Path slid, N, and compression times path slid, N2, where the pair may turn on the way: it
    /// then does not slide straight from sample to sample.
    pub path: Option<[f64; 2]>,
}

/// Compression of a pair under a normal prediction, N.
#[inline(always)]
pub(crate) fn compression_n(normal: f64) -> f64 {
    // 0 - x rather than -x: an open pair carries 0, not -0.
    (0.0 - normal).max(0.0)
}

impl Signals {
    /// Allocates the signals of a period of so many samples.
    pub(crate) fn new(samples: usize) -> Self {
        Self {
            lambda_u: vec![0.0; 3 * samples],
            lambda: vec![0.0; 3 * samples],
            contact: vec![Contact::Stick; samples],
            reverses: vec![false; samples],
            passages: vec![Passage::default(); samples],
        }
    }

    /// Number of samples of the period.
    pub(crate) fn samples(&self) -> usize {
        self.contact.len()
    }

    /// Writes the Fourier coefficients of the contact forces.
    #[inline(always)]
    pub(crate) fn to_frequency(&self, fourier: &Fourier, lambda: &mut [f64]) {
        let components = lambda.chunks_exact_mut(fourier.width());
        for (signal, lambda) in self.lambda.chunks_exact(self.samples()).zip(components) {
            fourier.to_frequency(signal, lambda);
        }
    }

    /// Writes the predicted forces at the samples, and finds the intervals in which the tangential one
    /// reverses.
    #[inline(always)]
    pub(crate) fn predict(&mut self, fourier: &Fourier, input: &PairInput<'_>) {
        let components = input.force.chunks_exact(fourier.width());
        let samples = fourier.samples();
        for (force, signal) in components.zip(self.lambda_u.chunks_exact_mut(samples)) {
            fourier.to_time(force, signal);
        }
        if input.rounding.is_none() {
            self.find_reversals(input);
        }
    }

    /// Finds the intervals in which the tangential prediction reverses.
    #[inline(always)]
    fn find_reversals(&mut self, input: &PairInput<'_>) {
        let samples = self.samples();
        if !input.law.has_friction() || input.periods != Periods::UntilPeriodic {
            self.reverses.fill(false);
            return;
        }
        let (_, tangential) = self.lambda_u.split_at(samples);
        let (t1, t2) = tangential.split_at(samples);
        let at = |n: usize| [t1[n % samples], t2[n % samples]];
        let mut window = [samples - 2, samples - 1, 0, 1].map(at);
        for (n, reverses) in self.reverses.iter_mut().enumerate() {
            *reverses = between_samples::reverses(window);
            window = [window[1], window[2], window[3], at(n + 2)];
        }
    }

    /// Prediction (N with the clearance, t1, t2) at sample `n`, N.
    #[inline(always)]
    pub(crate) fn prediction(&self, n: usize, shift_n: f64) -> [f64; 3] {
        let at = |c: usize| self.lambda_u[c * self.samples() + n];
        [at(0) + shift_n, at(1), at(2)]
    }

    /// Rate of the tangential prediction at sample `n` by central differences, N per interval.
    #[inline(always)]
    pub(crate) fn rate(&self, n: usize) -> [f64; 2] {
        let samples = self.samples();
        let (before, after) = (self.previous(n), self.next(n));
        [1, 2].map(|c| {
            0.5 * (self.lambda_u[c * samples + after] - self.lambda_u[c * samples + before])
        })
    }

    /// Contact force at sample `n`, N.
    #[inline(always)]
    fn force(&self, n: usize) -> [f64; 3] {
        [0, 1, 2].map(|c| self.lambda[c * self.samples() + n])
    }

    /// Writes the contact force and the status of the pair at sample `n`.
    #[inline(always)]
    pub(crate) fn write(&mut self, n: usize, contact: Contact, force: [f64; 3]) {
        let samples = self.samples();
        self.contact[n] = contact;
        for (c, force) in force.into_iter().enumerate() {
            self.lambda[c * samples + n] = force;
        }
    }

    /// Path slid over the last period, N, and the integral of the compression along it, N2. The
    /// period begins at `start_n` ([`PairState::slid_n`]).
    #[inline(always)]
    pub(crate) fn path(&self, start_n: [f64; 2], shift_n: f64) -> [f64; 2] {
        let mut path = [0.0; 2];
        let mut from_n = start_n;
        for (n, passage) in self.passages.iter().enumerate() {
            let to_n = passage.position_n;
            if let Some(own) = passage.path {
                path = [0, 1].map(|i| path[i] + own[i]);
            } else if self.contact[n] == Contact::Slip {
                let slid_n = length(to_n[0] - from_n[0], to_n[1] - from_n[1]);
                let [before_n, now_n] =
                    [self.previous(n), n].map(|n| compression_n(self.prediction(n, shift_n)[0]));
                path[0] += slid_n;
                path[1] += 0.5 * (before_n + now_n) * slid_n;
            }
            from_n = to_n;
        }
        path
    }

    /// State of the pair after sample `n`.
    pub(crate) fn state(&self, n: usize, shift_n: f64) -> PairState {
        PairState::from_contact_force(self.prediction(n, shift_n), self.contact[n], self.force(n))
    }

    /// Sample before sample `n`; the last sample precedes the first.
    #[inline(always)]
    pub(crate) fn previous(&self, n: usize) -> usize {
        if n == 0 { self.samples() - 1 } else { n - 1 }
    }

    /// Sample after sample `n`; the first sample follows the last.
    #[inline(always)]
    pub(crate) fn next(&self, n: usize) -> usize {
        if n + 1 == self.samples() { 0 } else { n + 1 }
    }

    /// Samples around the interval that ends at sample `n`, which is the third of them.
    #[inline(always)]
    pub(crate) fn neighbourhood(&self, n: usize) -> [usize; 4] {
        let before = self.previous(n);
        [self.previous(before), before, n, self.next(n)]
    }

    /// Predictions at those samples.
    pub(crate) fn window(&self, n: usize, shift_n: f64) -> Window<f64> {
        self.neighbourhood(n).map(|n| self.prediction(n, shift_n))
    }

    /// Returns `true` if the pair may turn between the sample before and sample `n`.
    #[inline(always)]
    pub(crate) fn turns(&self, n: usize, law: &PredictedLaw) -> bool {
        let [before, now] = [self.previous(n), n].map(|n| self.contact[n]);
        self.reverses[n]
            || (before == Contact::Open) != (now == Contact::Open)
            || law.has_friction()
                && (before != now || now == Contact::Slip && self.turns_inward(n, law))
    }

    /// Returns `true` if a pair that slips at the sample before leaves its cone inwards on the way
    /// to sample `n`.
    #[inline(always)]
    fn turns_inward(&self, n: usize, law: &PredictedLaw) -> bool {
        let before = self.previous(n);
        let [from, to] = [before, n].map(|n| self.prediction(n, 0.0));
        let step = [0, 1, 2].map(|c| to[c] - from[c]);
        law.turns_inward(self.force(before), step)
    }

    /// Returns `true` if the pair closes between the sample before and sample `n`.
    #[inline(always)]
    pub(crate) fn closes(&self, n: usize, shift_n: f64) -> bool {
        self.lambda_u[self.previous(n)] + shift_n >= 0.0 && self.lambda_u[n] + shift_n < 0.0
    }
}

/// Adds S_T to two rows of three blocks, the derivatives by all coefficients of lambda_u; `s` has
/// the length of a block.
#[inline(always)]
pub(crate) fn add_own(s: &[f64], rows: &mut [f64]) {
    let width = s.len();
    for start in [width, 5 * width] {
        for (r, v) in rows[start..start + width].iter_mut().zip(s) {
            *r += v;
        }
    }
}
