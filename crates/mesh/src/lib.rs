//! Conversion of the bytes of a file to a [`Mesh`]: nodes, solid elements, facets and named groups,
//! in metres.
//!
//! [`parse`] reads the bytes of a file of any known format ([`formats`], behind the feature of that
//! name), [`units`] says what its numbers are in, [`quality`] refuses elements that no calculation
//! can use. [`interpolation`] has the shape functions, [`quadrature`] the rules, [`facet`]
//! integrals over faces. [`parts`] extracts the part of a volume and puts it elsewhere,
//! [`pieces`] finds the pieces of a part that are not joined.
//! [`surface_field`] has pressures or forces at points, [`text`] makes words from outside fit for
//! messages.
//!
//! These rules hold for every mesh, whatever its format:
//! - The nodes of an element are in the order of [`element`]. A reader changes the order of its
//!   file.
//! - Indices are positions in the lists of the mesh, and never beyond their end. The numbers that a
//!   file gives to nodes and elements are tags, for messages only.
//! - Lengths are metres. Only the readers know the units of a file.
//! - No file is opened here, and no process is started.
//!
//! A tetrahedron from the text of a Gmsh file whose lengths are millimetres:
//!
//! ```
//! # #[cfg(feature = "formats")]
//! # fn main() -> Result<(), dovetail_mesh::MeshError> {
//! use dovetail_mesh::units::Units;
//!
//! let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n\
//!             $PhysicalNames\n1\n3 1 \"block\"\n$EndPhysicalNames\n\
//!             $Nodes\n4\n1 0 0 0\n2 5 0 0\n3 0 5 0\n4 0 0 5\n$EndNodes\n\
//!             $Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n";
//! let mesh = dovetail_mesh::parse(text, Units::MetresPerUnit(1e-3))?;
//! assert_eq!(mesh.nodes_m[1], [5e-3, 0.0, 0.0]);
//! assert_eq!(mesh.groups["block"].elements, [0]);
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "formats"))]
//! # fn main() {}
//! ```

#![forbid(unsafe_code)]
#![warn(missing_docs, clippy::missing_errors_doc)]

use std::collections::BTreeMap;

pub mod element;
pub mod facet;
#[cfg(feature = "formats")]
pub mod formats;
pub mod interpolation;
mod near;
pub mod parts;
pub mod pieces;
pub mod quadrature;
pub mod quality;
mod row;
pub mod surface_field;
pub mod text;
pub mod units;
pub mod volume;

pub use element::{Connectivity, ElementOrder, ElementType, Shape};
#[cfg(feature = "formats")]
pub use formats::MeshError;
pub use quality::{Quality, QualityError};
pub use row::Row;

/// Farthest coordinate of a node of a file, m: volumes of larger bodies leave the range of f64.
pub const FARTHEST_M: f64 = 1e9;

/// A named group: a physical group of Gmsh, a set or a surface of a deck.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// 0 points (or a set of nodes), 1 curve, 2 surface, 3 volume.
    pub dimension: u8,
    /// Indices into the elements (dimension 3) or the facets (dimension 2); empty otherwise.
    pub elements: Vec<u32>,
    /// Indices of all nodes of the group, ascending, each once.
    pub nodes: Vec<u32>,
}

impl Group {
    /// Group without elements and nodes.
    pub fn empty(dimension: u8) -> Self {
        Self {
            dimension,
            elements: Vec::new(),
            nodes: Vec::new(),
        }
    }
}

/// Sorts numbers and drops those that stand there twice.
fn sort_once(numbers: &mut Vec<u32>) {
    numbers.sort_unstable();
    numbers.dedup();
}

/// Mesh of solid elements. The order of the nodes of an element is that of [`element`]. Indices are
/// positions in `nodes_m`; the tags of the file are kept for messages only.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Node positions, m.
    pub nodes_m: Vec<[f64; 3]>,
    /// Tag of each node in the file.
    pub node_tags: Vec<u64>,
    /// Solid elements.
    pub elements: Connectivity,
    /// Faces of elements that are named by groups, in either orientation.
    pub facets: Connectivity,
    /// Groups by name.
    pub groups: BTreeMap<String, Group>,
    /// Materials that the file gives to elements.
    pub materials: Vec<MeshMaterial>,
    /// Remarks on contents of the file that were not read, one sentence each.
    pub remarks: Vec<String>,
}

/// Material of a mesh file.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MeshMaterial {
    /// Name in the file.
    pub name: String,
    /// True if the units of the file are known; without them its numbers have no meaning.
    pub has_units: bool,
    /// Young's modulus, Pa, if given.
    pub young_pa: Option<f64>,
    /// Poisson's ratio, if given.
    pub poisson: Option<f64>,
    /// Density, kg/m3, if given.
    pub density_kg_m3: Option<f64>,
    /// Elements made of the material, ascending, each once.
    pub elements: Vec<u32>,
}

/// Parses the bytes of a mesh file that includes no other, whatever its format.
///
/// # Errors
/// Bytes that are not a whole mesh of solid elements in a known format: see [`MeshError`].
#[cfg(feature = "formats")]
pub fn parse(bytes: impl AsRef<[u8]>, units: impl Into<units::Units>) -> Result<Mesh, MeshError> {
    let mut include = |name: &str| {
        Err(MeshError::IncludeAlone {
            file: name.to_owned(),
        })
    };
    formats::parse(bytes.as_ref(), "", &mut include)?.into_mesh(units.into())
}
