//! GMRES in two levels for the linear systems of Newton's method on the flanks.
//!
//! The softest motions, all harmonics coupled, are solved for directly ([`super::coarse`]). What is
//! left is stiff and local: dividing by eps suffices for it, which is the diagonal of J where eps
//! is that of K. The number of iterations therefore depends little on how fine the flanks are, and
//! each reads K once, in single precision, or where the flanks are large its near field.

use faer::Mat;

use super::border::{Border, eliminated};
use super::coarse::Coarse;
use super::linear_system::{LinearSystem, widen};
use dovetail_numerics::dense::NearField;
use dovetail_numerics::krylov::{GmresEnd, gmres};
use dovetail_numerics::vector::{axpy, dot, norm};

/// Preconditioned vector z = soft + local, by the two levels of the preconditioner.
struct Preconditioned {
    soft: Mat<f32>,
    /// Product J soft.
    soft_image: Mat<f32>,
    local: Mat<f32>,
}

/// Border with the approximate solutions of its columns.
struct Bordered<'a> {
    border: &'a Border,
    /// Approximate solution w of J w = column, for each column.
    solved: Vec<Vec<f64>>,
    /// J w.
    images: Vec<Vec<f64>>,
    /// Coefficients of the further unknowns in the further equations, once the others are
    /// eliminated.
    pivots: Vec<Vec<f64>>,
}

impl<'a> Bordered<'a> {
    fn new(
        system: &LinearSystem,
        near: Option<&NearField>,
        coarse: Option<&Coarse>,
        border: &'a Border,
    ) -> Self {
        let columns = border.columns.iter();
        let (solved, images): (Vec<_>, Vec<_>) = columns
            .map(|column| solved_and_image(system, near, coarse, column).into())
            .unzip();
        let of_row = |(row, corner): (&Vec<f64>, &Vec<f64>)| {
            let entries = corner.iter().zip(&solved);
            let left = entries.map(|(corner, solved)| corner - dot(row, solved));
            left.collect()
        };
        Self {
            pivots: border.rows.iter().zip(&border.corner).map(of_row).collect(),
            border,
            solved,
            images,
        }
    }

    /// Further unknowns that fulfil the further equations together with z, an approximate solution
    /// for the other unknowns where the further ones do not change.
    fn further_unknowns(&self, z: &[f64], right: &[f64]) -> Vec<f64> {
        eliminated(
            self.pivots.clone(),
            self.border.remaining_right_sides(z, right),
        )
    }
}

/// Most solutions for what the near field of K leaves of a residual.
const MOST_ROUNDS: usize = 6;
/// A solution with the near field of K goes on where it leaves less than this of the residual.
const PROGRESS: f64 = 0.7;

/// Linear system with its preconditioner and border.
struct TwoLevelSolver<'a> {
    system: &'a LinearSystem,
    coarse: Option<&'a Coarse>,
    /// Near field of K, in place of K in the iterations.
    near: Option<&'a NearField>,
    bordered: Option<Bordered<'a>>,
    /// Weight of the vibrating part of residuals.
    vibration_weight: f64,
}

/// Solves A x = b to the relative residual `tolerance`. The vibrating part of b and of the residual
/// is weighted by `vibration_weight`. The last entries of b and x belong to the border, if any.
///
/// Where the flanks are large, the iterations read the near field of K alone: what is far is soft and
/// belongs to the coarse problem, which has it. What a solution leaves of the residual, with the whole
/// of K, is solved for again.
pub(crate) fn solve(
    system: &LinearSystem,
    coarse: Option<&Coarse>,
    border: Option<&Border>,
    b: &[f64],
    vibration_weight: f64,
    tolerance: f64,
    max_iterations: usize,
) -> (Vec<f64>, GmresEnd) {
    let near = system.inexact.near_stiffness.as_ref();
    let solver = TwoLevelSolver {
        system,
        coarse,
        near,
        bordered: border.map(|border| Bordered::new(system, near, coarse, border)),
        vibration_weight,
    };
    if near.is_none() {
        return solver.gmres(b, tolerance, max_iterations);
    }
    let weighed = |v: &[f64]| norm(&solver.weighed(v));
    let whole = weighed(b);
    let within = |left: f64| (PROGRESS * tolerance * whole / left).min(PROGRESS);
    let (mut x, mut end) = solver.gmres(b, within(whole), max_iterations);
    let mut before = whole;
    for round in 0..=MOST_ROUNDS {
        let image = solver.image(&x);
        let rest: Vec<f64> = b.iter().zip(&image).map(|(b, image)| b - image).collect();
        let left = weighed(&rest);
        end.relative_residual = if whole > 0.0 { left / whole } else { 0.0 };
        end.converged = end.relative_residual <= tolerance;
        let goes_on = left < PROGRESS * before && end.iterations < max_iterations;
        if end.converged || !goes_on || round == MOST_ROUNDS {
            break;
        }
        before = left;
        let most = max_iterations - end.iterations;
        let (dx, of_rest) = solver.gmres(&rest, within(left), most);
        x.iter_mut().zip(&dx).for_each(|(x, d)| *x += d);
        end.iterations += of_rest.iterations;
    }
    (x, end)
}

impl TwoLevelSolver<'_> {
    /// Number of unknowns without the border.
    fn unbordered_size(&self) -> usize {
        self.system.inexact.unknowns() * self.system.width()
    }

    /// Multiplies the vibrating part of a vector by a factor.
    fn weigh(&self, v: &mut [f64], by: f64) {
        let vibrating = self.system.inexact.unknowns()..self.unbordered_size();
        v[vibrating].iter_mut().for_each(|v| *v *= by);
    }

    /// A residual with its vibrating part weighted.
    fn weighed(&self, v: &[f64]) -> Vec<f64> {
        let mut v = v.to_vec();
        self.weigh(&mut v, self.vibration_weight);
        v
    }

    /// Computes A x, with the whole of K.
    fn image(&self, x: &[f64]) -> Vec<f64> {
        let (m, width) = (self.system.inexact.unknowns(), self.system.width());
        let (own, further) = x.split_at(self.unbordered_size());
        let narrow = Mat::from_fn(m, width, |i, h| own[h * m + i] as f32);
        let forces = self.system.inexact.stiffness_times(narrow.as_ref());
        let mut image = vec![0.0; own.len()];
        widen(
            self.system.apply(narrow.as_ref(), forces).as_ref(),
            &mut image,
        );
        if let Some(Bordered { border, .. }) = &self.bordered {
            for (further, column) in further.iter().zip(&border.columns) {
                axpy(*further, column, &mut image);
            }
            let equations = border.rows.iter().zip(&border.corner);
            image.extend(equations.map(|(row, corner)| dot(row, own) + dot(corner, further)));
        }
        image
    }

    /// Solves A x = b by GMRES.
    fn gmres(&self, b: &[f64], tolerance: f64, max_iterations: usize) -> (Vec<f64>, GmresEnd) {
        let (system, coarse, near, own) =
            (self.system, self.coarse, self.near, self.unbordered_size());
        let (bordered, vibration_weight) = (&self.bordered, self.vibration_weight);
        let right = self.weighed(b);
        let mut x = vec![0.0; b.len()];
        let end = gmres(
            |v, w| {
                let mut v = v.to_vec();
                self.weigh(&mut v, vibration_weight.recip());
                match bordered {
                    None => {
                        let image = image(system, near, preconditioned(system, coarse, &v));
                        widen(image.as_ref(), w);
                    }
                    Some(bordered) => {
                        let [z, image] = solved_and_image(system, near, coarse, &v[..own]);
                        let further = bordered.further_unknowns(&z, &v[own..]);
                        w[..own].copy_from_slice(&image);
                        for (i, further) in further.iter().enumerate() {
                            axpy(-further, &bordered.images[i], &mut w[..own]);
                            axpy(*further, &bordered.border.columns[i], &mut w[..own]);
                        }
                        // The preconditioner fulfils the further equations.
                        w[own..].copy_from_slice(&v[own..]);
                    }
                }
                self.weigh(w, vibration_weight);
            },
            |v| {
                self.weigh(v, vibration_weight.recip());
                let Preconditioned { soft, local, .. } = preconditioned(system, coarse, &v[..own]);
                widen((soft + local).as_ref(), &mut v[..own]);
                if let Some(bordered) = bordered {
                    let further = bordered.further_unknowns(&v[..own], &v[own..]);
                    for (further, solved) in further.iter().zip(&bordered.solved) {
                        axpy(-further, solved, &mut v[..own]);
                    }
                    v[own..].copy_from_slice(&further);
                }
            },
            &right,
            &mut x,
            tolerance,
            max_iterations,
        );
        (x, end)
    }
}

/// Approximate solution z of J z = v, and J z.
fn solved_and_image(
    system: &LinearSystem,
    near: Option<&NearField>,
    coarse: Option<&Coarse>,
    v: &[f64],
) -> [Vec<f64>; 2] {
    let [mut z, mut jz] = [v, v].map(|v| vec![0.0; v.len()]);
    let parts = preconditioned(system, coarse, v);
    widen((parts.soft.clone() + &parts.local).as_ref(), &mut z);
    widen(image(system, near, parts).as_ref(), &mut jz);
    [z, jz]
}

/// Approximate solution z of J z = v.
fn preconditioned(system: &LinearSystem, coarse: Option<&Coarse>, v: &[f64]) -> Preconditioned {
    let m = system.inexact.unknowns();
    let mut local = Mat::from_fn(m, system.width(), |i, h| v[h * m + i] as f32);
    let mut soft = Mat::zeros(m, system.width());
    let mut soft_image = Mat::zeros(m, system.width());
    if let Some(coarse) = coarse {
        let forces;
        [soft, forces] = coarse.solve(&system.inexact, local.as_ref());
        soft_image = system.apply(soft.as_ref(), forces);
        local -= &soft_image;
    }
    for h in 0..system.width() {
        let column = local.col_as_slice_mut(h).iter_mut();
        column.zip(&system.eps).for_each(|(l, eps)| *l /= eps);
    }
    Preconditioned {
        soft,
        soft_image,
        local,
    }
}

/// Computes J z, with the near field of K for what is local where it is given.
fn image(system: &LinearSystem, near: Option<&NearField>, z: Preconditioned) -> Mat<f32> {
    let forces = match near {
        Some(near) => near.times(z.local.as_ref()),
        None => system.inexact.stiffness_times(z.local.as_ref()),
    };
    z.soft_image + system.apply(z.local.as_ref(), forces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::damping::Rayleigh;
    use crate::dlft::coarse::Blocks;
    use crate::dlft::linear_system::PairDerivatives;
    use crate::problem::dovetail72::dovetail72;
    use crate::problem::dynamic_stiffness::{ContactSystem, HarmonicStiffness};
    use crate::problem::inexact::InexactModel;
    use crate::reduced::ReducedModel;
    use std::sync::Arc;

    const HARMONICS: usize = 2;
    const FULL: usize = 3 * (2 * HARMONICS + 1);

    const PAIRS: usize = 72;

    /// System near the first stuck mode; pairs slip at some samples, each with a D of its own.
    fn system(pairs: impl Iterator<Item = usize>) -> (LinearSystem, HarmonicStiffness) {
        let problem = dovetail72(1.0);
        let damping = Rayleigh::stiffness_proportional(1e-6);
        let stiffness = ContactSystem::new(&problem, damping)
            .stiffness(0.99 * problem.reduced.omega2[0].sqrt(), HARMONICS);
        let inexact =
            InexactModel::new(&problem.reduced).taking_part(&pairs.collect::<Vec<_>>(), None);
        let m = inexact.unknowns();
        let mut derivatives = PairDerivatives::new(2 * HARMONICS + 1, m / 3);
        for pair in 0..m / 3 {
            derivatives.push(|row, column| {
                let i = (pair * FULL + column) * FULL + row;
                let mixing = 0.02 * (i as f32).sin();
                if row == column { 0.05 } else { mixing }
            });
        }
        let linear = LinearSystem {
            harmonics: stiffness.coefficients(6.0),
            derivatives,
            retention: None,
            eps: inexact
                .columns()
                .iter()
                .map(|&c| problem.reduced.stiffness[(c, c)] as f32)
                .collect(),
            inexact,
        };
        (linear, stiffness)
    }

    /// Computes J x in double precision, with the exact mass and all stuck modes.
    fn exactly(linear: &LinearSystem, stiffness: &HarmonicStiffness, x: &[f64]) -> Vec<f64> {
        let (n, width) = (stiffness.unknowns(), linear.width());
        let columns = linear.inexact.columns();
        let m = columns.len();
        let (mut whole, mut forces) = (vec![0.0; n * width], vec![0.0; n * width]);
        for h in 0..width {
            (0..m).for_each(|i| whole[h * n + columns[i]] = x[h * m + i]);
        }
        stiffness.apply(&whole, &mut forces);
        let force = |h: usize, i: usize| forces[h * n + columns[i]];
        let mut y = vec![0.0; m * width];
        for slot in 0..m / 3 {
            for row in 0..FULL {
                let (i, h) = (3 * slot + row / width, row % width);
                let moved = (0..FULL).map(|column| {
                    let (j, k) = (3 * slot + column / width, column % width);
                    let difference = force(k, j) - f64::from(linear.eps[j]) * x[k * m + j];
                    f64::from(linear.derivatives.entry(slot, [row, column])) * difference
                });
                y[h * m + i] = force(h, i) - moved.sum::<f64>();
            }
        }
        y
    }

    fn norm(v: impl Iterator<Item = f64>) -> f64 {
        v.map(|v| v * v).sum::<f64>().sqrt()
    }

    #[test]
    fn what_it_solves_is_solved_exactly_and_the_softest_motions_save_iterations() {
        let every_third = (0..30).step_by(3);
        for (linear, stiffness) in [system(0..PAIRS), system(every_third)] {
            let size = linear.inexact.unknowns() * linear.width();
            let b: Vec<f64> = (0..size).map(|i| (i as f64 * 0.7).sin()).collect();
            let coarse = Coarse::new(&linear, 1).unwrap();
            let (x, end) = solve(&linear, Some(&coarse), None, &b, 1.0, 1e-4, 400);
            assert!(end.converged);
            let y = exactly(&linear, &stiffness, &x);
            let left = norm(y.iter().zip(&b).map(|(y, b)| y - b)) / norm(b.into_iter());
            assert!(left < 5e-4, "{left:e}");
        }
        let (linear, _) = system(0..PAIRS);
        let size = linear.inexact.unknowns() * linear.width();
        let b: Vec<f64> = (0..size).map(|i| (i as f64).cos()).collect();
        let coarse = Coarse::new(&linear, 1);
        let [with, without] = [coarse.as_ref(), None]
            .map(|c| solve(&linear, c, None, &b, 1.0, 1e-2, 400).1.iterations);
        assert!(2 * with < without, "{with} {without}");
    }

    /// A system on so many pairs in a row that the near field of K serves; their coupling falls with the
    /// third power of their distance, as that of a flank does. It has the mean alone.
    fn long_row() -> (LinearSystem, Arc<ReducedModel>) {
        const PAIRS: usize = 430;
        let entry = |i: usize, j: usize| match (i / 3).abs_diff(j / 3) {
            0 if i == j => 1e8,
            0 => 2e7,
            apart if i % 3 == j % 3 => -2.5e7 / (apart as f64).powi(3),
            apart => -0.5e7 / (apart as f64).powi(3),
        };
        let stiffness = Mat::from_fn(3 * PAIRS, 3 * PAIRS, entry);
        let mass = Mat::zeros(3 * PAIRS, 3 * PAIRS);
        let model = Arc::new(ReducedModel::from_pair_matrices(stiffness, mass));
        let all: Vec<usize> = (0..PAIRS).collect();
        // Pairs that open, and pairs that slide.
        let mut derivatives = PairDerivatives::new(1, PAIRS);
        for pair in 0..PAIRS {
            derivatives.push(|row, column| match (pair % 3, row, column) {
                (0, ..) => 0.0,
                (_, 0, 0) | (_, 1, 1) => 0.9,
                (_, 0, 1) => 0.3,
                _ => 0.0,
            });
        }
        let linear = LinearSystem {
            inexact: InexactModel::new(&model).taking_part(&all, None),
            harmonics: vec![],
            derivatives,
            retention: None,
            eps: model
                .diagonal_stiffness()
                .iter()
                .map(|v| *v as f32)
                .collect(),
        };
        (linear, model)
    }

    #[test]
    fn what_is_far_on_a_large_flank_is_in_the_solution() {
        let (linear, model) = long_row();
        assert!(linear.inexact.near_stiffness.is_some());
        let n = model.stiffness.nrows();
        let b: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin()).collect();
        let coarse = Coarse::new(&linear, 1).unwrap();
        for coarse in [Some(&coarse), None] {
            let (x, end) = solve(&linear, coarse, None, &b, 1.0, 1e-4, 400);
            assert!(end.converged, "{end:?}");
            let x = Mat::from_fn(n, 1, |i, _| x[i]);
            let forces = &model.stiffness * &x;
            let image = |i: usize| {
                let pair = i / 3;
                let moved = (0..3).map(|c| {
                    let j = 3 * pair + c;
                    f64::from(linear.derivatives.entry(pair, [i % 3, c]))
                        * (forces[(j, 0)] - model.stiffness[(j, j)] * x[(j, 0)])
                });
                forces[(i, 0)] - moved.sum::<f64>()
            };
            let left = norm((0..n).map(|i| b[i] - image(i))) / norm(b.iter().copied());
            assert!(left < 1.2e-4, "{left:e}");
        }
    }

    #[test]
    fn a_border_is_solved_with_the_rest() {
        let (linear, _) = system(0..PAIRS);
        let (m, width) = (linear.inexact.unknowns(), linear.width());
        let size = m * width;
        let some = |seed: f64| (0..size).map(move |i| (i as f64 * seed).sin());
        let corners = [vec![vec![0.2]], vec![vec![1e-3, 0.3], vec![0.5, -0.2]]];
        for corner in corners {
            let count = corner.len();
            let seeds = (0..count).map(|i| 0.05 * i as f64);
            let border = Border {
                columns: seeds.clone().map(|s| some(0.3 + s).collect()).collect(),
                rows: seeds.map(|s| some(0.9 - s).collect()).collect(),
                corner,
            };
            let b: Vec<f64> = some(0.7)
                .chain([0.4, -0.7].into_iter().take(count))
                .collect();
            let coarse = Coarse::new(&linear, 1).unwrap();
            let (x, end) = solve(&linear, Some(&coarse), Some(&border), &b, 1.0, 1e-5, 400);
            assert!(end.converged, "{end:?}");
            let (own, further) = x.split_at(size);
            let narrow = Mat::from_fn(m, width, |i, h| own[h * m + i] as f32);
            let forces = linear.inexact.stiffness_times(narrow.as_ref());
            let mut y = vec![0.0; size];
            widen(linear.apply(narrow.as_ref(), forces).as_ref(), &mut y);
            for (further, column) in further.iter().zip(&border.columns) {
                axpy(*further, column, &mut y);
            }
            let left = norm(y.iter().zip(&b).map(|(y, b)| y - b)) / norm(b.iter().copied());
            assert!(left < 1e-3, "{left:e}");
            for (i, right) in b[size..].iter().enumerate() {
                let last = dot(&border.rows[i], own) + dot(&border.corner[i], further);
                assert!((last - right).abs() < 1e-3, "{count}, {i}: {last}");
            }
        }
    }

    #[test]
    fn a_small_system_is_solved_wherever_its_pivots_stand() {
        let matrix = [[0.0, 2.0, 1.0], [3.0, 0.0, -1.0], [1e-9, 1.0, 0.0]];
        let sought = [0.5, -2.0, 7.0];
        let right = matrix.map(|row| dot(&row, &sought));
        let rows = matrix.iter().map(|row| row.to_vec()).collect();
        let found = eliminated(rows, right.to_vec());
        for (found, sought) in found.iter().zip(sought) {
            assert!((found - sought).abs() < 1e-12, "{found} {sought}");
        }
    }

    #[test]
    fn nothing_of_the_residual_is_left_on_the_softest_motions() {
        let (linear, stiffness) = system(0..PAIRS);
        let (m, width) = (linear.inexact.unknowns(), linear.width());
        let v = Mat::from_fn(m, width, |i, h| ((i * (h + 2)) as f32 * 0.3).cos());
        let [z, _] = Coarse::new(&linear, 1)
            .unwrap()
            .solve(&linear.inexact, v.as_ref());
        let mut wide = vec![0.0; m * width];
        widen(z.as_ref(), &mut wide);
        let y = exactly(&linear, &stiffness, &wide);
        let on_motions = |a: &dyn Fn(usize, usize) -> f64| {
            let motions = &linear.inexact.motions;
            let blocks = Blocks::new(HARMONICS, 1, motions.nrows());
            norm(
                blocks
                    .blocks_and_motions()
                    .map(|(h, j)| (0..m).map(|i| f64::from(motions[(j, i)]) * a(i, h)).sum()),
            )
        };
        let before = on_motions(&|i, h| f64::from(v[(i, h)]));
        let after = on_motions(&|i, h| f64::from(v[(i, h)]) - y[h * m + i]);
        assert!(after < 1e-3 * before, "{after:e} of {before:e}");
    }
}
