//! Joints of the contacts of a model: pairs (slave nodes, frames, areas, and their order), or bonded
//! nodes.

use std::collections::HashMap;

use super::flank::{Flank, FlankOrigin as FlankOf, flank};
use super::groups::Outside;
use super::mortar::mortar;
use super::opposite::{Missed, Opposite, Reach};
use super::tie::{Sheet, tie};
use super::turn::SectorTurn;
use super::{BodyNode, ContactPair, CyclicSpec, FlankMatch, ModelError, Side, Slave};
use crate::model::{ContactSpec, Gap, Sector};
use dovetail_mesh::{Group, Mesh};
use dovetail_numerics::space::{
    Vector, add_scaled, cross, distance, dot, middle, norm, scaled, sub, unit,
};

/// Default search distance, relative to the longest edge of both facets.
const REACH: f64 = 0.5;

/// Joint of one contact, with the node numbers of the mesh.
pub(super) struct ContactJoint {
    pub pairs: Vec<ContactPair>,
    /// Nodes that a bonded contact joins, which has no pairs.
    pub bonded: Vec<Slave>,
    /// Facets of the slave flank as indices of their corners into `pairs`, counter-clockwise seen
    /// from the first body.
    pub facets: Vec<Vec<u32>>,
    /// Slave side, and the master side unless it is rigid ground.
    pub sides: Vec<ContactSide>,
    /// Match of the flanks, for a contact between two.
    pub flank_match: Option<FlankMatch>,
}

impl ContactJoint {
    /// Slave nodes of the pairs, or of the bonded nodes.
    pub(crate) fn slaves(&self) -> impl Iterator<Item = &Slave> {
        let pairs = self.pairs.iter().map(|pair| &pair.slave);
        pairs.chain(&self.bonded)
    }
}

/// Nodes of one body that take part in a contact.
pub(super) struct ContactSide {
    pub body: usize,
    /// Nodes with contact forces, each once, in the order of the pairs.
    pub nodes: Vec<u32>,
    /// Mid-edge nodes that follow the mean of their corners, with these: nodes of facets in a contact
    /// with pairs.
    pub tied: Vec<(u32, [u32; 2])>,
}

/// Surface of one body at a contact.
pub(super) struct ContactSurface {
    body: usize,
    flank: Flank,
    nodes_m: Vec<Vector>,
    /// Positions of [`Flank::middles`], m.
    middles_m: Vec<Vec<Vector>>,
}

impl ContactSurface {
    /// Nodes of the mesh that carry the contact.
    pub(crate) fn nodes(&self) -> &[u32] {
        &self.flank.nodes
    }

    /// Flank `group` of a body, which has this number in the scene and this name and surface.
    pub(crate) fn new(
        mesh: &Mesh,
        contact: &str,
        (name, group): (&str, &Group),
        body: usize,
        (body_name, outside): (&str, &Outside<'_>),
    ) -> Result<Self, ModelError> {
        let of = FlankOf {
            contact,
            group: name,
            body: body_name,
        };
        let flank = flank(mesh, group, outside, &of)?;
        let at = |&n: &u32| mesh.nodes_m[n as usize];
        let middles = flank.middles.iter();
        Ok(Self {
            body,
            nodes_m: flank.positions_m(mesh),
            middles_m: middles.map(|of| of.iter().map(at).collect()).collect(),
            flank,
        })
    }

    /// The same surface of a sector of a disc that lies so many sectors ahead, in the axes of this one.
    pub(crate) fn turned_to_sector(mut self, disc: &CyclicSpec, ahead: i32) -> Self {
        let turn = SectorTurn::new(disc, ahead);
        let middles = self.middles_m.iter_mut().flatten();
        for place in self.nodes_m.iter_mut().chain(middles) {
            *place = turn.place(*place);
        }
        for normal in &mut self.flank.normals {
            *normal = turn.direction(*normal);
        }
        self.flank.along = turn.direction(self.flank.along);
        self
    }

    fn node(&self, i: usize) -> BodyNode {
        BodyNode {
            body: self.body,
            node: self.flank.nodes[i],
        }
    }

    /// Nodes with contact forces, and the middle nodes of the facets that are `met`.
    fn side(&self, nodes: impl Iterator<Item = u32>, met: &[bool]) -> ContactSide {
        let tied = self.flank.tied(met);
        ContactSide {
            tied,
            ..self.bonded_side(nodes)
        }
    }

    fn bonded_side(&self, nodes: impl Iterator<Item = u32>) -> ContactSide {
        let mut seen = std::collections::HashSet::new();
        ContactSide {
            body: self.body,
            nodes: nodes.filter(|n| seen.insert(*n)).collect(),
            tied: Vec::new(),
        }
    }

    /// The surface with its middle nodes.
    fn sheet(&self) -> Sheet {
        let mut sheet = Sheet {
            nodes: self.flank.nodes.clone(),
            nodes_m: self.nodes_m.clone(),
            facets: self.flank.facets.clone(),
        };
        let mut number = HashMap::new();
        let middles = self.flank.middles.iter().zip(&self.middles_m);
        for (facet, (middles, places)) in sheet.facets.iter_mut().zip(middles) {
            for (&node, &place) in middles.iter().zip(places) {
                let at = *number.entry(node).or_insert_with(|| {
                    sheet.nodes.push(node);
                    sheet.nodes_m.push(place);
                    sheet.nodes.len() as u32 - 1
                });
                facet.push(at);
            }
        }
        sheet
    }

    /// Joint of the whole surface to rigid ground, without masters.
    pub(crate) fn bonded_to_ground(&self) -> ContactJoint {
        let sheet = self.sheet();
        let slave = |&node: &u32| Slave {
            node: BodyNode {
                body: self.body,
                node,
            },
            masters: Vec::new(),
            ahead: 0,
        };
        ContactJoint {
            pairs: Vec::new(),
            bonded: sheet.nodes.iter().map(slave).collect(),
            facets: Vec::new(),
            sides: vec![self.bonded_side(sheet.nodes.iter().copied())],
            flank_match: None,
        }
    }
}

/// Flank whose nodes follow the other one: that with the smaller facets, and the first where they
/// are alike.
pub(super) fn finer([first, second]: [&ContactSurface; 2]) -> Side {
    const ALIKE: f64 = 1e-2;
    let [a, b] = [first, second].map(|s| s.flank.facet_area_m2());
    if b < (1.0 - ALIKE) * a {
        Side::Second
    } else {
        Side::First
    }
}

/// Pairs of contact `number` of the model, at the nodes of the flank `slave`. `held` says along
/// which axes a node does not move.
pub(super) fn contact(
    spec: &ContactSpec,
    number: usize,
    [first, second]: [&ContactSurface; 2],
    slave: Side,
    held: impl Fn(BodyNode) -> [bool; 3],
) -> Result<ContactJoint, ModelError> {
    let along = first.flank.along;
    let [own, other] = slave.ordered([first, second]);
    let mortar = mortar(
        [&own.flank, &other.flank],
        [&own.nodes_m, &other.nodes_m],
        reach(spec),
    );
    if mortar.rows.iter().all(Option::is_none) {
        return Err(nothing_opposite(spec, [own, other], &mortar.opposite));
    }
    let mut pairs: Vec<Option<ContactPair>> = Vec::with_capacity(mortar.rows.len());
    let mut summary = unmatched(spec, [first, second], slave, &mortar.opposite);
    for (i, row) in mortar.rows.iter().enumerate() {
        let Some(row) = row else {
            pairs.push(None);
            continue;
        };
        let masters = &row.masters;
        let [met_m, met_normal] =
            [&other.nodes_m, &other.flank.normals].map(|of| mean(of, masters));
        // Out of the second flank is into the first.
        let normals = slave.ordered([own.flank.normals[i], met_normal]);
        let points = slave.ordered([own.nodes_m[i], met_m]);
        let position_m = middle(points[0], points[1]);
        let cosine = unit(met_normal).map_or(0.0, |met| dot(own.flank.normals[i], met));
        let normal = unit(sub(normals[1], normals[0])).filter(|_| cosine < -0.5);
        let normal = normal.ok_or_else(|| ModelError::NotFacing {
            contact: spec.name.clone(),
            position_m,
            degrees: cosine.clamp(-1.0, 1.0).acos().to_degrees(),
        })?;
        let normal = symmetric_normal(normal, held(own.node(i)));
        let apart = dot(normal, sub(points[0], points[1]));
        summary.add(masters, distance(own.nodes_m[i], met_m), apart);
        let mut law = spec.pair_law.scaled_to_area(row.area_m2);
        law.gap_m += match spec.gap {
            Gap::Closed => 0.0,
            Gap::Mesh => apart,
        };
        let master = |&(k, weight): &(u32, f64)| (other.node(k as usize), weight);
        pairs.push(Some(ContactPair {
            contact: number,
            slave: Slave {
                node: own.node(i),
                masters: row.masters.iter().map(master).collect(),
                ahead: i32::from(spec.second_sector == Sector::Next),
            },
            side: slave,
            position_m,
            frame: frame(normal, along),
            area_m2: row.area_m2,
            law,
        }));
    }
    let mut contact = ordered(pairs, &own.flank, along, slave);
    let masters = contact.pairs.iter().flat_map(|p| &p.slave.masters);
    let masters = masters.map(|(at, _)| at.node);
    contact.sides = vec![
        own.side(
            contact.pairs.iter().map(|p| p.slave.node.node),
            &mortar.opposite.met[0],
        ),
        other.side(masters, &mortar.opposite.met[1]),
    ];
    contact.flank_match = Some(summary);
    Ok(contact)
}

/// Joint of a bonded contact, at all nodes of the flank `slave` that lie opposite the other one.
pub(super) fn bond(
    spec: &ContactSpec,
    [first, second]: [&ContactSurface; 2],
    slave: Side,
) -> Result<ContactJoint, ModelError> {
    let [own, other] = slave.ordered([first, second]);
    let [slaves, masters] = [own, other].map(ContactSurface::sheet);
    let tie = tie([&slaves, &masters], reach(spec));
    if tie.rows.iter().all(Option::is_none) {
        return Err(nothing_opposite(spec, [own, other], &tie.opposite));
    }
    let mut summary = unmatched(spec, [first, second], slave, &tie.opposite);
    let mut bonded = Vec::with_capacity(slaves.nodes.len());
    for (i, row) in tie.rows.iter().enumerate() {
        let Some(row) = row else { continue };
        let apart = sub(mean(&masters.nodes_m, row), slaves.nodes_m[i]);
        // Corners come first, and have normals.
        let normal = own.flank.normals.get(i);
        summary.add(row, norm(apart), normal.map_or(0.0, |n| dot(*n, apart)));
        let at = |surface: &ContactSurface, node: u32| BodyNode {
            body: surface.body,
            node,
        };
        let master = |&(k, weight): &(u32, f64)| (at(other, masters.nodes[k as usize]), weight);
        bonded.push(Slave {
            node: at(own, slaves.nodes[i]),
            masters: row.iter().map(master).collect(),
            ahead: i32::from(spec.second_sector == Sector::Next),
        });
    }
    let followed = bonded.iter().flat_map(|slave| &slave.masters);
    let sides = vec![
        own.bonded_side(bonded.iter().map(|slave| slave.node.node)),
        other.bonded_side(followed.map(|(at, _)| at.node)),
    ];
    Ok(ContactJoint {
        pairs: Vec::new(),
        bonded,
        facets: Vec::new(),
        sides,
        flank_match: Some(summary),
    })
}

fn reach(spec: &ContactSpec) -> Reach {
    let given = spec.search_distance_m;
    given.map_or(Reach::OfFacets(REACH), Reach::Given)
}

/// Report of a match of two surfaces, without any nodes.
fn unmatched(
    spec: &ContactSpec,
    [first, second]: [&ContactSurface; 2],
    slave: Side,
    opposite: &Opposite,
) -> FlankMatch {
    let [own, _] = slave.ordered([first, second]);
    FlankMatch {
        name: spec.name.clone(),
        slave,
        covered: slave.ordered(opposite.covered),
        covered_along: covered_along([first, second], first.flank.along),
        largest_mismatch_m: 0.0,
        largest_separation_m: 0.0,
        largest_overlap_m: 0.0,
        facet_m: own.flank.facet_area_m2().sqrt(),
        largest_weight: 0.0,
        nodes_match: true,
    }
}

impl FlankMatch {
    /// Adds a node with these weights of its masters, at this distance from its counterpart, and apart
    /// from it along the normal by this length, negative if the bodies overlap.
    fn add(&mut self, masters: &[(u32, f64)], mismatch_m: f64, apart_m: f64) {
        let weights = masters.iter().map(|(_, w)| w.abs());
        self.largest_weight = weights.fold(self.largest_weight, f64::max);
        self.largest_mismatch_m = self.largest_mismatch_m.max(mismatch_m);
        self.largest_separation_m = self.largest_separation_m.max(apart_m.abs());
        self.largest_overlap_m = self.largest_overlap_m.max(-apart_m);
        self.nodes_match &= masters.len() == 1;
    }
}

/// Fractions of the lengths of two surfaces along a direction over which the other one extends.
fn covered_along(surfaces: [&ContactSurface; 2], along: Vector) -> [f64; 2] {
    let ends = surfaces.map(|surface| {
        let places = surface.nodes_m.iter().map(|x| dot(*x, along));
        places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place| {
            [low.min(place), high.max(place)]
        })
    });
    let common = ends[0][1].min(ends[1][1]) - ends[0][0].max(ends[1][0]);
    ends.map(|[low, high]| (common / (high - low)).clamp(0.0, 1.0))
}

/// Weighted mean of vectors at the masters of a row.
fn mean(of: &[Vector], masters: &[(u32, f64)]) -> Vector {
    let mut sum = [0.0; 3];
    for &(k, weight) in masters {
        add_scaled(&mut sum, weight, of[k as usize]);
    }
    sum
}

/// Error of two flanks without facets opposite each other. `found` is the result within the search
/// distance; beyond it the nearest nodes show whether the bodies are apart or overlap.
fn nothing_opposite(
    spec: &ContactSpec,
    [own, other]: [&ContactSurface; 2],
    found: &Opposite,
) -> ModelError {
    let not_facing = |missed: Missed| ModelError::NotFacing {
        contact: spec.name.clone(),
        position_m: missed.position_m,
        degrees: missed.degrees,
    };
    let none_opposite = |nearest| ModelError::NoneOpposite {
        contact: spec.name.clone(),
        first: spec.first.clone(),
        second: spec.second.clone().unwrap_or_default(),
        nearest,
    };
    match found.missed {
        Some(missed) if missed.degrees < LEAST_DEGREES => return not_facing(missed),
        Some(missed) => return none_opposite(Some((missed.position_m, missed.apart_m))),
        None => {}
    }
    let nodes = || own.nodes_m.iter().chain(&other.nodes_m);
    let from = nodes().next().copied().unwrap_or_default();
    let size_m = nodes().map(|x| distance(*x, from)).fold(0.0, f64::max);
    let beyond = mortar(
        [&own.flank, &other.flank],
        [&own.nodes_m, &other.nodes_m],
        Reach::Given(2.0 * size_m),
    );
    let apart = beyond.rows.iter().enumerate().filter_map(|(i, row)| {
        let met_m = mean(&other.nodes_m, &row.as_ref()?.masters);
        let apart_m = dot(own.flank.normals[i], sub(met_m, own.nodes_m[i]));
        Some((middle(own.nodes_m[i], met_m), apart_m))
    });
    let nearest = apart.min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    match beyond
        .opposite
        .missed
        .filter(|missed| missed.degrees < LEAST_DEGREES)
    {
        Some(missed) if nearest.is_none() => not_facing(missed),
        _ => none_opposite(nearest),
    }
}

/// Least angle between the normals of flanks that face each other, degrees.
const LEAST_DEGREES: f64 = 120.0;

/// Pairs of every corner node of a flank with rigid ground at the same place.
pub(super) fn ground_contact(
    spec: &ContactSpec,
    number: usize,
    surface: &ContactSurface,
    held: impl Fn(BodyNode) -> [bool; 3],
) -> ContactJoint {
    let flank = &surface.flank;
    let pair = |i: usize| ContactPair {
        contact: number,
        slave: Slave {
            node: surface.node(i),
            masters: Vec::new(),
            ahead: 0,
        },
        side: Side::First,
        position_m: surface.nodes_m[i],
        // Out of the ground is into the body.
        frame: frame(
            symmetric_normal(flank.normals[i].map(|n| -n), held(surface.node(i))),
            flank.along,
        ),
        area_m2: flank.areas_m2[i],
        law: spec.pair_law.scaled_to_area(flank.areas_m2[i]),
    };
    let pairs = (0..flank.nodes.len()).map(|i| Some(pair(i))).collect();
    let mut contact = ordered(pairs, flank, flank.along, Side::First);
    let nodes = contact.pairs.iter().map(|p| p.slave.node.node);
    contact.sides = vec![surface.side(nodes, &vec![true; flank.facets.len()])];
    contact
}

/// Orders pairs, of which there is at most one for each node of the slave flank, along the slot.
fn ordered(
    pairs: Vec<Option<ContactPair>>,
    flank: &Flank,
    along: Vector,
    slave: Side,
) -> ContactJoint {
    let mut place: Vec<Option<u32>> = vec![None; pairs.len()];
    let (nodes, pairs): (Vec<usize>, Vec<ContactPair>) = pairs
        .into_iter()
        .enumerate()
        .filter_map(|(node, pair)| Some((node, pair?)))
        .unzip();
    let order = order_along(&pairs, along);
    for (new, &old) in (0..).zip(&order) {
        place[nodes[old]] = Some(new);
    }
    let facet = |facet: &Vec<u32>| -> Option<Vec<u32>> {
        let of_pairs = facet.iter().map(|&i| place[i as usize]);
        let mut facet: Vec<u32> = of_pairs.collect::<Option<_>>()?;
        // Seen from outside a facet of the first body turns the other way than seen from it.
        if slave == Side::First {
            facet.reverse();
        }
        Some(facet)
    };
    ContactJoint {
        facets: flank.facets.iter().filter_map(facet).collect(),
        pairs: order.iter().map(|&old| pairs[old].clone()).collect(),
        bonded: Vec::new(),
        sides: Vec::new(),
        flank_match: None,
    }
}

/// Normal of a node that is held along some axes, as on planes of symmetry: the other half of a
/// curved flank turns it into the plane. A normal that is far from the plane stays as it is.
fn symmetric_normal(normal: Vector, held: [bool; 3]) -> Vector {
    let in_plane = [0, 1, 2].map(|k| if held[k] { 0.0 } else { normal[k] });
    let cosine = dot(in_plane, in_plane).sqrt();
    let turned = unit(in_plane).filter(|_| in_plane != normal && cosine > IN_PLANE);
    turned.unwrap_or(normal)
}

/// Cosine of the largest angle by which a normal is turned into a plane of symmetry: 30 degrees, as
/// for a flank whose facets turn by 60 degrees at each edge.
const IN_PLANE: f64 = 0.866;

/// Rows n, t1, t2: t1 is `along` projected on the tangent plane, t2 = n x t1. Where a curved flank
/// is perpendicular to `along`, the axis least along n takes its place.
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

/// Order of the pairs along the slot, then across. It depends on where the nodes are and not on how
/// the mesh numbers them.
fn order_along(pairs: &[ContactPair], along: Vector) -> Vec<usize> {
    let mut mean = [0.0; 3];
    for pair in pairs {
        add_scaled(&mut mean, 1.0, pair.frame[0]);
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
    fn normals_are_turned_into_planes_of_symmetry_that_are_near() {
        let normal = [0.28, 0.0, 0.96];
        assert_eq!(symmetric_normal(normal, [false; 3]), normal);
        assert_eq!(symmetric_normal(normal, [false, true, false]), normal);
        assert_eq!(
            symmetric_normal(normal, [true, false, false]),
            [0.0, 0.0, 1.0]
        );
        assert_eq!(
            symmetric_normal(normal, [true, true, false]),
            [0.0, 0.0, 1.0]
        );
        assert_eq!(symmetric_normal(normal, [false, false, true]), normal);
        assert_eq!(symmetric_normal(normal, [true; 3]), normal);
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
