//! Dynamic stiffness of the pairs, and what the stuck modes add to loads and fields.
//!
//! With z = w^2 - i w b and s = 1 + i w a (Rayleigh damping a K + b M):
//! `Lambda(w) = s K - z M - sum_m (z^2 / d_m) p_m p_m^T`, `d_m = s w_m^2 - z`,
//! `F(w) = F_X + sum_m (z / d_m) p_m fm_m`, `q_m = (fm_m + z p_m . X) / d_m`.
//! Complex amplitudes: `x(t) = Re(X exp(i w t))`, X = cosine - i sine.
//!
//! Lambda is not formed: K, M and P = [p_m] are the same at every frequency and harmonic, so that they are
//! read once for all harmonics together (matrix times matrix), where one Lambda per harmonic, real and imaginary,
//! would be 2H matrices of the size of K.

use std::borrow::Cow;

use crate::reduction::RelativeModel;
use crate::reduction::damping::Rayleigh;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par, c64};

/// The reduced model with its damping.
pub struct ContactSystem<'a> {
    pub model: &'a RelativeModel,
    pub damping: Rayleigh,
}

/// K, M and P on all unknowns of a block, or on some of them.
#[derive(Clone)]
pub struct Matrices<'a> {
    /// m x m.
    pub stiffness: Cow<'a, Mat<f64>>,
    /// m x m.
    pub mass: Cow<'a, Mat<f64>>,
    /// m x modes.
    pub coupling: Cow<'a, Mat<f64>>,
}

/// Stiffness of the mean and of the harmonics 1..H at one frequency.
pub struct HarmonicStiffness<'a> {
    matrices: Matrices<'a>,
    /// Squared frequencies of the stuck modes, rad^2/s^2.
    omega2: &'a [f64],
    damping: Rayleigh,
    /// Of the first harmonic, rad/s.
    omega: f64,
    harmonics: Vec<Coefficients>,
}

/// Lambda of one harmonic: `s K - z M + sum_m modes_m p_m p_m^T`.
#[derive(Clone)]
struct Coefficients {
    s: c64,
    z: c64,
    modes: Vec<c64>,
}

impl<'a> ContactSystem<'a> {
    pub fn new(model: &'a RelativeModel, damping: Rayleigh) -> Self {
        Self { model, damping }
    }

    /// Number of unknowns of one harmonic, 3 per pair.
    pub fn unknowns(&self) -> usize {
        self.model.stiffness.nrows()
    }

    /// Lambda at `omega` rad/s and its multiples up to the one of harmonic `harmonics`, and K.
    pub fn stiffness(&self, omega: f64, harmonics: usize) -> HarmonicStiffness<'a> {
        let model = self.model;
        HarmonicStiffness {
            omega2: &model.omega2,
            damping: self.damping,
            omega,
            matrices: Matrices {
                stiffness: Cow::Borrowed(&model.stiffness),
                mass: Cow::Borrowed(&model.mass),
                coupling: Cow::Borrowed(&model.coupling),
            },
            harmonics: (1..=harmonics)
                .map(|k| coefficients(&model.omega2, self.damping, k as f64 * omega))
                .collect(),
        }
    }

    /// Lambda at `omega` rad/s, real and imaginary part, n x n.
    pub fn stiffness_at(&self, omega: f64) -> [Mat<f64>; 2] {
        self.stiffness(omega, 1).formed(1.0, f64::INFINITY)
    }

    /// Load condensed on X at `omega`, from a load of complex amplitude `on_x`, `on_modes`.
    pub fn condensed_load(&self, omega: f64, on_x: &[c64], on_modes: &[c64]) -> Vec<c64> {
        let (s, z) = s_and_z(self.damping, omega);
        let mut load = on_x.to_vec();
        for (m, &fm) in on_modes.iter().enumerate() {
            let amplitude = fm * z / (s * self.model.omega2[m] - z);
            for (f, p) in load.iter_mut().zip(self.model.coupling.col(m).iter()) {
                *f += amplitude * *p;
            }
        }
        load
    }

    /// Amplitudes of the stuck modes under X and a modal load, at `omega`.
    pub fn modal_response(&self, omega: f64, x: &[c64], on_modes: &[c64]) -> Vec<c64> {
        let (s, z) = s_and_z(self.damping, omega);
        on_modes
            .iter()
            .enumerate()
            .map(|(m, &fm)| {
                let mut px = c64::new(0.0, 0.0);
                for (v, p) in x.iter().zip(self.model.coupling.col(m).iter()) {
                    px += v * *p;
                }
                (fm + z * px) / (s * self.model.omega2[m] - z)
            })
            .collect()
    }
}

/// s and z at `omega` rad/s.
fn s_and_z(damping: Rayleigh, omega: f64) -> (c64, c64) {
    let Rayleigh {
        stiffness_s,
        mass_per_s,
    } = damping;
    (
        c64::new(1.0, omega * stiffness_s),
        c64::new(omega * omega, -omega * mass_per_s),
    )
}

fn coefficients(omega2: &[f64], damping: Rayleigh, omega: f64) -> Coefficients {
    let (s, z) = s_and_z(damping, omega);
    let mode = |w2: &f64| -(z * z) / (s * *w2 - z);
    Coefficients {
        s,
        z,
        modes: omega2.iter().map(mode).collect(),
    }
}

/// `s K - z M + P c P^T` on columns: cosine and sine parts of a harmonic, from those of K X, M X and P c P^T X.
fn combine(c: &Coefficients, [kc, ks]: [&[f64]; 2], [mc, ms]: [&[f64]; 2], out: [&mut [f64]; 2]) {
    let [out_c, out_s] = out;
    for (i, (yc, ys)) in out_c.iter_mut().zip(out_s).enumerate() {
        *yc += c.s.re * kc[i] + c.s.im * ks[i] - c.z.re * mc[i] - c.z.im * ms[i];
        *ys += c.s.re * ks[i] - c.s.im * kc[i] - c.z.re * ms[i] + c.z.im * mc[i];
    }
}

impl<'a> HarmonicStiffness<'a> {
    pub fn harmonics(&self) -> usize {
        self.harmonics.len()
    }

    /// Unknowns of one block.
    pub fn unknowns(&self) -> usize {
        self.matrices.stiffness.nrows()
    }

    /// K of the mean.
    pub fn mean(&self) -> &Mat<f64> {
        &self.matrices.stiffness
    }

    /// The same on the unknowns `columns` (ascending) alone.
    pub fn restricted(&self, columns: &[usize]) -> HarmonicStiffness<'a> {
        let matrices = if columns.len() == self.unknowns() {
            self.matrices.clone()
        } else {
            let coupling = &self.matrices.coupling;
            Matrices {
                stiffness: Cow::Owned(submatrix(&self.matrices.stiffness, columns)),
                mass: Cow::Owned(submatrix(&self.matrices.mass, columns)),
                coupling: Cow::Owned(Mat::from_fn(columns.len(), coupling.ncols(), |i, m| {
                    coupling[(columns[i], m)]
                })),
            }
        };
        HarmonicStiffness {
            matrices,
            omega2: self.omega2,
            damping: self.damping,
            omega: self.omega,
            harmonics: self.harmonics.clone(),
        }
    }

    /// Y = [K v_0, Lambda_1 X_1, ..., Lambda_H X_H] of vectors of 2H+1 blocks: the mean, then cosine and sine of each
    /// harmonic (`X = cosine - i sine`).
    pub fn apply(&self, v: &[f64], y: &mut [f64]) {
        let Matrices {
            stiffness,
            mass,
            coupling,
        } = &self.matrices;
        let (n, modes) = (self.unknowns(), coupling.ncols());
        let count = 2 * self.harmonics.len();
        let columns = |v: &'_ [f64]| v.len() / n.max(1);
        let vibrating = MatRef::from_column_major_slice(&v[n..], n, count);
        let product = |a: &Mat<f64>, b: &[f64]| {
            let mut out = vec![0.0; b.len()];
            matmul(
                MatMut::from_column_major_slice_mut(&mut out, n, columns(b)),
                Accum::Replace,
                a,
                MatRef::from_column_major_slice(b, n, columns(b)),
                1.0,
                Par::Seq,
            );
            out
        };
        let stiff = product(stiffness, v);
        let inert = product(mass, &v[n..]);
        y.fill(0.0);
        if modes > 0 {
            let mut amplitudes = Mat::<f64>::zeros(modes, count);
            matmul(
                &mut amplitudes,
                Accum::Replace,
                coupling.transpose(),
                vibrating,
                1.0,
                Par::Seq,
            );
            for (k, c) in self.harmonics.iter().enumerate() {
                for (m, a) in c.modes.iter().enumerate() {
                    let (gc, gs) = (amplitudes[(m, 2 * k)], amplitudes[(m, 2 * k + 1)]);
                    amplitudes[(m, 2 * k)] = a.re * gc + a.im * gs;
                    amplitudes[(m, 2 * k + 1)] = a.re * gs - a.im * gc;
                }
            }
            matmul(
                MatMut::from_column_major_slice_mut(&mut y[n..], n, count),
                Accum::Replace,
                coupling.as_ref(),
                &amplitudes,
                1.0,
                Par::Seq,
            );
        }
        y[..n].copy_from_slice(&stiff[..n]);
        for (k, (c, y)) in self
            .harmonics
            .iter()
            .zip(y[n..].chunks_exact_mut(2 * n))
            .enumerate()
        {
            let (ks, ms) = (&stiff[(2 * k + 1) * n..], &inert[2 * k * n..]);
            let (yc, ys) = y.split_at_mut(n);
            combine(
                c,
                [&ks[..n], &ks[n..2 * n]],
                [&ms[..n], &ms[n..2 * n]],
                [yc, ys],
            );
        }
    }

    /// Lambda of harmonic k, also of one between two, real and imaginary part, m x m, with the stuck modes below `cut` times its own
    /// frequency (all of them: infinite).
    pub fn formed(&self, k: f64, cut: f64) -> [Mat<f64>; 2] {
        let Matrices {
            stiffness,
            mass,
            coupling,
        } = &self.matrices;
        let omega = k * self.omega;
        let c = coefficients(self.omega2, self.damping, omega);
        let low = self
            .omega2
            .partition_point(|&w2| w2 < (cut * omega).powi(2));
        let p = coupling.subcols(0, low);
        let part = |s: f64, z: f64, mode: &dyn Fn(usize) -> f64| {
            let n = self.unknowns();
            let mut out = Mat::zeros(n, n);
            for j in 0..n {
                let (k, m) = (stiffness.col_as_slice(j), mass.col_as_slice(j));
                let out = out.col_as_slice_mut(j);
                for ((o, k), m) in out.iter_mut().zip(k).zip(m) {
                    *o = s * k - z * m;
                }
            }
            let scaled = Mat::from_fn(n, low, |i, m| p[(i, m)] * mode(m));
            matmul(&mut out, Accum::Add, &scaled, p.transpose(), 1.0, Par::Seq);
            out
        };
        [
            part(c.s.re, c.z.re, &|m| c.modes[m].re),
            part(c.s.im, c.z.im, &|m| c.modes[m].im),
        ]
    }
}

/// Rows and columns `columns` of a square matrix.
pub fn submatrix(matrix: &Mat<f64>, columns: &[usize]) -> Mat<f64> {
    let mut out = Mat::zeros(columns.len(), columns.len());
    for (j, &source) in columns.iter().enumerate() {
        let from = matrix.col_as_slice(source);
        let to = out.col_as_slice_mut(j);
        to.iter_mut().zip(columns).for_each(|(t, &i)| *t = from[i]);
    }
    out
}
