//! Two masses on springs, of which the first rubs on rigid ground. The balance has 3 (2H+1)
//! unknowns. It is solved at any frequency, from its neighbour or cold, within few iterations, and
//! its error is estimated.

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::sweep::SweepSettings;
use dovetail_solver::dlft::{Orbit, Outcome};
use dovetail_solver::integration::steady::Until;
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel};
use faer::Mat;
use std::time::Instant;

use crate::shared_problems::{self, diagonal};
use crate::shared_rigid_body::settled_from_rest;

const DAMPING: Rayleigh = Rayleigh::mass_proportional(0.02);
const NEWTON: NewtonOptions = NewtonOptions::new(1e-8, 60);

/// Both masses weigh 1 kg. A spring of 1 N/m holds the first, which presses on the ground with 1 N;
/// another joins the second to it. A force of 1 N excites the second, whose motion is observed.
fn two_masses(friction: f64) -> Problem {
    let load = |force_n: f64| Load::new(vec![0.0, force_n, 0.0], vec![force_n]);
    Problem {
        reduced: ReducedModel {
            static_load: Load::new(vec![-1.0, 0.0, 0.0], vec![0.0]),
            observations: vec![ObservedPoint::new("second", vec![0.0, 1.0, 0.0], vec![1.0])],
            ..ReducedModel::new(
                diagonal([1.0, 1.0, 1.0]),
                diagonal([0.0, 2.0, 2.0]),
                Mat::from_fn(3, 1, |i, _| if i == 1 { 1.0 } else { 0.0 }),
                vec![1.0],
            )
        }
        .into(),
        laws: vec![PairLaw::rigid(friction, 0.0)],
        excitations: vec![HarmonicLoad::cosine(1, load(1.0))],
        modal_ratios: Vec::new(),
    }
}

/// Error of the integration, which is of first order in its step.
const OF_INTEGRATION: f64 = 3e-3;

fn respond(friction: f64, frequencies_hz: Vec<f64>, harmonics: usize) -> Vec<Orbit> {
    let model = two_masses(friction);
    let resolution = Resolution::fixed(harmonics, 16 * harmonics);
    let mut settings = SweepSettings::new(frequencies_hz, resolution);
    settings.slip_threshold_m = Some(1e-9);
    settings.newton = NEWTON;
    shared_problems::respond(&model, DAMPING, &settings).orbits
}

fn range(count: u32) -> Vec<f64> {
    let step = 0.28 / f64::from(count - 1);
    (0..count).map(|i| 0.05 + step * f64::from(i)).collect()
}

/// Newton iterations of the frequency that took most, of so many from their neighbours and so many
/// cold. Prints the seconds that they took from their neighbours, on average, and cold, at most.
fn most_iterations(friction: f64, harmonics: usize, [warm, cold]: [u32; 2]) -> usize {
    let began = Instant::now();
    let from_neighbours = respond(friction, range(warm), harmonics);
    let warm_s = began.elapsed().as_secs_f64() / f64::from(warm);
    let mut cold_s = 0.0_f64;
    let alone: Vec<Orbit> = range(cold)
        .into_iter()
        .flat_map(|hz| {
            let began = Instant::now();
            let orbits = respond(friction, vec![hz], harmonics);
            cold_s = cold_s.max(began.elapsed().as_secs_f64());
            orbits
        })
        .collect();
    let mut most = 0;
    for orbit in from_neighbours.into_iter().chain(alone) {
        let hz = orbit.frequency_hz;
        let what = format!("mu {friction}, H {harmonics}, {hz} Hz");
        assert_eq!(orbit.outcome, Outcome::Converged, "{what}");
        assert!(orbit.estimated_error.unwrap().is_finite(), "{what}");
        most = most.max(orbit.newton_iterations);
    }
    println!(
        "mu {friction}, H {harmonics}: at most {most} Newton iterations; from neighbours {warm_s:.2} s a frequency, \
         cold at most {cold_s:.2} s"
    );
    most
}

#[test]
fn two_masses_with_rigid_friction_are_solved_in_few_iterations_warm_and_cold() {
    for friction in [0.05, 0.3, 1.0] {
        for (harmonics, points) in [(7, [21, 8]), (15, [11, 4])] {
            assert!(most_iterations(friction, harmonics, points) <= 240);
        }
    }
}

#[test]
#[ignore = "slow: make verify"]
fn two_masses_are_solved_at_more_frequencies_and_with_31_and_63_harmonics_too() {
    for friction in [0.05, 0.3, 1.0] {
        for (harmonics, most) in [(15, 240), (31, 480), (63, 480)] {
            assert!(most_iterations(friction, harmonics, [21, 8]) <= most);
        }
    }
}

#[test]
fn two_masses_with_rigid_friction_move_as_by_steps_in_time() {
    for (friction, hz) in [(0.3, 0.12), (0.3, 0.2), (1.0, 0.25)] {
        let orbit = respond(friction, vec![hz], 31).remove(0);
        let model = two_masses(friction);
        let until = Until::new(3000, 1e-6);
        let settled = settled_from_rest(&model, DAMPING, hz, 2000, until);
        let exact_m = settled.cycle.observed[0].amplitude_m;
        let error = (orbit.observed_amplitude[0] / exact_m - 1.0).abs();
        println!(
            "mu {friction}, {hz} Hz: {exact_m:.5} m, off by {error:.1e}, estimated {:.1e}",
            orbit.estimated_error.unwrap()
        );
        assert!(settled.transient_left < 1e-3, "{settled:?}");
        assert!(error < orbit.estimated_error.unwrap() + OF_INTEGRATION);
    }
}
