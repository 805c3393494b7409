//! Multipliers of large models, by perturbations that go through a period in equal steps.
//!
//! The steps are those of the two-stage method of Alexander (1977), an implicit Runge-Kutta method of
//! order 2. It damps motions that are fast beside a step, and hardly damps slow ones. With
//! `a = 1 / (gamma h)`, a stage moves all displacements y by d:
//!
//! ```text
//! (a^2 M + a C + K) d + lambda = a M v - K y    v -> a d
//! ```
//!
//! Displacements that the contact holds have d = 0 and no equation. If a rigid pair slips, its normal
//! displacement is held, and mu times the normal equation is added to those along the friction. The
//! modes are eliminated once for all steps. As many unknowns remain in a step as pairs slip and open.
//!
//! A block of perturbations goes through some periods. The motions that matter remain in it, and the
//! multipliers of its space are those of the largest moduli.

mod bodies;
mod period;
mod states;
mod step_laws;
#[cfg(test)]
mod tests;
mod turns;

use super::passage::{Passage, Prediction};
use super::{MOST_LEVELS, Reason, SHARE, Stability, agree, of_multiplier};
use crate::contact::coulomb::Contact;
use crate::damping::Rayleigh;
use crate::dlft::eps::Eps;
use crate::dlft::retention::{Holding, Mean};
use crate::dlft::settings::EpsChoice;
use crate::dlft::{CycleStatus, Orbit};
use crate::problem::Problem;
use crate::problem::dynamic_stiffness::ContactSystem;
use bodies::{Bodies, PairLaws};
use dovetail_numerics::fourier::Fourier;
use faer::{Mat, c64};
use period::Period;
use rayon::prelude::*;
use states::States;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use step_laws::{SAMPLES, StepLaw};
use turns::Mobility;

/// Coefficient of the stages.
const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;
/// Fewest steps in a period of the excitation and of the first mode.
const STEPS: usize = 16;
/// Steps in a period of the fastest mode that is kept.
const STEPS_OF_MODE: f64 = 3.0;
/// Number of perturbations at the start.
const WIDTH: usize = 16;
/// Most periods that a block goes through.
const MOST_PERIODS: usize = 8;
/// A pair sticks if it slides in a period by less than this fraction of its elastic displacement at the
/// limit of friction. Its memory decays so slowly that it would hide the other multipliers.
const HARDLY: f64 = 0.1;
/// Perturbations that have decayed to this share of the largest one in a period are left out, and those
/// that the next resolution begins with.
const DECAYED: [f64; 2] = [1e-4, 0.03];

/// Judges a motion.
pub(super) fn judged(
    problem: &Problem,
    damping: Rayleigh,
    orbit: &Orbit,
) -> Result<Stability, Reason> {
    let model = Model {
        problem,
        damping,
        orbit,
    };
    let mut steps = model.first_steps();
    let period = model.period(steps, 0.5)?;
    if period.bodies().columns() == 0 {
        return Ok(Stability {
            verdict: super::Verdict::Stable,
            multiplier: None,
        });
    }
    let start = States::start(period.bodies(), WIDTH);
    let mut names = period.bodies().names();
    let mut last = largest(&period, start, [DECAYED[0]; 2])?;
    for _ in 0..MOST_LEVELS {
        steps *= 2;
        let period = model.period(steps, 1.0)?;
        let known = std::mem::replace(&mut names, period.bodies().names());
        let start = last.images.renamed(&known, &names);
        let next = largest(&period, start, DECAYED)?;
        let are_found = last.is_found && next.is_found;
        if are_found && agree(last.multiplier, next.multiplier) {
            return Ok(of_multiplier(next.multiplier, true));
        }
        last = next;
    }
    Ok(of_multiplier(last.multiplier, false))
}

struct Model<'a> {
    problem: &'a Problem,
    damping: Rayleigh,
    orbit: &'a Orbit,
}

impl Model<'_> {
    fn omega(&self) -> f64 {
        TAU * self.orbit.frequency_hz
    }

    /// Steps of the first resolution.
    fn first_steps(&self) -> usize {
        let slowest = self.problem.reduced.omega2.iter().copied();
        let slowest = slowest.fold(f64::INFINITY, f64::min).sqrt() / self.omega();
        let excited = self.problem.highest_excited() as f64;
        let periods = if slowest.is_finite() {
            excited.max(slowest)
        } else {
            excited
        };
        STEPS * (periods.round() as usize).max(1)
    }

    /// Period in steps, with the eps of rigid pairs times a factor.
    fn period(&self, steps: usize, eps_scale: f64) -> Result<Period, Reason> {
        let omega = self.omega();
        let most_omega = steps as f64 / STEPS_OF_MODE * omega;
        let laws = self.laws(steps, eps_scale);
        let bodies = Bodies::new(self.problem, self.damping, laws, [omega, most_omega]);
        let neutral = self.neutral(&bodies);
        Period::new(bodies, neutral, steps, TAU / omega / steps as f64)
    }

    /// Laws of all pairs in the steps.
    fn laws(&self, steps: usize, eps_scale: f64) -> Vec<PairLaws> {
        let orbit = self.orbit;
        let fourier = Fourier::new(orbit.harmonics, SAMPLES * steps);
        let system = ContactSystem::new(self.problem, self.damping);
        let eps = Eps::new(EpsChoice::Dynamic).values(&system, self.omega(), orbit.harmonics);
        let mobility = Mobility::new(self.problem, orbit);
        let own = self.problem.reduced.diagonal_stiffness();
        let of = |number: usize| {
            let law = &self.problem.laws[number];
            match orbit.cycles[number].status {
                CycleStatus::Open => return PairLaws::Open,
                CycleStatus::Stuck => return PairLaws::Stuck,
                CycleStatus::Slipping if self.hardly_slips(number, own[3 * number + 1]) => {
                    return PairLaws::Stuck;
                }
                CycleStatus::Slipping | CycleStatus::Opening | CycleStatus::Closing => {}
            }
            let eps = [0, 1].map(|c| eps_scale * eps[3 * number + c]);
            let prediction = match law.stiffness {
                Some(s) => Prediction::of_springs(law, [s.normal_n_m, s.tangential_n_m]),
                None => Prediction::of_balance(law, eps),
            };
            let mut passage = Passage::new(orbit, number, &prediction, &fourier);
            let turns = mobility.turns(&mut passage, number, &fourier);
            let step_s = TAU / self.omega() / steps as f64;
            let laws = StepLaw::of_passage(&passage, &turns, step_s, law.stiffness.is_none());
            let all = |of: Contact| laws.iter().all(|law| law.contact == of && law.is_whole());
            match () {
                () if all(Contact::Open) => PairLaws::Open,
                () if all(Contact::Stick) => PairLaws::Stuck,
                () => PairLaws::Changing(laws),
            }
        };
        (0..orbit.cycles.len()).into_par_iter().map(of).collect()
    }

    /// Returns `true` if a pair with this stiffness of the bodies, N/m, slides by hardly more than nothing
    /// beside its elastic displacement at the limit of friction.
    fn hardly_slips(&self, number: usize, own_n_m: f64) -> bool {
        let (cycle, law) = (&self.orbit.cycles[number], &self.problem.laws[number]);
        let stiffness = match law.stiffness {
            Some(s) => 1.0 / (1.0 / own_n_m + 1.0 / s.tangential_n_m),
            None => own_n_m,
        };
        let limit_n = law.computed_friction() * cycle.compression_mean_n;
        stiffness * cycle.slid_m < HARDLY * limit_n
    }

    /// Motions that nothing holds but a spring on their means. The displacements along them do not
    /// change the motion, and do not count.
    fn neutral(&self, bodies: &Bodies) -> Mat<f64> {
        let holding = Holding::new(self.problem);
        let retained = self.orbit.mean == Mean::Retained;
        let retention = retained.then(|| holding.retention()).flatten();
        let motions = retention.map_or(&[][..], |retention| retention.motions());
        Mat::from_fn(bodies.displacements.len(), motions.len(), |i, j| {
            motions[j][bodies.displacements[i]]
        })
    }
}

/// Largest multiplier of a period.
struct Found {
    multiplier: c64,
    /// True if its residual is small enough.
    is_found: bool,
    /// Images of the space that the perturbations came to.
    images: States,
}

/// Largest multiplier of a period, by the space that these perturbations come to.
fn largest(
    period: &Period,
    start: States,
    [least, mut at_start]: [f64; 2],
) -> Result<Found, Reason> {
    let weights = period.bodies().weights();
    let mut images = start;
    let mut multiplier = c64::ZERO;
    for _ in 0..MOST_PERIODS {
        let basis = images.orthonormal(&weights, std::mem::replace(&mut at_start, least));
        let basis = basis.ok_or(Reason::NotFound)?;
        images = period.advance(&basis);
        let ritz = basis.ritz(&images, &weights)?;
        multiplier = ritz.multiplier;
        if ritz.residual < 0.25 * SHARE * (multiplier.norm() - 1.0).abs() {
            return Ok(Found {
                multiplier,
                is_found: true,
                images,
            });
        }
    }
    Ok(Found {
        multiplier,
        is_found: false,
        images,
    })
}
