//! Peak of an observed amplitude, found on the curve near a motion that is known, without the rest
//! of the curve.

use super::trace::Course;
use crate::damping::Rayleigh;
use crate::dlft::point::{Neighbour, resized};
use crate::dlft::sweep::{SweepSettings, SweepSolvers};
use crate::dlft::{Orbit, StaticState, SweepProgress};
use crate::problem::Problem;

/// Motion near which a peak is looked for.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Guess {
    pub(super) harmonics: usize,
    /// Estimated error of the peak that it comes from.
    pub(super) estimated_error: Option<f64>,
    /// The motion, as one from which the solution of its frequency starts.
    pub(super) neighbour: Neighbour,
}

impl Guess {
    /// Motion of a peak, for one of almost the same problem.
    pub fn from_peak(peak: &Orbit) -> Self {
        Self {
            harmonics: peak.harmonics,
            estimated_error: peak.estimated_error,
            neighbour: Neighbour::from_orbit(peak, None),
        }
    }

    /// Motion on the line through two peaks of the same number of pairs: the first one at 0, the
    /// second one at 1.
    pub fn interpolated([first, second]: [&Orbit; 2], place: f64) -> Self {
        let nearer = if place < 0.5 { first } else { second };
        let mut guess = Self::from_peak(nearer);
        let between = |a: f64, b: f64| a + place * (b - a);
        guess.neighbour.frequency_hz = between(first.frequency_hz, second.frequency_hz);
        // A mean that is retained in one and free in the other lies on no line.
        if first.mean == second.mean {
            let u = &mut guess.neighbour.u;
            let [a, b] = [first, second].map(|orbit| resized(&orbit.x, u.len()));
            let ends = a.iter().zip(&b);
            *u = ends.map(|(a, b)| between(*a, *b)).collect();
        }
        guess
    }
}

/// Finds the peak of an observed amplitude near a motion: the curve through it is followed towards
/// larger amplitudes, until they fall again, and points are added at the peak as
/// [`follow`](super::follow) adds them. The settings have the two ends of the range. The error of the
/// peak is estimated, and those of the points on the way are not. `None` where the curve leaves the
/// range before a peak, or cannot be followed.
pub fn peak_near(
    problem: &Problem,
    damping: Rayleigh,
    static_state: &StaticState,
    settings: &SweepSettings,
    guess: &Guess,
    observation: usize,
    tell: &(dyn Fn(SweepProgress<'_>) + Sync),
) -> Option<Orbit> {
    let course = Course::spanning(&settings.frequencies_hz);
    if course.from >= course.to {
        return None;
    }
    let settings = SweepSettings {
        estimates: false,
        ..settings.clone()
    };
    let run =
        SweepSolvers::new(problem, damping, static_state, &settings, &[], tell).along_a_curve();
    run.peak_near(course, guess, observation)
}

/// A motion of a response whose errors were not estimated, with the estimate of its error.
pub fn estimated(
    problem: &Problem,
    damping: Rayleigh,
    static_state: &StaticState,
    settings: &SweepSettings,
    orbit: &Orbit,
) -> Orbit {
    let run =
        SweepSolvers::new(problem, damping, static_state, settings, &[], &|_| ()).along_a_curve();
    let level = run.refinement.level_of(orbit.harmonics);
    run.estimated(orbit, level).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::Response;
    use crate::dlft::branch::follow;
    use crate::dlft::made_up::{self, mass_with_a_stop};
    use crate::dlft::settings::Resolution;
    use crate::dlft::static_state::static_state;
    use crate::problem::dovetail72::{damping, dovetail72};
    use std::f64::consts::TAU;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// Motion with the largest amplitude of a curve.
    fn highest(curve: &Response) -> Orbit {
        let amplitude = |orbit: &&Orbit| orbit.observed_amplitude[0];
        let highest = (curve.orbits.iter()).max_by(|a, b| amplitude(a).total_cmp(&amplitude(b)));
        highest.unwrap().clone()
    }

    /// From the peak under another force, from both sides of it, and from far off.
    #[test]
    fn a_peak_is_that_of_the_whole_curve_wherever_it_is_looked_for() {
        let resolution = Resolution::fixed(1, 64);
        let problem = dovetail72(1.0);
        let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
        let ends = [0.97, 1.03].map(|ratio| ratio * first_hz);
        let settings = SweepSettings::new(ends.to_vec(), resolution);
        let state = static_state(&problem, 10, settings.newton);
        let whole = |force: f64| {
            let problem = dovetail72(force);
            let damping = damping(&problem);
            let curve = follow(&problem, damping, &state, &settings, &[], &|_| ());
            highest(&curve)
        };
        let [weaker, own, stronger] = [0.8, 1.0, 1.3].map(whole);
        let mut guesses = vec![
            Guess::from_peak(&weaker),
            Guess::from_peak(&stronger),
            Guess::interpolated([&weaker, &stronger], 0.4),
        ];
        for off in [-0.01, -0.002, 0.002, 0.01] {
            let mut guess = Guess::from_peak(&own);
            guess.neighbour.frequency_hz += off * first_hz;
            guesses.push(guess);
        }
        for (i, guess) in guesses.iter().enumerate() {
            let solved = AtomicUsize::new(0);
            let count = |told: SweepProgress<'_>| {
                if !matches!(told, SweepProgress::Next(_)) {
                    solved.fetch_add(1, Ordering::Relaxed);
                }
            };
            let damping = damping(&problem);
            let found = peak_near(&problem, damping, &state, &settings, guess, 0, &count);
            let found = found.unwrap();
            let off = found.observed_amplitude[0] / own.observed_amplitude[0] - 1.0;
            assert!(off.abs() < 2e-4, "guess {i}: {off:e}");
            let solved = solved.into_inner();
            println!("guess {i}: {solved} points, {off:e}");
            assert!(solved < 20, "guess {i}: {solved} points");
        }
    }

    /// Beside the first of these peaks the mean is retained at a point and free at the next one, and
    /// at the others pairs change their states.
    #[test]
    fn the_highest_point_of_a_whole_curve_is_the_peak_where_the_mean_changes_beside_it() {
        let resolution = Resolution::fixed(1, 64);
        for force in [0.72, 1.47, 1.72] {
            let problem = dovetail72(force);
            let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
            let ends = [0.985, 1.01].map(|ratio| ratio * first_hz);
            let settings = SweepSettings::new(ends.to_vec(), resolution);
            let state = static_state(&problem, 10, settings.newton);
            let damping = damping(&problem);
            let curve = follow(&problem, damping, &state, &settings, &[], &|_| ());
            let own = highest(&curve);
            let guess = Guess::from_peak(&own);
            let found = peak_near(&problem, damping, &state, &settings, &guess, 0, &|_| ());
            let found = found.unwrap();
            let off = own.observed_amplitude[0] / found.observed_amplitude[0] - 1.0;
            println!("{force} N: {off:e}, {} points", curve.orbits.len());
            assert!(off.abs() < 1e-4, "{force} N: {off:e}");
        }
    }

    /// At this peak a pair begins to slip, which is a corner of the curve. Where the points beside it
    /// lie hangs on rounding, and so did whether Newton's method found the corner.
    #[test]
    fn a_peak_at_a_corner_is_found_from_any_points_beside_it() {
        let resolution = Resolution::fixed(1, 64);
        let peaks = [0.0, 1e-9, 2e-9, 5e-9].map(|change| {
            let problem = dovetail72(0.72 * (1.0 + change));
            let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
            let ends = [0.96, 1.01].map(|ratio| ratio * first_hz);
            let settings = SweepSettings::new(ends.to_vec(), resolution);
            let state = static_state(&problem, 10, settings.newton);
            let curve = follow(&problem, damping(&problem), &state, &settings, &[], &|_| ());
            highest(&curve).observed_amplitude[0]
        });
        let highest = peaks.iter().copied().fold(0.0, f64::max);
        let off = peaks.map(|peak| 1.0 - peak / highest);
        println!("{off:?}");
        assert!(off.iter().all(|off| *off < 1e-4), "{off:?}");
    }

    /// Behind its fold the motion jumps down at a frequency: the guess is there.
    #[test]
    fn a_peak_above_a_fold_is_found_from_behind_the_fold() {
        let problem = mass_with_a_stop(1.0);
        let resolution = Resolution::fixed(5, 128);
        let mut settings = SweepSettings::new(vec![0.1, 0.4], resolution);
        settings.slip_threshold_m = Some(1e-9);
        let state = static_state(&problem, 1, settings.newton);
        let damping = made_up::DAMPING;
        let curve = follow(&problem, damping, &state, &settings, &[], &|_| ());
        let top = highest(&curve);
        let mut guess = Guess::from_peak(&top);
        let last = curve.orbits.last().unwrap();
        guess.neighbour = Neighbour::from_orbit(last, None);
        guess.neighbour.frequency_hz = 1.03 * top.frequency_hz;
        let found = peak_near(&problem, damping, &state, &settings, &guess, 0, &|_| ());
        let found = found.unwrap();
        let off = found.observed_amplitude[0] / top.observed_amplitude[0] - 1.0;
        assert!(off.abs() < 2e-4, "{off:e}");
    }

    #[test]
    fn a_curve_without_a_peak_in_the_range_has_none() {
        let problem = dovetail72(1.0);
        let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
        let resolution = Resolution::fixed(1, 64);
        let settings = SweepSettings::new(vec![0.9 * first_hz, 0.98 * first_hz], resolution);
        let state = static_state(&problem, 10, settings.newton);
        let damping = damping(&problem);
        let curve = follow(&problem, damping, &state, &settings, &[], &|_| ());
        let guess = Guess::from_peak(&curve.orbits[0]);
        let found = peak_near(&problem, damping, &state, &settings, &guess, 0, &|_| ());
        assert!(found.is_none());
    }
}
