//! Writes the tables: response.csv, static.csv, static_observed.csv, contact.csv, modes.csv,
//! verify.csv.
//!
//! A number is written as the shortest text that reads back as the same f64. A cell without a value
//! (a point that did not converge, a harmonic not computed) is empty.

use std::path::Path;

use super::flank::check_pairs;
use super::{ExportError, write_file};
use dovetail_solver::dlft::{Orbit, PairStatus, Response, StaticState};
use dovetail_solver::integration::compare::Comparison;
use dovetail_solver::model::Model;
use dovetail_solver::results::modes::{ModeKind, NaturalFrequency};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::{
    CycleFields, cycle_fields, linear_amplitude, peak, phasors, static_fields, sweep_fields,
};
use dovetail_solver::run::{Crossing, Family};

/// Name of the assembly in the tables, where other rows have the name of a body.
pub const ASSEMBLY: &str = "assembly";

/// Writes response.csv: one row per frequency, including the frequencies added at peaks (`added` is
/// 1). `point` is the number of the frequency, which is also in the name of its file of the flanks.
/// Amplitudes are the largest departure from the mean in the period. `<name>_h<k>_...` is harmonic
/// k as `A cos(k w t - phase)`. `<name>_linear_amplitude_m` is the amplitude of the linear
/// reference. A point that did not converge keeps its outcome, iterations, residual and linear
/// amplitude; its other cells are empty.
///
/// `names` are the names of the observations.
pub fn write_response(path: &Path, names: &[&str], response: &Response) -> Result<(), ExportError> {
    let harmonics = response
        .orbits
        .iter()
        .map(|o| o.harmonics)
        .max()
        .unwrap_or(0);
    let mut table = Table::new(path);
    table.header(&["point", "added", "frequency_hz", "outcome"]);
    for name in names {
        table.text(&format!("{name}_amplitude_m"));
        table.text(&format!("{name}_linear_amplitude_m"));
    }
    for name in names {
        for k in 1..=harmonics {
            table.text(&format!("{name}_h{k}_amplitude_m"));
            table.text(&format!("{name}_h{k}_phase_rad"));
        }
    }
    table.header(&[
        "slipping_pairs",
        "opening_pairs",
        "closing_pairs",
        "open_pairs",
        "stuck_pairs",
        "friction_power_w",
    ]);
    table.header(&["viscous_power_w", "input_power_w", "retention_n"]);
    table.header(&["newton_iterations", "krylov_iterations", "residual"]);
    table.header(&["harmonics", "estimated_error"]);
    for name in names {
        table.text(&format!("{name}_estimated_error"));
    }
    table.end_row();
    for orbit in &response.orbits {
        response_row(&mut table, response, orbit, names, harmonics)?;
    }
    table.write()
}

fn response_row(
    table: &mut Table,
    response: &Response,
    orbit: &Orbit,
    names: &[&str],
    harmonics: usize,
) -> Result<(), ExportError> {
    let valid = orbit.outcome.has_motion();
    table.integer(Some(orbit.point));
    table.integer(Some(usize::from(response.is_added(orbit))));
    table.number("frequency_hz", Some(orbit.frequency_hz))?;
    table.text(orbit.outcome.word());
    for (i, name) in names.iter().enumerate() {
        let amplitude = orbit.observed_amplitude_m.get(i).copied().filter(|_| valid);
        table.number(name, amplitude)?;
        table.number(name, linear_amplitude(response, orbit.frequency_hz, i))?;
    }
    for (i, name) in names.iter().enumerate() {
        let phasors = orbit
            .observed
            .get(i)
            .map(|c| phasors(c))
            .unwrap_or_default();
        for k in 0..harmonics {
            let phasor = phasors.get(k).filter(|_| valid);
            table.number(name, phasor.map(|p| p.amplitude))?;
            table.number(name, phasor.map(|p| p.phase_rad))?;
        }
    }
    let counts = Some(orbit.counts()).filter(|_| valid);
    table.integer(counts.map(|c| c.slipping));
    table.integer(counts.map(|c| c.opening));
    table.integer(counts.map(|c| c.closing));
    table.integer(counts.map(|c| c.open));
    table.integer(counts.map(|c| c.stuck));
    table.number(
        "friction_power_w",
        Some(orbit.friction_power_w).filter(|_| valid),
    )?;
    table.number(
        "viscous_power_w",
        Some(orbit.viscous_power_w).filter(|_| valid),
    )?;
    table.number("input_power_w", Some(orbit.input_power_w).filter(|_| valid))?;
    table.number("retention_n", Some(orbit.retention_n).filter(|_| valid))?;
    table.integer(Some(orbit.newton_iterations));
    table.integer(Some(orbit.krylov_iterations));
    table.number("residual", Some(orbit.residual).filter(|r| r.is_finite()))?;
    table.integer(Some(orbit.harmonics));
    table.number("estimated_error", orbit.estimated_error.filter(|_| valid))?;
    for (i, name) in names.iter().enumerate() {
        let estimated = orbit.observed_error.get(i).copied().filter(|_| valid);
        table.number(name, estimated)?;
    }
    table.end_row();
    Ok(())
}

/// Writes static.csv: one row per pair. If the static state did not converge, `status` is the
/// outcome and the numbers are empty. `friction_t*_n` is the force that the body of the first flank
/// exerts on the body of the second.
pub fn write_static(
    path: &Path,
    pairs: &PairTable,
    state: &StaticState,
) -> Result<(), ExportError> {
    let valid = state.outcome.is_converged();
    let fields = static_fields(state, &pairs.rows);
    let count = pairs.rows.len();
    check_pairs(path, "static status", fields.status.len(), count)?;
    check_pairs(
        path,
        "static contact forces",
        fields.normal_force_n.len(),
        count,
    )?;
    check_pairs(path, "static displacements", fields.gap_m.len(), count)?;
    let mut table = Table::new(path);
    table.pair_header(pairs);
    table.header(&[
        "normal_force_n",
        "pressure_pa",
        "friction_t1_n",
        "friction_t2_n",
    ]);
    table.header(&[
        "slip_t1_m",
        "slip_t2_m",
        "slip_m",
        "gap_m",
        "clearance_m",
        "status",
    ]);
    table.end_row();
    for (i, pair) in pairs.rows.iter().enumerate() {
        table.pair_cells(pairs, i)?;
        let [f1, f2] = fields.friction_n[i];
        let [s1, s2] = fields.slip_m[i];
        for (name, value) in [
            ("normal_force_n", Some(fields.normal_force_n[i])),
            ("pressure_pa", pair.area_m2.map(|_| fields.pressure_pa[i])),
            ("friction_t1_n", Some(f1)),
            ("friction_t2_n", Some(f2)),
            ("slip_t1_m", Some(s1)),
            ("slip_t2_m", Some(s2)),
            ("slip_m", Some(s1.hypot(s2))),
            ("gap_m", Some(fields.gap_m[i])),
        ] {
            table.number(name, value.filter(|_| valid))?;
        }
        table.number("clearance_m", Some(pair.gap_m))?;
        table.text(if valid {
            static_word(fields.status[i])
        } else {
            state.outcome.word()
        });
        table.end_row();
    }
    table.write()
}

/// Writes static_observed.csv: the observed displacements in the static state, computed from those
/// of all nodes of each body.
pub fn write_static_observations(
    path: &Path,
    model: &Model,
    displacements_m: &[&[[f64; 3]]],
) -> Result<(), ExportError> {
    let mut table = Table::new(path);
    table.header(&["name", "displacement_m"]);
    table.end_row();
    for observation in &model.observations {
        let terms = observation.terms.iter().map(|&(at, direction)| {
            let u = displacements_m[at.body][at.node as usize];
            (0..3).map(|k| direction[k] * u[k]).sum::<f64>()
        });
        table.text(&observation.name);
        table.number("displacement_m", Some(terms.sum()))?;
        table.end_row();
    }
    table.write()
}

/// Writes contact.csv: one row per pair, at the peak of the first observation (columns `peak_...`,
/// empty if nothing converged) and over all converged frequencies.
pub fn write_contact(
    path: &Path,
    pairs: &PairTable,
    response: &Response,
) -> Result<(), ExportError> {
    let at_peak = peak(response, 0).map(|p| &response.orbits[p.index]);
    if let Some(orbit) = at_peak {
        check_pairs(path, "pair cycles", orbit.cycles.len(), pairs.rows.len())?;
    }
    let fields = at_peak.map(|orbit| cycle_fields(orbit, &pairs.rows));
    let swept = sweep_fields(response, pairs.rows.len());
    let mut table = Table::new(path);
    table.pair_header(pairs);
    table.header(&["peak_frequency_hz", "peak_status", "peak_pressure_mean_pa"]);
    table.header(&[
        "peak_pressure_min_pa",
        "peak_pressure_max_pa",
        "peak_slid_m",
        "peak_open_fraction",
    ]);
    table.header(&[
        "peak_friction_energy_j",
        "peak_friction_energy_j_m2",
        "friction_power_mean_w",
    ]);
    table.header(&[
        "opening_share",
        "opens_at_any_frequency",
        "converged_points",
    ]);
    table.end_row();
    let any = swept.points > 0;
    for (i, pair) in pairs.rows.iter().enumerate() {
        table.pair_cells(pairs, i)?;
        table.number("peak_frequency_hz", at_peak.map(|o| o.frequency_hz))?;
        table.text(fields.as_ref().map_or("", |f| f.status[i].word()));
        let cell = |values: &dyn Fn(&CycleFields) -> f64| fields.as_ref().map(values);
        let per_area =
            |values: &dyn Fn(&CycleFields) -> f64| pair.area_m2.and_then(|_| cell(values));
        let energy_j = |o: &Orbit| o.cycles[i].friction_power_w / o.frequency_hz;
        for (name, value) in [
            (
                "peak_pressure_mean_pa",
                per_area(&|f| f.pressure_mean_pa[i]),
            ),
            ("peak_pressure_min_pa", per_area(&|f| f.pressure_min_pa[i])),
            ("peak_pressure_max_pa", per_area(&|f| f.pressure_max_pa[i])),
            ("peak_slid_m", cell(&|f| f.slid_m[i])),
            ("peak_open_fraction", cell(&|f| f.open_fraction[i])),
            ("peak_friction_energy_j", at_peak.map(energy_j)),
            (
                "peak_friction_energy_j_m2",
                per_area(&|f| f.friction_energy_j_m2[i]),
            ),
            (
                "friction_power_mean_w",
                any.then(|| swept.friction_power_mean_w[i]),
            ),
            ("opening_share", any.then(|| swept.opening_share[i])),
        ] {
            table.number(name, value)?;
        }
        table.text(match (any, swept.separates[i]) {
            (false, _) => "",
            (true, true) => "true",
            (true, false) => "false",
        });
        table.integer(Some(swept.points));
        table.end_row();
    }
    table.write()
}

/// Reads the rows of an existing modes.csv; none if there is no such file or it is not such a
/// table.
pub fn read_modes(path: &Path) -> Vec<NaturalFrequency> {
    let row = |cells: ::csv::StringRecord| {
        let kind = cells.get(0)?;
        let body = cells.get(1)?;
        Some(NaturalFrequency {
            kind: ModeKind::ALL.into_iter().find(|k| k.id() == kind)?,
            body: (body != ASSEMBLY).then(|| body.to_owned()),
            mode: cells.get(2)?.parse().ok()?,
            frequency_hz: cells.get(3)?.parse().ok()?,
        })
    };
    let table = ::csv::Reader::from_path(path);
    let rows = table.into_iter().flat_map(::csv::Reader::into_records);
    rows.filter_map(|cells| row(cells.ok()?)).collect()
}

/// Writes modes.csv: kind, body, mode, frequency_hz.
pub fn write_modes(path: &Path, rows: &[NaturalFrequency]) -> Result<(), ExportError> {
    let mut table = Table::new(path);
    table.header(&["kind", "body", "mode", "frequency_hz"]);
    table.end_row();
    for row in rows {
        table.mode(row.kind, row.body.as_deref(), row.mode);
        table.number("frequency_hz", Some(row.frequency_hz))?;
        table.end_row();
    }
    table.write()
}

/// Writes modes_campbell.csv: speed_rpm, kind, body, mode, frequency_hz (empty at a speed that the
/// structure does not withstand).
pub fn write_campbell(path: &Path, families: &[Family]) -> Result<(), ExportError> {
    let mut table = Table::new(path);
    table.header(&["speed_rpm", "kind", "body", "mode", "frequency_hz"]);
    table.end_row();
    for family in families {
        for (speed_rpm, frequencies_hz) in &family.speeds {
            for mode in 0..family.modes() {
                let frequency_hz = frequencies_hz.as_ref().and_then(|f| f.get(mode).copied());
                table.number("speed_rpm", Some(*speed_rpm))?;
                table.mode(family.kind, family.body.as_deref(), mode + 1);
                table.number("frequency_hz", frequency_hz)?;
                table.end_row();
            }
        }
    }
    table.write()
}

/// Writes modes_crossings.csv: speed_rpm, kind, body, mode, engine_order, frequency_hz, margin
/// (empty at rest).
pub fn write_crossings(
    path: &Path,
    operating_rpm: f64,
    rows: &[Crossing],
) -> Result<(), ExportError> {
    let mut table = Table::new(path);
    table.header(&["speed_rpm", "kind", "body", "mode", "engine_order"]);
    table.header(&["frequency_hz", "margin"]);
    table.end_row();
    for row in rows {
        table.number("speed_rpm", Some(row.speed_rpm))?;
        table.mode(row.kind, row.body.as_deref(), row.mode);
        table.integer(Some(row.engine_order));
        table.number("frequency_hz", Some(row.frequency_hz))?;
        let margin = (operating_rpm > 0.0).then(|| row.margin(operating_rpm));
        table.number("margin", margin)?;
        table.end_row();
    }
    table.write()
}

/// Writes a table of texts; numbers are formatted by [`number`].
pub fn write_rows(path: &Path, header: &[String], rows: &[Vec<String>]) -> Result<(), ExportError> {
    let mut table = Table::new(path);
    for row in std::iter::once(header).chain(rows.iter().map(Vec::as_slice)) {
        row.iter().for_each(|cell| table.text(cell));
        table.end_row();
    }
    table.write()
}

/// Reads columns of numbers by their names: the rows of the table, with `None` for a cell without a
/// number. Returns `None` if there is no such file or column.
///
/// # Errors
/// A file that cannot be read, or that is not a table.
pub fn read_columns<const N: usize>(
    path: &Path,
    names: [&str; N],
) -> Result<Option<Vec<[Option<f64>; N]>>, ExportError> {
    let text = match std::fs::read(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(reading(path, source)),
    };
    let mut table = ::csv::Reader::from_reader(text.as_slice());
    let failed = |error: ::csv::Error| reading(path, error.into());
    let header = table.headers().map_err(failed)?.clone();
    let places = names.map(|name| header.iter().position(|heading| heading == name));
    if places.contains(&None) {
        return Ok(None);
    }
    let mut rows = Vec::new();
    for row in table.records() {
        let row = row.map_err(failed)?;
        rows.push(places.map(|place| row.get(place?)?.parse().ok()));
    }
    Ok(Some(rows))
}

fn reading(path: &Path, source: std::io::Error) -> ExportError {
    ExportError::Read {
        path: path.to_path_buf(),
        source,
    }
}

fn static_word(status: PairStatus) -> &'static str {
    match status {
        PairStatus::Stuck => "stuck",
        PairStatus::Slipping => "slipping",
        PairStatus::Open => "open",
    }
}

/// Writes verify.csv: two rows per frequency, `balance` and `integration`, the differences on the
/// second.
pub fn write_verification(path: &Path, comparisons: &[Comparison]) -> Result<(), ExportError> {
    const DIFFERENCES: [&str; 4] = [
        "amplitude_difference",
        "h1_amplitude_difference",
        "contact_work_difference",
        "input_work_difference",
    ];
    let mut table = Table::new(path);
    table.header(&["frequency_hz", "method", "harmonics", "periods", "steady"]);
    table.header(&["transient_left", "amplitude_m", "h1_amplitude_m"]);
    table.header(&["contact_work_j", "damping_work_j", "input_work_j"]);
    table.header(&["slipping_pairs", "opening_pairs"]);
    table.header(&DIFFERENCES);
    table.header(&["retention_n"]);
    table.end_row();
    for c in comparisons {
        for (method, f) in [("balance", &c.balance), ("integration", &c.integration)] {
            let integrated = method == "integration";
            table.number("frequency_hz", Some(c.frequency_hz))?;
            table.text(method);
            table.integer((!integrated).then_some(c.harmonics));
            table.integer(integrated.then_some(c.periods));
            table.text(match (integrated, c.steady) {
                (false, _) => "",
                (true, true) => "yes",
                (true, false) => "no",
            });
            let left = (integrated && c.transient_left.is_finite()).then_some(c.transient_left);
            table.number("transient_left", left)?;
            table.number("amplitude_m", f.amplitude_m)?;
            table.number("h1_amplitude_m", f.first_harmonic_m)?;
            table.number("contact_work_j", Some(f.contact_work_j))?;
            table.number("damping_work_j", Some(f.viscous_work_j))?;
            table.number("input_work_j", Some(f.input_work_j))?;
            table.integer(Some(f.pairs.slipping));
            table.integer(Some(f.pairs.opening));
            for (name, difference) in DIFFERENCES.iter().zip(c.differences()) {
                table.number(name, difference.filter(|_| integrated))?;
            }
            table.number("retention_n", Some(c.retention_n))?;
            table.end_row();
        }
    }
    table.write()
}

/// Rows of comma-separated cells (RFC 4180, with line feeds).
struct Table<'a> {
    path: &'a Path,
    text: String,
    row: usize,
    row_is_empty: bool,
}

impl<'a> Table<'a> {
    fn new(path: &'a Path) -> Self {
        Self {
            path,
            text: String::new(),
            row: 0,
            row_is_empty: true,
        }
    }

    /// Adds the cells of a mode: its kind, its body and its number.
    fn mode(&mut self, kind: ModeKind, body: Option<&str>, mode: usize) {
        self.text(kind.id());
        self.text(body.unwrap_or(ASSEMBLY));
        self.integer(Some(mode));
    }

    /// Adds a text. A text that a spreadsheet would take for a formula begins with an apostrophe;
    /// numbers are left as they are.
    fn text(&mut self, cell: &str) {
        if !self.row_is_empty {
            self.text.push(',');
        }
        self.row_is_empty = false;
        let is_formula = cell.starts_with(['=', '+', '-', '@', '\t', '\r']);
        let guarded = if is_formula && cell.parse::<f64>().is_err() {
            format!("'{cell}")
        } else {
            cell.to_owned()
        };
        let cell = guarded.as_str();
        if cell.contains([',', '"', '\n', '\r']) {
            self.text.push('"');
            self.text.push_str(&cell.replace('"', "\"\""));
            self.text.push('"');
        } else {
            self.text.push_str(cell);
        }
    }

    fn header(&mut self, names: &[&str]) {
        names.iter().for_each(|name| self.text(name));
    }

    fn integer(&mut self, value: Option<usize>) {
        self.text(&value.map(|v| v.to_string()).unwrap_or_default());
    }

    /// Adds a number. Errors: [`ExportError::NotFinite`] with the row as entry (1 = first row under
    /// the header).
    fn number(&mut self, name: &str, value: Option<f64>) -> Result<(), ExportError> {
        match value {
            None => self.text(""),
            Some(v) if v.is_finite() => self.text(&number(v)),
            Some(_) => {
                return Err(ExportError::NotFinite {
                    path: self.path.to_path_buf(),
                    field: name.to_owned(),
                    index: self.row,
                });
            }
        }
        Ok(())
    }

    fn pair_header(&mut self, pairs: &PairTable) {
        self.header(&["pair", "contact"]);
        for (heading, _) in &pairs.nodes {
            self.text(heading);
        }
        self.header(&["x_m", "y_m", "z_m", "area_m2"]);
    }

    fn pair_cells(&mut self, pairs: &PairTable, i: usize) -> Result<(), ExportError> {
        let pair = &pairs.rows[i];
        self.integer(Some(i));
        self.text(pairs.contacts.get(pair.contact).map_or("", String::as_str));
        for (_, tags) in &pairs.nodes {
            self.text(&tags[i].as_ref().map(u64::to_string).unwrap_or_default());
        }
        for (name, value) in ["x_m", "y_m", "z_m"].iter().zip(pair.position_m) {
            self.number(name, Some(value))?;
        }
        self.number("area_m2", pair.area_m2)
    }

    fn end_row(&mut self) {
        self.text.push('\n');
        self.row += 1;
        self.row_is_empty = true;
    }

    fn write(self) -> Result<(), ExportError> {
        write_file(self.path, self.text.as_bytes())
    }
}

/// Shortest text that reads back as the same number: plain for moderate numbers, with an exponent
/// for very large and very small ones.
pub fn number(v: f64) -> String {
    if v == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e9).contains(&v.abs()) {
        format!("{v}")
    } else {
        format!("{v:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_as_themselves() {
        let values = [
            0.0,
            1.0,
            -1.5,
            0.1 + 0.2,
            1e-300,
            6.02e23,
            -123456.789,
            f64::MIN_POSITIVE,
        ];
        for v in values {
            assert_eq!(number(v).parse::<f64>().unwrap().to_bits(), v.to_bits());
        }
    }

    #[test]
    fn cells_with_commas_and_quotes_are_quoted() {
        let mut table = Table::new(Path::new("t.csv"));
        table.header(&["a,b", "say \"x\"", ""]);
        table.end_row();
        assert_eq!(table.text, "\"a,b\",\"say \"\"x\"\"\",\n");
    }

    #[test]
    fn no_text_is_a_formula_and_numbers_stay_numbers() {
        let mut table = Table::new(Path::new("t.csv"));
        for text in ["=1+1", "+x", "-x", "@x", "\t=1", "-1.5e-3", "+2", "a=b"] {
            table.text(text);
        }
        table.number("a", Some(-1.5)).unwrap();
        table.end_row();
        let row = "'=1+1,'+x,'-x,'@x,'\t=1,-1.5e-3,+2,a=b,-1.5\n";
        assert_eq!(table.text, row);
    }

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
        };
        let rows = [
            row(ModeKind::Linear, None, 1),
            row(ModeKind::FlanksHeld, Some("a, \"b\""), 2),
        ];
        write_modes(&path, &rows).unwrap();
        assert_eq!(read_modes(&path), rows);
    }

    #[test]
    fn a_number_that_is_not_finite_is_an_error_with_its_place() {
        let mut table = Table::new(Path::new("t.csv"));
        table.end_row();
        let message = table
            .number("tip_amplitude_m", Some(f64::NAN))
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("t.csv") && message.contains("tip_amplitude_m"),
            "{message}"
        );
    }
}
