//! Detects probable mistakes in a model: angles in radians, coefficients in per cent, an
//! axis of rotation through a blade, elements that are too stiff, free sides of a disc sector.

use std::f64::consts::PI;

use super::line::ReportLine;
use dovetail_export::warning::Weight;
use dovetail_export::words::{quantity, short};
use dovetail_mesh::{ElementOrder, ElementType, Shape};
use dovetail_solver::model::{Assembly, BodyMesh, ContactLaw, Model, Strength};
use dovetail_solver::results::around_axis::{FreeSides, bodies_on_axis, free_sides};
use dovetail_solver::run::Bound;

/// Notes and warnings about likely mistakes.
pub(super) fn lines(assembly: &Assembly, bound: &Bound) -> Vec<ReportLine> {
    let model = &bound.model;
    let doubts = stiff_elements(model)
        .into_iter()
        .chain(radians(assembly))
        .chain(axis_at_bodies(model))
        .map(|text| ReportLine::warning(Weight::Doubt, text));
    let wrong = percent_warnings(assembly)
        .chain(strengths(assembly))
        .map(|text| ReportLine::warning(Weight::Wrong, text));
    let sides = free_sides(model).map(|body| {
        ReportLine::Note(format!(
            "{}: its sides are free; if it is a sector of a disc, its neighbours hold it there: give {} on the sides, or name them in [cyclic]",
            body.name,
            key_of_sides(&body)
        ))
    });
    wrong.chain(doubts).chain(sides).collect()
}

/// Smallest share of linear tetrahedra, pyramids and wedges among the elements of a body that
/// counts.
const FEW: f64 = 0.1;

/// Name of a type of elements in the plural, with its order.
pub(super) fn element_words(element: ElementType) -> String {
    let order = match element.order {
        ElementOrder::Linear => "linear",
        ElementOrder::Quadratic => "quadratic",
    };
    let (shape, nodes) = (element.shape.plural(), element.nodes());
    format!("{order} {shape} of {nodes} nodes")
}

/// Warning about bodies of linear tetrahedra, pyramids and wedges. Linear hexahedra have
/// incompatible modes and bend freely.
fn stiff_elements(model: &Model) -> Option<String> {
    let is_stiff = |element: &ElementType| {
        element.order == ElementOrder::Linear && element.shape != Shape::Hexahedron
    };
    let stiff = model.bodies.iter().filter_map(|body| {
        let types: Vec<(ElementType, usize)> = body.elements.types().into_iter().collect();
        let stiff = types.iter().filter(|(element, _)| is_stiff(element));
        let (element, _) = stiff.clone().max_by_key(|(_, count)| *count)?;
        let count: usize = stiff.map(|(_, count)| count).sum();
        let is_many = count as f64 > FEW * body.elements.len() as f64;
        is_many.then(|| format!("`{}` ({})", body.name, element_words(*element)))
    });
    let stiff: Vec<String> = stiff.collect();
    (!stiff.is_empty()).then(|| {
        format!(
            "linear elements other than hexahedra are far too stiff in bending: frequencies are 10 % or more too high, and \
             stresses too low, in {} {}; mesh with elements of second order (Mesh.ElementOrder = 2 in a Gmsh script, \
             C3D10 or C3D15 in a deck)",
            if stiff.len() == 1 { "body" } else { "bodies" },
            stiff.join(", ")
        )
    })
}

/// Warnings about angles whose degrees are a usual angle in radians.
fn radians(assembly: &Assembly) -> Vec<String> {
    // Multiples of 15 degrees, to the digits that people write.
    let meant = |degrees: f64| {
        let steps = (degrees.abs() * 12.0 / PI).round();
        let is_near = (degrees.abs() * 12.0 / PI - steps).abs() < 2e-3;
        let is_whole = (degrees - degrees.round()).abs() < 1e-9;
        (is_near && !is_whole && (1.0..=24.0).contains(&steps))
            .then_some(15.0 * steps * degrees.signum())
    };
    let bodies = assembly.bodies.iter().filter_map(|body| match &body.mesh {
        BodyMesh::File { placement, .. } | BodyMesh::CopyOf { placement, .. } => {
            let degrees = placement.angle_rad.to_degrees();
            Some((format!("body \"{}\": rotation_deg", body.name), degrees))
        }
        BodyMesh::Shared => None,
    });
    let excitations = assembly.excitations.iter().enumerate();
    let excitations = excitations.map(|(i, excitation)| {
        let degrees = excitation.phase_rad.to_degrees();
        (format!("excitation {}: phase_deg", i + 1), degrees)
    });
    let doubtful = bodies.chain(excitations).filter_map(|(key, degrees)| {
        let meant = meant(degrees)?;
        Some(format!(
            "{key} = {} looks like radians, which would be {} degrees",
            short(degrees),
            short(meant)
        ))
    });
    doubtful.collect()
}

/// Coefficients of friction from this one on are probably in per cent, up to 100 %.
const PER_CENT: std::ops::RangeInclusive<f64> = 3.0..=100.0;

/// Warnings about coefficients of friction in per cent.
fn percent_warnings(assembly: &Assembly) -> impl Iterator<Item = String> {
    let rub = assembly.contacts.iter().filter(|contact| {
        contact.law == ContactLaw::UnilateralCoulomb && contact.friction_at.is_none()
    });
    let doubtful = rub.filter(|contact| PER_CENT.contains(&contact.pair_law.friction));
    doubtful.map(|contact| {
        let friction = contact.pair_law.friction;
        format!(
            "contact \"{}\": a coefficient of friction of {friction} looks like per cent, which would be friction = {}; dry \
             metals have 0.1 to 0.8",
            contact.name,
            short(friction / 100.0)
        )
    })
}

/// Smallest plausible strength of a metal, Pa.
const LEAST_STRENGTH_PA: f64 = 1e6;

/// Warnings about strengths in MPa.
fn strengths(assembly: &Assembly) -> impl Iterator<Item = String> {
    let known = assembly
        .bodies
        .iter()
        .filter_map(|body| Some((body, body.strength?)));
    known.filter_map(|(body, strength)| {
        let Strength {
            endurance_pa,
            ultimate_pa,
        } = strength;
        (ultimate_pa < LEAST_STRENGTH_PA).then(|| {
            format!(
                "body \"{}\": endurance_pa = {endurance_pa} and ultimate_pa = {ultimate_pa} look like MPa, which would be \
                 endurance_pa = {:e} and ultimate_pa = {:e}",
                body.name,
                1e6 * endurance_pa,
                1e6 * ultimate_pa
            )
        })
    })
}

/// Warnings about an axis of rotation that runs through a body.
fn axis_at_bodies(model: &Model) -> Vec<String> {
    let at_axis = bodies_on_axis(model).into_iter().map(|body| {
        let why = if body.in_the_middle {
            "through the middle of"
        } else {
            "through"
        };
        let outwards = if body.in_the_middle {
            ", and the centrifugal load does not throw the body outwards"
        } else {
            ""
        };
        format!(
            "the axis of rotation runs {why} body \"{}\", which is {} from it at most{outwards}: check axis and point_m of \
             [rotation], and where the body stands",
            body.name,
            quantity(body.farthest_m, "m", 3)
        )
    });
    at_axis.collect()
}

/// Key that holds the sides of a body, and words for it.
pub(super) fn key_of_sides(sides: &FreeSides<'_>) -> &'static str {
    match sides.along {
        Some(axis) => ["fixed_x", "fixed_y", "fixed_z"][axis],
        None => "supports",
    }
}
