//! A [`ReducedModel`] as a folder of dense MatrixMarket arrays and a description, read and written.
//!
//! [`ReducedModel`]: dovetail_dynamics::reduced::ReducedModel
//!
//! | file | shape | what |
//! | --- | --- | --- |
//! | `model.json` | | units, numbers of pairs and modes, contacts, excitations, observed points, coefficients of dashpots |
//! | `stiffness.mtx`, `mass.mtx` | n x n | stiffness (N/m) and mass (kg) on X, per pair N, t1, t2 |
//! | `coupling.mtx` | n x m | mass coupling to the stuck modes, of unit modal mass |
//! | `squared_frequencies.mtx` | m | squared angular frequencies of the stuck modes, rad2/s2 |
//! | `static_load.mtx`, `static_load_on_modes.mtx` | n, m | static load; zero on the modes where the second is absent |
//! | `excitations.mtx`, `excitations_on_modes.mtx` | n x e, m x e | one unit of each excitation, a column each |
//! | `observed_points.mtx`, `observed_points_on_modes.mtx` | n x o, m x o | the observed points `x . X + q . modes`, a column each |
//! | `dashpots.mtx`, `dashpots_on_modes.mtx` | n x d, m x d | the displacements `x . X + q . modes` that dashpots act on, a column each |
//! | `positions.mtx` | n/3 x 3 | positions of the pairs, m |
//! | `areas.mtx` | n/3 | tributary areas of the pairs, m2; may be absent |
//!
//! Files without columns are left out. `Description` is what `model.json` has. Files that
//! [`write()`] wrote name their model in a comment, a hash of all its numbers: files of two models
//! are not read together. Files without such a comment, from another program, are accepted as they
//! are. The folder contains no friction, gap or damping besides that of dashpots: the caller gives
//! them.
//!
//! K has no eigenvalue below -1e-3 of the mean of its diagonal (spin softening makes it weakly
//! negative, and only contact holds the bodies), and M - p p^T, the mass that the stuck modes
//! leave, is positive semidefinite.

#![forbid(unsafe_code)]
#![warn(missing_docs, clippy::missing_errors_doc)]

mod description;
mod error;
pub mod input;
mod matrix_market;
mod read;
mod write;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

pub use description::FILES;
pub use error::SuperelementError;
pub use read::read;
pub use write::write;

/// Files of a model that exist in a folder.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let paths = FILES.map(|name| folder.join(name));
    paths.into_iter().filter(|path| path.exists()).collect()
}
