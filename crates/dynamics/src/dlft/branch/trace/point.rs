//! Point of a curve: its motion, its direction, and the plane across it.

use crate::dlft::branch::bordered::{Plane, Prediction, direction, orientation};
use crate::dlft::branch::gauge::{BorderRow, Change, Direction, Gauge, Scales, motion};
use crate::dlft::branch::over::{ContinuationParameter, DerivativePoint, SolutionAt, Solvers};
use crate::dlft::point::{SolverWork, resized};
use crate::dlft::retention::Mean;
use dovetail_numerics::vector::axpy;

/// Length along the direction of a point of the difference that takes the change of amplitudes.
const DIFFERENCE: f64 = 1e-6;

/// Point of a curve, from which the next one is found.
#[derive(Debug, Clone)]
pub(crate) struct CurvePoint {
    /// Abscissa of the curve, such as the frequency, Hz.
    pub abscissa: f64,
    /// Coefficients, m.
    pub u: Vec<f64>,
    /// Treatment of the mean along the motions that only friction holds.
    pub mean: Mean,
    /// Motion T ([`motion`]).
    pub motion: Vec<f64>,
    /// Direction of the curve.
    pub direction: Direction,
    /// Change of T along it.
    pub motion_along: Vec<f64>,
    /// Observed amplitudes.
    pub heights: Vec<Height>,
    /// Scales of the length at the point.
    pub(super) scales: Scales,
    /// Coefficients of dU and dp in the length of a change along the direction.
    across: BorderRow,
    /// Length of the curve up to the point.
    pub length: f64,
}

/// Observed amplitude at a point of a curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Height {
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Its change along the curve, m.
    pub along_m: f64,
}

/// Changes in which the length of a curve is to grow at a point.
pub(super) enum Ahead {
    /// Those of the abscissa, with this sign.
    Abscissa(f64),
    /// Those along a direction, such as that of a point nearby.
    Along(Change),
}

/// Motion T of a point, with its place in the measure of length.
pub(super) struct Measured {
    pub(super) motion: Vec<f64>,
    /// Scales of the length at the point.
    pub(super) scales: Scales,
    /// Length of the curve up to it.
    pub(super) length: f64,
}

impl CurvePoint {
    /// Cosine of the angle between the curve here and at another point.
    pub(super) fn cosine(&self, other: &Self) -> f64 {
        let (own, along) = (self.tangent(), other.tangent());
        self.scales.product(&own, &along) / self.scales.length(&along)
    }

    /// Returns `true` if the directions here and at the next point are known to lead the curve
    /// opposite ways. A Jacobian is formed for this only where the abscissa turns back.
    pub(super) fn runs_against(&self, next: &Self, solvers: Solvers<'_>) -> bool {
        if self.mean != next.mean || self.u.len() != next.u.len() {
            return false;
        }
        let turns = self.direction.abscissa * next.direction.abscissa < 0.0;
        let negative = |point: &Self| match point.direction.is_negative {
            None if turns => point.orientation(solvers),
            known => known,
        };
        let own = negative(self);
        own.is_some() && negative(next).is_some_and(|its| Some(its) != own)
    }

    /// Returns `true` if the direction at this point is known to lead the curve opposite to that with
    /// another number of harmonics. Further harmonics have blocks of positive determinant.
    pub(super) fn is_opposite_with_other_harmonics(&self, other: &Self) -> bool {
        let [own, its] = [self, other].map(|point| point.direction.is_negative);
        self.mean == other.mean && own.zip(its).is_some_and(|(own, its)| own != its)
    }

    /// [`Direction::is_negative`], from the Jacobian.
    fn orientation(&self, solvers: Solvers<'_>) -> Option<bool> {
        let abscissa = self.abscissa;
        let solver = solvers.solver(abscissa)?;
        let frequency_hz = solvers.over.frequency_hz(abscissa);
        let solution = &solver.evaluated(frequency_hz, &self.u, self.mean)?;
        orientation(
            solvers,
            SolutionAt { solution, abscissa },
            self.across.clone(),
        )
    }

    /// Change of T and of the abscissa along the direction of the curve.
    pub(super) fn tangent(&self) -> Change {
        Change {
            motion: self.motion_along.clone(),
            abscissa: self.direction.abscissa,
        }
    }

    /// Change of T and of the abscissa to another point.
    pub(super) fn to(&self, other: &Self) -> Change {
        self.change_to(&other.motion, other.abscissa)
    }

    /// Change of T and of the abscissa to where they have these values.
    pub(super) fn change_to(&self, motion: &[f64], abscissa: f64) -> Change {
        let both = motion.iter().zip(&self.motion);
        Change {
            motion: both.map(|(there, here)| there - here).collect(),
            abscissa: abscissa - self.abscissa,
        }
    }

    /// Lengths from here, and back from another point, at which the tangents of the curve come
    /// closest to each other.
    pub(crate) fn ways_to_meeting(&self, other: &Self) -> [f64; 2] {
        let joins = self.to(other);
        let [own, its] = [self, other].map(Self::tangent);
        let product = |a, b| self.scales.product(a, b);
        let (aa, bb, ab) = (
            product(&own, &own),
            product(&its, &its),
            product(&own, &its),
        );
        let (aj, bj) = (product(&own, &joins), product(&its, &joins));
        let determinant = aa * bb - ab * ab;
        [aj * bb - bj * ab, bj * aa - aj * ab].map(|way| way / determinant)
    }

    /// Turns the direction of the curve round.
    pub(crate) fn turn(&mut self) {
        let along = self.direction.u.iter_mut().chain(&mut self.motion_along);
        let heights = self.heights.iter_mut().map(|height| &mut height.along_m);
        (along.chain(&mut self.across.row).chain(heights)).for_each(|v| *v = -*v);
        self.direction.abscissa = -self.direction.abscissa;
        self.direction.is_negative = self.direction.is_negative.map(|negative| !negative);
        self.across.corner = -self.across.corner;
    }

    /// The point with so many unknowns: harmonics that it does not have are zero.
    pub(crate) fn resized(mut self, unknowns: usize) -> Self {
        for of_harmonics in [&mut self.u, &mut self.direction.u, &mut self.across.row] {
            *of_harmonics = resized(of_harmonics, unknowns);
        }
        self
    }

    /// U and the abscissa so far along the direction of the point.
    pub(super) fn extrapolate(&self, length: f64) -> Prediction {
        let mut u = self.u.clone();
        axpy(length, &self.direction.u, &mut u);
        let abscissa = self.abscissa + length * self.direction.abscissa;
        Prediction { u, abscissa }
    }

    /// Plane across the direction of the point, through another one, in units of the step h.
    pub(super) fn plane(&self, h: f64, through: &Prediction) -> Plane {
        Plane::normal_to(&self.across, h, through)
    }

    /// Point at a solution. The length of the curve grows in the direction of `ahead`.
    pub(super) fn new(
        solvers: Solvers<'_>,
        at: SolutionAt<'_>,
        measured: Measured,
        ahead: &Ahead,
        work: &mut SolverWork,
    ) -> Option<Self> {
        let SolutionAt { solution, abscissa } = at;
        let Measured {
            motion,
            scales,
            length,
        } = measured;
        let gauge = gauge(solvers.over, solvers.place_of(at))?;
        let grows = match ahead {
            Ahead::Abscissa(sign) => BorderRow {
                row: vec![0.0; solution.u.len()],
                corner: *sign,
            },
            Ahead::Along(change) => scales.border_row(&gauge, change),
        };
        let mut direction = direction(solvers, at, grows, work)?;
        let mut tangent = Change {
            motion: gauge.directional_change(&direction),
            abscissa: direction.abscissa,
        };
        // Of length 1.
        let by = scales.length(&tangent).recip();
        tangent.motion.iter_mut().for_each(|t| *t *= by);
        direction.u.iter_mut().for_each(|u| *u *= by);
        direction.abscissa *= by;
        tangent.abscissa = direction.abscissa;
        let heights = heights(solvers, at, &direction)?;
        Some(Self {
            heights,
            abscissa,
            u: solution.u.clone(),
            mean: solution.balance.mean(),
            motion,
            across: scales.border_row(&gauge, &tangent),
            scales,
            direction,
            motion_along: tangent.motion,
            length,
        })
    }
}

/// Motion T of a solution.
pub(super) fn motion_of(over: &dyn ContinuationParameter, at: SolutionAt<'_>) -> Vec<f64> {
    let frequency_hz = over.frequency_hz(at.abscissa);
    motion(&at.solution.balance, &at.solution.u, frequency_hz)
}

/// Gauge at a place; `None` where there are no models near it.
pub(super) fn gauge(over: &dyn ContinuationParameter, place: DerivativePoint<'_>) -> Option<Gauge> {
    let slope = over.motion_slope(place)?;
    let frequency_hz = over.frequency_hz(place.abscissa);
    Some(Gauge::new(place.balance, place.u, frequency_hz, slope))
}

/// Observed amplitudes at a solution, and their changes along a direction of length 1.
fn heights(solvers: Solvers<'_>, at: SolutionAt<'_>, direction: &Direction) -> Option<Vec<Height>> {
    let place = solvers.place_of(at);
    let at = |length: f64| {
        let mut u = place.u.to_vec();
        axpy(length, &direction.u, &mut u);
        (solvers.over).amplitudes_near(place, &u, length * direction.abscissa)
    };
    let (here, ahead, behind) = (at(0.0)?, at(DIFFERENCE)?, at(-DIFFERENCE)?);
    let changes = ahead.iter().zip(&behind).map(|(a, b)| a - b);
    let both = here.iter().zip(changes);
    let heights = both.map(|(amplitude_m, change)| Height {
        amplitude_m: *amplitude_m,
        along_m: change / (2.0 * DIFFERENCE),
    });
    Some(heights.collect())
}
