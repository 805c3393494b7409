//! Observed displacements and strains, tied to nodes.

use std::collections::BTreeMap;

use super::builder::BodyBuilder;
use super::groups::{Face, faces, faces_touching, find_group, first_tags, kind};
use super::loads::{check_owned, is_fixed, unique_body};
use super::{BodyNode, ModelError, Observation};
use crate::model::ObservationSpec;
use dovetail_dynamics::reduced::ObservedQuantity;
use dovetail_mesh::facet::{Elongation, elongation};
use dovetail_mesh::{Group, Mesh};
use dovetail_numerics::space::add_scaled;

/// Largest sine of the angle between the direction of a strain gauge and a face under it: 30
/// degrees.
const STEEPEST: f64 = 0.5;

/// Ties an observation to the nodes of its group. A displacement is the mean of these nodes. A
/// strain is the mean over the area of the faces of the group; of a group of nodes without faces,
/// over the faces that touch one of them and along which the direction lies.
pub(super) fn observation(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    spec: &ObservationSpec,
) -> Result<Observation, ModelError> {
    let used_by = format!("observation `{}`", spec.name);
    let group = find_group(mesh, &spec.points, None, &used_by)?;
    check_owned(mesh, bodies, group, &used_by, &spec.points)?;
    let terms = match spec.quantity {
        ObservedQuantity::Displacement => displacement(mesh, bodies, group, spec, used_by)?,
        ObservedQuantity::Strain => strain(mesh, bodies, group, spec, used_by)?,
    };
    Ok(Observation {
        name: spec.name.clone(),
        quantity: spec.quantity,
        terms,
    })
}

type Terms = Vec<(BodyNode, [f64; 3])>;

fn displacement(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    group: &Group,
    spec: &ObservationSpec,
    used_by: String,
) -> Result<Terms, ModelError> {
    let nodes = &group.nodes;
    let (count, tags) = first_tags(mesh, nodes.iter().filter(|&&n| is_fixed(bodies, n)));
    if count > 0 {
        return Err(ModelError::NodesFixed {
            used_by,
            group: spec.points.clone(),
            count,
            tags,
        });
    }
    let share = 1.0 / nodes.len() as f64;
    let term = |&n: &u32| {
        let body = bodies.iter().position(|b| b.has(n))?;
        let node = bodies[body].local(n);
        Some((BodyNode { body, node }, spec.direction.map(|d| d * share)))
    };
    Ok(nodes.iter().filter_map(term).collect())
}

fn strain(
    mesh: &Mesh,
    bodies: &[BodyBuilder],
    group: &Group,
    spec: &ObservationSpec,
    used_by: String,
) -> Result<Terms, ModelError> {
    if !matches!(group.dimension, 0..=2) {
        return Err(ModelError::GaugeDimension {
            used_by,
            group: spec.points.clone(),
            found: kind(group.dimension),
        });
    }
    let body = unique_body(bodies, group, &spec.points, &used_by)?;
    let on = &bodies[body];
    let outside = on.outside(mesh);
    let group_faces = match group.dimension {
        1 => Vec::new(),
        _ => faces(mesh, group, &outside),
    };
    let whole = !group_faces.is_empty();
    let faces_used = match whole {
        true => group_faces,
        false => faces_touching(mesh, &group.nodes, &outside),
    };
    if let Some(face) = faces_used.iter().find(|face| face.bounded != 1) {
        return Err(ModelError::FacetInside {
            used_by,
            group: spec.points.clone(),
            tag: face.tag,
            body: on.name().to_string(),
        });
    }
    let of_face = |face: &Face| -> (Vec<u32>, Elongation) {
        let nodes: Vec<u32> = face.nodes.iter().map(|&n| on.local(n)).collect();
        let coords_m: Vec<[f64; 3]> = nodes.iter().map(|&n| on.nodes_m()[n as usize]).collect();
        (nodes, elongation(&coords_m, spec.direction))
    };
    let mut parts: Vec<(Vec<u32>, Elongation)> = faces_used.iter().map(of_face).collect();
    let sines = || parts.iter().map(|(_, part)| part.largest_sine);
    let worst = match whole {
        true => sines().fold(0.0, f64::max),
        false => sines().fold(1.0, f64::min),
    };
    if worst > STEEPEST {
        return Err(ModelError::GaugeSteep {
            used_by,
            group: spec.points.clone(),
            direction: spec.direction,
            degrees: worst.min(1.0).asin().to_degrees(),
            among_several: !whole,
        });
    }
    parts.retain(|(_, part)| part.largest_sine <= STEEPEST);
    let area_m2: f64 = parts.iter().map(|(_, part)| part.area_m2).sum();
    let mut terms: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
    for (nodes, part) in parts {
        for (node, weight_m) in nodes.into_iter().zip(part.weights_m) {
            let sum = terms.entry(node).or_insert([0.0; 3]);
            add_scaled(sum, 1.0 / area_m2, weight_m);
        }
    }
    let term = |(node, vector)| (BodyNode { body, node }, vector);
    Ok(terms.into_iter().map(term).collect())
}
