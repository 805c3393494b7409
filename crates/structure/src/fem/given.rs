//! Bodies whose matrices come from another program: their rows on the free degrees of freedom.
//!
//! With T the displacements of the rows for each free degree of freedom (ties of mid-edge nodes and
//! the axes of a turned body are in it; what is fixed has no column) a body has
//!
//! ```text
//! K = T^T K_given T      M = T^T M_given T
//! ```

use faer::{Mat, MatRef};
use nalgebra_sparse::{CooMatrix, CscMatrix};

use super::springs::SpringElement;
use crate::model::{Body, PlacedMatrices, RowUnknown};
use dovetail_numerics::dense::{product, self_adjoint_eigenvalues};
use dovetail_numerics::space::{add_scaled, sub};
use dovetail_numerics::sparse::times;

/// Stiffness and mass of a body on its free degrees of freedom, with its springs, before what is
/// held is uncoupled.
pub(crate) fn matrices(
    body: &Body,
    placed: &PlacedMatrices,
    springs: &[SpringElement],
) -> (CscMatrix<f64>, CscMatrix<f64>) {
    let size = 3 * body.dofs.free_nodes();
    let (mut stiffness, mass) = summed(body, placed, springs);
    let [of_stiffness, of_mass] = [&stiffness, &mass].map(diagonal);
    let mut is_held = vec![false; size];
    for dof in &body.held_dofs {
        is_held[*dof as usize] = true;
    }
    // Degrees of freedom that are held or that nothing moves would make the matrix singular.
    let mean = of_stiffness.iter().sum::<f64>() / size as f64;
    let mut more = CooMatrix::new(size, size);
    let lacking = (0..size).filter(|dof| of_stiffness[*dof] <= 0.0);
    for dof in lacking.filter(|dof| is_held[*dof] || of_mass[*dof] <= 0.0) {
        more.push(dof, dof, mean);
    }
    if more.nnz() > 0 {
        stiffness = &stiffness + &CscMatrix::from(&more);
    }
    (stiffness, mass)
}

/// Stiffness and mass of [`matrices`], whatever they lack.
pub(super) fn summed(
    body: &Body,
    placed: &PlacedMatrices,
    springs: &[SpringElement],
) -> (CscMatrix<f64>, CscMatrix<f64>) {
    let size = 3 * body.dofs.free_nodes();
    let parts: Vec<Vec<(usize, f64)>> = free_parts(body, placed).map(Iterator::collect).collect();
    let mut stiffness = congruent(placed.given.stiffness(), &parts, size);
    add_springs(body, springs, &mut stiffness);
    let mass = congruent(placed.given.mass(), &parts, size);
    (CscMatrix::from(&stiffness), CscMatrix::from(&mass))
}

/// Adds the force M a of the mass in a uniform field of acceleration. Mass that the matrices couple
/// to supports of the other program, which have no row, is not in it.
pub(crate) fn add_inertia(
    body: &Body,
    placed: &PlacedMatrices,
    acceleration_m_s2: [f64; 3],
    load_n: &mut [f64],
) {
    let force = mass_times(placed, &placed.translation(acceleration_m_s2));
    add_on_rows(body, placed, &force, load_n);
}

/// Steady load that comes with the matrices.
pub(crate) fn steady_load(body: &Body, placed: &PlacedMatrices) -> Vec<f64> {
    let mut load_n = vec![0.0; 3 * body.dofs.free_nodes()];
    if let Some(given) = placed.given.load_n() {
        add_on_rows(body, placed, given, &mut load_n);
    }
    load_n
}

fn add_on_rows(body: &Body, placed: &PlacedMatrices, force_n: &[f64], load_n: &mut [f64]) {
    for (force, parts) in force_n.iter().zip(free_parts(body, placed)) {
        for (dof, weight) in parts {
            load_n[dof] += weight * force;
        }
    }
}

/// Mass, kg, and centre of gravity, m. The centre is not known where the mesh lacks nodes that have
/// mass.
pub(crate) fn mass_and_centre(body: &Body, placed: &PlacedMatrices) -> (f64, Option<[f64; 3]>) {
    let unit_motion = placed.translation([1.0, 0.0, 0.0]);
    let force = mass_times(placed, &unit_motion);
    let dot = |x: &[f64]| x.iter().zip(&force).map(|(x, f)| x * f).sum::<f64>();
    let mass_kg = dot(&unit_motion);
    let position = |place: &RowUnknown| match *place {
        RowUnknown::Displacement { node, .. } => Some(body.nodes_m[node as usize]),
        RowUnknown::Other { .. } | RowUnknown::Empty => None,
    };
    let largest = force.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
    let known = placed.places.iter().zip(&unit_motion).zip(&force);
    let unknown = known
        .filter(|((place, along), _)| position(place).is_none() && **along != 0.0)
        .any(|(_, f)| f.abs() > NO_MASS * largest);
    let moment = |axis: usize| {
        let arms = placed.places.iter().zip(&unit_motion);
        let arms = arms.map(|(place, along)| position(place).map_or(0.0, |x| x[axis] * along));
        dot(&arms.collect::<Vec<_>>())
    };
    let is_known = !unknown && mass_kg > 0.0;
    (
        mass_kg,
        is_known.then(|| [0, 1, 2].map(|axis| moment(axis) / mass_kg)),
    )
}

/// Rigid motions of a body that strain nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FreeMotions {
    /// Number of them: six of a body that nothing holds.
    pub count: usize,
    /// False where the mesh lacks nodes of the matrices: the three translations alone were tried.
    pub with_rotations: bool,
}

/// Rigid motions that strain nothing.
pub fn free_rigid_motions(body: &Body, placed: &PlacedMatrices) -> FreeMotions {
    let units = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut motions: Vec<Vec<f64>> = units.map(|e| placed.translation(e)).into();
    let mut centre = [0.0; 3];
    for x in &body.nodes_m {
        add_scaled(&mut centre, 1.0 / body.nodes_m.len() as f64, *x);
    }
    let arm = |node: u32| sub(body.nodes_m[node as usize], centre);
    let rotations = units.map(|axis| placed.rotation(axis, arm));
    motions.extend(rotations.into_iter().flatten());
    let with_rotations = motions.len() > 3;
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
    let energies = product(r.transpose(), strained.as_ref());
    let energies = self_adjoint_eigenvalues(energies.as_ref()).unwrap_or_default();
    FreeMotions {
        count: energies.iter().filter(|e| e.abs() < NO_STRAIN).count(),
        with_rotations,
    }
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
fn free_parts<'a>(
    body: &'a Body,
    placed: &'a PlacedMatrices,
) -> impl Iterator<Item = impl Iterator<Item = (usize, f64)>> {
    let nodes = body.dofs.nodes.len();
    (0..placed.places.len()).map(move |row| {
        let parts = placed.parts(row, nodes);
        parts.flat_map(|(node, axis, weight)| {
            let free = body.dofs.weights(node);
            free.map(move |(node, share)| (3 * node + axis, share * weight))
        })
    })
}

/// Triplets of T^T A T, `size` rows and columns.
fn congruent(a: &CscMatrix<f64>, parts: &[Vec<(usize, f64)>], size: usize) -> CooMatrix<f64> {
    let mut sum = CooMatrix::new(size, size);
    for (i, j, v) in a.triplet_iter() {
        for &(row, left) in &parts[i] {
            for &(column, right) in &parts[j] {
                sum.push(row, column, left * right * v);
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
                        let (row, column) = (3 * row + at / 3, 3 * column + at % 3);
                        stiffness.push(row, column, left * right * v);
                    }
                }
            }
        }
    }
}

fn diagonal(matrix: &CscMatrix<f64>) -> Vec<f64> {
    let mut diagonal = vec![0.0; matrix.ncols()];
    for (_, j, v) in matrix.triplet_iter().filter(|(i, j, _)| i == j) {
        diagonal[j] = *v;
    }
    diagonal
}
