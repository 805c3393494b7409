//! Wear of the pairs by Archard's law over a block of cycles.
//!
//! A vibration about a state tells how deep each pair wears in a cycle, and from which compression
//! ([`WearRate`]). Over the block the distance slid stays, and the compression changes as the worn
//! depth opens the clearances: the equilibrium at rest gives it. A step of the block is implicit.
//! The depth that is worn in it is proportional to the compression at its end, and so the pair has a
//! spring there whose penetration is that depth ([`crate::contact::penalty`]). A pair that would lose
//! its pressure within a fraction of the step then loses it without oscillations. The number of
//! steps is doubled until the depths no longer change.
//!
//! A pair that slides in the vibration does not hold its place along the contact: each cycle takes it
//! to where the mean of the vibration is. At rest it keeps its mean friction on a soft spring.

use super::StaticState;
use super::static_state::{PairsAtRest, settled_after};
use crate::contact::PairLaw;
use crate::contact::penalty::PairStiffness;
use crate::problem::Problem;
use dovetail_numerics::nonlinear::NewtonOptions;

/// Most steps of a block.
const MOST_STEPS: usize = 64;
/// Spring along the contact of a pair that slides, as a fraction of its own stiffness.
const SOFT: f64 = 1e-3;

/// Wear of a pair in one cycle, as a line over its compression at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WearRate {
    /// Depth worn in a cycle about this state, m.
    pub depth_m: f64,
    /// Compression of the pair in the state that the vibration leaves, N.
    pub at_rest_n: f64,
    /// Compression that the depth is proportional to, N: that at rest, or the mean of the vibration
    /// where that is larger, as of a pair that touches only now and then.
    pub scale_n: f64,
    /// True if the pair slides or opens in the vibration.
    pub slides: bool,
}

impl WearRate {
    /// Change of the depth by the compression at rest, m/N.
    fn depth_per_newton(&self) -> f64 {
        match self.scale_n {
            scale_n if scale_n > 0.0 => self.depth_m / scale_n,
            _ => 0.0,
        }
    }

    /// Depth in a cycle of a pair without compression at rest, m.
    fn unpressed_m(&self) -> f64 {
        (self.depth_m - self.depth_per_newton() * self.at_rest_n).max(0.0)
    }

    /// Depth in a cycle where the compression at rest is another one, m.
    pub fn cycle_depth_m(&self, compression_n: f64) -> f64 {
        self.unpressed_m() + self.depth_per_newton() * compression_n
    }
}

/// Block of cycles.
#[derive(Debug, Clone)]
pub struct WornBlock {
    /// Depth worn in it by each pair, m.
    pub depth_m: Vec<f64>,
    /// Relative displacement at its end, m, n.
    pub x: Vec<f64>,
    /// Contact forces at its end, N, n.
    pub lambda: Vec<f64>,
    /// Number of its steps.
    pub steps: usize,
}

impl WornBlock {
    /// State at rest at its end.
    pub fn rest_state(&self) -> PairsAtRest<'_> {
        PairsAtRest {
            x: &self.x,
            lambda: &self.lambda,
        }
    }
}

/// State at rest that a vibration with this mean leaves.
/// `slides` has the pairs that slide or open in it. Its linear reference is that of pairs that stick.
/// The laws of the problem are the same afterwards.
pub fn rest_state_after(
    problem: &mut Problem,
    mean: PairsAtRest<'_>,
    slides: &[bool],
    options: NewtonOptions,
) -> StaticState {
    let laws = problem.laws.clone();
    let soft = soft_n_m(problem);
    for (pair, law) in problem.laws.iter_mut().enumerate() {
        law.stiffness = softened(law.stiffness, 0.0, slides[pair].then_some(soft[pair]));
    }
    let state = settled_after(problem, mean, options);
    problem.laws = laws;
    state
}

/// Stiffness of the spring along the contact that a pair has where it slides, N/m.
fn soft_n_m(problem: &Problem) -> Vec<f64> {
    let diagonal = problem.reduced.diagonal_stiffness();
    diagonal
        .chunks_exact(3)
        .map(|diagonal| SOFT * diagonal[1].max(diagonal[2]))
        .collect()
}

/// Wears the pairs over a number of cycles, from a state at rest of the problem. `rates` has one rate
/// for each pair. The depths are those of an ever finer step within `tolerance` of the largest. `None`
/// where that takes more steps than 64, or an equilibrium on the way is not found. The laws of the
/// problem are the same afterwards.
pub fn wear_block(
    problem: &mut Problem,
    rest: PairsAtRest<'_>,
    rates: &[WearRate],
    cycles: f64,
    tolerance: f64,
    options: NewtonOptions,
) -> Option<WornBlock> {
    let laws = problem.laws.clone();
    let (mut coarse, mut steps) = (None::<WornBlock>, 1);
    let block = loop {
        let fine = wear_in_steps(problem, &laws, rest, rates, cycles, steps, options);
        if let (Some(coarse), Some(fine)) = (&coarse, &fine) {
            let both = coarse.depth_m.iter().zip(&fine.depth_m);
            let change = both.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // The error of a step of first order is halved each time.
            if change <= tolerance * largest(&fine.depth_m) {
                break Some(fine.clone());
            }
        }
        steps *= 2;
        if steps > MOST_STEPS {
            break None;
        }
        coarse = fine;
    };
    problem.laws = laws;
    block
}

/// What is left of errors of the depths at the end of a block of cycles, m: a pair that is deeper by
/// `missed_m` loses pressure, and wears less in so many cycles. `end` is the state at rest at the end,
/// with the clearances that the problem has. `None` where no equilibrium is found. The laws of the
/// problem are the same afterwards.
pub fn remaining_errors(
    problem: &mut Problem,
    end: PairsAtRest<'_>,
    rates: &[WearRate],
    cycles: f64,
    missed_m: &[f64],
    options: NewtonOptions,
) -> Option<Vec<f64>> {
    let laws = problem.laws.clone();
    let soft = soft_n_m(problem);
    let compression = |lambda: &[f64], pair: usize| (-lambda[3 * pair]).max(0.0);
    for (pair, (law, rate)) in problem.laws.iter_mut().zip(rates).enumerate() {
        let compliance_m_n = cycles * rate.depth_per_newton();
        law.gap_m += missed_m[pair] - compliance_m_n * compression(end.lambda, pair);
        let along = rate.slides.then_some(soft[pair]);
        law.stiffness = softened(law.stiffness, compliance_m_n, along);
    }
    let state = settled_after(problem, end, options);
    problem.laws = laws;
    let left = |(pair, rate): (usize, &WearRate)| {
        let gained_n = compression(&state.lambda, pair) - compression(end.lambda, pair);
        missed_m[pair] + cycles * rate.depth_per_newton() * gained_n
    };
    let converged = state.outcome.is_converged();
    converged.then(|| rates.iter().enumerate().map(left).collect())
}

/// Largest of some depths, m; 0 of none.
pub fn largest(depth_m: &[f64]) -> f64 {
    depth_m.iter().copied().fold(0.0, f64::max)
}

/// Wears the pairs in a number of equal steps. `own` are the laws at the beginning.
fn wear_in_steps(
    problem: &mut Problem,
    own: &[PairLaw],
    rest: PairsAtRest<'_>,
    rates: &[WearRate],
    cycles: f64,
    steps: usize,
    options: NewtonOptions,
) -> Option<WornBlock> {
    let mut block = WornBlock {
        depth_m: vec![0.0; rates.len()],
        x: rest.x.to_vec(),
        lambda: rest.lambda.to_vec(),
        steps,
    };
    let cycles = cycles / steps as f64;
    let soft = soft_n_m(problem);
    for _ in 0..steps {
        let pairs = rates.iter().zip(&mut block.depth_m).zip(&soft);
        for ((law, own), ((rate, depth_m), soft)) in problem.laws.iter_mut().zip(own).zip(pairs) {
            *depth_m += cycles * rate.unpressed_m();
            let along = rate.slides.then_some(*soft);
            *law = PairLaw {
                gap_m: own.gap_m + *depth_m,
                stiffness: softened(own.stiffness, cycles * rate.depth_per_newton(), along),
                ..*own
            };
        }
        let state = settled_after(problem, block.rest_state(), options);
        if !state.outcome.is_converged() {
            return None;
        }
        let pairs = rates.iter().zip(&mut block.depth_m);
        for ((rate, depth_m), lambda) in pairs.zip(state.lambda.chunks_exact(3)) {
            *depth_m += cycles * rate.depth_per_newton() * (-lambda[0]).max(0.0);
        }
        (block.x, block.lambda) = (state.x, state.lambda);
    }
    Some(block)
}

/// Springs of a pair in series with one along the normal of this compliance, m/N, and on another one
/// along the contact, N/m, where one is given.
fn softened(
    own: Option<PairStiffness>,
    compliance_m_n: f64,
    along_n_m: Option<f64>,
) -> Option<PairStiffness> {
    if compliance_m_n == 0.0 && along_n_m.is_none() {
        return own;
    }
    let rigid = PairStiffness::new(f64::INFINITY, f64::INFINITY);
    let springs = own.unwrap_or(rigid);
    Some(PairStiffness::new(
        1.0 / (1.0 / springs.normal_n_m + compliance_m_n),
        springs
            .tangential_n_m
            .min(along_n_m.unwrap_or(f64::INFINITY)),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reduced::{Load, ReducedModel};
    use faer::Mat;

    const OPTIONS: NewtonOptions = NewtonOptions::new(1e-12, 50);
    /// Pairs that touch without a force.
    const UNLOADED: PairsAtRest<'_> = PairsAtRest {
        x: &[0.0; 6],
        lambda: &[0.0; 6],
    };
    /// Stiffness of the springs behind both pairs, N/m.
    const SPRINGS: [f64; 2] = [4.0, 1.0];
    /// Depth of each pair in a cycle over its force, m/N.
    const RATES: [f64; 2] = [2e-3, 1e-3];
    /// Force that presses the plate, N.
    const PRESSES: f64 = 3.0;

    /// A plate that is pressed on two pairs through a spring each, and cannot turn: the pairs give
    /// way by their forces over their springs.
    fn plate() -> Problem {
        let n = 6;
        // The plate is condensed: K = diag(k) - k k^T / sum(k), with a weak spring to ground beside.
        let ground = 1e-9;
        let sum = SPRINGS.iter().sum::<f64>() + ground;
        let stiffness = Mat::from_fn(n, n, |i, j| match (i % 3, j % 3) {
            (0, 0) => {
                let own = if i == j { SPRINGS[i / 3] } else { 0.0 };
                own - SPRINGS[i / 3] * SPRINGS[j / 3] / sum
            }
            _ if i == j => 1.0,
            _ => 0.0,
        });
        let on_x = (0..n).map(|i| match i % 3 {
            0 => -PRESSES * SPRINGS[i / 3] / sum,
            _ => 0.0,
        });
        Problem {
            reduced: ReducedModel {
                static_load: Load::new(on_x.collect(), vec![]),
                ..ReducedModel::new(
                    stiffness,
                    Mat::from_fn(n, n, |i, j| f64::from(u8::from(i == j))),
                    Mat::zeros(n, 0),
                    vec![],
                )
            }
            .into(),
            laws: vec![PairLaw::rigid(0.3, 0.0); 2],
            excitations: vec![],
            modal_ratios: vec![],
        }
    }

    /// Rates of both pairs, which slide, in this state.
    fn rates(state: &StaticState) -> [WearRate; 2] {
        [0, 1].map(|pair| {
            let at_rest_n = -state.lambda[3 * pair];
            WearRate {
                depth_m: RATES[pair] * at_rest_n,
                at_rest_n,
                scale_n: at_rest_n,
                slides: true,
            }
        })
    }

    /// The force P of the first pair of two that share a load goes to what equal rates of depth ask
    /// for. With rates a_i P_i the difference of the depths is that of the springs: with
    /// s = 1 / k_1 + 1 / k_2, P_1' s = a_2 (F - P_1) - a_1 P_1.
    #[test]
    fn two_pairs_share_a_load_as_the_closed_form_has_it() {
        let mut problem = plate();
        let rest = settled_after(&problem, UNLOADED, OPTIONS);
        let share = SPRINGS[0] / (SPRINGS[0] + SPRINGS[1]);
        assert!((-rest.lambda[0] - PRESSES * share).abs() < 1e-6);
        let (a, rates) = (RATES, rates(&rest));
        let compliance = 1.0 / SPRINGS[0] + 1.0 / SPRINGS[1];
        let (limit, decay) = (PRESSES * a[1] / (a[0] + a[1]), (a[0] + a[1]) / compliance);
        let expected = |cycles: f64| limit + (PRESSES * share - limit) * (-decay * cycles).exp();
        for (cycles, tolerance) in [(100.0, 5e-3), (1000.0, 0.02), (1e7, 0.05)] {
            let rest = PairsAtRest::from(&rest);
            let block = wear_block(&mut problem, rest, &rates, cycles, tolerance, OPTIONS);
            let block = block.unwrap();
            let forces = [0, 1].map(|pair| -block.lambda[3 * pair]);
            println!(
                "{cycles}: {forces:?} {} {} steps",
                expected(cycles),
                block.steps
            );
            // The spring to ground carries what the plate has come down.
            let on_ground_n = 2e-9 * block.depth_m[0];
            assert!((forces[0] + forces[1] - PRESSES).abs() < 1e-6 + on_ground_n);
            assert!((forces[0] - expected(cycles)).abs() < 0.02 * PRESSES);
            // The depths differ by what the springs have given back.
            let gave = (PRESSES * share - forces[0]) * compliance;
            let depths = block.depth_m[0] - block.depth_m[1];
            assert!((depths - gave).abs() < 1e-6 * block.depth_m[0]);
        }
        assert!(
            problem
                .laws
                .iter()
                .all(|law| *law == PairLaw::rigid(0.3, 0.0))
        );
    }

    /// A depth e more takes the force P from the first pair. The depths become e - n a_1 P and n a_2 P,
    /// whose difference the springs take: P s = e - n (a_1 + a_2) P.
    #[test]
    fn pressures_resist_an_error_of_the_depths_the_more_the_longer_the_block() {
        let mut problem = plate();
        let state = settled_after(&problem, UNLOADED, OPTIONS);
        let (a, rates) = (RATES, rates(&state));
        let compliance = 1.0 / SPRINGS[0] + 1.0 / SPRINGS[1];
        let error_m = 1e-3;
        for cycles in [1.0, 100.0, 1e6] {
            let end = PairsAtRest::from(&state);
            let missed_m = [error_m, 0.0];
            let left = remaining_errors(&mut problem, end, &rates, cycles, &missed_m, OPTIONS);
            let lost_n = error_m / (compliance + cycles * (a[0] + a[1]));
            let expected = [error_m - cycles * a[0] * lost_n, cycles * a[1] * lost_n];
            for (left, expected) in left.unwrap().iter().zip(expected) {
                assert!((left - expected).abs() < 1e-6 * error_m, "{cycles}: {left}");
            }
        }
    }

    #[test]
    fn a_pair_that_touches_now_and_then_wears_without_a_compression_at_rest() {
        let rate = WearRate {
            depth_m: 2.0,
            at_rest_n: 1.0,
            scale_n: 4.0,
            slides: true,
        };
        assert_eq!(rate.cycle_depth_m(1.0), 2.0);
        assert_eq!(rate.cycle_depth_m(0.0), 1.5);
        let pressed = WearRate {
            at_rest_n: 4.0,
            ..rate
        };
        assert_eq!(pressed.cycle_depth_m(0.0), 0.0);
        assert_eq!(WearRate::default().cycle_depth_m(3.0), 0.0);
    }
}
