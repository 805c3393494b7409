//! Height of a peak between the points at which a curve is known.

use super::Orbit;

/// A peak is known where the curve through its highest point and the two beside it rises less than
/// this above that point, relative.
pub const LEAST_RISE: f64 = 1e-3;

/// Fraction of the highest point below which both its neighbours lie outside of the resonance; a
/// parabola through the three then says nothing of its height.
const OUTSIDE: f64 = 0.9;
/// Largest ratio of the squared height of a resonance between the three points to that of the
/// middle one.
const MOST_SQUARED: f64 = 1e4;

/// Amplitudes of an observation at the orbits that have a motion, each with its position among the
/// orbits.
pub fn heights(orbits: &[Orbit], observation: usize) -> impl Iterator<Item = (usize, f64)> {
    let numbered = orbits.iter().enumerate();
    numbered.filter_map(move |(i, orbit)| {
        let amplitude = orbit.observed_amplitude.get(observation).copied();
        let amplitude = amplitude.filter(|a| orbit.outcome.has_motion() && a.is_finite());
        Some((i, amplitude?))
    })
}

/// Height of the curve through three points above the middle one, which is the highest, relative to
/// it: of a parabola, or of a resonance where both others lie outside of it. `None` where no finite
/// curve goes through them. A point has a place and an amplitude.
///
/// Next to a mode the square of an amplitude is `c / ((f - f_0)^2 + w^2)`, so that its inverse is a
/// parabola, however far apart the points are.
pub fn peak_rise_ratio(points: [(f64, f64); 3]) -> Option<f64> {
    let [low, middle, high] = points;
    let rise = if low.1.max(high.1) < OUTSIDE * middle.1 {
        let inverse = points.map(|(place, amplitude)| (place, -(middle.1 / amplitude).powi(2)));
        // Above -1, which is the value at the middle point.
        let (above, _) = vertex(inverse);
        let squared = (1.0 - above).recip();
        let is_one = squared > 0.0 && squared < MOST_SQUARED;
        let squared = if is_one { squared } else { MOST_SQUARED };
        squared.sqrt() - 1.0
    } else {
        vertex(points).0 / middle.1
    };
    rise.is_finite().then_some(rise)
}

/// Top of the parabola through three points, as its height above the middle one and its distance
/// from it; zeros where the parabola has none.
pub fn vertex([low, middle, high]: [(f64, f64); 3]) -> (f64, f64) {
    let slope = |a: (f64, f64), b: (f64, f64)| (b.1 - a.1) / (b.0 - a.0);
    let (before, after) = (slope(low, middle), slope(middle, high));
    // a (f - f_m)^2 + b (f - f_m) + c: its top is c - b^2 / (4 a).
    let a = (after - before) / (high.0 - low.0);
    let b = before + a * (middle.0 - low.0);
    if a < 0.0 {
        (-b * b / (4.0 * a), -b / (2.0 * a))
    } else {
        (0.0, 0.0)
    }
}

/// Distance `shift` of a new place from the middle one of three, no nearer to one of them than a
/// tenth of the way to the next: it would tell nothing new.
pub fn inside(shift: f64, [low, middle, high]: [f64; 3]) -> f64 {
    let [before, after] = [middle - low, high - middle];
    if shift > 0.0 {
        shift.clamp(0.1 * after, 0.9 * after)
    } else {
        shift.clamp(-0.9 * before, -0.1 * before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::Outcome;

    #[test]
    fn points_with_a_motion_have_a_height_and_their_position() {
        let orbit = |outcome, amplitude_m: &[f64]| Orbit {
            observed_amplitude: amplitude_m.to_vec(),
            ..Orbit::motionless(1.0, outcome)
        };
        let orbits = [
            orbit(Outcome::Converged, &[1.0, 5.0]),
            orbit(Outcome::Stagnated, &[2.0, 6.0]),
            orbit(Outcome::AccuracyNotReached, &[3.0, 7.0]),
            orbit(Outcome::Converged, &[4.0]),
            orbit(Outcome::Converged, &[4.0, f64::INFINITY]),
        ];
        let of = |observation| heights(&orbits, observation).collect::<Vec<_>>();
        assert_eq!(of(0), [(0, 1.0), (2, 3.0), (3, 4.0), (4, 4.0)]);
        assert_eq!(of(1), [(0, 5.0), (2, 7.0)]);
        assert_eq!(of(2), []);
    }

    /// The square of an amplitude beside a mode at 3 with a width of 0.1, seen from 2.5.
    #[test]
    fn the_height_of_a_resonance_between_its_points_is_exact() {
        let squared = |f: f64| ((f - 3.0).powi(2) + 0.01).recip();
        let rise = peak_rise_ratio([1.0, 2.5, 4.0].map(|f| (f, squared(f).sqrt()))).unwrap();
        let exact = (squared(3.0) / squared(2.5)).sqrt() - 1.0;
        assert!((rise - exact).abs() < 1e-12, "{rise} {exact}");
        // The inverse squares reach zero between the points: no height follows from them.
        let undamped = |f: f64| (f - 3.0).abs().recip();
        let rise = peak_rise_ratio([1.0, 2.5, 4.0].map(|f| (f, undamped(f))));
        assert_eq!(rise, Some(MOST_SQUARED.sqrt() - 1.0));
        // A neighbour at nine tenths lies within the resonance: the parabola counts.
        let near = [(1.0, 0.9), (2.0, 1.0), (3.0, 0.5)];
        assert_eq!(peak_rise_ratio(near), Some(vertex(near).0));
    }

    #[test]
    fn a_new_place_lies_between_the_points_and_not_next_to_one() {
        let places = [10.0, 20.0, 40.0];
        for (shift, found) in [
            (5.0, 5.0),
            (0.5, 2.0),
            (19.5, 18.0),
            (-5.0, -5.0),
            (-0.5, -1.0),
            (-9.5, -9.0),
            (0.0, -1.0),
        ] {
            assert_eq!(inside(shift, places), found);
        }
    }

    /// A mass on a spring with 1 rad/s and 0.5 % of critical damping, on a grid of 3 to 14 times
    /// its bandwidth, wherever that lies: the parabola through the amplitudes is flat at 58 % of
    /// the peak.
    #[test]
    fn a_resonance_that_is_narrow_beside_the_grid_is_not_taken_for_flat() {
        let ratio = 5e-3_f64;
        let curve = |w: f64| (1.0 - w * w).hypot(2.0 * ratio * w).recip();
        let peak = (2.0 * ratio * (1.0 - ratio * ratio).sqrt()).recip();
        for spacing in [0.03, 0.07, 0.14] {
            for shift in -9..=9 {
                let middle = 1.0 + spacing * f64::from(shift) / 20.0;
                let around = [middle - spacing, middle, middle + spacing];
                let rise = peak_rise_ratio(around.map(|w| (w, curve(w)))).unwrap();
                let far_below = curve(middle) < 0.9 * peak;
                assert!(
                    rise > 10.0 * LEAST_RISE || !far_below,
                    "{spacing}, {shift}: {rise}"
                );
            }
        }
    }

    #[test]
    fn the_vertex_of_a_parabola_is_found() {
        let parabola = |f: f64| (f, 4.0 - (f - 24.0).powi(2) / 1000.0);
        let points = [10.0, 20.0, 33.0].map(parabola);
        let (above, off) = vertex(points);
        assert!((off - 4.0).abs() < 1e-12);
        assert!((above - (4.0 - points[1].1)).abs() < 1e-12);
        let rise = peak_rise_ratio(points).unwrap();
        assert!((rise - (4.0 / points[1].1 - 1.0)).abs() < 1e-12);
    }

    #[test]
    fn a_flat_top_does_not_rise() {
        let flat = [(1.0, 1.0), (2.0, 1.0), (3.0, 1.0)];
        assert_eq!(
            (vertex(flat), peak_rise_ratio(flat)),
            ((0.0, 0.0), Some(0.0))
        );
        // Two points at one place, and an amplitude that is none.
        assert_eq!(
            peak_rise_ratio([(1.0, 1.0), (1.0, f64::NAN), (3.0, 1.0)]),
            None
        );
    }
}
