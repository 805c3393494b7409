//! Pairs with a clearance or an interference: closing a clearance takes from the pressing force, an
//! interference adds to it, and moving the bodies apart changes no motion.

use dovetail_mesh::{ElementType, Mesh};
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::settings::{EpsChoice, Resolution};
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{CycleStatus, Outcome, PairCycle, PairStatus, Response, StaticState};
use dovetail_solver::integration::compare::orbit_state;
use dovetail_solver::integration::steady::{Until, integrate};
use dovetail_solver::integration::step::{MotionState, Stepper};

use dovetail_solver::damping::Rayleigh;
use dovetail_solver::model::{Assembly, Material, Model, Prestress, RotationSpec, SpringSpec};
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{Load, ReducedModel};
use dovetail_testkit::block::{VOLUME, block, map_nodes};
use faer::Mat;
use std::f64::consts::TAU;

use crate::shared_problems::{damping_of, diagonal, dovetail72};
use crate::shared_scenes::{
    FEW_MODES, assert_pressure, blocks_assembly, distance, reduced, two_blocks,
};

const NEWTON: NewtonOptions = NewtonOptions::new(1e-10, 60);

fn respond(
    model: &Problem,
    damping: Rayleigh,
    statics: &StaticState,
    harmonics: usize,
    frequencies_hz: Vec<f64>,
) -> Response {
    let mut settings = SweepSettings::new(frequencies_hz, Resolution::fixed(harmonics, 128));
    settings.eps = Eps::new(EpsChoice::Pair);
    settings.newton = NEWTON;
    let response = sweep(model, damping, statics, &settings, &[], &|_| ());
    assert!(response.orbits.iter().all(|o| o.outcome.is_converged()));
    response
}

fn statics(model: &Problem) -> StaticState {
    let state = static_state(model, 10, NEWTON);
    assert!(state.outcome.is_converged());
    state
}

// ------------------------------------------------------------------------ one pair, closed form

/// A clearance and an interference.
const GAPS_M: [f64; 2] = [0.25, -0.25];
const NORMAL_STIFFNESS_N_M: f64 = 2.0;
const PRESS_N: f64 = 3.0;
const SHAKE_N: f64 = 1.0;

/// Compression of the pair: closing a clearance costs the spring's force, an interference adds it.
fn compression_n(gap_m: f64) -> f64 {
    PRESS_N - NORMAL_STIFFNESS_N_M * gap_m
}

const DAMPING: Rayleigh = Rayleigh::stiffness_proportional(0.1);

/// A mass on a spring, pressed over a clearance against a floor and excited across it, too weakly
/// to leave it.
fn one_pair(gap_m: f64) -> Problem {
    let load = |normal: f64| Load::new(vec![normal, 0.0, 0.0], vec![]);
    Problem {
        reduced: ReducedModel {
            static_load: load(-PRESS_N),
            ..ReducedModel::from_pair_matrices(
                diagonal([NORMAL_STIFFNESS_N_M, 1.0, 1.0]),
                Mat::identity(3, 3),
            )
        }
        .into(),
        laws: vec![PairLaw::rigid(0.5, gap_m)],
        excitations: vec![HarmonicLoad::cosine(1, load(SHAKE_N))],
        modal_ratios: Vec::new(),
    }
}

#[track_caller]
fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-8, "{found}, not {expected}");
}

#[test]
fn a_closed_clearance_costs_its_share_of_the_load_and_an_interference_adds_to_it() {
    for gap_m in GAPS_M {
        let (model, compression_n) = (one_pair(gap_m), compression_n(gap_m));
        let state = statics(&model);
        assert_eq!(state.status, [PairStatus::Stuck]);
        assert_near(state.x[0], -gap_m);
        assert_near(state.lambda[0], -compression_n);

        let orbit = &respond(&model, DAMPING, &state, 1, vec![0.1]).orbits[0];
        let [mean, cosine, sine] = [0, 3, 6].map(|i| orbit.x[i]);
        assert_near(mean, -gap_m);
        assert_near(cosine.hypot(sine), 0.0);
        let cycle = &orbit.cycles[0];
        assert_eq!(cycle.status, CycleStatus::Stuck);
        assert_near(cycle.compression_mean_n, compression_n);
        assert_near(cycle.compression_min_n, compression_n - SHAKE_N);
        assert_near(cycle.compression_max_n, compression_n + SHAKE_N);
    }
}

/// From a position with the clearance open, or with the interference not yet taken up, the pair
/// closes and stays closed.
#[test]
fn integrated_in_time_a_pair_closes_and_stays_closed() {
    for gap_m in GAPS_M {
        let model = one_pair(gap_m);
        let mut stepper = Stepper::new(&model, DAMPING, 0.1, 200).unwrap();
        let mut state = MotionState::resting(&model, &[0.0; 3], &[0.0; 3]);
        let until = Until::new(4, 0.0);
        let settled = integrate(&mut stepper, &mut state, until).unwrap();
        assert_near(state.x[0], -gap_m);
        assert_eq!(settled.cycle.open_fraction, [0.0]);
        // The mean load of the last step, half a step before the period ends.
        let shake = SHAKE_N * 0.5 * (1.0 + (TAU / 200.0).cos());
        assert_near(state.lambda[0], -compression_n(gap_m) + shake);
    }
}

/// A mass on springs in front of a stop that it does not touch at rest, with no load or one that
/// leaves it apart: the springs determine its position, and its linear modes are its own. Under a
/// small excitation it moves as without the stop.
#[test]
fn a_stop_that_is_open_at_rest_leaves_a_mass_on_its_springs() {
    for press_n in [0.0, 0.1] {
        let mut model = one_pair(0.25);
        model.reduced_mut().static_load.on_x[0] = -press_n;
        let (mass_kg, shake_n) = (0.5, 0.01);
        model.reduced_mut().mass = diagonal([mass_kg; 3]);
        model.excitations[0].cosine.on_x[0] = shake_n;
        let state = statics(&model);
        assert_eq!(state.status, [PairStatus::Open]);
        assert_near(state.x[0], -press_n / NORMAL_STIFFNESS_N_M);
        let expected = [1.0, 1.0, NORMAL_STIFFNESS_N_M].map(|k| k / mass_kg);
        assert_eq!(state.linear.with_mass, 3);
        for (found, expected) in state.linear.omega2.iter().zip(expected) {
            assert_near(*found, expected);
        }
        let orbit = &respond(&model, DAMPING, &state, 1, vec![0.2]).orbits[0];
        let omega = TAU * 0.2;
        let stiffness = NORMAL_STIFFNESS_N_M - omega * omega * mass_kg;
        let damping = omega * DAMPING.stiffness_s * NORMAL_STIFFNESS_N_M;
        let amplitude = orbit.x[3].hypot(orbit.x[6]);
        assert_near(amplitude, shake_n / stiffness.hypot(damping));
        assert_near(orbit.x[0], -press_n / NORMAL_STIFFNESS_N_M);
        assert_eq!(orbit.cycles[0].status, CycleStatus::Open);
    }
}

/// A stop without mass across it: the springs alone decide there, and the modes are those of the
/// other directions.
#[test]
fn a_stop_that_is_open_at_rest_may_have_no_mass_of_its_own() {
    let mut model = one_pair(0.25);
    model.reduced_mut().static_load.on_x[0] = 0.0;
    model.reduced_mut().mass[(0, 0)] = 0.0;
    let state = statics(&model);
    assert_eq!(state.status, [PairStatus::Open]);
    assert_eq!(state.linear.with_mass, 2);
    assert!(state.linear.not_released.is_none());
    assert_near(state.linear.omega2[1], 1.0);
}

/// Without the spring nothing holds the mass where the stop is open.
#[test]
fn a_free_mass_before_a_stop_is_held_by_nothing() {
    let mut model = one_pair(0.25);
    model.reduced_mut().stiffness[(0, 0)] = 0.0;
    model.reduced_mut().static_load.on_x[0] = 0.0;
    let state = static_state(&model, 10, NEWTON);
    assert_eq!(state.outcome, Outcome::NothingHolds);
}

/// With K_NT = 0.8 N/m an interference of 1 m drags the pair along by 0.8 N, which a load of 0.6 N
/// opposes. Friction can carry 0.5 N. Growing together both leave 0.2 N at most, and the pair never
/// slips. The interference alone would drag it along.
#[test]
fn an_interference_grows_with_the_load_that_opposes_it() {
    let mut model = one_pair(-1.0);
    for (i, j, k) in [(0, 0, 1.0), (0, 1, 0.8), (1, 0, 0.8)] {
        model.reduced_mut().stiffness[(i, j)] = k;
    }
    model.reduced_mut().static_load.on_x = vec![0.0, 0.6, 0.0];
    for load_steps in [1, 4, 10] {
        let state = static_state(&model, load_steps, NEWTON);
        assert_eq!(state.outcome, Outcome::Converged);
        assert_eq!(state.status, [PairStatus::Stuck]);
        for (found, expected) in state.x.iter().zip([1.0, 0.0, 0.0]) {
            assert_near(*found, expected);
        }
        for (found, expected) in state.lambda.iter().zip([-1.0, -0.2, 0.0]) {
            assert_near(*found, expected);
        }
    }
}

// ----------------------------------------------------------------------- 72 pairs, moved apart

fn dovetail(force_n: f64) -> Problem {
    dovetail72(PairLaw::rigid(0.3, 0.0), force_n)
}

/// Joint with its flanks apart by clearances that differ from pair to pair, with the load that
/// closes them added. Its motion X is that of `model` minus the clearances, in the
/// component N.
fn moved_apart(model: &Problem) -> (Problem, Vec<f64>) {
    let mut moved = model.clone();
    let n = model.reduced.stiffness.nrows();
    let mut shift_m = vec![0.0; n];
    for (p, pair) in moved.laws.iter_mut().enumerate() {
        pair.gap_m = 1e-6 * (1 + p % 5) as f64;
        shift_m[3 * p] = pair.gap_m;
    }
    for (i, load) in moved.reduced_mut().static_load.on_x.iter_mut().enumerate() {
        *load -= (0..n)
            .map(|j| model.reduced.stiffness[(i, j)] * shift_m[j])
            .sum::<f64>();
    }
    (moved, shift_m)
}

/// Largest difference of `a` and `b` minus `shift`, over the largest of `a`.
fn apart(a: &[f64], b: &[f64], shift: &[f64]) -> f64 {
    let shift = shift.iter().chain(std::iter::repeat(&0.0));
    let differences = a.iter().zip(b).zip(shift);
    let worst = differences.fold(0.0_f64, |m, ((a, b), s)| m.max((a - s - b).abs()));
    worst / a.iter().fold(0.0_f64, |m, a| m.max(a.abs()))
}

#[test]
fn flanks_apart_and_pressed_together_move_as_flanks_that_touch() {
    let touching = dovetail(1.5);
    let state = statics(&touching);
    let (apart_model, shift_m) = moved_apart(&touching);
    let mut moved_state = state.clone();
    let places = moved_state.x.iter_mut().zip(&shift_m);
    places.for_each(|(x, shift)| *x -= shift);

    let first_hz = touching.reduced.omega2[0].sqrt() / TAU;
    let damping = damping_of(&touching);
    let frequencies_hz = [0.99, 0.9995, 1.002].map(|r| r * first_hz).to_vec();
    let a = respond(&touching, damping, &state, 3, frequencies_hz.clone());
    let b = respond(&apart_model, damping, &moved_state, 3, frequencies_hz);
    let opens = |cycle: &PairCycle| cycle.status == CycleStatus::Opening;
    assert!(a.orbits.iter().any(|o| o.cycles.iter().any(opens)));
    for (a, b) in a.orbits.iter().zip(&b.orbits) {
        let off = [
            apart(&a.x, &b.x, &shift_m),
            apart(&a.lambda, &b.lambda, &[]),
            apart(&a.observed_amplitude, &b.observed_amplitude, &[]),
        ];
        println!("{} Hz: {off:?}", a.frequency_hz);
        assert!(off.iter().all(|o| *o < 1e-6), "{off:?}");
        for (a, b) in a.cycles.iter().zip(&b.cycles) {
            assert_eq!(a.status, b.status);
        }
    }

    let orbit = &a.orbits[1];
    let states = [&touching, &apart_model].map(|model| {
        let mut stepper = Stepper::new(model, damping, orbit.frequency_hz, 64).unwrap();
        let mut state = orbit_state(model, orbit);
        if model.laws[0].gap_m > 0.0 {
            let places = state.x.iter_mut().zip(&shift_m);
            places.for_each(|(x, shift)| *x -= shift);
        }
        let until = Until::new(2, 0.0);
        let settled = integrate(&mut stepper, &mut state, until).unwrap();
        let open = settled.cycle.open_fraction;
        assert!(open.iter().any(|o| *o > 0.0) && open.iter().any(|o| *o < 1.0));
        state
    });
    let off = [
        apart(&states[0].x, &states[1].x, &shift_m),
        apart(&states[0].v, &states[1].v, &[]),
        apart(&states[0].lambda, &states[1].lambda, &[]),
    ];
    println!("in time: {off:?}");
    assert!(off.iter().all(|o| *o < 1e-6), "{off:?}");
}

/// Statics has no length and no force of its own: displacements and pressures scale with loads and
/// clearances, down to a billionth.
#[test]
fn the_static_state_goes_with_its_loads_and_clearances() {
    const FACTOR: f64 = 1e-9;
    let (whole, _) = moved_apart(&dovetail(1.5));
    let mut small = whole.clone();
    small
        .reduced_mut()
        .static_load
        .on_x
        .iter_mut()
        .for_each(|f| *f *= FACTOR);
    small.laws.iter_mut().for_each(|p| p.gap_m *= FACTOR);
    let [whole, small] = [&whole, &small].map(statics);
    assert!(whole.status.contains(&PairStatus::Slipping));
    assert_eq!(whole.status, small.status);
    for (whole, small) in [(&whole.x, &small.x), (&whole.lambda, &small.lambda)] {
        let small: Vec<f64> = small.iter().map(|v| v / FACTOR).collect();
        let off = apart(whole, &small, &[]);
        assert!(off < 1e-6, "{off:e}");
    }
}

// --------------------------------------------------------------------- a press fit, cut by symmetry

/// Inner radius, that of the fit, outer radius; axial length.
const RADII_M: [f64; 3] = [20e-3, 30e-3, 50e-3];
const LENGTH_M: f64 = 4e-3;

/// A quarter of a ring: x goes around, z along the radius.
fn quarter(element: ElementType, cells: [usize; 3], [inner, outer]: [f64; 2]) -> Mesh {
    let mut mesh = block(element, cells, [1.0, LENGTH_M, outer - inner]);
    map_nodes(&mut mesh, |[x, y, z]| {
        let (sine, cosine) = (0.25 * TAU * x).sin_cos();
        [(inner + z) * sine, y, (inner + z) * cosine]
    });
    mesh
}

/// A whole ring: the quarter drawn out, and its end joined to its beginning.
fn whole(element: ElementType, cells: [usize; 3], radii_m: [f64; 2]) -> Mesh {
    let mut mesh = quarter(element, cells, radii_m);
    map_nodes(&mut mesh, |[x, y, z]| {
        let (radius_m, angle) = (x.hypot(z), 4.0 * x.atan2(z));
        [radius_m * angle.sin(), y, radius_m * angle.cos()]
    });
    let nodes_m = mesh.nodes_m.clone();
    let first: Vec<u32> = mesh.groups["x_min"].nodes.clone();
    let end: Vec<u32> = mesh.groups["x_max"].nodes.clone();
    let joined = |n: u32| {
        let here = |m: &&u32| distance(nodes_m[**m as usize], nodes_m[n as usize]) < 1e-9;
        let beginning = || {
            *first
                .iter()
                .find(here)
                .expect("the end meets the beginning")
        };
        if end.contains(&n) { beginning() } else { n }
    };
    let lists = [mesh.elements.nodes_mut(), mesh.facets.nodes_mut()];
    lists.into_iter().flatten().for_each(|n| *n = joined(*n));
    for group in mesh.groups.values_mut() {
        group.nodes.iter_mut().for_each(|n| *n = joined(*n));
        group.nodes.sort_unstable();
        group.nodes.dedup();
    }
    mesh.groups
        .retain(|name, _| !["x_min", "x_max"].contains(&name.as_str()));
    mesh.part(VOLUME).unwrap()
}

/// Young's modulus and Poisson's ratio that replace those of plane stress in plane strain.
fn plane_strain_constants(material: Material) -> (f64, f64) {
    let Material {
        young_pa, poisson, ..
    } = material;
    (
        young_pa / (1.0 - poisson.powi(2)),
        poisson / (1.0 - poisson),
    )
}

const HUB: Material = Material {
    young_pa: 1e11,
    poisson: 0.3,
    density_kg_m3: 7800.0,
};
const SHAFT: Material = Material {
    young_pa: 2.1e11,
    poisson: 0.25,
    ..HUB
};

/// Static state of quarters of a hub and of the shaft in it, apart by `gap_m`, rotating about their
/// axis.
fn quarters_state(
    [upper, lower]: [ElementType; 2],
    around: [usize; 2],
    materials: [Material; 2],
    gap_m: f64,
    speed_rad_s: f64,
) -> (Model, StaticState) {
    let [inner, fit, outer] = RADII_M;
    let mesh = two_blocks(
        &quarter(upper, [around[0], 2, 5], [fit, outer]),
        &quarter(lower, [around[1], 2, 4], [inner, fit]),
    );
    let assembly = rotating(materials, gap_m, speed_rad_s);
    let (model, problem) = reduced(&assembly, &mesh, FEW_MODES);
    let state = statics(&problem);
    (model, state)
}

/// Hub and shaft between planes of symmetry, apart by `gap_m`, rotating about their axis.
fn rotating(materials: [Material; 2], gap_m: f64, speed_rad_s: f64) -> Assembly {
    let mut assembly = blocks_assembly();
    assembly.rotation = (speed_rad_s > 0.0).then(|| RotationSpec {
        point_m: [0.0; 3],
        axis: [0.0, 1.0, 0.0],
        speed_rad_s,
        bodies: assembly.bodies.iter().map(|b| b.name.clone()).collect(),
        prestress: Prestress::None,
    });
    assembly.excitations.clear();
    assembly.observations.clear();
    assembly.contacts[0].pair_law.gap_m = gap_m;
    for (body, material) in assembly.bodies.iter_mut().zip(materials) {
        let name = body.name.clone();
        body.matrices = material.into();
        body.fixed.clear();
        body.fixed_along = [
            vec![format!("{name}_x_min")],
            vec![format!("{name}_y_min"), format!("{name}_y_max")],
            vec![format!("{name}_x_max")],
        ];
    }
    assembly
}

/// As [`quarters_state`], of whole rings, which soft springs hold in the plane.
fn rings_state(gap_m: f64, speed_rad_s: f64) -> StaticState {
    let [inner, fit, outer] = RADII_M;
    let mesh = two_blocks(
        &whole(ElementType::HEX20, [24, 1, 3], [fit, outer]),
        &whole(ElementType::HEX20, [24, 1, 2], [inner, fit]),
    );
    let mut assembly = rotating([HUB, SHAFT], gap_m, speed_rad_s);
    for (body, surface) in assembly.bodies.iter_mut().zip(["upper_z_max", "base"]) {
        let [along_x, _, along_z] = &mut body.fixed_along;
        along_x.clear();
        along_z.clear();
        assembly.springs.push(SpringSpec {
            name: body.name.clone(),
            first: surface.to_owned(),
            second: None,
            stiffness_n_m: 1e3,
            direction: None,
        });
    }
    statics(&reduced(&assembly, &mesh, FEW_MODES).1)
}

/// Outward displacement of an edge of a rotating ring in plane strain, m; the other edge has the
/// radius `other_m`.
fn growth_m(material: Material, edge_m: f64, other_m: f64, speed_rad_s: f64) -> f64 {
    let (young_pa, poisson) = plane_strain_constants(material);
    let of_radii = (1.0 - poisson) * edge_m.powi(2) + (3.0 + poisson) * other_m.powi(2);
    material.density_kg_m3 * speed_rad_s.powi(2) * edge_m * of_radii / (4.0 * young_pa)
}

/// The hub grows away from the shaft. All pairs are open, and the planes of symmetry hold both, or
/// springs do.
#[test]
fn a_press_fit_that_rotation_opens_is_a_static_state() {
    let [inner, fit, outer] = RADII_M;
    let (gap_m, speed_rad_s) = (-10e-6, 3000.0);
    let elements = [ElementType::HEX20; 2];
    let (_, quarters) = quarters_state(elements, [12, 12], [HUB, SHAFT], gap_m, speed_rad_s);
    let grown_m = growth_m(HUB, fit, outer, speed_rad_s) - growth_m(SHAFT, fit, inner, speed_rad_s);
    for state in [quarters, rings_state(gap_m, speed_rad_s)] {
        assert!(state.all_open());
        assert!(state.lambda.iter().all(|force| *force == 0.0));
        for x in state.x.iter().step_by(3) {
            let off = x / grown_m - 1.0;
            assert!(off.abs() < 0.01, "{x:e} m, {grown_m:e} m: {off:e}");
        }
    }
}

/// Two rings in plane strain, pressed onto each other (Lame): the interference is the sum of the
/// opening of the hub and the closing of the shaft by the pressure.
#[test]
fn a_quarter_of_a_press_fit_bears_the_pressure_of_lame() {
    let [inner, fit, outer] = RADII_M;
    let interference_m = 10e-6;
    let [(hub_e, hub_nu), (shaft_e, shaft_nu)] = [HUB, SHAFT].map(plane_strain_constants);
    let ratio = |a: f64, b: f64| (b * b + a * a) / (b * b - a * a);
    let gives =
        fit * ((ratio(fit, outer) + hub_nu) / hub_e + (ratio(inner, fit) - shaft_nu) / shaft_e);
    let expected = interference_m / gives;
    for (upper, lower, around) in [
        (ElementType::HEX20, ElementType::HEX20, [12, 12]),
        (ElementType::TET10, ElementType::HEX20, [12, 10]),
        (ElementType::HEX8, ElementType::HEX8, [24, 24]),
    ] {
        let (model, state) =
            quarters_state([upper, lower], around, [HUB, SHAFT], -interference_m, 0.0);
        println!("{upper:?} {lower:?}");
        assert_pressure(&model, &state, expected, 0.03);
        // The resultant p r l over a quarter presses one half of the hub from the other.
        let force: f64 = model
            .pairs
            .iter()
            .enumerate()
            .map(|(p, pair)| -state.lambda[3 * p] * pair.frame[0][2])
            .sum();
        let resultant = expected * fit * LENGTH_M;
        assert!(
            (force / resultant - 1.0).abs() < 0.01,
            "{force} {resultant}"
        );
    }
}
