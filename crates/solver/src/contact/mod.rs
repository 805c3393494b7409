//! Contact law of a pair, as data and as a function of DLFT's prediction, and the definition of the
//! signs of contact. This folder imports no other module.
//!
//! A *pair* joins the point b of the first flank of a contact to the point j of the second (or of
//! rigid ground) opposite; one of the two is a node, the other a weighted mean of nodes. Frame (n,
//! t1, t2), n the unit normal FROM THE SECOND FLANK INTO THE BODY OF THE FIRST. Relative
//! displacement X = R (u_b - u_j): X_N > 0 IS AN OPEN GAP. lambda is the contact force on the
//! left-hand side of the equation of the body of the first flank, Z u_b + lambda = f: lambda_N < 0
//! IS COMPRESSION; contact pressure p = -lambda_N / A. An initial clearance g shifts contact to
//! X_N = -g; g < 0 is an interference.
//!
//! DLFT predicts the force lambda_u with which a rigid pair would stick. The law converts it to a
//! trial force, a share of the prediction ([`penalty`]) counted from the clearance and from where
//! the pair has slid to, and brings that back to the cone of friction ([`coulomb`]). What it keeps
//! from instant to instant is `state = share lambda_u_T - lambda_T`, for rigid contact and for
//! springs alike.
//!
//! [`PairLaw`] is the data: the model has it, and all solvers read it. [`PredictedLaw`] is the
//! function. The static state evaluates it whole. In the folder `dlft`, `balance.rs` takes the
//! shares and the first state from it, `aft.rs` the force at each sample ([`PredictedLaw::force`]),
//! `between_samples.rs` writes it again for numbers with derivatives, and `rounded.rs` writes one
//! without corners. [`crate::integration`] has its own law on purpose, without lambda_u, so that an
//! error in one of the two shows. A change of the law is a change in each of these; a new field
//! that only some of them use passes through the others unseen.

pub mod coulomb;
pub mod penalty;

use coulomb::{Contact, slip_tangent, unilateral_coulomb};
use penalty::PairStiffness;
use serde::Serialize;

/// Contact law of one pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PairLaw {
    /// Coulomb coefficient of friction.
    pub friction: f64,
    /// Initial clearance, m; negative: an interference.
    pub gap_m: f64,
    /// Springs of the pair; `None`: rigid contact.
    pub stiffness: Option<PairStiffness>,
}

impl PairLaw {
    /// Largest coefficient of friction that is computed with. A pair with it sticks as long as it
    /// is pressed, which a larger coefficient does not change (1e3 and 1e4 give the same peak to
    /// 1e-5), but friction is known only to the coefficient times the rounding of the normal force.
    pub const MOST_FRICTION: f64 = 1e3;

    /// Rigid contact.
    pub const fn rigid(friction: f64, gap_m: f64) -> Self {
        Self {
            friction,
            gap_m,
            stiffness: None,
        }
    }

    /// Law of a pair with this tributary area, m2, where `self` is that of a pair with 1 m2.
    pub fn of_area(self, area_m2: f64) -> Self {
        Self {
            stiffness: self.stiffness.map(|springs| springs.times(area_m2)),
            ..self
        }
    }

    /// Coefficient of friction that is computed with.
    pub fn computed_friction(&self) -> f64 {
        self.friction.min(Self::MOST_FRICTION)
    }

    /// Law as a function of the predicted force, with these eps, normal and tangential, N/m, and a
    /// coefficient of at most `most_friction`.
    pub fn predicted(&self, eps: [f64; 2], most_friction: f64) -> PredictedLaw {
        let [normal, tangential] = self.stiffness.map_or([1.0; 2], |s| s.shares(eps));
        PredictedLaw {
            friction: self.computed_friction().min(most_friction),
            is_rigid: self.stiffness.is_none(),
            shares: [normal, tangential, tangential],
            shift_n: normal * eps[0] * self.gap_m,
            slid_n_per_m: tangential * eps[1],
        }
    }
}

/// Law of a pair as a function of the predicted force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedLaw {
    /// Coulomb coefficient of friction.
    pub friction: f64,
    /// True if a pair that sticks has no motion of its own: its force is then the prediction.
    pub is_rigid: bool,
    /// Shares of the prediction (N, t1, t2) that the trial force takes.
    pub shares: [f64; 3],
    /// Contribution of the clearance to the normal trial force, N.
    pub shift_n: f64,
    /// State that a slip of one metre leaves, N/m.
    slid_n_per_m: f64,
}

impl PredictedLaw {
    /// Trial force (N, t1, t2), N, from the prediction and the state.
    pub fn trial(&self, lambda_u: [f64; 3], state: [f64; 2]) -> [f64; 3] {
        let [normal, t1, t2] = [0, 1, 2].map(|c| self.shares[c] * lambda_u[c]);
        [normal + self.shift_n, t1 - state[0], t2 - state[1]]
    }

    /// State of the pair under a trial force, and its contact force, N.
    #[inline(always)]
    pub fn force(&self, trial: [f64; 3]) -> (Contact, [f64; 3]) {
        unilateral_coulomb(trial, self.friction)
    }

    /// Derivative of the contact force by the prediction, row by row.
    pub fn derivative(&self, trial: [f64; 3]) -> [[f64; 3]; 3] {
        let by_trial = match self.force(trial).0 {
            Contact::Open => [[0.0; 3]; 3],
            Contact::Stick => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Contact::Slip => {
                let tangent = slip_tangent(trial, self.friction);
                let ([e1, e2], k) = (tangent.direction, tangent.kappa);
                [
                    [1.0, 0.0, 0.0],
                    [-self.friction * e1, k * (1.0 - e1 * e1), -k * e1 * e2],
                    [-self.friction * e2, -k * e1 * e2, k * (1.0 - e2 * e2)],
                ]
            }
        };
        by_trial.map(|row| [0, 1, 2].map(|c| row[c] * self.shares[c]))
    }

    /// State of a pair at rest, N, that is displaced along the contact by `x`, m, under the force
    /// `lambda`, N.
    pub fn state_at_rest(&self, x: [f64; 2], lambda: [f64; 2]) -> [f64; 2] {
        let share = self.shares[1];
        [0, 1].map(|c| self.slid_n_per_m * x[c] - (1.0 - share) * lambda[c])
    }

    /// Distance that a pair slides, m, whose state follows a path of the length `path_n`, N.
    pub fn slid_m(&self, path_n: f64) -> f64 {
        path_n / self.slid_n_per_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dovetail_testkit::differences::central;

    const EPS: [f64; 2] = [5.0, 2.0];

    fn springs() -> PairLaw {
        PairLaw {
            stiffness: Some(PairStiffness::new(7.0, 3.0)),
            ..PairLaw::rigid(0.4, 0.1)
        }
    }

    /// Force of springs with the slider at `w`, from the relative displacement x of the pair.
    fn spring_force(law: PairLaw, x: [f64; 3], w: [f64; 2]) -> [f64; 3] {
        let PairStiffness {
            normal_n_m,
            tangential_n_m,
        } = law.stiffness.unwrap();
        let normal = -normal_n_m * (-(x[0] + law.gap_m)).max(0.0);
        // The contact forces act against x: lambda = kappa (x - w).
        let along = [1, 2].map(|c| tangential_n_m * (x[c] - w[c - 1]));
        [normal, along[0], along[1]]
    }

    #[test]
    fn the_prediction_of_a_pair_that_sticks_gives_the_force_of_its_springs() {
        let law = springs();
        let predicted = law.predicted(EPS, f64::INFINITY);
        let (x, w) = ([-0.5, 0.13, -0.06], [0.1, -0.1]);
        let force = spring_force(law, x, w);
        // lambda_u = lambda + eps x where the balance is solved.
        let lambda_u = [0, 1, 2].map(|c| force[c] + EPS[c.min(1)] * x[c]);
        // The slider is where the pair would be without a force.
        let state = predicted.state_at_rest(w, [0.0; 2]);
        let (contact, found) = predicted.force(predicted.trial(lambda_u, state));
        assert_eq!(contact, Contact::Stick);
        for (found, force) in found.iter().zip(force) {
            assert!((found - force).abs() < 1e-14, "{found} {force}");
        }
        // The same state follows from where the pair is, and what acts on it there.
        let again = predicted.state_at_rest([x[1], x[2]], [force[1], force[2]]);
        let kept = [0, 1].map(|c| predicted.shares[1] * lambda_u[c + 1] - force[c + 1]);
        for c in 0..2 {
            assert!((again[c] - state[c]).abs() < 1e-14);
            assert!((kept[c] - state[c]).abs() < 1e-14);
        }
    }

    #[test]
    fn the_slip_of_a_pair_is_how_far_its_slider_goes() {
        let law = springs();
        let predicted = law.predicted(EPS, f64::INFINITY);
        let [from, to] = [[0.1, 0.0], [0.3, 0.0]].map(|w| predicted.state_at_rest(w, [0.0; 2]));
        assert!((predicted.slid_m(to[0] - from[0]) - 0.2).abs() < 1e-15);
    }

    #[test]
    fn the_derivative_of_the_force_matches_differences() {
        let state = [0.2, -0.1];
        for law in [springs(), PairLaw::rigid(0.4, 0.1)] {
            let law = law.predicted(EPS, f64::INFINITY);
            for (lambda_u, does) in [
                ([-3.0, 0.5, 0.1], Contact::Stick),
                ([-3.0, 4.0, -2.0], Contact::Slip),
                ([1.0, 4.0, -2.0], Contact::Open),
            ] {
                let trial = law.trial(lambda_u, state);
                assert_eq!(law.force(trial).0, does);
                let by_differences = central(&lambda_u, 1e-6, |lambda_u| {
                    let lambda_u = [lambda_u[0], lambda_u[1], lambda_u[2]];
                    law.force(law.trial(lambda_u, state)).1.to_vec()
                });
                let derivative = law.derivative(trial);
                for i in 0..3 {
                    for j in 0..3 {
                        let off = derivative[i][j] - by_differences[(i, j)];
                        assert!(off.abs() < 1e-8, "{does:?}: {i} {j}");
                    }
                }
            }
        }
    }

    #[test]
    fn friction_is_no_more_than_what_is_computed_and_what_is_asked_for() {
        let friction = |friction, most| {
            let law = PairLaw::rigid(friction, 0.0);
            law.predicted(EPS, most).friction
        };
        assert_eq!(friction(1e6, f64::INFINITY), PairLaw::MOST_FRICTION);
        assert_eq!(friction(0.5, f64::INFINITY), 0.5);
        assert_eq!(friction(0.5, 0.3), 0.3);
    }
}
