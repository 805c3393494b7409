//! Tops of an observed amplitude between points of a curve, from slopes and amplitudes.

use crate::dlft::branch::trace::{CurvePoint, Height};
use crate::dlft::peaks::{inside, vertex};

/// A peak is found where neither the cubic through two points and their slopes nor the parabola
/// through three points rises by more than this fraction above the highest of them.
const PEAK_ERROR: f64 = 2e-5;

/// Top of an observed amplitude between points of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Top {
    /// Number of the point before it.
    pub after: usize,
    /// Length of the curve up to it.
    pub length: f64,
    /// Amplitude, m.
    pub amplitude_m: f64,
}

/// Highest top of an observed amplitude above the points of a curve that are beside it; `None` where
/// there is none. The slopes tell where it lies, to a high order where the curve is smooth; at a
/// corner, where they do not, three amplitudes do. Slopes up to the length `searched` are left out.
pub(crate) fn top_of_curve(
    points: &[CurvePoint],
    searched: f64,
    observation: usize,
) -> Option<Top> {
    let places: Vec<(f64, Height)> = points
        .iter()
        .map(|p| (p.length, p.heights[observation]))
        .collect();
    let of_two = (places.windows(2).enumerate())
        .filter(|(_, two)| two[0].0 >= searched)
        .filter_map(|(i, two)| top_of_two(two, i));
    let of_three = (places.windows(3).enumerate()).filter_map(|(i, three)| top_of_three(three, i));
    of_two
        .chain(of_three)
        .max_by(|a, b| a.amplitude_m.total_cmp(&b.amplitude_m))
}

/// Top of the cubic through two places, `i` and the next one, and their slopes.
fn top_of_two(two: &[(f64, Height)], i: usize) -> Option<Top> {
    let [(from, first), (to, second)] = two else {
        return None;
    };
    let span = to - from;
    let end = |height: &Height| [height.amplitude_m, span * height.along_m];
    let (place, amplitude_m) = top_of([first, second].map(end))?;
    let higher = first.amplitude_m.max(second.amplitude_m);
    (amplitude_m > (1.0 + PEAK_ERROR) * higher).then_some(Top {
        after: i,
        length: from + place * span,
        amplitude_m,
    })
}

/// Top of the parabola through three places, from `i` on, where the middle one is the highest.
fn top_of_three(three: &[(f64, Height)], i: usize) -> Option<Top> {
    let [a, b, c] = three else {
        return None;
    };
    let middle = b.1.amplitude_m;
    if !(middle > a.1.amplitude_m && middle >= c.1.amplitude_m) {
        return None;
    }
    let three = [a, b, c].map(|(length, height)| (*length, height.amplitude_m));
    let (gain, shift) = vertex(three);
    if !shift.is_finite() || gain <= PEAK_ERROR * middle {
        return None;
    }
    Some(Top {
        after: if shift < 0.0 { i } else { i + 1 },
        length: b.0 + inside(shift, three.map(|p| p.0)),
        amplitude_m: middle + gain,
    })
}

/// Top between 0 and 1 of the cubic with these values and slopes at both: its place and value. `None`
/// where it does not rise at 0 and fall at 1.
fn top_of([[a, rises], [b, falls]]: [[f64; 2]; 2]) -> Option<(f64, f64)> {
    if !(rises > 0.0 && falls < 0.0) {
        return None;
    }
    // a + rises t + square t^2 + cube t^3
    let square = 3.0 * (b - a) - 2.0 * rises - falls;
    let cube = rises + falls - 2.0 * (b - a);
    let root = (square * square - 3.0 * cube * rises).sqrt();
    let t = rises / (root - square);
    let value = a + t * (rises + t * (square + t * cube));
    value.is_finite().then_some((t, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_of_a_cubic_follows_from_its_ends() {
        // 4 + 3 t - 4 t^3, whose slope is zero at a half, and the same one backwards.
        let [first, second] = [[4.0, 3.0], [3.0, -9.0]];
        assert_eq!(top_of([first, second]), Some((0.5, 5.0)));
        let back = |[value, slope]: [f64; 2]| [value, -slope];
        assert_eq!(top_of([back(second), back(first)]), Some((0.5, 5.0)));
        // A parabola.
        assert_eq!(top_of([[0.0, 2.0], [0.0, -2.0]]), Some((0.5, 0.5)));
        // Rising, falling, level, with a valley alone, with a top and a valley, and with no number.
        for ends in [
            [[0.0, 1.0], [1.0, 1.0]],
            [[1.0, -1.0], [0.0, -1.0]],
            [[1.0, 0.0], [1.0, 0.0]],
            [[0.0, -2.0], [0.0, 2.0]],
            [[0.0, 9.0], [1.0, 1.0]],
            [[0.0, f64::NAN], [0.0, 2.0]],
        ] {
            assert_eq!(top_of(ends), None, "{ends:?}");
        }
    }

    /// Where slopes say nothing of a peak, three amplitudes do.
    #[test]
    fn a_top_is_told_by_slopes_and_by_amplitudes() {
        let place = |(length, amplitude_m, along_m): (f64, f64, f64)| {
            let height = Height {
                amplitude_m,
                along_m,
            };
            (length, height)
        };
        let top = |two: [(f64, f64, f64); 2]| top_of_two(&two.map(place), 7);
        let found = top([(1.0, 1.0, 0.1), (3.0, 1.0, -0.1)]).unwrap();
        assert_eq!((found.after, found.length), (7, 2.0));
        assert!((found.amplitude_m - 1.05).abs() < 1e-12);
        // Less than the error above the higher one.
        assert_eq!(top([(1.0, 1.0, 1e-5), (3.0, 1.0, -1e-5)]), None);
        let top = |three: [(f64, f64); 3]| {
            top_of_three(&three.map(|(length, a)| place((length, a, 0.0))), 7)
        };
        let found = top([(0.0, 0.9), (1.0, 1.0), (2.0, 0.98)]).unwrap();
        assert_eq!(found.after, 8);
        assert!(found.length > 1.0 && found.length < 2.0 && found.amplitude_m > 1.0);
        assert_eq!(top([(0.0, 0.9), (1.0, 1.0), (2.0, 1.01)]), None);
    }
}
