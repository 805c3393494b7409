//! Forces and moments that contacts transmit, and those of all that pushes a body as a table has them.

use super::signals::sample_period;
use crate::dlft::{Orbit, StaticState};
use crate::model::Model;
use dovetail_numerics::space::{add_scaled, cross, sub};
use dovetail_numerics::spectrum::{Spectrum, blocks};

/// Instants of a period at which the ends of a signal are taken.
const INSTANTS: usize = 256;

/// Kind of the thing that pushes a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pusher {
    /// The second flank of a contact, which pushes the first.
    Contact,
    /// A support.
    Support,
    /// A spring to ground.
    Spring,
}

impl Pusher {
    /// Word for it in tables.
    pub fn id(self) -> &'static str {
        match self {
            Self::Contact => "contact",
            Self::Support => "support",
            Self::Spring => "spring",
        }
    }
}

/// Force and moment by which a body is pushed.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Resultant {
    /// Kind of the thing that pushes it.
    pub pusher: Pusher,
    /// Name of the contact, of the group of held nodes, or of the spring.
    pub name: String,
    /// Number of the body that is pushed, in [`Model::bodies`]; of a contact, that of the first
    /// flank.
    pub body: usize,
    /// Point that the moment is about, m: the centroid of the area of the pairs, or that of the
    /// nodes of the support or spring.
    pub about_m: [f64; 3],
    /// Force, N: mean, cosine 1, sine 1, ...; 2H+1. In the static state it is one vector.
    pub force_n: Vec<[f64; 3]>,
    /// Moment, N m, in the same order.
    pub moment_nm: Vec<[f64; 3]>,
}

/// Least and largest value over a period of a signal with these coefficients: mean, cosine 1, sine
/// 1, ...
pub fn ends_of(coefficients: &[f64]) -> [f64; 2] {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    sample_period(coefficients, INSTANTS)
        .into_iter()
        .fold(ends, |[least, largest], v| [least.min(v), largest.max(v)])
}

/// Resultant of each contact of [`Model::contact_names`] in an orbit.
pub(crate) fn contact_resultants(model: &Model, orbit: &Orbit) -> Vec<Resultant> {
    resultants_of(model, &Spectrum::new(&orbit.lambda, orbit.harmonics))
}

/// Resultant of each contact of [`Model::contact_names`] in a static state.
pub fn static_contact_resultants(model: &Model, state: &StaticState) -> Vec<Resultant> {
    resultants_of(model, &Spectrum::new(&state.lambda, 0))
}

fn resultants_of(model: &Model, lambda: &Spectrum<'_>) -> Vec<Resultant> {
    let contacts = 0..model.contact_names.len();
    contacts
        .filter_map(|contact| contact_resultant(model, contact, lambda))
        .collect()
}

/// Resultant of one contact; `None` where it has no pairs.
fn contact_resultant(model: &Model, contact: usize, lambda: &Spectrum<'_>) -> Option<Resultant> {
    let pairs = || {
        model
            .pairs
            .iter()
            .enumerate()
            .filter(|(_, p)| p.contact == contact)
    };
    let body = pairs().find_map(|(_, pair)| pair.bodies()[0])?;
    let area_m2: f64 = pairs().map(|(_, p)| p.area_m2).sum();
    let mut about_m = [0.0; 3];
    for (_, pair) in pairs() {
        add_scaled(&mut about_m, pair.area_m2 / area_m2, pair.position_m);
    }
    let sum = |block: usize| {
        let lambda = lambda.block(block);
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        for (i, pair) in pairs() {
            // lambda is the force on the second flank; the first one bears its reaction.
            let mut on_first = [0.0; 3];
            for (k, direction) in pair.frame.iter().enumerate() {
                add_scaled(&mut on_first, -lambda[3 * i + k], *direction);
            }
            add_scaled(&mut force, 1.0, on_first);
            let arm = sub(pair.position_m, about_m);
            add_scaled(&mut moment, 1.0, cross(arm, on_first));
        }
        [force, moment]
    };
    let sums: Vec<[[f64; 3]; 2]> = (0..blocks(lambda.harmonics())).map(sum).collect();
    Some(Resultant {
        pusher: Pusher::Contact,
        name: model.contact_names[contact].clone(),
        body,
        about_m,
        force_n: sums.iter().map(|[force, _]| *force).collect(),
        moment_nm: sums.iter().map(|[_, moment]| *moment).collect(),
    })
}
