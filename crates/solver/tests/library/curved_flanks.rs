//! Flanks whose edges are curved in the mesh. The model makes them straight, so that a rotation of
//! the body strains nothing and a uniform pressure stays uniform.

use std::f64::consts::PI;

use dovetail_mesh::{ElementType, Mesh};
use dovetail_solver::fem::assemble;
use dovetail_solver::model::{Assembly, Model, ModelError, NodeMotion, bind};
use dovetail_testkit::block::{block, map_nodes};
use nalgebra_sparse::CscMatrix;

use crate::shared_scenes::{assembly, body, contact, cross, distance};

const SIZE: [f64; 3] = [20e-3, 12e-3, 8e-3];
const QUADRATIC: [ElementType; 3] = [ElementType::TET10, ElementType::WEDGE15, ElementType::HEX20];

/// One body that floats above rigid ground, which these surfaces lie on.
fn grounded_body(flanks: &[&str]) -> Assembly {
    let contacts = flanks.iter().map(|flank| {
        let mut ground = contact(flank, flank, "");
        ground.second = None;
        ground
    });
    let mut floating = assembly(vec![body("volume", &[])], contacts.collect(), "corner_111");
    floating.rotation = None;
    floating.excitations.clear();
    floating.observations.clear();
    floating
}

/// Forces K u of a motion of the nodes, and the largest product in their sums.
fn forces_n(model: &Model, motion: impl Fn([f64; 3]) -> [f64; 3]) -> (Vec<f64>, f64) {
    let body = &model.bodies[0];
    let mut u = vec![0.0; 3 * body.dofs.free_nodes()];
    for (node, at) in body.dofs.nodes.iter().zip(&body.nodes_m) {
        if let NodeMotion::Free(n) = node {
            u[3 * *n as usize..][..3].copy_from_slice(&motion(*at));
        }
    }
    let k: &CscMatrix<f64> = &assemble(model).unwrap().bodies[0].stiffness;
    let (mut sum, mut largest) = (vec![0.0; u.len()], 0.0f64);
    for (i, j, value) in k.triplet_iter() {
        sum[i] += value * u[j];
        largest = largest.max((value * u[j]).abs());
    }
    (sum, largest)
}

/// A block whose base lies on a cylinder of 100 mm about the y axis, as all its layers do.
fn bent(element: ElementType) -> Mesh {
    let mut mesh = block(element, [6, 3, 2], SIZE);
    map_nodes(&mut mesh, |[x, y, z]| {
        let (sine, cosine) = (x / 0.1).sin_cos();
        [(0.1 + z) * sine, y, (0.1 + z) * cosine]
    });
    mesh
}

#[test]
fn a_turn_of_a_body_with_a_cylindrical_flank_costs_no_force() {
    for element in QUADRATIC {
        let model = bind(&grounded_body(&["z_min"]), &bent(element), None).unwrap();
        for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, -0.5, 0.8]] {
            let (forces, largest) = forces_n(&model, |at| cross(axis, at));
            let worst = forces.iter().fold(0.0f64, |m, f| m.max(f.abs()));
            assert!(
                worst < 1e-10 * largest,
                "{element:?}: {worst:e} of {largest:e}"
            );
        }
        // The chord of an arc of 20 / 6 mm is 0.0139 mm from it (the sagitta); those along y are
        // straight.
        let [told] = &model.straightened[..] else {
            panic!("{:?}", model.straightened);
        };
        let sagitta_m = 0.1 * (1.0 - (20e-3 / 6.0 / 0.2_f64).cos());
        assert!((told.largest_m / sagitta_m - 1.0).abs() < 1e-9, "{told:?}");
        let chord_m = 0.2 * (20e-3 / 6.0 / 0.2_f64).sin();
        assert!((told.largest_share / (sagitta_m / chord_m) - 1.0).abs() < 1e-9);
        // All nodes that are not in the middles of flank edges stay where they are on their
        // cylinders.
        let body = &model.bodies[0];
        for (node, [x, _, z]) in body.dofs.nodes.iter().zip(&body.nodes_m) {
            if matches!(node, NodeMotion::Free(_)) {
                let layer = (x.hypot(*z) - 0.1) / (SIZE[2] / 4.0);
                assert!((layer - layer.round()).abs() < 1e-9, "{layer}");
            }
        }
    }
}

/// Edges that wind in the plane of the flank: along z all strains are alike, and the sides narrow
/// according to Poisson's ratio, so that only the flanks bear a force. Each of their nodes has its
/// area of the stress.
#[test]
fn a_uniform_pressure_on_a_plane_flank_with_curved_edges_stays_uniform() {
    for element in QUADRATIC {
        let mut mesh = block(element, [4, 3, 2], SIZE);
        map_nodes(&mut mesh, |[x, y, z]| {
            let (u, v) = (x / SIZE[0], y / SIZE[1]);
            let inside = u * (1.0 - u) * v * (1.0 - v);
            let at_middles = (4.0 * PI * u).sin() + (3.0 * PI * v).sin();
            let winds = 0.1 * inside * if z == 0.0 { at_middles + 3.0 } else { 3.0 };
            [SIZE[0] * (u + winds), SIZE[1] * (v - winds), z]
        });
        let model = bind(&grounded_body(&["z_min", "z_max"]), &mesh, None).unwrap();
        assert!(
            model.straightened[0].largest_share > 0.01,
            "{:?}",
            model.straightened
        );
        let material = model.bodies[0].material().unwrap();
        let stress_pa = 1e8;
        let strain = stress_pa / material.young_pa;
        let (forces, _) = forces_n(&model, |[x, y, z]| {
            let across = -material.poisson * strain;
            [across * x, across * y, strain * z]
        });
        let mut expected = vec![0.0; forces.len()];
        for pair in &model.pairs {
            let free = model.bodies[0].dofs.free(pair.slave.node.node).unwrap();
            let outward = -pair.frame[0][2];
            assert!((outward.abs() - 1.0).abs() < 1e-12);
            expected[3 * free + 2] += outward * stress_pa * pair.area_m2;
        }
        let scale = stress_pa * SIZE[0] * SIZE[1] / 20.0;
        for (found, wanted) in forces.iter().zip(&expected) {
            assert!(
                (found - wanted).abs() < 1e-9 * scale,
                "{element:?}: {found:e}, not {wanted:e} N"
            );
        }
    }
}

/// Two elements around a half circle, thinner than their chords are away from it.
#[test]
fn elements_that_fold_when_an_edge_is_made_straight_are_an_error() {
    let size = [1.0, 10e-3, 0.5e-3];
    let mut mesh = block(ElementType::HEX20, [2, 1, 1], size);
    map_nodes(&mut mesh, |[x, y, z]| {
        let (sine, cosine) = (PI * x).sin_cos();
        [(10e-3 + z) * sine, y, (10e-3 + z) * cosine]
    });
    let error = bind(&grounded_body(&["z_max"]), &mesh, None).unwrap_err();
    assert!(
        matches!(error, ModelError::FoldedAtFlank { count: 2, largest_m, .. } if (2.9e-3..3.2e-3).contains(&largest_m)),
        "{error}"
    );
    // Straight chords of the inner circle leave more room.
    assert!(bind(&grounded_body(&["z_min"]), &mesh, None).is_ok());
}

/// Nodes of straight flanks stay where they are to the bit.
#[test]
fn straight_flanks_are_left_alone() {
    let mesh = block(ElementType::HEX20, [3, 2, 2], SIZE);
    let model = bind(&grounded_body(&["z_min"]), &mesh, None).unwrap();
    assert!(model.straightened.is_empty());
    for (own, node) in model.bodies[0]
        .nodes_m
        .iter()
        .zip(&model.bodies[0].mesh_nodes)
    {
        assert!(distance(*own, mesh.nodes_m[*node as usize]) < 1e-18);
    }
}
