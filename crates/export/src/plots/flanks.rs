//! Draws the [unrolled](crate::unrolled) flanks: a panel for each contact.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{
    Bar, Canvas, Drawn, Heading, INK, NOTHING, PX, SMALL_PX, Side, TEXT_PX, at_px, draw_bar,
    draw_marks, draw_titles, px, rgb, text_style, write_svg,
};
use crate::ExportError;
use crate::colours::{OPENS, of_value};
use crate::fields::{Field, Separation};
use crate::flank::check_pairs;
use crate::unrolled::{Panel, Patch, panels};
use crate::words::ticks;
use dovetail_solver::model::Model;

const WIDTH: i32 = at_px(1400);
const LEFT: i32 = at_px(136);
const RIGHT: i32 = at_px(224);
/// Height of the heading.
const HEADING: i32 = at_px(96);
const CAPTION: i32 = at_px(40);
/// Height of the ticks and of the name of the lower edge below a flank.
const AXIS: i32 = at_px(70);
const AXIS_NAME: i32 = at_px(40);
const TALLEST_FLANK: i32 = at_px(420);
/// Smallest height of the bar and of the legend.
const LEAST_HEIGHT: i32 = at_px(240);
/// Left end of the bar or the legend, beyond the name of an edge.
const ASIDE: i32 = WIDTH - RIGHT + at_px(50);

/// Draws a heading alone, which says why there is no field.
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_no_field(path: &Path, heading: Heading<'_>) -> Result<(), ExportError> {
    let size = (WIDTH as u32 / PX, HEADING as u32 / PX);
    write_svg(path, size, |canvas| heading.draw(canvas))
}

/// Draws the value of each pair in colour, with a bar.
///
/// # Errors
/// [`ExportError`] if there is not one finite value for each pair, or the picture cannot be drawn
/// or written.
pub fn write_field_map(
    path: &Path,
    model: &Model,
    heading: Heading<'_>,
    field: &Field,
) -> Result<(), ExportError> {
    check_pairs(path, field.title, field.values.len(), model.pairs.len())?;
    if let Some(index) = field.values.iter().position(|v| !v.is_finite()) {
        let (path, field) = (path.to_path_buf(), field.title.to_owned());
        return Err(ExportError::NotFinite { path, field, index });
    }
    let [low, high] = field.range();
    let colour = |pair: usize| rgb(of_value((field.values[pair] - low) / (high - low)));
    let layout = Layout::of(model);
    write_svg(path, layout.size(), |canvas| {
        heading.draw(canvas)?;
        layout.draw(canvas, colour, None)?;
        let bar = Bar {
            left: ASIDE,
            top: HEADING + CAPTION,
            bottom: layout.bottom().max(HEADING + LEAST_HEIGHT),
        };
        draw_bar(canvas, bar, [low, high], field.unit)
    })
}

/// Draws the pairs that open and the others in two colours, with a legend.
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_separation_map(
    path: &Path,
    model: &Model,
    conditions: &str,
    separation: &Separation,
) -> Result<(), ExportError> {
    let Separation { title, opens } = separation;
    check_pairs(path, title, opens.len(), model.pairs.len())?;
    let layout = Layout::of(model);
    let kinds = [
        (true, rgb(OPENS.colour), "opens"),
        (false, NOTHING, "never opens"),
    ];
    write_svg(path, layout.size(), |canvas| {
        Heading { title, conditions }.draw(canvas)?;
        let colour = |pair: usize| if opens[pair] { kinds[0].1 } else { kinds[1].1 };
        layout.draw(canvas, colour, Some(WHITE))?;
        for ((kind, colour, words), row) in kinds.into_iter().zip(0..) {
            let count = opens.iter().filter(|opens| **opens == kind).count();
            let y = HEADING + CAPTION + at_px(58 * row);
            let square = [(ASIDE, y), (ASIDE + at_px(22), y + at_px(22))];
            canvas.draw(&Rectangle::new(square, colour.filled()))?;
            let style = text_style(SMALL_PX, HPos::Left, VPos::Center);
            for (line, down) in [(words.to_owned(), 11), (format!("{count} pairs"), 35)] {
                let place = (ASIDE + at_px(30), y + at_px(down));
                canvas.draw(&Text::new(line, place, &style))?;
            }
        }
        Ok(())
    })
}

struct Layout {
    panels: Vec<Panel>,
    units_per_m: f64,
}

impl Layout {
    fn of(model: &Model) -> Self {
        let panels = panels(model);
        let longest = |axis: usize| {
            let sizes = panels.iter().map(|p| p.size[axis]);
            sizes.fold(f64::MIN_POSITIVE, f64::max)
        };
        let width = f64::from(WIDTH - LEFT - RIGHT);
        let units_per_m = (width / longest(0)).min(f64::from(TALLEST_FLANK) / longest(1));
        Self {
            panels,
            units_per_m,
        }
    }

    /// Length of panel `i` along an axis, units.
    fn extent(&self, i: usize, axis: usize) -> i32 {
        let units = self.panels[i].size[axis] * self.units_per_m;
        units.ceil().max(f64::from(at_px(2))) as i32
    }

    /// Top of the plotting area of panel `i`, units.
    fn top(&self, i: usize) -> i32 {
        let above: i32 = (0..i).map(|j| CAPTION + self.extent(j, 1) + AXIS).sum();
        HEADING + above + CAPTION
    }

    fn bottom(&self) -> i32 {
        let last = self.panels.len().checked_sub(1);
        last.map_or(HEADING, |i| self.top(i) + self.extent(i, 1))
    }

    /// Width and height of the picture, pixels.
    fn size(&self) -> (u32, u32) {
        let height = self.bottom().max(HEADING + LEAST_HEIGHT) + AXIS + AXIS_NAME;
        (WIDTH as u32 / PX, (height as u32).div_ceil(PX))
    }

    fn draw(
        &self,
        canvas: &Canvas,
        colour: impl Fn(usize) -> RGBColor,
        outline: Option<RGBColor>,
    ) -> Drawn {
        for (i, panel) in self.panels.iter().enumerate() {
            let (top, height, width) = (self.top(i), self.extent(i, 1), self.extent(i, 0));
            let place = |p: [f64; 2]| {
                let x = p[0] * self.units_per_m;
                let y = (panel.size[1] - p[1]) * self.units_per_m;
                (LEFT + x.round() as i32, top + y.round() as i32)
            };
            for Patch {
                pair,
                outline: corners,
            } in &panel.patches
            {
                let mut path: Vec<(i32, i32)> = corners.iter().map(|&c| place(c)).collect();
                let fill = colour(*pair);
                canvas.draw(&Polygon::new(path.clone(), fill.filled()))?;
                // The outline in the same colour closes the hairlines between patches.
                path.extend(path.first().copied());
                canvas.draw(&PathElement::new(
                    path,
                    outline.unwrap_or(fill).stroke_width(px(1)),
                ))?;
            }
            let caption = text_style(TEXT_PX, HPos::Left, VPos::Bottom);
            canvas.draw(&Text::new(
                panel.name.clone(),
                (LEFT, top - at_px(8)),
                &caption,
            ))?;
            self.axes(canvas, panel, top, width, height)?;
            draw_edges(canvas, &panel.edges, [top, width, height])?;
        }
        let middle = [
            LEFT + (WIDTH - LEFT - RIGHT) / 2,
            (self.top(0).min(self.bottom()) + self.bottom()) / 2,
        ];
        let titles = ["along the flank (mm)", "across (mm)"];
        draw_titles(canvas, titles, middle, self.bottom() + AXIS + at_px(12))
    }

    fn axes(&self, canvas: &Canvas, panel: &Panel, top: i32, width: i32, height: i32) -> Drawn {
        let bottom = top + height;
        let frame = [(LEFT, top), (LEFT + width, bottom)];
        canvas.draw(&Rectangle::new(frame, INK.stroke_width(px(1))))?;
        let marks = |length_m: f64, units: i32, between: i32, place: &dyn Fn(i32) -> i32| {
            let wanted = (units / at_px(between)).max(2) as usize;
            let offset = |mm: f64| (1e-3 * mm * self.units_per_m).round() as i32;
            let ticks = ticks(0.0, 1e3 * length_m, wanted).into_iter();
            let marks = ticks.map(|(mm, words)| (place(offset(mm)), words));
            marks.collect::<Vec<_>>()
        };
        let below = marks(panel.size[0], width, 90, &|offset| LEFT + offset);
        draw_marks(canvas, Side::Below, bottom, &below)?;
        let beside = marks(panel.size[1], height, 40, &|offset| bottom - offset);
        draw_marks(canvas, Side::Left, LEFT, &beside)
    }
}

/// Draws the names of the sides left, right, below and above of a flank with this top, width and
/// height.
fn draw_edges(canvas: &Canvas, edges: &[String; 4], [top, width, height]: [i32; 3]) -> Drawn {
    let end = LEFT + width;
    let upright = |h: HPos, v: VPos| text_style(SMALL_PX, h, v);
    let sideways = || upright(HPos::Center, VPos::Center).transform(FontTransform::Rotate270);
    let middle = top + height / 2;
    let places = [
        ((LEFT - at_px(70), middle), sideways()),
        ((end + at_px(20), middle), sideways()),
        (
            (end, top + height + at_px(36)),
            upright(HPos::Right, VPos::Top),
        ),
        ((end, top - at_px(8)), upright(HPos::Right, VPos::Bottom)),
    ];
    for (name, (place, style)) in edges.iter().zip(&places) {
        canvas.draw(&Text::new(name.clone(), *place, style))?;
    }
    Ok(())
}
