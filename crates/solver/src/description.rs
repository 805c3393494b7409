//! One run as a value: what vibrates, how it is damped, and which response is asked for.

use std::path::PathBuf;

use crate::contact::PairLaw;
use crate::dlft::settings::{EpsChoice, Resolution, Solver};
use crate::model::Assembly;
use crate::reduction::damping::DampingSpec;

/// Everything one run depends on, in SI units, with the names of mesh groups still unresolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name of the run: the default output folder is `output/<name>`.
    pub name: String,
    /// What vibrates.
    pub subject: Subject,
    /// How it is damped.
    pub damping: DampingSpec,
    /// How the state under steady load is found.
    pub static_state: StaticSpec,
    /// Which response is asked for.
    pub response: ResponseSpec,
}

impl Scene {
    /// The mesh and all that refers to it, where the scene is about one.
    pub fn assembly(&self) -> Option<&Assembly> {
        match &self.subject {
            Subject::Assembly(assembly) => Some(assembly),
            Subject::ReducedModel(_) => None,
        }
    }
}

/// What vibrates.
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// Bodies of a mesh.
    Assembly(Box<Assembly>),
    /// What a reduction has left of bodies that are not described further.
    ReducedModel(ReducedModelSpec),
}

/// A reduced model read from a folder (its files: `reduction::superelement`).
#[derive(Debug, Clone, PartialEq)]
pub struct ReducedModelSpec {
    /// Where its files are.
    pub folder: PathBuf,
    /// The contact law of every pair.
    pub law: PairLaw,
    /// The folder's unit excitation is multiplied by this.
    pub force_n: f64,
}

/// Static state under rotation.
#[derive(Debug, Clone, PartialEq)]
pub struct StaticSpec {
    /// The load is applied in this many equal steps.
    pub load_steps: usize,
}

impl Default for StaticSpec {
    /// Ten load steps.
    fn default() -> Self {
        Self { load_steps: 10 }
    }
}

/// A response over a range of frequencies.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseSpec {
    /// First and last frequency.
    pub range: FrequencyRange,
    /// Number of frequencies, evenly spaced.
    pub points: usize,
    /// Frequencies that may be added at the peaks of the observed amplitudes.
    pub most_added_points: usize,
    /// Harmonics and samples, or the accuracy asked for.
    pub resolution: Resolution,
    /// A second response with this many harmonics, drawn beside the first.
    pub compare_harmonics: Option<usize>,
    /// The choice of the parameter eps of DLFT.
    pub eps: EpsChoice,
    /// eps is multiplied by this (1 = the choice itself).
    pub eps_scale: f64,
    /// Converged when the relative residual is below this: the larger of |f_0| / |F| and
    /// |f_1..H| / |F_1..H|.
    pub tolerance: f64,
    /// Most Newton iterations of one attempt at a frequency.
    pub max_newton_iterations: usize,
    /// A frequency is given up after so many seconds; `None`: never.
    pub most_seconds_per_frequency: Option<f64>,
    /// What solves the balance of a frequency.
    pub solver: Solver,
    /// Stuck modes kept; `None` keeps as many as [`StuckModes`](crate::reduction::StuckModes) says, and all of those of a
    /// reduced model that is read.
    pub stuck_modes: Option<usize>,
    /// A pair slips in a period when it slides farther than this, m; `None`: 1e-5 of the largest
    /// static slip.
    pub slip_threshold_m: Option<f64>,
}

impl ResponseSpec {
    /// A response over a range, with everything else as a scene has it that asks for no more: 200 frequencies, and up
    /// to 12 more at peaks.
    pub fn new(range: FrequencyRange, resolution: Resolution) -> Self {
        Self {
            range,
            points: 200,
            most_added_points: 12,
            resolution,
            compare_harmonics: None,
            eps: EpsChoice::Dynamic,
            eps_scale: 1.0,
            tolerance: resolution.tolerance(),
            max_newton_iterations: 60,
            most_seconds_per_frequency: None,
            solver: Solver::NewtonKrylov,
            stuck_modes: None,
            slip_threshold_m: None,
        }
    }
}

/// First and last frequency of a response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrequencyRange {
    /// In hertz.
    Hz {
        /// First.
        from_hz: f64,
        /// Last.
        to_hz: f64,
    },
    /// Multiples of the first frequency of the [linear reference](crate::problem::LinearReference).
    OfFirstLinearMode {
        /// First.
        from: f64,
        /// Last.
        to: f64,
    },
}
