//! Every solver with every choice of eps, with a number of harmonics or an accuracy, on grids and
//! curves, with a mean that is free or retained, in phase or as a wave, for one pair and several,
//! under forces below and above the preload. Each frequency has an outcome, and where the balance
//! holds all agree on the amplitude.

use dovetail_solver::contact::PairLaw;
use dovetail_solver::contact::penalty::PairStiffness;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::branch::follow;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::retention::Mean;
use dovetail_solver::dlft::settings::{EpsChoice, Resolution, Solver};
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Orbit, Outcome, SolvedFrequency, SweepProgress};
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{DiscExcitation, Load, ObservedPoint, ReducedModel, Waves};
use faer::Mat;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Mutex;

const DAMPING: Rayleigh = Rayleigh::mass_proportional(0.05);
/// Compression of each pair at rest.
const PRESS_N: f64 = 1.0;
const FRICTION: f64 = 0.3;
/// Spring between the same unknowns of neighbouring sectors.
const BETWEEN_N_M: f64 = 0.4;
const DISC: DiscExcitation = DiscExcitation {
    sectors: 3,
    engine_order: 1,
};
const FREQUENCIES_HZ: [f64; 3] = [0.08, 0.12, 0.2];

/// Model of the table.
#[derive(Debug, Clone, Copy)]
struct Case {
    pairs: usize,
    /// Nothing but friction holds the pairs along the contact.
    retained: bool,
    wave: bool,
    /// The force along the normals exceeds the preload.
    exceeds: bool,
}

/// Pairs of 1 kg, each on a spring of 1 N/m along its normal and, unless only friction holds them,
/// along the contact; neighbours are joined along the contact.
fn stiffness(case: Case) -> Mat<f64> {
    let n = 3 * case.pairs;
    let ground = if case.retained { 0.0 } else { 1.0 };
    let mut k = Mat::zeros(n, n);
    for i in 0..n {
        k[(i, i)] += if i % 3 == 0 { 1.0 } else { ground };
        if i % 3 > 0 && i + 3 < n {
            for (row, column, sign) in [(i, i, 1.0), (i + 3, i + 3, 1.0), (i, i + 3, -1.0)] {
                k[(row, column)] += 0.5 * sign;
                if row != column {
                    k[(column, row)] += 0.5 * sign;
                }
            }
        }
    }
    k
}

/// Two copies of a sector at nodal diameter 1, whose neighbours pull at the same unknowns:
/// K + 2 c (1 - cos(2 pi / N)).
fn copies(sector: &ReducedModel) -> ReducedModel {
    let n = sector.stiffness.nrows();
    let between = 2.0 * BETWEEN_N_M * (1.0 - (TAU / DISC.sectors as f64).cos());
    let twice = |of: &dyn Fn(usize, usize) -> f64| {
        Mat::from_fn(2 * n, 2 * n, |i, j| match i / n == j / n {
            true => of(i % n, j % n),
            false => 0.0,
        })
    };
    let own = |i: usize, j: usize| if i == j { between } else { 0.0 };
    let observed = |copy: usize, point: &ObservedPoint| {
        let on_x = (0..2 * n).map(|i| {
            if i / n == copy {
                point.on_x[i % n]
            } else {
                0.0
            }
        });
        ObservedPoint::new(point.name.clone(), on_x.collect(), vec![])
    };
    let both = (0..2).flat_map(|copy| sector.observations.iter().map(move |p| observed(copy, p)));
    ReducedModel {
        observations: both.collect(),
        ..ReducedModel::from_pair_matrices(
            twice(&|i, j| sector.stiffness[(i, j)] + own(i, j)),
            twice(&|i, j| sector.mass[(i, j)]),
        )
    }
}

fn problem(case: Case) -> Problem {
    let n = 3 * case.pairs;
    let pressed = (0..n).map(|i| if i % 3 == 0 { -PRESS_N } else { 0.0 });
    let last = |i: usize| f64::from(u8::from(i == n - 2));
    let mut reduced = ReducedModel {
        static_load: Load::new(pressed.collect(), vec![]),
        observations: vec![ObservedPoint::new(
            "last",
            (0..n).map(last).collect(),
            vec![],
        )],
        ..ReducedModel::from_pair_matrices(stiffness(case), Mat::identity(n, n))
    };
    let normal_n = if case.exceeds { 3.0 } else { 0.2 };
    let force: Vec<f64> = (0..n).map(|i| [normal_n, 0.4, 0.1][i % 3]).collect();
    let mut load = [force, vec![0.0; n]];
    if case.wave {
        reduced.waves = Waves::new(DISC, BTreeMap::from([(1, copies(&reduced))]));
        let wave = reduced.harmonic_model(1).wave.unwrap();
        load = wave.widened_parts([&load[0], &load[1]]);
    }
    let law = PairLaw {
        stiffness: Some(PairStiffness::new(5.0, 2.0)),
        ..PairLaw::rigid(FRICTION, 0.0)
    };
    let [cosine, sine] = load.map(|on_x| Load::new(on_x, vec![]));
    Problem {
        excitations: vec![HarmonicLoad {
            sine,
            ..HarmonicLoad::cosine(1, cosine)
        }],
        laws: vec![law; case.pairs],
        reduced: reduced.into(),
        modal_ratios: Vec::new(),
    }
}

fn solved(problem: &Problem, settings: &SweepSettings, on_curve: bool) -> Vec<Orbit> {
    let state = static_state(problem, 2, settings.newton);
    assert_eq!(state.outcome, Outcome::Converged);
    let solve = if on_curve { follow } else { sweep };
    let response = solve(problem, DAMPING, &state, settings, &[], &|_| ());
    let asked = |o: &Orbit| settings.frequencies_hz.contains(&o.frequency_hz);
    response.orbits.into_iter().filter(asked).collect()
}

/// Motion at a frequency.
#[derive(Debug)]
struct Found {
    solver: Solver,
    choice: EpsChoice,
    on_curve: bool,
    frequency_hz: f64,
    amplitude_m: f64,
    estimated_error: f64,
}

/// Motions that a case has with these settings. What has none has another outcome.
fn found(problem: &Problem, settings: &SweepSettings, on_curve: bool) -> Vec<Found> {
    let orbits = solved(problem, settings, on_curve).into_iter();
    let with_motion = orbits.filter(|orbit| orbit.outcome.has_motion());
    let found = with_motion.map(|orbit| Found {
        solver: settings.solver,
        choice: settings.eps.choice,
        on_curve,
        frequency_hz: orbit.frequency_hz,
        amplitude_m: orbit.observed_amplitude[0],
        estimated_error: orbit.estimated_error.expect("estimates are asked for"),
    });
    found.collect()
}

const RESOLUTIONS: [Resolution; 3] = [
    Resolution::fixed(1, 64),
    Resolution::fixed(3, 64),
    Resolution::Accuracy(0.02),
];
const CHOICES: [EpsChoice; 3] = [
    EpsChoice::Dynamic,
    EpsChoice::Pair,
    EpsChoice::SpectralRadius,
];

/// Motions of a case with a resolution, solved in every way at these frequencies.
fn solve_in_every_way(case: Case, resolution: Resolution, frequencies_hz: &[f64]) -> Vec<Found> {
    let problem = problem(case);
    let mut all = Vec::new();
    for solver in [Solver::NewtonKrylov, Solver::Powell] {
        for choice in CHOICES {
            let mut settings = SweepSettings::new(frequencies_hz.to_vec(), resolution);
            (settings.solver, settings.eps) = (solver, Eps::new(choice));
            settings.slip_threshold_m = Some(1e-9);
            all.extend(found(&problem, &settings, false));
            let is_followed = !case.exceeds && choice == EpsChoice::Dynamic;
            if is_followed && resolution != RESOLUTIONS[0] {
                all.extend(found(&problem, &settings, true));
            }
        }
    }
    assert!(all.iter().all(|found| found.amplitude_m.is_finite()));
    all
}

fn cases(exceeds: bool) -> impl Iterator<Item = Case> {
    (0..8).map(move |bits| {
        let is = |bit: u32| bits >> bit & 1 == 1;
        let retained = is(1);
        Case {
            pairs: match is(0) {
                true => 3 - usize::from(exceeds),
                false => 1 + usize::from(retained),
            },
            retained,
            wave: is(2),
            exceeds,
        }
    })
}

#[test]
fn all_solvers_and_choices_of_eps_agree_on_the_motion() {
    let mut largest = 0.0_f64;
    for (case, resolution) in cases(false).flat_map(|c| RESOLUTIONS.map(|r| (c, r))) {
        let all = solve_in_every_way(case, resolution, &FREQUENCIES_HZ);
        for hz in FREQUENCIES_HZ {
            let at: Vec<&Found> = all.iter().filter(|f| f.frequency_hz == hz).collect();
            // Six ways, and on a curve two.
            assert!(at.len() >= 6, "{case:?} {resolution:?} {hz} Hz: {at:?}");
            for (i, one) in at.iter().enumerate() {
                for other in &at[..i] {
                    let off = (one.amplitude_m / other.amplitude_m - 1.0).abs();
                    let allowed = 1e-6 + one.estimated_error + other.estimated_error;
                    let what = format!("{case:?} {resolution:?} {hz} Hz: {one:?} {other:?}");
                    assert!(off < allowed, "{what}");
                    largest = largest.max(off);
                }
            }
        }
        // Another solver changes nothing, its estimates included.
        let of = |solver: Solver| {
            let swept = all
                .iter()
                .filter(move |f| f.solver == solver && !f.on_curve);
            swept.map(|f| (f.amplitude_m, f.estimated_error, f.choice))
        };
        for (one, other) in of(Solver::NewtonKrylov).zip(of(Solver::Powell)) {
            let what = format!("{case:?} {resolution:?}: {one:?} {other:?}");
            assert_eq!(one.2, other.2, "{what}");
            assert!((one.0 / other.0 - 1.0).abs() < 1e-4, "{what}");
            assert!((one.1 - other.1).abs() < 1e-3 + 0.1 * one.1, "{what}");
        }
    }
    println!("apart by {largest:.1e} at most");
}

#[test]
fn every_way_ends_with_an_outcome_where_the_excitation_exceeds_the_preload() {
    for case in cases(true) {
        for resolution in [Resolution::fixed(1, 64), Resolution::Accuracy(0.1)] {
            solve_in_every_way(case, resolution, &[0.2]);
        }
    }
}

const ACCURACY: f64 = 0.05;
/// Harmonics of the levels of an accuracy.
const LEVELS: [usize; 8] = [1, 3, 5, 7, 9, 11, 15, 21];

/// A record of a frequency has the mean of its motion, and the level of its harmonics or, where the
/// error is far below the accuracy, the one below. This holds after a second attempt as well.
#[test]
fn a_record_has_the_mean_and_the_level_that_its_motion_was_solved_with() {
    let problem = problem(Case {
        pairs: 2,
        retained: true,
        wave: false,
        exceeds: true,
    });
    let frequencies_hz = (0..16).map(|i| 0.05 + 0.015 * f64::from(i)).collect();
    let settings = SweepSettings::new(frequencies_hz, Resolution::Accuracy(ACCURACY));
    let state = static_state(&problem, 2, settings.newton);
    let records = Mutex::new(Vec::new());
    let tell = |told: SweepProgress<'_>| {
        if let SweepProgress::Solved(solved) = told {
            records.lock().unwrap().push(solved.clone());
        }
    };
    sweep(&problem, DAMPING, &state, &settings, &[], &tell);
    let records: Vec<SolvedFrequency> = records.into_inner().unwrap();
    for record in records.iter().filter(|r| r.orbit.outcome.has_motion()) {
        let orbit = &record.orbit;
        let what = format!("{} Hz, again {}", orbit.frequency_hz, record.again);
        let is_held = orbit.retention_n > 0.0;
        assert_eq!(orbit.mean == Mean::Retained, is_held, "{what}");
        let level = LEVELS.iter().position(|h| *h == orbit.harmonics).unwrap();
        let is_plenty = orbit.estimated_error.unwrap() <= 0.2 * ACCURACY;
        let next = level - usize::from(is_plenty);
        assert_eq!(record.next_level, next, "{what}");
    }
    let again = records.iter().filter(|r| r.again);
    let levels: Vec<(Mean, usize)> = again.map(|r| (r.orbit.mean, r.next_level)).collect();
    let is_retained = |of: &(Mean, usize)| of.0 == Mean::Retained;
    assert!(levels.iter().any(is_retained), "{levels:?}");
}
