//! Solutions at the abscissae asked for that a step passes.

use super::cubic::{between, crossings};
use super::point::Point;
use super::{Found, Tracer};
use crate::dlft::branch::bordered::{Plane, Prediction};
use crate::dlft::branch::gauge::BorderRow;
use crate::dlft::branch::over::Over;
use crate::dlft::point::Work;

/// Two places of a curve are one where they lie closer together than this.
const SAME_LENGTH: f64 = 1e-9;

/// Place between the last two points at which the curve crosses an abscissa.
#[derive(Clone, Copy)]
struct Crossing {
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
        over: &dyn Over,
        next: &Point,
        leaves: bool,
        asked: &[f64],
        work: &mut Work,
    ) -> Option<Vec<Found>> {
        let ends = [self.course.from, self.course.to];
        let ends = if leaves { &ends[..] } else { &[] };
        let of_one = |abscissa: &f64| {
            let abscissa = *abscissa;
            let fractions = crossings(&self.last, next, abscissa).into_iter();
            fractions.map(move |fraction| Crossing { fraction, abscissa })
        };
        let mut crossed: Vec<Crossing> = asked.iter().chain(ends).flat_map(of_one).collect();
        crossed.sort_by(|a, b| a.fraction.total_cmp(&b.fraction));
        if let Some(end) = crossed.iter().position(|c| ends.contains(&c.abscissa)) {
            crossed.truncate(end + 1);
        }
        let mut passed: Vec<Found> = Vec::new();
        for crossing in crossed {
            let before = passed.last().map_or(self.passed_length, |p| p.length);
            if self.length_at(crossing, next) > before + SAME_LENGTH {
                passed.push(self.at_crossing(over, crossing, next, work)?);
            }
        }
        Some(passed)
    }

    /// Length of the curve up to a crossing between the last point and `next`.
    fn length_at(&self, crossing: Crossing, next: &Point) -> f64 {
        self.last.length + crossing.fraction * (next.length - self.last.length)
    }

    /// Solution at a crossing between the last point and `next`.
    fn at_crossing(
        &self,
        over: &dyn Over,
        crossing: Crossing,
        next: &Point,
        work: &mut Work,
    ) -> Option<Found> {
        let (last, abscissa) = (&self.last, crossing.abscissa);
        let predicted = Prediction {
            abscissa,
            ..between(last, next, crossing.fraction)
        };
        let plane = self.at_one(abscissa, predicted.u.len());
        let newton = self.newton(over, abscissa)?;
        let (solution, _) = self.corrected(over, &plane, &predicted, last.mean, newton, work)?;
        Some(Found {
            solution,
            abscissa,
            length: self.length_at(crossing, next),
        })
    }

    /// Plane of all points at an abscissa, for so many unknowns.
    pub(super) fn at_one(&self, abscissa: f64, unknowns: usize) -> Plane {
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
