//! Both bodies condensed together on the relative displacements of the pairs, for many pairs.
//!
//! The first body's flank moves by u_b = R^T X + u_j. With X = 0 the two meshes are one, of which the
//! flank is an interior surface; g are its unknowns (all of the second body's, the first body's without
//! its flank). On (g, X) the assembly is sparse, and
//!
//! ```text
//! g = Psi X + Phi q     Psi = -K_gg^-1 K_gx     Phi: modes of (K_gg, M_gg), all pairs stuck
//! ```
//!
//! is the Craig-Bampton reduction of the assembly with X for its interface. K and M on X are those of
//! [`relative`](super::relative), which gets them in two steps through dense matrices of both flanks:
//! condensing in one step or two is the same. The stuck modes are those of the whole assembly, without
//! the cut that the fixed-interface modes of each body make; only the lowest are kept, so the error of
//! the dynamic stiffness falls like (w / w_cut)^2.

use faer::{Mat, MatRef};
use nalgebra_sparse::CscMatrix;
use rayon::iter::ParallelIterator;
use rayon::slice::ParallelSlice;
use serde::{Deserialize, Serialize};

use super::relative::{Recovery, Way, loads_and_probes, stuck_error};
use super::{Load, ReducedModel, ReductionError, RelativeModel};
use crate::fem::Structure;
use crate::model::Model;
use dovetail_numerics::condense::condense;
use dovetail_numerics::eigen::lowest_modes;
use dovetail_numerics::factor::{Cholesky, FactorError, Symbolic};
use dovetail_numerics::sparse::{product, submatrix, times};
use dovetail_numerics::stored;

/// What gives the motion of the bodies back: one solve for each column.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Joined {
    numbering: Numbering,
    factor: Cholesky,
    /// K_gx
    #[serde(with = "stored::sparse_matrix")]
    coupling: CscMatrix<f64>,
    /// Phi
    #[serde(with = "stored::matrix")]
    modes: Mat<f64>,
    /// Centrifugal load on g, N.
    #[serde(with = "stored::numbers")]
    load_n: Vec<f64>,
}

/// The assembly on X with the `stuck_modes` lowest stuck modes.
///
/// # Errors
/// [`ReductionError::NotHeld`], [`ReductionError::Factor`], [`ReductionError::Stuck`],
/// [`ReductionError::FlankMismatch`], [`ReductionError::Size`].
pub(super) fn join(
    model: &Model,
    structure: &Structure,
    stuck_modes: usize,
) -> Result<ReducedModel, ReductionError> {
    let numbering = Numbering::new(model)?;
    for (body, matrices) in model.bodies.iter().zip(&structure.bodies) {
        super::craig_bampton::check_size(body, matrices)?;
    }
    let interior = 3 * numbering.interior_nodes;
    // Most of the mass stays a scalar times the identity per pair of nodes: two thirds are zeros.
    let bodies = structure.bodies.each_ref();
    let stiffness = numbering.assemble(bodies.map(|body| &body.stiffness), |_| true);
    let inner: Vec<usize> = (0..interior).collect();
    let outer: Vec<usize> = (interior..stiffness.ncols()).collect();
    let k_gg = submatrix(&stiffness, &inner, &inner);
    // The analysis keeps one thread busy.
    let (symbolic, (mass, k_gx, k_xg)) = rayon::join(
        || Symbolic::analyse(&k_gg),
        || {
            (
                numbering.assemble(bodies.map(|body| &body.mass), |v| v != 0.0),
                submatrix(&stiffness, &inner, &outer),
                submatrix(&stiffness, &outer, &inner),
            )
        },
    );
    let condensed = symbolic
        .and_then(|symbolic| condense(&stiffness, &mass, &k_gg, &symbolic))
        .map_err(|error| match error {
            FactorError::NotPositiveDefinite { .. } | FactorError::Singular { .. } => {
                ReductionError::NotHeld {
                    body: model.bodies[1].name.clone(),
                }
            }
            source => ReductionError::Factor {
                body: model.bodies[0].name.clone(),
                source,
            },
        })?;
    drop(stiffness);
    let factor = condensed.factor;
    let (m_gg, m_xg) = rayon::join(
        || submatrix(&mass, &inner, &inner),
        || submatrix(&mass, &outer, &inner),
    );
    drop(mass);
    let modes = lowest_modes(&k_gg, &m_gg, stuck_modes, &factor).map_err(stuck_error)?;
    drop(k_gg);
    // p = (M_xg + Psi^T M_gg) Phi with Psi^T = -K_xg K_gg^-1.
    let mut followed = times(&m_gg, modes.vectors.as_ref());
    factor.solve_in_place(followed.as_mut());
    let coupling = times(&m_xg, modes.vectors.as_ref()) - times(&k_xg, followed.as_ref());

    let project = |vectors: [&[f64]; 2]| -> Load {
        let (mut on_g, mut on_x) = numbering.gather(vectors);
        let column = MatRef::from_column_major_slice(&on_g, interior, 1);
        let on_modes = product(modes.vectors.transpose(), column);
        if on_g.iter().any(|f| *f != 0.0) {
            factor.solve_vector(&mut on_g);
            let column = MatRef::from_column_major_slice(&on_g, interior, 1);
            let carried = times(&k_xg, column);
            for (f, c) in on_x.iter_mut().zip(carried.col_as_slice(0)) {
                *f -= c;
            }
        }
        Load {
            on_x,
            on_modes: on_modes.col_as_slice(0).to_vec(),
        }
    };
    let nothing = || {
        structure
            .bodies
            .each_ref()
            .map(|b| vec![0.0; b.load_n.len()])
    };
    let add = |body: usize, node: u32, vector: [f64; 3], target: &mut [f64], _: &str| {
        for (free, weight) in model.bodies[body].dofs.weights(node as usize) {
            for (axis, v) in vector.iter().enumerate() {
                target[3 * free + axis] += weight * v;
            }
        }
        Ok(())
    };
    let (unit_loads, observations) = loads_and_probes(model, nothing, add, project)?;
    let given = structure.bodies.each_ref().map(|b| b.load_n.as_slice());
    let static_load = project(given);
    let load_n = numbering.gather(given).0;
    let relative = RelativeModel {
        stiffness: condensed.stiffness,
        mass: condensed.mass,
        coupling,
        omega2: modes.omega2,
        static_load,
        excitations: Vec::new(),
        observations,
        pairs: Vec::new(),
    };

    let joined = Joined {
        numbering,
        factor,
        coupling: k_gx,
        modes: modes.vectors,
        load_n,
    };
    Ok(ReducedModel {
        relative: relative.under(model, &unit_loads),
        unit_loads,
        all_stuck_modes: interior,
        fixed_interface_omega2: Vec::new(),
        recovery: Recovery {
            bodies: Vec::new(),
            way: Way::Joined(joined),
        },
    })
}

impl Joined {
    /// As [`Recovery::full_motion`](super::Recovery::full_motion).
    pub(super) fn motion(&self, x: MatRef<'_, f64>, modal: MatRef<'_, f64>) -> [Mat<f64>; 2] {
        let mut g = times(&self.coupling, x);
        self.factor.solve_in_place(g.as_mut());
        let g = product(self.modes.as_ref(), modal) - g;
        self.numbering.scatter(g.as_ref(), x)
    }

    /// As [`Recovery::full_static`](super::Recovery::full_static).
    pub(super) fn static_displacement(&self, x: &[f64]) -> [Vec<f64>; 2] {
        let x = MatRef::from_column_major_slice(x, x.len(), 1);
        let mut g = times(&self.coupling, x);
        for (g, f) in g.col_as_slice_mut(0).iter_mut().zip(&self.load_n) {
            *g = f - *g;
        }
        self.factor.solve_in_place(g.as_mut());
        self.numbering
            .scatter(g.as_ref(), x)
            .map(|u| u.col_as_slice(0).to_vec())
    }
}

/// Where the free nodes of the bodies stand in (g, X).
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Numbering {
    frames: Vec<[[f64; 3]; 3]>,
    /// Nodes of g; pair k is node `interior_nodes + k`.
    interior_nodes: usize,
    /// By body and free node.
    targets: [Vec<Target>; 2],
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
enum Target {
    /// The node itself.
    Node(usize),
    /// A flank node of the first body: the frame's transpose times X, and the second body's node
    /// where that moves.
    Pair { pair: usize, partner: Option<usize> },
}

type Block = [[f64; 3]; 3];

/// A body's node whose columns go to a node of (g, X), with the frame that takes them there.
type Source<'a> = (usize, usize, Option<&'a Block>);

/// Nodes that one task assembles, and tasks side by side.
const CHUNK: usize = 256;
const BATCH: usize = 16;

impl Numbering {
    fn new(model: &Model) -> Result<Self, ReductionError> {
        let pairs = model.pairs.len();
        let on_flank = pairs + model.bonded.len();
        let [first, second] = &model.bodies;
        for (b, body) in model.bodies.iter().enumerate() {
            let rigid = b == 1 && body.dofs.free_nodes() == 0;
            if body.dofs.flank_nodes != on_flank && !rigid {
                return Err(ReductionError::FlankMismatch {
                    body: body.name.clone(),
                    flank_nodes: body.dofs.flank_nodes,
                    pairs: on_flank,
                });
            }
        }
        let own = first.dofs.free_nodes() - on_flank;
        let second_nodes = second.dofs.free_nodes();
        let flank = first.dofs.interior_nodes..first.dofs.interior_nodes + on_flank;
        let targets = (0..first.dofs.free_nodes()).map(|node| {
            if node < flank.start {
                Target::Node(node)
            } else if node >= flank.end {
                Target::Node(node - on_flank)
            } else {
                let pair = node - flank.start;
                let partner = own + second.dofs.interior_nodes + pair;
                match pair < pairs {
                    true => Target::Pair {
                        pair,
                        partner: (second_nodes > 0).then_some(partner),
                    },
                    false => Target::Node(partner),
                }
            }
        });
        Ok(Self {
            frames: model.pairs.iter().map(|pair| pair.frame).collect(),
            interior_nodes: own + second_nodes,
            targets: [
                targets.collect(),
                (0..second_nodes).map(|n| Target::Node(own + n)).collect(),
            ],
        })
    }

    fn nodes(&self) -> usize {
        self.interior_nodes + self.frames.len()
    }

    /// Nodes of (g, X) with which a free node moves; for those of X the frame whose transpose takes
    /// them into global axes.
    fn parts(&self, body: usize, node: usize) -> impl Iterator<Item = (usize, Option<&Block>)> {
        let (own, other) = match self.targets[body][node] {
            Target::Node(node) => ((node, None), None),
            Target::Pair { pair, partner } => (
                (self.interior_nodes + pair, Some(&self.frames[pair])),
                partner,
            ),
        };
        std::iter::once(own).chain(other.map(|node| (node, None)))
    }

    /// Both bodies' matrices on (g, X), with the entries to keep.
    fn assemble(
        &self,
        matrices: [&CscMatrix<f64>; 2],
        keep: impl Fn(f64) -> bool + Sync,
    ) -> CscMatrix<f64> {
        let mut sources: Vec<Vec<Source>> = vec![Vec::new(); self.nodes()];
        for body in 0..2 {
            for node in 0..self.targets[body].len() {
                for (into, frame) in self.parts(body, node) {
                    sources[into].push((body, node, frame));
                }
            }
        }
        let (mut offsets, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for batch in sources.chunks(BATCH * CHUNK) {
            let parts: Vec<_> = batch
                .par_chunks(CHUNK)
                .map(|sources| {
                    let (mut ends, mut rows, mut values) = (Vec::new(), Vec::new(), Vec::new());
                    for sources in sources {
                        let blocks = self.column(matrices, sources);
                        for c in 0..3 {
                            for (row, block) in &blocks {
                                for (r, line) in block.iter().enumerate() {
                                    if keep(line[c]) {
                                        rows.push(3 * row + r);
                                        values.push(line[c]);
                                    }
                                }
                            }
                            ends.push(rows.len());
                        }
                    }
                    (ends, rows, values)
                })
                .collect();
            for (ends, own_rows, own_values) in parts {
                let before = rows.len();
                offsets.extend(ends.iter().map(|end| before + end));
                rows.extend_from_slice(&own_rows);
                values.extend_from_slice(&own_values);
            }
        }
        let n = 3 * self.nodes();
        CscMatrix::try_from_csc_data(n, n, offsets, rows, values)
            .expect("columns were built in order with ascending rows")
    }

    /// The blocks of one node's columns by rows, ascending.
    fn column(&self, matrices: [&CscMatrix<f64>; 2], sources: &[Source]) -> Vec<(usize, Block)> {
        let mut blocks = Vec::new();
        let mut lane: Vec<(usize, Block)> = Vec::new();
        for &(body, node, column_frame) in sources {
            lane.clear();
            for c in 0..3 {
                let column = matrices[body].col(3 * node + c);
                let mut at = 0;
                for (&i, &v) in column.row_indices().iter().zip(column.values()) {
                    while at < lane.len() && lane[at].0 < i / 3 {
                        at += 1;
                    }
                    if at == lane.len() || lane[at].0 != i / 3 {
                        lane.insert(at, (i / 3, [[0.0; 3]; 3]));
                    }
                    lane[at].1[i % 3][c] = v;
                }
            }
            for (row, block) in &lane {
                for (row, row_frame) in self.parts(body, *row) {
                    blocks.push((row, turned(block, row_frame, column_frame)));
                }
            }
        }
        // A stable sort: what is added to what does not change.
        blocks.sort_by_key(|(row, _)| *row);
        let mut merged: Vec<(usize, Block)> = Vec::with_capacity(blocks.len());
        for (row, block) in blocks {
            match merged.last_mut() {
                Some((last, sum)) if *last == row => {
                    for (sum, v) in sum.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
                        *sum += v;
                    }
                }
                _ => merged.push((row, block)),
            }
        }
        merged
    }

    /// A load on the free dofs of the bodies on g and on X.
    fn gather(&self, vectors: [&[f64]; 2]) -> (Vec<f64>, Vec<f64>) {
        let mut all = vec![0.0; 3 * self.nodes()];
        for (b, vector) in vectors.iter().enumerate() {
            for (node, f) in vector.chunks_exact(3).enumerate() {
                for (into, frame) in self.parts(b, node) {
                    for r in 0..3 {
                        all[3 * into + r] += match frame {
                            None => f[r],
                            Some(frame) => (0..3).map(|axis| frame[r][axis] * f[axis]).sum(),
                        };
                    }
                }
            }
        }
        let on_x = all.split_off(3 * self.interior_nodes);
        (all, on_x)
    }

    /// Displacements of the free dofs of the bodies.
    fn scatter(&self, g: MatRef<'_, f64>, x: MatRef<'_, f64>) -> [Mat<f64>; 2] {
        let first_of_x = 3 * self.interior_nodes;
        [0, 1].map(|b| {
            let mut all = Mat::zeros(3 * self.targets[b].len(), x.ncols());
            for j in 0..x.ncols() {
                for node in 0..self.targets[b].len() {
                    for (from, frame) in self.parts(b, node) {
                        for axis in 0..3 {
                            all[(3 * node + axis, j)] += match frame {
                                None => g[(3 * from + axis, j)],
                                Some(frame) => (0..3)
                                    .map(|r| frame[r][axis] * x[(3 * from - first_of_x + r, j)])
                                    .sum(),
                            };
                        }
                    }
                }
            }
            all
        })
    }
}

/// R_row A R_column^T, where there is a frame.
fn turned(a: &Block, row: Option<&Block>, column: Option<&Block>) -> Block {
    let mut a = *a;
    if let Some(frame) = row {
        a = [0, 1, 2].map(|r| [0, 1, 2].map(|c| (0..3).map(|k| frame[r][k] * a[k][c]).sum()));
    }
    if let Some(frame) = column {
        a = [0, 1, 2].map(|r| [0, 1, 2].map(|c| (0..3).map(|k| a[r][k] * frame[c][k]).sum()));
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reduction::lattice_model::assembly;
    use crate::reduction::{reduce, reduce_joined};

    fn close(a: &Mat<f64>, b: &Mat<f64>) {
        assert!((a - b).norm_max() < 1e-12 * b.norm_max());
    }

    #[test]
    fn one_step_or_two_give_the_same_condensed_matrices() {
        // Whatever modes are kept on either way.
        let (model, structure) = assembly([3, 2]);
        let apart = reduce(&model, &structure, None).unwrap().relative;
        let joined = reduce_joined(&model, &structure, 7).unwrap().relative;
        close(&joined.stiffness, &apart.stiffness);
        close(&joined.mass, &apart.mass);
        assert_eq!(joined.omega2.len(), 7);
        let load = |model: &RelativeModel| {
            let on_x = &model.static_load.on_x;
            Mat::from_fn(on_x.len(), 1, |i, _| on_x[i])
        };
        close(&load(&joined), &load(&apart));
        assert_eq!(joined.excitations.len(), apart.excitations.len());
    }

    #[test]
    fn its_stuck_modes_are_the_limit_of_more_and_more_fixed_interface_modes() {
        let (model, structure) = assembly([1000, 1000]);
        let apart = reduce(&model, &structure, None).unwrap();
        let joined = reduce_joined(&model, &structure, 1000).unwrap();
        assert_eq!(joined.all_stuck_modes, apart.all_stuck_modes);
        for (a, b) in joined.relative.omega2.iter().zip(&apart.relative.omega2) {
            assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn what_was_written_and_read_back_gives_the_same_bits() {
        let (model, structure) = assembly([5, 7]);
        for reduced in [
            reduce(&model, &structure, Some(9)).unwrap(),
            reduce_joined(&model, &structure, 9).unwrap(),
        ] {
            let bytes = postcard::to_stdvec(&(&reduced.relative, &reduced.unit_loads)).unwrap();
            let (relative, unit_loads): (RelativeModel, Vec<Load>) =
                postcard::from_bytes(&bytes).unwrap();
            let (relative, own) = (relative.under(&model, &unit_loads), &reduced.relative);
            assert_eq!(relative.stiffness, own.stiffness);
            assert_eq!(relative.coupling, own.coupling);
            assert_eq!(relative.excitations, own.excitations);
            assert_eq!(relative.observations, own.observations);
            assert_eq!(relative.pairs, own.pairs);
            let bytes = postcard::to_stdvec(&reduced.recovery).unwrap();
            let recovery: Recovery = postcard::from_bytes(&bytes).unwrap();
            let value = |i: usize, j: usize| (i as f64 - 3.0 * j as f64).sin();
            let (x, q) = (Mat::from_fn(15, 3, value), Mat::from_fn(9, 3, value));
            let motion = recovery.full_motion(x.as_ref(), q.as_ref());
            assert_eq!(motion, reduced.recovery.full_motion(x.as_ref(), q.as_ref()));
            let x = x.col_as_slice(1);
            assert_eq!(recovery.full_static(x), reduced.recovery.full_static(x));
        }
    }

    #[test]
    fn a_rigid_second_body_leaves_the_flanks_to_x_alone() {
        let (mut model, mut structure) = assembly([1000, 0]);
        model.excitations.retain(|force| force.terms[0].0 == 0);
        model.observations.truncate(1);
        let dofs = &mut model.bodies[1].dofs;
        dofs.nodes.fill(crate::model::NodeMotion::Fixed);
        (dofs.interior_nodes, dofs.flank_nodes, dofs.probe_nodes) = (0, 0, 0);
        let rigid = &mut structure.bodies[1];
        rigid.stiffness = CscMatrix::zeros(0, 0);
        rigid.mass = rigid.stiffness.clone();
        rigid.load_n.clear();
        let apart = reduce(&model, &structure, None).unwrap().relative;
        let joined = reduce_joined(&model, &structure, 5).unwrap();
        close(&joined.relative.stiffness, &apart.stiffness);
        close(&joined.relative.mass, &apart.mass);
        let [first, second] = joined.recovery.full_static(&[0.0; 15]);
        assert_eq!(
            (first.len(), second.len()),
            (structure.bodies[0].load_n.len(), 0)
        );
    }

    #[test]
    fn bodies_that_nothing_holds_are_an_error() {
        let (model, mut structure) = assembly([0, 0]);
        // The block without its support: rows and columns sum to nothing.
        let k = &mut structure.bodies[1].stiffness;
        let n = k.ncols();
        let mut sums = vec![0.0; n];
        for (i, j, v) in k.triplet_iter() {
            if i % 3 == j % 3 {
                sums[i] += v;
            }
        }
        for (i, j, v) in k.triplet_iter_mut() {
            if i == j {
                *v -= sums[i];
            }
        }
        let held = reduce_joined(&model, &structure, 3);
        assert!(
            matches!(held, Err(ReductionError::NotHeld { .. })),
            "{held:?}"
        );
    }
}
