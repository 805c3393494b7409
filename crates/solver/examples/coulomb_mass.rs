//! A mass on a spring rubs on the ground: one contact pair, as a reduced model written by hand.
//!
//! Mass, stiffness and amplitude of the force are 1. Den Hartog (1931) has the amplitude in closed
//! form; harmonic balance approaches it as harmonics are added.
//!
//!     cargo run --release --package dovetail-solver --example coulomb_mass

use std::f64::consts::{PI, TAU};

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel};
use faer::Mat;

/// Ratio of the frequency of the force to that of the mass on its spring.
const RATIO: f64 = 0.7;
/// Coefficient of friction; the mass is pressed on the ground with 1 N.
const FRICTION: f64 = 0.2;

fn main() {
    println!("{:.6} m in closed form", closed_form_m());
    for harmonics in [1, 3, 9, 31] {
        println!("{:.6} m with {harmonics} harmonics", amplitude_m(harmonics));
    }
}

/// Amplitude of the motion without stops.
pub fn closed_form_m() -> f64 {
    let angle = PI / RATIO;
    let lost = FRICTION * angle.sin() / (RATIO * (1.0 + angle.cos()));
    let free = 1.0 / (1.0 - RATIO * RATIO);
    (free * free - lost * lost).sqrt()
}

/// Amplitude by harmonic balance.
pub fn amplitude_m(harmonics: usize) -> f64 {
    // A pair has three relative displacements: the normal one, and two along the ground.
    let identity = || Mat::from_fn(3, 3, |i, j| if i == j { 1.0 } else { 0.0 });
    let along_ground = || vec![0.0, 1.0, 0.0];
    let load = |on_x: Vec<f64>| Load::new(on_x, vec![]);
    let model = Problem {
        reduced: ReducedModel {
            // Compression is negative.
            static_load: load(vec![-1.0, 0.0, 0.0]),
            observations: vec![ObservedPoint::new("mass", along_ground(), vec![])],
            // Nothing moves while the pair sticks: there are no stuck modes.
            ..ReducedModel::of_pairs(identity(), identity())
        }
        .into(),
        laws: vec![PairLaw::rigid(FRICTION, 0.0)],
        excitations: vec![HarmonicLoad::cosine(1, load(along_ground()))],
        modal_ratios: Vec::new(),
    };
    let undamped = Rayleigh::NONE;
    let newton = NewtonOptions::new(1e-10, 60);
    let state = static_state(&model, 10, newton);
    let resolution = Resolution::fixed(harmonics, 512);
    let settings = SweepSettings::new(vec![RATIO / TAU], resolution);
    let response = sweep(&model, undamped, &state, &settings, &[], &|_| ());
    let orbit = &response.orbits[0];
    assert!(orbit.outcome.is_converged(), "{:?}", orbit.outcome);
    orbit.observed_amplitude[0]
}
