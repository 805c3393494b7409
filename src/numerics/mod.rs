//! Numerics that know no physics: sparse factorisation, eigenvalues, Krylov and Newton methods, Fourier.
