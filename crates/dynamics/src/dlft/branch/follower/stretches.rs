//! Stretches of a branch, at whose ends an interrupted run goes on to the same bits.

use super::{Follower, RECENT, remember};
use crate::dlft::branch::followed::part_of;
use crate::dlft::branch::over::{ContinuationParameter, Solvers};
use crate::dlft::branch::trace::Tracer;
use crate::dlft::point::SolverWork;
use crate::dlft::{Part, SolvedFrequency, SweepProgress};

/// Frequencies of a stretch at least. At the end of one the follower goes on from what is recorded
/// of its points, with nothing else that only speeds up the solution: an interrupted run continues
/// there, to the same bits.
pub(crate) const STRETCH: usize = 20;

impl Follower<'_> {
    /// Takes over the stretches of the branch that an earlier run completed.
    pub(super) fn restore(&mut self) {
        let earlier = self.run.earlier_points(self.from_last);
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
            (self.run.tell)(SweepProgress::Solved(solved));
            self.branch.keep(solved.clone());
        }
        let last = self.branch.points.iter().filter_map(|p| p.along.as_ref());
        if let Some(last) = last.map(|a| a.step).max() {
            self.step = last + 1;
            self.begin_stretch(&*self.parameter());
        }
    }

    /// Goes on from what is recorded of the last points alone.
    pub(super) fn begin_stretch(&mut self, over: &dyn ContinuationParameter) {
        self.stretch_from = self.solved;
        self.work = SolverWork::default();
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
        self.skip_failed_start();
        // No direction was found: the branch is lost where it came to, not where it began.
        if self.tracer.is_none()
            && let Some(last) = self.branch.points.last().map(SolvedFrequency::abscissa)
        {
            self.skip_gap(last);
        }
    }
}
