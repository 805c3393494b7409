//! Response in a report: the places of its charts, its peaks, and the harmonics at the peak.

use maud::{Markup, html};

use super::super::Contents;
use super::super::frame::table;
use crate::manifest::ResponseSummary;
use crate::words::{figure, percent, quantity, short, text_or_dash};
use dovetail_solver::description::EngineOrder;
use dovetail_solver::dlft::Orbit;
use dovetail_solver::results::quantities::phasors;
use dovetail_solver::stability::Kind;

pub(super) fn response(contents: &Contents<'_>) -> Markup {
    let Some(summary) = contents
        .summary
        .response
        .as_ref()
        .filter(|_| contents.sweep.is_some())
    else {
        return html! {};
    };
    html! {
        section #response {
            h2 { "Response" }
            p {
                "Amplitude is the largest departure from the mean in a period. The linear curve is without slip and separation. "
                "The others add up so many harmonics (multiples of the frequency of the excitation)"
                @if contents.has_pairs() { "; the band is the estimated error for those left out. " } @else { ". " }
                @if !summary.folds.is_empty() || summary.unstable_points > 0 {
                    "Where the curve is dashed, the motion is unstable: the structure leaves it. "
                }
                @if summary.traction_range.is_some() {
                    "The orange band is what the starting tractions were found to span. "
                }
                @if let Some(words) = run_up(summary) { (words) " " }
                "The legends read the values at the pointer, and else at the peak. "
                "Drag over a stretch to zoom, double-click to see all."
            }
            h3 {
                "Amplitude of "
                @match contents.observations {
                    [one] => (one.name),
                    several => select #observation aria-label="observed point" {
                        @for (i, one) in several.iter().enumerate() { option value=(i) { (one.name) } }
                    },
                }
                @if !contents.conditions.is_empty() { ", " (contents.conditions) }
            }
            div.tools {
                label { "scale " select #scale {
                    option value="friction" { "of the curves with friction" }
                    option value="all" { "of all curves" }
                    option value="logarithmic" { "logarithmic" }
                } }
                label { "lay a measured curve over (CSV: Hz, m) " input #measured type="file" accept=".csv,.txt"; }
            }
            div #amplitude .chart {}
            @if contents.has_pairs() {
                h3 { "What the pairs do" }
                div #counts .chart {}
                h3 { "Mean power that friction and damping take" }
                div #powers .chart {}
            }
            h3 { "Phase lag of the first harmonic behind the force" }
            div #phase .chart {}
            @if !summary.peaks.is_empty() { (peaks(summary)) }
            @if !summary.folds.is_empty() || !summary.bifurcations.is_empty() { (changes(summary)) }
            @if let Some(orbit) = contents.peak_orbit() { (harmonics(contents, orbit)) }
        }
    }
}

/// Table of the turning points of the curve and of its other changes of stability.
fn changes(summary: &ResponseSummary) -> Markup {
    let folds = summary.folds.iter().map(|fold| {
        let what = "turning point";
        (fold.row, fold.frequency_hz, fold.amplitude_m, what)
    });
    let others = summary.bifurcations.iter().map(|change| {
        let what = match change.kind {
            Kind::Real => "branch point",
            Kind::PeriodDoubling => "period doubling",
            Kind::NeimarkSacker => "Neimark-Sacker bifurcation",
        };
        (
            change.after_row,
            change.frequency_hz,
            change.amplitude_m,
            what,
        )
    });
    let mut rows: Vec<_> = folds.chain(others).collect();
    rows.sort_by_key(|row| row.0);
    html! {
        h3 { "Where the curve turns back or loses its stability" }
        (table(
            "numbers",
            rows,
            &[
                ("", &|row| row.3.to_owned()),
                ("at", &|row| quantity(row.1, "Hz", 6)),
                ("amplitude", &|row| text_or_dash(row.2, |a| quantity(a, "m", 4))),
            ],
        ))
    }
}

/// What a run-up is; `None` for other responses.
fn run_up(summary: &ResponseSummary) -> Option<String> {
    let EngineOrder(order) = summary.engine_order?;
    let [from, to] = summary.speed_rpm?.map(short);
    Some(format!(
        "It is a run-up along engine order {order} from {from} to {to} rpm: the excitation has {order} cycles per revolution, and \
         each speed has its own reduced model and static state. The linear curve is drawn through its values at these speeds."
    ))
}

fn peaks(summary: &ResponseSummary) -> Markup {
    let number = |v: Option<f64>| text_or_dash(v, |v| figure(v, 3));
    html! {
        h3 { "Peaks" }
        (table(
            "numbers",
            &summary.peaks,
            &[
                ("Hz", &|peak| figure(peak.frequency_hz, 6)),
                ("amplitude", &|peak| quantity(peak.amplitude_m, "m", 4)),
                ("loss factor", &|peak| number(peak.loss_factor)),
                ("Q", &|peak| number(peak.quality_factor)),
                ("equivalent damping ratio", &|peak| {
                    text_or_dash(peak.loss_factor, |loss| percent(0.5 * loss, 3))
                }),
            ],
        ))
    }
}

fn harmonics(contents: &Contents<'_>, orbit: &Orbit) -> Markup {
    let Some((one, observed)) = contents.observations.first().zip(orbit.observed.first()) else {
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
        h3 { "Harmonics of " (one.name) " at the peak" }
        p.quiet { "The bars are logarithmic: a sixth of the width is a factor of ten." }
        div.wide { table.bars {
            @for (i, phasor) in phasors.iter().enumerate() {
                tr {
                    td { (i + 1) }
                    td.bar { div style={ "width:" (format!("{:.1}", width(phasor.amplitude))) "%" } {} }
                    td { (quantity(phasor.amplitude, one.quantity.unit(), 3)) }
                    td { (figure(phasor.phase_rad.to_degrees(), 3)) "°" }
                }
            }
        } }
    }
}

/// Table of the states of the pairs of each contact in the period of the peak, if there are several
/// contacts.
pub(super) fn contacts_at_peak(response: &ResponseSummary) -> Markup {
    if response.first.peak_contacts.len() < 2 {
        return html! {};
    }
    html! {
        h3 { "Pairs of each contact at the peak" }
        (table(
            "numbers",
            &response.first.peak_contacts,
            &[
                ("contact", &|c| c.name.clone()),
                ("pairs", &|c| c.counts.pairs().to_string()),
                ("stick", &|c| c.counts.stuck.to_string()),
                ("slip", &|c| c.counts.slipping.to_string()),
                ("open at times", &|c| c.counts.opening.to_string()),
                ("close at times", &|c| c.counts.closing.to_string()),
                ("stay open", &|c| c.counts.open.to_string()),
            ],
        ))
    }
}
