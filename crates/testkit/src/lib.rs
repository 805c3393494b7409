//! What the tests of several packages share. Packages name it under `[dev-dependencies]` alone.

pub mod block;
pub mod differences;
pub mod folder;
pub mod lattice;
