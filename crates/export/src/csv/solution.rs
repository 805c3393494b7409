//! Columns of a solution at one frequency, from which the tables choose.

use crate::table::{Cell, Columns};
use dovetail_solver::dlft::{CycleStatus, FigureErrors, Orbit};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::{largest_slid_error_m, loss_factor, modal_mass_kg};

/// Solution in a row of a table.
#[derive(Clone, Copy)]
pub(super) struct SolutionRow<'a> {
    pub(super) orbit: &'a Orbit,
    /// False if the solution has its outcome, and no numbers of a motion.
    pub(super) has_motion: bool,
    /// Number of the observation that the table is about.
    pub(super) observation: usize,
    /// Amplitude of the linear reference, m; `None` if it does not move.
    pub(super) linear_m: Option<f64>,
    /// Pairs of the model, for what depends on their areas.
    pub(super) pairs: Option<&'a PairTable>,
}

/// Word of a verdict in a table.
pub(super) fn stability_word(is_stable: Option<bool>) -> &'static str {
    match is_stable {
        Some(true) => "yes",
        Some(false) => "no",
        None => "not_judged",
    }
}

/// Columns of the stability of a motion after `stable`.
pub(super) const STABILITY: &str = "instability floquet_multiplier floquet_argument_rad";

impl<'a> SolutionRow<'a> {
    /// Solution with a motion. The columns `opening_area_m2`, `linear_amplitude_m` and `ratio` are
    /// empty unless `pairs` and `linear_m` are given.
    pub(super) fn new(orbit: &'a Orbit, observation: usize) -> Self {
        Self {
            orbit,
            has_motion: true,
            observation,
            linear_m: None,
            pairs: None,
        }
    }

    /// Cell of the column with this heading.
    fn cell(&self, heading: &str) -> Cell {
        let orbit = self.orbit;
        match heading {
            "frequency_hz" => orbit.frequency_hz.into(),
            "outcome" => orbit.outcome.to_string().into(),
            "linear_amplitude_m" => self.linear_m.into(),
            "newton_iterations" => orbit.newton_iterations.into(),
            "krylov_iterations" => orbit.krylov_iterations.into(),
            "residual" => Some(orbit.residual).filter(|r| r.is_finite()).into(),
            "harmonics" => orbit.harmonics.into(),
            _ if !self.has_motion => Cell::Empty,
            "amplitude_m" => self.amplitude_m().into(),
            "ratio" => self.linear_m.map(|m| self.amplitude_m() / m).into(),
            "loss_factor" => loss_factor(orbit).into(),
            "modal_mass_kg" => modal_mass_kg(orbit, self.observation).into(),
            "friction_power_w" => orbit.friction_power_w.into(),
            "friction_power_error_w" => self.errors().map(|e| e.friction_power_w).into(),
            "viscous_power_error_w" => self.errors().map(|e| e.viscous_power_w).into(),
            "viscous_power_w" => orbit.viscous_power_w.into(),
            "input_power_w" => orbit.input_power_w.into(),
            "stuck_pairs" => orbit.counts().stuck.into(),
            "slipping_pairs" => orbit.counts().slipping.into(),
            "opening_pairs" => orbit.counts().opening.into(),
            "closing_pairs" => orbit.counts().closing.into(),
            "open_pairs" => orbit.counts().open.into(),
            "opening_area_m2" => self.opening_area_m2().into(),
            "largest_slid_m" => self.largest_slid_m().into(),
            "largest_slid_error_m" => largest_slid_error_m(orbit).into(),
            "retention_n" => orbit.retention_n.into(),
            "stable" => stability_word(orbit.stability.is_stable()).into(),
            "instability" => orbit.stability.kind().map(|kind| kind.to_string()).into(),
            "floquet_multiplier" => orbit.stability.multiplier.map(|m| m.norm()).into(),
            "floquet_argument_rad" => orbit.stability.multiplier.map(|m| m.arg()).into(),
            "estimated_error" => orbit.amplitude_error(self.observation).into(),
            other => unreachable!("a solution has no column {other}"),
        }
    }

    fn errors(&self) -> Option<&FigureErrors> {
        self.orbit.figure_errors.as_ref()
    }

    fn amplitude_m(&self) -> f64 {
        self.orbit.observed_amplitude[self.observation]
    }

    /// Area of the pairs that open in the period, m2; `None` if an area is unknown.
    fn opening_area_m2(&self) -> Option<f64> {
        let cycles = self.orbit.cycles.iter().zip(&self.pairs?.rows);
        let opening = cycles.filter(|(cycle, _)| cycle.status == CycleStatus::Opening);
        opening.map(|(_, pair)| pair.area_m2).sum()
    }

    /// Largest distance slid by a pair in a period, m.
    fn largest_slid_m(&self) -> Option<f64> {
        let slid = self.orbit.cycles.iter().map(|cycle| cycle.slid_m);
        slid.reduce(f64::max)
    }
}

impl<'a, R> Columns<'a, R> {
    /// Adds the columns with these headings, between blanks, of the solution of a row; `prefix`
    /// stands before them. A row without a solution has empty cells.
    pub(super) fn add_solution(
        &mut self,
        prefix: &str,
        of: impl Fn(&R) -> Option<SolutionRow<'_>> + Copy + 'a,
        headings: &'static str,
    ) {
        for heading in headings.split_whitespace() {
            self.add(format!("{prefix}{heading}"), move |row| {
                of(row).map(|solution| solution.cell(heading))
            });
        }
    }
}
