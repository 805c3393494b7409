//! Natural frequencies of a disc over its nodal diameters.

use super::bodies::Bodies;
use super::error::Error;
use super::session::{Session, Stage};
use crate::reduction::LISTED_MODES;
use crate::reduction::sectors::{largest_nodal_diameter, modes_of_nodal_diameter};
use crate::results::modes::hertz;

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
    pub fn nodal_diameters(&self, session: &Session<'_>) -> Result<Option<NodalDiameters>, Error> {
        let Some(cyclic) = &self.model().cyclic else {
            return Ok(None);
        };
        let structure = self.structure(session)?;
        let stage = session.stage(Stage::NodalDiameters);
        let largest = largest_nodal_diameter(cyclic.sectors);
        let steps = session.steps(largest + 1, "nodal diameters");
        let mut frequencies_hz = Vec::with_capacity(largest + 1);
        for nodal_diameter in 0..=largest {
            session.goes_on()?;
            let found =
                modes_of_nodal_diameter(structure, cyclic.sectors, nodal_diameter, LISTED_MODES);
            let found = found.map_err(|source| Error::NodalDiameter {
                nodal_diameter,
                source,
            })?;
            frequencies_hz.push(found.into_iter().map(hertz).collect());
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
}
