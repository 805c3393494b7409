//! plots/*.svg of a study.

use std::path::Path;

use super::answers::{Answers, FigureAnswer, KnobAnswer};
use super::file::Study;
use super::results::CaseResult;
use crate::error::Error;
use crate::export::plots::{LogSeries, write_loglog};
use crate::study::answers::orders::How;

/// Figures drawn in one plot, as many as there are colours.
const MOST_SERIES: usize = 6;

/// Errors against each knob and against seconds, and the Pareto fronts.
pub fn write(
    folder: &Path,
    study: &Study,
    results: &[CaseResult],
    answers: &Answers,
) -> Result<(), Error> {
    for answer in &answers.knobs {
        let knob = &study.knobs[answer.knob];
        let drawn = drawn(answers, answer);
        if drawn.is_empty() {
            continue;
        }
        if let Some(sizes) = knob.sizes() {
            let path = folder.join(format!("{}.svg", knob.name));
            let axis = format!("size of {}", knob.name);
            let series = series(&drawn, &|v| Some(sizes[v]), &|v| {
                knob.values[v].label.clone()
            });
            write_loglog(&path, &study.name, [&axis, "relative error"], &series)?;
        }
        let path = folder.join(format!("{}_seconds.svg", knob.name));
        let seconds = |v: usize| Some(results[answer.cases[v]].figures()?.cost_seconds());
        let series = series(&drawn, &seconds, &|v| knob.values[v].label.clone());
        let title = format!("{}: {}", study.name, knob.name);
        write_loglog(&path, &title, ["seconds", "relative error"], &series)?;
    }
    for front in &answers.fronts {
        let points = |wanted: bool| -> Vec<(usize, (f64, f64))> {
            let all = results
                .iter()
                .enumerate()
                .filter(|(c, _)| front.on_front[*c] == wanted);
            let mut found: Vec<_> = all
                .filter_map(|(c, r)| Some((c, (r.figures()?.cost_seconds(), front.errors[c]?))))
                .collect();
            found.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
            found
        };
        let series = [("Pareto front", true), ("other runs", false)].map(|(label, on_front)| {
            let points = points(on_front);
            LogSeries {
                label: label.to_owned(),
                names: points
                    .iter()
                    .filter(|_| on_front)
                    .map(|(c, _)| results[*c].case.slug.clone())
                    .collect(),
                points: points.into_iter().map(|(_, p)| p).collect(),
                joined: on_front,
            }
        });
        let path = folder.join(format!("pareto_{}.svg", front.heading));
        let axis = format!("estimated error of {}", front.heading);
        write_loglog(&path, &study.name, ["seconds", &axis], &series)?;
    }
    Ok(())
}

/// Figures that change with the knob: those asked for first.
fn drawn<'a>(answers: &Answers, knob: &'a KnobAnswer) -> Vec<&'a FigureAnswer> {
    let changes = |f: &&FigureAnswer| {
        f.limit
            .is_some_and(|l| matches!(l.how, How::Richardson | How::Finest | How::Reference))
    };
    let mut found: Vec<&FigureAnswer> = knob.figures.iter().filter(changes).collect();
    found.sort_by_key(|f| {
        !answers
            .fronts
            .iter()
            .any(|front| front.heading == f.heading)
    });
    found.truncate(MOST_SERIES);
    found
}

fn series(
    figures: &[&FigureAnswer],
    place: &dyn Fn(usize) -> Option<f64>,
    name: &dyn Fn(usize) -> String,
) -> Vec<LogSeries> {
    figures
        .iter()
        .enumerate()
        .map(|(i, figure)| {
            let richardson = figure.to_richardson.iter().any(Option::is_some);
            let (errors, from) = match richardson {
                true => (&figure.to_richardson, "Richardson"),
                false => (&figure.to_finest, "finest"),
            };
            let points: Vec<(usize, (f64, f64))> = (0..errors.len())
                .filter_map(|v| Some((v, (place(v)?, errors[v]?))))
                .collect();
            LogSeries {
                label: format!("{} (from {from})", figure.heading),
                // The values are written once, beside the first figure.
                names: match i {
                    0 => points.iter().map(|(v, _)| name(*v)).collect(),
                    _ => Vec::new(),
                },
                points: points.into_iter().map(|(_, p)| p).collect(),
                joined: true,
            }
        })
        .collect()
}
