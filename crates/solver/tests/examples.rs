//! Every example of the library, and a number that it prints.
#![allow(dead_code)] // their `main`

#[path = "../../dynamics/examples/coulomb_mass.rs"]
mod coulomb_mass;
#[path = "../../dynamics/examples/folded_curve.rs"]
mod folded_curve;
#[path = "../examples/integration_check.rs"]
mod integration_check;
#[path = "../examples/mesh_modes.rs"]
mod mesh_modes;
#[path = "../examples/own_newton.rs"]
mod own_newton;
#[path = "../examples/paper_without_toml.rs"]
mod paper_without_toml;
#[path = "../examples/reduced_from_matrices.rs"]
mod reduced_from_matrices;

use dovetail_solver::dlft::PairStatus;
use dovetail_solver::results::modes::hertz;
use dovetail_solver::results::peak::peak;

fn assert_close(found: f64, expected: f64, tolerance: f64) {
    let off = found / expected - 1.0;
    assert!(
        off.abs() < tolerance,
        "{found} is {off:+.1e} off {expected}"
    );
}

/// Bodies reduced to a few fixed-interface modes can only be stiffer: they have 450.777 Hz
/// (docs/extremes.md).
fn assert_first_stuck_mode(found_hz: f64) {
    let above = 450.777 / found_hz - 1.0;
    assert!((0.0..1e-4).contains(&above), "{found_hz} Hz");
}

/// The error falls with the first power of the harmonics (tests/program/closed_forms.rs of the
/// program).
#[test]
fn a_mass_on_friction_approaches_den_hartogs_amplitude() {
    let exact = coulomb_mass::closed_form_m();
    assert_close(exact, 1.927775, 1e-6);
    let [few, many] =
        [9, 31].map(|harmonics| coulomb_mass::amplitude_m(harmonics).unwrap() / exact - 1.0);
    println!("9 harmonics {few:+.1e}, 31 {many:+.1e}");
    assert!(many.abs() < 0.4 * few.abs() && many.abs() < 0.01);
}

/// The curve turns back at its upper fold, and on at its lower one, which the tests of
/// `dlft/branch` compare with steps in time.
#[test]
fn the_curve_of_a_mass_with_a_stop_runs_round_two_folds() {
    let points = folded_curve::curve().unwrap();
    let rises: Vec<bool> = points.windows(2).map(|p| p[1].0 > p[0].0).collect();
    let turns: Vec<usize> = (1..rises.len())
        .filter(|i| rises[*i] != rises[i - 1])
        .collect();
    let [upper, lower] = turns[..] else {
        panic!("{points:?}");
    };
    assert_close(points[upper].0, 0.2016, 1e-3);
    assert!(points[lower].0 < points[upper].0 - 0.02, "{points:?}");
    assert!(points[lower].1 < 0.5 * points[upper].1, "{points:?}");
}

/// At 5000 rpm scipy finds these frequencies for the same matrices
/// (tests/program/blade_frequencies.rs of the program).
#[test]
fn modes_of_a_mesh_are_those_of_other_programs() {
    let modes = mesh_modes::modes_hz(4).unwrap();
    for (held, scipy) in modes
        .held
        .iter()
        .zip([452.695781, 1570.351029, 1808.424651, 3162.091809])
    {
        assert_close(*held, scipy, 1e-6);
    }
    assert_first_stuck_mode(modes.stuck[0]);
    assert_eq!([modes.held.len(), modes.stuck.len()], [4, 4]);
}

/// One harmonic has a closed form (tests/program/closed_forms.rs of the program), and so have all
/// of them (crates/solver/tests/library/time_integration.rs).
#[test]
fn a_jenkins_oscillator_from_its_matrices_has_the_known_amplitude() {
    let amplitude_m = |harmonics| reduced_from_matrices::amplitude_m(harmonics).unwrap();
    assert_close(amplitude_m(1), 1.95379955, 1e-6);
    assert_close(amplitude_m(15), 1.946123, 1e-4);
}

/// The README's table.
#[test]
fn the_paper_without_toml_is_the_paper_with_it() {
    let run = paper_without_toml::solve().unwrap();
    assert_first_stuck_mode(hertz(run.reduced.model().omega2[0]));
    assert_eq!(run.statics.state.status, [PairStatus::Slipping; 72]);
    let response = run.response.unwrap().response;
    let top = peak(&response, 0).unwrap();
    assert_close(top.frequency_hz, 450.0977, 1e-4);
    assert_close(top.amplitude_m, 6.491e-3, 1e-3);
    assert_close(response.orbits[top.index].friction_power_w, 12.4, 5e-3);
}

#[test]
fn integration_in_time_keeps_the_motion_of_harmonic_balance() {
    let comparison = integration_check::comparison().unwrap();
    let differences = comparison.differences();
    for (difference, most) in differences.into_iter().zip([1e-4, 3e-4, 5e-3, 1e-3]) {
        assert!(difference.unwrap().abs() < most, "{differences:?}");
    }
}

#[test]
fn newtons_method_by_the_residual_and_the_jacobian_finds_the_motion_of_the_library() {
    let [own, library] = own_newton::amplitudes_m().unwrap();
    assert_close(own, library, 1e-7);
}
