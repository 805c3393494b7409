//! Powell's dogleg step in a trust region, for dense systems.

use super::newton::{NewtonEnd, NewtonOptions, NewtonStatus};
use crate::dense::Lu;
use crate::vector::{axpy, dot, norm};
use faer::Mat;

/// Square system with a dense Jacobian.
pub trait DoglegSystem {
    /// Residual at `x`.
    fn residual(&mut self, x: &[f64]) -> Vec<f64>;
    /// Relative size of a residual; convergence is `measure(f) <= tolerance`.
    fn measure(&self, f: &[f64]) -> f64;
    /// Derivative of the residual at `x`.
    fn jacobian(&mut self, x: &[f64]) -> Mat<f64>;
    /// Returns `true` if the time limit has passed.
    fn is_late(&self) -> bool {
        false
    }
    /// Scale of unknown `i`: the trust region is a ball in `scaling(i) x_i`.
    fn scaling(&self, i: usize) -> f64;
}

/// Radius below which the region is given up, as a fraction of the first Newton step.
const SMALLEST_RADIUS: f64 = 1e-12;

/// Iterates from `x`; each iteration evaluates the Jacobian again.
pub fn dogleg(system: &mut impl DoglegSystem, x: &mut [f64], options: NewtonOptions) -> NewtonEnd {
    let n = x.len();
    let scaling: Vec<f64> = (0..n).map(|i| system.scaling(i)).collect();
    let mut f = system.residual(x);
    let mut radius = f64::INFINITY;
    let mut first_length = 0.0;
    let mut residuals = Vec::new();
    let mut iterations = 0;
    loop {
        let measure = system.measure(&f);
        residuals.push(measure);
        let end = |status| NewtonEnd {
            status,
            iterations,
            measure,
            residuals: residuals.clone(),
        };
        if !measure.is_finite() {
            return end(NewtonStatus::NotFinite);
        }
        if measure <= options.tolerance {
            return end(NewtonStatus::Converged);
        }
        if iterations == options.max_iterations {
            return end(NewtonStatus::IterationLimit);
        }
        if system.is_late() {
            return end(NewtonStatus::TimeLimit);
        }
        // In scaled unknowns y = scaling x: columns divided.
        let mut jacobian = system.jacobian(x);
        for (j, s) in scaling.iter().enumerate() {
            let column = jacobian.col_as_slice_mut(j).iter_mut();
            column.for_each(|v| *v /= s);
        }
        let mut newton: Vec<f64> = f.iter().map(|v| -v).collect();
        Lu::new(jacobian.clone()).solve_column_in_place(&mut newton);
        let gradient: Vec<f64> = (0..n).map(|j| dot(jacobian.col_as_slice(j), &f)).collect();
        let along = times(&jacobian, &gradient);
        let cauchy = dot(&gradient, &gradient) / dot(&along, &along);
        let newton_length = norm(&newton);
        if radius.is_infinite() && newton_length.is_finite() {
            radius = newton_length;
            first_length = newton_length;
        }
        loop {
            let step = dogleg_step(&newton, &gradient, cauchy, radius);
            let trial: Vec<f64> = (0..n).map(|i| x[i] + step[i] / scaling[i]).collect();
            let f_trial = system.residual(&trial);
            let linear = times(&jacobian, &step);
            let predicted: Vec<f64> = f.iter().zip(&linear).map(|(f, l)| f + l).collect();
            let (before, after, model) = (
                dot(&f, &f),
                dot(&f_trial, &f_trial),
                dot(&predicted, &predicted),
            );
            let ratio = (before - after) / (before - model).max(f64::MIN_POSITIVE);
            let length = norm(&step);
            if ratio < 0.25 || !after.is_finite() {
                radius = 0.25 * length;
            } else if ratio > 0.75 {
                radius = radius.max(2.0 * length);
            }
            if after.is_finite() && ratio > 1e-4 {
                x.copy_from_slice(&trial);
                f = f_trial;
                break;
            }
            if radius.is_nan() || radius <= SMALLEST_RADIUS * first_length {
                return end(NewtonStatus::Stagnated);
            }
        }
        iterations += 1;
    }
}

/// Newton's step inside the region, otherwise the steepest-descent step, otherwise the leg between
/// them.
fn dogleg_step(newton: &[f64], gradient: &[f64], cauchy: f64, radius: f64) -> Vec<f64> {
    if norm(newton) <= radius {
        return newton.to_vec();
    }
    let steepest: Vec<f64> = gradient.iter().map(|g| -cauchy * g).collect();
    let length = norm(&steepest);
    if length >= radius || !norm(newton).is_finite() {
        let t = (radius / length).min(1.0);
        return steepest.iter().map(|s| t * s).collect();
    }
    // |steepest + t (newton - steepest)| = radius.
    let leg: Vec<f64> = newton.iter().zip(&steepest).map(|(n, s)| n - s).collect();
    let (a, b) = (dot(&leg, &leg), dot(&leg, &steepest));
    let c = length * length - radius * radius;
    let t = (-b + (b * b - a * c).max(0.0).sqrt()) / a;
    steepest.iter().zip(&leg).map(|(s, l)| s + t * l).collect()
}

fn times(matrix: &Mat<f64>, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; matrix.nrows()];
    for (j, xj) in x.iter().enumerate() {
        axpy(*xj, matrix.col_as_slice(j), &mut y);
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as a system: 10 (x1 - x0^2), 1 - x0.
    struct Valley;

    impl DoglegSystem for Valley {
        fn residual(&mut self, x: &[f64]) -> Vec<f64> {
            vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]
        }
        fn measure(&self, f: &[f64]) -> f64 {
            norm(f)
        }
        fn jacobian(&mut self, x: &[f64]) -> Mat<f64> {
            let rows = [[-20.0 * x[0], 10.0], [-1.0, 0.0]];
            Mat::from_fn(2, 2, |i, j| rows[i][j])
        }
        fn scaling(&self, _: usize) -> f64 {
            1.0
        }
    }

    #[test]
    fn goes_down_the_valley_to_the_root() {
        let mut x = [-1.2, 1.0];
        let options = NewtonOptions::new(1e-12, 50);
        let end = dogleg(&mut Valley, &mut x, options);
        assert_eq!(end.status, NewtonStatus::Converged, "{end:?}");
        assert!((x[0] - 1.0).abs() < 1e-10 && (x[1] - 1.0).abs() < 1e-10);
    }

    #[test]
    fn the_step_never_leaves_the_region() {
        let (newton, gradient) = ([3.0, 4.0], [-1.0, -0.5]);
        for radius in [0.1, 1.0, 2.0, 4.9, 6.0] {
            let step = dogleg_step(&newton, &gradient, 1.5, radius);
            assert!(norm(&step) <= radius * (1.0 + 1e-12));
        }
    }
}
