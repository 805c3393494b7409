//! Exact derivative of the contact force of one pair by its prediction, with the history of slip.

use super::{History, PairEnd};
use crate::contact::coulomb::{Contact, SlipTangent};
use crate::contact::{PairState, PredictedLaw};
use crate::dlft::between_samples::{self, InputDerivatives, Passed, PassedDerivative, Visit};
use crate::dlft::derivative_rows::{DerivativeSignals, fixed_point, identity_state, state_columns};
use crate::dlft::pair_signals::{PairInput, Periods, Signals, add_own};
use crate::dlft::rounded;
use dovetail_numerics::fourier::Fourier;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};

/// Derivative of the contact force by the coefficients of lambda_u: `derivative` is 3(2H+1) square,
/// row-major, both indices component-major. `signals` are those of
/// [`last_period`](super::last_period), or of [`contact_forces`](super::contact_forces), and `end` is
/// that of the latter.
pub(crate) fn contact_force_derivative(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &Signals,
    end: &PairEnd,
    derivative: &mut [f64],
) {
    Arch::new().dispatch(Differentiate(fourier, input, signals, end, derivative));
}

/// [`contact_force_derivative`], compiled as the evaluation is.
struct Differentiate<'a>(
    &'a Fourier,
    PairInput<'a>,
    &'a Signals,
    &'a PairEnd,
    &'a mut [f64],
);

impl WithSimd for Differentiate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        differentiate_pair(self.0, self.1, self.2, self.3, self.4);
    }
}

#[inline(always)]
fn differentiate_pair(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &Signals,
    end: &PairEnd,
    derivative: &mut [f64],
) {
    let (samples, width, block) = (fourier.samples(), fourier.width(), fourier.padded_width());
    let row = 3 * block;
    let found_rows = match input.rounding {
        Some(rounding) => rounded::derivative_rows(fourier, &input, rounding, signals),
        None => {
            let mut pass = Pass::new(fourier, &input, signals);
            let pass_rows = pass.periods(end);
            if let History::Stuck(_) = end.history {
                return write_stuck(width, pass.history.chunks_exact(block), derivative);
            }
            pass_rows
        }
    };
    // The coefficients of those signals: sums with the synthesis, weighted as in the analysis.
    let synthesis =
        MatRef::from_row_major_slice_with_stride(fourier.synthesis(), samples, width, block);
    let mut sums = Mat::zeros(block + 2 * row, width);
    matmul(
        sums.as_mut(),
        Accum::Replace,
        MatRef::from_column_major_slice(&found_rows.signals, block + 2 * row, samples),
        synthesis,
        1.0 / samples as f64,
        Par::Seq,
    );
    // Rows of all columns, component-major as the derivative.
    let mut rows = vec![0.0; 3 * width * row];
    for h in 0..width {
        let weight = if h == 0 { 1.0 } else { 2.0 };
        let (normal, tangential) = sums.col_as_slice(h).split_at(block);
        let parts = [normal].into_iter().chain(tangential.chunks_exact(row));
        for (c, part) in parts.enumerate() {
            let row = rows[(c * width + h) * row..].iter_mut();
            row.zip(part).for_each(|(d, v)| *d = weight * v);
        }
    }
    for (sample, change) in &found_rows.normal_changes {
        let mut of_sample = vec![0.0; width];
        between_samples::add_to_coefficients(fourier, *sample, 1.0, &mut of_sample);
        for (own, by) in rows.chunks_exact_mut(row).zip(of_sample) {
            add(by, change, own);
        }
    }
    let start = found_rows.end.map(|end| fixed_point(&end, width, block));
    for (out, row) in derivative
        .chunks_exact_mut(3 * width)
        .zip(rows.chunks_exact_mut(row))
    {
        if let Some([first, second]) = &start {
            let [by_first, by_second] = state_columns(width, block).map(|column| row[column]);
            for (d, (a, b)) in row.iter_mut().zip(first.iter().zip(second)) {
                *d += by_first * a + by_second * b;
            }
        }
        for (out, part) in out.chunks_exact_mut(width).zip(row.chunks_exact(block)) {
            out.copy_from_slice(&part[..width]);
        }
    }
}

/// Writes the derivative of the force of a pair that sticks throughout the last period: that of the
/// prediction, less that of where the pair sticks, `history`, six blocks.
fn write_stuck<'h>(
    width: usize,
    mut history: impl Iterator<Item = &'h [f64]>,
    derivative: &mut [f64],
) {
    let full = 3 * width;
    derivative.fill(0.0);
    (0..full).for_each(|i| derivative[i * full + i] = 1.0);
    // The mean of the first and of the second tangential force.
    for row in [width, 2 * width] {
        for out in derivative[row * full..][..full].chunks_exact_mut(width) {
            let block = history.by_ref().next().into_iter().flatten();
            out.iter_mut().zip(block).for_each(|(d, h)| *d -= h);
        }
    }
}

/// Propagation of the derivative of the state along the samples.
struct Pass<'a> {
    fourier: &'a Fourier,
    input: &'a PairInput<'a>,
    signals: &'a Signals,
    /// Law with which the pair goes from sample to sample.
    law: PredictedLaw,
    state: PairState,
    /// Derivative of lambda_x, two rows ([`DerivativeSignals`]).
    history: Vec<f64>,
    force_rows: Vec<f64>,
    /// Derivatives of the normal force at samples by the tangential predictions, a row each.
    normal_changes: Vec<(usize, Vec<f64>)>,
}

impl<'a> Pass<'a> {
    /// Pass that begins where the time evaluation does.
    fn new(fourier: &'a Fourier, input: &'a PairInput<'a>, signals: &'a Signals) -> Self {
        let row = 3 * fourier.padded_width();
        Self {
            fourier,
            input,
            signals,
            law: input.law,
            state: input.start,
            history: vec![0.0; 2 * row],
            force_rows: vec![0.0; 2 * row],
            normal_changes: Vec::new(),
        }
    }

    /// Goes through the periods of a pair whose evaluation ended with `end`. The derivative of the
    /// force at the samples of the last one is empty if the pair has come to stick.
    #[inline(always)]
    fn periods(&mut self, end: &PairEnd) -> DerivativeSignals {
        let (samples, width) = (self.fourier.samples(), self.fourier.width());
        let block = self.fourier.padded_width();
        let (before, is_fixed_point) = match end.history {
            History::FromStart(before) | History::Stuck(before) => (before, false),
            History::Periodic => (0, true),
            History::FixedPoint { slipping, touch_n } => {
                self.law.touch_n = touch_n;
                self.state = slipping;
                self.history = identity_state(width, block);
                let slips_last = slipping == end.last.start;
                (usize::from(!slips_last), slips_last)
            }
        };
        let mut rows = Vec::new();
        // One place for all periods: the code of a period is inlined there.
        for period in 0..=before {
            let is_last = period == before;
            if is_last {
                match end.history {
                    History::Stuck(_) => break,
                    History::FromStart(_) => {}
                    History::Periodic | History::FixedPoint { .. } => {
                        self.history = match is_fixed_point {
                            true => identity_state(width, block),
                            false => fixed_point(&self.history, width, block).concat(),
                        };
                        self.state = end.last.start;
                    }
                }
                rows = vec![0.0; 7 * block * samples];
            }
            self.period(is_last.then_some(&mut rows));
        }
        DerivativeSignals {
            signals: rows,
            normal_changes: std::mem::take(&mut self.normal_changes),
            end: is_fixed_point.then(|| std::mem::take(&mut self.history)),
        }
    }

    /// Goes through one period. Adds the derivative of the force at each sample to `rows`, if given
    /// ([`DerivativeSignals::signals`]).
    #[inline(always)]
    fn period(&mut self, mut rows: Option<&mut [f64]>) {
        let (samples, block) = (self.fourier.samples(), self.fourier.padded_width());
        let size = 7 * block;
        let between = self.input.periods == Periods::UntilPeriodic;
        let (law, signals) = (self.law, self.signals);
        let rate = |n: usize| between.then(|| signals.rate(n));
        for n in 0..samples {
            let s = self.fourier.padded_row(n);
            let turns = between && self.signals.turns(n, &self.input.law);
            let mut walked = None;
            let mut row = None;
            if let Some(rows) = rows.as_deref_mut() {
                if turns {
                    walked = Some(self.add_corrections(n, rows));
                }
                row = Some(rows[n * size..][..size].split_at_mut(block));
            }
            let passes =
                between && (self.signals.reverses[n] || self.signals.closes(n, law.shift_n));
            let passed = passes.then(|| self.pass_interval(n));
            let passed = passed.filter(|passed| passed.visits.iter().flatten().any(Visit::changes));
            if let Some(passed) = &passed {
                self.go_through_interval(n, passed, walked);
            }
            let (contact, instant) = match passed {
                Some(passed) => (passed.state.contact, None),
                None => {
                    let predicted = self.signals.prediction(n, law.shift_n);
                    let now = law.evaluate(predicted, || rate(n), self.state);
                    self.state = now.state;
                    (now.state.contact, Some(now))
                }
            };
            let follows = match instant {
                Some(_) => contact == Contact::Stick,
                None => contact != Contact::Open,
            };
            if follows && let Some((normal, tangential)) = &mut row {
                add_prediction_rows(s, &self.history, normal, tangential);
            }
            let Some(instant) = instant.filter(|_| !follows) else {
                continue;
            };
            if contact == Contact::Slip {
                let tangent = law.slip_tangent(instant.trial, rate(n));
                let [before, after] = [self.signals.previous(n), self.signals.next(n)]
                    .map(|n| self.fourier.padded_row(n));
                let rows = [s, before, after];
                slip_rows(tangent, rows, &self.history, &mut self.force_rows);
                if let Some((normal, tangential)) = row {
                    add(1.0, s, normal);
                    add(1.0, &self.force_rows, tangential);
                }
            } else {
                self.force_rows.fill(0.0);
            }
            // history = S_T - d lambda_T
            for (history, force) in self.history.iter_mut().zip(&self.force_rows) {
                *history = -force;
            }
            add_own(s, &mut self.history);
        }
    }

    /// Passes the interval that ends at sample `n`.
    fn pass_interval(&self, n: usize) -> Passed<f64> {
        let window = self.signals.window(n, self.law.shift_n);
        between_samples::pass(&window, self.state, None, self.law)
    }

    /// Goes on to sample `n`, with the derivative of what happens before it. That of its corrections,
    /// where it is known, serves unless touching counts as slipping.
    #[inline(always)]
    fn go_through_interval(
        &mut self,
        n: usize,
        passed: &Passed<f64>,
        walked: Option<PassedDerivative>,
    ) {
        let walked = walked.filter(|_| self.law == self.input.law);
        let derivative = walked.unwrap_or_else(|| {
            let window = self.signals.window(n, self.law.shift_n);
            between_samples::derivative(&window, self.state, None, self.law)
        });
        let mut rows = vec![0.0; self.history.len()];
        let (first, second) = rows.split_at_mut(3 * self.fourier.padded_width());
        for (row, by) in [first, second].into_iter().zip(&derivative.slid_n) {
            self.add_row(n, by, row);
        }
        self.history = rows;
        self.state = passed.state;
    }

    /// Adds the derivative of the corrections of the interval that ends at sample `n` to the rows of
    /// the samples that are corrected. A pair that touches its cone there without sliding sticks: it
    /// is corrected as one that sticks. Returns the derivative of the interval.
    #[inline(always)]
    fn add_corrections(&mut self, n: usize, rows: &mut [f64]) -> PassedDerivative {
        let law = self.input.law;
        let [before, now] = [self.signals.previous(n), n];
        let [contact, at_end] = [before, now].map(|n| self.signals.contact[n]);
        let state = PairState {
            contact,
            ..self.state
        };
        let window = self.signals.window(n, law.shift_n);
        let derivative = between_samples::derivative(&window, state, Some(at_end), law);
        let block = self.fourier.padded_width();
        for (sample, by) in [before, now].into_iter().zip(&derivative.corrections) {
            let row = &mut rows[7 * block * sample..7 * block * (sample + 1)];
            let (normal, tangential) = row.split_at_mut(block);
            for (at, sample) in self.signals.neighbourhood(n).into_iter().enumerate() {
                add(by[0][3 * at], self.fourier.padded_row(sample), normal);
            }
            self.add_to_normal(n, sample, &by[0]);
            let (first, second) = tangential.split_at_mut(3 * block);
            for (row, by) in [first, second].into_iter().zip(&by[1..]) {
                self.add_row(n, by, row);
            }
        }
        derivative
    }

    /// Keeps the derivative of the normal correction of a sample by the tangential predictions, where a
    /// pair opens or closes in the interval in which it reverses.
    fn add_to_normal(&mut self, n: usize, sample: usize, by: &InputDerivatives) {
        let mut tangential = *by;
        (0..4).for_each(|at| tangential[3 * at] = 0.0);
        if tangential.iter().any(|v| *v != 0.0) {
            let mut row = vec![0.0; 3 * self.fourier.padded_width()];
            self.add_row(n, &tangential, &mut row);
            self.normal_changes.push((sample, row));
        }
    }

    /// Adds to a row a derivative by the window of the interval that ends at sample `n`, and by the
    /// state before it.
    #[inline(always)]
    fn add_row(&self, n: usize, by: &InputDerivatives, row: &mut [f64]) {
        let block = self.fourier.padded_width();
        for (at, sample) in self.signals.neighbourhood(n).into_iter().enumerate() {
            let s = self.fourier.padded_row(sample);
            for (c, own) in row.chunks_exact_mut(block).enumerate() {
                add(by[3 * at + c], s, own);
            }
        }
        let (first, second) = self.history.split_at(3 * block);
        add(by[12], first, row);
        add(by[13], second, row);
    }
}

/// Adds a multiple of a row to another.
#[inline(always)]
fn add(by: f64, from: &[f64], to: &mut [f64]) {
    for (to, v) in to.iter_mut().zip(from) {
        *to += by * v;
    }
}

/// Adds the derivative where the force is the prediction: S_N, and S_T - history.
#[inline(always)]
fn add_prediction_rows(s: &[f64], history: &[f64], normal: &mut [f64], tangential: &mut [f64]) {
    add(1.0, s, normal);
    add(-1.0, history, tangential);
    add_own(s, tangential);
}

/// Derivative where the pair slips ([`SlipTangent`]), of the trial force S_T - history and its rate.
/// The rows of the synthesis are those of the sample, of the one before it and of the one after.
#[inline(always)]
fn slip_rows(
    tangent: SlipTangent,
    [s, before, after]: [&[f64]; 3],
    history: &[f64],
    rows: &mut [f64],
) {
    let width = s.len();
    let full = 3 * width;
    let (first, second) = rows.split_at_mut(full);
    let (h1, h2) = history.split_at(full);
    let [g1, g2] = tangent.by_trial;
    // The part across the force, one row for both components.
    for (across, (h1, h2)) in first.iter_mut().zip(h1.iter().zip(h2)) {
        *across = -(g1 * h1 + g2 * h2);
    }
    let blocks = first[width..].chunks_exact_mut(width);
    for (c, block) in blocks.enumerate() {
        let (by_trial, half) = (tangent.by_trial[c], 0.5 * tangent.by_rate[c]);
        let rates = after.iter().zip(before);
        for (across, (s, (after, before))) in block.iter_mut().zip(s.iter().zip(rates)) {
            *across += by_trial * s + half * (after - before);
        }
    }
    let [a1, a2] = tangent.across;
    for (first, second) in first.iter_mut().zip(second.iter_mut()) {
        let across = *first;
        (*first, *second) = (a1 * across, a2 * across);
    }
    for (rows, by) in [first, second].into_iter().zip(tangent.by_normal) {
        add(by, s, &mut rows[..width]);
    }
}
