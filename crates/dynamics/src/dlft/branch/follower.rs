//! Follower of one branch: it begins at an end of the range, takes steps, and goes on behind a gap
//! where the curve is lost (`gap`).
//!
//! `tops` and `fold_between` find where a peak or a fold lies between points, and `refinement` adds
//! points there. `stretches` goes on from what an interrupted run solved.

mod fold_between;
mod gap;
mod refinement;
mod stretches;
mod tops;

use self::stretches::STRETCH;
use super::followed::Followed;
use super::over::{ContinuationParameter, FrequencyParameter, SolutionAt, Solvers};
use super::trace::{Asked, Course, CurvePoint, CurveSolution, Tracer};
use super::values::Values;
use crate::dlft::accuracy::Resolved;
use crate::dlft::orbit::orbit;
use crate::dlft::point::{Neighbour, Solution, SolverWork};
use crate::dlft::sweep::{FrequencyOnLevel, NumberedFrequency, SweepSolvers};
use crate::dlft::{BranchPosition, Orbit, Outcome, Part, SolvedFrequency, SweepProgress};

/// Points from which a peak is looked for.
const RECENT: usize = 3;
/// A peak is behind the last point where the amplitude is this fraction below the largest one.
const FALLEN: f64 = 0.005;
/// Most points on the way to a peak.
const MOST_CLIMBED: usize = 200;

/// Follower of a branch, which can be stopped on the way.
pub(crate) struct Follower<'b> {
    run: &'b SweepSolvers<'b>,
    /// Values that the curve is followed over; `None` for the frequency.
    values: Option<&'b Values<'b>>,
    course: Course,
    /// Abscissae at which motions are asked for.
    asked: Vec<f64>,
    /// `true` for the branch that begins at the last abscissa of the range.
    pub from_last: bool,
    /// Abscissae of points of another branch: where this one passes them, its motions are compared.
    pub compared: Vec<f64>,
    /// Branch as far as it is followed.
    pub branch: Followed,
    tracer: Option<Tracer>,
    /// Last points of the curve, added ones included: three between two steps.
    recent: Vec<CurvePoint>,
    /// Length of the curve up to which the slopes of its points told of its peaks.
    searched: f64,
    level: usize,
    /// Number of the step.
    step: usize,
    /// Number of points solved, and at the end of the last stretch.
    solved: usize,
    stretch_from: usize,
    /// Abscissa at which the next motion is looked for where no curve is followed.
    next: f64,
    /// Motion from which the first point is solved for, where one is known.
    guess: Option<Neighbour>,
    /// `true` once the branch has left the range.
    has_left: bool,
    work: SolverWork,
}

impl<'b> Follower<'b> {
    /// Follower of the branch that begins where the course does, with the points of it that an
    /// earlier run solved.
    pub(crate) fn new(
        run: &'b SweepSolvers<'b>,
        values: Option<&'b Values<'b>>,
        course: Course,
        asked: &[f64],
        from_last: bool,
    ) -> Self {
        let mut new = Self {
            run,
            values,
            course,
            asked: asked.to_vec(),
            from_last,
            compared: Vec::new(),
            recent: Vec::new(),
            searched: 0.0,
            branch: Followed::default(),
            tracer: None,
            level: 0,
            step: 0,
            solved: 0,
            stretch_from: 0,
            next: course.from,
            guess: None,
            has_left: false,
            work: SolverWork::default(),
        };
        new.restore();
        new
    }

    /// Begins the branch near a motion, on a level, in place of the static state.
    pub(crate) fn begin_near(mut self, near: Neighbour, level: usize) -> Self {
        self.guess = Some(near);
        self.level = level;
        self
    }

    /// Quantity that the curve is followed over, for one step.
    fn parameter(&self) -> Box<dyn ContinuationParameter + 'b> {
        match self.values {
            None => Box::new(FrequencyParameter(self.run)),
            Some(values) => {
                let near = self.tracer.as_ref().map(|tracer| tracer.last().abscissa);
                Box::new(values.parameter(near))
            }
        }
    }

    /// Follows the branch until it leaves the range, or until a step passes `stop`.
    pub(crate) fn advance(&mut self, stop: Option<f64>) {
        let Course { from, to } = self.course;
        let toward = (to - from).signum();
        let is_at = |at: f64| (self.branch.points.iter()).any(|p| p.abscissa() == at);
        if stop.is_some_and(is_at) {
            return;
        }
        while !self.has_left && self.branch.given_up.is_none() && self.run.should_continue() {
            if self.branch.creeps(self.course.range()) {
                self.branch.given_up = self.branch.points.len().checked_sub(1);
                return;
            }
            let stops = if self.tracer.is_some() {
                self.step(&*self.parameter(), stop)
            } else {
                let known = self.branch.points.len();
                self.find_start(&*self.parameter());
                let begun = self.next;
                self.has_left = begun == to;
                if self.branch.points.len() > known {
                    self.skip_failed_start();
                } else {
                    self.skip_missing_model(begun);
                }
                stop.is_some_and(|stop| toward * (begun - stop) >= 0.0)
            };
            self.step += 1;
            if self.tracer.is_some() && self.solved >= self.stretch_from + STRETCH {
                self.begin_stretch(&*self.parameter());
            }
            if stops {
                return;
            }
        }
    }

    /// Returns `true` if the branch has come to the other end of its range without a gap.
    pub(crate) fn has_crossed(&self) -> bool {
        let last = self.branch.points.last();
        let is_at_end = last.is_some_and(|last| last.abscissa() == self.course.to);
        self.has_left && is_at_end && self.branch.gaps.is_empty()
    }

    /// Returns `true` if there is a motion at the beginning of the branch.
    pub(crate) fn has_begun(&self) -> bool {
        let first = self.branch.points.first();
        first.is_some_and(|first| first.orbit.outcome.has_motion())
    }

    /// Follows the branch from a motion near it, on a level, to a peak of an observed amplitude:
    /// towards larger amplitudes, until the amplitude has fallen on the other side of the peak.
    /// Returns the peak and its level; `None` where the branch leaves the range or is lost before.
    pub(crate) fn follow_to_peak(
        &mut self,
        near: &Neighbour,
        level: usize,
        observation: usize,
    ) -> Option<(Orbit, usize)> {
        let Course { from, to } = self.course;
        self.next = near.frequency_hz.clamp(from, to);
        self.level = level;
        self.guess = Some(near.clone());
        self.find_start(&*self.parameter());
        self.tracer.as_mut()?.head_for_peak(observation)?;
        self.recent.clear();
        self.remember();
        while self.tracer.is_some()
            && !self.has_left
            && self.solved < MOST_CLIMBED
            && self.run.should_continue()
        {
            self.step(&*self.parameter(), None);
            let amplitude = |p: &SolvedFrequency| p.orbit.observed_amplitude[observation];
            let amplitudes: Vec<f64> = self.branch.points.iter().map(amplitude).collect();
            let (highest, most) =
                (amplitudes.iter().copied().enumerate()).max_by(|a, b| a.1.total_cmp(&b.1))?;
            if *amplitudes.last()? <= (1.0 - FALLEN) * most {
                let peak = self.branch.points.swap_remove(highest).orbit;
                return peak.outcome.has_motion().then_some((peak, self.level));
            }
        }
        None
    }

    /// Looks for a motion to follow, on from where the branch was lost.
    fn find_start(&mut self, over: &dyn ContinuationParameter) {
        let run = self.run;
        let last = self.branch.points.last();
        let last = last.filter(|p| p.orbit.outcome.is_balanced());
        let last = last.map(|p| Neighbour::from_orbit(&p.orbit, None));
        let neighbour = last.or_else(|| self.guess.take());
        let at = self.next;
        let Some(refinement) = over.refinement(at) else {
            return;
        };
        let frequency_hz = over.frequency_hz(at);
        self.work.start_counting(run.most_seconds);
        let begin = FrequencyOnLevel {
            frequency_hz,
            level: self.level,
        };
        let outcome = run.resolve(&refinement, begin, &mut self.work, |level, work| {
            level.solve(frequency_hz, neighbour.as_ref(), work)
        });
        self.level = outcome.level;
        if outcome.solved.is_converged() && self.course.range() > 0.0 {
            let level = outcome.level;
            let solvers = Solvers { over, level };
            let begun = SolutionAt {
                solution: &outcome.solved,
                abscissa: at,
            };
            self.tracer = Tracer::start(solvers, self.course, begun, &mut self.work);
        }
        let length = self.branch.lengths.last().copied().unwrap_or(0.0);
        self.recent.clear();
        if let Some(tracer) = &mut self.tracer {
            tracer.set_length(length);
        }
        self.record(over, outcome, at, length, Part::Begun);
        self.remember();
    }

    /// Takes a step along the curve. Returns `true` where it passes `stop`.
    fn step(&mut self, over: &dyn ContinuationParameter, stop: Option<f64>) -> bool {
        let run = self.run;
        let Some(mut tracer) = self.tracer.take() else {
            return false;
        };
        self.work.start_counting(run.most_seconds);
        let mut asked = self.asked.clone();
        asked.extend(stop);
        let mut compared = self.branch.revisitable();
        compared.extend(&self.compared);
        let asked = Asked {
            each: &asked,
            last: &compared,
        };
        let creeps = self.branch.is_stalling();
        let step = loop {
            let mut ahead = tracer.clone();
            let step = ahead.step(over, &asked, creeps, &mut self.work);
            if !self.meets_itself(over, &step.passed) {
                tracer = ahead;
                break step;
            }
            if !tracer.shorten() {
                self.skip_gap(self.branch.farthest(self.course.from));
                return false;
            }
        };
        let stops = stop.is_some_and(|stop| step.passed.iter().any(|p| p.abscissa == stop));
        let level = self.level;
        let solvers = Solvers { over, level };
        for found in step.passed {
            let CurveSolution {
                solution,
                abscissa,
                length,
            } = found;
            let work = &mut self.work;
            if let Some(solution) = solvers.curve_solution(abscissa, solution, work)
                && let Some(resolved) = run.judged_at(solvers, abscissa, solution, work)
            {
                self.record(over, resolved, abscissa, length, Part::Passed);
            }
            self.work.start_counting(run.most_seconds);
        }
        if step.leaves {
            self.has_left = true;
            return stops;
        }
        let Some(found) = step.reached else {
            self.skip_gap(tracer.last().abscissa);
            return false;
        };
        let (at, length) = (found.abscissa, found.length);
        let mean = found.solution.balance.mean();
        let Some(solved) = solvers.curve_solution(at, found.solution, &mut self.work) else {
            tracer.step_back();
            self.skip_gap(tracer.last().abscissa);
            return false;
        };
        let same_mean = solved.balance.mean() == mean;
        let Some(resolved) = run.judged_at(solvers, at, solved, &mut self.work) else {
            self.skip_gap(at);
            return false;
        };
        let resolved = self.with_fewer_harmonics(over, at, resolved);
        if same_mean && resolved.level == self.level {
            self.tracer = Some(tracer);
        } else {
            self.level = resolved.level;
            let level = self.level;
            let solvers = Solvers { over, level };
            self.tracer = tracer.restart(solvers, &resolved.solved, &mut self.work);
            if self.tracer.is_none() {
                self.skip_gap(at);
            }
        }
        self.record(over, resolved, at, length, Part::Reached);
        self.remember();
        self.refine_fold(over);
        self.refine_peaks(over);
        stops
    }

    /// Returns `true` if one of these solutions is an earlier point of the branch.
    fn meets_itself(&self, over: &dyn ContinuationParameter, passed: &[CurveSolution]) -> bool {
        passed.iter().any(|found| {
            let Solution {
                balance,
                u,
                evaluation,
                ..
            } = &found.solution;
            let harmonics = balance.setting.fourier.harmonics();
            let points = self.branch.points.iter();
            let mut there = points
                .filter(|p| p.abscissa() == found.abscissa && p.orbit.harmonics == harmonics)
                .peekable();
            // Figures are computed only for a comparison.
            there.peek().is_some() && {
                let frequency_hz = over.frequency_hz(found.abscissa);
                let orbit = orbit(balance, u, evaluation, frequency_hz, Outcome::Converged);
                there.any(|p| p.orbit.has_same_vibration(&orbit))
            }
        })
    }

    /// The solution with the harmonics of the level below, where these are plenty for it, as they were
    /// for the last point; else the solution itself.
    fn with_fewer_harmonics(
        &mut self,
        over: &dyn ContinuationParameter,
        abscissa: f64,
        resolved: Resolved,
    ) -> Resolved {
        let (level, lower) = (resolved.level, resolved.next_level);
        let plenty = |p: &SolvedFrequency| {
            let Orbit {
                harmonics,
                estimated_error,
                ..
            } = p.orbit;
            self.run
                .refinement
                .neighbour_level(harmonics, estimated_error)
                < level
        };
        let (Some(refinement), true) = (
            over.refinement(abscissa),
            lower < level && self.branch.points.last().is_some_and(plenty),
        ) else {
            return resolved;
        };
        let (frequency_hz, solved) = (over.frequency_hz(abscissa), &resolved.solved);
        let near =
            Neighbour::following(None, frequency_hz, solved.u.clone(), solved.balance.mean());
        let work = &mut self.work;
        let found = refinement
            .level(lower)
            .solve_from(frequency_hz, &near, work);
        let at = FrequencyOnLevel {
            frequency_hz,
            level: lower,
        };
        let found = self.run.judged(&refinement, at, found, work);
        if found.level < level && found.is_accurate {
            found
        } else {
            resolved
        }
    }

    /// Keeps the last point of the curve, and those before it from which peaks are looked for. An
    /// amplitude that misses its accuracy is no place to look for a peak from.
    fn remember(&mut self) {
        let last = self.branch.points.last().map(|p| &p.orbit);
        if let (Some(tracer), Some(orbit)) = (&self.tracer, last) {
            remember(&mut self.recent, tracer.last(), orbit.outcome);
        }
    }

    /// Records a point that is solved.
    fn record(
        &mut self,
        over: &dyn ContinuationParameter,
        resolved: Resolved,
        abscissa: f64,
        length: f64,
        part: Part,
    ) {
        let (run, frequency_hz) = (self.run, over.frequency_hz(abscissa));
        let Some(refinement) = over.refinement(abscissa) else {
            return;
        };
        // Both branches number their points by turns.
        let at = NumberedFrequency {
            point: 2 * self.solved + usize::from(self.from_last),
            frequency_hz,
        };
        self.solved += 1;
        let followed = self.tracer.as_ref();
        let followed = followed.filter(|_| matches!(part, Part::Begun | Part::Reached));
        let solved = SolvedFrequency {
            next_level: resolved.level,
            orbit: run.orbit_of(&refinement, resolved, at, &self.work),
            linear: over.linear_point(abscissa),
            again: false,
            along: Some(BranchPosition {
                from_last: self.from_last,
                step: self.step,
                part,
                abscissa,
                length,
                heading: followed.map(Tracer::heading),
            }),
        };
        (run.tell)(SweepProgress::Solved(&solved));
        self.branch.keep(solved);
    }
}

/// Adds a point to the last ones, as [`Follower::remember`] does.
fn remember(recent: &mut Vec<CurvePoint>, point: &CurvePoint, outcome: Outcome) {
    if !outcome.is_converged() {
        recent.clear();
        return;
    }
    let before = recent.drain(..).map(|p| p.resized(point.u.len()));
    *recent = before.chain([point.clone()]).collect();
}

impl SweepSolvers<'_> {
    /// Judges a solution of a level at an abscissa; `None` where there is no model.
    fn judged_at(
        &self,
        solvers: Solvers<'_>,
        abscissa: f64,
        solved: Solution,
        work: &mut SolverWork,
    ) -> Option<Resolved> {
        let refinement = solvers.over.refinement(abscissa)?;
        let at = FrequencyOnLevel {
            frequency_hz: solvers.over.frequency_hz(abscissa),
            level: solvers.level,
        };
        Some(self.judged(&refinement, at, solved, work))
    }
}
