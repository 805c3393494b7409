//! Texts of the motions of bodies.

use std::collections::BTreeMap;

use dovetail_export::words::{quantity, vector};
use dovetail_solver::results::rigid_motion::BodyMotion;
use dovetail_solver::results::rigid_motion::RigidMotionKind;

/// Text if there is no mesh, or if the motion of the bodies was not recovered.
const UNKNOWN: &str = "the bodies";

/// Text of the motions that friction does not hold: ``body `wedge` along x``.
pub fn retained_words(motions: &[BodyMotion]) -> String {
    let words = motions.iter();
    listed(words.map(|m| format!("body `{}` {}", m.name, kind_words(m.kind))))
}

/// Text of the bodies that nothing holds, with the motion of a body that is free in a single
/// motion.
pub fn free_words(motions: &[BodyMotion]) -> String {
    let mut bodies: BTreeMap<usize, Vec<&BodyMotion>> = BTreeMap::new();
    for motion in motions {
        bodies.entry(motion.body).or_default().push(motion);
    }
    listed(bodies.values().map(|own| match own[..] {
        [one] => format!("body `{}` {}", one.name, kind_words(one.kind)),
        _ => format!("body `{}`", own[0].name),
    }))
}

fn listed(words: impl Iterator<Item = String>) -> String {
    let words: Vec<String> = words.collect();
    if words.is_empty() {
        return UNKNOWN.to_owned();
    }
    words.join(" and ")
}

fn kind_words(kind: RigidMotionKind) -> String {
    match kind {
        RigidMotionKind::Along(direction) => format!("along {}", direction_words(direction)),
        RigidMotionKind::About { axis, through_m } => format!(
            "about {} through ({})",
            direction_words(axis),
            through_m.map(|c| quantity(c, "m", 3)).join(", ")
        ),
    }
}

/// Component below which a direction is shown as 0, given the written digits.
const NEXT_TO_NOTHING: f64 = 5e-4;

/// Text of a direction: `x`, or `(0.906, 0.423, 0)`.
fn direction_words(direction: [f64; 3]) -> String {
    let rounded = direction.map(|c| if c.abs() < NEXT_TO_NOTHING { 0.0 } else { c });
    let axes = ["x", "y", "z"].into_iter().zip(rounded);
    let along: Vec<&str> = axes
        .filter(|(_, c)| *c != 0.0)
        .map(|(name, _)| name)
        .collect();
    match along[..] {
        [axis] => axis.to_owned(),
        _ => vector(rounded, 3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_along_an_axis_is_called_by_it() {
        assert_eq!(direction_words([1.0, 1e-5, 0.0]), "x");
        assert_eq!(
            direction_words([0.9063, 0.42262, 1e-9]),
            "(0.906, 0.423, 0)"
        );
        let about = RigidMotionKind::About {
            axis: [0.0, 0.0, 1.0],
            through_m: [0.0, 12.5e-3, 0.45],
        };
        assert_eq!(kind_words(about), "about z through (0 m, 12.5 mm, 450 mm)");
    }
}
