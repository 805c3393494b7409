//! Bulk data of Nastran (`.bdf`, `.dat`, `.nas`, `.fem`): nodes, elements, properties, materials and
//! sets.
//!
//! Executive and case control may precede the bulk data; of these, only the sets and INCLUDE are
//! read. Cards may be in small, large or free field. GRID with the systems CORD1R, CORD2R and
//! others, CTETRA, CPYRAM, CPENTA, CHEXA, shells as surfaces, PSOLID, MAT1, SPC, SPC1, SET1 and
//! SET3 are read. Every other card is named in the remarks with its number.
//!
//! Bulk data pass through these files: `cards` joins lines to cards, `read` goes through the cards,
//! `case_control` has the sets of case control, `names` the names in comments of preprocessors,
//! `positions` puts the nodes in global coordinates, `types` has the orders of nodes, `materials`
//! the properties. `assemble` makes the [`Content`].
//!
//! Groups:
//! - The solids of a property are a volume, and its shells a surface, called by the name that a
//!   comment of HyperMesh, Patran, ANSA, Femap or Simcenter gives them, or `PSOLID 7`.
//! - SPC and SPC1 of one number, SET1 and SET3 are groups of nodes or elements.
//! - A set of case control is a group of nodes or elements if all of its numbers are.
//! - The volume `all` has all solids.

mod assemble;
mod cards;
mod case_control;
mod materials;
mod names;
mod positions;
mod read;
mod types;

#[cfg(test)]
mod tests;

use super::content::Content;
use super::source::SourceLines;
use crate::MeshError;

/// Parses the bytes of bulk data. Lengths and materials are in the units of the file. `include`
/// gives the bytes of a file that the data name.
///
/// # Errors
/// Data that cannot be read, or that contradict themselves: see [`MeshError`], which names the line.
pub fn parse(
    bytes: &[u8],
    include: &mut dyn FnMut(&str) -> Result<Vec<u8>, MeshError>,
) -> Result<Content, MeshError> {
    let mut lines = SourceLines::new(bytes, include);
    let bulk = read::read(&mut lines, has_control(bytes))?;
    assemble::assemble(bulk, &lines.files)
}

/// True if executive or case control precedes the bulk data.
fn has_control(bytes: &[u8]) -> bool {
    let mut lines = bytes.split(|b| *b == b'\n').map(<[u8]>::trim_ascii);
    lines.any(|line| {
        let words = line
            .split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty());
        let mut words = words.take_while(|word| !word.starts_with(b"$"));
        let is = |word: Option<&[u8]>, what: &[u8]| {
            word.is_some_and(|word| word.eq_ignore_ascii_case(what))
        };
        let first = words.next();
        let second = words.next();
        is(first, b"CEND") || is(first, b"BEGIN") && (second.is_none() || is(second, b"BULK"))
    })
}
