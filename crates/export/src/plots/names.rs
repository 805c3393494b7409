//! Finds places for names beside points, where they cover nothing.

use std::ops::Range;

use super::canvas::Place;
use super::overlap;

/// Objects that a name beside a point must not cover: lines, dots, and names already placed.
#[derive(Debug, Default)]
pub(super) struct Taken {
    lines: Vec<[Place; 2]>,
    names: Vec<[f64; 4]>,
}

impl Taken {
    /// Adds a line through points.
    pub fn add_line(&mut self, points: &[Place]) {
        // A dot is as wide as a short line.
        let dots = points.iter().map(|(x, y)| [(x - 6.0, *y), (x + 6.0, *y)]);
        self.lines.extend(dots);
        self.lines.extend(points.windows(2).map(|w| [w[0], w[1]]));
    }

    /// Adds a box: left, right, top, bottom.
    pub fn add_box(&mut self, bounds: [f64; 4]) {
        self.names.push(bounds);
    }

    /// Places the name of a point: left, right, top and bottom of a box of this width and height
    /// that covers nothing, at one of these distances. Returns `None` if all places around
    /// the point are taken.
    pub fn beside(
        &mut self,
        (x, y): Place,
        (width, height): Place,
        [across, down]: [&Range<f64>; 2],
        distances: &[f64],
    ) -> Option<[f64; 4]> {
        let half = height / 2.0;
        let place = |left: f64, middle: f64| [left, left + width, middle - half, middle + half];
        let around = distances.iter().flat_map(|&far| {
            [
                place(x + far, y - far),
                place(x - far - width, y - far),
                place(x + far, y + far),
                place(x - far - width, y + far),
                place(x + far, y),
                place(x - far - width, y),
                place(x - width / 2.0, y - far - half),
                place(x - width / 2.0, y + far + half),
            ]
        });
        let is_inside = |b: &[f64; 4]| {
            across.contains(&b[0])
                && across.contains(&b[1])
                && down.contains(&b[2])
                && down.contains(&b[3])
        };
        self.first_clear(around.filter(is_inside))
    }

    /// Takes the first of these boxes that covers nothing.
    pub fn first_clear(&mut self, mut boxes: impl Iterator<Item = [f64; 4]>) -> Option<[f64; 4]> {
        let found = boxes.find(|b| {
            !self.names.iter().any(|other| overlap(*other, *b))
                && !self.lines.iter().any(|line| crosses(*line, *b))
        })?;
        self.names.push(found);
        Some(found)
    }
}

/// Returns `true` if a line crosses a box with these sides (left, right, top, bottom), by Liang and
/// Barsky's clipping.
fn crosses([from, to]: [Place; 2], [left, right, top, bottom]: [f64; 4]) -> bool {
    let [dx, dy] = [to.0 - from.0, to.1 - from.1];
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (step, room) in [
        (-dx, from.0 - left),
        (dx, right - from.0),
        (-dy, from.1 - top),
        (dy, bottom - from.1),
    ] {
        if step == 0.0 {
            if room < 0.0 {
                return false;
            }
            continue;
        }
        if step < 0.0 {
            enter = enter.max(room / step);
        } else {
            leave = leave.min(room / step);
        }
    }
    enter <= leave
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_stands_where_no_line_goes() {
        let inside = [(10.0, 10.0), (20.0, 20.0)];
        assert!(crosses(
            [(0.0, 15.0), (40.0, 15.0)],
            [10.0, 20.0, 10.0, 20.0]
        ));
        assert!(crosses(inside, [0.0, 40.0, 0.0, 40.0]));
        assert!(!crosses(
            [(0.0, 0.0), (9.0, 40.0)],
            [10.0, 20.0, 10.0, 20.0]
        ));
        assert!(!crosses([(0.0, 35.0), (35.0, 0.0)], [0.0, 10.0, 0.0, 10.0]));
        let word = (33.0, 18.0);
        let frame = [&(0.0..1000.0), &(0.0..1000.0)];
        let at = (500.0, 500.0);
        let mut taken = Taken::default();
        // A line that rises to the right: the place above at the right is taken.
        taken.add_line(&[(0.0, 1000.0), at, (1000.0, 0.0)]);
        let first = taken.beside(at, word, frame, &[12.0, 26.0]).unwrap();
        assert!(first[1] < at.0 && first[3] < at.1, "{first:?}");
        let second = taken.beside(at, word, frame, &[12.0, 26.0]).unwrap();
        assert!(!overlap(first, second));
        assert!(
            taken
                .lines
                .iter()
                .all(|l| !crosses(*l, first) && !crosses(*l, second))
        );
        // No place at all.
        let narrow = [&(490.0..510.0), &(0.0..1000.0)];
        assert_eq!(taken.beside(at, word, narrow, &[12.0]), None);
    }
}
