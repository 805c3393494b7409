//! Computes the vibration of turbomachinery blades held by dovetail joints, whose flanks stick,
//! slip and lift off.
//!
//! This package is the program around the library `dovetail_solver`. [`scene`] reads TOML into a
//! description of a run. [`commands`] opens its meshes and passes them to the library, which
//! computes. [`reporter`] observes the run; [`files`] and [`export`] write its results. [`study`]
//! performs many runs.

#![forbid(unsafe_code)]

pub mod cache;
pub mod cli;
pub mod commands;
pub mod console;
pub mod error;
pub mod exhaustion;
pub mod exit;
pub mod export;
pub mod files;
pub mod fingerprint;
pub mod gmsh;
pub mod mesh_files;
pub mod metrics;
pub mod motions;
pub mod reference;
pub mod reporter;
pub mod scene;
pub mod scene_files;
pub mod schema;
pub mod study;
pub mod terminal;
pub mod version;
pub mod warning;
pub mod words;
