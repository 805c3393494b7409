//! Fixtures that the tests of several packages share: meshes of boxes ([`block`]), lattices of
//! springs ([`lattice`]), arrays of the test data ([`arrays`]), derivatives by differences ([`differences`]), folders ([`folder`]),
//! thread pools ([`threads`]), and tables of cases with the words of messages ([`words`]).
//! Packages name it under `[dev-dependencies]` alone.
//!
//! The numbers of a fixture are part of the tests: tolerances count on them.

pub mod arrays;
pub mod block;
pub mod differences;
pub mod folder;
pub mod lattice;
pub mod threads;
pub mod words;
