//! Figures of `dovetail curve` in summary.json.

use serde::{Deserialize, Serialize};

use dovetail_solver::dlft::branch::folds;
use dovetail_solver::run::ParameterCurve;

/// Figures of the motions at one frequency over a key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CurveSummary {
    /// Key whose values the curve is followed over.
    pub key: String,
    /// Frequency of the motions, Hz.
    pub frequency_hz: f64,
    /// Name of the observed displacement.
    pub observation: String,
    /// Number of motions.
    pub motions: usize,
    /// Number of branches.
    pub branches: usize,
    /// Places at which the curve folds, in the order of the branches.
    pub folds: Vec<ValueFoldSummary>,
    /// Ranges with several motions, ascending.
    pub several: Vec<SeveralSummary>,
}

/// Fold of a curve over a key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ValueFoldSummary {
    /// Value of the key.
    pub value: f64,
    /// Amplitude of the observed displacement, m.
    pub amplitude_m: f64,
}

/// Range of values with several motions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SeveralSummary {
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Value at which the largest and the smallest amplitude differ most.
    pub value: f64,
    /// Largest amplitude there, m.
    pub amplitude_m: f64,
    /// Smallest amplitude there, m.
    pub other_amplitude_m: f64,
}

/// Figures of a curve over a key.
pub fn curve_summary(key: &str, frequency_hz: f64, found: &ParameterCurve) -> CurveSummary {
    let (curve, response) = (&found.curve, &found.curve.response);
    let fold = |at: usize| ValueFoldSummary {
        value: curve.values[at],
        amplitude_m: response.orbits[at].observed_amplitude[found.observation],
    };
    let several = curve.several.iter().map(|several| SeveralSummary {
        from: several.from,
        to: several.to,
        value: several.value,
        amplitude_m: several.amplitude_m,
        other_amplitude_m: several.other_amplitude_m,
    });
    CurveSummary {
        key: key.to_owned(),
        frequency_hz,
        observation: found.reduced.observations()[found.observation].name.clone(),
        motions: response.orbits.len(),
        branches: response.branches.len(),
        folds: folds(response).into_iter().map(fold).collect(),
        several: several.collect(),
    }
}
