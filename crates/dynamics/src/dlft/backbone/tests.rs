use super::*;
use crate::contact::PairLaw;
use crate::contact::penalty::PairStiffness;
use crate::dlft::branch::follow;
use crate::dlft::eps::Eps;
use crate::dlft::settings::{EpsChoice, Resolution};
use crate::dlft::static_state::static_state;
use crate::dlft::sweep::sweep;
use crate::problem::HarmonicLoad;
use crate::problem::dovetail72::{damping, dovetail72};
use crate::reduced::{
    Dashpots, DiscExcitation, Influence, InfluenceCoefficient, Load, ObservedPoint, ReducedModel,
    Waves,
};
use dovetail_numerics::nonlinear::NewtonOptions;
use faer::{Mat, c64};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

const K: f64 = 0.6;
const KT: f64 = 0.4;
const FRICTION: f64 = 0.3;
const PRESSED_N: f64 = 2.0;

/// Mass of 1 kg on a spring `K` and a Jenkins element, a spring `KT` that ends in a slider, which
/// carries `FRICTION` times `PRESSED_N` at most.
fn jenkins() -> Problem {
    let along = |size: f64| vec![0.0, size, 0.0];
    // The mass follows the slider by this share where it has no inertia.
    let follows = KT / (K + KT);
    let own = |normal: f64, along: f64| {
        Mat::from_fn(3, 3, |i, j| match (i == j, i) {
            (true, 0) => normal,
            (true, _) => along,
            (false, _) => 0.0,
        })
    };
    // A mode in each direction along the contact, so that both give about the same eps.
    let coupling = Mat::from_fn(3, 2, |i, j| if i == j + 1 { follows } else { 0.0 });
    let reduced = ReducedModel::new(
        own(1.0, K * follows),
        own(0.0, follows * follows),
        coupling,
        vec![K + KT, 1.01 * (K + KT)],
    );
    let mass = ObservedPoint::new("mass", along(follows), vec![1.0, 0.0]);
    Problem {
        reduced: ReducedModel {
            static_load: Load::new(vec![-PRESSED_N, 0.0, 0.0], vec![0.0; 2]),
            observations: vec![mass],
            ..reduced
        }
        .into(),
        laws: vec![PairLaw::rigid(FRICTION, 0.0)],
        excitations: vec![HarmonicLoad::cosine(
            1,
            Load::new(along(follows), vec![1.0, 0.0]),
        )],
        modal_ratios: Vec::new(),
    }
}

/// Backbone of a model with its first mode, and the settings that it has.
fn first_mode_backbone(
    (problem, damping): (&Problem, Rayleigh),
    amplitudes_m: Vec<f64>,
    settings: &SweepSettings,
) -> Backbone {
    let range = BackboneRange {
        mode: 0,
        observation: 0,
        amplitudes_m,
    };
    let state = static_state(problem, 10, settings.newton);
    backbone(problem, damping, &state, settings, &range, &mut |_| true).unwrap()
}

fn settings(harmonics: usize, samples: usize, tolerance: f64) -> SweepSettings {
    SweepSettings {
        newton: NewtonOptions::new(tolerance, 60),
        estimates: false,
        ..SweepSettings::new(vec![], Resolution::fixed(harmonics, samples))
    }
}

/// Describing function of the Jenkins element at an amplitude of its length: the share of its spring
/// that the motion has, and the work that is lost in a period.
fn described(amplitude_m: f64) -> (f64, f64) {
    let limit_n = FRICTION * PRESSED_N;
    let slips_m = limit_n / KT;
    if amplitude_m <= slips_m {
        return (1.0, 0.0);
    }
    let angle = (1.0 - 2.0 * slips_m / amplitude_m).acos();
    let share = (angle - angle.sin() * angle.cos()) / PI;
    (share, 4.0 * limit_n * (amplitude_m - slips_m))
}

/// The describing function of the Jenkins element: with an eps of its spring one harmonic is it.
#[test]
fn with_one_harmonic_a_jenkins_element_has_its_describing_function() {
    let problem = jenkins();
    let mut settings = settings(1, 4096, 1e-12);
    settings.eps = Eps {
        choice: EpsChoice::Pair,
        scale: (K + KT) / K,
    };
    let slips_m = FRICTION * PRESSED_N / KT;
    let amplitudes_m: Vec<f64> = (0..9).map(|i| slips_m * 0.5 * 1.5_f64.powi(i)).collect();
    let of_mass = Rayleigh::mass_proportional(0.002);
    let found = first_mode_backbone((&problem, of_mass), amplitudes_m.clone(), &settings);
    assert_eq!(found.end, BackboneEnd::Reached);
    for (point, asked) in found.points.iter().zip(amplitudes_m) {
        let x = point.orbit.observed_amplitude[0];
        assert!((x / asked - 1.0).abs() < 1e-4, "{x} {asked}");
        let (share, work) = described(x);
        let stiffness = K + KT * share;
        let omega = TAU * point.orbit.frequency_hz;
        let off = omega.powi(2) / stiffness - 1.0;
        assert!(off.abs() < 1e-6, "{x}: {off:e}");
        let friction = work / (TAU * stiffness * x * x);
        let ratio = friction + 0.002 / (2.0 * stiffness.sqrt());
        assert!((point.damping_ratio - ratio).abs() < 1e-6, "{x}");
        // At resonance the force works as much as friction and damping: pi F x = 2 pi zeta w^2 x^2.
        let force_n = 2.0 * ratio * stiffness * x;
        let scale = point.excitation_scale.unwrap();
        assert!(
            (scale / force_n - 1.0).abs() < 1e-3,
            "{x}: {scale} {force_n}"
        );
    }
}

/// The mass of 1 kg itself on a contact pair whose tangential spring is that of the Jenkins element,
/// with a spring to ground or none: a model without stuck modes.
fn mass_on_a_pair(ground_n_m: f64) -> Problem {
    let along = |size: f64| vec![0.0, size, 0.0];
    let diagonal =
        |values: [f64; 3]| Mat::from_fn(3, 3, |i, j| f64::from(u8::from(i == j)) * values[i]);
    Problem {
        reduced: ReducedModel {
            static_load: Load::new(vec![-PRESSED_N, 0.0, 0.0], vec![]),
            observations: vec![ObservedPoint::new("mass", along(1.0), vec![])],
            ..ReducedModel::from_pair_matrices(
                diagonal([0.0, ground_n_m, ground_n_m]),
                // The motion across has a frequency of its own.
                diagonal([1.0, 1.0, 0.9]),
            )
        }
        .into(),
        laws: vec![PairLaw {
            stiffness: Some(PairStiffness::new(9.0, KT)),
            ..PairLaw::rigid(FRICTION, 0.0)
        }],
        excitations: vec![HarmonicLoad::cosine(1, Load::new(along(1.0), vec![]))],
        modal_ratios: Vec::new(),
    }
}

/// Frequency and damping follow the describing function, up to the harmonics that it leaves out.
#[test]
fn a_mass_on_a_contact_pair_has_a_backbone_without_a_stuck_mode() {
    let of_mass = Rayleigh::mass_proportional(0.002);
    let slips_m = FRICTION * PRESSED_N / KT;
    for ground_n_m in [K, 0.0] {
        let problem = mass_on_a_pair(ground_n_m);
        let amplitudes_m: Vec<f64> = (0..6).map(|i| slips_m * 0.02 * 2.5_f64.powi(i)).collect();
        let settings = settings(15, 1024, 1e-10);
        let found = first_mode_backbone((&problem, of_mass), amplitudes_m.clone(), &settings);
        assert_eq!(found.end, BackboneEnd::Reached, "{ground_n_m}");
        let linear = (ground_n_m + KT).sqrt();
        assert!((TAU * found.linear_hz / linear - 1.0).abs() < 1e-9);
        for (point, asked) in found.points.iter().zip(amplitudes_m) {
            let x = point.orbit.observed_amplitude[0];
            assert!((x / asked - 1.0).abs() < 1e-2, "{x} {asked}");
            let (share, work) = described(x);
            let stiffness = ground_n_m + KT * share;
            let omega = TAU * point.orbit.frequency_hz;
            let ratio = work / (TAU * stiffness * x * x) + 0.002 / (2.0 * stiffness.sqrt());
            let off = [
                omega.powi(2) / stiffness - 1.0,
                point.damping_ratio / ratio - 1.0,
            ];
            println!("{ground_n_m} {x:.4}: {:.1e} {:.1e}", off[0], off[1]);
            let allowed = if x < slips_m { 1e-6 } else { 4e-2 };
            assert!(
                off.iter().all(|off| off.abs() < allowed),
                "{ground_n_m} {x}: {off:?}"
            );
        }
    }
}

/// Half a period of the mass from its largest displacement on, with the damping `-2 c x'`, in closed
/// form from event to event: the element sticks, then slides. Returns where the mass turns round,
/// and when.
fn half_period(amplitude_m: f64, c: f64) -> (f64, f64) {
    let limit_n = FRICTION * PRESSED_N;
    /// Displacement and velocity about `centre` after a time.
    fn free(stiffness: f64, c: f64, [y, v]: [f64; 2], t: f64) -> [f64; 2] {
        let own = (stiffness - c * c).sqrt();
        let (sin, cos) = (own * t).sin_cos();
        let other = (v - c * y) / own;
        let grown = (c * t).exp();
        let moved = grown * (y * cos + other * sin);
        [moved, c * moved + grown * own * (other * cos - y * sin)]
    }
    /// First time at which a function that is positive before falls below 0.
    fn root(f: impl Fn(f64) -> f64) -> f64 {
        let mut to = 1e-3;
        while f(to) > 0.0 {
            to += 1e-3;
        }
        let mut from = to - 1e-3;
        for _ in 0..60 {
            let middle = 0.5 * (from + to);
            if f(middle) > 0.0 {
                from = middle;
            } else {
                to = middle;
            }
        }
        to
    }
    let centre = (KT * amplitude_m - limit_n) / (K + KT);
    let stuck = |t: f64| free(K + KT, c, [amplitude_m - centre, 0.0], t);
    let slides_at = amplitude_m - 2.0 * limit_n / KT;
    let stuck_s = root(|t| centre + stuck(t)[0] - slides_at);
    let centre = limit_n / K;
    let begins = [slides_at - centre, stuck(stuck_s)[1]];
    let slips_s = root(|t| -free(K, c, begins, t)[1]);
    let turns = centre + free(K, c, begins, slips_s)[0];
    (turns, stuck_s + slips_s)
}

#[test]
fn with_many_harmonics_a_jenkins_element_moves_as_from_event_to_event() {
    let problem = jenkins();
    let slips_m = FRICTION * PRESSED_N / KT;
    let amplitudes_m: Vec<f64> = [1.2, 2.0, 5.0, 20.0].map(|by| by * slips_m).to_vec();
    let found = first_mode_backbone(
        (&problem, Rayleigh::NONE),
        amplitudes_m,
        &settings(31, 2048, 1e-10),
    );
    assert_eq!(found.points.len(), 4);
    for point in &found.points {
        let amplitude_m = point.orbit.observed_amplitude[0];
        let [mut low, mut high] = [0.0, 0.3];
        for _ in 0..60 {
            let c = 0.5 * (low + high);
            if half_period(amplitude_m, c).0 > -amplitude_m {
                low = c;
            } else {
                high = c;
            }
        }
        let omega = PI / half_period(amplitude_m, low).1;
        let off = TAU * point.orbit.frequency_hz / omega - 1.0;
        let ratio_off = point.damping_ratio - low / omega;
        assert!(off.abs() < 1e-6, "{amplitude_m}: {off:e}");
        assert!(ratio_off.abs() < 1e-6, "{amplitude_m}: {ratio_off:e}");
    }
}

/// Pairs stick, slip and open.
#[test]
fn friction_and_damping_spend_what_keeps_the_vibration_up() {
    let problem = dovetail72(1.0);
    let amplitudes_m = (0..9).map(|i| 2e-5 * 1.8_f64.powi(i)).collect();
    let model = (&problem, damping(&problem));
    let found = first_mode_backbone(model, amplitudes_m, &settings(3, 128, 1e-9));
    assert_eq!(found.end, BackboneEnd::Reached);
    let mut ratio = 0.0;
    for point in &found.points {
        let defect = point.power_defect();
        assert!(defect.abs() < 1e-8, "{defect:e}");
        assert!(point.damping_ratio > ratio - 1e-9);
        ratio = point.damping_ratio;
    }
    let last = found.points.last().unwrap();
    assert!(last.orbit.counts().opening > 0 && last.orbit.counts().slipping > 0);
    assert!(last.friction_ratio > 1e-4 && last.orbit.friction_power_w > 0.0);
}

#[test]
fn small_amplitudes_have_the_frequency_and_the_damping_of_the_linear_mode() {
    let problem = dovetail72(1.0);
    for mode in [0, 1] {
        let omega = problem.reduced.omega2[mode].sqrt();
        let damping = Rayleigh::new(3e-7, 4.0);
        let state = static_state(&problem, 10, NewtonOptions::new(1e-9, 60));
        let range = BackboneRange {
            mode,
            observation: 0,
            amplitudes_m: vec![1e-9, 1e-8],
        };
        let settings = settings(1, 64, 1e-9);
        let found = backbone(&problem, damping, &state, &settings, &range, &mut |_| true).unwrap();
        let ratio = 0.5 * (3e-7 * omega + 4.0 / omega);
        assert!((found.linear_ratio / ratio - 1.0).abs() < 1e-12);
        assert!((TAU * found.linear_hz / omega - 1.0).abs() < 1e-12);
        for (point, asked) in found.points.iter().zip(&range.amplitudes_m) {
            let off = TAU * point.orbit.frequency_hz / omega - 1.0;
            assert!(off.abs() < 1e-10, "{mode}: {off:e}");
            assert!((point.damping_ratio - ratio).abs() < 1e-9);
            assert!((point.orbit.observed_amplitude[0] / asked - 1.0).abs() < 1e-5);
        }
    }
}

/// A pair on springs that sticks is linear, so that small motions are those of the mode without pairs
/// of the linear reference, which has its displacements among its modes. The air couples two modes
/// without symmetry, and a dashpot couples them to the pair.
#[test]
fn a_pair_on_springs_moves_as_the_linear_mode_with_air_and_a_dashpot_does() {
    let mut problem = jenkins();
    let reduced = problem.reduced_mut();
    reduced.mass = Mat::from_fn(3, 3, |i, j| if i == j { 0.5 } else { 0.0 });
    reduced.stiffness = Mat::from_fn(3, 3, |i, j| if i == j { 1.0 } else { 0.1 });
    reduced.coupling = Mat::from_fn(3, 2, |i, j| [[0.1, 0.0], [0.4, 0.2], [-0.1, 0.3]][i][j]);
    let load = |on_x: [f64; 3], on_modes: [f64; 2]| Load::new(on_x.to_vec(), on_modes.to_vec());
    let dashpot = (0.03, load([0.1, 0.5, 0.2], [0.7, -0.3]));
    let moved = [
        load([0.0, 0.3, 0.1], [1.0, 0.2]),
        load([0.1, -0.2, 0.4], [0.1, 0.9]),
    ];
    reduced.dashpots = Dashpots::new(3, 2, &[dashpot]).with_influenced(&moved);
    let air = [[[0.02, 0.01], [0.2, -0.15]], [[-0.1, 0.12], [0.03, -0.02]]];
    let coefficients = [(1, 1), (1, 2), (2, 1), (2, 2)].map(|(mode, by_mode)| {
        let [real_n_m, imaginary_n_m] = air[mode - 1][by_mode - 1];
        InfluenceCoefficient {
            nodal_diameter: 0,
            mode,
            by_mode,
            real_n_m,
            imaginary_n_m,
        }
    });
    let in_phase = DiscExcitation {
        sectors: 4,
        engine_order: 0,
    };
    let influence = Influence::new(4, &[1, 2], &coefficients);
    reduced.waves = Waves::new(in_phase, BTreeMap::new()).with_influence(influence);
    problem.laws[0].stiffness = Some(PairStiffness {
        normal_n_m: 2.0,
        tangential_n_m: 1.5,
    });
    for mode in 0..2 {
        let state = static_state(&problem, 10, NewtonOptions::new(1e-12, 60));
        let range = BackboneRange {
            mode,
            observation: 0,
            amplitudes_m: vec![1e-6],
        };
        let settings = settings(1, 64, 1e-11);
        let none = Rayleigh::NONE;
        let found = backbone(&problem, none, &state, &settings, &range, &mut |_| true).unwrap();
        let point = &found.points[0];
        let off = TAU * (point.orbit.frequency_hz - found.linear_hz);
        assert!(off.abs() < 1e-8, "{mode}: {off:e}");
        let off = point.damping_ratio - found.linear_ratio;
        assert!(off.abs() < 1e-8, "{mode}: {off:e}");
        assert!(point.power_defect().abs() < 1e-7, "{mode}");
    }
}

/// The element that is open at rest carries nothing, so that the mass is on its spring alone.
#[test]
fn a_mode_with_pairs_open_at_rest_begins_at_the_linear_reference() {
    let mut problem = jenkins();
    problem.reduced_mut().static_load.on_x.fill(0.0);
    problem.laws[0].gap_m = 1.0;
    let model = (&problem, Rayleigh::mass_proportional(0.01));
    let found = first_mode_backbone(model, vec![1e-3, 0.5], &settings(1, 64, 1e-9));
    assert_eq!(found.points.len(), 2);
    for point in &found.points {
        let off = TAU * point.orbit.frequency_hz / K.sqrt() - 1.0;
        assert!(off.abs() < 1e-8, "{off:e}");
        let ratio = 0.01 / (2.0 * K.sqrt());
        assert!((point.damping_ratio / ratio - 1.0).abs() < 1e-8);
        assert_eq!(point.orbit.counts().open, 1);
    }
}

/// The peak under a force, from the backbone and from the whole curve of that force.
#[test]
fn the_peak_of_a_force_is_where_the_backbone_has_it() {
    let settings = settings(1, 64, 1e-8);
    for force_n in [0.3, 1.0, 3.0] {
        let problem = dovetail72(force_n);
        let damping = damping(&problem);
        let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
        let own = SweepSettings {
            frequencies_hz: vec![0.99 * first_hz, 1.005 * first_hz],
            ..settings.clone()
        };
        let state = static_state(&problem, 10, settings.newton);
        let curve = follow(&problem, damping, &state, &own, &[], &|_| ());
        let amplitude_m = |orbit: &Orbit| orbit.observed_amplitude[0];
        let higher = |a: &&Orbit, b: &&Orbit| amplitude_m(a).total_cmp(&amplitude_m(b));
        let top = curve.orbits.iter().max_by(higher).unwrap();
        let asked = [0.3, 0.7, 0.998, 1.002].map(|by| by * amplitude_m(top));
        let found = first_mode_backbone((&problem, damping), asked.to_vec(), &settings);
        let [.., below, above] = &found.points[..] else {
            panic!("{:?}", found.end);
        };
        // Where the backbone has the force of the scene.
        let scales = [below, above].map(|point| point.excitation_scale.unwrap().ln());
        let share = -scales[0] / (scales[1] - scales[0]);
        let between = |a: f64, b: f64| a + share * (b - a);
        let predicted_m = between(amplitude_m(&below.orbit), amplitude_m(&above.orbit));
        let off = predicted_m / amplitude_m(top) - 1.0;
        assert!(off.abs() < 1e-3, "{force_n}: {off:e}");
        let hz = between(below.orbit.frequency_hz, above.orbit.frequency_hz);
        let off = hz / top.frequency_hz - 1.0;
        assert!(off.abs() < 1e-4, "{force_n}: {off:e}");
        // The response on both sides of the peak, and none above it.
        assert_eq!(above.response_frequencies_hz(), [None; 2]);
        for point in &found.points[..2] {
            let [low, high] = point.response_frequencies_hz().map(Option::unwrap);
            assert!(low < top.frequency_hz && top.frequency_hz < high);
            let own = SweepSettings {
                frequencies_hz: vec![low, high],
                ..settings.clone()
            };
            let response = sweep(&problem, damping, &state, &own, &[], &|_| ());
            for orbit in &response.orbits {
                let off = amplitude_m(orbit) / amplitude_m(&point.orbit) - 1.0;
                assert!(
                    off.abs() < 4e-3,
                    "{force_n}, {}: {off:e}",
                    orbit.frequency_hz
                );
            }
        }
    }
}

#[test]
fn a_backbone_ends_where_pairs_stay_open() {
    let problem = dovetail72(1.0);
    let amplitudes_m = vec![1e-3, 2e-3, 2.8e-3, 5e-3, 1e-2];
    let model = (&problem, damping(&problem));
    let found = first_mode_backbone(model, amplitudes_m, &settings(1, 64, 1e-8));
    assert_eq!(found.end, BackboneEnd::Open);
    assert_eq!(found.points.len(), 3);
}

#[test]
fn a_force_of_another_harmonic_has_no_resonance_here() {
    let mut problem = jenkins();
    problem.excitations[0].harmonic = 3;
    let model = (&problem, Rayleigh::NONE);
    let found = first_mode_backbone(model, vec![0.1], &settings(3, 64, 1e-9));
    assert_eq!(found.points[0].excitation_scale, None);
}

#[test]
fn more_harmonics_are_taken_until_the_damping_has_its_accuracy() {
    let problem = jenkins();
    let slips_m = FRICTION * PRESSED_N / KT;
    let of = |resolution: Resolution| {
        let settings = SweepSettings {
            resolution,
            estimates: true,
            ..settings(1, 512, 1e-9)
        };
        let found = first_mode_backbone((&problem, Rayleigh::NONE), vec![3.0 * slips_m], &settings);
        found.points.into_iter().next().unwrap()
    };
    let many = of(Resolution::fixed(31, 1024));
    let adapted = [0.2, 1e-3].map(|accuracy| {
        let point = of(Resolution::Accuracy(accuracy));
        let off = (point.damping_ratio / many.damping_ratio - 1.0).abs();
        assert!(off < accuracy, "{accuracy}: {off}");
        assert!(point.estimated_error.unwrap() <= accuracy);
        point.orbit.harmonics
    });
    assert!(adapted[0] < adapted[1] && adapted[1] <= 31, "{adapted:?}");
}

const SECTORS: usize = 6;
/// Dashpot of each mass of the ring, N s/m.
const DASHPOT: f64 = 0.004;

/// Sector of a ring of masses of 1 kg, each on a spring `K`, with a Jenkins element to the next one, in
/// waves of this angle from sector to sector; `None`: the sector in phase. The slider is the pair.
fn sector_of_ring(angle: Option<f64>, twin: f64) -> ReducedModel {
    // The element is longer by D u - x where a mass moves by u and its slider by x.
    let d = angle.map_or(c64::ZERO, |angle| c64::new(angle.cos() - 1.0, angle.sin()));
    let held = K + KT * d.norm_sqr();
    // The mass follows the slider by this share where it has no inertia.
    let follows = KT * d.conj() / held;
    let along = [0.0, 1.0, 1.0];
    // Both modes are along the contact, and the second one does not move the mass.
    let mode = |i: usize, m: usize| {
        if i == m + 1 {
            follows.conj()
        } else {
            c64::ZERO
        }
    };
    let copies = 1 + usize::from(angle.is_some());
    // A complex number on the real and the imaginary part of a wave whose next sector is ahead.
    let real = |v: c64, row: usize, column: usize| match (row, column) {
        (0, 0) | (1, 1) => v.re,
        (0, _) => -v.im,
        _ => v.im,
    };
    let own = |i: usize, j: usize, of: &dyn Fn(usize) -> f64| {
        if i == j { of(i % 3) } else { 0.0 }
    };
    let stiffness = |i: usize| 1.0 - along[i] + along[i] * K * KT / held;
    let mass = |i: usize| along[i] * follows.norm_sqr();
    // Each mode stands twice, with a shape on both copies.
    let turn = |column: usize| if column == 1 { twin } else { 1.0 };
    let coupling = Mat::from_fn(3 * copies, 2 * copies, |i, j| {
        let (m, column) = (j / copies, j % copies);
        turn(column) * real(mode(i % 3, m), i / 3, column)
    });
    let observed = |copy: usize| {
        let on_x = (0..3 * copies).map(|i| match i % 3 {
            1 => real(follows, copy, i / 3),
            _ => 0.0,
        });
        let on_modes = (0..2 * copies).map(|j| match j / copies {
            0 => turn(j % copies) * real(c64::new(1.0, 0.0), copy, j % copies),
            _ => 0.0,
        });
        Load::new(on_x.collect(), on_modes.collect())
    };
    let masses: Vec<Load> = (0..copies).map(observed).collect();
    let omega2 = [held, 1.01 * held].map(|w2| vec![w2; copies]).concat();
    let points = masses
        .iter()
        .map(|load| ObservedPoint::new("mass", load.on_x.clone(), load.on_modes.clone()));
    let dashpots: Vec<(f64, Load)> = masses.iter().map(|load| (DASHPOT, load.clone())).collect();
    let pressed = (0..3 * copies).map(|i| if i == 0 { -PRESSED_N } else { 0.0 });
    ReducedModel {
        static_load: Load::new(pressed.collect(), vec![0.0; 2 * copies]),
        observations: points.collect(),
        unit_loads: masses.clone(),
        dashpots: Dashpots::new(3 * copies, 2 * copies, &dashpots).with_influenced(&masses),
        ..ReducedModel::new(
            Mat::from_fn(3 * copies, 3 * copies, |i, j| own(i, j, &stiffness)),
            Mat::from_fn(3 * copies, 3 * copies, |i, j| own(i, j, &mass)),
            coupling,
            omega2,
        )
    }
}

/// Ring in the waves of an engine order, with air that acts on its masses, and its backbone by one
/// harmonic.
fn ring_backbone(engine_order: usize, air: c64, twin: f64, amplitudes_m: Vec<f64>) -> Backbone {
    let excitation = DiscExcitation {
        sectors: SECTORS,
        engine_order,
    };
    let coefficient = InfluenceCoefficient {
        nodal_diameter: excitation.signed_nodal_diameter(1),
        mode: 1,
        by_mode: 1,
        real_n_m: air.re,
        imaginary_n_m: air.im,
    };
    let diameters = excitation.nodal_diameters(1).into_iter();
    let copies = diameters.map(|d| (d, sector_of_ring(Some(angle(d)), twin)));
    let waves = Waves::new(excitation, copies.collect::<BTreeMap<_, _>>());
    let influence = Influence::new(SECTORS, &[1], &[coefficient]);
    let reduced = ReducedModel {
        waves: waves.with_influence(influence),
        ..sector_of_ring(None, 1.0)
    };
    let problem = Problem::uniform(reduced, PairLaw::rigid(FRICTION, 0.0), 1.0);
    // In phase the slider has the stiffness of its spring alone.
    let settings = SweepSettings {
        eps: Eps::new(EpsChoice::Pair),
        ..settings(1, 4096, 1e-12)
    };
    first_mode_backbone((&problem, Rayleigh::NONE), amplitudes_m, &settings)
}

/// Phase from sector to sector.
fn angle(engine_order: usize) -> f64 {
    TAU * engine_order as f64 / SECTORS as f64
}

/// Amplitude of the element between two masses over that of the masses.
fn stretched(engine_order: usize) -> f64 {
    2.0 * (0.5 * angle(engine_order)).sin().abs()
}

/// Angular frequency of the ring at an amplitude of its masses, and the damping ratios of friction, and
/// of the dashpots and the air.
fn described_ring(engine_order: usize, air: c64, amplitude_m: f64) -> (f64, f64, f64) {
    let stretched = stretched(engine_order);
    let (share, work) = described(stretched * amplitude_m);
    let omega2 = K + stretched * stretched * KT * share - air.re;
    let friction = work / (TAU * omega2 * amplitude_m * amplitude_m);
    let omega = omega2.sqrt();
    (omega, friction, 0.5 * (DASHPOT * omega - air.im) / omega2)
}

/// The wave of engine order 4 runs against that of engine order 2, and 3 moves neighbours against each
/// other.
#[test]
fn a_wave_of_a_ring_has_the_describing_function_of_its_elements_and_the_air() {
    let slips_m = FRICTION * PRESSED_N / KT;
    for (engine_order, wave) in [(1, -1.0), (2, -2.0), (3, 3.0), (4, 2.0), (5, 1.0)] {
        let air = c64::new(0.02 * wave, 0.01 * wave);
        for twin in [1.0, -1.0] {
            let of_slip = [0.5, 1.1, 1.7, 4.0].map(|by| by * slips_m / stretched(engine_order));
            let found = ring_backbone(engine_order, air, twin, of_slip.to_vec());
            assert_eq!(found.end, BackboneEnd::Reached, "{engine_order}");
            let (omega, _, rest) = described_ring(engine_order, air, 1e-9);
            assert!((TAU * found.linear_hz / omega - 1.0).abs() < 1e-9);
            assert!((found.linear_ratio - rest).abs() < 1e-9);
            for (point, asked) in found.points.iter().zip(of_slip) {
                let x = point.orbit.observed_amplitude[0];
                assert!(
                    (x / asked - 1.0).abs() < 1e-4,
                    "{engine_order}: {x} {asked}"
                );
                let (omega, friction, rest) = described_ring(engine_order, air, x);
                let hz = point.orbit.frequency_hz;
                let spent_w = 2.0 * TAU * hz * rest * (omega * x).powi(2) / 2.0;
                for (what, found, exact) in [
                    ("frequency", TAU * hz, omega),
                    ("ratio", point.damping_ratio, friction + rest),
                    ("friction", point.friction_ratio, friction),
                    ("mass", point.modal_amplitude, x),
                    ("power", point.orbit.viscous_power_w, spent_w),
                ] {
                    let off = (found - exact).abs();
                    assert!(
                        off < 1e-6 * exact.abs().max(0.1),
                        "{engine_order}, {what}: {found} {exact}"
                    );
                }
                // At resonance the force works as much as all that damps, if anything does.
                let ratio = friction + rest;
                let force_n = 2.0 * ratio * omega * omega * x;
                match point.excitation_scale {
                    None => assert!(ratio < 0.0, "{engine_order}: {ratio}"),
                    Some(scale) => assert!((scale / force_n - 1.0).abs() < 1e-6, "{scale}"),
                }
            }
        }
    }
}

/// The air drives small motions. Friction holds them at the first limit cycle, beyond the second one it
/// no longer does.
#[test]
fn friction_holds_what_the_air_drives_at_a_limit_cycle() {
    let (engine_order, air) = (4, c64::new(0.0, 0.05));
    let ratio = |x: f64| {
        let (_, friction, rest) = described_ring(engine_order, air, x);
        friction + rest
    };
    let slips_m = FRICTION * PRESSED_N / KT / stretched(engine_order);
    let exact = [[1.0, 2.0], [2.0, 200.0]].map(|between| {
        let [mut below, mut above] = between.map(|by| by * slips_m);
        let rises = ratio(above) > ratio(below);
        for _ in 0..60 {
            let middle = 0.5 * (below + above);
            if (ratio(middle) < 0.0) == rises {
                below = middle;
            } else {
                above = middle;
            }
        }
        below
    });
    let beside = exact.map(|x| [0.999 * x, 1.001 * x]).concat();
    let found = ring_backbone(engine_order, air, 1.0, beside);
    assert!(found.linear_ratio < -0.01, "{}", found.linear_ratio);
    let cycles = found.limit_cycles(0);
    assert_eq!(cycles.len(), 2, "{cycles:?}");
    for ((cycle, exact), is_stable) in cycles.iter().zip(exact).zip([true, false]) {
        assert_eq!(cycle.is_stable, is_stable);
        assert!(
            (cycle.amplitude_m / exact - 1.0).abs() < 1e-5,
            "{cycle:?} {exact}"
        );
        let (omega, ..) = described_ring(engine_order, air, exact);
        assert!((TAU * cycle.frequency_hz / omega - 1.0).abs() < 1e-5);
    }
}
