//! Report of a study (report.html): the request and the results, the responses of all cases in one
//! chart, tables and pictures, in one page.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use serde_json::{Value, json};

use super::analysis::{Analysis, ParameterRefinement, Refined};
use super::convergence::{How, SAME};
use super::folder::StudyPlan;
use super::pictures::Picture;
use super::report::{OF_RUNS, day, remarks};
use super::results::CaseResult;
use crate::study_file::StudyError;
use crate::study_file::keys::CombinationMode;
use crate::study_file::parameter::Parameter;
use crate::study_file::quantity::Figure;
use crate::version;
use dovetail_export::report::REPORT;
use dovetail_export::report::frame::{self, Frame, card, frame, warnings};
use dovetail_export::words::{append_unit, counted, figure, percent, prefixed_unit, title};
use dovetail_export::{csv, write_file};

const SCRIPTS: [&str; 1] = [include_str!("page.js")];
/// Largest number of points of all curves together, which a browser draws without delay.
const MOST_POINTS: usize = 60_000;

/// Writes the page; `pictures` are in the folder `plots` of the study.
///
/// # Errors
/// A table or a picture of the study that cannot be read, or a page that cannot be written.
pub fn write(
    plan: &StudyPlan,
    analysis: &Analysis<'_>,
    pictures: &[Picture],
) -> Result<(), StudyError> {
    let (study, results) = (analysis.study, analysis.results);
    let parameter = |p: &Parameter| {
        let values: Vec<String> = p.values.iter().map(|v| p.words(v)).collect();
        json!({ "title": p.title(), "values": values })
    };
    let parameters: Vec<Value> = study.parameters.iter().map(parameter).collect();
    let curves = curves(plan, results)?;
    let mode = match study.mode {
        CombinationMode::OneAtATime => "one parameter at a time around the base",
        CombinationMode::Grid => "every combination of the parameters",
    };
    let mut sections = vec![("answer", "Answer", answer(analysis))];
    if !curves.is_empty() {
        sections.push(("responses", "Responses", responses(analysis)));
    }
    sections.push(("cases", "Cases", cases(plan, analysis)));
    if !analysis.refinements.is_empty() {
        sections.push(("errors", "Errors", errors(analysis)));
    }
    if !pictures.is_empty() {
        sections.push(("pictures", "Pictures", picture_data(plan, pictures)?));
    }
    let links = sections.iter().map(|(id, title, _)| (*id, *title));
    let page = frame(&Frame {
        title: &format!("Study {}", study.name),
        subtitle: html! {
            "dovetail " (version::WITH_COMMIT) ", " time { (day(results)) } ", scene "
            code { (study.scene.display()) } ", " (counted(results.len(), "case", "cases")) ", "
            (mode)
        },
        links: &links.collect::<Vec<_>>(),
        main: html! {
            @for (id, title, body) in &sections {
                section id=(id) { h2 { (title) } (body) }
                @if *id == "answer" { (warnings(remarks(results).iter().map(String::as_str))) }
            }
        },
        data: &frame::json(&json!({ "parameters": parameters, "curves": curves })),
        scripts: &SCRIPTS,
    });
    let page = page.into_string();
    Ok(write_file(&plan.out.join(REPORT), page.as_bytes())?)
}

/// Responses in the folders of the cases.
fn curves(plan: &StudyPlan, results: &[CaseResult]) -> Result<Vec<Value>, StudyError> {
    let mut curves = Vec::new();
    for result in results {
        let response = result.figures().map(|f| &f.response);
        let Some(observation) = response.and_then(|r| r.observation.as_deref()) else {
            continue;
        };
        let path = plan.folder(&result.case).join("response.csv");
        let amplitude = format!("{observation}_amplitude_m");
        let Some(rows) = csv::read_columns(&path, ["frequency_hz", &amplitude])? else {
            continue;
        };
        let points = rows.into_iter().filter_map(|[at, a]| Some((at?, a)));
        let (frequency_hz, amplitude_m) = thinned(&points.collect::<Vec<_>>(), results.len());
        curves.push(json!({
            "case": result.case.slug,
            "values": result.case.values,
            "frequency_hz": frequency_hz,
            "amplitude_m": amplitude_m,
        }));
    }
    Ok(curves)
}

/// Thins a curve by keeping the largest point of each group of neighbours, so that all curves
/// together are drawn without delay and no peak is lost.
fn thinned(points: &[(f64, Option<f64>)], curves: usize) -> (Vec<f64>, Vec<Option<f64>>) {
    let most = (MOST_POINTS / curves.max(1)).max(2);
    let largest = |near: &[(f64, Option<f64>)]| {
        let height = |p: &(f64, Option<f64>)| p.1.unwrap_or(f64::NEG_INFINITY);
        let near = near.iter().copied();
        near.max_by(|a, b| height(a).total_cmp(&height(b)))
    };
    let near = points.chunks(points.len().div_ceil(most).max(1));
    near.filter_map(largest).unzip()
}

fn answer(analysis: &Analysis<'_>) -> Markup {
    let (study, results) = (analysis.study, analysis.results);
    let figures = || results.iter().filter_map(CaseResult::figures);
    let (all, complete) = (results.len(), figures().count());
    let seconds: f64 = figures().filter_map(|f| f.processor_seconds).sum();
    html! {
        div.cards {
            (card("Cases with a result", &format!("{complete} of {all}"), &html! {
                @if complete == all { "none failed" } @else { "see the warnings" }
            }))
            @for p in study.parameters.iter().filter(|p| p.values.len() > 1) {
                (card(
                    &format!("{}, {}", p.title(), p.kind),
                    &counted(p.values.len(), "value", "values"),
                    &html! { (p.values[0].label) " to " (p.values[p.last()].label) },
                ))
            }
            (card("All cases took", &format!("{} s", figure(seconds, 3)), &html! {
                "of the processor"
            }))
        }
        @if analysis.refinements.is_empty() {
            p.quiet {
                "No parameter is numerical: nothing here says how far meshes, modes and harmonics "
                "err."
            }
        }
    }
}

fn responses(analysis: &Analysis<'_>) -> Markup {
    let parameters = analysis.study.parameters.iter().enumerate();
    let varied: Vec<_> = parameters.filter(|(_, p)| p.values.len() > 1).collect();
    html! {
        p {
            "The response of every case. Point at a curve for its case, drag over a stretch to "
            "zoom, double-click to see all."
        }
        div.tools {
            @if !varied.is_empty() {
                label { "colour by " select #colour-by {
                    @for (k, p) in &varied { option value=(k) { (p.title()) } }
                } }
            }
            @for (k, p) in &varied {
                label { (p.title()) " " select.only data-parameter=(k) {
                    option value="" { "all" }
                    @for (v, value) in p.values.iter().enumerate() {
                        option value=(v) { (p.words(value)) }
                    }
                } }
            }
            label { input #logarithmic type="checkbox"; " logarithmic" }
        }
        div #response-chart .chart {}
        div #response-key .key {}
    }
}

fn table(class: &str, header: &[String], rows: &[Vec<Markup>]) -> Markup {
    html! {
        div.wide { table class=(class) {
            thead { tr { @for cell in header { th { (cell) } } } }
            tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
        } }
    }
}

/// Name of a figure with the unit of its largest value, and the factor to that unit.
fn scaled(figure: &Figure, values: impl Iterator<Item = f64>) -> (String, f64) {
    let largest = values.fold(0.0_f64, |m, v| m.max(v.abs()));
    let (unit, factor) = prefixed_unit(figure.unit(), largest);
    (append_unit(&figure.name, &unit), factor)
}

/// Table with one row per case: each figure with its difference from the finest case.
fn cases(plan: &StudyPlan, analysis: &Analysis<'_>) -> Markup {
    let (study, results) = (analysis.study, analysis.results);
    let mut header = vec!["case".to_owned()];
    header.extend(study.parameters.iter().map(Parameter::title));
    let mut rows: Vec<Vec<Markup>> = Vec::new();
    for CaseResult { case, .. } in results {
        let link = html! {
            @if plan.folder(case).join(REPORT).is_file() {
                a href={ "cases/" (case.slug) "/" (REPORT) } { (case.slug) }
            } @else { (case.slug) }
        };
        let labels = study.chosen(&case.values);
        let labels = labels.map(|(_, v)| html! { (v.label) });
        rows.push([link].into_iter().chain(labels).collect());
    }
    for (f, figure) in analysis.figures.iter().enumerate() {
        let value = |result: &CaseResult| result.value(&figure.heading);
        let (title, factor) = scaled(figure, results.iter().filter_map(value));
        header.push(title);
        for (c, row) in rows.iter_mut().enumerate() {
            let number = value(&results[c]).map(|v| figure.number(factor * v, 5));
            let difference = analysis.differences[c][f].filter(|d| *d > SAME);
            row.push(html! {
                (number.unwrap_or_default())
                @if let Some(d) = difference { " (" (percent(d, 2)) ")" }
            });
        }
    }
    for (heading, cell) in OF_RUNS {
        header.push(title(heading));
        for (row, result) in rows.iter_mut().zip(results) {
            row.push(html! { (cell(result).words(|v| figure(v, 3))) });
        }
    }
    html! {
        p {
            "A click on a heading sorts by it. Each case links to its own report. "
            code { "table.csv" } " has the same with all digits."
            @if !analysis.refinements.is_empty() {
                " In brackets stands the difference from the finest case."
            }
        }
        (table("sorted", &header, &rows))
    }
}

/// Table for each numerical parameter at each design.
fn errors(analysis: &Analysis<'_>) -> Markup {
    html! {
        p {
            "A column per value of a numerical parameter, from coarse to fine. Each figure that "
            "changes has its values, their differences from the finest one, the error that each is "
            "estimated to make, the order that shows, and what the estimate is counted from."
        }
        @for refinement in &analysis.refinements {
            @let parameter = &analysis.study.parameters[refinement.parameter];
            @let values = &analysis.results[refinement.cases[0]].case.values;
            @let ends = ["order", "counted from"].map(str::to_owned);
            @let header = [vec![String::new()], parameter.labels(), ends.to_vec()].concat();
            h3 { (parameter.title()) (analysis.study.case_conditions(values)) }
            (table("plain", &header, &refinement_rows(analysis, refinement)))
        }
    }
}

fn refinement_rows(analysis: &Analysis<'_>, refinement: &ParameterRefinement) -> Vec<Vec<Markup>> {
    let row = |name: &str, cells: Vec<String>, end: [String; 2]| {
        let cells = [name.to_owned()].into_iter().chain(cells).chain(end);
        cells.map(|cell| html! { (cell) }).collect()
    };
    let mut rows = Vec::new();
    // Processor seconds, memory and outcome.
    for at in [0, 2, 4] {
        let (heading, cell) = OF_RUNS[at];
        let cases = refinement.cases.iter().map(|c| &analysis.results[*c]);
        let cells = cases.map(|r| cell(r).words(|v| figure(v, 3)));
        rows.push(row(&title(heading), cells.collect(), Default::default()));
    }
    for (refined, figure) in refinement.figures.iter().zip(&analysis.figures) {
        let how = refined.limit.map(|limit| limit.how);
        if how == Some(How::Unchanged) {
            continue;
        }
        let (title, factor) = scaled(figure, refined.values.iter().flatten().copied());
        let values = texts(&refined.values, |v| figure.number(factor * v, 6));
        rows.push(row(&title, values, counted_from(refined, figure, factor)));
        for (name, shares) in [
            ("– from the finest", &refined.differences),
            ("– estimated error", &refined.estimated_errors),
        ] {
            let shares = texts(shares, |share| percent(share, 2));
            rows.push(row(name, shares, Default::default()));
        }
    }
    rows
}

/// Text of each value; empty where there is none.
fn texts(values: &[Option<f64>], text: impl Fn(f64) -> String) -> Vec<String> {
    let texts = values.iter().map(|v| v.map_or_else(String::new, &text));
    texts.collect()
}

/// Observed order, and the value from which estimated errors are measured.
fn counted_from(refined: &Refined, of: &Figure, factor: f64) -> [String; 2] {
    let limit = refined.limit.as_ref();
    let order = limit.and_then(|limit| limit.order).map(|p| figure(p, 2));
    match limit.map(|limit| (limit.how, limit.value)) {
        Some((How::Richardson, value)) => {
            let value = of.number(factor * value, 6);
            [order.unwrap_or_default(), format!("{value} (Richardson)")]
        }
        Some((How::Finest, _)) => {
            let seen = order.map_or(String::new(), |order| format!(" ({order})"));
            [format!("none shows{seen}"), "the finest".to_owned()]
        }
        Some((How::Reference, _)) => [String::new(), "the last".to_owned()],
        _ => Default::default(),
    }
}

/// The pictures, as data of the page.
fn picture_data(plan: &StudyPlan, pictures: &[Picture]) -> Result<Markup, StudyError> {
    let mut sources = Vec::new();
    for (shows, file) in pictures {
        let path = plan.out.join("plots").join(file);
        let svg = std::fs::read(&path).map_err(StudyError::io("reading", &path))?;
        let source = format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg));
        sources.push((shows, source));
    }
    Ok(html! {
        div.pictures {
            @for (shows, source) in &sources {
                figure { figcaption { (shows) "." } img src=(source) alt=(shows); }
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_peak_is_lost_where_points_are_left_out() {
        let height = |i: usize| match i {
            7_123 => Some(9.0),
            5 => None,
            _ => Some(1.0),
        };
        let points: Vec<_> = (0..20_000).map(|i| (i as f64, height(i))).collect();
        let (frequencies, amplitudes) = thinned(&points, 100);
        assert!(
            frequencies.len() <= MOST_POINTS / 100,
            "{}",
            frequencies.len()
        );
        let peak = amplitudes.iter().position(|a| *a == Some(9.0)).unwrap();
        assert_eq!(frequencies[peak], 7_123.0);
        assert_eq!(thinned(&points[..9], 100).0.len(), 9);
        assert_eq!(thinned(&points[..9], 100).1[5], None);
        assert!(thinned(&[], 1).0.is_empty());
    }
}
