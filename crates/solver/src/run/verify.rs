//! Comparison of harmonic balance with integration in time, at a few frequencies.

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::bodies::Source;
use super::error::Error;
use super::outcome::{ResponseResult, Run, StaticResult};
use super::reduced::ReducedScene;
use super::response::{
    Responses, check_one_speed, check_without_influence, frequencies_hz as frequencies_of,
};
use super::session::{Session, Stage};
use crate::damping::Rayleigh;
use crate::description::{Scene, Subject};
use crate::dlft::branch::stable_in_drawing;
use crate::dlft::{Orbit, Response};
use crate::integration::compare::{Comparison, IntegrationStart, compare};
use crate::integration::steady::{MOST_STEPS_IN_ALL, Until};
use crate::reduction::StuckModes;
use crate::results::peak::largest_amplitude;

/// Most frequencies of the response in which the peak is searched.
const MOST_POINTS: usize = 81;
/// A flank of the peak is the first frequency beside it below this fraction of its amplitude.
const FLANK: f64 = 0.75;

/// Frequencies and settings of an integration in time.
#[derive(Debug, Clone, PartialEq)]
pub struct Verification {
    /// Frequencies, Hz. Every motion at each of them is compared that the response has. Empty: the
    /// peak of a response over the scene's range, and its two flanks.
    pub frequencies_hz: Vec<f64>,
    /// Number of steps of one period.
    pub steps_per_period: usize,
    /// Exact number of periods; `None`: until steady, at most `most_periods`.
    pub periods: Option<usize>,
    /// Most periods until the motion is steady.
    pub most_periods: usize,
    /// Fraction of the transient that may be left.
    pub steady: f64,
    /// True to start from the static state instead of the motion of harmonic balance.
    pub from_rest: bool,
    /// Fraction by which the departure of the motion of harmonic balance from its mean is made
    /// larger to start from.
    pub perturbation: f64,
    /// Largest relative difference that passes.
    pub tolerance: f64,
}

impl Verification {
    /// Checks that the number of steps is allowed.
    ///
    /// # Errors
    /// [`Error::TooManySteps`].
    pub fn check(&self) -> Result<(), Error> {
        let (periods, steps) = (self.most_periods_asked(), self.steps_per_period);
        if periods.saturating_mul(steps) > MOST_STEPS_IN_ALL {
            return Err(Error::TooManySteps {
                periods,
                steps,
                most: MOST_STEPS_IN_ALL,
            });
        }
        Ok(())
    }

    /// Number of periods that are integrated, or the most where they end with the transient.
    fn most_periods_asked(&self) -> usize {
        self.periods.unwrap_or(self.most_periods)
    }
}

/// Results of both methods.
#[derive(Debug)]
#[non_exhaustive]
pub struct Verified {
    /// Reduced model, its static state, and harmonic balance at the frequencies that were asked for
    /// or searched.
    pub run: Run,
    /// Comparison at each frequency that was integrated.
    pub comparisons: Vec<Comparison>,
    /// [`Error::NotSteady`] or [`Error::Disagreement`], where they differ.
    pub verdict: Result<(), Error>,
}

/// Integrates the reduced model in time at each frequency and compares.
///
/// # Errors
/// [`Error::TooManySteps`]; [`Error::AllBonded`]; [`Error::WithInfluence`]; those of the static state and the reduction;
/// [`Error::NotConverged`] where harmonic balance has no motion to compare.
pub fn verify(
    scene: &Scene,
    source: Source,
    asked: &Verification,
    session: &Session<'_>,
) -> Result<Verified, Error> {
    asked.check()?;
    check_one_speed(scene, "an integration in time needs one speed")?;
    check_without_influence(scene, "an integration in time")?;
    let scene = &require_harmonic_modes(scene);
    let reduced = ReducedScene::new(scene, source, session)?.add_all_waves(scene, session)?;
    let problem = &reduced.problem;
    if problem.laws.is_empty() {
        let why = "the response is linear and in closed form, there is nothing to compare";
        return Err(Error::AllBonded { why });
    }
    let statics = super::statics(scene, &reduced, false, session)?;
    statics.usable()?;
    let damping = reduced.rayleigh(&scene.damping, &statics.state)?;
    let (found, chosen) = orbits(scene, &reduced, damping, &statics, asked, session)?;
    let response = &found.response;
    let stable = stable_in_drawing(response);
    let comparisons = {
        let _stage = session.stage(Stage::TimeIntegration);
        let steps = session.steps(chosen.len(), "frequencies");
        let until = Until {
            most_periods: asked.most_periods_asked(),
            tolerance: if asked.periods.is_some() {
                0.0
            } else {
                asked.steady
            },
        };
        let one = |i: &usize| {
            let start = if asked.from_rest {
                IntegrationStart::Rest(&statics.state)
            } else {
                IntegrationStart::Orbit {
                    larger_by: asked.perturbation,
                }
            };
            let done = compare(
                problem,
                damping,
                &response.orbits[*i],
                start,
                asked.steps_per_period,
                until,
                response.slip_threshold_m,
            );
            steps.step();
            done.map(|mut done: Comparison| {
                done.is_stable = stable[*i];
                done
            })
        };
        chosen
            .par_iter()
            .map(one)
            .collect::<Result<Vec<Comparison>, _>>()?
    };
    session.check_running()?;
    Ok(Verified {
        verdict: judge(&comparisons, asked),
        comparisons,
        run: Run {
            reduced,
            statics,
            response: Some(found),
            held_omega2: Vec::new(),
        },
    })
}

/// Scene with no fewer modes than the harmonics require, because a motion in time has all
/// harmonics. A folder keeps the modes that it has.
fn require_harmonic_modes(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    let asked = &mut scene.response.stuck_modes;
    let least = StuckModes::OF_HARMONICS;
    *asked = match (*asked, &scene.subject) {
        (None, Subject::ReducedModel(_)) => None,
        (asked, _) => Some(asked.map_or(least, |modes| modes.max(least))),
    };
    scene
}

/// Response, and the positions in it of the orbits to compare. Where the scene has no grid, its
/// curve is followed past the frequencies that are asked for.
///
/// # Errors
/// [`Error::NotConverged`] where a frequency that is asked for has no motion.
fn orbits(
    scene: &Scene,
    reduced: &ReducedScene,
    damping: Rayleigh,
    statics: &StaticResult,
    asked: &Verification,
    session: &Session<'_>,
) -> Result<(ResponseResult, Vec<usize>), Error> {
    let state = &statics.state;
    let mut asked_hz = asked.frequencies_hz.clone();
    asked_hz.sort_by(f64::total_cmp);
    asked_hz.dedup();
    let mut spec = scene.response.clone();
    spec.points = spec.points.map(|points| points.min(MOST_POINTS));
    let mut frequencies_hz = asked_hz.clone();
    if asked_hz.is_empty() || spec.points.is_none() {
        frequencies_hz.extend(frequencies_of(&spec, &reduced.linear_omega2(state))?);
        frequencies_hz.sort_by(f64::total_cmp);
        frequencies_hz.dedup();
    }
    let responses = Responses {
        spec: &spec,
        reduced,
        damping,
        state,
        frequencies_hz: &frequencies_hz,
        session,
    };
    let (mut response, slide) = responses.response(None)?;
    let chosen = if asked_hz.is_empty() {
        peak_and_flanks(&response)
    } else {
        motions_at(&asked_hz, &response)?
    };
    for at in &chosen {
        responses.judged().judge(&mut response.orbits[*at]);
    }
    let result = ResponseResult {
        response,
        compared: None,
        damping,
        slide,
        farthest: None,
        retained: Vec::new(),
        modes_reach: None,
        tractions: None,
        departures: Vec::new(),
        run_up: None,
    };
    Ok((result, chosen))
}

/// Positions of all motions at these frequencies, each of them once: both halves of a curve that do
/// not meet in its middle may come through the same motions.
///
/// # Errors
/// [`Error::NotConverged`] where one of them has no motion.
fn motions_at(asked_hz: &[f64], response: &Response) -> Result<Vec<usize>, Error> {
    let hz = |i: usize| response.orbits[i].frequency_hz;
    let mut indices: Vec<usize> = Vec::new();
    for (i, orbit) in response.orbits.iter().enumerate() {
        let known = |j: &usize| hz(*j) == hz(i) && response.orbits[*j].has_same_vibration(orbit);
        if orbit.outcome.has_motion() && asked_hz.contains(&hz(i)) && !indices.iter().any(known) {
            indices.push(i);
        }
    }
    let is_missing = |asked: &&f64| indices.iter().all(|i| hz(*i) != **asked);
    match asked_hz.iter().filter(is_missing).count() {
        0 => Ok(indices),
        unconverged => Err(Error::NotConverged {
            unconverged,
            inaccurate: 0,
            not_held: 0,
            points: asked_hz.len(),
        }),
    }
}

/// Positions of the largest amplitude, and of the first frequency with a motion on each side below [`FLANK`] of
/// it; all motions where nothing is observed.
fn peak_and_flanks(response: &Response) -> Vec<usize> {
    let Some(top) = largest_amplitude(response, 0) else {
        let has_motion = |i: &usize| response.orbits[*i].outcome.has_motion();
        return (0..response.orbits.len()).filter(has_motion).collect();
    };
    let below = |i: &usize| {
        let orbit: &Orbit = &response.orbits[*i];
        orbit.outcome.has_motion() && orbit.observed_amplitude[0] < FLANK * top.amplitude_m
    };
    let left = (0..top.index).rev().find(below);
    let right = (top.index + 1..response.orbits.len()).find(below);
    left.into_iter().chain([top.index]).chain(right).collect()
}

fn judge(comparisons: &[Comparison], asked: &Verification) -> Result<(), Error> {
    if asked.periods.is_none()
        && let Some(moving) = comparisons.iter().find(|c| !c.steady)
    {
        return Err(Error::NotSteady {
            frequency_hz: moving.frequency_hz,
            periods: moving.periods,
            left: moving.transient_left,
        });
    }
    let unstable = || comparisons.iter().filter(|c| !c.is_stable);
    if let Some(stays) = unstable().find(|c| c.worst() <= asked.tolerance) {
        let frequency_hz = stays.frequency_hz;
        return Err(Error::Stays { frequency_hz });
    }
    let stable = || comparisons.iter().filter(|c| c.is_stable);
    let of_stable = stable().map(|c| (c.frequency_hz, c.worst()));
    // An unstable motion goes over to one of the stable ones at its frequency.
    let of_unstable = unstable().filter_map(|from| {
        let ends = stable().filter(|c| c.frequency_hz == from.frequency_hz);
        let nearest = ends
            .map(|c| c.largest_difference(&from.integration))
            .reduce(f64::min);
        Some((from.frequency_hz, nearest?))
    });
    let worst = of_stable
        .chain(of_unstable)
        .max_by(|a, b| a.1.total_cmp(&b.1));
    match worst {
        Some((frequency_hz, worst)) if worst > asked.tolerance => Err(Error::Disagreement {
            frequency_hz,
            percent: 100.0 * worst,
            tolerance_percent: 100.0 * asked.tolerance,
        }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::PairLaw;
    use crate::damping::DampingSpec;
    use crate::description::{FrequencyRange, ReducedModelSpec, ResponseSpec};
    use crate::dlft::Outcome;
    use crate::dlft::settings::Resolution;

    #[test]
    fn each_motion_at_a_frequency_is_compared_once() {
        let motion = |frequency_hz, amplitude_m: f64| Orbit {
            observed: vec![vec![0.0, amplitude_m, 0.0]],
            ..Orbit::motionless(frequency_hz, Outcome::Converged)
        };
        let response = Response {
            orbits: vec![
                motion(10.0, 1.0),
                motion(20.0, 2.0),
                motion(20.0, 3.0),
                motion(20.0, 2.00001),
                motion(10.0, 1.0),
                Orbit::motionless(20.0, Outcome::Stagnated),
            ],
            ..Response::default()
        };
        assert_eq!(motions_at(&[10.0, 20.0], &response).unwrap(), [0, 1, 2]);
        assert!(motions_at(&[15.0, 20.0], &response).is_err());
    }

    #[test]
    fn a_motion_in_time_has_no_fewer_modes_than_harmonics_require() {
        let bodies = Subject::Assembly(Box::default());
        let folder = Subject::ReducedModel(ReducedModelSpec {
            folder: "model".into(),
            law: PairLaw::rigid(0.3, 0.0),
            force_n: 1.0,
        });
        for (subject, asked, expected) in [
            (&bodies, None, Some(48)),
            (&bodies, Some(20), Some(48)),
            (&bodies, Some(96), Some(96)),
            (&folder, None, None),
        ] {
            let range = FrequencyRange::OfFirstLinearMode { from: 0.9, to: 1.1 };
            let mut scene = Scene::new(
                "modes",
                subject.clone(),
                ResponseSpec::new(range, Resolution::fixed(1, 16)),
            )
            .damping(DampingSpec::ratio(0.001));
            scene.response.stuck_modes = asked;
            let found = require_harmonic_modes(&scene).response.stuck_modes;
            assert_eq!(found, expected, "{asked:?}");
        }
    }
}
