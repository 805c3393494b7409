//! Vibration of turbomachinery blades held by dovetail joints: the flanks stick, slip and lift off.
//!
//! Data flows one way, each stage a function from one artefact to the next:
//!
//! [`scene`] text -> `Scene`; [`mesh`] bytes -> `Mesh`; [`model`] names -> indices, contact pairs;
//! [`fem`] stiffness, mass, rotation; [`reduction`] Craig-Bampton and relative coordinates;
//! [`contact`] dynamic stiffness and laws; [`dlft`] static state and harmonic balance;
//! [`integration`] the same motion in time, to check it; [`results`] physical fields; [`export`] files. [`pipeline`] alone knows the sequence;
//! [`study`] runs the whole of it many times.

#![forbid(unsafe_code)]

pub mod cli;
pub mod contact;
pub mod description;
pub mod dlft;
pub mod error;
pub mod export;
pub mod fem;
pub mod input;
pub mod integration;
pub mod mesh;
pub mod model;
pub mod pipeline;
pub mod progress;
pub mod reduction;
pub mod results;
pub mod scene;
pub mod study;
pub mod terminal;
pub mod text;
