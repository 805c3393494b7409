//! Ranges of the abscissa, such as the frequency, in which branches have several motions: where one
//! folds, and where two lie side by side.

use crate::dlft::{Response, SecondMotion};
use std::ops::Range;

/// Motions at one frequency are several where their amplitudes differ by more than this fraction of
/// the largest.
const DIFFERENT: f64 = 0.05;

/// Part of a branch along which the abscissa only rises, or only falls: abscissa and
/// observed amplitudes, m, of each point, ascending.
struct Pass<'a>(Vec<(f64, &'a [f64])>);

impl Pass<'_> {
    fn range(&self) -> Option<[f64; 2]> {
        Some([self.0.first()?.0, self.0.last()?.0])
    }

    /// Amplitudes of its point at an abscissa; `None` without one.
    fn amplitudes_m(&self, abscissa: f64) -> Option<&[f64]> {
        let at = self.0.partition_point(|p| p.0 < abscissa);
        let (found, amplitudes_m) = self.0.get(at)?;
        (*found == abscissa).then_some(amplitudes_m)
    }
}

/// Range of the abscissa in which several motions were found, and the place in it at which the largest
/// and the smallest amplitude differ most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Several {
    pub from: f64,
    pub to: f64,
    pub at: f64,
    /// Number of the observed displacement whose amplitude differs most.
    pub observation: usize,
    /// Largest amplitude of that displacement, m.
    pub amplitude_m: f64,
    /// Smallest amplitude of that displacement, m.
    pub other_amplitude_m: f64,
}

/// Ranges of frequencies in which several motions were found, ascending.
pub(crate) fn several_motions(response: &Response) -> Vec<SecondMotion> {
    let ranges = several(response).into_iter();
    let motions = ranges.map(|several| SecondMotion {
        from_hz: several.from,
        to_hz: several.to,
        frequency_hz: several.at,
        observation: several.observation,
        amplitude_m: several.amplitude_m,
        other_amplitude_m: several.other_amplitude_m,
    });
    motions.collect()
}

/// Ranges of the abscissa in which several motions were found, ascending.
pub(crate) fn several(response: &Response) -> Vec<Several> {
    let passes: Vec<Pass<'_>> = (response.curves().into_iter())
        .flat_map(|curve| passes(response, curve))
        .collect();
    let mut shared: Vec<[f64; 2]> = Vec::new();
    for (i, one) in passes.iter().enumerate() {
        for other in &passes[i + 1..] {
            let Some(([a, b], [c, d])) = one.range().zip(other.range()) else {
                continue;
            };
            if a.max(c) < b.min(d) {
                shared.push([a.max(c), b.min(d)]);
            }
        }
    }
    let joined_ranges = joined(shared).into_iter();
    joined_ranges
        .filter_map(|range| widest(&passes, range))
        .collect()
}

/// Passes of a curve. A fold, where the abscissa turns back, belongs to both passes beside it.
fn passes(response: &Response, curve: Range<usize>) -> Vec<Pass<'_>> {
    let orbits = curve.map(|at| (response.abscissa(at), &response.orbits[at]));
    let points: Vec<(f64, &[f64])> = orbits
        .filter(|(_, o)| o.outcome.has_motion())
        .map(|(abscissa, o)| (abscissa, &o.observed_amplitude[..]))
        .collect();
    let mut passes = Vec::new();
    let mut from = 0;
    for turn in 1..points.len() {
        let rises = |i: usize| points[i].0 > points[i - 1].0;
        let turns = turn + 1 == points.len() || rises(turn) != rises(turn + 1);
        if turns {
            let mut pass = points[from..=turn].to_vec();
            if !rises(turn) {
                pass.reverse();
            }
            passes.push(Pass(pass));
            from = turn;
        }
    }
    passes
}

/// Union of ranges, ascending.
fn joined(mut ranges: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    ranges.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut joined: Vec<[f64; 2]> = Vec::new();
    for range in ranges {
        match joined.last_mut() {
            Some(last) if range[0] <= last[1] => last[1] = last[1].max(range[1]),
            _ => joined.push(range),
        }
    }
    joined
}

/// Abscissa in a range at which the amplitudes of two motions differ most, both of which were solved;
/// `None` where they are alike everywhere.
fn widest(passes: &[Pass<'_>], [from, to]: [f64; 2]) -> Option<Several> {
    let mut widest: Option<Several> = None;
    for (i, pass) in passes.iter().enumerate() {
        let inside = pass.0.iter().filter(|p| (from..=to).contains(&p.0));
        for (at, own) in inside {
            let others = passes[i + 1..]
                .iter()
                .filter_map(|other| other.amplitudes_m(*at));
            let pairs = others.flat_map(|other| own.iter().zip(other).enumerate());
            for (observation, (own, other)) in pairs {
                let found = Several {
                    from,
                    to,
                    at: *at,
                    observation,
                    amplitude_m: own.max(*other),
                    other_amplitude_m: own.min(*other),
                };
                let share = |m: &Several| m.other_amplitude_m / m.amplitude_m;
                let is_wider = widest.as_ref().is_none_or(|w| share(&found) < share(w));
                if share(&found) < 1.0 - DIFFERENT && is_wider {
                    widest = Some(found);
                }
            }
        }
    }
    widest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::made_up;
    use crate::dlft::{Branch, Outcome};

    /// Response of branches through points of a frequency and an amplitude each.
    fn response(branches: &[&[(f64, f64)]]) -> Response {
        let mut response = Response::default();
        for branch in branches {
            let first = response.orbits.len();
            let orbit = |(hz, a): &(f64, f64)| made_up::orbit(*hz, Outcome::Converged, &[*a]);
            response.orbits.extend(branch.iter().map(orbit));
            response.branches.push(Branch {
                points: first..response.orbits.len(),
                ..Branch::default()
            });
        }
        response
    }

    #[test]
    fn a_fold_and_two_branches_have_several_motions_and_a_curve_that_rises_has_one() {
        assert_eq!(
            several_motions(&response(&[&[(1.0, 1.0), (2.0, 9.0), (3.0, 1.0)]])),
            []
        );
        // It turns back at 4 Hz and on again at 2 Hz.
        let folded: &[(f64, f64)] = &[
            (1.0, 1.0),
            (3.0, 5.0),
            (4.0, 6.0),
            (3.0, 4.0),
            (2.0, 1.0),
            (5.0, 1.0),
        ];
        let found = several_motions(&response(&[folded]));
        let range = |m: &SecondMotion| (m.from_hz, m.to_hz, m.frequency_hz);
        assert_eq!(
            found.iter().map(range).collect::<Vec<_>>(),
            [(2.0, 4.0, 3.0)]
        );
        assert_eq!(
            (found[0].amplitude_m, found[0].other_amplitude_m),
            (5.0, 4.0)
        );
        // Between its points nothing is known of a motion.
        let unsolved = [(1.0, 1.0), (4.0, 6.0), (3.0, 4.0), (2.0, 1.0), (5.0, 1.0)];
        assert_eq!(several_motions(&response(&[&unsolved])), []);
        // A fold between amplitudes alike is none that one would notice.
        let alike = [(1.0, 1.0), (3.0, 1.0), (4.0, 1.0), (3.0, 0.99), (5.0, 1.0)];
        assert_eq!(several_motions(&response(&[&alike])), []);
        let two = response(&[
            &[(1.0, 1.0), (3.0, 1.0), (5.0, 1.0)],
            &[(1.0, 1.0), (3.0, 2.0), (5.0, 1.0)],
        ]);
        assert_eq!(
            several_motions(&two).iter().map(range).collect::<Vec<_>>(),
            [(1.0, 5.0, 3.0)]
        );
    }

    #[test]
    fn the_parts_of_a_branch_beside_a_gap_are_two_curves() {
        let mut one = response(&[&[(1.0, 1.0), (2.0, 2.0), (2.5, 1.0), (3.0, 1.0)]]);
        one.branches[0].gaps = vec![2];
        assert_eq!(one.curves(), [0..2, 2..4]);
        assert_eq!(several_motions(&one), []);
        assert_eq!([0, 3].map(|i| one.branch_of(i)), [0, 0]);
    }
}
