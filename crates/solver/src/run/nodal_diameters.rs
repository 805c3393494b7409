//! Natural frequencies of a disc over its nodal diameters.

use super::bodies::Bodies;
use super::error::Error;
use super::session::{Session, Stage};
use crate::fem::expand_to_nodes;
use crate::reduced::waves::largest_nodal_diameter;
use crate::reduction::LISTED_MODES;
use crate::reduction::sectors::{modes_of_nodal_diameter, wave_modes};
use crate::results::modes::hertz;
use crate::results::recovery::NodalField;
use faer::Mat;

/// Frequencies of a disc with all pairs stuck, with the prestress of its static state.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct NodalDiameters {
    /// Number of sectors.
    pub sectors: usize,
    /// Speed of rotation, rpm; 0 at rest.
    pub speed_rpm: f64,
    /// Frequencies of each nodal diameter from 0 on, Hz, ascending.
    pub frequencies_hz: Vec<Vec<f64>>,
}

/// Modes of one nodal diameter on the nodes of the first sector, with all pairs stuck. The sector
/// moves as `cosine cos wt + sine sin wt`, and sector j as this times `exp(i j theta)`, theta = 2 pi
/// times the nodal diameter over the number of sectors.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DiscModes {
    /// Nodal diameter.
    pub nodal_diameter: usize,
    /// Modes, the lowest first.
    pub modes: Vec<DiscMode>,
}

/// Mode of a disc on the nodes of the first sector, of modal mass 1 for the sector.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct DiscMode {
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
    /// Displacement of all nodes of each body at the beginning of the period.
    pub cosine: Vec<NodalField>,
    /// Displacement a quarter of a period later.
    pub sine: Vec<NodalField>,
}

impl NodalDiameters {
    /// Frequencies of each nodal diameter from 0 on, Hz, of a disc of so many sectors at a speed of
    /// rotation.
    pub const fn new(sectors: usize, speed_rpm: f64, frequencies_hz: Vec<Vec<f64>>) -> Self {
        Self {
            sectors,
            speed_rpm,
            frequencies_hz,
        }
    }
}

impl Bodies {
    /// Frequencies over the nodal diameters; `None` for bodies that are not a sector of a disc.
    ///
    /// # Errors
    /// The errors of the finite elements; [`Error::NodalDiameter`]; [`Error::Stopped`].
    pub(crate) fn nodal_diameters(
        &self,
        session: &Session<'_>,
    ) -> Result<Option<NodalDiameters>, Error> {
        let Some(cyclic) = &self.model().cyclic else {
            return Ok(None);
        };
        let structure = self.structure(session)?;
        let stage = session.stage(Stage::NodalDiameters);
        let largest = largest_nodal_diameter(cyclic.sectors);
        let steps = session.steps(largest + 1, "nodal diameters");
        let mut frequencies_hz = Vec::with_capacity(largest + 1);
        for nodal_diameter in 0..=largest {
            session.check_running()?;
            let found =
                modes_of_nodal_diameter(structure, cyclic.sectors, nodal_diameter, LISTED_MODES);
            let modes = found.map_err(|source| Error::NodalDiameter {
                nodal_diameter,
                source,
            })?;
            frequencies_hz.push(modes.into_iter().map(hertz).collect());
            steps.step();
        }
        drop(steps);
        drop(stage);
        let rotation = self.model().rotation.as_ref();
        let speed_rpm = rotation.map_or(0.0, |r| r.speed_rad_s * 30.0 / std::f64::consts::PI);
        Ok(Some(NodalDiameters::new(
            cyclic.sectors,
            speed_rpm,
            frequencies_hz,
        )))
    }

    /// Modes of one nodal diameter with their shapes.
    ///
    /// # Errors
    /// [`Error::NoDisc`], [`Error::TooManyDiameters`], and those of [`Bodies::nodal_diameters`].
    pub(crate) fn disc_modes(
        &self,
        nodal_diameter: usize,
        session: &Session<'_>,
    ) -> Result<DiscModes, Error> {
        let cyclic = self.model().cyclic.as_ref().ok_or(Error::NoDisc)?;
        let largest = largest_nodal_diameter(cyclic.sectors);
        if nodal_diameter > largest {
            return Err(Error::TooManyDiameters {
                nodal_diameter,
                largest,
            });
        }
        let structure = self.structure(session)?;
        let _stage = session.stage(Stage::NodalDiameters);
        let result = wave_modes(structure, cyclic.sectors, nodal_diameter, LISTED_MODES);
        let modes_or_error = result.map_err(|source| Error::NodalDiameter {
            nodal_diameter,
            source,
        })?;
        let on_nodes = |part: &[Mat<f64>], mode: usize, factor: f64| -> Vec<NodalField> {
            let bodies = self.model().bodies.iter().zip(part);
            let scaled =
                |u: &Mat<f64>| -> Vec<f64> { u.col(mode).iter().map(|u| factor * u).collect() };
            let fields = bodies.map(|(body, u)| expand_to_nodes(&body.dofs, &scaled(u)));
            fields.collect()
        };
        let modes = modes_or_error.omega2.iter().enumerate();
        let modes = modes.map(|(mode, omega2)| DiscMode {
            frequency_hz: hertz(*omega2),
            cosine: on_nodes(&modes_or_error.real, mode, 1.0),
            sine: on_nodes(&modes_or_error.imaginary, mode, -1.0),
        });
        Ok(DiscModes {
            nodal_diameter,
            modes: modes.collect(),
        })
    }
}
