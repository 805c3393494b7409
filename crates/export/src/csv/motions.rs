//! Tables of motions over a key or an amplitude: peaks.csv, curve.csv and backbone.csv.

use std::path::Path;

use super::solution::{STABILITY, SolutionRow, stability_word};
use crate::ExportError;
use crate::table::Columns;
use dovetail_solver::dlft::Orbit;
use dovetail_solver::dlft::backbone::BackbonePoint;
use dovetail_solver::dlft::branch::{ValueCurve, stable};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::run::{PeakAt, Peaks};

/// Columns of the amplitude over a key.
const AMPLITUDE: &str = "amplitude_m frequency_hz outcome linear_amplitude_m ratio loss_factor";
/// Columns of the joint there.
const JOINT: &str = "friction_power_w friction_power_error_w viscous_power_w \
 viscous_power_error_w slipping_pairs opening_pairs opening_area_m2 largest_slid_m \
 largest_slid_error_m retention_n harmonics estimated_error";

/// Row of peaks.csv.
#[derive(Debug, Clone, Copy)]
pub struct PeakRow<'a> {
    /// Value of the second key; `None` without one.
    pub also: Option<f64>,
    /// Number of the observed displacement.
    pub observation: usize,
    /// Pairs of the model.
    pub pairs: &'a PairTable,
    /// Peak at the value of the first key.
    pub peak: &'a PeakAt,
}

impl<'a> PeakRow<'a> {
    /// Rows of peaks at a value of the second key.
    pub fn rows(also: Option<f64>, peaks: &'a Peaks) -> Vec<Self> {
        let row = |peak| Self {
            also,
            observation: peaks.observation,
            pairs: &peaks.reduced.pairs,
            peak,
        };
        peaks.rows.iter().map(row).collect()
    }

    /// Amplitude, m.
    pub fn amplitude_m(&self) -> f64 {
        self.peak.amplitude_m(self.observation)
    }

    fn solution(&self) -> Option<SolutionRow<'_>> {
        Some(SolutionRow {
            linear_m: self.peak.linear_m,
            pairs: Some(self.pairs),
            ..SolutionRow::new(&self.peak.orbit, self.observation)
        })
    }
}

/// Writes peaks.csv: one row for each peak. `keys` are the key of the value of each line of peaks,
/// if there is one, and the key of the values along it.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_peaks(path: &Path, keys: &[&str], rows: &[PeakRow<'_>]) -> Result<(), ExportError> {
    let mut table: Columns<'_, PeakRow<'_>> = Columns::default();
    if let [also, _] = keys {
        table.add(*also, |row| row.also);
    }
    table.add(keys.last().copied().unwrap_or_default(), |row| {
        row.peak.value
    });
    table.add_solution("", PeakRow::solution, AMPLITUDE);
    table.add_solution("", PeakRow::solution, "modal_mass_kg");
    table.add_solution("", PeakRow::solution, JOINT);
    table.add_solution("", PeakRow::solution, "stable");
    table.add_solution("", PeakRow::solution, STABILITY);
    table.write(path, rows)
}

/// Row of curve.csv.
#[derive(Debug, Clone, Copy)]
pub struct CurveRow<'a> {
    /// Number of the motion in the order of the branches.
    index: usize,
    /// Number of its branch, counted from 1.
    branch: usize,
    /// Stability of the motion; `None` where it is not known.
    is_stable: Option<bool>,
    /// Length of the branch up to it.
    length: f64,
    /// Number of the observed displacement.
    observation: usize,
    /// Pairs of the model.
    pairs: &'a PairTable,
    /// Value of the key.
    pub value: f64,
    /// Amplitude of the linear reference, m; `None` where it does not move.
    pub linear_m: Option<f64>,
    /// Motion.
    pub orbit: &'a Orbit,
}

impl<'a> CurveRow<'a> {
    /// Rows of a curve over a key: the motions of an observed displacement.
    pub fn rows(curve: &'a ValueCurve, pairs: &'a PairTable, observation: usize) -> Vec<Self> {
        let response = &curve.response;
        let stable = stable(response);
        let row = |index: usize| {
            let branch = response.branch_of(index);
            let of_branch = &response.branches[branch];
            let linear_m = response.linear[index].observed_amplitude.get(observation);
            Self {
                index,
                branch: branch + 1,
                is_stable: stable[index],
                length: of_branch.lengths[index - of_branch.points.start],
                observation,
                pairs,
                value: curve.values[index],
                linear_m: linear_m.copied().filter(|linear_m| *linear_m > 0.0),
                orbit: &response.orbits[index],
            }
        };
        (0..response.orbits.len()).map(row).collect()
    }

    /// Amplitude, m.
    pub fn amplitude_m(&self) -> f64 {
        self.orbit.observed_amplitude[self.observation]
    }

    fn solution(&self) -> Option<SolutionRow<'_>> {
        Some(SolutionRow {
            has_motion: self.orbit.outcome.has_motion(),
            linear_m: self.linear_m,
            pairs: Some(self.pairs),
            ..SolutionRow::new(self.orbit, self.observation)
        })
    }
}

/// Writes curve.csv: one row for each motion at one frequency, in the order of the branches. `key` is
/// the key of its values.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_curve(path: &Path, key: &str, rows: &[CurveRow<'_>]) -> Result<(), ExportError> {
    let mut table: Columns<'_, CurveRow<'_>> = Columns::default();
    table.add("point", |row| row.index);
    table.add("branch", |row| row.branch);
    table.add("stable", |row| {
        let has_motion = row.orbit.outcome.has_motion();
        has_motion.then(|| stability_word(row.is_stable))
    });
    table.add("length", |row| row.length);
    table.add(key, |row| row.value);
    table.add_solution("", CurveRow::solution, AMPLITUDE);
    table.add_solution("", CurveRow::solution, JOINT);
    table.add_solution("", CurveRow::solution, STABILITY);
    table.write(path, rows)
}

/// Row of backbone.csv.
#[derive(Debug, Clone, Copy)]
pub struct BackboneRow<'a> {
    /// Number of the observed displacement.
    pub observation: usize,
    /// Motion of the backbone.
    pub point: &'a BackbonePoint,
    /// Force of the scene, N, where a single one excites it.
    pub force_n: Option<f64>,
}

impl BackboneRow<'_> {
    /// Amplitude of the observed displacement, m.
    pub fn amplitude_m(&self) -> f64 {
        self.point.orbit.observed_amplitude[self.observation]
    }

    /// Force at whose resonance the motion is, N.
    pub fn resonant_force_n(&self) -> Option<f64> {
        Some(self.force_n? * self.point.excitation_scale?)
    }

    fn solution(&self) -> Option<SolutionRow<'_>> {
        Some(SolutionRow::new(&self.point.orbit, self.observation))
    }
}

/// Writes backbone.csv: one row for each amplitude.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_backbone(path: &Path, rows: &[BackboneRow<'_>]) -> Result<(), ExportError> {
    let mut table: Columns<'_, BackboneRow<'_>> = Columns::default();
    let solution = BackboneRow::solution;
    table.add_solution("", solution, "amplitude_m frequency_hz outcome");
    table.add("damping_ratio", |row| row.point.damping_ratio);
    table.add("friction_ratio", |row| row.point.friction_ratio);
    table.add("friction_ratio_error", |row| row.point.friction_ratio_error);
    table.add("modal_amplitude_m_sqrt_kg", |row| row.point.modal_amplitude);
    table.add("excitation_scale", |row| row.point.excitation_scale);
    table.add("force_n", BackboneRow::resonant_force_n);
    table.add("response_below_hz", |row| {
        row.point.response_frequencies_hz()[0]
    });
    table.add("response_above_hz", |row| {
        row.point.response_frequencies_hz()[1]
    });
    table.add_solution(
        "",
        solution,
        "friction_power_w friction_power_error_w viscous_power_w viscous_power_error_w",
    );
    table.add("power_defect", |row| row.point.power_defect());
    table.add_solution(
        "",
        solution,
        "stuck_pairs slipping_pairs opening_pairs closing_pairs open_pairs retention_n harmonics",
    );
    table.add("estimated_error", |row| row.point.estimated_error);
    table.write(path, rows)
}
