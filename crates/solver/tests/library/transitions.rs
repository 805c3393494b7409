//! Robust where pairs stick, slip and lift off: frequency steps wider than the resonance, warm and
//! cold starts, four forces and five choices of harmonics and samples, on the 72-pair reference
//! model. Every point converges, its mean near the static state.

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::dlft::retention::Mean;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};

use crate::shared_problems::{damping_of, dovetail72};

const NEWTON: NewtonOptions = NewtonOptions::new(1e-9, 60);
const RATIOS: [f64; 6] = [0.985, 0.995, 0.998, 0.9995, 1.0005, 1.003];

/// Solves the six frequencies one after the other (warm) and each alone (cold) for every force and
/// returns (cases, failures, Newton iterations).
fn cases(harmonics: usize, samples: usize) -> (usize, usize, usize) {
    let (mut count, mut failures, mut iterations, mut held) = (0, 0, 0, 0);
    for force_n in [0.1, 1.0, 1.5, 3.0] {
        let model = dovetail72(PairLaw::rigid(0.3, 0.0), force_n);
        let first = model.reduced.omega2[0].sqrt();
        let state = static_state(&model, 10, NEWTON);
        let frequencies = RATIOS.map(|r| r * first / std::f64::consts::TAU);
        // The upper half of a sweep starts from its end: six frequencies beyond keep these in
        // order.
        let warm: Vec<f64> = frequencies
            .into_iter()
            .chain([1.5 * frequencies[5]; 6])
            .collect();
        let cold = frequencies.map(|f| vec![f]);
        for frequencies_hz in cold.into_iter().chain([warm]) {
            let mut settings =
                SweepSettings::new(frequencies_hz, Resolution::fixed(harmonics, samples));
            settings.newton = NEWTON;
            let response = sweep(&model, damping_of(&model), &state, &settings, &[], &|_| ());
            for orbit in response.orbits.iter().take(RATIOS.len()) {
                count += 1;
                iterations += orbit.newton_iterations;
                let apart = |(x, s): (&f64, &f64)| (x - s).abs();
                let strayed_m = orbit.x.iter().zip(&state.x).map(apart).fold(0.0, f64::max);
                assert!(
                    strayed_m < 1e-3,
                    "{force_n} N, {} Hz: the mean is {strayed_m} m from the static state",
                    orbit.frequency_hz
                );
                held += usize::from(orbit.mean == Mean::Retained);
                if !orbit.outcome.is_converged() {
                    failures += 1;
                    println!(
                        "{force_n} N, {} Hz: {:?}",
                        orbit.frequency_hz, orbit.outcome
                    );
                }
            }
        }
    }
    println!(
        "H {harmonics}, N {samples}: {count} cases, {failures} failures, {iterations} iterations, {held} held"
    );
    (count, failures, iterations)
}

#[test]
#[ignore = "slow: 1024 samples"]
fn one_harmonic_many_samples() {
    assert_eq!(cases(1, 1024).1, 0);
}

#[test]
fn three_harmonics_few_samples() {
    assert_eq!(cases(3, 128).1, 0);
}

#[test]
#[ignore = "slow: 1024 samples"]
fn three_harmonics_many_samples() {
    assert_eq!(cases(3, 1024).1, 0);
}

#[test]
fn seven_harmonics_few_samples() {
    assert_eq!(cases(7, 128).1, 0);
}

#[test]
#[ignore = "slow: 256 samples"]
fn seven_harmonics_many_samples() {
    assert_eq!(cases(7, 256).1, 0);
}
