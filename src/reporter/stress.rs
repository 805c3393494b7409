//! Warnings about the mesh error of the highest stress.

use dovetail_export::manifest::{RankedBy, StressSummary};
use dovetail_export::warning::{LARGE_STRESS_ERROR, Warning, accuracy_warning};
use dovetail_export::words::percent;

/// Remedy of a mesh error.
const REMEDY: &str = "refine the mesh there, or take elements of second order";

/// Warnings about the mesh error of the ranked places.
pub(super) fn warnings(stress: &StressSummary) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let Some(highest) = stress.places.first() else {
        return warnings;
    };
    let undecided = stress.places.iter().find(|place| place.is_undecided());
    if let Some(place) = undecided {
        warnings.push(accuracy_warning(format!(
            "the mesh decides whether the strength suffices: {} of it is used, {}; {REMEDY}",
            place.ranked_words(RankedBy::Utilisation),
            place.at_words()
        )));
    }
    let large = stress.relative_error().filter(|e| *e > LARGE_STRESS_ERROR);
    if let Some(error) = large {
        warnings.push(accuracy_warning(format!(
            "the highest stress has an estimated mesh error of {}: {}{}, {}; {REMEDY}",
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
