//! Computes the vibration of machine parts that rub on each other: contacts stick, slip and lift
//! off.
//!
//! This package is the program around the library `dovetail_solver`. [`cli`] reads the arguments
//! and calls [`commands`] or [`study`]. [`scene`] reads TOML into a description of a run.
//! [`commands`] opens its meshes, which [`gmsh`] makes where the scene names a script, and passes
//! them to the library, which computes. [`store`] has what earlier runs computed. [`reporter`]
//! observes the run and tells a [`listener`]; [`console`] is one that prints; [`files`] writes its
//! results by [`dovetail_export`]. [`study`] performs many runs, each as a process of this program.
//!
//! Imports point one way, which `tests/program/tidy.rs` holds. [`scene`], [`gmsh`], [`mesh_files`]
//! and most small modules, such as [`motions`], import nothing of the rest. Then follow [`error`] <
//! [`study_file`] < [`files`] < [`reporter`] < [`store`] < [`commands`] < [`study`] <
//! [`reference`](mod@reference), [`schema`] < [`cli`], none of which imports what stands after it.

#![forbid(unsafe_code)]

pub mod cli;
pub mod commands;
pub mod console;
pub mod error;
pub mod exhaustion;
pub mod exit;
pub mod files;
pub mod gmsh;
pub mod influence_file;
pub mod listener;
pub mod matrix_files;
pub mod mesh_files;
pub mod mesh_study;
pub mod metrics;
pub mod motions;
pub mod reference;
pub mod reporter;
pub mod scene;
pub mod scene_files;
pub mod schema;
pub mod store;
pub mod study;
pub mod study_file;
pub mod terminal;
pub mod version;
