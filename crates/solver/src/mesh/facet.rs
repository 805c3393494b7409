//! Integrals over a facet.

use super::element::facet_corners;
use super::interpolation::{ShapeValue, of_facet};
use super::quadrature;
use dovetail_numerics::space::{cross, norm, scaled};

/// A node's part of a facet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Integral of the node's shape function, m2.
    pub area_m2: f64,
    /// The same times the unit normal; it points to where the nodes run counter-clockwise.
    pub normal_m2: [f64; 3],
}

/// The parts of the nodes of a facet of 3, 4, 6 or 8 nodes, which may be curved.
pub fn shares(coords_m: &[[f64; 3]]) -> Vec<Share> {
    let none = Share {
        area_m2: 0.0,
        normal_m2: [0.0; 3],
    };
    let mut shares = vec![none; coords_m.len()];
    for_each_point(coords_m, |functions, normal| {
        let area = norm(normal);
        for (share, n) in shares.iter_mut().zip(functions) {
            share.area_m2 += n.value * area;
            for (sum, c) in share.normal_m2.iter_mut().zip(normal) {
                *sum += n.value * c;
            }
        }
    });
    shares
}

/// Integrals of the products of the shape functions of a facet two by two, row by row, m2.
pub fn products(coords_m: &[[f64; 3]]) -> Vec<f64> {
    let nodes = coords_m.len();
    let mut products = vec![0.0; nodes * nodes];
    for_each_point(coords_m, |functions, normal| {
        let area = norm(normal);
        for (row, a) in products.chunks_exact_mut(nodes).zip(functions) {
            for (product, b) in row.iter_mut().zip(functions) {
                *product += a.value * b.value * area;
            }
        }
    });
    products
}

/// The shape functions at the points of quadrature, and the normal there times the area that the point stands for.
fn for_each_point(coords_m: &[[f64; 3]], mut visit: impl FnMut(&[ShapeValue], [f64; 3])) {
    for (point, weight) in quadrature::facet(facet_corners(coords_m.len())) {
        let functions = of_facet(coords_m.len(), point);
        let mut tangents = [[0.0; 3]; 2];
        for (x, n) in coords_m.iter().zip(&functions) {
            for (tangent, d) in tangents.iter_mut().zip(n.gradient) {
                for (t, x) in tangent.iter_mut().zip(x) {
                    *t += d * x;
                }
            }
        }
        visit(&functions, scaled(cross(tangents[0], tangents[1]), weight));
    }
}
