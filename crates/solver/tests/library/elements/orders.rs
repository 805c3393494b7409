//! Decrease of the error with the mesh: manufactured solutions, and a block whose modes are known.
//!
//! Elements of order p: the displacement converges with h^(p+1) in L2, with h^p in energy, squared
//! frequencies with h^(2p). Errors are integrated by a product rule that is exact to degree 7; the
//! assembly's go to degree 6 at most.

use std::collections::BTreeMap;

use dovetail_mesh::interpolation::element_functions;
use dovetail_mesh::{ElementOrder, ElementType, Mesh, Shape};
use dovetail_numerics::eigen::lowest_modes;
use dovetail_numerics::sparse::{Cholesky, submatrix};
use dovetail_solver::fem::elasticity::Lame;
use dovetail_solver::model::{Material, MatrixOrigin};
use dovetail_testkit::block::{FACES, distort, map_nodes};

use super::algebra::*;
use super::bodies::*;

/// Cells of a block of [`SIZE`], which are cubes.
const CELLS: [usize; 3] = [6, 4, 3];

// The solution ---------------------------------------------------------------------------------

/// `amplitude sin(k . x + phase)`: a solution of Navier's equations under the body force
/// `((lambda + mu) (a . k) k + mu k^2 a) sin(k . x + phase)`.
struct Wave {
    amplitude: [f64; 3],
    k: [f64; 3],
    phase: f64,
}

const WAVES: [Wave; 2] = [
    Wave {
        amplitude: [1.0e-5, -0.4e-5, 0.7e-5],
        k: [70.0, 95.0, -60.0],
        phase: 0.3,
    },
    Wave {
        amplitude: [-0.3e-5, 0.8e-5, 0.5e-5],
        k: [-50.0, 40.0, 120.0],
        phase: 1.1,
    },
];

fn displacement(x: [f64; 3]) -> [f64; 3] {
    let mut u = [0.0; 3];
    for wave in &WAVES {
        let s = (dot(&wave.k, &x) + wave.phase).sin();
        (0..3).for_each(|r| u[r] += wave.amplitude[r] * s);
    }
    u
}

/// Row r, column c: the derivative of component r along axis c.
fn gradient(x: [f64; 3]) -> [[f64; 3]; 3] {
    let mut h = [[0.0; 3]; 3];
    for wave in &WAVES {
        let c = (dot(&wave.k, &x) + wave.phase).cos();
        for (row, a) in h.iter_mut().zip(wave.amplitude) {
            (0..3).for_each(|s| row[s] += a * wave.k[s] * c);
        }
    }
    h
}

fn body_force(x: [f64; 3]) -> [f64; 3] {
    let Lame { lambda_pa, mu_pa } = Lame::from(STEEL);
    let mut f = [0.0; 3];
    for Wave {
        amplitude,
        k,
        phase,
    } in &WAVES
    {
        let s = (dot(k, &x) + phase).sin();
        let along = (lambda_pa + mu_pa) * dot(amplitude, k);
        (0..3).for_each(|r| f[r] += (along * k[r] + mu_pa * dot(k, k) * amplitude[r]) * s);
    }
    f
}

// Quadrature -----------------------------------------------------------------------------------

/// The five-point Gauss-Legendre rule in each direction of a cube, folded for tetrahedra (Stroud's
/// conical product), and folded across for wedges: exact to degree 7 and more.
fn rich_rule(shape: Shape) -> Vec<([f64; 3], f64)> {
    let [inner, outer] =
        [-1.0, 1.0].map(|s: f64| (5.0 + s * 2.0 * (10.0_f64 / 7.0).sqrt()).sqrt() / 3.0);
    let [heavy, light] = [1.0, -1.0].map(|s: f64| (322.0 + s * 13.0 * 70.0_f64.sqrt()) / 900.0);
    let line = [
        (0.0, 128.0 / 225.0),
        (-inner, heavy),
        (inner, heavy),
        (-outer, light),
        (outer, light),
    ];
    let half = line.map(|(x, w)| (0.5 + 0.5 * x, 0.5 * w));
    let mut points = Vec::new();
    for i in 0..5 {
        for j in 0..5 {
            for k in 0..5 {
                points.push(match shape {
                    Shape::Tetrahedron => {
                        let [(x, wx), (y, wy), (z, wz)] = [half[i], half[j], half[k]];
                        let point = [x, (1.0 - x) * y, (1.0 - x) * (1.0 - y) * z];
                        (point, wx * wy * wz * (1.0 - x).powi(2) * (1.0 - y))
                    }
                    Shape::Wedge => {
                        let [(x, wx), (y, wy), (z, wz)] = [half[i], half[j], line[k]];
                        ([x, (1.0 - x) * y, z], wx * wy * wz * (1.0 - x))
                    }
                    Shape::Pyramid | Shape::Hexahedron => {
                        let [(x, wx), (y, wy), (z, wz)] = [line[i], line[j], line[k]];
                        ([x, y, z], wx * wy * wz)
                    }
                });
            }
        }
    }
    points
}

#[test]
fn the_rule_of_the_errors_is_exact_to_degree_7() {
    let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
    let line = |n: i32| {
        if n % 2 == 0 {
            2.0 / f64::from(n + 1)
        } else {
            0.0
        }
    };
    for (i, j, k) in [
        (0, 0, 0),
        (7, 0, 0),
        (0, 7, 0),
        (0, 0, 7),
        (2, 3, 2),
        (1, 2, 4),
    ] {
        for shape in Shape::ALL {
            let exact = match shape {
                Shape::Tetrahedron => {
                    factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3)
                }
                Shape::Wedge => factorial(i) * factorial(j) / factorial(i + j + 2) * line(k),
                Shape::Pyramid | Shape::Hexahedron => line(i) * line(j) * line(k),
            };
            let sum: f64 = rich_rule(shape)
                .iter()
                .map(|(p, w)| w * p[0].powi(i) * p[1].powi(j) * p[2].powi(k))
                .sum();
            assert!(
                (sum - exact).abs() < 1e-14,
                "{shape:?} {i} {j} {k}: {sum} {exact}"
            );
        }
    }
}

/// Point of an element.
struct At<'a> {
    nodes: &'a [u32],
    /// Share of the volume.
    dv: f64,
    /// Shape functions, and their gradients in space.
    values: &'a [f64],
    gradients: Vec<[f64; 3]>,
    x: [f64; 3],
}

/// Calls `visit` at all points of all elements.
fn visit_points(mesh: &Mesh, mut visit: impl FnMut(&At<'_>)) {
    type Tabulated = Vec<(Vec<f64>, Vec<[f64; 3]>, f64)>;
    let mut rules: BTreeMap<ElementType, Tabulated> = BTreeMap::new();
    for element in mesh.elements.types().into_keys() {
        let at = |(p, w): ([f64; 3], f64)| {
            let functions = element_functions(element, p);
            let values = functions.iter().map(|n| n.value).collect();
            (values, functions.iter().map(|n| n.gradient).collect(), w)
        };
        let rule = rich_rule(element.shape).into_iter().map(at).collect();
        rules.insert(element, rule);
    }
    for nodes in mesh.elements.iter() {
        let coords: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.nodes_m[n as usize]).collect();
        for (values, reference, w) in &rules[&ElementType::from_node_count(nodes.len()).unwrap()] {
            let mut j = [[0.0; 3]; 3];
            let mut x = [0.0; 3];
            for ((p, g), n) in coords.iter().zip(reference).zip(values) {
                for r in 0..3 {
                    x[r] += n * p[r];
                    (0..3).for_each(|c| j[r][c] += p[r] * g[c]);
                }
            }
            let cofactor = [cross(j[1], j[2]), cross(j[2], j[0]), cross(j[0], j[1])];
            let det = dot(&j[0], &cofactor[0]);
            let in_space = |g: &[f64; 3]| cofactor.map(|row| dot(&row, g) / det);
            visit(&At {
                nodes,
                dv: det * w,
                values,
                gradients: reference.iter().map(in_space).collect(),
                x,
            });
        }
    }
}

// Errors ---------------------------------------------------------------------------------------

/// Relative errors in L2 and in energy, with the displacement given all over the surface. (For the
/// hexahedron of eight nodes it is that of the interpolated displacement, without the incompatible
/// modes.)
fn errors_of(mesh: &Mesh) -> [f64; 2] {
    let body = free_body(mesh);
    let k = matrices(&body).stiffness;
    let mut load = vec![0.0; k.nrows()];
    visit_points(mesh, |at| {
        let f = body_force(at.x);
        for (&node, n) in at.nodes.iter().zip(at.values) {
            (0..3).for_each(|r| load[3 * node as usize + r] += at.dv * n * f[r]);
        }
    });
    let mut on_surface = vec![false; mesh.nodes_m.len()];
    for face in FACES.concat() {
        for &n in &mesh.groups[face].nodes {
            on_surface[n as usize] = true;
        }
    }
    let mut u = field(&body, displacement);
    solve_inside(&k, &load, |dof| on_surface[dof / 3], &mut u);

    let energy_density = |h: [[f64; 3]; 3]| {
        let stress = hooke(h, STEEL);
        let strain = [
            h[0][0],
            h[1][1],
            h[2][2],
            h[0][1] + h[1][0],
            h[1][2] + h[2][1],
            h[0][2] + h[2][0],
        ];
        dot(&stress, &strain)
    };
    let (mut off, mut all) = ([0.0; 2], [0.0; 2]);
    visit_points(mesh, |at| {
        let (exact, exact_gradient) = (displacement(at.x), gradient(at.x));
        let (mut d, mut h) = (exact.map(|u| -u), exact_gradient.map(|row| row.map(|v| -v)));
        for ((&node, n), g) in at.nodes.iter().zip(at.values).zip(&at.gradients) {
            for r in 0..3 {
                let value = u[3 * node as usize + r];
                d[r] += n * value;
                (0..3).for_each(|c| h[r][c] += g[c] * value);
            }
        }
        off[0] += at.dv * dot(&d, &d);
        all[0] += at.dv * dot(&exact, &exact);
        off[1] += at.dv * energy_density(h);
        all[1] += at.dv * energy_density(exact_gradient);
    });
    [0, 1].map(|norm| (off[norm] / all[norm]).sqrt())
}

/// Block with straight edges and a smooth distortion that does not depend on the number of cells.
fn straight(filling: Filling, finer: usize) -> Mesh {
    let mut mesh = filling.block(CELLS.map(|c| c * finer), SIZE);
    distort(&mut mesh, SIZE, 0.04 * SIZE[0]);
    mesh
}

/// Block bent into an arc: every edge along it is a curve.
fn curved(filling: Filling, finer: usize) -> Mesh {
    let mut mesh = filling.block(CELLS.map(|c| c * finer), SIZE);
    map_nodes(&mut mesh, |p| {
        let (angle, radius) = (p[0] / 0.05, 0.05 + p[1]);
        [
            radius * angle.sin(),
            radius * angle.cos(),
            p[2] + 3.0 * p[0] * p[1],
        ]
    });
    mesh
}

fn order_of(filling: Filling) -> i32 {
    match filling.order() {
        ElementOrder::Linear => 1,
        ElementOrder::Quadratic => 2,
    }
}

type Family = (&'static str, fn(Filling, usize) -> Mesh);
const FAMILIES: [Family; 2] = [("straight", straight), ("curved", curved)];

/// Slopes between each mesh and the one before, asserted on the last.
fn manufactured_orders(filling: Filling, finer: &[usize]) {
    let p = f64::from(order_of(filling));
    for (name, family) in FAMILIES {
        let mut last: Option<(usize, [f64; 2])> = None;
        let mut slopes = [0.0; 2];
        for &n in finer {
            let found = errors_of(&family(filling, n));
            let h_ratio = last.map(|(before, _)| (n as f64 / before as f64).ln());
            if let (Some((_, before)), Some(ratio)) = (last, h_ratio) {
                slopes = [0, 1].map(|k| (before[k] / found[k]).ln() / ratio);
            }
            println!(
                "{filling:?}, {name}, {:?} cells: L2 {:.3e} (order {:.3}), energy {:.3e} (order {:.3})",
                CELLS.map(|c| c * n),
                found[0],
                slopes[0],
                found[1],
                slopes[1]
            );
            last = Some((n, found));
        }
        assert!((slopes[0] - p - 1.0).abs() < 0.1, "{name}, L2: {slopes:?}");
        assert!((slopes[1] - p).abs() < 0.1, "{name}, energy: {slopes:?}");
    }
}

#[test]
fn displacements_converge_in_the_order_of_the_elements() {
    for filling in fillings() {
        let finer = match filling.order() {
            ElementOrder::Linear => [2, 4],
            ElementOrder::Quadratic => [1, 2],
        };
        manufactured_orders(filling, &finer);
    }
}

#[test]
#[ignore = "slow: make verify"]
fn displacements_converge_in_the_order_of_the_elements_on_finer_meshes() {
    for filling in fillings() {
        let finer = match filling.order() {
            ElementOrder::Linear => [2, 4, 6],
            ElementOrder::Quadratic => [1, 2, 3],
        };
        manufactured_orders(filling, &finer);
    }
}

// Modes ----------------------------------------------------------------------------------------

/// Material with a Poisson number at which the first modes of the block are well separated.
const MATERIAL: Material = Material {
    poisson: 0.2,
    ..STEEL
};

/// Squared angular frequencies of a block whose faces slide on rigid walls, ascending. With wave
/// numbers a = (i pi / L_x, ...) there is a dilatational mode `grad cos cos cos` at c_p |a|, and
/// shear modes at c_s |a|: one fewer than wave numbers that are not zero.
fn sliding_block_omega2(size: [f64; 3], count: usize) -> Vec<f64> {
    let Lame { lambda_pa, mu_pa } = Lame::from(MATERIAL);
    let rho = MATERIAL.density_kg_m3;
    let (dilatation, shear) = ((lambda_pa + 2.0 * mu_pa) / rho, mu_pa / rho);
    let mut all = Vec::new();
    for i in 0..8 {
        for j in 0..8 {
            for k in 0..8 {
                let waves = [i, j, k];
                let nonzero = waves.iter().filter(|n| **n > 0).count();
                let a2: f64 = waves
                    .iter()
                    .zip(size)
                    .map(|(n, l)| (f64::from(*n) * std::f64::consts::PI / l).powi(2))
                    .sum();
                if nonzero > 0 {
                    all.push(dilatation * a2);
                    all.extend(std::iter::repeat_n(shear * a2, nonzero - 1));
                }
            }
        }
    }
    all.sort_by(f64::total_cmp);
    all.truncate(count);
    all
}

/// A block and its meshes.
struct Block {
    size: [f64; 3],
    /// Number of cells of the mesh with a number.
    cells: fn(usize) -> [usize; 3],
    /// Largest displacement of an inner node, relative to the least of the sizes.
    distortion: f64,
}

const BULKY: Block = Block {
    size: SIZE,
    cells: |n| CELLS.map(|c| c * n),
    distortion: 0.03,
};
/// Block whose lowest mode is dilatational, along x, and which is refined along x.
const SLENDER: Block = Block {
    size: [0.03, 0.004, 0.004],
    cells: |n| [10 * n, 2, 2],
    distortion: 0.0,
};
/// Block with the same mode, refined in all directions: for elements whose form would change
/// otherwise.
const BAR: Block = Block {
    size: [0.03, 0.005, 0.005],
    cells: |n| [6 * n, n, n],
    distortion: 0.0,
};

fn sliding_block_errors(filling: Filling, shape: &Block, finer: usize, count: usize) -> Vec<f64> {
    let mut mesh = filling.block((shape.cells)(finer), shape.size);
    distort(&mut mesh, shape.size, shape.distortion * shape.size[2]);
    let mut body = free_body(&mesh);
    body.matrices = MatrixOrigin::Elements(MATERIAL);
    let all = matrices(&body);
    let mut held = vec![false; all.load_n.len()];
    for (axis, faces) in FACES.iter().enumerate() {
        for face in faces {
            for &n in &mesh.groups[*face].nodes {
                held[3 * n as usize + axis] = true;
            }
        }
    }
    let moving: Vec<usize> = (0..held.len()).filter(|&dof| !held[dof]).collect();
    let [k, m] = [&all.stiffness, &all.mass].map(|a| submatrix(a, &moving, &moving));
    let modes = lowest_modes(&k, &m, count, &Cholesky::factor(&k).unwrap()).unwrap();
    let exact = sliding_block_omega2(shape.size, count);
    modes
        .omega2
        .iter()
        .zip(exact)
        .map(|(w2, exact)| w2 / exact - 1.0)
        .collect()
}

/// Slopes between each mesh and the one before, asserted on the last, for the `count` lowest modes.
fn eigenvalue_orders(filling: Filling, shape: &Block, finer: &[usize], count: usize) {
    let p = f64::from(order_of(filling));
    // Conforming elements are too stiff; incompatible modes make theirs softer.
    let conforming = filling != Filling::Of(ElementType::HEX8)
        && filling != Filling::Mixed(ElementOrder::Linear);
    let mut slopes = vec![0.0; count];
    let mut last: Option<(usize, Vec<f64>)> = None;
    for &n in finer {
        let found = sliding_block_errors(filling, shape, n, count);
        assert!(
            !conforming || found.iter().all(|e| *e > 0.0),
            "too soft: {found:?}"
        );
        if let Some((before_n, before)) = &last {
            let ratio = (n as f64 / *before_n as f64).ln();
            slopes = before
                .iter()
                .zip(&found)
                .map(|(b, f)| (b / f).ln() / ratio)
                .collect();
        }
        println!(
            "{filling:?}, {:?} cells: errors of omega^2 {found:?}, orders {slopes:.3?}",
            (shape.cells)(n)
        );
        last = Some((n, found));
    }
    for slope in slopes {
        assert!((slope - 2.0 * p).abs() < 0.1, "{slope}");
    }
}

#[test]
fn frequencies_converge_in_twice_the_order_of_the_elements() {
    for filling in fillings() {
        match filling.order() {
            ElementOrder::Linear => eigenvalue_orders(filling, &BULKY, &[2, 4], 3),
            ElementOrder::Quadratic => match filling {
                Filling::Of(ElementType::PYRAMID13) | Filling::Mixed(_) => {
                    eigenvalue_orders(filling, &BAR, &[2, 4], 1);
                }
                Filling::Of(_) => eigenvalue_orders(filling, &SLENDER, &[1, 2], 2),
            },
        }
    }
}

#[test]
#[ignore = "slow: make verify"]
fn frequencies_converge_in_twice_the_order_of_the_elements_on_finer_meshes() {
    for filling in fillings() {
        match filling.order() {
            ElementOrder::Linear => eigenvalue_orders(filling, &BULKY, &[4, 6], 3),
            ElementOrder::Quadratic => eigenvalue_orders(filling, &BULKY, &[2, 3, 4], 3),
        }
    }
}
