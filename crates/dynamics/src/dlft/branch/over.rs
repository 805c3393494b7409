//! Quantity that a curve is followed over, and the solvers of its points.
//!
//! A curve has an abscissa: the frequency, Hz, or a value of the model, or the logarithm of that
//! value. [`ContinuationParameter`] has the balances at an abscissa, and the derivatives by it at
//! constant U. [`FrequencyParameter`] is the response of one model; `values.rs` has that of a value
//! of the model.

use super::gauge::{Gauge, motion};
use crate::dlft::LinearPoint;
use crate::dlft::accuracy::Refinement;
use crate::dlft::balance::{Balance, Jacobian};
use crate::dlft::orbit::{linear_point, observed_amplitudes_m};
use crate::dlft::point::{FrequencySolver, Solution, SolverWork};
use crate::dlft::retention::Mean;
use crate::dlft::sweep::SweepSolvers;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Point whose derivatives are asked for.
#[derive(Clone, Copy)]
pub(crate) struct DerivativePoint<'p> {
    /// Balance at the point.
    pub balance: &'p Balance,
    /// Level of its harmonics.
    pub level: usize,
    /// Coefficients, m.
    pub u: &'p [f64],
    /// Abscissa of the point.
    pub abscissa: f64,
}

/// Solution on a curve, with its abscissa.
#[derive(Clone, Copy)]
pub(crate) struct SolutionAt<'s> {
    /// The solution.
    pub solution: &'s Solution,
    /// Its abscissa.
    pub abscissa: f64,
}

/// Use of a derivative by the abscissa.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Use {
    /// Newton's method corrects what a derivative of a point nearby is off.
    Correction,
    /// The direction of the curve is as accurate as the derivative.
    Direction,
}

/// Quantity that a curve is followed over, within one step of the follower.
pub(crate) trait ContinuationParameter {
    /// Solvers at an abscissa; `None` where there is no model.
    fn refinement(&self, abscissa: f64) -> Option<Arc<Refinement<'_>>>;

    /// Frequency of the first harmonic at an abscissa, Hz.
    fn frequency_hz(&self, abscissa: f64) -> f64;

    /// Linear reference at an abscissa.
    fn linear_point(&self, abscissa: f64) -> LinearPoint;

    /// End of the range before an abscissa beyond it, where there are no models; `None` inside of
    /// the range, and where a step may leave it.
    fn end_before(&self, abscissa: f64) -> Option<f64>;

    /// Derivative of the residual by the abscissa at constant U, N; `None` without models nearby.
    fn column(
        &self,
        place: DerivativePoint<'_>,
        jacobian: &Jacobian,
        purpose: Use,
    ) -> Option<Vec<f64>>;

    /// Motion T of the U of a place at another abscissa nearby; `None` without a model there.
    fn motion_at(&self, place: DerivativePoint<'_>, abscissa: f64) -> Option<Vec<f64>>;

    /// Derivative of the motion T by the abscissa at constant U; `None` without models nearby.
    fn motion_slope(&self, place: DerivativePoint<'_>) -> Option<Vec<f64>>;

    /// Observed amplitudes, m, where U and the abscissa of the place are moved a little: `u` in
    /// place of its U, and an abscissa greater by `by`. `None` without models nearby.
    fn amplitudes_near(&self, place: DerivativePoint<'_>, u: &[f64], by: f64) -> Option<Vec<f64>>;
}

/// Solvers of the points of a curve that have the harmonics of one level.
#[derive(Clone, Copy)]
pub(crate) struct Solvers<'a> {
    /// Quantity that the curve is followed over.
    pub over: &'a dyn ContinuationParameter,
    /// Level of the harmonics.
    pub level: usize,
}

impl<'a> Solvers<'a> {
    /// Solver at an abscissa.
    pub(crate) fn solver(self, abscissa: f64) -> Option<FrequencySolver<'a>> {
        Some(self.over.refinement(abscissa)?.level(self.level).clone())
    }

    /// Balance at an abscissa with this mean; `None` where there is no model, or nothing to retain.
    pub(crate) fn balance(self, abscissa: f64, mean: Mean) -> Option<Balance> {
        let solver = self.solver(abscissa)?;
        solver.balance(self.over.frequency_hz(abscissa), mean)
    }

    /// Solution of a step along a curve with the mean that holds there; `None` where it has walked
    /// off.
    pub(crate) fn curve_solution(
        self,
        abscissa: f64,
        solved: Solution,
        work: &mut SolverWork,
    ) -> Option<Solution> {
        let frequency_hz = self.over.frequency_hz(abscissa);
        self.solver(abscissa)?
            .curve_solution(frequency_hz, solved, work)
    }

    /// Place of a point.
    pub(crate) fn place<'p>(
        self,
        balance: &'p Balance,
        u: &'p [f64],
        abscissa: f64,
    ) -> DerivativePoint<'p> {
        DerivativePoint {
            balance,
            level: self.level,
            u,
            abscissa,
        }
    }

    /// Place of a solution.
    pub(crate) fn place_of<'p>(self, at: SolutionAt<'p>) -> DerivativePoint<'p> {
        self.place(&at.solution.balance, &at.solution.u, at.abscissa)
    }
}

/// The frequency of one model, Hz.
pub(crate) struct FrequencyParameter<'a>(pub &'a SweepSolvers<'a>);

impl ContinuationParameter for FrequencyParameter<'_> {
    fn refinement(&self, frequency_hz: f64) -> Option<Arc<Refinement<'_>>> {
        let is_frequency = frequency_hz > 0.0 && frequency_hz.is_finite();
        is_frequency.then(|| Arc::clone(&self.0.refinement))
    }

    fn frequency_hz(&self, frequency_hz: f64) -> f64 {
        frequency_hz
    }

    fn linear_point(&self, frequency_hz: f64) -> LinearPoint {
        linear_point(&self.0.linear, self.0.harmonics(), frequency_hz)
    }

    fn end_before(&self, _: f64) -> Option<f64> {
        None
    }

    fn column(&self, place: DerivativePoint<'_>, jacobian: &Jacobian, _: Use) -> Option<Vec<f64>> {
        let n = place.balance.unknowns_per_block();
        Some(jacobian.unbalanced_part(&slope_per_hz(place), n))
    }

    fn motion_at(&self, place: DerivativePoint<'_>, frequency_hz: f64) -> Option<Vec<f64>> {
        Some(motion(place.balance, place.u, frequency_hz))
    }

    fn motion_slope(&self, place: DerivativePoint<'_>) -> Option<Vec<f64>> {
        Some(Gauge::motion_per_hz(place.balance, place.u, place.abscissa))
    }

    fn amplitudes_near(
        &self,
        place: DerivativePoint<'_>,
        u: &[f64],
        by_hz: f64,
    ) -> Option<Vec<f64>> {
        Some(observed_amplitudes_m(
            place.balance,
            u,
            place.abscissa + by_hz,
        ))
    }
}

/// Derivative of Lambda U - F with respect to the frequency, N/Hz.
fn slope_per_hz(place: DerivativePoint<'_>) -> Vec<f64> {
    let mut slope = place.balance.frequency_slope(place.u, TAU * place.abscissa);
    slope.iter_mut().for_each(|s| *s *= TAU);
    slope
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::jacobians::{OMEGA_RAD_S, sample_points_of_waves_too};

    #[test]
    fn the_column_of_the_frequency_is_that_by_differences() {
        for (what, balance, u) in &sample_points_of_waves_too() {
            let at = |omega: f64| {
                let mut moved = Balance::new(&balance.setting, omega);
                let given = Balance::new(&balance.setting, OMEGA_RAD_S);
                // The samples have loads of their own.
                for (i, f) in moved.force.iter_mut().enumerate() {
                    *f += balance.force[i] - given.force[i];
                }
                moved.evaluate(u).residual
            };
            let step = 1e-7;
            let [above, below] = [OMEGA_RAD_S + step, OMEGA_RAD_S - step].map(at);
            let jacobian = balance.linearise(&balance.evaluate(u));
            let place = DerivativePoint {
                balance,
                level: 0,
                u,
                abscissa: OMEGA_RAD_S / TAU,
            };
            let slope = slope_per_hz(place);
            let column = jacobian.unbalanced_part(&slope, balance.unknowns_per_block());
            let largest = column.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for ((a, b), column) in above.iter().zip(&below).zip(&column) {
                let by_differences = TAU * (a - b) / (2.0 * step);
                let off = (by_differences - column).abs();
                assert!(off < 1e-5 * largest, "{what}: {by_differences} {column}");
            }
        }
    }
}
