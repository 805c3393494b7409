//! Numerics that know no physics: sparse factorisation, eigenvalues, Krylov and Newton methods, Fourier.

pub mod factor;
pub mod order;

#[cfg(test)]
pub(crate) mod lattice;
