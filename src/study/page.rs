//! Report of a study (report.html): the request and the results, the responses of all cases in one
//! chart, tables and pictures, in one page.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use serde::Serialize;

use super::analysis::{Analysis, Refined, Refinement};
use super::cases::at_words;
use super::convergence::{How, SAME};
use super::error::StudyError;
use super::file::{Mode, Study};
use super::folder::Settings;
use super::parameter::Parameter;
use super::pictures::Picture;
use super::quantity::{Figure, name_and_unit, with_unit};
use super::report::{OF_RUNS, day, least_values, remarks};
use super::results::{CaseResult, Figures};
use crate::export::report::REPORT;
use crate::export::report::frame::{self, Frame, card, frame, line, warnings};
use crate::export::{csv, write_file};
use crate::version;
use crate::words::{counted, figure, in_unit, percent};

const SCRIPTS: [&str; 1] = [include_str!("page.js")];
/// Largest number of points of all curves together, which a browser draws without delay.
const MOST_POINTS: usize = 60_000;

/// Contents of the page.
#[derive(Debug)]
pub struct Contents<'a> {
    pub study: &'a Study,
    pub settings: &'a Settings,
    pub results: &'a [CaseResult],
    pub analysis: &'a Analysis,
    /// Pictures in the folder `plots` of the study.
    pub pictures: &'a [Picture],
}

/// Data of the script.
#[derive(Debug, Serialize)]
struct Data<'a> {
    parameters: Vec<Values>,
    curves: Vec<Curve<'a>>,
}

/// Title of a parameter, and labels of its values.
#[derive(Debug, Serialize)]
struct Values {
    title: String,
    values: Vec<String>,
}

/// Response of a case.
#[derive(Debug, Serialize)]
struct Curve<'a> {
    case: &'a str,
    /// Position of the value of each parameter.
    values: &'a [usize],
    frequency_hz: Vec<f64>,
    amplitude_m: Vec<Option<f64>>,
}

/// Writes the page.
///
/// # Errors
/// A table or a picture of the study that cannot be read, or a page that cannot be written.
pub fn write(path: &Path, contents: &Contents<'_>) -> Result<(), StudyError> {
    let (study, results) = (contents.study, contents.results);
    let values = |p: &Parameter| Values {
        title: p.title(),
        values: (0..p.values.len()).map(|v| p.words(v)).collect(),
    };
    let data = Data {
        parameters: study.parameters.iter().map(values).collect(),
        curves: curves(contents)?,
    };
    let mode = match study.mode {
        Mode::OneAtATime => "one parameter at a time around the base",
        Mode::Grid => "every combination of the parameters",
    };
    let links = [
        ("answer", "Answer", true),
        ("responses", "Responses", !data.curves.is_empty()),
        ("cases", "Cases", true),
        (
            "errors",
            "Errors",
            !contents.analysis.refinements.is_empty(),
        ),
        ("pictures", "Pictures", !contents.pictures.is_empty()),
    ];
    let links = links.into_iter().filter(|(_, _, shown)| *shown);
    let page = frame(&Frame {
        title: &format!("Study {}", study.name),
        subtitle: html! {
            "dovetail " (version::WITH_COMMIT) ", " time { (day(results)) } ", scene "
            code { (study.scene.display()) } ", " (counted(results.len(), "case", "cases")) ", "
            (mode)
        },
        links: &links.map(|(id, title, _)| (id, title)).collect::<Vec<_>>(),
        main: html! {
            (answer(contents))
            (warnings(remarks(results).iter().map(String::as_str)))
            (responses(&data))
            (cases(contents))
            (errors(contents))
            (pictures(contents)?)
        },
        data: &frame::json(&data),
        scripts: &SCRIPTS,
    });
    Ok(write_file(path, page.into_string().as_bytes())?)
}

/// Responses in the folders of the cases.
fn curves<'a>(contents: &Contents<'a>) -> Result<Vec<Curve<'a>>, StudyError> {
    let mut curves = Vec::new();
    for result in contents.results {
        let observation = result.figures().and_then(|f| f.observation.as_deref());
        let Some(observation) = observation else {
            continue;
        };
        let path = contents.settings.folder(&result.case).join("response.csv");
        let amplitude = format!("{observation}_amplitude_m");
        let Some(rows) = csv::read_columns(&path, ["frequency_hz", &amplitude])? else {
            continue;
        };
        let points = rows.into_iter().filter_map(|[at, a]| Some((at?, a)));
        let points: Vec<_> = points.collect();
        let (frequency_hz, amplitude_m) = thinned(&points, contents.results.len());
        curves.push(Curve {
            case: &result.case.slug,
            values: &result.case.values,
            frequency_hz,
            amplitude_m,
        });
    }
    Ok(curves)
}

/// Thins a curve by keeping the largest point of each group of neighbours, so that all curves
/// together are drawn without delay and no peak is lost.
fn thinned(points: &[(f64, Option<f64>)], curves: usize) -> (Vec<f64>, Vec<Option<f64>>) {
    let most = (MOST_POINTS / curves.max(1)).max(2);
    let largest = |near: &[(f64, Option<f64>)]| {
        let height = |p: &(f64, Option<f64>)| p.1.unwrap_or(f64::NEG_INFINITY);
        near.iter()
            .max_by(|a, b| height(a).total_cmp(&height(b)))
            .copied()
    };
    let near = points.chunks(points.len().div_ceil(most).max(1));
    near.filter_map(largest).unzip()
}

fn answer(contents: &Contents<'_>) -> Markup {
    let (study, results, analysis) = (contents.study, contents.results, contents.analysis);
    let all = results.len();
    let count = |wanted: &dyn Fn(&Figures) -> bool| {
        let figures = results.iter().filter_map(|r| r.figures());
        figures.filter(|f| wanted(f)).count()
    };
    let complete = count(&|_| true);
    let unconverged = count(&|f| f.unconverged > 0);
    let at_ends = count(&|f| f.peak_at_end_of_range);
    let seconds = results.iter().filter_map(|r| r.figures());
    let seconds: f64 = seconds.filter_map(|f| f.processor_seconds).sum();
    let least = least_values(study, results, analysis);
    html! {
        section #answer {
            h2 { "Answer" }
            div.cards {
                (card("Cases with a result", &format!("{complete} of {all}"), &html! {
                    @if complete == all { "none failed" } @else { "see the warnings" }
                }))
                @for p in study.parameters.iter().filter(|p| p.values.len() > 1) {
                    (card(
                        &format!("{}, {}", p.title(), p.kind.word()),
                        &counted(p.values.len(), "value", "values"),
                        &html! { (p.values[0].label) " to " (p.values[p.values.len() - 1].label) },
                    ))
                }
                (card("All cases took", &format!("{} s", figure(seconds, 3)), &html! {
                    "of the processor"
                }))
            }
            @if least.is_empty() {
                p.quiet {
                    "The study asks for no least value (" code { "[[minimise]]" } "): its answer is "
                    "the responses, the tables and the pictures below."
                }
            } @else {
                h3 { "Least values" }
                ul { @for line in &least { li { (line) } } }
            }
            h3 { "Can this be trusted?" }
            ul.trust {
                (line(complete == all, &html! {
                    (complete) " of " (counted(all, "case has", "cases have")) " a result."
                }))
                (line(unconverged == 0, &html! {
                    (counted(unconverged, "case has", "cases have"))
                    " frequencies that did not converge."
                }))
                (line(at_ends == 0, &html! {
                    (counted(at_ends, "case has its", "cases have their"))
                    " peak at an end of the frequencies."
                }))
                @if !study.parameters.iter().any(Parameter::is_numerical) {
                    li.quiet {
                        "No parameter is numerical: nothing here says how far meshes, modes and "
                        "harmonics err."
                    }
                }
            }
        }
    }
}

fn responses(data: &Data<'_>) -> Markup {
    if data.curves.is_empty() {
        return html! {};
    }
    let parameters = || data.parameters.iter().enumerate();
    let varied = || parameters().filter(|(_, p)| p.values.len() > 1);
    html! {
        section #responses {
            h2 { "Responses" }
            p {
                "The response of every case. Point at a curve for its case, drag over a stretch to "
                "zoom, double-click to see all."
            }
            div.tools {
                @if varied().count() > 0 {
                    label { "colour by " select #colour-by {
                        @for (k, p) in varied() { option value=(k) { (p.title) } }
                    } }
                }
                @for (k, p) in varied() {
                    label { (p.title) " " select.only data-parameter=(k) {
                        option value="" { "all" }
                        @for (v, words) in p.values.iter().enumerate() {
                            option value=(v) { (words) }
                        }
                    } }
                }
                label { input #logarithmic type="checkbox"; " logarithmic" }
            }
            div #response-chart .chart {}
            div #response-key .key {}
        }
    }
}

/// Table; `first` makes the content of the first cell of a row from the number of the row and the
/// text.
fn table(
    class: &str,
    header: &[String],
    rows: &[Vec<String>],
    first: impl Fn(usize, &str) -> Markup,
) -> Markup {
    html! {
        div.wide { table class=(class) {
            thead { tr { @for cell in header { th { (cell) } } } }
            tbody { @for (r, row) in rows.iter().enumerate() { tr {
                @for (c, cell) in row.iter().enumerate() {
                    td { @if c == 0 { (first(r, cell)) } @else { (cell) } }
                }
            } } }
        } }
    }
}

/// Name of a figure with the unit of its largest value, and the factor to that unit.
fn scaled(figure: &Figure, values: impl Iterator<Item = f64>) -> (String, f64) {
    let largest = values.fold(0.0_f64, |m, v| m.max(v.abs()));
    let (unit, factor) = in_unit(figure.unit(), largest);
    (with_unit(&figure.name, &unit), factor)
}

/// Title of a column of [`OF_RUNS`].
fn of_runs(heading: &str) -> String {
    let (name, unit) = name_and_unit(heading);
    with_unit(&name, unit)
}

/// Table with one row per case: each figure with its difference from the finest case.
fn cases(contents: &Contents<'_>) -> Markup {
    let (study, results, analysis) = (contents.study, contents.results, contents.analysis);
    let mut header = vec!["case".to_owned()];
    header.extend(study.parameters.iter().map(Parameter::title));
    let mut rows: Vec<Vec<String>> = results.iter().map(|r| vec![r.case.slug.clone()]).collect();
    for (row, result) in rows.iter_mut().zip(results) {
        row.extend(result.case.labels(study).into_iter().map(str::to_owned));
    }
    for (f, figure) in analysis.figures.iter().enumerate() {
        let value = |result: &CaseResult| result.value(&figure.heading);
        let (title, factor) = scaled(figure, results.iter().filter_map(value));
        header.push(title);
        for (c, (row, result)) in rows.iter_mut().zip(results).enumerate() {
            let number = value(result).map(|v| figure.number(factor * v, 5));
            let difference = analysis.differences[c][f].filter(|d| *d > SAME);
            let difference = difference.map(|d| format!(" ({})", percent(d, 2)));
            row.push(number.unwrap_or_default() + &difference.unwrap_or_default());
        }
    }
    header.extend(OF_RUNS.map(|(heading, _)| of_runs(heading)));
    for (row, result) in rows.iter_mut().zip(results) {
        row.extend(OF_RUNS.map(|(_, cell)| cell(result).words(|v| figure(v, 3))));
    }
    let designs = &analysis.designs;
    let same = analysis.figures.iter();
    let same = same.filter(|f| !designs.cases.is_empty() && !designs.changing.contains(f));
    let same: Vec<&str> = same.map(|f| f.name.as_str()).collect();
    let link = |r: usize, name: &str| {
        let folder = contents.settings.folder(&results[r].case);
        html! {
            @if folder.join(REPORT).is_file() {
                a href={ "cases/" (name) "/" (REPORT) } { (name) }
            } @else { (name) }
        }
    };
    html! {
        section #cases {
            h2 { "Cases" }
            p {
                "A click on a heading sorts by it. Each case links to its own report. "
                code { "table.csv" } " has the same with all digits."
                @if !analysis.refinements.is_empty() {
                    " In brackets stands the difference from the finest case."
                }
            }
            (table("sorted", &header, &rows, link))
            @if !same.is_empty() {
                p.quiet { "The same for all designs, and in no picture of them: " (same.join(", ")) "." }
            }
        }
    }
}

/// Table for each numerical parameter at each design.
fn errors(contents: &Contents<'_>) -> Markup {
    let (study, analysis) = (contents.study, contents.analysis);
    html! {
        @if !analysis.refinements.is_empty() {
            section #errors {
                h2 { "Errors of the numerical parameters" }
                p {
                    "A column per value, from coarse to fine. Each figure has its values, their "
                    "differences from the finest one, the error that each is estimated to make, the "
                    "order that shows, and what the estimate is counted from."
                }
                @for refinement in &analysis.refinements {
                    @let (header, rows) = one_refinement(contents, refinement);
                    h3 {
                        (study.parameters[refinement.parameter].title())
                        (at_words(study, &refinement.at))
                    }
                    (table("plain", &header, &rows, |_, name| html! { (name) }))
                    @let same = refinement.figures.iter().zip(&analysis.figures);
                    @let same = same.filter(|(refined, _)| is_unchanged(refined));
                    @let same: Vec<&str> = same.map(|(_, f)| f.name.as_str()).collect();
                    @if !same.is_empty() {
                        p.quiet { "It has no influence on: " (same.join(", ")) "." }
                    }
                }
            }
        }
    }
}

fn is_unchanged(refined: &Refined) -> bool {
    refined
        .limit
        .is_some_and(|limit| limit.how == How::Unchanged)
}

fn one_refinement(
    contents: &Contents<'_>,
    refinement: &Refinement,
) -> (Vec<String>, Vec<Vec<String>>) {
    let parameter = &contents.study.parameters[refinement.parameter];
    let mut header = vec![String::new()];
    header.extend(parameter.values.iter().map(|v| v.label.clone()));
    header.extend(["order", "counted from"].map(str::to_owned));
    let row = |name: &str, cells: Vec<String>, end: [String; 2]| {
        [vec![name.to_owned()], cells, end.to_vec()].concat()
    };
    let none = || [const { String::new() }; 2];
    // Processor seconds, memory and outcome.
    let mut rows = Vec::from_iter([0, 2, 4].map(|at| {
        let (heading, cell) = OF_RUNS[at];
        let cases = refinement.cases.iter().map(|c| &contents.results[*c]);
        let cells = cases.map(|r| cell(r).words(|v| figure(v, 3)));
        row(&of_runs(heading), cells.collect(), none())
    }));
    let figures = refinement.figures.iter().zip(&contents.analysis.figures);
    for (refined, figure) in figures.filter(|(refined, _)| !is_unchanged(refined)) {
        let cells = |values: &[Option<f64>], text: &dyn Fn(f64) -> String| -> Vec<String> {
            let texts = values.iter().map(|v| v.map(text).unwrap_or_default());
            texts.collect()
        };
        let (title, factor) = scaled(figure, refined.values.iter().flatten().copied());
        let values = cells(&refined.values, &|v| figure.number(factor * v, 6));
        rows.push(row(&title, values, counted_from(refined, figure, factor)));
        let share = |v: f64| percent(v, 2);
        let differences = cells(&refined.differences, &share);
        rows.push(row("– from the finest", differences, none()));
        let estimates = cells(&refined.estimated_errors, &share);
        rows.push(row("– estimated error", estimates, none()));
    }
    (header, rows)
}

/// Observed order, and the value from which estimated errors are measured.
fn counted_from(refined: &Refined, of: &Figure, factor: f64) -> [String; 2] {
    let Some(limit) = refined.limit else {
        return [const { String::new() }; 2];
    };
    let order = limit.order.map(|p| figure(p, 2));
    let from = match limit.how {
        How::Richardson => {
            let value = of.number(factor * limit.value, 6);
            return [order.unwrap_or_default(), format!("{value} (Richardson)")];
        }
        How::Finest => {
            let seen = order.map_or(String::new(), |order| format!(" ({order})"));
            return [format!("none shows{seen}"), "the finest".to_owned()];
        }
        How::Reference => "the last",
        How::Unchanged | How::Single => "",
    };
    [String::new(), from.to_owned()]
}

fn pictures(contents: &Contents<'_>) -> Result<Markup, StudyError> {
    let folder = contents.settings.out.join("plots");
    let mut shown = Vec::new();
    for (shows, file) in contents.pictures {
        let path = folder.join(file);
        let svg = std::fs::read(&path).map_err(|source| StudyError::Read { path, source })?;
        let source = format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg));
        shown.push((shows, source));
    }
    Ok(html! {
        @if !shown.is_empty() {
            section #pictures {
                h2 { "Pictures" }
                div.pictures {
                    @for (shows, source) in &shown {
                        figure { figcaption { (shows) "." } img src=(source) alt=(shows); }
                    }
                }
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
