//! Time integration of the reduced model, to check harmonic balance: no Fourier series, no eps, no
//! predicted forces. Unilateral contact with Coulomb friction, rigid or on springs, is solved for
//! in each time step.
//!
//! The law is written anew in [`step`] and `contact_forces`, and stays independent of the law
//! that DLFT evaluates, so that an error in one of the two shows. Only the signs and the data of a
//! pair ([`PairLaw`](crate::contact::PairLaw)) come from [`crate::contact`].
//!
//! Equations, with damping C = a K + b M on all coordinates (X, q) and the signs of
//! [`crate::contact`]:
//!
//! ```text
//! K X + C X' + M X'' + p (q'' + b q') + lambda = F(t)
//! q'' + (a w^2 + b) q' + w^2 q + p^T (X'' + b X')  = fm(t)
//! ```
//!
//! [`step`] is Moreau's time stepping (J. J. Moreau, *Unilateral contact and dry friction in finite
//! freedom dynamics*, 1988; M. Jean, Comput. Methods Appl. Mech. Engrg. 177 (1999) 235-257) with
//! the trapezoidal rule; `contact_forces` solves for the contact forces of a step; [`steady`]
//! goes on to the steady state and measures a period; [`compare`] puts that beside the orbit of
//! harmonic balance, and [`departure`] follows an unstable one to where it leads. Only these two, and `whole_disc`, which makes one problem of all sectors of a
//! disc in a wave, know of DLFT.

pub mod compare;
pub(crate) mod contact_forces;
pub mod departure;
pub mod steady;
pub mod step;
mod whole_disc;

/// Error of a motion that was not integrated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum IntegrationError {
    #[error("{frequency_hz} Hz: a frequency must be above 0 and finite to be integrated in time")]
    Frequency { frequency_hz: f64 },
    #[error("{steps} steps per period: at least {least} are needed, 500 to 2000 are usual")]
    Steps { steps: usize, least: usize },
    #[error(
        "the effective mass of a time step at {frequency_hz:.4} Hz is singular: a pair has neither mass nor stiffness"
    )]
    Singular { frequency_hz: f64 },
    #[error(
        "{frequency_hz:.4} Hz: the contact forces of step {step} of period {period} were not found (residual {residual:.1e} of the largest force); take more steps per period"
    )]
    ContactNotSolved {
        frequency_hz: f64,
        period: usize,
        step: usize,
        residual: f64,
    },
    #[error(
        "all sectors of a disc are integrated together, and there is no reduced model of {nodal_diameter} nodal diameters"
    )]
    NodalDiameter { nodal_diameter: usize },
    #[error("steps in time have no aerodynamic influence")]
    Influence,
    #[error("{frequency_hz:.4} Hz: the motion grew without bound in period {period}")]
    NotFinite { frequency_hz: f64, period: usize },
}
