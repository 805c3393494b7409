//! Backbone of a mode of a scene: its frequency and damping over its amplitude
//! ([`crate::dlft::backbone`]).

use super::bodies::Source;
use super::error::Error;
use super::reduced::ReducedScene;
use super::response::{frequencies_hz, settings};
use super::session::{Session, Stage};
use crate::description::Scene;
use crate::dlft::backbone::{Backbone, BackboneRange, backbone as follow};
use crate::dlft::{StaticState, demand};
use crate::results::far_slip::ShorterSides;
use crate::results::modes::hertz;
use dovetail_numerics::memory;
use dovetail_numerics::spectrum::blocks;

/// The frequency of another linear mode is close to a backbone within this fraction: the motions of
/// both may mix.
const CLOSE: f64 = 0.03;

/// Linear mode that a backbone begins at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModeChoice {
    /// Number of the mode, counted from 1.
    Number(usize),
    /// Of the modes in the range of frequencies of the scene, the one that moves the observed
    /// displacement most for its modal mass.
    LargestShape,
}

/// Backbone that is asked for.
#[derive(Debug, Clone, Copy)]
pub struct BackboneQuestion<'a> {
    /// Linear mode.
    pub mode: ModeChoice,
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
    pub reduced: ReducedScene,
    /// Number of the linear mode, counted from 1.
    pub mode: usize,
    /// Number of the observed displacement whose amplitudes were asked for.
    pub observation: usize,
    /// Frequency and damping over the amplitude.
    pub backbone: Backbone,
    /// Numbers of the other linear modes whose frequencies the backbone comes within 3 % of, counted
    /// from 1.
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
    source: Source,
    question: &BackboneQuestion<'_>,
    session: &Session<'_>,
) -> Result<ModeBackbone, Error> {
    let reduced = ReducedScene::new(scene, source, session)?;
    if reduced.problem.laws.is_empty() {
        let why = "the frequency and the damping of a mode then do not depend on its amplitude";
        return Err(Error::AllBonded { why });
    }
    let observation = reduced.observed(question.observation)?;
    let statics = super::statics(scene, &reduced, false, session)?;
    statics.usable()?;
    let state = statics.state;
    let omega2 = reduced.linear_omega2(&state);
    let linear_hz: Vec<f64> = omega2.iter().map(|w2| hertz(*w2)).collect();
    let mode = match question.mode {
        ModeChoice::Number(number) => number.wrapping_sub(1),
        ModeChoice::LargestShape => {
            let range_hz = frequencies_hz(&scene.response, &omega2)?;
            largest_shape(&reduced, &state, &linear_hz, &range_hz, observation)?
        }
    };
    let own_hz = *linear_hz.get(mode).ok_or(Error::NoSuchMode {
        asked: mode.wrapping_add(1),
        available: linear_hz.len(),
    })?;
    let damping = reduced.rayleigh(&scene.damping, &state)?;
    let resolution = scene.response.resolution;
    let settings = settings(&scene.response, vec![own_hz], resolution);
    let blocks = blocks(resolution.most_harmonics());
    let bytes = demand::bytes(&reduced.problem, &settings);
    memory::check_available(bytes).map_err(|source| Error::TooLittleMemory { blocks, source })?;
    let range = BackboneRange {
        mode,
        observation,
        amplitudes_m: question.amplitudes_m.to_vec(),
    };
    let stage = session.stage(Stage::Backbone);
    let steps = session.steps(range.amplitudes_m.len(), "amplitudes");
    let mut tell = |_: &_| {
        steps.step();
        session.check_running().is_ok()
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
    session.check_running()?;
    let mut backbone = followed.ok_or_else(|| Error::NotInMode {
        mode: mode + 1,
        name: reduced.observations()[observation].name.clone(),
    })?;
    let sides = ShorterSides::new(&reduced.pairs);
    let orbits = backbone.points.iter_mut().map(|point| &mut point.orbit);
    orbits.for_each(|orbit| {
        sides.judge_orbit(orbit);
    });
    let passed_hz = backbone.points.iter().map(|point| point.orbit.frequency_hz);
    let passed_hz: Vec<f64> = passed_hz.chain([own_hz]).collect();
    Ok(ModeBackbone {
        close_modes: close_modes(&linear_hz, mode, &passed_hz),
        reduced,
        mode: mode + 1,
        observation,
        backbone,
        linear_hz,
    })
}

/// Number from 0 of the linear mode in a range of frequencies that moves an observed displacement
/// most.
fn largest_shape(
    reduced: &ReducedScene,
    state: &StaticState,
    linear_hz: &[f64],
    range_hz: &[f64],
    observation: usize,
) -> Result<usize, Error> {
    let ends = range_hz.iter();
    let [from_hz, to_hz] = ends.fold([f64::INFINITY, 0.0], |[from, to], hz| {
        [hz.min(from), hz.max(to)]
    });
    let problem = &reduced.problem;
    let of = problem.reduced.harmonic_model(1);
    let point = &of.observations()[observation];
    let moved = |mode: usize| {
        let (x, q) = state.linear.first_harmonic_motion(problem, mode);
        point.amplitude(&of.widened(&x), &q).norm()
    };
    let inside = (0..linear_hz.len()).filter(|m| (from_hz..=to_hz).contains(&linear_hz[*m]));
    let moved = inside.map(|mode| (mode, moved(mode)));
    let largest = moved.max_by(|(_, a), (_, b)| a.total_cmp(b));
    largest
        .map(|(mode, _)| mode)
        .ok_or(Error::NoModeInRange { from_hz, to_hz })
}

/// Numbers of the linear modes but `own`, from 0, of which some of the frequencies `passed_hz` comes
/// close, counted from 1.
fn close_modes(linear_hz: &[f64], own: usize, passed_hz: &[f64]) -> Vec<usize> {
    let is_close = |other: &usize| {
        let near = |hz: &f64| (linear_hz[*other] / hz - 1.0).abs() < CLOSE;
        *other != own && passed_hz.iter().any(near)
    };
    let others = (0..linear_hz.len()).filter(is_close);
    others.map(|other| other + 1).collect()
}

#[cfg(test)]
mod tests {
    use super::close_modes;

    #[test]
    fn modes_are_close_where_the_backbone_comes_within_three_per_cent_of_them() {
        let linear_hz = [96.0, 100.0, 102.0, 104.0, 200.0];
        assert_eq!(close_modes(&linear_hz, 1, &[100.0]), [3]);
        assert_eq!(close_modes(&linear_hz, 1, &[100.0, 98.0]), [1, 3]);
        assert_eq!(close_modes(&linear_hz, 4, &[200.0, 190.0]), [0; 0]);
    }
}
