//! The answers as files: study.csv, summary.json, study.md.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use super::answers::{Answers, FigureAnswer, KnobAnswer};
use super::file::{Mode, Study};
use super::folder::write_json;
use super::results::{CaseResult, Ended};
use super::words::{advice, basis, percent, rounded, settings};
use crate::error::Error;
use crate::export::{csv, write_file};
use crate::study::answers::orders::How;

/// study.csv: one row per case.
pub fn write_table(
    path: &Path,
    study: &Study,
    results: &[CaseResult],
    answers: &Answers,
) -> Result<(), Error> {
    let mut header = vec!["case".to_owned()];
    header.extend(study.knobs.iter().map(|k| k.name.clone()));
    header.extend(answers.headings.iter().cloned());
    header.extend(
        [
            "seconds",
            "contact_seconds",
            "processor_seconds",
            "contact_processor_seconds",
            "peak_memory_mib",
            "threads",
            "outcome",
            "points",
            "unconverged_points",
        ]
        .map(str::to_owned),
    );
    for front in &answers.fronts {
        header.push(format!("error_{}", front.heading));
        header.push(format!("on_pareto_front_{}", front.heading));
    }
    let text = |v: Option<f64>| {
        v.filter(|v| v.is_finite())
            .map(csv::number)
            .unwrap_or_default()
    };
    let mut rows = Vec::new();
    for (c, result) in results.iter().enumerate() {
        let figures = result.figures();
        let mut row = vec![result.case.slug.clone()];
        row.extend(result.case.labels(study).into_iter().map(str::to_owned));
        row.extend(answers.headings.iter().map(|h| text(result.value(h))));
        row.push(text(figures.map(|f| f.spent.seconds)));
        row.push(text(figures.map(|f| f.spent.contact_seconds)));
        row.push(text(figures.and_then(|f| f.spent.processor_seconds)));
        row.push(text(
            figures.and_then(|f| f.spent.contact_processor_seconds),
        ));
        row.push(text(figures.and_then(|f| f.spent.peak_memory_mib)));
        row.push(
            figures
                .and_then(|f| f.threads)
                .map(|t| t.to_string())
                .unwrap_or_default(),
        );
        row.push(match &result.ended {
            Ended::WithFigures(f) if f.unconverged == 0 => "converged".to_owned(),
            Ended::WithFigures(_) => "some_unconverged".to_owned(),
            Ended::Failed { .. } => "failed".to_owned(),
            Ended::NotRun => "not_run".to_owned(),
        });
        row.push(figures.map(|f| f.points.to_string()).unwrap_or_default());
        row.push(
            figures
                .map(|f| f.unconverged.to_string())
                .unwrap_or_default(),
        );
        for front in &answers.fronts {
            row.push(text(front.errors[c]));
            row.push(if front.on_front[c] { "true" } else { "false" }.to_owned());
        }
        rows.push(row);
    }
    Ok(csv::write_rows(path, &header, &rows)?)
}

#[derive(Serialize)]
struct Summary<'s> {
    version: &'static str,
    study: &'s str,
    scene: String,
    cases: usize,
    complete: usize,
    failed: Vec<Failure<'s>>,
    knobs: Vec<KnobSummary<'s>>,
    recommendations: Vec<Recommendation<'s>>,
}

#[derive(Serialize)]
struct Failure<'s> {
    case: &'s str,
    exit_code: Option<i32>,
    message: &'s str,
}

#[derive(Serialize)]
struct KnobSummary<'s> {
    name: &'s str,
    values: Vec<&'s str>,
    sizes: Option<Vec<f64>>,
    cases: Vec<&'s str>,
    figures: Vec<FigureSummary<'s>>,
}

#[derive(Serialize)]
struct FigureSummary<'s> {
    figure: &'s str,
    values: &'s [Option<f64>],
    limit: Option<super::answers::orders::Limit>,
    orders: &'s [Option<f64>],
    error_to_finest: &'s [Option<f64>],
    error_to_richardson: &'s [Option<f64>],
    estimated_error: &'s [Option<f64>],
}

#[derive(Serialize)]
struct Recommendation<'s> {
    figure: &'s str,
    accuracy: f64,
    run: Option<&'s str>,
    seconds: Option<f64>,
    estimated_error: Option<f64>,
    combination_not_run: Option<String>,
    text: String,
    basis: String,
}

/// summary.json of the study.
pub fn write_summary(
    path: &Path,
    study: &Study,
    results: &[CaseResult],
    answers: &Answers,
) -> Result<(), Error> {
    let failed = results.iter().filter_map(|r| match &r.ended {
        Ended::Failed { exit_code, message } => Some(Failure {
            case: &r.case.slug,
            exit_code: *exit_code,
            message,
        }),
        _ => None,
    });
    let knobs = answers.knobs.iter().map(|answer| {
        let knob = &study.knobs[answer.knob];
        KnobSummary {
            name: &knob.name,
            values: knob.values.iter().map(|v| v.label.as_str()).collect(),
            sizes: knob.sizes(),
            cases: answer
                .cases
                .iter()
                .map(|c| results[*c].case.slug.as_str())
                .collect(),
            figures: answer.figures.iter().map(figure_summary).collect(),
        }
    });
    let recommendations = answers.advice.iter().map(|a| {
        let front = answers.fronts.iter().find(|f| f.heading == a.heading);
        Recommendation {
            figure: &a.heading,
            accuracy: a.accuracy,
            run: a.run.map(|c| results[c].case.slug.as_str()),
            seconds: a
                .run
                .and_then(|c| Some(results[c].figures()?.cost_seconds())),
            estimated_error: a.run.and_then(|c| front?.errors[c]),
            combination_not_run: a.combination.as_ref().map(|c| settings(study, &c.values)),
            text: advice(study, results, answers, a),
            basis: basis(study, answers, &a.heading),
        }
    });
    let summary = Summary {
        version: env!("CARGO_PKG_VERSION"),
        study: &study.name,
        scene: study.scene.display().to_string(),
        cases: results.len(),
        complete: results.iter().filter(|r| r.figures().is_some()).count(),
        failed: failed.collect(),
        knobs: knobs.collect(),
        recommendations: recommendations.collect(),
    };
    write_json(path, &summary)
}

fn figure_summary(figure: &FigureAnswer) -> FigureSummary<'_> {
    FigureSummary {
        figure: &figure.heading,
        values: &figure.values,
        limit: figure.limit,
        orders: &figure.orders,
        error_to_finest: &figure.to_finest,
        error_to_richardson: &figure.to_richardson,
        estimated_error: &figure.estimates,
    }
}

/// study.md: the report.
pub fn write_report(
    path: &Path,
    study: &Study,
    results: &[CaseResult],
    answers: &Answers,
) -> Result<(), Error> {
    Ok(write_file(
        path,
        report(study, results, answers).as_bytes(),
    )?)
}

/// The text of the report.
pub fn report(study: &Study, results: &[CaseResult], answers: &Answers) -> String {
    let mut text = String::new();
    let mode = match study.mode {
        Mode::OneAtATime => "one knob at a time around the base",
        Mode::Grid => "every combination",
    };
    // Writing to a String does not fail.
    let _ = writeln!(
        text,
        "# Study {}\n\nScene `{}`, {} cases, {mode}; dovetail {}.\n",
        study.name,
        study.scene.display(),
        results.len(),
        env!("CARGO_PKG_VERSION")
    );
    recommendations(&mut text, study, results, answers);
    all_cases(&mut text, study, results, answers);
    for knob in &answers.knobs {
        one_knob(&mut text, study, results, knob);
    }
    text
}

fn recommendations(text: &mut String, study: &Study, results: &[CaseResult], answers: &Answers) {
    if answers.advice.is_empty() {
        return;
    }
    text.push_str("## Recommendation\n\n");
    for a in &answers.advice {
        let _ = writeln!(text, "- {}.", advice(study, results, answers, a));
    }
    text.push('\n');
    for front in &answers.fronts {
        let _ = writeln!(
            text,
            "Errors of {}: {}.\n",
            front.heading,
            basis(study, answers, &front.heading)
        );
    }
}

fn all_cases(text: &mut String, study: &Study, results: &[CaseResult], answers: &Answers) {
    let single = results
        .iter()
        .filter_map(CaseResult::figures)
        .all(|f| f.threads == Some(1));
    let cost = match single {
        true => "processor seconds: each run had one thread, and on a free core takes so long",
        false => "seconds by the wall clock",
    };
    let _ = writeln!(
        text,
        "## All runs\n\n`*`: on the Pareto front of error against cost. Cost is {cost}.\n"
    );
    let mut header = vec!["case".to_owned()];
    header.extend(study.knobs.iter().map(|k| k.name.clone()));
    header.extend(["s", "contact s", "processor s", "MiB", "outcome"].map(str::to_owned));
    for front in &answers.fronts {
        header.push(front.heading.clone());
        header.push("error".to_owned());
    }
    head(text, &header);
    for (c, result) in results.iter().enumerate() {
        let mut row = vec![result.case.slug.clone()];
        row.extend(result.case.labels(study).into_iter().map(str::to_owned));
        row.extend(costs(result));
        row.push(result.outcome());
        for front in &answers.fronts {
            row.push(cell(result.value(&front.heading), |v| rounded(v, 5)));
            let star = if front.on_front[c] { " *" } else { "" };
            row.push(cell(front.errors[c], |e| format!("{}{star}", percent(e))));
        }
        line(text, &row);
    }
    text.push('\n');
    let lacks = |r: &&CaseResult| r.figures().is_some_and(|f| !f.spent.not_counted.is_empty());
    let lacking: Vec<&str> = results
        .iter()
        .filter(lacks)
        .map(|r| r.case.slug.as_str())
        .collect();
    if !lacking.is_empty() {
        let _ = writeln!(
            text,
            "Stages of these runs came from a cache that no case of the study filled, and are missing from their times: {}.\n",
            lacking.join(", ")
        );
    }
    for result in results {
        if let Ended::Failed { message, .. } = &result.ended {
            let _ = writeln!(
                text,
                "- `{}` {}: {message}",
                result.case.slug,
                result.outcome()
            );
        }
    }
    if results
        .iter()
        .any(|r| matches!(r.ended, Ended::Failed { .. }))
    {
        text.push('\n');
    }
}

fn one_knob(text: &mut String, study: &Study, results: &[CaseResult], answer: &KnobAnswer) {
    let knob = &study.knobs[answer.knob];
    let _ = writeln!(text, "## Knob {}\n", knob.name);
    let labels = knob.values.iter().map(|v| v.label.clone());
    let mut header = vec![String::new()];
    header.extend(labels);
    header.extend(["order", "limit"].map(str::to_owned));
    head(text, &header);
    let of_cases = |what: &dyn Fn(&CaseResult) -> String| -> Vec<String> {
        answer.cases.iter().map(|c| what(&results[*c])).collect()
    };
    let mut row = |name: &str, cells: Vec<String>, end: [String; 2]| {
        let mut row = vec![name.to_owned()];
        row.extend(cells);
        row.extend(end);
        line(text, &row);
    };
    let none = || [String::new(), String::new()];
    for (i, name) in ["seconds", "contact seconds", "processor seconds", "MiB"]
        .iter()
        .enumerate()
    {
        row(name, of_cases(&|r| costs(r)[i].clone()), none());
    }
    row("outcome", of_cases(&|r| r.outcome()), none());
    let from_finest = match (knob.sizes(), knob.values.last()) {
        (None, Some(last)) => format!("- from {}", last.label),
        _ => "- from the finest".to_owned(),
    };
    for figure in &answer.figures {
        let values = figure.values.iter().map(|v| cell(*v, |v| rounded(v, 6)));
        row(&figure.heading, values.collect(), ends(figure));
        let unchanged = figure
            .limit
            .is_some_and(|l| matches!(l.how, How::Unchanged | How::Single));
        if unchanged {
            continue;
        }
        let errors = |errors: &[Option<f64>]| errors.iter().map(|e| cell(*e, percent)).collect();
        row(&from_finest, errors(&figure.to_finest), none());
        if figure.to_richardson.iter().any(Option::is_some) {
            row("- from Richardson", errors(&figure.to_richardson), none());
        }
    }
    text.push('\n');
}

/// Order and limit of a figure.
fn ends(figure: &FigureAnswer) -> [String; 2] {
    let Some(limit) = figure.limit else {
        return [String::new(), String::new()];
    };
    match limit.how {
        How::Richardson => [
            cell(limit.order, |p| rounded(p, 2)),
            rounded(limit.value, 6),
        ],
        How::Unchanged => ["no influence".to_owned(), String::new()],
        How::Single | How::Reference => [String::new(), String::new()],
        How::Finest => match figure.seen_order() {
            Some(p) => [format!("no order shows ({})", rounded(p, 2)), String::new()],
            None => ["no order shows".to_owned(), String::new()],
        },
    }
}

/// Seconds, of the contact, of the processors, MiB.
fn costs(result: &CaseResult) -> [String; 4] {
    let Some(f) = result.figures() else {
        return [const { String::new() }; 4];
    };
    [
        rounded(f.spent.seconds, 3),
        rounded(f.spent.contact_seconds, 3),
        cell(f.spent.processor_seconds, |s| rounded(s, 3)),
        cell(f.spent.peak_memory_mib, |m| format!("{m:.0}")),
    ]
}

fn cell(v: Option<f64>, words: impl Fn(f64) -> String) -> String {
    v.filter(|v| v.is_finite()).map(words).unwrap_or_default()
}

fn head(text: &mut String, cells: &[String]) {
    line(text, cells);
    line(text, &vec!["---".to_owned(); cells.len()]);
}

fn line(text: &mut String, cells: &[String]) {
    let clean: Vec<String> = cells.iter().map(|c| c.replace('|', "\\|")).collect();
    let _ = writeln!(text, "| {} |", clean.join(" | "));
}
