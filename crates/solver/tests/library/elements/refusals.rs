//! Order of work, and refused inputs.

use dovetail_mesh::{Connectivity, ElementOrder, ElementType};
use dovetail_solver::fem::mass_properties::mass_properties;
use dovetail_solver::fem::{FemError, assemble_body};
use dovetail_solver::model::BodyPrestress;
use dovetail_solver::model::{Body, NodeMotion};
use dovetail_testkit::block::block;
use dovetail_testkit::block::straighten;
use dovetail_testkit::threads::run_on_threads;
use dovetail_testkit::words::has;
use nalgebra_sparse::CscMatrix;

use super::algebra::*;
use super::bodies::*;
use super::rotation::rotation_about_z;

#[test]
fn the_number_of_threads_changes_no_bit() {
    // More elements than one chunk of the assembly.
    let mesh = distorted(
        Filling::Mixed(ElementOrder::Quadratic),
        [11, 6, 6],
        [0.03; 3],
    );
    assert!(mesh.elements.len() > 1024);
    let body = body_with_flank(&mesh, STEEL, "x_min");
    let rotation = rotation(BodyPrestress::HeldFlanks);
    let made_up = |_: &CscMatrix<f64>, b: &[f64]| {
        Ok((0..b.len())
            .map(|i| 1e-6 * (i as f64).sin())
            .collect::<Vec<f64>>())
    };
    let with_threads = |count: usize| {
        run_on_threads(count, || {
            let matrices = assemble_body(&body, Some(&rotation), &made_up).unwrap();
            let own = mass_properties(&body, None).unwrap();
            (matrices, own.mass_kg)
        })
    };
    let (one, one_kg) = with_threads(1);
    for count in [2, 3] {
        let (many, many_kg) = with_threads(count);
        assert!(one.stiffness == many.stiffness && one.mass == many.mass);
        assert!(one.load_n == many.load_n);
        assert_eq!(one_kg.to_bits(), many_kg.to_bits());
    }
}

#[test]
fn bad_elements_and_nodes_are_named_by_their_tags() {
    for filling in fillings() {
        let mut mesh = filling.block([2, 1, 1], [1.0; 3]);
        let mut tagged = Connectivity::default();
        for (nodes, tag) in mesh.elements.iter().zip(101..) {
            tagged.push(tag, nodes.iter().copied());
        }
        mesh.elements = tagged;
        let refused = |body: &Body| assemble_body(body, None, &never).unwrap_err();

        // The mirrored body is inside out everywhere.
        let mut mirrored = mesh.clone();
        mirrored.nodes_m.iter_mut().for_each(|x| x[2] = -x[2]);
        match refused(&free_body(&mirrored)) {
            FemError::Inverted { tags, .. } => assert_eq!(tags.0, mesh.elements.tags()),
            other => panic!("{other:?}"),
        }

        // All of the last element in one plane.
        let mut flat = mesh.clone();
        let last = flat.elements.len() - 1;
        for &n in flat.elements.element_nodes(last) {
            flat.nodes_m[n as usize][1] = 0.25;
        }
        straighten(&mut flat);
        match refused(&free_body(&flat)) {
            FemError::Degenerate { tags, .. } => assert!(tags.0.contains(&(101 + last as u64))),
            other => panic!("{other:?}"),
        }

        let mut body = free_body(&mesh);
        body.nodes_m.push([9.0; 3]);
        body.node_tags.push(777);
        body.dofs
            .nodes
            .push(NodeMotion::Free(body.dofs.interior_nodes as u32));
        body.dofs.interior_nodes += 1;
        has(&refused(&body).to_string(), "777 & no element");

        let mut body = free_body(&mesh);
        body.nodes_m[0] = [f64::NAN; 3];
        assert!(matches!(refused(&body), FemError::Degenerate { .. }));
    }
}

#[test]
fn a_body_held_by_nothing_is_an_error_not_a_nan() {
    let body = free_body(&block(ElementType::TET4, [2, 1, 1], [0.02; 3]));
    let rotation = rotation(BodyPrestress::HeldFlanks);
    let error = assemble_body(&body, Some(&rotation), &solve).unwrap_err();
    assert!(matches!(error, FemError::LooselyHeld { .. }), "{error:?}");
    assert!(error.to_string().contains("support"), "{error}");
}

#[test]
fn a_bar_held_at_its_outer_end_buckles_at_a_speed() {
    // The rotation compresses it.
    let mesh = block(ElementType::TET10, [10, 1, 1], [0.5, 0.01, 0.01]);
    let body = body_with_flank(&mesh, STEEL, "x_max");
    let n = 3 * body.dofs.interior_nodes;
    let first = |speed: f64| {
        let rotation = rotation_about_z(speed, BodyPrestress::HeldFlanks);
        let all = assemble_body(&body, Some(&rotation), &solve).unwrap();
        eigenvalues(&all.stiffness, &all.mass, n)[0]
    };
    assert!(first(50.0) > 0.0);
    assert!(first(1000.0) < 0.0);
}
