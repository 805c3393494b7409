//! Ten-node tetrahedron, quadratic shape functions; edges and faces may be curved (isoparametric).
//!
//! Corners as [`super::tet4`], then the middles of the edges [`TET_EDGES`]. With barycentric
//! coordinates L: corner `a` has L_a (2 L_a - 1), the middle of edge `ab` has 4 L_a L_b.

use super::quadrature::{Rule, Table, Tables};
use super::tet4;
use crate::mesh::TET_EDGES;

/// Nodes of the element.
pub const NODES: usize = 10;

/// Reference coordinates of the nodes.
pub const REFERENCE: [[f64; 3]; NODES] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.5, 0.0, 0.0],
    [0.5, 0.5, 0.0],
    [0.0, 0.5, 0.0],
    [0.0, 0.0, 0.5],
    [0.0, 0.5, 0.5],
    [0.5, 0.0, 0.5],
];

/// Shape functions at a reference point.
pub fn shape(xi: [f64; 3]) -> [f64; NODES] {
    let l = tet4::shape(xi);
    let mut n = [0.0; NODES];
    for a in 0..4 {
        n[a] = l[a] * (2.0 * l[a] - 1.0);
    }
    for (edge, [a, b]) in TET_EDGES.iter().enumerate() {
        n[4 + edge] = 4.0 * l[*a] * l[*b];
    }
    n
}

/// Derivatives of the shape functions with respect to the reference coordinates.
pub fn gradient(xi: [f64; 3]) -> [[f64; 3]; NODES] {
    let (l, dl) = (tet4::shape(xi), tet4::gradient(xi));
    let mut g = [[0.0; 3]; NODES];
    for k in 0..3 {
        for a in 0..4 {
            g[a][k] = (4.0 * l[a] - 1.0) * dl[a][k];
        }
        for (edge, [a, b]) in TET_EDGES.iter().enumerate() {
            g[4 + edge][k] = 4.0 * (l[*a] * dl[*b][k] + l[*b] * dl[*a][k]);
        }
    }
    g
}

/// Quadrature tables of the element.
pub fn tables() -> Tables<NODES> {
    let table = |rule: Rule| Table::new(&rule, shape, gradient);
    Tables {
        centroid: table(Rule::degree_1()),
        nodes: Table::new(&Rule::at(&REFERENCE), shape, gradient),
        stiffness_straight: table(Rule::degree_2()),
        stiffness_curved: table(Rule::degree_5()),
        mass: table(Rule::degree_6()),
    }
}
