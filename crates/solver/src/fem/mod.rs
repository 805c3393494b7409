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

pub mod assembly;
pub mod elasticity;
pub mod element;
pub mod elements;
pub mod given;
pub mod incompatible;
pub mod loads;
pub mod mass_properties;
pub mod released;
pub mod spin;
pub mod springs;
pub mod statics;
pub mod stress;
pub mod tables;

mod error;
mod joined;

use nalgebra_sparse::CscMatrix;
use rayon::iter::{IndexedParallelIterator, IntoParallelRefIterator, ParallelIterator};

use crate::model::{Body, BodyPrestress, Matrices, Model, Rotation};
use crate::structure::{BodyMatrices, Structure};
use assembly::{
    NodePattern, add_springs, renew, sum_elements, symmetric_matrix, symmetric_matrix_of_scalars,
};
use elements::Elements;
use springs::spring_elements;
use statics::SolveSpd;

pub use error::{FemError, Tags};
pub use joined::join;
pub use statics::expand_to_nodes;

/// Static displacement of all nodes of each body that its prestress comes from, m; `None` for a body
/// without prestress.
pub type Prestressed = Vec<Option<OnNodes>>;

/// Displacement of all nodes of a body, m.
pub type OnNodes = Vec<[f64; 3]>;

/// Assembles all bodies in parallel. Where the prestress is that of the static state with contact,
/// which the bodies by themselves do not determine, the stiffness is that without stress. It gives
/// a displacement ([`stuck_displacement`](crate::reduction::stuck_displacement), or that of a
/// static state) for [`assemble_stressed`].
///
/// # Errors
/// Bad elements or nodes, or a body held too loosely for its prestress: see [`FemError`].
pub fn assemble(model: &Model) -> Result<Structure, FemError> {
    Ok(assemble_with(model, &statics::solve_by_cholesky)?.0)
}

/// Like [`assemble`], with a linear solver of the caller's, and with the displacements that the
/// prestress comes from. `solve` computes the static displacement with the flanks held, and is never
/// called where the prestress is another one.
///
/// # Errors
/// The errors of [`assemble`].
pub fn assemble_with(
    model: &Model,
    solve: &SolveSpd,
) -> Result<(Structure, Prestressed), FemError> {
    let rotation = model.rotation.as_ref();
    let bodies = model.bodies.par_iter();
    let bodies = bodies.map(|body| with_held_flanks(body, rotation, solve));
    let bodies: Vec<_> = bodies.collect::<Result<_, _>>()?;
    let (matrices, prestressed) = bodies.into_iter().unzip();
    Ok((join(model, matrices)?, prestressed))
}

/// Like [`assemble`], with the prestress taken from these displacements, whether a body rotates or
/// not.
///
/// # Errors
/// The errors of [`assemble`].
pub fn assemble_stressed(
    model: &Model,
    prestressed: &[Option<OnNodes>],
) -> Result<Structure, FemError> {
    let rotation = model.rotation.as_ref();
    let bodies = model.bodies.par_iter().zip(prestressed);
    let bodies = bodies.map(|(body, u)| {
        let rotation = rotation.filter(|_| body.rotates);
        Ok(body_matrices(body, rotation, |_, _| Ok(u.clone()))?.0)
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
    displacements: &[OnNodes],
) -> Result<Vec<CscMatrix<f64>>, FemError> {
    let bodies = model.bodies.par_iter().zip(displacements);
    let bodies = bodies.map(|(body, displacement_m)| {
        let Matrices::Elements(material) = &body.matrices else {
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
    Ok(with_held_flanks(body, rotation, solve)?.0)
}

/// Matrices of [`assemble_body`], and the displacement that their prestress comes from.
fn with_held_flanks(
    body: &Body,
    rotation: Option<&Rotation>,
    solve: &SolveSpd,
) -> Result<(BodyMatrices, Option<OnNodes>), FemError> {
    let rotation = rotation.filter(|_| body.rotates);
    body_matrices(body, rotation, |stiffness, load_n| {
        match rotation.map(|r| r.prestress) {
            None | Some(BodyPrestress::None) => Ok(None),
            Some(BodyPrestress::HeldFlanks) => {
                statics::held_displacement(body, stiffness, load_n, solve).map(Some)
            }
        }
    })
}

/// Matrices of a body with the prestress of the displacement that `stressed` finds from its
/// stiffness and its load, and this displacement. Matrices of another program stay as they are: what
/// stresses them is not known.
fn body_matrices(
    body: &Body,
    rotation: Option<&Rotation>,
    stressed: impl FnOnce(&CscMatrix<f64>, &[f64]) -> Result<Option<OnNodes>, FemError>,
) -> Result<(BodyMatrices, Option<OnNodes>), FemError> {
    let springs = spring_elements(body);
    let material = match &body.matrices {
        Matrices::Elements(material) => *material,
        Matrices::Given(placed) => {
            let (mut stiffness, mass) = given::matrices(body, placed, &springs)?;
            loads::uncouple(&mut stiffness, &body.held_dofs);
            let load_n = steady_load(body, given::steady_load(body, placed));
            return Ok((finished(body, stiffness, mass, load_n, Vec::new()), None));
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
        hold(body, &mut centrifugal_n);
        centrifugal_n_s2 = centrifugal_n.iter().map(|f| f / some_omega2).collect();
        if omega2 > 0.0 {
            load_n = centrifugal_n;
        }
    }
    let load_n = steady_load(body, load_n);
    let prestressed = stressed(&stiffness, &load_n)?;
    if let Some(u0) = &prestressed {
        let g = spin::geometric_stiffness(body, &elements, &pattern, u0);
        if let Some(rotation) = rotation {
            spin::add_softening(&mut k, &m, rotation);
        }
        spin::add_geometric(&mut k, &g);
        renew(&mut stiffness, &pattern, &k);
        loads::uncouple(&mut stiffness, &body.held_dofs);
    }
    let mass = symmetric_matrix_of_scalars(&pattern, &m);
    let matrices = finished(body, stiffness, mass, load_n, centrifugal_n_s2);
    Ok((matrices, prestressed))
}

/// Steady loads of a body, with those that `load_n` has already.
fn steady_load(body: &Body, mut load_n: Vec<f64>) -> Vec<f64> {
    for (_, load) in &body.loads {
        loads::add_load(body, load, &mut load_n);
    }
    hold(body, &mut load_n);
    load_n
}

/// Takes a load from the degrees of freedom that do not move.
fn hold(body: &Body, load_n: &mut [f64]) {
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
