//! Stress at the peak in summary.json.

use serde::{Deserialize, Serialize};

use super::finite;
use dovetail_solver::model::Model;
use dovetail_solver::results::stress::{Singular, StressPlace};
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
}

/// Highest stress at the peak.
pub fn stress_summary(model: &Model, stress: &PeakStress) -> StressSummary {
    let place = |place: &StressPlace| {
        let (body, node) = (&model.bodies[place.at.body], place.at.node as usize);
        PlaceSummary {
            body: body.name.clone(),
            node_tag: body.node_tags[node],
            position_m: body.nodes_m[node],
            mean_pa: place.cycle.mean_pa,
            amplitude_pa: place.cycle.amplitude_pa,
            largest_pa: place.cycle.largest_pa,
            utilisation: place.utilisation.and_then(finite),
            singular: place.singular,
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
