//! Estimated errors of the figures of a motion other than its amplitudes: powers, slip and contact
//! forces.
//!
//! They are what a finer solution changes, times the share of the error that such a change falls
//! short of ([`crate::dlft::accuracy`]). All have the unit of their figure: a figure may be zero.

use super::{Landing, Orbit, PairCycle};
use crate::contact::PairLaw;
use serde::{Deserialize, Serialize};

/// Share of all power below which friction power is not resolved further.
const LITTLE_FRICTION: f64 = 1e-2;
/// Errors of powers and of contact forces may be this many times the accuracy of the amplitudes.
const FIGURES_PER_AMPLITUDE: f64 = 3.0;

/// Estimated errors of the powers of a motion, and of the figures of its pairs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FigureErrors {
    /// Friction power of all pairs, W.
    pub friction_power_w: f64,
    /// Power of the damping, W.
    pub viscous_power_w: f64,
    /// Figures of each pair.
    pub pairs: Vec<PairErrors>,
}

/// Estimated errors of the figures of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairErrors {
    /// Distance slid in a period, m.
    pub slid_m: f64,
    /// Friction power, W.
    pub friction_power_w: f64,
    /// Smallest compression, N.
    pub compression_min_n: f64,
    /// Largest compression, N. `None` for a rigid pair that lands: its force has no finite maximum.
    pub compression_max_n: Option<f64>,
    /// Errors of the figures of a landing, of a pair that has one.
    pub landing: Option<Landing>,
}

impl FigureErrors {
    /// Errors of the figures of `motion`, `factor` times their distance from those of `finer`.
    pub(crate) fn from_distance(motion: &Orbit, finer: &Orbit, factor: f64) -> Self {
        let off = |a: f64, b: f64| factor * (a - b).abs();
        let pairs = motion.cycles.iter().zip(&finer.cycles);
        Self {
            friction_power_w: off(motion.friction_power_w, finer.friction_power_w),
            viscous_power_w: off(motion.viscous_power_w, finer.viscous_power_w),
            pairs: pairs
                .map(|(own, finer)| PairErrors::from_distance(own, finer, factor))
                .collect(),
        }
    }

    /// Errors of the figures of the pairs of `motion` by their distance from those of `cycles`.
    pub(crate) fn from_cycles(motion: &Orbit, cycles: &[PairCycle]) -> Self {
        let friction_power_w: f64 = cycles.iter().map(|cycle| cycle.friction_power_w).sum();
        let pairs = motion.cycles.iter().zip(cycles);
        Self {
            friction_power_w: (motion.friction_power_w - friction_power_w).abs(),
            viscous_power_w: 0.0,
            pairs: pairs
                .map(|(own, other)| PairErrors::from_distance(own, other, 1.0))
                .collect(),
        }
    }

    /// These errors and others, combined figure by figure.
    pub(crate) fn combined(&self, others: &Self, by: impl Fn(f64, f64) -> f64) -> Self {
        let both = |a: Option<f64>, b: Option<f64>| Some(by(a?, b?));
        let pairs = self.pairs.iter().zip(&others.pairs);
        let combined = |(a, b): (&PairErrors, &PairErrors)| PairErrors {
            slid_m: by(a.slid_m, b.slid_m),
            friction_power_w: by(a.friction_power_w, b.friction_power_w),
            compression_min_n: by(a.compression_min_n, b.compression_min_n),
            compression_max_n: both(a.compression_max_n, b.compression_max_n),
            landing: a.landing.map(|own| {
                let other = b.landing.unwrap_or_default();
                Landing {
                    impulse_ns: by(own.impulse_ns, other.impulse_ns),
                    compression_after_n: by(own.compression_after_n, other.compression_after_n),
                }
            }),
        };
        Self {
            friction_power_w: by(self.friction_power_w, others.friction_power_w),
            viscous_power_w: by(self.viscous_power_w, others.viscous_power_w),
            pairs: pairs.map(combined).collect(),
        }
    }

    /// Error of the friction power relative to it, or to a hundredth of all power where friction
    /// takes less.
    pub(crate) fn relative_friction_power(&self, motion: &Orbit) -> f64 {
        let friction = motion.friction_power_w.abs();
        let all = friction + motion.viscous_power_w.abs();
        relative(self.friction_power_w, friction.max(LITTLE_FRICTION * all))
    }

    /// Largest error of the largest compressions of pairs with springs, relative to the largest of
    /// these. The force of a rigid pair jumps where friction reverses, and has no finite maximum where
    /// the pair lands: its harmonics overshoot however many there are.
    pub(crate) fn relative_contact_force(&self, motion: &Orbit, laws: &[PairLaw]) -> f64 {
        let (mut error, mut largest) = (0.0_f64, 0.0_f64);
        let pairs = self.pairs.iter().zip(&motion.cycles).zip(laws);
        for ((errors, cycle), _) in pairs.filter(|(_, law)| law.stiffness.is_some()) {
            error = error.max(errors.compression_max_n.unwrap_or(0.0));
            largest = largest.max(cycle.compression_max_n);
        }
        relative(error, largest)
    }

    /// Relative error of the amplitudes that asks for as many harmonics as these errors do.
    pub(crate) fn as_amplitude_error(&self, motion: &Orbit, laws: &[PairLaw]) -> f64 {
        let friction = self.relative_friction_power(motion);
        friction.max(self.relative_contact_force(motion, laws)) / FIGURES_PER_AMPLITUDE
    }
}

impl PairErrors {
    fn from_distance(pair: &PairCycle, finer: &PairCycle, factor: f64) -> Self {
        let off = |a: f64, b: f64| factor * (a - b).abs();
        let lands = pair.landing.is_some() || finer.landing.is_some();
        Self {
            slid_m: off(pair.slid_m, finer.slid_m),
            friction_power_w: off(pair.friction_power_w, finer.friction_power_w),
            compression_min_n: off(pair.compression_min_n, finer.compression_min_n),
            compression_max_n: (!lands)
                .then(|| off(pair.compression_max_n, finer.compression_max_n)),
            landing: pair.landing.map(|own| {
                let other = finer.landing.unwrap_or_default();
                Landing {
                    impulse_ns: off(own.impulse_ns, other.impulse_ns),
                    compression_after_n: off(own.compression_after_n, other.compression_after_n),
                }
            }),
        }
    }
}

/// Error relative to a figure: 0 without an error, and 1 at most and where a number is not finite.
pub(crate) fn relative(error: f64, of: f64) -> f64 {
    match error {
        0.0 => 0.0,
        error if error < of => error / of,
        _ => 1.0,
    }
}
