//! Coarse problem: J on the softest motions of the flanks, `W^T J W`, factored for all harmonics
//! together. Where pairs slip and open, these motions couple the harmonics, and a local correction
//! would find them last.
//!
//! The mean and the harmonics up to the highest one excited have all motions. Harmonics above have
//! fewer, the softest: less of the residual is there, and the cost goes with the square of the number
//! of motions.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

use super::linear_system::LinearSystem;
use crate::problem::inexact::Inexact;
use dovetail_numerics::dense::{Lu, product};
use dovetail_numerics::spectrum::{blocks, cosine};

/// Most motions of all harmonics together: their factor should cost no more than some linear
/// iterations.
const MOST_UNKNOWNS: usize = 2000;
/// Fraction of the motions that a harmonic has which is so many times as high as the highest one
/// excited: this over their ratio, and at most all.
const OVERTONE_MOTIONS: f64 = 1.4;
/// Number of pairs whose rows are multiplied together.
const PAIRS: usize = 32;

/// Positions of each block's motions among the unknowns of the coarse problem: the mean, then cosine
/// and sine of each harmonic. Each block has the softest of the motions.
pub(crate) struct Blocks(Vec<Range<usize>>);

impl Blocks {
    /// Blocks of so many harmonics, of which none above `highest_excited` is excited, where so many
    /// motions are there.
    pub(crate) fn new(harmonics: usize, highest_excited: usize, motions: usize) -> Self {
        let fraction = |block: usize| {
            let ratio = block.div_ceil(2) as f64 / highest_excited.max(1) as f64;
            (OVERTONE_MOTIONS / ratio).min(1.0)
        };
        let blocks = 0..blocks(harmonics);
        let sum: f64 = blocks.clone().map(fraction).sum();
        let most = (motions as f64).min(MOST_UNKNOWNS as f64 / sum);
        let mut end = 0;
        let range = |block: usize| {
            let start = end;
            end += (most * fraction(block)) as usize;
            start..end
        };
        Self(blocks.map(range).collect())
    }

    /// Number of unknowns of the coarse problem.
    pub(crate) fn unknowns(&self) -> usize {
        self.0.last().map_or(0, |last| last.end)
    }

    /// Number of motions of a block.
    fn motions(&self, block: usize) -> usize {
        self.0[block].len()
    }

    /// Largest number of motions of a block.
    fn most_motions(&self) -> usize {
        self.motions(0)
    }

    /// Block and motion of each unknown.
    pub(crate) fn blocks_and_motions(&self) -> impl Iterator<Item = (usize, usize)> {
        let blocks = self.0.iter().enumerate();
        blocks.flat_map(|(block, range)| (0..range.len()).map(move |motion| (block, motion)))
    }
}

/// Factor of the coarse problem.
pub(crate) struct Coarse {
    factor: Lu,
    blocks: Blocks,
}

impl Coarse {
    /// Coarse problem of a linear system none of whose harmonics above `highest_excited` is excited;
    /// `None` where there are no motions.
    pub(crate) fn new(linear: &LinearSystem, highest_excited: usize) -> Option<Self> {
        let motions = linear.inexact.motions.nrows();
        let blocks = Blocks::new(linear.harmonics.len(), highest_excited, motions);
        let size = blocks.unknowns();
        if size == 0 {
            return None;
        }
        let columns = CoarseColumns::new(linear, blocks);
        let rows: Vec<Mat<f32>> = (0..linear.width())
            .into_par_iter()
            .map(|h| columns.rows_of(linear, h))
            .collect();
        let blocks = columns.blocks;
        let mut jacobian = Mat::zeros(size, size);
        for (i, (block, motion)) in blocks.blocks_and_motions().enumerate() {
            let row = rows[block].col_as_slice(motion);
            for (j, v) in row.iter().enumerate() {
                jacobian[(i, j)] = f64::from(*v);
            }
        }
        Some(Self {
            factor: Lu::new(jacobian),
            blocks,
        })
    }

    /// Computes z = W q with `W^T (v - J z) = 0`, and K z; v is m x (2H+1).
    pub(crate) fn solve(&self, inexact: &Inexact, v: MatRef<'_, f32>) -> [Mat<f32>; 2] {
        let most = self.blocks.most_motions();
        let [motions, forces] = [&inexact.motions, &inexact.forces].map(|a| a.get(..most, ..));
        let right = product(motions, v);
        let mut q = Mat::zeros(self.blocks.unknowns(), 1);
        for (i, (block, motion)) in self.blocks.blocks_and_motions().enumerate() {
            q[(i, 0)] = f64::from(right[(motion, block)]);
        }
        self.factor.solve_in_place(q.as_mut());
        let mut on_motions = Mat::<f32>::zeros(most, v.ncols());
        for (i, (block, motion)) in self.blocks.blocks_and_motions().enumerate() {
            let q = q[(i, 0)] as f32;
            on_motions[(motion, block)] = if q.is_finite() { q } else { 0.0 };
        }
        [motions, forces].map(|a| product(a.transpose(), on_motions.as_ref()))
    }
}

/// Lambda W on the motions of each block, motions x m.
struct CoarseColumns {
    blocks: Blocks,
    /// W^T.
    own: Mat<f32>,
    mean: Mat<f32>,
    /// Real and imaginary part for each harmonic.
    harmonics: Vec<[Mat<f32>; 2]>,
}

impl CoarseColumns {
    fn new(linear: &LinearSystem, blocks: Blocks) -> Self {
        let inexact = &linear.inexact;
        let motions = blocks.motions(0);
        let mut mean = inexact.forces.get(..motions, ..).to_owned();
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
            own: inexact.motions.get(..blocks.most_motions(), ..).to_owned(),
            mean,
            harmonics: harmonics
                .map(|(k, c)| inexact.dynamic_motions(k + 1, c, blocks.motions(cosine(k + 1))))
                .collect(),
            blocks,
        }
    }

    /// Block row `to` of `W^T J W`, transposed: unknowns x motions.
    fn rows_of(&self, linear: &LinearSystem, to: usize) -> Mat<f32> {
        let (size, motions) = (self.blocks.unknowns(), self.blocks.motions(to));
        let mut rows = Mat::<f32>::zeros(size, motions);
        let mut image = Mat::<f32>::zeros(size, 3 * PAIRS);
        let mut difference = vec![0.0_f32; self.blocks.most_motions()];
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
                self.own.get(..motions, 3 * start..3 * end).transpose(),
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
    of: &'a CoarseColumns,
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
        let width = linear.width();
        for pair in pairs.clone() {
            for from in 0..width {
                let columns = &of.blocks.0[from];
                for (row, part, sign) in of.coupled(from) {
                    for c in 0..3 {
                        // Entry (c, row) of the pair under the motions of block `from`.
                        let i = 3 * pair + c;
                        let force = part.col_as_slice(i);
                        if row == to {
                            let out = image.col_as_slice_mut(3 * (pair - pairs.start) + c);
                            let out = out[columns.clone()].iter_mut();
                            out.zip(force).for_each(|(o, f)| *o += sign * f);
                        }
                        let eps = if row == from { linear.eps[i] } else { 0.0 };
                        let own = of.own.col_as_slice(i).iter();
                        for ((a, f), w) in difference.iter_mut().zip(force).zip(own) {
                            *a = sign * f - eps * w;
                        }
                        for r in 0..3 {
                            let entry = [r * width + to, c * width + row];
                            let by = linear.derivatives.entry(pair, entry);
                            if by != 0.0 {
                                let out = image.col_as_slice_mut(3 * (pair - pairs.start) + r);
                                let out = out[columns.clone()].iter_mut();
                                out.zip(&*difference).for_each(|(o, a)| *o -= by * a);
                            }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn harmonics_above_those_excited_have_fewer_motions_and_all_together_a_bounded_number() {
        let counts = |harmonics, highest_excited, motions| {
            let blocks = Blocks::new(harmonics, highest_excited, motions);
            let counts: Vec<usize> = (0..blocks.0.len()).map(|b| blocks.motions(b)).collect();
            assert_eq!(blocks.unknowns(), counts.iter().sum::<usize>());
            assert_eq!(blocks.blocks_and_motions().count(), blocks.unknowns());
            counts
        };
        assert_eq!(counts(3, 1, 100), [100, 100, 100, 70, 70, 46, 46]);
        // Harmonic 3 is 1.5 times as high as the second; and nothing excited.
        assert_eq!(counts(3, 2, 100), [100, 100, 100, 100, 100, 93, 93]);
        assert_eq!(counts(1, 0, 100), [100; 3]);
        let many = counts(100, 1, 300);
        let sum: usize = many.iter().sum();
        assert!(sum <= MOST_UNKNOWNS && sum > MOST_UNKNOWNS - 201, "{sum}");
        assert_eq!(many[0], many[2]);
        assert_eq!(counts(1, 1, 0), [0; 3]);
    }
}
