//! Table of a verification, verify.csv.

use std::path::Path;

use crate::ExportError;
use crate::table::Columns;
use dovetail_solver::integration::compare::{Comparison, Figures};

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
