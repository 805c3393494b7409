//! Steady loads of the scene tied to nodes and facets.

use super::builder::BodyBuilder;
use super::groups::{faces, find_group, first_tags, kind};
use super::{ModelError, StaticLoad, Traction};
use crate::mesh::{Group, Mesh};
use crate::model::{LoadKind, LoadSpec};

/// Load number `number` of the scene: per body it acts on, what acts there. Nodes are local.
pub(super) fn static_load(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    spec: &LoadSpec,
    number: usize,
) -> Result<Vec<(usize, StaticLoad)>, ModelError> {
    let used_by = format!("load {}", number + 1);
    let group = find_group(mesh, &spec.on, None, &used_by)?;
    check_nodes(mesh, bodies, &spec.on, group, &used_by)?;
    match (group.dimension, spec.load) {
        (0, LoadKind::Force { vector_n }) => {
            let share = vector_n.map(|f| f / group.nodes.len() as f64);
            let of = |&n: &u32| bodies.iter().position(|b| b.has(n)).map(|b| (b, n));
            let point = |(b, n): (usize, u32)| {
                let node = bodies[b].local(n);
                let vector_n = share;
                (b, StaticLoad::Point { node, vector_n })
            };
            Ok(group.nodes.iter().filter_map(of).map(point).collect())
        }
        (2, load) | (0, load @ LoadKind::Pressure { .. }) => {
            let body = only_body(bodies, group, &spec.on, &used_by)?;
            let facets = outward_facets(mesh, group, &bodies[body], &used_by, &spec.on)?;
            let traction = match load {
                LoadKind::Force { vector_n } => Traction::Total(vector_n),
                LoadKind::Pressure { pressure_pa } => Traction::Pressure(pressure_pa),
            };
            Ok(vec![(body, StaticLoad::Surface { facets, traction })])
        }
        (dimension, load) => Err(ModelError::LoadDimension {
            used_by,
            group: spec.on.clone(),
            found: kind(dimension),
            wanted: match load {
                LoadKind::Force { .. } => "a surface or a point group",
                LoadKind::Pressure { .. } => "a surface group",
            },
        }),
    }
}

/// The body that has all nodes of a group.
pub(super) fn only_body(
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

/// Every node belongs to a body, and not all of them are fixed.
pub(super) fn check_nodes(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    name: &str,
    group: &Group,
    used_by: &str,
) -> Result<(), ModelError> {
    let is_elsewhere = |n: &&u32| !bodies.iter().any(|b| b.has(**n));
    let (count, tags) = first_tags(mesh, group.nodes.iter().filter(is_elsewhere));
    if count > 0 {
        return Err(ModelError::NodesElsewhere {
            used_by: used_by.to_string(),
            group: name.to_string(),
            count,
            tags,
        });
    }
    let is_fixed = |n: &&u32| bodies.iter().any(|b| b.has(**n) && b.is_fixed(**n));
    let (count, tags) = first_tags(mesh, group.nodes.iter().filter(is_fixed));
    if count == group.nodes.len() {
        return Err(ModelError::NodesFixed {
            used_by: used_by.to_string(),
            group: name.to_string(),
            count,
            tags,
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
    let faces = faces(mesh, group, body.elements());
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
