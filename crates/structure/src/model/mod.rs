//! Conversion of an [`Assembly`] and a [`Mesh`](dovetail_mesh::Mesh) to a [`Model`]: names become
//! indices here and only here.
//!
//! [`bind()`] does it: groups are looked up, each body gets a numbering of its own, the flanks are
//! paired and given their frames, and each node gets its possible motion. The opposite point of a
//! slave node is a weighted mean of nodes of the other flank, by dual mortar functions (sources in
//! `mortar.rs`).
//!
//! A user describes an [`Assembly`], with names; the finite elements read a [`Model`], with
//! numbers. A new kind of load or contact has a type in `description.rs` and one here. Two orders
//! are fixed, because results and files count on them: that of the pairs, contact by contact, and
//! that of the unknowns of a body, its interior before its contact nodes (`dofs.rs`).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::structure::OtherSector;
use dovetail_dynamics::contact::PairLaw;
use dovetail_dynamics::reduced::ObservedQuantity;
use dovetail_dynamics::reduced::{DiscExcitation, Influence, InfluenceCoefficient};
use dovetail_mesh::{Connectivity, ElementType};

mod bind;
mod builder;
mod contacts;
mod crown;
mod cyclic;
mod description;
mod dofs;
mod error;
mod excitations;
mod flank;
mod friction;
pub mod gather;
mod groups;
mod influence;
mod joints;
mod least_squares;
mod loads;
mod mapping;
mod material;
mod matrices;
mod mesh_source;
mod mortar;
mod neighbours;
mod observations;
mod opposite;
mod springs;
mod tie;
mod turn;

pub use bind::bind;
pub use description::{
    Assembly, BaseMotion, BodyMesh, BodySpec, ContactLaw, ContactSpec, CrownSpec, CyclicSpec,
    DashpotSpec, ExcitationKind, ExcitationSpec, FieldSource, Gap, InfluenceSource, InfluenceSpec,
    LoadKind, LoadSpec, Material, MaterialSpec, MatrixFile, MatrixFiles, MatrixSource, NamedFiles,
    ObservationSpec, Prestress, RotationSpec, Sector, Side, SpringSpec, Strength, SurfaceFields,
};
pub use dovetail_mesh::Row;
pub use error::{ErrorSubject, ModelError};
pub use friction::FrictionMap;
pub use mapping::FieldMap;
pub use matrices::{
    Asymmetry, GivenMatrices, MatricesError, PlacedMatrices, RowUnknown, TooFarOff, asymmetry,
    empty_rows, find_indefinite_entry, negative_eigenvalues,
};
pub use mesh_source::{MeshKind, MeshSource};

/// Input of the finite elements and of the contact, with every name resolved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Model {
    /// Bodies in the order of the scene.
    pub bodies: Vec<Body>,
    /// Rotation, also at a speed of 0; `None` where there is no axis.
    pub rotation: Option<Rotation>,
    /// Cyclic symmetry; `None` where the bodies are all there is.
    pub cyclic: Option<Cyclic>,
    /// Pairs of nodes that may slide and open.
    pub pairs: Vec<ContactPair>,
    /// Nodes that move with others: those of bonded contacts, and the end of a spring with that of
    /// another body.
    pub bonded: Vec<Slave>,
    /// Facets of the slave flanks, each as the numbers of the pairs at its three or four corners,
    /// for fields on the flanks.
    pub flank_facets: Vec<Vec<u32>>,
    /// Names of the contacts that have pairs, in the order of the scene.
    pub contact_names: Vec<String>,
    /// Harmonic loads. A complex field on a surface is two of them, a quarter of a period apart.
    pub excitations: Vec<ModelExcitation>,
    /// Reports of how fields at points in space were mapped to surfaces.
    pub maps: Vec<FieldMap>,
    /// Reports of the coefficients of friction that contacts have from fields.
    pub friction_maps: Vec<FrictionMap>,
    /// Observed displacements.
    pub observations: Vec<Observation>,
    /// Dashpots between the bodies, or from them to ground.
    pub dashpots: Vec<Dashpot>,
    /// Reports of how the flanks of each contact between two bodies lie on each other, bonded ones
    /// last.
    pub matches: Vec<FlankMatch>,
    /// Bodies with flanks whose edges are not straight in the mesh.
    pub straightened: Vec<StraightenedEdges>,
}

impl Model {
    /// Number of nodes of the mesh that follow others in bonded contacts, mid-edge nodes included.
    pub fn bonded_pairs(&self) -> usize {
        let is_of_mesh = |at: &BodyNode| (at.node as usize) < self.bodies[at.body].nodes_m.len();
        let slaves = self.bonded.iter();
        slaves.filter(|slave| is_of_mesh(&slave.node)).count()
    }

    /// Largest distance between the node of a pair and its counterpart on the other flank, m.
    pub fn largest_mismatch_m(&self) -> f64 {
        let mismatches = self.matches.iter().map(|m| m.largest_mismatch_m);
        mismatches.fold(0.0, f64::max)
    }

    /// Number of elements of each type in all bodies.
    pub fn element_types(&self) -> BTreeMap<ElementType, usize> {
        let mut counts = BTreeMap::new();
        for (element, count) in self.bodies.iter().flat_map(|body| body.elements.types()) {
            *counts.entry(element).or_default() += count;
        }
        counts
    }
}

/// One body: its own node numbering, elements, and degrees of freedom.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Body {
    /// Name in the description.
    pub name: String,
    /// Source of its stiffness and mass.
    pub matrices: MatrixOrigin,
    /// True if the body carries the load and prestress of the rotation, whatever its speed.
    pub rotates: bool,
    /// Number of modes that a Craig-Bampton reduction of this body keeps; `None` where it is not
    /// reduced by itself.
    pub fixed_interface_modes: Option<usize>,
    /// Node positions, m, in the body's own numbering. Nodes in the middles of flank edges are half
    /// way between the corners.
    pub nodes_m: Vec<[f64; 3]>,
    /// Index of each node in the mesh.
    pub mesh_nodes: Vec<u32>,
    /// Gmsh tag of each node.
    pub node_tags: Vec<u64>,
    /// Elements, with local node indices.
    pub elements: Connectivity,
    /// Surface of a body without elements, whose stiffness and mass are given, with local node
    /// indices; else empty.
    pub facets: Connectivity,
    /// Possible motions of the nodes.
    pub dofs: DofMap,
    /// Free degrees of freedom that do not move, ascending, as on planes of symmetry. They keep
    /// their numbers and are uncoupled in the matrices.
    pub held_dofs: Vec<u32>,
    /// Supports with the nodes that they hold. A node is held along an axis by one of them.
    pub supports: Vec<Support>,
    /// Steady loads besides that of the rotation, each with the number of its load in the
    /// description.
    pub loads: Vec<(usize, AppliedLoad)>,
    /// Springs to ground, and the ends of springs to other groups of nodes.
    pub springs: Vec<Spring>,
}

/// Source of the stiffness and mass of a body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum MatrixOrigin {
    /// Finite elements of this material.
    Elements(Material),
    /// Matrices of another program.
    Given(PlacedMatrices),
}

impl Body {
    /// Material of the elements; `None` where the matrices come from another program.
    pub fn material(&self) -> Option<Material> {
        match &self.matrices {
            MatrixOrigin::Elements(material) => Some(*material),
            MatrixOrigin::Given(_) => None,
        }
    }

    /// Mesh tag of each free node; for an auxiliary one, the tag of a node that its spring acts on.
    pub fn free_node_tags(&self) -> Vec<u64> {
        let nodes = self.mesh_nodes_of_free_nodes().into_iter();
        nodes.map(|node| self.node_tags[node]).collect()
    }

    /// Node of the mesh (in the body's own numbering) that a free node is; for an auxiliary one, a
    /// node that its spring acts on.
    pub fn mesh_node_of(&self, free: usize) -> usize {
        let nodes = self.mesh_nodes_of_free_nodes();
        nodes.get(free).copied().unwrap_or(0)
    }

    /// [`Body::mesh_node_of`] of each free node.
    fn mesh_nodes_of_free_nodes(&self) -> Vec<usize> {
        let mut nodes = vec![None; self.dofs.free_nodes()];
        for (node, motion) in self.dofs.nodes.iter().enumerate() {
            if let NodeMotion::Free(free) = motion {
                nodes[*free as usize] = Some(node);
            }
        }
        let first = self.dofs.nodes.len();
        for chain in self.springs.iter().filter_map(|spring| spring.on.chain()) {
            let near = chain.links.first().map(|(node, _)| *node as usize);
            for &node in &chain.nodes {
                let free = self.dofs.auxiliary[node as usize - first] as usize;
                nodes[free] = nodes[free].or(near);
            }
        }
        nodes.into_iter().map(|node| node.unwrap_or(0)).collect()
    }
}

/// Group of nodes of a body that does not move, or not along some axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Support {
    /// Name of the group in the mesh, or of the contact where rigid ground holds a bonded flank.
    pub name: String,
    /// Nodes in the body's own numbering, ascending, and the axes along which this support holds
    /// them. Tied nodes, which follow their corners, are left out, as are axes without a row in the
    /// matrices of another program.
    pub nodes: Vec<(u32, [bool; 3])>,
}

/// Spring, or the end of one, on the nodes of one body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spring {
    /// Name in the description.
    pub name: String,
    /// Total stiffness, N/m.
    pub stiffness_n_m: f64,
    /// Direction, of unit length; `None`: the same stiffness along all three axes.
    pub direction: Option<[f64; 3]>,
    /// Nodes or facets that the spring acts on.
    pub on: SpringSupport,
}

/// Support of a spring of a body; nodes are local.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum SpringSupport {
    /// Nodes that are each joined to ground by an equal share of the stiffness.
    Nodes(Vec<u32>),
    /// Facets that are joined to ground in proportion to their area.
    Surface(Vec<Vec<u32>>),
    /// Weighted sum of displacements.
    Chain(SpringChain),
}

impl SpringSupport {
    fn chain(&self) -> Option<&SpringChain> {
        match self {
            Self::Chain(chain) => Some(chain),
            Self::Nodes(_) | Self::Surface(_) => None,
        }
    }
}

/// Spring on the sum of the displacements of the links, each times its weight, made of one spring
/// per link in series ([`crate::fem::springs`]).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpringChain {
    /// Nodes and weights.
    pub links: Vec<(u32, f64)>,
    /// Auxiliary nodes behind the links. The last link has none where the chain ends at ground.
    pub nodes: Vec<u32>,
}

/// Load on one body, steady or one unit of a harmonic one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum AppliedLoad {
    /// Force on one node.
    Point {
        /// Node in the body's own numbering.
        node: u32,
        /// Components along x, y, z.
        vector_n: [f64; 3],
    },
    /// Load spread uniformly over part of the surface.
    Surface {
        /// Local nodes of each facet, counter-clockwise seen from outside.
        facets: Vec<Vec<u32>>,
        /// Traction on the facets.
        traction: Traction,
    },
    /// Force of the body's own mass in a uniform field of acceleration.
    Acceleration {
        /// Components along x, y, z.
        vector_m_s2: [f64; 3],
    },
}

/// Load on part of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Traction {
    /// Integral of a uniform traction, N.
    Total([f64; 3]),
    /// Uniform traction, Pa.
    Uniform([f64; 3]),
    /// Pressure along the inward normal, Pa.
    Pressure(f64),
}

/// Possible motions of the nodes of a body. *Free nodes* are numbered interior first, then those of
/// contacts, in the order of the contacts and their pairs. Free node `i` has the degrees of freedom
/// `3 i, 3 i + 1, 3 i + 2` (x, y, z).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DofMap {
    /// Motion of each node of the body.
    pub nodes: Vec<NodeMotion>,
    /// Numbers of the auxiliary nodes: free nodes without position, elements and mass, which
    /// springs between groups of nodes add. The first of them has the local number after the nodes
    /// of the body.
    pub auxiliary: Vec<u32>,
    /// Number of free nodes that belong to no contact.
    pub interior_nodes: usize,
    /// Number of free nodes of contacts, including bonded ones and the ends of springs to other
    /// bodies: the interface of the body.
    pub contact_nodes: usize,
}

/// Possible motion of one node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum NodeMotion {
    /// The node does not move.
    Fixed,
    /// The node is free, with this number.
    Free(u32),
    /// The node moves with the mean of two nodes of the body (local node numbers), each `Fixed` or
    /// `Free`. It is a mid-edge node of a flank, so that contact stays linear on the flank.
    Tied([u32; 2]),
}

impl DofMap {
    /// Number of free nodes.
    pub fn free_nodes(&self) -> usize {
        self.interior_nodes + self.contact_nodes
    }
    /// Free nodes that move node `local`, with their weights (empty where it is fixed).
    pub fn weights(&self, local: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let (a, b, w) = match self.motion(local) {
            NodeMotion::Fixed => (None, None, 0.0),
            NodeMotion::Free(n) => (Some(n as usize), None, 1.0),
            NodeMotion::Tied([a, b]) => (self.free(a), self.free(b), 0.5),
        };
        a.into_iter().chain(b).map(move |n| (n, w))
    }
    /// Number of a node among the free ones; `None` where it is fixed or tied.
    pub fn free(&self, local: u32) -> Option<usize> {
        match self.motion(local as usize) {
            NodeMotion::Free(n) => Some(n as usize),
            _ => None,
        }
    }
    fn motion(&self, local: usize) -> NodeMotion {
        let auxiliary = |at: usize| NodeMotion::Free(self.auxiliary[at]);
        let behind = local.checked_sub(self.nodes.len());
        behind.map_or_else(|| self.nodes[local], auxiliary)
    }
}

/// Disc of equal sectors, of which the bodies are one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cyclic {
    /// Number of sectors.
    pub sectors: usize,
    /// Nodes of the faces, each with the nodes of the next sector, or of the one before, that it moves
    /// with.
    pub ties: Vec<Slave>,
    /// Reports of how the faces lie on each other, each named by the high one; empty if each node
    /// meets one node.
    pub matches: Vec<FlankMatch>,
    /// Largest distance of two nodes that meet when one face is turned by a pitch, m; 0 if none do.
    pub largest_mismatch_m: f64,
    /// Smallest distance of two nodes of the low face, m; infinite if none meet. It follows from the
    /// nodes.
    #[serde(skip)]
    pub spacing_m: f64,
    /// Point of the axis, m.
    pub point_m: [f64; 3],
    /// Matrix that turns by one pitch.
    pub turn: [[f64; 3]; 3],
    /// Engine order of the first harmonic of the excitation; 0 where all sectors are excited in
    /// phase.
    pub engine_order: usize,
    /// Forces that the air returns to the vibrating blades; `None` where it returns none.
    pub influence: Option<BladeInfluence>,
}

/// Forces that the air returns to a body of the sector.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BladeInfluence {
    /// Index of the body.
    pub body: usize,
    /// Numbers of its modes with its flanks held on which the air acts, counted from 1, ascending.
    pub modes: Vec<usize>,
    /// Nodal diameters of the waves that have coefficients, ascending, as
    /// [`signed_nodal_diameter`](DiscExcitation::signed_nodal_diameter) gives them.
    pub waves: Vec<i64>,
    /// Coefficients for each wave.
    pub coefficients: Vec<InfluenceCoefficient>,
}

impl Cyclic {
    /// Excitation round the disc, which says what wave each harmonic is.
    pub fn excitation(&self) -> DiscExcitation {
        DiscExcitation {
            sectors: self.sectors,
            engine_order: self.engine_order,
        }
    }

    /// Aerodynamic influence in the waves of the harmonics.
    pub fn influence(&self) -> Influence {
        let own = self.influence.as_ref();
        own.map_or_else(Influence::default, |influence| {
            Influence::new(self.sectors, &influence.modes, &influence.coefficients)
        })
    }

    /// Phase of harmonic `k` of sector j, counted from 0, ahead of that of the first sector, radians.
    pub fn phase_rad(&self, k: usize, sector: usize) -> f64 {
        let waves = (k * self.engine_order * sector) % self.sectors;
        std::f64::consts::TAU * waves as f64 / self.sectors as f64
    }

    /// Matrix that turns directions from the first sector to sector j, counted from 0.
    pub fn turned_to(&self, sector: usize) -> [[f64; 3]; 3] {
        let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for _ in 0..sector {
            axes = [0, 1, 2]
                .map(|i| [0, 1, 2].map(|j| (0..3).map(|k| self.turn[i][k] * axes[k][j]).sum()));
        }
        axes
    }

    /// Sector that lies so many sectors ahead: the next one, 1, or the one before, -1; `None` for any
    /// other number.
    pub fn sector(&self, ahead: i32) -> Option<OtherSector> {
        let turn = match ahead {
            1 => self.turn,
            -1 => [0, 1, 2].map(|i| [0, 1, 2].map(|j| self.turn[j][i])),
            _ => return None,
        };
        Some(OtherSector { ahead, turn })
    }
}

/// Rotation at constant speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rotation {
    /// Point of the axis.
    pub point_m: [f64; 3],
    /// Direction of the axis, unit length.
    pub axis: [f64; 3],
    /// Angular speed, 0 or more. At rest the rotation has no load and no prestress.
    pub speed_rad_s: f64,
    /// Contribution to the stiffness of each body by itself.
    pub prestress: BodyPrestress,
    /// True if the prestress is that of the static state of all bodies with contact
    /// ([`Prestress::Contact`]), which the bodies by themselves do not determine.
    pub prestress_of_contact: bool,
}

/// Contribution of the rotation to the stiffness of a body by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum BodyPrestress {
    /// None: the rotation gives only the centrifugal load.
    None,
    /// Geometric stiffness of the static state of the body with its contact nodes held, and spin
    /// softening.
    HeldFlanks,
}

/// Node of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct BodyNode {
    /// Index in [`Model::bodies`].
    pub body: usize,
    /// Node in the body's own numbering.
    pub node: u32,
}

/// Node that moves with others, or relative to them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Slave {
    /// Slave node.
    pub node: BodyNode,
    /// Nodes whose weighted mean it follows, and their weights, which sum to 1; none on rigid
    /// ground.
    pub masters: Vec<(BodyNode, f64)>,
    /// Number of sectors of a disc by which that of these nodes lies ahead of that of the slave: 1 for
    /// the next one, 0 where they are of the same one.
    pub ahead: i32,
}

impl Slave {
    /// Single node that it is paired with, where the nodes of both flanks coincide.
    pub fn partner(&self) -> Option<BodyNode> {
        match self.masters.as_slice() {
            [(partner, _)] => Some(*partner),
            _ => None,
        }
    }
}

/// Node of one flank and its counterpart on another (sign conventions: [`dovetail_dynamics::contact`]).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactPair {
    /// Number of its contact in [`Model::contact_names`].
    pub contact: usize,
    /// Slave node, and the nodes of the other flank that it is paired with.
    pub slave: Slave,
    /// Flank that has the slave node.
    pub side: Side,
    /// Position half way between the node and its counterpart, m.
    pub position_m: [f64; 3],
    /// Rows n, t1, t2: unit normal from the second flank into the first, and two tangents, t1 in
    /// the direction in which most of the length of the first flank's edge runs (along the slot).
    /// The relative displacement of the pair is this times (u of the first flank - u of the
    /// second).
    pub frame: [[f64; 3]; 3],
    /// Tributary area, m2.
    pub area_m2: f64,
    /// Contact law, with the clearance that a crown and the distance in the mesh add.
    pub law: PairLaw,
}

impl ContactPair {
    /// Numbers of the bodies of the first and of the second flank; `None` for rigid ground.
    pub fn bodies(&self) -> [Option<usize>; 2] {
        let slave = Some(self.slave.node.body);
        let master = self.slave.masters.first().map(|(node, _)| node.body);
        self.side.ordered([slave, master])
    }
}

/// Report of how the two flanks of a contact lie on each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FlankMatch {
    /// Name of the contact.
    pub name: String,
    /// Flank at whose nodes the pairs are made.
    pub slave: Side,
    /// Fractions of the areas of the first and of the second flank that lie opposite the other one.
    pub covered: [f64; 2],
    /// Largest distance between a node and its counterpart, m. It is the lever arm between the two
    /// contact forces of a pair.
    pub largest_mismatch_m: f64,
    /// Fractions of the lengths of both flanks along the slot over which the other one extends, too.
    pub covered_along: [f64; 2],
    /// Largest distance between them along the normal, m.
    pub largest_separation_m: f64,
    /// Largest depth by which the bodies overlap at a node, m; 0 if they do not.
    pub largest_overlap_m: f64,
    /// Mean side length of the slave's facets, m. It follows from the nodes.
    #[serde(skip)]
    pub facet_m: f64,
    /// Largest absolute weight of a master node.
    pub largest_weight: f64,
    /// True if each node is paired with exactly one node.
    pub nodes_match: bool,
}

/// Edges of the flanks of a body whose middle nodes were put half way between the corners. These
/// nodes move with the mean of their corners. In a rotation of the body this motion is free of
/// strain only on straight edges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct StraightenedEdges {
    /// Name of the body.
    pub body: String,
    /// Number of edges.
    pub edges: usize,
    /// Largest distance by which a middle node was moved, m.
    pub largest_m: f64,
    /// Largest ratio of that distance to the length of the edge.
    pub largest_share: f64,
}

/// Harmonic load: `amplitude cos(harmonic omega t - phase_rad)` times one unit of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelExcitation {
    /// One unit of the load: bodies (indices in [`Model::bodies`]) and the loads on them.
    pub loads: Vec<(usize, AppliedLoad)>,
    /// Amplitude, in the unit of [`ExcitationKind::unit`], harmonic and phase.
    pub in_time: dovetail_dynamics::excitation::Excitation,
}

/// Dashpot on the sum over `terms` of `direction . u(node)`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dashpot {
    /// Coefficient, N s/m.
    pub damping_n_s_m: f64,
    /// Nodes, each with the direction times the node's weight.
    pub terms: Vec<(BodyNode, [f64; 3])>,
}

/// Observed displacement or strain: sum over `terms` of `vector . u(node)`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observation {
    /// Name in the results.
    pub name: String,
    /// What is observed.
    pub quantity: ObservedQuantity,
    /// Nodes, each with a vector: for a displacement the direction times the node's weight, for a
    /// strain over m.
    pub terms: Vec<(BodyNode, [f64; 3])>,
}
