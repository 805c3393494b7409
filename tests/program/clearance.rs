//! Pairs with a clearance: what closes it is not pressed, and moving the bodies apart changes no
//! motion.

use dovetail_numerics::newton::NewtonOptions;
use dovetail_solver::dlft::penalty::Penalty;
use dovetail_solver::dlft::settings::{EpsChoice, Resolution};
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{PairStatus, Response, StaticState};
use dovetail_solver::integration::compare::on_orbit;
use dovetail_solver::integration::steady::{Until, integrate};
use dovetail_solver::integration::step::{State, Stepper};
use dovetail_solver::model::Growth;
use dovetail_solver::reduction::damping::Rayleigh;
use dovetail_solver::reduction::{HarmonicLoad, Load, PairLaw, RelativeModel, superelement};
use faer::Mat;
use std::f64::consts::TAU;
use std::path::Path;

const NEWTON: NewtonOptions = NewtonOptions {
    tolerance: 1e-10,
    max_iterations: 60,
};

fn respond(
    model: &RelativeModel,
    damping: Rayleigh,
    statics: &StaticState,
    harmonics: usize,
    frequencies_hz: Vec<f64>,
) -> Response {
    let settings = SweepSettings {
        eps: Penalty::new(EpsChoice::Pair),
        newton: NEWTON,
        ..SweepSettings::new(
            frequencies_hz,
            Resolution::Fixed {
                harmonics,
                samples: 128,
            },
        )
    };
    let response = sweep(model, damping, statics, &settings, &[], &|_| ());
    assert!(response.orbits.iter().all(|o| o.outcome.is_converged()));
    response
}

fn statics(model: &RelativeModel) -> StaticState {
    let state = static_state(model, 10, NEWTON);
    assert!(state.outcome.is_converged());
    state
}

// ------------------------------------------------------------------------ one pair, closed form

const CLEARANCE_M: f64 = 0.25;
const NORMAL_STIFFNESS_N_M: f64 = 2.0;
const PRESS_N: f64 = 3.0;
const SHAKE_N: f64 = 1.0;
/// The spring takes what closing the clearance costs, the rest presses.
const COMPRESSION_N: f64 = PRESS_N - NORMAL_STIFFNESS_N_M * CLEARANCE_M;

const DAMPING: Rayleigh = Rayleigh {
    stiffness_s: 0.1,
    mass_per_s: 0.0,
};

/// A mass on a spring, pressed over a clearance against a floor and shaken across it, too weakly to
/// leave it.
fn one_pair() -> RelativeModel {
    let load = |normal: f64| Load {
        on_x: vec![normal, 0.0, 0.0],
        on_modes: vec![],
    };
    RelativeModel {
        stiffness: Mat::from_fn(3, 3, |i, j| match (i, j) {
            (0, 0) => NORMAL_STIFFNESS_N_M,
            (i, j) if i == j => 1.0,
            _ => 0.0,
        }),
        mass: Mat::identity(3, 3),
        coupling: Mat::zeros(3, 0),
        omega2: vec![],
        static_load: load(-PRESS_N),
        excitations: vec![HarmonicLoad {
            harmonic: 1,
            cosine: load(SHAKE_N),
            sine: load(0.0),
            growth: Growth::Constant,
        }],
        observations: vec![],
        pairs: vec![PairLaw {
            friction: 0.5,
            gap_m: CLEARANCE_M,
        }],
    }
}

#[track_caller]
fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-8, "{found}, not {expected}");
}

#[test]
fn a_closed_clearance_costs_its_share_of_the_load() {
    let model = one_pair();
    let state = statics(&model);
    assert_eq!(state.status, [PairStatus::Stuck]);
    assert_near(state.x[0], -CLEARANCE_M);
    assert_near(state.lambda[0], -COMPRESSION_N);

    let orbit = &respond(&model, DAMPING, &state, 1, vec![0.1]).orbits[0];
    let [mean, cosine, sine] = [0, 3, 6].map(|i| orbit.x[i]);
    assert_near(mean, -CLEARANCE_M);
    assert_near(cosine.hypot(sine), 0.0);
    let cycle = &orbit.cycles[0];
    assert!(!cycle.opens && !cycle.slips);
    assert_near(cycle.compression_mean_n, COMPRESSION_N);
    assert_near(cycle.compression_min_n, COMPRESSION_N - SHAKE_N);
    assert_near(cycle.compression_max_n, COMPRESSION_N + SHAKE_N);
}

/// From a place with the clearance open to one where it is closed, and there as long as one looks.
#[test]
fn integrated_in_time_a_clearance_closes_and_stays_closed() {
    let model = one_pair();
    let mut stepper = Stepper::new(&model, DAMPING, 0.1, 200).unwrap();
    let mut state = State::at_rest(&model, &[0.0; 3], &[0.0; 3]);
    let until = Until {
        most_periods: 4,
        tolerance: 0.0,
    };
    let settled = integrate(&mut stepper, &mut state, until).unwrap();
    assert_near(state.x[0], -CLEARANCE_M);
    assert_eq!(settled.cycle.open_fraction, [0.0]);
    // The mean load of the last step, half a step before the period ends.
    let shake = SHAKE_N * 0.5 * (1.0 + (TAU / 200.0).cos());
    assert_near(state.lambda[0], -COMPRESSION_N + shake);
}

// ----------------------------------------------------------------------- 72 pairs, moved apart

fn dovetail(force_n: f64) -> RelativeModel {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/dovetail72");
    let law = PairLaw {
        friction: 0.3,
        gap_m: 0.0,
    };
    superelement::read(&folder, law, force_n).unwrap().relative
}

/// The same joint, its flanks apart by clearances that differ from pair to pair, under the load
/// that closes them on top; its motion X is that of `model` less the clearances, in N.
fn moved_apart(model: &RelativeModel) -> (RelativeModel, Vec<f64>) {
    let mut moved = model.clone();
    let n = model.stiffness.nrows();
    let mut shift_m = vec![0.0; n];
    for (p, pair) in moved.pairs.iter_mut().enumerate() {
        pair.gap_m = 1e-6 * (1 + p % 5) as f64;
        shift_m[3 * p] = pair.gap_m;
    }
    for (i, load) in moved.static_load.on_x.iter_mut().enumerate() {
        *load -= (0..n)
            .map(|j| model.stiffness[(i, j)] * shift_m[j])
            .sum::<f64>();
    }
    (moved, shift_m)
}

fn damping(model: &RelativeModel) -> Rayleigh {
    Rayleigh {
        stiffness_s: 2.0 * 0.001 / model.omega2[0].sqrt(),
        mass_per_s: 0.0,
    }
}

/// Largest difference of `a` and `b` less `shift`, over the largest of `a`.
fn apart(a: &[f64], b: &[f64], shift: &[f64]) -> f64 {
    let shift = shift.iter().chain(std::iter::repeat(&0.0));
    let differences = a.iter().zip(b).zip(shift);
    let worst = differences.fold(0.0_f64, |m, ((a, b), s)| m.max((a - s - b).abs()));
    worst / a.iter().fold(0.0_f64, |m, a| m.max(a.abs()))
}

#[test]
fn flanks_apart_and_pressed_together_move_as_flanks_that_touch() {
    let touching = dovetail(1.5);
    let state = statics(&touching);
    let (apart_model, shift_m) = moved_apart(&touching);
    let mut moved_state = state.clone();
    let places = moved_state.x.iter_mut().zip(&shift_m);
    places.for_each(|(x, shift)| *x -= shift);

    let first_hz = touching.omega2[0].sqrt() / TAU;
    let damping = damping(&touching);
    let frequencies_hz = [0.99, 0.9995, 1.002].map(|r| r * first_hz).to_vec();
    let a = respond(&touching, damping, &state, 3, frequencies_hz.clone());
    let b = respond(&apart_model, damping, &moved_state, 3, frequencies_hz);
    assert!(a.orbits.iter().any(|o| o.cycles.iter().any(|c| c.opens)));
    for (a, b) in a.orbits.iter().zip(&b.orbits) {
        let off = [
            apart(&a.x, &b.x, &shift_m),
            apart(&a.lambda, &b.lambda, &[]),
            apart(&a.observed_amplitude_m, &b.observed_amplitude_m, &[]),
        ];
        println!("{} Hz: {off:?}", a.frequency_hz);
        assert!(off.iter().all(|o| *o < 1e-6), "{off:?}");
        for (a, b) in a.cycles.iter().zip(&b.cycles) {
            assert_eq!((a.slips, a.opens), (b.slips, b.opens));
        }
    }

    let orbit = &a.orbits[1];
    let states = [&touching, &apart_model].map(|model| {
        let mut stepper = Stepper::new(model, damping, orbit.frequency_hz, 64).unwrap();
        let mut state = on_orbit(orbit);
        if model.pairs[0].gap_m > 0.0 {
            let places = state.x.iter_mut().zip(&shift_m);
            places.for_each(|(x, shift)| *x -= shift);
        }
        let until = Until {
            most_periods: 2,
            tolerance: 0.0,
        };
        let settled = integrate(&mut stepper, &mut state, until).unwrap();
        let open = settled.cycle.open_fraction;
        assert!(open.iter().any(|o| *o > 0.0) && open.iter().any(|o| *o < 1.0));
        state
    });
    let off = [
        apart(&states[0].x, &states[1].x, &shift_m),
        apart(&states[0].v, &states[1].v, &[]),
        apart(&states[0].lambda, &states[1].lambda, &[]),
    ];
    println!("in time: {off:?}");
    assert!(off.iter().all(|o| *o < 1e-6), "{off:?}");
}
