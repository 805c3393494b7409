//! Text of a report, section by section.

use std::collections::BTreeMap;

use maud::{Markup, html};

use super::data::Data;
use super::frame::{self, Frame, card, frame, line, warnings};
use super::{Contents, REPORT};
use crate::export::csv::ASSEMBLY;
use crate::export::journal::JOURNAL;
use crate::export::manifest::{ResponseSummary, RunState, StaticSummary};
use crate::warning::Weight;
use crate::words::{
    bounded, counted, cycle_counts, error_words, figure, percent, quantity, static_counts,
    supported_digits,
};
use dovetail_mesh::ElementType;
use dovetail_solver::description::Subject;
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::model::{
    Assembly, BaseMotion, BodySpec, ContactLaw, ContactSpec, ExcitationKind, ExcitationSpec,
    FieldSource, LoadKind, LoadSpec, Model, Prestress, SpringSpec,
};
use dovetail_solver::reduction::LISTED_MODES;
use dovetail_solver::reduction::damping::DampingSpec;
use dovetail_solver::results::modes::ModeKind;

const SCRIPTS: [&str; 4] = [
    include_str!("viewer.js"),
    include_str!("curves.js"),
    include_str!("flanks.js"),
    include_str!("report.js"),
];
/// Initial distance by which bodies are pulled apart to show the flanks, percent of their size.
const PULLED: usize = 25;
/// Estimated error above which the report points it out.
const DOUBTFUL: f64 = 0.02;
/// Error of the energy balance above which the report points it out.
const UNBALANCED: f64 = 1e-3;

/// The whole page.
pub(super) fn page(contents: &Contents<'_>, data: &Data) -> Markup {
    let summary = contents.summary;
    frame(&Frame {
        title: &summary.scene.name,
        subtitle: html! {
            "dovetail " (summary.version)
            @if let Some(commit) = &summary.commit { " (" (commit) ")" }
            ", scene " code { (summary.scene.file) }
            @if !summary.begun.is_empty() { ", " time { (minute(&summary.begun)) } }
        },
        links: &links(contents),
        main: html! {
            (answer(contents))
            (warnings(summary.warnings.iter().map(|warning| warning.text.as_str())))
            (response(contents))
            (flanks(contents))
            (loops(contents))
            (motion(contents))
            (static_state(contents))
            (computed(contents))
            (modes(contents))
            (effort(contents))
            (files(contents))
        },
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

fn links(contents: &Contents<'_>) -> Vec<(&'static str, &'static str)> {
    let all = [
        ("answer", "Answer", true),
        ("response", "Response", contents.sweep.is_some()),
        ("flanks", "Flanks", has_flanks(contents)),
        (
            "hysteresis",
            "Loops",
            contents.sweep.is_some() && !contents.pairs.rows.is_empty(),
        ),
        ("motion", "Motion", contents.model.is_some()),
        (
            "static",
            "Static state",
            contents.summary.static_state.is_some(),
        ),
        ("computed", "What was computed", true),
        ("modes", "Frequencies", !contents.modes.is_empty()),
        ("effort", "Times", true),
        ("files", "Files", !contents.summary.files.is_empty()),
    ];
    let shown = all.into_iter().filter(|(_, _, shown)| *shown);
    shown.map(|(id, title, _)| (id, title)).collect()
}

fn has_flanks(contents: &Contents<'_>) -> bool {
    contents.model.is_some_and(|model| !model.pairs.is_empty())
}

/// Peak, effect of friction there, and whether to trust them.
fn answer(contents: &Contents<'_>) -> Markup {
    let summary = contents.summary;
    let Some(response) = &summary.response else {
        return html! { section #answer { h2 { "Answer" } (without_response(contents)) } };
    };
    html! {
        section #answer {
            h2 { "Answer" }
            @if let (Some(amplitude_m), Some(frequency_hz)) = (response.peak_amplitude_m, response.peak_frequency_hz) {
                div.cards {
                    @let error = peak_error(contents);
                    @let digits = supported_digits(amplitude_m, error);
                    (card(
                        &format!("Peak of {}", response.observation.as_deref().unwrap_or("the motion")),
                        &quantity(amplitude_m, "m", digits),
                        &html! {
                            @if let Some(error) = error.filter(|_| !contents.pairs.rows.is_empty()) {
                                (error_words(error)) "; "
                            }
                            "at " (figure(frequency_hz, 6)) " Hz"
                        },
                    ))
                    (against_linear(response, digits))
                    (losses(response))
                    (at_a_pair(response))
                    (joint(response, contents.pairs.rows.len()))
                }
            } @else {
                p { "No frequency converged, so that there is no peak." }
            }
            h3 { "Can this be trusted?" }
            (trust(contents, response))
        }
    }
}

/// Estimated relative error of the amplitude at the peak.
fn peak_error(contents: &Contents<'_>) -> Option<f64> {
    contents.sweep.as_ref()?.at_peak()?.amplitude_error(0)
}

fn without_response(contents: &Contents<'_>) -> Markup {
    html! {
        @match (contents.summary.state, &contents.summary.why) {
            (RunState::Failed, Some(why)) => p.warning { "The run failed: " (why) },
            _ => p { "The static state alone was computed; see below." },
        }
    }
}

/// Comparison of the peak with the linear peak. `digits` is the number of digits of the peak.
fn against_linear(response: &ResponseSummary, digits: usize) -> Markup {
    let Some(linear_m) = response.linear_peak_amplitude_m else {
        return html! {};
    };
    let at = response.linear_peak_frequency_hz.unwrap_or(f64::NAN);
    let ratio = response
        .peak_ratio
        .map(|ratio| figure(ratio, digits.min(3)));
    card(
        "Without slip and separation",
        &quantity(linear_m, "m", 4),
        &html! {
            "at " (figure(at, 6)) " Hz"
            @if let Some(ratio) = ratio { "; the peak is " (ratio) " of this" }
        },
    )
}

fn losses(response: &ResponseSummary) -> Markup {
    let Some(friction_w) = response.peak_friction_power_w else {
        return html! {};
    };
    let damping_w = response.peak_damping_power_w.unwrap_or(f64::NAN);
    let at_peak = response
        .peaks
        .iter()
        .find(|p| Some(p.row) == response.peak_row);
    let quality = at_peak.and_then(|p| Some((p.loss_factor?, p.quality_factor?)));
    let friction = if friction_w > 0.0 {
        quantity(friction_w, "W", 3)
    } else {
        "none".to_owned()
    };
    card(
        "Friction dissipates at the peak",
        &friction,
        &html! {
            "damping " (quantity(damping_w, "W", 3))
            @if let Some((loss, quality)) = quality {
                "; loss factor " (figure(loss, 3)) ", Q = " (figure(quality, 3))
            }
        },
    )
}

/// Card with the load of the most worn pairs: energy dissipated by friction and slid distance.
fn at_a_pair(response: &ResponseSummary) -> Markup {
    let Some(slid_m) = response.peak_largest_slid_m else {
        return html! {};
    };
    let slid = quantity(slid_m, "m", 3);
    match response.peak_largest_friction_energy_j_m2 {
        Some(energy_j_m2) if energy_j_m2 > 0.0 => card(
            "Friction takes in a period",
            &quantity(energy_j_m2, "J/m²", 3),
            &html! { "where it takes most; pairs slide up to " (slid) },
        ),
        _ => card(
            "Pairs slide in a period",
            &slid,
            &html! { "where they slide farthest" },
        ),
    }
}

fn joint(response: &ResponseSummary, pairs: usize) -> Markup {
    let Some(counts) = response.peak_counts().filter(|_| pairs > 0) else {
        return html! {};
    };
    let share = response.area_share_that_opens.filter(|share| *share > 0.0);
    card(
        "The joint at the peak",
        &format!(
            "{} of {pairs} pairs slip or open",
            counts.slipping + counts.opening + counts.closing
        ),
        &html! {
            (cycle_counts(counts))
            @if let Some(share) = share {
                "; over the range " (percent(share, 2)) " of the area opens"
            }
        },
    )
}

fn trust(contents: &Contents<'_>, response: &ResponseSummary) -> Markup {
    let converged = response.converged_points == response.points;
    let rise = response.peak_rise;
    html! {
        ul.trust {
            (line(converged, &html! {
                (response.converged_points) " of " (response.points) " frequencies converged."
            }))
            @if response.peak_at_end_of_range {
                (line(false, &html! {
                    "The largest amplitude is at an end of the range: the curve may go on rising outside."
                }))
            } @else if let Some(rise) = rise {
                (line(rise <= 1e-3, &html! {
                    "Between the frequencies the peak may be higher by " (bounded(rise.max(0.0), "an estimated")) "."
                }))
            }
            @for two in &response.second_motion {
                (line(false, &html! {
                    "From " (quantity(two.from_hz, "Hz", 5)) " to " (quantity(two.to_hz, "Hz", 5))
                    " there are two motions: the curve has " (quantity(two.amplitude_m, "m", 4)) " at "
                    (quantity(two.frequency_hz, "Hz", 5)) ", the other one "
                    (quantity(two.other_amplitude_m, "m", 4)) "."
                }))
            }
            @match response.peak_estimated_error {
                Some(error) => (line(error <= DOUBTFUL, &html! {
                    "The harmonics left out change the peak by " (bounded(error, "an estimated")) "."
                })),
                None if response.peak_amplitude_m.is_some() && !contents.pairs.rows.is_empty() => {
                    (line(false, &html! { "The error of the harmonics left out is not known." }))
                }
                None => {}
            }
            @if let Some(error) = response.worst_energy_balance_error {
                (line(error <= UNBALANCED, &html! {
                    "Power put in and power spent differ by " (bounded(error, "at most")) "."
                }))
            }
            @if let Some(error) = contents.summary.truncation.as_ref().and_then(|t| t.amplitude) {
                (line(error <= 1e-3, &html! {
                    "The modes left out change amplitudes of the linear curve by " (bounded(error, "an estimated")) "."
                }))
            }
            @match doubtful(contents) {
                0 => {},
                1 => (line(false, &html! { "A " a href="#warnings" { "warning" } " of the run says what else may be off." })),
                many => (line(false, &html! { (many) " " a href="#warnings" { "warnings" } " of the run say what else may be off." })),
            }
            li.quiet {
                "The mesh is not judged here: a study over its sizes does that. Pressures at the edges of flanks grow with refinement."
            }
        }
    }
}

/// Number of warnings of more weight than a remark.
fn doubtful(contents: &Contents<'_>) -> usize {
    let warnings = contents.summary.warnings.iter();
    warnings
        .filter(|warning| warning.weight != Weight::Remark)
        .count()
}

fn response(contents: &Contents<'_>) -> Markup {
    let (Some(sweep), Some(summary)) = (&contents.sweep, &contents.summary.response) else {
        return html! {};
    };
    html! {
        section #response {
            h2 { "Response" }
            p {
                "Amplitude is the largest departure from the mean in a period. The linear curve is without slip and separation. "
                "The others add up so many harmonics (multiples of the frequency of the excitation)"
                @if contents.pairs.rows.is_empty() { ". " } @else { "; the band is the estimated error for those left out. " }
                "The legends read the values at the pointer, and else at the peak. "
                "Drag over a stretch to zoom, double-click to see all."
            }
            h3 {
                "Amplitude of "
                @match contents.observations {
                    [name] => (name),
                    names => select #observation aria-label="observed displacement" {
                        @for (i, name) in names.iter().enumerate() { option value=(i) { (name) } }
                    },
                }
                @if !contents.conditions.is_empty() { ", " (contents.conditions) }
            }
            div.tools {
                label { "scale " select #scale {
                    option value="friction" { "of the curve with friction" }
                    option value="all" { "of all curves" }
                    option value="logarithmic" { "logarithmic" }
                } }
                label { "lay a measured curve over (CSV: Hz, m) " input #measured type="file" accept=".csv,.txt"; }
            }
            div #amplitude .chart {}
            @if !contents.pairs.rows.is_empty() {
                h3 { "What the pairs do" }
                div #counts .chart {}
                h3 { "Mean power that friction and damping take" }
                div #powers .chart {}
            }
            h3 { "Phase of the first harmonic" }
            div #phase .chart {}
            @if !summary.peaks.is_empty() { (peaks(contents)) }
            @if let Some(orbit) = sweep.at_peak() { (harmonics(contents, orbit)) }
        }
    }
}

fn peaks(contents: &Contents<'_>) -> Markup {
    let peaks = contents.summary.response.iter().flat_map(|r| &r.peaks);
    let number = |v: Option<f64>| v.map_or_else(|| "–".to_owned(), |v| figure(v, 3));
    html! {
        h3 { "Peaks" }
        div.wide { table.numbers {
            tr { th { "Hz" } th { "amplitude" } th { "loss factor" } th { "Q" } th { "equivalent damping ratio" } }
            @for peak in peaks {
                tr {
                    td { (figure(peak.frequency_hz, 6)) }
                    td { (quantity(peak.amplitude_m, "m", 4)) }
                    td { (number(peak.loss_factor)) }
                    td { (number(peak.quality_factor)) }
                    td { (peak.loss_factor.map_or_else(|| "–".to_owned(), |l| percent(0.5 * l, 3))) }
                }
            }
        } }
    }
}

fn harmonics(contents: &Contents<'_>, orbit: &dovetail_solver::dlft::Orbit) -> Markup {
    use dovetail_solver::results::quantities::phasors;
    let Some((name, observed)) = contents.observations.first().zip(orbit.observed.first()) else {
        return html! {};
    };
    let phasors = phasors(observed);
    let largest = phasors.iter().fold(0.0_f64, |m, p| m.max(p.amplitude));
    if largest <= 0.0 {
        return html! {};
    }
    // From 1e-6 of the largest, a decade alike.
    let width =
        |amplitude: f64| 100.0 * ((amplitude / largest).log10() / 6.0 + 1.0).clamp(0.0, 1.0);
    html! {
        h3 { "Harmonics of " (name) " at the peak" }
        p.quiet { "The bars are logarithmic: a sixth of the width is a factor of ten." }
        div.wide { table.bars {
            @for (i, phasor) in phasors.iter().enumerate() {
                tr {
                    td { (i + 1) }
                    td.bar { div style={ "width:" (format!("{:.1}", width(phasor.amplitude))) "%" } {} }
                    td { (quantity(phasor.amplitude, "m", 3)) }
                    td { (figure(phasor.phase_rad.to_degrees(), 3)) "°" }
                }
            }
        } }
    }
}

fn flanks(contents: &Contents<'_>) -> Markup {
    if !has_flanks(contents) {
        return html! {};
    }
    html! {
        section #flanks {
            h2 { "Flanks" }
            p {
                "Each flank is unrolled: its length runs to the right, outwards is up. "
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
    if contents.sweep.is_none() || contents.pairs.rows.is_empty() {
        return html! {};
    }
    html! {
        section #hysteresis {
            h2 { "Hysteresis loops at the peak" }
            p {
                "Friction force over displacement of the pairs that dissipate most, along the direction that each moves in most. "
                "A loop encloses the energy that friction takes in a period. "
                @if has_flanks(contents) { "The letters stand on the first map of the flanks. " }
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
            }
            div #viewer-bar .bar-of-colours {}
        }
    }
}

fn static_state(contents: &Contents<'_>) -> Markup {
    let Some(state) = &contents.summary.static_state else {
        return html! {};
    };
    let force = |v: Option<f64>| v.map_or_else(|| "–".to_owned(), |v| quantity(v, "N", 4));
    html! {
        section #static {
            h2 { "Static state" }
            p { (static_words(state)) }
            div.wide { table.numbers {
                tr { th { "contact" } th { "pairs" } th { "stick" } th { "slide" } th { "open" } th { "area" } th { "covered" } th { "normal force" } th { "friction force" } th { "mean pressure" } }
                @for contact in &state.contacts {
                    tr {
                        td { (contact.name) }
                        td { (contact.pairs) }
                        (counts_cells(contact.counts.map(|c| [c.stuck, c.slipping, c.open])))
                        td { (contact.area_m2.map_or_else(|| "–".to_owned(), |a| format!("{} mm²", figure(1e6 * a, 4)))) }
                        td { (covered(contents, &contact.name)) }
                        td { (force(contact.normal_force_n)) }
                        td { (force(contact.friction_force_n)) }
                        td { (contact.mean_pressure_pa.map_or_else(|| "–".to_owned(), |p| quantity(p, "Pa", 3))) }
                    }
                }
            } }
        }
    }
}

/// Shares of both flanks of a contact that lie opposite the other one.
fn covered(contents: &Contents<'_>, contact: &str) -> String {
    let matches = contents.summary.mesh.iter().flat_map(|mesh| &mesh.contacts);
    let found = matches.into_iter().find(|found| found.name == contact);
    found.map_or_else(
        || "–".to_owned(),
        |found| found.covered.map(|share| percent(share, 3)).join(", "),
    )
}

/// Table cell for each count.
fn counts_cells<const N: usize>(counts: Option<[usize; N]>) -> Markup {
    html! {
        @for i in 0..N {
            td { (counts.map_or_else(|| "–".to_owned(), |counts| counts[i].to_string())) }
        }
    }
}

/// Table of the states of the pairs of each contact in the period of the peak, if there are several
/// contacts.
fn contacts_at_peak(response: &ResponseSummary) -> Markup {
    if response.peak_contacts.len() < 2 {
        return html! {};
    }
    html! {
        h3 { "Pairs of each contact at the peak" }
        div.wide { table.numbers {
            tr {
                th { "contact" } th { "pairs" } th { "stick" } th { "slip" } th { "open at times" } th { "close at times" } th { "stay open" }
            }
            @for contact in &response.peak_contacts {
                @let c = contact.counts;
                tr {
                    td { (contact.name) }
                    td { (c.pairs()) }
                    (counts_cells(Some([c.stuck, c.slipping, c.opening, c.closing, c.open])))
                }
            }
        } }
    }
}

fn static_words(state: &StaticSummary) -> Markup {
    let Some(counts) = state.counts else {
        return html! { "It did not converge: " (state.outcome.word()) "." };
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

fn computed(contents: &Contents<'_>) -> Markup {
    html! {
        section #computed {
            h2 { "What was computed" }
            @match &contents.scene.subject {
                Subject::Assembly(assembly) => (assembly_words(contents, assembly)),
                Subject::ReducedModel(spec) => {
                    p {
                        "A reduced model was read from " code { (spec.folder.display()) } ": "
                        (contents.pairs.rows.len()) " pairs, friction " (figure(spec.law.friction, 3)) ", clearance "
                        (quantity(spec.law.gap_m, "m", 3))
                        @if let Some(stiffness) = spec.law.stiffness {
                            ", on springs of " (figure(stiffness.normal_n_m, 3)) " N/m against penetration and "
                            (figure(stiffness.tangential_n_m, 3)) " N/m against shear"
                        }
                        ", excitation " (quantity(spec.force_n, "N", 3)) "."
                    }
                }
            }
            (solution_words(contents))
            (origin(contents))
        }
    }
}

/// Hash of the inputs, by which the figures can be told from those of another scene.
fn origin(contents: &Contents<'_>) -> Markup {
    let Some(hash) = contents.summary.scene.blake3.as_deref() else {
        return html! {};
    };
    html! {
        p.quiet {
            "The scene as it was read and the files that it names have the hash " code { (short_hash(hash)) }
            ". summary.json has the hashes whole."
        }
    }
}

/// First digits of a hash, which suffice to distinguish two files.
fn short_hash(hash: &str) -> &str {
    hash.get(..12).unwrap_or(hash)
}

fn assembly_words(contents: &Contents<'_>, assembly: &Assembly) -> Markup {
    let mesh = contents.summary.mesh.as_ref();
    html! {
        div.wide { table {
            tr { th { "body" } th { "Young's modulus" } th { "Poisson's ratio" } th { "density" } th { "mass" } th { "nodes" } th { "elements" } th { "held by" } }
            @for body in &assembly.bodies {
                @let sizes = mesh.and_then(|mesh| mesh.bodies.iter().find(|b| b.name == body.name));
                tr {
                    td { (body.name) }
                    td { (sizes.map_or_else(|| "–".to_owned(), |b| quantity(b.young_pa, "Pa", 4))) }
                    td { (sizes.map_or_else(|| "–".to_owned(), |b| figure(b.poisson, 3))) }
                    td { (sizes.map_or_else(|| "–".to_owned(), |b| format!("{} kg/m³", figure(b.density_kg_m3, 4)))) }
                    td { (sizes.map_or_else(|| "–".to_owned(), |b| format!("{} kg", figure(b.mass_kg, 4)))) }
                    td { (sizes.map_or_else(|| "–".to_owned(), |b| b.nodes.to_string())) }
                    td { (sizes.map_or_else(|| "–".to_owned(), |b| b.elements.to_string())) }
                    td { (held(body, contents.model)) }
                }
            }
        } }
        @if let Some(mesh) = mesh {
            p {
                "The mesh is " code { (std::path::Path::new(&mesh.source).file_name().map_or_else(|| mesh.source.clone(), |name| name.to_string_lossy().into_owned())) }
                @if let Some(hash) = mesh.blake3.as_deref() { " (hash " code { (short_hash(hash)) } ")" }
                ": " (elements(&mesh.element_types)) ", "
                (mesh.free_dofs) " free degrees of freedom."
            }
        }
        @if let Some(rotation) = &assembly.rotation {
            p {
                "Rotor speed " (figure(rotation.speed_rpm(), 5)) " rpm about the axis ("
                (rotation.axis.map(|v| figure(v, 3)).join(", ")) "). "
                @if rotation.bodies.len() < assembly.bodies.len() {
                    "Only " (rotation.bodies.join(", ")) " of the bodies rotate. "
                }
                @match rotation.prestress {
                    Prestress::HeldFlanks => "The stiffness includes stress stiffening, computed with the contact nodes of each body held, and spin softening.",
                    Prestress::Contact => "The stiffness includes stress stiffening, computed from the static state with contact and friction, and spin softening.",
                    Prestress::None => "The stiffness includes neither stress stiffening nor spin softening.",
                }
            }
        }
        ul {
            @for contact in &assembly.contacts { li { (contact_words(contact)) } }
            @for spring in &assembly.springs { li { (spring_words(spring)) } }
            @for load in &assembly.loads {
                li {
                    "A steady load on " code { (load.on) } ": "
                    @match load.load {
                        LoadKind::Force { vector_n } => { "a force of (" (vector_n.map(|v| figure(v, 4)).join(", ")) ") N." },
                        LoadKind::Traction { vector_pa } => { "a traction of (" (vector_pa.map(|v| figure(v, 4)).join(", ")) ") Pa." },
                        LoadKind::Pressure { pressure_pa } => { "a pressure of " (quantity(pressure_pa, "Pa", 4)) "." },
                    }
                }
            }
            @for cause in &assembly.excitations {
                li {
                    "Excitation: " (excitation_words(cause))
                    @if cause.harmonic > 1 { " with " (cause.harmonic) " times the frequency" }
                    @if cause.phase_rad != 0.0 { ", " (figure(cause.phase_rad.to_degrees(), 3)) "° behind" }
                    "."
                }
            }
            @for probe in &assembly.observations {
                li {
                    (probe.name) " is the displacement of " code { (probe.points) } " along ("
                    (probe.direction.map(|v| figure(v, 3)).join(", ")) ")."
                }
            }
        }
    }
}

/// Number of elements of each type: `6739 tetrahedra of 10 nodes`.
fn elements(types: &BTreeMap<String, usize>) -> String {
    let all = ElementType::ALL.iter();
    let named = all.filter_map(|element| Some((types.get(&element.name())?, element)));
    let words = named.map(|(n, e)| format!("{n} {} of {} nodes", e.shape.plural(), e.nodes()));
    words.collect::<Vec<_>>().join(", ")
}

/// Supports and springs of a body or, if it has none, `contacts`.
fn held(body: &BodySpec, model: Option<&Model>) -> String {
    let along = body.fixed_along.iter().zip(["x", "y", "z"]);
    let along =
        along.flat_map(|(groups, axis)| groups.iter().map(move |g| format!("{g} along {axis}")));
    let bodies = model.iter().flat_map(|model| &model.bodies);
    let own = bodies.filter(|b| b.name == body.name && !b.springs.is_empty());
    let springs = own.map(|_| "springs".to_owned());
    let all: Vec<String> = body
        .fixed
        .iter()
        .cloned()
        .chain(along)
        .chain(springs)
        .collect();
    if all.is_empty() {
        "contacts".to_owned()
    } else {
        all.join(", ")
    }
}

/// Kind, amplitude and place of an excitation.
fn excitation_words(cause: &ExcitationSpec) -> Markup {
    let along = |vector: &[f64; 3]| format!("({})", vector.map(|v| figure(v, 3)).join(", "));
    let amplitude = quantity(cause.amplitude, cause.kind.unit(), 3);
    html! {
        @match &cause.kind {
            ExcitationKind::Load(LoadSpec { on, load }) => {
                @match load {
                    LoadKind::Force { vector_n } => {
                        "A force of " (amplitude) " on " code { (on) } " along " (along(vector_n))
                    },
                    LoadKind::Traction { vector_pa } => {
                        "A traction of " (amplitude) " on " code { (on) } " along " (along(vector_pa))
                    },
                    LoadKind::Pressure { .. } => { "A pressure of " (amplitude) " on " code { (on) } },
                }
            },
            ExcitationKind::Field { on, field } => {
                @match field {
                    FieldSource::File(path) => { "The field of " code { (path.display()) } },
                    FieldSource::Points(_) => { "A field" },
                }
                " on " code { (on) }
                @if cause.amplitude != 1.0 { ", times " (figure(cause.amplitude, 3)) "," }
            },
            ExcitationKind::Base { direction, motion } => {
                @match motion {
                    BaseMotion::Acceleration => { "An acceleration" },
                    BaseMotion::Displacement => { "A displacement" },
                }
                " of the base of " (amplitude) " along " (along(direction))
            },
        }
    }
}

fn spring_words(spring: &SpringSpec) -> Markup {
    html! {
        "The spring " code { (spring.name) } " of " (quantity(spring.stiffness_n_m, "N/m", 4)) " joins "
        code { (spring.first) } " to "
        @match &spring.second {
            Some(second) => { code { (second) } },
            None => { "ground" },
        }
        @if let Some(d) = spring.direction {
            ", along (" (d.map(|v| figure(v, 3)).join(", ")) ")"
        }
        "."
    }
}

fn contact_words(contact: &ContactSpec) -> Markup {
    let second = contact.second.as_deref().unwrap_or("rigid ground");
    html! {
        "Contact " b { (contact.name) } " between " code { (contact.first) } " and " code { (second) } ": "
        @match contact.law {
            ContactLaw::Bonded => "bonded.",
            ContactLaw::UnilateralCoulomb => {
                "it opens, and slides with dry friction of " (figure(contact.friction, 3))
                @if let Some(stiffness) = contact.stiffness {
                    ", on springs of " (figure(stiffness.normal_n_m3, 3)) " N/m3 against penetration and "
                    (figure(stiffness.tangential_n_m3, 3)) " N/m3 against shear"
                }
                @if contact.gap_m > 0.0 { ", clearance " (quantity(contact.gap_m, "m", 3)) }
                @if contact.gap_m < 0.0 { ", interference " (quantity(-contact.gap_m, "m", 3)) }
                @if contact.gap_from_mesh { ", the distance in the mesh being clearance too" }
                @if let Some(crown) = &contact.crown { ", crowned with a radius of " (quantity(crown.radius_m, "m", 3)) }
                "."
            },
        }
    }
}

fn solution_words(contents: &Contents<'_>) -> Markup {
    let (scene, summary) = (contents.scene, contents.summary);
    let spec = &scene.response;
    html! {
        p {
            @match scene.damping {
                DampingSpec::Ratio { ratio, linear_mode } => {
                    "Damping is " (percent(ratio, 3)) " of critical on linear mode " (linear_mode) "."
                }
                DampingSpec::Rayleigh { stiffness_s, mass_per_s } => {
                    "Damping is " (figure(stiffness_s, 3)) " s times the stiffness and " (figure(mass_per_s, 3)) "/s times the mass."
                }
            }
            @if contents.sweep.is_some() {
                " The periodic motion was sought at " (spec.points) " frequencies by harmonic balance with "
                @match spec.resolution {
                    Resolution::Fixed { harmonics, samples } => {
                        (counted(harmonics, "harmonic", "harmonics")) " and " (samples) " samples of a period."
                    }
                    Resolution::Accuracy(accuracy) => {
                        "as many harmonics as an accuracy of " (percent(accuracy, 2)) " asks for."
                    }
                }
                @if let Some(added) = summary.response.as_ref().map(|r| r.added_points).filter(|n| *n > 0) {
                    " " (counted(added, "frequency was", "frequencies were")) " added at peaks."
                }
            }
        }
        p.quiet {
            "Assumptions: small displacements, linear elasticity, no other bodies than those of the table, pairs that stay "
            "opposite each other, the same coefficient of friction at rest and in motion, no wear, no Coriolis force, and motion "
            "with the period of the excitation."
        }
    }
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
            div.wide { table.numbers {
                tr { th { "stage" } th { "s" } th { "share" } th { "memory, MiB" } th { "unknowns" } }
                @for stage in &summary.stages {
                    tr {
                        td { (stage.name) @if stage.from_cache { " (from the cache)" } }
                        td { (format!("{:.2}", stage.seconds)) }
                        td { (percent((stage.seconds / summary.seconds).min(1.0), 2)) }
                        td { (stage.peak_memory_mib.map_or_else(|| "–".to_owned(), |m| format!("{m:.0}"))) }
                        td { (stage.unknowns.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")) }
                    }
                }
            } }
        }
    }
}
