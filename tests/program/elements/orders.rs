//! How fast the error falls with the mesh: manufactured solutions, and a block whose modes are known.
//!
//! Elements of order p: the displacement converges with h^(p+1) in L2, with h^p in energy, squared
//! frequencies with h^(2p). Errors are integrated by a product rule that is exact to degree 7; the
//! assembly's go to degree 6 at most.

use dovetail_numerics::eigen::lowest_modes;
use dovetail_numerics::factor::Cholesky;
use dovetail_numerics::sparse::submatrix;
use dovetail_solver::fem::elasticity::{Lame, map_gradients};
use dovetail_solver::fem::{tet4, tet10};
use dovetail_solver::mesh::block::{FACES, block, distort, map_nodes};
use dovetail_solver::mesh::{ElementOrder, Mesh};
use dovetail_solver::model::Material;

use super::algebra::*;
use super::bodies::*;

/// Of [`SIZE`]: cells are cubes.
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

/// Gauss and Legendre's five points in each direction of a cube folded into the tetrahedron
/// (Stroud's conical product): exact to degree 7.
fn rich_rule() -> Vec<([f64; 3], f64)> {
    let [inner, outer] =
        [-1.0, 1.0].map(|s: f64| (5.0 + s * 2.0 * (10.0_f64 / 7.0).sqrt()).sqrt() / 3.0);
    let [heavy, light] = [1.0, -1.0].map(|s: f64| (322.0 + s * 13.0 * 70.0_f64.sqrt()) / 900.0);
    let line = [
        (0.0, 128.0 / 225.0),
        (-inner, heavy),
        (inner, heavy),
        (-outer, light),
        (outer, light),
    ]
    .map(|(x, w)| (0.5 + 0.5 * x, 0.5 * w));
    let mut points = Vec::new();
    for (x, wx) in line {
        for (y, wy) in line {
            for (z, wz) in line {
                let point = [x, (1.0 - x) * y, (1.0 - x) * (1.0 - y) * z];
                points.push((point, wx * wy * wz * (1.0 - x).powi(2) * (1.0 - y)));
            }
        }
    }
    points
}

#[test]
fn the_rule_of_the_errors_is_exact_to_degree_7() {
    let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
    for (i, j, k) in [
        (0, 0, 0),
        (7, 0, 0),
        (0, 7, 0),
        (0, 0, 7),
        (2, 3, 2),
        (1, 2, 4),
    ] {
        let exact = factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3);
        let sum: f64 = rich_rule()
            .iter()
            .map(|(p, w)| w * p[0].powi(i) * p[1].powi(j) * p[2].powi(k))
            .sum();
        assert!(
            (sum / exact - 1.0).abs() < 1e-13,
            "{i} {j} {k}: {sum} {exact}"
        );
    }
}

/// Calls `visit(tet, dV, shape functions, their gradients, x)` at all points of all elements.
fn for_each_point<const N: usize>(
    mesh: &Mesh,
    shape: fn([f64; 3]) -> [f64; N],
    reference_gradient: fn([f64; 3]) -> [[f64; 3]; N],
    mut visit: impl FnMut(&[u32], f64, &[f64; N], &[[f64; 3]; N], [f64; 3]),
) {
    let rule: Vec<_> = rich_rule()
        .into_iter()
        .map(|(p, w)| (shape(p), reference_gradient(p), w))
        .collect();
    for e in 0..mesh.elements.len() {
        let tet = mesh.elements.of(e);
        let coords: [[f64; 3]; N] = std::array::from_fn(|a| mesh.nodes_m[tet[a] as usize]);
        for (n, g, w) in &rule {
            let (det, g) = map_gradients(&coords, g);
            let mut x = [0.0; 3];
            for (n, c) in n.iter().zip(&coords) {
                (0..3).for_each(|k| x[k] += n * c[k]);
            }
            visit(tet, det * w, n, &g, x);
        }
    }
}

// Errors ---------------------------------------------------------------------------------------

/// Relative errors in L2 and in energy, the displacement given all over the surface.
fn errors<const N: usize>(
    mesh: &Mesh,
    shape: fn([f64; 3]) -> [f64; N],
    reference_gradient: fn([f64; 3]) -> [[f64; 3]; N],
) -> [f64; 2] {
    let body = free_body(mesh);
    let k = matrices(&body).stiffness;
    let mut load = vec![0.0; k.nrows()];
    for_each_point(mesh, shape, reference_gradient, |tet, dv, n, _, x| {
        let f = body_force(x);
        for (&node, n) in tet.iter().zip(n) {
            (0..3).for_each(|r| load[3 * node as usize + r] += dv * n * f[r]);
        }
    });
    let mut on_surface = vec![false; mesh.nodes_m.len()];
    for face in FACES.concat() {
        for &n in &mesh.groups[face].nodes {
            on_surface[n as usize] = true;
        }
    }
    let mut u = field(&body, displacement);
    let inner: Vec<usize> = (0..u.len()).filter(|dof| !on_surface[dof / 3]).collect();
    inner.iter().for_each(|&dof| u[dof] = 0.0);
    let given = times(&k, &u);
    let mut x: Vec<f64> = inner.iter().map(|&dof| load[dof] - given[dof]).collect();
    Cholesky::factor(&submatrix(&k, &inner, &inner))
        .unwrap()
        .solve_vector(&mut x);
    inner.iter().zip(x).for_each(|(&dof, x)| u[dof] = x);

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
    for_each_point(mesh, shape, reference_gradient, |tet, dv, n, g, x| {
        let (exact, exact_gradient) = (displacement(x), gradient(x));
        let (mut d, mut h) = (exact.map(|u| -u), exact_gradient.map(|row| row.map(|v| -v)));
        for ((&node, n), g) in tet.iter().zip(n).zip(g) {
            for r in 0..3 {
                let value = u[3 * node as usize + r];
                d[r] += n * value;
                (0..3).for_each(|c| h[r][c] += g[c] * value);
            }
        }
        off[0] += dv * dot(&d, &d);
        all[0] += dv * dot(&exact, &exact);
        off[1] += dv * energy_density(h);
        all[1] += dv * energy_density(exact_gradient);
    });
    [0, 1].map(|norm| (off[norm] / all[norm]).sqrt())
}

fn errors_of(mesh: &Mesh) -> [f64; 2] {
    match mesh.order {
        ElementOrder::Linear => errors(mesh, tet4::shape, tet4::gradient),
        ElementOrder::Quadratic => errors(mesh, tet10::shape, tet10::gradient),
    }
}

/// The same smooth distortion whatever the number of cells; edges straight.
fn straight(order: ElementOrder, finer: usize) -> Mesh {
    let mut mesh = block(order, CELLS.map(|c| c * finer), SIZE);
    distort(&mut mesh, SIZE, 0.04 * SIZE[0]);
    mesh
}

/// Bent into an arc: every edge along it is a curve.
fn curved(order: ElementOrder, finer: usize) -> Mesh {
    let mut mesh = block(order, CELLS.map(|c| c * finer), SIZE);
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

fn order_of(order: ElementOrder) -> i32 {
    match order {
        ElementOrder::Linear => 1,
        ElementOrder::Quadratic => 2,
    }
}

type Family = (&'static str, fn(ElementOrder, usize) -> Mesh);
const FAMILIES: [Family; 2] = [("straight", straight), ("curved", curved)];

/// Slopes between each mesh and the one before, asserted on the last.
fn manufactured_orders(order: ElementOrder, finer: &[usize]) {
    let p = f64::from(order_of(order));
    for (name, family) in FAMILIES {
        let mut last: Option<(usize, [f64; 2])> = None;
        let mut slopes = [0.0; 2];
        for &n in finer {
            let found = errors_of(&family(order, n));
            let h_ratio = last.map(|(before, _)| (n as f64 / before as f64).ln());
            if let (Some((_, before)), Some(ratio)) = (last, h_ratio) {
                slopes = [0, 1].map(|k| (before[k] / found[k]).ln() / ratio);
            }
            println!(
                "{order:?}, {name}, {:?} cells: L2 {:.3e} (order {:.3}), energy {:.3e} (order {:.3})",
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
    manufactured_orders(ElementOrder::Linear, &[2, 4]);
    manufactured_orders(ElementOrder::Quadratic, &[1, 2]);
}

#[test]
#[ignore = "slow: make verify"]
fn displacements_converge_in_the_order_of_the_elements_on_finer_meshes() {
    manufactured_orders(ElementOrder::Linear, &[2, 4, 6]);
    manufactured_orders(ElementOrder::Quadratic, &[1, 2, 3]);
}

// Modes ----------------------------------------------------------------------------------------

/// Of a Poisson number at which the first modes of the block lie well apart.
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
    /// Cells of the mesh of a number.
    cells: fn(usize) -> [usize; 3],
    /// Largest displacement of an inner node, of the least of the sizes.
    distortion: f64,
}

const BULKY: Block = Block {
    size: SIZE,
    cells: |n| CELLS.map(|c| c * n),
    distortion: 0.03,
};
/// Its lowest mode is dilatational, along x, and refined along x.
const SLENDER: Block = Block {
    size: [0.03, 0.004, 0.004],
    cells: |n| [10 * n, 2, 2],
    distortion: 0.0,
};

fn sliding_block_errors(
    order: ElementOrder,
    shape: &Block,
    finer: usize,
    count: usize,
) -> Vec<f64> {
    let mut mesh = block(order, (shape.cells)(finer), shape.size);
    distort(&mut mesh, shape.size, shape.distortion * shape.size[2]);
    let mut body = free_body(&mesh);
    body.material = MATERIAL;
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
fn eigenvalue_orders(order: ElementOrder, shape: &Block, finer: &[usize], count: usize) {
    let p = f64::from(order_of(order));
    let mut slopes = vec![0.0; count];
    let mut last: Option<(usize, Vec<f64>)> = None;
    for &n in finer {
        let found = sliding_block_errors(order, shape, n, count);
        assert!(found.iter().all(|e| *e > 0.0), "too soft: {found:?}");
        if let Some((before_n, before)) = &last {
            let ratio = (n as f64 / *before_n as f64).ln();
            slopes = before
                .iter()
                .zip(&found)
                .map(|(b, f)| (b / f).ln() / ratio)
                .collect();
        }
        println!(
            "{order:?}, {:?} cells: errors of omega^2 {found:?}, orders {slopes:.3?}",
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
    eigenvalue_orders(ElementOrder::Linear, &BULKY, &[2, 4], 3);
    eigenvalue_orders(ElementOrder::Quadratic, &SLENDER, &[1, 2], 2);
}

#[test]
#[ignore = "slow: make verify"]
fn frequencies_converge_in_twice_the_order_of_the_elements_on_finer_meshes() {
    eigenvalue_orders(ElementOrder::Linear, &BULKY, &[4, 6], 3);
    eigenvalue_orders(ElementOrder::Quadratic, &BULKY, &[2, 3, 4], 3);
}
