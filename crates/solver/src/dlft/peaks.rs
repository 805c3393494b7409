//! Search for the peak of a curve between the frequencies at which it is known.

use super::Orbit;

/// No frequency is added where the parabola through the highest point and its neighbours rises less
/// than this above it, relative.
pub const LEAST_RISE: f64 = 1e-3;

/// No frequency is added nearer to another than this fraction of the distance between the two
/// beside it.
const NEAREST: f64 = 0.02;
/// The parabola says little where one interval is so many times wider than the other.
const UNEVEN: f64 = 2.0;
/// Fraction of the highest point below which both its neighbours lie outside of the resonance; a
/// parabola through the three then says nothing of its height.
const OUTSIDE: f64 = 0.9;
/// Largest ratio of the squared height of a resonance between the three points to that of the
/// middle one.
const MOST_SQUARED: f64 = 1e4;
/// Frequencies that differ by less, relative, count as one.
const ONE_FREQUENCY: f64 = 1e-7;

/// Amplitude of an observation, where the frequency has a motion.
fn height(orbit: &Orbit, observation: usize) -> Option<f64> {
    let amplitude = orbit.observed_amplitude_m.get(observation).copied();
    amplitude.filter(|a| orbit.outcome.has_motion() && a.is_finite())
}

/// Amplitudes of an observation at the orbits that have a motion, each with its position among the
/// orbits.
pub fn heights(orbits: &[Orbit], observation: usize) -> impl Iterator<Item = (usize, f64)> {
    let numbered = orbits.iter().enumerate();
    numbered.filter_map(move |(i, orbit)| Some((i, height(orbit, observation)?)))
}

/// Largest amplitude of an observation, with its position; the first of equal ones.
pub fn highest(orbits: &[Orbit], observation: usize) -> Option<(usize, f64)> {
    heights(orbits, observation).reduce(|a, b| if b.1 > a.1 { b } else { a })
}

/// Highest point of a curve with its two neighbours, each a frequency (Hz) and an amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Top {
    /// Points in the order of their frequencies.
    pub points: [(f64, f64); 3],
    /// Top of the curve through them, Hz: a parabola, or a resonance where both neighbours lie
    /// outside of it.
    pub vertex_hz: f64,
    /// Height of the vertex above the middle point, relative.
    pub rise: f64,
}

impl Top {
    /// Top around the largest amplitude of an observation. `None` where that frequency did not
    /// converge, at an end of the range, and beside a frequency without a result.
    pub fn of(orbits: &[Orbit], observation: usize) -> Option<Self> {
        let (top, _) = highest(orbits, observation)?;
        if !orbits[top].outcome.is_converged() {
            return None;
        }
        let around = orbits.get(top.checked_sub(1)?..=top + 1)?;
        let mut points = [(0.0, 0.0); 3];
        for (point, orbit) in points.iter_mut().zip(around) {
            *point = (orbit.frequency_hz, height(orbit, observation)?);
        }
        Self::through(points)
    }

    /// Top of three points of which the middle one is highest; `None` where no finite curve goes
    /// through them.
    ///
    /// Next to a mode the square of an amplitude is `c / ((f - f_0)^2 + w^2)`, so that its inverse
    /// is a parabola, however far apart the points are.
    fn through(points: [(f64, f64); 3]) -> Option<Self> {
        let [low, middle, high] = points;
        let is_outside = low.1.max(high.1) < OUTSIDE * middle.1;
        let (rise, off) = if is_outside {
            let inverse = points.map(|(f, amplitude)| (f, -(middle.1 / amplitude).powi(2)));
            // Above -1, which is the value at the middle point.
            let (above, off) = vertex(inverse);
            let squared = (1.0 - above).recip();
            let is_one = squared > 0.0 && squared < MOST_SQUARED;
            let squared = if is_one { squared } else { MOST_SQUARED };
            (squared.sqrt() - 1.0, off)
        } else {
            let (above, off) = vertex(points);
            (above / middle.1, off)
        };
        let top = Self {
            points,
            vertex_hz: middle.0 + off,
            rise,
        };
        (top.rise.is_finite() && top.vertex_hz.is_finite()).then_some(top)
    }

    /// Frequency at which to look for the peak next; `None` where the parabola rises too little, or
    /// its points are too near each other.
    ///
    /// It is the vertex, unless that is next to a point: then the middle of the wider interval.
    /// Where one interval is much wider than the other the parabola says little: beside a step of
    /// the curve the peak may lie anywhere in the wider one, as high as the slope of the narrow one
    /// leads. Then it is the middle of the wider one.
    pub fn next_hz(&self) -> Option<f64> {
        let [low, middle, high] = self.points;
        let (below, above) = (middle.0 - low.0, high.0 - middle.0);
        if below + above < ONE_FREQUENCY * middle.0 {
            return None;
        }
        let (wide, narrow, fall) = if below > above {
            (0.5 * (low.0 + middle.0), above, middle.1 - high.1)
        } else {
            (0.5 * (middle.0 + high.0), below, middle.1 - low.1)
        };
        let widths = below.max(above) / narrow;
        if widths > UNEVEN && fall * widths > LEAST_RISE * middle.1 {
            return Some(wide);
        }
        if self.rise <= LEAST_RISE {
            return None;
        }
        let (from, to) = if self.vertex_hz < middle.0 {
            (low.0, middle.0)
        } else {
            (middle.0, high.0)
        };
        let margin = NEAREST * (to - from);
        let is_free = (from + margin..=to - margin).contains(&self.vertex_hz);
        Some(if is_free { self.vertex_hz } else { wide })
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Highest point of a curve with those that are added to `points`, and their number then.
    fn found(curve: &dyn Fn(f64) -> f64, points: &[f64]) -> (f64, usize) {
        let mut points: Vec<(f64, f64)> = points.iter().map(|f| (*f, curve(*f))).collect();
        for _ in 0..40 {
            let top = (0..points.len())
                .max_by(|a, b| points[*a].1.total_cmp(&points[*b].1))
                .unwrap();
            let around = [points[top - 1], points[top], points[top + 1]];
            let Some(next) = Top::through(around).unwrap().next_hz() else {
                break;
            };
            let at = points.partition_point(|p| p.0 < next);
            points.insert(at, (next, curve(next)));
        }
        let highest = points.iter().fold(0.0_f64, |m, p| m.max(p.1));
        (highest, points.len())
    }

    /// A mass on a spring with 1 rad/s and 0.5 % of critical damping, on a grid of 3 to 14 times
    /// its bandwidth, wherever that lies: the parabola through the amplitudes is flat at 58 % of
    /// the peak.
    #[test]
    fn a_resonance_that_is_narrow_beside_the_grid_is_found() {
        let ratio = 5e-3_f64;
        let curve = |w: f64| (1.0 - w * w).hypot(2.0 * ratio * w).recip();
        let peak = (2.0 * ratio * (1.0 - ratio * ratio).sqrt()).recip();
        for spacing in [0.03, 0.07, 0.14] {
            for shift in 0..20 {
                let first = 1.0 - spacing * (3.0 + f64::from(shift) / 20.0);
                let grid: Vec<f64> = (0..8).map(|i| first + spacing * f64::from(i)).collect();
                let (highest, points) = found(&curve, &grid);
                assert!(
                    highest > (1.0 - 2e-3) * peak && points <= 20,
                    "{spacing} from {first}: {} with {points} points",
                    highest / peak
                );
            }
        }
    }

    #[test]
    fn the_vertex_of_a_parabola_is_found() {
        let parabola = |f: f64| (f, 4.0 - (f - 24.0).powi(2) / 1000.0);
        let top = Top::through([10.0, 20.0, 33.0].map(parabola)).unwrap();
        assert!((top.vertex_hz - 24.0).abs() < 1e-12);
        assert!((top.rise - (4.0 / parabola(20.0).1 - 1.0)).abs() < 1e-12);
        assert_eq!(top.next_hz(), Some(top.vertex_hz));
    }

    /// Where the curve drops beside its peak, the vertex lies between the two points before it,
    /// again and again.
    #[test]
    fn a_peak_is_found_beside_a_step_and_at_a_kink() {
        let step = |f: f64| if f < 10.0 { 1.0 + 0.05 * f } else { 0.2 };
        let kink = |f: f64| 1.0 - 0.1 * (f - 10.0_f64).abs();
        for (curve, highest) in [(&step as &dyn Fn(f64) -> f64, 1.5), (&kink, 1.0)] {
            let (found, points) = found(curve, &[7.3, 9.1, 10.9, 12.7]);
            assert!(
                found > (1.0 - 2e-3) * highest && points < 24,
                "{found} of {highest}, {points} points"
            );
        }
    }

    #[test]
    fn a_flat_top_asks_for_no_point() {
        let top = Top::through([(1.0, 1.0), (2.0, 1.0), (3.0, 1.0)]).unwrap();
        assert_eq!((top.rise, top.next_hz()), (0.0, None));
    }
}
