//! Bytes -> [`Mesh`]: nodes, tetrahedra, facets and named groups, in metres.
//!
//! [`msh`] reads Gmsh's MSH 4.1 files, [`gmsh`] runs the `gmsh` program on a script, [`quality`]
//! refuses elements no calculation can use.

pub mod block;

use std::collections::BTreeMap;

pub mod content;
pub mod element;
mod error;
pub mod gmsh;
pub mod gmsh_order;
pub mod inputs;
pub mod msh;
mod process;
pub mod quality;
mod script;
mod sections;
pub mod source;

pub use element::ElementOrder;
pub use error::MeshError;
pub use gmsh::{GmshError, GmshRun, generate};
pub use msh::{parse, read};
pub use quality::{Quality, QualityError};

impl ElementOrder {
    /// Nodes of a tetrahedron.
    pub fn nodes_per_tet(self) -> usize {
        match self {
            Self::Linear => 4,
            Self::Quadratic => 10,
        }
    }
    /// Nodes of a facet.
    pub fn nodes_per_facet(self) -> usize {
        match self {
            Self::Linear => 3,
            Self::Quadratic => 6,
        }
    }
}

/// Farthest coordinate of a node of a file, m: volumes of what is larger leave the range of f64.
pub const FARTHEST_M: f64 = 1e9;

/// A named (physical) group of the Gmsh file.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// 0 points, 1 curve, 2 surface, 3 volume.
    pub dimension: u8,
    /// Indices into the tetrahedra (dimension 3) or the facets (dimension 2); empty otherwise.
    pub elements: Vec<u32>,
    /// Indices of all nodes of the group, ascending, each once.
    pub nodes: Vec<u32>,
}

/// Corner pairs of the mid-edge nodes 4-9 of a ten-node tetrahedron, in Gmsh's order. (VTK and
/// Abaqus have the last two the other way round.)
pub const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]];

/// Corner pairs of the mid-edge nodes 3-5 of a six-node triangle.
pub const FACET_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [0, 2]];

/// A tetrahedral mesh. Node numbering inside an element is Gmsh's: corners 0-3, then the middles
/// of the edges [`TET_EDGES`] (facets: corners 0-2, then [`FACET_EDGES`]). Indices are positions in
/// `nodes_m`; the tags of the file are kept for messages only.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Of all elements.
    pub order: ElementOrder,
    /// Node positions, m.
    pub nodes_m: Vec<[f64; 3]>,
    /// Tag of each node in the file.
    pub node_tags: Vec<u64>,
    /// `order.nodes_per_tet()` node indices per tetrahedron.
    pub tets: Vec<u32>,
    /// Tag of each tetrahedron in the file.
    pub tet_tags: Vec<u64>,
    /// `order.nodes_per_facet()` node indices per facet.
    pub facets: Vec<u32>,
    /// Tag of each facet in the file.
    pub facet_tags: Vec<u64>,
    /// By name.
    pub groups: BTreeMap<String, Group>,
}

impl Mesh {
    /// Number of tetrahedra.
    pub fn tet_count(&self) -> usize {
        self.tet_tags.len()
    }
    /// Node indices of tetrahedron `e`.
    pub fn tet(&self, e: usize) -> &[u32] {
        let n = self.order.nodes_per_tet();
        &self.tets[e * n..(e + 1) * n]
    }
    /// Node indices of facet `f`.
    pub fn facet(&self, f: usize) -> &[u32] {
        let n = self.order.nodes_per_facet();
        &self.facets[f * n..(f + 1) * n]
    }
}
