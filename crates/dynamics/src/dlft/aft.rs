//! Alternating frequency-time evaluation (AFT) of the contact law of one pair, with its exact
//! derivative, which includes the history of slip.
//!
//! The predicted force lambda_u is synthesised at the samples of a period, the law is evaluated
//! there sample after sample, and the contact force is analysed into harmonics. Changes of state
//! between two samples count at their instants (`between_samples`).

use super::between_samples::{self, ByInputs, Passed, PassedDerivative, Visit};
use super::derivative_rows::{DerivativeSignals, fixed_point, own_state, state_columns};
use super::pair_signals::{
    PERIODICITY, PairInput, Passage, Periods, Signals, add_own, compression_n,
};
use super::rounded;
use crate::contact::coulomb::{Contact, SlipTangent};
use crate::contact::{PredictedLaw, State};
use dovetail_numerics::fourier::Fourier;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};

/// Number of periods evaluated one after the other before the periodic state is solved for.
pub const PLAIN_PERIODS: usize = 6;
/// Number of periods after which a force that is still not periodic is given up.
pub const MOST_PERIODS: usize = 40;
/// A pair is where it was a period before when its state has moved by less than this fraction of the
/// largest predicted force, which is rounding.
const SAME: f64 = 4.0 * f64::EPSILON;
/// A pair that shakes down ends at a corner of its cones (one per sample), touching each without
/// sliding: within this fraction of the largest predicted force a sample counts as touching.
const TOUCH: f64 = 1e-8;

/// End of the time evaluation of one pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairEnd {
    /// True if the end of the last period equals its start.
    pub periodic: bool,
    /// True if the pair sticks at every sample since the start: its contact force is its
    /// prediction.
    pub always_stuck: bool,
    /// Number of samples of the last period without contact.
    pub open_samples: usize,
    /// Length of the path of lambda_x over the last period, N (distance slid = this / eps_T).
    pub slid_n: f64,
    /// Integral of the compression |lambda_N| along that path, N2 (force times distance slid = this
    /// / eps_T).
    pub rubbed_n2: f64,
    history: History,
    last: LastPeriod,
}

/// Last period that was evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
struct LastPeriod {
    /// State at its start.
    start: State,
    /// Where the last period was cut short: the state at the start of the period before, and the
    /// distance, N, within which the pair was of where it had been in that one.
    cut: Option<(State, f64)>,
}

/// Periods that the derivative has to go through.
#[derive(Debug, Clone, Copy, PartialEq)]
enum History {
    /// A number of periods from the start, before the last one.
    FromStart(usize),
    /// The same, where the pair does not slide in the last one. Where it touches its cone, the slip at
    /// that sample in a period before has left it there.
    Stuck(usize),
    /// The last period, in which the pair slides and whose fixed point is its start.
    Periodic,
    /// The last period and one before it, as the state was solved for: `slipping` is the start of
    /// the last period that slid (the state is the fixed point of that period).
    FixedPoint { slipping: State, touch_n: f64 },
}

/// Evaluates one pair until its contact force is periodic and writes the coefficients of that force
/// into `lambda` (component-major, 3 x (2H+1)).
pub fn contact_forces(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &mut Signals,
    lambda: &mut [f64],
) -> PairEnd {
    Arch::new().dispatch(Evaluate(fourier, input, signals, lambda))
}

/// [`contact_forces`] with the widest vectors of the processor; the arithmetic is the same. (A
/// closure would be compiled for the least processor, and called.)
struct Evaluate<'a>(&'a Fourier, PairInput<'a>, &'a mut Signals, &'a mut [f64]);

impl WithSimd for Evaluate<'_> {
    type Output = PairEnd;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> PairEnd {
        evaluate_pair(self.0, self.1, self.2, self.3)
    }
}

#[inline(always)]
fn evaluate_pair(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &mut Signals,
    lambda: &mut [f64],
) -> PairEnd {
    let samples = fourier.samples();
    signals.predict(fourier, &input);
    let mut end = PairEnd {
        periodic: false,
        always_stuck: input.rounding.is_none(),
        open_samples: 0,
        slid_n: 0.0,
        rubbed_n2: 0.0,
        history: History::FromStart(0),
        last: LastPeriod {
            start: input.start,
            cut: None,
        },
    };
    if let Some(rounding) = input.rounding {
        end.periodic = rounded::contact_forces(&input, rounding, signals);
        signals.to_frequency(fourier, lambda);
        let normal = signals.lambda[..samples].iter();
        end.open_samples = normal.filter(|n| **n == 0.0).count();
        return end;
    }
    let scale = signals.lambda_u.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut state = first_state(&input, signals);
    end.last.start = state;
    let mut slipping = state;
    let mut slips = false;
    for period in 1..=MOST_PERIODS {
        let before = state;
        // The rest of a period in which the pair is where it was in the one before is known.
        let near_n = match input.periods {
            Periods::UntilPeriodic if period > 1 => Some(SAME * scale),
            _ => None,
        };
        let remembers = period >= PLAIN_PERIODS;
        let passed = one_period(samples, &input, signals, &mut state, near_n, remembers);
        end.last = LastPeriod {
            start: before,
            cut: match passed {
                Period::Whole(_) => None,
                Period::Cut => near_n.map(|near_n| (end.last.start, near_n)),
            },
        };
        slips = signals.passages.iter().any(|passage| passage.slips);
        end.always_stuck &= !slips;
        if slips {
            slipping = before;
        }
        end.periodic = match input.periods {
            Periods::UntilPeriodic => state.distance_n(&before) <= PERIODICITY * scale,
            Periods::Exactly(count) => period >= count.min(PLAIN_PERIODS),
        };
        end.history = if period > PLAIN_PERIODS {
            History::FixedPoint {
                slipping,
                touch_n: TOUCH * scale,
            }
        } else {
            History::FromStart(period - 1)
        };
        if end.periodic {
            break;
        }
        if period >= PLAIN_PERIODS {
            // Newton's step on (state after a period) = (state before it).
            let moved = [0, 1].map(|c| state.slid_n[c] - before.slid_n[c]);
            let step = match passed {
                Period::Whole(Some(memory)) => memory.fixed_point_step(moved),
                _ => moved,
            };
            state.slid_n = [0, 1].map(|c| before.slid_n[c] + step[c]);
        }
    }
    let contacts = signals.contact.iter();
    end.open_samples = contacts.filter(|c| **c == Contact::Open).count();
    if slips {
        [end.slid_n, end.rubbed_n2] = signals.path(end.last.start.slid_n, input.law.shift_n);
    }
    // A pair that shakes down touches its cone without sliding: it keeps where it came from. Of one
    // that slides, the last period that slips is the last one.
    let slides = end.open_samples > 0 || end.slid_n > TOUCH * scale;
    let is_settled = end.periodic && input.periods == Periods::UntilPeriodic;
    if let History::FromStart(before) = end.history
        && is_settled
    {
        if slides {
            end.history = History::Periodic;
        } else if !slips || before > 0 && input.law.rubs() && end.slid_n == 0.0 {
            end.history = History::Stuck(before);
        }
    }
    signals.to_frequency(fourier, lambda);
    if !end.always_stuck && input.periods == Periods::UntilPeriodic {
        correct(fourier, &input, signals, lambda);
    }
    end
}

/// Corrects the coefficients of the force for what the pair does between the samples of the last
/// period.
fn correct(fourier: &Fourier, input: &PairInput<'_>, signals: &Signals, lambda: &mut [f64]) {
    let (samples, width) = (fourier.samples(), fourier.width());
    for n in 0..samples {
        if !signals.turns(n, &input.law) {
            continue;
        }
        let before = signals.before(n);
        let window = signals.window(n, input.law.shift_n);
        let state = signals.state(before, input.law.shift_n);
        let passed = between_samples::pass(&window, state, Some(signals.contact[n]), input.law);
        for (sample, change) in [before, n].into_iter().zip(passed.corrections) {
            for (lambda, change) in lambda.chunks_exact_mut(width).zip(change) {
                if change != 0.0 {
                    between_samples::add_to_coefficients(fourier, sample, change, lambda);
                }
            }
        }
    }
}

/// State in which the time evaluation of a pair begins.
#[inline(always)]
fn first_state(input: &PairInput<'_>, signals: &Signals) -> State {
    if input.law.rubs() {
        return input.start;
    }
    // No force depends on the past: the state is that of the last sample, and one period is periodic.
    let last = signals.prediction(signals.samples() - 1, input.law.shift_n);
    input.law.evaluate(last, input.start).state
}

/// Evaluates one period from `state`, up to where the pair is within `near_n` of where it was in the
/// period before, if that is given. The memory of the period is followed if `remembers` is true.
#[inline(always)]
fn one_period(
    samples: usize,
    input: &PairInput<'_>,
    signals: &mut Signals,
    state: &mut State,
    near_n: Option<f64>,
    remembers: bool,
) -> Period {
    let mut memory = remembers.then_some(Memory::Whole);
    let between = input.periods == Periods::UntilPeriodic;
    for n in 0..samples {
        let was = State {
            contact: signals.contact[n],
            slid_n: signals.passages[n].position_n,
        };
        let mut passage = Passage::default();
        if between && (signals.reverses[n] || signals.lands(n, input.law.shift_n)) {
            let window = signals.window(n, input.law.shift_n);
            let passed = between_samples::pass(&window, *state, None, input.law);
            let mut before_n = compression_n(window[1][0]);
            let [mut slid_n, mut rubbed_n2] = [0.0; 2];
            for visit in passed.visits.iter().flatten() {
                passage.slips |= visit.contact != Contact::Stick;
                slid_n += visit.slid_n;
                let now_n = compression_n(visit.trial[0]);
                rubbed_n2 += 0.5 * (before_n + now_n) * visit.slid_n;
                before_n = now_n;
                memory = memory.map(|memory| memory.after(visit, &input.law));
            }
            passage.path = Some([slid_n, rubbed_n2]);
            *state = passed.state;
            signals.write(n, state.contact, passed.force);
        } else {
            let predicted = signals.prediction(n, input.law.shift_n);
            let now = input.law.evaluate(predicted, *state);
            signals.write(n, now.state.contact, now.force);
            passage.slips = now.state.contact != Contact::Stick;
            memory = memory.map(|memory| match now.state.contact {
                Contact::Stick => memory,
                Contact::Slip => memory.after_slip(input.law.slip_tangent(now.trial)),
                Contact::Open => Memory::Lost,
            });
            *state = now.state;
        }
        passage.position_n = state.slid_n;
        signals.passages[n] = passage;
        let is_near = |near_n: f64| {
            let [t1, t2] = [0, 1].map(|c| state.slid_n[c] - was.slid_n[c]);
            was.contact == state.contact && t1 * t1 + t2 * t2 <= near_n * near_n
        };
        if near_n.is_some_and(is_near) {
            *state = State {
                contact: signals.contact[samples - 1],
                slid_n: signals.passages[samples - 1].position_n,
            };
            return Period::Cut;
        }
    }
    Period::Whole(memory)
}

/// End of the evaluation of one period.
enum Period {
    /// All of it was evaluated; its memory, if that was asked for.
    Whole(Option<Memory>),
    /// It was cut short: the rest is that of the period before.
    Cut,
}

/// Derivative of the state lambda_x after a stretch of samples by the state before it. Each slip
/// maps a change onto the direction across the slide, times kappa: a product of such maps is of
/// rank one.
#[derive(Debug, Clone, Copy)]
enum Memory {
    /// The pair sticks throughout: the identity.
    Whole,
    /// The matrix `factor last first^T`.
    RankOne {
        factor: f64,
        last: [f64; 2],
        first: [f64; 2],
    },
    /// The pair opened: nothing of the earlier state is left.
    Lost,
}

impl Memory {
    /// Memory after an evaluation of the law.
    #[inline(always)]
    fn after(self, visit: &Visit, law: &PredictedLaw) -> Self {
        let memory = if visit.landed { Self::Lost } else { self };
        match visit.contact {
            Contact::Stick => memory,
            Contact::Slip => memory.after_slip(law.slip_tangent(visit.trial)),
            Contact::Open => Self::Lost,
        }
    }

    #[inline(always)]
    fn after_slip(self, tangent: SlipTangent) -> Self {
        let across = [-tangent.direction[1], tangent.direction[0]];
        match self {
            Self::Lost => Self::Lost,
            Self::Whole => Self::RankOne {
                factor: tangent.kappa,
                last: across,
                first: across,
            },
            Self::RankOne {
                factor,
                last,
                first,
            } => {
                let cosine = across[0] * last[0] + across[1] * last[1];
                Self::RankOne {
                    factor: factor * tangent.kappa * cosine,
                    last: across,
                    first,
                }
            }
        }
    }

    /// Computes (I - memory)^-1 r.
    fn fixed_point_step(self, r: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Whole | Self::Lost => r,
            Self::RankOne {
                factor,
                last,
                first,
            } => {
                let rest = 1.0 - factor * (first[0] * last[0] + first[1] * last[1]);
                if rest < 1e-9 {
                    return r;
                }
                let c = factor * (first[0] * r[0] + first[1] * r[1]) / rest;
                [r[0] + c * last[0], r[1] + c * last[1]]
            }
        }
    }
}

/// Writes the signals from which [`contact_force_derivative`] starts, of a pair whose evaluation ended
/// with `end`: those of the last period, or the predictions alone where the pair has come to stick.
pub fn last_period(fourier: &Fourier, input: PairInput<'_>, end: &PairEnd, signals: &mut Signals) {
    Arch::new().dispatch(Repeat(fourier, input, end, signals));
}

/// [`last_period`], compiled as [`Evaluate`].
struct Repeat<'a>(&'a Fourier, PairInput<'a>, &'a PairEnd, &'a mut Signals);

impl WithSimd for Repeat<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(fourier, input, end, signals) = self;
        signals.predict(fourier, &input);
        if let Some(rounding) = input.rounding {
            rounded::contact_forces(&input, rounding, signals);
            return;
        }
        if let History::Stuck(_) = end.history {
            return;
        }
        let mut march = |mut state: State, near_n| {
            one_period(
                fourier.samples(),
                &input,
                signals,
                &mut state,
                near_n,
                false,
            );
        };
        if let Some((before, _)) = end.last.cut {
            march(before, None);
        }
        march(end.last.start, end.last.cut.map(|(_, near_n)| near_n));
    }
}

/// Derivative of the contact force by the coefficients of lambda_u: `derivative` is 3(2H+1) square,
/// row-major, both indices component-major. `signals` are those of [`last_period`], or of
/// [`contact_forces`], and `end` is that of the latter.
pub fn contact_force_derivative(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &Signals,
    end: &PairEnd,
    derivative: &mut [f64],
) {
    Arch::new().dispatch(Differentiate(fourier, input, signals, end, derivative));
}

/// [`contact_force_derivative`], compiled as [`Evaluate`].
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
    if let History::Stuck(before) = end.history {
        let mut pass = Pass::new(fourier, &input, signals);
        for _ in 0..before {
            pass.period(None);
        }
        return write_stuck(width, pass.history.chunks_exact(block), derivative);
    }
    let found = match input.rounding {
        Some(rounding) => rounded::derivative_rows(fourier, &input, rounding, signals),
        None => derivative_signals(fourier, &input, signals, end),
    };
    // The coefficients of those signals: sums with the synthesis, weighted as in the analysis.
    let synthesis =
        MatRef::from_row_major_slice_with_stride(fourier.synthesis(), samples, width, block);
    let mut sums = Mat::zeros(block + 2 * row, width);
    matmul(
        sums.as_mut(),
        Accum::Replace,
        MatRef::from_column_major_slice(&found.signals, block + 2 * row, samples),
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
    for (sample, change) in &found.normal_changes {
        let mut of_sample = vec![0.0; width];
        between_samples::add_to_coefficients(fourier, *sample, 1.0, &mut of_sample);
        for (own, by) in rows.chunks_exact_mut(row).zip(of_sample) {
            add(by, change, own);
        }
    }
    let start = found.end.map(|end| fixed_point(&end, width, block));
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

/// Derivative of the contact force at the samples of the last period.
#[inline(always)]
fn derivative_signals(
    fourier: &Fourier,
    input: &PairInput<'_>,
    signals: &Signals,
    end: &PairEnd,
) -> DerivativeSignals {
    let (samples, width, block) = (fourier.samples(), fourier.width(), fourier.padded_width());
    let mut pass = Pass::new(fourier, input, signals);
    let mut is_fixed_point = false;
    match end.history {
        History::FromStart(before) | History::Stuck(before) => {
            for _ in 0..before {
                pass.period(None);
            }
        }
        History::Periodic => {
            is_fixed_point = true;
            pass.state = end.last.start;
        }
        History::FixedPoint { slipping, touch_n } => {
            pass.law.touch_n = touch_n;
            pass.state = slipping;
            is_fixed_point = slipping == end.last.start;
            if !is_fixed_point {
                pass.history = own_state(width, block);
                pass.period(None);
                pass.history = fixed_point(&pass.history, width, block).concat();
            }
            pass.state = end.last.start;
        }
    }
    if is_fixed_point {
        pass.history = own_state(width, block);
    }
    let mut rows = vec![0.0; 7 * block * samples];
    pass.period(Some(&mut rows));
    DerivativeSignals {
        signals: rows,
        normal_changes: pass.normal_changes,
        end: is_fixed_point.then_some(pass.history),
    }
}

/// Propagation of the derivative of the state along the samples.
struct Pass<'a> {
    fourier: &'a Fourier,
    input: &'a PairInput<'a>,
    signals: &'a Signals,
    /// Law with which the pair goes from sample to sample.
    law: PredictedLaw,
    state: State,
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

    /// Goes through one period. Adds the derivative of the force at each sample to `rows`, if given
    /// ([`DerivativeSignals::signals`]).
    #[inline(always)]
    fn period(&mut self, mut rows: Option<&mut [f64]>) {
        let (samples, block) = (self.fourier.samples(), self.fourier.padded_width());
        let size = 7 * block;
        let between = self.input.periods == Periods::UntilPeriodic;
        let law = self.law;
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
                between && (self.signals.reverses[n] || self.signals.lands(n, law.shift_n));
            let passed = passes.then(|| self.pass_interval(n));
            let passed = passed.filter(|passed| passed.visits.iter().flatten().any(Visit::changes));
            if let Some(passed) = passed {
                self.go_through_interval(n, &passed, walked);
                if let Some((normal, tangential)) = row
                    && passed.state.contact != Contact::Open
                {
                    add_prediction_rows(s, &self.history, normal, tangential);
                }
                continue;
            }
            let now = law.evaluate(self.signals.prediction(n, law.shift_n), self.state);
            self.state = now.state;
            if now.state.contact == Contact::Stick {
                if let Some((normal, tangential)) = row {
                    add_prediction_rows(s, &self.history, normal, tangential);
                }
                continue;
            }
            if now.state.contact == Contact::Slip {
                let tangent = law.slip_tangent(now.trial);
                slip_rows(tangent, s, &self.history, &mut self.force_rows);
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
        self.add_row(n, &derivative.slid_n[0], first);
        self.add_row(n, &derivative.slid_n[1], second);
        self.history = rows;
        self.state = passed.state;
    }

    /// Adds the derivative of the corrections of the interval that ends at sample `n` to the rows of
    /// the samples that are corrected. A pair that touches its cone there without sliding sticks: it
    /// is corrected as one that sticks. Returns the derivative of the interval.
    #[inline(always)]
    fn add_corrections(&mut self, n: usize, rows: &mut [f64]) -> PassedDerivative {
        let law = self.input.law;
        let [before, now] = [self.signals.before(n), n];
        let [contact, at_end] = [before, now].map(|n| self.signals.contact[n]);
        let state = State {
            contact,
            ..self.state
        };
        let window = self.signals.window(n, law.shift_n);
        let derivative = between_samples::derivative(&window, state, Some(at_end), law);
        let block = self.fourier.padded_width();
        for (sample, by) in [before, now].into_iter().zip(&derivative.corrections) {
            let row = &mut rows[7 * block * sample..7 * block * (sample + 1)];
            let (normal, tangential) = row.split_at_mut(block);
            for (at, sample) in self.signals.around(n).into_iter().enumerate() {
                add(by[0][3 * at], self.fourier.padded_row(sample), normal);
            }
            self.add_to_normal(n, sample, &by[0]);
            let (first, second) = tangential.split_at_mut(3 * block);
            self.add_row(n, &by[1], first);
            self.add_row(n, &by[2], second);
        }
        derivative
    }

    /// Keeps the derivative of the normal correction of a sample by the tangential predictions, where a
    /// pair opens or closes in the interval in which it reverses.
    fn add_to_normal(&mut self, n: usize, sample: usize, by: &ByInputs) {
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
    fn add_row(&self, n: usize, by: &ByInputs, row: &mut [f64]) {
        let block = self.fourier.padded_width();
        for (at, sample) in self.signals.around(n).into_iter().enumerate() {
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

/// Derivative where the pair slips: d lambda_T = -mu e S_N + kappa (I - e e^T) (S_T - history).
#[inline(always)]
fn slip_rows(tangent: SlipTangent, s: &[f64], history: &[f64], rows: &mut [f64]) {
    let width = s.len();
    let full = 3 * width;
    let [e1, e2] = tangent.direction;
    // (I - e e^T) = across across^T in the plane: one scalar row serves both components.
    let across = [-e2, e1];
    let k = tangent.kappa;
    let (first, second) = rows.split_at_mut(full);
    let (h1, h2) = history.split_at(full);
    for j in 0..full {
        let v = -k * (across[0] * h1[j] + across[1] * h2[j]);
        first[j] = across[0] * v;
        second[j] = across[1] * v;
    }
    let own = [
        tangent.by_normal,
        across.map(|a| k * across[0] * a),
        across.map(|a| k * across[1] * a),
    ];
    for (column, by) in own.into_iter().enumerate() {
        let start = column * width;
        for (rows, by) in [&mut *first, &mut *second].into_iter().zip(by) {
            add(by, s, &mut rows[start..start + width]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::PairLaw;
    use crate::dlft::pair_signals::Rounding;

    fn force(width: usize, seed: f64) -> Vec<f64> {
        (0..3 * width)
            .map(|i| {
                let base = if i == 0 { -1.0 } else { 0.0 };
                base + 0.8 * (seed + 1.7 * i as f64).sin() / (1 + i % width) as f64
            })
            .collect()
    }

    /// Compares the derivative with central differences of step `h`.
    fn check_derivative(fourier: &Fourier, input: PairInput<'_>, h: f64, what: &str) -> PairEnd {
        let (samples, full) = (fourier.samples(), 3 * fourier.width());
        let mut signals = Signals::new(samples);
        let end = contact_forces(fourier, input, &mut signals, &mut vec![0.0; full]);
        assert!(end.periodic);
        let mut d = vec![0.0; full * full];
        contact_force_derivative(fourier, input, &signals, &end, &mut d);
        for column in 0..full {
            let sides = [h, -h].map(|step| {
                let mut force = input.force.to_vec();
                force[column] += step;
                let mut lambda = vec![0.0; full];
                let moved = PairInput {
                    force: &force,
                    ..input
                };
                contact_forces(fourier, moved, &mut Signals::new(samples), &mut lambda);
                lambda
            });
            for row in 0..full {
                let difference = (sides[0][row] - sides[1][row]) / (2.0 * h);
                let exact = d[row * full + column];
                assert!(
                    (difference - exact).abs() < 1e-4,
                    "{what}: row {row}, column {column}: {exact}, by differences {difference}"
                );
            }
        }
        end
    }

    fn law(friction: f64, gap_m: f64) -> PredictedLaw {
        PairLaw::rigid(friction, gap_m).predicted([1.0; 2], f64::INFINITY)
    }

    fn start(slid_n: [f64; 2]) -> State {
        State {
            contact: Contact::Stick,
            slid_n,
        }
    }

    /// Pair without clearance under this prediction, which has not slid before.
    fn input(force: &[f64]) -> PairInput<'_> {
        PairInput {
            periods: Periods::UntilPeriodic,
            force,
            law: law(0.3, 0.0),
            start: start([0.0; 2]),
            rounding: None,
        }
    }

    /// Pair with an initial clearance, which has slid before.
    fn shifted(force: &[f64]) -> PairInput<'_> {
        PairInput {
            law: law(0.4, 0.05),
            start: start([0.03, -0.02]),
            ..input(force)
        }
    }

    #[test]
    fn derivative_with_slip_history_matches_differences() {
        let fourier = Fourier::new(3, 64);
        let (mut sliding, mut opening, mut solved) = (0, 0, 0);
        for trial in 0..30 {
            let f = force(fourier.width(), trial as f64);
            let end = check_derivative(&fourier, shifted(&f), 1e-7, &format!("trial {trial}"));
            sliding += usize::from(!end.always_stuck);
            opening += usize::from(end.open_samples > 0);
            solved += usize::from(matches!(end.history, History::FixedPoint { .. }));
        }
        assert!(
            sliding > 10 && opening > 5 && solved > 2,
            "{sliding} {opening} {solved}"
        );
    }

    /// Largest error of a coefficient of the contact force with 64 samples, for predictions that
    /// change direction fast. The reference is the same law with 16384 samples and changes of state
    /// at whole samples.
    fn error_of_few_samples(periods: Periods, swing: f64, normal_swing: f64) -> f64 {
        let [few, many] = [64, 16384].map(|samples| Fourier::new(3, samples));
        let mut largest = 0.0_f64;
        for trial in 0..40 {
            let phase = 0.157 * f64::from(trial);
            let mut f = vec![0.0; 21];
            f[0] = -1.0;
            (f[1], f[2]) = (
                normal_swing * (1.3 + phase).cos(),
                normal_swing * (1.3 + phase).sin(),
            );
            (f[8], f[9]) = (swing * phase.cos(), swing * phase.sin());
            (f[12], f[13]) = (
                0.1 * swing * (3.0 * phase).cos(),
                0.1 * swing * (3.0 * phase).sin(),
            );
            let force = |fourier: &Fourier, periods| {
                let input = PairInput {
                    periods,
                    ..input(&f)
                };
                let mut lambda = vec![0.0; 21];
                let mut signals = Signals::new(fourier.samples());
                contact_forces(fourier, input, &mut signals, &mut lambda);
                lambda
            };
            let [found, exact] = [force(&few, periods), force(&many, Periods::Exactly(3))];
            let errors = found.iter().zip(&exact).map(|(a, b)| (a - b).abs());
            largest = errors.fold(largest, f64::max);
        }
        largest
    }

    #[test]
    fn friction_that_reverses_between_two_samples_counts_at_its_instant() {
        // Swings of 10 and of 100 times the limit of friction, with a steady normal force, one that
        // changes, and one that opens the pair.
        for (swing, normal_swing) in [(3.0, 0.0), (30.0, 0.0), (3.0, 0.5), (30.0, 0.5), (3.0, 1.3)]
        {
            let own = error_of_few_samples(Periods::UntilPeriodic, swing, normal_swing);
            let at_samples = error_of_few_samples(Periods::Exactly(3), swing, normal_swing);
            println!(
                "swings of {swing} and {normal_swing}: {own:.1e}, at samples {at_samples:.1e}"
            );
            assert!(own < 2e-3, "{swing} {normal_swing}: {own}, {at_samples}");
            if normal_swing < 1.0 {
                assert!(own < 0.4 * at_samples, "{swing}: {own}, {at_samples}");
            }
        }
    }

    #[test]
    fn a_period_that_is_cut_short_ends_as_a_whole_one() {
        let fourier = Fourier::new(3, 64);
        let mut slid = 0;
        for trial in 0..30 {
            let f = force(fourier.width(), trial as f64);
            let input = shifted(&f);
            let mut signals = Signals::new(64);
            let mut lambda = vec![0.0; f.len()];
            let end = contact_forces(&fourier, input, &mut signals, &mut lambda);
            // Once more from where it ends, to its end.
            let mut state = State {
                contact: signals.contact[63],
                slid_n: signals.passages[63].position_n,
            };
            let start_n = state.slid_n;
            let mut whole = Signals::new(64);
            whole.lambda_u.copy_from_slice(&signals.lambda_u);
            whole.reverses.copy_from_slice(&signals.reverses);
            let passed = one_period(64, &input, &mut whole, &mut state, None, true);
            assert!(matches!(passed, Period::Whole(Some(_))));
            assert_eq!(whole.contact, signals.contact);
            for (a, b) in whole.lambda.iter().zip(&signals.lambda) {
                assert!((a - b).abs() < 1e-10, "trial {trial}: {a} {b}");
            }
            let [path, _] = whole.path(start_n, input.law.shift_n);
            assert!((path - end.slid_n).abs() < 1e-9, "{path} {}", end.slid_n);
            slid += usize::from(path > 0.1);
        }
        assert!(slid > 10, "{slid}");
    }

    #[test]
    fn the_last_period_is_repeated_to_the_same_bits() {
        let fourier = Fourier::new(3, 64);
        let (mut cut, mut whole) = (0, 0);
        let mut again = Signals::new(64);
        for trial in 0..40 {
            let f = force(fourier.width(), trial as f64);
            for periods in [Periods::UntilPeriodic, Periods::Exactly(3)] {
                let input = PairInput {
                    periods,
                    ..shifted(&f)
                };
                let mut signals = Signals::new(64);
                let end = contact_forces(&fourier, input, &mut signals, &mut vec![0.0; f.len()]);
                if matches!(end.history, History::Stuck(_)) {
                    continue;
                }
                last_period(&fourier, input, &end, &mut again);
                assert_eq!(again.lambda, signals.lambda, "trial {trial}");
                assert_eq!(again.contact, signals.contact, "trial {trial}");
                cut += usize::from(end.last.cut.is_some());
                whole += usize::from(end.last.cut.is_none());
            }
        }
        assert!(cut > 10 && whole > 10, "{cut} {whole}");
    }

    #[test]
    fn derivative_of_a_rounded_law_matches_differences() {
        let fourier = Fourier::new(3, 64);
        for trial in 0..10 {
            for (sharpness, width_n) in [(2.0, 0.0), (8.0, 0.0), (2.0, 1.0), (8.0, 0.1)] {
                let f = force(fourier.width(), trial as f64);
                let input = PairInput {
                    rounding: Some(Rounding { sharpness, width_n }),
                    ..shifted(&f)
                };
                let what = format!("trial {trial}, {sharpness}, {width_n}");
                check_derivative(&fourier, input, 1e-6, &what);
            }
        }
    }

    #[test]
    fn derivative_of_a_pair_that_shakes_down_between_two_cones_matches_differences() {
        let fourier = Fourier::new(1, 64);
        let mut shaken = 0;
        let mut came_to_stick = 0;
        for trial in 0..40 {
            let angle = trial as f64;
            // N, t1, t2: steady compression, an elliptic tangential force within the cone's size.
            let f = [-1.0, 0.02, 0.01, 0.0, 0.2, 0.05, 0.0, 0.03, 0.16];
            let input = PairInput {
                law: law(0.25, 0.0),
                start: start([0.3 * angle.cos(), 0.3 * angle.sin()]),
                ..input(&f)
            };
            let end = check_derivative(&fourier, input, 1e-6, &format!("trial {trial}"));
            let fixed = matches!(end.history, History::FixedPoint { .. });
            shaken += usize::from(fixed && end.slid_n < 1e-8);
            came_to_stick += usize::from(matches!(end.history, History::Stuck(1..)));
        }
        assert!(shaken > 2, "{shaken}");
        assert!(came_to_stick > 2, "{came_to_stick}");
    }

    #[test]
    fn a_pair_inside_its_cone_returns_its_prediction_and_an_identity_derivative() {
        let fourier = Fourier::new(2, 32);
        let full = 3 * fourier.width();
        let mut f = vec![0.0; full];
        f[0] = -10.0;
        f[6] = 0.5;
        let mut signals = Signals::new(32);
        let mut lambda = vec![0.0; full];
        let end = contact_forces(&fourier, input(&f), &mut signals, &mut lambda);
        assert!(end.always_stuck && end.periodic && end.history == History::Stuck(0));
        let mut d = vec![0.0; full * full];
        contact_force_derivative(&fourier, input(&f), &signals, &end, &mut d);
        for i in 0..full {
            assert!((lambda[i] - f[i]).abs() < 1e-14);
            for j in 0..full {
                let identity = f64::from(u8::from(i == j));
                assert!((d[i * full + j] - identity).abs() < 1e-14);
            }
        }
    }
}
