//! From meshes of bodies that touch to a reduced model of their assembly.
//!
//! Data flows one way, each stage a function from one artefact to the next:
//!
//! - [`model`]: from a [`Mesh`](dovetail_mesh::Mesh) and names to indices and contact pairs.
//! - [`fem`]: stiffness, mass and rotation.
//! - [`structure`]: bodies as matrices, and their joints.
//! - [`reduction`]: the bodies joined, on relative displacements and stuck modes.
//!
//! The result is a [`ReducedModel`](dovetail_dynamics::reduced::ReducedModel).

#![forbid(unsafe_code)]
#![warn(missing_docs, unreachable_pub, clippy::missing_errors_doc)]

pub mod fem;
pub mod model;
pub mod reduction;
pub mod structure;
