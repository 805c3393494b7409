//! Draws the key of a chart between its title and its axes, where it covers no curve.

use super::canvas::{CENTRE, Canvas, LEFT, Letters, Paint, Place, Stroke};
use super::{SMALL, width_of};
use crate::colours::Colour;

const ROW: f64 = 34.0;
/// Width of a mark.
const MARK: f64 = 40.0;
/// Gaps from the mark to its words, and from the words to the next mark.
const GAPS: [f64; 2] = [10.0, 32.0];
/// Left end of the chart, and free space at its right.
const SIDES: [f64; 2] = [60.0, 36.0];

/// Mark of a series.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mark {
    Line(Stroke),
    Dot(Colour),
    Ring(Colour),
    Cross(Colour),
    Band(Paint),
}

/// Paint of an area of this colour under curves.
pub(super) fn band(colour: Colour) -> Paint {
    Paint::Pale(colour, 0.25)
}

/// Marks and their words, in rows.
#[derive(Debug, Default)]
pub(super) struct Legend {
    entries: Vec<(Mark, String)>,
}

impl Legend {
    pub fn add(&mut self, mark: Mark, words: impl Into<String>) {
        self.entries.push((mark, words.into()));
    }

    /// Height on a canvas of this width.
    pub fn height(&self, width: f64) -> f64 {
        let rows = self.places(width).last().map_or(0.0, |(_, row)| row + 1.0);
        ROW * rows
    }

    /// Left end and row of each entry: a row ends where the next entry does not fit.
    fn places(&self, width: f64) -> Vec<Place> {
        let (mut left, mut row) = (SIDES[0], 0.0);
        let mut places = Vec::new();
        for (_, words) in &self.entries {
            let own = MARK + GAPS[0] + width_of(words, SMALL);
            if left > SIDES[0] && left + own > width - SIDES[1] {
                (left, row) = (SIDES[0], row + 1.0);
            }
            places.push((left, row));
            left += own + GAPS[1];
        }
        places
    }

    /// Draws the rows from `top` downwards.
    pub fn draw(&self, canvas: &Canvas, top: f64) {
        let letters = Letters::new(SMALL, LEFT, CENTRE);
        for ((mark, words), (left, row)) in self.entries.iter().zip(self.places(canvas.width)) {
            let y = top + ROW * row + ROW / 2.0;
            draw_mark(canvas, *mark, (left, y));
            canvas.text(words, (left + MARK + GAPS[0], y), letters);
        }
    }
}

fn draw_mark(canvas: &Canvas, mark: Mark, (left, y): Place) {
    let middle = (left + MARK / 2.0, y);
    match mark {
        Mark::Line(stroke) => canvas.line(&[(left, y), (left + 39.0, y)], stroke),
        Mark::Dot(colour) => canvas.circle(middle, 6.0, Paint::Filled(colour)),
        Mark::Ring(colour) => canvas.circle(middle, 6.0, Paint::Outline(colour, 2.0)),
        Mark::Cross(colour) => canvas.cross(middle, colour),
        Mark::Band(paint) => {
            canvas.rectangle([left, left + 39.0, y - 8.0, y + 8.0], paint);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_that_do_not_fit_begin_another_row() {
        let mut legend = Legend::default();
        assert_eq!(legend.height(600.0), 0.0);
        for words in ["linear", "H = 3", "a label of thirty letters or so"] {
            legend.add(Mark::Dot([0; 3]), words);
        }
        assert_eq!(legend.height(1280.0), ROW);
        let places = legend.places(600.0);
        assert_eq!(
            places.iter().map(|p| p.1).collect::<Vec<_>>(),
            [0.0, 0.0, 1.0]
        );
        assert_eq!(places[2].0, SIDES[0]);
        // A label wider than the picture has a row of its own.
        legend.add(Mark::Dot([0; 3]), "x".repeat(200));
        assert_eq!(legend.height(600.0), 3.0 * ROW);
    }
}
