//! Geometry of the bodies for a viewer: their outer faces, the motion of the nodes of these, and
//! the flanks as additional triangles of pairs.

use std::collections::HashMap;

use serde::Serialize;

use super::apart::opening_displacements;
use super::packed::{Scaled, integers, scaled};
use dovetail_mesh::element::facet_corners;
use dovetail_solver::model::{Body, BodyNode, Model};
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::results::stress::StressCycle;
use dovetail_solver::run::PeakStress;
use dovetail_solver::space::{dot, scaled as scaled_by, sub, unit};
use dovetail_solver::spectrum::{cosine, sine};

/// Number of nodes on the faces above which the middles of edges are left out.
const MOST_NODES: usize = 60_000;
/// Share of the largest displacement below which a harmonic is left out.
const LEAST_SHARE: f64 = 0.01;
/// Nodes of the faces first, then those of the flanks, body by body. Arrays are packed.
#[derive(Debug, Serialize)]
pub(super) struct Skin {
    /// Position of each node, m.
    points: Scaled,
    /// Body of each node.
    body: String,
    bodies: Vec<String>,
    /// Nodes around each face, its corners and the middles of its edges in turn.
    faces: String,
    /// Number of nodes of each face: 3 or 4, with the middles 6 or 8.
    face_sizes: String,
    /// Pair of each node of the flanks.
    flank_pairs: String,
    /// Number of the first node of the flanks.
    flank_start: usize,
    /// Triangles of nodes of the flanks.
    flank_triangles: String,
    /// Vector along which each body is pulled, the longest of length 1.
    apart: Vec<[f64; 3]>,
    /// Unit vector that is upright in the picture.
    up: [f64; 3],
    /// Unit vector across the picture, orthogonal to `up`.
    along: [f64; 3],
    harmonics: Vec<Harmonic>,
    fields: Vec<BodyField>,
    /// Disc that the bodies are a sector of, if any.
    disc: Option<Disc>,
}

/// Disc of equal sectors, each of which moves as the one before does, a part of a period earlier.
#[derive(Debug, Serialize)]
struct Disc {
    sectors: usize,
    /// Matrix that turns by one pitch, row by row.
    turn: [[f64; 3]; 3],
    /// Point of the axis, m.
    point_m: [f64; 3],
    /// Angle of the first harmonic by which a sector is ahead of the one before, radians.
    ahead_rad: f64,
}

/// Value of each node, which the bodies can be coloured by.
#[derive(Debug, Serialize)]
struct BodyField {
    title: &'static str,
    unit: &'static str,
    /// Largest value; the scale of colours begins at zero.
    largest: f64,
    values: Scaled,
}

/// Displacement `cosine cos(k w t) + sine sin(k w t)` of each node, m.
#[derive(Debug, Serialize)]
struct Harmonic {
    k: usize,
    cosine: Scaled,
    sine: Scaled,
}

impl Skin {
    /// Skin of a model. `motion[b]` holds the 2H+1 nodal fields of body b; `None` if nothing moves.
    pub fn new(
        model: &Model,
        motion: Option<&[Vec<NodalField>]>,
        stress: Option<&PeakStress>,
    ) -> Self {
        let mut outer: Vec<Vec<Vec<u32>>> = model.bodies.iter().map(outer_faces).collect();
        let cells = outer.iter().flatten().map(Vec::len).sum::<usize>();
        // A node in the middle of an edge belongs to two faces, a corner to some four or six.
        if cells / 3 > MOST_NODES {
            for face in outer.iter_mut().flatten() {
                face.truncate(facet_corners(face.len()));
            }
        }
        let mut nodes: Vec<BodyNode> = Vec::new();
        let (mut faces, mut face_sizes) = (Vec::new(), Vec::new());
        for (body, outer) in outer.iter().enumerate() {
            let mut number: HashMap<u32, u32> = HashMap::new();
            for face in outer {
                for node in facet_outline(face) {
                    let at = *number.entry(node).or_insert_with(|| {
                        nodes.push(BodyNode { body, node });
                        nodes.len() as u32 - 1
                    });
                    faces.push(at);
                }
                face_sizes.push(face.len() as u32);
            }
        }
        let flank_start = nodes.len();
        let (mut flank_pairs, mut flank_triangles) = (Vec::new(), Vec::new());
        for side in 0..2 {
            let start = nodes.len() as u32;
            let of_side = |pair: usize| match side {
                0 => Some(model.pairs[pair].slave.node),
                _ => model.pairs[pair].slave.partner(),
            };
            let mut number = HashMap::new();
            for (pair, _) in model.pairs.iter().enumerate() {
                if let Some(node) = of_side(pair) {
                    number.insert(pair as u32, start + number.len() as u32);
                    nodes.push(node);
                    flank_pairs.push(pair as u32);
                }
            }
            for facet in &model.flank_facets {
                let corners: Vec<u32> = facet
                    .iter()
                    .filter_map(|p| number.get(p).copied())
                    .collect();
                if corners.len() == facet.len() {
                    let rest = corners[1..].windows(2);
                    flank_triangles.extend(rest.flat_map(|pair| [corners[0], pair[0], pair[1]]));
                }
            }
        }
        let place = |at: &BodyNode| model.bodies[at.body].nodes_m[at.node as usize];
        let [up, along] = upright(model, nodes.iter().map(place));
        let body: Vec<u8> = nodes.iter().map(|at| at.body as u8).collect();
        Self {
            points: scaled(nodes.iter().flat_map(place)),
            body: super::packed::bytes(&body),
            bodies: model.bodies.iter().map(|body| body.name.clone()).collect(),
            faces: integers(&faces),
            face_sizes: integers(&face_sizes),
            flank_pairs: integers(&flank_pairs),
            flank_start,
            flank_triangles: integers(&flank_triangles),
            apart: opening_displacements(model),
            up,
            along,
            harmonics: motion.map_or_else(Vec::new, |motion| harmonics(&nodes, motion)),
            fields: stress.map_or_else(Vec::new, |stress| stress_fields(&nodes, stress)),
            disc: model.cyclic.as_ref().map(|cyclic| Disc {
                sectors: cyclic.sectors,
                turn: cyclic.turn,
                point_m: cyclic.point_m,
                ahead_rad: cyclic.phase_rad(1, 1),
            }),
        }
    }
}

/// Directions that are upright and across in the picture. With rotation they are the direction away
/// from the axis and the axis; else z, and x or y, whichever is the longer side of the bodies.
fn upright(model: &Model, nodes_m: impl Iterator<Item = [f64; 3]>) -> [[f64; 3]; 2] {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for node in nodes_m {
        for axis in 0..3 {
            low[axis] = low[axis].min(node[axis]);
            high[axis] = high[axis].max(node[axis]);
        }
    }
    let outwards = model.rotation.as_ref().and_then(|rotation| {
        let middle = [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis]));
        let arm = sub(middle, rotation.point_m);
        let up = unit(sub(arm, scaled_by(rotation.axis, dot(arm, rotation.axis))))?;
        Some([up, rotation.axis])
    });
    outwards.unwrap_or_else(|| {
        let size = |axis: usize| high[axis] - low[axis];
        let along = if size(1) > size(0) {
            [0.0, 1.0, 0.0]
        } else {
            [1.0, 0.0, 0.0]
        };
        [[0.0, 0.0, 1.0], along]
    })
}

/// Outer faces of a body, each as the nodes of a facet: those that belong to one element alone, and
/// the facets of a body without elements.
fn outer_faces(body: &Body) -> Vec<Vec<u32>> {
    let mut once: HashMap<[u32; 4], Option<(usize, usize)>> = HashMap::new();
    for (e, (element, nodes)) in body.elements.solids().enumerate() {
        for (f, corners) in element.sorted_faces(nodes) {
            once.entry(corners)
                .and_modify(|face| *face = None)
                .or_insert(Some((e, f)));
        }
    }
    let nodes_of = |(e, f): (usize, usize)| {
        let (element, nodes) = body.elements.solid(e);
        element.face_of(f, nodes)
    };
    let facets = body.facets.iter().map(<[u32]>::to_vec);
    let faces = once.into_values().flatten().map(nodes_of);
    let mut faces: Vec<Vec<u32>> = faces.chain(facets).collect();
    faces.sort_unstable();
    faces
}

/// Nodes of a facet in order along its edges.
fn facet_outline(face: &[u32]) -> impl Iterator<Item = u32> {
    let (corners, middles) = face.split_at(facet_corners(face.len()));
    let with_middle = |(i, &corner): (usize, &u32)| [Some(corner), middles.get(i).copied()];
    corners.iter().enumerate().flat_map(with_middle).flatten()
}

/// Amplitude and largest value of the equivalent stress, and the use of the strength, of these nodes.
fn stress_fields(nodes: &[BodyNode], stress: &PeakStress) -> Vec<BodyField> {
    let field = |title, unit, value: &dyn Fn(usize, &StressCycle) -> f64| {
        let of = |at: &BodyNode| value(at.body, &stress.bodies[at.body].cycles[at.node as usize]);
        let values: Vec<f64> = nodes.iter().map(of).collect();
        BodyField {
            title,
            unit,
            largest: values.iter().copied().fold(0.0, f64::max),
            values: scaled(values.into_iter()),
        }
    };
    let mut fields = vec![
        field("amplitude of stress", "Pa", &|_, cycle| cycle.amplitude_pa),
        field("largest equivalent stress", "Pa", &|_, cycle| {
            cycle.largest_pa
        }),
    ];
    if stress.strengths.iter().any(Option::is_some) {
        fields.push(field("use of the strength", "", &|body, cycle| {
            stress.strengths[body].map_or(0.0, |strength| cycle.utilisation(strength))
        }));
    }
    fields
}

fn harmonics(nodes: &[BodyNode], motion: &[Vec<NodalField>]) -> Vec<Harmonic> {
    let count = motion.first().map_or(0, |fields| fields.len() / 2);
    let field = |i: usize| -> Vec<f64> {
        let at = |n: &BodyNode| motion[n.body][i][n.node as usize];
        nodes.iter().flat_map(at).collect()
    };
    let both: Vec<[Vec<f64>; 2]> = (1..=count)
        .map(|k| [field(cosine(k)), field(sine(k))])
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
