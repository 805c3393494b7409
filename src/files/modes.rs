//! Tables, shapes and diagrams of modes.

use super::RunFiles;
use super::summary::first_hz;
use crate::error::RunError;
use dovetail_export::plots::{
    CampbellFamily, EngineOrders, Operation, PictureHeading, write_campbell, write_nodal_diameters,
};
use dovetail_export::{csv, vtu};
use dovetail_solver::results::modes::{ModeKind, ModeShape, NaturalFrequency};
use dovetail_solver::run::{Campbell, Crossing, CrossingPeak, ModalAnalysis, NodalDiameters, Run};

impl RunFiles {
    /// Writes modes.csv.
    pub(super) fn modes(&mut self, rows: Vec<NaturalFrequency>) -> Result<(), RunError> {
        csv::write_modes(&self.folder.out.file("modes.csv")?, &rows)?;
        self.figures.modes = rows;
        Ok(())
    }

    /// Writes modes.csv and, for a meshed assembly, modes.vtu. Beside a run the modes about its
    /// static state stay. Returns the rows.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn modal_analysis(
        &mut self,
        modes: &ModalAnalysis,
    ) -> Result<Vec<NaturalFrequency>, RunError> {
        if let Some(bodies) = &modes.reduced.bodies {
            let model = bodies.model();
            vtu::write_modes(&self.folder.out.file("modes.vtu")?, model, &modes.shapes)?;
            if let (Some(cyclic), Some(disc)) = (&model.cyclic, &modes.disc) {
                let name = format!("modes_nodal_diameter_{}.vtu", disc.nodal_diameter);
                vtu::write_disc(&self.folder.out.file(&name)?, model, cyclic, disc)?;
            }
        }
        if let Some(found) = &modes.nodal_diameters {
            self.nodal_diameters(found)?;
        }
        let mut frequencies = modes.reduced.natural_frequencies(None, &modes.held_omega2);
        for row in &mut frequencies {
            let mut shapes = modes.shapes.iter();
            let shape =
                shapes.find(|s| (s.kind, &s.body, s.mode) == (row.kind, &row.body, row.mode));
            row.modal_mass_kg = shape.and_then(ModeShape::modal_mass_kg);
        }
        let mut rows = frequencies.clone();
        if self.folder.out.is_beside_run() {
            let earlier = csv::read_modes(&self.folder.out.file("modes.csv")?).into_iter();
            rows.extend(earlier.filter(|row| row.kind == ModeKind::Linear));
        }
        self.figures.summary.blade_frequency_hz = first_hz(&modes.held_omega2);
        self.modes(rows)?;
        Ok(frequencies)
    }

    /// Writes modes_nodal_diameters.csv and plots/nodal_diameters.svg.
    fn nodal_diameters(&mut self, found: &NodalDiameters) -> Result<(), RunError> {
        csv::write_nodal_diameters(&self.folder.out.file("modes_nodal_diameters.csv")?, found)?;
        let speed = if found.speed_rpm > 0.0 {
            format!("{:.0} rpm", found.speed_rpm)
        } else {
            "at rest".to_owned()
        };
        let heading = PictureHeading {
            title: &format!("{}: modes of the disc", self.figures.summary.scene.name),
            conditions: &format!("{} sectors, all pairs stuck, {speed}", found.sectors),
        };
        let path = self.picture("nodal_diameters")?;
        Ok(write_nodal_diameters(&path, heading, found)?)
    }

    /// Writes modes.csv again, with the modes of the bodies with held flanks.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn held_modes(&mut self, run: &Run) -> Result<(), RunError> {
        let state = Some(&run.statics.state);
        self.figures.summary.blade_frequency_hz = first_hz(&run.held_omega2);
        self.modes(run.reduced.natural_frequencies(state, &run.held_omega2))
    }

    /// Writes modes_campbell.csv, modes_crossings.csv and plots/campbell.svg.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn campbell(
        &self,
        campbell: &Campbell,
        (crossings, peaks): (&[Crossing], &[CrossingPeak]),
        diagram: (&[CampbellFamily], &EngineOrders, &Operation),
    ) -> Result<(), RunError> {
        csv::write_campbell(
            &self.folder.out.file("modes_campbell.csv")?,
            &campbell.families,
        )?;
        let path = self.folder.out.file("modes_crossings.csv")?;
        csv::write_crossings(&path, campbell.operating_rpm, crossings, peaks)?;
        let heading = PictureHeading {
            title: &format!("{}: natural frequencies", self.figures.summary.scene.name),
            conditions: &if campbell.operating_rpm > 0.0 {
                format!("operation at {:.0} rpm", campbell.operating_rpm)
            } else {
                String::new()
            },
        };
        let path = self.picture("campbell")?;
        let (families, orders, operation) = diagram;
        Ok(write_campbell(&path, heading, families, orders, operation)?)
    }
}
