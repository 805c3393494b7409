//! The findings of Charleux, Thouverez and Lombard (2004) on our own mesh: scenes/paper.toml on the
//! ready mesh meshes/dovetail.msh (no gmsh needed), 13 frequencies through the first resonance.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::sync::OnceLock;

use crate::shared_work::paper;
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::damping::{Rayleigh, rayleigh};
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{CycleStatus, Orbit, PairStatus, Response, StaticState};
use dovetail_solver::fem::assemble;
use dovetail_solver::model::Model;
use dovetail_solver::problem::{LinearReference, Problem};
use dovetail_solver::reduction::{Highest, StuckModes, reduce};

const NEWTON: NewtonOptions = NewtonOptions::new(1e-10, 60);

/// Ratios of the frequencies to that of the first stuck mode: two distant ones on either side, and
/// the peaks of the linear and of the nonlinear curve between.
const GRID: [f64; 13] = [
    0.97, 0.98, 0.99, 0.994, 0.997, 0.9985, 0.9993, 1.0, 1.001, 1.003, 1.01, 1.02, 1.03,
];

/// Data that all tests share.
struct Joint {
    scene: Scene,
    model: Model,
    problem: Problem,
    damping: Rayleigh,
    statics: StaticState,
    /// Centrifugal load of the blade, N.
    blade_load_n: [f64; 3],
}

fn joint() -> &'static Joint {
    static JOINT: OnceLock<Joint> = OnceLock::new();
    JOINT.get_or_init(|| {
        let (scene, model) = paper("dovetail.msh", &[]);
        let structure = assemble(&model).unwrap();
        let mut blade_load_n = [0.0; 3];
        for (i, f) in structure.bodies[0].load_n.iter().enumerate() {
            blade_load_n[i % 3] += f;
        }
        let wanted = StuckModes::new(None, Highest::OfFirstStuckMode(1.05));
        let problem =
            dovetail_solver::run::problem(reduce(&structure, wanted).unwrap().model, &model);
        let stuck = LinearReference::stuck(&problem.reduced);
        let linear = stuck.modes_of_first_harmonic(&problem.reduced);
        let damping = rayleigh(&scene.damping, &linear).unwrap();
        let statics = static_state(&problem, scene.static_state.load_steps, NEWTON);
        Joint {
            scene,
            model,
            problem,
            damping,
            statics,
            blade_load_n,
        }
    })
}

/// Number of samples of a period.
const SAMPLES: usize = 128;

/// The reduced model with another force than the scene's (loads are linear in it).
fn problem_with_force(force_n: f64) -> Problem {
    let joint = joint();
    let ratio = force_n / joint.scene.assembly().unwrap().excitations[0].amplitude;
    let mut model = joint.problem.clone();
    for excitation in &mut model.excitations {
        for load in [&mut excitation.cosine, &mut excitation.sine] {
            load.on_x.iter_mut().for_each(|f| *f *= ratio);
            load.on_modes.iter_mut().for_each(|f| *f *= ratio);
        }
    }
    model
}

fn respond(model: &Problem, harmonics: usize, grid: &[f64]) -> Response {
    let first_hz = model.reduced.omega2[0].sqrt() / TAU;
    let frequencies_hz = grid.iter().map(|r| r * first_hz).collect();
    respond_with(model, harmonics, SAMPLES, frequencies_hz)
}

fn respond_with(
    model: &Problem,
    harmonics: usize,
    samples: usize,
    frequencies_hz: Vec<f64>,
) -> Response {
    respond_about(&joint().statics, model, harmonics, samples, frequencies_hz)
}

/// Response of a model about its static state.
fn respond_about(
    statics: &StaticState,
    model: &Problem,
    harmonics: usize,
    samples: usize,
    frequencies_hz: Vec<f64>,
) -> Response {
    let joint = joint();
    let mut settings = SweepSettings::new(frequencies_hz, Resolution::fixed(harmonics, samples));
    settings.eps = Eps {
        choice: joint.scene.response.eps,
        scale: joint.scene.response.eps_scale,
    };
    settings.newton = NEWTON;
    settings.solver = joint.scene.response.solver;
    let response = sweep(model, joint.damping, statics, &settings, &[], &|_| ());
    for orbit in &response.orbits {
        let hz = orbit.frequency_hz;
        assert!(orbit.outcome.is_converged(), "{hz} Hz: {:?}", orbit.outcome);
    }
    response
}

/// Three harmonics under the scene's force.
fn response() -> &'static Response {
    static RESPONSE: OnceLock<Response> = OnceLock::new();
    RESPONSE.get_or_init(|| respond(&joint().problem, 3, &GRID))
}

/// Amplitudes over those of the stuck assembly, frequency by frequency.
fn ratios(response: &Response) -> Vec<f64> {
    let pairs = response.orbits.iter().zip(&response.linear);
    pairs
        .map(|(orbit, stuck)| orbit.observed_amplitude[0] / stuck.observed_amplitude[0])
        .collect()
}

/// Largest amplitude over the largest of the stuck assembly.
fn cut(response: &Response) -> f64 {
    let largest = |amplitudes: &mut dyn Iterator<Item = f64>| amplitudes.fold(0.0, f64::max);
    largest(&mut response.orbits.iter().map(|o| o.observed_amplitude[0]))
        / largest(&mut response.linear.iter().map(|s| s.observed_amplitude[0]))
}

/// For each pair that opens at some frequency: its static normal force over the mean of all pairs.
fn share_of_opening_pairs(response: &Response) -> Vec<f64> {
    let compression: Vec<f64> = joint()
        .statics
        .lambda
        .iter()
        .step_by(3)
        .map(|l| -l)
        .collect();
    let mean = compression.iter().sum::<f64>() / compression.len() as f64;
    let opens = |pair: usize| {
        response
            .orbits
            .iter()
            .any(|o| o.cycles[pair].status == CycleStatus::Opening)
    };
    (0..compression.len())
        .filter(|&pair| opens(pair))
        .map(|pair| compression[pair] / mean)
        .collect()
}

#[test]
fn under_rotation_every_pair_slides_and_none_opens() {
    let joint = joint();
    assert!(joint.statics.outcome.is_converged());
    assert_eq!(joint.model.pairs.len(), 72);
    let count = |s: PairStatus| joint.statics.status.iter().filter(|x| **x == s).count();
    assert_eq!(count(PairStatus::Slipping), 72);
    assert_eq!(count(PairStatus::Open), 0);
}

#[test]
fn the_flanks_carry_the_centrifugal_load_as_equilibrium_says() {
    let joint = joint();
    let load_n = joint.blade_load_n.iter().map(|f| f * f).sum::<f64>().sqrt();
    // Friction coefficient 0.3; flanks at 45 degrees from the radial direction.
    let theory_n = load_n / (2.0 * (FRAC_1_SQRT_2 + 0.3 * FRAC_1_SQRT_2));
    let mut on_blade_n = [0.0; 3];
    let mut normal_n = [0.0; 2];
    for (pair, force) in joint.model.pairs.iter().zip(joint.statics.lambda.chunks(3)) {
        normal_n[pair.contact] -= force[0];
        for (axis, f) in pair.frame.iter().zip(force) {
            for (sum, a) in on_blade_n.iter_mut().zip(axis) {
                *sum += a * f;
            }
        }
    }
    println!("blade {load_n:.1} N, theory {theory_n:.1} N per flank, found {normal_n:.1?} N");
    // CalculiX, penalty contact: benches/calculix/contact_statics.py. Found: 0.07 % below it, 0.85
    // % above the theory.
    for (normal_n, calculix_n) in normal_n.into_iter().zip([4239.6, 4239.0]) {
        assert!((normal_n / theory_n - 1.0).abs() < 0.02, "{normal_n} N");
        assert!((normal_n / calculix_n - 1.0).abs() < 0.002, "{normal_n} N");
    }
    // Nothing else holds the blade; spin softening of its small displacement is the rest.
    for (carried, load) in on_blade_n.iter().zip(joint.blade_load_n) {
        assert!((carried - load).abs() < 1e-3 * load_n, "{on_blade_n:?}");
    }
}

#[test]
fn the_static_slip_is_that_of_an_independent_program() {
    let slips = joint().statics.x.chunks(3).map(|x| x[1].hypot(x[2]));
    let largest_m = slips.fold(0.0, f64::max);
    println!("largest slip {:.3} um", 1e6 * largest_m);
    // CalculiX, penalty contact from surface to surface. Found: 2.7 % below it.
    assert!((largest_m / 13.78e-6 - 1.0).abs() < 0.05, "{largest_m} m");
}

#[test]
fn far_from_resonance_the_response_is_nearly_the_stuck_one() {
    let ratios = ratios(response());
    println!("amplitude over stuck amplitude {ratios:.4?}");
    // Found: 0.01, 0.25 and 2.3 % above below resonance; 2.4, 0.30 and 0.02 % below above it.
    let last = ratios.len() - 1;
    for (i, most) in [0.002, 0.008, 0.05].into_iter().enumerate() {
        let (low, high) = (ratios[i] - 1.0, 1.0 - ratios[last - i]);
        assert!(low > 0.0 && low < most, "{}: {low}", GRID[i]);
        assert!(high > 0.0 && high < most, "{}: {high}", GRID[last - i]);
    }
}

#[test]
fn at_resonance_friction_cuts_the_amplitude_to_less_than_half() {
    let cut = cut(response());
    println!("peak over stuck peak {cut:.4}");
    // Found: 0.3858.
    assert!((0.37..0.40).contains(&cut), "{cut}");
}

#[test]
fn pairs_slide_and_open_near_resonance_only() {
    for (ratio, orbit) in GRID.iter().zip(&response().orbits) {
        let counts = orbit.counts();
        println!("{ratio}: {counts:?}");
        if (ratio - 1.0).abs() < 0.002 {
            assert!(
                counts.stuck < 36 && counts.slipping > 0 && counts.opening > 0,
                "{ratio}: {counts:?}"
            );
        }
        if (ratio - 1.0).abs() > 0.015 {
            assert!(counts.stuck > 36, "{ratio}: {counts:?}");
            assert_eq!(counts.opening, 0, "{ratio}");
        }
    }
}

#[test]
fn the_pairs_that_open_carried_less_than_the_mean() {
    let at_1_n = share_of_opening_pairs(&respond(&problem_with_force(1.0), 3, &GRID));
    println!("1 N: {at_1_n:.3?}");
    assert!(!at_1_n.is_empty() && at_1_n.iter().all(|share| *share < 1.0));
    let at_2_n = share_of_opening_pairs(response());
    println!("2 N: {at_2_n:.3?}");
    assert!(at_2_n.len() > at_1_n.len());
    assert!(at_2_n.iter().all(|share| *share < 1.0));
}

#[test]
fn what_is_put_in_is_spent_in_friction_and_damping() {
    let spent = |o: &Orbit| (o.friction_power_w + o.viscous_power_w) / o.input_power_w - 1.0;
    for orbit in &response().orbits {
        let error = spent(orbit);
        assert!(error.abs() < 1e-6, "{} Hz: {error:e}", orbit.frequency_hz);
    }
    // At the peak neither of the two is a trifle. Found: 0.615.
    let friction = |o: &Orbit| o.friction_power_w / o.input_power_w;
    let most = response().orbits.iter().map(friction).fold(0.0, f64::max);
    println!("friction takes {most:.4} of the input");
    assert!(
        (0.55..0.68).contains(&most),
        "friction takes {most} of the input"
    );
}

#[test]
fn a_hundredth_of_a_newton_leaves_the_flanks_stuck() {
    let response = respond(&problem_with_force(0.01), 1, &GRID);
    for ratio in ratios(&response) {
        assert!((ratio - 1.0).abs() < 1e-10, "{:e}", ratio - 1.0);
    }
    assert!(response.orbits.iter().all(|o| o.counts().slipping == 0));
}

/// mu = 1e6 in the dynamics alone: in the statics as well, shear would carry the blade and pairs
/// open. It is the stuck curve as long as no pair opens: here one does at 0.3 N, at the very top of
/// the peak.
#[test]
fn rough_flanks_after_the_static_state_give_the_linear_curve() {
    let slippery = respond(&problem_with_force(0.1), 1, &GRID);
    assert!(slippery.orbits.iter().any(|o| o.counts().slipping > 0));
    for (force_n, opens_at) in [(0.2, 0), (0.3, 1)] {
        let mut model = problem_with_force(force_n);
        model.laws.iter_mut().for_each(|pair| pair.friction = 1e6);
        let rough = respond(&model, 1, &GRID);
        let mut open_points = 0;
        for (ratio, orbit) in ratios(&rough).iter().zip(&rough.orbits) {
            let opening = orbit.counts().opening;
            open_points += usize::from(opening > 0);
            assert!(opening <= 1);
            let allowed = if opening > 0 { 1e-5 } else { 1e-10 };
            let (hz, off) = (orbit.frequency_hz, ratio - 1.0);
            println!("{force_n} N, {hz:.3} Hz: {opening} open, {off:e} off the stuck curve");
            assert!(off.abs() < allowed, "{force_n} N, {hz} Hz: {off:e}");
        }
        assert_eq!(open_points, opens_at, "{force_n} N");
    }
}

/// Most pairs slip at 5 N and 453.54 Hz, and some stick, which hold the blade. All slip at 450.1 Hz.
/// Both hold in a sweep from either side and for a single frequency.
#[test]
fn friction_holds_the_blade_or_not_whichever_way_the_solution_was_found() {
    let model = problem_with_force(5.0);
    for (hz, is_held) in [(453.54, true), (450.1, false)] {
        let rising: Vec<f64> = (0..6).map(|i| hz - 0.2 * f64::from(5 - i)).collect();
        let falling: Vec<f64> = (0..6).map(|i| hz + 0.2 * f64::from(i)).collect();
        // A sweep goes from both ends to the middle: as many frequencies beyond keep these in
        // order.
        let beyond = [hz + 40.0; 6];
        let before = [hz - 40.0; 5];
        let ways = [
            vec![hz],
            rising.iter().chain(&beyond).copied().collect(),
            before.iter().chain(&falling).copied().collect(),
        ];
        let found: Vec<(f64, f64, usize)> = ways
            .into_iter()
            .map(|frequencies_hz| {
                let response = respond_with(&model, 3, SAMPLES, frequencies_hz);
                let orbit = response.orbits.iter().find(|o| o.frequency_hz == hz);
                let orbit = orbit.unwrap();
                let stuck = orbit.counts().stuck;
                (orbit.observed_amplitude[0], orbit.retention_n, stuck)
            })
            .collect();
        println!("{hz} Hz: amplitude, retention, pairs that stick: {found:?}");
        for way in &found {
            assert!((way.0 / found[0].0 - 1.0).abs() < 1e-3, "{found:?}");
            assert_eq!(way.1 == 0.0, is_held, "{found:?}");
            assert_eq!(way.2 > 0, is_held, "{found:?}");
        }
    }
}

/// 450.0977 Hz, 2 N: 6.27805 mm by integration in time (docs/verification.md), on as many modes as
/// harmonics may ask for. The truncation error at the peak is not monotone in the number of
/// harmonics.
#[test]
#[ignore = "slow: make verify"]
fn truncation_explains_what_is_left_at_the_peak() {
    const INTEGRATED_MM: f64 = 6.27805;
    let structure = assemble(&joint().model).unwrap();
    let wanted = StuckModes::new(
        Some(StuckModes::OF_HARMONICS),
        Highest::OfFirstStuckMode(1.05),
    );
    let reduction = reduce(&structure, wanted).unwrap();
    let model = &dovetail_solver::run::problem(reduction.model, &joint().model);
    let statics = &static_state(model, joint().scene.static_state.load_steps, NEWTON);
    let amplitudes_mm = [3, 7, 15, 21, 31].map(|harmonics| {
        let response = respond_about(statics, model, harmonics, 1024, vec![450.0977]);
        1e3 * response.orbits[0].observed_amplitude[0]
    });
    println!("H = 3, 7, 15, 21, 31: {amplitudes_mm:.5?} mm");
    let off = amplitudes_mm.map(|a| a / INTEGRATED_MM - 1.0);
    assert!((off[0] - 0.035).abs() < 0.002, "{off:?}");
    assert!(off[1] < off[2], "7 harmonics look better than 15: {off:?}");
    assert!(off[2] > off[3] && off[3] > off[4], "{off:?}");
    assert!(off[4].abs() < 1e-4, "{off:?}");
}
