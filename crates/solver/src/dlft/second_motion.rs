//! Where a curve has two motions at one frequency: a fold.
//!
//! A sweep follows one motion until that ends, and goes on with another: where it went up a fold, it comes down elsewhere
//! than a sweep from the other side would. So where a curve steps, where its two halves meet, and beside its peak, each side
//! is followed beyond that place, until its motion ends or is that of the curve.

use super::orbit::observed_amplitudes_m;
use super::point::{FrequencySolver, Neighbour, Work};
use super::{Orbit, SecondMotion};

/// Amplitudes that differ by less, relative to the larger, are of one motion.
const SAME: f64 = 0.05;
/// Between two frequencies of a half the curve is looked at as a step where an amplitude changes by more than this factor, ...
const STEP: f64 = 1.3;
/// ... or is not [`SAME`], and changes so many times as fast as on either side of them.
const ABRUPT: f64 = 1.5;
/// A step that is not gone over at once, or that is abrupt, is gone over in so many parts.
const PARTS: u32 = 4;

/// Two motions of a curve, and where the curve steps from one to the other.
#[derive(Debug, Default)]
pub struct TwoMotions {
    /// Rising.
    pub ranges: Vec<SecondMotion>,
    /// Each between two frequencies beside each other, Hz.
    pub steps_hz: Vec<[f64; 2]>,
}

impl TwoMotions {
    /// Adds the ranges of `later` that are apart from those found before.
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

/// The amplitudes of another motion at a frequency.
type Other = Option<Vec<f64>>;

/// Whether a second motion is looked for between two orbits beside each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// In any case.
    Always,
    /// Where the curve steps from one to the other.
    AtSteps,
    /// Not at all.
    Never,
}

/// Finds a second motion beside the curve `orbits`, looking between two of them as `look` says. `solver_of` gives a solver
/// with so many harmonics.
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

/// How the amplitudes change from one frequency to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Step {
    Small,
    /// By more than [`STEP`].
    Large,
    /// [`ABRUPT`] times as fast as on either side.
    Abrupt,
}

/// The largest step of an amplitude from the frequency before to this one.
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
        match differ(&[a], &[b]) && is_abrupt {
            true => Step::Abrupt,
            false if a.max(b) > STEP * a.min(b) => Step::Large,
            false => Step::Small,
        }
    });
    steps.max().unwrap_or(Step::Small)
}

/// Whether two motions have other amplitudes.
fn differ(a: &[f64], b: &[f64]) -> bool {
    let mut both = a.iter().zip(b);
    both.any(|(a, b)| (a - b).abs() > SAME * a.max(*b))
}

/// Follows the motion of orbit `start` along `way` until it ends or is that of the curve, and notes its amplitudes; says
/// whether there are any. The first of the way is reached at once or, where it is not found so, in [`PARTS`]; over an abrupt
/// step also where it is the motion of the curve that is found.
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
            let hz = match k == parts {
                true => to_hz,
                false => from.frequency_hz + (to_hz - from.frequency_hz) * way,
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

/// The stretches of frequencies at which there is another motion.
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
