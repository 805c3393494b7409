//! Bodies as matrices, and their joints: the input of the [reduction](crate::reduction), from
//! finite elements of this library or of another program.

use std::borrow::Cow;

use dovetail_dynamics::reduced::{ObservedQuantity, SteadyCause};
use dovetail_numerics::sparse::extend_pattern;
use nalgebra_sparse::CscMatrix;
use serde::{Deserialize, Serialize};

/// Bodies, the nodes at which they meet, and their loads.
#[derive(Debug, Clone)]
pub struct Structure {
    /// Bodies, each with its own matrices.
    pub bodies: Vec<BodyMatrices>,
    /// Nodes of one body that move with those of another or relative to them. Those with a frame
    /// are the contact pairs, in their order.
    pub joints: Vec<Joint>,
    /// Parts of the steady load of all bodies. With their working multiples they add up to
    /// [`BodyMatrices::load_n`]; empty where the parts are not known, and a load path changes the
    /// steady load as a whole.
    pub steady_parts: Vec<SteadyPart>,
    /// One unit of each excitation.
    pub excitations: Vec<BodyVectors>,
    /// Observed displacements and strains.
    pub observations: Vec<ObservedWork>,
    /// Dashpots: their coefficients, N s/m, and the loads whose work on a motion is the displacement
    /// that a dashpot acts on.
    pub dashpots: Vec<(f64, BodyVectors)>,
    /// Modes on which the air acts: the loads whose work on a motion is the amplitude of the mode
    /// ([`influence`](dovetail_dynamics::reduced::influence)).
    pub influenced: Vec<BodyVectors>,
}

impl From<Structure> for Cow<'_, Structure> {
    fn from(structure: Structure) -> Self {
        Cow::Owned(structure)
    }
}

impl<'a> From<&'a Structure> for Cow<'a, Structure> {
    fn from(structure: &'a Structure) -> Self {
        Cow::Borrowed(structure)
    }
}

/// Part of the steady load that a load path can change by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyPart {
    /// Cause of the part, which says what its multiple is.
    pub cause: SteadyCause,
    /// The part at a multiple of 1.
    pub load: BodyVectors,
    /// Multiple of the part in the steady load.
    pub working: f64,
}

/// Displacement or strain that is observed.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservedWork {
    /// Name in the results.
    pub name: String,
    /// What is observed.
    pub quantity: ObservedQuantity,
    /// Load whose work on a motion is what is observed.
    pub load: BodyVectors,
}

/// Vector on the degrees of freedom of each body.
pub(crate) type BodyVectors = Vec<Vec<f64>>;

/// Symmetric matrices of one body on its n degrees of freedom, three (x, y, z) for each of its free
/// nodes, those of the interior first. The matrices are stored whole (both triangles), with row
/// indices ascending in each column.
#[derive(Debug, Clone)]
pub struct BodyMatrices {
    /// Name of the body in messages.
    pub name: String,
    /// Stiffness K, N/m, n x n, including its springs, and geometric stiffness and spin softening
    /// where they are asked for.
    pub stiffness: CscMatrix<f64>,
    /// Mass M, kg, n x n, positive semidefinite.
    pub mass: CscMatrix<f64>,
    /// Steady load, N, n; zero on degrees of freedom that are held.
    pub load_n: Vec<f64>,
    /// Centrifugal load at 1 rad/s, N s2/rad2, n, which `load_n` has as many times as the square of
    /// the speed is, rad2/s2; empty for a body that does not rotate.
    pub centrifugal_n_s2: Vec<f64>,
    /// Number of free nodes that belong to no interface. They come first.
    pub interior_nodes: usize,
    /// Degrees of freedom that do not move, ascending; the matrices have only the diagonal there.
    pub held_dofs: Vec<u32>,
    /// Number of fixed-interface modes that a Craig-Bampton reduction of this body keeps; `None`
    /// where it is not reduced by itself.
    pub fixed_interface_modes: Option<usize>,
    /// Number of each free node in messages, n / 3.
    pub node_tags: Vec<u64>,
}

impl BodyMatrices {
    /// Number of degrees of freedom, n.
    pub fn dofs(&self) -> usize {
        self.stiffness.ncols()
    }

    /// Stiffness with a place for every entry of the mass. Both are then condensed and factored in one
    /// order. Matrices of another program may have a mass that couples rows that the stiffness does not couple, as
    /// superelements with modes do.
    pub(crate) fn stiffness_with_places(&self) -> Cow<'_, CscMatrix<f64>> {
        extend_pattern(&self.stiffness, &self.mass)
    }

    /// Number of degrees of freedom of the interior.
    pub fn interior_dofs(&self) -> usize {
        3 * self.interior_nodes
    }

    /// Number of a free node in messages.
    pub fn node_tag(&self, node: usize) -> u64 {
        self.node_tags.get(node).copied().unwrap_or(0)
    }

    /// Axes along which a free node is held.
    pub(crate) fn held_axes(&self, node: usize) -> [bool; 3] {
        [0, 1, 2].map(|axis| {
            let dof = 3 * node + axis;
            self.held_dofs
                .binary_search_by(|held| (*held as usize).cmp(&dof))
                .is_ok()
        })
    }
}

/// Free node of an interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct InterfaceNode {
    /// Index in [`Structure::bodies`].
    pub body: usize,
    /// Number among the free nodes of the body: its degrees of freedom are `3 node .. 3 node + 3`.
    pub node: usize,
}

/// Node that moves with the weighted mean of others, or relative to it.
#[derive(Debug, Clone)]
pub struct Joint {
    /// Node that follows.
    pub slave: InterfaceNode,
    /// Nodes that it follows, and their weights; empty where it follows rigid ground.
    pub masters: Vec<(InterfaceNode, f64)>,
    /// Matrix that turns the relative displacement of a contact pair (normal, first and second
    /// tangent) to that of the slave relative to its masters; `None` where the two are bonded.
    pub turned: Option<[[f64; 3]; 3]>,
    /// Sector of the masters where it is another one than that of the slave; `None` where they
    /// belong to the same one, or nothing repeats.
    pub across: Option<OtherSector>,
}

/// Sector of a disc of equal sectors, seen from another one. Each sector has axes of its own, which
/// are those of the sector before turned by one pitch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OtherSector {
    /// Number of sectors by which it lies ahead, in the direction in which they are counted.
    pub ahead: i32,
    /// Matrix that turns displacements in its axes to the axes of the sector that it is seen from.
    pub turn: [[f64; 3]; 3],
}

impl OtherSector {
    /// The same sector with displacements times a factor.
    pub(crate) fn times(self, factor: f64) -> Self {
        let turn = self.turn.map(|row| row.map(|v| factor * v));
        Self { turn, ..self }
    }
}
