//! Comparison of the contact solver with an independent program, on a reduced 72-pair dovetail
//! (tests/data/dovetail72): static counts exact, first-harmonic amplitudes to 1e-8, friction work
//! to 0.1 % (the reference summed it over samples).

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::pair_signals::Periods;
use dovetail_solver::dlft::settings::{EpsChoice, Resolution, Solver};
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{CycleStatus, LinearPoint, Orbit, PairStatus, Response, StaticState};
use dovetail_solver::problem::Problem;
use dovetail_testkit::folder::root;

use crate::shared_problems::{self, damping_of, dovetail72};

const NEWTON: NewtonOptions = NewtonOptions::new(1e-10, 60);

fn model(force_n: f64) -> Problem {
    dovetail72(PairLaw::rigid(0.3, 0.0), force_n)
}

fn expected() -> serde_json::Value {
    let path = root().join("tests/data/dovetail72/expected.json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn statics(model: &Problem) -> StaticState {
    static_state(model, 10, NEWTON)
}

fn respond(
    model: &Problem,
    eps: EpsChoice,
    harmonics: usize,
    frequencies_hz: Vec<f64>,
    solver: Solver,
) -> Response {
    let mut settings = SweepSettings::new(frequencies_hz, Resolution::fixed(harmonics, 256));
    settings.eps = Eps::new(eps);
    settings.newton = NEWTON;
    // The reference evaluated three periods, whether the forces were periodic by then or not.
    settings.periods = Periods::Exactly(3);
    settings.solver = solver;
    shared_problems::respond(model, damping_of(model), &settings)
}

#[test]
fn static_state_slides_everywhere_and_carries_the_load() {
    let state = statics(&model(1.0));
    let expected = &expected()["static"];
    assert!(state.outcome.is_converged());
    let count = |s: PairStatus| state.status.iter().filter(|x| **x == s).count() as u64;
    assert_eq!(
        count(PairStatus::Slipping),
        expected["slip"].as_u64().unwrap()
    );
    assert_eq!(count(PairStatus::Open), expected["sep"].as_u64().unwrap());
    let normal: f64 = state.lambda.iter().step_by(3).sum();
    let slip = state
        .x
        .chunks(3)
        .map(|x| x[1].hypot(x[2]))
        .fold(0.0, f64::max);
    let close = |a: f64, key: &str, tolerance: f64| {
        let b = expected[key].as_f64().unwrap();
        assert!((a / b - 1.0).abs() < tolerance, "{key}: {a} against {b}");
    };
    close(normal, "normal_force_total", 1e-4);
    close(slip, "max_slip_m", 1e-3);
}

/// Compares a set of points with the reference's and returns the Newton iterations of both.
fn compare(key: &str, harmonics: usize, eps: EpsChoice, solver: Solver) -> (usize, usize) {
    let expected = expected();
    let points = expected[key].as_array().unwrap();
    let number = |p: &serde_json::Value, k: &str| p[k].as_f64().unwrap();
    let frequencies = points.iter().map(|p| number(p, "f_hz")).collect();
    let response = respond(&model(1.0), eps, harmonics, frequencies, solver);
    for (orbit, point) in response.orbits.iter().zip(points) {
        let hz = orbit.frequency_hz;
        assert!(
            orbit.outcome.is_converged(),
            "{key} {hz} Hz: {:?}",
            orbit.outcome
        );
        // The reference's amplitude is that of the first harmonic.
        let first = orbit.observed[0][1].hypot(orbit.observed[0][2]);
        let amplitude = first / number(point, "tip_amplitude_m");
        let work = orbit.friction_power_w / hz / number(point, "friction_work_j");
        let input = orbit.input_power_w / hz / number(point, "input_work_j");
        println!(
            "{key} {hz:.4} Hz: amplitude {:+.1e} friction {:+.1e} input {:+.1e}, {} Newton, {} Krylov",
            amplitude - 1.0,
            work - 1.0,
            input - 1.0,
            orbit.newton_iterations,
            orbit.krylov_iterations
        );
        let opening = orbit.counts().opening as u64;
        assert_eq!(
            opening,
            point["sep"].as_u64().unwrap(),
            "{key} {hz} Hz: opening pairs"
        );
        assert!((amplitude - 1.0).abs() < 1e-8, "{key} {hz} Hz");
        assert!((work - 1.0).abs() < 1e-3, "{key} {hz} Hz");
        let balance = orbit.friction_power_w + orbit.viscous_power_w - orbit.input_power_w;
        assert!(
            balance.abs() < 1e-6 * orbit.input_power_w,
            "{key} {hz} Hz: energy {balance:e}"
        );
    }
    let ours = response.orbits.iter().map(|o| o.newton_iterations).sum();
    let theirs = points.iter().map(|p| number(p, "newton") as usize).sum();
    println!("{key}: {ours} Newton iterations, the reference {theirs}");
    (ours, theirs)
}

#[test]
fn one_harmonic() {
    compare("H1_epspair", 1, EpsChoice::Pair, Solver::NewtonKrylov);
}

#[test]
fn three_harmonics() {
    compare("H3_epspair", 3, EpsChoice::Pair, Solver::NewtonKrylov);
}

#[test]
fn three_harmonics_with_the_spectral_radius() {
    compare(
        "H3_epsrho",
        3,
        EpsChoice::SpectralRadius,
        Solver::NewtonKrylov,
    );
}

#[test]
fn seven_harmonics() {
    compare("H7_epspair", 7, EpsChoice::Pair, Solver::NewtonKrylov);
}

#[test]
fn the_hybrid_powell_solver_finds_the_same_motion() {
    compare("H1_epspair", 1, EpsChoice::Pair, Solver::Powell);
}

fn assert_linear(orbit: &Orbit, linear: &LinearPoint, tolerance: f64) {
    let off = orbit.observed_amplitude[0] / linear.observed_amplitude[0] - 1.0;
    assert!(off.abs() < tolerance, "{} Hz: {off:e}", orbit.frequency_hz);
}

#[test]
fn a_small_force_after_the_static_state_gives_the_linear_curve() {
    let model = model(0.01);
    let f1 = model.reduced.omega2[0].sqrt() / std::f64::consts::TAU;
    let frequencies = [0.98, 0.995, 1.0, 1.004, 1.02].map(|r| r * f1).to_vec();
    let response = respond(
        &model,
        EpsChoice::Pair,
        1,
        frequencies,
        Solver::NewtonKrylov,
    );
    for (orbit, linear) in response.orbits.iter().zip(&response.linear) {
        assert!(orbit.outcome.is_converged());
        assert_linear(orbit, linear, 1e-10);
        assert_eq!(orbit.counts().slipping, 0);
    }
}

/// Two of three pairs are so far apart that the steady load does not close them.
#[test]
fn a_small_force_where_pairs_are_open_at_rest_gives_the_linear_curve() {
    let mut model = model(1e-3);
    for (_, pair) in model.laws.iter_mut().enumerate().filter(|(i, _)| i % 3 > 0) {
        pair.gap_m = 1e-3;
    }
    let state = statics(&model);
    let open = |s: &&PairStatus| **s == PairStatus::Open;
    assert!(state.status.iter().filter(open).count() == 48);
    let linear_hz = state.linear.omega2[0].sqrt() / std::f64::consts::TAU;
    let stuck_hz = model.reduced.omega2[0].sqrt() / std::f64::consts::TAU;
    println!("first mode {linear_hz:.3} Hz, {stuck_hz:.3} Hz with all pairs stuck");
    assert!(linear_hz < 0.999 * stuck_hz);
    let frequencies = [0.98, 0.999, 1.0, 1.001, 1.02].map(|r| r * linear_hz);
    for eps in [EpsChoice::Pair, EpsChoice::Dynamic] {
        let frequencies = frequencies.to_vec();
        let response = respond(&model, eps, 1, frequencies, Solver::NewtonKrylov);
        for (orbit, linear) in response.orbits.iter().zip(&response.linear) {
            assert!(orbit.outcome.is_converged());
            assert_linear(orbit, linear, 1e-9);
            for (cycle, status) in orbit.cycles.iter().zip(&state.status) {
                let is_open = *status == PairStatus::Open;
                let is_open_in_cycle =
                    matches!(cycle.status, CycleStatus::Closing | CycleStatus::Open);
                assert_eq!(is_open_in_cycle, is_open);
                assert_ne!(cycle.status, CycleStatus::Opening);
            }
        }
    }
}

#[test]
fn a_rough_flank_after_the_static_state_gives_the_linear_curve() {
    let mut model = model(0.1);
    let statics = statics(&model);
    model.laws.iter_mut().for_each(|p| p.friction = 1e6);
    let f1 = model.reduced.omega2[0].sqrt() / std::f64::consts::TAU;
    let mut settings = SweepSettings::new(
        [0.99, 1.0, 1.01].map(|r| r * f1).to_vec(),
        Resolution::fixed(3, 64),
    );
    settings.eps = Eps::new(EpsChoice::Pair);
    settings.newton = NEWTON;
    let response = sweep(
        &model,
        damping_of(&model),
        &statics,
        &settings,
        &[],
        &|_| (),
    );
    for (orbit, linear) in response.orbits.iter().zip(&response.linear) {
        assert_linear(orbit, linear, 1e-10);
        // Stuck pairs stay where the static state has them, and keep its friction.
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let n = statics.x.len();
        for (mean, at_rest) in [
            (&orbit.x[..n], &statics.x),
            (&orbit.lambda[..n], &statics.lambda),
        ] {
            let apart: Vec<f64> = mean.iter().zip(at_rest).map(|(m, s)| m - s).collect();
            let off = largest(&apart) / largest(at_rest);
            assert!(off < 1e-8, "{} Hz: {off:e}", orbit.frequency_hz);
        }
    }
}
