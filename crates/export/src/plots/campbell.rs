//! Draws the Campbell diagram: natural frequencies and engine orders against the speed.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::chart::{Chart, SIZE, Stroke};
use super::legend::Legend;
use super::names::Taken;
use super::{Axis, Canvas, Drawn, Heading, INK, TEXT_PX, at_px, px, rgb, width_of, write_svg};
use crate::ExportError;
use crate::colours::of_series;

/// Height of the letters of names of modes and of engine orders, pixels.
const NAME_PX: u32 = TEXT_PX - 7;
/// Half the height of a name.
const HALF: i32 = at_px(9);
/// Free space between a line and its name.
const SPACE: i32 = at_px(6);
/// Distances from a crossing at which the words of its peak may be placed, pixels.
const PEAK_DISTANCES: [i32; 4] = [10, 20, 34, 50];
const ORDERS: RGBColor = RGBColor(170, 170, 170);

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
    heading: Heading<'_>,
    families: &[CampbellFamily],
    orders: &EngineOrders,
    operation: &Operation,
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| {
        draw(canvas, heading, families, orders, operation)
    })
}

fn draw(
    canvas: &Canvas,
    heading: Heading<'_>,
    families: &[CampbellFamily],
    orders: &EngineOrders,
    operation: &Operation,
) -> Drawn {
    let stroke = |i: usize| Stroke {
        colour: rgb(of_series(i, families.len())),
        width: 3,
        dashed: families[i].dashed,
    };
    let mut legend = Legend::default();
    for (i, family) in families.iter().enumerate() {
        legend.add(stroke(i).mark(), family.label.clone());
    }
    let points = || families.iter().flat_map(|f| f.modes.iter().flatten());
    let fastest = points().map(|p| p.0).fold(0.0, f64::max);
    let highest = points().map(|p| p.1).fold(0.0, f64::max);
    let above_zero = |v: f64| if v > 0.0 { v } else { 1.0 };
    let ends = [1.04 * above_zero(fastest), 1.08 * above_zero(highest)];
    let axes = [("speed (rpm)", ends[0]), ("frequency (Hz)", ends[1])];
    let axes = axes.map(|(title, end)| Axis::linear(title).spanning([0.0, end]));
    let mut chart = Chart::new(canvas, heading, &legend, axes)?;
    let at = |point: (f64, f64)| chart.at(point).unwrap_or_default();
    let orders = engine_orders(orders, above_zero(fastest), ends[1], at);
    let order_line = ORDERS.stroke_width(px(1));
    for EngineOrder { end, .. } in &orders {
        let line = vec![at((0.0, 0.0)), at(*end)];
        canvas.draw(&PathElement::new(line, order_line))?;
    }
    // Of the names that stand before those of peaks.
    let mut boxes = Vec::new();
    for EngineOrder { name, bounds, .. } in orders {
        let [left, right, above, below] = bounds;
        boxes.push(bounds);
        let middle = ((left + right) / 2, (above + below) / 2);
        // On its own line or another one a name stands on white.
        let ground = [(left, above), (right, below)];
        canvas.draw(&Rectangle::new(ground, WHITE.filled()))?;
        chart.text(&name, middle, NAME_PX, HPos::Center)?;
    }
    for (i, family) in families.iter().enumerate() {
        for mode in &family.modes {
            let places: Vec<_> = mode.iter().map(|point| at(*point)).collect();
            chart.line(&places, stroke(i))?;
            // The speeds that were computed; dashes would hide them.
            for at in places.into_iter().filter(|_| !family.dashed) {
                chart.dot(at, 3, stroke(i).colour)?;
            }
        }
    }
    let speed = operation.speed_rpm;
    if (1e-9..=ends[0]).contains(&speed) {
        let (x, above) = at((speed, ends[1]));
        let line = vec![at((speed, 0.0)), (x, above)];
        canvas.draw(&PathElement::new(line, INK.stroke_width(px(1))))?;
        let names = at_operation(operation, (x, above), |hz| at((speed, hz)).1);
        for (bounds, words) in names {
            let [_, right, upper, lower] = bounds;
            boxes.push(bounds);
            chart.text(&words, (right, (upper + lower) / 2), NAME_PX, HPos::Right)?;
        }
    }
    boxes
        .into_iter()
        .for_each(|bounds| chart.taken.add_box(bounds));
    draw_peaks(&mut chart, families, operation)
}

/// Draws a ring at each crossing that has a peak, with its words where they cover no mode.
fn draw_peaks(chart: &mut Chart, families: &[CampbellFamily], operation: &Operation) -> Drawn {
    if operation.peaks.is_empty() {
        return Ok(());
    }
    for mode in families.iter().flat_map(|family| &family.modes) {
        let places: Vec<_> = mode.iter().filter_map(|point| chart.at(*point)).collect();
        chart.taken.add_line(&places);
    }
    for (point, words) in &operation.peaks {
        let Some(at) = chart.at(*point) else {
            continue;
        };
        chart.ring(at, INK)?;
        let size = (width_of(words, NAME_PX), 2 * HALF);
        if let Some([left, right, top, bottom]) = chart.beside(at, size, &PEAK_DISTANCES) {
            // On the line of an engine order a name stands on white.
            let ground = [(left, top), (right, bottom)];
            chart.canvas.draw(&Rectangle::new(ground, WHITE.filled()))?;
            let middle = ((left + right) / 2, (top + bottom) / 2);
            chart.text(words, middle, NAME_PX, HPos::Center)?;
        }
    }
    Ok(())
}

/// Names of the modes left of the line of the speed of operation, each above its curve and clear of
/// the names before, and the name of the line at its upper end. Returns the box (left, right, top,
/// bottom) and the text of each.
fn at_operation(
    operation: &Operation,
    (x, above): (i32, i32),
    height: impl Fn(f64) -> i32,
) -> Vec<([i32; 4], String)> {
    let speed = format!("{} rpm", operation.speed_rpm.round());
    let modes = operation
        .modes
        .iter()
        .map(|(hz, words)| (height(*hz) - at_px(14), words.clone()));
    let all = std::iter::once((above + HALF, speed)).chain(modes);
    let mut taken = Taken::default();
    let clear = all.filter_map(|(y, words)| {
        let right = x - SPACE;
        let bounds = [right - width_of(&words, NAME_PX), right, y - HALF, y + HALF];
        Some((taken.first_clear([bounds].into_iter())?, words))
    });
    clear.collect()
}

/// Line of an engine order.
#[derive(Debug, PartialEq)]
struct EngineOrder {
    name: String,
    /// End of the line (rpm, Hz): at the fastest speed, or where it leaves the diagram.
    end: (f64, f64),
    /// Left, right, top and bottom of the name: beside the end, above it, or on the line.
    bounds: [i32; 4],
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
    place: impl Fn((f64, f64)) -> (i32, i32),
) -> Vec<EngineOrder> {
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
        let width = width_of(&name, NAME_PX);
        let at_end = if speed < fastest_rpm {
            [x - width / 2, x + width / 2, y - 2 * HALF, y]
        } else {
            [x + SPACE, x + SPACE + width, y - HALF, y + HALF]
        };
        let on_line = ON_LINE.iter().filter(|_| must).map(|share| {
            let (x, y) = place((share * end.0, share * end.1));
            [x - width / 2, x + width / 2, y - HALF, y + HALF]
        });
        let clear = taken.first_clear(std::iter::once(at_end).chain(on_line));
        // Among very many names one more lies over another.
        let bounds = clear.or(must.then_some(at_end))?;
        Some(EngineOrder { name, end, bounds })
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
        let place = |(rpm, hz): (f64, f64)| ((0.12 * rpm) as i32, -16 * hz as i32);
        let of = |all_of: &[usize]| EngineOrders {
            all_of: all_of.to_vec(),
            ..usual()
        };
        let named = |orders: &[EngineOrder]| -> Vec<String> {
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
        let place = |(rpm, hz): (f64, f64)| (20 * rpm as i32, -20 * hz as i32);
        let orders = engine_orders(&usual(), 6000.0, 500.0, place);
        let of = |name: &str| orders.iter().find(|o| o.name == name).unwrap();
        assert_eq!(of("EO 1").end, (6000.0, 100.0));
        assert_eq!(of("EO 5").end, (6000.0, 500.0));
        assert_eq!(of("EO 6").end, (5000.0, 500.0));
        // The name stands beside the end, or above it.
        assert!(of("EO 5").bounds[0] > 120_000 && of("EO 6").bounds[3] == -10_000);
    }

    fn svg(families: &[CampbellFamily]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("campbell.svg");
        let heading = Heading {
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
        let heading = Heading {
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
