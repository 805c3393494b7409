//! The parameter eps of DLFT, N/m: one value for N and one for both T of a pair.
//!
//! The balance with H harmonics leaves the displacements above H to the contact forces,
//! `X_k = -lambda_k / eps` for k > H (Nacivet et al. 2003, equation 20), so that eps stands for the
//! dynamic stiffness of the harmonics that are left out. Its choice moves the solution by no more
//! than the truncation does.

use crate::dlft::settings::EpsChoice;
use crate::problem::dynamic_stiffness::ContactSystem;
use crate::reduced::ReducedModel;
use dovetail_numerics::vector::{dot, norm};

/// Least number of harmonics over which the dynamic stiffness is taken: with one alone, a resonance
/// of it would decide.
const FEWEST_HARMONICS: usize = 3;

/// Rule for eps, as a choice and a scale.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Eps {
    /// Stiffness that eps is taken from.
    pub choice: EpsChoice,
    /// Factor on the choice.
    pub scale: f64,
}

impl Eps {
    /// Factor that leaves the choice as it is.
    pub const SCALE: f64 = 1.0;

    /// Rule with the choice itself.
    pub const fn new(choice: EpsChoice) -> Self {
        let scale = Self::SCALE;
        Self { choice, scale }
    }

    /// eps per unknown of a block, N/m, for balances with so many harmonics at frequencies about
    /// `omega`, rad/s.
    pub fn values(&self, system: &ContactSystem, omega: f64, harmonics: usize) -> Vec<f64> {
        let mut eps = match self.choice {
            EpsChoice::Dynamic => dynamic(system, omega, harmonics.max(FEWEST_HARMONICS)),
            EpsChoice::Pair => system.problem.reduced.diagonal_stiffness(),
            EpsChoice::SpectralRadius => {
                vec![spectral_radius(&system.problem.reduced); system.unknowns()]
            }
        };
        eps.iter_mut().for_each(|e| *e *= self.scale);
        eps
    }
}

/// Median of `|Lambda_h|` of each pair over the harmonics h = 1..`harmonics`, but no less than the
/// static stiffness.
fn dynamic(system: &ContactSystem, omega: f64, harmonics: usize) -> Vec<f64> {
    let stiffness = system.stiffness(omega, harmonics);
    let diagonals: Vec<Vec<f64>> = (1..=harmonics)
        .map(|k| {
            let diagonal = stiffness.diagonal(k);
            diagonal.iter().map(|v| v.norm()).collect()
        })
        .collect();
    let mut eps = system.problem.reduced.diagonal_stiffness();
    for (pair, eps) in eps.chunks_exact_mut(3).enumerate() {
        let at = |c: usize| diagonals.iter().map(move |d| d[3 * pair + c]);
        let tangential = at(1).zip(at(2)).map(|(t1, t2)| 0.5 * (t1 + t2));
        let (normal, tangential) = (median(at(0)), median(tangential));
        eps[0] = eps[0].max(normal);
        eps[1] = eps[1].max(tangential);
        eps[2] = eps[1];
    }
    eps
}

/// Middle value, the lower of two. Infinite values, of undamped resonances, count as the largest.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[(values.len() - 1) / 2]
}

/// Largest eigenvalue of K by power iteration (K is symmetric positive semi-definite).
fn spectral_radius(reduced: &ReducedModel) -> f64 {
    let n = reduced.stiffness.nrows();
    let mut v: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64).sin()).collect();
    let mut w = vec![0.0; n];
    let mut rho = 0.0;
    for _ in 0..10_000 {
        let length = norm(&v);
        v.iter_mut().for_each(|x| *x /= length);
        super::balance::apply_real(&reduced.stiffness, &v, &mut w);
        let next = dot(&v, &w);
        std::mem::swap(&mut v, &mut w);
        if (next - rho).abs() <= 1e-13 * next {
            return next;
        }
        rho = next;
    }
    rho
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::damping::Rayleigh;
    use crate::dlft::jacobians::problem;

    #[test]
    fn eps_is_the_median_of_the_dynamic_stiffness_and_no_less_than_the_static_one() {
        let problem = problem(4);
        let damping = Rayleigh::new(0.1, 0.15);
        let system = ContactSystem::new(&problem, damping);
        let own = problem.reduced.diagonal_stiffness();
        // Harmonics 1, 2 and 3 decide for one harmonic as well as for three.
        for (harmonics, looked_at) in [(1, 3), (3, 3), (6, 6)] {
            let eps = Eps::new(EpsChoice::Dynamic).values(&system, 0.4, harmonics);
            for pair in 0..4 {
                let along = |c: usize, k: usize| {
                    let [re, im] = system.stiffness(0.4, k).formed(k);
                    let i = 3 * pair + c;
                    re[(i, i)].hypot(im[(i, i)])
                };
                let mut normal: Vec<f64> = (1..=looked_at).map(|k| along(0, k)).collect();
                let mut tangential: Vec<f64> = (1..=looked_at)
                    .map(|k| 0.5 * (along(1, k) + along(2, k)))
                    .collect();
                normal.sort_by(f64::total_cmp);
                tangential.sort_by(f64::total_cmp);
                let middle = (looked_at - 1) / 2;
                let expected = [normal[middle], tangential[middle], tangential[middle]];
                for c in 0..3 {
                    let expected = expected[c].max(own[3 * pair + c]);
                    let found = eps[3 * pair + c];
                    assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
                }
            }
        }
    }

    #[test]
    fn the_scale_multiplies_every_choice() {
        let problem = problem(3);
        let damping = Rayleigh::NONE;
        let system = ContactSystem::new(&problem, damping);
        use EpsChoice::{Dynamic, Pair, SpectralRadius};
        for choice in [Dynamic, Pair, SpectralRadius] {
            let one = Eps::new(choice).values(&system, 0.4, 3);
            let half = Eps { choice, scale: 0.5 }.values(&system, 0.4, 3);
            assert!(
                one.iter()
                    .zip(&half)
                    .all(|(o, h)| *h == 0.5 * o && *h > 0.0)
            );
        }
        let rho = Eps::new(EpsChoice::SpectralRadius).values(&system, 0.4, 3)[0];
        let values = problem
            .reduced
            .stiffness
            .self_adjoint_eigenvalues(faer::Side::Lower);
        let largest = values.unwrap().into_iter().fold(0.0, f64::max);
        assert!((rho / largest - 1.0).abs() < 1e-10, "{rho} {largest}");
    }
}
