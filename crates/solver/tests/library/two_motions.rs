//! A mass with a stop: its curve folds, and one frequency has two motions. Whatever the range, both
//! are named where the curve is followed, and a grid tells of a jump.

use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::branch::{follow, stable_in_drawing};
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Response, SecondMotion};
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel};
use dovetail_solver::results::peak::{jump_hz, peak};
use faer::Mat;
use std::f64::consts::TAU;

use crate::shared_problems::diagonal;

const DAMPING: Rayleigh = Rayleigh::mass_proportional(0.03);
const FORCE_N: f64 = 0.1;
const GAP_M: f64 = 1.0;
const STOP_N_M: f64 = 5.0;

/// 1 kg on a spring of 1 N/m, in front of a stop on a spring of 5 N/m that it touches after 1 m. X
/// opens the pair of both; with X = 0 both springs carry the mass.
fn oscillator() -> Problem {
    let both = 1.0 + STOP_N_M;
    // The mass moves so far for X = 1, and the stop by 1 more.
    let of_x = -STOP_N_M / both;
    let along = |v: f64| vec![v, 0.0, 0.0];
    let stiffness = STOP_N_M / both;
    let load = |force_n: f64| Load::new(along(of_x * force_n), vec![force_n]);
    Problem {
        reduced: ReducedModel {
            static_load: load(0.0),
            observations: vec![ObservedPoint::new("mass", along(of_x), vec![1.0])],
            ..ReducedModel::new(
                diagonal([stiffness, 1.0, 1.0]),
                diagonal([of_x * of_x, 1.0, 1.0]),
                Mat::from_fn(3, 1, |i, _| along(of_x)[i]),
                vec![both],
            )
        }
        .into(),
        laws: vec![PairLaw::rigid(0.0, GAP_M)],
        excitations: vec![HarmonicLoad::cosine(1, load(FORCE_N))],
        modal_ratios: Vec::new(),
    }
}

fn settings(frequencies_hz: Vec<f64>, harmonics: usize) -> SweepSettings {
    let mut settings = SweepSettings::new(frequencies_hz, Resolution::fixed(harmonics, 256));
    settings.slip_threshold_m = Some(1e-9);
    settings
}

/// Curve that is followed between two frequencies, past those asked for.
fn respond(from_hz: f64, asked_hz: &[f64], to_hz: f64, harmonics: usize) -> Response {
    let model = oscillator();
    let settings = settings([&[from_hz], asked_hz, &[to_hz]].concat(), harmonics);
    let state = static_state(&model, 10, settings.newton);
    follow(&model, DAMPING, &state, &settings, &[], &|_| ())
}

/// A step of the mass in time, by the Runge-Kutta method of order 4, which is no part of the
/// program.
fn step(state: [f64; 2], time: f64, dt: f64, omega: f64) -> [f64; 2] {
    let rate = |[u, v]: [f64; 2], t: f64| {
        let stop = STOP_N_M * (u - GAP_M).max(0.0);
        [v, FORCE_N * (omega * t).cos() - 0.03 * v - u - stop]
    };
    let moved = |k: [f64; 2], by: f64| [state[0] + by * k[0], state[1] + by * k[1]];
    let a = rate(state, time);
    let b = rate(moved(a, 0.5 * dt), time + 0.5 * dt);
    let c = rate(moved(b, 0.5 * dt), time + 0.5 * dt);
    let d = rate(moved(c, dt), time + dt);
    [0, 1].map(|i| state[i] + dt / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
}

/// Amplitudes of the steady motion at a frequency that is reached from another one in small steps.
fn reached(from_hz: f64, to_hz: f64) -> f64 {
    let (mut state, mut amplitude) = ([0.0; 2], 0.0);
    let steps = 400;
    for i in 0..=80 {
        let hz = from_hz + (to_hz - from_hz) * f64::from(i) / 80.0;
        let dt = 1.0 / (hz * f64::from(steps));
        let periods = if i == 80 { 300 } else { 60 };
        for period in 0..periods {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for n in 0..steps {
                state = step(state, f64::from(n) * dt, dt, TAU * hz);
                (low, high) = (low.min(state[0]), high.max(state[0]));
            }
            if period + 1 == periods {
                amplitude = 0.5 * (high - low);
            }
        }
    }
    amplitude
}

/// Range with both motions. The small one ends where it reaches the stop, at a corner of the curve:
/// (1 - w^2)^2 + (0.03 w)^2 = 0.1^2. By steps in time the large one ends near 0.2 Hz.
fn both_motions(response: &Response) -> &SecondMotion {
    let [two] = &response.second_motions[..] else {
        panic!("{:?}", response.second_motions);
    };
    assert!((two.from_hz - 0.166_539).abs() < 1e-4, "{two:?}");
    assert!((two.to_hz - 0.2016).abs() < 1e-3, "{two:?}");
    two
}

#[test]
fn whatever_the_range_both_motions_of_a_fold_are_named() {
    let by_time = [(0.14, 0.185), (0.28, 0.185)].map(|(from, to)| reached(from, to));
    println!("by steps in time at 0.185 Hz: {by_time:.3?} m");
    assert!(by_time[0] > 1.5 * by_time[1], "{by_time:?}");
    let mut peaks = Vec::new();
    for (from_hz, to_hz) in [(0.12, 0.26), (0.12, 0.32), (0.15, 0.45)] {
        let response = respond(from_hz, &[], to_hz, 7);
        println!("{from_hz} to {to_hz} Hz: {:?}", response.second_motions);
        assert!(response.orbits.iter().all(|o| o.outcome.is_converged()));
        let two = both_motions(&response);
        assert!(two.from_hz <= two.frequency_hz && two.frequency_hz <= two.to_hz);
        let top = peak(&response, 0).unwrap();
        println!(
            "peak {:.5} m at {:.5} Hz",
            top.amplitude_m, top.frequency_hz
        );
        peaks.push([top.amplitude_m, top.frequency_hz]);
    }
    for (found, first) in peaks.iter().flatten().zip(peaks[0].iter().cycle()) {
        assert!((found / first - 1.0).abs() < 1e-3, "{peaks:?}");
    }
}

/// A grid goes over from one motion to the other where its halves meet or one ends, and knows of
/// the jump alone.
#[test]
fn a_grid_over_a_fold_has_a_jump() {
    let model = oscillator();
    for (from_hz, to_hz, points) in [(0.12, 0.26, 57), (0.12, 0.26, 141), (0.15, 0.45, 121)] {
        let spacing_hz = (to_hz - from_hz) / f64::from(points - 1);
        let frequencies_hz = (0..points).map(|i| from_hz + spacing_hz * f64::from(i));
        let settings = settings(frequencies_hz.collect(), 7);
        let state = static_state(&model, 10, settings.newton);
        let response = sweep(&model, DAMPING, &state, &settings, &[], &|_| ());
        assert_eq!(response.second_motions, []);
        let jump = jump_hz(&response, 0);
        println!("{from_hz} to {to_hz} Hz, {points} points: {jump:?}");
        let [before_hz, after_hz] = jump.unwrap();
        assert!(
            0.165 < before_hz && after_hz < 0.205,
            "{before_hz} {after_hz}"
        );
    }
}

/// Half of the range that a signal covers in a period, from its Fourier coefficients.
fn half_range(coefficients: &[f64]) -> f64 {
    let at = |t: f64| {
        let pairs = coefficients[1..].chunks_exact(2).enumerate();
        let parts = pairs.map(|(i, c)| {
            let (sine, cosine) = (t * (i + 1) as f64).sin_cos();
            c[0] * cosine + c[1] * sine
        });
        parts.sum::<f64>()
    };
    let samples = (0..4000).map(|i| at(TAU * f64::from(i) / 4000.0));
    let (low, high) = samples.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    0.5 * (high - low)
}

/// At each of three frequencies the branch has a large motion, an unstable one, and a small one.
/// Steps in time reach the large one from below and the small one from above, and neither the one
/// between.
#[test]
fn one_branch_has_both_motions_that_steps_in_time_reach_and_one_between() {
    let asked_hz = [0.175, 0.185, 0.195];
    let response = respond(0.1, &asked_hz, 0.42, 21);
    println!("{} points", response.orbits.len());
    assert_eq!(response.curves().len(), 1, "{:?}", response.branches);
    assert!(response.orbits.len() < 60, "{}", response.orbits.len());
    both_motions(&response);
    let stable = stable_in_drawing(&response);
    for hz in asked_hz {
        let at = (response.orbits.iter().zip(&stable)).filter(|(o, _)| o.frequency_hz == hz);
        let (found, stable): (Vec<f64>, Vec<bool>) = at
            .map(|(o, stable)| (half_range(&o.observed[0]), stable))
            .unzip();
        assert_eq!(stable, [true, false, true], "{hz} Hz");
        let by_time = [0.14, 0.28].map(|from_hz| reached(from_hz, hz));
        println!("{hz} Hz: {found:.4?}, in time {by_time:.4?} m");
        let [large, between, small] = found[..] else {
            panic!("{hz} Hz: {found:?}");
        };
        assert!(large > between && between > small, "{hz} Hz: {found:?}");
        for (found, by_time) in [(large, by_time[0]), (small, by_time[1])] {
            assert!(
                (found / by_time - 1.0).abs() < 5e-3,
                "{hz}: {found} {by_time}"
            );
        }
    }
}
