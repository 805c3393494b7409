//! Stability of a periodic response: whether small perturbations of it die away.
//!
//! A perturbation grows by the Floquet multipliers in a period, the eigenvalues of the monodromy
//! matrix. Its equations are linear from one change of a pair's status to the next. With y all
//! displacements, x the displacement of a pair, w its slider, k its springs and e the direction of its
//! friction force:
//!
//! ```text
//! M y'' + C y' + K y + sum lambda = 0
//! open     lambda = 0                                    w = x_T
//! stick    lambda_N = k_N x_N   lambda_T = k_T (x_T - w)   w' = 0
//! slip     lambda_N = k_N x_N   lambda_e = -mu lambda_N    lambda_across = k_T (x - w)_across
//!          w_across' = k_T v / (mu N) (x - w)_across
//! ```
//!
//! with v the speed of the slider and N the compression in the motion itself. `passage` follows each
//! pair through the known motion, and `monodromy` multiplies the exponentials of these equations. A
//! pair that lands and sticks keeps the place of its landing, which moves with the instant.
//!
//! The motion is solved again with more harmonics (`finer`) until the verdict stays.
//!
//! A rigid pair that sticks throughout has no displacement, and an elastic one is a constant spring.
//! A rigid pair that slips has springs and dashpots so stiff that they no longer matter.
//!
//! Models of many pairs, with rigid pairs that land, with a retained mean, or without mass in some
//! direction are judged by steps in time of a few perturbations (`large`). There, rigid contact is a
//! constraint, and a pair that lands does not rebound. The law says nothing of a rebound: a motion is
//! not judged if the pairs that land have much of its energy.

pub use self::two_periods::two_periods;
pub use crate::dlft::verdict::{Kind, Reason, Stability, Verdict};

mod equations;
mod finer;
mod large;
mod monodromy;
mod passage;
#[cfg(test)]
mod tests;
mod two_periods;

use crate::damping::Rayleigh;
use crate::dlft::retention::Mean;
use crate::dlft::{CycleStatus, Orbit, StaticState};
use crate::problem::Problem;
use dovetail_numerics::spectrum::Spectrum;
use faer::c64;
use finer::{Finer, finer};
use monodromy::Resolution;
use std::f64::consts::TAU;

/// Angle to the negative real axis, or to the positive one, within which a multiplier lies on it, rad.
const REAL: f64 = 1e-6;
/// Most times that the harmonics are doubled.
const MOST_LEVELS: usize = 3;
/// Share of the distance from the unit circle by which two multipliers of one verdict may differ.
const SHARE: f64 = 0.6;
/// Share of the kinetic energy that landing rigid pairs may have. The law says nothing of their rebound,
/// which must not matter.
const REBOUND: f64 = 0.01;
/// Least distance from the unit circle at which a motion is judged.
const LEAST: f64 = 1e-6;

/// Judges a periodic motion of `problem` about its static state that a force excites, as the balance of
/// one frequency gives it.
///
/// The motion of a small model is solved again with more harmonics, until two in a row have one verdict.
/// Each of them needs an exponential of a matrix of twice the number of unknowns for each change of a
/// pair, and some hundred if a pair slips. A large model is judged with two numbers of steps in a
/// period, and each step needs a factor of the equations of the pairs that slip and open.
pub fn judge(
    problem: &Problem,
    damping: Rayleigh,
    state: &StaticState,
    orbit: &Orbit,
) -> Stability {
    match judged(problem, damping, state, orbit) {
        Ok(stability) => stability,
        Err(reason) => Stability::not_judged(reason),
    }
}

fn judged(
    problem: &Problem,
    damping: Rayleigh,
    state: &StaticState,
    orbit: &Orbit,
) -> Result<Stability, Reason> {
    if let Some(reason) = reason_against(problem, orbit) {
        return Err(reason);
    }
    if orbit.mean == Mean::Retained {
        // The drift that the retention prevents is no instability of the vibration.
        let stability = large::judged(problem, damping, orbit)?;
        return match stability.is_stable() {
            Some(false) => Err(Reason::Retained),
            _ => Ok(stability),
        };
    }
    match judged_by_exponentials(problem, damping, state, orbit) {
        Err(Reason::TooLarge | Reason::Massless | Reason::Landing) => {
            large::judged(problem, damping, orbit)
        }
        found => found,
    }
}

/// Verdict by the exponentials of the equations, which do not cover rigid pairs that land.
fn judged_by_exponentials(
    problem: &Problem,
    damping: Rayleigh,
    state: &StaticState,
    orbit: &Orbit,
) -> Result<Stability, Reason> {
    let multiplier = |orbit: &Orbit, resolution| match landing(problem, orbit).next() {
        Some(_) => Err(Reason::Landing),
        None => monodromy::largest(problem, damping, orbit, resolution),
    };
    let Some(mut last) = multiplier(orbit, Resolution::FINE)? else {
        return Ok(Stability {
            verdict: Verdict::Stable,
            multiplier: None,
        });
    };
    if !last.changes {
        return Ok(of_multiplier(last.multiplier, true));
    }
    let mut motion = Box::new(orbit.clone());
    for level in 0..MOST_LEVELS {
        match finer(problem, damping, state, &motion) {
            Finer::Found(finer) => motion = finer,
            // At least the resolution and the prediction of the pairs must not matter.
            Finer::TooLarge if level == 0 => {
                let control = multiplier(orbit, Resolution::COARSE)?;
                let is_sure = control.is_some_and(|c| agree(last.multiplier, c.multiplier));
                return Ok(of_multiplier(last.multiplier, is_sure));
            }
            Finer::TooLarge | Finer::NotFound => break,
        }
        let Some(next) = multiplier(&motion, Resolution::FINE)? else {
            break;
        };
        if agree(last.multiplier, next.multiplier) {
            return Ok(of_multiplier(next.multiplier, true));
        }
        last = next;
    }
    Ok(of_multiplier(last.multiplier, false))
}

/// Returns `true` if two multipliers give one verdict, and differ by less than a share of the distance
/// from the unit circle.
fn agree(one: c64, other: c64) -> bool {
    let [one, other] = [one, other].map(|m| m.norm() - 1.0);
    let distance = one.abs().min(other.abs());
    one * other > 0.0
        && (one - other).abs() < SHARE * one.abs().max(other.abs())
        && distance > LEAST
}

fn of_multiplier(multiplier: c64, is_sure: bool) -> Stability {
    // A motion without damping has multipliers on the unit circle.
    let is_off = (multiplier.norm() - 1.0).abs() > LEAST;
    Stability {
        verdict: match is_sure && is_off {
            true => verdict_of(multiplier),
            false => Verdict::NotJudged(Reason::TooNear),
        },
        multiplier: Some(multiplier),
    }
}

fn reason_against(problem: &Problem, orbit: &Orbit) -> Option<Reason> {
    let reduced = &problem.reduced;
    if !orbit.outcome.has_motion() {
        return Some(Reason::NoMotion);
    }
    if !reduced.dashpots.influenced().is_empty() {
        return Some(Reason::Influence);
    }
    if reduced.waves.excitation().is_some() {
        return Some(Reason::Waves);
    }
    (share_of_landings(problem, orbit) > REBOUND).then_some(Reason::Landing)
}

/// Numbers of the rigid pairs that open and land.
fn landing(problem: &Problem, orbit: &Orbit) -> impl Iterator<Item = usize> {
    let pairs = orbit.cycles.iter().zip(&problem.laws).enumerate();
    pairs.filter_map(|(pair, (cycle, law))| {
        let opens = matches!(cycle.status, CycleStatus::Opening | CycleStatus::Closing);
        (opens && law.stiffness.is_none()).then_some(pair)
    })
}

/// Most kinetic energy of the rigid pairs that land, by their own masses and normal velocities, over
/// the mean kinetic energy of the motion.
fn share_of_landings(problem: &Problem, orbit: &Orbit) -> f64 {
    let motion = Spectrum::new(&orbit.x, orbit.harmonics);
    let energy = |pair: usize| {
        let normal = 3 * pair;
        let rates = (1..=orbit.harmonics)
            .map(|k| k as f64 * motion.cosine(k)[normal].hypot(motion.sine(k)[normal]));
        let velocity = TAU * orbit.frequency_hz * rates.sum::<f64>();
        0.5 * problem.reduced.mass[(normal, normal)] * velocity * velocity
    };
    let landing: f64 = landing(problem, orbit).map(energy).sum();
    if landing > 0.0 {
        landing / orbit.kinetic_energy_j
    } else {
        0.0
    }
}

fn verdict_of(multiplier: c64) -> Verdict {
    if multiplier.norm() < 1.0 {
        return Verdict::Stable;
    }
    let angle = multiplier.arg().abs();
    Verdict::Unstable(if angle < REAL {
        Kind::Real
    } else if angle > std::f64::consts::PI - REAL {
        Kind::PeriodDoubling
    } else {
        Kind::NeimarkSacker
    })
}
