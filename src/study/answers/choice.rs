//! What is worth its price: the Pareto front of error against time, and the cheapest way to an accuracy.

use serde::Serialize;

/// Times nearer to each other than this share are taken for equal: a run timed twice differs by as much.
const SAME_TIME: f64 = 0.1;

/// Which of the points (cost, error) no other beats: none costs no more and errs no more, and less in one of the two.
/// A point without error is on no front.
pub fn pareto_front(points: &[(f64, Option<f64>)]) -> Vec<bool> {
    let beats = |(c, e): (f64, f64), (cost, error): (f64, f64)| {
        c <= cost && e <= error && (c < cost || e < error)
    };
    points
        .iter()
        .map(|&(cost, error)| {
            let Some(error) = error else {
                return false;
            };
            let others = points.iter().filter_map(|&(c, e)| Some((c, e?)));
            !others.into_iter().any(|other| beats(other, (cost, error)))
        })
        .collect()
}

/// What one value of a knob costs and errs while the others stand at their base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Price {
    /// Seconds up to the reduced model, and of the contact solve.
    pub seconds: [f64; 2],
    /// `None`: it may not be chosen.
    pub error: Option<f64>,
}

/// A choice of one value per knob that was put together, not run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Combination {
    pub values: Vec<usize>,
    /// Sum of the errors of the values.
    pub error: f64,
    /// Predicted: seconds of the base times the ratios of the values to it, apart for the reduced model and for contact.
    pub seconds: f64,
}

/// The cheapest combination whose errors sum up to no more than `accuracy`; of those as cheap the one that errs
/// least. `prices[k][v]` is value v of knob k, `base[k]` the value of the base; a knob of one value adds no error it could know.
pub fn cheapest(prices: &[Vec<Price>], base: &[usize], accuracy: f64) -> Option<Combination> {
    let base_seconds = prices.first()?.get(*base.first()?)?.seconds;
    let mut options = Vec::new();
    for (of_knob, base) in prices.iter().zip(base) {
        let own = of_knob.get(*base)?.seconds;
        let ratio = |s: f64, own: f64| {
            let ratio = if own > 0.0 { s / own } else { 1.0 };
            if (ratio - 1.0).abs() <= SAME_TIME {
                1.0
            } else {
                ratio
            }
        };
        let single = of_knob.len() == 1;
        let mut of_knob: Vec<Choice> = of_knob
            .iter()
            .enumerate()
            .filter_map(|(value, price)| {
                Some(Choice {
                    value,
                    ratios: [0, 1].map(|i| ratio(price.seconds[i], own[i])),
                    error: if single { 0.0 } else { price.error? },
                })
            })
            .collect();
        // Cheap ones first, so that a good answer is found early.
        of_knob.sort_by(|a, b| a.sort_key().total_cmp(&b.sort_key()));
        options.push(of_knob);
    }
    let mut search = Search {
        options: &options,
        base_seconds,
        accuracy,
        best: None,
        steps: 0,
    };
    search.go(0, &mut Vec::new(), [1.0, 1.0], 0.0);
    search.best
}

#[derive(Debug, Clone, Copy)]
struct Choice {
    value: usize,
    ratios: [f64; 2],
    error: f64,
}

impl Choice {
    fn sort_key(&self) -> f64 {
        self.ratios[0] * self.ratios[1]
    }
}

struct Search<'o> {
    options: &'o [Vec<Choice>],
    base_seconds: [f64; 2],
    accuracy: f64,
    best: Option<Combination>,
    steps: usize,
}

/// Of the search, after which the best so far is given: far beyond what studies that can be run need.
const MOST_STEPS: usize = 5_000_000;

impl Search<'_> {
    fn seconds(&self, ratios: [f64; 2]) -> f64 {
        self.base_seconds[0] * ratios[0] + self.base_seconds[1] * ratios[1]
    }

    fn go(&mut self, knob: usize, chosen: &mut Vec<usize>, ratios: [f64; 2], error: f64) {
        self.steps += 1;
        if error > self.accuracy || self.steps > MOST_STEPS {
            return;
        }
        // The least that the knobs to come can make of it.
        let least = self.options[knob..].iter().fold(ratios, |r, options| {
            [0, 1].map(|i| {
                let smallest = options
                    .iter()
                    .map(|o| o.ratios[i])
                    .fold(f64::INFINITY, f64::min);
                r[i] * smallest
            })
        });
        if let Some(best) = &self.best
            && self.seconds(least) > best.seconds * (1.0 + 1e-12)
        {
            return;
        }
        let Some(options) = self.options.get(knob) else {
            let seconds = self.seconds(ratios);
            let better = self
                .best
                .as_ref()
                .is_none_or(|best| seconds < best.seconds * (1.0 - 1e-12) || error < best.error);
            if better {
                self.best = Some(Combination {
                    values: chosen.clone(),
                    error,
                    seconds,
                });
            }
            return;
        };
        for choice in options {
            chosen.push(choice.value);
            let next = [0, 1].map(|i| ratios[i] * choice.ratios[i]);
            self.go(knob + 1, chosen, next, error + choice.error);
            chosen.pop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_is_what_nothing_beats() {
        let points = [
            (1.0, Some(0.5)),
            (2.0, Some(0.1)),
            (2.5, Some(0.2)),
            (3.0, Some(0.1)),
            (9.0, Some(0.01)),
            (0.1, None),
        ];
        assert_eq!(
            pareto_front(&points),
            [true, true, false, false, true, false]
        );
        // The same twice: neither beats the other.
        assert_eq!(pareto_front(&[(1.0, Some(0.1)); 2]), [true, true]);
    }

    fn price(setup: f64, contact: f64, error: f64) -> Price {
        Price {
            seconds: [setup, contact],
            error: Some(error),
        }
    }

    #[test]
    fn the_cheapest_combination_keeps_the_sum_of_errors() {
        // A mesh that costs setup and contact, harmonics that cost contact alone.
        let mesh = vec![
            price(1.0, 1.0, 0.02),
            price(3.0, 5.0, 0.004),
            price(9.0, 30.0, 0.001),
        ];
        let harmonics = vec![
            price(1.0, 0.5, 0.01),
            price(1.0, 1.0, 0.002),
            price(1.0, 2.0, 0.0005),
        ];
        let prices = [mesh, harmonics];
        let found = |accuracy| cheapest(&prices, &[0, 1], accuracy);
        let coarse = found(0.05).unwrap();
        assert_eq!(coarse.values, [0, 0]);
        assert!((coarse.seconds - 1.5).abs() < 1e-12 && (coarse.error - 0.03).abs() < 1e-12);
        let fine = found(0.01).unwrap();
        assert_eq!(fine.values, [1, 1]);
        assert!((fine.seconds - 8.0).abs() < 1e-12);
        assert_eq!(found(0.002).unwrap().values, [2, 2]);
        assert_eq!(found(0.001), None);
    }

    #[test]
    fn of_values_as_cheap_the_more_accurate_is_taken() {
        let prices = [vec![price(1.0, 1.0, 0.004), price(1.05, 0.97, 0.001)]];
        assert_eq!(cheapest(&prices, &[0], 0.01).unwrap().values, [1]);
    }

    #[test]
    fn a_value_without_error_is_not_chosen_and_a_single_value_always() {
        let mut unknown = price(0.1, 0.1, 0.0);
        unknown.error = None;
        let prices = [vec![unknown, price(1.0, 1.0, 0.001)], vec![unknown]];
        assert_eq!(cheapest(&prices, &[1, 0], 0.01).unwrap().values, [1, 0]);
    }
}
