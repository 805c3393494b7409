//! Tables of a response: response.csv and tractions.csv.

use std::path::Path;

use super::solution::Solution;
use crate::ExportError;
use crate::table::Columns;
use dovetail_solver::description::EngineOrder;
use dovetail_solver::dlft::branch::stable;
use dovetail_solver::dlft::{Orbit, Outcome, Response};
use dovetail_solver::results::quantities::{linear_amplitude, phasors};
use dovetail_solver::run::{Observed, TractionPeak, TractionRange};

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
    table.add_solution("", solution, "frequency_hz");
    if let Some(order) = along {
        table.add("speed_rpm", move |(_, o)| order.speed_rpm(o.frequency_hz));
    }
    table.add_solution("", solution, "outcome");
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
    table.add_solution(
        "",
        solution,
        "slipping_pairs opening_pairs closing_pairs open_pairs stuck_pairs friction_power_w \
         viscous_power_w input_power_w retention_n newton_iterations krylov_iterations \
         residual harmonics",
    );
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

fn solution<'a>((_, orbit): &'a Row<'_>) -> Option<Solution<'a>> {
    Some(Solution {
        has_motion: orbit.outcome.has_motion(),
        ..Solution::of(orbit, 0)
    })
}

/// A cell that is empty unless a motion was found.
fn of_motion<T>(cell: impl Fn(&Orbit) -> Option<T>) -> impl Fn(&Row<'_>) -> Option<T> {
    move |(_, orbit)| cell(orbit).filter(|_| orbit.outcome.has_motion())
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
    table.add("stuck_pairs", |(_, _, peak, _)| peak.map(|p| p.pairs.stuck));
    table.add("slipping_pairs", |(_, _, peak, _)| {
        peak.map(|p| p.pairs.slipping)
    });
    table.add("opening_pairs", |(_, _, peak, _)| {
        peak.map(|p| p.pairs.opening)
    });
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
