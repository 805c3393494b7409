//! Table of a backbone, backbone.csv.

use std::path::Path;

use super::solution::Solution;
use crate::ExportError;
use crate::table::Columns;
use dovetail_solver::dlft::backbone::BackbonePoint;

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

    fn solution(&self) -> Option<Solution<'_>> {
        Some(Solution::of(&self.point.orbit, self.observation))
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
    table.add("modal_amplitude_m_sqrt_kg", |row| row.point.modal_amplitude);
    table.add("excitation_scale", |row| row.point.excitation_scale);
    table.add("force_n", BackboneRow::resonant_force_n);
    table.add("response_below_hz", |row| {
        row.point.response_frequencies_hz()[0]
    });
    table.add("response_above_hz", |row| {
        row.point.response_frequencies_hz()[1]
    });
    table.add_solution("", solution, "friction_power_w viscous_power_w");
    table.add("power_defect", |row| row.point.power_defect());
    table.add_solution(
        "",
        solution,
        "stuck_pairs slipping_pairs opening_pairs closing_pairs open_pairs retention_n harmonics",
    );
    table.add("estimated_error", |row| row.point.estimated_error);
    table.write(path, rows)
}
