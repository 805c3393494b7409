//! Search for a second motion of a curve at one frequency, as at a fold.
//!
//! A sweep follows one motion until that ends, and continues with another: where it went up a fold,
//! it comes down elsewhere than a sweep from the other side would. Where a curve steps, where its
//! two halves meet, and beside its peak, the motion of each side is therefore followed beyond that
//! place, until it ends or coincides with that of the curve.

use super::orbit::observed_amplitudes_m;
use super::point::{FrequencySolver, Neighbour, Work};
use super::{Orbit, SecondMotion};

/// Amplitudes that differ by less, relative to the larger, belong to one motion.
const SAME: f64 = 0.05;
/// Between two frequencies of a half, the curve has a step where an amplitude changes by more than
/// this factor, ...
const STEP: f64 = 1.3;
/// ... or where it differs by more than [`SAME`], and changes so many times as fast as on either
/// side.
const ABRUPT: f64 = 1.5;
/// Number of parts in which a step is crossed that is abrupt, or that is not crossed at once.
const PARTS: u32 = 4;

/// Second motions of a curve, and where the curve steps from one motion to the other.
#[derive(Debug, Default)]
pub struct TwoMotions {
    /// Ranges of frequencies with a second motion, ascending.
    pub ranges: Vec<SecondMotion>,
    /// Steps, each between two neighbouring frequencies, Hz.
    pub steps_hz: Vec<[f64; 2]>,
}

impl TwoMotions {
    /// Adds the ranges of `later` that do not overlap those found before.
    pub fn add(&mut self, later: Self) {
        let apart = |a: &SecondMotion, b: &SecondMotion| a.to_hz < b.from_hz || b.to_hz < a.from_hz;
        for range in later.ranges {
            if self.ranges.iter().all(|known| apart(known, &range)) {
                self.ranges.push(range);
            }
        }
        self.ranges.sort_by(|a, b| a.from_hz.total_cmp(&b.from_hz));
        self.steps_hz.extend(later.steps_hz);
    }
}

/// Amplitudes of another motion at a frequency; `None` where there is none.
type Other = Option<Vec<f64>>;

/// Condition for the search of a second motion between two neighbouring orbits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// Always.
    Always,
    /// Only where the curve steps from one motion to the other.
    AtSteps,
    /// Never.
    Never,
}

/// Finds second motions beside the curve `orbits`. `look` says whether to look between two of them,
/// `solver_of` gives a solver with so many harmonics.
pub fn second_motions<'s, 'a: 's>(
    orbits: &[Orbit],
    look: impl Fn([&Orbit; 2]) -> Look,
    solver_of: impl Fn(usize) -> &'s FrequencySolver<'a>,
) -> TwoMotions {
    let mut others: Vec<Other> = vec![None; orbits.len()];
    let mut found = TwoMotions::default();
    let mut work = Work::default();
    for above in 1..orbits.len() {
        let below = above - 1;
        let ends = [&orbits[below], &orbits[above]];
        if ends.iter().any(|orbit| !orbit.outcome.holds()) {
            continue;
        }
        let step = step(orbits, above);
        match look(ends) {
            Look::Always => {}
            Look::AtSteps if step != Step::Small => {}
            Look::AtSteps | Look::Never => continue,
        }
        let upwards: Vec<usize> = (above..orbits.len()).collect();
        let downwards: Vec<usize> = (0..=below).rev().collect();
        let differ = [(below, upwards), (above, downwards)].map(|(start, way)| {
            follow(
                orbits,
                start,
                &way,
                step,
                &solver_of,
                &mut others,
                &mut work,
            )
        });
        if differ.contains(&true) {
            found
                .steps_hz
                .push([orbits[below].frequency_hz, orbits[above].frequency_hz]);
        }
    }
    found.ranges = ranges(orbits, &others);
    found
}

/// Change of the amplitudes from one frequency to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Step {
    Small,
    /// An amplitude changes by more than a factor of [`STEP`].
    Large,
    /// An amplitude changes [`ABRUPT`] times as fast as on either side.
    Abrupt,
}

/// Largest step of an amplitude from the frequency before to this one.
fn step(orbits: &[Orbit], above: usize) -> Step {
    let [before, after] = [above.checked_sub(2), Some(above + 1)].map(|i| orbits.get(i?));
    let (from, to) = (&orbits[above - 1], &orbits[above]);
    let steps = (0..to.observed_amplitude_m.len()).map(|observation| {
        let amplitude = |orbit: &Orbit| orbit.observed_amplitude_m.get(observation).copied();
        let rate = |from: Option<&Orbit>, to: Option<&Orbit>| {
            let (from, to) = (from?, to?);
            let change = amplitude(to)? - amplitude(from)?;
            Some(change.abs() / (to.frequency_hz - from.frequency_hz))
        };
        let [Some(a), Some(b)] = [from, to].map(amplitude) else {
            return Step::Small;
        };
        let own = rate(Some(from), Some(to));
        let sides = [rate(before, Some(from)), rate(Some(to), after)];
        let is_abrupt = sides
            .iter()
            .all(|side| side.is_some_and(|side| own > Some(ABRUPT * side)));
        if differ(&[a], &[b]) && is_abrupt {
            Step::Abrupt
        } else if a.max(b) > STEP * a.min(b) {
            Step::Large
        } else {
            Step::Small
        }
    });
    steps.max().unwrap_or(Step::Small)
}

/// Returns `true` if two motions have different amplitudes.
fn differ(a: &[f64], b: &[f64]) -> bool {
    let mut both = a.iter().zip(b);
    both.any(|(a, b)| (a - b).abs() > SAME * a.max(*b))
}

/// Follows the motion of orbit `start` along `way` until it ends or coincides with that of the
/// curve, and records its amplitudes in `others`. Returns `true` if there are any. The first
/// frequency of the way is reached at once or, where that fails, in [`PARTS`]; over an abrupt step
/// the parts are also tried where the motion of the curve is found.
fn follow<'s, 'a: 's>(
    orbits: &[Orbit],
    start: usize,
    way: &[usize],
    over: Step,
    solver_of: &impl Fn(usize) -> &'s FrequencySolver<'a>,
    others: &mut [Other],
    work: &mut Work,
) -> bool {
    let solver = solver_of(orbits[start].harmonics);
    let mut reach = |from: &Neighbour, to_hz: f64, parts: u32| {
        let mut at: Option<(Neighbour, Vec<f64>)> = None;
        for k in 1..=parts {
            let last = at.as_ref().map_or(from, |(neighbour, _)| neighbour);
            let way = f64::from(k) / f64::from(parts);
            let hz = if k == parts {
                to_hz
            } else {
                from.frequency_hz + (to_hz - from.frequency_hz) * way
            };
            work.start_counting(None);
            let solved = solver.follow(hz, last, work)?;
            let amplitudes = observed_amplitudes_m(&solved.balance, &solved.u, hz);
            let mean = solved.balance.mean();
            at = Some((Neighbour::after(Some(last), hz, solved.u, mean), amplitudes));
        }
        at
    };
    let mut neighbour = Neighbour::of(&orbits[start], None);
    let mut any = false;
    for (step, &i) in way.iter().enumerate() {
        let orbit = &orbits[i];
        let is_other = |(_, amplitudes): &(Neighbour, Vec<f64>)| {
            orbit.outcome.holds() && differ(amplitudes, &orbit.observed_amplitude_m)
        };
        let at_once = reach(&neighbour, orbit.frequency_hz, 1);
        let in_parts = step == 0
            && match over {
                Step::Small => false,
                Step::Large => at_once.is_none(),
                Step::Abrupt => true,
            };
        let mut reached = at_once.filter(is_other);
        if reached.is_none() && in_parts {
            reached = reach(&neighbour, orbit.frequency_hz, PARTS).filter(is_other);
        }
        let Some((next, amplitudes)) = reached else {
            break;
        };
        neighbour = next;
        others[i] = Some(amplitudes);
        any = true;
    }
    any
}

/// Ranges of consecutive frequencies at which there is another motion.
fn ranges(orbits: &[Orbit], others: &[Other]) -> Vec<SecondMotion> {
    let both: Vec<(&Orbit, &Other)> = orbits.iter().zip(others).collect();
    let stretches = both.chunk_by(|a, b| a.1.is_some() == b.1.is_some());
    stretches
        .filter_map(|stretch| {
            let (first, last) = (stretch.first()?.0, stretch.last()?.0);
            let apart = |(a, b): (f64, f64)| (a - b).abs() / a.max(b);
            let pairs = stretch.iter().flat_map(|(orbit, other)| {
                let others = other.iter().flatten().copied().enumerate();
                others.filter_map(move |(observation, other)| {
                    let own = *orbit.observed_amplitude_m.get(observation)?;
                    Some((orbit.frequency_hz, observation, (own, other)))
                })
            });
            let (frequency_hz, observation, (amplitude_m, other_amplitude_m)) =
                pairs.reduce(|a, b| if apart(b.2) > apart(a.2) { b } else { a })?;
            Some(SecondMotion {
                from_hz: first.frequency_hz,
                to_hz: last.frequency_hz,
                frequency_hz,
                observation,
                amplitude_m,
                other_amplitude_m,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::{Outcome, made_up};

    /// Curve of one observed amplitude at each of these frequencies.
    fn curve(points: &[(f64, f64)]) -> Vec<Orbit> {
        let orbit = |(hz, a): &(f64, f64)| made_up::orbit(*hz, Outcome::Converged, &[*a]);
        points.iter().map(orbit).collect()
    }

    fn range(from_hz: f64, to_hz: f64) -> SecondMotion {
        SecondMotion {
            from_hz,
            to_hz,
            frequency_hz: from_hz,
            observation: 0,
            amplitude_m: 1.0,
            other_amplitude_m: 2.0,
        }
    }

    #[test]
    fn motions_differ_beyond_a_twentieth_of_the_larger_in_any_amplitude() {
        assert!(!differ(&[2.0, 96.0], &[2.0, 100.0]));
        assert!(!differ(&[100.0], &[96.0]));
        assert!(!differ(&[1.0], &[1.0]) && !differ(&[0.0], &[0.0]));
        // Exactly a twentieth.
        assert!(!differ(&[19.0], &[20.0]));
        assert!(differ(&[2.0, 94.0], &[2.0, 100.0]));
        assert!(differ(&[100.0], &[94.0]));
        assert!(differ(&[0.02], &[0.01]));
    }

    #[test]
    fn a_step_is_large_by_its_size_and_abrupt_beside_what_is_around_it() {
        // Frequencies apart by 1 and 2 Hz: it is the rate of change that counts.
        let around = |before: f64, from: f64, to: f64, after: f64| {
            let points = [(3.0, before), (4.0, from), (6.0, to), (7.0, after)];
            step(&curve(&points), 2)
        };
        // Even.
        assert_eq!(around(9.0, 10.0, 12.0, 13.0), Step::Small);
        assert_eq!(around(8.0, 10.0, 14.0, 16.0), Step::Large);
        assert_eq!(around(16.0, 14.0, 10.0, 8.0), Step::Large);
        // Exactly 1.3 times as much.
        assert_eq!(around(8.0, 10.0, 13.0, 15.0), Step::Small);
        // Rates of 1, 1.6 and 1 per Hz, and of 1.4.
        assert_eq!(around(99.0, 100.0, 103.2, 104.2), Step::Small);
        assert_eq!(around(19.0, 20.0, 23.2, 24.2), Step::Abrupt);
        assert_eq!(around(19.0, 20.0, 22.8, 23.8), Step::Small);
        // Exactly 1.5 times as fast.
        assert_eq!(around(19.0, 20.0, 23.0, 24.0), Step::Small);
        // As fast before, or after.
        assert_eq!(around(18.0, 20.0, 23.2, 24.2), Step::Small);
        assert_eq!(around(19.0, 20.0, 23.2, 25.2), Step::Small);
        // Also downwards, after a rise, and before one.
        assert_eq!(around(24.2, 23.2, 20.0, 19.0), Step::Abrupt);
        assert_eq!(around(19.0, 20.0, 16.8, 15.8), Step::Abrupt);
        // A step without a neighbour on both sides is not abrupt.
        let ends = curve(&[(4.0, 20.0), (6.0, 23.2), (7.0, 23.2), (9.0, 26.4)]);
        assert_eq!([1, 3].map(|above| step(&ends, above)), [Step::Small; 2]);
        // The largest step of several amplitudes counts.
        let mut two = curve(&[(4.0, 20.0), (6.0, 20.0)]);
        two[0].observed_amplitude_m.push(1.0);
        two[1].observed_amplitude_m.push(2.0);
        assert_eq!(step(&two, 1), Step::Large);
        two[0].observed_amplitude_m.truncate(1);
        assert_eq!(step(&two, 1), Step::Small);
    }

    #[test]
    fn a_range_is_a_stretch_with_another_motion_named_where_they_differ_most() {
        let orbits = curve(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|hz| (hz, 10.0)));
        let others: Vec<Other> = [None, Some(8.0), Some(13.0), Some(13.0), None, Some(40.0)]
            .map(|other: Option<f64>| other.map(|a| vec![a]))
            .to_vec();
        // 0.2 and 0.23 of the larger; of equal ones the first.
        let found = [(2.0, 4.0, 3.0, 13.0), (6.0, 6.0, 6.0, 40.0)];
        let found = found.map(
            |(from_hz, to_hz, frequency_hz, other_amplitude_m)| SecondMotion {
                from_hz,
                to_hz,
                frequency_hz,
                observation: 0,
                amplitude_m: 10.0,
                other_amplitude_m,
            },
        );
        assert_eq!(ranges(&orbits, &others), found);
        // Relative to the larger: 5 for 10 is more than 19 for 10, by 0.5 and 0.47.
        let two: Vec<Other> = vec![Some(vec![19.0]), Some(vec![5.0])];
        let [range] = ranges(&orbits[..2], &two)[..] else {
            panic!("one range");
        };
        assert_eq!((range.frequency_hz, range.other_amplitude_m), (2.0, 5.0));
        // The one of several observations that differs most.
        let mut orbits = curve(&[(1.0, 10.0)]);
        orbits[0].observed_amplitude_m.push(20.0);
        let [range] = ranges(&orbits, &[Some(vec![9.0, 30.0])])[..] else {
            panic!("one range");
        };
        assert_eq!((range.observation, range.amplitude_m), (1, 20.0));
    }

    #[test]
    fn a_range_that_meets_a_known_one_is_not_added() {
        let mut two = TwoMotions {
            ranges: vec![range(4.0, 6.0)],
            steps_hz: vec![[5.0, 5.5]],
        };
        let later = [(7.0, 8.0), (1.0, 3.0), (5.0, 9.0), (3.5, 4.0), (6.0, 6.5)];
        two.add(TwoMotions {
            ranges: later.map(|(from, to)| range(from, to)).to_vec(),
            steps_hz: vec![[1.0, 2.0]],
        });
        let kept: Vec<[f64; 2]> = two.ranges.iter().map(|r| [r.from_hz, r.to_hz]).collect();
        assert_eq!(kept, [[1.0, 3.0], [4.0, 6.0], [7.0, 8.0]]);
        assert_eq!(two.steps_hz, [[5.0, 5.5], [1.0, 2.0]]);
    }
}
