//! Tables of a response: response.csv, tractions.csv and verify.csv.

use std::borrow::Cow;
use std::path::Path;

use super::solution::{STABILITY, SolutionRow, stability_word};
use crate::ExportError;
use crate::table::Columns;
use dovetail_solver::description::EngineOrder;
use dovetail_solver::dlft::branch::stable;
use dovetail_solver::dlft::{Orbit, Outcome, Response};
use dovetail_solver::integration::compare::{Comparison, PeriodFigures};
use dovetail_solver::results::quantities::{at_excitation_frequency, phasors};
use dovetail_solver::run::{Observed, TractionPeak, TractionRange};

/// Writes response.csv: one row per point, in the order in which each branch runs. `branch` counts
/// from 1. `stable` is `yes`, `no` or `not_judged`. `point` is the number of the point, which is also
/// in the name of its file of the flanks. Branches of twice the period follow, with `periods` 2.
/// Amplitudes are the largest departure from the mean in the period, or half of the range over two
/// periods. `<name>_h<k>_...` is harmonic
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
    let rows = rows(response);
    let harmonics = response.orbits.iter().map(|o| o.harmonics);
    let harmonics = harmonics.max().unwrap_or(0);
    let has_two_periods = rows.iter().any(|row| row.halves.is_some());
    let mut table: Columns<'_, ResponseRow<'_>> = Columns::default();
    table.add("point", |row| row.point);
    table.add("branch", |row| row.branch);
    table.add("periods", |row| if row.halves.is_some() { 2 } else { 1 });
    table.add("stable", |row| {
        let has_motion = row.orbit.outcome.has_motion();
        has_motion.then(|| stability_word(row.stable))
    });
    table.add_solution("", solution, "frequency_hz");
    if let Some(order) = along {
        table.add("speed_rpm", move |row| {
            order.speed_rpm(row.orbit.frequency_hz)
        });
    }
    table.add_solution("", solution, "outcome");
    for (i, Observed { name, quantity }) in observed.iter().enumerate() {
        let suffix = quantity.suffix();
        table.add(
            format!("{name}_amplitude_{suffix}"),
            motion_cell(move |o| o.observed_amplitude.get(i).copied()),
        );
        if has_two_periods {
            for (period, word) in ["first", "second"].into_iter().enumerate() {
                table.add(
                    format!("{name}_{word}_period_amplitude_{suffix}"),
                    move |row| Some(row.halves.as_ref()?.get(i)?[period]),
                );
            }
        }
        table.add(format!("{name}_linear_amplitude_{suffix}"), move |row| {
            row.linear.and_then(|linear| linear.get(i).copied())
        });
    }
    for (i, Observed { name, quantity }) in observed.iter().enumerate() {
        let suffix = quantity.suffix();
        for k in 0..harmonics {
            let phasor = move |o: &Orbit| phasors(o.observed.get(i)?).get(k).copied();
            let name = format!("{name}_h{}", k + 1);
            table.add(
                format!("{name}_amplitude_{suffix}"),
                motion_cell(move |o| Some(phasor(o)?.amplitude)),
            );
            table.add(
                format!("{name}_phase_rad"),
                motion_cell(move |o| Some(phasor(o)?.phase_rad)),
            );
        }
    }
    table.add_solution(
        "",
        solution,
        "slipping_pairs opening_pairs closing_pairs open_pairs stuck_pairs friction_power_w \
         friction_power_error_w viscous_power_w viscous_power_error_w input_power_w retention_n newton_iterations krylov_iterations \
         residual harmonics",
    );
    table.add("estimated_error", motion_cell(|o| o.estimated_error));
    for (i, Observed { name, .. }) in observed.iter().enumerate() {
        table.add(
            format!("{name}_estimated_error"),
            motion_cell(move |o| o.observed_error.get(i).copied()),
        );
    }
    table.add_solution("", solution, STABILITY);
    table.write(path, &rows)
}

/// Row of response.csv.
struct ResponseRow<'a> {
    /// Number of the point; `None` for a motion of two periods, which has no file of the flanks.
    point: Option<usize>,
    /// Number of the branch, counted from 1.
    branch: usize,
    stable: Option<bool>,
    /// Half of the range in each of two periods, for each observation; `None` for one period.
    halves: Option<Vec<[f64; 2]>>,
    /// Amplitudes of the linear reference.
    linear: Option<&'a [f64]>,
    orbit: Cow<'a, Orbit>,
}

/// Rows of a response, followed by the rows of its branches of twice the period.
fn rows(response: &Response) -> Vec<ResponseRow<'_>> {
    fn linear(of: &Response, at: usize) -> Option<&[f64]> {
        of.linear.get(at).map(|point| &point.observed_amplitude[..])
    }
    let verdicts = stable(response);
    let mut rows: Vec<ResponseRow<'_>> = Vec::new();
    for (at, orbit) in response.orbits.iter().enumerate() {
        rows.push(ResponseRow {
            point: Some(orbit.point),
            branch: response.branch_of(at) + 1,
            stable: verdicts[at],
            halves: None,
            linear: linear(response, at),
            orbit: Cow::Borrowed(orbit),
        });
    }
    for (number, doubled) in response.two_periods.iter().enumerate() {
        let verdicts = stable(doubled);
        for (at, orbit) in doubled.orbits.iter().enumerate() {
            let (motion, halves) = at_excitation_frequency(orbit);
            rows.push(ResponseRow {
                point: None,
                branch: response.branches.len() + number + 1,
                stable: verdicts[at],
                halves: Some(halves),
                linear: linear(doubled, at),
                orbit: Cow::Owned(motion),
            });
        }
    }
    rows
}

fn solution<'a>(row: &'a ResponseRow<'_>) -> Option<SolutionRow<'a>> {
    Some(SolutionRow {
        has_motion: row.orbit.outcome.has_motion(),
        ..SolutionRow::new(&row.orbit, 0)
    })
}

/// A cell that is empty unless a motion was found.
fn motion_cell<T>(cell: impl Fn(&Orbit) -> Option<T>) -> impl Fn(&ResponseRow<'_>) -> Option<T> {
    move |row| cell(&row.orbit).filter(|_| row.orbit.outcome.has_motion())
}

/// Writes tractions.csv: the peak from each starting traction, that of the load path first. A traction
/// without a static state or a motion has its outcome alone.
///
/// # Errors
/// [`ExportError`] if the table cannot be written.
pub fn write_tractions(path: &Path, range: &TractionRange) -> Result<(), ExportError> {
    /// Start, outcome, peak, and the numbers of points and of those that converged.
    type Row<'a> = (
        String,
        Outcome,
        Option<&'a TractionPeak>,
        Option<[usize; 2]>,
    );
    let mut table: Columns<'_, Row<'_>> = Columns::default();
    table.add("start", |row| row.0.clone());
    table.add("outcome", |row| row.1.to_string());
    table.add("peak_amplitude_m", |row| Some(row.2?.amplitude_m));
    table.add("peak_frequency_hz", |row| Some(row.2?.frequency_hz));
    table.add("loss_factor", |row| row.2?.loss_factor);
    table.add("stuck_pairs", |row| Some(row.2?.pairs.stuck));
    table.add("slipping_pairs", |row| Some(row.2?.pairs.slipping));
    table.add("opening_pairs", |row| Some(row.2?.pairs.opening));
    table.add("points", |row| row.3.map(|[all, _]| all));
    table.add("converged_points", |row| row.3.map(|[_, n]| n));
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
        figures: &'a PeriodFigures,
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
        (!r.integrated).then(|| stability_word(Some(r.of.is_stable)))
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
