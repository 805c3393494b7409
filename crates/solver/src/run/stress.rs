//! Stress of the bodies at the peak of a response.

use super::bodies::Bodies;
use crate::dlft::Orbit;
use crate::model::{Body, Strength};
use crate::results::recovery::NodalField;
use crate::results::stress::{
    BodyStress, HighestStress, Singular, StressCycle, dynamic_stress, harmonic_stress,
    highest_stress, node_stress, ranked_by_utilisation, singular_nodes,
};
use crate::results::stress_error::estimate_errors;

/// Number of places that are ranked.
pub const PLACES: usize = 10;

/// Stress over the period of the peak.
#[derive(Debug)]
#[non_exhaustive]
pub struct PeakStress {
    /// Stress of each body.
    pub bodies: Vec<BodyStress>,
    /// Strength of each body; `None` where the scene gives none.
    pub strengths: Vec<Option<Strength>>,
    /// Reason why the stress of each node of each body is a number of the mesh; `None` elsewhere.
    pub singular: Vec<Vec<Option<Singular>>>,
    /// Places with the highest stress.
    pub highest: HighestStress,
    /// True if places are ranked by what they use of the strength, false if by amplitude.
    pub by_utilisation: bool,
    /// Largest change of the amplitude of the ranked places where the upper half of the stuck modes
    /// is left out, over the largest amplitude of these places: the stress comes back more slowly
    /// with the number of modes than the displacement does. `None` without places.
    pub modes_share: Option<f64>,
}

/// Stress of bodies that have the motion `motion_m` of this orbit ([`Bodies::motion_m`]), which is
/// reduced to `stuck_modes` stuck modes. `strengths` has an entry for each body. `None` where no
/// body has finite elements.
pub fn peak_stress(
    bodies: &Bodies,
    (orbit, motion_m): (&Orbit, &[Vec<NodalField>]),
    stuck_modes: usize,
    strengths: Vec<Option<Strength>>,
) -> Option<PeakStress> {
    let model = bodies.model();
    model.bodies.iter().find_map(Body::material)?;
    let stress = dynamic_stress(model, motion_m);
    let singular = singular_nodes(model);
    let mut highest = highest_stress(model, &stress, &strengths, &singular, PLACES);
    let places = highest.places.iter_mut().chain(&mut highest.singular);
    estimate_errors(model, motion_m, &stress, &strengths, places);
    let amplitudes = highest.places.iter().map(|place| place.cycle.amplitude_pa);
    let largest = amplitudes.reduce(f64::max).filter(|largest| *largest > 0.0);
    let modes_share = largest.and_then(|largest| {
        // Residual vectors stay.
        let upper = stuck_modes.div_ceil(2)..stuck_modes;
        let lower = bodies.motion_m(&orbit.omit_modes(upper))?;
        let lower = harmonic_stress(model, &lower);
        let changes = highest.places.iter().map(|place| {
            let other = node_stress(&lower[place.at.body], place.at.node as usize);
            let other = StressCycle::new(&other).amplitude_pa;
            (other - place.cycle.amplitude_pa).abs() / largest
        });
        changes.reduce(f64::max)
    });
    Some(PeakStress {
        by_utilisation: ranked_by_utilisation(model, &strengths),
        bodies: stress,
        strengths,
        singular,
        highest,
        modes_share,
    })
}
