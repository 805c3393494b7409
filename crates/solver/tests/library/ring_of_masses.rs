//! Waves of a ring of masses, with and without aerodynamic influence, compared with closed forms.

use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::linear_curve::linear_curve;
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::reduced::waves::largest_nodal_diameter;
use dovetail_solver::reduced::{DiscExcitation, Influence, InfluenceCoefficient, Load, Waves};
use dovetail_solver::reduction::sectors::{modes_of_nodal_diameter, reduce_wave};
use dovetail_solver::reduction::{Highest, StuckModes, reduce};
use dovetail_solver::structure::{
    BodyMatrices, InterfaceNode, Joint, ObservedWork, OtherSector, Structure,
};
use faer::c64;
use nalgebra_sparse::{CooMatrix, CscMatrix};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

const SECTORS: usize = 6;
const MASS_KG: f64 = 2.0;
const GROUND_N_M: f64 = 3.0;
/// Spring between two masses.
const BETWEEN_N_M: f64 = 1.0;

/// Sector of a ring of masses that move along its axis, each on a spring to ground, and joined by
/// springs to the next one: node 0 is the mass, and node 1 is the end of its spring, which follows
/// node 0 of the next sector.
fn ring(between: f64) -> Structure {
    let ground = GROUND_N_M;
    let mut stiffness = CooMatrix::new(6, 6);
    for k in 0..3 {
        stiffness.push(k, k, ground + between);
        stiffness.push(3 + k, 3 + k, between);
    }
    stiffness.push(2, 5, -between);
    stiffness.push(5, 2, -between);
    let mut masses = CooMatrix::new(6, 6);
    masses.push(2, 2, MASS_KG);
    let node = |node: usize| InterfaceNode { body: 0, node };
    let at_mass = |size: f64| vec![vec![0.0, 0.0, size, 0.0, 0.0, 0.0]];
    Structure {
        bodies: vec![BodyMatrices {
            name: "mass".to_owned(),
            stiffness: CscMatrix::from(&stiffness),
            mass: CscMatrix::from(&masses),
            load_n: vec![0.0; 6],
            centrifugal_n_s2: Vec::new(),
            interior_nodes: 0,
            held_dofs: vec![0, 1, 3, 4],
            fixed_interface_modes: None,
            node_tags: vec![1, 2],
        }],
        joints: vec![Joint {
            slave: node(1),
            masters: vec![(node(0), 1.0)],
            turned: None,
            across: Some(OtherSector {
                ahead: 1,
                turn: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            }),
        }],
        steady_parts: Vec::new(),
        excitations: vec![at_mass(1.0)],
        observations: vec![ObservedWork {
            name: "mass".to_owned(),
            quantity: ObservedQuantity::Displacement,
            load: at_mass(1.0),
        }],
        dashpots: Vec::new(),
        influenced: vec![at_mass(1.0)],
    }
}

/// m w^2 = k + 4 c sin^2(pi d / N).
#[test]
fn a_ring_of_masses_has_its_frequencies_in_closed_form() {
    let between = 50.0;
    let structure = ring(between);
    for sectors in [2, 3, 4, 7, 36] {
        for d in 0..=largest_nodal_diameter(sectors) {
            let sine = (0.5 * TAU * d as f64 / sectors as f64).sin();
            let expected = (GROUND_N_M + 4.0 * between * sine * sine) / MASS_KG;
            let found = modes_of_nodal_diameter(&structure, sectors, d, 1).unwrap();
            let error = found[0] / expected - 1.0;
            assert!(error.abs() < 1e-12, "{sectors} {d}: {found:?} {expected}");
        }
    }
}

/// Influence of the mode on itself in all waves, in each another one.
fn influence() -> Vec<InfluenceCoefficient> {
    (-2..=3)
        .map(|nodal_diameter| InfluenceCoefficient {
            nodal_diameter,
            mode: 1,
            by_mode: 1,
            real_n_m: 0.1 * nodal_diameter as f64 + 0.05,
            imaginary_n_m: -0.2 - 0.03 * nodal_diameter as f64,
        })
        .collect()
}

/// The ring under a force of 1 N on each mass, of this engine order.
fn ring_under(engine_order: usize) -> Problem {
    let modes = StuckModes::new(Some(1), Highest::RadS(0.0));
    let mut reduced = reduce(ring(BETWEEN_N_M), modes).unwrap().model;
    let excitation = DiscExcitation {
        sectors: SECTORS,
        engine_order,
    };
    let copies = excitation.nodal_diameters(1).into_iter().map(|d| {
        let wave = reduce_wave(&ring(BETWEEN_N_M), SECTORS, d, modes).unwrap();
        (d, wave.model)
    });
    let influence = Influence::new(SECTORS, &[1], &influence());
    let waves = Waves::new(excitation, copies.collect::<BTreeMap<_, _>>());
    reduced.waves = waves.with_influence(influence);
    let of = reduced.harmonic_model(1);
    let m = of.model.omega2.len();
    let [mut cosine, mut sine] = [0, 1].map(|_| Load::zeros(0, m));
    let unit = of.unit_load(0).unwrap();
    unit.add_to([&mut cosine, &mut sine], [1.0, 0.0]);
    Problem {
        excitations: vec![HarmonicLoad {
            sine,
            ..HarmonicLoad::cosine(1, cosine)
        }],
        laws: Vec::new(),
        reduced: reduced.into(),
        modal_ratios: Vec::new(),
    }
}

/// Each engine order has 1 / (k + 4 c sin^2(pi E / N) - m w^2 - A) with the A of the wave that it
/// makes: those below N / 2 run against the sense in which sectors are counted, those above it in
/// that sense.
#[test]
fn each_engine_order_has_the_influence_of_its_wave() {
    for (engine_order, wave) in [
        (0, 0),
        (1, -1),
        (2, -2),
        (3, 3),
        (4, 2),
        (5, 1),
        (6, 0),
        (8, -2),
    ] {
        let problem = ring_under(engine_order);
        let of_wave = influence().into_iter().find(|c| c.nodal_diameter == wave);
        let a = of_wave.unwrap();
        let sine = (0.5 * TAU * engine_order as f64 / SECTORS as f64).sin();
        let omega2 = (GROUND_N_M + 4.0 * BETWEEN_N_M * sine * sine) / MASS_KG;
        let system = ContactSystem::new(&problem, Rayleigh::NONE);
        for w2 in [0.3 * omega2, omega2, 1.01 * omega2, 2.0 * omega2] {
            let divisor = c64::new(MASS_KG * (omega2 - w2) - a.real_n_m, -a.imaginary_n_m);
            let exact = 1.0 / divisor.norm();
            let points = linear_curve(&system, 1, &[w2.sqrt() / TAU]);
            let off = points[0].observed_amplitude[0] / exact - 1.0;
            assert!(off.abs() < 1e-9, "{engine_order}, {w2}: {off:e}");
        }
        let ratio = system.damping_ratio(1, 0);
        let exact = -0.5 * a.imaginary_n_m / (MASS_KG * omega2);
        assert!(
            (ratio / exact - 1.0).abs() < 1e-9,
            "{engine_order}: {ratio} {exact}"
        );
        assert!(system.is_damped(1, 0));
    }
}

/// The crest of a wave of which the next sector is ahead comes to the sector before next.
#[test]
fn an_engine_order_below_half_the_sectors_runs_backwards() {
    for engine_order in [1, 2, 4, 5] {
        let excitation = DiscExcitation {
            sectors: SECTORS,
            engine_order,
        };
        // cos(w t + 2 pi E j / N) at w t = 2 pi E' / N, with the crest at sector 0 before.
        let ahead = TAU * engine_order as f64 / SECTORS as f64;
        let runs = if ahead.sin() > 0.0 { -1 } else { 1 };
        let small = 0.5 * ahead.sin().abs().asin();
        let at = |j: f64| (small + ahead * j).cos();
        assert!(at(f64::from(runs)) > at(-f64::from(runs)), "{engine_order}");
        let found = excitation.signed_nodal_diameter(1);
        assert_eq!(found.signum(), i64::from(runs), "{engine_order}");
    }
}
