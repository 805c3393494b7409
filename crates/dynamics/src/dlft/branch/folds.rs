//! Folds of curves, and the parts of curves whose motions are unstable.
//!
//! Along a curve the abscissa, such as the frequency, turns back where a real Floquet multiplier
//! passes 1. From a stable end, motions are therefore stable where the abscissa runs on in the
//! direction of the branch, and unstable where it runs back. Branch points, Neimark-Sacker
//! bifurcations and period doubling leave no trace in the curve: only the verdicts on its motions
//! ([`crate::stability`]) show them. A verdict therefore counts before a fold.

use crate::dlft::Response;
use std::ops::Range;

/// A curve folds where its abscissa goes back by more than this fraction of the range: at the
/// corners of a contact law that is sampled it may go back a little.
const BACK: f64 = 1e-3;

/// Part of a curve whose motions are all stable or all unstable, as far as is known. It ends at a
/// fold, at a change of the verdict, or with its curve.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Positions of its points in the orbits of the response. Two sections of one curve share a
    /// point, which is a fold or the last stable point before a change of the verdict.
    pub points: Range<usize>,
    /// False if its motions are unstable: by the verdict on the nearest judged motion of the section,
    /// or where none was judged, by its place between two folds.
    pub is_stable: bool,
}

/// Sections of all curves of a response, in the order of its orbits.
pub fn sections(response: &Response) -> Vec<Section> {
    let between_folds = fold_sections(response);
    let folds: Vec<usize> = shared_points(&between_folds).collect();
    let split = |section| split_by_verdict(response, section, &folds);
    between_folds.into_iter().flat_map(split).collect()
}

/// Parts of the curves between two folds, or between a fold and an end.
fn fold_sections(response: &Response) -> Vec<Section> {
    let abscissa = |at: usize| response.abscissa(at);
    let abscissae = (0..response.orbits.len()).map(abscissa);
    let [low, high] = abscissae.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
        [low.min(at), high.max(at)]
    });
    let back = BACK * (high - low);
    let mut sections = Vec::new();
    for curve in response.curves() {
        let Range { start, end } = response.branches[response.branch_of(curve.start)].points;
        let runs_up = (start..end)
            .find(|at| (abscissa(*at) - abscissa(start)).abs() > back)
            .is_none_or(|at| abscissa(at) > abscissa(start));
        let (mut from, mut extreme, mut rises) = (curve.start, curve.start, None);
        for at in curve.clone() {
            let moved = abscissa(at) - abscissa(extreme);
            match rises {
                Some(up) if (moved > 0.0) == up => extreme = at,
                _ if moved.abs() <= back => {}
                _ => {
                    if let Some(up) = rises {
                        let points = from..extreme + 1;
                        let is_stable = up == runs_up;
                        sections.push(Section { points, is_stable });
                        from = extreme;
                    }
                    (rises, extreme) = (Some(moved > 0.0), at);
                }
            }
        }
        sections.push(Section {
            points: from..curve.end,
            is_stable: rises.is_none_or(|up| up == runs_up),
        });
    }
    sections
}

/// Parts of a section between folds whose verdicts differ. A fold has a multiplier of 1: its verdict
/// holds for neither side.
fn split_by_verdict(response: &Response, section: Section, folds: &[usize]) -> Vec<Section> {
    let verdict = |at: usize| Some((at, response.orbits[at].stability.is_stable()?));
    let judged = section.points.clone().filter(|at| !folds.contains(at));
    let judged: Vec<(usize, bool)> = judged.filter_map(verdict).collect();
    let Some(&(_, last)) = judged.last() else {
        return vec![section];
    };
    let Range { mut start, end } = section.points;
    let mut parts = Vec::new();
    let changes = judged.windows(2).filter(|two| two[0].1 != two[1].1);
    for [before, after] in changes.map(|two| [two[0], two[1]]) {
        let (at, _) = if before.1 { before } else { after };
        parts.push(Section {
            points: start..at + 1,
            is_stable: before.1,
        });
        start = at;
    }
    parts.push(Section {
        points: start..end,
        is_stable: last,
    });
    parts
}

/// Positions of the folds in the orbits of a response, ascending.
pub fn folds(response: &Response) -> Vec<usize> {
    shared_points(&fold_sections(response)).collect()
}

/// Positions of the points that two sections share.
fn shared_points(sections: &[Section]) -> impl Iterator<Item = usize> {
    let two = sections.windows(2);
    let joined = two.map(|two| [&two[0].points, &two[1].points]);
    let shared = joined.filter(|[a, b]| a.end == b.start + 1);
    shared.map(|[_, after]| after.start)
}

/// Stability of each motion of a response as curves are drawn: its section gives it. A point that two
/// sections share counts as stable.
pub fn stable_in_drawing(response: &Response) -> Vec<bool> {
    stable_in(&sections(response), response.orbits.len())
}

/// Stability of so many motions by their sections.
fn stable_in(sections: &[Section], count: usize) -> Vec<bool> {
    let mut stable = vec![true; count];
    for section in sections.iter().filter(|section| !section.is_stable) {
        stable[section.points.clone()].fill(false);
    }
    for shared in shared_points(sections) {
        stable[shared] = true;
    }
    stable
}

/// Stability of each motion of a response. A motion without a verdict is `Some(false)` between two folds
/// and `None` elsewhere.
pub fn stable(response: &Response) -> Vec<Option<bool>> {
    let by_folds = stable_in(&fold_sections(response), response.orbits.len());
    let orbits = response.orbits.iter().zip(by_folds);
    let stable = orbits.map(|(orbit, by_folds)| match orbit.outcome.has_motion() {
        true => orbit.stability.is_stable().or((!by_folds).then_some(false)),
        false => None,
    });
    stable.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::made_up;
    use crate::dlft::verdict::{Kind, Verdict};
    use crate::dlft::{Branch, Outcome};

    /// Response of branches through these frequencies; a branch is lost before each `None`.
    fn response(branches: &[&[Option<f64>]]) -> Response {
        let mut response = Response::default();
        for branch in branches {
            let first = response.orbits.len();
            let mut gaps = Vec::new();
            for hz in *branch {
                match hz {
                    Some(hz) => {
                        let orbit = made_up::orbit(*hz, Outcome::Converged, &[1.0]);
                        response.orbits.push(orbit);
                    }
                    None => gaps.push(response.orbits.len()),
                }
            }
            response.branches.push(Branch {
                points: first..response.orbits.len(),
                gaps,
                ..Branch::default()
            });
        }
        response
    }

    fn unstable(branches: &[&[Option<f64>]]) -> (Vec<usize>, Vec<usize>) {
        let response = response(branches);
        let stable = stable_in_drawing(&response);
        let unstable = (0..stable.len()).filter(|i| !stable[*i]).collect();
        (folds(&response), unstable)
    }

    #[test]
    fn motions_are_unstable_where_the_frequency_runs_back() {
        let up = [1.0, 3.0, 4.0, 3.0, 2.5, 2.0, 5.0].map(Some);
        assert_eq!(unstable(&[&up]), (vec![2, 5], vec![3, 4]));
        let mut down = up;
        down.reverse();
        assert_eq!(unstable(&[&down]), (vec![1, 4], vec![2, 3]));
        // How far it runs back is measured by the range, and not by the frequencies.
        let high = up.map(|hz| hz.map(|hz| 1e4 + hz));
        assert_eq!(unstable(&[&high]), (vec![2, 5], vec![3, 4]));
        // One branch from each end, which are two curves.
        let (first, second) = ([1.0, 4.0, 2.0].map(Some), [5.0, 2.0, 3.0].map(Some));
        assert_eq!(unstable(&[&first, &second]), (vec![1, 4], vec![2, 5]));
        let straight = [1.0, 2.0, 3.0].map(Some);
        assert_eq!(unstable(&[&straight]), (vec![], vec![]));
        assert_eq!(unstable(&[&[Some(1.0)]]), (vec![], vec![]));
        assert_eq!(unstable(&[]), (vec![], vec![]));
        // Of a branch that is being followed, the other one may have no point yet.
        assert_eq!(unstable(&[&straight, &[]]), (vec![], vec![]));
        assert_eq!(unstable(&[&[], &first]), (vec![1], vec![2]));
    }

    /// A branch that is lost on its way back goes on beyond the fold, in its own direction.
    #[test]
    fn behind_a_gap_a_branch_begins_stable() {
        let lost = [
            Some(1.0),
            Some(4.0),
            Some(3.0),
            None,
            Some(4.5),
            Some(4.7),
            Some(5.0),
        ];
        assert_eq!(unstable(&[&lost]), (vec![1], vec![2]));
    }

    /// Response of one branch with verdicts: `s` stable, `u` unstable, `.` not judged.
    fn judged(frequencies: &[f64], verdicts: &str) -> Response {
        let points: Vec<Option<f64>> = frequencies.iter().copied().map(Some).collect();
        let mut response = response(&[&points]);
        for (orbit, verdict) in response.orbits.iter_mut().zip(verdicts.chars()) {
            orbit.stability.verdict = match verdict {
                's' => Verdict::Stable,
                'u' => Verdict::Unstable(Kind::PeriodDoubling),
                _ => orbit.stability.verdict,
            };
        }
        response
    }

    #[test]
    fn a_verdict_counts_before_a_fold_and_reaches_to_the_next_verdict() {
        let stable_of = |frequencies: &[f64], verdicts: &str| {
            let response = judged(frequencies, verdicts);
            let word = |stable: &Option<bool>| match stable {
                Some(true) => 's',
                Some(false) => 'u',
                None => '.',
            };
            let known: String = stable(&response).iter().map(word).collect();
            let drawn = stable_in_drawing(&response);
            let drawn: String = drawn.iter().map(|s| if *s { 's' } else { 'u' }).collect();
            (known, drawn)
        };
        let straight = [1.0, 2.0, 3.0, 4.0, 5.0];
        let of = |verdicts| stable_of(&straight, verdicts);
        let both = |known: &str, drawn: &str| (known.to_owned(), drawn.to_owned());
        assert_eq!(of("....."), both(".....", "sssss"));
        assert_eq!(of("s.u.s"), both("s.u.s", "suuus"));
        assert_eq!(of(".u..."), both(".u...", "uuuuu"));
        assert_eq!(of("ss.uu"), both("ss.uu", "ssuuu"));
        // Folds at 4 and 2 Hz: the verdicts on them say nothing of what lies between.
        let folded = [1.0, 4.0, 3.0, 2.0, 5.0];
        let of = |verdicts| stable_of(&folded, verdicts);
        assert_eq!(of("....."), both("..u..", "ssuss"));
        assert_eq!(of("ss.ss"), both("ssuss", "ssuss"));
        assert_eq!(of("s.s.u"), both("s.s.u", "ssssu"));
    }

    #[test]
    fn a_frequency_that_goes_back_a_little_makes_no_fold() {
        let corner = [1.0, 2.0, 3.0, 2.997, 2.998, 4.0, 5.0].map(Some);
        assert_eq!(unstable(&[&corner]), (vec![], vec![]));
        let at_begin = [1.0, 0.997, 2.0, 5.0].map(Some);
        assert_eq!(unstable(&[&at_begin]), (vec![], vec![]));
    }
}
