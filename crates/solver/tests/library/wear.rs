//! Wear of a rigid flat punch, which rubs on rigid ground through an elastic layer: beside Archard's
//! law for the volume, and a closed form of the pressures that does not come from finite elements.

use std::path::PathBuf;

use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::DampingSpec;
use dovetail_solver::description::{
    FrequencyRange, MissionPart, ReducedModelSpec, ResponseSpec, Scene, StaticSpec,
};
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::static_state::{LoadPath, static_state, static_state_after};
use dovetail_solver::dlft::sweep::SweepSettings;
use dovetail_solver::excitation::NamedExcitation;
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel};
use dovetail_solver::run::{Error, Session, Wear, WearQuestion, wear};
use dovetail_solver::superelement::{NamedContact, Superelement};
use faer::Mat;

use crate::shared_problems::{damping_of, dovetail72, respond};

/// Stiffness of the layer under each pair, N/m: it is stiffer at the edges.
const NORMAL_N_M: [f64; 6] = [3e7, 1.5e7, 1e7, 1e7, 1.5e7, 3e7];
/// Area of each pair, m2.
const AREAS_M2: [f64; 6] = [1e-6, 2e-6, 2e-6, 2e-6, 2e-6, 1e-6];
/// Force that presses the punch, N.
const PRESSES_N: f64 = 100.0;
const FRICTION: f64 = 0.3;
/// Coefficient of wear, m2/N.
const WEAR_M2_N: f64 = 1e-19;
/// Springs of the punch to the ground along the contact, N/m; its mass is 1 kg.
const GROUND_N_M: f64 = 1e6;
/// The punch is hardly held along the normal, so that the pairs carry its load.
const HARDLY_N_M: f64 = 1e-3;
const FREQUENCY_HZ: f64 = 150.0;

/// The punch on its layer, whose springs along the contact are those along the normal times `shear`.
/// Its three displacements are condensed on those of the pairs under the layer, and are modes with
/// the layer held.
fn punch(shear: f64) -> ReducedModel {
    let pairs = NORMAL_N_M.len();
    let n = 3 * pairs;
    let layer = |i: usize| NORMAL_N_M[i / 3] * [1.0, shear, shear][i % 3];
    let ground = |c: usize| if c == 0 { HARDLY_N_M } else { GROUND_N_M };
    let whole = [0, 1, 2].map(|c| {
        let springs = (0..pairs).map(|pair| layer(3 * pair + c));
        springs.sum::<f64>() + ground(c)
    });
    let share = |i: usize| layer(i) / whole[i % 3];
    let alike = |i: usize, j: usize| f64::from(u8::from(i % 3 == j % 3));
    let of = |c: usize| -> Vec<f64> {
        let on = |i: usize| if i % 3 == c { share(i) } else { 0.0 };
        (0..n).map(on).collect()
    };
    // Modes ascend in frequency.
    let mut axes = [0, 1, 2];
    axes.sort_by(|a, b| whole[*a].total_cmp(&whole[*b]));
    let unit = |c: usize| -> Vec<f64> { axes.map(|m| f64::from(u8::from(m == c))).to_vec() };
    ReducedModel {
        static_load: Load::new(
            of(0).iter().map(|v| -PRESSES_N * v).collect(),
            unit(0).iter().map(|v| -PRESSES_N * v).collect(),
        ),
        unit_loads: vec![Load::new(of(1), unit(1))],
        observations: vec![ObservedPoint::new("punch", of(1), unit(1))],
        ..ReducedModel::new(
            Mat::from_fn(n, n, |i, j| {
                let own = if i == j { layer(i) } else { 0.0 };
                own - alike(i, j) * layer(i) * share(j)
            }),
            Mat::from_fn(n, n, |i, j| alike(i, j) * share(i) * share(j)),
            Mat::from_fn(n, 3, |i, m| if i % 3 == axes[m] { share(i) } else { 0.0 }),
            axes.map(|c| whole[c]).to_vec(),
        )
    }
}

fn element(shear: f64, areas_m2: Option<Vec<f64>>) -> Superelement {
    let pairs = NORMAL_N_M.len();
    Superelement {
        model: punch(shear),
        excitations: vec![NamedExcitation::cosine("force")],
        contacts: vec![NamedContact {
            name: "punch".to_owned(),
            pairs,
        }],
        positions_m: (0..pairs).map(|i| [1e-3 * i as f64, 0.0, 0.0]).collect(),
        areas_m2,
    }
}

fn scene(force_n: f64, wear_m2_n: f64) -> Scene {
    let range = FrequencyRange::Hz {
        from_hz: 120.0,
        to_hz: 200.0,
    };
    let mut response = ResponseSpec::new(range, Resolution::fixed(9, 256));
    response.slip_threshold_m = Some(1e-9);
    Scene {
        damping: DampingSpec::Rayleigh {
            stiffness_s: 0.0,
            mass_per_s: 20.0,
        },
        static_state: StaticSpec {
            load_steps: 2,
            ..StaticSpec::default()
        },
        ..Scene::new(
            "punch",
            ReducedModelSpec {
                folder: PathBuf::new(),
                law: PairLaw {
                    wear_m2_n,
                    ..PairLaw::rigid(FRICTION, 0.0)
                },
                force_n,
            },
            response,
        )
    }
}

fn worn(
    element: &Superelement,
    scene: &Scene,
    cycles: &[f64],
    tolerance: f64,
    mission: &[MissionPart],
) -> Result<Wear, Error> {
    let question = WearQuestion {
        cycles,
        tolerance,
        mission,
        observation: None,
    };
    let (mut observer, mut store) = ((), ());
    wear(
        scene,
        element.clone().into(),
        &question,
        &Session::new(&mut observer, &mut store),
    )
}

const AT_FREQUENCY: [MissionPart; 1] = [MissionPart::whole_mission(Some(FREQUENCY_HZ))];

/// All areas: those of [`AREAS_M2`].
fn areas() -> Option<Vec<f64>> {
    Some(AREAS_M2.to_vec())
}

/// Forces of the pairs where each pair slides `slides_m` in a cycle, after so many cycles: with equal
/// depths of the punch, P_i / k_i + h_i is the same for all, and so
/// P_i' = k_i (sum(k r) / sum(k) - r_i) with r_i = k_w P_i s / A_i. By Runge and Kutta's method.
fn forces_n(cycles: f64, slides_m: f64) -> Vec<f64> {
    let slope = |p: &[f64]| -> Vec<f64> {
        let rate = |i: usize| WEAR_M2_N * p[i] * slides_m / AREAS_M2[i];
        let whole: f64 = NORMAL_N_M.iter().sum();
        let mean = (0..p.len()).map(|i| NORMAL_N_M[i] * rate(i)).sum::<f64>() / whole;
        (0..p.len())
            .map(|i| NORMAL_N_M[i] * (mean - rate(i)))
            .collect()
    };
    let whole: f64 = NORMAL_N_M.iter().sum();
    let mut p: Vec<f64> = NORMAL_N_M.iter().map(|k| PRESSES_N * k / whole).collect();
    let steps = 2000;
    let dt = cycles / f64::from(steps);
    let moved = |p: &[f64], by: f64, k: &[f64]| -> Vec<f64> {
        p.iter().zip(k).map(|(p, k)| p + by * k).collect()
    };
    for _ in 0..steps {
        let a = slope(&p);
        let b = slope(&moved(&p, 0.5 * dt, &a));
        let c = slope(&moved(&p, 0.5 * dt, &b));
        let d = slope(&moved(&p, dt, &c));
        for i in 0..p.len() {
            p[i] += dt / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]);
        }
    }
    p
}

/// In gross slip the whole punch slides as far, so that the volume rate is k_w times the work of
/// friction over its coefficient from the first block on, whatever the pressures do. They tend to the
/// uniform one, N / A.
#[test]
fn a_punch_in_gross_slip_wears_at_the_rate_of_its_friction_and_ends_with_uniform_pressure() {
    let element = element(1e3, areas());
    let scene = scene(400.0, WEAR_M2_N);
    let ends = [3e6, 2e7, 1e10];
    let found = worn(&element, &scene, &ends, 0.02, &AT_FREQUENCY).unwrap();
    assert!(found.ended.is_none(), "{:?}", found.ended);
    let course = found.course();
    for block in course.blocks {
        let work_j = block.motions[0].friction_power_w / FREQUENCY_HZ;
        let off = course.volume_rate_m3(block) / (WEAR_M2_N * work_j / FRICTION) - 1.0;
        println!(
            "{:e} cycles: rate {off:e}, error {:e}, {} steps",
            block.cycles, block.error, block.steps
        );
        assert!(off.abs() < 1e-3, "{off:e}");
        let pressed_n: f64 = block.at_rest_n.iter().sum();
        assert!((pressed_n / PRESSES_N - 1.0).abs() < 1e-6, "{pressed_n}");
        assert!((block.seconds - block.cycles / FREQUENCY_HZ).abs() <= 1e-9 * block.seconds);
    }
    let first = &course.blocks[0];
    let slid = first.motions[0].cycles.iter().map(|cycle| cycle.slid_m);
    let slides_m = slid.clone().sum::<f64>() / 6.0;
    assert!(slid.fold(0.0, f64::max) < 1.001 * slides_m);
    for end in ends {
        let block = course.blocks.iter().find(|block| block.cycles == end);
        let block = block.unwrap();
        let expected = forces_n(end.min(1e9), slides_m);
        println!("{end:e} cycles: {:?} of {expected:?}", block.at_rest_n);
        for (force_n, expected) in block.at_rest_n.iter().zip(&expected) {
            assert!((force_n - expected).abs() < 0.02 * PRESSES_N / 6.0);
        }
    }
    let last = &course.blocks[course.blocks.len() - 1];
    let uniform_pa = PRESSES_N / AREAS_M2.iter().sum::<f64>();
    for (force_n, area_m2) in last.at_rest_n.iter().zip(AREAS_M2) {
        assert!((force_n / area_m2 / uniform_pa - 1.0).abs() < 0.01);
    }
    // At equal pressures all pairs wear alike: the largest depth grows as the mean one.
    let volume_m3 = WEAR_M2_N * PRESSES_N * slides_m * 1e10;
    assert!((course.volume_m3(last) / volume_m3 - 1.0).abs() < 2e-3);
}

/// A soft layer shears before the pairs slide, so that those that lose their pressure slide farther:
/// what a block assumes of the sliding then is not so at its end.
#[test]
fn half_the_cycles_of_each_block_change_the_depths_by_less_than_the_tolerance() {
    let element = element(0.2, areas());
    for (mission, force_n) in [
        (&AT_FREQUENCY, 60.0),
        (&[MissionPart::whole_mission(None)], 40.0),
    ] {
        let scene = scene(force_n, WEAR_M2_N);
        let tolerance = 0.01;
        let whole = worn(&element, &scene, &[1e8], tolerance, mission).unwrap();
        assert!(whole.ended.is_none(), "{:?}", whole.ended);
        let ends = whole.blocks.windows(2).flat_map(|two| {
            let [before, after] = [two[0].cycles, two[1].cycles];
            [0.5 * (before + after), after]
        });
        let halved = worn(
            &element,
            &scene,
            &ends.collect::<Vec<f64>>(),
            tolerance,
            mission,
        )
        .unwrap();
        let whole_blocks = whole.blocks.len();
        let [whole, halved] = [&whole, &halved].map(|wear| wear.blocks.last().unwrap());
        let most_m = halved.depth_m.iter().copied().fold(0.0, f64::max);
        let pairs = whole.depth_m.iter().zip(&halved.depth_m);
        let change = pairs
            .map(|(a, b)| (a - b).abs() / most_m)
            .fold(0.0, f64::max);
        println!(
            "{force_n} N: {change:e} of {most_m:e} m, {:?}, {} blocks",
            halved.motions[0].counts(),
            whole_blocks
        );
        assert!(change > 1e-6 && change < tolerance, "{change:e}");
    }
}

#[test]
fn a_mission_wears_by_the_shares_of_its_parts() {
    let element = element(1e3, areas());
    let scene = scene(400.0, WEAR_M2_N);
    let part = |share, hz, force_scale| MissionPart {
        share,
        frequency_hz: Some(hz),
        force_scale,
    };
    let rates = |mission: &[MissionPart]| {
        let found = worn(&element, &scene, &[1.0], 0.1, mission).unwrap();
        let block = &found.blocks[0];
        (
            found.course().volume_rate_m3(block),
            found.blocks[1].seconds,
        )
    };
    let (near, _) = rates(&[part(1.0, 150.0, 0.8)]);
    let (far, _) = rates(&[part(7.0, 140.0, 1.0)]);
    let (both, seconds) = rates(&[part(3.0, 150.0, 0.8), part(1.0, 140.0, 1.0)]);
    assert!(near > 1.1 * far);
    let off = both / (0.75 * near + 0.25 * far) - 1.0;
    assert!(off.abs() < 1e-6, "{off:e}");
    assert!((seconds / (0.75 / 150.0 + 0.25 / 140.0) - 1.0).abs() < 1e-6);
}

/// What a pair rubs is the energy that friction takes over its coefficient, also where its pressure
/// changes and it lifts off: the first is an integral over samples, the other one of harmonics.
#[test]
fn what_pairs_rub_is_the_energy_of_friction_over_its_coefficient() {
    let law = PairLaw::rigid(FRICTION, 0.0);
    for (force_n, samples, tolerance) in [(1.0, 128, 1e-4), (1.0, 512, 1e-5), (3.0, 512, 1e-5)] {
        let problem = dovetail72(law, force_n);
        let first_hz = problem.reduced.omega2[0].sqrt() / std::f64::consts::TAU;
        let frequencies_hz = vec![0.985 * first_hz, 0.99 * first_hz, 0.995 * first_hz];
        let settings = SweepSettings::new(frequencies_hz, Resolution::fixed(5, samples));
        for orbit in respond(&problem, damping_of(&problem), &settings).orbits {
            assert!(orbit.outcome.has_motion());
            let rubbed = orbit.cycles.iter().map(|cycle| cycle.rubbed_nm);
            let power_w = FRICTION * orbit.frequency_hz * rubbed.sum::<f64>();
            let off = power_w / orbit.friction_power_w - 1.0;
            println!(
                "{force_n} N, {samples} samples: {off:e}, {:?}",
                orbit.counts()
            );
            assert!(off.abs() < tolerance, "{off:e}");
        }
    }
}

/// The state that follows one under the same laws is that state.
#[test]
fn a_static_state_goes_on_from_itself_and_keeps_its_friction() {
    let problem = dovetail72(PairLaw::rigid(FRICTION, 0.0), 1.0);
    let newton = SweepSettings::new(vec![1.0], Resolution::fixed(1, 64)).newton;
    let overloaded = LoadPath {
        steps: 10,
        points: vec![vec![1.5]],
    };
    let state = static_state(&problem, overloaded, newton);
    let again = static_state_after(&problem, (&state).into(), newton);
    assert!(again.outcome.is_converged());
    assert!(again.newton_iterations <= 1);
    let largest = state.lambda.iter().map(|v| v.abs()).fold(0.0, f64::max);
    for (a, b) in state.lambda.iter().zip(&again.lambda) {
        assert!((a - b).abs() < 1e-6 * largest);
    }
    // Without the overload friction is another one.
    let plain = static_state(&problem, 10, newton);
    let off = (state.lambda.iter().zip(&plain.lambda)).map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f64::max) > 1e-2 * largest);
}

#[test]
fn what_cannot_wear_says_why() {
    let known = element(1e3, areas());
    let without = element(1e3, None);
    let error = |element: &Superelement, wear_m2_n: f64| {
        let scene = scene(400.0, wear_m2_n);
        worn(element, &scene, &[1.0], 0.1, &AT_FREQUENCY).unwrap_err()
    };
    assert!(matches!(error(&known, 0.0), Error::NoWear));
    assert!(matches!(error(&without, WEAR_M2_N), Error::NoAreas));
}
