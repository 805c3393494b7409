//! Progress of a curve that is followed from both ends of its range: points, and how many more are
//! expected.
//!
//! The share of the range says little about the work: most points lie about a resonance, where the
//! curve advances slowly and turns back at folds. What a follower has before it is therefore counted
//! in points, by the steps that it took last.

use super::session::{Session, Steps, lock};
use crate::dlft::{Part, SolvedFrequency};
use std::collections::VecDeque;
use std::sync::Mutex;

/// Steps whose length tells how far the next points lead.
const LAST_STEPS: usize = 8;
/// Most points that are expected of a follower.
const MOST_EXPECTED: f64 = 9999.0;

/// Progress of the followers from both ends of a range.
pub(super) struct CurveProgress<'s, 'o> {
    session: &'s Session<'o>,
    ends: Option<(f64, f64)>,
    state: Mutex<State<'s, 'o>>,
}

struct State<'s, 'o> {
    /// Loop under way.
    steps: Option<Steps<'s, 'o>>,
    followers: Followers,
}

/// Ways of both followers.
#[derive(Default)]
struct Followers {
    ways: [Way; 2],
    /// True once both are followed through the whole range.
    are_apart: bool,
}

/// Way of a follower from the end of the range at which it began.
#[derive(Default)]
struct Way {
    points: usize,
    /// Share of the range and number of points at the end of each of the last steps.
    ends: VecDeque<(f64, usize)>,
    is_over: bool,
}

impl<'s, 'o> CurveProgress<'s, 'o> {
    /// Begins the loop for a curve over these abscissae, ascending.
    pub(super) fn new(session: &'s Session<'o>, abscissae: &[f64]) -> Self {
        Self {
            session,
            ends: abscissae.first().copied().zip(abscissae.last().copied()),
            state: Mutex::new(State {
                steps: Some(session.steps(0, "points of the curve")),
                followers: Followers::default(),
            }),
        }
    }

    /// Tells of one more point.
    pub(super) fn advance(&self, solved: &SolvedFrequency) {
        let (Some((from, to)), Some(along)) = (self.ends, &solved.along) else {
            return;
        };
        let behind = (along.abscissa - from) / (to - from);
        let share = if along.from_last {
            1.0 - behind
        } else {
            behind
        };
        let is_step = matches!(along.part, Part::Begun | Part::Reached);
        let mut state = lock(&self.state);
        let State { steps, followers } = &mut *state;
        followers.advance(usize::from(along.from_last), share, is_step);
        if let Some(steps) = steps {
            steps.expect(followers.points() + followers.expected());
            steps.step();
        }
    }

    /// Tells that both followers go on past the middle of the range, where they differ.
    pub(super) fn go_on(&self) {
        let mut state = lock(&self.state);
        // The loop ends before the next one begins.
        state.steps = None;
        state.followers.go_on();
        let label = "points past the middle, where the two halves differ";
        state.steps = Some(self.session.steps(0, label));
    }
}

impl Followers {
    /// Counts a point of a follower at this share of the range.
    fn advance(&mut self, follower: usize, share: f64, is_step: bool) {
        let goal = self.goal();
        let way = &mut self.ways[follower];
        way.points += 1;
        way.is_over |= share >= goal;
        if is_step {
            way.ends.push_back((share, way.points));
            if way.ends.len() > LAST_STEPS + 1 {
                way.ends.pop_front();
            }
        }
    }

    /// Share of the range that each follower goes through.
    fn goal(&self) -> f64 {
        if self.are_apart { 1.0 } else { 0.5 }
    }

    fn go_on(&mut self) {
        self.are_apart = true;
        for way in &mut self.ways {
            let before = std::mem::take(&mut way.points);
            way.is_over = false;
            way.ends.retain_mut(|(_, points)| {
                let is_last = *points == before;
                *points = 0;
                is_last
            });
        }
    }

    /// Points so far.
    fn points(&self) -> usize {
        self.ways.iter().map(|way| way.points).sum()
    }

    /// Points that are expected further.
    fn expected(&self) -> usize {
        self.ways.iter().map(|way| way.expected(self.goal())).sum()
    }
}

impl Way {
    /// Points that are expected up to this share of the range; at least one before the way is over.
    fn expected(&self, goal: f64) -> usize {
        let (Some((at, last)), false) = (self.ends.back(), self.is_over) else {
            return 0;
        };
        let first = self.ends.front().map_or(0, |(_, points)| *points);
        let pairs = self.ends.iter().zip(self.ends.iter().skip(1));
        let moved: f64 = pairs.map(|(a, b)| (b.0 - a.0).abs()).sum();
        // Nothing is known of the length of the first step.
        let by_point = match last - first {
            0 => 0.1,
            points => moved / points as f64,
        };
        ((goal - at) / by_point.max(1e-9))
            .ceil()
            .clamp(1.0, MOST_EXPECTED) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of the work done after each point of a follower that stands alone.
    fn shares(course: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut followers = Followers::default();
        followers.ways[1].is_over = true;
        let share = |share| {
            followers.advance(0, share, true);
            let points = followers.points() as f64;
            points / (points + followers.expected() as f64)
        };
        course.into_iter().map(share).collect()
    }

    #[test]
    fn even_steps_have_an_even_share() {
        let shares = shares((0..=50).map(|i| 0.01 * f64::from(i)));
        for (i, share) in shares.iter().enumerate().skip(2) {
            let expected = (i + 1) as f64 / 51.0;
            assert!((share / expected - 1.0).abs() < 0.02, "{i} {share}");
        }
        assert_eq!(shares[50], 1.0);
    }

    /// Steps become shorter and shorter towards the middle, where half of the points lie.
    #[test]
    fn a_curve_that_creeps_to_the_middle_is_not_nearly_done() {
        let course = (0..=200).map(|i| 0.5 - 0.5 * 0.97_f64.powi(i));
        let shares = shares(course.chain([0.5]));
        let nearly = shares.iter().filter(|share| **share > 0.95).count();
        assert!(nearly <= shares.len() / 10, "{nearly} {shares:?}");
    }

    /// Nearly at its end the curve turns back over 40 points, and comes again.
    #[test]
    fn on_the_way_back_from_a_fold_the_share_falls() {
        let there = (0..45).map(|i| 0.01 * f64::from(i));
        let back = (0..40).map(|i| 0.44 - 0.01 * f64::from(i));
        let again = (0..47).map(|i| 0.04 + 0.01 * f64::from(i));
        let shares = shares(there.chain(back).chain(again));
        assert!(shares[44] > 0.85 && shares[84] < 0.7, "{shares:?}");
        let nearly = shares.iter().filter(|share| **share > 0.95).count();
        assert!(nearly <= shares.len() / 10, "{nearly} {shares:?}");
        assert_eq!(shares.last(), Some(&1.0));
    }

    /// Past the middle points are counted anew, over the other half.
    #[test]
    fn followers_that_go_on_have_half_of_the_range_before_them() {
        let mut followers = Followers::default();
        for follower in [0, 1] {
            (0..=10).for_each(|i| followers.advance(follower, 0.05 * f64::from(i), true));
        }
        assert_eq!((followers.points(), followers.expected()), (22, 0));
        followers.go_on();
        assert_eq!(followers.points(), 0);
        for follower in [0, 1] {
            (11..=15).for_each(|i| followers.advance(follower, 0.05 * f64::from(i), true));
        }
        assert_eq!((followers.points(), followers.expected()), (10, 10));
    }
}
