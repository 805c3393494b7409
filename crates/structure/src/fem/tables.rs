//! Shape functions of an element, tabulated at the points of its rules of quadrature.

use dovetail_mesh::element::{ElementType, Shape};
use dovetail_mesh::interpolation::{self, element_functions};
use dovetail_mesh::quadrature::{Rule, triangle};

/// Shape functions and their reference derivatives at the points of a rule.
#[derive(Debug, Clone)]
pub struct ShapeTable<const N: usize> {
    /// Weight of each point.
    pub weights: Vec<f64>,
    /// Shape functions at each point.
    pub shapes: Vec<[f64; N]>,
    /// Their gradients at each point, in the reference element.
    pub gradients: Vec<[[f64; 3]; N]>,
}

impl<const N: usize> ShapeTable<N> {
    /// Table of an element of `N` nodes at the points of a rule.
    pub(crate) fn new(element: ElementType, rule: &Rule) -> Self {
        let mut table = Self {
            weights: rule.weights.clone(),
            shapes: Vec::new(),
            gradients: Vec::new(),
        };
        for &point in &rule.points {
            let functions = element_functions(element, point);
            assert_eq!(functions.len(), N, "the element has N nodes");
            table
                .shapes
                .push(std::array::from_fn(|a| functions[a].value));
            table
                .gradients
                .push(std::array::from_fn(|a| functions[a].gradient));
        }
        table
    }
}

/// Tables of the shape functions of one element type.
#[derive(Debug, Clone)]
pub struct Tables<const N: usize> {
    /// Table in the middle ([`interpolation::centre`]).
    pub centre: ShapeTable<N>,
    /// Table at the element's own nodes (weights are zero).
    pub nodes: ShapeTable<N>,
    /// Table of a rule that is exact for the internal force of a uniform stress, in curved elements
    /// too (so that they pass the patch test), and for stiffness and geometric stiffness of affine
    /// elements (tetrahedra with straight edges, parallelepipeds, and their counterparts).
    pub stiffness: ShapeTable<N>,
    /// Table of a rule that is exact for the mass of elements with straight edges, and for the
    /// volume of curved ones.
    pub mass: ShapeTable<N>,
    /// Table for tetrahedra alone, sufficient for the stiffness where the edges are straight and
    /// the Jacobian is the same everywhere.
    pub affine: Option<ShapeTable<N>>,
}

impl<const N: usize> Tables<N> {
    /// Tables of an element of `N` nodes.
    pub(crate) fn new(element: ElementType) -> Self {
        let table = |rule: Rule| ShapeTable::new(element, &rule);
        let cube = |n| table(Rule::cube(n));
        let wedge = |degree, n| table(Rule::wedge(&triangle(degree), n));
        let quadratic = element.nodes() > element.shape.corners();
        let (stiffness, mass, affine) = match (element.shape, quadratic) {
            (Shape::Tetrahedron, false) => {
                let one = table(Rule::degree_1());
                (one.clone(), table(Rule::degree_2()), Some(one))
            }
            (Shape::Tetrahedron, true) => (
                table(Rule::degree_5()),
                table(Rule::degree_6()),
                Some(table(Rule::degree_2())),
            ),
            (Shape::Wedge, false) => (wedge(2, 2), wedge(4, 3), None),
            (Shape::Wedge, true) => (wedge(4, 3), wedge(6, 4), None),
            (Shape::Pyramid | Shape::Hexahedron, false) => (cube(2), cube(3), None),
            (Shape::Pyramid | Shape::Hexahedron, true) => (cube(3), cube(4), None),
        };
        let nodes = interpolation::reference_nodes(element);
        Self {
            centre: table(Rule::unweighted(&[interpolation::centre(element.shape)])),
            nodes: table(Rule::unweighted(&nodes)),
            stiffness,
            mass,
            affine,
        }
    }
}
