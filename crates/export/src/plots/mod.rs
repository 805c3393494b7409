//! Draws pictures as SVG: curves against frequency, the flanks unrolled, natural frequencies
//! against the speed, and what a study compares.
//!
//! Each kind of picture has a file. Those with two axes are drawn on `chart.rs`, which has heading,
//! legend, axes and lines, so that they look alike; `flanks` and `heat_map` share marks and colour
//! bars of this file. Colours that mean something come from `export/colours.rs`, which gives them
//! one meaning in all pictures. Lengths are given in pixels, and `px` and `at_px` turn them into
//! units of the drawing, of which `PX` make a pixel. `write_svg` writes every picture.

mod axis;
mod campbell;
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
pub use series::{Series, write_series};

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::colours::{self, Colour};
use super::{ExportError, write_file};
use crate::words::{in_unit, ticks};

/// Drawing area of an SVG, in units of which [`PX`] make a pixel.
type Canvas<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Result of a drawing function; the reason of an error goes into [`ExportError::Draw`].
type Drawn<T = ()> = Result<T, Box<dyn std::error::Error>>;

/// Units of a drawing in a pixel. plotters rounds every coordinate to whole units; with whole
/// pixels, curves that rise slowly would show steps.
const PX: u32 = 10;

const INK: RGBColor = rgb(colours::INK);
const NOTHING: RGBColor = rgb(colours::NOTHING);
const GRID: RGBColor = RGBColor(222, 222, 222);
const TITLE_PX: u32 = 30;
const TEXT_PX: u32 = 25;
/// Height of letters at ticks, in legends and under titles.
const SMALL_PX: u32 = TEXT_PX - 3;

const fn rgb([red, green, blue]: Colour) -> RGBColor {
    RGBColor(red, green, blue)
}

/// A number of pixels in units of a drawing.
const fn px(pixels: u32) -> u32 {
    PX * pixels
}

/// A signed number of pixels in units of a drawing, for coordinates and shifts.
const fn at_px(pixels: i32) -> i32 {
    PX as i32 * pixels
}

/// Draws on a white canvas of this size, in pixels, and writes the SVG.
fn write_svg(
    path: &Path,
    size: (u32, u32),
    draw: impl FnOnce(&Canvas) -> Drawn,
) -> Result<(), ExportError> {
    let svg = svg_of(size, draw).map_err(|reason| ExportError::Draw {
        path: path.to_path_buf(),
        reason,
    })?;
    write_file(path, svg.as_bytes())
}

/// Draws on a white canvas of this size, in pixels. Returns the SVG, or the reason why it cannot be
/// drawn.
fn svg_of(size: (u32, u32), draw: impl FnOnce(&Canvas) -> Drawn) -> Result<String, String> {
    let mut svg = String::new();
    {
        let canvas =
            SVGBackend::with_string(&mut svg, (px(size.0), px(size.1))).into_drawing_area();
        canvas
            .fill(&WHITE)
            .map_err(Into::into)
            .and_then(|()| draw(&canvas))
            .and_then(|()| canvas.present().map_err(Into::into))
            .map_err(|e| e.to_string())?;
    }
    Ok(shown_in_pixels(&svg, size))
}

/// Shows the SVG in pixels: the viewBox remains that of the drawing, which is shown [`PX`] times
/// smaller. Rectangles have no line width of their own: it is set to a pixel.
fn shown_in_pixels(svg: &str, (width, height): (u32, u32)) -> String {
    let attributes = |width: u32, height: u32| format!(r#"width="{width}" height="{height}""#);
    let in_units = attributes(px(width), px(height));
    let in_pixels = format!(r#"{} stroke-width="{PX}""#, attributes(width, height));
    svg.replacen(&in_units, &in_pixels, 1)
}

/// Text of this size in pixels, in ink, anchored at (h, v).
fn text_style(pixels: u32, h: HPos, v: VPos) -> TextStyle<'static> {
    TextStyle::from(("sans-serif", px(pixels)).into_font())
        .color(&INK)
        .pos(Pos::new(h, v))
}

/// Upper bound of the width of a text of this size in pixels: sans-serif letters are narrower on
/// average.
fn width_of(words: &str, pixels: u32) -> i32 {
    let letter = i64::from(px(pixels)) * 3 / 5;
    i32::try_from(letter * words.chars().count() as i64).unwrap_or(i32::MAX / 4)
}

/// Returns `true` if two boxes (left, right, top, bottom) overlap.
fn overlap(a: [i32; 4], b: [i32; 4]) -> bool {
    a[0] < b[1] && b[0] < a[1] && a[2] < b[3] && b[2] < a[3]
}

/// Heading of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heading<'a> {
    /// Title of the picture.
    pub title: &'a str,
    /// Conditions below the title, in smaller letters: force, speed, friction. May be empty.
    pub conditions: &'a str,
}

impl<'a> Heading<'a> {
    /// Title without conditions.
    pub fn plain(title: &'a str) -> Self {
        Self {
            title,
            conditions: "",
        }
    }

    /// Height at the top, units.
    fn height(self) -> i32 {
        at_px(if self.conditions.is_empty() { 64 } else { 96 })
    }

    /// Draws title and conditions, centred at the top.
    fn draw(self, canvas: &Canvas) -> Drawn {
        let (width, _) = canvas.dim_in_pixel();
        for (words, pixels, y) in [(self.title, TITLE_PX, 32), (self.conditions, SMALL_PX, 72)] {
            let style = text_style(pixels, HPos::Center, VPos::Center);
            let place = (width as i32 / 2, at_px(y));
            canvas.draw(&Text::new(words.to_owned(), place, &style))?;
        }
        Ok(())
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
fn draw_marks(canvas: &Canvas, side: Side, edge: i32, marks: &[(i32, String)]) -> Drawn {
    let (h, v) = match side {
        Side::Below => (HPos::Center, VPos::Top),
        Side::Left => (HPos::Right, VPos::Center),
    };
    let style = text_style(SMALL_PX, h, v);
    let mut before: Option<(i32, i32)> = None;
    for (at, words) in marks {
        let half = match side {
            Side::Below => width_of(words, SMALL_PX) / 2,
            Side::Left => at_px(SMALL_PX as i32) / 2,
        };
        if before.is_some_and(|(last, other)| (at - last).abs() < half + other + at_px(4)) {
            continue;
        }
        before = Some((*at, half));
        let outwards = |pixels| match side {
            Side::Below => (*at, edge + at_px(pixels)),
            Side::Left => (edge - at_px(pixels), *at),
        };
        let line = vec![outwards(0), outwards(6)];
        canvas.draw(&PathElement::new(line, INK.stroke_width(px(1))))?;
        canvas.draw(&Text::new(words.clone(), outwards(12), &style))?;
    }
    Ok(())
}

/// Draws the titles of the axes: below the frame at a height, and at the left edge of the picture.
fn draw_titles(canvas: &Canvas, titles: [&str; 2], [x, y]: [i32; 2], below: i32) -> Drawn {
    let style = text_style(TEXT_PX, HPos::Center, VPos::Center);
    canvas.draw(&Text::new(titles[0].to_owned(), (x, below), &style))?;
    let turned = style.transform(FontTransform::Rotate270);
    canvas.draw(&Text::new(titles[1].to_owned(), (at_px(30), y), &turned))?;
    Ok(())
}

/// Left end, top and bottom of a colour bar, in units of the drawing.
#[derive(Debug, Clone, Copy)]
struct Bar {
    left: i32,
    top: i32,
    bottom: i32,
}

/// Draws the colours of the values from `low` to `high`, more than `low`, as a bar with its ticks
/// and its unit.
fn draw_bar(canvas: &Canvas, bar: Bar, [low, high]: [f64; 2], unit: &str) -> Drawn {
    let (unit, factor) = in_unit(unit, high.abs().max(low.abs()));
    let Bar { left, top, bottom } = bar;
    let right = left + at_px(26);
    let row_height = at_px(1);
    for y in (top..bottom).step_by(PX as usize) {
        let fraction =
            f64::from(bottom - row_height - y) / f64::from((bottom - top - row_height).max(1));
        // Two pixels high: each row covers the seam under it, and the next one its lower half.
        let row = Rectangle::new(
            [(left, y), (right, (y + 2 * row_height).min(bottom))],
            rgb(colours::of_value(fraction)).filled(),
        );
        canvas.draw(&row)?;
    }
    canvas.draw(&Rectangle::new(
        [(left, top), (right, bottom)],
        INK.stroke_width(px(1)),
    ))?;
    let text = text_style(SMALL_PX, HPos::Left, VPos::Center);
    for (tick, words) in ticks(low * factor, high * factor, 6) {
        let fraction = (tick / factor - low) / (high - low);
        let y = bottom - (fraction * f64::from(bottom - top)).round() as i32;
        canvas.draw(&PathElement::new(
            vec![(right, y), (right + at_px(6), y)],
            INK.stroke_width(px(1)),
        ))?;
        canvas.draw(&Text::new(words, (right + at_px(14), y), &text))?;
    }
    let name = text_style(TEXT_PX - 1, HPos::Left, VPos::Bottom);
    canvas.draw(&Text::new(unit, (left, top - at_px(10)), &name))?;
    Ok(())
}
