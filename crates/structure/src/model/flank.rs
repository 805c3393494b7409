//! One side of a contact: the surface of one body, its normals, areas, spacing and direction.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::ModelError;
use super::groups::{Face, Outside, faces};
use dovetail_mesh::element::sorted_facet;
use dovetail_mesh::facet::shares;
use dovetail_mesh::{Group, Mesh};
use dovetail_numerics::space::{add_scaled, distance, dot, norm, scaled, sub, unit};

/// Surface of one body at a contact. Only corner nodes carry contact: consistent weights of a
/// six-node triangle vanish at its corners, and those of an eight-node quadrilateral are negative
/// there, so that node-to-node contact on all of them has no meaning.
pub(super) struct Flank {
    /// Corner nodes, mesh indices, ascending.
    pub nodes: Vec<u32>,
    /// Facets as indices of their corners in `nodes`, counter-clockwise seen from outside.
    pub facets: Vec<Vec<u32>>,
    /// Unit normals at the nodes, out of the body: the facets' normals weighted by their areas.
    pub normals: Vec<[f64; 3]>,
    /// Integrals of the linear shape functions of the facets around each node, m2: a third of each
    /// triangle, a quarter of each parallelogram.
    pub areas_m2: Vec<f64>,
    /// Nodes in the middles of the edges of each facet, mesh indices.
    pub middles: Vec<Vec<u32>>,
    /// Unit direction in which most of the surface's edge runs: along the slot.
    pub along: [f64; 3],
}

/// Origin of the surface, for messages.
pub(super) struct FlankOrigin<'a> {
    pub contact: &'a str,
    pub group: &'a str,
    pub body: &'a str,
}

impl FlankOrigin<'_> {
    /// Error about a facet of the group.
    fn bad_facet(&self, tag: u64, reason: &'static str) -> ModelError {
        ModelError::BadFacet {
            contact: self.contact.to_string(),
            group: self.group.to_string(),
            tag,
            reason,
        }
    }
}

/// Reads a flank of a body from the mesh.
///
/// Normals come from the elements behind the facets, and the orientation of the facets themselves
/// does not matter. It matters on a body without elements.
pub(super) fn flank(
    mesh: &Mesh,
    group: &Group,
    outside: &Outside<'_>,
    side: &FlankOrigin,
) -> Result<Flank, ModelError> {
    let faces = outer_faces(mesh, group, outside, side)?;
    let mut nodes: Vec<u32> = faces.iter().flat_map(Face::corners).copied().collect();
    nodes.sort_unstable();
    nodes.dedup();
    let index: HashMap<u32, u32> = nodes.iter().copied().zip(0..).collect();
    let x = |n: u32| mesh.nodes_m[n as usize];

    let mut facets = Vec::with_capacity(faces.len());
    let mut middles = Vec::with_capacity(faces.len());
    let mut normals = vec![[0.0; 3]; nodes.len()];
    let mut areas_m2 = vec![0.0; nodes.len()];
    for face in &faces {
        let corners: Vec<[f64; 3]> = face.corners().iter().map(|&n| x(n)).collect();
        let facet: Vec<u32> = face.corners().iter().map(|n| index[n]).collect();
        let parts = shares(&corners);
        let mut longest: f64 = 0.0;
        let last = facet.len();
        for k in 0..last {
            let i = facet[k] as usize;
            add_scaled(&mut normals[i], 1.0, parts[k].normal_m2);
            areas_m2[i] += parts[k].area_m2;
            longest = longest.max(distance(corners[k], corners[(k + 1) % last]));
        }
        let least = parts
            .iter()
            .map(|p| p.area_m2)
            .fold(f64::INFINITY, f64::min);
        if least <= 1e-9 * longest * longest {
            return Err(side.bad_facet(face.tag, "has no area"));
        }
        middles.push(face.nodes[last..].to_vec());
        facets.push(facet);
    }
    for (i, normal) in (0..).zip(&mut normals) {
        // Facets folded back on each other cancel.
        *normal = unit(*normal).ok_or_else(|| {
            let at = facets.iter().position(|f| f.contains(&i)).unwrap_or(0);
            side.bad_facet(faces[at].tag, "is folded back on its neighbour")
        })?;
    }
    let along = direction_of_edge(&facets, |i| x(nodes[i as usize]));
    Ok(Flank {
        nodes,
        facets,
        normals,
        areas_m2,
        middles,
        along,
    })
}

impl Flank {
    /// Node positions, m.
    pub(crate) fn positions_m(&self, mesh: &Mesh) -> Vec<[f64; 3]> {
        let at = |&n: &u32| mesh.nodes_m[n as usize];
        self.nodes.iter().map(at).collect()
    }

    /// Mean area of a facet, m2.
    pub(crate) fn facet_area_m2(&self) -> f64 {
        self.areas_m2.iter().sum::<f64>() / self.facets.len() as f64
    }

    /// Nodes in the middles of the edges of these facets, ascending, with the two corners; mesh
    /// indices.
    pub(crate) fn tied(&self, is_wanted: &[bool]) -> Vec<(u32, [u32; 2])> {
        let mut tied = BTreeMap::new();
        let flank_facets = self.facets.iter().zip(&self.middles).zip(is_wanted);
        for ((facet, middles), _) in flank_facets.filter(|(_, wanted)| **wanted) {
            let corner = |k: usize| self.nodes[facet[k % facet.len()] as usize];
            for (k, &middle) in middles.iter().enumerate() {
                let (p, q) = (corner(k), corner(k + 1));
                tied.insert(middle, [p.min(q), p.max(q)]);
            }
        }
        tied.into_iter().collect()
    }
}

/// Faces of the group, which must all be on the surface of the body.
fn outer_faces(
    mesh: &Mesh,
    group: &Group,
    outside: &Outside<'_>,
    side: &FlankOrigin,
) -> Result<Vec<Face>, ModelError> {
    let mut seen = HashSet::with_capacity(group.elements.len());
    for &f in &group.elements {
        let nodes = mesh.facets.element_nodes(f as usize);
        if !seen.insert(sorted_facet(nodes)) {
            return Err(side.bad_facet(mesh.facets.tags()[f as usize], "is in the mesh twice"));
        }
    }
    let faces = faces(mesh, group, outside);
    if let Some(face) = faces.iter().find(|face| face.bounded > 1) {
        return Err(ModelError::FlankInside {
            contact: side.contact.to_string(),
            group: side.group.to_string(),
            tag: face.tag,
        });
    }
    if faces.is_empty() {
        return Err(ModelError::NoFaces {
            used_by: format!("contact `{}`", side.contact),
            group: side.group.to_string(),
            nodes: group.nodes.len(),
            body: side.body.to_string(),
        });
    }
    let off = faces.iter().filter(|face| face.bounded == 0);
    let off: Vec<u64> = off.map(|face| face.tag).collect();
    if !off.is_empty() {
        return Err(ModelError::FlankOffBody {
            contact: side.contact.to_string(),
            group: side.group.to_string(),
            body: side.body.to_string(),
            count: off.len(),
            tags: off.into_iter().take(5).collect(),
        });
    }
    Ok(faces)
}

/// Direction in which most of the length of a surface's edge runs (of all edges, where the surface
/// is closed), its largest component positive. On a skewed flank, a parallelogram, that is the
/// slot; the axis of inertia would be a third of a degree off.
fn direction_of_edge(facets: &[Vec<u32>], x: impl Fn(u32) -> [f64; 3]) -> [f64; 3] {
    let mut uses: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for facet in facets {
        for k in 0..facet.len() {
            let (a, b) = (facet[k], facet[(k + 1) % facet.len()]);
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
    // Length that runs within about ten degrees of a direction.
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
        add_scaled(&mut sum, l * share(c) * c.signum(), e);
    }
    positive(unit(sum).unwrap_or(best.0))
}

/// Vector or its opposite, such that the first of its (nearly) largest components is positive.
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
                triangles.extend([vec![a, a + 1, a + 9], vec![a + 1, a + 10, a + 9]]);
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
                direction_of_edge(&[vec![0, 1, 2], vec![0, 2, 3]], x),
                [1.0, 0.0, 0.0]
            );
        }
    }
}
