//! Forces of contacts, supports and springs in a report.

use maud::{Markup, html};

use super::super::Contents;
use super::super::frame::table;
use crate::words::figure;
use dovetail_solver::results::resultants::{Resultant, ends_of};

pub(super) fn forces(contents: &Contents<'_>) -> Markup {
    let (Some(model), Some(first)) = (contents.model, contents.forces.first()) else {
        return html! {};
    };
    let moves = first.force_n.len() > 1;
    let range = |of: &[[f64; 3]]| {
        let half = |k: usize| {
            let coefficients: Vec<f64> = of.iter().map(|v| v[k]).collect();
            let [least, largest] = ends_of(&coefficients);
            (largest - least) / 2.0
        };
        components([0, 1, 2].map(half), 3)
    };
    let pusher = |of: &&Resultant| format!("{} {}", of.pusher.id(), of.name);
    let body = |of: &&Resultant| model.bodies[of.body].name.clone();
    let about = |of: &&Resultant| components(of.about_m.map(|x| 1e3 * x), 4);
    let force = |of: &&Resultant| components(of.force_n[0], 4);
    let moment = |of: &&Resultant| components(of.moment_nm[0], 3);
    html! {
        section #forces {
            h2 { @if moves { "Forces at the peak" } @else { "Forces in the static state" } }
            p {
                "Force and moment by which each contact, support and spring to ground pushes a body; a contact pushes the body of its first flank. "
                @if moves { "The amplitude is half of the range over the period. " }
                "Components are along x, y and z, and moments are about the point beside them."
            }
            @if moves {
                (table(
                    "numbers named plain",
                    contents.forces,
                    &[
                        ("", &pusher),
                        ("body", &body),
                        ("mean force (N)", &force),
                        ("amplitude (N)", &|of| range(&of.force_n)),
                        ("mean moment (N m)", &moment),
                        ("amplitude (N m)", &|of| range(&of.moment_nm)),
                        ("about (mm)", &about),
                    ],
                ))
            } @else {
                (table(
                    "numbers named plain",
                    contents.forces,
                    &[
                        ("", &pusher),
                        ("body", &body),
                        ("force (N)", &force),
                        ("moment (N m)", &moment),
                        ("about (mm)", &about),
                    ],
                ))
            }
        }
    }
}

/// Components of a vector. Those that are rounding beside the largest are zero.
fn components(v: [f64; 3], digits: usize) -> String {
    let largest = v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let v = v.map(|x| if x.abs() < ROUNDING * largest { 0.0 } else { x });
    v.map(|x| figure(x, digits)).join(", ")
}

/// Component, relative to the largest one, that counts as none.
const ROUNDING: f64 = 1e-9;
