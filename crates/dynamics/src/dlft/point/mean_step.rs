//! Newton steps of the mean beneath a vibration with frozen contacts ([`super::frozen`]), in which the
//! pairs shake down.
//!
//! A pair slides from where it is at rest as far as it has to. Where Newton's equations would have it
//! slide back, it stays where it is at rest, and the others bear the rest. Which pairs these are
//! follows from the equations, as in a linear complementarity problem.
//!
//! Bodies may be free to move while all their pairs slide: a wedge between two platforms turns. Newton's
//! equations then have a solution only where some of these pairs stay at rest. A weak spring on all
//! pairs finds them: its force vanishes as the steps under it are added up, and the bodies turn until a
//! pair is back where it was at rest.

use crate::dlft::PairStatus;
use crate::dlft::balance::{Balance, Evaluation};
use dovetail_numerics::dense::Lu;
use dovetail_numerics::vector::norm;
use faer::Mat;

/// Stiffness of the weak spring on a pair, as a fraction of eps.
const WEAK_SPRING: f64 = 1e-6;
/// Most steps under the weak spring, and the fraction of the forces at which they end.
const MOST_SPRING_STEPS: usize = 100;
const SPRING_FORCE: f64 = 1e-5;
/// Most times that a pair turns between sliding and rest on the way to a step.
const MOST_TURNS: usize = 3;

/// Newton step of the mean of U, n entries, in which no pair slides back; `None` where the equations are
/// singular.
pub(super) fn mean_step(balance: &Balance, evaluation: &Evaluation) -> Option<Vec<f64>> {
    let mut equations = MeanEquations::new(balance, evaluation);
    let touching = equations.pairs.clone();
    let mut turns = vec![0; touching.len()];
    loop {
        let (step, falls) = equations.step()?;
        let at_rest: Vec<bool> = turns.iter().map(|count| count % 2 == 1).collect();
        let turns_now = |p: &usize| {
            let slides_back = touching[*p].slid_along(&falls[3 * p..3 * p + 3]) < 0.0;
            touching[*p].slides() && slides_back != at_rest[*p] && turns[*p] < MOST_TURNS
        };
        let (forward, back): (Vec<usize>, Vec<usize>) = (0..touching.len())
            .filter(turns_now)
            .partition(|p| at_rest[*p]);
        // Those that slide back come first.
        let turning = if back.is_empty() { forward } else { back };
        if turning.is_empty() {
            return Some(step);
        }
        for p in turning {
            equations.pairs[p] = match at_rest[p] {
                true => touching[p],
                false => touching[p].at_rest(),
            };
            turns[p] += 1;
        }
    }
}

/// What a pair does to its mean contact force.
#[derive(Clone, Copy)]
struct MeanOfPair {
    /// Derivative of the mean force by its prediction.
    derivative: [[f64; 3]; 3],
    /// The same where the pair does not slide, on the diagonal.
    stuck: [f64; 3],
    /// Way that it slides from where it is at rest, as a force, N.
    slid_n: [f64; 2],
    /// Residual of its mean, N.
    residual_n: [f64; 3],
}

impl MeanOfPair {
    fn slides(&self) -> bool {
        self.slid_n != [0.0; 2]
    }

    /// The pair where it does not slide from where it is at rest.
    fn at_rest(self) -> Self {
        let [normal, t1, t2] = self.stuck;
        let [on_normal, on_t1, on_t2] = self.residual_n;
        let [slid_1, slid_2] = self.slid_n;
        Self {
            derivative: [[normal, 0.0, 0.0], [0.0, t1, 0.0], [0.0, 0.0, t2]],
            slid_n: [0.0; 2],
            residual_n: [on_normal, on_t1 + slid_1, on_t2 + slid_2],
            ..self
        }
    }

    /// Way that the pair slides from where it is at rest where its prediction falls by `falls`, N,
    /// times the way that it slides now, N2. It is negative where the pair would slide back.
    fn slid_along(&self, falls: &[f64]) -> f64 {
        let along = [0, 1].map(|c| {
            let row = self.derivative[c + 1].iter().zip(falls);
            let force = row.map(|(d, falls)| d * falls).sum::<f64>();
            let slid = self.slid_n[c] - self.stuck[c + 1] * falls[c + 1] + force;
            slid * self.slid_n[c]
        });
        along[0] + along[1]
    }
}

/// Newton's equations of the mean of U at an evaluation.
struct MeanEquations {
    pairs: Vec<MeanOfPair>,
    /// K, N/m, with the spring that retains the mean.
    stiffness: Mat<f64>,
    /// eps of each unknown, N/m.
    eps: Vec<f64>,
}

impl MeanEquations {
    fn new(balance: &Balance, evaluation: &Evaluation) -> Self {
        let mut stiffness = balance.setting.system.problem.reduced.stiffness.clone();
        if let Some(retention) = balance.retention() {
            retention.add_to_matrix(&mut stiffness);
        }
        let n = balance.unknowns_per_block();
        Self {
            pairs: means_of_pairs(balance, evaluation),
            stiffness,
            eps: (0..n).map(|i| balance.eps_at(i)).collect(),
        }
    }

    /// Step that leaves nothing of the residual, and the fall of the prediction with it, N. It ends
    /// earlier where a pair slides back.
    fn step(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        let factor = Lu::new(self.jacobian());
        let mut step = vec![0.0; self.eps.len()];
        let mut falls = step.clone();
        let all = self.left(&step, &falls);
        let mut left = all.clone();
        for _ in 0..MOST_SPRING_STEPS {
            factor.solve_column_in_place(&mut left);
            step.iter_mut().zip(&left).for_each(|(s, d)| *s += d);
            falls = self.fall(&step);
            left = self.left(&step, &falls);
            if !left.iter().all(|f| f.is_finite()) {
                return None;
            }
            let mut pairs = self.pairs.iter().zip(falls.chunks_exact(3));
            if norm(&left) <= SPRING_FORCE * norm(&all)
                || pairs.any(|(pair, falls)| pair.slid_along(falls) < 0.0)
            {
                break;
            }
        }
        Some((step, falls))
    }

    /// (I - D) (K - eps) + eps with the weak spring in K.
    fn jacobian(&self) -> Mat<f64> {
        let falls = |i: usize, j: usize| match i == j {
            true => self.stiffness[(i, j)] + (WEAK_SPRING - 1.0) * self.eps[i],
            false => self.stiffness[(i, j)],
        };
        let n = self.eps.len();
        Mat::from_fn(n, n, |i, j| {
            let (first, row) = (i / 3 * 3, self.pairs[i / 3].derivative[i % 3]);
            let carried: f64 = (0..3).map(|c| row[c] * falls(first + c, j)).sum();
            let own = if i == j { self.eps[i] } else { 0.0 };
            falls(i, j) - carried + own
        })
    }

    /// (K - eps) times a step, by which the prediction falls, N.
    fn fall(&self, step: &[f64]) -> Vec<f64> {
        let own = step.iter().zip(&self.eps);
        let mut falls: Vec<f64> = own.map(|(d, eps)| -eps * d).collect();
        for (d, column) in step.iter().zip(self.stiffness.col_iter()) {
            let entries = falls.iter_mut().zip(column.iter());
            entries.for_each(|(f, k)| *f += k * d);
        }
        falls
    }

    /// What a step with this fall of the prediction leaves of the residual, with the opposite sign, N.
    fn left(&self, step: &[f64], falls: &[f64]) -> Vec<f64> {
        let left = |i: usize| {
            let pair = &self.pairs[i / 3];
            let row = pair.derivative[i % 3];
            let carried: f64 = (0..3).map(|c| row[c] * falls[i / 3 * 3 + c]).sum();
            -pair.residual_n[i % 3] - (falls[i] - carried + self.eps[i] * step[i])
        };
        (0..step.len()).map(left).collect()
    }
}

/// What each pair does to its mean contact force at the U of an evaluation.
fn means_of_pairs(balance: &Balance, evaluation: &Evaluation) -> Vec<MeanOfPair> {
    let width = balance.setting.fourier.width();
    let jacobian = balance.linearise(evaluation);
    let mut moving = jacobian.active.iter().zip(&jacobian.derivatives).peekable();
    let mean_of = |(pair, end)| {
        let stuck = match balance.setting.at_rest[pair] {
            PairStatus::Open => [0.0; 3],
            PairStatus::Stuck | PairStatus::Slipping => balance.law(pair).shares,
        };
        let at_rest = MeanOfPair {
            derivative: [[0.0; 3]; 3],
            stuck,
            slid_n: [0.0; 2],
            residual_n: [0, 1, 2].map(|c| evaluation.residual[3 * pair + c]),
        }
        .at_rest();
        let derivative = moving.next_if(|(active, _)| **active == pair);
        MeanOfPair {
            derivative: derivative.map_or(at_rest.derivative, |(_, derivative)| {
                let row = |c: usize| &derivative[3 * width * width * c..];
                [0, 1, 2].map(|c| [0, 1, 2].map(|by| row(c)[width * by]))
            }),
            slid_n: balance.slid_from_rest_n(pair, end),
            ..at_rest
        }
    };
    evaluation.ends.iter().enumerate().map(mean_of).collect()
}
