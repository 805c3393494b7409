//! Integration period after period to the steady state, and measurement of a period.

use super::IntegrationError;
use super::step::{MotionState, StepWork, Stepper};
use faer::c64;
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// Largest number of periods.
pub const MOST_PERIODS: usize = 1_000_000;
/// Most steps in all periods: days of computing.
pub const MOST_STEPS_IN_ALL: usize = 2_000_000_000;
/// Number of successive periods whose estimate must be below the tolerance.
const IN_A_ROW: usize = 3;
/// A motion whose amplitude is so many times that of its first period grows without bound. From
/// rest a resonance grows by its quality factor.
const GROWN: f64 = 1e6;
/// Number of changes from period to period that the estimate is made from.
const WINDOW: usize = 8;

/// Observed displacement over one period, m.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ObservedCycle {
    /// Mean over the period, m.
    pub mean_m: f64,
    /// Largest departure from the mean, m.
    pub amplitude_m: f64,
    /// Cosine and sine part of harmonic 1, m.
    pub first_harmonic_m: [f64; 2],
}

/// Measurements over one period of the motion.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Cycle {
    /// Motion of each observed point.
    pub observed: Vec<ObservedCycle>,
    /// Work over the period.
    pub work: StepWork,
    /// Distance that each pair slides in the period, m.
    pub slid_m: Vec<f64>,
    /// Fraction of the period without contact force, for each pair.
    pub open_fraction: Vec<f64>,
}

/// Criterion that ends the integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Until {
    /// Largest number of periods.
    pub most_periods: usize,
    /// Fraction of the amplitude of every observed point below which the estimated rest of its
    /// transient ends the integration. 0: all periods are integrated.
    pub tolerance: f64,
}

impl Until {
    /// Criterion of so many periods at most, and of this rest of the transient.
    pub const fn new(most_periods: usize, tolerance: f64) -> Self {
        Self {
            most_periods,
            tolerance,
        }
    }
}

/// Result of an integration.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SteadyMotion {
    /// Measurements over the last period.
    pub cycle: Cycle,
    /// Number of periods that were integrated.
    pub periods: usize,
    /// Estimated rest of the transient, relative to the amplitude; infinite where there is no
    /// estimate (less than three periods, or a transient that grows).
    pub transient_left: f64,
    /// True if `transient_left` was below the tolerance three times in a row.
    pub steady: bool,
}

/// Integrates from `state` until steady; `state` is left at the end of the last period.
///
/// The rest of a transient that decays geometrically, z_k = z + A r^k, follows from the changes of
/// harmonic 1 (complex) from period to period: r with the least squares of dz_k - r dz_(k-1) over
/// the last periods, rest = |dz_k r / (1 - r)|.
///
/// # Errors
/// Contact forces not found, a motion that grows without bound.
pub fn integrate(
    stepper: &mut Stepper<'_>,
    state: &mut MotionState,
    until: Until,
) -> Result<SteadyMotion, IntegrationError> {
    stepper.prepare(state);
    let mut history = History::default();
    let mut in_a_row = 0;
    let mut period = 0;
    let mut bound_m = f64::INFINITY;
    loop {
        period += 1;
        let cycle = one_period(stepper, state, period)?;
        let amplitudes = cycle.observed.iter().map(|o| o.amplitude_m);
        let amplitude_m = amplitudes.fold(0.0, f64::max);
        if period == 1 && amplitude_m > 0.0 {
            bound_m = GROWN * amplitude_m;
        }
        if !state.is_finite() || amplitude_m > bound_m {
            return Err(IntegrationError::NotFinite {
                frequency_hz: stepper.frequency_hz(),
                period,
            });
        }
        history.push(cycle.observed.iter().map(|o| o.first_harmonic_m).collect());
        let transient_left = history.transient_left();
        in_a_row = if transient_left < until.tolerance {
            in_a_row + 1
        } else {
            0
        };
        let steady = in_a_row >= IN_A_ROW;
        if steady || period >= until.most_periods {
            return Ok(SteadyMotion {
                cycle,
                periods: period,
                transient_left,
                steady,
            });
        }
    }
}

/// Harmonic 1 of the observed points in the last periods, with [`WINDOW`] changes between them.
#[derive(Default)]
struct History(VecDeque<Vec<[f64; 2]>>);

impl History {
    fn push(&mut self, period: Vec<[f64; 2]>) {
        if self.0.len() > WINDOW {
            self.0.pop_front();
        }
        self.0.push_back(period);
    }

    /// Estimated rest of the transient at the worst observed point.
    fn transient_left(&self) -> f64 {
        let Some(last) = self.0.back() else {
            return f64::INFINITY;
        };
        let left = (0..last.len()).map(|point| {
            let recent = self.0.iter().map(|z| z[point]);
            transient_rest(&recent.map(|[c, s]| c64::new(c, s)).collect::<Vec<_>>())
        });
        left.fold(0.0, f64::max)
    }
}

/// Rest at the end of a series that tends to a limit, relative to its last entry. In a steady
/// motion it is rounding, whose changes do not grow either.
fn transient_rest(z: &[c64]) -> f64 {
    let changes: Vec<c64> = z.windows(2).map(|z| z[1] - z[0]).collect();
    let ([.., size], [.., moved]) = (z, &changes[..]) else {
        return f64::INFINITY;
    };
    if changes.len() < 2 {
        return f64::INFINITY;
    }
    let before: f64 = changes[..changes.len() - 1].iter().map(c64::norm_sqr).sum();
    if before == 0.0 {
        return if moved.norm() == 0.0 {
            0.0
        } else {
            f64::INFINITY
        };
    }
    let along: c64 = changes.windows(2).map(|d| d[0].conj() * d[1]).sum();
    let r = along / before;
    if r.norm() >= 1.0 {
        return f64::INFINITY;
    }
    (moved * r / (1.0 - r)).norm() / size.norm()
}

pub(super) fn one_period(
    stepper: &mut Stepper<'_>,
    state: &mut MotionState,
    period: usize,
) -> Result<Cycle, IntegrationError> {
    let (problem, steps) = (stepper.problem(), stepper.steps());
    let frequency_hz = stepper.frequency_hz();
    let pairs = problem.laws.len();
    let mut signals = vec![Vec::with_capacity(steps); problem.reduced.observations.len()];
    let mut work = StepWork::default();
    let mut slid_m = vec![0.0; pairs];
    let mut open = vec![0_usize; pairs];
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    for step in 0..steps {
        for (signal, point) in signals.iter_mut().zip(&problem.reduced.observations) {
            signal.push(dot(&point.on_x, &state.x) + dot(&point.on_modes, &state.q));
        }
        let before = state.x.clone();
        let done = stepper.advance(state, step).map_err(|residual| {
            IntegrationError::ContactNotSolved {
                frequency_hz,
                period,
                step,
                residual,
            }
        })?;
        work.input_j += done.input_j;
        work.friction_j += done.friction_j;
        work.impact_j += done.impact_j;
        work.viscous_j += done.viscous_j;
        for pair in 0..pairs {
            if state.lambda[3 * pair] == 0.0 {
                open[pair] += 1;
            } else {
                let moved = |c: usize| state.x[3 * pair + c] - before[3 * pair + c];
                slid_m[pair] += moved(1).hypot(moved(2));
            }
        }
    }
    Ok(Cycle {
        observed: signals.iter().map(|s| observe(s)).collect(),
        work,
        slid_m,
        open_fraction: open.iter().map(|o| *o as f64 / steps as f64).collect(),
    })
}

fn observe(signal: &[f64]) -> ObservedCycle {
    let steps = signal.len();
    let mean_m = signal.iter().sum::<f64>() / steps as f64;
    let mut first = [0.0; 2];
    for (i, u) in signal.iter().enumerate() {
        let (s, c) = (TAU * i as f64 / steps as f64).sin_cos();
        first[0] += 2.0 / steps as f64 * c * u;
        first[1] += 2.0 / steps as f64 * s * u;
    }
    let departure = |i: usize| signal[i % steps] - mean_m;
    let at = (0..steps)
        .max_by(|i, j| departure(*i).abs().total_cmp(&departure(*j).abs()))
        .unwrap_or(0);
    // Extremum of the parabola through the largest sample and its neighbours.
    let (l, m, r) = (departure(at + steps - 1), departure(at), departure(at + 1));
    let curvature = l - 2.0 * m + r;
    let lift = if curvature == 0.0 {
        0.0
    } else {
        (r - l) * (r - l) / (8.0 * curvature)
    };
    ObservedCycle {
        mean_m,
        amplitude_m: (m - lift).abs(),
        first_harmonic_m: first,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Estimated rest after each of the first `periods` of a series, from the third on.
    fn transient_rests(periods: i32, z: impl Fn(i32) -> [f64; 2]) -> Vec<f64> {
        let mut history = History::default();
        let left = (0..periods).map(|k| {
            history.push(vec![z(k)]);
            history.transient_left()
        });
        let mut left: Vec<f64> = left.collect();
        assert_eq!(left.drain(..2).collect::<Vec<_>>(), [f64::INFINITY; 2]);
        left
    }

    #[test]
    fn a_period_of_samples_is_measured() {
        let signal: Vec<f64> = (0..100)
            .map(|i| {
                let t = TAU * (f64::from(i) + 0.3) / 100.0;
                5.0 + 2.0 * t.cos() + 0.1 * (3.0 * t).cos()
            })
            .collect();
        let cycle = observe(&signal);
        assert!((cycle.mean_m - 5.0).abs() < 1e-12);
        assert!((cycle.amplitude_m - 2.1).abs() < 1e-5, "{cycle:?}");
        let [c, s] = cycle.first_harmonic_m;
        assert!((c.hypot(s) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_left_of_a_decaying_transient_is_estimated() {
        // z_k = z + A (r e^(i phi))^k
        let (r, phi): (f64, f64) = (0.98, 0.05);
        let z = |k: i32| {
            let (size, angle) = (0.1 * r.powi(k), phi * f64::from(k));
            [1.0 + size * angle.cos(), 0.5 + size * angle.sin()]
        };
        for (left, k) in transient_rests(50, z).iter().zip(2..) {
            let true_left = (z(k)[0] - 1.0).hypot(z(k)[1] - 0.5) / z(k)[0].hypot(z(k)[1]);
            assert!((left / true_left - 1.0).abs() < 1e-9, "{k}");
        }
    }

    #[test]
    fn rounding_is_not_a_transient_and_growth_is() {
        // Changes of 1e-13 of no direction, as a steady motion has them.
        let noise = |k: i32| 1e-13 * (f64::from(k * k) * 1.7).sin();
        let steady = transient_rests(40, |k| [1.0 + noise(k), 0.5 + noise(k + 7)]);
        // Two or three changes may grow by chance.
        for (left, changes) in steady.iter().zip(2..).skip(6) {
            assert!(*left < 1e-11, "{changes}: {left:e}");
        }
        let growing = transient_rests(40, |k| [1.0 + 1e-9 * 1.2_f64.powi(k), 0.5]);
        assert!(growing.iter().all(|left| *left == f64::INFINITY));
        // No motion at all is steady.
        assert_eq!(transient_rests(5, |_| [0.0; 2]), [0.0; 3]);
    }
}
