//! Steady loads of the scene tied to nodes and facets.

use super::builder::BodyBuilder;
use super::groups::{bounded_tets, find_group, first_tags, kind};
use super::{ModelError, StaticLoad, Traction};
use crate::mesh::{ElementOrder, Group, Mesh};
use crate::model::{LoadKind, LoadSpec};
use dovetail_numerics::space::{cross, dot, sub};

/// Load number `number` of the scene: per body it acts on, what acts there. Nodes are local.
pub(super) fn static_load(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    spec: &LoadSpec,
    number: usize,
) -> Result<Vec<(usize, StaticLoad)>, ModelError> {
    let used_by = format!("load {}", number + 1);
    let group = find_group(mesh, &spec.on, None, &used_by)?;
    check_nodes(mesh, bodies, spec, group, &used_by)?;
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
        (2, load) => {
            let body = bodies
                .iter()
                .position(|b| group.nodes.iter().all(|&n| b.has(n)));
            let Some(body) = body else {
                return Err(ModelError::LoadOnBoth {
                    used_by,
                    group: spec.on.clone(),
                });
            };
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

/// Every node belongs to a body, and not all of them are fixed.
fn check_nodes(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    spec: &LoadSpec,
    group: &Group,
    used_by: &str,
) -> Result<(), ModelError> {
    let is_elsewhere = |n: &&u32| !bodies.iter().any(|b| b.has(**n));
    let (count, tags) = first_tags(mesh, group.nodes.iter().filter(is_elsewhere));
    if count > 0 {
        return Err(ModelError::NodesElsewhere {
            used_by: used_by.to_string(),
            group: spec.on.clone(),
            count,
            tags,
        });
    }
    let is_fixed = |n: &&u32| bodies.iter().any(|b| b.has(**n) && b.is_fixed(**n));
    let (count, tags) = first_tags(mesh, group.nodes.iter().filter(is_fixed));
    if count == group.nodes.len() {
        return Err(ModelError::NodesFixed {
            used_by: used_by.to_string(),
            group: spec.on.clone(),
            count,
            tags,
        });
    }
    Ok(())
}

/// Facets of a group in local nodes, turned so that they are counter-clockwise seen from outside.
fn outward_facets(
    mesh: &Mesh,
    group: &Group,
    body: &BodyBuilder,
    used_by: &str,
    name: &str,
) -> Result<Vec<u32>, ModelError> {
    let behind = bounded_tets(mesh, group, body.tets());
    let x = |n: u32| mesh.nodes_m[n as usize];
    let mut facets = Vec::with_capacity(group.elements.len() * mesh.order.nodes_per_facet());
    for (&f, (count, opposite)) in group.elements.iter().zip(behind) {
        let nodes = mesh.facet(f as usize);
        if count != 1 {
            return Err(ModelError::LoadInside {
                used_by: used_by.to_string(),
                group: name.to_string(),
                tag: mesh.facet_tags[f as usize],
                body: body.name().to_string(),
            });
        }
        let [a, b, c] = [x(nodes[0]), x(nodes[1]), x(nodes[2])];
        let outward = dot(cross(sub(b, a), sub(c, a)), sub(a, x(opposite))) > 0.0;
        let order: &[usize] = match (mesh.order, outward) {
            (ElementOrder::Linear, true) => &[0, 1, 2],
            (ElementOrder::Linear, false) => &[0, 2, 1],
            (ElementOrder::Quadratic, true) => &[0, 1, 2, 3, 4, 5],
            (ElementOrder::Quadratic, false) => &[0, 2, 1, 5, 4, 3],
        };
        facets.extend(order.iter().map(|&i| body.local(nodes[i])));
    }
    Ok(facets)
}
