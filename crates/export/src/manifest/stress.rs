//! Stress at the peak in summary.json.

use serde::{Deserialize, Serialize};

use super::finite;
use crate::words::{percent_with_error, quantity_with_error};
use dovetail_solver::model::Model;
use dovetail_solver::results::stress::{Singular, StressError, StressPlace};
use dovetail_solver::run::PeakStress;

/// Highest stress at the peak.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StressSummary {
    /// Figure by which the places are ranked.
    pub ranked_by: RankedBy,
    /// Highest places that are not singular, the highest first.
    pub places: Vec<PlaceSummary>,
    /// Highest place of each reason for which a stress is a number of the mesh, the highest first.
    pub singular: Vec<PlaceSummary>,
    /// Largest change of the amplitude of a place where the upper half of the stuck modes is left
    /// out, over the largest amplitude of the places; `None` without places.
    pub modes_share: Option<f64>,
}

/// Figure by which places with a high stress are ranked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RankedBy {
    /// Amplitude over endurance and mean over ultimate strength.
    Utilisation,
    /// Amplitude of the stress.
    Amplitude,
}

/// Place with a high stress.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceSummary {
    /// Name of the body.
    pub body: String,
    /// Tag of the node in the mesh file.
    pub node_tag: u64,
    /// Position of the node, m.
    pub position_m: [f64; 3],
    /// Equivalent of the mean stress, negative in compression.
    pub mean_pa: f64,
    /// Equivalent amplitude of the stress, Pa.
    pub amplitude_pa: f64,
    /// Largest equivalent stress of the period.
    pub largest_pa: f64,
    /// Amplitude over endurance and mean over ultimate strength; `None` without a strength.
    pub utilisation: Option<f64>,
    /// Reason why the stress is a number of the mesh; `None` elsewhere.
    pub singular: Option<Singular>,
    /// Estimated mesh error of `mean_pa`, Pa; `None` if it is not known, as of the others.
    #[serde(default)]
    pub mean_error_pa: Option<f64>,
    /// Estimated mesh error of `amplitude_pa`, Pa.
    #[serde(default)]
    pub amplitude_error_pa: Option<f64>,
    /// Estimated mesh error of `largest_pa`, Pa.
    #[serde(default)]
    pub largest_error_pa: Option<f64>,
    /// Estimated mesh error of `utilisation`.
    #[serde(default)]
    pub utilisation_error: Option<f64>,
}

impl PlaceSummary {
    /// Figure by which the place is ranked, and its estimated mesh error.
    pub fn ranked(&self, by: RankedBy) -> (f64, Option<f64>) {
        match (by, self.utilisation) {
            (RankedBy::Utilisation, Some(utilisation)) => (utilisation, self.utilisation_error),
            _ => (self.amplitude_pa, self.amplitude_error_pa),
        }
    }

    /// Text of the use of the strength, or of the amplitude, with its error.
    pub fn ranked_words(&self, by: RankedBy) -> String {
        match (by, self.utilisation) {
            (RankedBy::Utilisation, Some(utilisation)) => {
                percent_with_error(utilisation, self.utilisation_error)
            }
            _ => quantity_with_error(self.amplitude_pa, self.amplitude_error_pa, "Pa"),
        }
    }

    /// Body and node in words: `body blade, node 12`.
    pub fn at_words(&self) -> String {
        format!("body {}, node {}", self.body, self.node_tag)
    }

    /// Returns `true` if the mesh decides whether the use of the strength exceeds 1.
    pub fn is_undecided(&self) -> bool {
        let use_and_error = self.utilisation.zip(self.utilisation_error);
        use_and_error.is_some_and(|(utilisation, error)| (utilisation - 1.0).abs() < error)
    }
}

impl StressSummary {
    /// Estimated mesh error of the highest place, relative to the figure by which it is ranked;
    /// `None` without a place, or if it is not known.
    pub fn relative_error(&self) -> Option<f64> {
        let (figure, error) = self.places.first()?.ranked(self.ranked_by);
        error.map(|error| error / figure).filter(|e| e.is_finite())
    }
}

/// Highest stress at the peak.
pub fn stress_summary(model: &Model, stress: &PeakStress) -> StressSummary {
    let place = |place: &StressPlace| {
        let (body, node) = (&model.bodies[place.at.body], place.at.node as usize);
        let error = |of: fn(&StressError) -> Option<f64>| {
            place.error.as_ref().and_then(of).and_then(finite)
        };
        PlaceSummary {
            body: body.name.clone(),
            node_tag: body.node_tags[node],
            position_m: body.nodes_m[node],
            mean_pa: place.cycle.mean_pa,
            amplitude_pa: place.cycle.amplitude_pa,
            largest_pa: place.cycle.largest_pa,
            utilisation: place.utilisation.and_then(finite),
            singular: place.singular,
            mean_error_pa: error(|e| Some(e.mean_pa)),
            amplitude_error_pa: error(|e| Some(e.amplitude_pa)),
            largest_error_pa: error(|e| Some(e.largest_pa)),
            utilisation_error: error(|e| e.utilisation),
        }
    };
    StressSummary {
        ranked_by: if stress.by_utilisation {
            RankedBy::Utilisation
        } else {
            RankedBy::Amplitude
        },
        places: stress.highest.places.iter().map(place).collect(),
        singular: stress.highest.singular.iter().map(place).collect(),
        modes_share: stress.modes_share.and_then(finite),
    }
}
