//! Coarse problem: J on the softest motions of the flanks, `W^T J W`, factored for all harmonics
//! together. Where pairs slip and open, these motions couple the harmonics, and a local correction
//! would find them last.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

use super::linear_system::LinearSystem;
use crate::problem::inexact::Inexact;
use dovetail_numerics::dense::{Lu, product};

/// Most motions of all harmonics together: their factor should cost no more than some linear
/// iterations.
pub const MOST_UNKNOWNS: usize = 2000;
/// Number of pairs whose rows are multiplied together.
const PAIRS: usize = 32;

/// Factor of the coarse problem, and the number of motions that it has for each harmonic.
pub struct Coarse {
    factor: Lu,
    motions: usize,
}

impl Coarse {
    /// Coarse problem of a linear system; `None` where there are no motions.
    pub fn new(linear: &LinearSystem) -> Option<Self> {
        let width = linear.width();
        let motions = linear.inexact.motions.nrows().min(MOST_UNKNOWNS / width);
        if motions == 0 {
            return None;
        }
        let columns = Columns::new(linear, motions);
        let size = width * motions;
        let rows: Vec<Mat<f32>> = (0..width)
            .into_par_iter()
            .map(|h| columns.rows_of(linear, h))
            .collect();
        let jacobian = Mat::from_fn(size, size, |i, j| {
            f64::from(rows[i / motions][(j, i % motions)])
        });
        Some(Self {
            factor: Lu::new(jacobian),
            motions,
        })
    }

    /// Computes z = W q with `W^T (v - J z) = 0`, and K z; v is m x (2H+1).
    pub fn solve(&self, inexact: &Inexact, v: MatRef<'_, f32>) -> [Mat<f32>; 2] {
        let width = v.ncols();
        let [motions, forces] =
            [&inexact.motions, &inexact.forces].map(|a| a.get(..self.motions, ..));
        let right = product(motions, v);
        let mut q = Mat::from_fn(self.motions * width, 1, |i, _| {
            f64::from(right[(i % self.motions, i / self.motions)])
        });
        self.factor.solve_in_place(q.as_mut());
        let q = Mat::from_fn(self.motions, width, |i, h| {
            let q = q[(h * self.motions + i, 0)] as f32;
            if q.is_finite() { q } else { 0.0 }
        });
        [motions, forces].map(|a| product(a.transpose(), q.as_ref()))
    }
}

/// Lambda W and Lambda W - eps W, for each pair of blocks that Lambda couples, motions x m.
struct Columns {
    motions: usize,
    /// W^T.
    own: Mat<f32>,
    mean: Mat<f32>,
    /// Real and imaginary part for each harmonic.
    harmonics: Vec<[Mat<f32>; 2]>,
}

impl Columns {
    fn new(linear: &LinearSystem, motions: usize) -> Self {
        let inexact = &linear.inexact;
        let first = |a: &Mat<f32>| a.get(..motions, ..).to_owned();
        let mut mean = first(&inexact.forces);
        if let Some(retention) = &linear.retention {
            for j in 0..motions {
                let motion = inexact.motions.row(j);
                let motion: Vec<f64> = motion.iter().map(|v| f64::from(*v)).collect();
                let mut pull = vec![0.0; motion.len()];
                retention.add_to(&motion, &mut pull);
                for (i, h) in pull.iter().enumerate() {
                    mean[(j, i)] += *h as f32;
                }
            }
        }
        let harmonics = linear.harmonics.par_iter().enumerate();
        Self {
            motions,
            own: first(&inexact.motions),
            mean,
            harmonics: harmonics
                .map(|(k, c)| inexact.dynamic_motions(k + 1, c, motions))
                .collect(),
        }
    }

    /// Block row `to` of `W^T J W`, transposed: all columns x motions.
    fn rows_of(&self, linear: &LinearSystem, to: usize) -> Mat<f32> {
        let (width, motions) = (linear.width(), self.motions);
        let size = width * motions;
        let mut rows = Mat::<f32>::zeros(size, motions);
        let mut image = Mat::<f32>::zeros(size, 3 * PAIRS);
        let mut difference = vec![0.0_f32; motions];
        let pairs = linear.inexact.pairs.len();
        for start in (0..pairs).step_by(PAIRS) {
            let end = pairs.min(start + PAIRS);
            image.fill(0.0);
            Arch::new().dispatch(Images {
                of: self,
                linear,
                to,
                pairs: start..end,
                image: &mut image,
                difference: &mut difference,
            });
            let count = 3 * (end - start);
            matmul(
                rows.as_mut(),
                Accum::Add,
                image.get(.., ..count),
                self.own.get(.., 3 * start..3 * end).transpose(),
                1.0,
                Par::Seq,
            );
        }
        rows
    }

    /// Blocks that block `from` acts on through Lambda, each with its matrix and sign.
    fn coupled(&self, from: usize) -> impl Iterator<Item = (usize, &Mat<f32>, f32)> {
        // Cosine to cosine and sine to sine: Re; sine to cosine: Im; cosine to sine: -Im.
        let (own, other) = match from {
            0 => (&self.mean, None),
            h => {
                let [re, im] = &self.harmonics[(h - 1) / 2];
                let other = if h % 2 == 1 {
                    (h + 1, im, -1.0)
                } else {
                    (h - 1, im, 1.0)
                };
                (re, Some(other))
            }
        };
        [(from, own, 1.0)].into_iter().chain(other)
    }
}

/// Columns of J W on some pairs, at block `to`, one after the other; made with the widest vectors of
/// the processor.
struct Images<'a> {
    of: &'a Columns,
    linear: &'a LinearSystem,
    to: usize,
    pairs: Range<usize>,
    image: &'a mut Mat<f32>,
    /// Room for one column.
    difference: &'a mut [f32],
}

impl WithSimd for Images<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            of,
            linear,
            to,
            pairs,
            image,
            difference,
        } = self;
        let (width, motions) = (linear.width(), of.motions);
        let full = 3 * width;
        for pair in pairs.clone() {
            let d = &linear.derivatives[pair * full * full..(pair + 1) * full * full];
            for from in 0..width {
                for (row, part, sign) in of.coupled(from) {
                    for c in 0..3 {
                        // Entry (c, row) of the pair under the motions of block `from`.
                        let i = 3 * pair + c;
                        let force = part.col_as_slice(i);
                        if row == to {
                            let out = image.col_as_slice_mut(3 * (pair - pairs.start) + c);
                            let out = out[from * motions..(from + 1) * motions].iter_mut();
                            out.zip(force).for_each(|(o, f)| *o += sign * f);
                        }
                        let eps = if row == from { linear.eps[i] } else { 0.0 };
                        let own = of.own.col_as_slice(i).iter();
                        for ((a, f), w) in difference.iter_mut().zip(force).zip(own) {
                            *a = sign * f - eps * w;
                        }
                        let d = &d[(c * width + row) * full..(c * width + row + 1) * full];
                        for r in 0..3 {
                            let by = d[r * width + to];
                            if by != 0.0 {
                                let out = image.col_as_slice_mut(3 * (pair - pairs.start) + r);
                                let out = out[from * motions..(from + 1) * motions].iter_mut();
                                out.zip(&*difference).for_each(|(o, a)| *o -= by * a);
                            }
                        }
                    }
                }
            }
        }
    }
}
