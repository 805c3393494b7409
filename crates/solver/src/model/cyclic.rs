//! Faces at which the sectors of a disc meet.
//!
//! A node of the high face moves with the node of the low face of the next sector that lies at the
//! same place. Both faces have the same mesh, one turned by a pitch.

use std::f64::consts::TAU;

use super::builder::BodyBuilder;
use super::groups::{find_surface, first_tags};
use super::neighbours::PointTree;
use super::{BodyNode, Cyclic, CyclicSpec, ModelError, Slave};
use crate::structure::OtherSector;
use dovetail_mesh::Mesh;
use dovetail_numerics::space::{Vector, add_scaled, cross, dot, scaled, sub};

/// Largest distance of two nodes that meet, relative to the smallest distance of two nodes of a
/// face.
const MEETING: f64 = 0.02;
/// Sine of the largest angle by which a pitch turns an axis along which a face is held.
const UNTURNED: f64 = 1e-9;

/// Cyclic symmetry of the bodies, whose nodes at the faces become part of their interfaces.
pub(super) fn cyclic(
    spec: &CyclicSpec,
    mesh: &Mesh,
    bodies: &mut [BodyBuilder],
) -> Result<Cyclic, ModelError> {
    let low = Face::of(&spec.low, "low", mesh, bodies)?;
    let high = Face::of(&spec.high, "high", mesh, bodies)?;
    let pitch = TAU / spec.sectors as f64;
    let met = low.meet(&high, spec, pitch, mesh)?;
    let both = |i: usize| [low.nodes[i], high.nodes[met[i]]];
    let of_pairs = || (0..low.nodes.len()).map(both);
    let turn = turn(spec.axis, pitch);
    let tags_of = |is_wrong: &dyn Fn(&[BodyNode; 2]) -> bool| {
        let wrong: Vec<u32> = of_pairs().filter(is_wrong).map(|[at, _]| at.node).collect();
        let (count, tags) = first_tags(mesh, wrong.iter());
        (count > 0).then_some((count, tags))
    };
    if let Some((count, tags)) = tags_of(&|[a, b]| a == b) {
        return Err(ModelError::FaceOnAxis { count, tags });
    }
    let in_contact = |at: &BodyNode| bodies[at.body].is_in_contact(at.node);
    if let Some((count, tags)) = tags_of(&|both| both.iter().any(in_contact)) {
        return Err(ModelError::FaceInContact { count, tags });
    }
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
            in_next_sector: true,
        });
    }
    Ok(Cyclic {
        sectors: spec.sectors,
        ties,
        next: OtherSector { ahead: 1, turn },
    })
}

/// Nodes of the mesh on one side of the sector, each once, with their bodies.
struct Face {
    nodes: Vec<BodyNode>,
    nodes_m: Vec<Vector>,
}

impl Face {
    fn of(
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

    /// Number of the node of `high` that each node meets when this face is turned by `pitch`.
    fn meet(
        &self,
        high: &Face,
        spec: &CyclicSpec,
        pitch: f64,
        mesh: &Mesh,
    ) -> Result<Vec<usize>, ModelError> {
        let (low, tree) = (PointTree::new(&self.nodes_m), PointTree::new(&high.nodes_m));
        let spacing_m = |x: &Vector| low.nearest(*x).nth(1).map(|(_, square)| square.sqrt());
        let spacings_m = self.nodes_m.iter().filter_map(spacing_m);
        let reach_m = MEETING * spacings_m.fold(f64::INFINITY, f64::min);
        let nearest = |x: &Vector, angle: f64| {
            let place = turned_about(*x, spec, angle);
            let found = tree.nearest(place).next();
            found.map_or((0, f64::INFINITY), |(k, square)| (k, square.sqrt()))
        };
        let found: Vec<(usize, f64)> = self.nodes_m.iter().map(|x| nearest(x, pitch)).collect();
        // Not less than or equal: a face of one node has no spacing, and meets anything.
        let is_apart = |far: &(usize, f64)| far.1 > reach_m;
        if found.iter().any(is_apart) {
            let apart = self
                .nodes
                .iter()
                .zip(&found)
                .filter(|(_, far)| is_apart(far));
            let apart: Vec<u32> = apart.map(|(at, _)| at.node).collect();
            let (count, tags) = first_tags(mesh, apart.iter());
            let back = self.nodes_m.iter().map(|x| nearest(x, -pitch));
            return Err(ModelError::FacesApart {
                sectors: spec.sectors,
                count,
                tags,
                distance_m: found.iter().map(|far| far.1).fold(0.0, f64::max),
                other_way: back.into_iter().all(|far| !is_apart(&far)),
            });
        }
        let found: Vec<usize> = found.into_iter().map(|(k, _)| k).collect();
        let mut once = found.clone();
        once.sort_unstable();
        once.dedup();
        if once.len() != high.nodes.len() || found.len() != high.nodes.len() {
            return Err(ModelError::FacesDiffer {
                low: self.nodes.len(),
                high: high.nodes.len(),
            });
        }
        Ok(found)
    }
}

/// Matrix that turns by an angle, radians, about a direction of unit length (O. Rodrigues, J. Math.
/// Pures Appl. 5 (1840) 380-440).
fn turn(axis: Vector, angle: f64) -> [[f64; 3]; 3] {
    let (sine, cosine) = angle.sin_cos();
    let columns = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|unit| {
        let mut column = scaled(unit, cosine);
        add_scaled(&mut column, sine, cross(axis, unit));
        add_scaled(&mut column, (1.0 - cosine) * dot(axis, unit), axis);
        column
    });
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| columns[j][i]))
}

/// Place in the next sector of a disc that has the place `x` in this one, in the axes of this one, m.
pub(super) fn next_place(x: Vector, spec: &CyclicSpec) -> Vector {
    turned_about(x, spec, TAU / spec.sectors as f64)
}

/// Direction in the next sector of a disc, in the axes of this one.
pub(super) fn next_direction(d: Vector, spec: &CyclicSpec) -> Vector {
    turn(spec.axis, TAU / spec.sectors as f64).map(|row| dot(row, d))
}

/// Place to which a point comes when it is turned about the axis.
fn turned_about(x: Vector, spec: &CyclicSpec, angle: f64) -> Vector {
    let arm = sub(x, spec.point_m);
    let mut place = spec.point_m;
    for (place, row) in place.iter_mut().zip(turn(spec.axis, angle)) {
        *place += dot(row, arm);
    }
    place
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_numerics::space::distance;

    #[test]
    fn a_turn_follows_the_right_hand() {
        let quarter = turn([0.0, 0.0, 1.0], TAU / 4.0);
        for (row, expected) in quarter.iter().zip([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0]]) {
            assert!(distance(*row, expected) < 1e-15, "{quarter:?}");
        }
        let spec = CyclicSpec {
            sectors: 4,
            low: Vec::new(),
            high: Vec::new(),
            point_m: [1.0, 0.0, 0.0],
            axis: [0.0, 0.0, 1.0],
        };
        let place = turned_about([2.0, 0.0, 5.0], &spec, TAU / 4.0);
        assert!(distance(place, [1.0, 1.0, 5.0]) < 1e-15, "{place:?}");
    }
}
