//! Dynamic stiffness of the pairs, and the contributions of the stuck modes to loads and fields.
//!
//! With z = w^2 - i w b and s = 1 + i w a (Rayleigh damping a K + b M):
//! `Lambda(w) = s K - z M - sum_m (z^2 / d_m) p_m p_m^T`, `d_m = s w_m^2 - z`,
//! `F(w) = F_X + sum_m (z / d_m) p_m fm_m`, `q_m = (fm_m + z p_m . X) / d_m`.
//! Complex amplitudes: `x(t) = Re(X exp(i w t))`, X = cosine - i sine.
//!
//! Lambda is not formed: K, M and `P = [p_m]` are the same at every frequency and harmonic. They
//! are read once for all harmonics together (matrix times matrix), where one Lambda per harmonic,
//! real and imaginary, would be 2H matrices of the size of K.

use super::Problem;
use crate::reduction::ReducedModel;
use crate::reduction::damping::Rayleigh;
use dovetail_numerics::spectrum::{cosine, sine};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, c64};
use std::ops::Range;

/// Problem with its damping.
pub struct ContactSystem<'a> {
    /// Matrices, laws and excitations.
    pub problem: &'a Problem,
    /// Coefficients a and b.
    pub damping: Rayleigh,
}

/// Dynamic stiffness of the mean and of the harmonics 1..H at one frequency.
pub struct HarmonicStiffness<'a> {
    model: &'a ReducedModel,
    /// Angular frequency of the first harmonic, rad/s.
    omega: f64,
    harmonics: Vec<Coefficients>,
}

/// Coefficients of Lambda of one harmonic: `s K - z M + sum_m modes_m p_m p_m^T`.
#[derive(Debug, Clone)]
pub struct Coefficients {
    /// Factor of K, `1 + i w a`.
    pub s: c64,
    /// Factor of M, `w^2 - i w b`.
    pub z: c64,
    /// Factor of `p_m p_m^T`, for each stuck mode.
    pub modes: Vec<c64>,
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
        let (s, z) = s_and_z(self.damping, omega);
        let mode = |w2: &f64| -(z * z) / (s * *w2 - z);
        Coefficients {
            s,
            z,
            modes: self.problem.reduced.omega2.iter().map(mode).collect(),
        }
    }

    /// Derivatives of the coefficients of harmonic `k` with respect to the frequency of the first
    /// one.
    fn slopes(&self, k: f64, omega: f64) -> Coefficients {
        let (s, z) = s_and_z(self.damping, k * omega);
        let (ds, dz) = s_and_z_slopes(self.damping, k * omega);
        let mode = |w2: &f64| {
            let (d, dd) = (s * *w2 - z, ds * *w2 - dz);
            -(z * (dz * d * 2.0 - z * dd)) / (d * d) * k
        };
        Coefficients {
            s: ds * k,
            z: dz * k,
            modes: self.problem.reduced.omega2.iter().map(mode).collect(),
        }
    }

    /// Lambda at `omega` rad/s, real and imaginary part, n x n.
    pub fn stiffness_at(&self, omega: f64) -> [Mat<f64>; 2] {
        self.stiffness(omega, 1).formed(1)
    }

    /// Load condensed on X at `omega`, from a load of complex amplitude `on_x`, `on_modes`.
    pub fn condensed_load(&self, omega: f64, on_x: &[c64], on_modes: &[c64]) -> Vec<c64> {
        let (s, z) = s_and_z(self.damping, omega);
        let mut load = on_x.to_vec();
        for (m, &fm) in on_modes.iter().enumerate() {
            let amplitude = fm * z / (s * self.problem.reduced.omega2[m] - z);
            self.add_coupled(m, amplitude, &mut load);
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
        let (s, z) = s_and_z(self.damping, omega);
        let (ds, dz) = s_and_z_slopes(self.damping, omega);
        let mut load = on_x_slope.to_vec();
        for (m, (&fm, &dfm)) in on_modes.iter().zip(on_modes_slope).enumerate() {
            let w2 = self.problem.reduced.omega2[m];
            let (d, dd) = (s * w2 - z, ds * w2 - dz);
            let amplitude = dfm * z / d + fm * (dz * d - z * dd) / (d * d);
            self.add_coupled(m, amplitude, &mut load);
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
        let (s, z) = s_and_z(self.damping, omega);
        on_modes
            .iter()
            .enumerate()
            .map(|(m, &fm)| {
                let mut px = c64::new(0.0, 0.0);
                for (v, p) in x.iter().zip(self.problem.reduced.coupling.col(m).iter()) {
                    px += v * *p;
                }
                (fm + z * px) / (s * self.problem.reduced.omega2[m] - z)
            })
            .collect()
    }

    /// Amplitude of each stuck mode for a unit of `p_m . X` at `omega`: z / d_m.
    pub fn modal_shares(&self, omega: f64) -> Vec<c64> {
        let (s, z) = s_and_z(self.damping, omega);
        let omega2 = self.problem.reduced.omega2.iter();
        omega2.map(|w2| z / (s * *w2 - z)).collect()
    }
}

/// s and z at `omega` rad/s.
fn s_and_z(damping: Rayleigh, omega: f64) -> (c64, c64) {
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
        harmonics.iter_mut().for_each(|c| c.modes.truncate(low));
        harmonics
    }

    /// Computes Y = [K v_0, Lambda_1 X_1, ..., Lambda_H X_H] for vectors of 2H+1 blocks: the mean,
    /// then cosine and sine of each harmonic (`X = cosine - i sine`).
    pub fn apply(&self, v: &[f64], y: &mut [f64]) {
        let ReducedModel {
            stiffness,
            mass,
            coupling,
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
        if modes > 0 {
            let mut amplitudes = product(coupling.transpose(), &v[n..]);
            for (c, g) in self
                .harmonics
                .iter()
                .zip(amplitudes.chunks_exact_mut(2 * modes))
            {
                let (gc, gs) = g.split_at_mut(modes);
                for ((gc, gs), a) in gc.iter_mut().zip(gs).zip(&c.modes) {
                    let (c, s) = (*gc, *gs);
                    *gc = a.re * c + a.im * s;
                    *gs = a.re * s - a.im * c;
                }
            }
            modal = product(coupling.as_ref(), &amplitudes);
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
        diagonal
    }

    /// Lambda of harmonic k (1..H), real and imaginary part, n x n.
    pub fn formed(&self, k: usize) -> [Mat<f64>; 2] {
        let (n, coupling) = (self.unknowns(), &self.model.coupling);
        let modes = &self.harmonics[k - 1].modes;
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
