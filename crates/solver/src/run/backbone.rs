//! Backbone of a mode of a scene: its frequency and damping over its amplitude
//! ([`crate::dlft::backbone`]).

use super::bodies::Meshes;
use super::error::Error;
use super::reduced::Reduced;
use super::response::settings;
use super::session::{Session, Stage};
use crate::description::Scene;
use crate::dlft::backbone::{Backbone, BackboneRange, backbone as follow};
use crate::dlft::demand;
use crate::reduction::damping::rayleigh;
use crate::results::far_slip::ShorterSides;
use crate::results::modes::hertz;
use dovetail_numerics::memory;
use dovetail_numerics::spectrum::blocks;

/// Frequencies of two linear modes are close to each other within this fraction: their backbones
/// may interact.
const CLOSE: f64 = 0.03;

/// Backbone that is asked for.
#[derive(Debug, Clone, Copy)]
pub struct BackboneQuestion<'a> {
    /// Number of the linear mode, counted from 1.
    pub mode: usize,
    /// Name of the observed displacement; `None`: the first one.
    pub observation: Option<&'a str>,
    /// Amplitudes of the observed displacement, m, ascending.
    pub amplitudes_m: &'a [f64],
}

/// Backbone of a scene.
#[derive(Debug)]
#[non_exhaustive]
pub struct ModeBackbone {
    /// Reduced model.
    pub reduced: Reduced,
    /// Number of the observed displacement whose amplitudes were asked for.
    pub observation: usize,
    /// Frequency and damping over the amplitude.
    pub backbone: Backbone,
    /// Numbers of the linear modes whose frequencies lie within 3 % of this one's, counted from 1.
    pub close_modes: Vec<usize>,
    /// Frequencies of the linear modes, Hz.
    pub linear_hz: Vec<f64>,
}

/// Follows the backbone of a mode of a scene.
///
/// # Errors
/// The error of a stage up to the static state; a mode or an observed displacement that there is
/// not; [`Error::NotInMode`] where the mode does not move the displacement; [`Error::AllBonded`]
/// without a contact that can slip or open; [`Error::Stopped`] by the observer.
pub fn backbone(
    scene: &Scene,
    meshes: Option<Meshes>,
    question: &BackboneQuestion<'_>,
    session: &Session<'_>,
) -> Result<ModeBackbone, Error> {
    let reduced = Reduced::of(scene, meshes, session)?;
    if reduced.problem.laws.is_empty() {
        let why = "the frequency and the damping of a mode then do not depend on its amplitude";
        return Err(Error::AllBonded { why });
    }
    let observation = reduced.observed(question.observation)?;
    let found = super::statics(scene, &reduced, false, session)?;
    found.usable()?;
    let state = found.state;
    let omega2 = reduced.linear_omega2(&state);
    let linear_hz: Vec<f64> = omega2.iter().map(|w2| hertz(*w2)).collect();
    let mode = question.mode.wrapping_sub(1);
    let own_hz = *linear_hz.get(mode).ok_or(Error::NoSuchMode {
        asked: question.mode,
        available: linear_hz.len(),
    })?;
    let damping = rayleigh(&scene.damping, omega2)?;
    let resolution = scene.response.resolution;
    let settings = settings(&scene.response, vec![own_hz], resolution);
    let blocks = blocks(resolution.most_harmonics());
    let bytes = demand::bytes(&reduced.problem, &settings);
    memory::ask_for(bytes).map_err(|source| Error::TooLittleMemory { blocks, source })?;
    let range = BackboneRange {
        mode,
        observation,
        amplitudes_m: question.amplitudes_m.to_vec(),
    };
    let stage = session.stage(Stage::Backbone);
    let steps = session.steps(range.amplitudes_m.len(), "amplitudes");
    let mut tell = |_: &_| {
        steps.step();
        session.goes_on().is_ok()
    };
    let followed = follow(
        &reduced.problem,
        damping,
        &state,
        &settings,
        &range,
        &mut tell,
    );
    drop(steps);
    drop(stage);
    session.goes_on()?;
    let mut backbone = followed.ok_or_else(|| Error::NotInMode {
        mode: question.mode,
        name: reduced.observations()[observation].to_owned(),
    })?;
    let sides = ShorterSides::of(&reduced.pairs);
    let orbits = backbone.points.iter_mut().map(|point| &mut point.orbit);
    orbits.for_each(|orbit| {
        sides.judge_orbit(orbit);
    });
    let is_close =
        |other: &usize| *other != mode && (linear_hz[*other] / own_hz - 1.0).abs() < CLOSE;
    let close_modes = (0..linear_hz.len()).filter(is_close);
    Ok(ModeBackbone {
        close_modes: close_modes.map(|other| other + 1).collect(),
        reduced,
        observation,
        backbone,
        linear_hz,
    })
}
