//! Look-up of mesh groups by name, and the faces of bodies in them.

use std::collections::HashMap;

use super::ModelError;
use dovetail_mesh::element::{facet_corners, sorted_facet};
use dovetail_mesh::{Group, Mesh};

pub(super) fn kind(dimension: u8) -> &'static str {
    match dimension {
        0 => "point",
        1 => "curve",
        2 => "surface",
        _ => "volume",
    }
}

/// Finds a group by name that has the wanted dimension (`None`: any) and is not empty.
pub(super) fn find_group<'a>(
    mesh: &'a Mesh,
    name: &str,
    wanted: Option<u8>,
    used_by: &str,
) -> Result<&'a Group, ModelError> {
    let available = || names_of_dimensions(mesh, |d| wanted.is_none_or(|wanted| d == wanted));
    let Some(group) = mesh.groups.get(name) else {
        return Err(ModelError::UnknownGroup {
            used_by: used_by.to_string(),
            name: name.to_string(),
            wanted: wanted.map_or("any", kind),
            available: available(),
        });
    };
    if let Some(wanted) = wanted.filter(|&d| d != group.dimension) {
        return Err(ModelError::GroupDimension {
            used_by: used_by.to_string(),
            name: name.to_string(),
            found: kind(group.dimension),
            wanted: kind(wanted),
            available: available(),
        });
    }
    if group.nodes.is_empty() {
        return Err(ModelError::EmptyGroup {
            used_by: used_by.to_string(),
            name: name.to_string(),
        });
    }
    Ok(group)
}

/// Number of nodes, and the tags of the first few.
pub(super) fn first_tags<'a>(
    mesh: &Mesh,
    nodes: impl Iterator<Item = &'a u32>,
) -> (usize, Vec<u64>) {
    let tags: Vec<u64> = nodes.map(|&n| mesh.node_tags[n as usize]).collect();
    (tags.len(), tags.into_iter().take(5).collect())
}

/// Finds a surface group, or a set of nodes that serves as one.
pub(super) fn find_surface<'a>(
    mesh: &'a Mesh,
    name: &str,
    used_by: &str,
) -> Result<&'a Group, ModelError> {
    match mesh.groups.get(name) {
        Some(group) if group.dimension == 0 => find_group(mesh, name, Some(0), used_by),
        Some(_) => find_group(mesh, name, Some(2), used_by),
        None => Err(ModelError::UnknownGroup {
            used_by: used_by.to_string(),
            name: name.to_string(),
            wanted: "flank",
            available: names_of_dimensions(mesh, |d| d == 0 || d == 2),
        }),
    }
}

/// Names of the groups of some dimensions.
fn names_of_dimensions(mesh: &Mesh, fits: impl Fn(u8) -> bool) -> Vec<String> {
    let groups = mesh
        .groups
        .iter()
        .filter(|(_, group)| fits(group.dimension));
    groups.map(|(name, _)| name.clone()).collect()
}

/// Face of a body that belongs to a group.
pub(super) struct Face {
    /// Tag of the facet; where the group is a set of nodes, of the element behind.
    pub tag: u64,
    /// Number of elements of the body that the face bounds: one where it is on the surface.
    pub bounded: usize,
    /// Nodes, counter-clockwise seen from outside the element behind; empty where it bounds none.
    pub nodes: Vec<u32>,
}

impl Face {
    /// Corner nodes of the face.
    pub(crate) fn corners(&self) -> &[u32] {
        &self.nodes[..facet_corners(self.nodes.len())]
    }
}

/// Origin of the surface of a body.
pub(super) struct Outside<'a> {
    /// Solid elements of the body.
    pub elements: &'a [u32],
    /// Tags and nodes of the facets that are the surface of a body without elements.
    pub facets: Vec<(u64, &'a [u32])>,
}

/// Faces of a group on a body. For a surface they are its facets, in their order. For a set of
/// nodes they are the faces on the surface of the body all of whose nodes are in it. The surface of
/// a body without elements is its facets, counter-clockwise seen from outside.
pub(super) fn faces(mesh: &Mesh, group: &Group, outside: &Outside<'_>) -> Vec<Face> {
    let is_in_set = |node: &u32| group.nodes.binary_search(node).is_ok();
    // Most faces have a corner outside.
    let within = |corners: &[u32; 4], nodes: &dyn Fn() -> Vec<u32>| {
        corners.iter().all(|c| *c == u32::MAX || is_in_set(c)) && nodes().iter().all(is_in_set)
    };
    match group.dimension {
        0 => bounding(mesh, &[], outside, Some(&within)),
        _ => bounding(mesh, &group.elements, outside, None),
    }
}

/// Faces on the surface of a body that have one of these nodes, ascending.
pub(super) fn faces_touching(mesh: &Mesh, nodes: &[u32], outside: &Outside<'_>) -> Vec<Face> {
    let is_in_set = |node: &u32| nodes.binary_search(node).is_ok();
    let touches = |_: &[u32; 4], nodes: &dyn Fn() -> Vec<u32>| nodes().iter().any(is_in_set);
    bounding(mesh, &[], outside, Some(&touches))
}

/// Chooses a face by its sorted corners and its nodes.
type Chooses<'a> = &'a dyn Fn(&[u32; 4], &dyn Fn() -> Vec<u32>) -> bool;

/// Faces of the elements of a body that are these facets of the mesh, in their order, or those on
/// its surface that are chosen.
fn bounding(
    mesh: &Mesh,
    facets: &[u32],
    outside: &Outside<'_>,
    chosen: Option<Chooses<'_>>,
) -> Vec<Face> {
    let mut all: Vec<Face> = Vec::new();
    let mut number: HashMap<[u32; 4], usize> = HashMap::new();
    for &f in facets {
        number
            .entry(sorted_facet(mesh.facets.element_nodes(f as usize)))
            .or_insert(all.len());
        all.push(Face {
            tag: mesh.facets.tags()[f as usize],
            bounded: 0,
            nodes: Vec::new(),
        });
    }
    let mut bounds = |corners: [u32; 4], tag: u64, nodes: &dyn Fn() -> Vec<u32>| {
        let at = match number.get(&corners) {
            Some(&at) => at,
            None if chosen.is_some_and(|chosen| chosen(&corners, nodes)) => {
                number.insert(corners, all.len());
                all.push(Face {
                    tag,
                    bounded: 0,
                    nodes: Vec::new(),
                });
                all.len() - 1
            }
            None => return,
        };
        all[at].bounded += 1;
        all[at].nodes = nodes();
    };
    for &e in outside.elements {
        let (element, nodes) = mesh.elements.solid(e as usize);
        let tag = mesh.elements.tags()[e as usize];
        for (f, corners) in element.sorted_faces(nodes) {
            bounds(corners, tag, &|| element.face_of(f, nodes));
        }
    }
    for &(tag, nodes) in &outside.facets {
        bounds(sorted_facet(nodes), tag, &|| nodes.to_vec());
    }
    if chosen.is_some() {
        all.retain(|face| face.bounded == 1);
    }
    all
}
