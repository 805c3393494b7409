//! Bodies and loads as a user describes them: in SI units, with the names of mesh groups still
//! unresolved.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use strum::{Display, EnumString, VariantNames};

use super::{GivenMatrices, MeshSource};
use dovetail_dynamics::contact::PairLaw;
use dovetail_dynamics::reduced::{InfluenceCoefficient, ObservedQuantity};
use dovetail_mesh::parts::Placement;
use dovetail_mesh::surface_field::SurfaceField;
use dovetail_mesh::units::Units;
use dovetail_numerics::space::direction;
use dovetail_numerics::sparse::stored;

/// Bodies of a mesh, with their supports, loads and observations.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Assembly {
    /// Source of the mesh that bodies without one of their own share.
    pub mesh: Option<MeshSource>,
    /// Bodies, in any number.
    pub bodies: Vec<BodySpec>,
    /// Rotation; `None`: the scene does not rotate and no prestress is computed.
    pub rotation: Option<RotationSpec>,
    /// Cyclic symmetry, of which the bodies are one sector; `None`: the bodies are all there is.
    pub cyclic: Option<CyclicSpec>,
    /// Contacts between bodies, or with the ground.
    pub contacts: Vec<ContactSpec>,
    /// Linear springs to ground and between groups of nodes.
    pub springs: Vec<SpringSpec>,
    /// Dashpots to ground and between groups of nodes.
    pub dashpots: Vec<DashpotSpec>,
    /// Steady loads besides that of the rotation.
    pub loads: Vec<LoadSpec>,
    /// Harmonic excitations.
    pub excitations: Vec<ExcitationSpec>,
    /// Observed displacements.
    pub observations: Vec<ObservationSpec>,
}

impl Assembly {
    /// Files of the fields of its excitations and of the friction of its contacts.
    pub fn field_files(&self) -> impl Iterator<Item = &Path> {
        let excitations = self.excitations.iter();
        let excitations = excitations.filter_map(|excitation| match &excitation.kind {
            ExcitationKind::Field { field, .. } => field.file(),
            _ => None,
        });
        let contacts = self.contacts.iter();
        let friction = contacts.filter_map(|contact| contact.friction_at.as_ref()?.file());
        excitations.chain(friction)
    }

    /// File of the aerodynamic influence, if there is one.
    pub fn influence_file(&self) -> Option<&Path> {
        match &self.cyclic.as_ref()?.influence.as_ref()?.coefficients {
            InfluenceSource::File(path) => Some(path),
            InfluenceSource::Given(_) => None,
        }
    }
}

/// One body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodySpec {
    /// Name in messages and in other items.
    pub name: String,
    /// Source of its elements.
    pub mesh: BodyMesh,
    /// Name of the volume group.
    pub volume: String,
    /// Source of its stiffness and mass.
    pub matrices: MatrixSource,
    /// Groups (of any dimension) whose nodes do not move.
    pub fixed: Vec<String>,
    /// Groups whose nodes do not move along x, y, z (planes of symmetry, rollers).
    pub fixed_along: [Vec<String>; 3],
    /// Number of fixed-interface modes kept in the Craig-Bampton reduction.
    pub fixed_interface_modes: Option<usize>,
    /// Strength of its material; `None` where it is not known.
    pub strength: Option<Strength>,
}

impl BodySpec {
    /// Body of finite elements in the volume group of its name, which moves freely.
    ///
    /// ```
    /// use dovetail_structure::model::{BodySpec, Material};
    ///
    /// let jaw = BodySpec::new("jaw", Material::new(210e9, 0.3, 7850.0)).fixed(["jaw_base"]);
    /// assert_eq!((jaw.volume.as_str(), jaw.fixed.len()), ("jaw", 1));
    /// ```
    pub fn new(name: impl Into<String>, matrices: impl Into<MatrixSource>) -> Self {
        let name = name.into();
        Self {
            volume: name.clone(),
            name,
            mesh: BodyMesh::Shared,
            matrices: matrices.into(),
            fixed: Vec::new(),
            fixed_along: Default::default(),
            fixed_interface_modes: None,
            strength: None,
        }
    }

    /// The same body, of which the nodes of these groups do not move.
    #[must_use]
    pub fn fixed(mut self, groups: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.fixed = groups.into_iter().map(Into::into).collect();
        self
    }
}

/// Strength of a material under stress that oscillates about a mean.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Strength {
    /// Largest amplitude about no mean that the material endures, Pa.
    pub endurance_pa: f64,
    /// Stress at which it breaks without oscillation, Pa.
    pub ultimate_pa: f64,
}

/// Source of the elements of a body. A body with a mesh of its own refers to the groups of that
/// mesh by their names. For all others they are called `<body>.<group>`, or by their names alone
/// where no other body has such a group.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum BodyMesh {
    /// Mesh of the assembly.
    Shared,
    /// File of the body's own.
    File {
        /// Path of the file.
        path: PathBuf,
        /// Units of the file.
        units: Units,
        /// Placement of the body.
        placement: Placement,
    },
    /// Copy of another body, as it is in its own place.
    CopyOf {
        /// Name of the other body.
        body: String,
        /// Placement of the copy.
        placement: Placement,
    },
}

/// Source of the stiffness and mass of a body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum MatrixSource {
    /// Finite elements of its mesh, of this material.
    Elements(MaterialSpec),
    /// Files of another program, whose contents [`bind`](super::bind()) takes.
    Files(MatrixFiles),
    /// Matrices of another program.
    Given(#[serde(serialize_with = "stored::shared")] Arc<GivenMatrices>),
}

/// Files with the matrices of a body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MatrixFiles {
    /// File of the stiffness.
    pub stiffness: MatrixFile,
    /// File of the mass.
    pub mass: MatrixFile,
    /// Table of the rows; `None` where the file of the stiffness names them.
    pub rows: Option<PathBuf>,
    /// File of a steady load on the rows, a matrix of one column.
    pub load: Option<MatrixFile>,
    /// Units of the matrices, which give a unit of force.
    pub units: Units,
}

impl MatrixFiles {
    /// Paths of all files.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let both = [&self.stiffness, &self.mass].map(|file| file.path.as_path());
        let load = self.load.iter().map(|file| file.path.as_path());
        both.into_iter().chain(self.rows.as_deref()).chain(load)
    }
}

/// Matrix in a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MatrixFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Name of the matrix where the file has several; `None`: the only one, or the one of a
    /// customary name.
    pub name: Option<String>,
}

/// Contents of the files that an assembly names besides those of its meshes.
#[derive(Debug, Clone, Default)]
pub struct NamedFiles {
    /// Fields of excitations, and of the friction of contacts.
    pub fields: SurfaceFields,
    /// Matrices of bodies, by the names of the bodies.
    pub matrices: BTreeMap<String, Arc<GivenMatrices>>,
    /// Coefficients of the aerodynamic influence; `None` where no file has them.
    pub influence: Option<Vec<InfluenceCoefficient>>,
}

/// Material of a body, or where it comes from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum MaterialSpec {
    /// Material given by numbers.
    Given(Material),
    /// Material whose density is this mass over the volume of the body's elements.
    OfMass {
        /// Young's modulus, Pa.
        young_pa: f64,
        /// Poisson's ratio.
        poisson: f64,
        /// Mass of the body, kg.
        mass_kg: f64,
    },
    /// Material of the body's mesh with this name; `None`: the one that the mesh gives to all
    /// elements of the body.
    OfMesh(Option<String>),
}

impl From<Material> for MatrixSource {
    fn from(material: Material) -> Self {
        Self::Elements(MaterialSpec::Given(material))
    }
}

/// Isotropic linear elasticity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Material {
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m3.
    pub density_kg_m3: f64,
}

impl Material {
    /// Material with Young's modulus, Pa, Poisson's ratio, and density, kg/m3.
    pub const fn new(young_pa: f64, poisson: f64, density_kg_m3: f64) -> Self {
        Self {
            young_pa,
            poisson,
            density_kg_m3,
        }
    }
}

/// Disc of equal sectors, of which the bodies are one. Sectors are counted by the right hand about
/// the axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CyclicSpec {
    /// Number of sectors, 2 or more.
    pub sectors: usize,
    /// Names of the surface groups at which the sector before begins.
    pub low: Vec<String>,
    /// Names of the surface groups at which the next sector begins: where the low faces come to when
    /// they are turned by one pitch.
    pub high: Vec<String>,
    /// Point of the axis, m.
    pub point_m: [f64; 3],
    /// Direction of the axis, unit length.
    pub axis: [f64; 3],
    /// Engine order of the first harmonic of the excitation: harmonic k of the excitation of sector j,
    /// counted from 0, is that of the first sector times `exp(i k engine_order 2 pi j / sectors)`. At
    /// 0 all sectors are excited in phase.
    pub engine_order: usize,
    /// Forces that the air returns to the vibrating blades; `None` where it returns none.
    pub influence: Option<InfluenceSpec>,
}

/// Forces that the air returns to the vibrating blades of a disc
/// ([`influence`](dovetail_dynamics::reduced::influence)).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InfluenceSpec {
    /// Name of the body whose modes with its flanks held the coefficients refer to; `None`: the only
    /// body.
    pub body: Option<String>,
    /// Coefficients for each wave.
    pub coefficients: InfluenceSource,
}

/// Source of the coefficients of the aerodynamic influence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum InfluenceSource {
    /// File, whose contents [`bind`](super::bind()) takes.
    File(PathBuf),
    /// Coefficients themselves.
    Given(Vec<InfluenceCoefficient>),
}

/// Rotation at constant speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RotationSpec {
    /// Point of the axis, m.
    pub point_m: [f64; 3],
    /// Direction of the axis, unit length.
    pub axis: [f64; 3],
    /// Angular speed, 0 or more. At 0 the section is kept (`Some`): a rotating scene at rest,
    /// without load or prestress.
    pub speed_rad_s: f64,
    /// Names of the bodies that carry the centrifugal load.
    pub bodies: Vec<String>,
    /// Contribution of the rotation to the stiffness.
    pub prestress: Prestress,
}

impl RotationSpec {
    /// Rotation of these bodies about an axis through the origin, of any length but 0, at a speed in
    /// revolutions per minute.
    ///
    /// ```
    /// use dovetail_structure::model::{Prestress, RotationSpec};
    ///
    /// let rotation = RotationSpec::new([2.0, 0.0, 0.0], 5000.0, ["blade", "disc"]);
    /// assert_eq!(rotation.axis, [1.0, 0.0, 0.0]);
    /// assert_eq!(rotation.prestress, Prestress::Contact);
    /// ```
    pub fn new(
        axis: [f64; 3],
        speed_rpm: f64,
        bodies: impl IntoIterator<Item = impl Into<String>>,
    ) -> Self {
        Self {
            point_m: [0.0; 3],
            axis: unit(axis),
            speed_rad_s: speed_rpm * std::f64::consts::PI / 30.0,
            bodies: bodies.into_iter().map(Into::into).collect(),
            prestress: Prestress::default(),
        }
    }

    /// The same rotation with another contribution to the stiffness.
    #[must_use]
    pub fn prestress(self, prestress: Prestress) -> Self {
        Self { prestress, ..self }
    }

    /// Angular speed in revolutions per minute.
    pub fn speed_rpm(&self) -> f64 {
        self.speed_rad_s * 30.0 / std::f64::consts::PI
    }
}

/// Contribution of the rotation to the stiffness.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Display, EnumString, VariantNames,
)]
#[strum(serialize_all = "snake_case")]
pub enum Prestress {
    /// Geometric stiffness of the static state of all bodies with contact and friction, and spin
    /// softening. Stiffness and state are computed repeatedly until the normal forces no longer
    /// change.
    #[default]
    Contact,
    /// Geometric stiffness of each body's static state with its contact nodes held, and spin
    /// softening (the paper's choice). It leaves out the stress that a body transmits to another
    /// one by a contact.
    HeldFlanks,
    /// None: the rotation gives only the centrifugal load.
    None,
}

/// Two surfaces in contact.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactSpec {
    /// Name in messages and results.
    pub name: String,
    /// Surface group of a body.
    pub first: String,
    /// Surface group of another body, or another group of the same one; `None`: rigid ground.
    pub second: Option<String>,
    /// Sector of a disc that has the second surface. With the next one the slave is the first.
    pub second_sector: Sector,
    /// Flank at whose nodes the pairs are made; `None`: the one with the smaller facets, and the
    /// first where they are alike.
    pub slave: Option<Side>,
    /// Law that joins the two sides.
    pub law: ContactLaw,
    /// Law of a pair with a tributary area of 1 m2: the springs are those per area, N/m3.
    pub pair_law: PairLaw,
    /// Coefficients of friction at points in space, in place of that of `pair_law`; each pair has
    /// that of the point nearest to it.
    pub friction_at: Option<FieldSource>,
    /// Clearance that the mesh gives, in addition to that of `pair_law`.
    pub gap: Gap,
    /// Distance along the normal beyond which facets of both flanks are not opposite each other, m;
    /// `None`: half of the longest edge of both.
    pub search_distance_m: Option<f64>,
    /// Clearance that grows away from a point or line of the flank.
    pub crown: Option<CrownSpec>,
}

impl ContactSpec {
    /// Rigid contact of two flanks that touch.
    ///
    /// ```
    /// use dovetail_structure::model::{ContactLaw, ContactSpec};
    ///
    /// let left = ContactSpec::new("left", "blade_flank", "disc_flank", 0.3);
    /// assert_eq!(left.law, ContactLaw::UnilateralCoulomb);
    /// let bonded = ContactSpec { law: ContactLaw::Bonded, ..left };
    /// assert_eq!(bonded.second.as_deref(), Some("disc_flank"));
    /// ```
    pub fn new(
        name: impl Into<String>,
        first: impl Into<String>,
        second: impl Into<String>,
        friction: f64,
    ) -> Self {
        Self {
            name: name.into(),
            first: first.into(),
            second: Some(second.into()),
            second_sector: Sector::Same,
            slave: None,
            law: ContactLaw::default(),
            pair_law: PairLaw::rigid(friction, 0.0),
            friction_at: None,
            gap: Gap::Closed,
            search_distance_m: None,
            crown: None,
        }
    }
}

/// Sector of a disc, seen from the one that is meshed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, EnumString, VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum Sector {
    /// The meshed sector.
    #[default]
    Same,
    /// The next one about the axis, by the right hand.
    Next,
}

/// Clearance of two flanks by their distance in the mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, EnumString, VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum Gap {
    /// None: the flanks touch, whatever their distance in the mesh is.
    #[default]
    Closed,
    /// The distance in the mesh.
    Mesh,
}

/// One of the two flanks of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, EnumString, VariantNames)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "snake_case")]
pub enum Side {
    /// Flank named `first`.
    First,
    /// Flank named `second`.
    Second,
}

impl Side {
    /// Values of the first and of the second flank, from those of this flank and of the other one,
    /// or the other way round.
    pub(crate) fn ordered<T>(self, [own, other]: [T; 2]) -> [T; 2] {
        match self {
            Self::First => [own, other],
            Self::Second => [other, own],
        }
    }
}

/// Law that joins the two sides of a contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, EnumString, VariantNames, Serialize)]
#[strum(serialize_all = "snake_case")]
pub enum ContactLaw {
    /// Compression only, with dry friction.
    #[default]
    UnilateralCoulomb,
    /// Bonded: the sides move as one, and the law of a pair and the crown are not used.
    Bonded,
}

/// Crowned flank. d^2 / (2 radius_m) is added to the clearance, with d the distance in the flank's
/// tangent plane from the centre, or from the line through it along `axis`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CrownSpec {
    /// Radius of curvature, m; where both flanks are crowned, R1 R2 / (R1 + R2).
    pub radius_m: f64,
    /// Axis, of unit length; `None`: the same curvature in all directions.
    pub axis: Option<[f64; 3]>,
    /// Centre; `None`: the centroid of the flank's area.
    pub centre_m: Option<[f64; 3]>,
}

/// Linear spring between the mean displacements of two groups, or from one to ground.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpringSpec {
    /// Name in messages and results.
    pub name: String,
    /// Surface group, or group of nodes.
    pub first: String,
    /// Surface group, or group of nodes, of the same body or of another one. `None`: ground, and
    /// the stiffness is shared by the area of the surface, or equally by the nodes.
    pub second: Option<String>,
    /// Total stiffness, not per area or node.
    pub stiffness_n_m: f64,
    /// Direction, of unit length; `None`: the same stiffness along all three axes.
    pub direction: Option<[f64; 3]>,
}

/// Dashpot between the mean displacements of two groups, or from that of one to ground.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DashpotSpec {
    /// Name in messages and results.
    pub name: String,
    /// Surface group, or group of nodes.
    pub first: String,
    /// Surface group, or group of nodes, of the same body or of another one; `None`: ground.
    pub second: Option<String>,
    /// Force over the difference of the mean velocities, N s/m.
    pub damping_n_s_m: f64,
    /// Direction, of unit length; `None`: the same damping along all three axes.
    pub direction: Option<[f64; 3]>,
}

/// Steady load, applied with that of the rotation in the load steps of the static state.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoadSpec {
    /// Point or curve group (a force is shared equally by its nodes), or surface group, or set of
    /// nodes that serves as one.
    pub on: String,
    /// Kind and size of the load.
    pub load: LoadKind,
}

/// Force, traction or pressure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum LoadKind {
    /// Total force, N.
    Force {
        /// Components along x, y, z.
        vector_n: [f64; 3],
    },
    /// Uniform traction on a surface, Pa.
    Traction {
        /// Components along x, y, z.
        vector_pa: [f64; 3],
    },
    /// Pressure along the inward normal of a surface, Pa.
    Pressure {
        /// Pressure, positive where it presses.
        pressure_pa: f64,
    },
}

/// Harmonic excitation of an assembly: `amplitude cos(harmonic omega t - phase_rad)` times the unit
/// that `kind` defines.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExcitationSpec {
    /// Kind of excitation, and where it acts.
    pub kind: ExcitationKind,
    /// Amplitude in the unit of [`ExcitationKind::unit`].
    pub amplitude: f64,
    /// Multiple of the frequency of the response.
    pub harmonic: usize,
    /// Phase lag behind the cosine.
    pub phase_rad: f64,
}

impl ExcitationSpec {
    /// Excitation in phase with the cosine of harmonic 1, of an amplitude in the unit of its kind.
    pub const fn new(kind: ExcitationKind, amplitude: f64) -> Self {
        Self {
            kind,
            amplitude,
            harmonic: 1,
            phase_rad: 0.0,
        }
    }

    /// Total force on a group along a direction of any length but 0, with this amplitude, N.
    ///
    /// ```
    /// use dovetail_structure::model::ExcitationSpec;
    ///
    /// let force = ExcitationSpec::force("tip", [0.0, 1.0, 0.0], 2.0);
    /// assert_eq!((force.harmonic, force.kind.unit()), (1, "N"));
    /// ```
    pub fn force(on: impl Into<String>, direction: [f64; 3], amplitude_n: f64) -> Self {
        Self::new(ExcitationKind::force(on, unit(direction)), amplitude_n)
    }
}

/// Kind of a harmonic excitation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum ExcitationKind {
    /// Load of one unit: a force, traction or pressure of length 1.
    Load(LoadSpec),
    /// Complex forces or pressures at points in space, mapped to a surface.
    Field {
        /// Surface group, or set of nodes that serves as one.
        on: String,
        /// Points of the field, and its values there.
        field: FieldSource,
    },
    /// Motion of all supports and of rigid ground, which move as one. The response is relative to
    /// them.
    Base {
        /// Direction, of unit length.
        direction: [f64; 3],
        /// Quantity that the amplitude belongs to.
        motion: BaseMotion,
    },
}

/// Quantity that is prescribed for the motion of a base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum BaseMotion {
    /// Acceleration, the same at all frequencies.
    Acceleration,
    /// Displacement, the same at all frequencies.
    Displacement,
}

/// Fields read from files, by the path that [`FieldSource::File`] gives.
pub type SurfaceFields = BTreeMap<PathBuf, SurfaceField>;

/// Source of a field on a surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum FieldSource {
    /// File, whose contents [`bind`](super::bind()) takes.
    File(PathBuf),
    /// Points and values themselves.
    Points(SurfaceField),
}

impl FieldSource {
    /// File of the field, if it is one.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Points(_) => None,
        }
    }
}

impl ExcitationKind {
    /// Unit of the amplitude; empty where it multiplies the values of a field.
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

    /// Total force of 1 N along a direction of unit length.
    pub fn force(on: impl Into<String>, direction: [f64; 3]) -> Self {
        Self::Load(LoadSpec {
            on: on.into(),
            load: LoadKind::Force {
                vector_n: direction,
            },
        })
    }
}

/// Observed displacement or strain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObservationSpec {
    /// Name in the results.
    pub name: String,
    /// Group of nodes over which the displacement is averaged. For a strain, a surface, over whose
    /// area the strain is averaged, or nodes, of which all faces are taken that touch one of them.
    pub points: String,
    /// Direction, of unit length. That of a strain is projected on the surface.
    pub direction: [f64; 3],
    /// What is observed.
    pub quantity: ObservedQuantity,
}

impl ObservationSpec {
    /// Mean displacement of a group along a direction of any length but 0.
    ///
    /// ```
    /// use dovetail_structure::model::ObservationSpec;
    ///
    /// let tip = ObservationSpec::displacement("tip", "trailing_edge", [0.0, 3.0, 0.0]);
    /// assert_eq!(tip.direction, [0.0, 1.0, 0.0]);
    /// ```
    pub fn displacement(
        name: impl Into<String>,
        points: impl Into<String>,
        direction: [f64; 3],
    ) -> Self {
        Self {
            name: name.into(),
            points: points.into(),
            direction: unit(direction),
            quantity: ObservedQuantity::Displacement,
        }
    }

    /// Mean strain of a surface along a direction, as a strain gauge measures it.
    pub fn strain(name: impl Into<String>, points: impl Into<String>, direction: [f64; 3]) -> Self {
        let quantity = ObservedQuantity::Strain;
        Self {
            quantity,
            ..Self::displacement(name, points, direction)
        }
    }
}

/// Direction of unit length; a zero one stays.
fn unit(given: [f64; 3]) -> [f64; 3] {
    direction(given).unwrap_or(given)
}

#[cfg(test)]
mod tests {
    use super::RotationSpec;

    #[test]
    fn an_axis_of_any_size_becomes_a_direction() {
        for size in [1e-300, 1.0, 1e300] {
            let rotation = RotationSpec::new([0.0, size, 0.0], 1.0, ["blade"]);
            assert_eq!(rotation.axis, [0.0, 1.0, 0.0], "{size}");
        }
    }
}
