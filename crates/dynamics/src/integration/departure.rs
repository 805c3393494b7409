//! Motion that an unstable periodic response departs to.

use super::IntegrationError;
use super::compare::{add_retention_force, perturbed_state};
use super::steady::one_period;
use super::step::{MotionState, Stepper};
use crate::damping::Rayleigh;
use crate::dlft::retention::Mean;
use crate::dlft::{Orbit, Outcome};
use crate::problem::Problem;
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::vector::norm;

/// Steps of a period.
const STEPS: usize = 500;
/// Fraction by which the departure of the motion from its mean is larger at the start.
const PERTURBATION: f64 = 1e-3;

/// Amplitudes of single periods after a periodic response was left to itself.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Departure {
    /// Frequency of the excitation, Hz.
    pub frequency_hz: f64,
    /// Periods that were integrated.
    pub periods: usize,
    /// Least and largest amplitude of each observed displacement in the second half of these periods,
    /// m.
    pub amplitude_range_m: Vec<[f64; 2]>,
    /// Displacements of the last two periods as a motion of half the frequency, with twice the harmonics
    /// of the response; `None` where the integration did not settle to twice the period.
    pub(crate) doubled: Option<Orbit>,
}

/// Integrates in time from a motion that is made larger by 0.1 %, for at most `most_periods` periods, until
/// `ends` returns `true`, and for two periods at least. Travelling waves on a disc are not integrated.
///
/// # Errors
/// See [`IntegrationError`]; [`IntegrationError::Influence`] also for a travelling wave.
pub fn depart(
    problem: &Problem,
    damping: Rayleigh,
    orbit: &Orbit,
    most_periods: usize,
    ends: &dyn Fn() -> bool,
) -> Result<Departure, IntegrationError> {
    let is_alone = problem.reduced.dashpots.influenced().is_empty();
    if !is_alone || problem.reduced.waves.excitation().is_some() {
        return Err(IntegrationError::Influence);
    }
    let retained = match orbit.mean {
        Mean::Free => None,
        Mean::Retained => Some(add_retention_force(problem, orbit)),
    };
    let problem = retained.as_ref().unwrap_or(problem);
    let mut stepper = Stepper::new(problem, damping, orbit.frequency_hz, STEPS)?;
    let mut state = perturbed_state(problem, orbit, PERTURBATION);
    stepper.prepare(&state);
    let mut amplitudes: Vec<Vec<f64>> = Vec::new();
    while amplitudes.len() < most_periods && (amplitudes.len() < 2 || !ends()) {
        let period = amplitudes.len() + 1;
        let cycle = one_period(&mut stepper, &mut state, period)?;
        if !state.is_finite() {
            let frequency_hz = orbit.frequency_hz;
            return Err(IntegrationError::NotFinite {
                frequency_hz,
                period,
            });
        }
        amplitudes.push(cycle.observed.iter().map(|o| o.amplitude_m).collect());
    }
    let doubled = doubled(&mut stepper, &mut state, orbit);
    let later = &amplitudes[amplitudes.len() / 2..];
    let range = |i: usize| {
        let all = later.iter().map(|period| period[i]);
        all.fold([f64::INFINITY, 0.0], |[least, most]: [f64; 2], a| {
            [least.min(a), most.max(a)]
        })
    };
    Ok(Departure {
        frequency_hz: orbit.frequency_hz,
        periods: amplitudes.len(),
        amplitude_range_m: (0..orbit.observed.len()).map(range).collect(),
        doubled,
    })
}

/// Largest change of the state from one pair of periods to the next, relative to its change from period
/// to period, at which the motion has twice the period.
const SETTLED: f64 = 0.05;

/// Motion over the next two periods, if it repeats after them and not after one.
fn doubled(stepper: &mut Stepper<'_>, state: &mut MotionState, orbit: &Orbit) -> Option<Orbit> {
    let instants = 2 * STEPS;
    let mut history: Vec<Vec<f64>> = Vec::with_capacity(instants + 1);
    for instant in 0..instants {
        history.push(state.x.clone());
        stepper.advance(state, instant % STEPS).ok()?;
    }
    let far = |from: &[f64], to: &[f64]| {
        let change: Vec<f64> = from.iter().zip(to).map(|(a, b)| a - b).collect();
        norm(&change)
    };
    let [apart, left] = [&history[STEPS], &state.x].map(|x| far(x, &history[0]));
    if left.is_nan() || left >= SETTLED * apart {
        return None;
    }
    // More harmonics than the steps carry begin at zero.
    let (n, harmonics) = (state.x.len(), (2 * orbit.harmonics).min(STEPS - 1));
    let fourier = Fourier::new(harmonics, instants);
    let mut x = vec![0.0; fourier.width() * n];
    let mut coefficients = vec![0.0; fourier.width()];
    for i in 0..n {
        let signal: Vec<f64> = history.iter().map(|x| x[i]).collect();
        fourier.to_frequency(&signal, &mut coefficients);
        for (block, coefficient) in coefficients.iter().enumerate() {
            x[block * n + i] = *coefficient;
        }
    }
    Some(Orbit {
        harmonics,
        x,
        mean: orbit.mean,
        ..Orbit::motionless(0.5 * orbit.frequency_hz, Outcome::Converged)
    })
}
