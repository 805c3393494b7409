//! Text of a report, section by section.

mod answer;
mod computed;
mod forces;
mod response;
mod stress;

use std::f64::consts::PI;

use maud::{Markup, html};

use self::answer::answer;
use self::computed::computed;
use self::forces::forces;
use self::response::{contacts_at_peak, response};
use self::stress::stress;
use super::data::Data;
use super::frame::{self, Frame, frame, table, warnings};
use super::{Contents, REPORT};
use crate::csv::ASSEMBLY;
use crate::journal::JOURNAL;
use crate::manifest::{ContactSummary, StaticSummary};
use crate::words::{counted, figure, percent, quantity, static_counts, text_or_dash};
use dovetail_solver::description::{LoadMultiples, PathPoint, Scene, StaticSpec};
use dovetail_solver::dlft::StaticCounts;
use dovetail_solver::reduction::LISTED_MODES;
use dovetail_solver::results::modes::ModeKind;

const SCRIPTS: [&str; 4] = [
    include_str!("viewer.js"),
    include_str!("curves.js"),
    include_str!("flanks.js"),
    include_str!("report.js"),
];
/// Initial distance by which bodies are pulled apart to show the flanks, percent of their size.
const PULLED: usize = 25;

/// The whole page.
pub(super) fn page(contents: &Contents<'_>, data: &Data) -> Markup {
    let summary = contents.summary;
    let remarks = summary.warnings.iter().map(|warning| warning.text.as_str());
    // Identifier and text of the link to each section; the warnings have no link.
    let sections = [
        ("answer", "Answer", answer(contents)),
        ("warnings", "", warnings(remarks)),
        ("response", "Response", response(contents)),
        ("flanks", "Flanks", flanks(contents)),
        ("hysteresis", "Loops", loops(contents)),
        ("motion", "Motion", motion(contents)),
        ("stress", "Stress", stress(contents)),
        ("forces", "Forces", forces(contents)),
        ("static", "Static state", static_state(contents)),
        ("computed", "What was computed", computed(contents)),
        ("modes", "Frequencies", modes(contents)),
        ("effort", "Times", effort(contents)),
        ("files", "Files", files(contents)),
    ];
    let linked = sections.iter();
    let linked = linked.filter(|(_, link, section)| !link.is_empty() && !section.0.is_empty());
    frame(&Frame {
        title: &summary.scene.name,
        subtitle: html! {
            "dovetail " (summary.version)
            @if let Some(commit) = &summary.commit { " (" (commit) ")" }
            ", scene " code { (summary.scene.file) }
            @if !summary.begun.is_empty() { ", " time { (minute(&summary.begun)) } }
        },
        links: &linked.map(|(id, link, _)| (*id, *link)).collect::<Vec<_>>(),
        main: html! { @for (_, _, section) in &sections { (section) } },
        data: &frame::json(data),
        scripts: &SCRIPTS,
    })
}

/// Date and time to the minute: `2026-02-28 23:59 UTC` of `2026-02-28T23:59:59Z`.
fn minute(moment: &str) -> String {
    let (date, time) = moment.split_once('T').unwrap_or((moment, ""));
    let minute: String = time.chars().take("23:59".len()).collect();
    format!("{date} {minute} UTC")
}

fn flanks(contents: &Contents<'_>) -> Markup {
    if contents.flank_model().is_none() {
        return html! {};
    }
    html! {
        section #flanks {
            h2 { "Flanks" }
            p {
                "Each flank is unrolled: its length runs to the right. "
                "Where the scene rotates, outwards is up. "
                "A patch is the share of flank that belongs to one pair; point at it to read its value."
            }
            div.tools {
                label { "show " select #field {} }
            }
            div #field-map .map {}
            @if contents.sweep.is_some() {
                h3 { "Where pairs slip and open" }
                div.tools {
                    label.slider { "frequency " input #status-at type="range" min="0" value="0"; output #status-hz {} }
                }
                div #status-map .map {}
            }
            @if let Some(response) = &contents.summary.response {
                (contacts_at_peak(response))
            }
        }
    }
}

fn loops(contents: &Contents<'_>) -> Markup {
    if contents.sweep.is_none() || !contents.has_pairs() {
        return html! {};
    }
    html! {
        section #hysteresis {
            h2 { "Hysteresis loops at the peak" }
            p {
                "Friction force over displacement of the pairs that dissipate most, along the direction that each moves in most. "
                "A loop encloses the energy that friction takes in a period. "
                @if contents.flank_model().is_some() { "The letters stand on the first map of the flanks. " }
                "A loop is a sum of harmonics, so that its corners are round and may overshoot."
            }
            div #loops .loops {}
        }
    }
}

fn motion(contents: &Contents<'_>) -> Markup {
    if contents.model.is_none() {
        return html! {};
    }
    let moves = contents.motion.is_some();
    html! {
        section #motion {
            h2 { @if moves { "Motion at the peak" } @else { "Bodies" } }
            p.quiet { "Drag to turn, shift and drag to move, wheel or pinch to zoom, double-click to start anew." }
            div.scene {
                canvas #viewer tabindex="0" aria-label="The bodies in three dimensions" {}
                canvas #viewer-marks aria-hidden="true" {}
            }
            div.tools {
                @if moves {
                    button #play type="button" { "play" }
                    label.slider { "phase " input #phase-at type="range" min="0" max="359" value="0"; }
                    label.slider { "exaggerated " input #exaggeration type="range" min="0" max="100" value="50"; output #exaggeration-of {} }
                }
                label { "colour " select #viewer-field {} }
                @if contents.model.is_some_and(|model| model.bodies.len() > 1) {
                    label.slider { "pull apart " input #apart type="range" min="0" max="100" value=(PULLED); }
                }
                label { input #edges type="checkbox"; " mesh" }
                @if contents.model.is_some_and(|model| model.cyclic.is_some()) {
                    label { input #whole-disc type="checkbox"; " whole disc" }
                }
            }
            div #viewer-bar .bar-of-colours {}
        }
    }
}

fn static_state(contents: &Contents<'_>) -> Markup {
    let Some(state) = &contents.summary.static_state else {
        return html! {};
    };
    let force = |v: Option<f64>| text_or_dash(v, |v| quantity(v, "N", 4));
    let count = |c: &ContactSummary, of: fn(StaticCounts) -> usize| {
        text_or_dash(c.counts, |counts| of(counts).to_string())
    };
    html! {
        section #static {
            h2 { "Static state" }
            p { (static_words(state)) (path_words(contents.scene)) }
            (table(
                "numbers",
                &state.contacts,
                &[
                    ("contact", &|c| c.name.clone()),
                    ("pairs", &|c| c.pairs.to_string()),
                    ("stick", &|c| count(c, |c| c.stuck)),
                    ("slide", &|c| count(c, |c| c.slipping)),
                    ("open", &|c| count(c, |c| c.open)),
                    ("area", &|c| text_or_dash(c.area_m2, |a| format!("{} mm²", figure(1e6 * a, 4)))),
                    ("covered", &|c| covered(contents, &c.name)),
                    ("normal force", &|c| force(c.normal_force_n)),
                    ("friction force", &|c| force(c.friction_force_n)),
                    ("mean pressure", &|c| text_or_dash(c.mean_pressure_pa, |p| quantity(p, "Pa", 3))),
                ],
            ))
        }
    }
}

/// Shares of both flanks of a contact that lie opposite the other one.
fn covered(contents: &Contents<'_>, contact: &str) -> String {
    let matches = contents.summary.mesh.iter().flat_map(|mesh| &mesh.contacts);
    let matched = matches.into_iter().find(|found| found.name == contact);
    text_or_dash(matched, |matched| {
        matched.covered.map(|share| percent(share, 3)).join(", ")
    })
}

fn static_words(state: &StaticSummary) -> Markup {
    let Some(counts) = state.counts else {
        return html! { "It did not converge: " (state.outcome) "." };
    };
    let slip = state.largest_slip_m.map(|s| quantity(s, "m", 3));
    let pressure = state.largest_pressure_pa.map(|p| quantity(p, "Pa", 3));
    html! {
        "Under the steady load " (static_counts(counts)) "."
        @if let Some(slip) = slip { " The largest slip is " (slip) "." }
        @if let Some(pressure) = pressure { " The largest pressure is " (pressure) ", which depends on the mesh at the edges of a flank." }
        @if let Some(force) = state.retention_n {
            " Friction does not hold all bodies (a warning says which); what it does not hold was held with "
            (quantity(force, "N", 3)) "."
        }
    }
}

/// Sentences on the path by which the steady load came; nothing where it came straight.
fn path_words(scene: &Scene) -> String {
    let StaticSpec {
        load_steps, path, ..
    } = &scene.static_state;
    let Some((first, others)) = path.split_first() else {
        return String::new();
    };
    let mut way = point_words(scene, first);
    for point in others {
        way = format!("{way}, then {}", point_words(scene, point));
    }
    let steps = counted(*load_steps, "step", "steps");
    format!(
        " The load came by way of {way}, each leg in {steps}, and friction kept what that left in the \
         joints. The stiffness is that of the working speed all the way."
    )
}

/// Loads at a point of a path: `6000 rpm and 1.5 times the steady loads`.
fn point_words(scene: &Scene, point: &PathPoint) -> String {
    let times = |multiple: &f64| format!("{} times", figure(*multiple, 4));
    let loads = match &point.loads {
        LoadMultiples::All(multiple) => times(multiple),
        LoadMultiples::Each(multiples) => {
            let words: Vec<String> = multiples.iter().map(times).collect();
            format!("in their order {}", words.join(", "))
        }
    };
    let assembly = scene.assembly();
    let rotation = assembly.and_then(|assembly| assembly.rotation.as_ref());
    let speed = rotation.map(|rotation| match point.speed_rad_s {
        Some(speed_rad_s) => format!("{} rpm", figure(speed_rad_s * 30.0 / PI, 5)),
        None => format!("{} rpm", figure(rotation.speed_rpm(), 5)),
    });
    let loads = match assembly {
        Some(assembly) if assembly.loads.is_empty() => None,
        Some(_) => Some(format!("{loads} the steady loads")),
        None => Some(format!("{loads} the steady load")),
    };
    let parts: Vec<String> = speed.into_iter().chain(loads).collect();
    parts.join(" and ")
}

fn modes(contents: &Contents<'_>) -> Markup {
    if contents.modes.is_empty() {
        return html! {};
    }
    let kinds = [
        (
            ModeKind::Linear,
            "about the static state: closed pairs stick, open ones are free",
        ),
        (ModeKind::Stuck, "all pairs stuck"),
        (ModeKind::FlanksHeld, "each body by itself, its flanks held"),
        (
            ModeKind::FixedInterface,
            "kept in the reduction of a body by itself",
        ),
    ];
    html! {
        section #modes {
            h2 { "First frequencies" }
            div.wide { table.numbers.named {
                tr { th { "" } th { "body" } @for i in 1..=LISTED_MODES { th { (i) } } }
                @for (kind, words) in kinds {
                    @let bodies = bodies_of(contents, kind);
                    @for body in bodies {
                        @let rows = || contents.modes.iter().filter(|r| r.kind == kind && r.body.as_deref() == body);
                        tr {
                            td { (words) }
                            td { (body.unwrap_or(ASSEMBLY)) }
                            @for row in rows().take(LISTED_MODES) { td { (figure(row.frequency_hz, 6)) } }
                        }
                    }
                }
            } }
            p.quiet { "In hertz." }
        }
    }
}

fn bodies_of<'a>(contents: &'a Contents<'_>, kind: ModeKind) -> Vec<Option<&'a str>> {
    let of_kind = contents.modes.iter().filter(|row| row.kind == kind);
    let mut bodies: Vec<_> = of_kind.map(|row| row.body.as_deref()).collect();
    bodies.dedup();
    bodies
}

/// List of the tables, fields and pictures beside the page, except those of single frequencies and
/// files that do not outlive the run.
fn files(contents: &Contents<'_>) -> Markup {
    let is_left_out = |name: &str| {
        ["flank/", "peak/"].iter().any(|of| name.starts_with(of))
            || [JOURNAL, REPORT].contains(&name)
    };
    let files = contents.summary.files.iter();
    let names: Vec<&String> = files.filter(|name| !is_left_out(name)).collect();
    if names.is_empty() {
        return html! {};
    }
    html! {
        section #files {
            h2 { "Files" }
            p { "These stand beside this page in the folder of the run." }
            ul.files { @for name in names { li { a href=(name) { (name) } } } }
        }
    }
}

fn effort(contents: &Contents<'_>) -> Markup {
    let summary = contents.summary;
    html! {
        section #effort {
            h2 { "Times" }
            p {
                "The run took " (figure(summary.seconds, 3)) " s"
                @if let Some(seconds) = summary.processor_seconds { " (" (figure(seconds, 3)) " s of the processor)" }
                @if let Some(response) = &summary.response {
                    ", with " (response.newton_iterations) " Newton and " (response.krylov_iterations) " linear iterations"
                }
                "."
            }
            (table(
                "numbers",
                &summary.stages,
                &[
                    ("stage", &|stage| {
                        let from_cache = if stage.from_cache { " (from the cache)" } else { "" };
                        format!("{}{from_cache}", stage.name)
                    }),
                    ("s", &|stage| format!("{:.2}", stage.seconds)),
                    ("share", &|stage| percent((stage.seconds / summary.seconds).min(1.0), 2)),
                    ("memory, MiB", &|stage| {
                        text_or_dash(stage.peak_memory_mib, |memory| format!("{memory:.0}"))
                    }),
                    ("unknowns", &|stage| {
                        let unknowns = stage.unknowns.iter().map(usize::to_string);
                        unknowns.collect::<Vec<_>>().join(", ")
                    }),
                ],
            ))
        }
    }
}
