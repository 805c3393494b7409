//! Laws of the pairs for perturbations in the steps of a period: means over a step of the passage of a
//! pair through the known motion.

use super::super::passage::Passage;
use super::turns::PassedTurn;
use crate::contact::coulomb::Contact;

/// Samples of the known motion in a step.
pub(super) const SAMPLES: usize = 8;
/// Share of the way between two velocities at which a path that passes zero counts as passing it aside.
const ASIDE: f64 = 1e-3;

/// Law of a pair in one step.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepLaw {
    /// Status in most of the step, or in most of its closed part.
    pub contact: Contact,
    /// Fraction of the step in which the pair is closed.
    pub closed: f64,
    /// Number of samples at which the pair slips.
    slips: f64,
    /// Mean direction of the friction force.
    pub direction: [f64; 2],
    /// Mean resistance of friction to a change of the sliding velocity, N s/m, symmetric 2 x 2. A rigid
    /// pair that reverses without sticking resists along its direction as well.
    pub resistance: [[f64; 2]; 2],
    /// Tangential velocity over the normal one where the pair lands in the step and sticks.
    pub landing: Option<[f64; 2]>,
}

impl StepLaw {
    /// Laws of a pair in equal steps of its passage. One that slips does so in some step at least.
    /// Reversals that a rigid pair passes at once are in `turns`; a step lasts `step_s`.
    pub(super) fn of_passage(
        passage: &Passage,
        turns: &[PassedTurn],
        step_s: f64,
        is_rigid: bool,
    ) -> Vec<Self> {
        let steps = passage.contact.len() / SAMPLES;
        let mut laws: Vec<Self> = (0..steps)
            .map(|step| Self::in_step(passage, turns, 1 + step * SAMPLES, is_rigid))
            .collect();
        for turn in turns {
            let step = (turn.sample + SAMPLES * steps - 1) / SAMPLES % steps;
            let law = &mut laws[step];
            law.contact = Contact::Slip;
            for (row, e) in law.resistance.iter_mut().zip(turn.along) {
                for (v, f) in row.iter_mut().zip(turn.along) {
                    *v += turn.impulse_n_s_m * e * f / step_s;
                }
            }
        }
        if laws.iter().all(|law| law.contact == Contact::Stick) {
            let most = laws.iter_mut().max_by(|a, b| a.slips.total_cmp(&b.slips));
            if let Some(most) = most.filter(|law| law.slips > 0.0) {
                most.contact = Contact::Slip;
            }
        }
        laws
    }

    /// Returns `true` if the pair is open throughout the step, or closed.
    pub(super) fn is_whole(&self) -> bool {
        self.closed == 0.0 || self.closed == 1.0
    }

    /// Law in the intervals from `first` on.
    fn in_step(passage: &Passage, turns: &[PassedTurn], first: usize, is_rigid: bool) -> Self {
        let samples = passage.contact.len();
        let mut law = Self {
            contact: Contact::Open,
            closed: 0.0,
            slips: 0.0,
            direction: [0.0; 2],
            resistance: [[0.0; 2]; 2],
            landing: None,
        };
        let mut sticks = 0.0;
        for n in first..first + SAMPLES {
            let [before, n] = [n - 1, n].map(|n| n % samples);
            let [was, is] = [before, n].map(|n| passage.contact[n]);
            let at = passage.changes_at[n];
            law.closed += match (was, is) {
                (Contact::Open, Contact::Open) => 0.0,
                (Contact::Open, _) => 1.0 - at,
                (_, Contact::Open) => at,
                _ => 1.0,
            };
            if was == Contact::Open && is != Contact::Open {
                law.landing = Some(match is {
                    Contact::Stick => passage.slopes[n],
                    _ => [0.0; 2],
                });
            }
            match is {
                Contact::Stick => sticks += 1.0,
                Contact::Slip => {
                    law.slips += 1.0;
                    let slid = |n: usize| passage.direction[n].map(|e| e * passage.forgets[n]);
                    let turns = turns.iter().any(|turn| turn.sample == n);
                    let from = if was == Contact::Slip && !turns {
                        before
                    } else {
                        n
                    };
                    let added = resistance(slid(from), slid(n));
                    for (c, row) in added.iter().enumerate() {
                        law.direction[c] += passage.direction[n][c];
                        for (sum, v) in law.resistance[c].iter_mut().zip(row) {
                            *sum += v;
                        }
                    }
                }
                Contact::Open => {}
            }
        }
        law.closed /= SAMPLES as f64;
        if law.slips > 0.0 {
            law.direction = law.direction.map(|e| e / law.slips);
            law.resistance = law.resistance.map(|row| row.map(|v| v / law.slips));
        }
        let is_open = sticks + law.slips == 0.0 || is_rigid && law.closed < 0.5;
        law.contact = match () {
            () if is_open => Contact::Open,
            () if sticks >= law.slips => Contact::Stick,
            () => Contact::Slip,
        };
        law
    }
}

/// Mean of the derivative of v / |v| over the straight way from one v to another.
fn resistance(from: [f64; 2], to: [f64; 2]) -> [[f64; 2]; 2] {
    let way = [to[0] - from[0], to[1] - from[1]];
    let length = way[0].hypot(way[1]);
    let size = to[0].hypot(to[1]);
    if length <= ASIDE * size {
        if size == 0.0 {
            return [[0.0; 2]; 2];
        }
        let across = [-to[1] / size, to[0] / size];
        return across.map(|a| across.map(|b| a * b / size));
    }
    // Components along the way and across it.
    let along = way.map(|w| w / length);
    let across = [-along[1], along[0]];
    let of = |v: [f64; 2], e: [f64; 2]| v[0] * e[0] + v[1] * e[1];
    let aside = of(to, across);
    let distance = aside.abs().max(ASIDE * length);
    let [from, to] = [from, to].map(|v| of(v, along));
    let cosine = |p: f64| p / p.hypot(distance);
    let in_along = (cosine(to) - cosine(from)) / length;
    let angle = (to / distance).asinh() - (from / distance).asinh();
    let in_across = (angle - cosine(to) + cosine(from)) / length;
    let sine = |p: f64| aside / p.hypot(distance);
    let mixed = (sine(to) - sine(from)) / length;
    [0, 1].map(|i| {
        [0, 1].map(|j| {
            in_along * along[i] * along[j]
                + in_across * across[i] * across[j]
                + mixed * (along[i] * across[j] + across[i] * along[j])
        })
    })
}
