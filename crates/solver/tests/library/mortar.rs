//! Contact between flanks whose meshes do not match, through all packages, compared with exact
//! results and laws of any solution: a uniform pressure, the balance of forces, and the results of
//! matched meshes.

use dovetail_mesh::{ElementType, Mesh};
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_solver::dlft::static_state::static_state;
use dovetail_solver::model::{Assembly, Gap, LoadKind, LoadSpec, Material, Side};
use dovetail_testkit::block::{block, map_nodes, side_by_side, straighten};

use crate::shared_scenes::{
    FEW_MODES, assert_pressure, blocks_assembly, body, contact, reduced, rename, two_blocks,
};

const NEWTON: NewtonOptions = NewtonOptions::new(1e-12, 100);
const SIZE: [f64; 3] = [12e-3, 8e-3, 5e-3];

/// A block whose lines across the flank are graded and bent inside; its base is the plane `z_m`.
fn bent(element: ElementType, cells: [usize; 3], z_m: f64, grade: f64) -> Mesh {
    let mut mesh = block(element, cells, SIZE);
    map_nodes(&mut mesh, |[x, y, z]| {
        let (u, v) = (x / SIZE[0], y / SIZE[1]);
        let inside = u * (1.0 - u) * v * (1.0 - v);
        let u = u + grade * u * (1.0 - u) + 0.5 * grade * inside;
        [SIZE[0] * u, SIZE[1] * (v - grade * inside), z + z_m]
    });
    straighten(&mut mesh);
    mesh
}

/// An upper block pressed on a lower one of other elements by a uniform pressure; rollers on two
/// sides of both.
fn pressed(friction: f64, slave: Option<Side>) -> Assembly {
    let mut both = blocks_assembly();
    both.rotation = None;
    both.excitations.clear();
    both.observations.clear();
    for (body, [young_pa, poisson]) in both.bodies.iter_mut().zip([[1e11, 0.3], [2e11, 0.2]]) {
        body.matrices = Material {
            young_pa,
            poisson,
            density_kg_m3: 4000.0,
        }
        .into();
        let name = body.name.clone();
        body.fixed.clear();
        body.fixed_along = [
            vec![format!("{name}_x_min")],
            vec![format!("{name}_y_min")],
            Vec::new(),
        ];
    }
    both.bodies[1].fixed_along[2] = vec!["base".into()];
    both.contacts[0].pair_law.friction = friction;
    both.contacts[0].slave = slave;
    both.loads = vec![LoadSpec {
        on: "upper_z_max".into(),
        load: LoadKind::Pressure { pressure_pa: 5e7 },
    }];
    both
}

/// Two materials, any two meshes: where the lateral strains of both are alike nothing rubs, and the
/// pressure is uniform to rounding. (Without friction the sides slide over each other as the
/// materials require.)
#[test]
fn a_uniform_pressure_crosses_meshes_that_do_not_match() {
    use ElementType as E;
    for (upper, lower) in [
        (E::TET10, E::TET10),
        (E::HEX8, E::TET10),
        (E::TET4, E::HEX20),
        (E::WEDGE15, E::HEX8),
    ] {
        for slave in [None, Some(Side::First), Some(Side::Second)] {
            let (above, below) = (
                bent(upper, [4, 3, 2], SIZE[2], 0.3),
                bent(lower, [5, 4, 2], 0.0, -0.2),
            );
            let mesh = two_blocks(&above, &below);
            let (model, problem) = reduced(&pressed(0.0, slave), &mesh, FEW_MODES);
            assert!(!model.matches[0].nodes_match);
            let state = static_state(&problem, 1, NEWTON);
            assert!(state.outcome.is_converged());
            println!("{upper:?} {lower:?} {slave:?}");
            assert_pressure(&model, &state, 5e7, 1e-9);
        }
    }
}

/// Two columns between rigid walls, longer than their room by d: p = d / (l1 / E1 + l2 / E2).
#[test]
fn an_interference_presses_as_much_as_the_columns_give_way() {
    let interference_m = 3e-6;
    let mut assembly = pressed(0.0, None);
    assembly.loads.clear();
    assembly.contacts[0].pair_law.gap_m = -interference_m;
    assembly.bodies[0].fixed_along[2] = vec!["upper_z_max".into()];
    let (above, below) = (
        bent(ElementType::TET10, [4, 3, 2], SIZE[2], 0.3),
        bent(ElementType::HEX20, [3, 2, 2], 0.0, -0.2),
    );
    let (model, problem) = reduced(&assembly, &two_blocks(&above, &below), FEW_MODES);
    let state = static_state(&problem, 3, NEWTON);
    assert!(state.outcome.is_converged(), "{:?}", state.outcome);
    let expected = interference_m / (SIZE[2] / 1e11 + SIZE[2] / 2e11);
    assert_pressure(&model, &state, expected, 1e-9);
    // The same of a clearance that the mesh has: the upper block stands lower by it.
    let overlapping = bent(ElementType::TET10, [4, 3, 2], SIZE[2] - interference_m, 0.3);
    assembly.contacts[0].pair_law.gap_m = 0.0;
    assembly.contacts[0].gap = Gap::Mesh;
    let (model, problem) = reduced(&assembly, &two_blocks(&overlapping, &below), FEW_MODES);
    let state = static_state(&problem, 3, NEWTON);
    assert_pressure(&model, &state, expected, 1e-6);
}

/// Three blocks on each other and on rigid ground, pressed from above: each contact carries the
/// load, also where the nodes of the middle one are masters below and slaves above.
#[test]
fn a_tower_of_three_bodies_on_the_ground_hands_the_load_down() {
    let part =
        |cells: [usize; 3], level: f64| bent(ElementType::TET10, cells, level * SIZE[2], 0.1);
    let (a, b, c) = (
        part([4, 3, 2], 2.0),
        part([5, 4, 2], 1.0),
        part([3, 3, 2], 0.0),
    );
    let mut mesh = side_by_side(("ab", &side_by_side(("a", &a), ("b", &b))), ("c", &c));
    rename(
        &mut mesh,
        &[
            ("ab_a_volume", "a"),
            ("ab_b_volume", "b"),
            ("c_volume", "c"),
        ],
    );
    let mut assembly = pressed(0.2, None);
    assembly.bodies = ["a", "b", "c"].map(|name| body(name, &[])).to_vec();
    assembly.contacts = vec![
        contact("ab", "ab_a_z_min", "ab_b_z_max"),
        contact("bc", "ab_b_z_min", "c_z_max"),
        contact("ground", "c_z_min", ""),
    ];
    assembly.contacts[2].second = None;
    assembly.loads[0].on = "ab_a_z_max".into();
    let (model, problem) = reduced(&assembly, &mesh, FEW_MODES);
    assert_eq!(model.contact_names, ["ab", "bc", "ground"]);
    let state = static_state(&problem, 4, NEWTON);
    assert!(state.outcome.is_converged(), "{:?}", state.outcome);
    let load_n = 5e7 * SIZE[0] * SIZE[1];
    for number in 0..3 {
        let mut sum = [0.0; 3];
        for (p, pair) in model
            .pairs
            .iter()
            .enumerate()
            .filter(|(_, p)| p.contact == number)
        {
            for (row, axis) in pair.frame.iter().enumerate() {
                for k in 0..3 {
                    sum[k] += axis[k] * state.lambda[3 * p + row];
                }
            }
        }
        // On the first body, which is the upper one, lambda stands on the left of its equation.
        assert!(
            (sum[2] / -load_n - 1.0).abs() < 1e-8,
            "{number}: {sum:?} {load_n}"
        );
        assert!(
            sum[0].abs() + sum[1].abs() < 1e-8 * load_n,
            "{number}: {sum:?}"
        );
    }
}
