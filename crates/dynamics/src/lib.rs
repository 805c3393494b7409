//! Vibration of reduced models whose contacts stick, slip and lift off.
//!
//! - [`reduced`]: matrices on the relative displacements of contact pairs and on modes.
//! - [`damping`]: coefficients of damping.
//! - [`excitation`]: harmonic excitations of a reduced model.
//! - [`superelement`]: a reduced model with the names of its contacts and excitations.
//! - [`contact`]: the laws of pairs.
//! - [`problem`]: a reduced model with laws and excitations, and its dynamic stiffness.
//! - [`dlft`]: static state, harmonic balance, continuation, backbones.
//! - [`integration`]: the same motion in time, as a check.
//!
//! Nothing here knows meshes, elements or files: a program that has matrices makes a
//! [`ReducedModel`](reduced::ReducedModel) of them and begins here.

#![forbid(unsafe_code)]
#![warn(missing_docs, unreachable_pub, clippy::missing_errors_doc)]

pub mod contact;
pub mod damping;
pub mod dlft;
pub mod excitation;
pub mod integration;
pub mod problem;
pub mod reduced;
pub mod superelement;
