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

    /// Amplitude of an observation at a frequency, on the line between two points, and the
    /// amplitudes of these; `None` outside.
    fn amplitude_m(&self, frequency_hz: f64, observation: usize) -> Option<(f64, [f64; 2])> {
        let above = self.0.partition_point(|p| p.0 < frequency_hz);
        let (to_hz, to) = *self.0.get(above)?;
        let to = *to.get(observation)?;
        if to_hz == frequency_hz {
            return Some((to, [to; 2]));
        }
        let (from_hz, from) = *self.0.get(above.checked_sub(1)?)?;
        let from = *from.get(observation)?;
        let share = (frequency_hz - from_hz) / (to_hz - from_hz);
        Some((from + (to - from) * share, [from, to]))
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
        .map(|o| (o.frequency_hz, &o.observed_amplitude[..]))
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

/// Place in a range at which the amplitudes of two motions differ most; `None` where they are alike
/// everywhere. A point is compared with both points of another pass that its frequency lies
/// between: what the curve does between two points is known by a cubic alone.
fn widest(passes: &[Pass<'_>], [from_hz, to_hz]: [f64; 2]) -> Option<SecondMotion> {
    let mut widest: Option<SecondMotion> = None;
    for (i, pass) in passes.iter().enumerate() {
        let inside = pass.0.iter().filter(|p| (from_hz..=to_hz).contains(&p.0));
        let places = inside.flat_map(|p| p.1.iter().enumerate().map(|(k, a)| (p.0, k, *a)));
        for (frequency_hz, observation, own) in places {
            let others = passes.iter().enumerate().filter(|(j, _)| *j != i);
            for (_, other) in others {
                let Some((between, ends)) = other.amplitude_m(frequency_hz, observation) else {
                    continue;
                };
                let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                let alike = low - DIFFERENT * low.max(own)..=high + DIFFERENT * high.max(own);
                let share = |m: &SecondMotion| m.other_amplitude_m / m.amplitude_m;
                let found = SecondMotion {
                    from_hz,
                    to_hz,
                    frequency_hz,
                    observation,
                    amplitude_m: own.max(between),
                    other_amplitude_m: own.min(between),
                };
                let is_wider = widest.as_ref().is_none_or(|w| share(&found) < share(w));
                if !alike.contains(&own) && is_wider {
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
