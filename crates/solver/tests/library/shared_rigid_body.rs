//! Rigid body on a spring, pressed onto rigid ground and excited at its base, and its motion by
//! steps in time.

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::integration::steady::{SteadyMotion, Until, integrate};
use dovetail_solver::integration::step::{MotionState, Stepper};
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel};
use faer::Mat;
use std::f64::consts::TAU;
use std::sync::Mutex;

pub const DAMPING: Rayleigh = Rayleigh::mass_proportional(20.0);
pub const NEWTON: NewtonOptions = NewtonOptions::new(1e-8, 60);
pub const SPRING_HZ: f64 = 100.0;
pub const BASE_M_S2: f64 = 76.9;

/// A rigid body on a spring, pressed onto rigid ground with 1 N and excited at its base.
pub fn body(mass_kg: f64, friction: f64) -> Problem {
    let diagonal = |value: f64| Mat::from_fn(3, 3, |i, j| if i == j { value } else { 0.0 });
    let load = |force_n: f64| Load::new(vec![0.0, force_n, 0.0], vec![]);
    Problem {
        reduced: ReducedModel {
            static_load: Load::new(vec![-1.0, 0.0, 0.0], vec![]),
            observations: vec![ObservedPoint::new("cube", vec![0.0, 1.0, 0.0], vec![])],
            ..ReducedModel::from_pair_matrices(
                diagonal(mass_kg * (TAU * SPRING_HZ).powi(2)),
                diagonal(mass_kg),
            )
        }
        .into(),
        laws: vec![PairLaw::rigid(friction, 0.0)],
        excitations: vec![HarmonicLoad::cosine(1, load(mass_kg * BASE_M_S2))],
        modal_ratios: Vec::new(),
    }
}

/// Motion by steps in time from the static state, of so many steps in a period.
pub fn settled_from_rest(
    model: &Problem,
    damping: Rayleigh,
    frequency_hz: f64,
    steps: usize,
    until: Until,
) -> SteadyMotion {
    let mut stepper = Stepper::new(model, damping, frequency_hz, steps).unwrap();
    let rest = static_state(model, 10, NEWTON);
    let mut state = MotionState::resting(model, &rest.x, &rest.lambda);
    integrate(&mut stepper, &mut state, until).unwrap()
}

/// Amplitude of a rigid body on a spring of 100 Hz, of so much mass and limit of friction, by steps
/// in time from the static state. What was integrated once is remembered.
pub fn amplitude_in_time_m(mass_kg: f64, friction_n: f64, frequency_hz: f64) -> f64 {
    static KNOWN: Mutex<Vec<([f64; 3], f64)>> = Mutex::new(Vec::new());
    let motion = [mass_kg, friction_n, frequency_hz];
    let known = KNOWN
        .lock()
        .unwrap()
        .iter()
        .find(|k| k.0 == motion)
        .copied();
    if let Some((_, amplitude_m)) = known {
        return amplitude_m;
    }
    let model = body(mass_kg, friction_n);
    let until = Until::new(2000, 1e-7);
    let settled = settled_from_rest(&model, DAMPING, frequency_hz, 8000, until);
    assert!(settled.transient_left < 1e-4, "{settled:?}");
    let amplitude_m = settled.cycle.observed[0].amplitude_m;
    KNOWN.lock().unwrap().push((motion, amplitude_m));
    amplitude_m
}
