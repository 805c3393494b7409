//! Errors of a mesh file.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::text;

/// Error of a mesh file that cannot be used.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum MeshError {
    #[error("cannot read the mesh {}: {source}{}", path.display(), missing(path, source))]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("mesh {}: {error}", path.display())]
    File {
        path: PathBuf,
        error: Box<MeshError>,
    },
    #[error("metres_per_unit is {0}: give a positive length (0.001 for a mesh in mm)")]
    Unit(f64),
    #[error(
        "not a Gmsh mesh: it does not begin with $MeshFormat (write it with `gmsh -3 script.geo -format msh41 -o mesh.msh`)"
    )]
    NotMsh,
    #[error(
        "MSH version {found}{encoding} is not read, only 4.1, 4.0 as text, and 2: convert it with `gmsh -0 old.msh -format msh41 -o new.msh`, or mesh with `-format msh41`"
    )]
    Version {
        found: String,
        encoding: &'static str,
    },
    #[error(
        "the $MeshFormat line `{line}` is not understood: expected `4.1 0 8` (ASCII) or `4.1 1 8` (binary), or the same with 2.2"
    )]
    Header { line: String },
    #[error("section ${section} is missing or cut off: the file is not complete; write it again")]
    MissingSection { section: &'static str },
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
    #[error("the node at ({x}, {y}, {z}) has the tag of another node", x = at[0], y = at[1], z = at[2])]
    SharedTag { at: [f64; 3] },
    #[error("{what} tag {tag} occurs twice")]
    TagTwice { what: &'static str, tag: u64 },
    #[error("{found} {what} are more than the {limit} that can be numbered", limit = u32::MAX)]
    TooMany { what: &'static str, found: u64 },
    #[error(
        "node {tag} is at ({x:e}, {y:e}, {z:e}) in the unit of the file: give finite coordinates of \
         at most {most:e} m, and look at metres_per_unit",
        x = at[0], y = at[1], z = at[2], most = crate::FARTHEST_M
    )]
    NotFinite { tag: u64, at: [f64; 3] },
    #[error("element {element} names node {node}, which the file does not have")]
    MissingNode { element: u64, node: u64 },
    #[error(
        "element {element} names node {node} twice, which gives no other shape: correct its nodes, or remove it"
    )]
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
    #[error("the file is empty: write it again")]
    NoBytes,
    #[error("this is {what}, which is not read; {remedy}")]
    OtherFormat { what: &'static str, remedy: String },
    #[error(
        "the format of the mesh is not known: read are Gmsh's MSH 4 and 2, decks of Abaqus and CalculiX (.inp), archives of Ansys (.cdb), bulk data of Nastran (.bdf, .dat, .nas) and VTU; many programs write one of them, and `meshio convert mesh.xyz mesh.vtu` converts others"
    )]
    UnknownFormat,
    #[error("{place}: {error}")]
    Deck {
        place: String,
        error: Box<MeshError>,
    },
    #[error("the keyword lacks {parameter}=")]
    ParameterMissing { parameter: &'static str },
    #[error("{found} is cut short and may stand for {words}: write the word in full")]
    CutShort { found: String, words: String },
    #[error("`{found}` is not a number")]
    NotANumber { found: String },
    #[error("`{found}` is not the number of a node or an element (a whole number)")]
    NotALabel { found: String },
    #[error(
        "{keyword} makes or moves nodes and elements by a rule, which is not read: write the deck out, in Abaqus/CAE by importing it as a model and writing its input, or in CalculiX' cgx by `send all abq`"
    )]
    NotWrittenOut { keyword: String },
    #[error(
        "{command} makes, moves or removes nodes and elements by a rule, which is not read: let Mechanical APDL read the file and write the mesh by `CDWRITE,DB,part,cdb`"
    )]
    ArchiveNotWrittenOut { command: String },
    #[error(
        "`{found}` is not the format of a block, such as (3i9,6e21.13e3): write the archive again by CDWRITE"
    )]
    BlockFormat { found: String },
    #[error(
        "the number {number} of a component ends no range: a negative number must follow a smaller positive one"
    )]
    ComponentRange { number: i64 },
    #[error("an element has {found} fields and needs {needed}")]
    ElementFields { needed: usize, found: usize },
    #[error(
        "there is no coordinate system {number}, or none of a kind that is read (rectangular, cylindrical, spherical)"
    )]
    UnknownSystem { number: u64 },
    #[error(
        "`{card}` repeats fields of the card before it, which is not read: write the bulk data again with the program that made them, as it writes all fields"
    )]
    BulkNotWrittenOut { card: String },
    #[error(
        "the continuation `{found}` does not follow the line that ends with `{expected}`: write the bulk data in order"
    )]
    Continuation { found: String, expected: String },
    #[error(
        "the three points of coordinate system {number} are on one line, or depend on the system"
    )]
    SystemPoints { number: u64 },
    #[error(
        "nodes in the system `{found}` are not read, only rectangular (R) and cylindrical (C) ones: write the deck out in rectangular coordinates"
    )]
    NodeSystem { found: String },
    #[error("elements of type {kind} (ELSET {set}) are not read: {read}")]
    ElementTypeUnknown {
        kind: String,
        set: String,
        read: &'static str,
    },
    #[error(
        "elements of type {kind} (ELSET {set}) have nodes inside faces or elements ({nodes} nodes in all): mesh with those that have nodes at corners and in the middles of edges alone, such as C3D20, C3D15 or S8R"
    )]
    NodesInside {
        kind: String,
        set: String,
        nodes: usize,
    },
    #[error(
        "elements of types {kinds} are neither solids nor surfaces, and the file has no others; read are {read}"
    )]
    NothingRead { kinds: String, read: &'static str },
    #[error("element {element} has {found} nodes, and type {kind} has {expected}")]
    NodesOfElement {
        element: u64,
        kind: String,
        expected: usize,
        found: usize,
    },
    #[error("element {label} occurs twice: give each element a number of its own")]
    ElementTwice { label: u64 },
    #[error("there is no {what} `{name}`; known: {known}")]
    NoSuchName {
        what: &'static str,
        name: String,
        known: String,
    },
    #[error("the set `{name}` holds itself, or sets stand too deep inside one another")]
    SetCircle { name: String },
    #[error("with GENERATE a line is `first, last, step`, with a step of at least 1: `{line}`")]
    Generate { line: String },
    #[error("a line of *SURFACE begins with an element or a set")]
    SurfaceOfAll,
    #[error("element {element} has no face `{found}`: {what} have S1 to S{faces}")]
    FaceLabel {
        found: String,
        element: u64,
        what: &'static str,
        faces: usize,
    },
    #[error(
        "`{line}`: the first line of *INSTANCE is a translation `x, y, z`, the second a rotation `ax, ay, az, bx, by, bz, angle` about the line through two points"
    )]
    Placement { line: String },
    #[error("the keyword needs {needs}")]
    Misplaced { needs: &'static str },
    #[error("{begin} has no {end}: the file is not complete")]
    NotEnded {
        begin: &'static str,
        end: &'static str,
    },
    #[error("two {what} are called `{name}`: give each a name of its own")]
    ScopeTwice { what: &'static str, name: String },
    #[error("`{file}` is included: a deck without a place of its own cannot include another file")]
    IncludeAlone { file: String },
    #[error("`{file}` is included inside itself, or too many files are included")]
    IncludeCircle { file: String },
    #[error("the VTU file is not whole: {reason}")]
    Vtu { reason: String },
    #[error(
        "the VTK file holds `{found}`, not UnstructuredGrid: open it in ParaView and save it as .vtu (a .pvtu or .vtm after the filter Merge Blocks); a surface alone (PolyData) must be meshed first"
    )]
    VtuKind { found: String },
    #[error(
        "the arrays are compressed by {found}, which is not read: write the file with zlib or without compression (ParaView: Compressor Type when saving)"
    )]
    VtuCompressor { found: String },
    #[error("the array `{array}` of the VTU file: {reason}")]
    VtuArray { array: String, reason: String },
    #[error(
        "cell {cell} has VTK's type {kind}, which is not read: read are tetrahedra (10, 24), pyramids (14, 27), wedges (13, 26), hexahedra (12, 25, 11), triangles (5, 22), quadrilaterals (9, 23, 8), polygons of 3 or 4 nodes (7), lines (3, 4, 21) and vertices (1, 2); mesh without nodes inside faces (gmsh: Mesh.SecondOrderIncomplete = 1), and split polyhedra by ParaView's filter Tetrahedralize"
    )]
    CellType { cell: u64, kind: f64 },
    #[error(
        "no group has solid elements: is it meshed in three dimensions (`gmsh -3`), and has it a `Physical Volume`?"
    )]
    NoElements,
}

/// Note on the folder of a file that does not exist.
fn missing(path: &Path, source: &std::io::Error) -> String {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    match folder.filter(|_| source.kind() == std::io::ErrorKind::NotFound) {
        Some(folder) if !folder.is_dir() => {
            format!("; the folder {} does not exist either", folder.display())
        }
        _ => String::new(),
    }
}

impl MeshError {
    /// Error of a name that is none of those known.
    pub(super) fn unknown_name<'a>(
        what: &'static str,
        name: &str,
        known: impl Iterator<Item = &'a String>,
    ) -> Self {
        Self::NoSuchName {
            what,
            name: name.to_owned(),
            known: text::list(&known.collect::<Vec<_>>()),
        }
    }

    /// Checks that so many nodes, elements or facets can be numbered.
    pub(super) fn check_number(what: &'static str, found: u64) -> Result<(), Self> {
        if found >= u64::from(u32::MAX) {
            return Err(Self::TooMany { what, found });
        }
        Ok(())
    }

    /// Returns `true` if the file is cut off, or its bytes are not those of a mesh: the fault is in
    /// its writing, not in what was meshed.
    pub fn is_damage(&self) -> bool {
        match self {
            Self::File { error, .. } | Self::Deck { error, .. } => error.is_damage(),
            Self::NotMsh
            | Self::NoBytes
            | Self::OtherFormat { .. }
            | Self::UnknownFormat
            | Self::Header { .. }
            | Self::MissingSection { .. }
            | Self::Malformed { .. }
            | Self::PhysicalNameCount { .. }
            | Self::Total { .. }
            | Self::SharedTag { .. }
            | Self::TagTwice { .. }
            | Self::MissingNode { .. }
            | Self::UnknownEntity { .. }
            | Self::Vtu { .. }
            | Self::VtuArray { .. } => true,
            _ => false,
        }
    }
}
