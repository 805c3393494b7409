//! Loads of the scene, steady ones and one unit of harmonic ones, tied to nodes and facets.

use super::builder::BodyBuilder;
use super::groups::{faces, find_group, first_tags, kind};
use super::{AppliedLoad, ModelError, Traction};
use crate::model::{LoadKind, LoadSpec};
use dovetail_mesh::{Group, Mesh};

/// Converts a load of the scene to a load on each body that it acts on. Nodes are local.
pub(super) fn applied_load(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    spec: &LoadSpec,
    used_by: &str,
) -> Result<Vec<(usize, AppliedLoad)>, ModelError> {
    let group = find_group(mesh, &spec.on, None, used_by)?;
    match (group.dimension, spec.load) {
        (0 | 1, LoadKind::Force { vector_n }) => {
            check_nodes(mesh, bodies, group, vector_n, used_by, &spec.on)?;
            let share = vector_n.map(|f| f / group.nodes.len() as f64);
            let of = |&n: &u32| bodies.iter().position(|b| b.has(n)).map(|b| (b, n));
            let point = |(b, n): (usize, u32)| {
                let node = bodies[b].local(n);
                let vector_n = share;
                (b, AppliedLoad::Point { node, vector_n })
            };
            Ok(group.nodes.iter().filter_map(of).map(point).collect())
        }
        (0 | 2, load) => {
            let (vector, traction) = match load {
                LoadKind::Force { vector_n } => (vector_n, Traction::Total(vector_n)),
                LoadKind::Traction { vector_pa } => (vector_pa, Traction::Uniform(vector_pa)),
                LoadKind::Pressure { pressure_pa } => ([1.0; 3], Traction::Pressure(pressure_pa)),
            };
            let (body, facets) = surface(mesh, bodies, &spec.on, vector, used_by)?;
            Ok(vec![(body, AppliedLoad::Surface { facets, traction })])
        }
        (dimension, load) => Err(ModelError::LoadDimension {
            used_by: used_by.to_string(),
            group: spec.on.clone(),
            found: kind(dimension),
            wanted: match load {
                LoadKind::Force { .. } => "a point, a curve or a surface group",
                LoadKind::Traction { .. } | LoadKind::Pressure { .. } => "a surface group",
            },
        }),
    }
}

/// Body that a surface belongs to, and its facets in local nodes, counter-clockwise seen from
/// outside. `vector` is nonzero along the axes along which something acts on it.
pub(super) fn surface(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    name: &str,
    vector: [f64; 3],
    used_by: &str,
) -> Result<(usize, Vec<Vec<u32>>), ModelError> {
    let group = find_group(mesh, name, None, used_by)?;
    if !matches!(group.dimension, 0 | 2) {
        return Err(ModelError::LoadDimension {
            used_by: used_by.to_string(),
            group: name.to_string(),
            found: kind(group.dimension),
            wanted: "a surface group",
        });
    }
    check_nodes(mesh, bodies, group, vector, used_by, name)?;
    let body = unique_body(bodies, group, name, used_by)?;
    let facets = outward_facets(mesh, group, &bodies[body], used_by, name)?;
    Ok((body, facets))
}

/// Body that has all nodes of a group.
pub(super) fn unique_body(
    bodies: &[BodyBuilder],
    group: &Group,
    name: &str,
    used_by: &str,
) -> Result<usize, ModelError> {
    let has_all = |body: &BodyBuilder| group.nodes.iter().all(|&n| body.has(n));
    let body = bodies.iter().position(has_all);
    body.ok_or_else(|| ModelError::SeveralBodies {
        used_by: used_by.to_string(),
        group: name.to_string(),
    })
}

/// Checks that every node belongs to a body.
pub(super) fn check_owned(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    group: &Group,
    used_by: &str,
    name: &str,
) -> Result<(), ModelError> {
    let is_elsewhere = |n: &&u32| !bodies.iter().any(|b| b.has(**n));
    match first_tags(mesh, group.nodes.iter().filter(is_elsewhere)) {
        (0, _) => Ok(()),
        (count, tags) => Err(ModelError::NodesElsewhere {
            used_by: used_by.to_string(),
            group: name.to_string(),
            count,
            tags,
        }),
    }
}

/// Returns `true` if a node does not move on some body that has it.
pub(super) fn is_fixed(bodies: &[BodyBuilder], node: u32) -> bool {
    bodies.iter().any(|b| b.has(node) && b.is_fixed(node))
}

/// Checks that every node belongs to a body, and that not all of them are held against `vector`.
pub(super) fn check_nodes(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    group: &Group,
    vector: [f64; 3],
    used_by: &str,
    name: &str,
) -> Result<(), ModelError> {
    check_owned(mesh, bodies, group, used_by, name)?;
    let (used_by, name) = (used_by.to_string(), name.to_string());
    let is_fixed = |n: &&u32| is_fixed(bodies, **n);
    let is_held = |n: &&u32| {
        let held = |b: &BodyBuilder| {
            let mut axes = vector.iter().enumerate();
            axes.all(|(axis, v)| *v == 0.0 || b.is_held(**n, axis))
        };
        bodies.iter().any(|b| b.has(**n) && held(b))
    };
    let (fixed, tags) = first_tags(mesh, group.nodes.iter().filter(is_fixed));
    if fixed == group.nodes.len() {
        return Err(ModelError::NodesFixed {
            used_by,
            group: name,
            count: fixed,
            tags,
        });
    }
    let does_nothing = |n: &&u32| is_fixed(n) || is_held(n);
    // Without a force all axes would count as held.
    if vector != [0.0; 3] && group.nodes.iter().all(|n| does_nothing(&n)) {
        return Err(ModelError::NodesHeld {
            used_by,
            group: name,
            count: group.nodes.len(),
        });
    }
    Ok(())
}

/// Facets of a group in local nodes, counter-clockwise seen from outside.
pub(super) fn outward_facets(
    mesh: &Mesh,
    group: &Group,
    body: &BodyBuilder,
    used_by: &str,
    name: &str,
) -> Result<Vec<Vec<u32>>, ModelError> {
    let faces = faces(mesh, group, &body.outside(mesh));
    if faces.is_empty() {
        return Err(ModelError::NoFaces {
            used_by: used_by.to_string(),
            group: name.to_string(),
            nodes: group.nodes.len(),
            body: body.name().to_string(),
        });
    }
    if let Some(face) = faces.iter().find(|face| face.bounded != 1) {
        return Err(ModelError::FacetInside {
            used_by: used_by.to_string(),
            group: name.to_string(),
            tag: face.tag,
            body: body.name().to_string(),
        });
    }
    let local = |face: &super::groups::Face| face.nodes.iter().map(|&n| body.local(n)).collect();
    Ok(faces.iter().map(local).collect())
}
