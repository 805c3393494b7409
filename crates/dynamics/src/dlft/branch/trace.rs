//! Steps along a curve: prediction, correction, and the length of the next step.
//!
//! `point` is a point with its direction, and `cubic` joins two of them. `correction` solves for a
//! point from a prediction. `passed` and `inside` find further points between two: at the abscissae
//! asked for, and at a peak or a fold.

mod correction;
mod cubic;
mod inside;
mod passed;
mod point;

pub(crate) use inside::FoldStart;
pub(crate) use point::{CurvePoint, Height};

use self::cubic::{bisected, interpolate};
use self::point::{Ahead, Measured, motion_of};
use super::bordered::Prediction;
use super::gauge::{Change, Scales};
use super::over::{ContinuationParameter, SolutionAt, Solvers};
use crate::dlft::point::{Solution, SolverWork};
use crate::dlft::{Heading, SolvedFrequency};
use dovetail_numerics::nonlinear::NewtonOptions;
use dovetail_numerics::vector::norm;

/// Error of the cubics that join the points of a branch, relative to |T|, by which steps are
/// chosen.
const CURVE_ERROR: f64 = 1e-3;
/// First step.
const FIRST_STEP: f64 = 0.02;
/// Step behind a corner.
const BEHIND_CORNER: f64 = 0.06;
/// Step from a top, at which a resonance has fallen by 4 %, and one that friction flattens by less.
const BEYOND_TOP: f64 = 0.3;
/// Longest step: by it what is observed changes by a half.
const LONGEST_STEP: f64 = 0.5;
/// Shortest step: where it fails, the curve cannot be followed on.
const SHORTEST_STEP: f64 = 1e-7;
/// Shortest step behind [`MOST_SHORT_STEPS`] shorter ones.
pub(crate) const SHORT_STEP: f64 = 1e-4;
/// Most steps in a row that are shorter on average than [`SHORT_STEP`]. A few lead round the fold at
/// which a contact is just touched. At the frequency of an undamped mode, where the balance has a
/// pole, each of thousands would find a motion.
pub(crate) const MOST_SHORT_STEPS: usize = 40;
/// Newton iterations allowed to a step.
const MOST_ITERATIONS: usize = 12;
/// A step that has been halved so many times is tried at its abscissa, too, once.
const BEFORE_ABSCISSA: usize = 1;
/// Least cosine of the angle by which a step may turn.
const LEAST_COSINE: f64 = 0.7;
/// A step that turns by more is shortened to this length, and then passes a corner of the contact
/// law.
const CORNER_STEP: f64 = 5e-3;
/// A step has left the curve where its end lies so many steps from its beginning.
const FAR: f64 = 2.0;
/// The error of the cubic through both ends of a step is this fraction of the error of the cubic
/// that was continued to its end: both are the fourth derivative of T, divided by 24, times a
/// product of four distances, `(h / 2)^4` at the middle and `4 h^4` at the end of an equal step.
const INTERPOLATED: f64 = 1.0 / 64.0;
/// A step is taken again where the cubic is off by so many times what is allowed.
const TOO_FAR_OFF: f64 = 30.0;
/// |T| is measured against this fraction of its largest value where it is smaller.
const LEAST_MOTION: f64 = 0.01;
/// Scale of the motion where nothing moves, m. Its square is no zero.
const NO_MOTION_M: f64 = 1e-150;

/// Range of the abscissa through which a curve is followed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Course {
    /// Abscissa at which the curve begins.
    pub from: f64,
    /// Abscissa at which it ends.
    pub to: f64,
}

impl Course {
    /// Range from the first to the last of these abscissae; at 0 where there is none.
    pub(crate) fn spanning(abscissae: &[f64]) -> Self {
        let [from, to] =
            [abscissae.first(), abscissae.last()].map(|end| end.copied().unwrap_or_default());
        Self { from, to }
    }

    /// Length of the range.
    pub(crate) fn range(self) -> f64 {
        (self.to - self.from).abs()
    }
}

/// Follower of one curve.
#[derive(Clone)]
pub(crate) struct Tracer {
    /// Level of the harmonics.
    level: usize,
    course: Course,
    /// Last two points.
    before: Option<CurvePoint>,
    last: CurvePoint,
    step: f64,
    largest_motion: f64,
    /// Length of the curve up to which abscissae asked for have been passed.
    passed_length: f64,
    /// Abscissa ahead at which no solution was found: a fold may lie before it.
    failed: Option<f64>,
}

/// Abscissae at which a step solves for motions where it passes them.
#[derive(Clone, Copy)]
pub(crate) struct Asked<'a> {
    /// At all of these.
    pub each: &'a [f64],
    /// Where it passes none of the others, at the one of these that is passed last: those of points of
    /// the curve.
    pub last: &'a [f64],
}

/// Solution on the curve, with its abscissa, and the length of the curve up to it.
pub(crate) struct CurveSolution {
    /// The solution.
    pub solution: Solution,
    /// Its abscissa.
    pub abscissa: f64,
    /// Length of the curve up to it.
    pub length: f64,
}

/// Points of the curve that a step came to.
pub(crate) struct CurveStep {
    /// Points at the abscissae asked for that the step passed, in their order.
    pub passed: Vec<CurveSolution>,
    /// Point at the end of the step; `None` where the curve left the range within it, or could not
    /// be followed at all.
    pub reached: Option<CurveSolution>,
    /// `true` if the curve left the range. The last of those passed is then its end.
    pub leaves: bool,
}

impl Tracer {
    /// Follower that begins at a solution, and goes towards the second abscissa of the course.
    /// `None` where no direction is found.
    pub(crate) fn start(
        solvers: Solvers<'_>,
        course: Course,
        at: SolutionAt<'_>,
        work: &mut SolverWork,
    ) -> Option<Self> {
        let motion = motion_of(solvers.over, at);
        let scales = Scales {
            motion: norm(&motion).max(NO_MOTION_M),
            range: course.range(),
        };
        let measured = Measured {
            motion,
            scales,
            length: 0.0,
        };
        let ahead = Ahead::Abscissa((course.to - course.from).signum());
        Some(Self {
            last: CurvePoint::new(solvers, at, measured, &ahead, work)?,
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
    pub(crate) fn restart(
        self,
        solvers: Solvers<'_>,
        solution: &Solution,
        work: &mut SolverWork,
    ) -> Option<Self> {
        let abscissa = self.last.abscissa;
        let at = SolutionAt { solution, abscissa };
        let motion = motion_of(solvers.over, at);
        let scales = self.scales(&motion);
        let passed_length = self.last.length;
        let measured = Measured {
            motion,
            scales,
            length: passed_length,
        };
        let ahead = Ahead::Along(self.last.tangent());
        let mut last = CurvePoint::new(solvers, at, measured, &ahead, work)?;
        if self.last.is_opposite_with_other_harmonics(&last) {
            last.turn();
        }
        Some(Self {
            last,
            largest_motion: self.largest_motion.max(scales.motion),
            level: solvers.level,
            course: self.course,
            before: None,
            step: if solution.u.len() < self.last.u.len() {
                0.5 * self.step
            } else {
                self.step.min(FIRST_STEP)
            },
            passed_length,
            failed: None,
        })
    }

    /// Follower that goes on from a solution that is recorded with its heading, behind another
    /// point. `passed_length` is the length of the curve up to which it is known.
    pub(crate) fn resumed(
        solvers: Solvers<'_>,
        course: Course,
        solved: &SolvedFrequency,
        before: Option<CurvePoint>,
        passed_length: f64,
        work: &mut SolverWork,
    ) -> Option<Self> {
        let along = solved.along.as_ref()?;
        let heading = along.heading.as_ref()?;
        let abscissa = along.abscissa;
        let (solver, frequency_hz) = (
            solvers.solver(abscissa)?,
            solvers.over.frequency_hz(abscissa),
        );
        let solution = solver.evaluated(frequency_hz, &solved.orbit.x, solved.orbit.mean)?;
        let solution = &solution;
        let at = SolutionAt { solution, abscissa };
        let measured = Measured {
            motion: motion_of(solvers.over, at),
            scales: Scales {
                motion: heading.scale_m,
                range: course.range(),
            },
            length: along.length,
        };
        let ahead = Ahead::Along(Change {
            motion: heading.motion_m.clone(),
            abscissa: heading.abscissa,
        });
        Some(Self {
            last: CurvePoint::new(solvers, at, measured, &ahead, work)?,
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
    pub(crate) fn heading(&self) -> Heading {
        Heading {
            motion_m: self.last.motion_along.clone(),
            abscissa: self.last.direction.abscissa,
            scale_m: self.last.scales.motion,
            largest_m: self.largest_motion,
            next_step: self.step,
        }
    }

    /// Solvers of the points of the curve.
    fn solvers<'a>(&self, over: &'a dyn ContinuationParameter) -> Solvers<'a> {
        Solvers {
            over,
            level: self.level,
        }
    }

    /// Criteria that end the iterations at an abscissa; `None` where there is no model.
    fn newton(&self, over: &dyn ContinuationParameter, abscissa: f64) -> Option<NewtonOptions> {
        Some(self.solvers(over).solver(abscissa)?.newton)
    }

    /// Last point.
    pub(crate) fn last(&self) -> &CurvePoint {
        &self.last
    }

    /// Counts the length of the curve from here on from `length`.
    pub(crate) fn set_length(&mut self, length: f64) {
        self.last.length = length;
        self.passed_length = length;
        self.before = None;
    }

    /// Goes up from the last point, to larger amplitudes of an observed displacement, with a first
    /// step past the top that a resonance has there. `None` without that displacement.
    pub(crate) fn head_for_peak(&mut self, observation: usize) -> Option<()> {
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
    pub(crate) fn step_back(&mut self) {
        if let Some(before) = self.before.take() {
            self.last = before;
        }
    }

    /// Shortens the next step. Returns `false` where it would be too short.
    pub(crate) fn shorten(&mut self) -> bool {
        self.step *= 0.25;
        self.step >= SHORT_STEP
    }

    /// Takes a step along the curve, shortened until it succeeds. `creeps`: many short steps lie behind it, and no shorter one than
    /// [`SHORT_STEP`] is taken.
    pub(crate) fn step(
        &mut self,
        over: &dyn ContinuationParameter,
        asked: &Asked<'_>,
        creeps: bool,
        work: &mut SolverWork,
    ) -> CurveStep {
        let shortest = if creeps { SHORT_STEP } else { SHORTEST_STEP };
        self.step = self.step.max(2.0 * shortest);
        let mut failures = 0;
        while self.step >= shortest {
            let was_long = 2.0 * self.step > CORNER_STEP && self.step <= CORNER_STEP;
            let by_abscissa = failures == BEFORE_ABSCISSA || was_long;
            match self.attempt(over, asked, by_abscissa, work) {
                Some(step) => return step,
                None => self.step *= 0.5,
            }
            failures += 1;
        }
        CurveStep {
            passed: Vec::new(),
            reached: None,
            leaves: false,
        }
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
    fn attempt(
        &mut self,
        over: &dyn ContinuationParameter,
        asked: &Asked<'_>,
        by_abscissa: bool,
        work: &mut SolverWork,
    ) -> Option<CurveStep> {
        let h = self.step;
        let CurvePoint { scales, mean, .. } = self.last;
        let plane = self.last.plane(h, &self.last.extrapolate(h));
        let predicted = self.predicted(h);
        if let Some(end) = over.end_before(predicted.abscissa) {
            return self.attempt_end(over, end, asked, work);
        }
        let newton = self.newton(over, self.last.abscissa)?;
        let options = NewtonOptions {
            max_iterations: MOST_ITERATIONS.min(newton.max_iterations),
            ..newton
        };
        let found = self.corrected(over, &plane, &predicted, mean, options, work);
        let (found, abscissa) = match found {
            Some(found) => found,
            None if by_abscissa => self.solve_ahead(over, predicted.abscissa, work)?,
            None => return None,
        };
        let solution = &found;
        let at = SolutionAt { solution, abscissa };
        let reached = motion_of(over, at);
        if scales.length(&self.last.change_to(&reached, abscissa)) > FAR * h {
            return None;
        }
        let next = self.point(over, at, reached, work)?;
        let is_corner = self.last.cosine(&next) < LEAST_COSINE;
        let may_shorten = h > 4.0 * SHORTEST_STEP;
        if is_corner && h > CORNER_STEP && may_shorten {
            return None;
        }
        let along = next.tangent();
        let length = scales.length(&along);
        // Distance of the prediction from the curve: what it is off along the curve is no error.
        let off = self.miss(over, at, &next.motion, &predicted)?;
        let along_curve = scales.product(&off, &along) / length;
        let off = scales.length(&off).powi(2) - along_curve * along_curve;
        let error = INTERPOLATED * off.max(0.0).sqrt() / CURVE_ERROR;
        if error > TOO_FAR_OFF && may_shorten {
            return None;
        }
        let Course { from, to } = self.course;
        let leaves = !(from.min(to)..=from.max(to)).contains(&abscissa);
        let mut passed = self.passed_before(over, &next, leaves, asked, work)?;
        if !leaves && self.is_long(&next) {
            if passed.is_empty() {
                passed.push(self.middle(over, &next, work)?);
            }
            let is_near = |found| self.is_near_cubic(over, &next, found);
            if !passed.iter().all(|found| is_near(found).unwrap_or(false)) {
                return None;
            }
        }
        self.passed_length = passed.last().map_or(self.passed_length, |p| p.length);
        let by_error = 0.9 * error.max(1e-9).powf(-0.25);
        let most = if found.end.iterations > 7 { 0.7 } else { 2.0 };
        self.step = (h * by_error.clamp(0.3, most)).min(LONGEST_STEP);
        if is_corner {
            self.step = BEHIND_CORNER;
        }
        self.largest_motion = self.largest_motion.max(norm(&next.motion));
        let reached = CurveSolution {
            abscissa,
            length: next.length,
            solution: found,
        };
        if !leaves {
            self.before = Some(std::mem::replace(&mut self.last, next));
        }
        Some(CurveStep {
            passed,
            reached: (!leaves).then_some(reached),
            leaves,
        })
    }

    /// Tries a step to the end of a range that a whole step would leave, and beyond which there are no
    /// models; `None` where a shorter one is to be tried.
    fn attempt_end(
        &mut self,
        over: &dyn ContinuationParameter,
        end: f64,
        asked: &Asked<'_>,
        work: &mut SolverWork,
    ) -> Option<CurveStep> {
        let (step, last) = (self.step, &self.last);
        let is_before = |h: f64| (self.predicted(h).abscissa - end) * (last.abscissa - end) > 0.0;
        let [low, _] = bisected([0.0, step], is_before);
        if low == 0.0 {
            return None;
        }
        let predicted = Prediction {
            abscissa: end,
            ..self.predicted(low)
        };
        let plane = self.abscissa_plane(end, predicted.u.len());
        let newton = self.newton(over, end)?;
        let (found, _) = self.corrected(over, &plane, &predicted, last.mean, newton, work)?;
        let at = SolutionAt {
            solution: &found,
            abscissa: end,
        };
        let next = self.point(over, at, motion_of(over, at), work)?;
        let distance = next.length - last.length;
        if step > 4.0 * SHORTEST_STEP && (distance > FAR * low || last.cosine(&next) < LEAST_COSINE)
        {
            return None;
        }
        let each: Vec<f64> = (asked.each.iter().copied())
            .filter(|at| *at != end)
            .collect();
        let asked = Asked {
            each: &each,
            ..*asked
        };
        let mut passed = self.passed_before(over, &next, false, &asked, work)?;
        passed.push(CurveSolution {
            solution: found,
            abscissa: end,
            length: next.length,
        });
        self.passed_length = next.length;
        Some(CurveStep {
            passed,
            reached: None,
            leaves: true,
        })
    }

    /// U and the abscissa a step ahead: on the cubic through the last two points, or along the
    /// direction of the last one.
    fn predicted(&self, h: f64) -> Prediction {
        let last = &self.last;
        let before = self.before.as_ref();
        // No cubic leads through a corner.
        let before = before.filter(|b| {
            b.mean == last.mean && b.u.len() == last.u.len() && b.cosine(last) >= LEAST_COSINE
        });
        if let Some(before) = before {
            return interpolate(before, last, 1.0 + h / (last.length - before.length));
        }
        last.extrapolate(h)
    }

    /// Point at a solution of this motion, the one after the last.
    fn point(
        &self,
        over: &dyn ContinuationParameter,
        at: SolutionAt<'_>,
        reached: Vec<f64>,
        work: &mut SolverWork,
    ) -> Option<CurvePoint> {
        let last = &self.last;
        let scales = self.scales(&reached);
        // A step is measured by what the motion is in its middle, as its ends are by theirs.
        let middle = Scales {
            motion: (scales.motion * last.scales.motion).sqrt(),
            ..scales
        };
        let distance = middle.length(&last.change_to(&reached, at.abscissa));
        let measured = Measured {
            motion: reached,
            scales,
            length: last.length + distance,
        };
        let ahead = Ahead::Along(last.tangent());
        let mut point = CurvePoint::new(self.solvers(over), at, measured, &ahead, work)?;
        if last.runs_against(&point, self.solvers(over)) {
            point.turn();
        }
        Some(point)
    }
}
