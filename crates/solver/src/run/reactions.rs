//! Forces and moments by which contacts, supports and springs push the bodies, in the static state
//! and at the peak of a response.

use faer::Mat;

use super::bodies::Bodies;
use super::error::Error;
use crate::damping::Rayleigh;
use crate::dlft::{Orbit, StaticState};
use crate::problem::Problem;
use crate::results::reactions::{Moving, Supports};
use crate::results::resultants::{Resultant, contact_resultants, static_contact_resultants};

/// Resultants in a static state that converged: of contacts and, with a recovery, of supports and
/// springs to ground.
///
/// # Errors
/// The errors of the finite elements at the supports.
pub fn static_forces(bodies: &Bodies, state: &StaticState) -> Result<Vec<Resultant>, Error> {
    let model = bodies.model();
    let mut resultants = static_contact_resultants(model, state);
    if let Some(recovery) = bodies.recovery() {
        let supports = Supports::new(model, &bodies.prestressed)?;
        resultants.extend(supports.static_reactions(&recovery.full_static(&state.x)));
    }
    Ok(resultants)
}

/// Motion at the peak, with its damping.
#[derive(Debug, Clone, Copy)]
pub struct PeakMotion<'a> {
    /// The motion.
    pub orbit: &'a Orbit,
    /// Its displacements, m ([`Bodies::free_motion_m`]); `None` without a recovery.
    pub motion_m: Option<&'a [Mat<f64>]>,
    /// Problem, of which the number of stuck modes with a damping ratio of their own counts.
    pub problem: &'a Problem,
    /// Rayleigh damping of the bodies.
    pub damping: Rayleigh,
}

/// Resultants over a period: of contacts and, with displacements, of supports and springs to ground.
/// The force of the damping of stuck modes with a ratio of their own, which belongs to no element,
/// is not in them.
///
/// # Errors
/// The errors of the finite elements at the supports.
pub fn peak_forces(bodies: &Bodies, peak: PeakMotion<'_>) -> Result<Vec<Resultant>, Error> {
    let (model, orbit) = (bodies.model(), peak.orbit);
    let mut resultants = contact_resultants(model, orbit);
    if let Some(motion_m) = peak.motion_m {
        let supports = Supports::new(model, &bodies.prestressed)?;
        let with_own_ratio = peak.problem.modal_ratios.len();
        let without = match with_own_ratio > 0 && peak.damping != Rayleigh::NONE {
            true => bodies.free_motion_m(&orbit.omit_modes(0..with_own_ratio)),
            false => None,
        };
        resultants.extend(supports.periodic_reactions(&Moving {
            omega_rad_s: std::f64::consts::TAU * orbit.frequency_hz,
            motion_m,
            damped_m: without.as_deref().unwrap_or(motion_m),
            damping: peak.damping,
        }));
    }
    Ok(resultants)
}
