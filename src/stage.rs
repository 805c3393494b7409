//! Names the parts of a run, so that no program has to guess them.

use serde::{Deserialize, Serialize};

/// What a run does, part by part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    Mesh,
    Model,
    FiniteElements,
    Reduction,
    /// What the reduction made is kept for later runs.
    Keeping,
    /// The way back from the reduced model is taken from the cache.
    Recovery,
    /// A reduced model is read.
    ReducedModel,
    ReducedModelFiles,
    /// Modes of each body by itself, its flanks held.
    HeldModes,
    ModesAtSpeeds,
    StaticState,
    StaticFiles,
    Response,
    ResponseFiles,
    TimeIntegration,
}

impl Stage {
    pub const ALL: [Self; 15] = [
        Self::Mesh,
        Self::Model,
        Self::FiniteElements,
        Self::Reduction,
        Self::Keeping,
        Self::Recovery,
        Self::ReducedModel,
        Self::ReducedModelFiles,
        Self::HeldModes,
        Self::ModesAtSpeeds,
        Self::StaticState,
        Self::StaticFiles,
        Self::Response,
        Self::ResponseFiles,
        Self::TimeIntegration,
    ];

    /// For programs, in summary.json: it stays when a title changes.
    pub fn id(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Model => "model",
            Self::FiniteElements => "finite_elements",
            Self::Reduction => "reduction",
            Self::Keeping => "keeping",
            Self::Recovery => "recovery",
            Self::ReducedModel => "reduced_model",
            Self::ReducedModelFiles => "reduced_model_files",
            Self::HeldModes => "held_modes",
            Self::ModesAtSpeeds => "modes_at_speeds",
            Self::StaticState => "static_state",
            Self::StaticFiles => "static_files",
            Self::Response => "response",
            Self::ResponseFiles => "response_files",
            Self::TimeIntegration => "time_integration",
        }
    }

    pub fn of_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.id() == id)
    }

    /// For readers, where a run has no better one.
    pub fn title(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Model => "model",
            Self::FiniteElements => "finite elements",
            Self::Reduction => "reduction",
            Self::Keeping => "cache",
            Self::Recovery => "recovery",
            Self::ReducedModel => "reduced model",
            Self::ReducedModelFiles => "files of the reduced model",
            Self::HeldModes => "modes of each body, flanks held",
            Self::ModesAtSpeeds => "modes at each speed",
            Self::StaticState => "static state",
            Self::StaticFiles => "static files",
            Self::Response => "response",
            Self::ResponseFiles => "response files",
            Self::TimeIntegration => "time integration",
        }
    }
}

/// A finished stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageRecord {
    pub stage: Stage,
    /// Its title.
    pub name: String,
    /// Wall clock.
    pub seconds: f64,
    /// Of all threads, and of a program waited for (gmsh); `None` where the system does not tell.
    pub processor_seconds: Option<f64>,
    /// Largest resident memory of the process up to the end of the stage, MiB; `None` where the
    /// system does not tell.
    pub peak_rss_mib: Option<f64>,
    /// What it makes was kept from an earlier run.
    pub from_cache: bool,
    /// Unknowns of each system that it solves, the largest first.
    pub unknowns: Vec<usize>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_lead_back_to_their_stage() {
        for stage in Stage::ALL {
            assert_eq!(Stage::of_id(stage.id()), Some(stage));
            let written = serde_json::to_value(stage).unwrap();
            assert_eq!(written, stage.id());
            assert_eq!(serde_json::from_value::<Stage>(written).unwrap(), stage);
        }
        assert_eq!(Stage::of_id("response, 3 harmonics"), None);
    }
}
