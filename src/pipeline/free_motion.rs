//! Says which bodies move, and how, in a motion that friction or nothing at all holds.

use super::error::RunError;
use super::meshed::Meshed;
use super::progress::Progress;
use super::reduced::Reduced;
use crate::words::{figure, quantity};
use dovetail_numerics::space::Vector;
use dovetail_solver::dlft::retention::Holding;
use dovetail_solver::dlft::{Orbit, Outcome, StaticState};
use dovetail_solver::fem::expand_to_nodes;
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::results::rigid_motion::{Kind, RigidMotion, rigid_motions};
use faer::{Mat, MatRef};

/// Where there is no mesh, or the way back to the bodies was not made.
const UNKNOWN: &str = "the bodies";

/// What of the motions that only friction holds is retained in the static state: `body `wedge` along x`.
///
/// # Errors
/// Those of the way back to the bodies.
pub(super) fn retained_at_rest(
    reduced: &Reduced,
    state: &StaticState,
    progress: &Progress,
) -> Result<String, RunError> {
    let at_rest = vec![0.0; state.x.len()];
    retained(reduced, &state.x, &at_rest, progress)
}

/// The same of a motion about the static state.
///
/// # Errors
/// As [`retained_at_rest`].
pub(super) fn retained_in_motion(
    reduced: &Reduced,
    state: &StaticState,
    orbit: &Orbit,
    progress: &Progress,
) -> Result<String, RunError> {
    let n = state.x.len();
    let at_rest = vec![0.0; n];
    let anchor = match state.retention_n {
        Some(_) => &at_rest,
        None => &state.x,
    };
    retained(reduced, &orbit.x[..n], anchor, progress)
}

fn retained(
    reduced: &Reduced,
    x: &[f64],
    anchor: &[f64],
    progress: &Progress,
) -> Result<String, RunError> {
    let holding = Holding::of(reduced.problem());
    let (Some(meshed), Some(retention)) = (reduced.meshed(), holding.retention()) else {
        return Ok(UNKNOWN.to_owned());
    };
    meshed.recover(progress)?;
    let along = retention.along(x, anchor);
    let Some(moved) = displacements_m(meshed, &along) else {
        return Ok(UNKNOWN.to_owned());
    };
    let motions = rigid_motions(&meshed.model, &moved);
    let words = motions.iter().filter_map(|motion| {
        let kind = kind_words(motion.kind()?);
        Some(format!("{} {kind}", body(meshed, motion.body)))
    });
    Ok(listed(words.collect()))
}

/// The bodies that nothing holds where all pairs are open, and the motions that they are free in. Where nothing is
/// known of the bodies, `the bodies`.
pub(super) fn held_by_nothing(reduced: &Reduced) -> String {
    let Some(meshed) = reduced.meshed() else {
        return UNKNOWN.to_owned();
    };
    let free = Holding::of(reduced.problem()).free_motions();
    let moved: Vec<Vec<RigidMotion>> = free
        .iter()
        .filter_map(|motion| displacements_m(meshed, motion))
        .map(|moved| rigid_motions(&meshed.model, &moved))
        .collect();
    let bodies = 0..meshed.model.bodies.len();
    let words = bodies.filter_map(|b| {
        let own = moved.iter().flatten().filter(|motion| motion.body == b);
        let own: Vec<Kind> = own.filter_map(RigidMotion::kind).collect();
        let name = body(meshed, b);
        match own[..] {
            [] => None,
            [kind] => Some(format!("{name} {}", kind_words(kind))),
            [..] => Some(name),
        }
    });
    listed(words.collect())
}

/// That the way back to the bodies is there for [`held_by_nothing`] where it will be asked.
///
/// # Errors
/// As [`retained_at_rest`].
pub(super) fn prepare(
    reduced: &Reduced,
    state: &StaticState,
    progress: &Progress,
) -> Result<(), RunError> {
    match reduced.meshed() {
        Some(meshed) if state.outcome == Outcome::NothingHolds => meshed.recover(progress),
        _ => Ok(()),
    }
}

/// Of all nodes of each body, by relative displacements that no force goes with.
fn displacements_m(meshed: &Meshed, x: &[f64]) -> Option<Vec<NodalField>> {
    let x = MatRef::from_column_major_slice(x, x.len(), 1);
    let still = Mat::zeros(meshed.problem.reduced.omega2.len(), 1);
    let moved = meshed.recovery()?.full_motion(x, still.as_ref());
    let bodies = meshed.model.bodies.iter().zip(&moved);
    let on_nodes = bodies.map(|(body, u)| expand_to_nodes(&body.dofs, u.col_as_slice(0)));
    Some(on_nodes.collect())
}

fn body(meshed: &Meshed, number: usize) -> String {
    format!("body `{}`", meshed.model.bodies[number].name)
}

fn listed(words: Vec<String>) -> String {
    match words.is_empty() {
        true => UNKNOWN.to_owned(),
        false => words.join(" and "),
    }
}

fn kind_words(kind: Kind) -> String {
    match kind {
        Kind::Along(direction) => format!("along {}", direction_words(direction)),
        Kind::About { axis, through_m } => format!(
            "about {} through ({})",
            direction_words(axis),
            through_m.map(|c| quantity(c, "m", 3)).join(", ")
        ),
    }
}

/// Components smaller than this are 0 to the digits that are written.
const NEXT_TO_NOTHING: f64 = 5e-4;

/// `x`, or `(0.906, 0.423, 0)`.
fn direction_words(direction: Vector) -> String {
    let rounded = direction.map(|c| if c.abs() < NEXT_TO_NOTHING { 0.0 } else { c });
    let axes = ["x", "y", "z"].into_iter().zip(rounded);
    let along: Vec<&str> = axes
        .filter(|(_, c)| *c != 0.0)
        .map(|(name, _)| name)
        .collect();
    match along[..] {
        [axis] => axis.to_owned(),
        _ => format!("({})", rounded.map(|c| figure(c, 3)).join(", ")),
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
        let about = Kind::About {
            axis: [0.0, 0.0, 1.0],
            through_m: [0.0, 12.5e-3, 0.45],
        };
        assert_eq!(kind_words(about), "about z through (0 m, 12.5 mm, 450 mm)");
    }
}
