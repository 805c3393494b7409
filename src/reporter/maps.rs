//! Reports how fields at points in space were mapped to the surfaces that they act on.

use super::line::ReportLine;
use dovetail_export::warning::Weight;
use dovetail_export::words::{counted, percent, quantity, vector};
use dovetail_solver::model::{FieldMap, Model};

/// Relative error above which a field counts as rough: of the pressures from those of their
/// neighbours, or of the sum from that of half of the points.
const ROUGH: f64 = 0.3;

/// Adds a note on each field, and the warnings about it.
pub(super) fn report_maps(model: &Model, lines: &mut Vec<ReportLine>) {
    for map in &model.maps {
        lines.push(ReportLine::Note(note(map)));
        let doubts = doubts(map).into_iter();
        lines.extend(doubts.map(|doubt| ReportLine::warning(Weight::Doubt, doubt)));
    }
}

fn note(map: &FieldMap) -> String {
    let mut parts = vec![format!(
        "{} on `{}`: {}, at most {} from it",
        map.field,
        map.surface,
        counted(map.points, "point", "points"),
        quantity(map.largest_distance_m, "m", 2)
    )];
    match &map.given_n {
        Some(given) => parts.push(format!(
            "the forces given are {} N in all, those applied {} N",
            complex(given),
            complex(&map.applied_n)
        )),
        None => {
            let mut sum = format!("the force is {} N in all", complex(&map.applied_n));
            if let Some(error) = map.sum_error_n {
                sum += &format!(
                    " (half of the points gives one that differs by {})",
                    quantity(error, "N", 2)
                );
            }
            parts.push(sum);
        }
    }
    if let Some(error) = map.moment_error {
        parts.push(format!("its moment errs by {error:.0e}"));
    }
    if let Some(error) = map.interpolation_error {
        parts.push(format!(
            "between points pressures err by about {}",
            percent(error, 2)
        ));
    }
    parts.join(", ")
}

/// Complex vector, such as `(1, 2, 3)`, with an imaginary part `(1, 2, 3) + i (4, 5, 6)`.
fn complex([re, im]: &[[f64; 3]; 2]) -> String {
    let vector = |v: &[f64; 3]| vector(*v, 4);
    if *im == [0.0; 3] {
        vector(re)
    } else {
        format!("{} + i {}", vector(re), vector(im))
    }
}

fn doubts(map: &FieldMap) -> Vec<String> {
    let mut doubts = Vec::new();
    if map.far_points > 0 {
        doubts.push(format!(
            "{}: {} of {} are farther from `{}` than its facets are long, the farthest {}: each acts on the nearest facet; \
             look whether the points belong to this surface, and at their unit and frame",
            map.field,
            map.far_points,
            counted(map.points, "point", "points"),
            map.surface,
            quantity(map.largest_distance_m, "m", 3)
        ));
    }
    if map.empty_facets > 0 {
        doubts.push(format!(
            "{}: no point is near {} of {} of `{}`: the pressure there is that of the nearest points",
            map.field,
            map.empty_facets,
            counted(map.facets, "facet", "facets"),
            map.surface
        ));
    }
    if map.given_n.is_none() && map.interpolation_error.is_none() {
        doubts.push(format!(
            "{}: {} without areas are too few to tell how much the pressures between them err, {} are needed: give more, \
             or the area of each (area_m2)",
            map.field,
            counted(map.points, "point", "points"),
            FieldMap::LEAST_POINTS
        ));
    }
    let squares = map.applied_n.iter().flatten().map(|f| f * f);
    let size_n = squares.sum::<f64>().sqrt();
    if let Some(error) = map.sum_error_n.filter(|error| *error > ROUGH * size_n) {
        doubts.push(format!(
            "{}: the force on `{}` is {} in all, and half of the points gives one that differs by {}: the points are too \
             coarse for its sum",
            map.field,
            map.surface,
            quantity(size_n, "N", 3),
            quantity(error, "N", 2)
        ));
    }
    if let Some(error) = map.interpolation_error.filter(|error| *error > ROUGH) {
        doubts.push(format!(
            "{}: the pressures differ by {} from those that the points around them give: they change faster than the \
             points resolve, or points of both sides of a thin body are mixed",
            map.field,
            percent(error, 2)
        ));
    }
    doubts
}
