//! Checks of a peak that need further runs: over residual tractions, and over meshes of the flanks.

use serde::{Deserialize, Serialize};

use super::TractionRangeSummary;
use crate::warning::LARGE_ERROR;

/// Checks of a peak that need further runs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Checks {
    /// Dependence of the peak on the residual tractions that assembly leaves; `None` without
    /// friction.
    pub residual_tractions: Option<TractionCheck>,
    /// Dependence of peak and friction power on the mesh of the flanks.
    pub flank_mesh: FlankMeshCheck,
}

/// Result of a check.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The runs of the check are missing.
    #[default]
    NotChecked,
    /// The changes are small.
    Small,
    /// A change is large.
    Large,
}

impl Verdict {
    /// Verdict on the largest of the relative changes that are known.
    fn new(changes: &[Option<f64>]) -> Self {
        match changes.iter().flatten().copied().reduce(f64::max) {
            None => Self::NotChecked,
            Some(change) if change <= LARGE_ERROR => Self::Small,
            Some(_) => Self::Large,
        }
    }
}

/// Dependence of the peak on the residual tractions that assembly leaves.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TractionCheck {
    /// Result of the check.
    pub verdict: Verdict,
    /// Number of tractions with a peak, including the load path.
    pub tractions: usize,
    /// Difference of the largest and the least peak over the largest.
    pub peak_change: Option<f64>,
    /// Command that makes the check; `None` if it was made, or if the scene does not permit it.
    pub command: Option<String>,
}

impl TractionCheck {
    /// Check by the range of the peak over starting tractions, which `command` asks for.
    pub fn new(range: Option<&TractionRangeSummary>, command: Option<String>) -> Self {
        let several = range.filter(|range| range.tractions > 1);
        let peak_change = several.map(|range| {
            let [least, most] = range.peak_amplitude_m;
            if most > 0.0 {
                (most - least) / most
            } else {
                0.0
            }
        });
        Self {
            verdict: Verdict::new(&[peak_change]),
            tractions: range.map_or(0, |range| range.tractions),
            peak_change,
            command: command.filter(|_| peak_change.is_none()),
        }
    }
}

/// Dependence of peak and friction power on the mesh of the flanks.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct FlankMeshCheck {
    /// Result of the check.
    pub verdict: Verdict,
    /// Name of the study; `None` without one.
    pub study: Option<String>,
    /// Estimated relative error of the peak amplitude.
    pub peak_error: Option<f64>,
    /// Estimated relative error of the friction power at the peak.
    pub friction_power_error: Option<f64>,
    /// Command that makes the check; `None` if it was made, or without a mesh.
    pub command: Option<String>,
}

impl FlankMeshCheck {
    /// Check by a study with these estimated relative errors of the peak amplitude and of the
    /// friction power.
    pub fn by_study(study: &str, [peak_error, friction_power_error]: [Option<f64>; 2]) -> Self {
        Self {
            verdict: Verdict::new(&[peak_error, friction_power_error]),
            study: Some(study.to_owned()),
            peak_error,
            friction_power_error,
            command: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_traction_is_no_check_and_a_range_is_judged_by_its_width() {
        let range = |tractions: usize, peaks: [f64; 2]| TractionRangeSummary {
            tractions,
            peak_amplitude_m: peaks,
            peak_frequency_hz: [100.0; 2],
            loss_factor: None,
        };
        let check = |range: Option<&TractionRangeSummary>| {
            TractionCheck::new(range, Some("dovetail run".into()))
        };
        for range in [None, Some(&range(1, [1e-3; 2]))] {
            let found = check(range);
            assert_eq!(found.verdict, Verdict::NotChecked);
            assert!(found.command.is_some() && found.peak_change.is_none());
        }
        let found = check(Some(&range(3, [0.99e-3, 1e-3])));
        assert_eq!((found.verdict, found.command), (Verdict::Small, None));
        assert!((found.peak_change.unwrap() - 0.01).abs() < 1e-12);
        assert_eq!(
            check(Some(&range(3, [0.9e-3, 1e-3]))).verdict,
            Verdict::Large
        );
    }

    #[test]
    fn the_larger_of_both_errors_of_a_mesh_counts() {
        let verdict = |errors| FlankMeshCheck::by_study("meshes", errors).verdict;
        assert_eq!(verdict([Some(1e-3), Some(5e-3)]), Verdict::Small);
        assert_eq!(verdict([Some(1e-3), Some(0.05)]), Verdict::Large);
        assert_eq!(verdict([Some(1e-3), None]), Verdict::Small);
        assert_eq!(verdict([None, None]), Verdict::NotChecked);
    }
}
