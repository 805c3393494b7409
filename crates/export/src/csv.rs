//! Writes the tables: response.csv, tractions.csv, static.csv, static_forces.csv,
//! static_observed.csv, contact.csv, forces.csv, stress.csv, modes.csv, peaks.csv, curve.csv, backbone.csv,
//! wear.csv, wear_pairs.csv, verify.csv. Each table is one list of columns ([`super::table`]).

use std::path::Path;

use super::ExportError;
use super::flank::{check_pairs, check_static};
use super::manifest::{PlaceSummary, StressSummary};
use super::table::Columns;
use dovetail_solver::description::EngineOrder;
use dovetail_solver::dlft::backbone::BackbonePoint;
use dovetail_solver::dlft::branch::{ValueCurve, stable};
use dovetail_solver::dlft::{
    CycleCounts, CycleStatus, Orbit, Outcome, PairStatus, Response, StaticState,
};
use dovetail_solver::integration::compare::{Comparison, Figures};
use dovetail_solver::model::{Model, Observation};
use dovetail_solver::reduced::Quantity;
use dovetail_solver::results::modes::{ModeKind, NaturalFrequency};
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::{
    CycleFields, StaticFields, cycle_fields, linear_amplitude, loss_factor, modal_mass_kg, peak,
    phasors, static_fields, sweep_fields,
};
use dovetail_solver::results::resultants::{Resultant, ends_of};
use dovetail_solver::results::stress::Singular;
use dovetail_solver::run::{
    Crossing, CrossingPeak, Family, NodalDiameters, Observed, PeakAt, Peaks, TractionPeak,
    TractionRange, WearBlock, WearCourse,
};
use dovetail_solver::spectrum::{cosine, sine};
use dovetail_superelement::input;

/// Name of the assembly in the tables, where other rows have the name of a body.
pub const ASSEMBLY: &str = "assembly";

/// Writes response.csv: one row per point, in the order in which each branch runs. `branch` counts
/// from 1. `stable` is empty on a grid. `point` is the number of the point, which is also in the
/// name of its file of the flanks.
/// Amplitudes are the largest departure from the mean in the period. `<name>_h<k>_...` is harmonic
/// k as `A cos(k w t - phase)`. `<name>_linear_amplitude_m` is the amplitude of the linear
/// reference. Of a strain, `_strain` stands in place of `_m`. A point that did not converge keeps its
/// outcome, iterations, residual and linear amplitude; its other cells are empty.
///
/// `observed` are the observations. `along` is the engine order of a run-up, whose rows have a
/// speed, `speed_rpm`.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_response(
    path: &Path,
    observed: &[Observed],
    response: &Response,
    along: Option<EngineOrder>,
) -> Result<(), ExportError> {
    let harmonics = response.orbits.iter().map(|o| o.harmonics);
    let harmonics = harmonics.max().unwrap_or(0);
    let stable = response.is_followed().then(|| stable(response));
    let mut table: Columns<'_, Row<'_>> = Columns::default();
    table.add("point", |(_, o)| o.point);
    table.add("branch", |(row, _)| response.branch_of(*row) + 1);
    table.add("stable", |(row, o)| {
        let stable = stable.as_ref().filter(|_| o.outcome.has_motion());
        stable.map(|stable| stable[*row].to_string())
    });
    table.add("frequency_hz", |(_, o)| o.frequency_hz);
    if let Some(order) = along {
        table.add("speed_rpm", move |(_, o)| order.speed_rpm(o.frequency_hz));
    }
    table.add("outcome", |(_, o)| o.outcome.to_string());
    for (i, Observed { name, quantity }) in observed.iter().enumerate() {
        let suffix = quantity.suffix();
        table.add(
            format!("{name}_amplitude_{suffix}"),
            of_motion(move |o| o.observed_amplitude.get(i).copied()),
        );
        table.add(
            format!("{name}_linear_amplitude_{suffix}"),
            move |(_, o)| linear_amplitude(response, o.frequency_hz, i),
        );
    }
    for (i, Observed { name, quantity }) in observed.iter().enumerate() {
        let suffix = quantity.suffix();
        for k in 0..harmonics {
            let phasor = move |o: &Orbit| phasors(o.observed.get(i)?).get(k).copied();
            let name = format!("{name}_h{}", k + 1);
            table.add(
                format!("{name}_amplitude_{suffix}"),
                of_motion(move |o| Some(phasor(o)?.amplitude)),
            );
            table.add(
                format!("{name}_phase_rad"),
                of_motion(move |o| Some(phasor(o)?.phase_rad)),
            );
        }
    }
    type Count = fn(&CycleCounts) -> usize;
    let counts: [(&str, Count); 5] = [
        ("slipping_pairs", |c| c.slipping),
        ("opening_pairs", |c| c.opening),
        ("closing_pairs", |c| c.closing),
        ("open_pairs", |c| c.open),
        ("stuck_pairs", |c| c.stuck),
    ];
    for (name, count) in counts {
        table.add(name, of_motion(move |o| Some(count(&o.counts()))));
    }
    table.add("friction_power_w", of_motion(|o| Some(o.friction_power_w)));
    table.add("viscous_power_w", of_motion(|o| Some(o.viscous_power_w)));
    table.add("input_power_w", of_motion(|o| Some(o.input_power_w)));
    table.add("retention_n", of_motion(|o| Some(o.retention_n)));
    table.add("newton_iterations", |(_, o)| o.newton_iterations);
    table.add("krylov_iterations", |(_, o)| o.krylov_iterations);
    table.add("residual", |(_, o)| {
        Some(o.residual).filter(|r| r.is_finite())
    });
    table.add("harmonics", |(_, o)| o.harmonics);
    table.add("estimated_error", of_motion(|o| o.estimated_error));
    for (i, Observed { name, .. }) in observed.iter().enumerate() {
        table.add(
            format!("{name}_estimated_error"),
            of_motion(move |o| o.observed_error.get(i).copied()),
        );
    }
    let rows: Vec<Row<'_>> = response.orbits.iter().enumerate().collect();
    table.write(path, &rows)
}

/// Row of response.csv: its number from 0, and its motion.
type Row<'a> = (usize, &'a Orbit);

/// A cell that is empty unless a motion was found.
fn of_motion<T>(cell: impl Fn(&Orbit) -> Option<T>) -> impl Fn(&Row<'_>) -> Option<T> {
    move |(_, orbit)| cell(orbit).filter(|_| orbit.outcome.has_motion())
}

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
    let mut table = of_pairs(pairs);
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
    table.add("displacement_m", of(Quantity::Displacement));
    table.add("strain", of(Quantity::Strain));
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
    let mut table = of_pairs(pairs);
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
    table.add("friction_power_mean_w", move |i| {
        any.then(|| swept.friction_power_mean_w[*i])
    });
    table.add("opening_share", move |i| {
        any.then(|| swept.opening_share[*i])
    });
    table.add("opens_at_any_frequency", move |i| {
        any.then(|| swept.separates[*i].to_string())
    });
    table.add("converged_points", move |_| swept.points);
    table.write(path, &numbers(count))
}

/// The numbers of the pairs, which are the rows of a table of pairs.
fn numbers(count: usize) -> Vec<usize> {
    (0..count).collect()
}

/// The columns that name and place a pair, by its number.
fn of_pairs(pairs: &PairTable) -> Columns<'_, usize> {
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

/// Writes forces.csv or static_forces.csv: force and moment of each contact, support and spring to
/// ground, one row for each component, with the body of these names that is pushed and the point
/// that moments are about. Over a period `mean`, `h<k>_cos` and `h<k>_sin` are the harmonics, `least`
/// and `largest` the ends, in N or N m; in the static state there is one `value`.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_forces(
    path: &Path,
    bodies: &[&str],
    resultants: &[Resultant],
) -> Result<(), ExportError> {
    struct Row<'a> {
        of: &'a Resultant,
        component: String,
        coefficients: Vec<f64>,
        ends: [f64; 2],
    }
    let rows = resultants.iter().flat_map(|of| {
        let kinds = [("force", "n", &of.force_n), ("moment", "nm", &of.moment_nm)];
        kinds.into_iter().flat_map(move |(kind, unit, values)| {
            let axes = ["x", "y", "z"].into_iter().enumerate();
            axes.map(move |(k, axis)| {
                let coefficients: Vec<f64> = values.iter().map(|v| v[k]).collect();
                Row {
                    of,
                    component: format!("{kind}_{axis}_{unit}"),
                    ends: ends_of(&coefficients),
                    coefficients,
                }
            })
        })
    });
    let rows: Vec<Row<'_>> = rows.collect();
    let mut table: Columns<'_, Row<'_>> = Columns::default();
    table.add("of", |row| row.of.pusher.id().to_owned());
    table.add("name", |row| row.of.name.clone());
    table.add("body", |row| bodies[row.of.body].to_owned());
    for (axis, name) in ["about_x_m", "about_y_m", "about_z_m"]
        .into_iter()
        .enumerate()
    {
        table.add(name, move |row| row.of.about_m[axis]);
    }
    table.add("component", |row| row.component.clone());
    let harmonics = rows.first().map_or(0, |row| row.coefficients.len() / 2);
    if harmonics == 0 {
        table.add("value", |row| row.coefficients[0]);
        return table.write(path, &rows);
    }
    table.add("mean", |row| row.coefficients[0]);
    for k in 1..=harmonics {
        table.add(format!("h{k}_cos"), move |row| row.coefficients[cosine(k)]);
        table.add(format!("h{k}_sin"), move |row| row.coefficients[sine(k)]);
    }
    table.add("least", |row| row.ends[0]);
    table.add("largest", |row| row.ends[1]);
    table.write(path, &rows)
}

/// Writes stress.csv: the places with the highest stress, in their order, then the highest of those
/// that are singular, with the reason.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_stress(path: &Path, stress: &StressSummary) -> Result<(), ExportError> {
    let mut table: Columns<'_, (usize, &PlaceSummary)> = Columns::default();
    table.add("place", |(i, place)| {
        place.singular.is_none().then_some(i + 1)
    });
    table.add("singular", |(_, place)| place.singular.map(Singular::words));
    table.add("body", |(_, place)| place.body.clone());
    table.add("node_tag", |(_, place)| place.node_tag as usize);
    for (axis, name) in ["x_m", "y_m", "z_m"].into_iter().enumerate() {
        table.add(name, move |(_, place)| place.position_m[axis]);
    }
    table.add("von_mises_mean_pa", |(_, place)| place.mean_pa);
    table.add("von_mises_amplitude_pa", |(_, place)| place.amplitude_pa);
    table.add("von_mises_largest_pa", |(_, place)| place.largest_pa);
    table.add("utilisation", |(_, place)| place.utilisation);
    let rows: Vec<_> = stress
        .places
        .iter()
        .chain(&stress.singular)
        .enumerate()
        .collect();
    table.write(path, &rows)
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
pub fn write_campbell(path: &Path, families: &[Family]) -> Result<(), ExportError> {
    struct Row<'a> {
        family: &'a Family,
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

/// Writes tractions.csv: the peak from each starting traction, that of the load path first. A traction
/// without a static state or a motion has its outcome alone.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_tractions(path: &Path, range: &TractionRange) -> Result<(), ExportError> {
    type Row<'a> = (
        String,
        Outcome,
        Option<&'a TractionPeak>,
        Option<[usize; 2]>,
    );
    let mut table: Columns<'_, Row<'_>> = Columns::default();
    table.add("start", |(start, ..)| start.clone());
    table.add("outcome", |(_, outcome, ..)| outcome.to_string());
    table.add("peak_amplitude_m", |(_, _, peak, _)| {
        peak.map(|p| p.amplitude_m)
    });
    table.add("peak_frequency_hz", |(_, _, peak, _)| {
        peak.map(|p| p.frequency_hz)
    });
    table.add("loss_factor", |(_, _, peak, _)| {
        peak.and_then(|p| p.loss_factor)
    });
    type Count = fn(&CycleCounts) -> usize;
    let counts: [(&str, Count); 3] = [
        ("stuck_pairs", |c| c.stuck),
        ("slipping_pairs", |c| c.slipping),
        ("opening_pairs", |c| c.opening),
    ];
    for (name, count) in counts {
        table.add(name, move |(_, _, peak, _): &Row<'_>| {
            peak.map(|p| count(&p.pairs))
        });
    }
    table.add("points", |(.., points)| points.map(|[all, _]| all));
    table.add("converged_points", |(.., points)| points.map(|[_, n]| n));
    let own = (
        "load_path".to_owned(),
        Outcome::Converged,
        range.own.as_ref(),
        None,
    );
    let others = range.others.iter().map(|other| {
        let points = other.response.as_ref().map(|response| {
            let converged = response.orbits.iter().filter(|o| o.outcome.is_converged());
            [response.orbits.len(), converged.count()]
        });
        (
            other.start.to_string(),
            other.outcome,
            other.peak.as_ref(),
            points,
        )
    });
    let rows: Vec<Row<'_>> = std::iter::once(own).chain(others).collect();
    table.write(path, &rows)
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
    let mut table: Columns<'_, Crossing> = Columns::default();
    table.add("speed_rpm", |c| c.speed_rpm);
    add_mode(&mut table, |c| (c.kind, c.body.as_deref(), c.mode));
    if rows.iter().any(|crossing| crossing.wave.is_some()) {
        table.add("nodal_diameter", |c| c.wave.map(|wave| wave.nodal_diameter));
    }
    table.add("engine_order", |c| c.engine_order);
    table.add("frequency_hz", |c| c.frequency_hz);
    table.add("margin", move |c| {
        (operating_rpm > 0.0).then(|| c.margin(operating_rpm))
    });
    if !peaks.is_empty() {
        let peak = move |c: &Crossing| {
            let own = peaks.iter().find(|peak| peak.crossing == *c)?;
            own.peak.as_ref().ok()
        };
        table.add("peak_amplitude_m", move |c| {
            peak(c).map(|at| at.amplitude_m(0))
        });
        table.add("peak_frequency_hz", move |c| {
            peak(c).map(|at| at.orbit.frequency_hz)
        });
        table.add("linear_peak_amplitude_m", move |c| peak(c)?.linear_m);
        table.add("peak_outcome", move |c| {
            peak(c).map(|at| at.orbit.outcome.to_string())
        });
        table.add("peak_estimated_error", move |c| {
            peak(c)?.orbit.amplitude_error(0)
        });
        table.add("slipping_pairs", move |c| {
            peak(c).map(|at| at.orbit.counts().slipping)
        });
        table.add("opening_pairs", move |c| {
            peak(c).map(|at| at.orbit.counts().opening)
        });
    }
    table.write(path, rows)
}

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
    pub fn of(also: Option<f64>, peaks: &'a Peaks) -> Vec<Self> {
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
}

/// Area of the pairs that open in the period, m2; `None` where an area is unknown.
fn opening_area_m2(orbit: &Orbit, pairs: &PairTable) -> Option<f64> {
    let cycles = orbit.cycles.iter().zip(&pairs.rows);
    let opening = cycles.filter(|(cycle, _)| cycle.status == CycleStatus::Opening);
    opening.map(|(_, pair)| pair.area_m2).sum()
}

/// Largest distance slid by a pair in a period, m.
fn largest_slid_m(orbit: &Orbit) -> Option<f64> {
    let slid = orbit.cycles.iter().map(|cycle| cycle.slid_m);
    slid.reduce(f64::max)
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
    table.add("amplitude_m", PeakRow::amplitude_m);
    table.add("frequency_hz", |row| row.peak.orbit.frequency_hz);
    table.add("outcome", |row| row.peak.orbit.outcome.to_string());
    table.add("linear_amplitude_m", |row| row.peak.linear_m);
    table.add("ratio", |row| {
        let linear_m = row.peak.linear_m?;
        Some(row.amplitude_m() / linear_m)
    });
    table.add("loss_factor", |row| loss_factor(&row.peak.orbit));
    table.add("modal_mass_kg", |row| {
        modal_mass_kg(&row.peak.orbit, row.observation)
    });
    table.add("friction_power_w", |row| row.peak.orbit.friction_power_w);
    table.add("viscous_power_w", |row| row.peak.orbit.viscous_power_w);
    table.add("slipping_pairs", |row| row.peak.orbit.counts().slipping);
    table.add("opening_pairs", |row| row.peak.orbit.counts().opening);
    table.add("opening_area_m2", |row| {
        opening_area_m2(&row.peak.orbit, row.pairs)
    });
    table.add("largest_slid_m", |row| largest_slid_m(&row.peak.orbit));
    table.add("retention_n", |row| row.peak.orbit.retention_n);
    table.add("harmonics", |row| row.peak.orbit.harmonics);
    table.add("estimated_error", |row| {
        row.peak.orbit.amplitude_error(row.observation)
    });
    table.write(path, rows)
}

/// Row of curve.csv.
#[derive(Debug, Clone, Copy)]
pub struct CurveRow<'a> {
    /// Number of the motion in the order of the branches.
    index: usize,
    /// Number of its branch, counted from 1.
    branch: usize,
    /// True if the motion is stable.
    is_stable: bool,
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
    pub fn of(curve: &'a ValueCurve, pairs: &'a PairTable, observation: usize) -> Vec<Self> {
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

    /// What `of` has of a motion; `None` where there is none.
    fn of_motion<T>(&self, of: impl FnOnce(&Orbit) -> T) -> Option<T> {
        self.orbit.outcome.has_motion().then(|| of(self.orbit))
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
    table.add("stable", |row| row.of_motion(|_| row.is_stable.to_string()));
    table.add("length", |row| row.length);
    table.add(key, |row| row.value);
    table.add("amplitude_m", |row| row.of_motion(|_| row.amplitude_m()));
    table.add("frequency_hz", |row| row.orbit.frequency_hz);
    table.add("outcome", |row| row.orbit.outcome.to_string());
    table.add("linear_amplitude_m", |row| row.linear_m);
    table.add("ratio", |row| {
        let linear_m = row.linear_m?;
        row.of_motion(|_| row.amplitude_m() / linear_m)
    });
    table.add("loss_factor", |row| row.of_motion(loss_factor)?);
    table.add("friction_power_w", |row| {
        row.of_motion(|orbit| orbit.friction_power_w)
    });
    table.add("viscous_power_w", |row| {
        row.of_motion(|orbit| orbit.viscous_power_w)
    });
    table.add("slipping_pairs", |row| {
        row.of_motion(|orbit| orbit.counts().slipping)
    });
    table.add("opening_pairs", |row| {
        row.of_motion(|orbit| orbit.counts().opening)
    });
    table.add("opening_area_m2", |row| {
        row.of_motion(|orbit| opening_area_m2(orbit, row.pairs))?
    });
    table.add("largest_slid_m", |row| row.of_motion(largest_slid_m)?);
    table.add("retention_n", |row| {
        row.of_motion(|orbit| orbit.retention_n)
    });
    table.add("harmonics", |row| row.orbit.harmonics);
    table.add("estimated_error", |row| {
        row.of_motion(|orbit| orbit.amplitude_error(row.observation))?
    });
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
}

/// Writes backbone.csv: one row for each amplitude.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_backbone(path: &Path, rows: &[BackboneRow<'_>]) -> Result<(), ExportError> {
    let mut table: Columns<'_, BackboneRow<'_>> = Columns::default();
    table.add("amplitude_m", BackboneRow::amplitude_m);
    table.add("frequency_hz", |row| row.point.orbit.frequency_hz);
    table.add("outcome", |row| row.point.orbit.outcome.to_string());
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
    table.add("friction_power_w", |row| row.point.orbit.friction_power_w);
    table.add("viscous_power_w", |row| row.point.orbit.viscous_power_w);
    table.add("power_defect", |row| row.point.power_defect());
    table.add("stuck_pairs", |row| row.point.orbit.counts().stuck);
    table.add("slipping_pairs", |row| row.point.orbit.counts().slipping);
    table.add("opening_pairs", |row| row.point.orbit.counts().opening);
    table.add("closing_pairs", |row| row.point.orbit.counts().closing);
    table.add("open_pairs", |row| row.point.orbit.counts().open);
    table.add("retention_n", |row| row.point.orbit.retention_n);
    table.add("harmonics", |row| row.point.orbit.harmonics);
    table.add("estimated_error", |row| row.point.estimated_error);
    table.write(path, rows)
}

/// Writes wear.csv: one row for the beginning and one for each block. A mission of several parts has
/// the columns of their vibrations with `part<n>_` before them.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_wear(path: &Path, course: &WearCourse<'_>) -> Result<(), ExportError> {
    let mut table: Columns<'_, &WearBlock> = Columns::default();
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    table.add("cycles", |block| block.cycles);
    table.add("seconds", |block| block.seconds);
    table.add("largest_depth_m", move |block| largest(&block.depth_m));
    table.add("mean_depth_m", |block| course.mean_depth_m(block));
    table.add("volume_m3", |block| course.volume_m3(block));
    table.add("volume_per_cycle_m3", |block| course.volume_rate_m3(block));
    table.add("friction_power_w", |block| course.friction_power_w(block));
    table.add("compression_n", |block| block.at_rest_n.iter().sum::<f64>());
    table.add("largest_pressure_pa", |block| {
        let pairs = block.at_rest_n.iter().zip(course.area_m2);
        pairs.map(|(force, area)| force / area).fold(0.0, f64::max)
    });
    for part in 0..course.mission.len() {
        let named = |name: &str| match course.mission {
            [_] => name.to_owned(),
            _ => format!("part{}_{name}", part + 1),
        };
        table.add(named("frequency_hz"), move |b| b.motions[part].frequency_hz);
        table.add(named("amplitude_m"), move |b| {
            b.motions[part].observed_amplitude[course.observation]
        });
        table.add(named("outcome"), move |b| {
            b.motions[part].outcome.to_string()
        });
        table.add(named("slipping_pairs"), move |b| {
            b.motions[part].counts().slipping
        });
        table.add(named("opening_pairs"), move |b| {
            b.motions[part].counts().opening
        });
        table.add(named("largest_slid_m"), move |b| {
            let slid = b.motions[part].cycles.iter().map(|cycle| cycle.slid_m);
            slid.fold(0.0, f64::max)
        });
        table.add(named("estimated_error"), move |b| {
            b.motions[part].amplitude_error(course.observation)
        });
    }
    table.add("block_error", |block| block.error);
    table.add("block_steps", |block| block.steps);
    table.write(path, &course.blocks.iter().collect::<Vec<_>>())
}

/// Writes wear_pairs.csv: each pair with its depth, the depth that it wears in a cycle, and its
/// static pressure, after the last block.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_wear_pairs(
    path: &Path,
    pairs: &PairTable,
    area_m2: &[f64],
    block: &WearBlock,
) -> Result<(), ExportError> {
    let mut table = of_pairs(pairs);
    table.add("worn_depth_m", |i| block.depth_m[*i]);
    table.add("depth_per_cycle_m", |i| block.rate_m[*i]);
    table.add("static_pressure_pa", |i| block.at_rest_n[*i] / area_m2[*i]);
    table.write(path, &numbers(pairs.rows.len()))
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
    let text = match input::bytes(path) {
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
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_verification(path: &Path, comparisons: &[Comparison]) -> Result<(), ExportError> {
    const DIFFERENCES: [&str; 4] = [
        "amplitude_difference",
        "h1_amplitude_difference",
        "contact_work_difference",
        "input_work_difference",
    ];
    struct Row<'a> {
        of: &'a Comparison,
        figures: &'a Figures,
        integrated: bool,
    }
    let rows = comparisons.iter().flat_map(|of| {
        [(&of.balance, false), (&of.integration, true)].map(|(figures, integrated)| Row {
            of,
            figures,
            integrated,
        })
    });
    let mut table: Columns<'_, Row<'_>> = Columns::default();
    table.add("frequency_hz", |r| r.of.frequency_hz);
    table.add("method", |r| {
        if r.integrated {
            "integration"
        } else {
            "balance"
        }
    });
    table.add("harmonics", |r| (!r.integrated).then_some(r.of.harmonics));
    table.add("stable", |r| {
        (!r.integrated).then(|| r.of.is_stable.to_string())
    });
    table.add("periods", |r| r.integrated.then_some(r.of.periods));
    table.add("steady", |r| {
        r.integrated
            .then_some(if r.of.steady { "yes" } else { "no" })
    });
    table.add("transient_left", |r| {
        let left = r.of.transient_left;
        (r.integrated && left.is_finite()).then_some(left)
    });
    table.add("amplitude_m", |r| r.figures.amplitude_m);
    table.add("h1_amplitude_m", |r| r.figures.first_harmonic_m);
    table.add("contact_work_j", |r| r.figures.contact_work_j);
    table.add("damping_work_j", |r| r.figures.viscous_work_j);
    table.add("input_work_j", |r| r.figures.input_work_j);
    table.add("slipping_pairs", |r| r.figures.pairs.slipping);
    table.add("opening_pairs", |r| r.figures.pairs.opening);
    for (k, name) in DIFFERENCES.into_iter().enumerate() {
        table.add(name, move |r| {
            r.of.differences()[k].filter(|_| r.integrated)
        });
    }
    table.add("retention_n", |r| r.of.retention_n);
    table.write(path, &rows.collect::<Vec<_>>())
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
