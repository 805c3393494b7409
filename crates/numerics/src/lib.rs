//! Numerics without physics: sparse factorisation, eigenvalues, Krylov and Newton methods, Fourier.
//!
//! The first natural frequency of two masses of 1 kg on two springs of 1 N/m in a row:
//!
//! ```
//! use dovetail_numerics::eigen::lowest_modes;
//! use dovetail_numerics::sparse::Cholesky;
//! use nalgebra_sparse::{CooMatrix, CscMatrix};
//!
//! let sparse = |entries: &[(usize, usize, f64)]| {
//!     let mut matrix = CooMatrix::new(2, 2);
//!     entries.iter().for_each(|(i, j, v)| matrix.push(*i, *j, *v));
//!     CscMatrix::from(&matrix)
//! };
//! let stiffness = sparse(&[(0, 0, 2.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)]);
//! let mass = sparse(&[(0, 0, 1.0), (1, 1, 1.0)]);
//! let factor = Cholesky::factor(&stiffness)?;
//! let modes = lowest_modes(&stiffness, &mass, 1, &factor)?;
//! assert!((modes.omega2[0] - (3.0 - 5f64.sqrt()) / 2.0).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![warn(missing_docs, clippy::missing_errors_doc)]

pub mod dense;
pub mod eigen;
pub mod fourier;
pub mod krylov;
pub mod memory;
pub mod nonlinear;
pub mod space;
pub mod sparse;
pub mod spectrum;
pub mod vector;
