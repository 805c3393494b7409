//! Curve of the motions at one frequency over a value of the scene: a force, a coefficient of
//! friction, a clearance, a speed ([`crate::dlft::branch::follow_over`]).
//!
//! Each value that a step of the curve asks for has a model of its own. Where the bodies are the same
//! as at the first value, its reduction serves, and where they rest alike, its static state.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use super::at::ModelAtValue;
use super::bodies::{Bound, Source, problem};
use super::curve_progress::CurveProgress;
use super::error::Error;
use super::kept::ReductionInputs;
use super::records::{RecordInputs, ResponseInputs};
use super::reduced::{ReducedScene, stuck_modes};
use super::reducing::inputs;
use super::response::{check_one_speed, check_undamped_modes};
use super::session::{Session, Stage, lock};
use super::stability::{Judged, points_to_judge};
use crate::description::{Scene, Subject};
use crate::dlft::SweepProgress;
use crate::dlft::branch::{ModelAt, ValueCurve, ValueRange, follow_over};
use crate::results::far_slip::ShorterSides;
use crate::results::pairs::PairTable;

/// Models that are kept for the next steps.
const KEPT: usize = 16;

/// Scene at a value. It may be asked for from several threads.
pub type SceneAt<'a> = dyn Fn(f64) -> Result<Scene, Error> + Sync + 'a;

/// Curve that is asked for.
#[derive(Debug, Clone)]
pub struct CurveQuestion<'a> {
    /// Key of the scene, which tells questions apart whose first models are the same.
    pub key: &'a str,
    /// Values, the frequency, and the axis.
    pub range: ValueRange,
    /// Name of the observed displacement; `None`: the first one.
    pub observation: Option<&'a str>,
}

/// Curve of a scene over a value.
#[derive(Debug)]
#[non_exhaustive]
pub struct ParameterCurve {
    /// Reduced model of the first value.
    pub reduced: ReducedScene,
    /// Number of the observed displacement.
    pub observation: usize,
    /// Motions along the branches, with their values.
    pub curve: ValueCurve,
    /// Values without a model, and why, in the order in which they were asked for.
    pub missing: Vec<(f64, Error)>,
}

/// Follows the motions at one frequency over a value. `scene_at` gives the scene of a value; the
/// meshes are those of all scenes.
///
/// # Errors
/// Those of `scene_at`, and of the stages up to the static state at the first value; at other values
/// they are no errors: see [`ParameterCurve::missing`]. [`Error::AllBonded`] without a contact that
/// can slip or open, [`Error::AlongEngineOrder`], [`Error::OtherPairs`] where the last value has
/// other pairs than the first, [`Error::Stopped`] by the observer.
pub fn curve(
    question: &CurveQuestion<'_>,
    scene_at: &SceneAt<'_>,
    source: Source,
    session: &Session<'_>,
) -> Result<ParameterCurve, Error> {
    let range = &question.range;
    let (Some(&from), Some(&to)) = (range.values.first(), range.values.last()) else {
        return Err(Error::NoMotion);
    };
    let scene = scene_at(from)?;
    let last = scene_at(to)?;
    check_one_speed(
        &scene,
        "a curve over a value has one frequency at one speed",
    )?;
    let first = First::new((from, scene), source, range.frequency_hz, session)?;
    let observation = first.at.reduced.observed(question.observation)?;
    // What cannot be computed at the other end is told before anything is solved.
    let other = first.model((to, last))?;
    let models = Models {
        first: &first,
        scene_at,
        kept: Mutex::default(),
        missing: Mutex::default(),
    };
    let mut curve = {
        let _stage = session.stage(Stage::Curve);
        followed(question, &models, &other, session)?
    };
    if let Some(curve) = &mut curve {
        let _stage = session.stage(Stage::Stability);
        judge_curve(curve, &models, session)?;
    }
    let missing = models.missing.into_inner();
    let missing = missing.unwrap_or_else(PoisonError::into_inner);
    session.check_running()?;
    let mut curve = curve.ok_or(Error::NoMotion)?;
    let reduced = first.at.reduced;
    let sides = ShorterSides::new(&reduced.pairs);
    for orbit in &mut curve.response.orbits {
        sides.judge_orbit(orbit);
    }
    Ok(ParameterCurve {
        reduced,
        observation,
        curve,
        missing,
    })
}

/// Judges the motions of a curve over a value that matter, each with the model of its value.
///
/// # Errors
/// [`Error::Stopped`] by the observer.
fn judge_curve(
    curve: &mut ValueCurve,
    models: &Models<'_>,
    session: &Session<'_>,
) -> Result<(), Error> {
    let first = &models.first.at;
    let scope = first.scene.response.stability;
    let pairs = first.reduced.problem.laws.len();
    for at in points_to_judge(&curve.response, scope, pairs, &[]) {
        session.check_running()?;
        let Some(model) = models.model(curve.values[at]) else {
            continue;
        };
        let judged = Judged {
            problem: &model.problem,
            damping: model.damping,
            state: &model.state,
            scope,
        };
        judged.judge(&mut curve.response.orbits[at]);
    }
    Ok(())
}

/// Follows the curve over the models, with the points that an earlier run solved.
fn followed(
    question: &CurveQuestion<'_>,
    models: &Models<'_>,
    last: &ModelAt,
    session: &Session<'_>,
) -> Result<Option<ValueCurve>, Error> {
    let (range, at) = (&question.range, &models.first.at);
    let settings = &at.settings;
    let recorded = session.records(&RecordInputs::Curve {
        response: ResponseInputs {
            problem: &at.reduced.problem,
            damping: at.damping,
            state: &at.state,
            settings,
            points: None,
        },
        last: &last.problem,
        key: question.key,
        range,
    })?;
    let curve = CurveProgress::new(session, &range.abscissae());
    let tell = |told: SweepProgress<'_>| match told {
        SweepProgress::Solved(solved) => {
            // A store that ends the run takes effect at the next point.
            let _ = session.append(recorded.key, solved);
            curve.advance(solved);
        }
        SweepProgress::Next(stop) => session.stop_if_ended(stop),
        SweepProgress::Apart => curve.go_on(),
        SweepProgress::Tries(_) => {}
    };
    let model_of = |value: f64| models.model(value);
    let curve = follow_over(range, &model_of, settings, &recorded.earlier, &tell);
    session.check_running()?;
    Ok(curve)
}

/// Model of the first value, from which those of the others are made.
struct First {
    at: ModelAtValue,
    source: Source,
    /// Inputs of its reduction; `None` for a reduced model that is read.
    inputs: Option<ReductionInputs>,
}

impl First {
    fn new(
        (value, scene): (f64, Scene),
        source: Source,
        frequency_hz: f64,
        session: &Session<'_>,
    ) -> Result<Self, Error> {
        let reduced = ReducedScene::new(&scene, source.clone(), session)?;
        if reduced.problem.laws.is_empty() {
            let why = "the amplitude is then proportional to the force, and `run` has it";
            return Err(Error::AllBonded { why });
        }
        let bound = reduced.bodies.as_ref().map(|bodies| &bodies.bound);
        let inputs = bound.map(|bound| inputs(&bound.model, stuck_modes(&scene), &scene));
        let mut at = ModelAtValue::from_reduced((value, scene), reduced, None, session)?;
        at.settings.frequencies_hz = vec![frequency_hz];
        let harmonics = at.settings.resolution.most_harmonics();
        let (problem, frequencies_hz) = (&at.reduced.problem, &at.settings.frequencies_hz);
        check_undamped_modes(problem, &at.state, at.damping, frequencies_hz, harmonics)?;
        Ok(Self { at, source, inputs })
    }

    /// Model of a scene at another value, made without a word.
    fn model(&self, (value, scene): (f64, Scene)) -> Result<ModelAt, Error> {
        let (mut nobody, mut nothing) = ((), ());
        let silent = Session::new(&mut nobody, &mut nothing);
        let reduced = self.reduced(&scene, &silent)?;
        let [own, first] = [&reduced, &self.at.reduced].map(|r| r.problem.laws.len());
        if own != first {
            return Err(Error::OtherPairs { value, own, first });
        }
        let at = ModelAtValue::from_reduced((value, scene), reduced, Some(&self.at), &silent)?;
        Ok(ModelAt {
            problem: at.reduced.problem,
            damping: at.damping,
            state: at.state,
        })
    }

    fn reduced(&self, scene: &Scene, session: &Session<'_>) -> Result<ReducedScene, Error> {
        let Subject::Assembly(assembly) = &scene.subject else {
            return match self.at.reduced_for(scene) {
                Some(reduced) => Ok(reduced),
                None => ReducedScene::new(scene, self.source.clone(), session),
            };
        };
        let Source::Meshes(meshes) = &self.source else {
            return Err(Error::NoMesh);
        };
        let bound = Bound::new(assembly, meshes, session)?;
        let wanted = stuck_modes(scene);
        if self.inputs.as_ref() != Some(&inputs(&bound.model, wanted, scene)) {
            return ReducedScene::from_bound(bound, wanted, scene, session);
        }
        let problem = problem(Arc::clone(&self.at.reduced.problem.reduced), &bound.model);
        Ok(ReducedScene {
            pairs: PairTable::from_model(&bound.model),
            problem: problem.with_modal_ratios(&scene.modal_ratios)?,
            bodies: None,
            of_folder: Vec::new(),
        })
    }
}

/// Models over the values, of which the last ones are kept.
struct Models<'a> {
    first: &'a First,
    scene_at: &'a SceneAt<'a>,
    kept: Mutex<VecDeque<(f64, Arc<ModelAt>)>>,
    missing: Mutex<Vec<(f64, Error)>>,
}

impl Models<'_> {
    /// Model of a value; `None` where there is none, which is noted.
    fn model(&self, value: f64) -> Option<Arc<ModelAt>> {
        let kept = lock(&self.kept);
        if let Some((_, model)) = kept.iter().find(|(of, _)| *of == value) {
            return Some(Arc::clone(model));
        }
        drop(kept);
        let first = &self.first.at;
        let made = if value == first.value {
            Ok(ModelAt {
                problem: first.reduced.problem.clone(),
                damping: first.damping,
                state: first.state.clone(),
            })
        } else {
            (self.scene_at)(value).and_then(|scene| self.first.model((value, scene)))
        };
        match made {
            Ok(model) => {
                let (model, mut kept) = (Arc::new(model), lock(&self.kept));
                kept.push_back((value, Arc::clone(&model)));
                if kept.len() > KEPT {
                    kept.pop_front();
                }
                Some(model)
            }
            Err(error) => {
                lock(&self.missing).push((value, error));
                None
            }
        }
    }
}
