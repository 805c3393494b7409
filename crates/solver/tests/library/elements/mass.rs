//! Mass, and the load of rotation.

use dovetail_mesh::{Connectivity, ElementOrder, ElementType, Shape};
use dovetail_solver::fem::assemble_body;
use dovetail_solver::fem::mass_properties::mass_properties;
use dovetail_solver::model::{Body, BodyPrestress, NodeMotion, Rotation};
use dovetail_testkit::block::block;

use super::algebra::*;
use super::bodies::*;

fn mass_kg(body: &Body) -> f64 {
    mass_properties(body, None).unwrap().mass_kg
}

#[test]
fn single_element_mass_is_the_tabulated_one() {
    let corners = [
        [0.01, 0.0, 0.0],
        [0.04, 0.01, 0.0],
        [0.02, 0.05, 0.01],
        [0.0, 0.02, 0.06],
    ];
    let edge = |a: usize, k: usize| [0, 1, 2].map(|d| corners[a][d] - corners[k][d]);
    let volume = dot(&cross(edge(1, 0), edge(2, 0)), &edge(3, 0)) / 6.0;
    // Tet4: (1 + delta) / 20. Tet10, over 420: corners 6 and 1, corner to middle -4 if on its edge,
    // else -6, middles 32, 16 if their edges meet, 8 if opposite.
    let edges = Shape::Tetrahedron.edges();
    let ends = |n: usize| if n < 4 { [n, n] } else { edges[n - 4] };
    let tabulated = |order: ElementOrder, a: usize, b: usize| {
        let meet = ends(a).iter().any(|v| ends(b).contains(v));
        match (order, a < 4, b < 4) {
            (ElementOrder::Linear, ..) if a == b => 42.0,
            (ElementOrder::Linear, ..) => 21.0,
            (_, true, true) if a == b => 6.0,
            (_, true, true) => 1.0,
            (_, false, false) if a == b => 32.0,
            (_, false, false) if meet => 16.0,
            (_, false, false) => 8.0,
            _ if meet => -4.0,
            _ => -6.0,
        }
    };
    for element in [ElementType::TET4, ElementType::TET10] {
        let (order, nodes) = (element.order, element.nodes());
        let mut mesh = block(element, [1, 1, 1], [1.0; 3]);
        mesh.elements = Connectivity::default();
        mesh.elements.push(1, 0..nodes as u32);
        mesh.nodes_m = corners.to_vec();
        let middle =
            |e: &[usize; 2]| [0, 1, 2].map(|d| 0.5 * (corners[e[0]][d] + corners[e[1]][d]));
        mesh.nodes_m.extend(edges.iter().map(middle));
        mesh.nodes_m.truncate(nodes);
        mesh.node_tags = (1..=nodes as u64).collect();
        let body = free_body(&mesh);
        let all = matrices(&body);
        assert!((mass_kg(&body) / (volume * STEEL.density_kg_m3) - 1.0).abs() < 1e-14);
        for a in 0..nodes {
            for b in 0..nodes {
                let m = all
                    .mass
                    .get_entry(3 * a + 1, 3 * b + 1)
                    .unwrap()
                    .into_value();
                let expected = tabulated(order, a, b) / 420.0;
                assert!((m / mass_kg(&body) - expected).abs() < 1e-15, "{a} {b}");
            }
        }
    }
}

/// The mass of a box is the product of the masses of three lines, 1/3 of a line at equal ends, 1/6
/// at others.
#[test]
fn mass_of_a_box_of_eight_nodes_is_a_product() {
    let body = free_body(&block(ElementType::HEX8, [1, 1, 1], SIZE));
    let all = matrices(&body);
    for a in 0..8 {
        for b in 0..8 {
            let [p, q] = [a, b].map(|n| body.nodes_m[n]);
            let line = |k: usize| if p[k] == q[k] { 1.0 / 3.0 } else { 1.0 / 6.0 };
            let expected: f64 = (0..3).map(line).product();
            let m = all.mass.get_entry(3 * a, 3 * b).unwrap().into_value();
            assert!((m / mass_kg(&body) - expected).abs() < 1e-15, "{a} {b}");
        }
    }
}

#[test]
fn total_mass_and_rigid_motion_mass_agree() {
    for mesh in meshes() {
        for body in [free_body(&mesh), body_with_flank(&mesh, STEEL, "x_max")] {
            let all = matrices(&body);
            for direction in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
                let u = field(&body, |_| direction);
                let mass = dot(&u, &times(&all.mass, &u));
                assert!((mass / mass_kg(&body) - 1.0).abs() < 1e-12);
            }
            assert!(all.load_n.iter().all(|f| *f == 0.0), "no rotation, no load");
        }
    }
    for filling in fillings() {
        let straight = free_body(&distorted(filling, [3, 3, 2], SIZE));
        let exact = 7850.0 * 0.03 * 0.02 * 0.015;
        assert!((mass_kg(&straight) / exact - 1.0).abs() < 1e-13);
    }
}

#[test]
fn curved_mesh_has_the_volume_of_the_arc() {
    // Ring sector: radii 0.05 to 0.07, 0.6 rad, height 0.015; the shear along z keeps volumes.
    let exact = 0.5 * (0.07_f64.powi(2) - 0.05_f64.powi(2)) * 0.6 * 0.015 * 7850.0;
    for filling in fillings() {
        let found = mass_kg(&free_body(&bent(filling)));
        let off = (found / exact - 1.0).abs();
        match filling.order() {
            ElementOrder::Quadratic => assert!(off < 1e-4, "{filling:?}: {off:e}"),
            ElementOrder::Linear => assert!(off > 1e-3, "{filling:?}: {off:e}"),
        }
    }
}

#[test]
fn centrifugal_load_has_the_resultant_and_moment_of_the_body() {
    for filling in fillings() {
        let mesh = distorted(filling, [3, 2, 2], SIZE);
        for body in [free_body(&mesh), body_with_flank(&mesh, STEEL, "z_min")] {
            let rotation = rotation(BodyPrestress::None);
            let all = assemble_body(&body, Some(&rotation), &never).unwrap();
            assert!(
                all.stiffness == matrices(&body).stiffness,
                "a load and nothing else"
            );
            let d = [0, 1, 2].map(|k| 0.5 * SIZE[k] - rotation.point_m[k]);
            let a = rotation.axis;
            let factor = SPIN * SPIN * mass_kg(&body);
            let exact = [0, 1, 2].map(|k| factor * (d[k] - dot(&a, &d) * a[k]));
            for (k, exact_k) in exact.iter().enumerate() {
                let sum: f64 = all.load_n.iter().skip(k).step_by(3).sum();
                assert!(
                    (sum - exact_k).abs() < 1e-11 * largest(&exact),
                    "{sum} {exact:?}"
                );
            }
            // About the axis a centrifugal force has no moment.
            let arm = field(&body, |p| {
                cross(a, [0, 1, 2].map(|k| p[k] - rotation.point_m[k]))
            });
            assert!(dot(&arm, &all.load_n).abs() < 1e-11 * largest(&exact) * largest(&arm));
        }
    }
}

#[test]
fn nodes_that_do_not_move_still_load_their_neighbours() {
    let mesh = block(ElementType::TET10, [2, 2, 2], [0.02; 3]);
    let rotation = rotation(BodyPrestress::None);
    let whole = free_body(&mesh);
    let free = assemble_body(&whole, Some(&rotation), &never).unwrap();
    let mut numbers = 0..;
    let nodes = mesh.nodes_m.iter().map(|p| match p[0] {
        0.0 => NodeMotion::Fixed,
        _ => NodeMotion::Free(numbers.next().unwrap()),
    });
    let body = body_of(&mesh, STEEL, nodes.collect(), 0);
    let held = assemble_body(&body, Some(&rotation), &never).unwrap();
    for (n, motion) in body.dofs.nodes.iter().enumerate() {
        if let NodeMotion::Free(free_node) = motion {
            let at = 3 * *free_node as usize;
            assert_eq!(held.load_n[at..at + 3], free.load_n[3 * n..3 * n + 3]);
        }
    }
    assert_eq!(mass_kg(&body), mass_kg(&whole));
}

/// A block of 30 x 20 x 15 mm, its corner at (1, 2, 3) m, that rotates about an axis along z
/// through (1, 0, 0).
#[test]
fn mass_properties_are_those_of_the_solid() {
    for filling in fillings() {
        let mut mesh = filling.block([2, 3, 2], [0.03, 0.02, 0.015]);
        for x in &mut mesh.nodes_m {
            for (x, corner) in x.iter_mut().zip([1.0, 2.0, 3.0]) {
                *x += corner;
            }
        }
        let body = free_body(&mesh);
        let rotation = Rotation {
            point_m: [1.0, 0.0, 0.0],
            axis: [0.0, 0.0, 1.0],
            speed_rad_s: 100.0,
            prestress: BodyPrestress::None,
            prestress_of_contact: false,
        };
        let own = mass_properties(&body, Some(&rotation)).unwrap();
        let (volume, centre) = (0.03 * 0.02 * 0.015, [1.015, 2.01, 3.0075]);
        let mass = STEEL.density_kg_m3 * volume;
        assert!((own.volume_m3.unwrap() / volume - 1.0).abs() < 1e-12);
        assert!((own.mass_kg / mass - 1.0).abs() < 1e-12);
        assert!((0..3).all(|k| (own.centre_m.unwrap()[k] - centre[k]).abs() < 1e-12));
        let expected = body
            .rotates
            .then(|| [0.015, 2.01, 0.0].map(|r| 1e4 * mass * r));
        match (own.centrifugal_force_n, expected) {
            (Some(found), Some(expected)) => {
                assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 1e-9 * expected[1]));
            }
            (found, expected) => assert_eq!(found, expected),
        }
    }
}
