//! Table and warnings of `dovetail peaks`.

use std::cell::RefCell;

use super::Workspace;
use super::key_range::{DIGITS, KeyRange};
use crate::error::RunError;
use crate::files::{PeakLine, PeaksFound, Sought};
use dovetail_export::csv::PeakRow;
use dovetail_export::warning::Weight;
use dovetail_export::words::{figure, quantity, rounded, short, supported_digits, title};
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::Orbit;
use dovetail_solver::results::quantities::loss_factor;
use dovetail_solver::run::{self, Error, PeakRange, Peaks, Source};

/// Peaks that are asked for.
#[derive(Debug, Clone)]
pub struct PeakQuestion {
    /// Key whose values are gone through.
    pub over: KeyRange,
    /// Second key: the values of the first one are gone through at each of its values.
    pub at_each: Option<KeyRange>,
    /// Name of the observed displacement; `None`: the first one.
    pub observation: Option<String>,
    /// Amplitude whose values are looked for, m.
    pub amplitude_m: Option<f64>,
    /// True to go on with a search that was interrupted.
    pub resume: bool,
}

impl Workspace<'_> {
    /// Finds the peaks over one key, or two, writes them, and returns a table for the reader.
    /// `scene_with` gives the scene with keys set to other values.
    ///
    /// # Errors
    /// Errors of [`Workspace::solve`]; those of `scene_with`.
    pub fn peaks<E: From<RunError>>(
        &self,
        question: &PeakQuestion,
        scene_with: &dyn Fn(&[String]) -> Result<Scene, E>,
    ) -> Result<(String, Result<(), RunError>), E> {
        let why = "peaks are those over the frequency at one speed";
        run::check_one_speed(self.scene, why).map_err(RunError::from)?;
        for (range, other) in [
            (Some(&question.over), question.at_each.as_ref()),
            (question.at_each.as_ref(), Some(&question.over)),
        ] {
            let Some(range) = range else { continue };
            let also: Vec<String> = other.iter().map(|other| other.first()).collect();
            range.check_is_read(&also, scene_with)?;
        }
        let sought = Sought::Peaks(PeaksFound::new(&question.keys()));
        self.start_search(sought, question.resume)?;
        let source = self.source()?;
        let outer: Vec<Option<f64>> = match &question.at_each {
            None => vec![None],
            Some(range) => range.values().into_iter().map(Some).collect(),
        };
        let values = question.over.values();
        let mut lines: Vec<(Option<f64>, Peaks)> = Vec::new();
        for value in outer {
            let also = question.at_each.as_ref().zip(value);
            let also = also.map(|(range, value)| range.set(value));
            let start: Option<&Orbit> = (lines.last())
                .and_then(|(_, peaks)| peaks.rows.first())
                .map(|row| &row.orbit);
            let range = PeakRange {
                values: &values,
                logarithmic: question.over.is_logarithmic(),
                observation: question.observation.as_deref(),
                amplitude_m: question.amplitude_m,
                start,
            };
            let scene_at = |value: f64| {
                let set: Vec<String> = (also.iter().cloned())
                    .chain([question.over.set(value)])
                    .collect();
                scene_with(&set)
            };
            if let Some(files) = &self.files {
                files.locked().begin_line_of_peaks(value);
            }
            let peaks_found = self.peaks_over(&range, &scene_at, source.clone())?;
            self.warn(question, value, &peaks_found);
            lines.push((value, peaks_found));
        }
        if let Some(files) = &self.files {
            let drawn: Vec<PeakLine<'_>> = lines.iter().map(|l| drawn(question, l)).collect();
            files.locked().peaks(&question.keys(), &drawn)?;
        }
        let missing = lines.iter().map(|(_, peaks)| peaks.missing.len()).sum();
        let asked = lines.len() * values.len();
        let verdict = match missing {
            0 => Ok(()),
            missing => Err(RunError::NoPeaks {
                missing,
                values: asked,
            }),
        };
        let tables = lines
            .iter()
            .map(|(value, peaks)| table(question, *value, peaks));
        Ok((tables.collect(), verdict))
    }

    /// Finds the peaks over the values of a range. `scene_at` gives the scene of a value.
    ///
    /// # Errors
    /// Errors of [`Workspace::solve`]; those of `scene_at`.
    pub fn peaks_at<E: From<RunError>>(
        &self,
        range: &PeakRange<'_>,
        scene_at: &dyn Fn(f64) -> Result<Scene, E>,
    ) -> Result<Peaks, E> {
        self.peaks_over(range, scene_at, self.source()?)
    }

    fn peaks_over<E: From<RunError>>(
        &self,
        range: &PeakRange<'_>,
        scene_at: &dyn Fn(f64) -> Result<Scene, E>,
        source: Source,
    ) -> Result<Peaks, E> {
        let wrong = RefCell::new(None);
        let scene_at = |value: f64| {
            scene_at(value).map_err(|error| {
                *wrong.borrow_mut() = Some(error);
                Error::Stopped
            })
        };
        let result = self.computes(|session| run::peaks(range, scene_at, source, session));
        match wrong.into_inner() {
            Some(error) => Err(error),
            None => Ok(result?),
        }
    }

    /// Warns of values without a peak, and of peaks that are not accurate.
    fn warn(&self, question: &PeakQuestion, also: Option<f64>, peaks: &Peaks) {
        let also = question.words_of_second(also);
        let at = also.map_or(String::new(), |also| format!(" ({also})"));
        let kind = |missing: &(f64, Error)| std::mem::discriminant(&missing.1);
        let same = |a: &(f64, Error), b: &(f64, Error)| kind(a) == kind(b);
        for alike in peaks.missing.chunk_by(same) {
            let (first, error, others) = match alike {
                [] => continue,
                [(first, error)] => (first, error, String::new()),
                [(first, error), .., (last, _)] => {
                    let (more, last) = (alike.len() - 1, question.over.words(*last));
                    (first, error, format!(", nor at {more} more up to {last}"))
                }
            };
            let first = question.over.words(*first);
            let text = format!("no peak at {first}{at}{others}: {error}");
            self.reporter.warning(Weight::Wrong, text);
        }
        let orbits = peaks.rows.iter().map(|row| &row.orbit);
        self.warn_of_missed(&format!("{} peaks{at}", peaks.rows.len()), orbits.clone());
        self.warn_of_unstable(&format!("{} peaks{at}", peaks.rows.len()), orbits.clone());
        self.warn_of_errors(&format!("peaks{at}"), orbits, peaks.observation);
    }
}

impl PeakQuestion {
    /// Keys that are varied.
    fn keys(&self) -> Vec<&str> {
        let also = self.at_each.iter();
        also.chain([&self.over])
            .map(|range| range.key.as_str())
            .collect()
    }

    /// Name and value of the second key; `None` without one.
    fn words_of_second(&self, value: Option<f64>) -> Option<String> {
        let (range, value) = self.at_each.as_ref().zip(value)?;
        Some(range.words(value))
    }
}

/// Line of peaks for the files.
fn drawn<'a>(question: &PeakQuestion, (value, peaks): &'a (Option<f64>, Peaks)) -> PeakLine<'a> {
    let name = peaks.reduced.observations()[peaks.observation].name.clone();
    PeakLine {
        label: (question.words_of_second(*value)).unwrap_or_else(|| name.clone()),
        observation: name,
        rows: PeakRow::rows(*value, peaks),
        asked: question.over.values(),
        missing: peaks.missing.iter().map(|(value, _)| *value).collect(),
    }
}

/// Table of one line of peaks, with what was found besides.
fn table(question: &PeakQuestion, also: Option<f64>, peaks: &Peaks) -> String {
    let over = &question.over;
    let observation = peaks.observation;
    let also = question.words_of_second(also);
    let at = also.map_or(String::new(), |also| format!(", {also}"));
    let mut text = format!(
        "peak of {} over {}{at}\n{:>14}{:>14}{:>14}{:>12}{:>14}{:>14}\n",
        peaks.reduced.observations()[observation].name,
        over.key,
        title(over.word()),
        "amplitude",
        "frequency, Hz",
        "of linear",
        "loss factor",
        "pairs open",
    );
    for row in &peaks.rows {
        let amplitude_m = row.amplitude_m(observation);
        let error = row.orbit.amplitude_error(observation);
        let ratio = row.linear_m.map(|linear| amplitude_m / linear);
        let words = |v: Option<f64>| v.map_or("–".to_owned(), |v| figure(v, 3));
        text += &format!(
            "{:>14}{:>14}{:>14}{:>12}{:>14}{:>14}\n",
            short(rounded(row.value, DIGITS)),
            quantity(amplitude_m, "m", supported_digits(amplitude_m, error)),
            figure(row.orbit.frequency_hz, 6),
            words(ratio),
            words(loss_factor(&row.orbit)),
            row.orbit.counts().opening
        );
    }
    let at_value = |value: f64| peaks.rows.iter().find(|row| row.value == value);
    if let Some(least) = peaks.least.and_then(at_value) {
        text += &format!(
            "least peak: {} at {}\n",
            quantity(least.amplitude_m(observation), "m", 4),
            over.words(least.value)
        );
    }
    if let Some(amplitude_m) = question.amplitude_m {
        let amplitude = quantity(amplitude_m, "m", 4);
        if peaks.reached.is_empty() {
            text += &format!("no value of the range has a peak of {amplitude}\n");
        }
        for value in &peaks.reached {
            text += &format!("peak of {amplitude} at {}\n", over.words(*value));
        }
    }
    for [below, above] in &peaks.changes {
        text += &format!(
            "another resonance becomes the higher one between {} and {}\n",
            over.words(*below),
            over.words(*above)
        );
    }
    text + &format!("{} motions solved\n", peaks.solved)
}
