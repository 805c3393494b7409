//! Answers as texts: table.csv, summary.json, and remarks about single cases.

use std::path::Path;

use serde_json::{Value, json};

use super::analysis::{Analysis, ParameterRefinement};
use super::results::{CaseEnd, CaseFigures, CaseResult};
use crate::scene_files::hash_of_file;
use crate::study_file::StudyError;
use crate::study_file::parameter::Parameter;
use crate::version;
use dovetail_export::table::{Cell, Columns};
use dovetail_export::write_json;

/// Cell of a case in a column.
type OfCase = fn(&CaseResult) -> Cell;

/// Last columns of a table of cases.
pub const OF_RUNS: [(&str, OfCase); 7] = [
    ("processor_seconds", |r| {
        figure_cell(r, |f| f.processor_seconds)
    }),
    ("seconds", |r| figure_cell(r, |f| Some(f.seconds))),
    ("peak_memory_mib", |r| figure_cell(r, |f| f.peak_memory_mib)),
    ("from_cache", |r| {
        figure_cell(r, |f| {
            let stages = f.from_cache.iter().map(|s| s.id());
            Some(stages.collect::<Vec<_>>().join(" "))
        })
    }),
    ("outcome", |r| r.outcome().into()),
    ("points", |r| figure_cell(r, |f| Some(f.response.points))),
    ("unconverged_points", |r| {
        figure_cell(r, |f| Some(f.unconverged()))
    }),
];

/// A cell that is empty if the case has no figures.
fn figure_cell<T: Into<Cell>>(result: &CaseResult, cell: fn(&CaseFigures) -> Option<T>) -> Cell {
    result.figures().and_then(cell).into()
}

/// Writes table.csv: one row per case.
pub fn write_table(path: &Path, analysis: &Analysis<'_>) -> Result<(), StudyError> {
    let results = analysis.results;
    let mut table: Columns<'_, usize> = Columns::default();
    table.add("case", |r| results[*r].case.slug.as_str());
    for (k, parameter) in analysis.study.parameters.iter().enumerate() {
        table.add(parameter.name.as_str(), move |r| {
            parameter.values[results[*r].case.values[k]].label.as_str()
        });
    }
    for figure in &analysis.figures {
        table.add(&figure.heading, |r| results[*r].value(&figure.heading));
    }
    let is_refined = !analysis.refinements.is_empty();
    for (k, figure) in analysis.figures.iter().enumerate().filter(|_| is_refined) {
        let heading = format!("difference_{}", figure.heading);
        table.add(heading, move |r| analysis.differences[*r][k]);
    }
    for (heading, cell) in OF_RUNS {
        table.add(heading, move |r| cell(&results[*r]));
    }
    Ok(table.write(path, &(0..results.len()).collect::<Vec<_>>())?)
}

/// Writes summary.json: the answers for programs.
pub fn write_summary(path: &Path, analysis: &Analysis<'_>) -> Result<(), StudyError> {
    let (study, results) = (analysis.study, analysis.results);
    let failed = results.iter().filter_map(|r| match &r.ended {
        CaseEnd::Failed { exit_code, message } => Some(json!({
            "case": r.case.slug, "exit_code": exit_code, "message": message,
        })),
        _ => None,
    });
    let not_computed = results.iter().filter_map(|r| {
        let range_hz = r.figures()?.response.first.resonance_not_computed_hz?;
        Some(json!({ "case": r.case.slug, "range_hz": range_hz }))
    });
    let parameter = |p: &Parameter| json!({ "name": p.name, "is": p.kind.to_string(), "keys": p.keys(), "values": p.labels() });
    let refinement = |r: &ParameterRefinement| {
        let parameter = &study.parameters[r.parameter];
        let at = study.physical(&results[r.cases[0]].case.values);
        let at = at.map(|(p, v)| (p.name.clone(), json!(v.label)));
        let cases = r.cases.iter().map(|c| &results[*c].case.slug);
        json!({
            "parameter": parameter.name,
            "at": Value::Object(at.collect()),
            "sizes": parameter.sizes(),
            "cases": cases.collect::<Vec<_>>(),
            "figures": r.figures,
        })
    };
    let summary = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "commit": version::commit(),
        "day": day(results),
        "study": study.name,
        "scene": study.scene,
        "scene_blake3": hash_of_file(&study.scene).ok(),
        "cases": results.len(),
        "complete": results.iter().filter_map(CaseResult::figures).count(),
        "failed": failed.collect::<Vec<_>>(),
        "resonance_not_computed": not_computed.collect::<Vec<_>>(),
        "parameters": study.parameters.iter().map(parameter).collect::<Vec<_>>(),
        "refinements": analysis.refinements.iter().map(refinement).collect::<Vec<_>>(),
    });
    Ok(write_json(path, &summary)?)
}

/// Last day on which a case was run; empty if none was.
pub fn day(results: &[CaseResult]) -> &str {
    let days = results.iter().filter_map(CaseResult::figures);
    days.map(|f| f.day.as_str()).max().unwrap_or("")
}

/// Remarks about single cases.
pub fn remarks(results: &[CaseResult]) -> Vec<String> {
    let mut remarks = Vec::new();
    for CaseResult { case, ended } in results {
        let mut remark = |words: String| remarks.push(format!("case {}{words}", case.slug));
        match ended {
            CaseEnd::Failed { message, .. } => remark(format!(" failed: {message}")),
            CaseEnd::NotRun => remark(" has no result".to_owned()),
            CaseEnd::WithFigures(figures) => {
                let (unconverged, response) = (figures.unconverged(), &figures.response);
                if unconverged > 0 {
                    let points = response.points;
                    remark(format!(
                        ": {unconverged} of {points} frequencies did not converge"
                    ));
                }
                if let Some(words) = response.first.not_computed_words() {
                    remark(format!(": {words}"));
                }
                if response.first.peak_at_end_of_range {
                    let end =
                        ": the peak is at an end of its frequencies and may be higher outside";
                    remark(end.to_owned());
                }
            }
        }
    }
    remarks
}
