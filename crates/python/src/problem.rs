//! Reduced models with contact laws and excitations.

use std::f64::consts::FRAC_PI_2;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Instant;

use faer::Mat;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use strum::VariantNames;

use crate::arrays::{Given, complexes, has_shape, real_vector, reals, table, vector};
use crate::balance::{PyBalance, quietly};
use crate::errors::{self, library_error, run_error, value};
use crate::matrices::{self, PyPair, dof_vector, harmonics_of, law_of};
use crate::pairs::PyPairs;
use crate::response::PyResponse;
use crate::running::watched;
use crate::statics::PyStaticState;
use crate::subject::ResultSubject;
use dovetail_solver::contact::PairLaw;
use dovetail_solver::damping::{DampingSpec, Rayleigh, rayleigh};
use dovetail_solver::dlft::branch::follow;
use dovetail_solver::dlft::demand;
use dovetail_solver::dlft::eps::Eps;
use dovetail_solver::dlft::one_balance::{OneBalanceSettings, one_balance};
use dovetail_solver::dlft::retention::Mean;
use dovetail_solver::dlft::settings::{EpsChoice, Resolution, StabilityScope};
use dovetail_solver::dlft::static_state::{CRITERIA, LoadPath, static_state};
use dovetail_solver::dlft::sweep::{SweepSettings, sweep};
use dovetail_solver::dlft::{Response, StaticState};
use dovetail_solver::excitation::{Growth, NamedExcitation};
use dovetail_solver::memory;
use dovetail_solver::problem::{HarmonicLoad, Problem};
use dovetail_solver::reduced::{Load, ObservedPoint, ReducedModel};
use dovetail_solver::reduction::{Highest, StuckModes};
use dovetail_solver::results::far_slip::ShorterSides;
use dovetail_solver::results::modes::hertz;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::run;
use dovetail_solver::spectrum::blocks;
use dovetail_solver::superelement::{NamedContact, Superelement};

/// Reduced model with the law of each contact pair, its loads, and its damping.
///
/// It comes from matrices (`Problem.from_matrices`), from a reduced model as arrays
/// (`Problem.from_reduced`) or as a folder (`Problem.from_folder`), or from a run (`Run.problem`).
/// The unknowns X are the displacements of the pairs (n, t1, t2 of each), and the amplitudes of the
/// modes of the assembly with all pairs stuck.
///
/// `damping` is a dictionary with the keys of a scene: `{"ratio": 0.001}` (of critical, on the first
/// linear mode; `"linear_mode"` names another), or `{"stiffness_s": a, "mass_per_s": b}` for
/// C = a K + b M. Without it there is none.
#[pyclass(frozen, name = "Problem", module = "dovetail")]
pub struct PyProblem {
    subject: Arc<ResultSubject>,
    damping: DampingSpec,
    path: LoadPath,
    state: OnceLock<Arc<StaticState>>,
}

impl PyProblem {
    fn new(problem: Problem, pairs: Option<PairTable>, damping: DampingSpec) -> Self {
        Self {
            subject: ResultSubject::new(problem, pairs, None),
            damping,
            path: LoadPath::default(),
            state: OnceLock::new(),
        }
    }

    /// Problem of a run, with its static state.
    pub fn from_run(
        subject: &Arc<ResultSubject>,
        state: &Arc<StaticState>,
        damping: Option<Rayleigh>,
        path: LoadPath,
    ) -> Self {
        let damping = damping.map_or_else(DampingSpec::default, |d| DampingSpec::Rayleigh {
            stiffness_s: d.stiffness_s,
            mass_per_s: d.mass_per_s,
        });
        Self {
            subject: Arc::clone(subject),
            damping,
            path,
            state: OnceLock::from(Arc::clone(state)),
        }
    }

    fn problem(&self) -> &Problem {
        &self.subject.problem
    }

    /// Static state, which is computed once.
    fn state(&self, py: Python<'_>) -> PyResult<Arc<StaticState>> {
        if let Some(state) = self.state.get() {
            return Ok(Arc::clone(state));
        }
        let state = quietly(py, || {
            let mut solved = static_state(self.problem(), self.path.clone(), CRITERIA);
            if let Some(pairs) = &self.subject.pairs {
                ShorterSides::new(pairs).judge_static(&mut solved);
            }
            solved
        })?;
        Ok(Arc::clone(self.state.get_or_init(|| Arc::new(state))))
    }

    /// Static state that a vibration can be about.
    ///
    /// # Errors
    /// `RunError`: there is none.
    fn usable_state(&self, py: Python<'_>) -> PyResult<Arc<StaticState>> {
        let state = self.state(py)?;
        if state.outcome.is_converged() {
            return Ok(state);
        }
        Err(errors::remedy_error(
            py,
            &format!(
                "the static state under the steady load was not found: {}",
                state.outcome
            ),
            "press the pairs together, or give the bodies supports that hold them without contact",
        ))
    }

    fn rayleigh(
        &self,
        py: Python<'_>,
        given: Option<&Bound<'_, PyDict>>,
        state: &StaticState,
    ) -> PyResult<Rayleigh> {
        let spec = given.map(damping_of).transpose()?.unwrap_or(self.damping);
        let linear = state
            .linear
            .modes_of_first_harmonic(&self.problem().reduced);
        rayleigh(&spec, &linear).map_err(|error| library_error(py, error))
    }

    /// Problem with other laws or loads, and the same static state where that stays.
    fn changed(&self, problem: Problem) -> Self {
        let same = problem.is_at_rest_like(self.problem());
        let state = self.state.get().filter(|_| same).cloned();
        Self {
            subject: ResultSubject::new(problem, self.subject.pairs.clone(), None),
            damping: self.damping,
            path: self.path.clone(),
            state: state.map_or_else(OnceLock::new, OnceLock::from),
        }
    }

    fn matrix<'py>(&self, py: Python<'py>, of: &Mat<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (rows, columns) = (of.nrows(), of.ncols());
        let values = (0..rows).flat_map(|i| (0..columns).map(move |j| of[(i, j)]));
        table(py, [rows, columns], values.collect())
    }
}

/// Damping from a dictionary with the keys of a scene.
fn damping_of(given: &Bound<'_, PyDict>) -> PyResult<DampingSpec> {
    let keys = ["ratio", "linear_mode", "stiffness_s", "mass_per_s"];
    for key in given.keys() {
        let key: String = key.extract()?;
        if !keys.contains(&key.as_str()) {
            return Err(value(format!(
                "damping has no key \"{key}\": the keys are {}",
                keys.join(", ")
            )));
        }
    }
    let number = |key: &str| -> PyResult<Option<f64>> {
        let Some(found) = given.get_item(key)? else {
            return Ok(None);
        };
        let number: f64 = found.extract()?;
        if number.is_finite() && number >= 0.0 {
            return Ok(Some(number));
        }
        Err(value(format!(
            "damping.{key} is {number}; it must be at least 0"
        )))
    };
    let (stiffness_s, mass_per_s) = (number("stiffness_s")?, number("mass_per_s")?);
    match number("ratio")? {
        Some(_) if stiffness_s.is_some() || mass_per_s.is_some() => Err(value(
            "damping.ratio excludes damping.stiffness_s and damping.mass_per_s: give one or the other",
        )),
        Some(ratio) => Ok(DampingSpec::Ratio {
            ratio,
            linear_mode: match given.get_item("linear_mode")? {
                Some(mode) => mode.extract()?,
                None => 1,
            },
        }),
        None => Ok(DampingSpec::Rayleigh {
            stiffness_s: stiffness_s.unwrap_or(0.0),
            mass_per_s: mass_per_s.unwrap_or(0.0),
        }),
    }
}

fn damping_or_none(given: Option<&Bound<'_, PyDict>>) -> PyResult<DampingSpec> {
    Ok(given.map(damping_of).transpose()?.unwrap_or_default())
}

/// Choice with this word, which the parameter `name` has.
fn choice_of<T: FromStr + VariantNames>(name: &str, word: &str) -> PyResult<T> {
    word.parse().map_err(|_| {
        let quoted: Vec<String> = T::VARIANTS.iter().map(|w| format!("\"{w}\"")).collect();
        let choices = quoted.join(", ");
        value(format!("{name} is \"{word}\"; the choices are {choices}"))
    })
}

fn eps_of(choice: &str, scale: f64) -> PyResult<Eps> {
    let choice = choice_of::<EpsChoice>("eps", choice)?;
    if !(scale.is_finite() && scale > 0.0) {
        return Err(value(format!("eps_scale is {scale}; it must be above 0")));
    }
    Ok(Eps { choice, scale })
}

/// Harmonics and samples, checked against each other and the excitation.
fn resolution_of(
    harmonics: usize,
    samples: Option<usize>,
    problem: &Problem,
) -> PyResult<(usize, usize)> {
    let most = Resolution::MOST_HARMONICS;
    if !(1..=most).contains(&harmonics) {
        return Err(value(format!(
            "harmonics is {harmonics}; it must be 1 to {most}"
        )));
    }
    let least = Resolution::least_samples(harmonics);
    let samples = samples.unwrap_or(Resolution::SAMPLES.max(least));
    let most = Resolution::MOST_SAMPLES;
    if !(least..=most).contains(&samples) {
        return Err(value(format!(
            "samples is {samples}; with {harmonics} harmonics it must be {least} to {most}"
        )));
    }
    let excited = problem.highest_excited();
    if excited > harmonics {
        return Err(value(format!(
            "harmonic {excited} is excited, and only {harmonics} are kept: give harmonics={excited} or more"
        )));
    }
    Ok((harmonics, samples))
}

/// Number of each pair, or one for all.
fn pair_values(name: &str, given: &Bound<'_, PyAny>, pairs: usize) -> PyResult<Vec<f64>> {
    let Given { shape, values } = reals(name, given)?;
    if shape.is_empty() {
        return Ok(vec![values[0]; pairs]);
    }
    has_shape(name, &shape, &[pairs])?;
    Ok(values)
}

/// Matrix of a shape.
fn matrix_of(name: &str, given: &Bound<'_, PyAny>, expected: [usize; 2]) -> PyResult<Mat<f64>> {
    let Given { shape, values } = reals(name, given)?;
    has_shape(name, &shape, &expected)?;
    let columns = expected[1];
    Ok(Mat::from_fn(expected[0], columns, |i, j| {
        values[i * columns + j]
    }))
}

/// Unit loads of a folder: the parts of each harmonic that are not zero, in newtons.
fn unit_loads(excitations: &[HarmonicLoad]) -> (Vec<Load>, Vec<NamedExcitation>) {
    let parts = excitations.iter().flat_map(|load| {
        let parts = [(&load.cosine, 0.0), (&load.sine, FRAC_PI_2)];
        parts.map(|(part, phase_rad)| (load, part, phase_rad))
    });
    let is_zero = |part: &Load| part.on_x.iter().chain(&part.on_modes).all(|v| *v == 0.0);
    let parts = parts.filter(|(_, part, _)| !is_zero(part));
    let named = |(load, part, phase_rad): (&HarmonicLoad, &Load, f64)| {
        let name = format!("harmonic {}", load.harmonic);
        let excitation = NamedExcitation {
            harmonic: load.harmonic,
            phase_rad,
            grows_with_squared_frequency: load.growth == Growth::Squared,
            ..NamedExcitation::cosine(name)
        };
        (part.clone(), excitation)
    };
    parts.map(named).unzip()
}

/// Observed displacements: weights by name.
fn observed_of(given: &Bound<'_, PyDict>, size: usize) -> PyResult<Vec<(String, Vec<f64>)>> {
    let mut observed = Vec::new();
    for (name, weights) in given {
        let name: String = name.extract().map_err(|_| {
            PyTypeError::new_err("the keys of observe are names of observed displacements")
        })?;
        let weights = dof_vector(&format!("observe[\"{name}\"]"), &weights, size)?;
        observed.push((name, weights));
    }
    Ok(observed)
}

#[pymethods]
impl PyProblem {
    /// Problem from stiffness and mass matrices, N/m and kg, of the same degrees of freedom.
    ///
    /// `stiffness` and `mass` are dense (numpy) or sparse (scipy.sparse) and symmetric. `pairs` is a
    /// list of `Pair`. `excitation` is the amplitude of the force on each degree of freedom, N,
    /// complex or real, in harmonic 1; a dictionary has several harmonics: `{1: f1, 3: f3}`. The
    /// force is the real part of `amplitude exp(i k w t)`. `observe` is a dictionary of names with
    /// the number of a degree of freedom or the weights of all. `static_load` is the steady load,
    /// N, and `fixed` lists degrees of freedom that do not move.
    ///
    /// The model is condensed on the pairs and on the modes of the assembly with all pairs stuck:
    /// `modes` is their number, by default as many as responses up to `highest_hz` need, or up to
    /// twice the first stuck mode.
    #[staticmethod]
    #[pyo3(signature = (
        stiffness, mass, pairs, *, excitation, observe, static_load=None, fixed=None, damping=None,
        modes=None, highest_hz=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of Python")]
    fn from_matrices(
        py: Python<'_>,
        stiffness: &Bound<'_, PyAny>,
        mass: &Bound<'_, PyAny>,
        pairs: Vec<PyRef<'_, PyPair>>,
        excitation: &Bound<'_, PyAny>,
        observe: &Bound<'_, PyDict>,
        static_load: Option<Bound<'_, PyAny>>,
        fixed: Option<Vec<usize>>,
        damping: Option<&Bound<'_, PyDict>>,
        modes: Option<usize>,
        highest_hz: Option<f64>,
    ) -> PyResult<Self> {
        let damping = damping_or_none(damping)?;
        let highest = match highest_hz {
            None => Highest::OfFirstStuckMode(2.0),
            Some(hz) if hz.is_finite() && hz > 0.0 => Highest::RadS(std::f64::consts::TAU * hz),
            Some(hz) => return Err(value(format!("highest_hz is {hz}; it must be above 0"))),
        };
        if modes == Some(0) {
            return Err(value("modes is 0; it must be at least 1"));
        }
        let pairs: Vec<PyPair> = pairs.iter().map(|pair| PyPair::clone(pair)).collect();
        let loads = |size: usize| {
            let static_load = static_load.map(|given| real_vector("static_load", &given, size));
            Ok(matrices::Loads {
                excitation: harmonics_of(excitation, size)?,
                observed: observed_of(observe, size)?,
                static_load: static_load.transpose()?,
            })
        };
        let problem = matrices::problem_of(
            py,
            (stiffness, mass),
            &pairs,
            &fixed.unwrap_or_default(),
            loads,
            StuckModes::new(modes, highest),
        )?;
        Ok(Self::new(problem, None, damping))
    }

    /// Problem from a reduced model as arrays: `stiffness` K, N/m, and `mass` M, kg, (n, n) on the
    /// displacements X of the pairs (n = 3 pairs: n, t1, t2 of each), the mass coupling `coupling`
    /// p, (n, m), to modes of modal mass 1 with the squared angular frequencies `omega2`, rad2/s2,
    /// (m,).
    ///
    /// With modal amplitudes q: `K X + M X'' + p q'' + lambda = F`, `q'' + omega2 q + p^T X'' = fm`.
    /// `static_load`, `excitation` and the weights of `observe` are pairs of arrays, on X (n,) and
    /// on the modes (m,). The other options are those of `from_folder`; `friction` and `gap_m` may
    /// have a value for each pair.
    #[staticmethod]
    #[pyo3(signature = (
        stiffness, mass, coupling, omega2, *, static_load, excitation, observe, friction,
        gap_m=None, normal_stiffness_n_m=None, tangential_stiffness_n_m=None, damping=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of Python")]
    fn from_reduced(
        stiffness: &Bound<'_, PyAny>,
        mass: &Bound<'_, PyAny>,
        coupling: &Bound<'_, PyAny>,
        omega2: &Bound<'_, PyAny>,
        static_load: (Bound<'_, PyAny>, Bound<'_, PyAny>),
        excitation: (Bound<'_, PyAny>, Bound<'_, PyAny>),
        observe: &Bound<'_, PyDict>,
        friction: &Bound<'_, PyAny>,
        gap_m: Option<Bound<'_, PyAny>>,
        normal_stiffness_n_m: Option<f64>,
        tangential_stiffness_n_m: Option<f64>,
        damping: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let damping = damping_or_none(damping)?;
        let modes = reals("omega2", omega2)?;
        let m = modes.values.len();
        has_shape("omega2", &modes.shape, &[m])?;
        if modes.values.iter().any(|w2| *w2 <= 0.0) || modes.values.windows(2).any(|w| w[0] > w[1])
        {
            return Err(value("omega2 has to be above 0 and ascend"));
        }
        let k = reals("stiffness", stiffness)?;
        let n = k.shape.first().copied().unwrap_or(0);
        if n == 0 || n % 3 != 0 {
            return Err(value(format!(
                "stiffness has {n} rows, and has to have 3 for each pair: n, t1, t2"
            )));
        }
        let [k, mass] = [("stiffness", stiffness), ("mass", mass)].map(|(name, given)| {
            matrices::symmetric(name, given, name == "mass")?;
            matrix_of(name, given, [n, n])
        });
        let load = |name: &str, parts: &(Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            Ok::<_, PyErr>(Load::new(
                real_vector(&format!("{name}[0]"), &parts.0, n)?,
                real_vector(&format!("{name}[1]"), &parts.1, m)?,
            ))
        };
        let part = |name: &str, given: &Bound<'_, PyAny>, size: usize| {
            let Given { shape, values } = complexes(name, given)?;
            has_shape(name, &shape, &[size])?;
            Ok::<_, PyErr>(values)
        };
        let on_x = part("excitation[0]", &excitation.0, n)?;
        let on_modes = part("excitation[1]", &excitation.1, m)?;
        let excitation = HarmonicLoad {
            sine: Load::new(
                on_x.iter().map(|v| -v.im).collect(),
                on_modes.iter().map(|v| -v.im).collect(),
            ),
            ..HarmonicLoad::cosine(
                1,
                Load::new(
                    on_x.iter().map(|v| v.re).collect(),
                    on_modes.iter().map(|v| v.re).collect(),
                ),
            )
        };
        let mut observations = Vec::new();
        for (name, weights) in observe {
            let name: String = name.extract()?;
            let weights: (Bound<'_, PyAny>, Bound<'_, PyAny>) = weights.extract()?;
            let Load { on_x, on_modes } = load(&format!("observe[\"{name}\"]"), &weights)?;
            observations.push(ObservedPoint::new(name, on_x, on_modes));
        }
        let pairs = n / 3;
        let friction = pair_values("friction", friction, pairs)?;
        let gaps_m = match gap_m {
            Some(given) => pair_values("gap_m", &given, pairs)?,
            None => vec![0.0; pairs],
        };
        let laws = friction.into_iter().zip(gaps_m).map(|(friction, gap_m)| {
            law_of(
                friction,
                gap_m,
                normal_stiffness_n_m,
                tangential_stiffness_n_m,
            )
        });
        let reduced = ReducedModel {
            static_load: load("static_load", &static_load)?,
            observations,
            ..ReducedModel::new(
                k?,
                mass?,
                matrix_of("coupling", coupling, [n, m])?,
                modes.values,
            )
        };
        let problem = Problem {
            reduced: reduced.into(),
            laws: laws.collect::<PyResult<_>>()?,
            excitations: vec![excitation],
            modal_ratios: Vec::new(),
        };
        Ok(Self::new(problem, None, damping))
    }

    /// Problem from a folder of MatrixMarket files, as `dovetail reduce` writes it. All pairs have
    /// one law; `force_n` multiplies the unit excitation of the folder.
    #[staticmethod]
    #[pyo3(signature = (
        folder, *, friction, gap_m=0.0, normal_stiffness_n_m=None, tangential_stiffness_n_m=None,
        force_n=1.0, damping=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of Python")]
    fn from_folder(
        py: Python<'_>,
        folder: PathBuf,
        friction: f64,
        gap_m: f64,
        normal_stiffness_n_m: Option<f64>,
        tangential_stiffness_n_m: Option<f64>,
        force_n: f64,
        damping: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let damping = damping_or_none(damping)?;
        let law = law_of(
            friction,
            gap_m,
            normal_stiffness_n_m,
            tangential_stiffness_n_m,
        )?;
        if !force_n.is_finite() {
            return Err(value(format!("force_n is {force_n}; it must be finite")));
        }
        let read =
            dovetail_superelement::read(&folder).map_err(|error| run_error(py, &error.into()))?;
        let pairs = PairTable::from_superelement(&read, law);
        let problem = Problem::excited(read.model, law, &read.excitations, force_n);
        Ok(Self::new(problem, Some(pairs), damping))
    }

    /// Writes the reduced model as a folder, which `Problem.from_folder` and the section
    /// `[reduced_model]` of a scene read.
    ///
    /// The folder has the matrices, the steady load with the preloads, the excitation and the
    /// observed displacements. It has neither contact laws nor damping: who reads it gives them.
    /// `positions_m` are the places of the pairs in space, (pairs, 3), by default the known ones of a
    /// run or a folder, else zero. The results do not depend on them.
    #[pyo3(signature = (folder, *, positions_m=None))]
    fn to_folder(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        positions_m: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let problem = self.problem();
        if problem.reduced.waves.excitation().is_some() {
            return Err(value(
                "the reduced model of a disc of sectors has a model for each wave, and a folder has one: use a scene without [cyclic]",
            ));
        }
        let pairs = problem.laws.len();
        let known = self.subject.pairs.as_ref();
        let positions_m = match positions_m {
            Some(given) => {
                let Given { shape, values } = reals("positions_m", given)?;
                has_shape("positions_m", &shape, &[pairs, 3])?;
                let (rows, _) = values.as_chunks::<3>();
                rows.to_vec()
            }
            None => known.map_or_else(
                || vec![[0.0; 3]; pairs],
                |known| known.rows.iter().map(|row| row.position_m).collect(),
            ),
        };
        let (unit_loads, excitations) = unit_loads(&problem.excitations);
        let element = Superelement {
            model: ReducedModel {
                unit_loads,
                ..ReducedModel::clone(&problem.reduced)
            },
            excitations,
            contacts: known.map_or_else(
                || {
                    let name = "pairs".to_owned();
                    vec![NamedContact { name, pairs }]
                },
                PairTable::named_contacts,
            ),
            positions_m,
            areas_m2: known.and_then(|known| known.rows.iter().map(|row| row.area_m2).collect()),
        };
        std::fs::create_dir_all(&folder)?;
        dovetail_superelement::write(&folder, &element)
            .map_err(|error| run_error(py, &error.into()))
    }

    fn __repr__(&self) -> String {
        let reduced = &self.problem().reduced;
        format!(
            "<dovetail.Problem: {} pairs, {} modes>",
            reduced.pairs(),
            reduced.omega2.len()
        )
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

    /// Stiffness K on the displacements of the pairs, N/m, (3 pairs, 3 pairs): n, t1, t2 of each.
    #[getter]
    fn stiffness_n_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.matrix(py, &self.problem().reduced.stiffness)
    }

    /// Mass M on the displacements of the pairs, kg, (3 pairs, 3 pairs).
    #[getter]
    fn mass_kg<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.matrix(py, &self.problem().reduced.mass)
    }

    /// Mass coupling p of the pairs to the modes, (3 pairs, modes), of modal mass 1.
    #[getter]
    fn coupling<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.matrix(py, &self.problem().reduced.coupling)
    }

    /// Squared angular frequencies of the modes, rad2/s2, (modes,): of the stuck modes, ascending,
    /// and then of the residual vectors, which stand for the modes left out.
    #[getter]
    fn omega2<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.problem().reduced.omega2.clone())
    }

    /// Natural frequencies with all pairs stuck, Hz, ascending.
    #[getter]
    fn stuck_frequency_hz<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let stuck = self.problem().reduced.stuck_omega2().iter();
        vector(py, stuck.map(|w2| hertz(*w2)).collect())
    }

    /// Steady load on X and on the modes, N: arrays (3 pairs,) and (modes,).
    #[getter]
    fn static_load_n<'py>(
        &self,
        py: Python<'py>,
    ) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        let load = &self.problem().reduced.static_load;
        (
            vector(py, load.on_x.clone()),
            vector(py, load.on_modes.clone()),
        )
    }

    /// The same problem with other contact laws: one value for all pairs, or an array (pairs,). What
    /// is not given stays.
    #[pyo3(signature = (
        *, friction=None, gap_m=None, normal_stiffness_n_m=None, tangential_stiffness_n_m=None
    ))]
    fn with_laws(
        &self,
        friction: Option<Bound<'_, PyAny>>,
        gap_m: Option<Bound<'_, PyAny>>,
        normal_stiffness_n_m: Option<Bound<'_, PyAny>>,
        tangential_stiffness_n_m: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let laws = &self.problem().laws;
        let given = |name: &str, given: Option<Bound<'_, PyAny>>| {
            given
                .map(|given| pair_values(name, &given, laws.len()))
                .transpose()
        };
        let friction = given("friction", friction)?;
        let gap_m = given("gap_m", gap_m)?;
        let normal = given("normal_stiffness_n_m", normal_stiffness_n_m)?;
        let tangential = given("tangential_stiffness_n_m", tangential_stiffness_n_m)?;
        let law = |(i, own): (usize, &PairLaw)| {
            let of = |given: &Option<Vec<f64>>, own: Option<f64>| {
                given.as_ref().map(|values| values[i]).or(own)
            };
            let springs = own.stiffness;
            law_of(
                of(&friction, None).unwrap_or(own.friction),
                of(&gap_m, None).unwrap_or(own.gap_m),
                of(&normal, springs.map(|s| s.normal_n_m)),
                of(&tangential, springs.map(|s| s.tangential_n_m)),
            )
        };
        let laws: PyResult<Vec<PairLaw>> = laws.iter().enumerate().map(law).collect();
        Ok(self.changed(Problem {
            laws: laws?,
            ..self.problem().clone()
        }))
    }

    /// The same problem with its excitations multiplied by `factor`.
    fn with_excitation_times(&self, factor: f64) -> PyResult<Self> {
        if !factor.is_finite() {
            return Err(value(format!("factor is {factor}; it must be finite")));
        }
        let mut problem = self.problem().clone();
        for load in &mut problem.excitations {
            for part in [&mut load.cosine, &mut load.sine] {
                let values = part.on_x.iter_mut().chain(&mut part.on_modes);
                values.for_each(|v| *v *= factor);
            }
        }
        Ok(self.changed(problem))
    }

    /// Static state under the steady load. It is computed once.
    fn static_state(&self, py: Python<'_>) -> PyResult<PyStaticState> {
        Ok(PyStaticState {
            state: self.state(py)?,
            subject: Arc::clone(&self.subject),
        })
    }

    /// Response at frequencies, or along the curve between the first and the last of them.
    ///
    /// `frequencies_hz` ascend. Each is solved by itself from its neighbour; with `follow=True` the
    /// curve is followed along its length, round folds, from the first to the last, and passes
    /// through those in between. `harmonics` is the number H besides the mean, `samples` that of a
    /// period, by default 128 or 4 (H + 1); `accuracy` asks for as many harmonics as keep the
    /// estimated error of the amplitudes below it, in their place. `eps` is the parameter of the
    /// method (`"dynamic"`, `"pair"` or `"spectral_radius"`), times `eps_scale`. `solver` is
    /// `"newton_krylov"` or `"powell"`. `damping` takes the place of that of the problem. `stability`
    /// chooses the motions whose stability is judged: `"peaks"` (peaks, turning points and ends; every
    /// motion with at most 12 pairs), `"every_point"` or `"none"`.
    #[pyo3(signature = (
        frequencies_hz, *, harmonics=None, samples=None, accuracy=None, follow=false, damping=None,
        eps="dynamic", eps_scale=1.0, tolerance=None, max_newton_iterations=60,
        solver="newton_krylov", slip_threshold_m=None, most_seconds_per_frequency=None,
        stability="peaks", progress=None
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of Python")]
    fn response(
        &self,
        py: Python<'_>,
        frequencies_hz: &Bound<'_, PyAny>,
        harmonics: Option<usize>,
        samples: Option<usize>,
        accuracy: Option<f64>,
        follow: bool,
        damping: Option<&Bound<'_, PyDict>>,
        eps: &str,
        eps_scale: f64,
        tolerance: Option<f64>,
        max_newton_iterations: usize,
        solver: &str,
        slip_threshold_m: Option<f64>,
        most_seconds_per_frequency: Option<f64>,
        stability: &str,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<PyResponse> {
        let frequencies_hz = frequencies_of(frequencies_hz)?;
        if follow && frequencies_hz.len() < 2 {
            return Err(value(
                "a curve is followed between two frequencies: give at least two",
            ));
        }
        let resolution = match accuracy {
            Some(_) if harmonics.is_some() || samples.is_some() => {
                return Err(value(
                    "accuracy chooses harmonics and samples: give one or the other",
                ));
            }
            Some(accuracy) if (1e-8..1.0).contains(&accuracy) => Resolution::Accuracy(accuracy),
            Some(accuracy) => {
                return Err(value(format!(
                    "accuracy is {accuracy}; it must be from 1e-8 to below 1"
                )));
            }
            None => {
                let (harmonics, samples) =
                    resolution_of(harmonics.unwrap_or(3), samples, self.problem())?;
                Resolution::fixed(harmonics, samples)
            }
        };
        let mut settings = SweepSettings::new(frequencies_hz, resolution);
        settings.eps = eps_of(eps, eps_scale)?;
        if let Some(tolerance) = positive("tolerance", tolerance)? {
            settings.newton.tolerance = tolerance;
        }
        settings.newton.max_iterations = max_newton_iterations;
        settings.slip_threshold_m = positive("slip_threshold_m", slip_threshold_m)?;
        settings.most_seconds = positive("most_seconds_per_frequency", most_seconds_per_frequency)?;
        settings.solver = choice_of("solver", solver)?;
        let scope = choice_of::<StabilityScope>("stability", stability)?;
        let state = self.usable_state(py)?;
        let damping = self.rayleigh(py, damping, &state)?;
        let most = resolution.most_harmonics();
        run::check_undamped_modes(
            self.problem(),
            &state,
            damping,
            &settings.frequencies_hz,
            most,
        )
        .map_err(|error| library_error(py, error))?;
        self.fits(py, &settings, most)?;
        let progress = progress.unwrap_or_else(|| PyBool::new(py, true).to_owned().into_any());
        let (response, _) = watched(py, Some(&progress), |wire| {
            self.solve(&settings, (damping, &state), (follow, scope), &wire)
        })?;
        Ok(PyResponse::new(
            response,
            &self.subject,
            Some((damping, state)),
        ))
    }

    /// Balance of one frequency: its residual and Jacobian as functions of U, for a solver of one's
    /// own. The options are those of `response`.
    ///
    /// A response takes eps at the middle of its range, which is `eps_hz`; by default it is taken at
    /// `frequency_hz`. `retained=True` adds the spring that retains the mean along the motions that
    /// only friction holds, as a response does where all pairs slip (`Motion.retention_n` above 0).
    #[pyo3(signature = (
        frequency_hz, harmonics=3, samples=None, *, damping=None, eps="dynamic", eps_scale=1.0,
        eps_hz=None, retained=false
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of Python")]
    fn balance(
        &self,
        py: Python<'_>,
        frequency_hz: f64,
        harmonics: usize,
        samples: Option<usize>,
        damping: Option<&Bound<'_, PyDict>>,
        eps: &str,
        eps_scale: f64,
        eps_hz: Option<f64>,
        retained: bool,
    ) -> PyResult<PyBalance> {
        if !(frequency_hz.is_finite() && frequency_hz > 0.0) {
            return Err(value(format!(
                "frequency_hz is {frequency_hz}; it must be above 0"
            )));
        }
        let (harmonics, samples) = resolution_of(harmonics, samples, self.problem())?;
        let eps = eps_of(eps, eps_scale)?;
        let eps_hz = positive("eps_hz", eps_hz)?.unwrap_or(frequency_hz);
        let mean = if retained { Mean::Retained } else { Mean::Free };
        let state = self.usable_state(py)?;
        let damping = self.rayleigh(py, damping, &state)?;
        let problem = self.problem();
        run::check_undamped_modes(problem, &state, damping, &[frequency_hz], harmonics)
            .map_err(|error| library_error(py, error))?;
        let settings =
            SweepSettings::new(vec![frequency_hz], Resolution::fixed(harmonics, samples));
        self.fits(py, &settings, harmonics)?;
        let balance = quietly(py, || {
            let settings = OneBalanceSettings {
                frequency_hz,
                harmonics,
                samples,
                eps,
                eps_hz,
                mean,
            };
            one_balance(self.problem(), damping, &state, settings)
        })?;
        Ok(PyBalance {
            subject: Arc::clone(&self.subject),
            state,
            balance,
            frequency_hz,
            harmonics,
            last: Mutex::new(None),
        })
    }
}

impl PyProblem {
    /// Checks that the frequencies fit in memory.
    fn fits(&self, py: Python<'_>, settings: &SweepSettings, harmonics: usize) -> PyResult<()> {
        let blocks = blocks(harmonics);
        let asked = memory::check_available(demand::bytes(self.problem(), settings));
        asked.map_err(|source| library_error(py, run::Error::TooLittleMemory { blocks, source }))
    }

    fn solve(
        &self,
        settings: &SweepSettings,
        (damping, state): (Rayleigh, &StaticState),
        (follows, scope): (bool, StabilityScope),
        wire: &crate::running::Wire,
    ) -> Response {
        let solve = if follows { follow } else { sweep };
        // A curve has as many points as it needs.
        let steps = if follows {
            0
        } else {
            settings.frequencies_hz.len()
        };
        let begun = Instant::now();
        wire.start_bar(if follows { "points" } else { "frequencies" }, steps);
        let mut response = solve(self.problem(), damping, state, settings, &[], &|told| {
            wire.on_progress(told);
        });
        wire.ends();
        if let Some(pairs) = &self.subject.pairs {
            ShorterSides::new(pairs).judge_response(&mut response);
        }
        let judged = run::Judged {
            problem: self.problem(),
            damping,
            state,
            scope,
        };
        let named_hz = if follows {
            &settings.frequencies_hz[..]
        } else {
            &[]
        };
        let until = Some(Instant::now() + begun.elapsed());
        judged.judge_response(&mut response, named_hz, settings, until);
        response
    }
}

fn positive(name: &str, given: Option<f64>) -> PyResult<Option<f64>> {
    match given {
        Some(number) if !(number.is_finite() && number > 0.0) => {
            Err(value(format!("{name} is {number}; it must be above 0")))
        }
        given => Ok(given),
    }
}

/// Ascending positive frequencies.
fn frequencies_of(given: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let Given { shape, values } = reals("frequencies_hz", given)?;
    if shape.len() != 1 || values.is_empty() {
        return Err(value(
            "frequencies_hz has to be a list of at least one frequency",
        ));
    }
    if values[0] <= 0.0 || values.windows(2).any(|two| two[0] >= two[1]) {
        return Err(value(
            "frequencies_hz have to be above 0 and ascend: sort them, each once",
        ));
    }
    Ok(values)
}
