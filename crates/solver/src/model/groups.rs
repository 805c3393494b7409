//! Groups of the mesh, looked up by name, and the tetrahedra that the facets of one bound.

use std::collections::HashMap;

use super::ModelError;
use crate::mesh::{Group, Mesh};

pub(super) fn kind(dimension: u8) -> &'static str {
    match dimension {
        0 => "point",
        1 => "curve",
        2 => "surface",
        _ => "volume",
    }
}

/// A group by name, of the wanted dimension (`None`: any) and not empty.
pub(super) fn find_group<'a>(
    mesh: &'a Mesh,
    name: &str,
    wanted: Option<u8>,
    used_by: &str,
) -> Result<&'a Group, ModelError> {
    let available = || {
        let fits = |g: &Group| wanted.is_none_or(|d| g.dimension == d);
        let groups = mesh.groups.iter().filter(|(_, g)| fits(g));
        groups.map(|(name, _)| name.clone()).collect()
    };
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

/// How many, and the tags of the first few.
pub(super) fn first_tags<'a>(
    mesh: &Mesh,
    nodes: impl Iterator<Item = &'a u32>,
) -> (usize, Vec<u64>) {
    let tags: Vec<u64> = nodes.map(|&n| mesh.node_tags[n as usize]).collect();
    (tags.len(), tags.into_iter().take(5).collect())
}

/// Of each facet of a group, how many of the tetrahedra `tets` it bounds, and the corner of one of
/// these that is opposite to it.
pub(super) fn bounded_tets(mesh: &Mesh, group: &Group, tets: &[u32]) -> Vec<(usize, u32)> {
    let key = |&f: &u32| sorted_corners(mesh.facet(f as usize));
    let mut bounded: HashMap<[u32; 3], (usize, u32)> =
        group.elements.iter().map(|f| (key(f), (0, 0))).collect();
    for &e in tets {
        let t = mesh.tet(e as usize);
        for k in 0..4 {
            let face = [t[(k + 1) % 4], t[(k + 2) % 4], t[(k + 3) % 4]];
            if let Some((count, opposite)) = bounded.get_mut(&sorted_corners(&face)) {
                *count += 1;
                *opposite = t[k];
            }
        }
    }
    group.elements.iter().map(|f| bounded[&key(f)]).collect()
}

/// The corners of a facet, by which two facets are known for the same.
pub(super) fn sorted_corners(nodes: &[u32]) -> [u32; 3] {
    let mut corners = [nodes[0], nodes[1], nodes[2]];
    corners.sort_unstable();
    corners
}
