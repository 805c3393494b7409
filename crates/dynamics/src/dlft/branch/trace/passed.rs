//! Solutions at the abscissae asked for that a step passes.

use super::cubic::{crossings, interpolate};
use super::point::CurvePoint;
use super::{Asked, CurveSolution, Tracer};
use crate::dlft::branch::bordered::{Plane, Prediction};
use crate::dlft::branch::gauge::BorderRow;
use crate::dlft::branch::over::ContinuationParameter;
use crate::dlft::point::SolverWork;

/// Two places of a curve are one where they lie closer together than this.
const SAME_LENGTH: f64 = 1e-9;

/// Place between the last two points at which the curve crosses an abscissa.
#[derive(Clone, Copy)]
struct PassedAbscissa {
    /// Fraction of the way from one to the other.
    fraction: f64,
    abscissa: f64,
}

impl Tracer {
    /// Solutions at the abscissae asked for that the curve crosses before `next`, in their order.
    /// Where it leaves the range the end of the range is the last of them. `None` where one of them
    /// is not found.
    pub(super) fn passed_before(
        &self,
        over: &dyn ContinuationParameter,
        next: &CurvePoint,
        leaves: bool,
        asked: &Asked<'_>,
        work: &mut SolverWork,
    ) -> Option<Vec<CurveSolution>> {
        let ends = [self.course.from, self.course.to];
        let ends = if leaves { &ends[..] } else { &[] };
        let of_one = |abscissa: &f64| {
            let abscissa = *abscissa;
            let fractions = crossings(&self.last, next, abscissa).into_iter();
            fractions.map(move |fraction| PassedAbscissa { fraction, abscissa })
        };
        let by_fraction =
            |a: &PassedAbscissa, b: &PassedAbscissa| a.fraction.total_cmp(&b.fraction);
        // Beside a fold between both ends the cubic says little.
        let folds = self.last.direction.abscissa * next.direction.abscissa < 0.0;
        let compared = if folds { &[] } else { asked.last };
        let each = asked.each.iter().chain(ends).flat_map(of_one);
        let mut crossed: Vec<PassedAbscissa> = each.collect();
        if crossed.is_empty() {
            crossed.extend(compared.iter().flat_map(of_one).max_by(by_fraction));
        }
        crossed.sort_by(by_fraction);
        if let Some(end) = crossed.iter().position(|c| ends.contains(&c.abscissa)) {
            crossed.truncate(end + 1);
        }
        let mut passed: Vec<CurveSolution> = Vec::new();
        for crossing in crossed {
            let before = passed.last().map_or(self.passed_length, |p| p.length);
            if self.length_at(crossing, next) > before + SAME_LENGTH {
                passed.push(self.solve_crossing(over, crossing, next, work)?);
            }
        }
        Some(passed)
    }

    /// Length of the curve up to a crossing between the last point and `next`.
    fn length_at(&self, crossing: PassedAbscissa, next: &CurvePoint) -> f64 {
        self.last.length + crossing.fraction * (next.length - self.last.length)
    }

    /// Solution at a crossing between the last point and `next`.
    fn solve_crossing(
        &self,
        over: &dyn ContinuationParameter,
        crossing: PassedAbscissa,
        next: &CurvePoint,
        work: &mut SolverWork,
    ) -> Option<CurveSolution> {
        let (last, abscissa) = (&self.last, crossing.abscissa);
        let predicted = Prediction {
            abscissa,
            ..interpolate(last, next, crossing.fraction)
        };
        let plane = self.abscissa_plane(abscissa, predicted.u.len());
        let newton = self.newton(over, abscissa)?;
        let (solution, _) = self.corrected(over, &plane, &predicted, last.mean, newton, work)?;
        Some(CurveSolution {
            solution,
            abscissa,
            length: self.length_at(crossing, next),
        })
    }

    /// Plane of all points at an abscissa, for so many unknowns.
    pub(super) fn abscissa_plane(&self, abscissa: f64, unknowns: usize) -> Plane {
        let corner = self.course.range().recip();
        Plane {
            across: BorderRow {
                row: vec![0.0; unknowns],
                corner,
            },
            value: corner * abscissa,
        }
    }
}
