//! Order of work, and what is refused.

use dovetail_solver::fem::mass_properties::mass_properties;
use dovetail_solver::fem::{FemError, assemble_body};
use dovetail_solver::mesh::block::block;
use dovetail_solver::mesh::{ElementOrder, TET_EDGES};
use dovetail_solver::model::Prestress;
use dovetail_solver::model::{Body, NodeMotion};
use nalgebra_sparse::CscMatrix;

use super::algebra::*;
use super::bodies::*;
use super::rotation::about_z;

#[test]
fn the_number_of_threads_changes_no_bit() {
    // More elements than one chunk of the assembly.
    let mesh = distorted(ElementOrder::Quadratic, [6, 5, 4], [0.03; 3]);
    let body = body_with_flank(&mesh, STEEL, "x_min");
    let rotation = rotation(Prestress::HeldFlanks);
    let made_up = |_: &CscMatrix<f64>, b: &[f64]| {
        Ok((0..b.len())
            .map(|i| 1e-6 * (i as f64).sin())
            .collect::<Vec<f64>>())
    };
    let with_threads = |count: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build()
            .unwrap();
        pool.install(|| {
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
    for order in ORDERS {
        let mut mesh = block(order, [2, 1, 1], [1.0; 3]);
        mesh.tet_tags.iter_mut().for_each(|t| *t += 100);
        let refused = |body: &Body| assemble_body(body, None, &never).unwrap_err();

        let mut body = free_body(&mesh);
        // Corners 0 and 1 change places, and with them edges 12-02 and 03-13.
        for (a, b) in [(0, 1), (5, 6), (7, 9)] {
            if b < order.nodes_per_tet() {
                body.tets.swap(a, b);
            }
        }
        match refused(&body) {
            FemError::Inverted { tags, .. } => assert_eq!(tags.0, [101]),
            other => panic!("{other:?}"),
        }

        let mut body = free_body(&mesh);
        let [a, b] = [
            body.elements.of(3)[0] as usize,
            body.elements.of(3)[1] as usize,
        ];
        body.nodes_m[a] = body.nodes_m[b];
        for tet in body
            .tets
            .chunks_exact(order.nodes_per_tet())
            .map(|t| t.to_vec())
        {
            for (edge, ends) in TET_EDGES.iter().enumerate() {
                if let Some(&middle) = tet.get(4 + edge) {
                    let [a, b] = ends.map(|v| body.nodes_m[tet[v] as usize]);
                    body.nodes_m[middle as usize] = [0, 1, 2].map(|k| 0.5 * (a[k] + b[k]));
                }
            }
        }
        match refused(&body) {
            FemError::Degenerate { tags, .. } => assert!(tags.0.contains(&104)),
            other => panic!("{other:?}"),
        }

        let mut body = free_body(&mesh);
        body.nodes_m.push([9.0; 3]);
        body.node_tags.push(777);
        body.dofs
            .nodes
            .push(NodeMotion::Free(body.dofs.interior_nodes as u32));
        body.dofs.interior_nodes += 1;
        let message = refused(&body).to_string();
        assert!(
            message.contains("777") && message.contains("no tetrahedron"),
            "{message}"
        );

        let mut body = free_body(&mesh);
        body.nodes_m[0] = [f64::NAN; 3];
        assert!(matches!(refused(&body), FemError::Degenerate { .. }));
    }
}

#[test]
fn a_body_held_by_nothing_is_an_error_not_a_nan() {
    let body = free_body(&block(ElementType::TET4, [2, 1, 1], [0.02; 3]));
    let rotation = rotation(Prestress::HeldFlanks);
    let error = assemble_body(&body, Some(&rotation), &solve).unwrap_err();
    assert!(matches!(error, FemError::LooselyHeld { .. }), "{error:?}");
    assert!(error.to_string().contains("`fixed`"), "{error}");
}

#[test]
fn a_body_that_flies_apart_is_unstable_and_says_so() {
    // A bar held at its outer end is compressed by the rotation: it buckles.
    let mesh = block(ElementType::TET10, [10, 1, 1], [0.5, 0.01, 0.01]);
    let body = body_with_flank(&mesh, STEEL, "x_max");
    let n = 3 * body.dofs.interior_nodes;
    let first = |speed: f64| {
        let rotation = about_z(speed, Prestress::HeldFlanks);
        let all = assemble_body(&body, Some(&rotation), &solve).unwrap();
        eigenvalues(&all.stiffness, &all.mass, n)[0]
    };
    assert!(first(50.0) > 0.0);
    assert!(first(1000.0) < 0.0);
    let rotation = about_z(1000.0, Prestress::HeldFlanks);
    let message = FemError::not_positive_definite(&body, Some(&rotation), 0).to_string();
    assert!(message.contains("9549 rpm"), "{message}");
    let still = FemError::not_positive_definite(&body, None, 0);
    assert!(matches!(still, FemError::LooselyHeld { .. }));
}
