//! Bodies as matrices, and what joins them: what finite elements, ours or another program's, hand to the
//! [reduction](crate::reduction).

use nalgebra_sparse::CscMatrix;

/// Bodies, the nodes at which they meet, and what acts on them.
#[derive(Debug, Clone)]
pub struct Structure {
    /// The bodies, each with its own matrices.
    pub bodies: Vec<BodyMatrices>,
    /// Nodes of one body that move with those of another or relative to them. Those with a frame are the contact pairs, in
    /// their order.
    pub joints: Vec<Joint>,
    /// One unit of each excitation.
    pub excitations: Vec<BodyVectors>,
    /// Observed displacements: their names, and the load whose work on a motion is what is observed.
    pub observations: Vec<(String, BodyVectors)>,
}

/// Of each body a vector on its degrees of freedom.
pub type BodyVectors = Vec<Vec<f64>>;

/// Symmetric matrices of one body on its n degrees of freedom, three (x, y, z) for each of its free nodes, those of the
/// interior first. The matrices are stored whole (both triangles), row indices ascending in each column.
#[derive(Debug, Clone)]
pub struct BodyMatrices {
    /// The name by which messages call the body.
    pub name: String,
    /// K, N/m, n x n; with its springs, and with geometric stiffness and spin softening where they are asked for.
    pub stiffness: CscMatrix<f64>,
    /// M, kg, n x n, positive semidefinite.
    pub mass: CscMatrix<f64>,
    /// Steady load, N, n; nothing on degrees of freedom that are held.
    pub load_n: Vec<f64>,
    /// How many free nodes are no nodes of an interface. They come first.
    pub interior_nodes: usize,
    /// Degrees of freedom that do not move, ascending; the matrices have nothing but the diagonal there.
    pub held_dofs: Vec<u32>,
    /// How many fixed-interface modes a Craig-Bampton reduction of this body keeps; `None` where it is not reduced by itself.
    pub fixed_interface_modes: Option<usize>,
    /// The number by which messages call each free node, n / 3.
    pub node_tags: Vec<u64>,
}

impl BodyMatrices {
    /// Number of degrees of freedom, n.
    pub fn dofs(&self) -> usize {
        self.stiffness.ncols()
    }

    /// Number of those of the interior.
    pub fn interior_dofs(&self) -> usize {
        3 * self.interior_nodes
    }

    /// The number by which messages call a free node.
    pub fn node_tag(&self, node: usize) -> u64 {
        self.node_tags.get(node).copied().unwrap_or(0)
    }

    /// The axes along which a free node is held.
    pub fn held_axes(&self, node: usize) -> [bool; 3] {
        [0, 1, 2].map(|axis| {
            let dof = 3 * node + axis;
            self.held_dofs
                .binary_search_by(|held| (*held as usize).cmp(&dof))
                .is_ok()
        })
    }
}

/// A free node of an interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct InterfaceNode {
    /// Index in [`Structure::bodies`].
    pub body: usize,
    /// Number among the free nodes of the body: its degrees of freedom are `3 node .. 3 node + 3`.
    pub node: usize,
}

/// A node that moves with the weighted mean of others, or relative to it.
#[derive(Debug, Clone)]
pub struct Joint {
    /// The node that follows.
    pub slave: InterfaceNode,
    /// The nodes that it follows, and their weights; none on what does not move.
    pub masters: Vec<(InterfaceNode, f64)>,
    /// What turns the relative displacement of a contact pair (normal, first and second tangent) into that of the slave
    /// against its masters; `None` where the two are bonded.
    pub turned: Option<[[f64; 3]; 3]>,
}
