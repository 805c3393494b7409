//! Blocks of perturbations, and the multipliers of the space that they span.

use super::bodies::Bodies;
use crate::stability::Reason;
use dovetail_numerics::dense::{Lu, eigenvalues, product, self_adjoint_eigen};
use faer::{Mat, MatRef, c64};
use std::collections::BTreeMap;

/// Perturbations, one in each column.
#[derive(Clone)]
pub(super) struct States {
    /// Displacements and modal amplitudes, then the velocities of both.
    pub(super) motion: Mat<f64>,
    /// Sliders of pairs with springs, two for each.
    pub(super) sliders: Mat<f64>,
}

/// Largest multiplier of a space.
pub(super) struct Ritz {
    pub(super) multiplier: c64,
    /// Norm of the residual of its vector of unit norm.
    pub(super) residual: f64,
}

impl States {
    /// Perturbations that excite each of the slowest modes, and others that excite everything.
    pub(super) fn start(bodies: &Bodies, width: usize) -> Self {
        let columns = bodies.columns();
        let [of_motion, of_sliders] = bodies.weights();
        let modes = bodies.modes.len().min(width / 3);
        let mut random = 0.5_f64;
        let mut draw = |weight: f64| {
            // A sequence of low discrepancy.
            random = (random + 0.618_033_988_749_894_9).fract();
            if weight > 0.0 {
                (random - 0.5) / weight
            } else {
                0.0
            }
        };
        let mut motion = Mat::zeros(2 * columns, width);
        let mut sliders = Mat::zeros(bodies.sliders, width);
        for j in 0..width {
            if j < 2 * modes {
                let i = bodies.displacements.len() + j / 2 + (j % 2) * columns;
                motion[(i, j)] = 1.0 / of_motion[i];
                continue;
            }
            for (i, weight) in of_motion.iter().enumerate() {
                motion[(i, j)] = draw(*weight);
            }
            for (i, weight) in of_sliders.iter().enumerate() {
                sliders[(i, j)] = draw(*weight);
            }
        }
        Self { motion, sliders }
    }

    /// The same perturbations on the unknowns with other names. Those that are added are at rest.
    pub(super) fn renamed(&self, from: &[Vec<usize>; 3], to: &[Vec<usize>; 3]) -> Self {
        let places = |kind: usize| -> Vec<Option<usize>> {
            let known: BTreeMap<usize, usize> = from[kind].iter().copied().zip(0..).collect();
            let places = to[kind].iter().map(|name| known.get(name).copied());
            places.collect()
        };
        let behind = from[0].len();
        let modes = places(1).into_iter().map(|place| Some(behind + place?));
        let motion: Vec<Option<usize>> = places(0).into_iter().chain(modes).collect();
        let velocities = motion
            .iter()
            .map(|place| Some(behind + from[1].len() + (*place)?));
        let motion: Vec<Option<usize>> = motion.iter().copied().chain(velocities).collect();
        let of = |of: &Mat<f64>, places: &[Option<usize>]| {
            Mat::from_fn(places.len(), of.ncols(), |i, j| {
                places[i].map_or(0.0, |i| of[(i, j)])
            })
        };
        Self {
            motion: of(&self.motion, &motion),
            sliders: of(&self.sliders, &places(2)),
        }
    }

    /// Takes away the part of the displacements along these motions, one in each column.
    pub(super) fn remove(&mut self, motions: MatRef<'_, f64>) {
        let (n, count) = (motions.nrows(), motions.ncols());
        if count == 0 {
            return;
        }
        let inner = product(motions.transpose(), motions);
        let mut parts = product(motions.transpose(), self.motion.get(..n, ..));
        Lu::new(inner).solve_in_place(parts.as_mut());
        let moved = product(motions, parts.as_ref());
        let mut own = self.motion.get_mut(..n, ..);
        own -= moved;
    }

    /// Moves from the states on by a multiple of the way to `next`.
    pub(super) fn go_on(&mut self, next: &Self, by: f64) {
        for (own, next) in [
            (&mut self.motion, &next.motion),
            (&mut self.sliders, &next.sliders),
        ] {
            for (own, next) in own.col_iter_mut().zip(next.col_iter()) {
                for (own, next) in own.iter_mut().zip(next.iter()) {
                    *own += by * (next - *own);
                }
            }
        }
    }

    /// Products of all with those of `other`, by these weights.
    fn products(&self, other: &Self, weights: &[Vec<f64>; 2]) -> Mat<f64> {
        let weighted = |of: &Mat<f64>, weights: &[f64]| {
            Mat::from_fn(of.nrows(), of.ncols(), |i, j| weights[i] * of[(i, j)])
        };
        let of = |own: &Mat<f64>, other: &Mat<f64>, weights: &[f64]| {
            let [own, other] = [own, other].map(|of| weighted(of, weights));
            product(own.transpose(), other.as_ref())
        };
        of(&self.motion, &other.motion, &weights[0])
            + of(&self.sliders, &other.sliders, &weights[1])
    }

    /// Combinations of the columns.
    pub(super) fn times(&self, by: &Mat<f64>) -> Self {
        let [motion, sliders] =
            [&self.motion, &self.sliders].map(|of| product(of.as_ref(), by.as_ref()));
        Self { motion, sliders }
    }

    /// Orthonormal basis of the space but for directions below `least` of the largest one.
    pub(super) fn orthonormal(&self, weights: &[Vec<f64>; 2], least: f64) -> Option<Self> {
        let (squares, shapes) = self_adjoint_eigen(self.products(self, weights).as_ref())?;
        let largest = *squares.last()?;
        let kept = |i: &usize| squares[*i] > least * least * largest;
        let kept: Vec<usize> = (0..squares.len()).filter(kept).collect();
        let by = Mat::from_fn(squares.len(), kept.len(), |i, j| {
            shapes[(i, kept[j])] / squares[kept[j]].sqrt()
        });
        (largest > 0.0 && largest.is_finite()).then(|| self.times(&by))
    }

    /// Largest multiplier in the space of this orthonormal basis, of the map with these images of it.
    pub(super) fn ritz(&self, images: &Self, weights: &[Vec<f64>; 2]) -> Result<Ritz, Reason> {
        let on_space = self.products(images, weights);
        let values = eigenvalues(on_space.as_ref()).ok_or(Reason::NotFound)?;
        let above = values.into_iter().filter(|v| v.im >= 0.0);
        let multiplier = above.max_by(|a, b| a.norm().total_cmp(&b.norm()));
        let multiplier = multiplier.ok_or(Reason::NotFound)?;
        // Inverse iteration for its vector.
        let size = on_space.nrows();
        let shift = multiplier * (1.0 + 1e-9) + 1e-12;
        let shifted = Mat::from_fn(size, size, |i, j| {
            let own = if i == j { shift } else { c64::ZERO };
            own - on_space[(i, j)]
        });
        let factor = Lu::new(shifted);
        let mut vector: Vec<c64> = (0..size).map(|i| c64::cis(i as f64)).collect();
        for _ in 0..3 {
            factor.solve_column_in_place(&mut vector);
            let norm = vector.iter().map(c64::norm_sqr).sum::<f64>().sqrt();
            vector.iter_mut().for_each(|v| *v /= norm);
        }
        // What the images have outside of the space.
        let outside = self.times(&on_space);
        let outside = Self {
            motion: &images.motion - outside.motion,
            sliders: &images.sliders - outside.sliders,
        };
        let squares = outside.products(&outside, weights);
        let mut square = 0.0;
        for j in 0..size {
            for i in 0..size {
                square += (vector[i].conj() * vector[j]).re * squares[(i, j)];
            }
        }
        Ok(Ritz {
            multiplier,
            residual: square.max(0.0).sqrt(),
        })
    }
}
