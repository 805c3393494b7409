//! Responses over frequency.

use std::sync::Arc;

use numpy::{Complex64, PyArray1, PyArray2};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{amplitudes, table, vector};
use crate::errors;
use crate::motion::{About, PyMotion};
use crate::subject::ResultSubject;
use dovetail_solver::dlft::branch::stable;
use dovetail_solver::dlft::{Bifurcation, CycleCounts, LinearPoint, Orbit, Response};
use dovetail_solver::results::peak::{
    Peak, largest_amplitude, linear_peak, peak, uncomputed_resonance,
};
use dovetail_solver::results::quantities::loss_factor;

/// Largest amplitude of a curve.
#[pyclass(frozen, get_all, name = "Peak", module = "dovetail")]
pub struct PyPeak {
    /// Position in the arrays of the curve.
    index: usize,
    /// Frequency, Hz.
    frequency_hz: f64,
    /// Largest departure from the mean, m.
    amplitude_m: f64,
}

#[pymethods]
impl PyPeak {
    fn __repr__(&self) -> String {
        format!(
            "<dovetail.Peak: {:e} m at {} Hz>",
            self.amplitude_m, self.frequency_hz
        )
    }
}

fn peak_object(peak: Option<Peak>) -> Option<PyPeak> {
    peak.map(|peak| PyPeak {
        index: peak.index,
        frequency_hz: peak.frequency_hz,
        amplitude_m: peak.amplitude_m,
    })
}

/// Response over frequency. The arrays have one entry for each point, in the order in which the
/// curve runs: round a fold the frequency turns back. A point without a solution has NaN.
#[pyclass(frozen, name = "Response", module = "dovetail")]
pub struct PyResponse {
    response: Arc<Response>,
    subject: Arc<ResultSubject>,
    /// Damping and static state of all points, where they are the same.
    about: Option<About>,
}

impl PyResponse {
    pub fn new(response: Response, subject: &Arc<ResultSubject>, about: Option<About>) -> Self {
        Self {
            about,
            response: Arc::new(response),
            subject: Arc::clone(subject),
        }
    }

    fn orbits(&self) -> &[Orbit] {
        &self.response.orbits
    }

    /// Figure of each point; NaN where it has no motion.
    fn figure_array<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Orbit) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        let value = |orbit: &Orbit| {
            if orbit.outcome.has_motion() {
                of(orbit)
            } else {
                f64::NAN
            }
        };
        vector(py, self.orbits().iter().map(value).collect())
    }

    fn counted<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Orbit) -> usize,
    ) -> Bound<'py, PyArray1<i64>> {
        let value = |orbit: &Orbit| i64::try_from(of(orbit)).unwrap_or(i64::MAX);
        vector(py, self.orbits().iter().map(value).collect())
    }

    /// Figures of each point and observed displacement.
    fn each_observed<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Orbit, usize) -> f64,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let count = self.subject.observations().len();
        let value = |orbit: &Orbit, i: usize| match orbit.outcome.has_motion() {
            true => of(orbit, i),
            false => f64::NAN,
        };
        let values = self.orbits().iter();
        let values = values.flat_map(|orbit| (0..count).map(move |i| value(orbit, i)));
        table(py, [self.orbits().len(), count], values.collect())
    }

    fn linear_amplitudes<'py>(
        &self,
        py: Python<'py>,
        points: &[LinearPoint],
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let count = self.subject.observations().len();
        let values = points.iter().flat_map(|p| p.observed_amplitude.clone());
        table(py, [points.len(), count], values.collect())
    }
}

#[pymethods]
impl PyResponse {
    fn __len__(&self) -> usize {
        self.orbits().len()
    }

    fn __repr__(&self) -> String {
        format!("<dovetail.Response: {} points>", self.orbits().len())
    }

    /// Motion of a point, by its number; -1 is the last.
    fn __getitem__(&self, index: isize) -> PyResult<PyMotion> {
        let count = self.orbits().len();
        let place = match usize::try_from(index) {
            Ok(place) => Some(place),
            Err(_) => count.checked_sub(index.unsigned_abs()),
        };
        let place = place.filter(|place| *place < count).ok_or_else(|| {
            PyIndexError::new_err(format!("there is no point {index}: there are {count}"))
        })?;
        Ok(PyMotion::from_response(
            &self.response,
            place,
            &self.subject,
            self.about.clone(),
        ))
    }

    /// Motion of the point whose frequency is nearest; the one of the largest amplitude of the first
    /// observed displacement where several are.
    fn nearest(&self, frequency_hz: f64) -> PyResult<PyMotion> {
        let far = |orbit: &Orbit| (orbit.frequency_hz - frequency_hz).abs();
        let size = |orbit: &Orbit| orbit.observed_amplitude.first().copied().unwrap_or(0.0);
        let moving = self.orbits().iter().enumerate();
        let moving = moving.filter(|(_, orbit)| orbit.outcome.has_motion());
        let nearest = moving
            .min_by(|(_, a), (_, b)| far(a).total_cmp(&far(b)).then(size(b).total_cmp(&size(a))));
        match nearest {
            Some((index, _)) => Ok(PyMotion::from_response(
                &self.response,
                index,
                &self.subject,
                self.about.clone(),
            )),
            None => Err(errors::value("no point of the response has a motion")),
        }
    }

    /// Names of the observed displacements.
    #[getter]
    fn observations(&self) -> Vec<String> {
        self.subject.observations()
    }

    /// Frequencies, Hz, (points,).
    #[getter]
    fn frequency_hz<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.orbits().iter().map(|o| o.frequency_hz).collect())
    }

    /// Largest departures of the observed displacements from their means, m, (points,
    /// observations); of a strain gauge, its strain.
    #[getter]
    fn amplitude_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.each_observed(py, |orbit, i| orbit.observed_amplitude[i])
    }

    /// Estimated relative errors of the amplitudes from harmonics and samples, (points,
    /// observations); NaN where they are not known.
    #[getter]
    fn estimated_error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.each_observed(py, |orbit, i| orbit.amplitude_error(i).unwrap_or(f64::NAN))
    }

    /// Complex amplitudes of an observed displacement, m, (points, H+1), for the largest number of
    /// harmonics of any point; further ones of a point are 0. `Motion` has their meaning. The
    /// displacement is given by its name or number.
    #[pyo3(signature = (observation=None))]
    fn observed_m<'py>(
        &self,
        py: Python<'py>,
        observation: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<Complex64>>> {
        let number = self.number(py, observation)?;
        let width = 1 + self.orbits().iter().map(|o| o.harmonics).max().unwrap_or(0);
        let nothing = Complex64::new(f64::NAN, f64::NAN);
        let mut values = Vec::with_capacity(width * self.orbits().len());
        for orbit in self.orbits() {
            let end = values.len() + width;
            match orbit.observed.get(number) {
                Some(own) if orbit.outcome.has_motion() => {
                    values.extend(amplitudes(own, orbit.harmonics));
                    values.resize(end, Complex64::default());
                }
                _ => values.resize(end, nothing),
            }
        }
        table(py, [self.orbits().len(), width], values)
    }

    /// Outcome of each point: `converged`, or why there is no solution.
    #[getter]
    fn outcome(&self) -> Vec<String> {
        let orbits = self.orbits().iter();
        orbits.map(|orbit| orbit.outcome.to_string()).collect()
    }

    /// True where the balance is solved to the accuracy asked for, (points,).
    #[getter]
    fn converged<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        let of = |orbit: &Orbit| orbit.outcome.is_converged();
        vector(py, self.orbits().iter().map(of).collect())
    }

    /// True for a stable motion, False for an unstable one, None where it is not known, (points,): by
    /// the Floquet multipliers of each judged motion, else False between two folds of a branch.
    #[getter]
    fn stable(&self) -> Vec<Option<bool>> {
        stable(&self.response)
    }

    /// Kind of the instability of each point: `real`, `period_doubling` or `neimark_sacker`; None
    /// where the motion was not judged unstable.
    #[getter]
    fn instability(&self) -> Vec<Option<String>> {
        let kinds = self.orbits().iter().map(|orbit| orbit.stability.kind());
        kinds
            .map(|kind| kind.map(|kind| kind.to_string()))
            .collect()
    }

    /// Largest Floquet multiplier of each point, (points,); NaN where none was computed.
    #[getter]
    fn floquet_multiplier<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<Complex64>> {
        let nothing = Complex64::new(f64::NAN, f64::NAN);
        let of = |orbit: &Orbit| match orbit.stability.multiplier {
            Some(m) => Complex64::new(m.re, m.im),
            None => nothing,
        };
        vector(py, self.orbits().iter().map(of).collect())
    }

    /// Changes of stability along the curve that are no turning points: dictionaries with `after` (the
    /// point before the change), `frequency_hz`, `amplitude_m` (observations,) and `kind`.
    #[getter]
    fn bifurcations<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let one = |found: &Bifurcation| {
            let entry = PyDict::new(py);
            entry.set_item("after", found.after)?;
            entry.set_item("frequency_hz", found.frequency_hz)?;
            entry.set_item("amplitude_m", vector(py, found.observed_amplitude.clone()))?;
            entry.set_item("kind", found.kind.to_string())?;
            Ok(entry)
        };
        self.response.bifurcations.iter().map(one).collect()
    }

    /// Branches of responses of twice the period, beyond a period doubling. Their frequencies are half
    /// those of the excitation, whose harmonics are the even ones.
    #[getter]
    fn two_periods(&self) -> Vec<Self> {
        let branches = self.response.two_periods.iter();
        let one = |branch: &Response| Self::new(branch.clone(), &self.subject, None);
        branches.map(one).collect()
    }

    /// Number of the branch of each point, (points,).
    #[getter]
    fn branch<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let of = |i: usize| i64::try_from(self.response.branch_of(i)).unwrap_or(i64::MAX);
        vector(py, (0..self.orbits().len()).map(of).collect())
    }

    /// Harmonics of each point besides the mean, (points,).
    #[getter]
    fn harmonics<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.counted(py, |orbit| orbit.harmonics)
    }

    /// Amplitudes of the linear reference at the same frequencies, m, (points, observations): pairs
    /// that are open at rest are released, and all others stick.
    #[getter]
    fn linear_amplitude_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.linear_amplitudes(py, &self.response.linear)
    }

    /// Frequencies of the curve of the linear reference, Hz, ascending, so close that no peak is
    /// missed.
    #[getter]
    fn linear_curve_hz<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let curve = self.response.linear_curve.iter();
        vector(py, curve.map(|point| point.frequency_hz).collect())
    }

    /// Amplitudes of that curve, m, (its frequencies, observations).
    #[getter]
    fn linear_curve_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.linear_amplitudes(py, &self.response.linear_curve)
    }

    /// Power of friction of all pairs, mean over a period, W, (points,).
    #[getter]
    fn friction_power_w<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |orbit| orbit.friction_power_w)
    }

    /// Power of the damping, mean over a period, W, (points,).
    #[getter]
    fn viscous_power_w<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |orbit| orbit.viscous_power_w)
    }

    /// Power of the excitation, mean over a period, W, (points,).
    #[getter]
    fn input_power_w<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |orbit| orbit.input_power_w)
    }

    /// Kinetic energy of the vibration, mean over a period, J, (points,).
    #[getter]
    fn kinetic_energy_j<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |orbit| orbit.kinetic_energy_j)
    }

    /// Energy spent in a period over 2 pi times the largest stored one, (points,): twice the damping
    /// ratio of a linear mode at its resonance.
    #[getter]
    fn loss_factor<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |orbit| loss_factor(orbit).unwrap_or(f64::NAN))
    }

    /// Force that retains the mean where friction does not hold it, N, (points,).
    #[getter]
    fn retention_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |orbit| orbit.retention_n)
    }

    /// Relative residual of the balance, (points,).
    #[getter]
    fn residual<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.orbits().iter().map(|o| o.residual).collect())
    }

    /// Newton iterations of all attempts, (points,).
    #[getter]
    fn newton_iterations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.counted(py, |orbit| orbit.newton_iterations)
    }

    /// Iterations of the linear solves of all attempts, (points,).
    #[getter]
    fn krylov_iterations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.counted(py, |orbit| orbit.krylov_iterations)
    }

    /// Number of pairs of each status in the period, by its name: arrays (points,).
    #[getter]
    fn pair_counts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        type Kind = (&'static str, fn(CycleCounts) -> usize);
        const KINDS: [Kind; 5] = [
            ("stuck", |c| c.stuck),
            ("slipping", |c| c.slipping),
            ("opening", |c| c.opening),
            ("closing", |c| c.closing),
            ("open", |c| c.open),
        ];
        let dict = PyDict::new(py);
        for (name, of) in KINDS {
            dict.set_item(name, self.counted(py, |orbit| of(orbit.counts())))?;
        }
        Ok(dict)
    }

    /// Power of friction of each pair at each point, W, (points, pairs).
    #[getter]
    fn pair_friction_power_w<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pairs = self.subject.pair_count();
        let mut values = Vec::with_capacity(pairs * self.orbits().len());
        for orbit in self.orbits() {
            let end = values.len() + pairs;
            if orbit.outcome.has_motion() {
                values.extend(orbit.cycles.iter().map(|cycle| cycle.friction_power_w));
            }
            values.resize(end, f64::NAN);
        }
        table(py, [self.orbits().len(), pairs], values)
    }

    /// Distance beyond which a pair counts as slipping, m.
    #[getter]
    fn slip_threshold_m(&self) -> f64 {
        self.response.slip_threshold_m
    }

    /// Peak of an observed displacement, which is given by its name or number; `None` where the
    /// resonance was not computed (`uncomputed_resonance_hz`).
    #[pyo3(signature = (observation=None))]
    fn peak(
        &self,
        py: Python<'_>,
        observation: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Option<PyPeak>> {
        let number = self.number(py, observation)?;
        Ok(peak_object(peak(&self.response, number)))
    }

    /// Largest amplitude that was found of an observed displacement; `None` where no point has a
    /// motion. It is the peak where the resonance was computed.
    #[pyo3(signature = (observation=None))]
    fn largest_amplitude(
        &self,
        py: Python<'_>,
        observation: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Option<PyPeak>> {
        let number = self.number(py, observation)?;
        Ok(peak_object(largest_amplitude(&self.response, number)))
    }

    /// Frequencies between which no motion is known although the resonance of an observed
    /// displacement may be there, Hz; `None` where the resonance was computed.
    #[pyo3(signature = (observation=None))]
    fn uncomputed_resonance_hz(
        &self,
        py: Python<'_>,
        observation: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Option<(f64, f64)>> {
        let number = self.number(py, observation)?;
        Ok(uncomputed_resonance(&self.response, number).map(Into::into))
    }

    /// Largest amplitude of the linear reference; its index counts in `linear_curve_hz`.
    #[pyo3(signature = (observation=None))]
    fn linear_peak(
        &self,
        py: Python<'_>,
        observation: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Option<PyPeak>> {
        let number = self.number(py, observation)?;
        Ok(peak_object(linear_peak(&self.response, number)))
    }
}

impl PyResponse {
    /// Number of an observed displacement; the first where none is given.
    fn number(&self, py: Python<'_>, given: Option<Bound<'_, PyAny>>) -> PyResult<usize> {
        let first = || {
            0.into_pyobject(py)
                .map(|zero: Bound<'_, pyo3::types::PyInt>| zero.into_any())
        };
        let given = given.map_or_else(first, Ok)?;
        self.subject.observation(&given)
    }
}
