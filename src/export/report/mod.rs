//! Writes report.html: one page that opens by double click, without a network, and says what was computed, what came
//! out, and whether to trust it. Its text is made here; its pictures are drawn by scripts that travel in it.

mod data;
pub mod frame;
mod packed;
mod page;
mod skin;

use std::path::Path;

use super::csv::ModeRow;
use super::manifest::Summary;
use super::{ExportError, write_file};
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::{Orbit, Response, StaticState};
use dovetail_solver::model::Model;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::peak;
use dovetail_solver::results::recovery::NodalField;

/// What a report is about.
#[derive(Debug)]
pub struct Contents<'a> {
    pub scene: &'a Scene,
    pub summary: &'a Summary,
    /// Names of the observed displacements.
    pub observations: &'a [&'a str],
    pub pairs: &'a PairTable,
    /// Where there is a mesh.
    pub model: Option<&'a Model>,
    pub modes: &'a [ModeRow],
    pub static_state: Option<&'a StaticState>,
    pub sweep: Option<Sweep<'a>>,
    /// The 2H+1 nodal fields of each body at the peak of the first observation.
    pub motion: Option<&'a [Vec<NodalField>]>,
}

/// A response as a report shows it.
#[derive(Debug)]
pub struct Sweep<'a> {
    pub response: &'a Response,
    /// `H = 3`.
    pub label: String,
    pub compared: Option<(&'a str, &'a Response)>,
}

impl Sweep<'_> {
    /// The motion at the peak of the first observation.
    fn at_peak(&self) -> Option<&Orbit> {
        let peak = peak(self.response, 0)?;
        self.response.orbits.get(peak.index)
    }
}

/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, contents: &Contents<'_>) -> Result<(), ExportError> {
    let data = data::Data::of(contents);
    let page = page::page(contents, &data);
    write_file(path, page.into_string().as_bytes())
}
