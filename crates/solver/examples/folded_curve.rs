//! A mass in front of a stop: the response folds, and is followed along its length.
//!
//! The mass is 1 kg on a spring of 1 N/m. The stop is a spring of 5 N/m without friction, 1 m away.
//! The example prints frequency and amplitude of each point; where the frequency turns back the
//! motion is unstable.
//!
//!     cargo run --release --package dovetail-solver --example folded_curve

use dovetail_solver::contact::PairLaw;
use dovetail_solver::contact::penalty::PairStiffness;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::branch::follow;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::SweepSettings;
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel};
use faer::Mat;

fn main() {
    println!("frequency_hz,amplitude_m");
    for (frequency_hz, amplitude_m) in curve() {
        println!("{frequency_hz:.6},{amplitude_m:.6}");
    }
}

/// Frequency and amplitude of each point, in the order in which the branch runs.
pub fn curve() -> Vec<(f64, f64)> {
    // A pair has three relative displacements: the normal one, and two along the stop.
    let identity = || Mat::from_fn(3, 3, |i, j| if i == j { 1.0 } else { 0.0 });
    let normal = |size: f64| vec![size, 0.0, 0.0];
    let problem = Problem {
        reduced: ReducedModel {
            observations: vec![ObservedPoint::new("mass", normal(1.0), vec![])],
            ..ReducedModel::of_pairs(identity(), identity())
        }
        .into(),
        laws: vec![PairLaw {
            stiffness: Some(PairStiffness::new(5.0, 1.0)),
            ..PairLaw::rigid(0.0, 1.0)
        }],
        excitations: vec![HarmonicLoad::cosine(1, Load::new(normal(0.1), vec![]))],
        modal_ratios: Vec::new(),
    };
    let mut settings = SweepSettings::new(vec![0.1, 0.4], Resolution::fixed(15, 512));
    settings.slip_threshold_m = Some(1e-9);
    let state = static_state(&problem, 1, settings.newton);
    let damping = Rayleigh::of_mass(0.03);
    let response = follow(&problem, damping, &state, &settings, &[], &|_| ());
    let points = response.orbits.iter();
    points
        .map(|orbit| (orbit.frequency_hz, orbit.observed_amplitude[0]))
        .collect()
}
