//! Stability of motions in summary.json.

use serde::{Deserialize, Serialize};

use super::finite;
use crate::words::figure;
use dovetail_solver::dlft::{Bifurcation, Orbit, Response};
use dovetail_solver::integration::departure::Departure;
use dovetail_solver::results::peak::largest_stable_amplitude;
use dovetail_solver::results::quantities::at_excitation_frequency;
use dovetail_solver::stability::{Kind, Stability, Verdict};

/// Stability of a peak.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PeakStability {
    /// `None` where the motion was not judged.
    pub stable: Option<bool>,
    /// Kind of an instability: `real`, `period_doubling` or `neimark_sacker`.
    pub instability: Option<Kind>,
    /// Modulus of the largest Floquet multiplier.
    pub floquet_multiplier: Option<f64>,
    /// Argument of that multiplier, rad.
    pub floquet_argument_rad: Option<f64>,
    /// Reason why the motion was not judged.
    pub not_judged: Option<String>,
    /// Largest stable amplitude that was found, where the peak is unstable.
    pub largest_stable_amplitude_m: Option<f64>,
    /// Frequency of the largest stable amplitude, Hz.
    pub largest_stable_frequency_hz: Option<f64>,
    /// Integration in time from an unstable peak.
    pub departure: Option<DepartureSummary>,
}

/// Integration in time from an unstable peak.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DepartureSummary {
    /// Periods that were integrated.
    pub periods: usize,
    /// Least and largest amplitude of single periods in their second half.
    pub amplitude_range_m: [f64; 2],
}

/// Branch of responses of twice the period of the excitation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TwoPeriodsSummary {
    /// First and last frequency of the excitation, Hz.
    pub frequency_hz: [f64; 2],
    /// Motions on the branch.
    pub points: usize,
    /// Motions that were judged stable.
    pub stable_points: usize,
    /// Largest amplitude of the first observation: half of its range over both periods.
    pub largest_amplitude_m: Option<f64>,
    /// Frequency of that amplitude, Hz.
    pub largest_amplitude_frequency_hz: Option<f64>,
}

impl TwoPeriodsSummary {
    pub(super) fn new(branch: &Response) -> Self {
        let motions = branch.orbits.iter();
        let motions: Vec<Orbit> = motions
            .map(|orbit| at_excitation_frequency(orbit).0)
            .collect();
        let hz = motions.iter().map(|orbit| orbit.frequency_hz);
        let ends = [f64::min, f64::max].map(|end| hz.clone().reduce(end).unwrap_or_default());
        let amplitude = |orbit: &Orbit| orbit.observed_amplitude.first().copied();
        let largest = motions.iter().filter(|orbit| amplitude(orbit).is_some());
        let largest = largest.max_by(|a, b| {
            let [a, b] = [a, b].map(|orbit| amplitude(orbit).unwrap_or_default());
            a.total_cmp(&b)
        });
        let is_stable = |orbit: &&Orbit| orbit.stability.is_stable() == Some(true);
        Self {
            frequency_hz: ends,
            points: motions.len(),
            stable_points: motions.iter().filter(is_stable).count(),
            largest_amplitude_m: largest.and_then(amplitude).and_then(finite),
            largest_amplitude_frequency_hz: largest.map(|orbit| orbit.frequency_hz),
        }
    }
}

/// Change of stability along a curve other than a fold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BifurcationSummary {
    /// Row of response.csv before the change, 0 = first.
    pub after_row: usize,
    /// Frequency of the change, Hz.
    pub frequency_hz: f64,
    /// Amplitude of the first observation.
    pub amplitude_m: Option<f64>,
    /// Kind of the instability on its unstable side.
    pub kind: Kind,
}

impl BifurcationSummary {
    pub(super) fn new(found: &Bifurcation) -> Self {
        Self {
            after_row: found.after,
            frequency_hz: found.frequency_hz,
            amplitude_m: found.observed_amplitude.first().copied(),
            kind: found.kind,
        }
    }
}

impl PeakStability {
    /// Stability of the peak of observation `i` at this row; `None` where nobody asked for it.
    /// `departures` are the integrations from unstable peaks.
    pub(super) fn new(
        response: &Response,
        i: usize,
        row: usize,
        departures: &[Departure],
    ) -> Option<Self> {
        let orbit = &response.orbits[row];
        if orbit.stability == Stability::default() {
            return None;
        }
        let of = orbit.stability;
        let is_unstable = of.is_stable() == Some(false);
        let stable = largest_stable_amplitude(response, i).filter(|_| is_unstable);
        let left = departures.iter().filter(|_| is_unstable);
        let mut left = left.filter(|d| d.frequency_hz == orbit.frequency_hz);
        let departure = left.next().and_then(|departure| {
            let amplitude_range_m = *departure.amplitude_range_m.get(i)?;
            Some(DepartureSummary {
                periods: departure.periods,
                amplitude_range_m,
            })
        });
        Some(Self {
            stable: of.is_stable(),
            instability: of.kind(),
            floquet_multiplier: of.multiplier.and_then(|m| finite(m.norm())),
            floquet_argument_rad: of.multiplier.and_then(|m| finite(m.arg())),
            not_judged: match of.verdict {
                Verdict::NotJudged(reason) => Some(reason.to_string()),
                Verdict::Stable | Verdict::Unstable(_) => None,
            },
            largest_stable_amplitude_m: stable.map(|peak| peak.amplitude_m),
            largest_stable_frequency_hz: stable.map(|peak| peak.frequency_hz),
            departure,
        })
    }

    /// Name of the instability with its multiplier: `period doubling, multiplier -1.4`; `None` for a
    /// peak that is not unstable.
    pub fn instability_words(&self) -> Option<String> {
        let modulus = self.floquet_multiplier?;
        Some(match self.instability? {
            Kind::Real => format!("real multiplier {}", figure(modulus, 3)),
            Kind::PeriodDoubling => {
                format!("period doubling, multiplier {}", figure(-modulus, 3))
            }
            Kind::NeimarkSacker => {
                format!(
                    "Neimark-Sacker, multiplier of modulus {}",
                    figure(modulus, 3)
                )
            }
        })
    }
}
