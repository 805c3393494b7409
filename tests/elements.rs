//! What the finite elements must satisfy whatever the mesh: theorems and closed forms.

use dovetail::fem::elasticity::{Lame, geometric_stiffness, map_gradients, stress_at};
use dovetail::fem::quadrature::Rule;
use dovetail::fem::statics::{SolveFailure, held_displacement};
use dovetail::fem::stress::{nodal_stress, stress, von_mises};
use dovetail::fem::{BodyMatrices, FemError, assemble_body, expand_to_nodes, tet10};
use dovetail::mesh::block::{block, distort, map_nodes};
use dovetail::mesh::{ElementOrder, Mesh};
use dovetail::model::{Body, DofMap, NodeMotion, Rotation};
use dovetail::scene::{Material, Prestress};
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Par, Side};
use nalgebra_sparse::CscMatrix;

const ORDERS: [ElementOrder; 2] = [ElementOrder::Linear, ElementOrder::Quadratic];
const STEEL: Material = Material {
    young_pa: 2.1e11,
    poisson: 0.29,
    density_kg_m3: 7850.0,
};
/// No symmetric numbers: a wrong index cannot hide.
const GRADIENT: [[f64; 3]; 3] = [
    [1.3e-3, -0.4e-3, 0.7e-3],
    [0.2e-3, -0.9e-3, 1.1e-3],
    [-0.6e-3, 0.5e-3, 0.8e-3],
];
const SIZE: [f64; 3] = [0.03, 0.02, 0.015];
const SPIN: f64 = 700.0;

// Bodies -------------------------------------------------------------------------------------

fn body_of(mesh: &Mesh, material: Material, nodes: Vec<NodeMotion>, flank_nodes: usize) -> Body {
    let free = nodes
        .iter()
        .filter(|m| matches!(m, NodeMotion::Free(_)))
        .count();
    Body {
        name: "block".into(),
        material,
        rotates: true,
        fixed_interface_modes: 0,
        order: mesh.order,
        nodes_m: mesh.nodes_m.clone(),
        mesh_nodes: (0..mesh.nodes_m.len() as u32).collect(),
        node_tags: mesh.node_tags.clone(),
        tets: mesh.tets.clone(),
        tet_tags: mesh.tet_tags.clone(),
        held_dofs: Vec::new(),
        loads: Vec::new(),
        dofs: DofMap {
            nodes,
            interior_nodes: free - flank_nodes,
            flank_nodes,
            probe_nodes: 0,
        },
    }
}

/// Every node free, in the order of the mesh.
fn free_body(mesh: &Mesh) -> Body {
    let nodes = (0..mesh.nodes_m.len() as u32)
        .map(NodeMotion::Free)
        .collect();
    body_of(mesh, STEEL, nodes, 0)
}

/// The corner nodes of group `flank` are flank nodes, its mid-edge nodes tied to them.
fn body_with_flank(mesh: &Mesh, material: Material, flank: &str) -> Body {
    let mut motion: Vec<Option<NodeMotion>> = vec![None; mesh.nodes_m.len()];
    let mut corners: Vec<u32> = Vec::new();
    for &f in &mesh.groups[flank].elements {
        let facet = mesh.facet(f as usize);
        corners.extend(&facet[..3]);
        for (edge, [a, b]) in [[0, 1], [1, 2], [0, 2]].iter().enumerate() {
            if let Some(&middle) = facet.get(3 + edge) {
                motion[middle as usize] = Some(NodeMotion::Tied([facet[*a], facet[*b]]));
            }
        }
    }
    corners.sort_unstable();
    corners.dedup();
    let tied = motion.iter().flatten().count();
    let interior = mesh.nodes_m.len() - tied - corners.len();
    for (k, &corner) in corners.iter().enumerate() {
        motion[corner as usize] = Some(NodeMotion::Free((interior + k) as u32));
    }
    let mut interior_nodes = 0..interior as u32;
    let motion = motion
        .into_iter()
        .map(|m| m.unwrap_or_else(|| NodeMotion::Free(interior_nodes.next().unwrap())))
        .collect();
    body_of(mesh, material, motion, corners.len())
}

fn distorted(order: ElementOrder, cells: [usize; 3], size: [f64; 3]) -> Mesh {
    let mut mesh = block(order, cells, size);
    distort(&mut mesh, size, 0.08 * size[0] / cells[0] as f64);
    mesh
}

/// A box bent into an arc and sheared: quadratic meshes have curved edges everywhere.
fn bent(order: ElementOrder) -> Mesh {
    let mut mesh = block(order, [3, 2, 2], SIZE);
    map_nodes(&mut mesh, |p| {
        let (angle, radius) = (p[0] / 0.05, 0.05 + p[1]);
        [
            radius * angle.sin() + 0.2,
            radius * angle.cos(),
            p[2] + 3.0 * p[0] * p[1],
        ]
    });
    mesh
}

fn meshes() -> Vec<Mesh> {
    ORDERS
        .into_iter()
        .flat_map(|order| [distorted(order, [3, 3, 2], SIZE), bent(order)])
        .collect()
}

fn rotation(prestress: Prestress) -> Rotation {
    let axis = [0.36, 0.48, 0.8];
    Rotation {
        point_m: [0.01, -0.3, 0.02],
        axis,
        speed_rad_s: SPIN,
        prestress,
    }
}

// Algebra ------------------------------------------------------------------------------------

fn solve(a: &CscMatrix<f64>, b: &[f64]) -> Result<Vec<f64>, SolveFailure> {
    let triplets: Vec<_> = a
        .triplet_iter()
        .map(|(i, j, v)| Triplet::new(i, j, *v))
        .collect();
    let sparse = SparseColMat::<usize, f64>::try_new_from_triplets(a.nrows(), a.ncols(), &triplets)
        .map_err(|e| SolveFailure::Factorisation(format!("{e:?}").into()))?;
    let factor = sparse
        .sp_cholesky(Side::Lower)
        .map_err(|_| SolveFailure::NotPositiveDefinite { dof: 0 })?;
    let x = factor.solve(Mat::from_fn(b.len(), 1, |i, _| b[i]));
    Ok((0..b.len()).map(|i| x[(i, 0)]).collect())
}

fn never(_: &CscMatrix<f64>, _: &[f64]) -> Result<Vec<f64>, SolveFailure> {
    panic!("nothing to solve here")
}

fn matrices(body: &Body) -> BodyMatrices {
    assemble_body(body, None, &never).unwrap()
}

fn times(a: &CscMatrix<f64>, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; a.nrows()];
    for (i, j, v) in a.triplet_iter() {
        y[i] += v * x[j];
    }
    y
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// First `n` rows and columns.
fn dense(a: &CscMatrix<f64>, n: usize) -> Mat<f64> {
    let mut d = Mat::zeros(n, n);
    for (i, j, v) in a.triplet_iter().filter(|(i, j, _)| *i < n && *j < n) {
        d[(i, j)] = *v;
    }
    d
}

/// Ascending eigenvalues of K x = w2 M x on the first `n` unknowns.
fn eigenvalues(k: &CscMatrix<f64>, m: &CscMatrix<f64>, n: usize) -> Vec<f64> {
    use faer::linalg::triangular_solve::solve_lower_triangular_in_place as divide_by;
    let factor = dense(m, n).llt(Side::Lower).unwrap();
    let mut half = dense(k, n);
    divide_by(factor.L(), half.as_mut(), Par::Seq);
    let mut whole = half.transpose().to_owned();
    divide_by(factor.L(), whole.as_mut(), Par::Seq);
    whole.self_adjoint_eigenvalues(Side::Lower).unwrap()
}

/// A field at the free nodes of a body.
fn field(body: &Body, value: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<f64> {
    let mut x = vec![0.0; 3 * body.dofs.free_nodes()];
    for (motion, position) in body.dofs.nodes.iter().zip(&body.nodes_m) {
        if let NodeMotion::Free(n) = motion {
            x[3 * *n as usize..][..3].copy_from_slice(&value(*position));
        }
    }
    x
}

fn apply(h: [[f64; 3]; 3], x: [f64; 3]) -> [f64; 3] {
    h.map(|row| dot(&row, &x))
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Hooke's law written out: sigma = lambda tr(e) I + 2 mu e.
fn hooke(h: [[f64; 3]; 3], m: Material) -> [f64; 6] {
    let c = m.young_pa / (1.0 + m.poisson);
    let t = c * m.poisson / (1.0 - 2.0 * m.poisson) * (h[0][0] + h[1][1] + h[2][2]);
    let shear = |r: usize, s: usize| 0.5 * c * (h[r][s] + h[s][r]);
    [
        t + c * h[0][0],
        t + c * h[1][1],
        t + c * h[2][2],
        shear(0, 1),
        shear(1, 2),
        shear(0, 2),
    ]
}

// Stiffness ----------------------------------------------------------------------------------

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
    for order in ORDERS {
        let body = free_body(&distorted(order, [1, 2, 1], [0.03, 0.04, 0.05]));
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
        assert!(values[6] > 1e-4 * top, "{:?}", &values[..8]);
    }
}

#[test]
fn patch_test_on_distorted_and_curved_meshes() {
    for order in ORDERS {
        let mut curved = block(order, [3, 3, 3], SIZE);
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
        for mesh in [distorted(order, [3, 3, 3], SIZE), curved] {
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
            for (i, &dof) in inner.iter().enumerate() {
                assert!((u[(i, 0)] - exact[dof]).abs() < 1e-12 * largest(&exact));
            }
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
            (mesh.tet_count(), mesh.nodes_m.len())
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
    for order in ORDERS {
        let mesh = distorted(order, [3, 2, 2], SIZE);
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
        let rotation = rotation(Prestress::HeldFlanks);
        let all = assemble_body(&body, Some(&rotation), &solve).unwrap();
        for a in [&all.stiffness, &all.mass] {
            for (i, j, v) in a.triplet_iter() {
                assert_eq!(a.get_entry(j, i).unwrap().into_value(), *v);
            }
        }
        assert_eq!(all.stiffness.pattern(), all.mass.pattern());
    }
}

// Mass and load ------------------------------------------------------------------------------

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
    let ends = |n: usize| if n < 4 { [n, n] } else { tet10::EDGES[n - 4] };
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
    for order in ORDERS {
        let mut mesh = block(order, [1, 1, 1], [1.0; 3]);
        let nodes = order.nodes_per_tet();
        mesh.tets = (0..nodes as u32).collect();
        mesh.tet_tags.truncate(1);
        mesh.nodes_m = corners.to_vec();
        let middle = |e: [usize; 2]| [0, 1, 2].map(|d| 0.5 * (corners[e[0]][d] + corners[e[1]][d]));
        mesh.nodes_m.extend(tet10::EDGES.map(middle));
        mesh.nodes_m.truncate(nodes);
        mesh.node_tags = (1..=nodes as u64).collect();
        let all = matrices(&free_body(&mesh));
        assert!((all.total_mass_kg / (volume * STEEL.density_kg_m3) - 1.0).abs() < 1e-14);
        for a in 0..nodes {
            for b in 0..nodes {
                let m = all
                    .mass
                    .get_entry(3 * a + 1, 3 * b + 1)
                    .unwrap()
                    .into_value();
                let expected = tabulated(order, a, b) / 420.0;
                assert!((m / all.total_mass_kg - expected).abs() < 1e-15, "{a} {b}");
            }
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
                assert!((mass / all.total_mass_kg - 1.0).abs() < 1e-12);
            }
            assert!(all.load_n.iter().all(|f| *f == 0.0), "no rotation, no load");
        }
    }
    let straight = matrices(&free_body(&distorted(
        ElementOrder::Quadratic,
        [3, 3, 2],
        SIZE,
    )));
    assert!((straight.total_mass_kg / (7850.0 * 0.03 * 0.02 * 0.015) - 1.0).abs() < 1e-13);
}

#[test]
fn curved_mesh_has_the_volume_of_the_arc() {
    // Ring sector: radii 0.05 to 0.07, 0.6 rad, height 0.015; the shear along z keeps volumes.
    let exact = 0.5 * (0.07_f64.powi(2) - 0.05_f64.powi(2)) * 0.6 * 0.015 * 7850.0;
    let quadratic = matrices(&free_body(&bent(ElementOrder::Quadratic))).total_mass_kg;
    assert!(
        (quadratic / exact - 1.0).abs() < 1e-4,
        "{quadratic} {exact}"
    );
    let linear = matrices(&free_body(&bent(ElementOrder::Linear))).total_mass_kg;
    assert!((linear / exact - 1.0).abs() > 1e-3);
}

#[test]
fn centrifugal_load_has_the_resultant_and_moment_of_the_body() {
    for order in ORDERS {
        let mesh = distorted(order, [3, 2, 2], SIZE);
        for body in [free_body(&mesh), body_with_flank(&mesh, STEEL, "z_min")] {
            let rotation = rotation(Prestress::None);
            let all = assemble_body(&body, Some(&rotation), &never).unwrap();
            assert!(
                all.stiffness == matrices(&body).stiffness,
                "a load and nothing else"
            );
            let d = [0, 1, 2].map(|k| 0.5 * SIZE[k] - rotation.point_m[k]);
            let a = rotation.axis;
            let factor = SPIN * SPIN * all.total_mass_kg;
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
    let mesh = block(ElementOrder::Quadratic, [2, 2, 2], [0.02; 3]);
    let rotation = rotation(Prestress::None);
    let free = assemble_body(&free_body(&mesh), Some(&rotation), &never).unwrap();
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
    assert_eq!(held.total_mass_kg, free.total_mass_kg);
}

// Rotation -----------------------------------------------------------------------------------

/// A bar along x from radius `near_m`, spinning about z, its near end a flank.
fn bar(near_m: f64, length_m: f64, thickness_m: f64, cells: usize) -> Body {
    let size = [length_m, thickness_m, thickness_m];
    let mut mesh = block(ElementOrder::Quadratic, [cells, 1, 1], size);
    map_nodes(&mut mesh, |p| {
        [p[0] + near_m, p[1] - 0.5 * size[1], p[2] - 0.5 * size[2]]
    });
    body_with_flank(
        &mesh,
        Material {
            poisson: 0.0,
            ..STEEL
        },
        "x_min",
    )
}

fn about_z(speed_rad_s: f64, prestress: Prestress) -> Rotation {
    Rotation {
        point_m: [0.0; 3],
        axis: [0.0, 0.0, 1.0],
        speed_rad_s,
        prestress,
    }
}

#[test]
fn rotating_bar_stretches_as_the_textbook_says() {
    // E u' = rho W^2 (tip^2 - r^2) / 2 (Timoshenko, Theory of Elasticity), u = 0 at the near end.
    let (near, tip) = (0.1, 0.5);
    let body = bar(near, tip - near, 0.004, 20);
    let all = assemble_body(&body, Some(&about_z(SPIN, Prestress::None)), &never).unwrap();
    let u = held_displacement(&body, &all.stiffness, &all.load_n, &solve).unwrap();
    let c = STEEL.density_kg_m3 * SPIN * SPIN;
    let exact = |r: f64| {
        c / STEEL.young_pa * (0.5 * tip * tip * (r - near) - (r.powi(3) - near.powi(3)) / 6.0)
    };
    for (p, u) in body.nodes_m.iter().zip(&u) {
        assert!(
            (u[0] - exact(p[0])).abs() < 1e-4 * exact(tip),
            "{} {}",
            u[0],
            exact(p[0])
        );
    }
    let hub_stress = 0.5 * c * (tip * tip - near * near);
    for (p, s) in body.nodes_m.iter().zip(nodal_stress(&body, &u)) {
        if p[0] > near + 0.05 {
            let exact = 0.5 * c * (tip * tip - p[0] * p[0]);
            assert!((s[0] - exact).abs() < 5e-3 * hub_stress, "{} {exact}", s[0]);
        }
    }
}

#[test]
fn rotating_cantilever_has_the_tabulated_frequencies() {
    // Wright, Smith, Thresher, Wang, J. Appl. Mech. 49 (1982) 197: hub radius 0, uniform beam,
    // frequency and speed in units of sqrt(E I / (rho A L^4)), out of the plane of rotation. In the
    // plane the spin softening takes the square of the speed off the square of the frequency.
    let (length, thickness) = (0.5, 0.01);
    let body = bar(0.0, length, thickness, 14);
    let unit = (STEEL.young_pa * thickness * thickness / (12.0 * STEEL.density_kg_m3)).sqrt()
        / (length * length);
    let n = 3 * body.dofs.interior_nodes;
    for (speed, tabulated) in [(0.0, 3.5160), (2.0, 4.1373), (6.0, 7.3604), (12.0, 13.1702)] {
        let rotation = about_z(speed * unit, Prestress::HeldFlanks);
        let all = assemble_body(&body, Some(&rotation), &solve).unwrap();
        let w2 = eigenvalues(&all.stiffness, &all.mass, n);
        let (lag, flap) = (w2[0].sqrt() / unit, w2[1].sqrt() / unit);
        let lag_exact = (tabulated * tabulated - speed * speed).sqrt();
        println!("speed {speed}: flap {flap:.4} ({tabulated}), lag {lag:.4} ({lag_exact:.4})");
        assert!(
            (flap / tabulated - 1.0).abs() < 1e-3,
            "flap {flap} {tabulated}"
        );
        assert!(
            (lag / lag_exact - 1.0).abs() < 7e-3,
            "lag {lag} {lag_exact}"
        );
    }
}

#[test]
fn turning_the_spinning_body_about_its_axis_costs_nothing() {
    // The prestressed body is in equilibrium in the rotating frame, and so is the body turned about
    // the axis: (K + G - Omega^2 P M)(a x r) = 0 wherever no support force acts.
    for mesh in meshes() {
        let body = body_with_flank(&mesh, STEEL, "x_min");
        let mut rotation = rotation(Prestress::HeldFlanks);
        // Fast, so that the elastic rounding is small beside the softening.
        rotation.speed_rad_s = 2e4;
        let all = assemble_body(&body, Some(&rotation), &solve).unwrap();
        let turned = field(&body, |p| {
            cross(rotation.axis, [0, 1, 2].map(|k| p[k] - rotation.point_m[k]))
        });
        let force = times(&all.stiffness, &turned);
        let softening = rotation.speed_rad_s.powi(2) * largest(&times(&all.mass, &turned));
        let inner = 3 * body.dofs.interior_nodes;
        let off = largest(&force[..inner]) / softening;
        assert!(off < 1e-9, "{off:e}");
        assert!(largest(&force[inner..]) > softening, "the support pulls");
    }
}

#[test]
fn a_body_that_does_not_rotate_is_left_alone() {
    let mut body = body_with_flank(&bent(ElementOrder::Quadratic), STEEL, "x_min");
    body.rotates = false;
    let all = assemble_body(&body, Some(&rotation(Prestress::HeldFlanks)), &never).unwrap();
    assert!(all.stiffness == matrices(&body).stiffness);
    assert_eq!(largest(&all.load_n), 0.0);
}

#[test]
fn geometric_stiffness_is_the_derivative_of_the_strain_energy() {
    // Energy of Green's strain with Hooke's law. Along infinitesimal rotations v the linear strain
    // is zero, so d/ds (d2/dt2) energy(s u0 + t v) at s = t = 0 is v^T G(u0) v alone.
    let mesh = bent(ElementOrder::Quadratic);
    let x: [[f64; 3]; 10] = std::array::from_fn(|a| mesh.nodes_m[mesh.tet(7)[a] as usize]);
    let u0 = x.map(|p| {
        let u = apply(GRADIENT, p);
        [
            u[0] + 0.3 * p[1] * p[2],
            u[1] - 0.2 * p[0] * p[2],
            u[2] + 0.4 * p[0] * p[1],
        ]
    });
    let v = x.map(|p| cross([0.3, -0.5, 0.9], p));
    let lame = Lame::from(STEEL);
    let rule = Rule::degree_5();
    let energy_density = |g: &[[f64; 3]; 10], s: f64, t: f64| {
        let mut h = [[0.0; 3]; 3];
        for a in 0..10 {
            for r in 0..3 {
                for c in 0..3 {
                    h[r][c] += (s * u0[a][r] + t * v[a][r]) * g[a][c];
                }
            }
        }
        let (mut trace, mut square) = (0.0, 0.0);
        for r in 0..3 {
            for c in 0..3 {
                let product: f64 = h.iter().map(|row| row[r] * row[c]).sum();
                let strain: f64 = 0.5 * (h[r][c] + h[c][r] + product);
                square += strain * strain;
                trace += if r == c { strain } else { 0.0 };
            }
        }
        0.5 * lame.lambda_pa * trace * trace + lame.mu_pa * square
    };
    let energy = |s: f64, t: f64| -> f64 {
        let points = rule.points.iter().zip(&rule.weights);
        points
            .map(|(point, weight)| {
                let (det, g) = map_gradients(&x, &tet10::gradient(*point));
                det * weight * energy_density(&g, s, t)
            })
            .sum()
    };
    // The energy is a quartic polynomial in (s, t): central differences and one Richardson step are
    // exact but for rounding.
    let mixed = |h: f64| {
        let second = |s: f64| (energy(s, h) - 2.0 * energy(s, 0.0) + energy(s, -h)) / (h * h);
        (second(h) - second(-h)) / (2.0 * h)
    };
    let derivative = (4.0 * mixed(0.5) - mixed(1.0)) / 3.0;
    let mut g = vec![[0.0]; 100];
    geometric_stiffness(&x, &u0, &tet10::tables().stiffness_curved, lame, &mut g);
    let quadratic: f64 = (0..100)
        .map(|k| g[k][0] * dot(&v[k / 10], &v[k % 10]))
        .sum();
    assert!(
        (quadratic / derivative - 1.0).abs() < 1e-8,
        "{quadratic} {derivative}"
    );
    let (_, gradients) = map_gradients(&x, &tet10::gradient([0.25; 3]));
    assert!(
        largest(&stress_at(&gradients, &u0, lame)) > 1e7,
        "the state is stressed"
    );
}

#[test]
fn geometric_stiffness_does_not_see_the_frame() {
    let (s, c) = (0.6, 0.8);
    let turn = |p: [f64; 3]| {
        let q = [c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]];
        [q[0], c * q[1] - s * q[2], s * q[1] + c * q[2]]
    };
    let mesh = bent(ElementOrder::Quadratic);
    let x: [[f64; 3]; 10] = std::array::from_fn(|a| mesh.nodes_m[mesh.tet(3)[a] as usize]);
    let u = x.map(|p| apply(GRADIENT, p));
    let of = |x: &[[f64; 3]; 10], u: &[[f64; 3]; 10]| {
        let mut g = vec![[0.0]; 100];
        let table = tet10::tables().stiffness_curved;
        geometric_stiffness(x, u, &table, Lame::from(STEEL), &mut g);
        g.concat()
    };
    let (here, there) = (of(&x, &u), of(&x.map(turn), &u.map(turn)));
    let difference: Vec<f64> = here.iter().zip(&there).map(|(a, b)| a - b).collect();
    assert!(largest(&difference) < 1e-12 * largest(&here));
}

// Order of work, and what is refused ---------------------------------------------------------

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
        pool.install(|| assemble_body(&body, Some(&rotation), &made_up).unwrap())
    };
    let one = with_threads(1);
    for count in [2, 3] {
        let many = with_threads(count);
        assert!(one.stiffness == many.stiffness && one.mass == many.mass);
        assert!(one.load_n == many.load_n);
        assert_eq!(one.total_mass_kg.to_bits(), many.total_mass_kg.to_bits());
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
        let [a, b] = [body.tet(3)[0] as usize, body.tet(3)[1] as usize];
        body.nodes_m[a] = body.nodes_m[b];
        for tet in body
            .tets
            .chunks_exact(order.nodes_per_tet())
            .map(|t| t.to_vec())
        {
            for (edge, ends) in tet10::EDGES.iter().enumerate() {
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
    let body = free_body(&block(ElementOrder::Linear, [2, 1, 1], [0.02; 3]));
    let rotation = rotation(Prestress::HeldFlanks);
    let error = assemble_body(&body, Some(&rotation), &solve).unwrap_err();
    assert!(matches!(error, FemError::LooselyHeld { .. }), "{error:?}");
    assert!(error.to_string().contains("`fixed`"), "{error}");
}

#[test]
fn a_body_that_flies_apart_is_unstable_and_says_so() {
    // A bar held at its outer end is compressed by the rotation: it buckles.
    let mesh = block(ElementOrder::Quadratic, [10, 1, 1], [0.5, 0.01, 0.01]);
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
