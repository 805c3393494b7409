//! Dynamic stiffness of the pairs, and the contributions of the stuck modes to loads and fields.
//!
//! With z = w^2 - i w b and s = 1 + i w a (Rayleigh damping a K + b M):
//! `Lambda(w) = s K - z M - sum_m (z^2 / d_m) p_m p_m^T`, `d_m = s w_m^2 - z`,
//! `F(w) = F_X + sum_m (z / d_m) p_m fm_m`, `q_m = (fm_m + z p_m . X) / d_m`.
//! Complex amplitudes: `x(t) = Re(X exp(i w t))`, X = cosine - i sine. With damping ratios of
//! stuck modes and with dashpots the sums are those of `elimination.rs`.
//!
//! Lambda is not formed: K, M and `P = [p_m]` are the same at every frequency and harmonic. They
//! are read once for all harmonics together (matrix times matrix), where one Lambda per harmonic,
//! real and imaginary, would be 2H matrices of the size of K.

use super::Problem;
use super::elimination::{Elimination, Factors};
use crate::reduction::ReducedModel;
use crate::reduction::damping::Rayleigh;
use dovetail_numerics::dense;
use dovetail_numerics::spectrum::{cosine, sine};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, c64};
use std::ops::Range;

pub use super::elimination::{Coefficients, LowRank};

/// Least ratio of critical damping that a dashpot counts with.
const LEAST_RATIO: f64 = 1e-12;

/// Problem with its damping.
pub struct ContactSystem<'a> {
    /// Matrices, laws and excitations.
    pub problem: &'a Problem,
    /// Coefficients a and b of all that has no damping of its own.
    pub damping: Rayleigh,
}

/// Dynamic stiffness of the mean and of the harmonics 1..H at one frequency.
pub struct HarmonicStiffness<'a> {
    model: &'a ReducedModel,
    /// Angular frequency of the first harmonic, rad/s.
    omega: f64,
    harmonics: Vec<Coefficients>,
}

impl<'a> ContactSystem<'a> {
    /// System of a problem with this damping.
    pub fn new(problem: &'a Problem, damping: Rayleigh) -> Self {
        Self { problem, damping }
    }

    /// Number of unknowns of one harmonic, 3 per pair.
    pub fn unknowns(&self) -> usize {
        self.problem.reduced.stiffness.nrows()
    }

    /// Lambda at `omega` rad/s and its multiples up to the one of harmonic `harmonics`, and K.
    pub fn stiffness(&self, omega: f64, harmonics: usize) -> HarmonicStiffness<'a> {
        self.of_harmonics(omega, harmonics, |k| self.coefficients(k * omega))
    }

    /// Derivative of Lambda with respect to the frequency of the first harmonic, at `omega` rad/s
    /// and its multiples up to the one of harmonic `harmonics`, N s/m. The mean does not depend on
    /// the frequency: what [`HarmonicStiffness::apply`] writes to its block means nothing.
    pub fn stiffness_slope(&self, omega: f64, harmonics: usize) -> HarmonicStiffness<'a> {
        self.of_harmonics(omega, harmonics, |k| self.slopes(k, omega))
    }

    /// Combination of K, M and p by the coefficients of each harmonic, which `of` gives by its
    /// number.
    pub(super) fn of_harmonics(
        &self,
        omega: f64,
        harmonics: usize,
        of: impl Fn(f64) -> Coefficients,
    ) -> HarmonicStiffness<'a> {
        HarmonicStiffness {
            model: &self.problem.reduced,
            omega,
            harmonics: (1..=harmonics).map(|k| of(k as f64)).collect(),
        }
    }

    fn coefficients(&self, omega: f64) -> Coefficients {
        self.eliminated(omega).coefficients()
    }

    /// Derivatives of the coefficients of harmonic `k` with respect to the frequency of the first
    /// one.
    fn slopes(&self, k: f64, omega: f64) -> Coefficients {
        let slope = self.factor_slopes(k * omega);
        self.eliminated(k * omega).slopes(&slope, k)
    }

    /// Equations at `omega` rad/s without the stuck modes.
    fn eliminated(&self, omega: f64) -> Elimination<'a> {
        Elimination::new(&self.problem.reduced, self.factors(omega), None)
    }

    /// Factors of K, M, the stuck modes and the dashpots at `omega` rad/s.
    fn factors(&self, omega: f64) -> Factors {
        self.factors_by(|damping| s_and_z(damping, omega), c64::new(0.0, omega))
    }

    /// Derivatives of [`ContactSystem::factors`] with respect to `omega`.
    fn factor_slopes(&self, omega: f64) -> Factors {
        self.factors_by(|damping| s_and_z_slopes(damping, omega), c64::new(0.0, 1.0))
    }

    /// Factors of which `of` gives s and z by the damping, that of all or of one mode.
    pub(super) fn factors_by(&self, of: impl Fn(Rayleigh) -> (c64, c64), rate: c64) -> Factors {
        let (s, z) = of(self.damping);
        let own = (0..self.problem.modal_ratios.len()).map(|m| of(self.mode_damping(m)).into());
        Factors {
            s,
            z,
            of_modes: own.collect(),
            rate,
        }
    }

    /// Damping of a stuck mode without the dashpots: its own ratio, or that of all.
    pub fn mode_damping(&self, mode: usize) -> Rayleigh {
        self.problem.mode_damping(self.damping, mode)
    }

    /// Lambda at `omega` rad/s, real and imaginary part, n x n.
    pub fn stiffness_at(&self, omega: f64) -> [Mat<f64>; 2] {
        self.stiffness(omega, 1).formed(1)
    }

    /// Ratio of critical damping of a stuck mode.
    pub fn damping_ratio(&self, mode: usize) -> f64 {
        let reduced = &self.problem.reduced;
        let omega = reduced.omega2[mode].sqrt();
        let Rayleigh {
            stiffness_s,
            mass_per_s,
        } = self.mode_damping(mode);
        let ratio = 0.5 * (stiffness_s * omega + mass_per_s / omega);
        let dashpots = reduced.dashpots.on_modes.row(mode);
        let all = dashpots.iter().zip(&reduced.dashpots.damping_n_s_m);
        let of_dashpots = all.map(|(y, c)| 0.5 * c * y * y / omega);
        of_dashpots.fold(ratio, |sum, part| sum + part)
    }

    /// Returns `true` if something damps a stuck mode.
    pub fn damps(&self, mode: usize) -> bool {
        let own = self.mode_damping(mode);
        let least = match self.problem.reduced.dashpots.count() {
            0 => 0.0,
            // What is less is the rounding of a dashpot at a node of the mode.
            _ => LEAST_RATIO,
        };
        own.stiffness_s > 0.0 || own.mass_per_s > 0.0 || self.damping_ratio(mode) > least
    }

    /// Load condensed on X at `omega`, from a load of complex amplitude `on_x`, `on_modes`.
    pub fn condensed_load(&self, omega: f64, on_x: &[c64], on_modes: &[c64]) -> Vec<c64> {
        let eliminated = self.eliminated(omega);
        let mut load = on_x.to_vec();
        for (m, &fm) in on_modes.iter().enumerate() {
            self.add_coupled(m, eliminated.carried(m, fm), &mut load);
        }
        if let Some(taken) = eliminated.taken(on_modes) {
            self.problem.reduced.add_on_pairs(&taken, &mut load);
        }
        load
    }

    /// Derivative of [`ContactSystem::condensed_load`] with respect to `omega`, for a load with the
    /// derivatives `on_x_slope`, `on_modes_slope`.
    pub fn condensed_load_slope(
        &self,
        omega: f64,
        on_modes: &[c64],
        on_x_slope: &[c64],
        on_modes_slope: &[c64],
    ) -> Vec<c64> {
        let (eliminated, slope) = (self.eliminated(omega), self.factor_slopes(omega));
        let mut load = on_x_slope.to_vec();
        for (m, (&fm, &dfm)) in on_modes.iter().zip(on_modes_slope).enumerate() {
            let amplitude = eliminated.carried_slope(&slope, m, [fm, dfm]);
            self.add_coupled(m, amplitude, &mut load);
        }
        if let Some(taken) = eliminated.taken_slope(&slope, on_modes, on_modes_slope) {
            self.problem.reduced.add_on_pairs(&taken, &mut load);
        }
        load
    }

    /// Adds the coupling of X to a mode, times `amplitude`.
    fn add_coupled(&self, mode: usize, amplitude: c64, load: &mut [c64]) {
        let coupling = self.problem.reduced.coupling.col_as_slice(mode);
        for (f, p) in load.iter_mut().zip(coupling) {
            *f += amplitude * *p;
        }
    }

    /// Amplitudes of the stuck modes under X and a modal load, at `omega`.
    pub fn modal_response(&self, omega: f64, x: &[c64], on_modes: &[c64]) -> Vec<c64> {
        let eliminated = self.eliminated(omega);
        let [px, moved] = self.problem.reduced.moved_by(x);
        let of_mode = |(m, (&fm, &px)): (usize, (&c64, &c64))| eliminated.amplitude(m, fm, px);
        let all = on_modes.iter().zip(&px).enumerate();
        let mut amplitudes: Vec<c64> = all.map(of_mode).collect();
        eliminated.hold([&px, &moved], (on_modes, c64::ZERO), &mut amplitudes);
        amplitudes
    }

    /// Derivative of the displacement `on_x . X + on_modes . q` at `omega` with respect to X.
    pub fn displacement_slope(&self, omega: f64, on_x: &[f64], on_modes: &[f64]) -> Vec<c64> {
        let eliminated = self.eliminated(omega);
        let mut slope: Vec<c64> = on_x.iter().map(|v| c64::new(*v, 0.0)).collect();
        for (m, (share, on)) in eliminated.shares().iter().zip(on_modes).enumerate() {
            let coupling = self.problem.reduced.coupling.col_as_slice(m);
            for (slope, p) in slope.iter_mut().zip(coupling) {
                *slope += share * (*on * *p);
            }
        }
        // The equations are symmetric.
        let on_modes: Vec<c64> = on_modes.iter().map(|v| c64::new(*v, 0.0)).collect();
        if let Some(taken) = eliminated.taken(&on_modes) {
            self.problem.reduced.add_on_pairs(&taken, &mut slope);
        }
        slope
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

impl HarmonicStiffness<'_> {
    /// Number of harmonics besides the mean.
    pub fn harmonics(&self) -> usize {
        self.harmonics.len()
    }

    /// Number of unknowns of one block.
    pub fn unknowns(&self) -> usize {
        self.model.stiffness.nrows()
    }

    /// Coefficients of each harmonic, with the stuck modes below `cut` times the highest of them.
    pub fn coefficients(&self, cut: f64) -> Vec<Coefficients> {
        let highest = cut * self.omega * self.harmonics.len() as f64;
        let below = |w2: &f64| *w2 < highest * highest;
        let low = self.model.omega2.partition_point(below);
        let mut harmonics = self.harmonics.clone();
        for c in &mut harmonics {
            c.modes.truncate(low);
            c.dashpots.iter_mut().for_each(|d| d.truncate(low));
        }
        harmonics
    }

    /// Computes Y = [K v_0, Lambda_1 X_1, ..., Lambda_H X_H] for vectors of 2H+1 blocks: the mean,
    /// then cosine and sine of each harmonic (`X = cosine - i sine`).
    pub fn apply(&self, v: &[f64], y: &mut [f64]) {
        let ReducedModel {
            stiffness,
            mass,
            coupling,
            dashpots,
            ..
        } = self.model;
        let (n, modes) = (self.unknowns(), coupling.ncols());
        let count = 2 * self.harmonics.len();
        let product = |a: MatRef<'_, f64>, b: &[f64]| {
            let (rows, columns) = (a.nrows(), b.len() / a.ncols().max(1));
            let mut out = vec![0.0; rows * columns];
            matmul(
                MatMut::from_column_major_slice_mut(&mut out, rows, columns),
                Accum::Replace,
                a,
                MatRef::from_column_major_slice(b, a.ncols(), columns),
                1.0,
                Par::Seq,
            );
            out
        };
        // In parallel where a core is free, as at the end of a sweep when its other half is done.
        let (stiff, inert) = rayon::join(
            || product(stiffness.as_ref(), v),
            || product(mass.as_ref(), &v[n..]),
        );
        let mut modal = vec![0.0; count * n];
        if modes > 0 || dashpots.count() > 0 {
            let mut amplitudes = product(coupling.transpose(), &v[n..]);
            let held = (dashpots.count() > 0).then(|| {
                let moved = product(dashpots.on_x.transpose(), &v[n..]);
                self.of_dashpots([&amplitudes, &moved])
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
                amplitudes
                    .iter_mut()
                    .zip(on_modes)
                    .for_each(|(a, b)| *a += b);
            }
            if modes > 0 {
                modal = product(coupling.as_ref(), &amplitudes);
            }
            if let Some([_, on_dashpots]) = &held {
                let on_pairs = product(dashpots.on_x.as_ref(), on_dashpots);
                modal.iter_mut().zip(on_pairs).for_each(|(a, b)| *a += b);
            }
        }
        y[..n].copy_from_slice(&stiff[..n]);
        for (k, (c, y)) in self
            .harmonics
            .iter()
            .zip(y[n..].chunks_exact_mut(2 * n))
            .enumerate()
        {
            let (yc, ys) = y.split_at_mut(n);
            combine(
                c,
                cosine_and_sine(&stiff[n..], k, n),
                cosine_and_sine(&inert, k, n),
                cosine_and_sine(&modal, k, n),
                [yc, ys],
            );
        }
    }

    /// Products `L T L^T g` of all harmonics: cosine and sine on the modes and on the dashpots, from
    /// the same of `p^T X` and of the displacements of the dashpots.
    fn of_dashpots(&self, moved: [&[f64]; 2]) -> [Vec<f64>; 2] {
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

    /// Diagonal of Lambda of harmonic k (1..H), without forming the rest.
    pub fn diagonal(&self, k: usize) -> Vec<c64> {
        let n = self.unknowns();
        let of_pairs = (0..n).flat_map(|i| self.of_pairs(k, i..i + 1, i));
        let mut diagonal: Vec<c64> = of_pairs.collect();
        for (m, mode) in self.harmonics[k - 1].modes.iter().enumerate() {
            let coupling = self.model.coupling.col_as_slice(m);
            for (d, p) in diagonal.iter_mut().zip(coupling) {
                *d += *mode * (p * p);
            }
        }
        if let Some(low_rank) = &self.harmonics[k - 1].dashpots {
            let rows = self.model.coupling_and_dashpots();
            for (i, d) in diagonal.iter_mut().enumerate() {
                let own = [0, 1].map(|part| {
                    let row = rows[part].row(i);
                    row.iter().map(|v| c64::new(*v, 0.0)).collect::<Vec<_>>()
                });
                let products = low_rank.product([&own[0], &own[1]]);
                for (own, product) in own.iter().zip(&products) {
                    *d += own.iter().zip(product).map(|(a, b)| a * b).sum::<c64>();
                }
            }
        }
        diagonal
    }

    /// Lambda of harmonic k (1..H), real and imaginary part, n x n.
    pub fn formed(&self, k: usize) -> [Mat<f64>; 2] {
        let (n, coupling) = (self.unknowns(), &self.model.coupling);
        let Coefficients {
            modes, dashpots, ..
        } = &self.harmonics[k - 1];
        let low_rank = dashpots.as_ref().map(|low_rank| {
            let rows = self.model.coupling_and_dashpots().map(complex_matrix);
            let left = low_rank.left_product([&rows[0], &rows[1]]);
            dense::product(left[0].as_ref(), rows[0].transpose())
                + dense::product(left[1].as_ref(), rows[1].transpose())
        });
        let part = |of: fn(c64) -> f64| {
            let mut out = Mat::zeros(n, n);
            for j in 0..n {
                let column = out.col_as_slice_mut(j).iter_mut();
                column
                    .zip(self.of_pairs(k, 0..n, j))
                    .for_each(|(o, v)| *o = of(v));
            }
            let scaled = Mat::from_fn(n, modes.len(), |i, m| coupling[(i, m)] * of(modes[m]));
            let other = coupling.transpose();
            matmul(&mut out, Accum::Add, &scaled, other, 1.0, Par::Seq);
            if let Some(low_rank) = &low_rank {
                out += Mat::from_fn(n, n, |i, j| of(low_rank[(i, j)]));
            }
            out
        };
        [part(|v| v.re), part(|v| v.im)]
    }

    /// Entries `rows` of column j of s K - z M of harmonic k: Lambda without the stuck modes.
    fn of_pairs(&self, k: usize, rows: Range<usize>, j: usize) -> impl Iterator<Item = c64> {
        let Coefficients { s, z, .. } = self.harmonics[k - 1];
        let [stiffness, mass] =
            [&self.model.stiffness, &self.model.mass].map(|a| &a.col_as_slice(j)[rows.clone()]);
        let entries = stiffness.iter().zip(mass);
        entries.map(move |(k, m)| s * *k - z * *m)
    }
}

/// Matrix as a complex one.
fn complex_matrix(a: &Mat<f64>) -> Mat<c64> {
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| c64::new(a[(i, j)], 0.0))
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
