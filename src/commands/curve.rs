//! Table and warnings of `dovetail curve`.

use std::sync::{Mutex, PoisonError};

use super::Workspace;
use super::key_range::{DIGITS, KeyRange};
use crate::error::RunError;
use crate::files::{CurveUnderWay, Sought};
use dovetail_export::warning::{CREEPS, LARGE_ERROR, Weight};
use dovetail_export::words::{
    counted, figure, percent, quantity, rounded, short, supported_digits, title,
};
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::branch::{ValueRange, folds, stable};
use dovetail_solver::results::quantities::loss_factor;
use dovetail_solver::run::{self, CurveQuestion, Error, ParameterCurve};

/// Curve that is asked for.
#[derive(Debug, Clone)]
pub struct AskedCurve {
    /// Key whose values the curve is followed over.
    pub over: KeyRange,
    /// Frequency of the motions, Hz.
    pub frequency_hz: f64,
    /// Name of the observed displacement; `None`: the first one.
    pub observation: Option<String>,
    /// True to go on with a curve that was interrupted.
    pub resume: bool,
}

impl Workspace<'_> {
    /// Follows the motions at one frequency over a key, writes them, and returns a table for the
    /// reader. `scene_with` gives the scene with keys set to other values.
    ///
    /// # Errors
    /// Errors of [`Workspace::solve`]; those of `scene_with`.
    pub fn curve<E: From<RunError> + Send>(
        &self,
        asked: &AskedCurve,
        scene_with: &(dyn Fn(&[String]) -> Result<Scene, E> + Sync),
    ) -> Result<(String, Result<(), RunError>), E> {
        let why = "a curve over a value has one frequency at one speed";
        run::check_one_speed(self.scene, why).map_err(RunError::from)?;
        let question = CurveQuestion {
            key: &asked.over.key,
            range: ValueRange {
                values: asked.over.values(),
                logarithmic: asked.over.is_logarithmic(),
                frequency_hz: asked.frequency_hz,
            },
            observation: asked.observation.as_deref(),
        };
        self.start_search(Sought::Curve(CurveUnderWay::new(&question)), asked.resume)?;
        let wrong = Mutex::new(None);
        let scene_at = |value: f64| {
            scene_with(&[asked.over.set(value)]).map_err(|error| {
                *wrong.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
                Error::NoScene
            })
        };
        // A key that takes no such values is told before anything is meshed.
        for value in question.range.ends_and_inside() {
            scene_with(&[asked.over.set(value)])?;
        }
        asked.over.check_is_read(&[], scene_with)?;
        let source = self.source()?;
        let computed = self.computes(|session| run::curve(&question, &scene_at, source, session));
        let result = match (computed, wrong.into_inner()) {
            (Ok(computed), _) => computed,
            (Err(_), Ok(Some(error))) => return Err(error),
            (Err(error), _) => return Err(error.into()),
        };
        if let Some(files) = &self.files {
            let (key, frequency_hz) = (&asked.over.key, asked.frequency_hz);
            files.locked().curve(key, frequency_hz, &result)?;
        }
        self.warn_of_curve(asked, &result);
        let asked_for = &question.range.values;
        let has_motion = |value: &&f64| {
            let points = result
                .curve
                .values
                .iter()
                .zip(&result.curve.response.orbits);
            let mut at = points.filter(|(of, _)| of == value);
            at.any(|(_, orbit)| orbit.outcome.has_motion())
        };
        let missing = asked_for.len() - asked_for.iter().filter(has_motion).count();
        let verdict = match missing {
            0 => Ok(()),
            missing => Err(RunError::NoMotions {
                missing,
                values: asked_for.len(),
            }),
        };
        Ok((table(asked, &result), verdict))
    }

    /// Warns of values without a motion or a model, of gaps, and of amplitudes that are not accurate.
    fn warn_of_curve(&self, asked: &AskedCurve, found: &ParameterCurve) {
        let over = &asked.over;
        let (curve, response) = (&found.curve, &found.curve.response);
        if let Some((first, error)) = found.missing.first() {
            let more = match found.missing.len() {
                1 => String::new(),
                count => format!(", and at {} more", counted(count - 1, "value", "values")),
            };
            let text = format!("no model at {}{more}: {error}", over.words(*first));
            self.reporter.warning(Weight::Wrong, text);
        }
        let gaps: Vec<usize> = (response.branches.iter())
            .flat_map(|b| b.gaps.iter().copied())
            .collect();
        if let Some(first) = gaps.first() {
            let [from, to] = [first - 1, *first].map(|i| over.words(curve.values[i]));
            let text = format!(
                "the curve could not be followed everywhere: it has {}, the first from {from} to \
                 {to}, where nothing is known of it; other values (--over), more \
                 response.max_newton_iterations or another number of response.harmonics may help",
                counted(gaps.len(), "gap", "gaps")
            );
            self.reporter.warning(Weight::Doubt, text);
        }
        let places = response.branches.iter().filter_map(|b| b.given_up);
        let places: Vec<String> = places.map(|at| over.words(curve.values[at])).collect();
        if !places.is_empty() {
            let text = format!(
                "the curve was given up at {}, where {CREEPS}, and nothing is known of it \
                 behind that place; another range (--over) or fewer response.harmonics may help",
                places.join(" and ")
            );
            self.reporter.warning(Weight::Doubt, text);
        }
        let motions = response.orbits.iter().filter(|o| o.outcome.has_motion());
        let of = format!("{} motions", response.orbits.len());
        self.warn_of_missed(&of, motions.clone());
        let errors = motions.filter_map(|orbit| orbit.amplitude_error(found.observation));
        let large: Vec<f64> = errors.filter(|e| *e > LARGE_ERROR).collect();
        if let Some(worst) = large.iter().copied().reduce(f64::max) {
            let text = format!(
                "at {} of {} motions the harmonics left out are estimated to change the amplitude by \
                 more than {}, at worst by {} (column estimated_error of curve.csv): take more \
                 response.harmonics, or response.accuracy = 0.01 in their place",
                large.len(),
                response.orbits.len(),
                percent(LARGE_ERROR, 1),
                percent(worst, 2)
            );
            self.reporter.warning(Weight::Doubt, text);
        }
    }
}

/// Table of the motions at the values asked for, in the order of the branches, with folds and ranges
/// of several motions.
fn table(asked: &AskedCurve, found: &ParameterCurve) -> String {
    let (over, observation) = (&asked.over, found.observation);
    let (curve, response) = (&found.curve, &found.curve.response);
    let mut text = format!(
        "motions of {} at {} Hz over {}\n{:>14}{:>14}{:>12}{:>14}{:>14}{:>14}\n",
        found.reduced.observations()[observation].name,
        short(rounded(asked.frequency_hz, 7)),
        over.key,
        title(over.word()),
        "amplitude",
        "of linear",
        "loss factor",
        "pairs open",
        "motion",
    );
    let (values, stable) = (over.values(), stable(response));
    let amplitude = |i: usize| {
        let orbit = &response.orbits[i];
        let (amplitude_m, error) = (
            orbit.observed_amplitude[observation],
            orbit.amplitude_error(observation),
        );
        quantity(amplitude_m, "m", supported_digits(amplitude_m, error))
    };
    for (i, orbit) in response.orbits.iter().enumerate() {
        if !values.contains(&curve.values[i]) {
            continue;
        }
        let value = short(rounded(curve.values[i], DIGITS));
        if !orbit.outcome.has_motion() {
            text += &format!("{value:>14}{:>68}\n", orbit.outcome);
            continue;
        }
        let linear_m = response.linear[i].observed_amplitude.get(observation);
        let linear_m = linear_m.copied().filter(|linear_m| *linear_m > 0.0);
        let ratio = linear_m.map(|linear_m| orbit.observed_amplitude[observation] / linear_m);
        let words = |v: Option<f64>| v.map_or("–".to_owned(), |v| figure(v, 3));
        text += &format!(
            "{value:>14}{:>14}{:>12}{:>14}{:>14}{:>14}\n",
            amplitude(i),
            words(ratio),
            words(loss_factor(orbit)),
            orbit.counts().opening,
            match stable[i] {
                Some(true) => "stable",
                Some(false) => "unstable",
                None => "not judged",
            },
        );
    }
    for fold in folds(response) {
        text += &format!(
            "fold at {}: {}\n",
            over.words(curve.values[fold]),
            amplitude(fold)
        );
    }
    for several in &curve.several {
        text += &format!(
            "several motions from {} to {}: at {} the largest has {} and the smallest {}\n",
            over.words(several.from),
            over.words(several.to),
            over.words(several.value),
            quantity(several.amplitude_m, "m", 4),
            quantity(several.other_amplitude_m, "m", 4),
        );
    }
    let branches = response.branches.len();
    text + &format!(
        "{} motions on {}\n",
        response.orbits.len(),
        counted(branches, "branch", "branches")
    )
}
