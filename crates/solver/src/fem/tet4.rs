//! Four-node tetrahedron, linear shape functions.
//!
//! Reference corners (0,0,0), (1,0,0), (0,1,0), (0,0,1), as in Gmsh.

use super::quadrature::{Rule, Table, Tables};

/// Nodes of the element.
pub const NODES: usize = 4;

/// Reference coordinates of the nodes.
pub const REFERENCE: [[f64; 3]; NODES] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
];

/// Shape functions at a reference point.
pub fn shape(xi: [f64; 3]) -> [f64; NODES] {
    [1.0 - xi[0] - xi[1] - xi[2], xi[0], xi[1], xi[2]]
}

/// Derivatives of the shape functions with respect to the reference coordinates.
pub fn gradient(_xi: [f64; 3]) -> [[f64; 3]; NODES] {
    [
        [-1.0, -1.0, -1.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
    ]
}

/// Quadrature tables of the element.
pub fn tables() -> Tables<NODES> {
    let table = |rule: Rule| Table::new(&rule, shape, gradient);
    Tables {
        centroid: table(Rule::degree_1()),
        nodes: Table::new(&Rule::at(&REFERENCE), shape, gradient),
        stiffness_straight: table(Rule::degree_1()),
        stiffness_curved: table(Rule::degree_1()),
        mass: table(Rule::degree_2()),
    }
}
