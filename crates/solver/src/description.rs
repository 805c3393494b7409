//! One run as a value: the vibrating bodies, their damping, and the response asked for.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::contact::PairLaw;
use crate::damping::DampingSpec;
use crate::dlft::eps::Eps;
use crate::dlft::settings::{EpsChoice, Resolution, Solver, StabilityScope};
use crate::dlft::static_state::LoadPath;
use crate::dlft::sweep::SweepSettings;
use crate::model::Assembly;

/// Complete description of a run, in SI units, with the names of mesh groups still unresolved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scene {
    /// Name of the run: the default output folder is `output/<name>`.
    pub name: String,
    /// Bodies or reduced model that vibrates.
    pub subject: Subject,
    /// Damping of the bodies.
    pub damping: DampingSpec,
    /// Damping ratios of the first modes with all pairs stuck, which these modes have in place of
    /// `damping`; empty: none.
    pub modal_ratios: Vec<f64>,
    /// Settings of the static state under steady load.
    pub static_state: StaticSpec,
    /// Settings of the response.
    pub response: ResponseSpec,
    /// Engine orders whose crossings with modes are found over the speed; empty for those that a
    /// caller asks for.
    pub engine_orders: Vec<ExcitedOrder>,
    /// Vibrations that wear the contacts in turn; empty for the peak alone.
    pub mission: Vec<MissionPart>,
}

impl Scene {
    /// Scene without damping, with the defaults of a scene file. Fields and the methods of their
    /// names change them.
    pub fn new(
        name: impl Into<String>,
        subject: impl Into<Subject>,
        response: ResponseSpec,
    ) -> Self {
        Self {
            name: name.into(),
            subject: subject.into(),
            damping: DampingSpec::default(),
            modal_ratios: Vec::new(),
            static_state: StaticSpec::default(),
            response,
            engine_orders: Vec::new(),
            mission: Vec::new(),
        }
    }

    /// The same scene with this damping.
    #[must_use]
    pub fn damping(self, damping: DampingSpec) -> Self {
        Self { damping, ..self }
    }

    /// Mesh and all that refers to it; `None` for a scene about a reduced model.
    pub fn assembly(&self) -> Option<&Assembly> {
        match &self.subject {
            Subject::Assembly(assembly) => Some(assembly),
            Subject::ReducedModel(_) => None,
        }
    }

    /// The same scene with all sectors of its disc, if any, excited in phase, and in still air.
    pub(crate) fn sectors_in_phase(&self) -> Self {
        let mut scene = self.clone();
        if let Subject::Assembly(assembly) = &mut scene.subject
            && let Some(disc) = &mut assembly.cyclic
        {
            disc.engine_order = 0;
            disc.influence = None;
        }
        scene
    }
}

/// Vibration that the parts of an assembly spend a share of their cycles in.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MissionPart {
    /// Cycles in it, relative to those of the other parts.
    pub share: f64,
    /// Frequency, Hz; `None`: that of the peak.
    pub frequency_hz: Option<f64>,
    /// Factor on the amplitudes of all excitations.
    pub force_scale: f64,
}

impl MissionPart {
    /// All cycles at one frequency, Hz, or at the peak.
    pub const fn whole_mission(frequency_hz: Option<f64>) -> Self {
        Self {
            share: 1.0,
            frequency_hz,
            force_scale: 1.0,
        }
    }
}

/// Subject of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Subject {
    /// Bodies of a mesh.
    Assembly(Box<Assembly>),
    /// Reduced model of bodies that are not described further.
    ReducedModel(ReducedModelSpec),
}

impl From<Assembly> for Subject {
    fn from(assembly: Assembly) -> Self {
        Self::Assembly(Box::new(assembly))
    }
}

impl From<ReducedModelSpec> for Subject {
    fn from(spec: ReducedModelSpec) -> Self {
        Self::ReducedModel(spec)
    }
}

/// Reduced model of a folder, which the caller of a run reads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReducedModelSpec {
    /// Folder of its files.
    pub folder: PathBuf,
    /// Contact law of every pair.
    pub law: PairLaw,
    /// Factor on the unit excitation of the folder, N.
    pub force_n: f64,
}

/// Settings of the static state under rotation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StaticSpec {
    /// Number of equal steps of each leg of the path.
    pub load_steps: usize,
    /// Points that the load goes through, from no load on, before it ends at the steady load; empty:
    /// it rises to the steady load.
    pub path: Vec<PathPoint>,
    /// Number of other starting tractions from which the response is computed once more.
    pub starting_tractions: usize,
}

impl Default for StaticSpec {
    /// Ten load steps to the steady load.
    fn default() -> Self {
        Self {
            load_steps: LoadPath::STEPS,
            path: Vec::new(),
            starting_tractions: 0,
        }
    }
}

/// Point of the path by which the steady load comes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathPoint {
    /// Speed of rotation whose centrifugal load acts, rad/s; `None`: that of the rotation.
    pub speed_rad_s: Option<f64>,
    /// Multiples of the steady loads besides that of the rotation; of a reduced model that is read,
    /// of its whole steady load.
    pub loads: LoadMultiples,
}

/// Multiples of steady loads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum LoadMultiples {
    /// All loads have this multiple.
    All(f64),
    /// One multiple for each load, in their order.
    Each(Vec<f64>),
}

impl LoadMultiples {
    /// Multiple of the load with this number, counted from 0; 1 where none is given.
    pub(crate) fn multiple(&self, number: usize) -> f64 {
        match self {
            Self::All(multiple) => *multiple,
            Self::Each(multiples) => multiples.get(number).copied().unwrap_or(1.0),
        }
    }
}

/// Response over a range of frequencies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResponseSpec {
    /// First and last frequency.
    pub range: FrequencyRange,
    /// Number of frequencies of a grid, evenly spaced, of which each is solved by itself; `None`: the
    /// curve is followed along its length, round folds, with points where it bends.
    pub points: Option<usize>,
    /// Engine order that the response is along: the speed of rotation moves with the frequency.
    /// `None`: the speed stays.
    pub along_engine_order: Option<EngineOrder>,
    /// Harmonics and samples, or the accuracy asked for.
    pub resolution: Resolution,
    /// Number of harmonics of a second response, which is drawn beside the first.
    pub compare_harmonics: Option<usize>,
    /// Choice of the parameter eps of DLFT.
    pub eps: EpsChoice,
    /// Factor on eps (1 = the choice itself).
    pub eps_scale: f64,
    /// Relative residual below which a frequency has converged: the larger of |f_0| / |F| and
    /// |f_1..H| / |F_1..H|.
    pub tolerance: f64,
    /// Most Newton iterations of one attempt at a frequency.
    pub max_newton_iterations: usize,
    /// Seconds after which a frequency is given up; `None`: no limit.
    pub most_seconds_per_frequency: Option<f64>,
    /// Method that solves the balance of a frequency.
    pub solver: Solver,
    /// Number of stuck modes kept. `None` keeps the number that
    /// [`StuckModes`](crate::reduction::StuckModes) gives, and all modes of a reduced model that is
    /// read.
    pub stuck_modes: Option<usize>,
    /// Distance beyond which a pair slips in a period, m; `None`: 1e-5 of the largest static
    /// slip, or 1e-9 of the largest elastic compression where that is longer.
    pub slip_threshold_m: Option<f64>,
    /// Motions whose stability is judged.
    pub stability: StabilityScope,
}

impl ResponseSpec {
    /// Response over a range with the defaults of a scene: the curve is followed.
    ///
    /// ```
    /// use dovetail_solver::description::{FrequencyRange, ResponseSpec};
    /// use dovetail_solver::dlft::settings::Resolution;
    ///
    /// let range = FrequencyRange::hz(440.0, 460.0);
    /// let curve = ResponseSpec::new(range, Resolution::fixed(3, 128));
    /// assert_eq!(curve.points, None);
    /// assert_eq!(curve.points(200).points, Some(200));
    /// ```
    pub fn new(range: FrequencyRange, resolution: Resolution) -> Self {
        Self {
            range,
            points: None,
            along_engine_order: None,
            resolution,
            compare_harmonics: None,
            eps: EpsChoice::default(),
            eps_scale: Eps::SCALE,
            tolerance: resolution.tolerance(),
            max_newton_iterations: SweepSettings::MOST_ITERATIONS,
            most_seconds_per_frequency: None,
            solver: Solver::default(),
            stuck_modes: None,
            slip_threshold_m: None,
            stability: StabilityScope::default(),
        }
    }
}

impl ResponseSpec {
    /// The same response at so many frequencies, evenly spaced.
    #[must_use]
    pub fn points(self, points: usize) -> Self {
        let points = Some(points);
        Self { points, ..self }
    }
}

/// Excitation of so many cycles per revolution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct EngineOrder(pub usize);

impl EngineOrder {
    /// Frequency at a speed of rotation, Hz.
    ///
    /// ```
    /// use dovetail_solver::description::EngineOrder;
    ///
    /// assert_eq!(EngineOrder(4).frequency_hz(3000.0), 200.0);
    /// assert_eq!(EngineOrder(4).speed_rpm(200.0), 3000.0);
    /// ```
    pub fn frequency_hz(self, speed_rpm: f64) -> f64 {
        self.0 as f64 * speed_rpm / 60.0
    }

    /// Speed of rotation at a frequency, rpm, to twelve digits: a speed from which the frequency was
    /// made comes back as it was.
    pub fn speed_rpm(self, frequency_hz: f64) -> f64 {
        let speed_rpm = 60.0 * frequency_hz / self.0 as f64;
        format!("{speed_rpm:.11e}").parse().unwrap_or(speed_rpm)
    }
}

/// Engine order with the excitation of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ExcitedOrder {
    /// Engine order.
    pub order: EngineOrder,
    /// Factor on all excitations of the scene at this engine order; `None`: its crossings have no
    /// peaks.
    pub times: Option<f64>,
}

/// First and last frequency of a response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum FrequencyRange {
    /// Frequencies in hertz.
    Hz {
        /// First frequency.
        from_hz: f64,
        /// Last frequency.
        to_hz: f64,
    },
    /// Multiples of the first frequency of the [linear reference](crate::problem::LinearReference).
    OfFirstLinearMode {
        /// First multiple.
        from: f64,
        /// Last multiple.
        to: f64,
    },
}

impl FrequencyRange {
    /// Range between two frequencies, Hz.
    pub const fn hz(from_hz: f64, to_hz: f64) -> Self {
        Self::Hz { from_hz, to_hz }
    }

    /// Range between two multiples of the first frequency of the linear reference.
    pub const fn relative_to_first_mode(from: f64, to: f64) -> Self {
        Self::OfFirstLinearMode { from, to }
    }
}

#[cfg(test)]
mod tests {
    use super::EngineOrder;

    #[test]
    fn a_speed_comes_back_from_its_frequency() {
        for order in [1, 3, 7, 36] {
            let order = EngineOrder(order);
            for speed_rpm in [0.1, 3010.0, 4999.9, 12345.6789] {
                assert_eq!(order.speed_rpm(order.frequency_hz(speed_rpm)), speed_rpm);
            }
        }
        assert_eq!(EngineOrder(4).frequency_hz(3000.0), 200.0);
    }
}
