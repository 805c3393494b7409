//! Assembly of element matrices to sparse matrices on the free degrees of freedom of a body.
//!
//! The node graph (which free nodes share an element, ties included) is built once per body and
//! shared by stiffness, mass and geometric stiffness. Only the lower blocks, row node >= column
//! node, are summed; the rest is their mirror, so that the matrices are symmetric to the last bit.
//! Every sum runs over the elements in ascending order whatever the number of threads: each thread
//! has a range of columns of its own.

use std::ops::Range;

use nalgebra_sparse::CscMatrix;
use nalgebra_sparse::pattern::SparsityPattern;
use rayon::prelude::*;

use super::springs::SpringElement;
use crate::model::Body;

/// Free nodes that share an element or a spring with each free node, itself included, ascending.
#[derive(Debug, Clone)]
pub(crate) struct NodePattern {
    /// Start of each node's neighbours; one more entry than nodes.
    offsets: Vec<usize>,
    neighbours: Vec<u32>,
    /// Index of the first lower block (neighbour >= node) of each node among all lower blocks.
    lower_offsets: Vec<usize>,
    /// Lower block that each upper block mirrors, in their order.
    mirrored: Vec<u32>,
}

/// Value of `W` numbers for each lower block of a [`NodePattern`] (9: row by row; 1: times the
/// identity).
pub(crate) type LowerBlocks<const W: usize> = Vec<[f64; W]>;

impl NodePattern {
    /// Pattern of the body's free nodes.
    pub(crate) fn new(body: &Body, springs: &[SpringElement]) -> Self {
        let nodes = body.dofs.free_nodes();
        let (first, elements) = elements_of_nodes(body, springs, nodes);
        let lists: Vec<Vec<u32>> = (0..nodes)
            .into_par_iter()
            .with_min_len(4096)
            .map_init(
                || vec![u32::MAX; nodes],
                |seen, node| {
                    let mut list = Vec::with_capacity(32);
                    for &e in &elements[first[node]..first[node + 1]] {
                        for &local in nodes_of(body, springs, e as usize) {
                            for (free, _) in body.dofs.weights(local as usize) {
                                if seen[free] != node as u32 {
                                    seen[free] = node as u32;
                                    list.push(free as u32);
                                }
                            }
                        }
                    }
                    list.sort_unstable();
                    list
                },
            )
            .collect();
        let mut pattern = Self {
            offsets: vec![0],
            neighbours: lists.concat(),
            lower_offsets: vec![0],
            mirrored: Vec::new(),
        };
        let mut upper_offsets = vec![0];
        for (node, list) in lists.iter().enumerate() {
            let upper = list.partition_point(|&n| (n as usize) < node);
            pattern.offsets.push(pattern.offsets[node] + list.len());
            pattern
                .lower_offsets
                .push(pattern.lower_offsets[node] + list.len() - upper);
            upper_offsets.push(upper_offsets[node] + upper);
        }
        // Columns ascend, so that the upper blocks of each column come in the order of their rows.
        let mut mirrored = vec![0; upper_offsets[nodes]];
        for node in 0..nodes {
            for (slot, &row) in pattern.lower(node).iter().enumerate() {
                if row as usize > node {
                    let next = &mut upper_offsets[row as usize];
                    mirrored[*next] = (pattern.lower_offsets[node] + slot) as u32;
                    *next += 1;
                }
            }
        }
        pattern.mirrored = mirrored;
        pattern
    }

    /// Number of free nodes.
    pub(crate) fn nodes(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Free nodes in no element: their rows would be empty.
    pub(crate) fn isolated(&self) -> Vec<usize> {
        (0..self.nodes())
            .filter(|&n| self.offsets[n] == self.offsets[n + 1])
            .collect()
    }

    /// All neighbours of a node, ascending.
    fn neighbours(&self, node: usize) -> &[u32] {
        &self.neighbours[self.offsets[node]..self.offsets[node + 1]]
    }

    /// Lower block of a neighbour of `node`, and whether the block wanted is its mirror.
    fn block(&self, node: usize, slot: usize) -> (usize, bool) {
        let upper_first = self.offsets[node] - self.lower_offsets[node];
        let lower_count = self.lower_offsets[node + 1] - self.lower_offsets[node];
        let upper_count = self.neighbours(node).len() - lower_count;
        match slot.checked_sub(upper_count) {
            None => (self.mirrored[upper_first + slot] as usize, true),
            Some(below) => (self.lower_offsets[node] + below, false),
        }
    }

    /// Neighbours >= `node`, ascending.
    fn lower(&self, node: usize) -> &[u32] {
        let count = self.lower_offsets[node + 1] - self.lower_offsets[node];
        &self.neighbours[self.offsets[node + 1] - count..self.offsets[node + 1]]
    }
}

/// Sums an element matrix, written by `element(e, matrix)`, on the pattern. Ties spread the rows
/// and columns of tied nodes. The matrix has `W` numbers for each pair of nodes of the element.
pub(crate) fn sum_elements<const W: usize>(
    body: &Body,
    pattern: &NodePattern,
    element: impl Fn(usize, &mut [[f64; W]]) + Sync,
) -> LowerBlocks<W> {
    const CHUNK: usize = 512;
    let mut sums = vec![[0.0; W]; pattern.lower_offsets[pattern.nodes()]];
    let ranges = column_ranges(pattern, rayon::current_num_threads());
    let blocks = |columns: &Range<usize>| {
        pattern.lower_offsets[columns.end] - pattern.lower_offsets[columns.start]
    };
    let count = body.elements.len();
    let mut buffer = Vec::new();
    for first in (0..count).step_by(CHUNK) {
        let chunk = first..count.min(first + CHUNK);
        let sizes = chunk
            .clone()
            .map(|e| body.elements.element_nodes(e).len().pow(2));
        buffer.resize(sizes.clone().sum(), [0.0; W]);
        let mut matrices = split(&mut buffer, sizes);
        matrices
            .par_iter_mut()
            .enumerate()
            .for_each(|(k, out)| element(first + k, out));
        let matrices = &*matrices;
        split(&mut sums, ranges.iter().map(blocks))
            .into_par_iter()
            .zip(&ranges)
            .for_each(|(owned, columns)| {
                let base = pattern.lower_offsets[columns.start];
                for (k, matrix) in matrices.iter().enumerate() {
                    let nodes = body.elements.element_nodes(first + k);
                    scatter::<W>(body, pattern, nodes, matrix, columns, base, owned);
                }
            });
    }
    sums
}

/// Splits a slice into consecutive parts of these sizes.
fn split<T>(mut all: &mut [T], sizes: impl Iterator<Item = usize>) -> Vec<&mut [T]> {
    sizes
        .map(|size| {
            let (part, rest) = std::mem::take(&mut all).split_at_mut(size);
            all = rest;
            part
        })
        .collect()
}

/// Adds the stiffness of springs.
pub(crate) fn add_springs(
    body: &Body,
    pattern: &NodePattern,
    springs: &[SpringElement],
    stiffness: &mut LowerBlocks<9>,
) {
    let columns = 0..pattern.nodes();
    for SpringElement { nodes, matrix } in springs {
        scatter::<9>(body, pattern, nodes, matrix, &columns, 0, stiffness);
    }
}

fn scatter<const W: usize>(
    body: &Body,
    pattern: &NodePattern,
    nodes: &[u32],
    matrix: &[[f64; W]],
    columns: &Range<usize>,
    base: usize,
    owned: &mut [[f64; W]],
) {
    for (b, &node_b) in nodes.iter().enumerate() {
        for (column, weight_b) in body.dofs.weights(node_b as usize) {
            if !columns.contains(&column) {
                continue;
            }
            let lower = pattern.lower(column);
            let start = pattern.lower_offsets[column] - base;
            for (a, &node_a) in nodes.iter().enumerate() {
                for (row, weight_a) in body.dofs.weights(node_a as usize) {
                    // Rows above the diagonal are not in the list, by its definition.
                    if let Ok(slot) = lower.binary_search(&(row as u32)) {
                        let weight = weight_a * weight_b;
                        let value = &matrix[a * nodes.len() + b];
                        for (sum, v) in owned[start + slot].iter_mut().zip(value) {
                            *sum += weight * v;
                        }
                    }
                }
            }
        }
    }
}

/// Whole symmetric matrix of lower blocks (3 x 3) that are stored row by row.
pub(crate) fn symmetric_matrix(pattern: &NodePattern, lower: &LowerBlocks<9>) -> CscMatrix<f64> {
    let size = 9 * pattern.neighbours.len();
    let (mut values, mut rows) = (vec![0.0; size], vec![0; size]);
    let mut offsets = Vec::with_capacity(3 * pattern.nodes() + 1);
    for node in 0..pattern.nodes() {
        let column = 3 * pattern.neighbours(node).len();
        offsets.extend((0..3).map(|c| 9 * pattern.offsets[node] + c * column));
    }
    offsets.push(size);
    fill(pattern, lower, &mut values, Some(&mut rows));
    matrix(pattern, offsets, rows, values)
}

/// Writes the values of [`symmetric_matrix`] for other lower blocks on the same pattern.
pub(crate) fn renew(matrix: &mut CscMatrix<f64>, pattern: &NodePattern, lower: &LowerBlocks<9>) {
    fill(pattern, lower, matrix.values_mut(), None);
}

/// Whole symmetric matrix of lower blocks that are multiples of the identity: one entry per block
/// and column.
pub(crate) fn symmetric_matrix_of_scalars(
    pattern: &NodePattern,
    lower: &LowerBlocks<1>,
) -> CscMatrix<f64> {
    let size = 3 * pattern.neighbours.len();
    let mut offsets = Vec::with_capacity(3 * pattern.nodes() + 1);
    let (mut rows, mut values) = (Vec::with_capacity(size), Vec::with_capacity(size));
    offsets.push(0);
    for node in 0..pattern.nodes() {
        for c in 0..3 {
            for (slot, &neighbour) in pattern.neighbours(node).iter().enumerate() {
                rows.push(3 * neighbour as usize + c);
                values.push(lower[pattern.block(node, slot).0][0]);
            }
            offsets.push(rows.len());
        }
    }
    matrix(pattern, offsets, rows, values)
}

fn matrix(
    pattern: &NodePattern,
    offsets: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
) -> CscMatrix<f64> {
    let n = 3 * pattern.nodes();
    let pattern = SparsityPattern::try_from_offsets_and_indices(n, n, offsets, rows)
        .expect("columns were built in order with ascending rows");
    CscMatrix::try_from_pattern_and_values(pattern, values)
        .expect("one value was built for each row index")
}

/// Writes the values and, if asked, the row indices of the whole matrix, column after column.
fn fill(
    pattern: &NodePattern,
    lower: &LowerBlocks<9>,
    values: &mut [f64],
    rows: Option<&mut [usize]>,
) {
    let sizes = (0..pattern.nodes()).map(|node| 9 * pattern.neighbours(node).len());
    let own_rows = match rows {
        Some(rows) => split(rows, sizes.clone()),
        None => sizes.clone().map(|_| &mut [] as &mut [usize]).collect(),
    };
    split(values, sizes)
        .into_par_iter()
        .zip(own_rows)
        .enumerate()
        .for_each(|(node, (values, rows))| {
            let neighbours = pattern.neighbours(node);
            for (slot, &neighbour) in neighbours.iter().enumerate() {
                let (block, mirrored) = pattern.block(node, slot);
                for c in 0..3 {
                    for r in 0..3 {
                        let at = 3 * (c * neighbours.len() + slot) + r;
                        if let Some(row) = rows.get_mut(at) {
                            *row = 3 * neighbour as usize + r;
                        }
                        // A diagonal block mirrors its own lower half.
                        let turned = mirrored || (neighbour as usize == node && r < c);
                        values[at] = lower[block][if turned { 3 * c + r } else { 3 * r + c }];
                    }
                }
            }
        });
}

/// Nodes of an element, or of a spring; springs are numbered after the elements.
fn nodes_of<'a>(body: &'a Body, springs: &'a [SpringElement], e: usize) -> &'a [u32] {
    match e.checked_sub(body.elements.len()) {
        None => body.elements.element_nodes(e),
        Some(spring) => &springs[spring].nodes,
    }
}

/// Elements and springs of each free node, ascending: start of each node's list, and the lists.
fn elements_of_nodes(
    body: &Body,
    springs: &[SpringElement],
    nodes: usize,
) -> (Vec<usize>, Vec<u32>) {
    let mut first = vec![0; nodes + 1];
    let for_each = |mut visit: Box<dyn FnMut(usize, usize) + '_>| {
        for e in 0..body.elements.len() + springs.len() {
            for &local in nodes_of(body, springs, e) {
                for (free, _) in body.dofs.weights(local as usize) {
                    visit(e, free);
                }
            }
        }
    };
    for_each(Box::new(|_, free| first[free + 1] += 1));
    for n in 0..nodes {
        first[n + 1] += first[n];
    }
    let mut next = first.clone();
    let mut elements = vec![0; first[nodes]];
    for_each(Box::new(|e, free| {
        elements[next[free]] = e as u32;
        next[free] += 1;
    }));
    (first, elements)
}

/// Consecutive column ranges of about equal numbers of blocks.
fn column_ranges(pattern: &NodePattern, count: usize) -> Vec<Range<usize>> {
    let total = pattern.lower_offsets[pattern.nodes()];
    let cut = |k: usize| {
        pattern
            .lower_offsets
            .partition_point(|&o| o < total * k / count)
    };
    (0..count).map(|k| cut(k)..cut(k + 1)).collect()
}
