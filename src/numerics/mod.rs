//! Numerics that know no physics: sparse factorisation, eigenvalues, Krylov and Newton methods, Fourier.

pub mod dogleg;
pub mod fourier;
pub mod gmres;
pub mod newton;
