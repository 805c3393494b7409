//! Draws natural frequencies over nodal diameters with the frequencies that engine orders have at one
//! speed (SAFE diagram: M. P. Singh et al., Proc. 17th Turbomachinery Symposium, 1988, 93-101).

use std::path::Path;

use super::axis::Axis;
use super::canvas::{Canvas, Stroke};
use super::chart::{Chart, SIZE};
use super::legend::{Legend, Mark};
use super::{PictureHeading, SMALL, write_svg};
use crate::ExportError;
use crate::colours::{Colour, series_colour};
use dovetail_solver::reduced::waves::nodal_diameter_of;
use dovetail_solver::run::NodalDiameters;

const ORDERS: Colour = [150; 3];
/// Most nodal diameters of which each has a mark on the axis.
const MOST_MARKS: usize = 20;

/// Draws the frequencies over the nodal diameters, and the line of the engine orders.
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_nodal_diameters(
    path: &Path,
    heading: PictureHeading<'_>,
    found: &NodalDiameters,
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| draw(canvas, heading, found))
}

/// Points (nodal diameter, Hz) of the engine orders from 0 on, at a speed, up to the first at or above
/// `top_hz`.
fn engine_orders(found: &NodalDiameters, top_hz: f64) -> Vec<(f64, f64)> {
    let turns_hz = found.speed_rpm / 60.0;
    let last = (top_hz / turns_hz).ceil();
    // At a speed near 0 the line would be one band of ink.
    if !(last.is_finite() && last <= 1000.0) {
        return Vec::new();
    }
    let point = |order: usize| {
        let diameter = nodal_diameter_of(order, found.sectors);
        (diameter as f64, order as f64 * turns_hz)
    };
    (0..=last as usize).map(point).collect()
}

fn draw(canvas: &Canvas, heading: PictureHeading<'_>, found: &NodalDiameters) {
    let modes = found.frequencies_hz.iter().map(Vec::len);
    let modes = modes.max().unwrap_or(0);
    let largest = found.frequencies_hz.len().saturating_sub(1);
    let highest = found.frequencies_hz.iter().flatten().copied();
    let top_hz = 1.05 * highest.fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let orders = engine_orders(found, top_hz);
    let colour = |i: usize| series_colour(i % 6, 6);
    let order_stroke = Stroke::plain(ORDERS, 2.0);
    let mut legend = Legend::default();
    for i in 0..modes {
        legend.add(Mark::Dot(colour(i)), format!("mode {}", i + 1));
    }
    if !orders.is_empty() {
        legend.add(Mark::Line(order_stroke), "engine orders");
    }
    let mut across = Axis::linear("nodal diameter");
    if largest <= MOST_MARKS {
        let mark = |d: usize| (d as f64, d.to_string());
        across.marks = (0..=largest).map(mark).collect();
    }
    // Room for dots at both ends, and for the names of engine orders.
    let beside = 0.04 * largest.max(1) as f64;
    let axes = [
        across.spanning([-beside, largest as f64 + beside]),
        Axis::linear("frequency (Hz)").spanning([0.0, top_hz]),
    ];
    let mut chart = Chart::new(canvas, heading, &legend, axes);
    // The last order lies above the diagram: its line ends where it leaves it.
    let mut line: Vec<(f64, f64)> = orders.clone();
    if let [.., (x0, y0), (x1, y1)] = line[..]
        && y1 > top_hz
    {
        let share = (top_hz - y0) / (y1 - y0);
        line.pop();
        line.push((x0 + share * (x1 - x0), top_hz));
    }
    let line: Vec<_> = line.into_iter().filter_map(|p| chart.at(p)).collect();
    if line.len() > 1 {
        chart.line(&line, order_stroke);
        chart.taken.add_line(&line);
    }
    for mode in 0..modes {
        let of_mode = found.frequencies_hz.iter().enumerate();
        let places: Vec<_> = of_mode
            .filter_map(|(d, f)| chart.at((d as f64, *f.get(mode)?)))
            .collect();
        chart.line(&places, Stroke::plain(colour(mode), 1.0));
        chart.taken.add_line(&places);
        for at in places {
            chart.dot(at, 6.0, colour(mode));
        }
    }
    for (order, point) in orders.iter().enumerate().skip(1) {
        let Some(at) = chart.at(*point).filter(|_| point.1 <= top_hz) else {
            continue;
        };
        chart.dot(at, 3.0, ORDERS);
        chart.name(&format!("EO {order}"), at, SMALL, &[10.0, 18.0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With six sectors the line of the engine orders goes up to 3 nodal diameters and back.
    #[test]
    fn engine_orders_go_to_and_fro() {
        let found = |speed_rpm| NodalDiameters::new(6, speed_rpm, vec![vec![100.0]; 4]);
        let points = engine_orders(&found(600.0), 65.0);
        let diameters: Vec<f64> = points.iter().map(|p| p.0).collect();
        assert_eq!(diameters, [0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 0.0, 1.0]);
        assert_eq!(points[7].1, 70.0);
        assert!(engine_orders(&found(0.0), 65.0).is_empty());
    }
}
