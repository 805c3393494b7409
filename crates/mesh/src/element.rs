//! Types of elements: their corners, edges and faces, and lists of elements of any types.
//!
//! The order of the nodes is that of VTK, Abaqus and CalculiX: the corners, then the middles of
//! [`Shape::edges`]. (Gmsh has the middles in another order.) The first face of a pyramid, a wedge
//! and a hexahedron is its base; seen from above, the corners of the base run counter-clockwise.

use std::collections::BTreeMap;

use serde::Serialize;

/// Shape of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum Shape {
    /// Four corners.
    Tetrahedron,
    /// A quadrilateral and the apex above it.
    Pyramid,
    /// A triangle and the one above it (also called a prism, or pentahedron).
    Wedge,
    /// A quadrilateral and the one above it (also called a brick).
    Hexahedron,
}

impl Shape {
    /// All shapes, in the order of their numbers of corners.
    pub const ALL: [Self; 4] = [
        Self::Tetrahedron,
        Self::Pyramid,
        Self::Wedge,
        Self::Hexahedron,
    ];

    /// Number of corners.
    pub fn corners(self) -> usize {
        match self {
            Self::Tetrahedron => 4,
            Self::Pyramid => 5,
            Self::Wedge => 6,
            Self::Hexahedron => 8,
        }
    }

    /// Two corners of each edge, in the order of the nodes in their middles.
    pub fn edges(self) -> &'static [[usize; 2]] {
        match self {
            Self::Tetrahedron => &[[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]],
            Self::Pyramid => &[
                [0, 1],
                [1, 2],
                [2, 3],
                [0, 3],
                [0, 4],
                [1, 4],
                [2, 4],
                [3, 4],
            ],
            Self::Wedge => &[
                [0, 1],
                [1, 2],
                [0, 2],
                [3, 4],
                [4, 5],
                [3, 5],
                [0, 3],
                [1, 4],
                [2, 5],
            ],
            Self::Hexahedron => &[
                [0, 1],
                [1, 2],
                [2, 3],
                [0, 3],
                [4, 5],
                [5, 6],
                [6, 7],
                [4, 7],
                [0, 4],
                [1, 5],
                [2, 6],
                [3, 7],
            ],
        }
    }

    /// Corners of each face, counter-clockwise seen from outside. Face `i` is the face `S<i + 1>`
    /// of Abaqus and CalculiX.
    pub fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Tetrahedron => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[0, 3, 2]],
            Self::Pyramid => &[
                &[0, 3, 2, 1],
                &[0, 1, 4],
                &[1, 2, 4],
                &[2, 3, 4],
                &[0, 4, 3],
            ],
            Self::Wedge => &[
                &[0, 2, 1],
                &[3, 4, 5],
                &[0, 1, 4, 3],
                &[1, 2, 5, 4],
                &[0, 3, 5, 2],
            ],
            Self::Hexahedron => &[
                &[0, 3, 2, 1],
                &[4, 5, 6, 7],
                &[0, 1, 5, 4],
                &[1, 2, 6, 5],
                &[2, 3, 7, 6],
                &[0, 4, 7, 3],
            ],
        }
    }

    /// Name of the shape, in the plural.
    pub fn plural(self) -> &'static str {
        match self {
            Self::Tetrahedron => "tetrahedra",
            Self::Pyramid => "pyramids",
            Self::Wedge => "wedges",
            Self::Hexahedron => "hexahedra",
        }
    }
}

/// Order of the interpolation in an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum ElementOrder {
    /// Nodes at the corners.
    Linear,
    /// Nodes at the corners and in the middles of the edges.
    Quadratic,
}

/// Shape and order of an element; the number of nodes determines both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct ElementType {
    /// Shape of the element.
    pub shape: Shape,
    /// Order, which determines the nodes on the edges.
    pub order: ElementOrder,
}

impl ElementType {
    /// Tetrahedron of 4 nodes.
    pub const TET4: Self = Self::new(Shape::Tetrahedron, ElementOrder::Linear);
    /// Tetrahedron of 10 nodes.
    pub const TET10: Self = Self::new(Shape::Tetrahedron, ElementOrder::Quadratic);
    /// Pyramid of 5 nodes.
    pub const PYRAMID5: Self = Self::new(Shape::Pyramid, ElementOrder::Linear);
    /// Pyramid of 13 nodes.
    pub const PYRAMID13: Self = Self::new(Shape::Pyramid, ElementOrder::Quadratic);
    /// Wedge of 6 nodes.
    pub const WEDGE6: Self = Self::new(Shape::Wedge, ElementOrder::Linear);
    /// Wedge of 15 nodes.
    pub const WEDGE15: Self = Self::new(Shape::Wedge, ElementOrder::Quadratic);
    /// Hexahedron of 8 nodes.
    pub const HEX8: Self = Self::new(Shape::Hexahedron, ElementOrder::Linear);
    /// Hexahedron of 20 nodes.
    pub const HEX20: Self = Self::new(Shape::Hexahedron, ElementOrder::Quadratic);

    /// All types, by shape and then by order.
    pub const ALL: [Self; 8] = [
        Self::TET4,
        Self::TET10,
        Self::PYRAMID5,
        Self::PYRAMID13,
        Self::WEDGE6,
        Self::WEDGE15,
        Self::HEX8,
        Self::HEX20,
    ];

    /// Type with a shape and an order.
    pub const fn new(shape: Shape, order: ElementOrder) -> Self {
        Self { shape, order }
    }

    /// Type that has `nodes` nodes: 4, 5, 6, 8, 10, 13, 15 or 20.
    pub fn from_node_count(nodes: usize) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|element| element.nodes() == nodes)
    }

    /// Number of nodes.
    pub fn nodes(self) -> usize {
        match self.order {
            ElementOrder::Linear => self.shape.corners(),
            ElementOrder::Quadratic => self.shape.corners() + self.shape.edges().len(),
        }
    }

    /// Name of the type: tet4, tet10, pyramid5, pyramid13, wedge6, wedge15, hex8, hex20.
    pub fn name(self) -> String {
        let shape = match self.shape {
            Shape::Tetrahedron => "tet",
            Shape::Pyramid => "pyramid",
            Shape::Wedge => "wedge",
            Shape::Hexahedron => "hex",
        };
        format!("{shape}{}", self.nodes())
    }

    /// Position of the type in [`ElementType::ALL`].
    pub fn number(self) -> usize {
        2 * self.shape as usize + self.order as usize
    }

    /// Number and corners of each face of an element with these nodes, sorted as by
    /// [`sorted_corners`].
    pub fn sorted_faces(self, nodes: &[u32]) -> impl Iterator<Item = (usize, [u32; 4])> {
        let faces = self.shape.faces().iter().enumerate();
        faces.map(|(f, corners)| {
            let mut sorted = [u32::MAX; 4];
            for (corner, &i) in sorted.iter_mut().zip(*corners) {
                *corner = nodes[i];
            }
            sorted.sort_unstable();
            (f, sorted)
        })
    }

    /// Nodes of face number `face` of an element with these nodes, as in a facet; seen from outside
    /// they run counter-clockwise.
    pub fn face_of(self, face: usize, nodes: &[u32]) -> Vec<u32> {
        self.face(face).into_iter().map(|i| nodes[i]).collect()
    }

    /// Nodes of face number `face`: its corners as in [`Shape::faces`], then the middle between
    /// each corner and the next, as in a facet.
    pub fn face(self, face: usize) -> Vec<usize> {
        let corners = self.shape.faces()[face];
        let mut nodes = corners.to_vec();
        if self.order == ElementOrder::Quadratic {
            let edges = self.shape.edges();
            nodes.extend((0..corners.len()).map(|i| {
                let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
                let edge = edges.iter().position(|e| *e == [a.min(b), a.max(b)]);
                self.shape.corners() + edge.expect("the sides of a face are edges")
            }));
        }
        nodes
    }
}

/// Corners of a facet of `nodes` nodes: 3 or 6 nodes are a triangle, 4 or 8 a quadrilateral. The
/// middles of its edges follow its corners, each between a corner and the next.
pub fn facet_corners(nodes: usize) -> usize {
    match nodes {
        3 | 6 => 3,
        _ => 4,
    }
}

/// Corners of an element or a facet, ascending and padded. Two results are equal if the corners are
/// the same.
pub fn sorted_corners<const N: usize>(corners: &[u32]) -> [u32; N] {
    let mut sorted = [u32::MAX; N];
    sorted[..corners.len()].copy_from_slice(corners);
    sorted.sort_unstable();
    sorted
}

/// Corners of a facet, ascending and padded, by which facets on the same corners are alike.
pub fn sorted_facet(nodes: &[u32]) -> [u32; 4] {
    sorted_corners(&nodes[..facet_corners(nodes.len())])
}

/// Nodes and tags of elements (or of facets), element after element.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Connectivity {
    /// Index of the first node of each element, and the end of the last one.
    offsets: Vec<usize>,
    nodes: Vec<u32>,
    tags: Vec<u64>,
}

/// Type of a solid element.
fn solid_of(nodes: &[u32]) -> ElementType {
    ElementType::from_node_count(nodes.len())
        .expect("readers keep the eight types of solid elements alone")
}

impl Default for Connectivity {
    fn default() -> Self {
        Self {
            offsets: vec![0],
            nodes: Vec::new(),
            tags: Vec::new(),
        }
    }
}

impl Connectivity {
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.tags.len()
    }

    /// Returns `true` if there are no elements.
    pub fn is_empty(&self) -> bool {
        self.tags.is_empty()
    }

    /// Adds an element; `tag` is its number in the file.
    pub fn push(&mut self, tag: u64, nodes: impl IntoIterator<Item = u32>) {
        self.nodes.extend(nodes);
        self.offsets.push(self.nodes.len());
        self.tags.push(tag);
    }

    /// Nodes of element `e`.
    pub fn element_nodes(&self, e: usize) -> &[u32] {
        &self.nodes[self.offsets[e]..self.offsets[e + 1]]
    }

    /// Nodes of each element.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> + Clone {
        self.offsets.windows(2).map(|o| &self.nodes[o[0]..o[1]])
    }

    /// Tag of each element in the file.
    pub fn tags(&self) -> &[u64] {
        &self.tags
    }

    /// Number of solid elements of each type.
    pub fn types(&self) -> BTreeMap<ElementType, usize> {
        let mut counts = BTreeMap::new();
        for (element, _) in self.solids() {
            *counts.entry(element).or_default() += 1;
        }
        counts
    }

    /// Type and nodes of each element of a list of solid ones.
    pub fn solids(&self) -> impl Iterator<Item = (ElementType, &[u32])> + Clone {
        self.iter().map(|nodes| (solid_of(nodes), nodes))
    }

    /// Type and nodes of element `e` of a list of solid ones.
    pub fn solid(&self, e: usize) -> (ElementType, &[u32]) {
        (solid_of(self.element_nodes(e)), self.element_nodes(e))
    }

    /// Connectivity after some nodes are dropped: the elements all of whose nodes remain, with the
    /// new numbers of these. The second value is the new number of each element.
    pub fn retain_nodes(&self, node: &[Option<u32>]) -> (Self, Vec<Option<u32>>) {
        let (mut left, mut numbers) = (Self::default(), Vec::with_capacity(self.len()));
        for (nodes, &tag) in self.iter().zip(&self.tags) {
            let nodes: Option<Vec<u32>> = nodes.iter().map(|&n| node[n as usize]).collect();
            numbers.push(nodes.map(|nodes| {
                left.push(tag, nodes);
                left.len() as u32 - 1
            }));
        }
        (left, numbers)
    }

    /// Nodes of all elements, element after element.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Adds `by` to every tag.
    pub fn shift_tags(&mut self, by: u64) {
        self.tags.iter_mut().for_each(|tag| *tag += by);
    }

    /// Like [`Connectivity::nodes`], for renumbering.
    pub fn nodes_mut(&mut self) -> &mut [u32] {
        &mut self.nodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_number_of_nodes_says_the_type() {
        for (number, element) in ElementType::ALL.into_iter().enumerate() {
            assert_eq!(element.number(), number);
            assert_eq!(ElementType::from_node_count(element.nodes()), Some(element));
        }
        assert_eq!(ElementType::from_node_count(27), None);
    }

    /// Euler's formula, and every edge on two faces and passed once in each sense: the faces close.
    #[test]
    fn faces_close_and_turn_alike() {
        for shape in Shape::ALL {
            let (edges, faces) = (shape.edges(), shape.faces());
            assert_eq!(shape.corners() + faces.len(), edges.len() + 2);
            let sides = faces.iter().flat_map(|face| {
                (0..face.len()).map(move |i| (face[i], face[(i + 1) % face.len()]))
            });
            let sides: Vec<_> = sides.collect();
            let distinct: BTreeSet<_> = sides.iter().copied().collect();
            assert_eq!(
                (sides.len(), distinct.len()),
                (2 * edges.len(), 2 * edges.len())
            );
            for &[a, b] in edges {
                assert!(a < b && distinct.contains(&(a, b)) && distinct.contains(&(b, a)));
            }
        }
    }

    #[test]
    fn middles_of_a_face_lie_between_its_corners() {
        for element in ElementType::ALL
            .into_iter()
            .filter(|e| e.order == ElementOrder::Quadratic)
        {
            for (f, corners) in element.shape.faces().iter().enumerate() {
                let nodes = element.face(f);
                assert_eq!(nodes[..corners.len()], **corners);
                assert_eq!(facet_corners(nodes.len()), corners.len());
                for (i, middle) in nodes[corners.len()..].iter().enumerate() {
                    let [a, b] = element.shape.edges()[middle - element.shape.corners()];
                    let next = corners[(i + 1) % corners.len()];
                    assert!([a, b] == [corners[i], next] || [b, a] == [corners[i], next]);
                }
            }
        }
    }

    #[test]
    fn elements_of_several_types_stand_in_one_list() {
        let mut list = Connectivity::default();
        list.push(7, [0, 1, 2, 3]);
        list.push(9, [4, 5, 6, 7, 8]);
        assert_eq!(
            (list.len(), list.element_nodes(1), list.tags()),
            (2, &[4, 5, 6, 7, 8][..], &[7, 9][..])
        );
        assert_eq!(list.iter().map(<[u32]>::len).collect::<Vec<_>>(), [4, 5]);
    }
}
