//! Spring-mass lattices: small solids with three unknowns per node, for tests.

use nalgebra_sparse::{CooMatrix, CscMatrix};

/// A box of nodes, each tied to its neighbours (diagonal ones too) by springs with mass.
pub struct Lattice {
    pub shape: [usize; 3],
    /// Stiffness of a spring along its axis; 0.3 of it across.
    pub stiffness: f64,
    /// Mass of a spring, spread as in a linear bar.
    pub mass: f64,
    /// 0: all springs alike, so that modes repeat; more: each spring its own stiffness.
    pub irregularity: f64,
}

impl Lattice {
    /// Lattice of `shape` nodes, with the stiffness and the mass of a spring, and how much the
    /// springs differ.
    pub const fn new(shape: [usize; 3], stiffness: f64, mass: f64, irregularity: f64) -> Self {
        Self {
            shape,
            stiffness,
            mass,
            irregularity,
        }
    }

    pub fn nodes(&self) -> usize {
        self.shape.iter().product()
    }

    pub fn node(&self, at: [usize; 3]) -> usize {
        (at[0] * self.shape[1] + at[1]) * self.shape[2] + at[2]
    }

    /// Stiffness and mass on `free` unknown nodes: node `i` of the lattice is number `number[i]`,
    /// or held. Both matrices have the same pattern of entries.
    pub fn matrices(
        &self,
        number: &[Option<usize>],
        free: usize,
    ) -> (CscMatrix<f64>, CscMatrix<f64>) {
        let mut k = CooMatrix::new(3 * free, 3 * free);
        let mut m = CooMatrix::new(3 * free, 3 * free);
        let [a, b, c] = self.shape;
        let positions =
            (0..a).flat_map(|i| (0..b).flat_map(move |j| (0..c).map(move |l| [i, j, l])));
        let mut count = 0;
        for from in positions {
            for step in (0..27)
                .map(|s| [s / 9, s / 3 % 3, s % 3])
                .filter(|s| *s > [1, 1, 1])
            {
                let to = [0, 1, 2].map(|d| (from[d] + step[d]).wrapping_sub(1));
                if (0..3).any(|d| to[d] >= self.shape[d]) {
                    continue;
                }
                count += 1;
                let axis = [0, 1, 2].map(|d| step[d] as f64 - 1.0);
                let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
                let axis = axis.map(|x| x / length);
                let stiffness = 1.0 + self.irregularity * (count as f64 * 1.618).sin();
                let ends = [number[self.node(from)], number[self.node(to)]];
                for (p, &row) in ends.iter().enumerate() {
                    for (q, &column) in ends.iter().enumerate() {
                        let (Some(row), Some(column)) = (row, column) else {
                            continue;
                        };
                        for i in 0..3 {
                            for j in 0..3 {
                                let same = if i == j { 1.0 } else { 0.0 };
                                let along = 0.3 * same + 0.7 * axis[i] * axis[j];
                                let sign = if p == q { 1.0 } else { -1.0 };
                                let share = if p == q { 1.0 / 3.0 } else { 1.0 / 6.0 };
                                let (row, column) = (3 * row + i, 3 * column + j);
                                k.push(row, column, sign * along * stiffness * self.stiffness);
                                m.push(row, column, share * same * self.mass);
                            }
                        }
                    }
                }
            }
        }
        (CscMatrix::from(&k), CscMatrix::from(&m))
    }

    /// Stiffness and mass with the face `x = 0` held, free nodes in the order of the lattice.
    pub fn cantilever(&self) -> (CscMatrix<f64>, CscMatrix<f64>) {
        let held = self.shape[1] * self.shape[2];
        let number: Vec<_> = (0..self.nodes()).map(|n| n.checked_sub(held)).collect();
        self.matrices(&number, self.nodes() - held)
    }
}

/// Deterministic numbers between -1 and 1.
pub fn scattered(seed: usize) -> f64 {
    let x = (seed as f64 * 12.9898 + 0.7).sin() * 43758.5453;
    2.0 * (x - x.floor()) - 1.0
}
