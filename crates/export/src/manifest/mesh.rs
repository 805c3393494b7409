//! Mesh, bodies and observed displacements in summary.json.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize, Serializer};

use crate::unrolled::Orientation;
use dovetail_solver::fem::mass_properties::MassProperties;
use dovetail_solver::model::{BodyNode, FlankMatch, Model, Observation, StraightenedEdges};
use dovetail_solver::reduced::ObservedQuantity;
use dovetail_solver::run::Observed;

/// Origin of a mesh.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshOrigin {
    /// The .msh file or the .geo script.
    #[serde(serialize_with = "displayed")]
    pub source: PathBuf,
    /// Hash of the bytes of the mesh, in hexadecimals; `None` if its file cannot be read.
    pub blake3: Option<String>,
    /// Version of gmsh that made the mesh; `None` for a ready mesh.
    pub gmsh: Option<String>,
    /// True if the committed mesh was used because gmsh is missing.
    pub fallback: bool,
}

/// Path as text, whatever bytes it has.
fn displayed<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.display())
}

/// Sizes of the mesh of a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeshSummary {
    /// Origin of the mesh.
    #[serde(flatten)]
    pub origin: MeshOrigin,
    /// Number of nodes.
    pub nodes: usize,
    /// Number of elements.
    pub elements: usize,
    /// Number of elements of each type, by the name of the type: tet10, hex20.
    pub element_types: BTreeMap<String, usize>,
    /// Number of degrees of freedom that no support holds.
    pub free_dofs: usize,
    /// Sizes of each body.
    pub bodies: Vec<BodySummary>,
    /// Contacts between two flanks, bonded ones last.
    pub contacts: Vec<FlankMatch>,
    /// Contacts whose flanks have maps, in the orientation of the maps.
    #[serde(default)]
    pub flanks: Vec<FlankView>,
    /// Bodies with flanks whose edges are not straight in the mesh.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub straightened_edges: Vec<StraightenedEdges>,
}

/// Flank in the orientation of the maps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlankView {
    /// Number of its contact, as in the VTK files.
    pub contact: usize,
    pub name: String,
    /// Numbers of the bodies of the first and of the second flank; `None` for rigid ground.
    pub bodies: [Option<usize>; 2],
    #[serde(flatten)]
    pub orientation: Orientation,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BodySummary {
    pub name: String,
    pub nodes: usize,
    pub elements: usize,
    pub free_dofs: usize,
    /// Elastic constants and density; `None` where the matrices come from another program.
    pub young_pa: Option<f64>,
    pub poisson: Option<f64>,
    pub density_kg_m3: Option<f64>,
    pub volume_m3: Option<f64>,
    pub mass_kg: f64,
    /// Centre of gravity, m; `None` where the mesh lacks nodes of the matrices.
    pub centre_m: Option<[f64; 3]>,
    /// Centrifugal force of the whole body, N; `None` if it does not rotate.
    pub centrifugal_force_n: Option<[f64; 3]>,
}

/// Observed displacement: sum over `terms` of `direction . u(node)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObservationSummary {
    /// Name of the observation.
    pub name: String,
    /// Observed quantity: a displacement or a strain.
    #[serde(default)]
    pub quantity: ObservedQuantity,
    /// Nodes and directions that the sum is over.
    pub terms: Vec<ObservationTerm>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObservationTerm {
    /// Number of the body, as the array `body` of the VTK files.
    pub body: usize,
    pub node_tag: Option<u64>,
    pub direction: [f64; 3],
}

/// Sizes of the mesh of a model.
pub fn mesh_summary(
    model: &Model,
    properties: &[MassProperties],
    origin: &MeshOrigin,
) -> MeshSummary {
    let bodies: Vec<BodySummary> = model
        .bodies
        .iter()
        .zip(properties)
        .map(|(b, properties)| BodySummary {
            young_pa: b.material().map(|m| m.young_pa),
            poisson: b.material().map(|m| m.poisson),
            density_kg_m3: b.material().map(|m| m.density_kg_m3),
            volume_m3: properties.volume_m3,
            mass_kg: properties.mass_kg,
            centre_m: properties.centre_m,
            centrifugal_force_n: properties.centrifugal_force_n,
            name: b.name.clone(),
            nodes: b.nodes_m.len(),
            elements: b.elements.len(),
            free_dofs: 3 * b.dofs.free_nodes(),
        })
        .collect();
    let types = model.element_types();
    let flanks = Orientation::flank_orientations(model).map(|(pair, orientation)| FlankView {
        contact: pair.contact,
        name: model.contact_names[pair.contact].clone(),
        bodies: pair.bodies(),
        orientation,
    });
    MeshSummary {
        origin: origin.clone(),
        nodes: bodies.iter().map(|b| b.nodes).sum(),
        elements: bodies.iter().map(|b| b.elements).sum(),
        element_types: types.into_iter().map(|(t, n)| (t.name(), n)).collect(),
        free_dofs: bodies.iter().map(|b| b.free_dofs).sum(),
        bodies,
        contacts: model.matches.clone(),
        flanks: flanks.collect(),
        straightened_edges: model.straightened.clone(),
    }
}

/// Terms of each observation.
pub fn observation_summaries(model: &Model) -> Vec<ObservationSummary> {
    let term = |&(BodyNode { body, node }, direction): &(BodyNode, [f64; 3])| ObservationTerm {
        body,
        node_tag: model
            .bodies
            .get(body)
            .and_then(|b| b.node_tags.get(node as usize))
            .copied(),
        direction,
    };
    let summary = |o: &Observation| ObservationSummary {
        name: o.name.clone(),
        quantity: o.quantity,
        terms: o.terms.iter().map(term).collect(),
    };
    model.observations.iter().map(summary).collect()
}

/// Observations of a model without nodes: only what they are.
pub fn probe_summaries(observed: Vec<Observed>) -> Vec<ObservationSummary> {
    let summary = |Observed { name, quantity }| ObservationSummary {
        name,
        quantity,
        terms: Vec::new(),
    };
    observed.into_iter().map(summary).collect()
}
