//! What a run writes, and the figures that it tells at its end.

use std::path::{Path, PathBuf};

use faer::Mat;

use super::meshed::Meshed;
use super::meshing::create_folder;
use super::reduced::Reduced;
use super::{Options, hertz};
use crate::error::Error;
use crate::export::manifest::{self, Summary};
use crate::export::plots::{
    AmplitudeScale, response_curve, stuck_curve, write_dissipation_map, write_response_plot,
    write_separation_map, write_static_pressure_map,
};
use crate::export::{csv, flank, vtu};
use crate::observer::{Compared, Observer};
use crate::progress::Progress;
use crate::stage::Stage;
use dovetail_solver::description::{Scene, Subject};
use dovetail_solver::dlft::settings::Resolution;
use dovetail_solver::dlft::{Orbit, Outcome, Response, StaticState};
use dovetail_solver::fem::{expand_to_nodes, stress};
use dovetail_solver::model::Model;
use dovetail_solver::reduction::superelement::{self, Superelement};
use dovetail_solver::reduction::{PairLaw, Recovery};
use dovetail_solver::results::quantities::{pair_counts, peak};
use dovetail_solver::results::recovery::NodalField;

/// Frames of the animation of the peak.
const FRAMES: usize = 24;

/// An observer that keeps what it hears in files of one folder.
#[derive(Debug)]
pub struct Files {
    out: PathBuf,
    /// Of plots.
    title: String,
    /// Whether fields for ParaView are written.
    fields: bool,
}

impl Files {
    pub fn new(scene: &Scene, options: &Options) -> Self {
        Self {
            out: options.out.clone(),
            title: scene.name.clone(),
            fields: options.fields,
        }
    }

    /// The way back to the bodies, where fields are written.
    fn recovery<'r>(&self, reduced: &'r Reduced) -> Option<&'r Recovery> {
        reduced.meshed().filter(|_| self.fields)?.recovery()
    }

    /// summary.json.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn finish(&self, summary: &Summary) -> Result<(), Error> {
        Ok(manifest::write_summary(
            &self.out.join("summary.json"),
            summary,
        )?)
    }
}

impl Observer for Files {
    /// modes.csv.
    fn reduced(&mut self, reduced: &Reduced) -> Result<(), Error> {
        self.held_modes(reduced, &[])
    }

    fn static_state(&mut self, reduced: &Reduced, state: &StaticState) -> Result<(), Error> {
        let recovery = self.recovery(reduced);
        let recovery = recovery.filter(|_| state.outcome.is_converged());
        write_static_state(&self.out, reduced, recovery, state)
    }

    fn response(
        &mut self,
        reduced: &Reduced,
        response: &Response,
        compared: Option<&Compared>,
    ) -> Result<(), Error> {
        let (out, names) = (&self.out, reduced.observations());
        csv::write_response(&out.join("response.csv"), &names, response)?;
        if let Some(Compared {
            harmonics,
            response,
        }) = compared
        {
            let file = format!("response_h{harmonics}.csv");
            csv::write_response(&out.join(file), &names, response)?;
        }
        csv::write_contact(&out.join("contact.csv"), &reduced.pairs, response)?;
        write_curves(out, &self.title, &names, response, compared)?;
        if let Some(meshed) = reduced.meshed() {
            write_response_on_mesh(out, &meshed.model, self.recovery(reduced), response)?;
        }
        Ok(())
    }

    /// modes.csv once more, with the modes of the bodies.
    fn held_modes(&mut self, reduced: &Reduced, omega2: &[Vec<f64>]) -> Result<(), Error> {
        let rows = mode_rows(reduced, omega2);
        Ok(csv::write_modes(&self.out.join("modes.csv"), &rows)?)
    }
}

/// Rows of modes.csv; `held` are squared frequencies per body with the contacts held.
pub(super) fn mode_rows(reduced: &Reduced, held: &[Vec<f64>]) -> Vec<csv::ModeRow> {
    let mut rows = Vec::new();
    let mut add = |kind: &str, body: &str, omega2: &[f64]| {
        for (i, w2) in omega2.iter().enumerate() {
            rows.push(csv::ModeRow {
                kind: kind.to_string(),
                body: body.to_string(),
                mode: i + 1,
                frequency_hz: hertz(*w2),
            });
        }
    };
    if let Some(meshed) = reduced.meshed() {
        let bodies = &meshed.model.bodies;
        for (body, omega2) in bodies.iter().zip(held) {
            add("flanks_held", &body.name, omega2);
        }
        for (body, omega2) in bodies.iter().zip(&meshed.modes.fixed_interface_omega2) {
            add("fixed_interface", &body.name, omega2);
        }
    }
    add("stuck", "assembly", reduced.stuck_omega2());
    rows
}

fn write_static_state(
    out: &Path,
    reduced: &Reduced,
    recovery: Option<&Recovery>,
    state: &StaticState,
) -> Result<(), Error> {
    csv::write_static(&out.join("static.csv"), &reduced.pairs, state)?;
    let Some(Meshed { model, .. }) = reduced.meshed() else {
        return Ok(());
    };
    let opens = !model.pairs.is_empty();
    if opens {
        write_static_pressure_map(&out.join("plots/static_pressure.svg"), model, state)?;
    }
    let Some(recovery) = recovery else {
        return Ok(());
    };
    if opens {
        flank::write_flank_static(&out.join("flank_static.vtu"), model, state)?;
    }
    let free = recovery.full_static(&state.x);
    let fields: Vec<_> = model
        .bodies
        .iter()
        .zip(&free)
        .map(|(body, free)| {
            let displacement = expand_to_nodes(&body.dofs, free);
            let at_elements = stress::stress(body, &displacement);
            let von_mises: Vec<f64> = stress::nodal_stress(body, &displacement)
                .into_iter()
                .map(stress::von_mises)
                .collect();
            (displacement, at_elements, von_mises)
        })
        .collect();
    let displacements: Vec<&[[f64; 3]]> = fields.iter().map(|f| &f.0[..]).collect();
    csv::write_static_observations(&out.join("static_observed.csv"), model, &displacements)?;
    let fields = fields.iter();
    let fields = fields.map(|(displacement, stress, von_mises)| vtu::StaticBodyFields {
        displacement_m: displacement,
        stress_pa: stress,
        von_mises_pa: von_mises,
    });
    vtu::write_static(&out.join("static.vtu"), model, &fields.collect::<Vec<_>>())?;
    Ok(())
}

/// Maps of the flanks; with `recovery` the flanks at each frequency and the motion of the bodies at the peak.
fn write_response_on_mesh(
    out: &Path,
    model: &Model,
    recovery: Option<&Recovery>,
    response: &Response,
) -> Result<(), Error> {
    if !model.pairs.is_empty() {
        write_separation_map(&out.join("plots/fig5_separation.svg"), model, response)?;
        write_dissipation_map(&out.join("plots/fig6_dissipation.svg"), model, response)?;
    }
    let Some(recovery) = recovery else {
        return Ok(());
    };
    if !model.pairs.is_empty() {
        flank::write_flank_series(out, model, response)?;
        flank::write_flank_dissipation(&out.join("flank_dissipation.vtu"), model, response)?;
    }
    if let Some(peak) = peak(response, 0) {
        write_peak_motion(out, model, recovery, &response.orbits[peak.index])?;
    }
    Ok(())
}

/// Amplitude against frequency, per observation.
fn write_curves(
    out: &Path,
    title: &str,
    names: &[&str],
    response: &Response,
    compared: Option<&Compared>,
) -> Result<(), Error> {
    let label = |h: usize| format!("H = {h}");
    for (i, name) in names.iter().enumerate() {
        let quantity = format!("amplitude of {name}");
        let stuck = stuck_curve("linear (stuck)", response, i);
        let own = response_curve(&harmonics_label(response), response, i);
        let mut plots = vec![("fig4", vec![stuck.clone(), own.clone()])];
        if let Some(Compared {
            harmonics,
            response,
        }) = compared
        {
            let other = response_curve(&label(*harmonics), response, i);
            plots[0].1.insert(1, other.clone());
            plots.push(("fig3", vec![stuck, other]));
        }
        for (figure, curves) in plots {
            let path = out.join(format!("plots/{figure}_{name}.svg"));
            let scale = AmplitudeScale::Linear;
            write_response_plot(&path, title, &quantity, &curves, scale)?;
        }
    }
    Ok(())
}

/// `H = 3`, or `H = 1 to 7` where the frequencies chose their own.
fn harmonics_label(response: &Response) -> String {
    let harmonics = || response.orbits.iter().map(|o| o.harmonics);
    let (least, most) = (harmonics().min(), harmonics().max());
    match (least.unwrap_or(0), most.unwrap_or(0)) {
        (least, most) if least == most => format!("H = {most}"),
        (least, most) => format!("H = {least} to {most}"),
    }
}

/// Both bodies over one period of an orbit.
fn write_peak_motion(
    out: &Path,
    model: &Model,
    recovery: &Recovery,
    orbit: &Orbit,
) -> Result<(), Error> {
    let blocks = 2 * orbit.harmonics + 1;
    let columns = |v: &[f64]| {
        let rows = v.len() / blocks;
        Mat::from_fn(rows, blocks, |i, j| v[j * rows + i])
    };
    let motion = recovery.full_motion(columns(&orbit.x).as_ref(), columns(&orbit.modal).as_ref());
    // The mean: what the static load does to the interior is not in the modes.
    let n = orbit.x.len() / blocks;
    let mean = recovery.full_static(&orbit.x[..n]);
    let fields: Vec<Vec<NodalField>> = model
        .bodies
        .iter()
        .zip(motion.iter().zip(&mean))
        .map(|(body, (motion, mean))| {
            let harmonic = (1..blocks).map(|j| expand_to_nodes(&body.dofs, motion.col_as_slice(j)));
            std::iter::once(expand_to_nodes(&body.dofs, mean))
                .chain(harmonic)
                .collect()
        })
        .collect();
    vtu::write_motion(out, "peak", model, &fields, orbit.frequency_hz, FRAMES)?;
    Ok(())
}

/// The folder of `dovetail reduce`; the law of its pairs, where they all have the same.
pub(super) fn write_reduced_model(
    options: &Options,
    reduced: &Reduced,
    progress: &Progress,
) -> Result<Option<PairLaw>, Error> {
    let _stage = progress.stage(Stage::ReducedModelFiles);
    create_folder(&options.out)?;
    let (relative, rows) = (reduced.relative(), &reduced.pairs.rows);
    let element = Superelement {
        relative: relative.clone(),
        positions_m: rows.iter().map(|p| p.position_m).collect(),
        areas_m2: rows.iter().map(|p| p.area_m2).collect(),
    };
    superelement::write(&options.out, &element)?;
    let first = relative.pairs.first().copied();
    Ok(first.filter(|law| relative.pairs.iter().all(|p| p == law)))
}

/// What is known before anything is computed.
pub(super) fn empty_summary(scene: &Scene, options: &Options) -> manifest::Summary {
    manifest::Summary {
        version: env!("CARGO_PKG_VERSION").to_string(),
        scene: manifest::SceneSummary {
            name: scene.name.clone(),
            file: options.scene_file.display().to_string(),
        },
        mesh: None,
        reduced_model: match &scene.subject {
            Subject::Assembly(_) => None,
            Subject::ReducedModel(spec) => Some(spec.folder.display().to_string()),
        },
        stuck_modes: None,
        truncation: None,
        pairs: 0,
        stuck_frequency_hz: None,
        blade_frequency_hz: None,
        seconds: 0.0,
        processor_seconds: None,
        bonded_pairs: 0,
        stages: Vec::new(),
        static_state: None,
        response: None,
        verification: None,
        observations: Vec::new(),
    }
}

/// What is known after the reduction.
pub(super) fn summarise(scene: &Scene, options: &Options, reduced: &Reduced) -> manifest::Summary {
    manifest::Summary {
        mesh: reduced.meshed().map(Meshed::summary),
        stuck_modes: Some(reduced.stuck_omega2().len()),
        truncation: reduced.truncation(),
        pairs: reduced.pairs.rows.len(),
        stuck_frequency_hz: reduced.relative().omega2.first().copied().map(hertz),
        bonded_pairs: reduced.meshed().map_or(0, |m| m.model.bonded.len()),
        observations: match reduced.meshed() {
            Some(meshed) => manifest::observation_summaries(&meshed.model),
            None => manifest::probe_summaries(&reduced.observations()),
        },
        ..empty_summary(scene, options)
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

/// The figures a reader asks for first, on the terminal.
pub fn report(reduced: &Reduced, response: &Response, progress: &mut dyn Observer) {
    let names = reduced.observations();
    let held = |o: &&Orbit| o.outcome.is_converged() && o.retention_n > 0.0;
    let held: Vec<&Orbit> = response.orbits.iter().filter(held).collect();
    if !held.is_empty() {
        let largest_n = held.iter().fold(0.0_f64, |m, o| m.max(o.retention_n));
        progress.warning(&format!(
            "at {} of {} frequencies friction does not hold the blade along its slot: its mean position was held there, \
             as a lock plate does, with up to {largest_n:.3} N (column retention_n of response.csv)",
            held.len(),
            response.orbits.len(),
        ));
    }
    let leaves = |o: &&Orbit| o.outcome == Outcome::LeavesSlot;
    let leaving = response.orbits.iter().filter(leaves).count();
    if leaving > 0 {
        progress.warning(&format!(
            "at {leaving} of {} frequencies the blade would leave its slot: even applied slowly the excitation pulls harder at the \
             flanks than the steady load presses them together; excite it less (force_n), or press it harder \
             (rotation.speed_rpm, [[load]])",
            response.orbits.len(),
        ));
    }
    let inaccurate = |o: &&Orbit| o.outcome == Outcome::AccuracyNotReached;
    let inaccurate = response.orbits.iter().filter(inaccurate).count();
    if inaccurate > 0 {
        progress.warning(&format!(
            "at {inaccurate} of {} frequencies the error is estimated above the accuracy asked for: with more harmonics, at most {}, no \
             motion was found or the estimate did not fall (outcome accuracy_not_reached and column estimated_error of response.csv)",
            response.orbits.len(),
            Resolution::MOST_ADAPTED,
        ));
    }
    for (i, name) in names.iter().enumerate() {
        let Some(peak) = peak(response, i) else {
            continue;
        };
        let counts = pair_counts(&response.orbits[peak.index]);
        progress.note(&format!(
            "{name}: peak {:.4e} m at {:.3} Hz; {} pairs slip, {} open, {} stick",
            peak.amplitude_m, peak.frequency_hz, counts.slipping, counts.opening, counts.stuck
        ));
    }
}
