//! Writes report.html: one page that opens without a network and states what was computed, the
//! results, and whether to trust them. Its text is made here; its pictures are drawn by scripts
//! within the page.

mod apart;
mod data;
pub mod frame;
mod packed;
mod page;
mod skin;

use std::path::Path;

use super::manifest::Summary;
use super::{ExportError, write_file};
use dovetail_solver::description::Scene;
use dovetail_solver::dlft::{Orbit, Response, StaticState};
use dovetail_solver::model::Model;
use dovetail_solver::results::modes::NaturalFrequency;
use dovetail_solver::results::pairs::PairTable;
use dovetail_solver::results::quantities::peak;
use dovetail_solver::results::recovery::NodalField;

/// File name of the report.
pub const REPORT: &str = "report.html";

/// Contents of a report.
#[derive(Debug)]
pub struct Contents<'a> {
    pub scene: &'a Scene,
    pub summary: &'a Summary,
    /// Excitation, speed and friction in a few words.
    pub conditions: &'a str,
    /// Names of the observed displacements.
    pub observations: &'a [&'a str],
    pub pairs: &'a PairTable,
    /// Model of the scene; `None` without a mesh.
    pub model: Option<&'a Model>,
    pub modes: &'a [NaturalFrequency],
    pub static_state: Option<&'a StaticState>,
    pub sweep: Option<Sweep<'a>>,
    /// The 2H+1 nodal fields of each body at the peak of the first observation.
    pub motion: Option<&'a [Vec<NodalField>]>,
}

/// Response of a report.
#[derive(Debug)]
pub struct Sweep<'a> {
    pub response: &'a Response,
    /// Description of the response, such as `with 3 harmonics`.
    pub label: String,
    pub compared: Option<(&'a str, &'a Response)>,
}

impl Sweep<'_> {
    /// Motion at the peak of the first observation.
    fn at_peak(&self) -> Option<&Orbit> {
        let peak = peak(self.response, 0)?;
        self.response.orbits.get(peak.index)
    }
}

/// Writes the report.
///
/// # Errors
/// A file that cannot be written.
pub fn write(path: &Path, contents: &Contents<'_>) -> Result<(), ExportError> {
    let data = data::Data::of(contents);
    let page = page::page(contents, &data);
    write_file(path, page.into_string().as_bytes())
}

#[cfg(test)]
mod tests {
    /// Whole numbers in the brackets after `name = `, three for each colour.
    fn colours(text: &str, name: &str) -> Vec<[u32; 3]> {
        let (_, list) = text.split_once(&format!("{name} = [")).unwrap();
        let end = list.find("\n\n").unwrap();
        let words = list[..end].split(|c: char| !c.is_ascii_digit());
        let numbers: Vec<u32> = words.filter_map(|word| word.parse().ok()).collect();
        numbers
            .chunks_exact(3)
            .map(|c| [c[0], c[1], c[2]])
            .collect()
    }

    #[test]
    fn fields_on_bodies_have_the_same_colours_in_paraview_and_their_lightness_falls() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let views = std::fs::read_to_string(root.join("views/colours.py")).unwrap();
        let own = colours(include_str!("flanks.js"), "BODIES");
        assert_eq!(own.len(), 5);
        assert_eq!(own, colours(&views, "BODIES"));
        let light = |[r, g, b]: [u32; 3]| 2126 * r + 7152 * g + 722 * b;
        assert!(own.windows(2).all(|two| light(two[0]) > light(two[1])));
    }
}
