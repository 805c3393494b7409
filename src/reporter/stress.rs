//! Warnings about the mesh error of the highest stress.

use dovetail_export::manifest::{RankedBy, Summary};
use dovetail_export::warning::{LARGE_STRESS_ERROR, Warning, accuracy_warning};
use dovetail_export::words::percent;
use dovetail_mesh::{ElementOrder, ElementType};

/// Warnings about the mesh error of the ranked places of a run.
pub(super) fn warnings(summary: &Summary) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let Some(stress) = &summary.stress else {
        return warnings;
    };
    let Some(highest) = stress.places.first() else {
        return warnings;
    };
    let types = summary
        .mesh
        .iter()
        .flat_map(|mesh| mesh.element_types.keys());
    let remedy = if types.into_iter().any(|name| is_linear(name)) {
        "refine the mesh there, or take elements of second order"
    } else {
        "refine the mesh there"
    };
    let undecided = stress.places.iter().find(|place| place.is_undecided());
    if let Some(place) = undecided {
        warnings.push(accuracy_warning(format!(
            "the mesh decides whether the strength suffices: {} of it is used, {}; {remedy}",
            place.ranked_words(RankedBy::Utilisation),
            place.at_words()
        )));
    }
    let large = stress.relative_error().filter(|e| *e > LARGE_STRESS_ERROR);
    if let Some(error) = large {
        warnings.push(accuracy_warning(format!(
            "the highest stress has an estimated mesh error of {}: {}{}, {}; {remedy}",
            percent(error, 2),
            highest.ranked_words(stress.ranked_by),
            match stress.ranked_by {
                RankedBy::Utilisation => " of the strength",
                RankedBy::Amplitude => "",
            },
            highest.at_words()
        )));
    }
    warnings
}

/// Returns `true` for the name of a type of elements of first order.
fn is_linear(name: &str) -> bool {
    let mut types = ElementType::ALL.into_iter();
    types.any(|of| of.order == ElementOrder::Linear && of.name() == name)
}
