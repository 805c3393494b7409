//! Draws amplitude against frequency.

use std::path::Path;

use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;

use super::colour::of_curve;
use super::{
    Canvas, DASHED, Drawn, INK, Scale, TEXT_PX, THROUGH, TITLE_HEIGHT, at_px, draw_legend,
    draw_mesh, draw_title, list_line, px, round_ticks, si_prefix, tick_label, write_svg,
};
use crate::export::ExportError;
use dovetail_solver::dlft::{Outcome, Response};

const SIZE: (u32, u32) = (1280, 800);
/// Of the width of the axes.
const LEGEND_WIDTH: f64 = 0.45;

/// One line of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    pub label: String,
    /// Frequency, Hz, and amplitude, m; `None` where the point did not converge: the line breaks
    /// there and a cross marks the frequency on the axis.
    pub points: Vec<(f64, Option<f64>)>,
    /// Those of the points whose accuracy was asked for and not reached: a ring marks them.
    pub inaccurate: Vec<(f64, f64)>,
    /// Drawn grey and dashed, for comparison.
    pub reference: bool,
}

/// Amplitude of an observation where the response converged.
pub fn response_curve(label: &str, response: &Response, observation: usize) -> Curve {
    let point = |o: &dovetail_solver::dlft::Orbit| {
        let amplitude = o.observed_amplitude_m.get(observation).copied();
        (
            o.frequency_hz,
            amplitude.filter(|a| o.outcome.is_converged() && a.is_finite()),
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
        reference: false,
    }
}

/// Amplitude of an observation of the linear reference.
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
        reference: true,
    }
}

/// Draws the curves (the paper's Figures 3 and 4). `quantity` names the vertical axis, as in
/// "tip amplitude"; its unit is chosen by the largest value.
pub fn write_response_plot(
    path: &Path,
    title: &str,
    quantity: &str,
    curves: &[Curve],
    scale: Scale,
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| {
        draw(canvas, title, quantity, curves, scale)
    })
}

fn draw(canvas: &Canvas, title: &str, quantity: &str, curves: &[Curve], scale: Scale) -> Drawn {
    let (low, high) = bounds(curves.iter().flat_map(|c| c.points.iter().map(|p| p.0)));
    let values = || {
        curves
            .iter()
            .flat_map(|c| c.points.iter().filter_map(|p| p.1))
    };
    let largest = values().fold(0.0, f64::max);
    let (prefix, factor) = si_prefix(largest);
    let y_label = format!("{quantity} ({prefix}m)");
    let top = if largest > 0.0 { largest * factor } else { 1.0 };
    let (_, x_step) = round_ticks(low, high, 10);
    let (_, y_step) = round_ticks(0.0, 1.06 * top, 8);
    let x_text = move |v: &f64| tick_label(*v, x_step);
    let y_text = move |v: &f64| tick_label(*v, y_step);
    draw_title(canvas, title)?;
    let mut builder = ChartBuilder::on(canvas);
    builder
        .margin(px(18))
        .margin_top(TITLE_HEIGHT)
        .margin_right(px(36))
        .x_label_area_size(px(74))
        .y_label_area_size(px(104));
    match scale {
        Scale::Linear => {
            let mut chart = builder.build_cartesian_2d(low..high, 0.0..1.06 * top)?;
            frame(&mut chart, &y_label, &x_text, &y_text)?;
            lines(&mut chart, curves, factor, 0.0)
        }
        Scale::Logarithmic => {
            let smallest = values().filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
            let bottom = if smallest.is_finite() {
                0.8 * smallest * factor
            } else {
                0.1 * top
            };
            let mut chart =
                builder.build_cartesian_2d(low..high, (bottom..1.25 * top).log_scale())?;
            frame(&mut chart, &y_label, &x_text, &|v: &f64| short(*v))?;
            lines(&mut chart, curves, factor, bottom)
        }
    }
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

fn lines<'a, 'b: 'a, Y>(
    chart: &mut Chart<'a, 'b, Y>,
    curves: &[Curve],
    factor: f64,
    bottom: f64,
) -> Drawn
where
    Y: Ranged<ValueType = f64>,
{
    let mut colours = (0..).map(of_curve);
    for curve in curves {
        let colour = if curve.reference {
            RGBColor(90, 90, 90)
        } else {
            next(&mut colours)
        };
        stretches(chart, curve, colour, factor, bottom)?;
        rings(chart, curve, colour, factor, bottom)?;
        crosses(chart, curve, colour, bottom)?;
    }
    draw_legend(chart, clear_corner(curves), TEXT_PX - 2)
}

/// The converged stretches of a curve; a point without neighbours is a dot.
fn stretches<'a, 'b: 'a, Y>(
    chart: &mut Chart<'a, 'b, Y>,
    curve: &Curve,
    colour: RGBColor,
    factor: f64,
    bottom: f64,
) -> Drawn
where
    Y: Ranged<ValueType = f64>,
{
    let style = colour.stroke_width(px(if curve.reference { 2 } else { 3 }));
    let mut legend = Some(curve.label.clone());
    for run in converged_runs(&curve.points, factor, bottom) {
        if run.len() == 1 {
            chart.draw_series([Circle::new(run[0], px(4), colour.filled())])?;
            continue;
        }
        let drawn = if curve.reference {
            chart.draw_series(DashedLineSeries::new(run, px(9), px(6), style))?
        } else {
            chart.draw_series(LineSeries::new(run, style))?
        };
        if let Some(label) = legend.take() {
            let ends = if curve.reference { DASHED } else { THROUGH };
            list_line(drawn, label, ends, style);
        }
    }
    Ok(())
}

/// Rings where the accuracy asked for was not reached.
fn rings<'a, 'b: 'a, Y>(
    chart: &mut Chart<'a, 'b, Y>,
    curve: &Curve,
    colour: RGBColor,
    factor: f64,
    bottom: f64,
) -> Drawn
where
    Y: Ranged<ValueType = f64>,
{
    if curve.inaccurate.is_empty() {
        return Ok(());
    }
    let count = points(curve.inaccurate.len());
    let label = format!("{}: accuracy not reached at {count}", curve.label);
    let rings = curve.inaccurate.iter().map(|(f, a)| (*f, a * factor));
    let rings = rings.filter(|ring| ring.1 >= bottom);
    // Hollow: the line does not run through it.
    let [inside, mark] = [WHITE.filled(), colour.stroke_width(px(2))];
    let circle = |style| Circle::new((0, 0), px(6), style);
    chart
        .draw_series(rings.map(|at| EmptyElement::at(at) + circle(inside) + circle(mark)))?
        .label(label)
        .legend(move |(x, y)| EmptyElement::at((x + at_px(19), y)) + circle(inside) + circle(mark));
    Ok(())
}

/// Crosses on the axis where a frequency did not converge.
fn crosses<'a, 'b: 'a, Y>(
    chart: &mut Chart<'a, 'b, Y>,
    curve: &Curve,
    colour: RGBColor,
    bottom: f64,
) -> Drawn
where
    Y: Ranged<ValueType = f64>,
{
    let lost: Vec<f64> = curve
        .points
        .iter()
        .filter(|p| p.1.is_none())
        .map(|p| p.0)
        .collect();
    if lost.is_empty() {
        return Ok(());
    }
    let label = format!("{}: {} did not converge", curve.label, points(lost.len()));
    let mark = colour.stroke_width(px(3));
    let on_axis = lost.into_iter().map(|f| (f, bottom));
    chart
        .draw_series(on_axis.map(|at| Cross::new(at, px(7), mark)))?
        .label(label)
        .legend(move |(x, y)| {
            EmptyElement::at((x + at_px(19), y)) + Cross::new((0, 0), px(7), mark)
        });
    Ok(())
}

/// The upper corner on whose side the curves stay lower: a legend there hides less of them.
fn clear_corner(curves: &[Curve]) -> SeriesLabelPosition {
    let points = || curves.iter().flat_map(|c| &c.points);
    let (low, high) = bounds(points().map(|p| p.0));
    let aside = LEGEND_WIDTH * (high - low);
    let highest = |is_beside: &dyn Fn(f64) -> bool| {
        let beside = points().filter(|p| is_beside(p.0));
        beside.filter_map(|p| p.1).fold(0.0, f64::max)
    };
    if highest(&|f| f >= high - aside) > highest(&|f| f <= low + aside) {
        SeriesLabelPosition::UpperLeft
    } else {
        SeriesLabelPosition::UpperRight
    }
}

/// Stretches of neighbouring points that have a value (and show on the axis), scaled.
fn converged_runs(points: &[(f64, Option<f64>)], factor: f64, bottom: f64) -> Vec<Vec<(f64, f64)>> {
    let shown = |p: &(f64, Option<f64>)| Some((p.0, p.1? * factor)).filter(|q| q.1 >= bottom);
    let mut runs = vec![Vec::new()];
    for point in points.iter().map(shown) {
        match (point, runs.last_mut()) {
            (Some(p), Some(run)) => run.push(p),
            _ => runs.push(Vec::new()),
        }
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

fn next(colours: &mut impl Iterator<Item = RGBColor>) -> RGBColor {
    colours.next().unwrap_or(INK)
}

fn points(count: usize) -> String {
    if count == 1 {
        "1 point".to_owned()
    } else {
        format!("{count} points")
    }
}

/// A label of a logarithmic axis.
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
        let runs = converged_runs(&points, 10.0, 0.0);
        assert_eq!(runs, [vec![(1.0, 10.0)], vec![(3.0, 30.0), (4.0, 40.0)]]);
    }

    #[test]
    fn the_legend_stands_on_the_side_where_the_curves_are_lower() {
        let curve = |points: [(f64, Option<f64>); 3]| Curve {
            label: String::new(),
            points: points.to_vec(),
            inaccurate: vec![],
            reference: false,
        };
        let rising = curve([(0.0, Some(1.0)), (5.0, Some(9.0)), (10.0, Some(2.0))]);
        let falling = curve([(0.0, Some(3.0)), (5.0, Some(1.0)), (10.0, None)]);
        let is_left =
            |curves: &[Curve]| matches!(clear_corner(curves), SeriesLabelPosition::UpperLeft);
        assert!(is_left(std::slice::from_ref(&rising)));
        assert!(!is_left(std::slice::from_ref(&falling)));
        assert!(!is_left(&[rising, falling]));
        assert!(!is_left(&[]));
    }

    #[test]
    fn bounds_of_one_or_no_frequency_still_make_an_axis() {
        assert_eq!(bounds([5.0].into_iter()), (4.0, 6.0));
        assert_eq!(bounds([].into_iter()), (0.0, 1.0));
    }
}
