//! A chart: heading, legend, two axes, and what is drawn between them.

use std::ops::Range;

use super::axis::DrawnAxis;
use super::canvas::{Across, CENTRE, Canvas, LEFT, Letters, Paint, Place, Stroke, WHITE};
use super::legend::Legend;
use super::names::Taken;
use super::{GRID, PictureHeading, SMALL, Side, draw_marks, draw_titles, width_of};
use crate::colours::{Colour, INK};

/// Width and height of a picture with a chart.
pub(super) const SIZE: (f64, f64) = (1280.0, 840.0);
/// Space beside the axes: at the left without the labels, at the right, and below.
const ASIDE: [f64; 3] = [70.0, 48.0, 94.0];

/// Chart whose heading, legend and axes are drawn.
pub(super) struct Chart<'a> {
    pub canvas: &'a Canvas,
    axes: [DrawnAxis; 2],
    /// Ranges between the axes, across and down.
    pub inside: [Range<f64>; 2],
    /// Places that are taken by lines, dots and names.
    pub taken: Taken,
}

impl<'a> Chart<'a> {
    pub fn new(
        canvas: &'a Canvas,
        heading: PictureHeading<'_>,
        legend: &Legend,
        axes: [DrawnAxis; 2],
    ) -> Self {
        heading.draw(canvas);
        legend.draw(canvas, heading.height());
        let (width, height) = SIZE;
        let labels = axes[1]
            .marks
            .iter()
            .map(|(_, words)| width_of(words, SMALL));
        let across = ASIDE[0] + labels.fold(0.0, f64::max)..width - ASIDE[1];
        let down = heading.height() + legend.height(width) + 14.0..height - ASIDE[2];
        let chart = Self {
            canvas,
            axes,
            inside: [across, down],
            taken: Taken::default(),
        };
        chart.draw_axes();
        chart
    }

    fn draw_axes(&self) {
        let [across, down] = &self.inside;
        let line = |from, to, colour: Colour| {
            self.canvas.line(&[from, to], Stroke::plain(colour, 1.0));
        };
        let marks = [0, 1].map(|k| -> Vec<(f64, String)> {
            let marks = self.axes[k].marks.iter();
            marks
                .map(|(share, words)| (self.along(k, *share), words.clone()))
                .collect()
        });
        for (x, _) in &marks[0] {
            line((*x, down.start), (*x, down.end), GRID);
        }
        for (y, _) in &marks[1] {
            line((across.start, *y), (across.end, *y), GRID);
        }
        let corner = (across.start, down.end);
        line(corner, (across.end, down.end), INK);
        line(corner, (across.start, down.start), INK);
        draw_marks(self.canvas, Side::Below, down.end, &marks[0]);
        draw_marks(self.canvas, Side::Left, across.start, &marks[1]);
        let titles = self.axes.each_ref().map(|axis| axis.title.as_str());
        let middle = [across, down].map(|range| (range.start + range.end) / 2.0);
        draw_titles(self.canvas, titles, middle, down.end + 62.0);
    }

    /// Coordinate at a share of the axis across (0) or upwards (1).
    fn along(&self, axis: usize, share: f64) -> f64 {
        let Range { start, end } = self.inside[axis];
        let (from, to) = if axis == 0 {
            (start, end)
        } else {
            (end, start)
        };
        from + share * (to - from)
    }

    /// Place of a pair of values on the canvas; `None` if an axis cannot show one of them.
    pub fn at(&self, (x, y): (f64, f64)) -> Option<Place> {
        let shares = (self.axes[0].share(x)?, self.axes[1].share(y)?);
        Some((self.along(0, shares.0), self.along(1, shares.1)))
    }

    /// Place at the lower edge below a value of the axis across.
    pub fn below(&self, x: f64) -> Option<Place> {
        Some((self.along(0, self.axes[0].share(x)?), self.inside[1].end))
    }

    /// Box of this width and height beside a place, at one of these distances, that covers
    /// nothing: left, right, top and bottom. It is taken then.
    pub fn beside(&mut self, at: Place, size: Place, distances: &[f64]) -> Option<[f64; 4]> {
        let [across, down] = &self.inside;
        self.taken.beside(at, size, [across, down], distances)
    }

    /// Draws a name in a line of this height beside a place, at one of these distances, if it has a
    /// place where it covers nothing.
    pub fn name(&mut self, name: &str, at: Place, height: f64, distances: &[f64]) {
        let size = (width_of(name, height), 18.0);
        if let Some([left, _, top, bottom]) = self.beside(at, size, distances) {
            self.text(name, (left, (top + bottom) / 2.0), height, LEFT);
        }
    }

    /// Draws a line through places; one place alone is a dot.
    pub fn line(&self, places: &[Place], stroke: Stroke) {
        match places {
            [] => {}
            [alone] => self.dot(*alone, stroke.width + 1.0, stroke.colour),
            _ => self.canvas.line(places, stroke),
        }
    }

    pub fn dot(&self, at: Place, radius: f64, colour: Colour) {
        self.canvas.circle(at, radius, Paint::Filled(colour));
    }

    /// Draws a hollow ring: the line does not run through it.
    pub fn ring(&self, at: Place, colour: Colour) {
        self.dot(at, 6.0, WHITE);
        self.canvas.circle(at, 6.0, Paint::Outline(colour, 2.0));
    }

    /// Draws a text in a line of this height whose point across, in the middle of its height, is at
    /// a place.
    pub fn text(&self, words: &str, at: Place, height: f64, across: Across) {
        let letters = Letters::new(height, across, CENTRE);
        self.canvas.text(words, at, letters);
    }
}
