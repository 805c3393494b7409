//! Elements in Gmsh's files of any version of the format: their types, the order of their nodes,
//! and their groups.

use super::sections::Names;
use crate::element::{ElementOrder, ElementType, Shape};

/// Dimension and number of nodes of an element by Gmsh's number of its type. Elements with nodes
/// inside faces or elements are included.
pub fn dimension_and_nodes(kind: u64) -> Option<(u8, usize)> {
    Some(match kind {
        15 => (0, 1),
        1 => (1, 2),
        8 => (1, 3),
        2 => (2, 3),
        3 => (2, 4),
        9 => (2, 6),
        10 => (2, 9),
        16 => (2, 8),
        4 => (3, 4),
        5 => (3, 8),
        6 => (3, 6),
        7 => (3, 5),
        11 => (3, 10),
        12 => (3, 27),
        13 => (3, 18),
        14 => (3, 14),
        17 => (3, 20),
        18 => (3, 15),
        19 => (3, 13),
        _ => return None,
    })
}

/// Types with nodes inside faces or elements, which are not read.
pub const COMPLETE: [u64; 4] = [10, 12, 13, 14];

/// The name of a physical group; one without a name is called after its dimension and tag, such as
/// `surface 12`.
pub(super) fn group_name(names: &Names, dimension: u8, tag: u32) -> String {
    names.get(&(dimension, tag)).cloned().unwrap_or_else(|| {
        let kind = ["point", "curve", "surface", "volume"][usize::from(dimension)];
        format!("{kind} {tag}")
    })
}

/// Position in Gmsh's element of each of our nodes: node `i` is Gmsh's node
/// `from_gmsh(element)[i]`. Corners are the same; the middles of the edges follow another list of
/// edges. Facets and lines need no table, because Gmsh's order is ours.
pub fn from_gmsh(element: ElementType) -> &'static [usize] {
    use ElementOrder::{Linear, Quadratic};
    const CORNERS: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
    match (element.shape, element.order) {
        (shape, Linear) => &CORNERS[..shape.corners()],
        (Shape::Tetrahedron, Quadratic) => &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
        (Shape::Pyramid, Quadratic) => &[0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12],
        (Shape::Wedge, Quadratic) => &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11],
        (Shape::Hexahedron, Quadratic) => &[
            0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15,
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_node_has_one_place() {
        for element in ElementType::ALL {
            let mut places = from_gmsh(element).to_vec();
            places.sort_unstable();
            assert!(places.into_iter().eq(0..element.nodes()), "{element:?}");
        }
    }
}
