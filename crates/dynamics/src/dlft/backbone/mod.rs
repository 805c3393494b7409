//! Backbone of a mode: its frequency and damping over its amplitude, by the extended periodic motion
//! concept (`crate::problem::unforced`).
//!
//! No force excites the vibration. The damping ratio zeta, an unknown as the frequency is, keeps it
//! up. `equations` has the two equations of the tracked mode beside the balance, which `follow`
//! solves from one amplitude to the next.

mod equations;
mod follow;

use super::sweep::{SweepSettings, SweepSolvers};
use super::{Orbit, StaticState};
use crate::damping::Rayleigh;
use crate::problem::Problem;

/// Backbone that is asked for.
#[derive(Debug, Clone)]
pub struct BackboneRange {
    /// Number of the mode of the linear reference that the backbone begins at, from 0. In a wave round a
    /// disc each mode counts once.
    pub mode: usize,
    /// Number of the observed displacement whose amplitudes are asked for.
    pub observation: usize,
    /// Amplitudes of the observed displacement, m, ascending.
    pub amplitudes_m: Vec<f64>,
}

/// Motion of a backbone.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct BackbonePoint {
    /// Motion, with its frequency. No power is put in.
    pub orbit: Orbit,
    /// Damping ratio of the whole damping.
    pub damping_ratio: f64,
    /// Damping ratio that the power of friction makes alone. The rest is that of the other damping.
    pub friction_ratio: f64,
    /// Amplitude q at harmonic 1 of the tracked stuck mode, of unit modal mass, m sqrt(kg), or where no
    /// stuck mode takes part, of the relative displacement that moves most in the linear mode, m.
    pub tracked_amplitude: f64,
    /// Modal amplitude of harmonic 1, m sqrt(kg): `a^2 = Y^H M Y` over pairs and stuck modes, of one
    /// sector of a disc.
    pub modal_amplitude: f64,
    /// Multiple of the excitation at whose resonance the motion is; `None` where the excitation does
    /// no work on it, or has another harmonic than 1, or where the air drives the motion.
    pub excitation_scale: Option<f64>,
    /// Estimated relative error of the damping ratio from harmonics and samples, 0 to 1; `None`
    /// where it was not estimated.
    pub estimated_error: Option<f64>,
    /// Estimated error of `friction_ratio`, in its own unit; `None` where it was not estimated.
    pub friction_ratio_error: Option<f64>,
}

impl BackbonePoint {
    /// Frequencies, Hz, below and above its own, at which the excitation gives a motion of this
    /// amplitude, if it has the shape, the frequency w and the damping ratio zeta of the backbone:
    /// `W^2 = w^2 (1 - 2 zeta^2 -+ 2 zeta sqrt(1 / s^2 - 1 + zeta^2))`, where s times the excitation
    /// has its resonance there. `None` where the excitation
    /// has no such motion.
    pub fn response_frequencies_hz(&self) -> [Option<f64>; 2] {
        let (zeta, Some(scale)) = (self.damping_ratio, self.excitation_scale) else {
            return [None; 2];
        };
        let spread = 1.0 / (scale * scale) - 1.0 + zeta * zeta;
        [-1.0, 1.0].map(|side: f64| {
            let squared = 1.0 - 2.0 * zeta * zeta + side * 2.0 * zeta * spread.sqrt();
            (squared > 0.0).then(|| self.orbit.frequency_hz * squared.sqrt())
        })
    }

    /// Relative difference of the powers of friction and damping from the power that keeps the
    /// vibration up, zeta w^3 sum h^2 Y_h^H M Y_h. It vanishes with the residual.
    pub fn power_defect(&self) -> f64 {
        let omega = std::f64::consts::TAU * self.orbit.frequency_hz;
        let kept_up_w = 4.0 * self.damping_ratio * omega * self.orbit.kinetic_energy_j;
        let spent_w = self.orbit.friction_power_w + self.orbit.viscous_power_w;
        (spent_w - kept_up_w) / kept_up_w.abs().max(f64::MIN_POSITIVE)
    }
}

/// Reason why a backbone ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum BackboneEnd {
    /// All amplitudes were reached.
    Reached,
    /// In the next motion pairs that are closed at rest are open in the whole period: more than one
    /// in twenty of them.
    Open,
    /// No motion of a larger amplitude was found.
    Lost,
    /// The listener stopped it.
    Stopped,
}

/// Frequency and damping of a mode over its amplitude.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Backbone {
    /// Motions, by ascending amplitude.
    pub points: Vec<BackbonePoint>,
    /// Reason why it ends.
    pub end: BackboneEnd,
    /// Frequency of vanishing amplitudes, Hz: that of the linear mode, which dashpots and the air
    /// between blades change a little.
    pub linear_hz: f64,
    /// Damping ratio of vanishing amplitudes.
    pub linear_ratio: f64,
}

/// Motion of a backbone that no excitation keeps up: what the air drives, friction spends.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct LimitCycle {
    /// Amplitude of the observed displacement, m.
    pub amplitude_m: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// True where smaller motions grow to it and larger ones decay to it; false where motions leave
    /// it either way.
    pub is_stable: bool,
}

impl Backbone {
    /// Limit cycles between two motions, by ascending amplitude of an observed displacement: the
    /// damping ratio passes through 0 there. The logarithm of the amplitude and the frequency are
    /// lines over that ratio.
    pub fn limit_cycles(&self, observation: usize) -> Vec<LimitCycle> {
        let between = |two: &[BackbonePoint]| {
            let [below, above] = two else { return None };
            let [from, to] = [below, above].map(|point| point.damping_ratio);
            if (from < 0.0) == (to < 0.0) {
                return None;
            }
            let share = from / (from - to);
            let line = |a: f64, b: f64| a + share * (b - a);
            let [a, b] = [below, above].map(|point| &point.orbit);
            let amplitude_m = |orbit: &Orbit| orbit.observed_amplitude[observation];
            Some(LimitCycle {
                amplitude_m: line(amplitude_m(a).ln(), amplitude_m(b).ln()).exp(),
                frequency_hz: line(a.frequency_hz, b.frequency_hz),
                is_stable: from < 0.0,
            })
        };
        self.points.windows(2).filter_map(between).collect()
    }
}

/// Follows a mode of the linear reference from small amplitudes through those asked for. `settings`
/// have the resolution and the tolerance; their frequencies are not used. `tell` hears of each
/// motion, and ends the backbone by `false`.
///
/// `None` where the observed displacement does not move in the mode, or the mode has no share of any
/// stuck mode.
pub fn backbone(
    problem: &Problem,
    damping: Rayleigh,
    static_state: &StaticState,
    settings: &SweepSettings,
    range: &BackboneRange,
    tell: &mut dyn FnMut(&BackbonePoint) -> bool,
) -> Option<Backbone> {
    let linear = &static_state.linear;
    let omega2 = linear.omega2_of_first_harmonic(&problem.reduced);
    let omega2 = *omega2.get(range.mode)?;
    let start = follow::LinearMode::find(problem, damping, static_state, range)?;
    let settings = SweepSettings {
        // eps is that of the frequency of the mode.
        frequencies_hz: vec![omega2.sqrt() / std::f64::consts::TAU],
        ..settings.clone()
    };
    let run = SweepSolvers::new(problem, damping, static_state, &settings, &[], &|_| ());
    Some(follow::followed(&run, &start, &settings, range, tell))
}

#[cfg(test)]
mod tests;
