//! What can be wrong with a mesh file.

use std::path::PathBuf;

use thiserror::Error;

/// Why a mesh file cannot be used.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
pub enum MeshError {
    #[error("cannot read the mesh {}: {source}", path.display())]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("mesh {}: {source}", path.display())]
    File {
        path: PathBuf,
        source: Box<MeshError>,
    },
    #[error("metres_per_unit is {0}: give a positive length (0.001 for a mesh in mm)")]
    Unit(f64),
    #[error(
        "not a Gmsh mesh: it does not begin with $MeshFormat (write it with `gmsh -3 script.geo -format msh41 -o mesh.msh`)"
    )]
    NotMsh,
    #[error(
        "MSH version {found} is not read, only 4.1 and 2.2: convert it with `gmsh -0 old.msh -format msh41 -o new.msh`, or mesh with `-format msh41`"
    )]
    Version { found: String },
    #[error(
        "the $MeshFormat line `{line}` is not understood: expected `4.1 0 8` (ASCII) or `4.1 1 8` (binary), or the same with 2.2"
    )]
    Header { line: String },
    #[error("section ${section} is missing or cut off: the file is not complete; write it again")]
    MissingSection { section: &'static str },
    #[error("the mesh is partitioned ($PartitionedEntities): write it without `-part`")]
    Partitioned,
    #[error("the file is malformed near byte {byte} ({at}): {reason}")]
    Malformed {
        byte: usize,
        at: String,
        reason: String,
    },
    #[error("$PhysicalNames, line `{line}`: expected `dimension tag \"name\"`")]
    PhysicalName { line: String },
    #[error("$PhysicalNames says {said} names and has {found}")]
    PhysicalNameCount { said: String, found: usize },
    #[error(
        "two groups are called `{name}`: give each group, of whatever dimension, a name of its own"
    )]
    GroupNameTwice { name: String },
    #[error("the mesh has no {what}")]
    Empty { what: &'static str },
    #[error("the header says {said} {what} and the file has {found}")]
    Total {
        what: &'static str,
        said: u64,
        found: u64,
    },
    #[error("{what} tag {tag} is outside the header's range {min} to {max}")]
    TagRange {
        what: &'static str,
        tag: u64,
        min: u64,
        max: u64,
    },
    #[error("the node at ({x}, {y}, {z}) has the tag of another node", x = at[0], y = at[1], z = at[2])]
    SharedTag { at: [f64; 3] },
    #[error("{what} tag {tag} occurs twice")]
    TagTwice { what: &'static str, tag: u64 },
    #[error("{found} {what} are more than the {limit} that can be numbered", limit = u32::MAX)]
    TooMany { what: &'static str, found: u64 },
    #[error(
        "node {tag} is at ({x:e}, {y:e}, {z:e}) in the unit of the file: give finite coordinates of \
         at most {most:e} m, and look at metres_per_unit",
        x = at[0], y = at[1], z = at[2], most = super::FARTHEST_M
    )]
    NotFinite { tag: u64, at: [f64; 3] },
    #[error("element {element} names node {node}, which the file does not have")]
    MissingNode { element: u64, node: u64 },
    #[error("element {element} names node {node} twice")]
    RepeatedNode { element: u64, node: u64 },
    #[error(
        "elements of {kind} stand on entity {entity} of dimension {dimension}, where they cannot be"
    )]
    Dimension {
        kind: String,
        entity: i32,
        dimension: i32,
    },
    #[error(
        "elements stand on entity {entity} of dimension {dimension}, which $Entities does not list"
    )]
    UnknownEntity { dimension: i32, entity: i32 },
    #[error(
        "group `{group}` has elements of type {kind}: only tetrahedra (4 or 10 nodes), pyramids (5 or 13), wedges (6 or 15), hexahedra (8 or 20), triangles (3 or 6), quadrilaterals (4 or 8), lines (2 or 3) and points are read; mesh with Mesh.ElementOrder 1 or 2"
    )]
    UnsupportedElement { group: String, kind: String },
    #[error(
        "group `{group}` has elements of {nodes} nodes, with nodes inside faces or elements: only those with nodes at corners and in the middles of edges are read; mesh with `Mesh.SecondOrderIncomplete = 1;`"
    )]
    CompleteElement { group: String, nodes: usize },
    #[error(
        "element {element} is of Gmsh's type {kind}, which is not read: mesh with Mesh.ElementOrder 1 or 2 and `Mesh.SecondOrderIncomplete = 1;`"
    )]
    ElementKind { element: u64, kind: String },
    #[error(
        "the mesh has no physical groups: name the volumes and surfaces in the script with `Physical Volume(\"blade\") = {{..}};` and so on"
    )]
    NoGroups,
    #[error(
        "no group has solid elements: is it meshed in three dimensions (`gmsh -3`), and has it a `Physical Volume`?"
    )]
    NoElements,
}

impl MeshError {
    /// Whether the file breaks off, or its bytes are no mesh's: the fault is that of its writing,
    /// not of what was meshed.
    pub fn is_damage(&self) -> bool {
        match self {
            Self::File { source, .. } => source.is_damage(),
            Self::NotMsh
            | Self::Header { .. }
            | Self::MissingSection { .. }
            | Self::Malformed { .. }
            | Self::PhysicalNameCount { .. }
            | Self::Total { .. }
            | Self::TagRange { .. }
            | Self::SharedTag { .. }
            | Self::TagTwice { .. }
            | Self::MissingNode { .. }
            | Self::UnknownEntity { .. } => true,
            _ => false,
        }
    }
}
