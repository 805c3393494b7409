//! Tests of the evaluation of a pair and of its derivative, by differences and by finer samples.

use super::*;
use crate::contact::{PairLaw, PredictedLaw};
use crate::dlft::pair_signals::Rounding;

fn force(width: usize, seed: f64) -> Vec<f64> {
    (0..3 * width)
        .map(|i| {
            let base = if i == 0 { -1.0 } else { 0.0 };
            base + 0.8 * (seed + 1.7 * i as f64).sin() / (1 + i % width) as f64
        })
        .collect()
}

/// Compares the derivative with central differences of step `h`.
fn check_derivative(fourier: &Fourier, input: PairInput<'_>, h: f64, what: &str) -> PairEnd {
    let (samples, full) = (fourier.samples(), 3 * fourier.width());
    let mut signals = Signals::new(samples);
    let end = contact_forces(fourier, input, &mut signals, &mut vec![0.0; full]);
    assert!(end.periodic);
    let mut d = vec![0.0; full * full];
    contact_force_derivative(fourier, input, &signals, &end, &mut d);
    for column in 0..full {
        let sides = [h, -h].map(|step| {
            let mut force = input.force.to_vec();
            force[column] += step;
            let mut lambda = vec![0.0; full];
            let moved = PairInput {
                force: &force,
                ..input
            };
            contact_forces(fourier, moved, &mut Signals::new(samples), &mut lambda);
            lambda
        });
        for row in 0..full {
            let difference = (sides[0][row] - sides[1][row]) / (2.0 * h);
            let exact = d[row * full + column];
            assert!(
                (difference - exact).abs() < 1e-4,
                "{what}: row {row}, column {column}: {exact}, by differences {difference}"
            );
        }
    }
    end
}

fn law(friction: f64, gap_m: f64) -> PredictedLaw {
    PairLaw::rigid(friction, gap_m).predicted([1.0; 2], f64::INFINITY)
}

fn start(slid_n: [f64; 2]) -> PairState {
    PairState {
        contact: Contact::Stick,
        slid_n,
    }
}

/// Pair without clearance under this prediction, which has not slid before.
fn input(force: &[f64]) -> PairInput<'_> {
    PairInput {
        periods: Periods::UntilPeriodic,
        force,
        law: law(0.3, 0.0),
        start: start([0.0; 2]),
        rounding: None,
        plain_periods: PLAIN_PERIODS,
    }
}

/// Pair with an initial clearance, which has slid before.
fn shifted(force: &[f64]) -> PairInput<'_> {
    PairInput {
        law: law(0.4, 0.05),
        start: start([0.03, -0.02]),
        ..input(force)
    }
}

#[test]
fn derivative_with_slip_history_matches_differences() {
    let fourier = Fourier::new(3, 64);
    let (mut sliding, mut opening, mut solved) = (0, 0, 0);
    for trial in 0..30 {
        let f = force(fourier.width(), trial as f64);
        let end = check_derivative(&fourier, shifted(&f), 1e-7, &format!("trial {trial}"));
        sliding += usize::from(!end.always_stuck);
        opening += usize::from(end.open_samples > 0);
        solved += usize::from(matches!(end.history, History::FixedPoint { .. }));
    }
    assert!(
        sliding > 10 && opening > 5 && solved > 2,
        "{sliding} {opening} {solved}"
    );
}

/// Largest error of a coefficient of the contact force with 64 samples, for predictions that
/// change direction fast. The reference is the same law with 16384 samples and changes of state
/// at whole samples.
fn error_of_few_samples(periods: Periods, swing: f64, normal_swing: f64) -> f64 {
    let [few, many] = [64, 16384].map(|samples| Fourier::new(3, samples));
    let mut largest = 0.0_f64;
    for trial in 0..40 {
        let phase = 0.157 * f64::from(trial);
        let mut f = vec![0.0; 21];
        f[0] = -1.0;
        (f[1], f[2]) = (
            normal_swing * (1.3 + phase).cos(),
            normal_swing * (1.3 + phase).sin(),
        );
        (f[8], f[9]) = (swing * phase.cos(), swing * phase.sin());
        (f[12], f[13]) = (
            0.1 * swing * (3.0 * phase).cos(),
            0.1 * swing * (3.0 * phase).sin(),
        );
        let force = |fourier: &Fourier, periods| {
            let input = PairInput {
                periods,
                ..input(&f)
            };
            let mut lambda = vec![0.0; 21];
            let mut signals = Signals::new(fourier.samples());
            contact_forces(fourier, input, &mut signals, &mut lambda);
            lambda
        };
        let [found, exact] = [force(&few, periods), force(&many, Periods::Exactly(3))];
        let errors = found.iter().zip(&exact).map(|(a, b)| (a - b).abs());
        largest = errors.fold(largest, f64::max);
    }
    largest
}

#[test]
fn friction_that_reverses_between_two_samples_counts_at_its_instant() {
    // Swings of 10 and of 100 times the limit of friction, with a steady normal force, one that
    // changes, and one that opens the pair.
    for (swing, normal_swing) in [(3.0, 0.0), (30.0, 0.0), (3.0, 0.5), (30.0, 0.5), (3.0, 1.3)] {
        let own = error_of_few_samples(Periods::UntilPeriodic, swing, normal_swing);
        let at_samples = error_of_few_samples(Periods::Exactly(3), swing, normal_swing);
        println!("swings of {swing} and {normal_swing}: {own:.1e}, at samples {at_samples:.1e}");
        assert!(own < 2e-3, "{swing} {normal_swing}: {own}, {at_samples}");
        if normal_swing < 1.0 {
            assert!(own < 0.4 * at_samples, "{swing}: {own}, {at_samples}");
        }
    }
}

#[test]
fn a_period_that_is_cut_short_ends_as_a_whole_one() {
    let fourier = Fourier::new(3, 64);
    let mut slid = 0;
    for trial in 0..30 {
        let f = force(fourier.width(), trial as f64);
        let input = shifted(&f);
        let mut signals = Signals::new(64);
        let mut lambda = vec![0.0; f.len()];
        let end = contact_forces(&fourier, input, &mut signals, &mut lambda);
        // Once more from where it ends, to its end.
        let mut state = PairState {
            contact: signals.contact[63],
            slid_n: signals.passages[63].position_n,
        };
        let start_n = state.slid_n;
        let mut whole = Signals::new(64);
        whole.lambda_u.copy_from_slice(&signals.lambda_u);
        whole.reverses.copy_from_slice(&signals.reverses);
        let passed = one_period(64, &input, &mut whole, &mut state, None, true);
        assert!(matches!(passed, Period::Whole(Some(_))));
        assert_eq!(whole.contact, signals.contact);
        for (a, b) in whole.lambda.iter().zip(&signals.lambda) {
            assert!((a - b).abs() < 1e-10, "trial {trial}: {a} {b}");
        }
        let [path, _] = whole.path(start_n, input.law.shift_n);
        assert!((path - end.slid_n).abs() < 1e-9, "{path} {}", end.slid_n);
        slid += usize::from(path > 0.1);
    }
    assert!(slid > 10, "{slid}");
}

#[test]
fn the_last_period_is_repeated_to_the_same_bits() {
    let fourier = Fourier::new(3, 64);
    let (mut cut, mut whole) = (0, 0);
    let mut again = Signals::new(64);
    for trial in 0..40 {
        let f = force(fourier.width(), trial as f64);
        for periods in [Periods::UntilPeriodic, Periods::Exactly(3)] {
            let input = PairInput {
                periods,
                ..shifted(&f)
            };
            let mut signals = Signals::new(64);
            let end = contact_forces(&fourier, input, &mut signals, &mut vec![0.0; f.len()]);
            if matches!(end.history, History::Stuck(_)) {
                continue;
            }
            last_period(&fourier, input, &end, &mut again);
            assert_eq!(again.lambda, signals.lambda, "trial {trial}");
            assert_eq!(again.contact, signals.contact, "trial {trial}");
            cut += usize::from(end.last.cut.is_some());
            whole += usize::from(end.last.cut.is_none());
        }
    }
    assert!(cut > 10 && whole > 10, "{cut} {whole}");
}

#[test]
fn derivative_of_a_rounded_law_matches_differences() {
    let fourier = Fourier::new(3, 64);
    for trial in 0..10 {
        for (sharpness, width_n) in [(2.0, 0.0), (8.0, 0.0), (2.0, 1.0), (8.0, 0.1)] {
            let f = force(fourier.width(), trial as f64);
            let input = PairInput {
                rounding: Some(Rounding { sharpness, width_n }),
                ..shifted(&f)
            };
            let what = format!("trial {trial}, {sharpness}, {width_n}");
            check_derivative(&fourier, input, 1e-6, &what);
        }
    }
}

#[test]
fn derivative_of_a_pair_that_shakes_down_between_two_cones_matches_differences() {
    let fourier = Fourier::new(1, 64);
    let mut shaken = 0;
    let mut came_to_stick = 0;
    for trial in 0..40 {
        let angle = trial as f64;
        // N, t1, t2: steady compression, an elliptic tangential force within the cone's size.
        let f = [-1.0, 0.02, 0.01, 0.0, 0.2, 0.05, 0.0, 0.03, 0.16];
        let input = PairInput {
            law: law(0.25, 0.0),
            start: start([0.3 * angle.cos(), 0.3 * angle.sin()]),
            ..input(&f)
        };
        let end = check_derivative(&fourier, input, 1e-6, &format!("trial {trial}"));
        let fixed = matches!(end.history, History::FixedPoint { .. });
        shaken += usize::from(fixed && end.slid_n < 1e-8);
        came_to_stick += usize::from(matches!(end.history, History::Stuck(1..)));
    }
    assert!(shaken > 2, "{shaken}");
    assert!(came_to_stick > 2, "{came_to_stick}");
}

#[test]
fn a_pair_inside_its_cone_returns_its_prediction_and_an_identity_derivative() {
    let fourier = Fourier::new(2, 32);
    let full = 3 * fourier.width();
    let mut f = vec![0.0; full];
    f[0] = -10.0;
    f[6] = 0.5;
    let mut signals = Signals::new(32);
    let mut lambda = vec![0.0; full];
    let end = contact_forces(&fourier, input(&f), &mut signals, &mut lambda);
    assert!(end.always_stuck && end.periodic && end.history == History::Stuck(0));
    let mut d = vec![0.0; full * full];
    contact_force_derivative(&fourier, input(&f), &signals, &end, &mut d);
    for i in 0..full {
        assert!((lambda[i] - f[i]).abs() < 1e-14);
        for j in 0..full {
            let identity = f64::from(u8::from(i == j));
            assert!((d[i * full + j] - identity).abs() < 1e-14);
        }
    }
}

/// Prediction that goes round in a circle of this radius, N, under a compression of 1 N, with one
/// harmonic.
fn circle(radius_n: f64) -> [f64; 9] {
    let mut force = [0.0; 9];
    (force[0], force[4], force[8]) = (-1.0, radius_n, radius_n);
    force
}

/// Largest error of a coefficient of the force of a pair whose prediction goes round in a circle,
/// relative to the limit of friction, 0.3 N.
fn error_on_a_circle(radius_n: f64, samples: usize) -> f64 {
    let fourier = Fourier::new(1, samples);
    let force = circle(radius_n);
    let mut lambda = vec![0.0; 9];
    let mut signals = Signals::new(samples);
    let end = contact_forces(&fourier, input(&force), &mut signals, &mut lambda);
    assert!(end.periodic);
    // The slider follows in a circle, with the force at right angles to its radius.
    let (s, c) = (0.3 / radius_n).acos().sin_cos();
    let exact = [c, -s, s, c].map(|v| 0.3 * v);
    let found = [lambda[4], lambda[5], lambda[7], lambda[8]];
    let off = found.iter().zip(exact).map(|(f, e)| (f - e).abs());
    off.fold(0.0, f64::max) / 0.3
}

#[test]
fn the_direction_of_friction_is_of_second_order_in_the_samples() {
    for radius_n in [0.31, 0.5, 3.0, 3e3, 3e6] {
        let errors = [64, 128, 256].map(|samples| error_on_a_circle(radius_n, samples));
        assert!(errors[0] < 2e-3, "{radius_n}: {errors:?}");
        for pair in errors.windows(2) {
            let falls = pair[1] < 1e-9 || pair[0] / pair[1] > 3.5;
            assert!(falls, "{radius_n}: {errors:?}");
        }
    }
}

#[test]
fn a_pair_forgets_its_past_however_far_it_slides_in_a_period() {
    let fourier = Fourier::new(1, 64);
    for exponent in 0..=7 {
        let radius_n = 10.0_f64.powi(exponent);
        let force = circle(radius_n);
        let input = input(&force);
        let mut signals = Signals::new(64);
        signals.predict(&fourier, &input);
        let last = signals.prediction(63, 0.0);
        let after_a_period = [0.8, 1.1].map(|angle: f64| {
            let pulls = [-1.0, 0.3 * angle.cos(), 0.3 * angle.sin()];
            let mut state = PairState::from_contact_force(last, Contact::Slip, pulls);
            one_period(64, &input, &mut signals, &mut state, None, false);
            state
        });
        let [one, other] = after_a_period;
        let apart = one.distance_n(&other) / 0.3;
        assert!(apart < 0.03 + 1e-15 * radius_n, "{radius_n}: {apart}");
    }
}
