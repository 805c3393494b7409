//! Subject of responses, motions and static states: a problem, its pairs and its bodies.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::{PyIndexError, PyKeyError};
use pyo3::prelude::*;

use crate::errors;
use dovetail_solver::problem::Problem;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::run::Bodies;

/// Problem with the places of its pairs and its bodies, where they are known.
pub struct ResultSubject {
    pub problem: Problem,
    pub pairs: Option<PairTable>,
    bodies: Option<Mutex<Bodies>>,
}

impl ResultSubject {
    pub fn new(problem: Problem, pairs: Option<PairTable>, bodies: Option<Bodies>) -> Arc<Self> {
        Arc::new(Self {
            problem,
            pairs,
            bodies: bodies.map(Mutex::new),
        })
    }

    /// Names of the observed displacements.
    pub fn observations(&self) -> Vec<String> {
        let observed = self.problem.reduced.observations.iter();
        observed.map(|o| o.name.clone()).collect()
    }

    /// Number of an observed displacement that is given by its number or its name.
    ///
    /// # Errors
    /// `IndexError`, `KeyError`: there is no such displacement.
    pub fn observation(&self, given: &Bound<'_, PyAny>) -> PyResult<usize> {
        let names = self.observations();
        if let Ok(name) = given.extract::<String>() {
            let index = names.iter().position(|n| *n == name);
            return index.ok_or_else(|| {
                PyKeyError::new_err(format!(
                    "there is no observed displacement \"{name}\": there are {}",
                    listed(&names)
                ))
            });
        }
        let number: usize = given.extract()?;
        if number < names.len() {
            return Ok(number);
        }
        Err(PyIndexError::new_err(format!(
            "there is no observed displacement number {number}: there are {}",
            listed(&names)
        )))
    }

    /// Number of contact pairs.
    pub fn pair_count(&self) -> usize {
        self.problem.laws.len()
    }

    /// Bodies, for a function of their motion.
    ///
    /// # Errors
    /// `RunError` where there are none.
    pub fn bodies(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, Bodies>> {
        let bodies = self.bodies.as_ref().ok_or_else(|| {
            errors::remedy_error(
                py,
                "a reduced model that is read or given has no bodies",
                "run a scene with a mesh",
            )
        })?;
        Ok(bodies.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Areas of the pairs, m2; NaN where they are not known.
    pub fn areas_m2(&self) -> Vec<f64> {
        let unknown = || vec![f64::NAN; self.pair_count()];
        let of = |table: &PairTable| {
            let rows = table.rows.iter();
            rows.map(|row| row.area_m2.unwrap_or(f64::NAN)).collect()
        };
        self.pairs.as_ref().map_or_else(unknown, of)
    }
}

fn listed(names: &[String]) -> String {
    if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    }
}

/// Error of fields on bodies without a recovery.
pub fn missing_recovery_error(py: Python<'_>) -> PyErr {
    errors::remedy_error(
        py,
        "the motion of the nodes was not recovered in this run",
        "run it with fields=True",
    )
}
