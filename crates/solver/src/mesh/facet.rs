//! Integrals over a facet.

use super::element::facet_corners;
use super::interpolation::of_facet;
use super::quadrature;
use dovetail_numerics::space::{cross, norm};

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
        let normal = cross(tangents[0], tangents[1]);
        let area = norm(normal);
        for (share, n) in shares.iter_mut().zip(&functions) {
            share.area_m2 += weight * n.value * area;
            for (sum, c) in share.normal_m2.iter_mut().zip(normal) {
                *sum += weight * n.value * c;
            }
        }
    }
    shares
}
