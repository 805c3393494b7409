//! Both reduced bodies on the relative displacements of the pairs.
//!
//! With R the frames of the pairs, X = R (u_b - u_j). The first body's flank moves by
//! u_b = R^T X + u_j; what remains of the assembly is r: the second body's flank (in the frames of
//! the pairs), the probe dofs and the modal amplitudes of both bodies. On (X, r)
//!
//! ```text
//! [ K_xx K_xr ] [ X ]   [ M_xx M_xr ] [ X ]''   [ lambda ]   [ f_x ]
//! [ K_rx K_rr ] [ r ] + [ M_rx M_rr ] [ r ]   + [   0    ] = [ f_r ]
//! ```
//!
//! (lambda acts on +X of the first body and on -X of the second: no force on r). With static
//! constraint modes Psi = -K_rr^-1 K_rx and the modes Phi of (K_rr, M_rr), which are those of the
//! assembly with X = 0, all pairs stuck, r = Psi X + Phi q gives
//!
//! ```text
//! K X + M X'' + p q'' + lambda = F         K = K_xx + K_xr Psi   F = f_x + Psi^T f_r
//! q'' + w^2 q + p^T X'' = Phi^T f_r        p = (M_xr + Psi^T M_rr) Phi
//! M = M_xx + M_xr Psi + Psi^T M_rx + Psi^T M_rr Psi
//! ```
//!
//! and, with Rayleigh damping a K + b M and q eliminated at the frequency w,
//! `Lambda X + lambda = F - sum_m c_m fm_m / d_m`, where
//! `Lambda = (1 + i w a) K - (w^2 - i w b) M - sum_m c_m c_m^T / d_m`,
//! `d_m = (1 + i w a) w_m^2 - (w^2 - i w b)`, `c_m = -(w^2 - i w b) p_m`, `q_m = (fm_m - c_m . X) / d_m`.
//! With all modes it equals the parallel form Z_j (Z_b + Z_j)^-1 Z_b of the two bodies' dynamic
//! stiffnesses at the flanks.

use faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use super::craig_bampton::ReducedBody;
use super::joined::Joined;
use super::{Load, Probe, ReducedModel, ReductionError, RelativeModel};
use crate::model::Model;
use dovetail_numerics::eigen::{EigenError, dense};
use dovetail_numerics::sparse::{product, symmetrised};
use dovetail_numerics::stored;

const GLOBAL: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The way back from (X, q) to the bodies.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Recovery {
    /// The bodies by Craig-Bampton; none where they were condensed together.
    pub bodies: Vec<ReducedBody>,
    pub(super) way: Way,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum Way {
    Bodies(Separate),
    Joined(Joined),
}

/// From (X, q) to the coordinates of the bodies.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Separate {
    frames: Vec<[[f64; 3]; 3]>,
    /// Psi, Phi on r.
    #[serde(with = "stored::matrix")]
    constraint: Mat<f64>,
    #[serde(with = "stored::matrix")]
    modes: Mat<f64>,
    /// K_rr^-1 f_r under the static load.
    #[serde(with = "stored::numbers")]
    static_rest: Vec<f64>,
}

/// Assembles the two bodies and keeps the `stuck_modes` lowest stuck modes (`None`: all, exact).
///
/// # Errors
/// [`ReductionError::NotHeld`] where the stuck assembly is not held or unstable,
/// [`ReductionError::FlankMismatch`], [`ReductionError::PointCondensed`], [`ReductionError::Stuck`].
pub fn relative(
    model: &Model,
    bodies: [ReducedBody; 2],
    stuck_modes: Option<usize>,
) -> Result<ReducedModel, ReductionError> {
    let layout = Layout::new(model, &bodies)?;
    // What is bonded moves with the other body in any frame.
    let bonded = std::iter::repeat_n(GLOBAL, model.bonded.len());
    let frames: Vec<_> = model
        .pairs
        .iter()
        .map(|pair| pair.frame)
        .chain(bonded)
        .collect();
    let assemble = |matrix: fn(&ReducedBody) -> &Mat<f64>| {
        let local =
            [0, 1].map(|b| in_frames(matrix(&bodies[b]).as_ref(), layout.flank(b), &frames));
        layout.assemble([local[0].as_ref(), local[1].as_ref()])
    };
    let (k, m) = (
        assemble(|body| &body.stiffness),
        assemble(|body| &body.mass),
    );
    let n = layout.pairs;
    let (k_xr, k_rr) = (k.get(..n, n..), k.get(n.., n..));
    let (m_xr, m_rr) = (m.get(..n, n..), m.get(n.., n..));
    let factor = dense::cholesky(k_rr).map_err(|_| ReductionError::NotHeld {
        body: model.bodies[1].name.clone(),
    })?;
    let mut constraint = Mat::from_fn(layout.rest(), n, |i, j| -k_xr[(j, i)]);
    dense::solve_in_place(factor.as_ref(), constraint.as_mut());
    let modes = dense::modes_of_factored(factor.as_ref(), m_rr).map_err(stuck_error)?;
    let all_stuck_modes = modes.count();
    let kept = stuck_modes.unwrap_or(all_stuck_modes).min(all_stuck_modes);
    let phi = modes.vectors.get(.., ..kept).to_owned();

    let stiffness = k.get(..n, ..n) + product(k_xr, constraint.as_ref());
    // M_xr + Psi^T M_rr
    let inertia = m_xr + product(constraint.transpose(), m_rr);
    let mass = m.get(..n, ..n)
        + product(inertia.as_ref(), constraint.as_ref())
        + product(constraint.transpose(), m_xr.transpose());
    let coupling = product(inertia.as_ref(), phi.as_ref());

    let project = |vectors: [&[f64]; 2]| -> Load {
        let (on_x, rest) = layout.load(vectors, &frames);
        let rest = MatRef::from_column_major_slice(&rest, rest.len(), 1);
        let carried = product(constraint.transpose(), rest);
        let on_modes = product(phi.transpose(), rest);
        Load {
            on_x: on_x
                .iter()
                .enumerate()
                .map(|(i, f)| f + carried[(i, 0)])
                .collect(),
            on_modes: on_modes.col_as_slice(0).to_vec(),
        }
    };
    let static_vectors = [bodies[0].load_n.as_slice(), bodies[1].load_n.as_slice()];
    let static_load = project(static_vectors);
    let mut static_rest = layout.load(static_vectors, &frames).1;
    let rows = static_rest.len();
    let column = faer::MatMut::from_column_major_slice_mut(&mut static_rest, rows, 1);
    dense::solve_in_place(factor.as_ref(), column);

    let nothing = || bodies.each_ref().map(|b| vec![0.0; b.coordinates()]);
    let add = |body: usize, node: u32, vector: [f64; 3], target: &mut [f64], what: &str| {
        add_at_node(model, body, node, vector, target, what)
    };
    let (unit_loads, observations) = loads_and_probes(model, nothing, add, project)?;
    let relative = RelativeModel {
        stiffness: symmetrised(stiffness.as_ref()),
        mass: symmetrised(mass.as_ref()),
        coupling,
        omega2: modes.omega2[..kept].to_vec(),
        static_load,
        excitations: Vec::new(),
        observations,
        pairs: Vec::new(),
    };
    Ok(ReducedModel {
        relative: relative.under(model, &unit_loads),
        unit_loads,
        all_stuck_modes,
        fixed_interface_omega2: bodies.iter().map(|b| b.omega2.clone()).collect(),
        recovery: Recovery {
            bodies: bodies.into(),
            way: Way::Bodies(Separate {
                frames,
                constraint,
                modes: phi,
                static_rest,
            }),
        },
    })
}

/// A unit of each excitation and the observed points of the model, built from `nothing` by `add` (body, node, vector,
/// target, what it is for) on coordinates of the bodies, then projected.
pub(super) fn loads_and_probes(
    model: &Model,
    nothing: impl Fn() -> [Vec<f64>; 2],
    add: impl Fn(usize, u32, [f64; 3], &mut [f64], &str) -> Result<(), ReductionError>,
    project: impl Fn([&[f64]; 2]) -> Load,
) -> Result<(Vec<Load>, Vec<Probe>), ReductionError> {
    let projected = |terms: &[(usize, u32, [f64; 3])], what: &str| {
        let mut vectors = nothing();
        for &(body, node, direction) in terms {
            add(body, node, direction, &mut vectors[body], what)?;
        }
        Ok(project([&vectors[0], &vectors[1]]))
    };
    let mut observations = Vec::with_capacity(model.observations.len());
    for observation in &model.observations {
        let Load { on_x, on_modes } = projected(&observation.terms, &observation.name)?;
        observations.push(Probe {
            name: observation.name.clone(),
            on_x,
            on_modes,
        });
    }
    let forces = model.excitations.iter();
    let unit_loads = forces.map(|force| projected(&force.terms, "an excitation"));
    Ok((unit_loads.collect::<Result<_, _>>()?, observations))
}

impl Recovery {
    /// Motion of all free dofs of each body, one column per column of `x` and `modal` (amplitudes of
    /// one harmonic, or instants), without the static load.
    pub fn full_motion(&self, x: MatRef<'_, f64>, modal: MatRef<'_, f64>) -> [Mat<f64>; 2] {
        match &self.way {
            Way::Bodies(way) => {
                let coordinates = way.expand(&self.bodies, x, modal);
                let motion = |b: usize| self.bodies[b].motion(coordinates[b].as_ref());
                let (first, second) = rayon::join(|| motion(0), || motion(1));
                [first, second]
            }
            Way::Joined(joined) => joined.motion(x, modal),
        }
    }

    /// Static displacement of all free dofs of each body, under the centrifugal load and the
    /// contact forces that go with the static `x`; exact, whatever the number of modes kept.
    pub fn full_static(&self, x: &[f64]) -> [Vec<f64>; 2] {
        let way = match &self.way {
            Way::Bodies(way) => way,
            Way::Joined(joined) => return joined.static_displacement(x),
        };
        let x = MatRef::from_column_major_slice(x, x.len(), 1);
        let mut rest = product(way.constraint.as_ref(), x);
        for (i, r) in way.static_rest.iter().enumerate() {
            rest[(i, 0)] += r;
        }
        let coordinates = way.in_bodies(&self.bodies, x, rest.as_ref());
        [0, 1].map(|b| {
            let body = &self.bodies[b];
            body.static_displacement(&coordinates[b].col_as_slice(0)[..body.kept()])
        })
    }
}

impl Separate {
    /// Coordinates of each body (flank dofs, probe dofs, modal amplitudes) for relative
    /// displacements `x` (3 pairs) and amplitudes `modal` of the stuck modes, column by column.
    fn expand(
        &self,
        bodies: &[ReducedBody],
        x: MatRef<'_, f64>,
        modal: MatRef<'_, f64>,
    ) -> [Mat<f64>; 2] {
        let rest = product(self.constraint.as_ref(), x) + product(self.modes.as_ref(), modal);
        self.in_bodies(bodies, x, rest.as_ref())
    }

    /// (X, r) -> coordinates of each body.
    fn in_bodies(
        &self,
        bodies: &[ReducedBody],
        x: MatRef<'_, f64>,
        rest: MatRef<'_, f64>,
    ) -> [Mat<f64>; 2] {
        let layout = Layout::of(x.nrows(), bodies);
        let columns = x.ncols();
        [0, 1].map(|b| {
            let flank = layout.flank(b);
            let mut all = Mat::zeros(bodies[b].coordinates(), columns);
            for j in 0..columns {
                let local = |i: usize| {
                    let second = if layout.flanks[1] > 0 {
                        rest[(i, j)]
                    } else {
                        0.0
                    };
                    if b == 0 && i < x.nrows() {
                        x[(i, j)] + second
                    } else {
                        second
                    }
                };
                for (pair, frame) in self.frames.iter().enumerate().take(flank / 3) {
                    for axis in 0..3 {
                        all[(3 * pair + axis, j)] = (0..3)
                            .map(|row| frame[row][axis] * local(3 * pair + row))
                            .sum();
                    }
                }
                for i in flank..bodies[b].coordinates() {
                    all[(i, j)] = rest[(layout.other(b) + i - flank, j)];
                }
            }
            all
        })
    }
}

/// Where the coordinates of the bodies stand in (X, r), r = (second flank, others of the first body,
/// others of the second).
struct Layout {
    /// 3 pairs
    pairs: usize,
    /// Dofs of the flank, those of bonded nodes included; of the second body 0 where it is rigid.
    flanks: [usize; 2],
    /// Probe dofs and modes of each body.
    others: [usize; 2],
}

impl Layout {
    fn new(model: &Model, bodies: &[ReducedBody; 2]) -> Result<Self, ReductionError> {
        let flank = model.pairs.len() + model.bonded.len();
        for (b, body) in bodies.iter().enumerate() {
            let rigid = b == 1 && body.coordinates() == 0;
            if body.flank_dofs != 3 * flank && !rigid {
                return Err(ReductionError::FlankMismatch {
                    body: model.bodies[b].name.clone(),
                    flank_nodes: body.flank_dofs / 3,
                    pairs: flank,
                });
            }
        }
        Ok(Self::of(3 * model.pairs.len(), bodies))
    }

    fn of(pairs: usize, bodies: &[ReducedBody]) -> Self {
        let others = [0, 1].map(|b: usize| bodies[b].coordinates() - bodies[b].flank_dofs);
        Self {
            pairs,
            flanks: [0, 1].map(|b: usize| bodies[b].flank_dofs),
            others,
        }
    }

    fn flank(&self, body: usize) -> usize {
        self.flanks[body]
    }

    fn rest(&self) -> usize {
        self.flanks[1] + self.others[0] + self.others[1]
    }

    /// Position in r of the other coordinates of a body.
    fn other(&self, body: usize) -> usize {
        self.flanks[1] + if body == 0 { 0 } else { self.others[0] }
    }

    /// Positions in (X, r) to which coordinate `i` of a body contributes: a flank dof of the first
    /// body moves with X and with the second body's flank, a bonded one with the latter alone.
    fn targets(&self, body: usize, i: usize) -> impl Iterator<Item = usize> + use<> {
        let flank = self.flank(body);
        let (a, b) = if i >= flank {
            (Some(self.pairs + self.other(body) + i - flank), None)
        } else if body == 0 {
            (
                (i < self.pairs).then_some(i),
                (self.flanks[1] > 0).then_some(self.pairs + i),
            )
        } else {
            (Some(self.pairs + i), None)
        };
        a.into_iter().chain(b)
    }

    /// Sum of both bodies' matrices (flanks already in the frames) on (X, r).
    fn assemble(&self, local: [MatRef<'_, f64>; 2]) -> Mat<f64> {
        let n = self.pairs + self.rest();
        let mut sum = Mat::zeros(n, n);
        for (body, matrix) in local.iter().enumerate() {
            for j in 0..matrix.ncols() {
                for column in self.targets(body, j) {
                    for i in 0..matrix.nrows() {
                        for row in self.targets(body, i) {
                            sum[(row, column)] += matrix[(i, j)];
                        }
                    }
                }
            }
        }
        sum
    }

    /// Loads on the coordinates of the bodies (flanks in global axes) -> loads on X and on r.
    fn load(&self, vectors: [&[f64]; 2], frames: &[[[f64; 3]; 3]]) -> (Vec<f64>, Vec<f64>) {
        let mut sum = vec![0.0; self.pairs + self.rest()];
        for (body, vector) in vectors.iter().enumerate() {
            let column = MatRef::from_column_major_slice(vector, vector.len(), 1);
            let local = rotated_rows(column, self.flank(body), frames);
            for i in 0..vector.len() {
                for row in self.targets(body, i) {
                    sum[row] += local[(i, 0)];
                }
            }
        }
        let rest = sum.split_off(self.pairs);
        (sum, rest)
    }
}

/// A body's matrix with its flank dofs in the frames of the pairs: Q A Q^T.
fn in_frames(a: MatRef<'_, f64>, flank: usize, frames: &[[[f64; 3]; 3]]) -> Mat<f64> {
    let half = rotated_rows(a, flank, frames);
    rotated_rows(half.transpose(), flank, frames)
}

/// Q A: the first `flank` rows, three by three, in the frames of the pairs.
fn rotated_rows(a: MatRef<'_, f64>, flank: usize, frames: &[[[f64; 3]; 3]]) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| {
        if i < flank {
            let (pair, row) = (i / 3, i % 3);
            (0..3)
                .map(|axis| frames[pair][row][axis] * a[(3 * pair + axis, j)])
                .sum()
        } else {
            a[(i, j)]
        }
    })
}

/// Adds a vector at a node of a body to the body's coordinates (kept, then modal).
fn add_at_node(
    model: &Model,
    body: usize,
    node: u32,
    vector: [f64; 3],
    target: &mut [f64],
    what: &str,
) -> Result<(), ReductionError> {
    let owner = &model.bodies[body];
    for (free, weight) in owner.dofs.weights(node as usize) {
        let kept = free.checked_sub(owner.dofs.interior_nodes).ok_or_else(|| {
            ReductionError::PointCondensed {
                what: what.to_owned(),
                body: owner.name.clone(),
                node: owner.node_tags[node as usize],
            }
        })?;
        for (axis, v) in vector.iter().enumerate() {
            target[3 * kept + axis] += weight * v;
        }
    }
    Ok(())
}

pub(super) fn stuck_error(source: EigenError) -> ReductionError {
    ReductionError::Stuck { source }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::Structure;
    use crate::reduction::lattice_model::assembly;
    use crate::reduction::{reduce, reduce_joined};
    use dovetail_numerics::sparse::dense as to_dense;
    use faer::c64;
    use faer::linalg::solvers::Solve;

    const A: f64 = 3e-7;
    const B: f64 = 40.0;
    const FREQUENCIES: [f64; 4] = [0.0, 2.3e3, 1.1e4, 4.7e4];

    fn dynamic_stiffness(k: &Mat<f64>, m: &Mat<f64>, w: f64) -> Mat<c64> {
        Mat::from_fn(k.nrows(), k.ncols(), |i, j| {
            c64::new(1.0, w * A) * k[(i, j)] - c64::new(w * w, -w * B) * m[(i, j)]
        })
    }

    /// Lambda(w) of method section 2b.
    fn lambda(model: &RelativeModel, w: f64) -> Mat<c64> {
        let mut z = dynamic_stiffness(&model.stiffness, &model.mass, w);
        let s = c64::new(w * w, -w * B);
        for (mode, &omega2) in model.omega2.iter().enumerate() {
            let d = c64::new(1.0, w * A) * omega2 - s;
            for j in 0..z.ncols() {
                for i in 0..z.nrows() {
                    let p = model.coupling[(i, mode)] * model.coupling[(j, mode)];
                    z[(i, j)] -= s * s * p / d;
                }
            }
        }
        z
    }

    fn complex(re: &[f64], im: &[f64]) -> Mat<c64> {
        Mat::from_fn(re.len(), 1, |i, _| c64::new(re[i], im[i]))
    }

    fn close(a: &Mat<c64>, b: &Mat<c64>, tolerance: f64) {
        let error = (a - b).norm_max() / b.norm_max();
        assert!(error < tolerance, "{error}");
    }

    #[test]
    fn lambda_is_the_parallel_form() {
        let (model, structure) = assembly([5, 7]);
        let reduced = reduce(&model, &structure, None).unwrap();
        assert_eq!(reduced.relative.omega2.len(), reduced.all_stuck_modes);
        let frames: Vec<_> = model.pairs.iter().map(|pair| pair.frame).collect();
        for w in FREQUENCIES {
            let z = [0, 1].map(|b| {
                let body = &reduced.recovery.bodies[b];
                let k = in_frames(body.stiffness.as_ref(), body.flank_dofs, &frames);
                let m = in_frames(body.mass.as_ref(), body.flank_dofs, &frames);
                let z = dynamic_stiffness(&k, &m, w);
                let n = body.flank_dofs;
                let rest = z.get(n.., n..).partial_piv_lu().solve(z.get(n.., ..n));
                z.get(..n, ..n) - z.get(..n, n..) * rest
            });
            let parallel = &z[1] * (&z[0] + &z[1]).partial_piv_lu().solve(&z[0]);
            close(&lambda(&reduced.relative, w), &parallel, 1e-9);
        }
    }

    /// Displacements of all free dofs of a body under given forces, from its full matrices.
    fn solved(structure: &Structure, body: usize, w: f64, forces: &Mat<c64>) -> Mat<c64> {
        let b = &structure.bodies[body];
        let z = dynamic_stiffness(&to_dense(&b.stiffness), &to_dense(&b.mass), w);
        z.partial_piv_lu().solve(forces)
    }

    /// Complex amplitudes of the forces of one harmonic on the free dofs (`cos - i sin`).
    fn forces(model: &Model, harmonic: usize) -> [Mat<c64>; 2] {
        let mut f = [0, 1].map(|b| Mat::zeros(3 * model.bodies[b].dofs.free_nodes(), 1));
        for force in model.excitations.iter().filter(|f| f.harmonic == harmonic) {
            let phase = c64::new(0.0, -force.phase_rad).exp();
            for &(body, node, direction) in &force.terms {
                for (free, weight) in model.bodies[body].dofs.weights(node as usize) {
                    for axis in 0..3 {
                        f[body][(3 * free + axis, 0)] +=
                            phase * weight * force.force_n * direction[axis];
                    }
                }
            }
        }
        f
    }

    #[test]
    fn forces_fields_and_observations_are_those_of_the_full_bodies() {
        // Pairs joined by given contact forces lambda: each body answers for itself.
        let (model, structure) = assembly([1000, 1000]);
        for reduced in [
            reduce(&model, &structure, None),
            reduce_joined(&model, &structure, 1000),
        ] {
            against_the_full_bodies(&model, &structure, &reduced.unwrap());
        }
    }

    fn against_the_full_bodies(model: &Model, structure: &Structure, reduced: &ReducedModel) {
        let n = 3 * model.pairs.len();
        let contact = Mat::from_fn(n, 1, |i, _| c64::new((i as f64).cos(), 0.3 * i as f64));
        for (harmonic, w) in [(1, 2.3e3), (3, 1.1e4)] {
            let load = reduced
                .relative
                .excitations
                .iter()
                .find(|e| e.harmonic == harmonic);
            let load = load.unwrap();
            let minus = |v: &[f64]| v.iter().map(|x| -x).collect::<Vec<_>>();
            let on_x = complex(&load.cosine.on_x, &minus(&load.sine.on_x));
            let on_modes = complex(&load.cosine.on_modes, &minus(&load.sine.on_modes));
            // Lambda X = F - sum c fm / d - lambda, q = (fm - c . X) / d.
            let s = c64::new(w * w, -w * B);
            let mut rhs = &on_x - &contact;
            let d: Vec<c64> = reduced
                .relative
                .omega2
                .iter()
                .map(|w2| c64::new(1.0, w * A) * w2 - s)
                .collect();
            let p = &reduced.relative.coupling;
            for (mode, d) in d.iter().enumerate() {
                for i in 0..n {
                    rhs[(i, 0)] += s * p[(i, mode)] * on_modes[(mode, 0)] / d;
                }
            }
            let x = lambda(&reduced.relative, w).partial_piv_lu().solve(&rhs);
            let q = Mat::from_fn(d.len(), 1, |mode, _| {
                let cx: c64 = (0..n).map(|i| -s * p[(i, mode)] * x[(i, 0)]).sum();
                (on_modes[(mode, 0)] - cx) / d[mode]
            });

            let mut f = forces(model, harmonic);
            for (pair, entry) in model.pairs.iter().enumerate() {
                for axis in 0..3 {
                    let force: c64 = (0..3)
                        .map(|row| contact[(3 * pair + row, 0)] * entry.frame[row][axis])
                        .sum();
                    for (b, sign) in [(0, -1.0), (1, 1.0)] {
                        let free = model.bodies[b].dofs.interior_nodes + pair;
                        f[b][(3 * free + axis, 0)] += sign * force;
                    }
                }
            }
            let exact = [0, 1].map(|b| solved(structure, b, w, &f[b]));
            // Real and imaginary parts as two columns.
            let parts = |a: &Mat<c64>| {
                Mat::from_fn(a.nrows(), 2, |i, j| {
                    if j == 0 { a[(i, 0)].re } else { a[(i, 0)].im }
                })
            };
            let motion = reduced
                .recovery
                .full_motion(parts(&x).as_ref(), parts(&q).as_ref());
            for b in 0..2 {
                let found = complex(motion[b].col_as_slice(0), motion[b].col_as_slice(1));
                close(&found, &exact[b], 1e-8);
            }
            for (probe, observation) in reduced
                .relative
                .observations
                .iter()
                .zip(&model.observations)
            {
                let dot = |row: &[f64], v: &Mat<c64>| -> c64 {
                    row.iter().enumerate().map(|(i, r)| v[(i, 0)] * r).sum()
                };
                let found = dot(&probe.on_x, &x) + dot(&probe.on_modes, &q);
                let mut expected = c64::new(0.0, 0.0);
                for &(b, node, direction) in &observation.terms {
                    for (free, weight) in model.bodies[b].dofs.weights(node as usize) {
                        for axis in 0..3 {
                            expected += exact[b][(3 * free + axis, 0)] * weight * direction[axis];
                        }
                    }
                }
                assert!(
                    (found - expected).norm() < 1e-8 * expected.norm(),
                    "{}",
                    probe.name
                );
            }
        }
    }

    #[test]
    fn statics_balance_the_full_bodies_whatever_the_modes_kept() {
        let (model, structure) = assembly([2, 3]);
        for reduced in [
            reduce(&model, &structure, Some(1)),
            reduce_joined(&model, &structure, 1),
        ] {
            balanced(&model, &structure, &reduced.unwrap());
        }
    }

    fn balanced(model: &Model, structure: &Structure, reduced: &ReducedModel) {
        let n = 3 * model.pairs.len();
        let x: Vec<f64> = (0..n).map(|i| 1e-6 * (1.0 + i as f64).sin()).collect();
        let column = Mat::from_fn(n, 1, |i, _| x[i]);
        let elastic = &reduced.relative.stiffness * &column;
        let u = reduced.recovery.full_static(&x);
        for (b, sign) in [(0, 1.0), (1, -1.0)] {
            let body = &structure.bodies[b];
            let displacement = Mat::from_fn(u[b].len(), 1, |i, _| u[b][i]);
            let mut residual = to_dense(&body.stiffness) * displacement;
            for (i, f) in body.load_n.iter().enumerate() {
                residual[(i, 0)] -= f;
            }
            for (pair, entry) in model.pairs.iter().enumerate() {
                for axis in 0..3 {
                    let force: f64 = (0..3)
                        .map(|row| {
                            let at = 3 * pair + row;
                            let lambda = reduced.relative.static_load.on_x[at] - elastic[(at, 0)];
                            entry.frame[row][axis] * lambda
                        })
                        .sum();
                    let free = model.bodies[b].dofs.interior_nodes + pair;
                    residual[(3 * free + axis, 0)] += sign * force;
                }
            }
            assert!(
                residual.norm_max() < 1e-8 * 100.0,
                "{b}: {}",
                residual.norm_max()
            );
        }
        for (pair, entry) in model.pairs.iter().enumerate() {
            let node = |b: usize| {
                let at = 3 * (model.bodies[b].dofs.interior_nodes + pair);
                [0, 1, 2].map(|axis| u[b][at + axis])
            };
            let (first, second) = (node(0), node(1));
            for row in 0..3 {
                let gap: f64 = (0..3)
                    .map(|axis| entry.frame[row][axis] * (first[axis] - second[axis]))
                    .sum();
                assert!((gap - x[3 * pair + row]).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn fewer_stuck_modes_err_with_the_square_of_the_frequency() {
        let (model, structure) = assembly([5, 7]);
        let all = reduce(&model, &structure, None).unwrap();
        let few = reduce(&model, &structure, Some(4)).unwrap();
        assert_eq!(few.relative.omega2, all.relative.omega2[..4]);
        assert_eq!(few.relative.stiffness, all.relative.stiffness);
        assert_eq!(few.relative.static_load.on_x, all.relative.static_load.on_x);
        let cut = all.relative.omega2[4].sqrt();
        let error = |w: f64| {
            let exact = lambda(&all.relative, w);
            (lambda(&few.relative, w) - &exact).norm_max() / exact.norm_max()
        };
        let [low, high] = [0.05, 0.1].map(|share| error(share * cut));
        assert!(high < 0.02 && (high / low).log2() > 1.9, "{low} {high}");
    }

    #[test]
    fn a_rigid_second_body_leaves_the_first_alone() {
        let (mut model, mut structure) = assembly([1000, 7]);
        model.excitations.retain(|force| force.terms[0].0 == 0);
        model.observations.truncate(1);
        let rigid = &mut model.bodies[1];
        rigid.dofs.nodes.fill(crate::model::NodeMotion::Fixed);
        (
            rigid.dofs.interior_nodes,
            rigid.dofs.flank_nodes,
            rigid.dofs.probe_nodes,
        ) = (0, 0, 0);
        let nothing = nalgebra_sparse::CscMatrix::zeros(0, 0);
        structure.bodies[1].stiffness = nothing.clone();
        structure.bodies[1].mass = nothing;
        structure.bodies[1].load_n.clear();
        let reduced = reduce(&model, &structure, None).unwrap();
        // Stuck on what is rigid, the first body has the modes of its flanks held.
        let (bar, matrices) = (&model.bodies[0], &structure.bodies[0]);
        let held = crate::reduction::craig_bampton::held_modes(bar, matrices, 1000).unwrap();
        assert_eq!(held.omega2.len(), reduced.relative.omega2.len());
        for (a, b) in held.omega2.iter().zip(&reduced.relative.omega2) {
            assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
        }
        let [first, second] = reduced.recovery.full_static(&[0.0; 15]);
        assert_eq!((first.len(), second.len()), (matrices.load_n.len(), 0));
    }

    #[test]
    fn what_is_bonded_is_what_sticks_and_has_no_unknowns() {
        let (model, structure) = assembly([1000, 1000]);
        let whole = reduce(&model, &structure, None).unwrap();
        for left in [3, 0] {
            let mut tied = model.clone();
            let gone = tied.pairs.split_off(left);
            tied.bonded = gone.iter().map(|p| p.nodes).collect();
            let few = 3 * left;
            for reduced in [
                reduce(&tied, &structure, None).unwrap(),
                reduce_joined(&tied, &structure, 1000).unwrap(),
            ] {
                let (all, some) = (&whole.relative, &reduced.relative);
                assert_eq!((some.stiffness.nrows(), some.pairs.len()), (few, left));
                let same = |a: &Mat<f64>, b: &Mat<f64>| {
                    let error = (a - b.get(..few, ..few)).norm_max();
                    assert!(error <= 1e-9 * b.norm_max(), "{error}");
                };
                same(&some.stiffness, &all.stiffness);
                same(&some.mass, &all.mass);
                assert_eq!(some.omega2.len(), all.omega2.len());
                for (a, b) in some.omega2.iter().zip(&all.omega2) {
                    assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
                }
                for w in FREQUENCIES {
                    let a = lambda(some, w);
                    let b = lambda(all, w);
                    let error = (&a - b.get(..few, ..few)).norm_max();
                    assert!(error <= 1e-9 * b.norm_max(), "{w}: {error}");
                }
                // With what is left stuck both move alike.
                let u = reduced.recovery.full_static(&vec![0.0; few]);
                let v = whole.recovery.full_static(&[0.0; 15]);
                for (u, v) in u.iter().flatten().zip(v.iter().flatten()) {
                    assert!((u - v).abs() < 1e-9 * 1e-5, "{u} {v}");
                }
                for (a, b) in some.observations.iter().zip(&all.observations) {
                    for (a, b) in a.on_x.iter().zip(&b.on_x) {
                        assert!((a - b).abs() < 1e-9, "{a} {b}");
                    }
                }
                for (a, b) in some.static_load.on_x.iter().zip(&all.static_load.on_x) {
                    assert!((a - b).abs() < 1e-9 * 100.0, "{a} {b}");
                }
            }
        }
    }

    #[test]
    fn threads_change_no_bit() {
        let (model, structure) = assembly([5, 7]);
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| reduce(&model, &structure, None).unwrap().relative)
        };
        let (one, four) = (run(1), run(4));
        assert_eq!(one.stiffness, four.stiffness);
        assert_eq!(one.mass, four.mass);
        assert_eq!(one.coupling, four.coupling);
        assert_eq!(one.omega2, four.omega2);
        assert_eq!(one.excitations, four.excitations);
    }

    #[test]
    fn what_cannot_be_assembled_is_an_error() {
        let (mut model, structure) = assembly([2, 3]);
        // Both bodies free: the bar against itself.
        let bar = |name: &str| {
            let mut body = model.bodies[0].clone();
            body.name = name.into();
            body
        };
        let free = Model {
            bodies: [bar("bar"), bar("loose")],
            excitations: Vec::new(),
            observations: Vec::new(),
            ..model.clone()
        };
        let twice = Structure {
            bodies: [0, 0].map(|b| structure.bodies[b].clone()),
        };
        let message = reduce(&free, &twice, None).unwrap_err().to_string();
        assert!(
            message.contains("`loose`") && message.contains("fixed"),
            "{message}"
        );

        model.excitations[0].terms[0].1 = model.bodies[0]
            .dofs
            .nodes
            .iter()
            .position(|m| *m == crate::model::NodeMotion::Free(0))
            .unwrap() as u32;
        assert!(matches!(
            reduce(&model, &structure, None),
            Err(ReductionError::PointCondensed { .. })
        ));
        model.excitations.clear();
        model.pairs.pop();
        assert!(matches!(
            reduce(&model, &structure, None),
            Err(ReductionError::FlankMismatch {
                flank_nodes: 5,
                pairs: 4,
                ..
            })
        ));
    }
}
