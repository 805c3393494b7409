//! Displacements of bodies as translations and rotations, to describe how unrestrained bodies move.

use super::recovery::NodalField;
use crate::model::Model;
use dovetail_numerics::dense::Lu;
use dovetail_numerics::space::{Vector, add_scaled, cross, dot, norm, scaled, sub, unit};
use faer::Mat;

/// A body counts as moving from this fraction of the largest motion of a body on.
const MOVES: f64 = 0.05;
/// A body counts as turning if its rotation moves the nodes by more than this fraction of its
/// translation.
const TURNS: f64 = 0.1;

/// Rigid part of the motion of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub(crate) struct RigidMotion {
    /// Number of the body.
    pub body: usize,
    /// Translation of its centre, m.
    pub translation_m: Vector,
    /// Rotation about its centre, as a vector along the axis, rad.
    pub rotation_rad: Vector,
    /// Mean of the positions of its nodes, m.
    pub centre_m: Vector,
    /// Root mean square of the distances of its nodes from the centre, m.
    pub radius_m: f64,
}

/// Kind of a rigid motion. Directions have length 1, and their largest component is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RigidMotionKind {
    /// Translation along a direction.
    Along(Vector),
    /// Rotation about an axis.
    About {
        /// Direction of the axis.
        axis: Vector,
        /// Point of the axis nearest to the centre, m.
        through_m: Vector,
    },
}

/// Rigid motion of a body.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct BodyMotion {
    /// Number of the body.
    pub body: usize,
    /// Name of the body.
    pub name: String,
    /// Kind of the motion.
    pub kind: RigidMotionKind,
}

impl RigidMotion {
    /// Rigid motion of nodes that is nearest to their displacements, in the sum of squares.
    fn nearest(body: usize, nodes_m: &[Vector], field: &[Vector]) -> Self {
        let mean = |values: &[Vector]| {
            let sum = |axis: usize| values.iter().map(|v| v[axis]).sum::<f64>();
            [0, 1, 2].map(|axis| sum(axis) / values.len().max(1) as f64)
        };
        let (centre_m, translation_m) = (mean(nodes_m), mean(field));
        let arms: Vec<Vector> = nodes_m.iter().map(|p| sub(*p, centre_m)).collect();
        // sum (|r|^2 I - r r^T) w = sum r x u.
        let squares: f64 = arms.iter().map(|r| dot(*r, *r)).sum();
        let inertia = Mat::from_fn(3, 3, |i, j| {
            let products: f64 = arms.iter().map(|r| r[i] * r[j]).sum();
            f64::from(u8::from(i == j)) * squares - products
        });
        let mut moment = [0.0; 3];
        for (r, u) in arms.iter().zip(field) {
            add_scaled(&mut moment, 1.0, cross(*r, *u));
        }
        Lu::new(inertia).solve_column_in_place(&mut moment);
        let is_known = moment.iter().all(|w| w.is_finite());
        Self {
            body,
            translation_m,
            rotation_rad: if is_known { moment } else { [0.0; 3] },
            centre_m,
            radius_m: (squares / nodes_m.len().max(1) as f64).sqrt(),
        }
    }

    /// Size of the motion of the nodes, m.
    fn size_m(&self) -> f64 {
        norm(self.translation_m).hypot(self.turned_m())
    }

    fn turned_m(&self) -> f64 {
        norm(self.rotation_rad) * self.radius_m
    }

    /// Kind of the motion; `None` where nothing moves.
    pub(crate) fn kind(&self) -> Option<RigidMotionKind> {
        let turns = self.turned_m() > TURNS * norm(self.translation_m);
        match unit(self.rotation_rad).filter(|_| turns) {
            None => unit(self.translation_m).map(|along| RigidMotionKind::Along(forwards(along))),
            Some(axis) => {
                // t + w x (p - c) is along the axis at p = c + w x t / |w|^2.
                let square = dot(self.rotation_rad, self.rotation_rad);
                let arm = scaled(cross(self.rotation_rad, self.translation_m), square.recip());
                Some(RigidMotionKind::About {
                    axis: forwards(axis),
                    through_m: [0, 1, 2].map(|a| self.centre_m[a] + arm[a]),
                })
            }
        }
    }
}

fn forwards(direction: Vector) -> Vector {
    let largest = direction
        .into_iter()
        .reduce(|a, b| if b.abs() > a.abs() { b } else { a });
    match largest {
        Some(largest) if largest < 0.0 => scaled(direction, -1.0),
        _ => direction,
    }
}

/// Rigid motions of the bodies that move, from the displacements of all nodes of each body.
pub(crate) fn rigid_motions(model: &Model, displacements_m: &[NodalField]) -> Vec<RigidMotion> {
    let bodies = model.bodies.iter().zip(displacements_m).enumerate();
    let motions: Vec<RigidMotion> = bodies
        .map(|(b, (body, field))| RigidMotion::nearest(b, &body.nodes_m, field))
        .collect();
    let most = motions.iter().map(RigidMotion::size_m).fold(0.0, f64::max);
    let moves = |motion: &RigidMotion| most > 0.0 && motion.size_m() > MOVES * most;
    motions.into_iter().filter(moves).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_numerics::space::distance;

    /// Corners of a box away from the origin.
    fn corners() -> Vec<Vector> {
        let corner = |i: usize| {
            [
                1.0 + (i & 1) as f64,
                (i >> 1 & 1) as f64,
                3.0 * (i >> 2) as f64,
            ]
        };
        (0..8).map(corner).collect()
    }

    #[test]
    fn a_translation_has_its_direction_however_it_is_signed() {
        let nodes = corners();
        let field = vec![[0.0, -0.6e-6, 0.3e-6]; nodes.len()];
        let motion = RigidMotion::nearest(0, &nodes, &field);
        let Some(RigidMotionKind::Along(direction)) = motion.kind() else {
            panic!("{motion:?}");
        };
        let expected = unit([0.0, 2.0, -1.0]).unwrap();
        assert!(distance(direction, expected) < 1e-12, "{direction:?}");
    }

    #[test]
    fn a_rotation_has_its_axis_and_a_point_of_it() {
        let nodes = corners();
        let (axis, through) = ([0.0, 0.0, 1.0], [1.25, -0.5, 0.0]);
        let turned = |p: &Vector| scaled(cross(axis, sub(*p, through)), -1e-3);
        let field: Vec<Vector> = nodes.iter().map(turned).collect();
        let motion = RigidMotion::nearest(0, &nodes, &field);
        let Some(RigidMotionKind::About {
            axis: found,
            through_m,
        }) = motion.kind()
        else {
            panic!("{motion:?}");
        };
        assert!(distance(found, axis) < 1e-12);
        // In the plane of the centre.
        assert!(
            distance(through_m, [1.25, -0.5, 1.5]) < 1e-12,
            "{through_m:?}"
        );
    }

    #[test]
    fn nodes_that_rest_have_no_motion() {
        let nodes = corners();
        let motion = RigidMotion::nearest(0, &nodes, &vec![[0.0; 3]; nodes.len()]);
        assert_eq!(motion.kind(), None);
    }
}
