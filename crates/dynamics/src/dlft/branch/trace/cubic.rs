//! Cubic through two points of a curve and their directions, which joins them.

use super::point::CurvePoint;
use crate::dlft::branch::bordered::Prediction;
use dovetail_numerics::vector::axpy;

/// Parts of a cubic in which it is looked for where it crosses an abscissa.
const PARTS: u32 = 16;
const BISECTIONS: usize = 50;

/// U and abscissa of the cubic through two points and their directions, 0 at the first and 1 at
/// the second.
pub(crate) fn interpolate(first: &CurvePoint, second: &CurvePoint, t: f64) -> Prediction {
    let [at_first, at_second, along_first, along_second] = weights(first, second, t);
    let mut u: Vec<f64> = first.u.iter().map(|u| at_first * u).collect();
    axpy(at_second, &second.u, &mut u);
    axpy(along_first, &first.direction.u, &mut u);
    axpy(along_second, &second.direction.u, &mut u);
    Prediction {
        u,
        abscissa: abscissa_between(first, second, t),
    }
}

/// Abscissa of the cubic, as [`interpolate`] has it.
fn abscissa_between(first: &CurvePoint, second: &CurvePoint, t: f64) -> f64 {
    let [at_first, at_second, along_first, along_second] = weights(first, second, t);
    at_first * first.abscissa
        + at_second * second.abscissa
        + along_first * first.direction.abscissa
        + along_second * second.direction.abscissa
}

/// Weights of the values and of the directions of two points in the cubic through both.
fn weights(first: &CurvePoint, second: &CurvePoint, t: f64) -> [f64; 4] {
    let span = second.length - first.length;
    let at_second = t * t * (3.0 - 2.0 * t);
    let along_first = span * t * (1.0 - t) * (1.0 - t);
    let along_second = span * t * t * (t - 1.0);
    [1.0 - at_second, at_second, along_first, along_second]
}

/// Fractions of the cubic between two points at which it crosses an abscissa.
pub(crate) fn crossings(first: &CurvePoint, second: &CurvePoint, abscissa: f64) -> Vec<f64> {
    let off = |t: f64| abscissa_between(first, second, t) - abscissa;
    let at = |i: u32| f64::from(i) / f64::from(PARTS);
    let crosses = |i: &u32| (off(at(*i)) > 0.0) != (off(at(i + 1)) > 0.0);
    let root = |i: u32| {
        let begins_above = off(at(i)) > 0.0;
        let [low, high] = bisected([at(i), at(i + 1)], |t| (off(t) > 0.0) == begins_above);
        0.5 * (low + high)
    };
    (0..PARTS).filter(crosses).map(root).collect()
}

/// Closest numbers found between two, the first of which is before a change and the second one
/// behind it.
pub(crate) fn bisected([mut low, mut high]: [f64; 2], is_before: impl Fn(f64) -> bool) -> [f64; 2] {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if is_before(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    [low, high]
}
