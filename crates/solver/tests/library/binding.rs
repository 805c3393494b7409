//! Binding of real meshes to scenes: pairs, frames, areas, degrees of freedom, and the messages
//! where they do not match.

use std::collections::{BTreeMap, BTreeSet};

use crate::shared_dovetail::{check_dovetail, dovetail_assembly};
use crate::shared_scenes::*;
use dovetail_mesh::{Connectivity, ElementType, Mesh, quality};
use dovetail_solver::contact::PairLaw;
use dovetail_solver::model::{
    AppliedLoad, Assembly, BodyNode, BodyPrestress, ContactLaw, ContactSpec, ExcitationKind, Gap,
};
use dovetail_solver::model::{Model, ModelError, NodeMotion, Side, bind};
use dovetail_testkit::block::{block, map_nodes, straighten};
use dovetail_testkit::words::has;

// --------------------------------------------------------------------------- binding a scene

#[test]
fn the_dovetail_has_72_pairs_at_45_degrees() {
    for name in ["dovetail.msh", "dovetail_order1.msh"] {
        let model = bind(&dovetail_assembly(), &ready(name), None).unwrap();
        check_dovetail(&model, 4, 9);
        let [blade, jaw] = &model.bodies[..] else {
            panic!("two bodies")
        };
        assert!(blade.rotates && !jaw.rotates);
        assert!(blade.dofs.nodes.iter().all(|m| *m != NodeMotion::Fixed));
        let fixed = jaw
            .dofs
            .nodes
            .iter()
            .zip(&jaw.nodes_m)
            .filter(|(m, _)| **m == NodeMotion::Fixed);
        for (_, x) in fixed.clone() {
            let t = x[1] * 25f64.to_radians().cos() - x[0] * 25f64.to_radians().sin();
            assert!((t.abs() - 22e-3).abs() < 1e-9 || (x[2] - (0.4325 - 13.2e-3)).abs() < 1e-9);
        }
        assert!(fixed.count() > 100);
        // One node is forced and watched: top of the leading edge.
        assert_eq!(
            (model.excitations.len(), model.observations[0].terms.len()),
            (1, 1)
        );
        assert_eq!(model.excitations[0].in_time.amplitude, 6.0);
        let [(body, AppliedLoad::Point { node, vector_n })] = model.excitations[0].loads[..] else {
            panic!("{:?}", model.excitations[0]);
        };
        assert_eq!(vector_n, [0.0, 1.0, 0.0]);
        assert_eq!(model.observations[0].terms[0].1, [0.0, 0.6, 0.8]);
        assert_eq!(body, 0);
        assert!((blade.nodes_m[node as usize][2] - 0.54).abs() < 1e-12);
        assert!(blade.dofs.free(node).unwrap() < blade.dofs.interior_nodes);
    }
}

/// Mesh with nodes and elements in another order and facets turned over.
fn renumbered(mesh: &Mesh) -> Mesh {
    let shuffle = |n: usize| -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        let mut state = 88_172_645_463_325_252_u64;
        for i in (1..n).rev() {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            order.swap(i, (state % (i as u64 + 1)) as usize);
        }
        order
    };
    let inverse = |order: &[usize]| -> Vec<u32> {
        let mut new = vec![0; order.len()];
        for (i, &old) in order.iter().enumerate() {
            new[old] = i as u32;
        }
        new
    };
    let (nodes, tets, facets) = (
        shuffle(mesh.nodes_m.len()),
        shuffle(mesh.elements.len()),
        shuffle(mesh.facets.len()),
    );
    let (new_node, new_tet, new_facet) = (inverse(&nodes), inverse(&tets), inverse(&facets));
    let mut groups = mesh.groups.clone();
    for group in groups.values_mut() {
        let new = if group.dimension == 3 {
            &new_tet
        } else {
            &new_facet
        };
        for e in &mut group.elements {
            *e = new[*e as usize];
        }
        for n in &mut group.nodes {
            *n = new_node[*n as usize];
        }
        group.nodes.sort_unstable();
    }
    let turned = |f: usize| {
        let mut n = mesh.facets.element_nodes(f).to_vec();
        n.swap(1, 2);
        if n.len() == 6 {
            n.swap(3, 5);
        }
        n.into_iter().map(|n| new_node[n as usize])
    };
    let mut elements = Connectivity::default();
    for &e in &tets {
        let nodes = mesh.elements.element_nodes(e).iter();
        elements.push(
            mesh.elements.tags()[e],
            nodes.map(|&n| new_node[n as usize]),
        );
    }
    let mut new_facets = Connectivity::default();
    for &f in &facets {
        new_facets.push(mesh.facets.tags()[f], turned(f));
    }
    Mesh {
        nodes_m: nodes.iter().map(|&i| mesh.nodes_m[i]).collect(),
        node_tags: nodes.iter().map(|&i| mesh.node_tags[i]).collect(),
        elements,
        facets: new_facets,
        groups,
        ..Mesh::default()
    }
}

#[test]
fn numbering_and_facet_orientation_change_nothing() {
    let mesh = ready("dovetail.msh");
    let plain = bind(&dovetail_assembly(), &mesh, None).unwrap();
    let other = bind(&dovetail_assembly(), &renumbered(&mesh), None).unwrap();
    check_dovetail(&other, 4, 9);
    for (p, q) in plain.pairs.iter().zip(&other.pairs) {
        let tag = |m: &Model, at: BodyNode| m.bodies[at.body].node_tags[at.node as usize];
        assert_eq!(tag(&plain, p.slave.node), tag(&other, q.slave.node));
        assert_eq!(
            tag(&plain, p.slave.partner().unwrap()),
            tag(&other, q.slave.partner().unwrap())
        );
        for k in 0..3 {
            assert_vector(p.frame[k], q.frame[k], 1e-12);
        }
        assert!((p.area_m2 / q.area_m2 - 1.0).abs() < 1e-12);
    }
    let sorted = |m: &Model| {
        let mut t = m.flank_facets.clone();
        t.iter_mut().for_each(|t| t.sort_unstable());
        t.sort_unstable();
        t
    };
    assert_eq!(sorted(&plain), sorted(&other));
}

#[test]
fn bodies_named_the_other_way_round_have_the_opposite_normals() {
    let mesh = ready("dovetail_order1.msh");
    let plain = bind(&dovetail_assembly(), &mesh, None).unwrap();
    let mut assembly = dovetail_assembly();
    assembly.bodies.reverse();
    for c in &mut assembly.contacts {
        let second = c.second.replace(c.first.clone());
        c.first = second.unwrap();
    }
    let other = bind(&assembly, &mesh, None).unwrap();
    let by_place: BTreeMap<[i64; 3], _> = other
        .pairs
        .iter()
        .map(|p| (p.position_m.map(|x| (x * 1e9).round() as i64), p))
        .collect();
    for p in &plain.pairs {
        let q = by_place[&p.position_m.map(|x| (x * 1e9).round() as i64)];
        assert_vector(q.frame[0], p.frame[0].map(|c| -c), 1e-12);
        assert_vector(q.frame[1], p.frame[1], 1e-12);
        assert!((p.area_m2 / q.area_m2 - 1.0).abs() < 1e-12);
    }
}

#[test]
fn flanks_that_miss_each_other_are_an_error_with_the_place() {
    let shifted = |by: f64| {
        let mut mesh = ready("dovetail_order1.msh");
        for n in mesh.groups["jaw"].nodes.clone() {
            mesh.nodes_m[n as usize][2] += by;
        }
        mesh
    };
    // Half a longest edge is some 3 mm here, and the flanks stand at 45 degrees.
    let error = bind(&dovetail_assembly(), &shifted(5e-3), None).unwrap_err();
    let ModelError::NoneOpposite {
        contact,
        nearest: Some((_, distance_m)),
        ..
    } = &error
    else {
        panic!("{error}");
    };
    assert_eq!(contact, "left");
    assert!(
        (distance_m - 5e-3 * 0.5f64.sqrt()).abs() < 1e-9,
        "{distance_m}"
    );
    assert!(error.to_string().contains("search_distance_m"));
    // 2 mm of it are 1.4 mm between the flanks, and 5 mm are 3.5 mm.
    let within = |search_distance_m| {
        let mut assembly = dovetail_assembly();
        for contact in &mut assembly.contacts {
            contact.search_distance_m = Some(search_distance_m);
        }
        assembly
    };
    let error = bind(&within(1.4e-3), &shifted(2e-3), None).unwrap_err();
    assert!(matches!(error, ModelError::NoneOpposite { .. }), "{error}");
    assert!(bind(&within(1.5e-3), &shifted(2e-3), None).is_ok());
    let mut assembly = within(1e-2);
    let model = bind(&assembly, &shifted(5e-3), None).unwrap();
    for found in &model.matches {
        let apart_m = found.largest_separation_m;
        assert!((apart_m - 5e-3 * 0.5f64.sqrt()).abs() < 1e-9, "{apart_m}");
    }
    // Along the flank's normal the two lie askew: they cover each other in part.
    let model = bind(&assembly, &shifted(2e-3), None).unwrap();
    for found in &model.matches {
        for covered in found.covered {
            assert!((0.5..0.9).contains(&covered), "{found:?}");
        }
        assert!(!found.nodes_match, "{found:?}");
    }
    // Clearance counts the distance where the scene asks for it.
    for contact in &mut assembly.contacts {
        contact.gap = Gap::Mesh;
        contact.pair_law.gap_m = 1e-6;
    }
    let model = bind(&assembly, &shifted(2e-3), None).unwrap();
    for pair in &model.pairs {
        let expected = 2e-3 * 0.5f64.sqrt() + 1e-6;
        assert!((pair.law.gap_m - expected).abs() < 1e-12, "{pair:?}");
    }
}

#[test]
fn a_clearance_and_a_friction_of_their_own_for_each_contact() {
    let mut assembly = dovetail_assembly();
    assembly.contacts[1].pair_law = PairLaw::rigid(0.0, 2e-6);
    let model = bind(&assembly, &ready("dovetail_order1.msh"), None).unwrap();
    for (number, pair) in model.pairs.iter().enumerate() {
        assert_eq!(pair.law, assembly.contacts[number / 36].pair_law);
    }
}

#[test]
fn at_rest_nothing_is_stressed_by_rotation() {
    let mut assembly = dovetail_assembly();
    assembly.rotation.as_mut().unwrap().speed_rad_s = 0.0;
    let model = bind(&assembly, &ready("dovetail_order1.msh"), None).unwrap();
    let rotation = model.rotation.unwrap();
    assert_eq!(rotation.speed_rad_s, 0.0);
    assert_eq!(rotation.prestress, BodyPrestress::None);
    assert!(!rotation.prestress_of_contact);
    // A load path may come by a speed.
    assert!(model.bodies[0].rotates && !model.bodies[1].rotates);
    assembly.rotation = None;
    let model = bind(&assembly, &ready("dovetail_order1.msh"), None).unwrap();
    assert!(model.rotation.is_none() && !model.bodies[0].rotates);
}

#[test]
fn groups_of_several_nodes_share_the_force() {
    let mut assembly = blocks_assembly();
    assembly.excitations[0].kind = ExcitationKind::force("rim", [0.0, 1.0, 0.0]);
    assembly.observations[0].points = "upper_bottom".into();
    let model = bind(&assembly, &ready("blocks_order2.msh"), None).unwrap();
    assert_eq!(model.pairs.len(), 9);
    let force = &model.excitations[0];
    let on_node = |(_, load): &(usize, AppliedLoad)| match load {
        AppliedLoad::Point { vector_n, .. } => force.in_time.amplitude * vector_n[1],
        other => panic!("{other:?}"),
    };
    let forces: Vec<f64> = force.loads.iter().map(on_node).collect();
    assert_eq!(forces, [6.0 * 0.2; 5]);
    // The flank as observed group: 9 pair nodes and 16 tied ones.
    let terms = &model.observations[0].terms;
    assert_eq!(terms.len(), 25);
    let d = &model.bodies[0].dofs;
    assert_eq!(d.contact_nodes, 9);
    let total: f64 = terms
        .iter()
        .flat_map(|(at, v)| d.weights(at.node as usize).map(move |(_, w)| w * v[2]))
        .sum();
    assert!((total - 0.8).abs() < 1e-14, "{total}");
}

#[test]
fn what_the_mesh_lacks_is_named_with_what_it_has() {
    let mesh = ready("dovetail_order1.msh");
    let error = |edit: &dyn Fn(&mut Assembly)| {
        let mut assembly = dovetail_assembly();
        edit(&mut assembly);
        let error = bind(&assembly, &mesh, None).unwrap_err();
        println!("{error}");
        error
    };
    let e = error(&|s| s.bodies[0].volume = "blad".into());
    assert!(e.to_string().ends_with("volume groups it has: blade, jaw"));
    let e = error(&|s| s.bodies[0].volume = "blade_tip".into());
    assert!(matches!(
        e,
        ModelError::GroupDimension {
            found: "surface",
            ..
        }
    ));
    let e = error(&|s| s.contacts[0].first = "flank".into());
    has(&e.to_string(), "blade_flank_left, blade_flank_right");
    let e = error(&|s| {
        s.excitations[0].kind = ExcitationKind::force("tip", [0.0, 1.0, 0.0]);
    });
    assert!(e.to_string().contains("excitation, jaw"));
    let e = error(&|s| s.bodies[1].fixed = vec!["blade_tip".into()]);
    assert!(matches!(e, ModelError::FixedElsewhere { .. }));
    let e = error(&|s| s.bodies[1].volume = "blade".into());
    assert!(matches!(e, ModelError::SharedNodes { .. }));
    let e = error(&|s| s.bodies.clear());
    assert!(matches!(e, ModelError::NoBody));
    let e = error(&|s| s.bodies.truncate(1));
    assert!(matches!(e, ModelError::NodesElsewhere { count: 36, .. }));
    let e = error(&|s| s.rotation.as_mut().unwrap().bodies = vec!["disc".into()]);
    assert!(matches!(e, ModelError::UnknownBody { .. }));
    let e = error(&|s| s.contacts[1] = contact("again", "blade_flank_left", "jaw_flank_left"));
    assert!(matches!(e, ModelError::SlaveTwice { count: 36, .. }));
    let e = error(&|s| {
        for c in &mut s.contacts {
            c.slave = Some(Side::Second);
        }
        s.bodies[1].fixed.push("jaw_flank_left".into());
    });
    assert!(matches!(e, ModelError::FlankFixed { count: 36, .. }));
    let e = error(&|s| s.bodies[0].fixed = vec!["blade_tip".into()]);
    assert!(matches!(e, ModelError::NodesFixed { count: 1, .. }));
    let e = error(&|s| s.contacts[0].second = Some("jaw_flank_right".into()));
    assert!(matches!(
        e,
        ModelError::NoneOpposite { .. } | ModelError::NotFacing { .. }
    ));
    let e = error(&|s| s.contacts[0].second = Some("blade_flank_right".into()));
    assert!(matches!(
        e,
        ModelError::NoneOpposite { .. } | ModelError::NotFacing { .. }
    ));
}

#[test]
fn two_cubes_are_bound_with_areas_of_a_quarter_cell() {
    for name in ["blocks_order1.msh", "blocks_order2.msh"] {
        let model = bind(&blocks_assembly(), &ready(name), None).unwrap();
        assert_eq!(model.pairs.len(), 9);
        for pair in &model.pairs {
            assert_vector(pair.frame[0], [0.0, 0.0, 1.0], 1e-14);
        }
        let total: f64 = model.pairs.iter().map(|p| p.area_m2).sum();
        assert!((total - 1e-6).abs() < 1e-18);
    }
}

// -------------------------------------------------------------------- bonded flanks, rigid ground

fn bonded(mut spec: ContactSpec) -> ContactSpec {
    spec.law = ContactLaw::Bonded;
    spec
}

#[test]
fn a_body_alone_stands_on_rigid_ground() {
    let mut assembly = blocks_assembly();
    assembly.bodies.truncate(1);
    assembly.contacts[0].second = None;
    let two = bind(&blocks_assembly(), &ready("blocks_order2.msh"), None).unwrap();
    let one = bind(&assembly, &ready("blocks_order2.msh"), None).unwrap();
    assert_eq!((one.bodies.len(), two.bodies.len()), (1, 2));
    assert_eq!(one.bodies[0].dofs, two.bodies[0].dofs);
    assert_eq!(one.flank_facets, two.flank_facets);
    assert_eq!(one.pairs.len(), 9);
    for (one, two) in one.pairs.iter().zip(&two.pairs) {
        assert_eq!(
            (one.slave.node, one.slave.partner()),
            (two.slave.node, None)
        );
        assert!(one.slave.masters.is_empty());
        assert!(two.slave.partner().is_some());
        assert_eq!(one.position_m, two.position_m);
        assert!((one.area_m2 - two.area_m2).abs() < 1e-15);
        for (a, b) in one.frame.iter().zip(two.frame) {
            assert_vector(*a, b, 1e-14);
        }
    }
    assert_eq!(one.largest_mismatch_m(), 0.0);
    // Bonded to the ground its flank is fixed, mid-edge nodes too.
    assembly.contacts = vec![bonded(assembly.contacts.remove(0))];
    let held = bind(&assembly, &ready("blocks_order2.msh"), None).unwrap();
    assert!(held.pairs.is_empty() && held.bonded.is_empty() && held.contact_names.is_empty());
    let fixed = |m: &&NodeMotion| **m == NodeMotion::Fixed;
    assert_eq!(held.bodies[0].dofs.nodes.iter().filter(fixed).count(), 25);
    let free = |model: &dovetail_solver::model::Model| model.bodies[0].dofs.free_nodes();
    assert_eq!(free(&held), free(&one) - 9);
}

#[test]
fn bonded_nodes_come_after_the_pairs_in_both_bodies() {
    let mesh = ready("dovetail_order1.msh");
    let mut assembly = dovetail_assembly();
    let plain = bind(&assembly, &mesh, None).unwrap();
    assembly.contacts[0] = bonded(assembly.contacts[0].clone());
    let model = bind(&assembly, &mesh, None).unwrap();
    assert_eq!((model.pairs.len(), model.bonded.len()), (36, 36));
    assert_eq!(model.contact_names, ["right"]);
    assert!(model.pairs.iter().all(|p| p.contact == 0));
    assert_eq!(model.flank_facets.len(), plain.flank_facets.len() / 2);
    for b in 0..2 {
        let dofs = &model.bodies[b].dofs;
        assert_eq!(dofs.contact_nodes, 72);
        let pairs = model.pairs.iter().map(|p| &p.slave);
        for (i, slave) in pairs.chain(&model.bonded).enumerate() {
            let nodes = [slave.node, slave.partner().unwrap()];
            assert_eq!(nodes[b].body, b);
            assert_eq!(dofs.free(nodes[b].node), Some(dofs.interior_nodes + i));
        }
    }
    for slave in &model.bonded {
        let [blade, jaw] = [slave.node, slave.partner().unwrap()]
            .map(|at| model.bodies[at.body].nodes_m[at.node as usize]);
        assert!(distance(blade, jaw) < 1e-9);
    }
}

/// Mesh with the nodes of each surface as a set of nodes, as in decks.
fn add_node_sets(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    for name in ["upper_bottom", "lower_top"] {
        let group = mesh.groups.get_mut(name).unwrap();
        (group.dimension, group.elements) = (0, Vec::new());
    }
    mesh
}

#[test]
fn a_set_of_nodes_serves_as_a_surface_where_all_nodes_of_a_face_are_in_it() {
    for name in ["blocks_order1.msh", "blocks_order2.msh"] {
        let mesh = ready(name);
        let (plain, sets) = (
            bind(&blocks_assembly(), &mesh, None).unwrap(),
            bind(&blocks_assembly(), &add_node_sets(&mesh), None).unwrap(),
        );
        assert_eq!(plain.pairs.len(), sets.pairs.len());
        for (p, q) in plain.pairs.iter().zip(&sets.pairs) {
            assert_eq!(&p.slave, &q.slave);
            assert!((p.area_m2 / q.area_m2 - 1.0).abs() < 1e-12);
        }
        for (p, q) in plain.bodies.iter().zip(&sets.bodies) {
            assert_eq!(p.dofs, q.dofs);
        }
        let facets = |model: &Model| -> BTreeSet<BTreeSet<u32>> {
            let sets = model.flank_facets.iter();
            sets.map(|f| f.iter().copied().collect()).collect()
        };
        assert_eq!(facets(&plain), facets(&sets));
    }
}

#[test]
fn a_set_that_has_no_whole_face_is_named_with_what_it_lacks() {
    // The corners of the faces alone, in a quadratic mesh: no face has its middles.
    let mut mesh = add_node_sets(&ready("blocks_order2.msh"));
    let linear = ready("blocks_order1.msh");
    let corners = &linear.groups["upper_bottom"].nodes;
    let places: Vec<[f64; 3]> = corners
        .iter()
        .map(|&n| linear.nodes_m[n as usize])
        .collect();
    let nodes_m = mesh.nodes_m.clone();
    let group = mesh.groups.get_mut("upper_bottom").unwrap();
    let is_corner = |n: &u32| {
        places
            .iter()
            .any(|p| distance(*p, nodes_m[*n as usize]) < 1e-9)
    };
    group.nodes.retain(is_corner);
    assert_eq!(group.nodes.len(), 9);
    let error = bind(&blocks_assembly(), &mesh, None).unwrap_err();
    assert!(
        matches!(error, ModelError::NoFaces { nodes: 9, .. }),
        "{error}"
    );
    let words = "contact `c`: `upper_bottom` is a set of 9 nodes";
    has(&error.to_string(), words);
}

/// Quadrilaterals have the weights of their bilinear functions, and all their edges tie the middle.
#[test]
fn flanks_of_quadrilaterals_have_the_areas_of_their_shape_functions() {
    let size = [3e-3, 2e-3, 1e-3];
    for element in [ElementType::HEX8, ElementType::HEX20] {
        let mut upper = block(element, [3, 2, 1], size);
        map_nodes(&mut upper, |[x, y, z]| [x + 0.2 * y * y / size[1], y, z]);
        let mut lower = upper.clone();
        map_nodes(&mut lower, |[x, y, z]| [x, y, z - size[2]]);
        straighten(&mut upper);
        straighten(&mut lower);
        let both = two_blocks(&upper, &lower);
        quality::check(&both).unwrap();
        let model = bind(&blocks_assembly(), &both, None).unwrap();
        assert_eq!((model.pairs.len(), model.flank_facets.len()), (12, 6));
        assert!(model.flank_facets.iter().all(|facet| facet.len() == 4));
        // Columns of trapezia between straight lines: the area of the strip of each row.
        let total: f64 = model.pairs.iter().map(|p| p.area_m2).sum();
        assert!(
            (total / (size[0] * size[1]) - 1.0).abs() < 1e-12,
            "{total:e}"
        );
        let tied = model.bodies[0].dofs.nodes.iter();
        let tied = tied.filter(|m| matches!(m, NodeMotion::Tied(_))).count();
        let edges = 3 * 3 + 4 * 2;
        assert_eq!(
            tied,
            if element == ElementType::HEX20 {
                edges
            } else {
                0
            }
        );
        for facet in &model.flank_facets {
            let [a, b, c] = [0, 1, 2].map(|k| &model.pairs[facet[k] as usize]);
            let normal = cross(
                sub(b.position_m, a.position_m),
                sub(c.position_m, a.position_m),
            );
            assert!(dot(normal, a.frame[0]) > 0.0, "seen from the blade");
        }
    }
}
