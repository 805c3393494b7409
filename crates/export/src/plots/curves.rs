//! Draws curves against frequency, with their peaks.

use std::path::Path;

use super::canvas::{LEFT, MIDDLE, Paint, Place, RIGHT, Stroke, WHITE};
use super::chart::{Chart, SIZE};
use super::legend::{Legend, Mark, band};
use super::{Axis, PictureHeading, Scale, TEXT, ends, width_of, write_svg};
use crate::ExportError;
use crate::colours::{Colour, CurveKind, NOTHING};
use crate::curves::{Curve, Curves, PeakMark, Point};
use crate::words::{counted, figure};
use dovetail_solver::description::EngineOrder;

/// Height of a line of words at a peak.
const PEAK: f64 = TEXT - 4.0;
/// Distances from a peak at which its label may be placed.
const PEAK_DISTANCES: [f64; 5] = [12.0, 26.0, 44.0, 70.0, 100.0];
/// Distance beyond which a line leads from the label to its peak.
const LED: f64 = 30.0;
/// Paint of frequencies at which the resonance was not computed.
const UNKNOWN: Paint = Paint::Pale(NOTHING, 0.6);
/// Unit of angles.
const DEGREES: &str = "°";

/// Draws curves against frequency (the paper's Figures 3 and 4).
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_curves(
    path: &Path,
    heading: PictureHeading<'_>,
    scale: Scale,
    curves: &Curves,
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| {
        let range = range(curves, scale);
        let axes = [frequencies(curves), values(curves, scale).spanning(range)];
        let chart = Chart::new(canvas, heading, &legend(curves, range[1]), axes);
        draw(chart, curves, range);
    })
}

impl Curve {
    fn colour(&self) -> Colour {
        self.kind.colour()
    }

    fn stroke(&self) -> Stroke {
        Stroke {
            colour: self.colour(),
            width: match self.kind {
                CurveKind::Tractions => 1.0,
                CurveKind::Linear => 2.0,
                _ => 3.0,
            },
            dashed: self.dashed,
        }
    }

    /// Peak that an axis up to `highest` shows.
    fn peak_below(&self, highest: f64) -> Option<PeakMark> {
        self.peak.filter(|peak| peak.amplitude <= highest)
    }
}

/// Axis of the frequencies of all points, or of their speeds in a run-up.
fn frequencies(curves: &Curves) -> super::axis::DrawnAxis {
    let points = curves.curves.iter().flat_map(|c| &c.points);
    let [low, high] = ends(points.map(|p| curves.place(p.frequency_hz)));
    let ends = match (low < high, low <= high) {
        (true, _) => [low, high],
        (false, true) => [low - 1.0, low + 1.0],
        (false, false) => [0.0, 1.0],
    };
    let title = match curves.along {
        Some(EngineOrder(order)) => {
            format!("speed (rpm); the frequency in Hz is {order}/60 of it (engine order {order})")
        }
        None => "frequency (Hz)".to_owned(),
    };
    Axis::linear(&title).spanning(ends)
}

fn values(curves: &Curves, scale: Scale) -> Axis {
    // Eighths of a turn.
    let angles = (-4..=4).map(|i| (45.0 * f64::from(i), (45 * i).to_string().replace('-', "−")));
    Axis {
        title: curves.quantity.clone(),
        unit: curves.unit,
        scale,
        marks: if curves.unit == DEGREES {
            angles.collect()
        } else {
            Vec::new()
        },
    }
}

/// Range of the values that the axis shows.
fn range(curves: &Curves, scale: Scale) -> [f64; 2] {
    let [least, largest] = ends(curves.values());
    let highest = if curves.highest > 0.0 {
        curves.highest
    } else {
        1.0
    };
    match scale {
        Scale::Logarithmic => {
            let [least, _] = ends(curves.values().filter(|v| *v > 0.0));
            let least = if least.is_finite() { 0.8 * least } else { 0.1 };
            [least, 1.5 * largest.max(2.0 * least)]
        }
        Scale::Linear if curves.unit == DEGREES => {
            let [low, high] = if least <= largest {
                [least, largest]
            } else {
                [0.0; 2]
            };
            let low = (low / 45.0).floor() * 45.0;
            [low, ((high / 45.0).ceil() * 45.0).max(low + 45.0)]
        }
        Scale::Linear => [0.0, 1.12 * highest],
    }
}

/// Legend of the curves on an axis that shows values up to `highest`.
fn legend(curves: &Curves, highest: f64) -> Legend {
    let points = |count| counted(count, "point", "points");
    let mut legend = Legend::default();
    if curves.curves.iter().any(has_errors) {
        let colour = CurveKind::Response.colour();
        legend.add(Mark::Band(band(colour)), "estimated error");
    }
    if let Some(ends) = curves.not_computed_hz {
        let [from, to] = ends.map(|hz| figure(hz, 6));
        let words = format!("resonance not computed, {from} to {to} Hz");
        legend.add(Mark::Band(UNKNOWN), words);
    }
    for curve in &curves.curves {
        let label = &curve.label;
        let off_scale = curve.peak.filter(|_| curve.peak_below(highest).is_none());
        let off_scale = off_scale.map(|peak| peak.words(curves.highest));
        let words = off_scale.map(|words| format!("{label}: peak off the scale, {words}"));
        legend.add(
            Mark::Line(curve.stroke()),
            words.unwrap_or_else(|| label.clone()),
        );
        let inaccurate = curve.points.iter().filter(|p| p.is_inaccurate()).count();
        if inaccurate > 0 {
            let words = format!("{label}: accuracy not reached at {}", points(inaccurate));
            legend.add(Mark::Ring(curve.colour()), words);
        }
        let unconverged_points = Point::unconverged_points(&curve.points).count();
        if unconverged_points > 0 {
            let words = format!("{label}: {} did not converge", points(unconverged_points));
            legend.add(Mark::Cross(curve.colour()), words);
        }
    }
    legend
}

/// Draws the curves, rings where the requested accuracy was not reached, crosses on the axis where
/// nothing converged, and the peaks.
fn draw(mut chart: Chart, curves: &Curves, range: [f64; 2]) {
    let [bottom, top] = range;
    if let Some(ends) = curves.not_computed_hz {
        let [from, to] = ends.map(|hz| curves.place(hz));
        let corners = [(from, bottom), (from, top), (to, top), (to, bottom)];
        let corners: Option<Vec<Place>> = corners.map(|at| chart.at(at)).into_iter().collect();
        if let Some(corners) = corners {
            chart.canvas.polygon(&corners, UNKNOWN);
        }
    }
    fill_range(&chart, curves, range);
    for curve in curves.curves.iter().filter(|curve| has_errors(curve)) {
        fill_errors(&chart, curves, curve, range);
    }
    for curve in &curves.curves {
        for stretch in stretches(&curve.points, range) {
            let places = stretch.into_iter();
            let places = places.map(|(hz, value)| (curves.place(hz), value));
            let places: Vec<_> = places.filter_map(|p| chart.at(p)).collect();
            chart.line(&places, curve.stroke());
            chart.taken.add_line(&places);
        }
        for point in &curve.points {
            let height = point.value.filter(|v| (bottom..=top).contains(v));
            let ring = height.filter(|_| point.is_inaccurate());
            if let Some(at) = ring.and_then(|v| chart.at((curves.place(point.frequency_hz), v))) {
                chart.ring(at, curve.colour());
            }
        }
    }
    for (curve, point) in curves
        .curves
        .iter()
        .flat_map(|c| Point::unconverged_points(&c.points).map(move |p| (c, p)))
    {
        if let Some(at) = chart.at((curves.place(point.frequency_hz), bottom)) {
            chart.canvas.cross(at, curve.colour());
        }
    }
    let marked = |chart: &Chart, curve: &Curve| {
        let peak = curve.peak_below(top)?;
        let at = chart.at((curves.place(peak.frequency_hz), peak.amplitude))?;
        Some((at, peak.words(curves.highest), curve.colour()))
    };
    let curves = curves.curves.iter();
    let peaks: Vec<_> = curves.filter_map(|curve| marked(&chart, curve)).collect();
    for ((x, y), _, colour) in &peaks {
        // Its tip is above the line, which it would hide.
        let [half, low, high] = [8.0, y - 5.0, y - 19.0];
        let corners = [(*x, low), (x - half, high), (x + half, high)];
        chart.canvas.polygon(&corners, Paint::Filled(*colour));
        chart.taken.add_box([x - half, x + half, high, low]);
    }
    // The result, which is drawn last, has its words nearest.
    for (at, words, colour) in peaks.into_iter().rev() {
        draw_words(&mut chart, at, &words, colour);
    }
}

/// Estimated error, relative, below which no band is seen.
const SEEN: f64 = 5e-3;

fn has_errors(curve: &Curve) -> bool {
    let mut errors = curve.points.iter().filter_map(|point| point.error);
    curve.kind == CurveKind::Response && errors.any(|error| error > SEEN)
}

/// Fills the estimated error of a curve on both sides of it.
fn fill_errors(chart: &Chart, curves: &Curves, curve: &Curve, [bottom, top]: [f64; 2]) {
    let ends = |point: &Point| {
        let (value, error) = (point.value?, point.error?);
        let ends = [(1.0 - error).max(0.0) * value, (1.0 + error) * value];
        let [low, high] = ends.map(|v| (curves.place(point.frequency_hz), v.clamp(bottom, top)));
        Some([chart.at(low)?, chart.at(high)?])
    };
    for two in curve.points.windows(2) {
        if let (Some(a), Some(b)) = (ends(&two[0]), ends(&two[1])) {
            let corners = [a[0], a[1], b[1], b[0]];
            chart.canvas.polygon(&corners, band(curve.colour()));
        }
    }
}

/// Fills what lies between the ends of the range over starting tractions.
fn fill_range(chart: &Chart, curves: &Curves, [bottom, top]: [f64; 2]) {
    let ends = curves.curves.iter();
    let ends: Vec<&Curve> = ends.filter(|c| c.kind == CurveKind::Tractions).collect();
    let [least, most] = ends[..] else {
        return;
    };
    let pale = band(least.colour());
    let at = |point: &Point| {
        let value = point.value?.clamp(bottom, top);
        chart.at((curves.place(point.frequency_hz), value))
    };
    for (low, high) in least.points.windows(2).zip(most.points.windows(2)) {
        let corners = [at(&low[0]), at(&low[1]), at(&high[1]), at(&high[0])];
        let corners: Option<Vec<Place>> = corners.into_iter().collect();
        if let Some(corners) = corners {
            chart.canvas.polygon(&corners, pale);
        }
    }
}

/// Draws the words of a peak in a place where they cover nothing.
fn draw_words(chart: &mut Chart, (x, y): Place, words: &str, colour: Colour) {
    let size = (width_of(words, PEAK), PEAK + 4.0);
    let free = chart.beside((x, y), size, &PEAK_DISTANCES);
    let [left, right, top, bottom] = match free {
        Some(bounds) => bounds,
        None => over_everything(chart, (x, y), size),
    };
    // At the end that is nearer to the mark: its letters may be narrower.
    let (across, place) = match (left >= x, right <= x) {
        (true, _) => (LEFT, left),
        (_, true) => (RIGHT, right),
        _ => (MIDDLE, (left + right) / 2.0),
    };
    let middle = (top + bottom) / 2.0;
    if (place - x).abs() > LED {
        let gap = 4.0 * (x - place).signum();
        let line = [(place + gap, middle), (x, y - 19.0)];
        chart.canvas.line(&line, Stroke::plain(colour, 1.0));
    }
    chart.text(words, (place, middle), PEAK, across);
}

/// Clears a place for a label of this width and height above a peak that has no free place beside
/// it, between the sides of the chart. Returns left, right, top and bottom of the label.
fn over_everything(chart: &Chart, (x, y): Place, (width, height): Place) -> [f64; 4] {
    let (across, half) = (&chart.inside[0], width / 2.0);
    let middle = x.min(across.end - half).max(across.start + half);
    let bottom = y - 24.0;
    let [left, right, top] = [middle - half, middle + half, bottom - height];
    let bounds = [left, right, top, bottom];
    chart.canvas.rectangle(bounds, Paint::Pale(WHITE, 0.8));
    bounds
}

/// Stretches of neighbouring points that have a value within the axis. A line that leaves the axis
/// at its top ends there.
fn stretches(points: &[Point], [bottom, top]: [f64; 2]) -> Vec<Vec<(f64, f64)>> {
    let shown = |p: &Point| Some((p.frequency_hz, p.value.filter(|v| *v >= bottom)?));
    let leaves_at = |a: (f64, f64), b: (f64, f64)| {
        let share = (top - a.1) / (b.1 - a.1);
        (a.0 + share * (b.0 - a.0), top)
    };
    let mut all = vec![Vec::new()];
    let mut before: Option<(f64, f64)> = None;
    for point in points.iter().map(shown) {
        let crossing = match (before, point) {
            (Some(a), Some(b)) if (a.1 > top) != (b.1 > top) => Some(leaves_at(a, b)),
            _ => None,
        };
        let inside = point.filter(|p| p.1 <= top);
        if let Some(stretch) = all.last_mut() {
            stretch.extend(crossing);
            stretch.extend(inside);
        }
        if inside.is_none() {
            all.push(Vec::new());
        }
        before = point;
    }
    all.retain(|stretch| !stretch.is_empty());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(values: &[Option<f64>]) -> Vec<Point> {
        let at = |(value, i): (&Option<f64>, u32)| Point {
            frequency_hz: f64::from(i),
            value: *value,
            error: None,
            is_accurate: true,
            is_stable: true,
        };
        values.iter().zip(1..).map(at).collect()
    }

    #[test]
    fn a_point_that_did_not_converge_breaks_the_line() {
        let points = points(&[Some(1.0), None, Some(3.0), Some(4.0), None]);
        let found = stretches(&points, [0.0, f64::INFINITY]);
        assert_eq!(found, [vec![(1.0, 1.0)], vec![(3.0, 3.0), (4.0, 4.0)]]);
    }

    #[test]
    fn a_line_ends_where_it_leaves_the_axis_and_comes_back_where_it_returns() {
        let points = points(&[1.0, 3.0, 5.0, 1.0, 0.0].map(Some));
        let before = vec![(1.0, 1.0), (1.5, 2.0)];
        let after = vec![(3.75, 2.0), (4.0, 1.0), (5.0, 0.0)];
        assert_eq!(stretches(&points, [0.0, 2.0]), [before, after]);
        assert!(stretches(&points[1..3], [0.0, 2.0]).is_empty());
    }

    #[test]
    fn the_legend_has_lines_rings_and_crosses() {
        let mut own = points(&[Some(1.0), None]);
        own[0].is_accurate = false;
        own[0].error = Some(0.1);
        let curve = |label: &str, kind, points, peak| Curve {
            label: label.to_owned(),
            kind,
            dashed: kind == CurveKind::Linear,
            points,
            peak,
        };
        let peak = PeakMark {
            frequency_hz: 1.5,
            amplitude: 20.0,
            unit: "m",
            digits: 3,
            along: None,
        };
        let curves = Curves {
            quantity: String::new(),
            unit: "m",
            curves: vec![
                curve("linear", CurveKind::Linear, vec![], Some(peak)),
                curve("H = 3", CurveKind::Response, own, None),
            ],
            not_computed_hz: Some([10.0, 20.0]),
            along: None,
            highest: 1.0,
        };
        let legend = format!("{:?}", legend(&curves, 1.12));
        for words in [
            "estimated error",
            "resonance not computed, 10.0000 to 20.0000 Hz",
            "linear: peak off the scale, 20.0 m at 1.50000 Hz",
            "H = 3: accuracy not reached at 1 point",
            "H = 3: 1 point did not converge",
        ] {
            assert!(legend.contains(words), "{words}: {legend}");
        }
        assert!(
            legend.find("dashed: true") < legend.find("dashed: false"),
            "{legend}"
        );
    }

    #[test]
    fn one_frequency_or_none_still_makes_an_axis() {
        let axis = |points| {
            let curve = Curve {
                label: String::new(),
                kind: CurveKind::Response,
                dashed: false,
                points,
                peak: None,
            };
            let axis = frequencies(&Curves {
                quantity: String::new(),
                unit: "m",
                curves: vec![curve],
                not_computed_hz: None,
                along: None,
                highest: 0.0,
            });
            (axis.low, axis.high)
        };
        assert_eq!(axis(points(&[None])), (0.0, 2.0));
        assert_eq!(axis(vec![]), (0.0, 1.0));
    }
}
