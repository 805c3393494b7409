//! Shift-invert Lanczos about zero with ARPACK (Lehoucq, Sorensen, Yang, ARPACK Users' Guide, 1998:
//! dsaupd in mode 3, generalised problem); `sturm.rs` checks the result.
//!
//! ARPACK keeps its state in static variables: two runs at once corrupt the heap. A lock of the
//! whole process is held over a run; inside it nothing may wait for the thread pool, because the
//! pool could start another run on the thread that holds the lock.

#![expect(unsafe_code, reason = "calls of a foreign library")]

use std::ffi::{CStr, c_int};
use std::sync::{Mutex, Once, PoisonError};

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;

use super::iteration::{FoundModes, SPARE, start_entry};
use super::{EigenError, Modes};
use crate::sparse::{self, Cholesky};
use crate::vector::dot;

static ONE_RUN_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Size up to which problems are left to the dense solver: the Lanczos basis would span them.
pub(super) fn smallest_size(count: usize) -> usize {
    3 * basis(count + SPARE)
}

fn basis(wanted: usize) -> usize {
    (2 * wanted + 4).max(20)
}

/// The lowest modes of one ARPACK run.
pub(super) fn lowest(
    mass: &CscMatrix<f64>,
    factor: &Cholesky,
    wanted: usize,
) -> Result<FoundModes, EigenError> {
    let n = mass.nrows();
    let wanted = wanted.min(n - 2);
    let vectors = basis(wanted).min(n - 1);
    Ok(FoundModes {
        modes: lanczos(mass, factor, wanted, vectors)?,
        columns: vectors,
        exhausted: false,
    })
}

/// One ARPACK run: `wanted` modes with a basis of `vectors`, unsorted signs.
fn lanczos(
    mass: &CscMatrix<f64>,
    factor: &Cholesky,
    wanted: usize,
    vectors: usize,
) -> Result<Modes, EigenError> {
    let mut run = ArpackRun::new(mass.nrows(), wanted, vectors)?;
    let _alone = ONE_RUN_AT_A_TIME
        .lock()
        .unwrap_or_else(PoisonError::into_inner);
    blas_on_one_thread();
    run.iterate(mass, factor)?;
    let (omega2, modes) = run.extract()?;
    let modes = MatRef::from_column_major_slice(&modes, mass.nrows(), wanted);
    let mut ascending: Vec<usize> = (0..wanted).collect();
    ascending.sort_by(|&a, &b| omega2[a].total_cmp(&omega2[b]));
    Ok(Modes {
        omega2: ascending.iter().map(|&i| omega2[i]).collect(),
        vectors: Mat::from_fn(mass.nrows(), wanted, |i, j| modes[(i, ascending[j])]),
    })
}

/// Restricts OpenBLAS, where it is ARPACK's BLAS, to one thread. It shares its sums among all
/// cores, and they round differently for each number of cores. On one thread the results are the
/// same on every machine with the same processor.
fn blas_on_one_thread() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        if let Some(set) = function(c"openblas_set_num_threads") {
            // SAFETY: OpenBLAS declares it as void openblas_set_num_threads(int).
            let set: extern "C" fn(c_int) = unsafe { std::mem::transmute(set) };
            set(1);
        }
    });
}

/// Function of a loaded library, by its name.
fn function(name: &CStr) -> Option<*mut std::ffi::c_void> {
    // SAFETY: the name ends with a zero byte; the default handle is always valid.
    let symbol = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) };
    (!symbol.is_null()).then_some(symbol)
}

const PROBLEM: &CStr = c"G"; // generalised
const WHICH: &CStr = c"LM"; // the largest of the inverse

/// Arrays that ARPACK works on, of the lengths that the Users' Guide requires: resid n, v n x ncv,
/// workd 3n, workl ncv (ncv + 8), iparam and ipntr 11.
struct ArpackRun {
    n: usize,
    wanted: usize,
    vectors: usize,
    /// Numbers n, wanted and vectors as integers of ARPACK.
    counts: [c_int; 3],
    residual: Vec<f64>,
    basis: Vec<f64>,
    work_vectors: Vec<f64>,
    work_small: Vec<f64>,
    iparam: [c_int; 11],
    ipntr: [c_int; 11],
}

impl ArpackRun {
    fn new(n: usize, wanted: usize, vectors: usize) -> Result<Self, EigenError> {
        let too_large = |_| EigenError::TooLarge { unknowns: n };
        let mut iparam: [c_int; 11] = [0; 11];
        iparam[0] = 1; // exact shifts
        iparam[2] = 1000; // restarts at most
        iparam[3] = 1; // block size, the only one there is
        iparam[6] = 3; // shift-invert
        Ok(Self {
            n,
            wanted,
            vectors,
            counts: [
                c_int::try_from(n).map_err(too_large)?,
                wanted as c_int,
                vectors as c_int,
            ],
            residual: (0..n).map(|i| start_entry(i, 0)).collect(),
            basis: vec![0.0; n * vectors],
            work_vectors: vec![0.0; 3 * n],
            work_small: vec![0.0; vectors * (vectors + 8)],
            iparam,
            ipntr: [0; 11],
        })
    }

    /// Runs dsaupd until it has converged. The lock is held.
    fn iterate(&mut self, mass: &CscMatrix<f64>, factor: &Cholesky) -> Result<(), EigenError> {
        let n = self.n;
        let [order, columns, basis_columns] = self.counts;
        let mut product = vec![0.0; n];
        let (mut ido, mut info): (c_int, c_int) = (0, 1); // info = 1: start from `residual`
        loop {
            // SAFETY: all arrays have the lengths that the Users' Guide asks for (see `ArpackRun`), live
            // across the loop, and are touched by no one else; the lock keeps ARPACK's static state
            // to this run; the strings are constants.
            unsafe {
                arpack_sys::dsaupd_c(
                    &mut ido,
                    CStr::as_ptr(PROBLEM),
                    order,
                    CStr::as_ptr(WHICH),
                    columns,
                    0.0,
                    self.residual.as_mut_ptr(),
                    basis_columns,
                    self.basis.as_mut_ptr(),
                    order,
                    self.iparam.as_mut_ptr(),
                    self.ipntr.as_mut_ptr(),
                    self.work_vectors.as_mut_ptr(),
                    self.work_small.as_mut_ptr(),
                    self.work_small.len() as c_int,
                    &mut info,
                );
            }
            // ipntr counts from 1.
            let at = |i: usize| (self.ipntr[i] as usize).wrapping_sub(1);
            let vector = |i: usize| &self.work_vectors[at(i)..at(i) + n];
            match ido {
                // y = K^-1 M x
                -1 => {
                    sparse::symmetric_times(mass, vector(0), &mut product);
                    factor.solve_vector(&mut product);
                }
                // y = K^-1 (M x), M x given
                1 => {
                    product.copy_from_slice(vector(2));
                    factor.solve_vector(&mut product);
                }
                // y = M x
                2 => sparse::symmetric_times(mass, vector(0), &mut product),
                _ => break,
            }
            // ARPACK takes norms of both. From numbers that overflow LAPACK ends the process.
            let is_norm = |v: &[f64]| dot(v, v).is_finite() && dot(v, &product).is_finite();
            if !is_norm(vector(0)) || !is_norm(&product) {
                return Err(EigenError::Overflow);
            }
            let y = at(1);
            self.work_vectors[y..y + n].copy_from_slice(&product);
        }
        // 1: out of restarts. Fewer modes than wanted converged; the caller iterates in blocks.
        if info != 0 || (self.iparam[4] as usize) < self.wanted {
            return Err(EigenError::Arpack {
                routine: "dsaupd",
                info,
            });
        }
        Ok(())
    }

    /// Squared frequencies and modes, one after the other, of a run that has converged. The lock is
    /// still held.
    fn extract(mut self) -> Result<(Vec<f64>, Vec<f64>), EigenError> {
        let [order, columns, basis_columns] = self.counts;
        let select = vec![0 as c_int; self.vectors];
        let mut omega2 = vec![0.0; self.wanted];
        let mut modes = vec![0.0; self.n * self.wanted];
        let mut info = 0;
        // SAFETY: as in `iterate`; d holds nev numbers, z n x nev, select ncv; the arrays of the
        // finished dsaupd run are passed on unchanged, as the Users' Guide demands.
        unsafe {
            arpack_sys::dseupd_c(
                1,
                CStr::as_ptr(c"A"),
                select.as_ptr(),
                omega2.as_mut_ptr(),
                modes.as_mut_ptr(),
                order,
                0.0,
                CStr::as_ptr(PROBLEM),
                order,
                CStr::as_ptr(WHICH),
                columns,
                0.0,
                self.residual.as_mut_ptr(),
                basis_columns,
                self.basis.as_mut_ptr(),
                order,
                self.iparam.as_mut_ptr(),
                self.ipntr.as_mut_ptr(),
                self.work_vectors.as_mut_ptr(),
                self.work_small.as_mut_ptr(),
                self.work_small.len() as c_int,
                &mut info,
            );
        }
        if info != 0 {
            return Err(EigenError::Arpack {
                routine: "dseupd",
                info,
            });
        }
        Ok((omega2, modes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eigen::sturm::complete;
    use crate::eigen::{
        LastModes, Pencil, assert_like_dense, cantilever, lowest_modes as lowest_of,
    };

    #[test]
    fn openblas_where_it_is_the_blas_has_one_thread() {
        blas_on_one_thread();
        if let Some(get) = function(c"openblas_get_num_threads") {
            // SAFETY: OpenBLAS declares it as int openblas_get_num_threads(void).
            let get: extern "C" fn() -> c_int = unsafe { std::mem::transmute(get) };
            assert_eq!(get(), 1);
        }
        assert!(
            function(c"dsaupd_c").is_some(),
            "ARPACK is not found by name"
        );
    }

    #[test]
    fn runs_are_the_same_to_the_bit_even_side_by_side() {
        let (k, m, _) = cantilever([9, 4, 3], 0.6);
        let run = || lowest_of(&k, &m, 6, &Cholesky::factor(&k).unwrap()).unwrap();
        let first = run();
        let (a, b) = rayon::join(run, run);
        for other in [a, b] {
            assert_eq!(first.omega2, other.omega2);
            assert_eq!(first.vectors, other.vectors);
        }
    }

    /// LAPACK ends the process at numbers that are not finite.
    #[test]
    fn numbers_that_overflow_are_an_error() {
        let (_, m, factor) = cantilever([9, 4, 3], 0.6);
        for scale in [1e120, 1e200, 1e300] {
            let mut heavy = m.clone();
            heavy.values_mut().iter_mut().for_each(|v| *v *= scale);
            let found = lowest(&heavy, &factor, 6);
            assert!(matches!(found, Err(EigenError::Overflow)), "{scale:e}");
        }
    }

    #[test]
    fn none_all_and_too_many_modes() {
        let (k, m, factor) = cantilever([3, 2, 2], 0.1);
        for (asked, given) in [(0, 0), (1, 1), (24, 24), (99, 24)] {
            let modes = lowest_of(&k, &m, asked, &factor).unwrap();
            assert_eq!((modes.count(), modes.vectors.ncols()), (given, given));
        }
        assert!(matches!(
            lowest_of(&k, &CscMatrix::identity(5), 1, &factor),
            Err(EigenError::Sizes { .. })
        ));
    }

    #[test]
    fn a_mode_that_an_iteration_misses_is_found() {
        let (k, m, factor) = cantilever([9, 4, 3], 0.6);
        let pencil = Pencil {
            stiffness: &k,
            mass: &m,
            factor: &factor,
        };
        let without = |missed: [usize; 2]| {
            let modes = lanczos(&m, &factor, 10, 24)?;
            let keep: Vec<usize> = (0..10).filter(|i| !missed.contains(i)).collect();
            Ok(FoundModes {
                modes: Modes {
                    omega2: keep.iter().map(|&i| modes.omega2[i]).collect(),
                    vectors: Mat::from_fn(k.nrows(), 8, |i, j| modes.vectors[(i, keep[j])]),
                },
                columns: 24,
                exhausted: false,
            })
        };
        let none = Modes::none(k.nrows());
        for missed in [[0, 1], [2, 5]] {
            let modes = complete(&pencil, 6, LastModes::Given, &none, |_| without(missed)).unwrap();
            assert_like_dense(&k, &m, &modes, 6);
        }
    }
}
