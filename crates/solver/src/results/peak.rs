//! Peak of an observed amplitude, with friction and without, and whether it was computed at all.
//!
//! The largest amplitude that was found is a peak only if the curve is known around it and on the
//! way to the peak of the linear reference. If frequencies failed there, the largest amplitude may be
//! far below the peak: the resonance was not computed ([`uncomputed_resonance`]).

use super::quantities::loss_factor;
use crate::dlft::peaks::{heights, peak_rise_ratio};
use crate::dlft::{Branch, Orbit, Response};
use std::collections::BTreeSet;

/// Largest amplitude of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Position in the curve (for a response: in `orbits`, unconverged ones counted).
    pub index: usize,
    /// Frequency of the largest amplitude.
    pub frequency_hz: f64,
    /// Largest departure from the mean, m.
    pub amplitude_m: f64,
    /// True at an end of a curve of several points: the curve may rise further outside, and a
    /// comparison with it is not one with a peak.
    pub is_at_an_end: bool,
}

/// Largest amplitude of an observation that was found; `None` where no frequency has a motion or
/// there is no such observation. It need not be the peak: see [`peak`].
pub fn largest_amplitude(response: &Response, observation: usize) -> Option<Peak> {
    let heights = heights(&response.orbits, observation);
    largest(heights.map(|(index, amplitude_m)| Peak {
        index,
        frequency_hz: response.orbits[index].frequency_hz,
        amplitude_m,
        is_at_an_end: {
            let branch = response.branches.get(response.branch_of(index));
            branch.is_some_and(|Branch { points, .. }| {
                points.len() > 1 && (index == points.start || index + 1 == points.end)
            })
        },
    }))
}

/// Peak of an observation: its largest amplitude, unless the resonance was not computed
/// ([`uncomputed_resonance`]).
pub fn peak(response: &Response, observation: usize) -> Option<Peak> {
    let top = largest_amplitude(response, observation)?;
    let is_computed = uncomputed_resonance(response, observation).is_none();
    is_computed.then_some(top)
}

/// Largest amplitude of an observation among the motions that were judged stable; `None` where none
/// was.
pub fn largest_stable_amplitude(response: &Response, observation: usize) -> Option<Peak> {
    let heights = heights(&response.orbits, observation);
    let stable =
        heights.filter(|(index, _)| response.orbits[*index].stability.is_stable() == Some(true));
    largest(stable.map(|(index, amplitude_m)| Peak {
        index,
        frequency_hz: response.orbits[index].frequency_hz,
        amplitude_m,
        is_at_an_end: false,
    }))
}

/// Positions of the peaks of the observed displacements that are unstable, ascending.
pub(crate) fn unstable_peaks(response: &Response, observations: usize) -> Vec<usize> {
    let peaks = (0..observations).filter_map(|i| largest_amplitude(response, i));
    let is_unstable = |at: &usize| response.orbits[*at].stability.is_stable() == Some(false);
    let unstable: BTreeSet<usize> = peaks.map(|peak| peak.index).filter(is_unstable).collect();
    unstable.into_iter().collect()
}

/// Fraction of the largest linear amplitude of all observations below which one does not move.
const STILL: f64 = 1e-9;

/// Frequencies between which no motion is known although the resonance of an observation may be
/// there, Hz. `None` if a motion was found at every frequency that was tried
///
/// - from the largest amplitude that was found to the peak of the linear reference in the range, each
///   with the frequencies next to it, and
/// - on both sides of the largest amplitude.
///
/// Without a motion this is the whole range. An observation that does not move in the linear
/// reference has the peak of the one that moves most.
pub fn uncomputed_resonance(response: &Response, observation: usize) -> Option<[f64; 2]> {
    let frequencies = response.orbits.iter().map(|orbit| orbit.frequency_hz);
    let first_hz = frequencies.clone().reduce(f64::min)?;
    let last_hz = frequencies.reduce(f64::max)?;
    let Some(top) = largest_amplitude(response, observation) else {
        let mut orbits = response.orbits.iter();
        let is_all = orbits.all(|orbit| !orbit.outcome.has_motion());
        return is_all.then_some([first_hz, last_hz]);
    };
    let linear = reference_peak(response, observation);
    let linear_hz = linear.map(|peak| peak.frequency_hz.clamp(first_hz, last_hz));
    let other_hz = linear_hz.unwrap_or(top.frequency_hz);
    let way = [
        top.frequency_hz.min(other_hz),
        top.frequency_hz.max(other_hz),
    ];
    let on_the_way = unknown_stretches(response, [first_hz, last_hz]);
    let on_the_way = on_the_way.filter(|[from, to]| *from < way[1] && way[0] < *to);
    let beside = unknown_beside(response, top.index);
    let unknown = on_the_way.chain(beside);
    unknown.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// Peak of the linear reference at the resonance of an observation.
fn reference_peak(response: &Response, observation: usize) -> Option<Peak> {
    let points = response.linear_curve.iter();
    let observations = points.map(|point| point.observed_amplitude.len()).max();
    let peaks = (0..observations?).filter_map(|i| linear_peak(response, i));
    let most = largest(peaks).filter(|most| most.amplitude_m > 0.0)?;
    let own = linear_peak(response, observation);
    own.filter(|own| own.amplitude_m > STILL * most.amplitude_m)
        .or(Some(most))
}

/// Stretches of a range, Hz, in which no curve has two neighbouring points with a motion, ascending.
fn unknown_stretches(
    response: &Response,
    [first_hz, last_hz]: [f64; 2],
) -> impl Iterator<Item = [f64; 2]> {
    let mut known: Vec<[f64; 2]> = Vec::new();
    for curve in response.curves() {
        let orbits = &response.orbits[curve];
        let with_motion = orbits.chunk_by(|a, b| a.outcome.has_motion() == b.outcome.has_motion());
        for part in with_motion.filter(|part| part[0].outcome.has_motion()) {
            let places = part.iter().map(|orbit| orbit.frequency_hz);
            let from = places.clone().fold(f64::INFINITY, f64::min);
            known.push([from, places.fold(from, f64::max)]);
        }
    }
    known.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut reached = first_hz;
    let mut unknown = Vec::new();
    for [from, to] in known.into_iter().chain([[last_hz; 2]]) {
        if from > reached {
            unknown.push([reached, from]);
        }
        reached = reached.max(to);
    }
    unknown.into_iter()
}

/// Frequencies from a point of a branch to the next one with a motion, Hz, if a frequency next to it
/// has none, or if the branch was lost there. `None` at the ends of the range.
fn unknown_beside(response: &Response, index: usize) -> Option<[f64; 2]> {
    let orbits = &response.orbits;
    let hz = |i: usize| orbits[i].frequency_hz;
    let branch = response.branches.get(response.branch_of(index))?;
    let Branch { points, gaps, .. } = branch;
    let is_known = |i: usize| orbits[i].outcome.has_motion();
    let below = (points.start..index).rev().find(|i| is_known(*i));
    let above = (index + 1..points.end).find(|i| is_known(*i));
    let is_joined = |i: usize, next: usize| i + 1 == next && !gaps.contains(&next);
    let to_above = match above {
        Some(next) if is_joined(index, next) => None,
        Some(next) => Some(hz(next)),
        None => end_of_branch(response, [below, Some(points.end - 1)], index),
    };
    let to_below = match below {
        Some(before) if is_joined(before, index) => None,
        Some(before) => Some(hz(before)),
        None => end_of_branch(response, [above, Some(points.start)], index),
    };
    let places = to_above.into_iter().chain(to_below);
    let stretch = places.fold([hz(index); 2], |[from, to], at| [from.min(at), to.max(at)]);
    (to_above.is_some() || to_below.is_some()).then_some(stretch)
}

/// Frequency up to which nothing is known of a branch behind its last point with a motion, Hz. `None`
/// where that is an end of the range. `before` is the point on the other side of it, and `last` the
/// point that was tried last.
fn end_of_branch(
    response: &Response,
    [before, last]: [Option<usize>; 2],
    index: usize,
) -> Option<f64> {
    let orbits = &response.orbits;
    let hz = |i: usize| orbits[i].frequency_hz;
    let last = last.filter(|last| *last != index).map(hz);
    let all = orbits.iter().map(|orbit| orbit.frequency_hz);
    let least = all.clone().fold(f64::INFINITY, f64::min);
    let most = all.fold(f64::NEG_INFINITY, f64::max);
    if last.is_some() || hz(index) == least || hz(index) == most {
        return last;
    }
    let rises = before.is_none_or(|before| hz(before) <= hz(index));
    Some(if rises { most } else { least })
}

/// Relative height of the curve through the highest point and its two neighbours above that point,
/// which may lie hidden between them: over the frequency, or over the length of a branch that was
/// followed. `None` at an end of a curve, and beside a frequency without a result.
pub fn peak_rise(response: &Response, observation: usize) -> Option<f64> {
    let top = peak(response, observation)?;
    let branch = response.branches.get(response.branch_of(top.index))?;
    let curve = (response.curves().into_iter()).find(|curve| curve.contains(&top.index))?;
    let around = top.index.checked_sub(1)?..top.index + 2;
    let is_inside = curve.start <= around.start && around.end <= curve.end;
    let near = response
        .orbits
        .get(around.clone())
        .filter(|near| is_inside && near.iter().all(|orbit| orbit.outcome.has_motion()))?;
    let place = |(i, orbit): (usize, &Orbit)| {
        let place = match branch.lengths.get(i - branch.points.start) {
            Some(length) => *length,
            None => orbit.frequency_hz,
        };
        Some((place, *orbit.observed_amplitude.get(observation)?))
    };
    let places: Option<Vec<(f64, f64)>> = around.zip(near).map(place).collect();
    peak_rise_ratio(places?.try_into().ok()?)
}

/// An amplitude jumps where it changes by more than this fraction of the larger one, ...
const JUMP: f64 = 0.1;
/// ... and so many times as fast as on either side.
const ABRUPT: f64 = 3.0;

/// Two neighbouring frequencies of a grid between which an amplitude jumps, Hz; the first ones from
/// below. The curve may fold there, and the grid go over from one motion to another. `None` for
/// branches that were followed: their folds are known.
pub fn jump_hz(response: &Response, observation: usize) -> Option<[f64; 2]> {
    let four = (response.orbits.windows(4)).filter(|_| !response.is_followed());
    four.filter(|four| four.iter().all(|orbit| orbit.outcome.has_motion()))
        .find(|four| {
            let amplitude = |i: usize| four[i].observed_amplitude.get(observation);
            let [Some(a), Some(b), Some(c), Some(d)] = [0, 1, 2, 3].map(amplitude) else {
                return false;
            };
            let rate = |i: usize, change: f64| {
                change.abs() / (four[i + 1].frequency_hz - four[i].frequency_hz)
            };
            let beside = rate(0, b - a).max(rate(2, d - c));
            (c - b).abs() > JUMP * b.max(*c) && rate(1, c - b) > ABRUPT * beside
        })
        .map(|four| [1, 2].map(|i| four[i].frequency_hz))
}

/// Local maximum of an amplitude over frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct LocalPeak {
    /// Position in `orbits`, frequency and amplitude.
    pub at: Peak,
    /// Ratio of the energy spent in a period to 2 pi times the largest stored one, P / (w 2 E) with
    /// the mean kinetic energy E. It is twice the damping ratio of a linear mode there; its inverse
    /// is the quality factor. `None` where nothing moves.
    pub loss_factor: Option<f64>,
}

/// A maximum that exceeds one of the two minima beside it by less than this fraction does not
/// count.
const PROMINENT: f64 = 0.01;

/// Local maxima of an observation inside of each branch, in the order in which it runs. A point
/// next to a frequency without a motion does not count: the curve may rise there.
pub fn local_peaks(response: &Response, observation: usize) -> Vec<LocalPeak> {
    let of = |branch: &Branch| local_peaks_of(response, branch, observation);
    response.branches.iter().flat_map(of).collect()
}

fn local_peaks_of(response: &Response, branch: &Branch, observation: usize) -> Vec<LocalPeak> {
    let heights = heights(&response.orbits, observation);
    let heights = heights.filter(|(index, _)| branch.points.contains(index));
    let heights: Vec<(usize, f64)> = heights.collect();
    let local = |i: usize| -> Option<LocalPeak> {
        let (index, amplitude_m) = heights[i];
        // The lowest point on the way to a higher one, or to the end of the range.
        let valley = |side: &mut dyn Iterator<Item = &(usize, f64)>| {
            let lower = side.take_while(|(_, a)| *a <= amplitude_m);
            lower.map(|(_, a)| *a).reduce(f64::min)
        };
        let before = valley(&mut heights[..i].iter().rev())?;
        let after = valley(&mut heights[i + 1..].iter())?;
        // The first of equal ones.
        let repeats = i > 0 && heights[i - 1].1 == amplitude_m;
        let orbit = &response.orbits[index];
        let stands_out = before.max(after) < (1.0 - PROMINENT) * amplitude_m && !repeats;
        (stands_out && unknown_beside(response, index).is_none()).then(|| LocalPeak {
            at: Peak {
                index,
                frequency_hz: orbit.frequency_hz,
                amplitude_m,
                is_at_an_end: false,
            },
            loss_factor: loss_factor(orbit),
        })
    };
    (0..heights.len()).filter_map(local).collect()
}

/// Largest amplitude of the linear reference in the range of the response; its index counts in
/// `linear_curve`.
pub fn linear_peak(response: &Response, observation: usize) -> Option<Peak> {
    let last = response.linear_curve.len().saturating_sub(1);
    let points = response.linear_curve.iter().enumerate();
    largest(points.filter_map(|(index, s)| {
        let amplitude_m = *s.observed_amplitude.get(observation)?;
        Some(Peak {
            index,
            frequency_hz: s.frequency_hz,
            amplitude_m,
            is_at_an_end: last > 0 && (index == 0 || index == last),
        })
    }))
}

/// Peak amplitude over the linear peak: 1 where friction changes nothing, 0.3 where it leaves 30 %.
pub fn peak_ratio(response: &Response, observation: usize) -> Option<f64> {
    let (with, without) = (
        peak(response, observation)?,
        linear_peak(response, observation)?,
    );
    (without.amplitude_m > 0.0).then(|| with.amplitude_m / without.amplitude_m)
}

fn largest(points: impl Iterator<Item = Peak>) -> Option<Peak> {
    points
        .filter(|p| p.amplitude_m.is_finite())
        .reduce(|best, p| {
            if p.amplitude_m > best.amplitude_m {
                p
            } else {
                best
            }
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::{LinearPoint, Outcome};
    use crate::results::quantities::moving_orbits;
    use crate::results::quantities::tests::{orbit, response};
    use std::f64::consts::TAU;

    fn linear_at(points: &[(f64, f64)]) -> Vec<LinearPoint> {
        let point = |(frequency_hz, amplitude): &(f64, f64)| LinearPoint {
            frequency_hz: *frequency_hz,
            observed_amplitude: vec![*amplitude],
        };
        points.iter().map(point).collect()
    }

    /// Response of frequencies that were swept, each with an amplitude.
    fn swept(points: &[(f64, f64)]) -> Response {
        let converged = |(f, a): &(f64, f64)| orbit(*f, Outcome::Converged, *a);
        Response {
            orbits: points.iter().map(converged).collect(),
            branches: vec![Branch::swept(points.len())],
            ..response()
        }
    }

    /// Response at 10, 20, ... Hz, which fails at those without an amplitude, with a linear peak.
    fn tried(amplitudes: &[Option<f64>], linear_hz: f64) -> Response {
        let at = |i: usize| 10.0 * (i + 1) as f64;
        let orbits = amplitudes.iter().enumerate();
        let orbits = orbits.map(|(i, amplitude)| match amplitude {
            Some(amplitude) => orbit(at(i), Outcome::Converged, *amplitude),
            None => orbit(at(i), Outcome::IterationLimit, 99.0),
        });
        let ends = [(10.0, 1.0), (at(amplitudes.len() - 1), 1.0)];
        let mut linear = linear_at(&[ends[0], (linear_hz, 5.0), ends[1]]);
        linear.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
        Response {
            orbits: orbits.collect(),
            branches: vec![Branch::swept(amplitudes.len())],
            linear_curve: linear,
            ..response()
        }
    }

    #[test]
    fn the_largest_amplitude_is_no_peak_where_the_resonance_failed() {
        let top = largest_amplitude(&response(), 0).unwrap();
        assert_eq!(
            (top.index, top.frequency_hz, top.amplitude_m),
            (2, 30.0, 2.0)
        );
        assert_eq!(uncomputed_resonance(&response(), 0), Some([10.0, 30.0]));
        assert_eq!(peak(&response(), 0), None);
        assert_eq!(peak_ratio(&response(), 0), None);
        assert_eq!(largest_amplitude(&response(), 1), None);
        assert_eq!(uncomputed_resonance(&response(), 1), None);
        assert_eq!(linear_peak(&response(), 0).unwrap().frequency_hz, 20.0);
        let mut solved = response();
        solved.orbits[1] = orbit(20.0, Outcome::Converged, 4.0);
        assert_eq!(uncomputed_resonance(&solved, 0), None);
        assert_eq!(peak(&solved, 0).map(|p| p.index), Some(1));
        assert_eq!(peak_ratio(&solved, 0), Some(0.5));
    }

    #[test]
    fn what_failed_counts_between_the_two_peaks_and_beside_the_largest_amplitude() {
        let (o, x) = (|a: f64| Some(a), None);
        // Amplitudes at 10, 20, ... Hz, the linear peak, and the frequencies without a resonance.
        type Case<'a> = (&'a [Option<f64>], f64, Option<[f64; 2]>);
        let cases: [Case<'_>; 14] = [
            (&[o(1.0), o(3.0), o(2.0), o(1.0)], 25.0, None),
            // Far from both.
            (&[x, o(1.0), o(3.0), o(2.0), o(1.0), x], 35.0, None),
            // Around the linear peak; on one side of it; only next to the largest amplitude.
            (&[o(1.0), o(2.0), x, x, o(1.0)], 35.0, Some([20.0, 50.0])),
            (
                &[o(1.0), x, o(2.0), o(1.0), o(0.5)],
                25.0,
                Some([10.0, 30.0]),
            ),
            (
                &[o(1.0), x, o(3.0), o(2.0), o(2.0), o(1.0)],
                45.0,
                Some([10.0, 30.0]),
            ),
            // Between both, with a motion at the linear peak.
            (
                &[o(1.0), o(3.0), o(1.0), x, o(2.0), o(1.0)],
                50.0,
                Some([30.0, 50.0]),
            ),
            (
                &[o(1.0), o(3.0), o(1.0), x, o(1.0), x, o(2.0), o(1.0)],
                70.0,
                Some([30.0, 70.0]),
            ),
            // At the beginning and at the end of the range.
            (&[x, o(2.0), o(1.0), o(0.5)], 10.0, Some([10.0, 20.0])),
            (&[o(0.5), o(1.0), o(2.0), x, x], 50.0, Some([30.0, 50.0])),
            (&[o(3.0), o(2.0), o(1.0)], 10.0, None),
            (&[o(1.0), o(2.0), o(3.0)], 30.0, None),
            // A smaller resonance beyond.
            (&[o(1.0), o(3.0), o(1.0), o(1.0), x, o(1.0)], 20.0, None),
            (&[x, x, x], 20.0, Some([10.0, 30.0])),
            (&[o(1.0)], 10.0, None),
        ];
        for (amplitudes, linear_hz, expected) in cases {
            let found = uncomputed_resonance(&tried(amplitudes, linear_hz), 0);
            assert_eq!(found, expected, "{amplitudes:?} {linear_hz} Hz");
        }
    }

    /// A motion that misses its accuracy is known, and one that slides too far is not.
    #[test]
    fn a_refused_motion_is_not_known() {
        let mut response = tried(&[Some(1.0), Some(3.0), Some(1.0)], 20.0);
        response.orbits[1].outcome = Outcome::AccuracyNotReached;
        assert_eq!(uncomputed_resonance(&response, 0), None);
        response.orbits[1].outcome = Outcome::SlidesTooFar;
        assert_eq!(uncomputed_resonance(&response, 0), Some([10.0, 30.0]));
    }

    #[test]
    fn a_point_that_does_not_move_has_the_resonance_of_the_one_that_does() {
        let mut response = tried(&[Some(1.0), Some(2.0), Some(1.0), None, Some(1.0)], 40.0);
        for point in &mut response.linear_curve {
            let size = if point.frequency_hz == 10.0 {
                1e-15
            } else {
                0.0
            };
            point.observed_amplitude.push(size);
        }
        for orbit in &mut response.orbits {
            let moves = orbit.observed_amplitude[0];
            orbit.observed_amplitude.push(1e-3 * moves);
        }
        assert_eq!(uncomputed_resonance(&response, 1), Some([30.0, 50.0]));
        for point in &mut response.linear_curve {
            point.observed_amplitude = vec![0.0; 2];
        }
        assert_eq!(uncomputed_resonance(&response, 1), None);
    }

    /// A branch that was followed, lost between its second and third point, or at its end.
    #[test]
    fn a_gap_of_a_curve_over_the_resonance_is_not_known() {
        let points = [Some(1.0), Some(2.0), Some(1.5), Some(1.0)];
        let mut gap = tried(&points, 25.0);
        gap.branches[0].lengths = vec![0.0, 0.1, 0.2, 0.3];
        assert_eq!(uncomputed_resonance(&gap, 0), None);
        gap.branches[0].gaps = vec![2];
        assert_eq!(uncomputed_resonance(&gap, 0), Some([20.0, 30.0]));
        // Beyond the largest amplitude on the way to another linear peak.
        let mut far = tried(&[Some(1.0), Some(2.0), Some(1.5), Some(1.0)], 40.0);
        far.branches[0].gaps = vec![3];
        assert_eq!(uncomputed_resonance(&far, 0), Some([30.0, 40.0]));
        far.linear_curve[1].frequency_hz = 15.0;
        assert_eq!(far.linear_curve[1].observed_amplitude, [5.0]);
        assert_eq!(uncomputed_resonance(&far, 0), None);
        // Two branches: the first one rises to 30 Hz, where it is lost above the other one.
        let hz = [10.0, 20.0, 30.0, 40.0, 30.0, 20.0];
        let amplitudes = [1.0, 2.0, 3.0, 0.5, 0.6, 0.7];
        let mut two = swept(&[0, 1, 2, 3, 4, 5].map(|i| (hz[i], amplitudes[i])));
        two.linear_curve = linear_at(&[(10.0, 1.0), (30.0, 4.0), (40.0, 1.0)]);
        let branch = |points: std::ops::Range<usize>| {
            let mut branch = Branch::swept(3);
            (branch.points, branch.lengths) = (points, vec![0.0, 0.1, 0.2]);
            branch
        };
        two.branches = vec![branch(0..3), branch(3..6)];
        assert_eq!(uncomputed_resonance(&two, 0), Some([30.0, 40.0]));
        // It goes on to the end of the range.
        two.orbits[2].frequency_hz = 40.0;
        assert_eq!(uncomputed_resonance(&two, 0), None);
    }

    #[test]
    fn a_peak_that_missed_its_accuracy_is_one() {
        let mut response = response();
        response.orbits[1] = orbit(20.0, Outcome::AccuracyNotReached, 3.0);
        assert!(peak_rise(&response, 0).is_some_and(|rise| rise > 0.0));
        assert_eq!(peak(&response, 0).map(|p| p.index), Some(1));
        assert_eq!(moving_orbits(&response).count(), 3);
    }

    #[test]
    fn a_curve_of_a_grid_jumps_where_it_changes_far_faster_than_on_either_side() {
        let on_grid = |amplitudes: &[f64]| {
            let numbered = amplitudes.iter().enumerate();
            let points = numbered.map(|(i, a)| (10.0 + i as f64, *a));
            swept(&points.collect::<Vec<_>>())
        };
        let jump = |amplitudes: &[f64]| jump_hz(&on_grid(amplitudes), 0);
        assert_eq!(jump(&[1.0, 1.2, 0.3, 0.25]), Some([11.0, 12.0]));
        assert_eq!(jump(&[0.3, 0.25, 1.2, 1.0]), Some([11.0, 12.0]));
        // A resonance, a jump too small to be seen, one beside an end.
        assert_eq!(jump(&[1.0, 2.0, 6.0, 3.5, 2.0]), None);
        assert_eq!(jump(&[1.0, 1.0, 1.04, 1.04]), None);
        assert_eq!(jump(&[1.2, 0.3, 0.25]), None);
        let mut failed = on_grid(&[1.0, 1.2, 0.3, 0.25]);
        failed.orbits[3].outcome = Outcome::Stagnated;
        assert_eq!(jump_hz(&failed, 0), None);
        let mut followed = on_grid(&[1.0, 1.2, 0.3, 0.25]);
        followed.branches[0].lengths = vec![0.0, 0.1, 0.2, 0.3];
        assert_eq!(jump_hz(&followed, 0), None);
    }

    #[test]
    fn every_peak_that_stands_out_is_listed_with_its_losses() {
        // A shoulder at 22, a ripple of half a percent at 42, two equal points at 52 and 53, a rise
        // to the end.
        let curve = [
            (10.0, 1.0),
            (20.0, 5.0),
            (21.0, 4.0),
            (22.0, 4.0),
            (30.0, 2.0),
            (40.0, 2.5),
            (41.0, 2.49),
            (42.0, 2.495),
            (50.0, 1.0),
            (52.0, 3.0),
            (53.0, 3.0),
            (60.0, 2.0),
            (70.0, 9.0),
        ];
        let mut listed = swept(&curve);
        // A frequency without a result is passed over, unless it is next to a peak.
        listed
            .orbits
            .insert(5, orbit(35.0, Outcome::Stagnated, 99.0));
        let mut beside = swept(&curve);
        beside.orbits[2].outcome = Outcome::Stagnated;
        listed.branches = vec![Branch::swept(listed.orbits.len())];
        let peaks = local_peaks(&listed, 0);
        let found: Vec<(usize, f64)> = peaks
            .iter()
            .map(|p| (p.at.index, p.at.frequency_hz))
            .collect();
        assert_eq!(found, [(1, 20.0), (10, 52.0)]);
        let peaks = local_peaks(&beside, 0);
        let found: Vec<usize> = peaks.iter().map(|p| p.at.index).collect();
        assert_eq!(found, [5, 9]);
        let peaks = local_peaks(&listed, 0);
        // 6 W of losses; 2 E = 0.5 J.
        let expected = 6.0 / (TAU * 20.0 * 0.5);
        assert!((peaks[0].loss_factor.unwrap() / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_parabola_is_found_between_the_points() {
        // 4 - (f - 21)^2 / 1000, on a grid of unequal steps.
        let amplitude = |f: f64| 4.0 - (f - 21.0).powi(2) / 1000.0;
        let mut curve = swept(&[5.0, 10.0, 20.0, 33.0, 40.0].map(|f| (f, amplitude(f))));
        let rise = peak_rise(&curve, 0).unwrap();
        assert!(
            (rise - (4.0 / amplitude(20.0) - 1.0)).abs() < 1e-12,
            "{rise}"
        );
        assert!(peak(&curve, 0).is_none_or(|peak| !peak.is_at_an_end));
        curve.orbits[3].outcome = Outcome::Stagnated;
        assert_eq!(peak_rise(&curve, 0), None);
        curve.orbits[3].outcome = Outcome::Converged;
        curve.orbits.drain(..2);
        curve.branches = vec![Branch::swept(3)];
        assert!(peak(&curve, 0).is_some_and(|peak| peak.is_at_an_end));
        assert_eq!(peak_rise(&curve, 0), None);
        curve.orbits.truncate(1);
        curve.branches = vec![Branch::swept(1)];
        assert!(peak(&curve, 0).is_none_or(|peak| !peak.is_at_an_end));
    }

    #[test]
    fn of_equal_points_the_first_is_the_peak_and_nothing_has_no_ratio() {
        let mut level = tried(&[Some(1.0); 3], 10.0);
        assert_eq!(peak(&level, 0).map(|p| p.index), Some(0));
        for point in &mut level.linear_curve {
            point.observed_amplitude = vec![0.0];
        }
        assert_eq!(peak_ratio(&level, 0), None);
    }

    #[test]
    fn a_linear_curve_that_rises_to_an_end_has_no_peak_inside() {
        let mut curve = response();
        assert!(linear_peak(&curve, 0).is_some_and(|peak| !peak.is_at_an_end));
        curve.linear_curve.truncate(2);
        assert!(linear_peak(&curve, 0).is_some_and(|peak| peak.is_at_an_end));
        curve.linear_curve.truncate(1);
        assert!(linear_peak(&curve, 0).is_some_and(|peak| !peak.is_at_an_end));
    }
}
