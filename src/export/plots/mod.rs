//! Draws figures as SVG: amplitude and phase against frequency, the flanks unrolled, natural
//! frequencies against the speed, and what a study compares.
//!
//! The colours are Okabe and Ito's set and viridis, which colour-blind eyes tell apart.

mod campbell;
mod colour;
mod curves;
mod flanks;
mod heat_map;
mod legend;
mod names;
mod series;

pub use campbell::{CampbellFamily, EngineOrders, Operation, write_campbell};
pub use curves::{
    Curve, CurveKind, Ordinate, linear_curve, phase_curve, response_curve, write_curves,
};
pub use flanks::{
    write_flank_flags, write_flank_map, write_friction_energy_map, write_separation_map,
    write_slip_map, write_static_pressure_map,
};
pub use heat_map::{HeatMap, write_heat_map};
pub use series::{Axis, Series, write_series};

use std::path::Path;

use plotters::chart::MeshStyle;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{ExportError, write_file};

/// Spacing of values along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    Linear,
    Logarithmic,
}

/// Drawing area of an SVG, in units of which [`PX`] make a pixel.
type Canvas<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// Result of a drawing function; the reason of an error goes into [`ExportError::Draw`].
type Drawn = Result<(), Box<dyn std::error::Error>>;

/// Units of a drawing in a pixel. plotters rounds every coordinate to whole units; with whole
/// pixels, curves that rise slowly would show steps.
const PX: u32 = 10;

const INK: RGBColor = RGBColor(34, 34, 34);
const GRID: RGBColor = RGBColor(222, 222, 222);
const TITLE_PX: u32 = 30;
/// Height of the title at the top, units.
const TITLE_HEIGHT: i32 = at_px(64);
/// Height of title and conditions, units.
const HEADING_HEIGHT: i32 = at_px(96);
const TEXT_PX: u32 = 25;

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
    let mut svg = String::new();
    {
        let canvas =
            SVGBackend::with_string(&mut svg, (px(size.0), px(size.1))).into_drawing_area();
        canvas
            .fill(&WHITE)
            .map_err(Into::into)
            .and_then(|()| draw(&canvas))
            .and_then(|()| canvas.present().map_err(Into::into))
            .map_err(|e| ExportError::Draw {
                path: path.to_path_buf(),
                reason: e.to_string(),
            })?;
    }
    write_file(path, shown_in_pixels(&svg, size).as_bytes())
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

/// Heading of a picture of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heading<'a> {
    pub title: &'a str,
    /// Conditions below the title, in smaller letters: force, speed, friction.
    pub conditions: &'a str,
}

/// Draws the heading, centred at the top.
fn draw_heading(canvas: &Canvas, heading: Heading<'_>) -> Drawn {
    draw_title(canvas, heading.title)?;
    let style = text_style(TEXT_PX - 3, HPos::Center, VPos::Center);
    let (width, _) = canvas.dim_in_pixel();
    let place = (width as i32 / 2, HEADING_HEIGHT - at_px(24));
    canvas.draw(&Text::new(heading.conditions.to_owned(), place, &style))?;
    Ok(())
}

/// Draws the title, centred at the top.
fn draw_title(canvas: &Canvas, title: &str) -> Drawn {
    let style = text_style(TITLE_PX, HPos::Center, VPos::Center);
    let (width, _) = canvas.dim_in_pixel();
    let place = (width as i32 / 2, TITLE_HEIGHT / 2);
    canvas.draw(&Text::new(title.to_owned(), place, &style))?;
    Ok(())
}

/// Draws grid and axes in their colours, and the labels beside them.
fn draw_mesh<X, Y>(mesh: &mut MeshStyle<'_, '_, X, Y, SVGBackend<'_>>) -> Drawn
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    mesh.bold_line_style(GRID.stroke_width(px(1)))
        .axis_style(INK.stroke_width(px(1)))
        .set_all_tick_mark_size(px(5))
        .label_style(text_style(TEXT_PX, HPos::Center, VPos::Center))
        .axis_desc_style(text_style(TEXT_PX, HPos::Center, VPos::Center))
        .draw()?;
    Ok(())
}

/// Returns `true` if two boxes (left, right, top, bottom) overlap.
fn overlap(a: [i32; 4], b: [i32; 4]) -> bool {
    a[0] < b[1] && b[0] < a[1] && a[2] < b[3] && b[2] < a[3]
}

/// Prefix and factor that bring `largest` between 1 and 1000: (`k`, 1e-3) for 4.2e3.
fn si_prefix(largest: f64) -> (&'static str, f64) {
    const PREFIXES: [(f64, &str); 8] = [
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "µ"),
        (1e-9, "n"),
        (1e-12, "p"),
    ];
    let found = PREFIXES
        .iter()
        .find(|(unit, _)| largest >= *unit * 0.999_999);
    found.map_or(("", 1.0), |&(unit, name)| (name, 1.0 / unit))
}

/// Unit with the prefix that brings `largest` between 1 and 1000, and the factor to it; numbers
/// without a unit remain as they are.
pub fn in_unit(unit: &str, largest: f64) -> (String, f64) {
    match unit {
        "" => (String::new(), 1.0),
        unit => {
            let (prefix, factor) = si_prefix(largest);
            (format!("{prefix}{unit}"), factor)
        }
    }
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
            colour::of_value(fraction).filled(),
        );
        canvas.draw(&row)?;
    }
    canvas.draw(&Rectangle::new(
        [(left, top), (right, bottom)],
        INK.stroke_width(px(1)),
    ))?;
    let (ticks, step) = round_ticks(low * factor, high * factor, 6);
    let text = text_style(TEXT_PX - 3, HPos::Left, VPos::Center);
    for tick in ticks {
        let fraction = (tick / factor - low) / (high - low);
        let y = bottom - (fraction * f64::from(bottom - top)).round() as i32;
        canvas.draw(&PathElement::new(
            vec![(right, y), (right + at_px(6), y)],
            INK.stroke_width(px(1)),
        ))?;
        canvas.draw(&Text::new(
            tick_label(tick, step),
            (right + at_px(14), y),
            &text,
        ))?;
    }
    let name = text_style(TEXT_PX - 1, HPos::Left, VPos::Bottom);
    canvas.draw(&Text::new(unit, (left, top - at_px(10)), &name))?;
    Ok(())
}

/// Label of a number on an axis, with no more decimals than the step of the ticks requires.
fn tick_label(v: f64, step: f64) -> String {
    let decimals = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
    let text = format!("{v:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() {
        "0".to_owned()
    } else {
        text
    }
}

/// Ticks at 1, 2 or 5 times a power of ten, about `wanted` of them, inside [low, high], and their
/// step.
fn round_ticks(low: f64, high: f64, wanted: usize) -> (Vec<f64>, f64) {
    let raw = (high - low) / wanted.max(1) as f64;
    if !(raw > 0.0 && raw.is_finite()) {
        return (vec![low], 1.0);
    }
    let power = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|s| *s >= raw * 0.999_999);
    let step = step.unwrap_or(10.0 * power);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    ((first..=last).map(|i| i as f64 * step).collect(), step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_bring_numbers_between_1_and_1000() {
        assert_eq!(si_prefix(4.2e3).0, "k");
        assert_eq!(si_prefix(1.0).0, "");
        assert_eq!(si_prefix(3e-5).0, "µ");
        assert_eq!(si_prefix(0.0), ("", 1.0));
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let (ticks, step) = round_ticks(371.3, 384.9, 6);
        assert_eq!(step, 5.0);
        assert_eq!(ticks, [375.0, 380.0]);
        assert_eq!(round_ticks(0.0, 1.0, 5).0.len(), 6);
        assert_eq!(round_ticks(3.0, 3.0, 5).0, [3.0]);
        assert_eq!(tick_label(0.30000000000000004, 0.1), "0.3");
        assert_eq!(tick_label(-0.0, 0.1), "0");
    }
}
