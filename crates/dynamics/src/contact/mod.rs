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
//! DLFT predicts the force lambda_u with which a rigid pair would stick. The law takes a share of
//! it, counted from the clearance ([`penalty`]). Less what the pair has slid this is the trial
//! force, which the law brings to the cone of friction (`coulomb`). What a pair keeps from
//! instant to instant is its `PairState`.
//!
//! [`PairLaw`] is the data: the model has it, and all solvers read it. `PredictedLaw` is the
//! function, for numbers with and without derivatives alike ([`Real`]). All of the folder `dlft`
//! evaluates it, but for `rounded.rs`, which has a law without corners. [`crate::integration`] has
//! its own law on purpose, without lambda_u, so that an error in one of the two shows.

pub(crate) mod coulomb;
pub mod penalty;

use coulomb::{Contact, SlipTangent};
use dovetail_numerics::dual::{Real, three, two};
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
    /// Coefficient of wear of both sides together, m2/N: volume per normal force and distance slid
    /// (Archard). The law itself does not depend on it.
    pub wear_m2_n: f64,
}

impl PairLaw {
    /// Largest coefficient of friction that is computed with. A pair with it sticks as long as it
    /// is pressed, which a larger coefficient does not change (1e3 and 1e4 give the same peak to
    /// 1e-5), but friction is known only to the coefficient times the rounding of the normal force.
    pub const MOST_FRICTION: f64 = 1e3;

    /// Rigid contact that does not wear.
    pub const fn rigid(friction: f64, gap_m: f64) -> Self {
        Self {
            friction,
            gap_m,
            stiffness: None,
            wear_m2_n: 0.0,
        }
    }

    /// The same law through springs, N/m: the normal force grows with the penetration, and the
    /// friction force with the shear until the pair slips.
    ///
    /// ```
    /// use dovetail_dynamics::contact::PairLaw;
    ///
    /// let law = PairLaw::rigid(0.3, 0.0).springs(1e8, 5e7);
    /// assert_eq!(law.stiffness.map(|springs| springs.tangential_n_m), Some(5e7));
    /// ```
    #[must_use]
    pub const fn springs(self, normal_n_m: f64, tangential_n_m: f64) -> Self {
        Self {
            stiffness: Some(PairStiffness::new(normal_n_m, tangential_n_m)),
            ..self
        }
    }

    /// Law of a pair with this tributary area, m2, where `self` is that of a pair with 1 m2.
    pub fn scaled_to_area(self, area_m2: f64) -> Self {
        Self {
            stiffness: self.stiffness.map(|springs| springs.times(area_m2)),
            ..self
        }
    }

    /// Coefficient of friction that is computed with.
    pub(crate) fn computed_friction(&self) -> f64 {
        self.friction.min(Self::MOST_FRICTION)
    }

    /// Law as a function of the predicted force, with these eps, normal and tangential, N/m, and a
    /// coefficient of at most `most_friction`.
    pub(crate) fn predicted(&self, eps: [f64; 2], most_friction: f64) -> PredictedLaw {
        let [normal, tangential] = self.stiffness.map_or([1.0; 2], |s| s.shares(eps));
        PredictedLaw {
            friction: self.computed_friction().min(most_friction),
            is_rigid: self.stiffness.is_none(),
            shares: [normal, tangential, tangential],
            shift_n: normal * eps[0] * self.gap_m,
            slid_n_per_m: tangential * eps[1],
            touch_n: 0.0,
        }
    }

    /// Law as a function of the displacement times springs of these stiffnesses, normal and
    /// tangential, N/m.
    pub(crate) fn of_springs(&self, [normal, tangential]: [f64; 2]) -> PredictedLaw {
        PredictedLaw {
            friction: self.computed_friction(),
            is_rigid: self.stiffness.is_none(),
            shares: [1.0; 3],
            shift_n: normal * self.gap_m,
            slid_n_per_m: tangential,
            touch_n: 0.0,
        }
    }
}

/// Law of a pair as a function of the predicted force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PredictedLaw {
    /// Coulomb coefficient of friction.
    pub friction: f64,
    /// True if a pair that sticks has no motion of its own: its force is then the prediction.
    pub is_rigid: bool,
    /// Shares of the prediction (N, t1, t2) that the trial force takes.
    pub shares: [f64; 3],
    /// Contribution of the clearance to the normal trial force, N.
    pub shift_n: f64,
    /// Change of [`PairState::slid_n`] by a slip of one metre, N/m.
    slid_n_per_m: f64,
    /// A pair that sticks within this of its cone counts as slipping, N.
    pub touch_n: f64,
}

/// State of a pair that is kept from one instant to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PairState<D = f64> {
    /// Stick, slip or open.
    pub contact: Contact,
    /// Way along the contact as a force, share lambda_u_T - lambda_T, N. It changes where the pair
    /// slips or is open.
    pub slid_n: [D; 2],
}

/// Pair at one instant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant<D = f64> {
    /// Trial force (N, t1, t2), N.
    pub trial: [D; 3],
    /// Contact force, N.
    pub force: [D; 3],
    /// State after the instant.
    pub state: PairState<D>,
}

impl<D: Real> PairState<D> {
    /// State after an instant at which the contact force was `force` under this prediction, N.
    #[inline(always)]
    pub(crate) fn from_contact_force(prediction: [D; 3], contact: Contact, force: [D; 3]) -> Self {
        Self {
            contact,
            slid_n: two(|c| prediction[c + 1] - force[c + 1]),
        }
    }

    /// Trial force under a prediction, N, if this is the state before.
    #[inline(always)]
    pub(crate) fn trial_force(&self, prediction: [D; 3]) -> [D; 3] {
        let [normal, t1, t2] = prediction;
        [normal, t1 - self.slid_n[0], t2 - self.slid_n[1]]
    }
}

impl PairState {
    /// Distance between two states along the contact, as a force, N.
    #[inline(always)]
    pub(crate) fn distance_n(&self, other: &Self) -> f64 {
        let [t1, t2] = [0, 1].map(|c| self.slid_n[c] - other.slid_n[c]);
        coulomb::length(t1, t2)
    }
}

impl PredictedLaw {
    /// Returns `true` if there is friction: forces then depend on the past.
    #[inline(always)]
    pub(crate) fn has_friction(&self) -> bool {
        self.friction > 0.0
    }

    /// Prediction (N, t1, t2), N, that the law evaluates: its share of `lambda_u`, with the
    /// clearance.
    pub(crate) fn prediction(&self, lambda_u: [f64; 3]) -> [f64; 3] {
        let [normal, t1, t2] = [0, 1, 2].map(|c| self.shares[c] * lambda_u[c]);
        [normal + self.shift_n, t1, t2]
    }

    /// Pair under a prediction, N, in the state `before`. `rate` is the rate of the tangential
    /// prediction at this instant, N per step; `None`: the step is as good as straight.
    #[inline(always)]
    pub(crate) fn evaluate<D: Real>(
        &self,
        prediction: [D; 3],
        rate: impl FnOnce() -> Option<[D; 2]>,
        before: PairState<D>,
    ) -> Instant<D> {
        let trial = before.trial_force(prediction);
        let (contact, force) =
            coulomb::unilateral_coulomb(trial, rate, self.friction, self.touch_n);
        let state = match contact {
            Contact::Stick => PairState { contact, ..before },
            Contact::Slip | Contact::Open => {
                PairState::from_contact_force(prediction, contact, force)
            }
        };
        Instant {
            trial,
            force,
            state,
        }
    }

    /// Derivative of the contact force where the pair slips.
    #[inline(always)]
    pub(crate) fn slip_tangent(&self, trial: [f64; 3], rate: Option<[f64; 2]>) -> SlipTangent {
        coulomb::slip_tangent(trial, rate, self.friction)
    }

    /// Derivative by lambda_u of the contact force of a straight step, row by row.
    pub(crate) fn derivative(&self, instant: &Instant) -> [[f64; 3]; 3] {
        let by_trial = match instant.state.contact {
            Contact::Open => [[0.0; 3]; 3],
            Contact::Stick => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Contact::Slip => {
                let tangent = self.slip_tangent(instant.trial, None);
                let ([b1, b2], [a1, a2]) = (tangent.by_normal, tangent.across);
                let [t1, t2] = tangent.by_trial;
                [
                    [1.0, 0.0, 0.0],
                    [b1, a1 * t1, a1 * t2],
                    [b2, a2 * t1, a2 * t2],
                ]
            }
        };
        by_trial.map(|row| [0, 1, 2].map(|c| row[c] * self.shares[c]))
    }

    /// Fraction of the straight way from one prediction to another at which a closed pair leaves
    /// its cone, at most `last`, and its tangential force there, N.
    #[inline(always)]
    pub(crate) fn leaves_cone<D: Real>(
        &self,
        [from, to]: [[D; 3]; 2],
        state: PairState<D>,
        last: D,
    ) -> (D, [D; 2]) {
        let step = three(|c| to[c] - from[c]);
        let slips = state.contact == Contact::Slip;
        let way = coulomb::leaves_cone(state.trial_force(from), step, self.friction, slips, last);
        let [_, t1, t2] = state.trial_force(three(|c| from[c] + step[c] * way));
        (way, [t1, t2])
    }

    /// Returns `true` if the force of a pair that slips, N, goes into its cone with this step.
    #[inline(always)]
    pub(crate) fn turns_inward(&self, force: [f64; 3], step: [f64; 3]) -> bool {
        coulomb::turns_inward(force, step, self.friction)
    }

    /// State of a pair at rest that is displaced along the contact by `x`, m, under the force
    /// `lambda`, N.
    pub(crate) fn state_at_rest(&self, x: [f64; 2], lambda: [f64; 2]) -> PairState {
        let share = self.shares[1];
        PairState {
            contact: Contact::Stick,
            slid_n: [0, 1].map(|c| self.slid_n_per_m * x[c] - (1.0 - share) * lambda[c]),
        }
    }

    /// Distance that a pair slides, m, whose state follows a path of the length `path_n`, N.
    pub(crate) fn slid_m(&self, path_n: f64) -> f64 {
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
        let found = predicted.evaluate(predicted.prediction(lambda_u), || None, state);
        assert_eq!(found.state.contact, Contact::Stick);
        for (found, force) in found.force.iter().zip(force) {
            assert!((found - force).abs() < 1e-14, "{found} {force}");
        }
        // The same state follows from where the pair is, and what acts on it there.
        let again = predicted.state_at_rest([x[1], x[2]], [force[1], force[2]]);
        let kept =
            PairState::from_contact_force(predicted.prediction(lambda_u), Contact::Stick, force);
        for found in [again, kept] {
            assert!(found.distance_n(&state) < 1e-14);
        }
    }

    #[test]
    fn the_slip_of_a_pair_is_how_far_its_slider_goes() {
        let law = springs();
        let predicted = law.predicted(EPS, f64::INFINITY);
        let [from, to] = [[0.1, 0.0], [0.3, 0.0]].map(|w| predicted.state_at_rest(w, [0.0; 2]));
        assert!((predicted.slid_m(to.distance_n(&from)) - 0.2).abs() < 1e-15);
    }

    #[test]
    fn the_derivative_of_the_force_matches_differences() {
        let state = PairState {
            contact: Contact::Stick,
            slid_n: [0.2, -0.1],
        };
        for law in [springs(), PairLaw::rigid(0.4, 0.1)] {
            let law = law.predicted(EPS, f64::INFINITY);
            for (lambda_u, does) in [
                ([-3.0, 0.5, 0.1], Contact::Stick),
                ([-3.0, 4.0, -2.0], Contact::Slip),
                ([1.0, 4.0, -2.0], Contact::Open),
            ] {
                let at = |lambda_u| law.evaluate(law.prediction(lambda_u), || None, state);
                assert_eq!(at(lambda_u).state.contact, does);
                let by_differences = central(&lambda_u, 1e-6, |lambda_u| {
                    at([lambda_u[0], lambda_u[1], lambda_u[2]]).force.to_vec()
                });
                let derivative = law.derivative(&at(lambda_u));
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
