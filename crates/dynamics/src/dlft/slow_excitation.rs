//! Static test of an excitation that is applied slowly: whether contact can balance it at all.
//!
//! Some motions of the bodies are opposed by contact only. Along each of them the forces of the pairs
//! must do as much work as the loads. A pair can press and not pull, and its friction is at most the
//! coefficient times its compression. If no such forces balance steady load and excitation at an
//! instant of the period, no static equilibrium exists at that instant: the bodies come apart. The
//! test knows neither the elasticity of the bodies nor the history of friction, so forces that
//! balance the loads do not prove an equilibrium.

use crate::contact::PairLaw;
use crate::problem::{HarmonicLoad, Problem};
use dovetail_numerics::dense::Lu;
use dovetail_numerics::vector::{axpy, dot, norm};
use faer::Mat;
use std::f64::consts::TAU;
use std::sync::Mutex;

/// Instants at which a period of the highest excited harmonic is tested.
const INSTANTS: usize = 16;
/// An unbalanced part below this fraction of the loads counts as balanced.
const BALANCED: f64 = 1e-3;
/// No force of a pair reduces the unbalanced part if it does less than this fraction of the work of
/// a force along it.
const OPPOSED: f64 = 1e-4;
/// Number of forces that are tried before the test ends without a decision.
const MOST_FORCES: usize = 200;
/// Share of their own size that keeps forces which are nearly alike from growing without limit.
const RIDGE: f64 = 1e-12;

/// Motions that only contact opposes, and the work of the loads along them.
#[derive(Debug)]
pub(super) struct SlowExcitation {
    /// Orthonormal motions, n entries each.
    motions: Vec<Vec<f64>>,
    /// Work of cosine and sine part of each excitation along the motions.
    excited: Vec<[Vec<f64>; 2]>,
    /// Work of unit forces that retain the mean, in both directions.
    retained: Vec<Vec<f64>>,
    /// Factors on the excitations that were tested last, and the answer.
    last: Mutex<Option<(Vec<f64>, bool)>>,
}

impl SlowExcitation {
    /// Test of the excitations of a problem. `motions` are the motions of the sector that only contact
    /// opposes, orthonormal. Motions along which the mean may be retained, `retained`, do not count.
    pub(super) fn new(problem: &Problem, motions: Vec<Vec<f64>>, retained: &[Vec<f64>]) -> Self {
        let work = |on_x: &[f64]| works(&motions, on_x);
        let excited = |load: &HarmonicLoad| [&load.cosine, &load.sine].map(|p| work(&p.on_x));
        let retained = retained.iter().flat_map(|motion| {
            let along = work(motion);
            let back = along.iter().map(|w| -w).collect();
            [along, back]
        });
        Self {
            excited: problem.excitations.iter().map(excited).collect(),
            retained: retained.filter(|v| norm(v) > BALANCED).collect(),
            motions,
            last: Mutex::new(None),
        }
    }

    /// Returns `true` if at some instant no contact forces balance the loads. `lambda_static_n` are the
    /// contact forces of the static state, N, n, and `factors` those on the excitations.
    pub(super) fn exceeds_contact(
        &self,
        problem: &Problem,
        lambda_static_n: &[f64],
        factors: &[f64],
    ) -> bool {
        let Ok(mut last) = self.last.lock() else {
            return false;
        };
        if let Some((known, answer)) = &*last
            && known == factors
        {
            return *answer;
        }
        let steady = works(&self.motions, lambda_static_n);
        let highest = problem.highest_excited().max(1);
        let count = INSTANTS * highest;
        let mut loads: Vec<Vec<f64>> = (0..count)
            .map(|i| self.excitation_at(problem, factors, TAU * i as f64 / count as f64))
            .collect();
        loads.retain(|load| norm(load) > BALANCED * norm(&steady));
        loads.sort_by(|a, b| norm(b).total_cmp(&norm(a)));
        let answer = loads.iter_mut().any(|load| {
            axpy(1.0, &steady, load);
            self.is_beyond_contact(&problem.laws, load)
        });
        *last = Some((factors.to_vec(), answer));
        answer
    }

    /// Work of the excitations at an angle of the first harmonic.
    fn excitation_at(&self, problem: &Problem, factors: &[f64], angle: f64) -> Vec<f64> {
        let mut work = vec![0.0; self.motions.len()];
        let loads = problem.excitations.iter().zip(&self.excited);
        for ((load, [cosine, sine]), factor) in loads.zip(factors) {
            let (sin, cos) = (load.harmonic as f64 * angle).sin_cos();
            axpy(factor * cos, cosine, &mut work);
            axpy(factor * sin, sine, &mut work);
        }
        work
    }

    /// Returns `true` if no forces of the pairs do this work. The forces nearest to it are built up
    /// from the force of one pair at a time, that which does most work along the unbalanced rest. Where
    /// none does any, this rest is a motion that all pairs let happen and that the loads drive.
    fn is_beyond_contact(&self, laws: &[PairLaw], work: &[f64]) -> bool {
        let mut forces: Vec<Vec<f64>> = Vec::new();
        let mut weights: Vec<f64> = Vec::new();
        for _ in 0..MOST_FORCES {
            let mut rest = work.to_vec();
            for (force, weight) in forces.iter().zip(&weights) {
                axpy(-weight, force, &mut rest);
            }
            let size = norm(&rest);
            if size <= BALANCED * norm(work) {
                return false;
            }
            let Some((gain, force)) = self.best_force(laws, &rest) else {
                return true;
            };
            if gain <= OPPOSED * size {
                return true;
            }
            forces.push(force);
            weights.push(0.0);
            balance(&mut forces, &mut weights, work);
        }
        false
    }

    /// Force of unit work that does most of it along `rest`, with the part along it. `None` without
    /// any.
    fn best_force(&self, laws: &[PairLaw], rest: &[f64]) -> Option<(f64, Vec<f64>)> {
        let mut moved = vec![0.0; 3 * laws.len()];
        for (motion, r) in self.motions.iter().zip(rest) {
            axpy(*r, motion, &mut moved);
        }
        let of_pair = |(pair, law): (usize, &PairLaw)| {
            let [i, j, k] = [0, 1, 2].map(|c| 3 * pair + c);
            let slide = moved[j].hypot(moved[k]);
            let friction = if slide > 0.0 {
                law.computed_friction() / slide
            } else {
                0.0
            };
            let [a, b] = [j, k].map(|c| friction * moved[c]);
            let of_motion = |m: &Vec<f64>| a * m[j] + b * m[k] - m[i];
            self.motions.iter().map(of_motion).collect::<Vec<f64>>()
        };
        let of_pairs = laws.iter().enumerate().map(of_pair);
        let all = of_pairs.chain(self.retained.iter().cloned());
        let gains = all.filter_map(|mut force| {
            let size = norm(&force);
            (size > 0.0).then(|| {
                force.iter_mut().for_each(|f| *f /= size);
                (dot(&force, rest), force)
            })
        });
        gains.max_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Work of forces on the pairs of the sector along motions.
fn works(motions: &[Vec<f64>], on_x: &[f64]) -> Vec<f64> {
    let of = |motion: &Vec<f64>| dot(motion, &on_x[..motion.len()]);
    motions.iter().map(of).collect()
}

/// Weights above zero with which the forces come nearest to `work`; forces without one are left out
/// (Lawson and Hanson's step). The last force is new, with a weight of 0.
fn balance(forces: &mut Vec<Vec<f64>>, weights: &mut Vec<f64>, work: &[f64]) {
    while !forces.is_empty() {
        let count = forces.len();
        let ridge = |i: usize, j: usize| if i == j { RIDGE } else { 0.0 };
        let products = Mat::from_fn(count, count, |i, j| {
            dot(&forces[i], &forces[j]) + ridge(i, j)
        });
        let mut sought: Vec<f64> = forces.iter().map(|force| dot(force, work)).collect();
        Lu::new(products).solve_column_in_place(&mut sought);
        let ends = weights.iter().zip(&sought).map(|(from, to)| {
            if *to <= 0.0 {
                from / (from - to)
            } else {
                f64::INFINITY
            }
        });
        let step = ends.fold(1.0, f64::min).max(0.0);
        for (weight, to) in weights.iter_mut().zip(&sought) {
            let at = *weight + step * (to - *weight);
            let is_left_out = *to <= 0.0 && at <= 1e-12 * to.abs();
            *weight = if is_left_out { 0.0 } else { at };
        }
        if step >= 1.0 {
            return;
        }
        let mut kept = weights.iter().map(|weight| *weight > 0.0);
        forces.retain(|_| kept.next().unwrap_or(false));
        weights.retain(|weight| *weight > 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dlft::Outcome;
    use crate::dlft::made_up::DAMPING;
    use crate::dlft::retention::Holding;
    use crate::dlft::settings::Resolution;
    use crate::dlft::static_state::static_state;
    use crate::dlft::sweep::{SweepSettings, sweep};
    use crate::reduced::{Load, ReducedModel};

    /// Normal of a pair at a place, and its tangents.
    type Place = ([f64; 3], [[f64; 3]; 3]);

    /// A body that touches rigid ground at these places. Nothing else opposes the motions that are
    /// given by three numbers of translation and three of rotation.
    fn body(places: &[Place], rigid: &[[f64; 6]], friction: f64) -> Problem {
        let n = 3 * places.len();
        let cross = |a: [f64; 3], b: [f64; 3]| {
            [0, 1, 2].map(|i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                a[j] * b[k] - a[k] * b[j]
            })
        };
        let on_pairs = |motion: &[f64; 6]| -> Vec<f64> {
            let [u, turn] = [0, 3].map(|c| [0, 1, 2].map(|i| motion[c + i]));
            let of = |(at, frame): &Place| {
                let moved = cross(turn, *at);
                let moved = [0, 1, 2].map(|i| u[i] + moved[i]);
                frame.map(|axis| dot(&axis, &moved))
            };
            places.iter().flat_map(of).collect()
        };
        let mut motions: Vec<Vec<f64>> = Vec::new();
        for mut motion in rigid.iter().map(on_pairs) {
            for other in &motions {
                axpy(-dot(other, &motion), other, &mut motion);
            }
            let size = norm(&motion);
            motions.push(motion.iter().map(|m| m / size).collect());
        }
        let unit = |i: usize, j: usize| f64::from(u8::from(i == j));
        let stiffness = Mat::from_fn(n, n, |i, j| {
            unit(i, j) - motions.iter().map(|m| m[i] * m[j]).sum::<f64>()
        });
        Problem {
            reduced: ReducedModel::from_pair_matrices(stiffness, Mat::identity(n, n)).into(),
            laws: vec![PairLaw::rigid(friction, 0.0); places.len()],
            excitations: Vec::new(),
            modal_ratios: Vec::new(),
        }
    }

    /// Returns `true` if the pairs cannot balance forces on X in addition to the static state.
    fn exceeds(mut problem: Problem, lambda_static_n: &[f64], on_x: Vec<f64>) -> bool {
        let cosine = Load::new(on_x, vec![]);
        problem.excitations = vec![HarmonicLoad::cosine(1, cosine)];
        Holding::new(&problem).excitation_exceeds_contact(lambda_static_n, &[1.0])
    }

    const FLAT: [[f64; 3]; 3] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    /// A plate of 2 by 2 on four pairs at its corners carries 1 N in its middle. A force along it at a
    /// height of 4 tips it from 1/4 N on, whatever the friction: the mean may be retained.
    #[test]
    fn a_plate_tips_where_its_weight_does_not_balance_the_moment() {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
        let places = corners.map(|[x, y]| ([x, y, 0.0], FLAT));
        let rigid =
            [0, 1, 2, 3, 4, 5].map(|i| [0, 1, 2, 3, 4, 5].map(|j| f64::from(u8::from(i == j))));
        let lambda = [-0.25, 0.0, 0.0].repeat(4);
        for friction in [0.0, 0.3, 5.0] {
            for (force_n, tips) in [(0.2, false), (0.245, false), (0.255, true), (2.0, true)] {
                let on_x = corners.iter().flat_map(|[x, _]| {
                    // The moment as normal forces, which do the same work along rigid motions.
                    [4.0 * force_n * -x / 4.0, force_n / 4.0, 0.0]
                });
                let problem = body(&places, &rigid, friction);
                let found = exceeds(problem, &lambda, on_x.collect());
                assert_eq!(found, tips, "{friction} {force_n} N");
            }
        }
    }

    /// Pair on a flank at 45 degrees.
    fn flank(side: f64) -> Place {
        let s = 0.5_f64.sqrt();
        let normal = [-side * s, 0.0, s];
        let along = [s, 0.0, side * s];
        ([0.0; 3], [normal, along, [0.0, 1.0, 0.0]])
    }

    /// A wedge between two flanks at 45 degrees, pressed by 1 N, is pushed across: one flank carries
    /// everything where the force leaves the cone of its friction.
    #[test]
    fn a_wedge_leaves_its_flanks_where_the_force_leaves_the_cone_of_friction() {
        let places = [flank(1.0), flank(-1.0)];
        let rigid = [
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
        ];
        for friction in [0.0_f64, 0.2] {
            // Work on a pair of a force on the wedge, half of it on each.
            let on_x = |force: [f64; 3]| -> Vec<f64> {
                let of = |(_, frame): &Place| frame.map(|axis| 0.5 * dot(&axis, &force));
                places.iter().flat_map(of).collect()
            };
            let most_n = (45.0_f64.to_radians() + friction.atan()).tan();
            let pressed = on_x([0.0, 0.0, -1.0]);
            for (share, leaves) in [(0.5, false), (0.99, false), (1.01, true), (3.0, true)] {
                let problem = body(&places, &rigid, friction);
                let across = on_x([share * most_n, 0.0, 0.0]);
                let found = exceeds(problem, &pressed, across);
                assert_eq!(found, leaves, "{friction} {share}");
            }
        }
    }

    /// An elastic force between the pairs, such as that on a blade beside the wedge, moves no body by
    /// itself: contact can balance it, even if it is much larger than the preload.
    #[test]
    fn a_force_that_drives_no_free_motion_is_balanced() {
        let places = [[-1.0, 0.0], [1.0, 0.0]].map(|[x, y]| ([x, y, 0.0], FLAT));
        let rigid = [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]];
        let lambda = [-1.0, 0.0, 0.0].repeat(2);
        let spreading = vec![100.0, 0.0, 0.0, -100.0, 0.0, 0.0];
        assert!(!exceeds(body(&places, &rigid, 0.3), &lambda, spreading));
        let lifting = [1.2, 0.0, 0.0].repeat(2);
        assert!(exceeds(body(&places, &rigid, 0.3), &lambda, lifting));
    }

    /// A wedge that 1 N presses between two blades on springs, with one iteration for each attempt: of
    /// a force on a blade nothing more is said than that no motion was found. The same force on the
    /// wedge throws it out.
    #[test]
    fn a_wedge_comes_apart_only_where_the_force_acts_on_the_wedge() {
        let places = [flank(1.0), flank(-1.0)];
        let rotated = |i: usize, j: usize| {
            let [(_, own), (_, other)] = [places[i / 3], places[j / 3]];
            let sign = if i / 3 == j / 3 { 0.5 } else { -0.5 };
            sign * dot(&own[i % 3], &other[j % 3])
        };
        let on_pairs = |forces: [[f64; 3]; 2]| -> Vec<f64> {
            let both = places.iter().zip(forces);
            let of = |((_, frame), force): (&Place, [f64; 3])| frame.map(|axis| dot(&axis, &force));
            both.flat_map(of).collect()
        };
        let outcomes = |forces: [[f64; 3]; 2]| {
            let mut reduced =
                ReducedModel::from_pair_matrices(Mat::from_fn(6, 6, rotated), Mat::identity(6, 6));
            let pressed = on_pairs([[0.0, 0.0, -0.5]; 2]);
            reduced.static_load = Load::new(pressed, vec![]);
            let problem = Problem {
                reduced: reduced.into(),
                laws: vec![PairLaw::rigid(0.2, 0.0); 2],
                excitations: vec![HarmonicLoad::cosine(1, Load::new(on_pairs(forces), vec![]))],
                modal_ratios: Vec::new(),
            };
            let mut settings = SweepSettings::new(vec![0.02, 0.03], Resolution::fixed(1, 32));
            settings.slip_threshold_m = Some(1e-9);
            let state = static_state(&problem, 2, settings.newton);
            assert!(state.outcome.is_converged());
            settings.newton.max_iterations = 1;
            let response = sweep(&problem, DAMPING, &state, &settings, &[], &|_| ());
            let outcomes = response.orbits.iter().map(|orbit| orbit.outcome);
            outcomes.collect::<Vec<_>>()
        };
        let force_n = 100.0;
        let half = 0.5 * force_n;
        for outcome in outcomes([[-half, 0.0, 0.0], [half, 0.0, 0.0]]) {
            assert!(
                !outcome.has_motion() && outcome != Outcome::NoStaticEquilibrium,
                "{outcome}"
            );
        }
        let on_wedge = outcomes([[half, 0.0, 0.0]; 2]);
        assert_eq!(on_wedge, [Outcome::NoStaticEquilibrium; 2]);
    }
}
