//! The periodic motion at one frequency.

use std::sync::Arc;

use numpy::{Complex64, PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{amplitudes, block, table, vector};
use crate::running::watched;
use crate::stability::PyStability;
use crate::subject::{ResultSubject, missing_recovery_error};
use dovetail_solver::damping::Rayleigh;
use dovetail_solver::dlft::{Orbit, PairCycle, PairErrors, Response, StaticState};
use dovetail_solver::results::quantities::loss_factor;
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::results::signals::pair_signals;
use dovetail_solver::stability::{Stability, judge};

/// Damping and static state of a motion.
pub type About = (Rayleigh, Arc<StaticState>);

/// Response or motion that stands by itself.
enum MotionSource {
    Of(Arc<Response>, usize),
    Alone(Box<Orbit>),
}

/// Periodic motion at one frequency, and what the pairs do in it.
///
/// Complex amplitudes c_k, k = 0 to H, stand for the signal `sum_k real(c_k exp(i k w t))`: c_0 is
/// the mean, and the excitation of phase 0 has its maximum at t = 0. Components of pairs are n (the
/// normal, along which a pair opens), t1 and t2.
#[pyclass(frozen, name = "Motion", module = "dovetail")]
pub struct PyMotion {
    source: MotionSource,
    subject: Arc<ResultSubject>,
    /// Damping that the motion was solved with, and the static state, where they are known.
    about: Option<About>,
}

impl PyMotion {
    /// Motion of a response.
    pub fn from_response(
        response: &Arc<Response>,
        index: usize,
        subject: &Arc<ResultSubject>,
        about: Option<About>,
    ) -> Self {
        Self {
            about,
            source: MotionSource::Of(Arc::clone(response), index),
            subject: Arc::clone(subject),
        }
    }

    /// Motion by itself.
    pub fn isolated(orbit: Orbit, subject: &Arc<ResultSubject>) -> Self {
        Self {
            about: None,
            source: MotionSource::Alone(Box::new(orbit)),
            subject: Arc::clone(subject),
        }
    }

    fn orbit(&self) -> &Orbit {
        match &self.source {
            MotionSource::Of(response, index) => &response.orbits[*index],
            MotionSource::Alone(orbit) => orbit,
        }
    }

    /// Complex amplitudes of pairs, (H+1, pairs, 3); no harmonics without pairs.
    fn pair_amplitudes<'py>(
        &self,
        py: Python<'py>,
        coefficients: &[f64],
    ) -> PyResult<Bound<'py, PyArray3<Complex64>>> {
        let harmonics = self.orbit().harmonics;
        let values = amplitudes(coefficients, harmonics);
        let pairs = values.len() / (harmonics + 1) / 3;
        block(py, [harmonics + 1, pairs, 3], values)
    }

    fn cycle_array<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&PairCycle) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.orbit().cycles.iter().map(of).collect())
    }

    /// Error of each pair; NaN where it has none, or errors are not known.
    fn error_array<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&PairErrors) -> Option<f64>,
    ) -> Bound<'py, PyArray1<f64>> {
        let orbit = self.orbit();
        let errors = match &orbit.figure_errors {
            Some(errors) => errors
                .pairs
                .iter()
                .map(|e| of(e).unwrap_or(f64::NAN))
                .collect(),
            None => vec![f64::NAN; orbit.cycles.len()],
        };
        vector(py, errors)
    }

    fn area_array<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&PairCycle) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        let cycles = self.orbit().cycles.iter().zip(self.subject.areas_m2());
        vector(py, cycles.map(|(cycle, area)| of(cycle) / area).collect())
    }
}

#[pymethods]
impl PyMotion {
    fn __repr__(&self) -> String {
        let orbit = self.orbit();
        format!(
            "<dovetail.Motion at {} Hz, {} harmonics, {}>",
            orbit.frequency_hz, orbit.harmonics, orbit.outcome
        )
    }

    /// Frequency of the first harmonic, Hz.
    #[getter]
    fn frequency_hz(&self) -> f64 {
        self.orbit().frequency_hz
    }

    /// Outcome of the solution: `converged`, or why there is none.
    #[getter]
    fn outcome(&self) -> String {
        self.orbit().outcome.to_string()
    }

    /// True if there is a motion: the balance holds.
    #[getter]
    fn has_motion(&self) -> bool {
        self.orbit().outcome.has_motion()
    }

    /// Number of harmonics besides the mean, H.
    #[getter]
    fn harmonics(&self) -> usize {
        self.orbit().harmonics
    }

    /// Unknowns of the balance, m, ((2H+1) 3 pairs,), as `Balance` takes them: the mean of all
    /// pairs (n, t1, t2 of the first pair, then of the next), then the cosines and the sines of
    /// harmonic 1, and so on.
    #[getter]
    fn u<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.orbit().x.clone())
    }

    /// Displacement of the first flank relative to the second, m, complex, (H+1, pairs, 3).
    #[getter]
    fn relative_displacement_m<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Bound<'py, PyArray3<Complex64>>> {
        self.pair_amplitudes(py, &self.orbit().x)
    }

    /// Contact forces, N, complex, (H+1, pairs, 3); below zero along n is compression.
    #[getter]
    fn contact_force_n<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<Complex64>>> {
        self.pair_amplitudes(py, &self.orbit().lambda)
    }

    /// Amplitudes of the stuck modes, complex, (H+1, modes), of modal mass 1.
    #[getter]
    fn modal<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<Complex64>>> {
        let harmonics = self.orbit().harmonics;
        let values = amplitudes(&self.orbit().modal, harmonics);
        table(py, [harmonics + 1, values.len() / (harmonics + 1)], values)
    }

    /// Observed displacements, m, complex, (observations, H+1); of a strain gauge, its strain.
    #[getter]
    fn observed_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<Complex64>>> {
        let orbit = self.orbit();
        let of = |coefficients: &Vec<f64>| amplitudes(coefficients, orbit.harmonics);
        let values: Vec<Complex64> = orbit.observed.iter().flat_map(of).collect();
        table(py, [orbit.observed.len(), orbit.harmonics + 1], values)
    }

    /// Largest departure of each observed displacement from its mean, m, (observations,); of a strain
    /// gauge, its strain.
    #[getter]
    fn amplitude_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.orbit().observed_amplitude.clone())
    }

    /// Estimated relative error of each amplitude, from harmonics and samples, (observations,); NaN
    /// where it is not known.
    #[getter]
    fn estimated_error<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let orbit = self.orbit();
        let of = |i: usize| orbit.amplitude_error(i).unwrap_or(f64::NAN);
        vector(py, (0..orbit.observed.len()).map(of).collect())
    }

    /// Estimated error of the friction power of all pairs, W; NaN where it is not known.
    #[getter]
    fn friction_power_error_w(&self) -> f64 {
        let errors = self.orbit().figure_errors.as_ref();
        errors.map_or(f64::NAN, |errors| errors.friction_power_w)
    }

    /// Estimated error of the power of the damping, W; NaN where it is not known.
    #[getter]
    fn viscous_power_error_w(&self) -> f64 {
        let errors = self.orbit().figure_errors.as_ref();
        errors.map_or(f64::NAN, |errors| errors.viscous_power_w)
    }

    /// Estimated error of the friction power of each pair, W, (pairs,); NaN where it is not known.
    #[getter]
    fn pair_friction_power_error_w<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.error_array(py, |errors| Some(errors.friction_power_w))
    }

    /// Estimated error of the distance that each pair slides, m, (pairs,); NaN where it is not known.
    #[getter]
    fn slid_error_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.error_array(py, |errors| Some(errors.slid_m))
    }

    /// Estimated error of the smallest compression of each pair, N, (pairs,); NaN where it is not
    /// known.
    #[getter]
    fn compression_min_error_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.error_array(py, |errors| Some(errors.compression_min_n))
    }

    /// Estimated error of the largest compression of each pair, N, (pairs,); NaN where it is not known,
    /// and for a rigid pair that lands, whose force has no finite maximum.
    #[getter]
    fn compression_max_error_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.error_array(py, |errors| errors.compression_max_n)
    }

    /// Impulse of the landing of each rigid pair that opens and closes again, N s, (pairs,); NaN for
    /// other pairs.
    #[getter]
    fn landing_impulse_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.cycle_array(py, |cycle| {
            cycle.landing.map_or(f64::NAN, |landing| landing.impulse_ns)
        })
    }

    /// Largest compression of each rigid pair that lands outside 1 / (H + 1) of a period after its
    /// landings, N, (pairs,); NaN for other pairs.
    #[getter]
    fn compression_after_landing_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.cycle_array(py, |cycle| {
            let landing = cycle.landing;
            landing.map_or(f64::NAN, |landing| landing.compression_after_n)
        })
    }

    /// Estimated error of the impulse of each landing, N s, (pairs,); NaN for other pairs.
    #[getter]
    fn landing_impulse_error_ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.error_array(py, |errors| {
            errors.landing.map(|landing| landing.impulse_ns)
        })
    }

    /// Estimated error of the largest compression outside the landings of each pair, N, (pairs,); NaN
    /// for other pairs.
    #[getter]
    fn compression_after_landing_error_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.error_array(py, |errors| {
            errors.landing.map(|landing| landing.compression_after_n)
        })
    }

    /// What each pair does in a period: `stuck`, `slipping`, `opening` (separates for a part of the
    /// period), `closing` (open at rest, touches for a part) or `open`.
    #[getter]
    fn status(&self) -> Vec<String> {
        let cycles = self.orbit().cycles.iter();
        cycles.map(|cycle| cycle.status.to_string()).collect()
    }

    /// The same as a number, (pairs,): 0 stuck, 1 slipping, 2 opening, 3 closing, 4 open.
    #[getter]
    fn status_code<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        let cycles = self.orbit().cycles.iter();
        vector(py, cycles.map(|cycle| cycle.status as i64).collect())
    }

    /// Distance that each pair slides in a period, m, (pairs,).
    #[getter]
    fn slid_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.cycle_array(py, |cycle| cycle.slid_m)
    }

    /// Fraction of the period that each pair is open, (pairs,).
    #[getter]
    fn open_fraction<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.cycle_array(py, |cycle| cycle.open_fraction)
    }

    /// Mean compression of each pair, N, (pairs,).
    #[getter]
    fn compression_mean_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.cycle_array(py, |cycle| cycle.compression_mean_n)
    }

    /// Smallest compression of each pair in the period, N, (pairs,).
    #[getter]
    fn compression_min_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.cycle_array(py, |cycle| cycle.compression_min_n)
    }

    /// Largest compression of each pair in the period, N, (pairs,).
    #[getter]
    fn compression_max_n<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.cycle_array(py, |cycle| cycle.compression_max_n)
    }

    /// Mean pressure on each pair, Pa, (pairs,); NaN where areas are not known.
    #[getter]
    fn pressure_mean_pa<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.area_array(py, |cycle| cycle.compression_mean_n)
    }

    /// Largest pressure on each pair in the period, Pa, (pairs,); NaN where areas are not known.
    #[getter]
    fn pressure_max_pa<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.area_array(py, |cycle| cycle.compression_max_n)
    }

    /// Power that friction takes from each pair, mean over a period, W, (pairs,).
    #[getter]
    fn pair_friction_power_w<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.cycle_array(py, |cycle| cycle.friction_power_w)
    }

    /// Energy that friction takes in a period, over the area of each pair, J/m2, (pairs,); NaN where
    /// areas are not known.
    #[getter]
    fn friction_energy_j_m2<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let frequency_hz = self.orbit().frequency_hz;
        self.area_array(py, |cycle| cycle.friction_power_w / frequency_hz)
    }

    /// Power of friction, mean over a period, W.
    #[getter]
    fn friction_power_w(&self) -> f64 {
        self.orbit().friction_power_w
    }

    /// Power of the damping, mean over a period, W.
    #[getter]
    fn viscous_power_w(&self) -> f64 {
        self.orbit().viscous_power_w
    }

    /// Power of the excitation, mean over a period, W.
    #[getter]
    fn input_power_w(&self) -> f64 {
        self.orbit().input_power_w
    }

    /// Kinetic energy of the vibration, mean over a period, J.
    #[getter]
    fn kinetic_energy_j(&self) -> f64 {
        self.orbit().kinetic_energy_j
    }

    /// Energy spent in a period over 2 pi times the largest stored one; NaN where nothing moves.
    #[getter]
    fn loss_factor(&self) -> f64 {
        loss_factor(self.orbit()).unwrap_or(f64::NAN)
    }

    /// Force that retains the mean where friction does not hold it, N.
    #[getter]
    fn retention_n(&self) -> f64 {
        self.orbit().retention_n
    }

    /// Stability of the motion, by its largest Floquet multiplier. Where the response did not judge the
    /// motion, it is judged now. The motion of a `Balance` is not judged.
    fn stability(&self, py: Python<'_>) -> PyResult<PyStability> {
        let known = self.orbit().stability;
        if known != Stability::default() {
            return Ok(known.into());
        }
        let Some((damping, state)) = &self.about else {
            return Ok(PyStability::not_judged("its damping is not known here"));
        };
        let judge = || judge(&self.subject.problem, *damping, state, self.orbit());
        Ok(watched(py, None, |_| judge())?.0.into())
    }

    /// Relative residual of the balance.
    #[getter]
    fn residual(&self) -> f64 {
        self.orbit().residual
    }

    /// Newton iterations of all attempts.
    #[getter]
    fn newton_iterations(&self) -> usize {
        self.orbit().newton_iterations
    }

    /// Displacement and contact force of a pair over one period: `(phase_rad, displacement_m,
    /// force_n)` of the shapes (instants,), (instants, 3) and (instants, 3). A pair is given by its
    /// number, from 0.
    #[pyo3(signature = (pair, instants=256))]
    #[expect(clippy::type_complexity, reason = "three arrays")]
    fn signals<'py>(
        &self,
        py: Python<'py>,
        pair: usize,
        instants: usize,
    ) -> PyResult<(
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray2<f64>>,
        Bound<'py, PyArray2<f64>>,
    )> {
        const MOST: usize = 1 << 20;
        let pairs = self.orbit().x.len() / (2 * self.orbit().harmonics + 1) / 3;
        if pair >= pairs {
            return Err(PyIndexError::new_err(format!(
                "there is no pair {pair}: there are {pairs}, counted from 0"
            )));
        }
        if instants > MOST {
            return Err(crate::errors::value(format!(
                "instants has to be at most {MOST}"
            )));
        }
        let signals = pair_signals(self.orbit(), pair, instants);
        let count = signals.displacement_m[0].len();
        let of = |parts: &[Vec<f64>; 3]| {
            let values: Vec<f64> = (0..count)
                .flat_map(|i| [0, 1, 2].map(|c| parts[c][i]))
                .collect();
            table(py, [count, 3], values)
        };
        let phase = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
        Ok((
            vector(py, (0..count).map(phase).collect()),
            of(&signals.displacement_m)?,
            of(&signals.force_n)?,
        ))
    }

    /// Displacements of all nodes, m: of each body, by its name, a complex array (H+1, nodes, 3) in
    /// the axes of the mesh. The nodes are those of `Run.nodes_m`. A run with `fields=True` recovers
    /// them.
    fn displacements_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let bodies = self.subject.bodies(py)?;
        let orbit = self.orbit();
        let motion = bodies
            .motion_m(orbit)
            .ok_or_else(|| missing_recovery_error(py))?;
        let dict = PyDict::new(py);
        for (body, fields) in bodies.model().bodies.iter().zip(&motion) {
            let nodes = fields.first().map_or(0, Vec::len);
            let flat = |field: &NodalField| field.concat();
            let coefficients: Vec<f64> = fields.iter().flat_map(flat).collect();
            let values = amplitudes(&coefficients, orbit.harmonics);
            let array = block(py, [orbit.harmonics + 1, nodes, 3], values)?;
            dict.set_item(&body.name, array)?;
        }
        Ok(dict)
    }
}
