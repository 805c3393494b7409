//! Table, pictures and fields of the static state.

use super::RunFiles;
use super::conditions::static_conditions;
use crate::error::RunError;
use dovetail_export::folder::Beginning;
use dovetail_export::plots::{PictureHeading, write_field_map, write_no_field};
use dovetail_export::words::capital;
use dovetail_export::{csv, fields, flank, vtu};
use dovetail_solver::fem::stress;
use dovetail_solver::results::resultants::Resultant;
use dovetail_solver::run::{Bodies, ReducedScene, StaticResult, static_forces};

impl RunFiles {
    pub(super) fn static_state(
        &mut self,
        reduced: &ReducedScene,
        statics: &StaticResult,
    ) -> Result<(), RunError> {
        self.figures.add_static_state(reduced, statics);
        if self.folder.beginning == Beginning::Beside {
            return Ok(());
        }
        self.write_static_state(reduced, statics)?;
        if statics.usable().is_ok() {
            self.modes(reduced.natural_frequencies(Some(&statics.state), &[]))?;
        }
        match self.folder.beginning {
            Beginning::Anew => Ok(self.folder.out.remove_earlier()?),
            Beginning::Resumed | Beginning::Beside => Ok(()),
        }
    }

    /// Writes a table of forces and moments, if there are any, and keeps them.
    pub(super) fn write_forces(
        &mut self,
        file: &str,
        bodies: &Bodies,
        forces: Vec<Resultant>,
    ) -> Result<(), RunError> {
        if !forces.is_empty() {
            let names = bodies.model().bodies.iter();
            let names: Vec<&str> = names.map(|body| body.name.as_str()).collect();
            csv::write_forces(&self.folder.out.file(file)?, &names, &forces)?;
        }
        self.figures.forces = forces;
        Ok(())
    }

    /// Writes the table of the static state, its map on the flanks and, if fields are written,
    /// those on the flanks and on the bodies.
    fn write_static_state(
        &mut self,
        reduced: &ReducedScene,
        statics: &StaticResult,
    ) -> Result<(), RunError> {
        let state = &statics.state;
        csv::write_static(&self.folder.out.file("static.csv")?, &reduced.pairs, state)?;
        let Some(bodies) = &reduced.bodies else {
            return Ok(());
        };
        let model = bodies.model();
        if state.outcome.is_converged() {
            self.write_forces("static_forces.csv", bodies, static_forces(bodies, state)?)?;
        }
        let out = &self.folder.out;
        let opens = !model.pairs.is_empty();
        if opens {
            let path = self.picture("static_pressure")?;
            let conditions = &static_conditions(&self.scene);
            let heading = |title| PictureHeading { title, conditions };
            match fields::static_state_fields(state, &model.pairs) {
                Some([pressure, _]) => {
                    write_field_map(&path, model, heading(&capital(pressure.title)), &pressure)?;
                }
                None => {
                    let outcome = state.outcome;
                    let title = format!("Static pressure: {outcome}, no result");
                    write_no_field(&path, heading(&title))?;
                }
            }
        }
        let Some(displacements) = statics
            .displacements_m
            .as_ref()
            .filter(|_| self.asked.fields)
        else {
            return Ok(());
        };
        if opens {
            flank::write_flank_static(&out.file("flank_static.vtu")?, model, state)?;
        }
        let bodies = model.bodies.iter().zip(displacements);
        let fields: Vec<_> = bodies
            .map(|(body, displacement)| {
                let at_elements = stress::stress(body, displacement);
                let von_mises: Vec<f64> = stress::nodal_stress(body, displacement)
                    .into_iter()
                    .map(stress::von_mises)
                    .collect();
                (displacement, at_elements, von_mises)
            })
            .collect();
        let displacements: Vec<&[[f64; 3]]> = fields.iter().map(|f| &f.0[..]).collect();
        csv::write_static_observations(&out.file("static_observed.csv")?, model, &displacements)?;
        let fields = fields.iter();
        let fields = fields.map(|(displacement, stress, von_mises)| vtu::StaticBodyFields {
            displacement_m: displacement,
            stress_pa: stress,
            von_mises_pa: von_mises,
        });
        vtu::write_static(&out.file("static.vtu")?, model, &fields.collect::<Vec<_>>())?;
        if self.asked.stress_points {
            let fields = [("stress_pa".to_owned(), displacements)];
            vtu::write_stress_points(&out.file("static_points.vtu")?, model, &fields)?;
        }
        Ok(())
    }
}
