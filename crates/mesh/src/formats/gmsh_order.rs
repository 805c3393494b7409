//! Elements in Gmsh's files of any version of the format: their types, the order of their nodes,
//! and their groups.

use std::collections::BTreeMap;

use super::content::Content;
use super::sections::{ANY_DIMENSION, Names};
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

/// Names of physical groups by (dimension, tag): of those that have names, and of those that are
/// `used`. One without a name is called after its dimension and tag, such as `surface 12`. If
/// groups of several dimensions have one name, the highest dimension keeps it, and the others get
/// a word behind it, such as `wall (curve)`.
pub(super) fn group_names(
    names: &Names,
    used: impl IntoIterator<Item = (u8, u32)>,
) -> BTreeMap<(u8, u32), String> {
    let mut group_names: BTreeMap<(u8, u32), String> = BTreeMap::new();
    for (&(dimension, tag), name) in names {
        if dimension != ANY_DIMENSION {
            group_names.insert((dimension, tag), name.clone());
        }
    }
    for (dimension, tag) in used {
        let default_name = || format!("{} {tag}", KINDS[usize::from(dimension)]);
        let of_all = names.get(&(ANY_DIMENSION, tag));
        let name = group_names.entry((dimension, tag));
        name.or_insert_with(|| of_all.cloned().unwrap_or_else(default_name));
    }
    let mut highest: BTreeMap<String, u8> = BTreeMap::new();
    for ((dimension, _), name) in &group_names {
        let known = highest.entry(name.clone()).or_default();
        *known = (*known).max(*dimension);
    }
    for ((dimension, _), name) in &mut group_names {
        if highest[name] != *dimension {
            *name += &format!(" ({})", KINDS[usize::from(*dimension)]);
        }
    }
    group_names
}

/// Names of the entities of the geometry, which are the groups of a file without physical groups.
/// A remark says so.
pub(super) fn entity_names(
    used: impl IntoIterator<Item = (u8, u32)>,
    content: &mut Content,
) -> BTreeMap<(u8, u32), String> {
    let names = group_names(&Names::new(), used);
    if let Some(name) = names.values().next_back() {
        content.remarks.push(format!(
            "The file has no physical groups: its groups are the entities of the geometry, such as \
             `{name}`."
        ));
    }
    names
}

/// Words for groups by their dimension.
const KINDS: [&str; 4] = ["point", "curve", "surface", "volume"];

/// Position in Gmsh's element of each of our nodes: node `i` is Gmsh's node
/// `gmsh_positions(element)[i]`. Corners are the same; the middles of the edges follow another list
/// of edges. Facets and lines need no table, because Gmsh's order is ours.
pub fn gmsh_positions(element: ElementType) -> &'static [usize] {
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
            let mut places = gmsh_positions(element).to_vec();
            places.sort_unstable();
            assert!(places.into_iter().eq(0..element.nodes()), "{element:?}");
        }
    }
}
