//! Figures of summary.json, collected during a run.

use std::path::Path;
use std::time::SystemTime;

use crate::{metrics, scene_files, version};
use dovetail_cache::fingerprint::fingerprint;
use dovetail_export::manifest::{self, MeshOrigin, StageSummary, Summary, TruncationSummary};
use dovetail_export::warning::{Warning, sorted_by_weight};
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::results::modes::{NaturalFrequency, hertz};
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::results::resultants::Resultant;
use dovetail_solver::run::{Bodies, Bound, PeakStress, ReducedScene, StaticResult};

/// Time and stages of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunTimes {
    /// Stages that have ended, in the order of their ends.
    pub stages: Vec<StageSummary>,
    /// Wall time, s.
    pub seconds: f64,
    /// Processor time of all threads and of the programs waited for (gmsh), s; `None` if the system
    /// does not provide it.
    pub processor_seconds: Option<f64>,
}

/// Figures of a run so far, for summary.json and the report.
#[derive(Debug, Default)]
pub(super) struct SummaryFigures {
    /// If the run fails, these are all.
    pub summary: Summary,
    /// Origin of the mesh.
    pub origin: MeshOrigin,
    pub warnings: Vec<Warning>,
    /// Rows of modes.csv.
    pub modes: Vec<NaturalFrequency>,
    /// The 2H+1 nodal fields of each body at the peak, if fields are written.
    pub motion: Option<Vec<Vec<NodalField>>>,
    /// Stress of each body at the peak, if fields are written.
    pub stress: Option<PeakStress>,
    /// Forces of contacts, supports and springs: those in the static state until the peak is known.
    pub forces: Vec<Resultant>,
}

impl SummaryFigures {
    /// Figures at the beginning: the scene and its files, the program, the time.
    pub fn new(scene: &Scene, scene_file: &Path) -> Self {
        let summary = Summary {
            version: env!("CARGO_PKG_VERSION").to_string(),
            scene: manifest::SceneSummary {
                name: scene.name.clone(),
                file: scene_file.display().to_string(),
                blake3: scene_files::hash(scene, scene_file),
            },
            reduced_model: match &scene.subject {
                Subject::Assembly(_) => None,
                Subject::ReducedModel(spec) => Some(spec.folder.display().to_string()),
            },
            commit: version::commit().map(str::to_owned),
            program_blake3: fingerprint().map(|hash| blake3::Hash::from_bytes(hash).to_string()),
            begun: metrics::universal_time(SystemTime::now()),
            ..Summary::default()
        };
        Self {
            summary,
            ..Self::default()
        }
    }

    /// Summary with the warnings.
    pub fn summary(&self) -> Summary {
        Summary {
            warnings: sorted_by_weight(&self.warnings)
                .into_iter()
                .cloned()
                .collect(),
            ..self.summary.clone()
        }
    }

    /// Adds the figures of the bodies.
    pub fn add_bodies(&mut self, bound: &Bound) {
        let (model, summary) = (&bound.model, &mut self.summary);
        let mesh = manifest::mesh_summary(model, &bound.properties, &self.origin);
        summary.mesh = Some(mesh);
        summary.pairs = model.pairs.len();
        summary.bonded_pairs = model.bonded_pairs();
        summary.excitation_fields.clone_from(&model.maps);
        summary.observations = manifest::observation_summaries(model);
    }

    /// Adds the figures of the reduced model.
    pub fn add_reduced_model(&mut self, reduced: &ReducedScene) {
        let modes = reduced.bodies.as_ref().map(|bodies| &bodies.modes);
        let summary = &mut self.summary;
        summary.stuck_modes = Some(reduced.stuck_omega2().len());
        summary.truncation = modes.map(|modes| TruncationSummary {
            amplitude: modes.truncation.amplitude,
            frequencies: modes.truncation.frequencies.clone(),
            modes_reach: None,
        });
        summary.pairs = reduced.pairs.rows.len();
        summary.prestress_passes =
            modes.map_or_else(Vec::new, |modes| modes.prestress_passes.clone());
        summary.held_flanks_error = modes.and_then(|modes| modes.held_flanks_error);
        summary.stuck_frequency_hz = reduced.stuck_omega2().first().copied().map(hertz);
        summary.observations = match reduced.bodies.as_ref().map(Bodies::model) {
            Some(model) => manifest::observation_summaries(model),
            None => manifest::probe_summaries(reduced.observations()),
        };
    }

    /// Adds the figures of the static state.
    pub fn add_static_state(&mut self, reduced: &ReducedScene, statics: &StaticResult) {
        let (pairs, state) = (&reduced.pairs, &statics.state);
        let figures = (!pairs.rows.is_empty()).then(|| manifest::static_summary(pairs, state));
        self.summary.static_state = figures;
        if statics.usable().is_ok() {
            let first = reduced.linear_omega2(state).first().copied();
            self.summary.linear_frequency_hz = first.map(hertz);
        }
    }
}

/// First frequency of the first body, Hz.
pub(super) fn first_hz(held_omega2: &[Vec<f64>]) -> Option<f64> {
    held_omega2.first()?.first().copied().map(hertz)
}
