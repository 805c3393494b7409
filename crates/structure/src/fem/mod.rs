//! Finite elements: conversion of a [`Model`] to a [`Structure`], which has stiffness, mass and
//! loads of each body, with rotation where it is asked for, and the joints of the bodies.
//!
//! With the elasticity D, the gradients B and the values N of the shape functions, and the density
//! rho, a body has
//!
//! ```text
//! K = integral of B^T D B      M = integral of rho N^T N      f = integral of N^T t over surfaces
//! ```
//!
//! `elasticity.rs` has the integrands and their sources, `element.rs` the integrals over one
//! element, `assembly.rs` adds them up, `spin.rs` adds what rotation changes, `released.rs` has the
//! equations of what supports hold. A new type of element is a line in `elements.rs`. The order in
//! which the assembly adds elements decides the last bits of all matrices and does not depend on the
//! number of threads: it stays as it is.

pub(crate) mod assembly;
pub mod elasticity;
pub mod element;
pub mod elements;
pub mod given;
pub(crate) mod incompatible;
pub(crate) mod loads;
pub mod mass_properties;
pub mod released;
pub(crate) mod spin;
pub mod springs;
pub mod statics;
pub mod stress;
pub(crate) mod tables;

mod error;
mod joined;
mod recovered;

use nalgebra_sparse::CscMatrix;
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, IntoParallelRefIterator, ParallelIterator,
};

use crate::model::{Body, BodyPrestress, MatrixOrigin, Model, Rotation};
use crate::structure::{BodyMatrices, Joint, Structure};
use assembly::{
    LowerBlocks, NodePattern, add_springs, renew, sum_elements, symmetric_matrix,
    symmetric_matrix_of_scalars,
};
use elements::Elements;
use springs::spring_elements;
use statics::SolveSpd;

pub use error::{FemError, Tags};
pub use joined::join;
pub use statics::expand_to_nodes;

/// Static displacement of all nodes of each body that its prestress comes from, m; `None` for a body
/// without prestress.
pub type Prestressed = Vec<Option<NodeDisplacements>>;

/// Displacement of all nodes of a body, m.
pub type NodeDisplacements = Vec<[f64; 3]>;

/// Assembles all bodies in parallel. Where the prestress is that of the static state with contact,
/// which the bodies by themselves do not determine, the stiffness is that without stress. It gives
/// a displacement ([`stuck_displacement`](crate::reduction::stuck_displacement), or that of a
/// static state) for [`assemble_stressed`].
///
/// # Errors
/// Bad elements or nodes, or a body held too loosely for its prestress: see [`FemError`].
pub fn assemble(model: &Model) -> Result<Structure, FemError> {
    Ok(assemble_with(model, &statics::solve_by_cholesky, |_, _| ())?.0)
}

/// Like [`assemble`], with a linear solver of the caller's, and with the displacements that the
/// prestress comes from. `solve` computes the static displacement with the flanks held, and is never
/// called where the prestress is another one. `meanwhile` is called with the bodies without stress
/// and their joints while it solves; stress changes no pattern of entries.
///
/// # Errors
/// The errors of [`assemble`].
pub fn assemble_with<T: Send>(
    model: &Model,
    solve: &SolveSpd,
    meanwhile: impl FnOnce(&[BodyMatrices], &[Joint]) -> T + Send,
) -> Result<(Structure, Prestressed, T), FemError> {
    let rotation = model.rotation.as_ref();
    let bodies = model.bodies.par_iter();
    let bodies = bodies.map(|body| Assembled::new(body, rotation.filter(|_| body.rotates)));
    let bodies: Vec<_> = bodies.collect::<Result<_, _>>()?;
    let joints = joined::joints(model)?;
    let (matrices, parts): (Vec<_>, Vec<_>) = bodies.into_iter().unzip();
    let (prestressed, found) = rayon::join(
        || -> Result<Prestressed, FemError> {
            let bodies = parts.par_iter().zip(&matrices);
            let held = bodies.map(|(parts, matrices)| parts.held_displacement(matrices, solve));
            held.collect()
        },
        || meanwhile(&matrices, &joints),
    );
    let prestressed = prestressed?;
    let bodies = parts.into_par_iter().zip(matrices).zip(&prestressed);
    let bodies = bodies.map(|((parts, matrices), u)| parts.stressed(matrices, u.as_ref()));
    Ok((join(model, bodies.collect())?, prestressed, found))
}

/// Like [`assemble`], with the prestress taken from these displacements, whether a body rotates or
/// not.
///
/// # Errors
/// The errors of [`assemble`].
pub fn assemble_stressed(
    model: &Model,
    prestressed: &[Option<NodeDisplacements>],
) -> Result<Structure, FemError> {
    let rotation = model.rotation.as_ref();
    let bodies = model.bodies.par_iter().zip(prestressed);
    let bodies = bodies.map(|(body, u)| {
        let rotation = rotation.filter(|_| body.rotates);
        body_matrices(body, rotation, u.as_ref())
    });
    join(model, bodies.collect::<Result<_, _>>()?)
}

/// Geometric stiffness of the stress of these displacements, m, of each body, N/m. It is linear in
/// the displacement. Matrices of another program have none.
///
/// # Errors
/// Bad elements: see [`FemError`].
pub fn geometric_stiffness(
    model: &Model,
    displacements: &[NodeDisplacements],
) -> Result<Vec<CscMatrix<f64>>, FemError> {
    let bodies = model.bodies.par_iter().zip(displacements);
    let bodies = bodies.map(|(body, displacement_m)| {
        let MatrixOrigin::Elements(material) = &body.matrices else {
            let dofs = 3 * body.dofs.free_nodes();
            return Ok(CscMatrix::zeros(dofs, dofs));
        };
        let elements = Elements::new(body, *material)?;
        let pattern = NodePattern::new(body, &[]);
        let g = spin::geometric_stiffness(body, &elements, &pattern, displacement_m);
        let mut stiffness = symmetric_matrix_of_scalars(&pattern, &g);
        loads::uncouple(&mut stiffness, &body.held_dofs);
        Ok(stiffness)
    });
    bodies.collect()
}

/// Assembles one body, with a linear solver of the caller's ([`statics::solve_by_cholesky`] is that
/// of [`assemble`]); `rotation` counts only if the body rotates.
///
/// # Errors
/// The errors of [`assemble`].
pub fn assemble_body(
    body: &Body,
    rotation: Option<&Rotation>,
    solve: &SolveSpd,
) -> Result<BodyMatrices, FemError> {
    let (matrices, parts) = Assembled::new(body, rotation.filter(|_| body.rotates))?;
    let prestressed = parts.held_displacement(&matrices, solve)?;
    Ok(parts.stressed(matrices, prestressed.as_ref()))
}

/// Matrices of a body with the prestress of a displacement.
fn body_matrices(
    body: &Body,
    rotation: Option<&Rotation>,
    prestressed: Option<&NodeDisplacements>,
) -> Result<BodyMatrices, FemError> {
    let (matrices, parts) = Assembled::new(body, rotation)?;
    Ok(parts.stressed(matrices, prestressed))
}

/// What the stress of a body adds to, beside its matrices without stress.
struct Assembled<'a> {
    body: &'a Body,
    rotation: Option<&'a Rotation>,
    /// `None` for matrices of another program. They stay as they are: what stresses them is not
    /// known.
    elements: Option<ElementSums<'a>>,
}

/// Elements of a body, and the sums of their stiffness and mass.
struct ElementSums<'a> {
    elements: Elements<'a>,
    pattern: NodePattern,
    stiffness: LowerBlocks<9>,
    mass: LowerBlocks<1>,
}

impl<'a> Assembled<'a> {
    /// Assembles a body without stress. `rotation` is that of a body that rotates.
    fn new(
        body: &'a Body,
        rotation: Option<&'a Rotation>,
    ) -> Result<(BodyMatrices, Self), FemError> {
        let springs = spring_elements(body);
        let material = match &body.matrices {
            MatrixOrigin::Elements(material) => *material,
            MatrixOrigin::Given(placed) => {
                let (mut stiffness, mass) = given::matrices(body, placed, &springs);
                loads::uncouple(&mut stiffness, &body.held_dofs);
                let load_n = steady_load(body, given::steady_load(body, placed));
                let matrices = finished(body, stiffness, mass, load_n, Vec::new());
                let parts = Self {
                    body,
                    rotation: None,
                    elements: None,
                };
                return Ok((matrices, parts));
            }
        };
        let elements = Elements::new(body, material)?;
        let pattern = NodePattern::new(body, &springs);
        let isolated = pattern.isolated();
        if !isolated.is_empty() {
            return Err(FemError::orphan_nodes(body, &isolated));
        }
        let mut k = sum_elements::<9>(body, &pattern, |e, out| elements.stiffness(e, out));
        add_springs(body, &pattern, &springs, &mut k);
        let m = sum_elements::<1>(body, &pattern, |e, out| elements.mass(e, out));
        let mut stiffness = symmetric_matrix(&pattern, &k);
        loads::uncouple(&mut stiffness, &body.held_dofs);
        let (mut load_n, mut centrifugal_n_s2) = (vec![0.0; stiffness.ncols()], Vec::new());
        if let Some(rotation) = rotation {
            // At rest the load is that at 1 rad/s: a load path may come by a speed.
            let omega2 = rotation.speed_rad_s * rotation.speed_rad_s;
            let some_omega2 = if omega2 > 0.0 { omega2 } else { 1.0 };
            let mut centrifugal_n = spin::centrifugal_load(body, &elements, rotation, some_omega2);
            zero_held_loads(body, &mut centrifugal_n);
            centrifugal_n_s2 = centrifugal_n.iter().map(|f| f / some_omega2).collect();
            if omega2 > 0.0 {
                load_n = centrifugal_n;
            }
        }
        let load_n = steady_load(body, load_n);
        let mass = symmetric_matrix_of_scalars(&pattern, &m);
        let matrices = finished(body, stiffness, mass, load_n, centrifugal_n_s2);
        let parts = Self {
            body,
            rotation,
            elements: Some(ElementSums {
                elements,
                pattern,
                stiffness: k,
                mass: m,
            }),
        };
        Ok((matrices, parts))
    }

    /// Displacement with the flanks held; `None` where the prestress is another one.
    fn held_displacement(
        &self,
        matrices: &BodyMatrices,
        solve: &SolveSpd,
    ) -> Result<Option<NodeDisplacements>, FemError> {
        match self.rotation.map(|r| r.prestress) {
            Some(BodyPrestress::HeldFlanks) => {
                let (stiffness, load_n) = (&matrices.stiffness, &matrices.load_n);
                statics::held_displacement(self.body, stiffness, load_n, solve).map(Some)
            }
            None | Some(BodyPrestress::None) => Ok(None),
        }
    }

    /// The matrices with the prestress of a displacement.
    fn stressed(
        self,
        mut matrices: BodyMatrices,
        prestressed: Option<&NodeDisplacements>,
    ) -> BodyMatrices {
        let (Some(u0), Some(of_elements)) = (prestressed, self.elements) else {
            return matrices;
        };
        let ElementSums {
            elements,
            pattern,
            mut stiffness,
            mass,
        } = of_elements;
        let g = spin::geometric_stiffness(self.body, &elements, &pattern, u0);
        if let Some(rotation) = self.rotation {
            spin::add_softening(&mut stiffness, &mass, rotation);
        }
        spin::add_geometric(&mut stiffness, &g);
        renew(&mut matrices.stiffness, &pattern, &stiffness);
        loads::uncouple(&mut matrices.stiffness, &self.body.held_dofs);
        matrices
    }
}

/// Steady loads of a body, with those that `load_n` has already.
fn steady_load(body: &Body, mut load_n: Vec<f64>) -> Vec<f64> {
    for (_, load) in &body.loads {
        loads::add_load(body, load, &mut load_n);
    }
    zero_held_loads(body, &mut load_n);
    load_n
}

/// Takes a load from the degrees of freedom that do not move.
fn zero_held_loads(body: &Body, load_n: &mut [f64]) {
    for &dof in &body.held_dofs {
        load_n[dof as usize] = 0.0;
    }
}

fn finished(
    body: &Body,
    stiffness: CscMatrix<f64>,
    mut mass: CscMatrix<f64>,
    load_n: Vec<f64>,
    centrifugal_n_s2: Vec<f64>,
) -> BodyMatrices {
    loads::uncouple(&mut mass, &body.held_dofs);
    BodyMatrices {
        name: body.name.clone(),
        stiffness,
        mass,
        load_n,
        centrifugal_n_s2,
        interior_nodes: body.dofs.interior_nodes,
        held_dofs: body.held_dofs.clone(),
        fixed_interface_modes: body.fixed_interface_modes,
        node_tags: body.free_node_tags(),
    }
}
