//! Dynamic stiffness of the pairs, and the contributions of the stuck modes to loads and fields.
//!
//! With z = w^2 - i w b and s = 1 + i w a (Rayleigh damping a K + b M):
//! `Lambda(w) = s K - z M - sum_m (z^2 / d_m) p_m p_m^T`, `d_m = s w_m^2 - z`,
//! `F(w) = F_X + sum_m (z / d_m) p_m fm_m`, `q_m = (fm_m + z p_m . X) / d_m`.
//! Complex amplitudes: `x(t) = Re(X exp(i w t))`, X = cosine - i sine. With damping ratios of
//! stuck modes and with dashpots the sums are those of `elimination.rs`.
//!
//! Each harmonic moves by a model of its own where it is a wave round a disc: its matrices are then
//! those of two copies of a sector ([`crate::reduced::waves`]).
//!
//! Lambda is not formed: K, M and `P = [p_m]` are the same at every frequency and harmonic. They
//! are read once for all harmonics together (matrix times matrix), where one Lambda per harmonic,
//! real and imaginary, would be 2H matrices of the size of K.

use super::Problem;
use super::elimination::{Elimination, Factors};
use crate::damping::Rayleigh;
use crate::reduced::{HarmonicModel, ReducedModel};
use dovetail_numerics::dense;
use dovetail_numerics::spectrum::{cosine, sine};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, c64};
use std::ops::Range;
use std::sync::Arc;

pub(crate) use super::elimination::Coefficients;

/// Least ratio of critical damping that a dashpot counts with.
const LEAST_RATIO: f64 = 1e-12;

/// Problem with its damping.
#[derive(Clone)]
pub struct ContactSystem {
    /// Matrices, laws and excitations.
    pub problem: Problem,
    /// Coefficients a and b of all that has no damping of its own.
    pub damping: Rayleigh,
}

/// Dynamic stiffness of the mean and of the harmonics 1..H at one frequency.
pub struct HarmonicStiffness {
    reduced: Arc<ReducedModel>,
    /// Angular frequency of the first harmonic, rad/s.
    omega: f64,
    harmonics: Vec<Coefficients>,
}

impl ContactSystem {
    /// System of a problem with this damping. It shares the reduced model.
    pub fn new(problem: &Problem, damping: Rayleigh) -> Self {
        Self {
            problem: problem.clone(),
            damping,
        }
    }

    /// Number of unknowns of one harmonic, 3 per pair.
    pub(crate) fn unknowns(&self) -> usize {
        self.problem.reduced.stiffness.nrows()
    }

    /// Lambda at `omega` rad/s and its multiples up to the one of harmonic `harmonics`, and K.
    pub(crate) fn stiffness(&self, omega: f64, harmonics: usize) -> HarmonicStiffness {
        self.harmonic_stiffness(omega, harmonics, |k| {
            self.eliminated(k, omega).coefficients()
        })
    }

    /// Derivative of Lambda with respect to the frequency of the first harmonic, at `omega` rad/s
    /// and its multiples up to the one of harmonic `harmonics`, N s/m. The mean does not depend on
    /// the frequency: what [`HarmonicStiffness::apply`] writes to its block means nothing.
    pub(crate) fn stiffness_slope(&self, omega: f64, harmonics: usize) -> HarmonicStiffness {
        self.harmonic_stiffness(omega, harmonics, |k| {
            let slope = self.factor_slopes(k, omega);
            self.eliminated(k, omega).slopes(&slope, k as f64)
        })
    }

    /// Combination of K, M and p by the coefficients of each harmonic, which `of` gives by its
    /// number.
    pub(super) fn harmonic_stiffness(
        &self,
        omega: f64,
        harmonics: usize,
        of: impl Fn(usize) -> Coefficients,
    ) -> HarmonicStiffness {
        HarmonicStiffness {
            reduced: Arc::clone(&self.problem.reduced),
            omega,
            harmonics: (1..=harmonics).map(of).collect(),
        }
    }

    /// Equations of harmonic `k` without the stuck modes, where that of the first one is `omega`
    /// rad/s.
    fn eliminated(&self, k: usize, omega: f64) -> Elimination<'_> {
        let of = self.problem.reduced.harmonic_model(k);
        Elimination::new(of.model, self.factors(k, omega), &[])
    }

    /// Factors of K, M, the stuck modes and the dashpots at harmonic `k`.
    fn factors(&self, k: usize, omega: f64) -> Factors {
        let omega = k as f64 * omega;
        let of = |damping| s_and_z(damping, omega);
        self.factors_by(k, of, c64::new(0.0, omega))
    }

    /// Derivatives of [`ContactSystem::factors`] with respect to the frequency of the harmonic.
    fn factor_slopes(&self, k: usize, omega: f64) -> Factors {
        let of = |damping| s_and_z_slopes(damping, k as f64 * omega);
        self.factors_by(k, of, c64::new(0.0, 1.0))
    }

    /// Factors at harmonic `k` of which `of` gives s and z by the damping, that of all or of one mode.
    pub(super) fn factors_by(
        &self,
        k: usize,
        of: impl Fn(Rayleigh) -> (c64, c64),
        rate: c64,
    ) -> Factors {
        let (s, z) = of(self.damping);
        let model = self.problem.reduced.harmonic_model(k);
        let own =
            (0..self.problem.modes_with_damping(model)).map(|m| of(self.mode_damping(k, m)).into());
        Factors {
            s,
            z,
            of_modes: own.collect(),
            rate,
            influence: model.influence_on_copies(),
        }
    }

    /// Damping of a stuck mode of the model of harmonic `k` without the dashpots: its own ratio, or
    /// that of all.
    pub(crate) fn mode_damping(&self, k: usize, mode: usize) -> Rayleigh {
        let of = self.problem.reduced.harmonic_model(k);
        self.problem.mode_damping(of, self.damping, mode)
    }

    /// Lambda at `omega` rad/s, real and imaginary part, n x n.
    pub fn stiffness_at(&self, omega: f64) -> [Mat<f64>; 2] {
        self.stiffness(omega, 1).formed(1)
    }

    /// Ratio of critical damping of a stuck mode of the model of harmonic `k`. Of aerodynamic influence
    /// it has the symmetric part.
    pub fn damping_ratio(&self, k: usize, mode: usize) -> f64 {
        let of = self.problem.reduced.harmonic_model(k);
        let reduced = of.model;
        let omega = reduced.omega2[mode].sqrt();
        let Rayleigh {
            stiffness_s,
            mass_per_s,
        } = self.mode_damping(k, mode);
        let ratio = 0.5 * (stiffness_s * omega + mass_per_s / omega);
        let dashpots = reduced.dashpots.on_modes.row(mode);
        let terms = dashpots.iter().zip(&reduced.dashpots.damping_n_s_m);
        let of_dashpots = terms.map(|(y, c)| 0.5 * c * y * y / omega);
        let ratio = of_dashpots.fold(ratio, |sum, part| sum + part);
        let Some(influence) = of.influence_on_copies() else {
            return ratio;
        };
        let behind = reduced.dashpots.damping_n_s_m.len();
        let weight = |j: usize| reduced.dashpots.on_modes[(mode, behind + j)];
        let mut of_air = 0.0;
        for j in 0..influence.ncols() {
            for i in 0..influence.nrows() {
                of_air += weight(i) * influence[(i, j)].im * weight(j);
            }
        }
        ratio + 0.5 * of_air / reduced.omega2[mode]
    }

    /// Returns `true` if something damps a stuck mode of the model of harmonic `k`.
    pub fn is_damped(&self, k: usize, mode: usize) -> bool {
        let damping = self.mode_damping(k, mode);
        let least = match self.problem.reduced.dashpots.count() {
            0 => 0.0,
            // What is less is the rounding of a dashpot at a node of the mode.
            _ => LEAST_RATIO,
        };
        damping.stiffness_s > 0.0
            || damping.mass_per_s > 0.0
            || self.damping_ratio(k, mode).abs() > least
    }

    /// Load condensed on X at harmonic `k`, from a load of complex amplitude `on_x`, `on_modes` on the
    /// model of that harmonic. `omega` is the frequency of the first harmonic, rad/s.
    pub fn condensed_load(&self, k: usize, omega: f64, on_x: &[c64], on_modes: &[c64]) -> Vec<c64> {
        let eliminated = self.eliminated(k, omega);
        let carried = on_modes.iter().enumerate();
        let carried = carried.map(|(m, &fm)| eliminated.carried(m, fm));
        self.add_carried_forces(
            k,
            on_x,
            carried.collect(),
            eliminated.dashpot_share(on_modes),
        )
    }

    /// Derivative of [`ContactSystem::condensed_load`] with respect to the frequency of harmonic `k`,
    /// for a load with the derivatives `on_x_slope`, `on_modes_slope`.
    pub(crate) fn condensed_load_slope(
        &self,
        k: usize,
        omega: f64,
        on_modes: &[c64],
        [on_x_slope, on_modes_slope]: [&[c64]; 2],
    ) -> Vec<c64> {
        let (eliminated, slope) = (self.eliminated(k, omega), self.factor_slopes(k, omega));
        let both = on_modes.iter().zip(on_modes_slope).enumerate();
        let carried = both.map(|(m, (&fm, &dfm))| eliminated.carried_slope(&slope, m, [fm, dfm]));
        let taken = eliminated.dashpot_share_slope(&slope, on_modes, on_modes_slope);
        self.add_carried_forces(k, on_x_slope, carried.collect(), taken)
    }

    /// Forces on the unknowns of the sector, n, of a load on X, with those of amplitudes of the modes
    /// and of what the dashpots take.
    fn add_carried_forces(
        &self,
        k: usize,
        on_x: &[c64],
        carried: Vec<c64>,
        taken: Option<[Vec<c64>; 2]>,
    ) -> Vec<c64> {
        let of = self.problem.reduced.harmonic_model(k);
        let mut load = on_x[..of.unknowns()].to_vec();
        for amplitudes in std::iter::once(&[carried, Vec::new()]).chain(&taken) {
            of.add_on_pairs(amplitudes, &mut load);
        }
        load
    }

    /// Complex loads of the excitations on the modes of harmonic `k`: `cosine - i sine`.
    pub(crate) fn modal_load(&self, k: usize, omega: f64) -> Vec<c64> {
        let modes = self.problem.reduced.harmonic_model(k).model.omega2.len();
        let mut out = vec![c64::ZERO; modes];
        let loads = self.problem.excitations.iter();
        for load in loads.filter(|load| load.harmonic == k) {
            let factor = load.factor(omega);
            let parts = load.cosine.on_modes.iter().zip(&load.sine.on_modes);
            for (o, (c, s)) in out.iter_mut().zip(parts) {
                *o += factor * c64::new(*c, -*s);
            }
        }
        out
    }

    /// Amplitudes of the stuck modes at harmonic `k` under X and a modal load.
    pub fn modal_response(&self, k: usize, omega: f64, x: &[c64], on_modes: &[c64]) -> Vec<c64> {
        let eliminated = self.eliminated(k, omega);
        let [px, moved] = self.problem.reduced.harmonic_model(k).moved_by(x);
        let of_mode = |(m, (&fm, &px)): (usize, (&c64, &c64))| eliminated.amplitude(m, fm, px);
        let loaded = on_modes.iter().zip(&px).enumerate();
        let mut amplitudes: Vec<c64> = loaded.map(of_mode).collect();
        eliminated.subtract_dashpots([&px, &moved], (on_modes, c64::ZERO), &mut amplitudes);
        amplitudes
    }

    /// Derivative of the displacement `on_x . Y + on_modes . q` at harmonic `k` with respect to X,
    /// where Y are the unknowns of the model of that harmonic.
    pub(crate) fn displacement_slope(
        &self,
        k: usize,
        omega: f64,
        on_x: &[f64],
        on_modes: &[f64],
    ) -> Vec<c64> {
        let eliminated = self.eliminated(k, omega);
        let of = self.problem.reduced.harmonic_model(k);
        let complex = |v: &[f64]| v.iter().map(|v| c64::new(*v, 0.0)).collect::<Vec<_>>();
        let (mut slope, on_modes) = (complex(on_x), complex(on_modes));
        for (m, (share, on)) in eliminated.shares().iter().zip(&on_modes).enumerate() {
            let coupling = of.model.coupling.col_as_slice(m);
            for (slope, p) in slope.iter_mut().zip(coupling) {
                *slope += share * (on.re * *p);
            }
        }
        if let Some(taken) = eliminated.dashpot_displacement_share(&on_modes) {
            of.model.add_on_pairs(&taken, &mut slope);
        }
        of.narrowed(&slope)
    }
}

/// s and z at `omega` rad/s.
pub(super) fn s_and_z(damping: Rayleigh, omega: f64) -> (c64, c64) {
    (
        c64::new(1.0, omega * damping.stiffness_s),
        c64::new(omega * omega, -omega * damping.mass_per_s),
    )
}

/// Derivatives of s and z with respect to `omega`.
fn s_and_z_slopes(damping: Rayleigh, omega: f64) -> (c64, c64) {
    (
        c64::new(0.0, damping.stiffness_s),
        c64::new(2.0 * omega, -damping.mass_per_s),
    )
}

/// Computes `s K - z M + P c P^T` on columns: cosine and sine parts of a harmonic, from those of K
/// X, M X and P c P^T X.
fn combine(c: &Coefficients, k: [&[f64]; 2], m: [&[f64]; 2], p: [&[f64]; 2], out: [&mut [f64]; 2]) {
    let [out_c, out_s] = out;
    for (i, (yc, ys)) in out_c.iter_mut().zip(out_s).enumerate() {
        let [kc, ks, mc, ms] = [k[0][i], k[1][i], m[0][i], m[1][i]];
        (*yc, *ys) = (p[0][i], p[1][i]);
        *yc += c.s.re * kc + c.s.im * ks - c.z.re * mc - c.z.im * ms;
        *ys += c.s.re * ks - c.s.im * kc - c.z.re * ms + c.z.im * mc;
    }
}

/// Product of Lambda of some harmonics, all of which move by one model, with vectors.
struct Product<'c> {
    of: HarmonicModel<'c>,
    harmonics: &'c [&'c Coefficients],
    /// Rows of the product that are computed, of the unknowns of the sector.
    rows: Range<usize>,
}

impl Product<'_> {
    /// Computes [K v_0, Lambda X, ...] for the mean and cosine and sine of each harmonic, of a model
    /// of the sector alone.
    fn apply_with_mean(&self, v: &[f64], y: &mut [f64]) {
        let model = self.of.model;
        let n = model.stiffness.nrows();
        // In parallel where a core is free, as at the end of a sweep when its other half is done.
        let (stiff, inert) = rayon::join(
            || symmetric_times(model.stiffness.as_ref(), v),
            || symmetric_times(model.mass.as_ref(), &v[n..]),
        );
        y[..n].copy_from_slice(&stiff[..n]);
        self.combined(&v[n..], [&stiff[n..], &inert], &mut y[n..]);
    }

    /// Computes the rows of [Lambda X, ...] for cosine and sine of each harmonic on the unknowns of the
    /// model, N.
    fn apply_harmonics(&self, v: &[f64], y: &mut [f64]) {
        let model = self.of.model;
        let [stiffness, mass] = [&model.stiffness, &model.mass].map(|a| self.of_rows(a));
        let (stiff, inert) = rayon::join(|| times(stiffness, v), || times(mass, v));
        self.combined(v, [&stiff, &inert], y);
    }

    /// Rows of a matrix.
    fn of_rows<'m>(&self, a: &'m Mat<f64>) -> MatRef<'m, f64> {
        a.subrows(self.rows.start, self.rows.len())
    }

    /// Adds what the stuck modes do to `s K v - z M v`, from the rows of K v and M v.
    fn combined(&self, v: &[f64], [stiff, inert]: [&[f64]; 2], y: &mut [f64]) {
        let ReducedModel {
            coupling, dashpots, ..
        } = self.of.model;
        let (n, modes) = (self.rows.len(), coupling.ncols());
        let mut modal = vec![0.0; 2 * self.harmonics.len() * n];
        if modes > 0 || dashpots.count() > 0 {
            let mut amplitudes = times(coupling.transpose(), v);
            let held = (dashpots.count() > 0).then(|| {
                let moved = times(dashpots.on_x.transpose(), v);
                self.dashpot_products([&amplitudes, &moved])
            });
            for (k, c) in self.harmonics.iter().enumerate() {
                let of_harmonic = 2 * modes * k..2 * modes * (k + 1);
                let (gc, gs) = amplitudes[of_harmonic].split_at_mut(modes);
                for ((gc, gs), a) in gc.iter_mut().zip(gs).zip(&c.modes) {
                    let (c, s) = (*gc, *gs);
                    *gc = a.re * c + a.im * s;
                    *gs = a.re * s - a.im * c;
                }
            }
            if let Some([on_modes, _]) = &held {
                let both = amplitudes.iter_mut().zip(on_modes);
                both.for_each(|(a, b)| *a += b);
            }
            if modes > 0 {
                modal = times(self.of_rows(coupling), &amplitudes);
            }
            if let Some([_, on_dashpots]) = &held {
                let on_pairs = times(self.of_rows(&dashpots.on_x), on_dashpots);
                modal.iter_mut().zip(on_pairs).for_each(|(a, b)| *a += b);
            }
        }
        for (k, (c, y)) in self
            .harmonics
            .iter()
            .zip(y.chunks_exact_mut(2 * n))
            .enumerate()
        {
            let (yc, ys) = y.split_at_mut(n);
            combine(
                c,
                cosine_and_sine(stiff, k, n),
                cosine_and_sine(inert, k, n),
                cosine_and_sine(&modal, k, n),
                [yc, ys],
            );
        }
    }

    /// Products `L T L^T g` of all harmonics: cosine and sine on the modes and on the dashpots, from
    /// the same of `p^T X` and of the displacements of the dashpots.
    fn dashpot_products(&self, moved: [&[f64]; 2]) -> [Vec<f64>; 2] {
        let mut out = moved.map(|v| vec![0.0; v.len()]);
        let count = 2 * self.harmonics.len();
        for (k, c) in self.harmonics.iter().enumerate() {
            let Some(low_rank) = &c.dashpots else {
                continue;
            };
            let sizes = moved.map(|v| v.len() / count);
            let parts = [0, 1].map(|i| {
                let [c, s] = cosine_and_sine(moved[i], k, sizes[i]);
                let parts = c.iter().zip(s);
                parts.map(|(c, s)| c64::new(*c, -*s)).collect::<Vec<_>>()
            });
            let products = low_rank.product([&parts[0], &parts[1]]);
            for (i, product) in products.iter().enumerate() {
                let block = &mut out[i][2 * sizes[i] * k..2 * sizes[i] * (k + 1)];
                let (c, s) = block.split_at_mut(sizes[i]);
                for (v, (c, s)) in product.iter().zip(c.iter_mut().zip(s)) {
                    (*c, *s) = (v.re, -v.im);
                }
            }
        }
        out
    }
}

/// Product of a matrix with columns that stand one after the other.
fn times(a: MatRef<'_, f64>, b: &[f64]) -> Vec<f64> {
    multiply_columns(a, b, |b, out| {
        matmul(out, Accum::Replace, a, b, 1.0, Par::Seq);
    })
}

/// [`times`] for a symmetric matrix.
fn symmetric_times(a: MatRef<'_, f64>, b: &[f64]) -> Vec<f64> {
    multiply_columns(a, b, |b, out| dense::add_symmetric_product(a, b, out))
}

/// Writes a product of `a` with columns that stand one after the other into zeros.
fn multiply_columns(
    a: MatRef<'_, f64>,
    b: &[f64],
    product: impl FnOnce(MatRef<'_, f64>, MatMut<'_, f64>),
) -> Vec<f64> {
    let (rows, columns) = (a.nrows(), b.len() / a.ncols().max(1));
    let mut out = vec![0.0; rows * columns];
    product(
        MatRef::from_column_major_slice(b, a.ncols(), columns),
        MatMut::from_column_major_slice_mut(&mut out, rows, columns),
    );
    out
}

impl HarmonicStiffness {
    /// Number of harmonics besides the mean.
    pub(crate) fn harmonics(&self) -> usize {
        self.harmonics.len()
    }

    /// Number of unknowns of one block.
    pub(crate) fn unknowns(&self) -> usize {
        self.reduced.stiffness.nrows()
    }

    /// Model by which harmonic k (1..H) moves.
    fn model(&self, k: usize) -> HarmonicModel<'_> {
        self.reduced.harmonic_model(k)
    }

    /// Coefficients of each harmonic, with the stuck modes below `cut` times the highest of them.
    pub(crate) fn coefficients(&self, cut: f64) -> Vec<Coefficients> {
        let highest = cut * self.omega * self.harmonics.len() as f64;
        let below = |w2: &f64| *w2 < highest * highest;
        let mut harmonics = self.harmonics.clone();
        for (i, c) in harmonics.iter_mut().enumerate() {
            let low = self.model(i + 1).model.omega2.partition_point(below);
            c.modes.truncate(low);
            c.dashpots.iter_mut().for_each(|d| d.truncate(low));
        }
        harmonics
    }

    /// Computes Y = [K v_0, Lambda_1 X_1, ..., Lambda_H X_H] for vectors of 2H+1 blocks: the mean,
    /// then cosine and sine of each harmonic (`X = cosine - i sine`).
    pub(crate) fn apply(&self, v: &[f64], y: &mut [f64]) {
        let n = self.unknowns();
        let (waves, in_phase): (Vec<usize>, Vec<usize>) =
            (1..=self.harmonics.len()).partition(|k| self.model(*k).wave.is_some());
        let mean = self.reduced.harmonic_model(0);
        let coefficients: Vec<&Coefficients> =
            in_phase.iter().map(|k| &self.harmonics[k - 1]).collect();
        let product = Product {
            of: mean,
            harmonics: &coefficients,
            rows: 0..n,
        };
        if waves.is_empty() {
            product.apply_with_mean(v, y);
            return;
        }
        let of_harmonics = in_phase.iter().flat_map(|k| [cosine(*k), sine(*k)]);
        let blocks: Vec<usize> = std::iter::once(0).chain(of_harmonics).collect();
        let block = |b: &usize| &v[b * n..(b + 1) * n];
        let together = blocks.iter().map(block).collect::<Vec<_>>().concat();
        let mut combined = vec![0.0; together.len()];
        product.apply_with_mean(&together, &mut combined);
        for (b, combined) in blocks.into_iter().zip(combined.chunks_exact(n)) {
            y[b * n..(b + 1) * n].copy_from_slice(combined);
        }
        for k in waves {
            let of = self.model(k);
            let [c, s] = [cosine(k), sine(k)];
            let both = of.widened_parts([block(&c), block(&s)]).concat();
            let product = Product {
                of,
                harmonics: &[&self.harmonics[k - 1]],
                rows: 0..n,
            };
            product.apply_harmonics(&both, &mut y[c * n..(s + 1) * n]);
        }
    }

    /// Rows of [`HarmonicStiffness::apply`], block by block. Harmonics that do not move cost nothing.
    pub(crate) fn apply_rows(&self, rows: Range<usize>, v: &[f64]) -> Vec<f64> {
        let (n, count) = (self.unknowns(), rows.len());
        let mut y = vec![0.0; v.len() / n * count];
        let stiffness = self.reduced.stiffness.subrows(rows.start, count);
        y[..count].copy_from_slice(&times(stiffness, &v[..n]));
        for (k, coefficients) in (1..).zip(&self.harmonics) {
            let [c, s] = [cosine(k), sine(k)];
            if v[c * n..(s + 1) * n].iter().all(|v| *v == 0.0) {
                continue;
            }
            let of = self.model(k);
            let parts = [c, s].map(|block| &v[block * n..(block + 1) * n]);
            let product = Product {
                of,
                harmonics: &[coefficients],
                rows: rows.clone(),
            };
            let both = of.widened_parts(parts).concat();
            product.apply_harmonics(&both, &mut y[c * count..(s + 1) * count]);
        }
        y
    }

    /// Diagonal of Lambda of harmonic k (1..H), without forming the rest.
    pub(crate) fn diagonal(&self, k: usize) -> Vec<c64> {
        let n = self.unknowns();
        let of_pairs = (0..n).flat_map(|i| self.pair_entries(k, i..i + 1, i));
        let mut diagonal: Vec<c64> = of_pairs.collect();
        let Coefficients {
            modes, dashpots, ..
        } = &self.harmonics[k - 1];
        let [forces, motions] = self.columns(k);
        for (m, mode) in modes.iter().enumerate() {
            let both = forces[0].col(m).iter().zip(motions[0].col(m).iter());
            for (d, (force, motion)) in diagonal.iter_mut().zip(both) {
                *d += *mode * (force * motion);
            }
        }
        if let Some(low_rank) = dashpots {
            let row = |of: &Mat<c64>, i: usize| of.row(i).iter().copied().collect::<Vec<_>>();
            for (i, d) in diagonal.iter_mut().enumerate() {
                let moved = motions.each_ref().map(|of| row(of, i));
                let products = low_rank.product([&moved[0], &moved[1]]);
                for (of, product) in forces.iter().zip(&products) {
                    *d += of
                        .row(i)
                        .iter()
                        .zip(product)
                        .map(|(a, b)| a * b)
                        .sum::<c64>();
                }
            }
        }
        diagonal
    }

    /// Columns of Q, those of the coupling and those of the dashpots, as X is forced through them and
    /// as X moves them.
    fn columns(&self, k: usize) -> [[Mat<c64>; 2]; 2] {
        let of = self.model(k);
        let columns = of.model.coupling_and_dashpots();
        [
            columns.map(|columns| of.rows_of_forces(columns)),
            columns.map(|columns| of.rows_of_motions(columns)),
        ]
    }

    /// Lambda of harmonic k (1..H), real and imaginary part, n x n.
    pub(crate) fn formed(&self, k: usize) -> [Mat<f64>; 2] {
        let n = self.unknowns();
        let Coefficients {
            modes, dashpots, ..
        } = &self.harmonics[k - 1];
        let mut parts = [Mat::<f64>::zeros(n, n), Mat::zeros(n, n)];
        for j in 0..n {
            for (i, v) in self.pair_entries(k, 0..n, j).enumerate() {
                (parts[0][(i, j)], parts[1][(i, j)]) = (v.re, v.im);
            }
        }
        let is_wave = self.model(k).wave.is_some();
        if !is_wave {
            // Without complex products, which take twice as long.
            let coupling = self.reduced.coupling.get(.., ..modes.len());
            let of: [fn(c64) -> f64; 2] = [|v| v.re, |v| v.im];
            for (part, of) in parts.iter_mut().zip(of) {
                let scaled = Mat::from_fn(n, modes.len(), |i, m| coupling[(i, m)] * of(modes[m]));
                let other = coupling.transpose();
                matmul(part, Accum::Add, &scaled, other, 1.0, Par::Seq);
            }
        }
        if !is_wave && dashpots.is_none() {
            return parts;
        }
        let [forces, motions] = self.columns(k);
        if is_wave {
            let scaled = Mat::from_fn(n, modes.len(), |i, m| forces[0][(i, m)] * modes[m]);
            let moved = motions[0].get(.., ..modes.len());
            add_parts(
                &mut parts,
                &dense::product(scaled.as_ref(), moved.transpose()),
            );
        }
        if let Some(low_rank) = dashpots {
            let left = low_rank.left_product([&forces[0], &forces[1]]);
            let [on_modes, on_dashpots] =
                [0, 1].map(|i| dense::product(left[i].as_ref(), motions[i].transpose()));
            add_parts(&mut parts, &(on_modes + on_dashpots));
        }
        parts
    }

    /// Entries `rows` of column j of s K - z M of harmonic k: Lambda without the stuck modes.
    fn pair_entries(&self, k: usize, rows: Range<usize>, j: usize) -> impl Iterator<Item = c64> {
        let Coefficients { s, z, .. } = self.harmonics[k - 1];
        let of = self.model(k);
        let entry = move |i| {
            let ReducedModel {
                stiffness, mass, ..
            } = of.model;
            s * of.entry(stiffness, i, j) - z * of.entry(mass, i, j)
        };
        rows.map(entry)
    }
}

/// Adds a complex matrix to its real and imaginary part.
fn add_parts(parts: &mut [Mat<f64>; 2], all: &Mat<c64>) {
    for j in 0..all.ncols() {
        for (i, v) in all.col_as_slice(j).iter().enumerate() {
            parts[0][(i, j)] += v.re;
            parts[1][(i, j)] += v.im;
        }
    }
}

/// Cosine and sine block k (from 0) of a vector without a mean, blocks of n.
fn cosine_and_sine<T>(v: &[T], k: usize, n: usize) -> [&[T]; 2] {
    let block = |with_mean: usize| &v[(with_mean - 1) * n..with_mean * n];
    [block(cosine(k + 1)), block(sine(k + 1))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::dovetail72::dovetail72;

    #[test]
    fn the_diagonal_is_that_of_the_formed_matrix() {
        let problem = dovetail72(1.0);
        let damping = Rayleigh::new(1e-6, 30.0);
        let omega = 0.98 * problem.reduced.omega2[0].sqrt();
        let stiffness = ContactSystem::new(&problem, damping).stiffness(omega, 2);
        for k in 1..=2 {
            let [re, im] = stiffness.formed(k);
            for (i, v) in stiffness.diagonal(k).iter().enumerate() {
                let formed = c64::new(re[(i, i)], im[(i, i)]);
                assert!((v - formed).norm() < 1e-12 * formed.norm(), "{k}, {i}");
            }
        }
    }
}
