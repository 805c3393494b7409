//! Truncated Fourier series to equally spaced samples of a period and back.
//!
//! A signal is `x(t) = c_0 + sum_k a_k cos(k t) + b_k sin(k t)`, stored
//! `c_0, a_1, b_1, ..., a_H, b_H`; sample n is at `t = 2 pi n / N`. Few harmonics go through a
//! cosine table, many through `rustfft` (at H = 3, N = 128 the table takes a third of the time of
//! the transform).

use crate::spectrum::{blocks, cosine, sine};
use crate::vector::eight_sums;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::sync::Arc;

/// Number of harmonics above which the fast transform is used.
const TABLE_HARMONICS: usize = 15;

/// Transforms between a number of harmonics and a number of samples.
pub struct Fourier {
    harmonics: usize,
    samples: usize,
    /// Synthesis table, with row n: 1, cos t_n, sin t_n, cos 2 t_n, ..., and zeros up to the padded
    /// width.
    table: Vec<f64>,
    /// The same table without the zeros, transposed: the samples of 1, of cos t, of sin t, ... Empty
    /// where the fast transform is used.
    columns: Vec<f64>,
    transforms: Option<Transforms>,
}

struct Transforms {
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
}

impl Fourier {
    /// Transforms for `samples > 2 harmonics`, so that the analysis of a synthesis is the identity.
    pub fn new(harmonics: usize, samples: usize) -> Self {
        assert!(
            samples > 2 * harmonics,
            "{samples} samples cannot carry {harmonics} harmonics"
        );
        let width = blocks(harmonics);
        let padded = padded(width);
        let mut table = vec![0.0; samples * padded];
        let by_table = harmonics <= TABLE_HARMONICS;
        let mut columns = vec![1.0; if by_table { samples * width } else { 0 }];
        for (n, row) in table.chunks_exact_mut(padded).enumerate() {
            row[0] = 1.0;
            for k in 1..=harmonics {
                // The angle is reduced in integers: exact periodicity whatever k n.
                let turn = ((k * n) % samples) as f64 / samples as f64;
                let (s, c) = (std::f64::consts::TAU * turn).sin_cos();
                for (i, v) in [(cosine(k), c), (sine(k), s)] {
                    row[i] = v;
                    if by_table {
                        columns[i * samples + n] = v;
                    }
                }
            }
        }
        let transforms = (!by_table).then(|| {
            let mut planner = FftPlanner::new();
            Transforms {
                forward: planner.plan_fft_forward(samples),
                inverse: planner.plan_fft_inverse(samples),
            }
        });
        Self {
            harmonics,
            samples,
            table,
            columns,
            transforms,
        }
    }

    /// Number of harmonics besides the mean.
    pub fn harmonics(&self) -> usize {
        self.harmonics
    }
    /// Number of samples of a period.
    #[inline]
    pub fn samples(&self) -> usize {
        self.samples
    }
    /// Number of coefficients of a signal, 2H + 1.
    #[inline]
    pub fn width(&self) -> usize {
        blocks(self.harmonics)
    }
    /// Number of entries of a row of the synthesis table: the width, and at least one zero, up to
    /// whole vectors of four numbers.
    #[inline]
    pub fn padded_width(&self) -> usize {
        padded(self.width())
    }
    /// Factors of the coefficients at sample `n`: 1, cos t_n, sin t_n, cos 2 t_n, ...
    #[inline]
    pub fn synthesis_row(&self, n: usize) -> &[f64] {
        &self.padded_row(n)[..self.width()]
    }
    /// The same factors with zeros behind them, up to the padded width.
    #[inline]
    pub fn padded_row(&self, n: usize) -> &[f64] {
        let padded = self.padded_width();
        &self.table[n * padded..(n + 1) * padded]
    }

    /// All padded rows, N x padded width, row-major.
    #[inline]
    pub fn synthesis(&self) -> &[f64] {
        &self.table
    }

    /// Converts coefficients (2H+1) to samples (N).
    #[inline(always)]
    pub fn to_time(&self, coefficients: &[f64], signal: &mut [f64]) {
        if let Some(transforms) = &self.transforms {
            let mut spectrum = vec![Complex::new(0.0, 0.0); self.samples];
            spectrum[0].re = coefficients[0];
            for k in 1..=self.harmonics {
                let half =
                    Complex::new(0.5 * coefficients[cosine(k)], -0.5 * coefficients[sine(k)]);
                spectrum[k] += half;
                spectrum[self.samples - k] += half.conj();
            }
            transforms.inverse.process(&mut spectrum);
            for (x, z) in signal.iter_mut().zip(&spectrum) {
                *x = z.re;
            }
        } else {
            signal.fill(0.0);
            let columns = self.columns.chunks_exact(self.samples);
            for (column, c) in columns.zip(coefficients) {
                signal.iter_mut().zip(column).for_each(|(x, t)| *x += c * t);
            }
        }
    }

    /// Converts samples (N) to coefficients (2H+1): least squares, exact for a signal of H
    /// harmonics.
    #[inline(always)]
    pub fn to_frequency(&self, signal: &[f64], coefficients: &mut [f64]) {
        let scale = 1.0 / self.samples as f64;
        if let Some(transforms) = &self.transforms {
            let mut spectrum: Vec<_> = signal.iter().map(|&x| Complex::new(x, 0.0)).collect();
            transforms.forward.process(&mut spectrum);
            coefficients[0] = spectrum[0].re * scale;
            for k in 1..=self.harmonics {
                coefficients[cosine(k)] = 2.0 * scale * spectrum[k].re;
                coefficients[sine(k)] = -2.0 * scale * spectrum[k].im;
            }
        } else {
            let columns = self.columns.chunks_exact(self.samples);
            for (c, column) in coefficients.iter_mut().zip(columns) {
                *c = eight_sums(signal, column);
            }
            coefficients[0] *= scale;
            for c in &mut coefficients[1..] {
                *c *= 2.0 * scale;
            }
        }
    }
}

/// Least multiple of four above a width.
fn padded(width: usize) -> usize {
    (width + 1).next_multiple_of(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analysis_undoes_synthesis_through_table_and_transform() {
        for (harmonics, samples) in [(0, 1), (1, 3), (3, 128), (15, 31), (16, 64), (31, 100)] {
            let fourier = Fourier::new(harmonics, samples);
            assert_eq!(fourier.transforms.is_some(), harmonics > TABLE_HARMONICS);
            let coefficients: Vec<f64> = (0..fourier.width())
                .map(|i| ((i * i) as f64 * 0.7 + 0.3).sin())
                .collect();
            let mut signal = vec![0.0; samples];
            fourier.to_time(&coefficients, &mut signal);
            for (n, x) in signal.iter().enumerate() {
                let t = std::f64::consts::TAU * n as f64 / samples as f64;
                let direct = coefficients[0]
                    + (1..=harmonics)
                        .map(|k| {
                            coefficients[cosine(k)] * (k as f64 * t).cos()
                                + coefficients[sine(k)] * (k as f64 * t).sin()
                        })
                        .sum::<f64>();
                assert!((x - direct).abs() < 1e-12);
            }
            assert_eq!(fourier.padded_width() % 4, 0);
            for n in 0..samples {
                let (own, rest) = fourier.padded_row(n).split_at(fourier.width());
                assert_eq!(own, fourier.synthesis_row(n));
                assert!(!rest.is_empty() && rest.iter().all(|v| *v == 0.0));
            }
            let mut back = vec![0.0; fourier.width()];
            fourier.to_frequency(&signal, &mut back);
            for (a, b) in back.iter().zip(&coefficients) {
                assert!((a - b).abs() < 1e-13, "H {harmonics} N {samples}: {a} {b}");
            }
        }
    }
}
