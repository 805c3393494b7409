//! Draws points and lines on two logarithmic axes, such as an error against its cost.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::colour::of_curve;
use super::{Canvas, Drawn, GRID, INK, TEXT_PX, TITLE_PX, draw_legend, text_style, write_svg};
use crate::export::ExportError;

const SIZE: (u32, u32) = (1280, 860);
/// Height of an entry of the legend, and its share of the frame.
const LEGEND_PX: u32 = 40;

/// Points of a logarithmic plot; those that are not above 0 on both axes are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSeries {
    pub label: String,
    pub points: Vec<(f64, f64)>,
    /// Written beside each point; empty: nothing is written.
    pub names: Vec<String>,
    /// Joined by a line.
    pub joined: bool,
}

/// Draws the series with the titles of their axes.
///
/// # Errors
/// [`ExportError`] where the picture cannot be drawn or written.
pub fn write_loglog(
    path: &Path,
    title: &str,
    axes: [&str; 2],
    series: &[LogSeries],
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| draw(canvas, title, axes, series))
}

fn shows(point: &(f64, f64)) -> bool {
    [point.0, point.1].iter().all(|v| *v > 0.0 && v.is_finite())
}

fn draw(canvas: &Canvas, title: &str, axes: [&str; 2], series: &[LogSeries]) -> Drawn {
    let shown = || {
        series
            .iter()
            .flat_map(|s| s.points.iter().copied().filter(shows))
    };
    let x_range = range(shown().map(|p| p.0), 1.25);
    let (low, high) = range(shown().map(|p| p.1), 1.6);
    // The legend stands above the points.
    let legend = (f64::from(LEGEND_PX) * series.len() as f64 / f64::from(SIZE.1)).min(0.5);
    let y_range = (low, high * (high / low).powf(legend / (1.0 - legend)));
    let middle = (x_range.0 * x_range.1).sqrt();
    let mut chart = ChartBuilder::on(canvas)
        .caption(title, text_style(TITLE_PX, HPos::Center, VPos::Top))
        .margin(18)
        .margin_right(48)
        .x_label_area_size(80)
        .y_label_area_size(124)
        .build_cartesian_2d(
            (x_range.0..x_range.1)
                .log_scale()
                .with_key_points(ticks(x_range)),
            (y_range.0..y_range.1)
                .log_scale()
                .with_key_points(ticks(y_range)),
        )?;
    chart
        .configure_mesh()
        .x_desc(axes[0])
        .y_desc(axes[1])
        .max_light_lines(0)
        .bold_line_style(GRID)
        .axis_style(INK)
        .label_style(text_style(TEXT_PX, HPos::Center, VPos::Center))
        .axis_desc_style(text_style(TEXT_PX, HPos::Center, VPos::Center))
        .x_label_formatter(&|v| short(*v))
        .y_label_formatter(&|v| short(*v))
        .draw()?;
    for (i, series) in series.iter().enumerate() {
        let colour = of_curve(i);
        let style = colour.stroke_width(3);
        let points: Vec<(f64, f64)> = series.points.iter().copied().filter(shows).collect();
        if series.joined {
            chart.draw_series(LineSeries::new(points.iter().copied(), style))?;
        }
        let dots = points.iter().map(|p| Circle::new(*p, 6, colour.filled()));
        chart
            .draw_series(dots)?
            .label(series.label.clone())
            .legend(move |(x, y)| Circle::new((x + 19, y), 6, colour.filled()));
        let named = series
            .points
            .iter()
            .zip(&series.names)
            .filter(|(p, _)| shows(p));
        let beside = |(p, name): (&(f64, f64), &String)| {
            // Towards the middle, so that no name leaves the picture.
            let (side, shift) = match p.0 < middle {
                true => (HPos::Left, 9),
                false => (HPos::Right, -9),
            };
            let text = text_style(TEXT_PX - 8, side, VPos::Bottom);
            EmptyElement::at(*p) + Text::new(name.clone(), (shift, -5), text)
        };
        chart.draw_series(named.map(beside))?;
    }
    draw_legend(&mut chart, SeriesLabelPosition::UpperRight, TEXT_PX - 4)
}

/// From the least over `room` to the largest times `room`; 0.1 to 1 where there is nothing.
fn range(values: impl Iterator<Item = f64>, room: f64) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    if low.is_finite() {
        (low / room, high * room)
    } else {
        (0.1, 1.0)
    }
}

/// Powers of ten inside, with 2 and 5 times them where the range is short.
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
        let text = format!("{v:.6}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
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

    #[test]
    fn what_is_not_above_zero_is_left_out_and_nothing_is_still_a_picture() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("errors.svg");
        let series = |points: Vec<(f64, f64)>| LogSeries {
            label: "peak".into(),
            names: points.iter().map(|p| format!("at{}", p.0)).collect(),
            points,
            joined: true,
        };
        for (points, shown) in [
            (vec![(1.0, 0.1), (3.0, 0.0), (7.0, 1e-3)], true),
            (vec![], false),
        ] {
            write_loglog(&path, "t", ["s", "error"], &[series(points)]).unwrap();
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(!text.contains("NaN") && !text.contains("inf"));
            assert_eq!(text.contains("at7"), shown);
            assert!(!text.contains("at3"));
        }
    }
}
