//! The answers as files: table.csv, summary.json, report.md.

use std::path::Path;

use serde_json::{Value, json};

use super::analysis::{Analysis, FigureAnswer, KnobAnswer, Recommendation};
use super::convergence::How;
use super::error::StudyError;
use super::file::{Mode, Study};
use super::folder::write_json;
use super::pictures::Picture;
use super::results::{CaseResult, Cost, Ended, Figures};
use crate::export::{csv, write_file};

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
    header.extend(study.knobs.iter().map(|k| k.name.clone()));
    header.extend_from_slice(headings);
    let errors = analysis.errors.iter();
    header.extend(errors.map(|e| format!("error_{}", e.heading)));
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
        row.extend(analysis.errors.iter().map(|e| number(e.errors[c])));
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
    let slug = |case: usize| results[case].case.slug.as_str();
    let failed = results.iter().filter_map(|r| match &r.ended {
        Ended::Failed { exit_code, message } => Some(json!({
            "case": r.case.slug, "exit_code": exit_code, "message": message,
        })),
        _ => None,
    });
    let knobs = study.knobs.iter().zip(&analysis.knobs);
    let knobs = knobs.map(|(knob, answer)| {
        json!({
            "name": knob.name,
            "values": knob.values.iter().map(|v| &v.label).collect::<Vec<_>>(),
            "sizes": knob.sizes(),
            "cases": answer.cases.iter().map(|c| slug(*c)).collect::<Vec<_>>(),
            "figures": answer.figures,
        })
    });
    let recommendations = analysis.recommendations.iter().map(|r| {
        let settings = r.settings.as_ref().map(|(values, _)| {
            let knobs = study.knobs.iter().zip(values);
            let labels = knobs.map(|(k, v)| (k.name.clone(), json!(k.values[*v].label)));
            Value::Object(labels.collect())
        });
        json!({
            "figure": r.heading,
            "accuracy": r.accuracy,
            "settings": settings,
            "sum_of_errors": r.settings.as_ref().map(|(_, sum)| sum),
            "case": r.case.map(slug),
            "error": r.error,
            "cost": r.case.and_then(|c| Some(results[c].figures()?.cost.compared_s())),
        })
    });
    let summary = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "study": study.name,
        "scene": study.scene,
        "cases": results.len(),
        "complete": results.iter().filter(|r| r.figures().is_some()).count(),
        "failed": failed.collect::<Vec<_>>(),
        "knobs": knobs.collect::<Vec<_>>(),
        "recommendations": recommendations.collect::<Vec<_>>(),
    });
    write_json(path, &summary)
}

/// report.md.
pub fn write_report(
    path: &Path,
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
    pictures: &[Picture],
) -> Result<(), StudyError> {
    let mode = match study.mode {
        Mode::OneAtATime => "one knob at a time around the base",
        Mode::Grid => "every combination",
    };
    let mut text = format!(
        "# Study {}\n\nScene `{}`, {} cases, {mode}; dovetail {}.\n\n",
        study.name,
        study.scene.display(),
        results.len(),
        env!("CARGO_PKG_VERSION"),
    );
    if !analysis.recommendations.is_empty() {
        text += "## Recommended settings\n\n";
        for recommendation in &analysis.recommendations {
            let line = recommended(study, results, analysis, recommendation);
            text += &format!("- {line}\n");
        }
        text += "\n";
    }
    text += &all_cases(study, results, analysis);
    for k in 0..study.knobs.len() {
        text += &one_knob(study, results, k, &analysis.knobs[k]);
    }
    if !pictures.is_empty() {
        text += "## Pictures\n\n";
    }
    for (shows, file) in pictures {
        text += &format!("{shows}:\n\n![{shows}.](plots/{file})\n\n");
    }
    Ok(write_file(path, text.as_bytes())?)
}

/// One recommendation, on one line.
pub fn recommended(
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
    recommendation: &Recommendation,
) -> String {
    let heading = &recommendation.heading;
    let asked = format!(
        "{heading} within {} %",
        plain(100.0 * recommendation.accuracy)
    );
    let Some((values, sum)) = &recommendation.settings else {
        let knobs = study.knobs.iter().zip(&analysis.knobs);
        let least = knobs.filter_map(|(knob, answer)| {
            let figure = answer.figures.iter().find(|f| f.heading == *heading)?;
            let errors = figure.estimated_errors.iter().flatten().copied();
            Some(format!(
                "{} {}",
                knob.name,
                percent(errors.reduce(f64::min)?)
            ))
        });
        let least = least.collect::<Vec<_>>().join(", ");
        return format!("{asked}: no settings; the least error of each knob: {least}");
    };
    let knobs = study.knobs.iter().zip(values);
    let settings = knobs.map(|(k, v)| format!("{} {}", k.name, k.values[*v].label));
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

fn all_cases(study: &Study, results: &[CaseResult], analysis: &Analysis) -> String {
    let asked = analysis.errors.iter().map(|e| e.heading.clone());
    let asked: Vec<String> = asked.collect();
    let number = |v: f64| rounded(v, 5);
    let (header, rows) = table_of_cases(study, results, analysis, &asked, &number);
    let mut text = format!("## All cases\n\n{}\n", table(&header, &rows));
    let mut failures = String::new();
    for result in results {
        if let Ended::Failed { exit_code, message } = &result.ended {
            let code = exit_code.map_or("a signal".to_owned(), |code| format!("exit code {code}"));
            failures += &format!("- `{}` ended with {code}: {message}\n", result.case.slug);
        }
    }
    if !failures.is_empty() {
        text += &format!("{failures}\n");
    }
    text
}

fn one_knob(study: &Study, results: &[CaseResult], k: usize, answer: &KnobAnswer) -> String {
    let knob = &study.knobs[k];
    let mut header = vec![String::new()];
    header.extend(knob.values.iter().map(|v| v.label.clone()));
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
    format!("## Knob {}\n\n{}\n", knob.name, table(&header, &rows))
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

/// A table in Markdown.
fn table(header: &[String], rows: &[Vec<String>]) -> String {
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|c| c.replace('|', "\\|")).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let rule = vec!["---".to_owned(); header.len()];
    let rows = rows.iter().map(|row| line(row));
    line(header) + &line(&rule) + &rows.collect::<String>()
}

/// To so many significant digits: plain between 1e-3 and 1e6, else with an exponent.
fn rounded(v: f64, digits: usize) -> String {
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
