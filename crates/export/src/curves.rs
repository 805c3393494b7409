//! Curves over frequency: what their picture and the chart of the report show.

use std::ops::Range;

use serde::{Serialize, Serializer};

use super::colours::{CurveKind, STATES};
use crate::words::{counted, figure, quantity_in_prefix, seven_digits, supported_digits};
use dovetail_solver::description::EngineOrder;
use dovetail_solver::dlft::branch::{sections, stable_in_drawing};
use dovetail_solver::dlft::{CycleStatus, LinearPoint, Orbit, Outcome, Response};
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::results::peak::{Peak, linear_peak, peak, uncomputed_resonance};
use dovetail_solver::results::quantities::{at_excitation_frequency, friction_power_w, phasors};
use dovetail_solver::run::{Observed, TractionRange};

/// Ratio of the linear peak to the highest value with friction above which the axis is scaled to
/// the latter.
const MUCH_HIGHER: f64 = 5.0;

/// Curves over frequency with one axis of values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curves {
    /// Quantity of the values: `amplitude of tip`.
    pub quantity: String,
    /// SI unit of the values; empty if they have none.
    pub unit: &'static str,
    /// Curves, the most important last.
    pub curves: Vec<Curve>,
    /// Frequencies between which the resonance was not computed, Hz; `None` if it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_computed_hz: Option<[f64; 2]>,
    /// Engine order of a run-up, whose curves are over the speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub along: Option<EngineOrder>,
    /// Largest value that an axis must show: that of all curves, or that of the curves with
    /// friction if these would otherwise be flat at the bottom of the axis.
    pub highest: f64,
}

impl Curves {
    fn new(quantity: String, unit: &'static str, curves: Vec<Curve>) -> Self {
        let highest = |is_counted: &dyn Fn(&Curve) -> bool| {
            let counted = curves.iter().filter(|curve| is_counted(curve));
            counted.map(Curve::highest).fold(0.0, f64::max)
        };
        let all = highest(&|_| true);
        let with_friction = highest(&|curve| curve.kind != CurveKind::Linear);
        let much_higher = with_friction > 0.0 && all > MUCH_HIGHER * with_friction;
        Self {
            highest: seven_digits(if much_higher { with_friction } else { all }),
            quantity,
            unit,
            curves,
            not_computed_hz: None,
            along: None,
        }
    }

    /// The same curves of a run-up along an engine order.
    fn with_engine_order(self, along: Option<EngineOrder>) -> Self {
        Self { along, ..self }
    }

    /// Place of a frequency on the axis: its speed along an engine order, rpm, or itself, Hz.
    pub(crate) fn place(&self, frequency_hz: f64) -> f64 {
        (self.along).map_or(frequency_hz, |order| order.speed_rpm(frequency_hz))
    }

    /// Values of all curves.
    pub(crate) fn values(&self) -> impl Iterator<Item = f64> {
        let points = self.curves.iter().flat_map(|c| &c.points);
        points.filter_map(|p| p.value)
    }
}

/// Curve, or the part of one that is drawn in one style.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    /// Words in the legend.
    pub label: String,
    /// Kind of the curve, which determines its colour.
    pub kind: CurveKind,
    /// True if the curve is dashed.
    pub dashed: bool,
    /// Points along the curve, whose frequencies need not rise.
    #[serde(serialize_with = "columns")]
    pub points: Vec<Point>,
    /// Highest point of a curve of amplitudes.
    #[serde(serialize_with = "serialize_words")]
    pub peak: Option<PeakMark>,
}

/// Point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// `None` if the point did not converge: the curve breaks there.
    pub value: Option<f64>,
    /// Estimated relative error of the value, if it is known.
    pub error: Option<f64>,
    /// False if the requested accuracy was not reached.
    pub is_accurate: bool,
    /// False if the motion is unstable.
    pub is_stable: bool,
}

impl Point {
    /// Returns `true` if this point, which has no value, ends the part of a curve whose last point
    /// is `last`.
    fn ends(&self, last: &Self) -> bool {
        self.value.is_none() && self.frequency_hz == last.frequency_hz
    }

    /// Points of a curve that did not converge.
    pub(crate) fn unconverged_points(points: &[Self]) -> impl Iterator<Item = &Self> {
        let is_end = |i: usize| i > 0 && points[i].ends(&points[i - 1]);
        let points = points.iter().enumerate();
        points.filter_map(move |(i, p)| (p.value.is_none() && !is_end(i)).then_some(p))
    }

    /// Returns `true` if there is a value whose requested accuracy was not reached.
    pub(crate) fn is_inaccurate(&self) -> bool {
        self.value.is_some() && !self.is_accurate
    }

    /// Point with the value of an orbit that has a motion.
    fn from_orbit(orbit: &Orbit, value: impl FnOnce(&Orbit) -> Option<f64>) -> Self {
        let value = value(orbit).filter(|v| orbit.outcome.has_motion() && v.is_finite());
        Self {
            is_accurate: orbit.outcome != Outcome::AccuracyNotReached,
            ..Self::exact(orbit.frequency_hz, value)
        }
    }

    /// Point of a linear curve.
    fn exact(frequency_hz: f64, value: Option<f64>) -> Self {
        Self {
            frequency_hz,
            value,
            error: None,
            is_accurate: true,
            is_stable: true,
        }
    }
}

/// Highest point of a curve of amplitudes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakMark {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, in the SI unit of the observation.
    pub amplitude: f64,
    /// Unit of the amplitude.
    pub unit: &'static str,
    /// Number of digits of the amplitude that its estimated error supports.
    pub digits: usize,
    /// Engine order of a run-up.
    pub along: Option<EngineOrder>,
}

impl PeakMark {
    /// Mark of a peak with the estimated relative error of its amplitude, if known. `None` if
    /// nothing moves.
    fn new(
        peak: Peak,
        unit: &'static str,
        error: Option<f64>,
        along: Option<EngineOrder>,
    ) -> Option<Self> {
        (peak.amplitude_m > 0.0).then(|| Self {
            frequency_hz: peak.frequency_hz,
            amplitude: peak.amplitude_m,
            unit,
            digits: supported_digits(peak.amplitude_m, error),
            along,
        })
    }

    /// Label of the peak, such as `6.5 mm at 450.085 Hz`, in the unit of an axis up to this
    /// amplitude. The place of a run-up is a speed.
    pub fn words(&self, largest: f64) -> String {
        let place = match self.along {
            Some(order) => format!("{} rpm", figure(order.speed_rpm(self.frequency_hz), 5)),
            None => format!("{} Hz", figure(self.frequency_hz, 6)),
        };
        let amplitude = quantity_in_prefix(self.amplitude, largest, self.unit, self.digits);
        format!("{amplitude} at {place}")
    }
}

/// Response and the one that it is compared with.
#[derive(Debug, Clone, Copy)]
pub struct Sweep<'a> {
    /// Response by the harmonics of the scene.
    pub response: &'a Response,
    /// The response with another number of harmonics.
    pub compared: Option<&'a Response>,
    /// Engine order of a run-up, whose curves are over the speed.
    pub along: Option<EngineOrder>,
    /// Range over starting tractions.
    pub tractions: Option<&'a TractionRange>,
}

impl Sweep<'_> {
    /// Motion at the peak of the first observation.
    pub(crate) fn peak_orbit(&self) -> Option<&Orbit> {
        let peak = peak(self.response, 0)?;
        self.response.orbits.get(peak.index)
    }

    /// Amplitude of observation `i`: linear, compared, and the result.
    pub fn amplitude(&self, observed: &Observed, i: usize) -> Curves {
        let unit = observed.quantity.unit();
        let at = |point: &LinearPoint| {
            let amplitude = point.observed_amplitude.get(i).copied();
            Point::exact(point.frequency_hz, amplitude.filter(|a| a.is_finite()))
        };
        let linear = Curve {
            label: "linear".to_owned(),
            kind: CurveKind::Linear,
            dashed: true,
            points: self.response.linear_curve.iter().map(at).collect(),
            peak: linear_peak(self.response, i)
                .and_then(|peak| PeakMark::new(peak, unit, Some(0.0), self.along)),
        };
        let of_response = |kind, response: &Response| Curve {
            peak: peak(response, i).and_then(|peak| {
                let error = response.orbits[peak.index].amplitude_error(i);
                PeakMark::new(peak, unit, error, self.along)
            }),
            ..curve(harmonics_label(response), kind, response, |o| Point {
                error: o.amplitude_error(i),
                ..Point::from_orbit(o, |o| o.observed_amplitude.get(i).copied())
            })
        };
        let quantity = match observed.quantity {
            ObservedQuantity::Displacement => format!("amplitude of {}", observed.name),
            ObservedQuantity::Strain => format!("amplitude of strain {}", observed.name),
        };
        let doubled = self.response.two_periods.iter().map(|branch| {
            let orbits = branch.orbits.iter();
            let branch = Response {
                orbits: orbits
                    .map(|orbit| at_excitation_frequency(orbit).0)
                    .collect(),
                branches: branch.branches.clone(),
                ..Response::default()
            };
            let label = "with two periods".to_owned();
            curve(label, CurveKind::Compared, &branch, |o| {
                Point::from_orbit(o, |o| o.observed_amplitude.get(i).copied())
            })
        });
        let before = std::iter::once(linear)
            .chain(self.traction_range(i))
            .chain(doubled.flat_map(split_unstable));
        Curves {
            not_computed_hz: uncomputed_resonance(self.response, i),
            ..self.curves(quantity, unit, before, &of_response)
        }
    }

    /// Least and largest amplitude of observation `i` over all starting tractions, at the frequencies
    /// at which any of their curves is drawn.
    fn traction_range(&self, i: usize) -> Vec<Curve> {
        let Some(range) = self.tractions else {
            return Vec::new();
        };
        let others = range.others.iter().filter_map(|o| o.response.as_ref());
        let drawn = std::iter::once(self.response)
            .chain(others)
            .map(|response| {
                let amplitude = |o: &Orbit| o.observed_amplitude.get(i).copied();
                points_of(response, true, |o| Point::from_orbit(o, amplitude))
            });
        let drawn: Vec<Vec<Point>> = drawn.collect();
        let mut all_hz: Vec<f64> = drawn.iter().flatten().map(|p| p.frequency_hz).collect();
        all_hz.sort_by(f64::total_cmp);
        all_hz.dedup();
        let ends = ends_of_all(&drawn, &all_hz);
        let curve = |(word, end): (&str, usize)| {
            let points = all_hz.iter().zip(&ends);
            let points = points.map(|(hz, ends)| Point::exact(*hz, ends.map(|ends| ends[end])));
            Curve {
                label: format!("{word} over {} starting tractions", drawn.len()),
                kind: CurveKind::Tractions,
                dashed: false,
                points: points.collect(),
                peak: None,
            }
        };
        vec![curve(("least", 0)), curve(("most", 1))]
    }

    /// Lag of the first harmonic of observation `i` of this name behind the force.
    pub fn phase(&self, name: &str, i: usize) -> Curves {
        let phase = |orbit: &Orbit| {
            let phasors = phasors(orbit.observed.get(i)?);
            Some(phasors.first()?.phase_rad.to_degrees())
        };
        let of_response = |kind, response: &Response| {
            curve(harmonics_label(response), kind, response, |o| Point {
                is_accurate: true,
                ..Point::from_orbit(o, phase)
            })
        };
        let quantity = format!("phase lag of {name}");
        self.curves(quantity, "°", std::iter::empty(), &of_response)
    }

    fn curves(
        &self,
        quantity: String,
        unit: &'static str,
        before: impl Iterator<Item = Curve>,
        of_response: &dyn Fn(CurveKind, &Response) -> Curve,
    ) -> Curves {
        let compared = self.compared.map(|r| of_response(CurveKind::Compared, r));
        let main_curve = of_response(CurveKind::Response, self.response);
        let of_responses = compared.into_iter().chain([main_curve]);
        let curves = before.chain(of_responses.flat_map(split_unstable));
        Curves::new(quantity, unit, curves.collect()).with_engine_order(self.along)
    }

    /// Number of pairs in each state. States that pairs have where they are open at rest are left
    /// out if no pair is ever in them.
    pub(crate) fn pairs(&self) -> Curves {
        type Status = CycleStatus;
        let states = [
            (Status::Stuck, true),
            (Status::Slipping, true),
            (Status::Opening, true),
            (Status::Closing, false),
            (Status::Open, false),
        ];
        let of_state = |status: Status| {
            let count = |orbit: &Orbit| {
                let cycles = orbit.cycles.iter();
                Some(cycles.filter(|cycle| cycle.status == status).count() as f64)
            };
            let label = STATES[status as usize].many.to_owned();
            let kind = CurveKind::State(status);
            curve(label, kind, self.response, |o| Point::from_orbit(o, count))
        };
        let curves = states.map(|(status, always)| (of_state(status), always));
        let curves = curves.into_iter();
        let shown = curves.filter(|(curve, always)| *always || curve.highest() > 0.0);
        let shown = shown.map(|(curve, _)| curve).collect();
        Curves::new("pairs".to_owned(), "", shown).with_engine_order(self.along)
    }

    /// Mean powers that friction and damping take.
    pub(crate) fn powers(&self) -> Curves {
        let of = |label: &str, kind, power: fn(&Orbit) -> f64| {
            let point = |o: &Orbit| Point::from_orbit(o, |o| Some(power(o)));
            curve(label.to_owned(), kind, self.response, point)
        };
        let both = vec![
            of("friction", CurveKind::Friction, friction_power_w),
            of("damping", CurveKind::Damping, |o| o.viscous_power_w),
        ];
        Curves::new("power".to_owned(), "W", both).with_engine_order(self.along)
    }
}

/// A curve in two parts where some of its motions are unstable: these, dashed, and then the others.
fn split_unstable(mut curve: Curve) -> Vec<Curve> {
    let mut parts: [Vec<Point>; 2] = Default::default();
    let mut last: Option<Point> = None;
    for point in std::mem::take(&mut curve.points) {
        let [unstable, stable] = &mut parts;
        if last.is_some_and(|last| point.ends(&last)) {
            last = None;
            part_from(unstable);
            part_from(stable);
            continue;
        }
        match last.filter(|last| last.is_stable != point.is_stable) {
            // A fold, which belongs to both parts, counts as stable.
            Some(fold) if fold.is_stable => {
                part_from(unstable);
                unstable.extend([fold, point]);
            }
            Some(_) => {
                unstable.push(point);
                part_from(stable);
                stable.push(point);
            }
            None if point.is_stable => stable.push(point),
            None => unstable.push(point),
        }
        last = Some(point);
    }
    let [unstable, stable] = parts;
    let apart = (!unstable.is_empty()).then(|| Curve {
        label: format!("{}, unstable", curve.label),
        kind: curve.kind,
        dashed: true,
        points: unstable,
        peak: None,
    });
    curve.points = stable;
    apart.into_iter().chain([curve]).collect()
}

/// Ends the part of a curve that was added last, unless a point without a value does.
fn part_from(points: &mut Vec<Point>) {
    let last = points.last().filter(|last| last.value.is_some());
    let end = last.map(|last| Point::exact(last.frequency_hz, None));
    points.extend(end);
}

/// Curve through the orbits of a response.
fn curve(
    label: String,
    kind: CurveKind,
    response: &Response,
    point: impl Fn(&Orbit) -> Point,
) -> Curve {
    Curve {
        label,
        kind,
        dashed: false,
        points: points_of(response, !matches!(kind, CurveKind::State(_)), point),
        peak: None,
    }
}

/// Points of all curves of a response, with one without a value, at the frequency of the last,
/// between two of them. Between the points of a branch that was followed they are on a cubic, unless
/// they are counts.
fn points_of(response: &Response, is_smooth: bool, point: impl Fn(&Orbit) -> Point) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::with_capacity(response.orbits.len());
    let stable = stable_in_drawing(response);
    let mut stable_after = vec![true; response.orbits.len()];
    for section in sections(response).iter().filter(|s| !s.is_stable) {
        let Range { start, end } = section.points;
        stable_after[start..end - 1].fill(false);
    }
    for curve in response.curves() {
        part_from(&mut points);
        let branch = &response.branches[response.branch_of(curve.start)];
        let lengths = branch.lengths.get(curve.start - branch.points.start..);
        let lengths = lengths.and_then(|lengths| lengths.get(..curve.len()));
        let stable_after = &stable_after[curve.clone()];
        let orbits = response.orbits[curve.clone()].iter().zip(&stable[curve]);
        let points_shown = orbits.map(|(orbit, stable)| Point {
            is_stable: *stable,
            ..point(orbit)
        });
        let run_points: Vec<Point> = points_shown.collect();
        match lengths {
            Some(lengths) if is_smooth => {
                points.extend(rounded(&run_points, lengths, stable_after));
            }
            _ => points.extend(run_points),
        }
    }
    points
}

/// Least and largest value of curves at frequencies, which ascend, on lines between their points;
/// `None` where no curve has the frequency.
fn ends_of_all(curves: &[Vec<Point>], all_hz: &[f64]) -> Vec<Option<[f64; 2]>> {
    let mut extents: Vec<Option<[f64; 2]>> = vec![None; all_hz.len()];
    for two in curves.iter().flat_map(|points| points.windows(2)) {
        let [a, b] = [two[0].frequency_hz, two[1].frequency_hz];
        let (Some(of_a), Some(of_b)) = (two[0].value, two[1].value) else {
            continue;
        };
        let from = all_hz.partition_point(|hz| *hz < a.min(b));
        let to = all_hz.partition_point(|hz| *hz <= a.max(b));
        for (hz, ends) in all_hz[from..to].iter().zip(&mut extents[from..to]) {
            let share = if a == b { 0.0 } else { (hz - a) / (b - a) };
            let value = of_a + share * (of_b - of_a);
            let [least, most] = ends.unwrap_or([value; 2]);
            *ends = Some([least.min(value), most.max(value)]);
        }
    }
    extents
}

/// Parts of an interval between two points of a branch that are drawn.
const PARTS: usize = 8;
/// Change of a phase between two points, in degrees, beyond which it has come round.
const ROUND: f64 = 180.0;

/// Points with others between them, on the cubics over the length of the curve. `stable_after` tells
/// of each point whether the motions between it and the next one are stable.
fn rounded(points: &[Point], lengths: &[f64], stable_after: &[bool]) -> Vec<Point> {
    let frequency = slopes(points, lengths, |p| Some(p.frequency_hz));
    let value = slopes(points, lengths, |p| p.value);
    let mut smooth = Vec::with_capacity(PARTS * points.len());
    for (i, two) in points.windows(2).enumerate() {
        let [from, to] = [two[0], two[1]];
        smooth.push(from);
        let span = lengths[i + 1] - lengths[i];
        let slopes = |of: &[f64]| [span * of[i], span * of[i + 1]];
        let (Some(a), Some(b)) = (from.value, to.value) else {
            continue;
        };
        if (b - a).abs() > ROUND {
            continue;
        }
        for part in 1..PARTS {
            let t = part as f64 / PARTS as f64;
            let errors = from.error.zip(to.error);
            smooth.push(Point {
                frequency_hz: cubic([from.frequency_hz, to.frequency_hz], slopes(&frequency), t),
                value: Some(cubic([a, b], slopes(&value), t)),
                error: errors.map(|(a, b)| a + t * (b - a)),
                is_accurate: from.is_accurate && to.is_accurate,
                is_stable: stable_after[i],
            });
        }
    }
    smooth.extend(points.last());
    unstable_between_turns(&mut smooth);
    smooth
}

/// Moves the ends of unstable parts from the points that were solved to those at which the drawn
/// curve turns back.
fn unstable_between_turns(points: &mut [Point]) {
    // A fold counts as stable.
    let changes = points.windows(2).enumerate();
    let changes = changes.filter(|(_, two)| two[0].is_stable != two[1].is_stable);
    let folds: Vec<(usize, bool)> = changes
        .map(|(at, two)| (at + usize::from(two[1].is_stable), two[0].is_stable))
        .collect();
    for (i, &(fold, before)) in folds.iter().enumerate() {
        let beside = |i: usize| folds.get(i).map(|fold| fold.0);
        let last = i.checked_sub(1).and_then(beside).unwrap_or(0);
        let next = beside(i + 1).unwrap_or(points.len() - 1);
        let [from, to] = [last.max(fold.saturating_sub(PARTS)), next.min(fold + PARTS)];
        let hz = |at: &usize| points[*at].frequency_hz;
        let direction = (hz(&fold) - hz(&from)).signum();
        let farther = |a: &usize, b: &usize| (direction * hz(a)).total_cmp(&(direction * hz(b)));
        let turn = (from..=to).max_by(farther).unwrap_or(fold);
        // Stability is also lost where the curve does not turn back.
        let turn = if turn == from || turn == to {
            fold
        } else {
            turn
        };
        for point in points.iter_mut().take(turn).skip(fold) {
            point.is_stable = before;
        }
        for point in points.iter_mut().take(fold + 1).skip(turn + 1) {
            point.is_stable = !before;
        }
        points[turn].is_stable = true;
    }
}

/// Value at `t` of the cubic with these values and slopes at 0 and 1.
fn cubic([from, to]: [f64; 2], [leaving, arriving]: [f64; 2], t: f64) -> f64 {
    let rise = t * t * (3.0 - 2.0 * t);
    let (u, v) = (t * (1.0 - t) * (1.0 - t), t * t * (t - 1.0));
    from + rise * (to - from) + u * leaving + v * arriving
}

/// Slopes of a quantity over the length at each point: those of the parabola through it and its
/// neighbours, no steeper than lets the cubics rise and fall with the points alone (F. N. Fritsch,
/// R. E. Carlson, SIAM J. Numer. Anal. 17, 1980). 0 where a value beside it is missing.
fn slopes(points: &[Point], lengths: &[f64], of: impl Fn(&Point) -> Option<f64>) -> Vec<f64> {
    let chord = |i: usize| {
        let span = lengths.get(i + 1)? - lengths[i];
        let change = of(&points[i + 1])? - of(&points[i])?;
        (span > 0.0 && change.abs() <= ROUND).then(|| (change / span, span))
    };
    let inside = |i: usize| {
        let (rise, left) = i.checked_sub(1).and_then(chord)?;
        let (fall, right) = chord(i)?;
        let slope = (rise * right + fall * left) / (left + right);
        Some(if rise.signum() == fall.signum() {
            slope.signum() * slope.abs().min(3.0 * rise.abs().min(fall.abs()))
        } else {
            slope
        })
    };
    // At an end that of the parabola through the next two points.
    let slope = |i: usize| {
        let at_end = |chord: Option<(f64, f64)>, beside: Option<f64>| {
            let (chord, _) = chord?;
            let slope = 2.0 * chord - beside.unwrap_or(chord);
            Some(slope.clamp(-3.0 * chord.abs(), 3.0 * chord.abs()))
        };
        inside(i)
            .or_else(|| at_end(chord(i), inside(i + 1)))
            .or_else(|| at_end(i.checked_sub(1).and_then(chord), inside(i.checked_sub(1)?)))
            .unwrap_or(0.0)
    };
    (0..points.len()).map(slope).collect()
}

/// Label such as `with 3 harmonics`, or `with 1 to 7 harmonics` if the frequencies have different
/// numbers.
fn harmonics_label(response: &Response) -> String {
    let harmonics = || response.orbits.iter().map(|o| o.harmonics);
    let least = harmonics().min().unwrap_or(0);
    let most = harmonics().max().unwrap_or(0);
    if least == most {
        format!("with {}", counted(most, "harmonic", "harmonics"))
    } else {
        format!("with {least} to {most} harmonics")
    }
}

impl Curve {
    fn highest(&self) -> f64 {
        let values = self.points.iter().filter_map(|p| p.value);
        values.fold(0.0, f64::max)
    }
}

/// Points as columns of numbers.
fn columns<S: Serializer>(points: &[Point], serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Columns {
        x: Vec<f64>,
        y: Vec<Option<f64>>,
        #[serde(skip_serializing_if = "Vec::is_empty")]
        error: Vec<Option<f64>>,
    }
    let errors = points.iter().map(|p| p.error.map(seven_digits));
    let columns = Columns {
        x: points.iter().map(|p| p.frequency_hz).collect(),
        y: points.iter().map(|p| p.value.map(seven_digits)).collect(),
        error: if points.iter().any(|p| p.error.is_some()) {
            errors.collect()
        } else {
            Vec::new()
        },
    };
    columns.serialize(serializer)
}

/// Peak with its words.
fn serialize_words<S: Serializer>(
    peak: &Option<PeakMark>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let with_words = peak.map(|p| (p.frequency_hz, p.amplitude, p.words(p.amplitude)));
    with_words.serialize(serializer)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five points of a circle, over its length: the frequency turns back, the value has a peak.
    #[test]
    fn between_points_of_a_branch_the_curve_is_round_and_a_phase_that_comes_round_is_not() {
        let lengths: Vec<f64> = (0..5).map(|i| 0.4 * f64::from(i)).collect();
        let at = |l: &f64| Point {
            error: Some(*l),
            ..Point::exact(10.0 + l.sin(), Some(2.0 + l.cos()))
        };
        let points: Vec<Point> = lengths.iter().map(at).collect();
        let stable = [true; 5];
        let drawn = rounded(&points, &lengths, &stable);
        assert_eq!(drawn.len(), 4 * PARTS + 1);
        for (i, p) in drawn.iter().enumerate() {
            let radius = (p.frequency_hz - 10.0).hypot(p.value.unwrap() - 2.0);
            assert!((radius - 1.0).abs() < 5e-3, "{radius}");
            let length = p.error.unwrap();
            assert!((length - 0.4 * i as f64 / PARTS as f64).abs() < 1e-12);
        }
        let phase = |l: &f64| Point::exact(10.0 + l, Some(if *l < 1.0 { 170.0 } else { -170.0 }));
        let points: Vec<Point> = lengths.iter().map(phase).collect();
        let drawn = rounded(&points, &lengths, &stable);
        assert_eq!(drawn.len(), 3 * PARTS + 2);
        assert!(drawn.iter().all(|p| p.value.unwrap().abs() == 170.0));
        let mut points = points;
        points[2].value = None;
        assert_eq!(rounded(&points, &lengths, &stable).len(), 2 * PARTS + 3);
    }

    /// The drawn curve turns back one point before or behind the point that was solved.
    #[test]
    fn unstable_parts_end_where_the_drawn_curve_turns_back() {
        let drawn = |hz: &[f64], unstable: Range<usize>| -> Vec<usize> {
            let point = |(i, hz): (usize, &f64)| Point {
                is_stable: !unstable.contains(&i),
                ..Point::exact(*hz, Some(1.0))
            };
            let mut points: Vec<Point> = hz.iter().enumerate().map(point).collect();
            unstable_between_turns(&mut points);
            (0..points.len())
                .filter(|i| !points[*i].is_stable)
                .collect()
        };
        let rising = [1.0, 2.0, 3.0, 3.1, 2.9, 2.0, 1.9, 2.0, 3.0, 4.0];
        assert_eq!(drawn(&rising, 3..5), [4, 5]);
        assert_eq!(drawn(&rising, 4..6), [4, 5]);
        assert_eq!(drawn(&rising, 5..7), [4, 5]);
        let falling = rising.map(|hz| 10.0 - hz);
        assert_eq!(drawn(&falling, 3..5), [4, 5]);
        assert_eq!(drawn(&falling, 5..7), [4, 5]);
        assert_eq!(drawn(&rising, 0..0), [0; 0]);
    }

    /// A curve that folds at its third and fifth point, with no point between two further folds.
    #[test]
    fn unstable_motions_are_a_dashed_curve_of_their_own() {
        let point = |i: usize| Point {
            is_stable: ![3, 6].contains(&i),
            ..Point::exact(i as f64, Some(1.0))
        };
        let curve = Curve {
            label: "with 3 harmonics".to_owned(),
            kind: CurveKind::Response,
            dashed: false,
            points: (0..8).map(point).collect(),
            peak: None,
        };
        let [apart, own] = &split_unstable(curve.clone())[..] else {
            panic!("two parts");
        };
        let drawn = |curve: &Curve| -> Vec<(usize, bool)> {
            let points = curve.points.iter();
            points
                .map(|p| (p.frequency_hz as usize, p.value.is_some()))
                .collect()
        };
        assert_eq!(
            (&apart.label[..], apart.dashed),
            ("with 3 harmonics, unstable", true)
        );
        let [there, end] = [true, false];
        let expected = [
            (2, there),
            (3, there),
            (4, there),
            (4, end),
            (5, there),
            (6, there),
            (7, there),
        ];
        assert_eq!(drawn(apart), expected);
        let expected = [
            (0, there),
            (1, there),
            (2, there),
            (2, end),
            (4, there),
            (5, there),
            (5, end),
            (7, there),
        ];
        assert_eq!(drawn(own), expected);
        assert!(!own.dashed);
        assert_eq!(Point::unconverged_points(&own.points).count(), 0);
        // The next curve begins where no line leads to.
        let mut two = curve.clone();
        two.points.truncate(4);
        two.points
            .extend([Point::exact(3.0, None), Point::exact(9.0, Some(1.0))]);
        let [apart, own] = &split_unstable(two)[..] else {
            panic!("two parts");
        };
        assert_eq!(drawn(apart), [(2, there), (3, there), (3, end)]);
        let expected = [(0, there), (1, there), (2, there), (2, end), (9, there)];
        assert_eq!(drawn(own), expected);
        let mut stable = curve;
        stable.points.iter_mut().for_each(|p| p.is_stable = true);
        stable.points[4].value = None;
        assert_eq!(split_unstable(stable.clone()), [stable.clone()]);
        assert_eq!(Point::unconverged_points(&stable.points).count(), 1);
    }

    #[test]
    fn the_axis_is_that_of_friction_where_the_linear_peak_is_much_higher() {
        let curve = |kind, highest: f64| Curve {
            label: String::new(),
            kind,
            dashed: false,
            points: vec![
                Point::exact(1.0, Some(0.1)),
                Point::exact(2.0, Some(highest)),
                Point::exact(3.0, None),
            ],
            peak: None,
        };
        let of = |curves: &[Curve]| Curves::new(String::new(), "m", curves.to_vec()).highest;
        let linear = |highest| curve(CurveKind::Linear, highest);
        let compared = |highest| curve(CurveKind::Compared, highest);
        let own = |highest| curve(CurveKind::Response, highest);
        assert_eq!(of(&[linear(16.8), compared(7.0), own(6.5)]), 16.8);
        assert_eq!(of(&[linear(32.0), compared(1.3), own(1.2)]), 1.3);
        assert_eq!(of(&[linear(3.0)]), 3.0);
    }

    #[test]
    fn words_at_a_peak_are_in_the_unit_of_the_axis_and_of_the_digits_that_its_error_supports() {
        let peak = |amplitude_m: f64, error: Option<f64>| {
            let at = Peak {
                is_at_an_end: false,
                index: 0,
                frequency_hz: 287.6921,
                amplitude_m,
            };
            PeakMark::new(at, "m", error, None)
        };
        let words = |amplitude_m, error| peak(amplitude_m, error).unwrap().words(3.2e-3);
        assert_eq!(words(1.2947e-4, Some(0.2)), "0.13 mm at 287.692 Hz");
        assert_eq!(words(3.2361e-3, Some(0.0)), "3.236 mm at 287.692 Hz");
        assert_eq!(peak(0.0, None), None);
    }
}
