//! Tractions other than that of the load path from which a vibration may start.
//!
//! Pairs that stick keep the traction that assembly and loading left in them, and the steady load
//! does not say which. Every traction below the limit of friction whose forces balance is possible.

use std::f64::consts::TAU;
use std::fmt;

use super::StaticState;
use super::static_state::{LoadPath, static_state, static_state_after};
use crate::problem::Problem;
use dovetail_numerics::nonlinear::NewtonOptions;
use serde::{Deserialize, Serialize};

/// Traction from which a vibration starts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum StartingTraction {
    /// The load came first, without friction, and left no traction.
    NormalFirst,
    /// The load rose to so many times itself, all its parts alike, and fell back.
    Overload(f64),
    /// All pairs that touch bore a traction of the size of their limit of friction, each in a direction
    /// of its own, and settled from there. Directions of another number are others.
    Scattered(usize),
}

/// Word for it in tables.
impl fmt::Display for StartingTraction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NormalFirst => write!(f, "normal_first"),
            Self::Overload(overload) => write!(f, "overload_{overload}"),
            Self::Scattered(number) => write!(f, "scattered_{number}"),
        }
    }
}

/// Multiple of the load of [`StartingTraction::Overload`].
const OVERLOAD: f64 = 2.0;

impl StartingTraction {
    /// The first so many starting tractions.
    fn first(count: usize) -> impl Iterator<Item = Self> {
        let named = [Self::NormalFirst, Self::Overload(OVERLOAD)];
        let scattered = (1..).map(Self::Scattered);
        named.into_iter().chain(scattered).take(count)
    }
}

/// Static states under the static load with other tractions than the load path leaves. The load is
/// applied in so many steps, and falls in as many. A state that is not found has the outcome that
/// says why.
pub fn starting_tractions(
    problem: &Problem,
    steps: usize,
    count: usize,
    options: NewtonOptions,
) -> Vec<(StartingTraction, StaticState)> {
    if count == 0 {
        return Vec::new();
    }
    let mut smooth = problem.clone();
    for law in &mut smooth.laws {
        law.friction = 0.0;
    }
    let mut settled = |tractions_n: &[[f64; 2]]| {
        settle_tractions(problem, &mut smooth, tractions_n, steps, options)
    };
    let none = vec![[0.0; 2]; problem.laws.len()];
    let normal_first = settled(&none);
    let limits_n: Vec<f64> = (problem.laws.iter().enumerate())
        .map(|(pair, law)| law.computed_friction() * normal_first.lambda[3 * pair].abs())
        .collect();
    let mut state = |start: StartingTraction| match start {
        StartingTraction::NormalFirst => normal_first.clone(),
        StartingTraction::Overload(overload) => {
            let working = problem.reduced.working_multiples().into_iter();
            let points = vec![working.map(|multiple| overload * multiple).collect()];
            static_state(problem, LoadPath { steps, points }, options)
        }
        StartingTraction::Scattered(number) => {
            let at_limit = limits_n.iter().enumerate().map(|(pair, limit_n)| {
                let (sine, cosine) = (TAU * direction(pair, number)).sin_cos();
                [limit_n * cosine, limit_n * sine]
            });
            settled(&at_limit.collect::<Vec<_>>())
        }
    };
    let starts = StartingTraction::first(count);
    starts.map(|start| (start, state(start))).collect()
}

/// State that pairs come to from where flanks without friction would be under the static load and
/// these tractions, N, of each pair: with friction they stay there, and bear the tractions themselves,
/// as far as their limits go. `smooth` is the problem without friction, and is the same afterwards.
fn settle_tractions(
    problem: &Problem,
    smooth: &mut Problem,
    tractions_n: &[[f64; 2]],
    steps: usize,
    options: NewtonOptions,
) -> StaticState {
    let static_load = smooth.reduced.static_load.on_x.clone();
    let loads = smooth.reduced_mut().static_load.on_x.chunks_exact_mut(3);
    for (load, traction) in loads.zip(tractions_n) {
        load[1] -= traction[0];
        load[2] -= traction[1];
    }
    // Without friction the state does not depend on the way of the load.
    let mut state = static_state(smooth, steps, options);
    smooth.reduced_mut().static_load.on_x = static_load;
    if !state.outcome.is_converged() {
        return state;
    }
    for (force, traction) in state.lambda.chunks_exact_mut(3).zip(tractions_n) {
        force[1..].copy_from_slice(traction);
    }
    static_state_after(problem, (&state).into(), options)
}

/// Share of a turn: a sequence without a pattern that is the same in each run (the fractional parts
/// of the multiples of an irrational number).
fn direction(pair: usize, number: usize) -> f64 {
    let irrational = (number as f64 + 0.25).sqrt() * 1.618_033_988_749_895;
    ((pair + 1) as f64 * irrational).fract()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::dovetail72::dovetail72;

    fn options() -> NewtonOptions {
        NewtonOptions::new(1e-10, 100)
    }

    /// Whatever the traction that is left, the normal forces bear the same load and no pair exceeds
    /// its limit. Without friction first there is no traction at all, and scattered tractions are far
    /// from that of the load path.
    #[test]
    fn every_starting_traction_balances_the_load_within_the_limits_of_friction() {
        let problem = dovetail72(1.0);
        let own = static_state(&problem, 10, options());
        let size = |lambda: &[f64]| -> f64 {
            let tractions = lambda.chunks_exact(3).map(|l| l[1].hypot(l[2]));
            tractions.sum()
        };
        let states = starting_tractions(&problem, 10, 4, options());
        assert_eq!(states[3].0, StartingTraction::Scattered(2));
        for (start, state) in &states {
            assert!(
                state.outcome.is_converged(),
                "{start:?}: {:?}",
                state.outcome
            );
            // K x + lambda = F, whatever the traction.
            let k = &problem.reduced.stiffness;
            let load = &problem.reduced.static_load.on_x;
            let largest = load.iter().fold(0.0_f64, |m, f| m.max(f.abs()));
            for (i, f) in load.iter().enumerate() {
                let carried = state.x.iter().enumerate();
                let carried: f64 = carried.map(|(j, x)| k[(i, j)] * x).sum();
                let rest = (carried + state.lambda[i] - f) / largest;
                assert!(rest.abs() < 1e-8, "{start:?}, {i}: {rest:e}");
            }
            for (lambda, law) in state.lambda.chunks_exact(3).zip(&problem.laws) {
                let limit = law.friction * lambda[0].abs();
                let traction = lambda[1].hypot(lambda[2]);
                assert!(traction <= limit * (1.0 + 1e-9) + 1e-9, "{start:?}");
            }
            let (found, of_path) = (size(&state.lambda), size(&own.lambda));
            match start {
                StartingTraction::NormalFirst => assert!(found < 1e-6 * of_path, "{found:e}"),
                StartingTraction::Overload(_) => {
                    assert!((found / of_path - 1.0).abs() > 0.1, "{found} {of_path}");
                }
                StartingTraction::Scattered(_) => {
                    let apart: Vec<f64> = (state.lambda.iter().zip(&own.lambda))
                        .map(|(a, b)| a - b)
                        .collect();
                    assert!(size(&apart) > 0.2 * of_path, "{} {of_path}", size(&apart));
                }
            }
        }
        let [.., (_, a), (_, b)] = &states[..] else {
            panic!("four states");
        };
        let apart: Vec<f64> = a.lambda.iter().zip(&b.lambda).map(|(a, b)| a - b).collect();
        assert!(size(&apart) > 0.2 * size(&own.lambda));
    }
}
