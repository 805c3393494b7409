//! Dynamic stiffness of the pairs, and what the stuck modes add to loads and fields.
//!
//! With z = w^2 - i w b and s = 1 + i w a (Rayleigh damping a K + b M):
//! `Lambda(w) = s K - z M - sum_m (z^2 / d_m) p_m p_m^T`, `d_m = s w_m^2 - z`,
//! `F(w) = F_X + sum_m (z / d_m) p_m fm_m`, `q_m = (fm_m + z p_m . X) / d_m`.
//! Complex amplitudes: `x(t) = Re(X exp(i w t))`, X = cosine - i sine.

use crate::reduction::RelativeModel;
use crate::reduction::damping::Rayleigh;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par, c64};

/// Modes below this multiple of the highest frequency asked for are summed one by one at each
/// frequency; those above enter through a power series, of matrices computed once.
const SERIES_FROM: f64 = 6.0;

/// Dynamic stiffness at one frequency, split into real and imaginary part, n x n, symmetric.
pub struct DynamicStiffness {
    pub re: Mat<f64>,
    pub im: Mat<f64>,
}

/// The reduced model prepared for any frequency up to a highest one.
pub struct ContactSystem<'a> {
    pub model: &'a RelativeModel,
    pub damping: Rayleigh,
    /// Modes summed one by one: the first `low`.
    low: usize,
    /// `sum_{m > low} p_m p_m^T / w_m^(2 (j + 1))`, j = 0, 1, ...
    series: Vec<Mat<f64>>,
}

impl<'a> ContactSystem<'a> {
    /// `highest_rad_s`: the highest angular frequency (harmonics included) that will be asked for.
    pub fn new(model: &'a RelativeModel, damping: Rayleigh, highest_rad_s: f64) -> Self {
        let (n, modes) = (model.coupling.nrows(), model.omega2.len());
        let limit = (SERIES_FROM * highest_rad_s).powi(2);
        let low = model.omega2.partition_point(|&w2| w2 < limit);
        let mut series = Vec::new();
        if low < modes {
            let ratio = highest_rad_s.hypot(damping.mass_per_s) * highest_rad_s / model.omega2[low];
            // Terms until the rest of the geometric series is below rounding.
            let terms = (1..=24).find(|&t| ratio.powi(t) < 1e-16).unwrap_or(24) as usize;
            let high = model.coupling.subcols(low, modes - low);
            let mut scaled = high.to_owned();
            for _ in 0..terms {
                for (j, column) in scaled.col_iter_mut().enumerate() {
                    let scale = 1.0 / model.omega2[low + j];
                    column.iter_mut().for_each(|v| *v *= scale);
                }
                let mut sum = Mat::zeros(n, n);
                matmul(
                    &mut sum,
                    Accum::Replace,
                    &scaled,
                    high.transpose(),
                    1.0,
                    Par::Seq,
                );
                series.push(sum);
            }
        }
        Self {
            model,
            damping,
            low,
            series,
        }
    }

    /// Number of unknowns of one harmonic, 3 per pair.
    pub fn unknowns(&self) -> usize {
        self.model.stiffness.nrows()
    }

    fn s_and_z(&self, omega: f64) -> (c64, c64) {
        let Rayleigh {
            stiffness_s,
            mass_per_s,
        } = self.damping;
        (
            c64::new(1.0, omega * stiffness_s),
            c64::new(omega * omega, -omega * mass_per_s),
        )
    }

    /// Lambda at `omega` rad/s.
    pub fn stiffness_at(&self, omega: f64) -> DynamicStiffness {
        let model = self.model;
        let n = self.unknowns();
        let (s, z) = self.s_and_z(omega);
        // Coefficients of K, M and the series.
        let mut terms: Vec<(c64, MatRef<'_, f64>)> =
            vec![(s, model.stiffness.as_ref()), (-z, model.mass.as_ref())];
        let mut coefficient = -(z * z) / s;
        for matrix in &self.series {
            terms.push((coefficient, matrix.as_ref()));
            coefficient *= z / s;
        }
        let mut re = Mat::zeros(n, n);
        let mut im = Mat::zeros(n, n);
        for j in 0..n {
            let (re, im) = (re.col_as_slice_mut(j), im.col_as_slice_mut(j));
            for (c, matrix) in &terms {
                let column = matrix.col(j);
                for ((r, i), v) in re.iter_mut().zip(im.iter_mut()).zip(column.iter()) {
                    *r += c.re * v;
                    *i += c.im * v;
                }
            }
        }
        let p = model.coupling.subcols(0, self.low);
        let mut scaled_re = p.to_owned();
        let mut scaled_im = p.to_owned();
        for m in 0..self.low {
            let c = -(z * z) / (s * model.omega2[m] - z);
            scaled_re.col_mut(m).iter_mut().for_each(|v| *v *= c.re);
            scaled_im.col_mut(m).iter_mut().for_each(|v| *v *= c.im);
        }
        matmul(
            &mut re,
            Accum::Add,
            &scaled_re,
            p.transpose(),
            1.0,
            Par::Seq,
        );
        matmul(
            &mut im,
            Accum::Add,
            &scaled_im,
            p.transpose(),
            1.0,
            Par::Seq,
        );
        DynamicStiffness { re, im }
    }

    /// Load condensed on X at `omega`, from a load of complex amplitude `on_x`, `on_modes`.
    pub fn condensed_load(&self, omega: f64, on_x: &[c64], on_modes: &[c64]) -> Vec<c64> {
        let (s, z) = self.s_and_z(omega);
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
        let (s, z) = self.s_and_z(omega);
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

impl DynamicStiffness {
    /// Y = Lambda X on cosine and sine parts (`X = cosine - i sine`).
    pub fn apply(
        &self,
        cosine: &[f64],
        sine: &[f64],
        out_cosine: &mut [f64],
        out_sine: &mut [f64],
    ) {
        out_cosine.fill(0.0);
        out_sine.fill(0.0);
        for j in 0..cosine.len() {
            let (c, s) = (cosine[j], sine[j]);
            if c == 0.0 && s == 0.0 {
                continue;
            }
            let (re, im) = (self.re.col_as_slice(j), self.im.col_as_slice(j));
            for (((yc, ys), r), i) in out_cosine
                .iter_mut()
                .zip(out_sine.iter_mut())
                .zip(re)
                .zip(im)
            {
                *yc += r * c + i * s;
                *ys += r * s - i * c;
            }
        }
    }
}
