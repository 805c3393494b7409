//! report.html of a study: what was asked and what came out, the responses of all cases over each other, tables and
//! pictures, in one page.

use std::path::Path;
use std::time::SystemTime;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use serde::Serialize;

use super::analysis::{Analysis, AtDesign};
use super::error::StudyError;
use super::file::{Mode, Study};
use super::folder::Settings;
use super::parameter::Parameter;
use super::pictures::Picture;
use super::quantity::name_and_unit;
use super::report::{all_cases, at_words, least_values, one_parameter, recommended, remarks};
use super::results::{CaseResult, Ended};
use crate::export::report::frame::{self, Frame, card, frame, line, warnings};
use crate::export::{csv, write_file};
use crate::metrics;
use crate::version;
use crate::words::{counted, figure};

const SCRIPTS: [&str; 1] = [include_str!("page.js")];
/// Points of all curves together: what a browser draws without delay.
const MOST_POINTS: usize = 60_000;

/// What the page is about.
#[derive(Debug)]
pub struct Contents<'a> {
    pub study: &'a Study,
    pub settings: &'a Settings,
    pub results: &'a [CaseResult],
    pub analysis: &'a Analysis,
    /// In the folder `plots` of the study.
    pub pictures: &'a [Picture],
}

/// What the script draws.
#[derive(Debug, Serialize)]
struct Data<'a> {
    parameters: Vec<Values<'a>>,
    curves: Vec<Curve<'a>>,
}

#[derive(Debug, Serialize)]
struct Values<'a> {
    name: &'a str,
    labels: Vec<&'a str>,
}

/// The response of a case.
#[derive(Debug, Serialize)]
struct Curve<'a> {
    case: &'a str,
    /// Of each parameter.
    values: &'a [usize],
    frequency_hz: Vec<f64>,
    amplitude_m: Vec<Option<f64>>,
}

/// # Errors
/// A table or a picture of the study that cannot be read, or a page that cannot be written.
pub fn write(path: &Path, contents: &Contents<'_>) -> Result<(), StudyError> {
    let data = Data {
        parameters: contents.study.parameters.iter().map(values).collect(),
        curves: curves(contents)?,
    };
    let study = contents.study;
    let mode = match study.mode {
        Mode::OneAtATime => "one parameter at a time around the base",
        Mode::Grid => "every combination of the parameters",
    };
    let page = frame(&Frame {
        title: &format!("Study {}", study.name),
        subtitle: html! {
            "dovetail " (version::WITH_COMMIT) ", " time { (today()) } ", scene " code { (study.scene.display()) } ", "
            (counted(contents.results.len(), "case", "cases")) ", " (mode)
        },
        links: &links(contents, &data),
        main: html! {
            (answer(contents))
            (warnings(remarks(contents.results).iter().map(String::as_str)))
            (responses(&data))
            (cases(contents))
            (parameters(contents))
            (pictures(contents)?)
        },
        data: &frame::json(&data),
        scripts: &SCRIPTS,
    });
    Ok(write_file(path, page.into_string().as_bytes())?)
}

/// `2004-02-29`, in universal time.
fn today() -> String {
    let now = metrics::universal_time(SystemTime::now());
    now.split('T').next().unwrap_or(&now).to_owned()
}

fn values(parameter: &Parameter) -> Values<'_> {
    Values {
        name: &parameter.name,
        labels: parameter.values.iter().map(|v| v.label.as_str()).collect(),
    }
}

fn links(contents: &Contents<'_>, data: &Data<'_>) -> Vec<(&'static str, &'static str)> {
    let all = [
        ("answer", "Answer", true),
        ("responses", "Responses", !data.curves.is_empty()),
        ("cases", "Cases", true),
        (
            "parameters",
            "Errors",
            contents
                .analysis
                .at_designs
                .iter()
                .any(|at| !at.parameters.is_empty()),
        ),
        ("pictures", "Pictures", !contents.pictures.is_empty()),
    ];
    let shown = all.into_iter().filter(|(_, _, shown)| *shown);
    shown.map(|(id, title, _)| (id, title)).collect()
}

/// The responses that the cases left in their folders.
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
        let points = rows
            .into_iter()
            .filter_map(|[at, amplitude]| Some((at?, amplitude)));
        let (frequency_hz, amplitude_m) =
            thinned(&points.collect::<Vec<_>>(), contents.results.len());
        curves.push(Curve {
            case: &result.case.slug,
            values: &result.case.values,
            frequency_hz,
            amplitude_m,
        });
    }
    Ok(curves)
}

/// Of neighbours the largest, so that all curves together are drawn without delay; no peak is lost.
fn thinned(points: &[(f64, Option<f64>)], curves: usize) -> (Vec<f64>, Vec<Option<f64>>) {
    let most = (MOST_POINTS / curves.max(1)).max(2);
    let largest = |near: &[(f64, Option<f64>)]| {
        let by_amplitude = |a: &&(f64, Option<f64>), b: &&(f64, Option<f64>)| {
            let of = |p: &(f64, Option<f64>)| p.1.unwrap_or(f64::NEG_INFINITY);
            of(a).total_cmp(&of(b))
        };
        near.iter().max_by(by_amplitude).copied()
    };
    let near = points.chunks(points.len().div_ceil(most).max(1));
    near.filter_map(largest).unzip()
}

fn answer(contents: &Contents<'_>) -> Markup {
    let Contents {
        study,
        results,
        analysis,
        ..
    } = *contents;
    let complete = results.iter().filter(|r| r.figures().is_some()).count();
    let costs = results.iter().filter_map(|r| r.figures());
    let cost_s: f64 = costs.map(|f| f.cost.compared_s()).sum();
    let least = least_values(study, results, analysis);
    let recommended = recommended(study, results, analysis);
    html! {
        section #answer {
            h2 { "Answer" }
            div.cards {
                (card("Cases with a result", &format!("{complete} of {}", results.len()), &html! {
                    @if complete == results.len() { "none failed" } @else { "see the warnings" }
                }))
                @for parameter in study.parameters.iter().filter(|k| k.values.len() > 1) {
                    (card(
                        &format!("Parameter {} ({})", parameter.name, parameter.kind.word()),
                        &counted(parameter.values.len(), "value", "values"),
                        &html! { (parameter.values[0].label) " to " (parameter.values[parameter.values.len() - 1].label) },
                    ))
                }
                (card("All cases took", &format!("{} s", figure(cost_s, 3)), &html! { "of the processor" }))
            }
            @if !least.is_empty() {
                h3 { "Least values" }
                ul { @for line in &least { li { (line) } } }
            }
            @if !recommended.is_empty() {
                h3 { "Recommended settings" }
                ul { @for line in &recommended { li { (line) } } }
            }
            @if least.is_empty() && recommended.is_empty() {
                p.quiet {
                    "The study asks for no least value and for no accuracy (" code { "[[minimise]]" } ", "
                    code { "[[recommend]]" } "): its answer is the responses, the table and the pictures below."
                }
            }
            h3 { "Can this be trusted?" }
            (trust(contents, complete))
        }
    }
}

fn trust(contents: &Contents<'_>, complete: usize) -> Markup {
    let results = contents.results;
    let unconverged = results
        .iter()
        .filter(|r| matches!(&r.ended, Ended::WithFigures(f) if f.unconverged > 0))
        .count();
    let at_ends = results.iter().filter(|r| r.peak_at_end_of_range()).count();
    html! {
        ul.trust {
            (line(complete == results.len(), &html! { (complete) " of " (counted(results.len(), "case has", "cases have")) " a result." }))
            (line(unconverged == 0, &html! { (counted(unconverged, "case has", "cases have")) " frequencies that did not converge." }))
            (line(at_ends == 0, &html! { (counted(at_ends, "case has its", "cases have their")) " peak at an end of the frequencies." }))
            @if contents.study.parameters.iter().all(Parameter::is_design) {
                li.quiet { "All parameters are design values: nothing here says how far meshes, modes and harmonics err." }
            }
        }
    }
}

fn responses(data: &Data<'_>) -> Markup {
    if data.curves.is_empty() {
        return html! {};
    }
    let turned = || {
        data.parameters
            .iter()
            .enumerate()
            .filter(|(_, parameter)| parameter.labels.len() > 1)
    };
    html! {
        section #responses {
            h2 { "Responses" }
            p {
                "The response of every case. Point at a curve for its case, drag over a stretch to zoom, double-click to see all."
            }
            div.tools {
                @if turned().count() > 0 {
                    label { "colour by " select #colour-by {
                        @for (k, parameter) in turned() { option value=(k) { (parameter.name) } }
                    } }
                }
                @for (k, parameter) in turned() {
                    label { (parameter.name) " " select.only data-parameter=(k) {
                        option value="" { "all" }
                        @for (v, label) in parameter.labels.iter().enumerate() { option value=(v) { (label) } }
                    } }
                }
                label { input #logarithmic type="checkbox"; " logarithmic" }
            }
            div #response-chart .chart {}
            div #response-key .key {}
        }
    }
}

/// The heading of a column of table.csv in words.
fn titled(heading: &str) -> String {
    let (start, heading) = match heading.strip_prefix("error_") {
        Some(of) => ("error of ", of),
        None => ("", heading),
    };
    match name_and_unit(heading) {
        (name, unit) if unit.is_empty() || !start.is_empty() => {
            format!("{start}{}", name.replace('_', " "))
        }
        (name, unit) => format!("{}, {unit}", name.replace('_', " ")),
    }
}

fn table(
    id: &str,
    header: &[String],
    rows: &[Vec<String>],
    first: impl Fn(usize, &str) -> Markup,
) -> Markup {
    html! {
        div.wide { table class=(id) {
            thead { tr { @for cell in header { th { (titled(cell)) } } } }
            tbody { @for (r, row) in rows.iter().enumerate() { tr {
                @for (c, cell) in row.iter().enumerate() {
                    td { @if c == 0 { (first(r, cell)) } @else { (cell) } }
                }
            } } }
        } }
    }
}

fn cases(contents: &Contents<'_>) -> Markup {
    let Contents {
        study,
        results,
        analysis,
        ..
    } = *contents;
    let (header, rows) = all_cases(study, results, analysis);
    let fixed = analysis.headings.iter();
    let fixed = fixed
        .filter(|h| !analysis.designs.cases.is_empty() && !analysis.designs.changing.contains(h));
    let fixed: Vec<&str> = fixed.map(String::as_str).collect();
    let link = |r: usize, name: &str| {
        let has_report = contents
            .settings
            .folder(&results[r].case)
            .join("report.html")
            .is_file();
        html! {
            @if has_report { a href={ "cases/" (name) "/report.html" } { (name) } } @else { (name) }
        }
    };
    html! {
        section #cases {
            h2 { "Cases" }
            p { "A click on a heading sorts by it. Each case links to its own report. " code { "table.csv" } " has the same with all digits." }
            (table("sorted", &header, &rows, link))
            @if !fixed.is_empty() {
                p.quiet { "The same for all designs, and in no picture of them: " (fixed.join(", ")) "." }
            }
        }
    }
}

fn parameters(contents: &Contents<'_>) -> Markup {
    let Contents {
        study,
        results,
        analysis,
        ..
    } = *contents;
    let at_designs = || {
        analysis
            .at_designs
            .iter()
            .filter(|at: &&AtDesign| !at.parameters.is_empty())
    };
    if at_designs().count() == 0 {
        return html! {};
    }
    html! {
        section #parameters {
            h2 { "Errors of the numerical parameters" }
            p {
                "A column per value, from coarse to fine. Each figure has its values, the error that each value is taken to make, the order "
                "that shows, and what the errors are counted from."
            }
            @for at in at_designs() {
                @for answer in &at.parameters {
                    @let (header, rows) = one_parameter(study, results, answer);
                    h3 { "Parameter " (study.parameters[answer.parameter].name) (at_words(study, at)) }
                    (table("plain", &header, &rows, |_, name| html! { (name) }))
                }
            }
        }
    }
}

fn pictures(contents: &Contents<'_>) -> Result<Markup, StudyError> {
    let folder = contents.settings.out.join("plots");
    let mut shown = Vec::new();
    for (shows, file) in contents.pictures {
        let path = folder.join(file);
        let svg = std::fs::read(&path).map_err(|source| StudyError::Read { path, source })?;
        shown.push((
            shows,
            format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg)),
        ));
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
