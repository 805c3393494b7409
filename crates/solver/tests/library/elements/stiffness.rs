//! Stiffness: rigid motions, patch tests, uniform stress.

use dovetail_mesh::ElementType;
use dovetail_solver::fem::assemble_body;
use dovetail_solver::fem::elasticity::Lame;
use dovetail_solver::fem::element::{Element, Isoparametric};
use dovetail_solver::fem::expand_to_nodes;
use dovetail_solver::fem::stress::{nodal_stress, stress, von_mises};
use dovetail_solver::model::BodyPrestress;
use dovetail_testkit::block::{block, map_nodes};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::algebra::*;
use super::bodies::*;

#[test]
fn a_body_has_exactly_six_rigid_motions() {
    for mesh in meshes() {
        let body = free_body(&mesh);
        let k = matrices(&body).stiffness;
        let strained = largest(&times(&k, &field(&body, |p| apply(GRADIENT, p)))) / 1e-3;
        for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            assert!(
                largest(&times(&k, &field(&body, |_| axis.map(|a| 0.02 * a)))) < 1e-12 * strained
            );
            assert!(largest(&times(&k, &field(&body, |p| cross(axis, p)))) < 1e-12 * strained);
        }
    }
    for filling in fillings() {
        let body = free_body(&distorted(filling, [1, 2, 1], [0.03, 0.04, 0.05]));
        let k = matrices(&body).stiffness;
        let values = dense(&k, k.ncols())
            .self_adjoint_eigenvalues(Side::Lower)
            .unwrap();
        let top = values[values.len() - 1];
        assert!(
            values[..6].iter().all(|v| v.abs() < 1e-13 * top),
            "{:?}",
            &values[..8]
        );
        assert!(values[6] > 1e-5 * top, "{:?}", &values[..8]);
        println!(
            "{filling:?}: of the largest eigenvalue, sixth {:.1e}, seventh {:.1e}",
            largest(&values[..6]) / top,
            values[6] / top
        );
    }
}

#[test]
fn patch_test_on_distorted_and_curved_meshes() {
    for filling in fillings() {
        let mut curved = filling.block([3, 3, 3], SIZE);
        // Mid-edge nodes move with the field, so inner edges become curves; the three components
        // differ, else the determinants stay of low degree and too coarse a rule goes unseen.
        map_nodes(&mut curved, |p| {
            let wave = |k: usize, n: f64| (n * std::f64::consts::PI * p[k] / SIZE[k]).sin();
            let bubbles = [
                wave(0, 1.0) * wave(1, 1.0) * wave(2, 1.0),
                wave(0, 2.0) * wave(1, 1.0) * wave(2, 1.0),
                wave(0, 1.0) * wave(1, 1.0) * wave(2, 2.0),
            ];
            [0, 1, 2].map(|k| p[k] + 0.9e-3 * bubbles[k])
        });
        for mesh in [distorted(filling, [3, 3, 3], SIZE), curved] {
            let body = free_body(&mesh);
            let k = matrices(&body).stiffness;
            let exact = field(&body, |p| apply(GRADIENT, p));
            let at_boundary = |n: usize| {
                let at = |x: f64, size: f64| x.abs() < 1e-12 || (x - size).abs() < 1e-12;
                (0..3).any(|d| at(mesh.nodes_m[n][d], SIZE[d]))
            };
            let inner: Vec<usize> = (0..exact.len())
                .filter(|dof| !at_boundary(dof / 3))
                .collect();
            assert!(inner.len() >= 24);
            let mut given = exact.clone();
            inner.iter().for_each(|&dof| given[dof] = 0.0);
            let force = times(&k, &given);
            let full = dense(&k, k.ncols());
            let part = Mat::from_fn(inner.len(), inner.len(), |i, j| full[(inner[i], inner[j])]);
            let load = Mat::from_fn(inner.len(), 1, |i, _| -force[inner[i]]);
            let u = part.llt(Side::Lower).unwrap().solve(load);
            let off = inner.iter().enumerate();
            let off: Vec<f64> = off.map(|(i, &dof)| u[(i, 0)] - exact[dof]).collect();
            let worst = largest(&off) / largest(&exact);
            println!(
                "{filling:?}: {} inner unknowns off by {worst:.1e}",
                inner.len()
            );
            assert!(worst < 1e-12, "{worst:e}");
        }
    }
}

#[test]
fn stress_of_a_linear_field_is_hookes_everywhere() {
    let expected = hooke(GRADIENT, STEEL);
    for mesh in meshes() {
        let body = free_body(&mesh);
        let u: Vec<[f64; 3]> = mesh.nodes_m.iter().map(|p| apply(GRADIENT, *p)).collect();
        let (per_element, per_node) = (stress(&body, &u), nodal_stress(&body, &u));
        assert_eq!(
            (per_element.len(), per_node.len()),
            (mesh.elements.len(), mesh.nodes_m.len())
        );
        for s in per_element.iter().chain(&per_node) {
            assert!((0..6).all(|k| (s[k] - expected[k]).abs() < 1e-11 * largest(&expected)));
        }
    }
    assert!((von_mises([3.0, 0.0, 0.0, 0.0, 0.0, 0.0]) - 3.0).abs() < 1e-15);
    assert!((von_mises([1.0, 1.0, 1.0, 0.0, 2.0, 0.0]) - 12.0_f64.sqrt()).abs() < 1e-15);
}

#[test]
fn strain_energy_of_a_linear_field_is_exact_with_ties_too() {
    let (s, h) = (hooke(GRADIENT, STEEL), GRADIENT);
    let density = s[0] * h[0][0]
        + s[1] * h[1][1]
        + s[2] * h[2][2]
        + s[3] * (h[0][1] + h[1][0])
        + s[4] * (h[1][2] + h[2][1])
        + s[5] * (h[0][2] + h[2][0]);
    let exact = density * SIZE[0] * SIZE[1] * SIZE[2];
    for filling in fillings() {
        let mesh = distorted(filling, [3, 2, 2], SIZE);
        for body in [free_body(&mesh), body_with_flank(&mesh, STEEL, "x_min")] {
            let u = field(&body, |p| apply(GRADIENT, p));
            let energy = dot(&u, &times(&matrices(&body).stiffness, &u));
            assert!((energy / exact - 1.0).abs() < 1e-12, "{energy} {exact}");
            // Tied nodes follow the linear field.
            for (value, p) in expand_to_nodes(&body.dofs, &u).iter().zip(&mesh.nodes_m) {
                let exact = apply(GRADIENT, *p);
                assert!((0..3).all(|k| (value[k] - exact[k]).abs() < 1e-18));
            }
        }
    }
}

#[test]
fn matrices_are_symmetric_to_the_last_bit() {
    for mesh in meshes() {
        let body = body_with_flank(&mesh, STEEL, "y_max");
        let rotation = rotation(BodyPrestress::HeldFlanks);
        let all = assemble_body(&body, Some(&rotation), &solve).unwrap();
        for a in [&all.stiffness, &all.mass] {
            for (i, j, v) in a.triplet_iter() {
                assert_eq!(a.get_entry(j, i).unwrap().into_value(), *v);
            }
        }
        // A third of the stiffness has a place in the mass: that between equal axes.
        assert_eq!(3 * all.mass.nnz(), all.stiffness.nnz());
        for (i, j, _) in all.mass.triplet_iter() {
            assert!(i % 3 == j % 3 && all.stiffness.get_entry(i, j).is_some());
        }
    }
}

#[test]
fn stiffness_and_mass_turn_with_the_body() {
    // K of the turned body is Q K Q^T, M the same; with ties and curved edges.
    let q = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]];
    for mesh in meshes() {
        let mut turned = mesh.clone();
        map_nodes(&mut turned, |p| apply(q, p));
        let [here, there] = [&mesh, &turned].map(|m| matrices(&body_with_flank(m, STEEL, "x_min")));
        let top = here
            .stiffness
            .values()
            .iter()
            .fold(0.0f64, |t, v| t.max(v.abs()));
        let heaviest = here
            .mass
            .values()
            .iter()
            .fold(0.0f64, |t, v| t.max(v.abs()));
        let x: Vec<f64> = (0..here.load_n.len())
            .map(|i| (1.0 + 2.7 * i as f64).sin())
            .collect();
        let turn = |x: &[f64]| -> Vec<f64> {
            x.chunks_exact(3)
                .flat_map(|v| apply(q, [v[0], v[1], v[2]]))
                .collect()
        };
        for (a, b, scale) in [
            (&here.stiffness, &there.stiffness, top),
            (&here.mass, &there.mass, heaviest),
        ] {
            let (expected, found) = (turn(&times(a, &x)), times(b, &turn(&x)));
            let off: Vec<f64> = expected.iter().zip(&found).map(|(a, b)| a - b).collect();
            println!(
                "{:?}: turned, off by {:.1e}",
                mesh.elements.types(),
                largest(&off) / scale
            );
            assert!(largest(&off) < 1e-12 * scale, "{:e}", largest(&off) / scale);
        }
    }
}

/// Pure bending about z with plane sections, to which the trilinear hexahedron responds by shear.
/// With incompatible modes boxes bend exactly, whatever their proportions; twice the energy is E I
/// kappa^2 L.
#[test]
fn boxes_of_eight_nodes_bend_as_a_beam_does() {
    let (kappa, nu) = (0.2, STEEL.poisson);
    let bent = |[x, y, z]: [f64; 3]| {
        let (y, z) = (y - 0.5 * SIZE[1], z - 0.5 * SIZE[2]);
        [
            -kappa * x * y,
            0.5 * kappa * (x * x + nu * (y * y - z * z)),
            kappa * nu * y * z,
        ]
    };
    let exact = STEEL.young_pa * kappa * kappa * SIZE[0] * SIZE[2] * SIZE[1].powi(3) / 12.0;
    let mesh = block(ElementType::HEX8, [3, 1, 1], SIZE);
    let body = free_body(&mesh);
    let u = field(&body, bent);
    let energy = dot(&u, &times(&matrices(&body).stiffness, &u));
    assert!((energy / exact - 1.0).abs() < 1e-12, "{}", energy / exact);
    let at_node: Vec<[f64; 3]> = mesh.nodes_m.iter().map(|x| bent(*x)).collect();
    for (x, s) in mesh.nodes_m.iter().zip(nodal_stress(&body, &at_node)) {
        let axial = -STEEL.young_pa * kappa * (x[1] - 0.5 * SIZE[1]);
        let size = 0.5 * STEEL.young_pa * kappa * SIZE[1];
        assert!(
            (s[0] - axial).abs() < 1e-12 * size && s[1..].iter().all(|s| s.abs() < 1e-12 * size)
        );
    }
    // Without them the same boxes are too stiff.
    let compatible = Isoparametric::<8>::new(ElementType::HEX8);
    let mut stiff = 0.0;
    for nodes in mesh.elements.iter() {
        let of = |values: &[[f64; 3]]| -> Vec<[f64; 3]> {
            nodes.iter().map(|&n| values[n as usize]).collect()
        };
        let (x, u) = (of(&mesh.nodes_m), of(&at_node));
        let mut k = vec![[0.0; 9]; 64];
        compatible.stiffness(&x, false, Lame::from(STEEL), &mut k);
        for (ab, block) in k.iter().enumerate() {
            for (rc, value) in block.iter().enumerate() {
                stiff += u[ab / 8][rc / 3] * value * u[ab % 8][rc % 3];
            }
        }
    }
    assert!(stiff > 1.2 * exact, "{}", stiff / exact);
}
