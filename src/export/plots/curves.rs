//! Draws amplitude and phase against frequency.

use std::ops::Range;
use std::path::Path;

use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::colour::{COMPARED, LINEAR};
use super::legend::{Legend, Mark};
use super::names::Taken;
use super::{
    Canvas, Drawn, HEADING_HEIGHT, Heading, INK, Scale, TEXT_PX, at_px, draw_heading, draw_mesh,
    px, round_ticks, si_prefix, text_style, tick_label, write_svg,
};
use crate::export::ExportError;
use crate::words::{figure, quantity_beside, supported_digits};
use dovetail_solver::dlft::{Outcome, Response};
use dovetail_solver::results::quantities::{self, linear_peak, peak, phasors};

const SIZE: (u32, u32) = (1280, 800);
/// Height of the letters at a peak, pixels.
const PEAK_PX: u32 = TEXT_PX - 4;
/// Largest width of a letter at a peak, units.
const PEAK_LETTER: i32 = at_px(13);
/// Distances from a peak at which its label may be placed, pixels.
const PEAK_DISTANCES: [i32; 5] = [12, 26, 44, 70, 100];
/// Distance beyond which a line leads from the label to its peak.
const LED: i32 = at_px(30);
/// Ratio of the linear peak to the highest amplitude with friction above which the axis is scaled
/// to the latter.
const MUCH_HIGHER: f64 = 5.0;

/// Curve of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    pub label: String,
    /// Frequency, Hz, and amplitude, m, or phase, degrees, of each point. The value is `None` if
    /// the point did not converge: the line breaks there and a cross marks the frequency on the
    /// axis.
    pub points: Vec<(f64, Option<f64>)>,
    /// Points whose requested accuracy was not reached; a ring marks each.
    pub inaccurate: Vec<(f64, f64)>,
    /// Highest point of a curve of amplitudes; `None` for a phase.
    pub peak: Option<PeakMark>,
    pub kind: CurveKind,
}

/// Highest point of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakMark {
    pub frequency_hz: f64,
    pub amplitude_m: f64,
    /// Number of digits of the amplitude that its estimated error supports.
    pub digits: usize,
}

impl PeakMark {
    /// Mark of a peak with the estimated relative error of its amplitude, if known. `None` if
    /// nothing moves.
    fn of(peak: &quantities::Peak, error: Option<f64>) -> Option<Self> {
        (peak.amplitude_m > 0.0).then(|| Self {
            frequency_hz: peak.frequency_hz,
            amplitude_m: peak.amplitude_m,
            digits: supported_digits(peak.amplitude_m, error),
        })
    }

    /// Label of the peak, such as `6.5 mm at 450.085 Hz`, in the unit of an axis up to this
    /// amplitude.
    fn words(&self, largest_m: f64) -> String {
        format!(
            "{} at {} Hz",
            quantity_beside(self.amplitude_m, largest_m, "m", self.digits),
            figure(self.frequency_hz, 6)
        )
    }
}

/// Kind of a curve, which determines its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveKind {
    /// Linear reference: grey and dashed.
    Linear,
    /// Response with another number of harmonics.
    Compared,
    /// Response with slip and separation.
    Response,
}

impl CurveKind {
    fn colour(self) -> RGBColor {
        match self {
            Self::Linear => LINEAR,
            Self::Compared => COMPARED,
            Self::Response => INK,
        }
    }

    fn style(self) -> ShapeStyle {
        let width = if self == Self::Linear { 2 } else { 3 };
        self.colour().stroke_width(px(width))
    }
}

impl Curve {
    /// The same curve, drawn for comparison beside the result.
    #[must_use]
    pub fn to_compare(self) -> Self {
        let kind = CurveKind::Compared;
        Self { kind, ..self }
    }
}

/// Amplitude of an observation where the response converged.
pub fn response_curve(label: &str, response: &Response, observation: usize) -> Curve {
    let point = |o: &dovetail_solver::dlft::Orbit| {
        let amplitude = o.observed_amplitude_m.get(observation).copied();
        (
            o.frequency_hz,
            amplitude.filter(|a| o.outcome.has_motion() && a.is_finite()),
        )
    };
    let inaccurate = |o: &&dovetail_solver::dlft::Orbit| o.outcome == Outcome::AccuracyNotReached;
    let orbits = response.orbits.iter();
    Curve {
        label: label.to_owned(),
        points: orbits.clone().map(point).collect(),
        inaccurate: orbits
            .filter(inaccurate)
            .map(point)
            .filter_map(|(f, a)| Some((f, a?)))
            .collect(),
        peak: peak(response, observation).and_then(|peak| {
            let error = response.orbits[peak.index].amplitude_error(observation);
            PeakMark::of(&peak, error)
        }),
        kind: CurveKind::Response,
    }
}

/// Amplitude of an observation in the linear reference.
pub fn linear_curve(label: &str, response: &Response, observation: usize) -> Curve {
    let point = |s: &dovetail_solver::dlft::LinearPoint| {
        (
            s.frequency_hz,
            s.observed_amplitude_m
                .get(observation)
                .copied()
                .filter(|a| a.is_finite()),
        )
    };
    let points = response.linear_curve.iter().map(point).collect();
    Curve {
        label: label.to_owned(),
        points,
        inaccurate: vec![],
        peak: linear_peak(response, observation).and_then(|peak| PeakMark::of(&peak, Some(0.0))),
        kind: CurveKind::Linear,
    }
}

/// Lag of the first harmonic of an observation behind the force, degrees, where the response
/// converged.
pub fn phase_curve(label: &str, response: &Response, observation: usize) -> Curve {
    let point = |o: &dovetail_solver::dlft::Orbit| {
        let phasors = phasors(o.observed.get(observation)?);
        Some(phasors.first()?.phase_rad.to_degrees())
    };
    let orbits = response.orbits.iter();
    Curve {
        label: label.to_owned(),
        points: orbits
            .map(|o| {
                (
                    o.frequency_hz,
                    point(o).filter(|p| o.outcome.has_motion() && p.is_finite()),
                )
            })
            .collect(),
        inaccurate: vec![],
        peak: None,
        kind: CurveKind::Response,
    }
}

/// Quantity on the vertical axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ordinate<'a> {
    /// Amplitude of the displacement of this name, in metres: the unit on the axis is chosen by the
    /// largest value.
    Amplitude(&'a str, Scale),
    /// Phase of the displacement of this name, degrees.
    Phase(&'a str),
}

impl Ordinate<'_> {
    /// Title of the axis, such as `Amplitude of tip`.
    pub fn title(&self) -> String {
        match self {
            Self::Amplitude(name, _) => format!("Amplitude of {name}"),
            Self::Phase(name) => format!("Phase of {name}"),
        }
    }
}

/// Draws curves against frequency (the paper's Figures 3 and 4).
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_curves(
    path: &Path,
    heading: Heading<'_>,
    ordinate: Ordinate<'_>,
    curves: &[Curve],
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| draw(canvas, heading, ordinate, curves))
}

fn draw(canvas: &Canvas, heading: Heading<'_>, ordinate: Ordinate<'_>, curves: &[Curve]) -> Drawn {
    let (low, high) = bounds(curves.iter().flat_map(|c| c.points.iter().map(|p| p.0)));
    let values = || {
        curves
            .iter()
            .flat_map(|c| c.points.iter().filter_map(|p| p.1))
    };
    let largest = values().fold(0.0, f64::max);
    let (_, x_step) = round_ticks(low, high, 10);
    let x_text = move |v: &f64| tick_label(*v, x_step);
    draw_heading(canvas, heading)?;
    let highest_m = match ordinate {
        Ordinate::Amplitude(_, Scale::Linear) => highest_shown(curves),
        _ => largest,
    };
    let legend = legend(curves, highest_m);
    legend.draw(canvas, HEADING_HEIGHT)?;
    let width = canvas.dim_in_pixel().0 as i32;
    let mut builder = ChartBuilder::on(canvas);
    builder
        .margin(px(18))
        .margin_top(HEADING_HEIGHT + legend.height(width) + at_px(8))
        .margin_right(px(36))
        .x_label_area_size(px(74))
        .y_label_area_size(px(104));
    match ordinate {
        Ordinate::Amplitude(name, Scale::Linear) => {
            let (prefix, factor) = si_prefix(highest_m);
            let top = if highest_m > 0.0 {
                1.12 * highest_m * factor
            } else {
                1.12
            };
            let window = Window {
                factor,
                bottom: 0.0,
                top,
            };
            let (_, y_step) = round_ticks(0.0, top, 8);
            let mut chart = builder.build_cartesian_2d(low..high, 0.0..top)?;
            let title = format!("amplitude of {name} ({prefix}m)");
            frame(&mut chart, &title, &x_text, &|v: &f64| {
                tick_label(*v, y_step)
            })?;
            lines(&mut chart, curves, window)?;
            peaks(canvas, &chart, curves, window, highest_m)
        }
        Ordinate::Amplitude(name, Scale::Logarithmic) => {
            let (prefix, factor) = si_prefix(largest);
            let top = if largest > 0.0 { largest * factor } else { 1.0 };
            let smallest = values().filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
            let bottom = if smallest.is_finite() {
                0.8 * smallest * factor
            } else {
                0.1 * top
            };
            let mut chart =
                builder.build_cartesian_2d(low..high, (bottom..1.5 * top).log_scale())?;
            let title = format!("amplitude of {name} ({prefix}m)");
            frame(&mut chart, &title, &x_text, &|v: &f64| short(*v))?;
            let window = Window::above(factor, bottom);
            lines(&mut chart, curves, window)?;
            peaks(canvas, &chart, curves, window, highest_m)
        }
        Ordinate::Phase(name) => {
            // Whole eighths of a turn.
            let (least, most) = bounds(values());
            let (bottom, top) = ((least / 45.0).floor() * 45.0, (most / 45.0).ceil() * 45.0);
            let top = if top > bottom { top } else { bottom + 45.0 };
            let mut chart = builder.build_cartesian_2d(low..high, bottom..top)?;
            let title = format!("{name} behind the force (°)");
            frame(&mut chart, &title, &x_text, &|v: &f64| tick_label(*v, 1.0))?;
            lines(&mut chart, curves, Window::above(1.0, bottom))
        }
    }
}

/// Range of the values that an axis shows.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// Factor from the unit of the values to the unit of the axis.
    factor: f64,
    /// Lower end, in the unit of the axis.
    bottom: f64,
    /// Upper end, in the unit of the axis.
    top: f64,
}

impl Window {
    /// Window of all values above `bottom`.
    fn above(factor: f64, bottom: f64) -> Self {
        Self {
            factor,
            bottom,
            top: f64::INFINITY,
        }
    }
}

/// Largest amplitude that the axis must show: that of all curves, or that of the curves with
/// friction if these would otherwise be flat at the bottom of the axis.
fn highest_shown(curves: &[Curve]) -> f64 {
    let highest = |of: &dyn Fn(&Curve) -> bool| {
        let points = curves.iter().filter(|c| of(c)).flat_map(|c| &c.points);
        points.filter_map(|p| p.1).fold(0.0, f64::max)
    };
    let (all, own) = (
        highest(&|_| true),
        highest(&|c| c.kind != CurveKind::Linear),
    );
    if own > 0.0 && all > MUCH_HIGHER * own {
        own
    } else {
        all
    }
}

/// Legend of the curves on an axis that shows amplitudes up to `highest_m`.
fn legend(curves: &[Curve], highest_m: f64) -> Legend {
    let mut legend = Legend::default();
    for curve in curves {
        let style = curve.kind.style();
        let colour = curve.kind.colour();
        let line = match curve.kind {
            CurveKind::Linear => Mark::Dashes,
            CurveKind::Compared | CurveKind::Response => Mark::Line,
        };
        let mut label = curve.label.clone();
        if let Some(peak) = curve.peak.filter(|peak| peak.amplitude_m > highest_m) {
            label = format!("{label}: peak off the scale, {}", peak.words(highest_m));
        }
        legend.add(line(style), label);
        if !curve.inaccurate.is_empty() {
            let count = points(curve.inaccurate.len());
            let words = format!("{}: accuracy not reached at {count}", curve.label);
            legend.add(Mark::Ring(colour), words);
        }
        let lost = curve.points.iter().filter(|p| p.1.is_none()).count();
        if lost > 0 {
            let words = format!("{}: {} did not converge", curve.label, points(lost));
            legend.add(Mark::Cross(colour), words);
        }
    }
    legend
}

type Chart<'a, 'b, Y> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<plotters::coord::types::RangedCoordf64, Y>>;

fn frame<Y>(
    chart: &mut Chart<Y>,
    y_label: &str,
    x_text: &dyn Fn(&f64) -> String,
    y_text: &dyn Fn(&f64) -> String,
) -> Drawn
where
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    draw_mesh(
        chart
            .configure_mesh()
            .x_desc("frequency (Hz)")
            .y_desc(y_label)
            .x_labels(10)
            .y_labels(8)
            .light_line_style(TRANSPARENT)
            .x_label_formatter(x_text)
            .y_label_formatter(y_text),
    )
}

fn lines<'a, 'b: 'a, Y>(chart: &mut Chart<'a, 'b, Y>, curves: &[Curve], window: Window) -> Drawn
where
    Y: Ranged<ValueType = f64>,
{
    for curve in curves {
        let colour = curve.kind.colour();
        stretches(chart, curve, window)?;
        rings(chart, curve, colour, window)?;
        crosses(chart, curve, colour, window.bottom)?;
    }
    Ok(())
}

/// Draws the converged stretches of a curve; a point without neighbours is a dot.
fn stretches<'a, 'b: 'a, Y>(chart: &mut Chart<'a, 'b, Y>, curve: &Curve, window: Window) -> Drawn
where
    Y: Ranged<ValueType = f64>,
{
    let style = curve.kind.style();
    for run in converged_runs(&curve.points, window) {
        if run.len() == 1 {
            chart.draw_series([Circle::new(run[0], px(4), style.color.filled())])?;
            continue;
        }
        if curve.kind == CurveKind::Linear {
            chart.draw_series(DashedLineSeries::new(run, px(9), px(6), style))?;
        } else {
            chart.draw_series(LineSeries::new(run, style))?;
        }
    }
    Ok(())
}

/// Draws rings where the requested accuracy was not reached.
fn rings<'a, 'b: 'a, Y>(
    chart: &mut Chart<'a, 'b, Y>,
    curve: &Curve,
    colour: RGBColor,
    window: Window,
) -> Drawn
where
    Y: Ranged<ValueType = f64>,
{
    let rings = curve.inaccurate.iter();
    let rings = rings.map(|(f, a)| (*f, a * window.factor));
    let rings = rings.filter(|ring| (window.bottom..=window.top).contains(&ring.1));
    // Hollow: the line does not run through it.
    let [inside, mark] = [WHITE.filled(), colour.stroke_width(px(2))];
    let circle = |style| Circle::new((0, 0), px(6), style);
    chart.draw_series(rings.map(|at| EmptyElement::at(at) + circle(inside) + circle(mark)))?;
    Ok(())
}

/// Draws crosses on the axis at frequencies that did not converge.
fn crosses<'a, 'b: 'a, Y>(
    chart: &mut Chart<'a, 'b, Y>,
    curve: &Curve,
    colour: RGBColor,
    bottom: f64,
) -> Drawn
where
    Y: Ranged<ValueType = f64>,
{
    let lost = curve.points.iter().filter(|p| p.1.is_none());
    let mark = colour.stroke_width(px(3));
    chart.draw_series(lost.map(|p| Cross::new((p.0, bottom), px(7), mark)))?;
    Ok(())
}

/// Draws a mark on the peak of each curve that the axis shows, up to `highest_m`, and its label in
/// a place where it covers nothing.
fn peaks<Y>(
    canvas: &Canvas,
    chart: &Chart<Y>,
    curves: &[Curve],
    window: Window,
    highest_m: f64,
) -> Drawn
where
    Y: Ranged<ValueType = f64>,
{
    let mut taken = Taken::default();
    for curve in curves {
        for run in converged_runs(&curve.points, window) {
            let run: Vec<(i32, i32)> = run.iter().map(|p| chart.backend_coord(p)).collect();
            taken.add_line(&run, true);
        }
    }
    let marks = || {
        let marks = curves
            .iter()
            .filter_map(|curve| Some((curve.kind, curve.peak?)));
        marks.filter(|(_, peak)| peak.amplitude_m <= highest_m)
    };
    let at = |peak: &PeakMark| {
        chart.backend_coord(&(peak.frequency_hz, peak.amplitude_m * window.factor))
    };
    for (kind, peak) in marks() {
        // Its tip is above the line, which it would hide.
        let (x, y) = at(&peak);
        let [half, low, high] = [at_px(8), y - at_px(5), y - at_px(19)];
        let corners = vec![(x, low), (x - half, high), (x + half, high)];
        canvas.draw(&Polygon::new(corners, kind.colour().filled()))?;
        taken.add_box([x - half, x + half, high, low]);
    }
    let frame = chart.plotting_area().get_pixel_range();
    // The result, which is drawn last, has its words nearest.
    for (kind, peak) in marks().rev() {
        let (x, y) = at(&peak);
        let words = peak.words(highest_m);
        let width = PEAK_LETTER * words.chars().count() as i32;
        let height = at_px(PEAK_PX as i32 + 4);
        let [left, right, top, bottom] = taken
            .beside(
                (x, y),
                (width, height),
                [&frame.0, &frame.1],
                &PEAK_DISTANCES,
            )
            .map_or_else(
                || over_everything(canvas, (x, y), (width, height), &frame.0),
                Ok,
            )?;
        // At the end that is nearer to the mark: its letters may be narrower.
        let (h, place) = match (left >= x, right <= x) {
            (true, _) => (HPos::Left, left),
            (_, true) => (HPos::Right, right),
            _ => (HPos::Center, (left + right) / 2),
        };
        let middle = (top + bottom) / 2;
        if (place - x).abs() > LED {
            let gap = at_px(4) * (x - place).signum();
            let line = vec![(place + gap, middle), (x, y - at_px(19))];
            let style = kind.colour().stroke_width(px(1));
            canvas.draw(&PathElement::new(line, style))?;
        }
        let style = text_style(PEAK_PX, h, VPos::Center);
        canvas.draw(&Text::new(words, (place, middle), &style))?;
    }
    Ok(())
}

/// Clears a place for a label of this width and height above a peak that has no free place beside
/// it, between the two sides of `across`. Returns left, right, top and bottom of the label.
fn over_everything(
    canvas: &Canvas,
    (x, y): (i32, i32),
    (width, height): (i32, i32),
    across: &Range<i32>,
) -> Result<[i32; 4], Box<dyn std::error::Error>> {
    let half = width / 2;
    let middle = x.min(across.end - half).max(across.start + half);
    let bottom = y - at_px(24);
    let [left, right, top] = [middle - half, middle + half, bottom - height];
    let pale = WHITE.mix(0.8).filled();
    canvas.draw(&Rectangle::new([(left, top), (right, bottom)], pale))?;
    Ok([left, right, top, bottom])
}

/// Stretches of neighbouring points that have a value (and are within the axis), scaled. A line
/// that leaves the axis at its top ends there.
fn converged_runs(points: &[(f64, Option<f64>)], window: Window) -> Vec<Vec<(f64, f64)>> {
    let Window {
        factor,
        bottom,
        top,
    } = window;
    let shown = |p: &(f64, Option<f64>)| Some((p.0, p.1? * factor)).filter(|q| q.1 >= bottom);
    let leaves_at = |a: (f64, f64), b: (f64, f64)| {
        let share = (top - a.1) / (b.1 - a.1);
        (a.0 + share * (b.0 - a.0), top)
    };
    let mut runs = vec![Vec::new()];
    let mut before: Option<(f64, f64)> = None;
    for point in points.iter().map(shown) {
        let crossing = match (before, point) {
            (Some(a), Some(b)) if (a.1 > top) != (b.1 > top) => Some(leaves_at(a, b)),
            _ => None,
        };
        let inside = point.filter(|p| p.1 <= top);
        if let Some(run) = runs.last_mut() {
            run.extend(crossing);
            run.extend(inside);
        }
        if inside.is_none() {
            runs.push(Vec::new());
        }
        before = point;
    }
    runs.retain(|r| !r.is_empty());
    runs
}

fn bounds(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let finite = values.filter(|v| v.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(v), h.max(v))
    });
    match (low < high, low.is_finite()) {
        (true, _) => (low, high),
        (false, true) => (low - 1.0, low + 1.0),
        (false, false) => (0.0, 1.0),
    }
}

fn points(count: usize) -> String {
    if count == 1 {
        "1 point".to_owned()
    } else {
        format!("{count} points")
    }
}

/// Label of a logarithmic axis.
fn short(v: f64) -> String {
    if (0.01..10_000.0).contains(&v) {
        format!("{v}")
    } else {
        format!("{v:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_that_did_not_converge_breaks_the_line() {
        let points = [
            (1.0, Some(1.0)),
            (2.0, None),
            (3.0, Some(3.0)),
            (4.0, Some(4.0)),
            (5.0, None),
        ];
        let runs = converged_runs(&points, Window::above(10.0, 0.0));
        assert_eq!(runs, [vec![(1.0, 10.0)], vec![(3.0, 30.0), (4.0, 40.0)]]);
    }

    #[test]
    fn a_line_ends_where_it_leaves_the_axis_and_comes_back_where_it_returns() {
        let points = [(1.0, 1.0), (2.0, 3.0), (3.0, 5.0), (4.0, 1.0), (5.0, 0.0)];
        let points = points.map(|(f, a)| (f, Some(a)));
        let window = Window {
            top: 20.0,
            ..Window::above(10.0, 0.0)
        };
        let before = vec![(1.0, 10.0), (1.5, 20.0)];
        let after = vec![(3.75, 20.0), (4.0, 10.0), (5.0, 0.0)];
        assert_eq!(converged_runs(&points, window), [before, after]);
        assert!(converged_runs(&points[1..3], window).is_empty());
    }

    #[test]
    fn the_axis_is_that_of_friction_where_the_linear_peak_is_much_higher() {
        let curve = |kind, highest: f64| Curve {
            label: String::new(),
            points: vec![(1.0, Some(0.1)), (2.0, Some(highest)), (3.0, None)],
            inaccurate: vec![],
            peak: None,
            kind,
        };
        let of = |linear: f64, compared: f64, own: f64| {
            highest_shown(&[
                curve(CurveKind::Linear, linear),
                curve(CurveKind::Compared, compared),
                curve(CurveKind::Response, own),
            ])
        };
        assert_eq!(of(16.8, 7.0, 6.5), 16.8);
        assert_eq!(of(32.0, 1.3, 1.2), 1.3);
        assert_eq!(highest_shown(&[curve(CurveKind::Linear, 3.0)]), 3.0);
    }

    #[test]
    fn the_legend_has_lines_rings_and_crosses() {
        let curve = Curve {
            label: "H = 3".to_owned(),
            points: vec![(1.0, Some(1.0)), (2.0, None)],
            inaccurate: vec![(1.0, 1.0)],
            peak: None,
            kind: CurveKind::Response,
        };
        let reference = Curve {
            label: "linear".to_owned(),
            points: vec![(1.0, Some(20.0))],
            inaccurate: vec![],
            peak: Some(PeakMark {
                frequency_hz: 1.5,
                amplitude_m: 20.0,
                digits: 3,
            }),
            kind: CurveKind::Linear,
        };
        let legend = format!("{:?}", legend(&[reference, curve], 1.0));
        for words in [
            "linear: peak off the scale, 20.0 m at 1.50000 Hz",
            "H = 3: accuracy not reached at 1 point",
            "H = 3: 1 point did not converge",
        ] {
            assert!(legend.contains(words), "{words}: {legend}");
        }
        assert!(legend.find("Dashes") < legend.find("Line"), "{legend}");
    }

    #[test]
    fn words_at_a_peak_are_in_the_unit_of_the_axis_and_of_the_digits_that_its_error_supports() {
        let peak = |amplitude_m: f64, error: Option<f64>| {
            let at = quantities::Peak {
                index: 0,
                frequency_hz: 287.6921,
                amplitude_m,
            };
            PeakMark::of(&at, error)
        };
        let words = |amplitude_m, error| peak(amplitude_m, error).unwrap().words(3.2e-3);
        assert_eq!(words(1.2947e-4, Some(0.2)), "0.13 mm at 287.692 Hz");
        assert_eq!(words(3.2361e-3, Some(0.0)), "3.236 mm at 287.692 Hz");
        assert_eq!(peak(0.0, None), None);
    }

    #[test]
    fn bounds_of_one_or_no_frequency_still_make_an_axis() {
        assert_eq!(bounds([5.0].into_iter()), (4.0, 6.0));
        assert_eq!(bounds([].into_iter()), (0.0, 1.0));
    }
}
