//! Steps along a curve: prediction, correction, and the length of the next step.

use super::bordered::{Plane, correct, direction};
use super::gauge::{Direction, Gauge, Scales, motion};
use super::over::{Over, Solvers};
use crate::dlft::balance::Balance;
use crate::dlft::point::{Neighbour, Solution, Work, resized};
use crate::dlft::retention::Mean;
use crate::dlft::{Heading, SolvedFrequency};
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::vector::{axpy, norm};

/// Error of the cubics that join the points of a branch, relative to |T|, by which steps are
/// chosen.
const CURVE_ERROR: f64 = 1e-3;
/// First step.
const FIRST_STEP: f64 = 0.02;
/// Step from a top, at which a resonance has fallen by 4 %, and one that friction flattens by less.
const BEYOND_TOP: f64 = 0.3;
/// Longest step: by it what is observed changes by a half.
const LONGEST_STEP: f64 = 0.5;
/// Shortest step: where it fails, the curve cannot be followed on.
const SHORTEST_STEP: f64 = 1e-7;
/// Shortest step behind [`MOST_SHORT_STEPS`] shorter ones.
pub const SHORT_STEP: f64 = 1e-4;
/// Most steps in a row that are shorter on average than [`SHORT_STEP`]. A few lead round the fold at
/// which a contact is just touched. At the frequency of an undamped mode, where the balance has a
/// pole, each of thousands would find a motion.
pub const MOST_SHORT_STEPS: usize = 40;
/// Newton iterations allowed to a step.
const MOST_ITERATIONS: usize = 12;
/// A step that has been halved so many times is tried at its abscissa, too, once.
const BEFORE_ABSCISSA: usize = 1;
/// Least cosine of the angle by which a step may turn.
const LEAST_COSINE: f64 = 0.7;
/// A step has left the curve where its end lies so many steps from its beginning.
const FAR: f64 = 2.0;
/// The error of the cubic through both ends of a step is this fraction of the error of the cubic
/// that was continued to its end: both are the fourth derivative of T, divided by 24, times a
/// product of four distances, `(h / 2)^4` at the middle and `4 h^4` at the end of an equal step.
const INTERPOLATED: f64 = 1.0 / 64.0;
/// A step is taken again where the cubic is off by so many times what is allowed.
const TOO_FAR_OFF: f64 = 30.0;
/// Parts of a step in which it is looked for where the curve crosses an abscissa.
const PARTS: u32 = 16;
const BISECTIONS: usize = 50;
/// Two places of a curve are one where they lie closer together than this.
const SAME_LENGTH: f64 = 1e-9;
/// |T| is measured against this fraction of its largest value where it is smaller.
const LEAST_MOTION: f64 = 0.01;
/// Length along the direction of a point of the difference that takes the change of amplitudes.
const DIFFERENCE: f64 = 1e-6;
/// Scale of the motion where nothing moves, m. Its square is no zero.
const NO_MOTION_M: f64 = 1e-150;

/// Point of a curve, from which the next one is found.
#[derive(Debug, Clone)]
pub struct Point {
    /// Abscissa of the curve, such as the frequency, Hz.
    pub abscissa: f64,
    /// Coefficients, m.
    pub u: Vec<f64>,
    /// Treatment of the mean along the motions that only friction holds.
    pub mean: Mean,
    /// Motion T ([`motion`]).
    pub motion: Vec<f64>,
    /// Direction of the curve.
    pub direction: Direction,
    /// Change of T along it.
    pub motion_along: Vec<f64>,
    /// Observed amplitudes.
    pub heights: Vec<Height>,
    /// Scales of the length at the point.
    scales: Scales,
    /// Coefficients of dU and dp in the length of a change along the direction.
    across: (Vec<f64>, f64),
    /// Length of the curve up to the point.
    pub length: f64,
}

/// Observed amplitude at a point of a curve.
#[derive(Debug, Clone, Copy)]
pub struct Height {
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Its change along the curve, m.
    pub along_m: f64,
}

/// Changes in which the length of a curve is to grow at a point.
enum Ahead<'a> {
    /// Those of the abscissa, with this sign.
    Abscissa(f64),
    /// Those along the direction of a point nearby.
    As(&'a Point),
    /// Those along a direction of the motion T and the abscissa.
    Along(&'a [f64], f64),
}

/// Range of the abscissa through which a curve is followed.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    /// Abscissa at which the curve begins.
    pub from: f64,
    /// Abscissa at which it ends.
    pub to: f64,
}

impl Course {
    /// Range from the first to the last of these abscissae; at 0 where there is none.
    pub fn over(abscissae: &[f64]) -> Self {
        let [from, to] =
            [abscissae.first(), abscissae.last()].map(|end| end.copied().unwrap_or_default());
        Self { from, to }
    }

    /// Length of the range.
    pub fn range(self) -> f64 {
        (self.to - self.from).abs()
    }
}

/// Follower of one curve.
#[derive(Clone)]
pub struct Tracer {
    /// Level of the harmonics.
    level: usize,
    course: Course,
    /// Last two points.
    before: Option<Point>,
    last: Point,
    step: f64,
    largest_motion: f64,
    /// Length of the curve up to which abscissae asked for have been passed.
    passed_length: f64,
    /// Abscissa ahead at which no solution was found: a fold may lie before it.
    failed: Option<f64>,
}

/// Solution on the curve, with its abscissa, and the length of the curve up to it.
pub struct Found<'b> {
    /// The solution.
    pub solution: Solution<'b>,
    /// Its abscissa.
    pub abscissa: f64,
    /// Length of the curve up to it.
    pub length: f64,
}

/// Start for a point at a fold, so far along the tangent of one of two points beside the fold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FoldStart {
    /// Ahead of the first point.
    AheadOfFirst(f64),
    /// Behind the second one.
    BehindSecond(f64),
}

/// Points of the curve that a step came to.
pub struct Step<'b> {
    /// Points at the abscissae asked for that the step passed, in their order.
    pub passed: Vec<Found<'b>>,
    /// Point at the end of the step; `None` where the curve left the range within it, or could not
    /// be followed at all.
    pub reached: Option<Found<'b>>,
    /// `true` if the curve left the range. The last of those passed is then its end.
    pub leaves: bool,
}

impl Tracer {
    /// Follower that begins at a solution, and goes towards the second abscissa of the course.
    /// `None` where no direction is found.
    pub fn from(
        solvers: Solvers<'_>,
        course: Course,
        (solution, abscissa): (&Solution<'_>, f64),
        work: &mut Work,
    ) -> Option<Self> {
        let motion = motion_of(solvers, solution, abscissa);
        let scales = Scales {
            motion: norm(&motion).max(NO_MOTION_M),
            range: course.range(),
        };
        let ahead = Ahead::Abscissa((course.to - course.from).signum());
        let at = (solution, abscissa);
        Some(Self {
            last: Point::at(solvers, at, motion, &ahead, (scales, 0.0), work)?,
            largest_motion: scales.motion,
            level: solvers.level,
            course,
            before: None,
            step: FIRST_STEP,
            passed_length: 0.0,
            failed: None,
        })
    }

    /// Follower that goes on in the same direction from another solution at the last abscissa, of
    /// another balance: with another mean, or other harmonics.
    pub fn again(
        self,
        solvers: Solvers<'_>,
        solution: &Solution<'_>,
        work: &mut Work,
    ) -> Option<Self> {
        let abscissa = self.last.abscissa;
        let motion = motion_of(solvers, solution, abscissa);
        let scales = self.scales(&motion);
        let at = (solution, abscissa);
        let ahead = Ahead::As(&self.last);
        let passed_length = self.last.length;
        Some(Self {
            last: Point::at(solvers, at, motion, &ahead, (scales, passed_length), work)?,
            largest_motion: self.largest_motion.max(scales.motion),
            level: solvers.level,
            course: self.course,
            before: None,
            step: self.step.min(FIRST_STEP),
            passed_length,
            failed: None,
        })
    }

    /// Follower that goes on from a solution that is recorded with its heading, behind another
    /// point. `passed_length` is the length of the curve up to which it is known.
    pub fn resumed(
        solvers: Solvers<'_>,
        course: Course,
        solved: &SolvedFrequency,
        (before, passed_length): (Option<Point>, f64),
        work: &mut Work,
    ) -> Option<Self> {
        let along = solved.along.as_ref()?;
        let heading = along.heading.as_ref()?;
        let abscissa = along.abscissa;
        let (solver, frequency_hz) = (solvers.at(abscissa)?, solvers.over.frequency_hz(abscissa));
        let solution = solver.evaluated(frequency_hz, &solved.orbit.x, solved.orbit.mean)?;
        let motion = motion_of(solvers, &solution, abscissa);
        let scales = Scales {
            motion: heading.scale_m,
            range: course.range(),
        };
        let ahead = Ahead::Along(&heading.motion_m, heading.abscissa);
        let (at, place) = ((&solution, abscissa), (scales, along.length));
        Some(Self {
            last: Point::at(solvers, at, motion, &ahead, place, work)?,
            largest_motion: heading.largest_m,
            level: solvers.level,
            course,
            before,
            step: heading.next_step,
            passed_length,
            failed: None,
        })
    }

    /// Direction of the curve at the last point, as it is recorded.
    pub fn heading(&self) -> Heading {
        Heading {
            motion_m: self.last.motion_along.clone(),
            abscissa: self.last.direction.abscissa,
            scale_m: self.last.scales.motion,
            largest_m: self.largest_motion,
            next_step: self.step,
        }
    }

    /// Solvers of the points of the curve.
    fn solvers<'b>(&self, over: &'b dyn Over<'b>) -> Solvers<'b> {
        Solvers {
            over,
            level: self.level,
        }
    }

    /// Criteria that end the iterations at an abscissa; `None` where there is no model.
    fn newton<'b>(&self, over: &'b dyn Over<'b>, abscissa: f64) -> Option<NewtonOptions> {
        Some(self.solvers(over).at(abscissa)?.newton)
    }

    /// Last point.
    pub fn last(&self) -> &Point {
        &self.last
    }

    /// Counts the length of the curve from here on from `length`.
    pub fn begin_at(&mut self, length: f64) {
        self.last.length = length;
        self.passed_length = length;
        self.before = None;
    }

    /// Goes up from the last point, to larger amplitudes of an observed displacement, with a first
    /// step past the top that a resonance has there. `None` without that displacement.
    pub fn climb(&mut self, observation: usize) -> Option<()> {
        if self.last.heights.get(observation)?.along_m < 0.0 {
            self.last.turn();
            self.before = None;
        }
        let Height {
            amplitude_m,
            along_m,
        } = self.last.heights[observation];
        // Along the circle of a resonance an amplitude is the cosine of the length from its top.
        let to_top = if along_m > 0.0 {
            along_m.atan2(amplitude_m)
        } else {
            0.0
        };
        self.step = (to_top + BEYOND_TOP).min(LONGEST_STEP);
        Some(())
    }

    /// Goes back to the point before, which can be done once after a step.
    pub fn step_back(&mut self) {
        if let Some(before) = self.before.take() {
            self.last = before;
        }
    }

    /// Takes a step along the curve, shortened until it succeeds. `asked` are abscissae at which
    /// solutions are asked for. `creeps`: many short steps lie behind it, and no shorter one than
    /// [`SHORT_STEP`] is taken.
    pub fn step<'b>(
        &mut self,
        over: &'b dyn Over<'b>,
        asked: &[f64],
        creeps: bool,
        work: &mut Work,
    ) -> Step<'b> {
        let shortest = if creeps { SHORT_STEP } else { SHORTEST_STEP };
        self.step = self.step.max(2.0 * shortest);
        let mut failures = 0;
        while self.step >= shortest {
            match self.attempt(over, asked, failures == BEFORE_ABSCISSA, work) {
                Some(step) => return step,
                None => self.step *= 0.5,
            }
            failures += 1;
        }
        Step {
            passed: Vec::new(),
            reached: None,
            leaves: false,
        }
    }

    /// Solution at a length of the curve between two points, with the mean of either. Where `retained`
    /// is true and neither is found, the mean may be retained where friction does not hold the bodies.
    pub fn inside<'b>(
        &self,
        over: &'b dyn Over<'b>,
        ends: [&Point; 2],
        (length, retained): (f64, bool),
        work: &mut Work,
    ) -> Option<Found<'b>> {
        let [first, second] = ends;
        let span = second.length - first.length;
        let way = length - first.length;
        let (u, abscissa) = between(first, second, way / span);
        let plane = first.plane(span, (&u, abscissa));
        let newton = self.newton(over, abscissa)?;
        // Beside a corner the tangents of its sides are nearer to the curve than the cubic.
        let starts = [(u, abscissa), first.ahead(way), second.ahead(way - span)];
        let starts = (&starts[..], retained);
        let (solution, abscissa) =
            self.corrected_between(ends, over, &plane, starts, newton, work)?;
        Some(Found {
            solution,
            abscissa,
            length,
        })
    }

    /// Solution at a length of the curve between two points beside a fold, which may be a corner. It
    /// is looked for in the plane across the line that joins both points: a curve from one to the
    /// other crosses it however sharply it turns.
    pub fn beside_fold<'b>(
        &self,
        over: &'b dyn Over<'b>,
        [first, second]: [&Point; 2],
        start: FoldStart,
        length: f64,
        work: &mut Work,
    ) -> Option<Found<'b>> {
        let (u, abscissa) = match start {
            FoldStart::AheadOfFirst(way) => first.ahead(way),
            FoldStart::BehindSecond(way) => second.ahead(-way),
        };
        let (joins, joins_along) = first.to(second);
        let scales = first.scales;
        let squared = scales.length(&joins, joins_along).powi(2);
        let solvers = self.solvers(over);
        let balance = solvers.balance(abscissa, first.mean)?;
        let gauge = gauge(solvers, &balance, (&u, abscissa))?;
        let (row, corner) = scales.across(&gauge, &joins, joins_along);
        let plane = Plane::across((&row, corner), squared, (&u, abscissa));
        let newton = self.newton(over, abscissa)?;
        let (starts, ends) = ([(u, abscissa)], [first, second]);
        let starts = (&starts[..], true);
        let (solution, abscissa) =
            self.corrected_between(ends, over, &plane, starts, newton, work)?;
        Some(Found {
            solution,
            abscissa,
            length,
        })
    }

    /// Point at a solution between two points, with the direction of the curve: that of the point
    /// to whose direction it is nearer. Behind a corner the curve may run back.
    pub fn point_at<'b>(
        &self,
        over: &'b dyn Over<'b>,
        found: &Found<'_>,
        [first, second]: [&Point; 2],
        work: &mut Work,
    ) -> Option<Point> {
        let solvers = self.solvers(over);
        let motion = motion_of(solvers, &found.solution, found.abscissa);
        let place = (self.scales(&motion), found.length);
        let at = (&found.solution, found.abscissa);
        let mut point = Point::at(solvers, at, motion, &Ahead::As(first), place, work)?;
        let [like_first, like_second] = [first, second].map(|p| p.cosine(&point));
        if like_second.abs() > like_first.abs() && like_second < 0.0 {
            point.turn();
        }
        Some(point)
    }

    /// Scales of the length where the motion is this.
    fn scales(&self, motion: &[f64]) -> Scales {
        let size = norm(motion);
        let least = LEAST_MOTION * self.largest_motion.max(size);
        Scales {
            motion: size.max(least).max(NO_MOTION_M),
            range: self.course.range(),
        }
    }

    /// Tries a step; `None` where a shorter one is to be tried.
    fn attempt<'b>(
        &mut self,
        over: &'b dyn Over<'b>,
        asked: &[f64],
        by_abscissa: bool,
        work: &mut Work,
    ) -> Option<Step<'b>> {
        let (h, solvers) = (self.step, self.solvers(over));
        let Point { scales, mean, .. } = self.last;
        let (u, abscissa) = self.last.ahead(h);
        let plane = self.last.plane(h, (&u, abscissa));
        let (predicted, predicted_at) = self.predicted(h);
        if let Some(end) = over.end_before(predicted_at) {
            return self.attempt_end(over, (end, h), asked, work);
        }
        let newton = self.newton(over, self.last.abscissa)?;
        let options = NewtonOptions {
            max_iterations: MOST_ITERATIONS.min(newton.max_iterations),
            ..newton
        };
        let start = (&predicted[..], predicted_at);
        let found = self.corrected(over, &plane, start, mean, options, work);
        let (found, abscissa) = match found {
            Some(found) => found,
            None if by_abscissa => self.at_abscissa_ahead(over, predicted_at, work)?,
            None => return None,
        };
        let reached = motion_of(solvers, &found, abscissa);
        let from = |other: &[f64]| -> Vec<f64> {
            let both = reached.iter().zip(other);
            both.map(|(a, b)| a - b).collect()
        };
        let moved_by = abscissa - self.last.abscissa;
        let distance = scales.length(&from(&self.last.motion), moved_by);
        if distance > FAR * h {
            return None;
        }
        let next = self.point(over, (&found, abscissa), reached.clone(), work)?;
        let may_shorten = h > 4.0 * SHORTEST_STEP;
        if self.last.cosine(&next) < LEAST_COSINE && may_shorten {
            return None;
        }
        let along = (&next.motion_along[..], next.direction.abscissa);
        let length = scales.length(along.0, along.1);
        // Distance of the prediction from the curve: what it is off along the curve is no error.
        let of_found = solvers.place(&found.balance, &predicted, abscissa);
        let expected = over.motion_at(of_found, predicted_at)?;
        let (off, off_by) = (from(&expected), abscissa - predicted_at);
        let along_curve = scales.product((&off, off_by), along) / length;
        let off = scales.length(&off, off_by).powi(2) - along_curve * along_curve;
        let error = INTERPOLATED * off.max(0.0).sqrt() / CURVE_ERROR;
        if error > TOO_FAR_OFF && may_shorten {
            return None;
        }
        let Course { from, to } = self.course;
        let leaves = !(from.min(to)..=from.max(to)).contains(&abscissa);
        let passed = self.passed_before(over, &next, leaves, asked, work)?;
        self.passed_length = passed.last().map_or(self.passed_length, |p| p.length);
        let by_error = 0.9 * error.max(1e-9).powf(-0.25);
        let most = if found.end.iterations > 7 { 0.7 } else { 2.0 };
        self.step = (h * by_error.clamp(0.3, most)).min(LONGEST_STEP);
        self.largest_motion = self.largest_motion.max(norm(&next.motion));
        let reached = Found {
            abscissa,
            length: next.length,
            solution: found,
        };
        if !leaves {
            self.before = Some(std::mem::replace(&mut self.last, next));
        }
        Some(Step {
            passed,
            reached: (!leaves).then_some(reached),
            leaves,
        })
    }

    /// Tries a step to the end of a range that a step of this length would leave, and beyond which
    /// there are no models; `None` where a shorter one is to be tried.
    fn attempt_end<'b>(
        &mut self,
        over: &'b dyn Over<'b>,
        (end, step): (f64, f64),
        asked: &[f64],
        work: &mut Work,
    ) -> Option<Step<'b>> {
        let (solvers, last) = (self.solvers(over), &self.last);
        let is_before = |h: f64| {
            let (_, at) = self.predicted(h);
            (at - end) * (last.abscissa - end) > 0.0
        };
        let (mut low, mut high) = (0.0, step);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if is_before(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        if low == 0.0 {
            return None;
        }
        let (predicted, _) = self.predicted(low);
        let plane = self.at_one(end, predicted.len());
        let newton = self.newton(over, end)?;
        let start = (&predicted[..], end);
        let (found, _) = self.corrected(over, &plane, start, last.mean, newton, work)?;
        let reached = motion_of(solvers, &found, end);
        let next = self.point(over, (&found, end), reached, work)?;
        let distance = next.length - last.length;
        if step > 4.0 * SHORTEST_STEP && (distance > FAR * low || last.cosine(&next) < LEAST_COSINE)
        {
            return None;
        }
        let asked: Vec<f64> = asked.iter().copied().filter(|at| *at != end).collect();
        let mut passed = self.passed_before(over, &next, false, &asked, work)?;
        passed.push(Found {
            solution: found,
            abscissa: end,
            length: next.length,
        });
        self.passed_length = next.length;
        Some(Step {
            passed,
            reached: None,
            leaves: true,
        })
    }

    /// Plane of all points at an abscissa, for so many unknowns.
    fn at_one(&self, abscissa: f64, unknowns: usize) -> Plane {
        let corner = self.course.range().recip();
        Plane {
            row: vec![0.0; unknowns],
            corner,
            value: corner * abscissa,
        }
    }

    /// Solutions at the abscissae asked for that the curve crosses before `next`, in their order.
    /// Where it leaves the range the end of the range is the last of them. `None` where one of them
    /// is not found.
    fn passed_before<'b>(
        &self,
        over: &'b dyn Over<'b>,
        next: &Point,
        leaves: bool,
        asked: &[f64],
        work: &mut Work,
    ) -> Option<Vec<Found<'b>>> {
        let ends = [self.course.from, self.course.to];
        let ends = if leaves { &ends[..] } else { &[] };
        let mut crossed: Vec<(f64, f64)> = (asked.iter().chain(ends))
            .flat_map(|at| self.crossings(*at, next).into_iter().map(|t| (t, *at)))
            .collect();
        crossed.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(end) = crossed.iter().position(|(_, at)| ends.contains(at)) {
            crossed.truncate(end + 1);
        }
        let mut passed: Vec<Found<'b>> = Vec::new();
        for (fraction, at) in crossed {
            let before = passed.last().map_or(self.passed_length, |p| p.length);
            let length = self.last.length + fraction * (next.length - self.last.length);
            if length > before + SAME_LENGTH {
                passed.push(self.at_abscissa(over, at, (fraction, next), work)?);
            }
        }
        Some(passed)
    }

    /// Solution in a plane between two points, from the first of `starts` that leads to one, with the
    /// mean of the first point, or else with that of the second. Where `retained` is true and neither
    /// is found, the mean may be retained where friction does not hold the bodies.
    fn corrected_between<'b>(
        &self,
        ends: [&Point; 2],
        over: &'b dyn Over<'b>,
        plane: &Plane,
        (starts, retained): (&[(Vec<f64>, f64)], bool),
        options: NewtonOptions,
        work: &mut Work,
    ) -> Option<(Solution<'b>, f64)> {
        let mut means = ends.map(|end| end.mean).to_vec();
        means.dedup();
        let solvers = self.solvers(over);
        for &mean in &means {
            for (u, abscissa) in starts {
                let start = (&u[..], *abscissa);
                let found = correct(solvers, plane, start, mean, options, work);
                if let Some(found) = found.filter(|(found, _)| found.is_converged()) {
                    return Some(found);
                }
            }
        }
        let (u, abscissa) = starts.first()?;
        let may_retain = retained && means.contains(&Mean::Free);
        may_retain.then(|| self.retained(over, plane, (u, *abscissa), options, work))?
    }

    /// Solution in a plane, with this mean, or with the retained one where no free one is found and
    /// friction does not hold the bodies any more; `None` where none is found.
    fn corrected<'b>(
        &self,
        over: &'b dyn Over<'b>,
        plane: &Plane,
        start: (&[f64], f64),
        mean: Mean,
        options: NewtonOptions,
        work: &mut Work,
    ) -> Option<(Solution<'b>, f64)> {
        let (found, abscissa) = correct(self.solvers(over), plane, start, mean, options, work)?;
        if found.is_converged() {
            return Some((found, abscissa));
        }
        (mean == Mean::Free).then(|| self.retained(over, plane, start, options, work))?
    }

    /// Solution in a plane with the mean retained; `None` where none is found, or friction holds the
    /// bodies.
    fn retained<'b>(
        &self,
        over: &'b dyn Over<'b>,
        plane: &Plane,
        start: (&[f64], f64),
        options: NewtonOptions,
        work: &mut Work,
    ) -> Option<(Solution<'b>, f64)> {
        let solvers = self.solvers(over);
        let (found, abscissa) = correct(solvers, plane, start, Mean::Retained, options, work)?;
        if !found.is_converged() {
            return None;
        }
        let found = solvers.on_curve(abscissa, found, work)?;
        let is_retained = found.balance.mean() == Mean::Retained;
        (is_retained && found.is_converged()).then_some((found, abscissa))
    }

    /// Solution at an abscissa ahead, found in all the ways that a frequency is solved in. `None`
    /// where a fold may lie before it.
    fn at_abscissa_ahead<'b>(
        &mut self,
        over: &'b dyn Over<'b>,
        abscissa: f64,
        work: &mut Work,
    ) -> Option<(Solution<'b>, f64)> {
        let Point { direction, .. } = &self.last;
        let moved_by = abscissa - self.last.abscissa;
        let is_before = |failed: f64| (failed - abscissa) * moved_by >= 0.0;
        if moved_by / direction.abscissa < 0.5 * self.step || self.failed.is_some_and(is_before) {
            return None;
        }
        let [from_hz, frequency_hz] =
            [self.last.abscissa, abscissa].map(|at| over.frequency_hz(at));
        let slope = direction.u.iter().map(|u| u / direction.abscissa);
        let (u, slope) = if from_hz == frequency_hz {
            let both = self.last.u.iter().zip(slope);
            (both.map(|(u, slope)| u + moved_by * slope).collect(), None)
        } else {
            (self.last.u.clone(), Some(slope.collect()))
        };
        let neighbour = Neighbour {
            frequency_hz: from_hz,
            u,
            slope,
            mean: self.last.mean,
        };
        let solver = self.solvers(over).at(abscissa)?;
        let found = solver.solve(frequency_hz, Some(&neighbour), work);
        self.failed = (!found.is_converged()).then_some(abscissa);
        found.is_converged().then_some((found, abscissa))
    }

    /// U and the abscissa a step ahead: on the cubic through the last two points, or along the
    /// direction of the last one.
    fn predicted(&self, h: f64) -> (Vec<f64>, f64) {
        let last = &self.last;
        let before = self.before.as_ref();
        let before = before.filter(|b| b.mean == last.mean && b.u.len() == last.u.len());
        if let Some(before) = before {
            return between(before, last, 1.0 + h / (last.length - before.length));
        }
        last.ahead(h)
    }

    /// Point at a solution, the one after the last.
    fn point<'b>(
        &self,
        over: &'b dyn Over<'b>,
        at: (&Solution<'_>, f64),
        reached: Vec<f64>,
        work: &mut Work,
    ) -> Option<Point> {
        let last = &self.last;
        let both = reached.iter().zip(&last.motion);
        let moved: Vec<f64> = both.map(|(a, b)| a - b).collect();
        let own = self.scales(&reached);
        // A step is measured by what the motion is in its middle, as its ends are by theirs.
        let middle = Scales {
            motion: (own.motion * last.scales.motion).sqrt(),
            ..own
        };
        let distance = middle.length(&moved, at.1 - last.abscissa);
        let place = (own, last.length + distance);
        let solvers = self.solvers(over);
        Point::at(solvers, at, reached, &Ahead::As(last), place, work)
    }

    /// Fractions of the curve between the last point and `next` at which it crosses an abscissa.
    fn crossings(&self, abscissa: f64, next: &Point) -> Vec<f64> {
        let off = |t: f64| abscissa_between(&self.last, next, t) - abscissa;
        let at = |i: u32| f64::from(i) / f64::from(PARTS);
        let crosses = |i: &u32| (off(at(*i)) > 0.0) != (off(at(i + 1)) > 0.0);
        let root = |i: u32| {
            let (mut low, mut high) = (at(i), at(i + 1));
            let begins_above = off(low) > 0.0;
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                if (off(middle) > 0.0) == begins_above {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            0.5 * (low + high)
        };
        (0..PARTS).filter(crosses).map(root).collect()
    }

    /// Solution at an abscissa that the curve crosses at this fraction between the last point and
    /// `next`.
    fn at_abscissa<'b>(
        &self,
        over: &'b dyn Over<'b>,
        abscissa: f64,
        (fraction, next): (f64, &Point),
        work: &mut Work,
    ) -> Option<Found<'b>> {
        let last = &self.last;
        let (u, _) = between(last, next, fraction);
        let plane = self.at_one(abscissa, u.len());
        let start = (&u[..], abscissa);
        let newton = self.newton(over, abscissa)?;
        let (solution, _) = self.corrected(over, &plane, start, last.mean, newton, work)?;
        Some(Found {
            solution,
            abscissa,
            length: last.length + fraction * (next.length - last.length),
        })
    }
}

impl Point {
    /// Cosine of the angle between the curve here and at another point.
    fn cosine(&self, other: &Self) -> f64 {
        let along = (&other.motion_along[..], other.direction.abscissa);
        let own = (&self.motion_along[..], self.direction.abscissa);
        self.scales.product(own, along) / self.scales.length(along.0, along.1)
    }

    /// Change of T and of the abscissa to another point.
    fn to(&self, other: &Self) -> (Vec<f64>, f64) {
        let both = other.motion.iter().zip(&self.motion);
        let change = both.map(|(there, here)| there - here).collect();
        (change, other.abscissa - self.abscissa)
    }

    /// Lengths from here, and back from another point, at which the tangents of the curve come
    /// closest to each other.
    pub fn ways_to_meeting(&self, other: &Self) -> [f64; 2] {
        let (joins, joins_along) = self.to(other);
        let [own, its] = [self, other].map(|p| (&p.motion_along[..], p.direction.abscissa));
        let joins = (&joins[..], joins_along);
        let product = |a, b| self.scales.product(a, b);
        let (aa, bb, ab) = (product(own, own), product(its, its), product(own, its));
        let (aj, bj) = (product(own, joins), product(its, joins));
        let determinant = aa * bb - ab * ab;
        [aj * bb - bj * ab, bj * aa - aj * ab].map(|way| way / determinant)
    }

    /// Turns the direction of the curve round.
    pub fn turn(&mut self) {
        let along = self.direction.u.iter_mut().chain(&mut self.motion_along);
        let heights = self.heights.iter_mut().map(|height| &mut height.along_m);
        (along.chain(&mut self.across.0).chain(heights)).for_each(|v| *v = -*v);
        self.direction.abscissa = -self.direction.abscissa;
        self.across.1 = -self.across.1;
    }

    /// The point with so many unknowns: harmonics that it does not have are zero.
    pub fn resized(mut self, unknowns: usize) -> Self {
        for of_harmonics in [&mut self.u, &mut self.direction.u, &mut self.across.0] {
            *of_harmonics = resized(of_harmonics, unknowns);
        }
        self
    }

    /// U and the abscissa so far along the direction of the point.
    fn ahead(&self, length: f64) -> (Vec<f64>, f64) {
        let mut u = self.u.clone();
        axpy(length, &self.direction.u, &mut u);
        (u, self.abscissa + length * self.direction.abscissa)
    }

    /// Plane across the direction of the point, through `at`, in units of the step h.
    fn plane(&self, h: f64, at: (&[f64], f64)) -> Plane {
        let (row, corner) = &self.across;
        Plane::across((row, *corner), h, at)
    }

    /// Point at a solution with its motion. `place` has the scales there and the length of the curve
    /// up to it.
    fn at(
        solvers: Solvers<'_>,
        (solution, abscissa): (&Solution<'_>, f64),
        motion: Vec<f64>,
        ahead: &Ahead<'_>,
        (scales, length): (Scales, f64),
        work: &mut Work,
    ) -> Option<Self> {
        let gauge = gauge(solvers, &solution.balance, (&solution.u, abscissa))?;
        let across = |along: &[f64], along_by: f64| scales.across(&gauge, along, along_by);
        let (row, corner) = match ahead {
            Ahead::Abscissa(sign) => (vec![0.0; solution.u.len()], *sign),
            Ahead::As(point) => across(&point.motion_along, point.direction.abscissa),
            Ahead::Along(motion_along, along_by) => across(motion_along, *along_by),
        };
        let mut direction = direction(solvers, (solution, abscissa), (&row, corner), work)?;
        let mut motion_along = gauge.along(&direction);
        // Of length 1.
        let by = scales.length(&motion_along, direction.abscissa).recip();
        motion_along.iter_mut().for_each(|t| *t *= by);
        direction.u.iter_mut().for_each(|u| *u *= by);
        direction.abscissa *= by;
        let heights = heights(solvers, (solution, abscissa), &direction)?;
        Some(Self {
            heights,
            abscissa,
            u: solution.u.clone(),
            mean: solution.balance.mean(),
            motion,
            across: across(&motion_along, direction.abscissa),
            scales,
            direction,
            motion_along,
            length,
        })
    }
}

/// Motion T of a solution.
fn motion_of(solvers: Solvers<'_>, solution: &Solution<'_>, abscissa: f64) -> Vec<f64> {
    let frequency_hz = solvers.over.frequency_hz(abscissa);
    motion(&solution.balance, &solution.u, frequency_hz)
}

/// Gauge at a point of a balance; `None` where there are no models near it.
fn gauge(
    solvers: Solvers<'_>,
    balance: &Balance<'_>,
    (u, abscissa): (&[f64], f64),
) -> Option<Gauge> {
    let slope = (solvers.over).motion_slope(solvers.place(balance, u, abscissa))?;
    let frequency_hz = solvers.over.frequency_hz(abscissa);
    Some(Gauge::at(balance, u, frequency_hz, slope))
}

/// Observed amplitudes at a solution, and their changes along a direction of length 1.
fn heights(
    solvers: Solvers<'_>,
    (solution, abscissa): (&Solution<'_>, f64),
    direction: &Direction,
) -> Option<Vec<Height>> {
    let Solution { balance, u, .. } = solution;
    let place = solvers.place(balance, u, abscissa);
    let at = |length: f64| {
        let mut u = u.clone();
        axpy(length, &direction.u, &mut u);
        (solvers.over).amplitudes_near(place, &u, length * direction.abscissa)
    };
    let (here, ahead, behind) = (at(0.0)?, at(DIFFERENCE)?, at(-DIFFERENCE)?);
    let changes = ahead.iter().zip(&behind).map(|(a, b)| a - b);
    let both = here.iter().zip(changes);
    let heights = both.map(|(amplitude_m, change)| Height {
        amplitude_m: *amplitude_m,
        along_m: change / (2.0 * DIFFERENCE),
    });
    Some(heights.collect())
}

/// U and abscissa of the cubic through two points and their directions, 0 at the first and 1 at
/// the second.
fn between(first: &Point, second: &Point, t: f64) -> (Vec<f64>, f64) {
    let [at_first, at_second, along_first, along_second] = weights(first, second, t);
    let mut u: Vec<f64> = first.u.iter().map(|u| at_first * u).collect();
    axpy(at_second, &second.u, &mut u);
    axpy(along_first, &first.direction.u, &mut u);
    axpy(along_second, &second.direction.u, &mut u);
    (u, abscissa_between(first, second, t))
}

/// Abscissa of the cubic, as [`between`] has it.
fn abscissa_between(first: &Point, second: &Point, t: f64) -> f64 {
    let [at_first, at_second, along_first, along_second] = weights(first, second, t);
    at_first * first.abscissa
        + at_second * second.abscissa
        + along_first * first.direction.abscissa
        + along_second * second.direction.abscissa
}

/// Weights of the values and of the directions of two points in the cubic through both.
fn weights(first: &Point, second: &Point, t: f64) -> [f64; 4] {
    let span = second.length - first.length;
    let at_second = t * t * (3.0 - 2.0 * t);
    let along_first = span * t * (1.0 - t) * (1.0 - t);
    let along_second = span * t * t * (t - 1.0);
    [1.0 - at_second, at_second, along_first, along_second]
}
