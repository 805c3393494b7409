//! A rigid cube that slides on rigid ground in most of the period, on a spring, excited at its
//! base. Friction reverses twice in a period, at instants between the samples.

use crate::shared_problems::respond;
use crate::shared_rigid_body::{DAMPING, NEWTON, amplitude_in_time_m, body};
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::settings::{EpsChoice, Resolution};
use dovetail_solver::dlft::sweep::SweepSettings;
use dovetail_solver::dlft::{Orbit, Outcome};

/// A cube of steel with sides of 10 mm.
const MASS_KG: f64 = 7.8e-3;
/// Limit of friction, mu N.
const FRICTION_N: f64 = 0.3;
const FREQUENCIES_HZ: [f64; 4] = [60.0, 90.0, 120.0, 150.0];

fn solve(frequency_hz: f64, resolution: Resolution, eps_scale: f64) -> Orbit {
    let model = body(MASS_KG, FRICTION_N);
    let mut settings = SweepSettings::new(vec![frequency_hz], resolution);
    settings.eps = Eps {
        choice: EpsChoice::Dynamic,
        scale: eps_scale,
    };
    settings.newton = NEWTON;
    settings.slip_threshold_m = Some(1e-9);
    respond(&model, DAMPING, &settings).orbits.remove(0)
}

fn integrated_m(frequency_hz: f64) -> f64 {
    amplitude_in_time_m(MASS_KG, FRICTION_N, frequency_hz)
}

/// Error of the integration, which is of first order in its step.
const OF_INTEGRATION: f64 = 1e-3;

#[test]
fn a_cube_in_gross_slip_is_within_its_accuracy_or_says_that_it_is_not() {
    for hz in FREQUENCIES_HZ {
        let exact_m = integrated_m(hz);
        for (accuracy, eps_scale) in [(0.05, 1.0), (0.05, 1000.0), (0.01, 1.0), (0.01, 1000.0)] {
            let orbit = solve(hz, Resolution::Accuracy(accuracy), eps_scale);
            let error = (orbit.observed_amplitude[0] / exact_m - 1.0).abs();
            let estimated = orbit.estimated_error.unwrap();
            println!(
                "{hz} Hz, to {accuracy}, eps x {eps_scale}: {:.2} um, H {}, off by {error:.1e}, estimated {estimated:.1e}",
                1e6 * exact_m,
                orbit.harmonics
            );
            assert!(orbit.outcome.has_motion(), "{hz} Hz");
            assert!(error < estimated + OF_INTEGRATION, "{hz} Hz: {error}");
            let converged = orbit.outcome == Outcome::Converged;
            assert_eq!(converged, estimated <= accuracy, "{hz} Hz");
            // The choice of eps suits an elastic body, and a rigid one has none: it is far stiffer
            // in its contact.
            assert!(converged || accuracy < 0.05 || eps_scale == 1.0, "{hz} Hz");
        }
    }
}

#[test]
fn with_enough_harmonics_few_samples_do_as_well_as_many() {
    few_samples_do(&[3, 9], &[96, 1024]);
}

/// The table of docs/method.md.
#[test]
#[ignore = "slow: 4096 samples, 21 harmonics"]
fn table_of_samples_and_harmonics() {
    few_samples_do(&[3, 9, 21], &[96, 256, 4096]);
}

/// Solves with each number of harmonics and samples. With the fewest samples the largest error is
/// about that with the most.
fn few_samples_do(harmonics: &[usize], samples: &[usize]) {
    for &harmonics in harmonics {
        let of_few: Vec<f64> = samples
            .iter()
            .map(|&samples| {
                let resolution = Resolution::fixed(harmonics, samples);
                let errors = FREQUENCIES_HZ.map(|hz| {
                    let orbit = solve(hz, resolution, 1.0);
                    assert_eq!(
                        orbit.outcome,
                        Outcome::Converged,
                        "{harmonics}, {samples}, {hz} Hz"
                    );
                    100.0 * (orbit.observed_amplitude[0] / integrated_m(hz) - 1.0)
                });
                println!("H {harmonics}, N {samples}: {errors:+.2?} %");
                errors.iter().fold(0.0_f64, |m, e| m.max(e.abs()))
            })
            .collect();
        let [few, .., many] = of_few[..] else {
            panic!("several samples");
        };
        assert!(few < many + 0.3, "H {harmonics}: {of_few:?}");
    }
}
