//! Answers as texts: table.csv, summary.json, and the lines for the reader.

use std::path::Path;

use serde_json::{Value, json};

use super::analysis::{Analysis, Refinement};
use super::cases::words;
use super::designs::Minimum;
use super::error::StudyError;
use super::file::Study;
use super::folder::write_json;
use super::parameter::{Kind, Parameter};
use super::results::{CaseResult, Ended, Figures};
use crate::export::table::{Cell, Columns};
use crate::version;

/// Cell of a case in a column.
pub type OfCase = fn(&CaseResult) -> Cell;

/// Last columns of a table of cases.
pub const OF_RUNS: [(&str, OfCase); 7] = [
    ("processor_seconds", |r| of(r, |f| f.processor_seconds)),
    ("seconds", |r| of(r, |f| Some(f.seconds))),
    ("peak_memory_mib", |r| of(r, |f| f.peak_memory_mib)),
    ("from_cache", |r| {
        of(r, |f| {
            let stages = f.from_cache.iter().map(|s| s.id());
            Some(stages.collect::<Vec<_>>().join(" "))
        })
    }),
    ("outcome", |r| r.outcome().into()),
    ("points", |r| of(r, |f| Some(f.points))),
    ("unconverged_points", |r| of(r, |f| Some(f.unconverged))),
];

/// A cell that is empty if the case has no figures.
fn of<T: Into<Cell>>(result: &CaseResult, cell: fn(&Figures) -> Option<T>) -> Cell {
    result.figures().and_then(cell).into()
}

/// Writes table.csv: one row per case.
pub fn write_table(
    path: &Path,
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
) -> Result<(), StudyError> {
    type Row<'a> = (&'a CaseResult, &'a Vec<Option<f64>>);
    let mut table: Columns<'_, Row<'_>> = Columns::default();
    table.add("case", |(r, _)| r.case.slug.clone());
    for (k, parameter) in study.parameters.iter().enumerate() {
        table.add(parameter.name.as_str(), move |(r, _)| {
            r.case.labels(study)[k]
        });
    }
    for figure in &analysis.figures {
        table.add(figure.heading.as_str(), |(r, _)| r.value(&figure.heading));
    }
    let differences = analysis.figures.iter().enumerate();
    for (k, figure) in differences.filter(|_| !analysis.refinements.is_empty()) {
        let heading = format!("difference_{}", figure.heading);
        table.add(heading, move |(_, differences)| differences[k]);
    }
    for (heading, cell) in OF_RUNS {
        table.add(heading, move |(r, _)| cell(r));
    }
    let rows: Vec<Row<'_>> = results.iter().zip(&analysis.differences).collect();
    Ok(table.write(path, &rows)?)
}

/// Writes summary.json: the answers for programs.
pub fn write_summary(
    path: &Path,
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
) -> Result<(), StudyError> {
    let failed = results.iter().filter_map(|r| match &r.ended {
        Ended::Failed { exit_code, message } => Some(json!({
            "case": r.case.slug, "exit_code": exit_code, "message": message,
        })),
        _ => None,
    });
    let parameter = |p: &Parameter| {
        let labels = p.values.iter().map(|v| &v.label);
        json!({ "name": p.name, "is": p.kind.word(), "values": labels.collect::<Vec<_>>() })
    };
    let of_one = |r: &Refinement| refinement(study, results, r);
    let least = |m: &Minimum| minimum(study, results, m);
    let summary = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "commit": version::commit(),
        "day": day(results),
        "study": study.name,
        "scene": study.scene,
        "cases": results.len(),
        "complete": results.iter().filter(|r| r.figures().is_some()).count(),
        "failed": failed.collect::<Vec<_>>(),
        "parameters": study.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "refinements": analysis.refinements.iter().map(of_one).collect::<Vec<_>>(),
        "minima": analysis.designs.minima.iter().map(least).collect::<Vec<_>>(),
    });
    write_json(path, &summary)
}

/// Last day on which a case was run; empty if none was.
pub fn day(results: &[CaseResult]) -> &str {
    let days = results.iter().filter_map(|r| r.figures());
    days.map(|f| f.day.as_str()).max().unwrap_or("")
}

/// Name and value of each parameter that is `wanted`.
fn labels(study: &Study, values: &[usize], wanted: impl Fn(&Parameter) -> bool) -> Value {
    let parameters = study.parameters.iter().zip(values);
    let wanted = parameters.filter(|(p, _)| wanted(p));
    let labels = wanted.map(|(p, v)| (p.name.clone(), json!(p.values[*v].label)));
    Value::Object(labels.collect())
}

fn refinement(study: &Study, results: &[CaseResult], refinement: &Refinement) -> Value {
    let parameter = &study.parameters[refinement.parameter];
    let cases = refinement.cases.iter().map(|c| &results[*c].case.slug);
    json!({
        "parameter": parameter.name,
        "at": labels(study, &refinement.at, |p| !p.is_numerical()),
        "sizes": parameter.sizes(),
        "cases": cases.collect::<Vec<_>>(),
        "figures": refinement.figures,
    })
}

fn minimum(study: &Study, results: &[CaseResult], minimum: &Minimum) -> Value {
    let mut summary = json!({
        "figure": minimum.heading,
        "loads": labels(study, &minimum.at, |p| p.is(Kind::Load)),
        "cases_without": minimum.cases_without,
        "value": null,
    });
    if let Some(least) = &minimum.least {
        let case = &results[least.case];
        let ends = least.at_ends.iter();
        let ends = ends.map(|(k, end)| (study.parameters[*k].name.clone(), json!(end)));
        summary["value"] = json!(least.value);
        summary["case"] = json!(case.case.slug);
        summary["outcome"] = json!(case.outcome());
        summary["design"] = labels(study, &case.case.values, |p| p.is(Kind::Design));
        summary["peak_at_end_of_range"] = json!(case.peak_at_end_of_range());
        summary["at_ends"] = Value::Object(ends.collect());
        summary["other_cases"] = json!(least.other_cases);
    }
    summary
}

/// Smallest value of each figure to be minimised, on one line for each load.
pub fn least_values(study: &Study, results: &[CaseResult], analysis: &Analysis) -> Vec<String> {
    let line = |minimum: &Minimum| {
        let load = match words(study, &minimum.at, |p| p.is(Kind::Load)) {
            none if none.is_empty() => none,
            load => format!(" at {load}"),
        };
        let all = minimum.cases;
        let Some(least) = &minimum.least else {
            return format!("{}{load}: none of {all} cases has a value", minimum.heading);
        };
        let case = &results[least.case];
        let figure = &least.figure;
        let mut line = format!(
            "least {}{load}: {} with {} (case {}, {})",
            figure.name,
            figure.words(least.value),
            words(study, &case.case.values, |p| p.is(Kind::Design)),
            case.case.slug,
            case.outcome(),
        );
        for (k, end) in &least.at_ends {
            let name = &study.parameters[*k].name;
            line += &format!("; this is the {end} value of {name}: less may lie beyond");
        }
        if figure.heading.starts_with("peak_") && case.peak_at_end_of_range() {
            line += "; its peak is at an end of the frequencies and may be higher outside";
        }
        match least.other_cases {
            0 => {}
            1 => line += "; 1 other case has the same value",
            n => line += &format!("; {n} other cases have the same value"),
        }
        if minimum.cases_without > 0 {
            line += &format!("; of {all} cases {} have no value", minimum.cases_without);
        }
        line
    };
    analysis.designs.minima.iter().map(line).collect()
}

/// Remarks about single cases.
pub fn remarks(results: &[CaseResult]) -> Vec<String> {
    let mut remarks = Vec::new();
    for result in results {
        let slug = &result.case.slug;
        match &result.ended {
            Ended::Failed { exit_code, message } => {
                let code = exit_code.map_or("a signal".into(), |code| format!("exit code {code}"));
                remarks.push(format!("case {slug} ended with {code}: {message}"));
            }
            Ended::NotRun => remarks.push(format!("case {slug} has no result")),
            Ended::WithFigures(figures) if figures.unconverged > 0 => remarks.push(format!(
                "case {slug}: {} of {} frequencies did not converge",
                figures.unconverged, figures.points
            )),
            Ended::WithFigures(_) => {}
        }
        if result.peak_at_end_of_range() {
            remarks.push(format!(
                "case {slug}: the peak is at an end of its frequencies and may be higher outside"
            ));
        }
    }
    remarks
}
