//! Draws pictures as SVG: curves against frequency, the flanks unrolled, natural frequencies
//! against the speed, and what a study compares.
//!
//! Each kind of picture has a file. Those with two axes are drawn on `chart.rs`, which has heading,
//! legend, axes and lines, so that they look alike; `flanks` and `heat_map` share marks and colour
//! bars of this file. Colours that mean something come from `export/colours.rs`, which gives them
//! one meaning in all pictures. Lengths are in pixels. `canvas.rs` makes the elements of the SVG.

mod axis;
mod campbell;
mod canvas;
mod chart;
mod curves;
mod flanks;
mod haigh;
mod heat_map;
mod legend;
mod names;
mod nodal_diameters;
mod series;

pub use axis::{Axis, Scale, ends};
pub use campbell::{CampbellFamily, EngineOrders, Operation, write_campbell};
pub use curves::write_curves;
pub use flanks::{write_field_map, write_no_field, write_separation_map};
pub(crate) use haigh::haigh_svg;
pub use haigh::{Haigh, write_haigh};
pub use heat_map::{HeatMap, write_heat_map};
pub use nodal_diameters::write_nodal_diameters;
pub use series::{Series, error_bar, write_series};

use std::path::Path;

use self::canvas::{BOTTOM, CENTRE, Canvas, LEFT, Letters, MIDDLE, Paint, RIGHT, Stroke, TOP};
use super::colours::{self, Colour, INK};
use super::{ExportError, write_file};
use crate::words::{prefixed_unit, ticks};

const GRID: Colour = [222; 3];
/// Heights of lines of text: of titles, and of names of axes.
const TITLE: f64 = 30.0;
const TEXT: f64 = 25.0;
/// Height at ticks, in legends and under titles.
const SMALL: f64 = TEXT - 3.0;

/// Draws on a white canvas of this size and writes the SVG.
fn write_svg(path: &Path, size: (f64, f64), draw: impl FnOnce(&Canvas)) -> Result<(), ExportError> {
    write_file(path, svg_of(size, draw).as_bytes())
}

/// Draws on a white canvas of this size.
fn svg_of(size: (f64, f64), draw: impl FnOnce(&Canvas)) -> String {
    let canvas = Canvas::new(size);
    draw(&canvas);
    canvas.into_svg()
}

/// Upper bound of the width of a text in lines of this height: sans-serif letters are narrower on
/// average.
fn width_of(words: &str, height: f64) -> f64 {
    0.6 * height * words.chars().count() as f64
}

/// Returns `true` if two boxes (left, right, top, bottom) overlap.
fn overlap(a: [f64; 4], b: [f64; 4]) -> bool {
    a[0] < b[1] && b[0] < a[1] && a[2] < b[3] && b[2] < a[3]
}

/// Heading of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PictureHeading<'a> {
    /// Title of the picture.
    pub title: &'a str,
    /// Conditions below the title, in smaller letters: force, speed, friction. May be empty.
    pub conditions: &'a str,
}

impl<'a> PictureHeading<'a> {
    /// Title without conditions.
    pub fn plain(title: &'a str) -> Self {
        Self {
            title,
            conditions: "",
        }
    }

    /// Height at the top.
    fn height(self) -> f64 {
        if self.conditions.is_empty() {
            64.0
        } else {
            96.0
        }
    }

    /// Draws title and conditions, centred at the top.
    fn draw(self, canvas: &Canvas) {
        for (words, height, y) in [(self.title, TITLE, 32.0), (self.conditions, SMALL, 72.0)] {
            let letters = Letters::new(height, MIDDLE, CENTRE);
            canvas.text(words, (canvas.width / 2.0, y), letters);
        }
    }
}

/// Side of a frame at which an axis has its marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Below,
    Left,
}

/// Draws the marks of an axis at places along it, outside of the frame that ends at `edge`. Of marks
/// whose words would touch only the first is drawn.
fn draw_marks(canvas: &Canvas, side: Side, edge: f64, marks: &[(f64, String)]) {
    let (across, down) = match side {
        Side::Below => (MIDDLE, TOP),
        Side::Left => (RIGHT, CENTRE),
    };
    let letters = Letters::new(SMALL, across, down);
    let mut before: Option<(f64, f64)> = None;
    for (at, words) in marks {
        let half = match side {
            Side::Below => width_of(words, SMALL) / 2.0,
            Side::Left => SMALL / 2.0,
        };
        if before.is_some_and(|(last, other)| (at - last).abs() < half + other + 4.0) {
            continue;
        }
        before = Some((*at, half));
        let outwards = |far| match side {
            Side::Below => (*at, edge + far),
            Side::Left => (edge - far, *at),
        };
        canvas.line(&[outwards(0.0), outwards(6.0)], Stroke::plain(INK, 1.0));
        canvas.text(words, outwards(12.0), letters);
    }
}

/// Draws the titles of the axes: below the frame at a height, and at the left edge of the picture.
fn draw_titles(canvas: &Canvas, titles: [&str; 2], [x, y]: [f64; 2], below: f64) {
    let letters = Letters::new(TEXT, MIDDLE, CENTRE);
    canvas.text(titles[0], (x, below), letters);
    let turned = Letters {
        turned: true,
        ..letters
    };
    canvas.text(titles[1], (30.0, y), turned);
}

/// Left end, top and bottom of a colour bar.
#[derive(Debug, Clone, Copy)]
struct Bar {
    left: f64,
    top: f64,
    bottom: f64,
}

/// Draws the colours of the values from `low` to `high`, more than `low`, as a bar with its ticks
/// and its unit.
fn draw_bar(canvas: &Canvas, bar: Bar, [low, high]: [f64; 2], unit: &str) {
    let (unit, factor) = prefixed_unit(unit, high.abs().max(low.abs()));
    let Bar { left, top, bottom } = bar;
    let right = left + 26.0;
    let rows = ((bottom - top).ceil() as u32).max(1);
    for row in 0..rows {
        let y = top + f64::from(row);
        let fraction = (bottom - 1.0 - y) / (bottom - top - 1.0).max(1.0);
        // Two pixels high: each row covers the seam under it, and the next one its lower half.
        let sides = [left, right, y, (y + 2.0).min(bottom)];
        canvas.rectangle(sides, Paint::Filled(colours::value_colour(fraction)));
    }
    canvas.rectangle([left, right, top, bottom], Paint::Outline(INK, 1.0));
    let letters = Letters::new(SMALL, LEFT, CENTRE);
    for (tick, words) in ticks(low * factor, high * factor, 6) {
        let y = bottom - (tick / factor - low) / (high - low) * (bottom - top);
        canvas.line(&[(right, y), (right + 6.0, y)], Stroke::plain(INK, 1.0));
        canvas.text(&words, (right + 14.0, y), letters);
    }
    let letters = Letters::new(TEXT - 1.0, LEFT, BOTTOM);
    canvas.text(&unit, (left, top - 10.0), letters);
}
