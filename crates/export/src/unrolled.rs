//! Unrolls the flanks: each contact is a panel in its own plane, and all panels have the same
//! orientation. The slot runs to the right, outwards is up, and the edges have names. Each pair is
//! the patch of flank that is its tributary area. summary.json has the directions and the names for
//! other programs that show a flank.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize, Serializer};

use crate::words::seven_digits;
use dovetail_solver::model::{ContactPair, Model, Rotation};
use dovetail_solver::space::{dot, scaled, sub, unit};

/// Smallest cosine between a side of a flank and a direction of the machine that names the side.
const LEAST_COSINE: f64 = 0.1;

/// Flank in its own plane.
#[derive(Debug, Serialize)]
pub(crate) struct Panel {
    pub name: String,
    /// Names of the sides left, right, below and above.
    pub edges: [String; 4],
    /// Length to the right and height, m.
    pub size: [f64; 2],
    pub patches: Vec<Patch>,
}

/// Share of a flank that belongs to one pair.
#[derive(Debug, Serialize)]
pub(crate) struct Patch {
    pub pair: usize,
    /// Corners, m, to the right and up from the lower left corner of the flank.
    #[serde(serialize_with = "serialize_seven_digits")]
    pub outline: Vec<[f64; 2]>,
}

fn serialize_seven_digits<S: Serializer>(
    outline: &[[f64; 2]],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(outline.iter().map(|corner| corner.map(seven_digits)))
}

/// Flanks of a model in the order of its contacts; contacts without facets are left out.
pub(crate) fn panels(model: &Model) -> Vec<Panel> {
    let contacts = 0..model.contact_names.len();
    contacts.filter_map(|c| panel(model, c)).collect()
}

/// Flank of one contact; `None` if it has no facets.
fn panel(model: &Model, contact: usize) -> Option<Panel> {
    let facets: Vec<Vec<usize>> = model
        .flank_facets
        .iter()
        .map(|facet| facet.iter().map(|&pair| pair as usize).collect())
        .filter(|facet: &Vec<usize>| model.pairs[facet[0]].contact == contact)
        .collect();
    let first = &model.pairs[*facets.first()?.first()?];
    let origin = first.position_m;
    let Orientation { right, up, edges } = Orientation::new(first, model.rotation.as_ref());
    let flat = |pair: usize| {
        let from_origin = sub(model.pairs[pair].position_m, origin);
        [dot(from_origin, right), dot(from_origin, up)]
    };
    let mut patches = patches(&facets, flat);
    let corners = || patches.iter().flat_map(|patch| &patch.outline);
    let bound = |axis: usize, pick: fn(f64, f64) -> f64, start: f64| {
        corners().map(|c| c[axis]).fold(start, pick)
    };
    let low = [0, 1].map(|axis| bound(axis, f64::min, f64::INFINITY));
    let high = [0, 1].map(|axis| bound(axis, f64::max, f64::NEG_INFINITY));
    for corner in patches.iter_mut().flat_map(|patch| &mut patch.outline) {
        *corner = [corner[0] - low[0], corner[1] - low[1]];
    }
    Some(Panel {
        name: model.contact_names[contact].clone(),
        edges,
        size: [high[0] - low[0], high[1] - low[1]],
        patches,
    })
}

/// Orientation of a flank in its map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Orientation {
    /// Unit vector to the right.
    pub right: [f64; 3],
    /// Unit vector up.
    pub up: [f64; 3],
    /// Names of the sides left, right, below and above.
    pub edges: [String; 4],
}

impl Orientation {
    /// First pair and orientation of the flank of each contact that has facets.
    pub(crate) fn flank_orientations(model: &Model) -> impl Iterator<Item = (&ContactPair, Self)> {
        (0..model.contact_names.len()).filter_map(|contact| {
            let firsts = model.flank_facets.iter().filter_map(|facet| facet.first());
            let pair = firsts.map(|&pair| &model.pairs[pair as usize]);
            let first = pair.into_iter().find(|pair| pair.contact == contact)?;
            Some((first, Self::new(first, model.rotation.as_ref())))
        })
    }

    fn new(pair: &ContactPair, rotation: Option<&Rotation>) -> Self {
        let [_, t1, t2] = pair.frame;
        let machine = MachineDirections::new(pair.position_m, rotation);
        let (right, [left_edge, right_edge]) =
            align_tangent(t1, machine.axial, ["front end", "rear end"]);
        let (up, [lower_edge, upper_edge]) =
            align_tangent(t2, machine.radial, ["inner edge", "outer edge"]);
        Self {
            right,
            up,
            edges: [left_edge, right_edge, lower_edge, upper_edge],
        }
    }
}

/// Directions of a rotating machine at a point; `None` without rotation.
struct MachineDirections {
    axial: Option<[f64; 3]>,
    radial: Option<[f64; 3]>,
}

impl MachineDirections {
    fn new(point_m: [f64; 3], rotation: Option<&Rotation>) -> Self {
        let outwards = |r: &Rotation| {
            let arm = sub(point_m, r.point_m);
            unit(sub(arm, scaled(r.axis, dot(arm, r.axis))))
        };
        Self {
            axial: rotation.map(|r| r.axis),
            radial: rotation.and_then(outwards),
        }
    }
}

/// Turns a tangent so that it points along a direction of the machine. Returns it with the names of
/// the two sides, at its start and at its end. If the machine has no such direction, or the tangent
/// is perpendicular to it, the tangent is turned along the nearest coordinate axis, which names the
/// sides.
fn align_tangent(
    tangent: [f64; 3],
    machine: Option<[f64; 3]>,
    words: [&str; 2],
) -> ([f64; 3], [String; 2]) {
    let cosine = machine.map_or(0.0, |direction| dot(tangent, direction));
    if cosine.abs() >= LEAST_COSINE {
        return (scaled(tangent, cosine.signum()), words.map(str::to_owned));
    }
    let largest = tangent.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    // The last of equals: of z and y it is z on every flank.
    let nearest = |axis: &usize| tangent[*axis].abs() >= largest * (1.0 - 1e-6);
    let axis = (0..3).rev().find(nearest).unwrap_or(2);
    let letter = ["x", "y", "z"][axis];
    (
        scaled(tangent, tangent[axis].signum()),
        ["−", "+"].map(|sign| format!("towards {sign}{letter}")),
    )
}

/// Outlines of the tributary areas of the pairs: the centroids and edge middles around each pair,
/// and the pair itself if it is on the border.
fn patches(facets: &[Vec<usize>], flat: impl Fn(usize) -> [f64; 2]) -> Vec<Patch> {
    let mean = |points: &[[f64; 2]]| {
        let n = points.len() as f64;
        [0, 1].map(|axis| points.iter().map(|p| p[axis]).sum::<f64>() / n)
    };
    let mut edges: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let mut around: BTreeMap<usize, Vec<[f64; 2]>> = BTreeMap::new();
    for facet in facets {
        let corners: Vec<[f64; 2]> = facet.iter().map(|&pair| flat(pair)).collect();
        let centroid = mean(&corners);
        for i in 0..facet.len() {
            let (a, b) = (facet[i], facet[(i + 1) % facet.len()]);
            around.entry(a).or_default().push(centroid);
            let uses = edges.entry((a.min(b), a.max(b))).or_default();
            *uses += 1;
            if *uses == 1 {
                let middle = mean(&[flat(a), flat(b)]);
                around.entry(a).or_default().push(middle);
                around.entry(b).or_default().push(middle);
            }
        }
    }
    let mut border = std::collections::BTreeSet::new();
    for (&(a, b), &uses) in &edges {
        if uses == 1 {
            border.extend([a, b]);
        }
    }
    around
        .into_iter()
        .map(|(pair, points)| Patch {
            pair,
            outline: outline(flat(pair), points, border.contains(&pair)),
        })
        .collect()
}

/// Points in order around `centre`. On the border the order starts after the widest gap and ends in
/// `centre`.
fn outline(centre: [f64; 2], mut points: Vec<[f64; 2]>, on_border: bool) -> Vec<[f64; 2]> {
    let angle = |p: &[f64; 2]| (p[1] - centre[1]).atan2(p[0] - centre[0]);
    points.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    if on_border {
        let n = points.len();
        let gap = |i: usize| {
            let step = angle(&points[i]) - angle(&points[(i + n - 1) % n]);
            if i == 0 {
                step + std::f64::consts::TAU
            } else {
                step
            }
        };
        let start = (0..n)
            .max_by(|&a, &b| gap(a).total_cmp(&gap(b)))
            .unwrap_or(0);
        points.rotate_left(start);
        points.push(centre);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(outline: &[[f64; 2]]) -> f64 {
        let n = outline.len();
        let cross = |i: usize| {
            let (a, b) = (outline[i], outline[(i + 1) % n]);
            a[0] * b[1] - a[1] * b[0]
        };
        0.5 * (0..n).map(cross).sum::<f64>()
    }

    #[test]
    fn patches_are_the_tributary_areas_and_cover_the_flank() {
        // A 4 x 3 grid of nodes, 1 apart in x and 2 in y, each cell cut in two.
        let flat = |n: usize| [(n % 4) as f64, 2.0 * (n / 4) as f64];
        let mut triangles = Vec::new();
        for j in 0..2 {
            for i in 0..3 {
                let a = 4 * j + i;
                triangles.extend([vec![a, a + 1, a + 5], vec![a, a + 5, a + 4]]);
            }
        }
        let patches = patches(&triangles, flat);
        assert_eq!(patches.len(), 12);
        let mut total = 0.0;
        for Patch {
            pair,
            outline: corners,
        } in &patches
        {
            // A third of each triangle (area 1) the node belongs to.
            let share = triangles.iter().filter(|t| t.contains(pair)).count() as f64 / 3.0;
            assert!(
                (area(corners) - share).abs() < 1e-12,
                "pair {pair}: {}",
                area(corners)
            );
            total += area(corners);
        }
        assert!((total - 12.0).abs() < 1e-12);
    }
}
