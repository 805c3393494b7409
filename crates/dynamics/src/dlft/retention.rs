//! The mean position along motions that only friction holds.
//!
//! A blade can slide along its slot as a rigid body, and a wedge under platforms along its edges:
//! nothing elastic opposes it (under rotation a slot at an angle to the engine axis even drives it
//! on). Friction holds it as long as some pairs stick. Where all slip in every period, the balance
//! either has a whole line of means or, with the weak force of rotation, one very far away: the
//! body walks. The vibration is then computed with the mean retained at the static state, as an
//! axial retention (lock plate) does, by a stiff spring on these motions alone; the force in it is
//! reported. Bodies that supports and springs hold with all pairs open have no such motion.
//!
//! Friction holds a body where the pairs that stick throughout leave none of these motions possible
//! (`Retention::is_blocked_by`). This decides between the two balances, whichever way a solution
//! was found.

use super::slow_excitation::SlowExcitation;
use crate::problem::Problem;
use crate::problem::tangential;
use crate::reduced::{FREE, ReducedModel};
use dovetail_numerics::dense;
use dovetail_numerics::dense::parallel;
use dovetail_numerics::eigen::independent;
use dovetail_numerics::vector::{axpy, dot, norm};
use faer::Mat;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// A motion counts as held by friction alone where its stiffness is below this fraction of the mean
/// stiffness of the pairs.
const SOFT: f64 = 1e-4;
/// Shift of the inverse iteration, as a fraction of the mean stiffness.
const SHIFT: f64 = 1e-3;
/// Number of tangential rigid motions that are looked for first: two translations and a turn, of a
/// body on one flat flank. Several bodies have more: while all that were looked for are free, twice
/// as many are looked for.
const FIRST_FREE: usize = 3;
const INVERSE_ITERATIONS: usize = 12;
/// The mean has walked off when it lies this many times farther from the static state than the
/// static state from rest and the vibration from the mean.
const FAR: f64 = 2.0;
/// Stuck pairs block the motions where every motion of length 1 on all pairs has at least this
/// squared length on the stuck ones.
const BLOCKED: f64 = 1e-9;

/// Treatment of the mean along the motions that only friction holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mean {
    /// The mean is left to friction, or nothing moves it.
    Free,
    /// A spring retains the mean, as a lock plate does.
    Retained,
}

/// Supports of a model besides friction, and its free motions, found when first asked for.
#[derive(Debug)]
pub struct Holding {
    problem: Problem,
    without_contact: OnceLock<bool>,
    along_contacts: OnceLock<Arc<Retention>>,
    slow_excitation: OnceLock<SlowExcitation>,
}

impl Holding {
    /// Holding of a model.
    pub fn new(problem: &Problem) -> Self {
        Self {
            problem: problem.clone(),
            without_contact: OnceLock::new(),
            along_contacts: OnceLock::new(),
            slow_excitation: OnceLock::new(),
        }
    }

    /// Returns `true` if the bodies are [held without
    /// contact](crate::reduced::ReducedModel::is_held_without_contact).
    pub(crate) fn is_held_without_contact(&self) -> bool {
        let reduced = &self.problem.reduced;
        *self.without_contact.get_or_init(|| {
            // Mostly a motion along the contacts is free, which spares the factor of the stiffness.
            let mut along = self.tangential_motions().motions.iter();
            !along.any(|motion| reduced.is_free(motion)) && reduced.is_held_without_contact()
        })
    }

    /// Motions that nothing holds where all pairs are open: orthonormal, in relative displacements.
    pub fn free_motions(&self) -> Vec<Vec<f64>> {
        let diagonal = self.problem.reduced.diagonal_stiffness();
        let mean_stiffness = diagonal.iter().sum::<f64>() / diagonal.len().max(1) as f64;
        softer_than(&self.problem.reduced.stiffness, mean_stiffness, FREE)
    }

    /// Motions that only friction holds; `None` where there are none.
    pub fn retention(&self) -> Option<&Arc<Retention>> {
        let retention = self.tangential_motions();
        (retention.is_needed() && !self.is_held_without_contact()).then_some(retention)
    }

    /// Motions with hardly any stiffness where the normal displacements of all pairs are held.
    fn tangential_motions(&self) -> &Arc<Retention> {
        self.along_contacts.get_or_init(|| {
            let reduced = &self.problem.reduced;
            Retention::new(&reduced.stiffness, &reduced.diagonal_stiffness()).into()
        })
    }

    /// Returns `true` if, at some instant of the period, no contact forces balance the excitations,
    /// applied slowly with these factors, and the steady load ([`super::slow_excitation`]).
    /// `lambda_static_n` are the contact forces of the static state, N, n.
    pub(crate) fn excitation_exceeds_contact(
        &self,
        lambda_static_n: &[f64],
        factors: &[f64],
    ) -> bool {
        if self.is_held_without_contact() {
            return false;
        }
        let problem = &self.problem;
        let slow = self.slow_excitation.get_or_init(|| {
            let retained = self.retention().map_or(&[][..], |r| &r.motions);
            SlowExcitation::new(problem, self.motions_free_in_all_waves(), retained)
        });
        slow.exceeds_contact(problem, lambda_static_n, factors)
    }

    /// Motions of the sector that nothing holds where all pairs are open, whatever the waves of the
    /// excitations: orthonormal, in relative displacements.
    fn motions_free_in_all_waves(&self) -> Vec<Vec<f64>> {
        let reduced = &self.problem.reduced;
        let mut waves = BTreeMap::new();
        for load in &self.problem.excitations {
            let of = reduced.harmonic_model(load.harmonic);
            waves.extend(of.wave.map(|wave| (wave.nodal_diameter, of.model)));
        }
        if waves.is_empty() {
            return self.free_motions();
        }
        let mut stiffness = reduced.stiffness.clone();
        let n = stiffness.nrows();
        for own in waves.into_values().map(|model| &model.stiffness) {
            (0..n).for_each(|j| (0..n).for_each(|i| stiffness[(i, j)] += own[(i, j)]));
        }
        let mean_stiffness = (0..n).map(|i| stiffness[(i, i)]).sum::<f64>() / n.max(1) as f64;
        softer_than(&stiffness, mean_stiffness, FREE)
    }
}

/// Motions of the pairs that only friction holds, and the spring that can retain them.
#[derive(Debug, Clone)]
pub struct Retention {
    /// Orthonormal tangential motions, n entries each.
    motions: Vec<Vec<f64>>,
    /// Stiffness of the spring, N/m.
    stiffness_n_m: f64,
}

impl Retention {
    /// Finds the motions with which `stiffness` (n x n, N/m), its normal rows held, is negligible
    /// beside `own`, its diagonal.
    pub(crate) fn new(stiffness: &Mat<f64>, own: &[f64]) -> Self {
        let n = stiffness.nrows();
        let tangential = tangential(n);
        let size = tangential.len();
        let mean_stiffness = tangential.iter().map(|&i| own[i]).sum::<f64>() / size.max(1) as f64;
        let k = Mat::from_fn(size, size, |i, j| stiffness[(tangential[i], tangential[j])]);
        let with_normals = |free: Vec<f64>| {
            let mut motion = vec![0.0; n];
            tangential
                .iter()
                .zip(free)
                .for_each(|(&i, v)| motion[i] = v);
            motion
        };
        let free = softer_than(&k, mean_stiffness, SOFT).into_iter();
        Self {
            motions: free.map(with_normals).collect(),
            stiffness_n_m: mean_stiffness,
        }
    }

    /// Returns `true` if there is any such motion.
    pub(crate) fn is_needed(&self) -> bool {
        !self.motions.is_empty()
    }

    /// Returns `true` if the stiffness of `model`, from which this was found, is rounding along some of
    /// the motions: without friction the mean then has a whole line of positions.
    pub(crate) fn is_indifferent(&self, model: &ReducedModel) -> bool {
        let mut motions = self.motions.iter();
        motions.any(|motion| model.elastic_product(motion).abs() < FREE * self.stiffness_n_m)
    }

    /// Retention with the same motions, on a spring of this fraction of the stiffness.
    pub(crate) fn softened(&self, fraction: f64) -> Self {
        Self {
            motions: self.motions.clone(),
            stiffness_n_m: fraction * self.stiffness_n_m,
        }
    }

    /// Orthonormal tangential motions, n entries each.
    pub(crate) fn motions(&self) -> &[Vec<f64>] {
        &self.motions
    }

    /// Stiffness of the spring, N/m.
    pub(crate) fn stiffness_n_m(&self) -> f64 {
        self.stiffness_n_m
    }

    /// Returns `true` if every combination of the motions moves some of `pairs`: the rank of the
    /// rows of these pairs is the number of motions.
    pub(crate) fn is_blocked_by(&self, pairs: impl Iterator<Item = usize> + Clone) -> bool {
        let count = self.motions.len();
        let shared = Mat::from_fn(count, count, |i, j| {
            let on = |p: usize| {
                let rows = 3 * p..3 * p + 3;
                dot(&self.motions[i][rows.clone()], &self.motions[j][rows])
            };
            pairs.clone().map(on).sum::<f64>()
        });
        let least = dense::self_adjoint_eigenvalues(shared.as_ref());
        least.is_some_and(|values| values.first().is_none_or(|least| *least > BLOCKED))
    }

    /// Computes y += spring x, for x and y of length n.
    pub(crate) fn add_to(&self, x: &[f64], y: &mut [f64]) {
        for motion in &self.motions {
            axpy(self.stiffness_n_m * dot(motion, x), motion, y);
        }
    }

    /// Computes matrix += spring.
    pub(crate) fn add_to_matrix(&self, matrix: &mut Mat<f64>) {
        for j in 0..matrix.ncols() {
            self.add_to_column(j, matrix.col_as_slice_mut(j));
        }
    }

    /// Computes column += column j of the spring.
    pub(crate) fn add_to_column(&self, j: usize, column: &mut [f64]) {
        for motion in &self.motions {
            axpy(self.stiffness_n_m * motion[j], motion, column);
        }
    }

    /// Spring restricted to the rows and columns `columns`.
    pub(crate) fn restricted(&self, columns: &[usize]) -> Self {
        let motions = self.motions.iter();
        Self {
            motions: motions
                .map(|motion| columns.iter().map(|&c| motion[c]).collect())
                .collect(),
            stiffness_n_m: self.stiffness_n_m,
        }
    }

    /// Part of the way from `anchor` to `x` that lies along the motions.
    pub fn projected_drift(&self, x: &[f64], anchor: &[f64]) -> Vec<f64> {
        let difference: Vec<f64> = x.iter().zip(anchor).map(|(x, a)| x - a).collect();
        let mut along = vec![0.0; x.len()];
        for motion in &self.motions {
            axpy(dot(motion, &difference), motion, &mut along);
        }
        along
    }

    /// Forces of the spring at `x`, anchored at `anchor`, N: their sizes on the pairs, added up. Where
    /// they have different directions, this is more than their resultant.
    pub(crate) fn force_n(&self, x: &[f64], anchor: &[f64]) -> f64 {
        let along = self.projected_drift(x, anchor);
        let lengths_m = along.chunks_exact(3).map(|v| v[1].hypot(v[2]));
        self.stiffness_n_m * lengths_m.sum::<f64>()
    }

    /// Returns `true` if the mean has walked off: `x` lies far from `anchor` along these motions
    /// and along nothing else. `vibration` is the length of the rest of the motion, m.
    pub(crate) fn walked_off(&self, x: &[f64], anchor: &[f64], vibration: f64) -> bool {
        let mut difference: Vec<f64> = x.iter().zip(anchor).map(|(x, a)| x - a).collect();
        let whole = norm(&difference);
        for motion in &self.motions {
            let along = dot(motion, &difference);
            axpy(-along, motion, &mut difference);
        }
        let rest = norm(&difference);
        let along = (whole * whole - rest * rest).max(0.0).sqrt();
        along > FAR * (rest + norm(anchor) + vibration)
    }
}

/// Returns `true` if the mean is so far that [`Retention::walked_off`] is worth checking.
pub(crate) fn may_have_walked_off(x: &[f64], anchor: &[f64], vibration: f64) -> bool {
    let difference: Vec<f64> = x.iter().zip(anchor).map(|(x, a)| x - a).collect();
    norm(&difference) > FAR * (norm(anchor) + vibration)
}

/// Orthonormal vectors with which `k` is softer than a `share` of its mean stiffness, softest
/// first.
fn softer_than(k: &Mat<f64>, mean_stiffness: f64, share: f64) -> Vec<Vec<f64>> {
    let size = k.nrows();
    let mut shifted = k.clone();
    for i in 0..size {
        shifted[(i, i)] += SHIFT * mean_stiffness;
    }
    let Some(factor) = parallel::cholesky(shifted) else {
        return Vec::new();
    };
    let mut wanted = FIRST_FREE;
    loop {
        let free = softest(k, &factor, wanted, share * mean_stiffness);
        if free.len() < wanted || wanted >= size {
            return free;
        }
        wanted *= 2;
    }
}

/// At most `wanted` orthonormal vectors with which `k` is softer than `limit`, softest first. Block
/// inverse iteration with the factor of `k` shifted, from vectors that are the same on every
/// machine.
fn softest(k: &Mat<f64>, factor: &Mat<f64>, wanted: usize, limit: f64) -> Vec<Vec<f64>> {
    let size = k.nrows();
    let count = (2 * wanted).min(size);
    let mut block = Mat::from_fn(size, count, |i, j| ((i * (j + 1)) as f64 + 0.5).cos());
    for j in 0..count.min(2) {
        (0..size).for_each(|i| block[(i, j)] = f64::from(i % 2 == j));
    }
    let alike = vec![1.0; size];
    for _ in 0..INVERSE_ITERATIONS {
        parallel::solve_in_place(factor.as_ref(), block.as_mut());
        block = independent(&block, &alike, 0.0);
    }
    let moved = dense::product(k.as_ref(), block.as_ref());
    let projected = dense::product(block.transpose(), moved.as_ref());
    let Some((values, vectors)) = dense::self_adjoint_eigen(projected.as_ref()) else {
        return Vec::new();
    };
    let free = values.iter().take(wanted).take_while(|v| **v <= limit);
    free.enumerate()
        .map(|(j, _)| {
            let ritz = dense::product(block.as_ref(), vectors.get(.., j..j + 1));
            ritz.col_as_slice(0).to_vec()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs on a line, neighbours tied by springs of 1 N/m in every component, normals grounded,
    /// and `ground` N/m on the first tangential of pair 0.
    fn chain(pairs: usize, ground: f64) -> Mat<f64> {
        let mut k = Mat::zeros(3 * pairs, 3 * pairs);
        for p in 0..pairs {
            k[(3 * p, 3 * p)] += 1.0;
            if p > 0 {
                for c in 0..3 {
                    let (i, j) = (3 * p - 3 + c, 3 * p + c);
                    k[(i, i)] += 1.0;
                    k[(j, j)] += 1.0;
                    k[(i, j)] -= 1.0;
                    k[(j, i)] -= 1.0;
                }
            }
        }
        k[(1, 1)] += ground;
        k
    }

    #[test]
    fn a_weak_spring_holds_what_is_indifferent_without_it() {
        for (spring, indifferent) in [(0.0, true), (1e-6, false)] {
            let mut k = chain(8, spring);
            k[(2, 2)] += spring;
            let own: Vec<f64> = (0..24).map(|i| k[(i, i)]).collect();
            let found = Retention::new(&k, &own);
            assert!(found.is_needed());
            let model = ReducedModel::from_pair_matrices(k, Mat::zeros(24, 24));
            assert_eq!(found.is_indifferent(&model), indifferent, "{spring}");
            assert_eq!(found.softened(0.1).is_indifferent(&model), indifferent);
        }
    }

    #[test]
    fn finds_the_translations_that_nothing_holds() {
        let retention = Retention::new(&chain(4, 0.0), &[1.0; 12]);
        assert_eq!(retention.motions.len(), 2);
        // The spring opposes a common slide with its own stiffness, and nothing else.
        let slide: Vec<f64> = (0..12).map(|i| f64::from(i % 3 == 1)).collect();
        let mut force = vec![0.0; 12];
        retention.add_to(&slide, &mut force);
        for (f, s) in force.iter().zip(&slide) {
            assert!((f - s).abs() < 1e-9, "{force:?}");
        }
        assert!((retention.force_n(&slide, &[0.0; 12]) - 4.0).abs() < 1e-9);
        let mut stretch: Vec<f64> = (0..12).map(|i| (i as f64 - 5.5) * slide[i]).collect();
        let centre = stretch.iter().sum::<f64>() / 4.0;
        axpy(-centre, &slide, &mut stretch);
        assert!(retention.force_n(&stretch, &[0.0; 12]) < 1e-9);
    }

    /// Five bodies, each on its own pairs, slide two ways each.
    #[test]
    fn several_bodies_have_all_their_motions() {
        let one = chain(4, 0.0);
        let n = one.nrows();
        let k = Mat::from_fn(5 * n, 5 * n, |i, j| {
            if i / n == j / n {
                one[(i % n, j % n)]
            } else {
                0.0
            }
        });
        assert_eq!(Retention::new(&k, &vec![1.0; 5 * n]).motions.len(), 10);
    }

    #[test]
    fn what_nothing_holds_without_contact_is_free() {
        let problem = |stiffness: Mat<f64>| {
            let mut problem = crate::dlft::jacobians::problem(4);
            problem.reduced_mut().stiffness = stiffness;
            problem
        };
        // Grounded along the normals alone: both translations are free, and no more than with the
        // normals held.
        let free = problem(chain(4, 0.0));
        let holding = Holding::new(&free);
        assert!(!holding.is_held_without_contact() && !free.reduced.is_held_without_contact());
        assert_eq!(holding.free_motions().len(), 2);
        assert_eq!(holding.retention().unwrap().motions.len(), 2);
        // A spring too soft for friction to matter beside it holds all the same.
        let mut soft = chain(4, 1e-6);
        soft[(2, 2)] += 1e-6;
        let soft = problem(soft);
        let holding = Holding::new(&soft);
        assert!(holding.is_held_without_contact());
        assert!(holding.free_motions().is_empty() && holding.retention().is_none());
    }

    #[test]
    fn pairs_block_the_motions_that_none_of_them_is_left_out_of() {
        // Both translations, and a third pair that sticks in t1 alone would block one of them only.
        let retention = Retention::new(&chain(4, 0.0), &[1.0; 12]);
        assert!(!retention.is_blocked_by([].into_iter()));
        assert!(retention.is_blocked_by([2].into_iter()));
        let mut one = retention.clone();
        for motion in &mut one.motions {
            (3..6).for_each(|i| motion[i] = 0.0);
        }
        assert!(!one.is_blocked_by([1].into_iter()));
        assert!(one.is_blocked_by([0, 1].into_iter()));
        // Motions that differ on other pairs and are alike on pair 0 are not blocked by it.
        let mut alike = retention;
        let first = alike.motions[0].clone();
        alike.motions[1][..3].copy_from_slice(&first[..3]);
        assert!(!alike.is_blocked_by([0].into_iter()));
        assert!(alike.is_blocked_by([0, 1].into_iter()));
    }

    #[test]
    fn a_motion_with_stiffness_needs_no_retention() {
        let retention = Retention::new(&chain(4, 1.0), &[1.0; 12]);
        assert_eq!(retention.motions.len(), 1);
        let slide: Vec<f64> = (0..12).map(|i| f64::from(i % 3 == 1)).collect();
        assert!(retention.force_n(&slide, &[0.0; 12]) < 1e-6);
    }

    #[test]
    fn only_a_slide_far_beyond_the_vibration_has_walked_off() {
        let retention = Retention::new(&chain(4, 0.0), &[1.0; 12]);
        let slide: Vec<f64> = (0..12).map(|i| 5.0 * f64::from(i % 3 == 1)).collect();
        let anchor = [0.0; 12];
        assert!(retention.walked_off(&slide, &anchor, 1.0));
        assert!(!retention.walked_off(&slide, &anchor, 10.0));
        let press: Vec<f64> = (0..12).map(|i| 5.0 * f64::from(i % 3 == 0)).collect();
        assert!(!retention.walked_off(&press, &anchor, 1.0));
    }

    #[test]
    fn how_far_is_far_counts_from_the_anchor_in_the_lengths_of_all_that_is_not_the_slide() {
        let retention = Retention::new(&chain(4, 0.0), &[1.0; 12]);
        // Apart by 10 m of the slide and 3 m of pressing; the anchor is 1 m from rest.
        let mut anchor = [0.0; 12];
        anchor[0] = 1.0;
        let mut x = anchor;
        x[3] += 3.0;
        (0..4).for_each(|p| x[3 * p + 1] += 5.0);
        // 10 > 2 (3 + 1 + vibration)
        assert!(retention.walked_off(&x, &anchor, 0.99));
        assert!(!retention.walked_off(&x, &anchor, 1.01));
        // sqrt(109) > 2 (1 + vibration)
        assert!(may_have_walked_off(&x, &anchor, 4.21));
        assert!(!may_have_walked_off(&x, &anchor, 4.23));
        assert_eq!(retention.force_n(&anchor, &anchor), 0.0);
        let soft = Retention::new(&chain(4, 0.0), &[8.0; 12]).softened(0.25);
        assert_eq!(soft.stiffness_n_m(), 2.0);
        assert!((soft.force_n(&x, &anchor) - 40.0).abs() < 1e-9);
        assert!((retention.force_n(&x, &anchor) - 20.0).abs() < 1e-9);
    }
}
