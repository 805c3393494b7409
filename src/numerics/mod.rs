//! Numerics that know no physics: sparse factorisation, eigenvalues, Krylov and Newton methods, Fourier.

pub mod eigen;
pub mod factor;
pub mod order;
pub mod sparse;

#[cfg(test)]
pub(crate) mod lattice;
