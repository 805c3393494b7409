//! Answer of a report: the peak, what friction does there, and whether to trust it.

use maud::{Markup, html};

use super::super::Contents;
use super::super::frame::{card, line, table, unchecked};
use crate::manifest::{
    FlankMeshCheck, ObservedPeak, PeakStability, PlaceSummary, RankedBy, ResponseSummary, RunState,
    StressSummary, TractionCheck, Verdict,
};
use crate::warning::{LARGE_ERROR, LARGE_STRESS_ERROR, Weight};
use crate::words::{bounded, capital, cycle_counts, figure, percent, quantity, supported_digits};
use dovetail_solver::run::Observed;

/// Relative change of the peak above which the report points it out.
const CHANGED: f64 = 1e-3;
/// Error of the energy balance above which the report points it out.
const UNBALANCED: f64 = 1e-3;

/// Peak, effect of friction there, and whether to trust them.
pub(super) fn answer(contents: &Contents<'_>) -> Markup {
    let summary = contents.summary;
    let Some(response) = &summary.response else {
        return html! { section #answer { h2 { "Answer" } (missing_response(contents)) } };
    };
    html! {
        section #answer {
            h2 { "Answer" }
            @if let Some(amplitude) = response.first.amplitude_words("m") {
                div.cards {
                    (card(
                        &format!("Peak of {}", response.observation.as_deref().unwrap_or("the motion")),
                        &amplitude,
                        &html! {
                            @if let Some(error) = response.first.error_words() { (error) "; " }
                            "at " (place(response, response.first.peak_frequency_hz))
                        },
                    ))
                    (linear_comparison(response))
                    (traction_range(response))
                    (losses(&response.first))
                    (pair_card(&response.first))
                    (joint(response))
                }
            } @else if let Some(words) = response.first.not_computed_words() {
                p.warning { (capital(&words)) "." (largest_found(response)) }
                div.cards { (linear_comparison(response)) }
            } @else {
                p { "No frequency converged, so there is no peak." }
            }
            (observed_peaks(contents, response))
            h3 { "Can this be trusted?" }
            (trust(contents, response))
        }
    }
}

fn missing_response(contents: &Contents<'_>) -> Markup {
    html! {
        @match (contents.summary.state, &contents.summary.why) {
            (RunState::Failed, Some(why)) => p.warning { "The run failed: " (why) },
            _ => p { "The static state alone was computed; see below." },
        }
    }
}

/// Frequency in words, with its speed before it in a run-up.
fn place(response: &ResponseSummary, frequency_hz: Option<f64>) -> String {
    frequency_hz.map_or(String::new(), |hz| {
        let rpm = response.engine_order.map(|order| order.speed_rpm(hz));
        let rpm = rpm.map_or(String::new(), |rpm| format!("{} rpm, ", figure(rpm, 5)));
        format!("{rpm}{} Hz", figure(hz, 6))
    })
}

/// Comparison of the peak with the linear peak.
fn linear_comparison(response: &ResponseSummary) -> Markup {
    let peak = &response.first;
    let Some((linear, [_, at_hz])) = peak.linear_words("m").zip(peak.linear()) else {
        return html! {};
    };
    card(
        "Without slip and separation",
        &linear,
        &html! {
            "at " (place(response, Some(at_hz)))
            @if let Some(ratio) = peak.ratio_words() { "; the peak is " (ratio) " of this" }
        },
    )
}

/// Sentence on the largest amplitude that was found where the resonance was not computed.
fn largest_found(response: &ResponseSummary) -> Markup {
    let Some(amplitude) = response.first.largest_amplitude_m else {
        return html! {};
    };
    let at_hz = response.first.largest_amplitude_frequency_hz;
    html! {
        " The largest amplitude that was found, " (quantity(amplitude, "m", 3)) " at " (place(response, at_hz))
        ", need not be the peak."
    }
}

/// Table of the peaks of all observations, if there are several.
fn observed_peaks(contents: &Contents<'_>, response: &ResponseSummary) -> Markup {
    if contents.observations.len() < 2 {
        return html! {};
    }
    let linear = |(one, peak): &(&Observed, &ObservedPeak)| {
        let amplitude = peak.linear_words(one.quantity.unit())?;
        Some(format!(
            "{amplitude} at {}",
            place(response, peak.linear_peak_frequency_hz)
        ))
    };
    html! {
        h3 { "Peak of each observed point" }
        (table(
            "numbers",
            response.peaks_of(contents.observations),
            &[
                ("", &|(one, _)| one.name.clone()),
                ("peak", &|(one, peak)| {
                    let words = peak.amplitude_words(one.quantity.unit());
                    words.unwrap_or_else(|| "not computed".to_owned())
                }),
                ("error", &|(_, peak)| peak.error_words().unwrap_or_default()),
                ("at", &|(_, peak)| place(response, peak.peak_frequency_hz)),
                ("linear", &|row| linear(row).unwrap_or_default()),
                ("ratio", &|(_, peak)| peak.ratio_words().unwrap_or_default()),
                ("losses", &|(_, peak)| peak.loss_words().unwrap_or_default()),
            ],
        ))
    }
}

/// Range of the peak over starting tractions.
fn traction_range(response: &ResponseSummary) -> Markup {
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

fn losses(peak: &ObservedPeak) -> Markup {
    let (Some(friction_w), Some(damping_w)) =
        (peak.peak_friction_power_w, peak.peak_damping_power_w)
    else {
        return html! {};
    };
    let damping = quantity(damping_w, "W", 3);
    let loss = peak.loss_words();
    if peak.counts().is_none() {
        return card(
            "Damping dissipates at the peak",
            &damping,
            &html! { @if let Some(loss) = loss { (loss) } },
        );
    }
    let friction = if friction_w > 0.0 {
        let digits = supported_digits(friction_w, peak.friction_power_error());
        quantity(friction_w, "W", digits.min(3))
    } else {
        "none".to_owned()
    };
    card(
        "Friction dissipates at the peak",
        &friction,
        &html! { "damping " (damping) @if let Some(loss) = loss { "; " (loss) } },
    )
}

/// Card with the load of the most worn pairs: energy dissipated by friction and slid distance.
fn pair_card(peak: &ObservedPeak) -> Markup {
    let Some(slid_m) = peak.peak_largest_slid_m else {
        return html! {};
    };
    let slid = quantity(slid_m, "m", 3);
    match peak.peak_largest_friction_energy_j_m2 {
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

fn joint(response: &ResponseSummary) -> Markup {
    let Some(counts) = response.first.counts() else {
        return html! {};
    };
    let share = response.area_share_that_opens.filter(|share| *share > 0.0);
    card(
        "The joint at the peak",
        &format!(
            "{} of {} pairs slip or open",
            counts.slipping + counts.opening + counts.closing,
            counts.pairs()
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
    let rise = response.first.peak_rise;
    html! {
        ul.trust {
            (line(converged, &html! {
                (response.converged_points) " of " (response.points) " frequencies converged."
            }))
            @if let Some(words) = response.first.not_computed_words() {
                (line(false, &html! { (capital(&words)) "." }))
            }
            @if response.first.peak_at_end_of_range {
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
                @let (name, unit) = contents.observations.get(two.observation)
                    .map_or(("", "m"), |one| (one.name.as_str(), one.quantity.unit()));
                (line(false, &html! {
                    "From " (quantity(two.from_hz, "Hz", 5)) " to " (quantity(two.to_hz, "Hz", 5))
                    " there are several motions: at " (quantity(two.frequency_hz, "Hz", 5)) " one has "
                    (quantity(two.amplitude_m, unit, 4)) " of " (name) " and another "
                    (quantity(two.other_amplitude_m, unit, 4)) "."
                }))
            }
            @if let Some(stability) = &response.first.peak_stability {
                (is_stable(stability))
            }
            @for words in response.two_periods_words("m") {
                (line(false, &html! { (capital(&words)) "." }))
            }
            @match response.first.peak_estimated_error {
                Some(error) => (small(error, LARGE_ERROR, "More harmonics and samples would change the peak by ", "an estimated")),
                None if response.first.peak_amplitude_m.is_some() && contents.has_pairs() => {
                    (line(false, &html! { "The error from harmonics and samples is not known." }))
                }
                None => {}
            }
            @if let Some(error) = response.first.friction_power_error() {
                (small(error, 3.0 * LARGE_ERROR, "They would change the friction power at the peak by ", "an estimated"))
            }
            @if let Some(error) = response.worst_energy_balance_error {
                (small(error, UNBALANCED, "Power put in and power spent differ by ", "at most"))
            }
            @if let Some(error) = contents.summary.truncation.as_ref().and_then(|t| t.amplitude) {
                (small(error, CHANGED, "The modes left out change amplitudes of the linear curve by ", "an estimated"))
            }
            @let frequencies = contents.summary.truncation.iter().flat_map(|t| &t.frequencies);
            @if let Some(error) = frequencies.copied().reduce(f64::max) {
                (line(error <= CHANGED, &html! {
                    "The modes kept of the bodies (" code { "fixed_interface_modes" } ") raise the first stuck frequencies by up to "
                    (bounded(error, "an estimated")) "."
                }))
            }
            @if let Some(stress) = &contents.summary.stress {
                (mesh_of_stress(stress))
            }
            @if let Some(checks) = &contents.summary.checks {
                @if let Some(check) = &checks.residual_tractions { (residual_tractions(check)) }
                (flank_mesh(&checks.flank_mesh))
            }
            @match doubtful(contents) {
                0 => {},
                1 => (line(false, &html! { "A " a href="#warnings" { "warning" } " of the run says what else may be off." })),
                many => (line(false, &html! { (many) " " a href="#warnings" { "warnings" } " of the run say what else may be off." })),
            }
            li.quiet {
                @if contents.has_pairs() {
                    "Pressures at the edges of flanks grow with each refinement of the mesh; peak and friction power converge."
                } @else {
                    "The mesh is not judged here for the peak: a study over its sizes does that."
                }
            }
        }
    }
}

/// Line about the stability of the peak.
fn is_stable(stability: &PeakStability) -> Markup {
    let amplitude_at = |amplitude: f64, hz: f64| {
        format!(
            "{} at {}",
            quantity(amplitude, "m", 4),
            quantity(hz, "Hz", 6)
        )
    };
    let stable = stability
        .largest_stable_amplitude_m
        .zip(stability.largest_stable_frequency_hz);
    match (stability.instability_words(), &stability.not_judged) {
        (Some(instability), _) => line(
            false,
            &html! {
                "The peak is unstable (" (instability) "): the structure does not stay in this motion. "
                @if let Some((amplitude, hz)) = stable {
                    "The largest stable amplitude that was found is " (amplitude_at(amplitude, hz)) "."
                } @else {
                    "No stable motion was found."
                }
                @if let Some(departure) = &stability.departure {
                    @let [least, most] = departure.amplitude_range_m.map(|a| quantity(a, "m", 4));
                    " An integration in time over " (departure.periods)
                    " periods from the peak had amplitudes of single periods from " (least) " to " (most) "."
                }
            },
        ),
        (None, Some(reason)) => unchecked(&html! { "is the peak stable? " (capital(reason)) "." }),
        (None, None) => line(
            true,
            &html! {
                "The peak is stable"
                @if let Some(multiplier) = stability.floquet_multiplier {
                    ": a small perturbation shrinks to " (figure(multiplier, 3)) " of itself in a period"
                }
                "."
            },
        ),
    }
}

/// Line about the dependence of the peak on residual tractions.
fn residual_tractions(check: &TractionCheck) -> Markup {
    let Some(change) = check.peak_change else {
        return unchecked(&html! {
            "does the peak depend on the residual tractions that assembly leaves? "
            @match &check.command {
                Some(command) => { "To check it, run " code { (command) } "." },
                None => "Starting tractions belong to a response at one speed.",
            }
        });
    };
    line(
        check.verdict == Verdict::Small,
        &html! {
            "With " (check.tractions) " residual tractions that assembly may leave, the peaks differ by "
            (bounded(change, "at most")) "."
        },
    )
}

/// Line about the mesh of the flanks.
fn flank_mesh(check: &FlankMeshCheck) -> Markup {
    let study = check.study.as_deref().unwrap_or_default();
    let Some(peak) = check.peak_error else {
        return unchecked(&html! {
            "is the mesh of the flanks fine enough for peak and friction power? "
            @if check.study.is_some() {
                "Study " (study) " has no result for this mesh. "
            }
            @match &check.command {
                Some(command) => { "To check it, run " code { (command) } "." },
                None => "A reduced model has no mesh.",
            }
        });
    };
    line(
        check.verdict == Verdict::Small,
        &html! {
            "The mesh of the flanks changes the peak by " (bounded(peak, "an estimated"))
            @if let Some(power) = check.friction_power_error {
                " and the friction power by " (bounded(power, "an estimated"))
            }
            " (study " (study) ")."
        },
    )
}

/// Line about the mesh error of the highest stress.
fn mesh_of_stress(stress: &StressSummary) -> Markup {
    let (Some(place), Some(error)) = (stress.places.first(), stress.relative_error()) else {
        return html! {};
    };
    let undecided = stress.places.iter().any(PlaceSummary::is_undecided);
    let good = error <= LARGE_STRESS_ERROR && !undecided;
    line(
        good,
        &html! {
            "The mesh error of the " a href="#stress" { "highest stress" } " is " (bounded(error, "an estimated"))
            ": " (place.ranked_words(stress.ranked_by))
            @if stress.ranked_by == RankedBy::Utilisation { " of the strength" }
            @if undecided { "; whether the strength suffices depends on the mesh" }
            "."
        },
    )
}

/// Line about an error, which is small up to a limit.
fn small(error: f64, limit: f64, about: &str, how: &str) -> Markup {
    line(error <= limit, &html! { (about) (bounded(error, how)) "." })
}

/// Number of warnings of more weight than a remark.
fn doubtful(contents: &Contents<'_>) -> usize {
    let warnings = contents.summary.warnings.iter();
    warnings
        .filter(|warning| warning.weight != Weight::Remark)
        .count()
}
