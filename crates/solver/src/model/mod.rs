//! [`Assembly`] + [`Mesh`](dovetail_mesh::Mesh) -> [`Model`]: names become indices here and only here.
//!
//! [`bind_with_fields`] does it: groups are looked up, each body gets a numbering of its own, the flanks are
//! paired node by node and given their frames, and every node learns how it may move.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::contact::penalty::PairStiffness;
use dovetail_mesh::{Connectivity, ElementType};

mod bind;
mod builder;
mod contacts;
mod crown;
mod description;
mod dofs;
mod error;
mod excitations;
mod flank;
pub mod gather;
mod groups;
mod joints;
mod least_squares;
mod loads;
mod mapping;
mod material;
mod mesh_source;
mod mortar;
mod neighbours;
mod springs;

pub use bind::{bind, bind_with_fields};
pub use description::{
    Assembly, BaseMotion, BodyMesh, BodySpec, ContactLaw, ContactSpec, CrownSpec, ExcitationKind,
    ExcitationSpec, FieldSource, FlankStiffness, LoadKind, LoadSpec, Material, MaterialSpec,
    ObservationSpec, Prestress, RotationSpec, Side, SpringSpec, SurfaceFields,
};
pub use error::ModelError;
pub use mapping::FieldMap;
pub use mesh_source::{MeshKind, MeshSource};

/// What the finite elements and the contact need, with every name resolved.
#[derive(Debug, Clone, Serialize)]
pub struct Model {
    /// In the order of the scene.
    pub bodies: Vec<Body>,
    /// `None` where nothing rotates.
    pub rotation: Option<Rotation>,
    /// Pairs of nodes that may slide and open.
    pub pairs: Vec<ContactPair>,
    /// Nodes that move with others (bonded contacts, the end of a spring with that of another body).
    pub bonded: Vec<Slave>,
    /// Facets of the slave flanks, each as the pairs at its three or four corners, for fields on the
    /// flanks.
    pub flank_facets: Vec<Vec<u32>>,
    /// Names of the contacts that have pairs, in the order of the scene.
    pub contact_names: Vec<String>,
    /// What shakes it. A complex field on a surface is two of them, a quarter of a period apart.
    pub excitations: Vec<Excitation>,
    /// How fields at points in space were mapped to surfaces.
    pub maps: Vec<FieldMap>,
    /// Displacements that are watched.
    pub observations: Vec<Observation>,
    /// How the flanks of each contact between two bodies lie on each other, bonded ones last.
    pub matches: Vec<FlankMatch>,
    /// Bodies with flanks whose edges are not straight in the mesh.
    pub straightened: Vec<StraightenedEdges>,
}

impl Model {
    /// How many nodes of the mesh bonded contacts tie.
    pub fn bonded_pairs(&self) -> usize {
        let is_of_mesh = |at: &BodyNode| (at.node as usize) < self.bodies[at.body].nodes_m.len();
        let slaves = self.bonded.iter();
        slaves.filter(|slave| is_of_mesh(&slave.node)).count()
    }

    /// Largest distance between a node of a pair and what it meets on the other flank, m.
    pub fn largest_mismatch_m(&self) -> f64 {
        let all = self.matches.iter().map(|m| m.largest_mismatch_m);
        all.fold(0.0, f64::max)
    }

    /// How many elements of each type all bodies have.
    pub fn element_types(&self) -> BTreeMap<ElementType, usize> {
        let mut counts = BTreeMap::new();
        for (element, count) in self.bodies.iter().flat_map(|body| body.elements.types()) {
            *counts.entry(element).or_default() += count;
        }
        counts
    }
}

/// One body: its own node numbering, elements, and degrees of freedom.
#[derive(Debug, Clone, Serialize)]
pub struct Body {
    /// Of the description.
    pub name: String,
    /// What it is made of.
    pub material: Material,
    /// Whether it carries the rotation's load and prestress.
    pub rotates: bool,
    /// Modes that a Craig-Bampton reduction of this body keeps; none where it is not reduced by itself.
    pub fixed_interface_modes: Option<usize>,
    /// Node positions, m, in the body's own numbering; those in the middles of flank edges half way
    /// between the corners.
    pub nodes_m: Vec<[f64; 3]>,
    /// The mesh's index and Gmsh tag of each node.
    pub mesh_nodes: Vec<u32>,
    /// Gmsh tag of each node.
    pub node_tags: Vec<u64>,
    /// Its elements, with local node indices.
    pub elements: Connectivity,
    /// How its nodes move.
    pub dofs: DofMap,
    /// Free degrees of freedom that do not move, ascending: nodes on planes of symmetry. They keep their
    /// numbers and are uncoupled in the matrices.
    pub held_dofs: Vec<u32>,
    /// Steady loads besides the rotation's.
    pub loads: Vec<AppliedLoad>,
    /// Springs to ground, and the ends of those to other groups of nodes.
    pub springs: Vec<Spring>,
}

impl Body {
    /// The mesh's tag of each free node; of an auxiliary one that of a node that its spring acts on.
    pub fn free_node_tags(&self) -> Vec<u64> {
        let mut tags = vec![None; self.dofs.free_nodes()];
        for (motion, tag) in self.dofs.nodes.iter().zip(&self.node_tags) {
            if let NodeMotion::Free(free) = motion {
                tags[*free as usize] = Some(*tag);
            }
        }
        let of = |(free, tag): (usize, Option<u64>)| {
            tag.unwrap_or_else(|| self.node_tags[self.mesh_node_of(free)])
        };
        tags.into_iter().enumerate().map(of).collect()
    }

    /// The node of the mesh (in the body's own numbering) that a free node is; of an auxiliary one a node that its
    /// spring acts on.
    pub fn mesh_node_of(&self, free: usize) -> usize {
        let is_it = |motion: &NodeMotion| *motion == NodeMotion::Free(free as u32);
        let own = self.dofs.nodes.iter().position(is_it);
        let first = self.dofs.nodes.len();
        let has_it = |chain: &&SpringChain| {
            let numbers = chain.nodes.iter().map(|&node| node as usize - first);
            numbers
                .map(|at| self.dofs.auxiliary[at] as usize)
                .any(|n| n == free)
        };
        let chains = || self.springs.iter().filter_map(|spring| spring.on.chain());
        let near = || {
            chains()
                .find(has_it)?
                .links
                .first()
                .map(|(node, _)| *node as usize)
        };
        own.or_else(near).unwrap_or(0)
    }
}

/// A spring, or the end of one, on the nodes of one body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spring {
    /// In all.
    pub stiffness_n_m: f64,
    /// Unit length; `None`: the same stiffness along all three axes.
    pub direction: Option<[f64; 3]>,
    /// What it acts on.
    pub on: SpringSupport,
}

/// What a spring of a body acts on; nodes are local.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum SpringSupport {
    /// These nodes, each joined to ground by an equal share.
    Nodes(Vec<u32>),
    /// These facets, joined to ground by their area.
    Surface(Vec<Vec<u32>>),
    /// A weighted sum of displacements.
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

/// A spring on the sum of the displacements of the links, each times its weight, made of one spring a link in series
/// ([`crate::fem::springs`]).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpringChain {
    /// Nodes and weights.
    pub links: Vec<(u32, f64)>,
    /// The auxiliary nodes behind the links. The last link has none where the chain ends at ground.
    pub nodes: Vec<u32>,
}

/// A load on one body, steady or one unit of a harmonic one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum AppliedLoad {
    /// On one (local) node.
    Point {
        /// In the body's own numbering.
        node: u32,
        /// Along x, y, z.
        vector_n: [f64; 3],
    },
    /// Spread uniformly over part of the surface.
    Surface {
        /// Local nodes of each facet, counter-clockwise seen from outside.
        facets: Vec<Vec<u32>>,
        /// What acts on them.
        traction: Traction,
    },
    /// The force of its own mass in a uniform field of acceleration.
    Acceleration {
        /// Along x, y, z.
        vector_m_s2: [f64; 3],
    },
}

/// A load on part of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Traction {
    /// The same vector everywhere; its integral, N.
    Total([f64; 3]),
    /// The same vector everywhere, Pa.
    Uniform([f64; 3]),
    /// Along the inward normal, Pa.
    Pressure(f64),
}

/// How a body's nodes move. *Free nodes* are numbered interior first, then those of contacts, in the
/// order of the contacts and their pairs. Free node `i` owns the degrees of freedom `3 i, 3 i + 1,
/// 3 i + 2` (x, y, z).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DofMap {
    /// Of each node of the body.
    pub nodes: Vec<NodeMotion>,
    /// Free nodes without place, elements and mass, which springs between groups of nodes bring. The first of them
    /// has the local number behind the nodes of the body.
    pub auxiliary: Vec<u32>,
    /// Free nodes that no contact has.
    pub interior_nodes: usize,
    /// Free nodes of contacts, bonded ones and the ends of springs to other bodies too: the interface of the body.
    pub contact_nodes: usize,
}

/// How one node moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum NodeMotion {
    /// Not at all.
    Fixed,
    /// Free node number.
    Free(u32),
    /// Mean of two nodes of the body (local node numbers), each `Fixed` or `Free`: a mid-edge node
    /// of a flank, so that contact stays linear on the flank.
    Tied([u32; 2]),
}

impl DofMap {
    /// Number of free nodes.
    pub fn free_nodes(&self) -> usize {
        self.interior_nodes + self.contact_nodes
    }
    /// The free nodes that move node `local`, with their weights (empty when it is fixed).
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

/// Rotation at constant speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rotation {
    /// A point of the axis.
    pub point_m: [f64; 3],
    /// Direction of the axis, unit length.
    pub axis: [f64; 3],
    /// Angular speed.
    pub speed_rad_s: f64,
    /// What it adds to the stiffness of each body by itself.
    pub prestress: BodyPrestress,
    /// The prestress is that of the static state of all bodies with contact
    /// ([`Prestress::Contact`]), which the bodies by themselves do not tell.
    pub prestress_of_contact: bool,
}

/// What the rotation adds to the stiffness of a body by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum BodyPrestress {
    /// The centrifugal load only.
    None,
    /// Geometric stiffness of the static state of the body with its contact nodes held, and spin softening.
    HeldFlanks,
}

/// A node of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct BodyNode {
    /// Index in [`Model::bodies`].
    pub body: usize,
    /// In the body's own numbering.
    pub node: u32,
}

/// A node that moves with others, or relative to them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Slave {
    /// The node.
    pub node: BodyNode,
    /// The nodes whose weighted mean it follows, and their weights, which sum to 1; none on rigid ground.
    pub masters: Vec<(BodyNode, f64)>,
}

impl Slave {
    /// The one node that it meets, where the nodes of both flanks coincide.
    pub fn partner(&self) -> Option<BodyNode> {
        match self.masters.as_slice() {
            [(partner, _)] => Some(*partner),
            _ => None,
        }
    }
}

/// A node of one flank against what it meets on another (sign conventions: [`crate::contact`]).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactPair {
    /// Which of [`Model::contact_names`] it belongs to.
    pub contact: usize,
    /// The node, and those of the other flank that it meets.
    pub slave: Slave,
    /// The flank that has the slave node.
    pub side: Side,
    /// Half way between the node and what it meets.
    pub position_m: [f64; 3],
    /// Rows n, t1, t2: unit normal from the second flank into the first, and two tangents, t1 in the
    /// direction in which most of the length of the first flank's edge runs (along the slot). The relative
    /// displacement of the pair is this times (u of the first flank - u of the second).
    pub frame: [[f64; 3]; 3],
    /// Tributary area, m2.
    pub area_m2: f64,
    /// Initial clearance, m, that of a crowned flank included; negative where the flanks interfere.
    pub gap_m: f64,
    /// Coulomb coefficient.
    pub friction: f64,
    /// Its springs; `None`: rigid contact.
    pub stiffness: Option<PairStiffness>,
}

impl ContactPair {
    /// Numbers of the bodies of the first and of the second flank; `None` for rigid ground.
    pub fn bodies(&self) -> [Option<usize>; 2] {
        let slave = Some(self.slave.node.body);
        let master = self.slave.masters.first().map(|(node, _)| node.body);
        match self.side {
            Side::First => [slave, master],
            Side::Second => [master, slave],
        }
    }
}

/// How the two flanks of a contact lie on each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlankMatch {
    /// Of the contact.
    pub name: String,
    /// The flank whose nodes the pairs are made at.
    pub slave: Side,
    /// Shares of the areas of the first and of the second flank that lie opposite the other one.
    pub covered: [f64; 2],
    /// Largest distance between a node and what it meets, m: the arm by which the two contact forces of
    /// a pair stand apart.
    pub largest_mismatch_m: f64,
    /// The same along the normal, m.
    pub largest_separation_m: f64,
    /// Mean length of a side of the slave's facets, m.
    #[serde(skip)]
    pub facet_m: f64,
    /// Largest weight of a master node, without its sign.
    pub largest_weight: f64,
    /// Whether each node meets one node.
    pub nodes_match: bool,
}

/// Edges of the flanks of a body whose middle nodes were put half way between the corners. These nodes move with the
/// mean of their corners, which is a motion without strain in a turn of the body on straight edges alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StraightenedEdges {
    /// Name of the body.
    pub body: String,
    /// How many edges.
    pub edges: usize,
    /// Largest distance by which a middle node was moved, m.
    pub largest_m: f64,
    /// The same over the length of the edge.
    pub largest_share: f64,
}

/// A harmonic load: `amplitude cos(harmonic omega t - phase_rad)` times one unit of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Excitation {
    /// One unit of it: bodies (indices in [`Model::bodies`]) and what acts on them.
    pub loads: Vec<(usize, AppliedLoad)>,
    /// In the unit of [`ExcitationKind::unit`].
    pub amplitude: f64,
    /// Multiple of the frequency of the response.
    pub harmonic: usize,
    /// Lag behind the cosine.
    pub phase_rad: f64,
    /// How it depends on the frequency.
    pub growth: Growth,
}

/// How a harmonic load depends on its own frequency, `harmonic` times that of the response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Growth {
    /// Not at all.
    Constant,
    /// With the square of the angular frequency; it is given at 1 rad/s.
    Squared,
}

/// A displacement watched: sum over `terms` of `direction . u(node)`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Observation {
    /// The name by which results call it.
    pub name: String,
    /// Node, and direction scaled by the node's share.
    pub terms: Vec<(BodyNode, [f64; 3])>,
}
