//! Linear systems of Newton's method on the flanks: J = Lambda - D (Lambda - eps) on the pairs that
//! take part, with K in single precision.

use std::sync::Arc;

use dovetail_numerics::spectrum::blocks;
use faer::{Mat, MatRef};
use pulp::{Arch, Simd, WithSimd};

use super::retention::Retention;
use crate::problem::dynamic_stiffness::Coefficients;
use crate::problem::inexact::Inexact;

/// Jacobian J at one point. Vectors are blocks of m: the mean, then cosine and sine of each
/// harmonic.
pub(crate) struct LinearSystem {
    pub inexact: Arc<Inexact>,
    pub harmonics: Vec<Coefficients>,
    /// D of each pair.
    pub derivatives: PairDerivatives,
    /// Retention, restricted to the pairs that take part.
    pub retention: Option<Retention>,
    /// eps of each unknown, N/m.
    pub eps: Vec<f32>,
}

/// Number of entries of a column of D that are multiplied together.
const LANES: usize = 8;

/// D of pairs, 3(2H+1) square with component-major indices.
pub(crate) struct PairDerivatives {
    size: usize,
    /// Length of a column, which zeros fill up to whole vectors.
    padded: usize,
    /// Index of the first entry of each pair; `None` for the identity.
    starts: Vec<Option<usize>>,
    /// Entries of the pairs, by columns.
    entries: Vec<f32>,
}

impl PairDerivatives {
    /// Derivatives of no pair yet, for vectors of so many blocks, with room for those of `moving`
    /// pairs.
    pub(crate) fn new(width: usize, moving: usize) -> Self {
        let size = 3 * width;
        let padded = size.next_multiple_of(LANES);
        Self {
            size,
            padded,
            starts: Vec::new(),
            entries: Vec::with_capacity(moving * size * padded),
        }
    }

    /// Adds a pair with the entries `entry(row, column)`.
    #[inline(always)]
    pub(crate) fn push(&mut self, entry: impl Fn(usize, usize) -> f32) {
        let start = self.entries.len();
        self.starts.push(Some(start));
        self.entries.resize(start + self.size * self.padded, 0.0);
        let columns = self.entries[start..].chunks_exact_mut(self.padded);
        for (j, column) in columns.enumerate() {
            for (i, out) in column[..self.size].iter_mut().enumerate() {
                *out = entry(i, j);
            }
        }
    }

    /// Adds a pair that sticks throughout, whose D is the identity.
    pub(crate) fn push_identity(&mut self) {
        self.starts.push(None);
    }

    /// Removes all pairs.
    pub(crate) fn clear(&mut self) {
        self.starts.clear();
        self.entries.clear();
    }

    /// Padded columns of a pair, one after the other; `None` for the identity.
    #[inline(always)]
    fn columns(&self, pair: usize) -> Option<&[f32]> {
        self.starts[pair].map(|start| &self.entries[start..start + self.size * self.padded])
    }

    /// Entry of a pair at a row and a column.
    #[inline(always)]
    pub(crate) fn entry(&self, pair: usize, [row, column]: [usize; 2]) -> f32 {
        match self.starts[pair] {
            Some(start) => self.entries[start + column * self.padded + row],
            None => f32::from(u8::from(row == column)),
        }
    }

    /// Largest entry by size.
    pub(crate) fn largest(&self) -> f32 {
        let identity = f32::from(u8::from(self.starts.contains(&None)));
        self.entries.iter().fold(identity, |m, d| m.max(d.abs()))
    }
}

impl LinearSystem {
    /// Number of blocks of a vector, 2H+1.
    pub(crate) fn width(&self) -> usize {
        blocks(self.harmonics.len())
    }

    /// Computes J x from x and K x.
    pub(crate) fn apply(&self, x: MatRef<'_, f32>, kx: Mat<f32>) -> Mat<f32> {
        let m = x.nrows();
        let mut y = self.inexact.dynamic(&self.harmonics, x, kx);
        if let Some(retention) = &self.retention {
            let mean: Vec<f64> = x.col(0).iter().map(|v| f64::from(*v)).collect();
            let mut pull = vec![0.0; m];
            retention.add_to(&mean, &mut pull);
            let column = y.col_as_slice_mut(0).iter_mut();
            column.zip(&pull).for_each(|(y, p)| *y += *p as f32);
        }
        self.subtract_contact_response(&mut y, |y, i, h| y - self.eps[i] * x[(i, h)]);
        y
    }

    /// Computes (I - D) v, the part of the forces v that the contact forces do not balance.
    pub(crate) fn unbalanced_part(&self, v: &[f64]) -> Vec<f64> {
        let m = self.inexact.unknowns();
        let mut y = Mat::from_fn(m, self.width(), |i, h| v[h * m + i] as f32);
        self.subtract_contact_response(&mut y, |y, _, _| y);
        let mut out = vec![0.0; v.len()];
        widen(y.as_ref(), &mut out);
        out
    }

    /// Computes y := y - D a, with a from each entry of y, its row and its block.
    fn subtract_contact_response(&self, y: &mut Mat<f32>, a: impl Fn(f32, usize, usize) -> f32) {
        Arch::new().dispatch(Subtract { of: self, y, a });
    }
}

/// [`LinearSystem::subtract_contact_response`] with the widest vectors of the processor.
struct Subtract<'a, A> {
    of: &'a LinearSystem,
    y: &'a mut Mat<f32>,
    a: A,
}

impl<A: Fn(f32, usize, usize) -> f32> WithSimd for Subtract<'_, A> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { of, y, a } = self;
        let width = of.width();
        let PairDerivatives { size, padded, .. } = of.derivatives;
        let (mut difference, mut moved) = (vec![0.0_f32; size], vec![0.0_f32; padded]);
        for pair in 0..of.inexact.pairs.len() {
            for c in 0..3 {
                let i = 3 * pair + c;
                for h in 0..width {
                    difference[c * width + h] = a(y[(i, h)], i, h);
                }
            }
            match of.derivatives.columns(pair) {
                None => moved[..size].copy_from_slice(&difference),
                Some(d) => {
                    for (i, moved) in moved.chunks_exact_mut(LANES).enumerate() {
                        let rows = LANES * i..LANES * (i + 1);
                        let mut sums = [0.0_f32; LANES];
                        for (column, a) in d.chunks_exact(padded).zip(&difference) {
                            for (sum, d) in sums.iter_mut().zip(&column[rows.clone()]) {
                                *sum += d * a;
                            }
                        }
                        moved.copy_from_slice(&sums);
                    }
                }
            }
            for c in 0..3 {
                for h in 0..width {
                    y[(3 * pair + c, h)] -= moved[c * width + h];
                }
            }
        }
    }
}

/// Copies `a` to double precision, block by block.
pub(crate) fn widen(a: MatRef<'_, f32>, out: &mut [f64]) {
    let m = a.nrows();
    for (h, out) in out.chunks_exact_mut(m).enumerate() {
        let column = a.col(h).iter();
        out.iter_mut()
            .zip(column)
            .for_each(|(o, v)| *o = f64::from(*v));
    }
}
