//! Stress at the peak in a report: Haigh diagram and the highest places.

use maud::{Markup, PreEscaped, html};

use super::super::Contents;
use super::super::frame::table;
use crate::manifest::{PlaceSummary, RankedBy, StressSummary};
use crate::plots::{Haigh, PictureHeading, haigh_svg};
use crate::words::{figure, percent, percent_with_error, quantity_with_error, text_or_dash};
use dovetail_solver::results::stress::Singular;

/// Change of a stress with the number of modes above which the report points it out.
const CHANGED: f64 = 0.01;

pub(super) fn stress(contents: &Contents<'_>) -> Markup {
    let (Some(summary), Some(stress), Some(model)) =
        (&contents.summary.stress, contents.stress, contents.model)
    else {
        return html! {};
    };
    let heading = PictureHeading {
        title: "Haigh diagram of the peak",
        conditions: contents.conditions,
    };
    let haigh = haigh_svg(heading, &Haigh::new(model, stress));
    html! {
        section #stress {
            h2 { "Stress at the peak" }
            p { (words(summary)) }
            figure.haigh { (PreEscaped(haigh)) }
            @if summary.places.is_empty() {
                p { "No place has a stress that is not singular." }
            } @else {
                (places(&summary.places, false))
                p.quiet {
                    "The number after ± is the estimated error of the mesh: the difference between the stress at the node and the stress recovered from the elements around it (Zienkiewicz and Zhu). "
                    "It leaves out errors that reach the place from coarse elements elsewhere."
                }
            }
            @if let Some(share) = summary.modes_share {
                p.quiet {
                    "Without the upper half of the stuck modes the amplitudes of these places change by "
                    (percent(share, 2)) " of the largest"
                    @if share > CHANGED {
                        ". Stress needs more modes than displacement does: raise "
                        code { "response.stuck_modes" } " until it no longer changes"
                    }
                    "."
                }
            }
            @if !summary.singular.is_empty() {
                h3 { "Singular places" }
                p {
                    "At supports, at the edges of flanks and at point loads the stress grows without bound as the mesh is refined. "
                    "These values are numbers of the mesh, and the places above leave them out. "
                    "The estimated error of such a place does not shrink as the mesh is refined."
                }
                (places(&summary.singular, true))
            }
        }
    }
}

fn words(summary: &StressSummary) -> Markup {
    html! {
        "Stresses are equivalent stresses of von Mises at the nodes, with the steady part. "
        "The amplitude is half of the largest equivalent of the difference between two instants of the period. "
        @match summary.ranked_by {
            RankedBy::Utilisation => {
                "A place is a node where the use of the strength is highest among the nodes around it: amplitude over endurance, and mean in tension over the ultimate strength (Goodman). "
                "Above 1 the material does not endure the vibration."
            }
            RankedBy::Amplitude => {
                "A place is a node where the amplitude is highest among the nodes around it. "
                "With " code { "endurance_pa" } " and " code { "ultimate_pa" }
                " of each body the places are ranked by what they use of the strength."
            }
        }
        " Sharp corners without a fillet are singular, too; nothing marks them."
    }
}

fn places(places: &[PlaceSummary], singular: bool) -> Markup {
    let place = |(i, place): &(usize, &PlaceSummary)| match place.singular {
        Some(reason) if singular => Singular::words(reason).to_owned(),
        _ => (i + 1).to_string(),
    };
    let position = |place: &PlaceSummary| {
        let [x, y, z] = place.position_m.map(|v| figure(1e3 * v, 4));
        format!("{x}, {y}, {z}")
    };
    let mpa = |v: f64, error: Option<f64>| quantity_with_error(v, error, "Pa");
    table(
        "numbers named",
        places.iter().enumerate(),
        &[
            ("place", &place),
            ("body", &|(_, p)| p.body.clone()),
            ("node", &|(_, p)| p.node_tag.to_string()),
            ("x, y, z (mm)", &|(_, p)| position(p)),
            ("mean", &|(_, p)| mpa(p.mean_pa, p.mean_error_pa)),
            ("amplitude", &|(_, p)| {
                mpa(p.amplitude_pa, p.amplitude_error_pa)
            }),
            ("largest", &|(_, p)| mpa(p.largest_pa, p.largest_error_pa)),
            ("use of the strength", &|(_, p)| {
                text_or_dash(p.utilisation, |u| {
                    percent_with_error(u, p.utilisation_error)
                })
            }),
        ],
    )
}
