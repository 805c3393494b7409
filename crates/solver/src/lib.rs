//! Vibration of bodies that touch with dry friction: contacts stick, slip and lift off.
//!
//! Data flows one way, each stage a function from one artefact to the next:
//!
//! [`model`] [`Mesh`](dovetail_mesh::Mesh), names -> indices, contact pairs; [`fem`] stiffness, mass,
//! rotation; [`reduction`] the bodies joined, on relative displacements and stuck modes; [`contact`]
//! the laws of pairs; [`problem`] a reduced model with laws and excitations, its dynamic stiffness;
//! [`dlft`] static state and harmonic balance; [`integration`] the same motion in time, to check
//! it; [`results`] physical fields. [`description`] is a whole run as a value, and [`run`] does it.

#![forbid(unsafe_code)]
#![warn(missing_docs, clippy::missing_errors_doc)]

pub mod contact;
pub mod description;
pub mod dlft;
pub mod fem;
pub mod input;
pub mod integration;
pub mod model;
pub mod problem;
pub mod reduction;
pub mod results;
pub mod run;

pub use dovetail_numerics::{memory, space, spectrum};
