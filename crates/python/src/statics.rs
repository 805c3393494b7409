//! The static state under the steady load.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{table, vector, vector_array};
use crate::subject::{ResultSubject, missing_recovery_error};
use dovetail_solver::dlft::{PairStatus, StaticState};
use dovetail_solver::results::modes::hertz;

/// Static state with friction, which the vibration is about.
#[pyclass(frozen, name = "StaticState", module = "dovetail")]
pub struct PyStaticState {
    pub state: Arc<StaticState>,
    pub subject: Arc<ResultSubject>,
}

#[pymethods]
impl PyStaticState {
    fn __repr__(&self) -> String {
        let counts = self.state.counts();
        format!(
            "<dovetail.StaticState: {}, {} stuck, {} slipping, {} open pairs>",
            self.state.outcome, counts.stuck, counts.slipping, counts.open
        )
    }

    /// Outcome of the solution: `converged`, or why there is none.
    #[getter]
    fn outcome(&self) -> String {
        self.state.outcome.to_string()
    }

    /// True if there is a static state.
    #[getter]
    fn converged(&self) -> bool {
        self.state.outcome.is_converged()
    }

    /// Displacement of the first flank relative to the second, m, (pairs, 3): n, t1, t2.
    #[getter]
    fn relative_displacement_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(py, [self.state.x.len() / 3, 3], self.state.x.clone())
    }

    /// Contact forces, N, (pairs, 3): n, t1, t2; below zero along n is compression.
    #[getter]
    fn contact_force_n<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        table(
            py,
            [self.state.lambda.len() / 3, 3],
            self.state.lambda.clone(),
        )
    }

    /// Pressure on each pair, Pa, (pairs,); NaN where areas are not known.
    #[getter]
    fn pressure_pa<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let normal = self.state.lambda.chunks_exact(3).map(|l| 0.0 - l[0]);
        let areas = self.subject.areas_m2();
        vector(py, normal.zip(areas).map(|(f, area)| f / area).collect())
    }

    /// What each pair does: `stuck`, `slipping` (friction is at its limit) or `open`.
    #[getter]
    fn status(&self) -> Vec<&'static str> {
        let word = |status: &PairStatus| match status {
            PairStatus::Stuck => "stuck",
            PairStatus::Slipping => "slipping",
            PairStatus::Open => "open",
        };
        self.state.status.iter().map(word).collect()
    }

    /// Natural frequencies of small vibrations about this state, Hz, ascending: open pairs are
    /// released, and all others stick.
    #[getter]
    fn linear_frequency_hz<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let reduced = &self.subject.problem.reduced;
        let omega2 = self.state.linear.omega2_of_first_harmonic(reduced);
        vector(py, omega2.into_iter().map(hertz).collect())
    }

    /// Newton iterations of all steps of the load.
    #[getter]
    fn newton_iterations(&self) -> usize {
        self.state.newton_iterations
    }

    /// Relative residual.
    #[getter]
    fn residual(&self) -> f64 {
        self.state.residual
    }

    /// Force that retains motions that friction does not hold, N; `None` where it holds all.
    #[getter]
    fn retention_n(&self) -> Option<f64> {
        self.state.retention_n
    }

    /// Displacements of all nodes, m: of each body, by its name, an array (nodes, 3) in the axes of
    /// the mesh. A run with `fields=True` recovers them.
    fn displacements_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let bodies = self.subject.bodies(py)?;
        let fields = bodies.static_displacements_m(&self.state);
        let fields = fields.ok_or_else(|| missing_recovery_error(py))?;
        let dict = PyDict::new(py);
        for (body, field) in bodies.model().bodies.iter().zip(&fields) {
            dict.set_item(&body.name, vector_array(py, field)?)?;
        }
        Ok(dict)
    }
}
