//! Bodies and what acts on them, as a user describes them: in SI units, with the names of mesh groups still
//! unresolved.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::contact::penalty::PairStiffness;
use crate::model::MeshSource;
use dovetail_mesh::parts::Placement;
use dovetail_mesh::surface_field::SurfaceField;
use dovetail_mesh::units::Units;

/// Bodies of a mesh, how they are held, driven and watched.
#[derive(Debug, Clone, PartialEq)]
pub struct Assembly {
    /// Where the mesh is from that bodies without one of their own share.
    pub mesh: Option<MeshSource>,
    /// Any number of them.
    pub bodies: Vec<BodySpec>,
    /// `None`: the scene does not rotate and no prestress is computed.
    pub rotation: Option<RotationSpec>,
    /// Where bodies touch each other, or the ground.
    pub contacts: Vec<ContactSpec>,
    /// Linear springs to ground and between groups of nodes.
    pub springs: Vec<SpringSpec>,
    /// Steady loads besides the rotation's.
    pub loads: Vec<LoadSpec>,
    /// What shakes it.
    pub excitations: Vec<ExcitationSpec>,
    /// Displacements that are watched.
    pub observations: Vec<ObservationSpec>,
}

/// One body.
#[derive(Debug, Clone, PartialEq)]
pub struct BodySpec {
    /// The name by which messages and other items call it.
    pub name: String,
    /// Where its elements come from.
    pub mesh: BodyMesh,
    /// Name of the volume group.
    pub volume: String,
    /// What it is made of.
    pub material: MaterialSpec,
    /// Groups (of any dimension) whose nodes do not move.
    pub fixed: Vec<String>,
    /// Groups whose nodes do not move along x, y, z (planes of symmetry, rollers).
    pub fixed_along: [Vec<String>; 3],
    /// Number of fixed-interface modes kept in the Craig-Bampton reduction.
    pub fixed_interface_modes: Option<usize>,
}

/// Where the elements of a body come from. A body with a mesh of its own knows the groups of that mesh by
/// their names; for all others they are called `<body>.<group>`, or by their names alone where no other
/// body has such a group.
#[derive(Debug, Clone, PartialEq)]
pub enum BodyMesh {
    /// The mesh of the assembly.
    Shared,
    /// A file of its own.
    File {
        /// The file.
        path: PathBuf,
        /// Of the file.
        units: Units,
        /// Where it is put.
        placement: Placement,
    },
    /// A copy of another body, as it is in its own place.
    CopyOf {
        /// The other body.
        body: String,
        /// Where it is put.
        placement: Placement,
    },
}

/// What a body is made of.
#[derive(Debug, Clone, PartialEq)]
pub enum MaterialSpec {
    /// Given by numbers.
    Given(Material),
    /// The one of its mesh of this name, or the one that its mesh gives to all its elements.
    OfMesh(Option<String>),
}

impl From<Material> for MaterialSpec {
    fn from(material: Material) -> Self {
        Self::Given(material)
    }
}

/// Isotropic linear elasticity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Material {
    /// Young's modulus.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density.
    pub density_kg_m3: f64,
}

/// Rotation at constant speed.
#[derive(Debug, Clone, PartialEq)]
pub struct RotationSpec {
    /// A point of the axis, m.
    pub point_m: [f64; 3],
    /// Direction of the axis, unit length.
    pub axis: [f64; 3],
    /// 0 or more. At 0 the section is kept (`Some`): a rotating scene at rest, without load or prestress.
    pub speed_rad_s: f64,
    /// Names of the bodies that carry the centrifugal load.
    pub bodies: Vec<String>,
    /// What it adds to the stiffness.
    pub prestress: Prestress,
}

impl RotationSpec {
    /// The angular speed in revolutions per minute.
    pub fn speed_rpm(&self) -> f64 {
        self.speed_rad_s * 30.0 / std::f64::consts::PI
    }
}

/// What the rotation adds to the stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Prestress {
    /// The centrifugal load only.
    None,
    /// Geometric stiffness of each body's static state with its contact nodes held, and spin softening
    /// (the paper's choice). The stress that a body hands on to another one by a contact is not in it.
    HeldFlanks,
    /// Geometric stiffness of the static state of all bodies with contact and friction, and spin softening: stiffness
    /// and state are repeated until the normal forces no longer move.
    Contact,
}

/// Two surfaces that touch.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactSpec {
    /// The name by which messages and results call it.
    pub name: String,
    /// Surface group of a body.
    pub first: String,
    /// Surface group of another body, or another one of the same; `None`: rigid ground.
    pub second: Option<String>,
    /// The flank whose nodes the pairs are made at; `None`: the one of the smaller facets, and the first where
    /// they are alike.
    pub slave: Option<Side>,
    /// What joins the two sides.
    pub law: ContactLaw,
    /// Coulomb coefficient.
    pub friction: f64,
    /// Springs between the flanks; `None`: rigid contact.
    pub stiffness: Option<FlankStiffness>,
    /// Initial clearance along the normal, m (0: the flanks touch; negative: they interfere).
    pub gap_m: f64,
    /// Whether the distance of the flanks in the mesh counts as clearance too.
    pub gap_from_mesh: bool,
    /// Facets of both flanks farther apart than this along the normal are not opposite each other; `None`: half
    /// of the longest edge of both.
    pub search_distance_m: Option<f64>,
    /// Clearance that grows away from a point or line of the flank.
    pub crown: Option<CrownSpec>,
}

/// One of the two flanks of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The one named `first`.
    First,
    /// The one named `second`.
    Second,
}

/// Springs between two flanks, per area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlankStiffness {
    /// Against penetration, N/m3.
    pub normal_n_m3: f64,
    /// Against shear, N/m3.
    pub tangential_n_m3: f64,
}

impl FlankStiffness {
    /// That of a pair with this tributary area, m2.
    pub fn of_area(self, area_m2: f64) -> PairStiffness {
        PairStiffness {
            normal_n_m: self.normal_n_m3 * area_m2,
            tangential_n_m: self.tangential_n_m3 * area_m2,
        }
    }
}

/// What joins the two sides of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactLaw {
    /// Compression only, dry friction.
    UnilateralCoulomb,
    /// Nothing moves: friction, springs, clearance and crown are not used.
    Bonded,
}

/// A crowned flank: to the clearance is added d^2 / (2 radius_m), d the distance in the flank's tangent plane
/// from the centre, or from the line through it along `axis`.
#[derive(Debug, Clone, PartialEq)]
pub struct CrownSpec {
    /// Radius of curvature, m; where both flanks are crowned, R1 R2 / (R1 + R2).
    pub radius_m: f64,
    /// Unit length; `None`: the same curvature in all directions.
    pub axis: Option<[f64; 3]>,
    /// `None`: the centroid of the flank's area.
    pub centre_m: Option<[f64; 3]>,
}

/// A linear spring between the mean displacements of two groups, or from one to ground.
#[derive(Debug, Clone, PartialEq)]
pub struct SpringSpec {
    /// The name by which messages and results call it.
    pub name: String,
    /// Surface group, or a group of nodes.
    pub first: String,
    /// The same, of the same body or of another one; `None`: ground, and the stiffness is shared by the area of the
    /// surface, or equally by the nodes.
    pub second: Option<String>,
    /// In all, not per area or node.
    pub stiffness_n_m: f64,
    /// Unit length; `None`: the same stiffness along all three axes.
    pub direction: Option<[f64; 3]>,
}

/// A steady load, applied with that of the rotation in the load steps of the static state.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadSpec {
    /// Point or curve group (a force is shared equally by its nodes), or surface group, or set of nodes that
    /// serves as one.
    pub on: String,
    /// How large it is.
    pub load: LoadKind,
}

/// A force, a traction or a pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LoadKind {
    /// The whole force, N.
    Force {
        /// Along x, y, z.
        vector_n: [f64; 3],
    },
    /// The same on each part of a surface, Pa.
    Traction {
        /// Along x, y, z.
        vector_pa: [f64; 3],
    },
    /// Along the inward normal of a surface, Pa.
    Pressure {
        /// Positive where it presses.
        pressure_pa: f64,
    },
}

/// What shakes an assembly: `amplitude cos(harmonic omega t - phase_rad)` of what `kind` says.
#[derive(Debug, Clone, PartialEq)]
pub struct ExcitationSpec {
    /// What acts, and where.
    pub kind: ExcitationKind,
    /// In the unit of [`ExcitationKind::unit`].
    pub amplitude: f64,
    /// Multiple of the frequency of the response.
    pub harmonic: usize,
    /// Lag behind the cosine.
    pub phase_rad: f64,
}

/// What shakes an assembly.
#[derive(Debug, Clone, PartialEq)]
pub enum ExcitationKind {
    /// A load of one unit: a force, traction or pressure of length 1.
    Load(LoadSpec),
    /// Complex forces or pressures at points in space, mapped to a surface.
    Field {
        /// Surface group, or set of nodes that serves as one.
        on: String,
        /// The points, and the values there.
        field: FieldSource,
    },
    /// A motion of all supports and of rigid ground, which move as one. The response counts from them.
    Base {
        /// Unit length.
        direction: [f64; 3],
        /// What the amplitude is of.
        motion: BaseMotion,
    },
}

/// What is given of the motion of a base.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BaseMotion {
    /// The same at all frequencies.
    Acceleration,
    /// The same at all frequencies.
    Displacement,
}

/// The fields that files hold, by the path that [`FieldSource::File`] gives.
pub type SurfaceFields = BTreeMap<PathBuf, SurfaceField>;

/// Where a field on a surface comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldSource {
    /// A file, which is read for [`bind_with_fields`](super::bind_with_fields).
    File(PathBuf),
    /// The points themselves.
    Points(SurfaceField),
}

impl ExcitationKind {
    /// Of the amplitude; empty where it multiplies the values of a field.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Load(LoadSpec { load, .. }) => match load {
                LoadKind::Force { .. } => "N",
                LoadKind::Traction { .. } | LoadKind::Pressure { .. } => "Pa",
            },
            Self::Field { .. } => "",
            Self::Base { motion, .. } => match motion {
                BaseMotion::Acceleration => "m/s2",
                BaseMotion::Displacement => "m",
            },
        }
    }

    /// A whole force of 1 N.
    pub fn force(on: impl Into<String>, direction: [f64; 3]) -> Self {
        Self::Load(LoadSpec {
            on: on.into(),
            load: LoadKind::Force {
                vector_n: direction,
            },
        })
    }
}

/// A displacement that is watched.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationSpec {
    /// The name by which results call it.
    pub name: String,
    /// Point group; the displacement observed is the mean over its nodes.
    pub points: String,
    /// Unit length.
    pub direction: [f64; 3],
}
