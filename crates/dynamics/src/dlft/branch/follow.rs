//! Branches from both ends of a range of the abscissa, such as the frequency.

use super::over::{Over, OverFrequency, SolutionAt, Solvers};
use super::peak::Guess;
use super::several::several_motions;
use super::trace::{Course, FoldStart, Found, Height, MOST_SHORT_STEPS, Point, SHORT_STEP, Tracer};
use super::values::Values;
use crate::dlft::accuracy::Resolved;
use crate::dlft::balance::Balance;
use crate::dlft::linear_curve::linear_curve;
use crate::dlft::newton_krylov::step_length;
use crate::dlft::peaks::{inside, vertex};
use crate::dlft::point::{Neighbour, Solution, Work};
use crate::dlft::sweep::{FrequencyOnLevel, NumberedFrequency, Run};
use crate::dlft::{Along, Branch, Orbit, Outcome, Part, Response, SolvedFrequency, Told};
use std::f64::consts::TAU;

/// Most points of a branch.
const MOST_POINTS: usize = 5000;
/// Distance, as a fraction of the range, at which the next motion is looked for where a branch
/// cannot be followed.
const GAP: f64 = 0.005;
/// The same distance where no motion was found over a longer range, as a fraction of that range.
const GROWTH: f64 = 0.5;
/// Most points that are added at a peak or a fold.
const MOST_ADDED: usize = 8;
/// A peak is found where neither the cubic through two points and their slopes nor the parabola
/// through three points rises by more than this fraction above the highest of them.
const PEAK_ERROR: f64 = 2e-5;
/// Where no motion is found at a place of a peak, it is looked for this fraction of the way nearer to
/// the points on both sides.
const BESIDE: f64 = 0.05;
/// Points from which a peak is looked for.
const RECENT: usize = 3;
/// A fold is found where the tangents of the points on both sides of it meet no farther beyond them
/// than this fraction of the range.
const FOLD_ERROR: f64 = 2e-4;
/// Length from a point to a fold from which its tangent may lead past the fold.
const LONG_WAY: f64 = 0.05;
/// Parts of the range at whose ends the linear reference is known in any case.
const LINEAR_PARTS: usize = 200;
/// Two motions at one frequency are the same where they differ by less than this fraction.
const SAME: f64 = 1e-4;

/// A peak is behind the last point where the amplitude is this fraction below the largest one.
const FALLEN: f64 = 0.005;
/// Most points on the way to a peak.
const MOST_CLIMBED: usize = 200;

/// Frequencies of a stretch at least. At the end of one the follower goes on from what is recorded
/// of its points, with nothing else that only speeds up the solution: an interrupted run continues
/// there, to the same bits.
const STRETCH: usize = 20;

/// Branch as it is followed, in the order in which it runs.
#[derive(Debug, Clone, Default)]
struct Followed {
    /// Motions along the branch.
    points: Vec<SolvedFrequency>,
    /// Length of the branch up to each point.
    lengths: Vec<f64>,
    /// Numbers of the points before which the branch was lost, and a motion looked for anew.
    gaps: Vec<usize>,
}

impl Followed {
    /// The branch up to its first point at an abscissa; empty where there is none.
    fn until(&self, abscissa: f64) -> Self {
        let at = |p: &SolvedFrequency| p.abscissa() == abscissa;
        let count = self.points.iter().position(at).map_or(0, |i| i + 1);
        Self {
            points: self.points[..count].to_vec(),
            lengths: self.lengths[..count].to_vec(),
            gaps: self
                .gaps
                .iter()
                .copied()
                .filter(|gap| *gap < count)
                .collect(),
        }
    }

    /// The branch run through in the other direction.
    fn reversed(mut self) -> Self {
        let count = self.points.len();
        self.points.reverse();
        self.lengths.reverse();
        let whole = self.lengths.first().copied().unwrap_or(0.0);
        self.lengths.iter_mut().for_each(|l| *l = whole - *l);
        self.gaps.reverse();
        self.gaps.iter_mut().for_each(|gap| *gap = count - *gap);
        self
    }

    /// Returns `true` if its last steps were shorter than short ones.
    fn creeps(&self) -> bool {
        let before = self.lengths.iter().rev().nth(MOST_SHORT_STEPS);
        let last = self.lengths.last();
        let length = last.zip(before).map(|(last, before)| last - before);
        length.is_some_and(|length| length < MOST_SHORT_STEPS as f64 * SHORT_STEP)
    }

    /// Adds a branch that begins where this one ends.
    fn extend(&mut self, mut on: Self) {
        self.points.pop();
        let length = self.lengths.pop().unwrap_or(0.0);
        let count = self.points.len();
        self.lengths.extend(on.lengths.iter().map(|l| length + l));
        self.gaps.extend(on.gaps.iter().map(|gap| count + gap));
        self.points.append(&mut on.points);
    }
}

/// Follower of a branch, which can be stopped on the way.
struct Follower<'b> {
    run: &'b Run<'b>,
    /// Values that the curve is followed over; `None` for the frequency.
    values: Option<&'b Values<'b>>,
    course: Course,
    /// Abscissae at which motions are asked for.
    asked: &'b [f64],
    /// `true` for the branch that begins at the last abscissa of the range.
    from_last: bool,
    branch: Followed,
    tracer: Option<Tracer>,
    /// Last points of the curve, added ones included: three between two steps.
    recent: Vec<Point>,
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
    work: Work,
}

impl<'b> Follower<'b> {
    /// Follower of the branch that begins where the course does, with the points of it that an
    /// earlier run solved.
    fn new(
        run: &'b Run<'b>,
        values: Option<&'b Values<'b>>,
        course: Course,
        asked: &'b [f64],
        from_last: bool,
    ) -> Self {
        let mut new = Self {
            run,
            values,
            course,
            asked,
            from_last,
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
            work: Work::default(),
        };
        new.restore();
        new
    }

    /// Acts with the quantity that the curve is followed over.
    fn within<T>(&mut self, act: impl for<'x> FnOnce(&mut Self, &'x dyn Over<'x>) -> T) -> T {
        match self.values {
            None => act(self, &OverFrequency::of(self.run)),
            Some(values) => {
                let near = self.tracer.as_ref().map(|tracer| tracer.last().abscissa);
                values.within(near, |over| act(self, over))
            }
        }
    }

    /// Follows the branch until it leaves the range, or until a step passes `stop`.
    fn advance(&mut self, stop: Option<f64>) {
        let Course { from, to } = self.course;
        let toward = (to - from).signum();
        let is_at = |at: f64| (self.branch.points.iter()).any(|p| p.abscissa() == at);
        if stop.is_some_and(is_at) {
            return;
        }
        while !self.has_left && self.branch.points.len() < MOST_POINTS && self.run.goes_on() {
            let stops = if self.tracer.is_some() {
                self.within(|this, over| this.step(over, stop))
            } else {
                let known = self.branch.points.len();
                self.within(Self::begin);
                let begun = self.next;
                self.has_left = begun == to;
                if self.branch.points.len() > known {
                    self.look_beyond_begin();
                } else {
                    self.look_beyond_missing(begun);
                }
                stop.is_some_and(|stop| toward * (begun - stop) >= 0.0)
            };
            self.step += 1;
            if self.tracer.is_some() && self.solved >= self.stretch_from + STRETCH {
                self.within(Self::begin_stretch);
            }
            if stops {
                return;
            }
        }
    }

    /// Returns `true` if the branch has come to the other end of its range without a gap.
    fn has_crossed(&self) -> bool {
        let last = self.branch.points.last();
        let is_at_end = last.is_some_and(|last| last.abscissa() == self.course.to);
        self.has_left && is_at_end && self.branch.gaps.is_empty()
    }

    /// Returns `true` if there is a motion at the beginning of the branch.
    fn has_begun(&self) -> bool {
        let first = self.branch.points.first();
        first.is_some_and(|first| first.orbit.outcome.has_motion())
    }

    /// Takes over the stretches of the branch that an earlier run completed.
    fn restore(&mut self) {
        let earlier = self.run.earlier_along(self.from_last);
        let of = |solved: &SolvedFrequency| solved.along.as_ref().map_or(0, |along| along.step);
        let steps: Vec<&[&SolvedFrequency]> = earlier.chunk_by(|a, b| of(a) == of(b)).collect();
        let (mut complete, mut solved, mut stretch_from) = (0, 0, 0);
        // The last step may be incomplete.
        for (i, step) in steps.iter().enumerate().take(steps.len().saturating_sub(1)) {
            solved += step.len();
            let mut ends = step.iter().filter_map(|s| s.along.as_ref());
            let end = ends.rfind(|a| matches!(a.part, Part::Begun | Part::Reached));
            if solved >= stretch_from + STRETCH && end.is_some_and(|a| a.heading.is_some()) {
                (complete, stretch_from) = (i + 1, solved);
            }
        }
        for solved in steps[..complete].concat() {
            self.solved += 1;
            (self.run.tell)(Told::Solved(solved));
            self.branch.keep(solved.clone());
        }
        let last = self.branch.points.iter().filter_map(|p| p.along.as_ref());
        if let Some(last) = last.map(|a| a.step).max() {
            self.step = last + 1;
            self.within(Self::begin_stretch);
        }
    }

    /// Goes on from what is recorded of the last points alone.
    fn begin_stretch<'x>(&mut self, over: &'x dyn Over<'x>) {
        self.stretch_from = self.solved;
        self.work = Work::default();
        self.tracer = None;
        self.recent.clear();
        let of_curve =
            |p: &&SolvedFrequency| matches!(part_of(p), Some(Part::Begun | Part::Reached));
        let mut last: Vec<&SolvedFrequency> = Vec::new();
        for point in self.branch.points.iter().rev().filter(of_curve) {
            let begins = |after: &&SolvedFrequency| part_of(after) == Some(Part::Begun);
            if last.len() == RECENT || last.last().is_some_and(begins) {
                break;
            }
            last.push(point);
        }
        last.reverse();
        let Some(level) = last.last().map(|p| p.next_level) else {
            return;
        };
        self.level = level;
        let passed = self.branch.lengths.last().copied().unwrap_or(0.0);
        self.searched = passed;
        for point in last {
            let level = point.next_level;
            let before = self.tracer.take().map(|tracer| tracer.last().clone());
            let (course, work) = (self.course, &mut self.work);
            let solvers = Solvers { over, level };
            self.tracer = Tracer::resumed(solvers, course, point, before, passed, work);
            let Some(tracer) = &self.tracer else {
                break;
            };
            remember(&mut self.recent, tracer.last(), point.orbit.outcome);
        }
        self.look_beyond_begin();
        // No direction was found: the branch is lost where it came to, not where it began.
        if self.tracer.is_none()
            && let Some(last) = self.branch.points.last().map(SolvedFrequency::abscissa)
        {
            self.look_beyond(last);
        }
    }

    /// Follows the branch from a motion near it, on a level, to a peak of an observed amplitude:
    /// towards larger amplitudes, until the amplitude has fallen on the other side of the peak.
    /// Returns the peak and its level; `None` where the branch leaves the range or is lost before.
    fn climb(
        &mut self,
        near: &Neighbour,
        level: usize,
        observation: usize,
    ) -> Option<(Orbit, usize)> {
        let Course { from, to } = self.course;
        self.next = near.frequency_hz.clamp(from, to);
        self.level = level;
        self.guess = Some(near.clone());
        self.within(Self::begin);
        self.tracer.as_mut()?.climb(observation)?;
        self.recent.clear();
        self.remember();
        while self.tracer.is_some()
            && !self.has_left
            && self.solved < MOST_CLIMBED
            && self.run.goes_on()
        {
            self.within(|this, over| this.step(over, None));
            let amplitude = |p: &SolvedFrequency| p.orbit.observed_amplitude[observation];
            let amplitudes: Vec<f64> = self.branch.points.iter().map(amplitude).collect();
            let (highest, most) =
                (amplitudes.iter().copied().enumerate()).max_by(|a, b| a.1.total_cmp(&b.1))?;
            if *amplitudes.last()? <= (1.0 - FALLEN) * most {
                let found = self.branch.points.swap_remove(highest).orbit;
                return found.outcome.has_motion().then_some((found, self.level));
            }
        }
        None
    }

    /// Looks for a motion to follow, on from where the branch was lost.
    fn begin<'x>(&mut self, over: &'x dyn Over<'x>) {
        let run = self.run;
        let last = self.branch.points.last();
        let last = last.filter(|p| p.orbit.outcome.holds());
        let last = last.map(|p| Neighbour::of(&p.orbit, None));
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
        let found = run.resolve(refinement, begin, &mut self.work, |level, work| {
            level.solve(frequency_hz, neighbour.as_ref(), work)
        });
        self.level = found.level;
        if found.solved.is_converged() && self.course.range() > 0.0 {
            let level = found.level;
            let solvers = Solvers { over, level };
            let begun = SolutionAt {
                solution: &found.solved,
                abscissa: at,
            };
            self.tracer = Tracer::from(solvers, self.course, begun, &mut self.work);
        }
        let length = self.branch.lengths.last().copied().unwrap_or(0.0);
        self.recent.clear();
        if let Some(tracer) = &mut self.tracer {
            tracer.begin_at(length);
        }
        self.record(over, found, at, length, Part::Begun);
        self.remember();
    }

    /// Takes a step along the curve. Returns `true` where it passes `stop`.
    fn step<'x>(&mut self, over: &'x dyn Over<'x>, stop: Option<f64>) -> bool {
        let run = self.run;
        let Some(mut tracer) = self.tracer.take() else {
            return false;
        };
        self.work.start_counting(run.most_seconds);
        let mut asked = self.asked.to_vec();
        asked.extend(stop);
        let step = tracer.step(over, &asked, self.branch.creeps(), &mut self.work);
        let stops = stop.is_some_and(|stop| step.passed.iter().any(|p| p.abscissa == stop));
        let level = self.level;
        let solvers = Solvers { over, level };
        for found in step.passed {
            let Found {
                solution,
                abscissa,
                length,
            } = found;
            let work = &mut self.work;
            if let Some(solution) = solvers.on_curve(abscissa, solution, work)
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
            self.look_beyond(tracer.last().abscissa);
            return false;
        };
        let (at, length) = (found.abscissa, found.length);
        let mean = found.solution.balance.mean();
        let Some(solved) = solvers.on_curve(at, found.solution, &mut self.work) else {
            tracer.step_back();
            self.look_beyond(tracer.last().abscissa);
            return false;
        };
        let same_mean = solved.balance.mean() == mean;
        let Some(resolved) = run.judged_at(solvers, at, solved, &mut self.work) else {
            self.look_beyond(at);
            return false;
        };
        if same_mean && resolved.level == self.level {
            self.tracer = Some(tracer);
        } else {
            self.level = resolved.level;
            let level = self.level;
            let solvers = Solvers { over, level };
            self.tracer = tracer.again(solvers, &resolved.solved, &mut self.work);
            if self.tracer.is_none() {
                self.look_beyond(at);
            }
        }
        self.record(over, resolved, at, length, Part::Reached);
        self.remember();
        self.refine_fold(over);
        self.refine_peaks(over);
        stops
    }

    /// Keeps the last point of the curve, and those before it from which peaks are looked for. An
    /// amplitude that misses its accuracy is no place to look for a peak from.
    fn remember(&mut self) {
        let last = self.branch.points.last().map(|p| &p.orbit);
        if let (Some(tracer), Some(orbit)) = (&self.tracer, last) {
            remember(&mut self.recent, tracer.last(), orbit.outcome);
        }
    }

    /// Adds points where an observed amplitude has a peak between the last points, until nothing
    /// tells of a top above the highest of them.
    fn refine_peaks<'x>(&mut self, over: &'x dyn Over<'x>) {
        let observed = self.recent.first().map_or(0, |p| p.heights.len());
        for observation in 0..observed {
            for _ in 0..MOST_ADDED {
                let Some(Top { after, length, .. }) =
                    top_of_curve(&self.recent, self.searched, observation)
                else {
                    break;
                };
                let ends = [after, after + 1].map(|i| self.recent[i].clone());
                let [before, behind] = ends.each_ref().map(|end| end.length - length);
                // At a corner a motion beside it is found where the one on it is not.
                let tries = [
                    (0.0, false),
                    (BESIDE * before, false),
                    (BESIDE * behind, false),
                    (0.0, true),
                ];
                let found = tries.into_iter().find_map(|(off, may_retain)| {
                    let solve = |tracer: &Tracer, ends: [&Point; 2], length, work: &mut Work| {
                        tracer.inside(over, ends, length, may_retain, work)
                    };
                    self.add(over, solve, ends.each_ref(), length + off)
                });
                let Some(added) = found else {
                    break;
                };
                self.recent.insert(after + 1, added);
            }
        }
        let surplus = self.recent.len().saturating_sub(RECENT);
        self.recent.drain(..surplus);
        self.searched = self.recent.last().map_or(self.searched, |p| p.length);
    }

    /// Adds points where the curve folds between the last two points, until the tangents of those
    /// on both sides of the fold meet little beyond them.
    fn refine_fold<'x>(&mut self, over: &'x dyn Over<'x>) {
        let [.., before, after] = &self.recent[..] else {
            return;
        };
        let mut beside = [before.clone(), after.clone()];
        let rises = before.direction.abscissa;
        for _ in 0..MOST_ADDED {
            let error = FOLD_ERROR * self.course.range();
            let [first, second] = beside.each_ref();
            let ways = first.ways_to_meeting(second);
            let places = [first, second].map(|p| (p.abscissa, p.direction.abscissa));
            let Some(start) = fold_between(places, ways, error) else {
                return;
            };
            let solve = |tracer: &Tracer, ends: [&Point; 2], length, work: &mut Work| {
                tracer.beside_fold(over, ends, start, length, work)
            };
            let all = ways[0].max(0.0) + ways[1].max(0.0);
            let per_way = (second.length - first.length) / all;
            let length = match start {
                FoldStart::AheadOfFirst(way) => first.length + way * per_way,
                FoldStart::BehindSecond(way) => second.length - way * per_way,
            };
            let Some(added) = self.add(over, solve, [first, second], length) else {
                return;
            };
            let place = self.recent.partition_point(|p| p.length < added.length);
            self.recent.insert(place, added.clone());
            let is_after = added.direction.abscissa * rises < 0.0;
            beside[usize::from(is_after)] = added;
        }
    }

    /// Solves for the point of the curve at a length between two points.
    fn add<'x>(
        &mut self,
        over: &'x dyn Over<'x>,
        solve: impl Fn(&Tracer, [&Point; 2], f64, &mut Work) -> Option<Found<'x>>,
        ends: [&Point; 2],
        length: f64,
    ) -> Option<Point> {
        let run = self.run;
        let tracer = self.tracer.as_ref()?;
        self.work.start_counting(run.most_seconds);
        let work = &mut self.work;
        let mut found = solve(tracer, ends, length, work)?;
        let level = self.level;
        let solvers = Solvers { over, level };
        let (at, length) = (found.abscissa, found.length);
        found.solution = solvers.on_curve(at, found.solution, work)?;
        let point = tracer.point_at(over, &found, ends, work)?;
        let resolved = run.judged_at(solvers, at, found.solution, work)?;
        self.record(over, resolved, at, length, Part::Added);
        Some(point)
    }

    /// Looks for the next motion behind a gap after an abscissa.
    fn look_beyond(&mut self, abscissa: f64) {
        self.next = beyond(self.course, abscissa, self.gap(), self.next);
    }

    /// Width of a gap.
    fn gap(&self) -> f64 {
        GAP * self.course.range()
    }

    /// Looks for the next motion behind the abscissa at which one was looked for last: the farther,
    /// the longer none was found.
    fn look_beyond_begin(&mut self) {
        let is_begun = |p: &SolvedFrequency| part_of(p) == Some(Part::Begun);
        let Some(last) = self.branch.points.iter().rposition(is_begun) else {
            return;
        };
        let begun = self.branch.points[last].abscissa();
        self.look_farther(begun, last + 1);
    }

    /// Looks for the next motion behind an abscissa without a model.
    fn look_beyond_missing(&mut self, abscissa: f64) {
        self.look_farther(abscissa, self.branch.points.len());
    }

    /// Looks for the next motion behind an abscissa at which none was found, the farther, the longer
    /// none of the first `known` points has one.
    fn look_farther(&mut self, abscissa: f64, known: usize) {
        let mut before = self.branch.points[..known].iter().rev();
        let found = before.find(|p| p.orbit.outcome.holds());
        let found = found.map_or(self.course.from, SolvedFrequency::abscissa);
        let gap = (self.gap()).max(GROWTH * (abscissa - found).abs());
        self.next = beyond(self.course, abscissa, gap, abscissa);
    }

    /// Records a point that is solved.
    fn record<'x>(
        &mut self,
        over: &'x dyn Over<'x>,
        resolved: Resolved<'_>,
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
            orbit: run.orbit_of(refinement, resolved, at, &self.work),
            linear: over.linear_point(abscissa),
            again: false,
            along: Some(Along {
                from_last: self.from_last,
                step: self.step,
                part,
                abscissa,
                length,
                heading: followed.map(Tracer::heading),
            }),
        };
        (run.tell)(Told::Solved(&solved));
        self.branch.keep(solved);
    }
}

impl Followed {
    /// Adds a point, at its place along the branch.
    fn keep(&mut self, solved: SolvedFrequency) {
        let Self {
            points,
            lengths,
            gaps,
        } = self;
        let along = solved.along.as_ref();
        let part = part_of(&solved);
        let length = along.map_or(0.0, |a| a.length);
        if part == Some(Part::Begun) && !points.is_empty() {
            gaps.push(points.len());
        }
        let place = if part == Some(Part::Added) {
            lengths.partition_point(|l| *l < length)
        } else {
            points.len()
        };
        points.insert(place, solved);
        lengths.insert(place, length);
    }
}

/// Adds a point to the last ones, as [`Follower::remember`] does.
fn remember(recent: &mut Vec<Point>, point: &Point, outcome: Outcome) {
    if !outcome.is_converged() {
        recent.clear();
        return;
    }
    let before = recent.drain(..).map(|p| p.resized(point.u.len()));
    *recent = before.chain([point.clone()]).collect();
}

/// Part of a branch that a point was found by.
fn part_of(solved: &SolvedFrequency) -> Option<Part> {
    solved.along.as_ref().map(|along| along.part)
}

/// Abscissa behind a gap after another one, within the course, and not behind the one at which a
/// motion was looked for last: a branch that turned back may be lost on its way back.
fn beyond(course: Course, abscissa: f64, gap: f64, looked_for: f64) -> f64 {
    let Course { from, to } = course;
    let left = |from: f64| (to - from).abs();
    let next = if left(abscissa) > gap {
        abscissa + (to - from).signum() * gap
    } else {
        to
    };
    if left(next) < left(looked_for) {
        next
    } else {
        looked_for
    }
}

/// Top of an observed amplitude between points of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Top {
    /// Number of the point before it.
    after: usize,
    /// Length of the curve up to it.
    length: f64,
    /// Amplitude, m.
    amplitude_m: f64,
}

/// Highest top of an observed amplitude above the points of a curve that are beside it; `None` where
/// there is none. The slopes tell where it lies, to a high order where the curve is smooth; at a
/// corner, where they do not, three amplitudes do. Slopes up to the length `searched` are left out.
fn top_of_curve(points: &[Point], searched: f64, observation: usize) -> Option<Top> {
    let places: Vec<(f64, Height)> = points
        .iter()
        .map(|p| (p.length, p.heights[observation]))
        .collect();
    let of_two = (places.windows(2).enumerate())
        .filter(|(_, two)| two[0].0 >= searched)
        .filter_map(|(i, two)| top_of_two(two, i));
    let of_three = (places.windows(3).enumerate()).filter_map(|(i, three)| top_of_three(three, i));
    of_two
        .chain(of_three)
        .max_by(|a, b| a.amplitude_m.total_cmp(&b.amplitude_m))
}

/// Top of the cubic through two places, `i` and the next one, and their slopes.
fn top_of_two(two: &[(f64, Height)], i: usize) -> Option<Top> {
    let [(from, first), (to, second)] = two else {
        return None;
    };
    let span = to - from;
    let end = |height: &Height| [height.amplitude_m, span * height.along_m];
    let (place, amplitude_m) = top_of([first, second].map(end))?;
    let higher = first.amplitude_m.max(second.amplitude_m);
    (amplitude_m > (1.0 + PEAK_ERROR) * higher).then_some(Top {
        after: i,
        length: from + place * span,
        amplitude_m,
    })
}

/// Top of the parabola through three places, from `i` on, where the middle one is the highest.
fn top_of_three(three: &[(f64, Height)], i: usize) -> Option<Top> {
    let [a, b, c] = three else {
        return None;
    };
    let middle = b.1.amplitude_m;
    if !(middle > a.1.amplitude_m && middle >= c.1.amplitude_m) {
        return None;
    }
    let three = [a, b, c].map(|(length, height)| (*length, height.amplitude_m));
    let (gain, shift) = vertex(three);
    if !shift.is_finite() || gain <= PEAK_ERROR * middle {
        return None;
    }
    Some(Top {
        after: if shift < 0.0 { i } else { i + 1 },
        length: b.0 + inside(shift, three.map(|p| p.0)),
        amplitude_m: middle + gain,
    })
}

/// Top between 0 and 1 of the cubic with these values and slopes at both: its place and value. `None`
/// where it does not rise at 0 and fall at 1.
fn top_of([[a, rises], [b, falls]]: [[f64; 2]; 2]) -> Option<(f64, f64)> {
    if !(rises > 0.0 && falls < 0.0) {
        return None;
    }
    // a + rises t + square t^2 + cube t^3
    let square = 3.0 * (b - a) - 2.0 * rises - falls;
    let cube = rises + falls - 2.0 * (b - a);
    let root = (square * square - 3.0 * cube * rises).sqrt();
    let t = rises / (root - square);
    let value = a + t * (rises + t * (square + t * cube));
    value.is_finite().then_some((t, value))
}

/// Start for a further point at a fold between two points; `None` where the curve does not fold
/// between them, or its fold is known to the error. A point has an abscissa and its slope, and
/// `ways` are the lengths to where its tangents meet, from the first and back from the second. The
/// fold may be a corner, at which no parabola comes near it. Where the tangents meet far from one of
/// the points the curve may bend on the way, and the meeting says little.
fn fold_between(
    [(first, rises), (second, falls)]: [(f64, f64); 2],
    ways: [f64; 2],
    error: f64,
) -> Option<FoldStart> {
    let turns = rises * falls < 0.0;
    if !turns {
        return None;
    }
    let [ahead, behind] = ways;
    let sign = rises.signum();
    let extreme = (sign * first).max(sign * second);
    let meets = sign * (first + rises * ahead);
    let is_long = |way: f64, other: f64| way > LONG_WAY && way >= other && other > -0.25 * way;
    if ahead > 0.0 && behind > 0.0 && meets - extreme > error {
        Some(FoldStart::AheadOfFirst(ahead))
    } else if is_long(behind, ahead) {
        Some(FoldStart::BehindSecond(0.5 * behind))
    } else if is_long(ahead, behind) {
        Some(FoldStart::AheadOfFirst(0.5 * ahead))
    } else {
        None
    }
}

/// Response that consists of these branches.
fn assembled(branches: Vec<Followed>) -> Response {
    let mut response = Response::default();
    for branch in branches {
        let first = response.orbits.len();
        let abscissae = branch.points.iter().map(SolvedFrequency::abscissa);
        let abscissae = abscissae.collect();
        let points = branch.points.into_iter();
        let (orbits, linear): (Vec<_>, Vec<_>) = points.map(|s| (s.orbit, s.linear)).unzip();
        response.orbits.extend(orbits);
        response.linear.extend(linear);
        response.branches.push(Branch {
            points: first..response.orbits.len(),
            gaps: branch.gaps.iter().map(|gap| first + gap).collect(),
            lengths: branch.lengths,
            abscissae,
        });
    }
    response
}

/// Response so far of branches that are being followed: `solved` are the points found, in the order
/// of their numbers. The linear reference is known at these alone.
pub fn so_far(solved: impl IntoIterator<Item = SolvedFrequency>) -> Response {
    let [mut rising, mut falling] = [Followed::default(), Followed::default()];
    for solved in solved {
        let from_last = solved.along.as_ref().is_some_and(|along| along.from_last);
        let branch = if from_last { &mut falling } else { &mut rising };
        branch.keep(solved);
    }
    assembled(vec![rising, falling.reversed()])
}

impl<'s> Run<'s> {
    /// Judges a solution of a level at an abscissa; `None` where there is no model.
    fn judged_at<'x>(
        &self,
        solvers: Solvers<'x>,
        abscissa: f64,
        solved: Solution<'x>,
        work: &mut Work,
    ) -> Option<Resolved<'x>> {
        let refinement = solvers.over.refinement(abscissa)?;
        let at = FrequencyOnLevel {
            frequency_hz: solvers.over.frequency_hz(abscissa),
            level: solvers.level,
        };
        Some(self.judged(refinement, at, solved, work))
    }

    /// Follows the branches that begin at the two ends of these frequencies, each to the middle.
    /// Where they do not meet there, both are followed to where they leave the range: a curve that
    /// folds is then the same from both ends, and two branches that are not remain two.
    pub(super) fn followed(&self, asked_hz: &[f64]) -> Response {
        let course = Course::over(asked_hz);
        let mut response = assembled(self.branches(None, course, asked_hz));
        response.slip_threshold_m = self.slip_threshold_m;
        let (from_hz, to_hz) = (course.from, course.to);
        let even = (0..=LINEAR_PARTS)
            .map(|i| from_hz + (to_hz - from_hz) * i as f64 / LINEAR_PARTS as f64);
        let own = response.linear.iter().map(|p| p.frequency_hz);
        let mut frequencies_hz: Vec<f64> = own.chain(even).collect();
        frequencies_hz.sort_by(f64::total_cmp);
        frequencies_hz.dedup();
        response.linear_curve = linear_curve(&self.linear, self.harmonics(), &frequencies_hz);
        response.second_motions = several_motions(&response);
        response
    }

    /// Follows the branches that begin at the two ends of a range of values, as
    /// [`Run::followed`] does.
    pub(super) fn followed_over(&self, values: &Values<'_>) -> Response {
        let asked = values.abscissae();
        let branches = self.branches(Some(values), Course::over(&asked), &asked);
        let mut response = assembled(branches);
        response.slip_threshold_m = self.slip_threshold_m;
        response
    }

    fn branches(
        &self,
        values: Option<&Values<'_>>,
        course: Course,
        asked: &[f64],
    ) -> Vec<Followed> {
        if asked.is_empty() {
            return Vec::new();
        }
        let middle = 0.5 * (course.from + course.to);
        let back = Course {
            from: course.to,
            to: course.from,
        };
        let [mut rising, mut falling] = [(course, false), (back, true)]
            .map(|(course, from_last)| Follower::new(self, values, course, asked, from_last));
        if course.range() == 0.0 {
            rising.advance(None);
            return vec![rising.branch];
        }
        let stop = Some(middle);
        rayon::join(|| rising.advance(stop), || falling.advance(stop));
        let same = |a: Option<&SolvedFrequency>, b: Option<&SolvedFrequency>| {
            let at_one = a.zip(b).filter(|(a, b)| a.abscissa() == b.abscissa());
            at_one.is_some_and(|(a, b)| self.is_same(&a.orbit, &b.orbit))
        };
        let [first, second] = [&rising, &falling].map(|half| half.branch.until(middle));
        if same(first.points.last(), second.points.last()) {
            // A half that finds no motion at its end is better reached from the other one.
            let goes_on = match [&first, &second].map(|half| half.gaps.is_empty()) {
                [true, false] if values.is_some() => Some(&mut rising),
                [false, true] if values.is_some() => Some(&mut falling),
                _ => None,
            };
            if let Some(half) = goes_on {
                half.advance(None);
                if half.has_crossed() {
                    let Follower {
                        branch, from_last, ..
                    } = half;
                    let branch = std::mem::take(branch);
                    return vec![if *from_last {
                        branch.reversed()
                    } else {
                        branch
                    }];
                }
            }
            let mut whole = first;
            whole.extend(second.reversed());
            return vec![whole];
        }
        rayon::join(|| rising.advance(None), || falling.advance(None));
        if values.is_some() {
            // The other half may have met nothing at the end from which it began.
            if rising.has_crossed() && !falling.has_begun() {
                return vec![rising.branch];
            }
            if falling.has_crossed() && !rising.has_begun() {
                return vec![falling.branch.reversed()];
            }
        }
        let [rising, falling] = [rising, falling].map(|half| half.branch);
        if same(rising.points.last(), falling.points.first()) {
            return vec![rising];
        }
        if same(falling.points.last(), rising.points.first()) {
            return vec![falling.reversed()];
        }
        vec![rising, falling]
    }

    /// Peak of an observed amplitude on the branch near a motion; `None` where none is found. Its
    /// error is estimated: where it needs more harmonics, its peak with these is looked for from
    /// there.
    pub(super) fn peak_near(
        &self,
        course: Course,
        guess: &Guess,
        observation: usize,
    ) -> Option<Orbit> {
        let Guess {
            harmonics,
            estimated_error,
            neighbour,
        } = guess;
        let mut level = self.refinement.level_beside(*harmonics, *estimated_error);
        let mut near = neighbour.clone();
        loop {
            let mut follower = Follower::new(self, None, course, &[], false);
            let (peak, of_peak) = follower.climb(&near, level, observation)?;
            let estimated = self.estimated(&peak, of_peak);
            if estimated.1 == of_peak {
                return estimated.0.outcome.has_motion().then_some(estimated.0);
            }
            near = Neighbour::of(&estimated.0, None);
            level = estimated.1;
        }
    }

    /// A motion with the estimate of its error, and its level: a higher one where an accuracy asks
    /// for it.
    pub(super) fn estimated(&self, orbit: &Orbit, level: usize) -> (Orbit, usize) {
        let (at_hz, mut work) = (orbit.frequency_hz, Work::default());
        work.start_counting(self.most_seconds);
        let from = Neighbour::of(orbit, None);
        let solved = (self.refinement.level(level)).solve_from(at_hz, &from, &mut work);
        let resolved = self.refinement.refined(at_hz, level, solved, &mut work);
        let level = resolved.level;
        (
            self.orbit_of(
                &self.refinement,
                resolved,
                NumberedFrequency::of(orbit),
                &work,
            ),
            level,
        )
    }

    /// Returns `true` if two motions at one abscissa have the same vibration: that of what is
    /// observed, or that of the pairs where nothing is. Pairs that stick leave their means open.
    fn is_same(&self, a: &Orbit, b: &Orbit) -> bool {
        if !a.outcome.has_motion() || !b.outcome.has_motion() {
            return false;
        }
        let error = if a.harmonics == b.harmonics {
            SAME
        } else {
            let errors = [a, b].map(|orbit| orbit.estimated_error.unwrap_or(0.0));
            errors[0].max(errors[1]).max(SAME)
        };
        if a.observed.is_empty() {
            let solver = self.refinement.with(a.harmonics.min(b.harmonics));
            let balance = Balance::new(&solver.setting, TAU * a.frequency_hz);
            let n = balance.unknowns_per_block();
            let differs = |(a, b): (&f64, &f64)| a - b;
            let moved: Vec<f64> = a.x.iter().zip(&b.x).map(differs).collect();
            let vibration = |x: &[f64]| {
                let mut x = x[..moved.len()].to_vec();
                x[..n].fill(0.0);
                step_length(&balance, &x)
            };
            return vibration(&moved) <= error * vibration(&a.x);
        }
        let size = |vibration: &mut dyn Iterator<Item = f64>| vibration.map(|c| c * c).sum::<f64>();
        a.observed.iter().zip(&b.observed).all(|(a, b)| {
            let moved = a.iter().zip(b).skip(1).map(|(a, b)| a - b);
            let whole = size(&mut a.iter().skip(1).copied());
            size(&mut { moved }) <= error * error * whole
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fold at which a contact is just touched takes a dozen steps of a millionth.
    #[test]
    fn a_branch_creeps_after_many_short_steps_and_not_after_a_few() {
        let behind = |steps: &[f64]| {
            let mut branch = Followed::default();
            branch.lengths.push(0.0);
            for step in steps {
                let last = branch.lengths.last().unwrap();
                branch.lengths.push(last + step);
            }
            branch.creeps()
        };
        let short = vec![1e-6; MOST_SHORT_STEPS];
        let few = [&[0.1; 30][..], &short[..12]].concat();
        assert!(!behind(&few));
        assert!(!behind(&[&few[..], &[0.01; 5]].concat()));
        assert!(!behind(&short[1..]));
        assert!(behind(&short));
        assert!(behind(&[&few[..], &short].concat()));
        assert!(!behind(&[&short[..], &[0.01]].concat()));
    }

    #[test]
    fn a_fold_lies_where_the_tangents_beside_it_meet() {
        // A corner at 6 Hz, and the same one down.
        for sign in [1.0, -1.0] {
            let places = [(sign * 2.0, sign * 2.0), (sign * 2.0, sign * -4.0)];
            for (ways, error, start) in [
                ([2.0, 1.0], 3.9, Some(FoldStart::AheadOfFirst(2.0))),
                ([0.02, 0.01], 4.1, None),
                ([2.0, 1.0], 4.1, Some(FoldStart::AheadOfFirst(1.0))),
                ([-0.1, 1.0], 0.0, Some(FoldStart::BehindSecond(0.5))),
                ([0.01, 0.001], 1.0, None),
                ([1.0, -1.0], 1.0, None),
                ([f64::NAN, 1.0], 0.0, None),
            ] {
                assert_eq!(fold_between(places, ways, error), start, "{ways:?}");
            }
        }
        for falls in [2.0, f64::NAN] {
            assert_eq!(
                fold_between([(2.0, 2.0), (2.0, falls)], [2.0, 1.0], 0.0),
                None
            );
        }
    }

    #[test]
    fn the_top_of_a_cubic_follows_from_its_ends() {
        // 4 + 3 t - 4 t^3, whose slope is zero at a half, and the same one backwards.
        let [first, second] = [[4.0, 3.0], [3.0, -9.0]];
        assert_eq!(top_of([first, second]), Some((0.5, 5.0)));
        let back = |[value, slope]: [f64; 2]| [value, -slope];
        assert_eq!(top_of([back(second), back(first)]), Some((0.5, 5.0)));
        // A parabola.
        assert_eq!(top_of([[0.0, 2.0], [0.0, -2.0]]), Some((0.5, 0.5)));
        // Rising, falling, level, with a valley alone, with a top and a valley, and with no number.
        for ends in [
            [[0.0, 1.0], [1.0, 1.0]],
            [[1.0, -1.0], [0.0, -1.0]],
            [[1.0, 0.0], [1.0, 0.0]],
            [[0.0, -2.0], [0.0, 2.0]],
            [[0.0, 9.0], [1.0, 1.0]],
            [[0.0, f64::NAN], [0.0, 2.0]],
        ] {
            assert_eq!(top_of(ends), None, "{ends:?}");
        }
    }

    /// Where slopes say nothing of a peak, three amplitudes do.
    #[test]
    fn a_top_is_told_by_slopes_and_by_amplitudes() {
        let place = |(length, amplitude_m, along_m): (f64, f64, f64)| {
            let height = Height {
                amplitude_m,
                along_m,
            };
            (length, height)
        };
        let top = |two: [(f64, f64, f64); 2]| top_of_two(&two.map(place), 7);
        let found = top([(1.0, 1.0, 0.1), (3.0, 1.0, -0.1)]).unwrap();
        assert_eq!((found.after, found.length), (7, 2.0));
        assert!((found.amplitude_m - 1.05).abs() < 1e-12);
        // Less than the error above the higher one.
        assert_eq!(top([(1.0, 1.0, 1e-5), (3.0, 1.0, -1e-5)]), None);
        let top = |three: [(f64, f64); 3]| {
            top_of_three(&three.map(|(length, a)| place((length, a, 0.0))), 7)
        };
        let found = top([(0.0, 0.9), (1.0, 1.0), (2.0, 0.98)]).unwrap();
        assert_eq!(found.after, 8);
        assert!(found.length > 1.0 && found.length < 2.0 && found.amplitude_m > 1.0);
        assert_eq!(top([(0.0, 0.9), (1.0, 1.0), (2.0, 1.01)]), None);
    }

    #[test]
    fn a_motion_is_looked_for_ever_further_on_and_last_at_the_end() {
        for (from, to) in [(100.0, 200.0), (200.0, 100.0)] {
            let course = Course { from, to };
            let at = |share: f64| from + share * (to - from);
            let next = |share: f64, looked_for: f64| {
                beyond(course, at(share), GAP * course.range(), at(looked_for))
            };
            assert_eq!(next(0.0, 0.0), at(GAP));
            assert_eq!(next(0.5, 0.2), at(0.5 + GAP));
            // Lost on the way back from a fold.
            assert_eq!(next(0.2, 0.5), at(0.5));
            assert_eq!(next(0.999, 0.5), to);
            assert_eq!(next(0.2, 1.0), to);
        }
    }
}
