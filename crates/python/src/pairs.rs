//! Contact pairs: where they are, and their laws.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;

use crate::arrays::{block, vector, vector_array};
use crate::subject::ResultSubject;
use dovetail_solver::results::pairs::PairRow;

/// Contact pairs, in the order of all arrays over pairs. Each is a node of one flank and what it
/// faces on the other.
#[pyclass(frozen, name = "Pairs", module = "dovetail")]
pub struct PyPairs(pub Arc<ResultSubject>);

impl PyPairs {
    fn rows(&self) -> &[PairRow] {
        self.0.pairs.as_ref().map_or(&[], |table| &table.rows)
    }

    fn law_array<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&dovetail_solver::contact::PairLaw) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.0.problem.laws.iter().map(of).collect())
    }
}

#[pymethods]
impl PyPairs {
    fn __len__(&self) -> usize {
        self.0.pair_count()
    }

    fn __repr__(&self) -> String {
        format!("<dovetail.Pairs: {}>", self.0.pair_count())
    }

    /// Names of the contacts.
    #[getter]
    fn contacts(&self) -> Vec<String> {
        let table = self.0.pairs.as_ref();
        table.map_or_else(Vec::new, |table| table.contacts.clone())
    }

    /// Number of the contact of each pair in `contacts`, (pairs,).
    #[getter]
    fn contact<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let of = |row: &PairRow| i64::try_from(row.contact).unwrap_or(i64::MAX);
        vector(py, self.rows().iter().map(of).collect())
    }

    /// Positions, m, (pairs, 3); empty where they are not known.
    #[getter]
    fn position_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let positions: Vec<[f64; 3]> = self.rows().iter().map(|row| row.position_m).collect();
        vector_array(py, &positions)
    }

    /// Directions in space, (pairs, 3, 3): of each pair the rows n, t1, t2; NaN where they are not
    /// known.
    #[getter]
    fn frame<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let of = |row: &PairRow| row.frame.unwrap_or([[f64::NAN; 3]; 3]).concat();
        let values: Vec<f64> = self.rows().iter().flat_map(of).collect();
        block(py, [self.rows().len(), 3, 3], values)
    }

    /// Tributary areas, m2, (pairs,); NaN where they are not known.
    #[getter]
    fn area_m2<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.0.areas_m2())
    }

    /// Coefficients of friction, (pairs,).
    #[getter]
    fn friction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.law_array(py, |law| law.friction)
    }

    /// Initial clearances, m, (pairs,); below zero for an interference.
    #[getter]
    fn gap_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.law_array(py, |law| law.gap_m)
    }

    /// Stiffness against penetration, N/m, (pairs,); infinite for rigid contact.
    #[getter]
    fn normal_stiffness_n_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.law_array(py, |law| {
            law.stiffness.map_or(f64::INFINITY, |s| s.normal_n_m)
        })
    }

    /// Stiffness against shear, N/m, (pairs,); infinite for rigid contact.
    #[getter]
    fn tangential_stiffness_n_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.law_array(py, |law| {
            law.stiffness.map_or(f64::INFINITY, |s| s.tangential_n_m)
        })
    }
}
