//! A mass on a spring rubs on the ground: one contact pair, as a reduced model written by hand.
//!
//! Mass, stiffness and amplitude of the force are 1. Den Hartog (1931) has the amplitude in closed
//! form; harmonic balance approaches it as harmonics are added.
//!
//!     cargo run --release --package dovetail-dynamics --example coulomb_mass

use std::f64::consts::{PI, TAU};

use dovetail_dynamics::prelude::*;

/// Ratio of the frequency of the force to that of the mass on its spring.
const RATIO: f64 = 0.7;
/// Coefficient of friction; the mass is pressed on the ground with 1 N.
const FRICTION: f64 = 0.2;

fn main() -> Result<(), ResponseError> {
    println!("{:.6} m in closed form", closed_form_m());
    for harmonics in [1, 3, 9, 31] {
        let amplitude_m = amplitude_m(harmonics)?;
        println!("{amplitude_m:.6} m with {harmonics} harmonics");
    }
    Ok(())
}

/// Amplitude of the motion without stops.
pub fn closed_form_m() -> f64 {
    let angle = PI / RATIO;
    let lost = FRICTION * angle.sin() / (RATIO * (1.0 + angle.cos()));
    let free = 1.0 / (1.0 - RATIO * RATIO);
    (free * free - lost * lost).sqrt()
}

/// Amplitude by harmonic balance.
pub fn amplitude_m(harmonics: usize) -> Result<f64, ResponseError> {
    // A pair has three relative displacements: the normal one, and two along the ground. Nothing
    // moves while the pair sticks, so there are no modes.
    let identity = Mat::identity(3, 3);
    let model = ReducedModel::from_pair_matrices(identity.clone(), identity)
        .static_load([-1.0, 0.0, 0.0]) // compression is negative
        .unit_load([0.0, 1.0, 0.0])
        .observe("mass", [0.0, 1.0, 0.0]);
    let problem = Problem::uniform(model, PairLaw::rigid(FRICTION, 0.0), 1.0);
    let solved = ForcedResponse::new(&problem)
        .resolution(Resolution::fixed(harmonics, 512))
        .frequencies_hz([RATIO / TAU])
        .solve()?;
    let orbit = &solved.response.orbits[0];
    assert!(orbit.outcome.is_converged(), "{:?}", orbit.outcome);
    Ok(orbit.observed_amplitude[0])
}
