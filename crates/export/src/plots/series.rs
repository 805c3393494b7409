//! Draws points and lines on two axes, each linear or logarithmic: an error against its cost, a
//! figure against a design value.

use std::path::Path;

use super::axis::DrawnAxis;
use super::canvas::{Canvas, Place, Stroke};
use super::chart::{Chart, SIZE};
use super::legend::{Legend, Mark};
use super::{Axis, PictureHeading, TEXT, write_svg};
use crate::ExportError;
use crate::colours::{INK, series_colour};

/// Height of a line of names beside points.
const NAME: f64 = TEXT - 8.0;
/// Distances from a point at which its name may be placed.
const NAME_DISTANCES: [f64; 3] = [12.0, 26.0, 44.0];
/// Largest number of entries in the legend; further series are left out of it.
const MOST_ENTRIES: usize = 10;

/// Points of one colour, joined by a line; points that an axis cannot show are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Words in the legend.
    pub label: String,
    /// Coordinates of the points. The second is `None` if there is no value: the line breaks there.
    pub points: Vec<(f64, Option<f64>)>,
    /// Text beside each point; empty for no texts.
    pub names: Vec<String>,
    /// True for a dashed line in the colour of the series before it.
    pub dashed: bool,
    /// True for a dot at each point.
    pub dots: bool,
    /// Ends of the error bar of each point; empty for no bars.
    pub bars: Vec<Option<[f64; 2]>>,
    /// First coordinates at which nothing was found, which are marked at the lower edge.
    pub failed: Vec<f64>,
}

impl Series {
    /// Series without texts beside its points.
    pub fn new(label: String, points: impl Iterator<Item = (f64, Option<f64>)>) -> Self {
        Self {
            label,
            points: points.collect(),
            names: Vec::new(),
            dashed: false,
            dots: true,
            bars: Vec::new(),
            failed: Vec::new(),
        }
    }
}

/// Error of a value, relative to it, below which no bar is seen.
const SEEN: f64 = 5e-3;

/// Ends of the error bar of a value that is not negative; `None` if no error is known, or none can be
/// seen. `error` has the unit of the value.
pub fn error_bar(value: f64, error: Option<f64>) -> Option<[f64; 2]> {
    let error = error.filter(|error| *error > SEEN * value.abs())?;
    Some([(value - error).max(0.0), value + error])
}

/// Draws the series on their axes.
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_series(
    path: &Path,
    heading: PictureHeading<'_>,
    axes: &[Axis; 2],
    series: &[Series],
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| draw(canvas, heading, axes, series))
}

fn draw(canvas: &Canvas, heading: PictureHeading<'_>, axes: &[Axis; 2], series: &[Series]) {
    let colours = series.iter().filter(|one| !one.dashed).count().max(1);
    let colour = |i: usize| {
        let before = series[..i].iter().filter(|one| !one.dashed).count();
        let own = before.saturating_sub(usize::from(series[i].dashed));
        series_colour(own, colours)
    };
    let every = series.len().div_ceil(MOST_ENTRIES).max(1);
    let mut legend = Legend::default();
    for (i, one) in series.iter().enumerate().step_by(every) {
        let mark = match (one.dashed, one.dots) {
            (false, true) => Mark::Dot(colour(i)),
            (dashed, _) => Mark::Line(Stroke {
                dashed,
                ..Stroke::plain(colour(i), 3.0)
            }),
        };
        legend.add(mark, one.label.clone());
    }
    if let Some(i) = series
        .iter()
        .position(|one| one.bars.iter().any(Option::is_some))
    {
        legend.add(Mark::Line(Stroke::plain(colour(i), 2.0)), "estimated error");
    }
    if series.iter().any(|one| !one.failed.is_empty()) {
        legend.add(Mark::Cross(INK), "nothing found");
    }
    let axes = drawn_axes(axes, series);
    let mut chart = Chart::new(canvas, heading, &legend, axes);
    let places = series.iter().map(|one| {
        let points = one.points.iter();
        points.map(|(x, y)| chart.at((*x, (*y)?))).collect()
    });
    let places: Vec<Vec<Option<Place>>> = places.collect();
    let runs = |places: &[Option<Place>]| -> Vec<Vec<Place>> {
        let runs = places.split(Option::is_none);
        runs.map(|run| run.iter().copied().flatten().collect())
            .collect()
    };
    for run in places.iter().flat_map(|places| runs(places)) {
        chart.taken.add_line(&run);
    }
    let extra = extra_widths(series);
    for (i, (one, places)) in series.iter().zip(&places).enumerate() {
        let stroke = Stroke {
            colour: colour(i),
            width: 3.0 + extra[i],
            dashed: one.dashed,
        };
        for run in runs(places) {
            chart.line(&run, stroke);
        }
        for (at, bar) in one.points.iter().zip(&one.bars) {
            if let Some(ends) = bar {
                draw_bar(&chart, at.0, *ends, Stroke::plain(stroke.colour, 2.0));
            }
        }
        for at in one.failed.iter().filter_map(|x| chart.below(*x)) {
            chart.canvas.cross(at, stroke.colour);
        }
        for at in places.iter().flatten().filter(|_| one.dots) {
            chart.dot(*at, 6.0 + extra[i] / 2.0, stroke.colour);
        }
        let named = places.iter().zip(&one.names);
        for (at, name) in named.filter_map(|(at, name)| Some(((*at)?, name))) {
            chart.name(name, at, NAME, &NAME_DISTANCES);
        }
    }
}

/// Axes that show all points, the ends of their bars, and where nothing was found.
fn drawn_axes(axes: &[Axis; 2], series: &[Series]) -> [DrawnAxis; 2] {
    let points = series.iter().flat_map(|s| &s.points);
    let points = points.filter_map(|(x, y)| Some([*x, (*y)?]));
    let bars = series.iter().flat_map(|s| s.points.iter().zip(&s.bars));
    let bars = bars.filter_map(|((x, _), bar)| Some(bar.as_ref()?.map(|end| [*x, end])));
    let shown = points.chain(bars.flatten());
    let shown = shown.filter(|p| (0..2).all(|k| axes[k].shows(p[k])));
    let shown: Vec<[f64; 2]> = shown.collect();
    let failed = series.iter().flat_map(|s| s.failed.iter().copied());
    [
        axes[0].around(shown.iter().map(|p| p[0]).chain(failed)),
        axes[1].around(shown.iter().map(|p| p[1])),
    ]
}

/// Draws an error bar with its ends. An end that the axis cannot show is at the lower edge.
fn draw_bar(chart: &Chart<'_>, x: f64, [low, high]: [f64; 2], stroke: Stroke) {
    let (Some(top), Some(edge)) = (chart.at((x, high)), chart.below(x)) else {
        return;
    };
    let bottom = chart.at((x, low)).unwrap_or(edge);
    chart.line(&[top, bottom], stroke);
    let half = 7.0;
    for (x, y) in [top, bottom] {
        chart.line(&[(x - half, y), (x + half, y)], stroke);
    }
}

/// Extra line width of each series, by which it remains visible beside coinciding series
/// that are drawn on top of it.
fn extra_widths(series: &[Series]) -> Vec<f64> {
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
        .map(|i| 6.0 * over(i).min(4) as f64)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn svg(axes: &[Axis; 2], series: &[Series]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("series.svg");
        write_series(&path, PictureHeading::plain("t"), axes, series).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(!text.contains("NaN") && !text.contains("inf"));
        text
    }

    fn joined(points: &[(f64, Option<f64>)]) -> Series {
        Series {
            label: "peak".into(),
            names: points.iter().map(|p| format!("at{}", p.0)).collect(),
            ..Series::new(String::new(), points.iter().copied())
        }
    }

    /// The picture shows all values that were asked for, and how far the others can be trusted.
    #[test]
    fn what_failed_and_what_is_uncertain_is_seen() {
        let axes = ["force", "amplitude"].map(Axis::logarithmic);
        let points = [(1.0, Some(1e-6)), (2.0, Some(2e-6))];
        let plain = svg(&axes, &[joined(&points)]);
        assert!(!plain.contains("nothing found") && !plain.contains("estimated error"));
        let uncertain = Series {
            bars: vec![None, Some([0.0, 4e-6])],
            failed: vec![4.0],
            ..joined(&points)
        };
        let text = svg(&axes, &[uncertain]);
        assert!(text.contains("nothing found") && text.contains("estimated error"));
        let count = |text: &str, what: &str| text.matches(what).count();
        // The axis reaches the value that failed; bar, its ends, a cross and two marks of the legend.
        assert!(
            count(&text, "<polyline") >= count(&plain, "<polyline") + 6,
            "{text}"
        );
    }

    #[test]
    fn an_error_that_cannot_be_seen_has_no_bar() {
        assert_eq!(error_bar(2.0, None), None);
        assert_eq!(error_bar(2.0, Some(0.009)), None);
        assert_eq!(error_bar(2.0, Some(0.5)), Some([1.5, 2.5]));
        assert_eq!(error_bar(2.0, Some(3.0)), Some([0.0, 5.0]));
    }

    /// Number of points of each line of the picture.
    fn lines(svg: &str) -> Vec<usize> {
        let wide = svg
            .lines()
            .filter(|l| l.contains("<polyline") && l.contains("stroke-width=\"3\""));
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
            unit,
            marks,
            ..Axis::linear(title)
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
            let width = |l: &str| -> f64 {
                let after = l.split("stroke-width=\"").nth(1).unwrap();
                after.split('"').next().unwrap().parse().unwrap()
            };
            let widths = wide.map(width).filter(|w| *w >= 3.0);
            widths.collect::<Vec<_>>()
        };
        let [first, apart, last] = [9.0, 3.0, 3.0];
        let found = widths(&[line(0.1), line(0.5), line(0.1002)]);
        assert_eq!(found, [first, apart, last]);
        assert_eq!(widths(&[line(0.1), line(0.2)]), [3.0; 2]);
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
