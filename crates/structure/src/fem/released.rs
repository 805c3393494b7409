//! Equations of a body at some of its nodes, with nothing held there.
//!
//! The equations of a body stand on its free degrees of freedom: what a support holds has no row, or
//! an uncoupled one. Here the nodes in question are free nodes of a part of the body, the elements
//! that touch them. The part is a body like any other. Its matrices and loads are assembled like
//! those of the whole body, with the same prestress and spin softening, and the rows of the nodes in
//! question are complete.

use std::collections::BTreeSet;

use nalgebra_sparse::CscMatrix;

use super::loads::add_load;
use super::springs::spring_elements;
use super::{FemError, NodeDisplacements, body_matrices, given, steady_load};
use crate::model::{
    AppliedLoad, Body, DofMap, MatrixOrigin, NodeMotion, Rotation, Row, RowUnknown,
};
use dovetail_mesh::Connectivity;

/// Equations of a body at some of its nodes.
#[derive(Debug)]
pub struct Released {
    /// Part of the body that touches the nodes; n free degrees of freedom.
    part: Body,
    /// Stiffness as the body has it, with its springs, geometric stiffness and spin softening, N/m,
    /// n x n.
    pub stiffness: CscMatrix<f64>,
    /// Mass, kg, n x n.
    pub mass: CscMatrix<f64>,
    /// Steady load, N, n.
    pub load_n: Vec<f64>,
}

impl Released {
    /// Equations of `body` at these of its nodes, none of which is tied to others. The prestress is
    /// that of the displacement `prestressed_m` of all nodes. `rotation` counts only if the body
    /// rotates. The rows of other nodes are not complete.
    ///
    /// # Errors
    /// The errors of [`assemble_body`](super::assemble_body) for the elements at the nodes.
    pub fn new(
        body: &Body,
        nodes: &BTreeSet<u32>,
        rotation: Option<&Rotation>,
        prestressed_m: Option<&NodeDisplacements>,
    ) -> Result<Self, FemError> {
        let part = part(body, nodes);
        let (stiffness, mass, load_n) = match &part.matrices {
            MatrixOrigin::Elements(_) => {
                let rotation = rotation.filter(|_| body.rotates);
                let matrices = body_matrices(&part, rotation, prestressed_m)?;
                (matrices.stiffness, matrices.mass, matrices.load_n)
            }
            MatrixOrigin::Given(placed) => {
                let (stiffness, mass) = given::summed(&part, placed, &spring_elements(&part));
                let load_n = steady_load(&part, given::steady_load(&part, placed));
                (stiffness, mass, load_n)
            }
        };
        Ok(Self {
            part,
            stiffness,
            mass,
            load_n,
        })
    }

    /// Motion of the part, n, in a motion of the free degrees of freedom of `body`, the whole body.
    /// What is held does not move.
    pub fn motion(&self, body: &Body, free: &[f64]) -> Vec<f64> {
        let dofs = &self.part.dofs;
        let mut motion = vec![0.0; 3 * dofs.free_nodes()];
        for node in 0..(dofs.nodes.len() + dofs.auxiliary.len()) as u32 {
            if let (Some(own), Some(whole)) = (dofs.free(node), body.dofs.free(node)) {
                motion[3 * own..3 * own + 3].copy_from_slice(&free[3 * whole..3 * whole + 3]);
            }
        }
        motion
    }

    /// One unit of a load, N, n.
    pub fn load(&self, load: &AppliedLoad) -> Vec<f64> {
        let mut load_n = vec![0.0; 3 * self.part.dofs.free_nodes()];
        add_load(&self.part, load, &mut load_n);
        load_n
    }

    /// Values of a vector of the part, n, at one of the nodes.
    pub fn node_values(&self, node: u32, values: &[f64]) -> [f64; 3] {
        let free = self.part.dofs.free(node);
        free.map_or([0.0; 3], |n| [0, 1, 2].map(|k| values[3 * n + k]))
    }

    /// Sum of the values of a vector of the part, n, on the rotations of a node, each along its
    /// axis. Matrices of another program alone have rotations.
    pub fn rotation_sum(&self, node: u32, values: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let MatrixOrigin::Given(placed) = &self.part.matrices else {
            return sum;
        };
        for (place, row) in placed.places.iter().zip(placed.given.rows()) {
            let (RowUnknown::Other { number, rotates }, Row::Node { direction, .. }) = (place, row)
            else {
                continue;
            };
            if *rotates != Some(node) || *direction < 4 {
                continue;
            }
            let auxiliary = self.part.dofs.auxiliary[*number as usize / 3] as usize;
            let value = values[3 * auxiliary + *number as usize % 3];
            let axis = usize::from(*direction) - 4;
            for (k, sum) in sum.iter_mut().enumerate() {
                let along = placed
                    .axes
                    .map_or(f64::from(k == axis), |axes| axes[k][axis]);
                *sum += along * value;
            }
        }
        sum
    }
}

/// Part of a body that touches these nodes. They are free, as are all nodes of the elements and
/// springs there.
fn part(body: &Body, nodes: &BTreeSet<u32>) -> Body {
    let is_tied_to = |node: u32| match body.dofs.nodes.get(node as usize) {
        Some(NodeMotion::Tied(corners)) => corners.iter().any(|corner| nodes.contains(corner)),
        _ => false,
    };
    let touches = |node: &u32| nodes.contains(node) || is_tied_to(*node);
    let mut elements = Connectivity::default();
    let mut is_met = vec![false; body.dofs.nodes.len()];
    for (own, tag) in body.elements.iter().zip(body.elements.tags()) {
        if own.iter().any(touches) {
            elements.push(*tag, own.iter().copied());
            own.iter().for_each(|n| is_met[*n as usize] = true);
        }
    }
    for element in spring_elements(body) {
        let of_mesh = || {
            element
                .nodes
                .iter()
                .filter(|n| (**n as usize) < is_met.len())
        };
        if of_mesh().any(touches) {
            let met: Vec<usize> = of_mesh().map(|n| *n as usize).collect();
            met.into_iter().for_each(|n| is_met[n] = true);
        }
    }
    if body.material().is_none() {
        // Which rows the nodes are coupled to only their matrix knows.
        for (met, (node, motion)) in is_met.iter_mut().zip((0..).zip(&body.dofs.nodes)) {
            *met = *motion != NodeMotion::Fixed || nodes.contains(&node);
        }
    }
    for (node, motion) in body.dofs.nodes.iter().enumerate() {
        if let NodeMotion::Tied(corners) = motion
            && is_met[node]
        {
            corners.iter().for_each(|n| is_met[*n as usize] = true);
        }
    }
    let mut numbers = 0..;
    let mut next = || numbers.next().unwrap_or(u32::MAX);
    let released = body.dofs.nodes.iter().zip(&is_met);
    let released = released.map(|(motion, met)| match motion {
        NodeMotion::Tied(_) if *met => *motion,
        _ if *met => NodeMotion::Free(next()),
        _ => NodeMotion::Fixed,
    });
    let released = released.collect();
    let auxiliary = body.dofs.auxiliary.iter().map(|_| next()).collect();
    Body {
        elements,
        dofs: DofMap {
            nodes: released,
            auxiliary,
            interior_nodes: next() as usize,
            contact_nodes: 0,
        },
        held_dofs: Vec::new(),
        ..body.clone()
    }
}
