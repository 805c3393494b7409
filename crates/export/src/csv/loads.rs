//! Tables of loads of the parts: forces.csv, static_forces.csv and stress.csv.

use std::path::Path;

use crate::ExportError;
use crate::manifest::{PlaceSummary, StressSummary};
use crate::table::Columns;
use dovetail_solver::results::resultants::{Resultant, ends_of};
use dovetail_solver::results::stress::Singular;
use dovetail_solver::spectrum::{cosine, sine};

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
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        table.add(format!("about_{name}_m"), move |row| row.of.about_m[axis]);
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
    table.add("von_mises_mean_error_pa", |(_, place)| place.mean_error_pa);
    table.add("von_mises_amplitude_error_pa", |(_, place)| {
        place.amplitude_error_pa
    });
    table.add("von_mises_largest_error_pa", |(_, place)| {
        place.largest_error_pa
    });
    table.add("utilisation_error", |(_, place)| place.utilisation_error);
    let rows: Vec<_> = stress
        .places
        .iter()
        .chain(&stress.singular)
        .enumerate()
        .collect();
    table.write(path, &rows)
}
