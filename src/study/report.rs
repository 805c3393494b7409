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
use super::results::{CaseResult, Ended};
use crate::export::csv;
use crate::version;

/// Last columns of a table of cases.
pub const OF_RUNS: [&str; 7] = [
    "processor_seconds",
    "seconds",
    "peak_memory_mib",
    "from_cache",
    "outcome",
    "points",
    "unconverged_points",
];

/// Cells of a case in the columns [`OF_RUNS`]; empty if unknown.
pub fn of_run(result: &CaseResult, number: &dyn Fn(f64) -> String) -> [String; 7] {
    let Some(f) = result.figures() else {
        let mut cells = [const { String::new() }; 7];
        cells[4] = result.outcome().to_owned();
        return cells;
    };
    let stages = f.from_cache.iter().map(|s| s.id());
    [
        f.processor_seconds.map(number).unwrap_or_default(),
        number(f.seconds),
        f.peak_memory_mib.map(number).unwrap_or_default(),
        stages.collect::<Vec<_>>().join(" "),
        result.outcome().to_owned(),
        f.points.to_string(),
        f.unconverged.to_string(),
    ]
}

/// Writes table.csv: one row per case.
pub fn write_table(
    path: &Path,
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
) -> Result<(), StudyError> {
    let has_differences = !analysis.refinements.is_empty();
    let headings = || analysis.figures.iter().map(|f| f.heading.as_str());
    let differences = headings().map(|h| format!("difference_{h}"));
    let mut header = vec!["case".to_owned()];
    header.extend(study.parameters.iter().map(|p| p.name.clone()));
    header.extend(headings().map(str::to_owned));
    header.extend(differences.filter(|_| has_differences));
    header.extend(OF_RUNS.map(str::to_owned));
    let number = |v: Option<f64>| v.map(csv::number).unwrap_or_default();
    let row = |(result, differences): (&CaseResult, &Vec<Option<f64>>)| {
        let mut row = vec![result.case.slug.clone()];
        row.extend(result.case.labels(study).into_iter().map(str::to_owned));
        row.extend(headings().map(|h| number(result.value(h))));
        let differences = differences.iter().filter(|_| has_differences);
        row.extend(differences.map(|d| number(*d)));
        row.extend(of_run(result, &csv::number));
        row
    };
    let rows = results.iter().zip(&analysis.differences).map(row);
    Ok(csv::write_rows(path, &header, &rows.collect::<Vec<_>>())?)
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
