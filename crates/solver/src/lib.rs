//! Vibration of bodies that touch with dry friction: contacts stick, slip and lift off.
//!
//! Data flows one way, each stage a function from one artefact to the next:
//!
//! - [`model`]: from a [`Mesh`](dovetail_mesh::Mesh) and names to indices and contact pairs.
//! - [`fem`]: stiffness, mass and rotation.
//! - [`structure`]: bodies as matrices, and their joints.
//! - [`reduction`]: the bodies joined, on relative displacements and stuck modes.
//! - [`contact`]: the laws of pairs.
//! - [`problem`]: a reduced model with laws and excitations, and its dynamic stiffness.
//! - [`dlft`]: static state and harmonic balance.
//! - [`integration`]: the same motion in time, as a check.
//! - [`results`]: physical fields.
//!
//! [`description`] is a whole run as a value, and [`run`] does it.
//!
//! The response of a blade in its dovetail, reduced to 72 pairs, near its first mode:
//!
//! ```
//! use dovetail_solver::contact::PairLaw;
//! use dovetail_solver::description::*;
//! use dovetail_solver::dlft::settings::Resolution;
//! use dovetail_solver::damping::DampingSpec;
//! use dovetail_solver::results::quantities::{linear_peak, peak};
//! use dovetail_solver::run::{Options, Session, solve};
//!
//! let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/dovetail72");
//! let range = FrequencyRange::OfFirstLinearMode { from: 0.98, to: 1.02 };
//! let resolution = Resolution::Fixed { harmonics: 1, samples: 64 };
//! let scene = Scene {
//!     name: "dovetail".to_owned(),
//!     subject: Subject::ReducedModel(ReducedModelSpec {
//!         folder: folder.into(),
//!         law: PairLaw::rigid(0.3, 0.0),
//!         force_n: 2.0,
//!     }),
//!     damping: DampingSpec::Ratio { ratio: 0.001, linear_mode: 1 },
//!     modal_ratios: Vec::new(),
//!     static_state: StaticSpec::default(),
//!     response: ResponseSpec { points: Some(11), ..ResponseSpec::new(range, resolution) },
//!     engine_orders: Vec::new(),
//!     mission: Vec::new(),
//! };
//! let model = dovetail_superelement::read(folder.as_ref())?;
//! // Nobody listens, and nothing is kept.
//! let run = solve(&scene, model.into(), Options::default(), &Session::new(&mut (), &mut ()))?;
//! run.verdict()?;
//! let response = run.response.expect("a static state").response;
//! let peak = peak(&response, 0).expect("a motion");
//! let without_slip = linear_peak(&response, 0).expect("a curve");
//! assert!(peak.amplitude_m < 0.9 * without_slip.amplitude_m);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs, unreachable_pub, clippy::missing_errors_doc)]

pub mod description;
pub mod results;
pub mod run;

pub use dovetail_dynamics::{
    contact, damping, dlft, excitation, integration, problem, reduced, superelement,
};
pub use dovetail_numerics::{memory, space, spectrum};
pub use dovetail_structure::{fem, model, reduction, structure};
