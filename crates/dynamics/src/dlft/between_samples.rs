//! A contact pair between two samples of a period: the instants at which it begins to slip,
//! reverses, opens and closes, and what they add to the coefficients of its force.
//!
//! The predicted force lambda_u is known at the samples, and the trapezoidal rule over them is
//! exact for it. The contact force has corners between the samples. It is followed here from corner
//! to corner, and its integral over the interval replaces that of the rule. Without this, friction
//! would reverse at whole samples only, and the motion would lock to them.
//!
//! All of it is written for real numbers and for numbers with derivatives alike, and is inlined into
//! functions that use the vectors of the processor.

use crate::contact::coulomb::Contact;
use crate::contact::{PairState, PredictedLaw};
use dovetail_numerics::dual::{Dual, Real, three, two};
use dovetail_numerics::fourier::Fourier;
use pulp::{Arch, Simd, WithSimd};

/// Predicted forces (N with the clearance, t1, t2) at four samples, N: those two at the ends of the
/// interval in the middle.
pub(crate) type Window<D> = [[D; 3]; 4];

/// Evaluation of the law at one place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Visit {
    /// True if the pair was open before and has closed on the way.
    pub landed: bool,
    /// Status of the pair.
    pub contact: Contact,
    /// Trial force, N.
    pub trial: [f64; 3],
    /// Rate of its tangential part, N per step, where the law depends on it.
    pub rate: Option<[f64; 2]>,
    /// Distance slid since the last evaluation, as a force, N.
    pub slid_n: f64,
}

/// State and force of a pair after an interval.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Passed<D> {
    /// State at the end.
    pub state: PairState<D>,
    /// Contact force at the end, N.
    pub force: [D; 3],
    /// Corrections of the samples at the beginning and at the end, N, with which the trapezoidal
    /// rule gives the integral of the force over the interval.
    pub corrections: [[D; 3]; 2],
    /// Law where the pair reverses, if it does, and at the end.
    pub visits: [Option<Visit>; 2],
}

impl Visit {
    /// Returns `true` if the pair has slid, opened or closed.
    pub(crate) fn changes(&self) -> bool {
        self.landed || self.contact != Contact::Stick
    }
}

/// Rates of the prediction at both ends of the interval, by central differences, N per interval.
#[inline(always)]
fn rates<D: Real>(window: &Window<D>) -> [[D; 3]; 2] {
    two(|i| three(|c| (window[i + 2][c] - window[i][c]) * 0.5))
}

/// Fraction of the interval at which the tangential prediction is slowest, where that is inside,
/// with rates that are linear in time. On a straight line the prediction reverses there.
#[inline(always)]
fn reversal<D: Real>([first, last]: [[D; 3]; 2]) -> Option<D> {
    let change = [last[1] - first[1], last[2] - first[2]];
    let along = |r: [D; 3]| r[1] * change[0] + r[2] * change[1];
    let (before, after) = (along(first), along(last));
    (before.re() < 0.0 && after.re() > 0.0).then(|| -before / (after - before))
}

/// Cosine of the angle between two tangential rates, or 0 where they point away from each other.
#[inline(always)]
fn same_direction<D: Real>([first, last]: [[D; 3]; 2]) -> D {
    let dot = |a: [D; 3], b: [D; 3]| a[1] * b[1] + a[2] * b[2];
    let along = dot(first, last);
    if along.re() <= 0.0 {
        return D::from(0.0);
    }
    along / (dot(first, first) * dot(last, last)).sqrt()
}

/// Returns `true` if the tangential prediction reverses inside the interval.
#[inline(always)]
pub(crate) fn reverses(window: [[f64; 2]; 4]) -> bool {
    let [first, last] = [1, 2].map(|n| [0, 1].map(|c| window[n + 1][c] - window[n - 1][c]));
    let change = [last[0] - first[0], last[1] - first[1]];
    let along = |r: [f64; 2]| r[0] * change[0] + r[1] * change[1];
    along(first) < 0.0 && along(last) > 0.0
}

/// Takes a pair from the second sample of the window to the third. `state` is that at the
/// beginning. `at_end` is the status of the pair at the end, where it is known: a pair that touches
/// its cone there may stick or slip by rounding, and the next interval must start from the same
/// status.
#[inline(always)]
pub(crate) fn pass<D: Real>(
    window: &Window<D>,
    state: PairState<D>,
    at_end: Option<Contact>,
    law: PredictedLaw,
) -> Passed<D> {
    let [_, from, to, _] = *window;
    let zero = D::from(0.0);
    let (contact, force) = if from[0].re() >= 0.0 {
        (Contact::Open, [zero; 3])
    } else {
        (state.contact, state.trial_force(from))
    };
    let mut walk = Walk {
        law,
        at: zero,
        predicted: from,
        state: PairState { contact, ..state },
        force,
        path: Path::new(),
    };
    let end = D::from(1.0);
    let [first, last] = rates(window);
    let turn = reversal([first, last]).filter(|_| law.has_friction());
    let mut visits = [None; 2];
    let mut at_turn = None;
    for (part, visit) in visits.iter_mut().enumerate() {
        let (at, there, rates) = match (turn, part) {
            (None, 0) => continue,
            (None, _) => (end, to, [first, last]),
            (Some(at), part) => {
                let slowest = three(|c| first[c] + (last[c] - first[c]) * at);
                match part {
                    0 => {
                        let there = three(|c| {
                            let curve = (last[c] - first[c]) * (-at + 1.0) * 0.5;
                            from[c] + (to[c] - from[c] - curve) * at
                        });
                        (at, there, [first, slowest])
                    }
                    _ => (end, to, [slowest, last]),
                }
            }
        };
        *visit = Some(walk.go_to(at, there, rates));
        if part == 0 {
            at_turn = Some((at, walk.force));
        }
    }
    let all_slips = |of: &Option<Visit>| of.is_none_or(|visit| visit.contact == Contact::Slip);
    if let Some((at, there)) = at_turn
        && contact == Contact::Slip
        && visits.iter().all(all_slips)
    {
        let bend = three(|c| there[c] - force[c] - (walk.force[c] - force[c]) * at);
        walk.path
            .straighten(at, bend, same_direction([first, last]));
    }
    let ends = [
        End {
            contact,
            force,
            rate: first,
        },
        End {
            contact: at_end.unwrap_or(walk.state.contact),
            force: walk.force,
            rate: last,
        },
    ];
    Passed {
        state: walk.state,
        force: walk.force,
        corrections: walk.path.corrections(ends),
        visits,
    }
}

/// Progress of a pair through an interval.
struct Walk<D> {
    law: PredictedLaw,
    /// Fraction of the interval.
    at: D,
    predicted: [D; 3],
    state: PairState<D>,
    /// Contact force, N.
    force: [D; 3],
    path: Path<D>,
}

/// Part of an interval on which the prediction goes from one place to another, at rates that are
/// linear in time. Times are fractions of the stretch, ways fractions of the way of T.
struct Stretch<D> {
    begin: D,
    length: D,
    from: [D; 3],
    step: [D; 3],
    /// The prediction is `from` + `step` t + `curve` (t^2 - t).
    curve: [D; 3],
    /// Rates of the prediction at the ends.
    rates: [[D; 3]; 2],
    /// Coefficient b of the way along the line from end to end, (1 - b) t + b t^2.
    bend: D,
}

impl<D: Real> Stretch<D> {
    /// Stretch with the rates of the prediction at its beginning and at its end.
    #[inline(always)]
    fn new([begin, end]: [D; 2], from: [D; 3], to: [D; 3], rates: [[D; 3]; 2]) -> Self {
        let step = three(|c| to[c] - from[c]);
        let [first, last] = two(|i| positive(rates[i][1] * step[1] + rates[i][2] * step[2]));
        let sum = first + last;
        let length = end - begin;
        Self {
            begin,
            length,
            from,
            step,
            rates,
            curve: three(|c| (rates[1][c] - rates[0][c]) * length * 0.5),
            bend: if sum.re() > 0.0 {
                (last - first) / sum
            } else {
                D::from(0.0)
            },
        }
    }
    /// Fraction of the interval at a time of the stretch.
    #[inline(always)]
    fn fraction(&self, time: D) -> D {
        self.begin + self.length * time
    }
    #[inline(always)]
    fn friction_way(&self, time: D) -> D {
        time * (-self.bend + 1.0) + time * time * self.bend
    }
    #[inline(always)]
    fn time(&self, way: D) -> D {
        let start = -self.bend + 1.0;
        let under = start * start + self.bend * way * 4.0;
        // The square root has no derivative at 0.
        if way.re() <= 0.0 || under.re() <= 1e-14 {
            return way;
        }
        way * 2.0 / (start + under.sqrt())
    }
    #[inline(always)]
    fn tangential(&self, way: D) -> [D; 2] {
        two(|c| self.from[c + 1] + self.step[c + 1] * way)
    }
    /// Integral and first moment over the interval of component `c` of the prediction minus
    /// `offset`, between two times.
    #[inline(always)]
    fn integrals(&self, c: usize, offset: D, [begin, end]: [D; 2]) -> [D; 2] {
        let level = self.from[c] - offset;
        let [first, last] = [
            self.partial_integrals(c, level, begin),
            self.partial_integrals(c, level, end),
        ];
        let [sum, moment] = two(|i| (last[i] - first[i]) * self.length);
        [sum, self.begin * sum + self.length * moment]
    }
    /// Integral and first moment over the stretch of component `c` of the prediction, which begins at
    /// `level`, from its beginning up to a time of the stretch.
    #[inline(always)]
    fn partial_integrals(&self, c: usize, level: D, t: D) -> [D; 2] {
        let (straight, curve) = (self.step[c] - self.curve[c], self.curve[c]);
        let (square, cube) = (t * t, t * t * t);
        [
            level * t + straight * square * 0.5 + curve * cube / 3.0,
            level * square * 0.5 + straight * cube / 3.0 + curve * cube * t * 0.25,
        ]
    }
}

impl<D: Real> Walk<D> {
    /// Goes on to where the prediction is `to`, and evaluates the law there. `rates` are the rates
    /// of the prediction at both ends.
    #[inline(always)]
    fn go_to(&mut self, at: D, to: [D; 3], rates: [[D; 3]; 2]) -> Visit {
        let stretch = Stretch::new([self.at, at], self.predicted, to, rates);
        let (zero, one) = (D::from(0.0), D::from(1.0));
        let was_open = self.state.contact == Contact::Open;
        let opens = to[0].re() >= 0.0;
        // Time at which N is zero.
        let crossing = (was_open != opens).then(|| -stretch.from[0] / stretch.step[0]);
        let closed = match (crossing, was_open) {
            (None, true) => None,
            (None, false) => Some([zero, one]),
            (Some(time), true) => Some([time, one]),
            (Some(time), false) => Some([zero, time]),
        };
        if let Some(times) = closed {
            self.path.follow(&stretch, 0, zero, times);
        }
        if let Some(time) = crossing.filter(|_| was_open) {
            let [t1, t2] = stretch.tangential(stretch.friction_way(time));
            self.state = PairState::from_contact_force([zero, t1, t2], Contact::Open, [zero; 3]);
        }
        let before = self.state;
        // The rate of a step that is as long as the stretch.
        let rate = two(|c| rates[1][c + 1] * stretch.length);
        let now = self.law.evaluate(to, || Some(rate), before);
        let contact = now.state.contact;
        // The tangential force is the prediction minus the state until the pair leaves its cone.
        // From there it is linear in time, down to 0 where the pair opens. Each part is followed at
        // one place of the code: all of it is inlined.
        let (sticks_until, slides) = match (was_open, contact) {
            (true, Contact::Open) => (None, None),
            (true, _) => {
                let begin = stretch.fraction(crossing.unwrap_or(zero));
                (None, Some((begin, at, [zero; 2])))
            }
            (false, Contact::Stick) => (Some(one), None),
            (false, _) => {
                let last = crossing.unwrap_or(one);
                let way = [self.predicted, to];
                let (leaves, there) = self
                    .law
                    .leaves_cone(way, before, stretch.friction_way(last));
                let (there, time) = if self.law.has_friction() && leaves.re() > 0.0 {
                    (there, stretch.time(leaves))
                } else {
                    ([self.force[1], self.force[2]], zero)
                };
                let line = (stretch.fraction(time), stretch.fraction(last), there);
                (Some(time), Some(line))
            }
        };
        if let Some(until) = sticks_until.filter(|until| until.re() > 0.0) {
            for c in 0..2 {
                let times = [zero, until];
                self.path.follow(&stretch, c + 1, before.slid_n[c], times);
            }
        }
        if let Some((begin, end, first)) = slides {
            let last = [now.force[1], now.force[2]];
            self.path.straight(begin, end, first, last);
        }
        let re = |state: PairState<D>| PairState {
            contact: state.contact,
            slid_n: state.slid_n.map(|n| n.re()),
        };
        let slid_n = match contact {
            Contact::Slip => re(now.state).distance_n(&re(before)),
            Contact::Stick | Contact::Open => 0.0,
        };
        (self.at, self.predicted, self.state, self.force) = (at, to, now.state, now.force);
        Visit {
            landed: was_open && !opens,
            contact,
            trial: now.trial.map(|n| n.re()),
            rate: Some(rate.map(|n| n.re())),
            slid_n,
        }
    }
}

/// Positive part of `v`.
#[inline(always)]
fn positive<D: Real>(v: D) -> D {
    if v.re() > 0.0 { v } else { D::from(0.0) }
}

/// A pair at an end of an interval.
struct End<D> {
    contact: Contact,
    force: [D; 3],
    /// Rate of the prediction.
    rate: [D; 3],
}

/// Contact force over an interval.
struct Path<D> {
    /// Integral and first moment of the force.
    force: [[D; 2]; 3],
    /// Integral of the rate of the prediction over the times at which the force follows it.
    followed: [D; 3],
}

impl<D: Real> Path<D> {
    #[inline(always)]
    fn new() -> Self {
        Self {
            force: [[D::from(0.0); 2]; 3],
            followed: [D::from(0.0); 3],
        }
    }

    /// Adds a part where component `c` of the force is the prediction minus `offset`, between two
    /// times.
    #[inline(always)]
    fn follow(&mut self, stretch: &Stretch<D>, c: usize, offset: D, times: [D; 2]) {
        let [sum, moment] = stretch.integrals(c, offset, times);
        self.force[c][0] += sum;
        self.force[c][1] += moment;
        let [first, last] = two(|i| stretch.rates[i][c] * stretch.length);
        let [begin, end] = times;
        self.followed[c] +=
            first * (end - begin) + (last - first) * (end * end - begin * begin) * 0.5;
    }

    /// Adds a part where the tangential force is linear in time.
    #[inline(always)]
    fn straight(&mut self, begin: D, end: D, first: [D; 2], last: [D; 2]) {
        let length = end - begin;
        for c in 0..2 {
            let (f, g) = (first[c], last[c]);
            self.force[c + 1][0] += length * (f + g) * 0.5;
            self.force[c + 1][1] +=
                length * (f * (begin * 2.0 + end) + g * (begin + end * 2.0)) * (1.0 / 6.0);
        }
    }

    /// Takes a share of a bend back: the force goes straight to `at` and from there, `bend` away from
    /// the line between its ends. The friction of a pair that turns evenly bends in every interval, for
    /// which the trapezoidal rule over a period needs no correction.
    #[inline(always)]
    fn straighten(&mut self, at: D, bend: [D; 3], share: D) {
        for (force, bend) in self.force.iter_mut().zip(bend).skip(1) {
            let height = bend * share;
            force[0] += height * -0.5;
            force[1] += height * (at + 1.0) * (-1.0 / 6.0);
        }
    }

    /// Corrections of both samples ([`Passed::corrections`]).
    ///
    /// In an interval in which the force follows the prediction throughout, the trapezoidal rule
    /// errs by a twelfth of the difference of the rates. This is not corrected: over many such
    /// intervals these errors add up to the one at their first and at their last sample. A rate is
    /// therefore added where the force follows the prediction at the end, and subtracted where it
    /// does so at the beginning. What the force follows moves from sample to sample so that no
    /// correction is left where it does so throughout.
    #[inline(always)]
    fn corrections(&self, ends: [End<D>; 2]) -> [[D; 3]; 2] {
        let of = |c: usize| {
            let [sum, moment] = self.force[c];
            let [first, last] = two(|i| ends[i].force[c]);
            let followed = self.followed[c] / 12.0;
            let mut weights = [
                sum - moment - first / 3.0 - last / 6.0 + followed,
                moment - first / 6.0 - last / 3.0 - followed,
            ];
            for (i, end) in ends.iter().enumerate() {
                let follows = match c {
                    0 => end.contact != Contact::Open,
                    _ => end.contact == Contact::Stick,
                };
                if follows {
                    weights[i] += end.rate[c] * [-1.0 / 12.0, 1.0 / 12.0][i];
                }
            }
            weights
        };
        let [normal, t1, t2] = three(of);
        two(|end| [normal[end], t1[end], t2[end]])
    }
}

/// Number of entries of a window and of a state.
const INPUTS: usize = 14;
/// Number of derivatives of a number: those by all inputs, and further ones that fill the vectors of a
/// processor.
const LANES: usize = INPUTS.next_multiple_of(8);

/// Derivative of something by the window, sample after sample, and by the state before the interval.
pub(crate) type InputDerivatives = [f64; LANES];

/// Derivatives of what an interval does.
pub(crate) struct PassedDerivative {
    /// Derivatives of the corrections at the beginning (N, t1, t2) and at the end.
    pub corrections: [[InputDerivatives; 3]; 2],
    /// Derivatives of the state after the interval.
    pub slid_n: [InputDerivatives; 2],
}

/// Derivatives of [`pass`].
pub(crate) fn derivative(
    window: &Window<f64>,
    state: PairState,
    at_end: Option<Contact>,
    law: PredictedLaw,
) -> PassedDerivative {
    Arch::new().dispatch(Differentiate {
        window,
        state,
        at_end,
        law,
    })
}

/// [`derivative`] with the widest vectors of the processor.
struct Differentiate<'a> {
    window: &'a Window<f64>,
    state: PairState,
    at_end: Option<Contact>,
    law: PredictedLaw,
}

impl WithSimd for Differentiate<'_> {
    type Output = PassedDerivative;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> PassedDerivative {
        let number = Dual::<LANES>::independent;
        let at = |n: usize| three(|c| number(self.window[n][c], 3 * n + c));
        let window = [at(0), at(1), at(2), at(3)];
        let state = PairState {
            contact: self.state.contact,
            slid_n: two(|c| number(self.state.slid_n[c], 12 + c)),
        };
        let passed = pass(&window, state, self.at_end, self.law);
        PassedDerivative {
            corrections: two(|end| three(|c| passed.corrections[end][c].by)),
            slid_n: two(|c| passed.state.slid_n[c].by),
        }
    }
}

/// Adds the correction of a sample to the coefficients of a signal (2H+1).
#[inline(always)]
pub(crate) fn add_to_coefficients(
    fourier: &Fourier,
    sample: usize,
    change: f64,
    coefficients: &mut [f64],
) {
    let scale = change / fourier.samples() as f64;
    let row = fourier.synthesis_row(sample);
    coefficients[0] += scale * row[0];
    for (c, s) in coefficients[1..].iter_mut().zip(&row[1..]) {
        *c += 2.0 * scale * s;
    }
}
