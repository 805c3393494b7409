//! Writes report.html: one page that opens without a network and states what was computed, the
//! results, and whether to trust them. Its text is made here; its pictures are drawn by scripts
//! within the page.
//!
//! `frame` has what every report is made of, also that of a study, `page` the text of a run's,
//! `data`, `skin`, `apart` and `packed` what the scripts draw.
//!
//! `page/computed.rs` states the method and its assumptions in prose: small displacements, one
//! coefficient of friction at rest and in motion, motion with the period of the excitation, and
//! others. No test holds these sentences against the equations. A change of the physics makes them
//! false, and must change them.

mod apart;
mod data;
pub mod frame;
mod packed;
mod page;
mod skin;

use std::path::Path;

use super::curves::Sweep;
use super::manifest::Summary;
use super::{ExportError, write_file};
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::{Orbit, StaticState};
use dovetail_solver::model::Model;
use dovetail_solver::results::modes::NaturalFrequency;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::recovery::NodalField;
use dovetail_solver::results::resultants::Resultant;
use dovetail_solver::run::{Observed, PeakStress};

/// File name of the report.
pub const REPORT: &str = "report.html";

/// Contents of a report.
#[derive(Debug)]
pub struct Contents<'a> {
    /// Scene of the run.
    pub scene: &'a Scene,
    /// Summary of the run, as in summary.json.
    pub summary: &'a Summary,
    /// Excitation, speed and friction in a few words.
    pub conditions: &'a str,
    /// Observed displacements and strains.
    pub observations: &'a [Observed],
    /// Contact pairs.
    pub pairs: &'a PairTable,
    /// Model of the scene; `None` without a mesh.
    pub model: Option<&'a Model>,
    /// Natural frequencies, as in modes.csv.
    pub modes: &'a [NaturalFrequency],
    /// Static state; `None` if there is none.
    pub static_state: Option<&'a StaticState>,
    /// Response; `None` if there is none.
    pub sweep: Option<Sweep<'a>>,
    /// The 2H+1 nodal fields of each body at the peak of the first observation.
    pub motion: Option<&'a [Vec<NodalField>]>,
    /// Stress of the bodies there.
    pub stress: Option<&'a PeakStress>,
    /// Forces of contacts, supports and springs there, or in the static state.
    pub forces: &'a [Resultant],
}

impl Contents<'_> {
    /// Motion at the peak of the first observation.
    fn peak_orbit(&self) -> Option<&Orbit> {
        self.sweep.as_ref()?.peak_orbit()
    }

    /// Model with flanks that have maps.
    fn flank_model(&self) -> Option<&Model> {
        self.model.filter(|model| !model.pairs.is_empty())
    }

    fn has_pairs(&self) -> bool {
        !self.pairs.rows.is_empty()
    }
}

/// Writes the report.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, contents: &Contents<'_>) -> Result<(), ExportError> {
    let data = data::Data::new(contents);
    let page = page::page(contents, &data);
    write_file(path, page.into_string().as_bytes())
}
