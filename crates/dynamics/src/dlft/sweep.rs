//! Frequency response: the static state, then one harmonic balance per frequency.
//!
//! The frequencies are split in two halves, each swept from its end of the range towards the
//! middle: two cores share the work, and the answer does not depend on how many there are. A half
//! is swept in stretches. What only speeds up the solution is dropped at the end of each, so that
//! an interrupted sweep continues there, with nothing but the frequencies that it has solved, to
//! the same bits.

use super::accuracy::{Refinement, Resolved, levels};
use super::balance::Setting;
use super::eps::Eps;
use super::gross_slip::free_slips_m;
use super::linear_curve::linear_curve;
use super::orbit::{linear_point, orbit};
use super::pair_signals::Periods;
use super::point::{FrequencySolver, Neighbour, Solution, SolverWork};
use super::retention::Holding;
use super::{Branch, Orbit, Outcome, Response, SolvedFrequency, StaticState, Stop, SweepProgress};
use crate::damping::Rayleigh;
use crate::dlft::settings::{EpsChoice, Resolution, Solver};
use crate::problem::Problem;
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::problem::inexact::InexactModel;
use dovetail_numerics::nonlinear::NewtonOptions;
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Number of frequencies of a stretch.
const STRETCH: usize = 20;

/// Settings of a frequency response.
#[derive(Debug, Clone, serde::Serialize)]
#[non_exhaustive]
pub struct SweepSettings {
    /// Frequencies of the response, Hz, ascending.
    pub frequencies_hz: Vec<f64>,
    /// Harmonics and samples, or the accuracy asked for.
    pub resolution: Resolution,
    /// The parameter eps of DLFT.
    pub eps: Eps,
    /// Criteria that end the iterations of a frequency.
    pub newton: NewtonOptions,
    /// Periods that pairs are marched through.
    pub periods: Periods,
    /// Method that solves the balance of a frequency.
    pub solver: Solver,
    /// Slip threshold, m; `None`: that of `StaticState::slip_threshold_m`.
    pub slip_threshold_m: Option<f64>,
    /// Seconds after which a frequency is given up, which makes the result depend on the machine.
    /// `None`: no limit.
    pub most_seconds: Option<f64>,
    /// True to estimate the error of each motion. Without estimates an accuracy is not judged: a
    /// motion keeps the number of harmonics that it is begun with.
    pub estimates: bool,
}

impl SweepSettings {
    /// Most Newton iterations of one attempt at a frequency.
    pub const MOST_ITERATIONS: usize = 60;

    /// Settings for these frequencies alone, with the defaults of a scene: eps from the dynamic
    /// stiffness, Newton-Krylov to the tolerance of the resolution, pairs marched until they are
    /// periodic.
    ///
    /// ```
    /// use dovetail_dynamics::dlft::settings::Resolution;
    /// use dovetail_dynamics::dlft::sweep::SweepSettings;
    ///
    /// let settings = SweepSettings::new(vec![440.0, 450.0], Resolution::Accuracy(0.01));
    /// assert_eq!(settings.newton.tolerance, 1e-6);
    /// ```
    pub fn new(frequencies_hz: Vec<f64>, resolution: Resolution) -> Self {
        Self {
            frequencies_hz,
            resolution,
            eps: Eps::new(EpsChoice::default()),
            newton: NewtonOptions::new(resolution.tolerance(), Self::MOST_ITERATIONS),
            periods: Periods::UntilPeriodic,
            solver: Solver::default(),
            slip_threshold_m: None,
            most_seconds: None,
            estimates: true,
        }
    }
}

/// Computes the response at every frequency, each by itself from the one before. What the curve does
/// between two of them, and whether another motion exists at one, is not looked for
/// ([`follow`](super::branch::follow) does).
///
/// `earlier` are frequencies that an interrupted sweep of the same model with the same settings
/// solved, in any order. They are not solved again, except for those of an incomplete stretch.
/// `tell` is called from any thread, for each frequency that is solved, `earlier` ones included,
/// and once more for one that is solved again. It may stop the sweep ([`SweepProgress::Next`]).
pub fn sweep(
    problem: &Problem,
    damping: Rayleigh,
    static_state: &StaticState,
    settings: &SweepSettings,
    earlier: &[SolvedFrequency],
    tell: &(dyn Fn(SweepProgress<'_>) + Sync),
) -> Response {
    SweepSolvers::new(problem, damping, static_state, settings, earlier, tell)
        .sweep_both_ends(settings)
}

/// Solves the only frequency of `settings` as a sweep does, where the model changes from frequency to
/// frequency. `last` is what the frequencies before it, which have the same pairs, leave to start
/// from; `point` is the number of the frequency.
pub fn solve_after(
    last: &SweepState,
    point: usize,
    problem: &Problem,
    damping: Rayleigh,
    static_state: &StaticState,
    settings: &SweepSettings,
    tell: &(dyn Fn(SweepProgress<'_>) + Sync),
) -> Option<SolvedFrequency> {
    let frequency_hz = *settings.frequencies_hz.first()?;
    let at = NumberedFrequency {
        point,
        frequency_hz,
    };
    let run = SweepSolvers::new(problem, damping, static_state, settings, &[], tell);
    Some(run.point(at, last, &mut SolverWork::default()))
}

/// Angular frequency in the middle of the range, rad/s. It serves for the whole curve, so that eps
/// and the first attempts are the same along it.
fn middle(frequencies_hz: &[f64]) -> f64 {
    let ends = frequencies_hz.first().zip(frequencies_hz.last());
    ends.map_or(0.0, |(from, to)| TAU * 0.5 * (from + to))
}

/// State of a sweep: the last converged frequency, and the level to begin the next on.
#[derive(Debug, Default)]
pub struct SweepState {
    neighbour: Option<Neighbour>,
    level: usize,
}

impl SweepState {
    /// Moves on to a frequency that is solved.
    pub fn follow(&mut self, solved: &SolvedFrequency) {
        if solved.orbit.outcome.is_balanced() {
            let neighbour = Neighbour::from_orbit(&solved.orbit, self.neighbour.as_ref());
            *self = Self {
                neighbour: Some(neighbour),
                level: solved.next_level,
            };
        }
    }
}

/// Returns `true` if a motion is closer to an answer than another at the same frequency.
fn is_better(orbit: &Orbit, than: &Orbit) -> bool {
    match (orbit.outcome.has_motion(), than.outcome.has_motion()) {
        (true, true) => orbit.estimated_error < than.estimated_error,
        (has_motion, _) => has_motion,
    }
}

/// Solvers and data that the frequencies of a response share.
pub(super) struct SweepSolvers<'a> {
    /// Linear reference.
    pub(super) linear: ContactSystem,
    /// Solvers of a frequency, by the number of harmonics.
    pub(super) refinement: Arc<Refinement<'a>>,
    /// Frequencies solved by an earlier sweep, by [`SolvedFrequency::place`].
    earlier: HashMap<(usize, bool), &'a SolvedFrequency>,
    /// Time limit of a frequency, as in [`SweepSettings`].
    pub(super) most_seconds: Option<f64>,
    /// True if errors are estimated, as in [`SweepSettings`].
    estimates: bool,
    /// True if powers and contact forces ask for harmonics, too.
    pub(super) judges_figures: bool,
    /// Listener to the solution.
    pub(super) tell: &'a (dyn Fn(SweepProgress<'_>) + Sync),
    stop: Stop,
    /// Distance beyond which a pair counts as slipping, m.
    pub(super) slip_threshold_m: f64,
}

/// A frequency, and a level of solvers ([`super::accuracy`]) for it.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrequencyOnLevel {
    pub(super) frequency_hz: f64,
    pub(super) level: usize,
}

/// A frequency of a response with its number, as [`Orbit::point`] has it.
#[derive(Debug, Clone, Copy)]
pub(super) struct NumberedFrequency {
    pub(super) point: usize,
    pub(super) frequency_hz: f64,
}

impl NumberedFrequency {
    /// Frequency of a motion.
    pub(super) fn from_orbit(orbit: &Orbit) -> Self {
        Self {
            point: orbit.point,
            frequency_hz: orbit.frequency_hz,
        }
    }
}

impl<'a> SweepSolvers<'a> {
    /// Run of a model about its static state. `earlier` and `tell` are those of [`sweep`].
    pub(super) fn new(
        problem: &Problem,
        damping: Rayleigh,
        static_state: &StaticState,
        settings: &SweepSettings,
        earlier: &'a [SolvedFrequency],
        tell: &'a (dyn Fn(SweepProgress<'_>) + Sync),
    ) -> Self {
        let system = Arc::new(ContactSystem::new(problem, damping));
        let omega = middle(&settings.frequencies_hz);
        let levels = levels(
            settings.resolution,
            problem.highest_excited(),
            |harmonics| settings.eps.values(&system, omega, harmonics),
        );
        let (fourier, eps) = levels[0].fourier_and_eps();
        let slip_threshold_m = settings
            .slip_threshold_m
            .unwrap_or_else(|| static_state.slip_threshold_m(eps));
        let inexact = InexactModel::new(&problem.reduced).into();
        let mut setting = Setting {
            periods: settings.periods,
            slip_threshold_m,
            ..Setting::new(
                static_state,
                system,
                inexact,
                Arc::clone(fourier),
                Arc::clone(eps),
            )
        };
        setting.free_slips_m = free_slips_m(&setting, omega).into();
        let (newton, solver) = (settings.newton, settings.solver);
        let holding = Holding::new(problem).into();
        let lowest = FrequencySolver::new(setting, newton, solver, holding, tell);
        let linear = lowest.setting.frozen.on_modes().clone();
        let earlier = earlier.iter();
        Self {
            linear,
            refinement: Refinement::new(&lowest, &levels, settings.resolution).into(),
            earlier: earlier.map(|solved| (solved.place(), solved)).collect(),
            slip_threshold_m,
            most_seconds: settings.most_seconds,
            estimates: settings.estimates,
            judges_figures: true,
            tell,
            stop: Stop::default(),
        }
    }

    /// The same for a curve that is followed, whose harmonics its amplitudes ask for. With more
    /// harmonics a curve on which pairs open has more corners than it can be followed round.
    pub(super) fn along_a_curve(mut self) -> Self {
        self.judges_figures = false;
        self
    }

    /// Solves one frequency by `solve`, on the level of `begin` or above it, and judges the solution.
    pub(super) fn resolve(
        &self,
        refinement: &Refinement<'_>,
        begin: FrequencyOnLevel,
        work: &mut SolverWork,
        solve: impl Fn(&FrequencySolver<'_>, &mut SolverWork) -> Solution,
    ) -> Resolved {
        let (level, solved) = refinement.solve(begin.level, work, solve);
        let at = FrequencyOnLevel { level, ..begin };
        self.judged(refinement, at, solved, work)
    }

    /// Judges a solution of a level of solvers by its estimated error, where errors are estimated.
    pub(super) fn judged(
        &self,
        refinement: &Refinement<'_>,
        at: FrequencyOnLevel,
        solved: Solution,
        work: &mut SolverWork,
    ) -> Resolved {
        if self.estimates {
            refinement.refined(at.frequency_hz, at.level, solved, self.judges_figures, work)
        } else {
            Resolved::unestimated(at.level, solved)
        }
    }

    /// Returns `true` if errors are estimated.
    pub(super) fn estimates(&self) -> bool {
        self.estimates
    }

    /// Asks the listener before a frequency is solved. Returns `false` once it has stopped the sweep.
    pub(super) fn should_continue(&self) -> bool {
        (self.tell)(SweepProgress::Next(&self.stop));
        !self.stop.is_stopped()
    }

    /// Sweeps the frequencies from both ends.
    fn sweep_both_ends(&self, settings: &SweepSettings) -> Response {
        let frequencies_hz = &settings.frequencies_hz;
        let middle = frequencies_hz.len().div_ceil(2);
        let numbered = frequencies_hz.iter().enumerate();
        let points: Vec<NumberedFrequency> = numbered
            .map(|(point, &frequency_hz)| NumberedFrequency {
                point,
                frequency_hz,
            })
            .collect();
        let (rising, falling) = points.split_at(middle);
        let falling: Vec<NumberedFrequency> = falling.iter().rev().copied().collect();
        let (mut solved, upper) = rayon::join(|| self.half(rising), || self.half(&falling));
        solved.extend(upper.into_iter().rev());
        if solved.len() == frequencies_hz.len() {
            self.retry_from_other_side(&mut solved, middle);
        }
        let (orbits, linear): (Vec<Orbit>, Vec<_>) =
            solved.into_iter().map(|s| (s.orbit, s.linear)).unzip();
        Response {
            linear,
            linear_curve: linear_curve(&self.linear, self.harmonics(), frequencies_hz),
            branches: vec![Branch::swept(orbits.len())],
            orbits,
            second_motions: Vec::new(),
            bifurcations: Vec::new(),
            two_periods: Vec::new(),
            slip_threshold_m: self.slip_threshold_m,
        }
    }

    /// Points that an earlier run solved along one of the two branches, in the order of solution.
    pub(super) fn earlier_points(&self, from_last: bool) -> Vec<&SolvedFrequency> {
        let is_of =
            |s: &&SolvedFrequency| s.along.as_ref().is_some_and(|a| a.from_last == from_last);
        let mut found: Vec<&SolvedFrequency> =
            self.earlier.values().copied().filter(is_of).collect();
        found.sort_by_key(|solved| solved.orbit.point);
        found
    }

    /// Harmonics of the lowest level.
    pub(super) fn harmonics(&self) -> usize {
        self.refinement.lowest().setting.fourier.harmonics()
    }

    /// Sweeps half of the range; `points` are its frequencies in the order of the sweep.
    fn half(&self, points: &[NumberedFrequency]) -> Vec<SolvedFrequency> {
        let mut last = SweepState::default();
        let mut half = Vec::with_capacity(points.len());
        for stretch in points.chunks(STRETCH) {
            let mut work = SolverWork::default();
            let earlier = |point: &NumberedFrequency| self.solved_before(*point, false);
            let known: Option<Vec<&SolvedFrequency>> = stretch.iter().map(earlier).collect();
            for (i, point) in stretch.iter().enumerate() {
                if !self.should_continue() {
                    return half;
                }
                let solved = match &known {
                    Some(known) => known[i].clone(),
                    None => self.point(*point, &last, &mut work),
                };
                last.follow(&solved);
                (self.tell)(SweepProgress::Solved(&solved));
                half.push(solved);
            }
        }
        half
    }

    fn point(
        &self,
        at: NumberedFrequency,
        last: &SweepState,
        work: &mut SolverWork,
    ) -> SolvedFrequency {
        work.start_counting(self.most_seconds);
        let frequency_hz = at.frequency_hz;
        let begin = FrequencyOnLevel {
            frequency_hz,
            level: last.level,
        };
        let resolved = self.resolve(&self.refinement, begin, work, |level, work| {
            level.solve(frequency_hz, last.neighbour.as_ref(), work)
        });
        self.solved_at(at, resolved, work)
    }

    /// Record of a frequency that is solved by itself.
    fn solved_at(
        &self,
        at: NumberedFrequency,
        resolved: Resolved,
        work: &SolverWork,
    ) -> SolvedFrequency {
        SolvedFrequency {
            next_level: resolved.next_level,
            orbit: self.orbit_of(&self.refinement, resolved, at, work),
            linear: linear_point(&self.linear, self.harmonics(), at.frequency_hz),
            again: false,
            along: None,
        }
    }

    /// Frequency that an earlier sweep solved.
    fn solved_before(&self, at: NumberedFrequency, again: bool) -> Option<&SolvedFrequency> {
        let solved = self.earlier.get(&(at.point, again)).copied()?;
        (solved.orbit.frequency_hz == at.frequency_hz).then_some(solved)
    }

    /// Solves each frequency that did not converge once more, from the neighbour on its other side:
    /// the rising half downwards, then the falling half (from `middle`) upwards.
    fn retry_from_other_side(&self, all: &mut [SolvedFrequency], middle: usize) {
        let mut work = SolverWork::default();
        let downwards = (0..middle).rev().map(|i| (i, i + 1));
        let upwards = (middle..all.len()).map(|i| (i, i.wrapping_sub(1)));
        for (i, beside) in downwards.chain(upwards) {
            if !self.should_continue() {
                return;
            }
            let Some(neighbour) = all.get(beside) else {
                continue;
            };
            let (failed, neighbour) = (&all[i], &neighbour.orbit);
            let earlier = self
                .solved_before(NumberedFrequency::from_orbit(&failed.orbit), true)
                .cloned();
            let again = earlier.or_else(|| self.solve_again(failed, neighbour, &mut work));
            if let Some(again) = again {
                (self.tell)(SweepProgress::Solved(&again));
                all[i] = again;
            }
        }
    }

    /// Solves a frequency that did not converge once more, from a neighbour that has a motion, or an
    /// accurate one where only the accuracy is missing, with at least as many harmonics as that one.
    /// Returns the better of both motions; `None` if it was not tried.
    fn solve_again(
        &self,
        failed: &SolvedFrequency,
        neighbour: &Orbit,
        work: &mut SolverWork,
    ) -> Option<SolvedFrequency> {
        let orbit = &failed.orbit;
        let may_converge = match orbit.outcome {
            Outcome::Converged
            | Outcome::NoStaticEquilibrium
            | Outcome::SlidesTooFar
            | Outcome::NothingHolds => false,
            Outcome::Stagnated
            | Outcome::IterationLimit
            | Outcome::NotPeriodic
            | Outcome::NotFinite
            | Outcome::TimeLimit => neighbour.outcome.is_balanced(),
            Outcome::AccuracyNotReached => neighbour.outcome.is_converged(),
        };
        if !may_converge {
            return None;
        }
        let frequency_hz = orbit.frequency_hz;
        let level = if orbit.outcome.has_motion() {
            self.refinement.level_of(neighbour.harmonics)
        } else {
            0
        };
        let neighbour = Neighbour::from_orbit(neighbour, None);
        work.start_counting(self.most_seconds);
        let begin = FrequencyOnLevel {
            frequency_hz,
            level,
        };
        let resolved = self.resolve(&self.refinement, begin, work, |level, work| {
            level.solve_from(frequency_hz, &neighbour, work)
        });
        let solved = self.solved_at(NumberedFrequency::from_orbit(orbit), resolved, work);
        let mut kept = match is_better(&solved.orbit, orbit) {
            true => solved.clone(),
            false => failed.clone(),
        };
        kept.again = true;
        kept.orbit.newton_iterations = orbit.newton_iterations + solved.orbit.newton_iterations;
        kept.orbit.krylov_iterations = orbit.krylov_iterations + solved.orbit.krylov_iterations;
        let residuals = [&orbit.newton_residuals[..], &solved.orbit.newton_residuals];
        kept.orbit.newton_residuals = residuals.concat();
        Some(kept)
    }

    pub(super) fn orbit_of(
        &self,
        refinement: &Refinement<'_>,
        resolved: Resolved,
        at: NumberedFrequency,
        work: &SolverWork,
    ) -> Orbit {
        let Solution {
            balance,
            u,
            evaluation,
            end,
        } = resolved.solved;
        let mut outcome = Outcome::from(end.status);
        if outcome.is_converged() && evaluation.ends.iter().any(|e| !e.periodic) {
            outcome = Outcome::NotPeriodic;
        } else if !outcome.is_converged()
            && refinement
                .lowest()
                .excitation_exceeds_contact(at.frequency_hz)
        {
            outcome = Outcome::NoStaticEquilibrium;
        } else if outcome.is_converged() && !resolved.is_accurate {
            outcome = Outcome::AccuracyNotReached;
        }
        let mut orbit = resolved
            .orbit
            .unwrap_or_else(|| orbit(&balance, &u, &evaluation, at.frequency_hz, outcome));
        orbit.outcome = outcome;
        orbit.point = at.point;
        orbit.residual = end.measure;
        orbit.estimated_error = resolved.estimated_errors.iter().copied().reduce(f64::max);
        orbit.observed_error = resolved.estimated_errors;
        orbit.figure_errors = resolved.figure_errors;
        orbit
            .observed_error
            .truncate(orbit.observed_amplitude.len());
        orbit.newton_iterations = work.newton_iterations;
        orbit.newton_residuals = work.residuals.clone();
        orbit.krylov_iterations = work.krylov_iterations;
        orbit
    }
}

#[cfg(test)]
mod of_a_mass;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::made_up::recorded;
    use crate::dlft::static_state::static_state;
    use crate::problem::dovetail72::{damping, dovetail72};

    /// Static state and a sweep to where all pairs slip, with the harmonics that an accuracy needs.
    fn computed(threads: usize) -> (StaticState, Response) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let problem = dovetail72(3.0);
            let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
            let damping = damping(&problem);
            let frequencies_hz = [0.985, 0.99, 0.995, 1.0].map(|r| r * first_hz).to_vec();
            let settings = SweepSettings::new(frequencies_hz, Resolution::Accuracy(0.03));
            let state = static_state(&problem, 10, settings.newton);
            let response = sweep(&problem, damping, &state, &settings, &[], &|_| ());
            (state, response)
        })
    }

    #[test]
    fn static_state_and_response_do_not_depend_on_the_number_of_threads() {
        let [one, three] = [1, 3].map(computed);
        assert!(one.0.outcome.is_converged());
        let mut converged = one.1.orbits.iter().map(|o| o.outcome.is_converged());
        assert!(converged.all(|c| c));
        let sliding = |c: &&crate::dlft::PairCycle| c.slid_m > one.1.slip_threshold_m;
        let slipping = |o: &Orbit| o.cycles.iter().filter(sliding).count();
        assert!(one.1.orbits.iter().any(|o| slipping(o) == o.cycles.len()));
        // The texts of numbers that differ in a bit differ, those of zeros by their sign.
        assert!(format!("{one:?}") == format!("{three:?}"));
    }

    /// Frequencies of a sweep beside each of them alone, at which most pairs slip.
    #[test]
    fn the_estimated_error_of_a_motion_does_not_depend_on_the_way_to_it() {
        let problem = dovetail72(1.5);
        let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
        let damping = damping(&problem);
        let all_hz: Vec<f64> = (0..8)
            .map(|i| first_hz * (0.991 + 1.5e-3 * f64::from(i)))
            .collect();
        let swept = |frequencies_hz: &[f64]| {
            let fixed = Resolution::fixed(1, 64);
            let settings = SweepSettings::new(frequencies_hz.to_vec(), fixed);
            let state = static_state(&problem, 10, settings.newton);
            sweep(&problem, damping, &state, &settings, &[], &|_| ()).orbits
        };
        let mut compared = 0;
        for orbit in swept(&all_hz) {
            let [alone] = &swept(&[orbit.frequency_hz])[..] else {
                panic!();
            };
            let ratio = |of: fn(&Orbit) -> f64| (of(&orbit) / of(alone) - 1.0).abs();
            // Another motion has other means.
            if ratio(|o| o.observed_amplitude[0]) < 1e-5 {
                compared += 1;
                let apart = ratio(|o| o.estimated_error.unwrap());
                assert!(apart < 0.01, "{} Hz: {apart}", orbit.frequency_hz);
            }
        }
        assert!(compared > 3, "{compared}");
    }

    /// Both halves are interrupted within their first or second stretch or between both, and the
    /// records of a half come in the order in which it was swept.
    #[test]
    fn a_sweep_that_was_broken_off_goes_on_to_the_same_bits() {
        let problem = dovetail72(3.0);
        let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
        let frequencies_hz: Vec<f64> = (0..60)
            .map(|i| first_hz * (0.984 + 3.3e-4 * f64::from(i)))
            .collect();
        let middle = frequencies_hz[30];
        let settings = SweepSettings::new(frequencies_hz, Resolution::fixed(1, 32));
        let state = static_state(&problem, 10, settings.newton);
        let damping = damping(&problem);
        let run = |earlier: &[SolvedFrequency]| {
            recorded(|tell| sweep(&problem, damping, &state, &settings, earlier, tell))
        };
        let (whole, records) = run(&[]);
        assert_eq!(records.len(), 60);
        for (rising, falling) in [(27, 29), (20, 3), (0, 20)] {
            let is_rising = |s: &&SolvedFrequency| s.orbit.frequency_hz < middle;
            let (of_rising, of_falling): (Vec<_>, Vec<_>) = records.iter().partition(is_rising);
            let taken = of_rising.into_iter().take(rising);
            let mut earlier: Vec<SolvedFrequency> = taken
                .chain(of_falling.into_iter().take(falling))
                .cloned()
                .collect();
            for solved in &mut earlier {
                solved.orbit.krylov_iterations += MARK;
            }
            let (mut resumed, told) = run(&earlier);
            assert_eq!(told.len(), 60);
            let marked = resumed.orbits.iter_mut();
            let marked = marked.filter(|o| o.krylov_iterations >= MARK);
            let taken = marked.map(|o| o.krylov_iterations -= MARK).count();
            // Those of complete stretches: 20, 10.
            assert_eq!(taken, rising / 20 * 20 + falling / 20 * 20);
            assert!(format!("{whole:?}") == format!("{resumed:?}"));
        }
    }

    /// Marks a frequency that was solved before, to tell it from one that is solved again.
    const MARK: usize = 1_000_000;
}
