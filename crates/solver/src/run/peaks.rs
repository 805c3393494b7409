//! Peaks of an observed amplitude over a value of the scene: a force, a coefficient of friction, a
//! clearance, a speed.
//!
//! At the first value the whole curve is followed. From there each peak is found near the last ones
//! ([`peak_near`]), with a few solutions. The whole curve of the last value tells whether another
//! resonance has taken over meanwhile; its peak is then followed back to where it is the lower one.

use super::at::ModelAtValue;
use super::bodies::Source;
use super::error::Error;
use super::outcome::PeakAt;
use super::records::{RecordInputs, ResponseInputs};
use super::reduced::ReducedScene;
use super::response::smooth_curve_frequencies_hz;
use super::session::{Event, Session, Stage};
use crate::description::Scene;
use crate::dlft::branch::{Guess, estimated, follow, peak_near};
use crate::dlft::linear_curve::linear_curve;
use crate::dlft::peaks::{inside, vertex};
use crate::dlft::settings::Resolution;
use crate::dlft::sweep::{SweepSettings, SweepState, solve_after};
use crate::dlft::{Orbit, SolvedFrequency, SweepProgress};
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::results::far_slip::ShorterSides;
use crate::results::peak::{largest_amplitude, uncomputed_resonance};
use dovetail_numerics::memory;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A peak of the whole curve is another one where it is higher by more than this fraction.
const OTHER: f64 = 2e-3;
/// Most values that are added to find the least peak, or an amplitude.
const MOST_ADDED: usize = 12;
/// Relative gain of the least peak below which no more values are added.
const LEAST_GAIN: f64 = 1e-4;
/// Relative error at which an amplitude counts as reached. Peaks are known to some 1e-4.
const REACHED: f64 = 5e-4;

/// Values at which peaks are asked for.
#[derive(Debug, Clone)]
pub struct PeakRange<'a> {
    /// Values, ascending.
    pub values: &'a [f64],
    /// True if the logarithm of the value is what peaks are a smooth function of; all values are
    /// then positive.
    pub logarithmic: bool,
    /// Name of the observed displacement; `None`: the first one.
    pub observation: Option<&'a str>,
    /// Peak amplitude whose values are looked for, m.
    pub amplitude_m: Option<f64>,
    /// Peak of a scene that differs little from that of the first value; `None`: the whole curve of
    /// the first value is followed.
    pub start: Option<&'a Orbit>,
}

/// Peaks over a value.
#[derive(Debug)]
#[non_exhaustive]
pub struct Peaks {
    /// Reduced model of the last value that was solved.
    pub reduced: ReducedScene,
    /// Number of the observed displacement whose peaks they are.
    pub observation: usize,
    /// Peak of each value at which one was found, ascending: of the values asked for, and of those
    /// that were added.
    pub rows: Vec<PeakAt>,
    /// Values without a peak, and why.
    pub missing: Vec<(f64, Error)>,
    /// Values between which another resonance becomes the higher one, ascending.
    pub changes: Vec<[f64; 2]>,
    /// Value of the least peak, where it is inside of the range.
    pub least: Option<f64>,
    /// Values at which the peak has the amplitude that is looked for.
    pub reached: Vec<f64>,
    /// Number of motions that were solved for.
    pub solved: usize,
}

/// Finds the peaks over the values of a range. `scene_at` gives the scene of a value; the meshes are
/// those of all scenes.
///
/// # Errors
/// Those of `scene_at`, and of the stages up to the static state at the first value. At other values
/// they are no errors: see [`Peaks::missing`]. [`Error::AllBonded`] without a contact that can slip
/// or open, [`Error::Stopped`] by the observer.
pub fn peaks<E: From<Error>>(
    range: &PeakRange<'_>,
    scene_at: impl Fn(f64) -> Result<Scene, E>,
    source: Source,
    session: &Session<'_>,
) -> Result<Peaks, E> {
    let solved = AtomicUsize::new(0);
    let mut search = Search {
        range,
        scene_at,
        source,
        session,
        observation: 0,
        at: None,
        missing: Vec::new(),
        solved: &solved,
    };
    if let Some(first) = range.values.first() {
        let scene = (search.scene_at)(*first)?;
        search.go_to(*first, scene)?;
    }
    let at = search.at.as_ref().ok_or(Error::NoPeak)?;
    search.observation = at.reduced.observed(range.observation)?;
    let _stage = session.stage(Stage::Peaks);
    let (mut rows, mut changes) = search.find_all()?;
    let least = search.least(&mut rows)?;
    let reached = search.reached(&mut rows)?;
    session.check_running()?;
    changes.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (missing, observation) = (search.missing, search.observation);
    let reduced = search.at.map(|at| at.reduced).ok_or(Error::NoPeak)?;
    let solved = solved.into_inner();
    Ok(Peaks {
        reduced,
        observation,
        rows,
        missing,
        changes,
        least,
        reached,
        solved,
    })
}

impl ModelAtValue {
    /// Peak near a motion, or that of the whole curve where none is given, or none found near it.
    /// It is not looked for again where the store has it.
    pub(super) fn find(
        &self,
        near: Option<&Guess>,
        observation: usize,
        session: &Session<'_>,
        tell: &(dyn Fn(SweepProgress<'_>) + Sync),
    ) -> Result<Orbit, Error> {
        let (problem, damping) = (&self.reduced.problem, self.damping);
        let (state, settings) = (&self.state, &self.settings);
        self.load_or_find((settings, near, observation), session, || {
            let near = near.and_then(|guess| {
                peak_near(problem, damping, state, settings, guess, observation, tell)
            });
            near.map_or_else(|| highest(self, observation, tell), Ok)
        })
    }

    /// Motion at one frequency, Hz, which begins from another one where one is given, such as that of
    /// laws that differ little. It is not solved for again where the store has it.
    ///
    /// # Errors
    /// [`Error::NoPeak`] without a motion there; [`Error::Stopped`].
    pub(super) fn solve_frequency(
        &self,
        frequency_hz: f64,
        near: Option<&Orbit>,
        session: &Session<'_>,
        tell: &(dyn Fn(SweepProgress<'_>) + Sync),
    ) -> Result<Orbit, Error> {
        let mut settings = self.settings.clone();
        settings.frequencies_hz = vec![frequency_hz];
        let guess = near.map(Guess::from_peak);
        self.load_or_find((&settings, guess.as_ref(), 0), session, || {
            let mut last = SweepState::default();
            if let Some(near) = near {
                last.follow(&SolvedFrequency::isolated(near.clone()));
            }
            let (problem, state) = (&self.reduced.problem, &self.state);
            let solved = solve_after(&last, 0, problem, self.damping, state, &settings, tell);
            let solved = solved.map(|solved| solved.orbit);
            solved
                .filter(|orbit| orbit.outcome.has_motion())
                .ok_or(Error::NoPeak)
        })
    }

    /// A motion that the store has, or else the one that `find` finds.
    fn load_or_find(
        &self,
        (settings, near, observation): (&SweepSettings, Option<&Guess>, usize),
        session: &Session<'_>,
        find: impl FnOnce() -> Result<Orbit, Error>,
    ) -> Result<Orbit, Error> {
        let recorded = session.records(&RecordInputs::Peak {
            response: ResponseInputs {
                problem: &self.reduced.problem,
                damping: self.damping,
                state: &self.state,
                settings,
                points: None,
            },
            near,
            observation,
        })?;
        if let Some(kept) = recorded.earlier.into_iter().last() {
            return Ok(kept.orbit);
        }
        let orbit = find()?;
        session.check_running()?;
        session.append(recorded.key, &SolvedFrequency::isolated(orbit.clone()))?;
        Ok(orbit)
    }

    /// Row of a peak that was found.
    pub(super) fn row(&self, mut orbit: Orbit, observation: usize) -> PeakAt {
        ShorterSides::new(&self.reduced.pairs).judge_orbit(&mut orbit);
        self.judge(&mut orbit);
        PeakAt {
            value: self.value,
            orbit,
            linear_m: self.linear_m(observation),
        }
    }

    /// Largest amplitude of the linear reference.
    fn linear_m(&self, observation: usize) -> Option<f64> {
        let linear = &self.state.linear;
        let linear = linear.problem(&self.reduced.problem, self.damping);
        let system = ContactSystem::new(&linear, self.damping);
        let [from_hz, to_hz] = self.settings.frequencies_hz[..] else {
            return None;
        };
        let even_hz = smooth_curve_frequencies_hz(from_hz, to_hz);
        let harmonics = self.reduced.problem.highest_excited().max(1);
        let points = linear_curve(&system, harmonics, &even_hz).into_iter();
        let amplitudes = points.map(|point| point.observed_amplitude[observation]);
        amplitudes.reduce(f64::max).filter(|most| *most > 0.0)
    }
}

/// Search for peaks over a range.
struct Search<'a, 'o, F> {
    range: &'a PeakRange<'a>,
    scene_at: F,
    source: Source,
    session: &'a Session<'o>,
    /// Number of the observed displacement.
    observation: usize,
    /// Model of the value that was solved last.
    at: Option<ModelAtValue>,
    missing: Vec<(f64, Error)>,
    /// Number of motions that were solved for.
    solved: &'a AtomicUsize,
}

/// Value, and the highest peak of its whole curve.
type OfCurve = (f64, Result<PeakAt, Error>);
/// Peaks found, and the values between which another resonance becomes the higher one.
type Found = (Vec<PeakAt>, Vec<[f64; 2]>);

impl<E: From<Error>, F: Fn(f64) -> Result<Scene, E>> Search<'_, '_, F> {
    /// Makes the model of a value, where it is not that of the value before.
    fn go_to(&mut self, value: f64, scene: Scene) -> Result<(), Error> {
        if self.at.as_ref().is_none_or(|at| at.value != value) {
            self.at = Some(self.model(value, scene)?);
        }
        Ok(())
    }

    /// Model of a value. All models but the first are made without a word.
    fn model(&self, value: f64, scene: Scene) -> Result<ModelAtValue, Error> {
        let (scene, source) = ((value, scene), &self.source);
        let made = if self.at.is_none() && self.range.start.is_none() {
            ModelAtValue::new(scene, source, None, self.session)
        } else {
            let (mut store, mut nobody) = (self.session.store(), ());
            let silent = Session::new(&mut nobody, &mut **store);
            ModelAtValue::new(scene, source, self.at.as_ref(), &silent)
        };
        self.session.check_running()?;
        made
    }

    /// Place of a value, in which peaks are smooth.
    fn place(&self, value: f64) -> f64 {
        if self.range.logarithmic {
            value.ln()
        } else {
            value
        }
    }

    fn value_at(&self, place: f64) -> f64 {
        if self.range.logarithmic {
            place.exp()
        } else {
            place
        }
    }

    /// Peak of a value, as [`ModelAtValue::find`] finds it; an error where it has no model or no
    /// peak.
    fn find(&mut self, value: f64, near: Option<&Guess>) -> Result<Result<PeakAt, Error>, E> {
        self.session.check_running()?;
        let scene = (self.scene_at)(value)?;
        let made = self.go_to(value, scene);
        self.session.check_running()?;
        let at = made.and_then(|()| self.at.as_ref().ok_or(Error::NoPeak));
        let (observation, count) = (self.observation, counting(self.solved, self.session));
        let peak = at.and_then(|at| {
            let orbit = at.find(near, observation, self.session, &count)?;
            let peak = at.row(orbit, observation);
            self.session.report(&Event::Peak {
                reduced: &at.reduced,
                observation,
                peak: &peak,
            })?;
            Ok(peak)
        });
        self.session.check_running()?;
        match peak {
            Err(Error::Stopped) => Err(Error::Stopped.into()),
            peak => Ok(peak),
        }
    }

    /// A peak that was found. A value without one is noted.
    fn noted(&mut self, value: f64, found: Result<PeakAt, Error>) -> Option<PeakAt> {
        found
            .map_err(|error| self.missing.push((value, error)))
            .ok()
    }

    /// Peak of a value near those of others; that of its whole curve where none is found there.
    fn find_near(&mut self, value: f64, known: &[PeakAt]) -> Result<Option<PeakAt>, E> {
        let guess = (self.guess(value, known)).or_else(|| self.range.start.map(Guess::from_peak));
        let peak = self.find(value, guess.as_ref())?;
        Ok(self.noted(value, peak))
    }

    /// Motion of a value on the line through the two peaks that are nearest to it.
    fn guess(&self, value: f64, known: &[PeakAt]) -> Option<Guess> {
        let place = self.place(value);
        let far = |row: &&PeakAt| (self.place(row.value) - place).abs();
        let mut nearest: Vec<&PeakAt> = known.iter().collect();
        nearest.sort_by(|a, b| far(a).total_cmp(&far(b)));
        match nearest[..] {
            [] => None,
            [only] => Some(Guess::from_peak(&only.orbit)),
            [first, second, ..] => {
                let [a, b] = [first, second].map(|row| self.place(row.value));
                let ends = [&first.orbit, &second.orbit];
                // No farther beyond them than they are apart.
                let place = ((place - a) / (b - a)).clamp(-1.0, 2.0);
                Some(Guess::interpolated(ends, place))
            }
        }
    }

    /// Peaks of all values asked for, from the first one, and back from the last one where another
    /// resonance is the higher one there.
    fn find_all(&mut self) -> Result<Found, E> {
        let observation = self.observation;
        let (mut rows, mut of_last) = self.ascending()?;
        let mut changes = Vec::new();
        let mut others = Vec::new();
        while let Some(last) = rows.last().filter(|_| self.range.values.len() > 1) {
            let value = last.value;
            let peak = match of_last.take().filter(|(of, _)| *of == value) {
                Some((_, found)) => found,
                None => self.find(value, None)?,
            };
            // The peak that was followed may not be the highest point of the curve.
            let is_unknown = matches!(
                peak,
                Err(Error::PeakOutside { .. } | Error::ResonanceNotComputed { .. })
            );
            if !is_unknown {
                others.extend(peak);
                break;
            }
            self.noted(value, peak);
            rows.pop();
        }
        let is_higher = |other: &PeakAt, row: &PeakAt| {
            other.amplitude_m(observation) > (1.0 + OTHER) * row.amplitude_m(observation)
        };
        for row in rows.iter_mut().rev() {
            let other = match others.iter().find(|other| other.value == row.value) {
                Some(other) => Some(other.clone()),
                None => self.find_near(row.value, &others)?,
            };
            let higher = other.filter(|other| is_higher(other, row));
            let Some(higher) = higher else {
                if let Some(before) = others.last() {
                    changes.extend((before.value > row.value).then_some([row.value, before.value]));
                }
                break;
            };
            others.retain(|other| other.value != higher.value);
            others.push(higher.clone());
            *row = higher;
        }
        Ok((rows, changes))
    }

    /// Peaks of all values asked for, each from those before, and, found at the same time, that of
    /// the whole curve of the last value.
    fn ascending(&mut self) -> Result<(Vec<PeakAt>, Option<OfCurve>), E> {
        let (session, values, observation) = (self.session, self.range.values, self.observation);
        let steps = session.steps(values.len(), "peaks");
        let last = match values {
            [_, .., last] => self.model(*last, (self.scene_at)(*last)?).ok(),
            _ => None,
        };
        session.check_running()?;
        // Both at the same time take twice the memory; else the whole curve comes last.
        let last = last.filter(|at| memory::check_available(2 * at.bytes).is_ok());
        let count = counting(self.solved, self.session);
        let mut of_last = None;
        let rows = rayon::in_place_scope(|scope| {
            if let Some(at) = last {
                let of_last = &mut of_last;
                scope.spawn(move |_| {
                    let top = at.find(None, observation, session, &count);
                    *of_last = Some((at.value, top.map(|top| at.row(top, observation))));
                });
            }
            let mut rows: Vec<PeakAt> = Vec::new();
            for value in values {
                rows.extend(self.find_near(*value, &rows)?);
                steps.step();
            }
            Ok::<_, E>(rows)
        })?;
        match of_last {
            Some((_, Err(Error::Stopped))) => Err(Error::Stopped.into()),
            of_last => Ok((rows, of_last)),
        }
    }

    /// Adds values near the least peak, where it is inside of the range. Returns its value.
    fn least(&mut self, rows: &mut Vec<PeakAt>) -> Result<Option<f64>, E> {
        let observation = self.observation;
        for _ in 0..MOST_ADDED {
            let amplitudes = rows.iter().map(|row| row.amplitude_m(observation));
            let least = amplitudes.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((least, _)) = least.filter(|(i, _)| 0 < *i && i + 1 < rows.len()) else {
                return Ok(None);
            };
            let least_value = rows[least].value;
            let three = [least - 1, least, least + 1].map(|i| {
                let row = &rows[i];
                (self.place(row.value), -row.amplitude_m(observation))
            });
            let (gain, shift) = vertex(three);
            if gain <= -LEAST_GAIN * three[1].1 {
                return Ok(Some(least_value));
            }
            let value = self.value_at(three[1].0 + inside(shift, three.map(|t| t.0)));
            let Some(added) = self.find_near(value, rows)? else {
                return Ok(Some(least_value));
            };
            insert(rows, added);
        }
        let least = |a: &&PeakAt, b: &&PeakAt| {
            let [a, b] = [a, b].map(|row| row.amplitude_m(observation));
            a.total_cmp(&b)
        };
        Ok(rows.iter().min_by(least).map(|row| row.value))
    }

    /// Adds values at which the peak has the amplitude that is looked for. Returns them.
    fn reached(&mut self, rows: &mut Vec<PeakAt>) -> Result<Vec<f64>, E> {
        let observation = self.observation;
        let Some(amplitude_m) = self.range.amplitude_m else {
            return Ok(Vec::new());
        };
        let above = |row: &PeakAt| (row.amplitude_m(observation) / amplitude_m).ln();
        let pairs: Vec<[PeakAt; 2]> = (rows.windows(2))
            .filter(|two| (above(&two[0]) < 0.0) != (above(&two[1]) < 0.0))
            .map(|two| [two[0].clone(), two[1].clone()])
            .collect();
        let mut reached = Vec::new();
        for two in pairs {
            // Regula falsi; the value of an end that stays is halved (Illinois).
            let [mut low, mut high] = two.map(|row| (self.place(row.value), above(&row)));
            for _ in 0..MOST_ADDED {
                let place = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
                let Some(added) = self.find_near(self.value_at(place), rows)? else {
                    break;
                };
                let off = above(&added);
                let value = added.value;
                insert(rows, added);
                if off.abs() < REACHED {
                    reached.push(value);
                    break;
                }
                if (off < 0.0) == (low.1 < 0.0) {
                    (low, high.1) = ((place, off), 0.5 * high.1);
                } else {
                    (high, low.1) = ((place, off), 0.5 * low.1);
                }
            }
        }
        Ok(reached)
    }
}

/// Listener that counts the motions that are solved for, and stops where the run has ended.
pub(super) fn counting(
    solved: &AtomicUsize,
    session: &Session<'_>,
) -> impl Fn(SweepProgress<'_>) + Sync + Copy {
    move |told: SweepProgress<'_>| match told {
        SweepProgress::Solved(_) => {
            solved.fetch_add(1, Ordering::Relaxed);
        }
        SweepProgress::Next(stop) => session.stop_if_ended(stop),
        SweepProgress::Tries(_) | SweepProgress::Apart => {}
    }
}

/// Highest peak of the whole curve. Of a given number of harmonics it alone has an estimate of its
/// error; an accuracy chooses the harmonics of each motion by its estimate.
fn highest(
    at: &ModelAtValue,
    observation: usize,
    tell: &(dyn Fn(SweepProgress<'_>) + Sync),
) -> Result<Orbit, Error> {
    let problem = &at.reduced.problem;
    let mut settings = at.settings.clone();
    settings.estimates = matches!(settings.resolution, Resolution::Accuracy(_));
    let mut curve = follow(problem, at.damping, &at.state, &settings, &[], tell);
    let top = largest_amplitude(&curve, observation).ok_or(Error::NoPeak)?;
    if let Some([from_hz, to_hz]) = uncomputed_resonance(&curve, observation) {
        return Err(Error::ResonanceNotComputed { from_hz, to_hz });
    }
    let is_end = |c: Range<usize>| top.index == c.start || top.index + 1 == c.end;
    if (curve.curves().into_iter()).any(|c| c.contains(&top.index) && is_end(c)) {
        let frequency_hz = top.frequency_hz;
        return Err(Error::PeakOutside { frequency_hz });
    }
    let top = curve.orbits.swap_remove(top.index);
    if settings.estimates {
        return Ok(top);
    }
    Ok(estimated(problem, at.damping, &at.state, &settings, &top))
}

/// Puts a row in its place among those that ascend in value.
fn insert(rows: &mut Vec<PeakAt>, added: PeakAt) {
    let place = rows.partition_point(|row| row.value < added.value);
    rows.insert(place, added);
}
