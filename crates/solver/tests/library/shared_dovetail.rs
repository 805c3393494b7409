//! Blade in its dovetail: an assembly made in code, and the results of binding at any mesh.

use std::collections::BTreeSet;

use crate::shared_bodies::{assembly, body};
use dovetail_numerics::space::{cross, distance, dot, sub};
use dovetail_solver::model::{Assembly, ContactSpec, Model, NodeMotion};

pub fn contact(name: &str, first: &str, second: &str) -> ContactSpec {
    ContactSpec::new(name, first, second, 0.3)
}

pub fn dovetail_assembly() -> Assembly {
    let sides = ["jaw_base", "jaw_side_left", "jaw_side_right"];
    assembly(
        vec![body("blade", &[]), body("jaw", &sides)],
        vec![
            contact("left", "blade_flank_left", "jaw_flank_left"),
            contact("right", "blade_flank_right", "jaw_flank_right"),
        ],
        "excitation",
    )
}

pub fn assert_vector(found: [f64; 3], expected: [f64; 3], tolerance: f64) {
    assert!(
        distance(found, expected) < tolerance,
        "{found:?} is not {expected:?}"
    );
}

/// Checks properties of the default dovetail at any flank mesh.
pub fn check_dovetail(model: &Model, nu: usize, nv: usize) {
    let per_flank = nu * nv;
    assert_eq!(model.pairs.len(), 2 * per_flank);
    assert_eq!(model.contact_names, ["left", "right"]);
    let (skew, half) = (25f64.to_radians(), 0.5f64.sqrt());
    let slot = [skew.cos(), skew.sin(), 0.0];
    for (i, pair) in model.pairs.iter().enumerate() {
        assert_eq!(pair.contact, i / per_flank);
        let [n, t1, t2] = pair.frame;
        // 45 degrees from the radial direction, from the jaw down into the blade.
        let sign = if pair.contact == 0 { 1.0 } else { -1.0 };
        let out = [-skew.sin() * sign, skew.cos() * sign, 0.0];
        assert_vector(n, [-half * out[0], -half * out[1], -half], 1e-9);
        assert_vector(t1, slot, 1e-9);
        assert_vector(t2, cross(n, t1), 1e-14);
        for (b, at) in [pair.slave.node, pair.slave.partner().unwrap()]
            .into_iter()
            .enumerate()
        {
            let body = &model.bodies[b];
            assert_eq!(at.body, b);
            assert!(distance(body.nodes_m[at.node as usize], pair.position_m) < 1e-12);
            assert_eq!(body.dofs.free(at.node), Some(body.dofs.interior_nodes + i));
        }
    }
    // Each flank is a parallelogram: length 32 / cos 25 along the slot, 4.5 across.
    let expected = 4.5e-3 * 32e-3 / skew.cos();
    for c in 0..2 {
        let areas = model
            .pairs
            .iter()
            .filter(|p| p.contact == c)
            .map(|p| p.area_m2);
        assert!((areas.sum::<f64>() / expected - 1.0).abs() < 1e-9);
    }
    assert_eq!(model.flank_facets.len(), 4 * (nu - 1) * (nv - 1));
    let mut area = 0.0;
    for t in &model.flank_facets {
        let [a, b, c] = [0, 1, 2].map(|k| &model.pairs[t[k] as usize]);
        assert!(a.contact == b.contact && b.contact == c.contact);
        let normal = cross(
            sub(b.position_m, a.position_m),
            sub(c.position_m, a.position_m),
        );
        assert!(
            dot(normal, a.frame[0]) > 0.0,
            "a triangle is turned away from the blade"
        );
        area += 0.5 * dot(normal, a.frame[0]);
    }
    assert!((area / (2.0 * expected) - 1.0).abs() < 1e-9);
    assert!(
        model.largest_mismatch_m() < 1e-15,
        "{}",
        model.largest_mismatch_m()
    );
    for body in &model.bodies {
        let d = &body.dofs;
        assert_eq!(d.contact_nodes, 2 * per_flank);
        let free: BTreeSet<u32> = d
            .nodes
            .iter()
            .filter_map(|m| {
                if let NodeMotion::Free(i) = m {
                    Some(*i)
                } else {
                    None
                }
            })
            .collect();
        assert_eq!(free, (0..d.free_nodes() as u32).collect());
        let mut tied = 0;
        for (n, motion) in d.nodes.iter().enumerate() {
            let NodeMotion::Tied([a, b]) = motion else {
                continue;
            };
            tied += 1;
            let (a, b) = (body.nodes_m[*a as usize], body.nodes_m[*b as usize]);
            assert_vector(
                body.nodes_m[n],
                [0, 1, 2].map(|k| 0.5 * (a[k] + b[k])),
                1e-12,
            );
            let kept = d
                .weights(n)
                .filter(|&(i, w)| i >= d.interior_nodes && w == 0.5);
            assert_eq!(kept.count(), 2);
        }
        // Edges of a grid with one diagonal per cell.
        let edges = (nu - 1) * nv + nu * (nv - 1) + (nu - 1) * (nv - 1);
        let quadratic = body.elements.element_nodes(0).len() == 10;
        assert_eq!(tied, if quadratic { 2 * edges } else { 0 });
    }
}
