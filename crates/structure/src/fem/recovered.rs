//! Mesh error of the stress at a node, by the recovery of Zienkiewicz and Zhu (Int. J. Numer. Meth.
//! Engng 33 (1992) 1331-1364).
//!
//! A polynomial of degree 2 along each axis is fitted, by least squares, to the stress at the
//! integration points of the elements around the node. It is more accurate at the node than the mean
//! of the elements there ([`super::stress::nodal_stress`]); the difference estimates the error of
//! this mean.

use nalgebra_sparse::na::{SMatrix, SVector, SymmetricEigen};

use super::elasticity::Lame;
use super::element::Deformed;
use super::elements::{integrals, values};
use crate::model::Body;
use dovetail_mesh::{ElementOrder, Shape};
use dovetail_numerics::space::{dot, sub};

/// Number of terms of the polynomial.
const TERMS: usize = 27;
/// Singular value of the fit, relative to the largest, below which its direction is not determined.
const UNDETERMINED: f64 = 1e-3;
/// Least number of directions that a fit determines: a constant and a gradient.
const LEAST_RANK: usize = 4;

/// Elements around a node whose stress is fitted, and the use of the fit.
///
/// The values were chosen on a beam in bending and a plate with a hole, on regular meshes of all types
/// of elements (crates/solver/tests/library/elements/mesh_error.rs) and on unstructured ones of
/// tetrahedra.
struct Neighbourhood {
    /// Layers of elements around the node.
    layers: usize,
    /// Decay of the weight of a squared difference, exp(-(decay r)^2), with r = 1 at the middle of a
    /// face of the box around the points.
    decay: f64,
    /// Factor on the difference.
    factor: f64,
}

impl Neighbourhood {
    fn new(order: ElementOrder, shape: Shape) -> Self {
        let (layers, decay, factor) = match (order, shape) {
            (ElementOrder::Linear, Shape::Tetrahedron) => (2, 0.5, 1.0),
            (ElementOrder::Linear, _) => (3, 0.5, 1.2),
            (ElementOrder::Quadratic, _) => (2, 1.5, 1.0),
        };
        Self {
            layers,
            decay,
            factor,
        }
    }
}

/// Estimated mesh error of the stress at a node, Pa, for each displacement of the nodes of the body:
/// the correction that the stress of [`super::stress::nodal_stress`], given in `nodal_pa`, lacks.
/// `None` if the elements around the node are too few to estimate it, or if the matrices of the body
/// come from another program.
pub fn nodal_stress_error(
    body: &Body,
    node: u32,
    displacements_m: &[&[[f64; 3]]],
    nodal_pa: &[[f64; 6]],
) -> Option<Vec<[f64; 6]>> {
    let lame = Lame::from(body.material()?);
    let near = neighbourhood(body, node)?;
    let elements = around(body, node, near.layers);
    let points_m = elements.iter().flat_map(|&e| {
        let coords = values(body, e, &body.nodes_m);
        integrals(body, e).points_m(&coords)
    });
    let points_m: Vec<[f64; 3]> = points_m.collect();
    let weights = weights(body.nodes_m[node as usize], &points_m, near.decay)?;
    let error = |(displacement_m, nodal): (&&[[f64; 3]], &[f64; 6])| {
        let mut recovered = [0.0; 6];
        let mut weights = weights.iter();
        for &e in &elements {
            let [coords, u] =
                [&body.nodes_m[..], displacement_m].map(|field| values(body, e, field));
            let stresses = integrals(body, e).point_stress(&Deformed::new(&coords, &u, lame));
            for (stress, weight) in stresses.iter().zip(weights.by_ref()) {
                for (sum, s) in recovered.iter_mut().zip(stress) {
                    *sum += weight * s;
                }
            }
        }
        std::array::from_fn(|k| near.factor * (recovered[k] - nodal[k]))
    };
    Some(displacements_m.iter().zip(nodal_pa).map(error).collect())
}

/// Neighbourhood of a node by its elements, of which those of lowest order and with the fewest
/// corners decide; `None` if it has none.
fn neighbourhood(body: &Body, node: u32) -> Option<Neighbourhood> {
    let own = body.elements.solids();
    let own = own.filter(|(_, nodes)| nodes.contains(&node));
    let (order, shape) = own.map(|(of, _)| (of.order, of.shape)).min()?;
    Some(Neighbourhood::new(order, shape))
}

/// Elements within this number of layers around a node, in ascending order.
fn around(body: &Body, node: u32, layers: usize) -> Vec<usize> {
    let mut inside = vec![false; body.nodes_m.len()];
    inside[node as usize] = true;
    let mut elements: Vec<usize> = Vec::new();
    for _ in 0..layers {
        let all = body.elements.iter().enumerate();
        let touching = all.filter(|(_, nodes)| nodes.iter().any(|&n| inside[n as usize]));
        elements = touching.map(|(e, _)| e).collect();
        for &e in &elements {
            for &n in body.elements.element_nodes(e) {
                inside[n as usize] = true;
            }
        }
    }
    elements
}

/// Weights of the values at some points in the value of the fitted polynomial at a place; `None` if
/// the points determine too little of it. Directions that they do not determine are left out.
fn weights(at_m: [f64; 3], points_m: &[[f64; 3]], decay: f64) -> Option<Vec<f64>> {
    let offsets = || points_m.iter().map(|p| sub(*p, at_m));
    let mut size_m = [0.0_f64; 3];
    for offset in offsets() {
        for (size, x) in size_m.iter_mut().zip(offset) {
            *size = size.max(x.abs());
        }
    }
    let size_m = size_m.map(|size| if size > 0.0 { size } else { 1.0 });
    let rows: Vec<(SVector<f64, TERMS>, f64)> = offsets()
        .map(|offset| {
            let x: [f64; 3] = std::array::from_fn(|k| offset[k] / size_m[k]);
            (terms(x), (-decay * decay * dot(x, x)).exp())
        })
        .collect();
    let mut normal = SMatrix::<f64, TERMS, TERMS>::zeros();
    for (row, weight) in &rows {
        normal.ger(*weight, row, row, 1.0);
    }
    let eigen = SymmetricEigen::new(normal);
    let least = UNDETERMINED * UNDETERMINED * eigen.eigenvalues.max();
    let determined = || (0..TERMS).filter(|&i| eigen.eigenvalues[i] > least);
    if determined().count() < LEAST_RANK {
        return None;
    }
    let mut solution = SVector::<f64, TERMS>::zeros();
    for i in determined() {
        // At the place itself the first term is 1 and all others are 0.
        let vector = eigen.eigenvectors.column(i);
        solution.axpy(vector[0] / eigen.eigenvalues[i], &vector, 1.0);
    }
    let weight = |(row, weight): &(SVector<f64, TERMS>, f64)| weight * row.dot(&solution);
    Some(rows.iter().map(weight).collect())
}

/// Products of the powers 0 to 2 of each coordinate.
fn terms(x: [f64; 3]) -> SVector<f64, TERMS> {
    let powers = x.map(|x| [1.0, x, x * x]);
    SVector::from_fn(|i, _| powers[0][i / 9] * powers[1][i / 3 % 3] * powers[2][i % 3])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(counts: [usize; 3]) -> Vec<[f64; 3]> {
        let place = |i: usize, count: usize| 0.1 + i as f64 / count.max(2) as f64;
        let [a, b, c] = counts;
        let points = (0..a * b * c).map(|i| [i % a, i / a % b, i / (a * b)]);
        points
            .map(|p| std::array::from_fn(|k| place(p[k], counts[k])))
            .collect()
    }

    #[test]
    fn fields_of_degree_2_along_each_axis_are_recovered() {
        let field = |[x, y, z]: [f64; 3]| 2.0 - x + 3.0 * y * z + x * x * y - 0.5 * y * y * z * z;
        let points = grid([6, 5, 6]);
        // Outside the points the directions that they hardly determine are left out.
        let outside = ([0.0, 0.0, 0.0], 0.5, 2e-2);
        for (at, decay, most) in [outside, ([0.6, 0.3, 0.2], 1.5, 2e-3)] {
            let weights = weights(at, &points, decay).unwrap();
            let found: f64 = (weights.iter().zip(&points))
                .map(|(w, p)| w * field(*p))
                .sum();
            let off = (found - field(at)).abs();
            assert!(off < most, "{found} {}", field(at));
        }
    }

    #[test]
    fn a_plane_of_points_fits_in_its_plane_and_a_single_point_fits_nothing() {
        let points = grid([4, 4, 1]);
        let weights_of_plane = weights([0.0, 0.0, 0.1], &points, 0.5).unwrap();
        let linear = |p: &[f64; 3]| 1.0 + p[0] - 2.0 * p[1];
        let found: f64 = (weights_of_plane.iter().zip(&points))
            .map(|(w, p)| w * linear(p))
            .sum();
        assert!((found - 1.0).abs() < 1e-9, "{found}");
        assert_eq!(weights([0.0; 3], &points[..1], 0.5), None);
    }
}
