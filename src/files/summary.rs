//! Figures of summary.json, collected during a run.

use std::path::Path;
use std::time::SystemTime;

use crate::{metrics, scene_files, version};
use dovetail_cache::fingerprint::fingerprint;
use dovetail_export::manifest::{self, MeshOrigin, StageSummary, Summary, TruncationSummary};
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::results::modes::hertz;
use dovetail_solver::run::{Bodies, Bound, Reduced, StaticResult};

/// Time and stages of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Taken {
    /// Stages that have ended, in the order of their ends.
    pub stages: Vec<StageSummary>,
    /// Wall time, s.
    pub seconds: f64,
    /// Processor time of all threads and of the programs waited for (gmsh), s; `None` if the system
    /// does not provide it.
    pub processor_seconds: Option<f64>,
}

/// Summary at the beginning: the scene and its files, the program, the time.
pub(super) fn beginning(scene: &Scene, scene_file: &Path) -> Summary {
    Summary {
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
    }
}

/// Summary with the figures of the bodies added.
pub(super) fn of_bound(earlier: &Summary, origin: &MeshOrigin, bound: &Bound) -> Summary {
    let model = &bound.model;
    Summary {
        mesh: Some(manifest::mesh_summary(model, &bound.properties, origin)),
        pairs: model.pairs.len(),
        bonded_pairs: model.bonded_pairs(),
        excitation_fields: model.maps.clone(),
        observations: manifest::observation_summaries(model),
        ..earlier.clone()
    }
}

/// Summary with the figures of the reduced model added.
pub(super) fn of_reduced(earlier: &Summary, reduced: &Reduced) -> Summary {
    let modes = reduced.bodies.as_ref().map(|bodies| &bodies.modes);
    Summary {
        stuck_modes: Some(reduced.stuck_omega2().len()),
        truncation: modes.map(|modes| TruncationSummary {
            amplitude: modes.truncation.amplitude,
            frequencies: modes.truncation.frequencies.clone(),
            modes_reach: None,
        }),
        pairs: reduced.pairs.rows.len(),
        prestress_passes: modes.map_or_else(Vec::new, |modes| modes.prestress_passes.clone()),
        held_flanks_error: modes.and_then(|modes| modes.held_flanks_error),
        stuck_frequency_hz: reduced.stuck_omega2().first().copied().map(hertz),
        observations: match reduced.bodies.as_ref().map(Bodies::model) {
            Some(model) => manifest::observation_summaries(model),
            None => manifest::probe_summaries(reduced.observations()),
        },
        ..earlier.clone()
    }
}

/// Adds the figures of the static state.
pub(super) fn of_statics(summary: &mut Summary, reduced: &Reduced, statics: &StaticResult) {
    let (pairs, state) = (&reduced.pairs, &statics.state);
    summary.static_state = (!pairs.rows.is_empty()).then(|| manifest::static_summary(pairs, state));
    if statics.usable().is_ok() {
        let first = reduced.linear_omega2(state).first().copied();
        summary.linear_frequency_hz = first.map(hertz);
    }
}

/// First frequency of the first body, Hz.
pub(super) fn first_hz(held_omega2: &[Vec<f64>]) -> Option<f64> {
    held_omega2.first()?.first().copied().map(hertz)
}
