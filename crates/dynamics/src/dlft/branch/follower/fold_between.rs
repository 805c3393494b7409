//! Fold of a curve between two points, from the place at which their tangents meet.

use crate::dlft::branch::trace::FoldStart;

/// Length from a point to a fold from which its tangent may lead past the fold.
const LONG_WAY: f64 = 0.05;

/// Start for a further point at a fold between two points; `None` where the curve does not fold
/// between them, or its fold is known to the error. A point has an abscissa and its slope, and
/// `ways` are the lengths to where its tangents meet, from the first and back from the second. The
/// fold may be a corner, at which no parabola comes near it. Where the tangents meet far from one of
/// the points the curve may bend on the way, and the meeting says little.
pub(crate) fn fold_between(
    [(first, rises), (second, falls)]: [(f64, f64); 2],
    ways: [f64; 2],
    error: f64,
) -> Option<FoldStart> {
    let turns = rises * falls < 0.0;
    if !turns {
        return None;
    }
    let [ahead, behind] = ways;
    let sign = rises.signum();
    let extreme = (sign * first).max(sign * second);
    let meets = sign * (first + rises * ahead);
    let is_long = |way: f64, other: f64| way > LONG_WAY && way >= other && other > -0.25 * way;
    if ahead > 0.0 && behind > 0.0 && meets - extreme > error {
        Some(FoldStart::AheadOfFirst(ahead))
    } else if is_long(behind, ahead) {
        Some(FoldStart::BehindSecond(0.5 * behind))
    } else if is_long(ahead, behind) {
        Some(FoldStart::AheadOfFirst(0.5 * ahead))
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fold_lies_where_the_tangents_beside_it_meet() {
        // A corner at 6 Hz, and the same one down.
        for sign in [1.0, -1.0] {
            let places = [(sign * 2.0, sign * 2.0), (sign * 2.0, sign * -4.0)];
            for (ways, error, start) in [
                ([2.0, 1.0], 3.9, Some(FoldStart::AheadOfFirst(2.0))),
                ([0.02, 0.01], 4.1, None),
                ([2.0, 1.0], 4.1, Some(FoldStart::AheadOfFirst(1.0))),
                ([-0.1, 1.0], 0.0, Some(FoldStart::BehindSecond(0.5))),
                ([0.01, 0.001], 1.0, None),
                ([1.0, -1.0], 1.0, None),
                ([f64::NAN, 1.0], 0.0, None),
            ] {
                assert_eq!(fold_between(places, ways, error), start, "{ways:?}");
            }
        }
        for falls in [2.0, f64::NAN] {
            assert_eq!(
                fold_between([(2.0, 2.0), (2.0, falls)], [2.0, 1.0], 0.0),
                None
            );
        }
    }
}
