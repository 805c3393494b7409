//! A mass in front of a stop: the response folds, and is followed along its length.
//!
//! The mass is 1 kg on a spring of 1 N/m. The stop is a spring of 5 N/m without friction, 1 m away.
//! The example prints frequency and amplitude of each point; where the frequency turns back the
//! motion is unstable.
//!
//!     cargo run --release --package dovetail-dynamics --example folded_curve

use dovetail_dynamics::prelude::*;

fn main() -> Result<(), ResponseError> {
    println!("frequency_hz,amplitude_m");
    for (frequency_hz, amplitude_m) in curve()? {
        println!("{frequency_hz:.6},{amplitude_m:.6}");
    }
    Ok(())
}

/// Frequency and amplitude of each point, in the order in which the branch runs.
pub fn curve() -> Result<Vec<(f64, f64)>, ResponseError> {
    // A pair has three relative displacements: the normal one, and two along the stop.
    let identity = Mat::identity(3, 3);
    let model = ReducedModel::from_pair_matrices(identity.clone(), identity)
        .unit_load([1.0, 0.0, 0.0])
        .observe("mass", [1.0, 0.0, 0.0]);
    let stop = PairLaw::rigid(0.0, 1.0).springs(5.0, 1.0);
    let problem = Problem::uniform(model, stop, 0.1);
    let mut response = ForcedResponse::new(&problem)
        .damping(DampingSpec::Rayleigh {
            stiffness_s: 0.0,
            mass_per_s: 0.03,
        })
        .resolution(Resolution::fixed(15, 512))
        .range_hz(0.1, 0.4);
    response.settings().slip_threshold_m = Some(1e-9);
    let points = response.solve()?.response.orbits;
    let point = |orbit: &Orbit| (orbit.frequency_hz, orbit.observed_amplitude[0]);
    Ok(points.iter().map(point).collect())
}
