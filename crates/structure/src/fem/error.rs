//! Errors of a body, with their remedies.

use std::fmt;

use super::statics::SolveFailure;
use crate::model::Body;
use crate::reduction::ReductionError;

/// Error of a body whose finite elements were not assembled.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what they mean")]
#[non_exhaustive]
pub enum FemError {
    #[error(
        "body \"{body}\": {} turned inside out (Jacobian not positive): {tags}; \
         mesh it again with another element size, or without high-order optimisation if only \
         curved elements are concerned", elements_are(tags.0.len())
    )]
    Inverted { body: String, tags: Tags },
    #[error(
        "body \"{body}\": {} flat (no volume): {tags}; \
         mesh it again with another size or algorithm, or with Mesh.Optimize = 1", elements_are(tags.0.len())
    )]
    Degenerate { body: String, tags: Tags },
    #[error(
        "body \"{body}\": nodes {tags} belong to no element; \
         remove them from the mesh, or from the groups that name them"
    )]
    OrphanNodes { body: String, tags: Tags },
    #[error(
        "body \"{body}\" is held too loosely to be prestressed: its stiffness is singular near node \
         {node_tag} at ({}) m; give it a support, hold it by a \
         spring, check that the part of that node is joined to the rest, or set prestress = \"none\"",
        coordinates(position_m)
    )]
    LooselyHeld {
        body: String,
        node_tag: u64,
        position_m: [f64; 3],
    },
    #[error(
        "body \"{body}\": under rotation node {node_tag} moves {displacement_m:.3} m, more than the body is \
         large: linear elasticity means nothing there; check the unit of the speed, metres_per_unit \
         and young_pa, or lower the speed"
    )]
    TooFar {
        body: String,
        node_tag: u64,
        displacement_m: f64,
    },
    #[error(
        "node {node} of body `{body}` is in contact but does not move by itself: a node of a contact must be free"
    )]
    ContactNodeNotFree { body: String, node: u64 },
    #[error("body \"{body}\": the static state under rotation could not be solved")]
    Statics { body: String, source: SolveFailure },
    #[error("body \"{body}\": the modes of its aerodynamic influence were not found")]
    InfluencedModes {
        body: String,
        source: ReductionError,
    },
    #[error(
        "body \"{body}\" has {available} modes with its flanks held, and its aerodynamic influence is on mode {asked}"
    )]
    NoInfluencedMode {
        body: String,
        asked: usize,
        available: usize,
    },
}

impl FemError {
    pub(super) fn loosely_held(body: &Body, free_node: usize) -> Self {
        let (node_tag, position_m) = locate(body, free_node);
        Self::LooselyHeld {
            body: body.name.clone(),
            node_tag,
            position_m,
        }
    }

    pub(super) fn too_far(body: &Body, free_node: usize, displacement_m: f64) -> Self {
        Self::TooFar {
            body: body.name.clone(),
            node_tag: locate(body, free_node).0,
            displacement_m,
        }
    }

    pub(super) fn orphan_nodes(body: &Body, free_nodes: &[usize]) -> Self {
        let tags: Vec<u64> = free_nodes.iter().map(|&n| locate(body, n).0).collect();
        Self::OrphanNodes {
            body: body.name.clone(),
            tags: tags.into(),
        }
    }
}

/// Gmsh tags of elements or nodes; displays the first few and how many more there are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tags(pub Vec<u64>);

impl From<Vec<u64>> for Tags {
    fn from(tags: Vec<u64>) -> Self {
        Self(tags)
    }
}

impl fmt::Display for Tags {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 8;
        let shown: Vec<String> = self.0.iter().take(SHOWN).map(u64::to_string).collect();
        f.write_str(&shown.join(", "))?;
        match self.0.len().saturating_sub(SHOWN) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

fn elements_are(count: usize) -> String {
    match count {
        1 => "one element is".to_string(),
        n => format!("{n} elements are"),
    }
}

fn coordinates(p: &[f64; 3]) -> String {
    format!("{:.6}, {:.6}, {:.6}", p[0], p[1], p[2])
}

fn locate(body: &Body, free_node: usize) -> (u64, [f64; 3]) {
    let local = body.mesh_node_of(free_node);
    (body.node_tags[local], body.nodes_m[local])
}
