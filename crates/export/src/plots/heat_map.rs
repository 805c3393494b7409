//! Draws a figure over the values of two parameters, one cell for each pair of values.

use std::path::Path;

use super::canvas::{CENTRE, Canvas, Letters, MIDDLE, Paint, Place, WHITE};
use super::{
    Bar, PictureHeading, SMALL, Side, TEXT, draw_bar, draw_marks, draw_titles, ends, width_of,
    write_svg,
};
use crate::ExportError;
use crate::colours::{NOTHING, value_colour};
use crate::words::{capital, format_step, prefixed_unit};

const SIZE: Place = (1280.0, 860.0);
/// Smallest and largest room for the labels of the rows.
const LEFT: Place = (150.0, 500.0);
const RIGHT: f64 = 190.0;
const TOP: f64 = 110.0;
const BOTTOM: f64 = 110.0;
/// Smallest cell in which its value is written.
const ROOM: Place = (76.0, 28.0);

/// Figure over two parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Name of the values: `peak amplitude of tip`.
    pub quantity: String,
    /// SI unit of the values; empty if they have none.
    pub unit: &'static str,
    /// Titles of the horizontal and of the vertical axis.
    pub axes: [String; 2],
    /// Labels of the columns, from the left, and of the rows, from below.
    pub labels: [Vec<String>; 2],
    /// Value of each row of each column; `None` if there is no value.
    pub values: Vec<Vec<Option<f64>>>,
}

/// Draws the cells with a bar of their colours, from the smallest value to the largest.
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_heat_map(path: &Path, map: &HeatMap) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| draw(canvas, map))
}

impl HeatMap {
    /// Title of the picture.
    pub fn title(&self) -> String {
        let [across, up] = &self.axes;
        format!("{} over {across} and {up}", capital(&self.quantity))
    }

    fn value(&self, column: usize, row: usize) -> Option<f64> {
        let value = self.values.get(column)?.get(row).copied()?;
        value.filter(|v| v.is_finite())
    }

    /// Left end of the cells: right of the labels of the rows and of the title of the axis.
    fn left(&self) -> f64 {
        (self.longest(1) + 70.0).clamp(LEFT.0, LEFT.1)
    }

    /// Width of the longest label of the columns (0) or of the rows (1).
    fn longest(&self, axis: usize) -> f64 {
        let widths = self.labels[axis].iter().map(|words| width_of(words, SMALL));
        widths.fold(0.0, f64::max)
    }

    /// Sides of a cell: left, right, top, bottom.
    fn cell(&self, column: usize, row: usize) -> [f64; 4] {
        let along = |i: usize, count: usize, length: f64| i as f64 / count.max(1) as f64 * length;
        let left = self.left();
        let (width, height) = (SIZE.0 - left - RIGHT, SIZE.1 - TOP - BOTTOM);
        let x = |i: usize| left + along(i, self.labels[0].len(), width);
        let y = |i: usize| SIZE.1 - BOTTOM - along(i, self.labels[1].len(), height);
        [x(column), x(column + 1), y(row + 1), y(row)]
    }
}

fn draw(canvas: &Canvas, map: &HeatMap) {
    PictureHeading::plain(&map.title()).draw(canvas);
    let [columns, rows] = [0, 1].map(|axis| map.labels[axis].len());
    let cells = || (0..columns).flat_map(|c| (0..rows).map(move |r| (c, r)));
    let values = || cells().filter_map(|(c, r)| map.value(c, r));
    let [low, high] = ends(values());
    let (_, factor) = prefixed_unit(map.unit, low.abs().max(high.abs()));
    let three_digits = 10f64.powf((factor * low.abs().max(high.abs())).log10().floor() - 2.0);
    let are_whole = values().all(|v| (factor * v).fract() == 0.0);
    let step = if are_whole { 1.0 } else { three_digits };
    for (column, row) in cells() {
        let [left, right, top, bottom] = map.cell(column, row);
        let value = map.value(column, row);
        // One value alone is the least.
        let fraction = value.map(|v| (v - low) / (high - low).max(f64::MIN_POSITIVE));
        let fill = fraction.map_or(NOTHING, value_colour);
        let sides = [left, right, top, bottom];
        canvas.rectangle(sides, Paint::Filled(fill));
        canvas.rectangle(sides, Paint::Outline(WHITE, 1.0));
        if right - left < ROOM.0 || bottom - top < ROOM.1 {
            continue;
        }
        let words = value.map_or("none".to_owned(), |v| format_step(factor * v, step));
        // White letters on the dark half of the colours.
        let mut letters = Letters::new(TEXT - 5.0, MIDDLE, CENTRE);
        if fraction.is_some_and(|fraction| fraction < 0.5) {
            letters.colour = WHITE;
        }
        let middle = ((left + right) / 2.0, (top + bottom) / 2.0);
        canvas.text(&words, middle, letters);
    }
    draw_axes(canvas, map);
    if low < high {
        let bar = Bar {
            left: SIZE.0 - RIGHT + 40.0,
            top: TOP,
            bottom: SIZE.1 - BOTTOM,
        };
        draw_bar(canvas, bar, [low, high], map.unit);
    }
}

/// Draws the labels of columns and rows, as many as have room, and the titles.
fn draw_axes(canvas: &Canvas, map: &HeatMap) {
    let marks = [0, 1].map(|axis| -> Vec<(f64, String)> {
        let middle = |i: usize| {
            let [left, right, top, bottom] = if axis == 0 {
                map.cell(i, 0)
            } else {
                map.cell(0, i)
            };
            [(left + right) / 2.0, (top + bottom) / 2.0][axis]
        };
        let labels = map.labels[axis].iter().enumerate();
        labels
            .map(|(i, words)| (middle(i), words.clone()))
            .collect()
    });
    let (left, bottom) = (map.left(), SIZE.1 - BOTTOM);
    draw_marks(canvas, Side::Below, bottom, &marks[0]);
    draw_marks(canvas, Side::Left, left, &marks[1]);
    let titles = map.axes.each_ref().map(String::as_str);
    let middle = [(left + SIZE.0 - RIGHT) / 2.0, (TOP + bottom) / 2.0];
    draw_titles(canvas, titles, middle, bottom + 70.0);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn svg(unit: &'static str, values: Vec<Vec<Option<f64>>>) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.svg");
        let map = HeatMap {
            quantity: "peak amplitude".into(),
            unit,
            axes: ["friction", "force_n"].map(str::to_owned),
            labels: [
                vec!["0.1".into(), "0.3".into()],
                vec!["1.0".into(), "2.0".into()],
            ],
            values,
        };
        write_heat_map(&path, &map).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(!text.contains("NaN") && !text.contains("inf"));
        text
    }

    /// Left and top edge of the filled rectangle of this colour.
    fn corner(svg: &str, colour: &str) -> (f64, f64) {
        let wanted = format!("fill=\"{colour}\"");
        let line = svg
            .lines()
            .find(|l| l.starts_with("<rect") && l.contains(&wanted))
            .unwrap_or_else(|| panic!("no {colour}"));
        let number = |name: &str| {
            let text = line.split(&format!(" {name}=\"")).nth(1).unwrap();
            text.split('"').next().unwrap().parse().unwrap()
        };
        (number("x"), number("y"))
    }

    #[test]
    fn cells_stand_to_the_right_and_upwards_and_what_is_missing_is_grey() {
        let text = svg(
            "m",
            vec![vec![Some(1e-6), Some(2e-6)], vec![None, Some(3.5e-6)]],
        );
        // The least value is dark and lies at the lower left, the largest light at the upper right.
        let (dark, light) = (corner(&text, "#440154"), corner(&text, "#FDE725"));
        let empty = corner(&text, "#D6DBE0");
        assert!(dark.0 < light.0 && light.1 < dark.1);
        assert_eq!(empty, (light.0, dark.1));
        for words in ["1.00", "2.00", "3.50", "none", "µm", "friction", "force_n"] {
            assert!(text.lines().any(|l| l == words), "{words}: {text}");
        }
    }

    #[test]
    fn words_at_the_rows_have_room_beside_the_title() {
        let map = |label: &str| HeatMap {
            quantity: String::new(),
            unit: "",
            axes: ["x", "y"].map(str::to_owned),
            labels: [vec!["a".into()], vec![label.to_owned()]],
            values: vec![vec![Some(1.0)]],
        };
        let left = |label: &str| map(label).cell(0, 0)[0];
        assert_eq!(left("0.1"), LEFT.0);
        let words = "smooth, little damping";
        assert!(left(words) >= 60.0 + width_of(words, SMALL));
        assert_eq!(left(&"long ".repeat(100)), LEFT.1);
    }

    #[test]
    fn counts_have_no_decimals() {
        let count = |n: u32| Some(f64::from(n));
        let text = svg("", vec![vec![count(7), count(12)], vec![count(0), None]]);
        for words in ["7", "12", "0"] {
            assert!(text.lines().any(|l| l == words), "{words}: {text}");
        }
    }

    #[test]
    fn one_value_or_none_is_still_a_picture() {
        for value in [Some(0.0), Some(-2.0), None] {
            let text = svg("m", vec![vec![value; 2]; 2]);
            assert!(text.contains("friction"));
        }
    }
}
