//! Sparse matrices, and the direct solver for symmetric ones.
//!
//! The solver works in three stages, each of which can be repeated without the one before it. An
//! *order* of the unknowns keeps the factor small (`order.rs`). The *symbolic* analysis finds from
//! the pattern of entries alone where the factor has entries ([`Symbolic`], `symbolic.rs`). The
//! *numeric* factorisation computes them: [`Cholesky`], K = L L^T, of a positive definite matrix,
//! and [`Ldlt`], K = L D L^T, of an indefinite one (`factor.rs`).
//!
//! The factorisation is multifrontal (Duff, Reid, ACM Trans. Math. Softw. 9 (1983) 302-325): it
//! eliminates groups of unknowns in small dense matrices, the fronts, from the leaves of a tree to
//! its root (`fronts.rs`, `elimination.rs`). [`condense()`] stops before the boundary and keeps the
//! matrices that are left on it, [`negative_eigenvalues`] counts the negative pivots and keeps
//! nothing. `solve.rs` applies a factor to right-hand sides.
//!
//! Matrices have both triangles stored. The order in which numbers are added is part of the
//! results: fronts, panels and branches have fixed sizes, and a change of one changes the last bits
//! of every result, but the number of threads never does. [`stored`] serialises matrices and
//! factors so that they read back to the last bit.

mod condense;
mod elimination;
mod factor;
mod fronts;
mod inertia;
mod operations;
mod order;
mod pattern;
mod solve;
pub mod stored;
mod symbolic;

pub use condense::{Condensed, condense};
pub use factor::{Cholesky, Ldlt};
pub use inertia::negative_eigenvalues;
pub(crate) use operations::symmetric_times;
pub use operations::{
    dense, extend_pattern, leading, submatrix, sum, symbolic_view, symmetric_product, times, view,
};
pub use order::{Order, OrderError, nested_dissection};
pub use symbolic::{FactorError, Symbolic};
