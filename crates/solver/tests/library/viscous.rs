//! Dashpots and damping ratios of modes, compared with closed forms, with the equations solved at
//! once, and with steps in time.

use crate::shared_problems::{diagonal, respond};
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::contact::penalty::PairStiffness;
use dovetail_solver::damping::{DampingError, Rayleigh};
use dovetail_solver::dlft::backbone::{BackboneRange, backbone};
use dovetail_solver::dlft::linear_curve::linear_curve;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::SweepSettings;
use dovetail_solver::integration::compare::{IntegrationStart, compare};
use dovetail_solver::integration::steady::Until;
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::problem::{HarmonicLoad, LinearReference, Problem};
use dovetail_solver::reduced::{
    Dashpots, DiscExcitation, Influence, InfluenceCoefficient, Load, ObservedPoint, ReducedModel,
    Waves,
};
use faer::linalg::solvers::Solve;
use faer::{Mat, c64};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

const SETTLE: NewtonOptions = NewtonOptions::new(1e-10, 60);

fn settings(omegas: &[f64], harmonics: usize) -> SweepSettings {
    let frequencies_hz = omegas.iter().map(|w| w / TAU).collect();
    let mut settings = SweepSettings::new(frequencies_hz, Resolution::fixed(harmonics, 256));
    settings.newton = SETTLE;
    settings
}

fn tangential_vector(value: f64) -> Vec<f64> {
    vec![0.0, value, 0.0]
}

/// Mass of 1 kg on a spring of 1 N/m that slides on the ground, with a dashpot to the ground.
fn sliding_mass(friction: f64, damping_n_s_m: f64) -> Problem {
    let dashpot = (damping_n_s_m, Load::new(tangential_vector(1.0), vec![]));
    Problem {
        reduced: ReducedModel {
            static_load: Load::new(vec![-1.0, 0.0, 0.0], vec![]),
            observations: vec![ObservedPoint::new("mass", tangential_vector(1.0), vec![])],
            dashpots: Dashpots::new(3, 0, &[dashpot]),
            ..ReducedModel::from_pair_matrices(diagonal([1.0; 3]), diagonal([1.0; 3]))
        }
        .into(),
        laws: vec![PairLaw::rigid(friction, 0.0)],
        excitations: vec![HarmonicLoad::cosine(
            1,
            Load::new(tangential_vector(1.0), vec![]),
        )],
        modal_ratios: Vec::new(),
    }
}

/// P / |k - m w^2 + i w c| without friction, and the power c (w A)^2 / 2.
#[test]
fn a_mass_on_a_dashpot_is_the_damped_oscillator() {
    let c = 0.07;
    let omegas = [0.3, 0.9, 1.0, 1.1, 3.0];
    let response = respond(&sliding_mass(0.0, c), Rayleigh::NONE, &settings(&omegas, 3));
    for (orbit, w) in response.orbits.iter().zip(omegas) {
        let exact = 1.0 / (1.0 - w * w).hypot(w * c);
        let off = orbit.observed_amplitude[0] / exact - 1.0;
        assert!(off.abs() < 1e-9, "{w}: {off:e}");
        let power = 0.5 * c * (w * exact).powi(2);
        for found in [orbit.viscous_power_w, orbit.input_power_w] {
            assert!((found / power - 1.0).abs() < 1e-9, "{w}: {found} {power}");
        }
    }
}

/// Two unit masses: one is held by springs of two stuck modes, the other is the pair. A dashpot
/// between them, and a ratio of the first mode.
fn two_masses(friction: f64, modal_ratios: Vec<f64>) -> Problem {
    let dashpot =
        |damping, x, modes: [f64; 2]| (damping, Load::new(tangential_vector(x), modes.to_vec()));
    let load = |force: f64| Load::new(tangential_vector(0.5 * force), vec![force, 0.4 * force]);
    let coupling = [0.5, -0.3];
    Problem {
        reduced: ReducedModel {
            static_load: Load::new(vec![-1.0, 0.0, 0.0], vec![0.0; 2]),
            observations: vec![ObservedPoint::new(
                "u",
                tangential_vector(1.0),
                vec![0.7, 0.2],
            )],
            dashpots: Dashpots::new(
                3,
                2,
                &[
                    dashpot(0.1, 0.8, [-0.3, 0.5]),
                    dashpot(0.05, 0.0, [0.6, 0.4]),
                ],
            ),
            ..ReducedModel::new(
                diagonal([1.0, 0.8, 1.0]),
                diagonal([1.0; 3]),
                Mat::from_fn(3, 2, |i, m| tangential_vector(coupling[m])[i]),
                vec![1.0, 6.0],
            )
        }
        .into(),
        laws: vec![PairLaw::rigid(friction, 0.0)],
        excitations: vec![HarmonicLoad::cosine(1, load(1.0))],
        modal_ratios,
    }
}

const RAYLEIGH: Rayleigh = Rayleigh::new(0.01, 0.02);

/// Amplitude of the observed displacement without friction, by the matrices of all coordinates: the
/// pair along its flank, and both modes.
fn amplitude_by_full_matrices(
    problem: &Problem,
    damping: Rayleigh,
    w: f64,
    with_pair: bool,
) -> f64 {
    let reduced = &problem.reduced;
    let at = |on_x: &[f64], on_modes: &[f64]| [on_x[1], on_modes[0], on_modes[1]];
    let coupled = |m: usize| reduced.coupling[(1, m)];
    let stiffness = [
        reduced.stiffness[(1, 1)],
        reduced.omega2[0],
        reduced.omega2[1],
    ];
    let mut mass = Mat::<f64>::identity(3, 3);
    mass[(0, 0)] = reduced.mass[(1, 1)];
    for m in 0..2 {
        (mass[(0, m + 1)], mass[(m + 1, 0)]) = (coupled(m), coupled(m));
    }
    let (a, b) = (damping.stiffness_s, damping.mass_per_s);
    let mut c = Mat::from_fn(3, 3, |i, j| {
        b * mass[(i, j)] + if i == j { a * stiffness[i] } else { 0.0 }
    });
    for (m, ratio) in problem.modal_ratios.iter().enumerate() {
        let row: Vec<f64> = (0..3).map(|i| mass[(m + 1, i)]).collect();
        let own = 2.0 * ratio * reduced.omega2[m].sqrt();
        c += Mat::from_fn(3, 3, |i, j| (own - b) * row[i] * row[j]);
        c[(m + 1, m + 1)] -= a * reduced.omega2[m];
    }
    for (k, weights) in reduced.dashpots.loads() {
        let v = at(&weights.on_x, &weights.on_modes);
        c += Mat::from_fn(3, 3, |i, j| k * v[i] * v[j]);
    }
    let influenced = reduced.dashpots.influenced();
    let influenced: Vec<_> = influenced
        .iter()
        .map(|weights| at(&weights.on_x, &weights.on_modes))
        .collect();
    let of_air = |i: usize, j: usize| {
        let influence = reduced.harmonic_model(1).influence;
        let entries = influence.into_iter().flat_map(|a| {
            let all = (0..2).flat_map(|m| (0..2).map(move |n| (m, n)));
            all.map(|(m, n)| influenced[m][i] * a[(m, n)] * influenced[n][j])
        });
        entries.sum::<c64>()
    };
    let first = usize::from(!with_pair);
    let size = 3 - first;
    let z = Mat::from_fn(size, size, |i, j| {
        let (i, j) = (i + first, j + first);
        let stiff = if i == j { stiffness[i] } else { 0.0 };
        c64::new(stiff - w * w * mass[(i, j)], w * c[(i, j)]) - of_air(i, j)
    });
    let load = &problem.excitations[0].cosine;
    let load = at(&load.on_x, &load.on_modes);
    let right = Mat::from_fn(size, 1, |i, _| c64::new(load[i + first], 0.0));
    let u = z.partial_piv_lu().solve(right);
    let seen = &reduced.observations[0];
    let seen = at(&seen.on_x, &seen.on_modes);
    let sum: c64 = (0..size).map(|i| u[(i, 0)] * seen[i + first]).sum();
    sum.norm()
}

/// Frequencies that lie between the modes, on them, and next to them.
const OMEGAS: [f64; 7] = [
    0.4,
    1.0 - 1e-9,
    1.0,
    1.0 + 1e-5,
    1.5,
    2.449_489_742_783_178,
    4.0,
];

/// Two masses of a sector of a disc that is excited in phase, with two motions on which the air acts
/// and which it couples by a matrix without symmetry.
fn sector_in_flow(problem: Problem) -> Problem {
    let of_one = |x, modes: [f64; 2]| Load::new(tangential_vector(x), modes.to_vec());
    let influenced = [of_one(0.4, [0.9, 0.1]), of_one(-0.2, [0.3, 0.8])];
    let excitation = DiscExcitation {
        sectors: 6,
        engine_order: 12,
    };
    let coefficient =
        |[mode, by_mode]: [usize; 2], [real, imaginary]: [f64; 2]| InfluenceCoefficient {
            nodal_diameter: 0,
            mode,
            by_mode,
            real_n_m: real,
            imaginary_n_m: imaginary,
        };
    let coefficients = [
        coefficient([1, 1], [0.05, -0.08]),
        coefficient([1, 3], [-0.04, 0.06]),
        coefficient([3, 1], [0.07, 0.02]),
        coefficient([3, 3], [-0.03, -0.05]),
    ];
    let influence = Influence::new(6, &[1, 3], &coefficients);
    let waves = Waves::new(excitation, BTreeMap::new()).with_influence(influence);
    let dashpots = problem.reduced.dashpots.clone();
    Problem {
        reduced: ReducedModel {
            dashpots: dashpots.with_influenced(&influenced),
            waves,
            ..ReducedModel::clone(&problem.reduced)
        }
        .into(),
        ..problem
    }
}

#[test]
fn dashpots_and_ratios_couple_the_modes_as_the_equations_solved_at_once() {
    couple_the_modes(|problem| problem);
}

#[test]
fn aerodynamic_influence_couples_the_modes_as_the_equations_solved_at_once() {
    couple_the_modes(sector_in_flow);
}

fn couple_the_modes(with: fn(Problem) -> Problem) {
    for ratios in [vec![], vec![0.03], vec![0.0, 0.05]] {
        for damping in [Rayleigh::NONE, RAYLEIGH] {
            let free = with(two_masses(0.0, ratios.clone()));
            let response = respond(&free, damping, &settings(&OMEGAS, 1));
            let stuck = LinearReference::stuck(&free.reduced).problem(&free, damping);
            let released = LinearReference::new(&problem_on_springs(&free), &[]);
            let released = released.problem(&problem_on_springs(&free), damping);
            for (orbit, w) in response.orbits.iter().zip(OMEGAS) {
                let near = |what: &str, found: f64, exact: f64| {
                    let off = found / exact - 1.0;
                    assert!(off.abs() < 1e-8, "{what}, {ratios:?}, {w}: {off:e}");
                };
                let exact = amplitude_by_full_matrices(&free, damping, w, true);
                near("free", orbit.observed_amplitude[0], exact);
                let spent = orbit.viscous_power_w;
                near("power", spent, orbit.input_power_w);
                let at = |problem: &Problem| {
                    let system = ContactSystem::new(problem, damping);
                    let hz = [w / TAU];
                    linear_curve(&system, 1, &hz)[0].observed_amplitude[0]
                };
                near(
                    "stuck",
                    at(&stuck),
                    amplitude_by_full_matrices(&free, damping, w, false),
                );
                near("released", at(&released), exact);
            }
        }
    }
}

/// The same with a pair whose springs are too soft to count, so that the linear reference has its
/// motion.
fn problem_on_springs(problem: &Problem) -> Problem {
    let mut problem = problem.clone();
    problem.laws[0].stiffness = Some(PairStiffness::new(1e-12, 1e-12));
    problem
}

/// A mode with a ratio zeta has the static deflection over 2 zeta at its frequency, and its half
/// power at 1 -+ zeta of it; a mode without one keeps the damping of all.
#[test]
fn a_mode_with_a_ratio_has_its_peak_and_its_width() {
    let (ratio, other) = (1e-3, 2e-2);
    let omega2 = [4.0, 900.0];
    let damping = Rayleigh::from_damping_ratio(other, 30.0);
    let none = || Mat::zeros(0, 0);
    let load = |modes: [f64; 2]| Load::new(vec![], modes.to_vec());
    let problem = |excited: [f64; 2]| Problem {
        reduced: ReducedModel {
            observations: vec![ObservedPoint::new("u", vec![], excited.to_vec())],
            ..ReducedModel::new(none(), none(), Mat::zeros(0, 2), omega2.to_vec())
        }
        .into(),
        laws: vec![],
        excitations: vec![HarmonicLoad::cosine(1, load(excited))],
        modal_ratios: vec![ratio],
    };
    for (excited, omega, ratio) in [([1.0, 0.0], 2.0_f64, ratio), ([0.0, 1.0], 30.0, other)] {
        let problem = problem(excited);
        let system = ContactSystem::new(&problem, damping);
        let mode = usize::from(omega > 2.0);
        assert!((system.damping_ratio(1, mode) / ratio - 1.0).abs() < 1e-12);
        let at = |share: f64| {
            let hz = [share * omega / TAU];
            linear_curve(&system, 1, &hz)[0].observed_amplitude[0]
        };
        let resonant = 1.0 / (2.0 * ratio * omega * omega);
        assert!((at(1.0) / resonant - 1.0).abs() < 1e-9, "{omega}");
        for side in [1.0 - ratio, 1.0 + ratio] {
            let half = (at(side) / at(1.0)).powi(2);
            assert!((half - 0.5).abs() < 2.0 * ratio, "{omega}: {half}");
        }
    }
}

#[test]
fn more_ratios_than_stuck_modes_are_refused() {
    let problem = two_masses(0.1, Vec::new());
    assert!(problem.clone().with_modal_ratios(&[0.1, 0.2]).is_ok());
    let refused = problem.with_modal_ratios(&[0.1; 3]).unwrap_err();
    let expected = DampingError::FewerModes {
        given: 3,
        available: 2,
    };
    assert_eq!(refused, expected);
}

/// Where the pair slides for most of a period: steps in time lead to the motion of harmonic balance
/// and to its powers.
#[test]
fn steps_in_time_have_the_dashpots_and_the_ratios() {
    let problem = two_masses(0.25, vec![0.03]);
    // Where a rigid pair slides the error of the balance falls with its harmonics.
    for (omega, harmonics, most) in [
        (0.8, 31, 1.2e-2),
        (0.8, 127, 3e-3),
        (1.2, 31, 1.2e-2),
        (1.2, 127, 3e-3),
    ] {
        let mut settings = settings(&[omega], harmonics);
        settings.resolution = Resolution::fixed(harmonics, 1024);
        let response = respond(&problem, RAYLEIGH, &settings);
        let orbit = &response.orbits[0];
        assert!(orbit.outcome.is_converged() && orbit.cycles[0].slid_m > 0.1);
        let found = compare(
            &problem,
            RAYLEIGH,
            orbit,
            IntegrationStart::Orbit { larger_by: 0.05 },
            4000,
            Until::new(200, 1e-8),
            response.slip_threshold_m,
        )
        .unwrap();
        let differences = found.differences();
        println!("{omega}, {harmonics} harmonics: {differences:?}");
        assert!(found.steady);
        let is_near = |d: &Option<f64>| d.is_some_and(|d| d.abs() < most);
        assert!(differences.iter().all(is_near), "{differences:?}");
        // What the excitation puts in, friction and damping spend.
        let spent = orbit.friction_power_w + orbit.viscous_power_w;
        assert!((spent / orbit.input_power_w - 1.0).abs() < 1e-8);
    }
}

/// At small amplitudes a mode has the damping ratio of its dashpots and of its own.
#[test]
fn a_backbone_begins_with_the_ratio_of_its_mode() {
    let problem = two_masses(0.25, vec![0.004]);
    let state = static_state(&problem, 10, SETTLE);
    let settings = settings(&[1.0], 3);
    let range = BackboneRange {
        mode: 0,
        observation: 0,
        amplitudes_m: vec![1e-3, 2e-3],
    };
    let found = backbone(&problem, RAYLEIGH, &state, &settings, &range, &mut |_| true).unwrap();
    // 0.004 of the mode, and c y^2 / (2 w) of each dashpot.
    let ratio = 0.004 + 0.5 * (0.1 * 0.3_f64.powi(2) + 0.05 * 0.6_f64.powi(2));
    // The dashpots couple the modes, which counts as the square of the damping.
    let linear = found.linear_ratio;
    println!("{linear:e} {ratio:e}");
    assert!((linear / ratio - 1.0).abs() < 2e-2);
    assert!((found.linear_hz * TAU - 1.0).abs() < 1e-3);
    for point in &found.points {
        assert_eq!(point.friction_ratio, 0.0);
        assert!((point.damping_ratio / linear - 1.0).abs() < 1e-9);
        assert!((point.orbit.frequency_hz / found.linear_hz - 1.0).abs() < 1e-9);
    }
}
