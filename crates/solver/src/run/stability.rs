//! Stability of the motions of a response: which of them are judged, where it changes along a curve,
//! and where an unstable peak leads.

use super::error::Error;
use super::session::{Session, Stage};
use crate::damping::Rayleigh;
use crate::dlft::branch::folds;
use crate::dlft::settings::StabilityScope;
use crate::dlft::sweep::{SweepSettings, SweepState, solve_after};
use crate::dlft::{Bifurcation, Orbit, Response, SolvedFrequency, StaticState};
use crate::integration::departure::{Departure, depart};
use crate::problem::Problem;
use crate::results::peak::{largest_amplitude, local_peaks, unstable_peaks};
use crate::stability::{Kind, Reason, Stability, Verdict, judge, two_periods};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::time::Instant;

/// Most pairs of a model all of whose motions are judged without being asked for.
const FEW_PAIRS: usize = 12;
/// Most solutions that a change of stability is located by.
const LOCATING: usize = 16;
/// Relative distance of the frequencies on both sides of a change at which it is located.
const LOCATED: f64 = 1e-4;
/// Relative change of an amplitude at which an integration has left a motion.
const LEFT: f64 = 0.02;
/// Most periods that an unstable peak is followed for.
const DEPARTING: usize = 1000;

/// Model whose motions are judged.
#[derive(Debug, Clone, Copy)]
pub struct Judged<'a> {
    /// Reduced model, laws and excitations.
    pub problem: &'a Problem,
    /// Damping of the bodies.
    pub damping: Rayleigh,
    /// Static state that the motions are about.
    pub state: &'a StaticState,
    /// Motions that are judged.
    pub scope: StabilityScope,
}

impl Judged<'_> {
    /// Judges one motion that was found by itself, such as a peak.
    pub(super) fn judge(&self, orbit: &mut Orbit) {
        if self.scope != StabilityScope::None && orbit.stability == Stability::default() {
            orbit.stability = judge(self.problem, self.damping, self.state, orbit);
        }
    }

    /// Judges the motions of a response that the scope names, those at `named_hz`, and those between
    /// two with different verdicts until the change lies between neighbours. Along a curve that was
    /// followed by these settings the change is located. Responses of twice the period are followed
    /// where `until` is given, not beyond this instant.
    pub fn judge_response(
        &self,
        response: &mut Response,
        named_hz: &[f64],
        settings: &SweepSettings,
        until: Option<Instant>,
    ) {
        let pairs = self.problem.laws.len();
        let chosen = points_to_judge(response, self.scope, pairs, named_hz);
        self.judge_points(response, &chosen);
        let changes = self.changes(response);
        response.bifurcations = match response.is_followed() {
            true => (changes.par_iter())
                .filter_map(|change| self.located(response, *change, settings))
                .collect(),
            false => Vec::new(),
        };
        if let Some(until) = until {
            self.follow_two_periods(response, settings, until);
        }
    }

    /// Follows the responses of twice the period to which the period doublings of a response lead, with
    /// integrations in time that end before an instant. Returns these, each with the position of its
    /// motion.
    pub(super) fn follow_two_periods(
        &self,
        response: &mut Response,
        settings: &SweepSettings,
        until: Instant,
    ) -> Vec<(usize, Departure)> {
        let ends = || Instant::now() > until;
        let (mut branches, mut departures) = (Vec::<Response>::new(), Vec::new());
        for at in doubled_motions(response) {
            let orbit = &response.orbits[at];
            let has = |branch: &Response| {
                let hz = branch.orbits.iter().map(|orbit| 2.0 * orbit.frequency_hz);
                let [least, most] = [f64::min, f64::max].map(|end| hz.clone().reduce(end));
                least <= Some(orbit.frequency_hz) && Some(orbit.frequency_hz) <= most
            };
            if ends() || branches.iter().any(has) {
                continue;
            }
            let (problem, damping, state) = (self.problem, self.damping, self.state);
            if let Ok(departure) = depart(problem, damping, orbit, DEPARTING, &ends) {
                branches.extend(two_periods(problem, damping, state, settings, &departure));
                departures.push((at, departure));
            }
        }
        response.two_periods = branches;
        departures
    }

    /// Judges the motions at these positions that have no verdict.
    fn judge_points(&self, response: &mut Response, points: &[usize]) {
        let orbits = &response.orbits;
        let is_open = |at: &&usize| orbits[**at].stability == Stability::default();
        let open: Vec<usize> = points.iter().filter(is_open).copied().collect();
        let one = |at: &usize| judge(self.problem, self.damping, self.state, &orbits[*at]);
        let verdicts: Vec<_> = open.par_iter().map(one).collect();
        for (at, verdict) in open.into_iter().zip(verdicts) {
            response.orbits[at].stability = verdict;
        }
    }

    /// Neighbouring points of each curve with different verdicts. Points between two that were judged
    /// are judged in turn, each in the middle, until they are neighbours but for those without a
    /// verdict.
    fn changes(&self, response: &mut Response) -> Vec<[usize; 2]> {
        let mut changes = Vec::new();
        for curve in response.curves() {
            let judged: Vec<usize> = curve
                .filter(|at| response.orbits[*at].stability.is_stable().is_some())
                .collect();
            for two in judged.windows(2) {
                let [mut from, mut to] = [two[0], two[1]];
                let verdict =
                    |response: &Response, at: usize| response.orbits[at].stability.is_stable();
                let before = verdict(response, from);
                if before == verdict(response, to) {
                    continue;
                }
                while from + 1 < to {
                    let middle = usize::midpoint(from, to);
                    self.judge_points(response, &[middle]);
                    match verdict(response, middle) {
                        None => break,
                        found if found == before => from = middle,
                        _ => to = middle,
                    }
                }
                changes.push([from, to]);
            }
        }
        changes
    }

    /// Change of stability between two points of a curve; `None` where it is a fold, which has its own
    /// list.
    fn located(
        &self,
        response: &Response,
        [from, to]: [usize; 2],
        settings: &SweepSettings,
    ) -> Option<Bifurcation> {
        let [a, b] = [from, to].map(|at| &response.orbits[at]);
        let kind = a.stability.kind().or(b.stability.kind())?;
        let mut folds = folds(response).into_iter();
        if kind == Kind::Real && folds.any(|fold| (from..=to).contains(&fold)) {
            return None;
        }
        let mut ends = [Side::of(a)?, Side::of(b)?];
        for _ in 0..LOCATING {
            let apart = (ends[1].orbit.frequency_hz / ends[0].orbit.frequency_hz - 1.0).abs();
            if apart < LOCATED {
                break;
            }
            let Some(between) = self.between(&ends, settings) else {
                break;
            };
            let is_first = between.is_stable() == ends[0].is_stable();
            ends[usize::from(!is_first)] = between;
        }
        let share = ends[0].growth / (ends[0].growth - ends[1].growth);
        let between = |of: &dyn Fn(&Orbit) -> f64| {
            let [a, b] = ends.each_ref().map(|side| of(&side.orbit));
            a + share * (b - a)
        };
        let amplitude = |i: usize| between(&|orbit| orbit.observed_amplitude[i]);
        Some(Bifurcation {
            after: from,
            frequency_hz: between(&|orbit| orbit.frequency_hz),
            observed_amplitude: (0..a.observed_amplitude.len()).map(amplitude).collect(),
            kind,
        })
    }

    /// Motion at the frequency in the middle of both sides of a change; `None` where none is found that
    /// lies between them. The growth is no smooth function: two multipliers meet before one leaves.
    fn between(&self, [a, b]: &[Side; 2], settings: &SweepSettings) -> Option<Side> {
        let [from_hz, to_hz] = [a, b].map(|side| side.orbit.frequency_hz);
        let mut settings = settings.clone();
        settings.frequencies_hz = vec![0.5 * (from_hz + to_hz)];
        let mut last = SweepState::default();
        last.follow(&SolvedFrequency::isolated(a.orbit.clone()));
        let solved = solve_after(
            &last,
            0,
            self.problem,
            self.damping,
            self.state,
            &settings,
            &|_| (),
        )?;
        let mut orbit = solved.orbit;
        let amplitudes = [&a.orbit, &b.orbit].map(|orbit| &orbit.observed_amplitude);
        let is_near = orbit.observed_amplitude.iter().enumerate().all(|(i, own)| {
            let [a, b] = amplitudes.map(|of| of[i]);
            let apart = (b - a).abs();
            (a.min(b) - apart..=a.max(b) + apart).contains(own)
        });
        if !orbit.outcome.has_motion() || !is_near {
            return None;
        }
        self.judge(&mut orbit);
        Side::of(&orbit)
    }

    /// Integrates from the peak of each observed displacement that is unstable, not beyond an instant,
    /// unless it is one of the `known` departures. A motion that cannot be integrated has no entry. The
    /// verdict on a motion that the integration contradicts is withdrawn.
    ///
    /// # Errors
    /// [`Error::Stopped`] by the observer.
    pub(super) fn departures(
        &self,
        response: &mut Response,
        mut known: Vec<(usize, Departure)>,
        until: Instant,
        session: &Session<'_>,
    ) -> Result<Vec<Departure>, Error> {
        let observations = response.orbits.iter().map(|o| o.observed_amplitude.len());
        let observations = observations.max().unwrap_or(0);
        let unstable = unstable_peaks(response, observations);
        if unstable.is_empty() {
            return Ok(Vec::new());
        }
        let _stage = session.titled_stage(
            Stage::TimeIntegration,
            "time integration from an unstable peak",
        );
        let ends = || Instant::now() > until || session.check_running().is_err();
        let mut departures = Vec::new();
        for at in unstable {
            let orbit = &mut response.orbits[at];
            let known = known
                .iter()
                .position(|(of, _)| *of == at)
                .map(|i| known.swap_remove(i));
            let departure = match known {
                Some((_, departure)) => Ok(departure),
                None => depart(self.problem, self.damping, orbit, DEPARTING, &ends),
            };
            match departure {
                Ok(found) if stays(orbit, found.periods, &found.amplitude_range_m) => {
                    orbit.stability.verdict = Verdict::NotJudged(Reason::Stays);
                }
                Ok(found) => departures.push(found),
                Err(_) => {}
            }
        }
        session.check_running()?;
        Ok(departures)
    }
}

/// Position of the motion with the largest multiplier in each stretch of a curve that has doubled its
/// period.
fn doubled_motions(response: &Response) -> Vec<usize> {
    let mut chosen = Vec::new();
    for curve in response.curves() {
        let judged = curve.filter(|at| response.orbits[*at].stability.is_stable().is_some());
        let judged: Vec<usize> = judged.collect();
        let kind = |at: usize| response.orbits[at].stability.kind();
        let modulus = |at: &usize| {
            let multiplier = response.orbits[*at].stability.multiplier;
            multiplier.map_or(0.0, |m| m.norm())
        };
        let stretches = judged.chunk_by(|a, b| kind(*a) == kind(*b));
        let doubled = stretches.filter(|part| kind(part[0]) == Some(Kind::PeriodDoubling));
        let largest = doubled.filter_map(|part| {
            let points = part.iter().copied();
            points.max_by(|a, b| modulus(a).total_cmp(&modulus(b)))
        });
        chosen.extend(largest);
    }
    chosen
}

/// Returns `true` if an integration over so many periods, with amplitudes in these ranges, stays on a
/// motion although its perturbation, of 0.1 %, should have grown to the size of the motion.
fn stays(orbit: &Orbit, periods: usize, amplitude_range_m: &[[f64; 2]]) -> bool {
    let multiplier = orbit.stability.multiplier;
    let growth = multiplier.map_or(0.0, |m| periods as f64 * m.norm().ln());
    let mut amplitudes = amplitude_range_m.iter().zip(&orbit.observed_amplitude);
    let is_near = |[least, most]: &[f64; 2], own: &f64| {
        (least / own - 1.0).abs() < LEFT && (most / own - 1.0).abs() < LEFT
    };
    growth > 1000f64.ln() && amplitudes.all(|(range, own)| is_near(range, own))
}

/// One side of a change of stability.
struct Side {
    orbit: Orbit,
    /// Logarithm of the largest multiplier: below zero where perturbations die away.
    growth: f64,
}

impl Side {
    /// Side of a motion with a verdict.
    fn of(orbit: &Orbit) -> Option<Self> {
        let growth = orbit.stability.multiplier?.norm().ln();
        let is_known = orbit.stability.is_stable()? == (growth < 0.0) && growth.is_finite();
        is_known.then(|| Self {
            orbit: orbit.clone(),
            growth,
        })
    }

    fn is_stable(&self) -> bool {
        self.growth < 0.0
    }
}

/// Positions of the motions of a response that a scope names, ascending. `pairs` is the number of pairs of
/// the model.
pub(super) fn points_to_judge(
    response: &Response,
    scope: StabilityScope,
    pairs: usize,
    named_hz: &[f64],
) -> Vec<usize> {
    match scope {
        StabilityScope::None => Vec::new(),
        StabilityScope::Peaks if pairs > FEW_PAIRS => points_that_matter(response, named_hz),
        _ => (0..response.orbits.len()).collect(),
    }
}

/// Positions of the motions at the ends of each curve, at its folds, at the local maxima of each
/// observed displacement, and at these frequencies.
fn points_that_matter(response: &Response, named_hz: &[f64]) -> Vec<usize> {
    let mut points: BTreeSet<usize> = folds(response).into_iter().collect();
    for curve in response.curves() {
        points.extend([curve.start, curve.end - 1]);
    }
    let orbits = response.orbits.iter().enumerate();
    let observations = orbits.clone().map(|(_, o)| o.observed_amplitude.len());
    for observation in 0..observations.max().unwrap_or(0) {
        points.extend(largest_amplitude(response, observation).map(|peak| peak.index));
        points.extend(
            local_peaks(response, observation)
                .iter()
                .map(|p| p.at.index),
        );
    }
    let named = orbits.filter(|(_, orbit)| named_hz.contains(&orbit.frequency_hz));
    points.extend(named.map(|(at, _)| at));
    points.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::{Branch, Outcome};
    use faer::c64;

    /// Response over 1, 2, ... Hz with these amplitudes.
    fn response(amplitudes_m: &[f64]) -> Response {
        let orbit = |(i, amplitude_m): (usize, &f64)| Orbit {
            observed_amplitude: vec![*amplitude_m],
            ..Orbit::motionless((i + 1) as f64, Outcome::Converged)
        };
        Response {
            orbits: amplitudes_m.iter().enumerate().map(orbit).collect(),
            branches: vec![Branch::swept(amplitudes_m.len())],
            ..Response::default()
        }
    }

    #[test]
    fn an_integration_that_stays_contradicts_a_fast_instability_alone() {
        let orbit = |multiplier: f64| Orbit {
            observed_amplitude: vec![2.0],
            stability: Stability {
                verdict: Verdict::Unstable(Kind::Real),
                multiplier: Some(c64::new(multiplier, 0.0)),
            },
            ..Orbit::motionless(1.0, Outcome::Converged)
        };
        let stays = |multiplier, range| stays(&orbit(multiplier), 100, &[range]);
        assert!(stays(1.5, [1.99, 2.01]));
        assert!(!stays(1.5, [1.9, 2.01]) && !stays(1.5, [1.99, 2.1]));
        // After 100 periods 0.1 % have become 0.27 %.
        assert!(!stays(1.01, [1.99, 2.01]));
    }

    #[test]
    fn peaks_ends_and_named_frequencies_are_judged_and_all_motions_of_few_pairs() {
        use StabilityScope::{EveryPoint, None, Peaks};
        let response = response(&[1.0, 2.0, 5.0, 2.0, 3.0, 2.0, 1.0]);
        let of = |scope, pairs, named: &[f64]| points_to_judge(&response, scope, pairs, named);
        assert_eq!(of(Peaks, 72, &[]), [0, 2, 4, 6]);
        assert_eq!(of(Peaks, 72, &[4.0]), [0, 2, 3, 4, 6]);
        assert_eq!(of(Peaks, FEW_PAIRS, &[]), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(of(EveryPoint, 72, &[]).len(), 7);
        assert!(of(None, 1, &[4.0]).is_empty());
    }
}
