//! The bodies as a viewer shows them: their outer faces, how the nodes of these move, and the flanks once more as
//! triangles of pairs.

use std::collections::HashMap;

use serde::Serialize;

use super::packed::{Scaled, integers, scaled};
use dovetail_solver::mesh::ElementOrder;
use dovetail_solver::model::{Body, BodyNode, Model};
use dovetail_solver::results::recovery::NodalField;

/// Above so many nodes on the faces the middles of edges are left out.
const MOST_NODES: usize = 60_000;
/// Harmonics whose largest displacement is below this share of the largest are left out.
const LEAST_SHARE: f64 = 0.01;
/// Faces of a tetrahedron: corners, then the middles of the edges between them, in Gmsh's order of nodes.
const FACES: [[usize; 6]; 4] = [
    [0, 1, 2, 4, 5, 6],
    [0, 1, 3, 4, 9, 7],
    [1, 2, 3, 5, 8, 9],
    [0, 2, 3, 6, 8, 7],
];

/// Nodes of the faces first, then those of the flanks, body by body. Arrays are packed.
#[derive(Debug, Serialize)]
pub(super) struct Skin {
    /// Position of each node, m.
    points: Scaled,
    /// Body of each node.
    body: String,
    bodies: Vec<String>,
    /// Nodes of a face: 3, or 6 with the middles of its edges.
    nodes_per_face: usize,
    faces: String,
    /// Pair of each node of the flanks, and where these nodes begin.
    flank_pairs: String,
    flank_start: usize,
    /// Triangles of nodes.
    flank_triangles: String,
    harmonics: Vec<Harmonic>,
}

/// Displacement `cosine cos(k w t) + sine sin(k w t)` of each node, m.
#[derive(Debug, Serialize)]
struct Harmonic {
    k: usize,
    cosine: Scaled,
    sine: Scaled,
}

impl Skin {
    /// `motion[b]` holds the 2H+1 nodal fields of body b; none where nothing moves.
    pub fn of(model: &Model, motion: Option<&[Vec<NodalField>]>) -> Self {
        let outer: Vec<Vec<[u32; 6]>> = model.bodies.iter().map(outer_faces).collect();
        let quadratic = |body: &Body| body.order == ElementOrder::Quadratic;
        let with_middles = model.bodies.iter().all(quadratic)
            && outer.iter().map(|faces| 2 * faces.len()).sum::<usize>() <= MOST_NODES;
        let nodes_per_face = if with_middles { 6 } else { 3 };
        let mut nodes: Vec<BodyNode> = Vec::new();
        let mut faces: Vec<u32> = Vec::new();
        for (body, outer) in outer.iter().enumerate() {
            let mut number: HashMap<u32, u32> = HashMap::new();
            for node in outer.iter().flat_map(|face| &face[..nodes_per_face]) {
                let at = *number.entry(*node).or_insert_with(|| {
                    nodes.push(BodyNode { body, node: *node });
                    nodes.len() as u32 - 1
                });
                faces.push(at);
            }
        }
        let flank_start = nodes.len();
        let (mut flank_pairs, mut flank_triangles) = (Vec::new(), Vec::new());
        for side in 0..2 {
            let start = nodes.len() as u32;
            let of_side = |pair: usize| match side {
                0 => Some(model.pairs[pair].first),
                _ => model.pairs[pair].second,
            };
            let mut number = HashMap::new();
            for (pair, _) in model.pairs.iter().enumerate() {
                if let Some(node) = of_side(pair) {
                    number.insert(pair as u32, start + number.len() as u32);
                    nodes.push(node);
                    flank_pairs.push(pair as u32);
                }
            }
            for triangle in &model.flank_triangles {
                let corners = triangle.map(|pair| number.get(&pair).copied());
                if let [Some(a), Some(b), Some(c)] = corners {
                    flank_triangles.extend([a, b, c]);
                }
            }
        }
        let place = |at: &BodyNode| model.bodies[at.body].nodes_m[at.node as usize];
        let body: Vec<u8> = nodes.iter().map(|at| at.body as u8).collect();
        Self {
            points: scaled(nodes.iter().flat_map(place)),
            body: super::packed::bytes(&body),
            bodies: model.bodies.iter().map(|body| body.name.clone()).collect(),
            nodes_per_face,
            faces: integers(&faces),
            flank_pairs: integers(&flank_pairs),
            flank_start,
            flank_triangles: integers(&flank_triangles),
            harmonics: motion.map_or_else(Vec::new, |motion| harmonics(&nodes, motion)),
        }
    }
}

/// Those of all faces that belong to one tetrahedron alone; the middles of edges are 0 in linear elements.
fn outer_faces(body: &Body) -> Vec<[u32; 6]> {
    let per_tet = body.order.nodes_per_tet();
    let mut once: HashMap<[u32; 3], Option<[u32; 6]>> = HashMap::new();
    for tet in body.tets.chunks_exact(per_tet) {
        for face in FACES {
            let nodes = face.map(|i| tet.get(i).copied().unwrap_or_default());
            let mut corners = [nodes[0], nodes[1], nodes[2]];
            corners.sort_unstable();
            once.entry(corners)
                .and_modify(|face| *face = None)
                .or_insert(Some(nodes));
        }
    }
    let mut faces: Vec<[u32; 6]> = once.into_values().flatten().collect();
    faces.sort_unstable();
    faces
}

fn harmonics(nodes: &[BodyNode], motion: &[Vec<NodalField>]) -> Vec<Harmonic> {
    let count = motion.first().map_or(0, |fields| fields.len() / 2);
    let field = |i: usize| -> Vec<f64> {
        let at = |n: &BodyNode| motion[n.body][i][n.node as usize];
        nodes.iter().flat_map(at).collect()
    };
    let both: Vec<[Vec<f64>; 2]> = (1..=count)
        .map(|k| [field(2 * k - 1), field(2 * k)])
        .collect();
    let largest = |parts: &[Vec<f64>; 2]| {
        let parts = parts.iter().flatten();
        parts.fold(0.0_f64, |m, v| m.max(v.abs()))
    };
    let least = LEAST_SHARE * both.iter().map(largest).fold(0.0, f64::max);
    let kept = both.into_iter().enumerate();
    kept.filter(|(_, parts)| largest(parts) > least)
        .map(|(i, [cosine, sine])| Harmonic {
            k: i + 1,
            cosine: scaled(cosine.into_iter()),
            sine: scaled(sine.into_iter()),
        })
        .collect()
}
