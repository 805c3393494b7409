//! Archives of Ansys Mechanical APDL (`.cdb`, written by CDWRITE) and its input files in the same
//! form (`ds.dat` of Workbench): nodes, elements, components and materials.
//!
//! The commands NBLOCK and N, EBLOCK, E and EN, ET, ETBLOCK and KEYOPT, CMBLOCK, and CM of
//! everything that is selected, MP, MPDATA and TB,ELASTIC are read. Settings are ignored; every
//! other command is named in the remarks with its number. Commands that make, move or remove nodes and elements by a
//! rule (NGEN, VMESH) are an error.
//!
//! An archive passes through these files: `read` goes through the commands, `elements` through the
//! blocks, whose fields `blocks` cuts out, `vocabulary` takes commands apart, `types` has the
//! element types, `properties` and `materials` have the properties. `assemble` makes the [`Content`].
//!
//! Groups:
//! - A component of elements is a volume of its solids, and a surface of its faces. A component of
//!   nodes is a group of nodes.
//! - Bodies that comments of Workbench name, materials and element types are volumes, where there
//!   are several.
//! - The faces of a type of shells, surface or contact elements are a surface.
//! - The volume `all` has all solids.

mod assemble;
mod blocks;
mod elements;
mod materials;
mod properties;
mod read;
mod systems;
mod types;
mod vocabulary;

#[cfg(test)]
mod tests;

use super::content::Content;
use super::source::SourceLines;
use crate::MeshError;

/// Parses the bytes of an archive. Lengths and materials are in the units of the archive. `include`
/// gives the bytes of a file that the archive names.
///
/// # Errors
/// An archive that cannot be read, or that contradicts itself: see [`MeshError`], which names the
/// line.
pub fn parse(
    bytes: &[u8],
    include: &mut dyn FnMut(&str) -> Result<Vec<u8>, MeshError>,
) -> Result<Content, MeshError> {
    let mut lines = SourceLines::new(bytes, include);
    let archive = read::read(&mut lines)?;
    assemble::assemble(archive, &lines.files)
}
