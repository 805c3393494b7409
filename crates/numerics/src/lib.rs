//! Numerics without physics: linear algebra, eigenvalues, nonlinear systems and Fourier series,
//! with the vectors and the memory that they need.
//!
//! [`sparse`] and [`dense`] have matrices and direct solvers, [`eigen`] natural modes, [`krylov`]
//! an iterative solver, [`nonlinear`] Newton's method and the dogleg. [`fourier`] leads from the
//! coefficients of a series to samples and back; [`spectrum`] alone knows in which order the
//! coefficients of a periodic motion stand. [`dual`] has numbers with derivatives, [`vector`] has operations on long vectors, [`space`]
//! vectors of three components. [`memory`] tells what the system leaves to the process, which is
//! asked before a large factorisation.
//!
//! Results are the same to the last bit, however many threads there are. The order of sums and the
//! sizes of blocks decide the last bits of all results, and stay as they are. Nothing here knows of
//! bodies or contacts: physics comes in as matrices, or as a trait of a few functions.
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
pub mod dual;
pub mod eigen;
pub mod fourier;
pub mod krylov;
pub mod memory;
pub mod nonlinear;
pub mod space;
pub mod sparse;
pub mod spectrum;
pub mod vector;
