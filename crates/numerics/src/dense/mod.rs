//! Dense matrices, to the same bits however many threads there are.
//!
//! The functions of this module itself run on the calling thread (`sequential.rs`): products, LU
//! and Cholesky factors, eigenvalues, and the exponential of a matrix (`exponential.rs`). [`parallel`] has products and the Cholesky factor of a large
//! matrix on all threads, which cut the work into fixed parts. For products that are bound by the
//! memory that they read, [`PackedSymmetric`] holds a symmetric matrix in single precision, and
//! [`NearField`] the blocks of it that are not small.
//!
//! faer's own methods of a matrix (`partial_piv_lu`, `llt`, `self_adjoint_eigen`, `solve`, `*`)
//! take the number of threads from a setting of the process, which belongs to the program and not
//! to a library. The libraries call these functions in their place.

mod exponential;
mod near_field;
mod packed;
pub mod parallel;
mod sequential;

pub use exponential::exponential;
pub use near_field::NearField;
pub use packed::{PackedSymmetric, add_symmetric_product, quadratic_forms};
pub use sequential::{
    Lu, add_product, cholesky, eigenvalues, is_definite, lowest_eigenvalue, product,
    self_adjoint_eigen, self_adjoint_eigenvalues, solve_in_place, symmetrised,
};
