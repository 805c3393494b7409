//! Writes the fields on the flanks. Each pair is a point, and each flank facet a triangle.

use std::collections::BTreeMap;
use std::path::Path;

use super::ExportError;
use super::vtu::{Grid, check_length, write_pvd};
use dovetail_solver::dlft::{Orbit, PairStatus, Response, StaticState};
use dovetail_solver::model::{ContactPair, Model};
use dovetail_solver::results::quantities::{cycle_fields, static_fields, sweep_fields};

/// flank_static.vtu: pressure, forces, slip, gap, `status` (0 stuck, 1 slipping, 2 open) and the
/// normal of each pair. A static state that did not converge is written as flanks without fields.
pub fn write_flank_static(
    path: &Path,
    model: &Model,
    state: &StaticState,
) -> Result<(), ExportError> {
    let fields = static_fields(state, &model.pairs);
    check_pairs(
        path,
        "static status",
        fields.status.len(),
        model.pairs.len(),
    )?;
    check_pairs(
        path,
        "static contact forces",
        fields.normal_force_n.len(),
        model.pairs.len(),
    )?;
    check_pairs(
        path,
        "static displacements",
        fields.gap_m.len(),
        model.pairs.len(),
    )?;
    let mut grid = flank_grid(model);
    let normals = model.pairs.iter().flat_map(|p| p.frame[0]).collect();
    grid.point_array("normal", 3, normals);
    if state.outcome.is_converged() {
        grid.point_array("pressure_pa", 1, fields.pressure_pa);
        grid.point_array("normal_force_n", 1, fields.normal_force_n);
        grid.point_array(
            "slip_m",
            1,
            fields.slip_m.iter().map(|s| s[0].hypot(s[1])).collect(),
        );
        grid.point_array("slip_vector_m", 3, in_space(model, &fields.slip_m));
        grid.point_array("friction_vector_n", 3, in_space(model, &fields.friction_n));
        grid.point_array("gap_m", 1, fields.gap_m);
        let code = |s: &PairStatus| match s {
            PairStatus::Stuck => 0,
            PairStatus::Slipping => 1,
            PairStatus::Open => 2,
        };
        grid.point_integers("status", fields.status.iter().map(code).collect());
    }
    grid.write(path)
}

/// The flanks at each converged frequency: flank.pvd with flank/flank_0000.vtu...; timestep = frequency in Hz, number
/// in the file name = row of response.csv (0 = first). Per pair: pressure (mean, min, max of the period), slid
/// distance, open fraction, dissipation, `status` (0 stuck, 1 slipping, 2 opening). Points that did not converge
/// have no file.
#[derive(Debug)]
pub struct FlankSeries {
    still: Grid,
    pairs: Vec<ContactPair>,
    /// Frequency and file of each row that is written.
    written: BTreeMap<usize, (f64, String)>,
}

impl FlankSeries {
    /// Of the flanks of this model; nothing is written yet.
    pub fn new(model: &Model) -> Self {
        Self {
            still: flank_grid(model),
            pairs: model.pairs.clone(),
            written: BTreeMap::new(),
        }
    }

    /// Writes the file of a row, where it converged and is not written yet; its name.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(
        &mut self,
        folder: &Path,
        row: usize,
        orbit: &Orbit,
    ) -> Result<Option<String>, ExportError> {
        if !orbit.outcome.is_converged() || self.written.contains_key(&row) {
            return Ok(None);
        }
        let file = format!("flank/flank_{row:04}.vtu");
        let path = folder.join(&file);
        check_pairs(&path, "pair cycles", orbit.cycles.len(), self.pairs.len())?;
        let fields = cycle_fields(orbit, &self.pairs);
        let mut grid = self.still.clone();
        grid.point_array("pressure_mean_pa", 1, fields.pressure_mean_pa);
        grid.point_array("pressure_min_pa", 1, fields.pressure_min_pa);
        grid.point_array("pressure_max_pa", 1, fields.pressure_max_pa);
        grid.point_array("slid_m", 1, fields.slid_m);
        grid.point_array("open_fraction", 1, fields.open_fraction);
        grid.point_array("dissipation_w_m2", 1, fields.dissipation_w_m2);
        grid.point_integers("status", fields.status.iter().map(|&s| s as i32).collect());
        grid.write(&path)?;
        self.written.insert(row, (orbit.frequency_hz, file.clone()));
        Ok(Some(file))
    }

    /// Writes the collection of the files that are written; `rows` is how many frequencies there are. Its name.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_collection(&self, folder: &Path, rows: usize) -> Result<String, ExportError> {
        let entries: Vec<(f64, String)> = self.written.values().cloned().collect();
        let comment = format!(
            "timestep = frequency in Hz; {} points converged, {} did not and are left out",
            entries.len(),
            rows - entries.len()
        );
        let file = "flank.pvd".to_owned();
        write_pvd(&folder.join(&file), &entries, &comment)?;
        Ok(file)
    }
}

/// flank_dissipation.vtu: friction power summed over the converged points, per pair
/// (`friction_power_sum_w`) and per area (`dissipation_sum_w_m2`, the paper's Figure 6), the number
/// of points at which a pair separates (`opening_points`) and whether it ever does (`separates`, 0
/// or 1, the paper's Figure 5).
pub fn write_flank_dissipation(
    path: &Path,
    model: &Model,
    response: &Response,
) -> Result<(), ExportError> {
    let sums = sweep_fields(response, &model.pairs);
    let mut grid = flank_grid(model);
    grid.point_array("friction_power_sum_w", 1, sums.friction_power_sum_w);
    grid.point_array("dissipation_sum_w_m2", 1, sums.dissipation_sum_w_m2);
    let separates = sums
        .opening_points
        .iter()
        .map(|&n| i32::from(n > 0))
        .collect();
    grid.point_integers("separates", separates);
    grid.point_integers(
        "opening_points",
        sums.opening_points.iter().map(|&n| n as i32).collect(),
    );
    grid.write(path)
}

/// Error unless there is one value per pair.
pub(super) fn check_pairs(
    path: &Path,
    field: &str,
    found: usize,
    pairs: usize,
) -> Result<(), ExportError> {
    check_length(path, field, found, pairs, "one per contact pair")
}

/// The flanks with what every file of them carries: number, contact and area of each pair.
fn flank_grid(model: &Model) -> Grid {
    let points: Vec<[f64; 3]> = model.pairs.iter().map(|p| p.position_m).collect();
    let mut grid = Grid::of_triangles(&points, &model.flank_triangles);
    grid.point_integers("pair", (0..model.pairs.len() as i32).collect());
    grid.point_integers(
        "contact",
        model.pairs.iter().map(|p| p.contact as i32).collect(),
    );
    grid.point_array(
        "area_m2",
        1,
        model.pairs.iter().map(|p| p.area_m2).collect(),
    );
    grid
}

/// Components along t1 and t2 as a vector in space.
fn in_space(model: &Model, tangential: &[[f64; 2]]) -> Vec<f64> {
    let vector = |(p, s): (&ContactPair, &[f64; 2])| {
        let [_, t1, t2] = p.frame;
        [0, 1, 2].map(|a| s[0] * t1[a] + s[1] * t2[a])
    };
    model
        .pairs
        .iter()
        .zip(tangential)
        .flat_map(vector)
        .collect()
}
