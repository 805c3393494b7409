//! Model at one value of the scene about its static state, with the settings of its motions: what
//! searches over a value of the scene, such as [`peaks()`](super::peaks()) and a run-up
//! (`run_up.rs`), make at each of their values.

use super::bodies::Source;
use super::error::Error;
use super::reduced::ReducedScene;
use super::response::{check_one_speed, check_undamped_modes, frequencies_hz, settings};
use super::session::Session;
use super::stability::Judged;
use super::statics;
use crate::damping::Rayleigh;
use crate::description::{FrequencyRange, Scene, Subject};
use crate::dlft::sweep::SweepSettings;
use crate::dlft::{Orbit, StaticState, demand};
use crate::problem::Problem;
use dovetail_numerics::memory;
use dovetail_numerics::spectrum::blocks;

/// Angular speed, as a scene has it.
pub(super) fn rad_s(speed_rpm: f64) -> f64 {
    speed_rpm * 2.0 * std::f64::consts::PI / 60.0
}

/// A scene at a speed of rotation, whose response is along the frequency from one to another, Hz.
pub(super) fn scene_at(scene: &Scene, speed_rpm: f64, [from_hz, to_hz]: [f64; 2]) -> Scene {
    let mut scene = scene.clone();
    if let Subject::Assembly(assembly) = &mut scene.subject
        && let Some(rotation) = &mut assembly.rotation
    {
        rotation.speed_rad_s = rad_s(speed_rpm);
    }
    scene.response.range = FrequencyRange::Hz { from_hz, to_hz };
    scene.response.points = None;
    scene.response.along_engine_order = None;
    scene
}

/// Damping and settings of the motions about a static state, with the memory that a solution takes.
fn means(
    scene: &Scene,
    reduced: &ReducedScene,
    state: &StaticState,
) -> Result<(Rayleigh, SweepSettings, u64), Error> {
    let omega2 = reduced.linear_omega2(state);
    let damping = reduced.rayleigh(&scene.damping, state)?;
    let frequencies_hz = frequencies_hz(&scene.response, &omega2)?;
    let resolution = scene.response.resolution;
    let harmonics = resolution.most_harmonics();
    check_undamped_modes(&reduced.problem, state, damping, &frequencies_hz, harmonics)?;
    let ends = [frequencies_hz.first(), frequencies_hz.last()];
    let ends = ends.into_iter().flatten().copied().collect();
    let settings = settings(&scene.response, ends, resolution);
    let (problem, blocks) = (&reduced.problem, blocks(harmonics));
    let bytes = match problem.laws.is_empty() {
        true => 0,
        false => demand::bytes(problem, &settings),
    };
    memory::check_available(bytes).map_err(|source| Error::TooLittleMemory { blocks, source })?;
    Ok((damping, settings, bytes))
}

/// Model at one value, about its static state.
pub(super) struct ModelAtValue {
    pub value: f64,
    pub scene: Scene,
    pub reduced: ReducedScene,
    pub state: StaticState,
    pub damping: Rayleigh,
    /// Settings with the first and the last frequency of the scene.
    pub settings: SweepSettings,
    /// Memory that its solution takes.
    pub bytes: u64,
}

impl ModelAtValue {
    /// Model of a scene. What is the same as at the value before is taken from there.
    ///
    /// # Errors
    /// [`Error::AllBonded`], [`Error::AlongEngineOrder`]; those of [`ReducedScene::new`] and of
    /// [`ModelAtValue::from_reduced`].
    pub(crate) fn new(
        (value, scene): (f64, Scene),
        source: &Source,
        before: Option<&ModelAtValue>,
        session: &Session<'_>,
    ) -> Result<Self, Error> {
        check_one_speed(&scene, "peaks are those over the frequency at one speed")?;
        let reduced = match before.and_then(|before| before.reduced_for(&scene)) {
            Some(reduced) => reduced,
            None => ReducedScene::new(&scene, source.clone(), session)?,
        };
        if reduced.problem.laws.is_empty() {
            let why = "peaks without friction are those of the linear response, which `run` has";
            return Err(Error::AllBonded { why });
        }
        Self::from_reduced((value, scene), reduced, before, session)
    }

    /// A reduced model of a scene about its static state, which is that of the value before where
    /// both are at rest alike.
    ///
    /// # Errors
    /// A static state that nothing can vibrate about; the errors of damping and frequencies;
    /// [`Error::TooLittleMemory`].
    pub(crate) fn from_reduced(
        (value, scene): (f64, Scene),
        reduced: ReducedScene,
        before: Option<&ModelAtValue>,
        session: &Session<'_>,
    ) -> Result<Self, Error> {
        let statics = statics::static_options(&scene);
        let before = before.filter(|before| {
            before.reduced.problem.is_at_rest_like(&reduced.problem)
                && statics::static_options(&before.scene) == statics
        });
        let state = match before {
            Some(before) => before.state.clone(),
            None => {
                let statics = super::statics(&scene, &reduced, false, session)?;
                statics.usable()?;
                statics.state
            }
        };
        let (damping, settings, bytes) = means(&scene, &reduced, &state)?;
        Ok(Self {
            value,
            scene,
            reduced,
            state,
            damping,
            settings,
            bytes,
        })
    }

    /// Judges the stability of a motion of the model.
    pub(super) fn judge(&self, orbit: &mut Orbit) {
        let judged = Judged {
            problem: &self.reduced.problem,
            damping: self.damping,
            state: &self.state,
            scope: self.scene.response.stability,
        };
        judged.judge(orbit);
    }

    /// Takes the model to another static state, that of laws that have changed.
    ///
    /// # Errors
    /// The errors of damping and frequencies about the state; [`Error::TooLittleMemory`].
    pub(crate) fn set_static_state(&mut self, state: StaticState) -> Result<(), Error> {
        (self.damping, self.settings, self.bytes) = means(&self.scene, &self.reduced, &state)?;
        self.state = state;
        Ok(())
    }

    /// Reduced model of another scene that differs in nothing but the law and the force of a reduced
    /// model that is read; `None` for others.
    pub(super) fn reduced_for(&self, scene: &Scene) -> Option<ReducedScene> {
        let (Subject::ReducedModel(own), Subject::ReducedModel(other)) =
            (&self.scene.subject, &scene.subject)
        else {
            return None;
        };
        let same = own.folder == other.folder
            && self.scene.response.stuck_modes == scene.response.stuck_modes;
        if !same {
            return None;
        }
        let model = self.reduced.model().clone();
        let excitations = &self.reduced.of_folder;
        let problem = Problem::excited(model, other.law, excitations, other.force_n);
        let mut pairs = self.reduced.pairs.clone();
        for row in &mut pairs.rows {
            (row.friction, row.gap_m) = (other.law.friction, other.law.gap_m);
        }
        Some(ReducedScene {
            pairs,
            problem: problem.with_modal_ratios(&scene.modal_ratios).ok()?,
            bodies: None,
            of_folder: excitations.clone(),
        })
    }
}
