//! Draws the [unrolled](crate::unrolled) flanks: a panel for each contact.

use std::path::Path;

use super::canvas::{self, CENTRE, Canvas, Letters, MIDDLE, Paint, Stroke, WHITE};
use super::{Bar, PictureHeading, SMALL, Side, TEXT, draw_bar, draw_marks, draw_titles, write_svg};
use crate::ExportError;
use crate::colours::{Colour, INK, NOTHING, OPENS, value_colour};
use crate::fields::{Field, Separation};
use crate::flank::check_pairs;
use crate::unrolled::{Panel, Patch, panels};
use crate::words::ticks;
use dovetail_solver::model::Model;

const WIDTH: f64 = 1400.0;
const LEFT: f64 = 136.0;
const RIGHT: f64 = 224.0;
/// Height of the heading.
const HEADING: f64 = 96.0;
const CAPTION: f64 = 40.0;
/// Height of the ticks and of the name of the lower edge below a flank.
const AXIS: f64 = 70.0;
const AXIS_NAME: f64 = 40.0;
const TALLEST_FLANK: f64 = 420.0;
/// Smallest height of the bar and of the legend.
const LEAST_HEIGHT: f64 = 240.0;
/// Left end of the bar or the legend, beyond the name of an edge.
const ASIDE: f64 = WIDTH - RIGHT + 50.0;

/// Draws a heading alone, which says why there is no field.
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_no_field(path: &Path, heading: PictureHeading<'_>) -> Result<(), ExportError> {
    write_svg(path, (WIDTH, HEADING), |canvas| heading.draw(canvas))
}

/// Draws the value of each pair in colour, with a bar.
///
/// # Errors
/// [`ExportError`] if there is not one finite value for each pair, or the picture cannot be drawn
/// or written.
pub fn write_field_map(
    path: &Path,
    model: &Model,
    heading: PictureHeading<'_>,
    field: &Field,
) -> Result<(), ExportError> {
    check_pairs(path, field.title, field.values.len(), model.pairs.len())?;
    if let Some(index) = field.values.iter().position(|v| !v.is_finite()) {
        let (path, field) = (path.to_path_buf(), field.title.to_owned());
        return Err(ExportError::NotFinite { path, field, index });
    }
    let [low, high] = field.range();
    let colour = |pair: usize| value_colour((field.values[pair] - low) / (high - low));
    let layout = Layout::of(model);
    write_svg(path, layout.size(), |canvas| {
        heading.draw(canvas);
        layout.draw(canvas, colour, None);
        let bar = Bar {
            left: ASIDE,
            top: HEADING + CAPTION,
            bottom: layout.bottom().max(HEADING + LEAST_HEIGHT),
        };
        draw_bar(canvas, bar, [low, high], field.unit);
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
        (true, OPENS.colour, "opens"),
        (false, NOTHING, "never opens"),
    ];
    write_svg(path, layout.size(), |canvas| {
        PictureHeading { title, conditions }.draw(canvas);
        let colour = |pair: usize| if opens[pair] { kinds[0].1 } else { kinds[1].1 };
        layout.draw(canvas, colour, Some(WHITE));
        for (row, (kind, colour, words)) in kinds.into_iter().enumerate() {
            let count = opens.iter().filter(|opens| **opens == kind).count();
            let y = HEADING + CAPTION + 58.0 * row as f64;
            let square = [ASIDE, ASIDE + 22.0, y, y + 22.0];
            canvas.rectangle(square, Paint::Filled(colour));
            let letters = Letters::new(SMALL, canvas::LEFT, CENTRE);
            canvas.text(words, (ASIDE + 30.0, y + 11.0), letters);
            canvas.text(&format!("{count} pairs"), (ASIDE + 30.0, y + 35.0), letters);
        }
    })
}

struct Layout {
    panels: Vec<Panel>,
    pixels_per_m: f64,
}

impl Layout {
    fn of(model: &Model) -> Self {
        let panels = panels(model);
        let longest = |axis: usize| {
            let sizes = panels.iter().map(|p| p.size[axis]);
            sizes.fold(f64::MIN_POSITIVE, f64::max)
        };
        let width = WIDTH - LEFT - RIGHT;
        let pixels_per_m = (width / longest(0)).min(TALLEST_FLANK / longest(1));
        Self {
            panels,
            pixels_per_m,
        }
    }

    /// Length of panel `i` along an axis.
    fn extent(&self, i: usize, axis: usize) -> f64 {
        (self.panels[i].size[axis] * self.pixels_per_m).max(2.0)
    }

    /// Top of the plotting area of panel `i`.
    fn top(&self, i: usize) -> f64 {
        let above: f64 = (0..i).map(|j| CAPTION + self.extent(j, 1) + AXIS).sum();
        HEADING + above + CAPTION
    }

    fn bottom(&self) -> f64 {
        let last = self.panels.len().checked_sub(1);
        last.map_or(HEADING, |i| self.top(i) + self.extent(i, 1))
    }

    /// Width and height of the picture.
    fn size(&self) -> (f64, f64) {
        let height = self.bottom().max(HEADING + LEAST_HEIGHT) + AXIS + AXIS_NAME;
        (WIDTH, height.ceil())
    }

    fn draw(&self, canvas: &Canvas, colour: impl Fn(usize) -> Colour, outline: Option<Colour>) {
        for (i, panel) in self.panels.iter().enumerate() {
            let (top, height, width) = (self.top(i), self.extent(i, 1), self.extent(i, 0));
            let place = |p: [f64; 2]| {
                let x = p[0] * self.pixels_per_m;
                let y = (panel.size[1] - p[1]) * self.pixels_per_m;
                (LEFT + x, top + y)
            };
            for Patch {
                pair,
                outline: corners,
            } in &panel.patches
            {
                let mut path: Vec<_> = corners.iter().map(|&c| place(c)).collect();
                let fill = colour(*pair);
                canvas.polygon(&path, Paint::Filled(fill));
                // The outline in the same colour closes the hairlines between patches.
                path.extend(path.first().copied());
                canvas.line(&path, Stroke::plain(outline.unwrap_or(fill), 1.0));
            }
            let caption = Letters::new(TEXT, canvas::LEFT, canvas::BOTTOM);
            canvas.text(&panel.name, (LEFT, top - 8.0), caption);
            self.axes(canvas, panel, [top, width, height]);
            draw_edges(canvas, &panel.edges, [top, width, height]);
        }
        let middle = [
            LEFT + (WIDTH - LEFT - RIGHT) / 2.0,
            (self.top(0).min(self.bottom()) + self.bottom()) / 2.0,
        ];
        let titles = ["along the flank (mm)", "across (mm)"];
        draw_titles(canvas, titles, middle, self.bottom() + AXIS + 12.0);
    }

    fn axes(&self, canvas: &Canvas, panel: &Panel, [top, width, height]: [f64; 3]) {
        let bottom = top + height;
        let frame = [LEFT, LEFT + width, top, bottom];
        canvas.rectangle(frame, Paint::Outline(INK, 1.0));
        let marks = |length_m: f64, length: f64, between: f64, place: &dyn Fn(f64) -> f64| {
            let wanted = ((length / between) as usize).max(2);
            let offset = |mm: f64| 1e-3 * mm * self.pixels_per_m;
            let ticks = ticks(0.0, 1e3 * length_m, wanted).into_iter();
            let marks = ticks.map(|(mm, words)| (place(offset(mm)), words));
            marks.collect::<Vec<_>>()
        };
        let below = marks(panel.size[0], width, 90.0, &|offset| LEFT + offset);
        draw_marks(canvas, Side::Below, bottom, &below);
        let beside = marks(panel.size[1], height, 40.0, &|offset| bottom - offset);
        draw_marks(canvas, Side::Left, LEFT, &beside);
    }
}

/// Draws the names of the sides left, right, below and above of a flank with this top, width and
/// height.
fn draw_edges(canvas: &Canvas, edges: &[String; 4], [top, width, height]: [f64; 3]) {
    let end = LEFT + width;
    let upright = |across, down| Letters::new(SMALL, across, down);
    let sideways = Letters {
        turned: true,
        ..upright(MIDDLE, CENTRE)
    };
    let middle = top + height / 2.0;
    let below = top + height + 36.0;
    let places = [
        ((LEFT - 70.0, middle), sideways),
        ((end + 20.0, middle), sideways),
        ((end, below), upright(canvas::RIGHT, canvas::TOP)),
        ((end, top - 8.0), upright(canvas::RIGHT, canvas::BOTTOM)),
    ];
    for (name, (place, letters)) in edges.iter().zip(places) {
        canvas.text(name, place, letters);
    }
}
