//! Positions of bodies about the axis of rotation, from which likely mistakes show: an axis that runs
//! through a blade, and a sector of a disc whose sides nothing holds.

use std::f64::consts::PI;

use crate::model::{Body, BodyNode, Model, NodeMotion, Rotation};
use dovetail_numerics::space::{Vector, add_scaled, cross, dot, norm, scaled, sub, unit};

/// Distances of the nodes of a body from an axis.
struct AxisDistances {
    /// Smallest and largest distance, m.
    radii_m: [f64; 2],
    /// Distance of the mean of the nodes, m.
    centre_m: f64,
    /// Longest side of the box of the nodes, m.
    longest_m: f64,
}

fn axis_distances(body: &Body, rotation: &Rotation) -> Option<AxisDistances> {
    let across = |x: Vector| {
        let arm = sub(x, rotation.point_m);
        sub(arm, scaled(rotation.axis, dot(arm, rotation.axis)))
    };
    let nodes = body.nodes_m.iter();
    let radii = nodes.clone().map(|x| norm(across(*x)));
    let radii_m = radii.fold([f64::INFINITY, 0.0], |[low, high], r| {
        [r.min(low), r.max(high)]
    });
    let mut mean = [0.0; 3];
    for x in nodes.clone() {
        add_scaled(&mut mean, 1.0 / body.nodes_m.len() as f64, *x);
    }
    let side = |k: usize| {
        let [low, high] = nodes
            .clone()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
                [x[k].min(low), x[k].max(high)]
            });
        high - low
    };
    let longest_m = [0, 1, 2].map(side).into_iter().fold(0.0, f64::max);
    (longest_m > 0.0).then(|| AxisDistances {
        radii_m,
        centre_m: norm(across(mean)),
        longest_m,
    })
}

/// Body through which the axis of rotation runs.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct BodyOnAxis<'m> {
    /// Name of the body.
    pub name: &'m str,
    /// True if the axis runs through its middle: the centrifugal load does not throw it outwards.
    pub in_the_middle: bool,
    /// Largest distance of a node from the axis, m.
    pub farthest_m: f64,
}

/// Rotating bodies without supports and springs through which the axis runs, if only the centrifugal
/// load presses them. A ring does not count.
pub fn bodies_on_axis(model: &Model) -> Vec<BodyOnAxis<'_>> {
    // A hole is larger.
    const AT_THE_AXIS: f64 = 0.4;
    const IN_THE_MIDDLE: f64 = 0.02;
    let is_loaded = model.bodies.iter().any(|body| !body.loads.is_empty());
    let rotation = model.rotation.as_ref().filter(|r| r.speed_rad_s > 0.0);
    let Some(rotation) = rotation.filter(|_| !is_loaded) else {
        return Vec::new();
    };
    let is_free =
        |body: &&Body| body.rotates && body.supports.is_empty() && body.springs.is_empty();
    let rotating = model.bodies.iter().filter(is_free);
    let at_axis = rotating.filter_map(|body| {
        let AxisDistances {
            radii_m: [nearest_m, farthest_m],
            centre_m,
            longest_m,
        } = axis_distances(body, rotation)?;
        let is_through = nearest_m < AT_THE_AXIS * farthest_m && surrounds(body, rotation);
        is_through.then_some(BodyOnAxis {
            name: &body.name,
            in_the_middle: centre_m < IN_THE_MIDDLE * longest_m,
            farthest_m,
        })
    });
    at_axis.collect()
}

/// Returns `true` if no half of the space about the axis is free of the body.
fn surrounds(body: &Body, rotation: &Rotation) -> bool {
    const ROUNDING: f64 = 1e-3;
    let least = (0..3).fold(0, |least, k| {
        if rotation.axis[k].abs() < rotation.axis[least].abs() {
            k
        } else {
            least
        }
    });
    let other = [0, 1, 2].map(|k| if k == least { 1.0 } else { 0.0 });
    let Some(across) = unit(cross(rotation.axis, other)) else {
        return false;
    };
    let up = cross(rotation.axis, across);
    let arms = body.nodes_m.iter().map(|x| sub(*x, rotation.point_m));
    let mut angles: Vec<f64> = arms
        .map(|arm| dot(arm, up).atan2(dot(arm, across)))
        .collect();
    angles.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (angles.first(), angles.last()) else {
        return false;
    };
    let gaps = angles.windows(2).map(|two| two[1] - two[0]);
    let widest = gaps.chain([first + 2.0 * PI - last]).fold(0.0, f64::max);
    widest <= PI + ROUNDING
}

/// Body with free sides.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct FreeSides<'m> {
    /// Name of the body.
    pub name: &'m str,
    /// Axis along which its sides are to be held, 0 to 2; `None` if it is not one of the three.
    pub along: Option<usize>,
}

/// Supported bodies that hold a body farther out and whose sides across the circumference are free.
/// Such a body is probably a sector of a disc.
pub fn free_sides(model: &Model) -> impl Iterator<Item = FreeSides<'_>> {
    let rotation = model.rotation.as_ref();
    let rotation = rotation.filter(|r| r.speed_rad_s > 0.0 && model.cyclic.is_none());
    let bodies = model.bodies.iter().enumerate();
    bodies.filter_map(move |(b, body)| {
        let rotation = rotation.filter(|_| body.rotates && !body.supports.is_empty())?;
        let own_m = axis_distances(body, rotation)?.centre_m;
        let holds = |other: usize| {
            let other = &model.bodies[other];
            other.supports.is_empty()
                && axis_distances(other, rotation).is_some_and(|other| other.centre_m > own_m)
        };
        holds_any(model, b, &holds).then_some(())?;
        let tangent = tangent(body, rotation)?;
        let along = (0..3).find(|k| tangent[*k].abs() > 0.9);
        let is_free = |side: &Vec<usize>| {
            let held = side
                .iter()
                .filter(|node| is_held(body, **node, tangent))
                .count();
            !side.is_empty() && 2 * held < side.len()
        };
        let sides = sides(body, rotation, tangent)?;
        sides.iter().all(is_free).then_some(FreeSides {
            name: &body.name,
            along,
        })
    })
}

/// Returns `true` if a body touches, or is bonded to, another one of a kind.
fn holds_any(model: &Model, body: usize, is_kind: &dyn Fn(usize) -> bool) -> bool {
    let pairs = model.pairs.iter().map(|pair| &pair.slave);
    let mut others: Vec<usize> = Vec::new();
    for slave in pairs.chain(&model.bonded) {
        let master = slave
            .masters
            .first()
            .map(|(BodyNode { body, .. }, _)| *body);
        match (slave.node.body, master) {
            (own, Some(other)) if own == body && other != body => others.push(other),
            (other, Some(own)) if own == body && other != body => others.push(other),
            _ => {}
        }
    }
    others.sort_unstable();
    others.dedup();
    others.into_iter().any(is_kind)
}

/// Circumferential direction at the middle of a body; `None` if the middle is on the axis.
fn tangent(body: &Body, rotation: &Rotation) -> Option<Vector> {
    let mut mean = [0.0; 3];
    for x in &body.nodes_m {
        add_scaled(&mut mean, 1.0 / body.nodes_m.len() as f64, *x);
    }
    unit(cross(rotation.axis, sub(mean, rotation.point_m)))
}

/// Nodes of the two sides of a body: those at its ends along the tangent, or at the ends of its angle
/// round the axis, whichever are more. `None` if the body is more than half of a ring.
fn sides(body: &Body, rotation: &Rotation, tangent: Vector) -> Option<[Vec<usize>; 2]> {
    const AT_AN_END: f64 = 0.01;
    let outward = cross(tangent, rotation.axis);
    let arms = body.nodes_m.iter().map(|x| sub(*x, rotation.point_m));
    let places: Vec<[f64; 2]> = arms
        .map(|arm| {
            [
                dot(arm, tangent),
                dot(arm, tangent).atan2(dot(arm, outward)),
            ]
        })
        .collect();
    let of = |k: usize| {
        let [low, high] = places
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| {
                [p[k].min(low), p[k].max(high)]
            });
        let near = AT_AN_END * (high - low);
        let at = |end: f64| -> Vec<usize> {
            let nodes = places.iter().enumerate();
            nodes
                .filter(|(_, p)| (p[k] - end).abs() <= near)
                .map(|(n, _)| n)
                .collect()
        };
        ([at(low), at(high)], high - low)
    };
    let ((straight, _), (radial, angle)) = (of(0), of(1));
    let count = |sides: &[Vec<usize>; 2]| sides.iter().map(Vec::len).min();
    (angle < PI).then(|| {
        if count(&straight) >= count(&radial) {
            straight
        } else {
            radial
        }
    })
}

/// Returns `true` if a node is held along a direction, at least by half.
fn is_held(body: &Body, node: usize, direction: Vector) -> bool {
    if body.dofs.nodes.get(node) == Some(&NodeMotion::Fixed) {
        return true;
    }
    let supports = body.supports.iter().flat_map(|support| &support.nodes);
    let mut node_supports = supports.filter(|(held, _)| *held as usize == node);
    node_supports.any(|(_, axes)| (0..3).any(|k| axes[k] && direction[k].abs() > 0.5))
}
