//! Content of summary.json: the inputs of a run, its duration, and the main figures.
//!
//! A number that does not exist (no converged point, no excitation) or is not finite is `null`.

mod checks;
mod curve;
mod mesh;
mod peak;
mod response;
mod stability;
mod static_state;
mod stress;
mod verification;
mod wear;

pub use self::checks::{Checks, FlankMeshCheck, TractionCheck, Verdict};
pub use self::curve::{CurveSummary, curve_summary};
pub(crate) use self::mesh::BodySummary;
pub use self::mesh::{
    MeshOrigin, MeshSummary, ObservationSummary, mesh_summary, observation_summaries,
    probe_summaries,
};
pub use self::peak::{ContactCounts, ObservedPeak};
pub use self::response::{
    FrettingSummary, ResponseSummary, TractionRangeSummary, fretting_summary, response_summary,
    traction_range,
};
pub use self::stability::{BifurcationSummary, DepartureSummary, PeakStability, TwoPeriodsSummary};
pub use self::static_state::{ContactSummary, StaticSummary, static_summary};
pub use self::stress::{PlaceSummary, RankedBy, StressSummary, stress_summary};
pub use self::verification::{VerificationSummary, verification_summary};
pub use self::wear::{WearSummary, wear_summary};

use serde::{Deserialize, Serialize};

use crate::warning::Warning;
use dovetail_solver::model::FieldMap;
use dovetail_solver::run::{PrestressPass, Stage};

/// Content of summary.json.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Version of the program.
    pub version: String,
    /// Commit that the program was built from; `None` if it is not known.
    pub commit: Option<String>,
    /// Hash of the program, its libraries and the processor, on which the last digits depend, in
    /// hexadecimals; `None` if the system does not provide it.
    pub program_blake3: Option<String>,
    /// Start of the run in universal time: `2026-02-28T23:59:59Z`.
    #[serde(default)]
    pub begun: String,
    /// Scene of the run.
    pub scene: SceneSummary,
    /// Progress of the run.
    pub state: RunState,
    /// Reason why the run failed; else `None`.
    pub why: Option<String>,
    /// Names of the other files in the folder of the run: the files that the run wrote, and those
    /// of an earlier run until they are replaced. If the run is under way, they include the files
    /// that it is about to write.
    pub files: Vec<String>,
    /// Mesh of the scene; `None` without one.
    pub mesh: Option<MeshSummary>,
    /// Folder of the reduced model; `None` if the scene does not use one.
    pub reduced_model: Option<String>,
    /// Number of stuck modes kept; `None` if nothing was reduced yet.
    pub stuck_modes: Option<usize>,
    /// Estimated errors due to the omitted modes, if a mesh was reduced.
    pub truncation: Option<TruncationSummary>,
    /// Number of contact pairs.
    pub pairs: usize,
    /// Passes of the prestress of the static state with contact; empty for other prestress.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prestress_passes: Vec<PrestressPass>,
    /// Estimated relative change of the first stuck frequencies if the stress of the static state
    /// replaced the prestress of the held flanks; `None` for other prestress.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_flanks_error: Option<f64>,
    /// First frequency of the fully stuck assembly, Hz.
    pub stuck_frequency_hz: Option<f64>,
    /// First frequency of the linear reference, Hz: pairs that are open in the static state are
    /// released. `None` if there is no static state yet.
    pub linear_frequency_hz: Option<f64>,
    /// First frequency of the first body with its flanks held, Hz; `None` if it was not requested.
    pub blade_frequency_hz: Option<f64>,
    /// Wall time of the whole run, s.
    pub seconds: f64,
    /// Processor time of all threads and of gmsh, s; `None` if the system does not provide it.
    pub processor_seconds: Option<f64>,
    /// Number of nodes that follow others in bonded contacts; none of them is among `pairs`.
    pub bonded_pairs: usize,
    /// Stages that have ended, in their order.
    pub stages: Vec<StageSummary>,
    /// Static state; `None` if there is none yet.
    #[serde(rename = "static")]
    pub static_state: Option<StaticSummary>,
    /// Response; `None` if there is none yet.
    pub response: Option<ResponseSummary>,
    /// Checks of the peak that need further runs; `None` without a peak or without pairs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checks: Option<Checks>,
    /// Highest stress at the peak; `None` if no fields were asked for, or nothing has stress.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stress: Option<StressSummary>,
    /// Warnings, the most important first.
    #[serde(default)]
    pub warnings: Vec<Warning>,
    /// Figures of `dovetail verify`; `None` for other commands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verification: Option<VerificationSummary>,
    /// Figures of `dovetail wear`; `None` for other commands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wear: Option<WearSummary>,
    /// Figures of `dovetail curve`; `None` for other commands.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<CurveSummary>,
    /// Observed displacements and strains.
    pub observations: Vec<ObservationSummary>,
    /// Fields at points in space that were mapped to surfaces; empty if no excitation has one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub excitation_fields: Vec<FieldMap>,
}

impl Summary {
    /// Returns `true` if there are figures of a run: those of `dovetail run` or `dovetail static`.
    pub(crate) fn is_of_run(&self) -> bool {
        self.static_state.is_some() || self.response.is_some()
    }

    /// This summary with the findings of a command beside its run.
    pub(crate) fn merge_findings(&self, beside: Self) -> Self {
        let summary = self.clone();
        Self {
            blade_frequency_hz: beside.blade_frequency_hz.or(summary.blade_frequency_hz),
            verification: beside.verification.or(summary.verification),
            wear: beside.wear.or(summary.wear),
            curve: beside.curve.or(summary.curve),
            ..summary
        }
    }
}

/// Progress of a run. A killed run leaves `running`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    /// The run is under way, or was killed.
    #[default]
    Running,
    /// All results are there.
    Finished,
    /// Ended by Ctrl-C or SIGTERM.
    Interrupted,
    /// Ended by an error.
    Failed,
}

/// Scene of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneSummary {
    /// Name of the scene.
    pub name: String,
    /// Path of the scene file.
    pub file: String,
    /// Hash of the scene as it was read, with all settings of the command line, and of the files
    /// that it names, in hexadecimals.
    pub blake3: Option<String>,
}

impl SceneSummary {
    /// Returns `true` if both are the same scene with the same settings and files.
    pub(crate) fn is_same_scene(&self, other: &Self) -> bool {
        self.name == other.name && self.blake3.is_some() && self.blake3 == other.blake3
    }
}

/// Estimated errors due to the modes that a reduction leaves out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TruncationSummary {
    /// Estimated relative error of the amplitudes of observed points on the linear curve; `None` if
    /// the stuck modes end below its highest frequency.
    pub amplitude: Option<f64>,
    /// Estimated relative errors of the first stuck frequencies due to bodies with
    /// `fixed_interface_modes`.
    pub frequencies: Vec<f64>,
    /// Frequency of the last stuck mode over that of the highest harmonic of the response; `None`
    /// before there is a response, and if no mode was left out.
    pub modes_reach: Option<f64>,
}

/// Wall time and peak memory of one stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageSummary {
    /// Identifier for programs: it stays when the name changes.
    pub id: Stage,
    /// Name of the stage for users.
    pub name: String,
    /// Wall time, s.
    pub seconds: f64,
    /// Processor time of all threads and of gmsh, s; `None` if the system does not provide it.
    pub processor_seconds: Option<f64>,
    /// Peak memory of the process up to the end of the stage; `None` if the system does not provide
    /// it.
    pub peak_memory_mib: Option<f64>,
    /// True if the result of the stage was kept from an earlier run.
    pub from_cache: bool,
    /// Unknowns of each system that the stage solves, the largest first.
    pub unknowns: Vec<usize>,
}

fn finite(v: f64) -> Option<f64> {
    v.is_finite().then_some(v)
}
