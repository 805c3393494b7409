//! Runs of scenes, by the commands of the program.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::PyArray1;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};

use crate::arrays::{vector, vector_array};
use crate::errors;
use crate::motion::PyMotion;
use crate::pairs::PyPairs;
use crate::problem::PyProblem;
use crate::response::PyResponse;
use crate::running::watched;
use crate::statics::PyStaticState;
use crate::subject::ResultSubject;
use dovetail::commands::Workspace;
use dovetail::error::RunError;
use dovetail::reporter::Reporter;
use dovetail::scene::SceneError;
use dovetail_cache::{Cache, CacheSettings};
use dovetail_solver::description::Scene;
use dovetail_solver::results::modes::NaturalFrequency;
use dovetail_solver::results::quantities::loss_factor;
use dovetail_solver::run::{PeakRange, Peaks, Run, load_path};

/// Natural frequency: kind, body, number and frequency in Hz.
pub type NamedMode = (&'static str, Option<String>, usize, f64);

/// Natural frequency for Python.
pub fn mode(of: &NaturalFrequency) -> NamedMode {
    (of.kind.id(), of.body.clone(), of.mode, of.frequency_hz)
}

/// Cache that a user gave: a folder, `False` for none, or nothing for the one of the program.
pub fn cache_of(given: Option<&Bound<'_, PyAny>>) -> PyResult<Cache> {
    let folder = match given {
        Some(given) if given.is_instance_of::<PyBool>() => {
            if !given.extract::<bool>()? {
                return Ok(Cache::new(None));
            }
            None
        }
        Some(given) => Some(given.extract::<PathBuf>()?),
        None => None,
    };
    let settings = CacheSettings::chosen(folder, None);
    let settings = settings.map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(Cache::new(Some(&settings)))
}

/// Does the work of a command about a scene, and returns its result with the warnings.
pub fn work<T: Send>(
    py: Python<'_>,
    scene: &Scene,
    cache: &Cache,
    progress: Option<&Bound<'_, PyAny>>,
    command: impl FnOnce(&Workspace<'_>) -> Result<T, RunError> + Send,
) -> PyResult<(T, Vec<String>)> {
    let (done, warnings) = run_command(py, scene, cache, progress, command)?;
    Ok((
        done.map_err(|error| errors::run_error(py, &error))?,
        warnings,
    ))
}

fn run_command<T: Send, E: Send>(
    py: Python<'_>,
    scene: &Scene,
    cache: &Cache,
    progress: Option<&Bound<'_, PyAny>>,
    command: impl FnOnce(&Workspace<'_>) -> Result<T, E> + Send,
) -> PyResult<(Result<T, E>, Vec<String>)> {
    // gmsh writes the mesh of a script there.
    let folder = tempfile::tempdir().map_err(|error| PyOSError::new_err(error.to_string()))?;
    let place: &Path = folder.path();
    watched(py, progress, |mut wire| {
        let work = Workspace {
            scene,
            folder: place.to_path_buf(),
            cache: cache.clone(),
            files: None,
            reporter: Reporter::new(&mut wire, None),
        };
        command(&work)
    })
}

/// Runs a scene.
pub fn run(
    py: Python<'_>,
    scene: &Scene,
    cache: &Cache,
    progress: Option<&Bound<'_, PyAny>>,
    command: impl FnOnce(&Workspace<'_>) -> Result<Run, RunError> + Send,
) -> PyResult<PyRun> {
    let (run, warnings) = work(py, scene, cache, progress, command)?;
    PyRun::build(py, run, scene, warnings)
}

/// Results of a run.
#[pyclass(frozen, name = "Run", module = "dovetail")]
pub struct PyRun {
    subject: Arc<ResultSubject>,
    statics: Py<PyStaticState>,
    problem: Py<PyProblem>,
    response: Option<Py<PyResponse>>,
    compared: Option<Py<PyResponse>>,
    modes: Vec<NamedMode>,
    /// Message and remedy of a run without its full result.
    incomplete: Option<(String, Option<String>)>,
    warnings: Vec<String>,
}

impl PyRun {
    fn build(py: Python<'_>, run: Run, scene: &Scene, warnings: Vec<String>) -> PyResult<Self> {
        let incomplete = run.verdict().err().map(|error| {
            let error = RunError::from(error);
            let remedy = miette::Diagnostic::help(&error).map(|help| help.to_string());
            (error.to_string(), remedy)
        });
        let state = &run.statics.state;
        let natural = run
            .reduced
            .natural_frequencies(Some(state), &run.held_omega2);
        let damping = run.reduced.rayleigh(&scene.damping, state).ok();
        let reduced = run.reduced;
        // Along an engine order matrices and damping are those of each speed.
        let of_all = damping.filter(|_| run.response.as_ref().is_none_or(|r| r.run_up.is_none()));
        let path = load_path(scene, &reduced.problem.reduced);
        let subject = ResultSubject::new(reduced.problem, Some(reduced.pairs), reduced.bodies);
        let state = Arc::new(run.statics.state);
        let about = of_all.map(|damping| (damping, Arc::clone(&state)));
        let (response, compared) = match run.response {
            Some(found) => (Some(found.response), found.compared.map(|c| c.response)),
            None => (None, None),
        };
        let of = |response| Py::new(py, PyResponse::new(response, &subject, about.clone()));
        Ok(Self {
            response: response.map(of).transpose()?,
            compared: compared.map(of).transpose()?,
            problem: Py::new(py, PyProblem::from_run(&subject, &state, damping, path))?,
            statics: Py::new(
                py,
                PyStaticState {
                    state,
                    subject: Arc::clone(&subject),
                },
            )?,
            modes: natural.iter().map(mode).collect(),
            incomplete,
            warnings,
            subject,
        })
    }
}

#[pymethods]
impl PyRun {
    fn __repr__(&self) -> String {
        let pairs = self.subject.pair_count();
        let words = match (&self.response, self.incomplete.is_none()) {
            (None, _) => "without a response",
            (Some(_), true) => "complete",
            (Some(_), false) => "not complete",
        };
        format!("<dovetail.Run: {pairs} pairs, {words}>")
    }

    /// Response; `None` where there is no static state to vibrate about, or none was asked for.
    #[getter]
    fn response(&self, py: Python<'_>) -> Option<Py<PyResponse>> {
        self.response.as_ref().map(|found| found.clone_ref(py))
    }

    /// Response with the number of harmonics of `response.compare_harmonics`; `None` where the scene
    /// asks for none.
    #[getter]
    fn compared(&self, py: Python<'_>) -> Option<Py<PyResponse>> {
        self.compared.as_ref().map(|found| found.clone_ref(py))
    }

    /// Static state.
    #[getter]
    fn static_state(&self, py: Python<'_>) -> Py<PyStaticState> {
        self.statics.clone_ref(py)
    }

    /// Reduced model of the run with its laws, loads and damping, for responses and balances of
    /// one's own.
    #[getter]
    fn problem(&self, py: Python<'_>) -> Py<PyProblem> {
        self.problem.clone_ref(py)
    }

    /// Contact pairs.
    #[getter]
    fn pairs(&self) -> PyPairs {
        PyPairs(Arc::clone(&self.subject))
    }

    /// Names of the observed displacements.
    #[getter]
    fn observations(&self) -> Vec<String> {
        self.subject.observations()
    }

    /// Natural frequencies: `(kind, body, number, frequency_hz)`, as `Scene.modes` has them, and the
    /// kind `linear`: small vibrations about the static state.
    #[getter]
    fn modes(&self) -> Vec<NamedMode> {
        self.modes.clone()
    }

    /// True if the static state and every frequency converged.
    #[getter]
    fn is_complete(&self) -> bool {
        self.incomplete.is_none()
    }

    /// Raises `RunError` where the run is not complete.
    fn verdict(&self, py: Python<'_>) -> PyResult<()> {
        match &self.incomplete {
            None => Ok(()),
            Some((message, remedy)) => Err(errors::remedy_error(
                py,
                message,
                remedy.as_deref().unwrap_or_default(),
            )),
        }
    }

    /// Warnings of the run, in the order in which they came.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Positions of all nodes, m: of each body, by its name, an array (nodes, 3).
    #[getter]
    fn nodes_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let bodies = self.subject.bodies(py)?;
        let dict = PyDict::new(py);
        for body in &bodies.model().bodies {
            dict.set_item(&body.name, vector_array(py, &body.nodes_m)?)?;
        }
        Ok(dict)
    }
}

/// Error of a scene with a key set, or of the run.
enum PeakError {
    Scene(SceneError),
    Run(RunError),
}

impl From<RunError> for PeakError {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

/// Peaks over a range of values. `scene_at` gives the scene of a value, as in
/// [`Workspace::peaks_at`].
///
/// [`Workspace::peaks_at`]: dovetail::commands::Workspace::peaks_at
pub fn peaks(
    py: Python<'_>,
    scene: &Scene,
    scene_at: &(dyn Fn(f64) -> Result<Scene, SceneError> + Sync),
    cache: &Cache,
    progress: Option<&Bound<'_, PyAny>>,
    range: &PeakRange<'_>,
) -> PyResult<PyPeaks> {
    let scene_at = |value: f64| scene_at(value).map_err(PeakError::Scene);
    let (found, _) = run_command(py, scene, cache, progress, |work| {
        work.peaks_at(range, &scene_at)
    })?;
    match found {
        Ok(found) => Ok(PyPeaks::new(found)),
        Err(PeakError::Scene(error)) => Err(errors::scene_error(py, &error)),
        Err(PeakError::Run(error)) => Err(errors::run_error(py, &error)),
    }
}

/// Peaks of an observed amplitude over the values of a key. The arrays have one entry for each value
/// with a peak, ascending: of the values asked for, and of those that were added to find the least
/// peak and the amplitude asked for.
#[pyclass(frozen, name = "Peaks", module = "dovetail")]
pub struct PyPeaks {
    found: Found,
    subject: Arc<ResultSubject>,
}

/// Peaks without the model of the last value, which `subject` has.
struct Found {
    rows: Vec<dovetail_solver::run::PeakAt>,
    observation: usize,
    missing: Vec<(f64, String)>,
    changes: Vec<[f64; 2]>,
    least: Option<f64>,
    reached: Vec<f64>,
}

impl PyPeaks {
    fn new(found: Peaks) -> Self {
        let reduced = found.reduced;
        let missing = found.missing.into_iter();
        Self {
            subject: ResultSubject::new(reduced.problem, Some(reduced.pairs), reduced.bodies),
            found: Found {
                rows: found.rows,
                observation: found.observation,
                missing: missing.map(|(v, error)| (v, error.to_string())).collect(),
                changes: found.changes,
                least: found.least,
                reached: found.reached,
            },
        }
    }

    fn figure_array<'py>(
        &self,
        py: Python<'py>,
        of: impl Fn(&dovetail_solver::run::PeakAt) -> f64,
    ) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.found.rows.iter().map(of).collect())
    }
}

#[pymethods]
impl PyPeaks {
    fn __len__(&self) -> usize {
        self.found.rows.len()
    }

    fn __repr__(&self) -> String {
        format!("<dovetail.Peaks: {} values>", self.found.rows.len())
    }

    /// Name of the observed displacement.
    #[getter]
    fn observation(&self) -> String {
        self.subject.observations()[self.found.observation].clone()
    }

    /// Values of the key.
    #[getter]
    fn value<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |row| row.value)
    }

    /// Peak amplitudes, m.
    #[getter]
    fn amplitude_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |row| row.amplitude_m(self.found.observation))
    }

    /// Frequencies of the peaks, Hz.
    #[getter]
    fn frequency_hz<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |row| row.orbit.frequency_hz)
    }

    /// Largest amplitudes of the linear reference in the range of frequencies, m; NaN where it does
    /// not move.
    #[getter]
    fn linear_amplitude_m<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |row| row.linear_m.unwrap_or(f64::NAN))
    }

    /// Estimated relative errors of the amplitudes; NaN where they are not known.
    #[getter]
    fn estimated_error<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let observation = self.found.observation;
        self.figure_array(py, |row| {
            row.orbit.amplitude_error(observation).unwrap_or(f64::NAN)
        })
    }

    /// Loss factors at the peaks, as `Response.loss_factor` has them.
    #[getter]
    fn loss_factor<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.figure_array(py, |row| loss_factor(&row.orbit).unwrap_or(f64::NAN))
    }

    /// Motion at the peak of the value number `index`.
    fn __getitem__(&self, index: usize) -> PyResult<PyMotion> {
        let row = self.found.rows.get(index).ok_or_else(|| {
            pyo3::exceptions::PyIndexError::new_err(format!(
                "there is no peak {index}: there are {}",
                self.found.rows.len()
            ))
        })?;
        Ok(PyMotion::isolated(row.orbit.clone(), &self.subject))
    }

    /// Values without a peak, and why.
    #[getter]
    fn missing(&self) -> Vec<(f64, String)> {
        self.found.missing.clone()
    }

    /// Value of the least peak, where it is inside of the range.
    #[getter]
    fn least(&self) -> Option<f64> {
        self.found.least
    }

    /// Values at which the peak has the amplitude asked for.
    #[getter]
    fn reached(&self) -> Vec<f64> {
        self.found.reached.clone()
    }

    /// Pairs of values between which another resonance becomes the higher one.
    #[getter]
    fn changes(&self) -> Vec<[f64; 2]> {
        self.found.changes.clone()
    }
}
