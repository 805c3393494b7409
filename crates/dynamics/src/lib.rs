#![doc = include_str!("../README.md")]
//! # Modules
//!
//! - [`reduced`]: matrices on the relative displacements of contact pairs and on modes.
//! - [`damping`]: coefficients of damping.
//! - [`excitation`]: harmonic excitations of a reduced model.
//! - [`superelement`]: a reduced model with the names of its contacts and excitations.
//! - [`contact`]: the laws of pairs.
//! - [`problem`]: a reduced model with laws and excitations, and its dynamic stiffness.
//! - [`dlft`]: static state, harmonic balance, continuation, backbones.
//! - [`integration`]: the same motion in time, as a check.
//! - [`stability`]: whether a motion is stable, by its Floquet multipliers.
//!
//! Nothing here knows meshes, elements or files: a program that has matrices makes a
//! [`ReducedModel`](reduced::ReducedModel) of them and begins here. [`ForcedResponse`] computes its
//! response in one call.
//!
//! # Models that come from elsewhere
//!
//! - `dovetail-structure` condenses the matrices of bodies, or their meshes, to a reduced model.
//! - `dovetail-superelement` reads one from a folder.

#![forbid(unsafe_code)]
#![warn(missing_docs, unreachable_pub, clippy::missing_errors_doc)]

pub mod contact;
pub mod damping;
pub mod dlft;
pub mod excitation;
mod forced_response;
pub mod integration;
pub mod prelude;
pub mod problem;
pub mod reduced;
pub mod stability;
pub mod superelement;

pub use forced_response::{ForcedResponse, ResponseError, Solved};
