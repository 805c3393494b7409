//! Draws the Campbell diagram: natural frequencies and engine orders against the speed.

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::colour::of_curve;
use super::{
    Canvas, DASHED, Drawn, GRID, INK, TEXT_PX, THROUGH, TITLE_HEIGHT, draw_legend, draw_title,
    legend_line, px, round_ticks, text_style, tick_label, write_svg,
};
use crate::export::ExportError;

const SIZE: (u32, u32) = (1280, 900);
/// Engine orders drawn, as far as they reach the frequencies shown.
const ENGINE_ORDERS: [u32; 12] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 24, 36];

/// Modes of one kind over the speeds.
#[derive(Debug, Clone, PartialEq)]
pub struct CampbellFamily {
    pub label: String,
    /// Per mode: speed (rpm) and frequency (Hz); a speed without a frequency is left out.
    pub modes: Vec<Vec<(f64, f64)>>,
    /// Drawn dashed.
    pub dashed: bool,
}

/// Draws the families and the engine orders `order * speed / 60`.
///
/// # Errors
/// [`ExportError`] where the picture cannot be drawn or written.
pub fn write_campbell(
    path: &Path,
    title: &str,
    families: &[CampbellFamily],
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| draw(canvas, title, families))
}

fn draw(canvas: &Canvas, title: &str, families: &[CampbellFamily]) -> Drawn {
    let points = || families.iter().flat_map(|f| f.modes.iter().flatten());
    let fastest = points().map(|p| p.0).fold(0.0, f64::max);
    let fastest = if fastest > 0.0 { fastest } else { 1.0 };
    let highest = points().map(|p| p.1).fold(0.0, f64::max);
    let top = if highest > 0.0 { 1.08 * highest } else { 1.0 };
    let (_, x_step) = round_ticks(0.0, fastest, 10);
    let (_, y_step) = round_ticks(0.0, top, 8);
    draw_title(canvas, title)?;
    let mut chart = ChartBuilder::on(canvas)
        .margin(px(18))
        .margin_top(TITLE_HEIGHT)
        .margin_right(px(36))
        .x_label_area_size(px(74))
        .y_label_area_size(px(104))
        .build_cartesian_2d(0.0..1.04 * fastest, 0.0..top)?;
    chart
        .configure_mesh()
        .x_desc("speed (rpm)")
        .y_desc("frequency (Hz)")
        .x_labels(10)
        .y_labels(8)
        .max_light_lines(0)
        .bold_line_style(GRID.stroke_width(px(1)))
        .axis_style(INK.stroke_width(px(1)))
        .set_all_tick_mark_size(px(5))
        .label_style(text_style(TEXT_PX, HPos::Center, VPos::Center))
        .axis_desc_style(text_style(TEXT_PX, HPos::Center, VPos::Center))
        .x_label_formatter(&|v| tick_label(*v, x_step))
        .y_label_formatter(&|v| tick_label(*v, y_step))
        .draw()?;
    let order_style = RGBColor(170, 170, 170).stroke_width(px(1));
    for (label, end) in engine_order_ends(fastest, top) {
        chart.draw_series(LineSeries::new([(0.0, 0.0), end], order_style))?;
        let style = text_style(TEXT_PX - 6, HPos::Right, VPos::Bottom);
        chart.draw_series([Text::new(label, end, style)])?;
    }
    for (i, family) in families.iter().enumerate() {
        let style = of_curve(i).filled().stroke_width(px(3));
        let mut legend = Some(family.label.clone());
        for mode in &family.modes {
            let line = mode.iter().copied();
            let drawn = if family.dashed {
                chart.draw_series(DashedLineSeries::new(line, px(9), px(6), style))?
            } else {
                chart.draw_series(LineSeries::new(line, style).point_size(px(3)))?
            };
            if let Some(label) = legend.take() {
                let ends = if family.dashed { DASHED } else { THROUGH };
                drawn.label(label).legend(move |place| {
                    let [first, second, third] = legend_line(ends, style);
                    EmptyElement::at(place) + first + second + third
                });
            }
        }
    }
    draw_legend(&mut chart, SeriesLabelPosition::UpperLeft, TEXT_PX - 2)
}

/// Label and end (rpm, Hz) of the lines of the engine orders: at the fastest speed, or where they
/// leave the diagram.
fn engine_order_ends(fastest_rpm: f64, top_hz: f64) -> Vec<(String, (f64, f64))> {
    ENGINE_ORDERS
        .into_iter()
        .map(|order| {
            let slope = f64::from(order) / 60.0;
            let speed = fastest_rpm.min(top_hz / slope);
            (format!("EO {order}"), (speed, slope * speed))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::plots::at_px;
    use std::collections::BTreeSet;

    #[test]
    fn engine_orders_end_at_the_fastest_speed_or_at_the_top() {
        let ends = engine_order_ends(6000.0, 500.0);
        assert_eq!(ends[0], ("EO 1".to_string(), (6000.0, 100.0)));
        assert_eq!(ends[4], ("EO 5".to_string(), (6000.0, 500.0)));
        assert_eq!(ends[5], ("EO 6".to_string(), (5000.0, 500.0)));
    }

    fn svg(families: &[CampbellFamily]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("campbell.svg");
        write_campbell(&path, "t", families).unwrap();
        std::fs::read_to_string(&path).unwrap()
    }

    #[test]
    fn the_legend_shows_dashes() {
        for (dashed, drawn_px) in [(false, 39), (true, 24)] {
            // One point has no line: what is drawn is in the legend.
            let family = CampbellFamily {
                label: "blade".into(),
                modes: vec![vec![(0.0, 100.0)]],
                dashed,
            };
            let text = svg(&[family]);
            let lines = text
                .lines()
                .filter(|l| l.starts_with("<polyline") && l.contains("stroke=\"#0072B2\""));
            let covered: BTreeSet<i32> = lines
                .flat_map(|l| {
                    let points = l.split(" points=\"").nth(1).unwrap();
                    let x = points
                        .split(' ')
                        .filter_map(|p| p.split_once(',')?.0.parse().ok());
                    let ends: Vec<i32> = x.collect();
                    ends[0]..ends[ends.len() - 1]
                })
                .collect();
            assert_eq!(covered.len() as i32, at_px(drawn_px));
        }
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
