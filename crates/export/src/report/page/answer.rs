//! Answer of a report: the peak, what friction does there, and whether to trust it.

use maud::{Markup, html};

use super::super::Contents;
use super::super::frame::{card, line};
use crate::manifest::{ResponseSummary, RunState};
use crate::warning::{LARGE_ERROR, Weight};
use crate::words::{
    bounded, cycle_counts, error_words, figure, percent, quantity, supported_digits,
};

/// Relative change of the peak above which the report points it out.
const CHANGED: f64 = 1e-3;
/// Error of the energy balance above which the report points it out.
const UNBALANCED: f64 = 1e-3;

/// Peak, effect of friction there, and whether to trust them.
pub(super) fn answer(contents: &Contents<'_>) -> Markup {
    let summary = contents.summary;
    let Some(response) = &summary.response else {
        return html! { section #answer { h2 { "Answer" } (without_response(contents)) } };
    };
    html! {
        section #answer {
            h2 { "Answer" }
            @if let (Some(amplitude_m), Some(frequency_hz)) = (response.peak_amplitude_m, response.peak_frequency_hz) {
                div.cards {
                    @let error = contents.at_peak().and_then(|orbit| orbit.amplitude_error(0));
                    @let digits = supported_digits(amplitude_m, error);
                    (card(
                        &format!("Peak of {}", response.observation.as_deref().unwrap_or("the motion")),
                        &quantity(amplitude_m, "m", digits),
                        &html! {
                            @if let Some(error) = error.filter(|_| contents.has_pairs()) {
                                (error_words(error)) "; "
                            }
                            "at "
                            @if let Some(speed_rpm) = response.peak_speed_rpm { (figure(speed_rpm, 5)) " rpm, " }
                            (figure(frequency_hz, 6)) " Hz"
                        },
                    ))
                    (against_linear(response, digits))
                    (over_tractions(response))
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

/// Range of the peak over starting tractions.
fn over_tractions(response: &ResponseSummary) -> Markup {
    let Some(range) = &response.traction_range else {
        return html! {};
    };
    let [least, most] = range.peak_amplitude_m.map(|a| quantity(a, "m", 4));
    let hz = range.peak_frequency_hz.map(|hz| figure(hz, 6));
    card(
        &format!("Over {} starting tractions", range.tractions),
        &format!("{least} to {most}"),
        &html! {
            "at " (hz[0]) " to " (hz[1]) " Hz"
            @if let Some(loss) = range.loss_factor {
                "; loss factor " (figure(loss[0], 3)) " to " (figure(loss[1], 3))
            }
            "; what was found, no bound"
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
                (line(rise <= CHANGED, &html! {
                    "Between the frequencies the peak may be "
                    @if rise < 1.0 {
                        "higher by " (bounded(rise.max(0.0), "an estimated")) "."
                    } @else {
                        "more than twice as high."
                    }
                }))
            }
            @for two in &response.second_motion {
                (line(false, &html! {
                    "From " (quantity(two.from_hz, "Hz", 5)) " to " (quantity(two.to_hz, "Hz", 5))
                    " there are several motions: at " (quantity(two.frequency_hz, "Hz", 5)) " one has "
                    (quantity(two.amplitude_m, "m", 4)) " and another " (quantity(two.other_amplitude_m, "m", 4)) "."
                }))
            }
            @match response.peak_estimated_error {
                Some(error) => (line(error <= LARGE_ERROR, &html! {
                    "The harmonics left out change the peak by " (bounded(error, "an estimated")) "."
                })),
                None if response.peak_amplitude_m.is_some() && contents.has_pairs() => {
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
                (line(error <= CHANGED, &html! {
                    "The modes left out change amplitudes of the linear curve by " (bounded(error, "an estimated")) "."
                }))
            }
            @let frequencies = contents.summary.truncation.iter().flat_map(|t| &t.frequencies);
            @if let Some(error) = frequencies.copied().reduce(f64::max) {
                (line(error <= CHANGED, &html! {
                    "The modes kept of the bodies (" code { "fixed_interface_modes" } ") raise the first stuck frequencies by up to "
                    (bounded(error, "an estimated")) "."
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
