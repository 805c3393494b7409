//! Where a curve has two motions at one frequency: a fold.
//!
//! A sweep follows one motion until that ends, and goes on with another: where it went up a fold, it comes down elsewhere
//! than a sweep from the other side would. So where a curve steps, and where its two halves meet, each side is followed
//! beyond the step, until its motion ends or is that of the curve.

use super::orbit::observed_amplitudes_m;
use super::point::{FrequencySolver, Neighbour, Work};
use super::{Orbit, SecondMotion};

/// Amplitudes that differ by less, relative to the larger, are of one motion.
const SAME: f64 = 0.05;
/// Between two frequencies of a half the curve is looked at as a step where an amplitude changes by more than this factor.
const STEP: f64 = 1.3;

/// Two motions of a curve, and where the curve steps from one to the other.
#[derive(Debug, Default)]
pub struct TwoMotions {
    /// Rising.
    pub ranges: Vec<SecondMotion>,
    /// Each between two frequencies beside each other, Hz.
    pub steps_hz: Vec<[f64; 2]>,
}

/// The amplitudes of another motion at a frequency.
type Other = Option<Vec<f64>>;

/// Finds a second motion beside the curve `orbits`, of which the first `middle` were swept upwards, and the others
/// downwards. `solver_of` gives a solver with so many harmonics.
pub fn second_motions<'s, 'a: 's>(
    orbits: &[Orbit],
    middle: usize,
    solver_of: impl Fn(usize) -> &'s FrequencySolver<'a>,
) -> TwoMotions {
    let mut others: Vec<Other> = vec![None; orbits.len()];
    let mut found = TwoMotions::default();
    let mut work = Work::default();
    for above in 1..orbits.len() {
        let below = above - 1;
        let meet = above == middle;
        if !orbits[below].outcome.holds() || !orbits[above].outcome.holds() {
            continue;
        }
        if !meet && !is_step(&orbits[below], &orbits[above]) {
            continue;
        }
        let mut differ = false;
        if meet || above > middle {
            let way: Vec<usize> = (above..orbits.len()).collect();
            differ |= follow(orbits, below, &way, &solver_of, &mut others, &mut work);
        }
        if meet || above < middle {
            let way: Vec<usize> = (0..=below).rev().collect();
            differ |= follow(orbits, above, &way, &solver_of, &mut others, &mut work);
        }
        if differ {
            found
                .steps_hz
                .push([orbits[below].frequency_hz, orbits[above].frequency_hz]);
        }
    }
    found.ranges = ranges(orbits, &others);
    found
}

/// Whether an amplitude changes much from one frequency to the next.
fn is_step(below: &Orbit, above: &Orbit) -> bool {
    let amplitudes = [below, above].map(|o| &o.observed_amplitude_m);
    let mut both = amplitudes[0].iter().zip(amplitudes[1]);
    both.any(|(a, b)| a.max(*b) > STEP * a.min(*b))
}

/// Whether two motions have other amplitudes.
fn differ(a: &[f64], b: &[f64]) -> bool {
    let mut both = a.iter().zip(b);
    both.any(|(a, b)| (a - b).abs() > SAME * a.max(*b))
}

/// Follows the motion of orbit `start` along `way` until it ends or is that of the curve, and notes its amplitudes; says
/// whether there are any.
fn follow<'s, 'a: 's>(
    orbits: &[Orbit],
    start: usize,
    way: &[usize],
    solver_of: &impl Fn(usize) -> &'s FrequencySolver<'a>,
    others: &mut [Other],
    work: &mut Work,
) -> bool {
    let solver = solver_of(orbits[start].harmonics);
    let mut neighbour = Neighbour::of(&orbits[start], None);
    let mut any = false;
    for &i in way {
        let orbit = &orbits[i];
        work.start_counting(None);
        let Some(solved) = solver.follow(orbit.frequency_hz, &neighbour, work) else {
            break;
        };
        let amplitudes = observed_amplitudes_m(&solved.balance, &solved.u, orbit.frequency_hz);
        if !orbit.outcome.holds() || !differ(&amplitudes, &orbit.observed_amplitude_m) {
            break;
        }
        neighbour = Neighbour::after(
            Some(&neighbour),
            orbit.frequency_hz,
            solved.u,
            solved.balance.mean(),
        );
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
