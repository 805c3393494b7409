//! The answers as texts: table.csv, summary.json, and the lines that a reader is told.

use std::path::Path;

use serde_json::{Value, json};

use super::analysis::{Analysis, AtDesign, FigureAnswer, ParameterAnswer, Recommendation};
use super::cases::design_words;
use super::convergence::How;
use super::designs::Minimum;
use super::error::StudyError;
use super::file::Study;
use super::folder::write_json;
use super::parameter::Parameter;
use super::results::{CaseResult, Cost, Ended, Figures};
use crate::export::csv;

/// table.csv: one row per case.
pub fn write_table(
    path: &Path,
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
) -> Result<(), StudyError> {
    let headings = &analysis.headings;
    let (header, rows) = table_of_cases(study, results, analysis, headings, &csv::number);
    Ok(csv::write_rows(path, &header, &rows)?)
}

/// Header and rows, with these figures and the numbers written so.
fn table_of_cases(
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
    headings: &[String],
    number: &dyn Fn(f64) -> String,
) -> (Vec<String>, Vec<Vec<String>>) {
    let mut header = vec!["case".to_owned()];
    header.extend(study.parameters.iter().map(|k| k.name.clone()));
    header.extend_from_slice(headings);
    let errors = analysis.with_errors.iter();
    header.extend(errors.map(|heading| format!("error_{heading}")));
    let of_runs = [
        "processor_seconds",
        "seconds",
        "peak_memory_mib",
        "from_cache",
        "outcome",
        "points",
        "unconverged_points",
    ];
    header.extend(of_runs.map(str::to_owned));
    let number = |v: Option<f64>| cell(v, number);
    let row = |(c, result): (usize, &CaseResult)| {
        let figures = result.figures();
        let of_run = |text: &dyn Fn(&Figures) -> String| figures.map(text).unwrap_or_default();
        let mut row = vec![result.case.slug.clone()];
        row.extend(result.case.labels(study).into_iter().map(str::to_owned));
        row.extend(headings.iter().map(|h| number(result.value(h))));
        let errors = 0..analysis.with_errors.len();
        row.extend(errors.map(|figure| number(analysis.error(figure, c))));
        row.extend([
            of_run(&|f| number(f.cost.processor_seconds)),
            of_run(&|f| number(Some(f.cost.seconds))),
            of_run(&|f| number(f.cost.peak_memory_mib)),
            of_run(&|f| {
                let stages = f.cost.from_cache.iter().map(|s| s.id());
                stages.collect::<Vec<_>>().join(" ")
            }),
            result.outcome().to_owned(),
            of_run(&|f| f.points.to_string()),
            of_run(&|f| f.unconverged.to_string()),
        ]);
        row
    };
    (header, results.iter().enumerate().map(row).collect())
}

/// summary.json: the same for programs.
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
    let designs = study.parameters.iter().filter(|k| k.is_design());
    let mut parameters: Vec<Value> = designs.map(about_parameter).collect();
    let mut recommendations = Vec::new();
    for at in &analysis.at_designs {
        let of_parameter =
            |answer: &ParameterAnswer| numerical_parameter(study, results, at, answer);
        parameters.extend(at.parameters.iter().map(of_parameter));
        let of_one = |r: &Recommendation| recommendation(study, results, at, r);
        recommendations.extend(at.recommendations.iter().map(of_one));
    }
    let minima = analysis.designs.minima.iter();
    let summary = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "study": study.name,
        "scene": study.scene,
        "cases": results.len(),
        "complete": results.iter().filter(|r| r.figures().is_some()).count(),
        "failed": failed.collect::<Vec<_>>(),
        "parameters": parameters,
        "recommendations": recommendations,
        "minima": minima.map(|m| minimum(study, results, m)).collect::<Vec<_>>(),
    });
    write_json(path, &summary)
}

/// What is the same for all parameters.
fn about_parameter(parameter: &Parameter) -> Value {
    json!({
        "name": parameter.name,
        "is": parameter.kind.word(),
        "values": parameter.values.iter().map(|v| &v.label).collect::<Vec<_>>(),
    })
}

/// Name and value of the parameters that are `wanted`.
fn labels(study: &Study, values: &[usize], wanted: impl Fn(&Parameter) -> bool) -> Value {
    let parameters = study
        .parameters
        .iter()
        .zip(values)
        .filter(|(k, _)| wanted(k));
    let labels = parameters.map(|(k, v)| (k.name.clone(), json!(k.values[*v].label)));
    Value::Object(labels.collect())
}

fn numerical_parameter(
    study: &Study,
    results: &[CaseResult],
    at: &AtDesign,
    answer: &ParameterAnswer,
) -> Value {
    let parameter = &study.parameters[answer.parameter];
    let cases = answer.cases.iter().map(|c| results[*c].case.slug.as_str());
    let mut about = about_parameter(parameter);
    about["at"] = labels(study, &at.values, Parameter::is_design);
    about["sizes"] = json!(parameter.sizes());
    about["cases"] = json!(cases.collect::<Vec<_>>());
    about["figures"] = json!(answer.figures);
    about
}

fn recommendation(
    study: &Study,
    results: &[CaseResult],
    at: &AtDesign,
    r: &Recommendation,
) -> Value {
    let settings = r.settings.as_ref();
    let settings = settings.map(|(values, _)| labels(study, values, |k| !k.is_design()));
    json!({
        "figure": r.heading,
        "accuracy": r.accuracy,
        "at": labels(study, &at.values, Parameter::is_design),
        "settings": settings,
        "sum_of_errors": r.settings.as_ref().map(|(_, sum)| sum),
        "case": r.case.map(|c| results[c].case.slug.as_str()),
        "error": r.error,
        "cost": r.case.and_then(|c| Some(results[c].figures()?.cost.compared_s())),
    })
}

fn minimum(study: &Study, results: &[CaseResult], minimum: &Minimum) -> Value {
    let least = minimum.least.as_ref();
    let ends = least.map(|l| {
        let ends = l.at_ends.iter();
        let ends = ends.map(|(k, end)| (study.parameters[*k].name.clone(), json!(end.word())));
        Value::Object(ends.collect())
    });
    json!({
        "figure": minimum.heading,
        "value": least.map(|l| l.value),
        "case": least.map(|l| results[l.case].case.slug.as_str()),
        "outcome": least.map(|l| results[l.case].outcome()),
        "peak_at_end_of_range": least.map(|l| results[l.case].peak_at_end_of_range()),
        "parameters": least.map(|l| labels(study, &results[l.case].case.values, Parameter::is_design)),
        "at_ends": ends,
        "other_cases": least.map(|l| l.other_cases),
        "cases_without": minimum.cases_without,
    })
}

/// The least value of each figure that is to be minimised, on one line each.
pub fn least_values(study: &Study, results: &[CaseResult], analysis: &Analysis) -> Vec<String> {
    let minima = analysis.designs.minima.iter();
    let all = analysis.designs.cases.len();
    let line = |minimum: &Minimum| {
        let heading = &minimum.heading;
        let Some(least) = &minimum.least else {
            return format!("{heading}: none of {all} cases has a value");
        };
        let case = &results[least.case];
        let mut line = format!(
            "least {heading}: {} at {} (case {}, {})",
            rounded(least.value, 5),
            design_words(study, &case.case.values),
            case.case.slug,
            case.outcome(),
        );
        for (k, end) in &least.at_ends {
            let parameter = &study.parameters[*k];
            line += &format!(
                "; this is the {} value of {}: less may lie beyond",
                end.word(),
                parameter.name
            );
        }
        if heading.starts_with("peak_") && case.peak_at_end_of_range() {
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
    minima.map(line).collect()
}

/// Each recommendation, on one line.
pub fn recommended(study: &Study, results: &[CaseResult], analysis: &Analysis) -> Vec<String> {
    let at_designs = analysis.at_designs.iter();
    let lines = at_designs.flat_map(|at| {
        let of_one = |r| one_recommended(study, results, at, r);
        at.recommendations.iter().map(of_one)
    });
    lines.collect()
}

fn one_recommended(
    study: &Study,
    results: &[CaseResult],
    at: &AtDesign,
    recommendation: &Recommendation,
) -> String {
    let heading = &recommendation.heading;
    let asked = format!(
        "{heading} within {} %{}",
        plain(100.0 * recommendation.accuracy),
        at_words(study, at),
    );
    let Some((values, sum)) = &recommendation.settings else {
        let least = at.parameters.iter().filter_map(|answer| {
            let figure = answer.figures.iter().find(|f| f.heading == *heading)?;
            let errors = figure.estimated_errors.iter().flatten().copied();
            let least = percent(errors.reduce(f64::min)?);
            Some(format!(
                "{} {least}",
                study.parameters[answer.parameter].name
            ))
        });
        let least = least.collect::<Vec<_>>().join(", ");
        return format!("{asked}: no settings; the least error of each parameter: {least}");
    };
    let parameters = study.parameters.iter().zip(values);
    let numerical = parameters.filter(|(k, _)| !k.is_design());
    let settings = numerical.map(|(k, v)| format!("{} {}", k.name, k.values[*v].label));
    let settings = settings.collect::<Vec<_>>().join(", ");
    let run = recommendation.case.map(|c| &results[c]);
    match run.and_then(|r| Some((r, r.figures()?))) {
        Some((run, figures)) => {
            let error = cell(recommendation.error, percent);
            let within = recommendation
                .error
                .is_some_and(|e| e <= recommendation.accuracy);
            format!(
                "{asked}: {settings} (case {}, {}: error {error}{}, {} s)",
                run.case.slug,
                run.outcome(),
                if within { "" } else { ", more than asked" },
                rounded(figures.cost.compared_s(), 2),
            )
        }
        None => format!(
            "{asked}: {settings} (not run; the errors of these values add up to {})",
            percent(*sum)
        ),
    }
}

/// ` at friction 0.3, force_n 1.0`; nothing where there are no design values.
pub fn at_words(study: &Study, at: &AtDesign) -> String {
    match design_words(study, &at.values) {
        none if none.is_empty() => none,
        words => format!(" at {words}"),
    }
}

/// The table of all cases for a reader: with designs to compare it has every figure, else those with
/// errors, as the tables of parameters have the others.
pub fn all_cases(
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
) -> (Vec<String>, Vec<Vec<String>>) {
    let shown = match analysis.designs.cases.is_empty() {
        true => &analysis.with_errors,
        false => &analysis.headings,
    };
    table_of_cases(study, results, analysis, shown, &|v| rounded(v, 5))
}

/// What to mind about single cases.
pub fn remarks(results: &[CaseResult]) -> Vec<String> {
    let mut remarks = Vec::new();
    for result in results {
        let slug = &result.case.slug;
        match &result.ended {
            Ended::Failed { exit_code, message } => {
                let code =
                    exit_code.map_or("a signal".to_owned(), |code| format!("exit code {code}"));
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

/// A numerical parameter as a table: a column per value, and of each figure a row of values and one of
/// errors.
pub fn one_parameter(
    study: &Study,
    results: &[CaseResult],
    answer: &ParameterAnswer,
) -> (Vec<String>, Vec<Vec<String>>) {
    let parameter = &study.parameters[answer.parameter];
    let mut header = vec![String::new()];
    header.extend(parameter.values.iter().map(|v| v.label.clone()));
    header.extend(["order", "counted from"].map(str::to_owned));
    let row = |name: &str, cells: Vec<String>, end: [String; 2]| {
        let mut row = vec![name.to_owned()];
        row.extend(cells);
        row.extend(end);
        row
    };
    let of_cost = |result: &CaseResult, of: &dyn Fn(&Cost) -> Option<f64>| {
        cell(result.figures().and_then(|f| of(&f.cost)), |v| {
            rounded(v, 3)
        })
    };
    let of_cases = |of: &dyn Fn(&CaseResult) -> String| -> Vec<String> {
        answer.cases.iter().map(|c| of(&results[*c])).collect()
    };
    let none = || [String::new(), String::new()];
    let mut rows = vec![
        row(
            "cost, s",
            of_cases(&|r| of_cost(r, &|c| Some(c.compared_s()))),
            none(),
        ),
        row(
            "MiB",
            of_cases(&|r| of_cost(r, &|c| c.peak_memory_mib)),
            none(),
        ),
        row("outcome", of_cases(&|r| r.outcome().to_owned()), none()),
    ];
    for figure in &answer.figures {
        let values = figure.values.iter().map(|v| cell(*v, |v| rounded(v, 6)));
        rows.push(row(&figure.heading, values.collect(), counted_from(figure)));
        let errors = figure.estimated_errors.iter();
        let errors = errors.map(|e| cell(*e, percent)).collect();
        rows.push(row("- error", errors, none()));
    }
    (header, rows)
}

/// The order that shows, and the value that the errors of a figure are counted from.
fn counted_from(figure: &FigureAnswer) -> [String; 2] {
    let Some(limit) = figure.limit else {
        return [String::new(), String::new()];
    };
    let (order, from) = match limit.how {
        How::Richardson => (
            cell(limit.order, |p| rounded(p, 2)),
            format!("{} (Richardson)", rounded(limit.value, 6)),
        ),
        How::Finest => {
            let seen = limit.order.map(|p| format!(" ({})", rounded(p, 2)));
            let seen = seen.unwrap_or_default();
            (format!("none shows{seen}"), "the finest".to_owned())
        }
        How::Reference => (String::new(), "the last".to_owned()),
        How::Unchanged => (String::new(), "no influence".to_owned()),
        How::Single => (String::new(), "one value only".to_owned()),
    };
    [order, from]
}

fn cell(v: Option<f64>, words: impl Fn(f64) -> String) -> String {
    v.filter(|v| v.is_finite()).map(words).unwrap_or_default()
}

/// To so many significant digits: plain between 1e-3 and 1e6, else with an exponent.
pub fn rounded(v: f64, digits: usize) -> String {
    if v == 0.0 {
        return "0".to_owned();
    }
    if v.fract() == 0.0 && v.abs() < 1e6 {
        return format!("{v:.0}");
    }
    let magnitude = v.abs().log10().floor();
    if !(-3.0..6.0).contains(&magnitude) {
        return format!("{v:.*e}", digits.saturating_sub(1));
    }
    let decimals = (digits as f64 - 1.0 - magnitude).max(0.0) as usize;
    format!("{v:.decimals$}")
}

/// 0.0123 -> `1.2 %`.
fn percent(fraction: f64) -> String {
    format!("{} %", rounded(100.0 * fraction, 2))
}

/// Up to ten decimals, those that matter: 0.25.
fn plain(v: f64) -> String {
    let text = format!("{v:.10}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_to_significant_digits() {
        assert_eq!(rounded(450.7812, 5), "450.78");
        assert_eq!(rounded(0.0065012, 3), "0.00650");
        assert_eq!(rounded(1.34e-5, 2), "1.3e-5");
        assert_eq!(rounded(12_345_678.0, 3), "1.23e7");
        assert_eq!(rounded(123_456.4, 3), "123456");
        assert_eq!(rounded(15.0, 6), "15");
        assert_eq!(percent(0.0123), "1.2 %");
        assert_eq!((plain(1.0), plain(0.25)), ("1".into(), "0.25".into()));
    }
}
