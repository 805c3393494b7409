//! A rigid cube that slides on rigid ground in most of the period, on a spring, shaken at its base. Friction reverses twice
//! in a period, at instants that no sample meets.

use dovetail_numerics::newton::NewtonOptions;
use dovetail_solver::dlft::penalty::Penalty;
use dovetail_solver::dlft::settings::{EpsChoice, Resolution};
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Orbit, Outcome};
use dovetail_solver::integration::steady::{Until, integrate};
use dovetail_solver::integration::step::{State, Stepper};
use dovetail_solver::model::Growth;
use dovetail_solver::reduction::damping::Rayleigh;
use dovetail_solver::reduction::{
    HarmonicLoad, Load, ObservedDisplacement, PairLaw, RelativeModel,
};
use faer::Mat;
use std::f64::consts::TAU;

const DAMPING: Rayleigh = Rayleigh {
    stiffness_s: 0.0,
    mass_per_s: 20.0,
};
const NEWTON: NewtonOptions = NewtonOptions {
    tolerance: 1e-8,
    max_iterations: 60,
};
/// A cube of steel with sides of 10 mm.
const MASS_KG: f64 = 7.8e-3;
pub const SPRING_HZ: f64 = 100.0;
pub const BASE_M_S2: f64 = 76.9;
/// The limit of friction, mu N.
const FRICTION_N: f64 = 0.3;
const FREQUENCIES_HZ: [f64; 4] = [60.0, 90.0, 120.0, 150.0];

/// A rigid body on a spring, pressed onto rigid ground with 1 N and shaken at its base.
fn body(mass_kg: f64, friction: f64) -> RelativeModel {
    let diagonal = |value: f64| Mat::from_fn(3, 3, |i, j| if i == j { value } else { 0.0 });
    let load = |force_n: f64| Load {
        on_x: vec![0.0, force_n, 0.0],
        on_modes: vec![],
    };
    RelativeModel {
        stiffness: diagonal(mass_kg * (TAU * SPRING_HZ).powi(2)),
        mass: diagonal(mass_kg),
        coupling: Mat::zeros(3, 0),
        omega2: vec![],
        static_load: Load {
            on_x: vec![-1.0, 0.0, 0.0],
            on_modes: vec![],
        },
        excitations: vec![HarmonicLoad {
            harmonic: 1,
            cosine: load(mass_kg * BASE_M_S2),
            sine: load(0.0),
            growth: Growth::Constant,
        }],
        observations: vec![ObservedDisplacement {
            name: "cube".to_owned(),
            on_x: vec![0.0, 1.0, 0.0],
            on_modes: vec![],
        }],
        pairs: vec![PairLaw {
            friction,
            gap_m: 0.0,
        }],
    }
}

fn solve(frequency_hz: f64, resolution: Resolution, eps_scale: f64) -> Orbit {
    let model = body(MASS_KG, FRICTION_N);
    let settings = SweepSettings {
        eps: Penalty {
            choice: EpsChoice::Dynamic,
            scale: eps_scale,
        },
        newton: NEWTON,
        slip_threshold_m: Some(1e-9),
        ..SweepSettings::new(vec![frequency_hz], resolution)
    };
    let state = static_state(&model, 10, NEWTON);
    sweep(&model, DAMPING, &state, &settings, &[], &|_| ())
        .orbits
        .remove(0)
}

fn integrated_m(frequency_hz: f64) -> f64 {
    amplitude_in_time_m(MASS_KG, FRICTION_N, frequency_hz)
}

/// Amplitude of a rigid body on a spring of 100 Hz, of so much mass and limit of friction, by steps in time from the
/// static state.
pub fn amplitude_in_time_m(mass_kg: f64, friction_n: f64, frequency_hz: f64) -> f64 {
    let model = body(mass_kg, friction_n);
    let mut stepper = Stepper::new(&model, DAMPING, frequency_hz, 8000).unwrap();
    let rest = static_state(&model, 10, NEWTON);
    let mut state = State::at_rest(&model, &rest.x, &rest.lambda);
    let until = Until {
        most_periods: 2000,
        tolerance: 1e-7,
    };
    let settled = integrate(&mut stepper, &mut state, until).unwrap();
    assert!(settled.transient_left < 1e-4, "{settled:?}");
    settled.cycle.observed[0].amplitude_m
}

/// The integration is of first order in its step.
const OF_INTEGRATION: f64 = 1e-3;

#[test]
fn a_cube_in_gross_slip_is_within_its_accuracy_or_says_that_it_is_not() {
    for hz in FREQUENCIES_HZ {
        let exact_m = integrated_m(hz);
        for (accuracy, eps_scale) in [(0.05, 1.0), (0.05, 1000.0), (0.01, 1.0), (0.01, 1000.0)] {
            let orbit = solve(hz, Resolution::Accuracy(accuracy), eps_scale);
            let error = (orbit.observed_amplitude_m[0] / exact_m - 1.0).abs();
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
            // The choice of eps suits an elastic body, and a rigid one has none: it is far stiffer in its contact.
            assert!(converged || accuracy < 0.05 || eps_scale == 1.0, "{hz} Hz");
        }
    }
}

/// The table of docs/method.md.
#[test]
fn with_enough_harmonics_few_samples_do_as_well_as_many() {
    for harmonics in [3, 9, 21] {
        let of_few: Vec<f64> = [96, 256, 4096]
            .map(|samples| {
                let resolution = Resolution::Fixed { harmonics, samples };
                let errors = FREQUENCIES_HZ.map(|hz| {
                    let orbit = solve(hz, resolution, 1.0);
                    assert_eq!(
                        orbit.outcome,
                        Outcome::Converged,
                        "{harmonics}, {samples}, {hz} Hz"
                    );
                    100.0 * (orbit.observed_amplitude_m[0] / integrated_m(hz) - 1.0)
                });
                println!("H {harmonics}, N {samples}: {errors:+.2?} %");
                errors.iter().fold(0.0_f64, |m, e| m.max(e.abs()))
            })
            .to_vec();
        assert!(of_few[0] < of_few[2] + 0.3, "H {harmonics}: {of_few:?}");
    }
}
