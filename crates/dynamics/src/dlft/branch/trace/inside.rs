//! Further points between two points of a curve, at a peak or beside a fold.

use super::cubic::interpolate;
use super::point::{Ahead, CurvePoint, Measured, gauge, motion_of};
use super::{CurveSolution, Tracer};
use crate::dlft::branch::bordered::{Plane, Prediction};
use crate::dlft::branch::gauge::Change;
use crate::dlft::branch::over::{ContinuationParameter, SolutionAt};
use crate::dlft::point::SolverWork;

/// Start for a point at a fold, so far along the tangent of one of two points beside the fold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum FoldStart {
    /// Ahead of the first point.
    AheadOfFirst(f64),
    /// Behind the second one.
    BehindSecond(f64),
}

/// The middle of a step is solved, too, where it passes more than this part of the range.
const LONG_STEP: f64 = 0.05;
/// Most distance of a solution within such a step from the cubic through its ends.
const MIDDLE_ERROR: f64 = 0.01;

impl Tracer {
    /// Returns `true` if the abscissa makes up most of a step through a large part of its range: what
    /// happens on the way need not show at its ends.
    pub(super) fn is_long(&self, next: &CurvePoint) -> bool {
        let part = (next.abscissa - self.last.abscissa).abs() / self.course.range();
        part > LONG_STEP && 2.0 * part > next.length - self.last.length
    }

    /// Solution in the middle of a step; `None` where none is found.
    pub(super) fn middle(
        &self,
        over: &dyn ContinuationParameter,
        next: &CurvePoint,
        work: &mut SolverWork,
    ) -> Option<CurveSolution> {
        let length = 0.5 * (self.last.length + next.length);
        self.inside(over, [&self.last, next], length, false, work)
    }

    /// Returns `true` if a solution within a step is near the cubic through both ends; `None` without
    /// a model.
    pub(super) fn is_near_cubic(
        &self,
        over: &dyn ContinuationParameter,
        next: &CurvePoint,
        found: &CurveSolution,
    ) -> Option<bool> {
        let last = &self.last;
        let fraction = (found.length - last.length) / (next.length - last.length);
        let predicted = interpolate(last, next, fraction);
        let at = SolutionAt {
            solution: &found.solution,
            abscissa: found.abscissa,
        };
        let motion = motion_of(over, at);
        let off = self.miss(over, at, &motion, &predicted)?;
        Some(self.scales(&motion).length(&off) <= MIDDLE_ERROR)
    }

    /// Change of T and of the abscissa from a prediction to the motion of a solution.
    pub(super) fn miss(
        &self,
        over: &dyn ContinuationParameter,
        at: SolutionAt<'_>,
        motion: &[f64],
        predicted: &Prediction,
    ) -> Option<Change> {
        let (balance, abscissa) = (&at.solution.balance, at.abscissa);
        let place = self.solvers(over).place(balance, &predicted.u, abscissa);
        let expected = over.motion_at(place, predicted.abscissa)?;
        let both = motion.iter().zip(&expected);
        Some(Change {
            motion: both.map(|(found, expected)| found - expected).collect(),
            abscissa: abscissa - predicted.abscissa,
        })
    }

    /// Solution at a length of the curve between two points, with the mean of either. Where
    /// `may_retain` is true and neither is found, the mean may be retained where friction does not
    /// hold the bodies.
    pub(crate) fn inside(
        &self,
        over: &dyn ContinuationParameter,
        ends: [&CurvePoint; 2],
        length: f64,
        may_retain: bool,
        work: &mut SolverWork,
    ) -> Option<CurveSolution> {
        let [first, second] = ends;
        let span = second.length - first.length;
        let way = length - first.length;
        let on_cubic = interpolate(first, second, way / span);
        let plane = first.plane(span, &on_cubic);
        // Beside a corner the tangents of its sides are nearer to the curve than the cubic.
        let starts = [
            on_cubic,
            first.extrapolate(way),
            second.extrapolate(way - span),
        ];
        let (solution, abscissa) =
            self.corrected_between(ends, over, &plane, &starts, may_retain, work)?;
        Some(CurveSolution {
            solution,
            abscissa,
            length,
        })
    }

    /// Solution at a length of the curve between two points beside a fold, which may be a corner. It
    /// is looked for in the plane across the line that joins both points: a curve from one to the
    /// other crosses it however sharply it turns.
    pub(crate) fn solve_near_fold(
        &self,
        over: &dyn ContinuationParameter,
        ends: [&CurvePoint; 2],
        start: FoldStart,
        length: f64,
        work: &mut SolverWork,
    ) -> Option<CurveSolution> {
        let [first, second] = ends;
        let near = match start {
            FoldStart::AheadOfFirst(way) => first.extrapolate(way),
            FoldStart::BehindSecond(way) => second.extrapolate(-way),
        };
        let (joins, scales) = (first.to(second), first.scales);
        let squared = scales.length(&joins).powi(2);
        let solvers = self.solvers(over);
        let balance = solvers.balance(near.abscissa, first.mean)?;
        let gauge = gauge(over, solvers.place(&balance, &near.u, near.abscissa))?;
        let plane = Plane::normal_to(&scales.border_row(&gauge, &joins), squared, &near);
        let (solution, abscissa) =
            self.corrected_between(ends, over, &plane, &[near], true, work)?;
        Some(CurveSolution {
            solution,
            abscissa,
            length,
        })
    }

    /// Point at a solution between two points, with the direction of the curve: that of the point
    /// to whose direction it is nearer. Behind a corner the curve may run back.
    pub(crate) fn point_at(
        &self,
        over: &dyn ContinuationParameter,
        found: &CurveSolution,
        [first, second]: [&CurvePoint; 2],
        work: &mut SolverWork,
    ) -> Option<CurvePoint> {
        let at = SolutionAt {
            solution: &found.solution,
            abscissa: found.abscissa,
        };
        let motion = motion_of(over, at);
        let measured = Measured {
            scales: self.scales(&motion),
            motion,
            length: found.length,
        };
        let ahead = Ahead::Along(first.tangent());
        let mut point = CurvePoint::new(self.solvers(over), at, measured, &ahead, work)?;
        let [like_first, like_second] = [first, second].map(|p| p.cosine(&point));
        if like_second.abs() > like_first.abs() && like_second < 0.0 {
            point.turn();
        }
        Some(point)
    }
}
