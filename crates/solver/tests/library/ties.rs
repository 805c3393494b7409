//! Surfaces that are joined: bonded contacts and the faces of a sector. If the meshes match, the
//! joined bodies are one body to rounding. If they differ, uniform stress and pure bending cross a
//! plane joint to rounding (their exact solutions are quadratic displacements), and the error of a
//! curved joint and of torsion falls with the mesh.

use std::collections::BTreeMap;

use dovetail_mesh::{ElementType, Mesh};
use dovetail_solver::fem::assemble;
use dovetail_solver::model::{
    Assembly, BodyNode, ContactLaw, CyclicSpec, Material, ModelError, NodeMotion, Side, Slave, bind,
};
use dovetail_solver::reduction::{Highest, StuckModes};
use dovetail_testkit::block::{block, map_nodes, side_by_side};

use crate::shared_scenes::{assembly, body, contact, reduced, rename};

const QUADRATIC: [ElementType; 3] = [ElementType::TET10, ElementType::WEDGE15, ElementType::HEX20];
const TEN: StuckModes = StuckModes::new(Some(10), Highest::OfFirstStuckMode(1.0));
/// Length of the whole bar, width and height, m.
const SIZE: [f64; 3] = [40e-3, 20e-3, 6e-3];

/// A half of the bar: the one from x = 0, or the other one.
fn half(element: ElementType, cells: [usize; 3], second: bool) -> Mesh {
    let mut mesh = block(element, cells, [0.5 * SIZE[0], SIZE[1], SIZE[2]]);
    if second {
        map_nodes(&mut mesh, |[x, y, z]| [x + 0.5 * SIZE[0], y, z]);
    }
    mesh
}

/// The two halves, bonded to each other; the first one is fixed at its end if `fixed` says so.
fn bonded(root: &Mesh, tip: &Mesh, fixed: bool) -> (Assembly, Mesh) {
    let mut mesh = side_by_side(("root", root), ("tip", tip));
    rename(&mut mesh, &[("root_volume", "root"), ("tip_volume", "tip")]);
    let ends: &[&str] = if fixed { &["root_x_min"] } else { &[] };
    let mut seam = contact("seam", "root_x_max", "tip_x_min");
    seam.law = ContactLaw::Bonded;
    let bodies = vec![body("root", ends), body("tip", &[])];
    let mut both = assembly(bodies, vec![seam], "tip_corner_111");
    both.rotation = None;
    (both, mesh)
}

fn one_piece(mesh: &Mesh) -> (Assembly, Mesh) {
    let mut mesh = mesh.clone();
    rename(&mut mesh, &[("volume", "bar")]);
    let bodies = vec![body("bar", &["x_min"])];
    let mut bar = assembly(bodies, Vec::new(), "corner_111");
    bar.rotation = None;
    (bar, mesh)
}

/// Squared angular frequencies of the modes in which everything that touches moves as one.
fn omega2((assembly, mesh): &(Assembly, Mesh)) -> Vec<f64> {
    let (_, problem) = reduced(assembly, mesh, TEN);
    let modes = &problem.reduced.harmonic_model(0).model.omega2;
    modes[..10].to_vec()
}

/// Largest relative difference of two lists of frequencies.
fn largest_difference(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let both = found.iter().zip(expected);
    let off = both.map(|(a, b)| ((a / b).sqrt() - 1.0).abs());
    off.fold(0.0, f64::max)
}

#[test]
fn bodies_whose_meshes_match_at_a_bonded_contact_are_one_body() {
    for element in QUADRATIC {
        let whole = one_piece(&block(element, [4, 3, 2], SIZE));
        let halves = [false, true].map(|second| half(element, [2, 3, 2], second));
        let cut = bonded(&halves[0], &halves[1], true);
        let (model, _) = reduced(&cut.0, &cut.1, TEN);
        assert!(model.matches[0].nodes_match && model.straightened.is_empty());
        let off = largest_difference(&omega2(&cut), &omega2(&whole));
        println!("{element:?}: {off:.1e}");
        assert!(off < 1e-9, "{element:?}: {off:e}");
    }
}

/// Middle nodes in a bonded face stay where the mesh has them, and carry their own joint.
#[test]
fn a_curved_bonded_face_keeps_its_middle_nodes() {
    let bulge = |[x, y, z]: [f64; 3]| [x + 0.1 * SIZE[1] * (3.0 * y / SIZE[1]).sin(), y, z];
    for element in QUADRATIC {
        let mut meshes = [
            block(element, [4, 3, 2], SIZE),
            half(element, [2, 3, 2], false),
            half(element, [2, 3, 2], true),
        ];
        meshes.iter_mut().for_each(|mesh| map_nodes(mesh, bulge));
        let [whole, root, tip] = meshes;
        let cut = bonded(&root, &tip, true);
        let off = largest_difference(&omega2(&cut), &omega2(&one_piece(&whole)));
        assert!(off < 1e-9, "{element:?}: {off:e}");
    }
}

/// A contact with pairs makes the middle nodes of its edges follow their corners. A node that is bonded
/// to such a middle node follows these corners, and a middle node that follows corners is not bonded.
#[test]
fn a_bonded_face_may_share_an_edge_with_a_contact() {
    let size = [0.5 * SIZE[0], SIZE[1], SIZE[2]];
    for element in QUADRATIC {
        let at = |offset: [f64; 3]| {
            let mut mesh = block(element, [2, 3, 2], size);
            map_nodes(&mut mesh, |x| [0, 1, 2].map(|k| x[k] + offset[k]));
            mesh
        };
        let (a, b, c) = (
            at([0.0; 3]),
            at([size[0], 0.0, 0.0]),
            at([0.0, 0.0, -size[2]]),
        );
        let mut mesh = side_by_side(("ab", &side_by_side(("a", &a), ("b", &b))), ("c", &c));
        let names = [
            ("ab_a_volume", "a"),
            ("ab_b_volume", "b"),
            ("c_volume", "c"),
        ];
        rename(&mut mesh, &names);
        let bodies = ["a", "b", "c"].map(|name| body(name, &[])).to_vec();
        for slave in [Side::First, Side::Second] {
            let mut seam = contact("seam", "ab_b_x_min", "ab_a_x_max");
            seam.law = ContactLaw::Bonded;
            seam.slave = Some(slave);
            let mut seat = contact("seat", "ab_a_z_min", "c_z_max");
            seat.slave = Some(slave);
            let mut all = assembly(bodies.clone(), vec![seam, seat], "ab_b_corner_111");
            all.rotation = None;
            let model = bind(&all, &mesh, None).unwrap();
            let tied = |at: &BodyNode| {
                let motion = model.bodies[at.body].dofs.nodes[at.node as usize];
                matches!(motion, NodeMotion::Tied(_))
            };
            for slave in &model.bonded {
                let masters = slave.masters.iter().map(|(at, _)| at);
                assert!(!masters.chain([&slave.node]).any(tied));
                let sum: f64 = slave.masters.iter().map(|(_, w)| w).sum();
                assert!((sum - 1.0).abs() < 1e-12);
            }
            let followed = model.bonded.iter().filter(|slave| slave.masters.len() == 2);
            let on_edge = if slave == Side::First { 3 } else { 0 };
            assert_eq!(followed.count(), on_edge, "{element:?} {slave:?}");
            assert!(assemble(&model).is_ok());
        }
    }
}

/// Displacement of a point.
type Field = Box<dyn Fn([f64; 3]) -> [f64; 3]>;

/// Displacement fields that leave the sides of the bar free, with a Poisson's ratio of 0.34: tension,
/// and pure bending about z and about y.
fn exact_fields() -> Vec<Field> {
    const POISSON: f64 = 0.34;
    let tension = |[x, y, z]: [f64; 3]| [x, -POISSON * y, -POISSON * z];
    let mut fields: Vec<Field> = vec![Box::new(tension)];
    for across in [1, 2] {
        // The stress is E s along x, with s measured across.
        fields.push(Box::new(move |p| {
            let (s, other) = (p[across], p[3 - across]);
            let mut u = [0.0; 3];
            u[0] = p[0] * s;
            u[across] = -0.5 * (p[0] * p[0] + POISSON * (s * s - other * other));
            u[3 - across] = -POISSON * s * other;
            u
        }));
    }
    fields
}

/// Forces that the elements of a body need for displacements at its nodes, by node.
fn forces(
    model: &dovetail_solver::model::Model,
    structure: &dovetail_solver::structure::Structure,
    body: usize,
    field: &dyn Fn([f64; 3]) -> [f64; 3],
) -> Vec<[f64; 3]> {
    let (of, matrices) = (&model.bodies[body], &structure.bodies[body]);
    let mut u = vec![0.0; matrices.dofs()];
    let number = |node: usize| match of.dofs.nodes[node] {
        NodeMotion::Free(n) => n as usize,
        _ => panic!("a node is not free"),
    };
    for (node, x) in of.nodes_m.iter().enumerate() {
        u[3 * number(node)..][..3].copy_from_slice(&field(*x));
    }
    let mut f = vec![0.0; u.len()];
    for (column, entries) in matrices.stiffness.col_iter().enumerate() {
        for (&row, &v) in entries.row_indices().iter().zip(entries.values()) {
            f[row] += v * u[column];
        }
    }
    (0..of.nodes_m.len())
        .map(|node| [0, 1, 2].map(|k| f[3 * number(node) + k]))
        .collect()
}

/// The slaves have the displacements that they follow, and what both sides need in an exact solution
/// cancels at each node of the joint that no other face of the bar has.
#[test]
fn uniform_stress_and_pure_bending_cross_meshes_that_do_not_match() {
    for (root, tip) in [
        (ElementType::TET10, ElementType::TET10),
        (ElementType::TET10, ElementType::HEX20),
        (ElementType::WEDGE15, ElementType::TET10),
        (ElementType::HEX20, ElementType::WEDGE15),
        (ElementType::HEX20, ElementType::HEX20),
    ] {
        for cells in [
            [[2, 3, 2], [2, 5, 4]],
            [[2, 4, 4], [2, 3, 1]],
            [[2, 2, 1], [2, 2, 3]],
        ] {
            let meshes = (half(root, cells[0], false), half(tip, cells[1], true));
            let (both, mesh) = bonded(&meshes.0, &meshes.1, false);
            let model = bind(&both, &mesh, None).unwrap();
            assert!(!model.matches[0].nodes_match);
            let structure = assemble(&model).unwrap();
            for (number, field) in exact_fields().iter().enumerate() {
                let all = [0, 1].map(|b| forces(&model, &structure, b, field));
                let off = joint_residual(&model, &all, field.as_ref());
                println!("{root:?} {tip:?} {cells:?} field {number}: {off:.1e}");
                assert!(
                    off < 1e-9,
                    "{root:?} {tip:?} {cells:?}, field {number}: {off:e}"
                );
            }
        }
    }
}

/// Largest displacement by which a slave misses its masters, and largest force left at a node of the
/// joint, relative to the largest displacement and force there.
fn joint_residual(
    model: &dovetail_solver::model::Model,
    forces: &[Vec<[f64; 3]>; 2],
    field: &dyn Fn([f64; 3]) -> [f64; 3],
) -> f64 {
    let at = |node: &BodyNode| model.bodies[node.body].nodes_m[node.node as usize];
    let mut left: BTreeMap<BodyNode, [f64; 3]> = BTreeMap::new();
    let (mut missed, mut largest, mut largest_n) = (0.0_f64, 0.0_f64, 0.0_f64);
    for Slave { node, masters, .. } in &model.bonded {
        let force = forces[node.body][node.node as usize];
        let mut off = field(at(node));
        for k in 0..3 {
            largest = largest.max(off[k].abs());
            largest_n = largest_n.max(force[k].abs());
        }
        for (master, weight) in masters {
            let own = forces[master.body][master.node as usize];
            let sum = left.entry(*master).or_insert(own);
            let u = field(at(master));
            for k in 0..3 {
                sum[k] += weight * force[k];
                off[k] -= weight * u[k];
            }
        }
        missed = off.iter().fold(missed, |m, v| m.max(v.abs()));
    }
    // Sides of the bar carry tractions of their own.
    let is_inside = |node: &BodyNode| {
        let x = at(node);
        (1..3).all(|k| x[k] > 1e-9 && x[k] < SIZE[k] - 1e-9)
    };
    let inside = left.iter().filter(|(node, _)| is_inside(node));
    let unbalanced = inside
        .flat_map(|(_, f)| f)
        .fold(0.0_f64, |m, v| m.max(v.abs()));
    (missed / largest).max(unbalanced / largest_n)
}

/// A bar whose two halves meet in a curved face of unequal meshes, and torsion among its modes,
/// against the same bar in one piece.
#[test]
fn the_error_of_a_curved_joint_falls_with_the_mesh() {
    let bulge = |[x, y, z]: [f64; 3]| {
        let arch = (3.0 * y / SIZE[1]).sin() * (2.0 * z / SIZE[2]).cos();
        [x + 0.1 * SIZE[1] * arch, y, z]
    };
    let off = |element: ElementType, fine: usize| {
        let mut meshes = [
            block(element, [4 * fine, 4 * fine, 2 * fine], SIZE),
            half(element, [2 * fine, 4 * fine, 2 * fine], false),
            half(element, [2 * fine, 3 * fine, fine], true),
        ];
        meshes.iter_mut().for_each(|mesh| map_nodes(mesh, bulge));
        let [whole, root, tip] = meshes;
        let halves = omega2(&bonded(&root, &tip, true));
        let off = largest_difference(&halves, &omega2(&one_piece(&whole)));
        println!("{element:?} {fine}: {off:.1e}");
        off
    };
    for element in QUADRATIC {
        let [coarse, fine] = [1, 2].map(|fine| off(element, fine));
        assert!(fine < 5e-3 && fine < 0.3 * coarse, "{element:?}");
    }
}

// ------------------------------------------------------------------------------ faces of a sector

const SECTORS: usize = 12;

/// Sector of a ring, whose lines through the thickness are graded differently at its two faces if
/// `uneven` says so.
fn sector(element: ElementType, cells: [usize; 3], inner_m: f64, uneven: bool) -> (Assembly, Mesh) {
    let mut mesh = block(element, cells, [1.0; 3]);
    map_nodes(&mut mesh, |[u, v, w]| {
        let grade = if uneven { 0.4 * (v - 0.5) } else { 0.0 };
        // The line half way stays.
        let (u, w) = (
            u + grade * u * (1.0 - u) * (1.0 - 2.0 * u),
            w - grade * w * (1.0 - w),
        );
        let (r, angle) = (
            inner_m + 0.06 * u,
            v * std::f64::consts::TAU / SECTORS as f64,
        );
        [0.02 * w, r * angle.cos(), r * angle.sin()]
    });
    rename(&mut mesh, &[("volume", "ring")]);
    let mut ring = assembly(vec![body("ring", &["x_min"])], Vec::new(), "corner_111");
    ring.rotation = None;
    ring.cyclic = Some(CyclicSpec {
        sectors: SECTORS,
        low: vec!["y_min".into()],
        high: vec!["y_max".into()],
        point_m: [0.0; 3],
        axis: [1.0, 0.0, 0.0],
        engine_order: 0,
        influence: None,
    });
    ring.bodies[0].matrices = Material {
        young_pa: 2.1e11,
        poisson: 0.3,
        density_kg_m3: 7800.0,
    }
    .into();
    (ring, mesh)
}

#[test]
fn a_sector_with_unequal_faces_is_the_sector_with_equal_ones() {
    for element in QUADRATIC {
        let pair = [false, true].map(|uneven| sector(element, [6, 4, 4], 0.1, uneven));
        let models = pair
            .each_ref()
            .map(|(ring, mesh)| bind(ring, mesh, None).unwrap());
        let matches = models.map(|model| model.cyclic.unwrap().matches);
        assert!(matches[0].is_empty());
        assert!(matches[1].len() == 1 && !matches[1][0].nodes_match);
        let off = largest_difference(&omega2(&pair[1]), &omega2(&pair[0]));
        println!("{element:?}: {off:.1e}");
        assert!(off < 2e-3, "{element:?}: {off:e}");
    }
}

/// A list of faces that share an edge: no node of it belongs to a contact.
#[test]
fn faces_of_one_list_may_share_an_edge() {
    let (mut ring, mut mesh) = sector(ElementType::HEX20, [6, 4, 4], 0.1, true);
    for side in ["y_min", "y_max"] {
        let all = mesh.groups.remove(side).unwrap();
        // Cells at the inner radius, and those at the outer one.
        let inner = |&f: &u32| {
            let nodes = mesh.facets.element_nodes(f as usize);
            nodes.iter().all(|&n| {
                let [_, y, z] = mesh.nodes_m[n as usize];
                y.hypot(z) < 0.1301
            })
        };
        let (near, far): (Vec<u32>, Vec<u32>) = all.elements.iter().partition(|f| inner(f));
        for (name, elements) in [("inner", near), ("outer", far)] {
            assert!(!elements.is_empty());
            let nodes = elements
                .iter()
                .flat_map(|&f| mesh.facets.element_nodes(f as usize));
            let mut nodes: Vec<u32> = nodes.copied().collect();
            nodes.sort_unstable();
            nodes.dedup();
            let mut group = all.clone();
            (group.elements, group.nodes) = (elements, nodes);
            mesh.groups.insert(format!("{side}_{name}"), group);
        }
    }
    let lists = |side: &str| {
        ["inner", "outer"]
            .map(|part| format!("{side}_{part}"))
            .to_vec()
    };
    let disc = ring.cyclic.as_mut().unwrap();
    (disc.low, disc.high) = (lists("y_min"), lists("y_max"));
    let matching = sector(ElementType::HEX20, [6, 4, 4], 0.1, false);
    let off = largest_difference(&omega2(&(ring, mesh)), &omega2(&matching));
    println!("{off:.1e}");
    assert!(off < 2e-3, "{off:e}");
}

#[test]
fn a_sector_that_reaches_the_axis_is_told_so_whether_its_faces_match_or_not() {
    for uneven in [false, true] {
        let (ring, mesh) = sector(ElementType::WEDGE15, [4, 3, 2], 0.0, uneven);
        let refused = bind(&ring, &mesh, None).err();
        assert!(
            matches!(refused, Some(ModelError::FaceOnAxis { .. })),
            "{uneven}: {refused:?}"
        );
    }
}
