//! Dynamic stiffness for the inner linear solves, which are inexact anyway: on the pairs that take
//! part alone, with K in single precision or its near field, and the mass through the coarse space of
//! the softest motions. Inertia matters where motions are soft; in the others it is below single
//! precision.
//! `M ~ (M W) (W^T M W)^-1 (M W)^T` is exact on the motions W.
//!
//! Harmonics that are waves round a disc have matrices of their own, whole and in single precision.

use std::collections::BTreeMap;
use std::sync::Arc;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, c64};

use super::dynamic_stiffness::Coefficients;
use crate::reduced::{DiscExcitation, ReducedModel};
use dovetail_numerics::dense;
use dovetail_numerics::dense::parallel::product;
use dovetail_numerics::dense::{NearField, PackedSymmetric};
use dovetail_numerics::eigen::{CoarseSpace, coarse_space, independent};
use dovetail_numerics::spectrum::cosine;

/// Ratio of the number of motions of the coarse space to the root of the number of unknowns.
const MOTIONS_PER_ROOT: f64 = 2.0;
const FEWEST_MOTIONS: usize = 12;
/// A motion is left out if, on the pairs that take part, less than this fraction of its square is
/// independent of those before it.
const DEPENDENT: f64 = 1e-4;
/// A pair is near another where the block of K that couples them is above this, relative to their own
/// stiffness.
const NEAR: f64 = 1e-3;
/// The blocks of pairs that are near each other serve where they are less than this fraction of all.
const NEAR_FRACTION: f64 = 0.15;
/// Fraction of active pairs from which on all pairs take part.
pub(crate) const ALL_FROM: f64 = 0.25;
/// Number of pairs beyond the active ones that may take part, in addition to a quarter of these.
const SPARE: usize = 16;

/// Data that are the same for all sets of pairs.
pub struct InexactModel {
    model: Arc<ReducedModel>,
    /// Coarse space W, n x motions.
    coarse_space: Mat<f64>,
    /// Factor of M ~ inertia inertia^T, n x motions or fewer.
    inertia: Mat<f32>,
    all: Option<Arc<Inexact>>,
}

/// K, M, P and the coarse space on the unknowns of some pairs; m unknowns.
pub(crate) struct Inexact {
    /// Numbers of the pairs, ascending.
    pub pairs: Vec<usize>,
    stiffness: PackedSymmetric,
    /// Blocks of K of pairs that are near each other; `None` where their products are hardly faster
    /// than those of K.
    pub near_stiffness: Option<NearField>,
    /// W^T, motions x m.
    pub motions: Mat<f32>,
    /// (K W)^T, motions x m.
    pub forces: Mat<f32>,
    inertia: Mat<f32>,
    coupling: Mat<f32>,
    /// Weights of the dashpots, m x dashpots.
    dashpots: Mat<f32>,
    /// Excitation that makes waves round a disc; `None` where all harmonics are in phase.
    excitation: Option<DiscExcitation>,
    /// Matrices of the waves of each nodal diameter.
    waves: BTreeMap<usize, InexactWave>,
}

/// Matrices of the waves of one nodal diameter on the unknowns of some pairs, m: the rows of the first
/// copy of the sector, as they act on the first and on the second copy
/// ([`crate::reduced::waves`]).
struct InexactWave {
    /// K, m x m.
    stiffness: [Mat<f32>; 2],
    /// M, m x m.
    mass: [Mat<f32>; 2],
    /// Coupling of the first and of the second copy to the modes, m x modes.
    coupling: [Mat<f32>; 2],
    /// Weights of the dashpots, m x dashpots.
    dashpots: [Mat<f32>; 2],
}

/// Number of motions of the coarse space for so many unknowns.
pub(crate) fn motions(unknowns: usize) -> usize {
    let count = (MOTIONS_PER_ROOT * (unknowns as f64).sqrt()).ceil() as usize;
    count.max(FEWEST_MOTIONS)
}

impl InexactModel {
    /// Model with its coarse space.
    pub fn new(model: &Arc<ReducedModel>) -> Self {
        Self::build(model, |motions| {
            let moved = product(model.mass.as_ref(), motions.as_ref());
            narrow(nystrom(&moved, motions).as_ref())
        })
    }

    /// Model with its coarse space for linear solves in the mean alone, to which no mass belongs.
    pub(crate) fn mean_only(model: &Arc<ReducedModel>) -> Self {
        Self::build(model, |motions| Mat::zeros(motions.nrows(), 0))
    }

    fn build(model: &Arc<ReducedModel>, inertia: impl FnOnce(&Mat<f64>) -> Mat<f32>) -> Self {
        let diagonal = model.diagonal_stiffness();
        let count = motions(diagonal.len());
        let CoarseSpace { motions, forces } =
            coarse_space(model.stiffness.as_ref(), &diagonal, count);
        let mut this = Self {
            inertia: inertia(&motions),
            model: Arc::clone(model),
            coarse_space: motions,
            all: None,
        };
        this.all = Some(Arc::new(Inexact {
            forces: narrow(forces.transpose()),
            motions: narrow(this.coarse_space.transpose()),
            ..this.restrict_motionless((0..model.pairs()).collect())
        }));
        this
    }

    /// Model without motions, for few or no linear solves.
    pub(crate) fn unprepared(model: &Arc<ReducedModel>) -> Self {
        let n = model.stiffness.nrows();
        Self {
            model: Arc::clone(model),
            coarse_space: Mat::zeros(n, 0),
            inertia: Mat::zeros(n, 0),
            all: None,
        }
    }

    /// Model on a set of pairs that includes all of `active`: those of `last` where they suffice,
    /// or all pairs where enough of them are active.
    pub(crate) fn taking_part(
        &self,
        active: &[usize],
        last: Option<&Arc<Inexact>>,
    ) -> Arc<Inexact> {
        let count = active.len();
        let most = count + count / 4 + SPARE;
        if let Some(last) = last {
            let serves = |all: &[usize]| active.iter().all(|p| all.binary_search(p).is_ok());
            let is_all = last.pairs.len() == self.model.pairs();
            let few_enough = last.pairs.len() <= most || (is_all && self.includes_all_pairs(count));
            if few_enough && serves(&last.pairs) {
                return Arc::clone(last);
            }
        }
        if let Some(all) = &self.all
            && self.includes_all_pairs(count)
        {
            return Arc::clone(all);
        }
        let mut pairs = active.to_vec();
        if let Some(last) = last {
            pairs.extend(&last.pairs);
            pairs.sort_unstable();
            pairs.dedup();
            if pairs.len() > most {
                pairs = active.to_vec();
            }
        }
        Arc::new(self.restrict(pairs))
    }

    fn includes_all_pairs(&self, count: usize) -> bool {
        count as f64 >= ALL_FROM * self.model.pairs() as f64
    }

    fn restrict(&self, pairs: Vec<usize>) -> Inexact {
        let mut inexact = self.restrict_motionless(pairs);
        let m = inexact.unknowns();
        let columns = columns(&inexact.pairs);
        let diagonal = self.model.diagonal_stiffness();
        let weights: Vec<f64> = columns.iter().map(|&c| diagonal[c]).collect();
        let count = (MOTIONS_PER_ROOT * (m as f64).sqrt()).ceil() as usize;
        let motions = self
            .coarse_space
            .get(.., ..count.min(self.coarse_space.ncols()));
        let on_pairs = Mat::from_fn(m, motions.ncols(), |i, j| motions[(columns[i], j)]);
        let motions = independent(&on_pairs, &weights, DEPENDENT.sqrt());
        inexact.motions = narrow(motions.transpose());
        let mut forces = Mat::zeros(m, motions.ncols());
        inexact
            .stiffness
            .times(inexact.motions.transpose(), forces.as_mut());
        inexact.forces = forces.transpose().to_owned();
        inexact
    }

    fn restrict_motionless(&self, pairs: Vec<usize>) -> Inexact {
        let columns = columns(&pairs);
        let [coupling, dashpots] = self.model.coupling_and_dashpots();
        let inertia = &self.inertia;
        let m = columns.len();
        let stiffness = PackedSymmetric::new(self.model.stiffness.as_ref(), &columns);
        let near_stiffness = (!stiffness.is_one_block())
            .then(|| NearField::new(self.model.stiffness.as_ref(), &columns, NEAR))
            .filter(|near| (near.blocks() as f64) < NEAR_FRACTION * (pairs.len() as f64).powi(2));
        Inexact {
            stiffness,
            near_stiffness,
            inertia: Mat::from_fn(m, inertia.ncols(), |i, j| inertia[(columns[i], j)]),
            coupling: Mat::from_fn(m, coupling.ncols(), |i, j| coupling[(columns[i], j)] as f32),
            dashpots: Mat::from_fn(m, dashpots.ncols(), |i, j| dashpots[(columns[i], j)] as f32),
            motions: Mat::zeros(0, m),
            forces: Mat::zeros(0, m),
            excitation: self.model.waves.excitation(),
            waves: self.waves(&columns),
            pairs,
        }
    }

    /// Matrices of the waves on the unknowns of these numbers.
    fn waves(&self, columns: &[usize]) -> BTreeMap<usize, InexactWave> {
        let copies = self.model.waves.copies().iter();
        let wave = |(diameter, model): (&usize, &ReducedModel)| {
            let (m, n) = (columns.len(), self.model.stiffness.nrows());
            let on_copies = |a: &Mat<f64>| {
                let of = |copy: usize| {
                    let entry = |i: usize, j: usize| a[(columns[i], copy * n + columns[j])];
                    Mat::from_fn(m, m, |i, j| entry(i, j) as f32)
                };
                [of(0), of(1)]
            };
            let rows = |a: &Mat<f64>| {
                let of = |copy: usize| {
                    let entry = |i: usize, j: usize| a[(copy * n + columns[i], j)];
                    Mat::from_fn(m, a.ncols(), |i, j| entry(i, j) as f32)
                };
                [of(0), of(1)]
            };
            let wave = InexactWave {
                stiffness: on_copies(&model.stiffness),
                mass: on_copies(&model.mass),
                coupling: rows(&model.coupling),
                dashpots: rows(&model.dashpots.on_x),
            };
            (*diameter, wave)
        };
        copies.map(wave).collect()
    }
}

impl InexactWave {
    /// Adds `Lambda x` of one harmonic, m x 2, cosine and sine.
    fn dynamic(&self, sign: f64, c: &Coefficients, x: MatRef<'_, f32>) -> Mat<f32> {
        let mut y = complex_product(self.stiffness.each_ref().map(Mat::as_ref), sign, x);
        let mut inert = complex_product(self.mass.each_ref().map(Mat::as_ref), sign, x);
        for i in 0..y.nrows() {
            scale_by_complex(c.s, &mut y, i, 0);
            scale_by_complex(-c.z, &mut inert, i, 0);
        }
        y += inert;
        let coupling = self.coupling.each_ref().map(|a| a.get(.., ..c.modes.len()));
        let bases = [coupling, self.dashpots.each_ref().map(Mat::as_ref)];
        let moved = bases.map(|basis| complex_product(basis.map(MatRef::transpose), sign, x));
        let mut amplitudes = moved[0].clone();
        for (m, mode) in c.modes.iter().enumerate() {
            scale_by_complex(*mode, &mut amplitudes, m, 0);
        }
        let mut add = |basis: MatRef<'_, f32>, amplitudes: MatRef<'_, f32>| {
            matmul(y.as_mut(), Accum::Add, basis, amplitudes, 1.0, Par::Seq);
        };
        add(bases[0][0], amplitudes.as_ref());
        if let Some(low_rank) = &c.dashpots {
            let moved = moved.each_ref().map(|a| complex_column(a, 0));
            let products = low_rank.product([&moved[0], &moved[1]]);
            for (basis, product) in bases.iter().zip(products) {
                let parts = Mat::from_fn(product.len(), 2, |i, part| match part {
                    0 => product[i].re as f32,
                    _ => -product[i].im as f32,
                });
                add(basis[0], parts.as_ref());
            }
        }
        y
    }

    /// Lambda of one harmonic on real motions, count x m: real and imaginary part of (Lambda W)^T.
    fn dynamic_motions(
        &self,
        sign: f64,
        c: &Coefficients,
        motions: MatRef<'_, f32>,
    ) -> [Mat<f32>; 2] {
        let mut parts = [0, 1].map(|_| Mat::zeros(motions.nrows(), motions.ncols()));
        // Adds the complex product of a matrix on the motions, A + sign i B, times a factor.
        let mut add = |[real, imaginary]: [Mat<f32>; 2], by: c64| {
            let (re, im) = (by.re as f32, by.im as f32);
            for j in 0..real.ncols() {
                for i in 0..real.nrows() {
                    let (a, b) = (real[(i, j)], imaginary[(i, j)]);
                    parts[0][(i, j)] += re * a - im * b;
                    parts[1][(i, j)] += re * b + im * a;
                }
            }
        };
        let signed = |[a, b]: [Mat<f32>; 2]| [a, b * faer::Scale(sign as f32)];
        let on_motions = |a: &[Mat<f32>; 2]| {
            signed(a.each_ref().map(|a| dense::product(motions, a.transpose())))
        };
        add(on_motions(&self.stiffness), c.s);
        add(on_motions(&self.mass), -c.z);
        let coupling = self.coupling.each_ref().map(|a| a.get(.., ..c.modes.len()));
        let bases = [coupling, self.dashpots.each_ref().map(Mat::as_ref)];
        let moved = bases.map(|basis| signed(basis.map(|a| dense::product(motions, a))));
        let complex = moved.each_ref().map(|[a, b]| {
            let entry = |i: usize, j: usize| c64::new(a[(i, j)].into(), b[(i, j)].into());
            Mat::from_fn(a.nrows(), a.ncols(), entry)
        });
        let scaled = Mat::from_fn(motions.nrows(), c.modes.len(), |i, m| {
            complex[0][(i, m)] * c.modes[m]
        });
        let mut through = vec![(scaled, bases[0][0])];
        if let Some(low_rank) = &c.dashpots {
            let [on_modes, on_dashpots] = low_rank
                .transposed()
                .left_product([&complex[0], &complex[1]]);
            through.push((on_modes, bases[0][0]));
            through.push((on_dashpots, bases[1][0]));
        }
        for (rows, basis) in through {
            let part = |of: fn(&c64) -> f64| {
                let rows =
                    Mat::from_fn(rows.nrows(), rows.ncols(), |i, j| of(&rows[(i, j)]) as f32);
                dense::product(rows.as_ref(), basis.transpose())
            };
            add([part(|v| v.re), part(|v| v.im)], c64::ONE);
        }
        parts
    }
}

/// Product of A + sign i B with `cosine - i sine`, two columns.
fn complex_product([a, b]: [MatRef<'_, f32>; 2], sign: f64, x: MatRef<'_, f32>) -> Mat<f32> {
    let mut y = dense::product(a, x);
    let turned = Mat::from_fn(x.nrows(), 2, |i, part| match part {
        0 => x[(i, 1)],
        _ => -x[(i, 0)],
    });
    matmul(y.as_mut(), Accum::Add, b, &turned, sign as f32, Par::Seq);
    y
}

/// Complex numbers of a cosine column and the sine column behind it.
fn complex_column(a: &Mat<f32>, cosine: usize) -> Vec<c64> {
    let [c, s] = [cosine, cosine + 1].map(|column| a.col(column).iter());
    let parts = c.zip(s);
    let complex = parts.map(|(c, s)| c64::new(f64::from(*c), -f64::from(*s)));
    complex.collect()
}

impl Inexact {
    /// Number of unknowns of one block.
    pub(crate) fn unknowns(&self) -> usize {
        3 * self.pairs.len()
    }

    /// Positions of the unknowns among those of all pairs.
    pub(crate) fn columns(&self) -> Vec<usize> {
        columns(&self.pairs)
    }

    /// Sign and matrices of harmonic `k` where it is a wave.
    fn wave(&self, k: usize) -> Option<(f64, &InexactWave)> {
        let wave = self.excitation?.wave(k)?;
        Some((wave.sign, self.waves.get(&wave.nodal_diameter)?))
    }

    /// Number of modes that take part in harmonics in phase.
    fn modes(&self, harmonics: &[Coefficients]) -> usize {
        let mut in_phase = harmonics.iter().enumerate();
        let in_phase = in_phase.find(|(k, _)| self.wave(k + 1).is_none());
        in_phase.map_or(0, |(_, c)| c.modes.len())
    }

    /// Computes K x, m x any.
    pub(crate) fn stiffness_times(&self, x: MatRef<'_, f32>) -> Mat<f32> {
        let mut y = Mat::zeros(x.nrows(), x.ncols());
        self.stiffness.times(x, y.as_mut());
        y
    }

    /// Computes `Lambda x` from x and `K x`, m x (2H+1): the mean, then cosine and sine of each
    /// harmonic.
    pub(crate) fn dynamic(
        &self,
        harmonics: &[Coefficients],
        x: MatRef<'_, f32>,
        kx: Mat<f32>,
    ) -> Mat<f32> {
        let mut y = kx;
        for (k, c) in harmonics.iter().enumerate() {
            let first = cosine(k + 1);
            if let Some((sign, wave)) = self.wave(k + 1) {
                let of_wave = wave.dynamic(sign, c, x.get(.., first..first + 2));
                y.get_mut(.., first..first + 2).copy_from(of_wave);
                continue;
            }
            for i in 0..y.nrows() {
                scale_by_complex(c.s, &mut y, i, first);
            }
        }
        let modes = self.modes(harmonics);
        let coupling = self.coupling.get(.., ..modes);
        for (basis, is_inertia) in [(self.inertia.as_ref(), true), (coupling, false)] {
            let mut amplitudes = dense::product(basis.transpose(), x.get(.., 1..));
            for (k, c) in harmonics.iter().enumerate() {
                let is_wave = self.wave(k + 1).is_some();
                for i in 0..basis.ncols() {
                    let by = match is_inertia {
                        _ if is_wave => c64::ZERO,
                        true => -c.z,
                        false => c.modes[i],
                    };
                    // Without the mean.
                    scale_by_complex(by, &mut amplitudes, i, cosine(k + 1) - 1);
                }
            }
            let (y, amplitudes) = (y.get_mut(.., 1..), amplitudes.as_ref());
            matmul(y, Accum::Add, basis, amplitudes, 1.0, Par::Seq);
        }
        if harmonics.iter().any(|c| c.dashpots.is_some()) {
            self.add_of_dashpots(harmonics, x.get(.., 1..), y.get_mut(.., 1..));
        }
        y
    }

    /// Adds what dashpots do to `Lambda x`, both without the mean.
    fn add_of_dashpots(
        &self,
        harmonics: &[Coefficients],
        x: MatRef<'_, f32>,
        mut y: MatMut<'_, f32>,
    ) {
        let bases = [
            self.coupling.get(.., ..self.modes(harmonics)),
            self.dashpots.as_ref(),
        ];
        let mut amplitudes = bases.map(|basis| dense::product(basis.transpose(), x));
        for (k, c) in harmonics.iter().enumerate() {
            let [cosine, sine] = [2 * k, 2 * k + 1];
            let products = match &c.dashpots {
                None => continue,
                // It has its own.
                Some(_) if self.wave(k + 1).is_some() => {
                    amplitudes.each_ref().map(|a| vec![c64::ZERO; a.nrows()])
                }
                Some(low_rank) => {
                    let parts = amplitudes.each_ref().map(|a| complex_column(a, cosine));
                    low_rank.product([&parts[0], &parts[1]])
                }
            };
            for (a, product) in amplitudes.iter_mut().zip(products) {
                for (i, v) in product.into_iter().enumerate() {
                    (a[(i, cosine)], a[(i, sine)]) = (v.re as f32, -v.im as f32);
                }
            }
        }
        for (basis, amplitudes) in bases.into_iter().zip(&amplitudes) {
            matmul(&mut y, Accum::Add, basis, amplitudes, 1.0, Par::Seq);
        }
    }

    /// Lambda of harmonic `k` on the first `count` motions, real and imaginary part: (Lambda W)^T,
    /// `count` x m.
    pub(crate) fn dynamic_motions(
        &self,
        k: usize,
        c: &Coefficients,
        count: usize,
    ) -> [Mat<f32>; 2] {
        let motions = self.motions.get(..count, ..);
        if let Some((sign, wave)) = self.wave(k) {
            return wave.dynamic_motions(sign, c, motions);
        }
        let coupling = self.coupling.get(.., ..c.modes.len());
        let [inertia, modal] =
            [self.inertia.as_ref(), coupling].map(|basis| dense::product(motions, basis));
        // The rows of W^T Q times what the dashpots add, on the modes and on the dashpots.
        let held = c.dashpots.as_ref().map(|low_rank| {
            let moved = dense::product(motions, self.dashpots.as_ref());
            let rows = [&modal, &moved]
                .map(|a| Mat::from_fn(count, a.ncols(), |i, j| c64::new(a[(i, j)].into(), 0.0)));
            low_rank.transposed().left_product([&rows[0], &rows[1]])
        });
        let of_dashpots = |of: fn(&c64) -> f64, y: &mut Mat<f32>| {
            let bases = [coupling, self.dashpots.as_ref()];
            for (rows, basis) in held.iter().flatten().zip(bases) {
                let rows = Mat::from_fn(count, rows.ncols(), |i, j| of(&rows[(i, j)]) as f32);
                matmul(
                    y.as_mut(),
                    Accum::Add,
                    &rows,
                    basis.transpose(),
                    1.0,
                    Par::Seq,
                );
            }
        };
        let part = |s: f64, z: f64, mode: &dyn Fn(usize) -> f64| {
            let mut y = Mat::from_fn(count, self.unknowns(), |j, i| {
                s as f32 * self.forces[(j, i)]
            });
            let modal = Mat::from_fn(modal.nrows(), modal.ncols(), |j, m| {
                mode(m) as f32 * modal[(j, m)]
            });
            let mut add = |a: &Mat<f32>, b: MatRef<'_, f32>, by: f32| {
                matmul(y.as_mut(), Accum::Add, a, b.transpose(), by, Par::Seq);
            };
            add(&inertia, self.inertia.as_ref(), -z as f32);
            add(&modal, coupling, 1.0);
            y
        };
        let mut parts = [
            part(c.s.re, c.z.re, &|m| c.modes[m].re),
            part(c.s.im, c.z.im, &|m| c.modes[m].im),
        ];
        of_dashpots(|v| v.re, &mut parts[0]);
        of_dashpots(|v| v.im, &mut parts[1]);
        parts
    }
}

/// Multiplies row i of a cosine and a sine column by a complex number, `X = cosine - i sine`.
fn scale_by_complex(by: c64, a: &mut Mat<f32>, i: usize, cosine: usize) {
    let (c, s) = (f64::from(a[(i, cosine)]), f64::from(a[(i, cosine + 1)]));
    a[(i, cosine)] = (by.re * c + by.im * s) as f32;
    a[(i, cosine + 1)] = (by.re * s - by.im * c) as f32;
}

fn narrow(a: MatRef<'_, f64>) -> Mat<f32> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] as f32)
}

fn columns(pairs: &[usize]) -> Vec<usize> {
    pairs
        .iter()
        .flat_map(|p| [3 * p, 3 * p + 1, 3 * p + 2])
        .collect()
}

/// Factor N of `(M W) (W^T M W)^-1 (M W)^T = N N^T`; motions without mass are left out.
fn nystrom(moved: &Mat<f64>, motions: &Mat<f64>) -> Mat<f64> {
    const NO_MASS: f64 = 1e-10;
    let nothing = || Mat::zeros(moved.nrows(), 0);
    if motions.ncols() == 0 {
        return nothing();
    }
    let among = product(motions.transpose(), moved.as_ref());
    let Some((masses, vectors)) = dense::self_adjoint_eigen(among.as_ref()) else {
        return nothing();
    };
    let largest = masses.iter().fold(0.0_f64, |m, v| m.max(*v));
    let first = masses
        .iter()
        .position(|v| *v > NO_MASS * largest)
        .unwrap_or(masses.len());
    let vectors = vectors.get(.., first..);
    let scaled = Mat::from_fn(vectors.nrows(), vectors.ncols(), |i, j| {
        vectors[(i, j)] / masses[first + j].sqrt()
    });
    product(moved.as_ref(), scaled.as_ref())
}
