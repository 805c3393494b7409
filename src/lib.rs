//! Computes the vibration of turbomachinery blades held by dovetail joints, whose flanks stick,
//! slip and lift off.
//!
//! This package is the program about the library `dovetail_solver`. [`scene`] reads TOML into a
//! description of a run. [`pipeline`] alone knows the sequence of the stages. [`export`] writes
//! files. [`study`] runs the whole of it many times.

#![forbid(unsafe_code)]

pub mod cli;
pub mod console;
pub mod exhaustion;
pub mod exit;
pub mod export;
pub mod gmsh;
pub mod mesh_files;
pub mod metrics;
pub mod pipeline;
pub mod reference;
pub mod scene;
pub mod schema;
pub mod stage;
pub mod study;
pub mod terminal;
pub mod version;
pub mod warning;
pub mod words;
