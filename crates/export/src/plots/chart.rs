//! A chart: heading, legend, two axes, and what is drawn between them.

use std::ops::Range;

use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::axis::DrawnAxis;
use super::legend::{Legend, Mark};
use super::names::Taken;
use super::{
    Canvas, Drawn, GRID, Heading, INK, SMALL_PX, Side, at_px, draw_marks, draw_titles, px,
    text_style, width_of,
};

/// Width and height of a picture with a chart, pixels.
pub(super) const SIZE: (u32, u32) = (1280, 840);
/// Space beside the axes: at the left without the labels, at the right, and below.
const ASIDE: [i32; 3] = [at_px(70), at_px(48), at_px(94)];

/// Style of a line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stroke {
    pub colour: RGBColor,
    /// Width, pixels.
    pub width: u32,
    pub dashed: bool,
}

impl Stroke {
    pub fn style(self) -> ShapeStyle {
        self.colour.stroke_width(px(self.width))
    }

    /// Mark of such a line in a legend.
    pub fn mark(self) -> Mark {
        if self.dashed {
            Mark::Dashes(self.style())
        } else {
            Mark::Line(self.style())
        }
    }
}

/// Chart whose heading, legend and axes are drawn.
pub(super) struct Chart<'a, 'b> {
    pub canvas: &'a Canvas<'b>,
    axes: [DrawnAxis; 2],
    /// Ranges between the axes, across and down.
    pub inside: [Range<i32>; 2],
    /// Places that are taken by lines, dots and names.
    pub taken: Taken,
}

impl<'a, 'b> Chart<'a, 'b> {
    pub fn new(
        canvas: &'a Canvas<'b>,
        heading: Heading<'_>,
        legend: &Legend,
        axes: [DrawnAxis; 2],
    ) -> Drawn<Self> {
        heading.draw(canvas)?;
        legend.draw(canvas, heading.height())?;
        let (width, height) = canvas.dim_in_pixel();
        let [width, height] = [width as i32, height as i32];
        let labels = axes[1]
            .marks
            .iter()
            .map(|(_, words)| width_of(words, SMALL_PX));
        let across = ASIDE[0] + labels.max().unwrap_or(0)..width - ASIDE[1];
        let down = heading.height() + legend.height(width) + at_px(14)..height - ASIDE[2];
        let chart = Self {
            canvas,
            axes,
            inside: [across, down],
            taken: Taken::default(),
        };
        chart.draw_axes()?;
        Ok(chart)
    }

    fn draw_axes(&self) -> Drawn {
        let [across, down] = &self.inside;
        let line = |from, to, colour: RGBColor| {
            let line = PathElement::new(vec![from, to], colour.stroke_width(px(1)));
            self.canvas.draw(&line)
        };
        let marks = [0, 1].map(|k| -> Vec<(i32, String)> {
            let marks = self.axes[k].marks.iter();
            marks
                .map(|(share, words)| (self.along(k, *share), words.clone()))
                .collect()
        });
        for (x, _) in &marks[0] {
            line((*x, down.start), (*x, down.end), GRID)?;
        }
        for (y, _) in &marks[1] {
            line((across.start, *y), (across.end, *y), GRID)?;
        }
        let corner = (across.start, down.end);
        line(corner, (across.end, down.end), INK)?;
        line(corner, (across.start, down.start), INK)?;
        draw_marks(self.canvas, Side::Below, down.end, &marks[0])?;
        draw_marks(self.canvas, Side::Left, across.start, &marks[1])?;
        let titles = self.axes.each_ref().map(|axis| axis.title.as_str());
        let middle = [across, down].map(|range| (range.start + range.end) / 2);
        draw_titles(self.canvas, titles, middle, down.end + at_px(62))
    }

    /// Coordinate on the canvas at a share of the axis across (0) or upwards (1).
    fn along(&self, axis: usize, share: f64) -> i32 {
        let Range { start, end } = self.inside[axis];
        let (from, to) = if axis == 0 {
            (start, end)
        } else {
            (end, start)
        };
        from + (share * f64::from(to - from)).round() as i32
    }

    /// Place of a pair of values on the canvas; `None` if an axis cannot show one of them.
    pub fn at(&self, (x, y): (f64, f64)) -> Option<(i32, i32)> {
        let shares = (self.axes[0].share(x)?, self.axes[1].share(y)?);
        Some((self.along(0, shares.0), self.along(1, shares.1)))
    }

    /// Place at the lower edge below a value of the axis across.
    pub fn below(&self, x: f64) -> Option<(i32, i32)> {
        Some((self.along(0, self.axes[0].share(x)?), self.inside[1].end))
    }

    /// Box of this width and height beside a place, at one of these distances, pixels, that covers
    /// nothing: left, right, top and bottom. It is taken then.
    pub fn beside(
        &mut self,
        at: (i32, i32),
        size: (i32, i32),
        distances: &[i32],
    ) -> Option<[i32; 4]> {
        let [across, down] = &self.inside;
        self.taken.beside(at, size, [across, down], distances)
    }

    /// Draws a line through places on the canvas; one place alone is a dot.
    pub fn line(&self, places: &[(i32, i32)], stroke: Stroke) -> Drawn {
        let path = places.to_vec();
        match places {
            [] => {}
            [alone] => self.dot(*alone, stroke.width + 1, stroke.colour)?,
            _ if stroke.dashed => {
                let dashes = DashedPathElement::new(path, px(9), px(6), stroke.style());
                self.canvas.draw(&dashes)?;
            }
            _ => self.canvas.draw(&PathElement::new(path, stroke.style()))?,
        }
        Ok(())
    }

    pub fn dot(&self, at: (i32, i32), radius: u32, colour: RGBColor) -> Drawn {
        Ok(self
            .canvas
            .draw(&Circle::new(at, px(radius), colour.filled()))?)
    }

    /// Draws a hollow ring: the line does not run through it.
    pub fn ring(&self, at: (i32, i32), colour: RGBColor) -> Drawn {
        self.dot(at, 6, WHITE)?;
        let ring = Circle::new(at, px(6), colour.stroke_width(px(2)));
        Ok(self.canvas.draw(&ring)?)
    }

    pub fn cross(&self, at: (i32, i32), colour: RGBColor) -> Drawn {
        let cross = Cross::new(at, px(7), colour.stroke_width(px(3)));
        Ok(self.canvas.draw(&cross)?)
    }

    /// Draws a text of this size in pixels whose point at (h, middle) is at a place.
    pub fn text(&self, words: &str, at: (i32, i32), pixels: u32, h: HPos) -> Drawn {
        let style = text_style(pixels, h, VPos::Center);
        Ok(self.canvas.draw(&Text::new(words.to_owned(), at, &style))?)
    }
}
