//! Range of the response over the tractions from which the vibration may start.

use super::error::Error;
use super::outcome::{TractionPeak, TractionRange, TractionResponse};
use super::reduced::ReducedScene;
use super::response::{follows, settings};
use super::session::{Session, Stage};
use super::statics::newton;
use crate::damping::Rayleigh;
use crate::description::Scene;
use crate::dlft::branch::follow;
use crate::dlft::starting_traction::starting_tractions;
use crate::dlft::sweep::sweep;
use crate::dlft::{Response, SweepProgress};
use crate::results::far_slip::ShorterSides;
use crate::results::peak::{local_peaks, peak};

/// Responses from `scene.static_state.starting_tractions` tractions other than that of the load path,
/// whose response is `response`; `None` where the scene asks for none, or has no pairs.
///
/// # Errors
/// [`Error::Stopped`] by the observer.
pub(super) fn solve_tractions(
    scene: &Scene,
    reduced: &ReducedScene,
    damping: Rayleigh,
    frequencies_hz: &[f64],
    response: &Response,
    session: &Session<'_>,
) -> Result<Option<TractionRange>, Error> {
    let count = scene.static_state.starting_tractions;
    let problem = &reduced.problem;
    if count == 0 || problem.laws.is_empty() {
        return Ok(None);
    }
    let stage = session.stage(Stage::StartingTractions);
    let steps = session.steps(count, "tractions");
    let sides = ShorterSides::new(&reduced.pairs);
    let spec = &scene.response;
    let settings = settings(spec, frequencies_hz.to_vec(), spec.resolution);
    let is_followed = follows(spec, frequencies_hz);
    let solve = if is_followed { follow } else { sweep };
    let tell = |told: SweepProgress<'_>| {
        if let SweepProgress::Next(stop) = told {
            session.stop_if_ended(stop);
        }
    };
    let mut others = Vec::new();
    let load_steps = scene.static_state.load_steps;
    let states = starting_tractions(problem, load_steps, count, newton(scene));
    for (start, mut state) in states {
        sides.judge_static(&mut state);
        let mut other = TractionResponse {
            start,
            outcome: state.outcome,
            peak: None,
            response: None,
        };
        if state.outcome.is_converged() {
            let mut response = solve(problem, damping, &state, &settings, &[], &tell);
            session.check_running()?;
            sides.judge_response(&mut response);
            other.peak = peak_of(&response);
            for orbit in &mut response.orbits {
                orbit.lambda = Vec::new();
                orbit.cycles = Vec::new();
                orbit.modal = Vec::new();
            }
            other.response = Some(response);
        }
        others.push(other);
        steps.step();
    }
    drop(steps);
    drop(stage);
    Ok(Some(TractionRange {
        others,
        own: peak_of(response),
    }))
}

/// Peak of the first observed displacement.
fn peak_of(response: &Response) -> Option<TractionPeak> {
    let top = peak(response, 0)?;
    let local = local_peaks(response, 0).into_iter();
    let local = local.into_iter().find(|local| local.at.index == top.index);
    Some(TractionPeak {
        frequency_hz: top.frequency_hz,
        amplitude_m: top.amplitude_m,
        loss_factor: local.and_then(|local| local.loss_factor),
        pairs: response.orbits[top.index].counts(),
    })
}
