//! Forces and moments that contacts transmit over a period.

use super::signals::over_period;
use crate::dlft::Orbit;
use crate::model::Model;
use dovetail_numerics::space::{add_scaled, cross, sub};
use dovetail_numerics::spectrum::{Spectrum, blocks};

/// Instants of a period at which the ends of a signal are taken.
const INSTANTS: usize = 256;

/// Force and moment by which the second flank of a contact pushes the first.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Resultant {
    /// Point that the moment is about, m: the centroid of the area of the pairs.
    pub about_m: [f64; 3],
    /// Force, N: mean, cosine 1, sine 1, ...; 2H+1.
    pub force_n: Vec<[f64; 3]>,
    /// Moment, N m, in the same order.
    pub moment_nm: Vec<[f64; 3]>,
}

/// Least and largest value over a period of a signal with these coefficients: mean, cosine 1, sine
/// 1, ...
pub fn ends_of(coefficients: &[f64]) -> [f64; 2] {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    over_period(coefficients, INSTANTS)
        .into_iter()
        .fold(ends, |[least, largest], v| [least.min(v), largest.max(v)])
}

/// Resultant of each contact of [`Model::contact_names`] in an orbit.
pub fn contact_resultants(model: &Model, orbit: &Orbit) -> Vec<Resultant> {
    let contacts = 0..model.contact_names.len();
    contacts
        .map(|c| contact_resultant(model, c, orbit))
        .collect()
}

fn contact_resultant(model: &Model, contact: usize, orbit: &Orbit) -> Resultant {
    let pairs = || {
        model
            .pairs
            .iter()
            .enumerate()
            .filter(|(_, p)| p.contact == contact)
    };
    let area_m2: f64 = pairs().map(|(_, p)| p.area_m2).sum();
    let mut about_m = [0.0; 3];
    for (_, pair) in pairs() {
        add_scaled(&mut about_m, pair.area_m2 / area_m2, pair.position_m);
    }
    let spectrum = Spectrum::new(&orbit.lambda, orbit.harmonics);
    let sum = |block: usize| {
        let lambda = spectrum.block(block);
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
    let sums: Vec<[[f64; 3]; 2]> = (0..blocks(orbit.harmonics)).map(sum).collect();
    Resultant {
        about_m,
        force_n: sums.iter().map(|[force, _]| *force).collect(),
        moment_nm: sums.iter().map(|[_, moment]| *moment).collect(),
    }
}
