//! plots/*.svg of a study.

use std::path::Path;

use super::analysis::{Analysis, CaseErrors, FigureAnswer, KnobAnswer};
use super::convergence::How;
use super::error::StudyError;
use super::file::Study;
use super::results::CaseResult;
use crate::export::plots::{LogSeries, write_loglog};

/// Figures drawn in one plot, as many as there are colours.
const MOST_SERIES: usize = 6;
const COST: &str = "processor seconds";

/// A picture that was written: what it shows, and the name of its file.
pub type Picture = (String, String);

/// Errors against each knob and against what its values cost, and errors of all cases against cost.
pub fn write(
    folder: &Path,
    study: &Study,
    results: &[CaseResult],
    analysis: &Analysis,
) -> Result<Vec<Picture>, StudyError> {
    let mut written = Vec::new();
    let mut draw = |name: String, shows: String, axes: [&str; 2], series: &[LogSeries]| {
        let file = format!("{name}.svg");
        write_loglog(&folder.join(&file), &study.name, axes, series)?;
        written.push((shows, file));
        Ok::<(), StudyError>(())
    };
    let cost = |case: usize| Some(results[case].figures()?.cost.compared_s());
    for errors in &analysis.errors {
        let CaseErrors { heading, .. } = errors;
        let axis = format!("error of {heading}");
        let shows = format!("Error of {heading} against cost, all cases");
        let series = all_cases(results, errors, &cost);
        draw(format!("pareto_{heading}"), shows, [COST, &axis], &series)?;
    }
    for (knob, answer) in study.knobs.iter().zip(&analysis.knobs) {
        let figures = drawn(analysis, answer);
        if figures.is_empty() {
            continue;
        }
        let name = &knob.name;
        let label = |v: usize| knob.values[v].label.clone();
        if let Some(sizes) = knob.sizes() {
            let series = series(&figures, &|v| Some(sizes[v]), &label);
            let axes = [&format!("size of {name}"), "relative error"];
            let shows = format!("Errors against the size of {name}");
            draw(name.clone(), shows, axes, &series)?;
        }
        let series = series(&figures, &|v| cost(answer.cases[v]), &label);
        let shows = format!("Errors against the cost of each value of {name}");
        draw(
            format!("{name}_seconds"),
            shows,
            [COST, "relative error"],
            &series,
        )?;
    }
    Ok(written)
}

/// The Pareto front, and the other cases.
fn all_cases(
    results: &[CaseResult],
    errors: &CaseErrors,
    cost: &dyn Fn(usize) -> Option<f64>,
) -> [LogSeries; 2] {
    let mut points: Vec<(usize, (f64, f64))> = (0..results.len())
        .filter_map(|c| Some((c, (cost(c)?, errors.errors[c]?))))
        .collect();
    points.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
    [("Pareto front", true), ("other cases", false)].map(|(label, on_front)| {
        let own = points
            .iter()
            .filter(|(c, _)| errors.on_pareto_front[*c] == on_front);
        let names = own.clone().filter(|_| on_front);
        LogSeries {
            label: label.to_owned(),
            names: names.map(|(c, _)| results[*c].case.slug.clone()).collect(),
            points: own.map(|(_, point)| *point).collect(),
            joined: on_front,
        }
    })
}

/// Figures that change with the knob: those asked for first.
fn drawn<'a>(analysis: &Analysis, knob: &'a KnobAnswer) -> Vec<&'a FigureAnswer> {
    let changes = |f: &&FigureAnswer| {
        f.limit
            .is_some_and(|l| !matches!(l.how, How::Unchanged | How::Single))
    };
    let asked = |f: &&FigureAnswer| analysis.errors.iter().any(|e| e.heading == f.heading);
    let mut found: Vec<&FigureAnswer> = knob.figures.iter().filter(changes).collect();
    found.sort_by_key(|f| !asked(f));
    found.truncate(MOST_SERIES);
    found
}

fn series(
    figures: &[&FigureAnswer],
    place: &dyn Fn(usize) -> Option<f64>,
    label: &dyn Fn(usize) -> String,
) -> Vec<LogSeries> {
    let one = |(i, figure): (usize, &&FigureAnswer)| {
        let is_limit = figure.limit.is_some_and(|l| l.how == How::Richardson);
        let from = if is_limit { "Richardson" } else { "finest" };
        let points = figure.errors.iter().enumerate();
        let points = points.filter_map(|(v, error)| Some((v, (place(v)?, (*error)?))));
        let (values, points): (Vec<usize>, Vec<(f64, f64)>) = points.unzip();
        LogSeries {
            label: format!("{} (from {from})", figure.heading),
            // The values are written once, beside the first figure.
            names: values.into_iter().filter(|_| i == 0).map(label).collect(),
            points,
            joined: true,
        }
    };
    figures.iter().enumerate().map(one).collect()
}
