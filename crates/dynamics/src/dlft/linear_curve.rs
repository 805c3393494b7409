//! Response of the linear reference over a range. It is in closed form, so that no peak between two
//! frequencies is missed, however little damping there is.

use std::f64::consts::TAU;

use super::LinearPoint;
use super::orbit::linear_point;
use crate::problem::dynamic_stiffness::ContactSystem;

/// Steps of the search for a peak; each leaves 0.618 of the range that the peak is in.
const STEPS: usize = 30;

/// Points of the curve, ascending in frequency: those asked for, and those that lead to a peak
/// between them. The peak of a mode without damping is infinite, and a curve with one has the
/// frequencies asked for alone. `system` has no pairs.
pub fn linear_curve(
    system: &ContactSystem,
    harmonics: usize,
    frequencies_hz: &[f64],
) -> Vec<LinearPoint> {
    let at = |frequency_hz: f64| linear_point(system, harmonics, frequency_hz);
    let mut points: Vec<LinearPoint> = frequencies_hz.iter().map(|f| at(*f)).collect();
    let inside = |f: &f64| {
        let ends = frequencies_hz.first().zip(frequencies_hz.last());
        ends.is_some_and(|(first, last)| first < f && f < last)
    };
    let excitations = &system.problem.excitations;
    let resonances = excitations.iter().flat_map(|load| {
        let k = load.harmonic;
        let resonance = move |w2: &f64| w2.max(0.0).sqrt() / (TAU * k as f64);
        let omega2 = &system.problem.reduced.harmonic_model(k).model.omega2;
        let resonances = omega2.iter().map(resonance).enumerate();
        resonances.map(move |(mode, hz)| (k, mode, hz))
    });
    let resonances: Vec<(usize, usize, f64)> = resonances.filter(|(_, _, f)| inside(f)).collect();
    let of_first = &system.problem.reduced.harmonic_model(1).model.omega2;
    let is_damped = (0..of_first.len()).any(|m| system.is_damped(1, m));
    if !is_damped || resonances.iter().any(|(k, m, _)| !system.is_damped(*k, *m)) {
        // Its peaks, or some of them, are infinite.
        return points;
    }
    points.extend(resonances.into_iter().map(|(_, _, f)| at(f)));
    sort_points(&mut points);
    let observations = points.first().map_or(0, |p| p.observed_amplitude.len());
    let mut between = Vec::new();
    for observation in 0..observations {
        let amplitude = |p: &LinearPoint| p.observed_amplitude[observation];
        for three in points.windows(3) {
            if amplitude(&three[1]) >= amplitude(&three[0])
                && amplitude(&three[1]) > amplitude(&three[2])
            {
                let range = [three[0].frequency_hz, three[2].frequency_hz];
                lead_to_peak(range, &at, &amplitude, &mut between);
            }
        }
    }
    points.append(&mut between);
    sort_points(&mut points);
    points
}

/// Searches a peak by golden section, and adds the points that it visits.
fn lead_to_peak(
    [mut low, mut high]: [f64; 2],
    at: &impl Fn(f64) -> LinearPoint,
    amplitude: &impl Fn(&LinearPoint) -> f64,
    visited: &mut Vec<LinearPoint>,
) {
    let share = (5.0_f64.sqrt() - 1.0) / 2.0;
    let mut left = at(high - share * (high - low));
    let mut right = at(low + share * (high - low));
    for _ in 0..STEPS {
        if amplitude(&left) > amplitude(&right) {
            high = right.frequency_hz;
            visited.push(std::mem::replace(&mut right, left));
            left = at(high - share * (high - low));
        } else {
            low = left.frequency_hz;
            visited.push(std::mem::replace(&mut left, right));
            right = at(low + share * (high - low));
        }
    }
    visited.extend([left, right]);
}

fn sort_points(points: &mut Vec<LinearPoint>) {
    points.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    points.dedup_by(|a, b| a.frequency_hz == b.frequency_hz);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::damping::Rayleigh;
    use crate::problem::dovetail72::dovetail72;
    use crate::problem::{LinearReference, Problem};

    fn pairless_problem() -> Problem {
        let problem = dovetail72(1.0);
        LinearReference::stuck(&problem.reduced).problem(&problem, Rayleigh::NONE)
    }

    /// With 0.01 % of critical damping the grid is a hundred times coarser than the resonance is
    /// wide. With 10 % the peak is not where the mode is.
    #[test]
    fn the_peak_between_two_frequencies_is_found() {
        let problem = pairless_problem();
        let omega = problem.reduced.omega2[0].sqrt();
        for (ratio, step, tolerance) in [(1e-4, 1e-6, 1e-4), (0.1, 1e-4, 1e-6)] {
            let damping = Rayleigh::stiffness_proportional(2.0 * ratio / omega);
            let system = ContactSystem::new(&problem, damping);
            let first_hz = omega / TAU;
            let grid: Vec<f64> = (0..10)
                .map(|i| first_hz * (0.95 + 0.011 * f64::from(i)))
                .collect();
            let curve = linear_curve(&system, 3, &grid);
            let amplitude = |p: &LinearPoint| p.observed_amplitude[0];
            let top = |points: &[LinearPoint]| points.iter().map(amplitude).fold(0.0, f64::max);
            let fine: Vec<LinearPoint> = (-400..=400)
                .map(|i| linear_point(&system, 3, first_hz * (1.0 + step * f64::from(i))))
                .collect();
            let error = top(&curve) / top(&fine) - 1.0;
            assert!(error.abs() < tolerance, "{ratio}: {error:e}");
            if ratio < 1e-3 {
                let on_grid = grid.iter().map(|f| linear_point(&system, 3, *f));
                assert!(top(&on_grid.collect::<Vec<_>>()) < 0.1 * top(&fine));
            }
            for f in &grid {
                assert!(curve.iter().any(|p| p.frequency_hz == *f));
            }
            let rises = |w: &[LinearPoint]| w[0].frequency_hz < w[1].frequency_hz;
            assert!(curve.windows(2).all(rises));
        }
    }

    #[test]
    fn without_damping_no_peak_is_looked_for() {
        let problem = pairless_problem();
        let damping = Rayleigh::NONE;
        let system = ContactSystem::new(&problem, damping);
        let first_hz = problem.reduced.omega2[0].sqrt() / TAU;
        let grid = [0.9 * first_hz, 0.999 * first_hz, 1.1 * first_hz];
        assert_eq!(linear_curve(&system, 1, &grid).len(), 3);
    }

    #[test]
    fn one_frequency_is_one_point() {
        let problem = pairless_problem();
        let damping = Rayleigh::stiffness_proportional(1e-6);
        let system = ContactSystem::new(&problem, damping);
        assert_eq!(linear_curve(&system, 1, &[450.0]).len(), 1);
        assert!(linear_curve(&system, 1, &[]).is_empty());
    }
}
