//! Branches from both ends of a range of the abscissa, such as the frequency.

use super::followed::{Followed, assembled};
use super::follower::Follower;
use super::peak::Guess;
use super::several::several_motions;
use super::trace::Course;
use super::values::Values;
use crate::dlft::linear_curve::linear_curve;
use crate::dlft::point::{Neighbour, SolverWork};
use crate::dlft::sweep::{NumberedFrequency, SweepSolvers};
use crate::dlft::{Orbit, Response, SolvedFrequency, SweepProgress};

/// Parts of the range at whose ends the linear reference is known in any case.
const LINEAR_PARTS: usize = 200;

impl SweepSolvers<'_> {
    /// Follows the branches that begin at the two ends of these frequencies, each to the middle.
    /// Where they do not meet there, both are followed to where they leave the range: a curve that
    /// folds is then the same from both ends, and two branches that are not remain two.
    pub(super) fn followed(&self, asked_hz: &[f64]) -> Response {
        let course = Course::spanning(asked_hz);
        let mut response = assembled(self.branches(None, course, asked_hz));
        response.slip_threshold_m = self.slip_threshold_m;
        let (from_hz, to_hz) = (course.from, course.to);
        let even = (0..=LINEAR_PARTS)
            .map(|i| from_hz + (to_hz - from_hz) * i as f64 / LINEAR_PARTS as f64);
        let linear_hz = response.linear.iter().map(|p| p.frequency_hz);
        let mut frequencies_hz: Vec<f64> = linear_hz.chain(even).collect();
        frequencies_hz.sort_by(f64::total_cmp);
        frequencies_hz.dedup();
        response.linear_curve = linear_curve(&self.linear, self.harmonics(), &frequencies_hz);
        response.second_motions = several_motions(&response);
        response
    }

    /// Follows the branches that begin at the two ends of a range of values, as
    /// [`SweepSolvers::followed`] does.
    pub(super) fn followed_over(&self, values: &Values<'_>) -> Response {
        let asked = values.abscissae();
        let branches = self.branches(Some(values), Course::spanning(&asked), &asked);
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
            at_one.is_some_and(|(a, b)| a.orbit.has_same_vibration(&b.orbit))
        };
        let [first, second] = [&rising, &falling].map(|half| half.branch.truncated_at(middle));
        if same(first.points.last(), second.points.last()) {
            // A half that finds no motion at its end is better reached from the other one.
            let goes_on = match [&first, &second].map(|half| half.gaps.is_empty()) {
                [true, false] if values.is_some() => Some(&mut rising),
                [false, true] if values.is_some() => Some(&mut falling),
                _ => None,
            };
            if let Some(half) = goes_on {
                (self.tell)(SweepProgress::Apart);
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
        (self.tell)(SweepProgress::Apart);
        (rising.compared, falling.compared) = (second.abscissae(), first.abscissae());
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

    /// Follows the branch near a motion from its frequency towards both ends of these frequencies.
    pub(super) fn followed_through(&self, near: &Orbit, asked_hz: &[f64]) -> Response {
        let Course { from, to } = Course::spanning(asked_hz);
        let level = self.refinement.level_of(near.harmonics);
        let half = |to: f64, from_last: bool| {
            let course = Course {
                from: near.frequency_hz,
                to,
            };
            let follower = Follower::new(self, None, course, asked_hz, from_last);
            follower.begin_near(Neighbour::from_orbit(near, None), level)
        };
        let [mut rising, mut falling] = [half(to, false), half(from, true)];
        if from == to {
            rising.advance(None);
            return assembled(vec![rising.branch]);
        }
        rayon::join(|| rising.advance(None), || falling.advance(None));
        let mut whole = falling.branch.reversed();
        whole.extend(rising.branch);
        assembled(vec![whole])
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
        let mut level = self
            .refinement
            .neighbour_level(*harmonics, *estimated_error);
        let mut near = neighbour.clone();
        loop {
            let mut follower = Follower::new(self, None, course, &[], false);
            let (peak, of_peak) = follower.follow_to_peak(&near, level, observation)?;
            let estimated = self.estimated(&peak, of_peak);
            if estimated.1 == of_peak {
                return estimated.0.outcome.has_motion().then_some(estimated.0);
            }
            near = Neighbour::from_orbit(&estimated.0, None);
            level = estimated.1;
        }
    }

    /// A motion with the estimate of its error, and its level: a higher one where an accuracy asks
    /// for it.
    pub(super) fn estimated(&self, orbit: &Orbit, level: usize) -> (Orbit, usize) {
        let (at_hz, mut work) = (orbit.frequency_hz, SolverWork::default());
        work.start_counting(self.most_seconds);
        let from = Neighbour::from_orbit(orbit, None);
        let solved = (self.refinement.level(level)).solve_from(at_hz, &from, &mut work);
        let resolved =
            self.refinement
                .refined(at_hz, level, solved, self.judges_figures, &mut work);
        let level = resolved.level;
        (
            self.orbit_of(
                &self.refinement,
                resolved,
                NumberedFrequency::from_orbit(orbit),
                &work,
            ),
            level,
        )
    }
}
