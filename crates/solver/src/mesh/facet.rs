//! Points of a facet and integrals over it.

use super::element::facet_corners;
use super::interpolation::of_facet;
use super::quadrature;
use dovetail_numerics::space::{cross, norm};

/// A point of a facet of 3, 4, 6 or 8 nodes, which may be curved.
#[derive(Debug, Clone, PartialEq)]
pub struct FacetPoint {
    /// Where it is.
    pub position_m: [f64; 3],
    /// Derivatives of the position by the two reference coordinates.
    pub tangents_m: [[f64; 3]; 2],
    /// The product of the tangents, the normal times the area of a unit of the reference coordinates. It
    /// points to where the nodes run counter-clockwise.
    pub normal_m2: [f64; 3],
    /// Shape functions of the nodes.
    pub shapes: Vec<f64>,
}

/// The point of a facet at two reference coordinates.
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

/// The points of the rule of quadrature of a facet, with their weights.
pub fn points(coords_m: &[[f64; 3]]) -> impl Iterator<Item = (FacetPoint, f64)> {
    let rule = quadrature::facet(facet_corners(coords_m.len())).into_iter();
    rule.map(|(point, weight)| (at(coords_m, point), weight))
}

/// A node's part of a facet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Integral of the node's shape function, m2.
    pub area_m2: f64,
    /// The same times the unit normal; it points to where the nodes run counter-clockwise.
    pub normal_m2: [f64; 3],
}

/// The parts of the nodes of a facet.
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
