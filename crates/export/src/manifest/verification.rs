//! Comparison of harmonic balance with time integration in summary.json.

use serde::{Deserialize, Serialize};

use super::finite;
use dovetail_solver::integration::compare::{Comparison, PeriodFigures};

/// Comparison of harmonic balance with time integration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VerificationSummary {
    /// Number of time steps in a period.
    pub steps_per_period: usize,
    /// Largest relative difference that passes.
    pub tolerance: f64,
    /// Largest relative difference; `None` without a comparison.
    pub worst_difference: Option<f64>,
    /// Comparison at each frequency.
    pub points: Vec<VerifiedPoint>,
}

/// Comparison at one frequency. Differences are harmonic balance less integration, over integration
/// (works: over the input work).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VerifiedPoint {
    pub frequency_hz: f64,
    pub harmonics: usize,
    /// False for a motion that is unstable by its multipliers, or by its place between two folds.
    pub stable: bool,
    pub periods: usize,
    pub steady: bool,
    /// Estimated rest of the transient, relative to the amplitude.
    pub transient_left: Option<f64>,
    pub balance: VerifiedFigures,
    pub integration: VerifiedFigures,
    pub amplitude_difference: Option<f64>,
    pub first_harmonic_difference: Option<f64>,
    pub contact_work_difference: Option<f64>,
    pub input_work_difference: Option<f64>,
    /// Steady force that retained the motions that friction does not hold, N.
    pub retention_n: f64,
}

/// Figures of one period by one method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VerifiedFigures {
    pub amplitude_m: Option<f64>,
    pub first_harmonic_m: Option<f64>,
    pub contact_work_j: Option<f64>,
    pub damping_work_j: Option<f64>,
    pub input_work_j: Option<f64>,
    pub slipping_pairs: usize,
    pub opening_pairs: usize,
}

/// Summary of the comparisons of `dovetail verify`.
pub fn verification_summary(
    comparisons: &[Comparison],
    steps_per_period: usize,
    tolerance: f64,
) -> VerificationSummary {
    let figures = |f: &PeriodFigures| VerifiedFigures {
        amplitude_m: f.amplitude_m.and_then(finite),
        first_harmonic_m: f.first_harmonic_m.and_then(finite),
        contact_work_j: finite(f.contact_work_j),
        damping_work_j: finite(f.viscous_work_j),
        input_work_j: finite(f.input_work_j),
        slipping_pairs: f.pairs.slipping,
        opening_pairs: f.pairs.opening,
    };
    let point = |c: &Comparison| {
        let [amplitude, first, contact, input] = c.differences().map(|d| d.and_then(finite));
        VerifiedPoint {
            frequency_hz: c.frequency_hz,
            harmonics: c.harmonics,
            stable: c.is_stable,
            periods: c.periods,
            steady: c.steady,
            transient_left: finite(c.transient_left),
            balance: figures(&c.balance),
            integration: figures(&c.integration),
            amplitude_difference: amplitude,
            first_harmonic_difference: first,
            contact_work_difference: contact,
            input_work_difference: input,
            retention_n: c.retention_n,
        }
    };
    VerificationSummary {
        steps_per_period,
        tolerance,
        worst_difference: comparisons
            .iter()
            .filter(|c| c.is_stable)
            .map(Comparison::worst)
            .reduce(f64::max)
            .and_then(finite),
        points: comparisons.iter().map(point).collect(),
    }
}
