//! The balance of one frequency, for solvers of one's own.

use std::sync::{Arc, Mutex, PoisonError};

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays::{real_vector, table, vector};
use crate::errors;
use crate::motion::PyMotion;
use crate::running::watched;
use crate::subject::ResultSubject;
use dovetail_solver::dlft::balance::{Balance, Jacobian};
use dovetail_solver::dlft::orbit::orbit;
use dovetail_solver::dlft::{Outcome, StaticState};

/// Most entries of a Jacobian that is made as a matrix.
const MOST_DENSE: usize = 1 << 28;

/// Harmonic balance of one frequency: `f(U) = Lambda U + lambda(U) - F`, with its exact Jacobian.
///
/// U has 2H+1 blocks of 3 unknowns a pair, m: the mean, then cosine and sine of each harmonic; in a
/// block n, t1, t2 of each pair. It is real, and so is the residual, in N. `docs/method.md` has the
/// equations. The functions release the lock of the interpreter, and give the bits of the library.
#[pyclass(frozen, name = "Balance", module = "dovetail")]
pub struct PyBalance {
    pub subject: Arc<ResultSubject>,
    pub state: Arc<StaticState>,
    pub balance: Balance,
    pub frequency_hz: f64,
    pub harmonics: usize,
    /// The Jacobian that was asked for last, and its U.
    pub last: Mutex<Option<(Vec<f64>, Arc<Jacobian>)>>,
}

impl PyBalance {
    fn vector_of(&self, name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
        real_vector(name, given, self.balance.unknowns())
    }

    /// Does what may take long on another thread, so that a panic is an exception.
    fn run_detached<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce() -> T + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)));
        done.map_err(|payload| errors::panic_error(payload.as_ref()))
    }

    /// Result of a function of the balance, as [`Self::run_detached`] gives it.
    fn evaluate_balance<T: Send>(
        &self,
        py: Python<'_>,
        function: impl FnOnce(&Balance) -> T + Send,
    ) -> PyResult<T> {
        self.run_detached(py, || function(&self.balance))
    }

    fn jacobian_at(&self, u: &[f64]) -> Arc<Jacobian> {
        let lock = || self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((at, jacobian)) = &*lock()
            && at == u
        {
            return Arc::clone(jacobian);
        }
        let balance = &self.balance;
        let jacobian = Arc::new(balance.linearise(&balance.evaluate(u)));
        *lock() = Some((u.to_vec(), Arc::clone(&jacobian)));
        jacobian
    }

    fn product(&self, jacobian: &Jacobian, v: &[f64]) -> Vec<f64> {
        self.balance.jacobian_times(jacobian, v)
    }
}

#[pymethods]
impl PyBalance {
    fn __repr__(&self) -> String {
        format!(
            "<dovetail.Balance at {} Hz: {} harmonics, {} unknowns>",
            self.frequency_hz,
            self.harmonics,
            self.balance.unknowns()
        )
    }

    /// Frequency of the first harmonic, Hz.
    #[getter]
    fn frequency_hz(&self) -> f64 {
        self.frequency_hz
    }

    /// Number of harmonics besides the mean, H.
    #[getter]
    fn harmonics(&self) -> usize {
        self.harmonics
    }

    /// Number of unknowns, (2H+1) 3 pairs.
    #[getter]
    fn unknowns(&self) -> usize {
        self.balance.unknowns()
    }

    /// Shape of the unknowns as blocks, pairs and components: (2H+1, pairs, 3).
    #[getter]
    fn shape(&self) -> (usize, usize, usize) {
        (2 * self.harmonics + 1, self.subject.pair_count(), 3)
    }

    /// Parameter eps of DLFT of each unknown of a block, N/m, (3 pairs,).
    #[getter]
    fn eps<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.balance.setting.eps.to_vec())
    }

    /// Load F, N, (unknowns,): the steady load and the excitations, condensed on the pairs.
    #[getter]
    fn force_n<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, self.evaluate_balance(py, |b| b.force.clone())?))
    }

    /// The static state as U, m, (unknowns,): a motion to begin with.
    #[getter]
    fn at_rest<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let mut u = self.state.x.clone();
        u.resize(self.balance.unknowns(), 0.0);
        vector(py, u)
    }

    /// Residual f(U), N, (unknowns,).
    fn residual<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let u = self.vector_of("u", u)?;
        Ok(vector(
            py,
            self.evaluate_balance(py, |b| b.evaluate(&u).residual)?,
        ))
    }

    /// Contact forces lambda(U), N, (unknowns,).
    fn contact_force_n<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let u = self.vector_of("u", u)?;
        Ok(vector(
            py,
            self.evaluate_balance(py, |b| b.evaluate(&u).lambda)?,
        ))
    }

    /// Product Lambda v of the dynamic stiffness, N, (unknowns,).
    fn stiffness_times<'py>(
        &self,
        py: Python<'py>,
        v: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let v = self.vector_of("v", v)?;
        let product = self.evaluate_balance(py, |b| {
            let mut out = vec![0.0; v.len()];
            b.apply_stiffness(&v, &mut out);
            out
        })?;
        Ok(vector(py, product))
    }

    /// Product J v of the Jacobian at U, N, (unknowns,). The Jacobian of the last U is kept.
    fn jacobian_times<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (u, v) = (self.vector_of("u", u)?, self.vector_of("v", v)?);
        let product = self.run_detached(py, || self.product(&self.jacobian_at(&u), &v))?;
        Ok(vector(py, product))
    }

    /// Jacobian at U as a matrix, N/m, (unknowns, unknowns), for few unknowns.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let u = self.vector_of("u", u)?;
        let size = u.len();
        if size.pow(2) > MOST_DENSE {
            return Err(errors::value(format!(
                "a Jacobian of {size} unknowns is too large for a matrix: take jacobian_times with a Krylov method, \
                 such as scipy.sparse.linalg.gmres"
            )));
        }
        let values = self.run_detached(py, || {
            let jacobian = self.jacobian_at(&u);
            let mut values = vec![0.0; size * size];
            let mut unit = vec![0.0; size];
            for j in 0..size {
                unit[j] = 1.0;
                for (i, v) in self.product(&jacobian, &unit).into_iter().enumerate() {
                    values[i * size + j] = v;
                }
                unit[j] = 0.0;
            }
            values
        })?;
        table(py, [size, size], values)
    }

    /// Motion of U with its amplitudes, powers and the cycle of each pair, whether or not U solves
    /// the balance: `Motion.residual` has |f| / |F|.
    fn motion(&self, py: Python<'_>, u: &Bound<'_, PyAny>) -> PyResult<PyMotion> {
        let u = self.vector_of("u", u)?;
        let outcome = self.evaluate_balance(py, |b| {
            let evaluation = b.evaluate(&u);
            let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
            let residual = size(&evaluation.residual) / size(&b.force).max(f64::MIN_POSITIVE);
            let mut motion = orbit(b, &u, &evaluation, self.frequency_hz, Outcome::Converged);
            motion.residual = residual;
            motion
        })?;
        Ok(PyMotion::isolated(outcome, &self.subject))
    }
}

/// Work that may take long, without a bar.
pub fn quietly<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    Ok(watched(py, None, |_| work())?.0)
}
