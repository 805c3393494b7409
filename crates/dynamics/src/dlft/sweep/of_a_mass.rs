//! Quick tests of what a sweep does with its frequencies, on a mass in front of a stop.

use super::*;
use crate::dlft::made_up::{self, mass_with_a_stop, recorded};
use crate::dlft::static_state::static_state;
use std::ops::RangeInclusive;

/// Iteration count that marks a made-up frequency.
const MARK: usize = 1_000_000;
/// Number of residuals of its attempt.
const MARK_RESIDUALS: usize = 3;

/// Response of the mass in front of its stop at so many frequencies, with one harmonic, and what an
/// interrupted sweep keeps.
fn mass_response(
    problem: &Problem,
    range_hz: RangeInclusive<f64>,
    points: u32,
    change: impl FnOnce(&mut SweepSettings),
    earlier: &[SolvedFrequency],
) -> (Response, Vec<SolvedFrequency>) {
    let spacing_hz = (range_hz.end() - range_hz.start()) / f64::from(points - 1);
    let frequencies_hz = (0..points).map(|i| range_hz.start() + spacing_hz * f64::from(i));
    let resolution = Resolution::fixed(1, 32);
    let mut settings = SweepSettings::new(frequencies_hz.collect(), resolution);
    settings.slip_threshold_m = Some(1e-9);
    change(&mut settings);
    let state = static_state(problem, 1, settings.newton);
    let damping = made_up::DAMPING;
    let (response, mut told) =
        recorded(|tell| sweep(problem, damping, &state, &settings, earlier, tell));
    told.sort_by_key(|solved| solved.orbit.point);
    (response, told)
}

/// Amplitude of the mass where it does not touch the stop.
fn free_amplitude(hz: f64) -> f64 {
    let omega = TAU * hz;
    0.1 / (1.0 - omega * omega).hypot(made_up::DAMPING.mass_per_s * omega)
}

/// Changes a frequency as if its solution had ended so.
fn ended(solved: &mut SolvedFrequency, outcome: Outcome) {
    let orbit = &mut solved.orbit;
    orbit.outcome = outcome;
    orbit.x.fill(0.0);
    orbit.observed_amplitude.fill(0.0);
    (orbit.newton_iterations, orbit.krylov_iterations) = (MARK, MARK);
    orbit.newton_residuals = vec![vec![9.0; MARK_RESIDUALS]];
}
/// Outcomes of frequencies, by their numbers.
type Ends<'a> = &'a [(usize, Outcome)];

#[test]
fn what_failed_is_solved_from_the_other_side_where_there_is_a_motion() {
    use Outcome::{Converged, IterationLimit, SlidesTooFar, Stagnated};
    let problem = mass_with_a_stop(100.0);
    let respond = |earlier: &[_]| mass_response(&problem, 0.1..=0.24, 8, |_| (), earlier);
    let (whole, records) = respond(&[]);
    // The halves meet between the frequencies 3 and 4. What failed, and which of that is solved.
    let cases: [(Ends<'_>, &[usize]); 8] = [
        (&[(0, Stagnated)], &[0]),
        (&[(2, Stagnated)], &[2]),
        (&[(5, IterationLimit)], &[5]),
        (&[(7, Stagnated)], &[7]),
        (&[(1, Stagnated), (2, Stagnated)], &[1, 2]),
        (&[(5, Stagnated), (6, Stagnated)], &[5, 6]),
        (&[(3, Stagnated), (4, Stagnated)], &[]),
        (&[(2, Stagnated), (3, SlidesTooFar)], &[2]),
    ];
    for (failed, solved) in cases {
        let mut earlier = records.clone();
        for (point, outcome) in failed {
            ended(&mut earlier[*point], *outcome);
        }
        let orbits = respond(&earlier).0.orbits;
        for (point, orbit) in orbits.iter().enumerate() {
            let expected = &whole.orbits[point];
            if !solved.contains(&point) {
                let kept = &earlier[point].orbit;
                assert!(
                    format!("{kept:?}") == format!("{orbit:?}"),
                    "{failed:?}: {point}"
                );
                continue;
            }
            assert_eq!(orbit.outcome, Converged, "{failed:?}: {point}");
            let off = orbit.observed_amplitude[0] / expected.observed_amplitude[0] - 1.0;
            assert!(off.abs() < 1e-7, "{failed:?}: {point}: {off}");
            // The attempts of both ways, in their order.
            assert_eq!(orbit.newton_residuals[0].len(), MARK_RESIDUALS);
            let inner_iterations = orbit.newton_residuals[1..].iter().map(|r| r.len() - 1);
            assert_eq!(
                orbit.newton_iterations,
                MARK + inner_iterations.sum::<usize>()
            );
            assert_eq!(orbit.krylov_iterations, MARK);
        }
    }
}

#[test]
fn of_two_motions_that_miss_the_accuracy_that_with_the_smaller_error_stays() {
    let at = |outcome, error: f64| Orbit {
        estimated_error: Some(error),
        ..made_up::orbit(1.0, outcome, &[1.0])
    };
    use Outcome::{AccuracyNotReached, Converged, Stagnated};
    let missed = |error| at(AccuracyNotReached, error);
    for (orbit, than, better) in [
        (at(Converged, 0.1), missed(0.2), true),
        (missed(0.2), missed(0.1), false),
        (missed(0.1), missed(0.1), false),
        (missed(0.9), at(Stagnated, 0.0), true),
        (at(Stagnated, 0.0), missed(0.9), false),
        (at(Stagnated, 0.0), at(Stagnated, 0.9), false),
    ] {
        assert_eq!(is_better(&orbit, &than), better);
    }
    // The motion that is kept counts the work of both.
    let problem = mass_with_a_stop(100.0);
    let respond = |earlier: &[_]| mass_response(&problem, 0.1..=0.24, 8, |_| (), earlier).0;
    let mut records = mass_response(&problem, 0.1..=0.24, 8, |_| (), &[]).1;
    ended(&mut records[2], AccuracyNotReached);
    records[2].orbit.estimated_error = Some(-1.0);
    let orbit = &respond(&records).orbits[2];
    assert_eq!((orbit.outcome, orbit.x[3]), (AccuracyNotReached, 0.0));
    assert!(orbit.newton_iterations > MARK && orbit.newton_residuals.len() > 1);
}

#[test]
fn a_frequency_without_a_motion_names_the_static_test_where_nothing_holds_the_mass() {
    let outcomes = |problem: &Problem, most_seconds: Option<f64>| {
        let change = |settings: &mut SweepSettings| settings.most_seconds = most_seconds;
        let (response, _) = mass_response(problem, 0.1..=0.12, 2, change, &[]);
        let outcomes = response.orbits.iter().map(|orbit| orbit.outcome);
        outcomes.collect::<Vec<_>>()
    };
    let mut problem = mass_with_a_stop(0.0);
    assert_eq!(outcomes(&problem, None), [Outcome::Converged; 2]);
    assert_eq!(outcomes(&problem, Some(0.0)), [Outcome::TimeLimit; 2]);
    // Without its spring, pressed against the stop by more and by less than the 0.1 N that excite
    // it. In the vibration the force of the stop reaches 0.108 N.
    problem.reduced_mut().stiffness[(0, 0)] = 0.0;
    problem.reduced_mut().static_load.on_x[0] = -0.105;
    assert_eq!(outcomes(&problem, Some(0.0)), [Outcome::TimeLimit; 2]);
    problem.reduced_mut().static_load.on_x[0] = -0.05;
    assert_eq!(
        outcomes(&problem, Some(0.0)),
        [Outcome::NoStaticEquilibrium; 2]
    );
}

#[test]
fn the_middle_of_the_range_is_an_angular_frequency() {
    assert_eq!(middle(&[1.0, 9.0, 3.0]), TAU * 2.0);
    assert_eq!(middle(&[5.0]), TAU * 5.0);
    assert_eq!(middle(&[]), 0.0);
}

#[test]
fn a_pair_slips_beyond_a_share_of_the_largest_static_slip_where_nothing_is_said() {
    let problem = mass_with_a_stop(1.0);
    let resolution = Resolution::fixed(1, 32);
    let mut settings = SweepSettings::new(vec![], resolution);
    let mut state = static_state(&problem, 1, settings.newton);
    state.x = vec![7.0, 3e-3, 4e-3];
    let threshold_m = |settings: &_, state: &_| {
        let damping = made_up::DAMPING;
        sweep(&problem, damping, state, settings, &[], &|_| ()).slip_threshold_m
    };
    assert!((threshold_m(&settings, &state) / 5e-8 - 1.0).abs() < 1e-12);
    // At rest nothing has slipped: a pair at its cone does not slip by rounding alone.
    state.x = vec![0.0; 3];
    state.lambda = vec![-3.0, 0.0, 0.0];
    let system = ContactSystem::new(&problem, made_up::DAMPING);
    let compression_m = 3.0 / settings.eps.values(&system, 0.0, 1)[0];
    assert!((threshold_m(&settings, &state) / (1e-9 * compression_m) - 1.0).abs() < 1e-12);
    settings.slip_threshold_m = Some(0.25);
    assert_eq!(threshold_m(&settings, &state), 0.25);
}

#[test]
fn the_linear_reference_has_the_harmonics_of_the_balance() {
    let mut problem = mass_with_a_stop(100.0);
    problem.excitations[0].harmonic = 3;
    let change = |settings: &mut SweepSettings| {
        settings.resolution = Resolution::fixed(3, 32);
    };
    let (response, _) = mass_response(&problem, 0.03..=0.04, 2, change, &[]);
    for linear in &response.linear {
        let expected = free_amplitude(3.0 * linear.frequency_hz);
        assert!((linear.observed_amplitude[0] / expected - 1.0).abs() < 1e-6);
    }
}
