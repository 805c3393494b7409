//! Passage of a pair through the period of a known motion, as its linearised law needs it.

use crate::contact::coulomb::Contact;
use crate::contact::{PairLaw, PairState, PredictedLaw};
use crate::dlft::Orbit;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::spectrum::{Spectrum, cosine, sine};
use std::f64::consts::TAU;

/// Number of periods after which a pair that is still not periodic is taken as it is.
const MOST_PERIODS: usize = 60;
/// The pair is periodic when its state moves by less than this fraction of the largest prediction.
const PERIODIC: f64 = 1e-10;
/// Least limit of friction that counts, as a fraction of the largest in the period.
const LEAST_LIMIT: f64 = 1e-6;

/// Prediction of the law of a pair from its displacement and its contact force.
pub(super) struct Prediction {
    law: PredictedLaw,
    /// Factors on the displacement, N/m, and on the force, normal and tangential.
    of_x: [f64; 2],
    of_force: [f64; 2],
}

impl Prediction {
    /// Prediction of DLFT with these eps, normal and tangential, N/m. The force keeps the harmonics that
    /// the balance has.
    pub(super) fn of_balance(law: &PairLaw, eps: [f64; 2]) -> Self {
        let law = law.predicted(eps, f64::INFINITY);
        let shares = [law.shares[0], law.shares[1]];
        Self {
            law,
            of_x: [0, 1].map(|c| shares[c] * eps[c]),
            of_force: shares,
        }
    }

    /// Prediction of springs, normal and tangential, N/m, which follows from the displacement only.
    pub(super) fn of_springs(law: &PairLaw, springs: [f64; 2]) -> Self {
        Self {
            law: law.of_springs(springs),
            of_x: springs,
            of_force: [0.0; 2],
        }
    }
}

/// Passage at equally spaced samples. Sample n ends the interval n.
pub(super) struct Passage {
    /// Status in the interval.
    pub contact: Vec<Contact>,
    /// Direction of the friction force where the pair slips, unit.
    pub direction: Vec<[f64; 2]>,
    /// Rate k_T v / (mu N), for springs of 1 N/m, at which the pair forgets what is across the friction
    /// force where it slips, m/(N s).
    pub forgets: Vec<f64>,
    /// Fraction of the interval at which the status changes.
    pub changes_at: Vec<f64>,
    /// Tangential velocity over normal one where the pair lands in the interval.
    pub slopes: Vec<[f64; 2]>,
}

impl Passage {
    /// Passage of a pair of this number, by this prediction.
    pub(super) fn new(
        orbit: &Orbit,
        pair: usize,
        prediction: &Prediction,
        fourier: &Fourier,
    ) -> Self {
        let signals = Signals::new(orbit, pair, prediction, fourier);
        let samples = fourier.samples();
        let mut passage = Self {
            contact: vec![Contact::Open; samples],
            direction: vec![[0.0; 2]; samples],
            forgets: vec![0.0; samples],
            changes_at: vec![0.5; samples],
            slopes: vec![[0.0; 2]; samples],
        };
        passage.follow(&prediction.law, &signals);
        passage.place_changes(&signals);
        passage
    }

    /// Evaluates the law sample after sample until the pair is periodic.
    fn follow(&mut self, predicted: &PredictedLaw, signals: &Signals) {
        let samples = self.contact.len();
        let prediction = |n: usize| signals.prediction.each_ref().map(|s| s[n]);
        let sizes = signals.prediction[1].iter().chain(&signals.prediction[2]);
        let scale = sizes.fold(0.0_f64, |m, v| m.max(v.abs()));
        let limits = signals.prediction[0].iter();
        let limits = limits.map(|normal| -predicted.friction * normal);
        let least = LEAST_LIMIT * limits.fold(f64::MIN_POSITIVE, f64::max);
        let mut state = PairState::from_contact_force(
            prediction(0),
            Contact::Stick,
            [0.0, signals.start_n[0], signals.start_n[1]],
        );
        for _ in 0..MOST_PERIODS {
            let start = state;
            for n in 0..samples {
                let now = prediction(n);
                if state.contact == Contact::Open && now[0] < 0.0 {
                    // The slider stays where the pair lands, between two samples.
                    let before = prediction((n + samples - 1) % samples);
                    let way = (before[0] / (before[0] - now[0])).clamp(0.0, 1.0);
                    state.slid_n = [1, 2].map(|c| before[c] + way * (now[c] - before[c]));
                }
                let instant = predicted.evaluate(now, || None, state);
                let [normal, t1, t2] = instant.force;
                self.contact[n] = instant.state.contact;
                if instant.state.contact == Contact::Slip {
                    let limit = (-predicted.friction * normal).max(least);
                    let size = t1.hypot(t2);
                    if size > 0.0 {
                        self.direction[n] = [t1 / size, t2 / size];
                    }
                    let slid_m = predicted.slid_m(instant.state.distance_n(&state));
                    let speed = slid_m * samples as f64 / signals.period_s;
                    self.forgets[n] = speed / limit;
                }
                state = instant.state;
            }
            if state.distance_n(&start) <= PERIODIC * scale {
                break;
            }
        }
    }

    /// Finds the instants at which the pair touches and opens, and the slopes at which it lands.
    fn place_changes(&mut self, signals: &Signals) {
        let samples = self.contact.len();
        for n in 0..samples {
            let before = (n + samples - 1) % samples;
            let [was, is] = [before, n].map(|n| self.contact[n] == Contact::Open);
            if was == is {
                continue;
            }
            let normal = &signals.prediction[0];
            let at = normal[before] / (normal[before] - normal[n]);
            // Inside the interval: an instant then belongs to one interval only.
            self.changes_at[n] = if at.is_finite() {
                at.clamp(1e-3, 0.999)
            } else {
                0.5
            };
            let [across, t1, t2] = signals.velocity.each_ref().map(|s| s[before]);
            if was && across != 0.0 {
                self.slopes[n] = [t1 / across, t2 / across];
            }
        }
    }

    /// Number of samples.
    fn samples(&self) -> usize {
        self.contact.len()
    }

    /// Sample whose status the pair has at an instant, in samples, between two changes.
    pub(super) fn sample_at(&self, instant: f64) -> usize {
        let samples = self.samples();
        let end = instant.ceil();
        let n = end as usize % samples;
        let before = (n + samples - 1) % samples;
        let changes = self.contact[before] != self.contact[n];
        if changes && instant - (end - 1.0) < self.changes_at[n] {
            before
        } else {
            n
        }
    }

    /// Instants, in samples, at which the status changes.
    pub(super) fn changes(&self) -> impl Iterator<Item = f64> {
        let samples = self.samples();
        (0..samples).filter_map(move |n| {
            let before = (n + samples - 1) % samples;
            (self.contact[before] != self.contact[n])
                .then(|| (before as f64 + self.changes_at[n]) % samples as f64)
        })
    }

    /// Returns `true` if the pair slips in the interval that begins or ends at sample `n`.
    pub(super) fn slips_about(&self, n: usize) -> bool {
        let next = (n + 1) % self.samples();
        self.contact[n] == Contact::Slip || self.contact[next] == Contact::Slip
    }
}

/// Reversal of a rigid pair: it slips along a direction before and against it afterwards, and may stick
/// between.
pub(super) struct Turn {
    /// Samples of the last slip before and of the first one after.
    ends: [usize; 2],
    /// Sample at which the velocity passes zero.
    pub at: usize,
    /// Direction of the slip before, unit.
    pub along: [f64; 2],
    /// Acceleration and contact force in this direction at that sample, m/s2 and N.
    pub acceleration: f64,
    pub force_n: f64,
    /// Limit of friction, N.
    pub limit_n: f64,
}

/// Least cosine of the angle between the slip before and against that after a reversal.
const REVERSES: f64 = 0.5;

impl Passage {
    /// Reversals of a rigid pair.
    pub(super) fn turns(
        &self,
        law: &PairLaw,
        orbit: &Orbit,
        pair: usize,
        fourier: &Fourier,
    ) -> Vec<Turn> {
        let samples = self.samples();
        let of = |values: &[f64], derivatives: usize| -> [Vec<f64>; 3] {
            [0, 1, 2].map(|c| signal(values, orbit, 3 * pair + c, derivatives, fourier))
        };
        let [force, velocity, acceleration] =
            [of(&orbit.lambda, 0), of(&orbit.x, 1), of(&orbit.x, 2)];
        let mut turns = Vec::new();
        for first in (0..samples).filter(|n| self.contact[*n] == Contact::Slip) {
            let way = (1..samples).find(|j| self.contact[(first + j) % samples] != Contact::Stick);
            let Some(way) = way else {
                continue;
            };
            let last = (first + way) % samples;
            let [along, after] = [first, last].map(|n| self.direction[n]);
            let reverses = along[0] * after[0] + along[1] * after[1] < -REVERSES;
            if self.contact[last] != Contact::Slip || !reverses {
                continue;
            }
            let of = |signal: &[Vec<f64>; 3], n: usize| {
                along[0] * signal[1][n] + along[1] * signal[2][n]
            };
            let between = (0..=way).map(|j| (first + j) % samples);
            let at = between.clone().find(|n| of(&velocity, *n) <= 0.0);
            let at = at.unwrap_or((first + way / 2) % samples);
            turns.push(Turn {
                ends: [first, last],
                at,
                along,
                acceleration: of(&acceleration, at),
                force_n: of(&force, at),
                limit_n: -law.computed_friction() * force[0][at].min(0.0),
            });
        }
        turns
    }

    /// Lets the pair slip up to a reversal and from there on, without sticking.
    pub(super) fn pass_at_once(&mut self, turn: &Turn) {
        let samples = self.samples();
        let [first, last] = turn.ends;
        let mut from = first;
        let mut n = (first + 1) % samples;
        while n != last {
            self.contact[n] = Contact::Slip;
            self.direction[n] = self.direction[from];
            self.forgets[n] = self.forgets[from];
            if n == turn.at {
                from = last;
            }
            n = (n + 1) % samples;
        }
    }
}

/// Signal number `component` of harmonic coefficients, or a derivative of it by time, at the samples.
fn signal(
    values: &[f64],
    orbit: &Orbit,
    component: usize,
    derivatives: usize,
    fourier: &Fourier,
) -> Vec<f64> {
    let mut of: Vec<f64> = Spectrum::new(values, orbit.harmonics)
        .signal_coefficients(component)
        .collect();
    for _ in 0..derivatives {
        of[0] = 0.0;
        for k in 1..=orbit.harmonics {
            let factor = k as f64 * TAU * orbit.frequency_hz;
            let [c, s] = [of[cosine(k)], of[sine(k)]];
            (of[cosine(k)], of[sine(k)]) = (factor * s, -factor * c);
        }
    }
    let mut signal = vec![0.0; fourier.samples()];
    fourier.to_time(&of, &mut signal);
    signal
}

/// Signals of a pair at the samples of a period.
struct Signals {
    period_s: f64,
    /// Predicted force (N with the clearance, t1, t2), N.
    prediction: [Vec<f64>; 3],
    /// Relative velocity, m/s.
    velocity: [Vec<f64>; 3],
    /// Tangential contact force at the start of the period, N.
    start_n: [f64; 2],
}

impl Signals {
    fn new(orbit: &Orbit, pair: usize, by: &Prediction, fourier: &Fourier) -> Self {
        let of = |values: &[f64], c: usize, derivatives: usize| {
            signal(values, orbit, 3 * pair + c, derivatives, fourier)
        };
        let prediction = |c: usize| {
            let [x, force] = [&orbit.x, &orbit.lambda].map(|values| of(values, c, 0));
            let shift_n = if c == 0 { by.law.shift_n } else { 0.0 };
            let [of_x, of_force] = [by.of_x, by.of_force].map(|factors| factors[c.min(1)]);
            let both = x.iter().zip(&force);
            both.map(|(x, force)| of_x * x + of_force * force + shift_n)
                .collect()
        };
        Self {
            period_s: 1.0 / orbit.frequency_hz,
            prediction: [0, 1, 2].map(prediction),
            velocity: [0, 1, 2].map(|c| of(&orbit.x, c, 1)),
            start_n: [1, 2].map(|c| of(&orbit.lambda, c, 0)[0]),
        }
    }
}
