//! Points of a facet and integrals over it.

use super::element::facet_corners;
use super::interpolation::of_facet;
use super::quadrature;
use dovetail_numerics::space::{cross, norm};

/// Point of a facet of 3, 4, 6 or 8 nodes, which may be curved.
#[derive(Debug, Clone, PartialEq)]
pub struct FacetPoint {
    /// Position, m.
    pub position_m: [f64; 3],
    /// Derivatives of the position by the two reference coordinates.
    pub tangents_m: [[f64; 3]; 2],
    /// Cross product of the tangents: the normal times the area of a unit of the reference
    /// coordinates. It points to the side from which the nodes run counter-clockwise.
    pub normal_m2: [f64; 3],
    /// Shape functions of the nodes.
    pub shapes: Vec<f64>,
}

/// Point of a facet at two reference coordinates.
pub fn at(coords_m: &[[f64; 3]], point: [f64; 2]) -> FacetPoint {
    let functions = of_facet(coords_m.len(), point);
    let (mut position, mut tangents) = ([0.0; 3], [[0.0; 3]; 2]);
    for (x, n) in coords_m.iter().zip(&functions) {
        for k in 0..3 {
            position[k] += n.value * x[k];
            tangents[0][k] += n.gradient[0] * x[k];
            tangents[1][k] += n.gradient[1] * x[k];
        }
    }
    FacetPoint {
        position_m: position,
        tangents_m: tangents,
        normal_m2: cross(tangents[0], tangents[1]),
        shapes: functions.iter().map(|n| n.value).collect(),
    }
}

/// Points of the rule of quadrature of a facet, with their weights.
pub fn points(coords_m: &[[f64; 3]]) -> impl Iterator<Item = (FacetPoint, f64)> {
    let rule = quadrature::facet(facet_corners(coords_m.len())).into_iter();
    rule.map(|(point, weight)| (at(coords_m, point), weight))
}

/// Part of a facet that belongs to a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Integral of the node's shape function, m2.
    pub area_m2: f64,
    /// Integral of the node's shape function times the unit normal, m2. It points to the side from
    /// which the nodes run counter-clockwise.
    pub normal_m2: [f64; 3],
}

/// Parts of a facet that belong to its nodes.
pub fn shares(coords_m: &[[f64; 3]]) -> Vec<Share> {
    let none = Share {
        area_m2: 0.0,
        normal_m2: [0.0; 3],
    };
    let mut shares = vec![none; coords_m.len()];
    for (point, weight) in points(coords_m) {
        let area = norm(point.normal_m2);
        for (share, n) in shares.iter_mut().zip(&point.shapes) {
            share.area_m2 += weight * n * area;
            for (sum, c) in share.normal_m2.iter_mut().zip(point.normal_m2) {
                *sum += weight * n * c;
            }
        }
    }
    shares
}

/// Integrals of the products of the shape functions of a facet two by two, row by row, m2.
pub fn products(coords_m: &[[f64; 3]]) -> Vec<f64> {
    let nodes = coords_m.len();
    let mut products = vec![0.0; nodes * nodes];
    for (point, weight) in points(coords_m) {
        let area = weight * norm(point.normal_m2);
        for (row, a) in products.chunks_exact_mut(nodes).zip(&point.shapes) {
            for (product, b) in row.iter_mut().zip(&point.shapes) {
                *product += a * b * area;
            }
        }
    }
    products
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum of v_a v_b P_ab: the integral of the square of a field with these values at the nodes.
    fn square(coords_m: &[[f64; 3]], values: &[f64]) -> f64 {
        let products = products(coords_m);
        let rows = products.chunks_exact(values.len()).zip(values);
        rows.map(|(row, a)| row.iter().zip(values).map(|(p, b)| a * b * p).sum::<f64>())
            .sum()
    }

    /// The field r^2 has the values of its shape functions, and its square r^4 the mean 1/5 over a
    /// straight quadrilateral of any shape: its determinant is linear in r and s, and the odd parts
    /// vanish. Over a triangle the mean is 1/15.
    #[test]
    fn products_of_shape_functions_are_exact_where_edges_are_straight() {
        let corners = [[0.0, 0.0], [3.0, 0.2], [2.5, 2.0], [0.4, 1.1]];
        let straight = |corners: &[[f64; 2]]| -> Vec<[f64; 3]> {
            let next = corners.iter().cycle().skip(1);
            let middles = corners.iter().zip(next);
            let middles = middles.map(|(a, b)| [0, 1].map(|k| 0.5 * (a[k] + b[k])));
            let all = corners.iter().copied().chain(middles);
            // In the plane z = 0.75 x, on which areas are 5/4 of those seen along z.
            all.map(|[x, y]| [x, y, 0.75 * x]).collect()
        };
        let area = |corners: &[[f64; 2]]| {
            let next = corners.iter().cycle().skip(1);
            let twice = corners.iter().zip(next);
            0.625 * twice.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
        };
        let quadrilateral = square(
            &straight(&corners),
            &[1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0],
        );
        assert!((quadrilateral / (area(&corners) / 5.0) - 1.0).abs() < 1e-13);
        let triangle = square(&straight(&corners[..3]), &[0.0, 1.0, 0.0, 0.25, 0.25, 0.0]);
        assert!((triangle / (area(&corners[..3]) / 15.0) - 1.0).abs() < 1e-13);
    }
}
