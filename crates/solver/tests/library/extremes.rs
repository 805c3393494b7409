//! Ends of the input on the 72-pair reference model: each converges, with figures that must result.
//! The whole table: `make extremes`, docs/extremes.md.

use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Outcome, PairStatus, Response, StaticState};
use dovetail_solver::excitation::Growth;
use dovetail_solver::problem::Problem;

use crate::shared_problems::{damping_of, dovetail72};

const NEWTON: NewtonOptions = NewtonOptions::new(1e-10, 100);

fn model(friction: f64, force_n: f64) -> Problem {
    dovetail72(PairLaw::rigid(friction, 0.0), force_n)
}

fn statics(model: &Problem) -> StaticState {
    static_state(model, 10, NEWTON)
}

/// Response at multiples of the first stuck mode, with 0.1 % damping.
fn respond(model: &Problem, state: &StaticState, ratios: &[f64], harmonics: usize) -> Response {
    let first = model.reduced.omega2[0].sqrt();
    let settings = SweepSettings::new(
        ratios
            .iter()
            .map(|r| r * first / std::f64::consts::TAU)
            .collect(),
        Resolution::fixed(harmonics, (2 * harmonics + 2).max(64)),
    );
    sweep(model, damping_of(model), state, &settings, &[], &|_| ())
}

/// Adds a steady force along the slot, this share of the load that presses the pairs, on all pairs.
fn push_along_the_slot(model: &mut Problem, share: f64) {
    let n = model.reduced.stiffness.nrows();
    let common = |axis: usize| -> f64 {
        let mut slide = vec![0.0; n];
        slide
            .iter_mut()
            .skip(axis)
            .step_by(3)
            .for_each(|x| *x = 1.0);
        model.reduced.elastic_product(&slide)
    };
    let along = if common(1) < common(2) { 1 } else { 2 };
    let load = &mut model.reduced_mut().static_load.on_x;
    let pressing_n: f64 = load.iter().step_by(3).map(|f| f.abs()).sum();
    let each_n = share * pressing_n / (n / 3) as f64;
    let pushed = load.iter_mut().skip(along).step_by(3);
    pushed.for_each(|f| *f += each_n);
}

fn largest(v: impl Iterator<Item = f64>) -> f64 {
    v.fold(0.0, |m, v| m.max(v.abs()))
}

#[test]
fn the_static_state_is_found_at_any_coefficient_of_friction() {
    for friction in [0.0, 1e-6, 0.01, 0.3, 1.0, 10.0, 1e6] {
        let model = model(friction, 1.0);
        let state = statics(&model);
        assert_eq!(state.outcome, Outcome::Converged, "{friction}");
        for f in state.lambda.chunks_exact(3) {
            let limit = friction * -f[0] * (1.0 + 1e-9);
            assert!(
                f[0] <= 0.0 && f[1].hypot(f[2]) <= limit,
                "{friction}: {f:?}"
            );
        }
        // Equilibrium: K x + lambda = F, but for a force along the slot where it is held there.
        let n = state.x.len();
        let off = (0..n).map(|i| {
            let kx: f64 = (0..n)
                .map(|j| model.reduced.stiffness[(i, j)] * state.x[j])
                .sum();
            kx + state.lambda[i] - model.reduced.static_load.on_x[i]
        });
        let held_n = state.retention_n.unwrap_or(0.0);
        assert!(largest(off) <= 1e-6 + held_n, "{friction}");
        // Sliding along the slot is a matter of micrometres, not of walking away.
        assert!(largest(state.x.iter().copied()) < 1e-4, "{friction}");
        let sliding = state.status.iter().filter(|s| **s == PairStatus::Slipping);
        let (sliding, all) = (sliding.count(), state.status.len());
        match friction {
            0.0..=0.3 => assert_eq!(sliding, all, "{friction}"),
            10.0.. => assert!(sliding < all / 4, "{friction}: {sliding}"),
            _ => {}
        }
    }
}

/// Three pairs slide at rest under next to no pressure. In the vibration they stick: it is that of
/// the linear reference.
#[test]
fn a_small_vibration_is_found_at_large_coefficients_of_friction() {
    for friction in [30.0, 100.0, 1e6] {
        let model = model(friction, 0.2);
        let state = statics(&model);
        let sliding = state.status.iter().filter(|s| **s == PairStatus::Slipping);
        assert!(sliding.count() > 0, "{friction}");
        let response = respond(&model, &state, &[0.98], 3);
        let orbit = &response.orbits[0];
        assert_eq!(orbit.outcome, Outcome::Converged, "{friction}");
        let [found_m, linear_m] = [
            orbit.observed_amplitude[0],
            response.linear[0].observed_amplitude[0],
        ];
        assert!(
            (found_m / linear_m - 1.0).abs() < 1e-3,
            "{friction}: {found_m} {linear_m}"
        );
    }
}

#[test]
fn a_clearance_that_the_load_closes_is_closed() {
    let compression = |gap_m| {
        let mut model = model(0.3, 1.0);
        model.laws.iter_mut().for_each(|pair| pair.gap_m = gap_m);
        let state = statics(&model);
        assert_eq!(state.outcome, Outcome::Converged, "{gap_m}");
        assert!(!state.status.contains(&PairStatus::Open), "{gap_m}");
        -state.lambda.iter().step_by(3).sum::<f64>()
    };
    let without = compression(0.0);
    for gap_m in [1e-6, 1e-5, 1e-4] {
        assert!((compression(gap_m) / without - 1.0).abs() < 0.02, "{gap_m}");
    }
}

#[test]
fn a_vibration_of_nothing_leaves_a_held_static_state_where_it_is() {
    let mut model = model(1e-6, 1e-6);
    push_along_the_slot(&mut model, 0.01);
    let state = statics(&model);
    let held_n = state
        .retention_n
        .expect("a coefficient of 1e-6 does not hold the blade");
    assert!(held_n > 0.0);
    let response = respond(&model, &state, &[0.99, 1.01], 1);
    for orbit in &response.orbits {
        assert_eq!(orbit.outcome, Outcome::Converged);
        let moved = orbit.x.iter().zip(&state.x).map(|(x, s)| x - s);
        assert!(largest(moved) < 1e-3 * largest(state.x.iter().copied()));
        assert!((orbit.retention_n / held_n - 1.0).abs() < 0.05);
    }
}

#[test]
fn without_friction_the_response_is_that_of_hardly_any() {
    let response = |friction| {
        let model = model(friction, 1.0);
        respond(&model, &statics(&model), &[0.97, 0.99, 1.01, 1.03], 3)
    };
    let (without, hardly) = (response(0.0), response(1e-6));
    for (a, b) in without.orbits.iter().zip(&hardly.orbits) {
        assert!(a.outcome.is_converged() && b.outcome.is_converged());
        let [a_m, b_m] = [a, b].map(|o| o.observed_amplitude[0]);
        assert!((a_m / b_m - 1.0).abs() < 1e-4, "{a_m} {b_m}");
    }
}

#[test]
fn flanks_too_rough_to_slide_jam_and_the_response_converges() {
    // Pairs that jam carry shear under next to no pressure: there the static state and the response
    // grow with friction.
    let amplitudes = |friction| {
        let model = model(friction, 0.05);
        let response = respond(&model, &statics(&model), &[0.98, 1.02], 1);
        let amplitude = |o: &dovetail_solver::dlft::Orbit| {
            assert_eq!(o.outcome, Outcome::Converged, "{friction}");
            o.observed_amplitude[0]
        };
        response.orbits.iter().map(amplitude).collect::<Vec<_>>()
    };
    for (a, b) in amplitudes(1e3).into_iter().zip(amplitudes(1e4)) {
        assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn an_excitation_beyond_what_presses_the_flanks_is_named() {
    let mut model = model(0.3, 1e6);
    let response = respond(&model, &statics(&model), &[0.98], 1);
    assert_eq!(response.orbits[0].outcome, Outcome::NoStaticEquilibrium);
    // The same force as that of a displacement of the base, which grows as the square of the
    // frequency.
    let load = &mut model.excitations[0];
    load.growth = Growth::Squared;
    for part in [&mut load.cosine, &mut load.sine] {
        let all = part.on_x.iter_mut().chain(&mut part.on_modes);
        all.for_each(|f| *f /= 0.98 * 0.98 * model.reduced.omega2[0]);
    }
    let response = respond(&model, &statics(&model), &[0.98], 1);
    assert_eq!(response.orbits[0].outcome, Outcome::NoStaticEquilibrium);
}

#[test]
fn very_low_and_very_high_frequencies_converge() {
    let model = model(0.3, 1.0);
    let response = respond(&model, &statics(&model), &[2e-5, 2e3], 3);
    for orbit in &response.orbits {
        assert_eq!(
            orbit.outcome,
            Outcome::Converged,
            "{} Hz",
            orbit.frequency_hz
        );
    }
}
