//! Drawing area of a picture, in pixels. This file alone knows the crate svg.

use std::cell::RefCell;

use svg::Document;
use svg::node::Node;
use svg::node::element::{Circle, Polygon, Polyline, Rectangle, Text};

use crate::colours::{Colour, INK};

pub(super) const WHITE: Colour = [255; 3];

/// Place in a picture, from its left and its top.
pub(super) type Place = (f64, f64);

/// Size of the letters of a text over the height of its line.
const LETTERS: f64 = 1.0 / 1.24;

/// Style of a line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stroke {
    pub colour: Colour,
    pub width: f64,
    pub dashed: bool,
}

impl Stroke {
    pub fn plain(colour: Colour, width: f64) -> Self {
        Self {
            colour,
            width,
            dashed: false,
        }
    }
}

/// Way in which an area is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) enum Paint {
    Filled(Colour),
    /// Filled with this opacity.
    Pale(Colour, f64),
    /// The outline with this width.
    Outline(Colour, f64),
}

/// Point of a text that is at its place, across: value of `text-anchor`.
pub(super) type Across = &'static str;
pub(super) const LEFT: Across = "start";
pub(super) const MIDDLE: Across = "middle";
pub(super) const RIGHT: Across = "end";

/// Point of a text that is at its place, down: value of `dy`.
pub(super) type Down = &'static str;
pub(super) const TOP: Down = "0.76em";
pub(super) const CENTRE: Down = "0.5ex";
pub(super) const BOTTOM: Down = "-0.5ex";

/// Style of a text.
#[derive(Debug, Clone, Copy)]
pub(super) struct Letters {
    /// Height of a line.
    pub height: f64,
    pub across: Across,
    pub down: Down,
    pub colour: Colour,
    /// True if the text runs upwards.
    pub turned: bool,
}

impl Letters {
    pub fn new(height: f64, across: Across, down: Down) -> Self {
        Self {
            height,
            across,
            down,
            colour: INK,
            turned: false,
        }
    }
}

/// White drawing area.
pub(super) struct Canvas {
    pub width: f64,
    drawn: RefCell<Document>,
}

impl Canvas {
    pub fn new((width, height): (f64, f64)) -> Self {
        let drawn = Document::new()
            .set("width", width)
            .set("height", height)
            .set("viewBox", (0, 0, width, height));
        let drawn = RefCell::new(drawn);
        let canvas = Self { width, drawn };
        canvas.rectangle([0.0, width, 0.0, height], Paint::Filled(WHITE));
        canvas
    }

    pub fn into_svg(self) -> String {
        self.drawn.into_inner().to_string()
    }

    pub fn line(&self, places: &[Place], stroke: Stroke) {
        let mut line = Polyline::new().set("points", points(places));
        if stroke.dashed {
            line = line.set("stroke-dasharray", "9 6");
        }
        self.draw(line, Paint::Outline(stroke.colour, stroke.width));
    }

    pub fn polygon(&self, corners: &[Place], paint: Paint) {
        self.draw(Polygon::new().set("points", points(corners)), paint);
    }

    /// Rectangle with these sides: left, right, top, bottom.
    pub fn rectangle(&self, [left, right, top, bottom]: [f64; 4], paint: Paint) {
        let rectangle = Rectangle::new()
            .set("x", number(left))
            .set("y", number(top))
            .set("width", number(right - left))
            .set("height", number(bottom - top));
        self.draw(rectangle, paint);
    }

    pub fn circle(&self, (x, y): Place, radius: f64, paint: Paint) {
        let circle = Circle::new().set("cx", number(x)).set("cy", number(y));
        self.draw(circle.set("r", number(radius)), paint);
    }

    pub fn cross(&self, (x, y): Place, colour: Colour) {
        for up in [7.0, -7.0] {
            let line = [(x - 7.0, y + up), (x + 7.0, y - up)];
            self.line(&line, Stroke::plain(colour, 3.0));
        }
    }

    pub fn text(&self, words: &str, (x, y): Place, letters: Letters) {
        if words.is_empty() {
            return;
        }
        let (x, y) = (number(x), number(y));
        let mut text = Text::new(words)
            .set("dy", letters.down)
            .set("font-family", "sans-serif")
            .set("font-size", number(LETTERS * letters.height))
            .set("text-anchor", letters.across);
        if letters.turned {
            text = text.set("transform", format!("rotate(270 {x} {y})"));
        }
        let text = text.set("x", x).set("y", y);
        self.draw(text, Paint::Filled(letters.colour));
    }

    fn draw(&self, mut shape: impl Node, paint: Paint) {
        match paint {
            Paint::Filled(colour) => shape.assign("fill", hex(colour)),
            Paint::Pale(colour, opacity) => {
                shape.assign("fill", hex(colour));
                shape.assign("opacity", opacity);
            }
            Paint::Outline(colour, width) => {
                shape.assign("fill", "none");
                shape.assign("stroke", hex(colour));
                shape.assign("stroke-width", number(width));
            }
        }
        self.drawn.borrow_mut().append(shape);
    }
}

/// Number with one decimal at most.
fn number(v: f64) -> String {
    // Without the sign of a zero.
    ((10.0 * v).round() / 10.0 + 0.0).to_string()
}

fn points(places: &[Place]) -> String {
    let pairs = places
        .iter()
        .map(|(x, y)| format!("{},{}", number(*x), number(*y)));
    pairs.collect::<Vec<_>>().join(" ")
}

fn hex([red, green, blue]: Colour) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}
