//! Gathers the figures that a run tells at its end, as it goes on.

use std::time::SystemTime;

use super::meshed::Meshed;
use super::progress::Progress;
use super::reduced::Reduced;
use super::{Context, fingerprint, hertz, inputs};
use crate::export::manifest::{self, Summary};
use crate::{metrics, version};
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::dlft::StaticState;

/// What is known before anything is computed.
pub(super) fn empty(scene: &Scene, context: &Context) -> Summary {
    Summary {
        version: env!("CARGO_PKG_VERSION").to_string(),
        scene: manifest::SceneSummary {
            name: scene.name.clone(),
            file: context.scene_file.display().to_string(),
            blake3: None,
        },
        reduced_model: match &scene.subject {
            Subject::Assembly(_) => None,
            Subject::ReducedModel(spec) => Some(spec.folder.display().to_string()),
        },
        ..Summary::default()
    }
}

/// The same, with what the run is known by: its scene and the files of that, its program, the time.
pub(super) fn beginning(scene: &Scene, context: &Context) -> Summary {
    let empty = empty(scene, context);
    Summary {
        scene: manifest::SceneSummary {
            blake3: Some(inputs::hash(scene, &context.scene_file)),
            ..empty.scene
        },
        commit: version::commit().map(str::to_owned),
        program_blake3: fingerprint().map(|hash| blake3::Hash::from_bytes(hash).to_string()),
        begun: metrics::universal_time(SystemTime::now()),
        ..empty
    }
}

/// What is known after the reduction.
pub(super) fn of_reduced(scene: &Scene, context: &Context, reduced: &Reduced) -> Summary {
    Summary {
        mesh: reduced.meshed().map(Meshed::summary),
        stuck_modes: Some(reduced.model().stuck_omega2().len()),
        truncation: reduced.truncation(),
        pairs: reduced.pairs.rows.len(),
        prestress_passes: reduced
            .meshed()
            .map_or_else(Vec::new, |m| m.modes.prestress_passes.clone()),
        held_flanks_error: reduced.held_flanks_error(),
        stuck_frequency_hz: reduced.model().omega2.first().copied().map(hertz),
        bonded_pairs: reduced.meshed().map_or(0, |m| m.model.bonded_pairs()),
        excitation_fields: reduced
            .meshed()
            .map_or_else(Vec::new, |m| m.model.maps.clone()),
        observations: match reduced.meshed() {
            Some(meshed) => manifest::observation_summaries(&meshed.model),
            None => manifest::probe_summaries(&reduced.observations()),
        },
        ..empty(scene, context)
    }
}

/// Takes down in the summary what the run has taken so far, stage by stage.
pub(super) fn take_down(progress: &Progress, summary: &mut Summary) {
    let stages = progress.records().into_iter();
    summary.stages = stages
        .map(|record| manifest::StageSummary {
            id: record.stage,
            name: record.name,
            seconds: record.seconds,
            processor_seconds: record.processor_seconds,
            peak_memory_mib: record.peak_rss_mib,
            from_cache: record.from_cache,
            unknowns: record.unknowns,
        })
        .collect();
    summary.seconds = progress.seconds();
    summary.processor_seconds = progress.processor_seconds();
}

/// Where there are pairs.
pub(super) fn static_summary(
    reduced: &Reduced,
    state: &StaticState,
) -> Option<manifest::StaticSummary> {
    let pairs = &reduced.pairs;
    (!pairs.rows.is_empty()).then(|| manifest::static_summary(pairs, state))
}
