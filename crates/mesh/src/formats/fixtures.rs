//! Files of one geometry that gmsh wrote, and comparisons of what is read of them, for the tests of
//! the readers.

use std::collections::BTreeSet;

use super::Content;
use crate::element::{ElementType, Shape};
use crate::{Group, MeshError};

/// Bytes of a file of `meshes/elements`.
macro_rules! elements {
    ($file:literal) => {
        include_bytes!(concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../meshes/elements/",
            $file
        ))
    };
}
pub(super) use elements;

/// Groups of the geometry that have elements.
pub(super) const GROUPS: [&str; 6] = ["hexahedra", "wedges", "mixed", "base", "top", "side"];

/// Nodes of each element of a group, or of each facet.
#[track_caller]
pub(super) fn nodes_of<T: FromIterator<Vec<u32>>>(content: &Content, group: &str) -> T {
    let group = group_of(content, group);
    let list = match group.dimension {
        3 => &content.elements,
        _ => &content.facets,
    };
    let nodes = group
        .elements
        .iter()
        .map(|e| list.element_nodes(*e as usize).to_vec());
    nodes.collect()
}

/// Reader of included files, for a text that includes none.
pub(super) fn nothing_included(name: &str) -> Result<Vec<u8>, MeshError> {
    panic!("{name} is included");
}

/// Remarks of a reader, one a line.
pub(super) fn remarks(content: &Content) -> String {
    content.remarks.join("\n")
}

/// Group of this name.
#[track_caller]
fn group_of<'a>(content: &'a Content, group: &str) -> &'a Group {
    let found = content.groups.get(group);
    found.unwrap_or_else(|| panic!("no {group} in {:?}", content.groups.keys()))
}

/// Tags of the nodes of a group.
#[track_caller]
pub(super) fn node_tags(content: &Content, group: &str) -> Vec<u64> {
    let nodes = group_of(content, group).nodes.iter();
    nodes.map(|n| content.node_tags[*n as usize]).collect()
}

/// Tags of the elements of a group (of its facets, if it is a surface).
#[track_caller]
pub(super) fn element_tags(content: &Content, group: &str) -> Vec<u64> {
    let group = group_of(content, group);
    let list = match group.dimension {
        2 => &content.facets,
        _ => &content.elements,
    };
    let tags = group.elements.iter().map(|e| list.tags()[*e as usize]);
    tags.collect()
}

/// Checks that numbers agree within a tolerance, one by one.
#[track_caller]
pub(super) fn assert_near<const N: usize>(a: &[[f64; N]], b: &[[f64; N]], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.as_flattened().iter().zip(b.as_flattened()) {
        assert!((a - b).abs() < tolerance, "{a} {b}");
    }
}

/// Checks the nodes of all solids of a mesh of gmsh with straight edges: each middle lies halfway
/// between its corners. Returns the types of the solids.
pub(super) fn assert_middles(content: &Content) -> BTreeSet<ElementType> {
    for (ElementType { shape, .. }, nodes) in content.elements.solids() {
        let at = |i: usize| content.nodes[nodes[i] as usize];
        for (middle, [a, b]) in (shape.corners()..nodes.len()).zip(shape.edges()) {
            let between = [0, 1, 2].map(|axis| 0.5 * (at(*a)[axis] + at(*b)[axis]));
            assert_near(&[at(middle)], &[between], 1e-9);
        }
    }
    content.elements.types().into_keys().collect()
}

/// Types of the solids of second order.
pub(super) fn quadratic(shapes: &[Shape]) -> BTreeSet<ElementType> {
    let order = crate::ElementOrder::Quadratic;
    let types = shapes.iter().map(|shape| ElementType::new(*shape, order));
    types.collect()
}
