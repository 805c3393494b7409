//! Numerics without physics: sparse factorisation, eigenvalues, Krylov and Newton methods, Fourier.

#![warn(missing_docs, clippy::missing_errors_doc)]

pub mod condense;
pub mod dense;
pub mod dogleg;
pub mod eigen;
mod elimination;
pub mod factor;
pub mod fourier;
mod fronts;
pub mod gmres;
pub mod inertia;
pub mod memory;
pub mod newton;
pub mod order;
pub mod packed;
mod pattern;
pub mod refresh;
mod solve;
pub mod space;
pub mod sparse;
pub mod spectrum;
pub mod stored;
mod symbolic;
pub mod vector;
