//! Contact through springs (penalty): flanks that are pressed together penetrate, and shear before
//! they slide.
//!
//! In DLFT a spring is one factor. With kappa the stiffness of a pair, eps the parameter of DLFT, g
//! the clearance and w the position of the slider along the contact,
//!
//! ```text
//! lambda_N = kappa_N / (kappa_N + eps_N) min(0, lambda_u_N + eps_N g)
//! trial_T  = kappa_T / (kappa_T + eps_T) (lambda_u_T - eps_T w)
//! ```
//!
//! As kappa grows, the factor tends to 1, which is rigid contact.

use serde::{Deserialize, Serialize};

/// Springs of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairStiffness {
    /// Stiffness against penetration, N/m.
    pub normal_n_m: f64,
    /// Stiffness against shear in any direction along the contact, N/m.
    pub tangential_n_m: f64,
}

impl PairStiffness {
    /// Springs along the normal and along the contact, N/m.
    pub const fn new(normal_n_m: f64, tangential_n_m: f64) -> Self {
        Self {
            normal_n_m,
            tangential_n_m,
        }
    }

    /// Springs that are `factor` times as stiff.
    pub(crate) fn times(self, factor: f64) -> Self {
        Self::new(self.normal_n_m * factor, self.tangential_n_m * factor)
    }

    /// Shares kappa / (kappa + eps), normal and tangential; `eps` likewise, N/m.
    pub(crate) fn shares(self, eps: [f64; 2]) -> [f64; 2] {
        // The same number, also where kappa is infinite.
        let share = |kappa: f64, eps: f64| 1.0 / (1.0 + eps / kappa);
        [
            share(self.normal_n_m, eps[0]),
            share(self.tangential_n_m, eps[1]),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_takes_its_share_of_the_prediction() {
        let springs = PairStiffness::new(3.0, 1.0);
        assert_eq!(springs.shares([1.0, 4.0]), [0.75, 0.2]);
        let stiff = PairStiffness::new(f64::INFINITY, f64::INFINITY);
        assert_eq!(stiff.shares([1.0, 4.0]), [1.0, 1.0]);
    }
}
