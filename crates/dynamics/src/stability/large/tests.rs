//! Multipliers by steps compared with those by exponentials, which treat the same equations exactly, and
//! with closed forms.

use super::*;
use crate::contact::PairLaw;
use crate::damping::DampingSpec;
use crate::forced_response::ForcedResponse;
use crate::integration::compare::orbit_state;
use crate::integration::step::Stepper;
use crate::problem::dovetail72;
use crate::reduced::ReducedModel;
use crate::stability::monodromy::{self, Resolution};
use crate::stability::tests::{Mass, rubbing, stop, twice_the_resonance};
use crate::stability::{Kind, Verdict, judge};
use faer::{Mat, c64};

/// Largest multiplier of a motion in so many steps.
fn by_steps(problem: &Problem, damping: Rayleigh, orbit: &Orbit, steps: usize) -> c64 {
    let model = Model {
        problem,
        damping,
        orbit,
    };
    let period = model.period(steps, 1.0).unwrap();
    let start = States::start(period.bodies(), WIDTH);
    let found = largest(&period, start, [DECAYED[0]; 2]).unwrap();
    assert!(found.is_found);
    found.multiplier
}

/// Largest multiplier of the same motion by exponentials.
fn by_exponentials(problem: &Problem, damping: Rayleigh, orbit: &Orbit) -> c64 {
    let found = monodromy::largest(problem, damping, orbit, Resolution::FINE).unwrap();
    found.unwrap().multiplier
}

fn assert_like_exponentials(mass: &Mass, harmonics: usize) -> Stability {
    let (solved, orbit, exact) = mass.solved(harmonics);
    let (problem, damping) = (mass.problem(), solved.damping);
    let expected = by_exponentials(&problem, damping, &orbit);
    let found = by_steps(&problem, damping, &orbit, 1024);
    let off = (found - expected).norm();
    assert!(off < 6e-3, "{found} instead of {expected}");
    let found = judged(&problem, damping, &orbit).unwrap();
    assert_eq!(found.verdict, exact.verdict, "{found:?} {exact:?}");
    found
}

#[test]
fn a_stop_doubles_the_period_as_by_exponentials() {
    let doubles = stop(twice_the_resonance(), 0.0, 0.01);
    let found = assert_like_exponentials(&doubles, 31);
    assert_eq!(found.verdict, Verdict::Unstable(Kind::PeriodDoubling));
    let damped = stop(twice_the_resonance(), 0.0, 1.5);
    let found = assert_like_exponentials(&damped, 31);
    assert_eq!(found.verdict, Verdict::Stable);
}

#[test]
fn sliders_are_those_of_the_exponentials() {
    let law = PairLaw::rigid(0.3, 0.0).springs(40.0, 5.0);
    let slips = rubbing(law, [[0.0, 0.6, 0.0], [0.0; 3]], 1.3);
    assert_like_exponentials(&slips, 31);
    // Friction that turns, and a normal force that changes with it.
    let law = PairLaw::rigid(0.3, 0.0).springs(12.0, 8.0);
    let turns = rubbing(law, [[0.5, 0.9, 0.1], [0.1, 0.2, 0.7]], 1.1);
    assert_like_exponentials(&turns, 31);
    // A pair that opens, and sticks after it lands.
    let law = PairLaw::rigid(1.5, 0.0).springs(12.0, 8.0);
    let lands = Mass {
        damping: 0.1,
        ..rubbing(law, [[1.0, 0.3, 0.1], [0.1, 0.2, 0.2]], 0.6)
    };
    assert_like_exponentials(&lands, 41);
}

#[test]
fn rigid_friction_is_that_of_the_exponentials() {
    let law = PairLaw::rigid(0.2, 0.0);
    // It turns at once, or it sticks between; in one direction, or round a circle.
    for force in [[0.0, 1.0, 0.0], [0.0, 0.3, 0.0], [0.0, 1.0, 0.4]] {
        let mass = rubbing(law, [force, [0.0, 0.0, 0.6 * force[2]]], 0.7);
        assert_like_exponentials(&mass, 31);
    }
}

#[test]
fn several_pairs_act_on_each_other() {
    // Three masses in a row, each on a pair.
    let stiffness = Mat::from_fn(9, 9, |i, j| match (i % 3 == j % 3, i.abs_diff(j) / 3) {
        (true, 0) => 2.4 + 0.3 * i as f64,
        (true, 1) => -0.8,
        (false, _) if i / 3 == j / 3 => 0.15,
        _ => 0.0,
    });
    let mut force = vec![0.0; 9];
    (force[1], force[4], force[8], force[3]) = (0.9, 0.5, 0.6, 0.3);
    let steady = vec![-1.0, 0.0, 0.0, -1.3, 0.0, 0.0, -1.6, 0.0, 0.0];
    let model = ReducedModel::from_pair_matrices(stiffness, Mat::identity(9, 9))
        .static_load(steady)
        .unit_load(force);
    let law = PairLaw::rigid(0.25, 0.0).springs(9.0, 6.0);
    let problem = Problem::uniform(model, law, 1.0);
    let solved = ForcedResponse::new(&problem)
        .damping(DampingSpec::Rayleigh {
            stiffness_s: 0.01,
            mass_per_s: 0.01,
        })
        .harmonics(21)
        .frequencies_hz([1.2 / TAU])
        .solve()
        .unwrap();
    let orbit = &solved.response.orbits[0];
    assert_eq!(orbit.counts().slipping, 3);
    let expected = by_exponentials(&problem, solved.damping, orbit);
    let found = by_steps(&problem, solved.damping, orbit, 1024);
    let off = (found - expected).norm();
    assert!(off < 6e-3, "{found} instead of {expected}");
}

/// Share of a perturbation of the modes that time integration leaves in a period, on average over the
/// periods after `skipped`.
fn left_by_integration(problem: &Problem, damping: Rayleigh, orbit: &Orbit, skipped: usize) -> f64 {
    const PERIODS: usize = 8;
    const STEPS: usize = 256;
    let mut motions = [0.0, 1e-4].map(|larger_by| {
        let mut state = orbit_state(problem, orbit);
        let rates = state.q_rate.iter_mut().zip(1..);
        rates.for_each(|(rate, m)| *rate *= 1.0 + f64::from(m) * larger_by);
        let stepper = Stepper::new(problem, damping, orbit.frequency_hz, STEPS).unwrap();
        (stepper, state)
    });
    let omega = TAU * orbit.frequency_hz;
    let mut sizes = Vec::new();
    for _ in 0..=skipped + PERIODS {
        for (stepper, state) in &mut motions {
            stepper.prepare(state);
            for step in 0..STEPS {
                stepper.advance(state, step).unwrap();
            }
        }
        let [(_, one), (_, other)] = &motions;
        let apart = |one: &[f64], other: &[f64]| -> f64 {
            one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum()
        };
        let energy = apart(&one.q, &other.q) * omega.powi(2) + apart(&one.q_rate, &other.q_rate);
        sizes.push(energy.sqrt());
    }
    (sizes[skipped + PERIODS] / sizes[skipped]).powf(1.0 / PERIODS as f64)
}

#[test]
fn a_pair_that_lands_later_sticks_where_it_has_moved_on_to() {
    // The place of the slider acts on the normal motion.
    let stiffness = [[1.0, 0.5, 0.1], [0.5, 1.0, 0.1], [0.1, 0.1, 1.4]];
    let stiffness = Mat::from_fn(3, 3, |i, j| stiffness[i][j]);
    let model = ReducedModel::from_pair_matrices(stiffness, Mat::identity(3, 3))
        .static_load([-1.0, 0.0, 0.0])
        .unit_load([1.3, 0.3, 0.1]);
    let law = PairLaw::rigid(1.5, 0.0).springs(12.0, 8.0);
    let problem = Problem::uniform(model, law, 1.0);
    let solved = ForcedResponse::new(&problem)
        .damping(DampingSpec::Rayleigh {
            stiffness_s: 0.0,
            mass_per_s: 0.1,
        })
        .harmonics(41)
        .frequencies_hz([0.6 / TAU])
        .solve()
        .unwrap();
    let orbit = &solved.response.orbits[0];
    assert_eq!(orbit.counts().opening, 1);
    let expected = by_exponentials(&problem, solved.damping, orbit);
    let found = by_steps(&problem, solved.damping, orbit, 2048);
    let off = (found - expected).norm();
    assert!(off < 1e-2, "{found} instead of {expected}");
}

/// Motion of the dovetail under this force, and the modulus of its largest multiplier.
fn dovetail(force_n: f64, hz: f64) -> (Problem, Rayleigh, Orbit, f64) {
    let problem = dovetail72::dovetail72(force_n);
    let stiffness_s = dovetail72::damping(&problem).stiffness_s;
    let solved = ForcedResponse::new(&problem)
        .damping(DampingSpec::Rayleigh {
            stiffness_s,
            mass_per_s: 0.0,
        })
        .harmonics(3)
        .frequencies_hz([hz])
        .solve()
        .unwrap();
    let orbit = solved.response.orbits[0].clone();
    let found = judge(&problem, solved.damping, &solved.state, &orbit);
    assert_eq!(found.verdict, Verdict::Stable);
    let size = found.multiplier.unwrap().norm();
    (problem, solved.damping, orbit, size)
}

/// Modulus of the multiplier of the first mode without friction.
fn of_first_mode(problem: &Problem, damping: Rayleigh, hz: f64) -> f64 {
    (-0.5 * damping.stiffness_s * problem.reduced.omega2[0] / hz).exp()
}

#[test]
fn a_large_model_that_sticks_decays_as_its_first_mode() {
    let (problem, damping, orbit, size) = dovetail(1.0, 600.0);
    assert!(orbit.counts().stuck >= 70, "{:?}", orbit.counts());
    let first = of_first_mode(&problem, damping, 600.0);
    assert!((size - first).abs() < 6e-4, "{size} {first}");
}

#[test]
fn a_large_model_that_slips_and_lands_decays_as_in_time_integration() {
    let (problem, damping, orbit, size) = dovetail(10.0, 684.0);
    let counts = orbit.counts();
    assert!(counts.slipping > 40 && counts.opening > 0, "{counts:?}");
    // Friction damps it further.
    let first = of_first_mode(&problem, damping, 684.0);
    assert!(size < first - 3e-3, "{size} {first}");
    let left = left_by_integration(&problem, damping, &orbit, 6);
    assert!((left - size).abs() < 8e-3, "{size} {left}");
}

/// A mass that slides on the ground without springs: only its velocities have multipliers, which
/// friction and the damping of the mass leave.
#[test]
fn the_place_of_a_retained_mass_does_not_count() {
    let model = ReducedModel::from_pair_matrices(
        Mat::from_fn(3, 3, |i, j| if i == j && i == 0 { 1.0 } else { 0.0 }),
        Mat::identity(3, 3),
    )
    .static_load([-1.0, 0.0, 0.0])
    .unit_load([0.0, 1.0, 0.4]);
    let problem = Problem::uniform(model, PairLaw::rigid(0.1, 0.0), 1.0);
    let solved = ForcedResponse::new(&problem)
        .damping(DampingSpec::Rayleigh {
            stiffness_s: 0.0,
            mass_per_s: 0.1,
        })
        .harmonics(9)
        .frequencies_hz([1.0 / TAU])
        .solve()
        .unwrap();
    let orbit = &solved.response.orbits[0];
    assert_eq!(orbit.mean, Mean::Retained, "{:?}", orbit.outcome);
    let found = judge(&problem, solved.damping, &solved.state, orbit);
    assert_eq!(found.verdict, Verdict::Stable);
    let size = found.multiplier.unwrap().norm();
    let free = (-0.1 * TAU).exp();
    assert!(size < free && size > 0.05, "{size} of {free}");
}
