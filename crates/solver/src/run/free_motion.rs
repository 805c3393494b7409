//! Bodies that move, and how, in a motion that only friction holds, or nothing at all.

use faer::{Mat, MatRef};

use super::bodies::Bodies;
use super::error::Error;
use super::reduced::ReducedScene;
use super::session::Session;
use crate::dlft::retention::Holding;
use crate::dlft::{Orbit, Outcome, StaticState};
use crate::fem::expand_to_nodes;
use crate::results::recovery::NodalField;
use crate::results::rigid_motion::{BodyMotion, RigidMotion, rigid_motions};

/// Motions retained in the static state, of those that only friction holds. Empty where nothing is
/// retained, or the bodies are not known.
///
/// # Errors
/// The errors of the recovery.
pub(super) fn retained_at_rest(
    reduced: &ReducedScene,
    state: &StaticState,
    session: &Session<'_>,
) -> Result<Vec<BodyMotion>, Error> {
    if state.retention_n.is_none() || !state.outcome.is_converged() {
        return Ok(Vec::new());
    }
    let at_rest = vec![0.0; state.x.len()];
    retained(reduced, &state.x, &at_rest, session)
}

/// Motions retained in a motion about the static state.
///
/// # Errors
/// The errors of the recovery.
pub(super) fn retained_in_motion(
    reduced: &ReducedScene,
    state: &StaticState,
    orbit: &Orbit,
    session: &Session<'_>,
) -> Result<Vec<BodyMotion>, Error> {
    let n = state.x.len();
    let at_rest = vec![0.0; n];
    let anchor = match state.retention_n {
        Some(_) => &at_rest,
        None => &state.x,
    };
    retained(reduced, &orbit.x[..n], anchor, session)
}

fn retained(
    reduced: &ReducedScene,
    x: &[f64],
    anchor: &[f64],
    session: &Session<'_>,
) -> Result<Vec<BodyMotion>, Error> {
    let holding = Holding::new(&reduced.problem);
    let (Some(bodies), Some(retention)) = (&reduced.bodies, holding.retention()) else {
        return Ok(Vec::new());
    };
    bodies.recover(session)?;
    let along = retention.projected_drift(x, anchor);
    Ok(motions(reduced, bodies, &along))
}

/// Motions in which bodies are free where all pairs are open. Empty where something holds them, or
/// the bodies are not known.
///
/// # Errors
/// The errors of the recovery.
pub(super) fn held_by_nothing(
    reduced: &ReducedScene,
    state: &StaticState,
    session: &Session<'_>,
) -> Result<Vec<BodyMotion>, Error> {
    let Some(bodies) = &reduced.bodies else {
        return Ok(Vec::new());
    };
    if state.outcome != Outcome::NothingHolds {
        return Ok(Vec::new());
    }
    bodies.recover(session)?;
    let free = Holding::new(&reduced.problem).free_motions();
    let candidates = free.iter().flat_map(|x| motions(reduced, bodies, x));
    Ok(candidates.collect())
}

/// Rigid motions of the bodies that belong to relative displacements `x` without forces.
fn motions(reduced: &ReducedScene, bodies: &Bodies, x: &[f64]) -> Vec<BodyMotion> {
    let Some(moved) = displacements_m(reduced, bodies, x) else {
        return Vec::new();
    };
    let motions = rigid_motions(bodies.model(), &moved).into_iter();
    let named = |motion: RigidMotion| {
        Some(BodyMotion {
            body: motion.body,
            name: bodies.model().bodies[motion.body].name.clone(),
            kind: motion.kind()?,
        })
    };
    motions.filter_map(named).collect()
}

/// Displacements of all nodes of each body for relative displacements `x`.
fn displacements_m(reduced: &ReducedScene, bodies: &Bodies, x: &[f64]) -> Option<Vec<NodalField>> {
    let x = MatRef::from_column_major_slice(x, x.len(), 1);
    let still = Mat::zeros(reduced.model().omega2.len(), 1);
    let moved = bodies.recovery()?.full_motion(x, still.as_ref());
    let of_bodies = bodies.model().bodies.iter().zip(&moved);
    let on_nodes = of_bodies.map(|(body, u)| expand_to_nodes(&body.dofs, u.col_as_slice(0)));
    Some(on_nodes.collect())
}
