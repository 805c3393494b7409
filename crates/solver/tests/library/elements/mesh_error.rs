//! Estimated mesh error of the stress at a node against closed forms: a beam in bending and a plate
//! with a hole.

use std::f64::consts::FRAC_PI_2;

use dovetail_mesh::{ElementType, Mesh, facet};
use dovetail_solver::fem::elasticity::Lame;
use dovetail_solver::fem::stress::{nodal_stress, nodal_stress_error, von_mises};
use dovetail_solver::model::{Body, Material, MatrixOrigin};
use dovetail_solver::results::stress::StressError;
use dovetail_testkit::block::{block, map_nodes};

use super::algebra::*;
use super::bodies::*;

/// Problem on a block with an exact solution.
trait Exact {
    fn material(&self) -> Material;
    /// Displacement at a place, m.
    fn displacement(&self, x: [f64; 3]) -> [f64; 3];
    /// Stress at a place, Pa.
    fn stress(&self, x: [f64; 3]) -> [f64; 6];
    /// Faces on which components of the displacement are given.
    fn given(&self) -> &'static [(&'static str, &'static [usize])];
    /// Faces under traction.
    fn loaded(&self) -> &'static [&'static str];
}

const YOUNG_PA: f64 = 1e3;
const POISSON: f64 = 0.3;

fn material(poisson: f64) -> Material {
    Material {
        young_pa: YOUNG_PA,
        poisson,
        density_kg_m3: 1.0,
    }
}

/// Beam of 2 m depth under a pressure of 1 Pa on its lower side, between supports at its ends
/// (Timoshenko and Goodier, Theory of Elasticity, section 22). Without Poisson's ratio the plane
/// solution is one in space.
struct Beam;

const HALF_LENGTH: f64 = 6.0;
/// Pressure over twice the moment of inertia of a width of 1 m, Pa/m3.
const LOAD_PA_M3: f64 = 0.75;

impl Exact for Beam {
    fn material(&self) -> Material {
        material(0.0)
    }
    fn displacement(&self, [x, y, _]: [f64; 3]) -> [f64; 3] {
        let f = LOAD_PA_M3 / YOUNG_PA;
        let l2 = HALF_LENGTH * HALF_LENGTH;
        let g = -f * (0.5 * l2 * x * x - x.powi(4) / 12.0 + 0.8 * x * x);
        [
            f * ((l2 * x - x.powi(3) / 3.0) * y + x * (2.0 / 3.0 * y.powi(3) - 0.4 * y)),
            -f * (y.powi(4) / 12.0 - 0.5 * y * y + 2.0 / 3.0 * y) + g,
            0.0,
        ]
    }
    fn stress(&self, [x, y, _]: [f64; 3]) -> [f64; 6] {
        let f = LOAD_PA_M3;
        let l2 = HALF_LENGTH * HALF_LENGTH;
        [
            f * ((l2 - x * x) * y + 2.0 / 3.0 * y.powi(3) - 0.4 * y),
            -f * (y.powi(3) / 3.0 - y + 2.0 / 3.0),
            0.0,
            -f * (1.0 - y * y) * x,
            0.0,
            0.0,
        ]
    }
    fn given(&self) -> &'static [(&'static str, &'static [usize])] {
        &[("x_min", &[0, 1, 2]), ("x_max", &[0, 1, 2])]
    }
    fn loaded(&self) -> &'static [&'static str] {
        &["y_min"]
    }
}

/// Plate in plane strain with a hole of 1 m radius, under a tension of 1 Pa along x (Kirsch).
struct Plate;

impl Exact for Plate {
    fn material(&self) -> Material {
        material(POISSON)
    }
    fn displacement(&self, [x, y, _]: [f64; 3]) -> [f64; 3] {
        let (r, t) = (x.hypot(y), y.atan2(x));
        let kappa = 3.0 - 4.0 * POISSON;
        let f = 1.0 / (4.0 * Lame::from(self.material()).mu_pa);
        let (c2, s2) = ((2.0 * t).cos(), (2.0 * t).sin());
        let ur =
            f * (r * (0.5 * (kappa - 1.0) + c2) + (1.0 + (1.0 + kappa) * c2) / r - c2 / r.powi(3));
        let ut = f * ((1.0 - kappa) / r - r - r.powi(-3)) * s2;
        [
            ur * t.cos() - ut * t.sin(),
            ur * t.sin() + ut * t.cos(),
            0.0,
        ]
    }
    fn stress(&self, [x, y, _]: [f64; 3]) -> [f64; 6] {
        let (r, t) = (x.hypot(y), y.atan2(x));
        let (c2, s2) = ((2.0 * t).cos(), (2.0 * t).sin());
        let (a2, a4) = (r.powi(-2), r.powi(-4));
        let rr = 0.5 * (1.0 - a2) + 0.5 * (1.0 - 4.0 * a2 + 3.0 * a4) * c2;
        let tt = 0.5 * (1.0 + a2) - 0.5 * (1.0 + 3.0 * a4) * c2;
        let rt = -0.5 * (1.0 + 2.0 * a2 - 3.0 * a4) * s2;
        let (c, s) = (t.cos(), t.sin());
        let xx = rr * c * c + tt * s * s - 2.0 * rt * s * c;
        let yy = rr * s * s + tt * c * c + 2.0 * rt * s * c;
        let xy = (rr - tt) * s * c + rt * (c * c - s * s);
        [xx, yy, POISSON * (xx + yy), xy, 0.0, 0.0]
    }
    fn given(&self) -> &'static [(&'static str, &'static [usize])] {
        &[
            ("x_max", &[0, 1, 2]),
            ("y_min", &[1]),
            ("y_max", &[0]),
            ("z_min", &[2]),
            ("z_max", &[2]),
        ]
    }
    fn loaded(&self) -> &'static [&'static str] {
        &[]
    }
}

fn beam(element: ElementType, n: usize) -> Mesh {
    let mut mesh = block(element, [6 * n, 2 * n, 2], [2.0 * HALF_LENGTH, 2.0, 2.0]);
    map_nodes(&mut mesh, |[x, y, z]| [x - HALF_LENGTH, y - 1.0, z]);
    mesh
}

/// A quarter of the plate to four radii, with cells that grow with the distance.
fn plate(element: ElementType, n: usize) -> Mesh {
    let mut mesh = block(element, [4 * n + 2, 4 * n + 2, 2], [1.0, 1.0, 0.5]);
    map_nodes(&mut mesh, |[x, y, z]| {
        let (r, t) = (4.0_f64.powf(x), FRAC_PI_2 * y);
        [r * t.cos(), r * t.sin(), z]
    });
    mesh
}

/// Forces of the nodes under the tractions of the exact stress, N.
fn tractions(mesh: &Mesh, exact: &dyn Exact) -> Vec<f64> {
    let mut load = vec![0.0; 3 * mesh.nodes_m.len()];
    for face in exact.loaded() {
        for &f in &mesh.groups[*face].elements {
            let nodes = mesh.facets.element_nodes(f as usize);
            let coords: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.nodes_m[n as usize]).collect();
            for (point, weight) in facet::points(&coords) {
                let n = point.normal_m2;
                let s = exact.stress(point.position_m);
                let t = [
                    s[0] * n[0] + s[3] * n[1] + s[5] * n[2],
                    s[3] * n[0] + s[1] * n[1] + s[4] * n[2],
                    s[5] * n[0] + s[4] * n[1] + s[2] * n[2],
                ];
                for (&node, shape) in nodes.iter().zip(&point.shapes) {
                    for r in 0..3 {
                        load[3 * node as usize + r] += weight * shape * t[r];
                    }
                }
            }
        }
    }
    load
}

/// Body of the mesh and the displacement of its nodes, m.
fn displaced(mesh: &Mesh, exact: &dyn Exact) -> (Body, Vec<[f64; 3]>) {
    let mut body = free_body(mesh);
    body.matrices = MatrixOrigin::Elements(exact.material());
    let k = matrices(&body).stiffness;
    let mut u = field(&body, |x| exact.displacement(x));
    let mut is_given = vec![false; u.len()];
    for (face, axes) in exact.given() {
        for &n in &mesh.groups[*face].nodes {
            for axis in *axes {
                is_given[3 * n as usize + axis] = true;
            }
        }
    }
    let load = tractions(mesh, exact);
    solve_inside(&k, &load, |dof| is_given[dof], &mut u);
    let u = u.as_chunks::<3>().0.to_vec();
    (body, u)
}

/// The estimate and the error differ by this factor at most.
const FACTOR: f64 = 2.0;
/// Largest ratio of the estimate to the error for tetrahedra of 4 nodes: all cells here are cut along
/// parallel diagonals, from which stresses of neighbours differ more than in unstructured meshes
/// (tests/program/stress.rs).
const FACTOR_OF_TET4: f64 = 6.0;

/// Root mean squares over some nodes.
struct Errors {
    /// Equivalent of the error of the stress, and its estimate, Pa.
    stress_pa: [f64; 2],
    /// Error of the equivalent stress, and its estimate, Pa.
    equivalent_pa: [f64; 2],
}

fn errors(mesh: &Mesh, exact: &dyn Exact, at: impl Fn([f64; 3]) -> bool) -> Errors {
    let (body, u) = displaced(mesh, exact);
    let nodal = nodal_stress(&body, &u);
    let (mut sums, mut count) = ([0.0; 4], 0.0);
    for (node, x) in body.nodes_m.iter().enumerate().filter(|(_, x)| at(**x)) {
        let (own, exact) = (nodal[node], exact.stress(*x));
        let estimate = nodal_stress_error(&body, node as u32, &[&u], &[own]).unwrap();
        let figures = StressError::new(&[own], &estimate, None);
        let off = std::array::from_fn(|k| exact[k] - own[k]);
        let found = [
            von_mises(off),
            von_mises(estimate[0]),
            von_mises(exact) - von_mises(own),
            figures.mean_pa,
        ];
        sums = [0, 1, 2, 3].map(|k| sums[k] + found[k] * found[k]);
        count += 1.0;
    }
    let [a, b, c, d] = sums.map(|sum: f64| (sum / count).sqrt());
    Errors {
        stress_pa: [a, b],
        equivalent_pa: [c, d],
    }
}

/// Asserts that the estimate of the error of the stress is neither too small nor too large, and that
/// of the equivalent stress not too small: an equivalent may be right by chance.
fn check(
    exact: &dyn Exact,
    mesh: fn(ElementType, usize) -> Mesh,
    at: impl Fn([f64; 3]) -> bool + Copy,
) {
    for element in ElementType::ALL {
        let mut last = f64::INFINITY;
        for n in [2, 3, 4] {
            let found = errors(&mesh(element, n), exact, at);
            let [error, estimate] = found.stress_pa;
            let [of_equivalent, its_estimate] = found.equivalent_pa;
            println!(
                "{:9} {n}: error of the stress {error:.4} Pa, estimated {estimate:.4} Pa; of the equivalent \
                 {of_equivalent:.4} Pa, estimated {its_estimate:.4} Pa",
                element.name()
            );
            let ratio = estimate / error;
            let most = if element == ElementType::TET4 {
                FACTOR_OF_TET4
            } else {
                FACTOR
            };
            assert!(
                (1.0 / FACTOR..most).contains(&ratio),
                "{}, mesh {n}: {ratio}",
                element.name()
            );
            assert!(
                of_equivalent < FACTOR * its_estimate,
                "{}, mesh {n}",
                element.name()
            );
            assert!(
                estimate < last,
                "{}, mesh {n}: no convergence",
                element.name()
            );
            last = estimate;
        }
    }
}

/// On the upper side, up to a third of the length from the middle, where the bending moment is
/// largest.
#[test]
fn error_of_a_beam_in_bending_is_within_a_factor_of_two_of_the_estimate() {
    check(&Beam, beam, |[x, y, _]| {
        x.abs() < 0.334 * HALF_LENGTH && y > 1.0 - 1e-9
    });
}

/// At the edge of the hole, where the stress is three times that of the plate.
#[test]
fn error_at_a_notch_is_within_a_factor_of_two_of_the_estimate() {
    check(&Plate, plate, |[x, y, _]| {
        x.abs() < 1e-9 && (y - 1.0).abs() < 1e-9
    });
}

/// In a field of degree 1 the nodal stress of quadratic elements is right, and so is the recovered one.
#[test]
fn stress_that_the_elements_hold_has_no_error() {
    let exact = |[x, y, z]: [f64; 3]| [1e-4 * x * x, 2e-4 * x * y, -1e-4 * y * z];
    for element in [ElementType::TET10, ElementType::HEX20] {
        let mesh = block(element, [3, 2, 2], [3.0, 2.0, 2.0]);
        let body = free_body(&mesh);
        let u: Vec<[f64; 3]> = mesh.nodes_m.iter().map(|x| exact(*x)).collect();
        let nodal = nodal_stress(&body, &u);
        let scale = nodal.iter().map(|s| von_mises(*s)).fold(0.0, f64::max);
        for (node, own) in nodal.iter().enumerate() {
            let [error] = nodal_stress_error(&body, node as u32, &[&u], &[*own]).unwrap()[..]
            else {
                panic!("one displacement has one error");
            };
            assert!(
                von_mises(error) < 2e-3 * scale,
                "{} {error:?}",
                element.name()
            );
        }
    }
}
