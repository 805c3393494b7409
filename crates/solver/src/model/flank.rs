//! One side of a contact: the surface of one body, its normals, areas, spacing and direction.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::ModelError;
use super::groups::{bounded_tets, sorted_corners};
use crate::mesh::{FACET_EDGES, Group, Mesh};
use dovetail_numerics::space::{cross, distance, dot, norm, scaled, sub, unit};

/// Surface of one body at a contact. Only corner nodes carry contact: consistent weights of a
/// six-node triangle vanish at its corners, so node-to-node contact on all six has no meaning.
pub(super) struct Flank {
    /// Corner nodes, mesh indices, ascending.
    pub nodes: Vec<u32>,
    /// Facets as indices into `nodes`.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals at the nodes, out of the body: the facets' normals weighted by their areas.
    pub normals: Vec<[f64; 3]>,
    /// A third of the facets around each node, m2.
    pub areas_m2: Vec<f64>,
    /// Shortest facet edge at each node, m.
    pub spacing_m: Vec<f64>,
    /// Mid-edge nodes and their corners, mesh indices.
    pub tied: BTreeMap<u32, [u32; 2]>,
    /// Unit direction in which most of the surface's edge runs: along the slot.
    pub along: [f64; 3],
}

/// Whose surface it is, for messages.
pub(super) struct Side<'a> {
    pub contact: &'a str,
    pub group: &'a str,
    pub body: &'a str,
}

impl Side<'_> {
    /// What is wrong with facet number `facet` of its group.
    fn bad_facet(
        &self,
        mesh: &Mesh,
        group: &Group,
        facet: usize,
        reason: &'static str,
    ) -> ModelError {
        ModelError::BadFacet {
            contact: self.contact.to_string(),
            group: self.group.to_string(),
            tag: mesh.facet_tags[group.elements[facet] as usize],
            reason,
        }
    }
}

/// Reads a flank off the mesh. `tets` are the body's elements, `on_body` tells its nodes.
///
/// Normals come from the tetrahedron behind each facet; the facet's own orientation means nothing.
pub(super) fn flank(
    mesh: &Mesh,
    group: &Group,
    tets: &[u32],
    on_body: impl Fn(u32) -> bool,
    side: &Side,
) -> Result<Flank, ModelError> {
    let behind = nodes_behind(mesh, group, tets, side)?;
    let facet = |f: u32| mesh.facet(f as usize);
    let mut nodes: Vec<u32> = group
        .elements
        .iter()
        .flat_map(|&f| &facet(f)[..3])
        .copied()
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    let index: HashMap<u32, u32> = nodes.iter().copied().zip(0..).collect();
    let x = |n: u32| mesh.nodes_m[n as usize];

    let mut triangles = Vec::with_capacity(group.elements.len());
    let mut normals = vec![[0.0; 3]; nodes.len()];
    let mut areas_m2 = vec![0.0; nodes.len()];
    let mut spacing_m = vec![f64::INFINITY; nodes.len()];
    for (i, &opposite) in behind.iter().enumerate() {
        let corners = facet(group.elements[i]);
        let [a, b, c] = [0, 1, 2].map(|k| x(corners[k]));
        let normal = twice_area([a, b, c], x(opposite))
            .ok_or_else(|| side.bad_facet(mesh, group, i, "has no area"))?;
        let area = 0.5 * norm(normal);
        let triangle = [0, 1, 2].map(|k| index[&corners[k]]);
        for (k, &i) in triangle.iter().enumerate() {
            for (sum, part) in normals[i as usize].iter_mut().zip(normal) {
                *sum += part;
            }
            areas_m2[i as usize] += area / 3.0;
            let next = triangle[(k + 1) % 3];
            let edge = distance(x(nodes[i as usize]), x(nodes[next as usize]));
            for i in [i, next] {
                spacing_m[i as usize] = spacing_m[i as usize].min(edge);
            }
        }
        triangles.push(triangle);
    }
    for (i, normal) in (0..).zip(&mut normals) {
        // Facets folded back on each other cancel.
        *normal = unit(*normal).ok_or_else(|| {
            let at = triangles.iter().position(|t| t.contains(&i)).unwrap_or(0);
            side.bad_facet(mesh, group, at, "is folded back on its neighbour")
        })?;
    }
    let along = direction_of_edge(&triangles, |i| x(nodes[i as usize]));
    Ok(Flank {
        nodes,
        triangles,
        normals,
        areas_m2,
        spacing_m,
        tied: tied(mesh, group, on_body, side)?,
        along,
    })
}

/// Normal of a facet, as long as twice its area, away from the node behind it; `None` where it has
/// no area.
fn twice_area([a, b, c]: [[f64; 3]; 3], behind: [f64; 3]) -> Option<[f64; 3]> {
    let normal = cross(sub(b, a), sub(c, a));
    let (area, height) = (0.5 * norm(normal), dot(normal, sub(a, behind)));
    let edges = [distance(a, b), distance(b, c), distance(c, a)];
    let longest = edges.into_iter().fold(0.0, f64::max);
    let is_flat = area <= 1e-9 * longest * longest || height == 0.0;
    (!is_flat).then(|| scaled(normal, height.signum()))
}

/// Mid-edge nodes of the group and their corners, mesh indices.
fn tied(
    mesh: &Mesh,
    group: &Group,
    on_body: impl Fn(u32) -> bool,
    side: &Side,
) -> Result<BTreeMap<u32, [u32; 2]>, ModelError> {
    let mut tied = BTreeMap::new();
    for (i, &f) in group.elements.iter().enumerate() {
        let nodes = mesh.facet(f as usize);
        // A linear facet has none.
        for (&middle, [p, q]) in nodes[3..].iter().zip(FACET_EDGES) {
            if !on_body(middle) {
                let reason = "has a mid-edge node that its tetrahedron lacks";
                return Err(side.bad_facet(mesh, group, i, reason));
            }
            tied.insert(middle, [nodes[p].min(nodes[q]), nodes[p].max(nodes[q])]);
        }
    }
    Ok(tied)
}

/// For each facet of the group the fourth corner of the tetrahedron it belongs to.
fn nodes_behind(
    mesh: &Mesh,
    group: &Group,
    tets: &[u32],
    side: &Side,
) -> Result<Vec<u32>, ModelError> {
    let mut seen = HashSet::with_capacity(group.elements.len());
    for (i, &f) in group.elements.iter().enumerate() {
        if !seen.insert(sorted_corners(mesh.facet(f as usize))) {
            return Err(side.bad_facet(mesh, group, i, "is in the mesh twice"));
        }
    }
    let behind = bounded_tets(mesh, group, tets);
    let tag = |i: usize| mesh.facet_tags[group.elements[i] as usize];
    if let Some(i) = behind.iter().position(|(count, _)| *count > 1) {
        return Err(ModelError::FlankInside {
            contact: side.contact.to_string(),
            group: side.group.to_string(),
            tag: tag(i),
        });
    }
    let off: Vec<u64> = (0..behind.len())
        .filter(|&i| behind[i].0 == 0)
        .map(tag)
        .collect();
    if !off.is_empty() {
        return Err(ModelError::FlankOffBody {
            contact: side.contact.to_string(),
            group: side.group.to_string(),
            body: side.body.to_string(),
            count: off.len(),
            tags: off.into_iter().take(5).collect(),
            swapped: false,
        });
    }
    Ok(behind.into_iter().map(|(_, opposite)| opposite).collect())
}

/// Direction in which most of the length of a surface's edge runs (of all edges, where the surface
/// is closed), its largest component positive. On a skewed flank, a parallelogram, that is the slot;
/// the axis of inertia would be a third of a degree off.
fn direction_of_edge(triangles: &[[u32; 3]], x: impl Fn(u32) -> [f64; 3]) -> [f64; 3] {
    let mut uses: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let open = uses.values().any(|&n| n == 1);
    let edges: Vec<([f64; 3], f64)> = uses
        .iter()
        .filter(|&(_, &n)| n == 1 || !open)
        .filter_map(|(&[a, b], _)| {
            let d = sub(x(b), x(a));
            Some((positive(unit(d)?), norm(d)))
        })
        .collect();
    // Length that runs within some ten degrees of a direction.
    let share = |c: f64| c.powi(64);
    let length = |d: [f64; 3]| {
        edges
            .iter()
            .map(|&(e, l)| l * share(dot(d, e)))
            .sum::<f64>()
    };
    let mut best: ([f64; 3], f64) = ([1.0, 0.0, 0.0], 0.0);
    for &(d, _) in &edges {
        let l = length(d);
        // Rounding must not decide between equals, nor the numbering: prefer x, then y.
        let tie = (l - best.1).abs() <= 1e-6 * best.1;
        let first = (0..3)
            .map(|k| d[k].abs() - best.0[k].abs())
            .find(|c| c.abs() > 1e-6);
        if if tie {
            first.is_some_and(|c| c > 0.0)
        } else {
            l > best.1
        } {
            best = (d, l);
        }
    }
    let mut sum = [0.0; 3];
    for &(e, l) in &edges {
        let c = dot(best.0, e);
        for k in 0..3 {
            sum[k] += l * share(c) * c.signum() * e[k];
        }
    }
    positive(unit(sum).unwrap_or(best.0))
}

/// The vector or its opposite: the first of its (nearly) largest components positive.
fn positive(v: [f64; 3]) -> [f64; 3] {
    let largest = v.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
    let lead = v.iter().find(|c| c.abs() > largest - 1e-6).unwrap_or(&1.0);
    if *lead < 0.0 { scaled(v, -1.0) } else { v }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_direction_of_a_skewed_flank_is_the_slot() {
        // Parallelogram 35 x 4.5, ends cut at 25 degrees, graded unevenly.
        let s: Vec<f64> = (0..=8)
            .map(|i| 35.0 * (f64::from(i) / 8.0).powi(2))
            .collect();
        let mut nodes = Vec::new();
        for v in 0..=3 {
            for &s in &s {
                let t = f64::from(v) * 1.5;
                nodes.push([s + t * 25f64.to_radians().tan(), t, 450.0]);
            }
        }
        let mut triangles = Vec::new();
        for v in 0..3 {
            for i in 0..8 {
                let a = v * 9 + i;
                triangles.extend([[a, a + 1, a + 9], [a + 1, a + 10, a + 9]]);
            }
        }
        let d = direction_of_edge(&triangles, |i| nodes[i as usize]);
        assert!((d[0] - 1.0).abs() < 1e-12 && d[1].abs() < 1e-12, "{d:?}");
        let turned = direction_of_edge(&triangles, |i| {
            let [x, y, z] = nodes[i as usize];
            [z, -x, y]
        });
        assert!((turned[1] - 1.0).abs() < 1e-12, "{turned:?}");
    }

    #[test]
    fn equal_sides_do_not_depend_on_the_numbering() {
        let nodes = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        for turn in 0..4 {
            let x = |i: u32| {
                let [x, y] = nodes[(i as usize + turn) % 4];
                [x * (1.0 + 1e-12), y, 0.0]
            };
            assert_eq!(
                direction_of_edge(&[[0, 1, 2], [0, 2, 3]], x),
                [1.0, 0.0, 0.0]
            );
        }
    }
}
