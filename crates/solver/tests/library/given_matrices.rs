//! Bodies whose matrices come from another program: here from the elements that they replace, so
//! that the two have the same answers.

use std::sync::Arc;

use faer::Mat;
use faer::linalg::solvers::Solve;
use nalgebra_sparse::{CooMatrix, CscMatrix};

use crate::shared_bodies::{assembly, body, ready};
use crate::shared_scenes::{FEW_MODES, blocks_assembly};
use dovetail_mesh::parts::Placement;
use dovetail_mesh::units::Units;
use dovetail_mesh::{Connectivity, ElementType, Mesh};
use dovetail_numerics::eigen::dense::modes;
use dovetail_numerics::sparse::{dense, submatrix};
use dovetail_solver::fem::mass_properties::mass_properties;
use dovetail_solver::fem::{assemble, assemble_body, given, statics};
use dovetail_solver::model::gather::gather;
use dovetail_solver::model::{
    Assembly, BodyMesh, BodySpec, ExcitationKind, GivenMatrices, LoadKind, LoadSpec, MatricesError,
    MatrixOrigin, MatrixSource, Model, ModelError, Row, SpringSpec, bind,
};
use dovetail_solver::reduction::{
    analyse, reduce, reduce_analysed, stuck_displacement, stuck_shapes,
};
use dovetail_solver::structure::{BodyMatrices, Structure};
use dovetail_testkit::block::{block, distort};
use dovetail_testkit::words::has;

const SI: Units = Units::MetreKilogramSecond;

/// Matrices of a body alone, of all its free nodes, and their rows.
fn alone(spec: &BodySpec, mesh: &Mesh) -> (CscMatrix<f64>, CscMatrix<f64>, Vec<Row>) {
    let alone = Assembly {
        bodies: vec![spec.clone()],
        ..Assembly::default()
    };
    let model = bind(&alone, mesh, None).unwrap();
    let body = &model.bodies[0];
    let matrices = assemble_body(body, None, &statics::solve_by_cholesky).unwrap();
    let rows = body.free_node_tags().into_iter();
    let rows = rows.flat_map(|node| [1, 2, 3].map(|direction| Row::Node { node, direction }));
    (matrices.stiffness, matrices.mass, rows.collect())
}

/// Matrix with rows and columns in this order.
fn reordered(a: &CscMatrix<f64>, order: &[usize]) -> CscMatrix<f64> {
    let mut place = vec![0; order.len()];
    for (new, &old) in order.iter().enumerate() {
        place[old] = new;
    }
    let mut coo = CooMatrix::new(a.nrows(), a.ncols());
    for (i, j, v) in a.triplet_iter() {
        coo.push(place[i], place[j], *v);
    }
    CscMatrix::from(&coo)
}

/// Body with the matrices of its elements in their place, its rows from last to first.
fn given(spec: &BodySpec, mesh: &Mesh) -> BodySpec {
    let (stiffness, mass, rows) = alone(spec, mesh);
    let order: Vec<usize> = (0..rows.len()).rev().collect();
    let matrices = GivenMatrices::new(
        reordered(&stiffness, &order),
        reordered(&mass, &order),
        order.iter().map(|&row| rows[row]).collect(),
        SI,
    );
    BodySpec {
        matrices: MatrixSource::Given(Arc::new(matrices.unwrap())),
        ..spec.clone()
    }
}

#[track_caller]
fn assert_same(found: &BodyMatrices, expected: &BodyMatrices, inside: usize) {
    for (what, found, expected) in [
        ("stiffness", &found.stiffness, &expected.stiffness),
        ("mass", &found.mass, &expected.mass),
    ] {
        let largest = expected.values().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (i, j, v) in (found - expected).triplet_iter() {
            let is_held = |dof: usize| found.get_entry(dof, dof).is_none();
            assert!(
                v.abs() <= 1e-12 * largest || is_held(i),
                "{what} ({i}, {j}): {v:e}"
            );
        }
    }
    let largest = expected.load_n.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for (found, expected) in found.load_n.iter().zip(&expected.load_n) {
        assert!((found - expected).abs() <= 1e-12 * largest);
    }
    assert_eq!(found.interior_nodes, inside);
}

fn bind_and_assemble(assembly: &Assembly, mesh: &Mesh) -> (Model, Structure) {
    let model = bind(assembly, mesh, None).unwrap();
    let structure = assemble(&model).unwrap();
    (model, structure)
}

fn both_given(plain: &Assembly, mesh: &Mesh) -> Assembly {
    Assembly {
        bodies: plain.bodies.iter().map(|spec| given(spec, mesh)).collect(),
        ..plain.clone()
    }
}

fn resting_assembly() -> Assembly {
    Assembly {
        rotation: None,
        ..blocks_assembly()
    }
}

/// The rows of the lower body lack its support, and mid-edge nodes of the flanks are tied.
#[test]
fn matrices_of_the_elements_give_the_structure_of_the_elements() {
    let mut plain = resting_assembly();
    let spring = |name: &str, first: &str, second: Option<&str>| SpringSpec {
        name: name.into(),
        first: first.into(),
        second: second.map(str::to_owned),
        stiffness_n_m: 3e7,
        direction: Some([0.6, 0.0, 0.8]),
    };
    plain.springs = vec![
        spring("foot", "lower_top", None),
        spring("link", "upper_bottom", Some("lower_top")),
    ];
    plain.excitations[0].kind = ExcitationKind::Base {
        direction: [0.0, 0.6, 0.8],
        motion: dovetail_solver::model::BaseMotion::Acceleration,
    };
    for name in ["blocks_order1.msh", "blocks_order2.msh"] {
        let mesh = ready(name);
        let (model, expected) = bind_and_assemble(&plain, &mesh);
        let (given_model, found) = bind_and_assemble(&both_given(&plain, &mesh), &mesh);
        assert_eq!(given_model.pairs, model.pairs);
        for (found, expected) in found.bodies.iter().zip(&expected.bodies) {
            assert_same(found, expected, expected.interior_nodes);
        }
        // The upper body is free: all of its mass is in its rows. Of the lower one the mass that is
        // coupled to its support is not.
        let load = |structure: &Structure| structure.excitations[0][0].clone();
        let (found, expected) = (load(&found), load(&expected));
        let largest = expected.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-12 * largest);
        }
    }
}

#[test]
fn mass_centre_and_free_motions_are_those_of_the_body() {
    let mesh = ready("blocks_order2.msh");
    let plain = bind(&resting_assembly(), &mesh, None).unwrap();
    let model = bind(&both_given(&resting_assembly(), &mesh), &mesh, None).unwrap();
    let expected = mass_properties(&plain.bodies[0], None).unwrap();
    let found = mass_properties(&model.bodies[0], None).unwrap();
    assert!((found.mass_kg / expected.mass_kg - 1.0).abs() < 1e-12);
    for k in 0..3 {
        assert!((found.centre_m.unwrap()[k] - expected.centre_m.unwrap()[k]).abs() < 1e-15);
    }
    assert_eq!(found.volume_m3, None);
    let free = model.bodies.iter().map(|body| match &body.matrices {
        MatrixOrigin::Given(placed) => given::free_rigid_motions(body, placed).count,
        MatrixOrigin::Elements(_) => panic!("{} has elements", body.name),
    });
    assert_eq!(free.collect::<Vec<_>>(), [6, 0], "the lower body is held");
}

#[test]
fn a_load_on_the_rows_acts_where_a_load_of_the_scene_does() {
    let mesh = ready("blocks_order2.msh");
    let force_n = [3.0, -2.0, 0.5];
    let mut plain = resting_assembly();
    plain.loads = vec![LoadSpec {
        on: "corner".into(),
        load: LoadKind::Force { vector_n: force_n },
    }];
    let (_, expected) = bind_and_assemble(&plain, &mesh);
    let corner = mesh.node_tags[mesh.groups["corner"].nodes[0] as usize];
    let (stiffness, mass, rows) = alone(&plain.bodies[0], &mesh);
    let load_n = rows.iter().map(|row| match row {
        Row::Node { node, direction } if *node == corner => force_n[usize::from(*direction) - 1],
        _ => 0.0,
    });
    let load_n: Vec<f64> = load_n.collect();
    let mut with = resting_assembly();
    let given = GivenMatrices::new(stiffness, mass, rows, SI).unwrap();
    let given = given.with_load(load_n).unwrap();
    with.bodies[0].matrices = MatrixSource::Given(Arc::new(given));
    let (_, found) = bind_and_assemble(&with, &mesh);
    assert!(expected.bodies[0].load_n.iter().any(|f| *f != 0.0));
    assert_eq!(found.bodies[0].load_n, expected.bodies[0].load_n);
}

/// Unknowns of the inside without nodes, mixed and scaled, as they are in a superelement.
#[test]
fn the_inside_of_a_body_may_be_generalised_coordinates() {
    let mesh = ready("blocks_order1.msh");
    let plain = resting_assembly();
    let (model, structure) = bind_and_assemble(&plain, &mesh);
    let expected = reduce(&structure, FEW_MODES).unwrap().model;
    let mut with = plain.clone();
    for (spec, body) in with.bodies.iter_mut().zip(&model.bodies) {
        let (stiffness, mass, mut rows) = alone(spec, &mesh);
        // Nodes of the contact, and the corner that is shaken and observed, keep their rows.
        let kept: Vec<u64> = body.free_node_tags()[body.dofs.interior_nodes..].to_vec();
        let corner = &mesh.groups["corner"].nodes;
        let is_kept = |node: u64| {
            kept.contains(&node) || corner.iter().any(|&n| mesh.node_tags[n as usize] == node)
        };
        let n = rows.len();
        let mut mix = CooMatrix::new(n, n);
        let mut before = None;
        for (at, row) in rows.iter_mut().enumerate() {
            match *row {
                Row::Node { node, .. } if is_kept(node) => mix.push(at, at, 1.0),
                _ => {
                    *row = Row::Generalised;
                    mix.push(at, at, 1e3);
                    if let Some(before) = before.replace(at) {
                        mix.push(at, before, 300.0);
                    }
                }
            }
        }
        let mix = CscMatrix::from(&mix);
        let mixed = |a: &CscMatrix<f64>| &mix.transpose() * &(a * &mix);
        let given = GivenMatrices::new(mixed(&stiffness), mixed(&mass), rows, SI).unwrap();
        spec.matrices = MatrixSource::Given(Arc::new(given));
    }
    let (_, structure) = bind_and_assemble(&with, &mesh);
    let found = reduce(&structure, FEW_MODES).unwrap().model;
    for (found, expected) in found.omega2.iter().zip(&expected.omega2) {
        assert!((found / expected - 1.0).abs() < 1e-8, "{found} {expected}");
    }
    let largest = expected.stiffness.norm_max();
    assert!((&found.stiffness - &expected.stiffness).norm_max() < 1e-9 * largest);
}

/// Craig-Bampton matrices of other programs: the stiffness is diagonal on the modes, and the mass couples
/// modes and nodes that the stiffness does not.
#[test]
fn superelements_of_nodes_and_modes_have_the_answers_of_their_bodies() {
    let mesh = ready("blocks_order1.msh");
    let plain = resting_assembly();
    let (model, structure) = bind_and_assemble(&plain, &mesh);
    let expected = reduce(&structure, FEW_MODES).unwrap().model;
    let mut with = plain.clone();
    for (spec, body) in with.bodies.iter_mut().zip(&model.bodies) {
        let (stiffness, mass, rows) = alone(spec, &mesh);
        let kept: Vec<u64> = body.free_node_tags()[body.dofs.interior_nodes..].to_vec();
        let corner = &mesh.groups["corner"].nodes;
        let is_kept = |row: &Row| match *row {
            Row::Node { node, .. } => {
                kept.contains(&node) || corner.iter().any(|&n| mesh.node_tags[n as usize] == node)
            }
            Row::Generalised => false,
        };
        let (outer, inner): (Vec<usize>, Vec<usize>) =
            (0..rows.len()).partition(|&at| is_kept(&rows[at]));
        let part = |a: &CscMatrix<f64>, rows: &[usize], columns: &[usize]| {
            dense(&submatrix(a, rows, columns))
        };
        let k_ii = part(&stiffness, &inner, &inner);
        let modes = modes(k_ii.as_ref(), part(&mass, &inner, &inner).as_ref()).unwrap();
        let psi = -k_ii
            .partial_piv_lu()
            .solve(part(&stiffness, &inner, &outer));
        // Columns: modes, then nodes.
        let t = Mat::from_fn(rows.len(), rows.len(), |i, j| {
            let place = |list: &[usize]| list.iter().position(|&at| at == i);
            match (place(&inner), j.checked_sub(inner.len())) {
                (Some(i), None) => modes.vectors[(i, j)],
                (Some(i), Some(j)) => psi[(i, j)],
                (None, Some(j)) => f64::from(u8::from(place(&outer) == Some(j))),
                (None, None) => 0.0,
            }
        });
        let congruent = |a: &CscMatrix<f64>| t.transpose() * (dense(a) * &t);
        let (k, m) = (congruent(&stiffness), congruent(&mass));
        let is_entry = |i: usize, j: usize| i == j || i.min(j) >= inner.len();
        let entries = |a: &Mat<f64>, is_entry: &dyn Fn(usize, usize) -> bool| {
            let mut coo = CooMatrix::new(a.nrows(), a.ncols());
            for (i, j) in (0..a.nrows()).flat_map(|i| (0..a.ncols()).map(move |j| (i, j))) {
                if is_entry(i, j) {
                    coo.push(i, j, 0.5 * (a[(i, j)] + a[(j, i)]));
                }
            }
            CscMatrix::from(&coo)
        };
        let generalised = inner.iter().map(|_| Row::Generalised);
        let rows = generalised
            .chain(outer.iter().map(|&at| rows[at]))
            .collect();
        let is_mass = |i: usize, j: usize| i == j || i.max(j) >= inner.len();
        let (k, m) = (entries(&k, &is_entry), entries(&m, &is_mass));
        spec.matrices = MatrixSource::Given(Arc::new(GivenMatrices::new(k, m, rows, SI).unwrap()));
    }
    let (_, structure) = bind_and_assemble(&with, &mesh);
    let analysis = analyse(&structure.bodies, &structure.joints);
    let (found_omega2, _) = stuck_shapes(&structure, 10, analysis.as_ref()).unwrap();
    let [still, analysed] =
        [None, analysis.as_ref()].map(|analysis| stuck_displacement(&structure, analysis).unwrap());
    for (found, expected) in analysed.iter().flatten().zip(still.iter().flatten()) {
        assert!((found - expected).abs() < 1e-9 * expected.abs().max(1e-9));
    }
    for alone in [false, true] {
        let mut structure = structure.clone();
        for body in &mut structure.bodies {
            body.fixed_interface_modes = alone.then_some(1000);
        }
        let analysis = analyse(&structure.bodies, &structure.joints);
        assert_eq!(analysis.is_none(), alone);
        let found = reduce_analysed(&structure, FEW_MODES, analysis.as_ref());
        let found = found.unwrap().model;
        let omega2 = found.stuck_omega2().iter().zip(&found_omega2);
        let omega2 = omega2.zip(expected.stuck_omega2());
        for ((found, stuck), expected) in omega2 {
            assert!((found / expected - 1.0).abs() < 1e-8, "{found} {expected}");
            assert!((stuck / expected - 1.0).abs() < 1e-8, "{stuck} {expected}");
        }
        for (found, expected) in [
            (&found.stiffness, &expected.stiffness),
            (&found.mass, &expected.mass),
        ] {
            assert!((found - expected).norm_max() < 1e-8 * expected.norm_max());
        }
    }
}

/// The mesh without its elements: the nodes of its flanks and of the corner, and the facets of the
/// flanks, counter-clockwise seen from outside.
fn surfaces_of(mesh: &Mesh) -> Mesh {
    let mut surfaces = mesh.clone();
    surfaces.elements = Connectivity::default();
    surfaces.facets = Connectivity::default();
    for (name, upwards) in [("upper_bottom", false), ("lower_top", true)] {
        let group = surfaces.groups.get_mut(name).unwrap();
        for f in &mut group.elements {
            let mut nodes = mesh.facets.element_nodes(*f as usize).to_vec();
            let [a, b, c] = [0, 1, 2].map(|k| mesh.nodes_m[nodes[k] as usize]);
            let [p, q] = [b, c].map(|x| [x[0] - a[0], x[1] - a[1]]);
            if (p[0] * q[1] - p[1] * q[0] > 0.0) != upwards {
                assert_eq!(nodes.len(), 3);
                nodes.swap(1, 2);
            }
            let tag = mesh.facets.tags()[*f as usize];
            *f = surfaces.facets.len() as u32;
            surfaces.facets.push(tag, nodes);
        }
    }
    let kept = ["upper_bottom", "lower_top", "corner"].map(|name| mesh.groups[name].nodes.clone());
    let kept = kept.concat();
    for body in ["upper", "lower"] {
        let group = surfaces.groups.get_mut(body).unwrap();
        group.elements.clear();
        group.nodes.retain(|n| kept.contains(n));
    }
    surfaces
}

/// The inside of a superelement has no nodes in the mesh, and the surfaces are all of it.
#[test]
fn surfaces_are_enough_for_a_body_with_matrices() {
    let mesh = ready("blocks_order1.msh");
    let (plain, surfaces) = (resting_assembly(), surfaces_of(&mesh));
    let (model, structure) = bind_and_assemble(&plain, &mesh);
    let expected = reduce(&structure, FEW_MODES).unwrap().model;
    let mut with = both_given(&plain, &mesh);
    with.bodies[1].fixed.clear();
    let (found_model, structure) = bind_and_assemble(&with, &surfaces);
    let found = reduce(&structure, FEW_MODES).unwrap().model;
    let from_least = |model: &Model| -> Vec<Vec<u32>> {
        let turned = |facet: &Vec<u32>| {
            let least = (0..3).min_by_key(|&k| facet[k]).unwrap();
            (0..3).map(|k| facet[(least + k) % 3]).collect()
        };
        model.flank_facets.iter().map(turned).collect()
    };
    assert_eq!(from_least(&found_model), from_least(&model));
    for (found, expected) in found_model.pairs.iter().zip(&model.pairs) {
        assert_eq!(found.frame, expected.frame);
        assert!((found.area_m2 / expected.area_m2 - 1.0).abs() < 1e-12);
    }
    for (found, expected) in found.omega2.iter().zip(&expected.omega2) {
        assert!((found / expected - 1.0).abs() < 1e-8, "{found} {expected}");
    }
    let largest = expected.stiffness.norm_max();
    assert!((&found.stiffness - &expected.stiffness).norm_max() < 1e-9 * largest);
    // A set of nodes takes the facets between them.
    let mut sets = surfaces.clone();
    for name in ["upper_bottom", "lower_top"] {
        let group = sets.groups.get_mut(name).unwrap();
        group.dimension = 0;
        group.elements.clear();
    }
    assert_eq!(bind_and_assemble(&with, &sets).0.pairs, found_model.pairs);

    let refused = |assembly: &Assembly, mesh: &Mesh, words: &str| {
        let error = bind(assembly, mesh, None).unwrap_err().to_string();
        has(&error, words);
    };
    refused(
        &plain,
        &surfaces,
        "`upper` & no solid elements & stiffness_file",
    );
    let mut inwards = surfaces.clone();
    let facets = std::mem::take(&mut inwards.facets);
    for (nodes, &tag) in facets.iter().zip(facets.tags()) {
        let is_upper = inwards.groups["upper"].nodes.contains(&nodes[0]);
        let order = if is_upper { [0, 2, 1] } else { [0, 1, 2] };
        inwards.facets.push(tag, order.map(|k| nodes[k]));
    }
    refused(
        &with,
        &inwards,
        "do not face each other & counter-clockwise",
    );
}

/// Two copies of a skewed block on its side, one of them turned twice.
#[test]
fn matrices_of_a_turned_body_are_turned_with_it() {
    let mut mesh = block(ElementType::HEX20, [2, 2, 2], [1e-3; 3]);
    distort(&mut mesh, [1e-3; 3], 0.05e-3);
    let placement = |angle_rad, translation_m| Placement {
        axis: [1.0, 2.0, -0.5],
        point_m: [0.3e-3, 0.0, 0.0],
        angle_rad,
        translation_m,
    };
    let first = BodySpec {
        volume: "volume".into(),
        mesh: BodyMesh::File {
            path: "block.msh".into(),
            units: SI,
            placement: placement(0.7, [0.0; 3]),
        },
        ..body("first", &[])
    };
    let copy = BodySpec {
        name: "copy".into(),
        mesh: BodyMesh::CopyOf {
            body: "first".into(),
            placement: placement(-1.9, [0.01, 0.0, 0.0]),
        },
        fixed: vec!["x_min".into()],
        ..first.clone()
    };
    let mut plain = assembly(vec![first.clone(), copy], vec![], "first.corner_111");
    plain.rotation = None;
    plain.observations.clear();
    let matrices = {
        let spec = BodySpec {
            mesh: BodyMesh::Shared,
            ..first
        };
        given(&spec, &mesh).matrices
    };
    let mut with = plain.clone();
    for body in &mut with.bodies {
        body.matrices = matrices.clone();
    }
    let mut read = |_: &std::path::Path, _| Ok::<_, ModelError>(mesh.clone());
    let whole = gather(&plain, None, &mut read).unwrap();
    let (_, expected) = bind_and_assemble(&plain, &whole);
    let (_, found) = bind_and_assemble(&with, &whole);
    for (found, expected) in found.bodies.iter().zip(&expected.bodies) {
        assert_same(found, expected, expected.interior_nodes);
    }
}

#[test]
fn matrices_that_are_not_those_of_a_body_are_refused() {
    let matrix = |entries: &[(usize, usize, f64)]| {
        let mut coo = CooMatrix::new(2, 2);
        entries.iter().for_each(|&(i, j, v)| coo.push(i, j, v));
        CscMatrix::from(&coo)
    };
    let node = |direction| Row::Node { node: 7, direction };
    let good = matrix(&[(0, 0, 2.0), (1, 1, 2.0), (0, 1, -1.0), (1, 0, -1.0)]);
    let refused = |k: &CscMatrix<f64>, m: &CscMatrix<f64>, rows: &[Row]| -> MatricesError {
        GivenMatrices::new(k.clone(), m.clone(), rows.to_vec(), SI).unwrap_err()
    };
    let rows = [node(1), node(2)];
    let text = refused(&good, &good, &rows[..1]).to_string();
    has(&text, "2 rows & the mass 2 & table of rows 1");
    let lower = matrix(&[(0, 0, 2.0), (1, 1, 2.0), (1, 0, -1.0)]);
    let text = refused(&lower, &good, &rows).to_string();
    has(&text, "stiffness & not symmetric & (1, 2)");
    let text = refused(&good, &matrix(&[(0, 0, -1.0)]), &rows).to_string();
    has(&text, "diagonal of the mass & exchanged");
    let text = refused(&good, &matrix(&[(1, 1, f64::NAN)]), &rows).to_string();
    has(&text, "(2, 2) of the mass & not a finite number");
    let text = refused(&good, &good, &[node(3), node(3)]).to_string();
    has(&text, "rows 1 and 2 & direction 3 of node 7");
    let wide = CscMatrix::from(&CooMatrix::<f64>::new(2, 3));
    let text = refused(&wide, &good, &rows).to_string();
    has(&text, "2 x 3 & square");
    let made = || GivenMatrices::new(good.clone(), good.clone(), rows.to_vec(), SI).unwrap();
    let text = made().with_load(vec![0.0; 3]).unwrap_err().to_string();
    has(&text, "3 values & 2 rows");
    let text = made()
        .with_load(vec![0.0, f64::INFINITY])
        .unwrap_err()
        .to_string();
    has(&text, "value 2 & not a finite number");
    // Rounding of a file is not asymmetry, and the two sides are made alike.
    let rounded = matrix(&[(0, 0, 2.0), (1, 1, 2.0), (0, 1, -1.0), (1, 0, -1.0 - 1e-12)]);
    let mm = Units::MillimetreTonneSecond;
    let made = GivenMatrices::new(rounded, good.clone(), rows.to_vec(), mm).unwrap();
    let entry = |i, j| made.stiffness().get_entry(i, j).unwrap().into_value();
    assert_eq!(entry(0, 1), entry(1, 0));
    assert_eq!(entry(0, 0), 2e3, "N/mm");
    assert!(
        (made.mass().get_entry(0, 0).unwrap().into_value() - 2e3).abs() < 1e-9,
        "t"
    );
}

#[test]
fn matrices_that_do_not_belong_to_the_mesh_are_refused() {
    let mesh = ready("blocks_order1.msh");
    let plain = resting_assembly();
    let refused = |assembly: &Assembly, mesh: &Mesh, words: &str| {
        let error = bind(assembly, mesh, None).unwrap_err().to_string();
        has(&error, words);
    };
    let (stiffness, mass, rows) = alone(&plain.bodies[0], &mesh);
    let with = |rows: Vec<Row>| {
        let mut with = plain.clone();
        let given = GivenMatrices::new(stiffness.clone(), mass.clone(), rows, SI).unwrap();
        with.bodies[0].matrices = MatrixSource::Given(Arc::new(given));
        with
    };
    let far = rows.iter().map(|row| match *row {
        Row::Node { node, direction } => Row::Node {
            node: node + 100_000,
            direction,
        },
        Row::Generalised => Row::Generalised,
    });
    refused(
        &with(far.collect()),
        &mesh,
        "`upper` & none of the & rows_file",
    );
    let mut turning = with(rows.clone());
    turning.rotation = blocks_assembly().rotation;
    refused(&turning, &mesh, "`upper` & no stress & [rotation]");
    let mut twice = mesh.clone();
    let upper = &mesh.groups["upper"].nodes;
    twice.node_tags[upper[1] as usize] = twice.node_tags[upper[0] as usize];
    refused(&with(rows.clone()), &twice, "`upper` & two nodes");
    let unread = {
        let file = dovetail_solver::model::MatrixFile {
            path: "upper.mtx".into(),
            name: None,
        };
        let mut unread = plain.clone();
        unread.bodies[0].matrices = MatrixSource::Files(dovetail_solver::model::MatrixFiles {
            stiffness: file.clone(),
            mass: file,
            rows: None,
            load: None,
            units: SI,
        });
        unread
    };
    refused(&unread, &mesh, "`upper` & upper.mtx & were not read");
    // A node of the flank without a row does not move, and cannot be in contact.
    let bottom = mesh.groups["upper_bottom"].nodes[0];
    let tag = mesh.node_tags[bottom as usize];
    let lost = rows.iter().map(|row| match *row {
        Row::Node { node, .. } if node == tag => Row::Generalised,
        other => other,
    });
    refused(
        &with(lost.collect()),
        &mesh,
        "contact `c` & 1 nodes & `upper` & no row",
    );
}
