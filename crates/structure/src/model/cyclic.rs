//! Faces at which the sectors of a disc meet.
//!
//! A node of the high face moves with the low face of the next sector that lies at the same place:
//! with the node there, where both faces have the same mesh, one turned by a pitch. Elsewhere the
//! finer face follows the other one as a bonded surface does (`tie.rs`).

use std::collections::BTreeSet;

use super::builder::BodyBuilder;
use super::contacts::{bond, finer};
use super::groups::{find_surface, first_tags};
use super::influence::influence;
use super::joints::{make_local, surface};
use super::tie::Meeting;
use super::turn::SectorTurn;
use super::{
    BodyNode, ContactLaw, ContactSpec, Cyclic, CyclicSpec, FlankMatch, ModelError, Side, Slave,
};
use dovetail_dynamics::reduced::InfluenceCoefficient;
use dovetail_mesh::Mesh;
use dovetail_numerics::space::{Vector, cross, diagonal, norm, sub};

/// Sine of the largest angle by which a pitch turns an axis along which a face is held.
const UNTURNED: f64 = 1e-9;
/// Distance of a node from the axis, relative to the size of its face, below which it is on the axis.
const ON_AXIS: f64 = 1e-6;
/// Least share of each face that lies on the other one.
const COVERED: f64 = 0.99;

/// Cyclic symmetry of the bodies, whose nodes at the faces become part of their interfaces. `read` are
/// the coefficients of the file of the aerodynamic influence.
pub(super) fn cyclic(
    spec: &CyclicSpec,
    mesh: &Mesh,
    bodies: &mut [BodyBuilder],
    read: Option<&[InfluenceCoefficient]>,
) -> Result<Cyclic, ModelError> {
    let low = SectorFace::new(&spec.low, "low", mesh, bodies)?;
    let high = SectorFace::new(&spec.high, "high", mesh, bodies)?;
    let turn = SectorTurn::new(spec, 1);
    let names: Vec<String> = bodies.iter().map(|body| body.name().to_owned()).collect();
    let of_air = spec.influence.as_ref();
    let of_air = of_air.map(|of_air| influence(of_air, spec.sectors, &names, read));
    let on_high: BTreeSet<&BodyNode> = high.nodes.iter().collect();
    let size_m = diagonal(&low.nodes_m);
    let on_axis = low.nodes.iter().zip(&low.nodes_m).filter(|(at, x)| {
        let from_axis = cross(spec.axis, sub(**x, spec.point_m));
        on_high.contains(at) || norm(from_axis) < ON_AXIS * size_m
    });
    let (count, tags) = first_tags(mesh, on_axis.map(|(at, _)| &at.node));
    if count > 0 {
        return Err(ModelError::FaceOnAxis { count, tags });
    }
    let in_contact = |at: &&BodyNode| bodies[at.body].is_in_contact(at.node);
    let in_contact = low.nodes.iter().chain(&high.nodes).filter(in_contact);
    let (count, tags) = first_tags(mesh, in_contact.map(|at| &at.node));
    if count > 0 {
        return Err(ModelError::FaceInContact { count, tags });
    }
    let (mut largest_mismatch_m, mut spacing_m) = (0.0, f64::INFINITY);
    let (ties, matches) = match low.meet(&high, spec, mesh) {
        Ok(met) => {
            (largest_mismatch_m, spacing_m) = (met.farthest_m(), met.spacing_m);
            let ties = node_by_node([&low, &high], &met, turn.matrix, mesh, bodies)?;
            (ties, Vec::new())
        }
        Err(apart) => face_by_face(spec, &apart, mesh, bodies)?,
    };
    Ok(Cyclic {
        sectors: spec.sectors,
        ties,
        matches,
        largest_mismatch_m,
        spacing_m,
        point_m: spec.point_m,
        turn: turn.matrix,
        engine_order: spec.engine_order,
        influence: of_air.transpose()?,
    })
}

/// Ties of faces whose nodes meet: node i of the low face and the nearest one of the high face.
fn node_by_node(
    [low, high]: [&SectorFace; 2],
    met: &Meeting,
    turn: [[f64; 3]; 3],
    mesh: &Mesh,
    bodies: &mut [BodyBuilder],
) -> Result<Vec<Slave>, ModelError> {
    let both = |i: usize| [low.nodes[i], high.nodes[met.nearest[i].0]];
    let of_pairs = || (0..low.nodes.len()).map(both);
    let tags_of = |is_wrong: &dyn Fn(&[BodyNode; 2]) -> bool| {
        let wrong: Vec<u32> = of_pairs().filter(is_wrong).map(|[at, _]| at.node).collect();
        let (count, tags) = first_tags(mesh, wrong.iter());
        (count > 0).then_some((count, tags))
    };
    let held = |at: &BodyNode| {
        let fixed = bodies[at.body].is_fixed(at.node);
        [0, 1, 2].map(|axis| fixed || bodies[at.body].is_held(at.node, axis))
    };
    let is_turned = |axis: usize| (turn[axis][axis] - 1.0).abs() > UNTURNED;
    let is_wrong = |[a, b]: &[BodyNode; 2]| {
        let axes = held(a);
        let turns = axes != [true; 3] && (0..3).any(|axis| axes[axis] && is_turned(axis));
        axes != held(b) || turns
    };
    if let Some((count, tags)) = tags_of(&is_wrong) {
        return Err(ModelError::FaceHeld { count, tags });
    }
    let moves = |both: &[BodyNode; 2]| held(&both[0]) != [true; 3];
    let moving: Vec<[BodyNode; 2]> = of_pairs().filter(moves).collect();
    let mut ties = Vec::with_capacity(moving.len());
    for both in moving {
        let [master, node] = both.map(|at| {
            let body = &mut bodies[at.body];
            body.add_flank(&[at.node], &[]);
            BodyNode {
                node: body.local(at.node),
                ..at
            }
        });
        ties.push(Slave {
            node,
            masters: vec![(master, 1.0)],
            ahead: 1,
        });
    }
    Ok(ties)
}

/// Ties of faces whose meshes differ, each low face with the high one at the same place of its list,
/// and how these lie on each other. `apart` is the error where they do not.
fn face_by_face(
    spec: &CyclicSpec,
    apart: &ModelError,
    mesh: &Mesh,
    bodies: &mut [BodyBuilder],
) -> Result<(Vec<Slave>, Vec<FlankMatch>), ModelError> {
    if spec.low.len() != spec.high.len() {
        return Err(apart.clone());
    }
    let (mut ties, mut matches) = (Vec::new(), Vec::new());
    // Nodes of the ties so far: faces of one list may share an edge.
    let mut joined: BTreeSet<BodyNode> = BTreeSet::new();
    for (low, high) in spec.low.iter().zip(&spec.high) {
        let bonded = ContactSpec {
            law: ContactLaw::Bonded,
            ..ContactSpec::new(high, high, low, 0.0)
        };
        let faces = |name: &str| surface(mesh, &bonded, name, bodies);
        let both = [faces(high)?, faces(low)?];
        // The finer face follows, and the other one is brought to its place.
        let slave = finer([&both[0], &both[1]]);
        let ahead = match slave {
            Side::First => 1,
            Side::Second => -1,
        };
        let [own, other] = slave.ordered(both);
        let other = other.turned_to_sector(spec, ahead);
        let tied = bond(&bonded, slave.ordered([&own, &other]), slave);
        let mut tied = tied.map_err(|_| apart.clone())?;
        let covered = tied.flank_match.as_ref().map_or([0.0; 2], |m| m.covered);
        if covered.iter().any(|share| *share < COVERED) {
            return Err(apart.clone());
        }
        for side in &tied.sides {
            bodies[side.body].add_flank(&side.nodes, &[]);
        }
        let mut bonded = Vec::with_capacity(tied.bonded.len());
        for mut tie in tied.bonded.drain(..) {
            let is_fixed = bodies[tie.node.body].is_fixed(tie.node.node);
            make_local(&mut tie, bodies);
            if !is_fixed && !joined.contains(&tie.node) {
                bonded.push(Slave { ahead, ..tie });
            }
        }
        for tie in &bonded {
            joined.insert(tie.node);
            joined.extend(tie.masters.iter().map(|(at, _)| *at));
        }
        ties.append(&mut bonded);
        matches.extend(tied.flank_match);
    }
    Ok((ties, matches))
}

/// Nodes of the mesh on one side of the sector, each once, with their bodies.
struct SectorFace {
    nodes: Vec<BodyNode>,
    nodes_m: Vec<Vector>,
}

impl SectorFace {
    fn new(
        groups: &[String],
        key: &str,
        mesh: &Mesh,
        bodies: &[BodyBuilder],
    ) -> Result<Self, ModelError> {
        let used_by = format!("[cyclic], {key}");
        let mut nodes: Vec<u32> = Vec::new();
        for name in groups {
            let group = find_surface(mesh, name, &used_by)?;
            let nobody = |n: &&u32| !bodies.iter().any(|body| body.has(**n));
            let (count, tags) = first_tags(mesh, group.nodes.iter().filter(nobody));
            if count > 0 {
                return Err(ModelError::NoBodyAtFace {
                    used_by,
                    group: name.clone(),
                    count,
                    tags,
                });
            }
            nodes.extend(&group.nodes);
        }
        nodes.sort_unstable();
        nodes.dedup();
        let owner = |n: u32| bodies.iter().position(|body| body.has(n)).unwrap_or(0);
        let nodes = nodes.into_iter().map(|node| BodyNode {
            body: owner(node),
            node,
        });
        let nodes: Vec<BodyNode> = nodes.collect();
        let at = |at: &BodyNode| mesh.nodes_m[at.node as usize];
        Ok(Self {
            nodes_m: nodes.iter().map(at).collect(),
            nodes,
        })
    }

    /// Nodes of `high` that the nodes meet when this face is turned by one pitch.
    fn meet(
        &self,
        high: &SectorFace,
        spec: &CyclicSpec,
        mesh: &Mesh,
    ) -> Result<Meeting, ModelError> {
        let turned = |ahead: i32| {
            let turn = SectorTurn::new(spec, ahead);
            Meeting::new(&self.nodes_m, &high.nodes_m, |x| turn.place(x))
        };
        let meeting = turned(1);
        if meeting.unmatched_nodes().next().is_some() {
            let apart = meeting.unmatched_nodes().map(|i| self.nodes[i].node);
            let apart: Vec<u32> = apart.collect();
            let (count, tags) = first_tags(mesh, apart.iter());
            return Err(ModelError::FacesApart {
                sectors: spec.sectors,
                count,
                tags,
                distance_m: meeting.farthest_m(),
                other_way: turned(-1).unmatched_nodes().next().is_none(),
            });
        }
        let mut once: Vec<usize> = meeting.nearest.iter().map(|near| near.0).collect();
        once.sort_unstable();
        once.dedup();
        if once.len() != high.nodes.len() || self.nodes.len() != high.nodes.len() {
            return Err(ModelError::FacesDiffer {
                low: self.nodes.len(),
                high: high.nodes.len(),
            });
        }
        Ok(meeting)
    }
}
