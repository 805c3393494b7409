#![doc = include_str!("../README.md")]
//! # Modules
//!
//! A [`Scene`](description::Scene) is a whole run as a value: bodies, contacts, loads, and the
//! response asked for. [`Scene::solve`](description::Scene::solve) computes it, [`run::solve`] with
//! reports on the way and a store for results.
//!
//! Data flows one way, each stage a function from one artefact to the next:
//!
//! - [`mesh`]: from the bytes of a file to a [`Mesh`](mesh::Mesh).
//! - [`model`]: from a mesh and names to indices and contact pairs.
//! - [`fem`]: stiffness, mass and rotation.
//! - [`structure`]: bodies as matrices, and their joints.
//! - [`reduction`]: the bodies joined, on relative displacements and stuck modes.
//! - [`contact`]: the laws of pairs.
//! - [`problem`]: a reduced model with laws and excitations, and its dynamic stiffness.
//! - [`dlft`]: static state and harmonic balance.
//! - [`integration`]: the same motion in time, as a check.
//! - [`stability`]: whether a motion is stable, by its Floquet multipliers.
//! - [`results`]: physical fields.
//!
//! # From a reduced model to a response
//!
//! The same blade, reduced to 72 pairs:
//!
//! ```
//! use dovetail_solver::folder;
//! use dovetail_solver::prelude::*;
//!
//! let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/dovetail72");
//! let law = PairLaw::rigid(0.3, 0.0);
//! let subject = ReducedModelSpec { folder: path.into(), law, force_n: 2.0 };
//! let range = FrequencyRange::relative_to_first_mode(0.98, 1.02);
//! let response = ResponseSpec::new(range, Resolution::fixed(1, 64)).points(11);
//! let scene = Scene::new("dovetail", subject, response).damping(DampingSpec::ratio(0.001));
//! let run = scene.solve(folder::read(path.as_ref())?)?;
//! let response = &run.response.as_ref().expect("a static state").response;
//! let (with, without) = (peak(response, 0), linear_peak(response, 0));
//! assert!(with.expect("a motion").amplitude_m < 0.9 * without.expect("a curve").amplitude_m);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A program that has matrices and no files needs only `dovetail-dynamics`.

#![forbid(unsafe_code)]
#![warn(missing_docs, unreachable_pub, clippy::missing_errors_doc)]

pub mod description;
pub mod prelude;
pub mod results;
pub mod run;

pub use dovetail_dynamics::{
    ForcedResponse, ResponseError, Solved, contact, damping, dlft, excitation, integration,
    problem, reduced, stability, superelement,
};
/// Meshes, their elements, and with the feature `files` the readers of mesh files.
pub use dovetail_mesh as mesh;
pub use dovetail_numerics::{memory, space, spectrum};
pub use dovetail_structure::{fem, model, reduction, structure};
/// Folders of reduced models, read and written.
#[cfg(feature = "files")]
pub use dovetail_superelement as folder;
