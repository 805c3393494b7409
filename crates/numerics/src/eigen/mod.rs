//! Natural modes: the lowest solutions of K phi = omega^2 M phi, with K symmetric positive
//! definite, and M too except for unknowns without mass.
//!
//! [`lowest_modes`] chooses the method: [`dense`] for small problems, otherwise Lanczos iteration
//! with K factored, one vector at a time ([`arpack`]) or in blocks where the factor is large
//! ([`blocks`]). `sturm.rs` checks the modes and proves that none is missing. [`coarse_space()`] is
//! something else: rough modes of a dense matrix, for a preconditioner.
//!
//! Start vectors, sizes of blocks and the sizes that choose the method decide the last bits of the
//! modes. `arpack.rs` has the only `unsafe` code of the libraries, and a lock, because ARPACK keeps
//! its state in static variables.

pub mod arpack;
pub mod blocks;
mod coarse_space;
pub mod dense;
mod sturm;

pub use coarse_space::{CoarseSpace, coarse_space, factor_order, independent};

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;

use crate::memory::TooLittle;
use crate::sparse::{self, Cholesky, FactorError};

/// Number of entries of a factor (here 128 MB) that each pass reads from memory again.
const LARGE_FACTOR: usize = 1 << 20;

/// Modes in ascending order, mass-normalised (`phi^T M phi = 1`). The first entry of each vector
/// that has at least half the largest magnitude is positive.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Modes {
    /// Squared angular frequencies, rad2/s2.
    pub omega2: Vec<f64>,
    /// One mode per column.
    #[serde(with = "crate::sparse::stored::matrix")]
    pub vectors: Mat<f64>,
}

impl Modes {
    /// Empty set of modes of a structure with so many unknowns.
    pub fn none(unknowns: usize) -> Self {
        Self {
            omega2: Vec::new(),
            vectors: Mat::zeros(unknowns, 0),
        }
    }

    /// Number of modes.
    pub fn count(&self) -> usize {
        self.omega2.len()
    }

    /// Frequencies `sqrt(omega2) / (2 pi)`, Hz.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        self.omega2
            .iter()
            .map(|w2| w2.sqrt() / std::f64::consts::TAU)
            .collect()
    }
}

/// Error of modes that were not found.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum EigenError {
    #[error(
        "the stiffness and the mass are {stiffness} x {stiffness} and {mass} x {mass}: they must be of one size"
    )]
    Sizes { stiffness: usize, mass: usize },
    #[error("the stiffness is not positive definite (pivot {pivot}): something is not held")]
    StiffnessNotPositive { pivot: usize },
    #[error("the mass is not positive definite: mode {mode} has no mass; check the densities")]
    MassNotPositive { mode: usize },
    #[error("the dense eigenvalue solver did not converge on {unknowns} unknowns")]
    Dense { unknowns: usize },
    #[error("{unknowns} unknowns are more than ARPACK's 32-bit integers can count")]
    TooLarge { unknowns: usize },
    #[error("ARPACK's {routine} stopped with code {info}")]
    Arpack { routine: &'static str, info: i32 },
    #[error(
        "{converged} of {wanted} modes converged in a basis of {columns} vectors; ask for fewer, and check the densities and the units"
    )]
    Basis {
        converged: usize,
        wanted: usize,
        columns: usize,
    },
    #[error("mode {mode} has a residual of {residual:.1e} after all tries; ask for fewer modes")]
    Residual { mode: usize, residual: f64 },
    #[error(
        "a Sturm count finds {expected} modes below {below:.6e} rad2/s2, the iteration {found} after all tries; ask for a few more or fewer modes"
    )]
    Missing {
        below: f64,
        expected: usize,
        found: usize,
    },
    #[error("for the modes of {unknowns} unknowns, {source}")]
    TooLittleMemory { unknowns: usize, source: TooLittle },
    #[error(transparent)]
    Factor(#[from] FactorError),
}

/// The `count` lowest modes (all of them where fewer unknowns have mass). An unknown without mass
/// has no entry in its column of the mass, or zero on the diagonal.
///
/// `factor` is the factorisation of `stiffness`. Small problems are solved densely, others by
/// shift-invert Lanczos: [`arpack`], or [`blocks`] where the factor is too large for any cache.
/// Residuals are checked and a Sturm count proves that no mode is missing.
///
/// # Errors
/// See [`EigenError`].
pub fn lowest_modes(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    count: usize,
    factor: &Cholesky,
) -> Result<Modes, EigenError> {
    let none = Modes::none(stiffness.nrows());
    more_modes(stiffness, mass, count, factor, &none)
}

/// Computes [`lowest_modes`] where the lowest of them are `known`: [`blocks`] starts from these,
/// the other methods do not use them.
///
/// # Errors
/// See [`EigenError`].
pub fn more_modes(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    count: usize,
    factor: &Cholesky,
    known: &Modes,
) -> Result<Modes, EigenError> {
    let n = stiffness.nrows();
    if mass.nrows() != n {
        return Err(EigenError::Sizes {
            stiffness: n,
            mass: mass.nrows(),
        });
    }
    let with_mass = (0..n).filter(|&i| has_mass(mass, i)).count();
    let count = count.min(with_mass);
    if count == 0 {
        return Ok(Modes::none(n));
    }
    if with_mass <= arpack::smallest_size(count) {
        return dense::lowest_modes(
            sparse::dense(stiffness).as_ref(),
            sparse::dense(mass).as_ref(),
            count,
        );
    }
    if factor.symbolic().factor_entries() > LARGE_FACTOR {
        return blocks::lowest_modes(stiffness, mass, count, factor, known);
    }
    match arpack::lowest_modes(stiffness, mass, count, factor) {
        // Where some modes are far below all others the space of one vector ends early.
        Err(EigenError::Arpack { .. }) => {
            blocks::lowest_modes(stiffness, mass, count, factor, known)
        }
        outcome => outcome,
    }
}

fn has_mass(mass: &CscMatrix<f64>, unknown: usize) -> bool {
    let column = mass.col(unknown);
    let mut entries = column.row_indices().iter().zip(column.values());
    entries.any(|(&row, &m)| row == unknown && m != 0.0)
}

/// Scales the vectors to unit modal mass, from their products with the mass, and fixes their signs.
/// A modal mass below `least` counts as `least`.
fn normalise(vectors: &mut Mat<f64>, weighted: MatRef<'_, f64>, least: f64) {
    for j in 0..vectors.ncols() {
        let modal_mass = (weighted.col(j).transpose() * vectors.col(j)).max(least);
        let column = vectors.col_as_slice_mut(j);
        column.iter_mut().for_each(|v| *v /= modal_mass.sqrt());
    }
    fix_signs(vectors);
}

/// Turns each vector so that its first entry of at least half the largest magnitude is positive.
fn fix_signs(vectors: &mut Mat<f64>) {
    for j in 0..vectors.ncols() {
        let column = vectors.col_as_slice_mut(j);
        let largest = column
            .iter()
            .fold(0.0f64, |largest, v| largest.max(v.abs()));
        if column
            .iter()
            .find(|v| 2.0 * v.abs() >= largest)
            .is_some_and(|v| *v < 0.0)
        {
            column.iter_mut().for_each(|v| *v = -*v);
        }
    }
}

/// Cantilever of a lattice, as stiffness, mass, and the factor of the stiffness.
#[cfg(test)]
fn cantilever(shape: [usize; 3], irregularity: f64) -> (CscMatrix<f64>, CscMatrix<f64>, Cholesky) {
    let lattice = dovetail_testkit::lattice::Lattice::new(shape, 4e7, 0.1, irregularity);
    let (k, m) = lattice.cantilever();
    let factor = Cholesky::factor(&k).unwrap();
    (k, m, factor)
}

/// `modes` are the `count` lowest of the dense solver, of unit modal mass, and solve K v = omega^2
/// M v.
#[cfg(test)]
fn assert_like_dense(k: &CscMatrix<f64>, m: &CscMatrix<f64>, modes: &Modes, count: usize) {
    let (k, m) = (sparse::dense(k), sparse::dense(m));
    let exact = dense::modes(k.as_ref(), m.as_ref()).unwrap();
    assert_eq!(modes.count(), count);
    for (w2, exact) in modes.omega2.iter().zip(&exact.omega2) {
        assert!((w2 / exact - 1.0).abs() < 1e-10, "{w2} {exact}");
    }
    let gram = modes.vectors.transpose() * (&m * &modes.vectors);
    assert!((gram - Mat::<f64>::identity(count, count)).norm_max() < 1e-10);
    let residual = &k * &modes.vectors
        - Mat::from_fn(k.nrows(), count, |i, j| {
            modes.omega2[j] * (m.row(i) * modes.vectors.col(j))
        });
    assert!(residual.norm_max() < 1e-9 * k.norm_max() * modes.vectors.norm_max());
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Springs that all differ, and a square section of equal ones, whose bending modes come in
    /// equal pairs. An odd count cuts one.
    #[test]
    fn both_lanczos_methods_find_the_modes_of_the_dense_solver_repeated_ones_too() {
        let irregular = [([9, 4, 3], 12), ([9, 5, 4], 12), ([12, 6, 5], 30)];
        let irregular = irregular.map(|(shape, count)| (shape, 0.6, count));
        let equal = [7, 12, 21].map(|count| ([9, 4, 4], 0.0, count));
        for (shape, irregularity, count) in irregular.into_iter().chain(equal) {
            let (k, m, factor) = cantilever(shape, irregularity);
            assert!(k.nrows() > arpack::smallest_size(count));
            let none = Modes::none(k.nrows());
            for modes in [
                arpack::lowest_modes(&k, &m, count, &factor),
                blocks::lowest_modes(&k, &m, count, &factor, &none),
            ] {
                assert_like_dense(&k, &m, &modes.unwrap(), count);
            }
        }
    }

    #[test]
    fn the_first_large_entry_decides_the_sign() {
        let columns = [
            [0.1, -0.6, 1.0],
            [-0.1, 0.6, -1.0],
            [-0.4, 1.0, -1.0],
            [0.0; 3],
        ];
        let mut vectors = Mat::from_fn(3, 4, |i, j| columns[j][i]);
        fix_signs(&mut vectors);
        assert_eq!(vectors.col_as_slice(0), [-0.1, 0.6, -1.0]);
        assert_eq!(vectors.col_as_slice(1), [-0.1, 0.6, -1.0]);
        assert_eq!(vectors.col_as_slice(2), [-0.4, 1.0, -1.0]);
        assert_eq!(vectors.col_as_slice(3), [0.0; 3]);
    }

    /// A third of the unknowns has no mass: the modes are those of the rest, with the third
    /// condensed out.
    #[test]
    fn unknowns_without_mass_follow_the_others() {
        let (k, mut m, factor) = cantilever([12, 5, 4], 0.3);
        let n = k.nrows();
        let without = |i: usize| i % 3 == 1;
        for (j, mut column) in m.col_iter_mut().enumerate() {
            let (rows, values) = column.rows_and_values_mut();
            for (&i, v) in rows.iter().zip(values) {
                *v *= f64::from(u8::from(!without(i) && !without(j)));
            }
        }
        let [with, without]: [Vec<usize>; 2] =
            [false, true].map(|none| (0..n).filter(|&i| without(i) == none).collect());
        let part = |a: &CscMatrix<f64>, rows: &[usize], columns: &[usize]| {
            sparse::dense(&sparse::submatrix(a, rows, columns))
        };
        let mut followed = part(&k, &without, &with);
        let inner = dense::cholesky(part(&k, &without, &without).as_ref()).unwrap();
        crate::dense::solve_in_place(inner.as_ref(), followed.as_mut());
        let condensed = part(&k, &with, &with) - part(&k, &with, &without) * followed;
        let exact = dense::modes(condensed.as_ref(), part(&m, &with, &with).as_ref()).unwrap();
        let count = 8;
        let found = [
            arpack::lowest_modes(&k, &m, count, &factor).unwrap(),
            blocks::lowest_modes(&k, &m, count, &factor, &Modes::none(n)).unwrap(),
            lowest_modes(&k, &m, count, &factor).unwrap(),
            lowest_modes(&k, &m, with.len() - 20, &factor).unwrap(),
            lowest_modes(&k, &m, n, &factor).unwrap(),
        ];
        let counts = found.each_ref().map(Modes::count);
        assert_eq!(counts, [8, 8, 8, with.len() - 20, with.len()]);
        for modes in found {
            for (j, (w2, exact)) in modes.omega2.iter().zip(&exact.omega2).enumerate() {
                assert!((w2 / exact - 1.0).abs() < 1e-9, "mode {j}: {w2} {exact}");
            }
            let weighted = sparse::times(&m, modes.vectors.as_ref());
            let residual = sparse::times(&k, modes.vectors.as_ref())
                - Mat::from_fn(n, modes.count(), |i, j| modes.omega2[j] * weighted[(i, j)]);
            assert!(residual.norm_max() < 1e-8 * sparse::dense(&k).norm_max());
        }
    }
}
