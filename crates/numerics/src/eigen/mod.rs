//! Natural modes: the lowest solutions of K phi = omega^2 M phi, with K symmetric positive
//! definite, and M too except for unknowns without mass.
//!
//! [`lowest_modes`] chooses the method: [`dense`] for small problems, otherwise Lanczos iteration
//! with K factored, one vector at a time ([`modes_by_arpack`]) or in blocks if the factor is large
//! ([`modes_by_blocks`]). `sturm.rs` judges the modes, proves that none is missing, and finds missing ones.
//! [`coarse_space()`] is something else: rough modes of a dense matrix, for a preconditioner.
//!
//! Start vectors, sizes of blocks and the sizes that choose the method decide the last bits of the
//! modes. `arpack.rs` has the only `unsafe` code of the libraries, and a lock, because ARPACK keeps
//! its state in static variables.

mod arpack;
mod blocks;
mod coarse_space;
pub mod dense;
mod iteration;
mod orthonormal;
mod sturm;

pub use coarse_space::{CoarseSpace, coarse_space, factor_order, independent};

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;

use blocks::IterationTask;
use sturm::complete;

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

    /// The `count` lowest of these modes.
    pub fn lowest(&self, count: usize) -> Self {
        Self {
            omega2: self.omega2[..count].to_vec(),
            vectors: self.vectors.get(.., ..count).to_owned(),
        }
    }

    /// Frequencies `sqrt(omega2) / (2 pi)`, Hz.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        self.omega2
            .iter()
            .map(|w2| w2.sqrt() / std::f64::consts::TAU)
            .collect()
    }
}

/// End of a list of the lowest modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LastModes {
    /// As many modes as are asked for.
    Given,
    /// The modes that are equal to the last one follow it.
    WithEqual,
}

/// Stiffness and mass, with the factor of the stiffness.
#[derive(Debug, Clone, Copy)]
struct Pencil<'a> {
    stiffness: &'a CscMatrix<f64>,
    mass: &'a CscMatrix<f64>,
    factor: &'a Cholesky,
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
    #[error(
        "the iteration for the modes overflows: the stiffness and the mass differ by too many orders of magnitude; check the densities, Young's moduli and the units"
    )]
    Overflow,
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
        "rounding of the stiffness changes the squared frequency of mode {mode} by about {residual:.1e} of it: the springs or supports that hold its motion are too soft beside the other stiffness; make them stiffer, or hold the motion"
    )]
    Rounding { mode: usize, residual: f64 },
    #[error(
        "a Sturm count finds {expected} modes below {below:.6e} rad2/s2, the iteration {found} after all tries; ask for a few more or fewer modes, and check that the mass is positive"
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

/// The `count` lowest modes (all of them where fewer motions have mass). An unknown without mass has no
/// entry in its column of the mass, or zero on the diagonal.
///
/// `factor` is the factorisation of `stiffness`. Small problems are solved densely, others by
/// shift-invert Lanczos: [`modes_by_arpack`], or [`modes_by_blocks`] if the factor is too large for any
/// cache.
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
    more_modes(stiffness, mass, count, factor, &none, LastModes::Given)
}

/// Computes [`lowest_modes`], or a few more as `last` says. The lowest of them are `known`:
/// [`modes_by_blocks`] starts from these, the other methods do not use them.
///
/// # Errors
/// See [`EigenError`].
pub fn more_modes(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    count: usize,
    factor: &Cholesky,
    known: &Modes,
    last: LastModes,
) -> Result<Modes, EigenError> {
    let n = stiffness.nrows();
    if mass.nrows() != n {
        return Err(EigenError::Sizes {
            stiffness: n,
            mass: mass.nrows(),
        });
    }
    let with_mass = unknowns_with_mass(mass);
    let count = count.min(with_mass);
    if count == 0 {
        return Ok(Modes::none(n));
    }
    if with_mass <= arpack::smallest_size(count) {
        return dense::lowest_modes(
            sparse::dense(stiffness).as_ref(),
            sparse::dense(mass).as_ref(),
            count,
            last,
        );
    }
    if factor.symbolic().factor_entries() > LARGE_FACTOR {
        return modes_by_blocks(stiffness, mass, count, factor, known, last);
    }
    modes_by_arpack(stiffness, mass, count, factor, last)
}

/// Computes [`more_modes`] of a problem that is not small by ARPACK. Modes that ARPACK misses are found
/// in blocks.
///
/// # Errors
/// [`EigenError::Arpack`], [`EigenError::Residual`], [`EigenError::Missing`] after three rounds without
/// a further mode; errors of the factorisation of K - sigma M.
pub fn modes_by_arpack(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    count: usize,
    factor: &Cholesky,
    last: LastModes,
) -> Result<Modes, EigenError> {
    let none = Modes::none(stiffness.nrows());
    let pencil = Pencil {
        stiffness,
        mass,
        factor,
    };
    complete(&pencil, count, last, &none, |wanted| {
        arpack::lowest(mass, factor, wanted)
    })
}

/// Computes [`more_modes`] in blocks. The basis begins with the modes that are `known`, the lowest ones.
///
/// # Errors
/// [`EigenError::Basis`], [`EigenError::Residual`], [`EigenError::Missing`] after three rounds without
/// a further mode; errors of the factorisation of K - sigma M.
pub fn modes_by_blocks(
    stiffness: &CscMatrix<f64>,
    mass: &CscMatrix<f64>,
    count: usize,
    factor: &Cholesky,
    known: &Modes,
    last: LastModes,
) -> Result<Modes, EigenError> {
    let pencil = Pencil {
        stiffness,
        mass,
        factor,
    };
    complete(&pencil, count, last, known, |wanted| {
        let search = IterationTask::first(known, wanted.min(mass.nrows()));
        blocks::lanczos(mass, factor, &search)
    })
}

/// Number of unknowns that have mass.
pub fn unknowns_with_mass(mass: &CscMatrix<f64>) -> usize {
    (0..mass.ncols()).filter(|&i| has_mass(mass, i)).count()
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

    /// Both Lanczos methods.
    fn run_lanczos_methods(
        k: &CscMatrix<f64>,
        m: &CscMatrix<f64>,
        count: usize,
        last: LastModes,
    ) -> [Result<Modes, EigenError>; 2] {
        let factor = Cholesky::factor(k).unwrap();
        assert!(k.nrows() > arpack::smallest_size(count));
        let none = Modes::none(k.nrows());
        [
            modes_by_arpack(k, m, count, &factor, last),
            modes_by_blocks(k, m, count, &factor, &none, last),
        ]
    }

    /// Springs that all differ, and a square section of equal ones, whose bending modes come in
    /// equal pairs. An odd count cuts one.
    #[test]
    fn both_lanczos_methods_find_the_modes_of_the_dense_solver_repeated_ones_too() {
        let irregular = [([9, 4, 3], 12), ([9, 5, 4], 12), ([12, 6, 5], 30)];
        let irregular = irregular.map(|(shape, count)| (shape, 0.6, count));
        let equal = [7, 12, 21].map(|count| ([9, 4, 4], 0.0, count));
        for (shape, irregularity, count) in irregular.into_iter().chain(equal) {
            let (k, m, _) = cantilever(shape, irregularity);
            for modes in run_lanczos_methods(&k, &m, count, LastModes::Given) {
                assert_like_dense(&k, &m, &modes.unwrap(), count);
            }
        }
    }

    /// So many copies of a matrix on the diagonal of one.
    fn copies(a: &CscMatrix<f64>, count: usize) -> CscMatrix<f64> {
        let n = a.nrows();
        let mut all = nalgebra_sparse::CooMatrix::new(count * n, count * n);
        for copy in 0..count {
            for (i, j, v) in a.triplet_iter() {
                all.push(copy * n + i, copy * n + j, *v);
            }
        }
        CscMatrix::from(&all)
    }

    /// Blades of square section that nothing joins: their bending modes come twice for each blade.
    #[test]
    fn all_copies_of_the_modes_of_equal_blades_are_found() {
        let (k, m, _) = cantilever([5, 3, 3], 0.0);
        let own = dense::modes(sparse::dense(&k).as_ref(), sparse::dense(&m).as_ref()).unwrap();
        assert!((own.omega2[1] / own.omega2[0] - 1.0).abs() < 1e-9);
        for (blades, count, last) in [
            (12, 5, LastModes::Given),
            (12, 30, LastModes::WithEqual),
            (24, 60, LastModes::Given),
            (24, 1, LastModes::WithEqual),
            (100, 12, LastModes::WithEqual),
        ] {
            let (k, m) = (copies(&k, blades), copies(&m, blades));
            let all = own.omega2.iter().flat_map(|w2| vec![*w2; blades]);
            let all: Vec<f64> = all.collect();
            let expected = match last {
                LastModes::Given => count,
                LastModes::WithEqual => {
                    all.partition_point(|w2| *w2 <= all[count - 1] * (1.0 + 1e-9))
                }
            };
            for modes in run_lanczos_methods(&k, &m, count, last) {
                let modes = modes.unwrap();
                assert_eq!(modes.count(), expected, "{blades} blades, {count}");
                for (i, (w2, exact)) in modes.omega2.iter().zip(&all).enumerate() {
                    assert!((w2 / exact - 1.0).abs() < 1e-9, "{i}: {w2} {exact}");
                }
                let weighted = sparse::times(&m, modes.vectors.as_ref());
                let gram = modes.vectors.transpose() * weighted;
                let unit = Mat::<f64>::identity(expected, expected);
                assert!((gram - unit).norm_max() < 1e-9);
            }
        }
    }

    /// A block that nothing holds but soft springs to ground on all its nodes: its three translations lie
    /// far below the other modes, which the block has by itself. Its springs resist turning.
    #[test]
    fn rigid_motions_on_soft_springs_and_elastic_modes_have_their_own_scales() {
        let lattice = dovetail_testkit::lattice::Lattice::new([9, 5, 4], 4e7, 0.1, 0.6);
        let number: Vec<_> = (0..lattice.nodes()).map(Some).collect();
        let (k, m) = lattice.matrices(&number, lattice.nodes());
        let elastic = |spring: f64| {
            // Springs in proportion to the mass: each squared frequency grows by `spring`.
            let k = sparse::sum(&k, spring, &m);
            dense::modes(sparse::dense(&k).as_ref(), sparse::dense(&m).as_ref()).unwrap()
        };
        let stiff = 1e6;
        let first = elastic(stiff).omega2[3] - stiff;
        for ratio in [1e-4, 1e-8, 1e-10] {
            let spring = ratio * first;
            let held = sparse::sum(&k, spring, &m);
            for (method, modes) in run_lanczos_methods(&held, &m, 12, LastModes::Given)
                .into_iter()
                .enumerate()
            {
                let modes = modes.unwrap();
                for (i, w2) in modes.omega2.iter().enumerate() {
                    let (exact, tolerance) = match i < 3 {
                        true => (spring, 2e-14 / ratio + 1e-9),
                        false => (elastic(stiff).omega2[i] - stiff + spring, 1e-7),
                    };
                    let error = (w2 / exact - 1.0).abs();
                    assert!(error < tolerance, "{ratio:e} {method} {i}: {error:e}");
                }
            }
        }
    }

    /// A mass that moves with many unknowns, and no other: it has six motions.
    #[test]
    fn a_mass_of_few_motions_has_few_modes() {
        let (k, _, factor) = cantilever([9, 5, 4], 0.3);
        let n = k.nrows();
        let carried = Mat::from_fn(n, 6, |i, j| dovetail_testkit::lattice::scattered(i + n * j));
        let dense_mass = &carried * carried.transpose();
        let mut m = nalgebra_sparse::CooMatrix::new(n, n);
        for j in 0..n {
            for i in 0..n {
                m.push(i, j, dense_mass[(i, j)]);
            }
        }
        let m = CscMatrix::from(&m);
        let mut answers = carried.clone();
        factor.solve_in_place(answers.as_mut());
        let exact =
            crate::dense::self_adjoint_eigenvalues((carried.transpose() * answers).as_ref());
        let exact: Vec<f64> = exact.unwrap().iter().rev().map(|x| x.recip()).collect();
        let none = Modes::none(n);
        for modes in [
            modes_by_arpack(&k, &m, 12, &factor, LastModes::Given),
            modes_by_blocks(&k, &m, 12, &factor, &none, LastModes::Given),
            lowest_modes(&k, &m, 12, &factor),
            lowest_modes(&k, &m, n, &factor),
        ] {
            let modes = modes.unwrap();
            assert_eq!(modes.count(), 6);
            for (w2, exact) in modes.omega2.iter().zip(&exact) {
                assert!((w2 / exact - 1.0).abs() < 1e-9, "{w2} {exact}");
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
            modes_by_arpack(&k, &m, count, &factor, LastModes::Given).unwrap(),
            modes_by_blocks(&k, &m, count, &factor, &Modes::none(n), LastModes::Given).unwrap(),
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
