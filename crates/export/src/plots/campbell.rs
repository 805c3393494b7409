//! Draws the Campbell diagram: natural frequencies and engine orders against the speed.

use std::path::Path;

use super::canvas::{Canvas, MIDDLE, Paint, Place, RIGHT, Stroke, WHITE};
use super::chart::{Chart, SIZE};
use super::legend::{Legend, Mark};
use super::names::Taken;
use super::{Axis, PictureHeading, TEXT, width_of, write_svg};
use crate::ExportError;
use crate::colours::{Colour, INK, series_colour};

/// Height of a line of names of modes and of engine orders.
const NAME: f64 = TEXT - 7.0;
/// Half the height of a name.
const HALF: f64 = 9.0;
/// Free space between a line and its name.
const SPACE: f64 = 6.0;
/// Distances from a crossing at which the words of its peak may be placed.
const PEAK_DISTANCES: [f64; 4] = [10.0, 20.0, 34.0, 50.0];
const ORDERS: Colour = [170; 3];

/// Modes of one kind over the speeds.
#[derive(Debug, Clone, PartialEq)]
pub struct CampbellFamily {
    /// Words in the legend.
    pub label: String,
    /// Speed (rpm) and frequency (Hz) of each point of each mode; a speed without a frequency is
    /// left out.
    pub modes: Vec<Vec<(f64, f64)>>,
    /// True if the curves are dashed.
    pub dashed: bool,
}

/// Engine orders of a diagram.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct EngineOrders {
    /// Engine orders that are always drawn.
    pub all_of: Vec<usize>,
    /// Engine orders that are drawn if their names have room.
    pub with_room: Vec<usize>,
}

/// Speed at which the scene runs, and its modes there.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Operation {
    /// Speed, rpm.
    pub speed_rpm: f64,
    /// Frequency of each mode at this speed, Hz, and a text with the frequency in engine orders.
    pub modes: Vec<(f64, String)>,
    /// Speed (rpm) and frequency (Hz) of crossings, each with the amplitude of its peak in words.
    pub peaks: Vec<((f64, f64), String)>,
}

/// Draws the families and the engine orders `order * speed / 60`, with the speed of operation.
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_campbell(
    path: &Path,
    heading: PictureHeading<'_>,
    families: &[CampbellFamily],
    orders: &EngineOrders,
    operation: &Operation,
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| {
        draw(canvas, heading, families, orders, operation);
    })
}

fn draw(
    canvas: &Canvas,
    heading: PictureHeading<'_>,
    families: &[CampbellFamily],
    orders: &EngineOrders,
    operation: &Operation,
) {
    let stroke = |i: usize| Stroke {
        dashed: families[i].dashed,
        ..Stroke::plain(series_colour(i, families.len()), 3.0)
    };
    let mut legend = Legend::default();
    for (i, family) in families.iter().enumerate() {
        legend.add(Mark::Line(stroke(i)), family.label.clone());
    }
    let points = || families.iter().flat_map(|f| f.modes.iter().flatten());
    let fastest = points().map(|p| p.0).fold(0.0, f64::max);
    let highest = points().map(|p| p.1).fold(0.0, f64::max);
    let above_zero = |v: f64| if v > 0.0 { v } else { 1.0 };
    let ends = [1.04 * above_zero(fastest), 1.08 * above_zero(highest)];
    let axes = [("speed (rpm)", ends[0]), ("frequency (Hz)", ends[1])];
    let axes = axes.map(|(title, end)| Axis::linear(title).spanning([0.0, end]));
    let mut chart = Chart::new(canvas, heading, &legend, axes);
    let at = |point: (f64, f64)| chart.at(point).unwrap_or_default();
    let orders = engine_orders(orders, above_zero(fastest), ends[1], at);
    for EngineOrderLine { end, .. } in &orders {
        let line = [at((0.0, 0.0)), at(*end)];
        canvas.line(&line, Stroke::plain(ORDERS, 1.0));
    }
    // Of the names that stand before those of peaks.
    let mut boxes = Vec::new();
    for EngineOrderLine { name, bounds, .. } in orders {
        let [left, right, above, below] = bounds;
        boxes.push(bounds);
        let middle = ((left + right) / 2.0, (above + below) / 2.0);
        // On its own line or another one a name stands on white.
        canvas.rectangle(bounds, Paint::Filled(WHITE));
        chart.text(&name, middle, NAME, MIDDLE);
    }
    for (i, family) in families.iter().enumerate() {
        for mode in &family.modes {
            let places: Vec<_> = mode.iter().map(|point| at(*point)).collect();
            chart.line(&places, stroke(i));
            // The speeds that were computed; dashes would hide them.
            for at in places.into_iter().filter(|_| !family.dashed) {
                chart.dot(at, 3.0, stroke(i).colour);
            }
        }
    }
    let speed = operation.speed_rpm;
    if (1e-9..=ends[0]).contains(&speed) {
        let (x, above) = at((speed, ends[1]));
        let line = [at((speed, 0.0)), (x, above)];
        canvas.line(&line, Stroke::plain(INK, 1.0));
        let names = at_operation(operation, (x, above), |hz| at((speed, hz)).1);
        for (bounds, words) in names {
            let [_, right, upper, lower] = bounds;
            boxes.push(bounds);
            chart.text(&words, (right, (upper + lower) / 2.0), NAME, RIGHT);
        }
    }
    boxes
        .into_iter()
        .for_each(|bounds| chart.taken.add_box(bounds));
    draw_peaks(&mut chart, families, operation);
}

/// Draws a ring at each crossing that has a peak, with its words where they cover no mode.
fn draw_peaks(chart: &mut Chart, families: &[CampbellFamily], operation: &Operation) {
    if operation.peaks.is_empty() {
        return;
    }
    for mode in families.iter().flat_map(|family| &family.modes) {
        let places: Vec<_> = mode.iter().filter_map(|point| chart.at(*point)).collect();
        chart.taken.add_line(&places);
    }
    for (point, words) in &operation.peaks {
        let Some(at) = chart.at(*point) else {
            continue;
        };
        chart.ring(at, INK);
        let size = (width_of(words, NAME), 2.0 * HALF);
        if let Some(bounds) = chart.beside(at, size, &PEAK_DISTANCES) {
            let [left, right, top, bottom] = bounds;
            // On the line of an engine order a name stands on white.
            chart.canvas.rectangle(bounds, Paint::Filled(WHITE));
            let middle = ((left + right) / 2.0, (top + bottom) / 2.0);
            chart.text(words, middle, NAME, MIDDLE);
        }
    }
}

/// Names of the modes left of the line of the speed of operation, each above its curve and clear of
/// the names before, and the name of the line at its upper end. Returns the box (left, right, top,
/// bottom) and the text of each.
fn at_operation(
    operation: &Operation,
    (x, above): Place,
    height: impl Fn(f64) -> f64,
) -> Vec<([f64; 4], String)> {
    let speed = format!("{} rpm", operation.speed_rpm.round());
    let modes = operation
        .modes
        .iter()
        .map(|(hz, words)| (height(*hz) - 14.0, words.clone()));
    let all = std::iter::once((above + HALF, speed)).chain(modes);
    let mut taken = Taken::default();
    let clear = all.filter_map(|(y, words)| {
        let right = x - SPACE;
        let bounds = [right - width_of(&words, NAME), right, y - HALF, y + HALF];
        Some((taken.first_clear([bounds].into_iter())?, words))
    });
    clear.collect()
}

/// Line of an engine order.
#[derive(Debug, PartialEq)]
struct EngineOrderLine {
    name: String,
    /// End of the line (rpm, Hz): at the fastest speed, or where it leaves the diagram.
    end: (f64, f64),
    /// Left, right, top and bottom of the name: beside the end, above it, or on the line.
    bounds: [f64; 4],
}

/// Positions on the line, as shares of its length, that are tried for the name of an engine order
/// that must be drawn and has no room at the end.
const ON_LINE: [f64; 12] = [
    0.94, 0.88, 0.82, 0.76, 0.7, 0.64, 0.58, 0.52, 0.46, 0.4, 0.34, 0.28,
];

/// The engine orders that must be drawn, and those of the others whose names are clear of all names
/// before, each from the lowest. `place` maps a point of the diagram (rpm, Hz) to the canvas.
fn engine_orders(
    orders: &EngineOrders,
    fastest_rpm: f64,
    top_hz: f64,
    place: impl Fn((f64, f64)) -> Place,
) -> Vec<EngineOrderLine> {
    let mut taken = Taken::default();
    let must = orders.all_of.iter().map(|order| (order, true));
    let may = orders.with_room.iter().map(|order| (order, false));
    let may = may.filter(|(order, _)| !orders.all_of.contains(order));
    let mut line = |(&order, must): (&usize, bool)| {
        let name = format!("EO {order}");
        let slope = order as f64 / 60.0;
        let speed = fastest_rpm.min(top_hz / slope);
        let end = (speed, slope * speed);
        let (x, y) = place(end);
        let width = width_of(&name, NAME);
        let at_end = if speed < fastest_rpm {
            [x - width / 2.0, x + width / 2.0, y - 2.0 * HALF, y]
        } else {
            [x + SPACE, x + SPACE + width, y - HALF, y + HALF]
        };
        let on_line = ON_LINE.iter().filter(|_| must).map(|share| {
            let (x, y) = place((share * end.0, share * end.1));
            [x - width / 2.0, x + width / 2.0, y - HALF, y + HALF]
        });
        let clear = taken.first_clear(std::iter::once(at_end).chain(on_line));
        // Among very many names one more lies over another.
        let bounds = clear.or(must.then_some(at_end))?;
        Some(EngineOrderLine { name, end, bounds })
    };
    must.chain(may).filter_map(&mut line).collect()
}

#[cfg(test)]
mod tests {
    use super::super::overlap;
    use super::*;

    fn usual() -> EngineOrders {
        EngineOrders {
            all_of: Vec::new(),
            with_room: vec![1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 24, 36],
        }
    }

    /// The names of neighbours overlap at the ends of their lines.
    #[test]
    fn an_engine_order_that_is_asked_for_is_drawn_whatever_its_neighbours() {
        let place = |(rpm, hz): (f64, f64)| (0.012 * rpm, -1.6 * hz);
        let of = |all_of: &[usize]| EngineOrders {
            all_of: all_of.to_vec(),
            ..usual()
        };
        let named = |orders: &[EngineOrderLine]| -> Vec<String> {
            orders.iter().map(|order| order.name.clone()).collect()
        };
        let without = engine_orders(&usual(), 1e5, 500.0, place);
        assert!(!named(&without).contains(&"EO 4".to_owned()));
        let all_of: Vec<usize> = (3..12).collect();
        let with = engine_orders(&of(&all_of), 1e5, 500.0, place);
        for order in all_of {
            assert!(named(&with).contains(&format!("EO {order}")), "{order}");
        }
        for (i, a) in with.iter().enumerate() {
            assert!(
                with[..i].iter().all(|b| !overlap(a.bounds, b.bounds)),
                "{a:?}"
            );
        }
        // Each once.
        let one = with.iter().filter(|order| order.name == "EO 5");
        assert_eq!(one.count(), 1);
    }

    #[test]
    fn engine_orders_end_at_the_fastest_speed_or_at_the_top() {
        // A rpm and a Hz are 2 pixels.
        let place = |(rpm, hz): (f64, f64)| (2.0 * rpm, -2.0 * hz);
        let orders = engine_orders(&usual(), 6000.0, 500.0, place);
        let of = |name: &str| orders.iter().find(|o| o.name == name).unwrap();
        assert_eq!(of("EO 1").end, (6000.0, 100.0));
        assert_eq!(of("EO 5").end, (6000.0, 500.0));
        assert_eq!(of("EO 6").end, (5000.0, 500.0));
        // The name stands beside the end, or above it.
        assert!(of("EO 5").bounds[0] > 12_000.0 && of("EO 6").bounds[3] == -1_000.0);
    }

    fn svg(families: &[CampbellFamily]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("campbell.svg");
        let heading = PictureHeading {
            title: "t",
            conditions: "",
        };
        write_campbell(&path, heading, families, &usual(), &Operation::default()).unwrap();
        std::fs::read_to_string(&path).unwrap()
    }

    #[test]
    fn modes_at_the_speed_of_operation_are_named_clear_of_each_other() {
        let family = CampbellFamily {
            label: "assembly, stuck".into(),
            modes: vec![vec![(0.0, 100.0), (6000.0, 500.0)]],
            dashed: true,
        };
        let operation = Operation {
            speed_rpm: 5000.0,
            modes: vec![
                (430.0, "430.0 Hz, EO 5.16".to_owned()),
                (431.0, "431.0 Hz, EO 5.17".to_owned()),
                (120.0, "120.0 Hz, EO 1.44".to_owned()),
            ],
            ..Operation::default()
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("campbell.svg");
        let heading = PictureHeading {
            title: "t",
            conditions: "friction 0.3",
        };
        write_campbell(&path, heading, &[family], &usual(), &operation).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let has = |words: &str| text.lines().any(|l| l == words);
        for words in [
            "5000 rpm",
            "430.0 Hz, EO 5.16",
            "120.0 Hz, EO 1.44",
            "friction 0.3",
        ] {
            assert!(has(words), "{words}: {text}");
        }
        assert!(!has("431.0 Hz, EO 5.17"));
    }

    #[test]
    fn a_diagram_without_modes_is_still_a_picture() {
        for modes in [vec![], vec![vec![(0.0, 100.0)]]] {
            let family = CampbellFamily {
                label: "blade".into(),
                modes,
                dashed: false,
            };
            let text = svg(&[family]);
            assert!(text.contains("EO 1") && !text.contains("NaN"));
        }
    }
}
