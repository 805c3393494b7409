//! Expression of the coordinates of all bodies by those that remain when contacts join them.
//!
//! Each contact makes a node s of one of its flanks a *slave*. With the frame R of the pair and the
//! nodes k of the other flank, its masters, of weights w_k (one of weight 1 where the nodes of both
//! flanks coincide, none on rigid ground),
//!
//! ```text
//! u_s = R^T X + sum_k w_k u_k          X: relative displacements of the pair, n, t1, t2
//! ```
//!
//! where s is on the first flank, and with -R^T where it is on the second, because X counts from
//! the second to the first. A bonded node has the same row without X. The coordinates that are no
//! slaves are g. So u = T (g, X) with a sparse T, and the assembly has the matrices T^T K T and T^T
//! M T.
//!
//! Where the masters belong to another sector of a disc, their displacements are turned to the axes
//! of the slave's sector first; all sectors move in phase ([`super::sectors`] has the others).
//!
//! A master that is the slave of another contact is replaced by its own row. Along an axis on which
//! a support holds it, a master adds nothing, and a slave moves with its X alone, on which no force
//! acts.

use std::borrow::Cow;
use std::collections::BTreeMap;

use faer::{Mat, MatRef};
use nalgebra_sparse::{CooMatrix, CscMatrix};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde::{Deserialize, Serialize};

use super::ReductionError;
use crate::structure::{BodyMatrices, InterfaceNode, Joint};
use dovetail_numerics::sparse::{stored, times};

/// Number of columns that one task assembles.
const CHUNK: usize = 1024;

/// Rows and columns of a 3 x 3 block.
type NodeBlock = [[f64; 3]; 3];

const IDENTITY: NodeBlock = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const AXES: [usize; 3] = [0, 1, 2];

/// Product of two blocks.
fn times_block(a: &NodeBlock, b: &NodeBlock) -> NodeBlock {
    let entry = |i: usize, j: usize| AXES.iter().map(|&k| a[i][k] * b[k][j]).sum();
    AXES.map(|i| AXES.map(|j| entry(i, j)))
}

/// Matrix T of `u = T (g, X)`.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Transformation {
    /// T^T, with one column for each coordinate of the bodies, body after body.
    #[serde(with = "stored::sparse_matrix")]
    transposed: CscMatrix<f64>,
    /// First coordinate of each body, then the number of all coordinates.
    starts: Vec<usize>,
    /// Number of unknowns in g; X follows.
    inner: usize,
}

/// Motion that a slave node follows.
struct TransformationRow {
    /// Pair, and the matrix that turns its relative displacements.
    pair: Option<(usize, NodeBlock)>,
    /// First coordinates of the masters, and what their displacements are multiplied by.
    masters: Vec<(usize, NodeBlock)>,
}

impl Transformation {
    /// Transformation of bodies with their joints. `sizes` are the numbers of coordinates of the
    /// bodies, and `first_coordinate` gives the first of the three that are the displacement of a node
    /// of an interface.
    ///
    /// # Errors
    /// [`ReductionError::SlaveTwice`] where a node is a slave of two contacts,
    /// [`ReductionError::Circle`] where slaves are each other's masters,
    /// [`ReductionError::NotOfInterface`].
    pub(super) fn new(
        bodies: &[BodyMatrices],
        joints: &[Joint],
        sizes: &[usize],
        first_coordinate: impl Fn(InterfaceNode) -> Option<usize>,
    ) -> Result<Self, ReductionError> {
        let mut starts = vec![0];
        for size in sizes {
            starts.push(starts[starts.len() - 1] + size);
        }
        let named = |at: InterfaceNode| {
            let body = &bodies[at.body];
            (body.name.clone(), body.node_tag(at.node))
        };
        let at = |node: InterfaceNode| {
            let coordinate = first_coordinate(node).ok_or_else(|| {
                let (body, node) = named(node);
                ReductionError::NotOfInterface { body, node }
            })?;
            Ok(starts[node.body] + coordinate)
        };
        let held = |at: InterfaceNode| bodies[at.body].held_axes(at.node);
        let mut slaves: BTreeMap<usize, TransformationRow> = BTreeMap::new();
        let mut pairs = 0;
        for joint in joints {
            let still = held(joint.slave);
            let mut masters = Vec::with_capacity(joint.masters.len());
            let turn = joint.across.map_or(IDENTITY, |sector| sector.turn);
            for &(master, weight) in &joint.masters {
                let held_axes = held(master);
                let entry = |i: usize, j: usize| match still[i] || held_axes[j] {
                    true => 0.0,
                    false => weight * turn[i][j],
                };
                masters.push((at(master)?, AXES.map(|i| AXES.map(|j| entry(i, j)))));
            }
            let pair = joint.turned.map(|turned| (pairs, turned));
            pairs += usize::from(pair.is_some());
            let row = TransformationRow { pair, masters };
            if slaves.insert(at(joint.slave)?, row).is_some() {
                let (body, node) = named(joint.slave);
                return Err(ReductionError::SlaveTwice { body, node });
            }
        }
        let count = starts[sizes.len()];
        let mut place = vec![None; count];
        let mut inner = 0;
        let mut coordinate = 0;
        while coordinate < count {
            if slaves.contains_key(&coordinate) {
                coordinate += 3;
                continue;
            }
            place[coordinate] = Some(inner);
            inner += 1;
            coordinate += 1;
        }
        let mut t = CooMatrix::new(inner + 3 * pairs, count);
        for (coordinate, place) in place.iter().enumerate() {
            if let Some(place) = place {
                t.push(*place, coordinate, 1.0);
            }
        }
        for &slave in slaves.keys() {
            let mut blocks = BTreeMap::new();
            let depth = slaves.len();
            if !expand(slave, IDENTITY, &slaves, &place, inner, depth, &mut blocks) {
                return Err(ReductionError::Circle);
            }
            for (column, block) in blocks {
                for (row, line) in block.iter().enumerate() {
                    for (axis, v) in line.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                        t.push(column + axis, slave + row, *v);
                    }
                }
            }
        }
        Ok(Self {
            transposed: CscMatrix::from(&t),
            starts,
            inner,
        })
    }

    /// Number of unknowns in g.
    pub(crate) fn inner(&self) -> usize {
        self.inner
    }

    /// Number of unknowns in (g, X).
    pub(crate) fn unknowns(&self) -> usize {
        self.transposed.nrows()
    }

    /// Body and coordinate of an unknown of g.
    pub(crate) fn origin(&self, unknown: usize) -> Option<(usize, usize)> {
        let coordinate = self
            .transposed
            .col_iter()
            .position(|column| column.row_indices() == [unknown] && column.values() == [1.0])?;
        let body = self.starts.partition_point(|&start| start <= coordinate) - 1;
        Some((body, coordinate - self.starts[body]))
    }

    /// Computes T^T A T, with A the block diagonal of the bodies' symmetric matrices, of which both
    /// triangles are stored. Entries that come out as zero are left out where `zeros` says so.
    pub(crate) fn congruent(
        &self,
        matrices: &[Cow<'_, CscMatrix<f64>>],
        zeros: Zeros,
    ) -> CscMatrix<f64> {
        let n = self.unknowns();
        let t = self.transposed.transpose();
        let columns: Vec<usize> = (0..n).collect();
        let chunks: Vec<&[usize]> = columns.chunks(CHUNK).collect();
        let parts: Vec<_> = chunks
            .par_iter()
            .map_init(
                || (vec![0.0; n], vec![false; n]),
                |(sums, met), chunk| {
                    let (mut ends, mut rows, mut values) = (Vec::new(), Vec::new(), Vec::new());
                    for &column in *chunk {
                        let before = rows.len();
                        self.add_column(matrices, t.col(column), sums, met, &mut rows);
                        rows[before..].sort_unstable();
                        let mut kept = before;
                        for at in before..rows.len() {
                            let row = rows[at];
                            let value = std::mem::take(&mut sums[row]);
                            met[row] = false;
                            if value != 0.0 || zeros == Zeros::Kept {
                                rows[kept] = row;
                                values.push(value);
                                kept += 1;
                            }
                        }
                        rows.truncate(kept);
                        ends.push(kept);
                    }
                    (ends, rows, values)
                },
            )
            .collect();
        let mut offsets = Vec::with_capacity(n + 1);
        offsets.push(0);
        let mut entries = 0;
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        for (ends, own_rows, own_values) in parts {
            offsets.extend(ends.iter().map(|end| entries + end));
            entries += own_rows.len();
            rows.push(own_rows);
            values.push(own_values);
        }
        let (rows, values) = rayon::join(|| rows.concat(), || values.concat());
        CscMatrix::try_from_csc_data(n, n, offsets, rows, values)
            .expect("columns were built in order with ascending rows")
    }

    /// Adds T^T times A times a column of T to `sums`; rows that are reached first are added to
    /// `rows`.
    fn add_column(
        &self,
        matrices: &[Cow<'_, CscMatrix<f64>>],
        column: nalgebra_sparse::csc::CscCol<'_, f64>,
        sums: &mut [f64],
        met: &mut [bool],
        rows: &mut Vec<usize>,
    ) {
        for (&coordinate, &weight) in column.row_indices().iter().zip(column.values()) {
            let body = self.starts.partition_point(|&start| start <= coordinate) - 1;
            let start = self.starts[body];
            let entries = matrices[body].col(coordinate - start);
            for (&i, &v) in entries.row_indices().iter().zip(entries.values()) {
                let row = self.transposed.col(start + i);
                for (&into, &share) in row.row_indices().iter().zip(row.values()) {
                    if !std::mem::replace(&mut met[into], true) {
                        rows.push(into);
                    }
                    sums[into] += weight * share * v;
                }
            }
        }
    }

    /// Computes T^T f for loads f on the bodies' coordinates. Returns the parts on g and on X.
    pub(crate) fn gather(&self, loads: &[Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
        let mut values = vec![0.0; self.unknowns()];
        let columns = self.transposed.col_iter();
        for (column, f) in columns.zip(loads.iter().flatten()) {
            for (&row, t) in column.row_indices().iter().zip(column.values()) {
                values[row] += t * f;
            }
        }
        let on_x = values.split_off(self.inner);
        (values, on_x)
    }

    /// Coordinates of each body, one column per column of `g` and `x`.
    pub(crate) fn scatter(&self, g: MatRef<'_, f64>, x: MatRef<'_, f64>) -> Vec<Mat<f64>> {
        let mut values = Mat::zeros(self.unknowns(), g.ncols());
        values.get_mut(..self.inner, ..).copy_from(g);
        values.get_mut(self.inner.., ..).copy_from(x);
        let products = times(&self.transposed.transpose(), values.as_ref());
        let body = |range: &[usize]| products.get(range[0]..range[1], ..).to_owned();
        self.starts.windows(2).map(body).collect()
    }
}

/// Treatment of zero entries by [`Transformation::congruent`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Zeros {
    /// Zeros are stored, so that the pattern does not depend on the values.
    Kept,
    /// Zeros are not stored.
    LeftOut,
}

/// Adds the motion of the node at `coordinate`, multiplied by `factor`, to blocks by the first of
/// their three unknowns. Returns `false` if this does not end within as many steps as there are
/// slaves.
fn expand(
    coordinate: usize,
    factor: NodeBlock,
    slaves: &BTreeMap<usize, TransformationRow>,
    place: &[Option<usize>],
    inner: usize,
    steps_left: usize,
    blocks: &mut BTreeMap<usize, NodeBlock>,
) -> bool {
    let mut add = |column: usize, block: &NodeBlock| {
        let sum = blocks.entry(column).or_insert([[0.0; 3]; 3]);
        for (sum, line) in sum.iter_mut().zip(times_block(&factor, block)) {
            for (sum, v) in sum.iter_mut().zip(line) {
                *sum += v;
            }
        }
    };
    if let Some(own) = place[coordinate] {
        add(own, &IDENTITY);
        return true;
    }
    let Some(row) = slaves.get(&coordinate).filter(|_| steps_left > 0) else {
        return false;
    };
    if let Some((pair, block)) = &row.pair {
        add(inner + 3 * pair, block);
    }
    row.masters.iter().all(|(master, share)| {
        let factor = times_block(&factor, share);
        expand(
            *master,
            factor,
            slaves,
            place,
            inner,
            steps_left - 1,
            blocks,
        )
    })
}
