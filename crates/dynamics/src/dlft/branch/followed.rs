//! Branch in the order in which it runs, and the response that branches make up.

use super::trace::{MOST_SHORT_STEPS, SHORT_STEP};
use crate::dlft::{Branch, Part, Response, SolvedFrequency};

/// Branch as it is followed, in the order in which it runs.
#[derive(Debug, Clone, Default)]
pub(crate) struct Followed {
    /// Motions along the branch.
    pub points: Vec<SolvedFrequency>,
    /// Length of the branch up to each point.
    pub lengths: Vec<f64>,
    /// Numbers of the points before which the branch was lost, and a motion looked for anew.
    pub gaps: Vec<usize>,
    /// Number of the point at which it was given up, if it was.
    pub given_up: Option<usize>,
}

/// Most points of a branch.
const MOST_POINTS: usize = 5000;
/// A branch creeps if so many steps in a row lead through less than [`CREPT`] of the range.
const MOST_CREEPING_STEPS: usize = 300;
/// Share of the range, see [`MOST_CREEPING_STEPS`].
const CREPT: f64 = 0.02;

impl Followed {
    /// The branch up to its first point at an abscissa; empty where there is none.
    pub(crate) fn truncated_at(&self, abscissa: f64) -> Self {
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
            given_up: None,
        }
    }

    /// The branch run through in the other direction.
    pub(crate) fn reversed(mut self) -> Self {
        let count = self.points.len();
        self.points.reverse();
        self.lengths.reverse();
        let whole = self.lengths.first().copied().unwrap_or(0.0);
        self.lengths.iter_mut().for_each(|l| *l = whole - *l);
        self.gaps.reverse();
        self.gaps.iter_mut().for_each(|gap| *gap = count - *gap);
        self.given_up = self.given_up.map(|at| count - 1 - at);
        self
    }

    /// Returns `true` if its last steps were shorter than short ones.
    pub(crate) fn is_stalling(&self) -> bool {
        let before = self.lengths.iter().rev().nth(MOST_SHORT_STEPS);
        let last = self.lengths.last();
        let length = last.zip(before).map(|(last, before)| last - before);
        length.is_some_and(|length| length < MOST_SHORT_STEPS as f64 * SHORT_STEP)
    }

    /// Returns `true` if it creeps through a range of this length, or has too many points.
    pub(crate) fn creeps(&self, range: f64) -> bool {
        let steps = self.points.iter().rev();
        let steps = steps.take_while(|p| part_of(p) != Some(Part::Begun));
        let steps = steps.filter(|p| part_of(p) == Some(Part::Reached));
        let last: Vec<f64> = steps
            .take(MOST_CREEPING_STEPS)
            .map(SolvedFrequency::abscissa)
            .collect();
        let [least, most] = [f64::min, f64::max].map(|of| last.iter().copied().reduce(of));
        let crept = least.zip(most).map(|(least, most)| most - least);
        let is_short = crept.is_some_and(|crept| crept < CREPT * range);
        self.points.len() >= MOST_POINTS || last.len() == MOST_CREEPING_STEPS && is_short
    }

    /// Abscissae of the points at the ends of its steps but the last two: where it passes one of them
    /// again, another motion is looked for. None behind five steps one of which passed an abscissa.
    pub(crate) fn revisitable(&self) -> Vec<f64> {
        let points = self.points.iter().rev();
        let mut steps = 0;
        for part in points.clone().map(part_of) {
            match part {
                Some(Part::Passed) => return Vec::new(),
                Some(Part::Reached) => steps += 1,
                _ => {}
            }
            if steps > 5 {
                break;
            }
        }
        let ends = points.filter(|p| part_of(p) == Some(Part::Reached));
        ends.skip(2).map(SolvedFrequency::abscissa).collect()
    }

    /// Abscissae of its points.
    pub(crate) fn abscissae(&self) -> Vec<f64> {
        self.points.iter().map(SolvedFrequency::abscissa).collect()
    }

    /// Abscissa of its point that is farthest from one.
    pub(crate) fn farthest(&self, from: f64) -> f64 {
        let abscissae = self.abscissae().into_iter();
        let farthest = abscissae.max_by(|a, b| (a - from).abs().total_cmp(&(b - from).abs()));
        farthest.unwrap_or(from)
    }

    /// Adds a branch that begins where this one ends.
    pub(crate) fn extend(&mut self, mut on: Self) {
        self.points.pop();
        let length = self.lengths.pop().unwrap_or(0.0);
        let count = self.points.len();
        self.lengths.extend(on.lengths.iter().map(|l| length + l));
        self.gaps.extend(on.gaps.iter().map(|gap| count + gap));
        self.points.append(&mut on.points);
        self.given_up = on.given_up.map(|at| count + at);
    }

    /// Adds a point, at its place along the branch.
    pub(crate) fn keep(&mut self, solved: SolvedFrequency) {
        let Self {
            points,
            lengths,
            gaps,
            ..
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

/// Part of a branch that a point was found by.
pub(crate) fn part_of(solved: &SolvedFrequency) -> Option<Part> {
    solved.along.as_ref().map(|along| along.part)
}

/// Response that consists of these branches.
pub(crate) fn assembled(branches: Vec<Followed>) -> Response {
    let mut response = Response::default();
    for branch in branches {
        let first = response.orbits.len();
        let abscissae = branch.abscissae();
        let points = branch.points.into_iter();
        let (orbits, linear): (Vec<_>, Vec<_>) = points.map(|s| (s.orbit, s.linear)).unzip();
        response.orbits.extend(orbits);
        response.linear.extend(linear);
        response.branches.push(Branch {
            points: first..response.orbits.len(),
            gaps: branch.gaps.iter().map(|gap| first + gap).collect(),
            lengths: branch.lengths,
            abscissae,
            given_up: branch.given_up.map(|at| first + at),
        });
    }
    response
}

/// Response so far of branches that are being followed: `solved` are the points found, in the order
/// of their numbers. The linear reference is known at these alone.
pub fn partial_response(solved: impl IntoIterator<Item = SolvedFrequency>) -> Response {
    let [mut rising, mut falling] = [Followed::default(), Followed::default()];
    for solved in solved {
        let from_last = solved.along.as_ref().is_some_and(|along| along.from_last);
        let branch = if from_last { &mut falling } else { &mut rising };
        branch.keep(solved);
    }
    assembled(vec![rising, falling.reversed()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::{BranchPosition, Orbit, Outcome};

    /// Record of a point that a step came to.
    fn reached(step: usize, abscissa: f64, from_last: bool) -> SolvedFrequency {
        SolvedFrequency {
            along: Some(BranchPosition {
                from_last,
                step,
                part: Part::Reached,
                abscissa,
                length: 0.1 * step as f64,
                heading: None,
            }),
            ..SolvedFrequency::isolated(Orbit::motionless(abscissa, Outcome::Converged))
        }
    }

    #[test]
    fn a_branch_creeps_where_hundreds_of_steps_go_nowhere() {
        let of = |steps: &[f64]| {
            let mut branch = Followed::default();
            let points = steps.iter().enumerate();
            points.for_each(|(step, at)| branch.keep(reached(step, *at, false)));
            branch
        };
        let away: Vec<f64> = (0..50).map(|i| 100.0 + f64::from(i)).collect();
        let circling = (0..300).map(|i| 150.0 + f64::from(i).sin());
        let creeping = of(&away.iter().copied().chain(circling).collect::<Vec<_>>());
        assert!(creeping.creeps(200.0) && !creeping.creeps(90.0));
        let mut begun = creeping.clone();
        let start = begun.points[200].along.as_mut().unwrap();
        start.part = Part::Begun;
        assert!(!begun.creeps(200.0));
        assert!(!of(&away).creeps(200.0));
    }

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
            branch.is_stalling()
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
}
