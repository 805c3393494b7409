//! Tables of natural frequencies: modes.csv and those of the Campbell diagram.

use std::path::Path;

use super::solution::SolutionRow;
use crate::ExportError;
use crate::table::Columns;
use dovetail_solver::results::modes::{ModeKind, NaturalFrequency};
use dovetail_solver::run::{Crossing, CrossingPeak, ModeFamily, NodalDiameters, PeakAt};

/// Name of the assembly in the tables, where other rows have the name of a body.
pub const ASSEMBLY: &str = "assembly";

/// Reads the rows of an existing modes.csv; none if there is no such file or it is not such a
/// table.
pub fn read_modes(path: &Path) -> Vec<NaturalFrequency> {
    let row = |cells: (String, String, usize, f64, Option<f64>)| {
        let (kind, body, mode, frequency_hz, modal_mass_kg) = cells;
        Some(NaturalFrequency {
            kind: ModeKind::ALL.into_iter().find(|k| k.id() == kind)?,
            body: (body != ASSEMBLY).then_some(body),
            mode,
            frequency_hz,
            modal_mass_kg,
        })
    };
    let table = ::csv::Reader::from_path(path);
    let rows = table.into_iter().flat_map(::csv::Reader::into_deserialize);
    rows.filter_map(|cells| row(cells.ok()?)).collect()
}

/// Writes modes.csv: kind, body, mode, frequency_hz, modal_mass_kg (empty where no shape is known).
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_modes(path: &Path, rows: &[NaturalFrequency]) -> Result<(), ExportError> {
    let mut table: Columns<'_, NaturalFrequency> = Columns::default();
    add_mode(&mut table, |f| (f.kind, f.body.as_deref(), f.mode));
    table.add("frequency_hz", |f| f.frequency_hz);
    table.add("modal_mass_kg", |f| f.modal_mass_kg);
    table.write(path, rows)
}

/// Adds the columns of a mode: its kind, its body and its number.
fn add_mode<'a, R: 'a>(table: &mut Columns<'a, R>, of: fn(&R) -> (ModeKind, Option<&str>, usize)) {
    table.add("kind", move |row| of(row).0.id());
    table.add("body", move |row| of(row).1.unwrap_or(ASSEMBLY).to_owned());
    table.add("mode", move |row| of(row).2);
}

/// Writes modes_campbell.csv: speed_rpm, kind, body, mode, frequency_hz (empty at a speed that the
/// structure does not withstand).
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_campbell(path: &Path, families: &[ModeFamily]) -> Result<(), ExportError> {
    struct Row<'a> {
        family: &'a ModeFamily,
        speed_rpm: f64,
        mode: usize,
        frequency_hz: Option<f64>,
    }
    let rows = families.iter().flat_map(|family| {
        family.speeds.iter().flat_map(move |(speed_rpm, found)| {
            (0..family.modes()).map(move |mode| Row {
                family,
                speed_rpm: *speed_rpm,
                mode: mode + 1,
                frequency_hz: found.as_ref().and_then(|f| f.get(mode).copied()),
            })
        })
    });
    let mut table: Columns<'_, Row<'_>> = Columns::default();
    table.add("speed_rpm", |row| row.speed_rpm);
    add_mode(&mut table, |row| {
        (row.family.kind, row.family.body.as_deref(), row.mode)
    });
    if families.iter().any(|family| family.wave.is_some()) {
        let diameter = |row: &Row<'_>| row.family.wave.map(|wave| wave.nodal_diameter);
        table.add("nodal_diameter", diameter);
    }
    table.add("frequency_hz", |row| row.frequency_hz);
    table.write(path, &rows.collect::<Vec<_>>())
}

/// Writes modes_nodal_diameters.csv: nodal_diameter, mode, frequency_hz.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_nodal_diameters(path: &Path, found: &NodalDiameters) -> Result<(), ExportError> {
    type Row = (usize, usize, f64);
    let diameters = found.frequencies_hz.iter().enumerate();
    let rows = diameters.flat_map(|(diameter, frequencies)| {
        let modes = frequencies.iter().enumerate();
        modes.map(move |(i, hz)| (diameter, i + 1, *hz))
    });
    let mut table: Columns<'_, Row> = Columns::default();
    table.add("nodal_diameter", |row| row.0);
    table.add("mode", |row| row.1);
    table.add("frequency_hz", |row| row.2);
    table.write(path, &rows.collect::<Vec<_>>())
}

/// Writes modes_crossings.csv: speed_rpm, kind, body, mode, engine_order, frequency_hz, margin
/// (empty at rest). Where there are peaks, also those of the first observation.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_crossings(
    path: &Path,
    operating_rpm: f64,
    rows: &[Crossing],
    peaks: &[CrossingPeak],
) -> Result<(), ExportError> {
    struct Row<'a> {
        crossing: &'a Crossing,
        peak: Option<&'a PeakAt>,
    }
    impl Row<'_> {
        fn solution(&self) -> Option<SolutionRow<'_>> {
            Some(SolutionRow::new(&self.peak?.orbit, 0))
        }
    }
    let rows = rows.iter().map(|crossing| {
        let crossing_peak = peaks.iter().find(|peak| peak.crossing == *crossing);
        Row {
            crossing,
            peak: crossing_peak.and_then(|crossing_peak| crossing_peak.peak.as_ref().ok()),
        }
    });
    let rows: Vec<Row<'_>> = rows.collect();
    let mut table: Columns<'_, Row<'_>> = Columns::default();
    table.add("speed_rpm", |r| r.crossing.speed_rpm);
    add_mode(&mut table, |Row { crossing, .. }| {
        (crossing.kind, crossing.body.as_deref(), crossing.mode)
    });
    if rows.iter().any(|r| r.crossing.wave.is_some()) {
        table.add("nodal_diameter", |r| {
            r.crossing.wave.map(|wave| wave.nodal_diameter)
        });
    }
    table.add("engine_order", |r| r.crossing.engine_order);
    table.add("frequency_hz", |r| r.crossing.frequency_hz);
    table.add("margin", move |r| {
        (operating_rpm > 0.0).then(|| r.crossing.margin(operating_rpm))
    });
    if !peaks.is_empty() {
        table.add_solution("peak_", Row::solution, "amplitude_m frequency_hz");
        table.add("linear_peak_amplitude_m", |r| r.peak?.linear_m);
        table.add_solution("peak_", Row::solution, "outcome estimated_error");
        table.add_solution("", Row::solution, "slipping_pairs opening_pairs");
    }
    table.write(path, &rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("modes.csv");
        assert_eq!(read_modes(&path), []);
        let row = |kind: ModeKind, body: Option<&str>, mode: usize| NaturalFrequency {
            kind,
            body: body.map(str::to_owned),
            mode,
            frequency_hz: 450.0 / 7.0,
            modal_mass_kg: body.map(|_| 1.0 / 7.0),
        };
        let rows = [
            row(ModeKind::Linear, None, 1),
            row(ModeKind::FlanksHeld, Some("a, \"b\""), 2),
        ];
        write_modes(&path, &rows).unwrap();
        assert_eq!(read_modes(&path), rows);
    }
}
