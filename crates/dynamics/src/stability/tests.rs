//! Multipliers compared with closed forms, and with differences of the map of a period by a plain
//! integration of springs with sliders.

use super::*;
use crate::contact::PairLaw;
use crate::damping::DampingSpec;
use crate::excitation::Excitation;
use crate::forced_response::{ForcedResponse, Solved};
use crate::reduced::ReducedModel;
use dovetail_numerics::dense::{Lu, eigenvalues};
use faer::Mat;
use std::f64::consts::{PI, TAU};

/// A mass of 1 kg on springs in three directions, with a damping of the mass, on one pair.
pub(super) struct Mass {
    pub(super) stiffness: [f64; 3],
    pub(super) damping: f64,
    pub(super) law: PairLaw,
    pub(super) steady: [f64; 3],
    /// Force in phase with the cosine, and with the sine.
    pub(super) force: [[f64; 3]; 2],
    pub(super) omega: f64,
}

impl Mass {
    pub(super) fn problem(&self) -> Problem {
        let k = Mat::from_fn(3, 3, |i, j| if i == j { self.stiffness[i] } else { 0.0 });
        let model = ReducedModel::from_pair_matrices(k, Mat::identity(3, 3))
            .static_load(self.steady)
            .unit_load(self.force[0])
            .unit_load(self.force[1])
            .observe("n", [1.0, 0.0, 0.0])
            .observe("t1", [0.0, 1.0, 0.0]);
        let sine = Excitation {
            phase_rad: 0.5 * PI,
            ..Excitation::cosine(1.0)
        };
        Problem::new(model, vec![self.law], &[Excitation::cosine(1.0), sine])
    }

    /// Orbit with this number of harmonics, and its stability.
    fn judged(&self, harmonics: usize) -> (Orbit, Stability) {
        let (_, orbit, stability) = self.solved(harmonics);
        (orbit, stability)
    }

    pub(super) fn solved(&self, harmonics: usize) -> (Solved, Orbit, Stability) {
        let problem = self.problem();
        let spec = DampingSpec::Rayleigh {
            stiffness_s: 0.0,
            mass_per_s: self.damping,
        };
        let solved = ForcedResponse::new(&problem)
            .damping(spec)
            .harmonics(harmonics)
            .frequencies_hz([self.omega / TAU])
            .solve()
            .unwrap();
        let orbit = solved.response.orbits[0].clone();
        assert!(orbit.outcome.has_motion(), "{:?}", orbit.outcome);
        let stability = judge(&problem, solved.damping, &solved.state, &orbit);
        (solved, orbit, stability)
    }

    /// Contact force and slider after an instant at `x`.
    fn contact(&self, x: &[f64], slider: [f64; 2]) -> ([f64; 3], [f64; 2]) {
        let springs = self.law.stiffness.unwrap();
        let normal = -springs.normal_n_m * (x[0] + self.law.gap_m);
        if normal <= 0.0 {
            return ([0.0; 3], [x[1], x[2]]);
        }
        let k = springs.tangential_n_m;
        let trial = [k * (x[1] - slider[0]), k * (x[2] - slider[1])];
        let (size, limit) = (trial[0].hypot(trial[1]), self.law.friction * normal);
        if size <= limit {
            return ([-normal, trial[0], trial[1]], slider);
        }
        let force = trial.map(|t| t * limit / size);
        (
            [-normal, force[0], force[1]],
            [x[1] - force[0] / k, x[2] - force[1] / k],
        )
    }

    fn rates(&self, t: f64, z: &[f64; 8]) -> [f64; 8] {
        let (contact, _) = self.contact(&z[..3], [z[6], z[7]]);
        let (s, c) = (self.omega * t).sin_cos();
        let mut rates = [0.0; 8];
        for i in 0..3 {
            rates[i] = z[3 + i];
            rates[3 + i] = self.steady[i] + c * self.force[0][i] + s * self.force[1][i]
                - self.stiffness[i] * z[i]
                - self.damping * z[3 + i]
                - contact[i];
        }
        rates
    }

    /// State (x, v, slider) a period later, by the method of Runge and Kutta in a number of steps.
    fn period(&self, mut z: [f64; 8], steps: usize) -> [f64; 8] {
        let h = TAU / self.omega / steps as f64;
        for n in 0..steps {
            let t = n as f64 * h;
            let ahead = |z: &[f64; 8], rates: &[f64; 8], by: f64| -> [f64; 8] {
                std::array::from_fn(|i| z[i] + by * rates[i])
            };
            let k1 = self.rates(t, &z);
            let k2 = self.rates(t + 0.5 * h, &ahead(&z, &k1, 0.5 * h));
            let k3 = self.rates(t + 0.5 * h, &ahead(&z, &k2, 0.5 * h));
            let k4 = self.rates(t + h, &ahead(&z, &k3, h));
            for i in 0..6 {
                z[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
            let (_, slider) = self.contact(&z[..3], [z[6], z[7]]);
            (z[6], z[7]) = (slider[0], slider[1]);
        }
        z
    }

    /// Jacobian of the map of a period by differences.
    fn jacobian(&self, z: [f64; 8], steps: usize) -> Mat<f64> {
        let size = z.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let columns = [0, 1, 2, 3, 4, 5, 6, 7].map(|j| {
            let moved = |sign: f64| {
                let mut moved = z;
                moved[j] += sign * 1e-6 * size;
                self.period(moved, steps)
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            std::array::from_fn::<f64, 8, _>(|i| (up[i] - down[i]) / (2e-6 * size))
        });
        Mat::from_fn(8, 8, |i, j| columns[j][i])
    }

    /// Largest multiplier of the periodic motion near an orbit, by Newton's method on the map of a
    /// period.
    fn largest(&self, orbit: &Orbit) -> c64 {
        const STEPS: usize = 20_000;
        let mut z = [0.0; 8];
        for k in 0..=orbit.harmonics {
            for i in 0..3 {
                if k == 0 {
                    z[i] += orbit.x[i];
                } else {
                    z[i] += orbit.x[3 * (2 * k - 1) + i];
                    z[3 + i] += k as f64 * self.omega * orbit.x[3 * (2 * k) + i];
                }
            }
        }
        let springs = self.law.stiffness.unwrap();
        for c in 0..2 {
            let force: f64 = orbit.lambda[1 + c]
                + (1..=orbit.harmonics)
                    .map(|k| orbit.lambda[3 * (2 * k - 1) + 1 + c])
                    .sum::<f64>();
            z[6 + c] = z[1 + c] - force / springs.tangential_n_m;
        }
        let start = z;
        let size = z.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for _ in 0..8 {
            let image = self.period(z, STEPS);
            let mut step = Mat::from_fn(8, 1, |i, _| image[i] - z[i]);
            if step.norm_max() < 1e-9 * size {
                break;
            }
            let jacobian = self.jacobian(z, STEPS);
            let matrix = Mat::from_fn(8, 8, |i, j| {
                (if i == j { 1.0 } else { 0.0 }) - jacobian[(i, j)]
            });
            Lu::new(matrix).solve_in_place(step.as_mut());
            (0..8).for_each(|i| z[i] += step[(i, 0)]);
        }
        let off = (0..8).fold(0.0_f64, |m, i| m.max((z[i] - start[i]).abs()));
        assert!(
            off < 0.05 * size,
            "the orbit is {off} from a motion of {size}"
        );
        let values = eigenvalues(self.jacobian(z, STEPS).as_ref()).unwrap();
        let above = values.into_iter().filter(|v| v.im >= 0.0);
        above.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap()
    }

    fn assert_multiplier(&self, harmonics: usize, tolerance: f64) -> Stability {
        let (orbit, found) = self.judged(harmonics);
        let expected = self.largest(&orbit);
        let multiplier = found.multiplier.unwrap();
        let off = (multiplier - expected).norm();
        assert!(
            off < tolerance,
            "{multiplier} instead of {expected}: {found:?}"
        );
        found
    }
}

/// The mass 1 m from a stop, or on one without clearance.
pub(super) fn stop(omega: f64, gap_m: f64, damping: f64) -> Mass {
    Mass {
        stiffness: [1.0, 2.3, 3.1],
        damping,
        law: PairLaw::rigid(0.0, gap_m).springs(10.0, 10.0),
        steady: [0.0; 3],
        force: [[0.1, 0.0, 0.0], [0.0; 3]],
        omega,
    }
}

/// Twice the frequency of the free vibration of the mass on the stop without clearance.
pub(super) fn twice_the_resonance() -> f64 {
    let [open, closed] = [1.0, 11.0_f64.sqrt()];
    4.0 * open * closed / (open + closed)
}

#[test]
fn a_linear_oscillator_decays_by_its_damping() {
    let mass = stop(0.5, 100.0, 0.02);
    let (_, found) = mass.judged(1);
    let period = TAU / mass.omega;
    let multipliers = mass.stiffness.map(|k| {
        let rate = (k - 0.25 * mass.damping * mass.damping).sqrt();
        let multiplier = c64::cis(rate * period) * (-0.5 * mass.damping * period).exp();
        c64::new(multiplier.re, multiplier.im.abs())
    });
    let found = found.multiplier.unwrap();
    let is_near = |of: &c64| (found - of).norm() < 1e-11;
    assert!(multipliers.iter().any(is_near), "{found} {multipliers:?}");
}

#[test]
fn a_stop_doubles_the_period_at_twice_its_resonance() {
    let found = stop(twice_the_resonance(), 0.0, 0.01).assert_multiplier(15, 5e-3);
    assert_eq!(found.verdict, Verdict::Unstable(Kind::PeriodDoubling));
    // The tangential directions have multipliers of their own, which heavy damping leaves behind.
    let found = stop(twice_the_resonance(), 0.0, 1.5).assert_multiplier(15, 5e-3);
    assert_eq!(found.verdict, Verdict::Stable);
}

#[test]
fn complex_multipliers_of_a_stop_have_the_modulus_of_the_damping() {
    let mass = stop(0.9, 0.2, 0.1);
    let (_, found) = mass.judged(21);
    let expected = (-0.5 * mass.damping * TAU / mass.omega).exp();
    let size = found.multiplier.unwrap().norm();
    assert!((size - expected).abs() < 1e-6, "{size} {expected}");
}

#[test]
fn directions_without_unknowns_do_not_count() {
    let mass = stop(twice_the_resonance(), 0.0, 0.01);
    let (solved, orbit, found) = mass.solved(15);
    let mut alone = mass.problem();
    let reduced = alone.reduced_mut();
    (reduced.mass[(1, 1)], reduced.mass[(2, 2)]) = (0.0, 0.0);
    let again = judge(&alone, solved.damping, &solved.state, &orbit);
    assert_eq!(again.verdict, found.verdict);
    let off = (again.multiplier.unwrap() - found.multiplier.unwrap()).norm();
    assert!(off < 1e-9, "{off:e}");
}

/// The mass pressed on the ground with 1 N.
pub(super) fn rubbing(law: PairLaw, force: [[f64; 3]; 2], omega: f64) -> Mass {
    Mass {
        stiffness: [1.0, 1.0, 1.4],
        damping: 0.02,
        law,
        steady: [-1.0, 0.0, 0.0],
        force,
        omega,
    }
}

#[test]
fn a_jenkins_element_forgets_where_it_was_when_it_slips() {
    let law = PairLaw::rigid(0.3, 0.0).springs(40.0, 5.0);
    let force = [[0.0, 0.6, 0.0], [0.0; 3]];
    rubbing(law, force, 1.3).assert_multiplier(31, 5e-3);
}

#[test]
fn friction_turns_with_the_motion_and_landing_pairs_move_on() {
    let law = PairLaw::rigid(0.3, 0.0).springs(12.0, 8.0);
    // Slip that turns, and a normal force that changes with it.
    let force = [[0.5, 0.9, 0.1], [0.1, 0.2, 0.7]];
    rubbing(law, force, 1.1).assert_multiplier(31, 5e-3);
    // A pair that opens, and sticks after it lands.
    let law = PairLaw::rigid(1.5, 0.0).springs(12.0, 8.0);
    let force = [[1.0, 0.3, 0.1], [0.1, 0.2, 0.2]];
    let mass = Mass {
        damping: 0.1,
        ..rubbing(law, force, 0.6)
    };
    let found = mass.assert_multiplier(41, 1e-2);
    assert!(
        found.multiplier.unwrap().norm() > 0.7,
        "that of the normal direction is 0.6"
    );
}

#[test]
fn what_is_not_treated_is_not_judged() {
    let mass = Mass {
        law: PairLaw::rigid(0.0, 0.2),
        ..stop(0.9, 0.2, 0.1)
    };
    let (solved, orbit, found) = mass.solved(9);
    assert_eq!(found, Stability::not_judged(Reason::Landing));
    let failed = Orbit {
        outcome: crate::dlft::Outcome::IterationLimit,
        ..orbit
    };
    let found = judge(&mass.problem(), Rayleigh::NONE, &solved.state, &failed);
    assert_eq!(found, Stability::not_judged(Reason::NoMotion));
}

/// Den Hartog (1931): the mass turns at once where the force of the spring and the excitation together
/// exceed the friction. A perturbation of the velocity changes there as the acceleration does.
#[test]
fn rigid_friction_takes_its_share_of_the_velocity_where_it_turns() {
    let law = PairLaw::rigid(0.2, 0.0);
    let mass = rubbing(law, [[0.0, 1.0, 0.0], [0.0; 3]], 0.7);
    let mass = Mass {
        damping: 0.0,
        ..mass
    };
    let (orbit, found) = mass.judged(31);
    let series = &orbit.observed[1];
    let at = |t: f64| -> f64 {
        let terms = (1..=orbit.harmonics).map(|k| {
            let (s, c) = (k as f64 * t).sin_cos();
            series[2 * k - 1] * c + series[2 * k] * s
        });
        terms.sum()
    };
    let instants = (0..10_000).map(|n| TAU * f64::from(n) / 1e4);
    let turn = instants.max_by(|a, b| at(*a).total_cmp(&at(*b))).unwrap();
    let without = turn.cos() - at(turn);
    let kept = (without + 0.2) / (without - 0.2);
    // Two half periods: the free vibration, and the remaining velocity.
    let (s, c) = (PI / mass.omega).sin_cos();
    let mut half = Mat::from_fn(2, 2, |i, j| if i == j { c } else { 0.0 });
    (half[(0, 1)], half[(1, 0)]) = (s, -s * kept);
    half[(1, 1)] = c * kept;
    let values = eigenvalues(half.as_ref()).unwrap();
    let expected = values.iter().map(|v| v.norm().powi(2)).fold(0.0, f64::max);
    let size = found.multiplier.unwrap().norm();
    assert!((size - expected).abs() < 0.03, "{size} {expected}");
}
