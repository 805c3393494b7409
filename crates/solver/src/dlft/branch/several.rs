//! Ranges of frequencies in which branches have several motions: where one folds, and where two lie
//! side by side.

use crate::dlft::{Response, SecondMotion};
use std::ops::Range;

/// Motions at one frequency are several where their amplitudes differ by more than this fraction of
/// the largest.
const DIFFERENT: f64 = 0.05;

/// Part of a branch along which the frequency only rises, or only falls: frequency, Hz, and
/// observed amplitudes, m, of each point, ascending.
struct Pass<'a>(Vec<(f64, &'a [f64])>);

impl Pass<'_> {
    fn range(&self) -> Option<[f64; 2]> {
        Some([self.0.first()?.0, self.0.last()?.0])
    }

    /// Amplitude of an observation at a frequency, between two points; `None` outside.
    fn amplitude_m(&self, frequency_hz: f64, observation: usize) -> Option<f64> {
        let above = self.0.partition_point(|p| p.0 < frequency_hz);
        let (to_hz, to) = *self.0.get(above)?;
        let to = *to.get(observation)?;
        if to_hz == frequency_hz {
            return Some(to);
        }
        let (from_hz, from) = *self.0.get(above.checked_sub(1)?)?;
        let from = *from.get(observation)?;
        Some(from + (to - from) * (frequency_hz - from_hz) / (to_hz - from_hz))
    }
}

/// Ranges in which several motions were found, ascending, each with the frequency at which the
/// largest and the smallest amplitude differ most.
pub fn several_motions(response: &Response) -> Vec<SecondMotion> {
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
    let found = joined(shared).into_iter();
    found.filter_map(|range| widest(&passes, range)).collect()
}

/// Passes of a curve. A fold, where the frequency turns back, belongs to both passes beside it.
fn passes(response: &Response, curve: Range<usize>) -> Vec<Pass<'_>> {
    let orbits = response.orbits[curve].iter();
    let points: Vec<(f64, &[f64])> = orbits
        .filter(|o| o.outcome.has_motion())
        .map(|o| (o.frequency_hz, &o.observed_amplitude_m[..]))
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

/// Place in a range at which the amplitudes of an observation differ most; `None` where they are
/// alike everywhere.
fn widest(passes: &[Pass<'_>], [from_hz, to_hz]: [f64; 2]) -> Option<SecondMotion> {
    let frequencies = passes.iter().flat_map(|pass| &pass.0).map(|p| p.0);
    let inside = frequencies.filter(|hz| (from_hz..=to_hz).contains(hz));
    let observations = passes.iter().flat_map(|pass| &pass.0).map(|p| p.1.len());
    let observations = observations.max().unwrap_or(0);
    let all: Vec<(f64, usize)> = inside
        .flat_map(|hz| (0..observations).map(move |i| (hz, i)))
        .collect();
    let spread = |&(frequency_hz, observation): &(f64, usize)| {
        let amplitudes = passes.iter();
        let amplitudes = amplitudes.filter_map(|pass| pass.amplitude_m(frequency_hz, observation));
        let amplitudes: Vec<f64> = amplitudes.collect();
        let largest = amplitudes.iter().copied().reduce(f64::max)?;
        let smallest = amplitudes.iter().copied().reduce(f64::min)?;
        (largest - smallest > DIFFERENT * largest).then_some(SecondMotion {
            from_hz,
            to_hz,
            frequency_hz,
            observation,
            amplitude_m: largest,
            other_amplitude_m: smallest,
        })
    };
    let share = |m: &SecondMotion| m.other_amplitude_m / m.amplitude_m;
    let found = all.iter().filter_map(spread);
    found.min_by(|a, b| share(a).total_cmp(&share(b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::made_up;
    use crate::dlft::{Branch, Outcome};

    /// Response of branches through points of a frequency and an amplitude each.
    fn response(branches: &[&[(f64, f64)]]) -> Response {
        let mut response = Response {
            linear: Vec::new(),
            linear_curve: Vec::new(),
            orbits: Vec::new(),
            branches: Vec::new(),
            asked: 0,
            second_motions: Vec::new(),
            slip_threshold_m: 0.0,
        };
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
            [(2.0, 4.0, 4.0)]
        );
        assert_eq!(
            (found[0].amplitude_m, found[0].other_amplitude_m),
            (6.0, 1.0)
        );
        // A fold between amplitudes alike is none that one would notice.
        let alike = [(1.0, 1.0), (4.0, 1.0), (3.0, 0.99), (5.0, 1.0)];
        assert_eq!(several_motions(&response(&[&alike])), []);
        let two = response(&[
            &[(1.0, 1.0), (5.0, 1.0)],
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
