//! The stability of a motion.

use pyo3::prelude::*;
use pyo3::types::PyComplex;

use dovetail_solver::stability::{Stability, Verdict};

/// Stability of a motion, by its largest Floquet multiplier: the factor by which a small perturbation
/// grows in a period.
#[pyclass(frozen, name = "Stability", module = "dovetail")]
pub struct PyStability {
    /// True if small perturbations die away; None where the motion was not judged.
    #[pyo3(get)]
    stable: Option<bool>,
    multiplier: Option<[f64; 2]>,
    /// Kind of an instability: `real`, `period_doubling` or `neimark_sacker`.
    #[pyo3(get)]
    kind: Option<String>,
    /// Reason why the motion was not judged.
    #[pyo3(get)]
    reason: Option<String>,
}

impl PyStability {
    /// Stability that was not judged for this reason.
    pub fn not_judged(reason: &str) -> Self {
        Self {
            stable: None,
            multiplier: None,
            kind: None,
            reason: Some(reason.to_owned()),
        }
    }
}

impl From<Stability> for PyStability {
    fn from(found: Stability) -> Self {
        let (stable, kind, reason) = match found.verdict {
            Verdict::Stable => (Some(true), None, None),
            Verdict::Unstable(kind) => (Some(false), Some(kind.to_string()), None),
            Verdict::NotJudged(reason) => (None, None, Some(reason.to_string())),
        };
        Self {
            stable,
            multiplier: found.multiplier.map(|m| [m.re, m.im]),
            kind,
            reason,
        }
    }
}

#[pymethods]
impl PyStability {
    /// Largest Floquet multiplier; of a conjugate pair that above the real axis. None where none was
    /// computed.
    #[getter]
    fn multiplier<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyComplex>> {
        let parts = self.multiplier;
        parts.map(|[re, im]| PyComplex::from_doubles(py, re, im))
    }

    fn __repr__(&self) -> String {
        let word = match (self.stable, &self.kind, &self.reason) {
            (Some(true), ..) => "stable".to_owned(),
            (Some(false), Some(kind), _) => format!("unstable, {kind}"),
            (_, _, Some(reason)) => format!("not judged: {reason}"),
            _ => "not judged".to_owned(),
        };
        match self.multiplier {
            Some([re, im]) => {
                format!("<dovetail.Stability: {word}, multiplier {re:.4}{im:+.4}j>")
            }
            None => format!("<dovetail.Stability: {word}>"),
        }
    }
}
