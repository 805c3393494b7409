//! Draws points and lines on two axes, each linear or logarithmic: an error against its cost, a
//! figure against a design value.

use std::ops::Range;
use std::path::Path;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::colour::of_series;
use super::legend::{Legend, Mark, width_of};
use super::names::Taken;
use super::{
    Canvas, Drawn, Scale, TEXT_PX, TITLE_HEIGHT, at_px, draw_mesh, draw_title, in_unit, px,
    round_ticks, text_style, tick_label, write_svg,
};
use crate::export::ExportError;
use crate::words::without_zeros;

const SIZE: (u32, u32) = (1280, 860);
/// Height of the letters of names beside points, pixels.
const NAME_PX: u32 = TEXT_PX - 8;
/// Largest number of entries in the legend; further series are left out of it.
const MOST_ENTRIES: usize = 10;

/// Points of one colour; points that an axis cannot show are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub label: String,
    /// Coordinates of the points. The second is `None` if there is no value: the line breaks there.
    pub points: Vec<(f64, Option<f64>)>,
    /// Text beside each point; empty for no texts.
    pub names: Vec<String>,
    /// True if a line joins the points.
    pub joined: bool,
}

/// One of the two axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub title: String,
    /// SI unit of the values, which a prefix may precede; empty if they are shown as they are.
    pub unit: &'static str,
    /// Scale of the axis; a logarithmic axis shows only values above 0.
    pub scale: Scale,
    /// Marked values and their labels; if empty, round values are marked.
    pub marks: Vec<(f64, String)>,
}

impl Axis {
    /// Logarithmic axis of numbers without a unit.
    pub fn logarithmic(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            unit: "",
            scale: Scale::Logarithmic,
            marks: Vec::new(),
        }
    }

    /// Coordinate of a value on the axis; `None` if the axis cannot show it.
    fn place(&self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Linear => value,
            Scale::Logarithmic => value.log10(),
        };
        Some(place).filter(|p| p.is_finite())
    }
}

/// Draws the series on their axes.
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_series(
    path: &Path,
    title: &str,
    axes: &[Axis; 2],
    series: &[Series],
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| draw(canvas, title, axes, series))
}

/// Axis with its range and its marks, in coordinates of the axis.
struct Drawing {
    title: String,
    low: f64,
    high: f64,
    marks: Vec<(f64, String)>,
}

impl Drawing {
    /// Axis that covers these coordinates and its own marks.
    fn of(axis: &Axis, places: impl Iterator<Item = f64>) -> Self {
        let marked = axis.marks.iter().filter_map(|(v, _)| axis.place(*v));
        let (low, high) = places
            .chain(marked)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(v), h.max(v))
            });
        let (low, high) = match (low.is_finite(), axis.scale) {
            (true, Scale::Logarithmic) => (low - 0.15, high + 0.15),
            // From 0 where that does not press the points together.
            (true, Scale::Linear) if low >= 0.0 && low < 0.5 * high => (0.0, 1.05 * high),
            (true, Scale::Linear) if low == high => {
                let beside = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
                (low - beside, high + beside)
            }
            (true, Scale::Linear) => (low - 0.05 * (high - low), high + 0.05 * (high - low)),
            (false, Scale::Logarithmic) => (-1.0, 0.0),
            (false, Scale::Linear) => (0.0, 1.0),
        };
        let (unit, factor) = match axis.scale {
            Scale::Linear => in_unit(axis.unit, low.abs().max(high.abs())),
            Scale::Logarithmic => (axis.unit.to_owned(), 1.0),
        };
        let title = match unit.as_str() {
            "" => axis.title.clone(),
            unit => format!("{} ({unit})", axis.title),
        };
        let round = || match axis.scale {
            Scale::Linear => {
                let (ticks, step) = round_ticks(factor * low, factor * high, 8);
                let mark = |v: f64| (v / factor, tick_label(v, step));
                ticks.into_iter().map(mark).collect()
            }
            Scale::Logarithmic => {
                let ticks = ticks((10f64.powf(low), 10f64.powf(high)));
                ticks.into_iter().map(|v| (v, short(v))).collect()
            }
        };
        let marks: Vec<(f64, String)> = if axis.marks.is_empty() {
            round()
        } else {
            axis.marks.clone()
        };
        let marks = marks
            .into_iter()
            .filter_map(|(v, words)| Some((axis.place(v)?, words)));
        Self {
            title,
            low,
            high,
            marks: marks
                .filter(|(place, _)| (low..=high).contains(place))
                .collect(),
        }
    }
}

impl Ranged for Drawing {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (first, last): (i32, i32)) -> i32 {
        let share = (place - self.low) / (self.high - self.low);
        first + (share * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let marks = self.marks.iter().map(|m| m.0);
        // Light lines would stand at the same places.
        marks
            .filter(|_| !hint.weight().allow_light_points())
            .collect()
    }

    fn range(&self) -> Range<f64> {
        self.low..self.high
    }
}

/// Label at the mark nearest to a coordinate.
impl ValueFormatter<f64> for Drawing {
    fn format(place: &f64) -> String {
        place.to_string()
    }

    fn format_ext(&self, place: &f64) -> String {
        let distance = |m: &(f64, String)| (m.0 - place).abs();
        let marks = self.marks.iter();
        let nearest = marks.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.map_or(String::new(), |m| m.1.clone())
    }
}

fn draw(canvas: &Canvas, title: &str, axes: &[Axis; 2], series: &[Series]) -> Drawn {
    let place = |(x, y): &(f64, Option<f64>)| Some((axes[0].place(*x)?, axes[1].place((*y)?)?));
    let shown = || {
        series
            .iter()
            .flat_map(|s| s.points.iter().filter_map(place))
    };
    let every = series.len().div_ceil(MOST_ENTRIES).max(1);
    let mut legend = Legend::default();
    for (i, one) in series.iter().enumerate().step_by(every) {
        legend.add(Mark::Dot(of_series(i, series.len())), one.label.clone());
    }
    let x = Drawing::of(&axes[0], shown().map(|p| p.0));
    let y = Drawing::of(&axes[1], shown().map(|p| p.1));
    let titles = [&x, &y].map(|axis| axis.title.clone());
    draw_title(canvas, title)?;
    legend.draw(canvas, TITLE_HEIGHT)?;
    let width = canvas.dim_in_pixel().0 as i32;
    let mut chart = ChartBuilder::on(canvas)
        .margin(px(18))
        .margin_top(TITLE_HEIGHT + legend.height(width) + at_px(8))
        .margin_right(px(48))
        .x_label_area_size(px(80))
        .y_label_area_size(px(124))
        .build_cartesian_2d(x, y)?;
    draw_mesh(
        chart
            .configure_mesh()
            .x_desc(titles[0].as_str())
            .y_desc(titles[1].as_str())
            .max_light_lines(0),
    )?;
    let extra = extra_widths(series);
    let mut taken = Taken::default();
    for one in series {
        let places: Vec<Option<(f64, f64)>> = one.points.iter().map(place).collect();
        for run in places.split(Option::is_none) {
            let run: Vec<(i32, i32)> = run
                .iter()
                .flatten()
                .map(|p| chart.backend_coord(p))
                .collect();
            taken.add_line(&run, one.joined);
        }
    }
    for (i, one) in series.iter().enumerate() {
        let colour = of_series(i, series.len());
        let places: Vec<Option<(f64, f64)>> = one.points.iter().map(place).collect();
        for run in places.split(Option::is_none).filter(|_| one.joined) {
            let run = run.iter().copied().flatten();
            let style = colour.stroke_width(px(3 + extra[i]));
            chart.draw_series(LineSeries::new(run, style))?;
        }
        let dots = places.iter().flatten();
        let dots = dots.map(|p| Circle::new(*p, px(6 + extra[i] / 2), colour.filled()));
        chart.draw_series(dots)?;
        let named = places.iter().zip(&one.names);
        let named: Vec<((i32, i32), &String)> = named
            .filter_map(|(p, name)| Some((chart.backend_coord(&(*p)?), name)))
            .collect();
        let frame = chart.plotting_area().get_pixel_range();
        for (at, name) in named {
            let size = (width_of(name) * NAME_PX as i32 / TEXT_PX as i32, at_px(18));
            let Some(bounds) = taken.beside(at, size, [&frame.0, &frame.1], &[12, 26, 44]) else {
                continue;
            };
            let style = text_style(NAME_PX, HPos::Left, VPos::Center);
            let middle = (bounds[2] + bounds[3]) / 2;
            canvas.draw(&Text::new(name.clone(), (bounds[0], middle), &style))?;
        }
    }
    Ok(())
}

/// Extra line width of each series, pixels, by which it remains visible beside coinciding series
/// that are drawn on top of it.
fn extra_widths(series: &[Series]) -> Vec<u32> {
    let near = |a: f64, b: f64| (a - b).abs() <= 0.01 * a.abs().max(b.abs());
    let coincide = |a: &Series, b: &Series| {
        let both = a.points.iter().zip(&b.points);
        a.points.len() == b.points.len()
            && both
                .filter_map(|(p, q)| Some((p.0, q.0, p.1?, q.1?)))
                .all(|(x, at, y, v)| near(x, at) && near(y, v))
    };
    let over = |i: usize| {
        series[i + 1..]
            .iter()
            .filter(|s| coincide(&series[i], s))
            .count()
    };
    (0..series.len())
        .map(|i| 6 * over(i).min(4) as u32)
        .collect()
}

/// Powers of ten inside the range, with 2 and 5 times them if the range is short.
fn ticks((low, high): (f64, f64)) -> Vec<f64> {
    let decades = (high / low).log10();
    let steps: &[f64] = match decades {
        d if d < 1.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
        d if d < 3.0 => &[1.0, 2.0, 5.0],
        _ => &[1.0],
    };
    let every = ((decades / 10.0).ceil() as i32).max(1);
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    (first..=last)
        .filter(|power| power % every == 0)
        .flat_map(|power| steps.iter().map(move |s| s * 10f64.powi(power)))
        .filter(|v| (low..=high).contains(v))
        .collect()
}

fn short(v: f64) -> String {
    if (0.001..10_000.0).contains(&v) {
        // Powers of ten are not exact: no digits beyond the sixth.
        without_zeros(&format!("{v:.6}")).to_owned()
    } else {
        format!("{v:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let near = |found: Vec<f64>, wanted: &[f64]| {
            assert_eq!(found.len(), wanted.len(), "{found:?}");
            assert!(
                found
                    .iter()
                    .zip(wanted)
                    .all(|(f, w)| (f / w - 1.0).abs() < 1e-12),
                "{found:?}"
            );
        };
        near(
            ticks((0.9, 120.0)),
            &[1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0],
        );
        near(ticks((0.5e-4, 2.0)), &[1e-4, 1e-3, 1e-2, 0.1, 1.0]);
        near(ticks((2.5, 4.5)), &[3.0, 4.0]);
        assert_eq!(short(0.1 + 0.2), "0.3");
        assert_eq!(short(1e-7), "1e-7");
    }

    fn svg(axes: &[Axis; 2], series: &[Series]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.svg");
        write_series(&path, "t", axes, series).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(!text.contains("NaN") && !text.contains("inf"));
        text
    }

    fn joined(points: &[(f64, Option<f64>)]) -> Series {
        Series {
            label: "peak".into(),
            names: points.iter().map(|p| format!("at{}", p.0)).collect(),
            points: points.to_vec(),
            joined: true,
        }
    }

    /// Number of points of each line of the picture.
    fn lines(svg: &str) -> Vec<usize> {
        let wide = svg
            .lines()
            .filter(|l| l.contains("<polyline") && l.contains("stroke-width=\"30\""));
        let points = wide.filter_map(|l| l.split(" points=\"").nth(1)?.split('"').next());
        points.map(|p| p.split_whitespace().count()).collect()
    }

    #[test]
    fn what_is_not_above_zero_is_left_out_and_nothing_is_still_a_picture() {
        let axes = ["s", "error"].map(Axis::logarithmic);
        let points = [(1.0, Some(0.1)), (3.0, Some(0.0)), (7.0, Some(1e-3))];
        for (points, shown) in [(&points[..], true), (&[], false)] {
            let text = svg(&axes, &[joined(points)]);
            assert_eq!(text.contains("at7"), shown);
            assert!(!text.contains("at3"));
        }
    }

    #[test]
    fn a_point_without_a_value_breaks_the_line() {
        let linear = |title: &str, unit, marks| Axis {
            title: title.into(),
            unit,
            scale: Scale::Linear,
            marks,
        };
        let marks = vec![(1.0, "one".to_owned()), (4.0, "four".to_owned())];
        let axes = [
            linear("friction", "", marks),
            linear("amplitude", "m", vec![]),
        ];
        let value = |v: f64| Some(1e-6 * v);
        let points = [
            (1.0, value(1.0)),
            (2.0, value(2.0)),
            (3.0, None),
            (4.0, value(4.0)),
            (5.0, value(3.0)),
        ];
        let text = svg(&axes, &[joined(&points)]);
        assert_eq!(lines(&text), [2, 2]);
        assert!(text.contains("amplitude (µm)") && text.contains("friction"));
        assert!(text.contains("one") && text.contains("four"));
        // A mark without a point, far away; one value everywhere, and none at all.
        svg(&axes, &[joined(&[(1e-9, value(1.0)), (2e-9, value(2.0))])]);
        svg(&axes, &[joined(&[(1.0, Some(0.0)), (2.0, Some(0.0))])]);
        let same = svg(&axes, &[joined(&[(1.0, value(5.0)), (2.0, value(5.0))])]);
        assert!(same.contains("amplitude (µm)"), "{same}");
        svg(&axes, &[joined(&[(1.0, None)])]);
    }

    /// The lower line is visible on both sides of the upper one.
    #[test]
    fn lines_that_coincide_are_both_seen() {
        let axes = ["x", "y"].map(Axis::logarithmic);
        let line = |v: f64| joined(&[(1.0, Some(v)), (2.0, Some(2.0 * v))]);
        let widths = |series: &[Series]| {
            let text = svg(&axes, series);
            let wide = text.lines().filter(|l| l.contains("<polyline"));
            let width = |l: &str| -> u32 {
                let after = l.split("stroke-width=\"").nth(1).unwrap();
                after.split('"').next().unwrap().parse().unwrap()
            };
            let widths = wide.map(width).filter(|w| *w >= px(3));
            widths.collect::<Vec<_>>()
        };
        let [first, apart, last] = [px(9), px(3), px(3)];
        let found = widths(&[line(0.1), line(0.5), line(0.1002)]);
        assert_eq!(found, [first, apart, last]);
        assert_eq!(widths(&[line(0.1), line(0.2)]), [px(3); 2]);
    }

    #[test]
    fn the_legend_of_many_series_leaves_some_out() {
        let axes = ["x", "y"].map(Axis::logarithmic);
        let series = |i: u32| Series {
            label: format!("entry{i}"),
            ..joined(&[(1.0, Some(f64::from(i) + 1.0)), (2.0, Some(2.0))])
        };
        let text = svg(&axes, &(0..25).map(series).collect::<Vec<_>>());
        assert_eq!(lines(&text).len(), 25);
        let entries = text.lines().filter(|l| l.starts_with("entry"));
        assert_eq!(entries.count(), 9);
    }
}
