//! Points that are added to a curve at its peaks and folds.

use super::fold_between::fold_between;
use super::tops::{Top, top_of_curve};
use super::{Follower, RECENT};
use crate::dlft::Part;
use crate::dlft::branch::over::{ContinuationParameter, Solvers};
use crate::dlft::branch::trace::{CurvePoint, CurveSolution, FoldStart, Tracer};
use crate::dlft::point::SolverWork;

/// Most points that are added at a peak or a fold.
const MOST_ADDED: usize = 8;
/// Where no motion is found at a place of a peak, it is looked for this fraction of the way nearer to
/// the points on both sides.
const BESIDE: f64 = 0.05;
/// A fold is found where the tangents of the points on both sides of it meet no farther beyond them
/// than this fraction of the range.
const FOLD_ERROR: f64 = 2e-4;

impl Follower<'_> {
    /// Adds points where an observed amplitude has a peak between the last points, until nothing
    /// tells of a top above the highest of them.
    pub(super) fn refine_peaks(&mut self, over: &dyn ContinuationParameter) {
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
                let peak = tries.into_iter().find_map(|(off, may_retain)| {
                    let solve =
                        |tracer: &Tracer, ends: [&CurvePoint; 2], length, work: &mut SolverWork| {
                            tracer.inside(over, ends, length, may_retain, work)
                        };
                    self.add(over, solve, ends.each_ref(), length + off)
                });
                let Some(added) = peak else {
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
    pub(super) fn refine_fold(&mut self, over: &dyn ContinuationParameter) {
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
            let solve = |tracer: &Tracer, ends: [&CurvePoint; 2], length, work: &mut SolverWork| {
                tracer.solve_near_fold(over, ends, start, length, work)
            };
            let total = ways[0].max(0.0) + ways[1].max(0.0);
            let per_way = (second.length - first.length) / total;
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
    fn add(
        &mut self,
        over: &dyn ContinuationParameter,
        solve: impl Fn(&Tracer, [&CurvePoint; 2], f64, &mut SolverWork) -> Option<CurveSolution>,
        ends: [&CurvePoint; 2],
        length: f64,
    ) -> Option<CurvePoint> {
        let run = self.run;
        let tracer = self.tracer.as_ref()?;
        self.work.start_counting(run.most_seconds);
        let work = &mut self.work;
        let mut solution = solve(tracer, ends, length, work)?;
        let level = self.level;
        let solvers = Solvers { over, level };
        let (at, length) = (solution.abscissa, solution.length);
        solution.solution = solvers.curve_solution(at, solution.solution, work)?;
        let point = tracer.point_at(over, &solution, ends, work)?;
        let resolved = run.judged_at(solvers, at, solution.solution, work)?;
        self.record(over, resolved, at, length, Part::Added);
        Some(point)
    }
}
