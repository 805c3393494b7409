//! A contact pair between two samples of a period: the instants at which it begins to slip,
//! reverses, opens and closes, and what they add to the coefficients of its force.
//!
//! The predicted force lambda_u is known at the samples, and the trapezoidal rule over them is
//! exact for it. The contact force has corners between the samples. It is followed here from corner
//! to corner, and its integral over the interval replaces that of the rule. Without this, friction
//! would reverse at whole samples only, and the motion would lock to them.
//!
//! All of it is written for real numbers and for numbers with derivatives alike.

use crate::contact::PredictedLaw;
use crate::contact::coulomb::Contact;
use dovetail_numerics::fourier::Fourier;
use nalgebra_sparse::na::{SMatrix, SVector};
use num_dual::{DualNum, DualSVec64, jacobian};

/// A real number, with or without derivatives.
pub trait Real: DualNum<Primitive = f64> + Copy {}
impl<D: DualNum<Primitive = f64> + Copy> Real for D {}

/// Predicted forces (N with the clearance, t1, t2) at four samples, N: those two at the ends of the
/// interval in the middle.
pub type Window<D> = [[D; 3]; 4];

/// Evaluation of the law at one place.
#[derive(Debug, Clone, Copy)]
pub struct Visit {
    /// True if the pair was open before and has closed on the way.
    pub landed: bool,
    /// State of the pair.
    pub contact: Contact,
    /// Predicted contact force, N.
    pub predicted: [f64; 3],
    /// Distance slid since the last evaluation, as a force, N.
    pub slid_n: f64,
}

/// State and force of a pair after an interval.
#[derive(Debug, Clone, Copy)]
pub struct Passed<D> {
    /// lambda_x (tangential) at the end, N.
    pub state: [D; 2],
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
    pub fn changes(&self) -> bool {
        self.landed || self.contact != Contact::Stick
    }
}

impl<D> Passed<D> {
    /// State of the pair at the end.
    pub fn contact(&self) -> Contact {
        self.visits
            .iter()
            .flatten()
            .last()
            .map_or(Contact::Stick, |v| v.contact)
    }
}

/// Rates of the prediction at both ends of the interval, by central differences, N per interval.
fn rates<D: Real>(window: &Window<D>) -> [[D; 3]; 2] {
    [1, 2].map(|n| [0, 1, 2].map(|c| (window[n + 1][c] - window[n - 1][c]) * 0.5))
}

/// Fraction of the interval at which the tangential prediction is slowest, where that is inside,
/// with rates that are linear in time. On a straight line the prediction reverses there.
fn reversal<D: Real>([first, last]: [[D; 3]; 2]) -> Option<D> {
    let change = [last[1] - first[1], last[2] - first[2]];
    let [before, after] = [first, last].map(|r| r[1] * change[0] + r[2] * change[1]);
    (before.re() < 0.0 && after.re() > 0.0).then(|| -before / (after - before))
}

/// Returns `true` if the tangential prediction reverses inside the interval.
#[inline(always)]
pub fn reverses(window: [[f64; 2]; 4]) -> bool {
    let [first, last] = [1, 2].map(|n| [0, 1].map(|c| window[n + 1][c] - window[n - 1][c]));
    let change = [last[0] - first[0], last[1] - first[1]];
    let along = |r: [f64; 2]| r[0] * change[0] + r[1] * change[1];
    along(first) < 0.0 && along(last) > 0.0
}

/// Takes a pair from the second sample of the window to the third. `state` is lambda_x (tangential)
/// at the beginning. `at_ends` is the state of the pair at both samples; without it the state after
/// the interval is right, but the corrections are not. A pair that sticks within `touch_n`, N, of
/// its cone counts as slipping.
pub fn pass<D: Real>(
    window: &Window<D>,
    state: [D; 2],
    at_ends: Option<[Contact; 2]>,
    law: PredictedLaw,
    touch_n: f64,
) -> Passed<D> {
    let [_, from, to, _] = *window;
    let zero = D::from(0.0);
    let (contact, force) = if from[0].re() >= 0.0 {
        (Contact::Open, [zero; 3])
    } else {
        (
            at_ends.map_or(Contact::Stick, |[before, _]| before),
            [from[0], from[1] - state[0], from[2] - state[1]],
        )
    };
    let mut walk = Walk {
        law,
        touch_n,
        at: zero,
        predicted: from,
        contact,
        state,
        force,
        path: Path::new(),
    };
    let end = D::from(1.0);
    let [first, last] = rates(window);
    let (middle, visit) = match reversal([first, last]).filter(|_| law.friction > 0.0) {
        None => (None, walk.go_to(end, to, [first, last])),
        Some(at) => {
            let slowest = [0, 1, 2].map(|c| first[c] + (last[c] - first[c]) * at);
            let there = [0, 1, 2].map(|c| {
                from[c] + (to[c] - from[c] - (last[c] - first[c]) * (-at + 1.0) * 0.5) * at
            });
            let middle = walk.go_to(at, there, [first, slowest]);
            (Some(middle), walk.go_to(end, to, [slowest, last]))
        }
    };
    let ends = [
        End {
            contact,
            force,
            rate: first,
        },
        End {
            // A pair that touches its cone there may stick or slip by rounding; the next interval
            // must start from the same state.
            contact: at_ends.map_or(walk.contact, |[_, now]| now),
            force: walk.force,
            rate: last,
        },
    ];
    Passed {
        state: walk.state,
        force: walk.force,
        corrections: walk.path.corrections(ends),
        visits: [middle, Some(visit)],
    }
}

/// Progress of a pair through an interval.
struct Walk<D> {
    law: PredictedLaw,
    touch_n: f64,
    /// Fraction of the interval.
    at: D,
    predicted: [D; 3],
    contact: Contact,
    state: [D; 2],
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
    fn new([begin, end]: [D; 2], from: [D; 3], to: [D; 3], rates: [[D; 3]; 2]) -> Self {
        let step = [0, 1, 2].map(|c| to[c] - from[c]);
        let along = rates.map(|r| r[1] * step[1] + r[2] * step[2]);
        let [first, last] = along.map(positive);
        let sum = first + last;
        let length = end - begin;
        Self {
            begin,
            length,
            from,
            step,
            rates,
            curve: [0, 1, 2].map(|c| (rates[1][c] - rates[0][c]) * length * 0.5),
            bend: if sum.re() > 0.0 {
                (last - first) / sum
            } else {
                D::from(0.0)
            },
        }
    }
    /// Fraction of the interval at a time of the stretch.
    fn at(&self, time: D) -> D {
        self.begin + self.length * time
    }
    fn way(&self, time: D) -> D {
        time * (-self.bend + 1.0) + time * time * self.bend
    }
    fn time(&self, way: D) -> D {
        let start = -self.bend + 1.0;
        let under = start * start + self.bend * way * 4.0;
        // The square root has no derivative at 0.
        if way.re() <= 0.0 || under.re() <= 1e-14 {
            return way;
        }
        way * 2.0 / (start + under.sqrt())
    }
    fn tangential(&self, way: D) -> [D; 2] {
        [1, 2].map(|c| self.from[c] + self.step[c] * way)
    }
    /// Integral and first moment over the interval of component `c` of the prediction minus
    /// `offset`, between two times.
    fn integrals(&self, c: usize, offset: D, times: [D; 2]) -> [D; 2] {
        let level = self.from[c] - offset;
        let (straight, curve) = (self.step[c] - self.curve[c], self.curve[c]);
        let [first, last] = times.map(|t| {
            let (square, cube) = (t * t, t * t * t);
            [
                level * t + straight * square * 0.5 + curve * cube / 3.0,
                level * square * 0.5 + straight * cube / 3.0 + curve * cube * t * 0.25,
            ]
        });
        let [sum, moment] = [0, 1].map(|i| (last[i] - first[i]) * self.length);
        [sum, self.begin * sum + self.length * moment]
    }
}

impl<D: Real> Walk<D> {
    /// Goes on to where the prediction is `to`, and evaluates the law there. `rates` are the rates
    /// of the prediction at both ends.
    fn go_to(&mut self, at: D, to: [D; 3], rates: [[D; 3]; 2]) -> Visit {
        let stretch = Stretch::new([self.at, at], self.predicted, to, rates);
        let [zero, one] = [0.0, 1.0].map(D::from);
        let was_open = self.contact == Contact::Open;
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
            self.state = stretch.tangential(stretch.way(time));
        }
        let before = self.state;
        let trial = [to[1] - before[0], to[2] - before[1]];
        let predicted = [to[0].re(), trial[0].re(), trial[1].re()];
        let (contact, force) = law_at([to[0], trial[0], trial[1]], self.law, self.touch_n);
        let tangential = [force[1], force[2]];
        // The tangential force is the prediction minus the state until the pair leaves its cone.
        // From there it is linear in time, down to 0 where the pair opens.
        match (was_open, contact) {
            (true, Contact::Open) => {}
            (true, _) => {
                let from = stretch.at(crossing.unwrap_or(zero));
                self.path.straight(from, at, [zero; 2], tangential);
            }
            (false, Contact::Stick) => self.path.stick(&stretch, before, [zero, one]),
            (false, _) => {
                let last = crossing.unwrap_or(one);
                let leaves = if self.law.friction > 0.0 {
                    self.leaves_cone(to, stretch.way(last))
                } else {
                    zero
                };
                let (there, time) = if leaves.re() > 0.0 {
                    let [t1, t2] = stretch.tangential(leaves);
                    ([t1 - before[0], t2 - before[1]], stretch.time(leaves))
                } else {
                    ([self.force[1], self.force[2]], zero)
                };
                self.path.stick(&stretch, before, [zero, time]);
                self.path
                    .straight(stretch.at(time), stretch.at(last), there, tangential);
            }
        }
        if contact != Contact::Stick {
            self.state = [to[1] - force[1], to[2] - force[2]];
        }
        let slid_n = match contact {
            Contact::Slip => [0, 1]
                .map(|c| self.state[c].re() - before[c].re())
                .into_iter()
                .fold(0.0_f64, f64::hypot),
            Contact::Stick | Contact::Open => 0.0,
        };
        (self.at, self.predicted, self.contact, self.force) = (at, to, contact, force);
        Visit {
            landed: was_open && !opens,
            contact,
            predicted,
            slid_n,
        }
    }

    /// Fraction of the way to the prediction `to` on which a closed pair leaves its cone, at most
    /// `last`.
    fn leaves_cone(&self, to: [D; 3], last: D) -> D {
        let from = [1, 2].map(|c| self.predicted[c] - self.state[c - 1]);
        let step = [1, 2].map(|c| to[c] - self.predicted[c]);
        let (normal, normal_step) = (self.predicted[0], to[0] - self.predicted[0]);
        let mu2 = self.law.friction * self.law.friction;
        let dot = |a: [D; 2], b: [D; 2]| a[0] * b[0] + a[1] * b[1];
        // The cone's equation along the way, a + b w + c w^2 with a <= 0.
        let c = dot(step, step) - normal_step * normal_step * mu2;
        let b = (dot(from, step) - normal * normal_step * mu2) * 2.0;
        let a = dot(from, from) - normal * normal * mu2;
        let zero = D::from(0.0);
        let a = if self.contact == Contact::Slip || a.re() >= 0.0 {
            zero
        } else {
            a
        };
        let way = if a.re() == 0.0 {
            if b.re() >= 0.0 { zero } else { -b / c }
        } else {
            let under = b * b - a * c * 4.0;
            if under.re() <= 0.0 {
                return last;
            }
            let root = under.sqrt();
            if b.re() >= 0.0 {
                a * -2.0 / (b + root)
            } else {
                (root - b) / (c * 2.0)
            }
        };
        if way.re() >= 0.0 && way.re() < last.re() {
            way
        } else {
            last
        }
    }
}

/// Law at one instant: the state of the pair, and its contact force.
fn law_at<D: Real>(predicted: [D; 3], law: PredictedLaw, touch_n: f64) -> (Contact, [D; 3]) {
    let zero = D::from(0.0);
    let [normal, t1, t2] = predicted;
    if normal.re() >= 0.0 {
        return (Contact::Open, [zero; 3]);
    }
    let square = t1 * t1 + t2 * t2;
    let limit = normal * -law.friction;
    if square.re().sqrt() < limit.re() - touch_n {
        return (Contact::Stick, predicted);
    }
    if square.re() == 0.0 || law.friction == 0.0 {
        return (Contact::Slip, [normal, zero, zero]);
    }
    let scale = limit / square.sqrt();
    (Contact::Slip, [normal, t1 * scale, t2 * scale])
}

/// Positive part of `v`.
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
    fn new() -> Self {
        Self {
            force: [[D::from(0.0); 2]; 3],
            followed: [D::from(0.0); 3],
        }
    }

    /// Adds a part where component `c` of the force is the prediction minus `offset`, between two
    /// times.
    fn follow(&mut self, stretch: &Stretch<D>, c: usize, offset: D, times: [D; 2]) {
        let [sum, moment] = stretch.integrals(c, offset, times);
        self.force[c][0] += sum;
        self.force[c][1] += moment;
        let [first, last] = stretch.rates.map(|rate| rate[c] * stretch.length);
        let [begin, end] = times;
        self.followed[c] +=
            first * (end - begin) + (last - first) * (end * end - begin * begin) * 0.5;
    }

    /// Adds a part where the pair sticks, between two times.
    fn stick(&mut self, stretch: &Stretch<D>, state: [D; 2], times: [D; 2]) {
        if times[1].re() > 0.0 {
            self.follow(stretch, 1, state[0], times);
            self.follow(stretch, 2, state[1], times);
        }
    }

    /// Adds a part where the tangential force is linear in time.
    fn straight(&mut self, begin: D, end: D, first: [D; 2], last: [D; 2]) {
        let length = end - begin;
        for c in 0..2 {
            let (f, g) = (first[c], last[c]);
            self.force[c + 1][0] += length * (f + g) * 0.5;
            self.force[c + 1][1] +=
                length * (f * (begin * 2.0 + end) + g * (begin + end * 2.0)) * (1.0 / 6.0);
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
    fn corrections(&self, ends: [End<D>; 2]) -> [[D; 3]; 2] {
        let of = |c: usize| {
            let [sum, moment] = self.force[c];
            let [first, last] = [0, 1].map(|i| ends[i].force[c]);
            let followed = self.followed[c] / 12.0;
            let mut own = [
                sum - moment - first / 3.0 - last / 6.0 + followed,
                moment - first / 6.0 - last / 3.0 - followed,
            ];
            for (i, end) in ends.iter().enumerate() {
                let follows = match c {
                    0 => end.contact != Contact::Open,
                    _ => end.contact == Contact::Stick,
                };
                if follows {
                    own[i] += end.rate[c] * [-1.0 / 12.0, 1.0 / 12.0][i];
                }
            }
            own
        };
        let [normal, t1, t2] = [0, 1, 2].map(of);
        [0, 1].map(|end| [normal[end], t1[end], t2[end]])
    }
}

/// Number of entries of a window and of a state.
pub const INPUTS: usize = 14;
/// Number of entries of the two corrections and of the state after the interval.
pub const OUTPUTS: usize = 8;

/// Derivative of the corrections at the beginning (N, t1, t2) and at the end, and of the state
/// after the interval. It is taken by the window, sample after sample, and the state before the
/// interval.
pub fn derivative(
    window: &Window<f64>,
    state: [f64; 2],
    at_ends: Option<[Contact; 2]>,
    law: PredictedLaw,
    touch_n: f64,
) -> SMatrix<f64, OUTPUTS, INPUTS> {
    let inputs =
        SVector::<f64, INPUTS>::from_iterator(window.iter().flatten().copied().chain(state));
    let through = |v: SVector<DualSVec64<INPUTS>, INPUTS>| {
        let window = [0, 1, 2, 3].map(|n| [0, 1, 2].map(|c| v[3 * n + c]));
        let passed = pass(&window, [v[12], v[13]], at_ends, law, touch_n);
        let [first, last] = passed.corrections;
        let outputs = first.into_iter().chain(last).chain(passed.state);
        SVector::<DualSVec64<INPUTS>, OUTPUTS>::from_iterator(outputs)
    };
    jacobian(through, &inputs).1
}

/// Adds the correction of a sample to the coefficients of a signal (2H+1).
#[inline(always)]
pub fn add_to_coefficients(
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
