//! Solutions on a curve from predictions of them: in a plane across the curve, with the mean that
//! holds there, or at an abscissa.

use super::Tracer;
use super::point::CurvePoint;
use crate::dlft::branch::bordered::{Plane, Prediction, correct};
use crate::dlft::branch::over::ContinuationParameter;
use crate::dlft::point::{Neighbour, Solution, SolverWork};
use crate::dlft::retention::Mean;
use dovetail_numerics::nonlinear::NewtonOptions;

impl Tracer {
    /// Solution in a plane between two points, from the first of `starts` that leads to one, with
    /// the mean of the first point, or else with that of the second. Where `may_retain` is true and
    /// neither is found, the mean may be retained where friction does not hold the bodies.
    pub(super) fn corrected_between(
        &self,
        ends: [&CurvePoint; 2],
        over: &dyn ContinuationParameter,
        plane: &Plane,
        starts: &[Prediction],
        may_retain: bool,
        work: &mut SolverWork,
    ) -> Option<(Solution, f64)> {
        let first = starts.first()?;
        let options = self.newton(over, first.abscissa)?;
        let mut means = ends.map(|end| end.mean).to_vec();
        means.dedup();
        let solvers = self.solvers(over);
        for &mean in &means {
            for start in starts {
                let solution = correct(solvers, plane, start, mean, options, work);
                if let Some(solution) = solution.filter(|(solution, _)| solution.is_converged()) {
                    return Some(solution);
                }
            }
        }
        let may_retain = may_retain && means.contains(&Mean::Free);
        may_retain.then(|| self.retained(over, plane, first, options, work))?
    }

    /// Solution in a plane, with this mean, or with the retained one where no free one is found and
    /// friction does not hold the bodies any more; `None` where none is found.
    pub(super) fn corrected(
        &self,
        over: &dyn ContinuationParameter,
        plane: &Plane,
        start: &Prediction,
        mean: Mean,
        options: NewtonOptions,
        work: &mut SolverWork,
    ) -> Option<(Solution, f64)> {
        let (found, abscissa) = correct(self.solvers(over), plane, start, mean, options, work)?;
        if found.is_converged() {
            return Some((found, abscissa));
        }
        (mean == Mean::Free).then(|| self.retained(over, plane, start, options, work))?
    }

    /// Solution in a plane with the mean retained; `None` where none is found, or friction holds the
    /// bodies.
    fn retained(
        &self,
        over: &dyn ContinuationParameter,
        plane: &Plane,
        start: &Prediction,
        options: NewtonOptions,
        work: &mut SolverWork,
    ) -> Option<(Solution, f64)> {
        let solvers = self.solvers(over);
        let (found, abscissa) = correct(solvers, plane, start, Mean::Retained, options, work)?;
        if !found.is_converged() {
            return None;
        }
        let settled = solvers.curve_solution(abscissa, found, work)?;
        let is_retained = settled.balance.mean() == Mean::Retained;
        (is_retained && settled.is_converged()).then_some((settled, abscissa))
    }

    /// Solution at an abscissa ahead, found in all the ways that a frequency is solved in. `None`
    /// where a fold may lie before it.
    pub(super) fn solve_ahead(
        &mut self,
        over: &dyn ContinuationParameter,
        abscissa: f64,
        work: &mut SolverWork,
    ) -> Option<(Solution, f64)> {
        let CurvePoint { direction, .. } = &self.last;
        let moved_by = abscissa - self.last.abscissa;
        let is_before = |failed: f64| (failed - abscissa) * moved_by >= 0.0;
        if moved_by / direction.abscissa < 0.5 * self.step || self.failed.is_some_and(is_before) {
            return None;
        }
        let [from_hz, frequency_hz] =
            [self.last.abscissa, abscissa].map(|at| over.frequency_hz(at));
        let slope = direction.u.iter().map(|u| u / direction.abscissa);
        let (u, slope) = if from_hz == frequency_hz {
            let both = self.last.u.iter().zip(slope);
            (both.map(|(u, slope)| u + moved_by * slope).collect(), None)
        } else {
            (self.last.u.clone(), Some(slope.collect()))
        };
        let neighbour = Neighbour {
            frequency_hz: from_hz,
            u,
            slope,
            mean: self.last.mean,
        };
        let solver = self.solvers(over).solver(abscissa)?;
        let solution = solver.solve(frequency_hz, Some(&neighbour), work);
        self.failed = (!solution.is_converged()).then_some(abscissa);
        solution.is_converged().then_some((solution, abscissa))
    }
}
