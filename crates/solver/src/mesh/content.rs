//! What a mesh file says, whatever its format: the readers of all formats end here.

use std::collections::BTreeMap;

use super::Group;
use super::element::Connectivity;

/// Nodes, elements, groups and materials of a file, in the units of the file.
///
/// Indices of nodes are positions in `nodes`, of which not all need to be used. Groups are those of a
/// [`Mesh`](super::Mesh); a set of nodes is a group of dimension 0.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Content {
    /// Positions, in the unit of length of the file.
    pub nodes: Vec<[f64; 3]>,
    /// Number of each node in the file.
    pub node_tags: Vec<u64>,
    /// Solid elements, of the eight types of [`ElementType`](super::element::ElementType).
    pub elements: Connectivity,
    /// Triangles of 3 or 6 nodes, quadrilaterals of 4 or 8.
    pub facets: Connectivity,
    /// By name.
    pub groups: BTreeMap<String, Group>,
    /// Those that the file gives to elements.
    pub materials: Vec<FileMaterial>,
    /// What the file says beside and was not read, one sentence each.
    pub remarks: Vec<String>,
}

/// A material of a file, in the units of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct FileMaterial {
    /// As the file calls it.
    pub name: String,
    /// Young's modulus, where it is given.
    pub young: Option<f64>,
    /// Poisson's ratio, where it is given.
    pub poisson: Option<f64>,
    /// Density, where it is given.
    pub density: Option<f64>,
    /// The elements that are made of it, ascending, each once.
    pub elements: Vec<u32>,
}
