//! Scenes: the description of one run, as the program reads it.

use std::path::{Path, PathBuf};

use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use toml::Value;

use crate::errors;
use crate::run::{self, PyPeaks, PyRun};
use dovetail::scene;
use dovetail_solver::description::Scene;
use dovetail_superelement::input;

/// Complete description of a run: bodies, contacts, loads, excitation, and the response asked for.
///
/// `Scene(source)` takes the path of a scene file (TOML), or a dictionary with the same sections and
/// keys; `Scene.from_toml(text)` takes the text itself. The keys are those of
/// `docs/scene.md`. Relative paths in a file count from its folder, those of a dictionary or a text
/// from `folder`, which is the working folder by default.
///
/// Keys are read and set by dotted paths: `scene["response.harmonics"] = 5`,
/// `scene["contact.left.friction"]`, `scene["contact.0.friction"]`, and `contact.*.friction` for
/// all contacts. The whole scene is checked each time: a value that is not possible raises
/// `SceneError`, and the scene stays as it was.
#[pyclass(skip_from_py_object, name = "Scene", module = "dovetail")]
#[derive(Clone)]
pub struct PyScene {
    text: String,
    /// Name of the text in messages.
    source: String,
    folder: PathBuf,
    scene: Scene,
}

#[pymethods]
impl PyScene {
    #[new]
    #[pyo3(signature = (source, *, folder=None))]
    fn new(source: &Bound<'_, PyAny>, folder: Option<PathBuf>) -> PyResult<Self> {
        let py = source.py();
        if let Ok(dict) = source.cast::<PyDict>() {
            let table = Value::Table(table_of("the scene", dict, 0)?);
            return Self::parse(py, table.to_document(), "scene".to_owned(), folder);
        }
        let path: PathBuf = source.extract().map_err(|_| {
            PyTypeError::new_err(
                "a scene is made from the path of a file or from a dictionary; Scene.from_toml takes its text",
            )
        })?;
        let text = input::text(&path).map_err(|source| {
            let error = scene::SceneError::Read {
                path: path.clone(),
                source,
            };
            errors::scene_error(py, &error)
        })?;
        let parent = path.parent().map(Path::to_path_buf);
        Self::parse(py, text, path.display().to_string(), folder.or(parent))
    }

    /// Scene from the text of a scene file.
    #[staticmethod]
    #[pyo3(signature = (text, *, folder=None))]
    fn from_toml(py: Python<'_>, text: String, folder: Option<PathBuf>) -> PyResult<Self> {
        Self::parse(py, text, "scene".to_owned(), folder)
    }

    /// Name of the scene.
    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    /// Folder that relative paths of the scene count from.
    #[getter]
    fn folder(&self) -> &Path {
        &self.folder
    }

    /// Text of the scene file that describes this scene.
    fn to_toml(&self) -> &str {
        &self.text
    }

    /// The scene as a dictionary.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let whole = self.values(py, "")?;
        python_of(py, &whole[0])
    }

    /// Scene with these keys set beside the others: a copy, checked once with all of them. `None`
    /// removes a key.
    fn with_keys(&self, py: Python<'_>, keys: &Bound<'_, PyDict>) -> PyResult<Self> {
        let mut copy = self.clone();
        copy.set(py, overrides_of(keys)?)?;
        Ok(copy)
    }

    /// Sets several keys at once: the scene is checked with all of them. `None` removes a key.
    fn update(&mut self, py: Python<'_>, keys: &Bound<'_, PyDict>) -> PyResult<()> {
        self.set(py, overrides_of(keys)?)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        let values = self.values(py, key)?;
        if key.split('.').any(|word| word.trim() == "*") {
            let objects: PyResult<Vec<_>> = values.iter().map(|v| python_of(py, v)).collect();
            return Ok(PyList::new(py, objects?)?.into_any());
        }
        match (key, values.first()) {
            (key, Some(value)) if !key.is_empty() => python_of(py, value),
            _ => Err(PyKeyError::new_err(format!(
                "the scene does not set {key}: docs/scene.md has its default"
            ))),
        }
    }

    fn __setitem__(&mut self, key: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.set(value.py(), vec![override_of(key, Some(value))?])
    }

    fn __delitem__(&mut self, py: Python<'_>, key: &str) -> PyResult<()> {
        self.set(py, vec![override_of(key, None)?])
    }

    fn __contains__(&self, py: Python<'_>, key: &str) -> PyResult<bool> {
        Ok(!self.values(py, key)?.is_empty())
    }

    /// Value of a key, or `default` where the scene does not set it.
    #[pyo3(signature = (key, default=None))]
    fn get<'py>(
        &self,
        py: Python<'py>,
        key: &str,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if self.values(py, key)?.is_empty() {
            return Ok(default.unwrap_or_else(|| py.None().into_bound(py)));
        }
        self.__getitem__(py, key)
    }

    fn __copy__(&self) -> Self {
        self.clone()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.clone()
    }

    fn __getnewargs_ex__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<((Bound<'py, PyAny>,), Bound<'py, PyDict>)> {
        let keywords = PyDict::new(py);
        keywords.set_item("folder", &self.folder)?;
        Ok(((self.to_dict(py)?,), keywords))
    }

    fn __repr__(&self) -> String {
        format!("<dovetail.Scene \"{}\">", self.scene.name)
    }

    /// Computes the static state and the response.
    ///
    /// `progress` is `True`, the default, for a bar (by tqdm where it is installed, else lines on
    /// stderr), a callable that gets each event as a dictionary, or `False`. `fields=True` recovers the motion
    /// of all nodes, and `held_modes=True` computes the modes of each body with its flanks held.
    /// `cache` is the folder that keeps meshes and reductions for later runs; by default the one of
    /// the program, `$DOVETAIL_CACHE` or `output/.cache`; `False` for none.
    ///
    /// Ctrl-C stops the run at its next event and raises `KeyboardInterrupt`. A run whose static
    /// state or whose frequencies did not all converge is returned all the same: see
    /// `Run.is_complete`.
    #[pyo3(signature = (*, progress=None, fields=false, held_modes=false, cache=None))]
    fn run(
        slf: &Bound<'_, Self>,
        progress: Option<Bound<'_, PyAny>>,
        fields: bool,
        held_modes: bool,
        cache: Option<Bound<'_, PyAny>>,
    ) -> PyResult<PyRun> {
        let scene = slf.borrow().scene.clone();
        let options = dovetail_solver::run::Options { fields, held_modes };
        let kept = run::cache_of(cache.as_ref())?;
        let progress = progress_or_bar(slf.py(), progress);
        run::run(slf.py(), &scene, &kept, Some(&progress), |work| {
            work.solve(options)
        })
    }

    /// Computes the static state alone: a run without a response. The options are those of `run`.
    #[pyo3(signature = (*, progress=None, fields=false, cache=None))]
    fn static_state(
        slf: &Bound<'_, Self>,
        progress: Option<Bound<'_, PyAny>>,
        fields: bool,
        cache: Option<Bound<'_, PyAny>>,
    ) -> PyResult<PyRun> {
        let scene = slf.borrow().scene.clone();
        let options = dovetail_solver::run::Options {
            fields,
            held_modes: false,
        };
        let kept = run::cache_of(cache.as_ref())?;
        let progress = progress_or_bar(slf.py(), progress);
        run::run(slf.py(), &scene, &kept, Some(&progress), |work| {
            work.static_state(options)
        })
    }

    /// Natural frequencies: `(kind, body, number, frequency_hz)` of each mode. The kinds are
    /// `flanks_held` (each body alone), `fixed_interface` (the same in the basis of Craig and
    /// Bampton, where it is asked for) and `stuck` (the assembly with all pairs stuck). The body is
    /// `None` for the assembly; numbers count from 1.
    #[pyo3(signature = (*, progress=None, cache=None))]
    fn modes(
        slf: &Bound<'_, Self>,
        progress: Option<Bound<'_, PyAny>>,
        cache: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Vec<run::NamedMode>> {
        let scene = slf.borrow().scene.clone();
        let kept = run::cache_of(cache.as_ref())?;
        let progress = progress_or_bar(slf.py(), progress);
        let (modes, _) = run::work(slf.py(), &scene, &kept, Some(&progress), |work| {
            work.modes(None)
        })?;
        Ok(modes.0.iter().map(run::mode).collect())
    }

    /// Frequencies of a disc over its nodal diameters, with all pairs stuck, Hz: a list for each
    /// nodal diameter from 0 to half the number of sectors. `None` for a scene without `[cyclic]`.
    #[pyo3(signature = (*, progress=None, cache=None))]
    fn nodal_diameters(
        slf: &Bound<'_, Self>,
        progress: Option<Bound<'_, PyAny>>,
        cache: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Option<Vec<Vec<f64>>>> {
        let scene = slf.borrow().scene.clone();
        let kept = run::cache_of(cache.as_ref())?;
        let progress = progress_or_bar(slf.py(), progress);
        let ((_, found), _) = run::work(slf.py(), &scene, &kept, Some(&progress), |work| {
            work.modes(None)
        })?;
        Ok(found.map(|found| found.frequencies_hz))
    }

    /// Peaks of an observed amplitude over the values of a key, such as `contact.*.friction` or
    /// `excitation.0.force_n`.
    ///
    /// `values` ascend. `observation` is the name of the observed displacement, by default the
    /// first; with `amplitude_m` the values are found at which the peak has this amplitude. Values
    /// are spaced evenly in their logarithm where `logarithmic` is true: peaks in between are then
    /// a smooth function of it. The other options are those of `run`.
    #[pyo3(signature = (
        key, values, *, observation=None, amplitude_m=None, logarithmic=None, progress=None, cache=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of Python")]
    fn peaks(
        slf: &Bound<'_, Self>,
        key: &str,
        values: &Bound<'_, PyAny>,
        observation: Option<String>,
        amplitude_m: Option<f64>,
        logarithmic: Option<bool>,
        progress: Option<Bound<'_, PyAny>>,
        cache: Option<Bound<'_, PyAny>>,
    ) -> PyResult<PyPeaks> {
        let own = slf.borrow().clone();
        let kept = run::cache_of(cache.as_ref())?;
        let progress = progress_or_bar(slf.py(), progress);
        let values = crate::arrays::reals("values", values)?;
        if values.shape.len() != 1 || values.values.is_empty() {
            return Err(errors::value(
                "values has to be a list of at least one number",
            ));
        }
        let values = values.values;
        if values.windows(2).any(|two| two[0] >= two[1]) {
            return Err(errors::value("values have to ascend: sort them"));
        }
        if amplitude_m.is_some_and(|a| a.is_nan() || a <= 0.0) {
            return Err(errors::value("amplitude_m has to be positive"));
        }
        let logarithmic = logarithmic.unwrap_or_else(|| is_wide(&values));
        if logarithmic && values[0] <= 0.0 {
            return Err(errors::value(
                "values that are spaced in their logarithm have to be positive: give logarithmic=False",
            ));
        }
        let scene_at = |value: f64| own.scene_with(&[format!("{key}={value:?}")]);
        // What is wrong with the key is told before anything is computed.
        for value in &values {
            scene_at(*value).map_err(|error| errors::scene_error(slf.py(), &error))?;
        }
        let range = dovetail_solver::run::PeakRange {
            values: &values,
            logarithmic,
            observation: observation.as_deref(),
            amplitude_m,
            start: None,
        };
        run::peaks(
            slf.py(),
            own.scene(),
            &scene_at,
            &kept,
            Some(&progress),
            &range,
        )
    }
}

/// Ratio of the ends above which values count as spaced in their logarithm, as in `dovetail peaks`.
const WIDE: f64 = 3.0;

fn is_wide(values: &[f64]) -> bool {
    let ends = values.first().zip(values.last());
    ends.is_some_and(|(first, last)| *first > 0.0 && *last >= WIDE * first)
}

/// Progress that a user gave; the bar where nothing is given.
fn progress_or_bar<'py>(py: Python<'py>, progress: Option<Bound<'py, PyAny>>) -> Bound<'py, PyAny> {
    progress.unwrap_or_else(|| PyBool::new(py, true).to_owned().into_any())
}

impl PyScene {
    fn parse(
        py: Python<'_>,
        text: String,
        source: String,
        folder: Option<PathBuf>,
    ) -> PyResult<Self> {
        let folder = folder.unwrap_or_default();
        let scene = scene::parse(&text, &source, &folder, &[])
            .map_err(|error| errors::scene_error(py, &error))?;
        Ok(Self {
            text,
            source,
            folder,
            scene,
        })
    }

    /// Description of the run.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Description of the run with keys set.
    pub fn scene_with(&self, overrides: &[String]) -> Result<Scene, scene::SceneError> {
        scene::parse(&self.text, &self.source, &self.folder, overrides)
    }

    fn values(&self, py: Python<'_>, key: &str) -> PyResult<Vec<Value>> {
        scene::values(&self.text, &self.source, &[], key)
            .map_err(|error| errors::scene_error(py, &error))
    }

    /// Sets keys, unless the scene is then not possible.
    fn set(&mut self, py: Python<'_>, overrides: Vec<String>) -> PyResult<()> {
        let set = || {
            let scene = self.scene_with(&overrides)?;
            let whole = scene::values(&self.text, &self.source, &overrides, "")?;
            Ok((scene, whole))
        };
        let (scene, whole) = set().map_err(|error| errors::scene_error(py, &error))?;
        if let Some(whole) = whole.first() {
            self.text = whole.to_document();
            self.scene = scene;
        }
        Ok(())
    }
}

/// Text of a value as a document.
trait Document {
    fn to_document(&self) -> String;
}

impl Document for Value {
    fn to_document(&self) -> String {
        match self {
            Self::Table(table) => table.to_string(),
            other => other.to_string(),
        }
    }
}

fn overrides_of(keys: &Bound<'_, PyDict>) -> PyResult<Vec<String>> {
    let mut overrides = Vec::new();
    for (key, value) in keys {
        let key: String = key.extract()?;
        overrides.push(override_of(&key, (!value.is_none()).then_some(&value))?);
    }
    Ok(overrides)
}

/// `KEY=VALUE` as the program takes it; without a value the key is removed.
fn override_of(key: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<String> {
    if key.contains('=') || key.trim().is_empty() {
        return Err(PyValueError::new_err(format!(
            "\"{key}\" is not a dotted path, such as response.harmonics or contact.left.friction"
        )));
    }
    let value = value.filter(|value| !value.is_none());
    let text = value.map(|value| value_of(key, value, 0)).transpose()?;
    Ok(match text {
        Some(value) => format!("{key}={value}"),
        None => format!("{key}="),
    })
}

/// Most dictionaries and lists within one another: a scene has four.
const MOST_DEPTH: usize = 16;

fn table_of(key: &str, dict: &Bound<'_, PyDict>, depth: usize) -> PyResult<toml::Table> {
    let mut table = toml::Table::new();
    for (name, value) in dict {
        let name: String = name.extract().map_err(|_| {
            PyTypeError::new_err(format!("{key}: the keys of a table are texts, not {name}"))
        })?;
        if value.is_none() {
            continue;
        }
        let value = value_of(&format!("{key}.{name}"), &value, depth + 1)?;
        table.insert(name, value);
    }
    Ok(table)
}

/// Value of TOML of an object of Python, also of numbers and arrays of numpy, and of paths. `depth`
/// is the number of dictionaries and lists that the object is in.
fn value_of(key: &str, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<Value> {
    if depth > MOST_DEPTH {
        let key: String = key.chars().take(60).collect();
        return Err(PyValueError::new_err(format!(
            "{key}...: dictionaries and lists are nested {MOST_DEPTH} deep, and a scene has four levels; a dictionary that contains itself is no scene"
        )));
    }
    if value.is_instance_of::<PyBool>() {
        return Ok(Value::Boolean(value.extract()?));
    }
    if value.is_instance_of::<PyInt>() {
        let number = value
            .extract()
            .map_err(|_| PyValueError::new_err(format!("{key}: {value} has more than 64 bits")))?;
        return Ok(Value::Integer(number));
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(Value::Float(value.extract()?));
    }
    if value.is_instance_of::<PyString>() {
        return Ok(Value::String(value.extract()?));
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        return Ok(Value::Table(table_of(key, dict, depth)?));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let mut items = Vec::new();
        for (number, item) in value.try_iter()?.enumerate() {
            items.push(value_of(&format!("{key}.{number}"), &item?, depth + 1)?);
        }
        return Ok(Value::Array(items));
    }
    if value.hasattr("__fspath__")? {
        let path: PathBuf = value.extract()?;
        return Ok(Value::String(path.display().to_string()));
    }
    // An array or a number of numpy; one of complex numbers becomes complex, and is refused.
    if value.hasattr("tolist")? {
        let plain = value.call_method0("tolist")?;
        if !plain.hasattr("tolist")? {
            return value_of(key, &plain, depth + 1);
        }
    }
    let kind = value.get_type();
    Err(PyTypeError::new_err(format!(
        "{key}: a scene has no values of the type {}; give a number, a text, a truth value, a list or a dictionary",
        kind.name()?
    )))
}

fn python_of<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Boolean(v) => PyBool::new(py, *v).to_owned().into_any(),
        Value::Integer(v) => v.into_pyobject(py)?.into_any(),
        Value::Float(v) => v.into_pyobject(py)?.into_any(),
        Value::String(v) => v.into_pyobject(py)?.into_any(),
        Value::Datetime(v) => v.to_string().into_pyobject(py)?.into_any(),
        Value::Array(items) => {
            let items: PyResult<Vec<_>> = items.iter().map(|v| python_of(py, v)).collect();
            PyList::new(py, items?)?.into_any()
        }
        Value::Table(table) => {
            let dict = PyDict::new(py);
            for (key, value) in table {
                dict.set_item(key, python_of(py, value)?)?;
            }
            dict.into_any()
        }
    })
}
