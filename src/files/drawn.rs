//! Pictures of a response, and fields for ParaView at its peak.

use super::conditions::in_motion;
use super::{FurtherPlot, RunFiles};
use crate::error::RunError;
use dovetail_export::curves::{Curves, Sweep};
use dovetail_export::fields::{self, Separation};
use dovetail_export::plots::{
    Haigh, PictureHeading, Scale, write_curves, write_field_map, write_haigh, write_separation_map,
};
use dovetail_export::words::capital;
use dovetail_export::{csv, flank, manifest, vtu};
use dovetail_solver::problem::Problem;
use dovetail_solver::results::fretting::fretting;
use dovetail_solver::results::peak::peak;
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::run::{
    Bodies, Observed, PeakMotion, ResponseResult, peak_forces, peak_stress,
};
use dovetail_solver::spectrum::{cosine, sine};

impl RunFiles {
    /// Draws the curves of each observation against frequency: amplitude, and the further pictures
    /// requested.
    pub(super) fn write_curves(
        &self,
        observed: &[Observed],
        sweep: &Sweep<'_>,
    ) -> Result<(), RunError> {
        let further = |kind| self.asked.further_plots.contains(&kind);
        let conditions = &in_motion(&self.scene, &[]);
        let draw = |file: String, scale: Scale, curves: &Curves| -> Result<(), RunError> {
            let path = self.picture(&file)?;
            let quantity = capital(&curves.quantity);
            let heading = PictureHeading {
                title: &format!("{quantity}, scene {}", self.figures.summary.scene.name),
                conditions,
            };
            Ok(write_curves(&path, heading, scale, curves)?)
        };
        for (i, one) in observed.iter().enumerate() {
            let name = &one.name;
            let amplitude = sweep.amplitude(one, i);
            draw(format!("response_{name}"), Scale::Linear, &amplitude)?;
            if further(FurtherPlot::Logarithmic) {
                let file = format!("response_{name}_logarithmic");
                draw(file, Scale::Logarithmic, &amplitude)?;
            }
            if further(FurtherPlot::Phase) {
                let phase = sweep.phase(name, i);
                draw(format!("phase_{name}"), Scale::Linear, &phase)?;
            }
        }
        Ok(())
    }

    /// Writes the maps of the flanks and, if fields are written, the fields on the flanks and the
    /// motion and the stress of the bodies at the peak, which are kept.
    pub(super) fn write_response_on_mesh(
        &mut self,
        bodies: &Bodies,
        problem: &Problem,
        found: &ResponseResult,
    ) -> Result<(), RunError> {
        let (model, response) = (bodies.model(), &found.response);
        let at_peak = peak(response, 0).map(|peak| &response.orbits[peak.index]);
        let free = at_peak.filter(|_| self.asked.fields);
        let free = free.and_then(|orbit| bodies.free_motion_m(orbit));
        if let Some(orbit) = at_peak {
            let peak = PeakMotion {
                orbit,
                motion_m: free.as_deref(),
                problem,
                damping: found.damping,
            };
            self.write_forces("forces.csv", bodies, peak_forces(bodies, peak)?)?;
        }
        let (out, conditions) = (&self.folder.out, &in_motion(&self.scene, &[])[..]);
        if !model.pairs.is_empty() {
            let path = self.picture("separation")?;
            let separation = Separation::new(response, model.pairs.len());
            write_separation_map(&path, model, conditions, &separation)?;
            if let Some(orbit) = at_peak {
                let [energy, slid, ..] = fields::peak_fields(orbit, &model.pairs);
                for (file, field) in [("friction_energy", energy), ("slip", slid)] {
                    let title = capital(field.title);
                    let heading = PictureHeading {
                        title: &format!("{title}, {:.3} Hz", orbit.frequency_hz),
                        conditions,
                    };
                    let path = self.picture(&format!("peak_{file}"))?;
                    write_field_map(&path, model, heading, &field)?;
                }
            }
        }
        let (Some(orbit), Some(free)) = (at_peak, free) else {
            return Ok(());
        };
        let motion = bodies.node_fields_m(&free);
        drop(free);
        let stuck_modes = problem.reduced.harmonic_model(1).model.stuck_modes;
        let strengths = self.scene.assembly().map_or_else(Vec::new, |assembly| {
            assembly.bodies.iter().map(|body| body.strength).collect()
        });
        let stress = peak_stress(bodies, (orbit, &motion), stuck_modes, strengths);
        if !model.pairs.is_empty() {
            let of_bodies = stress.as_ref().map(|stress| stress.bodies.as_slice());
            let fretting = fretting(model, orbit, of_bodies);
            let path = out.file("flank_peak.vtu")?;
            flank::write_flank_peak(&path, model, orbit, response, &fretting)?;
            if let Some(response) = &mut self.figures.summary.response {
                response.peak_fretting = Some(manifest::fretting_summary(&fretting));
            }
        }
        let disc = model.cyclic.as_ref().filter(|_| self.asked.whole_disc);
        let path = out.file("peak.vtu")?;
        vtu::write_motion(&path, (model, None), &motion, stress.as_ref())?;
        if disc.is_some() {
            let path = out.file("peak_disc.vtu")?;
            vtu::write_motion(&path, (model, disc), &motion, stress.as_ref())?;
        }
        if let Some(frames) = self.asked.frames {
            let (folder, hz) = (out.path(), orbit.frequency_hz);
            out.list(vtu::frame_files(frames))?;
            vtu::write_frames(folder, (model, disc), &motion, hz, frames)?;
        }
        if let Some(stress) = &stress {
            if self.asked.stress_points {
                let fields = stress_fields(&motion);
                vtu::write_stress_points(&out.file("peak_points.vtu")?, model, &fields)?;
            }
            let summary = manifest::stress_summary(model, stress);
            csv::write_stress(&out.file("stress.csv")?, &summary)?;
            let heading = PictureHeading {
                title: &format!("Haigh diagram, {:.3} Hz", orbit.frequency_hz),
                conditions,
            };
            let path = self.picture("haigh")?;
            write_haigh(&path, heading, &Haigh::new(model, stress))?;
            self.figures.summary.stress = Some(summary);
        }
        self.figures.motion = Some(motion);
        self.figures.stress = stress;
        Ok(())
    }
}

/// Names of the stress fields of a motion, `motion_m[b]` with 2H+1 fields, and the displacements
/// that they belong to.
fn stress_fields(motion_m: &[Vec<NodalField>]) -> Vec<(String, Vec<&[[f64; 3]]>)> {
    let of = |i: usize| motion_m.iter().map(|fields| fields[i].as_slice()).collect();
    let harmonics = motion_m.first().map_or(0, |fields| fields.len() / 2);
    let moving = (1..=harmonics).flat_map(|k| {
        let cosine = (format!("h{k}_stress_cos_pa"), of(cosine(k)));
        [cosine, (format!("h{k}_stress_sin_pa"), of(sine(k)))]
    });
    std::iter::once(("mean_stress_pa".to_owned(), of(0)))
        .chain(moving)
        .collect()
}
