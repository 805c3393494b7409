//! The contact pairs of a model: partners, frames, areas, and the order they stand in.

use super::flank::{Flank, Side, flank};
use super::pairing::{nearest_distance, pair};
use super::{BodyNode, ContactPair, ModelError};
use crate::mesh::{Group, Mesh};
use crate::model::ContactSpec;
use crate::model::error::Unmatched;
use dovetail_numerics::space::{Vector, cross, dot, middle, scaled, sub, unit};

/// Pairs of one contact; node numbers are still the mesh's.
pub(super) struct Contact {
    pub pairs: Vec<ContactPair>,
    /// Facets of the first flank as indices of their corners into `pairs`, counter-clockwise seen from
    /// the blade.
    pub facets: Vec<Vec<u32>>,
    /// Per body: mid-edge nodes and their corners.
    pub tied: [Vec<(u32, [u32; 2])>; 2],
    pub largest_mismatch_m: f64,
}

/// What a contact needs to know of a body.
pub(super) struct Part<'a> {
    /// Its number.
    pub body: usize,
    pub name: &'a str,
    /// Elements of the mesh.
    pub elements: &'a [u32],
    /// Per mesh node: does the body have it?
    pub has: &'a dyn Fn(u32) -> bool,
}

/// Finds the pairs of a contact, number `number` among those of the model, with the flank `second` of the second body.
pub(super) fn contact(
    mesh: &Mesh,
    (spec, second): (&ContactSpec, &str),
    number: usize,
    groups: [&Group; 2],
    parts: [&Part; 2],
    tolerance: f64,
) -> Result<Contact, ModelError> {
    let names = [spec.first.as_str(), second];
    let side = |i: usize, other: usize| {
        let side = Side {
            contact: &spec.name,
            group: names[i],
            body: parts[i].name,
        };
        flank(mesh, groups[i], parts[i].elements, &side).map_err(|e| match e {
            ModelError::FlankOffBody {
                contact,
                group,
                body,
                count,
                tags,
                ..
            } => ModelError::FlankOffBody {
                contact,
                group,
                body,
                count,
                tags,
                swapped: groups[i].nodes.iter().all(|&n| (parts[other].has)(n)),
            },
            e => e,
        })
    };
    let flanks = [side(0, 1)?, side(1, 0)?];
    let partners = partners(mesh, (spec, second), &flanks, tolerance)?;
    let mut pairs = Vec::with_capacity(partners.len());
    for &(i, j, _) in &partners {
        pairs.push(contact_pair(mesh, spec, number, parts, &flanks, [i, j])?);
    }
    let largest_mismatch_m = partners.iter().map(|p| p.2).fold(0.0, f64::max);
    let [first, second] = flanks;
    let tied = second.tied.into_iter().collect();
    Ok(ordered(pairs, first, tied, largest_mismatch_m))
}

/// Every corner node of the flank `group` of the first body against rigid ground at the same place.
pub(super) fn ground_contact(
    mesh: &Mesh,
    spec: &ContactSpec,
    number: usize,
    group: &Group,
    part: &Part,
) -> Result<Contact, ModelError> {
    let side = Side {
        contact: &spec.name,
        group: &spec.first,
        body: part.name,
    };
    let flank = flank(mesh, group, part.elements, &side)?;
    let pair = |i: usize| ContactPair {
        contact: number,
        first: on(part, flank.nodes[i]),
        second: None,
        position_m: mesh.nodes_m[flank.nodes[i] as usize],
        // Out of the ground is into the blade.
        frame: frame(flank.normals[i].map(|n| -n), flank.along),
        area_m2: flank.areas_m2[i],
        gap_m: spec.gap_m,
        friction: spec.friction,
    };
    let pairs = (0..flank.nodes.len()).map(pair).collect();
    Ok(ordered(pairs, flank, Vec::new(), 0.0))
}

/// Pairs in the order of the nodes of the `first` flank, put along the slot.
fn ordered(
    pairs: Vec<ContactPair>,
    first: Flank,
    second_tied: Vec<(u32, [u32; 2])>,
    largest_mismatch_m: f64,
) -> Contact {
    let order = order_along(&pairs, first.along);
    let mut place = vec![0u32; pairs.len()];
    for (new, &old) in (0..).zip(&order) {
        place[old] = new;
    }
    let pairs: Vec<ContactPair> = order.iter().map(|&old| pairs[old].clone()).collect();
    // Seen from outside a facet of the blade turns the other way than seen from the blade.
    let facets = first.facets.iter().map(|facet| {
        let turned = facet.iter().rev();
        turned.map(|&i| place[i as usize]).collect()
    });
    Contact {
        facets: facets.collect(),
        pairs,
        largest_mismatch_m,
        tied: [first.tied.into_iter().collect(), second_tied],
    }
}

/// (node of the first flank, node of the second, distance), all nodes of both.
fn partners(
    mesh: &Mesh,
    (spec, second_group): (&ContactSpec, &str),
    flanks: &[Flank; 2],
    tolerance: f64,
) -> Result<Vec<(usize, usize, f64)>, ModelError> {
    let tag = |side: usize, i: usize| mesh.node_tags[flanks[side].nodes[i] as usize];
    let points = |side: usize| -> Vec<Vector> {
        let nodes = &flanks[side].nodes;
        nodes.iter().map(|&n| mesh.nodes_m[n as usize]).collect()
    };
    let (first, second) = (points(0), points(1));
    let reach: Vec<f64> = flanks[0].spacing_m.iter().map(|h| h * tolerance).collect();
    let found = pair(&first, &reach, &second);
    if let Some(([a, b], j)) = found.conflict {
        return Err(ModelError::PairedTwice {
            contact: spec.name.clone(),
            first: [tag(0, a), tag(0, b)],
            second: tag(1, j),
        });
    }
    if found.unmatched_first.is_empty() && found.unmatched_second.is_empty() {
        return Ok(found.pairs);
    }
    let alone = |side: usize, which: &[usize], points: &[Vector], others: &[Vector]| {
        let describe = |&i: &usize| Unmatched {
            tag: tag(side, i),
            position_m: points[i],
            distance_m: nearest_distance(&points[i], others),
        };
        which.iter().take(3).map(describe).collect::<Vec<_>>()
    };
    let mut nearest = alone(0, &found.unmatched_first, &first, &second);
    nearest.extend(alone(1, &found.unmatched_second, &second, &first));
    Err(ModelError::Unmatched {
        contact: spec.name.clone(),
        first: spec.first.clone(),
        second: second_group.to_owned(),
        first_count: found.unmatched_first.len(),
        second_count: found.unmatched_second.len(),
        tolerance,
        nearest,
    })
}

fn contact_pair(
    mesh: &Mesh,
    spec: &ContactSpec,
    number: usize,
    parts: [&Part; 2],
    flanks: &[Flank; 2],
    [i, j]: [usize; 2],
) -> Result<ContactPair, ModelError> {
    let [first, second] = [
        on(parts[0], flanks[0].nodes[i]),
        on(parts[1], flanks[1].nodes[j]),
    ];
    let [a, b] = [first, second].map(|n| mesh.nodes_m[n.node as usize]);
    let position_m = middle(a, b);
    // Out of the jaw is into the blade.
    let (blade, jaw) = (flanks[0].normals[i], flanks[1].normals[j]);
    let cosine = dot(blade, jaw);
    let normal = unit(sub(jaw, blade)).filter(|_| cosine < -0.5);
    let Some(normal) = normal else {
        return Err(ModelError::NotFacing {
            contact: spec.name.clone(),
            position_m,
            degrees: cosine.clamp(-1.0, 1.0).acos().to_degrees(),
        });
    };
    Ok(ContactPair {
        contact: number,
        first,
        second: Some(second),
        position_m,
        frame: frame(normal, flanks[0].along),
        area_m2: 0.5 * (flanks[0].areas_m2[i] + flanks[1].areas_m2[j]),
        gap_m: spec.gap_m,
        friction: spec.friction,
    })
}

fn on(part: &Part, node: u32) -> BodyNode {
    let body = part.body;
    BodyNode { body, node }
}

/// Rows n, t1, t2: t1 is `along` projected on the tangent plane, t2 = n x t1. Where a curved flank
/// stands across `along`, the axis least along n takes its place.
fn frame(n: Vector, along: Vector) -> [Vector; 3] {
    let projected = |d: Vector| sub(d, scaled(n, dot(n, d)));
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let least = (0..3).fold(
        0,
        |best, k| if n[k].abs() < n[best].abs() { k } else { best },
    );
    let t1 = [along, axes[least]]
        .into_iter()
        .map(projected)
        .filter(|t| dot(*t, *t) > 1e-6)
        .find_map(unit)
        .unwrap_or(axes[least]); // n has unit length: the second candidate never fails
    [n, t1, cross(n, t1)]
}

/// Order of the pairs: along the slot, then across, so that it depends on where the nodes are and
/// not on how the mesh numbers them.
fn order_along(pairs: &[ContactPair], along: Vector) -> Vec<usize> {
    let mut mean = [0.0; 3];
    for pair in pairs {
        for (sum, n) in mean.iter_mut().zip(pair.frame[0]) {
            *sum += n;
        }
    }
    let axes = frame(unit(mean).unwrap_or([0.0, 0.0, 1.0]), along);
    let coordinates: Vec<[f64; 3]> = pairs
        .iter()
        .map(|p| [1, 2, 0].map(|k| dot(axes[k], p.position_m)))
        .collect();
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    sort_by_rows(&mut order, &coordinates, 0);
    order
}

/// Sorts by coordinate `k`; runs that differ by rounding only are sorted by the next coordinate.
fn sort_by_rows(order: &mut [usize], coordinates: &[[f64; 3]], k: usize) {
    let at = |i: usize| coordinates[i][k];
    order.sort_by(|&a, &b| at(a).total_cmp(&at(b)));
    let (Some(&first), Some(&last)) = (order.first(), order.last()) else {
        return;
    };
    if k == 2 {
        return;
    }
    let scale = at(first).abs().max(at(last).abs());
    let close = 1e-6 * (at(last) - at(first)) + 1e-12 * scale;
    for row in order.chunk_by_mut(|&a, &b| at(b) - at(a) <= close) {
        sort_by_rows(row, coordinates, k + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_right_handed_and_orthonormal_whatever_the_normal() {
        let along = [1.0, 0.0, 0.0];
        for n in [
            [0.0, 0.6, 0.8],
            [0.6, 0.0, -0.8],
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
        ] {
            let [n, t1, t2] = frame(n, along);
            for (a, b) in [(n, t1), (t1, t2), (t2, n)] {
                assert!(dot(a, b).abs() < 1e-15 && (dot(a, a) - 1.0).abs() < 1e-14);
            }
            assert!((dot(cross(n, t1), t2) - 1.0).abs() < 1e-14);
        }
        assert_eq!(frame([0.0, 0.6, 0.8], along)[1], along);
    }

    #[test]
    fn rows_survive_rounding() {
        let noise = |i: usize| 1e-15 * ((i * 7 % 5) as f64 - 2.0);
        let coordinates: Vec<[f64; 3]> = (0..12)
            .map(|i| [(i % 4) as f64 * 0.1 + noise(i), -((i / 4) as f64), 0.0])
            .collect();
        let mut order: Vec<usize> = (0..12).rev().collect();
        sort_by_rows(&mut order, &coordinates, 0);
        assert_eq!(order, [8, 4, 0, 9, 5, 1, 10, 6, 2, 11, 7, 3]);
    }
}
