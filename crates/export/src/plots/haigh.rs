//! Draws a Haigh diagram: the amplitude of stress over its mean, with the lines of Goodman up to
//! which materials endure it.

use std::path::Path;

use super::axis::Axis;
use super::canvas::{Canvas, Stroke};
use super::chart::{Chart, SIZE};
use super::legend::{Legend, Mark};
use super::{PictureHeading, SMALL, svg_of, write_svg};
use crate::ExportError;
use crate::colours::{Colour, NOTHING, series_colour};
use dovetail_solver::model::Model;
use dovetail_solver::results::stress::StressCycle;
use dovetail_solver::run::PeakStress;

/// Megapascals in a pascal: both axes have the same unit.
const MPA: f64 = 1e-6;
/// Cells along each axis of which one place each is drawn: the others would cover it.
const CELLS: f64 = 60.0;

/// Content of a Haigh diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct Haigh {
    /// Mean and amplitude of the nodes that are not singular, Pa.
    pub nodes_pa: Vec<[f64; 2]>,
    /// Mean and amplitude of the ranked places, Pa, the highest first.
    pub places_pa: Vec<[f64; 2]>,
    /// Bodies of one strength, and its ultimate stress and endurance, Pa.
    pub strengths_pa: Vec<(String, [f64; 2])>,
}

impl Haigh {
    /// Diagram of the stress at a peak.
    pub fn new(model: &Model, stress: &PeakStress) -> Self {
        let point = |cycle: &StressCycle| [cycle.mean_pa, cycle.amplitude_pa];
        let bodies = stress.bodies.iter().zip(&stress.singular);
        let nodes = bodies.flat_map(|(body, singular)| body.cycles.iter().zip(singular));
        let regular = nodes.filter(|(_, singular)| singular.is_none());
        let mut strengths_pa: Vec<(String, [f64; 2])> = Vec::new();
        for (body, strength) in model.bodies.iter().zip(&stress.strengths) {
            let Some(strength) = strength else { continue };
            let own = [strength.ultimate_pa, strength.endurance_pa];
            match strengths_pa.iter_mut().find(|(_, other)| *other == own) {
                Some((names, _)) => *names += &format!(", {}", body.name),
                None => strengths_pa.push((body.name.clone(), own)),
            }
        }
        let places = stress.highest.places.iter();
        Self {
            nodes_pa: regular.map(|(cycle, _)| point(cycle)).collect(),
            places_pa: places.map(|place| point(&place.cycle)).collect(),
            strengths_pa,
        }
    }
}

/// Writes the diagram.
///
/// # Errors
/// [`ExportError`] if the picture cannot be drawn or written.
pub fn write_haigh(
    path: &Path,
    heading: PictureHeading<'_>,
    haigh: &Haigh,
) -> Result<(), ExportError> {
    write_svg(path, SIZE, |canvas| draw(canvas, heading, haigh))
}

/// Draws the diagram as an SVG.
pub(crate) fn haigh_svg(heading: PictureHeading<'_>, haigh: &Haigh) -> String {
    svg_of(SIZE, |canvas| draw(canvas, heading, haigh))
}

fn draw(canvas: &Canvas, heading: PictureHeading<'_>, haigh: &Haigh) {
    let strengths = haigh.strengths_pa.len();
    let stroke = |i: usize| Stroke::plain(series_colour(i, strengths), 3.0);
    let mut legend = Legend::default();
    legend.add(Mark::Dot(NODES), "nodes");
    legend.add(Mark::Dot(PLACES), "the highest places");
    for (i, (bodies, _)) in haigh.strengths_pa.iter().enumerate() {
        legend.add(Mark::Line(stroke(i)), format!("Goodman, {bodies}"));
    }
    let points = || haigh.nodes_pa.iter().chain(&haigh.places_pa).copied();
    // The line of a strength, level where the mean is in compression.
    let least = points().map(|p| p[0]).fold(0.0, f64::min);
    let lines = haigh.strengths_pa.iter().map(|(_, [ultimate, endurance])| {
        [[least, *endurance], [0.0, *endurance], [*ultimate, 0.0]]
    });
    let lines: Vec<[[f64; 2]; 3]> = lines.collect();
    let shown = || points().chain(lines.iter().flatten().copied());
    let axes = [
        Axis::linear("mean of the equivalent stress (MPa)").around(shown().map(|p| MPA * p[0])),
        Axis::linear("amplitude (MPa)").around(shown().map(|p| MPA * p[1]).chain([0.0])),
    ];
    let mut chart = Chart::new(canvas, heading, &legend, axes);
    let place = |chart: &Chart<'_>, p: &[f64; 2]| chart.at((MPA * p[0], MPA * p[1]));
    for node in thinned(&haigh.nodes_pa) {
        if let Some(at) = place(&chart, &node) {
            chart.dot(at, 3.0, NODES);
        }
    }
    for (i, line) in lines.iter().enumerate() {
        let line: Vec<_> = line.iter().filter_map(|p| place(&chart, p)).collect();
        chart.taken.add_line(&line);
        chart.line(&line, stroke(i));
    }
    for (i, point) in haigh.places_pa.iter().enumerate() {
        let Some(at) = place(&chart, point) else {
            continue;
        };
        chart.dot(at, 6.0, PLACES);
        chart.name(&(i + 1).to_string(), at, SMALL, &[12.0, 26.0]);
    }
}

const NODES: Colour = NOTHING;
const PLACES: Colour = [213, 94, 0];

/// One point of each cell of the area that the points span.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let ends = [0, 1].map(|k| super::ends(points.iter().map(|p| p[k])));
    let cell = |p: &[f64; 2]| {
        [0, 1].map(|k| {
            let [low, high] = ends[k];
            // A cast takes a NaN of equal ends to 0.
            ((p[k] - low) / (high - low) * CELLS) as u32
        })
    };
    let mut taken = std::collections::HashSet::new();
    let kept = points.iter().filter(|p| taken.insert(cell(p)));
    kept.copied().collect()
}
