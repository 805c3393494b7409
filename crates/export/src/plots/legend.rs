//! Draws the key of a chart between its title and its axes, where it covers no curve.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::{Canvas, Drawn, SMALL_PX, at_px, px, text_style, width_of};

const ROW: i32 = at_px(34);
/// Width of a mark.
const MARK: i32 = at_px(40);
/// Gaps from the mark to its words, and from the words to the next mark.
const GAPS: [i32; 2] = [at_px(10), at_px(32)];
/// Left end of the chart, and free space at its right.
const SIDES: [i32; 2] = [at_px(60), at_px(36)];

/// Mark of a series.
#[derive(Debug, Clone, Copy)]
pub(super) enum Mark {
    Line(ShapeStyle),
    Dashes(ShapeStyle),
    Dot(RGBColor),
    Ring(RGBColor),
    Cross(RGBColor),
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

    /// Height on a canvas of this width, units.
    pub fn height(&self, width: i32) -> i32 {
        let rows = self.places(width).last().map_or(0, |(_, row)| row + 1);
        ROW * rows
    }

    /// Left end and row of each entry: a row ends where the next entry does not fit.
    fn places(&self, width: i32) -> Vec<(i32, i32)> {
        let (mut left, mut row) = (SIDES[0], 0);
        let mut places = Vec::new();
        for (_, words) in &self.entries {
            let own = MARK + GAPS[0] + width_of(words, SMALL_PX);
            if left > SIDES[0] && left + own > width - SIDES[1] {
                (left, row) = (SIDES[0], row + 1);
            }
            places.push((left, row));
            left += own + GAPS[1];
        }
        places
    }

    /// Draws the rows from `top` downwards.
    pub fn draw(&self, canvas: &Canvas, top: i32) -> Drawn {
        let width = canvas.dim_in_pixel().0 as i32;
        let style = text_style(SMALL_PX, HPos::Left, VPos::Center);
        for ((mark, words), (left, row)) in self.entries.iter().zip(self.places(width)) {
            let y = top + ROW * row + ROW / 2;
            draw_mark(canvas, *mark, (left, y))?;
            let place = (left + MARK + GAPS[0], y);
            canvas.draw(&Text::new(words.clone(), place, &style))?;
        }
        Ok(())
    }
}

fn draw_mark(canvas: &Canvas, mark: Mark, (left, y): (i32, i32)) -> Drawn {
    let middle = (left + MARK / 2, y);
    let line = |from: i32, to: i32, style| {
        PathElement::new(vec![(left + at_px(from), y), (left + at_px(to), y)], style)
    };
    match mark {
        Mark::Line(style) => canvas.draw(&line(0, 39, style))?,
        Mark::Dashes(style) => {
            for from in [0, 13, 26] {
                canvas.draw(&line(from, from + 8, style))?;
            }
        }
        Mark::Dot(colour) => canvas.draw(&Circle::new(middle, px(6), colour.filled()))?,
        Mark::Ring(colour) => {
            canvas.draw(&Circle::new(middle, px(6), colour.stroke_width(px(2))))?;
        }
        Mark::Cross(colour) => {
            canvas.draw(&Cross::new(middle, px(7), colour.stroke_width(px(3))))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_that_do_not_fit_begin_another_row() {
        let mut legend = Legend::default();
        assert_eq!(legend.height(at_px(600)), 0);
        for words in ["linear", "H = 3", "a label of thirty letters or so"] {
            legend.add(Mark::Dot(BLACK), words);
        }
        assert_eq!(legend.height(at_px(1280)), ROW);
        let places = legend.places(at_px(600));
        assert_eq!(places.iter().map(|p| p.1).collect::<Vec<_>>(), [0, 0, 1]);
        assert_eq!(places[2].0, SIDES[0]);
        // A label wider than the picture has a row of its own.
        legend.add(Mark::Dot(BLACK), "x".repeat(200));
        assert_eq!(legend.height(at_px(600)), 3 * ROW);
    }
}
