//! The parameter eps of DLFT, N/m: one value for N and one for both T of a pair.
//!
//! The balance with H harmonics leaves the displacements above H to the contact forces, `X_k = -lambda_k / eps` for
//! k > H (Nacivet et al. 2003, equation 20), so that eps stands for the dynamic stiffness of the harmonics that
//! are left out. Its choice moves the solution by no more than the truncation does.

use crate::contact::dynamic_stiffness::ContactSystem;
use crate::dlft::settings::EpsChoice;
use crate::reduction::RelativeModel;
use dovetail_numerics::gmres::{dot, norm};

/// The dynamic stiffness is looked at over this many harmonics at least: with one alone, a resonance of it
/// would decide.
const FEWEST_HARMONICS: usize = 3;

/// eps as it is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penalty {
    pub choice: EpsChoice,
    /// The choice is multiplied by this.
    pub scale: f64,
}

impl Penalty {
    /// The choice itself.
    pub const fn new(choice: EpsChoice) -> Self {
        Self { choice, scale: 1.0 }
    }

    /// eps per unknown of a block, N/m, for balances with so many harmonics at frequencies about `omega`, rad/s.
    pub fn of(&self, system: &ContactSystem<'_>, omega: f64, harmonics: usize) -> Vec<f64> {
        let mut eps = match self.choice {
            EpsChoice::Dynamic => dynamic(system, omega, harmonics.max(FEWEST_HARMONICS)),
            EpsChoice::Pair => system.model.own_stiffness(),
            EpsChoice::SpectralRadius => vec![spectral_radius(system.model); system.unknowns()],
        };
        eps.iter_mut().for_each(|e| *e *= self.scale);
        eps
    }
}

/// Of each pair the median of `|Lambda_h|` over the harmonics h = 1..`harmonics`, and no less than the static
/// stiffness.
fn dynamic(system: &ContactSystem<'_>, omega: f64, harmonics: usize) -> Vec<f64> {
    let stiffness = system.stiffness(omega, harmonics);
    let diagonals: Vec<Vec<f64>> = (1..=harmonics)
        .map(|k| {
            let own = stiffness.diagonal(k);
            own.iter().map(|v| v.norm()).collect()
        })
        .collect();
    let mut eps = system.model.own_stiffness();
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

/// The middle value, the lower of two; infinite ones, of undamped resonances, count as the largest.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[(values.len() - 1) / 2]
}

/// Largest eigenvalue of K by power iteration (K is symmetric positive semi-definite).
fn spectral_radius(model: &RelativeModel) -> f64 {
    let n = model.stiffness.nrows();
    let mut v: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64).sin()).collect();
    let mut w = vec![0.0; n];
    let mut rho = 0.0;
    for _ in 0..10_000 {
        let length = norm(&v);
        v.iter_mut().for_each(|x| *x /= length);
        super::balance::apply_real(&model.stiffness, &v, &mut w);
        let next = dot(&v, &w);
        std::mem::swap(&mut v, &mut w);
        if (next - rho).abs() <= 1e-13 * next {
            return next;
        }
        rho = next;
    }
    rho
}
