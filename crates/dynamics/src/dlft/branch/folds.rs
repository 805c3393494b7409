//! Folds of curves, and the motions between them that are unstable.
//!
//! Along a curve the abscissa, such as the frequency, turns back where a real Floquet multiplier
//! passes 1. From a stable end, motions are therefore stable where the abscissa runs on in the
//! direction of the branch, and unstable where it runs back. Two further multipliers beyond 1 read
//! as stable; branch points, Neimark-Sacker bifurcations and period doubling leave no trace in the
//! curve, and are not seen.

use crate::dlft::Response;
use std::ops::Range;

/// A curve folds where its abscissa goes back by more than this fraction of the range: at the
/// corners of a contact law that is sampled it may go back a little.
const BACK: f64 = 1e-3;

/// Part of a curve between two folds, or between a fold and an end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Positions of its points in the orbits of the response. A fold is the last point of one
    /// section and the first one of the next.
    pub points: Range<usize>,
    /// True if the motions on it are stable.
    pub is_stable: bool,
}

/// Sections of all curves of a response, in the order of its orbits.
pub fn sections(response: &Response) -> Vec<Section> {
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

/// Positions of the folds in the orbits of a response, ascending.
pub fn folds(response: &Response) -> Vec<usize> {
    fold_positions(&sections(response)).collect()
}

/// Positions of the folds between sections.
fn fold_positions(sections: &[Section]) -> impl Iterator<Item = usize> {
    let two = sections.windows(2);
    let joined = two.map(|two| [&two[0].points, &two[1].points]);
    let folds = joined.filter(|[a, b]| a.end == b.start + 1);
    folds.map(|[_, after]| after.start)
}

/// Stability of each motion of a response. A fold counts as stable.
pub fn stable(response: &Response) -> Vec<bool> {
    let mut stable = vec![true; response.orbits.len()];
    let sections = sections(response);
    for section in sections.iter().filter(|section| !section.is_stable) {
        stable[section.points.clone()].fill(false);
    }
    for fold in fold_positions(&sections) {
        stable[fold] = true;
    }
    stable
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::made_up;
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
        let stable = stable(&response);
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

    #[test]
    fn a_frequency_that_goes_back_a_little_makes_no_fold() {
        let corner = [1.0, 2.0, 3.0, 2.997, 2.998, 4.0, 5.0].map(Some);
        assert_eq!(unstable(&[&corner]), (vec![], vec![]));
        let at_begin = [1.0, 0.997, 2.0, 5.0].map(Some);
        assert_eq!(unstable(&[&at_begin]), (vec![], vec![]));
    }
}
