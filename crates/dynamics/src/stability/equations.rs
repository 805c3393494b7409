//! Equations of the bodies for small perturbations of a motion, without the pairs that change their status.

use super::Reason;
use crate::damping::Rayleigh;
use crate::dlft::{CycleStatus, Orbit};
use crate::problem::Problem;
use dovetail_numerics::dense::{product, self_adjoint_eigen};
use faer::Mat;
use std::f64::consts::TAU;

/// A mass below this fraction of the largest counts as zero.
const MASSLESS: f64 = 1e-12;

/// Equations of the bodies in coordinates of unit mass.
pub(super) struct Equations {
    /// Stiffness, rad2/s2, and damping, 1/s, without the pairs that change.
    pub(super) stiffness: Mat<f64>,
    pub(super) damping: Mat<f64>,
    /// Displacement (N, t1, t2) of each pair that changes by the coordinates, with its number.
    pub(super) changing: Vec<(usize, [Vec<f64>; 3])>,
    /// Angular frequency of the excitation, rad/s.
    pub(super) omega: f64,
    pub(super) rayleigh: Rayleigh,
}

impl Equations {
    pub(super) fn new(problem: &Problem, damping: Rayleigh, orbit: &Orbit) -> Result<Self, Reason> {
        let reduced = &problem.reduced;
        let status = |pair: usize| orbit.cycles[pair].status;
        let pairs = 0..problem.laws.len();
        // What sticks on rigid flanks does not move.
        let is_held =
            |p: usize| status(p) == CycleStatus::Stuck && problem.laws[p].stiffness.is_none();
        let [stiffness, mass, viscous] = matrices(problem, damping);
        // A direction in which a pair has no unknowns has no mass and is coupled to nothing.
        let is_alone = |i: usize| {
            let mut others = (0..stiffness.nrows()).filter(|j| *j != i);
            mass[(i, i)] == 0.0 && others.all(|j| stiffness[(i, j)] == 0.0)
        };
        let of_pairs = reduced.stiffness.nrows();
        let free: Vec<usize> = (0..of_pairs)
            .filter(|i| !is_held(i / 3) && !is_alone(*i))
            .chain(of_pairs..stiffness.nrows())
            .collect();
        let of_free =
            |of: &Mat<f64>| Mat::from_fn(free.len(), free.len(), |i, j| of[(free[i], free[j])]);
        let (masses, shapes) =
            self_adjoint_eigen(of_free(&mass).as_ref()).ok_or(Reason::NotFound)?;
        let heaviest = masses.last().copied().unwrap_or(1.0);
        if masses
            .first()
            .is_some_and(|lightest| *lightest <= MASSLESS * heaviest)
        {
            return Err(Reason::Massless);
        }
        let unit = Mat::from_fn(free.len(), free.len(), |i, j| {
            shapes[(i, j)] / masses[j].sqrt()
        });
        let of_unit = |of: &Mat<f64>| {
            let half = product(unit.transpose(), of_free(of).as_ref());
            product(half.as_ref(), unit.as_ref())
        };
        let row = |unknown: usize| -> Vec<f64> {
            match free.iter().position(|i| *i == unknown) {
                Some(i) => unit.row(i).iter().copied().collect(),
                None => vec![0.0; free.len()],
            }
        };
        let rows = |p: usize| [0, 1, 2].map(|c| row(3 * p + c));
        let mut equations = Self {
            stiffness: of_unit(&stiffness),
            damping: of_unit(&viscous),
            changing: Vec::new(),
            omega: TAU * orbit.frequency_hz,
            rayleigh: damping,
        };
        for pair in pairs {
            match (status(pair), problem.laws[pair].stiffness) {
                (CycleStatus::Open, _) | (CycleStatus::Stuck, None) => {}
                (CycleStatus::Stuck, Some(springs)) => {
                    let [n, t1, t2] = rows(pair);
                    for (k, row) in [
                        (springs.normal_n_m, n),
                        (springs.tangential_n_m, t1),
                        (springs.tangential_n_m, t2),
                    ] {
                        add_outer(&mut equations.stiffness, [0, 0], k, &row, &row);
                    }
                }
                _ => equations.changing.push((pair, rows(pair))),
            }
        }
        Ok(equations)
    }

    /// Number of coordinates.
    pub(super) fn size(&self) -> usize {
        self.stiffness.nrows()
    }
}

/// Stiffness, mass and damping on the displacements of pairs and the modes.
fn matrices(problem: &Problem, damping: Rayleigh) -> [Mat<f64>; 3] {
    let reduced = &*problem.reduced;
    let all: Vec<usize> = (0..reduced.stiffness.nrows()).collect();
    let [stiffness, mass] = reduced.full_matrices(&all);
    let size = stiffness.nrows();
    let mut viscous = Mat::from_fn(size, size, |i, j| {
        damping.stiffness_s * stiffness[(i, j)] + damping.mass_per_s * mass[(i, j)]
    });
    for (c, load) in problem.additional_damping(reduced.harmonic_model(0), damping) {
        let weights = [load.on_x, load.on_modes].concat();
        add_outer(&mut viscous, [0, 0], c, &weights, &weights);
    }
    [stiffness, mass, viscous]
}

/// Adds `factor` times a column times a row to the block that begins at `corner`.
pub(super) fn add_outer(
    to: &mut Mat<f64>,
    corner: [usize; 2],
    factor: f64,
    column: &[f64],
    row: &[f64],
) {
    for (j, r) in row.iter().enumerate().filter(|(_, r)| **r != 0.0) {
        for (i, c) in column.iter().enumerate() {
            to[(corner[0] + i, corner[1] + j)] += factor * c * r;
        }
    }
}
