//! Tables of pairs: static.csv, static_observed.csv and contact.csv.

use std::path::Path;

use crate::ExportError;
use crate::flank::{check_pairs, check_static};
use crate::table::Columns;
use dovetail_solver::dlft::{PairStatus, Response, StaticState};
use dovetail_solver::model::{Model, Observation};
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::peak::peak;
use dovetail_solver::results::quantities::{
    CycleFields, StaticFields, SweepFields, cycle_fields, static_fields, sweep_fields,
};

/// Writes static.csv: one row per pair. If the static state did not converge, `status` is the
/// outcome and the numbers are empty. `friction_t*_n` is the force that the body of the first flank
/// exerts on the body of the second.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_static(
    path: &Path,
    pairs: &PairTable,
    state: &StaticState,
) -> Result<(), ExportError> {
    let fields = static_fields(state, &pairs.rows);
    let count = pairs.rows.len();
    check_static(path, &fields, count)?;
    let valid = state.outcome.is_converged();
    let fields = &fields;
    let number =
        |cell: fn(&StaticFields, usize) -> f64| move |i: &usize| valid.then(|| cell(fields, *i));
    let pressure = number(|f, i| f.pressure_pa[i]);
    let mut table = pair_columns(pairs);
    table.add("normal_force_n", number(|f, i| f.normal_force_n[i]));
    table.add("pressure_pa", move |i| {
        pressure(i).filter(|_| pairs.rows[*i].area_m2.is_some())
    });
    table.add("friction_t1_n", number(|f, i| f.friction_n[i][0]));
    table.add("friction_t2_n", number(|f, i| f.friction_n[i][1]));
    table.add("slip_t1_m", number(|f, i| f.slip_m[i][0]));
    table.add("slip_t2_m", number(|f, i| f.slip_m[i][1]));
    table.add(
        "slip_m",
        number(|f, i| f.slip_m[i][0].hypot(f.slip_m[i][1])),
    );
    table.add("gap_m", number(|f, i| f.gap_m[i]));
    table.add("clearance_m", |i| pairs.rows[*i].gap_m);
    table.add("friction", |i| pairs.rows[*i].friction);
    table.add("status", move |i| {
        if valid {
            static_word(fields.status[*i]).to_owned()
        } else {
            state.outcome.to_string()
        }
    });
    table.write(path, &numbers(count))
}

/// Writes static_observed.csv: the observed displacements and strains in the static state, computed
/// from the displacements of all nodes of each body.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_static_observations(
    path: &Path,
    model: &Model,
    displacements_m: &[&[[f64; 3]]],
) -> Result<(), ExportError> {
    let mut table = Columns::default();
    table.add("name", |(observation, _): &(&Observation, f64)| {
        observation.name.as_str()
    });
    let of = |wanted| {
        move |(observation, value): &(&Observation, f64)| {
            Some(*value).filter(|_| observation.quantity == wanted)
        }
    };
    table.add("displacement_m", of(ObservedQuantity::Displacement));
    table.add("strain", of(ObservedQuantity::Strain));
    let rows = model.observations.iter().map(|observation| {
        let terms = observation.terms.iter().map(|&(at, direction)| {
            let u = displacements_m[at.body][at.node as usize];
            (0..3).map(|k| direction[k] * u[k]).sum::<f64>()
        });
        (observation, terms.sum())
    });
    table.write(path, &rows.collect::<Vec<_>>())
}

/// Writes contact.csv: one row per pair, at the peak of the first observation (columns `peak_...`,
/// empty if nothing converged) and over all converged frequencies.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_contact(
    path: &Path,
    pairs: &PairTable,
    response: &Response,
) -> Result<(), ExportError> {
    let count = pairs.rows.len();
    let at_peak = peak(response, 0).map(|p| &response.orbits[p.index]);
    if let Some(orbit) = at_peak {
        check_pairs(path, "pair cycles", orbit.cycles.len(), count)?;
    }
    let fields = at_peak.map(|orbit| cycle_fields(orbit, &pairs.rows));
    let fields = fields.as_ref();
    let swept = &sweep_fields(response, count);
    let mut table = pair_columns(pairs);
    table.add("peak_frequency_hz", move |_| {
        at_peak.map(|o| o.frequency_hz)
    });
    table.add("peak_status", move |i| {
        fields.map_or(String::new(), |f| f.status[*i].to_string())
    });
    type OfCycle = fn(&CycleFields) -> &[f64];
    let cycle = |per_area: bool, values: OfCycle| {
        move |i: &usize| {
            let known = !per_area || pairs.rows[*i].area_m2.is_some();
            fields.filter(|_| known).map(|f| values(f)[*i])
        }
    };
    table.add(
        "peak_pressure_mean_pa",
        cycle(true, |f| &f.pressure_mean_pa),
    );
    table.add("peak_pressure_min_pa", cycle(true, |f| &f.pressure_min_pa));
    table.add("peak_pressure_max_pa", cycle(true, |f| &f.pressure_max_pa));
    table.add("peak_slid_m", cycle(false, |f| &f.slid_m));
    table.add("peak_open_fraction", cycle(false, |f| &f.open_fraction));
    table.add("peak_friction_energy_j", move |i| {
        at_peak.map(|o| o.cycles[*i].friction_power_w / o.frequency_hz)
    });
    table.add(
        "peak_friction_energy_j_m2",
        cycle(true, |f| &f.friction_energy_j_m2),
    );
    let any = swept.points > 0;
    let mean = |values: fn(&SweepFields) -> &[f64]| move |i: &usize| any.then(|| values(swept)[*i]);
    table.add("friction_power_mean_w", mean(|s| &s.friction_power_mean_w));
    table.add("opening_share", mean(|s| &s.opening_share));
    table.add("opens_at_any_frequency", move |i| {
        any.then(|| swept.separates[*i].to_string())
    });
    table.add("converged_points", move |_| swept.points);
    table.write(path, &numbers(count))
}

/// The numbers of the pairs, which are the rows of a table of pairs.
pub(super) fn numbers(count: usize) -> Vec<usize> {
    (0..count).collect()
}

/// The columns that name and place a pair, by its number.
pub(super) fn pair_columns(pairs: &PairTable) -> Columns<'_, usize> {
    let mut table: Columns<'_, usize> = Columns::default();
    table.add("pair", |i| *i);
    table.add("contact", |i| {
        let contact = pairs.contacts.get(pairs.rows[*i].contact);
        contact.map(String::as_str)
    });
    for (heading, tags) in &pairs.nodes {
        table.add(heading.as_str(), |i| tags[*i].map(|tag| tag.to_string()));
    }
    for (k, name) in ["x_m", "y_m", "z_m"].into_iter().enumerate() {
        table.add(name, move |i| pairs.rows[*i].position_m[k]);
    }
    table.add("area_m2", |i| pairs.rows[*i].area_m2);
    table
}

fn static_word(status: PairStatus) -> &'static str {
    match status {
        PairStatus::Stuck => "stuck",
        PairStatus::Slipping => "slipping",
        PairStatus::Open => "open",
    }
}
