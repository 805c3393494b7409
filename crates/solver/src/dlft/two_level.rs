//! GMRES in two levels for the linear systems of Newton's method on the flanks.
//!
//! The softest motions, all harmonics coupled, are solved for directly ([`super::coarse`]). What is
//! left is stiff and local: dividing by eps suffices for it, which is the diagonal of J where eps
//! is that of K. The number of iterations therefore depends little on how fine the flanks are, and
//! each reads K once, in single precision.

use faer::Mat;

use super::coarse::Coarse;
use super::linear_system::{LinearSystem, widen};
use dovetail_numerics::krylov::{GmresEnd, gmres};
use dovetail_numerics::vector::{axpy, dot};

/// Preconditioned vector z = soft + local, by the two levels of the preconditioner.
struct Preconditioned {
    soft: Mat<f32>,
    /// Product J soft.
    soft_image: Mat<f32>,
    local: Mat<f32>,
}

/// Border of a linear system: a further unknown, the parameter of a curve, and a further equation.
pub struct Border {
    /// Derivative of the residual with respect to the parameter.
    pub column: Vec<f64>,
    /// Coefficients of the further equation.
    pub row: Vec<f64>,
    /// Coefficient of the parameter in the further equation.
    pub corner: f64,
}

/// Border with the approximate solution of its column.
struct Bordered<'a> {
    border: &'a Border,
    /// Approximate solution w of J w = column.
    solved: Vec<f64>,
    /// J w.
    image: Vec<f64>,
    /// Coefficient of the parameter in the further equation, once the others are eliminated.
    pivot: f64,
}

impl<'a> Bordered<'a> {
    fn new(system: &LinearSystem, coarse: Option<&Coarse>, border: &'a Border) -> Self {
        let [solved, image] = solved_and_image(system, coarse, &border.column);
        Self {
            pivot: border.corner - dot(&border.row, &solved),
            border,
            solved,
            image,
        }
    }

    /// Parameter that fulfils the further equation together with z, an approximate solution for the
    /// other unknowns where the parameter does not change.
    fn parameter(&self, z: &[f64], right: f64) -> f64 {
        (right - dot(&self.border.row, z)) / self.pivot
    }
}

/// Solves A x = b to the relative residual `tolerance`. The vibrating part of b and of the residual
/// is weighted by `vibration_weight`. With a border, the last entries of b and x belong to it.
pub fn solve(
    system: &LinearSystem,
    coarse: Option<&Coarse>,
    border: Option<&Border>,
    b: &[f64],
    vibration_weight: f64,
    tolerance: f64,
    max_iterations: usize,
) -> (Vec<f64>, GmresEnd) {
    let m = system.inexact.unknowns();
    let own = m * system.width();
    let weigh = |v: &mut [f64], by: f64| v[m..own].iter_mut().for_each(|v| *v *= by);
    let bordered = border.map(|border| Bordered::new(system, coarse, border));
    let mut right = b.to_vec();
    weigh(&mut right, vibration_weight);
    let mut x = vec![0.0; b.len()];
    let end = gmres(
        |v, w| {
            let mut v = v.to_vec();
            weigh(&mut v, vibration_weight.recip());
            match &bordered {
                None => {
                    let image = image(system, preconditioned(system, coarse, &v));
                    widen(image.as_ref(), w);
                }
                Some(bordered) => {
                    let [z, image] = solved_and_image(system, coarse, &v[..own]);
                    let parameter = bordered.parameter(&z, v[own]);
                    w[..own].copy_from_slice(&image);
                    axpy(-parameter, &bordered.image, &mut w[..own]);
                    axpy(parameter, &bordered.border.column, &mut w[..own]);
                    // The preconditioner fulfils the further equation.
                    w[own] = v[own];
                }
            }
            weigh(w, vibration_weight);
        },
        |v| {
            weigh(v, vibration_weight.recip());
            let Preconditioned { soft, local, .. } = preconditioned(system, coarse, &v[..own]);
            let right = v.get(own).copied();
            widen((soft + local).as_ref(), &mut v[..own]);
            if let (Some(bordered), Some(right)) = (&bordered, right) {
                v[own] = bordered.parameter(&v[..own], right);
                let parameter = v[own];
                axpy(-parameter, &bordered.solved, &mut v[..own]);
            }
        },
        &right,
        &mut x,
        tolerance,
        max_iterations,
    );
    (x, end)
}

/// Approximate solution z of J z = v, and J z.
fn solved_and_image(system: &LinearSystem, coarse: Option<&Coarse>, v: &[f64]) -> [Vec<f64>; 2] {
    let [mut z, mut jz] = [v, v].map(|v| vec![0.0; v.len()]);
    let parts = preconditioned(system, coarse, v);
    widen((parts.soft.clone() + &parts.local).as_ref(), &mut z);
    widen(image(system, parts).as_ref(), &mut jz);
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

/// Computes J z.
fn image(system: &LinearSystem, z: Preconditioned) -> Mat<f32> {
    let forces = system.inexact.stiffness_times(z.local.as_ref());
    z.soft_image + system.apply(z.local.as_ref(), forces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Problem;
    use crate::problem::dovetail72::dovetail72;
    use crate::problem::dynamic_stiffness::{ContactSystem, HarmonicStiffness};
    use crate::problem::inexact::InexactModel;
    use crate::reduction::damping::Rayleigh;

    const HARMONICS: usize = 2;
    const FULL: usize = 3 * (2 * HARMONICS + 1);

    const PAIRS: usize = 72;

    /// System near the first stuck mode; pairs slip at some samples, each with a D of its own.
    fn system(pairs: impl Iterator<Item = usize>) -> (LinearSystem, HarmonicStiffness<'static>) {
        let problem: &'static Problem = Box::leak(Box::new(dovetail72(1.0)));
        let damping = Rayleigh::of_stiffness(1e-6);
        let stiffness = ContactSystem::new(problem, damping)
            .stiffness(0.99 * problem.reduced.omega2[0].sqrt(), HARMONICS);
        let inexact =
            InexactModel::new(&problem.reduced).taking_part(&pairs.collect::<Vec<_>>(), None);
        let m = inexact.unknowns();
        let derivatives = (0..m / 3 * FULL * FULL).map(|i| {
            let (row, column) = (i % FULL, i / FULL % FULL);
            let mixing = 0.02 * (i as f32).sin();
            if row == column { 0.05 } else { mixing }
        });
        let linear = LinearSystem {
            harmonics: stiffness.coefficients(6.0),
            derivatives: derivatives.collect(),
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
    fn exactly(linear: &LinearSystem, stiffness: &HarmonicStiffness<'_>, x: &[f64]) -> Vec<f64> {
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
        for (slot, d) in linear.derivatives.chunks_exact(FULL * FULL).enumerate() {
            for row in 0..FULL {
                let (i, h) = (3 * slot + row / width, row % width);
                let moved = (0..FULL).map(|column| {
                    let (j, k) = (3 * slot + column / width, column % width);
                    let difference = force(k, j) - f64::from(linear.eps[j]) * x[k * m + j];
                    f64::from(d[column * FULL + row]) * difference
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
            let coarse = Coarse::new(&linear).unwrap();
            let (x, end) = solve(&linear, Some(&coarse), None, &b, 1.0, 1e-4, 400);
            assert!(end.converged);
            let y = exactly(&linear, &stiffness, &x);
            let left = norm(y.iter().zip(&b).map(|(y, b)| y - b)) / norm(b.into_iter());
            assert!(left < 5e-4, "{left:e}");
        }
        let (linear, _) = system(0..PAIRS);
        let size = linear.inexact.unknowns() * linear.width();
        let b: Vec<f64> = (0..size).map(|i| (i as f64).cos()).collect();
        let coarse = Coarse::new(&linear);
        let [with, without] = [coarse.as_ref(), None]
            .map(|c| solve(&linear, c, None, &b, 1.0, 1e-2, 400).1.iterations);
        assert!(2 * with < without, "{with} {without}");
    }

    #[test]
    fn a_border_is_solved_with_the_rest() {
        let (linear, _) = system(0..PAIRS);
        let (m, width) = (linear.inexact.unknowns(), linear.width());
        let size = m * width;
        let some = |seed: f64| (0..size).map(move |i| (i as f64 * seed).sin());
        let border = Border {
            column: some(0.3).collect(),
            row: some(0.9).collect(),
            corner: 0.2,
        };
        let b: Vec<f64> = some(0.7).chain([0.4]).collect();
        let coarse = Coarse::new(&linear).unwrap();
        let (x, end) = solve(&linear, Some(&coarse), Some(&border), &b, 1.0, 1e-5, 400);
        assert!(end.converged, "{end:?}");
        let (own, parameter) = (&x[..size], x[size]);
        let narrow = Mat::from_fn(m, width, |i, h| own[h * m + i] as f32);
        let forces = linear.inexact.stiffness_times(narrow.as_ref());
        let mut y = vec![0.0; size];
        widen(linear.apply(narrow.as_ref(), forces).as_ref(), &mut y);
        axpy(parameter, &border.column, &mut y);
        let left = norm(y.iter().zip(&b).map(|(y, b)| y - b)) / norm(b.iter().copied());
        assert!(left < 1e-3, "{left:e}");
        let last = dot(&border.row, own) + border.corner * parameter;
        assert!((last - 0.4).abs() < 1e-3, "{last}");
    }

    #[test]
    fn nothing_of_the_residual_is_left_on_the_softest_motions() {
        let (linear, stiffness) = system(0..PAIRS);
        let (m, width) = (linear.inexact.unknowns(), linear.width());
        let v = Mat::from_fn(m, width, |i, h| ((i * (h + 2)) as f32 * 0.3).cos());
        let [z, _] = Coarse::new(&linear)
            .unwrap()
            .solve(&linear.inexact, v.as_ref());
        let mut wide = vec![0.0; m * width];
        widen(z.as_ref(), &mut wide);
        let y = exactly(&linear, &stiffness, &wide);
        let on_motions = |a: &dyn Fn(usize, usize) -> f64| {
            let motions = &linear.inexact.motions;
            norm((0..width * motions.nrows()).map(|k| {
                let (h, j) = (k % width, k / width);
                (0..m).map(|i| f64::from(motions[(j, i)]) * a(i, h)).sum()
            }))
        };
        let before = on_motions(&|i, h| f64::from(v[(i, h)]));
        let after = on_motions(&|i, h| f64::from(v[(i, h)]) - y[h * m + i]);
        assert!(after < 1e-3 * before, "{after:e} of {before:e}");
    }
}
