//! Values between scattered points by moving least squares: the linear function that fits the
//! nearest points best, nearer ones with more weight (P. Lancaster and K. Salkauskas, Math. Comput.
//! 37 (1981) 141-158). A linear field is reproduced exactly. Along a direction in which the points
//! do not spread, such as the normal of coplanar points, the function is constant.

use faer::Mat;

use super::neighbours::PointTree;
use dovetail_numerics::dense::self_adjoint_eigen;
use dovetail_numerics::space::{add_scaled, dot, norm, sub};

/// Fewest and most points of a fit, if that many exist.
pub(crate) const FEWEST: usize = 12;
const MOST: usize = 192;
/// Points lie almost in a line, and more of them are taken, where the ratio of their variances
/// along their two main directions is smaller than this.
const LINE: f64 = 1e-2;
/// A direction with less than this fraction of the largest variance is not resolved.
const RESOLVED: f64 = 1e-8;
/// A standard deviation below this fraction of the coordinates is rounding.
const ROUNDING: f64 = 1e-12;
/// A slope is extended no farther than this many standard deviations from the middle of its points:
/// along the surface, and along a direction in which they hardly spread, as across a surface that
/// is almost plane.
const REACH: [f64; 2] = [10.0, 3.0];

/// Shares of the points in the value at `at`, without the point `left_out`. Empty where there is no
/// point.
pub(crate) fn shares(
    points_m: &[[f64; 3]],
    tree: &PointTree,
    at: [f64; 3],
    left_out: Option<usize>,
) -> Vec<(usize, f64)> {
    let mut near = tree.nearest(at).filter(|(i, _)| Some(*i) != left_out);
    let mut taken: Vec<(usize, f64)> = near.by_ref().take(FEWEST).collect();
    loop {
        let fit = Fit::new(points_m, &taken);
        let is_enough = fit.variances[1] > LINE * fit.variances[2] || taken.len() >= MOST;
        let before = taken.len();
        if !is_enough {
            taken.extend(near.by_ref().take(before));
        }
        if is_enough || taken.len() == before {
            return fit.shares(points_m, &taken, at);
        }
    }
}

/// Weights of the nearest points, their middle and their main directions.
struct Fit {
    /// Weights of the points, with sum 1.
    weights: Vec<f64>,
    middle_m: [f64; 3],
    /// Variances along the directions, ascending.
    variances: [f64; 3],
    directions: [[f64; 3]; 3],
}

impl Fit {
    fn new(points_m: &[[f64; 3]], near: &[(usize, f64)]) -> Self {
        // The farthest point has a weight too.
        let reach = 1.2 * near.last().map_or(0.0, |(_, square)| *square);
        let weight = |&(_, square): &(usize, f64)| {
            if reach > 0.0 {
                (1.0 - square / reach).powi(2)
            } else {
                1.0
            }
        };
        let mut weights: Vec<f64> = near.iter().map(weight).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        let mut middle_m = [0.0; 3];
        for ((i, _), w) in near.iter().zip(&weights) {
            add_scaled(&mut middle_m, *w, points_m[*i]);
        }
        let mut covariance = Mat::<f64>::zeros(3, 3);
        for ((i, _), w) in near.iter().zip(&weights) {
            let d = sub(points_m[*i], middle_m);
            for r in 0..3 {
                for c in 0..3 {
                    covariance[(r, c)] += w * d[r] * d[c];
                }
            }
        }
        // Where the directions are not found the function is constant.
        let (variances, directions) = match self_adjoint_eigen(covariance.as_ref()) {
            Some((values, vectors)) => (
                [0, 1, 2].map(|d| values[d].max(0.0)),
                [0, 1, 2].map(|d| [0, 1, 2].map(|k| vectors[(k, d)])),
            ),
            None => ([0.0; 3], [[0.0; 3]; 3]),
        };
        Self {
            weights,
            middle_m,
            variances,
            directions,
        }
    }

    fn shares(
        &self,
        points_m: &[[f64; 3]],
        near: &[(usize, f64)],
        at: [f64; 3],
    ) -> Vec<(usize, f64)> {
        let rounding = ROUNDING * norm(self.middle_m);
        let least = (RESOLVED * self.variances[2]).max(rounding * rounding);
        let from_middle = sub(at, self.middle_m);
        let mut slopes = [[0.0; 3]; 3];
        for ((slope, direction), variance) in
            slopes.iter_mut().zip(self.directions).zip(self.variances)
        {
            if variance > least {
                let [along, across] = REACH;
                let reach = if variance > LINE * self.variances[2] {
                    along
                } else {
                    across
                };
                let far = reach * variance.sqrt();
                let along = dot(from_middle, direction).clamp(-far, far);
                *slope = direction.map(|c| c * along / variance);
            }
        }
        let share = |(&(i, _), w): (&(usize, f64), &f64)| {
            let d = sub(points_m[i], self.middle_m);
            let rise: f64 = slopes.iter().map(|slope| dot(*slope, d)).sum();
            (i, w * (1.0 + rise))
        };
        near.iter().zip(&self.weights).map(share).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn value(points: &[[f64; 3]], of: impl Fn([f64; 3]) -> f64, at: [f64; 3]) -> f64 {
        let shares = shares(points, &PointTree::new(points), at, None);
        shares.iter().map(|(i, share)| share * of(points[*i])).sum()
    }

    proptest! {
        #[test]
        fn a_linear_field_comes_back(
            points in prop::collection::vec(prop::array::uniform3(0.0..1.0), 20..60),
            at in prop::array::uniform3(0.3..0.7),
        ) {
            let linear = |p: [f64; 3]| 3.0 + 2.0 * p[0] - p[1] + 0.5 * p[2];
            prop_assert!((value(&points, linear, at) - linear(at)).abs() < 1e-9);
            // The same points in a plane that is not one of the axes.
            let flat: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1], p[0] + 0.3 * p[1]]).collect();
            let on_plane = [at[0], at[1], at[0] + 0.3 * at[1]];
            prop_assert!((value(&flat, linear, on_plane) - linear(on_plane)).abs() < 1e-9);
        }
    }

    /// Points a hundred times nearer along one direction than along the other.
    #[test]
    fn points_that_are_dense_along_a_line_resolve_the_other_direction_too() {
        let points: Vec<[f64; 3]> = (0..20)
            .flat_map(|i| (0..40).map(move |j| [0.1 * f64::from(j), f64::from(i), 0.0]))
            .collect();
        let linear = |p: [f64; 3]| p[1];
        for y in [3.2, 7.5] {
            assert!((value(&points, linear, [1.7, y, 0.0]) - y).abs() < 1e-9);
        }
    }

    #[test]
    fn few_points_and_points_in_one_place() {
        let one = |_: [f64; 3]| 7.0;
        for points in [
            vec![[1.0; 3]],
            vec![[1.0; 3]; 40],
            vec![[0.0; 3], [1.0, 0.0, 0.0]],
        ] {
            assert!((value(&points, one, [0.2, 0.3, 0.0]) - 7.0).abs() < 1e-12);
        }
        // Far off its points a slope ends.
        let points = [[0.0; 3], [1.0, 0.0, 0.0]];
        assert!(value(&points, |p| p[0], [1e6, 0.0, 0.0]).abs() < 10.0);
        assert!(
            shares(
                &points[..1],
                &PointTree::new(&points[..1]),
                [0.0; 3],
                Some(0)
            )
            .is_empty()
        );
    }
}
