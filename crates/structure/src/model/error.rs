//! Errors in the match of a scene and its mesh.

use std::path::PathBuf;

use thiserror::Error;

use dovetail_mesh::text::list;

/// Error of a scene that asks for something its mesh does not have. Tags are those of Gmsh, lengths
/// are in metres. Lists hold the first few entries, with the number of all.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum ModelError {
    #[error("the scene has no body: name the one that vibrates, and what it is in contact with")]
    NoBody,
    #[error(
        "{used_by}: the mesh has no group `{name}`; {} it has: {}",
        plural(wanted),
        list(available)
    )]
    UnknownGroup {
        used_by: String,
        name: String,
        /// `volume`, `flank` or `any`.
        wanted: &'static str,
        available: Vec<String>,
    },
    #[error(
        "{used_by}: group `{name}` is a {found}, not a {wanted}; {} the mesh has: {}",
        plural(wanted),
        list(available)
    )]
    GroupDimension {
        used_by: String,
        name: String,
        found: &'static str,
        wanted: &'static str,
        available: Vec<String>,
    },
    #[error(
        "{used_by}: group `{name}` has no elements in the mesh: name a group that has some, or see in the mesher why it is empty"
    )]
    EmptyGroup { used_by: String, name: String },
    #[error("{used_by}: there is no body `{name}`; bodies: {}", list(available))]
    UnknownBody {
        used_by: String,
        name: String,
        available: Vec<String>,
    },
    #[error(
        "bodies `{first}` and `{second}` share {count} nodes (first tags {}): contact needs two nodes at each point: do not merge the nodes of the two bodies (in a preprocessor: equivalenced or tied nodes; in a Gmsh script: Coherence, BooleanFragments, or one surface of two volumes)",
        list(tags)
    )]
    SharedNodes {
        first: String,
        second: String,
        count: usize,
        tags: Vec<u64>,
    },
    #[error(
        "body `{body}` has no material: {}; materials of the mesh: {available}; give young_pa, poisson and density_kg_m3, or name one of these by `material`",
        match name {
            Some(name) => format!("the mesh has none called `{name}`"),
            None => "its mesh gives none to all of its elements".to_string(),
        }
    )]
    NoMaterial {
        body: String,
        name: Option<String>,
        available: String,
    },
    #[error(
        "body `{body}` has elements of several materials ({}): make each a body of its own, or name the one that holds for all by `material`",
        list(names)
    )]
    SeveralMaterials { body: String, names: Vec<String> },
    #[error(
        "body `{body}`, material `{name}` of the mesh: {reason}; or give young_pa, poisson and density_kg_m3 of the body"
    )]
    BadMaterial {
        body: String,
        name: String,
        reason: String,
    },
    #[error(
        "body `{body}`: the matrices of {} were not read: pass them to the binding with the mesh",
        path.display()
    )]
    MatricesMissing { body: String, path: PathBuf },
    #[error(
        "body `{body}`: two nodes of its mesh have the number {tag}, so that rows of its matrices cannot be told apart: give the mesh from which the matrices were made"
    )]
    TagTwice { body: String, tag: u64 },
    #[error(
        "body `{body}`: none of the {rows} rows of its matrices is a displacement of a node of its mesh: the rows begin with nodes {}, the mesh with {}; give the mesh from which the matrices were made, or number the table of rows (`rows_file`) like it",
        list(nodes),
        list(tags)
    )]
    NoRowOnMesh {
        body: String,
        rows: usize,
        nodes: Vec<u64>,
        tags: Vec<u64>,
    },
    #[error(
        "body `{body}`: it is turned, and {count} nodes, the first of them {tag}, have one or two of the three displacements in its matrices: what holds the others would be turned, too; export the matrices without these supports and hold the nodes by `fixed`, or do not turn the body"
    )]
    TurnedRows {
        body: String,
        count: usize,
        tag: u64,
    },
    #[error(
        "body `{body}`: value {row} of its steady load, counted from 1, acts on a row with neither stiffness nor mass, and no spring of the scene acts on it: nothing can carry the load"
    )]
    LoadOnEmptyRow { body: String, row: usize },
    #[error(
        "contact `{contact}`: {count} nodes of its flank on body `{body}` (first tags {}) have no row with stiffness or mass in the matrices of that body: retain them where the matrices are made, or name a surface whose nodes have rows",
        list(tags)
    )]
    FlankWithoutRows {
        body: String,
        contact: String,
        count: usize,
        tags: Vec<u64>,
    },
    #[error(
        "body `{body}`: it has matrices of another program, which contain no stress and no centrifugal load: leave it out of `bodies` of [rotation], and export its matrices at the speed"
    )]
    MatricesRotate { body: String },
    #[error(
        "body `{body}`: the volume `{volume}` has no solid elements: mesh in three dimensions (gmsh -3), or give the body the matrices of another program (stiffness_file and mass_file), for which its surfaces are enough"
    )]
    SurfaceAlone { body: String, volume: String },
    #[error("body `{body}`: no node of the fixed group `{group}` belongs to it")]
    FixedElsewhere { body: String, group: String },
    #[error(
        "contact `{contact}`: {count} facets of `{group}` (first tags {}) are not on the surface of `{body}`, which has the most of its nodes",
        list(tags)
    )]
    FlankOffBody {
        contact: String,
        group: String,
        body: String,
        count: usize,
        tags: Vec<u64>,
    },
    #[error(
        "contact `{contact}`: facet {tag} of `{group}` lies inside the body, between two elements: a flank is part of the outer surface"
    )]
    FlankInside {
        contact: String,
        group: String,
        tag: u64,
    },
    #[error(
        "{used_by}: `{group}` is a set of {nodes} nodes, and no face on the surface of body `{body}` has all its nodes in it: add the missing nodes (those in the middles of edges too), or name a surface"
    )]
    NoFaces {
        used_by: String,
        group: String,
        nodes: usize,
        body: String,
    },
    #[error("contact `{contact}`: facet {tag} of `{group}` {reason}")]
    BadFacet {
        contact: String,
        group: String,
        tag: u64,
        reason: &'static str,
    },
    #[error(
        "contact `{contact}`: no facet of `{first}` lies opposite one of `{second}`: {}",
        match nearest {
            Some((at, apart)) if *apart < 0.0 => format!(
                "each lies behind the other, by {:.3e} m where they are nearest, at ({}, {}, {}) m; name the surfaces that touch, or, if the bodies overlap, move them apart (units, translation_m)", -apart, at[0], at[1], at[2]
            ),
            Some((at, apart)) => format!(
                "the nearest two are {apart:.3e} m apart, at ({}, {}, {}) m; bring the bodies together (units, translation_m), or give a larger search_distance_m", at[0], at[1], at[2]
            ),
            None => "along their normals they miss each other; check the groups, and where the bodies stand (units, translation_m)".to_string(),
        }
    )]
    NoneOpposite {
        contact: String,
        first: String,
        second: String,
        /// Position where two facets that lie opposite each other are nearest, and their distance
        /// there, m, which is negative if the bodies overlap.
        nearest: Option<([f64; 3], f64)>,
    },
    #[error("contact `{contact}`: the flanks do not face each other at ({x:.3e}, {y:.3e}, {z:.3e}) m (their outward normals are {degrees:.0} degrees apart, not 180): name the surfaces that touch, and check whether the bodies overlap or stand on the same side. The facets of a body without elements are counter-clockwise seen from outside", x = position_m[0], y = position_m[1], z = position_m[2])]
    NotFacing {
        contact: String,
        position_m: [f64; 3],
        degrees: f64,
    },
    #[error(
        "{count} nodes (first tags {}) would follow the opposite flanks of contacts `{first}` and `{second}`: let the other flank of one of them follow (its key `slave`), or leave a gap between the two surfaces",
        list(tags)
    )]
    SlaveTwice {
        first: String,
        second: String,
        count: usize,
        tags: Vec<u64>,
    },
    #[error(
        "body `{body}`: {count} nodes (first tags {}) are fixed and on the flank of contact `{contact}`: keep fixed groups off the flank, or let the other flank be the `slave`",
        list(tags)
    )]
    FlankFixed {
        body: String,
        contact: String,
        count: usize,
        tags: Vec<u64>,
    },
    #[error(
        "{used_by}: group `{group}` has {count} nodes (first tags {}) that are fixed, or have no row with stiffness or mass in the matrices of their body: they cannot move; name another group, or hold less by `fixed`",
        list(tags)
    )]
    NodesFixed {
        used_by: String,
        group: String,
        count: usize,
        tags: Vec<u64>,
    },
    #[error(
        "{used_by}: each of the {count} nodes of group `{group}` is held against the load (keys fixed, fixed_x, fixed_y, fixed_z): all of it goes to the supports; name another group or another direction"
    )]
    NodesHeld {
        used_by: String,
        group: String,
        count: usize,
    },
    #[error("{used_by}: the field of {} is not read", path.display())]
    FieldMissing { used_by: String, path: PathBuf },
    #[error(
        "{used_by}: {count} of {points} points of {field} are farther from surface `{group}` than the body is large ({size_m:.3e} m), the farthest {distance_m:.3e} m: give coordinates in metres, in the frame of the mesh"
    )]
    FieldFar {
        used_by: String,
        group: String,
        field: String,
        count: usize,
        points: usize,
        distance_m: f64,
        size_m: f64,
    },
    #[error("{used_by}: {field} has {found}, and {wanted} are expected: name another file")]
    FieldKind {
        used_by: String,
        field: String,
        found: &'static str,
        wanted: &'static str,
    },
    #[error(
        "contact `{contact}`: the nearest point of {field} is {distance_m:.3e} m away from a pair, which is farther than the flank is large ({size_m:.3e} m): give points on the flank, with coordinates in metres, in the frame of the mesh"
    )]
    FrictionFar {
        contact: String,
        field: String,
        distance_m: f64,
        size_m: f64,
    },
    #[error(
        "{used_by}: {count} nodes of group `{group}` (first tags {}) belong to no body",
        list(tags)
    )]
    NodesElsewhere {
        used_by: String,
        group: String,
        count: usize,
        tags: Vec<u64>,
    },
    #[error(
        "body `{body}`, {key}: {count} nodes (first tags {}) are on the flank of contact `{contact}`: its nodes may be held only along the flank (a curved one may turn away from a plane of symmetry by 30 degrees), and on both sides of the contact alike, as on a plane of symmetry that cuts the contact; or let the other flank be the `slave`",
        list(tags)
    )]
    FlankHeld {
        body: String,
        key: &'static str,
        contact: String,
        count: usize,
        tags: Vec<u64>,
    },
    #[error(
        "contact `{contact}`: crown_axis [{}, {}, {}] stands across the flank; give a direction that runs along it, or leave it out for a spherical crown",
        axis[0], axis[1], axis[2]
    )]
    CrownAcross { contact: String, axis: [f64; 3] },
    #[error("{used_by}: group `{group}` is a {found}; it acts on {wanted}")]
    LoadDimension {
        used_by: String,
        group: String,
        found: &'static str,
        wanted: &'static str,
    },
    #[error(
        "{used_by}: group `{group}` has nodes of several bodies: give each body a group of its own, and one of these for each"
    )]
    SeveralBodies { used_by: String, group: String },
    #[error(
        "{used_by}: facet {tag} of `{group}` is not on the surface of body `{body}`, or lies between two of its elements: name part of the outer surface"
    )]
    FacetInside {
        used_by: String,
        group: String,
        tag: u64,
        body: String,
    },
    #[error(
        "{used_by}: group `{group}` is a {found}; a strain gauge lies on a surface or on a group of nodes"
    )]
    GaugeDimension {
        used_by: String,
        group: String,
        found: &'static str,
    },
    #[error(
        "{used_by}: direction [{}, {}, {}] leaves {} `{group}` at {degrees:.0} degrees; a strain gauge lies in the surface, 30 degrees at most",
        direction[0], direction[1], direction[2],
        if *among_several { "all faces at" } else { "a face of" }
    )]
    GaugeSteep {
        used_by: String,
        group: String,
        direction: [f64; 3],
        degrees: f64,
        among_several: bool,
    },
    #[error(
        "{used_by}: group `{group}` is a {found}; a spring or a dashpot acts on a surface or on a group of nodes"
    )]
    SpringDimension {
        used_by: String,
        group: String,
        found: &'static str,
    },
    #[error(
        "body `{body}`: the edges of its flanks are made straight, by up to {largest_m:.2e} m, and {count} elements (first {}) fold over themselves then: mesh finer there, or with straight edges (Mesh.SecondOrderLinear = 1 in a Gmsh script)",
        list(tags)
    )]
    FoldedAtFlank {
        body: String,
        count: usize,
        tags: Vec<u64>,
        largest_m: f64,
    },
    #[error(
        "{used_by}: {count} nodes of `{group}` belong to no body (first tags {}): name a surface of the bodies",
        list(tags)
    )]
    NoBodyAtFace {
        used_by: String,
        group: String,
        count: usize,
        tags: Vec<u64>,
    },
    #[error(
        "[cyclic]: turned by one of {sectors} pitches about the axis, {count} nodes of `low` (first tags {}) meet no node of `high`: the nearest one is {distance_m:.3e} m away{}",
        list(tags),
        if *other_way {
            "; turned the other way round all of them do: exchange `low` and `high`"
        } else {
            ". Check `sectors`, the axis and metres_per_unit, and mesh one face as the copy of the other (Periodic Surface in a Gmsh script)"
        }
    )]
    FacesApart {
        sectors: usize,
        count: usize,
        tags: Vec<u64>,
        distance_m: f64,
        other_way: bool,
    },
    #[error(
        "contact `{contact}`: its second flank is in the next sector, and there is no [cyclic]"
    )]
    NoNextSector { contact: String },
    #[error(
        "[cyclic]: `low` has {low} nodes and `high` has {high}: mesh one face as the copy of the other (Periodic Surface in a Gmsh script)"
    )]
    FacesDiffer { low: usize, high: usize },
    #[error(
        "[cyclic]: {count} nodes (first tags {}) are on the axis, or on both faces: leave a hole around the axis",
        list(tags)
    )]
    FaceOnAxis { count: usize, tags: Vec<u64> },
    #[error(
        "[cyclic]: {count} nodes of the faces (first tags {}) belong to a contact, too: end the contact before the faces of the sector, or put these elsewhere",
        list(tags)
    )]
    FaceInContact { count: usize, tags: Vec<u64> },
    #[error(
        "[cyclic]: {count} nodes (first tags {}) are held otherwise than the nodes of the other face that they meet, or along an axis that a pitch turns elsewhere: support both faces alike, along the axis of the disc or along all axes",
        list(tags)
    )]
    FaceHeld { count: usize, tags: Vec<u64> },
    #[error(
        "[cyclic]: `influence` is that on one of several bodies: name it by `influence_on`; bodies: {}",
        list(available)
    )]
    InfluenceOnNone { available: Vec<String> },
    #[error("[cyclic]: the aerodynamic influence of {} is not read", path.display())]
    InfluenceMissing { path: PathBuf },
    #[error(
        "[cyclic]: `influence` has nodal diameter {nodal_diameter}, and those of this disc are -{largest} to {largest}: check `sectors` and the file"
    )]
    InfluenceOfNoWave { nodal_diameter: i64, largest: i64 },
    #[error(
        "[cyclic]: engine order {engine_order} makes a wave of nodal diameter {nodal_diameter}, of which `influence` has no coefficient, but of {}: add its rows, with zeros where the air does nothing (a wave that runs in the direction of the right hand about the axis has a nodal diameter above 0, and one that runs the other way has one below 0)",
        list(given)
    )]
    InfluenceLacksWave {
        nodal_diameter: i64,
        engine_order: usize,
        given: Vec<i64>,
    },
    #[error("every node of body `{body}` is fixed: shorten its list of fixed groups")]
    NothingFree { body: String },
}

/// Part of a description that an error is about.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ErrorSubject<'e> {
    /// Item of the description, in the words of the error: ``contact `joint` ``, `load 1`.
    pub item: String,
    /// Name that the item gives, such as the name of a group; `None` if the error is about the whole item.
    pub name: Option<&'e str>,
    /// Names that exist; empty if the name itself exists.
    pub available: &'e [String],
}

impl ModelError {
    /// Part of the description that the error is about; `None` for several parts.
    pub fn subject(&self) -> Option<ErrorSubject<'_>> {
        let of = |item: String, name| ErrorSubject {
            item,
            name,
            available: &[],
        };
        let contact = |contact: &String, name| of(format!("contact `{contact}`"), name);
        let body = |body: &String, name| of(format!("body `{body}`"), name);
        Some(match self {
            Self::UnknownGroup {
                used_by,
                name,
                available,
                ..
            }
            | Self::GroupDimension {
                used_by,
                name,
                available,
                ..
            }
            | Self::UnknownBody {
                used_by,
                name,
                available,
            } => ErrorSubject {
                item: used_by.clone(),
                name: Some(name),
                available,
            },
            Self::EmptyGroup { used_by, name } => of(used_by.clone(), Some(name)),
            Self::NodesFixed { used_by, group, .. }
            | Self::NodesHeld { used_by, group, .. }
            | Self::NodesElsewhere { used_by, group, .. }
            | Self::LoadDimension { used_by, group, .. }
            | Self::SeveralBodies { used_by, group }
            | Self::FacetInside { used_by, group, .. }
            | Self::GaugeDimension { used_by, group, .. }
            | Self::GaugeSteep { used_by, group, .. }
            | Self::SpringDimension { used_by, group, .. }
            | Self::NoBodyAtFace { used_by, group, .. }
            | Self::NoFaces { used_by, group, .. }
            | Self::FieldFar { used_by, group, .. } => of(used_by.clone(), Some(group)),
            Self::FlankOffBody {
                contact: of, group, ..
            }
            | Self::FlankInside {
                contact: of, group, ..
            }
            | Self::BadFacet {
                contact: of, group, ..
            } => contact(of, Some(group)),
            Self::NoneOpposite {
                contact: of,
                second,
                ..
            } => contact(of, Some(second)),
            Self::NotFacing { contact: of, .. }
            | Self::CrownAcross { contact: of, .. }
            | Self::NoNextSector { contact: of }
            | Self::FlankFixed { contact: of, .. }
            | Self::FlankHeld { contact: of, .. }
            | Self::FlankWithoutRows { contact: of, .. } => contact(of, None),
            Self::FixedElsewhere { body: of, group } => body(of, Some(group)),
            Self::SurfaceAlone { body: of, volume } => body(of, Some(volume)),
            Self::NoMaterial { body: of, .. }
            | Self::SeveralMaterials { body: of, .. }
            | Self::BadMaterial { body: of, .. }
            | Self::MatricesRotate { body: of }
            | Self::NothingFree { body: of } => body(of, None),
            Self::SharedNodes { second, .. } => body(second, None),
            Self::FacesApart { .. } | Self::FacesDiffer { .. } | Self::FaceOnAxis { .. } => {
                of("[cyclic]".to_owned(), None)
            }
            _ => return None,
        })
    }
}

fn plural(wanted: &str) -> String {
    match wanted {
        "any" => "groups".to_string(),
        "flank" => "surfaces and points".to_string(),
        kind => format!("{kind} groups"),
    }
}
