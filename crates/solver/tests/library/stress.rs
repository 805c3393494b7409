//! Stress over a period: a bar in axial vibration against the closed form, and which nodes of two
//! blocks in contact are singular.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::shared_scenes::*;
use dovetail_mesh::ElementType;
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::orbit::linear_orbit;
use dovetail_solver::fem::{assemble, expand_to_nodes};
use dovetail_solver::model::{
    ExcitationKind, ExcitationSpec, LoadKind, LoadSpec, Model, NodeMotion, Strength, bind,
};
use dovetail_solver::problem::dynamic_stiffness::ContactSystem;
use dovetail_solver::reduction::{Highest, StuckModes, reduce};
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::results::stress::{
    Singular, StressCycle, dynamic_stress, highest_stress, singular_nodes,
};
use dovetail_testkit::block::{block, map_nodes};
use faer::Mat;

const STEADY_PA: f64 = 3e6;
const SHAKEN_PA: f64 = 2e6;

fn pulled(pa: f64) -> LoadSpec {
    LoadSpec {
        on: "x_max".into(),
        load: LoadKind::Traction {
            vector_pa: [pa, 0.0, 0.0],
        },
    }
}

/// A bar along x that is held at x = 0 and pulled at its end, with no strain across it, at a share
/// of its first frequency. Returns the model, the motion of its nodes, m, and w over the speed of
/// sound, 1/m.
fn vibrating(share: f64) -> (Model, Vec<Vec<NodalField>>, f64) {
    let shaken = ExcitationSpec {
        kind: ExcitationKind::Load(pulled(1.0)),
        amplitude: SHAKEN_PA,
        harmonic: 1,
        phase_rad: 0.0,
    };
    let (mut assembly, mesh, sound_m_s) = crate::shared_scenes::bar(ElementType::HEX20, 24, shaken);
    assembly.loads = vec![pulled(STEADY_PA)];
    let model = bind(&assembly, &mesh, None).unwrap();
    let wanted = StuckModes::new(Some(60), Highest::RadS(0.0));
    let reduction = reduce(assemble(&model).unwrap(), wanted).unwrap();
    let problem = dovetail_solver::run::problem(reduction.model, &model);
    let wave_1_m = share * FRAC_PI_2 / LENGTH_M;
    let omega = wave_1_m * sound_m_s;
    let system = ContactSystem::new(&problem, Rayleigh::NONE);
    let orbit = linear_orbit(&system, 1, omega / TAU);
    let modes = orbit.modal.len() / 3;
    let modal = Mat::from_fn(modes, 3, |m, block| orbit.modal[block * modes + m]);
    let still = Mat::zeros(0, 3);
    let moving = reduction
        .recovery
        .full_motion(still.as_ref(), modal.as_ref());
    let mean = reduction.recovery.full_static(&[]);
    let dofs = &model.bodies[0].dofs;
    let field = |block: usize| expand_to_nodes(dofs, moving[0].col_as_slice(block));
    let motion = vec![expand_to_nodes(dofs, &mean[0]), field(1), field(2)];
    (model, vec![motion], wave_1_m)
}

/// Under the traction T cos(w t) at its end a bar has the stress T cos(k x) / cos(k L), with k the
/// frequency over the speed of sound; the steady traction stands everywhere.
#[test]
fn stress_of_a_bar_in_axial_vibration_is_that_of_the_wave_equation() {
    for share in [0.01, 0.6, 1.4] {
        let (model, motion, wave_1_m) = vibrating(share);
        let stress = &dynamic_stress(&model, &motion)[0];
        let mut worst: f64 = 0.0;
        let largest = 1.0 / (wave_1_m * LENGTH_M).cos().abs();
        for (node, x) in model.bodies[0].nodes_m.iter().enumerate() {
            let expected = SHAKEN_PA * (wave_1_m * x[0]).cos() / (wave_1_m * LENGTH_M).cos();
            let [mean, cosine, sine] = [0, 1, 2].map(|i| stress.coefficients_pa[i][node]);
            assert!((mean[0] / STEADY_PA - 1.0).abs() < 1e-9, "{x:?}: {mean:?}");
            worst = worst.max((cosine[0] - expected).abs() / SHAKEN_PA / largest);
            let StressCycle {
                mean_pa,
                amplitude_pa,
                largest_pa,
            } = stress.cycles[node];
            let size = von_mises_of(cosine);
            assert!((mean_pa / STEADY_PA - 1.0).abs() < 1e-9);
            assert!(
                (amplitude_pa - size).abs() < 1e-6 * size,
                "{amplitude_pa} {size}"
            );
            assert!((largest_pa - STEADY_PA - size).abs() < 1e-5 * STEADY_PA);
            assert!(sine[0].abs() < 1e-9 * SHAKEN_PA);
        }
        println!("{share}: {worst:.1e}");
        assert!(worst < 2e-3, "{share}: {worst:e}");
    }
}

fn von_mises_of(stress: [f64; 6]) -> f64 {
    dovetail_solver::fem::stress::von_mises(stress)
}

/// The amplitude of the bar is largest at its root, where it is held: that place is singular, and
/// without it the others are ranked.
#[test]
fn the_support_of_a_bar_is_set_apart_from_the_ranked_places() {
    let (model, motion, _) = vibrating(0.6);
    let stress = dynamic_stress(&model, &motion);
    let singular = singular_nodes(&model);
    let strength = Strength {
        endurance_pa: 100e6,
        ultimate_pa: 500e6,
    };
    let found = highest_stress(&model, &stress, &[Some(strength)], &singular, 10);
    let [root] = found.singular.as_slice() else {
        panic!("{:?}", found.singular);
    };
    assert_eq!(root.singular, Some(Singular::Support));
    assert!(model.bodies[0].nodes_m[root.at.node as usize][0] < LENGTH_M / 24.0 + 1e-9);
    let use_of_root = SHAKEN_PA / (0.6 * FRAC_PI_2).cos() / 100e6 + STEADY_PA / 500e6;
    let found_use = root.utilisation.unwrap();
    assert!(
        (found_use / use_of_root - 1.0).abs() < 5e-3,
        "{found_use} {use_of_root}"
    );
    // From the root the stress falls all the way to the end.
    assert_eq!(found.places.len(), 0, "{:?}", found.places);
}

/// Flanks of 40 mm by 20 mm and of half their length: the edges of both are singular, with all nodes
/// of the elements there, and so is the base. Inside the flanks nothing is.
#[test]
fn edges_of_flanks_supports_and_point_loads_are_singular() {
    let mut upper = block(ElementType::TET10, [8, 8, 2], [0.02, 0.02, 0.006]);
    let lower = block(ElementType::TET10, [16, 8, 2], [0.04, 0.02, 0.006]);
    map_nodes(&mut upper, |[x, y, z]| [x + 0.01, y, z + 0.006]);
    let mesh = two_blocks(&upper, &lower);
    let mut assembly = blocks_assembly();
    assembly.rotation = None;
    let model = bind(&assembly, &mesh, None).unwrap();
    let singular = singular_nodes(&model);
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    for (body, of) in model.bodies.iter().zip(&singular) {
        for (node, (x, reason)) in body.nodes_m.iter().zip(of).enumerate() {
            let on_flank = near(x[2], 0.006) && x[0] > 0.01 - 1e-9 && x[0] < 0.03 + 1e-9;
            let at_edge =
                near(x[0], 0.01) || near(x[0], 0.03) || near(x[1], 0.0) || near(x[1], 0.02);
            let inside =
                on_flank && x[0] > 0.0151 && x[0] < 0.0249 && x[1] > 0.0051 && x[1] < 0.0149;
            if on_flank && at_edge {
                assert_eq!(*reason, Some(Singular::FlankEdge), "{} {x:?}", body.name);
            }
            if inside {
                assert_eq!(*reason, None, "{} {x:?}", body.name);
            }
            if body.dofs.nodes[node] == NodeMotion::Fixed {
                assert_eq!(*reason, Some(Singular::Support), "{} {x:?}", body.name);
            }
            let is_corner =
                body.name == "upper" && near(x[0], 0.03) && near(x[1], 0.02) && near(x[2], 0.012);
            if is_corner {
                assert_eq!(*reason, Some(Singular::PointLoad), "{x:?}");
            }
        }
    }
}
