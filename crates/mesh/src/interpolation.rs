//! Shape functions of all elements and facets, with their gradients.
//!
//! Reference coordinates: a tetrahedron and a triangle have the corners (0,0,0), (1,0,0), (0,1,0),
//! (0,0,1); a hexahedron and a quadrilateral go from -1 to 1; a wedge has those of a triangle, and
//! -1 to 1 along it. A pyramid is a cube whose upper face is one point: with `u`, `v`, `w` from -1
//! to 1 and `s = (1 - w) / 2` its point is `(s u, s v)` across. In these coordinates its functions,
//! rational in space (Bedrosian, Int. J. Numer. Meth. Engng 35 (1992) 95-108), are polynomials.
//!
//! Quadratic elements are serendipity elements: each middle of an edge has a function, and a corner
//! has the linear one minus half of those of its edges (Zienkiewicz and Taylor, The Finite Element
//! Method, vol. 1, ch. 6).

use std::ops::{Add, Mul, Sub};

use super::element::{ElementOrder, ElementType, Shape, facet_corners};

/// Shape function at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeValue {
    /// Value of the function.
    pub value: f64,
    /// Derivatives by the reference coordinates.
    pub gradient: [f64; 3],
}

impl ShapeValue {
    const fn constant(value: f64) -> Self {
        let gradient = [0.0; 3];
        Self { value, gradient }
    }
    fn squared(self) -> Self {
        self * self
    }
}

impl Add for ShapeValue {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            gradient: [0, 1, 2].map(|k| self.gradient[k] + other.gradient[k]),
        }
    }
}

impl Sub for ShapeValue {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -1.0 * other
    }
}

impl Mul for ShapeValue {
    type Output = Self;
    /// Multiplies by the product rule.
    fn mul(self, other: Self) -> Self {
        let of = |(a, b): (&f64, &f64)| other.value.mul_add(*a, self.value * b);
        let mut gradient = [0.0; 3];
        let both = self.gradient.iter().zip(&other.gradient);
        for (g, pair) in gradient.iter_mut().zip(both) {
            *g = of(pair);
        }
        Self {
            value: self.value * other.value,
            gradient,
        }
    }
}

impl Mul<ShapeValue> for f64 {
    type Output = ShapeValue;
    fn mul(self, other: ShapeValue) -> ShapeValue {
        ShapeValue {
            value: self * other.value,
            gradient: other.gradient.map(|g| self * g),
        }
    }
}

const ONE: ShapeValue = ShapeValue::constant(1.0);

/// Coordinate `k` of a reference point.
fn coordinate(point: [f64; 3], k: usize) -> ShapeValue {
    let mut gradient = [0.0; 3];
    gradient[k] = 1.0;
    ShapeValue {
        value: point[k],
        gradient,
    }
}

/// Shape functions of an element at a reference point, in the order of its nodes.
pub fn element_functions(element: ElementType, point: [f64; 3]) -> Vec<ShapeValue> {
    let linear = corners(element.shape, point);
    match element.order {
        ElementOrder::Linear => linear,
        ElementOrder::Quadratic => {
            let edges = element.shape.edges();
            let middle = |edge: &[usize; 2]| middle(element.shape, *edge, &linear, point);
            serendipity(linear.clone(), edges, edges.iter().map(middle).collect())
        }
    }
}

/// Shape functions of a facet of `nodes` nodes (3, 4, 6 or 8) at two reference coordinates.
pub fn facet_functions(nodes: usize, point: [f64; 2]) -> Vec<ShapeValue> {
    let [x, y] = [0, 1].map(|k| coordinate([point[0], point[1], 0.0], k));
    let n = facet_corners(nodes);
    let linear: Vec<ShapeValue> = match n {
        3 => vec![ONE - x - y, x, y],
        _ => SQUARE
            .map(|[a, b]| 0.25 * ((ONE + a * x) * (ONE + b * y)))
            .to_vec(),
    };
    if nodes == n {
        return linear;
    }
    let edges: Vec<[usize; 2]> = (0..n).map(|i| [i, (i + 1) % n]).collect();
    let middle = |&[a, b]: &[usize; 2]| match n {
        3 => 4.0 * (linear[a] * linear[b]),
        _ => side_of_square([a, b], x, y),
    };
    let middles = edges.iter().map(middle).collect();
    serendipity(linear.clone(), &edges, middles)
}

/// Reference coordinates of the nodes of an element. (For a pyramid's apex, which is a face of the
/// cube, those of its middle.)
pub fn reference_nodes(element: ElementType) -> Vec<[f64; 3]> {
    let shape = element.shape;
    let mut nodes: Vec<[f64; 3]> = match shape {
        Shape::Tetrahedron => vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ],
        Shape::Wedge => {
            let triangle = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
            let level = |t: f64| triangle.map(|[r, s]| [r, s, t]);
            [level(-1.0), level(1.0)].concat()
        }
        Shape::Pyramid => {
            let mut base = SQUARE.map(|[a, b]| [a, b, -1.0]).to_vec();
            base.push([0.0, 0.0, 1.0]);
            base
        }
        Shape::Hexahedron => {
            let level = |t: f64| SQUARE.map(|[a, b]| [a, b, t]);
            [level(-1.0), level(1.0)].concat()
        }
    };
    if element.order == ElementOrder::Quadratic {
        for &[a, b] in shape.edges() {
            let mut middle = [0, 1, 2].map(|k| 0.5 * (nodes[a][k] + nodes[b][k]));
            if shape == Shape::Pyramid && b == APEX {
                middle = [nodes[a][0], nodes[a][1], 0.0];
            }
            nodes.push(middle);
        }
    }
    nodes
}

/// Reference coordinates of the middle of an element, at which tetrahedra and wedges have their
/// centroid.
pub fn centre(shape: Shape) -> [f64; 3] {
    match shape {
        Shape::Tetrahedron => [0.25; 3],
        Shape::Wedge => [1.0 / 3.0, 1.0 / 3.0, 0.0],
        // A quarter of the height.
        Shape::Pyramid => [0.0, 0.0, -0.5],
        Shape::Hexahedron => [0.0; 3],
    }
}

const SQUARE: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
const APEX: usize = 4;

/// Corner functions minus half of the functions of their edges, followed by these.
fn serendipity(
    mut corners: Vec<ShapeValue>,
    edges: &[[usize; 2]],
    middles: Vec<ShapeValue>,
) -> Vec<ShapeValue> {
    for (edge, middle) in edges.iter().zip(&middles) {
        for &corner in edge {
            corners[corner] = corners[corner] - 0.5 * *middle;
        }
    }
    corners.extend(middles);
    corners
}

/// Functions of the element with nodes at the corners alone.
fn corners(shape: Shape, point: [f64; 3]) -> Vec<ShapeValue> {
    let [x, y, z] = [0, 1, 2].map(|k| coordinate(point, k));
    let square = SQUARE.map(|[a, b]| 0.25 * ((ONE + a * x) * (ONE + b * y)));
    let [low, high] = [0.5 * (ONE - z), 0.5 * (ONE + z)];
    match shape {
        Shape::Tetrahedron => vec![ONE - x - y - z, x, y, z],
        Shape::Wedge => {
            let triangle = [ONE - x - y, x, y];
            [triangle.map(|n| n * low), triangle.map(|n| n * high)].concat()
        }
        Shape::Pyramid => {
            let mut corners = square.map(|n| n * low).to_vec();
            corners.push(high);
            corners
        }
        Shape::Hexahedron => [square.map(|n| n * low), square.map(|n| n * high)].concat(),
    }
}

/// Function of the middle of an edge: 1 there, 0 at all other nodes.
fn middle(shape: Shape, [a, b]: [usize; 2], linear: &[ShapeValue], point: [f64; 3]) -> ShapeValue {
    let [x, y, z] = [0, 1, 2].map(|k| coordinate(point, k));
    let [low, high] = [0.5 * (ONE - z), 0.5 * (ONE + z)];
    let across = ONE - z.squared();
    match shape {
        Shape::Tetrahedron => 4.0 * (linear[a] * linear[b]),
        Shape::Wedge => {
            let triangle = [ONE - x - y, x, y];
            match (a / 3, b / 3) {
                (0, 1) => triangle[a] * across,
                (level, _) => {
                    let along = [low, high][level];
                    4.0 * (triangle[a % 3] * triangle[b % 3] * along)
                }
            }
        }
        Shape::Pyramid if b == APEX => {
            let [p, q] = SQUARE[a];
            high * low * ((ONE + p * x) * (ONE + q * y))
        }
        Shape::Pyramid => side_of_square([a, b], x, y) * low.squared(),
        Shape::Hexahedron => match (a / 4, b / 4) {
            (0, 1) => {
                let [p, q] = SQUARE[a];
                0.25 * ((ONE + p * x) * (ONE + q * y) * across)
            }
            (level, _) => side_of_square([a % 4, b % 4], x, y) * [low, high][level],
        },
    }
}

/// Function of the middle of a side of the quadrilateral of eight nodes.
fn side_of_square([a, b]: [usize; 2], x: ShapeValue, y: ShapeValue) -> ShapeValue {
    let ([p, q], [r, s]) = (SQUARE[a], SQUARE[b]);
    if p == r {
        0.5 * ((ONE - y.squared()) * (ONE + p * x))
    } else {
        debug_assert_eq!(q, s, "corners of a side share a coordinate");
        0.5 * ((ONE - x.squared()) * (ONE + q * y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A few points inside every reference element.
    const INSIDE: [[f64; 3]; 3] = [[0.2, 0.3, 0.1], [0.11, 0.27, 0.35], [0.4, 0.05, 0.3]];

    #[test]
    fn each_function_is_one_at_its_node_and_zero_at_the_others() {
        for element in ElementType::ALL {
            for (node, point) in reference_nodes(element).into_iter().enumerate() {
                for (function, n) in element_functions(element, point).iter().enumerate() {
                    let expected = f64::from(u8::from(function == node));
                    assert!(
                        (n.value - expected).abs() < 1e-15,
                        "{element:?} {node} {function}"
                    );
                }
            }
        }
    }

    #[test]
    fn gradients_are_the_derivatives_and_sum_to_nothing() {
        for element in ElementType::ALL {
            for point in INSIDE {
                let here = element_functions(element, point);
                for k in 0..3 {
                    let sum: f64 = here.iter().map(|n| n.gradient[k]).sum();
                    assert!(sum.abs() < 1e-14);
                    let step = 1e-4;
                    let at = |s: f64| {
                        let mut p = point;
                        p[k] += s * step;
                        element_functions(element, p)
                    };
                    for (a, (n, b)) in at(-1.0).iter().zip(here.iter().zip(at(1.0))) {
                        let difference = (b.value - a.value) / (2.0 * step);
                        assert!((difference - n.gradient[k]).abs() < 1e-7, "{element:?}");
                    }
                }
            }
        }
    }

    /// Straight elements hold every polynomial of their order exactly: that of the positions is the
    /// theorem behind the patch test, those of degree two the order of the quadratic elements.
    #[test]
    fn polynomials_of_the_order_are_interpolated_exactly_in_affine_elements() {
        // For the pyramid the map from the cube to space, for the others the identity.
        let place = |shape: Shape, [u, v, w]: [f64; 3]| match shape {
            Shape::Pyramid => [0.5 * (1.0 - w) * u, 0.5 * (1.0 - w) * v, w],
            _ => [u, v, w],
        };
        let quadratic = |[x, y, z]: [f64; 3]| {
            1.0 + 2.0 * x - 3.0 * y + 0.5 * z + x * x - 2.0 * y * y + 3.0 * z * z + 0.7 * x * y
                - 1.1 * y * z
                + 0.3 * x * z
        };
        let linear = |[x, y, z]: [f64; 3]| 1.0 + 2.0 * x - 3.0 * y + 0.5 * z;
        for element in ElementType::ALL {
            let field = |p: [f64; 3]| match element.order {
                ElementOrder::Linear => linear(place(element.shape, p)),
                ElementOrder::Quadratic => quadratic(place(element.shape, p)),
            };
            let at_nodes: Vec<f64> = reference_nodes(element).into_iter().map(field).collect();
            for point in INSIDE {
                let functions = element_functions(element, point);
                let found: f64 = functions
                    .iter()
                    .zip(&at_nodes)
                    .map(|(n, f)| n.value * f)
                    .sum();
                assert!(
                    (found - field(point)).abs() < 1e-14,
                    "{element:?} {point:?}"
                );
            }
        }
    }

    /// The functions of a face are those of its facet, whatever the element behind: elements of
    /// different shapes join without gaps.
    #[test]
    fn on_a_face_an_element_is_its_facet() {
        for element in ElementType::ALL {
            let nodes = reference_nodes(element);
            for f in 0..element.shape.faces().len() {
                let face = element.face(f);
                let n = facet_corners(face.len());
                for at in [[0.2, 0.3], [0.5, 0.1], [-0.3, 0.6]] {
                    if n == 3 && at[0] < 0.0 {
                        continue;
                    }
                    let on_facet = facet_functions(face.len(), at);
                    // The corner functions of the facet lead to the point of the element; only at
                    // the apex, where the face of the cube is one point, is it found by its height
                    // and its direction.
                    let corners = facet_functions(n, at);
                    let mut point = [0.0; 3];
                    for (c, l) in corners.iter().enumerate() {
                        for k in 0..3 {
                            point[k] += l.value * nodes[face[c]][k];
                        }
                    }
                    if element.shape == Shape::Pyramid && n == 3 {
                        let s = 0.5 * (1.0 - point[2]);
                        point = [point[0] / s, point[1] / s, point[2]];
                    }
                    let all = element_functions(element, point);
                    for (i, n) in all.iter().enumerate() {
                        let place = face.iter().position(|&node| node == i);
                        let expected = place.map_or(0.0, |place| on_facet[place].value);
                        assert!((n.value - expected).abs() < 1e-14, "{element:?} face {f}");
                    }
                }
            }
        }
    }
}
