//! Gaps of a branch: the abscissa at which the next motion is looked for where it was lost, or where
//! none was found.

use super::Follower;
use crate::dlft::branch::followed::part_of;
use crate::dlft::branch::trace::Course;
use crate::dlft::{Part, SolvedFrequency};

/// Distance, as a fraction of the range, at which the next motion is looked for where a branch
/// cannot be followed.
const GAP: f64 = 0.005;
/// The same distance where no motion was found over a longer range, as a fraction of that range.
const GROWTH: f64 = 0.5;

impl Follower<'_> {
    /// Looks for the next motion behind a gap after an abscissa.
    pub(super) fn skip_gap(&mut self, abscissa: f64) {
        self.next = next_abscissa(self.course, abscissa, self.gap(), self.next);
    }

    /// Width of a gap.
    fn gap(&self) -> f64 {
        GAP * self.course.range()
    }

    /// Looks for the next motion behind the abscissa at which one was looked for last: the farther,
    /// the longer none was found.
    pub(super) fn skip_failed_start(&mut self) {
        let is_begun = |p: &SolvedFrequency| part_of(p) == Some(Part::Begun);
        let Some(last) = self.branch.points.iter().rposition(is_begun) else {
            return;
        };
        let begun = self.branch.points[last].abscissa();
        self.look_farther(begun, last + 1);
    }

    /// Looks for the next motion behind an abscissa without a model.
    pub(super) fn skip_missing_model(&mut self, abscissa: f64) {
        self.look_farther(abscissa, self.branch.points.len());
    }

    /// Looks for the next motion behind an abscissa at which none was found, the farther, the longer
    /// none of the first `known` points has one.
    fn look_farther(&mut self, abscissa: f64, known: usize) {
        let mut before = self.branch.points[..known].iter().rev();
        let last_balanced = before.find(|p| p.orbit.outcome.is_balanced());
        let from = last_balanced.map_or(self.course.from, SolvedFrequency::abscissa);
        let gap = (self.gap()).max(GROWTH * (abscissa - from).abs());
        self.next = next_abscissa(self.course, abscissa, gap, abscissa);
    }
}

/// Abscissa behind a gap after another one, within the course, and not behind the one at which a
/// motion was looked for last: a branch that turned back may be lost on its way back.
fn next_abscissa(course: Course, abscissa: f64, gap: f64, looked_for: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_looked_for_ever_further_on_and_last_at_the_end() {
        for (from, to) in [(100.0, 200.0), (200.0, 100.0)] {
            let course = Course { from, to };
            let at = |share: f64| from + share * (to - from);
            let next = |share: f64, looked_for: f64| {
                next_abscissa(course, at(share), GAP * course.range(), at(looked_for))
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
