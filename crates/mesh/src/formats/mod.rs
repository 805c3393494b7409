//! Readers that convert the bytes of a file to its [`Content`] in its own units, and then to a
//! [`Mesh`](crate::Mesh).
//!
//! [`detect`](fn@detect) finds the format. Each has a reader: [`msh`] and [`msh2`] for Gmsh's
//! files, [`deck`] for decks of Abaqus and CalculiX, [`ansys`] for archives of Ansys, [`nastran`] for bulk data of Nastran, [`vtu`] for VTK's. [`surface_field`] reads
//! forces or pressures at points.
//!
//! Files come from outside: a reader compares sizes that a file announces with its length, names
//! the line or the section of an error, and never panics. A new format of meshes is a file here
//! that gives a [`Content`], a name in `detect.rs`, and a target in `fuzz`.

pub mod ansys;
mod collapse;
mod content;
pub mod deck;
mod detect;
mod error;
#[cfg(test)]
mod fixtures;
pub mod gmsh_order;
mod middles;
mod mirror;
pub mod msh;
pub mod msh2;
mod named_groups;
pub mod nastran;
mod numbered;
mod numbers;
mod plain;
mod sections;
mod source;
pub mod surface_field;
mod systems;
mod tag_index;
mod tally;
pub mod vtu;

pub use content::{Content, FileMaterial};
pub use detect::{Format, detect};
pub use error::MeshError;

/// Parses the bytes of a mesh file, in the units of the file. `name` is that of the file, for its
/// ending; `include` gives the bytes of another file that a deck names.
///
/// # Errors
/// A format that is not read, with the program that converts it; or bytes that are not a whole
/// mesh.
pub fn parse(
    bytes: &[u8],
    name: &str,
    include: &mut dyn FnMut(&str) -> Result<Vec<u8>, MeshError>,
) -> Result<Content, MeshError> {
    match detect(bytes, name)? {
        Format::Msh4 => msh::parse(bytes),
        Format::Msh2 => msh2::parse(bytes),
        Format::Deck => deck::parse(bytes, include),
        Format::Ansys => ansys::parse(bytes, include),
        Format::Nastran => nastran::parse(bytes, include),
        Format::Vtu => vtu::parse(bytes),
    }
}
