//! Draws the Campbell diagram: natural frequencies and engine orders against the speed.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::colour::of_curve;
use super::legend::{Legend, Mark, width_of};
use super::{
    Canvas, Drawn, HEADING_HEIGHT, Heading, INK, TEXT_PX, at_px, draw_heading, draw_mesh, overlap,
    px, round_ticks, text_style, tick_label, write_svg,
};
use crate::export::ExportError;

const SIZE: (u32, u32) = (1280, 900);
/// Height of a name.
const NAME_HEIGHT: i32 = at_px(18);
/// Width of a letter of a name.
const LETTER: i32 = at_px(9);
/// Free space between a line and its name.
const SPACE: i32 = at_px(6);

/// Modes of one kind over the speeds.
#[derive(Debug, Clone, PartialEq)]
pub struct CampbellFamily {
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
    pub speed_rpm: f64,
    /// Frequency of each mode at this speed, Hz, and a text with the frequency in engine orders.
    pub modes: Vec<(f64, String)>,
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
    let points = || families.iter().flat_map(|f| f.modes.iter().flatten());
    let fastest = points().map(|p| p.0).fold(0.0, f64::max);
    let fastest = if fastest > 0.0 { fastest } else { 1.0 };
    let highest = points().map(|p| p.1).fold(0.0, f64::max);
    let top = if highest > 0.0 { 1.08 * highest } else { 1.0 };
    let (_, x_step) = round_ticks(0.0, fastest, 10);
    let (_, y_step) = round_ticks(0.0, top, 8);
    draw_heading(canvas, heading)?;
    let mut legend = Legend::default();
    for (i, family) in families.iter().enumerate() {
        let style = of_curve(i).filled().stroke_width(px(3));
        let line = if family.dashed {
            Mark::Dashes
        } else {
            Mark::Line
        };
        legend.add(line(style), family.label.clone());
    }
    legend.draw(canvas, HEADING_HEIGHT)?;
    let width = canvas.dim_in_pixel().0 as i32;
    let mut chart = ChartBuilder::on(canvas)
        .margin(px(18))
        .margin_top(HEADING_HEIGHT + legend.height(width) + at_px(8))
        .margin_right(px(36))
        .x_label_area_size(px(74))
        .y_label_area_size(px(104))
        .build_cartesian_2d(0.0..1.04 * fastest, 0.0..top)?;
    draw_mesh(
        chart
            .configure_mesh()
            .x_desc("speed (rpm)")
            .y_desc("frequency (Hz)")
            .x_labels(10)
            .y_labels(8)
            .max_light_lines(0)
            .x_label_formatter(&|v| tick_label(*v, x_step))
            .y_label_formatter(&|v| tick_label(*v, y_step)),
    )?;
    let order_style = RGBColor(170, 170, 170).stroke_width(px(1));
    let orders = engine_orders(orders, fastest, top, |end| chart.backend_coord(&end));
    for EngineOrder { end, .. } in &orders {
        chart.draw_series(LineSeries::new([(0.0, 0.0), *end], order_style))?;
    }
    for EngineOrder { name, bounds, .. } in orders {
        let [left, right, above, below] = bounds;
        let middle = ((left + right) / 2, (above + below) / 2);
        // On its own line or another one a name stands on white.
        let ground = [(left, above), (right, below)];
        canvas.draw(&Rectangle::new(ground, WHITE.filled()))?;
        let style = text_style(TEXT_PX - 6, HPos::Center, VPos::Center);
        canvas.draw(&Text::new(name, middle, &style))?;
    }
    for (i, family) in families.iter().enumerate() {
        let style = of_curve(i).filled().stroke_width(px(3));
        for mode in &family.modes {
            let line = mode.iter().copied();
            if family.dashed {
                chart.draw_series(DashedLineSeries::new(line, px(9), px(6), style))?;
            } else {
                chart.draw_series(LineSeries::new(line, style).point_size(px(3)))?;
            }
        }
    }
    if (1e-9..=1.04 * fastest).contains(&operation.speed_rpm) {
        let at = |hz: f64| chart.backend_coord(&(operation.speed_rpm, hz));
        let line = PathElement::new(vec![at(0.0), at(top)], INK.stroke_width(px(1)));
        canvas.draw(&line)?;
        let (x, above) = at(top);
        for ([_, right, upper, lower], words) in at_operation(operation, x, above, |hz| at(hz).1) {
            let middle = (right, (upper + lower) / 2);
            let style = text_style(TEXT_PX - 7, HPos::Right, VPos::Center);
            canvas.draw(&Text::new(words, middle, &style))?;
        }
    }
    Ok(())
}

/// Names of the modes left of the line of the speed of operation, each above its curve and clear of
/// the names before, and the name of the line at its upper end. Returns the box (left, right, top,
/// bottom) and the text of each.
fn at_operation(
    operation: &Operation,
    x: i32,
    above: i32,
    height: impl Fn(f64) -> i32,
) -> Vec<([i32; 4], String)> {
    let half = NAME_HEIGHT / 2;
    let speed = format!("{} rpm", operation.speed_rpm.round());
    let modes = operation
        .modes
        .iter()
        .map(|(hz, words)| (height(*hz) - at_px(14), words.clone()));
    let all = std::iter::once((above + half, speed)).chain(modes);
    let mut clear: Vec<([i32; 4], String)> = Vec::new();
    for (y, words) in all {
        let right = x - SPACE;
        let bounds = [right - width_of(&words), right, y - half, y + half];
        if clear.iter().all(|(before, _)| !overlap(*before, bounds)) {
            clear.push((bounds, words));
        }
    }
    clear
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
    let mut clear: Vec<EngineOrder> = Vec::new();
    let must = orders.all_of.iter().map(|order| (order, true));
    let may = orders.with_room.iter().map(|order| (order, false));
    let may = may.filter(|(order, _)| !orders.all_of.contains(order));
    for (&order, must) in must.chain(may) {
        let name = format!("EO {order}");
        let slope = order as f64 / 60.0;
        let speed = fastest_rpm.min(top_hz / slope);
        let end = (speed, slope * speed);
        let (x, y) = place(end);
        let (width, half) = (LETTER * name.len() as i32, NAME_HEIGHT / 2);
        let at_end = if speed < fastest_rpm {
            [x - width / 2, x + width / 2, y - NAME_HEIGHT, y]
        } else {
            [x + SPACE, x + SPACE + width, y - half, y + half]
        };
        let on_line = ON_LINE.iter().filter(|_| must).map(|share| {
            let (x, y) = place((share * end.0, share * end.1));
            [x - width / 2, x + width / 2, y - half, y + half]
        });
        let is_clear = |bounds: &[i32; 4]| clear.iter().all(|c| !overlap(c.bounds, *bounds));
        let bounds = std::iter::once(at_end).chain(on_line).find(is_clear);
        // Among very many names one more lies over another.
        if let Some(bounds) = bounds.or(must.then_some(at_end)) {
            clear.push(EngineOrder { name, end, bounds });
        }
    }
    clear
}

#[cfg(test)]
mod tests {
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

    /// Text and position, pixels, of the names of engine orders.
    fn names(svg: &str) -> Vec<(String, [f64; 2])> {
        let lines: Vec<&str> = svg.lines().collect();
        let texts = lines.windows(2).filter(|l| l[1].starts_with("EO "));
        let place = |element: &str| {
            ["x", "y"].map(|name| {
                let after = element.split(&format!(" {name}=\"")).nth(1).unwrap();
                0.1 * after.split('"').next().unwrap().parse::<f64>().unwrap()
            })
        };
        texts.map(|l| (l[1].to_owned(), place(l[0]))).collect()
    }

    #[test]
    fn names_of_engine_orders_stand_clear_of_each_other() {
        for fastest in [100.0, 3000.0, 6000.0, 16_000.0, 100_000.0, 1e6] {
            let family = CampbellFamily {
                label: "blade".into(),
                modes: vec![vec![(0.0, 100.0), (fastest, 500.0)]],
                dashed: false,
            };
            let text = svg(&[family]);
            let names = names(&text);
            assert_eq!(names[0].0, "EO 1");
            // A line for each name, in the colour of the engine orders.
            assert_eq!(text.matches("stroke=\"#AAAAAA\"").count(), names.len());
            for (i, (name, [x, y])) in names.iter().enumerate() {
                assert!(*x < 1255.0 && *y > 50.0, "{name} leaves the picture");
                for (other, [u, v]) in &names[..i] {
                    let apart = (x - u).abs() >= 36.0 || (y - v).abs() >= 18.0;
                    assert!(apart, "{fastest} rpm: {name} lies over {other}");
                }
            }
        }
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
