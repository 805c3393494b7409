//! Bodies whose matrices come from another program: their rows on the free degrees of freedom.
//!
//! With T the displacements of the rows for each free degree of freedom (ties of mid-edge nodes and
//! the axes of a turned body are in it; what is fixed has no column) a body has
//!
//! ```text
//! K = T^T K_given T      M = T^T M_given T
//! ```

use faer::{Mat, MatRef, Side};
use nalgebra_sparse::{CooMatrix, CscMatrix};

use super::FemError;
use super::loads::{add_load, uncouple};
use super::springs::SpringElement;
use crate::model::{Body, Place, PlacedMatrices};
use crate::structure::BodyMatrices;
use dovetail_numerics::space::{add_scaled, sub};
use dovetail_numerics::sparse::times;

/// Matrices of a body on its free degrees of freedom, with its springs.
///
/// # Errors
/// [`FemError::EmptyRows`] where free degrees of freedom have neither stiffness nor mass.
pub fn body_matrices(
    body: &Body,
    placed: &PlacedMatrices,
    springs: &[SpringElement],
) -> Result<BodyMatrices, FemError> {
    let parts = free_parts(body, placed);
    let mut stiffness = congruent(body, placed.given.stiffness(), &parts);
    add_springs(body, springs, &mut stiffness);
    let mut stiffness = CscMatrix::from(&stiffness);
    let mut mass = CscMatrix::from(&congruent(body, placed.given.mass(), &parts));
    for matrix in [&mut stiffness, &mut mass] {
        uncouple(matrix, &body.held_dofs);
    }
    hold(body, &mut stiffness);
    let both = diagonal(&stiffness).into_iter().zip(diagonal(&mass));
    let empty: Vec<usize> = both
        .enumerate()
        .filter_map(|(dof, (k, m))| (k <= 0.0 && m <= 0.0).then_some(dof))
        .collect();
    if let Some(first) = empty.first() {
        return Err(FemError::empty_rows(body, empty.len(), *first));
    }
    let mut load_n = vec![0.0; stiffness.ncols()];
    for load in &body.loads {
        add_load(body, load, &mut load_n);
    }
    for &dof in &body.held_dofs {
        load_n[dof as usize] = 0.0;
    }
    Ok(BodyMatrices {
        name: body.name.clone(),
        stiffness,
        mass,
        load_n,
        interior_nodes: body.dofs.interior_nodes,
        held_dofs: body.held_dofs.clone(),
        fixed_interface_modes: body.fixed_interface_modes,
        node_tags: body.free_node_tags(),
    })
}

/// Adds the force M a of the mass in a uniform field of acceleration. Mass that the matrices couple
/// to supports of the other program, which have no row, is not in it.
pub fn add_inertia(
    body: &Body,
    placed: &PlacedMatrices,
    acceleration_m_s2: [f64; 3],
    load_n: &mut [f64],
) {
    let force = mass_times(placed, &placed.translation(acceleration_m_s2));
    for (force, parts) in force.iter().zip(free_parts(body, placed)) {
        for (dof, weight) in parts {
            load_n[dof] += weight * force;
        }
    }
}

/// Mass, kg, and centre of gravity, m. The centre is not known where the mesh lacks nodes that have
/// mass.
pub fn mass_and_centre(body: &Body, placed: &PlacedMatrices) -> (f64, Option<[f64; 3]>) {
    let all = placed.translation([1.0, 0.0, 0.0]);
    let force = mass_times(placed, &all);
    let dot = |x: &[f64]| x.iter().zip(&force).map(|(x, f)| x * f).sum::<f64>();
    let mass_kg = dot(&all);
    let position = |place: &Place| match *place {
        Place::Displacement { node, .. } => Some(body.nodes_m[node as usize]),
        Place::Other { .. } => None,
    };
    let largest = force.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
    let known = placed.places.iter().zip(&all).zip(&force);
    let unknown = known
        .filter(|((place, along), _)| position(place).is_none() && **along != 0.0)
        .any(|(_, f)| f.abs() > NO_MASS * largest);
    let moment = |axis: usize| {
        let arms = placed.places.iter().zip(&all);
        let arms = arms.map(|(place, along)| position(place).map_or(0.0, |x| x[axis] * along));
        dot(&arms.collect::<Vec<_>>())
    };
    let is_known = !unknown && mass_kg > 0.0;
    (
        mass_kg,
        is_known.then(|| [0, 1, 2].map(|axis| moment(axis) / mass_kg)),
    )
}

/// Number of rigid motions that strain nothing: six of a body that nothing holds. Only the three
/// translations are tried where the mesh lacks nodes of the matrices.
pub fn free_rigid_motions(body: &Body, placed: &PlacedMatrices) -> usize {
    let units = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut motions: Vec<Vec<f64>> = units.map(|e| placed.translation(e)).into();
    let mut centre = [0.0; 3];
    for x in &body.nodes_m {
        add_scaled(&mut centre, 1.0 / body.nodes_m.len() as f64, *x);
    }
    let arm = |node: u32| sub(body.nodes_m[node as usize], centre);
    let rotations = units.map(|axis| placed.rotation(axis, arm));
    motions.extend(rotations.into_iter().flatten());
    // Each motion is scaled so that it would strain as much if its displacements were alone.
    let stiffness = placed.given.stiffness();
    let diagonal = diagonal(stiffness);
    for motion in &mut motions {
        let alone = motion.iter().zip(&diagonal).map(|(u, k)| k * u * u);
        let size = alone.sum::<f64>().sqrt();
        if size > 0.0 {
            motion.iter_mut().for_each(|u| *u /= size);
        }
    }
    let r = Mat::from_fn(placed.places.len(), motions.len(), |i, j| motions[j][i]);
    let strained = times(stiffness, r.as_ref());
    let energies = r.transpose() * strained;
    let energies = energies.self_adjoint_eigenvalues(Side::Lower);
    let none = |energies: Vec<f64>| energies.into_iter().filter(|e| e.abs() < NO_STRAIN).count();
    energies.map_or(0, none)
}

/// Strain energy of a rigid motion, relative to that of its displacements alone, that counts as
/// none: the last of some six digits with which matrices may have been written.
const NO_STRAIN: f64 = 1e-6;

/// Mass of a node, relative to the largest one, that does not count.
const NO_MASS: f64 = 1e-12;

fn mass_times(placed: &PlacedMatrices, x: &[f64]) -> Vec<f64> {
    let x = MatRef::from_column_major_slice(x, x.len(), 1);
    times(placed.given.mass(), x).col_as_slice(0).to_vec()
}

/// Free degrees of freedom, and their weights, that make up each row.
fn free_parts(body: &Body, placed: &PlacedMatrices) -> Vec<Vec<(usize, f64)>> {
    let nodes = body.dofs.nodes.len();
    let of_row = |row: usize| {
        let parts = placed.parts(row, nodes);
        let free = parts.flat_map(|(node, axis, weight)| {
            let free = body.dofs.weights(node);
            free.map(move |(node, share)| (3 * node + axis, share * weight))
        });
        free.collect()
    };
    (0..placed.places.len()).map(of_row).collect()
}

/// Triplets of T^T A T.
fn congruent(body: &Body, a: &CscMatrix<f64>, parts: &[Vec<(usize, f64)>]) -> CooMatrix<f64> {
    let size = 3 * body.dofs.free_nodes();
    let mut sum = CooMatrix::new(size, size);
    for (i, j, v) in a.triplet_iter() {
        for (row, left) in &parts[i] {
            for (column, right) in &parts[j] {
                sum.push(*row, *column, left * right * v);
            }
        }
    }
    sum
}

fn add_springs(body: &Body, springs: &[SpringElement], stiffness: &mut CooMatrix<f64>) {
    for SpringElement { nodes, matrix } in springs {
        let blocks = nodes.iter().flat_map(|a| nodes.iter().map(move |b| (a, b)));
        for ((a, b), block) in blocks.zip(matrix) {
            for (row, left) in body.dofs.weights(*a as usize) {
                for (column, right) in body.dofs.weights(*b as usize) {
                    for (at, v) in block.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                        let (r, c) = (at / 3, at % 3);
                        stiffness.push(3 * row + r, 3 * column + c, left * right * v);
                    }
                }
            }
        }
    }
}

fn diagonal(matrix: &CscMatrix<f64>) -> Vec<f64> {
    let mut all = vec![0.0; matrix.ncols()];
    for (_, j, v) in matrix.triplet_iter().filter(|(i, j, _)| i == j) {
        all[j] = *v;
    }
    all
}

/// Gives held degrees of freedom that the matrices lack a stiffness, without which the matrix would
/// be singular.
fn hold(body: &Body, stiffness: &mut CscMatrix<f64>) {
    let own = diagonal(stiffness);
    let lacking = body.held_dofs.iter().map(|dof| *dof as usize);
    let lacking: Vec<usize> = lacking.filter(|dof| own[*dof] <= 0.0).collect();
    if lacking.is_empty() {
        return;
    }
    let size = stiffness.ncols();
    let mean = own.iter().sum::<f64>() / size as f64;
    let mut more = CooMatrix::new(size, size);
    for dof in lacking {
        more.push(dof, dof, mean);
    }
    *stiffness = &*stiffness + &CscMatrix::from(&more);
}
