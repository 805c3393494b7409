//! Alternating frequency-time evaluation (AFT) of the contact law of one pair. `memory` follows the
//! influence of an earlier state. `derivative` is the exact derivative, which includes the history of
//! slip.
//!
//! The predicted force lambda_u is synthesised at the samples of a period, the law is evaluated
//! there sample after sample, and the contact force is analysed into harmonics. Changes of state
//! between two samples count at their instants (`between_samples`).

use super::between_samples;
use super::pair_signals::{PERIODICITY, PairInput, Passage, Periods, Signals, compression_n};
use super::rounded;
use crate::contact::PairState;
use crate::contact::coulomb::Contact;
use dovetail_numerics::fourier::Fourier;
use pulp::{Arch, Simd, WithSimd};

mod derivative;
mod memory;
#[cfg(test)]
mod tests;

pub(crate) use derivative::contact_force_derivative;

use memory::Memory;

/// Number of periods evaluated one after the other before the periodic state is solved for.
pub(crate) const PLAIN_PERIODS: usize = 6;
/// Number of periods after which a force that is still not periodic is given up.
pub(crate) const MOST_PERIODS: usize = 40;
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
    start: PairState,
    /// Where the last period was cut short: the state at the start of the period before, and the
    /// distance, N, within which the pair was of where it had been in that one.
    cut: Option<(PairState, f64)>,
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
    FixedPoint { slipping: PairState, touch_n: f64 },
}

impl PairEnd {
    /// State at the start of the last period.
    pub(crate) fn period_start(&self) -> &PairState {
        &self.last.start
    }

    /// State at the start of the last period of a pair that slides in it, whose force does not depend
    /// on the periods before.
    pub(crate) fn slides_from(&self) -> Option<PairState> {
        match self.history {
            History::Periodic | History::FixedPoint { .. } => Some(self.last.start),
            History::FromStart(_) | History::Stuck(_) => None,
        }
    }
}

/// Evaluates one pair until its contact force is periodic and writes the coefficients of that force
/// into `lambda` (component-major, 3 x (2H+1)).
pub(crate) fn contact_forces(
    fourier: &Fourier,
    input: PairInput<'_>,
    signals: &mut Signals,
    lambda: &mut [f64],
) -> PairEnd {
    Arch::new().dispatch(Evaluate(fourier, input, signals, lambda))
}

/// [`contact_forces`] of a pair that is known to slide from `near` at the start of its period with
/// other samples or other harmonics. Its periodic state is solved for from there. A pair that turns out
/// not to slide keeps what it went through from the start.
pub(crate) fn contact_forces_near(
    fourier: &Fourier,
    input: PairInput<'_>,
    near: PairState,
    signals: &mut Signals,
    lambda: &mut [f64],
) -> PairEnd {
    let from_near = PairInput {
        start: near,
        plain_periods: 1,
        ..input
    };
    let end = contact_forces(fourier, from_near, signals, lambda);
    if end.periodic && (end.open_samples > 0 || end.slid_n > 0.0) {
        return end;
    }
    contact_forces(fourier, input, signals, lambda)
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
        let remembers = period >= input.plain_periods;
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
        end.history = if period > input.plain_periods {
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
        if period >= input.plain_periods {
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
        } else if !slips || before > 0 && input.law.has_friction() && end.slid_n == 0.0 {
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
        let before = signals.previous(n);
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
fn first_state(input: &PairInput<'_>, signals: &Signals) -> PairState {
    if input.law.has_friction() {
        return input.start;
    }
    // No force depends on the past: the state is that of the last sample, and one period is periodic.
    let last = signals.prediction(signals.samples() - 1, input.law.shift_n);
    input.law.evaluate(last, || None, input.start).state
}

/// Evaluates one period from `state`, up to where the pair is within `near_n` of where it was in the
/// period before, if that is given. The memory of the period is followed if `remembers` is true.
#[inline(always)]
fn one_period(
    samples: usize,
    input: &PairInput<'_>,
    signals: &mut Signals,
    state: &mut PairState,
    near_n: Option<f64>,
    remembers: bool,
) -> Period {
    let mut memory = remembers.then_some(Memory::Whole);
    let between = input.periods == Periods::UntilPeriodic;
    for n in 0..samples {
        let was = PairState {
            contact: signals.contact[n],
            slid_n: signals.passages[n].position_n,
        };
        let mut passage = Passage::default();
        if between && (signals.reverses[n] || signals.closes(n, input.law.shift_n)) {
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
                memory = memory.map(|memory| memory.updated(visit, &input.law));
            }
            passage.path = Some([slid_n, rubbed_n2]);
            *state = passed.state;
            signals.write(n, state.contact, passed.force);
        } else {
            let predicted = signals.prediction(n, input.law.shift_n);
            let rate = || between.then(|| signals.rate(n));
            let now = input.law.evaluate(predicted, rate, *state);
            signals.write(n, now.state.contact, now.force);
            passage.slips = now.state.contact != Contact::Stick;
            memory = memory.map(|memory| match now.state.contact {
                Contact::Stick => memory,
                Contact::Slip => memory.updated_by_slip(
                    input
                        .law
                        .slip_tangent(now.trial, between.then(|| signals.rate(n))),
                ),
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
            *state = PairState {
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

/// Writes the signals from which [`contact_force_derivative`] starts, of a pair whose evaluation ended
/// with `end`: those of the last period, or the predictions alone where the pair has come to stick.
pub(crate) fn last_period(
    fourier: &Fourier,
    input: PairInput<'_>,
    end: &PairEnd,
    signals: &mut Signals,
) {
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
        let mut march = |mut state: PairState, near_n| {
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
