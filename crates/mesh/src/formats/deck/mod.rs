//! Decks of Abaqus and CalculiX: nodes, elements, sets, surfaces and materials of an input file.
//!
//! The keywords `*NODE`, `*ELEMENT`, `*NSET`, `*ELSET`, `*SURFACE`, `*MATERIAL` with `*ELASTIC` and
//! `*DENSITY`, `*SOLID SECTION`, `*INCLUDE`, and Abaqus' parts, instances and assembly are read.
//! Every other keyword is ignored and named in the remarks. Keywords that make nodes or elements by
//! a rule (`*NGEN`, `*ELGEN`) are an error. An unambiguous beginning of a word is accepted for the
//! word (`GEN` for `GENERATE`). CalculiX skips much with a warning, and so does this reader: its
//! remarks name parameters without a meaning here or without any, types of elements that it does
//! not know, numbers in sets that do not exist, surplus nodes, and lines that follow no keyword.
//!
//! A deck passes through these files: `lines` joins keyword lines and puts included files in their
//! place, `read` takes names and labels as they are written, into a `scope` for each part and
//! instance, and collects in `left_aside` what it skips, `resolve` finds the nodes and elements that they mean, and `assemble` makes the
//! [`Content`]. `types` has the names of element types. A new keyword gets an entry in `READ` of
//! `vocabulary`, which lists its parameters, and an arm in `read`.
//!
//! Groups:
//! - An element set is a volume group of its solids. Its shells (also membranes, plane and surface
//!   elements) are a surface group, its beams and trusses a group of nodes along lines.
//! - A surface of faces is a surface group of facets of its own. Without the label of a face those
//!   faces of its elements are meant that no other solid has.
//! - A node set, or a surface of nodes, is a group of nodes.
//! - An instance is a volume group.
//! - All solids are the group `all` where no other group has solids.
//!
//! Sets and surfaces that are marked `INTERNAL` are no groups. A set of a part is called by its own
//! name where no other instance, nor the assembly, has that name, and otherwise `instance.set`.
//!
//! If several groups have one name, the first of this list keeps it, and a word is appended to the
//! names of the others: the instance, the solids of a set `(elements)`, the surface `(surface)`,
//! the shells of a set `(shells)`, its lines `(lines)`, the node set `(nodes)`, the surface of
//! nodes `(node surface)`. Names that differ only in the case of the letters A to Z are one name,
//! spelled as at its first place. A line that is not UTF-8 is read as Latin-1.

mod assemble;
mod left_aside;
mod lines;
mod read;
mod resolve;
mod scope;
mod types;
mod vocabulary;

#[cfg(test)]
mod tests;

use super::content::Content;
use crate::MeshError;

/// Parses the bytes of a deck. Lengths and materials are in the units of the deck. `include` gives
/// the bytes of a file that the deck names.
///
/// # Errors
/// A deck that cannot be read, or that contradicts itself: see [`MeshError`], which names the line.
pub fn parse(
    bytes: &[u8],
    include: &mut dyn FnMut(&str) -> Result<Vec<u8>, MeshError>,
) -> Result<Content, MeshError> {
    let mut lines = lines::DeckLines::new(bytes, include, vocabulary::continues);
    let deck = read::read(&mut lines)?;
    assemble::assemble(&deck, &lines.source.files)
}
