//! Comparison of Jacobians written by hand with differences of their own residuals, at points where
//! pairs stick, slip and open. The points, and the linear solves of the Newton-Krylov method, are
//! tested here; the other solvers have their tests beside them.

use super::PairStatus;
use super::balance::{Balance, Setting};
use super::eps::Eps;
use super::frozen::FrozenContacts;
use super::newton_krylov::{KrylovSystem, Preconditioner};
use super::pair_signals::Periods;
use super::retention::{Mean, Retention};
use crate::contact::PairLaw;
use crate::contact::penalty::PairStiffness;
use crate::damping::Rayleigh;
use crate::dlft::settings::EpsChoice;
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::problem::inexact::InexactModel;
use crate::problem::{HarmonicLoad, LinearReference, Problem};
use crate::reduced::{
    Dashpots, DiscExcitation, Influence, InfluenceCoefficient, Load, ObservedPoint, ReducedModel,
    Waves,
};
use dovetail_numerics::fourier::Fourier;
use dovetail_numerics::nonlinear::NonlinearSystem;
use dovetail_testkit::differences::{assert_close, central};
use faer::Mat;
use std::collections::BTreeMap;
use std::sync::Arc;

const HARMONICS: usize = 3;
const SAMPLES: usize = 64;
/// Angular frequency of the balances, rad/s.
pub(crate) const OMEGA_RAD_S: f64 = 0.4;
/// Rank of the mass. That of the linear solves, through as many soft motions, is then exact.
const MASSES: usize = 12;
const MODES: usize = 3;

/// Motion that a pair is made to have in a period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Motion {
    Sticks,
    /// Always pressed together, slides for a part of the period.
    Slides,
    /// Slides, and is apart for a part of the period.
    LiftsOff,
    StaysOpen,
}

use Motion::{LiftsOff, Slides, StaysOpen, Sticks};

/// Numbers between -1 and 1, the same on every machine.
pub(crate) fn mixed(i: usize, seed: usize) -> f64 {
    ((i * 7919 + 104_729 * (seed + 1)) as f64 * 0.618_033_988_75).sin()
}

fn mixed_load(n: usize, modes: usize, seed: usize) -> Load {
    let mixed_of = |n: usize, seed| (0..n).map(|i| mixed(i, seed)).collect();
    Load::new(mixed_of(n, seed), mixed_of(modes, seed + 1))
}

/// Problem of `pairs` pairs with full K, coupled to modes, each with a law of its own; nothing
/// holds the slide of all pairs along t1.
pub(crate) fn problem(pairs: usize) -> Problem {
    let n = 3 * pairs;
    let slide = 1.0 / (pairs as f64).sqrt();
    let b = Mat::from_fn(n, n, |i, j| {
        let diagonal = if i == j { 2.0 } else { 0.0 };
        diagonal + 0.3 * mixed(i * n + j, 0)
    });
    // Orthogonal to the slide.
    let across = Mat::from_fn(n, n, |i, j| {
        let unit = if i == j { 1.0 } else { 0.0 };
        let common = if i % 3 == 1 && j % 3 == 1 {
            slide * slide
        } else {
            0.0
        };
        unit - common
    });
    let b = &b * &across;
    let stiffness = b.transpose() * &b;
    let load = |seed: usize| mixed_load(n, MODES, seed);
    let observation = |seed: usize| {
        let Load { on_x, on_modes } = load(seed);
        ObservedPoint::new(seed.to_string(), on_x, on_modes)
    };
    let g = Mat::from_fn(n, MASSES, |i, j| 0.3 * mixed(i * MASSES + j, 1));
    let coupling = Mat::from_fn(n, MODES, |i, j| 0.2 * mixed(i * MODES + j, 2));
    let reduced = ReducedModel {
        static_load: load(20),
        observations: [70, 80].map(observation).to_vec(),
        ..ReducedModel::new(stiffness, &g * g.transpose(), coupling, vec![0.9, 2.5, 4.0])
    };
    Problem {
        reduced: reduced.into(),
        // The last is beyond the harmonics of the balances.
        excitations: [1, 2, HARMONICS + 1]
            .map(|harmonic| HarmonicLoad {
                sine: load(25 + 10 * harmonic),
                ..HarmonicLoad::cosine(harmonic, load(20 + 10 * harmonic))
            })
            .to_vec(),
        laws: (0..pairs)
            .map(|p| PairLaw::rigid(0.3 + 0.05 * p as f64, 0.1 * (p % 3) as f64))
            .collect(),
        modal_ratios: Vec::new(),
    }
}

/// Pair, of the nine of a balance, that is open in the static state. It lifts off in the first kind
/// of motions.
pub(crate) const OPEN_AT_REST: usize = 5;

/// Nine pairs of which most take part in the linear solves; the other list has two that do.
const MANY: [Motion; 9] = [
    Sticks, Slides, LiftsOff, StaysOpen, Slides, LiftsOff, Sticks, Slides, StaysOpen,
];
const FEW: [Motion; 9] = [
    Sticks, Sticks, Slides, Sticks, Sticks, Sticks, LiftsOff, Sticks, Sticks,
];

/// Share of lambda_u that the law uses of a pair with this motion, in one block of 3 per
/// coefficient. `shift_n` is what the law adds to N.
fn lambda_u(motion: Motion, pair: usize, shift_n: f64, start: [f64; 2]) -> Vec<[f64; 3]> {
    let (press, shake, rub) = match motion {
        Sticks => (20.0, 0.2, 0.2),
        Slides => (1.5, 0.2, 0.8),
        LiftsOff => (0.3, 0.8, 0.6),
        StaysOpen => (-8.0, 0.2, 0.6),
    };
    let mut blocks = vec![[-press - shift_n, start[0], start[1]]];
    for h in 1..=2 * HARMONICS {
        let fall = 1.0 / h.div_ceil(2) as f64;
        blocks.push([0, 1, 2].map(|c| {
            let size = if c == 0 { shake } else { rub };
            size * fall * mixed(20 * pair + 3 * h + c, 4)
        }));
    }
    blocks
}

/// Dashpots and damping ratios of two stuck modes, beside a Rayleigh damping of all, and two modes on
/// which the air acts in waves.
fn damp(problem: &mut Problem) {
    let n = problem.reduced.stiffness.nrows();
    let mixed_of = |n: usize, seed| (0..n).map(|i| mixed(i, seed)).collect();
    let dashpot = |j: usize| {
        let weights = Load::new(mixed_of(n, 100 + j), mixed_of(MODES, 110 + j));
        (0.3 + 0.2 * j as f64, weights)
    };
    let influenced = [0, 1].map(|j| mixed_load(n, MODES, 120 + 2 * j));
    problem.reduced_mut().dashpots =
        Dashpots::new(n, MODES, &[0, 1].map(dashpot)).with_influenced(&influenced);
    problem.modal_ratios = vec![0.02, 0.1];
}

/// Aerodynamic influence of modes 1 and 2 on each other in all waves of three sectors.
fn influence_of_three() -> Vec<InfluenceCoefficient> {
    let waves = [-1, 0, 1]
        .into_iter()
        .flat_map(|wave| [[1, 1], [1, 2], [2, 1], [2, 2]].map(|modes| (wave, modes)));
    let coefficient =
        |(i, (nodal_diameter, modes)): (usize, (i64, [usize; 2]))| InfluenceCoefficient {
            nodal_diameter,
            mode: modes[0],
            by_mode: modes[1],
            real_n_m: 0.3 * mixed(i, 310),
            imaginary_n_m: 0.3 * mixed(i, 311),
        };
    waves.enumerate().map(coefficient).collect()
}

/// Makes the sector of a problem one of three, with an excitation of engine order 1: harmonics 1 and 2
/// are waves that run in either direction, and harmonic 3 is in phase.
fn make_waves(problem: &mut Problem) {
    let ReducedModel {
        stiffness,
        mass,
        omega2,
        ..
    } = &*problem.reduced;
    let n = stiffness.nrows();
    // [[A, -B], [B, A]] with a symmetric A and a skew B.
    let copies = |own: &Mat<f64>, seed: usize| {
        let skew = |i: usize, j: usize| {
            let [low, high] = [i.min(j), i.max(j)];
            let sign = (j as f64 - i as f64).signum();
            0.2 * sign * f64::from(i != j) * mixed(low * n + high, seed)
        };
        Mat::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, true) => own[(i, j)],
            (true, false) => -skew(i, j - n),
            (false, true) => skew(i - n, j),
            (false, false) => own[(i - n, j - n)],
        })
    };
    let part = |i: usize, m: usize, seed: usize| 0.2 * mixed(i * MODES + m, seed);
    let coupling = Mat::from_fn(2 * n, 2 * MODES, |i, m| match (i < n, m % 2) {
        (true, 0) => part(i, m / 2, 130),
        (false, 0) => part(i - n, m / 2, 131),
        (true, _) => -part(i, m / 2, 131),
        (false, _) => part(i - n, m / 2, 130),
    });
    let omega2 = omega2.iter().flat_map(|w2| [1.3 * w2; 2]).collect();
    let load = |seed: usize| mixed_load(2 * n, 2 * MODES, seed);
    let observation = |seed: usize| {
        let Load { on_x, on_modes } = load(seed);
        ObservedPoint::new(seed.to_string(), on_x, on_modes)
    };
    let mut model = ReducedModel {
        observations: [140, 150, 160, 170].map(observation).to_vec(),
        ..ReducedModel::new(copies(stiffness, 132), copies(mass, 133), coupling, omega2)
    };
    let dashpot = |j: usize| (0.3 + 0.2 * j as f64, load(180 + 10 * j));
    let is_damped = problem.reduced.dashpots.count() > 0;
    if is_damped {
        let influenced = [0, 1, 2, 3].map(|j| load(300 + 2 * j));
        model.dashpots = Dashpots::new(2 * n, 2 * MODES, &[0, 1, 2, 3].map(dashpot))
            .with_influenced(&influenced);
    }
    let excitation = DiscExcitation {
        sectors: 3,
        engine_order: 1,
    };
    let waves = Waves::new(excitation, BTreeMap::from([(1, model)]));
    problem.reduced_mut().waves = match is_damped {
        true => waves.with_influence(Influence::new(3, &[1, 2], &influence_of_three())),
        false => waves,
    };
    for excitation in &mut problem.excitations[..2] {
        let seed = 230 + 10 * excitation.harmonic;
        (excitation.cosine, excitation.sine) = (load(seed), load(seed + 5));
    }
}

/// Samples, each with a name, a balance and a point U: many and few pairs that do not stick, rigid and
/// with springs, with Rayleigh damping alone and with more, with the mean free and retained. The
/// forces are such that each pair has the intended motion at U.
pub(crate) fn sample_points() -> Vec<(String, Balance, Vec<f64>)> {
    points(false)
}

/// Like [`sample_points`], also for harmonics that are waves round a disc.
pub(crate) fn sample_points_of_waves_too() -> Vec<(String, Balance, Vec<f64>)> {
    [points(false), points(true)]
        .into_iter()
        .flatten()
        .collect()
}

fn points(has_waves: bool) -> Vec<(String, Balance, Vec<f64>)> {
    let mut points = Vec::new();
    let means = [Mean::Free, Mean::Retained];
    let kinds = [
        (MANY, false, false),
        (FEW, false, false),
        (MANY, true, false),
        (FEW, true, false),
        (MANY, false, true),
        (FEW, true, true),
    ];
    for ((motions, has_springs, is_damped), mean) in kinds
        .into_iter()
        .flat_map(|kind| means.map(|mean| (kind, mean)))
    {
        let mut problem = problem(motions.len());
        if has_springs {
            for (pair, law) in problem.laws.iter_mut().enumerate() {
                law.stiffness = Some(PairStiffness::new(
                    4.0 + mixed(pair, 90),
                    3.0 + mixed(pair, 91),
                ));
            }
        }
        if is_damped {
            damp(&mut problem);
        }
        if has_waves {
            make_waves(&mut problem);
        }
        let damping = Rayleigh::new(0.1, 0.15);
        let n = problem.reduced.stiffness.nrows();
        let x_static: Vec<f64> = (0..n).map(|i| 0.02 * mixed(i, 5)).collect();
        let lambda_static: Vec<f64> = (0..n).map(|i| 0.02 * mixed(i, 92)).collect();
        let mut at_rest = vec![PairStatus::Stuck; n / 3];
        at_rest[OPEN_AT_REST] = PairStatus::Open;
        let system = ContactSystem::new(&problem, damping);
        let asked = Eps {
            choice: EpsChoice::Pair,
            scale: 1.3,
        };
        let eps = asked.values(&system, OMEGA_RAD_S, HARMONICS);
        let inexact = InexactModel::new(&problem.reduced);
        let fourier = Fourier::new(HARMONICS, SAMPLES);
        let retention = Arc::new(Retention::new(&problem.reduced.stiffness, &eps));
        assert!(retention.is_needed());
        let width = fourier.width();
        let linear = LinearReference::new(&problem, &[OPEN_AT_REST]);
        let system = Arc::new(system);
        let setting = Setting {
            frozen: FrozenContacts::new(&linear, &system).into(),
            system,
            inexact: inexact.into(),
            fourier: fourier.into(),
            eps: eps.as_slice().into(),
            x_static: x_static.as_slice().into(),
            lambda_static: lambda_static.as_slice().into(),
            at_rest: at_rest.into(),
            static_mean: Mean::Free,
            pressing_n: 1.0,
            periods: Periods::UntilPeriodic,
            slip_threshold_m: 0.0,
            free_slips_m: [].into(),
        };
        let mut balance = Balance::new(&setting, OMEGA_RAD_S);
        if mean == Mean::Retained {
            balance = balance.retained_by(retention);
        }
        let u: Vec<f64> = (0..width * n).map(|i| 0.1 * mixed(i, 6)).collect();
        // F = lambda_u + Lambda U - eps U.
        let mut force = vec![0.0; u.len()];
        balance.apply_stiffness(&u, &mut force);
        for (pair, motion) in motions.into_iter().enumerate() {
            let law =
                problem.laws[pair].predicted([eps[3 * pair], eps[3 * pair + 1]], f64::INFINITY);
            let [x, lambda] =
                [&x_static, &lambda_static].map(|v| [v[3 * pair + 1], v[3 * pair + 2]]);
            let start = law.state_at_rest(x, lambda);
            for (h, block) in lambda_u(motion, pair, law.shift_n, start.slid_n)
                .iter()
                .enumerate()
            {
                for (c, trial) in block.iter().enumerate() {
                    let i = h * n + 3 * pair + c;
                    force[i] += trial / law.shares[c] - eps[3 * pair + c] * u[i];
                }
            }
        }
        balance.force = force;
        for (motion, end) in motions.iter().zip(balance.evaluate(&u).ends) {
            let does = match end.open_samples {
                _ if end.always_stuck => Sticks,
                0 => Slides,
                SAMPLES => StaysOpen,
                _ => LiftsOff,
            };
            assert!(end.periodic && does == *motion, "{motion:?}: {end:?}");
            assert!((end.slid_n > 0.1) == matches!(motion, Slides | LiftsOff));
        }
        let moving = motions.iter().filter(|m| **m != Sticks).count();
        let springs = if has_springs { ", springs" } else { "" };
        let dashpots = if is_damped { ", dashpots" } else { "" };
        let waves = if has_waves { ", waves" } else { "" };
        let what = format!("{moving} pairs move, mean {mean:?}{springs}{dashpots}{waves}");
        points.push((what, balance, u));
    }
    points
}

/// Setting whose problem is changed.
pub(crate) fn changed(setting: &Setting, change: impl FnOnce(&mut Problem)) -> Setting {
    let mut problem = setting.system.problem.clone();
    change(&mut problem);
    Setting {
        system: ContactSystem::new(&problem, setting.system.damping).into(),
        ..setting.clone()
    }
}

/// Computes Lambda U - F.
pub(crate) fn linear_residual(balance: &Balance, u: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; u.len()];
    balance.apply_stiffness(u, &mut out);
    out.iter_mut()
        .zip(&balance.force)
        .for_each(|(o, f)| *o -= f);
    out
}

/// Jacobian d residual / d U by central differences.
pub(crate) fn differences(balance: &Balance, u: &[f64]) -> Mat<f64> {
    central(u, 1e-6, |u| balance.evaluate(u).residual)
}

/// Checks that corrections solve with a Jacobian by differences: those of unit residuals are -J^-1,
/// and are multiplied by it.
pub(crate) fn assert_solves(
    system: &mut impl NonlinearSystem,
    by_differences: Mat<f64>,
    [linear_tolerance, tolerance]: [f64; 2],
    what: &str,
) {
    let size = by_differences.ncols();
    let mut corrections = Mat::zeros(size, size);
    for j in 0..size {
        let mut f = vec![0.0; size];
        f[j] = -1.0;
        let correction = corrections.col_as_slice_mut(j);
        assert!(
            system
                .correction(&f, linear_tolerance, correction)
                .is_some()
        );
    }
    let product = by_differences * corrections;
    assert_close(&Mat::identity(size, size), &product, tolerance, what);
}

/// This tests the matrix-free products, what is known of the pairs that stick, and what they do to
/// the others, to single precision.
#[test]
fn corrections_of_the_newton_krylov_method_solve_with_the_jacobian_by_differences() {
    for (what, balance, u) in &sample_points_of_waves_too() {
        let mut preconditioner = Preconditioner::default();
        let stays = |_: &[f64]| false;
        let mut system = KrylovSystem::new(balance, &mut preconditioner, 1e-6, 1e-9, &stays);
        system.residual(u, &mut vec![0.0; u.len()]);
        system.linearise(u);
        assert_solves(&mut system, differences(balance, u), [1e-6, 1e-4], what);
    }
}

/// A pair that is evaluated without the others does what it does among them.
#[test]
fn a_pair_by_itself_is_as_in_the_evaluation_of_all() {
    for (what, balance, u) in &sample_points_of_waves_too() {
        for (pair, end) in balance.evaluate(u).ends.iter().enumerate() {
            let own = balance.evaluate_pair(u, pair);
            assert_eq!(own.open_samples, end.open_samples, "{what}: {pair}");
            assert_eq!(own.always_stuck, end.always_stuck, "{what}: {pair}");
            let off = (own.slid_n - end.slid_n).abs();
            assert!(off <= 1e-9 * end.slid_n, "{what}: {pair}: {off:e}");
        }
    }
}
